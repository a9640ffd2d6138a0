//! Symmetries that the equations of an orbit assume: shifts in time, and rotations about the
//! tangent of the base.
//!
//! They are checked by trial: a shape on the orbit, with its forces and variables, is transformed,
//! and the laws are evaluated again. A user's law then has nothing to declare, and a wrong
//! declaration is detected.

use nalgebra::{DVector, Vector3};

use super::error::{CycleError, Outcome};
use super::map::{PRECISE, PhaseState, ROUNDING, ReturnMap, Stage, StateRotation, Trajectory};
use super::rotated::rotated;
use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
use crate::error::ensure;
use crate::linearisation::{self, SteadyLaws, change_of_causes, visit_stimuli};
use crate::load::InternalForce;
use crate::model::{Model, Scene};
use crate::numerics::scalar::relative;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::tropism::{Rotation, TropismLaw};

/// Returns an error if laws, loads, growth, the scene or the support depend on time. The rod is
/// bent, so that all of them have an effect.
pub(super) fn check_autonomous(shoot: &Shoot<impl Model>, rod: &Rod) -> Outcome {
    let load = shoot.model.load();
    let steady = SteadyLaws::of(
        shoot,
        rod,
        &InternalForce::of(rod, load, &shoot.environment()),
    );
    Ok(linearisation::check_autonomous(
        shoot,
        rod,
        load,
        &[],
        &steady,
    )?)
}

/// Returns an error unless laws, loads, growth, the scene and the support are periodic with a
/// period (s), at incommensurate phases.
pub(super) fn check_periodic(shoot: &Shoot<impl Model>, rod: &Rod, period: f64) -> Outcome {
    let (load, scene) = (shoot.model.load(), shoot.model.scene());
    let mut change = 0.0_f64;
    for phase in [0.0, 0.171, 0.377, 0.593, 0.811] {
        let [now, then] =
            [phase, phase + 1.0].map(|periods| shoot.environment().time + periods * period);
        let forces = [now, then].map(|time| InternalForce::of(rod, load, &scene.environment(time)));
        change = change.max(linearisation::change_of_base(
            scene,
            (now, then),
            rod.length(),
        ));
        change = change.max(change_of_causes(shoot, rod, &forces[0], &forces[1]));
        let [a, b] = forces.map(|force| SteadyLaws::of(shoot, rod, &force).gradients);
        let [first, second] = [&a, &b].map(|all| all.iter().map(Vector3::norm).fold(0.0, f64::max));
        let changes = a
            .iter()
            .zip(&b)
            .map(|(one, other)| relative((one - other).norm(), first, second));
        change = changes.fold(change, f64::max);
    }
    // A phase after many periods has that many roundings.
    let what = "the forcing must be the same after the given period, which all laws, loads and the scene must have (s)";
    ensure(
        change < 0.1 * ROUNDING,
        CycleError::NotInvariant { what, change },
    )
}

/// Returns an error unless a rod in equilibrium is in equilibrium after a rotation by an angle
/// (rad).
pub(super) fn check_equilibrium(shoot: &Shoot<impl Model>, rod: &Rod, angle: f64) -> Outcome {
    let mut rod = rotated(rod, angle);
    let before = rod.tip();
    let force = InternalForce::of(&rod, shoot.model.load(), &shoot.environment());
    let mut solver = NewtonSolver::with_tolerance(PRECISE);
    let _ = solver.equilibrate(&mut rod, shoot.model.constitutive(), &force)?;
    let what = "the equilibrium (elasticity, section, load and gravity) must be symmetric about the tangent of the base";
    check_rotation(what, (rod.tip() - before).norm() / rod.length())
}

/// Returns an error unless the relative change of the growth gradients under a rotation is
/// rounding.
pub(super) fn check_tropism(change: f64) -> Outcome {
    check_rotation(
        "the tropism must be symmetric about the tangent of the base",
        change,
    )
}

fn check_rotation(what: &'static str, change: f64) -> Outcome {
    ensure(change < ROUNDING, CycleError::NotInvariant { what, change })
}

