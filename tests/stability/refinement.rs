//! Discretisation errors of the module `stability`: error estimates compared with the continuous
//! problem, and mesh refinement to a tolerance.
//!
//! `MORPHOROD_CASES=200 cargo test --workspace --test all stability::refinement` tests 200 random
//! shoots.

use std::f64::consts::TAU;

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use morphorod::constitutive::{Graded, Tissue};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::load::PointForce;
use morphorod::stability::{
    BoundarySettings, Crossing, Linearisation, Refinement, StabilityError, boundary, crossings,
    onset, solve_steady_state,
};
use morphorod::tropism::{Memory, Proprioception, Response, SettledStatoliths};
use morphorod::{DynLaws, Shoot, Still};
use nalgebra::Vector3;
use proptest::prelude::*;

use crate::fixtures::random::number;
use crate::fixtures::shoots::{HOUR, MEMORY, WEIGHT, YOUNG, reduced, rod, steering};
use crate::fixtures::upright::continuous::Upright;

/// Parameters of a shoot with short waves. The relative error of its length at onset on four
/// elements is 2e-4.
const SHORT_WAVES: Upright = Upright {
    beta: 1.911,
    eta: 3.1276,
    gravity: Memory {
        time: 1031.17,
        delay: 1773.0,
    },
    bending: Memory {
        time: 384.79,
        delay: 1340.06,
    },
    growth_time: 24_089.0,
};

/// Relative errors of length and frequency of a crossing, compared with the continuous problem.
fn errors(shoot: &Upright, found: &Crossing<1>) -> [f64; 2] {
    let (length, frequency) = shoot.crossing(found.parameters[0], found.frequency);
    [
        (found.parameters[0] / length - 1.0).abs(),
        (found.frequency / frequency - 1.0).abs(),
    ]
}

/// Whether the ratio of an estimate to an error is between 0.3 and 30. Only the lower bound applies
/// to errors below 3e-10, where the error of the finite differences dominates that of the mesh.
fn is_near(estimate: f64, error: f64) -> bool {
    estimate > 0.3 * error.min(3e-10)
        && (error < 3e-10 || (0.3..30.0).contains(&(estimate / error)))
}

#[test]
fn error_estimates_of_an_onset_agree_with_the_errors() {
    for elements in [4, 6, 8, 12, 16] {
        let found = onset(|length| SHORT_WAVES.linear(length, elements), 0.02, 0.03).unwrap();
        assert_eq!(
            (
                found.parameter_errors,
                found.frequency_error,
                found.elements
            ),
            (None, None, elements)
        );
        let checked = found
            .with_error(|[length]| SHORT_WAVES.linear(length, 2 * elements))
            .unwrap();
        assert_eq!(
            (checked.parameters, checked.frequency),
            (found.parameters, found.frequency)
        );
        let [length, frequency] = errors(&SHORT_WAVES, &found);
        let estimate = checked.parameter_errors.unwrap()[0] / found.parameters[0];
        // The errors range from 2e-4 to 4e-9. The error on the finer mesh is less than a hundredth
        // of these.
        let agrees = abs_diff_eq!(estimate, length, epsilon = 0.1 * length);
        assert!(agrees, "{elements} elements: {estimate:e} for {length:e}");
        let estimate = checked.frequency_error.unwrap() / found.frequency;
        assert!(
            is_near(estimate, frequency),
            "{elements} elements: {estimate:e} for {frequency:e}"
        );
    }
    let found = onset(|length| SHORT_WAVES.linear(length, 6), 0.02, 0.03).unwrap();
    for elements in [4, 6] {
        let answer = found.with_error(|[length]| SHORT_WAVES.linear(length, elements));
        assert!(
            matches!(answer, Err(StabilityError::Parameter(_))),
            "{answer:?}"
        );
    }
}

#[test]
fn refinement_to_a_tolerance_chooses_the_mesh() {
    let mut last = 0;
    for tolerance in [1e-3, 1e-5, 1e-7, 1e-9] {
        let mut linearisations = 0;
        let family = |length: f64, elements: usize| {
            linearisations += 1;
            SHORT_WAVES.linear(length, elements)
        };
        let found = Refinement::to(tolerance).onset(family, 0.02, 0.03).unwrap();
        let [length, frequency] = errors(&SHORT_WAVES, &found);
        assert!(
            length < tolerance && frequency < tolerance,
            "{tolerance:e}: {length:e}, {frequency:e}, {found:?}"
        );
        assert!(
            is_near(
                found.parameter_errors.unwrap()[0] / found.parameters[0],
                length
            ),
            "{length:e}: {found:?}"
        );
        assert!(found.elements > last, "{found:?}");
        last = found.elements;
        // The search requires about fifteen linearisations on four elements and at most three on
        // each finer mesh.
        assert!(linearisations < 40, "{linearisations} {found:?}");
    }
}

