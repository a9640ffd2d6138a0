//! Branches of periodic orbits along a parameter: branches that start at the onset of oscillations,
//! branches with folds, and the bifurcations at which the stability changes.

use std::sync::LazyLock;

use super::{assert_complex_eq, family, mode, planes, shoot};
use crate::fixtures::exact_orbit::{exact_orbit, shape};
use crate::fixtures::shoots::{HOUR, MINUTE, steering};
use approx::{assert_abs_diff_eq, assert_relative_eq, relative_eq};
use morphorod::cycle::{
    Bifurcation, BranchPoint, Continuation, CycleError, PeriodicSolver, RotatingWave,
    RotatingWaveSolver,
};
use morphorod::stability::{Crossing, Linearisation, onset};
use morphorod::tropism::{Declaration, Perception, SettledStatoliths, Site, Source};
use morphorod::{DynLaws, Shoot};
use nalgebra::Complex;

/// Length at the onset of oscillations of the reduced model, m.
pub(super) const ONSET: f64 = 0.065_614_866;

/// Crossing of the axis at this onset. Both perceptions of these tests have the same gain for small
/// tilts.
pub(super) static CROSSING: LazyLock<Crossing<1>> = LazyLock::new(|| {
    let mut shoots = sensing(SettledStatoliths, 6);
    onset(
        |length| Linearisation::about(&shoots(length).unwrap()),
        0.06,
        0.07,
    )
    .unwrap()
});

/// Reduced model with a given perception of gravity and equal elements, as a family over the length
/// (m).
pub(super) fn sensing(
    sense: impl Perception<Signal = [f64; 2]> + Copy + Send + Sync + 'static,
    elements: u32,
) -> impl FnMut(f64) -> Result<Shoot<DynLaws>, CycleError> + Clone {
    family(move |length| {
        Ok(shoot(length, elements)
            .tropism(steering(sense))
            .into_dyn()
            .build()?)
    })
}

/// Perception of gravity whose gain first increases and then decreases with the tilt. Orbits exist
/// below the onset.
#[derive(Debug, Clone, Copy)]
pub(super) struct Keen;

