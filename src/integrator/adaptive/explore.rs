//! The choice of steps and elements: trial runs through the time ahead, each held against another.

use super::cut::{FIRST_LENGTH, LOSSLESS, cut, cut_first, longest_element as longest};
use super::estimate::{AIM, ASYMPTOTIC, BLIND_SAFETY, Error, Ladder, SAFETY};
use super::{Adaptive, IntegrationError, Statistics};
use crate::integrator::stops::guarded;
use crate::model::Model;
use crate::reference_element::Order;
use crate::shoot::Shoot;
use crate::state::{Plan, State};

/// The elements of the second trial are shorter than those of the first by this: a little less than [`FIRST_LENGTH`], so that every
/// element is cut of a run that has started already.
const CUT: f64 = 0.7;
/// The angles that merging of mature elements may change, over the error of the shape. Inside an element it may be twenty times as much;
/// that vanishes on average and moves the line between its ends by a tenth of the element at most, not what is beyond.
const MERGING: f64 = 1.0;
/// Elements are not made shorter by more than this before they are looked at again: so long an order holds.
const MOST_FINER: f64 = 2.0;
/// Runs whose elements are longer by less than this are as good as alike, and say nothing of the elements.
const LEAST_RATIO: f64 = 1.15;
/// So often at most: a shoot that asks for elements a hundred times as short as the first is not resolved by them.
const MOST_RUNGS: usize = 10;
/// The shape at rest from which a run starts keeps this part of the tolerance that the run is for.
const AT_REST: f64 = 0.05;
/// The tolerance of merging in the run that shows the error of merging, over the smallest with which the same pairs are merged as before.
const FINER_MERGING: f64 = 0.25;
/// No mature elements are merged more coarsely than this, rad.
const COARSEST_MERGE: f64 = 2e-3;
/// So often a step is halved because a run at it fails, or because it does not show the order.
const HALVINGS: usize = 40;
/// The number of times that elements are made shorter because no equilibrium is found. Elements are then a 35th as long as at first.
const MOST_CUTS: usize = 10;
/// The same if a run fails where it starts without a past. The elements of the shape at rest are refined before.
const MOST_CUTS_AT_REST: usize = 2;
/// Steps of the first trial, at most, but for those that a start or a jump takes more.
const MOST_FIRST_STEPS: f64 = 1000.0;
/// The shortest first step, relative to the time: a million units of its rounding.
const SHORTEST_STEP: f64 = 1e6 * f64::EPSILON;
/// Steps of the first trial, at least.
const FIRST_STEPS: f64 = 16.0;

/// The order in space of what a run depends on: positions are of order 2 p, what the laws see at a
/// material point p + 2, and one order is left for what is not smooth.
fn order_in_space(order: Order) -> f64 {
    let p = order.points() as f64;
    (2.0 * p).min(p + 1.0)
}

impl Adaptive {
    /// Chooses a resolution for the time to `until`, and goes there, or so many steps of the way.
    pub(super) fn look_ahead(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        until: f64,
        most_steps: usize,
    ) -> Result<Statistics, IntegrationError> {
        guarded(shoot, |shoot, start| self.explore(shoot, start, until, most_steps))
    }

    fn explore(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        start: &State,
        until: f64,
        most_steps: usize,
    ) -> Result<Statistics, IntegrationError> {
        let inherited = start.plan.map_or(0.0, |plan| plan.error);
        let mut spent = Spent::default();
        let (mut plan, mut error) = self.first_trials(shoot, start, until, &mut spent)?;
        loop {
            if error.reported() <= self.tolerance && most_steps == usize::MAX {
                return Ok(keep(shoot, plan, inherited + error.reported(), spent));
            }
            let blind = most_steps < usize::MAX;
            if error.left_for_steps(self.tolerance) <= 0.0 {
                let (tolerance, reached, steps) = (self.tolerance, error.reported(), spent.steps());
                return Err(IntegrationError::ToleranceNotMet { tolerance, reached, steps });
            }
            let (jump, is_last) = error.next_jump(self.tolerance, blind);
            plan.step /= jump;
            if is_last {
                shoot.state.copy_from(start);
                let expected = error.expected(jump).reported();
                let plan = Plan { error: inherited + BLIND_SAFETY * expected, ..plan };
                return self.set_out(shoot, plan, most_steps, spent);
            }
            self.run(shoot, start, &plan, &mut spent, error.reported())?;
            error = error.seen(jump, self.tracks[0].distance(&self.tracks[1]));
        }
    }