#[test]
fn unattainable_tolerances_and_unsuitable_meshes_are_refused() {
    let family = |length: f64, elements: usize| SHORT_WAVES.linear(length, elements);
    for tolerance in [0.0, -1e-6, f64::NAN, f64::INFINITY, 9.9e-10] {
        let error = Refinement::to(tolerance)
            .onset(family, 0.02, 0.03)
            .unwrap_err();
        assert!(error.to_string().contains("at least 1e-9"), "{error}");
    }
    let bounded = Refinement {
        last: 8,
        ..Refinement::to(1e-8)
    };
    let error = bounded.onset(family, 0.02, 0.03).unwrap_err();
    // The relative error on eight elements is 9e-7.
    let reported = matches!(error, StabilityError::ToleranceNotMet { error, elements: 8, .. } if error > 3e-7 && error < 3e-5);
    assert!(reported, "{error}");
    // Three invalid sequences: a first mesh without elements, a last mesh equal to the first, and a
    // last mesh of 64 elements after a first mesh of 63, where the second mesh would have 126
    // elements.
    let alone = Refinement {
        first: 63,
        last: 64,
        ..bounded
    };
    for meshes in [
        Refinement {
            first: 0,
            ..bounded
        },
        Refinement { last: 4, ..bounded },
        alone,
    ] {
        assert!(matches!(
            meshes.onset(family, 0.02, 0.03),
            Err(StabilityError::Parameter(_))
        ));
    }
    // A family that ignores the number of elements.
    let answer = bounded.onset(|length, _| SHORT_WAVES.linear(length, 4), 0.02, 0.03);
    assert!(
        matches!(answer, Err(StabilityError::Parameter(_))),
        "{answer:?}"
    );
    let none = Refinement::to(1e-6).onset(family, 0.015, 0.02).unwrap_err();
    assert!(matches!(none, StabilityError::NoCrossing { .. }), "{none}");
}

/// Number of random shoots.
fn cases() -> u32 {
    number("MORPHOROD_CASES", 20) as u32
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: cases(),
        failure_persistence: None,
        max_global_rejects: 100_000,
        ..ProptestConfig::default()
    })]
    #[test]
    fn onsets_of_random_shoots_meet_their_tolerance(
        (beta, eta, hours) in (0.3..2.0_f64, 2.0..30.0_f64, 3.0..48.0_f64),
        gravity in (300.0..1500.0_f64, 300.0..1800.0_f64),
        bending in (300.0..1500.0_f64, 300.0..1800.0_f64),
        digits in 3.0..9.0_f64,
    ) {
        let memory = |(time, delay)| Memory { time, delay };
        let shoot = Upright {
            beta, eta, gravity: memory(gravity), bending: memory(bending), growth_time: hours * HOUR,
        };
        // There is no result if the range contains no onset, or if the onset is too close to the
        // essential spectrum.
        let meshes = Refinement { last: 32, ..Refinement::to(10_f64.powf(-digits)) };
        let answer = meshes.onset(|length, n| shoot.linear(length, n), 0.015, 0.078);
        prop_assume!(answer.is_ok());
        let found = answer.unwrap();
        prop_assume!(!found.essential);
        let [length, frequency] = errors(&shoot, &found);
        prop_assert!(
            length <= meshes.tolerance && frequency <= meshes.tolerance,
            "{length:e}, {frequency:e}: {found:?}"
        );
        let error = found.parameter_errors.unwrap()[0] / found.parameters[0];
        prop_assert!(is_near(error, length), "{length:e}: {found:?}");
    }
}

#[test]
fn roots_have_error_estimates_and_meet_tolerances() {
    // The relative error of the root on 24 elements is 1e-10.
    let exact = SHORT_WAVES
        .linear(0.0275, 24)
        .unwrap()
        .rightmost()
        .unwrap()
        .value;
    let rough = SHORT_WAVES.linear(0.0275, 4).unwrap().rightmost().unwrap();
    assert!(rough.error.is_none());
    let rough = rough
        .with_error(&SHORT_WAVES.linear(0.0275, 8).unwrap())
        .unwrap();
    let (estimate, error) = (rough.error.unwrap(), (rough.value - exact).norm());
    assert_abs_diff_eq!(estimate, error, epsilon = 0.1 * error);
    let no_finer = rough.with_error(&SHORT_WAVES.linear(0.0275, 4).unwrap());
    assert!(matches!(no_finer, Err(StabilityError::Parameter(_))));
    for tolerance in [1e-4, 1e-7] {
        let meshes = Refinement::to(tolerance);
        let found = meshes.rightmost(|n| SHORT_WAVES.linear(0.0275, n)).unwrap();
        let error = (found.value - exact).norm();
        assert!(
            error < tolerance * exact.norm()
                && is_near(found.error.unwrap() / exact.norm(), error / exact.norm())
        );
        let all = meshes
            .roots(|n| SHORT_WAVES.linear(0.0275, n), 0.0)
            .unwrap();
        // The search for all roots may choose another mesh than the search for the rightmost one.
        // `approx` cannot compare complex numbers without its feature `num-complex`.
        assert!((all[0].value - exact).norm() < tolerance * exact.norm());
        assert!(
            all.iter()
                .all(|root| root.error.unwrap() < tolerance * root.value.norm())
        );
    }
}

