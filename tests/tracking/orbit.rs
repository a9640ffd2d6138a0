//! Oscillations found in tip tracks: synthetic tracks with known components, simulated shoots with
//! known orbits, and invalid tracks.
//!
//! `MORPHOROD_CASES=1000 cargo test --workspace --test all tracking::orbit -- --nocapture` draws
//! more tracks.

use crate::fixtures::shoots;
use std::f64::consts::TAU;

use crate::fixtures::random::{Draw, number};
use crate::fixtures::shoots::{HOUR, MINUTE, STATOLITHS, WEIGHT, growing, reduced, steering};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq};
use morphorod::equilibrium::NewtonSolver;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{Pulse, Whirl};
use morphorod::orbit::{Ellipse, OrbitError, Oscillation, Path, Pattern, PlanePath, Search};
use morphorod::stability::Linearisation;
use morphorod::tropism::{Handedness, Oscillator, SettledStatoliths};
use nalgebra::{Complex, DMatrix, DVector, Rotation2, Vector2, Vector3};

/// Motion around an ellipse with a period.
#[derive(Debug, Clone, Copy)]
struct Part {
    period: f64,
    major: f64,
    minor: f64,
    direction: f64,
    phase: f64,
    sense: Handedness,
}

impl Part {
    fn at(&self, t: f64) -> Vector2<f64> {
        let (sine, cosine) = (TAU * t / self.period + self.phase).sin_cos();
        let sign = if self.sense == Handedness::Counterclockwise { 1.0 } else { -1.0 };
        Rotation2::new(self.direction) * Vector2::new(self.major * cosine, sign * self.minor * sine)
    }

    fn draw(draw: &mut Draw, period: f64) -> Self {
        let major = draw.uniform(1e-3, 1e-2);
        Self {
            period,
            major,
            minor: major * draw.unit(),
            direction: draw.uniform(-3.0, 3.0),
            phase: draw.uniform(0.0, TAU),
            sense: if draw.chance(0.5) { Handedness::Counterclockwise } else { Handedness::Clockwise },
        }
    }
}

/// A track with known components, as trackers record it: with uneven times, a gap, lost frames,
/// drift, noise and outliers.
fn tracked(draw: &mut Draw) -> (Vec<Part>, PlanePath) {
    let slow = draw.log(600.0, 3e4);
    let fast = draw.chance(0.6).then(|| slow / draw.uniform(1.5, 5.0));
    let parts: Vec<Part> = [Some(slow), fast].into_iter().flatten().map(|period| Part::draw(draw, period)).collect();
    let span = slow * draw.uniform(6.0, 16.0);
    let gap = draw.uniform(10.0, 25.0);
    let step = fast.unwrap_or(slow) / gap;
    let largest = parts.iter().map(|part| part.major).fold(0.0, f64::max);
    let noise = 0.05 * parts.iter().map(|part| part.major).fold(1.0, f64::min);
    let drift: Vec<Vector2<f64>> = (0..3).map(|_| draw.vector(2.0 * largest).xy()).collect();
    let hole = draw.uniform(0.2, 0.7);
    let hole = hole..hole + draw.uniform(0.05, 0.15);
    let (mut times, mut positions) = (Vec::new(), Vec::new());
    for k in 0..(span / step) as usize {
        let t = step * (k as f64 + draw.uniform(-0.05, 0.05));
        let x = t / span;
        if hole.contains(&x) || draw.chance(0.05) {
            continue;
        }
        let mut position = drift[0] * x + drift[1] * x * x + drift[2] * x * x * x + draw.normal() * noise;
        position += parts.iter().map(|part| part.at(t)).sum::<Vector2<f64>>();
        if draw.chance(0.02) {
            position += draw.vector(5.0 * largest).xy();
        }
        times.push(t);
        positions.push(position);
    }
    (parts, PlanePath::new(times, positions).unwrap())
}

