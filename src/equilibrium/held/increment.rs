//! The increment in time before an equilibrium: the rod at its start, from which friction counts
//! slip, and the motion of the base and the obstacles.

use nalgebra::{UnitQuaternion, Vector3};

use super::line::Line;
use super::obstacles::Obstacles;
use super::reduced::Surfaces;
use crate::rod::Rod;
use crate::so3::{self, Form};
use crate::support::Joint;

/// The rod at the start of an increment.
#[derive(Clone)]
pub(super) struct Before {
    pub rod: Rod,
    /// Its centre line.
    line: Line,
    /// Its time, s.
    time: f64,
    /// Displacements of the obstacles by the forces on them, m.
    yielded: Vec<Vector3<f64>>,
}

impl Before {
    pub fn new(rod: &Rod, time: f64, yielded: Vec<Vector3<f64>>) -> Self {
        // The slip of a contact at rest is exactly zero, since its place is computed in the same
        // way.
        let line = Line::new(rod, &rod.line_strains);
        Self {
            rod: rod.clone(),
            line,
            time,
            yielded,
        }
    }

    /// The place without slip (m) of material on the surface of an obstacle, and its derivative
    /// along the rod. The material is given by its distance from the apex at t = 0 (m).
    pub fn anchor(
        &self,
        material: f64,
        (obstacles, obstacle): (&Obstacles, usize),
    ) -> (Vector3<f64>, Vector3<f64>) {
        let Some((e, x)) = self.rod.locate_initial(material) else {
            return (Vector3::repeat(f64::NAN), Vector3::zeros());
        };
        let position = self.line.place(&self.rod, (e, x)).position;
        let velocity = obstacles.contacts[obstacle]
            .obstacle
            .velocity(&position, obstacles.time);
        let place = position + velocity * (obstacles.time - self.time) - self.yielded[obstacle];
        let tangent = self.rod.frame_within(e, x) * Vector3::z();
        // The projection to the surface removes displacements along the normal.
        let gap = obstacles.gap(obstacle, &place);
        (
            place - gap.normal * gap.value,
            tangent - gap.normal * gap.normal.dot(&tangent),
        )
    }
}

/// Position (m) and frame of the base.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pose {
    position: Vector3<f64>,
    frame: UnitQuaternion<f64>,
}

impl Pose {
    fn of(rod: &Rod) -> Self {
        Self {
            position: rod.base_position(),
            frame: rod.frames()[0],
        }
    }
}

/// The motion from the start of an increment to its end, as a function of the progress from zero to
/// one.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    from: Pose,
    to: Pose,
    /// Time at the end, and duration, s.
    end: f64,
    duration: f64,
    /// Whether the base rotates about an axis.
    pub hinged: bool,
    /// The present progress of the rod and the obstacles.
    pub progress: f64,
}

impl Motion {
    /// The motion from a rod at the start of an increment to one with the base at its end. The time
    /// at the end and the duration are in seconds. The motion does not rotate a base that rotates
    /// freely, and does not move one that is free.
    pub fn new(from: &Rod, to: &Rod, (end, duration): (f64, f64), joint: Option<Joint>) -> Self {
        let (mut from, to) = (Pose::of(from), Pose::of(to));
        match joint {
            Some(Joint::Free) => from = to,
            Some(Joint::Ball) => from.frame = to.frame,
            _ => {}
        }
        Self {
            from,
            to,
            end,
            duration,
            hinged: matches!(joint, Some(Joint::Hinge(_))),
            progress: 1.0,
        }
    }

    /// The rotation of the base in the fixed frame, rad.
    fn whole_turn(&self) -> Vector3<f64> {
        so3::log(&(self.to.frame * self.from.frame.inverse()))
    }

    /// Rotation (rad) and displacement (m) of the base in the whole motion.
    pub fn size(&self) -> (f64, f64) {
        (
            self.whole_turn().norm(),
            (self.to.position - self.from.position).norm(),
        )
    }

    /// The base at the given progress of the motion, which is a screw: a turntable moves its places
    /// on circles.
    fn pose(&self, progress: f64) -> Pose {
        if progress >= 1.0 {
            return self.to;
        }
        // The rotation exp(φ) about a fixed point displaces the base by J(φ) c, with the left
        // Jacobian J(φ) = Jr(−φ).
        let (turn, by) = (-self.whole_turn(), self.to.position - self.from.position);
        let s = |turn: &Vector3<f64>| so3::s_functions(turn.norm_squared());
        let rate = Form::inverse_right_jacobian(&s(&turn)).apply(&turn, &by);
        let part = turn * progress;
        let moved = Form::right_jacobian(&s(&part)).apply(&part, &(rate * progress));
        Pose {
            position: self.from.position + moved,
            frame: so3::exp(&-part) * self.from.frame,
        }
    }

    /// The time at the given progress, s.
    pub fn time(&self, progress: f64) -> f64 {
        if progress >= 1.0 {
            self.end
        } else {
            self.end - self.duration * (1.0 - progress)
        }
    }

    /// The rotation of the base in the fixed frame from one value of the progress to another.
    pub fn turn(&self, from: f64, to: f64) -> UnitQuaternion<f64> {
        self.pose(to).frame * self.pose(from).frame.inverse()
    }

    /// Moves the rod rigidly with its base from one value of the progress to another.
    pub fn carry(&self, rod: &mut Rod, from: f64, to: f64) {
        let [from, to] = [from, to].map(|progress| self.pose(progress));
        if from.position != to.position {
            rod.base_position = to.position;
        }
        if from.frame == to.frame {
            return;
        }
        // The frame of a clamped base has no rounding.
        let clamped = rod.frames()[0] == from.frame;
        let base = if clamped {
            to.frame
        } else {
            to.frame * from.frame.inverse() * rod.frames()[0]
        };
        // The call returns no error, since both frames are rotations.
        let _ = rod.set_base(base);
    }
}
