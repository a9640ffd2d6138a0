//! Mesh refinement for an equilibrium with a tolerance.

use super::division::{
    FIRST_LENGTH, cut, cut_each, cut_into, first_length, longest_element, merge_lossless,
};
use super::hidden_turns::hidden_turns;
use super::richardson::SAFETY;
use super::{Adaptive, HistoryFunction, Outcome, Statistics, tolerance_of_equilibria};
use crate::equilibrium::{Equilibrium, EquilibriumError};
use crate::integrator::{IntegrationError, ROUNDING};
use crate::model::Model;
use crate::numerics::scalar::largest;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::so3;
use crate::state::{Plan, State};

/// Number of elements of the first mesh of an equilibrium, in the growth zone or in a shoot of
/// constant length.
const FIRST_ELEMENTS: f64 = 3.0;
/// Deflection of a buckled upright shoot, relative to its length, over the square root of the
/// missing resistance: 1.7, rounded up.
const BUCKLING_DEFLECTION: f64 = 2.0;
/// Largest number of parts into which an element is divided in one refinement.
const MAX_PARTS: usize = 4;
/// Largest rotation of an element of the first mesh by its intrinsic strain, rad. The rotation by
/// strain and load together must stay below π.
const MAX_TURN: f64 = 2.0;
/// Largest number of elements. A shape that is smooth between its nodes needs fewer.
const MAX_ELEMENTS: usize = 100_000;
/// Largest number of elements at which an element that rotates by π in the iteration is halved. A
/// load that folds shorter elements compresses the shoot to nothing.
const MAX_ELEMENTS_TO_UNFOLD: usize = 1000;
/// Number of elements below which all elements are halved after a search that fails. Ropes of
/// q L³/(E I) = 1e5 are found on 16 elements, so that failures on 64 have other causes.
const MAX_ELEMENTS_TO_FIND: usize = 64;

