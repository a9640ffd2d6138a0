//! Tip tracks: positions in time.

use nalgebra::{Vector2, Vector3};

use super::TrackingError;
use crate::error::ParameterError;

/// Positions of a tip in the fixed frame (m) at increasing times (s).
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    times: Vec<f64>,
    positions: Vec<Vector3<f64>>,
}

/// A tip track projected along an axis: two coordinates (m) at increasing times (s). Counterclockwise is as seen by an
/// observer towards whom the axis points.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneTrack {
    pub(super) times: Vec<f64>,
    pub(super) positions: Vec<Vector2<f64>>,
}

/// Returns an error unless times increase, positions are finite, and their numbers are equal.
fn check(times: &[f64], mut finite: impl ExactSizeIterator<Item = bool>) -> Result<(), TrackingError> {
    if times.len() != finite.len() {
        return Err(TrackingError::Unequal { times: times.len(), positions: finite.len() });
    }
    if let Some(index) = times.iter().position(|t| !t.is_finite()) {
        return Err(TrackingError::NotFinite { what: "time", index });
    }
    if let Some(index) = finite.position(|finite| !finite) {
        return Err(TrackingError::NotFinite { what: "position", index });
    }
    match (1..times.len()).find(|&i| times[i] <= times[i - 1]) {
        Some(index) => Err(TrackingError::NotLater { index, time: times[index] }),
        None => Ok(()),
    }
}

impl Track {
    /// A track of positions at given times.
    ///
    /// # Errors
    /// Different numbers of times and positions, times that do not increase, or numbers that are not finite.
    pub fn new(times: Vec<f64>, positions: Vec<Vector3<f64>>) -> Result<Self, TrackingError> {
        check(&times, positions.iter().map(|p| p.iter().all(|x| x.is_finite())))?;
        Ok(Self { times, positions })
    }

    /// The projection of the track along an axis. For the vertical axis e3 the coordinates are those along e1 and e2.
    /// For another axis the first coordinate is horizontal, along e3 × axis, and the second one is along axis × (e3 ×
    /// axis).
    ///
    /// # Errors
    /// An axis that is zero or not finite.
    pub fn seen_along(&self, axis: &Vector3<f64>) -> Result<PlaneTrack, TrackingError> {
        let norm = axis.norm();
        ParameterError::unless(norm > 0.0 && norm.is_finite(), "axis", norm, "a vector that is not zero")?;
        let axis = axis / norm;
        let level = Vector3::z().cross(&axis);
        let first = if level.norm() > 1e-9 { level.normalize() } else { Vector3::x() };
        let second = axis.cross(&first);
        let positions = self.positions.iter().map(|p| Vector2::new(p.dot(&first), p.dot(&second))).collect();
        Ok(PlaneTrack { times: self.times.clone(), positions })
    }
}

impl PlaneTrack {
    /// A track of two coordinates at given times, as a camera records them. The second coordinate points up: where that
    /// of an image points down, the senses of rotation are reversed.
    ///
    /// # Errors
    /// Those of [`Track::new`].
    pub fn new(times: Vec<f64>, positions: Vec<Vector2<f64>>) -> Result<Self, TrackingError> {
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

    /// Time from the first position to the last one, s; zero for an empty track.
    #[must_use]
    pub fn duration(&self) -> f64 {
        match (self.times.first(), self.times.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// The mean of every `count` successive positions, at the mean of their times.
    ///
    /// # Errors
    /// A count of zero, or a track with fewer positions.
    pub fn moving_average(&self, count: usize) -> Result<Self, TrackingError> {
        ParameterError::unless(count > 0, "number of positions to average", count as f64, "at least 1")?;
        if count > self.times.len() {
            return Err(TrackingError::TooFew { positions: self.times.len(), needed: count });
        }
        let share = 1.0 / count as f64;
        let times = self.times.windows(count).map(|w| w.iter().sum::<f64>() * share).collect();
        let mean = self.positions.windows(count).map(|w| w.iter().sum::<Vector2<f64>>() * share).collect();
        Self::new(times, mean)
    }

    /// The part between two times (s), including both.
    #[must_use]
    pub fn between(&self, from: f64, to: f64) -> Self {
        let first = self.times.partition_point(|t| *t < from);
        let end = self.times.partition_point(|t| *t <= to).max(first);
        Self { times: self.times[first..end].to_vec(), positions: self.positions[first..end].to_vec() }
    }

    /// The positions for which `kept` is true.
    pub(super) fn filtered(&self, kept: &[bool]) -> Self {
        let indices = || (0..kept.len()).filter(|i| kept[*i]);
        Self {
            times: indices().map(|i| self.times[i]).collect(),
            positions: indices().map(|i| self.positions[i]).collect(),
        }
    }

    /// Windows of a `length` (s) that start `every` given time (s): the centre of each (s), and the part of the track
    /// in it. The first window begins with the track, and the last one ends within it. A window without positions
    /// yields an error, after which the next windows follow.
    ///
    /// ```
    /// # use morphorod::tracking::{PlaneTrack, Search};
    /// # use nalgebra::Vector2;
    /// # let times: Vec<f64> = (0..400).map(|k| 60.0 * f64::from(k)).collect();
    /// # let at = |t: &f64| Vector2::new((t / 229.0).cos(), (t / 229.0).sin());
    /// # let track = PlaneTrack::new(times.clone(), times.iter().map(at).collect())?;
    /// for (centre, window) in track.windows(2.0 * 3600.0, 600.0)? {
    ///     let share = window.and_then(|window| window.share(1440.0, &Search::default()));
    ///     println!("{centre} s: {share:?}");
    /// }
    /// # Ok::<(), morphorod::tracking::TrackingError>(())
    /// ```
    ///
    /// # Errors
    /// A length or a time between windows that is not positive, or a track that is shorter than one window.
    pub fn windows(
        &self,
        length: f64,
        every: f64,
    ) -> Result<impl Iterator<Item = (f64, Result<Self, TrackingError>)> + '_, TrackingError> {
        ParameterError::positive("length of a window", length)?;
        ParameterError::positive("time from one window to the next", every)?;
        let (start, duration) = (self.times.first().copied().unwrap_or(0.0), self.duration());
        if duration < length {
            return Err(TrackingError::TooShort { duration, needed: length });
        }
        let count = whole_steps(duration - length, every).saturating_add(1);
        Ok((0..count).map(move |k| {
            let from = start + every * k as f64;
            let window = self.between(from, from + length);
            let empty = TrackingError::EmptyWindow { from, to: from + length };
            (from + 0.5 * length, if window.times.is_empty() { Err(empty) } else { Ok(window) })
        }))
    }
}

/// Number of whole steps in a duration, up to rounding of their quotient.
pub(super) fn whole_steps(duration: f64, step: f64) -> usize {
    (duration / step * (1.0 + 4.0 * f64::EPSILON)).floor() as usize
}
