//! Classification of the pattern of a tip.

use super::oscillations::Oscillations;
use crate::tropism::Handedness;

/// Smallest roundness of a circle. One minus this number is the largest roundness of a line.
const ROUND: f64 = 0.9;
/// Smallest amplitude of the second oscillation of a trochoid, over that of the first one.
const PART: f64 = 0.05;

/// The pattern of a tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pattern {
    /// No period was found.
    None,
    /// Motion to and fro: an ellipse whose roundness is at most 0.1.
    Pendular,
    /// An ellipse with a roundness between 0.1 and 0.9.
    Elliptic,
    /// An ellipse whose roundness is at least 0.9.
    Circular,
    /// A slow and a fast rotation in the same sense: T_slow/T_fast − 1 loops or waves in a turn, which point inwards.
    Epitrochoid {
        /// Loops in a turn; in general not a whole number.
        loops: f64,
        /// Amplitude of the faster over that of the slower rotation.
        ratio: f64,
    },
    /// A slow and a fast rotation in opposite senses: T_slow/T_fast + 1 loops or waves in a turn, which point outwards.
    Hypotrochoid {
        /// Loops in a turn; in general not a whole number.
        loops: f64,
        /// Amplitude of the faster over that of the slower rotation.
        ratio: f64,
    },
}

impl Oscillations {
    /// The pattern of the two largest oscillations. It is a trochoid if both have a determined sense and are rounder
    /// than a line.
    #[must_use]
    pub fn pattern(&self) -> Pattern {
        let Some(first) = self.oscillations.first() else { return Pattern::None };
        let goes_round = |roundness: f64| roundness > 1.0 - ROUND;
        let roundness = first.ellipse.roundness();
        if let Some(second) = self.oscillations.get(1) {
            let part = second.ellipse.major > PART * first.ellipse.major;
            let determined = first.ellipse.sense.is_some() && second.ellipse.sense.is_some();
            if part && determined && goes_round(roundness) && goes_round(second.ellipse.roundness()) {
                let (slow, fast) = if first.period > second.period { (first, second) } else { (second, first) };
                let (quotient, ratio) = (slow.period / fast.period, fast.ellipse.major / slow.ellipse.major);
                return if slow.ellipse.sense == fast.ellipse.sense {
                    Pattern::Epitrochoid { loops: quotient - 1.0, ratio }
                } else {
                    Pattern::Hypotrochoid { loops: quotient + 1.0, ratio }
                };
            }
        }
        match roundness {
            r if !goes_round(r) => Pattern::Pendular,
            r if r < ROUND => Pattern::Elliptic,
            _ => Pattern::Circular,
        }
    }

    /// The sense of the largest oscillation; `None` without an oscillation or if its minor axis does not exceed three
    /// standard errors.
    #[must_use]
    pub fn sense(&self) -> Option<Handedness> {
        self.oscillations.first().and_then(|first| first.ellipse.sense)
    }
}
