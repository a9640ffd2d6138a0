//! Where a run goes, and by which steps.

use crate::shoot::Mesh;

/// How often and how closely a step is repeated with what it led to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Correction {
    /// Largest change of an angle that ends the repetition, rad.
    pub tolerance: f64,
    /// Bound on the repetitions.
    pub most: usize,
}

/// An interval of time, and how many growing elements leave the zone in it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub from: f64,
    pub to: f64,
    pub leaving: usize,
}

/// Where a run goes: to a time, in steps of at most a size, in so many of them at most.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course {
    /// s.
    pub until: f64,
    /// s.
    pub size: f64,
    pub most_steps: usize,
    pub correction: Option<Correction>,
    /// How fine the elements are kept on the way.
    pub mesh: Mesh,
}
