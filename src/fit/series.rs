//! Data of a fit: positions or angles of the tip, or centre lines, at increasing times, in a view.

use std::f64::consts::TAU;

use nalgebra::{Vector2, Vector3};

use super::error::{FitError, refuse};
use crate::tracking::{Track, median, median_gap, robust_deviation};

/// Largest absolute value of a coordinate, in the unit of the data, and of an entry of a camera
/// matrix.
const LARGEST: f64 = 1e9;

/// Largest absolute value of an angle, rad.
const LARGEST_ANGLE: f64 = 2.0 * TAU;

/// Rough noise of one or two frames, relative to the largest coordinate. Their weight is small
/// until it is estimated.
const UNKNOWN: f64 = 0.01;

/// Smallest noise relative to the largest coordinate. Simulations are accurate to 1e-12 at best.
const LEAST_NOISE: f64 = 1e-12;

/// Largest noise relative to the largest coordinate, above which the data contain no information.
const MOST_NOISE: f64 = 1e3;

/// Rough noise of an exact track, relative to its largest coordinate.
const EXACT: f64 = 1e-6;

/// Distance of neighbouring points of a centre line over the median distance, and over the sum of
/// all others, above which it is not a part of the line. Distances by unequal digitisation differ
/// less.
const JUMP: [f64; 2] = [5.0, 0.25];

/// Interval of the frames of a tip over the time step below which the tip is interpolated between
/// the steps.
const DENSE: f64 = 0.5;

/// Linear view of space: one, two or three coordinates, each the product of a position (m, fixed
/// frame, base at the origin) with a vector.
#[derive(Debug, Clone, PartialEq)]
#[must_use]
pub struct View(pub(super) Vec<Vector3<f64>>);

impl View {
    /// View with all three coordinates in the fixed frame, along e1, e2 and e3.
    pub fn space() -> Self {
        Self(vec![Vector3::x(), Vector3::y(), Vector3::z()])
    }

    /// View from above, with coordinates along e1 and e2.
    pub fn above() -> Self {
        Self(vec![Vector3::x(), Vector3::y()])
    }

    /// View from the side in the direction of e2, with coordinates along e1 and e3.
    pub fn side() -> Self {
        Self(vec![Vector3::x(), Vector3::z()])
    }

    /// View with the given rows of a camera matrix (without unit), one for each coordinate of the
    /// image.
    ///
    /// # Errors
    /// [`Parameter`](FitError::Parameter) for no row, for more than two, for a row of zeros, and
    /// for numbers that are not finite or beyond 1e9.
    pub fn matrix(rows: &[Vector3<f64>]) -> Result<Self, FitError> {
        let sound = |row: &Vector3<f64>| row.iter().all(|x| x.abs() <= LARGEST) && row.norm() > 0.0;
        let ok = (1..=2).contains(&rows.len()) && rows.iter().all(sound);
        let requirement = "must have one or two rows of numbers up to 1e9, none of which is zero";
        refuse(&[(!ok, requirement)]).map_err(|problem| FitError::Parameter {
            name: "view".into(),
            problem,
        })?;
        Ok(Self(rows.to_vec()))
    }

    /// Image of a vector. Coordinates that the view does not have are zero.
    pub(super) fn image(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|k, _| self.0.get(k).map_or(0.0, |row| row.dot(vector)))
    }
}

/// Measured positions or angles at increasing times in a view. Frames may be missing.
#[derive(Debug, Clone, PartialEq)]
#[must_use]
pub struct Series {
    pub(super) times: Vec<f64>,
    /// Points of the centre line in each frame. The last one is the tip. The arc lengths of the
    /// others are unknown. Coordinates that the view does not have are zero.
    pub(super) frames: Vec<Vec<Vector3<f64>>>,
    /// Whether the first coordinate of a point is the angle (rad) of the tangent at the tip in the
    /// plane of the view.
    pub(super) is_angle: bool,
    /// Number of coordinates that the view must have for these data.
    given: usize,
    pub(super) view: View,
    /// Standard deviation of a coordinate, in the unit of the data, or of an angle, rad; `None` if
    /// it is estimated.
    pub(super) noise: Option<f64>,
    /// Name of the parameter by which the coordinates of the view are multiplied.
    pub(super) scale: Option<String>,
    /// Names of the parameters that are added to the coordinates of the view.
    pub(super) offset: Option<Vec<String>>,
}

