//! Access to the parts of a rod for solvers and integrators.

use nalgebra::{UnitQuaternion, Vector3};

use super::shape::weighted_jacobian;
use super::{MaterialPoint, Rod};
use crate::error::ParameterError;
use crate::so3;
use crate::support::{Joint, closest_about};

/// Rotation of the axis of a base's hinge that is attributed to rounding, rad. The base is not
/// rotated then.
const HINGE_ROUNDING: f64 = 1e-12;

impl Rod {
    /// Takes the first `elements` growing elements out of the growth zone. Returns their material
    /// points, whose exit times must be set to less than infinity.
    pub(crate) fn mature(&mut self, elements: usize) -> &mut [MaterialPoint] {
        let start = self.zone().start;
        self.first_growing += elements;
        let end = self.zone().start;
        &mut self.points[start..end]
    }

    /// The same rod with directors that are rotated along it: each frame R becomes R `turn`. The
    /// rotation is about d3.
    pub(crate) fn with_turned_directors(&self, turn: &UnitQuaternion<f64>) -> Self {
        let (mut out, back) = (self.clone(), turn.inverse());
        out.frames.iter_mut().for_each(|frame| *frame *= turn);
        let vectors = out.rotations.iter_mut().chain(&mut out.line_strains);
        vectors
            .chain(out.points.iter_mut().map(|point| &mut point.intrinsic))
            .for_each(|vector| *vector = back * *vector);
        out
    }

    /// Gives the base a frame and a position (m), as far as its joint fixes them. The base of a
    /// hinge keeps its rotation about the axis.
    pub(crate) fn place_base(
        &mut self,
        (base, position): (UnitQuaternion<f64>, Vector3<f64>),
        joint: Option<Joint>,
    ) -> Result<(), ParameterError> {
        if joint != Some(Joint::Free) {
            self.set_base_position(position)?;
        }
        let base = match joint {
            None => base,
            Some(Joint::Ball | Joint::Free) => return Ok(()),
            Some(Joint::Hinge(axis)) => {
                let hinged = closest_about(&axis, &base, &self.frames[0]);
                if hinged.angle_to(&self.frames[0]) > HINGE_ROUNDING {
                    hinged
                } else {
                    return Ok(());
                }
            }
        };
        self.set_base(base)
    }

    /// Takes the shape of another rod: position of the base, frames, rotations, the strain of the
    /// centre line and the reactions.
    pub(crate) fn copy_shape(&mut self, source: &Self) {
        self.base_position = source.base_position;
        self.frames.clone_from(&source.frames);
        self.rotations.clone_from(&source.rotations);
        self.line_strains.clone_from(&source.line_strains);
        self.reactions.clone_from(&source.reactions);
    }

