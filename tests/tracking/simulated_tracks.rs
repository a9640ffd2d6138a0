//! Oscillations found in the tip tracks of simulated shoots with known orbits.

use std::f64::consts::TAU;

use crate::fixtures::shoots::{self, HOUR, MINUTE, STATOLITHS, WEIGHT, growing, reduced, steering};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::ShootParameters;
use morphorod::equilibrium::NewtonSolver;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{Pulse, Whirl};
use morphorod::stability::Linearisation;
use morphorod::tracking::{Ellipse, Pattern, Search, Track};
use morphorod::tropism::{Handedness, Oscillator, SettledStatoliths};
use nalgebra::{Complex, DMatrix, DVector, Vector3};

/// The shoot of 6.59 cm has a circular orbit with the exact period 87.6383587116423 min and radius
/// 14.6226216 mm (`circular_orbit`).
#[test]
fn period_and_radius_of_a_simulated_circular_orbit_are_exact() {
    let whirl = Whirl {
        force: 1e-5,
        period: 87.6 * MINUTE,
        turns: 2.0,
    };
    let mut shoot = reduced(0.0659, 20.0 * HOUR)
        .elements(4)
        .load((WEIGHT, whirl))
        .into_dyn()
        .build()
        .unwrap();
    let mut run = MethodOfSteps::new(45.0);
    run.advance(&mut shoot, 300.0 * HOUR).unwrap();
    let (mut times, mut tips) = (Vec::new(), Vec::new());
    for k in 0..=240 {
        let t = 300.0 * HOUR + 225.0 * f64::from(k);
        run.advance(&mut shoot, t).unwrap();
        times.push(t);
        tips.push(shoot.tip());
    }
    let path = Track::seen_along(&Vector3::z(), times, &tips).unwrap();
    let found = path.oscillations(&Search::default()).unwrap();
    let first = found.oscillations[0];
    assert_relative_eq!(
        first.period,
        87.6383587116423 * MINUTE,
        epsilon = 0.0,
        max_relative = 1e-6
    );
    assert_relative_eq!(
        first.ellipse.major,
        14.6226216e-3,
        epsilon = 0.0,
        max_relative = 1e-5
    );
    assert!(
        found.pattern() == Pattern::Circular && first.ellipse.roundness() > 0.9999,
        "{found:?}"
    );
}

/// The growing shoot first follows its internal oscillator of 24 min. Later self-sustained
/// oscillations dominate.
#[test]
fn share_of_the_internal_oscillator_falls_as_the_shoot_grows() {
    let mut shoot = growing().load(WEIGHT).into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(90.0);
    let (mut times, mut tips) = (Vec::new(), Vec::new());
    for k in 0..=1280 {
        let t = 90.0 * f64::from(k);
        run.advance(&mut shoot, t).unwrap();
        times.push(t);
        tips.push(shoot.tip());
    }
    let path = Track::seen_along(&Vector3::z(), times, &tips).unwrap();
    let share = |hours: f64| {
        let window = path.between((hours - 2.0) * HOUR, (hours + 2.0) * HOUR);
        window.share(24.0 * MINUTE, &Search::default()).unwrap()
    };
    let shares = [4.0, 9.0, 10.5, 20.0, 25.0, 30.0].map(share);
    println!("{shares:.3?}");
    // The share falls below one half between 9 and 10.5 h.
    assert!(
        shares[0] > 0.75 && shares[1] > 0.5 && shares[2] < 0.5,
        "{shares:?}"
    );
    assert!(shares[3..].iter().all(|share| *share < 0.02), "{shares:?}");
    // From 8 h on, the share decreases monotonically. It would increase if the drift followed a
    // part of the slow oscillation.
    let falling: Vec<f64> = (16..=40).map(|k| share(0.5 * f64::from(k))).collect();
    assert!(
        falling.windows(2).all(|pair| pair[1] < pair[0] + 1e-3),
        "{falling:.3?}"
    );
}

