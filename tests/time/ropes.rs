//! Slack ropes: slender shoots under their weight whose ends are held closer than their length.

use crate::fixtures::shoots::{RADIUS, YOUNG, rod};
use approx::assert_abs_diff_eq;
use morphorod::integrator::{Adaptive, Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::support::{Hold, Joint};
use morphorod::{DynLaws, Shoot, Still};
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI};

use crate::fixtures::rods::{GRAVITY, bending_stiffness};

const LENGTH: f64 = 0.1;
const TOLERANCE: f64 = 1e-4;

/// A rope with the dimensionless weight q ℓ³/(E I), whose ends are held at a distance relative to
/// the length and rotate freely.
fn rope(distance: f64, weight: f64, elements: usize) -> Shoot<DynLaws> {
    let per_length = weight * bending_stiffness() / LENGTH.powi(3);
    let density = per_length / (GRAVITY * PI * RADIUS * RADIUS);
    let end = Hold::apex().at(Vector3::x() * (distance * LENGTH));
    rod(YOUNG, LENGTH)
        .elements(elements)
        .load(Weight { density })
        .scene(Still::tilted(FRAC_PI_2))
        .support((Joint::Ball, end))
        .into_dyn()
        .build()
        .unwrap()
}

/// Points of the centre line, m.
fn line(shoot: &Shoot<DynLaws>) -> Vec<Vector3<f64>> {
    shoot.rod().centre_line_at(201)
}

fn difference(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max)
}

/// On three elements the search for the slender ropes fails.
#[test]
fn adaptive_runs_find_slack_ropes_on_any_mesh() {
    for distance in [0.02, 0.1, 0.5] {
        for weight in [1e3, 1e5] {
            let fixed = |elements| {
                let mut shoot = rope(distance, weight, elements);
                let _ = MethodOfSteps::new(600.0).advance(&mut shoot, 0.0).unwrap();
                line(&shoot)
            };
            let fine = fixed(64);
            // The order is at least eight, so that the error of 64 elements is far below the
            // difference from 32 elements.
            let error = difference(&fixed(32), &fine) / LENGTH;
            assert!(error < 0.1 * TOLERANCE, "{error:e}");
            for elements in [4, 8, 16, 32] {
                let mut shoot = rope(distance, weight, elements);
                let _ = Adaptive::new(TOLERANCE)
                    .advance(&mut shoot, 3600.0)
                    .unwrap();
                let difference = difference(&line(&shoot), &fine) / LENGTH;
                // A tolerance relative to the length.
                assert_abs_diff_eq!(difference, 0.0, epsilon = TOLERANCE);
                assert!(
                    shoot.rod().elements() >= elements,
                    "the mesh is a lower bound"
                );
            }
        }
    }
}
