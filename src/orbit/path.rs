//! Positions in time.

use nalgebra::{SVector, Vector2, Vector3};

use super::OrbitError;
use crate::error::ParameterError;

/// Positions of a tip in time. Times (s) increase; positions are in the fixed frame, m.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    times: Vec<f64>,
    positions: Vec<Vector3<f64>>,
}

/// A path as it is seen along an axis: two coordinates, m. Counterclockwise is as seen by an observer towards whom the axis points.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanePath {
    pub(super) times: Vec<f64>,
    pub(super) positions: Vec<Vector2<f64>>,
}

/// Refuses times and positions that make no path.
fn check(times: &[f64], finite: impl ExactSizeIterator<Item = bool>) -> Result<(), OrbitError> {
    if times.len() != finite.len() {
        return Err(OrbitError::Unequal { times: times.len(), positions: finite.len() });
    }
    if let Some(index) = times.iter().position(|t| !t.is_finite()) {
        return Err(OrbitError::NotFinite { what: "time", index });
    }
    let mut finite = finite;
    if let Some(index) = finite.position(|finite| !finite) {
        return Err(OrbitError::NotFinite { what: "position", index });
    }
    match (1..times.len()).find(|&i| times[i] <= times[i - 1]) {
        Some(index) => Err(OrbitError::NotLater { index, time: times[index] }),
        None => Ok(()),
    }
}

/// The mean of each `count` times in a row, and of the positions at them.
fn averages<const N: usize>(
    times: &[f64],
    positions: &[SVector<f64, N>],
    count: usize,
) -> Result<(Vec<f64>, Vec<SVector<f64, N>>), OrbitError> {
    ParameterError::unless(count > 0, "number of positions to average", count as f64, "at least 1")?;
    if count > times.len() {
        return Err(OrbitError::TooFew { positions: times.len(), needed: count });
    }
    let share = 1.0 / count as f64;
    let middle = times.windows(count).map(|w| w.iter().sum::<f64>() * share).collect();
    let mean = positions.windows(count).map(|w| w.iter().sum::<SVector<f64, N>>() * share).collect();
    Ok((middle, mean))
}

impl Path {
    /// Takes times and the positions at them.
    ///
    /// # Errors
    /// Unequal numbers, times that repeat or go backwards, or a number that is none.
    pub fn new(times: Vec<f64>, positions: Vec<Vector3<f64>>) -> Result<Self, OrbitError> {
        check(&times, positions.iter().map(|p| p.iter().all(|x| x.is_finite())))?;
        Ok(Self { times, positions })
    }

    /// Times, s.
    #[must_use]
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Positions, m.
    #[must_use]
    pub fn positions(&self) -> &[Vector3<f64>] {
        &self.positions
    }

    /// The path as it is seen along an axis. Along the vertical, e3, the two coordinates are those along e1 and e2; along another axis the
    /// second is that along axis × e3 turned by a quarter, and the first is level.
    ///
    /// # Errors
    /// An axis that is zero or not finite.
    pub fn seen_along(&self, axis: &Vector3<f64>) -> Result<PlanePath, OrbitError> {
        let norm = axis.norm();
        ParameterError::unless(norm > 0.0 && norm.is_finite(), "axis", norm, "a vector that is not zero")?;
        let axis = axis / norm;
        let level = Vector3::z().cross(&axis);
        let first = if level.norm() > 1e-9 { level.normalize() } else { Vector3::x() };
        let second = axis.cross(&first);
        let positions = self.positions.iter().map(|p| Vector2::new(p.dot(&first), p.dot(&second))).collect();
        Ok(PlanePath { times: self.times.clone(), positions })
    }

    /// The mean of each `count` positions in a row, at the mean of their times, as long as there are so many.
    ///
    /// # Errors
    /// None to average, or a path with fewer.
    pub fn moving_average(&self, count: usize) -> Result<Self, OrbitError> {
        let (times, positions) = averages(&self.times, &self.positions, count)?;
        Self::new(times, positions)
    }
}

impl PlanePath {
    /// Takes times and two coordinates, as a camera gives them. The second one points up: an image's often points down, and then senses
    /// are reversed.
    ///
    /// # Errors
    /// Those of [`Path::new`].
    pub fn new(times: Vec<f64>, positions: Vec<Vector2<f64>>) -> Result<Self, OrbitError> {
        check(&times, positions.iter().map(|p| p.iter().all(|x| x.is_finite())))?;
        Ok(Self { times, positions })
    }

    /// Times, s.
    #[must_use]
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Positions, m.
    #[must_use]
    pub fn positions(&self) -> &[Vector2<f64>] {
        &self.positions
    }

    /// The mean of each `count` positions in a row, as [`Path::moving_average`].
    ///
    /// # Errors
    /// None to average, or a path with fewer.
    pub fn moving_average(&self, count: usize) -> Result<Self, OrbitError> {
        let (times, positions) = averages(&self.times, &self.positions, count)?;
        Self::new(times, positions)
    }

    /// The part from one time to another (s), both included.
    #[must_use]
    pub fn between(&self, from: f64, to: f64) -> Self {
        let first = self.times.partition_point(|t| *t < from);
        let end = self.times.partition_point(|t| *t <= to).max(first);
        Self { times: self.times[first..end].to_vec(), positions: self.positions[first..end].to_vec() }
    }
}
