//! What disturbances grow to before they decay.
//!
//! The roots of a shoot that is far from normal say little of its first hours: waves grow along it while each of them decays.

use nalgebra::{Complex, DMatrix, Matrix3, RowDVector, Vector3};

use super::analytic::Analytic;
use super::count::count_right_of;

use super::characteristic::CharacteristicMatrix;
use super::inverse_transform::{DAMPING, SAMPLES, Series};
use super::linearisation::Linearisation;
use super::parts::Spectrum;
use crate::error::ParameterError;
use crate::stability::error::StabilityError;

/// Terms of the series are doubled until the gain moves by no more than this share of the largest.
const TOLERANCE: f64 = 1e-4;
/// Most terms.
const MOST: usize = 1 << 14;
/// The time of the largest gain is found to this share of the samples' distance: the gain is flat there.
const SHARP: f64 = 1e-3;

/// How far disturbances of a stationary shoot carry its apex, against how far they did at first.
///
/// A disturbance δu* of the intrinsic strain that has lasted for ever is let go at t = 0. The *gain* at a later time t is
///
/// ```text
/// g(t) = max |δp(t)| over all δu* of one size  /  max |δp(0)| over all δu* of one size
/// ```
///
/// with δp the displacement of the apex, and ∫ |δu*|² ds over the growth zone the square of the size. So g(0) = 1, and g decays in
/// the end if no root is unstable. (The ratio |δp(t)|/|δp(0)| of one disturbance has no bound: it need not move the apex at first.)
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TransientGrowth {
    /// The largest gain.
    pub gain: f64,
    /// When it is reached, s; the duration itself if the gain still rises then.
    pub time: f64,
    /// By how much the gain may be off, estimated. It knows the integral over λ, and not the mesh.
    pub error: f64,
    /// Times (s) and gains, evenly spaced from zero to the duration.
    pub history: Vec<(f64, f64)>,
    /// The disturbance with the largest gain, at the points of the growth zone, components along the directors, 1/m. It is as
    /// large as the one that moves the apex by 1 m at first and no smaller one does.
    pub strain: Vec<Vector3<f64>>,
}

impl Linearisation {
    /// How far small disturbances carry the apex within a duration (s), against how far they did at first.
    ///
    /// A shoot whose roots are all stable may carry a disturbance a hundred times as far before it decays. Where the gain
    /// times the disturbances of real life is no longer small, the roots do not say what happens.
    ///
    /// # Errors
    /// A duration that is not positive, roots that cannot be counted, laws that do not settle under constant stimuli, or
    /// [`TooMuchWork`](StabilityError::TooMuchWork): the duration holds too many of the shoot's shortest times.
    pub fn transient_growth(&self, duration: f64) -> Result<TransientGrowth, StabilityError> {
        ParameterError::positive("duration of transient growth", duration)?;
        let release = Release::of(&self.characteristic)?;
        let mut series = Series::new(self.line_right_of_all(DAMPING / duration)?, duration);
        let mut gains: Vec<f64> = Vec::new();
        let error = loop {
            series.extend(|z| release.rest(&self.characteristic, &self.spectrum, z))?;
            let rests = series.sampled();
            let next: Vec<f64> =
                rests.iter().enumerate().map(|(j, rest)| release.gain(series.time(j), rest).0).collect();
            let highest = next.iter().copied().fold(0.0, f64::max);
            let moved = next.iter().zip(&gains).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // Nothing has moved at t = 0. What the series has there else belongs to roots right of its line: those of the mesh.
            let error = moved.max((next[0] - 1.0).abs());
            let settled = !gains.is_empty() && error <= TOLERANCE * highest;
            gains = next;
            gains[0] = 1.0;
            if settled {
                break error;
            }
            if !(series.terms() < MOST && highest.is_finite()) {
                return Err(StabilityError::TooMuchWork { evaluations: series.terms() });
            }
        };
        let unmoved = DMatrix::zeros(3, self.unknowns());
        let gain = |t: f64| release.gain(t, &if t > 0.0 { series.at(t) } else { unmoved.clone() });
        let most = (0..=SAMPLES).fold(0, |best, j| if gains[j] > gains[best] { j } else { best });
        let (before, after) = (series.time(most.saturating_sub(1)), series.time((most + 1).min(SAMPLES)));
        let time = if most == 0 { 0.0 } else { highest_between(before, after, |t| gain(t).0) };
        let (largest, disturbance) = gain(time);
        let mut strain = vec![Vector3::zeros(); self.characteristic.kind.len()];
        for (&(i, c), x) in self.characteristic.unknowns.iter().zip(disturbance.iter()) {
            strain[i][c] = *x;
        }
        let history = gains.iter().enumerate().map(|(j, gain)| (series.time(j), *gain)).collect();
        Ok(TransientGrowth { gain: largest, time, error, history, strain })
    }

    /// A line right of all roots, by no less than `distance`, 1/s.
    fn line_right_of_all(&self, distance: f64) -> Result<f64, StabilityError> {
        let isolated = self.spectrum.blocks().map(|(_, block)| block as &dyn Analytic);
        for part in isolated.chain(self.spectrum.points.iter().map(|point| point as &dyn Analytic)) {
            if count_right_of(part, distance)? > 0 {
                return Ok(distance + self.leading()?.1.re);
            }
        }
        Ok(distance)
    }
}

