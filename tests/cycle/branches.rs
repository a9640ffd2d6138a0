//! Branches of limit cycles along a parameter: from the onset on, round folds, with the places at which their stability changes.

use crate::fixtures::exact_orbit::{GROWTH_TIME, exact_orbit, shape};
use crate::fixtures::shoots::{HOUR, MINUTE, Steering, reduced, steering};
use morphorod::constitutive::LinearElastic;
use morphorod::cycle::{Branch, BranchPoint, CircularSolver, CycleError, PeriodicSolver, Special};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::load::Weight;
use morphorod::tropism::{Declaration, Perception, SettledStatoliths, Site, Source};
use morphorod::{Laws, Shoot};
use nalgebra::Complex;

/// Of the reduced model, m.
const ONSET: f64 = 0.065_614_866;

type Steered<S> = Shoot<Laws<LinearElastic, Ongoing<UniformGrowth>, Steering<S>, Weight>>;

/// Shoots of any length that steer all along, with equal elements and some sense of gravity.
fn family<S: Perception<Signal = [f64; 2]> + Copy>(
    sense: S,
    elements: u32,
) -> impl FnMut(f64) -> Result<Steered<S>, CycleError> {
    move |length| {
        let nodes: Vec<f64> = (0..=elements).map(|i| length * f64::from(i) / f64::from(elements)).collect();
        let growth = Ongoing(UniformGrowth { zone_length: 1.0, time: GROWTH_TIME });
        Ok(reduced(length, GROWTH_TIME).growth(growth).nodes(&nodes).tropism(steering(sense)).build()?)
    }
}

/// A sense of gravity that gets keener with the tilt, and again less so: oscillations begin below the onset.
#[derive(Debug, Clone, Copy)]
struct Keen;

impl Keen {
    /// By the sine of the tilt.
    fn gain(sine: f64) -> f64 {
        1.0 + 2.0 * sine * sine - 3.0 * sine.powi(4)
    }
}

impl Perception for Keen {
    type Signal = [f64; 2];

    fn declare(&self, to: &mut Declaration) -> Source {
        to.stimulus_pair()
    }

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let up = site.along_directors(&site.environment.up());
        let gain = Self::gain(up.x.hypot(up.y));
        stimuli.copy_from_slice(&[gain * up.x, gain * up.y]);
    }
}

fn all<O>(branch: impl Iterator<Item = Result<BranchPoint<O>, CycleError>>) -> Vec<BranchPoint<O>> {
    branch.map(|point| point.unwrap()).collect()
}

fn special<O>(points: &[BranchPoint<O>]) -> Vec<Special> {
    points.iter().filter_map(|point| point.special).collect()
}

#[test]
fn circles_from_the_onset_on_are_the_exact_ones() {
    let branch = Branch::from_onset(CircularSolver::default(), family(SettledStatoliths, 8), ONSET, 2e-3, 0.065..=0.07);
    let points = all(branch.unwrap());
    // The amplitude was given and the length found: that of the mode, but for a share of its square.
    assert!((points[0].excursion - 2e-3).abs() < 2e-5, "{}", points[0].excursion);
    assert_eq!(points.last().unwrap().parameter, 0.07);
    assert!(points.len() > 8 && points.len() < 30, "{}", points.len());
    for point in &points {
        let (radius, _) = exact_orbit(point.parameter);
        // Eight elements put the onset off by 1e-11 m, and the radius there by that over twice its distance.
        let off = (point.excursion / radius - 1.0).abs();
        assert!(off < 1e-9 + 1e-11 / (point.parameter - ONSET), "{}: {off:e}", point.parameter);
        assert_eq!((point.unstable(), point.special), (0, None));
        assert!(point.trivial < 1e-7, "{}", point.trivial);
        assert!(point.orbit.iterations <= 4, "{}: {}", point.parameter, point.orbit.iterations);
    }
}

#[test]
fn swings_from_the_onset_on_lead_to_the_known_ones() {
    let solver = PeriodicSolver::default();
    let branch = Branch::from_onset(solver, family(SettledStatoliths, 8), ONSET, 8e-3, 0.065..=0.067);
    let points = all(branch.unwrap().largest_step(0.1).unwrap());
    let last = points.last().unwrap();
    // Excursion (mm), period (min), exponents in the plane and out of it (1/h): as in the test of periodic orbits, where they are
    // computed by two other methods.
    assert_eq!(last.parameter, 0.067);
    assert!((1e3 * last.excursion / 34.194_086_156 - 1.0).abs() < 1e-8, "{}", 1e3 * last.excursion);
    assert!((last.period / MINUTE / 87.661_715_125 - 1.0).abs() < 1e-8, "{}", last.period / MINUTE);
    let [inside, outside] = last.exponents.each_ref().map(|set| HOUR * set[0]);
    assert!((inside - Complex::from(-0.286_710_238_0)).norm() < 1e-8, "{inside}");
    assert!((outside - Complex::from(0.105_275_641_8)).norm() < 1e-7, "{outside}");
    for point in &points {
        assert_eq!((point.unstable(), point.special), (1, None), "left out of its plane");
        // The first steps change the amplitude by a half.
        assert!(point.orbit.iterations <= 12, "{}: {}", point.parameter, point.orbit.iterations);
    }
}

