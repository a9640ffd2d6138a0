//! Refinement of the elements and of the merge tolerance, by runs with equal steps.

use std::rc::Rc;

use super::division::{LOSSLESS, MOST_ELEMENTS};
use super::richardson::{
    AIM_IN_SPACE, AIM_OF_MERGING, ASYMPTOTIC, ROUGH, Richardson, SAFETY, order_before_observation,
    order_in_space,
};
use super::runs::{Runs, TrialRun};
use crate::integrator::error::Outcome;
use crate::model::Model;
use crate::state::Plan;

/// Ratio of the longest element to that of the run before. It is slightly below
/// [`FIRST_LENGTH`](super::division::FIRST_LENGTH), so that the elements of a shoot of constant
/// length are divided.
pub(super) const SHORTER: f64 = 0.7;
/// The ratio at the start of a run: n elements are followed by n + 1, up to n = 4.
const SHORTER_AT_START: f64 = 0.8;
/// Smallest ratio of the element lengths of two runs for which their difference shows the error of
/// the elements.
pub(super) const MIN_RATIO: f64 = 1.15;
/// Largest number of refinements of the elements and of the merge tolerance. The elements are then
/// shorter at least by a factor of 0.8¹³ = 1/18.
const MAX_REFINEMENTS: usize = 13;
/// Factor by which a run reduces the loss of mergers of the run before.
const FINER_MERGING: f64 = 0.25;

impl<M: Model> Runs<'_, M> {
    /// Returns the longest element of a run with shorter elements than one before, m.
    pub fn next_length(&self, longest: f64) -> f64 {
        longest
            * if self.has_started() {
                SHORTER
            } else {
                SHORTER_AT_START
            }
    }

    /// Refines the elements at constant steps, beginning with two runs, until the error of the
    /// coarser or of the finer of two successive runs is small enough, or until the difference no
    /// longer decreases. In the last case the steps are too long to show the error of the elements.
    /// Returns the run with sufficient elements, and the error of its elements relative to the
    /// length, which is infinite if it is not shown.
    pub fn refine_elements(
        &mut self,
        [mut compared, mut run]: [Rc<TrialRun>; 2],
    ) -> Outcome<(Rc<TrialRun>, f64)> {
        let order = order_in_space(self.start.rod.order());
        let smooth = [order_before_observation(order), order];
        let [assumed, largest] = if self.is_smooth(&run) { smooth } else { ROUGH };
        let mut estimate = Richardson::assuming(assumed, largest);
        let (enough, tolerance) = (
            AIM_IN_SPACE * self.integrator.tolerance,
            self.integrator.tolerance,
        );
        // The sum of these two errors is limited, too, so that a part of the tolerance is left for
        // the steps.
        let both = enough + AIM_OF_MERGING * tolerance;
        let is_sufficient = |error: f64, hidden: f64| error <= enough && error + hidden <= both;
        let mut error = f64::INFINITY;
        // The run before the first difference that did not decrease, and its error. The difference
        // before may have been small by chance.
        let mut regular: Option<(Rc<TrialRun>, f64)> = None;
        for _ in 0..MAX_REFINEMENTS {
            let (ratio, difference) = (run.element_ratio(&compared), run.differences(&compared)[1]);
            let differ = !(1.0 / MIN_RATIO..MIN_RATIO).contains(&ratio);
            let coarser_error = estimate.error_of_coarser(ratio.max(ratio.recip()), difference);
            let coarser = if ratio > 1.0 { &compared } else { &run };
            if differ && is_sufficient(coarser_error, coarser.hidden) {
                return Ok((Rc::clone(coarser), coarser_error));
            }
            let (plan, hidden) = (run.plan, run.hidden);
            if SAFETY * hidden > tolerance && run.growing_elements() > MOST_ELEMENTS {
                return Err(self.not_met(SAFETY * hidden));
            }
            let mut longest_element = self.next_length(plan.longest_element);
            if ratio >= MIN_RATIO {
                let finer_error = estimate.error(ratio, difference);
                if !estimate.converges
                    && let Some((regular, error)) = regular.take_if(|(run, _)| run.hidden <= enough)
                {
                    // The remaining difference is due to the steps.
                    let sufficient = SAFETY * (error + regular.hidden) <= tolerance;
                    return Ok(if sufficient {
                        (regular, error)
                    } else {
                        (compared, f64::INFINITY)
                    });
                }
                if difference <= ASYMPTOTIC && is_sufficient(finer_error, hidden) {
                    return Ok((run, finer_error));
                }
                let before = std::mem::replace(&mut compared, run);
                if !estimate.converges {
                    regular = Some((before, error));
                    estimate = Richardson::assuming(ROUGH[0], ROUGH[1]);
                }
                // The observed order does not hold for refinements by more than two.
                let shortest = 0.5 * plan.longest_element;
                if difference <= ASYMPTOTIC {
                    error = finer_error;
                }
                longest_element = if difference <= ASYMPTOTIC && hidden <= enough {
                    (plan.longest_element / estimate.refinement(error / enough))
                        .clamp(shortest, longest_element)
                } else {
                    shortest
                };
            }
            run = self.run_over_delays(Plan {
                longest_element,
                ..plan
            })?;
        }
        if SAFETY * error <= tolerance {
            Ok((run, error))
        } else {
            Err(self.not_met(SAFETY * error))
        }
    }

    /// Reduces the merge tolerance until the error of merging is small enough. Returns the run, and
    /// this error, which is estimated by a run that merges less.
    pub fn refine_merging(&mut self, mut run: Rc<TrialRun>) -> Outcome<(Rc<TrialRun>, f64)> {
        let mut error = 0.0;
        for _ in 0..MAX_REFINEMENTS {
            let needed = run.statistics.merge_loss;
            if needed <= LOSSLESS {
                return Ok((run, 0.0));
            }
            let finer = self.run_over_delays(Plan {
                merge_tolerance: FINER_MERGING * needed,
                ..run.plan
            })?;
            // The error is assumed to be proportional to the loss.
            error = finer.differences(&run)[1] / (1.0 - FINER_MERGING);
            if error <= AIM_OF_MERGING * self.integrator.tolerance {
                break;
            }
            run = finer;
        }
        Ok((run, error))
    }
}
