//! Weights with which exp(−t/τ) is integrated exactly against cubics, for four variables at a time.

use nalgebra::{Matrix4, Vector4};

use super::ORDER;
use crate::quadrature::{lagrange, rule};

/// Collocation points: the stimuli are polynomials through as many levels.
pub(super) const NODES: usize = ORDER;

/// Variables that are treated together: as many numbers as processors add at once, or twice as many.
pub(super) const LANES: usize = 4;

/// A number for each of a few variables.
pub(super) type Lanes = [f64; LANES];

/// The weights of a few variables, for an interval of δ seconds.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Kernel {
    /// exp(−c δ/τ) at every node c.
    pub decay: [Lanes; NODES],
    /// ∫ from 0 to node j of exp(−(cj − c) δ/τ) × polynomial l, times δ.
    pub integral: [[Lanes; NODES]; NODES],
    /// The time within which what drives a variable acts on it, s: ∫ exp(−t/τ) dt over the interval.
    pub reach: Lanes,
}

impl Kernel {
    /// Computes the weights of one of the variables, with time constant `tau` (s), for an interval of `size` (s).
    pub fn set(&mut self, lane: usize, nodes: &[f64], size: f64, tau: f64) {
        let z = size / tau;
        for (j, c) in nodes.iter().enumerate() {
            self.decay[j][lane] = (-c * z).exp();
            for (l, weight) in relaxed_integral(nodes, z, *c).into_iter().enumerate() {
                self.integral[j][l][lane] = weight * size;
            }
        }
        // The weights integrate what is constant, and the last node is the end.
        self.reach[lane] = self.integral[NODES - 1].iter().map(|weight| weight[lane]).sum();
    }
}

/// ∫ from 0 to `c` of exp(−(c − t) z) times each Lagrange polynomial through `nodes`, dt.
fn relaxed_integral(nodes: &[f64], z: f64, c: f64) -> [f64; NODES] {
    let mut out = [0.0; NODES];
    if c == 0.0 {
        return out;
    }
    if c * z <= 3.0 {
        let (points, weights) = rule::<8>();
        for (x, w) in points.iter().zip(weights) {
            let mut values = [0.0; NODES];
            lagrange(nodes, c * x, &mut values);
            let kernel = w * c * (-(c - c * x) * z).exp();
            for (o, v) in out.iter_mut().zip(values) {
                *o += kernel * v;
            }
        }
        return out;
    }
    // Moments ∫ exp(−(c − t) z) t^m dt by the recurrence Im = (c^m − m Im−1)/z, stable for c z > 3.
    let mut moments = [0.0; NODES];
    moments[0] = -(-c * z).exp_m1() / z;
    for m in 1..NODES {
        moments[m] = (c.powi(m as i32) - m as f64 * moments[m - 1]) / z;
    }
    // Weights that reproduce the moments reproduce the integral of every polynomial through the nodes. The nodes are
    // distinct, so there are some.
    let powers = Matrix4::from_fn(|m, k| nodes[k].powi(m as i32));
    powers.lu().solve(&Vector4::from(moments)).map_or(out, Into::into)
}
