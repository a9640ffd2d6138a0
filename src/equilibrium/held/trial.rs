//! Data of an iteration: its course, the start of a step, trials, and what decides about them.

use nalgebra::{DVector, Vector3};

use super::candidate::Candidate;
use super::ends::End;
use super::line::Line;
use super::linear::Linear;
use super::reduced::Contact;
use super::search::Snapshot;
use super::sites::Site;
use crate::equilibrium::Inertia;
use crate::equilibrium::elimination::Row;
use crate::equilibrium::system::Configuration;

/// How far from the initial guess a search looks for an equilibrium.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Reach {
    /// Newton's method. In contact it ends where no share of a step is in range or the rod is unstable.
    Newton,
    /// A descent that ends where it leaves the neighbourhood of the initial guess. Friction acts on the displacement
    /// since the start of the increment.
    Near,
    /// A descent to any equilibrium. Friction dissipates energy in every step, and acts on the displacement in it.
    Far,
}

/// What an iteration needs to know of those before it.
pub(super) struct Course {
    pub reach: Reach,
    /// Places of the centre line at the initial guess, m; empty unless the reach is `Near`, which alone uses them.
    pub line: Vec<Vector3<f64>>,
    /// Largest rotation in the last step, rad; infinite if the next step does not continue it.
    pub last: f64,
    /// Shift of the last step, N; without contact in a descent the last one that was not zero.
    pub shift: f64,
    /// Shift that is tried first in the next step, N.
    pub next: f64,
    pub saddles: usize,
    /// Number of permitted negative directions at the first tangent, in a search for an unstable equilibrium.
    pub negative: Option<usize>,
    /// Whether a straight rod was bent.
    pub bowed: bool,
    /// Number of times that nodes have moved to the contacts, and the equilibrium on the nodes before the last time.
    pub placements: usize,
    pub answer: Option<Snapshot>,
    /// Largest distance by which nodes moved then, relative to the length; infinite before.
    pub distance: f64,
    /// The ends of contact segments in the last placement of nodes.
    pub ends: Vec<End>,
}

impl Course {
    /// Whether the tangent has to be positive on the permitted directions also while contacts are loaded.
    pub fn is_guarded(&self) -> bool {
        self.reach != Reach::Newton
    }
}

/// The start of a step.
pub(super) struct Start {
    pub shape: Configuration,
    pub sites: Vec<Site>,
    pub candidates: Vec<Candidate>,
    pub turns: Vec<Vector3<f64>>,
    pub condensed: Vec<Row>,
    /// The unbalanced force on a free base, N.
    pub base: Vector3<f64>,
    pub line: Line,
}

/// An accepted step.
pub(super) struct Step {
    /// Largest rotation, rad.
    pub turn: f64,
    /// Share of the unbalanced couples times the fraction of the step that was taken.
    pub fraction: f64,
    pub shift: f64,
    pub pivots: Inertia,
    pub linear: Linear,
    /// Whether the state of a contact has changed.
    pub changed: bool,
    /// Largest displacement of a hold or spring of a rod that stretches, m; zero without stretch.
    pub stretch: f64,
    /// Distance from the shape of the tangent: the sum of the rotations (rad) and of the changes of the reactions,
    /// relative to the largest one, since then.
    pub drift: f64,
}

/// The outcome of an attempt at a step with a given shift.
pub(super) enum Attempt {
    Accepted(Box<Step>),
    /// The rod has moved without a step, from a straight shape or a saddle.
    Moved,
    /// A larger shift is needed.
    Rejected,
    /// The rod is unstable in a direction that its supports permit, or no share of a Newton step fits: no equilibrium
    /// is next to it.
    Lost,
}

/// A step on the linear rod.
pub(super) struct Trial {
    pub linear: Linear,
    pub contacts: Vec<Contact>,
    /// Changes of the reactions of holds and springs.
    pub links: DVector<f64>,
    /// Largest rotation, rad.
    pub turn: f64,
    /// Whether the contact problem is solved.
    pub solved: bool,
}

impl Trial {
    /// A trial whose contact problem is not solved yet.
    pub fn new(linear: Linear) -> Self {
        Self { linear, contacts: Vec::new(), links: DVector::zeros(0), turn: 0.0, solved: false }
    }
}

/// Quantities that decide whether a step is accepted.
#[derive(Clone, Copy)]
pub(super) struct Merit {
    /// Energy of the rod with its supports, J.
    pub energy: f64,
    /// Sum of the violated distances, m.
    pub violation: f64,
    /// Work of friction, J.
    pub friction: f64,
    /// Largest violation of a balance or a law, relative to the force and the length.
    pub residual: f64,
}
