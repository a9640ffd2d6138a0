//! A path in a sliding window: what it does as a function of time.

use super::OrbitError;
use super::path::PlanePath;
use crate::error::ParameterError;

impl PlanePath {
    /// The path in windows of a `length` (s), one `every` so many seconds: the centre of each (s) and the part of the path in it.
    /// The first begins with the path, the last ends within it. A window in which there is no position is an error in its place, and
    /// the next ones follow.
    ///
    /// ```
    /// # use morphorod::orbit::{PlanePath, Search};
    /// # use nalgebra::Vector2;
    /// # let times: Vec<f64> = (0..400).map(|k| 60.0 * f64::from(k)).collect();
    /// # let at = |t: &f64| Vector2::new((t / 229.0).cos(), (t / 229.0).sin());
    /// # let path = PlanePath::new(times.clone(), times.iter().map(at).collect())?;
    /// for (centre, window) in path.windows(2.0 * 3600.0, 600.0)? {
    ///     let share = window.and_then(|window| window.share(1440.0, &Search::default()));
    ///     println!("{centre} s: {share:?}");
    /// }
    /// # Ok::<(), morphorod::orbit::OrbitError>(())
    /// ```
    ///
    /// # Errors
    /// A length or a time between windows that is not positive, or a path that is shorter than one window.
    pub fn windows(
        &self,
        length: f64,
        every: f64,
    ) -> Result<impl Iterator<Item = (f64, Result<Self, OrbitError>)> + '_, OrbitError> {
        ParameterError::positive("length of a window", length)?;
        ParameterError::positive("time from one window to the next", every)?;
        let (start, duration) = (self.times.first().copied().unwrap_or(0.0), self.duration());
        if duration < length {
            return Err(OrbitError::TooShort { duration, needed: length });
        }
        // Rounding must not cost the last one.
        let count = (((duration - length) / every * (1.0 + 4.0 * f64::EPSILON)).floor() as usize).saturating_add(1);
        Ok((0..count).map(move |k| {
            let from = start + every * k as f64;
            let window = self.between(from, from + length);
            let found = if window.times.is_empty() {
                Err(OrbitError::EmptyWindow { from, to: from + length })
            } else {
                Ok(window)
            };
            (from + 0.5 * length, found)
        }))
    }

    /// From the first position to the last one, s; zero without any.
    #[must_use]
    pub fn duration(&self) -> f64 {
        match (self.times.first(), self.times.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }
}
