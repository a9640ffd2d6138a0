//! Error estimates from the differences of runs (Richardson extrapolation), and the ratio of the
//! next refinement.

use crate::integrator::ORDER;
use crate::reference_element::Order;

/// Safety factor on reported error estimates, and on the expected difference of two runs.
pub(super) const SAFETY: f64 = 2.0;
/// Largest errors of elements and of merging, relative to the tolerance. With the strain between
/// the material points, the initial equilibrium and the safety factor they take up to 0.9 of the
/// tolerance, and far less on average, since the number of elements is an integer and merging is
/// nearly exact.
pub(super) const AIM_IN_SPACE: f64 = 0.2;
pub(super) const AIM_OF_MERGING: f64 = 0.1;
/// Target error in time, relative to the tolerance minus the error in space. A run whose error is
/// twice as large as expected is not repeated. The reserve costs a fifth more steps, and a further
/// run costs more than twice as many.
const AIM_IN_TIME: f64 = 0.5;
/// Largest difference of two runs, relative to the length, that shows an order of convergence.
pub(super) const ASYMPTOTIC: f64 = 0.02;
/// Largest refinement of the steps between two runs that are compared. It changes the error by 8⁴ =
/// 4096. The observed order does not hold over a larger range.
const MAX_REFINEMENT: f64 = 8.0;
/// Smallest refinement. The difference of two nearly equal runs does not show their errors.
const MIN_REFINEMENT: f64 = 1.25;
/// Smallest order, except that of steps in contact. Kinks reduce the order in time to three, and
/// runs that are not resolved show no order.
const MIN_ORDER: f64 = 2.0;
/// Largest assumed order of the steps before an order is observed, and largest order of the error
/// after the call.
const UNOBSERVED: f64 = 3.0;
/// Assumed order of steps in contact with an obstacle before an order is observed. Friction depends
/// on the path, and a law of touch may act like a switch at a time inside a step. Without both the
/// order is higher, and the next run shows it.
pub(super) const ORDER_IN_CONTACT: f64 = 1.0;
/// Orders of the elements of tissue that may not be smooth, or whose differences have not
/// decreased: the assumed one before an order is observed, and the largest one. The differences of
/// runs with few elements change irregularly. With the orders 3 and 6 the shoots of the test
/// `error_of_few_elements_is_not_underestimated` have errors of 1.2 to 3.9 times the tolerance.
pub(super) const ROUGH: [f64; 2] = [2.0, 3.0];
/// Number of bisections for the observed order. Their accuracy is 2e-6.
const BISECTIONS: usize = 20;

/// Returns the order in space. Positions have order 2 p, and the stimuli at a material point have
/// order p + 2.
pub(super) fn order_in_space(order: Order) -> f64 {
    let p = order.points() as f64;
    (2.0 * p).min(p + 2.0)
}

/// Returns the assumed order in space of a shoot whose tissue is likely to be smooth, before an
/// order is observed: one less than the order of the elements.
pub(super) fn order_before_observation(order_in_space: f64) -> f64 {
    (order_in_space - 1.0).max(MIN_ORDER)
}

/// Error estimate of a sequence of runs with increasing resolution in time or in space, and their
/// observed order of convergence.
#[derive(Debug, Clone, Copy)]
pub(super) struct Richardson {
    /// Smallest and largest order.
    orders: [f64; 2],
    /// Ratio of the last refinement, and the difference of its two runs.
    last: Option<(f64, f64)>,
    /// Observed order, or the assumed one.
    order: f64,
    /// Whether the differences decrease about as fast as the smallest order requires, or faster.
    pub converges: bool,
    /// Whether the order is that of two differences.
    is_observed: bool,
}

impl Richardson {
    /// An estimate for a method of order `max_order`. Before an order is observed the order
    /// `assumed` is used if it is lower.
    pub fn assuming(assumed: f64, max_order: f64) -> Self {
        let order = assumed.min(max_order);
        Self {
            orders: [order.min(MIN_ORDER), max_order],
            last: None,
            order,
            converges: true,
            is_observed: false,
        }
    }

    /// Returns the ratio of the next refinement for an error `gain` times smaller. The largest
    /// order underestimates it: a further run costs less than elements that are too short.
    pub fn refinement(&self, gain: f64) -> f64 {
        gain.powf(1.0 / self.orders[1])
    }

    /// Returns the error of the coarser one of two runs with a difference, by the present order.
    pub fn error_of_coarser(&self, ratio: f64, difference: f64) -> f64 {
        difference / (1.0 - ratio.powf(-self.order))
    }

