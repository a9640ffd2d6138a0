//! Roots of families whose roots are known in closed form, followed along parameters.

use approx::{assert_abs_diff_eq, assert_relative_eq};
use nalgebra::{Vector1, Vector2, Vector3};

use super::*;
use crate::constitutive::LinearElastic;
use crate::growth::{Ongoing, UniformGrowth};
use crate::reference_element::Order;
use crate::scene::Still;
use crate::shoot::Shoot;
use crate::stability::boundary::{BoundaryPoint, BoundarySettings, boundary};
use crate::tropism::{Declaration, Growing, Site, TropismLaw};

/// A law whose growth gradient is a matrix times the strain at the same place, at once. With REGR of 1/s the roots of a
/// weightless shoot are the eigenvalues of the matrix.
struct Matrix([[f64; 2]; 2]);

impl TropismLaw for Matrix {
    fn declare(&self, to: &mut Declaration) {
        to.stimuli(2);
        to.with_present();
    }

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        stimuli.copy_from_slice(&[site.strain.x, site.strain.y]);
    }

    fn gradient(&self, _at: &Growing, _past: &[f64], now: &[f64]) -> Vector3<f64> {
        let [first, second] = self.0.map(|row| row[0] * now[0] + row[1] * now[1]);
        Vector3::new(first, second, 0.0)
    }
}

fn linear(matrix: [[f64; 2]; 2], elements: usize) -> Linearisation {
    let shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
        .length(0.1)
        .radius(1e-3)
        .elements(elements)
        .order(Order::Four)
        .growth(Ongoing(UniformGrowth { zone_length: 0.2, time: 1.0 }))
        .tropism(Matrix(matrix))
        .scene(Still::weightless())
        .build()
        .unwrap();
    Linearisation::about(&shoot).unwrap()
}

/// A linear problem with the roots `root` and its conjugate.
fn with_root(root: Complex<f64>) -> Linearisation {
    linear([[root.re, -root.im], [root.im, root.re]], 1)
}

/// The root of a family with one parameter.
fn curve(p: f64) -> Complex<f64> {
    Complex::new(p * p - 0.5, 2.0 + p.sin())
}

/// A follower at the start of that family.
fn on_curve() -> Follower<1> {
    let linear = with_root(curve(0.0));
    let name = linear.spectrum.names().next().unwrap();
    Follower::new(&linear, Vector1::new(0.0), (name, curve(0.0)))
}

/// The root of a family with two parameters, on the axis along the circle |p| = 1, and there at the frequency 2 + p1/2.
fn circle(p: [f64; 2]) -> Complex<f64> {
    Complex::new(p[0] * p[0] + p[1] * p[1] - 1.0, 2.0 + 0.5 * p[0])
}

fn on_circle(p: Vector2<f64>) -> Follower<2> {
    let root = circle(p.into());
    let linear = with_root(root);
    let name = linear.spectrum.names().next().unwrap();
    Follower::new(&linear, p, (name, root))
}

fn is_lost<T>(answer: &Result<T, StabilityError>) -> bool {
    matches!(answer, Err(StabilityError::NoConvergence { what: "root that is followed", .. }))
}

#[test]
fn a_root_is_followed_along_a_parameter_to_its_closed_form() {
    let mut follower = on_curve();
    for k in 1..=20 {
        let p = 0.05 * f64::from(k);
        let to = Vector1::new(p);
        follower.advance(to, follower.predict(&to), &with_root(curve(p))).unwrap();
        // The root is polished to 1e-13 of itself; differences of the stimuli are of the size of 1e-12.
        assert_abs_diff_eq!((follower.root - curve(p)).norm(), 0.0, epsilon = 1e-11);
        // One parameter: the derivative is the secant over the last step.
        let secant = (curve(p) - curve(p - 0.05)) / 0.05;
        assert_abs_diff_eq!((follower.slope[0] - secant).norm(), 0.0, epsilon = 1e-9);
        assert_eq!(follower.at, to);
    }
}

#[test]
fn derivatives_by_differences_agree_with_the_closed_form() {
    let mut follower = on_circle(Vector2::new(0.6, 0.5));
    follower.differentiate(1e-6, &mut |p| Ok(with_root(circle([p[0], p[1]])))).unwrap();
    // One-sided differences err by half the step times the second derivative, and by 1e-12 of rounding by the step.
    for (slope, exact) in follower.slope.iter().zip([Complex::new(1.2, 0.5), Complex::new(1.0, 0.0)]) {
        assert_abs_diff_eq!((slope - exact).norm(), 0.0, epsilon = 5e-6);
    }
}

