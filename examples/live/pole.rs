//! Vertical pole of the live page, which the user moves.

use std::cell::Cell;
use std::rc::Rc;

use morphorod::ParameterError;
use morphorod::nalgebra::Vector3;
use morphorod::support::{Cylinder, Distance, Obstacle};

/// Motion of the axis with constant velocity between two times.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    /// Place before `begin`, m.
    from: Vector3<f64>,
    /// Place after `end`, m.
    to: Vector3<f64>,
    /// First and last time of the motion, s.
    begin: f64,
    end: f64,
}

impl Motion {
    /// Returns a pole at rest at a place, m.
    pub fn at_rest(place: Vector3<f64>) -> Self {
        Self {
            from: place,
            to: place,
            begin: 0.0,
            end: 0.0,
        }
    }

    /// Place of the axis at a time.
    pub fn at(&self, time: f64) -> Vector3<f64> {
        if time <= self.begin {
            return self.from;
        }
        let share = ((time - self.begin) / (self.end - self.begin).max(f64::MIN_POSITIVE)).min(1.0);
        self.from.lerp(&self.to, share)
    }

    /// Returns the motion to another place (m), which begins at a time (s) and has a duration (s).
    pub fn then(&self, to: Vector3<f64>, begin: f64, seconds: f64) -> Self {
        Self {
            from: self.at(begin),
            to,
            begin,
            end: begin + seconds,
        }
    }
}

/// The pole. Its motion is shared with the simulation, which changes it without a change of the
/// model: steps after a change of the model start again from short ones.
#[derive(Debug, Clone)]
pub struct Pole {
    /// Radius, m.
    pub radius: f64,
    /// Motion of the axis.
    pub motion: Rc<Cell<Motion>>,
}

impl Pole {
    /// The cylinder at a time.
    fn cylinder(&self, time: f64) -> Cylinder {
        Cylinder {
            through: self.motion.get().at(time),
            along: Vector3::z(),
            radius: self.radius,
        }
    }
}

impl Obstacle for Pole {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        self.cylinder(time).distance(place, time)
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.cylinder(0.0).check()
    }
}
