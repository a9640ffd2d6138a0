//! The linear response of a law, for the stability of a shoot.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixViewMut, DVector};

use super::{Growing, TropismLaw};

/// Step of the differences, relative to the argument or to one. Central differences then err by 1e-8 of a third derivative,
/// and rounding by 1e-12.
const STEP: f64 = 1e-4;

/// The derivatives of a law's rates and gradient at a place, rows by what changes and columns by what it is changed by.
/// They are zero before the law writes them.
///
/// A law that offers its own should be held against differences:
///
/// ```
/// use morphorod::tropism::{Declaration, Growing, LawDerivatives, TropismLaw, Variable};
/// use morphorod::nalgebra::{DMatrix, Vector3};
///
/// /// Two variables relax to two stimuli; the gradient is a multiple of them.
/// struct Own;
///
/// impl TropismLaw for Own {
///     fn declare(&self, to: &mut Declaration) {
///         to.stimuli(2);
///         for _ in 0..2 {
///             to.variable(Variable::read_after(720.0).relaxing_in(720.0));
///         }
///     }
///     fn rates(&self, y: &[f64], x: &[f64], rates: &mut [f64]) {
///         rates.copy_from_slice(&[(x[0] - y[0]) / 720.0, (x[1] - y[1]) / 720.0]);
///     }
///     fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
///         Vector3::new(past[0], past[1], 0.0) * -20.0
///     }
///     fn derivatives(&self, _at: &Growing, _y: &[f64], _x: &[f64], out: &mut LawDerivatives) {
///         for j in 0..2 {
///             out.rates_by_variables[(j, j)] = -1.0 / 720.0;
///             out.rates_by_stimuli[(j, j)] = 1.0 / 720.0;
///             out.gradient_by_variables[(j, j)] = -20.0;
///         }
///     }
/// }
///
/// let law = Own;
/// let at = Growing::new(0.0, 5e-4, 0.01);
/// let (y, x) = ([3.0, -2.0], [1.0, 5.0]);
/// let [own, differences] = [true, false].map(|own| {
///     let [mut ry, mut rx] = [DMatrix::zeros(2, 2), DMatrix::zeros(2, 2)];
///     let [mut gy, mut gx] = [DMatrix::zeros(3, 2), DMatrix::zeros(3, 2)];
///     let mut out = LawDerivatives {
///         rates_by_variables: ry.as_view_mut(),
///         rates_by_stimuli: rx.as_view_mut(),
///         gradient_by_variables: gy.as_view_mut(),
///         gradient_by_stimuli: gx.as_view_mut(),
///     };
///     if own { law.derivatives(&at, &y, &x, &mut out) } else { out.by_differences(&law, &at, &y, &x) }
///     [ry, rx, gy, gx]
/// });
/// for (own, other) in own.iter().zip(&differences) {
///     // The law is linear: rounding is left.
///     assert!((own - other).amax() <= 1e-9 * own.amax());
/// }
/// ```
#[derive(Debug)]
pub struct LawDerivatives<'a> {
    /// ∂ẏ/∂y of the [rates](TropismLaw::rates), 1/s.
    pub rates_by_variables: DMatrixViewMut<'a, f64>,
    /// ∂ẏ/∂x.
    pub rates_by_stimuli: DMatrixViewMut<'a, f64>,
    /// ∂gradient/∂y, three rows: the [gradient](TropismLaw::gradient) by the variables of some time ago.
    pub gradient_by_variables: DMatrixViewMut<'a, f64>,
    /// ∂gradient/∂x, three rows; zero for a law that does not [read the present](super::Declaration::with_present).
    pub gradient_by_stimuli: DMatrixViewMut<'a, f64>,
}

impl LawDerivatives<'_> {
    /// The derivatives of one law among several, which has these variables and stimuli of all.
    pub fn part(&mut self, variables: Range<usize>, stimuli: Range<usize>) -> LawDerivatives<'_> {
        let (v, m) = (variables.start, stimuli.start);
        let (nv, nm) = (variables.len(), stimuli.len());
        LawDerivatives {
            rates_by_variables: self.rates_by_variables.view_mut((v, v), (nv, nv)),
            rates_by_stimuli: self.rates_by_stimuli.view_mut((v, m), (nv, nm)),
            gradient_by_variables: self.gradient_by_variables.view_mut((0, v), (3, nv)),
            gradient_by_stimuli: self.gradient_by_stimuli.view_mut((0, m), (3, nm)),
        }
    }

    /// Central differences of the law's own functions, steps of 1e-4 of the argument or of one, whichever is larger.
    pub fn by_differences<T: TropismLaw + ?Sized>(
        &mut self,
        law: &T,
        at: &Growing,
        variables: &[f64],
        stimuli: &[f64],
    ) {
        let size = law.size();
        let rates = |y: &[f64], x: &[f64]| {
            let mut out = DVector::zeros(y.len());
            law.rates(y, x, out.as_mut_slice());
            out
        };
        let gradient =
            |y: &[f64], x: &[f64]| DVector::from_column_slice(law.gradient(at, y, size.present(x)).as_slice());
        differences(|y| rates(y, stimuli), variables, &mut self.rates_by_variables);
        differences(|x| rates(variables, x), stimuli, &mut self.rates_by_stimuli);
        differences(|y| gradient(y, stimuli), variables, &mut self.gradient_by_variables);
        if size.reads_present {
            differences(|x| gradient(variables, x), stimuli, &mut self.gradient_by_stimuli);
        }
    }
}

/// ∂rates/∂y, ∂rates/∂x, ∂gradient/∂y and ∂gradient/∂x of a law at a point, with variables y and stimuli x.
pub(crate) fn law_matrices(law: &impl TropismLaw, at: &Growing, y: &[f64], x: &[f64]) -> [DMatrix<f64>; 4] {
    let (v, m) = (y.len(), x.len());
    let mut out = [DMatrix::zeros(v, v), DMatrix::zeros(v, m), DMatrix::zeros(3, v), DMatrix::zeros(3, m)];
    let [rates_y, rates_x, gradient_y, gradient_x] = &mut out;
    law.derivatives(
        at,
        y,
        x,
        &mut LawDerivatives {
            rates_by_variables: rates_y.as_view_mut(),
            rates_by_stimuli: rates_x.as_view_mut(),
            gradient_by_variables: gradient_y.as_view_mut(),
            gradient_by_stimuli: gradient_x.as_view_mut(),
        },
    );
    out
}

fn differences(f: impl Fn(&[f64]) -> DVector<f64>, at: &[f64], out: &mut DMatrixViewMut<f64>) {
    let mut x = at.to_vec();
    for j in 0..at.len() {
        let h = STEP * at[j].abs().max(1.0);
        x[j] = at[j] + h;
        let plus = f(&x);
        x[j] = at[j] - h;
        let minus = f(&x);
        x[j] = at[j];
        out.set_column(j, &((plus - minus) / (2.0 * h)));
    }
}