impl Series {
    fn new(times: Vec<f64>, frames: Vec<Vec<Vector3<f64>>>, (given, view): (usize, View)) -> Self {
        Self {
            times,
            frames,
            is_angle: false,
            given,
            view,
            noise: None,
            scale: None,
            offset: None,
        }
    }

    /// Positions of the tip (m, fixed frame) at increasing times (s).
    pub fn tips(times: Vec<f64>, positions: &[Vector3<f64>]) -> Self {
        Self::centre_lines(times, positions.iter().map(|p| vec![*p]).collect())
    }

    /// Track of the tip (s, m) in a view with two coordinates.
    pub fn track(track: &Track, view: View) -> Self {
        let lines: Vec<_> = track.positions().iter().map(|p| vec![*p]).collect();
        Self::centre_lines_in(track.times().to_vec(), &lines, view)
    }

    /// One coordinate (m) of the tip at times (s), such as its height, in a view with one row.
    pub fn coordinates(times: Vec<f64>, coordinates: &[f64], view: View) -> Self {
        Self::new(
            times,
            coordinates
                .iter()
                .map(|x| vec![Vector3::new(*x, 0.0, 0.0)])
                .collect(),
            (1, view),
        )
    }

    /// Points on centre lines (m, fixed frame) at times (s). The last point of a line is the tip.
    /// The arc lengths of the others are unknown, and they are compared with the nearest points of
    /// the simulated line.
    pub fn centre_lines(times: Vec<f64>, lines: Vec<Vec<Vector3<f64>>>) -> Self {
        Self::new(times, lines, (3, View::space()))
    }

    /// Points on centre lines in a view with two coordinates (m): see
    /// [`centre_lines`](Self::centre_lines).
    pub fn centre_lines_in(times: Vec<f64>, lines: &[Vec<Vector2<f64>>], view: View) -> Self {
        let frames = lines
            .iter()
            .map(|line| line.iter().map(|p| Vector3::new(p.x, p.y, 0.0)).collect())
            .collect();
        Self::new(times, frames, (2, view))
    }

    /// Angles of the tangent at the tip (rad) at times (s), in a view with two coordinates. They
    /// are measured from the first coordinate towards the second, up to whole turns, and are at
    /// most two turns. In [`View::side`] an upright tip has the angle π/2.
    pub fn angles(times: Vec<f64>, angles: &[f64], view: View) -> Self {
        Self {
            is_angle: true,
            given: 2,
            ..Self::coordinates(times, angles, view)
        }
    }

    /// Sets the standard deviation of each coordinate, in the unit of the data, or of each angle,
    /// rad. By default it is estimated.
    pub fn with_noise(self, noise: f64) -> Self {
        Self {
            noise: Some(noise),
            ..self
        }
    }

    /// Names the parameter by which the coordinates of the view (m) are multiplied. It has the unit
    /// of the data per metre, and the data may then have any unit.
    pub fn with_scale(self, name: &str) -> Self {
        Self {
            scale: Some(name.to_owned()),
            ..self
        }
    }

    /// Names the parameters that are added to the coordinates of the view, one for each, after
    /// their multiplication by the scale. They have the unit of the data and are the coordinates of
    /// the base.
    pub fn with_offset(self, names: &[&str]) -> Self {
        Self {
            offset: Some(names.iter().map(|name| (*name).to_owned()).collect()),
            ..self
        }
    }

    /// Times of the frames, s.
    #[must_use]
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Points of the frames, in the unit of the data. Coordinates that the view does not have are
    /// zero. The only point of a frame of angles has the angle (rad) as its first coordinate.
    #[must_use]
    pub fn frames(&self) -> &[Vec<Vector3<f64>>] {
        &self.frames
    }

