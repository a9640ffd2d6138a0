//! Floquet multipliers of a periodic orbit: eigenvalues of the monodromy operator, computed by
//! Arnoldi's method with deflation.
//!
//! A shift in time and a rotation of an autonomous orbit give trivial multipliers 1, which are
//! removed from the lists.

use nalgebra::Complex;

use super::linear::Traced;
use super::orbit::PeriodicOrbit;
use super::plane::OrbitPlane;
use crate::cycle::disturbances::Disturbances;
use crate::cycle::error::{CycleError, Outcome};
use crate::cycle::map::{Monodromy, StateRotation};
use crate::cycle::sensitivity::ASYMMETRY;
use crate::cycle::spectrum::{Eigenvalue, LeadingSpectrum, MOST_VALUES, remove_nearest};
use crate::error::{ParameterError, ensure};
use crate::model::Model;
use crate::shoot::Shoot;

/// Largest number of trivial multipliers: of a shift in time, and of a rotation.
const TRIVIAL: usize = 2;
/// Largest distance from 1 of the multiplier of a shift in time. With a larger one the grid does
/// not resolve the orbit.
const DEFECT: f64 = 1e-2;

/// The leading Floquet multipliers of a periodic orbit: all those with a modulus larger than
/// `radius`, without the trivial ones.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Multipliers {
    /// Multipliers, largest modulus first. Both of a conjugate pair are listed.
    pub values: Disturbances<Eigenvalue>,
    /// Modulus above which the lists are complete, less than 0.9.
    pub radius: f64,
    /// Largest distance from 1 of the trivial multipliers, those of a shift in time and of a
    /// rotation. It is the error due to the grid and to differences; zero if there are no trivial
    /// multipliers.
    pub trivial: f64,
}

impl Multipliers {
    /// Number of multipliers outside the unit circle, without the trivial ones. The lists contain
    /// all of them.
    #[must_use]
    pub fn unstable(&self) -> usize {
        self.values
            .iter()
            .filter(|one| one.value.norm() > 1.0)
            .count()
    }
}

impl PeriodicOrbit {
    /// Computes the leading Floquet multipliers: at least `count` in each list unless the others
    /// are smaller than 1e-3, and all with a modulus of at least 0.9. The shoot is the one whose
    /// orbit this is. For a relative periodic orbit the disturbances are rotated back.
    ///
    /// # Errors
    /// A count that is not from 1 to 38, laws that cannot be linearised, multipliers that do not
    /// converge, an orbit that the grid does not resolve.
    pub fn multipliers(
        &self,
        shoot: &Shoot<impl Model>,
        count: usize,
    ) -> Result<Multipliers, CycleError> {
        const { assert!(38 + TRIVIAL == MOST_VALUES) };
        ParameterError::unless(
            (1..=38).contains(&count),
            "number of multipliers",
            count as f64,
            "from 1 to 38",
        )?;
        self.multipliers_on(&self.retrace(shoot)?, count)
    }

    pub(crate) fn multipliers_on(
        &self,
        traced: &Traced<impl Model>,
        count: usize,
    ) -> Outcome<Multipliers> {
        let monodromy = Monodromy::of(&traced.return_map, &traced.path)?;
        let plane = OrbitPlane::of(traced, &monodromy)?;
        // A shift in time and a rotation have the same multiplier. The tangent of the rotation is
        // known exactly, and is projected out.
        let turned = traced.return_map.turn.as_ref().filter(|_| plane.is_none());
        let turned = turned.map(|turn| turn.rate(&self.start).flat().normalize());
        let (mut radius, mut largest_defect) = (0.0_f64, 0.0_f64);
        let mut lists = [Vec::new(), Vec::new()];
        for (k, list) in lists.iter_mut().enumerate() {
            let across = k == 1;
            if across && plane.is_none() {
                break;
            }
            let found = LeadingSpectrum::of(self.start.flat().len(), count + TRIVIAL, &mut |x| {
                let mut end = monodromy.apply(&self.start.with_values(x))?;
                if let Some(plane) = &plane {
                    // Rounding couples disturbances in the plane with those out of it, so that the
                    // larger multiplier would appear in both.
                    plane.project(&mut end, across);
                }
                let mut end = end.flat();
                if let Some(turned) = &turned {
                    end.axpy(-turned.dot(&end), turned, 1.0);
                }
                Ok(end)
            })?;
            radius = radius.max(found.radius);
            *list = found.values;
        }
        let own_period = usize::from(self.forced_from.is_none());
        let near_one = |set: &[Eigenvalue]| {
            set.iter()
                .filter(|one| (one.value - 1.0).norm() < ASYMMETRY)
                .count()
        };
        let rotation = match self.rotation(traced, &monodromy)? {
            _ if turned.is_some() => 0,
            Some(there) => usize::from(there),
            None if plane.is_some() => near_one(&lists[1]).min(1),
            None => near_one(&lists[0]).saturating_sub(own_period).min(1),
        };
        let trivial = if plane.is_some() {
            [own_period, rotation]
        } else {
            [own_period + rotation, 0]
        };
        for (list, number) in lists.iter_mut().zip(trivial) {
            for _ in 0..number {
                let defect = remove_nearest(list, Complex::ONE, f64::INFINITY);
                largest_defect = defect.unwrap_or(f64::INFINITY).max(largest_defect);
            }
        }
        let intervals = self.settings.intervals;
        ensure(
            largest_defect <= DEFECT,
            CycleError::Unresolved {
                error: largest_defect,
                intervals,
            },
        )?;
        let [in_plane, out_of_plane] = lists;
        let values = match plane {
            Some(_) => Disturbances::Planar {
                in_plane,
                out_of_plane,
            },
            None => Disturbances::Spatial(in_plane),
        };
        Ok(Multipliers {
            values,
            radius,
            trivial: largest_defect,
        })
    }

    /// Whether the tangent of a rotation is an eigenvector with the multiplier 1, other than that
    /// of a shift in time; none if the laws do not declare the rotation of a variable.
    fn rotation(
        &self,
        traced: &Traced<impl Model>,
        monodromy: &Monodromy,
    ) -> Outcome<Option<bool>> {
        let Ok(turn) = StateRotation::new(&traced.return_map.laws, 0.0) else {
            return Ok(None);
        };
        let tangent = turn.rate(&self.start).flat();
        // On a rotating wave a rotation is a shift in time.
        if tangent.norm() == 0.0 || traced.is_circular(&turn) {
            return Ok(Some(false));
        }
        let end = monodromy.apply_flat(&tangent)?;
        Ok(Some((end - &tangent).norm() <= ASYMMETRY * tangent.norm()))
    }
}