#[test]
fn components_of_random_realistic_tracks_are_found() {
    let (cases, seed) = (number("MORPHOROD_CASES", 100), number("MORPHOROD_SEED", 1));
    let (mut inside, mut total) = (0, 0);
    for case in 0..cases {
        let mut draw = Draw::new(seed.wrapping_mul(1_000_003).wrapping_add(case));
        let (parts, path) = tracked(&mut draw);
        let found = path.oscillations(&Search::default()).unwrap();
        assert_eq!(found.oscillations.len(), parts.len(), "case {case}: {found:?}\n{parts:?}");
        for part in &parts {
            let off = |o: &Oscillation| (o.period - part.period).abs();
            let nearest = found.oscillations.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
            let ellipse = nearest.ellipse;
            let agrees = abs_diff_eq!(nearest.period, part.period, epsilon = 0.01 * part.period);
            assert!(agrees, "case {case}: {nearest:?} {part:?}");
            for (found, known) in [(ellipse.major, part.major), (ellipse.minor, part.minor)] {
                let agrees = abs_diff_eq!(found, known, epsilon = 0.05 * part.major);
                assert!(agrees, "case {case}: {nearest:?} {part:?}");
            }
            if part.minor > 0.1 * part.major {
                assert_eq!(ellipse.sense, part.sense, "case {case}");
            }
            total += 1;
            // An interval of 1.645 standard errors holds 90 % of a normal distribution.
            inside += usize::from(off(nearest) < 1.645 * nearest.period_error);
        }
    }
    let share = f64::from(inside as u32) / f64::from(total as u32);
    println!("{cases} tracks, {total} periods: {share:.3} of the 90 % intervals contain the period");
    assert!((0.85..0.95).contains(&share), "{share}");
}

#[test]
fn patterns_are_named_and_their_loops_are_counted() {
    let times: Vec<f64> = (0..900).map(|k| 60.0 * f64::from(k)).collect();
    let part = |period: f64, major: f64, minor: f64, sense| Part {
        period: period * MINUTE,
        major,
        minor,
        direction: 0.3,
        phase: 1.0,
        sense,
    };
    let (left, right) = (Handedness::Counterclockwise, Handedness::Clockwise);
    let read = |parts: &[Part]| {
        let at = |t: &f64| parts.iter().map(|part| part.at(*t)).sum();
        let path = PlanePath::new(times.clone(), times.iter().map(at).collect()).unwrap();
        path.oscillations(&Search::default()).unwrap()
    };
    let name = |parts: &[Part]| read(parts).pattern();
    assert_eq!(name(&[]), Pattern::None);
    let line = name(&[part(90.0, 1e-2, 1e-4, left)]);
    assert!(
        matches!(line, Pattern::Pendular { roundness } if abs_diff_eq!(roundness, 0.01, epsilon = 1e-9)),
        "{line:?}"
    );
    let ellipse = name(&[part(90.0, 1e-2, 5e-3, left)]);
    assert!(
        matches!(ellipse, Pattern::Elliptic { roundness } if abs_diff_eq!(roundness, 0.5, epsilon = 1e-9)),
        "{ellipse:?}"
    );
    assert!(matches!(name(&[part(90.0, 1e-2, 9.9e-3, right)]), Pattern::Circular { .. }));
    let same = name(&[part(93.0, 1e-2, 1e-2, left), part(20.0, 2e-3, 2e-3, left)]);
    assert!(
        matches!(same, Pattern::Epitrochoid { loops, ratio }
        if abs_diff_eq!(loops, 3.65, epsilon = 1e-6) && abs_diff_eq!(ratio, 0.2, epsilon = 1e-6)),
        "{same:?}"
    );
    let opposite = name(&[part(93.0, 1e-2, 1e-2, left), part(20.0, 2e-3, 2e-3, right)]);
    let named = matches!(opposite, Pattern::Hypotrochoid { loops, .. } if abs_diff_eq!(loops, 5.65, epsilon = 1e-6));
    assert!(named, "{opposite:?}");
    assert_eq!(read(&[part(93.0, 1e-2, 1e-2, right)]).sense(), Some(right));
    // An ellipse is the sum of two circles with opposite senses.
    let ellipse = read(&[part(90.0, 1e-2, 5e-3, right)]).oscillations[0].ellipse;
    assert_abs_diff_eq!(ellipse.circles[0], 2.5e-3, epsilon = 1e-9);
    assert_abs_diff_eq!(ellipse.circles[1], 7.5e-3, epsilon = 1e-9);
    assert_abs_diff_eq!(ellipse.eccentricity(), 0.75_f64.sqrt(), epsilon = 1e-9);
    assert_abs_diff_eq!(ellipse.direction, 0.3, epsilon = 1e-9);
}

