//! What must be the same after a turn about the tangent of the base.

use nalgebra::DVector;

use super::error::CycleError;
use super::map::march::{March, PRECISE, Path};
use super::map::state::Start;
use super::sensitivity::look;
use super::turned::turned;
use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::tropism::TropismLaw;

/// What breaks the axis by more than this of itself is no rounding: forces and couples are known to 1e-11.
const AXIAL: f64 = 1e-8;
/// An angle that is no part of a turn, rad: what is the same after it has an axis.
const SOME: f64 = 1.0;

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
    if defect < AXIAL { Ok(()) } else { Err(CycleError::NoAxis { what, defect }) }
}

/// The gradient that counts as none, of a shoot of this length (m): the angles' rounding is no share of the bend of a shoot that hardly
/// bends.
pub(super) fn least_gradient(length: f64) -> f64 {
    0.01 / length
}

/// Where a cycle may come back turned, refuses what is not the same after a turn: the shape that is bent most must be at rest then, too,
/// and what the laws make of it must have turned with it.
pub(super) fn check_axis(march: &March<impl Model>, path: &Path, period: f64) -> Result<(), CycleError> {
    let stages = path.stages.iter().flatten();
    let most = stages.max_by(|a, b| a.strain.norm().total_cmp(&b.strain.norm()));
    let (Some(turn), Some(stage)) = (&march.turn, most) else { return Ok(()) };
    let (shoot, law) = (march.shoot, march.shoot.model.tropism());
    check_rest(shoot, &stage.rod, SOME)?;
    let mut turn = turn.clone();
    turn.angle = -SOME;
    let (v, m, p) = (march.variables, march.stimuli, march.places.len());
    let state = |strain: &DVector<f64>, variables: &DVector<f64>| Start {
        strain: strain.clone(),
        variables: variables.clone(),
        slopes: Vec::new(),
    };
    // Gradients and rates, of stimuli, of variables and of what is read of them.
    let answer = |stimuli: &DVector<f64>, variables: &DVector<f64>, past: &DVector<f64>| {
        let (mut gradients, mut rates) = (DVector::zeros(2 * p), DVector::zeros(v * p));
        for (i, at) in march.places.iter().enumerate() {
            let x = &stimuli.as_slice()[i * m..(i + 1) * m];
            let own = i * v..(i + 1) * v;
            law.rates(&variables.as_slice()[own.clone()], x, &mut rates.as_mut_slice()[own.clone()]);
            let gradient = law.gradient(at, &past.as_slice()[own], law.size().present(x));
            gradients.rows_mut(2 * i, 2).copy_from(&gradient.xy());
        }
        state(&gradients, &rates)
    };
    let rod = turned(&stage.rod, SOME);
    let force = InternalForce::of(&rod, shoot.model.load(), &shoot.environment());
    let mut stimuli = stage.stimuli.clone();
    look(shoot, &rod, &force, |i, x| stimuli.as_mut_slice()[i * m..(i + 1) * m].copy_from_slice(x));
    let [variables, past] =
        [&stage.variables, &stage.past].map(|values| turn.back(&state(&stage.strain, values)).variables);
    let expected = turn.back(&answer(&stage.stimuli, &stage.variables, &stage.past));
    let found = answer(&stimuli, &variables, &past);
    let slow = stage.variables.amax() / period;
    for (found, expected, least) in
        [(found.strain, expected.strain, least_gradient(rod.length())), (found.variables, expected.variables, slow)]
    {
        let size = expected.amax().max(least).max(f64::MIN_POSITIVE);
        broken("tropism", (found - expected).amax() / size)?;
    }
    Ok(())
}
