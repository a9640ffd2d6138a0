//! Consistency of a rod that is read from a file.

use nalgebra::Vector3;

use super::Rod;

/// Why data are not a rod.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RodError {
    /// There are fewer than two frames, those of the ends of an element.
    #[error("a rod has a frame at either end of each element, but here are {frames} frames")]
    NoElements {
        /// Number of frames.
        frames: usize,
    },
    /// Lists have inconsistent lengths.
    #[error("{found} {what} were given for {elements} elements, which have {expected}")]
    Size {
        /// The list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The consistent length.
        expected: usize,
        /// The number of elements.
        elements: usize,
    },
    /// The growth zone begins beyond the apex.
    #[error("the growth zone begins at element {first}, but there are {elements}")]
    Zone {
        /// The first element of the zone.
        first: usize,
        /// The number of elements.
        elements: usize,
    },
    /// A number is out of range.
    #[error("the {what} number {index} is {value} but must be {requirement}")]
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
}

impl RodError {
    /// Returns an error for number `index` unless `ok`.
    fn unless(
        ok: bool,
        what: &'static str,
        (index, value): (usize, f64),
        requirement: &'static str,
    ) -> Result<(), Self> {
        if ok { Ok(()) } else { Err(Self::Value { what, index, value, requirement }) }
    }
}

impl Rod {
    /// Returns an error for lists of inconsistent lengths and for numbers out of range.
    pub(crate) fn check(&self) -> Result<(), RodError> {
        if self.frames.len() < 2 {
            return Err(RodError::NoElements { frames: self.frames.len() });
        }
        let (elements, p) = (self.elements(), self.order.points());
        for (what, found, expected) in [
            ("rotation vectors", self.rotations.len(), elements * p),
            ("material points", self.points.len(), elements * p),
            ("strains of the centre line", self.line_strains.len(), if self.yields() { elements * p } else { 0 }),
            ("distances of the elements' ends from the apex", self.node_distance.len(), elements + 1),
            ("marks of nodes to keep", self.kept.len(), elements + 1),
            ("losses by merging", self.loss.len(), elements),
        ] {
            if found != expected {
                return Err(RodError::Size { what, found, expected, elements });
            }
        }
        let length = (0, self.initial_length);
        RodError::unless(length.1 > 0.0 && length.1.is_finite(), "initial length", length, "positive and finite (m)")?;
        if self.first_growing > elements {
            return Err(RodError::Zone { first: self.first_growing, elements });
        }
        for at in self.frames.iter().map(|frame| frame.norm()).enumerate() {
            RodError::unless((at.1 - 1.0).abs() < 1e-9, "norm of frame", at, "1 (a unit quaternion)")?;
        }
        for at in self.rotations.iter().map(|theta| theta.norm_squared()).enumerate() {
            RodError::unless(at.1.is_finite(), "square of rotation vector", at, "finite")?;
        }
        for at in self.line_strains.iter().map(|v| v.norm_squared()).enumerate() {
            RodError::unless(at.1.is_finite(), "square of strain of the centre line", at, "finite")?;
        }
        for (e, loss) in self.loss.iter().enumerate() {
            let (square, moments) = (loss.mean_square, loss.moments.iter().map(Vector3::norm_squared).sum::<f64>());
            let ok = square >= 0.0 && square.is_finite();
            RodError::unless(ok, "mean square lost by merging", (e, square), "zero or positive (rad²)")?;
            RodError::unless(moments.is_finite(), "square of a moment lost by merging", (e, moments), "finite (rad²)")?;
        }
        self.check_points()?;
        (0..elements).try_for_each(|e| self.check_lengths(e))
    }

    /// Returns an error for numbers out of range at a material point.
    fn check_points(&self) -> Result<(), RodError> {
        let zone = self.zone();
        for (i, point) in self.points.iter().enumerate() {
            let strain = point.intrinsic.norm_squared();
            RodError::unless(strain.is_finite(), "square of intrinsic strain", (i, strain), "finite (1/m²)")?;
            for (what, value) in [
                ("jacobian of point", point.jacobian),
                ("semi-axis along d1 of point", point.section.along_d1),
                ("semi-axis along d2 of point", point.section.along_d2),
            ] {
                RodError::unless(value > 0.0 && value.is_finite(), what, (i, value), "positive and finite (m)")?;
            }
            let (what, distance) = ("distance from the apex of point", point.apex_distance);
            let ok = distance.is_finite() && (distance > 0.0 || !zone.contains(&i));
            RodError::unless(ok, what, (i, distance), "finite, and positive in the growth zone (m)")?;
            let (what, distance) = ("initial distance from the apex of point", point.initial_apex_distance);
            RodError::unless(distance.is_finite(), what, (i, distance), "finite (m)")?;
            let (what, exit) = ("exit time of point", (i, point.exit_time));
            if zone.contains(&i) {
                RodError::unless(exit.1 == f64::INFINITY, what, exit, "infinite in the growth zone (s)")?;
            } else {
                // Tissue may have left it ever so long ago.
                RodError::unless(exit.1 < f64::INFINITY, what, exit, "finite outside the growth zone (s)")?;
            }
        }
        Ok(())
    }

    /// Refuses an element in which the arc length does not increase, or whose places in the growth zone are not in
    /// order.
    fn check_lengths(&self, e: usize) -> Result<(), RodError> {
        let (points, least) = (self.element_points(e), self.least_jacobian(e));
        let what = "least length per coordinate of element";
        RodError::unless(least > 0.0 && least.is_finite(), what, (e, least), "positive and finite (m)")?;
        let (first, last) = (self.node_distance[e], self.node_distance[e + 1]);
        let what = "distance from the apex of the end of element";
        RodError::unless(first.is_finite() && last.is_finite(), what, (e, last), "finite (m)")?;
        if e < self.first_growing {
            return Ok(());
        }
        let (what, excess) =
            ("length of element, less the distance between its ends", self.element_length(e) - (first - last));
        RodError::unless(excess.abs() <= 1e-9 * first.abs(), what, (e, excess), "zero up to rounding (m)")?;
        // Points and ends each for themselves: against each other they are only as accurate as the mesh.
        let what = "distance from the apex in element";
        let places = points.windows(2).map(|pair| (pair[0].apex_distance, pair[1].apex_distance));
        for (before, after) in places.chain([(first, last)]) {
            RodError::unless(
                before > after && after >= 0.0,
                what,
                (e, after),
                "zero or more, and less than before (m)",
            )?;
        }
        Ok(())
    }
}
