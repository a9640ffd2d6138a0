//! The linear response of the laws at one material point.

use nalgebra::{Complex, DMatrix, DVector};

use super::settled::Settled;
use crate::error::ParameterError;
use crate::tropism::{Declaration, LawDerivatives, TropismLaw};

/// Points whose laws linearise alike to this share one transfer function.
const ALIKE: f64 = 1e-8;

/// Derivatives of the laws at one material point.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Transfer {
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
    /// The own rates of the variables: the eigenvalues of ∂rates/∂variables.
    pub memory: Vec<Complex<f64>>,
}

impl Transfer {
    /// Of a law at a place where it has settled.
    pub fn of(law: &impl TropismLaw, rate: f64, settled: &Settled, point: usize) -> Result<Self, ParameterError> {
        let laws = Declaration::of(law);
        let (v, m) = (laws.size().variables, laws.size().stimuli);
        let mut out = Self {
            rate,
            delays: laws.variables().iter().map(|variable| variable.delay.unwrap_or(f64::INFINITY)).collect(),
            rates_y: DMatrix::zeros(v, v),
            rates_x: DMatrix::zeros(v, m),
            gradient_y: DMatrix::zeros(3, v),
            gradient_x: DMatrix::zeros(3, m),
            local: settled.local[point].clone(),
            memory: Vec::new(),
        };
        let mut derivatives = LawDerivatives {
            rates_by_variables: out.rates_y.view_mut((0, 0), (v, v)),
            rates_by_stimuli: out.rates_x.view_mut((0, 0), (v, m)),
            gradient_by_variables: out.gradient_y.view_mut((0, 0), (3, v)),
            gradient_by_stimuli: out.gradient_x.view_mut((0, 0), (3, m)),
        };
        law.derivatives(&settled.places[point], &settled.variables[point], &settled.stimuli[point], &mut derivatives);
        ParameterError::finite("derivative of the laws", out.size())?;
        for delay in &out.delays {
            ParameterError::unless(*delay >= 0.0, "delay of a law", *delay, "not negative (s)")?;
        }
        // Rounding of differences is no rate.
        let noise = 1e-9 * out.rates_y.amax();
        out.memory = if v > 0 { out.rates_y.complex_eigenvalues().iter().copied().collect() } else { Vec::new() };
        out.memory.iter_mut().filter(|rate| rate.norm() <= noise).for_each(|rate| *rate = Complex::ZERO);
        Ok(out)
    }

    pub fn is_like(&self, other: &Self) -> bool {
        let near = |a: &DMatrix<f64>, b: &DMatrix<f64>| (a - b).amax() <= ALIKE * a.amax().max(b.amax());
        (self.rate - other.rate).abs() <= ALIKE * self.rate.abs()
            && near(&self.rates_y, &other.rates_y)
            && near(&self.rates_x, &other.rates_x)
            && near(&self.gradient_y, &other.gradient_y)
            && near(&self.gradient_x, &other.gradient_x)
            && near(&self.local, &other.local)
    }

    /// The sum of all derivatives' sizes: not finite if one of them is not.
    fn size(&self) -> f64 {
        let parts = [&self.rates_y, &self.rates_x, &self.gradient_y, &self.gradient_x, &self.local];
        parts.iter().flat_map(|part| part.iter()).map(|x| x.abs()).sum::<f64>() + self.rate.abs()
    }

    /// Whether component `c` of the intrinsic strain answers to anything.
    pub fn drives(&self, c: usize) -> bool {
        let reads = self.gradient_y.row(c).iter().zip(&self.delays).any(|(g, d)| *g != 0.0 && d.is_finite());
        self.rate != 0.0 && (reads || self.gradient_x.row(c).iter().any(|g| *g != 0.0))
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
        let longest = self.delays.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
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

    /// T(λ), the rate of the three components of the strain by the stimuli, and T'(λ).
    pub fn at(&self, z: Complex<f64>) -> (DMatrix<Complex<f64>>, DMatrix<Complex<f64>>) {
        let v = self.delays.len();
        let rate = Complex::from(self.rate);
        let mut value = self.gradient_x.map(Complex::from);
        let mut slope = DMatrix::zeros(value.nrows(), value.ncols());
        if v > 0 {
            let mut filter = -self.rates_y.map(Complex::from);
            for i in 0..v {
                filter[(i, i)] += z;
            }
            // Singular only where λ is a rate of the memories, left of every region that is searched.
            let filter = filter.lu();
            let filtered = filter.solve(&self.rates_x.map(Complex::from));
            let twice = filtered.as_ref().and_then(|f| filter.solve(f));
            let nan = || DMatrix::from_element(v, self.rates_x.ncols(), Complex::from(f64::NAN));
            let (filtered, twice) = (filtered.unwrap_or_else(nan), twice.unwrap_or_else(nan));
            let lag = |delay: f64| if delay.is_finite() { (-z * delay).exp() } else { Complex::ZERO };
            let read = DMatrix::from_fn(3, v, |c, j| lag(self.delays[j]) * self.gradient_y[(c, j)]);
            let slower = DMatrix::from_fn(3, v, |c, j| {
                let delay = self.delays[j];
                if delay.is_finite() { -read[(c, j)] * delay } else { Complex::ZERO }
            });
            slope += slower * &filtered - &read * twice;
            value += read * filtered;
        }
        (value * rate, slope * rate)
    }
}
