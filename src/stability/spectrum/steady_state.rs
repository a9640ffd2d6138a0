//! Steady states of a shoot.

use nalgebra::Vector3;

use super::characteristic::CharacteristicMatrix;
use crate::equilibrium::{EquilibriumSolver, NewtonSolver, Unloaded};
use crate::error::ensure;
use crate::linearisation::{
    Outcome, StabilityError, SteadyLaws, check_autonomous, check_steady, equilibrate,
    precise_solver, stimulus_derivatives,
};
use crate::load::{InternalForce, Load};
use crate::model::{Model, Scene};
use crate::rod::Rod;
use crate::sensing::visit_sites;
use crate::shoot::Shoot;
use crate::state::ContactState;
use crate::support::{Reaction, Support};

/// Largest gradient of the laws in a steady state, relative to 1/radius: above the rounding of an
/// equilibrium, and a hundredth of what a linearisation allows.
const TOLERANCE: f64 = 1e-10;

/// Brings a shoot into a steady state at its present time: into the equilibrium in which the growth
/// gradients of its laws vanish, u̇* = 0, up to 1e-10 of 1/radius. The equilibrium may be
/// mechanically unstable, which a [`Linearisation`](crate::stability::Linearisation) reports. Start
/// an integrator with [`ConstantHistory::Steady`](crate::integrator::ConstantHistory::Steady) to
/// keep the shoot there.
///
/// Laws sense the shape, so that the visible strain is found first, without load and stiffness. The
/// intrinsic strain that keeps it under the load follows point by point. A few Newton iterations
/// for the whole then remove the difference that is due to the discretisation. With a support the
/// intrinsic strain balances the reactions as well.
///
/// # Errors
/// Laws or supports that are not autonomous or permit no steady state, no equilibrium, or a shoot
/// that touches an obstacle. The shoot is then unchanged.
pub fn solve_steady_state(shoot: &mut Shoot<impl Model>) -> Result<(), StabilityError> {
    let mut rod = shoot.state.rod.clone();
    solve_rod(shoot, &mut rod)?;
    shoot.state.rod = rod;
    shoot.state.contact = ContactState::default();
    Ok(())
}

/// Brings a rod, instead of that of the shoot, into a steady state under the shoot's laws. After an
/// error the rod is not usable.
pub(super) fn solve_rod(shoot: &Shoot<impl Model>, rod: &mut Rod) -> Outcome {
    let environment = shoot.environment();
    let (load, support, scene) = (
        shoot.model.load(),
        shoot.model.support(),
        shoot.model.scene(),
    );
    rod.place_base(
        (
            scene.base(environment.time),
            scene.position(environment.time),
        ),
        support.base(),
    )?;
    // The shape, as that of an unloaded rod, which has the visible strain as its intrinsic strain.
    let (mut shape, p) = (rod.clone(), rod.order().points());
    for (i, point) in shape.points.iter_mut().enumerate() {
        point.intrinsic = rod.strain_at_point(i / p, i % p);
    }
    iterate(
        shoot,
        &mut shape,
        (&(), &()),
        &[],
        &mut Unloaded,
        0.1 * TOLERANCE,
    )?;
    let error = unresolved(&shape);
    // The threshold lies between the discretisation error of a resolved shape and the rotation by
    // an oscillation between the points.
    if error > 0.1 {
        let (by_strain, _) =
            stimulus_derivatives(shoot, &shape, &InternalForce::of(&shape, &(), &environment));
        ensure(
            by_strain.iter().flatten().any(|slope| *slope != 0.0),
            StabilityError::NoProprioception,
        )?;
        let (elements, what) = (
            rod.elements() - rod.first_growing,
            "the shape of the steady state (rad)",
        );
        return Err(StabilityError::UnderResolved {
            elements,
            what,
            error,
        });
    }
    // The visible strain is the sum of the elastic strain under the couple and the intrinsic
    // strain.
    let material = shoot.model.constitutive();
    let mut force = InternalForce::of(&shape, load, &environment);
    if !support.is_absent() {
        let reactions = NewtonSolver::default().reactions_at(
            &shape,
            material,
            (load, support),
            &environment,
            shoot.reactions(),
        )?;
        force.react(&shape, &reactions);
    }
    rod.clone_from(&shape);
    let first = rod.zone().start;
    visit_sites(&shape, material, &force, false, |i, site| {
        let intrinsic = shape.points()[first + i].intrinsic;
        rod.points[first + i].intrinsic = intrinsic + (intrinsic - site.strain);
    });
    iterate(
        shoot,
        rod,
        (load, support),
        force.reactions(),
        &mut precise_solver(),
        TOLERANCE,
    )
}

