//! Classification of the pattern of the motion of a tip.

use std::fmt;

use super::oscillations::{Oscillation, Oscillations};
use crate::tropism::Handedness;

/// Largest roundness of a line. One minus this number is the smallest roundness of a circle.
const LINE: f64 = 0.1;

/// Pattern of the motion of a tip. The [roundness](super::Ellipse::roundness) of an
/// [`Ellipse`](super::Ellipse) is its minor over its major axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pattern {
    /// No oscillation.
    None,
    /// Oscillation along a line: an ellipse whose roundness is at most 0.1.
    Pendular,
    /// An ellipse with a roundness between 0.1 and 0.9.
    Elliptic,
    /// An ellipse whose roundness is at least 0.9.
    Circular,
    /// A slow and a fast rotation in the same sense: T_slow/T_fast − 1 loops or waves in a turn,
    /// which point inwards.
    Epitrochoid {
        /// Loops in a turn; in general not a whole number.
        loops: f64,
        /// Amplitude of the faster over that of the slower rotation.
        ratio: f64,
    },
    /// A slow and a fast rotation in opposite senses: T_slow/T_fast + 1 loops or waves in a turn,
    /// which point outwards.
    Hypotrochoid {
        /// Loops in a turn; in general not a whole number.
        loops: f64,
        /// Amplitude of the faster over that of the slower rotation.
        ratio: f64,
    },
}

impl fmt::Display for Pattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("no oscillation"),
            Self::Pendular => f.write_str("pendular oscillation"),
            Self::Elliptic => f.write_str("elliptic oscillation"),
            Self::Circular => f.write_str("circular oscillation"),
            Self::Epitrochoid { loops, .. } => {
                write!(f, "epitrochoid with {loops:.3} loops per revolution")
            }
            Self::Hypotrochoid { loops, .. } => {
                write!(f, "hypotrochoid with {loops:.3} loops per revolution")
            }
        }
    }
}

impl Oscillations {
    /// Pattern of the two largest oscillations. It is a trochoid if both are rounder than a line
    /// and have a determined sense, and if the second one has at least a twentieth of the amplitude
    /// of the first.
    #[must_use]
    pub fn pattern(&self) -> Pattern {
        let Some(first) = self.oscillations.first() else {
            return Pattern::None;
        };
        let rotates =
            |wave: &Oscillation| wave.ellipse.sense.is_some() && wave.ellipse.roundness() > LINE;
        let large = |second: &&Oscillation| second.ellipse.major > 0.05 * first.ellipse.major;
        if let Some(second) = self
            .oscillations
            .get(1)
            .filter(large)
            .filter(|second| rotates(first) && rotates(second))
        {
            let (slow, fast) = if first.period > second.period {
                (first, second)
            } else {
                (second, first)
            };
            let (quotient, ratio) = (
                slow.period / fast.period,
                fast.ellipse.major / slow.ellipse.major,
            );
            return if slow.ellipse.sense == fast.ellipse.sense {
                Pattern::Epitrochoid {
                    loops: quotient - 1.0,
                    ratio,
                }
            } else {
                Pattern::Hypotrochoid {
                    loops: quotient + 1.0,
                    ratio,
                }
            };
        }
        match first.ellipse.roundness() {
            r if r <= LINE => Pattern::Pendular,
            r if r < 1.0 - LINE => Pattern::Elliptic,
            _ => Pattern::Circular,
        }
    }

    /// The sense of the largest oscillation; `None` without an oscillation or if its minor axis
    /// does not exceed three standard errors.
    #[must_use]
    pub fn sense(&self) -> Option<Handedness> {
        self.oscillations
            .first()
            .and_then(|first| first.ellipse.sense)
    }
}