#[test]
fn error_estimates_of_essential_crossings_are_rounding_errors() {
    // For η < 0 the curvature grows exponentially.
    let weightless = |eta: f64, growth_time: f64, elements: usize| {
        let shoot = reduced(0.05, growth_time)
            .elements(elements)
            .tropism(Proprioception { sensitivity: eta }.remembered(MEMORY))
            .load(())
            .scene(Still::weightless())
            .into_dyn()
            .build()?;
        Linearisation::about(&shoot)
    };
    let meshes = Refinement::to(1e-7);
    let found = meshes
        .onset(|eta, n| weightless(eta, 20.0 * HOUR, n), 5.0, -5.0)
        .unwrap();
    assert!(found.essential, "{found:?}");
    assert_abs_diff_eq!(found.parameters[0], 0.0, epsilon = 1e-8);
    assert_eq!((found.frequency, found.period()), (0.0, f64::INFINITY));
    // For a range that contains zero, the estimate is 1e-10 times the larger magnitude of its two
    // ends.
    assert_eq!(found.parameter_errors, Some([5e-10]));
    let found = meshes
        .onset(|hours, n| weightless(20.0, hours * HOUR, n), 2.0, 6.0)
        .unwrap();
    assert!(found.essential, "{found:?}");
    assert_relative_eq!(
        found.parameters[0],
        3.524_494_109_609_37,
        epsilon = 0.0,
        max_relative = 1e-9
    );
    let error = found.parameter_errors.unwrap()[0] / found.parameters[0];
    // The estimate is the rounding error of the finite differences. The second mesh, which has six
    // elements, is the first one with an estimate.
    assert_relative_eq!(error, 1e-10, epsilon = 0.0, max_relative = 1e-6);
    assert_eq!(found.elements, 6);
}

#[test]
fn crossing_next_to_buckling_agrees_with_the_continuous_problem() {
    // The shoot has gravitropism only. Its mechanical response is singular where the shoot buckles;
    // the characteristic function is regular there.
    let lengths = |ratio: f64, from: f64, to: f64| {
        let length = ratio * 0.079_334_124;
        let shoot = |hours: f64| Upright {
            beta: 0.8,
            eta: 0.0,
            gravity: MEMORY,
            bending: MEMORY,
            growth_time: hours * HOUR,
        };
        let found = crossings(|hours| shoot(hours).linear(length, 12), from, to).unwrap();
        assert_eq!(found.len(), 1, "{found:?}");
        [
            shoot(found[0].parameters[0])
                .crossing(length, found[0].frequency)
                .0,
            length,
        ]
    };
    for ratio in [0.97, 0.99, 0.999] {
        let [exact, length] = lengths(ratio, 8.0, 9.0);
        // The error on twelve elements is 3e-8. An earlier version had an error of 3e-3 at a ratio
        // of 0.999. Its finite differences used bends of 3e-5 rad, whose size did not depend on the
        // resulting displacements.
        let agrees = relative_eq!(exact, length, epsilon = 0.0, max_relative = 1e-7);
        assert!(agrees, "{ratio}: {length} against {exact}");
    }
}

