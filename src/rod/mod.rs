//! The discretised rod: material points, rotations, and the shape that they determine.

mod check;
mod coarse;
mod lengths;
mod locate;
mod loss;
mod nodes;
mod pair;
mod parts;
mod remesh;
mod sampling;
mod shape;
pub(crate) mod tissue;

pub use check::RodError;
#[cfg(feature = "serde")]
pub(crate) use check::checked_when_read;
pub(crate) use coarse::ElementPlace;
pub(crate) use lengths::UNEVEN;
pub(crate) use nodes::LARGEST_ROTATION;
pub(crate) use remesh::{LARGEST_INSIDE, PartWeights, merge_rotations, split_rotations};
pub(crate) use shape::{centre_line_tangent, weighted, weighted_jacobian};
pub use tissue::MaterialPoint;
pub(crate) use tissue::Tissue;

use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};

use loss::MergingLoss;

use crate::error::ParameterError;
use crate::reference_element::{Order, ReferenceElement};
use crate::section::Section;
use crate::so3;
use crate::support::Reaction;

/// A rod, clamped at its base and free at its apex, divided into elements.
///
/// Elements run from the base (element 0) to the apex. Each has `p` material points and, as degrees
/// of freedom, the rotation vectors θ of its Lobatto nodes relative to the frame of its first end:
/// the frame at coordinate ξ is R₀ exp(θ̂(ξ)), with θ a polynomial of degree `p`. This
/// interpolation is objective and independent of the path of deformation.
///
/// Lengths along the rod (arc length, length, distance from the apex) are unstretched lengths of
/// the tissue, which identify places. Positions include shear and stretch if the elastic law has
/// them. They are those in the fixed frame, in which the base is at
/// [`base_position`](Self::base_position), the origin unless it is set.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(remote = "Self")
)]
pub struct Rod {
    order: Order,
    /// Position of the base in the fixed frame, m.
    pub(crate) base_position: Vector3<f64>,
    /// Frames at the ends of the elements, from base to apex.
    pub(crate) frames: Vec<UnitQuaternion<f64>>,
    /// Rotation vectors of the nodes 1 … p of every element.
    pub(crate) rotations: Vec<Vector3<f64>>,
    /// Strain v of the centre line at the material points, along the directors; empty without shear
    /// and stretch.
    pub(crate) line_strains: Vec<Vector3<f64>>,
    /// Material points of every element.
    pub(crate) points: Vec<MaterialPoint>,
    /// Distance of the ends of the elements from the apex, up to date in the growth zone.
    pub(crate) node_distance: Vec<f64>,
    /// The length at t = 0, m.
    pub(crate) initial_length: f64,
    /// Ends of elements that merging must keep.
    pub(crate) kept: Vec<bool>,
    /// Index of the first element in the growth zone.
    pub(crate) first_growing: usize,
    /// Loss of intrinsic strain by merging, for every element.
    loss: Vec<MergingLoss>,
    /// Forces and couples of supports in the last equilibrium; empty without a support.
    pub(crate) reactions: Vec<Reaction>,
}

impl Rod {
    /// A straight rod without intrinsic strain, with its base at the origin.
    ///
    /// `nodes` are the arc lengths (m) of the ends of the elements, from 0 to the length. `section`
    /// returns the cross section at an arc length (m), or the radius (m) of a circular one. `base`
    /// rotates e1, e2, e3 into d1, d2, d3.
    ///
    /// # Errors
    /// Fewer than two nodes, nodes that do not start at 0 or do not increase, a section that is not
    /// positive, or a base whose quaternion is not of norm 1.
    pub fn straight<S: Into<Section>>(
        nodes: &[f64],
        section: impl Fn(f64) -> S,
        base: UnitQuaternion<f64>,
        order: Order,
    ) -> Result<Self, ParameterError> {
        let elements = nodes.len().saturating_sub(1);
        ParameterError::unless(
            elements > 0,
            "number of elements",
            elements as f64,
            "at least 1",
        )?;
        ParameterError::unless(
            nodes[0] == 0.0,
            "arc length of the first node",
            nodes[0],
            "0",
        )?;
        ParameterError::unit("norm of the base frame's quaternion", base.coords.norm())?;
        let reference = ReferenceElement::of(order);
        let length = nodes[elements];
        let mut points = Vec::with_capacity(elements * reference.p);
        for ends in nodes.windows(2) {
            let h = ends[1] - ends[0];
            ParameterError::positive("length of an element", h, "m")?;
            for x in &reference.points {
                let s = ends[0] + h * x;
                let section = section(s).into();
                section
                    .check(f64::INFINITY, "positive and finite (m)")
                    .map_err(|error| error.at(s))?;
                points.push(MaterialPoint {
                    intrinsic: Vector3::zeros(),
                    jacobian: h,
                    apex_distance: length - s,
                    initial_apex_distance: length - s,
                    exit_time: f64::INFINITY,
                    section,
                });
            }
        }
        Ok(Self {
            order,
            base_position: Vector3::zeros(),
            frames: vec![base; elements + 1],
            rotations: vec![Vector3::zeros(); elements * reference.p],
            line_strains: Vec::new(),
            points,
            node_distance: nodes.iter().map(|s| length - s).collect(),
            initial_length: length,
            kept: vec![false; elements + 1],
            first_growing: 0,
            loss: vec![MergingLoss::default(); elements],
            reactions: Vec::new(),
        })
    }

