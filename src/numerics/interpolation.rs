//! Lagrange interpolation (Abramowitz and Stegun 1964, 25.2.1 to 25.2.3).

/// The value at `x` of the Lagrange polynomial of node `k`, which is one at this node and zero at
/// the others.
pub(crate) fn lagrange_value(nodes: &[f64], k: usize, x: f64) -> f64 {
    let factor = |value: f64, j: usize| value * ((x - nodes[j]) / (nodes[k] - nodes[j]));
    (0..nodes.len()).filter(|j| *j != k).fold(1.0, factor)
}

/// The values at `x` of the Lagrange polynomials of at most `N` nodes, followed by zeros.
pub(crate) fn lagrange<const N: usize>(nodes: &[f64], x: f64) -> [f64; N] {
    std::array::from_fn(|k| {
        if k < nodes.len() {
            lagrange_value(nodes, k, x)
        } else {
            0.0
        }
    })
}

/// The weights of the values at up to `N` nodes for interpolation at `x` by exp(−x/τ) and a
/// polynomial, which has one coefficient less than there are nodes. Zeros follow the weights. The
/// nodes have increasing order, and τ is not much longer than their distance.
pub(crate) fn lagrange_with_transient<const N: usize>(nodes: &[f64], tau: f64, x: f64) -> [f64; N] {
    let mut values = lagrange(nodes, x);
    let transient = |x: f64| ((nodes[0] - x) / tau).exp();
    let difference: f64 = (0..nodes.len())
        .map(|k| transient(nodes[k]) / lagrange_denominator(nodes, k))
        .sum();
    let missing = transient(x)
        - nodes
            .iter()
            .zip(values.iter())
            .map(|(node, value)| value * transient(*node))
            .sum::<f64>();
    // The share of the transient in the values is the ratio of the highest divided differences.
    for (k, value) in values.iter_mut().enumerate().take(nodes.len()) {
        *value += missing / (difference * lagrange_denominator(nodes, k));
    }
    values
}

/// Returns the product of the differences of node `k` from all other nodes, the denominator of its
/// Lagrange polynomial.
pub(crate) fn lagrange_denominator(nodes: &[f64], k: usize) -> f64 {
    let difference = |product: f64, node: &f64| product * (nodes[k] - node);
    nodes[..k].iter().fold(1.0, difference) * nodes[k + 1..].iter().rev().fold(1.0, difference)
}

/// Writes the values of [`lagrange`] for given denominators, which saves most divisions.
pub(crate) fn lagrange_over(denominators: &[f64], nodes: &[f64], x: f64, values: &mut [f64]) {
    let mut product = 1.0;
    for (value, node) in values.iter_mut().zip(nodes) {
        *value = product;
        product *= x - node;
    }
    product = 1.0;
    // The order of the products is that of the denominators, so that a polynomial is exactly one at
    // its node.
    for ((value, node), denominator) in values.iter_mut().zip(nodes).zip(denominators).rev() {
        *value = *value * product / denominator;
        product *= x - node;
    }
}

/// Returns the coefficients of the powers of x in the Lagrange polynomial of node `k`, lowest
/// first. There are at most `N` nodes.
pub(crate) fn lagrange_powers<const N: usize>(nodes: &[f64], k: usize) -> [f64; N] {
    let mut product = [0.0; N];
    product[0] = 1.0;
    for (_, node) in nodes.iter().enumerate().filter(|(j, _)| *j != k) {
        for power in (0..nodes.len()).rev() {
            let lower = if power > 0 { product[power - 1] } else { 0.0 };
            product[power] = (lower - node * product[power]) / (nodes[k] - node);
        }
    }
    product
}

/// Returns the derivatives at `x` of the Lagrange polynomials of `nodes`.
pub(crate) fn lagrange_derivatives(nodes: &[f64], x: f64) -> Vec<f64> {
    let others = |k: usize, m: usize| (0..nodes.len()).filter(move |j| *j != k && *j != m);
    let term = |k: usize, m: usize| {
        others(k, m).fold(1.0 / (nodes[k] - nodes[m]), |p, j| {
            p * (x - nodes[j]) / (nodes[k] - nodes[j])
        })
    };
    (0..nodes.len())
        .map(|k| others(k, k).map(|m| term(k, m)).sum())
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
        for x in [-2.0, -1.3, 0.4, 1.0, 2.0] {
            let values: [f64; 4] = lagrange(&nodes, x);
            let sum: f64 = values
                .iter()
                .zip(nodes)
                .map(|(weight, node)| weight * cubic(node))
                .sum();
            let derivative: f64 = lagrange_derivatives(&nodes, x)
                .iter()
                .zip(nodes)
                .map(|(weight, node)| weight * cubic(node))
                .sum();
            // Weights and values are of the size of ten.
            assert_relative_eq!(sum, cubic(x), epsilon = 1e-14, max_relative = 1e-13);
            assert_relative_eq!(derivative, slope(x), epsilon = 1e-14, max_relative = 1e-13);
        }
        // The same with given denominators.
        let denominators: [f64; 4] = std::array::from_fn(|k| lagrange_denominator(&nodes, k));
        for x in [-2.0, -1.3, 0.4, 1.0, 2.0] {
            let (values, mut fast): ([f64; 4], _) = (lagrange(&nodes, x), [0.0; 4]);
            lagrange_over(&denominators, &nodes, x, &mut fast);
            assert_relative_eq!(fast[..], values[..], epsilon = 1e-15, max_relative = 1e-15);
        }
        // The same by powers, whose coefficients are of the size of one.
        for (k, value) in lagrange::<4>(&nodes, 2.0).iter().enumerate() {
            let power = lagrange_powers::<4>(&nodes, k)
                .into_iter()
                .rfold(0.0, |sum, coefficient| sum * 2.0 + coefficient);
            assert_relative_eq!(power, *value, epsilon = 1e-14, max_relative = 1e-14);
        }
        // A transient and a parabola through four nodes, with terms of the size of ten.
        let decaying = |x: f64| 1.0 - 2.0 * x + 0.5 * x.powi(2) + (-x / 0.7).exp();
        for x in [-2.0, -1.3, 0.4, 1.0, 2.0] {
            let values: [f64; 4] = lagrange_with_transient(&nodes, 0.7, x);
            let sum: f64 = values
                .iter()
                .zip(nodes)
                .map(|(weight, node)| weight * decaying(node))
                .sum();
            assert_relative_eq!(sum, decaying(x), epsilon = 1e-13, max_relative = 1e-13);
        }
        // At a node its own polynomial is one and the others are zero, exactly.
        let mut values = [0.0; 4];
        lagrange_over(&denominators, &nodes, -0.5, &mut values);
        assert_eq!(values, [0.0, 1.0, 0.0, 0.0]);
        assert_eq!(lagrange(&nodes, -0.5), [0.0, 1.0, 0.0, 0.0]);
    }
}