#[test]
fn stability_boundary_meets_its_tolerance_at_every_point() {
    let shoot = |hours: f64| Upright {
        growth_time: hours * HOUR,
        ..SHORT_WAVES
    };
    let start = onset(|length| SHORT_WAVES.linear(length, 4), 0.02, 0.03).unwrap();
    let hours = SHORT_WAVES.growth_time / HOUR;
    let settings = BoundarySettings {
        start: [hours, start.parameters[0]],
        frequency: start.frequency,
        direction: [1.0, 0.0],
        low: [5.0, 0.015],
        high: [15.0, 0.05],
        step: 0.02,
        points: 40,
    };
    let error = |point: &Crossing<2>| {
        let [hours, length] = point.parameters;
        let exact = shoot(hours).crossing(length, point.frequency);
        [
            (length / exact.0 - 1.0).abs(),
            (point.frequency / exact.1 - 1.0).abs(),
        ]
    };
    let family = |hours: f64, length: f64, elements: usize| shoot(hours).linear(length, elements);
    let coarse = boundary(|hours, length| family(hours, length, 4), &settings).unwrap();
    assert!(error(&coarse[0])[0] > 1e-4);
    let checked = coarse[0].with_error(|[h, l]| family(h, l, 8)).unwrap();
    assert_eq!(
        (checked.parameters, checked.frequency),
        (coarse[0].parameters, coarse[0].frequency)
    );
    // The estimate is the shortest distance to the curve, which is slightly less than the distance
    // in the direction of the length.
    let estimate = checked.parameter_errors.unwrap()[1] / coarse[0].parameters[1];
    assert!(
        (0.3..1.1).contains(&(estimate / error(&coarse[0])[0])),
        "{estimate:e} {:?}",
        error(&coarse[0])
    );
    let mut linearisations = 0;
    let counted = |hours: f64, length: f64, elements: usize| {
        linearisations += 1;
        family(hours, length, elements)
    };
    let found = Refinement::to(1e-6).boundary(counted, &settings).unwrap();
    assert_eq!(found.len(), coarse.len());
    for refined in &found {
        let [length, frequency] = error(refined);
        // Growth time and length both meet the tolerance. For a curve of slope one, the error of
        // the length at a given growth time is at most twice the tolerance.
        assert!(
            length < 2e-6 && frequency < 2e-6,
            "{length:e} {frequency:e} {refined:?}"
        );
        assert!(refined.elements > 4 && TAU / refined.frequency > 0.0);
    }
    // Each point requires two linearisations on the coarse mesh and one on the fine mesh. Every
    // sixteenth point is refined through four meshes.
    assert!(linearisations < 6 * found.len(), "{linearisations}");
}

/// Stationary shoot on a tilted base, with a point force at a node and with stiffness that varies
/// along the shoot.
fn leaning(elements: usize) -> Result<Shoot<DynLaws>, StabilityError> {
    let graded = Graded {
        law: YOUNG,
        factor: |tissue: &Tissue| 1.0 + 10.0 * tissue.initial_apex_distance,
    };
    let mut shoot = rod(graded, 0.06)
        .elements(elements)
        .growth(Ongoing(UniformGrowth {
            zone_length: 0.1,
            time: 20.0 * HOUR,
        }))
        .tropism(steering(SettledStatoliths))
        .load((
            WEIGHT,
            PointForce {
                initial_apex_distance: 0.017,
                force: Vector3::new(0.0, 0.0, -1e-6),
            },
        ))
        .scene(Still::tilted(0.3))
        .into_dyn()
        .build()?;
    solve_steady_state(&mut shoot)?;
    Ok(shoot)
}

#[test]
fn refined_linearisation_of_a_shoot_converges_to_that_of_a_finer_shoot() {
    let shoot = leaning(2).unwrap();
    let before = shoot.state().clone();
    let root = |linear: &Linearisation| linear.rightmost().unwrap().value;
    let exact = root(&Linearisation::about(&leaning(8).unwrap()).unwrap());
    let coarse = (root(&Linearisation::about(&shoot).unwrap()) - exact).norm() / exact.norm();
    let elements = Linearisation::about(&shoot).unwrap().elements();
    for parts in [1, 2, 3] {
        let linear = Linearisation::refined(&shoot, parts).unwrap();
        assert_eq!(linear.elements(), parts * elements);
        let error = (root(&linear) - exact).norm() / exact.norm();
        if parts == 1 {
            assert_eq!(error, coarse);
        } else {
            // The order is eight, so that the error decreases at least by a factor of 100, until
            // the rounding error of the finite differences dominates.
            assert!(
                error < (0.01 * coarse).max(1e-8),
                "{parts}: {error:e} after {coarse:e}"
            );
        }
    }
    assert_eq!(shoot.state(), &before);
    assert!(matches!(
        Linearisation::refined(&shoot, 0),
        Err(StabilityError::Parameter(_))
    ));
    assert!(matches!(
        Linearisation::refined(&shoot, usize::MAX),
        Err(StabilityError::Parameter(_))
    ));
    // A shoot that is not stationary is refused.
    let mut moving = leaning(2).unwrap();
    moving.set_intrinsic(|point| point.intrinsic * 0.9);
    let answer = Linearisation::refined(&moving, 2);
    assert!(
        matches!(answer, Err(StabilityError::NotSteadyState { .. })),
        "{answer:?}"
    );
    // The refined linearisation can be used as a family of meshes. `approx` cannot compare complex
    // numbers without its feature `num-complex`.
    let found = Refinement {
        first: 1,
        ..Refinement::to(1e-6)
    }
    .rightmost(|parts| Linearisation::refined(&shoot, parts));
    assert!((found.unwrap().value - exact).norm() < 1e-6 * exact.norm());
}
