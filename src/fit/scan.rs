//! Score test for an internal oscillator.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Display;

use nalgebra::{DMatrix, DVector};

use super::noise::Noise;
use super::parameter::{free, initial_values};
use super::problem::Problem;
use super::residuals::Origin;
use super::series::{Series, span};
use super::{Estimates, Family, Fit, FitError, Verdict, Warning};
use crate::ensemble;
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::tropism::{Handedness, Oscillator};

/// Number of periods in a scan over the number of periods that the duration of the data resolves.
const OVERSAMPLING: f64 = 2.0;

/// Number of the longest and of the shortest period in the duration of the data, by default. Fewer
/// periods resemble a drift. The effect of an oscillator decreases with its period.
const PERIODS: [f64; 2] = [2.0, 100.0];

/// Score of a line above which the lines beside it are computed. An oscillator with a period
/// between two lines has 0.4 times its score at both, so that it is missed only if its score is
/// below 15. Such a score is no evidence: one of a hundred lines without an oscillator reaches it
/// with a probability of 5 %.
const NEAR: f64 = 6.0;

/// Sensitivity of the trial oscillators of a scan. Effects of second order are far below the noise.
const SENSITIVITY: f64 = 1e-4;

/// Score of one period and handedness.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ScanLine {
    /// Oscillator of this period and handedness that explains the residuals best, to first order in
    /// the sensitivity.
    pub oscillator: Oscillator,
    /// Score S: the decrease of −2 ln L due to the oscillator, to first order in the sensitivity
    /// and with the size and the correlations of the noise that the oscillator leaves. For data
    /// without an oscillator S has the distribution of χ² with two degrees of freedom.
    pub score: f64,
}

/// Scores of internal oscillators.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Scan {
    /// Scores in both senses of rotation, of all periods that the duration of the data resolves,
    /// and of those between them near large scores.
    pub lines: Vec<ScanLine>,
    /// Line with the largest score.
    pub best: ScanLine,
    /// Upper bound on the probability that data without an oscillator reach the largest score S: 1
    /// − (1 − exp(−S/2))^N for N lines, including those without a computed score. Their periods are
    /// twice as dense as those that the duration of the data resolves. Therefore fewer than N lines
    /// are independent.
    pub false_alarm: f64,
    /// Shortest and longest period of the scan, s. The scan does not exclude oscillators with other
    /// periods.
    pub periods: [f64; 2],
    /// Reasons to doubt the probability: properties of the data or of the fit that create or hide
    /// an oscillator.
    pub warnings: Vec<Warning>,
}

impl std::fmt::Display for Scan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ScanLine { oscillator, score } = self.best;
        let [shortest, longest, period] =
            [self.periods[0], self.periods[1], oscillator.period].map(|s| s / 60.0);
        write!(
            f,
            "oscillators with periods from {shortest:.1} to {longest:.1} min in both senses: the best has a period of \
             {period:.1} min ({:?}), a sensitivity of {:.2e} and a score of {score:.1}; probability of such a score \
             without an oscillator {:.1e}",
            oscillator.handedness, oscillator.sensitivity, self.false_alarm
        )?;
        self.warnings
            .iter()
            .try_for_each(|warning| write!(f, "\n- {warning}"))
    }
}

impl Estimates {
    /// Shortest and longest period (s) of an oscillator that the data resolve: two median times
    /// between frames, or a hundredth of the duration if this is longer, and half of the duration.
    /// The duration is that from the first to the last frame of all series.
    #[must_use]
    pub fn resolved_periods(&self) -> [f64; 2] {
        let data = &self.data;
        let [first, last] = span(data);
        let duration = last - first;
        // A period shorter than two frames is an alias of a longer period in the opposite sense.
        [
            (2.0 * least_spacing(data)).max(duration / PERIODS[1]),
            duration / PERIODS[0],
        ]
    }
}

