//! Initial guess of an equilibrium: earlier equilibria are extrapolated in time, and the weights of
//! the extrapolation are corrected by the intrinsic strain, which is known before the equilibrium
//! is solved.
//!
//! [`ORDER`] equilibria before the last one are kept; one more or less has no effect. A polynomial
//! in time through them does not predict an oscillation that is resolved by a few steps only; the
//! correction by the intrinsic strain does. With it, steps of up to a quarter of the period of an
//! oscillator need one Newton iteration.

use nalgebra::{SMatrix, SVector, Vector3};

use super::{CLOSE, ORDER};
use crate::error::ParameterError;
use crate::numerics::interpolation::lagrange;
use crate::rod::{Rod, merge_rotations, split_rotations};

/// Tikhonov regularisation of the correction, relative to the trace of the normal matrix.
/// Combinations of intrinsic strains whose relative square is smaller have little weight, since the
/// correction would magnify their errors.
const RIDGE: f64 = 1e-5;

/// Largest sum of the absolute changes of the weights. An oscillation in four steps needs up to
/// eight. Where a load starts from zero, the intrinsic strains grow by orders of magnitude in a
/// step, and the shapes are not proportional to them.
const LARGEST_CHANGE: f64 = 10.0;

/// Moments of the intrinsic strain of degree 0, 1 and 2 in the distance from the apex over the
/// length, rad.
pub(crate) type Moments = SVector<f64, 9>;

/// Returns the moments of the intrinsic strain of a rod.
pub(crate) fn intrinsic_moments(rod: &Rod) -> Moments {
    let (reference, length) = (rod.reference(), rod.length());
    let mut moments = [Vector3::zeros(); 3];
    for (point, weight) in rod.points().iter().zip(reference.weights.iter().cycle()) {
        let (part, x) = (
            point.intrinsic * (weight * point.jacobian),
            point.apex_distance / length,
        );
        moments[0] += part;
        moments[1] += part * x;
        moments[2] += part * (x * x);
    }
    Moments::from_fn(|i, _| moments[i / 3][i % 3])
}

/// Weights of the present equilibrium and of the earlier ones.
type EquilibriumWeights = [f64; ORDER + 1];

/// Rotation vectors of earlier equilibria, latest first.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Predictor {
    earlier: Vec<Earlier>,
    /// Number of entries of `earlier` that are in use. The others are memory for later ones.
    known: usize,
}

/// Rotation vectors of an earlier equilibrium, on the present elements, and the moments of its
/// intrinsic strain.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Earlier {
    time: f64,
    moments: Moments,
    rotations: Vec<Vector3<f64>>,
}

impl Predictor {
    /// Copies `source` without new allocations if the capacity suffices.
    pub fn copy_from(&mut self, source: &Self) {
        self.known = source.known;
        self.earlier
            .resize_with(source.earlier.len(), Earlier::default);
        for (to, from) in self.earlier.iter_mut().zip(&source.earlier) {
            (to.time, to.moments) = (from.time, from.moments);
            to.rotations.clone_from(&from.rotations);
        }
    }

    /// Returns an error unless every earlier equilibrium has the given number of `rotations` and is
    /// usable for an extrapolation from `time` (s).
    pub fn check(&self, rotations: usize, time: f64, started: bool) -> Result<(), ParameterError> {
        let (name, size) = ("number of earlier equilibria", self.earlier.len());
        let ok = size == ORDER || size == 0 && !started;
        ParameterError::unless(
            ok,
            name,
            size as f64,
            "four in a run that has started, and zero or four before",
        )?;
        let (name, known) = ("number of earlier equilibria in use", self.known);
        ParameterError::unless(
            known <= size,
            name,
            known as f64,
            "at most the number of earlier equilibria",
        )?;
        let mut after = time;
        for (i, earlier) in self.earlier.iter().enumerate() {
            let (name, size) = (
                "number of rotation vectors of an earlier equilibrium",
                earlier.rotations.len(),
            );
            ParameterError::count(name, [size, rotations], "that of the rod")?;
            let square = earlier.rotations.iter().map(Vector3::norm_squared).sum();
            ParameterError::finite("sum of squared earlier rotations", square, "rad²")?;
            let moments = earlier.moments.norm_squared();
            ParameterError::finite(
                "sum of squared moments of the intrinsic strain",
                moments,
                "",
            )?;
            let ok = earlier.time.is_finite() && (i >= self.known || earlier.time < after);
            ParameterError::unless(
                ok,
                "time of an earlier equilibrium",
                earlier.time,
                "before that of the next (s)",
            )?;
            after = earlier.time;
        }
        Ok(())
    }

    /// Drops the earlier equilibria and allocates the memory for the following ones.
    pub fn allocate(&mut self, rod: &Rod, time: f64) {
        self.known = 0;
        self.earlier = vec![
            Earlier {
                time,
                moments: Moments::zeros(),
                rotations: rod.rotations.clone()
            };
            ORDER
        ];
    }

    /// Drops the earlier equilibria, after a discontinuity of the shape.
    pub fn forget(&mut self) {
        self.known = 0;
    }

    /// Rotation vectors of the rod before the last extrapolation; `None` if they were dropped.
    pub fn last(&self) -> Option<&[Vector3<f64>]> {
        let last = self.earlier.first().filter(|_| self.known > 0);
        last.map(|last| &last.rotations[..])
    }

