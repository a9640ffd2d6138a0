//! Choice of elements, merge tolerance and steps by trial runs, in the order of
//! [`guide::accuracy`](crate::guide::accuracy). The main loop is in `Trials::choose`.

use super::elements::{FIRST_LENGTH, LOSSLESS, cut_first, longest_element};
use super::richardson::{AIM, ASYMPTOTIC, ErrorEstimate, Richardson, SAFETY};
use super::trials::Trials;
use crate::equilibrium::EquilibriumError;
use crate::integrator::error::Outcome;
use crate::integrator::{IntegrationError, MAX_HALVINGS, ROUNDING, Statistics};
use crate::model::Model;
use crate::reference_element::Order;
use crate::rod::LARGEST_INSIDE;
use crate::shoot::Shoot;
use crate::state::Plan;
use crate::tropism::Declaration;

/// Ratio of the longest element to that of the trial run before, after a failure. It is slightly below
/// [`FIRST_LENGTH`], so that every element of a run that has started already is divided.
const SHORTER: f64 = 0.7;
/// Smallest ratio of the element lengths of two runs for which their difference shows the error of the elements.
const MIN_RATIO: f64 = 1.15;
/// Largest number of refinements of the elements, of the merge tolerance, and after failures. The elements are
/// then shorter by a factor of 0.7¹⁰ = 1/35 or less.
const MAX_REFINEMENTS: usize = 10;
/// Largest number of refinements after failures at the start of a run, where the mesh of the equilibrium was
/// refined before.
const MAX_REFINEMENTS_AT_START: usize = 2;
/// Ratio of the merge tolerance of the run that shows the error of merging to the smallest one that permits the
/// mergers of the run before.
const FINER_MERGING: f64 = 0.25;
/// Smallest and largest number of steps of the first trial run, not counting short steps after discontinuities.
const FIRST_STEPS: [f64; 2] = [16.0, 1000.0];

