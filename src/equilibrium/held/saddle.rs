//! Initial shapes: a straight rod between holds, and directions that leave a saddle of the energy.

use nalgebra::{DVector, Vector3};

use super::inertia::Bordered;
use super::linear::{Conditions, Linear, Role, along};
use super::search::HeldSearch;
use super::settings;
use super::sites::{HeldSite, across};
use super::trial::{Merit, Start};
use crate::equilibrium::elimination::Row;
use crate::rod::Rod;

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
        let base = self.held_free_base();
        let moves = base.map_or_else(Vector3::zeros, |site| site.position - site.target);
        let missing = |i: usize| match linear.roles[i] {
            Role::Hold(_, direction) => (linear.residuals[i] - direction.dot(&moves)).abs(),
            _ => 0.0,
        };
        let violated = |i: &usize| missing(*i) > settings::ROUNDING * self.length;
        if !(0..linear.roles.len()).any(|i| violated(&i)) {
            return None;
        }
        let rigid = self.rigid_conditions(linear).into_iter();
        rigid.filter(violated).map(missing).reduce(f64::max)
    }

    /// The hold of a base that is free otherwise.
    fn held_free_base(&self) -> Option<&HeldSite> {
        self.body.system().joints.free_base?;
        let holds = |site: &&HeldSite| site.node == 0 && !site.fixed.is_empty();
        self.sites.iter().find(holds)
    }

    /// The conditions of holds along which the rod cannot move to first order. A free base does not
    /// count as flexible if it is held.
    fn rigid_conditions(&self, linear: &Linear) -> Vec<usize> {
        let free = self.body.system().joints.free_base;
        if free.is_some() && self.held_free_base().is_none() {
            return Vec::new();
        }
        let translates = free.map_or(0.0, |base| 1.0 / base.stiffness);
        let response = &linear.response;
        // The largest flexibility of a held place may be in a direction in which it is free.
        let held = (0..self.sites.len()).filter(|i| !self.sites[*i].fixed.is_empty());
        let terms = held
            .flat_map(|i| 3 * i..3 * i + 3)
            .map(|i| response.terms(&[(i, 1.0)], response.compliance[(i, i)]));
        let largest = terms.fold(0.0, f64::max) - translates;
        // In a neutral direction of a bent rod the terms cancel each other.
        let is_rigid = |i: &usize| match linear.roles[*i] {
            Role::Hold(site, _) => {
                self.sites[site].node > 0 && linear.terms[*i] - translates < STRAIGHT * largest
            }
            _ => false,
        };
        (0..linear.roles.len()).filter(is_rigid).collect()
    }

    /// Bends a straight rod, which is too long by `missing` (m), at the start of a step: in the mode
    /// in which it buckles, with the amplitude at which it fits, and so that no part of it passes an
    /// obstacle. The modes are those with the least ∫ B θ'² ds for a given shortening ½ ∫ θ² ds.
    pub(super) fn bow(&mut self, rod: &mut Rod, start: &Start, linear: &Linear, missing: f64) {
        let axis = self.chord_direction(rod).cross(&self.side(rod, linear));
        let turns = rod.frames().iter().zip(self.profile());
        let turns = turns
            .map(|(frame, factor)| frame.inverse() * axis * factor)
            .collect();
        let mut rows = self.conditions(linear);
        for i in self.rigid_conditions(linear).into_iter().rev() {
            rows.remove(i);
        }
        // Friction holds the place that is pressed against an obstacle.
        for (i, at) in self.candidates.iter().enumerate() {
            let sticks = self.obstacles.contacts[at.obstacle].friction > 0.0;
            if sticks && -at.gap.value > settings::ROUNDING * self.length {
                let first = linear.response.first(self.sites.len() + i);
                for side in across(&at.gap.normal) {
                    rows.push(along(first, &side), 0.0);
                }
            }
        }
        // Only bending shortens the rod. Its twist may be softer.
        let bending = Vector3::new(1.0, 1.0, 0.0);
        self.soften(rod, linear, (turns, bending), Bordered::new(linear, rows));
        // The shortening, and the mean deflection towards the side.
        let (mut shortening, mut deflection, mut rest) = (0.0, 0.0, self.length);
        let turns = &self.body.system().turns;
        for (e, (turns, frames)) in turns.windows(2).zip(rod.frames().windows(2)).enumerate() {
            let length = rod.length_of(e);
            let squares = turns[0].xy().norm_squared() + turns[1].xy().norm_squared();
            let slopes = axis.dot(&(frames[0] * turns[0] + frames[1] * turns[1]));
            shortening += 0.25 * length * squares;
            deflection += 0.5 * length * slopes * (rest - 0.5 * length);
            rest -= length;
        }
        self.body.system_mut().start.keep(rod);
        let fraction = (missing / shortening).sqrt().copysign(deflection);
        // The supports may permit no motion.
        if fraction.is_finite() {
            self.leave_safely(rod, start, fraction);
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

    /// Moves the rod from the start of a step along the softest direction that the supports permit,
    /// so far that no part of it passes an obstacle.
    pub(super) fn leave_saddle(
        &mut self,
        rod: &mut Rod,
        start: &Start,
        linear: &Linear,
        number: usize,
    ) {
        let axis = Vector3::ith([1, 0, 2, 1][number % 4], 1.0);
        let turns = self.profile().map(|factor| axis * factor).collect();
        let all = Vector3::repeat(1.0);
        self.soften(rod, linear, (turns, all), self.bordered(linear));
        self.body.system_mut().start.keep(rod);
        let fraction = settings::SADDLE_TURN / self.body.system().largest_turn();
        // The supports may permit no motion.
        if !fraction.is_finite() {
            return;
        }
        let fraction = self.descending(rod, start, fraction);
        self.leave_safely(rod, start, fraction);
    }

    /// Factors of the frames from which an inverse iteration begins. They contain all modes.
    fn profile(&self) -> impl Iterator<Item = f64> + use<> {
        let count = self.body.system().turns.len();
        (0..count).map(move |i| (i as f64 / count as f64 + 0.3).sin())
    }

    /// Sets the step of the system to the softest direction that conditions permit, by inverse
    /// iteration with the present factors from given rotations. The rotations about d1, d2 and d3 have
    /// weights, and the length as a further one.
    fn soften(
        &mut self,
        rod: &Rod,
        linear: &Linear,
        (mut turns, weights): (Vec<Vector3<f64>>, Vector3<f64>),
        conditions: Bordered,
    ) {
        let Bordered {
            rows,
            matrix,
            scale,
            ..
        } = conditions;
        let conditions = Conditions::new(&matrix, scale);
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
                *to = turn.component_mul(&weights) * (length / largest);
            }
            system.joints.confine(&mut system.couples);
            let free = linear.response.free(system);
            let reactions = rows.tr_mul(&conditions.solve(&(&rows * free)));
            linear.response.load(system, &reactions);
            self.body.system_mut().solve();
            turns.clone_from(&self.body.system().turns);
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

    /// Moves the rod from the start of a step by a fraction of the step of the system, so far that
    /// no part of it passes an obstacle.
    fn leave_safely(&mut self, rod: &mut Rod, start: &Start, fraction: f64) {
        self.leave_by(rod, start, fraction);
        let factor = self.safe_step_factor(rod, start);
        if factor < 1.0 {
            self.leave_by(rod, start, fraction * factor);
        }
    }

    /// Moves the rod from the start of a step by a fraction of the step of the system.
    fn leave_by(&mut self, rod: &mut Rod, start: &Start, fraction: f64) {
        start.shape.restore(rod);
        self.body.system().advance(rod, fraction);
        self.locate(rod);
    }
}
