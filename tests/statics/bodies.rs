//! Obstacles with edges, and obstacles of several surfaces.

use std::f64::consts::FRAC_PI_2;

use approx::{assert_abs_diff_eq, assert_relative_eq};

use crate::fixtures::held::Held;
use crate::fixtures::rods::bending_stiffness;
use crate::fixtures::shoots::{RADIUS, WEIGHT, tissue};
use morphorod::constitutive::Constitutive;
use morphorod::equilibrium::NewtonSolver;
use morphorod::load::{Load, Weight};
use morphorod::rod::Rod;
use morphorod::support::{
    Contact, ConvexPolyhedron, Cuboid, Cylinder, Distance, HalfSpace, Obstacle, Reaction, Support,
    Union,
};
use morphorod::{Order, Scene, Still};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Length, m.
const LENGTH: f64 = 0.05;

/// Equilibrium of a straight heavy rod, clamped horizontally along e1, with a support.
fn horizontal(support: &dyn Support) -> Held<Weight> {
    let mut held = Held::straight(LENGTH, FRAC_PI_2, 10, WEIGHT);
    held.hold(support);
    held
}

/// A box below the rod with its upper far edge through (0.6, 0, −0.02) of the length, turned about
/// e3.
fn table() -> Cuboid {
    let frame = UnitQuaternion::from_scaled_axis(Vector3::z() * 0.3);
    let half_edges = Vector3::new(0.1, 0.5, 0.2) * LENGTH;
    let edge = Vector3::new(0.6, 0.0, -0.02) * LENGTH;
    Cuboid {
        centre: edge - frame * Vector3::new(half_edges.x, 0.0, half_edges.z),
        frame,
        half_edges,
    }
}

#[test]
fn rod_bends_over_an_edge_as_over_a_cylinder() {
    let table = table();
    let [along, out] = [Vector3::y(), Vector3::x()].map(|axis| table.frame * axis);
    let through = Vector3::new(0.6, 0.0, -0.02) * LENGTH;
    // The centre line has the distance of the rod's radius from the edge. A part of it is the
    // radius of the cylinder.
    let cylinder = Cylinder {
        through,
        along,
        radius: 0.3 * RADIUS,
    };
    let half = |normal: Vector3<f64>| HalfSpace { through, normal };
    let ridge = ConvexPolyhedron::new(vec![half(Vector3::z()), half(out)]).unwrap();
    let over = horizontal(&Contact {
        obstacle: cylinder,
        radius: 0.7 * RADIUS,
        friction: 0.0,
    });
    let normal = cylinder
        .distance(&over.place(over.reactions[0].arc_length / LENGTH), 0.0)
        .normal;
    assert!(
        normal.z > 0.01 && normal.dot(&out) > 0.01,
        "the contact is between both faces: {normal}"
    );
    let bodies: [&dyn Obstacle; 2] = [&table, &ridge];
    for obstacle in bodies {
        let held = horizontal(&Contact {
            obstacle,
            radius: RADIUS,
            friction: 0.0,
        });
        println!("{}", held.found);
        // Near the contact all distances are the same function. The place of contact has an error
        // of 1e-9 lengths.
        assert_eq!((held.reactions.len(), over.reactions.len()), (1, 1));
        let (force, expected) = (held.reaction().0, over.reaction().0);
        assert_abs_diff_eq!(
            (force - expected).norm(),
            0.0,
            epsilon = 1e-9 * expected.norm()
        );
        assert_abs_diff_eq!(
            (held.rod.tip() - over.rod.tip()).norm(),
            0.0,
            epsilon = 1e-10 * LENGTH
        );
    }
}

#[test]
fn contact_of_radius_zero_with_an_edge_is_refused() {
    let mut held = Held::straight(LENGTH, FRAC_PI_2, 10, WEIGHT);
    let bodies: [Box<dyn Obstacle>; 2] = [Box::new(table()), Box::new(Union(vec![table()]))];
    for obstacle in bodies {
        held.assert_refused(
            &Contact {
                obstacle,
                radius: 0.0,
                friction: 0.0,
            },
            "an obstacle with edges",
        );
    }
}

