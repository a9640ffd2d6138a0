//! What trial runs say of the error, and how much finer the next one has to be.

/// The order in time.
const IN_TIME: f64 = super::super::ORDER as f64;
/// A run is never trusted to be finer than the one it is held against by more than this, in steps: so long the order holds.
const LONGEST_JUMP: f64 = 8.0;
/// Or by less than this: the difference of two runs that are all but alike says nothing.
const SHORTEST_JUMP: f64 = 1.25;
/// The longest jump of a run that is not held against another.
const LONGEST_BLIND_JUMP: f64 = 2.5;
/// And its size if it can be chosen.
const BLIND_JUMP: f64 = 2.0;
/// Estimates are multiplied by this before they are reported.
pub(super) const SAFETY: f64 = 2.0;
/// Which part of the tolerance is aimed at for the error in time, and for that in space: with the factor above they leave as much
/// again, so that a run seldom has to be repeated.
pub(super) const AIM: [f64; 2] = [0.15, 0.1];
/// At most this part of the error that the elements leave to the steps is aimed at. The error of the next run is known to a fifth or so.
const LEFT_FOR_STEPS: f64 = 0.5;
/// No lower order is believed: kinks leave three in time, and what is not resolved yet says nothing.
const LEAST_ORDER: f64 = 2.0;
/// Differences that exceed what the least order allows by more than this do not come from what was refined.
const SLACK: f64 = 2.0;
/// Estimates of runs that are not held against another are multiplied by this once more, and half as much is aimed at.
pub(super) const BLIND_SAFETY: f64 = 2.0;
/// Runs that were all but alike show an error of this part of their difference at least.
const LEAST_GAIN: f64 = 0.5;
/// Runs that differ by more than this, relative to the length, do not show an order yet.
pub(super) const ASYMPTOTIC: f64 = 0.02;
/// The order is found to a part in so many powers of two.
const BISECTIONS: usize = 20;

/// Runs that are finer and finer in one respect, and the order that their differences show.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ladder {
    highest: f64,
    /// By how much the last run was finer than the one before it, and by how much they differed.
    last: Option<(f64, f64)>,
    order: f64,
    falls: bool,
}

impl Ladder {
    /// Nothing is known but the order of the method.
    pub fn new(highest: f64) -> Self {
        Self { highest, last: None, order: highest, falls: true }
    }

    /// The order seen, at most that of the method.
    pub fn order(&self) -> f64 {
        self.order
    }

    /// Whether differences fall about as fast as the least order says, at least.
    pub fn falls(&self) -> bool {
        self.falls
    }

    /// The error of a run that is finer than the one before by a ratio, and differs from it by so much.
    pub fn climb(&mut self, ratio: f64, difference: f64) -> f64 {
        if let Some((before, larger)) = self.last.replace((ratio, difference)) {
            // Differences of e = c h^q between h a, h and h / b: the first is (a^q − 1)/(1 − b^−q) times the second, which
            // rises with q.
            let quotient = |q: f64| (before.powf(q) - 1.0) / (1.0 - ratio.powf(-q));
            self.falls = quotient(LEAST_ORDER) * difference <= SLACK * larger;
            let (mut low, mut high) = (LEAST_ORDER, self.highest);
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (low + high);
                if quotient(middle) * difference < larger { low = middle } else { high = middle }
            }
            self.order = 0.5 * (low + high);
        }
        difference / (ratio.powf(self.order) - 1.0).max(LEAST_GAIN)
    }
}

/// What is known of the error of the last run, relative to the length.
#[derive(Debug, Clone, Copy)]
pub(super) struct Error {
    time: f64,
    space: f64,
    /// Of runs with shorter and shorter steps.
    steps: Ladder,
}

impl Error {
    /// Of a run with half the steps of one from which it differs so much.
    pub fn of_first_trials(difference: f64, space: f64) -> Self {
        let mut steps = Ladder::new(IN_TIME);
        let time = steps.climb(2.0, difference);
        Self { time, space, steps }
    }

    /// Whether the runs were near enough to each other to say anything.
    pub fn shows_order(&self) -> bool {
        self.time <= ASYMPTOTIC && self.space <= ASYMPTOTIC
    }

    pub fn reported(&self) -> f64 {
        SAFETY * (self.time + self.space)
    }

    /// The error in time that a tolerance allows beside the error in space.
    pub fn left_for_steps(&self, tolerance: f64) -> f64 {
        tolerance / SAFETY - self.space
    }

    /// How much finer the next run has to be than the last, in steps, on the way to a tolerance, and whether it may be an answer that is not
    /// held against another, if the answer is to be such a `blind` one.
    pub fn next_jump(&self, tolerance: f64, blind: bool) -> (f64, bool) {
        // By how much less is aimed at, so that what is reported stays below the tolerance.
        let caution = if blind { BLIND_SAFETY } else { 1.0 };
        let aim = (AIM[0] * tolerance).min(LEFT_FOR_STEPS * self.left_for_steps(tolerance));
        let whole = (self.time * caution / aim).powf(1.0 / self.steps.order()).max(SHORTEST_JUMP);
        let is_last = blind && whole <= LONGEST_BLIND_JUMP;
        let tried = if blind && !is_last { whole / BLIND_JUMP } else { whole };
        // As many jumps of one size as it takes.
        let jumps = (tried.ln() / LONGEST_JUMP.ln()).ceil().max(1.0);
        (tried.powf(1.0 / jumps), is_last)
    }

    /// The error that is expected of a run that is finer than the last by `jump` in its steps.
    pub fn expected(&self, jump: f64) -> Self {
        Self { time: self.time / jump.powf(self.steps.order()), ..*self }
    }

    /// The error of a run that was finer by `jump` in its steps than the one of this error, from which it differs so much.
    pub fn seen(&self, jump: f64, difference: f64) -> Self {
        let mut steps = self.steps;
        let time = steps.climb(jump, difference);
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
        let first = Error::of_first_trials(errors[0] - errors[1], 0.0);
        // Rounding of the difference.
        assert!((first.reported() / (2.0 * errors[1]) - 1.0).abs() < 1e-12, "{first:?}");
        let second = first.seen(3.0, errors[1] - errors[2]);
        // The order is halved 20 times between 2 and 4: 2e-6, of which its powers make ln 3 times 81/80.
        assert!((second.reported() / (2.0 * errors[2]) - 1.0).abs() < 3e-6, "{second:?}");
    }
}
