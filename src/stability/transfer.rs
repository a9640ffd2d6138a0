//! The linear response of the laws at one material point.

use nalgebra::{Complex, DMatrix, DVector};

/// Step of the differences of a law's functions, relative to the argument or to one.
const STEP: f64 = 1e-4;
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
}

/// Derivative of a vector function by central differences.
pub(super) fn jacobian(f: impl Fn(&[f64]) -> Vec<f64>, at: &[f64], rows: usize) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(rows, at.len());
    let mut x = at.to_vec();
    for j in 0..at.len() {
        let h = STEP * at[j].abs().max(1.0);
        x[j] = at[j] + h;
        let plus = DVector::from_vec(f(&x));
        x[j] = at[j] - h;
        let minus = DVector::from_vec(f(&x));
        x[j] = at[j];
        out.set_column(j, &((plus - minus) / (2.0 * h)));
    }
    out
}

impl Transfer {
    pub fn is_like(&self, other: &Self) -> bool {
        let near = |a: &DMatrix<f64>, b: &DMatrix<f64>| (a - b).amax() <= ALIKE * a.amax().max(b.amax());
        (self.rate - other.rate).abs() <= ALIKE * self.rate.abs()
            && near(&self.rates_y, &other.rates_y)
            && near(&self.rates_x, &other.rates_x)
            && near(&self.gradient_y, &other.gradient_y)
            && near(&self.gradient_x, &other.gradient_x)
            && near(&self.local, &other.local)
    }

    /// Whether component `c` of the intrinsic strain answers to anything.
    pub fn drives(&self, c: usize) -> bool {
        let reads = self.gradient_y.row(c).iter().zip(&self.delays).any(|(g, d)| *g != 0.0 && d.is_finite());
        self.rate != 0.0 && (reads || self.gradient_x.row(c).iter().any(|g| *g != 0.0))
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
