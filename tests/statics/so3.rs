//! The exponential map and the derivatives of its forms, against closed forms and differences.

use morphorod::so3::{Form, exp, log, s_functions};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

fn vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-limit..limit).prop_map(Vector3::from)
}

fn forms(theta: &Vector3<f64>) -> [Form; 3] {
    let s = s_functions(theta.norm_squared());
    [Form::exp(&s), Form::right_jacobian(&s), Form::inverse_right_jacobian(&s)]
}

#[test]
fn the_s_functions_are_the_trigonometric_ones() {
    for angle in [1e-3_f64, 0.1, 1.0, 2.0, 3.1] {
        let s = s_functions(angle * angle);
        let (sin, cos) = angle.sin_cos();
        // The quotients on the right lose digits by cancellation: eps/angle³ for S3.
        let tolerance = 8.0 * f64::EPSILON * (1.0 + angle.powi(-3));
        for (value, exact) in [
            (s[0], cos),
            (s[1], sin / angle),
            (s[2], (1.0 - cos) / angle.powi(2)),
            (s[3], (angle - sin) / angle.powi(3)),
        ] {
            assert!((value - exact).abs() < tolerance, "{angle}: {value} against {exact}");
        }
    }
    assert_eq!(s_functions(0.0)[5], 1.0 / 120.0);
}

proptest! {
    #[test]
    fn exp_and_log_are_inverse_and_agree_with_the_matrix_form(theta in vector(1.8)) {
        let [e, ..] = forms(&theta);
        let q = exp(&theta);
        prop_assert!((e.matrix(&theta) - q.to_rotation_matrix().matrix()).norm() < 1e-14);
        prop_assume!(theta.norm() < 3.1);
        prop_assert!((log(&q) - theta).norm() < 1e-13);
        prop_assert!((log(&exp(&(theta * 1e-9))) - theta * 1e-9).norm() < 1e-24);
    }

    #[test]
    fn the_right_jacobian_turns_rates_into_the_darboux_vector(theta in vector(1.5), rate in vector(1.0)) {
        let [_, jr, inverse] = forms(&theta);
        // Central difference of log(exp(θ)ᵀ exp(θ + h θ')): error h² ~ 1e-10 plus rounding eps/h.
        let h = 1e-5;
        let difference = (log(&(exp(&theta).inverse() * exp(&(theta + rate * h))))
            - log(&(exp(&theta).inverse() * exp(&(theta - rate * h))))) / (2.0 * h);
        prop_assert!((jr.apply(&theta, &rate) - difference).norm() < 1e-9);
        prop_assert!((inverse.matrix(&theta) * jr.matrix(&theta) - Matrix3::identity()).norm() < 1e-12);
    }

    #[test]
    fn the_derivatives_of_the_forms_agree_with_differences(
        theta in vector(1.5), g in vector(1.0), y in vector(1.0), d in vector(1.0),
    ) {
        let h = 1e-5;
        let (plus, minus) = (theta + d * h, theta - d * h);
        for (k, form) in forms(&theta).into_iter().enumerate() {
            let (fp, fm) = (forms(&plus)[k], forms(&minus)[k]);
            // Central differences: error h² times a third derivative of order one, plus rounding.
            let tolerance = 1e-8;
            let value = (fp.apply(&plus, &y) - fm.apply(&minus, &y)) / (2.0 * h);
            prop_assert!((form.jacobian(&theta, &y) * d - value).norm() < tolerance);
            let slope = (g.dot(&fp.apply(&plus, &y)) - g.dot(&fm.apply(&minus, &y))) / (2.0 * h);
            prop_assert!((form.gradient(&theta, &g, &y).dot(&d) - slope).abs() < tolerance);
            let transposed = form.transpose();
            prop_assert!((transposed.matrix(&theta) - form.matrix(&theta).transpose()).norm() == 0.0);
            prop_assert!((transposed.jacobian(&theta, &g).tr_mul(&y) - form.gradient(&theta, &g, &y)).norm() < 1e-13);
            if k < 2 {
                let curvature = (fp.gradient(&plus, &g, &y) - fm.gradient(&minus, &g, &y)) / (2.0 * h);
                prop_assert!((form.hessian(&theta, &g, &y) * d - curvature).norm() < tolerance);
            }
        }
    }
}
