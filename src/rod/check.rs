//! Consistency of a rod that is read from a file.

use nalgebra::Vector3;

use super::Rod;
use crate::error::{Number, UNIT, debug_by_display};

/// Inconsistency of the data of a rod.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RodError {
    /// A list has the wrong length.
    #[error("the number of {what} is {found} but the elements require {expected}")]
    Count {
        /// The list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The consistent length; the smallest one for the frames.
        expected: usize,
    },
    /// A number is out of range.
    #[error("the {what} number {index} is {} but must be {requirement}", Number(*value))]
    Value {
        /// The quantity.
        what: &'static str,
        /// Its index, from the base.
        index: usize,
        /// The number.
        value: f64,
        /// Its requirement, with unit.
        requirement: &'static str,
    },
    /// A frame is rotated too far from that at the first end of its element. A shorter step of a
    /// solver, or shorter elements are needed.
    #[error(
        "a node of element {element}, counted from the base, is rotated by {:.4} rad from the first end, more than \
         3.1 rad: take shorter steps or more elements",
        Number(*rotation)
    )]
    Folded {
        /// The element, counted from zero at the base.
        element: usize,
        /// The rotation, rad.
        rotation: f64,
    },
}

debug_by_display!(RodError);

/// The result of a check.
pub(super) type Checked = Result<(), RodError>;

/// Returns an error for number `index` of a quantity unless `ok`.
pub(super) fn unless(
    ok: bool,
    what: &'static str,
    index: usize,
    value: f64,
    requirement: &'static str,
) -> Checked {
    if ok {
        Ok(())
    } else {
        Err(RodError::Value {
            what,
            index,
            value,
            requirement,
        })
    }
}

