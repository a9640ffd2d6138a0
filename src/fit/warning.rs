//! Warnings about data and fits, each with its probable causes.

use std::fmt;

use super::noise::Noise;
use super::series::{Kind, Series};
use crate::error::ParameterError;
use crate::model::{Model, next_discontinuity};
use crate::scene::{after, before};
use crate::shoot::Shoot;
use crate::tracking::robust_deviation;

/// Ratio of the size of residuals to the scatter of neighbouring frames that is normal for many residuals. Second
/// differences of a curved track enlarge the scatter, and never reduce it.
const RATIO: f64 = 1.25;

/// Standard error of the scatter from n coordinates, times √n: that of a median absolute deviation of normal numbers,
/// 1.17, times the effect of the correlation of second differences, 1.4.
const SCATTER_ERROR: f64 = 1.6;

/// Number of standard errors at which a deviation counts.
const SIGNIFICANT: f64 = 4.0;

/// Size of an outlier, in standard deviations. Among 10,000 normal residuals, one in 200 cases is larger.
const OUTLIER: f64 = 5.0;

/// Largest share of outliers: more large residuals are no exceptions.
const MOST_OUTLIERS: f64 = 0.15;

/// Ratio of the standard deviation of the data to that of the residuals below which the model explains hardly anything.
const MOTION: f64 = 3.0;

/// Smallest number of frames from which an uncertainty of times is found.
const FEW: usize = 20;

/// Largest number of frames that a message lists.
const LISTED: usize = 8;

