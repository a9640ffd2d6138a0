//! Oscillations of the tip in the horizontal plane, and the share of the endogenous oscillator.

use morphorod::tracking::{Oscillation, Search, Track, TrackingError};
use nalgebra::Vector3;

use super::{HOUR, MINUTE, OSCILLATOR};
use morphorod_plot::{Series, Style, println};

/// Duration of the last part of the track, s.
const RECENT: f64 = 6.0 * HOUR;
/// Half the window of a share, s.
const HALF: f64 = 2.0 * HOUR;
/// Interval between two shares, s.
const EVERY: f64 = 0.5 * HOUR;
/// Interval between two windows of the slow oscillation, s.
const STRIDE: f64 = 2.0 * HOUR;
/// Shortest period of a slow oscillation, s.
const SLOW: f64 = 2.0 * OSCILLATOR;
/// Displacement below which the tip is considered stationary, m.
const STILL: f64 = 1e-9;

/// Returns the horizontal track. The rows contain time (s), length (m) and position of the tip (m).
pub fn horizontal_track(rows: &[[f64; 5]]) -> Result<Track, TrackingError> {
    let positions: Vec<_> = rows
        .iter()
        .map(|row| Vector3::from_row_slice(&row[2..5]))
        .collect();
    Track::seen_along(
        &Vector3::z(),
        rows.iter().map(|row| row[0]).collect(),
        &positions,
    )
}

/// Prints the oscillations in the last hours.
pub fn print_last(track: &Track) {
    let last = track.times().last().copied().unwrap_or_default();
    // A run of a few minutes has too few positions for an analysis.
    let Ok(found) = track
        .between(last - RECENT, last)
        .oscillations(&Search::default())
    else {
        return;
    };
    let hours = last.min(RECENT) / HOUR;
    for wave in found.oscillations.iter().take(2) {
        let (ellipse, minutes) = (wave.ellipse, wave.period / MINUTE);
        let (major, minor) = (1e3 * ellipse.major, 1e3 * ellipse.minor);
        let sense = ellipse
            .sense
            .map_or("no definite sense".into(), |sense| sense.to_string());
        println!(
            "  last {hours} h: period {minutes:.1} min, semi-axes {major:.2} and {minor:.2} mm, {sense}"
        );
    }
}

/// Returns the largest oscillation with a period longer than [`SLOW`] in each window of [`RECENT`],
/// with the middle of the window, s.
pub fn slow_oscillations(track: &Track) -> Vec<(f64, Oscillation)> {
    let end = track.times().last().copied().unwrap_or_default();
    let count = ((end - RECENT) / STRIDE + 1e-9).floor().max(-1.0) as i32;
    let largest = |k: i32| {
        let from = STRIDE * f64::from(k);
        let found = track
            .between(from, from + RECENT)
            .oscillations(&Search::default())
            .ok()?;
        let slow = |wave: &Oscillation| wave.period > SLOW;
        let wave = found.oscillations.into_iter().find(slow)?;
        Some((from + 0.5 * RECENT, wave))
    };
    (0..=count).filter_map(largest).collect()
}

/// Prints the ellipses of the slow oscillation over time.
pub fn print_axis_ratios(track: &Track) {
    let slow = slow_oscillations(track);
    if slow.is_empty() {
        return;
    }
    let hours = RECENT / HOUR;
    println!("  slow oscillation in windows of {hours} h:");
    println!("    middle (h)  period (min)  semi-axes (mm)    axis ratio");
    for (middle, wave) in slow {
        let ellipse = wave.ellipse;
        println!(
            "    {:10.0}  {:12.2}  {:7.3}  {:7.3}  {:10.3}",
            middle / HOUR,
            wave.period / MINUTE,
            1e3 * ellipse.major,
            1e3 * ellipse.minor,
            ellipse.roundness()
        );
    }
}

/// Returns times (h) and the share of the oscillator in the motion at these times.
///
/// A share is NaN where the tip is stationary. The list is empty if all shares are NaN, or if the
/// run is too short.
pub fn shares(track: &Track) -> Vec<(f64, f64)> {
    let end = track.times().last().copied().unwrap_or_default();
    let mut shares = Vec::new();
    let mut middle = HALF;
    while middle + HALF <= end {
        let window = track.between(middle - HALF, middle + HALF);
        let first = window.positions().first().copied().unwrap_or_default();
        let moves = window
            .positions()
            .iter()
            .any(|position| (position - first).norm() > STILL);
        let share = if moves {
            window
                .share(OSCILLATOR, &Search::default())
                .unwrap_or(f64::NAN)
        } else {
            f64::NAN
        };
        shares.push((middle / HOUR, share));
        middle += EVERY;
    }
    if shares.iter().all(|(_, share)| share.is_nan()) {
        Vec::new()
    } else {
        shares
    }
}

/// Prints the shares at a few times, and the time at which the share decreases below one half.
pub fn print_shares(shares: &[(f64, f64)]) {
    if shares.is_empty() {
        let hours = 2.0 * HALF / HOUR;
        println!("  no share of the oscillator: it requires {hours} h of a moving tip");
        return;
    }
    let last = shares.last().map(|(hours, _)| *hours);
    let selected = shares
        .iter()
        .filter(|(hours, _)| [4.0, 10.0, 20.0].contains(hours) || Some(*hours) == last);
    let texts: Vec<String> = selected
        .map(|(hours, share)| format!("{share:.3} at {hours} h"))
        .collect();
    println!("  share of the oscillator: {}", texts.join(", "));
    if let Some(pair) = shares
        .windows(2)
        .find(|pair| pair[0].1 >= 0.5 && pair[1].1 < 0.5)
    {
        let (from, to) = (pair[0], pair[1]);
        let part = (from.1 - 0.5) / (from.1 - to.1);
        println!(
            "  the share decreases below one half at {:.1} h",
            from.0 + part * (to.0 - from.0)
        );
    }
}

/// Returns the shares of the endogenous and of the exogenous oscillations as series over time.
pub fn curves(shares: &[(f64, f64)]) -> [Series; 2] {
    let other = shares
        .iter()
        .map(|(hours, share)| (*hours, 1.0 - share))
        .collect();
    [
        Series::new(
            "endogenous: period of the oscillator",
            shares.to_vec(),
            Style::Line,
            0,
        ),
        Series::new("exogenous: all other periods", other, Style::Dashed, 1),
    ]
}