#[test]
fn the_step_to_the_axis_is_the_shortest_one_and_exact_for_a_linear_family() {
    let mut follower = on_circle(Vector2::new(0.6, 0.5));
    follower.root = Complex::new(-1.0, 2.0);
    follower.slope = Vector2::new(Complex::new(3.0, 1.0), Complex::new(4.0, -1.0));
    let step = follower.step_to_axis(&Vector2::repeat(1.0));
    // Along the gradient (3, 4), whose square is 25.
    assert_abs_diff_eq!(step, Vector2::new(0.12, 0.16), epsilon = 1e-15);
    assert_abs_diff_eq!(follower.step_to_axis(&Vector2::y()), Vector2::new(0.0, 0.25), epsilon = 1e-15);
    follower.end_on_axis(&step);
    assert_abs_diff_eq!(follower.at, Vector2::new(0.72, 0.66), epsilon = 1e-15);
    assert_eq!(follower.root.re, 0.0);
    assert_abs_diff_eq!(follower.root.im, 2.0 + 0.12 - 0.16, epsilon = 1e-15);
}

#[test]
fn correction_leads_to_the_closed_form_of_the_boundary() {
    let mut family = |p: &Vector2<f64>| Ok(with_root(circle([p[0], p[1]])));
    for free in [Vector2::repeat(1.0), Vector2::y()] {
        let mut follower = on_circle(Vector2::new(0.6, 0.75));
        follower.differentiate(1e-6, &mut family).unwrap();
        follower.correct(&free, 1e-9, &mut family).unwrap();
        // The distance to the curve is below 1e-9 when the iteration ends, and Broyden's derivatives are good to a tenth.
        assert_abs_diff_eq!(follower.at.norm(), 1.0, epsilon = 1e-9);
        assert_abs_diff_eq!(follower.frequency(), 2.0 + 0.5 * follower.at[0], epsilon = 1e-9);
        assert!(follower.is_on_axis(1e-9));
        if free[0] == 0.0 {
            // The first parameter has moved by the differences alone.
            assert_relative_eq!(follower.at[0], 0.6 + 1e-6, epsilon = 0.0, max_relative = 1e-15);
        }
    }
}

#[test]
fn a_root_far_from_where_it_is_expected_is_lost() {
    // A root may lie a tenth of itself from there.
    for (jump, lost) in [(0.19, false), (0.25, true)] {
        let mut follower = on_curve();
        let before = follower;
        let expected = Complex::new(-0.5, 2.0);
        let moved = follower.advance(Vector1::new(0.1), expected, &with_root(expected + Complex::new(0.0, jump)));
        assert_eq!((is_lost(&moved), moved.is_ok()), (lost, !lost), "{moved:?}");
        assert!(!lost || follower == before, "a follower that has lost its root stays where it was");
    }
}

#[test]
fn a_root_whose_part_of_the_spectrum_disappears_is_lost() {
    // Two components that do not couple make two parts, and one part as soon as they do.
    let apart = linear([[-1.0, 0.0], [0.0, -2.0]], 1);
    let coupled = linear([[-1.0, 0.5], [0.5, -2.0]], 1);
    let mut follower = Follower::new(&apart, Vector1::new(0.0), (Part::Essential(1), Complex::from(-2.0)));
    assert!(follower.advance(Vector1::new(0.1), Complex::from(-2.0), &apart).is_ok());
    assert!(is_lost(&follower.advance(Vector1::new(0.2), Complex::from(-2.0), &coupled)));
}

#[test]
fn a_real_root_that_has_met_another_one_and_left_the_axis_is_lost() {
    // The roots are −1 ± i/5 where −1 is expected. Newton's method stays on the real axis, where there is no root.
    let apart = linear([[-1.0, 0.0], [0.0, -1.1]], 1);
    let mut follower = Follower::new(&apart, Vector1::new(0.0), (Part::Essential(0), Complex::from(-1.0)));
    let moved = follower.advance(Vector1::new(0.1), follower.root, &with_root(Complex::new(-1.0, 0.2)));
    assert!(matches!(moved, Err(StabilityError::NoConvergence { .. })), "{moved:?}");
}

#[test]
fn another_mesh_has_the_same_root_and_keeps_the_derivatives() {
    let matrix = [[-0.1, -2.0], [2.0, -0.1]];
    let mut follower = Follower::on_axis(&linear(matrix, 1), Vector1::new(0.0), 2.0).unwrap();
    follower.slope[0] = Complex::new(7.0, 8.0);
    follower.change_mesh(follower.root, &linear(matrix, 3)).unwrap();
    assert_eq!((follower.elements, follower.slope[0]), (3, Complex::new(7.0, 8.0)));
    assert_abs_diff_eq!((follower.root - Complex::new(-0.1, 2.0)).norm(), 0.0, epsilon = 1e-11);
    assert!(is_lost(&follower.change_mesh(Complex::new(-0.1, 3.0), &linear(matrix, 3))));
}

