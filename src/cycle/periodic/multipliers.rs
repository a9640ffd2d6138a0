//! Floquet multipliers of a periodic orbit: eigenvalues of the linearised return map.

use nalgebra::Complex;

use super::linear::is_circle;
use super::orbit::PeriodicOrbit;
use super::plane::Plane;
use crate::cycle::disturbances::Disturbances;
use crate::cycle::error::CycleError;
use crate::cycle::map::monodromy::Monodromy;
use crate::cycle::map::return_map::{ReturnMap, Trajectory};
use crate::cycle::map::rotation::StateRotation;
use crate::cycle::spectrum::{Spectrum, check_count};
use crate::model::Model;
use crate::shoot::Shoot;
use crate::tropism::Declaration;

/// The map commutes with rotations of the whole on any grid. The multiplier of a rotation is therefore 1 up to the error of the
/// differences in the linearised map.
const SYMMETRIC: f64 = 1e-6;
/// Largest defect of the multiplier of a shift in time: with a larger one the intervals do not resolve the orbit.
const DEFECT: f64 = 1e-2;

/// A Floquet multiplier μ: over a period, a disturbance with its vector is multiplied by μ.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Multiplier {
    /// μ.
    pub value: Complex<f64>,
    /// |A v − μ v| of its vector v of norm one, where A is the linearised return map without the directions of larger multipliers.
    pub residual: f64,
}

impl Multiplier {
    /// The root λ = ln μ/T of this multiplier over a period T (s), 1/s, with the smallest |Im λ|.
    #[must_use]
    pub fn root(&self, period: f64) -> Complex<f64> {
        self.value.ln() / period
    }
}

/// The leading Floquet multipliers of a periodic orbit: all those with a modulus larger than `radius`, without the trivial ones.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Multipliers {
    /// Multipliers, largest modulus first. Both of a conjugate pair are listed.
    pub values: Disturbances<Multiplier>,
    /// Modulus outside which the lists are complete, less than 0.9.
    pub radius: f64,
    /// Largest distance from 1 of the trivial multipliers, which are those of a shift in time and of a rotation of the whole. It is the
    /// error that intervals and differences leave. Zero if there are none.
    pub trivial: f64,
}

impl Multipliers {
    /// Number of multipliers outside the unit circle, trivial ones not counted. The lists contain all of them.
    #[must_use]
    pub fn unstable(&self) -> usize {
        self.values.iter().filter(|one| one.value.norm() > 1.0).count()
    }
}

impl PeriodicOrbit {
    /// The leading Floquet multipliers, by Arnoldi's method with deflation on the linearised return map: at least `count` in each list
    /// unless the others are smaller than 1e-3, and all with a modulus of at least 0.9. The number of Krylov vectors is chosen by
    /// convergence. The shoot is the one whose orbit this is. For an orbit that returns rotated the disturbances are rotated back.
    ///
    /// # Errors
    /// A count that is not from 1 to 38, a map that is not linearised, multipliers that do not converge, an orbit that its
    /// intervals do not resolve.
    pub fn multipliers(&self, shoot: &Shoot<impl Model>, count: usize) -> Result<Multipliers, CycleError> {
        check_count(count.saturating_add(if count == 0 { 0 } else { 2 }))?;
        let (return_map, path) = self.retrace(shoot)?;
        self.multipliers_on(&return_map, &path, count)
    }

