//! Obstacles with edges.

use std::f64::consts::FRAC_PI_2;

use approx::{assert_abs_diff_eq, assert_relative_eq};

use crate::fixtures::held::Held;
use crate::fixtures::rods::{DENSITY, RADIUS};
use morphorod::load::Weight;
use morphorod::support::{Contact, ConvexPolyhedron, Cuboid, Cylinder, HalfSpace, Obstacle, Support};
use nalgebra::{UnitQuaternion, Vector3};

/// Length, m.
const LENGTH: f64 = 0.05;

/// Equilibrium of a straight heavy rod, clamped horizontally along e1, with a support.
fn horizontal(support: &dyn Support) -> Held<Weight> {
    let mut held = Held::straight(LENGTH, FRAC_PI_2, 10, Weight { density: DENSITY });
    held.hold(support);
    held
}

/// A box below the rod with its upper far edge through (0.6, 0, −0.02) of the length, turned about e3.
fn table() -> Cuboid {
    let frame = UnitQuaternion::from_scaled_axis(Vector3::z() * 0.3);
    let half_edges = Vector3::new(0.1, 0.5, 0.2) * LENGTH;
    let edge = Vector3::new(0.6, 0.0, -0.02) * LENGTH;
    Cuboid { centre: edge - frame * Vector3::new(half_edges.x, 0.0, half_edges.z), frame, half_edges }
}

#[test]
fn rod_bends_over_an_edge_as_over_a_cylinder() {
    let table = table();
    let [along, out] = [Vector3::y(), Vector3::x()].map(|axis| table.frame * axis);
    let through = Vector3::new(0.6, 0.0, -0.02) * LENGTH;
    // The centre line has the distance of the rod's radius from the edge. A part of it is the radius of the cylinder.
    let cylinder = Cylinder { through, along, radius: 0.3 * RADIUS };
    let half = |normal: Vector3<f64>| HalfSpace { through, normal };
    let ridge = ConvexPolyhedron::new(vec![half(Vector3::z()), half(out)]).unwrap();
    let over = horizontal(&Contact { obstacle: cylinder, radius: 0.7 * RADIUS, friction: 0.0 });
    let normal = cylinder.distance(&over.place(over.reactions[0].arc_length / LENGTH), 0.0).normal;
    assert!(normal.z > 0.01 && normal.dot(&out) > 0.01, "the contact is between both faces: {normal}");
    let bodies: [&dyn Obstacle; 2] = [&table, &ridge];
    for obstacle in bodies {
        let held = horizontal(&Contact { obstacle, radius: RADIUS, friction: 0.0 });
        println!("{}", held.found);
        // Near the contact all distances are the same function. The place of contact has an error of 1e-9 lengths.
        assert_eq!((held.reactions.len(), over.reactions.len()), (1, 1));
        let (force, expected) = (held.reaction().0, over.reaction().0);
        assert_abs_diff_eq!((force - expected).norm(), 0.0, epsilon = 1e-9 * expected.norm());
        assert_abs_diff_eq!((held.rod.tip() - over.rod.tip()).norm(), 0.0, epsilon = 1e-10 * LENGTH);
    }
}

#[test]
fn contact_of_radius_zero_with_an_edge_is_refused() {
    let mut held = Held::straight(LENGTH, FRAC_PI_2, 10, Weight { density: DENSITY });
    held.assert_refused(&Contact { obstacle: table(), radius: 0.0, friction: 0.0 }, "an obstacle with edges");
}

#[test]
fn apex_rests_on_a_face_as_on_a_plane() {
    let through = Vector3::z() * (-0.1 * LENGTH);
    let half_edges = Vector3::new(0.5, 0.3, 0.1) * LENGTH;
    let centre = through + Vector3::new(1.0, 0.0, 0.0) * LENGTH - Vector3::z() * half_edges.z;
    let block = Cuboid { centre, frame: UnitQuaternion::identity(), half_edges };
    let plane = HalfSpace { through, normal: Vector3::z() };
    let on = |obstacle: &dyn Obstacle| horizontal(&Contact { obstacle, radius: RADIUS, friction: 0.0 });
    let (block, plane) = (on(&block), on(&plane));
    assert_relative_eq!(block.reaction().0.z, plane.reaction().0.z, epsilon = 0.0, max_relative = 1e-10);
    assert_abs_diff_eq!((block.rod.tip() - plane.rod.tip()).norm(), 0.0, epsilon = 1e-11 * LENGTH);
}
