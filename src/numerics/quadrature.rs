//! Legendre polynomials, Gauss–Legendre rules and Gauss–Lobatto nodes on [0, 1] (Abramowitz and
//! Stegun 1964, 22.7.10, 22.8.5, 22.16.6, 25.4.29 and 25.4.32).

use std::f64::consts::PI;
use std::sync::OnceLock;

/// The values of all Legendre polynomials at `x`, in order of increasing degree.
pub(crate) fn legendre_sequence(x: f64) -> impl Iterator<Item = f64> {
    let mut pair = [0.0, 1.0];
    (0..).map(f64::from).map(move |k| {
        let [previous, value] = pair;
        pair = [
            value,
            ((2.0 * k + 1.0) * x * value - k * previous) / (k + 1.0),
        ];
        value
    })
}

/// The Legendre polynomial of degree `n` and its derivative at `x` in [−1, 1].
pub(crate) fn legendre(n: usize, x: f64) -> (f64, f64) {
    let before = std::iter::once(0.0).chain(legendre_sequence(x));
    let (previous, value) = before.zip(legendre_sequence(x)).nth(n).unwrap_or_default();
    let nf = n as f64;
    // At the ends the quotient below is 0/0. Its limit is n (n + 1)/2 with the sign of xⁿ⁻¹.
    let derivative = if (x * x - 1.0).abs() < f64::EPSILON {
        x.signum().powi(n as i32 + 1) * nf * (nf + 1.0) / 2.0
    } else {
        nf * (x * value - previous) / (x * x - 1.0)
    };
    (value, derivative)
}

/// Points and weights of the `n`-point Gauss–Legendre rule on [0, 1], exact for polynomials of
/// degree 2n − 1.
pub(crate) fn gauss(n: usize) -> (Vec<f64>, Vec<f64>) {
    let point = |i: usize| {
        let mut x = -((PI * (i as f64 + 0.75)) / (n as f64 + 0.5)).cos();
        // Newton's method converges quadratically from this guess; five steps reach rounding for n
        // ≤ 16.
        for _ in 0..8 {
            let (p, d) = legendre(n, x);
            x -= p / d;
        }
        let (_, d) = legendre(n, x);
        (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * d * d))
    };
    (0..n).map(point).unzip()
}

/// The Gauss–Legendre rule with `N` ≤ 8 points, computed once.
pub(crate) fn rule<const N: usize>() -> &'static (Vec<f64>, Vec<f64>) {
    static RULES: [OnceLock<(Vec<f64>, Vec<f64>)>; 9] = [const { OnceLock::new() }; 9];
    RULES[N].get_or_init(|| gauss(N))
}

/// Tolerance of [`integral`], relative to the integral of the absolute value.
const ACCURATE: f64 = 1e-13;
/// Largest number of divisions of an interval. A discontinuity takes 40, after which its part is
/// 1e-12 of the interval. The bound limits the work for a function that is noisy.
const DIVISIONS: usize = 500;

/// The Gauss–Lobatto rule of eight points for a function and for its absolute value. It contains
/// the ends of the interval, so that a discontinuity close to an end is noticed.
fn eight_points(f: &impl Fn(f64) -> f64, [from, to]: [f64; 2]) -> (f64, f64) {
    static RULE: OnceLock<(Vec<f64>, Vec<f64>)> = OnceLock::new();
    let (x, w) = RULE.get_or_init(|| lobatto_weights(7));
    let each = x
        .iter()
        .zip(w)
        .map(|(x, w)| w * (to - from) * f(from + (to - from) * x));
    each.fold((0.0, 0.0), |(sum, size), term| {
        (sum + term, size + term.abs())
    })
}

/// A part of an interval of integration.
struct Panel {
    /// Both halves with the integrals over them, and the sum of the integrals.
    halves: [([f64; 2], f64); 2],
    sum: f64,
    /// Difference between the rule for the part and that for its halves.
    error: f64,
    /// Integral of the absolute value.
    size: f64,
}