impl Fit {
    /// Scores of internal oscillators with periods between two limits (s), in both senses of
    /// rotation, at the estimates of a family without an oscillator.
    /// [`Estimates::resolved_periods`] returns the limits that the data resolve. The data and the
    /// loss are those of the estimates. `oscillating` returns the shoot of the family, for the
    /// values of its parameters, with an additional oscillator.
    ///
    /// The period and the phase of an absent oscillator have no meaning. The difference of χ² of
    /// two fits therefore does not have a known distribution (R. B. Davies, Biometrika 64, 247,
    /// 1977). The score at a given period has one. It is computed from the projection of the
    /// residuals onto the part of the effect of an oscillator that no change of the other
    /// parameters explains. The noise is that of the residuals without this projection, because a
    /// strong oscillator would otherwise be taken for slow noise. A small
    /// [`false_alarm`](Scan::false_alarm) is evidence of an oscillator. Then fit a family with an
    /// oscillator, from the values of the [`best`](Scan::best) line, and
    /// [`compare`](Estimates::compare) both.
    ///
    /// A parameter at a bound means that the family without an oscillator has imitated one by
    /// parameters that are far from those of the plant. Scores are then also computed at the
    /// initial values of the family, and each line has the larger score of both.
    ///
    /// # Errors
    /// Limits that are not positive, finite and increasing; a shortest period below twice the
    /// median time between frames; and the errors of [`run`](Self::run).
    pub fn scan_oscillator<M: Model, E: Display>(
        &self,
        oscillating: impl Fn(&[f64], Oscillator) -> Result<Shoot<M>, E> + Sync,
        estimates: &Estimates,
        periods: [f64; 2],
    ) -> Result<Scan, FitError> {
        let ([shortest, longest], parameters) = (periods, &estimates.family);
        let requirement = "at least twice the median time between frames (s)";
        let ok = shortest >= 2.0 * least_spacing(&estimates.data);
        ParameterError::unless(ok, "shortest period of a scan", shortest, requirement)?;
        let ok = longest > shortest && longest.is_finite();
        ParameterError::unless(
            ok,
            "longest period of a scan",
            longest,
            "longer than the shortest (s)",
        )?;
        let is_at_bound = estimates
            .parameters
            .iter()
            .any(|one| one.verdict == Verdict::AtBound);
        let initial = is_at_bound.then(|| (initial_values(parameters), free(parameters)));
        let points =
            std::iter::once((estimates.values(), estimates.linear.free.clone())).chain(initial);
        let scans = points.map(|point| self.scan_at(&oscillating, estimates, periods, point));
        let scans = scans.collect::<Result<Vec<_>, _>>()?;
        // Lines without a score count, too: they would have one if their neighbours did.
        let count: usize = scans.iter().map(Vec::len).sum();
        let largest = |index: usize| {
            scans
                .iter()
                .filter_map(|scan| scan[index])
                .max_by(|a, b| a.score.total_cmp(&b.score))
        };
        let lines: Vec<ScanLine> = (0..scans[0].len()).filter_map(largest).collect();
        let best = lines.iter().fold(
            lines[0],
            |best, line| if line.score > best.score { *line } else { best },
        );
        let false_alarm = -f64::exp_m1(count as f64 * f64::ln_1p(-(-0.5 * best.score).exp()));
        Ok(Scan {
            lines,
            best,
            false_alarm,
            periods,
            warnings: estimates.warnings.clone(),
        })
    }

