//! What the tissue at a place is like.

use super::MaterialPoint;
use crate::section::Section;

/// What elastic laws and loads may know of the tissue at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Tissue {
    /// The cross section.
    pub section: Section,
    /// Time since the tissue left the growth zone, s; 0 while it is inside.
    pub age: f64,
    /// Distance from the apex along the shoot at t = 0, m: the name of the place, whatever grows.
    pub initial_apex_distance: f64,
}

impl Tissue {
    /// Young tissue of a section, at the apex. Set the fields for any other.
    #[must_use]
    pub fn young(section: impl Into<Section>) -> Self {
        Self { section: section.into(), age: 0.0, initial_apex_distance: 0.0 }
    }

    /// The tissue at a material point at a time (s): in the growth zone the exit time is infinite and the age 0.
    #[must_use]
    #[inline]
    pub fn of(point: &MaterialPoint, time: f64) -> Self {
        let age = (time - point.exit_time).max(0.0);
        Self { section: point.section, age, initial_apex_distance: point.initial_apex_distance }
    }
}
