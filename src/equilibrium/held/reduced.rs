//! The frictional contact problem of a rod that responds linearly to the forces at its candidates.
//!
//! The unknowns are the force at each candidate and, where the candidate is the place of least gap, its displacement ξ
//! along the rod. Obstacles are exact: gap, normal and slip are those at the place that the linear rod reaches. A
//! semismooth Newton method with a line search solves the laws of all contacts together.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::law::{Gap, Law, Smoothing, Status};

/// Number of Newton iterations, and of halvings in each.
const ITERATIONS: usize = 40;
const HALVINGS: usize = 4;
/// Number of steps in which an open contact moves to its place of least gap.
const FOLLOWINGS: usize = 4;
/// Residual of the laws at which the iteration ends, relative to the largest force.
const SOLVED: f64 = 1e-14;
/// Residual below which an iteration that stalls ends.
const STALLED: f64 = 1e-12;
/// Residual with which the forces are of use.
const USEFUL: f64 = 1e-7;
/// Compliance that is added to loaded contacts in the iteration, relative to that of the contact. It selects the
/// forces closest to the present ones where the rod does not determine them, and does not change the solution.
const PROXIMAL: f64 = 1e-10;

const DAMPING: f64 = 0.01;
/// Factor by which the proximal compliance increases after a step that fails, and its largest value.
const RAISE: f64 = 30.0;
const LARGEST_PROXIMAL: f64 = 0.1;
/// Smoothing at the start and at the end of the central path, relative to the largest force; residual, relative to the
/// smoothing, at which it decreases, and its ratio then.
const PATH: (f64, f64, f64, f64) = (0.1, 1e-9, 0.5, 0.2);
/// Largest number of steps along the path.
const PATH_STEPS: usize = 80;

/// Obstacles.
pub(super) trait Surfaces {
    /// The gap at a place (m) to an obstacle that is not displaced.
    fn gap(&self, obstacle: usize, place: &Vector3<f64>) -> Gap;
}

/// A candidate in the linear rod.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact {
    pub obstacle: usize,
    /// Coefficient of friction.
    pub friction: f64,
    /// Force on the rod, N.
    pub force: Vector3<f64>,
    /// Displacement of the candidate along the rod, m.
    pub shift: f64,
    /// The interval of this displacement, m, if the candidate is the place of least gap.
    pub range: Option<[f64; 2]>,
    /// Derivative of the tangent along the rod, 1/m.
    pub bend: Vector3<f64>,
    /// Second derivative of the gap along the rod, 1/m, if the candidate is the place of least gap.
    pub curve: f64,
    /// Gap in contact, m; negative in a step that removes a part of a penetration.
    pub clearance: f64,
    /// The place that the candidate has without slip, m, and its derivative by `shift`.
    pub anchor: (Vector3<f64>, Vector3<f64>),
    /// Number of its first coordinate: three of the place, followed by three of the tangent if it has a range.
    pub first: usize,
    /// Force that determines the scale of the law, N/m.
    pub k: f64,
    pub status: Status,
}

impl Contact {
    /// The reactions that are conjugate to the coordinates.
    fn load(&self, reactions: &mut DVector<f64>) {
        reactions.fixed_rows_mut::<3>(self.first).copy_from(&self.force);
        if self.range.is_some() {
            reactions.fixed_rows_mut::<3>(self.first + 3).copy_from(&(self.force * self.shift));
        }
    }
}

/// The law of a contact in a configuration of the linear rod.
pub(super) struct Evaluated {
    law: Law,
    /// The tangent at the place.
    tangent: Vector3<f64>,
    /// Displacement to the place of least gap, m, with its derivatives by the place, the tangent and the shift.
    pub slide: Option<(f64, Vector3<f64>, Vector3<f64>, f64)>,
}

/// The problem: coordinates without the forces, and their displacements per force.
pub(super) struct Reduced<'a> {
    pub surfaces: &'a dyn Surfaces,
    pub compliance: &'a DMatrix<f64>,
    /// The coordinates for the forces zero.
    pub free: DVector<f64>,
    /// Magnitude of the force in the rod, N.
    pub scale: f64,
}

