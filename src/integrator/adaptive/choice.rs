//! Choice of elements, merge tolerance and steps by runs, in the order of
//! [`guide::accuracy`](crate::guide::accuracy). The main loop is in `Runs::choose`.

use std::rc::Rc;

use super::division::first_length;
use super::richardson::{
    AIM_IN_SPACE, AIM_OF_MERGING, ASYMPTOTIC, ErrorEstimate, ORDER_IN_CONTACT, order_in_space,
};
use super::runs::{Runs, TrialRun};
use super::space::{MIN_RATIO, SHORTER};
use crate::equilibrium::EquilibriumError;
use crate::integrator::error::Outcome;
use crate::integrator::{IntegrationError, MAX_HALVINGS, ORDER, ROUNDING, Statistics};
use crate::model::{Load, Model};
use crate::rod::LARGEST_INSIDE;
use crate::state::Plan;
use crate::tropism::Declaration;

/// Ratio of the error of the elements to that of the steps below which two runs with different
/// elements show the error of the steps. The neglected part is below the safety factor.
const NEGLIGIBLE: f64 = 0.2;
/// Largest number of refinements after failures: the elements are then shorter by 0.7¹³ = 1/100.
const MAX_FAILURES: usize = 13;
/// Smallest and largest number of steps of the first run, not counting short steps after
/// discontinuities.
const FIRST_STEPS: [f64; 2] = [8.0, 1000.0];

/// Result of the comparisons at one length of the steps.
struct Compared {
    run: Rc<TrialRun>,
    /// Plan of the next run, except for its steps: the elements and the merge tolerance that are
    /// sufficient.
    plan: Plan,
    estimate: ErrorEstimate,
}

