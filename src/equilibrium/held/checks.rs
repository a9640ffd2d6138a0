//! Checks of the supports in the configurations before and after a search.

use nalgebra::Vector3;

use super::law::Status;
use super::search::{HeldSearch, project};
use super::settings;
use super::sites::{HeldSite, across, place_of};
use crate::check::{BESIDE, Derivatives};
use crate::error::ParameterError;
use crate::rod::Rod;
use crate::so3;

/// Largest displacement, relative to the length, by which derivatives of obstacles are checked.
const DISTANCE_STEP: f64 = 1e-6;
/// Displacement from a place without a gradient, relative to this step.
const ASIDE: f64 = 10.0;
/// Largest error of such a derivative, for example at an edge of an obstacle.
const DISTANCE_ERROR: f64 = 1e-3;
/// Largest sum of the normals of two opposite obstacles. The forces between walls with an angle of
/// 1e-3 rad are determined, with three digits less than others.
const OPPOSITE: f64 = 1e-3;

impl HeldSearch<'_> {
    /// Returns an error for an obstacle whose function is not a signed distance: its gradient must
    /// be a unit vector and the derivative of the distance, at all stations of the rod or beside
    /// them: a place of greatest distance, as on the axis of a tube, has no gradient.
    pub(super) fn check_obstacles(&self) -> Result<(), ParameterError> {
        for station in self.line.stations() {
            for obstacle in 0..self.obstacles.contacts.len() {
                let place = station.position;
                let value = self.obstacles.gap_at(obstacle, &place).value;
                let at = |error: ParameterError| error.at(station.arc_length);
                ParameterError::finite("distance from an obstacle", value, "m").map_err(at)?;
                let beside = |axis| {
                    let step = Vector3::ith(axis, ASIDE * DISTANCE_STEP * self.length);
                    self.check_gradient(obstacle, &(place + step)).is_ok()
                };
                if let Err(error) = self.check_gradient(obstacle, &place)
                    && !(0..3).any(beside)
                {
                    return Err(at(error));
                }
            }
        }
        Ok(())
    }

    /// Returns an error unless the gradient of the distance from an obstacle is a unit vector and
    /// the derivative of the distance at a place (m).
    fn check_gradient(&self, obstacle: usize, place: &Vector3<f64>) -> Result<(), ParameterError> {
        let here = self.obstacles.gap_at(obstacle, place);
        let name = "norm of the gradient of the distance from an obstacle";
        let norm = here.normal.norm();
        ParameterError::unless((norm - 1.0).abs() < DISTANCE_ERROR, name, norm, "1")?;
        let step = here.normal * (DISTANCE_STEP * self.length);
        let there = self.obstacles.gap_at(obstacle, &(place + step));
        let name = "derivative of the distance from an obstacle along its gradient";
        let slope = Derivatives::along(&step, &here, &there).normal;
        let requirement = "1: the gradient is the normal, which must point away from the obstacle; \
                           `check::obstacle` names the component that is wrong";
        ParameterError::unless(
            (slope - 1.0).abs() < DISTANCE_ERROR,
            name,
            slope,
            requirement,
        )
    }

    /// Returns an error for a hold that is farther from the base, or from a hold at a point, than
    /// the part of the rod between them reaches without stretch.
    pub(super) fn check_reach(&self, rod: &Rod) -> Result<(), ParameterError> {
        if self.yields(rod) {
            return Ok(());
        }
        let arc_length = |site: &HeldSite| self.line.place(rod, site.place()).arc_length;
        let check = |site: &HeldSite, (target, to): (Vector3<f64>, f64), name, requirement| {
            let (from, distance) = (
                arc_length(site),
                project(&site.fixed, &(site.target - target)).norm(),
            );
            let ok = distance <= (from - to).abs() * (1.0 + 1e-12);
            ParameterError::unless(ok, name, distance, requirement)
                .map_err(|error| error.at(from.max(to)))
        };
        if self.body.system().joints.free_base.is_none() {
            let name = "distance of a hold from the base";
            let requirement =
                "at most the arc length of its place (m), since the rod does not stretch";
            self.sites
                .iter()
                .try_for_each(|site| check(site, (rod.base_position(), 0.0), name, requirement))?;
        }
        let name = "distance between two holds";
        let requirement =
            "at most the arc length between their places (m), since the rod does not stretch";
        for site in self.sites.iter().filter(|site| !site.fixed.is_empty()) {
            for other in self
                .sites
                .iter()
                .filter(|other| other.fixed.len() == 3 && other.node != site.node)
            {
                check(site, (other.target, arc_length(other)), name, requirement)?;
            }
        }
        Ok(())
    }

    /// Returns an error for supports that are invalid in the initial configuration.
    pub(super) fn check_start(&self, rod: &Rod) -> Result<(), ParameterError> {
        self.check_base(rod)?;
        self.check_velocities()?;
        self.check_potentials(rod)
    }

    /// Returns an error for supports that are invalid where a search ends.
    pub(super) fn check_end(&self, rod: &Rod) -> Result<(), ParameterError> {
        self.check_curvatures()?;
        self.check_slots()?;
        self.check_potentials(rod)
    }

    /// Returns an error for two obstacles with forces on the rod between which it has no clearance.
    /// Equal and opposite forces at such a place do not affect the rod, and are undetermined unless
    /// an obstacle yields.
    fn check_slots(&self) -> Result<(), ParameterError> {
        let loaded = || {
            self.candidates
                .iter()
                .filter(|at| at.status != Status::Open && at.normal() > 0.0)
        };
        for at in loaded() {
            for other in 0..self.obstacles.contacts.len() {
                let gap = self.obstacles.gap_at(other, &at.position);
                let opposite = (gap.normal + at.gap.normal).norm() <= OPPOSITE;
                let touches = gap.value.abs() <= settings::ROUNDING * self.length;
                if !(opposite && touches && loaded().any(|at| at.obstacle == other)) {
                    continue;
                }
                let compliance =
                    self.obstacles.compliances[other] + self.obstacles.compliances[at.obstacle];
                let yields = !self.obstacles.move_together(other, at.obstacle)
                    && gap.normal.dot(&(compliance * gap.normal)) > 0.0;
                let name = "clearance of the shoot between two obstacles";
                let requirement = "positive (m): both touch it at the same place, where their forces are undetermined; \
                                   let one yield, or leave a gap";
                ParameterError::unless(yields, name, 0.0, requirement)
                    .map_err(|error| error.at(at.arc_length))?;
            }
        }
        Ok(())
    }

    /// Returns an error for an obstacle that contains the base.
    fn check_base(&self, rod: &Rod) -> Result<(), ParameterError> {
        let clamped = self.body.system().joints.free_base.is_none();
        for obstacle in (0..self.obstacles.contacts.len()).filter(|_| clamped) {
            let (name, gap) = (
                "distance of the base from an obstacle",
                self.obstacles.gap_at(obstacle, &rod.base_position()),
            );
            let requirement = "zero or positive, from the surface minus the radius of the contact: the base must not be inside (m)";
            ParameterError::unless(
                gap.value >= -settings::ROUNDING * self.length,
                name,
                gap.value,
                requirement,
            )?;
        }
        Ok(())
    }

    /// Returns an error for an obstacle with friction whose velocity is not finite.
    fn check_velocities(&self) -> Result<(), ParameterError> {
        for contact in self
            .obstacles
            .contacts
            .iter()
            .filter(|contact| contact.friction > 0.0)
        {
            for station in self.line.stations() {
                let velocity = contact
                    .obstacle
                    .velocity(&station.position, self.obstacles.time);
                let finite =
                    ParameterError::finite("velocity of an obstacle", velocity.sum(), "m/s");
                finite.map_err(|error| error.at(station.arc_length))?;
            }
        }
        Ok(())
    }

    /// Returns an error for a contact at which the curvature is not the derivative of the normal,
    /// to either side along a tangent: it may be discontinuous at the contact.
    fn check_curvatures(&self) -> Result<(), ParameterError> {
        for at in self
            .candidates
            .iter()
            .filter(|at| at.position.iter().all(|x| x.is_finite()))
        {
            let moved = |by: &Vector3<f64>| self.obstacles.gap_at(at.obstacle, &(at.position + by));
            let (here, place) = (moved(&Vector3::zeros()), at.arc_length);
            let scale = here.curvature.norm().max(1.0 / self.length);
            let step = (DISTANCE_STEP * self.length).min(BESIDE / scale);
            for along in across(&here.normal) {
                let expected = Derivatives::to_a_side(&(along * step), &here, moved).bend;
                let (name, error) = (
                    "relative error of the curvature of an obstacle",
                    (expected - here.curvature * along).norm() / scale,
                );
                let requirement = "zero: the curvature must be the derivative of the normal, and no place deep inside \
                    an obstacle; `check::obstacle` names the component that is wrong";
                ParameterError::unless(error <= DISTANCE_ERROR, name, error, requirement)
                    .map_err(|error| error.at(place))?;
            }
        }
        Ok(())
    }

    /// Returns an error for a potential at the present places and frames whose derivatives are not
    /// those of its energy.
    fn check_potentials(&self, rod: &Rod) -> Result<(), ParameterError> {
        let springs = self.sites.iter().filter_map(|site| {
            let law = &self.laws.springs[site.spring?.law];
            Some((law, site.position, self.length, site.node))
        });
        let joints = self
            .body
            .system()
            .joints
            .elastic
            .iter()
            .zip(&self.laws.joints)
            .map(|(joint, (frame, law))| {
                (
                    law,
                    so3::log(&(frame.inverse() * rod.frames()[joint.node])),
                    1.0,
                    joint.node,
                )
            });
        for (law, argument, scale, node) in springs.chain(joints) {
            let (element, x) = place_of(node);
            let place = rod.initial_length - rod.initial_apex_distance(element, x);
            law.check(&argument, scale, self.obstacles.time)
                .map_err(|error| error.at(place))?;
        }
        Ok(())
    }
}