#[test]
fn share_of_a_period_is_its_fraction_of_the_power() {
    let times: Vec<f64> = (0..400).map(|k| 60.0 * f64::from(k)).collect();
    let circle = |t: f64, minutes: f64, size: f64| {
        let (sine, cosine) = (TAU * t / (minutes * MINUTE)).sin_cos();
        Vector2::new(cosine, sine) * size
    };
    let at = |t: &f64| circle(*t, 88.0, 3e-3) + circle(*t, 24.0, 4e-3);
    let path = PlanePath::new(times.clone(), times.iter().map(at).collect()).unwrap();
    let share = |minutes: f64| path.share(minutes * MINUTE, &Search::default()).unwrap();
    // The powers of the circles are proportional to 4² and 3².
    assert_abs_diff_eq!(share(24.0), 0.64, epsilon = 1e-6);
    assert_abs_diff_eq!(share(88.0), 0.36, epsilon = 1e-6);
    assert!(share(40.0) < 1e-9, "{}", share(40.0));
    let still = PlanePath::new(times.clone(), vec![Vector2::new(1.0, 2.0); times.len()]).unwrap();
    assert_eq!(still.share(1440.0, &Search::default()), Ok(0.0));
}

/// The shoot of 6.59 cm has a circular orbit with the exact period 87.6383587116423 min and radius
/// 14.6226216 mm (`circular_orbit`).
#[test]
fn period_and_radius_of_a_simulated_circular_orbit_are_exact() {
    let whirl = Whirl { force: 1e-5, period: 87.6 * MINUTE, turns: 2.0 };
    let mut shoot = reduced(0.0659, 20.0 * HOUR).elements(4).load((WEIGHT, whirl)).into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(45.0);
    run.advance(&mut shoot, 300.0 * HOUR).unwrap();
    let (mut times, mut tips) = (Vec::new(), Vec::new());
    for k in 0..=240 {
        let t = 300.0 * HOUR + 225.0 * f64::from(k);
        run.advance(&mut shoot, t).unwrap();
        times.push(t);
        tips.push(shoot.tip());
    }
    let path = Path::new(times, tips).unwrap().seen_along(&Vector3::z()).unwrap();
    let found = path.oscillations(&Search::default()).unwrap();
    let first = found.oscillations[0];
    assert_relative_eq!(first.period, 87.6383587116423 * MINUTE, epsilon = 0.0, max_relative = 1e-6);
    assert_relative_eq!(first.ellipse.major, 14.6226216e-3, epsilon = 0.0, max_relative = 1e-5);
    assert!(matches!(found.pattern(), Pattern::Circular { roundness } if roundness > 0.9999), "{found:?}");
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
    let path = Path::new(times, tips).unwrap().seen_along(&Vector3::z()).unwrap();
    let share = |hours: f64| {
        let window = path.between((hours - 2.0) * HOUR, (hours + 2.0) * HOUR);
        window.share(24.0 * MINUTE, &Search::default()).unwrap()
    };
    let shares = [4.0, 9.0, 10.5, 20.0, 25.0, 30.0].map(share);
    println!("{shares:.3?}");
    // The share falls below one half between 9 and 10.5 h.
    assert!(shares[0] > 0.75 && shares[1] > 0.5 && shares[2] < 0.5, "{shares:?}");
    assert!(shares[3..].iter().all(|share| *share < 0.02), "{shares:?}");
}

