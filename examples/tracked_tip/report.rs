//! The numbers of a path, in words and in rows.

use std::error::Error;

use morphorod::tracking::{Nutation, Search, Track};
use morphorod::tropism::Handedness;

use super::{HOUR, MINUTE};

const MM_PER_M: f64 = 1e3;

/// Columns of the table of windows. What is not known there is `NaN`.
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

/// Prints all that is known of a path as a whole.
pub fn whole(path: &Track, band: [f64; 2], share: f64) -> Result<Nutation, Box<dyn Error>> {
    let search = Search::default();
    let found = path.oscillations(&search)?;
    println!("periods, of the path as a whole:");
    for wave in &found.oscillations {
        let ellipse = wave.ellipse;
        println!(
            "  {:8.2} ± {:.2} min, ellipse {:.2} by {:.2} ± {:.2} mm at {:.0}°, roundness {:.2}, {}{}",
            wave.period / MINUTE,
            wave.period_error / MINUTE,
            MM_PER_M * ellipse.major,
            MM_PER_M * ellipse.minor,
            MM_PER_M * wave.axis_error,
            ellipse.direction.to_degrees(),
            ellipse.roundness(),
            told(ellipse.sense),
            wave.harmonic.map_or(String::new(), |order| format!(", harmonic {order} of the largest")),
        );
    }
    println!("  pattern {:?}", found.pattern());
    println!("  share of {} min {:.3}", share / MINUTE, path.share(share, &search)?);
    println!("  residual {:.3} mm beside a drift of degree {}", MM_PER_M * found.noise, found.drift);
    let tracking = path.nutation(band)?;
    println!("as trackers tell it, periods from {} to {} min:", band[0] / MINUTE, band[1] / MINUTE);
    match (tracking.period, tracking.period_quartiles, tracking.amplitude, tracking.sampling) {
        (Some(period), Some([lower, upper]), Some(amplitude), Some(sampling)) => {
            let (median, range) = (period / MINUTE, (upper - lower) / MINUTE);
            println!("  nutates, period {median:.1} min along the ridge, interquartile range {range:.1} min");
            println!("  largest envelope {:.2} mm", MM_PER_M * amplitude);
            let turns = tracking.turns.map_or(String::new(), |turns| format!(", {turns:.1} turns of the velocity"));
            println!("  sense {}{turns}", told(tracking.sense));
            println!("  sampling interval over Nyquist's {sampling:.3}");
        }
        _ => println!("  does not nutate"),
    }
    for [short, long] in &tracking.unresolved {
        println!("  periods of {:.1} and {:.1} min share a ridge", short / MINUTE, long / MINUTE);
    }
    println!("  power in the band {:.3} of all", tracking.band_power);
    if let Some(floor) = tracking.noise_floor {
        println!("  noise floor {:.3} mm", MM_PER_M * floor);
    }
    let missing: f64 = tracking.gaps.iter().map(|[from, to]| to - from).sum();
    println!("  {} outliers, {} gaps of {:.2} h in all", tracking.outliers.len(), tracking.gaps.len(), missing / HOUR);
    Ok(tracking)
}

fn told(sense: Option<Handedness>) -> &'static str {
    match sense {
        Some(Handedness::Counterclockwise) => "counterclockwise",
        Some(Handedness::Clockwise) => "clockwise",
        None => "undetermined",
    }
}

/// The same in a sliding window, a row for each.
pub fn windows(
    path: &Track,
    band: [f64; 2],
    share: f64,
    length: f64,
    every: f64,
) -> Result<Vec<[f64; COLUMNS.len()]>, Box<dyn Error>> {
    let search = Search::default();
    let yes = |whether: bool| f64::from(u8::from(whether));
    let row = |(time, window): (f64, Track)| {
        let mut row = [f64::NAN; COLUMNS.len()];
        row[0] = time;
        row[1] = window.share(share, &search).unwrap_or(f64::NAN);
        if let Some(wave) = window.oscillations(&search).ok().and_then(|found| found.oscillations.first().copied()) {
            let ellipse = wave.ellipse;
            let sense = ellipse.sense.map_or(f64::NAN, |sense| yes(sense == Handedness::Counterclockwise));
            let numbers = [wave.period, wave.period_error, ellipse.major, ellipse.minor, ellipse.direction, sense];
            row[2..8].copy_from_slice(&numbers);
        }
        if let Ok(found) = window.nutation(band) {
            row[8] = yes(found.nutates);
            if let (Some(period), Some([lower, upper]), Some(amplitude)) =
                (found.period, found.period_quartiles, found.amplitude)
            {
                row[9..12].copy_from_slice(&[period, upper - lower, amplitude]);
            }
            row[12] = found.band_power;
            row[13] = found.noise_floor.unwrap_or(f64::NAN);
        }
        row
    };
    Ok(path.windows(length, every)?.map(row).collect())
}
