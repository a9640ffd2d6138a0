//! Analysis of tip tracks, simulated or measured: periods, ellipses, senses of rotation and the
//! pattern of the motion.
//!
//! A [`Track`] is positions in a plane at increasing times, evenly sampled or not, with the gaps,
//! noise and outliers of measurements. [`Track::oscillations`] fits
//!
//! ```text
//! r(t) = drift(t) + Σ [a_k cos ω_k t + b_k sin ω_k t] + noise
//! ```
//!
//! with a polynomial drift. Each period has an ellipse with a sense of rotation. Standard errors of
//! periods and axes account for noise that is correlated in time, and oscillations are
//! distinguished from such noise. [`Track::windows`] yields parts of a track, which are analysed in
//! the same way. [`Track::nutation`] determines a period that changes in time by wavelets, with the
//! quantities of tracking pipelines.
//!
//! ```
//! use morphorod::tracking::{Pattern, Search, Track};
//! use morphorod::nalgebra::Vector3;
//!
//! // A growing tip with two counterclockwise circles, in 90 min and 24 min.
//! let times: Vec<f64> = (0..600).map(|k| 120.0 * f64::from(k)).collect();
//! let turn = |t: f64, minutes: f64| std::f64::consts::TAU * t / (60.0 * minutes);
//! let at = |t: f64| Vector3::new(
//!     5e-3 * turn(t, 90.0).cos() + 1e-3 * turn(t, 24.0).cos(),
//!     5e-3 * turn(t, 90.0).sin() + 1e-3 * turn(t, 24.0).sin(),
//!     0.06 + 1e-7 * t,
//! );
//! let positions: Vec<_> = times.iter().map(|t| at(*t)).collect();
//! let track = Track::seen_along(&Vector3::z(), times, &positions)?;
//! let found = track.oscillations(&Search::default())?;
//! assert!((found.oscillations[0].period / 60.0 - 90.0).abs() < 1e-6);
//! assert!((found.oscillations[1].ellipse.major - 1e-3).abs() < 1e-9);
//! let Pattern::Epitrochoid { loops, .. } = found.pattern() else { panic!("{found:?}") };
//! assert!((loops - 2.75).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod background;
mod ellipse;
mod error;
mod harmonics;
mod least_squares;
mod normal_equations;
mod nutation;
mod oscillations;
mod outliers;
mod pattern;
mod periodogram;
mod red_noise;
mod scalogram;
mod search;
mod spectrum;
mod statistics;
mod track;
mod wavelet;

pub use ellipse::Ellipse;
pub use error::TrackingError;
pub use nutation::Nutation;
pub use oscillations::{Oscillation, Oscillations};
pub use pattern::Pattern;
pub(crate) use red_noise::RedNoise;
pub use scalogram::{RidgePoint, Scalogram};
pub use search::Search;
pub(crate) use statistics::{
    median, median_gap, normal_deviate, robust_deviation, root_mean_square,
};
pub use track::Track;
