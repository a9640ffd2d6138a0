//! The exponential map and the derivatives of its forms, compared with closed forms and finite
//! differences.

use crate::fixtures::in_norm::InNorm;
use approx::abs_diff_eq;
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
fn s_functions_match_their_trigonometric_forms() {
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
            assert!(abs_diff_eq!(value, exact, epsilon = tolerance), "{angle}: {value} against {exact}");
        }
    }
    assert_eq!(s_functions(0.0)[5], 1.0 / 120.0);
}

proptest! {
    #[test]
    fn log_inverts_exp_and_exp_matches_the_matrix_form(theta in vector(1.8)) {
        let [e, ..] = forms(&theta);
        let q = exp(&theta);
        let (form, matrix) = (e.matrix(&theta), q.to_rotation_matrix().into_inner());
        prop_assert!(abs_diff_eq!(InNorm(form), InNorm(matrix), epsilon = 1e-14), "{form} against {matrix}");
        prop_assume!(theta.norm() < 3.1);
        prop_assert!(abs_diff_eq!(InNorm(log(&q)), InNorm(theta), epsilon = 1e-13), "{} against {theta}", log(&q));
        let small = theta * 1e-9;
        let found = log(&exp(&small));
        prop_assert!(abs_diff_eq!(InNorm(found), InNorm(small), epsilon = 1e-24), "{found} against {small}");
    }

    #[test]
    fn right_jacobian_maps_rates_to_the_darboux_vector(theta in vector(1.5), rate in vector(1.0)) {
        let [_, jr, inverse] = forms(&theta);
        // Central difference of log(exp(θ)ᵀ exp(θ + h θ')). Its error is h² ~ 1e-10 plus rounding
        // eps/h.
        let h = 1e-5;
        let difference = (log(&(exp(&theta).inverse() * exp(&(theta + rate * h))))
            - log(&(exp(&theta).inverse() * exp(&(theta - rate * h))))) / (2.0 * h);
        let darboux = jr.apply(&theta, &rate);
        prop_assert!(abs_diff_eq!(InNorm(darboux), InNorm(difference), epsilon = 1e-9), "{darboux} against {difference}");
        let product = inverse.matrix(&theta) * jr.matrix(&theta);
        prop_assert!(abs_diff_eq!(InNorm(product), InNorm(Matrix3::identity()), epsilon = 1e-12), "{product}");
    }

    #[test]
    fn derivatives_of_the_forms_match_finite_differences(
        theta in vector(1.5), g in vector(1.0), y in vector(1.0), d in vector(1.0),
    ) {
        let h = 1e-5;
        let (plus, minus) = (theta + d * h, theta - d * h);
        for (k, form) in forms(&theta).into_iter().enumerate() {
            let (fp, fm) = (forms(&plus)[k], forms(&minus)[k]);
            // The error of central differences is h² times a third derivative of order one, plus
            // rounding.
            let tolerance = 1e-8;
            let value = (fp.apply(&plus, &y) - fm.apply(&minus, &y)) / (2.0 * h);
            let product = form.jacobian(&theta, &y) * d;
            prop_assert!(abs_diff_eq!(InNorm(product), InNorm(value), epsilon = tolerance), "form {k}: {product} against {value}");
            let slope = (g.dot(&fp.apply(&plus, &y)) - g.dot(&fm.apply(&minus, &y))) / (2.0 * h);
            let product = form.gradient(&theta, &g, &y).dot(&d);
            prop_assert!(abs_diff_eq!(product, slope, epsilon = tolerance), "form {k}: {product} against {slope}");
            let transposed = form.transpose();
            prop_assert_eq!(transposed.matrix(&theta), form.matrix(&theta).transpose());
            let (product, gradient) = (transposed.jacobian(&theta, &g).tr_mul(&y), form.gradient(&theta, &g, &y));
            prop_assert!(abs_diff_eq!(InNorm(product), InNorm(gradient), epsilon = 1e-13), "form {k}: {product} against {gradient}");
            if k < 2 {
                let curvature = (fp.gradient(&plus, &g, &y) - fm.gradient(&minus, &g, &y)) / (2.0 * h);
                let product = form.hessian(&theta, &g, &y) * d;
                prop_assert!(
                    abs_diff_eq!(InNorm(product), InNorm(curvature), epsilon = tolerance),
                    "form {k}: {product} against {curvature}"
                );
            }
        }
    }
}
