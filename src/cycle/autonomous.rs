//! What a limit cycle needs of a shoot: that nothing depends on time, and that no law twists.

use nalgebra::Vector3;

use super::error::CycleError;
use crate::growth::GrowthLaw;
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::scene::Scene;
use crate::shoot::Shoot;
use crate::stability::{StabilityError, SteadyState, check_unforced};

/// Twist that is less than this share of the bend that the laws ask for is rounding: shapes are known to 1e-11.
const TWIST: f64 = 1e-8;

/// Refuses laws, loads, growth or a scene that change in time, on a rod that is bent, on which they all show.
pub(super) fn check_autonomous(shoot: &Shoot<impl Model>, rod: &Rod) -> Result<(), CycleError> {
    let (load, growth, scene) = (shoot.model.load(), shoot.model.growth(), shoot.model.scene());
    let now = shoot.environment();
    let force = InternalForce::of(rod, load, &now);
    check_unforced(shoot, rod, load, &SteadyState::of(shoot, rod, &force))?;
    // A force shows in no stimulus of a shape that stays, and REGR in no gradient. Times as there: from seconds to days.
    let points = &rod.points()[rod.zone()];
    let mut change = 0.0_f64;
    for after in [1.0, 7.3, 101.1, 977.7, 6151.3, 40_009.9] {
        let time = now.time + after;
        let then = InternalForce::of(rod, load, &scene.environment(time));
        let largest = force.largest().max(then.largest()).max(f64::MIN_POSITIVE);
        for (a, b) in force.at_points().iter().zip(then.at_points()) {
            change = change.max((a - b).norm() / largest);
        }
        for point in points {
            let [a, b] = [now.time, time].map(|t| growth.regr(point.apex_distance, t));
            change = change.max((a - b).abs() / a.abs().max(b.abs()).max(f64::MIN_POSITIVE));
        }
    }
    // What does not depend on time is the same to the last bit; some rounding is allowed to what computes with it in vain.
    if change > 1e-12 { Err(StabilityError::Forced { change: change / rod.length() }.into()) } else { Ok(()) }
}

/// Refuses laws, loads, growth or a scene that are not the same a period (s) later, at some times that no period divides.
pub(super) fn check_period(shoot: &Shoot<impl Model>, rod: &Rod, period: f64) -> Result<(), CycleError> {
    let (load, growth, scene) = (shoot.model.load(), shoot.model.growth(), shoot.model.scene());
    let relative = |difference: f64, a: f64, b: f64| difference / a.max(b).max(f64::MIN_POSITIVE);
    let mut change = 0.0_f64;
    for part in [0.0, 0.171, 0.377, 0.593, 0.811] {
        let [now, then] = [part, part + 1.0].map(|periods| shoot.environment().time + periods * period);
        let [a, b] = [now, then].map(|time| InternalForce::of(rod, load, &scene.environment(time)));
        for (first, second) in a.at_points().iter().zip(b.at_points()) {
            change = change.max(relative((first - second).norm(), a.largest(), b.largest()));
        }
        change = change.max(scene.base(now).angle_to(&scene.base(then)));
        let [a, b] = [&a, &b].map(|force| SteadyState::of(shoot, rod, force).gradients);
        let [first, second] = [&a, &b].map(|all| all.iter().map(Vector3::norm).fold(0.0, f64::max));
        for (one, other) in a.iter().zip(&b) {
            change = change.max(relative((one - other).norm(), first, second));
        }
        for point in &rod.points()[rod.zone()] {
            let [a, b] = [now, then].map(|t| growth.regr(point.apex_distance, t));
            change = change.max(relative((a - b).abs(), a.abs(), b.abs()));
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
    if twist > TWIST * bend { Err(CycleError::Twists { twist, bend }) } else { Ok(()) }
}
