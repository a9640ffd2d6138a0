//! Initial shapes: a straight rod between holds, and directions that leave a saddle of the energy.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::inertia::Bordered;
use super::linear::{Conditions, Linear, Role};
use super::search::HeldSearch;
use super::settings;
use super::sites::bend;
use super::trial::{Merit, Start};
use crate::equilibrium::elimination::Row;
use crate::rod::Rod;
use crate::so3;

/// Smallest flexibility of a hold, relative to the largest, with which it moves to first order.
const STRAIGHT: f64 = 1e-6;
/// Smallest rotation by which the rod leaves a saddle, relative to the largest one. Where a tip is
/// about to slip off a pole, the energy decreases only within about a hundredth of it.
const LEAST_LEAVING: f64 = 1e-3;

impl HeldSearch<'_> {
    /// The distance (m) by which a hold or a contact is violated along a rod that is too straight
    /// to move there: a straight rod between two holds, or one that grows against an obstacle.
    pub(super) fn missing_along_straight(&self, linear: &Linear) -> Option<f64> {
        let contacts = self.candidates.iter().enumerate().filter_map(|(i, at)| {
            let missing = -at.gap.value;
            if !(missing > settings::ROUNDING * self.length) {
                return None;
            }
            let first = linear.response.first(self.sites.len() + i) - linear.first;
            let compliance = linear
                .compliance
                .fixed_view::<3, 3>(first, first)
                .into_owned();
            let (n, eigen) = (at.gap.normal, compliance.symmetric_eigen());
            // A rod that only its contacts hold has negative eigenvalues, and is not rigid in these
            // directions.
            let stiffest = eigen
                .eigenvectors
                .column(eigen.eigenvalues.iamin())
                .into_owned();
            // With friction the force may act along the rod although the obstacle is inclined to
            // it.
            let jams = stiffest.cross(&n).norm()
                <= self.obstacles.contacts[at.obstacle].friction * stiffest.dot(&n).abs();
            let along = if jams {
                eigen.eigenvalues.amin()
            } else {
                n.dot(&(compliance * n)).abs()
            };
            // A rod that is bent by a small angle yields along itself by the square of the angle.
            (along * self.length < missing * compliance.trace()).then_some(missing)
        });
        let holds = self.is_straight(linear).then(|| linear.residuals.amax());
        contacts.chain(holds).reduce(f64::max)
    }

    /// Whether the rod cannot move in a direction in which a hold has to move, to first order: a
    /// straight rod between two holds.
    fn is_straight(&self, linear: &Linear) -> bool {
        // A free base does not count as flexible if it is held.
        let free = self.body.system().joints.free_base;
        let anchor = free.and_then(|_| {
            self.sites
                .iter()
                .find(|site| site.node == 0 && !site.fixed.is_empty())
        });
        if free.is_some() && anchor.is_none() {
            return false;
        }
        let moves = anchor.map_or_else(Vector3::zeros, |site| site.position - site.target);
        let translates = free.map_or(0.0, |base| 1.0 / base.stiffness);
        let flexible = |i: usize| linear.flexibility(i) - translates;
        let largest = (0..linear.roles.len()).map(flexible).fold(0.0, f64::max);
        let each = linear.roles.iter().zip(linear.residuals.iter()).enumerate();
        let rigid = |(i, (role, missing)): (usize, (&Role, &f64))| {
            let Role::Hold(site, direction) = role else {
                return false;
            };
            let missing = missing - direction.dot(&moves);
            self.sites[*site].node > 0
                && missing.abs() > settings::ROUNDING * self.length
                && flexible(i) < STRAIGHT * largest
        };
        each.into_iter().any(rigid)
    }

    /// Bends a straight rod at the start of a step by up to `angle` (rad), so that no part of it
    /// passes an obstacle.
    pub(super) fn bow_safely(&mut self, rod: &mut Rod, start: &Start, angle: f64) {
        self.bow(rod, angle);
        self.locate(rod);
        let factor = self.safe_step_factor(rod, start);
        if factor < 1.0 {
            start.shape.restore(rod);
            self.bow(rod, angle * factor);
            self.locate(rod);
        }
    }

    /// Bends a straight rod by up to `angle` (rad) towards its load, or towards d1 without one.
    fn bow(&mut self, rod: &mut Rod, angle: f64) {
        let chord = (rod.tip() - rod.base_position()) / self.length;
        let tangent = chord
            .try_normalize(1e-6)
            .unwrap_or_else(|| rod.frames()[0] * Vector3::z());
        let load = self.body.force().load_at_base();
        let side = load - tangent * tangent.dot(&load);
        let side = side
            .try_normalize(1e-9 * load.norm())
            .unwrap_or_else(|| rod.frames()[0] * Vector3::x());
        let axis = tangent.cross(&side);
        let (old, places) = (rod.clone(), rod.ends());
        bend(rod, |e, x| {
            let s = places[e] + x * (places[e + 1] - places[e]);
            so3::exp(&(axis * (angle * (TAU * s / self.length).sin()))) * old.frame_within(e, x)
        });
    }

    /// Moves the rod from the start of a step along the softest direction that the supports permit,
    /// so far that no part of it passes an obstacle.
    pub(super) fn leave_saddle(
        &mut self,
        rod: &mut Rod,
        start: &Start,
        linear: &Linear,
        number: usize,
    ) {
        // Inverse iteration with the shifted tangent and the conditions of supports, from rotations
        // about an axis.
        let Bordered {
            rows,
            matrix,
            scale,
            ..
        } = self.bordered(linear);
        let conditions = Conditions::new(&matrix, scale);
        let axis = Vector3::ith([1, 0, 2, 1][number % 4], 1.0);
        let count = self.body.system().turns.len();
        let mut turns: Vec<Vector3<f64>> = (0..count)
            .map(|i| axis * (i as f64 / count as f64 + 0.3).sin())
            .collect();
        for _ in 0..settings::SOFTENINGS {
            let largest = turns.iter().map(Vector3::norm).fold(0.0, f64::max);
            let system = self.body.system_mut();
            system
                .elements
                .iter_mut()
                .for_each(|element| element.condensed = Row::default());
            system.base_force = Vector3::zeros();
            for (e, (to, turn)) in system.couples.iter_mut().zip(&turns).enumerate() {
                let length = if e > 0 { rod.length_of(e - 1) } else { 0.0 };
                *to = turn * (length / largest);
            }
            system.joints.confine(&mut system.couples);
            let free = linear.response.free(system);
            let reactions = rows.tr_mul(&conditions.solve(&(&rows * free)));
            linear.response.load(system, &reactions);
            self.body.system_mut().solve();
            turns.clone_from(&self.body.system().turns);
        }
        self.body.system_mut().start.keep(rod);
        let fraction = settings::SADDLE_TURN / self.body.system().largest_turn();
        // The supports may permit no motion.
        if !fraction.is_finite() {
            return;
        }
        let fraction = self.descending(rod, start, fraction);
        self.leave_by(rod, start, fraction);
        let factor = self.safe_step_factor(rod, start);
        if factor < 1.0 {
            self.leave_by(rod, start, fraction * factor);
        }
    }

    /// Returns the first fraction of the step of the system with which the sum of energy and
    /// weighted violations decreases. Each fraction is tried with both signs, and the next one is a
    /// quarter of it. If the sum decreases with no fraction, the longest one is returned, with the
    /// sign of the smaller sum: an obstacle may be on the other side of the saddle.
    fn descending(&mut self, rod: &mut Rod, start: &Start, longest: f64) -> f64 {
        let weight = self.weight.max(self.force_scale());
        let mut value = |search: &mut Self, fraction: f64| {
            search.leave_by(rod, start, fraction);
            let energy = search.body.evaluate(rod);
            search.found.evaluations += 1;
            let value = search.potential(rod, energy) + weight * search.violation();
            if value.is_nan() { f64::INFINITY } else { value }
        };
        let Merit {
            energy, violation, ..
        } = start.merit;
        let slack = self.rounding_of(energy);
        let (before, mut fraction, mut first) = (energy + weight * violation, longest, None);
        while fraction.abs() > LEAST_LEAVING * longest.abs() {
            let [ahead, behind] = [fraction, -fraction].map(|fraction| value(self, fraction));
            let signed = if behind < ahead - slack {
                -fraction
            } else {
                fraction
            };
            if ahead.min(behind) < before - slack {
                return signed;
            }
            first.get_or_insert(signed);
            fraction *= 0.25;
        }
        first.unwrap_or(longest)
    }

    /// Moves the rod from the start of a step by a fraction of the step of the system.
    fn leave_by(&mut self, rod: &mut Rod, start: &Start, fraction: f64) {
        start.shape.restore(rod);
        self.body.system().advance(rod, fraction);
        self.locate(rod);
    }
}
