//! Equilibria next to a given one: rods with a small change of the intrinsic strain at one material
//! point.

use crate::equilibrium::{EquilibriumError, NewtonSolver};
use crate::load::{InternalForce, Load};
use crate::model::{Model, Support};
use crate::rod::Rod;
use crate::shoot::Shoot;

/// Angle by which a change of the intrinsic strain at a point bends the shoot, rad. The truncation
/// error of central differences is then 1e-10 of a third derivative, and the rounding error
/// 1e-14/1e-5.
const ANGLE: f64 = 3e-5;

/// A solver for the equilibrium next to the present one, accurate to rounding.
pub(crate) fn precise_solver() -> NewtonSolver {
    NewtonSolver {
        tolerance: 1e-13,
        stable_only: false,
        ..NewtonSolver::default()
    }
}

/// Visits the bent rods for central differences with respect to components of the intrinsic strain.
/// For each unknown `visit` is called twice, with its number, a weight (m), the bent rod in
/// equilibrium and the force in it. The derivative of any value is the sum of weight × value. An
/// unknown is a point, counted from the first of the growth zone, with a component. `rod` must be
/// in equilibrium under the load and with the support, which cause the force.
pub(crate) fn visit_bends(
    shoot: &Shoot<impl Model>,
    rod: &Rod,
    statics: (&impl Load, &impl Support),
    force: &InternalForce,
    unknowns: impl IntoIterator<Item = (usize, usize)>,
    mut visit: impl FnMut(usize, f64, &Rod, &InternalForce),
) -> Result<(), EquilibriumError> {
    let (first, p) = (rod.zone().start, rod.order().points());
    let (mut moved, mut force) = (rod.clone(), force.clone());
    let mut solver = precise_solver();
    let mut tangent = solver.linearise(rod, shoot.model.constitutive(), statics, &mut force)?;
    for (j, (i, c)) in unknowns.into_iter().enumerate() {
        let at = first + i;
        let mut step = ANGLE / (rod.reference().weights[at % p] * rod.points()[at].jacobian);
        for sign in [1.0, -1.0] {
            let mut bend = |step: f64| {
                moved.clone_from(rod);
                moved.points[at].intrinsic[c] += sign * step;
                tangent.follow(&mut moved);
                largest_turn(rod, &moved)
            };
            let turn = bend(step);
            // Next to buckling a small bend rotates frames by much larger angles. Central
            // differences with ten times the angle have an error of 1e-8.
            let longest = 10.0 * ANGLE;
            if sign > 0.0 && turn > longest {
                step *= longest / turn;
                let _ = bend(step);
            }
            visit(j, sign / (2.0 * step), &moved, tangent.force());
        }
    }
    Ok(())
}