    /// A straight uniform rod of `elements` equal elements, with the given length (m) and radius
    /// (m), along the tangent d3 of `base`.
    ///
    /// # Errors
    /// A length or radius that is not positive, no elements, or a base whose quaternion is not of
    /// norm 1.
    pub fn uniform(
        length: f64,
        radius: f64,
        base: UnitQuaternion<f64>,
        elements: usize,
        order: Order,
    ) -> Result<Self, ParameterError> {
        ParameterError::positive("length", length, "m")?;
        Self::straight(
            &Self::equal_nodes(length, elements),
            |_| radius,
            base,
            order,
        )
    }

    /// Arc lengths (m) of the ends of `elements` equal elements of a rod of the given length (m).
    /// For zero elements the only node is 0, which [`straight`](Self::straight) refuses.
    #[must_use]
    pub fn equal_nodes(length: f64, elements: usize) -> Vec<f64> {
        (0..=elements)
            .map(|i| length * i as f64 / elements.max(1) as f64)
            .collect()
    }

    /// The order of the discretisation.
    #[must_use]
    pub fn order(&self) -> Order {
        self.order
    }

    /// The number of elements.
    #[must_use]
    pub fn elements(&self) -> usize {
        self.frames.len() - 1
    }

    /// The material points, from base to apex, [`Order::points`] of them in each element.
    #[must_use]
    pub fn points(&self) -> &[MaterialPoint] {
        &self.points
    }

    /// Sets the intrinsic strain of every material point: components along the directors, 1/m.
    /// Positive u2 bends towards d1, negative u1 towards d2, positive u3 twists d1 towards d2. The
    /// shape does not change; it is the initial guess of the next equilibrium.
    ///
    /// ```
    /// # use morphorod::{Order, rod::Rod};
    /// # use nalgebra::{UnitQuaternion, Vector3};
    /// let mut rod = Rod::uniform(0.1, 1e-3, UnitQuaternion::identity(), 4, Order::Eight)?;
    /// // Bending about d2 that increases towards the apex.
    /// rod.set_intrinsic(|point| Vector3::y() * (10.0 - 100.0 * point.apex_distance));
    /// # Ok::<(), morphorod::ParameterError>(())
    /// ```
    pub fn set_intrinsic(&mut self, mut strain: impl FnMut(&MaterialPoint) -> Vector3<f64>) {
        for point in &mut self.points {
            point.intrinsic = strain(point);
        }
    }

    /// Makes all tissue mature: it left the growth zone at the time `exit` (s), at which its age is
    /// zero.
    pub fn set_mature(&mut self, exit: f64) {
        self.points
            .iter_mut()
            .for_each(|point| point.exit_time = exit);
        self.first_growing = self.elements();
    }

    /// The frames at the ends of the elements, from base to apex: each rotates e1, e2, e3 into d1,
    /// d2, d3.
    #[must_use]
    pub fn frames(&self) -> &[UnitQuaternion<f64>] {
        &self.frames
    }

    /// The forces and couples of supports on the rod in its last equilibrium, in the order of
    /// [`Held::reactions`](crate::equilibrium::Held::reactions); empty after an equilibrium without
    /// a support, and before the first one. Like the frames they belong to the shape of the rod: a
    /// [`Profile`](crate::profile::Profile) includes them.
    #[must_use]
    pub fn reactions(&self) -> &[Reaction] {
        &self.reactions
    }

    /// The indices of the material points in the growth zone; empty for a mature rod. The zone
    /// begins with a whole element.
    #[must_use]
    pub fn zone(&self) -> Range<usize> {
        self.first_growing * self.order.points()..self.points.len()
    }

