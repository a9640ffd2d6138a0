//! Checks that a shoot is autonomous or periodic, keeps its length, and does not twist.

use nalgebra::Vector3;

use super::error::CycleError;
use crate::growth::GrowthLaw;
use crate::linear::{self, SteadyLaws, change_of_causes, relative};
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::scene::Scene;
use crate::shoot::Shoot;
use crate::stability::StabilityError;
use crate::tropism::Growing;

/// Relative difference of forces, couples and growth gradients that counts as rounding: shapes are known to 1e-11.
pub(super) const ROUNDING: f64 = 1e-8;

/// The material points of the growth zone and their REGR, 1/s; all must steer, and the shoot must keep its length.
pub(super) fn driven_points(shoot: &Shoot<impl Model>) -> Result<(Vec<Growing>, Vec<f64>), CycleError> {
    let (growth, rod, time) = (shoot.model.growth(), shoot.rod(), shoot.environment().time);
    if growth.elongates() {
        return Err(CycleError::Elongates);
    }
    let points = rod.points()[rod.zone()].iter();
    let places: Vec<Growing> = points.map(|point| Growing::new(time, point.section, point.apex_distance)).collect();
    let regr: Vec<f64> = places.iter().map(|at| growth.regr(at.apex_distance, time)).collect();
    let still = regr.iter().filter(|rate| !(rate.abs() > 0.0)).count();
    if still > 0 { Err(CycleError::NotDriven { points: still }) } else { Ok((places, regr)) }
}

/// Refuses laws, loads, growth or a scene that change in time, on a rod that is bent, on which they all show.
pub(super) fn check_autonomous(shoot: &Shoot<impl Model>, rod: &Rod) -> Result<(), CycleError> {
    let now = shoot.environment();
    let load = shoot.model.load();
    let steady = SteadyLaws::of(shoot, rod, &InternalForce::of(rod, load, &now));
    Ok(linear::check_autonomous(shoot, rod, load, &steady)?)
}

/// Refuses laws, loads, growth or a scene that are not the same a period (s) later, at some times that no period divides.
pub(super) fn check_period(shoot: &Shoot<impl Model>, rod: &Rod, period: f64) -> Result<(), CycleError> {
    let (load, scene) = (shoot.model.load(), shoot.model.scene());
    let mut change = 0.0_f64;
    for part in [0.0, 0.171, 0.377, 0.593, 0.811] {
        let [now, then] = [part, part + 1.0].map(|periods| shoot.environment().time + periods * period);
        change = change.max(scene.base(now).angle_to(&scene.base(then)));
        let forces = [now, then].map(|time| InternalForce::of(rod, load, &scene.environment(time)));
        change = change.max(change_of_causes(shoot, rod, &forces[0], &forces[1]));
        let [a, b] = forces.map(|force| SteadyLaws::of(shoot, rod, &force).gradients);
        let [first, second] = [&a, &b].map(|all| all.iter().map(Vector3::norm).fold(0.0, f64::max));
        for (one, other) in a.iter().zip(&b) {
            change = change.max(relative((one - other).norm(), first, second));
        }
    }
    // A phase of many turns is known to so many roundings.
    if change < 1e-9 { Ok(()) } else { Err(CycleError::NoCommonPeriod { period, change }) }
}

/// Refuses growth gradients that are not numbers or that twist: strain is sought that bends.
pub(super) fn check_gradients<'a>(gradients: impl Iterator<Item = &'a Vector3<f64>>) -> Result<(), CycleError> {
    let (mut bend, mut twist, mut finite) = (0.0_f64, 0.0_f64, true);
    for gradient in gradients {
        finite &= gradient.iter().all(|x| x.is_finite());
        bend = bend.max(gradient.xy().norm());
        twist = twist.max(gradient.z.abs());
    }
    if !finite {
        return Err(StabilityError::NotFinite { what: "growth gradient" }.into());
    }
    if twist > ROUNDING * bend { Err(CycleError::Twists { twist, bend }) } else { Ok(()) }
}
