//! Point forces along the shoot, and meshes with nodes chosen by the user.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{HOUR, RADIUS, YOUNG, growing, rod};
use approx::{abs_diff_eq, assert_abs_diff_eq};
use morphorod::growth::{GrowthLaw, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, PointForce, Weight};
use morphorod::{Order, Still};
use nalgebra::Vector3;

const LENGTH: f64 = 0.06;

#[test]
fn point_force_bends_the_part_below_it_and_leaves_the_rest_straight() {
    // The force bends the shoot by about a radian. None of its points of application is a node of
    // eight equal elements.
    let force = Vector3::new(0.0, 3e-4, -2e-4);
    for apex_distance in [0.0213, 0.011, 0.0497] {
        let place = LENGTH - apex_distance;
        let mut loaded = rod(YOUNG, LENGTH)
            .load(PointForce {
                initial_apex_distance: apex_distance,
                force,
            })
            .scene(Still::tilted(1.0))
            .into_dyn()
            .build()
            .unwrap();
        assert_eq!(loaded.rod().elements(), 9);
        let mut run = MethodOfSteps::new(1.0);
        run.solver.tolerance = 1e-13;
        run.advance(&mut loaded, 0.0).unwrap();
        // The reference is a shoot that consists of the lower part alone, with the force on its
        // apex. The upper part is straight along the tangent at that apex.
        let mut lower = rod(YOUNG, place)
            .elements(24)
            .load(ApicalForce(move |_| force))
            .scene(Still::tilted(1.0))
            .into_dyn()
            .build()
            .unwrap();
        run.advance(&mut lower, 0.0).unwrap();
        let expected = lower.tip() + lower.rod().apex_frame() * Vector3::z() * apex_distance;
        assert!(
            abs_diff_eq!(
                InNorm(loaded.tip()),
                InNorm(expected),
                epsilon = 1e-9 * LENGTH
            ),
            "{apex_distance}: {} against {expected}",
            loaded.tip()
        );
    }
}

#[test]
fn node_of_a_point_force_is_kept_while_the_shoot_grows() {
    // The tissue at the point force is in the growth zone at first and leaves it after about 18 h.
    // Elements around it are split and merged.
    let (apex_distance, zone_length, time) = (0.0441, 0.07, 40.0 * HOUR);
    let fruit = PointForce {
        initial_apex_distance: apex_distance,
        force: Vector3::new(1e-6, 0.0, -2e-6),
    };
    let run = |step: f64, elements: usize| {
        let weight = Weight { density: 1000.0 };
        let mut shoot = growing()
            .elements(elements)
            .load((weight, fruit))
            .into_dyn()
            .build()
            .unwrap();
        let statistics = MethodOfSteps::new(step)
            .advance(&mut shoot, 30.0 * HOUR)
            .unwrap();
        assert!(statistics.merges > 100 && statistics.splits > 100);
        shoot
    };
    let shoot = run(90.0, 8);
    let place = UniformGrowth { zone_length, time }
        .trace(0.068, 0.068 - apex_distance, 30.0 * HOUR)
        .arc_length;
    let nodes = shoot.rod().centre_line();
    let nearest = nodes
        .iter()
        .map(|(s, _)| (s - place).abs())
        .fold(f64::INFINITY, f64::min);
    // Exit times are exact. The arc length is a sum over a few dozen elements, with their rounding.
    assert!(
        nearest < 1e-12,
        "no node at {place}: the nearest is {nearest} m away"
    );
    // With half the step and twice the elements, the tip changes by about its error in time.
    assert_abs_diff_eq!(
        InNorm(run(45.0, 16).tip()),
        InNorm(shoot.tip()),
        epsilon = 1e-5
    );
}

#[test]
fn graded_nodes_resolve_a_heavy_rod() {
    // At q ℓ³/(E I) = 3000, the boundary layer at the base has the length ℓ/55.
    let bending = 1e7 * std::f64::consts::PI * RADIUS.powi(4) / 4.0;
    let area = std::f64::consts::PI * RADIUS * RADIUS;
    let weight = Weight {
        density: 3000.0 * bending / LENGTH.powi(3) / (9.81 * area),
    };
    let tip = |nodes: Option<Vec<f64>>, elements: usize| {
        let mut builder = rod(YOUNG, LENGTH).elements(elements).load(weight);
        if let Some(nodes) = nodes {
            builder = builder.nodes(&nodes);
        }
        let mut shoot = builder
            .scene(Still::tilted(1.5))
            .into_dyn()
            .build()
            .unwrap();
        let mut run = MethodOfSteps::new(1.0);
        run.solver.tolerance = 1e-12;
        run.advance(&mut shoot, 0.0).unwrap();
        shoot.tip()
    };
    let graded = |n: usize| {
        Some(
            (0..=n)
                .map(|i| LENGTH * (i as f64 / n as f64).powi(3))
                .collect::<Vec<_>>(),
        )
    };
    let best = tip(graded(96), 1);
    let (equal, own) = (
        (tip(None, 16) - best).norm(),
        (tip(graded(16), 1) - best).norm(),
    );
    assert!(
        own < 1e-3 * equal && own < 1e-8 * LENGTH,
        "{own} against {equal}"
    );
}

#[test]
fn invalid_nodes_and_places_are_refused() {
    let with = |nodes: &[f64]| {
        rod(YOUNG, LENGTH)
            .nodes(nodes)
            .into_dyn()
            .build()
            .map(|_| ())
            .map_err(|e| e.to_string())
    };
    assert!(with(&[0.0, 0.01, LENGTH]).is_ok());
    let wrong: [&[f64]; 7] = [
        &[],
        &[LENGTH],
        &[0.0, 0.02],
        &[0.01, LENGTH],
        &[0.0, 0.03, 0.02, LENGTH],
        &[0.0, f64::NAN, LENGTH],
        &[0.0, 0.02, 0.02, LENGTH],
    ];
    for nodes in wrong {
        let error = with(nodes).unwrap_err();
        assert!(
            error.contains("node") || error.contains("element"),
            "{nodes:?}: {error}"
        );
    }
    for apex_distance in [-0.01, 0.07, f64::NAN, f64::INFINITY] {
        let load = PointForce {
            initial_apex_distance: apex_distance,
            force: Vector3::x(),
        };
        let error = rod(YOUNG, LENGTH)
            .load(load)
            .into_dyn()
            .build()
            .unwrap_err();
        assert!(error.to_string().contains("distance"), "{error}");
    }
    let load = PointForce {
        initial_apex_distance: 0.01,
        force: Vector3::x() * f64::NAN,
    };
    assert!(
        rod(YOUNG, LENGTH)
            .order(Order::Two)
            .load(load)
            .into_dyn()
            .build()
            .is_err()
    );
}