/// Smallest growth gradient relative to which a change is measured, for a shoot of a length (m).
/// Smaller ones are rounding of the angles.
pub(super) fn least_gradient(length: f64) -> f64 {
    0.01 / length
}

impl<M: Model> ReturnMap<'_, M> {
    /// Returns an error unless the equations of a relative periodic orbit commute with rotations:
    /// rotated shapes along the orbit are equilibria, and gradients and rates of the laws rotate
    /// with them.
    pub(super) fn check_axis(&self, path: &Trajectory) -> Outcome {
        let Some(turn) = &self.turn else {
            return Ok(());
        };
        for (n, stages) in path.stages.iter().enumerate() {
            // The angle of the orbit, and another angle for each interval.
            for angle in [turn.angle, 1.0 + n as f64] {
                let Some(stage) = stages.first() else {
                    continue;
                };
                check_equilibrium(self.shoot, &stage.rod, angle)?;
                self.check_laws(&turn.by(-angle), stage, path.period)?;
            }
        }
        Ok(())
    }

    /// Returns an error unless gradients and rates of the laws at a stage commute with the inverse
    /// of a rotation.
    fn check_laws(&self, turn: &StateRotation, stage: &Stage, period: f64) -> Outcome {
        let (shoot, law) = (self.shoot, self.shoot.model.tropism());
        let (v, m, p) = self.sizes();
        let state = |strain: &DVector<f64>, variables: &DVector<f64>| PhaseState {
            strain: strain.clone(),
            variables: variables.clone(),
            slopes: Vec::new(),
        };
        let evaluate = |stimuli: &DVector<f64>, variables: &DVector<f64>, past: &DVector<f64>| {
            let (mut gradients, mut rates) = (DVector::zeros(2 * p), DVector::zeros(v * p));
            for (i, at) in self.places.iter().enumerate() {
                let x = &stimuli.as_slice()[i * m..(i + 1) * m];
                let own = i * v..(i + 1) * v;
                law.rates(
                    &variables.as_slice()[own.clone()],
                    x,
                    &mut rates.as_mut_slice()[own.clone()],
                );
                let gradient = law.gradient(at, &past.as_slice()[own], law.size().present(x));
                gradients.rows_mut(2 * i, 2).copy_from(&gradient.xy());
            }
            state(&gradients, &rates)
        };
        let rod = rotated(&stage.rod, -turn.angle);
        let force = InternalForce::of(&rod, shoot.model.load(), &shoot.environment());
        let mut stimuli = stage.stimuli.clone();
        visit_stimuli(shoot, &rod, &force, |i, _, x| {
            stimuli.as_mut_slice()[i * m..(i + 1) * m].copy_from_slice(x)
        });
        let [variables, past] = [&stage.variables, &stage.past]
            .map(|values| turn.back(&state(&stage.strain, values)).variables);
        let expected = turn.back(&evaluate(&stage.stimuli, &stage.variables, &stage.past));
        let found = evaluate(&stimuli, &variables, &past);
        let least = least_gradient(rod.length());
        check_tropism(
            (found.strain - &expected.strain).amax() / expected.strain.amax().max(least),
        )?;
        // The rate of a fast variable is a difference of large terms, of the size of the variable
        // over its time constant.
        for (a, variable) in self.laws.variables().iter().enumerate() {
            let one = |all: &DVector<f64>, a: usize| {
                all.iter()
                    .skip(a)
                    .step_by(v)
                    .fold(0.0_f64, |most, x| most.max(x.abs()))
            };
            let largest = |all: &DVector<f64>| match variable.rotation {
                Rotation::First => one(all, a).max(one(all, a + 1)),
                Rotation::Second => one(all, a - 1).max(one(all, a)),
                _ => one(all, a),
            };
            let usual = largest(&stage.variables) / variable.time_constant.min(period);
            let size = largest(&expected.variables)
                .max(usual)
                .max(f64::MIN_POSITIVE);
            check_tropism(largest(&(&found.variables - &expected.variables)) / size)?;
        }
        Ok(())
    }
}
