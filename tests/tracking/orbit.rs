//! The reading of paths: made up ones whose parts are known, the paths of shoots whose orbits are known, and paths that are none.
//!
//! `MORPHOROD_CASES=1000 cargo test --workspace --test orbit -- --nocapture` draws more paths.

use crate::fixtures::shoots;
use std::f64::consts::TAU;

use crate::fixtures::random::{Draw, number};
use crate::fixtures::shoots::{HOUR, MINUTE, STATOLITHS, WEIGHT, growing, reduced, steering};
use morphorod::equilibrium::NewtonSolver;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{Pulse, Whirl};
use morphorod::orbit::{Ellipse, OrbitError, Oscillation, Path, Pattern, PlanePath, Search};
use morphorod::stability::Linearisation;
use morphorod::tropism::{Handedness, Oscillator, SettledStatoliths};
use nalgebra::{Complex, DMatrix, DVector, Rotation2, Vector2, Vector3};

/// An ellipse gone round in a period.
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

/// A path as trackers make them: at times that are not even, with a gap, lost frames, drift, noise and outliers.
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
fn paths_as_trackers_make_them() {
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
            assert!(off(nearest) < 0.01 * part.period, "case {case}: {nearest:?} {part:?}");
            for (found, known) in [(ellipse.major, part.major), (ellipse.minor, part.minor)] {
                assert!((found - known).abs() < 0.05 * part.major, "case {case}: {nearest:?} {part:?}");
            }
            if part.minor > 0.1 * part.major {
                assert_eq!(ellipse.sense, part.sense, "case {case}");
            }
            total += 1;
            // Nine tenths of a normal distribution.
            inside += usize::from(off(nearest) < 1.645 * nearest.period_error);
        }
    }
    let share = f64::from(inside as u32) / f64::from(total as u32);
    println!("{cases} paths, {total} periods: {share:.3} of the intervals of 90 % hold");
    assert!((0.85..0.95).contains(&share), "{share}");
}

#[test]
fn the_name_of_a_pattern_and_its_loops() {
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
    assert!(matches!(line, Pattern::Pendular { roundness } if (roundness - 0.01).abs() < 1e-9), "{line:?}");
    let ellipse = name(&[part(90.0, 1e-2, 5e-3, left)]);
    assert!(matches!(ellipse, Pattern::Elliptic { roundness } if (roundness - 0.5).abs() < 1e-9), "{ellipse:?}");
    assert!(matches!(name(&[part(90.0, 1e-2, 9.9e-3, right)]), Pattern::Circular { .. }));
    let same = name(&[part(93.0, 1e-2, 1e-2, left), part(20.0, 2e-3, 2e-3, left)]);
    assert!(
        matches!(same, Pattern::Epitrochoid { loops, ratio }
        if (loops - 3.65).abs() < 1e-6 && (ratio - 0.2).abs() < 1e-6),
        "{same:?}"
    );
    let opposite = name(&[part(93.0, 1e-2, 1e-2, left), part(20.0, 2e-3, 2e-3, right)]);
    assert!(matches!(opposite, Pattern::Hypotrochoid { loops, .. } if (loops - 5.65).abs() < 1e-6), "{opposite:?}");
    assert_eq!(read(&[part(93.0, 1e-2, 1e-2, right)]).sense(), Some(right));
    // An ellipse is two circles, and its power that of both.
    let ellipse = read(&[part(90.0, 1e-2, 5e-3, right)]).oscillations[0].ellipse;
    assert!((ellipse.circles[0] - 2.5e-3).abs() < 1e-9 && (ellipse.circles[1] - 7.5e-3).abs() < 1e-9, "{ellipse:?}");
    assert!((ellipse.eccentricity() - 0.75_f64.sqrt()).abs() < 1e-9 && (ellipse.direction - 0.3).abs() < 1e-9);
}