/// Reason to doubt a fit, with its numbers. [`Display`](fmt::Display) names the probable causes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The last search did not converge. The estimates are those of its last point, which is not a minimum. They may be
    /// the initial guess of another fit.
    NotConverged {
        /// Number of iterations of the search.
        iterations: usize,
    },
    /// The residuals are larger than the scatter of neighbouring frames. The model does not explain the data, the
    /// search has ended in a local minimum, or the noise is slow.
    Unexplained {
        /// Index of the series, from 0.
        series: usize,
        /// Root mean square of the residuals, in the unit of the data, or rad.
        residuals: f64,
        /// Scatter of neighbouring frames, in the same unit.
        scatter: f64,
    },
    /// A few frames have residuals far above those of the others.
    Outliers {
        /// Index of the series, from 0.
        series: usize,
        /// Number of coordinates whose residual exceeds five times the scatter.
        count: usize,
    },
    /// The residuals do not have the size of the given noise.
    GivenNoise {
        /// Index of the series, from 0.
        series: usize,
        /// Root mean square of the residuals over the given noise.
        ratio: f64,
    },
    /// Residuals of neighbouring frames are correlated: the noise is slow, the model is wrong, or the search has ended
    /// in a local minimum.
    Correlated {
        /// Correlation of the noise in successive frames.
        lag_one: f64,
    },
    /// Frames are equal to the frame before them.
    RepeatedFrames {
        /// Index of the series, from 0.
        series: usize,
        /// Indices of the frames, from 0.
        frames: Vec<usize>,
    },
    /// Frames are at a discontinuity of the laws, and are compared with the shoot just before it.
    AmbiguousFrames {
        /// Index of the series, from 0.
        series: usize,
        /// Indices of the frames, from 0.
        frames: Vec<usize>,
    },
    /// The residuals increase with the speed of the tip, as by errors of the times.
    UncertainTimes {
        /// Index of the series, from 0.
        series: usize,
        /// Standard deviation of errors of the times that would explain the increase, s.
        deviation: f64,
    },
    /// A constant explains the data almost as well as the model: the shoot hardly moves, or the model is wrong.
    NoMotion {
        /// Index of the series, from 0.
        series: usize,
        /// Standard deviation of the coordinates over the root mean square of the residuals.
        ratio: f64,
    },
    /// The estimate of a parameter is at a bound: the values that explain the data best may be beyond it.
    AtBound {
        /// Name of the parameter.
        name: String,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let listed = |frames: &[usize]| {
            let first: Vec<String> = frames.iter().take(LISTED).map(usize::to_string).collect();
            format!("{}{}", first.join(", "), if frames.len() > LISTED { ", …" } else { "" })
        };
        match self {
            Self::NotConverged { iterations } => write!(
                f,
                "the search did not converge in {iterations} iterations, and its last point is not a minimum: permit \
                 more iterations, or begin another fit at these values"
            ),
            Self::Unexplained { series, residuals, scatter } => write!(
                f,
                "the residuals of series {series}, {residuals:.2e}, are {:.1} times the scatter of successive frames: \
                 the model is wrong, the search has ended in a local minimum (use more starts), or the noise is slow",
                residuals / scatter
            ),
            Self::Outliers { series, count } => write!(
                f,
                "{count} coordinates of series {series} are outliers beyond five times the scatter: use the robust loss"
            ),
            Self::GivenNoise { series, ratio } => write!(
                f,
                "the residuals of series {series} are {ratio:.2e} times the given noise: is the noise right (in the \
                 unit of the data), and the model?"
            ),
            Self::Correlated { lag_one } => write!(
                f,
                "residuals of neighbouring frames are correlated ({lag_one:.2} for successive ones), because the noise \
                 is slow (smoothed or repeated frames, a moving camera), the model is wrong, or the minimum is a local \
                 one (use more starts): the standard errors account for slow noise only"
            ),
            Self::RepeatedFrames { series, frames } => write!(
                f,
                "{} frames of series {series} are equal to the frame before them ({}): a tracker that repeats frames \
                 creates periodic errors, which resemble an oscillator",
                frames.len(),
                listed(frames)
            ),
            Self::AmbiguousFrames { series, frames } => {
                write!(f, "frames of series {series} are at a discontinuity of the laws: {}", listed(frames))
            }
            Self::UncertainTimes { series, deviation } => write!(
                f,
                "the residuals of series {series} increase with the speed of the tip, as if the times of the frames \
                 were uncertain by {deviation:.0} s: is the interval of the frames constant, and the model right?"
            ),
            Self::NoMotion { series, ratio } => write!(
                f,
                "a constant explains series {series} almost as well as the model: the standard deviation of the data \
                 is {ratio:.1} times that of the residuals, because the shoot hardly moves or the model is wrong, and \
                 errors of the estimates are larger than stated"
            ),
            Self::AtBound { name } => {
                write!(f, "{name} is at a bound: its value and those of the other parameters depend on the bound")
            }
        }
    }
}

/// Warnings about the data and their residuals: index of the series, time and value.
pub(super) fn warnings(data: &[Series], all: &[(usize, f64, f64)], noise: &Noise) -> Vec<Warning> {
    let mut warnings = Vec::new();
    for (index, series) in data.iter().enumerate() {
        let residuals: Vec<f64> = all.iter().filter(|(of, ..)| *of == index).map(|(.., r)| *r).collect();
        warnings.extend(of_residuals(index, series, &residuals));
        let frames = series.repeated_frames();
        if !frames.is_empty() {
            warnings.push(Warning::RepeatedFrames { series: index, frames });
        }
        if let Some(deviation) = uncertainty_of_times(series, &residuals) {
            warnings.push(Warning::UncertainTimes { series: index, deviation });
        }
        let ratio = series.deviation() / root_mean_square(&residuals);
        if ratio < MOTION && series.times.len() >= FEW {
            warnings.push(Warning::NoMotion { series: index, ratio });
        }
    }
    if noise.excess() > SIGNIFICANT {
        warnings.push(Warning::Correlated { lag_one: noise.lag_one() });
    }
    warnings
}