impl Keen {
    /// Gain as a function of the sine of the tilt.
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

fn special<O>(points: &[BranchPoint<O>]) -> Vec<Bifurcation> {
    points
        .iter()
        .filter_map(|point| point.bifurcation)
        .collect()
}

pub(super) fn swing_solver() -> PeriodicSolver {
    PeriodicSolver {
        intervals: 12,
        ..PeriodicSolver::default()
    }
}

/// Shoot of the reduced model at 6.7 cm and its circular orbit.
pub(super) fn circle(elements: u32) -> (Shoot<DynLaws>, RotatingWave) {
    let shoot = sensing(SettledStatoliths, elements)(0.067).unwrap();
    let orbit = RotatingWaveSolver::default()
        .from_mode(&shoot, &mode(&shoot), 0.03)
        .unwrap();
    (shoot, orbit)
}

/// Tests the amplitude of the first circle, the end of the range and the accuracy of all circles
/// between them.
#[test]
fn branch_of_circles_from_the_onset_matches_the_exact_circles() {
    let end = 0.07;
    let branch = Continuation::from_onset(
        RotatingWaveSolver::default(),
        sensing(SettledStatoliths, 6),
        &CROSSING,
        2e-3,
        0.065..=end,
    );
    let points = all(branch.unwrap().largest_step(0.1).unwrap());
    // The amplitude is prescribed and the length is an unknown. The excursion equals that of the
    // mode up to a relative error of second order.
    assert_abs_diff_eq!(points[0].excursion, 2e-3, epsilon = 2e-5);
    assert_eq!(points.last().unwrap().parameter, end);
    assert!(points.len() > 8 && points.len() < 30, "{}", points.len());
    for point in &points {
        let (radius, _) = exact_orbit(point.parameter);
        // Six elements shift the onset by less than 1e-11 m. The relative error of the radius is
        // this shift divided by twice the distance from the onset.
        let tolerance = 1e-9 + 1e-11 / (point.parameter - ONSET);
        assert!(
            relative_eq!(
                point.excursion,
                radius,
                epsilon = 0.0,
                max_relative = tolerance
            ),
            "{}: {} against {radius}",
            point.parameter,
            point.excursion
        );
        assert_eq!((point.unstable(), point.bifurcation), (0, None));
        assert!(point.trivial < 1e-7, "{}", point.trivial);
        assert!(
            point.orbit.iterations <= 4,
            "{}: {}",
            point.parameter,
            point.orbit.iterations
        );
    }
}

/// Tests a branch of swings from a first swing of prescribed amplitude to the end of the range, and
/// the exponents of its last orbit.
#[test]
fn branch_of_swings_from_the_onset_leads_to_the_known_swing() {
    let solver = PeriodicSolver::default();
    let branch = Continuation::from_onset(
        solver,
        sensing(SettledStatoliths, 6),
        &CROSSING,
        8e-3,
        0.065..=0.067,
    );
    let points = all(branch.unwrap().largest_step(0.15).unwrap());
    let last = points.last().unwrap();
    // Reference values of excursion (mm), period (min) and exponents in the plane and out of it
    // (1/h). They are those of `cycles`, computed by two other methods.
    assert_eq!(last.parameter, 0.067);
    assert_relative_eq!(
        1e3 * last.excursion,
        34.194_086_156,
        epsilon = 0.0,
        max_relative = 1e-8
    );
    assert_relative_eq!(
        last.period / MINUTE,
        87.661_715_125,
        epsilon = 0.0,
        max_relative = 1e-8
    );
    let [inside, outside] = planes(&last.exponents).map(|set| HOUR * set[0]);
    assert_complex_eq(
        "in the plane",
        inside,
        Complex::from(-0.286_710_238_0),
        1e-8,
    );
    assert_complex_eq(
        "out of the plane",
        outside,
        Complex::from(0.105_275_641_8),
        1e-7,
    );
    for point in &points {
        assert_eq!(
            (point.unstable(), point.bifurcation),
            (1, None),
            "swings are unstable out of their plane"
        );
        // The first steps change the amplitude by 50 %.
        assert!(
            point.orbit.iterations <= 12,
            "{}: {}",
            point.parameter,
            point.orbit.iterations
        );
    }
}

/// Smallest length (m) at which a circular orbit exists, and the radius (m) of this orbit.
/// Successive parabolas locate the minimum of the length over the angle of the apex.
fn exact_fold() -> (f64, f64) {
    let perceived = |theta: f64| Keen::gain(theta.sin()) * theta.sin();
    let length = |apex: f64| {
        let (mut low, mut high) = (0.06, 0.07);
        let sign = shape(low, apex, perceived)[0].signum();
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if shape(middle, apex, perceived)[0].signum() == sign {
                low = middle
            } else {
                high = middle
            }
        }
        low
    };
    let (mut apex, mut width) = (0.5, 0.1);
    for _ in 0..12 {
        let [a, b, c] = [apex - width, apex, apex + width].map(length);
        let shift = (0.5 * (a - c) / (a - 2.0 * b + c)).clamp(-2.0, 2.0);
        apex += shift * width;
        // Lengths are accurate to 1e-15 m. At smaller widths their differences are dominated by
        // rounding errors.
        width = if shift.abs() < 0.5 {
            (0.5 * width).max(3e-3)
        } else {
            width
        };
    }
    (length(apex), shape(length(apex), apex, perceived)[2])
}

/// Circles with this perception begin below the onset. The branch has a fold, beyond which the
/// circles soon become stable. Tests the location of the fold and the stability on both sides of
/// it. The first circle has half the radius of the circle at the fold, and the range ends just
/// above the onset.
#[test]
fn branch_of_circles_turns_at_the_exact_fold() {
    let within = 0.06..=0.0657;
    let branch = Continuation::from_onset(
        RotatingWaveSolver::default(),
        sensing(Keen, 5),
        &CROSSING,
        1e-2,
        within.clone(),
    );
    let points = all(branch.unwrap().largest_step(0.1).unwrap());
    assert_eq!(special(&points), [Bifurcation::Fold, Bifurcation::Torus]);
    let at = points
        .iter()
        .position(|point| point.bifurcation == Some(Bifurcation::Fold))
        .unwrap();
    let fold = &points[at];
    let (length, radius) = exact_fold();
    // The length is minimal at the fold. Its error is of second order in the error along the
    // branch. The error due to five elements is 2e-10.
    assert_relative_eq!(fold.parameter, length, epsilon = 0.0, max_relative = 1e-9);
    // The fold is located by three successive parabolas. The points of the last one are 4e-3 of a
    // step of 3 mm apart.
    assert_abs_diff_eq!(fold.excursion, radius, epsilon = 2e-6);
    // As an independent criterion, the exponent of the radius vanishes at the fold. The zero is
    // interpolated linearly between the points before and after the fold.
    let of_radius = |point: &BranchPoint<_>| {
        let real = point.exponents.iter().filter(|x| x.im == 0.0).map(|x| x.re);
        (point.excursion, real.fold(f64::NEG_INFINITY, f64::max))
    };
    let [(before, growth), (after, decay)] = [&points[at - 1], &points[at + 1]].map(of_radius);
    assert!(growth > 0.0 && decay < 0.0);
    let crossing = (before * decay - after * growth) / (decay - growth);
    assert_abs_diff_eq!(crossing, fold.excursion, epsilon = 0.02 * (after - before));
    assert!(points.iter().all(|point| point.parameter >= fold.parameter));
    let unstable = |range: &[BranchPoint<_>]| -> Vec<usize> {
        range
            .iter()
            .filter(|point| point.bifurcation.is_none())
            .map(BranchPoint::unstable)
            .collect()
    };
    assert!(unstable(&points[..at]).iter().all(|count| *count == 3));
    assert!(unstable(&points[at..]).iter().all(|count| *count == 0));
    assert_eq!(points.last().unwrap().parameter, *within.end());
}

