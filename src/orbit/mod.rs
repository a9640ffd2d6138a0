//! The reading of a tip's path, simulated or tracked: periods, ellipses, senses and the name of the pattern.
//!
//! A [`Path`] is positions in time, evenly sampled or not, with gaps, noise and outliers as trackers make them. It is seen along an
//! axis as a [`PlanePath`], and [`PlanePath::oscillations`] finds what it is made of:
//!
//! ```text
//! r(t) = drift(t) + Σ [a_k cos ω_k t + b_k sin ω_k t] + noise,
//! ```
//!
//! the drift a polynomial, each period an ellipse with a sense of rotation. Standard errors of periods and axes allow for noise that is
//! correlated in time, and oscillations are distinguished from such noise. [`PlanePath::windows`] does the same as a function of time.
//! [`PlanePath::tracked`] gives the numbers of tracking
//! pipelines, by way of wavelets, which follow a period that changes.
//!
//! ```
//! use morphorod::orbit::{Path, Pattern, Search};
//! use morphorod::nalgebra::Vector3;
//!
//! // A tip that circles once in 90 min, and 24 min, counterclockwise, while it grows.
//! let times: Vec<f64> = (0..600).map(|k| 120.0 * f64::from(k)).collect();
//! let turn = |t: f64, minutes: f64| std::f64::consts::TAU * t / (60.0 * minutes);
//! let at = |t: f64| Vector3::new(
//!     5e-3 * turn(t, 90.0).cos() + 1e-3 * turn(t, 24.0).cos(),
//!     5e-3 * turn(t, 90.0).sin() + 1e-3 * turn(t, 24.0).sin(),
//!     0.06 + 1e-7 * t,
//! );
//! let path = Path::new(times.clone(), times.iter().map(|t| at(*t)).collect())?;
//! let found = path.seen_along(&Vector3::z())?.oscillations(&Search::default())?;
//! assert!((found.oscillations[0].period / 60.0 - 90.0).abs() < 1e-6);
//! assert!((found.oscillations[1].ellipse.major - 1e-3).abs() < 1e-9);
//! let Pattern::Epitrochoid { loops, .. } = found.pattern() else { panic!("{found:?}") };
//! assert!((loops - 2.75).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod background;
mod direction;
mod drift;
mod ellipse;
mod harmonics;
mod oscillations;
mod outliers;
mod path;
mod pattern;
mod robust;
mod scalogram;
mod search;
mod spectrum;
mod tracking;
mod wavelet;
mod windows;

pub use ellipse::Ellipse;
pub use oscillations::{Oscillation, Oscillations};
pub use path::{Path, PlanePath};
pub use pattern::Pattern;
pub use scalogram::{RidgePoint, Scalogram};
pub use search::Search;
pub use tracking::{Band, Quartiles, Tracking};

use crate::error::ParameterError;

/// Why a path cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OrbitError {
    /// A setting makes no sense.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// There is not a position for each time.
    #[error("there are {times} times but {positions} positions")]
    Unequal {
        /// Number of times.
        times: usize,
        /// Number of positions.
        positions: usize,
    },
    /// A time does not come after the one before it.
    #[error("time number {index}, {time} s, is not later than the one before it")]
    NotLater {
        /// Its place in the list, the first being 0.
        index: usize,
        /// The time, s.
        time: f64,
    },
    /// A time or a position is not a finite number.
    #[error("the {what} number {index} is not finite")]
    NotFinite {
        /// Time or position.
        what: &'static str,
        /// Its place in the list, the first being 0.
        index: usize,
    },
    /// There are too few positions for what is asked.
    #[error("{positions} positions are too few: {needed} are needed")]
    TooFew {
        /// Positions given.
        positions: usize,
        /// Positions needed.
        needed: usize,
    },
    /// A path is shorter than what is asked for takes.
    #[error("a path of {duration} s is too short: {needed} s are needed")]
    TooShort {
        /// From the first position to the last one, s.
        duration: f64,
        /// What it takes, s.
        needed: f64,
    },
    /// Positions are too far apart in time for a period.
    #[error("positions every {interval} s are too far apart for a period of {period} s: it needs two of them")]
    TooCoarse {
        /// The median interval, s.
        interval: f64,
        /// The shortest period that is asked for, s.
        period: f64,
    },
    /// A window in which there is no position.
    #[error("there is no position from {from} s to {to} s")]
    EmptyWindow {
        /// Where the window begins, s.
        from: f64,
        /// Where it ends, s.
        to: f64,
    },
}
