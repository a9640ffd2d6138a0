//! Derivatives of a law by differences, for linear stability.

use nalgebra::{DMatrix, DVector};

use super::{Growing, TropismLaw};

/// Step of the central differences, relative to the argument or to one. Their error is 1e-8 of a
/// third derivative, and 1e-12 by rounding.
const STEP: f64 = 1e-4;

/// Derivatives ∂rates/∂y, ∂rates/∂x, ∂gradient/∂y and ∂gradient/∂x of a law at a point, with
/// variables y and stimuli x. The last one is zero for a law that does not [read the present
/// stimuli](super::Declaration::with_present).
pub(crate) fn law_matrices(
    law: &impl TropismLaw,
    at: &Growing,
    y: &[f64],
    x: &[f64],
) -> [DMatrix<f64>; 4] {
    let size = law.size();
    let gradient = |y: &[f64], x: &[f64], to: &mut [f64]| {
        to.copy_from_slice(law.gradient(at, y, size.present(x)).as_slice())
    };
    let by_present = if size.reads_present {
        differences(|x, to| gradient(y, x, to), 3, x)
    } else {
        DMatrix::zeros(3, x.len())
    };
    [
        differences(|y, to| law.rates(y, x, to), y.len(), y),
        differences(|x, to| law.rates(y, x, to), y.len(), x),
        differences(|y, to| gradient(y, x, to), 3, y),
        by_present,
    ]
}

/// Rates of the variables of a law in their steady state `y` under stimuli `x`, and for each the
/// sum of the terms that cancel in it, Σ |∂ẏ/∂y| |y| + Σ |∂ẏ/∂x| |x|, which is NaN if a rate is not
/// finite.
pub(crate) fn rates_in_steady_state(
    law: &impl TropismLaw,
    at: &Growing,
    y: &[f64],
    x: &[f64],
) -> Vec<(f64, f64)> {
    let mut rates = vec![f64::NAN; y.len()];
    law.rates(y, x, &mut rates);
    if rates.iter().all(|rate| *rate == 0.0) {
        return vec![(0.0, 0.0); y.len()];
    }
    let [by_variables, by_stimuli, ..] = law_matrices(law, at, y, x);
    let [y, x] = [y, x].map(|values| DVector::from_column_slice(values).abs());
    let terms = by_variables.abs() * y + by_stimuli.abs() * x;
    rates.into_iter().zip(terms.iter().copied()).collect()
}

/// Jacobian of a function with a given number of components, by central differences. The function
/// writes its components over zeros.
fn differences(f: impl Fn(&[f64], &mut [f64]), components: usize, at: &[f64]) -> DMatrix<f64> {
    let (mut x, mut minus) = (at.to_vec(), vec![0.0; components]);
    let mut out = DMatrix::zeros(components, at.len());
    for j in 0..at.len() {
        let h = STEP * at[j].abs().max(1.0);
        let mut column = out.column_mut(j);
        let plus = column.as_mut_slice();
        x[j] = at[j] + h;
        f(&x, plus);
        x[j] = at[j] - h;
        minus.fill(0.0);
        f(&x, &mut minus);
        x[j] = at[j];
        plus.iter_mut()
            .zip(&minus)
            .for_each(|(plus, minus)| *plus = (*plus - minus) / (2.0 * h));
    }
    out
}