/// The least length (m) at which a shape turns rigidly, and the radius there: a parabola through three angles of the apex, ever closer.
fn exact_fold() -> (f64, f64) {
    let perceived = |theta: f64| Keen::gain(theta.sin()) * theta.sin();
    let length = |apex: f64| {
        let (mut low, mut high) = (0.06, 0.07);
        let sign = shape(low, apex, perceived)[0].signum();
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if shape(middle, apex, perceived)[0].signum() == sign { low = middle } else { high = middle }
        }
        low
    };
    let (mut apex, mut width) = (0.5, 0.1);
    for _ in 0..12 {
        let [a, b, c] = [apex - width, apex, apex + width].map(length);
        let shift = (0.5 * (a - c) / (a - 2.0 * b + c)).clamp(-2.0, 2.0);
        apex += shift * width;
        // Lengths are known to 1e-15 m: closer than this their differences are rounding.
        width = if shift.abs() < 0.5 { (0.5 * width).max(3e-3) } else { width };
    }
    (length(apex), shape(length(apex), apex, perceived)[2])
}

/// Circles begin below the onset, turn back at a fold, and become stable soon after it.
#[test]
fn a_branch_of_circles_turns_at_the_exact_fold() {
    let within = 0.06..=0.066;
    let branch = Branch::from_onset(CircularSolver::default(), family(Keen, 8), ONSET, 2e-3, within.clone());
    let points = all(branch.unwrap());
    assert_eq!(special(&points), [Special::Fold, Special::Torus]);
    let at = points.iter().position(|point| point.special == Some(Special::Fold)).unwrap();
    let fold = &points[at];
    let (length, radius) = exact_fold();
    // Where the length has an extremum its error is the square of that along the branch; 8 elements leave 1e-10.
    assert!((fold.parameter / length - 1.0).abs() < 1e-9, "{} {length}", fold.parameter);
    // Of three parabolas, the last of points 4e-3 of a step of 2 mm apart.
    assert!((fold.excursion - radius).abs() < 2e-6, "{} {radius}", fold.excursion);
    // Another criterion: the exponent of the radius passes zero there. It is read at the places before and after, and a straight line is
    // put through it.
    let of_radius = |point: &BranchPoint<_>| {
        let real = point.exponents[0].iter().filter(|x| x.im == 0.0).map(|x| x.re);
        (point.excursion, real.fold(f64::NEG_INFINITY, f64::max))
    };
    let [(before, growth), (after, decay)] = [&points[at - 1], &points[at + 1]].map(of_radius);
    assert!(growth > 0.0 && decay < 0.0);
    let crossing = (before * decay - after * growth) / (decay - growth);
    assert!((crossing - fold.excursion).abs() < 0.02 * (after - before), "{crossing} {}", fold.excursion);
    assert!(points.iter().all(|point| point.parameter >= fold.parameter));
    let unstable = |range: &[BranchPoint<_>]| -> Vec<usize> {
        range.iter().filter(|point| point.special.is_none()).map(BranchPoint::unstable).collect()
    };
    assert!(unstable(&points[..at]).iter().all(|count| *count == 3));
    assert!(unstable(&points[at..]).iter().all(|count| *count == 0));

    // From the other end downwards it is passed as well, and the branch ends where the circle is a point.
    let last = points.last().unwrap();
    assert_eq!(last.parameter, *within.end());
    let start = (last.parameter, -1e-4);
    let back = Branch::from_orbit(CircularSolver::default(), family(Keen, 8), &last.orbit, start.0, start.1, within);
    let back = all(back.unwrap().largest_step(0.1).unwrap());
    assert_eq!(special(&back), [Special::Torus, Special::Fold]);
    let again = back.iter().find(|point| point.special == Some(Special::Fold)).unwrap();
    assert!((again.parameter / fold.parameter - 1.0).abs() < 1e-10, "{} {}", again.parameter, fold.parameter);
    let end = back.last().unwrap();
    assert!(end.excursion < 8e-3 && (end.parameter - ONSET).abs() < 2e-4, "{} {}", end.excursion, end.parameter);
}