    /// Restores the shape of the rod before the last extrapolation, and drops the equilibria before
    /// it.
    pub fn take_last(&mut self, rod: &mut Rod) {
        if let Some(last) = self.earlier.first().filter(|_| self.known > 0) {
            rod.rotations.clone_from(&last.rotations);
            rod.chain_frames();
            self.known = 0;
        }
    }

    /// Extrapolates the rotations of `rod` from time `from` (s) to time `to`, and keeps the present
    /// ones. The rod has the intrinsic strain at `to` already; `before` are the moments of that at
    /// `from`.
    pub fn extrapolate(&mut self, rod: &mut Rod, before: &Moments, from: f64, to: f64) {
        // The difference to an equilibrium that is very close in time would magnify the errors of
        // both.
        while self.known > 0 && from - self.earlier[0].time < CLOSE * (to - from) {
            self.earlier.rotate_left(1);
            self.known -= 1;
        }
        let weights = self.corrected(self.weights(rod, from, to), rod, before);
        for (i, rotation) in rod.rotations.iter_mut().enumerate() {
            let present = *rotation;
            *rotation = present * weights[0];
            for (earlier, weight) in self.earlier[..self.known].iter().zip(&weights[1..]) {
                *rotation += earlier.rotations[i] * *weight;
            }
            // The present equilibrium replaces the oldest one, which is no longer needed at this
            // point.
            if let Some(last) = self.earlier.last_mut() {
                last.rotations[i] = present;
            }
        }
        if let Some(last) = self.earlier.last_mut() {
            (last.time, last.moments) = (from, *before);
        }
        self.earlier.rotate_right(1);
        self.known = (self.known + 1).min(self.earlier.len());
        rod.chain_frames();
    }

    /// Returns the weights of an extrapolation in time. Its degree is increased as long as the next
    /// term, evaluated at the ends of the elements, is smaller than the one before. Higher terms
    /// diverge if the steps do not resolve the motion, or if the shoot collapses.
    fn weights(&self, rod: &Rod, from: f64, to: f64) -> EquilibriumWeights {
        let mut times = [from; ORDER + 1];
        for (time, earlier) in times[1..].iter_mut().zip(&self.earlier) {
            *time = earlier.time;
        }
        let p = rod.order().points();
        let (mut weights, mut last) = ([0.0; ORDER + 1], f64::INFINITY);
        weights[0] = 1.0;
        for degree in 0..self.known {
            let next: [f64; ORDER + 1] = lagrange(&times[..degree + 2], to);
            let mut size = 0.0_f64;
            for i in (p - 1..rod.rotations.len()).step_by(p) {
                let mut term = rod.rotations[i] * (next[0] - weights[0]);
                for (earlier, k) in self.earlier[..=degree].iter().zip(1..) {
                    term += earlier.rotations[i] * (next[k] - weights[k]);
                }
                size = size.max(term.norm_squared());
            }
            if !(size < last) {
                break;
            }
            (weights, last) = (next, size);
        }
        weights
    }

    /// Changes the weights so that the same combination of earlier intrinsic strains approximates
    /// the intrinsic strain of `rod`, in its moments (regularised least squares). Within a step the
    /// shape depends nearly linearly on the intrinsic strain. The effect of other causes is
    /// extrapolated by the given weights.
    fn corrected(
        &self,
        mut weights: EquilibriumWeights,
        rod: &Rod,
        before: &Moments,
    ) -> EquilibriumWeights {
        let mut missing = intrinsic_moments(rod) - before * weights[0];
        let mut differences = SMatrix::<f64, 9, ORDER>::zeros();
        for (k, earlier) in self.earlier[..self.known].iter().enumerate() {
            missing -= earlier.moments * weights[k + 1];
            differences.set_column(k, &(earlier.moments - before));
        }
        let mut normal = differences.tr_mul(&differences);
        let ridge = RIDGE * normal.trace() + f64::MIN_POSITIVE;
        (0..ORDER).for_each(|k| normal[(k, k)] += ridge);
        if let Some(factors) = normal.cholesky() {
            let change = factors.solve(&differences.tr_mul(&missing));
            // Large weights show that other causes than the intrinsic strain change the shape.
            if change.abs().sum() <= LARGEST_CHANGE {
                weights[0] -= change.sum();
                weights[1..]
                    .iter_mut()
                    .zip(&change)
                    .for_each(|(weight, change)| *weight += change);
            }
        }
        weights
    }

    /// Divides element `e` of `rod` at its coordinate `x`, in every earlier equilibrium.
    pub fn split(&mut self, rod: &Rod, e: usize, x: f64) {
        let split = split_rotations(rod.reference(), e, x);
        self.earlier
            .iter_mut()
            .for_each(|earlier| split(&mut earlier.rotations));
    }

    /// Merges elements `e` and `e` + 1 in every earlier equilibrium. `share` is the fraction of
    /// their length that element `e` has.
    pub fn merge(&mut self, rod: &Rod, e: usize, share: f64) {
        let merge = merge_rotations(rod.reference(), e, share);
        self.earlier
            .iter_mut()
            .for_each(|earlier| merge(&mut earlier.rotations));
    }
}
