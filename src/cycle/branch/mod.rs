//! Branches of cycles along a parameter, round folds, with the places at which their stability changes.

mod exponents;
mod follow;
mod follow_circular;
mod follow_periodic;
mod special;

pub use exponents::Special;

use std::collections::VecDeque;
use std::ops::RangeInclusive;

use nalgebra::Complex;

use super::error::CycleError;
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::stability::Linearisation;
use exponents::growing;
use follow::{Condition, Corrected, Follow, Look, Measure, Same, Unknowns, Way};

/// A step is halved where the branch turns by more than this, or no cycle is found: cos of 26°.
const TURN: f64 = 0.9;
/// It is halved down to this share of the first and the longest step.
const SHORTEST: f64 = 2.5e-4;
/// Without what goes round the cycle a first step is not shorter than by this share.
const ROUND: f64 = 0.02;
/// Where it turns by less than this, cos of 11°, the next step is longer.
const EASY: f64 = 0.98;
/// By this.
const LONGER: f64 = 1.5;
/// Number of leading exponents at each place. All growing ones are found, however many there are.
const EXPONENTS: usize = 2;
/// The least excursion, in lengths of the shoot: with its square exponents next to an onset vanish, and are no longer told from those that vanish by symmetry.
const LEAST: f64 = 0.01;

/// A cycle on a branch.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct BranchPoint<O> {
    /// The parameter.
    pub parameter: f64,
    /// The cycle.
    pub orbit: O,
    /// The largest distance of the tip from the axis, m.
    pub excursion: f64,
    /// The period, s; of what comes back turned, the time until then.
    pub period: f64,
    /// The leading exponents λ of disturbances exp(λt), 1/s, largest real part first, without the trivial ones. Of a swing in a plane
    /// first those of disturbances in the plane, then those out of it; else all are in the first list. Of a circular orbit they are those in
    /// the turning frame. Of a pair of conjugates both are in the list.
    pub exponents: [Vec<Complex<f64>>; 2],
    /// Largest modulus of the trivial exponents, which must be zero, times the period: the error that intervals and differences leave.
    pub trivial: f64,
    /// What is special here, if it is such a place.
    pub special: Option<Special>,
}

impl<O> BranchPoint<O> {
    /// How many disturbances grow. At a special place rounding says whether that which neither grows nor decays is among them.
    #[must_use]
    pub fn unstable(&self) -> usize {
        self.exponents.iter().map(|set| growing(set)).sum()
    }
}

/// A place on a branch, with its exponents.
#[derive(Debug, Clone)]
struct Place {
    pub unknowns: Unknowns,
    pub same: Same,
    pub exponents: [Vec<Complex<f64>>; 2],
}

/// A branch of cycles: an iterator over its places, from the first until the parameter is at an end of its range, or the excursion falls below a
/// hundredth of the length, where it comes back to an onset, or rosettes become a circle: beyond it are the same rosettes, a quarter of a turn later.
///
/// Unknown are the cycle and the parameter together, with a condition on the way that is gone, so that the branch is followed round
/// folds. Between two places at which different numbers of disturbances grow it finds where that changes, and says what is there. An error ends the branch.
///
/// `S` is a [`CircularSolver`](super::CircularSolver) or a [`PeriodicSolver`](super::PeriodicSolver); `family` makes the shoot of a parameter's value, and all its shoots have as
/// many material points. It may be asked for parameters a little outside the range, if the branch ends there; derivatives by the parameter are differences over 1e-5 of the range, which
/// should therefore be of the size of what is looked at.
#[derive(Debug, Clone)]
pub struct Branch<S: Follow, F> {
    solver: S,
    family: F,
    within: RangeInclusive<f64>,
    /// Longest step: of the root mean square of strain times length, rad, and of the parameter over its range, by Pythagoras.
    largest_step: f64,
    measure: Measure,
    first_step: f64,
    /// The step that is next.
    step: f64,
    /// Where the last place was.
    last: Place,
    /// The way to the next one, of unit size.
    way: Way,
    /// Whether that way is a guess.
    rough: bool,
    waiting: VecDeque<BranchPoint<S::Orbit>>,
    ended: bool,
}