/// "Video 4": a kick along (2, 1, 0), and a perpendicular one after 30 h. The shoot first
/// oscillates in a plane and later approaches a circular orbit.
#[test]
fn first_kick_gives_planar_and_second_kick_circular_oscillations() {
    let kick = |direction: Vector3<f64>, start: f64| Pulse { peak: direction * 1e-5, start, duration: 12.0 * MINUTE };
    let kicks = (kick(Vector3::new(2.0, 1.0, 0.0), 0.0), kick(Vector3::new(1.0, -2.0, 0.0), 1800.0 * MINUTE));
    let builder = reduced(0.0659, 20.0 * HOUR).elements(4).tropism(steering(STATOLITHS)).load((WEIGHT, kicks));
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
        let off = tips.iter().map(|tip| (tip.dot(&across) / tip.norm()).abs()).fold(0.0, f64::max);
        let path = Path::new(times, tips).unwrap().seen_along(&Vector3::z()).unwrap();
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
    assert!(matches!(circles.pattern(), Pattern::Circular { .. }) && roundness > 0.999, "{circles:?}");
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
    let path = Path::new(times, tips).unwrap().seen_along(&Vector3::z()).unwrap();
    let found = path.oscillations(&Search::default()).unwrap().oscillations[0];
    assert_relative_eq!(found.period, period, epsilon = 0.0, max_relative = 1e-4);
    let size = Complex::from(alpha / shoots::RADIUS);
    let gradient = Vector3::new(size, Complex::new(0.0, -size.re), Complex::ZERO);
    let linear = Linearisation::about(&build().into_dyn().build().unwrap()).unwrap();
    let answer = linear.response(TAU / period, &gradient).unwrap();
    let apex = answer.displacement.last().unwrap();
    // The displacement is Re[d exp(iωt)] = Re d cos ωt − Im d sin ωt.
    let expected = Ellipse::of(&apex.xy().map(|z| z.re), &apex.xy().map(|z| -z.im));
    assert_relative_eq!(found.ellipse.major, expected.major, epsilon = 0.0, max_relative = 1e-3);
    assert_eq!(found.ellipse.sense, expected.sense);
    assert!(expected.roundness() > 1.0 - 1e-6 && expected.major > 1e-5, "{expected:?}");
    // Invalid frequencies, and a gradient with twist, are refused.
    for omega in [0.0, -1.0, f64::NAN] {
        assert!(linear.response(omega, &gradient).is_err());
    }
    let twist = Vector3::new(Complex::ZERO, Complex::ZERO, size);
    assert!(linear.response(TAU / period, &twist).unwrap_err().to_string().contains("gradient"));
}