#[test]
fn the_share_of_a_period() {
    let times: Vec<f64> = (0..400).map(|k| 60.0 * f64::from(k)).collect();
    let circle = |t: f64, minutes: f64, size: f64| {
        let (sine, cosine) = (TAU * t / (minutes * MINUTE)).sin_cos();
        Vector2::new(cosine, sine) * size
    };
    let at = |t: &f64| circle(*t, 88.0, 3e-3) + circle(*t, 24.0, 4e-3);
    let path = PlanePath::new(times.clone(), times.iter().map(at).collect()).unwrap();
    let share = |minutes: f64| path.share(minutes * MINUTE, &Search::default()).unwrap();
    assert!((share(24.0) - 0.64).abs() < 1e-6 && (share(88.0) - 0.36).abs() < 1e-6, "{} {}", share(24.0), share(88.0));
    assert!(share(40.0) < 1e-9, "{}", share(40.0));
    let still = PlanePath::new(times.clone(), vec![Vector2::new(1.0, 2.0); times.len()]).unwrap();
    assert_eq!(still.share(1440.0, &Search::default()), Ok(0.0));
}

/// The exact circular orbit of 6.59 cm: 87.6383587116423 min and 14.6226216 mm (`circular_orbit`).
#[test]
fn the_circular_orbit_is_read_to_its_known_digits() {
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
    assert!((first.period / (87.6383587116423 * MINUTE) - 1.0).abs() < 1e-6, "{first:?}");
    assert!((first.ellipse.major / 14.6226216e-3 - 1.0).abs() < 1e-5, "{first:?}");
    assert!(matches!(found.pattern(), Pattern::Circular { roundness } if roundness > 0.9999), "{found:?}");
}

/// The growing shoot: at first it follows its oscillator of 24 min, later swings of its own.
#[test]
fn the_share_of_the_oscillator_falls_as_the_shoot_grows() {
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
    // One half is passed between 9 and 10.5 h.
    assert!(shares[0] > 0.75 && shares[1] > 0.5 && shares[2] < 0.5, "{shares:?}");
    assert!(shares[3..].iter().all(|share| *share < 0.02), "{shares:?}");
}

/// "Video 4": a kick along (2, 1, 0), and one across it after 30 h; the shoot swings in a plane, then comes to go round.
#[test]
fn two_kicks_make_a_pendulum_and_then_a_circle() {
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
    let (off, swings) = follow(10.0, 29.9);
    assert!(off < 1e-6, "{off:e} rad off its plane");
    let ellipse = swings.oscillations[0].ellipse;
    assert!(ellipse.roundness() < 1e-6 && (ellipse.direction - 0.5_f64.atan()).abs() < 1e-6, "{swings:?}");
    let (_, circles) = follow(108.0, 120.0);
    let roundness = circles.oscillations[0].ellipse.roundness();
    println!("minor over major axis {roundness}");
    assert!(matches!(circles.pattern(), Pattern::Circular { .. }) && roundness > 0.999, "{circles:?}");
}

/// Below onset a shoot with an oscillator goes round at its period, as far as the linear response of the shoot without it says.
#[test]
fn below_onset_the_oscillator_is_answered_linearly() {
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
    assert!((found.period / period - 1.0).abs() < 1e-4, "{found:?}");
    let size = Complex::from(alpha / shoots::RADIUS);
    let gradient = Vector3::new(size, Complex::new(0.0, -size.re), Complex::ZERO);
    let linear = Linearisation::about(&build().into_dyn().build().unwrap()).unwrap();
    let answer = linear.response(TAU / period, &gradient).unwrap();
    let apex = answer.displacement.last().unwrap();
    // Re[d exp(iωt)] with the two coordinates as those of a circle.
    let expected = Ellipse::of(&apex.xy().map(|z| z.re), &apex.xy().map(|z| -z.im));
    assert!((found.ellipse.major / expected.major - 1.0).abs() < 1e-3, "{found:?} {expected:?}");
    assert_eq!(found.ellipse.sense, expected.sense);
    assert!(expected.roundness() > 1.0 - 1e-6 && expected.major > 1e-5, "{expected:?}");
    // What makes no sense.
    for omega in [0.0, -1.0, f64::NAN] {
        assert!(linear.response(omega, &gradient).is_err());
    }
    let twist = Vector3::new(Complex::ZERO, Complex::ZERO, size);
    assert!(linear.response(TAU / period, &twist).unwrap_err().to_string().contains("gradient"));
}