impl<S: Follow, F, M: Model> Branch<S, F>
where
    F: FnMut(f64) -> Result<Shoot<M>, CycleError>,
{
    /// The branch that begins at an onset of oscillations: from a cycle of a small `amplitude` (m) on, at least a hundredth of the length, whose parameter
    /// is found. The range holds the onset.
    ///
    /// # Errors
    /// A range or an amplitude that makes no sense, a shoot at the onset whose leading root does not oscillate.
    pub fn from_onset(
        mut solver: S,
        mut family: F,
        onset: f64,
        amplitude: f64,
        within: RangeInclusive<f64>,
    ) -> Result<Self, CycleError> {
        check_range(&within, ("onset", onset))?;
        let shoot = family(onset)?;
        let share = amplitude / shoot.rod().length();
        let what = "amplitude of the first cycle, in lengths of the shoot";
        ParameterError::unless((LEAST..1.0).contains(&share), what, share, "from 0.01 to 1")?;
        let root = Linearisation::about(&shoot)?.rightmost()?;
        ParameterError::positive("frequency of the mode", root.value.im)?;
        let stationary = solver.small(&shoot, &root, 0.0, onset)?;
        let guess = solver.small(&shoot, &root, amplitude, onset)?;
        let measure = Measure::new(&guess, shoot.rod().length(), &within);
        let way = stationary.to(&guess);
        let condition = measure.condition(&way, &guess);
        let found = correct_first(&mut solver, &mut family, guess, &condition)?;
        let (what, parameter) = ("parameter of the first cycle", found.unknowns.parameter);
        ParameterError::unless(within.contains(&parameter), what, parameter, "within the range")?;
        let way = solver.small(&shoot, &root, 0.0, onset)?.with_past_of(&found.unknowns).to(&found.unknowns);
        Self::begin(solver, family, within, measure, way, found)
    }

    /// The branch on which there is a cycle that is known, at a value of the parameter, from there on. The first step of the
    /// parameter is given, in its unit: negative for a branch that is followed downwards.
    ///
    /// # Errors
    /// A range or a step that makes no sense, another shoot's cycle.
    pub fn from_orbit(
        mut solver: S,
        mut family: F,
        orbit: &S::Orbit,
        parameter: f64,
        step: f64,
        within: RangeInclusive<f64>,
    ) -> Result<Self, CycleError> {
        ParameterError::unless(step != 0.0 && step.is_finite(), "first step of the parameter", step, "not zero")?;
        check_range(&within, ("parameter of the start", parameter))?;
        let shoot = family(parameter)?;
        let known = solver.known(&shoot, orbit, parameter)?;
        let measure = Measure::new(&known, shoot.rod().length(), &within);
        let condition = measure.at(parameter);
        let found = correct_first(&mut solver, &mut family, known, &condition)?;
        let way = Way::of_parameter(&found.unknowns, step);
        Self::begin(solver, family, within, measure, way, found)
    }

    fn begin(
        solver: S,
        family: F,
        within: RangeInclusive<f64>,
        measure: Measure,
        way: Way,
        found: Corrected<S::Orbit, M>,
    ) -> Result<Self, CycleError> {
        let (step, way) = (measure.size(&way), measure.unit(&way, &found.same));
        let last = Place { unknowns: found.unknowns.clone(), same: found.same.clone(), exponents: Default::default() };
        let mut out = Self {
            solver,
            family,
            within,
            largest_step: 0.05,
            measure,
            first_step: step,
            step,
            last,
            way,
            // A change of the parameter alone, or a chord from the onset.
            rough: true,
            waiting: VecDeque::new(),
            ended: false,
        };
        let (point, place) = out.look(found)?;
        out.last = place;
        out.waiting.push_back(point);
        Ok(out)
    }

    /// The longest step, 0.05 unless said otherwise: of the root mean square of strain times length (rad) and of the parameter over
    /// its range, by Pythagoras.
    ///
    /// # Errors
    /// A step that is not positive.
    pub fn largest_step(mut self, step: f64) -> Result<Self, CycleError> {
        ParameterError::positive("longest step along a branch", step)?;
        self.largest_step = step;
        Ok(self)
    }

    /// Goes on by a step; what it finds waits.
    fn advance(&mut self) -> Result<(), CycleError> {
        loop {
            let error = match self.try_step() {
                // It comes back to where nothing moves, or to a circle.
                Err(CycleError::Stationary { .. } | CycleError::Circle) => {
                    self.ended = true;
                    return Ok(());
                }
                Err(CycleError::Unresolved { .. }) if self.refine() => continue,
                Err(error) => error,
                Ok(()) => return Ok(()),
            };
            self.step = 0.5 * self.step.min(self.largest_step);
            if self.step < SHORTEST * self.first_step.min(self.largest_step) {
                return Err(error);
            }
        }
    }

    /// Doubles the intervals of a period, if it has any and they are not too many.
    fn refine(&mut self) -> bool {
        let Some(refined) = self.solver.refined() else { return false };
        self.way = self.way.on_finer_grid(&self.last.unknowns, &self.solver);
        self.last.unknowns = self.solver.on_finer_grid(self.last.unknowns.clone());
        self.solver = refined;
        true
    }

    /// A step; nothing changes if it fails.
    fn try_step(&mut self) -> Result<(), CycleError> {
        let step = self.step.min(self.largest_step);
        let from = self.last.unknowns.clone();
        let mut guess = from.along(&self.way, step);
        let mut condition = self.beside_last(self.measure.condition(&self.way, &guess));
        let mut bound = self.bound_before(guess.parameter);
        if let Some(bound) = bound {
            let share = (bound - from.parameter) / (guess.parameter - from.parameter);
            (guess, condition) = (from.along(&self.way, share * step), self.beside_last(self.measure.at(bound)));
            guess.parameter = bound;
        }
        let mut found = self.solver.correct(&mut self.family, guess, &condition)?;
        if bound.is_none() {
            bound = self.bound_before(found.unknowns.parameter);
            if let Some(bound) = bound {
                let from = from.clone().with_past_of(&found.unknowns);
                let gone = from.to(&found.unknowns);
                let mut guess = from.along(&gone, (bound - from.parameter) / gone.parameter);
                guess.parameter = bound;
                let condition = self.beside_last(self.measure.at(bound));
                found = self.solver.correct(&mut self.family, guess, &condition)?;
            }
        }
        // Through where nothing moves, to what is the same cycle half a period later.
        if self.measure.agreement(&from, &found.unknowns) < 0.0 {
            self.ended = true;
            return Ok(());
        }
        if !self.rough && self.measure.circle_between(&self.last.same, &found.same) {
            self.ended = true;
            return Ok(());
        }
        let gone = from.with_past_of(&found.unknowns).to(&found.unknowns);
        let size = self.measure.size(&gone);
        if bound.is_some() && !(size > f64::EPSILON) {
            // It began there.
            self.ended = true;
            return Ok(());
        }
        let turn = self.measure.product(&gone, &self.way) / size;
        // Of a way that is a guess only the sense counts, and that it does not go round the cycle instead.
        let round = size - self.measure.size(&self.measure.without(&gone, &self.last.same));
        if !(if self.rough { turn > 0.0 && round < ROUND * size } else { turn > TURN }) {
            return Err(CycleError::Lost { parameter: self.last.unknowns.parameter, step, turn });
        }
        let (point, place) = self.look(found)?;
        if point.excursion < LEAST * self.measure.length {
            self.ended = true;
            return Ok(());
        }
        self.special_between(&place)?;
        self.way = self.measure.unit(&gone, &place.same);
        self.step = size * if turn > EASY { LONGER } else { 1.0 };
        (self.rough, self.ended) = (false, bound.is_some());
        self.last = place;
        self.waiting.push_back(point);
        Ok(())
    }

    /// The condition, with the phases of the last place: if the guess is good, since other states of the cycle have that phase, too.
    fn beside_last(&self, condition: Condition) -> Condition {
        if self.rough { condition } else { condition.beside_place(&self.last.unknowns, &self.last.same) }
    }

    /// The end of the range that lies before a parameter outside it.
    fn bound_before(&self, parameter: f64) -> Option<f64> {
        let (from, to) = (*self.within.start(), *self.within.end());
        if parameter > to {
            Some(to)
        } else if parameter < from {
            Some(from)
        } else {
            None
        }
    }

    /// What there is to say of a place.
    fn look(&mut self, found: Corrected<S::Orbit, M>) -> Result<(BranchPoint<S::Orbit>, Place), CycleError> {
        let Corrected { orbit, unknowns, same, shoot } = found;
        let Look { excursion, period, exponents: mut sets, trivial } = self.solver.look(&orbit, &shoot, EXPONENTS)?;
        sets.iter_mut().for_each(|set| set.sort_by(|a, b| b.re.total_cmp(&a.re)));
        let place = Place { unknowns, same, exponents: sets.clone() };
        let (parameter, trivial) = (place.unknowns.parameter, trivial * period);
        Ok((BranchPoint { parameter, orbit, excursion, period, exponents: sets, trivial, special: None }, place))
    }
}