#[test]
fn apex_rests_on_a_face_as_on_a_plane() {
    let through = Vector3::z() * (-0.1 * LENGTH);
    let half_edges = Vector3::new(0.5, 0.3, 0.1) * LENGTH;
    let centre = through + Vector3::new(1.0, 0.0, 0.0) * LENGTH - Vector3::z() * half_edges.z;
    let block = Cuboid {
        centre,
        frame: UnitQuaternion::identity(),
        half_edges,
    };
    let plane = HalfSpace {
        through,
        normal: Vector3::z(),
    };
    let on = |obstacle: &dyn Obstacle| {
        horizontal(&Contact {
            obstacle,
            radius: RADIUS,
            friction: 0.0,
        })
    };
    let (block, plane) = (on(&block), on(&plane));
    assert_relative_eq!(
        block.reaction().0.z,
        plane.reaction().0.z,
        epsilon = 0.0,
        max_relative = 1e-10
    );
    assert_abs_diff_eq!(
        (block.rod.tip() - plane.rod.tip()).norm(),
        0.0,
        epsilon = 1e-11 * LENGTH
    );
}

/// The sides of a groove along e1 at a depth of a tenth of the length. One is steeper than the
/// other.
fn sides() -> [HalfSpace; 2] {
    let side = |y: f64| HalfSpace {
        through: Vector3::z() * (-0.1 * LENGTH),
        normal: Vector3::new(0.0, y, 1.0),
    };
    [side(-1.0), side(0.5)]
}

/// The force and the named surface of a reaction.
fn named(reaction: &Reaction) -> (Vector3<f64>, Option<usize>, usize) {
    (reaction.force, reaction.obstacle, reaction.surface)
}

#[test]
fn union_of_two_half_spaces_acts_as_two_contacts() {
    for friction in [0.0, 0.3] {
        let separate = horizontal(
            &sides()
                .map(|obstacle| Contact {
                    obstacle,
                    radius: RADIUS,
                    friction,
                })
                .to_vec(),
        );
        let other = HalfSpace {
            through: Vector3::z() * -LENGTH,
            normal: Vector3::z(),
        };
        // The union is the second obstacle of its support.
        let groove = Contact {
            obstacle: Union(sides().to_vec()),
            radius: RADIUS,
            friction,
        };
        let union = horizontal(&(
            Contact {
                obstacle: other,
                radius: RADIUS,
                friction,
            },
            groove,
        ));
        println!("{}", union.found);
        assert_eq!(separate.reactions.len(), 2, "{:?}", separate.reactions);
        // The rods differ in the surfaces that their reactions name.
        assert_eq!(union.rod.frames(), separate.rod.frames());
        assert_eq!(
            union.rod.centre_line_at(401),
            separate.rod.centre_line_at(401)
        );
        for (i, (one, both)) in separate.reactions.iter().zip(&union.reactions).enumerate() {
            assert_eq!(
                (named(one), named(both)),
                ((one.force, Some(i), 0), (one.force, Some(1), i))
            );
        }
    }
}

/// An obstacle on springs of a compliance (m/N), displaced by a vector (m).
struct Sprung<O>(O, Matrix3<f64>, Vector3<f64>);

impl<O: Obstacle> Obstacle for Sprung<O> {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        self.0.distance(&(place - self.2), time)
    }

    fn surfaces(&self) -> usize {
        self.0.surfaces()
    }

    fn distance_to(&self, surface: usize, place: &Vector3<f64>, time: f64) -> Distance {
        self.0.distance_to(surface, &(place - self.2), time)
    }

    fn has_edges(&self) -> bool {
        self.0.has_edges()
    }

    fn compliance(&self) -> Matrix3<f64> {
        self.1
    }
}

