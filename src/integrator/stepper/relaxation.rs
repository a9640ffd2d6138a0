//! Weights of exponential collocation: integrals of cubics times exp(−t/τ), for four variables at a
//! time.

use nalgebra::{ComplexField, Matrix4, Vector4};

use super::ORDER;
use crate::numerics::interpolation::lagrange;
use crate::numerics::quadrature::rule;

/// Number of variables in a group: once or twice the width of the vector registers of usual
/// processors.
pub(super) const LANES: usize = 4;

/// One number for each variable of a group.
pub(super) type Lanes = [f64; LANES];

/// Weights of a group of variables for an interval of δ seconds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kernel {
    /// exp(−c δ/τ) at each node c.
    pub decay: [Lanes; ORDER],
    /// δ ∫ exp(−(cj − c) δ/τ) pl(c) dc from 0 to node cj, for each node j and each Lagrange
    /// polynomial pl.
    pub integral: [[Lanes; ORDER]; ORDER],
    /// ∫ exp(−t/τ) dt over the interval, s: the time over which a constant rate acts on the
    /// variable.
    pub reach: Lanes,
}

impl Default for Kernel {
    /// Weights of lanes without a variable, whose values are NaN.
    fn default() -> Self {
        let integral = [[[0.0; LANES]; ORDER]; ORDER];
        Self {
            decay: [[f64::NAN; LANES]; ORDER],
            integral,
            reach: [0.0; LANES],
        }
    }
}

impl Kernel {
    /// Copies the weights of another variable to variable `lane`, which has the same time constant.
    pub fn repeat(&mut self, lane: usize, from: usize) {
        let rows = self
            .integral
            .iter_mut()
            .flatten()
            .chain(&mut self.decay)
            .chain([&mut self.reach]);
        rows.for_each(|row| row[lane] = row[from]);
    }

    /// Computes the weights of variable `lane`, with time constant `tau` (s), for an interval of
    /// `size` (s).
    pub fn set(&mut self, lane: usize, nodes: &[f64], size: f64, tau: f64) {
        let z = size / tau;
        for (j, c) in nodes.iter().enumerate() {
            self.decay[j][lane] = (-c * z).exp();
            for (l, weight) in relaxed_integral(nodes, z, *c).into_iter().enumerate() {
                self.integral[j][l][lane] = weight * size;
            }
        }
        // The weights are exact for constants, and the last node is the end of the interval.
        self.reach[lane] = self.integral[ORDER - 1]
            .iter()
            .map(|weight| weight[lane])
            .sum();
    }
}

