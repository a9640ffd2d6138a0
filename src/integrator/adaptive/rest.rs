//! A shape at rest to a tolerance: elements are cut where it needs them.

use nalgebra::Vector3;

use super::cut::{cut_first, cut_into};
use super::estimate::SAFETY;
use super::jumps::hidden_turns;
use super::{Adaptive, HistoryFunction, IntegrationError, Statistics, of_equilibria};
use crate::equilibrium::EquilibriumError;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::so3;
use crate::state::State;

/// Positions are of order 2 p in the length of elements that are short enough. Two orders less are counted on:
/// elements that are just short enough do not show them all.
const RESERVE: f64 = 2.0;
/// An upright shoot under its weight falls by 1.7 times the root of the resistance that it lacks, relative to its length.
const FALL: f64 = 2.0;
/// Resistance below this is rounding: what a shoot has that turns at no cost.
const ROUNDING: f64 = 1e-9;
/// An element is cut into so many parts at most before it is looked at again.
const MOST_PARTS: usize = 4;
/// An element of the first mesh turns by no more than this under its intrinsic strain, rad: it must stay below π, and what the load
/// adds is not known yet.
const MOST_TURN: f64 = 2.0;
/// So many elements are more than any shape needs that is smooth between its nodes.
const MOST_ELEMENTS: usize = 100_000;
/// Elements that turn by π on the way to a shape are halved up to this number of all: a load that folds shorter ones crushes the shoot.
const MOST_TO_UNFOLD: usize = 1000;

