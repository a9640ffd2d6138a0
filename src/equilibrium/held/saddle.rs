//! Initial shapes: a straight rod between holds, and directions that leave a saddle of the energy.

use std::cell::LazyCell;
use std::f64::consts::TAU;

use nalgebra::{DVector, Vector3};

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
/// Number of places at which the deflection of a linear rod is evaluated.
const DEFLECTIONS: usize = 64;
/// Largest deflection, relative to the length and the distance from the origin, that is rounding of
/// differences of positions.
const DEFLECTED: f64 = 8.0 * f64::EPSILON;
/// Largest ratio of the mean deflection to the largest one of a deflection to both sides.
const ODD: f64 = 1e-3;

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
        contacts
            .chain(self.rigid_violation(linear))
            .reduce(f64::max)
    }

    /// The distance (m) by which a hold is violated in a direction in which the rod cannot move to
    /// first order: a straight rod between two holds.
    fn rigid_violation(&self, linear: &Linear) -> Option<f64> {
        // A free base does not count as flexible if it is held.
        let free = self.body.system().joints.free_base;
        let anchor = free.and_then(|_| {
            self.sites
                .iter()
                .find(|site| site.node == 0 && !site.fixed.is_empty())
        });
        if free.is_some() && anchor.is_none() {
            return None;
        }
        let moves = anchor.map_or_else(Vector3::zeros, |site| site.position - site.target);
        let translates = free.map_or(0.0, |base| 1.0 / base.stiffness);
        // In a neutral direction of a bent rod the terms cancel each other.
        let flexible = |i: usize| linear.terms[i] - translates;
        // The largest flexibility of a held place may be in a direction in which it is free.
        let largest = LazyCell::new(|| {
            let response = &linear.response;
            let held = (0..self.sites.len()).filter(|i| !self.sites[*i].fixed.is_empty());
            let coordinates = held.flat_map(|i| 3 * i..3 * i + 3);
            let terms =
                coordinates.map(|i| response.terms(&[(i, 1.0)], response.compliance[(i, i)]));
            terms.fold(0.0, f64::max) - translates
        });
        let each = linear.roles.iter().zip(linear.residuals.iter()).enumerate();
        let rigid = |(i, (role, missing)): (usize, (&Role, &f64))| {
            let Role::Hold(site, direction) = role else {
                return None;
            };
            let missing = (missing - direction.dot(&moves)).abs();
            let rigid = self.sites[*site].node > 0
                && missing > settings::ROUNDING * self.length
                && flexible(i) < STRAIGHT * *largest;
            rigid.then_some(missing)
        };
        each.filter_map(rigid).reduce(f64::max)
    }

    /// Bends a straight rod at the start of a step by up to `angle` (rad), so that no part of it
    /// passes an obstacle.
    pub(super) fn bow_safely(&mut self, rod: &mut Rod, start: &Start, linear: &Linear, angle: f64) {
        let side = self.side(rod, linear);
        self.bow(rod, &side, angle);
        self.locate(rod);
        let factor = self.safe_step_factor(rod, start);
        if factor < 1.0 {
            start.shape.restore(rod);
            self.bow(rod, &side, angle * factor);
            self.locate(rod);
        }
    }

    /// The direction from its base to its apex, or that of its base if they coincide.
    fn chord_direction(&self, rod: &Rod) -> Vector3<f64> {
        let chord = (rod.tip() - rod.base_position()) / self.length;
        chord
            .try_normalize(1e-6)
            .unwrap_or_else(|| rod.frames()[0] * Vector3::z())
    }

    /// The side to which a straight rod bends: that of its deflection from the chord in the step of
    /// the linear rod. The branch of equilibria on this side begins at the straight rod and is
    /// stable at first, whereas that on the other side begins at a larger force. A deflection to
    /// both sides, as between parallel clamps, does not distinguish them, and the rod has less
    /// energy if it bends out of the plane of the deflection. If the linear rod has no deflection,
    /// all sides with the same stiffness are equal, and the rod bends towards its load, or towards
    /// d1 without one.
    fn side(&mut self, rod: &Rod, linear: &Linear) -> Vector3<f64> {
        let tangent = self.chord_direction(rod);
        let across = |v: Vector3<f64>| v - tangent * tangent.dot(&v);
        let load = self.body.force().load_at_base();
        let by_load = || {
            across(load)
                .try_normalize(1e-9 * load.norm())
                .unwrap_or_else(|| rod.frames()[0] * Vector3::x())
        };
        if !self.candidates.is_empty() {
            return by_load();
        }
        let nothing = DVector::zeros(linear.response.size());
        let links = linear.links_by(&nothing, &DVector::zeros(linear.size));
        let reactions = linear.reactions(&DVector::zeros(linear.size), &links);
        linear.response.load(self.body.system_mut(), &reactions);
        let system = self.body.system_mut();
        system.solve();
        system.start.keep(rod);
        let mut moved = rod.clone();
        let fraction = (settings::SADDLE_TURN / system.largest_turn()).min(1.0);
        system.advance(&mut moved, fraction);
        let deviations = |rod: &Rod| -> Vec<Vector3<f64>> {
            let (tip, base) = (rod.tip(), rod.base_position());
            let places = rod.centre_line_at(DEFLECTIONS + 1);
            let share = |k: usize| k as f64 / DEFLECTIONS as f64;
            let each = places.iter().enumerate();
            each.map(|(k, place)| across(place - base - (tip - base) * share(k)))
                .collect()
        };
        let (before, after) = (deviations(rod), deviations(&moved));
        let deflections = before.iter().zip(&after).map(|(a, b)| b - a);
        let mean: Vector3<f64> = deflections.clone().sum::<Vector3<f64>>() / DEFLECTIONS as f64;
        let largest = deflections
            .max_by(|a, b| a.norm().total_cmp(&b.norm()))
            .unwrap_or_default();
        let rounding = DEFLECTED * (self.length + rod.base_position().norm());
        if !(largest.norm() > rounding && largest.norm().is_finite()) {
            return by_load();
        }
        let side = if mean.norm() > ODD * largest.norm() {
            mean
        } else {
            tangent.cross(&largest)
        };
        side.normalize()
    }

    /// Bends a straight rod by up to `angle` (rad) towards a side.
    fn bow(&mut self, rod: &mut Rod, side: &Vector3<f64>, angle: f64) {
        let axis = self.chord_direction(rod).cross(side);
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
