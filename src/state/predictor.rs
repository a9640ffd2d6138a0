//! The first guess of an equilibrium: extrapolated in time from the last ones, and corrected by what the intrinsic strain has
//! become since, which is known beforehand.

use nalgebra::{SMatrix, SVector, Vector3};

use super::CLOSE;
use super::error::StateError;
use crate::numerics::interpolation::lagrange;
use crate::rod::{Rod, merge_rotations, split_rotations};

/// How many equilibria before the last are kept. What a polynomial in time through them does not foresee, as an oscillation in a few
/// steps, the intrinsic strain tells: at steps of up to a quarter of an oscillator's period one Newton iteration does.
const EARLIER: usize = 4;
/// Combinations of the intrinsic strains that are smaller than this, by its square relative to all, are hardly used: what they leave
/// out would be magnified.
const RIDGE: f64 = 1e-5;

/// The weights are changed by no more than this, in sum: an oscillation in four steps takes up to eight. A load that rises from nothing
/// makes intrinsic strains that grow by orders of magnitude in a step, with shapes that do not follow them.
const LARGEST_CHANGE: f64 = 10.0;

/// The moments of a rod's intrinsic strain, of degree 0, 1 and 2 in the distance from the apex over the length, rad.
pub(crate) type Moments = SVector<f64, 9>;

/// The moments of the intrinsic strain of a rod.
pub(crate) fn intrinsic_moments(rod: &Rod) -> Moments {
    let (reference, length) = (rod.reference(), rod.length());
    let mut moments = [Vector3::zeros(); 3];
    for element in rod.points().chunks_exact(reference.p) {
        for (point, weight) in element.iter().zip(&reference.weights) {
            let (part, x) = (point.intrinsic * (weight * point.jacobian), point.apex_distance / length);
            moments[0] += part;
            moments[1] += part * x;
            moments[2] += part * (x * x);
        }
    }
    Moments::from_fn(|i, _| moments[i / 3][i % 3])
}

/// Weights of the present equilibrium and the earlier ones.
type Weights = [f64; EARLIER + 1];

/// The rotation vectors of earlier equilibria, latest first.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Predictor {
    earlier: Vec<Earlier>,
    /// How many of them there are; the rest is room.
    known: usize,
}

/// The rotation vectors of an earlier equilibrium, on the present elements, and the moments of its intrinsic strain.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Earlier {
    time: f64,
    moments: Moments,
    rotations: Vec<Vector3<f64>>,
}

impl Predictor {
    /// Becomes equal to `source` without new allocations, if there is room.
    pub fn copy_from(&mut self, source: &Self) {
        self.known = source.known;
        self.earlier.resize_with(source.earlier.len(), Earlier::default);
        for (to, from) in self.earlier.iter_mut().zip(&source.earlier) {
            (to.time, to.moments) = (from.time, from.moments);
            to.rotations.clone_from(&from.rotations);
        }
    }

    /// Refuses equilibria of which each has not so many `rotations`, or from which one cannot extrapolate at `time` (s).
    pub fn check(&self, rotations: usize, time: f64, started: bool) -> Result<(), StateError> {
        if started || !self.earlier.is_empty() {
            StateError::size("earlier equilibria", self.earlier.len(), EARLIER)?;
        }
        if self.known > self.earlier.len() {
            return StateError::size("earlier equilibria", self.earlier.len(), self.known);
        }
        let mut after = time;
        for (i, earlier) in self.earlier.iter().enumerate() {
            StateError::size("rotation vectors in an earlier equilibrium", earlier.rotations.len(), rotations)?;
            let (what, square) =
                ("sum of squared earlier rotations", earlier.rotations.iter().map(Vector3::norm_squared).sum());
            StateError::unless(f64::is_finite(square), what, square, "finite")?;
            let (what, square) = ("sum of squared moments of the intrinsic strain", earlier.moments.norm_squared());
            StateError::unless(square.is_finite(), what, square, "finite")?;
            let before = i >= self.known || earlier.time < after;
            let ok = before && earlier.time.is_finite();
            StateError::unless(ok, "time of an earlier equilibrium", earlier.time, "before that of the next (s)")?;
            after = earlier.time;
        }
        Ok(())
    }

    /// Forgets earlier equilibria and makes room for as many as are extrapolated from.
    pub fn make_room(&mut self, rod: &Rod, time: f64) {
        self.known = 0;
        self.earlier.clear();
        let room = || Earlier { time, moments: Moments::zeros(), rotations: rod.rotations().to_vec() };
        self.earlier.extend((0..EARLIER).map(|_| room()));
    }

