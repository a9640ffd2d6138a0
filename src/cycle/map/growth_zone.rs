//! The equation of the intrinsic strain, u̇* = REGR · gradient, at the material points of the
//! growth zone.

use nalgebra::Vector3;

use crate::cycle::error::{CycleError, Outcome};
use crate::error::{ParameterError, ensure};
use crate::model::{GrowthLaw, Model};
use crate::shoot::Shoot;
use crate::stability::StabilityError;
use crate::tropism::Growing;

/// Relative difference of forces, couples, gradients and derivatives of laws that is attributed to
/// rounding. Shapes have errors of 1e-11.
pub(crate) const ROUNDING: f64 = 1e-8;

/// The material points of the growth zone, and their REGR at the time of the shoot, 1/s.
///
/// # Errors
/// A shoot that elongates, or a point without growth, whose strain would be arbitrary.
pub(crate) fn driven_points(shoot: &Shoot<impl Model>) -> Outcome<(Vec<Growing>, Vec<f64>)> {
    let (growth, rod, time) = (shoot.model.growth(), shoot.rod(), shoot.environment().time);
    ensure(!growth.elongates(), CycleError::Elongates)?;
    let points = rod.points()[rod.zone()].iter();
    let places: Vec<Growing> = points
        .map(|point| Growing::of(point, time, point.apex_distance))
        .collect();
    let regr: Vec<f64> = places
        .iter()
        .map(|at| growth.regr(at.apex_distance, time))
        .collect();
    let without = regr.iter().filter(|rate| !(rate.abs() > 0.0)).count();
    let what = "number of material points of the zone without growth";
    ParameterError::unless(
        without == 0,
        what,
        without as f64,
        "zero: their strain would be arbitrary",
    )?;
    Ok((places, regr))
}

/// Returns an error for growth gradients that are not finite, or that twist the shoot.
pub(crate) fn check_gradients(gradients: &[Vector3<f64>]) -> Outcome {
    let finite = gradients.iter().flatten().all(|x| x.is_finite());
    ensure(
        finite,
        StabilityError::NotFinite {
            what: "growth gradient",
        },
    )?;
    let bend = gradients
        .iter()
        .map(|gradient| gradient.xy().norm())
        .fold(0.0, f64::max);
    let twist = gradients
        .iter()
        .map(|gradient| gradient.z.abs())
        .fold(0.0, f64::max);
    ensure(twist <= ROUNDING * bend, CycleError::Twists { twist })
}
