//! Error estimates from the differences of runs (Richardson extrapolation), and the refinement of the next run.

use crate::integrator::ORDER;

/// Factor on error estimates before they are reported, and on what a difference of two runs may exceed the expected one.
pub(super) const SAFETY: f64 = 2.0;
/// Error in time and in space at which runs aim, over the tolerance. With the safety factor half of the tolerance is left, so that
/// a run is seldom repeated.
pub(super) const AIM: [f64; 2] = [0.15, 0.1];
/// Difference of two runs, relative to the length, above which they do not show an order of convergence.
pub(super) const ASYMPTOTIC: f64 = 0.02;
/// Largest refinement of the steps between two runs that are compared. The observed order does not hold for more: the error has
/// changed by 8⁴ = 4096.
const MAX_REFINEMENT: f64 = 8.0;
/// Smallest refinement: the difference of two runs that are nearly equal does not show their errors.
const MIN_REFINEMENT: f64 = 1.25;
/// Smallest order that is assumed: kinks reduce the order in time to three, and unresolved runs show none.
const MIN_ORDER: f64 = 2.0;
/// Number of bisections for the observed order, which is then known to 2e-6.
const BISECTIONS: usize = 20;

/// Error estimate of runs with increasing refinement in one respect, with their observed order of convergence.
#[derive(Debug, Clone, Copy)]
pub(super) struct Richardson {
    max_order: f64,
    /// Ratio of the last refinement, and the difference of the two runs.
    last: Option<(f64, f64)>,
    order: f64,
    converges: bool,
}

impl Richardson {
    /// An estimate for a method of the given order.
    pub fn new(max_order: f64) -> Self {
        Self { max_order, last: None, order: max_order, converges: true }
    }

    /// Observed order, at most that of the method.
    pub fn order(&self) -> f64 {
        self.order
    }

    /// Whether the differences decrease at least about as fast as the smallest order requires.
    pub fn converges(&self) -> bool {
        self.converges
    }

    /// Returns the error of a run that is refined by `ratio` and differs from the run before by `difference`.
    pub fn error(&mut self, ratio: f64, difference: f64) -> f64 {
        if let Some((before, larger)) = self.last.replace((ratio, difference)) {
            // The differences of e = c h^q between h a, h and h / b have the quotient (a^q − 1)/(1 − b^−q), which increases with q.
            let quotient = |q: f64| (before.powf(q) - 1.0) / (1.0 - ratio.powf(-q));
            self.converges = quotient(MIN_ORDER) * difference <= SAFETY * larger;
            let (mut low, mut high) = (MIN_ORDER, self.max_order);
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (low + high);
                if quotient(middle) * difference < larger { low = middle } else { high = middle }
            }
            self.order = 0.5 * (low + high);
        }
        // The error of nearly equal runs is estimated by twice their difference at most.
        difference / (ratio.powf(self.order) - 1.0).max(SAFETY.recip())
    }
}

/// Error estimate of the last run, relative to the length.
#[derive(Debug, Clone, Copy)]
pub(super) struct ErrorEstimate {
    time: f64,
    space: f64,
    /// Runs with decreasing steps.
    steps: Richardson,
}

impl ErrorEstimate {
    /// The estimate for a run with half the steps of one from which it differs by `difference`.
    pub fn of_half_steps(difference: f64, space: f64) -> Self {
        let mut steps = Richardson::new(ORDER as f64);
        let time = steps.error(2.0, difference);
        Self { time, space, steps }
    }

    /// Whether the runs are close enough to each other to show an order of convergence.
    pub fn is_asymptotic(&self) -> bool {
        self.time <= ASYMPTOTIC && self.space <= ASYMPTOTIC
    }

    pub fn reported(&self) -> f64 {
        SAFETY * (self.time + self.space)
    }

    /// Error in time that a tolerance permits beside the error in space.
    pub fn left_for_steps(&self, tolerance: f64) -> f64 {
        tolerance / SAFETY - self.space
    }

    /// Returns the refinement of the steps of the next run, and whether that run may be the answer without a comparison, if it is to be
    /// `extrapolated`. An extrapolated run has another safety factor.
    pub fn next_refinement(&self, tolerance: f64, extrapolated: bool) -> (f64, bool) {
        let caution = if extrapolated { SAFETY } else { 1.0 };
        let aim = (AIM[0] * tolerance).min(self.left_for_steps(tolerance) / SAFETY);
        let needed = (self.time * caution / aim).powf(1.0 / self.steps.order()).max(MIN_REFINEMENT);
        // The last run is refined by SAFETY, and by a smallest refinement more if the one before fell short.
        let is_last = extrapolated && needed <= SAFETY * MIN_REFINEMENT;
        let compared = if extrapolated && !is_last { needed / SAFETY } else { needed };
        // A large refinement is divided into equal ones.
        let parts = (compared.ln() / MAX_REFINEMENT.ln()).ceil().max(1.0);
        (compared.powf(1.0 / parts), is_last)
    }

    /// The expected error of a run with steps refined by `ratio`, with the safety factor of extrapolation.
    pub fn extrapolated(&self, ratio: f64) -> f64 {
        SAFETY * Self { time: self.time / ratio.powf(self.steps.order()), ..*self }.reported()
    }

    /// The estimate for a run with steps refined by `ratio`, which differs from the run of this estimate by `difference`.
    pub fn refined(&self, ratio: f64, difference: f64) -> Self {
        let mut steps = self.steps;
        let time = steps.error(ratio, difference);
        Self { time, steps, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_fourth_order_report_twice_their_error() {
        // Runs with steps h, h/2 and h/6 whose errors are (h/1000)⁴.
        let errors = [1e-3, 5e-4, 5e-4 / 3.0].map(|step: f64| step.powi(4));
        let first = ErrorEstimate::of_half_steps(errors[0] - errors[1], 0.0);
        // Rounding of the difference.
        assert!((first.reported() / (2.0 * errors[1]) - 1.0).abs() < 1e-12, "{first:?}");
        let second = first.refined(3.0, errors[1] - errors[2]);
        // The order is halved 20 times between 2 and 4: 2e-6, of which its powers make ln 3 times 81/80.
        assert!((second.reported() / (2.0 * errors[2]) - 1.0).abs() < 3e-6, "{second:?}");
    }
}