/// Newton's method for the intrinsic strain at which the gradients of the laws vanish on a rod in
/// equilibrium under a load and with a support, from a guess of the reactions. The step is halved
/// until it decreases the residual.
fn iterate(
    shoot: &Shoot<impl Model>,
    rod: &mut Rod,
    (load, support): (&impl Load, &impl Support),
    guess: &[Reaction],
    solver: &mut impl EquilibriumSolver,
    tolerance: f64,
) -> Outcome {
    let environment = shoot.environment();
    let first = rod.zone().start;
    let mut evaluate = |rod: &mut Rod,
                        guess: &[Reaction]|
     -> Result<(InternalForce, SteadyLaws), StabilityError> {
        let (force, _) = equilibrate(
            rod,
            shoot.model.constitutive(),
            (load, support),
            &environment,
            guess,
            solver,
        )?;
        let steady = SteadyLaws::of(shoot, rod, &force);
        check_steady(shoot.model.tropism(), &steady)?;
        Ok((force, steady))
    };
    let (mut force, mut steady) = evaluate(rod, guess)?;
    check_autonomous(shoot, rod, load, force.reactions(), &steady)?;
    for iterations in 0.. {
        let gradient = steady.largest_gradient()?;
        if gradient * steady.radius() <= tolerance {
            break;
        }
        let failed = StabilityError::NotSteadyState {
            iterations,
            gradient,
        };
        ensure(iterations < 50, failed.clone())?;
        // The gradients must vanish at points with a REGR of zero, too: all have a REGR of one
        // here.
        let matrix =
            CharacteristicMatrix::about(shoot, rod, (load, support), |_| 1.0, (&steady, &force))?;
        let step = matrix.steady_step(&steady).ok_or(failed.clone())?;
        let mut fraction = 1.0;
        (*rod, (force, steady)) = loop {
            let mut moved = rod.clone();
            for (&(i, c), value) in matrix.unknowns.iter().zip(step.iter()) {
                moved.points[first + i].intrinsic[c] += fraction * value;
            }
            if let Ok(next) = evaluate(&mut moved, force.reactions())
                && residual(&next.1) < residual(&steady)
            {
                break (moved, next);
            }
            fraction *= 0.5;
            ensure(fraction >= 1e-6, failed.clone())?;
        };
    }
    Ok(())
}

/// Euclidean norm of the gradients, 1/m.
fn residual(steady: &SteadyLaws) -> f64 {
    steady
        .gradients
        .iter()
        .map(Vector3::norm_squared)
        .sum::<f64>()
        .sqrt()
}

/// The largest rotation by the highest polynomial of the intrinsic strain in an element, rad. With
/// one point in an element it is that of half the jump to the next element, or of the whole strain
/// if there is only one element.
fn unresolved(rod: &Rod) -> f64 {
    let reference = rod.reference();
    let p = reference.p;
    if p == 1 {
        let turn = |e: usize| rod.points()[e].intrinsic * rod.length_of(e);
        let jumps = (1..rod.elements()).map(|e| 0.5 * (turn(e) - turn(e - 1)).norm());
        return if rod.elements() == 1 {
            turn(0).norm()
        } else {
            jumps.fold(0.0, f64::max)
        };
    }
    // The Legendre coefficient of degree p − 1, from the highest divided difference at the Gauss
    // points.
    let mut largest = 0.0_f64;
    for e in 0..rod.elements() {
        let points = rod.element_points(e);
        let mut sum = Vector3::zeros();
        for g in 0..p {
            let others = (0..p)
                .filter(|&k| k != g)
                .map(|k| reference.points[g] - reference.points[k]);
            sum += points[g].intrinsic / others.product::<f64>();
        }
        // The polynomial of degree n and leading coefficient c that deviates least from zero on [0,
        // 1] is at most 2 c/4ⁿ (Chebyshev).
        largest = largest.max(2.0 * sum.norm() / 4.0_f64.powi(p as i32 - 1) * rod.length_of(e));
    }
    largest
}