/// Returns an error unless numbers, which are named, are the expected ones.
pub(super) fn check_counts(counts: &[(&'static str, usize, usize)]) -> Checked {
    let wrong = counts.iter().find(|(_, found, expected)| found != expected);
    wrong.map_or(Ok(()), |&(what, found, expected)| {
        Err(RodError::Count {
            what,
            found,
            expected,
        })
    })
}

impl Rod {
    /// Returns an error for lists of inconsistent lengths and for numbers out of range.
    pub(crate) fn check(&self) -> Checked {
        let frames = self.frames.len();
        if frames < 2 {
            return Err(RodError::Count {
                what: "frames",
                found: frames,
                expected: 2,
            });
        }
        let (elements, p) = (self.elements(), self.order.points());
        check_counts(&[
            ("rotation vectors", self.rotations.len(), elements * p),
            ("material points", self.points.len(), elements * p),
            (
                "strains of the centre line",
                self.line_strains.len(),
                if self.yields() { elements * p } else { 0 },
            ),
            (
                "distances of the elements' ends from the apex",
                self.node_distance.len(),
                elements + 1,
            ),
            ("marks of nodes to keep", self.kept.len(), elements + 1),
            ("losses by merging", self.loss.len(), elements),
        ])?;
        let (length, first) = (self.initial_length, self.first_growing);
        unless(
            length > 0.0 && length.is_finite(),
            "initial length",
            0,
            length,
            "positive and finite (m)",
        )?;
        let position = self.base_position.norm_squared();
        unless(
            position.is_finite(),
            "square of the position of the base",
            0,
            position,
            "finite (m²)",
        )?;
        let requirement = "at most the number of elements";
        unless(
            first <= elements,
            "first element of the growth zone",
            0,
            first as f64,
            requirement,
        )?;
        for (i, norm) in self.frames.iter().map(|frame| frame.norm()).enumerate() {
            unless(
                (norm - 1.0).abs() < UNIT,
                "norm of frame",
                i,
                norm,
                "1 (a unit quaternion)",
            )?;
        }
        for (what, vectors) in [
            ("square of rotation vector", &self.rotations),
            ("square of strain of the centre line", &self.line_strains),
        ] {
            for (i, square) in vectors.iter().map(Vector3::norm_squared).enumerate() {
                unless(square.is_finite(), what, i, square, "finite")?;
            }
        }
        for (e, loss) in self.loss.iter().enumerate() {
            let (square, moments) = (
                loss.mean_square,
                loss.moments.iter().map(Vector3::norm_squared).sum::<f64>(),
            );
            let ok = square >= 0.0 && square.is_finite();
            unless(
                ok,
                "mean square lost by merging",
                e,
                square,
                "zero or positive (rad²)",
            )?;
            unless(
                moments.is_finite(),
                "square of a moment lost by merging",
                e,
                moments,
                "finite (rad²)",
            )?;
        }
        for (i, at) in self.reactions.iter().enumerate() {
            let sum = at.force.sum() + at.couple.sum() + at.arc_length;
            unless(sum.is_finite(), "sum of reaction", i, sum, "finite")?;
        }
        self.check_points()?;
        (0..elements).try_for_each(|e| self.check_lengths(e))
    }

    /// Returns an error for numbers out of range at a material point.
    fn check_points(&self) -> Checked {
        let zone = self.zone();
        for (i, point) in self.points.iter().enumerate() {
            let growing = zone.contains(&i);
            let strain = point.intrinsic.norm_squared();
            unless(
                strain.is_finite(),
                "square of intrinsic strain",
                i,
                strain,
                "finite (1/m²)",
            )?;
            for (what, value) in [
                ("jacobian of point", point.jacobian),
                ("semi-axis along d1 of point", point.section.along_d1),
                ("semi-axis along d2 of point", point.section.along_d2),
            ] {
                unless(
                    value > 0.0 && value.is_finite(),
                    what,
                    i,
                    value,
                    "positive and finite (m)",
                )?;
            }
            let (what, distance) = ("distance from the apex of point", point.apex_distance);
            let ok = distance.is_finite() && (distance > 0.0 || !growing);
            unless(
                ok,
                what,
                i,
                distance,
                "finite, and positive in the growth zone (m)",
            )?;
            let (what, distance) = (
                "initial distance from the apex of point",
                point.initial_apex_distance,
            );
            unless(distance.is_finite(), what, i, distance, "finite (m)")?;
            // The exit time of tissue that was mature before the start may be −∞.
            let (exit, requirement) = (
                point.exit_time,
                "infinite in the growth zone, and less outside it (s)",
            );
            let ok = exit <= f64::INFINITY && (exit == f64::INFINITY) == growing;
            unless(ok, "exit time of point", i, exit, requirement)?;
        }
        Ok(())
    }

    /// Returns an error for an element in which the arc length does not increase, and for one in
    /// the growth zone whose distances from the apex do not decrease.
    fn check_lengths(&self, e: usize) -> Checked {
        let least = self.least_jacobian(e);
        let what = "least length per coordinate of element";
        unless(
            least > 0.0 && least.is_finite(),
            what,
            e,
            least,
            "positive and finite (m)",
        )?;
        let (first, last) = (self.node_distance[e], self.node_distance[e + 1]);
        let what = "distance from the apex of the end of element";
        unless(
            first.is_finite() && last.is_finite(),
            what,
            e,
            last,
            "finite (m)",
        )?;
        if e < self.first_growing {
            return Ok(());
        }
        let excess = self.length_of(e) - (first - last);
        let what = "length of element, less the distance between its ends";
        unless(
            excess.abs() <= 1e-9 * first.abs(),
            what,
            e,
            excess,
            "zero up to rounding (m)",
        )?;
        // Points and ends are checked separately: relative to each other they have the error of the
        // mesh.
        let pairs = self
            .element_points(e)
            .windows(2)
            .map(|pair| (pair[0].apex_distance, pair[1].apex_distance));
        for (before, after) in pairs.chain([(first, last)]) {
            let ok = before > after && after >= 0.0;
            unless(
                ok,
                "distance from the apex in element",
                e,
                after,
                "zero or more, and less than before (m)",
            )?;
        }
        Ok(())
    }
}

/// Implements reading and writing of a type whose derived functions are inherent, by `serde(remote
/// = "Self")`. A value that is read is checked.
#[cfg(feature = "serde")]
macro_rules! checked_when_read {
    ($Type:ty) => {
        impl serde::Serialize for $Type {
            fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                Self::serialize(self, to)
            }
        }

        impl<'de> serde::Deserialize<'de> for $Type {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                let value = Self::deserialize(from)?;
                value.check().map_err(serde::de::Error::custom)?;
                Ok(value)
            }
        }
    };
}

#[cfg(feature = "serde")]
pub(crate) use checked_when_read;

#[cfg(feature = "serde")]
checked_when_read!(Rod);