impl Adaptive {
    /// Finds the shape at rest on elements that are short enough, and gives the laws a history.
    pub(super) fn rest(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Result<Statistics, IntegrationError> {
        if shoot.state.history.levels() == 0 {
            cut_first(shoot);
        }
        // The history is that of other elements; a new one is made at the end.
        shoot.state.forget();
        let found = self.settle(shoot, self.tolerance)?;
        let mut statistics = self.stepper.start(shoot, &mut self.solver, history)?;
        let error = found.error.map(|error| error + statistics.equilibrium_error);
        statistics += found;
        Ok(Statistics { error, ..statistics })
    }

    /// Cuts the elements of a shoot that no integrator has started, where its shape at rest needs shorter ones to keep a tolerance,
    /// and finds that shape.
    pub(super) fn settle(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        tolerance: f64,
    ) -> Result<Statistics, IntegrationError> {
        self.solver.tolerance = of_equilibria(tolerance);
        let order = 2.0 * shoot.rod().order().points() as f64;
        let gain = 2.0_f64.powf((order - RESERVE).max(1.0)) - 1.0;
        self.stepper.statistics = Statistics::default();
        cut_turns(shoot);
        loop {
            if let Some(folded) = self.fold(shoot)? {
                cut_into(&mut shoot.state, folded, 2);
                continue;
            }
            let (coarse, before) = (shoot.state.clone(), self.solver.resistance());
            halve(&mut shoot.state);
            if let Some(folded) = self.fold(shoot)? {
                shoot.state.copy_from(&coarse);
                cut_into(&mut shoot.state, folded / 2, 2);
                continue;
            }
            let difference = distance(&coarse.rod, &shoot.state.rod);
            // Shapes that differ by much are not near enough to show their order.
            let gain = gain.min(difference.sqrt().recip());
            let change = SAFETY * difference;
            let resistance = self.solver.resistance();
            let weakened = SAFETY * (before - resistance).abs();
            let hidden = hidden_turns(&coarse.rod, shoot);
            let unseen = SAFETY * hidden.iter().sum::<f64>();
            // An error that halves bring down to the tolerance is met by them; one that is below it already has no need of them.
            let error = change + unseen + fall(before, weakened);
            if SAFETY * error <= tolerance {
                shoot.state.copy_from(&coarse);
                return Ok(Statistics { error: Some(error), ..self.stepper.statistics });
            }
            let error = change / gain + unseen + fall(resistance, weakened / gain);
            if error <= tolerance {
                return Ok(Statistics { error: Some(error), ..self.stepper.statistics });
            }
            if 2 * shoot.rod().elements() > MOST_ELEMENTS {
                return Err(IntegrationError::ToleranceNotMet { tolerance, reached: error, steps: 0 });
            }
            let share = tolerance / (SAFETY * coarse.rod.elements() as f64);
            if hidden.iter().any(|turn| *turn > share) {
                // What they hide moves all others.
                shoot.state.copy_from(&coarse);
                for e in (0..hidden.len()).rev().filter(|e| hidden[*e] > share) {
                    cut_into(&mut shoot.state, e, MOST_PARTS);
                }
            } else {
                refine(shoot, &coarse, gain * share, order);
            }
        }
    }

    /// Finds the equilibrium, or an element that is too long for it.
    fn fold(&mut self, shoot: &mut Shoot<impl Model>) -> Result<Option<usize>, IntegrationError> {
        let (time, full) = (shoot.time(), shoot.rod().elements() >= MOST_TO_UNFOLD);
        match self.stepper.equilibrate(shoot, &mut self.solver, time) {
            Err(IntegrationError::Equilibrium { source: EquilibriumError::Folded { element }, .. }) if !full => {
                Ok(Some(element))
            }
            found => found.map(|_| None),
        }
    }
}

/// Cuts elements that turn by much.
fn cut_turns(shoot: &mut Shoot<impl Model>) {
    let parts: Vec<f64> =
        (0..shoot.rod().elements()).map(|e| (shoot.rod().intrinsic_turn(e) / MOST_TURN).ceil()).collect();
    if parts.iter().sum::<f64>() <= MOST_ELEMENTS as f64 {
        for (e, parts) in parts.iter().enumerate().rev() {
            cut_into(&mut shoot.state, e, *parts as usize);
        }
    }
}

/// Cuts every element in two.
fn halve(state: &mut State) {
    for e in (0..state.rod.elements()).rev() {
        cut_into(state, e, 2);
    }
}

/// How far a shoot may have to fall yet, relative to its length, whose `resistance` (relative to that without load) is off by up to an
/// `error`: a coarse mesh keeps a shoot upright that has buckled, and so do its halves.
fn fall(resistance: f64, error: f64) -> f64 {
    let lacking = error - resistance;
    if lacking > ROUNDING { FALL * lacking.sqrt() } else { 0.0 }
}

/// Goes back to the elements of `coarse`, and cuts those whose halves turn what is beyond them by more than their `share`, rad.
fn refine(shoot: &mut Shoot<impl Model>, coarse: &State, share: f64, order: f64) {
    let mut parts: Vec<usize> = (0..coarse.rod.elements())
        .map(|e| {
            let excess = turn_between(&coarse.rod, &shoot.state.rod, e) / share;
            // The parts of an element turn by less with one order more in their length.
            (excess.powf(1.0 / (order + 1.0)).ceil() as usize).clamp(1, MOST_PARTS)
        })
        .collect();
    if parts.iter().all(|parts| *parts == 1) {
        parts.fill(2);
    }
    shoot.state.copy_from(coarse);
    for (e, parts) in parts.iter().enumerate().rev() {
        cut_into(&mut shoot.state, e, *parts);
    }
}

/// The largest distance between the ends and the middles of the elements of a rod and the same places on one whose elements are halves
/// of these, relative to the length. In between a shape is less accurate than at the ends. The strain of a line that shears and
/// stretches is interpolated there, which errs most at the quarters.
fn distance(coarse: &Rod, fine: &Rod) -> f64 {
    let (a, b) = (coarse.centre_line(), fine.centre_line());
    let ends = a.iter().zip(b.iter().step_by(2)).map(|((_, a), (_, b))| (a - b).norm());
    let middle = |e: usize| (a[e].1 + coarse.chord(e, 0.5) - b[2 * e + 1].1).norm();
    let quarter = |half: usize| {
        let (e, x) = (half / 2, if half.is_multiple_of(2) { 0.25 } else { 0.75 });
        (a[e].1 + coarse.chord(e, x) - b[half].1 - fine.chord(half, 0.5)).norm()
    };
    let quarters = (0..if coarse.yields() { fine.elements() } else { 0 }).map(quarter);
    ends.chain((0..coarse.elements()).map(middle)).chain(quarters).fold(0.0, f64::max) / coarse.length()
}

/// By how much the two ends of element `e` are turned differently against each other on the two rods, rad.
fn turn_between(coarse: &Rod, fine: &Rod, e: usize) -> f64 {
    let turn = |rod: &Rod, a: usize, b: usize| rod.frames()[a].inverse() * rod.frames()[b];
    let difference: Vector3<f64> = so3::log(&(turn(coarse, e, e + 1).inverse() * turn(fine, 2 * e, 2 * e + 2)));
    difference.norm()
}