/// Continuation of the same branch in the opposite direction. The bifurcations occur in reverse
/// order, and the branch ends near the onset, where the radius vanishes. Tests a first point at an
/// end of the range, steps of either sign, and the end at the onset. Three elements suffice, since
/// both folds are computed on the same mesh.
#[test]
fn branch_of_circles_followed_backwards_passes_the_same_fold() {
    let within = 0.06..=0.066;
    let branch = Continuation::from_onset(
        RotatingWaveSolver::default(),
        sensing(Keen, 3),
        &CROSSING,
        1e-2,
        within.clone(),
    );
    let points = all(branch.unwrap().largest_step(0.1).unwrap());
    let fold = points
        .iter()
        .find(|point| point.bifurcation == Some(Bifurcation::Fold))
        .unwrap();
    let last = points.last().unwrap();
    assert_eq!(last.parameter, *within.end());
    let start = (last.parameter, -1e-4);
    let back = Continuation::from_orbit(
        RotatingWaveSolver::default(),
        sensing(Keen, 3),
        &last.orbit,
        start.0,
        start.1,
        within,
    );
    let back = all(back.unwrap().largest_step(0.1).unwrap());
    assert_eq!(special(&back), [Bifurcation::Torus, Bifurcation::Fold]);
    let again = back
        .iter()
        .find(|point| point.bifurcation == Some(Bifurcation::Fold))
        .unwrap();
    assert_relative_eq!(
        again.parameter,
        fold.parameter,
        epsilon = 0.0,
        max_relative = 1e-10
    );
    let end = back.last().unwrap();
    assert!(end.excursion < 8e-3, "{}", end.excursion);
    assert_abs_diff_eq!(end.parameter, ONSET, epsilon = 2e-4);
}

/// The branch of swings also has a fold. Its first swings are stable to disturbances out of their
/// plane, unlike circles. They are unstable beyond a pitchfork. Tests both bifurcations by
/// comparison with orbits that are computed without continuation. Two elements suffice, since all
/// orbits are computed on the same mesh.
#[test]
fn branch_of_swings_has_a_fold_and_loses_its_plane_at_a_pitchfork() {
    let solver = swing_solver();
    let branch =
        Continuation::from_onset(solver, sensing(Keen, 2), &CROSSING, 1.2e-2, 0.06..=0.0657);
    let points = all(branch.unwrap().largest_step(0.1).unwrap());
    assert_eq!(
        special(&points),
        [Bifurcation::Fold, Bifurcation::Pitchfork]
    );
    let at = |special| {
        points
            .iter()
            .position(|point| point.bifurcation == Some(special))
            .unwrap()
    };
    let (fold, pitchfork) = (at(Bifurcation::Fold), at(Bifurcation::Pitchfork));
    assert!(
        points
            .iter()
            .all(|point| point.parameter >= points[fold].parameter)
    );
    for (k, point) in points
        .iter()
        .enumerate()
        .filter(|(_, point)| point.bifurcation.is_none())
    {
        // One disturbance in the plane grows before the fold, one out of the plane after the
        // pitchfork.
        let [inside, outside] = planes(&point.exponents).map(|set| set[0].re > 0.0);
        assert_eq!((inside, outside), (k < fold, k > pitchfork), "{k}");
    }
    let smallest = planes(&points[fold].exponents)[0]
        .iter()
        .map(|x| x.norm())
        .fold(f64::INFINITY, f64::min);
    assert!(smallest * HOUR < 1e-5, "{}", smallest * HOUR);
    // Orbits of slightly shorter and longer shoots, computed without continuation. The first is
    // stable to disturbances out of its plane, the second is not.
    for (beyond, unstable) in [(-2e-6, 0), (2e-6, 1)] {
        let shoot = sensing(Keen, 2)(points[pitchfork].parameter + beyond).unwrap();
        let orbit = solver.from_orbit(&shoot, &points[pitchfork].orbit).unwrap();
        let found = orbit.multipliers(&shoot, 1).unwrap();
        assert_eq!(
            found
                .values
                .iter()
                .filter(|multiplier| multiplier.value.norm() > 1.0 + 1e-6)
                .count(),
            unstable,
            "{beyond}"
        );
    }
}

