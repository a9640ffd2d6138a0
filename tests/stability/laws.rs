//! User-defined laws in the linearisation, and stability boundaries in two parameters.

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use morphorod::ParameterError;
use morphorod::stability::{BoundarySettings, Linearisation, StabilityError, boundary, onset};
use morphorod::tropism::{
    Declaration, Growing, Memory, Proprioception, Response, SettledStatoliths, Site, TropismLaw,
    Variable,
};
use nalgebra::Vector3;

use crate::fixtures::shoots::{HOUR, MEMORY, MINUTE, gravitropism, reduced};
use crate::fixtures::upright::linearisation;

/// Gravitropism that saturates. Its variables are two concentrations c, whose magnitude is of the
/// order of `scale` C, and u̇* = REGR (β/r) tanh(c/C).
#[derive(Clone, Copy)]
struct Saturating {
    sensitivity: f64,
    scale: f64,
    memory: Memory,
}

impl TropismLaw for Saturating {
    fn gradient(&self, at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        let answer = |c: f64| self.sensitivity / at.section.radius() * (c / self.scale).tanh();
        Vector3::new(-answer(past[1]), answer(past[0]), 0.0)
    }
    fn declare(&self, to: &mut Declaration) {
        to.stimuli(2);
        for _ in 0..2 {
            to.variable(Variable::read_after(self.memory.delay));
        }
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let up = site.along_directors(&site.environment.up());
        stimuli.copy_from_slice(&[up.x * self.scale, up.y * self.scale]);
    }
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        variables.copy_from_slice(stimuli);
    }
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        for j in 0..2 {
            rates[j] = self.memory.rate(variables[j], stimuli[j]);
        }
    }
    fn check(&self) -> Result<(), ParameterError> {
        self.memory.check()
    }
}

/// Linearisation about the upright shape of a shoot of given length (m) with another law of
/// gravitropism.
fn problem(
    gravity: impl TropismLaw + Send + Sync + 'static,
    length: f64,
) -> Result<Linearisation, StabilityError> {
    let shoot = reduced(length, 20.0 * HOUR)
        .elements(4)
        .tropism((
            gravity,
            Proprioception { sensitivity: 20.0 }.remembered(MEMORY),
        ))
        .into_dyn()
        .build()?;
    Linearisation::about(&shoot)
}

#[test]
fn saturating_gravitropism_has_the_onset_of_its_linear_part() {
    let law = Saturating {
        sensitivity: 0.8,
        scale: 1.0,
        memory: MEMORY,
    };
    let found = onset(|length| problem(law, length), 0.055, 0.075)
        .unwrap()
        .parameters[0];
    // The derivative of tanh at zero is one. Finite differences with a step of 1e-4 of the scale
    // have a relative error of 1e-8/3. The resulting relative error of the length is smaller.
    assert_relative_eq!(found, 0.065_614_866_491, epsilon = 0.0, max_relative = 1e-8);
}

#[test]
fn infinite_derivative_of_a_law_is_refused() {
    struct Broken;
    impl TropismLaw for Broken {
        fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
            Vector3::new(
                if past[0] == 0.0 {
                    0.0
                } else {
                    f64::INFINITY.copysign(past[0])
                },
                past[0],
                0.0,
            )
        }
        fn declare(&self, to: &mut Declaration) {
            to.stimuli(1);
            to.variable(Variable::read_after(0.0));
        }
    }
    assert!(matches!(
        problem(Broken, 0.05),
        Err(StabilityError::NotFinite { .. })
    ));
}

#[test]
fn stability_boundary_passes_through_known_onsets_and_ends_on_the_edge_of_the_rectangle() {
    let family = |hours: f64, length: f64| {
        linearisation(length, hours * HOUR, 0.8, 20.0, SettledStatoliths, 4)
    };
    let [low, high] = [[9.0, 0.045], [45.0, 0.078]];
    let (start, frequency) = ([20.0, 0.0656], 0.86 / MEMORY.delay);
    let mut linearisations = 0;
    let mut follow = |step: f64| {
        boundary(
            |hours, length| {
                linearisations += 1;
                family(hours, length)
            },
            &BoundarySettings {
                start,
                frequency,
                direction: [1.0, 0.0],
                low,
                high,
                step,
                points: 1000,
            },
        )
        .unwrap()
    };
    let curve = follow(0.01);
    for point in &curve {
        // The period follows from x tan x = 1 and is the same at all points. The distance of a
        // point from the curve is at most 1e-9 of the sides of the rectangle, which causes a
        // relative error of 1e-9 in the frequency. The finite differences in the matrix also have
        // an error of 1e-9.
        let period = std::f64::consts::TAU / point.frequency / MINUTE;
        let agrees = relative_eq!(
            period,
            87.638_358_711_642_3,
            epsilon = 0.0,
            max_relative = 1e-8
        );
        assert!(agrees, "{point:?}: {period} min");
    }
    // The first point is close to the initial guess, and the last point is on the edge of the
    // rectangle.
    assert_abs_diff_eq!(curve[0].parameters[0], 20.0, epsilon = 0.1);
    let last = curve[curve.len() - 1].parameters;
    assert_eq!(last[0], high[0]);
    // A search along the length at the growth time of the last point returns the same onset. The
    // growth time of 40 h lies between two points.
    let found = onset(|length| family(45.0, length), 0.065, 0.078)
        .unwrap()
        .parameters[0];
    assert_relative_eq!(last[1], found, epsilon = 0.0, max_relative = 1e-8);
    let around = curve
        .windows(2)
        .find(|pair| pair[0].parameters[0] <= 40.0 && pair[1].parameters[0] > 40.0)
        .unwrap();
    assert!(
        around[0].parameters[1] < 0.072_407_759_341 && around[1].parameters[1] > 0.072_407_759_341
    );
    // Each point requires two linearisations, and the two ends require a few more.
    let points = curve.len();
    assert!(
        linearisations <= 3 * points + 10,
        "{linearisations} linearisations for {points} points"
    );
}