    /// Returns the error of a run that is refined by `ratio` and differs from the run before by
    /// `difference`.
    pub fn error(&mut self, ratio: f64, difference: f64) -> f64 {
        if let Some((before, larger)) = self.last.replace((ratio, difference)) {
            // For an error e = c h^q the differences between h a, h and h / b have the quotient
            // (a^q − 1)/(1 − b^−q), which increases with q.
            let quotient = |q: f64| (before.powf(q) - 1.0) / (1.0 - ratio.powf(-q));
            self.is_observed = true;
            self.converges = quotient(self.orders[0]) * difference <= SAFETY * larger;
            let [mut low, mut high] = self.orders;
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (low + high);
                if quotient(middle) * difference < larger {
                    low = middle
                } else {
                    high = middle
                }
            }
            self.order = 0.5 * (low + high);
        }
        difference / (ratio.powf(self.order) - 1.0)
    }
}

/// Error estimate of the last run, relative to the length.
#[derive(Debug, Clone, Copy)]
pub(super) struct ErrorEstimate {
    /// Error of the steps over the time of the call.
    time: f64,
    /// Further error of the steps over the delays after the call, in which the memories act.
    later: f64,
    /// Error of elements, merging and the initial equilibrium.
    pub space: f64,
    /// Runs with decreasing steps.
    steps: Richardson,
}

impl ErrorEstimate {
    /// Error estimate of a run from its differences from a run with steps of twice the length. The
    /// differences are those over the time of the call, and over this time and the delays after it.
    /// `order` is that of the steps, of which at most [`UNOBSERVED`] is assumed, and `space` the
    /// error of elements, merging and the initial equilibrium.
    pub fn of_halved_steps([difference, all]: [f64; 2], order: f64, space: f64) -> Self {
        let first = Richardson::assuming(order.min(UNOBSERVED), ORDER as f64);
        let (mut steps, mut with_delays) = (first, first);
        let (time, all) = (steps.error(2.0, difference), with_delays.error(2.0, all));
        // The errors assume at most `UNOBSERVED`. The ratio of the next steps follows from the
        // order of the method.
        steps.order = order;
        // Infinite differences have no further error.
        Self {
            time,
            later: (all - time).max(0.0),
            space,
            steps,
        }
    }

    /// Error estimate of a run whose steps are half of those of another run, and whose elements are
    /// shorter by `ratio`. Either steps or elements may have caused all of the differences. The
    /// orders are those in time and in space; of orders above one an order of one less is assumed,
    /// since no order has been observed. `other` is the error of the initial equilibrium and
    /// between the material points.
    pub fn of_both(
        ratio: f64,
        differences: [f64; 2],
        [order, order_in_space]: [f64; 2],
        other: f64,
    ) -> Self {
        let assumed = order_before_observation(order_in_space);
        let space =
            other + Richardson::assuming(assumed, order_in_space).error(ratio, differences[1]);
        let estimate = Self::of_halved_steps(differences, order.min(UNOBSERVED), space);
        // The differences are not due to the steps alone, so that they show no order.
        Self {
            steps: Richardson::assuming(order, ORDER as f64),
            ..estimate
        }
    }

    /// Returns whether the runs are close enough to each other to show an order of convergence.
    pub fn is_asymptotic(&self) -> bool {
        self.time() <= ASYMPTOTIC && self.space <= ASYMPTOTIC
    }

    /// Returns the error of the steps over the time of the call and the delays after it, relative
    /// to the length.
    pub fn time(&self) -> f64 {
        self.time + self.later
    }

    /// Returns the error in time and space with the safety factor.
    pub fn reported(&self) -> f64 {
        SAFETY * (self.time() + self.space)
    }

    /// Returns the largest error in time that a tolerance permits in addition to the error in
    /// space.
    pub fn left_for_steps(&self, tolerance: f64) -> f64 {
        tolerance / SAFETY - self.space
    }

    /// Returns the refinement of the steps of the next run, and whether that run is the last one.
    /// If the error of the last run is to be `extrapolated`, the last run is not compared with
    /// another one, and the error of its steps has a second safety factor.
    pub fn next_refinement(&self, tolerance: f64, extrapolated: bool) -> (f64, bool) {
        let caution = if extrapolated { SAFETY } else { 1.0 };
        // Before an order is observed, the error is that of a lower order, which is reserve enough.
        let reserve = if self.steps.is_observed {
            AIM_IN_TIME
        } else {
            1.0
        };
        let aim = reserve * self.left_for_steps(tolerance);
        // A run that is not compared may have the steps of the first run, whose error is known.
        let least = if extrapolated {
            SAFETY.recip()
        } else {
            MIN_REFINEMENT
        };
        let needed = |error: f64, order: f64| (error * caution / aim).powf(1.0 / order);
        let needed = needed(self.time, self.steps.order)
            .max(needed(self.later, self.order_of_later()))
            .max(least);
        // An extrapolated run is refined by SAFETY, or by SAFETY * MIN_REFINEMENT if the refinement
        // before was too small. It follows runs whose order is observed, since a single difference
        // may be small by chance.
        let is_observed = self.steps.is_observed;
        let is_last = extrapolated && is_observed && needed <= SAFETY * MIN_REFINEMENT;
        let compared = match (extrapolated && !is_last, is_observed) {
            (true, true) => needed / SAFETY,
            (true, false) => (needed / SAFETY).max(SAFETY),
            _ => needed,
        };
        // A larger refinement is divided. The last of its parts is the largest, since runs with few
        // steps cost less. After a run in contact the next run shows the order, which may be higher
        // than the assumed one.
        let most = if !is_observed && self.steps.order < MIN_ORDER {
            SAFETY
        } else {
            MAX_REFINEMENT
        };
        let ratio = if compared > most {
            (compared / most).clamp(SAFETY, most)
        } else {
            compared
        };
        (ratio, is_last)
    }

