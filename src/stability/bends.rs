//! What small bends of a shoot at rest change, point by point.

use crate::equilibrium::{EquilibriumError, NewtonSolver};
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;

/// A disturbance of a point's intrinsic strain bends the shoot by this angle, rad. Central differences then err by 1e-10
/// of a third derivative, and rounding by 1e-14 over it.
const ANGLE: f64 = 3e-5;

/// Next to buckling a small bend turns the shoot by far more, and it is shortened until no frame turns further than this,
/// rad: central differences then err by 1e-8 of what they are.
const LARGEST_TURN: f64 = 10.0 * ANGLE;

/// Central differences by components of the intrinsic strain: for each of them `visit` is called twice, with its number, a weight
/// (m) and the rod that is bent by it and at rest. The derivative is the sum of weight × value. The unknowns are points, counted
/// from the growth zone's first, with a component. The rod is in equilibrium under the force.
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
            if sign > 0.0 && turn > LARGEST_TURN {
                step *= LARGEST_TURN / turn;
                let _ = bend(step);
            }
            visit(j, sign / (2.0 * step), &moved);
        }
    }
    Ok(())
}

/// The largest turn of a frame at an end of an element, rad.
fn largest_turn(from: &Rod, to: &Rod) -> f64 {
    let turns = from.frames().iter().zip(to.frames()).map(|(from, to)| 2.0 * (to.coords - from.coords).norm());
    turns.fold(0.0, f64::max)
}
