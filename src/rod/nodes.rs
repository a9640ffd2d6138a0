//! The shape of a rod as frames at its nodes and strains of the centre line at its material points:
//! the part of a rod that a solver of equilibria determines.

use nalgebra::{UnitQuaternion, Vector3};

use super::Rod;
use super::check::{RodError, check_counts, unless};
use super::shape::weighted_jacobian;
use crate::error::UNIT;
use crate::so3;

/// Largest rotation from the first end of an element to one of its nodes, rad. The logarithm, which
/// gives the rotation vectors, is discontinuous at π.
pub(crate) const LARGEST_ROTATION: f64 = 3.1;

impl Rod {
    /// The number of nodes with a frame: the base, and [`Order::points`](crate::Order::points) of
    /// them in each element, the last one at its end.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.rotations.len() + 1
    }

    /// The frames at the nodes, from base to apex: each rotates e1, e2, e3 into d1, d2, d3. Node e
    /// p is at the first end of element e with p material points, and the others are at its
    /// Gauss–Lobatto places. They determine the frames at all places.
    #[must_use]
    pub fn node_frames(&self) -> Vec<UnitQuaternion<f64>> {
        let p = self.order.points();
        let within = self
            .rotations
            .chunks_exact(p)
            .zip(self.frames.windows(2))
            .flat_map(|(rotations, ends)| {
                // The stored frame at the end of the element is the exact one.
                let inside = rotations[..p - 1]
                    .iter()
                    .map(|theta| ends[0] * so3::exp(theta));
                inside.chain([ends[1]])
            });
        std::iter::once(self.frames[0]).chain(within).collect()
    }

    /// The arc lengths of the nodes from the base, m, in the order of
    /// [`node_frames`](Self::node_frames).
    #[must_use]
    pub fn node_arc_lengths(&self) -> Vec<f64> {
        let mut lengths = vec![0.0];
        for (e, start) in (0..self.elements()).zip(self.ends()) {
            let within = |x: &f64| {
                weighted_jacobian(self.element_points(e), &self.reference().integral_upto(*x))
            };
            lengths.extend(
                self.reference().nodes[1..]
                    .iter()
                    .map(|x| start + within(x)),
            );
        }
        lengths
    }

    /// Sets the shape: the frames at the [nodes](Self::node_frames), and the strain v of the centre
    /// line at the material points, ∂p/∂s = v1 d1 + v2 d2 + v3 d3, which is empty for a rod that
    /// neither shears nor stretches. The base keeps its frame, and the
    /// [reactions](Self::reactions), which belong to the former shape, are removed.
    ///
    /// ```
    /// # use morphorod::{Order, rod::Rod};
    /// # use nalgebra::{UnitQuaternion, Vector3};
    /// let mut rod = Rod::uniform(0.1, 1e-3, UnitQuaternion::identity(), 4, Order::Two)?;
    /// // An arc towards e1 with the curvature 10 1/m.
    /// let arc = |s: f64| UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 10.0 * s);
    /// rod.set_shape(&rod.node_arc_lengths().into_iter().map(arc).collect::<Vec<_>>(), &[])?;
    /// assert!((rod.strain(2, 0).expect("a point") - Vector3::y() * 10.0).norm() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The rod does not change then.
    /// - [`Count`](RodError::Count): another number of frames or of strains.
    /// - [`Value`](RodError::Value): a frame that is not a unit quaternion up to 1e-9, a base that
    ///   rotates by more than 1e-9 rad, a strain that is not finite, or a stretch v3 that is not
    ///   positive.
    /// - [`Folded`](RodError::Folded): a node that is rotated by more than 3.1 rad from the first
    ///   end of its element.
    pub fn set_shape(
        &mut self,
        frames: &[UnitQuaternion<f64>],
        line_strains: &[Vector3<f64>],
    ) -> Result<(), RodError> {
        let expected_strains = if line_strains.is_empty() {
            0
        } else {
            self.points.len()
        };
        check_counts(&[
            ("frames at nodes", frames.len(), self.nodes()),
            (
                "strains of the centre line",
                line_strains.len(),
                expected_strains,
            ),
        ])?;
        for (i, norm) in frames.iter().map(|frame| frame.norm()).enumerate() {
            unless(
                (norm - 1.0).abs() < UNIT,
                "norm of frame",
                i,
                norm,
                "1 (a unit quaternion)",
            )?;
        }
        let turn = so3::log(&(self.frames[0].inverse() * frames[0])).norm();
        unless(
            turn < UNIT,
            "rotation of the base by frame",
            0,
            turn,
            "zero (rad)",
        )?;
        for (i, v) in line_strains.iter().enumerate() {
            unless(
                v.norm_squared().is_finite(),
                "square of strain of the centre line",
                i,
                v.norm_squared(),
                "finite",
            )?;
            unless(v.z > 0.0, "stretch of point", i, v.z, "positive")?;
        }
        let p = self.order.points();
        // The base is exact, and so are products of unit quaternions up to rounding.
        let frame = |node: usize| match node {
            0 => self.frames[0],
            _ => UnitQuaternion::new_normalize(frames[node].into_inner()),
        };
        let mut rotations = Vec::with_capacity(self.rotations.len());
        for element in 0..self.elements() {
            let first = frame(element * p).inverse();
            for k in 1..=p {
                let theta = so3::log(&(first * frame(element * p + k)));
                if !(theta.norm() <= LARGEST_ROTATION) {
                    return Err(RodError::Folded {
                        element,
                        rotation: theta.norm(),
                    });
                }
                rotations.push(theta);
            }
        }
        self.frames = (0..=self.elements())
            .map(|element| frame(element * p))
            .collect();
        self.rotations = rotations;
        line_strains.clone_into(&mut self.line_strains);
        self.reactions.clear();
        Ok(())
    }
}
