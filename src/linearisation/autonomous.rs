//! Whether laws, loads, growth, scene and support depend on time.

use super::error::StabilityError;
use super::steady::SteadyLaws;
use super::support::change_of_support;
use crate::load::{InternalForce, Load};
use crate::model::{GrowthLaw, Model, Scene};
use crate::numerics::scalar::relative;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::support::Reaction;

/// Returns an error if laws, load, growth, gravity, base or support depend on time. `steady` are
/// the laws on a rod under the load and the given reactions.
pub(crate) fn check_autonomous(
    shoot: &Shoot<impl Model>,
    rod: &Rod,
    load: &impl Load,
    reactions: &[Reaction],
    steady: &SteadyLaws,
) -> Result<(), StabilityError> {
    let scene = shoot.model.scene();
    // At a discontinuity the right limit is used.
    let time = shoot.environment().time;
    let at_present = InternalForce::of(rod, load, &scene.environment(time));
    let (mut change, mut causes) = (0.0_f64, 0.0_f64);
    // Incommensurate times, from seconds to days: they are not multiples of a common period.
    for later in [1.0, 7.3, 101.1, 977.7, 6151.3, 40_009.9].map(|after| time + after) {
        // A motion of the base does not change the stimuli on a given rod.
        change = change.max(change_of_base(scene, (time, later), rod.length()) / rod.length());
        let mut force = InternalForce::of(rod, load, &scene.environment(later));
        // For a given shape, a force does not change the stimuli, and REGR does not change the
        // gradients.
        causes = causes.max(change_of_causes(shoot, rod, &at_present, &force));
        force.react(rod, reactions);
        let then = SteadyLaws::of(shoot, rod, &force);
        for (then, now) in then.gradients.iter().zip(&steady.gradients) {
            change = change.max((then - now).norm());
        }
    }
    // The thresholds allow for the rounding of gradients of the size of 1/radius, and of forces,
    // REGR and supports in whose computation the time cancels.
    if change > 1e-12 / steady.radius() || causes > 1e-12 {
        return Err(StabilityError::NotAutonomous {
            change: change.max(causes / rod.length()),
        });
    }
    Ok(())
}

/// The change of the base between two times (s): of its frame in radians, of its position relative
/// to a length (m).
pub(crate) fn change_of_base(scene: &impl Scene, (now, then): (f64, f64), length: f64) -> f64 {
    let moved = (scene.position(now) - scene.position(then)).norm() / length;
    scene.base(now).angle_to(&scene.base(then)).max(moved)
}

/// The largest change of force, REGR and support of a rod, relative, between the times of two
/// forces in it.
pub(crate) fn change_of_causes(
    shoot: &Shoot<impl Model>,
    rod: &Rod,
    now: &InternalForce,
    then: &InternalForce,
) -> f64 {
    let pairs = now.at_points().iter().zip(then.at_points());
    let force = pairs
        .map(|(one, other)| relative((one - other).norm(), now.largest(), then.largest()))
        .fold(0.0, f64::max);
    let regr = rod.points()[rod.zone()].iter().map(|point| {
        let [a, b] = [now, then].map(|force| {
            shoot
                .model
                .growth()
                .regr(point.apex_distance, force.environment().time)
        });
        relative((a - b).abs(), a.abs(), b.abs())
    });
    let times = (now.environment().time, then.environment().time);
    regr.fold(force, f64::max)
        .max(change_of_support(shoot.model.support(), rod, times))
}
