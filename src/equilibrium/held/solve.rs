//! Solution of the contact problem of the linear rod.
//!
//! A semismooth Newton method with a line search solves the laws of all contacts together. If it
//! does not converge, it is repeated from the normal forces that an active set determines
//! ([`super::press`]), from the forces without sliding, and from the present forces. The active set
//! is necessary: 2 of 9 growing shoots that touch in the test `time::obstacles` do not reach their
//! end if this guess is omitted. It is not the first guess, since its forces may be far from the
//! present ones.

use nalgebra::Vector3;

use super::law::Status;
use super::reduced::{ContactStep, Evaluated, LinearContact, Reduced};

/// Number of Newton iterations, and of fractions of a step that are tried in each. The residual
/// must decrease in each step. A comparison with the largest of the last three residuals solves
/// more problems. With it the coil of the test `statics::helix` leaves its branch of equilibria at
/// the curvature 1.16. The fold is at 3.31.
const ITERATIONS: usize = 40;
const FRACTIONS: usize = 4;
/// The iteration ends unless the squared residual decreases by the factor (second) within this
/// number of iterations (first), which include those that increase the proximal compliance. Without
/// this limit the same problems of 3000 random scenes were solved, and the time was 1.2 times as
/// long.
const PROGRESS: (usize, f64) = (8, 0.5);
/// Largest number of times that the normal forces are determined before Newton's method begins
/// again.
const PRESSES: usize = 2;
/// Largest number of steps in which an open contact moves to its place of least gap.
const FOLLOWINGS: usize = 4;
/// Residual of the laws at which the iteration ends, relative to the largest force.
const SOLVED: f64 = 1e-14;
/// Residual below which an iteration that stalls ends.
const STALLED: f64 = 1e-12;
/// Rounding of a place, two units in the last digit of its coordinates, relative to `SOLVED`. A
/// contact that bears almost no force is not solved to a part of this force.
const PLACED: f64 = 0.05;
/// Residual with which the forces are of use. Where rounding hides smaller ones, a second guess may
/// lead to a solution far away.
const USEFUL: f64 = 1e-9;
/// Ratio of the scale of the laws to the stiffness of the rod against a force. Between neighbouring
/// contacts the rod is 1e2 to 1e3 times stiffer. In 24 slow runs of growing shoots the ratio 30
/// needed 0.6 of the time that 1 needed.
const STIFFER: f64 = 30.0;
/// Smallest compliance along the normal, relative to the sum of those in all directions, that is not
/// rounding of positions: a straight rod is rigid along itself. From 1e-3 to 1e-6 the ratio decides
/// nothing.
const ALONG: f64 = 1e-6;
/// Smallest and largest compliance that is added to loaded contacts in the iteration, relative to
/// the inverse of the scale of the laws. It selects the forces closest to the present ones where
/// the rod does not determine them, and does not change the solution.
const PROXIMAL: (f64, f64) = (1e-10, 0.1);
/// Ratio of this compliance to the residual, relative to the largest force.
const DAMPING: f64 = 0.01;
/// Factor by which it increases after a step that does not decrease the residual.
const RAISE: f64 = 30.0;
/// Largest number of further steps after the iteration.
const POLISHES: usize = 3;
/// Smallest relative decrease of the squared residual that a whole step must achieve.
const DECREASE: f64 = 1e-3;