#[test]
fn stability_boundary_is_followed_around_a_fold() {
    // The growth time at onset is 20 h at this length. For τg = 15 h (1 + (q − 1)² + 0.1 p), the
    // boundary in (p, q) is a parabola with a fold at q = 1.
    let family = |p: f64, q: f64| {
        let hours = 15.0 * (1.0 + (q - 1.0).powi(2) + 0.1 * p);
        linearisation(
            0.065_614_866_491,
            hours * HOUR,
            0.8,
            20.0,
            SettledStatoliths,
            3,
        )
    };
    let q = 0.5_f64;
    let settings = BoundarySettings {
        start: [10.0 * (1.0 / 3.0 - (q - 1.0).powi(2)), q],
        frequency: 0.860_333_589 / MEMORY.delay,
        direction: [0.0, 1.0],
        low: [0.0, 0.0],
        high: [4.0, 2.0],
        step: 0.02,
        points: 1000,
    };
    let curve = boundary(family, &settings).unwrap();
    for point in &curve {
        let [p, q] = point.parameters;
        // The relative error of the length is 1e-9 on three elements. The slope of growth time
        // against length amplifies it by 10, and the factor 0.1 of p by another 10.
        let expected = 10.0 * (1.0 / 3.0 - (q - 1.0).powi(2));
        assert!(
            abs_diff_eq!(p, expected, epsilon = 1e-5),
            "{point:?}: {expected}"
        );
    }
    let last = curve[curve.len() - 1].parameters;
    assert!(
        last[0] == 0.0 && last[1] > 1.5,
        "the curve ends before the fold at q = 1: {last:?}"
    );
}

#[test]
fn invalid_boundary_settings_and_unstable_families_are_refused() {
    let family = |hours: f64, length: f64| {
        linearisation(length, hours * HOUR, 0.8, 20.0, SettledStatoliths, 3)
    };
    let (start, frequency) = ([20.0, 0.0656], 0.86 / MEMORY.delay);
    let settings = BoundarySettings {
        start,
        frequency,
        direction: [1.0, 0.0],
        low: [9.0, 0.045],
        high: [45.0, 0.078],
        step: 0.01,
        points: 50,
    };
    let follow = |settings: BoundarySettings| boundary(family, &settings);
    let off = BoundarySettings {
        frequency: 3.0 / MEMORY.delay,
        ..settings
    };
    assert!(matches!(
        follow(off),
        Err(StabilityError::NoConvergence { .. })
    ));
    for wrong in [
        BoundarySettings {
            direction: [0.0, 0.0],
            ..settings
        },
        BoundarySettings {
            low: settings.high,
            high: settings.low,
            ..settings
        },
        BoundarySettings {
            step: -1.0,
            ..settings
        },
    ] {
        assert!(
            matches!(follow(wrong), Err(StabilityError::Parameter(_))),
            "{wrong:?}"
        );
    }
    let gravity = gravitropism(SettledStatoliths);
    // Shoots of this family are longer than the buckling length.
    assert!(matches!(
        boundary(|_, _| problem(gravity, 0.081), &settings),
        Err(StabilityError::MechanicallyUnstable { .. })
    ));
}

#[test]
fn boundary_points_are_accurate_with_long_continuation_steps() {
    let family = |hours: f64, length: f64| {
        linearisation(length, hours * HOUR, 0.8, 20.0, SettledStatoliths, 3)
    };
    let [low, high] = [[9.0, 0.045], [45.0, 0.078]];
    let (start, frequency) = ([20.0, 0.0656], 0.86 / MEMORY.delay);
    // Long steps need several corrections each. The corrector stops when the estimate of the next
    // correction is small.
    for step in [0.03, 0.1] {
        let settings = BoundarySettings {
            start,
            frequency,
            direction: [1.0, 0.0],
            low,
            high,
            step,
            points: 1000,
        };
        let curve = boundary(family, &settings).unwrap();
        for point in &curve {
            let [hours, length] = point.parameters;
            // The reference is computed by another method on the same mesh, with an error of 1e-11.
            let found = onset(|length| family(hours, length), 0.99 * length, 1.01 * length)
                .unwrap()
                .parameters[0];
            // The error normal to the curve is at most 1e-9 of the sides of the rectangle. For
            // growth times of at least 20 h the scaled slope of the curve is less than one, so that
            // the error along the length is at most √2 times as large.
            let off = (length - found).abs() / (high[1] - low[1]);
            assert!(off < 1.5e-9, "{step}, {point:?}: {off:e}");
        }
    }
}
