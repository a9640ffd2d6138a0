//! Equilibria of shoots with and without a support.

use crate::constitutive::Constitutive;
use crate::equilibrium::{Equilibrium, EquilibriumError, EquilibriumSolver, HeldRod, Past};
use crate::error::ParameterError;
use crate::load::{InternalForce, Load};
use crate::rod::Rod;
use crate::scene::Environment;
use crate::support::{Reaction, Support};

/// Brings a rod into equilibrium under a load and with a support, and returns the force in it with
/// the reactions. `guess` are the reactions of an earlier equilibrium.
///
/// # Errors
/// Errors of the solver, or an equilibrium in which the rod touches an obstacle: the forces of
/// contacts are not differentiable where contacts begin and end.
pub(crate) fn equilibrate(
    rod: &mut Rod,
    material: &impl Constitutive,
    (load, support): (&impl Load, &impl Support),
    environment: &Environment,
    guess: &[Reaction],
    solver: &mut impl EquilibriumSolver,
) -> Result<(InternalForce, Equilibrium), EquilibriumError> {
    let mut force = InternalForce::of(rod, load, environment);
    if support.is_absent() {
        let found = solver.equilibrate(rod, material, &force)?;
        return Ok((force, found));
    }
    let past = Past {
        earlier: (guess, &[]),
        ..Past::default()
    };
    let held = solver.hold(&HeldRod {
        rod,
        material,
        load,
        support,
        environment,
        past,
    })?;
    let (name, contacts) = ("number of contacts with obstacles", held.patches.len());
    let requirement = "zero for steady states, linear stability and cycles";
    ParameterError::unless(contacts == 0, name, contacts as f64, requirement)?;
    rod.copy_shape(&held.rod);
    force.react(rod, &held.reactions);
    Ok((force, held.equilibrium))
}
