//! Warnings about data and fits, each with its probable causes.

use nalgebra::DVector;

use super::Loss;
use super::noise::Noise;
use super::residuals::Origin;
use super::series::{Series, span};
use crate::error::ParameterError;
use crate::model::{Model, next_discontinuity};
use crate::scene::{after, before};
use crate::shoot::Shoot;
use crate::tracking::{robust_deviation, root_mean_square};

/// Ratio of the size of residuals to the scatter of neighbouring frames that is normal for many
/// residuals. Second differences of a curved track enlarge the scatter, and never reduce it.
const RATIO: f64 = 1.25;

/// Standard error of the scatter from n coordinates, times √n: that of a median absolute deviation
/// of normal numbers, 1.17, times the effect of the correlation of second differences, 1.4.
const SCATTER_ERROR: f64 = 1.6;

/// Number of standard errors at which a deviation counts.
const SIGNIFICANT: f64 = 4.0;

/// Size of an outlier, in standard deviations. Among 10,000 normal residuals, one in 200 cases is
/// larger.
const OUTLIER: f64 = 5.0;

/// Largest share of outliers: more large residuals are no exceptions.
const MOST_OUTLIERS: f64 = 0.15;

/// Ratio of the standard deviation of the data to that of the residuals below which the model
/// explains hardly anything.
const MOTION: f64 = 3.0;

/// Smallest number of frames whose motion is distinguished from their noise.
const FEW: usize = 20;

/// Largest number of frames that a message lists.
const LISTED: usize = 8;

/// Reason to doubt a fit, with its numbers. The message names the probable causes.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// The last search did not converge. The estimates are those of its last point, which is not a
    /// minimum. They may be the initial guess of another fit.
    #[error(
        "the search did not converge in {iterations} iterations, or the estimate of the noise did not settle, and its \
         last point is not a minimum: permit more iterations, or begin another fit at these values"
    )]
    NotConverged {
        /// Number of iterations of the search.
        iterations: usize,
    },
    /// The residuals are larger than the scatter of neighbouring frames. The model does not explain
    /// the data, the search has ended in a local minimum, or the noise is slow.
    #[error(
        "the residuals of series {series}, {residuals:.2e}, are {:.1} times the scatter of successive frames: the \
         model, a given value or the unit of the times is wrong, the search has ended in a local minimum (use more \
         starts), or the noise is slow",
        residuals / scatter
    )]
    Unexplained {
        /// Index of the series, from 0.
        series: usize,
        /// Root mean square of the residuals, in the unit of the data, or rad.
        residuals: f64,
        /// Scatter of neighbouring frames, in the same unit.
        scatter: f64,
    },
    /// A few frames have residuals far above those of the others, and the loss is that of squares.
    #[error(
        "{count} coordinates of series {series} are outliers beyond five times the robust deviation of the \
         residuals: use the robust loss"
    )]
    Outliers {
        /// Index of the series, from 0.
        series: usize,
        /// Number of coordinates whose residual exceeds five times the robust deviation.
        count: usize,
    },
    /// The residuals do not have the size of the given noise.
    #[error(
        "the residuals of series {series} are {ratio:.2e} times the given noise: is the noise right (in the unit of \
         the data), and the model?"
    )]
    GivenNoise {
        /// Index of the series, from 0.
        series: usize,
        /// Root mean square of the residuals over the given noise.
        ratio: f64,
    },
    /// Residuals of neighbouring frames are correlated: the noise is slow, the model is wrong, or
    /// the search has ended in a local minimum.
    #[error(
        "residuals of neighbouring frames are correlated ({lag_one:.2} for successive ones), because the noise is \
         slow (smoothed or repeated frames, a moving camera), the model is wrong, or the minimum is a local one (use \
         more starts): the standard errors account for slow noise only"
    )]
    Correlated {
        /// Correlation of the noise in successive frames.
        lag_one: f64,
    },
    /// Frames are equal to the frame before them.
    #[error(
        "{} frames of series {series} are equal to the frame before them ({}): a tracker that repeats frames creates \
         periodic errors, which resemble an oscillator",
        frames.len(), listed(frames)
    )]
    RepeatedFrames {
        /// Index of the series, from 0.
        series: usize,
        /// Indices of the frames, from 0.
        frames: Vec<usize>,
    },
    /// Frames are at a discontinuity of the laws, and are compared with the shoot just before it.
    #[error(
        "frames of series {series} are at a discontinuity of the laws: {}",
        listed(frames)
    )]
    AmbiguousFrames {
        /// Index of the series, from 0.
        series: usize,
        /// Indices of the frames, from 0.
        frames: Vec<usize>,
    },
    /// The residuals increase with the speed of the tip, as by errors of the times.
    #[error(
        "the residuals of series {series} increase with the speed of the tip, as if the times of the frames were \
         uncertain by {deviation:.0} s: is the interval of the frames constant, and the model right?"
    )]
    UncertainTimes {
        /// Index of the series, from 0.
        series: usize,
        /// Standard deviation of errors of the times that would explain the increase, s.
        deviation: f64,
    },
    /// A constant explains the data almost as well as the model, or better: the plant hardly moves,
    /// or the model, a given value or the unit of the times is wrong.
    #[error(
        "a constant explains series {series} almost as well as the model, or better: the standard deviation of the \
         data is {ratio:.2} times that of the residuals, because the plant hardly moves, or the model, a given value \
         or the unit of the times is wrong; errors of the estimates are larger than stated"
    )]
    NoMotion {
        /// Index of the series, from 0.
        series: usize,
        /// Standard deviation of the coordinates over the root mean square of the residuals.
        ratio: f64,
    },
    /// The estimate of a parameter is at a bound: the values that explain the data best may be
    /// beyond it.
    #[error(
        "{name} is at a bound: its value and those of the other parameters depend on the bound, which the model, a \
         given value or the unit of the times may contradict"
    )]
    AtBound {
        /// Name of the parameter.
        name: String,
    },
}