    /// Returns the name of the first data in which the rod differs from that `before` a solver of
    /// equilibria, which must change the shape only: elements, growth zone, base and, if requested,
    /// the material points.
    pub(crate) fn changed_from(&self, before: &Self, points: bool) -> Option<&'static str> {
        let zone = self.node_distance == before.node_distance
            && self.first_growing == before.first_growing;
        let base = self.frames[0] == before.frames[0] && self.base_position == before.base_position;
        let same = [
            (
                "the elements",
                self.node_distance.len() == before.node_distance.len() && self.kept == before.kept,
            ),
            ("the growth zone", zone),
            (
                "the material points",
                !points || self.points == before.points,
            ),
            ("the base", base),
        ];
        same.into_iter()
            .find(|(_, same)| !same)
            .map(|(what, _)| what)
    }

    /// Takes the shape of another rod as an initial guess. Lengths may differ; with other elements
    /// the rod keeps its own shape.
    pub(crate) fn guess_shape(&mut self, source: &Self) {
        let sizes = |rod: &Self| {
            [
                rod.frames.len(),
                rod.rotations.len(),
                rod.line_strains.len(),
            ]
        };
        if sizes(self) == sizes(source) {
            self.copy_shape(source);
        }
    }

    /// The rod with nodes at arc lengths (m), in increasing order, except those that are closer to
    /// a node than a share `margin` of their element. The places of the tissue follow from the
    /// lengths at the points alone, since tissue that leaves the growth zone in a step has no
    /// distances from the apex that fit its element.
    pub(crate) fn with_nodes(&self, places: &[f64], margin: f64) -> Self {
        let (mut rod, mut first) = (self.clone(), self.first_growing);
        for s in places {
            rod.first_growing = rod.elements();
            if let Some((e, x)) = rod.locate(*s)
                && x > margin
                && x < 1.0 - margin
            {
                rod.split(e, x);
                first += usize::from(e < first);
            }
        }
        rod.first_growing = first;
        rod
    }

    /// Takes the shape of a rod of the same length with other elements: the position of its base,
    /// its frames at the nodes of this rod, and its reactions. The strain of the centre line is not
    /// taken.
    pub(crate) fn sample_shape(&mut self, source: &Self) {
        let mut walk = source.walk();
        self.set_frames(source.frames[0], |s| {
            let (element, x) = walk.to(s).unwrap_or((0, 0.0));
            source.frame_within(element, x)
        });
        self.base_position = source.base_position;
        self.reactions.clone_from(&source.reactions);
    }

    /// Takes the shape of a rod as [`sample_shape`](Self::sample_shape), after the motion between
    /// two shapes of a rod of the same length: the position of the base of the second one, and the
    /// rotations from the first to the second.
    pub(crate) fn sample_motion(&mut self, source: &Self, [from, to]: [&Self; 2]) {
        let (mut walk, mut along) = (source.walk(), from.walk());
        self.set_frames(to.frames[0], |s| {
            let (element, x) = walk.to(s).unwrap_or((0, 0.0));
            let (e, y) = along.to(s).unwrap_or((0, 0.0));
            to.frame_within(e, y)
                * from.frame_within(e, y).inverse()
                * source.frame_within(element, x)
        });
        self.base_position = to.base_position;
        self.reactions.clone_from(&source.reactions);
    }

    /// Sets the frames at the base and, by a function of the arc length (m), at the nodes.
    fn set_frames(
        &mut self,
        base: UnitQuaternion<f64>,
        mut frame_at: impl FnMut(f64) -> UnitQuaternion<f64>,
    ) {
        let (reference, p) = (self.reference(), self.order.points());
        let (mut start, mut frame) = (0.0, base);
        self.frames[0] = base;
        for e in 0..self.elements() {
            let first = frame.inverse();
            for k in 0..p {
                let before = weighted_jacobian(
                    self.element_points(e),
                    &reference.within(reference.nodes[k + 1]),
                );
                frame = frame_at(start + before);
                self.rotations[e * p + k] = so3::log(&(first * frame));
            }
            start += self.length_of(e);
        }
        self.chain_frames();
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::reference_element::Order;

    #[test]
    fn joint_of_the_base_decides_what_it_takes_from_the_scene() {
        let turned = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
        // The rod has rotated by 0.3 rad about the axis of its hinge before the base rotates by 0.5
        // rad across it.
        let own = turned(Vector3::y_axis(), 0.3);
        let (base, position) = (turned(Vector3::z_axis(), 0.5), Vector3::new(1.0, -2.0, 3.0));
        for (joint, frame, moves) in [
            (None, base, true),
            (Some(Joint::Hinge(Vector3::y_axis())), base * own, true),
            (Some(Joint::Ball), own, true),
            (Some(Joint::Free), own, false),
        ] {
            let mut rod = Rod::straight(&[0.0, 0.1], |_| 1e-3, own, Order::Four).unwrap();
            rod.place_base((base, position), joint).unwrap();
            // Frames are rounded a few times.
            assert_relative_eq!(rod.frames()[0], frame, epsilon = 1e-14);
            assert_eq!(
                rod.base_position(),
                if moves { position } else { Vector3::zeros() }
            );
        }
    }
}