impl Panel {
    /// A part with the value `whole` of the rule of eight points.
    fn new(f: &impl Fn(f64) -> f64, [from, to]: [f64; 2], whole: f64) -> Self {
        let middle = 0.5 * (from + to);
        let (first, second) = ([from, middle], [middle, to]);
        let [(left, left_size), (right, right_size)] =
            [first, second].map(|half| eight_points(f, half));
        let (sum, size) = (left + right, left_size + right_size);
        Self {
            halves: [(first, left), (second, right)],
            sum,
            error: (sum - whole).abs(),
            size,
        }
    }
}

/// The integral of a function that is piecewise smooth. The part with the largest error is halved
/// until the sum of the errors is due to rounding.
pub(crate) fn integral(f: &impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    let first = Panel::new(f, [from, to], eight_points(f, [from, to]).0);
    // A smooth function needs no division, and no memory. NaN is not divided.
    if !(first.error > ACCURATE * first.size) {
        return first.sum;
    }
    let mut parts = vec![first];
    for _ in 0..DIVISIONS {
        let total = |of: fn(&Panel) -> f64| parts.iter().map(of).sum::<f64>();
        let largest = parts
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.error.total_cmp(&b.1.error));
        let (true, Some((worst, _))) = (
            total(|at| at.error) > ACCURATE * total(|at| at.size),
            largest,
        ) else {
            break;
        };
        let part = parts.swap_remove(worst);
        parts.extend(part.halves.map(|(half, whole)| Panel::new(f, half, whole)));
    }
    parts.iter().map(|part| part.sum).sum()
}

/// The `n` + 1 Gauss–Lobatto nodes on [0, 1], including both ends, for `n` ≥ 1.
pub(crate) fn lobatto(n: usize) -> Vec<f64> {
    let nf = n as f64;
    let interior = (1..n).map(|i| {
        let mut x = -(PI * i as f64 / nf).cos();
        // Interior nodes are the zeros of Pn'. The derivative follows from (1 − x²) Pn'' = 2 x Pn'
        // − n (n + 1) Pn.
        for _ in 0..20 {
            let (p, d) = legendre(n, x);
            x -= d * (1.0 - x * x) / (2.0 * x * d - nf * (nf + 1.0) * p);
        }
        0.5 * (1.0 + x)
    });
    [0.0].into_iter().chain(interior).chain([1.0]).collect()
}

