//! Tip tracks are positions in a plane at increasing times. Their drift is motion slower than a
//! given period, such as growth and the course of the day.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, SVector, Vector2, Vector3};

use super::TrackingError;
use super::statistics::{GAMMA_MEDIAN, chosen, median};
use crate::error::ParameterError;

/// Largest number of windows. The shortest of them take a microsecond, so that more of them take
/// hours: the unit of the time between windows is wrong.
const MOST_WINDOWS: usize = 1_000_000_000;

/// Tip track in a plane: two coordinates (m) at increasing times (s).
///
/// Counterclockwise is from the first coordinate towards the second.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    pub(super) times: Vec<f64>,
    pub(super) positions: Vec<Vector2<f64>>,
}

/// Returns an error unless times increase, times and positions are finite, and their numbers are
/// equal.
fn check<const D: usize>(
    times: &[f64],
    positions: &[SVector<f64, D>],
) -> Result<(), TrackingError> {
    let problem = |index: usize| match (times.get(index), positions.get(index)) {
        (None, _) => Some("has no time"),
        (_, None) => Some("does not exist, though there is a time"),
        (Some(t), _) if !t.is_finite() => Some("has a time that is not finite"),
        (_, Some(position)) if !position.iter().all(|x| x.is_finite()) => Some("is not finite"),
        (Some(t), _) if index > 0 && *t <= times[index - 1] => {
            Some("has a time that is not later than the one before it")
        }
        _ => None,
    };
    let first = (0..times.len().max(positions.len()))
        .find_map(|index| problem(index).map(|problem| (index, problem)));
    first.map_or(Ok(()), |(index, problem)| {
        Err(TrackingError::Position { index, problem })
    })
}

impl Track {
    /// Track of two coordinates (m) at given times (s), as a camera records them. The second
    /// coordinate points up. If that of an image points down, all senses of rotation are reversed.
    ///
    /// # Errors
    /// Different numbers of times and positions, times that do not increase, or numbers that are
    /// not finite.
    pub fn new(times: Vec<f64>, positions: Vec<Vector2<f64>>) -> Result<Self, TrackingError> {
        check(&times, &positions)?;
        Ok(Self { times, positions })
    }

    /// Projection of positions in the fixed frame (m) at given times (s) along an axis, which
    /// points towards the observer. For the vertical axis e3 the coordinates are those along e1 and
    /// e2. For another axis the first coordinate is horizontal, along e3 × axis, and the second one
    /// is along axis × (e3 × axis).
    ///
    /// # Errors
    /// The errors of [`new`](Self::new), or an axis that is zero or not finite.
    pub fn seen_along(
        axis: &Vector3<f64>,
        times: Vec<f64>,
        positions: &[Vector3<f64>],
    ) -> Result<Self, TrackingError> {
        check(&times, positions)?;
        let norm = axis.norm();
        ParameterError::unless(
            norm > 0.0 && norm.is_finite(),
            "norm of the axis",
            norm,
            "positive and finite",
        )?;
        let axis = axis / norm;
        let level = Vector3::z().cross(&axis);
        let first = if level.norm() > 1e-9 {
            level.normalize()
        } else {
            Vector3::x()
        };
        let second = axis.cross(&first);
        let positions = positions
            .iter()
            .map(|p| Vector2::new(p.dot(&first), p.dot(&second)))
            .collect();
        Self::new(times, positions)
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
        self.times
            .first()
            .zip(self.times.last())
            .map_or(0.0, |(first, last)| last - first)
    }

    /// Mean of every `count` successive positions, at the mean of their times.
    ///
    /// # Errors
    /// A count of zero, or a track with fewer positions.
    pub fn moving_average(&self, count: usize) -> Result<Self, TrackingError> {
        ParameterError::unless(
            count > 0,
            "number of positions to average",
            count as f64,
            "at least 1",
        )?;
        TrackingError::unless_positions(count, self.times.len())?;
        let share = 1.0 / count as f64;
        let times = self
            .times
            .windows(count)
            .map(|w| w.iter().sum::<f64>() * share)
            .collect();
        let mean = self
            .positions
            .windows(count)
            .map(|w| w.iter().sum::<Vector2<f64>>() * share)
            .collect();
        Self::new(times, mean)
    }

    /// Part of the track between two times (s), including both.
    #[must_use]
    pub fn between(&self, from: f64, to: f64) -> Self {
        let first = self.times.partition_point(|t| *t < from);
        let end = self.times.partition_point(|t| *t <= to).max(first);
        Self {
            times: self.times[first..end].to_vec(),
            positions: self.positions[first..end].to_vec(),
        }
    }

