//! An attempt at a step: the linear rod, its contacts, and the length of the step.
//!
//! A step removes a share of the unbalanced couples and of the violated conditions. The share is
//! one unless the step would leave the range of the linear rod. Then the contact problem is solved
//! for smaller shares until a step fits, and for larger ones with extrapolated forces, so that the
//! contacts stay on their sides of the obstacles.

use super::candidate::deepest;
use super::linear::Linear;
use super::reduced::LinearContact;
use super::search::HeldSearch;
use super::settings;
use super::trial::{Attempt, Course, Merit, Start, Step, Trial};
use crate::equilibrium::EquilibriumError;
use crate::rod::Rod;

/// Rotation in a step below which the steps are expected to converge, rad.
const CLOSE_TURN: f64 = 0.02;
/// Rotation in a step that is not shortened but needs a shift, rad: the tangent is almost singular,
/// or the contact problem is not solved and its forces do not balance the rod.
const LONGEST_STEP: f64 = 10.0;
/// Rotation in a step that needs no comparison although friction acts, rad.
const TINY_TURN: f64 = 1e-9;
/// Values below which an unstable rod is near a saddle if its steps do not become shorter. The rod
/// then leaves the saddle by 0.1 rad, and the residual moves it by much less. With a residual of
/// 1e-4, a buckled rod whose clamp turned slowly rotated out of its plane by 0.1 rad.
const NEAR_SADDLE: (f64, f64) = (1e-2, 1e-6);
/// Values below which a rod that needs a shift is at a saddle in any case: both are due to
/// rounding.
const AT_SADDLE: (f64, f64) = (1e-10, 1e-10);

/// Whether a step fits the range of the linear rod.
enum RangeCheck {
    Fits,
    Misses,
    /// Obstacles within reach have been added to the candidates.
    Found,
}

/// A step that fits.
struct Fitting {
    /// The contacts before and after corrections.
    uncorrected: Vec<LinearContact>,
    corrected: Vec<LinearContact>,
    /// Its share of the unbalanced couples and violations.
    share: f64,
}

