//! Material points, and the tissue at a place of a rod.

use super::MaterialPoint;
use crate::section::Section;

/// The tissue at a place, on which elastic laws and loads may depend.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Tissue {
    /// The cross section.
    pub section: Section,
    /// Time since the tissue left the growth zone, s; 0 while it is inside.
    pub age: f64,
    /// Distance from the apex along the shoot at t = 0, m, which identifies the material point.
    pub initial_apex_distance: f64,
}

impl Tissue {
    /// Young tissue with a given section, at the apex. The other properties are set in the fields.
    #[must_use]
    pub fn young(section: impl Into<Section>) -> Self {
        Self { section: section.into(), age: 0.0, initial_apex_distance: 0.0 }
    }

    /// The tissue at a material point at a time (s). In the growth zone its age is 0.
    #[must_use]
    #[inline]
    pub fn of(point: &MaterialPoint, time: f64) -> Self {
        let age = (time - point.exit_time).max(0.0);
        Self { section: point.section, age, initial_apex_distance: point.initial_apex_distance }
    }
}