/// Parameters in [−2, 2]², from (1, 0) upwards.
fn settings(step: f64) -> BoundarySettings {
    BoundarySettings {
        start: BoundaryPoint { parameters: [1.0, 0.0], frequency: 2.5 },
        direction: [0.0, 1.0],
        low: [-2.0; 2],
        high: [2.0; 2],
        step,
        points: 400,
    }
}

/// Distances of neighbouring points, in fractions of the rectangle's sides.
fn distances(points: &[BoundaryPoint]) -> Vec<f64> {
    let place = |point: &BoundaryPoint| Vector2::from(point.parameters) / 4.0;
    points.windows(2).map(|pair| (place(&pair[1]) - place(&pair[0])).norm()).collect()
}

#[test]
fn a_boundary_is_followed_along_a_circle_back_to_its_start() {
    let points = boundary(|p, q| Ok(with_root(circle([p, q]))), &settings(0.05)).unwrap();
    for point in &points {
        let [p, q] = point.parameters;
        // Points are corrected to 1e-9 of a side of four.
        assert_abs_diff_eq!(p.hypot(q), 1.0, epsilon = 4e-9);
        assert_abs_diff_eq!(point.frequency, 2.0 + 0.5 * p, epsilon = 4e-9);
    }
    // The circumference is π/2 in units of the sides: 32 steps of 0.05 pass the start.
    assert!((32..=34).contains(&points.len()), "{}", points.len());
    let (first, last) = (&points[0].parameters, &points[points.len() - 1].parameters);
    assert!((Vector2::from(*last) - Vector2::from(*first)).norm() < 0.2, "{last:?}");
    assert!(distances(&points).iter().all(|distance| (0.04..0.06).contains(distance)));
}

#[test]
fn the_step_along_a_boundary_is_halved_where_it_turns_quickly() {
    // An ellipse with semi-axes of 1/4 and 1/16 of the sides: its radius of curvature is 1/64 at the sharp ends.
    let ellipse = |p: f64, q: f64| Complex::new(p * p + 16.0 * q * q - 1.0, 2.0 + 0.5 * p);
    let points = boundary(|p, q| Ok(with_root(ellipse(p, q))), &settings(0.03)).unwrap();
    for pair in points.windows(2) {
        let [p, q] = pair[1].parameters;
        // Points are corrected to 1e-9 of a side of four, and the gradient is at most 8.
        assert_abs_diff_eq!(p * p + 16.0 * q * q, 1.0, epsilon = 32e-9);
        // It never turns back.
        let [before, after] = [pair[0], pair[1]].map(|point| (4.0 * point.parameters[1]).atan2(point.parameters[0]));
        assert!((after - before).rem_euclid(std::f64::consts::TAU) < 0.7, "{pair:?}");
    }
    let distances = distances(&points);
    let at_end = |k: &usize| points[*k].parameters[0] < -0.95;
    let shortest = (0..distances.len()).filter(at_end).map(|k| distances[k]).fold(f64::INFINITY, f64::min);
    let longest = distances.iter().copied().fold(0.0, f64::max);
    assert!(shortest < 0.016 && longest > 0.029, "{shortest} {longest}");
    assert!(points.iter().any(|point| point.parameters[1] < -0.24), "it goes around");
}

#[test]
fn a_boundary_on_which_the_root_disappears_is_an_error_and_buckling_its_end() {
    // Beyond p = 1/2 the root has twice its frequency.
    let jump = |p: f64, q: f64| {
        let root = circle([p, q]);
        with_root(if p < 0.5 { Complex::new(root.re, 2.0 * root.im) } else { root })
    };
    assert!(is_lost(&boundary(|p, q| Ok(jump(p, q)), &settings(0.05))));
    let buckles = |p: f64, q: f64| {
        let buckled = StabilityError::MechanicallyUnstable { negative: 1 };
        if p < 0.5 { Err(buckled) } else { Ok(with_root(circle([p, q]))) }
    };
    let points = boundary(buckles, &settings(0.05)).unwrap();
    let last = points[points.len() - 1].parameters[0];
    assert!((0.5..0.7).contains(&last), "the last point lies before the end: {last}");
}

#[test]
fn a_boundary_ends_exactly_on_the_side_of_the_rectangle() {
    let low = [0.3, -2.0];
    let points = boundary(|p, q| Ok(with_root(circle([p, q]))), &BoundarySettings { low, ..settings(0.05) }).unwrap();
    let [p, q] = points[points.len() - 1].parameters;
    assert_eq!(p, 0.3);
    assert_abs_diff_eq!(q, (1.0 - 0.09_f64).sqrt(), epsilon = 4e-9);
}