/// Warnings about frames whose times are, up to rounding, those of a discontinuity of the laws. The shoot is at its
/// start.
pub(super) fn ambiguous_frames(shoot: &Shoot<impl Model>, data: &[Series]) -> Result<Vec<Warning>, ParameterError> {
    let last = data.iter().filter_map(|series| series.times.last()).copied().fold(f64::NEG_INFINITY, f64::max);
    let mut frames = vec![Vec::new(); data.len()];
    let mut time = next_discontinuity(shoot.model(), before(shoot.time()))?;
    while time <= last {
        for (series, frames) in data.iter().zip(&mut frames) {
            let first = series.times.partition_point(|t| *t < before(time));
            frames.extend((first..series.times.len()).take_while(|k| series.times[*k] <= after(time)));
        }
        time = next_discontinuity(shoot.model(), after(time))?;
    }
    let warning = |(series, frames)| Warning::AmbiguousFrames { series, frames };
    Ok(frames.into_iter().enumerate().filter(|(_, frames)| !frames.is_empty()).map(warning).collect())
}

/// Root mean square of some residuals.
pub(super) fn root_mean_square(residuals: &[f64]) -> f64 {
    (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len().max(1) as f64).sqrt()
}

/// Warning about the size of the residuals of a series.
fn of_residuals(series: usize, data: &Series, residuals: &[f64]) -> Option<Warning> {
    let (size, scatter) = (root_mean_square(residuals), data.scatter());
    let largest = RATIO + SIGNIFICANT * SCATTER_ERROR / (residuals.len().max(1) as f64).sqrt();
    if let Some(noise) = data.noise {
        let ratio = size / noise;
        return (!(largest.recip()..=largest).contains(&ratio)).then_some(Warning::GivenNoise { series, ratio });
    }
    if data.times.len() < FEW || size <= largest * scatter {
        return None;
    }
    let typical = robust_deviation(residuals.iter().copied());
    let count = residuals.iter().filter(|r| r.abs() > OUTLIER * typical).count();
    let rare = count > 0 && (count as f64) < MOST_OUTLIERS * residuals.len() as f64;
    if rare && typical <= largest * scatter {
        return Some(Warning::Outliers { series, count });
    }
    Some(Warning::Unexplained { series, residuals: size, scatter })
}

/// Standard deviation of errors of the times (s) that explains the squares of the residuals of the tip, if their
/// correlation with the square of its speed is significant.
///
/// An error δ of a time displaces the tip by its velocity times δ. The velocity is that of the simulated tip.
fn uncertainty_of_times(series: &Series, residuals: &[f64]) -> Option<f64> {
    let (count, d) = (series.times.len(), series.dimension());
    if series.kind == Kind::Angle || count < FEW {
        return None;
    }
    let mut place = 0;
    let mut tips = Vec::with_capacity(count);
    for frame in &series.frames {
        let tip: Option<Vec<[f64; 2]>> =
            (0..d).map(|k| Some([*residuals.get(place + k)?, residuals[place + k] + frame.last()?[k]])).collect();
        tips.push(tip?);
        place += series.residuals_of(frame);
    }
    let mut pairs = Vec::with_capacity(count * d);
    for j in 1..count - 1 {
        let duration = series.times[j + 1] - series.times[j - 1];
        let pair = |k: usize| [((tips[j + 1][k][1] - tips[j - 1][k][1]) / duration).powi(2), tips[j][k][0].powi(2)];
        pairs.extend((0..d).map(pair));
    }
    let n = pairs.len() as f64;
    let mean = |i: usize| pairs.iter().map(|pair| pair[i]).sum::<f64>() / n;
    let means = [mean(0), mean(1)];
    let moment = |i: usize, k: usize| pairs.iter().map(|p| (p[i] - means[i]) * (p[k] - means[k])).sum::<f64>();
    let (cross, squares) = (moment(0, 1), [moment(0, 0), moment(1, 1)]);
    let correlation = cross / (squares[0] * squares[1]).sqrt();
    (correlation * n.sqrt() > SIGNIFICANT).then(|| (cross / squares[0]).sqrt())
}