impl<M: Model> Trials<'_, M> {
    /// Chooses a resolution for the time to `until` and integrates with it, by at most `max_steps` steps.
    /// Returns the resolution and the statistics of the call.
    pub(super) fn choose(&mut self, until: f64, max_steps: usize) -> Outcome<(Plan, Statistics)> {
        // The result of a call that stops before `until` cannot be compared with another run.
        let extrapolated = max_steps < usize::MAX;
        let tolerance = self.integrator.tolerance;
        let earlier_calls = self.start.plan().map_or(0.0, |plan| plan.error);
        // Runs 1 to 4 of the guide.
        let (mut plan, mut estimate) = self.first_runs(until)?;
        // Run 5: shorter steps by the observed order, until the estimate is below the tolerance.
        loop {
            if estimate.reported() <= tolerance && !extrapolated {
                plan.error = earlier_calls + estimate.reported() + self.last.equilibrium_error;
                return Ok((plan, self.statistics()));
            }
            if estimate.left_for_steps(tolerance) <= 0.0 {
                return Err(self.not_met(estimate.reported()));
            }
            let (ratio, is_last) = estimate.next_refinement(tolerance, extrapolated);
            plan.step /= ratio;
            if is_last {
                plan.error = earlier_calls + estimate.extrapolated(ratio);
                return Ok((plan, self.run_uncompared(&plan, max_steps)?));
            }
            self.run(&plan, estimate.reported())?;
            estimate = estimate.refined(ratio, self.difference());
        }
    }

    /// Makes runs with long steps and increasing numbers of elements, and one with half the steps. Refines
    /// steps and elements until these runs succeed and show an order of convergence. Returns the last
    /// resolution and its error estimate.
    fn first_runs(&mut self, until: f64) -> Outcome<(Plan, ErrorEstimate)> {
        let mut coarse = self.first_plan(until);
        let (mut failure, mut refinements) = (None, 0);
        for _ in 0..MAX_HALVINGS {
            match self.compare(&coarse) {
                Ok((plan, estimate)) if estimate.is_asymptotic() => return Ok((plan, estimate)),
                Ok(_) | Err(IntegrationError::GrowsTooFast { .. }) => (),
                Err(error) if error.is_recoverable() => {
                    // Shorter elements may prevent these failures only.
                    if let IntegrationError::Equilibrium { time, .. } | IntegrationError::Uneven { time, .. } = error {
                        let at_start = time == self.start.time && !self.has_started();
                        if refinements == if at_start { MAX_REFINEMENTS_AT_START } else { MAX_REFINEMENTS } {
                            return Err(error);
                        }
                        refinements += 1;
                        coarse.longest_element *= SHORTER;
                    }
                    let is_folded =
                        matches!(error, IntegrationError::Equilibrium { error: EquilibriumError::Folded { .. }, .. });
                    failure = Some(error);
                    // Shorter steps do not change the rotation of an element.
                    if is_folded {
                        continue;
                    }
                }
                Err(error) => return Err(failure.unwrap_or(error)),
            }
            coarse.step *= 0.5;
        }
        Err(failure.unwrap_or_else(|| self.not_met(ASYMPTOTIC)))
    }

    /// Returns the resolution of the first run: few elements, and steps as long as the shortest delay.
    fn first_plan(&mut self, until: f64) -> Plan {
        let longest_element = if self.has_started() {
            // The elements of a run that has started are kept.
            let kept = self.start.plan().map(|plan| plan.longest_element);
            kept.unwrap_or_else(|| longest_element(self.start) / FIRST_LENGTH)
        } else {
            self.shoot.state.copy_from(self.start);
            cut_first(self.shoot);
            longest_element(&self.shoot.state) / FIRST_LENGTH
        };
        let step = first_step(self.shoot, until);
        let tolerance = self.integrator.tolerance;
        let merge_tolerance = tolerance.min(LARGEST_INSIDE);
        let (reached, error) = (self.start.time, 1.0);
        Plan { tolerance, until, step, coarsest_step: step, longest_element, merge_tolerance, reached, error }
    }

    /// Estimates the errors of elements, of merging and of steps, in this order, by runs with the steps of
    /// `coarse` and with half of them.
    fn compare(&mut self, coarse: &Plan) -> Outcome<(Plan, ErrorEstimate)> {
        let (mut plan, elements) = self.refine_elements(coarse)?;
        if elements.is_infinite() {
            return Ok((plan, ErrorEstimate::of_half_steps(elements, elements)));
        }
        let merging = self.refine_merging(&mut plan)?;
        plan.step *= 0.5;
        self.run(&plan, f64::INFINITY)?;
        let space = elements + merging + self.initial_error;
        Ok((plan, ErrorEstimate::of_half_steps(self.difference(), space)))
    }

    /// Refines the elements at constant steps until their error is small enough. Returns the resolution and the
    /// error. The error is infinite if the steps are too long to show it.
    fn refine_elements(&mut self, coarse: &Plan) -> Outcome<(Plan, f64)> {
        let mut estimate = Richardson::new(order_in_space(self.start.rod.order()));
        let enough = AIM[1] * self.integrator.tolerance;
        let mut plan = *coarse;
        self.run(&plan, f64::INFINITY)?;
        let mut compared = plan.longest_element;
        let (mut refinement, mut error) = (1.0 / SHORTER, f64::INFINITY);
        for _ in 0..MAX_REFINEMENTS {
            plan.longest_element /= refinement;
            self.run(&plan, f64::INFINITY)?;
            let (ratio, difference) = (self.element_ratio(), self.difference());
            let differ = !(1.0 / MIN_RATIO..MIN_RATIO).contains(&ratio);
            if difference <= enough && differ {
                // The longer elements are sufficient.
                if ratio > 1.0 {
                    self.keep_earlier();
                    plan.longest_element = compared;
                }
                return Ok((plan, difference));
            }
            if ratio < MIN_RATIO {
                self.keep_earlier();
                continue;
            }
            let next_error = estimate.error(ratio, difference);
            if !estimate.converges() {
                // The remaining difference is due to the steps.
                if SAFETY * error > self.integrator.tolerance {
                    return Ok((plan, f64::INFINITY));
                }
                self.keep_earlier();
                return Ok((Plan { longest_element: compared, ..plan }, error));
            }
            compared = plan.longest_element;
            if difference > ASYMPTOTIC {
                refinement = 2.0;
                continue;
            }
            error = next_error;
            if error <= enough {
                return Ok((plan, error));
            }
            // The observed order does not hold for refinements by more than two.
            refinement = (error / enough).powf(1.0 / estimate.order()).clamp(1.0 / SHORTER, 2.0);
        }
        Err(self.not_met(self.difference()))
    }

    /// Reduces the merge tolerance until the error of merging is small enough. Returns this error, which is
    /// estimated by a run that merges less.
    fn refine_merging(&mut self, plan: &mut Plan) -> Outcome<f64> {
        let mut error = 0.0;
        for _ in 0..MAX_REFINEMENTS {
            let needed = self.last.merge_loss;
            if needed <= LOSSLESS {
                return Ok(0.0);
            }
            let finer = Plan { merge_tolerance: FINER_MERGING * needed, ..*plan };
            self.run(&finer, f64::INFINITY)?;
            error = self.difference() / (1.0 - FINER_MERGING);
            if error <= AIM[1] * self.integrator.tolerance {
                // The run with half the steps has the same merge tolerance as the earlier run.
                self.keep_earlier();
                break;
            }
            *plan = finer;
        }
        Ok(error)
    }
}

/// Assumed order in space. Positions have order 2 p, and the stimuli at a material point have order p + 2. One
/// order is subtracted from the latter since shapes are not smooth everywhere.
fn order_in_space(order: Order) -> f64 {
    let p = order.points() as f64;
    (2.0 * p).min(p + 1.0)
}

/// Returns the step of the first run: the shortest delay, or the longest time constant of laws without delay,
/// within the bounds of [`FIRST_STEPS`], s.
fn first_step(shoot: &Shoot<impl Model>, until: f64) -> f64 {
    let span = (until - shoot.time()).max(f64::MIN_POSITIVE);
    let mut laws = Declaration::default();
    laws.read(shoot.model.tropism());
    let delay = laws.shortest_delay();
    let slowest = laws.variables().iter().map(|variable| variable.time_constant).fold(0.0, f64::max);
    let scale = if delay > 0.0 && delay.is_finite() {
        delay
    } else if slowest > 0.0 {
        slowest
    } else {
        span
    };
    let [fewest, most] = FIRST_STEPS;
    scale.max(span / most).min(span / fewest).max(ROUNDING * until.abs())
}
