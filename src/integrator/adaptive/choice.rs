//! Choice of elements, merge tolerance and steps by trial runs, in the order of
//! [`guide::accuracy`](crate::guide::accuracy). The main loop is in `Trials::choose`.

use super::elements::{FIRST_LENGTH, LOSSLESS, longest_element, size};
use super::richardson::{AIM_IN_SPACE, AIM_OF_MERGING, ASYMPTOTIC, ErrorEstimate, Richardson, SAFETY};
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
/// The same at the start of a run: n elements are followed by n + 1, up to n = 4.
const SHORTER_AT_START: f64 = 0.8;
/// Ratio of the error of the elements to that of the steps below which two runs with different elements show the error
/// of the steps. The safety factor covers it.
const NEGLIGIBLE: f64 = 0.2;
/// Smallest ratio of the element lengths of two runs for which their difference shows the error of the elements.
const MIN_RATIO: f64 = 1.15;
/// Largest number of refinements of the elements, of the merge tolerance, and after failures. The elements are
/// then shorter by a factor of 0.8¹³ = 1/18, and after failures by 0.7¹³ = 1/100.
const MAX_REFINEMENTS: usize = 13;
/// Largest number of refinements after failures at the start of a run, where the mesh of the equilibrium was
/// refined before: six elements.
const MAX_REFINEMENTS_AT_START: usize = 5;
/// Ratio of the merge tolerance of the run that shows the error of merging to the smallest one that permits the
/// mergers of the run before.
const FINER_MERGING: f64 = 0.25;
/// Smallest and largest number of steps of the first trial run, not counting short steps after discontinuities.
const FIRST_STEPS: [f64; 2] = [8.0, 1000.0];

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
                let statistics = self.run_uncompared(&mut plan, max_steps)?;
                return Ok((plan, statistics));
            }
            self.run(&mut plan, estimate.reported())?;
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
            match self.compare(&mut coarse) {
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

    /// Returns the resolution of the first run: one element in the growth zone, and steps as long as the shortest
    /// delay.
    fn first_plan(&mut self, until: f64) -> Plan {
        let longest_element = if self.has_started() {
            // The elements of a run that has started are kept.
            let kept = self.start.plan().map(|plan| plan.longest_element);
            kept.unwrap_or_else(|| longest_element(self.start) / FIRST_LENGTH)
        } else {
            size(self.shoot) / FIRST_LENGTH
        };
        let step = first_step(self.shoot, until);
        let tolerance = self.integrator.tolerance;
        // A merger may lose up to twenty times this angle (rad). Where a bend begins in an element of relative length
        // h, that moves the centre line by up to 4 h times the merge tolerance.
        let merge_tolerance = tolerance.min(LARGEST_INSIDE);
        let (reached, error) = (self.start.time, 1.0);
        Plan { tolerance, until, step, coarsest_step: step, longest_element, merge_tolerance, reached, error }
    }

    /// Estimates the errors of elements, of merging and of steps by runs with the steps of `coarse` and a run with half
    /// of them.
    fn compare(&mut self, coarse: &mut Plan) -> Outcome<(Plan, ErrorEstimate)> {
        self.discard_kept();
        self.run(coarse, f64::INFINITY)?;
        let mut finer = Plan { longest_element: self.shorter(coarse.longest_element), ..*coarse };
        // Half the steps and shorter elements at once: for a large tolerance this run suffices. The elements of a run
        // that has started already are sufficient for such a tolerance.
        let both = !self.has_started();
        let mut halved = Plan { step: 0.5 * coarse.step, ..if both { finer } else { *coarse } };
        self.run(&mut halved, f64::INFINITY)?;
        let (ratio, difference) = (self.element_ratio(), self.difference());
        if both && self.last.merge_loss <= LOSSLESS && ratio > MIN_RATIO && difference <= ASYMPTOTIC {
            let order = order_in_space(self.start.rod.order());
            let estimate = ErrorEstimate::of_both(ratio, difference, order, self.initial_error(&halved));
            let tolerance = self.integrator.tolerance;
            // If the elements are sufficient, only the steps may have to be shorter.
            let short_enough = estimate.space() <= (AIM_IN_SPACE + AIM_OF_MERGING) * tolerance;
            if short_enough || estimate.reported() <= tolerance {
                return Ok((halved, estimate));
            }
        }
        self.keep();
        self.run(&mut finer, f64::INFINITY)?;
        let (steps, first) = (if both { self.difference_of_kept() } else { difference }, self.difference());
        let (mut plan, elements, second) = self.refine_elements(coarse.longest_element, finer)?;
        let kept = if both { second } else { first };
        if elements.is_infinite() {
            self.discard_kept();
            // The next runs need as many elements.
            coarse.longest_element = plan.longest_element;
            return Ok((plan, ErrorEstimate::of_half_steps(elements, elements)));
        }
        let merging = self.refine_merging(&mut plan)?;
        let space = elements + merging + self.initial_error(&plan);
        let estimate = ErrorEstimate::of_half_steps(steps, space);
        let is_met = estimate.reported() <= self.integrator.tolerance;
        if plan.merge_tolerance == halved.merge_tolerance {
            if is_met && plan.longest_element >= halved.longest_element {
                self.return_to_kept();
                return Ok((halved, estimate));
            }
            if !is_met && kept <= NEGLIGIBLE * estimate.time() {
                self.return_to_kept();
                return Ok((Plan { step: halved.step, ..plan }, estimate));
            }
        }
        // The elements of the kept run are too long to show the error of the steps.
        self.discard_kept();
        plan.step = halved.step;
        self.run(&mut plan, f64::INFINITY)?;
        Ok((plan, ErrorEstimate::of_half_steps(self.difference(), space)))
    }

    /// Returns the longest element of a run with shorter elements than one before, m.
    fn shorter(&self, longest: f64) -> f64 {
        longest * if self.has_started() { SHORTER } else { SHORTER_AT_START }
    }

    /// Refines the elements at constant steps until their error is small enough. The last run is that of `plan`, and
    /// the run before has the longest element `compared`. Returns the resolution, its error, and that of the given
    /// `plan`. The errors are infinite if the steps are too long to show them.
    fn refine_elements(&mut self, mut compared: f64, mut plan: Plan) -> Outcome<(Plan, f64, f64)> {
        let order = order_in_space(self.start.rod.order());
        // Merged tissue and tissue with a history are often not smooth.
        let smooth = !self.has_started() && self.last.merge_loss <= LOSSLESS;
        let mut estimate = if smooth { Richardson::in_smooth_space(order) } else { Richardson::in_space(order) };
        let enough = AIM_IN_SPACE * self.integrator.tolerance;
        let (mut error, mut of_given) = (f64::INFINITY, f64::INFINITY);
        // Length of the longest element and error estimate before the first difference that did not decrease. The
        // difference before may have been small by chance.
        let mut irregular = None;
        for refinement in 0..MAX_REFINEMENTS {
            let (ratio, difference) = (self.element_ratio(), self.difference());
            let differ = !(1.0 / MIN_RATIO..MIN_RATIO).contains(&ratio);
            // The first difference is above the error of the given elements, and the second one is near it.
            if refinement < 2 && differ {
                of_given = difference;
            }
            if difference <= enough && differ {
                // The longer elements are sufficient.
                if ratio > 1.0 {
                    self.keep_earlier();
                    plan.longest_element = compared;
                }
                return Ok((plan, difference, of_given));
            }
            let mut shorter = self.shorter(plan.longest_element);
            if ratio < MIN_RATIO {
                self.keep_earlier();
            } else {
                let next_error = estimate.error(ratio, difference);
                if !estimate.converges() {
                    if let Some((longest_element, error)) = irregular {
                        // The remaining difference is due to the steps.
                        if SAFETY * error > self.integrator.tolerance {
                            return Ok((Plan { longest_element: compared, ..plan }, f64::INFINITY, f64::INFINITY));
                        }
                        self.keep_earlier();
                        return Ok((Plan { longest_element, ..plan }, error, of_given));
                    }
                    irregular = Some((compared, error));
                    estimate = Richardson::in_space(order);
                }
                compared = plan.longest_element;
                if difference > ASYMPTOTIC {
                    shorter = 0.5 * plan.longest_element;
                } else {
                    error = next_error;
                    if error <= enough {
                        if refinement == 0 {
                            of_given = error;
                        }
                        return Ok((plan, error, of_given));
                    }
                    // The observed order does not hold for refinements by more than two.
                    let needed = plan.longest_element / estimate.refinement(error / enough);
                    shorter = needed.clamp(0.5 * plan.longest_element, shorter);
                }
            }
            plan.longest_element = shorter;
            self.run(&mut plan, f64::INFINITY)?;
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
            let mut finer = Plan { merge_tolerance: FINER_MERGING * needed, ..*plan };
            self.run(&mut finer, f64::INFINITY)?;
            error = self.difference() / (1.0 - FINER_MERGING);
            if error <= AIM_OF_MERGING * self.integrator.tolerance {
                // The run with half the steps has the same merge tolerance as the earlier run.
                self.keep_earlier();
                break;
            }
            *plan = finer;
        }
        Ok(error)
    }
}

/// Order in space. Positions have order 2 p, and the stimuli at a material point have order p + 2.
fn order_in_space(order: Order) -> f64 {
    let p = order.points() as f64;
    (2.0 * p).min(p + 2.0)
}

/// Returns the step of the first run: the shortest delay or the slowest time constant, the longer of both, within the
/// bounds of [`FIRST_STEPS`], s. A step that is longer than a delay depends on itself, and is solved by iteration.
fn first_step(shoot: &Shoot<impl Model>, until: f64) -> f64 {
    let span = (until - shoot.time()).max(f64::MIN_POSITIVE);
    let mut laws = Declaration::default();
    laws.read(shoot.model.tropism());
    let constants = laws.variables().iter().map(|variable| variable.time_constant);
    let scales = constants.chain([laws.shortest_delay()]).filter(|time| time.is_finite());
    let scale = Some(scales.fold(0.0, f64::max)).filter(|scale| *scale > 0.0).unwrap_or(span);
    let [fewest, most] = FIRST_STEPS;
    scale.max(span / most).min(span / fewest).max(ROUNDING * until.abs())
}