    /// Returns the expected error of a run with steps refined by `ratio`. Only the error of the
    /// steps, which is extrapolated, has the second safety factor.
    pub fn extrapolated(&self, ratio: f64) -> f64 {
        let time = SAFETY * self.time / ratio.powf(self.steps.order);
        Self {
            time,
            later: SAFETY * self.later_at(ratio),
            ..*self
        }
        .reported()
    }

    /// Returns the estimate for a run with steps refined by `ratio` that differs from the run of
    /// this estimate by `difference`.
    pub fn refined(&self, ratio: f64, difference: f64) -> Self {
        let mut steps = self.steps;
        let time = steps.error(ratio, difference);
        Self {
            time,
            later: self.later_at(ratio),
            steps,
            ..*self
        }
    }

    /// Returns the expected error over the delays after the call, of a run with steps refined by
    /// `ratio`.
    fn later_at(&self, ratio: f64) -> f64 {
        self.later / ratio.powf(self.order_of_later())
    }

    /// Returns the order of the error over the delays after the call: at most one less than that of
    /// the method, since only the first runs continue over the delays.
    fn order_of_later(&self) -> f64 {
        self.steps.order.min(UNOBSERVED)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_fourth_order_report_twice_their_error() {
        // Runs with steps h, h/2 and h/6 whose errors are (h/1000)⁴.
        let errors = [1e-3, 5e-4, 5e-4 / 3.0].map(|step: f64| step.powi(4));
        let first = ErrorEstimate::of_halved_steps([errors[0] - errors[1]; 2], ORDER as f64, 0.0);
        // Before the order is observed order three is assumed: (2⁴ − 1)/(2³ − 1). The error is
        // rounding of the difference.
        assert!(
            (first.reported() / (2.0 * errors[1]) - 15.0 / 7.0).abs() < 1e-12,
            "{first:?}"
        );
        let second = first.refined(3.0, errors[1] - errors[2]);
        // The error of the order is (4 − 2)/2²⁰ = 2e-6. That of the estimate is larger by ln 3 ·
        // 81/80.
        assert!(
            (second.reported() / (2.0 * errors[2]) - 1.0).abs() < 3e-6,
            "{second:?}"
        );
    }

    #[test]
    fn run_with_half_the_steps_and_the_elements_is_not_better_than_estimated() {
        // Errors (h/1000)^q of the steps and (l/10)⁵ of the elements, for steps h and elements of
        // length l.
        for (order, q) in [(ORDER as f64, 4), (ORDER_IN_CONTACT, 1)] {
            let error = |h: f64, l: f64| (h / 1000.0).powi(q) + (l / 10.0).powi(5);
            for ratio in [1.25, 1.5, 2.0, 3.0] {
                let (coarse, fine) = (error(200.0, 1.0), error(100.0, 1.0 / ratio));
                let estimate = ErrorEstimate::of_both(ratio, [coarse - fine; 2], [order, 6.0], 0.0);
                assert!(estimate.reported() >= 2.0 * fine, "{ratio}: {estimate:?}");
            }
        }
    }

    #[test]
    fn steps_in_contact_report_twice_their_error_of_first_order() {
        // Runs with steps h, h/2 and h/8 whose errors are h/1000, of which the part in the call is
        // 3/4.
        let errors = [1.0, 0.5, 0.125].map(|step: f64| 1e-3 * step);
        let difference = errors[0] - errors[1];
        let first =
            ErrorEstimate::of_halved_steps([0.75 * difference, difference], ORDER_IN_CONTACT, 0.0);
        assert!(
            (first.reported() / (2.0 * errors[1]) - 1.0).abs() < 1e-12,
            "{first:?}"
        );
        let second = first.refined(4.0, 0.75 * (errors[1] - errors[2]));
        // The error of the order is (4 − 1)/2²⁰ = 3e-6.
        assert!(
            (second.reported() / (2.0 * errors[2]) - 1.0).abs() < 1e-5,
            "{second:?}"
        );
    }
}
