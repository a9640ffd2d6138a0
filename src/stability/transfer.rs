//! The linear response of the laws at one material point.

use faer::MatRef;
use nalgebra::{Complex, DMatrix, DVector};

use super::analytic::AnalyticMatrix;
use super::error::StabilityError;
use super::steady::SteadyState;
use crate::error::ParameterError;
use crate::tropism::{Declaration, TropismLaw, law_matrices};

/// Points whose laws linearise alike to this share one transfer function.
const ALIKE: f64 = 1e-8;

/// Derivatives of the laws at one material point.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TransferFunction {
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
    /// The variables' own rates, 1/s: the eigenvalues of ∂rates/∂variables.
    pub own_rates: Vec<Complex<f64>>,
}

impl TransferFunction {
    /// Linearises `law` about its steady state at a point that elongates at `rate`, 1/s; `local` is ∂stimuli/∂strain.
    pub fn of(
        law: &impl TropismLaw,
        rate: f64,
        steady: &SteadyState,
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
            delays: laws.variables().iter().map(|variable| variable.delay.unwrap_or(0.0)).collect(),
            rates_y,
            rates_x,
            gradient_y,
            gradient_x,
            local: local.clone(),
            own_rates: Vec::new(),
        };
        if !(rate.is_finite() && out.derivatives().into_iter().flatten().all(|x| x.is_finite())) {
            return Err(StabilityError::NotFinite { what: "derivative of the laws" });
        }
        for (j, variable) in laws.variables().iter().enumerate() {
            match variable.delay {
                Some(delay) => ParameterError::not_negative("delay of a law", delay)?,
                // What is not read has no effect.
                None => out.gradient_y.column_mut(j).fill(0.0),
            }
        }
        if v > 0 {
            let matrix = MatRef::from_column_major_slice(out.rates_y.as_slice(), v, v);
            let what = "search for the laws' own rates";
            let failed = |_| StabilityError::NoConvergence { what, residual: out.rates_y.amax() };
            out.own_rates = matrix.eigenvalues().map_err(failed)?;
        }
        // Rounding of differences is no rate.
        let noise = 1e-9 * out.rates_y.amax();
        out.own_rates.iter_mut().filter(|rate| rate.norm() <= noise).for_each(|rate| *rate = Complex::ZERO);
        Ok(out)
    }

    pub fn is_like(&self, other: &Self) -> bool {
        let near = |(a, b): (&DMatrix<f64>, &DMatrix<f64>)| (a - b).amax() <= ALIKE * a.amax().max(b.amax());
        (self.rate - other.rate).abs() <= ALIKE * self.rate.abs()
            && self.derivatives().into_iter().zip(other.derivatives()).all(near)
    }

    fn derivatives(&self) -> [&DMatrix<f64>; 5] {
        [&self.rates_y, &self.rates_x, &self.gradient_y, &self.gradient_x, &self.local]
    }

    /// The components of the intrinsic strain that answer to anything.
    pub fn driven(&self) -> Vec<usize> {
        let reads = |c: usize| self.gradient_y.row(c).amax() + self.gradient_x.row(c).amax() > 0.0;
        (0..3).filter(|&c| self.rate != 0.0 && reads(c)).collect()
    }

    /// The largest |λ| with Re λ ≥ `abscissa` at which |λ| does not exceed the norm of T(λ) X, for stimuli X of these sizes.
    pub fn radius(&self, stimuli: &DVector<f64>, abscissa: f64) -> f64 {
        // Sizes of the variables: what drives them, directly and through each other. Any positive ones give a bound.
        let rate = self.rates_y.amax().max(f64::MIN_POSITIVE);
        let driven = self.rates_x.abs() * stimuli / rate;
        let mut sizes = driven.clone();
        for _ in 0..sizes.len() {
            sizes = driven.sup(&(self.rates_y.abs() * &sizes / rate));
        }
        sizes.apply(|size| *size = if *size > 0.0 { *size } else { 1.0 });
        let inverse = DMatrix::from_diagonal(&sizes.map(|size| 1.0 / size));
        let sizes = DMatrix::from_diagonal(&sizes);
        let stimuli = DMatrix::from_diagonal(stimuli);
        let longest = self.delays.iter().copied().fold(0.0, f64::max);
        let grown = (-abscissa.min(0.0) * longest).exp();
        // Each stimulus divided by its size has norm one, all together √m.
        let all = self.rate * (stimuli.nrows() as f64).sqrt();
        let direct = all * (&self.gradient_x * &stimuli).norm();
        let filtered = all * (&self.gradient_y * &sizes).norm() * grown * (&inverse * &self.rates_x * &stimuli).norm();
        let relax = (inverse * &self.rates_y * sizes).norm();
        // (R − direct)(R − relax) = filtered.
        let (sum, product) = (direct + relax, direct * relax - filtered);
        0.5 * (sum + (sum * sum - 4.0 * product).max(0.0).sqrt())
    }

    /// T(λ), the rate of the three components of the strain by the stimuli.
    pub fn at(&self, z: Complex<f64>) -> AnalyticMatrix {
        let v = self.delays.len();
        let rate = Complex::from(self.rate);
        let mut value = self.gradient_x.map(Complex::from);
        let mut derivative = DMatrix::zeros(value.nrows(), value.ncols());
        if v > 0 {
            let filter = DMatrix::from_diagonal_element(v, v, z) - self.rates_y.map(Complex::from);
            // Singular only where λ is one of the variables' own rates, left of every region that is searched.
            let filter = filter.lu();
            let nan = || DMatrix::from_element(v, self.rates_x.ncols(), Complex::from(f64::NAN));
            let solve = |right: &DMatrix<Complex<f64>>| filter.solve(right).unwrap_or_else(nan);
            let filtered = solve(&self.rates_x.map(Complex::from));
            let twice = solve(&filtered);
            let lags: Vec<Complex<f64>> = self.delays.iter().map(|d| (-z * d).exp()).collect();
            let read = DMatrix::from_fn(3, v, |c, j| lags[j] * self.gradient_y[(c, j)]);
            let later = DMatrix::from_fn(3, v, |c, j| -read[(c, j)] * self.delays[j]);
            derivative += later * &filtered - &read * twice;
            value += read * filtered;
        }
        AnalyticMatrix { value: value * rate, derivative: derivative * rate }
    }
}
