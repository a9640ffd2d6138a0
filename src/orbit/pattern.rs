//! The name of a pattern.

use super::oscillations::Oscillations;
use crate::tropism::Handedness;

/// Rounder than this an ellipse is called a circle, and flatter than its complement a line.
const ROUND: f64 = 0.9;
/// A second oscillation is part of the pattern if its amplitude is at least this share of the first one's.
const PART: f64 = 0.05;

/// The name of a tip's pattern, with the numbers that led to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pattern {
    /// No period was found.
    None,
    /// To and fro: the ellipse's axes are as 1 to 10 or flatter.
    Pendular {
        /// Minor over major axis.
        roundness: f64,
    },
    /// An ellipse.
    Elliptic {
        /// Minor over major axis.
        roundness: f64,
    },
    /// A circle, to a tenth.
    Circular {
        /// Minor over major axis.
        roundness: f64,
    },
    /// A slow turn and a fast one in the same sense: T_slow/T_fast − 1 loops or waves in a turn, which point inwards.
    Epitrochoid {
        /// Loops in a turn; seldom a whole number.
        loops: f64,
        /// The amplitude of the faster over that of the slower.
        ratio: f64,
    },
    /// A slow turn and a fast one in opposite senses: T_slow/T_fast + 1 loops or waves in a turn, which point outwards.
    Hypotrochoid {
        /// Loops in a turn; seldom a whole number.
        loops: f64,
        /// The amplitude of the faster over that of the slower.
        ratio: f64,
    },
}

impl Oscillations {
    /// The name of the pattern of the two largest oscillations. It is a trochoid if both have a determined sense and are rounder than a
    /// swing.
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
            r if !goes_round(r) => Pattern::Pendular { roundness },
            r if r < ROUND => Pattern::Elliptic { roundness },
            _ => Pattern::Circular { roundness },
        }
    }

    /// The sense of the largest oscillation; `None` without an oscillation or if its minor axis does not exceed three standard errors.
    #[must_use]
    pub fn sense(&self) -> Option<Handedness> {
        self.oscillations.first().and_then(|first| first.ellipse.sense)
    }
}
