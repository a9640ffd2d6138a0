//! Initial shapes: a straight rod between holds, and directions that leave a saddle of the energy.

use nalgebra::Vector3;

use super::conditions::{Conditions, Role};
use super::data::HeldSearch;
use super::dense::Dense;
use super::response::RESTORED;
use crate::constitutive::Constitutive;
use crate::load::Load;
use crate::rod::Rod;
use crate::so3;

/// Number of inverse iterations for the softest direction. An approximate direction is sufficient.
const SOFTENINGS: usize = 12;
/// Largest rotation by which a saddle is left, rad.
const PUSH: f64 = 0.1;
/// Smallest flexibility of a hold, relative to the largest, with which it moves to first order.
const STRAIGHT: f64 = 1e-6;

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Whether the rod cannot move in a direction in which a hold has to move, to first order: a straight rod between
    /// two holds.
    pub(super) fn is_straight(&self, conditions: &Conditions) -> bool {
        let flexible = |i: usize| self.border.gram[(i, i)].abs();
        // A rod that stretches moves in its own direction.
        let inextensible = |i: usize| self.border.yields[(i, i)] == 0.0;
        let largest = (0..conditions.roles.len()).map(flexible).fold(0.0, f64::max);
        let each = conditions.roles.iter().zip(&conditions.residuals).enumerate();
        let rigid = |(i, (role, missing)): (usize, (&Role, &f64))| {
            let rigid = flexible(i) < STRAIGHT * largest && inextensible(i);
            // A contact may lose its obstacle where a rod bends by a large angle.
            let held = matches!(role, Role::Fixed(site, _) if self.sites[*site].touch.is_none());
            held && missing.abs() > RESTORED * self.length && rigid
        };
        each.into_iter().any(rigid)
    }

    /// Bends a straight rod by up to `angle` (rad) towards its load, or towards d1 without one.
    pub(super) fn bow(&mut self, rod: &mut Rod, angle: f64) {
        let tangent = (rod.tip() / self.length).try_normalize(1e-6).unwrap_or_else(|| rod.frames()[0] * Vector3::z());
        let load = self.force.load_at_base();
        let side = load - tangent * tangent.dot(&load);
        let side = side.try_normalize(1e-9 * load.norm()).unwrap_or_else(|| rod.frames()[0] * Vector3::x());
        let axis = tangent.cross(&side);
        let (length, mut at) = (self.length, 0.0);
        let places: Vec<f64> = (0..=rod.elements())
            .map(|e| {
                let s = at;
                at += if e < rod.elements() { rod.length_of(e) } else { 0.0 };
                s
            })
            .collect();
        let old = rod.clone();
        let (p, reference) = (P, rod.reference());
        let moved = |e: usize, x: f64| {
            let s = places[e] + x * (places[e + 1] - places[e]);
            so3::exp(&(axis * (angle * (std::f64::consts::TAU * s / length).sin()))) * old.frame_within(e, x)
        };
        let (_, rotations) = rod.shape_mut();
        for e in 0..old.elements() {
            let start = moved(e, 0.0).inverse();
            for k in 0..p {
                rotations[e * p + k] = so3::log(&(start * moved(e, reference.nodes[k + 1])));
            }
        }
        rod.chain_frames();
    }

    /// Moves the rod along the softest direction that the supports permit.
    pub(super) fn leave_saddle(&mut self, rod: &mut Rod, conditions: &Conditions, dense: &Dense, number: usize) {
        // Inverse iteration with the shifted tangent, from rotations about an axis.
        let axis = Vector3::ith([1, 0, 2, 1][number % 4], 1.0);
        let count = self.system.turns.len();
        let mut turns: Vec<Vector3<f64>> = (0..count).map(|i| axis * (i as f64 / count as f64 + 0.3).sin()).collect();
        let still = Conditions { residuals: vec![0.0; conditions.residuals.len()], ..conditions.clone() };
        for _ in 0..SOFTENINGS {
            let largest = turns.iter().map(Vector3::norm).fold(0.0, f64::max);
            for element in &mut self.system.elements {
                element.clear_gradient();
            }
            for (e, (to, turn)) in self.system.turns.iter_mut().zip(&turns).enumerate() {
                let length = if e > 0 { rod.length_of(e - 1) } else { 0.0 };
                *to = turn * (length / largest);
            }
            self.system.joints.confine(&mut self.system.turns);
            self.respond(&still, dense);
            turns.clone_from(&self.system.turns);
        }
        self.system.start.keep(rod);
        let fraction = PUSH / self.system.largest_turn();
        self.system.advance::<P>(rod, fraction);
    }
}
