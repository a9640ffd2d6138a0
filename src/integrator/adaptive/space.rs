//! Refinement of the elements and of the merge tolerance, by runs with equal steps.

use super::division::LOSSLESS;
use super::richardson::{AIM_IN_SPACE, AIM_OF_MERGING, ASYMPTOTIC, Richardson, SAFETY, order_in_space};
use super::runs::{Run, Runs};
use crate::integrator::error::Outcome;
use crate::model::Model;
use crate::state::Plan;

/// Ratio of the longest element to that of the run before. It is slightly below
/// [`FIRST_LENGTH`](super::division::FIRST_LENGTH), so that every element of a run that has started already is divided.
pub(super) const SHORTER: f64 = 0.7;
/// The same at the start of a run: n elements are followed by n + 1, up to n = 4.
const SHORTER_AT_START: f64 = 0.8;
/// Smallest ratio of the element lengths of two runs for which their difference shows the error of the elements.
pub(super) const MIN_RATIO: f64 = 1.15;
/// Largest number of refinements of the elements and of the merge tolerance. The elements are then shorter by a factor
/// of 0.8¹³ = 1/18.
const MAX_REFINEMENTS: usize = 13;
/// Ratio of the merge tolerance of the run that shows the error of merging to the smallest one that permits the
/// mergers of the run before.
const FINER_MERGING: f64 = 0.25;

/// A run with elements that are short enough.
pub(super) struct Refined {
    pub run: Run,
    /// Error of its elements, relative to the length; infinite if the steps are too long to show it.
    pub error: f64,
    /// Bounds of the errors of the elements in the two given runs.
    pub errors: [f64; 2],
}

impl<M: Model> Runs<'_, M> {
    /// Returns the longest element of a run with shorter elements than one before, m.
    pub fn next_length(&self, longest: f64) -> f64 {
        longest * if self.has_started() { SHORTER } else { SHORTER_AT_START }
    }

    /// Refines the elements at constant steps until their error is small enough, beginning with two runs.
    pub fn refine_elements(&mut self, coarse: Run, fine: Run) -> Outcome<Refined> {
        let order = order_in_space(self.start.rod.order());
        // Merged tissue and tissue with a history are often not smooth.
        let smooth = !self.has_started() && fine.statistics.merge_loss <= LOSSLESS;
        let mut estimate = if smooth { Richardson::in_smooth_space(order) } else { Richardson::in_space(order) };
        let enough = AIM_IN_SPACE * self.integrator.tolerance;
        let (mut compared, mut run) = (coarse, fine);
        let (mut error, mut errors) = (f64::INFINITY, [f64::INFINITY; 2]);
        // Run and error estimate before the first difference that did not decrease. The difference before may have been
        // small by chance.
        let mut irregular = None;
        for refinement in 0..MAX_REFINEMENTS {
            let (ratio, difference) = (run.element_ratio(&compared), run.distance_with_delays(&compared));
            let differ = !(1.0 / MIN_RATIO..MIN_RATIO).contains(&ratio);
            // The error of the longer elements; that of the shorter ones is smaller.
            let coarser_error = estimate.error_of_coarser(ratio.max(ratio.recip()), difference);
            if refinement < 2 && differ {
                errors[refinement..].fill(coarser_error);
            }
            if coarser_error <= enough && differ {
                let run = if ratio > 1.0 { compared } else { run };
                return Ok(Refined { run, error: coarser_error, errors });
            }
            let plan = run.plan;
            let mut longest_element = self.next_length(plan.longest_element);
            if ratio >= MIN_RATIO {
                let finer_error = estimate.error(ratio, difference);
                let converges = estimate.converges();
                if !converges && let Some((run, error)) = irregular {
                    // The remaining difference is due to the steps.
                    let sufficient = SAFETY * error <= self.integrator.tolerance;
                    let unknown = Refined { run: compared, error: f64::INFINITY, errors: [f64::INFINITY; 2] };
                    return Ok(if sufficient { Refined { run, error, errors } } else { unknown });
                }
                if difference <= ASYMPTOTIC && finer_error <= enough {
                    errors[1] = if refinement == 0 { finer_error } else { errors[1] };
                    return Ok(Refined { run, error: finer_error, errors });
                }
                let before = std::mem::replace(&mut compared, run);
                if !converges {
                    irregular = Some((before, error));
                    estimate = Richardson::in_space(order);
                }
                // The observed order does not hold for refinements by more than two.
                let shortest = 0.5 * plan.longest_element;
                longest_element = if difference > ASYMPTOTIC {
                    shortest
                } else {
                    error = finer_error;
                    (plan.longest_element / estimate.refinement(error / enough)).clamp(shortest, longest_element)
                };
            }
            run = self.run_over_delays(Plan { longest_element, ..plan })?;
        }
        if SAFETY * error <= self.integrator.tolerance {
            return Ok(Refined { run, error, errors });
        }
        Err(self.not_met(SAFETY * error))
    }

    /// Reduces the merge tolerance until the error of merging is small enough. Returns the run, and this error, which
    /// is estimated by a run that merges less.
    pub fn refine_merging(&mut self, mut run: Run) -> Outcome<(Run, f64)> {
        let mut error = 0.0;
        for _ in 0..MAX_REFINEMENTS {
            let needed = run.statistics.merge_loss;
            if needed <= LOSSLESS {
                return Ok((run, 0.0));
            }
            let finer = self.run_over_delays(Plan { merge_tolerance: FINER_MERGING * needed, ..run.plan })?;
            error = finer.distance_with_delays(&run) / (1.0 - FINER_MERGING);
            if error <= AIM_OF_MERGING * self.integrator.tolerance {
                break;
            }
            run = finer;
        }
        Ok((run, error))
    }
}