/// The first of some frames as text.
fn listed(frames: &[usize]) -> String {
    let first: Vec<String> = frames.iter().take(LISTED).map(usize::to_string).collect();
    format!(
        "{}{}",
        first.join(", "),
        if frames.len() > LISTED { ", …" } else { "" }
    )
}

/// Warnings about the data and their residuals, in the unit of the data, or rad.
pub(super) fn warnings(
    data: &[Series],
    loss: Loss,
    all: &[(Origin, f64)],
    noise: &Noise,
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    for (index, series) in data.iter().enumerate() {
        let own = || all.iter().filter(|(row, _)| row.series == index);
        let residuals: Vec<f64> = own().map(|(_, r)| *r).collect();
        warnings.extend(of_residuals(index, series, loss, &residuals));
        let frames = series.repeated_frames();
        warnings.extend((!frames.is_empty()).then_some(Warning::RepeatedFrames {
            series: index,
            frames,
        }));
        let of_tip = own()
            .filter(|(row, _)| row.index < series.dimension())
            .map(|(_, r)| *r);
        let deviation = uncertainty_of_times(series, &of_tip.collect::<Vec<_>>());
        warnings.extend(deviation.map(|deviation| Warning::UncertainTimes {
            series: index,
            deviation,
        }));
        let ratio = series.deviation() / root_mean_square(&residuals);
        let is_still = ratio < MOTION && series.times.len() >= FEW;
        warnings.extend(is_still.then_some(Warning::NoMotion {
            series: index,
            ratio,
        }));
    }
    warnings.extend(
        (noise.excess() > SIGNIFICANT).then_some(Warning::Correlated {
            lag_one: noise.lag_one(),
        }),
    );
    warnings
}

/// Warnings about frames whose times are, up to rounding, those of a discontinuity of the laws. The
/// shoot is at its start.
pub(super) fn ambiguous_frames(
    shoot: &Shoot<impl Model>,
    data: &[Series],
) -> Result<Vec<Warning>, ParameterError> {
    let [_, last] = span(data);
    let mut frames = vec![Vec::new(); data.len()];
    let mut time = next_discontinuity(shoot.model(), before(shoot.time()))?;
    while time <= last {
        for (series, frames) in data.iter().zip(&mut frames) {
            let first = series.times.partition_point(|t| *t < before(time));
            frames.extend(
                (first..series.times.len()).take_while(|k| series.times[*k] <= after(time)),
            );
        }
        time = next_discontinuity(shoot.model(), after(time))?;
    }
    let warning = |(series, frames)| Warning::AmbiguousFrames { series, frames };
    Ok(frames
        .into_iter()
        .enumerate()
        .filter(|(_, frames)| !frames.is_empty())
        .map(warning)
        .collect())
}

/// Warning about the size of the residuals of a series. Outliers need none with a robust loss.
fn of_residuals(series: usize, data: &Series, loss: Loss, residuals: &[f64]) -> Option<Warning> {
    let (size, scatter) = (root_mean_square(residuals), data.scatter());
    let largest = RATIO + SIGNIFICANT * SCATTER_ERROR / (residuals.len().max(1) as f64).sqrt();
    if let Some(noise) = data.noise {
        let ratio = size / noise;
        return (!(largest.recip()..=largest).contains(&ratio))
            .then_some(Warning::GivenNoise { series, ratio });
    }
    if data.times.len() < FEW || size <= largest * scatter {
        return None;
    }
    let typical = robust_deviation(residuals.iter().copied());
    let count = residuals
        .iter()
        .filter(|r| r.abs() > OUTLIER * typical)
        .count();
    let rare = count > 0 && (count as f64) < MOST_OUTLIERS * residuals.len() as f64;
    if rare && typical <= largest * scatter {
        return (loss == Loss::Squares).then_some(Warning::Outliers { series, count });
    }
    Some(Warning::Unexplained {
        series,
        residuals: size,
        scatter,
    })
}

/// Standard deviation of errors of the times (s) that explains the squares of the residuals of the
/// tip, if their correlation with the square of its speed is significant.
///
/// An error δ of a time displaces the tip by its velocity times δ. The velocity is that of the
/// simulated tip.
fn uncertainty_of_times(series: &Series, residuals: &[f64]) -> Option<f64> {
    let (count, d) = (series.times.len(), series.dimension());
    if series.is_angle || count < FEW {
        return None;
    }
    let simulated = |frame: usize, k: usize| series.last_point(frame)[k] + residuals[frame * d + k];
    let speed = |frame: usize, k: usize| {
        let [before, after] = [frame - 1, frame + 1];
        (simulated(after, k) - simulated(before, k)) / (series.times[after] - series.times[before])
    };
    let inner = || (1..count - 1).flat_map(|frame| (0..d).map(move |k| (frame, k)));
    let centred = |values: DVector<f64>| values.add_scalar(-values.mean());
    let n = (count - 2) * d;
    let speeds = centred(DVector::from_iterator(
        n,
        inner().map(|(frame, k)| speed(frame, k).powi(2)),
    ));
    let squares = centred(DVector::from_iterator(
        n,
        inner().map(|(frame, k)| residuals[frame * d + k].powi(2)),
    ));
    let correlation = speeds.dot(&squares) / (speeds.norm() * squares.norm());
    let is_significant = correlation * (n as f64).sqrt() > SIGNIFICANT;
    let deviation = (speeds.dot(&squares) / speeds.norm_squared()).sqrt();
    // The speed of a shoot at rest is rounding.
    (is_significant && deviation < series.times[count - 1] - series.times[0]).then_some(deviation)
}