/// Swings do so, too: stable out of their plane at first, where circles are unstable, and unstable from a pitchfork on.
#[test]
fn a_branch_of_swings_turns_and_is_left_at_a_pitchfork() {
    let solver = PeriodicSolver { intervals: 12, ..PeriodicSolver::default() };
    let branch = Branch::from_onset(solver, family(Keen, 4), ONSET, 8e-3, 0.06..=0.066);
    let points = all(branch.unwrap().largest_step(0.1).unwrap());
    assert_eq!(special(&points), [Special::Fold, Special::Pitchfork]);
    let at = |special| points.iter().position(|point| point.special == Some(special)).unwrap();
    let (fold, pitchfork) = (at(Special::Fold), at(Special::Pitchfork));
    assert!(points.iter().all(|point| point.parameter >= points[fold].parameter));
    for (k, point) in points.iter().enumerate().filter(|(_, point)| point.special.is_none()) {
        // In the plane one disturbance grows before the fold, out of it one after the pitchfork.
        let [inside, outside] = point.exponents.each_ref().map(|set| set[0].re > 0.0);
        assert_eq!((inside, outside), (k < fold, k > pitchfork), "{k}");
    }
    let smallest = points[fold].exponents[0].iter().map(|x| x.norm()).fold(f64::INFINITY, f64::min);
    assert!(smallest * HOUR < 1e-5, "{}", smallest * HOUR);
    // Orbits that are found on their own, a little shorter and longer: out of their plane one is stable, the other is not.
    for (beyond, unstable) in [(-2e-6, 0), (2e-6, 1)] {
        let shoot = family(Keen, 4)(points[pitchfork].parameter + beyond).unwrap();
        let orbit = solver.from_orbit(&shoot, &points[pitchfork].orbit).unwrap();
        let grow = orbit.multipliers(&shoot, 20).unwrap().into_iter().flatten();
        assert_eq!(grow.filter(|multiplier| multiplier.value.norm() > 1.0 + 1e-6).count(), unstable, "{beyond}");
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let solver = CircularSolver::default();
    let from =
        |onset, amplitude, within| Branch::from_onset(solver, family(Keen, 4), onset, amplitude, within).map(|_| ());
    let parameter =
        |answer: Result<(), CycleError>| assert!(matches!(answer, Err(CycleError::Parameter(_))), "{answer:?}");
    parameter(from(ONSET, 0.0, 0.06..=0.07));
    parameter(from(ONSET, f64::NAN, 0.06..=0.07));
    parameter(from(ONSET, 2e-3, 0.07..=0.06));
    parameter(from(ONSET, 2e-3, 0.06..=0.065));
    parameter(from(ONSET, 2e-3, 0.06..=f64::INFINITY));
    parameter(from(f64::NAN, 2e-3, 0.06..=0.07));
    // Far below the onset the mode decays: what there is of cycles is none of this amplitude.
    assert!(from(0.05, 2e-3, 0.05..=0.051).is_err());

    let shoot = family(SettledStatoliths, 4)(0.067).unwrap();
    let root = morphorod::stability::Linearisation::about(&shoot).unwrap().rightmost().unwrap();
    let orbit = solver.solve(&shoot, &morphorod::cycle::Turning::of_mode(&root, 0.03)).unwrap();
    let other = |elements, step| {
        Branch::from_orbit(solver, family(SettledStatoliths, elements), &orbit, 0.067, step, 0.066..=0.068).map(|_| ())
    };
    parameter(other(4, 0.0));
    parameter(other(4, f64::NAN));
    parameter(other(5, 1e-4));
    let mut branch =
        Branch::from_orbit(solver, family(SettledStatoliths, 4), &orbit, 0.067, 1e-4, 0.066..=0.068).unwrap();
    assert!(branch.next().unwrap().is_ok());
    assert!(branch.largest_step(0.0).is_err());

    // A family that ends within the range: the error is its own, and the branch ends with it.
    let mut inner = family(SettledStatoliths, 4);
    let ends = move |length: f64| if length < 0.0675 { inner(length) } else { Err(CycleError::Elongates) };
    let answers: Vec<_> = Branch::from_orbit(solver, ends, &orbit, 0.067, 1e-4, 0.066..=0.068).unwrap().collect();
    assert!(matches!(answers.last(), Some(Err(CycleError::Elongates))));
    assert!(answers.iter().rev().skip(1).all(Result::is_ok) && answers.len() > 2);
}

/// Ends, grids and families of many kinds: what was once wrong.
#[test]
fn a_branch_ends_where_its_range_does() {
    let solver = CircularSolver::default();
    // Below the onset there are circles: the first is outside this range.
    let outside = Branch::from_onset(solver, family(Keen, 3), ONSET, 2e-3, ONSET..=0.066);
    assert!(matches!(outside, Err(CycleError::Parameter(_))));
    // From a first circle beyond the fold it goes on, too; the chord from the onset is no tangent.
    let beyond = all(Branch::from_onset(solver, family(Keen, 3), ONSET, 3e-2, 0.06..=0.066).unwrap());
    assert_eq!(beyond.last().unwrap().parameter, 0.066);
    // A first circle too small to tell its exponents from those that vanish.
    assert!(matches!(
        Branch::from_onset(solver, family(Keen, 3), ONSET, 1e-4, 0.06..=0.066),
        Err(CycleError::Parameter(_))
    ));
    // There are shoots within the range alone: its end is reached all the same.
    let within = 0.066..=0.068;
    let inner = |length: f64| {
        if (0.066..=0.068).contains(&length) {
            family(SettledStatoliths, 3)(length)
        } else {
            Err(CycleError::Elongates)
        }
    };
    let first = family(SettledStatoliths, 3)(0.067).unwrap();
    let root = morphorod::stability::Linearisation::about(&first).unwrap().rightmost().unwrap();
    let orbit = solver.solve(&first, &morphorod::cycle::Turning::of_mode(&root, 0.03)).unwrap();
    for (step, end) in [(1e-4, 0.068), (-1e-4, 0.066)] {
        let points = all(Branch::from_orbit(solver, inner, &orbit, 0.067, step, within.clone()).unwrap());
        assert!(points.last().unwrap().parameter == end && points.len() < 30, "{}", points.len());
    }
    // An orbit on another grid, and a family whose shoots get more points, between a place and what is beside it and elsewhere.
    let swing = PeriodicSolver { intervals: 12, ..PeriodicSolver::default() }.from_mode(&first, &root, 0.03).unwrap();
    let other = PeriodicSolver { intervals: 16, stages: 5, ..PeriodicSolver::default() };
    let points = all(Branch::from_orbit(other, inner, &swing, 0.067, 1e-3, within.clone()).unwrap().take(2));
    assert!((points[0].period / swing.period - 1.0).abs() < 1e-6);
    for change in [0.067 + 1e-9, 0.0672] {
        let growing = |length: f64| family(SettledStatoliths, if length > change { 4 } else { 3 })(length);
        let last = Branch::from_orbit(swing_solver(), growing, &swing, 0.067, 1e-4, within.clone());
        let last = last.map_or_else(|error| error, |branch| branch.filter_map(Result::err).last().unwrap());
        assert!(matches!(last, CycleError::Parameter(_)), "{change}: {last:?}");
    }
}

fn swing_solver() -> PeriodicSolver {
    PeriodicSolver { intervals: 12, ..PeriodicSolver::default() }
}

/// Steps that end right at the fold, where the exponent that vanishes there is lost among those that always do.
#[test]
fn a_fold_at_the_end_of_a_step_is_one() {
    let start = |amplitude| {
        let branch = Branch::from_onset(CircularSolver::default(), family(Keen, 3), ONSET, amplitude, 0.06..=0.066);
        branch.unwrap().largest_step(0.1).unwrap()
    };
    // Once this one ended in an error.
    assert_eq!(special(&all(start(2.28e-3).take(12))), [Special::Fold, Special::Torus]);
    // The same until before the fold, then with steps that end a little before it and after.
    let points = all(start(2e-3).take(12));
    let fold = points.iter().position(|point| point.special.is_some()).unwrap();
    let [before, at] = [&points[fold - 1], &points[fold]].map(|point| point.excursion);
    let after_step = |step: f64| {
        let mut branch = start(2e-3);
        (0..fold).for_each(|_| _ = branch.next());
        branch.largest_step(step).unwrap()
    };
    let mut step = 1e-2;
    for _ in 0..3 {
        let first = after_step(step).find(|point| point.as_ref().unwrap().special.is_none()).unwrap().unwrap();
        step *= (at - before) / (first.excursion - before);
    }
    for off in [-1e-3, 1e-3] {
        let rest = all(after_step(step * (1.0 + off)).take(4));
        assert!(special(&rest).starts_with(&[Special::Fold]), "{off}: {:?}", special(&rest));
    }
}