/// First circle beyond the fold, where the chord from the onset does not approximate the tangent.
#[test]
fn branch_with_a_first_circle_beyond_the_fold_reaches_the_end_of_its_range() {
    let branch = Continuation::from_onset(
        RotatingWaveSolver::default(),
        sensing(Keen, 3),
        &CROSSING,
        3e-2,
        0.06..=0.066,
    );
    assert_eq!(all(branch.unwrap()).last().unwrap().parameter, 0.066);
}

/// Family of the shoots of 6.6 to 6.8 cm. It returns an error for other lengths.
fn only_within_the_range(
    elements: u32,
) -> impl FnMut(f64) -> Result<Shoot<DynLaws>, CycleError> + Clone {
    family(move |length| {
        if (0.066..=0.068).contains(&length) {
            sensing(SettledStatoliths, elements)(length)
        } else {
            Err(CycleError::Elongates)
        }
    })
}

/// The family has no shoots outside the range, and the branch ends exactly at the end of the range.
#[test]
fn branch_reaches_both_ends_of_its_range_exactly() {
    let (_, orbit) = circle(3);
    for (step, end) in [(1e-4, 0.068), (-1e-4, 0.066)] {
        let family = only_within_the_range(3);
        let branch = Continuation::from_orbit(
            RotatingWaveSolver::default(),
            family,
            &orbit,
            0.067,
            step,
            0.066..=0.068,
        );
        let points = all(branch.unwrap());
        assert_eq!(points.last().unwrap().parameter, end);
        assert!(points.len() < 30, "{}", points.len());
    }
}

#[test]
fn branch_starts_from_an_orbit_on_another_time_grid() {
    let first = sensing(SettledStatoliths, 3)(0.067).unwrap();
    let swing = swing_solver()
        .from_mode(&first, &mode(&first), 0.03)
        .unwrap();
    let other = PeriodicSolver {
        intervals: 16,
        stages: 5,
        ..PeriodicSolver::default()
    };
    let branch = Continuation::from_orbit(
        other,
        only_within_the_range(3),
        &swing,
        0.067,
        1e-3,
        0.066..=0.068,
    );
    let points = all(branch.unwrap().take(2));
    assert_relative_eq!(
        points[0].period,
        swing.period,
        epsilon = 0.0,
        max_relative = 1e-6
    );
}

/// Branch of circles with a fold, from a given first amplitude (m).
fn folding(
    amplitude: f64,
) -> Continuation<RotatingWaveSolver, impl FnMut(f64) -> Result<Shoot<DynLaws>, CycleError> + Clone>
{
    let branch = Continuation::from_onset(
        RotatingWaveSolver::default(),
        sensing(Keen, 3),
        &CROSSING,
        amplitude,
        0.06..=0.066,
    );
    branch.unwrap().largest_step(0.1).unwrap()
}

/// With this first amplitude a step ends close to the fold. An earlier version returned an error
/// there.
#[test]
fn branch_with_a_step_close_to_the_fold_passes_it() {
    assert_eq!(
        special(&all(folding(2.28e-3).take(12))),
        [Bifurcation::Fold, Bifurcation::Torus]
    );
}

/// Steps that end at the fold. The exponent that vanishes at the fold cannot be distinguished there
/// from the trivial exponents.
#[test]
fn fold_at_the_end_of_a_step_is_found() {
    // State of the branch before the step that passes the fold, and the excursions before this step
    // and at the fold.
    let (mut branch, mut last) = (folding(2e-3), f64::NAN);
    let (before, at) = loop {
        let before = branch.clone();
        let point = branch.next().unwrap().unwrap();
        if point.bifurcation.is_some() {
            break (before, point.excursion);
        }
        last = point.excursion;
    };
    // Continuation from this state with steps that end slightly before and slightly after the fold.
    let after_step = |step: f64| before.clone().largest_step(step).unwrap();
    let mut step = 1e-2;
    for _ in 0..3 {
        let first = after_step(step)
            .find(|point| point.as_ref().unwrap().bifurcation.is_none())
            .unwrap()
            .unwrap();
        step *= (at - last) / (first.excursion - last);
    }
    for off in [-1e-3, 1e-3] {
        let rest = all(after_step(step * (1.0 + off)).take(4));
        assert!(
            special(&rest).starts_with(&[Bifurcation::Fold]),
            "{off}: {:?}",
            special(&rest)
        );
    }
}