    /// Scores of all lines at a point: values of all parameters, and the indices of those whose
    /// changes explain residuals.
    fn scan_at<M: Model, E: Display>(
        &self,
        oscillating: &(impl Fn(&[f64], Oscillator) -> Result<Shoot<M>, E> + Sync),
        estimates: &Estimates,
        [shortest, longest]: [f64; 2],
        (values, free): (Vec<f64>, Vec<usize>),
    ) -> Result<Vec<Option<ScanLine>>, FitError> {
        let family = |oscillator| Family {
            parameters: estimates.family.clone(),
            build: move |values: &[f64]| oscillating(values, oscillator),
        };
        let null = family(Oscillator::new(0.0, longest));
        null.check(self, &estimates.data)?;
        let problem = Problem {
            free,
            ..null.problem_of(self, estimates, values.clone())
        };
        let at = problem.at(problem.unknowns())?;
        let explained = problem.one_sided_jacobian(&at)?.qr().q();
        let unexplained = |vector: DVector<f64>| &vector - &explained * explained.tr_mul(&vector);
        let slopes = unexplained(at.residuals.map(|r| problem.loss.slope(r)));

        let duration = at
            .rows
            .last()
            .map_or(0.0, |last| last.time - at.rows[0].time);
        let resolved = duration * (shortest.recip() - longest.recip());
        let count = (OVERSAMPLING * resolved).ceil().max(1.0) as usize;
        let line = |index: usize| -> Result<ScanLine, FitError> {
            let handedness = [Handedness::Counterclockwise, Handedness::Clockwise][index % 2];
            let part = (index / 2) as f64 / count as f64;
            let period = (longest.recip() + part * (shortest.recip() - longest.recip())).recip();
            let column = |phase: f64| -> Result<DVector<f64>, FitError> {
                let family = family(Oscillator {
                    sensitivity: SENSITIVITY,
                    period,
                    phase,
                    handedness,
                });
                let trial = Problem {
                    free: vec![],
                    ..family.problem_of(self, estimates, values.clone())
                };
                Ok(unexplained(
                    (trial.near(&at, &DVector::zeros(0))? - &at.residuals) / SENSITIVITY,
                ))
            };
            let columns = DMatrix::from_columns(&[column(0.0)?, column(FRAC_PI_2)?]);
            let (amplitudes, score) = score([&columns, &explained], &slopes, &at.rows);
            let (sensitivity, phase) = (amplitudes.norm(), amplitudes[1].atan2(amplitudes[0]));
            Ok(ScanLine {
                oscillator: Oscillator {
                    sensitivity,
                    period,
                    phase,
                    handedness,
                },
                score,
            })
        };
        // Lines of one sense are neighbours if their indices differ by two.
        let mut lines: Vec<Option<ScanLine>> = vec![None; 2 * (count + 1)];
        for refined in [false, true] {
            let is_near = |index: usize| {
                lines
                    .get(index)
                    .is_some_and(|one| one.is_some_and(|one| one.score > NEAR))
            };
            let chosen = |index: &usize| {
                let fine = index / 2 % 2 == 1;
                fine == refined && (!fine || is_near(index - 2) || is_near(index + 2))
            };
            let indices: Vec<usize> = (0..lines.len()).filter(chosen).collect();
            let found = ensemble::collect(indices.len(), self.threads, |k| line(indices[k]));
            for (index, found) in indices.into_iter().zip(found) {
                lines[index] = Some(found?);
            }
        }
        Ok(lines)
    }
}

/// Amplitudes of two columns that explain the residuals best, and their score. The residuals and
/// the columns are orthogonal to the space of the other parameters, whose basis is `explained`.
///
/// The noise is that of the residuals without the part that the columns explain. With n residuals
/// that have the information of ν, the quadratic form q of the score has, over ν, the distribution
/// of F with 2 and ν degrees of freedom. The probability of a larger value is (1 + q/ν)^(−ν/2) =
/// exp(−S/2).
fn score(
    [columns, explained]: [&DMatrix<f64>; 2],
    slopes: &DVector<f64>,
    rows: &[Origin],
) -> (DVector<f64>, f64) {
    let inverse =
        |matrix: DMatrix<f64>| matrix.try_inverse().unwrap_or_else(|| DMatrix::zeros(2, 2));
    let gradient = columns.tr_mul(slopes);
    let amplitudes = -inverse(columns.tr_mul(columns)) * &gradient;
    let rest = slopes + columns * &amplitudes;
    let basis = DMatrix::from_columns(
        &explained
            .column_iter()
            .chain(columns.column_iter())
            .collect::<Vec<_>>(),
    );
    let basis = basis.qr().q();
    let noise = Noise::of(
        &rest,
        rows,
        &basis,
        &DMatrix::identity(basis.ncols(), basis.ncols()),
    );
    let form = gradient
        .dot(&(inverse(noise.covariance(columns, 0.0)) * &gradient))
        .max(0.0);
    let freedom = (slopes.len() as f64 / noise.redundancy() - basis.ncols() as f64).max(1.0);
    (amplitudes, freedom * (form / freedom).ln_1p())
}

/// Smallest median time between the frames of a series, s.
fn least_spacing(data: &[Series]) -> f64 {
    data.iter()
        .map(Series::spacing)
        .fold(f64::INFINITY, f64::min)
}