    /// Coarse runs with more and more elements, and one with half the steps: the last of them, and its error.
    fn first_trials(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        start: &State,
        until: f64,
        spent: &mut Spent,
    ) -> Result<(Plan, Error), IntegrationError> {
        // Elements of a run that has started are as they are.
        let mut longest_element = start.plan.map_or(longest(start) / FIRST_LENGTH, |plan| plan.longest_element);
        if start.history.levels() == 0 {
            shoot.state.copy_from(start);
            cut_first(shoot);
            longest_element = longest(&shoot.state) / FIRST_LENGTH;
        }
        let step = self.first_step(shoot, until);
        let tolerance = self.tolerance;
        let merge_tolerance = (MERGING * tolerance).min(COARSEST_MERGE);
        let mut coarse = Plan { tolerance, until, step, coarsest: step, longest_element, merge_tolerance, error: 1.0 };
        let (mut failure, mut cuts) = (None, 0);
        for _ in 0..HALVINGS {
            match self.trials(shoot, start, &coarse, spent) {
                Ok((finer, error)) if error.shows_order() => return Ok((finer, error)),
                Ok(_) | Err(IntegrationError::GrowsTooFast { .. }) => (),
                Err(error) if error.is_recoverable() => {
                    // Shorter elements cure no other failure.
                    if let IntegrationError::Equilibrium { time, .. } | IntegrationError::Uneven { time, .. } = error {
                        let at_rest = time == start.time && start.history.levels() == 0;
                        if cuts == if at_rest { MOST_CUTS_AT_REST } else { MOST_CUTS } {
                            return Err(error);
                        }
                        cuts += 1;
                        coarse.longest_element *= CUT;
                    }
                    failure = Some(error);
                }
                Err(error) => return Err(failure.unwrap_or(error)),
            }
            coarse.step *= 0.5;
        }
        let reached = ASYMPTOTIC;
        Err(failure.unwrap_or(IntegrationError::ToleranceNotMet { tolerance, reached, steps: spent.steps() }))
    }

    fn trials(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        start: &State,
        coarse: &Plan,
        spent: &mut Spent,
    ) -> Result<(Plan, Error), IntegrationError> {
        let (mut fit, space) = self.fit_elements(shoot, start, coarse, spent)?;
        if space.is_infinite() {
            return Ok((fit, Error::of_first_trials(space, space)));
        }
        let merging = self.fit_merging(shoot, start, &mut fit, spent)?;
        let half = Plan { step: 0.5 * coarse.step, ..fit };
        self.run(shoot, start, &half, spent, f64::INFINITY)?;
        let difference = self.tracks[0].distance(&self.tracks[1]);
        Ok((half, Error::of_first_trials(difference, space + merging + spent.at_rest)))
    }

    /// The error that merging of mature elements makes, and the tolerance of merging, which is reduced until the error is small enough.
    /// Runs that merge less show it. None is needed if merging lost nothing in the last run.
    fn fit_merging(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        start: &State,
        plan: &mut Plan,
        spent: &mut Spent,
    ) -> Result<f64, IntegrationError> {
        let mut error = 0.0;
        for _ in 0..MOST_RUNGS {
            let needed = spent.last.merging;
            if needed <= LOSSLESS {
                return Ok(0.0);
            }
            let finer = Plan { merge_tolerance: FINER_MERGING * needed, ..*plan };
            self.run(shoot, start, &finer, spent, f64::INFINITY)?;
            error = self.tracks[0].distance(&self.tracks[1]) / (1.0 - FINER_MERGING);
            if error <= AIM[1] * self.tolerance {
                // The run with half the steps is compared with the one that merges like itself.
                self.tracks.swap(0, 1);
                break;
            }
            *plan = finer;
        }
        Ok(error)
    }

    /// Runs with the same steps and ever more elements, until these are enough: the last resolution, and the error of its elements,
    /// infinite if such coarse steps do not show it.
    fn fit_elements(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        start: &State,
        coarse: &Plan,
        spent: &mut Spent,
    ) -> Result<(Plan, f64), IntegrationError> {
        let mut ladder = Ladder::new(order_in_space(start.rod.order()));
        let enough = AIM[1] * self.tolerance;
        let mut plan = *coarse;
        self.run(shoot, start, &plan, spent, f64::INFINITY)?;
        let mut compared = plan.longest_element;
        let mut finer = 1.0 / CUT;
        let mut found = f64::INFINITY;
        for _ in 0..MOST_RUNGS {
            plan.longest_element /= finer;
            self.run(shoot, start, &plan, spent, f64::INFINITY)?;
            // By how much the elements were shorter in fact: those of a zone that grows are cut in halves, at times of their own.
            let ratio = self.tracks[1].longest_element() / self.tracks[0].longest_element();
            let alike = (1.0 / LEAST_RATIO..LEAST_RATIO).contains(&ratio);
            let difference = self.tracks[0].distance(&self.tracks[1]);
            if difference <= enough && !alike {
                // Where they make no difference the longer elements do.
                if ratio > 1.0 {
                    self.tracks.swap(0, 1);
                    plan.longest_element = compared;
                }
                return Ok((plan, difference));
            }
            if ratio < LEAST_RATIO {
                self.tracks.swap(0, 1);
                continue;
            }
            let space = ladder.climb(ratio, difference);
            if !ladder.falls() && SAFETY * found <= self.tolerance {
                // Such coarse steps do not show more: what is left is theirs.
                self.tracks.swap(0, 1);
                return Ok((Plan { longest_element: compared, ..plan }, found));
            }
            if !ladder.falls() {
                return Ok((plan, f64::INFINITY));
            }
            compared = plan.longest_element;
            if difference > ASYMPTOTIC {
                // Far off, but for all that is known it is the elements' doing.
                finer = MOST_FINER;
                continue;
            }
            found = space;
            if found <= enough {
                return Ok((plan, found));
            }
            finer = (found / enough).powf(1.0 / ladder.order()).clamp(1.0 / CUT, MOST_FINER);
        }
        let reached = self.tracks[0].distance(&self.tracks[1]);
        Err(IntegrationError::ToleranceNotMet { tolerance: self.tolerance, reached, steps: spent.steps() })
    }