    /// The length of an element, counted from zero at the base, m; `None` if there is no such
    /// element.
    #[must_use]
    pub fn element_length(&self, element: usize) -> Option<f64> {
        (element < self.elements()).then(|| self.length_of(element))
    }

    /// The length of an existing element, m.
    #[inline]
    pub(crate) fn length_of(&self, element: usize) -> f64 {
        weighted_jacobian(self.element_points(element), &self.reference().weights)
    }

    /// The arc lengths of the ends of the elements from the base, m.
    pub(crate) fn ends(&self) -> Vec<f64> {
        let mut ends = vec![0.0; self.elements() + 1];
        for e in 0..self.elements() {
            ends[e + 1] = ends[e] + self.length_of(e);
        }
        ends
    }

    /// Upper bound of the rotation along an element by its intrinsic strain, rad: ∫ |u*| ds.
    pub(crate) fn intrinsic_turn(&self, element: usize) -> f64 {
        let points = self
            .element_points(element)
            .iter()
            .zip(&self.reference().weights);
        points
            .map(|(point, w)| w * point.jacobian * point.intrinsic.norm())
            .sum()
    }

    /// The unstretched length ℓ of the rod, m; [`centre_line_length`](Self::centre_line_length)
    /// includes elastic stretch.
    #[must_use]
    pub fn length(&self) -> f64 {
        // The sum begins at the apex, where elements may be small.
        (0..self.elements()).rev().map(|e| self.length_of(e)).sum()
    }

    /// The volume of the rod, m³.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.integral(self.points.iter().map(|point| point.section.area()))
    }

    /// The integral along the rod of values at its material points.
    pub(crate) fn integral(&self, values: impl Iterator<Item = f64>) -> f64 {
        let each = self
            .points
            .iter()
            .zip(self.reference().weights.iter().cycle())
            .zip(values);
        each.map(|((point, w), value)| w * point.jacobian * value)
            .sum()
    }

    /// Rotates the whole rod so that its base has the given frame.
    ///
    /// # Errors
    /// A frame whose quaternion is not of norm 1; the rod does not change then.
    pub fn set_base(&mut self, base: UnitQuaternion<f64>) -> Result<(), ParameterError> {
        ParameterError::unit("norm of the base frame's quaternion", base.coords.norm())?;
        let turn = base * self.frames[0].inverse();
        for frame in &mut self.frames {
            *frame = UnitQuaternion::new_normalize((turn * *frame).into_inner());
        }
        self.frames[0] = base;
        Ok(())
    }

    /// The position of the base in the fixed frame, m; the origin by default.
    #[must_use]
    pub fn base_position(&self) -> Vector3<f64> {
        self.base_position
    }

    /// Moves the whole rod, without rotation, so that its base is at a position in the fixed frame
    /// (m).
    ///
    /// # Errors
    /// A position that is not finite; the rod does not change then.
    pub fn set_base_position(&mut self, position: Vector3<f64>) -> Result<(), ParameterError> {
        ParameterError::finite("position of the base", position.sum(), "m")?;
        self.base_position = position;
        Ok(())
    }

    /// Copies `source` without allocation if the capacities suffice.
    pub(crate) fn copy_from(&mut self, source: &Self) {
        (self.order, self.first_growing) = (source.order, source.first_growing);
        self.initial_length = source.initial_length;
        self.kept.clone_from(&source.kept);
        self.copy_shape(source);
        self.points.clone_from(&source.points);
        self.node_distance.clone_from(&source.node_distance);
        self.loss.clone_from(&source.loss);
    }

    #[inline]
    pub(crate) fn reference(&self) -> &'static ReferenceElement {
        ReferenceElement::of(self.order)
    }

    #[inline]
    pub(crate) fn element_points(&self, element: usize) -> &[MaterialPoint] {
        let p = self.order.points();
        &self.points[element * p..(element + 1) * p]
    }

    /// Rotation vectors of the nodes 1 … p of an element.
    pub(crate) fn element_rotations(&self, element: usize) -> &[Vector3<f64>] {
        let p = self.order.points();
        &self.rotations[element * p..(element + 1) * p]
    }

    /// Recomputes the frames at the ends of the elements from that of the base and the rotations in
    /// the elements.
    pub(crate) fn chain_frames(&mut self) {
        let p = self.order.points();
        for e in 0..self.elements() {
            self.frames[e + 1] = self.frames[e] * so3::exp(&self.rotations[(e + 1) * p - 1]);
        }
    }
}
