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

/// Names of the parts in messages, in the order of [`StepPart`].
pub(super) const PART_NAMES: [&str; 5] = [
    "growth",
    "intrinsic strain",
    "equilibrium",
    "stimuli",
    "variables of the laws",
];
