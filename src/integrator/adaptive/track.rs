//! The path of a shoot through a run, to hold two runs against each other.

use nalgebra::Vector3;

use super::cut::longest_element;
use crate::integrator::step_size::Stop;
use crate::model::Model;
use crate::numerics::interpolation::lagrange;
use crate::shoot::Shoot;

/// Places along the shoot that are followed, the apex last: thirds miss no wave that a shoot of a few elements has.
const PLACES: usize = 4;
/// Positions between two steps are interpolated through so many: two orders better than the steps themselves.
const THROUGH: usize = 6;

/// Where a shoot was after every step.
#[derive(Debug, Clone, Default)]
pub(super) struct Track {
    looks: Vec<Look>,
    /// The sum over all looks, m.
    longest_elements: f64,
}

#[derive(Debug, Clone, Copy)]
struct Look {
    time: f64,
    /// How the path goes on here from what was before.
    joint: Joint,
    length: f64,
    places: [Vector3<f64>; PLACES],
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Joint {
    Smooth,
    /// Nothing is interpolated across it.
    Kink,
    /// Nor up to it.
    Jump,
}

impl Track {
    pub fn clear(&mut self) {
        self.looks.clear();
        self.longest_elements = 0.0;
    }

    /// Writes down where the shoot is, after a step to a stop.
    pub fn record(&mut self, shoot: &Shoot<impl Model>, stop: Option<Stop>) {
        let joint = match stop {
            Some(Stop { discontinuity: false, kink: false, .. }) => Joint::Smooth,
            Some(Stop { discontinuity: false, .. }) => Joint::Kink,
            _ => Joint::Jump,
        };
        self.longest_elements += longest_element(&shoot.state);
        let line = shoot.rod().centre_line_at(PLACES + 1);
        self.looks.push(Look {
            time: shoot.time(),
            joint,
            length: shoot.rod().length(),
            places: std::array::from_fn(|k| line[k + 1]),
        });
    }

    /// The longest element, on average over the run, m.
    pub fn longest_element(&self) -> f64 {
        self.longest_elements / self.looks.len() as f64
    }

    /// The largest distance, relative to the length, between this run and a coarser one, at the steps of that one.
    pub fn distance(&self, coarser: &Self) -> f64 {
        let mut largest = 0.0_f64;
        let mut near = 0;
        for look in &coarser.looks {
            while near < self.looks.len() && self.looks[near].time < look.time {
                near += 1;
            }
            let Some(places) = self.at(look.time, near) else { continue };
            for (a, b) in places.iter().zip(&look.places) {
                // Not a number is further away than any other.
                let distance = (a - b).norm() / look.length;
                largest = if distance.is_nan() { f64::INFINITY } else { largest.max(distance) };
            }
        }
        largest
    }

    /// The places at a time, by the looks around number `near`, the first that is not before it.
    fn at(&self, time: f64, near: usize) -> Option<[Vector3<f64>; PLACES]> {
        if let Some(look) = self.looks.get(near).filter(|look| look.time == time) {
            return Some(look.places);
        }
        let joint = |i: usize| self.looks[i].joint;
        // There is a look at the start of the run, so one before.
        let (mut first, mut end) = (near.checked_sub(1)?, near);
        while end - first < THROUGH {
            let before = first.checked_sub(1).filter(|_| joint(first) == Joint::Smooth);
            let goes_on = end < self.looks.len() && joint(end) != Joint::Jump;
            let after = goes_on && (end == near || joint(end - 1) == Joint::Smooth);
            match before {
                // The nearer half on either side, as far as there are some.
                Some(i) if !after || near - first <= end - near => first = i,
                _ if after => end += 1,
                _ => break,
            }
        }
        let mut times = [0.0; THROUGH];
        for (time, other) in times.iter_mut().zip(&self.looks[first..end]) {
            *time = other.time;
        }
        let mut weights = [0.0; THROUGH];
        lagrange(&times[..end - first], time, &mut weights[..end - first]);
        let mut places = [Vector3::zeros(); PLACES];
        for (other, weight) in self.looks[first..end].iter().zip(weights) {
            for (place, at) in places.iter_mut().zip(&other.places) {
                *place += at * weight;
            }
        }
        Some(places)
    }
}
