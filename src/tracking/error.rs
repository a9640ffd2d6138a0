//! Why a tip track cannot be analysed.

use crate::error::ParameterError;

/// Why a tip track cannot be analysed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackingError {
    /// A setting is out of range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The numbers of times and positions differ.
    #[error("there are {times} times but {positions} positions")]
    Unequal {
        /// Number of times.
        times: usize,
        /// Number of positions.
        positions: usize,
    },
    /// Times do not increase.
    #[error("time number {index}, {time} s, is not later than the one before it")]
    NotLater {
        /// Index of the time, from 0.
        index: usize,
        /// The time, s.
        time: f64,
    },
    /// A time or a position is not a finite number.
    #[error("the {what} number {index} is not finite")]
    NotFinite {
        /// Time or position.
        what: &'static str,
        /// Index of the time or position, from 0.
        index: usize,
    },
    /// There are too few positions.
    #[error("{positions} positions are too few: {needed} are needed")]
    TooFew {
        /// Positions given.
        positions: usize,
        /// Positions needed.
        needed: usize,
    },
    /// The track is too short.
    #[error("a path of {duration} s is too short: {needed} s are needed")]
    TooShort {
        /// Time from the first position to the last one, s.
        duration: f64,
        /// Time needed, s.
        needed: f64,
    },
    /// The sampling interval is too long for a period.
    #[error("positions every {interval} s are too far apart for a period of {period} s: it needs two of them")]
    TooCoarse {
        /// Median sampling interval, s.
        interval: f64,
        /// Shortest requested period, s.
        period: f64,
    },
    /// A window contains no position.
    #[error("there is no position from {from} s to {to} s")]
    EmptyWindow {
        /// Start of the window, s.
        from: f64,
        /// End of the window, s.
        to: f64,
    },
}