impl<M: Model> Runs<'_, M> {
    /// Chooses a plan for the time to `until` and integrates by it, by at most `max_steps` steps.
    /// Returns the plan and the statistics of the call.
    pub(super) fn choose(mut self, until: f64, max_steps: usize) -> Outcome<(Plan, Statistics)> {
        // The result of a call that stops before `until` cannot be compared with another run.
        let extrapolated = max_steps < usize::MAX;
        let tolerance = self.integrator.tolerance;
        // Runs 1 to 4 of the guide.
        let Compared {
            mut run,
            plan,
            mut estimate,
        } = self.first_runs(until)?;
        // Run 5: shorter steps by the observed order, until the estimate is below the tolerance.
        loop {
            let equilibria = run.error_of_equilibria();
            let (reached, left) = (estimate.reported() + equilibria, tolerance - equilibria);
            if reached <= tolerance && !extrapolated {
                return Ok(self.accept(&run, estimate.reported()));
            }
            if estimate.left_for_steps(left) <= 0.0 {
                return Err(self.not_met(reached));
            }
            let (ratio, is_last) = estimate.next_refinement(left, extrapolated);
            let plan = Plan {
                step: run.plan.step / ratio,
                ..plan
            };
            if is_last {
                let last = self.run_at_most(plan, max_steps, reached)?;
                estimate.space += (last.hidden - run.hidden).max(0.0);
                return Ok(self.accept(&last, estimate.extrapolated(ratio)));
            }
            let finer = Rc::new(self.run(plan, reached)?);
            estimate = estimate.refined(ratio, finer.differences(&run)[0]);
            estimate.space += (finer.hidden - run.hidden).max(0.0);
            run = finer;
        }
    }

    /// Makes runs with long steps and increasing numbers of elements, and one with steps of half
    /// the length. Refines steps and elements until these runs succeed and show an order of
    /// convergence.
    fn first_runs(&mut self, until: f64) -> Outcome<Compared> {
        let mut coarse = self.first_plan(until);
        let (mut failure, mut too_fast, mut failures, mut reached) = (None, None, 0, f64::INFINITY);
        for _ in 0..MAX_HALVINGS {
            match self.compare(&mut coarse) {
                Ok(compared) if compared.estimate.is_asymptotic() => return Ok(compared),
                Ok(Compared { estimate, .. }) => {
                    (failure, too_fast, reached) = (None, None, estimate.reported())
                }
                Err(error @ IntegrationError::GrowsTooFast { .. }) => too_fast = Some(error),
                Err(error) if error.is_recoverable() => {
                    // Shorter elements can prevent only these failures.
                    if let IntegrationError::Equilibrium { time, .. }
                    | IntegrationError::Uneven { time, .. } = error
                    {
                        // The mesh of the first equilibrium was refined after failures.
                        let at_start = time == self.start.time && !self.has_started();
                        if at_start || failures >= MAX_FAILURES {
                            return Err(error);
                        }
                        failures += 1;
                        coarse.longest_element *= SHORTER;
                    }
                    let is_folded = matches!(
                        error,
                        IntegrationError::Equilibrium {
                            error: EquilibriumError::Folded { .. },
                            ..
                        }
                    );
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
                // The limit of work may be reached, or the steps diverge, because of an earlier
                // failure. Its message is more useful.
                Err(
                    error @ (IntegrationError::ToleranceNotMet { .. }
                    | IntegrationError::NotSlender { .. }),
                ) => {
                    return Err(failure.unwrap_or(error));
                }
                Err(error) => return Err(error),
            }
            coarse.step *= 0.5;
            // Earlier runs are not compared with later ones, so that the coarsest step changes.
            coarse.coarsest_step = coarse.step;
        }
        Err(failure
            .or(too_fast)
            .unwrap_or_else(|| self.not_met(reached)))
    }

    /// Returns the plan of the first run: one element in the growth zone, or with a support those of
    /// the shoot, and the first step.
    fn first_plan(&self, until: f64) -> Plan {
        // The elements of a run that has started are kept.
        let longest_element = if self.has_started() {
            self.longest_at_start()
        } else {
            first_length(self.shoot, 1.0)
        };
        // A load is evaluated at the ends of steps. If they are multiples of its period, they and
        // their halves have one phase.
        let period = self.shoot.model().load().shortest_period(self.start.time);
        let step = first_step(&self.laws, self.start.time, until).min(0.5 * period);
        let tolerance = self.integrator.tolerance;
        // A merger may lose up to twenty times this angle (rad). Where a bend begins in an element
        // of relative length h, that moves the centre line by up to 4 h times the merge tolerance.
        let merge_tolerance = tolerance.min(LARGEST_INSIDE);
        // `accept` sets the error.
        Plan {
            tolerance,
            until,
            step,
            coarsest_step: step,
            longest_element,
            merge_tolerance,
            error: 1.0,
        }
    }

    /// Estimates the errors of elements, of merging and of steps by runs with the steps of `coarse`
    /// and a run with steps of half the length. The longest element of `coarse` becomes that of its
    /// run.
    fn compare(&mut self, coarse: &mut Plan) -> Outcome<Compared> {
        // Run 1.
        let first = self.run_over_delays(*coarse)?;
        *coarse = first.plan;
        // Run 2: steps of half the length and shorter elements at once, which suffices for a large
        // tolerance. The elements of a shoot that has started already are sufficient for such a
        // tolerance.
        let shorter = Plan {
            longest_element: self.next_length(coarse.longest_element),
            ..*coarse
        };
        let elements = if self.has_started() { *coarse } else { shorter };
        let half = self.run_over_delays(Plan {
            step: 0.5 * coarse.step,
            ..elements
        })?;
        if let Some(estimate) = self.error_of_both(&half, &first) {
            return Ok(Compared {
                plan: half.plan,
                run: half,
                estimate,
            });
        }
        // Runs 3 with the same steps and shorter elements. `double` has the elements of run 2 and
        // steps of twice the length: their difference is the error of the steps.
        let finer = self.run_over_delays(shorter)?;
        let double = Rc::clone(if self.has_started() { &first } else { &finer });
        let (run, error) = self.refine_elements([first, finer])?;
        if error.is_infinite() {
            // An infinite estimate makes the caller halve the steps. The next runs need as many
            // elements.
            coarse.longest_element = run.plan.longest_element;
            let estimate = ErrorEstimate::of_halved_steps([error; 2], ORDER as f64, error);
            return Ok(Compared {
                plan: run.plan,
                run,
                estimate,
            });
        }
        // A bound of the error of the elements of run 2, also relative to `run`.
        let space_of_half = error + run.differences(&double)[1];
        // Runs 4.
        let (run, merging) = self.refine_merging(run)?;
        let space = error + merging + run.hidden + run.initial;
        let estimate = error_of_steps(&half, &double, space);
        let (plan, is_met) = (run.plan, estimate.reported() <= self.integrator.tolerance);
        if plan.merge_tolerance == half.plan.merge_tolerance {
            if is_met
                && half.hidden <= run.hidden
                && plan.longest_element >= half.plan.longest_element
            {
                return Ok(Compared {
                    plan: half.plan,
                    run: half,
                    estimate,
                });
            }
            // If it is negligible, the difference between run 2 and the next run shows the error of
            // the steps, although their elements differ.
            if !is_met && space_of_half <= NEGLIGIBLE * estimate.time() {
                return Ok(Compared {
                    plan,
                    run: half,
                    estimate,
                });
            }
        }
        let half = self.run_over_delays(Plan {
            step: half.plan.step,
            ..plan
        })?;
        let estimate = error_of_steps(&half, &run, space);
        Ok(Compared {
            plan,
            run: half,
            estimate,
        })
    }

    /// Returns the error of a run with steps of half the length and shorter elements than the run
    /// `first`, if this error is small or if the elements are short enough. At most the steps
    /// remain to be refined then.
    fn error_of_both(&self, half: &TrialRun, first: &TrialRun) -> Option<ErrorEstimate> {
        let (ratio, differences) = (half.element_ratio(first), half.differences(first));
        if !self.is_smooth(half) || differences[1] > ASYMPTOTIC || ratio <= MIN_RATIO {
            return None;
        }
        let orders = [order_in_time(half), order_in_space(self.start.rod.order())];
        let estimate =
            ErrorEstimate::of_both(ratio, differences, orders, half.hidden + half.initial);
        let tolerance = self.integrator.tolerance;
        let short_enough = estimate.space <= (AIM_IN_SPACE + AIM_OF_MERGING) * tolerance;
        (short_enough || estimate.reported() <= tolerance).then_some(estimate)
    }
}

