//! Conversion of a shoot to cross-sections for three-dimensional rendering.

use morphorod::{Model, Place, Shoot};
use nalgebra::Vector3;

use super::common::Station;

/// Returns equally spaced cross-sections from base to apex, for three-dimensional rendering.
pub fn stations(shoot: &Shoot<impl Model>, count: usize) -> Vec<Station> {
    let section = |place: Place| Station {
        position: place.position.into(),
        directors: [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| (place.frame * axis).into()),
        semi_axes: [place.tissue.section.along_d1, place.tissue.section.along_d2],
    };
    shoot.profile().sample(count).into_iter().map(section).collect()
}
