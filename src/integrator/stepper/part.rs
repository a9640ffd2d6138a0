//! Parts of a time step.

/// Parts of a time step, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum StepPart {
    /// Adaptation of the elements, and motion of the tissue.
    Growth,
    /// Intrinsic strain.
    Strain,
    /// Equilibrium.
    Shape,
    /// Stimuli.
    Stimuli,
    /// Variables of the laws.
    Variables,
}

impl StepPart {
    /// All parts in their order.
    pub const ALL: [Self; 5] = [Self::Growth, Self::Strain, Self::Shape, Self::Stimuli, Self::Variables];

    /// Name for messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Growth => "growth",
            Self::Strain => "intrinsic strain",
            Self::Shape => "equilibrium",
            Self::Stimuli => "stimuli",
            Self::Variables => "variables of the laws",
        }
    }
}
