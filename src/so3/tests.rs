//! The exponential map and the derivatives of its forms, compared with closed forms and finite
//! differences.

use approx::assert_abs_diff_eq;

use super::*;

/// Vectors without a pattern whose components lie between −`limit` and `limit`; the index of a
/// sequence distinguishes independent vectors.
fn vectors(limit: f64, sequence: u32) -> impl Iterator<Item = Vector3<f64>> {
    (1..=500).map(move |k| {
        // Multiples of irrational numbers are evenly distributed modulo 1.
        let component =
            |prime: f64| (prime.sqrt() * (f64::from(k) + 0.37 * f64::from(sequence))).fract();
        let primes = [2.0, 3.0, 5.0].map(|prime| prime + 6.0 * f64::from(sequence));
        Vector3::from(primes.map(|prime| limit * (2.0 * component(prime) - 1.0)))
    })
}

fn forms(theta: &Vector3<f64>) -> [Form; 3] {
    let s = s_functions(theta.norm_squared());
    [
        Form::exp(&s),
        Form::right_jacobian(&s),
        Form::inverse_right_jacobian(&s),
    ]
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
            assert_abs_diff_eq!(value, exact, epsilon = tolerance);
        }
    }
    assert_eq!(s_functions(0.0)[5], 1.0 / 120.0);
}

#[test]
fn log_inverts_exp_and_exp_matches_the_matrix_form() {
    for theta in vectors(1.8, 0) {
        let [e, ..] = forms(&theta);
        let q = exp(&theta);
        let difference = e.matrix(&theta) - q.to_rotation_matrix().into_inner();
        assert_abs_diff_eq!(difference.norm(), 0.0, epsilon = 1e-14);
        if theta.norm() < 3.1 {
            assert_abs_diff_eq!((log(&q) - theta).norm(), 0.0, epsilon = 1e-13);
        }
        let small = theta * 1e-9;
        assert_abs_diff_eq!((log(&exp(&small)) - small).norm(), 0.0, epsilon = 1e-24);
    }
}

#[test]
fn right_jacobian_maps_rates_to_the_darboux_vector() {
    for (theta, rate) in vectors(1.5, 0).zip(vectors(1.0, 1)) {
        let [_, jr, inverse] = forms(&theta);
        // Central difference of log(exp(θ)ᵀ exp(θ + h θ')). Its error is h² ~ 1e-10 plus rounding
        // eps/h.
        let h = 1e-5;
        let turned = |h: f64| log(&(exp(&theta).inverse() * exp(&(theta + rate * h))));
        let difference = (turned(h) - turned(-h)) / (2.0 * h);
        assert_abs_diff_eq!(
            (jr.apply(&theta, &rate) - difference).norm(),
            0.0,
            epsilon = 1e-9
        );
        let product = inverse.matrix(&theta) * jr.matrix(&theta);
        assert_abs_diff_eq!((product - Matrix3::identity()).norm(), 0.0, epsilon = 1e-12);
    }
}

#[test]
fn derivatives_of_the_forms_match_finite_differences() {
    let others = vectors(1.0, 1).zip(vectors(1.0, 2)).zip(vectors(1.0, 3));
    for (theta, ((g, y), d)) in vectors(1.5, 0).zip(others) {
        let h = 1e-5;
        let (plus, minus) = (theta + d * h, theta - d * h);
        for (k, form) in forms(&theta).into_iter().enumerate() {
            let (fp, fm) = (forms(&plus)[k], forms(&minus)[k]);
            // The error of central differences is h² times a third derivative of order one, plus
            // rounding.
            let tolerance = 1e-8;
            let value = (fp.apply(&plus, &y) - fm.apply(&minus, &y)) / (2.0 * h);
            assert_abs_diff_eq!(
                (form.jacobian(&theta, &y) * d - value).norm(),
                0.0,
                epsilon = tolerance
            );
            let slope = (g.dot(&fp.apply(&plus, &y)) - g.dot(&fm.apply(&minus, &y))) / (2.0 * h);
            assert_abs_diff_eq!(
                form.gradient(&theta, &g, &y).dot(&d),
                slope,
                epsilon = tolerance
            );
            let transposed = form.transpose();
            assert_eq!(transposed.matrix(&theta), form.matrix(&theta).transpose());
            let (product, gradient) = (
                transposed.jacobian(&theta, &g).tr_mul(&y),
                form.gradient(&theta, &g, &y),
            );
            assert_abs_diff_eq!((product - gradient).norm(), 0.0, epsilon = 1e-13);
            if k < 2 {
                let curvature =
                    (fp.gradient(&plus, &g, &y) - fm.gradient(&minus, &g, &y)) / (2.0 * h);
                assert_abs_diff_eq!(
                    (form.hessian(&theta, &g, &y) * d - curvature).norm(),
                    0.0,
                    epsilon = tolerance
                );
            }
        }
    }
}

#[test]
fn several_numbers_at_once_give_the_forms_of_each() {
    use nalgebra::SimdValue;
    use simba::simd::WideF64x4;

    let thetas: Vec<_> = vectors(1.7, 0).take(4).collect();
    let lanes = Vector3::from_fn(|i, _| WideF64x4::from([0, 1, 2, 3].map(|g: usize| thetas[g][i])));
    let s = s_functions(lanes.dot(&lanes));
    let forms_at_once = [
        Form::exp(&s),
        Form::right_jacobian(&s),
        Form::inverse_right_jacobian(&s),
    ];
    let ones = Vector3::repeat(1.0);
    for (g, theta) in thetas.iter().enumerate() {
        for (one, all) in forms(theta).iter().zip(&forms_at_once) {
            let all = [
                all.matrix(&lanes),
                all.jacobian(&lanes, &ones.map(WideF64x4::splat)),
            ];
            for (one, all) in [one.matrix(theta), one.jacobian(theta, &ones)]
                .iter()
                .zip(all)
            {
                // The longest rotation determines the number of terms of all series, which changes
                // rounding alone.
                assert_abs_diff_eq!(
                    (one - all.map(|x| x.extract(g))).norm(),
                    0.0,
                    epsilon = 1e-14
                );
            }
        }
    }
}
