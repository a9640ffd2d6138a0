//! The frictional contact problem of a rod that responds linearly to the forces at its candidates.
//!
//! The unknowns are the force at each candidate and, where the candidate is the place of least gap,
//! its displacement ξ along the rod. Obstacles are exact: gap, normal and slip are those at the
//! place that the linear rod reaches. The method that solves the laws of all contacts together is
//! in [`super::solve`].

use faer::linalg::solvers::Solve;
use faer::{MatMut, MatRef};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::law::{Gap, Law, Status};

/// Obstacles.
pub(super) trait Surfaces {
    /// The gap at a place (m) to an obstacle that is not displaced.
    fn gap(&self, obstacle: usize, place: &Vector3<f64>) -> Gap;
}

/// A candidate in the linear rod.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinearContact {
    pub obstacle: usize,
    /// Coefficient of friction.
    pub friction: f64,
    /// Force on the rod, N.
    pub force: Vector3<f64>,
    /// Displacement of the candidate along the rod, m.
    pub travel: f64,
    /// The interval of this displacement, m, if the candidate is the place of least gap.
    pub range: Option<[f64; 2]>,
    /// Derivative of the tangent along the rod, 1/m.
    pub bend: Vector3<f64>,
    /// Second derivative of the gap along the rod, 1/m, if the candidate is the place of least gap.
    pub curve: f64,
    /// Derivative of the slope along the rod by the couple about the axis in which the rod bends
    /// from the obstacle, 1/(N m), at least zero; zero unless the candidate is the place of least
    /// gap.
    pub turn_by_couple: f64,
    /// Gap in contact, m; negative in a step that removes a part of a penetration.
    pub clearance: f64,
    /// The place that the candidate has without slip, m, and its derivative by `travel`.
    pub anchor: (Vector3<f64>, Vector3<f64>),
    /// Number of its first coordinate: three of the place, followed by three of the tangent if it
    /// has a range.
    pub first: usize,
    /// Compliance by displacements of the whole rod, m/N; zero unless the base is free.
    pub rigid: f64,
    /// Scale k of the law, N/m.
    pub k: f64,
    pub status: Status,
}

/// Changes of the force (N) of a contact and of its displacement along the rod (m) in a step of the
/// iteration.
pub(super) type ContactStep = (Vector3<f64>, f64);

impl LinearContact {
    /// Adds a fraction of a step. The derivative of the slope by the displacement depends on the
    /// force, and the step is for the force before it. The displacement is scaled so that the slope
    /// is the one that the step predicts.
    pub fn advance(&mut self, (force, travel): ContactStep, fraction: f64) {
        let before = self.slope_by_travel();
        self.force += force * fraction;
        if let Some([from, to]) = self.range {
            self.travel = (self.travel + travel * fraction * (before / self.slope_by_travel()))
                .clamp(from, to);
        }
    }

    /// An estimate of the derivative of the slope by the displacement, 1/m: that of the gap, and
    /// the rotation by the couple of the displaced force. With the magnitude of the force it is
    /// positive. The slope of the solution is zero for any estimate.
    fn slope_by_travel(&self) -> f64 {
        self.curve + self.turn_by_couple * self.force.norm()
    }

    /// The reactions that are conjugate to the coordinates.
    pub fn load(&self, reactions: &mut DVector<f64>) {
        reactions
            .fixed_rows_mut::<3>(self.first)
            .copy_from(&self.force);
        if self.range.is_some() {
            reactions
                .fixed_rows_mut::<3>(self.first + 3)
                .copy_from(&(self.force * self.travel));
        }
    }
}

/// The law of a contact in a configuration of the linear rod.
pub(super) struct Evaluated {
    pub law: Law,
    /// The tangent at the place.
    tangent: Vector3<f64>,
    /// The condition of least gap, if the contact moves along the rod.
    pub slide: Option<Slide>,
}

/// The condition of least gap at a contact, and its derivatives.
pub(super) struct Slide {
    /// Displacement from the place of least gap, m.
    pub excess: f64,
    by_force: Vector3<f64>,
    by_place: Vector3<f64>,
    by_tangent: Vector3<f64>,
    by_travel: f64,
}

impl Evaluated {
    /// The sum of the squares of the residuals of the law and of the place of least gap, N². An
    /// open contact may be anywhere.
    pub fn squares(&self, contact: &LinearContact) -> f64 {
        let slide = self
            .slide
            .as_ref()
            .filter(|_| self.law.status != Status::Open);
        self.law.residual.norm_squared()
            + slide.map_or(0.0, |slide| (contact.k * slide.excess).powi(2))
    }
}

/// The problem: coordinates without the forces, and their displacements per force.
pub(super) struct Reduced<'a> {
    pub surfaces: &'a dyn Surfaces,
    pub compliance: &'a DMatrix<f64>,
    /// The coordinates for the present reactions.
    pub free: DVector<f64>,
    /// The present reactions. Displacements by the changes since then have less rounding than those
    /// by all of a force, which is large where the rod is almost unstable.
    pub present: DVector<f64>,
    /// The coordinates at the start of the step of the rod.
    pub start: DVector<f64>,
    /// Magnitude of the force in the rod, N.
    pub scale: f64,
}

