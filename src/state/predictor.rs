//! The first guess of an equilibrium, extrapolated in time from the last ones.

use nalgebra::Vector3;

use super::CLOSE;
use super::error::StateError;
use crate::quadrature::lagrange;
use crate::rod::{Rod, merge_rotations, split_rotations};

/// How many equilibria before the last are kept. A first guess of fifth degree in time leaves so little, at steps of up to a
/// twelfth of an oscillator's period, that one Newton iteration proves its answer stable.
const EARLIER: usize = 5;

/// Of the present equilibrium and the earlier ones.
type Weights = [f64; EARLIER + 1];

/// The rotation vectors of earlier equilibria, latest first.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Predictor {
    earlier: Vec<Earlier>,
    /// How many of them there are; the rest is room.
    known: usize,
}

/// The rotation vectors of an earlier equilibrium, on the present elements.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Earlier {
    time: f64,
    rotations: Vec<Vector3<f64>>,
}

impl Predictor {
    /// Becomes equal to `source` without new allocations, if there is room.
    pub fn copy_from(&mut self, source: &Self) {
        self.known = source.known;
        self.earlier.resize_with(source.earlier.len(), Earlier::default);
        for (to, from) in self.earlier.iter_mut().zip(&source.earlier) {
            to.time = from.time;
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
        let room = || Earlier { time, rotations: rod.rotations.clone() };
        self.earlier.extend((0..EARLIER).map(|_| room()));
    }

    /// Forgets earlier equilibria: the shape has jumped since.
    pub fn forget(&mut self) {
        self.known = 0;
    }

    /// Keeps the present rotations of `rod`, at time `from` (s), and extrapolates them to time `to`.
    pub fn extrapolate(&mut self, rod: &mut Rod, from: f64, to: f64) {
        // An equilibrium that is all but the present one says nothing of the motion.
        while self.known > 0 && from - self.earlier[0].time < CLOSE * (to - from) {
            self.earlier.rotate_left(1);
            self.known -= 1;
        }
        let (degree, weights) = self.degree(rod, from, to);
        for (i, rotation) in rod.rotations.iter_mut().enumerate() {
            let present = *rotation;
            *rotation = present * weights[0];
            for (earlier, weight) in self.earlier[..degree].iter().zip(&weights[1..]) {
                *rotation += earlier.rotations[i] * *weight;
            }
            // The oldest is no longer needed: the present takes its place.
            if let Some(last) = self.earlier.last_mut() {
                last.rotations[i] = present;
            }
        }
        if let Some(last) = self.earlier.last_mut() {
            last.time = from;
        }
        self.earlier.rotate_right(1);
        self.known = (self.known + 1).min(self.earlier.len());
        rod.chain_frames();
    }

    /// The degree in time up to which each further term of the extrapolation, at the ends of the elements, is smaller than the one
    /// before it, and the weights of the present and the earlier equilibria. Where steps are long against what moves the shoot, or a
    /// shoot collapses, higher terms only lead astray.
    fn degree(&self, rod: &Rod, from: f64, to: f64) -> (usize, Weights) {
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
            (degree, weights, last) = (degree + 1, next, size);
        }
        (degree, weights)
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