/// Nodes and weights of the Gauss–Lobatto rule with n + 1 nodes on [0, 1], 1/(n (n + 1) Pₙ²).
pub(crate) fn lobatto_weights(n: usize) -> (Vec<f64>, Vec<f64>) {
    let nodes = lobatto(n);
    let nf = n as f64;
    let weights = nodes
        .iter()
        .map(|x| 1.0 / (nf * (nf + 1.0) * legendre(n, 2.0 * x - 1.0).0.powi(2)))
        .collect();
    (nodes, weights)
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    #[test]
    fn gauss_rules_integrate_polynomials_of_degree_2n_minus_1_and_no_higher() {
        for n in 1..=8 {
            let (points, weights) = gauss(n);
            let sum = |k: usize| {
                points
                    .iter()
                    .zip(&weights)
                    .map(|(x, w)| w * x.powi(k as i32))
                    .sum::<f64>()
            };
            for k in 0..2 * n {
                // Rounding of a sum of eight numbers below one.
                assert_abs_diff_eq!(sum(k), 1.0 / (k + 1) as f64, epsilon = 1e-15);
            }
            // The remainder of x^(2n) is (n!)⁴/((2n)!² (2n + 1)).
            let factorial = |m: usize| (1..=m).map(|i| i as f64).product::<f64>();
            let remainder = factorial(n).powi(4) / (factorial(2 * n).powi(2) * (2 * n + 1) as f64);
            assert_abs_diff_eq!(
                1.0 / (2 * n + 1) as f64 - sum(2 * n),
                remainder,
                epsilon = 1e-15
            );
            assert_eq!(points, rule_of(n), "the cached rule");
        }
    }

    /// Points of the cached rule with n points.
    fn rule_of(n: usize) -> Vec<f64> {
        match n {
            1 => rule::<1>(),
            2 => rule::<2>(),
            3 => rule::<3>(),
            4 => rule::<4>(),
            5 => rule::<5>(),
            6 => rule::<6>(),
            7 => rule::<7>(),
            _ => rule::<8>(),
        }
        .0
        .clone()
    }

    #[test]
    fn lobatto_nodes_are_the_known_ones() {
        let known: [&[f64]; 4] = [
            &[-1.0, 1.0],
            &[-1.0, 0.0, 1.0],
            &[-1.0, -(0.2_f64.sqrt()), 0.2_f64.sqrt(), 1.0],
            &[
                -1.0,
                -((3.0 / 7.0_f64).sqrt()),
                0.0,
                (3.0 / 7.0_f64).sqrt(),
                1.0,
            ],
        ];
        for (n, known) in known.into_iter().enumerate() {
            for (node, known) in lobatto(n + 1).into_iter().zip(known) {
                assert_abs_diff_eq!(2.0 * node - 1.0, *known, epsilon = 4.0 * f64::EPSILON);
            }
        }
    }

    #[test]
    fn legendre_polynomials_and_their_derivatives_are_the_known_ones() {
        // P3 = (5x³ − 3x)/2.
        for x in [-1.0_f64, -0.3, 0.0, 0.8, 1.0] {
            let (value, derivative) = legendre(3, x);
            assert_abs_diff_eq!(value, 0.5 * (5.0 * x.powi(3) - 3.0 * x), epsilon = 1e-15);
            assert_eq!(legendre_sequence(x).nth(3), Some(value));
            // A quotient by 1 − x² ≥ 0.36.
            assert_abs_diff_eq!(derivative, 0.5 * (15.0 * x * x - 3.0), epsilon = 1e-14);
        }
    }

    #[test]
    fn integrals_of_peaks_and_of_piecewise_functions_are_accurate() {
        for k in 0..200 {
            // Places and widths that differ irregularly.
            let [a, b] = [0.754_877_666, 0.569_840_291].map(|step| (f64::from(k) * step).fract());
            let (at, width, end) = (0.05 * a, 1e-3 + 0.01 * b, 0.05);
            // A peak sech²((x − at)/width) on a slope, and a jump by 2 where the slope begins to
            // decrease.
            let peak = |x: f64| ((x - at) / width).cosh().powi(-2);
            let jump = end * b;
            let f = |x: f64| peak(x) + if x < jump { x } else { 2.0 - x };
            let exact = width * (((end - at) / width).tanh() + (at / width).tanh())
                + 0.5 * jump * jump
                + 2.0 * (end - jump)
                - 0.5 * (end * end - jump * jump);
            // The part at the jump is 1e-12 of the interval.
            let error = integral(&f, 0.0, end) / exact - 1.0;
            assert!(error.abs() < 1e-11, "{k}: {error:e}");
        }
        assert!(integral(&|_| f64::NAN, 0.0, 1.0).is_nan());
        // A smooth function needs 24 values.
        let count = std::cell::Cell::new(0);
        let counted = |f: fn(f64) -> f64| {
            count.set(0);
            let counting = |x| {
                count.set(count.get() + 1);
                f(x)
            };
            (integral(&counting, 0.0, 1.0), count.get())
        };
        assert_eq!(counted(f64::exp).1, 24);
        // A division needs 32 values. A function with the precision of single numbers uses all
        // divisions.
        let (value, count) = counted(|x| f64::from(x.exp() as f32));
        assert_eq!(count, 24 + 32 * DIVISIONS);
        assert!((value - 1f64.exp_m1()).abs() < 1e-7, "{value}");
    }
}
