//! Data of an iteration: its course, the start of a step, trials, and what decides about them.

use nalgebra::{DVector, Vector3};

use super::candidate::Candidate;
use super::ends::End;
use super::line::Line;
use super::linear::Linear;
use super::reduced::LinearContact;
use super::search::Snapshot;
use super::sites::HeldSite;
use crate::equilibrium::elimination::Row;
use crate::equilibrium::search::SmallSteps;
use crate::equilibrium::system::Configuration;

/// Method of a search.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Reach {
    /// Newton's method, at any distance from the initial guess. It fails where three steps in
    /// succession stall; in contact also where a step without a shift has no share in range, and
    /// where the line search shortens such a step while the rod is unstable.
    Newton,
    /// A descent that ends where it leaves the neighbourhood of the initial guess. Friction acts on
    /// the displacement since the start of the increment.
    Near,
    /// A descent to any equilibrium. Friction dissipates energy in every step, and acts on the
    /// displacement in it.
    Far,
}

/// Data that one iteration passes to the next.
pub(super) struct Course {
    pub reach: Reach,
    /// Places of the centre line at the initial guess, m; empty in Newton's method, which does not
    /// use them.
    pub line: Vec<Vector3<f64>>,
    /// Largest rotation in the last step, rad; infinite if the next step does not continue it.
    pub last_turn: f64,
    /// Shift of the last step, N; without contact in a descent the last one that was not zero.
    pub shift: f64,
    /// Shift that is tried first in the next step, N.
    pub next_shift: f64,
    /// The least energy of the saddles that were left, J, and the number of saddles that were left
    /// since then, including this one.
    pub lowest: f64,
    pub saddles: usize,
    /// The last steps in which the rod rests.
    pub small_steps: SmallSteps,
    /// Number of permitted negative directions at the first tangent, in a search for an unstable
    /// equilibrium.
    pub negative: Option<usize>,
    /// Whether a straight rod was bent.
    pub bowed: bool,
    /// Number of times that nodes have moved to the contacts.
    pub placements: usize,
    /// The shape before the last motion of nodes, which is almost in equilibrium on its nodes.
    pub answer: Option<Snapshot>,
    /// Largest distance in this motion, relative to the length; infinite before the first one.
    pub distance: f64,
    /// The ends of contact segments in the last placement of nodes.
    pub ends: Vec<End>,
}

impl Course {
    /// Whether the iteration is a descent. Its tangent has to be positive on the permitted
    /// directions, also in contact.
    pub fn is_descent(&self) -> bool {
        self.reach != Reach::Newton
    }
}

/// The start of a step.
pub(super) struct Start {
    pub shape: Configuration,
    pub sites: Vec<HeldSite>,
    pub candidates: Vec<Candidate>,
    pub couples: Vec<Vector3<f64>>,
    pub condensed: Vec<Row>,
    /// The unbalanced force on a free base, N.
    pub base_force: Vector3<f64>,
    pub line: Line,
    /// The merit of the shape.
    pub merit: Merit,
}

/// An accepted step.
pub(super) struct Step {
    /// The step on the linear rod, of which the rod has moved by a fraction.
    pub trial: Trial,
    /// Part of the residual that the step has removed: share times fraction. It is one after a
    /// whole step.
    pub removed: f64,
    /// Whether the state of a contact has changed.
    pub changed: bool,
    /// Largest displacement of a hold or spring of a rod that stretches, m; zero without stretch.
    pub stretch: f64,
    /// Distance from the shape of the tangent: the sum of the rotations (rad) and of the changes of
    /// the reactions, relative to the largest one, since then.
    pub drift: f64,
}

/// The outcome of an attempt at a step with a given shift.
pub(super) enum Attempt {
    Accepted(Box<Step>),
    /// The rod has moved without a step, from a straight shape or a saddle.
    Moved,
    /// A larger shift is needed.
    Rejected,
    /// The iteration fails. In contact and without a shift, no share of the step is in range, or
    /// the rod is unstable and the step is not taken as a whole. In a search for an unstable
    /// equilibrium there are too many negative directions.
    Lost,
}

/// A step on the linear rod.
pub(super) struct Trial {
    pub linear: Linear,
    /// Difference of the coordinates from those of the linear rod in a correction; zero otherwise.
    pub offset: DVector<f64>,
    pub contacts: Vec<LinearContact>,
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
        let offset = DVector::zeros(linear.response.size());
        Self {
            linear,
            offset,
            contacts: Vec::new(),
            links: DVector::zeros(0),
            turn: 0.0,
            solved: false,
        }
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
