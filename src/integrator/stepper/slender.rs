//! Limits of slenderness: the radius of curvature of a rod must be larger than that of its section.

use nalgebra::Vector3;

use super::{IntegrationError, Outcome};
use crate::constitutive::Constitutive;
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Tissue;
use crate::section::Section;
use crate::shoot::Shoot;

/// Share of the inverse radius below which a bound of the elastic curvature needs no evaluation of the shape. The
/// intrinsic curvature has a check of its own.
const NEGLIGIBLE: f64 = 0.5;

/// Shortening of the surface on the inner side of a bend with the strain `u` (1/m), relative to the centre line.
fn shortening(u: &Vector3<f64>, section: &Section) -> f64 {
    (u.x * section.along_d2).hypot(u.y * section.along_d1)
}

/// Returns an error if the radius of the intrinsic curvature at a point of the growth zone is not larger than that of
/// the section, at `time` (s). In an elliptic section the distance of the surface on the inner side of the bend
/// counts.
pub(super) fn check_slender(shoot: &Shoot<impl Model>, time: f64) -> Outcome {
    let rod = &shoot.state.rod;
    for point in &rod.points()[rod.zone()] {
        let (u, section) = (&point.intrinsic, &point.section);
        // The squares cost less than their root, and this is examined in every step.
        if (u.x * section.along_d2).powi(2) + (u.y * section.along_d1).powi(2) >= 1.0 {
            let (curvature, arc_length) = (u.xy().norm(), rod.length() - point.apex_distance);
            let radius = shortening(u, section) / curvature;
            return Err(IntegrationError::NotSlender { time, arc_length, curvature, radius });
        }
    }
    Ok(())
}

/// Returns an error if the load bends the rod more sharply than its section permits, in the last equilibrium.
///
/// The force times the length bounds the couple, and thereby the elastic curvature. The strain is evaluated only if
/// this bound is large.
pub(super) fn check_bent(shoot: &Shoot<impl Model>, force: &InternalForce) -> Outcome {
    let (rod, time) = (shoot.rod(), force.environment().time);
    let couples = force.couples().iter().map(|(_, couple)| couple.norm()).sum::<f64>();
    let bound = force.largest().max(force.at_base().norm()) * rod.length() + couples;
    let is_small = [0, rod.points().len() - 1].into_iter().all(|i| {
        let tissue = Tissue::of(&rod.points()[i], time);
        let stiffness = shoot.model.constitutive().respond(&tissue, &Vector3::zeros()).tangent.diagonal().xy().min();
        bound * tissue.section.along_d1.max(tissue.section.along_d2) < NEGLIGIBLE * stiffness
    });
    if is_small {
        return Ok(());
    }
    for place in shoot.profile().sample(2 * rod.elements() + 1) {
        let shortening = shortening(&place.strain, &place.tissue.section);
        if shortening >= 1.0 {
            let (curvature, arc_length) = (place.curvature(), place.arc_length);
            return Err(IntegrationError::BentTooSharply {
                time,
                arc_length,
                curvature,
                radius: shortening / curvature,
            });
        }
    }
    Ok(())
}