impl Reduced<'_> {
    /// The reactions of the contacts.
    pub fn reactions(&self, contacts: &[LinearContact]) -> DVector<f64> {
        let mut reactions = DVector::zeros(self.free.len());
        contacts
            .iter()
            .for_each(|contact| contact.load(&mut reactions));
        reactions
    }

    /// The coordinates for the forces and displacements of the contacts.
    pub fn coordinates(&self, contacts: &[LinearContact]) -> DVector<f64> {
        &self.free + self.compliance * (self.reactions(contacts) - &self.present)
    }

    /// The place and the tangent of a contact, for given coordinates.
    pub fn place(
        contact: &LinearContact,
        coordinates: &DVector<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let place: Vector3<f64> = coordinates.fixed_rows::<3>(contact.first).into_owned();
        if contact.range.is_none() {
            return (place, Vector3::zeros());
        }
        let tangent: Vector3<f64> = coordinates.fixed_rows::<3>(contact.first + 3).into_owned();
        let travel = contact.travel;
        (
            place + tangent * travel + contact.bend * (0.5 * travel * travel),
            tangent + contact.bend * travel,
        )
    }

    fn evaluate(&self, contact: &LinearContact, coordinates: &DVector<f64>) -> Evaluated {
        let (place, tangent) = Self::place(contact, coordinates);
        let mut gap = self.surfaces.gap(contact.obstacle, &place);
        gap.value -= contact.clearance;
        let displacement = place - contact.anchor.0 - contact.anchor.1 * contact.travel;
        let law = Law::new(
            &gap,
            &contact.force,
            &displacement,
            contact.friction,
            contact.k,
        );
        let slide = contact.range.map(|[from, to]| {
            // The place of least gap is estimated from the slope and its change with the
            // displacement: by the second derivative of the gap, and by the couple of the displaced
            // force.
            let slope = gap.normal.dot(&tangent);
            let (size, rate) = (contact.force.norm(), contact.slope_by_travel());
            let least = (contact.travel - slope / rate).clamp(from, to);
            let excess = contact.travel - least;
            if least <= from || least >= to {
                let zero = Vector3::zeros();
                return Slide {
                    excess,
                    by_force: zero,
                    by_place: zero,
                    by_tangent: zero,
                    by_travel: 1.0,
                };
            }
            let (by_place, by_tangent) = (gap.curvature * tangent / rate, gap.normal / rate);
            let by_travel = by_place.dot(&tangent) + by_tangent.dot(&contact.bend);
            let along = if size > 0.0 {
                contact.force / size
            } else {
                Vector3::zeros()
            };
            let by_force = along * (-slope * contact.turn_by_couple / rate.powi(2));
            Slide {
                excess,
                by_force,
                by_place,
                by_tangent,
                by_travel,
            }
        });
        Evaluated {
            law,
            tangent,
            slide,
        }
    }

    /// The sum of the squares of the residuals, N².
    pub fn merit(contacts: &[LinearContact], all: &[Evaluated]) -> f64 {
        contacts
            .iter()
            .zip(all)
            .map(|(contact, at)| at.squares(contact))
            .sum()
    }

    pub fn evaluate_all(&self, contacts: &[LinearContact]) -> Vec<Evaluated> {
        let coordinates = self.coordinates(contacts);
        contacts
            .iter()
            .map(|contact| self.evaluate(contact, &coordinates))
            .collect()
    }

    /// The first Newton step, with the laws linearised at the start of the step of the rod. An
    /// ordinary step would linearise them at the place that the rod reaches with constant forces,
    /// which is far for an almost unstable rod. `None` if the step is not finite.
    pub fn first_step(
        &self,
        contacts: &[LinearContact],
        proximal: f64,
    ) -> Option<Vec<ContactStep>> {
        let displacements = self.coordinates(contacts) - &self.start;
        let linear = |contact: &LinearContact| {
            let mut at = self.evaluate(contact, &self.start);
            let mut displacement: Vector3<f64> =
                displacements.fixed_rows::<3>(contact.first).into_owned();
            if let Some(slide) = &mut at.slide {
                let turn: Vector3<f64> = displacements
                    .fixed_rows::<3>(contact.first + 3)
                    .into_owned();
                displacement += turn * contact.travel;
                slide.excess += slide.by_place.dot(&displacement) + slide.by_tangent.dot(&turn);
            }
            at.law.residual += at.law.by_place * displacement;
            at
        };
        let all: Vec<Evaluated> = contacts.iter().map(linear).collect();
        self.step(contacts, &all, proximal)
    }

    /// The derivatives of all coordinates by the unknowns of contacts: by the three components of
    /// the force of each and, if it has a range, by its displacement along the rod, since the
    /// displaced force exerts a couple.
    fn by_unknowns<'b>(
        &self,
        contacts: impl Iterator<Item = &'b LinearContact>,
        unknowns: usize,
    ) -> DMatrix<f64> {
        let mut derivatives = DMatrix::zeros(self.free.len(), unknowns);
        let mut k = 0;
        for contact in contacts {
            let Some(couples) = contact.range.map(|_| contact.first + 3) else {
                derivatives
                    .columns_mut(k, 3)
                    .copy_from(&self.compliance.columns(contact.first, 3));
                k += 3;
                continue;
            };
            for c in 0..3 {
                let mut by_force = derivatives.column_mut(k + c);
                by_force.copy_from(&self.compliance.column(contact.first + c));
                by_force.axpy(contact.travel, &self.compliance.column(couples + c), 1.0);
                derivatives.column_mut(k + 3).axpy(
                    contact.force[c],
                    &self.compliance.column(couples + c),
                    1.0,
                );
            }
            k += 4;
        }
        derivatives
    }

    /// One Newton step: changes of the force and of the travel of every contact.
    pub fn step(
        &self,
        contacts: &[LinearContact],
        all: &[Evaluated],
        proximal: f64,
    ) -> Option<Vec<ContactStep>> {
        let zero = Vector3::zeros();
        let mut steps: Vec<ContactStep> = all
            .iter()
            .map(|at| (zero, at.slide.as_ref().map_or(0.0, |slide| -slide.excess)))
            .collect();
        // An open contact that still has a force is an unknown, too, so that its force vanishes.
        let is_loaded = |i: usize| all[i].law.status != Status::Open;
        let unknown: Vec<usize> = (0..contacts.len())
            .filter(|i| is_loaded(*i) || contacts[*i].force != zero)
            .collect();
        let mut first = vec![0];
        for i in &unknown {
            first.push(first[first.len() - 1] + 3 + usize::from(contacts[*i].range.is_some()));
        }
        let n = first[unknown.len()];
        let derivatives = self.by_unknowns(unknown.iter().map(|i| &contacts[*i]), n);
        let (mut matrix, mut rhs) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        for (&row, &i) in first.iter().zip(&unknown) {
            let (
                contact,
                Evaluated {
                    law,
                    tangent,
                    slide,
                    ..
                },
            ) = (&contacts[i], &all[i]);
            let proximal = if is_loaded(i) { proximal } else { 0.0 };
            let mut own = matrix.fixed_view_mut::<3, 3>(row, row);
            own += law.by_force + Matrix3::identity() * proximal;
            rhs.fixed_rows_mut::<3>(row).copy_from(&-law.residual);
            let (x, has_range) = (contact.first, slide.is_some());
            if is_loaded(i) {
                for (k, u) in derivatives.column_iter().enumerate() {
                    let mut displacement: Vector3<f64> = u.fixed_rows::<3>(x).into_owned();
                    if has_range {
                        displacement += u.fixed_rows::<3>(x + 3) * contact.travel;
                    }
                    let mut by = matrix.fixed_view_mut::<3, 1>(row, k);
                    by += law.by_place * displacement;
                }
            }
            if let Some(Slide {
                excess,
                by_force,
                by_place,
                by_tangent,
                by_travel,
            }) = slide
            {
                // The scale of the residual is that of the forces.
                let (scale, last) = (contact.k, row + 3);
                let law_by_travel = law.by_place * tangent + law.by_anchor * contact.anchor.1;
                (0..3).for_each(|c| matrix[(row + c, last)] += law_by_travel[c]);
                rhs[last] = -excess * scale;
                (0..3).for_each(|c| matrix[(last, row + c)] += by_force[c] * scale);
                matrix[(last, last)] += by_travel * scale;
                let by_tangent = (by_tangent + by_place * contact.travel) * scale;
                let by_place = by_place * scale;
                for (k, u) in derivatives.column_iter().enumerate() {
                    let (displacement, turn) = (u.fixed_rows::<3>(x), u.fixed_rows::<3>(x + 3));
                    matrix[(last, k)] += by_place.dot(&displacement) + by_tangent.dot(&turn);
                }
            }
        }
        let solution = solved(&matrix, rhs)?;
        for (&row, &i) in first.iter().zip(&unknown) {
            steps[i].0 = solution.fixed_rows::<3>(row).into_owned();
            if contacts[i].range.is_some() {
                steps[i].1 = solution[row + 3];
            }
        }
        Some(steps)
    }
}

/// The solution of linear equations. `None` if it is not finite.
fn solved(matrix: &DMatrix<f64>, mut rhs: DVector<f64>) -> Option<DVector<f64>> {
    let n = rhs.len();
    if n > 0 {
        let lu = MatRef::from_column_major_slice(matrix.as_slice(), n, n).partial_piv_lu();
        lu.solve_in_place(MatMut::from_column_major_slice_mut(
            rhs.as_mut_slice(),
            n,
            1,
        ));
    }
    rhs.iter().all(|value| value.is_finite()).then_some(rhs)
}

#[cfg(test)]
mod tests;
