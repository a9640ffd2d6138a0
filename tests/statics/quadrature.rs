//! Gauss and Lobatto rules and the polynomials through their nodes, compared with closed forms and
//! printed tables.

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_abs_diff_ne};
use morphorod::quadrature::{gauss, lagrange, lagrange_derivatives, lobatto};

#[test]
fn gauss_rules_are_exact_to_degree_2n_minus_1() {
    for n in 1..=8 {
        let (x, w) = gauss(n);
        for degree in 0..2 * n {
            let sum: f64 = x.iter().zip(&w).map(|(x, w)| w * x.powi(degree as i32)).sum();
            let exact = 1.0 / (degree as f64 + 1.0);
            assert!(
                abs_diff_eq!(sum, exact, epsilon = 4.0 * f64::EPSILON),
                "n = {n}, degree {degree}: {sum} against {exact}"
            );
        }
        let sum: f64 = x.iter().zip(&w).map(|(x, w)| w * x.powi(2 * n as i32)).sum();
        // A rule is not exact beyond its degree.
        assert_abs_diff_ne!(sum, 1.0 / (2.0 * n as f64 + 1.0), epsilon = 1e-12);
    }
}

#[test]
fn lobatto_nodes_match_the_printed_table() {
    // Abramowitz and Stegun, Handbook of Mathematical Functions, table 25.6, on [−1, 1].
    let known = [(2, 0.0), (3, 0.447213595499958), (4, 0.654653670707977)];
    for (n, node) in known {
        assert_abs_diff_eq!(2.0 * lobatto(n)[n - 1] - 1.0, node, epsilon = 1e-15);
    }
    assert_eq!(lobatto(1), [0.0, 1.0]);
}

#[test]
fn lagrange_polynomials_reproduce_a_cubic_and_its_slope() {
    let nodes = lobatto(3);
    let cubic = |x: f64| 1.0 - 2.0 * x + 3.0 * x.powi(3);
    let mut values = [0.0; 4];
    lagrange(&nodes, 0.3, &mut values);
    let value: f64 = values.iter().zip(&nodes).map(|(l, x)| l * cubic(*x)).sum();
    assert_abs_diff_eq!(value, cubic(0.3), epsilon = 1e-14);
    let slope: f64 = lagrange_derivatives(&nodes, 0.3).iter().zip(&nodes).map(|(l, x)| l * cubic(*x)).sum();
    assert_abs_diff_eq!(slope, -2.0 + 9.0 * 0.09, epsilon = 1e-13);
}
