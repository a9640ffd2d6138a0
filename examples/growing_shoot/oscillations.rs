//! What the tip's path is made of, as it is seen from above.

use morphorod::tracking::{Search, Track, TrackingError};
use nalgebra::Vector3;

use super::common::{Series, Style};
use super::{HOUR, MINUTE, OSCILLATOR};

/// The last part of the path that is read, s.
const RECENT: f64 = 6.0 * HOUR;
/// Half the duration that the shares at one time are read from, s.
const HALF: f64 = 2.0 * HOUR;
/// Between two times at which they are, s.
const EVERY: f64 = 0.5 * HOUR;
/// A tip that moves by less stands still, m.
const STILL: f64 = 1e-9;

/// The path in rows of time (s), length, and place of the tip (m).
pub fn seen_from_above(rows: &[[f64; 5]]) -> Result<Track, TrackingError> {
    let positions: Vec<_> = rows.iter().map(|row| Vector3::from_row_slice(&row[2..5])).collect();
    Track::seen_along(&Vector3::z(), rows.iter().map(|row| row[0]).collect(), &positions)
}

/// Prints what the last hours are made of.
pub fn tell(path: &Track) {
    let last = path.times().last().copied().unwrap_or_default();
    // A run of a few minutes has too few positions.
    let Ok(found) = path.between(last - RECENT, last).oscillations(&Search::default()) else { return };
    for wave in found.oscillations.iter().take(2) {
        let (ellipse, minutes) = (wave.ellipse, wave.period / MINUTE);
        let (major, minor) = (1e3 * ellipse.major, 1e3 * ellipse.minor);
        let sense = ellipse.sense.map_or("no sense".into(), |sense| format!("{sense:?}").to_lowercase());
        println!("  at last every {minutes:.1} min round an ellipse of {major:.2} by {minor:.2} mm, {sense}");
    }
}

/// Times (h) and the share of the oscillator in the motion about them; not a number where the tip stands still, and none at all
/// if that is everywhere or the run is too short.
pub fn shares(path: &Track) -> Vec<(f64, f64)> {
    let end = path.times().last().copied().unwrap_or_default();
    let mut shares = Vec::new();
    let mut middle = HALF;
    while middle + HALF <= end {
        let window = path.between(middle - HALF, middle + HALF);
        let first = window.positions().first().copied().unwrap_or_default();
        let moves = window.positions().iter().any(|position| (position - first).norm() > STILL);
        let share = if moves { window.share(OSCILLATOR, &Search::default()).unwrap_or(f64::NAN) } else { f64::NAN };
        shares.push((middle / HOUR, share));
        middle += EVERY;
    }
    if shares.iter().all(|(_, share)| share.is_nan()) { Vec::new() } else { shares }
}

/// Prints the shares at a few times, and when the oscillator has lost the lead.
pub fn tell_shares(shares: &[(f64, f64)]) {
    if shares.is_empty() {
        println!(
            "  the share of the oscillator is left out, it is read over {} h of a tip that moves",
            2.0 * HALF / HOUR
        );
        return;
    }
    let last = shares.last().map(|(hours, _)| *hours);
    let told = shares.iter().filter(|(hours, _)| [4.0, 10.0, 20.0].contains(hours) || Some(*hours) == last);
    let told: Vec<String> = told.map(|(hours, share)| format!("{share:.3} at {hours} h")).collect();
    println!("  share of the oscillator {}", told.join(", "));
    if let Some(pair) = shares.windows(2).find(|pair| pair[0].1 >= 0.5 && pair[1].1 < 0.5) {
        let (from, to) = (pair[0], pair[1]);
        let part = (from.1 - 0.5) / (from.1 - to.1);
        println!("  it falls below one half at {:.1} h", from.0 + part * (to.0 - from.0));
    }
}

/// The share of each oscillation through time.
pub fn curves(shares: &[(f64, f64)]) -> [Series; 2] {
    let other = shares.iter().map(|(hours, share)| (*hours, 1.0 - share)).collect();
    [
        Series::new("endogenous: the oscillator", shares.to_vec(), Style::Line, 0),
        Series::new("exogenous: all else", other, Style::Dashed, 1),
    ]
}
