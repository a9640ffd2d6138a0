//! Error estimates from the differences of runs (Richardson extrapolation), and the ratio of the next refinement.

use crate::integrator::ORDER;

/// Safety factor on reported error estimates, and on the expected difference of two runs.
pub(super) const SAFETY: f64 = 2.0;
/// Target errors in time and in space, relative to the tolerance. With the safety factor their sum is half of
/// the tolerance, so that few runs have to be repeated.
pub(super) const AIM: [f64; 2] = [0.15, 0.1];
/// Largest difference of two runs, relative to the length, that shows an order of convergence.
pub(super) const ASYMPTOTIC: f64 = 0.02;
/// Largest refinement of the steps between two runs that are compared. It changes the error by 8⁴ = 4096. The
/// observed order does not hold over a larger range.
const MAX_REFINEMENT: f64 = 8.0;
/// Smallest refinement. The difference of two nearly equal runs does not show their errors.
const MIN_REFINEMENT: f64 = 1.25;
/// Smallest assumed order. Kinks reduce the order in time to three, and runs that are not resolved show no order.
const MIN_ORDER: f64 = 2.0;
/// Number of bisections for the observed order. Their accuracy is 2e-6.
const BISECTIONS: usize = 20;

/// Error estimate of a sequence of runs with increasing resolution in time or in space, and their observed
/// order of convergence.
#[derive(Debug, Clone, Copy)]
pub(super) struct Richardson {
    max_order: f64,
    /// Ratio of the last refinement, and the difference of its two runs.
    last: Option<(f64, f64)>,
    order: f64,
    converges: bool,
}

impl Richardson {
    /// An estimate for a method of the given order.
    pub fn new(max_order: f64) -> Self {
        Self { max_order, last: None, order: max_order, converges: true }
    }

    /// Returns the observed order, at most that of the method.
    pub fn order(&self) -> f64 {
        self.order
    }

    /// Returns whether the differences decrease about as fast as the smallest order requires, or faster.
    pub fn converges(&self) -> bool {
        self.converges
    }

    /// Returns the error of a run that is refined by `ratio` and differs from the run before by `difference`.
    pub fn error(&mut self, ratio: f64, difference: f64) -> f64 {
        if let Some((before, larger)) = self.last.replace((ratio, difference)) {
            // For an error e = c h^q the differences between h a, h and h / b have the quotient (a^q − 1)/(1 −
            // b^−q), which increases with q.
            let quotient = |q: f64| (before.powf(q) - 1.0) / (1.0 - ratio.powf(-q));
            self.converges = quotient(MIN_ORDER) * difference <= SAFETY * larger;
            let (mut low, mut high) = (MIN_ORDER, self.max_order);
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (low + high);
                if quotient(middle) * difference < larger { low = middle } else { high = middle }
            }
            self.order = 0.5 * (low + high);
        }
        // The estimate is at most twice the difference, also for nearly equal runs.
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
    /// Error estimate from two runs whose step sizes differ by a factor of two.
    pub fn of_half_steps(difference: f64, space: f64) -> Self {
        let mut steps = Richardson::new(ORDER as f64);
        let time = steps.error(2.0, difference);
        Self { time, space, steps }
    }

    /// Returns whether the runs are close enough to each other to show an order of convergence.
    pub fn is_asymptotic(&self) -> bool {
        self.time <= ASYMPTOTIC && self.space <= ASYMPTOTIC
    }

    /// Returns the error in time and space with the safety factor.
    pub fn reported(&self) -> f64 {
        SAFETY * (self.time + self.space)
    }

    /// Returns the largest error in time that a tolerance permits in addition to the error in space.
    pub fn left_for_steps(&self, tolerance: f64) -> f64 {
        tolerance / SAFETY - self.space
    }

    /// Returns the refinement of the steps of the next run, and whether that run is the last one. If the error
    /// of the last run is to be `extrapolated`, the last run is not compared with another one, and has a second
    /// safety factor.
    pub fn next_refinement(&self, tolerance: f64, extrapolated: bool) -> (f64, bool) {
        let caution = if extrapolated { SAFETY } else { 1.0 };
        let aim = (AIM[0] * tolerance).min(self.left_for_steps(tolerance) / SAFETY);
        let needed = (self.time * caution / aim).powf(1.0 / self.steps.order()).max(MIN_REFINEMENT);
        // An extrapolated run is refined by SAFETY, or by SAFETY * MIN_REFINEMENT if the refinement before was
        // too small.
        let is_last = extrapolated && needed <= SAFETY * MIN_REFINEMENT;
        let compared = if extrapolated && !is_last { needed / SAFETY } else { needed };
        // A large refinement is divided into equal ones.
        let parts = (compared.ln() / MAX_REFINEMENT.ln()).ceil().max(1.0);
        (compared.powf(1.0 / parts), is_last)
    }

    /// Returns the expected error of a run with steps refined by `ratio`, with both safety factors.
    pub fn extrapolated(&self, ratio: f64) -> f64 {
        SAFETY * Self { time: self.time / ratio.powf(self.steps.order()), ..*self }.reported()
    }

    /// Returns the estimate for a run with steps refined by `ratio` that differs from the run of this estimate
    /// by `difference`.
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
        // The error of the order is (4 − 2)/2²⁰ = 2e-6. That of the estimate is larger by ln 3 · 81/80.
        assert!((second.reported() / (2.0 * errors[2]) - 1.0).abs() < 3e-6, "{second:?}");
    }
}