impl Adaptive {
    /// Solves the equilibrium on a refined mesh, and sets the history of the laws.
    pub(super) fn start_on_refined_elements(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Outcome<Statistics> {
        if shoot.state.history.levels() == 0 {
            merge_lossless(shoot);
            cut(shoot, first_length(shoot, FIRST_ELEMENTS));
        }
        shoot.state.forget();
        let mut refinement = Statistics::default();
        // The error of the solver is added to that of the elements.
        let tolerance = self.tolerance - tolerance_of_equilibria(self.tolerance);
        let (error, found) = self.refine_equilibrium(shoot, tolerance, 1.0, &mut refinement)?;
        let mut statistics = self.workspace.run(shoot).start(history, Some(found))?;
        let error = error + statistics.equilibrium_error;
        statistics += refinement;
        // No step was chosen. Later calls keep elements and error.
        let ([tolerance, merge_tolerance], [step, coarsest_step]) =
            ([self.tolerance; 2], [f64::MAX; 2]);
        let (until, longest_element) = (shoot.time(), longest_element(&shoot.state) / FIRST_LENGTH);
        shoot.state.plan = Some(Plan {
            tolerance,
            until,
            step,
            coarsest_step,
            longest_element,
            merge_tolerance,
            error,
        });
        Ok(Statistics {
            error: Some(error),
            ..statistics
        })
    }

    /// Solves the equilibrium of a shoot without a history, and refines the mesh until the error is
    /// below a tolerance. Returns the error estimate, relative to the length, and the equilibrium.
    ///
    /// The error that the difference of two meshes shows is multiplied by `weight`, below one if
    /// another comparison shows it too. The cost of the equilibria is added to `spent`, also if the
    /// refinement fails later. The limit of the work holds for the sum.
    pub(super) fn refine_equilibrium(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        tolerance: f64,
        weight: f64,
        spent: &mut Statistics,
    ) -> Outcome<(f64, Equilibrium)> {
        self.workspace.solver.tolerance = tolerance_of_equilibria(tolerance);
        let order = 2.0 * shoot.rod().order().points() as f64;
        // Positions have order 2 p in the length of short elements. The estimate assumes two orders
        // less, since elements that are barely short enough may not show the full order.
        let gain = 2.0_f64.powf((order - 2.0).max(1.0)) - 1.0;
        cut_turns(shoot);
        // Contacts are searched from the present shape.
        self.workspace.stepper.begin_increment(shoot);
        let mut reached = f64::INFINITY;
        loop {
            if spent.work() > self.max_work || 2 * shoot.state.rod.elements() > MAX_ELEMENTS {
                let (work, snap) = (spent.work(), None);
                return Err(IntegrationError::ToleranceNotMet {
                    tolerance,
                    reached,
                    work,
                    snap,
                });
            }
            let Some(before) = self.equilibrium_or_cut(shoot, None, spent)? else {
                continue;
            };
            let coarse = shoot.state.clone();
            cut_each(&mut shoot.state, |_, _| 2);
            let Some(found) = self.equilibrium_or_cut(shoot, Some(&coarse), spent)? else {
                continue;
            };
            let difference = distance(&coarse.rod, &shoot.state.rod);
            // Shapes with a large difference do not show an order of convergence. With the cube
            // root a difference of one permits no gain, and a gain of two needs a difference below
            // 1/8.
            let gain = gain.min(difference.cbrt().recip());
            let change = weight * SAFETY * difference;
            let weakened = SAFETY * (before.resistance - found.resistance).abs();
            let hidden_turns = hidden_turns(&coarse.rod, shoot);
            let hidden = SAFETY * hidden_turns.iter().sum::<f64>();
            // The coarse elements are sufficient if their error is far enough below the tolerance.
            let error = change + hidden + buckling_error(before.resistance, weakened);
            if SAFETY * error <= tolerance {
                shoot.state.copy_from(&coarse);
                return Ok((error, before));
            }
            let error = change / gain + hidden + buckling_error(found.resistance, weakened / gain);
            if error <= tolerance {
                return Ok((error, found));
            }
            reached = error;
            let share = tolerance / (SAFETY * coarse.rod.elements() as f64);
            if hidden_turns.iter().any(|turn| *turn > share) {
                // The error of these elements affects the whole shape, and is reduced before other
                // elements are refined.
                shoot.state.copy_from(&coarse);
                cut_each(&mut shoot.state, |_, e| {
                    if hidden_turns[e] > share {
                        MAX_PARTS
                    } else {
                        1
                    }
                });
            } else {
                refine(shoot, &coarse, gain * share / weight, order);
            }
        }
    }

    /// Solves the equilibrium and adds its cost. Returns `None` if the search fails on a mesh that
    /// can be refined. If an element rotates by π in the iteration, this element is then halved. If
    /// the elements are the halves of those of `coarse`, the state becomes `coarse`, and its element
    /// that contains the half is halved. After another failure all elements are halved.
    fn equilibrium_or_cut(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        coarse: Option<&State>,
        spent: &mut Statistics,
    ) -> Outcome<Option<Equilibrium>> {
        let elements = shoot.state.rod.elements();
        let time = shoot.time();
        match self.workspace.run(shoot).solve_equilibrium(time) {
            Err(IntegrationError::Equilibrium {
                error: EquilibriumError::Folded { element, .. },
                ..
            }) if elements < MAX_ELEMENTS_TO_UNFOLD => {
                let mut folded = element;
                if let Some(coarse) = coarse {
                    shoot.state.copy_from(coarse);
                    folded /= 2;
                }
                cut_into(&mut shoot.state, folded, 2);
                Ok(None)
            }
            Err(IntegrationError::Equilibrium { error, .. })
                if error.is_recoverable() && elements < MAX_ELEMENTS_TO_FIND =>
            {
                cut_each(&mut shoot.state, |_, _| 2);
                Ok(None)
            }
            found => {
                let found = found?;
                spent.add_equilibrium(&found);
                Ok(Some(found))
            }
        }
    }
}

/// Divides elements that rotate far by their intrinsic strain.
fn cut_turns(shoot: &mut Shoot<impl Model>) {
    let parts: Vec<f64> = (0..shoot.state.rod.elements())
        .map(|e| (shoot.state.rod.intrinsic_turn(e) / MAX_TURN).ceil())
        .collect();
    if parts.iter().sum::<f64>() <= MAX_ELEMENTS as f64 {
        cut_each(&mut shoot.state, |_, e| parts[e] as usize);
    }
}

/// Returns the possible deflection of a shoot by buckling, relative to its length. `resistance` is
/// the resistance to a rotation of the apex, relative to that without load, and `error` bounds its
/// error. Both meshes may be too stiff to buckle.
fn buckling_error(resistance: f64, error: f64) -> f64 {
    let lacking = error - resistance;
    if lacking > ROUNDING {
        BUCKLING_DEFLECTION * lacking.sqrt()
    } else {
        0.0
    }
}

/// Restores the elements of `coarse`, and divides those whose rotation differs from that of their
/// halves by more than `share`, rad.
fn refine(shoot: &mut Shoot<impl Model>, coarse: &State, share: f64, order: f64) {
    let mut parts: Vec<usize> = (0..coarse.rod.elements())
        .map(|e| {
            let excess = turn_between(&coarse.rod, &shoot.state.rod, e) / share;
            // The error of one part has one order more in its length than the error of the element.
            (excess.powf(1.0 / (order + 1.0)).ceil() as usize).clamp(1, MAX_PARTS)
        })
        .collect();
    if parts.iter().all(|parts| *parts == 1) {
        parts.fill(2);
    }
    shoot.state.copy_from(coarse);
    cut_each(&mut shoot.state, |_, e| parts[e]);
}

/// Returns the largest distance between a rod and one whose elements are halves of its elements, at
/// the ends and the middles of the elements, relative to the length. A shape is less accurate
/// inside an element than at its ends. For a line that shears and stretches the error of the
/// interpolated strain is largest at the quarters, which are compared too.
fn distance(coarse: &Rod, fine: &Rod) -> f64 {
    let (a, b) = (coarse.centre_line(), fine.centre_line());
    let ends = a
        .iter()
        .zip(b.iter().step_by(2))
        .map(|((_, a), (_, b))| (a - b).norm());
    let middle = |e: usize| (a[e].1 + coarse.chord(e, 0.5) - b[2 * e + 1].1).norm();
    let quarter = |half: usize| {
        let (e, x) = (half / 2, if half.is_multiple_of(2) { 0.25 } else { 0.75 });
        (a[e].1 + coarse.chord(e, x) - b[half].1 - fine.chord(half, 0.5)).norm()
    };
    let quarters = (0..if coarse.yields() { fine.elements() } else { 0 }).map(quarter);
    largest(
        ends.chain((0..coarse.elements()).map(middle))
            .chain(quarters),
    ) / coarse.length()
}

/// Returns the difference between the two rods in the rotation from one end of element `e` to the
/// other, rad.
fn turn_between(coarse: &Rod, fine: &Rod, e: usize) -> f64 {
    let turn = |rod: &Rod, a: usize, b: usize| rod.frames()[a].inverse() * rod.frames()[b];
    so3::log(&(turn(coarse, e, e + 1).inverse() * turn(fine, 2 * e, 2 * e + 2))).norm()
}
