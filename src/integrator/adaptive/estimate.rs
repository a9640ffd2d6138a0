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
/// The same for the first trials. The graded steps after a start are alike in both, and halve only further on.
const FIRST_SAFETY: f64 = 4.0;
/// Which part of the tolerance is aimed at for the error in time, and for that in space: with the factor above they leave as much
/// again, so that a run seldom has to be repeated.
pub(super) const AIM: [f64; 2] = [0.15, 0.1];
/// No lower order in time is believed: kinks leave three, and what is not resolved yet says nothing.
const LEAST_ORDER: f64 = 2.0;
/// Estimates of runs that are not held against another are multiplied by this once more, and half as much is aimed at.
pub(super) const BLIND_SAFETY: f64 = 2.0;

/// What is known of the error of the last run, relative to the length.
#[derive(Debug, Clone, Copy)]
pub(super) struct Error {
    pub time: f64,
    pub space: f64,
    /// By what the estimate is multiplied before it is reported.
    doubt: f64,
    /// The order in time that runs have shown, at most that of the method.
    order: f64,
    /// By what the last run and the one before differed, and by how much finer the last was, in steps.
    difference: f64,
    jump: f64,
}

impl Error {
    /// Of a run with half the steps of one from which it differs so much.
    pub fn of_first_trials(difference: f64, space: f64) -> Self {
        let time = difference / (2.0_f64.powf(IN_TIME) - 1.0);
        Self { time, space, doubt: FIRST_SAFETY, order: IN_TIME, difference, jump: 2.0 }
    }

    pub fn reported(&self) -> f64 {
        self.doubt * (self.time + self.space)
    }

    /// How much finer the next run has to be than the last, in steps, on the way to a tolerance, and whether it may be an answer that is not
    /// held against another, if the answer is to be such a `blind` one.
    pub fn next_jump(&self, tolerance: f64, blind: bool) -> (f64, bool) {
        let aim = AIM[0] * tolerance / self.caution(blind);
        let whole = (self.time / aim).powf(1.0 / self.order).max(SHORTEST_JUMP);
        let is_last = blind && whole <= LONGEST_BLIND_JUMP;
        let tried = if blind && !is_last { whole / BLIND_JUMP } else { whole };
        // As many jumps of one size as it takes.
        let jumps = (tried.ln() / LONGEST_JUMP.ln()).ceil().max(1.0);
        (tried.powf(1.0 / jumps), is_last)
    }

    /// By how much less is aimed at, so that what is reported stays below the tolerance.
    fn caution(&self, blind: bool) -> f64 {
        if blind { BLIND_SAFETY * self.doubt / SAFETY } else { 1.0 }
    }

    /// How much shorter elements have to be in a run that is finer than the last by `jump` in its steps, and the error that is expected
    /// of that run. Elements, of such an order in their length, keep pace with the steps.
    pub fn expected(&self, jump: f64, tolerance: f64, blind: bool, order: f64) -> (f64, Self) {
        let time = self.time / jump.powf(self.order);
        let finer = (self.space / (AIM[1] * tolerance / self.caution(blind)).max(time)).powf(1.0 / order).max(1.0);
        (finer, Self { time, space: self.space / finer.powf(order), ..*self })
    }

    /// The error of a run that was finer than the one of this error by `jump`, of which so much was `expected`, and which differs from
    /// it by `difference`. The shape at rest that it began with is off by `at_rest`.
    pub fn seen(&self, expected: &Self, jump: f64, difference: f64, at_rest: f64) -> Self {
        // What the run before lost to its longer elements is known; the rest is due to its steps.
        let in_time = difference - self.space;
        // Differences e(2h) − e(h) and e(h) − e(h/j) of e = c h^q: their ratio is about 2^q − 1.
        let order = ((1.0 + self.difference / in_time).ln() / self.jump.ln()).clamp(LEAST_ORDER, IN_TIME);
        let order = if in_time > 0.0 { order } else { IN_TIME };
        let gain = jump.powf(order) - 1.0;
        // It cannot tell less than what is expected, unless all of the difference is less.
        let time = (in_time / gain).max(expected.time.min(difference / gain));
        let space = expected.space + at_rest;
        Self { time, space, doubt: SAFETY, order, difference: in_time.max(0.0), jump }
    }
}