/// "Video 3", with a weak oscillator, α = 0.01: the slow oscillation begins as an ellipse whose
/// axis ratio is constant while the amplitude is small, and becomes a circle.
#[test]
fn with_a_weak_oscillator_ellipses_become_circles() {
    let parameters = ShootParameters {
        oscillator_sensitivity: 0.01,
        ..ShootParameters::default()
    };
    let mut shoot = parameters.shoot().into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(90.0);
    let (mut times, mut tips) = (Vec::new(), Vec::new());
    for k in 0..=1600 {
        let t = 90.0 * f64::from(k);
        run.advance(&mut shoot, t).unwrap();
        times.push(t);
        tips.push(shoot.tip());
    }
    let path = Track::seen_along(&Vector3::z(), times, &tips).unwrap();
    let roundness = |hours: f64| {
        let window = path.between((hours - 3.0) * HOUR, (hours + 3.0) * HOUR);
        let found = window.oscillations(&Search::default()).unwrap();
        let slow = found
            .oscillations
            .iter()
            .find(|wave| wave.period > 48.0 * MINUTE);
        slow.unwrap().ellipse.roundness()
    };
    // Known values: a fit of oscillations with exponential amplitudes to each coordinate, by
    // another program. In a window of 6 h the amplitude grows up to fiftyfold. The analysis here
    // assumes a constant amplitude, which changes the ratio by up to 0.02.
    for hours in [9.0, 11.0, 13.0, 15.0] {
        assert_abs_diff_eq!(roundness(hours), 0.219, epsilon = 0.03);
    }
    let later: Vec<f64> = (9..=18)
        .map(|k| roundness(2.0 * f64::from(k) + 1.0))
        .collect();
    println!("{later:.3?}");
    assert!(
        later.windows(2).all(|pair| pair[1] > pair[0]),
        "{later:.3?}"
    );
    assert_abs_diff_eq!(later[9], 0.9965, epsilon = 2e-3);
}

/// "Video 4": a force pulse along (2, 1, 0) is followed by a perpendicular pulse after 30 h. The
/// shoot first oscillates in a plane and later approaches a circular orbit.
#[test]
fn first_kick_gives_planar_and_second_kick_circular_oscillations() {
    let kick = |direction: Vector3<f64>, start: f64| Pulse {
        peak: direction * 1e-5,
        start,
        duration: 12.0 * MINUTE,
    };
    let kicks = (
        kick(Vector3::new(2.0, 1.0, 0.0), 0.0),
        kick(Vector3::new(1.0, -2.0, 0.0), 1800.0 * MINUTE),
    );
    let builder = reduced(0.0659, 20.0 * HOUR)
        .elements(4)
        .tropism(steering(STATOLITHS))
        .load((WEIGHT, kicks));
    let mut shoot = builder.into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(120.0);
    let mut follow = |from: f64, to: f64| {
        run.advance(&mut shoot, from * HOUR).unwrap();
        let (mut times, mut tips) = (Vec::new(), Vec::new());
        for k in 0..=((to - from) * HOUR / 240.0) as u32 {
            let t = from * HOUR + 240.0 * f64::from(k);
            run.advance(&mut shoot, t).unwrap();
            times.push(t);
            tips.push(shoot.tip());
        }
        let across = Vector3::new(1.0, -2.0, 0.0).normalize();
        let off = tips
            .iter()
            .map(|tip| (tip.dot(&across) / tip.norm()).abs())
            .fold(0.0, f64::max);
        let path = Track::seen_along(&Vector3::z(), times, &tips).unwrap();
        (off, path.oscillations(&Search::default()).unwrap())
    };
    let (off, planar) = follow(10.0, 29.9);
    assert!(off < 1e-6, "{off:e} rad off its plane");
    let ellipse = planar.oscillations[0].ellipse;
    assert!(ellipse.roundness() < 1e-6, "{planar:?}");
    assert_abs_diff_eq!(ellipse.direction, 0.5_f64.atan(), epsilon = 1e-6);
    let (_, circles) = follow(108.0, 120.0);
    let roundness = circles.oscillations[0].ellipse.roundness();
    println!("minor over major axis {roundness}");
    assert!(
        circles.pattern() == Pattern::Circular && roundness > 0.999,
        "{circles:?}"
    );
}