/// Returns the error of a run from its difference from a run with the same elements and steps of
/// twice the length. `space` is the error of the elements that the next run has.
fn error_of_steps(half: &TrialRun, double: &TrialRun, space: f64) -> ErrorEstimate {
    ErrorEstimate::of_halved_steps(half.differences(double), order_in_time(half), space)
}

/// Returns the order that the steps of a run are assumed to have before it is observed.
fn order_in_time(run: &TrialRun) -> f64 {
    if run.track.has_contact() {
        ORDER_IN_CONTACT
    } else {
        ORDER as f64
    }
}

/// Returns the step of the first run from `start` (s): the longer of the shortest delay and the
/// slowest time constant, within the bounds of [`FIRST_STEPS`], s. A step that is longer than a
/// delay depends on itself, and is solved by iteration.
fn first_step(laws: &Declaration, start: f64, until: f64) -> f64 {
    let span = (until - start).max(f64::MIN_POSITIVE);
    let constants = laws
        .variables()
        .iter()
        .map(|variable| variable.time_constant);
    let scales = constants
        .chain([laws.shortest_delay()])
        .filter(|time| time.is_finite());
    let scale = Some(scales.fold(0.0, f64::max))
        .filter(|scale| *scale > 0.0)
        .unwrap_or(span);
    let [fewest, most] = FIRST_STEPS;
    scale
        .max(span / most)
        .min(span / fewest)
        .max(ROUNDING * until.abs())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::constitutive::LinearElastic;
    use crate::growth::UniformGrowth;
    use crate::integrator::Adaptive;
    use crate::shoot::Shoot;
    use crate::tropism::{Gravitropism, Memory, Proprioception, Response, SettledStatoliths};
    use crate::{Still, load::Weight};

    /// A horizontal shoot bends upwards from the start, and its tissue leaves the growth zone. The
    /// call ends before the tissue is bent, and the run goes on over a delay of an hour.
    #[test]
    fn losses_of_mergers_after_the_call_count() {
        let memory = |delay: f64| Memory { time: 720.0, delay };
        let laws = (
            Gravitropism {
                sensitivity: 0.8,
                perception: SettledStatoliths,
            }
            .remembered(memory(0.0)),
            Proprioception { sensitivity: 1.0 }.remembered(memory(3600.0)),
        );
        let shoot = Shoot::builder(LinearElastic {
            youngs_modulus: 1e7,
            poissons_ratio: 0.5,
        })
        .length(0.05)
        .radius(5e-4)
        .growth(UniformGrowth {
            zone_length: 0.04,
            time: 72e3,
        })
        .tropism(laws)
        .load(Weight { density: 1000.0 })
        .scene(Still::tilted(FRAC_PI_2));
        let mut shoot = shoot.build().unwrap();
        let (start, mut integrator) = (shoot.state.clone(), Adaptive::new(1e-3));
        let mut runs = Runs::new(&mut integrator, &mut shoot, &start);
        let plan = runs.first_plan(60.0);
        let alone = runs.run(plan, f64::INFINITY).unwrap().statistics.merge_loss;
        let with_delays = runs.run_over_delays(plan).unwrap().statistics.merge_loss;
        assert!(with_delays > 2.0 * alone, "{alone:e}, {with_delays:e}");
    }
}