/// Returns ∫ exp(−(c − t) z) pl(t) dt from 0 to `c` for each Lagrange polynomial pl of `nodes`. z
/// is complex for a damped oscillation.
pub(super) fn relaxed_integral<T: ComplexField<RealField = f64>>(
    nodes: &[f64],
    z: T,
    c: f64,
) -> [T; ORDER] {
    let mut out = [(); ORDER].map(|()| T::zero());
    if c == 0.0 {
        return out;
    }
    if c * z.clone().modulus() <= 3.0 {
        let (points, weights) = rule::<8>();
        for (x, w) in points.iter().zip(weights) {
            let kernel = z.clone().scale(-(c - c * x)).exp().scale(w * c);
            for (o, v) in out.iter_mut().zip(lagrange::<ORDER>(nodes, c * x)) {
                *o += kernel.clone().scale(v);
            }
        }
        return out;
    }
    // Moments ∫ exp(−(c − t) z) t^m dt by the recurrence Im = (c^m − m Im−1)/z, stable for c |z| >
    // 3.
    let mut moments = [(); ORDER].map(|()| T::zero());
    moments[0] = -z.clone().scale(-c).exp_m1() / z.clone();
    for m in 1..ORDER {
        moments[m] =
            (T::from_real(c.powi(m as i32)) - moments[m - 1].clone().scale(m as f64)) / z.clone();
    }
    // Weights that are exact for the moments are exact for all polynomials of this degree. The
    // Vandermonde matrix is nonsingular since the nodes are distinct.
    let powers = Matrix4::from_fn(|m, k| T::from_real(nodes[k].powi(m as i32)));
    powers
        .lu()
        .solve(&Vector4::from(moments))
        .map_or(out, Into::into)
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::numerics::quadrature::lobatto;

    /// Returns ∫ exp(−(c − t) z) tᵐ dt from 0 to c by its power series
    /// Σ (−z)ᵏ m! c^(k+m+1)/(k + m + 1)!.
    fn moment(m: i32, z: f64, c: f64) -> f64 {
        let mut term = c.powi(m + 1) / f64::from(m + 1);
        let mut sum = term;
        for k in 1..60 {
            term *= -z * c / f64::from(k + m + 1);
            sum += term;
        }
        sum
    }

    #[test]
    fn weights_integrate_cubics_against_the_decay_exactly() {
        let (nodes, size) = (lobatto(ORDER - 1), 0.4);
        // The formula changes at c z = 3. These values of z have c z on both sides of 3 at the end
        // and at the inner nodes.
        for z in [1e-9, 0.5, 2.999, 3.001, 4.0, 6.0] {
            let mut kernel = Kernel::default();
            kernel.set(2, &nodes, size, size / z);
            for (j, c) in nodes.iter().enumerate() {
                assert_relative_eq!(
                    kernel.decay[j][2],
                    (-c * z).exp(),
                    epsilon = 0.0,
                    max_relative = 1e-15
                );
                for m in 0..4 {
                    let powers = nodes.iter().map(|node| node.powi(m));
                    let sum: f64 = kernel.integral[j]
                        .iter()
                        .zip(powers)
                        .map(|(weight, power)| weight[2] * power)
                        .sum();
                    // Terms of the series reach exp(6) times the smallest sum, with a rounding
                    // error of 1e-16 each.
                    assert_relative_eq!(
                        sum,
                        size * moment(m, z, *c),
                        epsilon = 1e-17,
                        max_relative = 2e-13
                    );
                }
            }
            // ∫ exp(−t/τ) dt = τ (1 − exp(−δ/τ)).
            let reach = -(size / z) * (-z).exp_m1();
            assert_relative_eq!(kernel.reach[2], reach, epsilon = 0.0, max_relative = 1e-14);
            assert_eq!(
                kernel.reach[1], 0.0,
                "weights of other variables do not change"
            );
        }
    }

    #[test]
    fn weights_of_a_very_fast_decay_are_those_of_the_end_of_the_interval() {
        let (nodes, tau) = (lobatto(ORDER - 1), 1e-8);
        let mut kernel = Kernel::default();
        kernel.set(0, &nodes, 1.0, tau);
        // ∫ exp(−(c − t)/τ) p(t) dt = τ p(c) − τ² p'(c) + …, and the slope of a Lagrange polynomial
        // is below ten.
        for j in 1..ORDER {
            for l in 0..ORDER {
                let value = if j == l { 1.0 } else { 0.0 };
                approx::assert_abs_diff_eq!(
                    kernel.integral[j][l][0] / tau,
                    value,
                    epsilon = 10.0 * tau
                );
            }
        }
    }

    #[test]
    fn an_infinite_time_constant_gives_the_weights_of_lobatto_collocation() {
        let nodes = lobatto(ORDER - 1);
        let mut kernel = Kernel::default();
        kernel.set(0, &nodes, 1.0, f64::INFINITY);
        // Weights of the four-point Lobatto rule on [0, 1]: 1/12, 5/12, 5/12, 1/12.
        for (weight, twelfths) in kernel.integral[ORDER - 1].iter().zip([1.0, 5.0, 5.0, 1.0]) {
            assert_relative_eq!(
                weight[0],
                twelfths / 12.0,
                epsilon = 0.0,
                max_relative = 1e-14
            );
        }
        assert!(kernel.decay.iter().all(|decay| decay[0] == 1.0));
    }
}
