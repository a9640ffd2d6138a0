//! Roots that are known in closed form, followed along parameters.

use approx::{assert_abs_diff_eq, assert_relative_eq};
use nalgebra::{Vector1, Vector2};

use super::samples::{circle, is_lost, linear, with_root};
use super::*;

/// The root of a family with one parameter.
fn curve(p: f64) -> Complex<f64> {
    Complex::new(p * p - 0.5, 2.0 + p.sin())
}

/// A follower at the start of that family.
fn on_curve() -> Follower<1> {
    let linear = with_root(curve(0.0));
    let name = linear.parts().next().unwrap();
    Follower::new(
        &linear,
        Vector1::new(0.0),
        PartRoot {
            part: name,
            value: curve(0.0),
        },
    )
}

fn on_circle(p: Vector2<f64>) -> Follower<2> {
    let root = circle(p.into());
    let linear = with_root(root);
    let name = linear.parts().next().unwrap();
    Follower::new(
        &linear,
        p,
        PartRoot {
            part: name,
            value: root,
        },
    )
}

#[test]
fn a_root_is_followed_along_a_parameter_to_its_closed_form() {
    let mut follower = on_curve();
    for k in 1..=20 {
        let p = 0.05 * f64::from(k);
        let to = Vector1::new(p);
        follower
            .advance(to, follower.predict(&to), &with_root(curve(p)))
            .unwrap();
        // The root is polished to 1e-13 of itself; differences of the stimuli are of the size of
        // 1e-12.
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
    follower
        .differentiate(&mut |p| Ok(with_root(circle([p[0], p[1]]))))
        .unwrap();
    // One-sided differences err by half the step times the second derivative, and by 1e-12 of
    // rounding by the step.
    for (slope, exact) in follower
        .slope
        .iter()
        .zip([Complex::new(1.2, 0.5), Complex::new(1.0, 0.0)])
    {
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
    assert_abs_diff_eq!(
        follower.step_to_axis(&Vector2::y()),
        Vector2::new(0.0, 0.25),
        epsilon = 1e-15
    );
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
        follower.differentiate(&mut family).unwrap();
        follower.correct(&free, 1e-9, &mut family).unwrap();
        // The distance to the curve is below 1e-9 when the iteration ends. The relative error of
        // Broyden's derivatives is a tenth.
        assert_abs_diff_eq!(follower.at.norm(), 1.0, epsilon = 1e-9);
        assert_abs_diff_eq!(
            follower.frequency(),
            2.0 + 0.5 * follower.at[0],
            epsilon = 1e-9
        );
        assert!(follower.is_on_axis(1e-9));
        if free[0] == 0.0 {
            // The first parameter has moved by the differences alone.
            assert_relative_eq!(
                follower.at[0],
                0.6 + 1e-6,
                epsilon = 0.0,
                max_relative = 1e-15
            );
        }
    }
}

#[test]
fn a_root_far_from_its_expected_value_is_lost() {
    // The largest distance is a tenth of the root.
    for (jump, lost) in [(0.19, false), (0.25, true)] {
        let mut follower = on_curve();
        let before = follower;
        let expected = Complex::new(-0.5, 2.0);
        let moved = follower.advance(
            Vector1::new(0.1),
            expected,
            &with_root(expected + Complex::new(0.0, jump)),
        );
        assert_eq!((is_lost(&moved), moved.is_ok()), (lost, !lost), "{moved:?}");
        assert!(
            !lost || follower == before,
            "a failed step does not change the follower"
        );
    }
}

#[test]
fn a_root_whose_part_of_the_spectrum_disappears_is_lost() {
    // Two components are two parts if they do not couple, and one part if they do.
    let apart = linear([[-1.0, 0.0], [0.0, -2.0]], 1);
    let coupled = linear([[-1.0, 0.5], [0.5, -2.0]], 1);
    let mut follower = Follower::new(
        &apart,
        Vector1::new(0.0),
        PartRoot {
            part: SpectrumPart::Essential(1),
            value: Complex::from(-2.0),
        },
    );
    assert!(
        follower
            .advance(Vector1::new(0.1), Complex::from(-2.0), &apart)
            .is_ok()
    );
    assert!(is_lost(&follower.advance(
        Vector1::new(0.2),
        Complex::from(-2.0),
        &coupled
    )));
}

#[test]
fn a_real_root_that_merges_with_another_and_becomes_complex_is_lost() {
    // The roots are −1 ± i/5, and −1 is expected. Newton's method stays on the real axis, which has
    // no root.
    let apart = linear([[-1.0, 0.0], [0.0, -1.1]], 1);
    let mut follower = Follower::new(
        &apart,
        Vector1::new(0.0),
        PartRoot {
            part: SpectrumPart::Essential(0),
            value: Complex::from(-1.0),
        },
    );
    let moved = follower.advance(
        Vector1::new(0.1),
        follower.root,
        &with_root(Complex::new(-1.0, 0.2)),
    );
    assert!(
        matches!(moved, Err(StabilityError::NoConvergence { .. })),
        "{moved:?}"
    );
}

#[test]
fn another_mesh_has_the_same_root_and_keeps_the_derivatives() {
    let matrix = [[-0.1, -2.0], [2.0, -0.1]];
    let mut follower = Follower::on_axis(&linear(matrix, 1), Vector1::new(0.0), 2.0).unwrap();
    follower.slope[0] = Complex::new(7.0, 8.0);
    follower
        .change_mesh(follower.root, &linear(matrix, 3))
        .unwrap();
    assert_eq!(
        (follower.elements, follower.slope[0]),
        (3, Complex::new(7.0, 8.0))
    );
    assert_abs_diff_eq!(
        (follower.root - Complex::new(-0.1, 2.0)).norm(),
        0.0,
        epsilon = 1e-11
    );
    assert!(is_lost(
        &follower.change_mesh(Complex::new(-0.1, 3.0), &linear(matrix, 3))
    ));
}