/// Below onset the tip of a shoot with an internal oscillator moves on an ellipse with the period
/// of the oscillator. Its size is that of the linear response of the shoot without the oscillator.
#[test]
fn below_onset_the_orbit_is_the_linear_response_to_the_internal_oscillator() {
    let (length, alpha, period) = (0.06, 0.01, 24.0 * MINUTE);
    let build = || reduced(length, 20.0 * HOUR).elements(4);
    let (gravitropism, proprioception) = steering(SettledStatoliths);
    let oscillating = (Oscillator::new(alpha, period), gravitropism, proprioception);
    let mut shoot = build().tropism(oscillating).into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(60.0);
    run.advance(&mut shoot, 60.0 * HOUR).unwrap();
    let (mut times, mut tips) = (Vec::new(), Vec::new());
    for k in 0..240 {
        let t = 60.0 * HOUR + 60.0 * f64::from(k);
        run.advance(&mut shoot, t).unwrap();
        times.push(t);
        tips.push(shoot.tip());
    }
    let path = Track::seen_along(&Vector3::z(), times, &tips).unwrap();
    let found = path.oscillations(&Search::default()).unwrap().oscillations[0];
    assert_relative_eq!(found.period, period, epsilon = 0.0, max_relative = 1e-4);
    let size = Complex::from(alpha / shoots::RADIUS);
    let gradient = Vector3::new(size, Complex::new(0.0, -size.re), Complex::ZERO);
    let linear = Linearisation::about(&build().into_dyn().build().unwrap()).unwrap();
    let answer = linear.response(TAU / period, &gradient).unwrap();
    let apex = answer.displacement.last().unwrap();
    // The displacement is Re[d exp(iωt)] = Re d cos ωt − Im d sin ωt.
    let expected = Ellipse::of(&apex.xy().map(|z| z.re), &apex.xy().map(|z| -z.im));
    assert_relative_eq!(
        found.ellipse.major,
        expected.major,
        epsilon = 0.0,
        max_relative = 1e-3
    );
    assert_eq!(found.ellipse.sense, expected.sense);
    assert!(
        expected.roundness() > 1.0 - 1e-6 && expected.major > 1e-5,
        "{expected:?}"
    );
    // Invalid frequencies and gradients with twist are refused.
    for omega in [0.0, -1.0, f64::NAN] {
        assert!(linear.response(omega, &gradient).is_err());
    }
    let twist = Vector3::new(Complex::ZERO, Complex::ZERO, size);
    assert!(
        linear
            .response(TAU / period, &twist)
            .unwrap_err()
            .to_string()
            .contains("gradient")
    );
}

