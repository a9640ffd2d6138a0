//! Helix on a frictionless cylinder, rows 8.1 to 8.3 and 8.7 to 8.9 of the table of boundary value
//! problems, and the thickest pole that a flat coil holds.

#[path = "../../examples/twining/coil.rs"]
mod coil;

use std::f64::consts::PI;

use approx::assert_relative_eq;
use morphorod::equilibrium::EquilibriumSolver;
use morphorod::load::ApicalForce;
use morphorod::rod::Rod;
use morphorod::support::{Contact, Cylinder, Hold};
use morphorod::{Order, Scene, Still};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::fixtures::rods::{bending_stiffness, tight};
use crate::fixtures::shoots::{RADIUS, YOUNG};

/// Radius of the cylinder, m.
const CYLINDER: f64 = 0.01;

/// Frame of a helix about e3 through the point (`CYLINDER`, 0, 0), whose columns are its normal,
/// binormal and tangent, at a polar angle and with a pitch angle (rad).
fn frenet(angle: f64, pitch: f64) -> UnitQuaternion<f64> {
    let (outward, around) = (
        Vector3::new(angle.cos(), angle.sin(), 0.0),
        Vector3::new(-angle.sin(), angle.cos(), 0.0),
    );
    let tangent = around * pitch.cos() + Vector3::z() * pitch.sin();
    let binormal = Vector3::z() * pitch.cos() - around * pitch.sin();
    let columns = Matrix3::from_columns(&[-outward, binormal, tangent]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns))
}

#[test]
fn helix_on_a_cylinder_has_the_reference_pressure_tension_and_couple() {
    let (bending, twisting) = (bending_stiffness(), bending_stiffness() / 1.5);
    // Pitch angle, intrinsic curvature and tension in units of the radius and the bending
    // stiffness; pressure, axial force and axial couple from the table.
    let rows = [
        (
            30.0_f64,
            0.5,
            1.0,
            0.7031250000000001,
            0.5937499999999999,
            1.1727427342914274,
        ),
        (
            20.0,
            1.5,
            0.2,
            0.052067103538875545,
            0.43252686360190607,
            -0.45107870786183996,
        ),
    ];
    for (degrees, intrinsic, tension, pressure, axial, couple) in rows {
        let (pitch, elements) = (degrees.to_radians(), 24);
        let (curvature, torsion) = (
            pitch.cos().powi(2) / CYLINDER,
            pitch.sin() * pitch.cos() / CYLINDER,
        );
        let length = 0.5 * PI * CYLINDER / pitch.cos();
        let (start, end) = (frenet(0.0, pitch), frenet(0.5 * PI, pitch));
        let shear = (twisting * curvature - bending * (curvature - intrinsic / CYLINDER)) * torsion;
        let unit = bending / (CYLINDER * CYLINDER);
        let pull = end * Vector3::new(0.0, shear, tension * unit);
        let still = Still {
            base: start,
            ..Still::weightless()
        };
        let environment = still.environment(0.0);
        let mut rod = Rod::uniform(length, RADIUS, start, elements, Order::Eight).unwrap();
        let mut solver = tight();
        rod.set_intrinsic(|_| Vector3::new(0.0, curvature, torsion));
        let _ = solver.solve(&mut rod, &YOUNG, &(), &environment).unwrap();
        let obstacle = Cylinder {
            through: Vector3::x() * -CYLINDER,
            along: Vector3::z(),
            radius: CYLINDER,
        };
        let support = (
            Contact {
                obstacle,
                radius: 0.0,
                friction: 0.0,
            },
            Hold::apex().held(end),
        );
        // The shape remains the helix while its intrinsic strain and the load change.
        let mut held = None;
        for share in [0.25, 0.5, 0.75, 1.0] {
            let strain = Vector3::new(
                0.0,
                curvature + (intrinsic / CYLINDER - curvature) * share,
                torsion * (1.0 - share),
            );
            rod.set_intrinsic(|_| strain);
            let load = ApicalForce(move |_: f64| pull * share);
            held = Some(
                solver
                    .solve_held(&mut rod, &YOUNG, &load, &support, &environment)
                    .unwrap(),
            );
        }
        let held = held.unwrap();
        let contacts = || {
            held.reactions
                .iter()
                .filter(|reaction| reaction.obstacle.is_some())
        };
        assert!(contacts().all(|contact| contact.normal >= 0.0));
        let at_base = pull
            + contacts()
                .map(|contact| contact.force)
                .sum::<Vector3<f64>>();
        let tangent = start * Vector3::z();
        // The asked accuracy. The errors are 1e-8 for the forces and 1e-7 for the pressure of an
        // element.
        assert_relative_eq!(
            at_base.dot(&tangent) / unit,
            tension,
            epsilon = 0.0,
            max_relative = 1e-6
        );
        assert_relative_eq!(at_base.z / unit, axial, epsilon = 0.0, max_relative = 1e-6);
        let tip = held.rod.tip() + Vector3::x() * CYLINDER;
        let moment = held
            .reactions
            .iter()
            .map(|reaction| reaction.couple.z)
            .sum::<f64>()
            + tip.cross(&pull).z;
        assert_relative_eq!(
            moment * CYLINDER / bending,
            couple,
            epsilon = 0.0,
            max_relative = 1e-6
        );
        // Elements away from the ends; a station at a node belongs to both of its elements.
        let each = length / elements as f64;
        for element in 4..elements - 4 {
            let (from, to) = (each * element as f64, each * (element + 1) as f64);
            let share = |s: f64| match (s - from).abs().min((s - to).abs()) < 1e-6 * each {
                true => 0.5,
                false => f64::from(u8::from(s > from && s < to)),
            };
            let pushed = contacts()
                .map(|contact| contact.normal * share(contact.arc_length))
                .sum::<f64>();
            assert_relative_eq!(
                pushed / each * CYLINDER / unit,
                pressure,
                epsilon = 0.0,
                max_relative = 1e-6
            );
        }
    }
}

#[test]
fn flat_coil_holds_up_to_the_curvature_of_a_shooting_method() {
    // The error of the parabola is 6e-7.
    assert_relative_eq!(
        coil::fold(&coil::follow().unwrap()),
        coil::FOLD,
        epsilon = 0.0,
        max_relative = 1e-4
    );
}
