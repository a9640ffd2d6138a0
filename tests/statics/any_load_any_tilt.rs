//! Equilibria of a uniform shoot at any tilt under any weight, from a straight initial guess.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::rods::{Hanging, LENGTH, bending_stiffness, density_for, sag};
use crate::fixtures::shoots::{RADIUS, YOUNG};
use approx::abs_diff_eq;
use morphorod::equilibrium::{Equilibrium, EquilibriumSolver, NewtonSolver};
use morphorod::load::Weight;
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};
use nalgebra::{UnitQuaternion, Vector2, Vector3};

/// Loads q ℓ³/(E I), from 1/8 to 1300 times the self-buckling load of an upright shoot.
const LOADS: [f64; 9] = [1.0, 4.492, 7.0, 8.0, 12.0, 20.0, 100.0, 1e3, 1e4];
/// Angles of the base tangent from upright, degrees.
const TILTS: [f64; 8] = [0.01, 1.0, 10.0, 45.0, 90.0, 135.0, 170.0, 179.0];

/// Nodes (arc lengths, m) of elements whose length decreases towards the base. A heavy shoot bends
/// down there within a length of about ℓ q̂^(-1/2).
fn graded(elements: usize, load: f64) -> Vec<f64> {
    let grade = (0.5 * load.sqrt()).ln_1p();
    let at = |i: usize| LENGTH * (grade * i as f64 / elements as f64).exp_m1() / grade.exp_m1();
    (0..=elements).map(at).collect()
}

fn straight(nodes: &[f64], scene: &Still) -> Rod {
    Rod::straight(nodes, |_| RADIUS, scene.base, Order::default()).expect("a rod")
}

/// Solves for the equilibrium with the default solver.
fn solve(rod: &mut Rod, load: f64, scene: &Still) -> Equilibrium {
    let weight = Weight {
        density: density_for(load, LENGTH),
    };
    NewtonSolver::default()
        .solve(rod, &YOUNG, &weight, &scene.environment(0.0))
        .expect("an equilibrium")
}

#[test]
fn solver_finds_a_stable_equilibrium_at_every_load_and_tilt() {
    let mut azimuth = 0.0;
    for load in LOADS {
        for tilt in TILTS {
            // The base leans in another direction in every case, so that no symmetry reduces the
            // rounding.
            let lean = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), azimuth);
            azimuth += 0.7;
            let scene = Still {
                base: lean * Still::tilted(tilt.to_radians()).base,
                ..Still::upright()
            };
            let case = format!("load {load}, tilt {tilt}°, azimuth {azimuth}");
            let tips = [16, 32].map(|elements| {
                let mut rod = straight(&graded(elements, load), &scene);
                let found = solve(&mut rod, load, &scene);
                assert_eq!(
                    (found.inertia.negative, found.inertia.neutral),
                    (0, 0),
                    "{case}"
                );
                // Steps are limited to 1 rad and shifted while the shape is unstable. At most 34
                // were needed when this test was written.
                assert!(
                    found.iterations <= 40,
                    "{case}: {} iterations",
                    found.iterations
                );
                assert!(found.error <= 1e-11, "{case}: {:e}", found.error);
                let tip = lean.inverse() * rod.tip() / LENGTH;
                // No force acts across the vertical plane in which the base leans. The smallest
                // pivot is the stiffness to a rotation of that plane. The displacement by rounding
                // is inversely proportional to its margin.
                let sideways = tip.y.abs();
                let promised = 3.0 * found.error + 4.0 * f64::EPSILON / found.inertia.margin;
                assert!(
                    tip.x > 0.0 && sideways < promised,
                    "{case}: {sideways:e} against {promised:e}"
                );
                tip
            });
            // The required accuracy is 1e-8 of the length. At order 8, halving the elements reduces
            // the error by a factor of 256.
            assert!(
                abs_diff_eq!(InNorm(tips[0]), InNorm(tips[1]), epsilon = 1e-8),
                "{case}: {} against {}",
                tips[0],
                tips[1]
            );
        }
    }
}