impl Reduced<'_> {
    /// The contacts with the scales of the laws, with or without the displacements of the whole
    /// rod.
    fn scaled(&self, contacts: &[LinearContact], with_rigid: bool) -> Vec<LinearContact> {
        let scaled = |contact: &LinearContact| {
            let own = self
                .compliance
                .fixed_view::<3, 3>(contact.first, contact.first);
            // For a single contact without friction only motions along the normal count. Where a
            // rod is almost unstable and slides, those across it are much larger. Several contacts
            // have scales of the same kind.
            let whole = if contact.friction == 0.0 && contacts.len() == 1 {
                let place = self.start.fixed_rows::<3>(contact.first).into_owned();
                let normal = self.surfaces.gap(contact.obstacle, &place).normal;
                let along = 3.0 * normal.dot(&(own * normal));
                along.abs().max(ALONG * own.trace())
            } else {
                own.trace()
            };
            let compliance = if with_rigid {
                whole
            } else {
                whole - 3.0 * contact.rigid
            };
            LinearContact {
                k: STIFFER * 3.0 / compliance.abs().max(STIFFER * f64::MIN_POSITIVE),
                ..*contact
            }
        };
        contacts.iter().map(scaled).collect()
    }

    /// The contacts with forces and displacements that satisfy the laws, at least to [`USEFUL`];
    /// `None` if they are not found. The present values are the initial guess. Unless it is `near`
    /// the solution, the first step linearises the laws at the start of the step of the rod.
    pub fn solve(&self, contacts: &[LinearContact], near: bool) -> Option<Vec<LinearContact>> {
        // Many contacts of a rod with a free base differ by much smaller displacements than those
        // of the whole rod.
        let rigid = contacts.iter().any(|contact| contact.rigid > 0.0);
        let scales: &[bool] = if rigid { &[true, false] } else { &[true] };
        scales.iter().find_map(|with_rigid| {
            let scaled = self.scaled(contacts, *with_rigid);
            let others = || {
                let (presses, pressed) = self.pressed_guess(&scaled);
                // If no press succeeds, this guess is the present contacts, which near a solution
                // were the first guess.
                if presses == 0 && near {
                    return None;
                }
                let solved = self.newton(pressed.clone());
                let solved = solved.or_else(|| self.newton(self.sticking_guess(pressed, &scaled)?));
                if presses == 0 || near {
                    solved
                } else {
                    solved.or_else(|| self.newton(scaled.clone()))
                }
            };
            self.first_guess(&scaled, near)
                .and_then(|guess| self.newton(guess))
                .or_else(others)
        })
    }

    /// The first initial guess: the present contacts, or those after the first step. `None` if this
    /// step is not finite.
    fn first_guess(&self, contacts: &[LinearContact], near: bool) -> Option<Vec<LinearContact>> {
        // The linear step would ignore the place that a near guess reaches.
        if near {
            return Some(contacts.to_vec());
        }
        Some(Self::moved(
            contacts,
            &self.first_step(contacts, PROXIMAL.0)?,
            1.0,
        ))
    }

    /// The second guess, with the normal forces that an active set determines, and the number of
    /// times that they were found.
    fn pressed_guess(&self, contacts: &[LinearContact]) -> (usize, Vec<LinearContact>) {
        let mut pressed = contacts.to_vec();
        // The second time, the normals are those at the places to which the first forces lead.
        let presses = (0..PRESSES)
            .take_while(|_| self.press(&mut pressed))
            .count();
        (presses, pressed)
    }

    /// The third guess, found from the second: the solution without sliding. Where friction presses
    /// a sliding rod into an obstacle, it may be the only solution. `None` without friction, or if
    /// there is no such solution.
    fn sticking_guess(
        &self,
        pressed: Vec<LinearContact>,
        contacts: &[LinearContact],
    ) -> Option<Vec<LinearContact>> {
        if contacts.iter().all(|at| at.friction == 0.0) {
            return None;
        }
        let mut sticking = pressed;
        // An infinite coefficient times a derivative of zero would not be a number.
        sticking
            .iter_mut()
            .filter(|at| at.friction > 0.0)
            .for_each(|at| at.friction = f64::MAX);
        let mut sticking = self.newton(sticking)?;
        for (at, own) in sticking.iter_mut().zip(contacts) {
            (at.friction, at.k) = (own.friction, own.k);
        }
        Some(sticking)
    }

    /// The largest force, N.
    fn largest(&self, contacts: &[LinearContact]) -> f64 {
        contacts
            .iter()
            .map(|contact| contact.force.norm())
            .fold(self.scale, f64::max)
    }

    /// The largest residual, relative to the largest force or to the rounding of the gap.
    fn relative(&self, contacts: &[LinearContact], all: &[Evaluated]) -> f64 {
        let largest = self.largest(contacts);
        let each = contacts.iter().zip(all).map(|(contact, at)| {
            let size = self.free.fixed_rows::<3>(contact.first).norm();
            at.squares(contact).sqrt() / (largest + PLACED * contact.k * size)
        });
        each.fold(0.0, f64::max)
    }

    /// Evaluates all contacts after those that are open have moved to their places of least gap.
    fn follow(&self, contacts: &mut [LinearContact]) -> Vec<Evaluated> {
        let mut all = self.evaluate_all(contacts);
        let widest = contacts
            .iter()
            .filter_map(|at| at.range)
            .map(|[from, to]| to - from)
            .fold(0.0, f64::max);
        for _ in 0..FOLLOWINGS {
            let mut largest = 0.0_f64;
            for (contact, at) in contacts
                .iter_mut()
                .zip(&all)
                .filter(|(_, at)| at.law.status == Status::Open)
            {
                if let (Some(slide), Some([from, to])) = (&at.slide, contact.range) {
                    let travel = (contact.travel - slide.excess).clamp(from, to);
                    largest = largest.max((travel - contact.travel).abs());
                    contact.travel = travel;
                }
            }
            if largest <= 1e-3 * widest {
                break;
            }
            all = self.evaluate_all(contacts);
        }
        all
    }

    /// The contacts after a fraction of a step.
    fn moved(
        contacts: &[LinearContact],
        steps: &[ContactStep],
        fraction: f64,
    ) -> Vec<LinearContact> {
        let mut moved = contacts.to_vec();
        for (contact, step) in moved.iter_mut().zip(steps) {
            contact.advance(*step, fraction);
        }
        moved
    }

    /// Newton's method. A step that does not decrease the residual increases the proximal
    /// compliance. At its largest value, up to two such steps are taken. Returns the contacts if
    /// the laws are satisfied, at least to [`USEFUL`].
    fn newton(&self, mut contacts: Vec<LinearContact>) -> Option<Vec<LinearContact>> {
        let mut all = self.follow(&mut contacts);
        let mut merit = Self::merit(&contacts, &all);
        let (mut extra, mut stalls) = (0.0_f64, 0);
        let mut merits = Vec::with_capacity(ITERATIONS);
        for _ in 0..ITERATIONS {
            let (largest, size) = (self.largest(&contacts), merit.sqrt());
            if self.relative(&contacts, &all) <= SOLVED {
                return Some(self.polished(contacts));
            }
            merits.push(merit);
            if merits
                .iter()
                .rev()
                .nth(PROGRESS.0)
                .is_some_and(|before| merit > PROGRESS.1 * before)
            {
                break;
            }
            let proximal = (DAMPING * size / size.max(largest))
                .max(PROXIMAL.0)
                .max(extra);
            let steps = self.step(&contacts, &all, proximal)?;
            let mut best: Option<(f64, Vec<LinearContact>, Vec<Evaluated>)> = None;
            let falls = (0..FRACTIONS).any(|halvings| {
                let fraction = 0.5_f64.powi(halvings as i32);
                let trial = Self::moved(&contacts, &steps, fraction);
                let at = self.evaluate_all(&trial);
                let value = Self::merit(&trial, &at);
                if best.as_ref().is_none_or(|(least, ..)| value < *least) {
                    best = Some((value, trial, at));
                }
                value < merit * (1.0 - DECREASE * fraction)
            });
            let (value, trial, at) = best?;
            if value >= 0.25 * merit && self.relative(&trial, &at) <= STALLED {
                return Some(self.polished(trial));
            }
            if !falls {
                if proximal < PROXIMAL.1 {
                    extra = (RAISE * proximal).min(PROXIMAL.1);
                    continue;
                }
                stalls += 1;
                if stalls > 2 {
                    break;
                }
            }
            extra /= RAISE;
            (contacts, all) = (trial, at);
            if all
                .iter()
                .any(|at| at.law.status == Status::Open && at.slide.is_some())
            {
                all = self.follow(&mut contacts);
            }
            merit = Self::merit(&contacts, &all);
        }
        (self.relative(&contacts, &all) <= USEFUL).then(|| self.polished(contacts))
    }

    /// Improves the solution by further steps as long as the contacts keep their states and the
    /// largest residual over its scale, a length, decreases: rounding of the force at a stiff
    /// contact may hide the gap at a compliant one. The scale becomes the stiffness of the rod,
    /// since it multiplies the rounding of places.
    fn polished(&self, mut contacts: Vec<LinearContact>) -> Vec<LinearContact> {
        contacts.iter_mut().for_each(|contact| contact.k /= STIFFER);
        let mut all = self.evaluate_all(&contacts);
        let length = |contacts: &[LinearContact], all: &[Evaluated]| {
            let each = contacts
                .iter()
                .zip(all)
                .map(|(contact, at)| at.law.residual.norm() / contact.k);
            each.fold(0.0, f64::max)
        };
        let mut size = length(&contacts, &all);
        for _ in 0..POLISHES {
            let Some(steps) = self.step(&contacts, &all, PROXIMAL.0) else {
                break;
            };
            let trial = Self::moved(&contacts, &steps, 1.0);
            let at = self.evaluate_all(&trial);
            let keeps = all
                .iter()
                .zip(&at)
                .all(|(a, b)| a.law.status == b.law.status);
            let next = length(&trial, &at);
            if !(keeps && next < 0.5 * size) {
                break;
            }
            (contacts, all, size) = (trial, at, next);
        }
        // An open contact has no force.
        for (contact, at) in contacts.iter_mut().zip(&all) {
            contact.status = at.law.status;
            if contact.status == Status::Open {
                contact.force = Vector3::zeros();
            }
        }
        contacts
    }
}