/// Figure 6 of Agostinelli, DeSimone and Noselli (2021): a circular orbit, and an oscillator of 20 min in the same sense or the other.
#[test]
fn the_trochoids_of_figure_6() {
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
        assert!((fast.period / (20.0 * MINUTE) - 1.0).abs() < 1e-3 && fast.ellipse.sense == sense, "{found:?}");
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
fn along_an_axis_counterclockwise_is_towards_the_observer() {
    let times: Vec<f64> = (0..100).map(f64::from).collect();
    for axis in [Vector3::z(), Vector3::x(), Vector3::new(1.0, -2.0, 0.5), -Vector3::z()] {
        let about = nalgebra::Unit::new_normalize(axis);
        let start = axis.cross(&Vector3::new(0.3, 0.8, 0.1));
        let at = |t: &f64| nalgebra::Rotation3::from_axis_angle(&about, TAU * t / 20.0) * start;
        let path = Path::new(times.clone(), times.iter().map(at).collect()).unwrap();
        let found = path.seen_along(&axis).unwrap().oscillations(&Search::default()).unwrap();
        assert_eq!(found.sense(), Some(Handedness::Counterclockwise), "{axis:?}");
        assert!((found.oscillations[0].ellipse.major / start.norm() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn the_moving_average_takes_what_it_is_told() {
    let times: Vec<f64> = (0..10).map(f64::from).collect();
    let path = Path::new(times, (0..10).map(|k| Vector3::x() * f64::from(k * k)).collect()).unwrap();
    let mean = path.moving_average(3).unwrap();
    assert_eq!((mean.times()[0], mean.positions().len()), (1.0, 8));
    assert!((mean.positions()[0].x - 5.0 / 3.0).abs() < 1e-14);
    assert!(matches!(path.moving_average(11), Err(OrbitError::TooFew { positions: 10, needed: 11 })));
    assert!(path.moving_average(0).is_err());
}

#[test]
fn what_is_no_path() {
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
    // What does not move has no period: an answer.
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

/// ℓ = 6.45 cm, below the onset of 6.56 cm: a kick dies out as the rightmost root says, at its rate and with its period.
#[test]
fn a_kicked_shoot_below_the_onset_comes_to_rest_at_the_rate_of_its_root() {
    let kick = Pulse { peak: Vector3::new(1e-7, 0.0, 0.0), start: 0.0, duration: 12.0 * MINUTE };
    let mut shoot = reduced(0.0645, 20.0 * HOUR).elements(4).load((WEIGHT, kick)).into_dyn().build().unwrap();
    let root = Linearisation::about(&shoot.with_model(shoot.model().clone().with_load(WEIGHT).into_dyn()).unwrap());
    let root = root.unwrap().rightmost().unwrap().value;
    let (every, mut run) = (10.0 * MINUTE, MethodOfSteps::with_solver(60.0, NewtonSolver::with_tolerance(1e-12)));
    let mut seen = Vec::new();
    // The next root, at −0.96 1/h, has died out after 12 h by 1e-4 of the first.
    for k in 72..240 {
        run.advance(&mut shoot, every * f64::from(k)).unwrap();
        seen.push(shoot.tip().x);
    }
    // One damped swing obeys x(t + 2h) = a x(t + h) + b x(t): least squares for both.
    let rows = seen.len() - 2;
    let matrix = DMatrix::from_fn(rows, 2, |i, j| seen[i + 1 - j]);
    let right = DVector::from_fn(rows, |i, _| seen[i + 2]);
    let normal = matrix.transpose() * &matrix;
    let found = normal.lu().solve(&(matrix.transpose() * right)).unwrap();
    let (a, b) = (found[0], found[1]);
    let z = Complex::new(0.5 * a, (-b - 0.25 * a * a).sqrt());
    let measured = z.ln() / every;
    assert!(root.re < 0.0, "{root}");
    // Promised: 1e-3 of both. Steps of a minute leave 1e-6 of the rate of turning.
    assert!((measured.re / root.re - 1.0).abs() < 1e-3, "{measured} {root}");
    assert!((measured.im / root.im - 1.0).abs() < 1e-4, "{measured} {root}");
}
