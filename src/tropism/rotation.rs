//! Transformation of stimuli and variables under rotations of the directors.

/// Transformation of a number under a rotation of the directors d1 and d2 about d3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rotation {
    /// Unknown.
    #[default]
    Undeclared,
    /// The number does not change.
    Invariant,
    /// Component along d1 of a vector; the next number is the component along d2.
    First,
    /// Component along d2 of a vector; the previous number is the component along d1.
    Second,
}

impl Rotation {
    /// The index of the other component of a vector, if number `k` is a component along d1 or d2
    /// without it.
    pub(crate) fn missing_partner(all: &[Self], k: usize) -> Option<usize> {
        match all[k] {
            Self::First if all.get(k + 1) != Some(&Self::Second) => Some(k + 1),
            Self::Second if k == 0 || all[k - 1] != Self::First => Some(k.wrapping_sub(1)),
            _ => None,
        }
    }
}
