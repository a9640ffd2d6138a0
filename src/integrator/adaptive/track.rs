//! Positions of a shoot in a run, for the comparison of two runs.

use nalgebra::Vector3;

use super::division::longest_element;
use crate::integrator::ORDER;
use crate::integrator::stepper::StepEnd;
use crate::model::Model;
use crate::numerics::interpolation::lagrange;
use crate::shoot::Shoot;

/// Number of compared places, at equal distances along the shoot, the last of which is the apex.
/// The error is largest inside elements and far smaller at nodes. Since the number is prime, all
/// places but the apex are inside the elements of a mesh of equal elements, unless their number is
/// a multiple of it. With 17 places the error of the elements in a sharp curl at the base was three
/// times the estimate.
const PLACES: usize = 37;

/// Positions of a shoot after every step.
#[derive(Debug, Clone, Default)]
pub(super) struct PositionTrack {
    /// One sample for the start and for the end of each step, in the order of time.
    pub samples: Vec<StepSample>,
}

/// Positions at one time.
#[derive(Debug, Clone)]
pub(super) struct StepSample {
    time: f64,
    /// Smoothness of the positions at this time.
    smoothness: Smoothness,
    length: f64,
    longest_element: f64,
    in_contact: bool,
    /// Places, m.
    places: Vec<Vector3<f64>>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Smoothness {
    Smooth,
    /// The second derivative is discontinuous. Interpolation on either side includes this sample.
    Kink,
    /// The positions are discontinuous. Interpolation before this time does not include this
    /// sample.
    Jump,
    /// As for a jump, at a time that depends on the run. The sample is not compared with another
    /// run.
    ContactChange,
}

impl PositionTrack {
    /// Returns whether the shoot is in contact with an obstacle at one of the samples.
    pub fn has_contact(&self) -> bool {
        self.samples.iter().any(|sample| sample.in_contact)
    }

    /// Returns the time of the last sample, s.
    pub fn end(&self) -> f64 {
        self.samples
            .last()
            .map_or(f64::NEG_INFINITY, |sample| sample.time)
    }

    /// Appends the present positions of the shoot, after a step or at the start.
    pub fn record(&mut self, shoot: &Shoot<impl Model>, end: Option<StepEnd>) {
        let smoothness = match end {
            Some(StepEnd {
                contact_change: true,
                ..
            }) => Smoothness::ContactChange,
            Some(StepEnd {
                discontinuity: false,
                kink: false,
                ..
            }) => Smoothness::Smooth,
            Some(StepEnd {
                discontinuity: false,
                ..
            }) => Smoothness::Kink,
            _ => Smoothness::Jump,
        };
        let (length, longest_element) = (shoot.rod().length(), longest_element(&shoot.state));
        let in_contact = !shoot.state.contact.patches.is_empty();
        let mut places = Vec::with_capacity(PLACES);
        shoot
            .rod()
            .append_positions((1..=PLACES).map(|k| k as f64 / PLACES as f64), &mut places);
        // No positions are appended if the length is NaN.
        places.resize(PLACES, Vector3::repeat(f64::NAN));
        self.samples.push(StepSample {
            time: shoot.time(),
            smoothness,
            length,
            longest_element,
            in_contact,
            places,
        });
    }

    /// Returns the longest element, averaged over the steps of the run, m.
    pub fn longest_element(&self) -> f64 {
        self.samples
            .iter()
            .map(|sample| sample.longest_element)
            .sum::<f64>()
            / self.samples.len() as f64
    }

    /// Returns the largest distances between this run and a coarser one at the steps of the coarser
    /// one, relative to the length: up to the time `until` (s), and over all times. Times after the
    /// end of either run are not compared.
    pub fn distances(&self, coarser: &Self, until: f64) -> [f64; 2] {
        let mut largest = [0.0_f64; 2];
        let compared = coarser
            .samples
            .iter()
            .take_while(|sample| sample.time <= self.end());
        for sample in compared.filter(|sample| sample.smoothness != Smoothness::ContactChange) {
            let Some(places) = self.at(sample.time) else {
                continue;
            };
            for (a, b) in places.iter().zip(&sample.places) {
                // NaN counts as an infinite distance.
                let distance = (a - b).norm() / sample.length;
                largest[1] = if distance.is_nan() {
                    f64::INFINITY
                } else {
                    largest[1].max(distance)
                };
            }
            if sample.time <= until {
                largest[0] = largest[1];
            }
        }
        largest
    }

    /// Interpolates the places at a time.
    fn at(&self, time: f64) -> Option<Vec<Vector3<f64>>> {
        let near = self.samples.partition_point(|sample| sample.time < time);
        if let Some(sample) = self.samples.get(near).filter(|sample| sample.time == time) {
            return Some(sample.places.clone());
        }
        let smoothness = |i: usize| self.samples[i].smoothness;
        // Positions are interpolated through two more samples than the order of the method. The
        // first sample is at the start of the run.
        const POINTS: usize = ORDER + 2;
        let (mut first, mut end) = (near.checked_sub(1)?, near);
        while end - first < POINTS {
            let before = first
                .checked_sub(1)
                .filter(|_| smoothness(first) == Smoothness::Smooth);
            let continuous = end < self.samples.len()
                && matches!(smoothness(end), Smoothness::Smooth | Smoothness::Kink);
            let after = continuous && (end == near || smoothness(end - 1) == Smoothness::Smooth);
            match before {
                // Take half of the points from either side, if there are enough.
                Some(i) if !after || near - first <= end - near => first = i,
                _ if after => end += 1,
                _ => break,
            }
        }
        let times: [f64; POINTS] =
            std::array::from_fn(|k| self.samples[(first + k).min(end - 1)].time);
        let weights: [f64; POINTS] = lagrange(&times[..end - first], time);
        let mut places = vec![Vector3::zeros(); PLACES];
        for (other, weight) in self.samples[first..end].iter().zip(weights) {
            places
                .iter_mut()
                .zip(&other.places)
                .for_each(|(place, at)| *place += at * weight);
        }
        Some(places)
    }
}