    /// The track in another unit of length.
    pub(super) fn in_unit(&self, unit: f64) -> Self {
        Self {
            times: self.times.clone(),
            positions: self.positions.iter().map(|p| p / unit).collect(),
        }
    }

    /// The largest power of two up to the median size of a position, m. If the median is zero, the
    /// largest size replaces it. The unit is 1 m if all positions are zero. Squares of positions in
    /// this unit neither overflow nor underflow, except those of outliers, and the conversion is
    /// exact.
    pub(super) fn unit(&self) -> f64 {
        let typical = median(self.positions.iter().map(Vector2::amax).collect());
        let size = if typical > 0.0 { typical } else { self.size() };
        if size > 0.0 {
            size.log2().floor().clamp(-1022.0, 1023.0).exp2()
        } else {
            1.0
        }
    }

    /// Largest modulus of a coordinate, m.
    pub(super) fn size(&self) -> f64 {
        self.positions.iter().map(Vector2::amax).fold(0.0, f64::max)
    }

    /// The positions for which `kept` is true.
    pub(super) fn filtered(&self, kept: &[bool]) -> Self {
        Self {
            times: chosen(&self.times, kept),
            positions: chosen(&self.positions, kept),
        }
    }

    /// Windows of `length` seconds, one every `every` seconds: the centre (s), and the part of the
    /// track in it. The first window begins with the track, and the last one ends within it. A
    /// window in a gap is empty.
    ///
    /// ```
    /// # use morphorod::tracking::{Search, Track};
    /// # use nalgebra::Vector2;
    /// # let times: Vec<f64> = (0..400).map(|k| 60.0 * f64::from(k)).collect();
    /// # let at = |t: &f64| Vector2::new((t / 229.0).cos(), (t / 229.0).sin());
    /// # let track = Track::new(times.clone(), times.iter().map(at).collect())?;
    /// for (centre, window) in track.windows(2.0 * 3600.0, 600.0)? {
    ///     println!("{centre} s: {:?}", window.share(1440.0, &Search::default()));
    /// }
    /// # Ok::<(), morphorod::tracking::TrackingError>(())
    /// ```
    ///
    /// # Errors
    /// A length or a time between windows that is not positive, a track that is shorter than one
    /// window, or more than 1e9 windows.
    pub fn windows(
        &self,
        length: f64,
        every: f64,
    ) -> Result<impl Iterator<Item = (f64, Self)> + '_, TrackingError> {
        ParameterError::positive("length of a window", length, "s")?;
        ParameterError::positive("time from one window to the next", every, "s")?;
        let (start, duration) = (self.times.first().copied().unwrap_or(0.0), self.duration());
        TrackingError::unless_at_least(
            length,
            "duration of the track (s), that of a window,",
            duration,
        )?;
        let count = whole_steps(duration - length, every).saturating_add(1);
        let (name, requirement) = (
            "time from one window to the next",
            "such that there are at most 1e9 windows (s)",
        );
        ParameterError::unless(count <= MOST_WINDOWS, name, every, requirement)?;
        let beginnings = (0..count).map(move |k| start + every * k as f64);
        Ok(beginnings.map(move |from| (from + 0.5 * length, self.between(from, from + length))))
    }

    /// The direction angle of the velocity at every position: ψ_g of Bastien and Meroz (2016), from
    /// the first coordinate towards the second, unwrapped (rad). It increases by 2π in a
    /// counterclockwise turn, decreases by 2π in a clockwise one, and changes by ±π where a tip
    /// swings in a plane. Velocities are differences of both neighbours. Noise that is not small
    /// against a step should be removed before; [`Nutation::direction`](super::Nutation::direction)
    /// does so. A tip at rest keeps its last direction.
    ///
    /// # Errors
    /// Fewer than two positions.
    pub fn direction(&self) -> Result<Vec<f64>, TrackingError> {
        let n = self.positions.len();
        TrackingError::unless_positions(2, n)?;
        let velocity =
            |i: usize| self.positions[(i + 1).min(n - 1)] - self.positions[i.saturating_sub(1)];
        let moving = |v: &Vector2<f64>| v.x != 0.0 || v.y != 0.0;
        let angle = |i: usize| Some(velocity(i)).filter(moving).map(|v| v.y.atan2(v.x));
        // Before its first motion the tip has the direction of that motion.
        let (first, mut last) = ((0..n).find_map(angle).unwrap_or(0.0), None);
        let unwrapped = |angle: Option<f64>| {
            last = angle
                .map(|angle| last.map_or(angle, |last| nearest_turn(angle, last)))
                .or(last);
            last.unwrap_or(first)
        };
        Ok((0..n).map(angle).map(unwrapped).collect())
    }

    /// The drift of a track at its own times, by local quadratic regression with Gaussian weights
    /// (Cleveland and Loader 1996). Times need not be evenly spaced. Away from the ends and from
    /// gaps the drift contains the share (1 + u) e⁻ᵘ of a wave with period P, with u = 1.678
    /// (`period`/P)²:
    ///
    /// | P over `period` | 1/2 | 1 | 2 | 4 | 10 |
    /// |---|---|---|---|---|---|
    /// | share in the drift | 0.009 | 1/2 | 0.93 | 0.995 | 0.9999 |
    ///
    /// At distances below `period`/2 from an end the drift contains more fast motion; at the end
    /// itself about as much as of a motion twice as slow. A parabola is drift entirely. The time to
    /// compute it is proportional to the number of positions and to their number in 2.9 periods.
    ///
    /// # Errors
    /// A period that is not positive or longer than the track, or fewer than four positions.
    pub fn drift(&self, period: f64) -> Result<Self, TrackingError> {
        ParameterError::positive("period at which drift begins", period, "s")?;
        // One more than the number of coefficients of a parabola.
        TrackingError::unless_positions(4, self.times.len())?;
        let duration = self.times[self.times.len() - 1] - self.times[0];
        TrackingError::unless_at_least(period, "duration of the track (s)", duration)?;
        let width = period * (2.0 * GAMMA_MEDIAN).sqrt() / TAU;
        // The weights are 4e-6 at five standard deviations, where they are truncated.
        let reach = 5.0;
        let fitted = self.times.iter().enumerate().map(|(i, t)| {
            let begin = self
                .times
                .partition_point(|other| t - other > reach * width);
            let near = self.times[begin..].iter().zip(&self.positions[begin..]);
            let near = near
                .map(|(other, p)| ((other - t) / width, p))
                .take_while(|(u, _)| *u <= reach);
            parabola(near, &self.positions[i])
        });
        Ok(Self {
            times: self.times.clone(),
            positions: fitted.collect(),
        })
    }

    /// The track less its [`drift`](Self::drift). It contains at least 99 % of waves with less than
    /// half of the given period.
    ///
    /// # Errors
    /// The errors of [`drift`](Self::drift).
    pub fn without_drift(&self, period: f64) -> Result<Self, TrackingError> {
        let drift = self.drift(period)?;
        let positions = self
            .positions
            .iter()
            .zip(&drift.positions)
            .map(|(p, slow)| p - slow)
            .collect();
        Ok(Self {
            times: drift.times,
            positions,
        })
    }
}