/// A disturbance that is let go. A past in which the intrinsic strain was off by δu* for ever obeys
///
/// ```text
/// δu*(λ) = [1 − M(λ)⁻¹ M(0)] δu*/λ,
/// ```
///
/// since M(0) δu* is what the laws go on asking for. With C the displacement of the apex, C M⁻¹ tends to C/λ far from zero; what
/// follows from C/(λ + σ) is known, and the rest falls off as λ⁻³.
struct Release {
    /// C, and C M(0).
    apex: DMatrix<f64>,
    drift: DMatrix<f64>,
    /// M(0).
    still: DMatrix<Complex<f64>>,
    /// σ, 1/s.
    rate: f64,
    /// Unknowns of size one, 1/m: each stands for a part of the shoot.
    sizes: RowDVector<f64>,
    /// The largest displacement by a disturbance of size one at t = 0.
    first: f64,
}

impl Release {
    fn of(problem: &CharacteristicMatrix) -> Result<Self, StabilityError> {
        let all: Vec<usize> = (0..problem.unknowns.len()).collect();
        let zero = Complex::ZERO;
        let still = problem.matrix(zero, &problem.transfers_at(zero), &problem.response, &all).value;
        if still.iter().any(|x| !x.re.is_finite()) {
            return Err(StabilityError::NotFinite { what: "steady response of the laws" });
        }
        let apex = problem.displacement.rows(problem.displacement.nrows() - 3, 3).into_owned();
        let drift = &apex * still.map(|z| z.re);
        let sizes = problem.unknowns.iter().map(|&(i, _)| problem.arcs[i].sqrt().recip());
        let sizes = RowDVector::from_iterator(all.len(), sizes);
        let rate = -problem.leftmost();
        let mut out = Self { apex, drift, still, rate, sizes, first: 1.0 };
        out.first = out.gain(0.0, &DMatrix::zeros(3, all.len())).0;
        Ok(out)
    }

    /// The transform at λ of what is left of the displacement of the apex by each unknown.
    fn rest(
        &self,
        problem: &CharacteristicMatrix,
        spectrum: &Spectrum,
        z: Complex<f64>,
    ) -> Result<DMatrix<Complex<f64>>, StabilityError> {
        let transfers = problem.transfers_at(z);
        let mut flow = DMatrix::zeros(3, self.apex.ncols());
        for block in spectrum.all_blocks() {
            let apex = self.apex.select_columns(&block.unknowns).transpose().map(Complex::from);
            let transposed = block.matrix(z, &transfers).value.transpose();
            let found = transposed.lu().solve(&apex).ok_or(SINGULAR)?;
            for (row, &unknown) in block.unknowns.iter().enumerate() {
                flow.set_column(unknown, &found.row(row).transpose());
            }
        }
        let known = self.drift.map(|x| Complex::from(x) / (z + self.rate));
        let out = (known - flow * &self.still) / z;
        if out.iter().all(|x| x.norm().is_finite()) { Ok(out) } else { Err(SINGULAR) }
    }

    /// The largest displacement at a time by a disturbance of size one over that at t = 0, and the disturbance; from the rest then.
    fn gain(&self, t: f64, rest: &DMatrix<f64>) -> (f64, RowDVector<f64>) {
        let known = &self.drift * (-(-self.rate * t).exp_m1() / self.rate);
        let mut moved = &self.apex - known + rest;
        for (mut column, size) in moved.column_iter_mut().zip(self.sizes.iter()) {
            column *= *size;
        }
        // The largest singular value: there are three rows.
        let squares: Matrix3<f64> = (&moved * moved.transpose()).fixed_view::<3, 3>(0, 0).into_owned();
        let eigen = squares.symmetric_eigen();
        let most = eigen.eigenvalues.imax();
        let largest = eigen.eigenvalues[most].max(0.0).sqrt();
        let disturbance = eigen.eigenvectors.column(most).transpose() * moved / largest;
        (largest / self.first, disturbance.component_mul(&self.sizes) / self.first)
    }
}

const SINGULAR: StabilityError = StabilityError::NotFinite { what: "response to a disturbance that is let go" };

/// Where a function is largest between two places around its largest sample, by golden sections.
fn highest_between(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let width = SHARP * (high - low);
    let (mut left, mut right) = (high - golden * (high - low), low + golden * (high - low));
    let (mut at_left, mut at_right) = (f(left), f(right));
    while high - low > width {
        if at_left > at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - golden * (high - low);
            at_left = f(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + golden * (high - low);
            at_right = f(right);
        }
    }
    if f(high) > at_left.max(at_right) { high } else { 0.5 * (low + high) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn place_of_the_largest_value_is_found() {
        for place in [0.3, 1.0, 1.7] {
            // A golden section has an error of the width times its share, and rounding of a parabola near its vertex is its root.
            let found = highest_between(0.0, 2.0, |x| -(x - place).powi(2));
            assert_abs_diff_eq!(found, place, epsilon = 2.0 * SHARP + 1e-7);
        }
    }
}