impl<S: Follow, F, M: Model> Iterator for Branch<S, F>
where
    F: FnMut(f64) -> Result<Shoot<M>, CycleError>,
{
    type Item = Result<BranchPoint<S::Orbit>, CycleError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.waiting.is_empty()
            && !self.ended
            && let Err(error) = self.advance()
        {
            self.ended = true;
            return Some(Err(error));
        }
        self.waiting.pop_front().map(Ok)
    }
}

/// The first cycle of a branch, on as many intervals as it requires.
fn correct_first<S: Follow, M: Model>(
    solver: &mut S,
    family: &mut impl FnMut(f64) -> Result<Shoot<M>, CycleError>,
    mut guess: Unknowns,
    condition: &Condition,
) -> Result<Corrected<S::Orbit, M>, CycleError> {
    loop {
        let error = match solver.correct(family, guess.clone(), condition) {
            Err(error @ CycleError::Unresolved { .. }) => error,
            answer => return answer,
        };
        let refined = solver.refined().ok_or(error)?;
        guess = solver.on_finer_grid(guess);
        *solver = refined;
    }
}

/// Refuses a range without a length, or one that does not hold a value.
fn check_range(within: &RangeInclusive<f64>, (name, start): (&'static str, f64)) -> Result<(), ParameterError> {
    let (what, range) = ("range of the parameter", within.end() - within.start());
    ParameterError::unless(range > 0.0 && range.is_finite(), what, range, "positive")?;
    ParameterError::unless(within.contains(&start), name, start, "within the range")
}
