//! Choice of elements, merge tolerance and steps by runs, in the order of [`guide::accuracy`](crate::guide::accuracy).
//! The main loop is in `Runs::choose`.

use super::division::{FIRST_LENGTH, LOSSLESS, longest_element, size};
use super::richardson::{AIM_IN_SPACE, AIM_OF_MERGING, ASYMPTOTIC, ErrorEstimate, order_in_space};
use super::runs::{Run, Runs};
use super::space::{MIN_RATIO, Refined, SHORTER};
use crate::equilibrium::EquilibriumError;
use crate::integrator::error::Outcome;
use crate::integrator::{IntegrationError, MAX_HALVINGS, ROUNDING, Statistics};
use crate::load::Load;
use crate::model::Model;
use crate::rod::LARGEST_INSIDE;
use crate::state::Plan;
use crate::tropism::Declaration;

/// Ratio of the error of the elements to that of the steps below which two runs with different elements show the error
/// of the steps. The safety factor covers it.
const NEGLIGIBLE: f64 = 0.2;
/// Largest number of refinements after failures: the elements are then shorter by 0.7¹³ = 1/100.
const MAX_FAILURES: usize = 13;
/// The same at the start of a run, where the mesh of the equilibrium was refined before: six elements.
const MAX_FAILURES_AT_START: usize = 5;
/// Smallest and largest number of steps of the first run, not counting short steps after discontinuities.
const FIRST_STEPS: [f64; 2] = [8.0, 1000.0];

