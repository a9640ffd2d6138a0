//! The path of a shoot through a run, to hold two runs against each other.

use nalgebra::Vector3;

use super::cut::longest_element;
use crate::model::Model;
use crate::quadrature::lagrange;
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
    /// When the piece began on which the path is smooth, s.
    since: f64,
    length: f64,
    places: [Vector3<f64>; PLACES],
}

impl Track {
    pub fn clear(&mut self) {
        self.looks.clear();
        self.longest_elements = 0.0;
    }

    /// Writes down where the shoot is.
    pub fn record(&mut self, shoot: &Shoot<impl Model>) {
        self.longest_elements += longest_element(&shoot.state);
        let line = shoot.rod().centre_line_at(PLACES + 1);
        self.looks.push(Look {
            time: shoot.time(),
            since: shoot.state.smooth_since,
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
            let Some(places) = self.at(look, near) else { continue };
            for (a, b) in places.iter().zip(&look.places) {
                // Not a number is further away than any other.
                let distance = (a - b).norm() / look.length;
                largest = if distance.is_nan() { f64::INFINITY } else { largest.max(distance) };
            }
        }
        largest
    }

    /// The places at the time of `look`, by the looks around number `near`, the first that is not before it.
    fn at(&self, look: &Look, near: usize) -> Option<[Vector3<f64>; PLACES]> {
        let same = |i: &usize| self.looks[*i].since == look.since;
        let (mut first, mut end) = (near, near);
        while end - first < THROUGH {
            let before = first.checked_sub(1).filter(same);
            let after = Some(end).filter(|i| *i < self.looks.len()).filter(same);
            match (before, after) {
                // The nearer half on either side, as far as there are some.
                (Some(i), Some(_)) if near - i <= end - near => first = i,
                (_, Some(_)) => end += 1,
                (Some(i), None) => first = i,
                (None, None) => break,
            }
        }
        if first == end {
            return None;
        }
        let mut times = [0.0; THROUGH];
        for (time, other) in times.iter_mut().zip(&self.looks[first..end]) {
            *time = other.time;
        }
        let mut weights = [0.0; THROUGH];
        lagrange(&times[..end - first], look.time, &mut weights[..end - first]);
        let mut places = [Vector3::zeros(); PLACES];
        for (other, weight) in self.looks[first..end].iter().zip(weights) {
            for (place, at) in places.iter_mut().zip(&other.places) {
                *place += at * weight;
            }
        }
        Some(places)
    }
}
