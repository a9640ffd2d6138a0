//! Windows of a track, and the oscillations in them.

use morphorod::tracking::{Oscillations, Search, Track, TrackingError};
use nalgebra::Vector2;

use super::mechanism::{Observation, Wave};

/// Positions by which a window is longer at each end, so that an outlier there does not make it too
/// short.
const MARGIN: usize = 2;
/// Amplitude of a circle over the standard deviation of white noise, times the root of the number
/// of positions. White noise reaches this amplitude at one of about a hundred frequencies with a
/// probability of about 1e-4.
const DETECTED: f64 = 6.0;
/// Amplitude over the largest one below which the search does not report a wave.
const BESIDE: f64 = 5e-3;

/// Longest interval between positions at the centre of a window, over the length of the window. An
/// amplitude that grows or decays is not measured by the ends of a window alone.
const CENTRAL_GAP: f64 = 0.1;

/// Length of a shoot at a time: s, m.
pub type Length = [f64; 2];

/// Centres of sliding windows (s) and the parts of the track in them. A window begins at or before
/// its nominal beginning and ends at or after its nominal end, at positions that are no outliers.
/// Lost frames therefore make it longer, never shorter. Windows with a gap at their centre are
/// omitted.
pub fn windows(
    path: &Track,
    outliers: &[usize],
    length: f64,
    every: f64,
) -> Result<Vec<(f64, Track)>, TrackingError> {
    let kept = || (0..path.times().len()).filter(|k| outliers.binary_search(k).is_err());
    let times: Vec<f64> = kept().map(|k| path.times()[k]).collect();
    let positions: Vec<Vector2<f64>> = kept().map(|k| path.positions()[k]).collect();
    let path = Track::new(times, positions)?;
    let times = path.times();
    let widened = |(centre, _): (f64, Track)| {
        let [from, to] = [centre - 0.5 * length, centre + 0.5 * length];
        let first = times
            .partition_point(|t| *t <= from)
            .saturating_sub(1 + MARGIN);
        let last = (times.partition_point(|t| *t < to) + MARGIN).min(times.len() - 1);
        (centre, path.between(times[first], times[last]))
    };
    let is_measured = |(centre, _): &(f64, Track)| {
        let after = times
            .partition_point(|t| t < centre)
            .clamp(1, times.len() - 1);
        times[after] - times[after - 1] <= CENTRAL_GAP * length
    };
    Ok(path
        .windows(length, every)?
        .filter(is_measured)
        .map(widened)
        .collect())
}

/// Oscillations in all windows that can be analysed, with the mean of the lengths in each.
pub fn observe(windows: &[(f64, Track)], lengths: &[Length]) -> Vec<Observation> {
    let observed = |(centre, window): &(f64, Track)| {
        let found = window.oscillations(&Search::default()).ok()?;
        let [first, last] = [*window.times().first()?, *window.times().last()?];
        let within: Vec<f64> = lengths
            .iter()
            .filter(|l| l[0] >= first && l[0] <= last)
            .map(|l| l[1])
            .collect();
        let length = (!within.is_empty()).then(|| within.iter().sum::<f64>() / within.len() as f64);
        Some(observation(*centre, length, &found, window.times().len()))
    };
    windows.iter().filter_map(observed).collect()
}

/// Oscillations of a window or of a track with a number of positions.
pub fn observation(
    time: f64,
    length: Option<f64>,
    found: &Oscillations,
    positions: usize,
) -> Observation {
    let wave = |wave: &morphorod::tracking::Oscillation| Wave {
        period: [wave.period, wave.period_error],
        amplitude: [wave.ellipse.major, wave.axis_error],
        harmonic: wave.harmonic.is_some(),
    };
    let waves: Vec<Wave> = found.oscillations.iter().map(wave).collect();
    let largest = waves.first().map_or(0.0, |wave| wave.amplitude[0]);
    let limit = (DETECTED * found.noise / (positions as f64).sqrt()).max(BESIDE * largest);
    Observation {
        time,
        length,
        limit,
        waves,
    }
}