impl HeldSearch<'_> {
    /// Attempts a step with a shift, which is needed if a smaller one was rejected. After a
    /// rejection rod and reactions are those before.
    pub(super) fn attempt(
        &mut self,
        rod: &mut Rod,
        course: &mut Course,
        (shift, needed): (f64, bool),
    ) -> Result<Attempt, EquilibriumError> {
        let factors = self.factorise(rod, shift)?;
        self.body.balance();
        let mut start = self.start(rod, factors.energy);
        let (mut additions, mut searched, mut tested) =
            (0, self.obstacles.contacts.is_empty(), false);
        // In contact, Newton's method tests the tangent only after a step that is too long or that
        // the line search shortens or refuses.
        let is_newton = self.is_loaded() && !course.is_descent() && self.stable && shift == 0.0;
        loop {
            let mut trial = Trial::new(self.linearise(rod, factors));
            if !std::mem::replace(&mut tested, true)
                && let Some(attempt) = self.test_tangent(rod, course, &start, &trial.linear)
            {
                return Ok(attempt);
            }
            self.solve_trial(&mut trial, &start, None);
            let turn = trial.turn;
            if !turn.is_finite() && (shift > 0.0 || !self.stable) {
                return Err(EquilibriumError::NotFinite {
                    what: "Newton step",
                });
            }
            // The comparison fails for NaN.
            if !(turn <= LONGEST_STEP || turn.is_finite() && !self.stable) {
                let lost = is_newton && self.is_unstable(&trial.linear);
                return Ok(if lost {
                    Attempt::Lost
                } else {
                    Attempt::Rejected
                });
            }
            if needed
                && self.tests_inertia(course)
                && self.is_at_saddle(&start.merit, turn, course.last_turn)
            {
                self.count_saddle(course, start.merit.energy, turn)?;
                self.leave_saddle(rod, &start, &trial.linear, course.saddles - 1);
                return Ok(Attempt::Moved);
            }
            match self.fit(rod, &mut start, &mut trial, &mut searched) {
                RangeCheck::Found => continue,
                RangeCheck::Misses => {
                    // If nodes have moved, the equilibrium on the nodes before is close, and a
                    // shift is tried.
                    self.return_to(rod, &start);
                    return Ok(if is_newton && course.answer.is_none() {
                        Attempt::Lost
                    } else {
                        Attempt::Rejected
                    });
                }
                RangeCheck::Fits => {}
            }
            if additions < settings::ADDITIONS && self.add_to(rod, &mut start) {
                additions += 1;
                continue;
            }
            let unchecked = self.is_unchecked(&trial, course);
            let fraction = self.descend(rod, (&start, &trial), unchecked, course.last_turn);
            let shortened = fraction.is_none_or(|fraction| fraction < 1.0);
            if is_newton && shortened && self.was_unstable(rod, (&start, &trial), fraction) {
                return Ok(Attempt::Lost);
            }
            let Some(fraction) = fraction else {
                self.return_to(rod, &start);
                return Ok(Attempt::Rejected);
            };
            let (changed, drift) = (
                self.has_changed(&start),
                trial.turn + self.reaction_change(&start),
            );
            let (stretch, removed) = (
                self.stretch(rod, &start.sites),
                fraction * trial.linear.share,
            );
            return Ok(Attempt::Accepted(Box::new(Step {
                trial,
                removed,
                changed,
                stretch,
                drift,
            })));
        }
    }

    /// Counts a saddle with the given energy (J), which the rod will leave. Returns an error if
    /// `settings::SADDLES` saddles were left since the one with the least energy. The next step has
    /// the given size (rad).
    fn count_saddle(
        &self,
        course: &mut Course,
        energy: f64,
        turn: f64,
    ) -> Result<(), EquilibriumError> {
        // A descent that reaches a saddle with less energy than all others does not move in a
        // cycle.
        if energy < course.lowest - self.rounding_of(energy) {
            (course.lowest, course.saddles) = (energy, 0);
        }
        if course.saddles == settings::SADDLES {
            let negative = self.found.inertia.negative;
            let unstable = EquilibriumError::Unstable { negative };
            // An equilibrium without negative directions is neutral: the search has not converged.
            return Err(if negative > 0 {
                unstable
            } else {
                self.not_found(turn)
            });
        }
        course.saddles += 1;
        Ok(())
    }

    /// Whether the rod was unstable at the start of a step, of which it has moved by a fraction. An
    /// unstable rod returns to the start.
    fn was_unstable(
        &mut self,
        rod: &mut Rod,
        (start, trial): (&Start, &Trial),
        fraction: Option<f64>,
    ) -> bool {
        self.return_to(rod, start);
        let unstable = self.is_unstable(&trial.linear);
        if !unstable && let Some(fraction) = fraction {
            self.move_by(rod, start, trial, fraction);
        }
        unstable
    }

    /// Whether the linear rod is unstable in a direction that the supports permit.
    fn is_unstable(&self, linear: &Linear) -> bool {
        self.inertia_of(linear, true).negative > 0
    }

    /// Tests a tangent. A straight rod is bent first. In a search for a stable equilibrium, a
    /// tangent that is negative in a permitted direction needs a shift. In a search for an unstable
    /// one, a larger increase of the number of negative directions means that a step has left the
    /// equilibrium. In contact, the inertia is tested here only in a descent. Newton's method tests
    /// it after a step that is too long or that the line search shortens, and at the equilibrium.
    fn test_tangent(
        &mut self,
        rod: &mut Rod,
        course: &mut Course,
        start: &Start,
        linear: &Linear,
    ) -> Option<Attempt> {
        let shift = linear.factors.shift;
        let inertia = self
            .tests_inertia(course)
            .then(|| self.inertia_of(linear, true));
        if let Some(inertia) = inertia.filter(|inertia| shift == 0.0 || inertia.negative > 0) {
            self.found.inertia = inertia;
        }
        if !course.bowed
            && shift == 0.0
            && let Some(missing) = self.missing_along_straight(linear)
        {
            course.bowed = true;
            self.bow(rod, start, linear, missing);
            return Some(Attempt::Moved);
        }
        let negative = inertia?.negative;
        if self.stable {
            return (negative > 0).then_some(Attempt::Rejected);
        }
        let first = *course.negative.get_or_insert(negative);
        (negative > first + settings::PASSED).then_some(Attempt::Lost)
    }

    /// Finds a share of the step that fits, and moves the rod. A share fits if its contact problem
    /// is solved, its motion is in range, and the rod satisfies its conditions after the
    /// corrections. Let f be the factor by which the motion may be longer. A share that does not
    /// fit is multiplied by 0.9 f, at least 0.25 and at most 0.9. A share of a rod with contacts
    /// that fits with f of at least 2 is multiplied by 0.9 f, at most 4, until it is one or the
    /// next one does not fit. The last share that fits is taken.
    fn fit(
        &mut self,
        rod: &mut Rod,
        start: &mut Start,
        trial: &mut Trial,
        searched: &mut bool,
    ) -> RangeCheck {
        let (before, mut fitting) = (deepest(&start.candidates), None::<Fitting>);
        let (mut failures, mut last) = (0, f64::INFINITY);
        for number in 0..=settings::SHORTENINGS {
            if number > 0 {
                let share = trial.linear.share;
                let guess = fitting
                    .as_ref()
                    .map(|known| (&known.corrected[..], share / known.share));
                self.solve_trial(trial, start, guess);
            }
            // The rod moves within the largest rotation, so that the test of obstacles sees a shape
            // in this range.
            let within = f64::min(1.0, settings::LARGEST_TURN / trial.turn);
            self.move_by(rod, start, trial, within);
            // Factor by which the step may be longer.
            let mut factor = (settings::LARGEST_TURN / trial.turn)
                .min(within * self.safe_step_factor(rod, start));
            if factor < 1.0 && !std::mem::replace(searched, true) {
                let reach = start.line.places.iter().zip(&self.line.places);
                let reach = reach
                    .map(|(a, b)| (b.position - a.position).norm())
                    .fold(0.0, f64::max);
                self.return_to(rod, start);
                if self.add_candidates(rod, reach) {
                    start.candidates.clone_from(&self.candidates);
                    return RangeCheck::Found;
                }
            }
            if !trial.solved {
                factor = factor.min(0.0);
            }
            let uncorrected = trial.contacts.clone();
            // With obstacles, chords follow a shorter step without a shift. They return the rod to
            // its conditions.
            let chords = trial.linear.factors.shift == 0.0 && !self.obstacles.contacts.is_empty();
            let short = chords && trial.turn < settings::CHORD_TURN;
            if factor >= 1.0 && !short {
                self.correct(rod, start, trial);
                // The linear rod does not hold for this share if the corrections leave a
                // penetration or pass an obstacle.
                let permitted =
                    settings::PERMITTED * self.length + before * (1.0 - 0.5 * trial.linear.share);
                if deepest(&self.candidates) > permitted || self.safe_step_factor(rod, start) < 1.0
                {
                    factor = 0.0;
                }
            }
            let share = trial.linear.share;
            if factor >= 1.0 {
                if share == 1.0 || factor < 2.0 || trial.contacts.is_empty() {
                    return RangeCheck::Fits;
                }
                fitting = Some(Fitting {
                    uncorrected,
                    corrected: trial.contacts.clone(),
                    share,
                });
                trial.linear.share = (share * (0.9 * factor).min(4.0)).min(1.0);
            } else if fitting.is_some() || failures == settings::FAILURES {
                break;
            } else {
                // A step to another solution does not become shorter with the share.
                failures += usize::from(!trial.solved || number > 0 && trial.turn > 0.9 * last);
                last = trial.turn;
                trial.linear.share = share * (0.9 * factor).clamp(0.25, 0.9);
            }
        }
        let Some(Fitting {
            uncorrected, share, ..
        }) = fitting
        else {
            return RangeCheck::Misses;
        };
        trial.linear.share = share;
        self.take_contacts(trial, start, uncorrected);
        self.move_by(rod, start, trial, 1.0);
        self.correct(rod, start, trial);
        RangeCheck::Fits
    }

    /// Adds candidates at which the rod penetrates obstacles after a step, and returns to the
    /// start. Returns whether there are any.
    fn add_to(&mut self, rod: &mut Rod, start: &mut Start) -> bool {
        let known = self.candidates.clone();
        if !self.add_candidates(rod, -settings::ROUNDING * self.length) {
            return false;
        }
        let new = self.candidates.split_off(known.len());
        for ((own, at), from) in self
            .candidates
            .iter()
            .zip(&known)
            .zip(&mut start.candidates)
        {
            if (own.element, own.x) != (at.element, at.x) {
                (from.element, from.x) = (own.element, own.x);
            }
        }
        start.candidates.extend(new);
        self.return_to(rod, start);
        start.candidates.clone_from(&self.candidates);
        true
    }

    /// Whether a step needs no comparison of merits: it converges, its change of the energy is
    /// close to rounding, or an unstable equilibrium is sought. With friction, two shapes may
    /// satisfy the laws in turn.
    fn is_unchecked(&self, trial: &Trial, course: &Course) -> bool {
        let rubs = trial.contacts.iter().any(|at| at.friction > 0.0);
        let small = if rubs {
            TINY_TURN
        } else {
            settings::SMALL_TURN
        };
        let converges = trial.linear.factors.shift == 0.0
            && trial.turn < CLOSE_TURN
            && trial.turn < settings::SLOW * course.last_turn;
        trial.turn < small || !self.stable || converges
    }

    /// Whether the inertia is tested at the start of a step. It is for a rod without contact and in
    /// a descent.
    pub(super) fn tests_inertia(&self, course: &Course) -> bool {
        !self.is_loaded() || course.is_descent()
    }

    /// Whether a step with a shifted tangent and the rotation `turn` (rad), after one with the
    /// rotation `last`, is at a saddle of the energy, or at a neutral equilibrium where rounding
    /// decides. Steps are short with a large shift, too, so that the residual must be small.
    fn is_at_saddle(&self, merit: &Merit, turn: f64, last: f64) -> bool {
        let stagnates = turn < NEAR_SADDLE.0 && turn > settings::SLOW * last;
        let unstable =
            self.found.inertia.negative > 0 && merit.residual < NEAR_SADDLE.1 && stagnates;
        unstable || turn < AT_SADDLE.0 && merit.residual < AT_SADDLE.1
    }
}