impl<M: Model> Runs<'_, M> {
    /// Chooses a resolution for the time to `until` and integrates with it, by at most `max_steps` steps.
    /// Returns the resolution and the statistics of the call.
    pub(super) fn choose(mut self, until: f64, max_steps: usize) -> Outcome<(Plan, Statistics)> {
        // The result of a call that stops before `until` cannot be compared with another run.
        let extrapolated = max_steps < usize::MAX;
        let tolerance = self.integrator.tolerance;
        // Runs 1 to 4 of the guide.
        let (mut run, mut estimate) = self.first_runs(until)?;
        // Run 5: shorter steps by the observed order, until the estimate is below the tolerance.
        loop {
            let solved = run.error_of_equilibria();
            let (reached, left) = (estimate.reported() + solved, tolerance - solved);
            if reached <= tolerance && !extrapolated {
                return Ok(self.accept(run, estimate.reported()));
            }
            if estimate.left_for_steps(left) <= 0.0 {
                return Err(self.not_met(reached));
            }
            let (ratio, is_last) = estimate.next_refinement(left, extrapolated);
            let plan = Plan { step: run.plan.step / ratio, ..run.plan };
            if is_last {
                let last = self.run_at_most(plan, max_steps)?;
                return Ok(self.accept(last, estimate.extrapolated(ratio)));
            }
            let finer = self.run(plan, reached)?;
            estimate = estimate.refined(ratio, finer.distance(&run));
            run = finer;
        }
    }

    /// Makes runs with long steps and increasing numbers of elements, and one with half the steps. Refines
    /// steps and elements until these runs succeed and show an order of convergence. Returns the last
    /// run and its error estimate.
    fn first_runs(&mut self, until: f64) -> Outcome<(Run, ErrorEstimate)> {
        let mut coarse = self.first_plan(until);
        let (mut failure, mut too_fast, mut failures, mut reached) = (None, None, 0, f64::INFINITY);
        for _ in 0..MAX_HALVINGS {
            match self.compare(&mut coarse) {
                Ok((run, estimate)) if estimate.is_asymptotic() => return Ok((run, estimate)),
                Ok((_, estimate)) => (failure, reached) = (None, estimate.reported()),
                Err(error @ IntegrationError::GrowsTooFast { .. }) => too_fast = Some(error),
                Err(error) if error.is_recoverable() => {
                    // Shorter elements may prevent these failures only.
                    if let IntegrationError::Equilibrium { time, .. } | IntegrationError::Uneven { time, .. } = error {
                        let at_start = time == self.start.time && !self.has_started();
                        if failures >= if at_start { MAX_FAILURES_AT_START } else { MAX_FAILURES } {
                            return Err(error);
                        }
                        failures += 1;
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
                // Long steps may diverge where shorter ones do not.
                Err(error @ IntegrationError::NotSlender { .. })
                    if !matches!(failure, Some(IntegrationError::NotSlender { .. })) =>
                {
                    failure = Some(error);
                }
                // The work may end, or the steps diverge, because of an earlier failure.
                Err(error @ (IntegrationError::ToleranceNotMet { .. } | IntegrationError::NotSlender { .. })) => {
                    return Err(failure.unwrap_or(error));
                }
                Err(error) => return Err(error),
            }
            coarse.step *= 0.5;
            // The runs before are not compared with the next ones.
            coarse.coarsest_step = coarse.step;
        }
        Err(failure.or(too_fast).unwrap_or_else(|| self.not_met(reached)))
    }

    /// Returns the resolution of the first run: one element in the growth zone, and the first step.
    fn first_plan(&self, until: f64) -> Plan {
        let longest_element = if self.has_started() {
            // The elements of a run that has started are kept.
            let kept = self.start.plan.map(|plan| plan.longest_element);
            kept.unwrap_or_else(|| longest_element(self.start) / FIRST_LENGTH)
        } else {
            size(self.shoot) / FIRST_LENGTH
        };
        // Steps that are multiples of the period of a load do not show it, and neither do halves of them.
        let period = self.shoot.model().load().shortest_period(self.start.time);
        let step = first_step(&self.laws, self.start.time, until).min(0.5 * period);
        let tolerance = self.integrator.tolerance;
        // A merger may lose up to twenty times this angle (rad). Where a bend begins in an element of relative length
        // h, that moves the centre line by up to 4 h times the merge tolerance.
        let merge_tolerance = tolerance.min(LARGEST_INSIDE);
        Plan { tolerance, until, step, coarsest_step: step, longest_element, merge_tolerance, error: 1.0 }
    }

    /// Estimates the errors of elements, of merging and of steps by runs with the steps of `coarse` and a run with half
    /// of them. The longest element of `coarse` becomes that of its run.
    fn compare(&mut self, coarse: &mut Plan) -> Outcome<(Run, ErrorEstimate)> {
        let tolerance = self.integrator.tolerance;
        let first = self.run_over_delays(*coarse)?;
        *coarse = first.plan;
        let finer = Plan { longest_element: self.next_length(coarse.longest_element), ..*coarse };
        // Half the steps and shorter elements at once: for a large tolerance this run suffices. The elements of a run
        // that has started already are sufficient for such a tolerance.
        let both = !self.has_started();
        let mut half = self.run_over_delays(Plan { step: 0.5 * coarse.step, ..if both { finer } else { *coarse } })?;
        if both {
            let ratio = half.element_ratio(&first);
            let differences = [half.distance(&first), half.distance_with_delays(&first)];
            if half.statistics.merge_loss <= LOSSLESS && ratio > MIN_RATIO && differences[1] <= ASYMPTOTIC {
                let order = order_in_space(self.start.rod.order());
                let estimate = ErrorEstimate::of_both(ratio, differences, order, self.initial_error(&half.plan));
                // If the elements are sufficient, only the steps may have to be shorter.
                let short_enough = estimate.space() <= (AIM_IN_SPACE + AIM_OF_MERGING) * tolerance;
                if short_enough || estimate.reported() <= tolerance {
                    return Ok((half, estimate));
                }
            }
        }
        let finer = self.run_over_delays(finer)?;
        // The run with the elements of `half` and twice its steps.
        let double = if both { &finer } else { &first };
        let steps = [half.distance(double), half.distance_with_delays(double)];
        let Refined { run, error: elements, errors } = self.refine_elements(first, finer)?;
        if elements.is_infinite() {
            // The next runs need as many elements.
            coarse.longest_element = run.plan.longest_element;
            return Ok((run, ErrorEstimate::of_half_steps([elements; 2], elements)));
        }
        let (run, merging) = self.refine_merging(run)?;
        let space = elements + merging + self.initial_error(&run.plan);
        let estimate = ErrorEstimate::of_half_steps(steps, space);
        let is_met = estimate.reported() <= tolerance;
        if run.plan.merge_tolerance == half.plan.merge_tolerance {
            let length = run.plan.longest_element;
            if is_met && length >= half.plan.longest_element {
                return Ok((half, estimate));
            }
            if !is_met && errors[usize::from(both)] <= NEGLIGIBLE * estimate.time() {
                // The next run has the elements of the result, and is compared with this one.
                half.plan.longest_element = length;
                return Ok((half, estimate));
            }
        }
        // The elements of the run with half the steps are too long to show the error of the steps.
        let half = self.run_over_delays(Plan { step: half.plan.step, ..run.plan })?;
        let steps = [half.distance(&run), half.distance_with_delays(&run)];
        Ok((half, ErrorEstimate::of_half_steps(steps, space)))
    }
}

/// Returns the step of the first run from `start` (s): the shortest delay or the slowest time constant, the longer of
/// both, within the bounds of [`FIRST_STEPS`], s. A step that is longer than a delay depends on itself, and is solved
/// by iteration.
fn first_step(laws: &Declaration, start: f64, until: f64) -> f64 {
    let span = (until - start).max(f64::MIN_POSITIVE);
    let constants = laws.variables().iter().map(|variable| variable.time_constant);
    let scales = constants.chain([laws.shortest_delay()]).filter(|time| time.is_finite());
    let scale = Some(scales.fold(0.0, f64::max)).filter(|scale| *scale > 0.0).unwrap_or(span);
    let [fewest, most] = FIRST_STEPS;
    scale.max(span / most).min(span / fewest).max(ROUNDING * until.abs())
}
