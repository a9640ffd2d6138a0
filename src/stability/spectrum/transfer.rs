//! The linear response of the laws at one material point.

use nalgebra::{Complex, DMatrix, DVector};

use super::sets::connected;
use crate::error::{ParameterError, ensure};
use crate::linearisation::{AnalyticMatrix, StabilityError, SteadyLaws, eigenvalues};
use crate::tropism::{Declaration, TropismLaw, law_matrices};

/// Largest relative difference of two matrices that are equal up to the rounding of the differences
/// from which they are computed.
pub(super) const ROUNDING: f64 = 1e-8;

/// Derivatives of the laws at one material point.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::stability) struct TransferFunction {
    /// REGR, 1/s.
    pub rate: f64,
    pub delays: Vec<f64>,
    /// ∂rates/∂variables and ∂rates/∂stimuli.
    pub rates_y: DMatrix<f64>,
    pub rates_x: DMatrix<f64>,
    /// ∂gradient/∂variables and ∂gradient/∂stimuli, three rows.
    pub gradient_y: DMatrix<f64>,
    pub gradient_x: DMatrix<f64>,
    /// ∂stimuli/∂strain at the point itself, three columns.
    pub local: DMatrix<f64>,
    /// Own rates of the variables, 1/s: the eigenvalues of ∂rates/∂variables. Empty before
    /// `find_own_rates`.
    pub own_rates: Vec<Complex<f64>>,
    /// Own rates of the variables through which the strain at the point acts on its own gradient,
    /// and those that grow, 1/s.
    pub local_rates: Vec<Complex<f64>>,
    /// Sets of variables whose rates depend on each other. ∂rates/∂variables is block diagonal by
    /// them.
    sets: Vec<Vec<usize>>,
}

impl TransferFunction {
    /// Linearises `law` about its steady state at a point that elongates at `rate`, 1/s; `local` is
    /// ∂stimuli/∂strain.
    pub fn of(
        law: &impl TropismLaw,
        rate: f64,
        steady: &SteadyLaws,
        point: usize,
        local: &DMatrix<f64>,
    ) -> Result<Self, StabilityError> {
        let laws = Declaration::of(law);
        let v = laws.size().variables;
        let (y, x) = (steady.variables.column(point), steady.stimuli.column(point));
        let [rates_y, rates_x, gradient_y, gradient_x] =
            law_matrices(law, &steady.places[point], y.as_slice(), x.as_slice());
        let mut out = Self {
            rate,
            delays: laws
                .variables()
                .iter()
                .map(|variable| variable.delay.unwrap_or(0.0))
                .collect(),
            rates_y,
            rates_x,
            gradient_y,
            gradient_x,
            local: local.clone(),
            own_rates: Vec::new(),
            local_rates: Vec::new(),
            sets: Vec::new(),
        };
        let finite = rate.is_finite()
            && out
                .derivatives()
                .into_iter()
                .flatten()
                .all(|x| x.is_finite());
        ensure(
            finite,
            StabilityError::NotFinite {
                what: "derivative of the laws",
            },
        )?;
        for (j, variable) in laws.variables().iter().enumerate() {
            match variable.delay {
                Some(delay) => ParameterError::not_negative("delay of a law", delay, "s")?,
                // A variable that is not read has no effect.
                None => out.gradient_y.column_mut(j).fill(0.0),
            }
        }
        let pairs = (0..v).flat_map(|j| (0..v).map(move |i| (i, j)));
        out.sets = connected(v, pairs.filter(|&at| out.rates_y[at] != 0.0));
        Ok(out)
    }

    /// Number of operations of a factorisation: Σ n³ over the sets of n variables that depend on
    /// each other.
    pub fn work(&self) -> f64 {
        self.sets.iter().map(|set| (set.len() as f64).powi(3)).sum()
    }

    /// Computes the own rates of the variables.
    pub fn find_own_rates(&mut self) -> Result<(), StabilityError> {
        // Smaller rates are rounding errors of the differences.
        let noise = 1e-9 * self.rates_y.amax();
        for set in &self.sets {
            let block =
                DMatrix::from_fn(set.len(), set.len(), |i, j| self.rates_y[(set[i], set[j])]);
            let mut rates = eigenvalues(&block, "search for the laws' own rates")?;
            rates
                .iter_mut()
                .filter(|rate| rate.norm() <= noise)
                .for_each(|rate| *rate = Complex::ZERO);
            let driven = (self.rates_x.select_rows(set) * &self.local).amax() > 0.0;
            let acts = driven && self.gradient_y.select_columns(set).amax() > 0.0;
            self.local_rates
                .extend(rates.iter().filter(|rate| acts || rate.re > 0.0));
            self.own_rates.append(&mut rates);
        }
        Ok(())
    }