/// The largest rotation of a frame at an end of an element, rad.
fn largest_turn(from: &Rod, to: &Rod) -> f64 {
    let turns = from
        .frames()
        .iter()
        .zip(to.frames())
        .map(|(from, to)| 2.0 * (to.coords - from.coords).norm());
    turns.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, UnitQuaternion, Vector3};

    use super::*;
    use crate::constitutive::{LinearElastic, Timoshenko};
    use crate::growth::{Ongoing, UniformGrowth};
    use crate::linearisation::{equilibrate, visit_stimuli};
    use crate::load::Weight;
    use crate::scene::Still;
    use crate::support::{Hold, Joint};
    use crate::tropism::{Gravitropism, Memory, Proprioception, Response, SettledStatoliths};

    const LENGTH: f64 = 0.05;

    /// The response of curvatures and of the horizontal components of the frames to bends at three
    /// points, first by the tangent and then by differences of equilibria, on a rod that is bent in
    /// space and stretches.
    fn responses(support: Box<dyn Support + Send + Sync>) -> [DMatrix<f64>; 2] {
        let memory = Memory {
            time: 720.0,
            delay: 720.0,
        };
        let shoot = Shoot::builder(Timoshenko::circular(LinearElastic {
            youngs_modulus: 1e7,
            poissons_ratio: 0.5,
        }))
        .length(LENGTH)
        .radius(5e-4)
        .elements(4)
        .growth(Ongoing(UniformGrowth {
            zone_length: 0.1,
            time: 72e3,
        }))
        .tropism((
            Gravitropism {
                sensitivity: 0.8,
                perception: SettledStatoliths,
            }
            .remembered(memory),
            Proprioception { sensitivity: 20.0 }.remembered(memory),
        ))
        .load(Weight { density: 1000.0 })
        .scene(Still::tilted(0.5))
        .support(support)
        .into_dyn()
        .build()
        .unwrap();
        let statics = (shoot.model.load(), shoot.model.support());
        let (material, environment, mut solver) = (
            shoot.model.constitutive(),
            shoot.environment(),
            precise_solver(),
        );
        let mut rod = shoot.state.rod.clone();
        rod.set_intrinsic(|point| Vector3::new(200.0 * point.apex_distance, 10.0, 5.0));
        let (force, _) =
            equilibrate(&mut rod, material, statics, &environment, &[], &mut solver).unwrap();
        let (m, unknowns) = (
            shoot.model.tropism().size().stimuli,
            [(1, 0), (6, 1), (13, 0)],
        );
        let mut first = DMatrix::<f64>::zeros(m * rod.zone().len(), unknowns.len());
        let mut second = first.clone();
        let add =
            |out: &mut DMatrix<f64>, j: usize, weight: f64, rod: &Rod, force: &InternalForce| {
                visit_stimuli(&shoot, rod, force, |i, _, stimuli| {
                    stimuli
                        .iter()
                        .enumerate()
                        .for_each(|(k, x)| out[(i * m + k, j)] += weight * x);
                });
            };
        visit_bends(
            &shoot,
            &rod,
            statics,
            &force,
            unknowns,
            |j, weight, moved, force| {
                add(&mut first, j, weight, moved, force);
            },
        )
        .unwrap();
        for (j, (i, c)) in unknowns.into_iter().enumerate() {
            // Richardson's extrapolation from two steps, 1/m.
            for (step, weight) in [
                (0.04, -1.0 / 3.0),
                (-0.04, -1.0 / 3.0),
                (0.02, 4.0 / 3.0),
                (-0.02, 4.0 / 3.0),
            ] {
                let mut moved = rod.clone();
                moved.points[rod.zone().start + i].intrinsic[c] += step;
                let (force, _) = equilibrate(
                    &mut moved,
                    material,
                    statics,
                    &environment,
                    force.reactions(),
                    &mut solver,
                )
                .unwrap();
                add(&mut second, j, weight * 0.5 / step, &moved, &force);
            }
        }
        [first, second]
    }

    #[test]
    fn response_of_a_held_rod_is_that_of_differences_of_equilibria() {
        let frame = UnitQuaternion::from_euler_angles(0.1, 0.4, 0.3);
        let place = Vector3::new(0.02, 0.005, 0.035);
        let supports: [(&str, Box<dyn Support + Send + Sync>); 6] = [
            ("place", Box::new(Hold::apex().at(place))),
            (
                "line and hinge",
                Box::new(
                    Hold::apex()
                        .on_line(place, Vector3::y_axis())
                        .hinged(frame, Vector3::z_axis()),
                ),
            ),
            (
                "frame and spring",
                Box::new((
                    Hold::place(0.5 * LENGTH).held(frame),
                    Hold::apex().spring(place, nalgebra::Matrix3::identity() * 0.01),
                )),
            ),
            (
                "joint and plane",
                Box::new((
                    Hold::place(0.25 * LENGTH).elastic_joint(frame, 1e-5),
                    Hold::apex().on_plane(place, Vector3::x_axis()),
                )),
            ),
            (
                "ball and joint",
                Box::new((
                    Joint::Ball,
                    Hold::place(0.5 * LENGTH).elastic_joint(frame, 1e-5),
                )),
            ),
            (
                "hinge and place",
                Box::new((Joint::Hinge(Vector3::y_axis()), Hold::apex().at(place))),
            ),
        ];
        for (name, support) in supports {
            let [tangent, differences] = responses(support);
            // The extrapolated differences have a truncation error of fourth order in bends of 1e-4
            // rad, and a rounding error of 1e-13 over the bend. The error of both methods is
            // largest next to a loss of stability.
            let error = (&tangent - &differences).amax() / tangent.amax();
            assert!(error < 1e-6, "{name}: {error:e}");
        }
    }
}
