//! Lagrange interpolation (Abramowitz and Stegun 1964, 25.2.1 to 25.2.3).

/// Writes the values at `x` of the Lagrange polynomials of `nodes` to `values`: each is one at its node and
/// zero at the others.
pub(crate) fn lagrange(nodes: &[f64], x: f64, values: &mut [f64]) {
    for (k, value) in values.iter_mut().enumerate() {
        *value = 1.0;
        for (j, node) in nodes.iter().enumerate() {
            if j != k {
                *value *= (x - node) / (nodes[k] - node);
            }
        }
    }
}

/// Returns the derivatives at `x` of the Lagrange polynomials of `nodes`.
pub(crate) fn lagrange_derivatives(nodes: &[f64], x: f64) -> Vec<f64> {
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
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn lagrange_polynomials_reproduce_polynomials_and_their_derivatives() {
        let nodes = [-2.0, -0.5, 0.0, 1.0];
        let cubic = |x: f64| 1.0 - 2.0 * x + 0.5 * x.powi(2) - x.powi(3);
        let slope = |x: f64| -2.0 + x - 3.0 * x.powi(2);
        let mut values = [0.0; 4];
        for x in [-2.0, -1.3, 0.4, 1.0, 2.0] {
            lagrange(&nodes, x, &mut values);
            let sum: f64 = values.iter().zip(nodes).map(|(weight, node)| weight * cubic(node)).sum();
            let derivative: f64 =
                lagrange_derivatives(&nodes, x).iter().zip(nodes).map(|(weight, node)| weight * cubic(node)).sum();
            // Weights and values are of the size of ten.
            assert_relative_eq!(sum, cubic(x), epsilon = 1e-14, max_relative = 1e-13);
            assert_relative_eq!(derivative, slope(x), epsilon = 1e-14, max_relative = 1e-13);
        }
        // At a node its own polynomial is one and the others are zero, exactly.
        lagrange(&nodes, -0.5, &mut values);
        assert_eq!(values, [0.0, 1.0, 0.0, 0.0]);
    }
}