    /// Indices, from 0, of the frames that are equal to the frame before them, such as duplicated
    /// frames of a video.
    #[must_use]
    pub fn repeated_frames(&self) -> Vec<usize> {
        (1..self.frames.len())
            .filter(|k| self.frames[*k] == self.frames[k - 1])
            .collect()
    }

    /// Number of coordinates of a point that are compared: those of the view, or one for an angle.
    pub(super) fn dimension(&self) -> usize {
        if self.is_angle { 1 } else { self.view.0.len() }
    }

    /// The same data in units of length and time that are smaller by two factors. Angles have no
    /// length.
    pub(super) fn scaled(&self, [length, time]: [f64; 2]) -> Self {
        let length = if self.is_angle { 1.0 } else { length };
        let frames = self
            .frames
            .iter()
            .map(|frame| frame.iter().map(|point| point * length).collect())
            .collect();
        Self {
            times: self.times.iter().map(|t| t * time).collect(),
            frames,
            ..self.clone()
        }
    }

    /// Whether another series has the same data and the same noise.
    pub(super) fn equals(&self, other: &Self) -> bool {
        (
            &self.times,
            &self.frames,
            self.is_angle,
            &self.view,
            self.noise,
        ) == (
            &other.times,
            &other.frames,
            other.is_angle,
            &other.view,
            other.noise,
        )
    }

    /// Number of residuals: all coordinates of a tip, and one fewer for any other point of a centre
    /// line, whose residual is across the tangent.
    pub(super) fn count(&self) -> usize {
        let d = self.dimension();
        self.frames
            .iter()
            .filter(|frame| !frame.is_empty())
            .map(|frame| d + (d - 1) * (frame.len() - 1))
            .sum()
    }

    /// Last point of a frame, in the unit of the data, or rad.
    pub(super) fn last_point(&self, frame: usize) -> Vector3<f64> {
        self.frames[frame][self.frames[frame].len() - 1]
    }

    /// Standard deviation of the coordinates of the last points of all frames, in the unit of the
    /// data, or rad.
    pub(super) fn deviation(&self) -> f64 {
        let (points, count) = (
            (0..self.frames.len()).map(|k| self.last_point(k)),
            self.frames.len() as f64,
        );
        let mean = points.clone().sum::<Vector3<f64>>() / count;
        (points
            .map(|point| (point - mean).norm_squared())
            .sum::<f64>()
            / (count * self.dimension() as f64))
            .sqrt()
    }

    /// Number of residuals without those of coordinates of the tip that are zero in all frames, as
    /// those across the plane of a shoot. They show nothing of the noise.
    pub(super) fn varying_count(&self) -> usize {
        let zero = |k: &usize| self.frames.iter().flatten().all(|point| point[*k] == 0.0);
        self.count() - (0..self.dimension()).filter(zero).count() * self.frames.len()
    }

    /// Median time between frames, s; infinite for a single frame.
    pub(super) fn spacing(&self) -> f64 {
        if self.times.len() < 2 {
            f64::INFINITY
        } else {
            median_gap(&self.times)
        }
    }

    /// Whether the frames have only a tip, and are so close that time steps (s) to each of them
    /// would be far shorter than necessary.
    pub(super) fn is_dense(&self, step: f64) -> bool {
        self.spacing() < DENSE * step && self.frames.iter().all(|frame| frame.len() == 1)
    }

    /// Largest distance of a point from the origin of the view, in the unit of the data, or largest
    /// angle, rad.
    pub(super) fn extent(&self) -> f64 {
        self.frames
            .iter()
            .flatten()
            .map(Vector3::norm)
            .fold(0.0, f64::max)
    }

    /// Largest distance of a point from the origin of the view, in the unit of the data; a radian
    /// for angles.
    pub(super) fn size(&self) -> f64 {
        if self.is_angle { 1.0 } else { self.extent() }
    }

