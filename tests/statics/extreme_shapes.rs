//! Equilibria that a few elements cannot resolve, such as a boundary layer at the clamp or a coil
//! of a hundred turns. The adaptive integrator resolves them to a given tolerance from a mesh of
//! few elements.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{WEIGHT, YOUNG, tissue};
use approx::abs_diff_eq;
use morphorod::constitutive::{Graded, Tissue};
use morphorod::equilibrium::NewtonSolver;
use morphorod::integrator::{Adaptive, ConstantHistory, Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::{DynLaws, Shoot, Still};
use nalgebra::Vector3;

/// A rod of 1 m length and 1 mm radius on a horizontal base, with the given softness q ℓ³/(E I) and
/// intrinsic strain (1/m).
fn rod(softness: f64, elements: usize, strain: Vector3<f64>) -> Shoot<DynLaws> {
    let (radius, density) = (1e-3, 1000.0);
    // The modulus follows from q ℓ³/(E I), with q = ρ g π r², I = π r⁴/4 and ℓ = 1 m.
    let youngs_modulus = density * 9.81 * 4.0 / (radius * radius * softness);
    let mut shoot = Shoot::builder(tissue(youngs_modulus))
        .length(1.0)
        .radius(radius)
        .elements(elements)
        .load(Weight { density })
        .scene(Still::tilted(FRAC_PI_2))
        .into_dyn()
        .build()
        .unwrap();
    shoot.set_intrinsic(|_| strain);
    shoot
}

/// Tip position (m) of a shoot on its initial mesh, solved with a tight tolerance.
fn on_equal_elements(mut shoot: Shoot<DynLaws>) -> Vector3<f64> {
    let mut run = MethodOfSteps::with_solver(60.0, NewtonSolver::with_tolerance(1e-13));
    let _ = run.start(&mut shoot, &ConstantHistory::Empty).unwrap();
    shoot.tip()
}

/// Asserts that the adaptive integrator meets each tolerance from a mesh of four elements, with no
/// more than `most` elements. The error of the reference is at most `own` (m).
fn assert_kept(
    softness: f64,
    strain: Vector3<f64>,
    reference: &Vector3<f64>,
    own: f64,
    most: usize,
) {
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
        let mut shoot = rod(softness, 4, strain);
        let found = Adaptive::new(tolerance)
            .start(&mut shoot, &ConstantHistory::Empty)
            .unwrap();
        let (error, estimate) = ((shoot.tip() - reference).norm(), found.error.unwrap());
        assert!(
            error < tolerance + own,
            "{softness:e}, {tolerance:e}: {error:e}"
        );
        assert!(
            estimate <= tolerance && error <= 30.0 * estimate + own,
            "{error:e}, estimated {estimate:e}"
        );
        assert!(
            shoot.rod().elements() <= most,
            "{softness:e}, {tolerance:e}: {} elements",
            shoot.rod().elements()
        );
    }
}

#[test]
fn adaptive_mesh_resolves_the_boundary_layer_of_a_hanging_hair() {
    for softness in [1e2, 1e3, 1e4, 1e5, 1e6] {
        // For the softest rod, an element is a quarter as long as the boundary layer. Its error is
        // 1e-11 of the length of the layer.
        let reference = on_equal_elements(rod(softness, 4096, Vector3::zeros()));
        assert_kept(softness, Vector3::zeros(), &reference, 2e-12, 150);
        // The rod bends in a layer of width ε = 1/√(q ℓ³/(E I)) at the clamp, where φ' = −(2/ε)
        // sin(φ/2) with φ the angle from the vertical. This gives x = √2 ε and z = −1 + (2 − √2) ε,
        // up to terms in ε².
        let epsilon = 1.0 / softness.sqrt();
        let layer = Vector3::new(
            2.0_f64.sqrt() * epsilon,
            0.0,
            -1.0 + (2.0 - 2.0_f64.sqrt()) * epsilon,
        );
        assert!(
            abs_diff_eq!(
                InNorm(reference),
                InNorm(layer),
                epsilon = 2.0 * epsilon * epsilon
            ),
            "{softness:e}: {reference} against {layer}"
        );
    }
}

#[test]
fn adaptive_mesh_resolves_a_coil_of_a_hundred_turns() {
    let strain = Vector3::new(0.0, 100.0 * TAU, 30.0 * TAU);
    for softness in [1e-9, 10.0, 100.0, 1000.0] {
        let reference = on_equal_elements(rod(softness, 2048, strain));
        // The error with 2048 elements is about 2e-12 m. The change from 1024 to 2048 elements is
        // at most 1e-9 m.
        assert_kept(softness, strain, &reference, 1e-11, 3000);
        if softness < 1.0 {
            // The shape is a helix about the intrinsic strain with ω = |u*|. The component of the
            // tangent along the axis is constant, and the perpendicular component rotates.
            let (omega, axis) = (strain.norm(), strain.normalize());
            let along = axis * axis.z;
            let across = Vector3::z() - along;
            let helix =
                along + (across * omega.sin() + axis.cross(&across) * (1.0 - omega.cos())) / omega;
            // The base is rotated by π/2 about e2, so that d3 = e1 and d1 = −e3.
            let tip = Vector3::new(helix.z, helix.y, -helix.x);
            assert!(
                abs_diff_eq!(InNorm(reference), InNorm(tip), epsilon = 1e-8),
                "{softness:e}: {reference} against {tip}"
            );
        }
    }
}

/// The stiffness beyond the arc length `place`, relative to the length, is multiplied by a factor.
/// The reference has a node at the jump.
#[test]
fn adaptive_mesh_resolves_a_jump_of_stiffness_inside_an_element() {
    for (place, factor) in [(0.37, 3.0), (0.123, 5.0), (0.5, 0.2), (0.71, 1e3)] {
        let make = |nodes: Option<Vec<f64>>| {
            let (length, law) = (0.06, YOUNG);
            let beyond = length * (1.0 - place);
            let factor = move |tissue: &Tissue| {
                if tissue.initial_apex_distance < beyond {
                    factor
                } else {
                    1.0
                }
            };
            let builder = Shoot::builder(Graded { law, factor })
                .radius(5e-4)
                .load(WEIGHT);
            let builder = builder.scene(Still::tilted(FRAC_PI_2));
            match nodes {
                Some(nodes) => builder
                    .length(length)
                    .nodes(&nodes)
                    .into_dyn()
                    .build()
                    .unwrap(),
                None => builder
                    .length(length)
                    .elements(8)
                    .into_dyn()
                    .build()
                    .unwrap(),
            }
        };
        let ends =
            |a: f64, b: f64| (0..32).map(move |k| 0.06 * (a + (b - a) * f64::from(k) / 32.0));
        let nodes = ends(0.0, place)
            .chain(ends(place, 1.0))
            .chain([0.06])
            .collect();
        let reference = on_equal_elements(make(Some(nodes)));
        for tolerance in [1e-4, 1e-6, 1e-9] {
            let mut shoot = make(None);
            let found = Adaptive::new(tolerance)
                .start(&mut shoot, &ConstantHistory::Empty)
                .unwrap();
            let (error, estimate) = (
                (shoot.tip() - reference).norm() / 0.06,
                found.error.unwrap(),
            );
            assert!(
                error < tolerance && error < 10.0 * estimate,
                "{place}: {error:e}, estimated {estimate:e}"
            );
            // Each factor of four in the grading adds three elements on either side of the jump. A
            // finer mesh halves all elements.
            assert!(
                shoot.rod().elements() < 300,
                "{} elements",
                shoot.rod().elements()
            );
        }
    }
}
