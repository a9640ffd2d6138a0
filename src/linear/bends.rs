//! Equilibria next to a given one: rods with a small change of the intrinsic strain at one material point.

use crate::equilibrium::{EquilibriumError, NewtonSolver};
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;

/// Angle by which a change of the intrinsic strain at a point bends the shoot, rad. The truncation error of
/// central differences is then 1e-10 of a third derivative, and the rounding error 1e-14/1e-5.
const ANGLE: f64 = 3e-5;

/// A solver for the equilibrium next to the present one, accurate to rounding.
pub(crate) fn precise_solver() -> NewtonSolver {
    NewtonSolver { tolerance: 1e-13, stable_only: false, ..NewtonSolver::default() }
}

/// Visits the bent rods for central differences with respect to components of the intrinsic strain. For each
/// unknown `visit` is called twice, with its number, a weight (m) and the bent rod in equilibrium. The
/// derivative of any value is the sum of weight × value. An unknown is a point, counted from the first of the
/// growth zone, with a component. `rod` must be in equilibrium under the force.
pub(crate) fn visit_bends(
    shoot: &Shoot<impl Model>,
    rod: &Rod,
    force: &InternalForce,
    solver: &mut NewtonSolver,
    unknowns: impl IntoIterator<Item = (usize, usize)>,
    mut visit: impl FnMut(usize, f64, &Rod),
) -> Result<(), EquilibriumError> {
    let (first, p) = (rod.zone().start, rod.order().points());
    let mut tangent = solver.linearise(rod, shoot.model.constitutive(), force)?;
    let mut moved = rod.clone();
    for (j, (i, c)) in unknowns.into_iter().enumerate() {
        let at = first + i;
        let mut step = ANGLE / (rod.reference().weights[at % p] * rod.points()[at].jacobian);
        for sign in [1.0, -1.0] {
            let mut bend = |step: f64| {
                moved.clone_from(rod);
                moved.points_mut()[at].intrinsic[c] += sign * step;
                tangent.follow(&mut moved);
                largest_turn(rod, &moved)
            };
            let turn = bend(step);
            // Next to buckling a small bend rotates frames by much larger angles. Central differences with ten
            // times the angle have an error of 1e-8.
            let longest = 10.0 * ANGLE;
            if sign > 0.0 && turn > longest {
                step *= longest / turn;
                let _ = bend(step);
            }
            visit(j, sign / (2.0 * step), &moved);
        }
    }
    Ok(())
}

/// The largest rotation of a frame at an end of an element, rad.
fn largest_turn(from: &Rod, to: &Rod) -> f64 {
    let turns = from.frames().iter().zip(to.frames()).map(|(from, to)| 2.0 * (to.coords - from.coords).norm());
    turns.fold(0.0, f64::max)
}
