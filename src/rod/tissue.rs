//! Material points, and the tissue at a place of a rod.

use nalgebra::Vector3;

use crate::section::Section;

/// A material point: one Gauss point of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MaterialPoint {
    /// Intrinsic strain u*, components along the directors, 1/m.
    pub intrinsic: Vector3<f64>,
    /// Current unloaded length per unit of the element coordinate in [0, 1], m. Growth multiplies
    /// it by the stretch.
    pub jacobian: f64,
    /// Distance from the apex along the shoot, m, up to date in the growth zone. In contrast to an
    /// arc length from the base it does not suffer from cancellation near the apex.
    pub apex_distance: f64,
    /// Distance from the apex at t = 0, m, which identifies the material point.
    pub initial_apex_distance: f64,
    /// Time t* at which the point left the growth zone, s; infinite while it is inside.
    #[cfg_attr(feature = "serde", serde(with = "infinite_as_none"))]
    pub exit_time: f64,
    /// The cross section.
    pub section: Section,
}

/// Infinite times as `None`, for formats without infinity such as JSON.
#[cfg(feature = "serde")]
mod infinite_as_none {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// Represents −∞, the exit time of tissue behind a zone that has not begun to grow, s. A power
    /// of ten is read exactly from text.
    const LONG_AGO: f64 = -1e300;

    pub fn serialize<S: Serializer>(time: &f64, to: S) -> Result<S::Ok, S::Error> {
        (*time < f64::INFINITY)
            .then_some(time.max(LONG_AGO))
            .serialize(to)
    }

    pub fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<f64, D::Error> {
        let time = Option::deserialize(from)?.unwrap_or(f64::INFINITY);
        // NaN is kept; validation rejects it later.
        Ok(if time <= LONG_AGO {
            f64::NEG_INFINITY
        } else {
            time
        })
    }
}

impl MaterialPoint {
    /// The material point whose quantities are weighted sums of those at other points, of the same
    /// element or of two neighbours. Exit times are either all finite or all equal.
    pub(super) fn weighted(points: &[Self], weights: &[f64]) -> Self {
        let sum = |f: &dyn Fn(&Self) -> f64| {
            points
                .iter()
                .zip(weights)
                .map(|(point, w)| w * f(point))
                .sum::<f64>()
        };
        let exit = points[0].exit_time;
        Self {
            intrinsic: Vector3::from_fn(|i, _| sum(&|point| point.intrinsic[i])),
            jacobian: sum(&|point| point.jacobian),
            apex_distance: sum(&|point| point.apex_distance),
            initial_apex_distance: sum(&|point| point.initial_apex_distance),
            exit_time: if exit.is_finite() {
                sum(&|point| point.exit_time)
            } else {
                exit
            },
            section: Section::ellipse(
                sum(&|point| point.section.along_d1),
                sum(&|point| point.section.along_d2),
            ),
        }
    }
}

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
        Self {
            section: section.into(),
            age: 0.0,
            initial_apex_distance: 0.0,
        }
    }

    /// The tissue at a material point at a time (s). In the growth zone its age is 0.
    #[must_use]
    #[inline]
    pub fn of(point: &MaterialPoint, time: f64) -> Self {
        let age = (time - point.exit_time).max(0.0);
        Self {
            section: point.section,
            age,
            initial_apex_distance: point.initial_apex_distance,
        }
    }
}
