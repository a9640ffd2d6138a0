//! Score test for an internal oscillator.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Display;

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use super::noise::Noise;
use super::problem::Problem;
use super::residuals::{Steps, simulate};
use super::series::Series;
use super::{Estimates, Family, Fit, FitError};
use crate::ensemble;
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::tropism::{Handedness, Oscillator};

/// Number of periods in a scan over the number of periods that the duration of the data resolves.
const OVERSAMPLING: f64 = 2.0;

/// Sensitivity of the trial oscillators of a scan. Effects of second order are far below the noise.
const SENSITIVITY: f64 = 1e-4;

/// Score of one period and handedness.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ScanLine {
    /// Oscillator of this period and handedness that explains the residuals best, to first order in the sensitivity.
    pub oscillator: Oscillator,
    /// Score S: the decrease of χ² due to the oscillator, to first order in the sensitivity and with the correlations
    /// of the noise. For data without an oscillator S has the distribution of χ² with two degrees of freedom.
    pub score: f64,
}

/// Scores of internal oscillators.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Scan {
    /// Scores of all periods, in both senses of rotation.
    pub lines: Vec<ScanLine>,
    /// Line with the largest score.
    pub best: ScanLine,
    /// Upper bound on the probability that data without an oscillator reach the largest score S: 1 − (1 − exp(−S/2))^N
    /// for N lines. The periods are twice as dense as those that the duration of the data resolves. Therefore fewer
    /// than N lines are independent.
    pub false_alarm: f64,
}

impl Fit {
    /// Scores of internal oscillators with periods between two limits (s), in both senses of rotation, at the estimates
    /// of a family without an oscillator. The data, the noise and the loss are those of the estimates. `oscillating`
    /// returns the shoot of the family, for the values of its parameters, with an additional oscillator.
    ///
    /// The period and the phase of an absent oscillator have no meaning. The difference of χ² of two fits therefore
    /// does not have a known distribution (R. B. Davies, Biometrika 64, 247, 1977). The score at a given period has
    /// one. It is computed from the projection of the residuals onto the part of the effect of an oscillator that no
    /// change of the other parameters explains. A small [`false_alarm`](Scan::false_alarm) is evidence of an
    /// oscillator. Then fit a family with an oscillator, from the values of the [`best`](Scan::best) line, and
    /// [`compare`](Estimates::compare) both.
    ///
    /// # Errors
    /// Limits that are not positive, finite and increasing; a shortest period below twice the median time between
    /// frames; and the errors of [`run`](Self::run).
    pub fn scan_oscillator<M: Model, E: Display>(
        &self,
        oscillating: impl Fn(&[f64], Oscillator) -> Result<Shoot<M>, E> + Sync,
        estimates: &Estimates,
        [shortest, longest]: [f64; 2],
    ) -> Result<Scan, FitError> {
        let data = &estimates.data[..];
        ParameterError::positive("shortest period of a scan", shortest, "s")?;
        // A period shorter than two frames is an alias of a longer period in the opposite sense.
        let frames = data.iter().map(Series::spacing).fold(f64::INFINITY, f64::min);
        let requirement = "at least twice the median time between frames (s)";
        ParameterError::unless(shortest >= 2.0 * frames, "shortest period of a scan", shortest, requirement)?;
        let ok = longest > shortest && longest.is_finite();
        ParameterError::unless(ok, "longest period of a scan", longest, "longer than the shortest (s)")?;
        let oscillator = |sensitivity, period, phase, handedness| Oscillator { sensitivity, period, phase, handedness };
        let silent = oscillator(0.0, longest, 0.0, Handedness::Counterclockwise);
        let oscillating = &oscillating;
        let family = |oscillator| Family {
            parameters: estimates.family.clone(),
            build: move |values: &[f64]| oscillating(values, oscillator),
        };
        let null = family(silent);
        self.check(&null, data)?;
        let run =
            |values: &[f64], until: f64, steps: Steps<'_>| simulate(&null, data, self.step, (values, until), steps);
        let (values, free) = (estimates.values(), estimates.free.clone());
        let problem = self.problem(&estimates.family, data, values.clone(), &run);
        let problem = Problem { noise: estimates.noise.clone(), free, ..problem };
        let x = problem.coordinates(&values);
        let at = problem.evaluate(&x)?;
        let jacobian = problem.one_sided_jacobian(&x, &at)?;
        let slopes = at.residuals.map(|r| estimates.loss.slope(r));
        let explained = orthonormal_basis(&jacobian);
        let identity = DMatrix::identity(explained.ncols(), explained.ncols());
        let noise = Noise::of(&slopes, &at.rows, &explained, &identity);

        let duration = at.rows.last().map_or(0.0, |last| last.time - at.rows[0].time);
        let resolved = duration * (shortest.recip() - longest.recip());
        let count = (OVERSAMPLING * resolved).ceil().max(1.0) as usize;
        let line = |index: usize| -> Result<ScanLine, FitError> {
            let handedness = [Handedness::Counterclockwise, Handedness::Clockwise][index % 2];
            let part = (index / 2) as f64 / count as f64;
            let period = (longest.recip() + part * (shortest.recip() - longest.recip())).recip();
            let column = |phase: f64| -> Result<DVector<f64>, FitError> {
                let trial = oscillator(SENSITIVITY, period, phase, handedness);
                let all_data = (&values[..], f64::INFINITY);
                let output = simulate(&family(trial), data, self.step, all_data, Steps::Follow(&at.grid))?;
                let column = (problem.over_noise(&output.residuals, &output.rows) - &at.residuals) / SENSITIVITY;
                Ok(&column - &explained * explained.tr_mul(&column))
            };
            let columns = DMatrix::from_columns(&[column(0.0)?, column(FRAC_PI_2)?]);
            let score = columns.tr_mul(&slopes);
            let score = Vector2::new(score[0], score[1]);
            let square = |matrix: DMatrix<f64>| Matrix2::from_fn(|i, j| matrix[(i, j)]);
            let expected = square(noise.covariance(&columns, 0.0));
            let inverse = |matrix: Matrix2<f64>| matrix.try_inverse().unwrap_or_else(Matrix2::zeros);
            let amplitudes = inverse(square(columns.tr_mul(&columns))) * -score;
            let (sensitivity, phase) = (amplitudes.norm(), amplitudes.y.atan2(amplitudes.x));
            let value = score.dot(&(inverse(expected) * score)).max(0.0);
            Ok(ScanLine { oscillator: oscillator(sensitivity, period, phase, handedness), score: value })
        };
        let lines =
            ensemble::collect(2 * (count + 1), self.threads, line).into_iter().collect::<Result<Vec<_>, _>>()?;
        let best = lines.iter().fold(lines[0], |best, line| if line.score > best.score { *line } else { best });
        let false_alarm = -f64::exp_m1(lines.len() as f64 * f64::ln_1p(-(-0.5 * best.score).exp()));
        Ok(Scan { lines, best, false_alarm })
    }
}

/// Orthonormal basis of the space of the columns of a Jacobian.
fn orthonormal_basis(jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    if jacobian.ncols() == 0 {
        return jacobian.clone();
    }
    jacobian.clone().qr().q()
}
