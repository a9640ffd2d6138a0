//! Table of the windows of a track.

use std::collections::BTreeMap;

use morphorod::tracking::{Search, Track, TrackingError};
use morphorod::tropism::Handedness;

/// Columns of the table. Unknown numbers are `NaN`.
pub const COLUMNS: [&str; 14] = [
    "t_s",
    "share",
    "period_s",
    "period_error_s",
    "major_m",
    "minor_m",
    "direction_rad",
    "counterclockwise",
    "nutates",
    "ridge_period_s",
    "ridge_period_iqr_s",
    "amplitude_m",
    "band_power",
    "noise_floor_m",
];

const BESIDE_A_GAP: &str =
    "no ridge of the wavelets because of a gap; their periods are those by least squares";

/// A row for each window, and the number of windows for each reason why numbers are missing.
pub fn rows(
    windows: &[(f64, Track)],
    band: [f64; 2],
    share: f64,
) -> (Vec<[f64; COLUMNS.len()]>, BTreeMap<String, usize>) {
    let mut failures = BTreeMap::new();
    let rows = windows
        .iter()
        .map(|window| row(window, band, share, &mut failures))
        .collect();
    (rows, failures)
}

fn row(
    (time, window): &(f64, Track),
    band: [f64; 2],
    share: f64,
    failures: &mut BTreeMap<String, usize>,
) -> [f64; COLUMNS.len()] {
    let mut count = |reason: String| *failures.entry(reason).or_default() += 1;
    let yes = |whether: bool| f64::from(u8::from(whether));
    let mut row = [f64::NAN; COLUMNS.len()];
    row[0] = *time;
    match window.share(share, &Search::default()) {
        Ok(share) => row[1] = share,
        Err(error) => count(failure("the share", &error)),
    }
    let mut moves = false;
    match window.oscillations(&Search::default()) {
        Ok(found) => {
            moves = !found.oscillations.is_empty();
            if let Some(wave) = found.oscillations.first() {
                let ellipse = wave.ellipse;
                let sense = ellipse
                    .sense
                    .map_or(f64::NAN, |sense| yes(sense == Handedness::Counterclockwise));
                let numbers = [
                    wave.period,
                    wave.period_error,
                    ellipse.major,
                    ellipse.minor,
                    ellipse.direction,
                    sense,
                ];
                row[2..8].copy_from_slice(&numbers);
            }
        }
        Err(error) => count(failure("least squares", &error)),
    }
    match window.nutation(band) {
        Ok(found) => {
            row[8] = yes(found.nutates);
            if moves && !found.nutates && !found.gaps.is_empty() {
                count(BESIDE_A_GAP.into());
            }
            if let (Some(period), Some([lower, upper]), Some(amplitude)) =
                (found.period, found.period_quartiles, found.amplitude)
            {
                row[9..12].copy_from_slice(&[period, upper - lower, amplitude]);
            }
            row[12] = found.band_power;
            row[13] = found.noise_floor.unwrap_or(f64::NAN);
        }
        Err(error) => count(failure("wavelets", &error)),
    }
    row
}

/// Reason why an analysis has no result, without numbers that differ from window to window.
fn failure(analysis: &str, error: &TrackingError) -> String {
    let reason = match error {
        TrackingError::Insufficient { what, needed, .. } => {
            format!("the {what} is less than {needed}")
        }
        other => other.to_string(),
    };
    format!("no result by {analysis}: {reason}")
}