    /// Whether two points have the same transfer function, up to rounding.
    pub fn is_like(&self, other: &Self) -> bool {
        let near = |(a, b): (&DMatrix<f64>, &DMatrix<f64>)| {
            (a - b).amax() <= ROUNDING * a.amax().max(b.amax())
        };
        (self.rate - other.rate).abs() <= ROUNDING * self.rate.abs()
            && self
                .derivatives()
                .into_iter()
                .zip(other.derivatives())
                .all(near)
    }

    fn derivatives(&self) -> [&DMatrix<f64>; 5] {
        [
            &self.rates_y,
            &self.rates_x,
            &self.gradient_y,
            &self.gradient_x,
            &self.local,
        ]
    }

    /// The components of the intrinsic strain that change with variables or stimuli.
    pub fn driven(&self) -> Vec<usize> {
        let reads = |c: usize| self.gradient_y.row(c).amax() + self.gradient_x.row(c).amax() > 0.0;
        (0..3).filter(|&c| self.rate != 0.0 && reads(c)).collect()
    }

    /// A bound of all |λ| with Re λ ≥ `abscissa` that do not exceed the norm of T(λ) X, for stimuli
    /// X of these sizes.
    pub fn radius(&self, stimuli: &DVector<f64>, abscissa: f64) -> f64 {
        // The sizes of the variables are estimated from the stimuli on which their rates depend,
        // directly and through other variables. The bound holds for any positive sizes.
        let rate = self.rates_y.amax().max(f64::MIN_POSITIVE);
        let driven = self.rates_x.abs() * stimuli / rate;
        let mut sizes = driven.clone();
        let coupling = self.rates_y.abs() / rate;
        for _ in 0..self.sets.iter().map(Vec::len).max().unwrap_or(0) {
            sizes = driven.sup(&(&coupling * &sizes));
        }
        sizes.apply(|size| *size = if *size > 0.0 { *size } else { 1.0 });
        let longest = self.delays.iter().copied().fold(0.0, f64::max);
        let grown = (-abscissa.min(0.0) * longest).exp();
        // Each stimulus divided by its size has norm one, and all of them together √m.
        let all = self.rate * (stimuli.len() as f64).sqrt();
        let direct = all * scaled(&self.gradient_x, |_, k| stimuli[k]).norm();
        let read = scaled(&self.gradient_y, |_, j| sizes[j]).norm();
        let filtered =
            all * read * grown * scaled(&self.rates_x, |i, k| stimuli[k] / sizes[i]).norm();
        let relax = scaled(&self.rates_y, |i, j| sizes[j] / sizes[i]).norm();
        // (R − direct)(R − relax) = filtered.
        let (sum, product) = (direct + relax, direct * relax - filtered);
        0.5 * (sum + (sum * sum - 4.0 * product).max(0.0).sqrt())
    }

    /// T(λ), the rate of the three components of the strain by the stimuli.
    pub fn at(&self, z: Complex<f64>) -> AnalyticMatrix {
        let rate = Complex::from(self.rate);
        let mut value = self.gradient_x.map(Complex::from);
        let mut derivative = DMatrix::zeros(value.nrows(), value.ncols());
        let nan = |n: usize, m: usize| DMatrix::from_element(n, m, Complex::from(f64::NAN));
        for set in &self.sets {
            let driven = self.rates_x.select_rows(set);
            if driven.amax() == 0.0 {
                continue;
            }
            // The matrix is singular only where λ is one of the own rates, left of every region
            // that is searched.
            let n = set.len();
            let filter = DMatrix::from_fn(n, n, |i, j| {
                let rate = Complex::from(self.rates_y[(set[i], set[j])]);
                if i == j { z - rate } else { -rate }
            });
            let filter = filter.lu();
            let solve = |right: &DMatrix<Complex<f64>>| {
                filter.solve(right).unwrap_or_else(|| nan(n, right.ncols()))
            };
            let filtered = solve(&driven.map(Complex::from));
            let twice = solve(&filtered);
            let read = DMatrix::from_fn(3, n, |c, j| {
                (-z * self.delays[set[j]]).exp() * self.gradient_y[(c, set[j])]
            });
            let later = DMatrix::from_fn(3, n, |c, j| -read[(c, j)] * self.delays[set[j]]);
            derivative += later * &filtered - &read * twice;
            value += read * filtered;
        }
        AnalyticMatrix {
            value: value * rate,
            derivative: derivative * rate,
        }
    }
}

/// A matrix with each entry multiplied by a factor.
fn scaled(matrix: &DMatrix<f64>, factor: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        matrix[(i, j)] * factor(i, j)
    })
}