/// Number of whole steps in a duration, up to rounding of their quotient.
pub(super) fn whole_steps(duration: f64, step: f64) -> usize {
    (duration / step * (1.0 + 4.0 * f64::EPSILON)).floor() as usize
}

/// The angle that differs from `angle` by whole turns and is nearest to `other`.
pub(super) fn nearest_turn(angle: f64, other: f64) -> f64 {
    angle + TAU * ((other - angle) / TAU).round()
}

/// The share of a wave with a period (s) that the drift for the period `drift` (s) contains. It is
/// a half if both are equal.
pub(super) fn in_drift(period: f64, drift: f64) -> f64 {
    let u = GAMMA_MEDIAN * (drift / period).powi(2);
    (1.0 + u) * (-u).exp()
}

/// The value at zero of the parabola that fits neighbouring positions best. Distances are in
/// standard deviations of the weights. Positions are taken relative to that in the `middle`, which
/// avoids cancellation.
fn parabola<'a>(
    near: impl Iterator<Item = (f64, &'a Vector2<f64>)>,
    middle: &Vector2<f64>,
) -> Vector2<f64> {
    let (mut moments, mut right) = ([0.0; 5], [Vector2::zeros(); 3]);
    for (u, position) in near {
        let mut term = (-0.5 * u * u).exp();
        for (k, moment) in moments.iter_mut().enumerate() {
            *moment += term;
            if let Some(right) = right.get_mut(k) {
                *right += (position - middle) * term;
            }
            term *= u;
        }
    }
    let matrix = Matrix3::from_fn(|i, j| moments[i + j]);
    // One or two positions between gaps do not determine a parabola: its last pivot is rounding.
    // Such positions are their own drift.
    let determined = |last: f64| last.powi(2) > f64::EPSILON.sqrt() * moments[4];
    let factors = matrix
        .cholesky()
        .filter(|factors| determined(factors.l_dirty()[(2, 2)]));
    let Some(inverse) = factors.map(|factors| factors.solve(&Vector3::x())) else {
        return *middle;
    };
    let change = right[0] * inverse[0] + right[1] * inverse[1] + right[2] * inverse[2];
    if change.iter().all(|x| x.is_finite()) {
        middle + change
    } else {
        *middle
    }
}