    /// Forgets earlier equilibria: the shape has jumped since.
    pub fn forget(&mut self) {
        self.known = 0;
    }

    /// Gives the rod the shape that it had before it was extrapolated, and forgets those before.
    pub fn take_last(&mut self, rod: &mut Rod) {
        if let Some(last) = self.earlier.first().filter(|_| self.known > 0) {
            rod.shape_mut().1.copy_from_slice(&last.rotations);
            rod.chain_frames();
            self.known = 0;
        }
    }

    /// Keeps the present rotations of `rod`, at time `from` (s), and extrapolates them to time `to`, at which it has its intrinsic
    /// strain already; `before` were the moments of that.
    pub fn extrapolate(&mut self, rod: &mut Rod, before: &Moments, from: f64, to: f64) {
        // An equilibrium that is all but the present one says nothing of the motion.
        while self.known > 0 && from - self.earlier[0].time < CLOSE * (to - from) {
            self.earlier.rotate_left(1);
            self.known -= 1;
        }
        let weights = self.corrected(self.weights(rod, from, to), rod, before);
        for (i, rotation) in rod.shape_mut().1.iter_mut().enumerate() {
            let present = *rotation;
            *rotation = present * weights[0];
            for (earlier, weight) in self.earlier[..self.known].iter().zip(&weights[1..]) {
                *rotation += earlier.rotations[i] * *weight;
            }
            // The oldest is no longer needed: the present takes its place.
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

    /// The weights of the present and the earlier equilibria, of the degree in time up to which each further term of the
    /// extrapolation, at the ends of the elements, is smaller than the one before it. Where steps are long against what moves the
    /// shoot, or a shoot collapses, higher terms only lead astray.
    fn weights(&self, rod: &Rod, from: f64, to: f64) -> Weights {
        let mut times = [from; EARLIER + 1];
        for (time, earlier) in times[1..].iter_mut().zip(&self.earlier) {
            *time = earlier.time;
        }
        let p = rod.order().points();
        let (mut degree, mut weights, mut last) = (0, [0.0; EARLIER + 1], f64::INFINITY);
        weights[0] = 1.0;
        while degree < self.known {
            let mut next = [0.0; EARLIER + 1];
            lagrange(&times[..degree + 2], to, &mut next[..degree + 2]);
            let mut size = 0.0_f64;
            for i in (p - 1..rod.rotations().len()).step_by(p) {
                let mut term = rod.rotations()[i] * (next[0] - weights[0]);
                for (earlier, k) in self.earlier[..=degree].iter().zip(1..) {
                    term += earlier.rotations[i] * (next[k] - weights[k]);
                }
                size = size.max(term.norm_squared());
            }
            if !(size < last) {
                break;
            }
            (degree, weights, last) = (degree + 1, next, size);
        }
        weights
    }

    /// Changes the weights so that the same sum of intrinsic strains comes near to the one that `rod` has, in its moments: shapes
    /// follow the intrinsic strain all but linearly in a step, and what else acts is left to the weights as they were.
    fn corrected(&self, mut weights: Weights, rod: &Rod, before: &Moments) -> Weights {
        let (mut missing, mut differences) =
            (intrinsic_moments(rod) - before * weights[0], SMatrix::<f64, 9, EARLIER>::zeros());
        for (k, earlier) in self.earlier[..self.known].iter().enumerate() {
            missing -= earlier.moments * weights[k + 1];
            differences.set_column(k, &(earlier.moments - before));
        }
        let mut normal = differences.tr_mul(&differences);
        let ridge = RIDGE * normal.trace() + f64::MIN_POSITIVE;
        (0..EARLIER).for_each(|k| normal[(k, k)] += ridge);
        if let Some(factors) = normal.cholesky() {
            let change = factors.solve(&differences.tr_mul(&missing));
            // Large weights mean that other causes than the intrinsic strain change the shape.
            if change.abs().sum() <= LARGEST_CHANGE {
                weights[0] -= change.sum();
                weights[1..].iter_mut().zip(&change).for_each(|(weight, change)| *weight += change);
            }
        }
        weights
    }

    /// Cuts element `e` of `rod` at its coordinate `x`, in every equilibrium.
    pub fn split(&mut self, rod: &Rod, e: usize, x: f64) {
        for earlier in &mut self.earlier {
            split_rotations(rod.reference(), &mut earlier.rotations, e, x);
        }
    }

    /// Makes elements `e` and `e` + 1 one, of which the first is a `share`, in every equilibrium.
    pub fn merge(&mut self, rod: &Rod, e: usize, share: f64) {
        for earlier in &mut self.earlier {
            merge_rotations(rod.reference(), &mut earlier.rotations, e, share);
        }
    }
}