/// Figure 6 of Agostinelli, DeSimone and Noselli (2021): a circular orbit combined with an internal
/// oscillator of 20 min in the same or in the opposite sense.
#[test]
fn circular_orbit_and_internal_oscillator_make_the_trochoids_of_figure_6() {
    let read = |sense: Handedness| {
        let (gravitropism, proprioception) = steering(STATOLITHS);
        let oscillator = Oscillator {
            handedness: sense,
            ..Oscillator::new(0.3, 20.0 * MINUTE)
        };
        let whirl = Whirl {
            force: 1e-5,
            period: 93.0 * MINUTE,
            turns: 2.0,
        };
        let laws = (oscillator, gravitropism, proprioception);
        let builder = reduced(0.06565, 20.0 * HOUR)
            .elements(4)
            .tropism(laws)
            .load((WEIGHT, whirl));
        let mut shoot = builder.into_dyn().build().unwrap();
        let mut run = MethodOfSteps::new(60.0);
        run.advance(&mut shoot, 20.0 * HOUR).unwrap();
        let (mut times, mut tips) = (Vec::new(), Vec::new());
        for k in 0..600 {
            let t = 20.0 * HOUR + 120.0 * f64::from(k);
            run.advance(&mut shoot, t).unwrap();
            times.push(t);
            tips.push(shoot.tip());
        }
        let path = Track::seen_along(&Vector3::z(), times, &tips).unwrap();
        path.oscillations(&Search::default()).unwrap()
    };
    for sense in [Handedness::Counterclockwise, Handedness::Clockwise] {
        let found = read(sense);
        let [slow, fast] = [found.oscillations[0], found.oscillations[1]];
        assert_relative_eq!(
            fast.period,
            20.0 * MINUTE,
            epsilon = 0.0,
            max_relative = 1e-3
        );
        assert_eq!(fast.ellipse.sense, Some(sense), "{found:?}");
        assert_eq!(slow.ellipse.sense, Some(Handedness::Counterclockwise));
        let turns = slow.period / fast.period;
        match (sense, found.pattern()) {
            (Handedness::Counterclockwise, Pattern::Epitrochoid { loops, .. }) => {
                assert_eq!(loops, turns - 1.0)
            }
            (Handedness::Clockwise, Pattern::Hypotrochoid { loops, .. }) => {
                assert_eq!(loops, turns + 1.0)
            }
            other => panic!("{other:?}"),
        }
    }
}
/// A length of 6.45 cm is below the onset at 6.56 cm. Oscillations after a pulse have the decay
/// rate and the frequency of the rightmost root.
#[test]
fn oscillations_below_onset_decay_at_the_rate_of_the_rightmost_root() {
    let kick = Pulse {
        peak: Vector3::new(1e-7, 0.0, 0.0),
        start: 0.0,
        duration: 12.0 * MINUTE,
    };
    let mut shoot = reduced(0.0645, 20.0 * HOUR)
        .elements(4)
        .load((WEIGHT, kick))
        .into_dyn()
        .build()
        .unwrap();
    let root = Linearisation::about(
        &shoot
            .with_model(shoot.model().clone().with_load(WEIGHT).into_dyn())
            .unwrap(),
    );
    let root = root.unwrap().rightmost().unwrap().value;
    let (every, mut run) = (
        10.0 * MINUTE,
        MethodOfSteps::with_solver(60.0, NewtonSolver::with_tolerance(1e-12)),
    );
    let mut seen = Vec::new();
    // The next root is at −0.96 1/h. After 12 h its contribution is 1e-4 of that of the first root.
    for k in 72..240 {
        run.advance(&mut shoot, every * f64::from(k)).unwrap();
        seen.push(shoot.tip().x);
    }
    // A damped oscillation satisfies x(t + 2h) = a x(t + h) + b x(t). Both coefficients are fitted
    // by least squares.
    let rows = seen.len() - 2;
    let matrix = DMatrix::from_fn(rows, 2, |i, j| seen[i + 1 - j]);
    let right = DVector::from_fn(rows, |i, _| seen[i + 2]);
    let normal = matrix.transpose() * &matrix;
    let found = normal.lu().solve(&(matrix.transpose() * right)).unwrap();
    let (a, b) = (found[0], found[1]);
    let z = Complex::new(0.5 * a, (-b - 0.25 * a * a).sqrt());
    let measured = z.ln() / every;
    assert!(root.re < 0.0, "{root}");
    // The relative tolerances are 1e-3 for the decay rate and 1e-4 for the frequency. Steps of one
    // minute cause a relative error of 1e-6 in the frequency.
    assert_relative_eq!(measured.re, root.re, epsilon = 0.0, max_relative = 1e-3);
    assert_relative_eq!(measured.im, root.im, epsilon = 0.0, max_relative = 1e-4);
}