/// Figure 6 of Agostinelli, DeSimone and Noselli (2021): a circular orbit, and an internal
/// oscillator of 20 min in the same or in the opposite sense.
#[test]
fn circular_orbit_and_internal_oscillator_make_the_trochoids_of_figure_6() {
    let read = |sense: Handedness| {
        let (gravitropism, proprioception) = steering(STATOLITHS);
        let oscillator = Oscillator { handedness: sense, ..Oscillator::new(0.3, 20.0 * MINUTE) };
        let whirl = Whirl { force: 1e-5, period: 93.0 * MINUTE, turns: 2.0 };
        let laws = (oscillator, gravitropism, proprioception);
        let builder = reduced(0.06565, 20.0 * HOUR).elements(4).tropism(laws).load((WEIGHT, whirl));
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
        let path = Path::new(times, tips).unwrap().seen_along(&Vector3::z()).unwrap();
        path.oscillations(&Search::default()).unwrap()
    };
    for sense in [Handedness::Counterclockwise, Handedness::Clockwise] {
        let found = read(sense);
        let [slow, fast] = [found.oscillations[0], found.oscillations[1]];
        assert_relative_eq!(fast.period, 20.0 * MINUTE, epsilon = 0.0, max_relative = 1e-3);
        assert_eq!(fast.ellipse.sense, sense, "{found:?}");
        assert_eq!(slow.ellipse.sense, Handedness::Counterclockwise);
        let turns = slow.period / fast.period;
        match (sense, found.pattern()) {
            (Handedness::Counterclockwise, Pattern::Epitrochoid { loops, .. }) => assert_eq!(loops, turns - 1.0),
            (Handedness::Clockwise, Pattern::Hypotrochoid { loops, .. }) => assert_eq!(loops, turns + 1.0),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn right_handed_rotation_about_the_viewing_axis_is_counterclockwise() {
    let times: Vec<f64> = (0..100).map(f64::from).collect();
    for axis in [Vector3::z(), Vector3::x(), Vector3::new(1.0, -2.0, 0.5), -Vector3::z()] {
        let about = nalgebra::Unit::new_normalize(axis);
        let start = axis.cross(&Vector3::new(0.3, 0.8, 0.1));
        let at = |t: &f64| nalgebra::Rotation3::from_axis_angle(&about, TAU * t / 20.0) * start;
        let path = Path::new(times.clone(), times.iter().map(at).collect()).unwrap();
        let found = path.seen_along(&axis).unwrap().oscillations(&Search::default()).unwrap();
        assert_eq!(found.sense(), Some(Handedness::Counterclockwise), "{axis:?}");
        assert_relative_eq!(found.oscillations[0].ellipse.major, start.norm(), epsilon = 0.0, max_relative = 1e-9);
    }
}

#[test]
fn moving_average_uses_the_given_number_of_positions() {
    let times: Vec<f64> = (0..10).map(f64::from).collect();
    let path = Path::new(times, (0..10).map(|k| Vector3::x() * f64::from(k * k)).collect()).unwrap();
    let mean = path.moving_average(3).unwrap();
    assert_eq!((mean.times()[0], mean.positions().len()), (1.0, 8));
    assert_abs_diff_eq!(mean.positions()[0].x, 5.0 / 3.0, epsilon = 1e-14);
    assert!(matches!(path.moving_average(11), Err(OrbitError::TooFew { positions: 10, needed: 11 })));
    assert!(path.moving_average(0).is_err());
}

#[test]
fn invalid_tracks_and_search_settings_are_refused() {
    let times = |n: u32| -> Vec<f64> { (0..n).map(f64::from).collect() };
    let error = Path::new(times(3), vec![Vector3::zeros(); 2]).unwrap_err();
    assert_eq!(error, OrbitError::Unequal { times: 3, positions: 2 });
    let mut repeated = times(5);
    repeated[3] = 2.0;
    let error = Path::new(repeated, vec![Vector3::zeros(); 5]).unwrap_err();
    assert_eq!(error, OrbitError::NotLater { index: 3, time: 2.0 });
    let mut lost = vec![Vector3::zeros(); 5];
    lost[4].y = f64::NAN;
    assert_eq!(Path::new(times(5), lost).unwrap_err(), OrbitError::NotFinite { what: "position", index: 4 });
    let mut never = times(5);
    never[1] = f64::INFINITY;
    let error = PlanePath::new(never, vec![Vector2::zeros(); 5]).unwrap_err();
    assert_eq!(error, OrbitError::NotFinite { what: "time", index: 1 });
    let still = |n: u32| PlanePath::new(times(n), vec![Vector2::zeros(); n as usize]).unwrap();
    let search = Search::default();
    assert!(matches!(still(10).oscillations(&search), Err(OrbitError::TooFew { .. })));
    assert!(matches!(still(0).oscillations(&search), Err(OrbitError::TooFew { .. })));
    assert!(still(50).between(30.0, 20.0).oscillations(&search).is_err());
    assert_eq!(still(50).between(10.0, 20.0).times().len(), 11);
    // A tip that does not move has no period, which is a valid result.
    let found = still(50).oscillations(&search).unwrap();
    assert!(found.oscillations.is_empty() && found.noise == 0.0 && found.outliers.is_empty());
    for least_turns in [0.0, f64::NAN, -1.0] {
        let error = still(50).oscillations(&Search { least_turns, ..search }).unwrap_err();
        assert!(error.to_string().contains("least number of turns"), "{error}");
    }
    for period in [0.0, -5.0, f64::NAN, 60.0] {
        assert!(still(50).share(period, &search).is_err(), "{period}");
    }
    let path = Path::new(times(50), vec![Vector3::zeros(); 50]).unwrap();
    assert!(path.seen_along(&Vector3::zeros()).is_err());
}

/// A length of 6.45 cm is below the onset at 6.56 cm. Oscillations after a kick have the decay rate
/// and the frequency of the rightmost root.
#[test]
fn oscillations_below_onset_decay_at_the_rate_of_the_rightmost_root() {
    let kick = Pulse { peak: Vector3::new(1e-7, 0.0, 0.0), start: 0.0, duration: 12.0 * MINUTE };
    let mut shoot = reduced(0.0645, 20.0 * HOUR).elements(4).load((WEIGHT, kick)).into_dyn().build().unwrap();
    let root = Linearisation::about(&shoot.with_model(shoot.model().clone().with_load(WEIGHT).into_dyn()).unwrap());
    let root = root.unwrap().rightmost().unwrap().value;
    let (every, mut run) = (10.0 * MINUTE, MethodOfSteps::with_solver(60.0, NewtonSolver::with_tolerance(1e-12)));
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
    // A relative error of 1e-3 of both parts is promised. Steps of a minute leave a relative error
    // of 1e-6 of the frequency.
    assert_relative_eq!(measured.re, root.re, epsilon = 0.0, max_relative = 1e-3);
    assert_relative_eq!(measured.im, root.im, epsilon = 0.0, max_relative = 1e-4);
}