    pub(crate) fn multipliers_on(
        &self,
        return_map: &ReturnMap<impl Model>,
        path: &Trajectory,
        count: usize,
    ) -> Result<Multipliers, CycleError> {
        let monodromy = Monodromy::of(return_map, path, self.period)?;
        let plane = Plane::of(return_map, path, &self.start, &monodromy)?;
        // The tangent of a rotation is known exactly, and is removed where a shift in time has the same multiplier.
        let turned = return_map.turn.as_ref().filter(|_| plane.is_none());
        let turned = turned.map(|turn| turn.rate(&self.start).flat().normalize());
        let (mut radius, mut largest_defect) = (0.0_f64, 0.0_f64);
        let mut lists = [Vec::new(), Vec::new()];
        for (k, list) in lists.iter_mut().enumerate() {
            let across = k == 1;
            if across && plane.is_none() {
                break;
            }
            let found = Spectrum::of(self.start.flat().len(), count + 2, |x| {
                let mut end = monodromy.apply(&self.start.with_values(x))?;
                if let Some(plane) = &plane {
                    // Rounding couples disturbances in the plane with those out of it, and the larger multiplier would appear in both.
                    plane.project(&mut end, across);
                }
                let mut end = end.flat();
                if let Some(turned) = &turned {
                    end.axpy(-turned.dot(&end), turned, 1.0);
                }
                Ok(end)
            })?;
            radius = radius.max(found.radius);
            list.extend(found.values.into_iter().map(|(value, residual)| Multiplier { value, residual }));
        }
        let own_period = usize::from(self.driven_from.is_none());
        let near_one = |set: &[Multiplier]| set.iter().filter(|one| (one.value - 1.0).norm() < SYMMETRIC).count();
        let rotation = match self.rotation(return_map, path, &monodromy)? {
            _ if turned.is_some() => 0,
            Symmetry::Is(there) => usize::from(there),
            Symmetry::Undeclared if plane.is_some() => near_one(&lists[1]).min(1),
            Symmetry::Undeclared => near_one(&lists[0]).saturating_sub(own_period).min(1),
        };
        let trivial = if plane.is_some() { [own_period, rotation] } else { [own_period + rotation, 0] };
        for (list, number) in lists.iter_mut().zip(trivial) {
            for _ in 0..number {
                let defect = |one: &Multiplier| (one.value - 1.0).norm();
                let nearest = (0..list.len()).min_by(|a, b| defect(&list[*a]).total_cmp(&defect(&list[*b])));
                let defect = nearest.map_or(f64::INFINITY, |at| defect(&list.remove(at)));
                largest_defect = if defect > largest_defect { defect } else { largest_defect };
            }
        }
        if !(largest_defect <= DEFECT) {
            let intervals = self.settings.intervals;
            return Err(CycleError::Unresolved { error: largest_defect, intervals });
        }
        let [in_plane, out_of_plane] = lists;
        let values = match plane {
            Some(_) => Disturbances::Planar { in_plane, out_of_plane },
            None => Disturbances::Spatial(in_plane),
        };
        Ok(Multipliers { values, radius, trivial: largest_defect })
    }
    /// Whether a rotation of the whole gives another orbit with a multiplier of its own.
    fn rotation(
        &self,
        return_map: &ReturnMap<impl Model>,
        path: &Trajectory,
        monodromy: &Monodromy,
    ) -> Result<Symmetry, CycleError> {
        let Ok(turn) = StateRotation::new(&Declaration::of(return_map.shoot.model.tropism()), 0.0) else {
            return Ok(Symmetry::Undeclared);
        };
        let tangent = turn.rate(&self.start).flat();
        // On a circle a rotation is a shift in time.
        if tangent.norm() == 0.0 || is_circle(return_map, &self.start, path, &turn) {
            return Ok(Symmetry::Is(false));
        }
        let end = monodromy.apply(&self.start.with_values(&tangent))?.flat();
        Ok(Symmetry::Is((end - &tangent).norm() <= SYMMETRIC * tangent.norm()))
    }
}

/// What is known of the rotation of an orbit as a whole.
enum Symmetry {
    /// It is, or is not, a direction with the multiplier 1.
    Is(bool),
    /// The rotation of some variable is not declared.
    Undeclared,
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    #[test]
    fn the_root_of_a_multiplier_is_the_one_with_the_smallest_frequency() {
        // Over two seconds 0.3 + 4i is not distinguished from 0.3 + (4 − π)i.
        let (exact, period) = (Complex::new(0.3, 4.0), 2.0);
        let root = Multiplier { value: (exact * period).exp(), residual: 0.0 }.root(period);
        // Rounding of an exponential and a logarithm.
        assert_abs_diff_eq!(root.re, 0.3, epsilon = 1e-15);
        assert_abs_diff_eq!(root.im, 4.0 - std::f64::consts::PI, epsilon = 1e-15);
    }
}