#[test]
fn union_on_springs_moves_by_the_forces_on_all_of_its_surfaces() {
    let unit = LENGTH.powi(3) / bending_stiffness();
    let compliance = Matrix3::new(1.0, 0.2, 0.1, 0.2, 0.8, -0.2, 0.1, -0.2, 1.3);
    for size in [0.01, 0.1, 1.0] {
        let compliance = compliance * (size * unit);
        let groove = |compliance: Matrix3<f64>, displacement: Vector3<f64>| Contact {
            obstacle: Sprung(Union(sides().to_vec()), compliance, displacement),
            radius: RADIUS,
            friction: 0.0,
        };
        let sprung = horizontal(&groove(compliance, Vector3::zeros()));
        println!("{size}: {}", sprung.found);
        assert_eq!(sprung.reactions.len(), 2);
        let force: Vector3<f64> = sprung.reactions.iter().map(|reaction| reaction.force).sum();
        let rigid = horizontal(&groove(Matrix3::zeros(), compliance * -force));
        assert_eq!(rigid.reactions.len(), 2);
        // The frames of both searches are accurate to 1e-14 rad.
        for (one, other) in sprung.reactions.iter().zip(&rigid.reactions) {
            assert_abs_diff_eq!(
                (one.force - other.force).norm(),
                0.0,
                epsilon = 1e-8 * force.norm()
            );
        }
        assert_abs_diff_eq!(
            (sprung.rod.tip() - rigid.rod.tip()).norm(),
            0.0,
            epsilon = 1e-9 * LENGTH
        );
    }
}

/// A box with its frame as a quaternion i, j, k, w. Lengths are in metres.
fn cuboid(centre: [f64; 3], [i, j, k, w]: [f64; 4], half_edges: [f64; 3]) -> Cuboid {
    let frame = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
    Cuboid {
        centre: centre.into(),
        frame,
        half_edges: half_edges.into(),
    }
}

#[test]
fn rods_do_not_penetrate_edges_between_their_stations() {
    // Scenes of a random search in which a rod bends over a thin stick, and beside edges of a box.
    let scenes = [
        (
            cuboid(
                [0.024055, -0.0101, -0.040789],
                [-0.143203, -0.037484, 0.005786, 0.988966],
                [4.356e-3, 9.09e-4, 6.93e-4],
            ),
            (6.5469e7, 0.070846, 3.86e-4),
            [-0.187951, -0.929697, 0.062768, -0.310479],
            (6, Order::Four),
            [0.0, 0.0, 0.0],
        ),
        (
            cuboid(
                [0.005183, 0.053077, -0.050642],
                [-0.060186, -0.326704, 0.889513, 0.313701],
                [1.3e-2, 4.0483e-2, 5.784e-3],
            ),
            (1.7576e7, 0.118869, 4.035e-4),
            [-0.485886, 0.521455, 0.478173, 0.513177],
            (13, Order::Eight),
            [-1.08005, 8.32606, 6.80547],
        ),
        (
            cuboid(
                [-0.014223, -0.003606, -0.003236],
                [-0.931577, -0.101282, -0.115836, 0.329376],
                [4.326e-3, 1.421e-3, 8.327e-3],
            ),
            (3.08496e6, 0.07437, 3.0135e-4),
            [-0.572973, -0.12052, 0.793302, -0.166877],
            (9, Order::Eight),
            [21.7497, -21.0883, 8.0136],
        ),
    ];
    for (obstacle, (youngs_modulus, length, radius), [i, j, k, w], (elements, order), intrinsic) in
        scenes
    {
        let scene = Still {
            base: UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)),
            ..Still::upright()
        };
        let mut rod = Rod::uniform(length, radius, scene.base, elements, order).expect("a rod");
        rod.set_intrinsic(|_| intrinsic.into());
        let tissue: &dyn Constitutive = &tissue(youngs_modulus);
        let (load, support): (&dyn Load, &dyn Support) = (
            &WEIGHT,
            &Contact {
                obstacle,
                radius,
                friction: 0.0,
            },
        );
        let held = NewtonSolver::default().solve_held(
            &mut rod,
            &tissue,
            &load,
            &support,
            &scene.environment(0.0),
        );
        let held = held.expect("an equilibrium");
        for place in held.rod.centre_line_at(401) {
            let gap = obstacle.distance(&place, 0.0).value - radius;
            // Places between material points have the error of the interpolation.
            assert!(
                gap > -1e-5 * length,
                "penetration {:e} of the length",
                -gap / length
            );
        }
    }
}
