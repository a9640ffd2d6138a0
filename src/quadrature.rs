//! Gauss–Legendre and Gauss–Lobatto nodes on [0, 1], and polynomials through them.

use std::f64::consts::PI;
use std::sync::OnceLock;

/// The Legendre polynomial of degree `n` and its derivative at `x` in [−1, 1].
pub(crate) fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut previous, mut current) = (1.0, x);
    if n == 0 {
        return (1.0, 0.0);
    }
    for k in 1..n {
        let kf = k as f64;
        let next = ((2.0 * kf + 1.0) * x * current - kf * previous) / (kf + 1.0);
        (previous, current) = (current, next);
    }
    let nf = n as f64;
    // At the ends the usual quotient is 0/0; the limit is n (n + 1)/2, with the sign of xⁿ⁻¹.
    let derivative = if (x * x - 1.0).abs() < f64::EPSILON {
        x.signum().powi(n as i32 + 1) * nf * (nf + 1.0) / 2.0
    } else {
        nf * (x * current - previous) / (x * x - 1.0)
    };
    (current, derivative)
}

/// Points and weights of the `n`-point Gauss–Legendre rule on [0, 1], exact for polynomials of degree 2n − 1.
#[must_use]
pub fn gauss(n: usize) -> (Vec<f64>, Vec<f64>) {
    (0..n)
        .map(|i| {
            let mut x = -((PI * (i as f64 + 0.75)) / (n as f64 + 0.5)).cos();
            // Newton from this guess converges quadratically; five steps reach rounding for every n used.
            for _ in 0..8 {
                let (p, d) = legendre(n, x);
                x -= p / d;
            }
            let (_, d) = legendre(n, x);
            (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * d * d))
        })
        .unzip()
}

/// The rule of [`gauss`] for `N` ≤ 8 points, computed once.
pub(crate) fn rule<const N: usize>() -> &'static (Vec<f64>, Vec<f64>) {
    static RULES: [OnceLock<(Vec<f64>, Vec<f64>)>; 9] = [const { OnceLock::new() }; 9];
    RULES[N].get_or_init(|| gauss(N))
}

/// The `n` + 1 Gauss–Lobatto nodes on [0, 1], both ends among them, `n` ≥ 1.
#[must_use]
pub fn lobatto(n: usize) -> Vec<f64> {
    let nf = n as f64;
    (0..=n)
        .map(|i| {
            if i == 0 || i == n {
                return if i == 0 { 0.0 } else { 1.0 };
            }
            let mut x = -(PI * i as f64 / nf).cos();
            // Interior nodes are the zeros of Pn'; (1 − x²) Pn'' = 2 x Pn' − n (n + 1) Pn gives Newton's slope.
            for _ in 0..20 {
                let (p, d) = legendre(n, x);
                x -= d * (1.0 - x * x) / (2.0 * x * d - nf * (nf + 1.0) * p);
            }
            0.5 * (1.0 + x)
        })
        .collect()
}

/// The values at `x` of the Lagrange polynomials through `nodes`, written to `values`.
pub fn lagrange(nodes: &[f64], x: f64, values: &mut [f64]) {
    for (k, value) in values.iter_mut().enumerate() {
        *value = 1.0;
        for (j, node) in nodes.iter().enumerate() {
            if j != k {
                *value *= (x - node) / (nodes[k] - node);
            }
        }
    }
}

/// The derivatives at `x` of the Lagrange polynomials through `nodes`.
#[must_use]
pub fn lagrange_derivatives(nodes: &[f64], x: f64) -> Vec<f64> {
    (0..nodes.len())
        .map(|k| {
            (0..nodes.len())
                .filter(|&m| m != k)
                .map(|m| {
                    (0..nodes.len())
                        .filter(|&j| j != k && j != m)
                        .fold(1.0 / (nodes[k] - nodes[m]), |p, j| p * (x - nodes[j]) / (nodes[k] - nodes[j]))
                })
                .sum()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_rules_are_exact_to_degree_2n_minus_1() {
        for n in 1..=8 {
            let (x, w) = gauss(n);
            for degree in 0..2 * n {
                let sum: f64 = x.iter().zip(&w).map(|(x, w)| w * x.powi(degree as i32)).sum();
                assert!((sum - 1.0 / (degree as f64 + 1.0)).abs() < 4.0 * f64::EPSILON, "n = {n}, degree {degree}");
            }
            let sum: f64 = x.iter().zip(&w).map(|(x, w)| w * x.powi(2 * n as i32)).sum();
            assert!((sum - 1.0 / (2.0 * n as f64 + 1.0)).abs() > 1e-12, "a rule cannot be exact beyond its degree");
        }
    }

    #[test]
    fn lobatto_nodes_are_the_known_ones() {
        // Abramowitz and Stegun, Handbook of Mathematical Functions, table 25.6, on [−1, 1].
        let known = [(2, 0.0), (3, 0.447213595499958), (4, 0.654653670707977)];
        for (n, node) in known {
            assert!((2.0 * lobatto(n)[n - 1] - 1.0 - node).abs() < 1e-15);
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
        assert!((value - cubic(0.3)).abs() < 1e-14);
        let slope: f64 = lagrange_derivatives(&nodes, 0.3).iter().zip(&nodes).map(|(l, x)| l * cubic(*x)).sum();
        assert!((slope - (-2.0 + 9.0 * 0.09)).abs() < 1e-13);
    }
}