#[test]
fn tip_of_heavy_shoots_matches_shooting() {
    for load in [8.0, 20.0, 100.0, 1e3, 1e4] {
        for tilt in [0.01, 90.0, 179.0] {
            let scene = Still::tilted(f64::to_radians(tilt));
            let tips = [32, 64].map(|elements| {
                let mut rod = straight(&graded(elements, load), &scene);
                let _ = sag(&mut rod, density_for(load, LENGTH), &scene);
                rod.tip().xz()
            });
            let q = load * bending_stiffness() / LENGTH.powi(3);
            let steps = 2000;
            let hanging = Hanging {
                length: LENGTH,
                tilt: f64::to_radians(tilt),
                stiffness: |_| bending_stiffness(),
                weight: |sigma| q * sigma,
            };
            let known = hanging.tip(steps);
            // The bound contains the step error of the integration, the rounding of its 2 · steps
            // additions, and the difference between the two meshes of the crate.
            let rounding = 2.0 * steps as f64 * f64::EPSILON * LENGTH;
            let promised = known.error + rounding + (tips[0] - tips[1]).norm();
            let expected = Vector2::from(known.value);
            assert!(
                abs_diff_eq!(InNorm(tips[1]), InNorm(expected), epsilon = promised),
                "load {load}, tilt {tilt}: {} against {expected} within {promised:e}",
                tips[1]
            );
            assert!(
                promised < 1e-8 * LENGTH,
                "load {load}, tilt {tilt}: the bound is too large, {promised:e}"
            );
        }
    }
}

#[test]
fn heavy_horizontal_shoots_converge_on_a_uniform_mesh() {
    // The first load is that of the default shoot. Each load is 1.5 times the previous one.
    let scene = Still::tilted(90_f64.to_radians());
    let mut load = 4.492;
    while load <= 1000.0 {
        let tip = |elements: usize| {
            let mut rod = straight(&Rod::equal_nodes(LENGTH, elements), &scene);
            assert_eq!(
                solve(&mut rod, load, &scene).inertia.negative,
                0,
                "load {load}"
            );
            rod.tip() / LENGTH
        };
        // At load 1000 the boundary layer of ℓ/32 is as long as one of 32 elements. The error there
        // is (h/layer)⁸ · 1e-8.
        let (coarse, fine) = (tip(32), tip(64));
        assert!(
            abs_diff_eq!(InNorm(coarse), InNorm(fine), epsilon = 1e-7),
            "load {load}: {coarse} against {fine}"
        );
        load *= 1.5;
    }
}

#[test]
fn coarse_meshes_give_a_stable_shape_or_a_recoverable_error() {
    for order in Order::ALL {
        for elements in [1, 2, 3, 5] {
            for load in LOADS {
                for tilt in TILTS {
                    let scene = Still::tilted(tilt.to_radians());
                    let mut rod =
                        Rod::uniform(LENGTH, RADIUS, scene.base, elements, order).expect("a rod");
                    let before = rod.clone();
                    let weight = Weight {
                        density: density_for(load, LENGTH),
                    };
                    let found = NewtonSolver::default().solve(
                        &mut rod,
                        &YOUNG,
                        &weight,
                        &scene.environment(0.0),
                    );
                    let case = format!("{order:?}, {elements} elements, load {load}, tilt {tilt}");
                    match found {
                        Ok(found) => assert_eq!(found.inertia.negative, 0, "{case}"),
                        Err(error) => {
                            assert!(error.is_recoverable() && rod == before, "{case}: {error}")
                        }
                    }
                    // The distance of the tip from the base is at most the length of an
                    // inextensible rod, up to rounding.
                    assert!(rod.tip().norm() <= LENGTH * (1.0 + 1e-14), "{case}");
                }
            }
        }
    }
}
