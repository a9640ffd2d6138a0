//! Normal forces of all contacts for given friction.

use nalgebra::{DMatrix, DVector, Vector3};

use super::complementarity::Complementarity;
use super::law::Gap;
use super::reduced::{LinearContact, Reduced};

/// Compliance that is added to each contact, relative to the mean one, for contacts that are not
/// independent.
const REDUNDANT: f64 = 1e-13;
/// Penetration that is attributed to rounding, relative to the coordinates.
const ROUNDING: f64 = 1e-14;

/// A contact, linearised at the place that it has with the present forces.
struct Linearised {
    gap: Gap,
    /// The gap (m) at the place of least gap, to second order, and its derivatives by the
    /// coordinates.
    least: f64,
    normal: DVector<f64>,
    /// The slope along the rod and its derivatives by the coordinates, if the contact moves along
    /// the rod.
    slide: Option<(f64, DVector<f64>)>,
    /// The second derivatives of the gap, times the force.
    bends: Vec<Bend>,
}

/// A term σ (b · u + c)²/2 by which displacements u of the coordinates change the work of a normal
/// force.
struct Bend {
    /// The row b, and the constant c.
    row: DVector<f64>,
    offset: f64,
    /// The sign σ: positive where the contact slides to a smaller gap, and negative where it turns
    /// about the obstacle.
    sign: f64,
}

impl Reduced<'_> {
    /// Sets the normal forces to those with which no contact penetrates and each loaded one
    /// touches, for the present normals, displacements along the rod, and friction, which is
    /// limited to its cone. Then moves contacts to their places of least gap. Returns whether the
    /// forces exist, which they may not if the rod is unstable.
    pub(super) fn press(&self, contacts: &mut [LinearContact]) -> bool {
        let coordinates = self.coordinates(contacts);
        let linear: Vec<Linearised> = contacts
            .iter()
            .map(|at| self.linearised(at, &coordinates))
            .collect();
        let present = DVector::from_fn(contacts.len(), |i, _| {
            linear[i].gap.normal.dot(&contacts[i].force)
        });
        let extent = contacts
            .iter()
            .map(|at| self.free.fixed_rows::<3>(at.first).amax())
            .fold(0.0, f64::max);
        let Some([normal, moved]) = self.pressed(&linear, &present, ROUNDING * extent) else {
            return false;
        };
        for ((contact, at), force) in contacts.iter_mut().zip(&linear).zip(&normal) {
            let n = &at.gap.normal;
            let tangential = contact.force - n * n.dot(&contact.force);
            contact.force = n * *force + tangential.cap_magnitude(contact.friction * force);
            if let (Some((slope, row)), Some([from, to])) = (&at.slide, contact.range)
                && contact.curve > 0.0
            {
                contact.travel =
                    (contact.travel - (slope + row.dot(&moved)) / contact.curve).clamp(from, to);
            }
        }
        true
    }

    fn linearised(&self, at: &LinearContact, coordinates: &DVector<f64>) -> Linearised {
        // Derivatives of the component of the place in a direction.
        let along = |direction: Vector3<f64>| {
            let mut row = DVector::zeros(coordinates.len());
            LinearContact {
                force: direction,
                ..*at
            }
            .load(&mut row);
            row
        };
        let (place, tangent) = Self::place(at, coordinates);
        let gap = self.surfaces.gap(at.obstacle, &place);
        let mut least = gap.value - at.clearance;
        let mut bends = Vec::new();
        let push = gap.normal.dot(&at.force);
        let eigen = gap.curvature.symmetric_eigen();
        for (side, value) in eigen
            .eigenvectors
            .column_iter()
            .zip(eigen.eigenvalues.iter())
        {
            if push * value > 0.0 {
                bends.push(Bend {
                    row: along(side * (push * value).sqrt()),
                    offset: 0.0,
                    sign: -1.0,
                });
            }
        }
        let slide = at.range.map(|[from, to]| {
            let slope = gap.normal.dot(&tangent);
            let mut row = along(gap.curvature * tangent);
            let mut turn = row.fixed_rows_mut::<3>(at.first + 3);
            turn += gap.normal;
            let moved = at.travel - slope / at.curve;
            if push > 0.0 && at.curve > 0.0 && moved > from && moved < to {
                let factor = (push / at.curve).sqrt();
                bends.push(Bend {
                    row: &row * factor,
                    offset: slope * factor,
                    sign: 1.0,
                });
                least -= 0.5 * slope * slope / at.curve;
            }
            (slope, row)
        });
        Linearised {
            gap,
            least,
            normal: along(gap.normal),
            slide,
            bends,
        }
    }

    /// The normal forces, and the change of the coordinates from those with the `present` normal
    /// forces (N). The displacements that the second derivatives of the gaps cause are eliminated.
    /// `None` if their equations are singular or no forces are found.
    fn pressed(
        &self,
        linear: &[Linearised],
        present: &DVector<f64>,
        rounding: f64,
    ) -> Option<[DVector<f64>; 2]> {
        let dimension = self.free.len();
        let bends: Vec<&Bend> = linear.iter().flat_map(|at| &at.bends).collect();
        let normals = DMatrix::from_fn(linear.len(), dimension, |i, j| linear[i].normal[j]);
        let rows = DMatrix::from_fn(bends.len(), dimension, |k, j| bends[k].row[j]);
        let offsets = DVector::from_fn(bends.len(), |k, _| bends[k].offset);
        let by_normals = self.compliance * normals.transpose();
        let by_rows = self.compliance * rows.transpose();
        let mut matrix = -(&rows * &by_rows);
        (0..bends.len()).for_each(|k| matrix[(k, k)] -= bends[k].sign);
        let across = &rows * &by_normals;
        let factors = matrix.lu();
        // The elimination of no displacement is not singular.
        let solve = |rhs: &DMatrix<f64>| {
            if bends.is_empty() {
                Some(rhs.clone())
            } else {
                factors.solve(rhs)
            }
        };
        let (inner, turned) = (
            solve(&across)?,
            solve(&DMatrix::from_columns(&[offsets]))?
                .column(0)
                .into_owned(),
        );
        // Change of the gaps by the normal forces, m/N, and gaps without them, m.
        let compliance = &normals * &by_normals + across.transpose() * &inner;
        let mut compliance = (&compliance + compliance.transpose()) * 0.5;
        let least = DVector::from_fn(linear.len(), |i, _| linear[i].least);
        let free = least + across.transpose() * &turned - &compliance * present;
        let redundant = REDUNDANT * compliance.trace().abs() / linear.len() as f64;
        (0..linear.len()).for_each(|i| compliance[(i, i)] += redundant);
        if !compliance
            .iter()
            .chain(&free)
            .all(|value| value.is_finite())
        {
            return None;
        }
        let normal = Complementarity {
            compliance,
            free,
            rounding,
        }
        .stabilised(present.map(|force| force.max(0.0)))?;
        let by_forces = by_normals + &by_rows * inner;
        let moved = by_forces * (&normal - present) + by_rows * turned;
        Some([normal, moved])
    }
}
