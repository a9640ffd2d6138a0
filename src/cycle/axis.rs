//! Checks that a shoot is invariant under rotations about the tangent of the base.

use nalgebra::DVector;

use super::autonomous::ROUNDING;
use super::error::CycleError;
use super::map::phase_state::PhaseState;
use super::map::return_map::{PRECISE, ReturnMap, Stage, Trajectory};
use super::map::rotation::StateRotation;
use super::rotated::turned;
use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
use crate::linear::visit_stimuli;
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::tropism::{Declaration, Rotation, TropismLaw};

/// Refuses elasticity, loads or a scene that leave a rod at rest no longer at rest when it has been turned by an angle (rad).
pub(super) fn check_rest(shoot: &Shoot<impl Model>, rod: &Rod, angle: f64) -> Result<(), CycleError> {
    let mut rod = turned(rod, angle);
    let before = rod.tip();
    let force = InternalForce::of(&rod, shoot.model.load(), &shoot.environment());
    let mut solver = NewtonSolver::with_tolerance(PRECISE);
    let _ = solver.equilibrate(&mut rod, shoot.model.constitutive(), &force)?;
    let defect = (rod.tip() - before).norm() / rod.length();
    broken("elasticity, the section, a load or gravity", defect)
}

/// Refuses an axis that is broken by more than rounding.
pub(super) fn broken(what: &'static str, defect: f64) -> Result<(), CycleError> {
    if defect < ROUNDING { Ok(()) } else { Err(CycleError::NoAxis { what, defect }) }
}

/// The gradient that counts as none, of a shoot of this length (m): the angles' rounding is no share of the bend of a shoot that hardly
/// bends.
pub(super) fn least_gradient(length: f64) -> f64 {
    0.01 / length
}

/// Returns an error unless the equations of a relative periodic orbit are invariant under rotation: rotated shapes along the orbit
/// must be equilibria, and the responses of the laws must rotate with them.
pub(super) fn check_axis(return_map: &ReturnMap<impl Model>, path: &Trajectory, period: f64) -> Result<(), CycleError> {
    let Some(turn) = &return_map.turn else { return Ok(()) };
    for (n, stages) in path.stages.iter().enumerate() {
        // The angle of the orbit, and another angle for each interval.
        for angle in [turn.angle, 1.0 + n as f64] {
            let Some(stage) = stages.first() else { continue };
            check_rest(return_map.shoot, &stage.rod, angle)?;
            check_laws(return_map, &turn.by(-angle), stage, period)?;
        }
    }
    Ok(())
}

/// Refuses laws that make something else of a stage that is turned, by the inverse of `turn`.
fn check_laws(
    return_map: &ReturnMap<impl Model>,
    turn: &StateRotation,
    stage: &Stage,
    period: f64,
) -> Result<(), CycleError> {
    let (shoot, law) = (return_map.shoot, return_map.shoot.model.tropism());
    let (v, m, p) = (return_map.variables, return_map.stimuli, return_map.places.len());
    let state = |strain: &DVector<f64>, variables: &DVector<f64>| PhaseState {
        strain: strain.clone(),
        variables: variables.clone(),
        slopes: Vec::new(),
    };
    // Gradients and rates, of stimuli, of variables and of what is read of them.
    let answer = |stimuli: &DVector<f64>, variables: &DVector<f64>, past: &DVector<f64>| {
        let (mut gradients, mut rates) = (DVector::zeros(2 * p), DVector::zeros(v * p));
        for (i, at) in return_map.places.iter().enumerate() {
            let x = &stimuli.as_slice()[i * m..(i + 1) * m];
            let own = i * v..(i + 1) * v;
            law.rates(&variables.as_slice()[own.clone()], x, &mut rates.as_mut_slice()[own.clone()]);
            let gradient = law.gradient(at, &past.as_slice()[own], law.size().present(x));
            gradients.rows_mut(2 * i, 2).copy_from(&gradient.xy());
        }
        state(&gradients, &rates)
    };
    let rod = turned(&stage.rod, -turn.angle);
    let force = InternalForce::of(&rod, shoot.model.load(), &shoot.environment());
    let mut stimuli = stage.stimuli.clone();
    visit_stimuli(shoot, &rod, &force, |i, _, x| stimuli.as_mut_slice()[i * m..(i + 1) * m].copy_from_slice(x));
    let [variables, past] =
        [&stage.variables, &stage.past].map(|values| turn.back(&state(&stage.strain, values)).variables);
    let expected = turn.back(&answer(&stage.stimuli, &stage.variables, &stage.past));
    let found = answer(&stimuli, &variables, &past);
    let least = least_gradient(rod.length());
    broken("tropism", (found.strain - &expected.strain).amax() / expected.strain.amax().max(least))?;
    // The rate of a variable that relaxes fast is a difference of large numbers. Of a pair the larger counts.
    let laws = Declaration::of(law);
    for (a, variable) in laws.variables().iter().enumerate() {
        let one =
            |all: &DVector<f64>, a: usize| all.iter().skip(a).step_by(v).fold(0.0_f64, |most, x| most.max(x.abs()));
        let largest = |all: &DVector<f64>| match variable.rotation {
            Rotation::First => one(all, a).max(one(all, a + 1)),
            Rotation::Second => one(all, a - 1).max(one(all, a)),
            _ => one(all, a),
        };
        let usual = largest(&stage.variables) / variable.time_constant.min(period);
        let size = largest(&expected.variables).max(usual).max(f64::MIN_POSITIVE);
        broken("tropism", largest(&(&found.variables - &expected.variables)) / size)?;
    }
    Ok(())
}
