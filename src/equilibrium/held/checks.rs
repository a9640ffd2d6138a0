//! Checks of the supports in the configurations before and after a search.

use nalgebra::Vector3;

use super::border::upto_parts;
use super::data::HeldSearch;
use super::path::{DISTANCE_ERROR, DISTANCE_STEP, project};
use super::sites::across;
use super::touch::{CLEAR, all_stations};
use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::load::Load;
use crate::rod::Rod;
use crate::so3;

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Returns an error for supports that are invalid in the initial configuration.
    pub(super) fn check_start(&self, rod: &Rod) -> Result<(), ParameterError> {
        self.check_base()?;
        self.check_velocities(rod)?;
        self.check_potentials(rod)
    }

    /// Returns an error for laws of supports that are invalid where a search ends.
    pub(super) fn check_end(&self, rod: &Rod) -> Result<(), ParameterError> {
        self.check_curvatures(rod)?;
        self.check_potentials(rod)
    }

    /// Returns an error for an obstacle that contains the base.
    fn check_base(&self) -> Result<(), ParameterError> {
        for obstacle in 0..self.obstacles.contacts.len() {
            let (name, gap) =
                ("distance of the base from an obstacle", self.obstacles.gap(obstacle, &Vector3::zeros()));
            let requirement = "zero or positive, since the base must not be inside an obstacle (m)";
            ParameterError::unless(gap.value >= -CLEAR * self.length, name, gap.value, requirement)?;
        }
        Ok(())
    }

    /// Returns an error for an obstacle with friction whose velocity is not finite.
    fn check_velocities(&self, rod: &Rod) -> Result<(), ParameterError> {
        for contact in self.obstacles.contacts.iter().filter(|contact| contact.friction > 0.0) {
            for station in all_stations(rod, &self.tangents) {
                let velocity = contact.obstacle.velocity(&station.position, self.obstacles.time);
                let finite = ParameterError::finite("velocity of an obstacle", velocity.sum());
                finite.map_err(|error| error.at(station.arc_length))?;
            }
        }
        Ok(())
    }

    /// Returns an error for a contact at which the curvature is not the derivative of the normal, to either side along
    /// a tangent: it may be discontinuous at the contact.
    fn check_curvatures(&self, rod: &Rod) -> Result<(), ParameterError> {
        let step = DISTANCE_STEP * self.length;
        for site in self.sites.iter().filter(|site| site.position.iter().all(|x| x.is_finite())) {
            let Some(touch) = &site.touch else { continue };
            // After a failed search neither the tangents of the rod nor a new contact may have been evaluated.
            let place =
                rod.centre_line()[site.element].0 + upto_parts(rod, site.element, site.x)[..P].iter().sum::<f64>();
            let gap = self.obstacles.gap(touch.obstacle, &site.position);
            let scale = gap.curvature.norm().max(1.0 / self.length);
            for along in across(&gap.normal) {
                let error = |side: f64| {
                    let ahead = self.obstacles.gap(touch.obstacle, &(site.position + along * (side * step))).normal;
                    ((ahead - gap.normal) / (side * step) - gap.curvature * along).norm() / scale
                };
                let (name, error) = ("relative error of the curvature of an obstacle", error(1.0).min(error(-1.0)));
                let requirement = "zero: the curvature must be the derivative of the normal";
                ParameterError::unless(error <= DISTANCE_ERROR, name, error, requirement)
                    .map_err(|error| error.at(place))?;
            }
        }
        Ok(())
    }

    /// Returns an error for a potential at the present places and frames whose derivatives are not those of its energy.
    pub(super) fn check_potentials(&self, rod: &Rod) -> Result<(), ParameterError> {
        let time = self.obstacles.time;
        for site in &self.sites {
            let Some(spring) = &site.spring else { continue };
            let place = rod.initial_length() - rod.initial_apex_distance(site.element, site.x);
            self.laws.springs[spring.law].check(&site.position, self.length, time).map_err(|error| error.at(place))?;
        }
        for (joint, (frame, law)) in self.system.joints.elastic.iter().zip(&self.laws.joints) {
            let turn = so3::log(&(frame.inverse() * rod.frames()[joint.node]));
            let (element, x) = if joint.node > 0 { (joint.node - 1, 1.0) } else { (0, 0.0) };
            let place = rod.initial_length() - rod.initial_apex_distance(element, x);
            law.check(&turn, 1.0, time).map_err(|error| error.at(place))?;
        }
        Ok(())
    }

    /// Returns an error for two holds of places that are farther apart than the part of the rod between them reaches
    /// without stretch.
    pub(super) fn check_between(&self, rod: &Rod) -> Result<(), ParameterError> {
        for a in self.sites.iter().filter(|site| !site.fixed.is_empty()) {
            for b in self.sites.iter().filter(|site| site.fixed.len() == 3 && *site != a) {
                let [from, to] = [a, b].map(|site| self.place_of(rod, (site.element, site.x)).arc_length);
                let (name, distance) = ("distance between two holds", project(&a.fixed, &(a.target - b.target)).norm());
                let requirement = "at most the arc length between their places (m), since the rod does not stretch";
                let ok = distance <= (from - to).abs() * (1.0 + 1e-12);
                ParameterError::unless(ok, name, distance, requirement).map_err(|error| error.at(from.max(to)))?;
            }
        }
        Ok(())
    }
}