impl Reduced<'_> {
    /// The reactions of the contacts.
    pub fn reactions(&self, contacts: &[Contact]) -> DVector<f64> {
        let mut reactions = DVector::zeros(self.free.len());
        contacts.iter().for_each(|contact| contact.load(&mut reactions));
        reactions
    }

    /// The coordinates for the present forces.
    pub fn coordinates(&self, contacts: &[Contact]) -> DVector<f64> {
        &self.free + self.compliance * self.reactions(contacts)
    }

    /// The place and the tangent of a contact, for given coordinates.
    pub fn place(contact: &Contact, coordinates: &DVector<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let place: Vector3<f64> = coordinates.fixed_rows::<3>(contact.first).into_owned();
        if contact.range.is_none() {
            return (place, Vector3::zeros());
        }
        let tangent: Vector3<f64> = coordinates.fixed_rows::<3>(contact.first + 3).into_owned();
        let shift = contact.shift;
        (place + tangent * shift + contact.bend * (0.5 * shift * shift), tangent + contact.bend * shift)
    }

    fn evaluate(&self, contact: &Contact, coordinates: &DVector<f64>, smoothing: Smoothing) -> Evaluated {
        let (place, tangent) = Self::place(contact, coordinates);
        let mut gap = self.surfaces.gap(contact.obstacle, &place);
        gap.value -= contact.clearance;
        let displacement = place - contact.anchor.0 - contact.anchor.1 * contact.shift;
        let law = Law::new(&gap, &contact.force, &displacement, (contact.friction, contact.k), smoothing);
        let slide = contact.range.map(|[from, to]| {
            // The slope over its derivative at the start is the displacement to the place of least gap.
            let slope = gap.normal.dot(&tangent);
            let least = (contact.shift - slope / contact.curve).clamp(from, to);
            let moved = contact.shift - least;
            if least <= from || least >= to {
                return (moved, Vector3::zeros(), Vector3::zeros(), 1.0);
            }
            let turned = gap.curvature * tangent / contact.curve;
            (
                moved,
                turned,
                gap.normal / contact.curve,
                turned.dot(&tangent) + gap.normal.dot(&contact.bend) / contact.curve,
            )
        });
        Evaluated { law, tangent, slide }
    }

    /// The sum of the squares of the residuals, N².
    fn merit(contacts: &[Contact], all: &[Evaluated]) -> f64 {
        let each = contacts.iter().zip(all).map(|(contact, at)| {
            let slide = at.slide.filter(|_| at.law.status != Status::Open);
            at.law.residual.norm_squared() + slide.map_or(0.0, |(moved, ..)| (contact.k * moved).powi(2))
        });
        each.sum()
    }

    fn evaluate_all(&self, contacts: &[Contact], smoothing: Smoothing) -> Vec<Evaluated> {
        let coordinates = self.coordinates(contacts);
        contacts.iter().map(|contact| self.evaluate(contact, &coordinates, smoothing)).collect()
    }

    /// Sets the scales of the laws.
    pub fn scale(&self, contacts: &mut [Contact]) {
        for contact in contacts {
            let own = self.compliance.fixed_view::<3, 3>(contact.first, contact.first);
            contact.k = 3.0 / own.trace().abs().max(f64::MIN_POSITIVE);
        }
    }

    /// Solves for the forces and displacements of the contacts, from the present ones as initial guess. Returns whether
    /// the laws are satisfied.
    pub fn solve(&self, contacts: &mut Vec<Contact>) -> bool {
        self.scale(contacts);
        let start = contacts.clone();
        if self.newton(contacts) {
            trace!("RED newton");
            return true;
        }
        contacts.clone_from(&start);
        let mut best = contacts.clone();
        // Nearly flat contacts respond strongly to their displacement along the rod. Forces and displacements are then
        // solved for in turn.
        for _ in 0..FOLLOWINGS {
            let ranges: Vec<_> = contacts.iter().map(|at| at.range).collect();
            contacts.iter_mut().for_each(|at| at.range = at.range.map(|_| [at.shift, at.shift]));
            let solved = self.follow_path(contacts) && self.newton(contacts);
            contacts.iter_mut().zip(ranges).for_each(|(contact, range)| contact.range = range);
            trace!("RED path {solved}");
            if !solved {
                break;
            }
            best.clone_from(contacts);
            if self.newton(contacts) {
                trace!("RED follow");
                return true;
            }
            contacts.clone_from(&best);
            let mut moves = 0.0_f64;
            for (contact, at) in contacts.iter_mut().zip(&self.evaluate_all(&best, Smoothing::default())) {
                if let (Some((moved, ..)), Some([from, to])) = (at.slide, contact.range) {
                    let shift = (contact.shift - moved).clamp(from, to);
                    moves = moves.max((shift - contact.shift).abs());
                    contact.shift = shift;
                }
            }
            if moves <= f64::EPSILON.sqrt() {
                break;
            }
        }
        trace!("RED fail n={}", contacts.len());
        // An inexact solution is of use, since the search for the shape decides about the step.
        *contacts = best;
        false
    }

    /// Follows the central path of the smoothed laws from large forces to the exact laws.
    fn follow_path(&self, contacts: &mut Vec<Contact>) -> bool {
        let largest = contacts.iter().map(|contact| contact.force.norm()).fold(self.scale, f64::max);
        let mut smoothing = Smoothing { force: PATH.0 * largest, ratio: 0.5 };
        let (mut extra, mut steps) = (PROXIMAL, 0);
        while smoothing.force > PATH.1 * largest {
            let all = self.evaluate_all(contacts, smoothing);
            let merit = Self::merit(contacts, &all);
            let Some(step) = self.step(contacts, &all, extra) else { return false };
            let mut fraction = 1.0;
            let falls = loop {
                let trial = Self::moved(contacts, &step, fraction);
                let value = Self::merit(&trial, &self.evaluate_all(&trial, smoothing));
                if value < merit * (1.0 - 1e-3 * fraction) || value.sqrt() <= PATH.2 * smoothing.force {
                    *contacts = trial;
                    if value.sqrt() <= PATH.2 * smoothing.force {
                        smoothing.force *= PATH.3;
                        smoothing.ratio *= PATH.3;
                    }
                    break true;
                }
                if fraction < 1e-2 {
                    break false;
                }
                fraction *= 0.5;
            };
            extra = if falls { (extra / RAISE).max(PROXIMAL) } else { extra * RAISE };
            steps += 1;
            if steps > PATH_STEPS || extra > LARGEST_PROXIMAL {
                trace!(
                    "RED path ends at {:.1e} of {largest:.1e} merit {:.1e} steps {steps} extra {extra:.1e}",
                    smoothing.force,
                    merit.sqrt()
                );
                return false;
            }
        }
        true
    }

    /// The contacts after a fraction of a step.
    fn moved(contacts: &[Contact], steps: &[(Vector3<f64>, f64)], fraction: f64) -> Vec<Contact> {
        let mut moved = contacts.to_vec();
        for (contact, (force, shift)) in moved.iter_mut().zip(steps) {
            contact.force += force * fraction;
            if let Some([from, to]) = contact.range {
                contact.shift = (contact.shift + shift * fraction).clamp(from, to);
            }
        }
        moved
    }

    /// Evaluates all contacts after those that are open have moved to their places of least gap.
    fn follow(&self, contacts: &mut [Contact]) -> Vec<Evaluated> {
        let mut all = self.evaluate_all(contacts, Smoothing::default());
        for _ in 0..FOLLOWINGS {
            let mut moves = false;
            for (contact, at) in contacts.iter_mut().zip(&all) {
                if let Some((moved, ..)) = at.slide.filter(|_| at.law.status == Status::Open)
                    && let Some([from, to]) = contact.range
                {
                    let before = contact.shift;
                    contact.shift = (contact.shift - moved).clamp(from, to);
                    moves |= (contact.shift - before).abs() > 1e-3 * (to - from);
                }
            }
            if !moves {
                break;
            }
            all = self.evaluate_all(contacts, Smoothing::default());
        }
        all
    }

    /// Newton's method. Where a step does not decrease the residual, the proximal compliance increases.
    fn newton(&self, contacts: &mut Vec<Contact>) -> bool {
        let mut all = self.follow(contacts);
        let mut merit = Self::merit(contacts, &all);
        let (mut extra, mut stalls) = (0.0_f64, 0);
        for _ in 0..ITERATIONS {
            let largest = contacts.iter().map(|contact| contact.force.norm()).fold(self.scale, f64::max);
            let size = merit.sqrt();
            if size <= SOLVED * largest {
                return self.finish(contacts, &all);
            }
            let proximal = (DAMPING * size / size.max(largest)).max(PROXIMAL).max(extra);
            let Some(steps) = self.step(contacts, &all, proximal) else { return false };
            let mut fraction = 1.0;
            let mut best: Option<(f64, Vec<Contact>, Vec<Evaluated>)> = None;
            let mut falls = false;
            for _ in 0..HALVINGS {
                let trial = Self::moved(contacts, &steps, fraction);
                let at = self.evaluate_all(&trial, Smoothing::default());
                let value = Self::merit(&trial, &at);
                falls = value < merit * (1.0 - 1e-3 * fraction);
                if best.as_ref().is_none_or(|(least, ..)| value < *least) {
                    best = Some((value, trial, at));
                }
                if falls {
                    break;
                }
                fraction *= 0.5;
            }
            let Some((value, trial, at)) = best else { return false };
            trace!(
                "      newton merit {:.2e} -> {:.2e} fraction {fraction:.2e} prox {proximal:.1e} largest {largest:.2e} states {}",
                merit.sqrt(),
                value.sqrt(),
                at.iter()
                    .zip(&trial)
                    .map(|(a, c)| format!(
                        "{}{}",
                        match a.law.status {
                            Status::Open => 'o',
                            Status::Sticking => 's',
                            Status::Sliding => 'S',
                        },
                        if c.range.is_some() { "^" } else { "" }
                    ))
                    .collect::<String>()
            );
            if value.sqrt() <= STALLED * largest && value >= 0.25 * merit {
                (*contacts, all) = (trial, at);
                return self.finish(contacts, &all);
            }
            if !falls {
                if proximal < LARGEST_PROXIMAL {
                    extra = RAISE * proximal;
                    continue;
                }
                stalls += 1;
                if stalls > 2 {
                    return false;
                }
            }
            extra /= RAISE;
            *contacts = trial;
            let open = at.iter().any(|at| at.law.status == Status::Open && at.slide.is_some());
            (all, merit) = if open {
                let all = self.follow(contacts);
                let merit = Self::merit(contacts, &all);
                (all, merit)
            } else {
                (at, value)
            };
        }
        let largest = contacts.iter().map(|contact| contact.force.norm()).fold(self.scale, f64::max);
        merit.sqrt() <= USEFUL * largest && self.finish(contacts, &all)
    }

    /// Records the states, and removes the force of open contacts.
    fn finish(&self, contacts: &mut [Contact], all: &[Evaluated]) -> bool {
        for (contact, at) in contacts.iter_mut().zip(all) {
            contact.status = at.law.status;
            if contact.status == Status::Open {
                contact.force = Vector3::zeros();
            }
        }
        true
    }

    /// One Newton step: changes of the force and of the shift of every contact.
    fn step(&self, contacts: &[Contact], all: &[Evaluated], proximal: f64) -> Option<Vec<(Vector3<f64>, f64)>> {
        let zero = Vector3::zeros();
        let mut steps: Vec<(Vector3<f64>, f64)> =
            all.iter().map(|at| (zero, at.slide.map_or(0.0, |(moved, ..)| -moved))).collect();
        let active: Vec<usize> =
            (0..contacts.len()).filter(|i| all[*i].law.active || contacts[*i].force != zero).collect();
        let sizes = active.iter().map(|i| 3 + usize::from(contacts[*i].range.is_some()));
        let mut at = vec![0];
        for size in sizes {
            at.push(at[at.len() - 1] + size);
        }
        let n = at[active.len()];
        let (mut matrix, mut rhs) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        for (a, &i) in active.iter().enumerate() {
            let (contact, Evaluated { law, tangent, slide, .. }) = (&contacts[i], &all[i]);
            let (row, loaded) = (at[a], law.active);
            // Derivatives by the coordinates of the contact: place, and tangent.
            let by_tangent = law.by_place * contact.shift;
            let proximal = if loaded { proximal } else { 0.0 };
            let mut own = matrix.fixed_view_mut::<3, 3>(row, row);
            own += law.by_force + Matrix3::identity() * proximal;
            rhs.fixed_rows_mut::<3>(row).copy_from(&-law.residual);
            let mut slide_by = None;
            if let Some((moved, by_place, slide_tangent, by_shift)) = slide {
                // The scale of the residual is that of the forces.
                let by_shift_of_law = law.by_place * tangent + law.by_anchor * contact.anchor.1;
                let mut column = matrix.fixed_view_mut::<3, 1>(row, row + 3);
                column += by_shift_of_law;
                let scale = contact.k;
                rhs[row + 3] = -moved * scale;
                matrix[(row + 3, row + 3)] += by_shift * scale;
                let by_place = by_place * scale;
                slide_by = Some((by_place, slide_tangent * scale + by_place * contact.shift));
            }
            if !loaded && slide_by.is_none() {
                continue;
            }
            for (b, &j) in active.iter().enumerate() {
                let (other, column) = (&contacts[j], at[b]);
                let block = |x: usize, y: usize| -> Matrix3<f64> {
                    self.compliance.fixed_view::<3, 3>(contact.first + x, other.first + y).into_owned()
                };
                // Displacements of the place by the force and by the couple of the other contact, and of the tangent.
                let mut place_force = block(0, 0);
                let mut place_shift = Vector3::zeros();
                if other.range.is_some() {
                    let couple = block(0, 3);
                    place_force += couple * other.shift;
                    place_shift = couple * other.force;
                }
                let (mut tangent_force, mut tangent_shift) = (Matrix3::zeros(), Vector3::zeros());
                if contact.range.is_some() {
                    tangent_force = block(3, 0);
                    if other.range.is_some() {
                        let couple = block(3, 3);
                        tangent_force += couple * other.shift;
                        tangent_shift = couple * other.force;
                    }
                }
                if loaded {
                    let mut view = matrix.fixed_view_mut::<3, 3>(row, column);
                    view += law.by_place * place_force + by_tangent * tangent_force;
                }
                if other.range.is_some() && loaded {
                    let mut view = matrix.fixed_view_mut::<3, 1>(row, column + 3);
                    view += law.by_place * place_shift + by_tangent * tangent_shift;
                }
                if let Some((by_place, by_tangent)) = slide_by {
                    let forces = place_force.tr_mul(&by_place) + tangent_force.tr_mul(&by_tangent);
                    for c in 0..3 {
                        matrix[(row + 3, column + c)] += forces[c];
                    }
                    if other.range.is_some() {
                        matrix[(row + 3, column + 3)] += by_place.dot(&place_shift) + by_tangent.dot(&tangent_shift);
                    }
                }
            }
        }
        if n > 0 {
            let solution = matrix.lu().solve(&rhs)?;
            if solution.iter().any(|value| !value.is_finite()) {
                return None;
            }
            for (a, &i) in active.iter().enumerate() {
                steps[i].0 = solution.fixed_rows::<3>(at[a]).into_owned();
                if contacts[i].range.is_some() {
                    steps[i].1 = solution[at[a] + 3];
                }
            }
        }
        Some(steps)
    }
}

#[cfg(test)]
mod tests;