    /// Returns an error unless the series is valid, and begins at the `start` (s) of the shoot or
    /// later. `series` is the index of the series in messages.
    pub(super) fn check(&self, series: usize, start: f64) -> Result<(), FitError> {
        let Self {
            times,
            frames,
            noise,
            is_angle,
            ..
        } = self;
        let of_series = |problem| FitError::Series { series, problem };
        let has_camera = self.scale.is_some() || self.offset.is_some();
        let is_other_than = |names: &Vec<String>| names.len() != self.dimension();
        let conditions = [
            (times.is_empty() && frames.is_empty(), "has no frames"),
            (
                times.len() != frames.len(),
                "has different numbers of times and positions",
            ),
            (
                self.given != self.view.0.len(),
                "has not as many coordinates as its view",
            ),
            (
                noise.is_some_and(|x| !(x > 0.0 && x.is_finite())),
                "has a noise that is not positive and finite",
            ),
            (
                self.offset.as_ref().is_some_and(is_other_than),
                "has not as many offsets as coordinates",
            ),
            (
                *is_angle && has_camera,
                "has angles, which have no scale and offset",
            ),
            (
                *is_angle && self.extent() > LARGEST_ANGLE,
                "has an angle beyond two turns: is the unit rad?",
            ),
        ];
        refuse(&conditions).map_err(of_series)?;
        for (frame, (time, points)) in times.iter().zip(frames).enumerate() {
            let are_finite = points.iter().flatten().all(|x| x.abs() <= LARGEST);
            let early = "has a time before that of the shoot of the family: count times from its start, and do not \
                advance it";
            let jump = "has neighbouring points at a large distance: are they of one plant, in order from the base?";
            let conditions = [
                (!time.is_finite(), "has a time that is not finite"),
                (*time < start, early),
                (
                    frame > 0 && *time <= times[frame - 1],
                    "has a time that is not later than the one before it",
                ),
                (points.is_empty(), "has no points"),
                (
                    !are_finite,
                    "has a coordinate that is not finite or beyond 1e9",
                ),
                (has_jump(points), jump),
            ];
            refuse(&conditions).map_err(|problem| FitError::Frame {
                series,
                frame,
                problem,
            })?;
        }
        let is_constant = frames.len() > 1 && frames.iter().all(|frame| *frame == frames[0]);
        let relative = noise.map_or(1.0, |noise| noise / self.size());
        let large =
            "has a noise far above all of its coordinates: is its unit that of the coordinates?";
        let conditions = [
            (is_constant, "is constant: all of its frames are equal"),
            (
                relative < LEAST_NOISE,
                "has a noise below the rounding of its coordinates",
            ),
            (relative > MOST_NOISE, large),
        ];
        refuse(&conditions).map_err(of_series)
    }

    /// Scatter of neighbouring frames: a robust estimate of the noise from second differences of
    /// their last points, in the unit of the data, or rad. It is positive.
    pub(super) fn scatter(&self) -> f64 {
        let largest = self.extent().max(f64::MIN_POSITIVE);
        let point = |k: usize| self.last_point(k);
        let second = (2..self.frames.len()).map(|k| point(k) - point(k - 1) * 2.0 + point(k - 2));
        let second = second.flat_map(|second| (0..self.dimension()).map(move |k| second[k]));
        // The variance of a second difference of white noise is six times that of the noise.
        match robust_deviation(second) / 6.0_f64.sqrt() {
            _ if self.frames.len() < 3 => largest * UNKNOWN,
            scatter if scatter > 0.0 => scatter,
            _ => largest * EXACT,
        }
    }
}

/// First and last time of the frames of all series, s.
pub(super) fn span(data: &[Series]) -> [f64; 2] {
    let times = || data.iter().flat_map(|series| series.times.iter().copied());
    [
        times().fold(f64::INFINITY, f64::min),
        times().fold(f64::NEG_INFINITY, f64::max),
    ]
}

/// Whether one distance of neighbouring points of a frame is far above the others, as between the
/// tip of a plant and the base of the next one. Four distances show what is normal.
fn has_jump(points: &[Vector3<f64>]) -> bool {
    let chords: Vec<f64> = points
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).norm())
        .collect();
    let (longest, sum) = (
        chords.iter().copied().fold(0.0, f64::max),
        chords.iter().sum::<f64>(),
    );
    chords.len() >= 4 && longest > JUMP[0] * median(chords) && longest > JUMP[1] * (sum - longest)
}