    /// The step of the first trial: as long as the laws are read in the past alone, if they look back.
    fn first_step(&mut self, shoot: &Shoot<impl Model>, until: f64) -> f64 {
        let span = (until - shoot.time()).max(f64::MIN_POSITIVE);
        self.stepper.laws.read(shoot.model.tropism());
        let delay = self.stepper.laws.shortest_delay();
        let constants = self.stepper.laws.variables().iter().map(|variable| variable.time_constant);
        let slowest = constants.fold(0.0, f64::max);
        let scale = if delay > 0.0 && delay.is_finite() {
            delay
        } else if slowest > 0.0 {
            slowest
        } else {
            span
        };
        // Delays that are far shorter than the time ahead are left to the corrections of a step.
        let step = scale.max(span / MOST_FIRST_STEPS).min(span / FIRST_STEPS);
        step.max(SHORTEST_STEP * until.abs())
    }

    /// Runs from the start through the time of a plan, and keeps its track and the one before.
    fn run(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        start: &State,
        plan: &Plan,
        spent: &mut Spent,
        reached: f64,
    ) -> Result<(), IntegrationError> {
        shoot.state.copy_from(start);
        let ahead = (plan.until - shoot.time()) / plan.step;
        let tolerance = self.tolerance;
        let failure = |steps| IntegrationError::ToleranceNotMet { tolerance, reached, steps };
        if spent.steps() as f64 + ahead > self.max_steps as f64 {
            return Err(failure(spent.steps()));
        }
        let left = self.max_steps - spent.steps();
        self.tracks.swap(0, 1);
        let mut track = std::mem::take(&mut self.tracks[0]);
        track.clear();
        self.lay_elements(shoot, plan, spent)?;
        let course = self.course(shoot, plan, left);
        let answer =
            self.stepper.advance_watched(shoot, &mut self.solver, course, |shoot, stop| track.record(shoot, stop));
        self.tracks[0] = track;
        let statistics = answer?;
        spent.trials += std::mem::replace(&mut spent.last, statistics).as_trial();
        if shoot.time() < plan.until {
            return Err(failure(spent.steps()));
        }
        Ok(())
    }

    /// Cuts the elements for a run. A shape at rest that it begins with keeps a tolerance of its own.
    fn lay_elements(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        plan: &Plan,
        spent: &mut Spent,
    ) -> Result<(), IntegrationError> {
        cut(shoot, plan.longest_element);
        if shoot.state.history.levels() == 0 {
            let found = self.settle(shoot, AT_REST * self.tolerance)?;
            spent.at_rest = found.error.unwrap_or(0.0);
            spent.trials += found.as_trial();
        }
        Ok(())
    }

    /// Goes the first steps of a plan that was not tried itself.
    fn set_out(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        plan: Plan,
        most_steps: usize,
        mut spent: Spent,
    ) -> Result<Statistics, IntegrationError> {
        self.lay_elements(shoot, &plan, &mut spent)?;
        let course = self.course(shoot, &plan, most_steps);
        let mut statistics = self.stepper.advance(shoot, &mut self.solver, course)?;
        statistics += spent.last.as_trial();
        statistics += spent.trials;
        shoot.state.plan = Some(plan);
        Ok(Statistics { error: Some(plan.error), ..statistics })
    }
}

/// Keeps the answer of the last run.
fn keep(shoot: &mut Shoot<impl Model>, plan: Plan, error: f64, spent: Spent) -> Statistics {
    let mut statistics = spent.last;
    statistics += spent.trials;
    let error = error + spent.last.equilibrium_error;
    shoot.state.plan = Some(Plan { error, ..plan });
    Statistics { error: Some(error), ..statistics }
}

/// What the runs of a call have cost: the last one, and those before it.
#[derive(Debug, Clone, Copy, Default)]
struct Spent {
    last: Statistics,
    trials: Statistics,
    /// The error of the shape at rest that the last run began with, relative to the length.
    at_rest: f64,
}

impl Spent {
    fn steps(&self) -> usize {
        self.last.steps + self.trials.trial_steps
    }
}
