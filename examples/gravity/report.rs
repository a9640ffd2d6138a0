//! Oscillations at each level of gravity: analysis, printed results and figures.

use std::error::Error;
use std::f64::consts::TAU;
use std::io;
use std::path::Path;

use morphorod::ShootParameters;
use morphorod::stability::Linearisation;
use morphorod::tracking::{self, Ellipse, Oscillation, Search};
use nalgebra::{Complex, Vector3};

use super::{Centrifuge, HOUR, MINUTE, OSCILLATOR, Record, responses, shoot};
use morphorod_plot::{Figure, Orbit, Series, Strip, Style, Table, println};

/// Analysed part of the duration of a level. The transient before it is excluded.
const ANALYSED: f64 = 0.4;
/// Shortest duration of an analysis, s.
const LEAST: f64 = 6.0 * HOUR;
/// Window of an envelope, s. It is longer than the period of the exogenous oscillation.
const WINDOW: f64 = 2.0 * HOUR;

/// Oscillations at one level.
pub struct Level {
    /// Gravity, g.
    gravity: f64,
    /// The endogenous oscillation, which has the period of the oscillator, and the largest slower
    /// one.
    oscillations: [Option<Oscillation>; 2],
}

/// Determines and prints the oscillations at each level. The list is empty if the levels are too
/// short.
pub fn analyse(
    record: &Record,
    scene: &Centrifuge,
    alpha: f64,
    length: f64,
) -> Result<Vec<Level>, Box<dyn Error>> {
    if ANALYSED * scene.time < LEAST {
        println!(
            "no analysis of oscillations: it requires {} h at each level",
            LEAST / ANALYSED / HOUR
        );
        return Ok(Vec::new());
    }
    let track = tracking::Track::seen_along(&Vector3::z(), record.times.clone(), &record.tips)?;
    let mut levels = Vec::new();
    for (k, level) in scene.levels.iter().enumerate() {
        let end = scene.time * (k + 1) as f64;
        let found = track
            .between(end - ANALYSED * scene.time, end)
            .oscillations(&Search::default())?
            .oscillations;
        let endogenous = found
            .iter()
            .find(|wave| (wave.period / OSCILLATOR - 1.0).abs() < 0.05)
            .copied();
        let exogenous = found
            .iter()
            .find(|wave| wave.period > 1.5 * OSCILLATOR)
            .copied();
        let text = |wave: Option<Oscillation>| {
            wave.map_or("none".into(), |wave| {
                let (ellipse, minutes) = (wave.ellipse, wave.period / MINUTE);
                format!(
                    "{:.4} mm, period {minutes:.3} min, roundness {:.3}",
                    1e3 * ellipse.major,
                    ellipse.roundness()
                )
            })
        };
        let mut line = format!(
            "{level} g: endogenous {}; exogenous {}",
            text(endogenous),
            text(exogenous)
        );
        if exogenous.is_none() && alpha != 0.0 {
            line += &format!(
                "; linear theory {:.4} mm",
                1e3 * linear_amplitude(*level, alpha, length)?
            );
        }
        println!("{line}");
        levels.push(Level {
            gravity: *level,
            oscillations: [endogenous, exogenous],
        });
    }
    Ok(levels)
}

/// Returns the semi-major axis (m) of the endogenous oscillation of an upright shoot, to first
/// order in `alpha`.
fn linear_amplitude(level: f64, alpha: f64, length: f64) -> Result<f64, Box<dyn Error>> {
    let still = Centrifuge {
        levels: vec![level],
        time: HOUR,
    };
    let linear = Linearisation::about(&shoot(still, responses(false), length)?)?;
    let size = Complex::from(alpha / ShootParameters::default().radius);
    let gradient = Vector3::new(size, size * -Complex::i(), Complex::ZERO);
    let response = linear.response(TAU / OSCILLATOR, &gradient)?;
    let tip = response
        .displacement
        .last()
        .copied()
        .unwrap_or_default()
        .xy();
    // Re[d exp(iωt)] = Re d cos ωt − Im d sin ωt.
    Ok(Ellipse::of(&tip.map(|z| z.re), &tip.map(|z| -z.im)).major)
}

/// Draws the tip over time, its tracks at the levels, and the oscillations against gravity.
pub fn draw(
    out: &Path,
    record: &Record,
    scene: &Centrifuge,
    levels: &[Level],
) -> Result<(), Box<dyn Error>> {
    draw_time(out, record, scene)?;
    draw_tracks(out, record, scene)?;
    if !levels.is_empty() {
        draw_levels(out, levels)?;
    }
    Ok(())
}

/// Draws gravity, and the range of the distance from the vertical and of the height of the tip.
fn draw_time(out: &Path, record: &Record, scene: &Centrifuge) -> io::Result<()> {
    let hours = scene.time / HOUR;
    let steps = scene.levels.iter().enumerate().flat_map(|(k, level)| {
        let from = hours * k as f64;
        [(from, *level), (from + hours, *level)]
    });
    let mut gravity = vec![Series::new("", steps.collect(), Style::Line, 6)];
    let highest = scene
        .levels
        .iter()
        .fold(0.0, |highest: f64, level| highest.max(*level));
    for (k, level) in scene.levels.iter().enumerate() {
        let offset = if *level > 0.5 * highest {
            -0.15 * highest
        } else {
            0.15 * highest
        };
        let at = (hours * (k as f64 + 0.5), level + offset);
        gravity.push(Series::text(format!("{level} g"), at, Style::Text, 6));
    }
    let distance = envelope(record, |tip| tip.xy().norm());
    let height = envelope(record, |tip| tip.z);
    let strips = [
        Strip {
            label: "gravity (g)",
            series: &gravity,
        },
        Strip {
            label: "distance (mm)",
            series: &distance,
        },
        Strip {
            label: "height z (mm)",
            series: &height,
        },
    ];
    let title = "Shoot in a centrifuge: distance of the tip from the vertical, and its height";
    Figure::new(out.join("tip.svg"), title).strips("time (h)", &strips)
}

/// Returns the largest and the smallest value of a length (m) in successive windows, in mm over
/// hours.
fn envelope(record: &Record, value: impl Fn(&Vector3<f64>) -> f64) -> [Series; 2] {
    let (mut largest, mut smallest) = (Vec::new(), Vec::new());
    let samples: Vec<(f64, f64)> = record
        .times
        .iter()
        .zip(&record.tips)
        .map(|(t, tip)| (*t, value(tip)))
        .collect();
    let window_of = |sample: &(f64, f64)| (sample.0 / WINDOW) as u64;
    // The last sample may be alone in its window.
    let windows = samples
        .chunk_by(|a, b| window_of(a) == window_of(b))
        .filter(|window| window.len() > 1);
    for window in windows {
        let hours = 0.5 * (window[0].0 + window[window.len() - 1].0) / HOUR;
        let values = || window.iter().map(|sample| 1e3 * sample.1);
        largest.push((hours, values().fold(f64::NEG_INFINITY, f64::max)));
        smallest.push((hours, values().fold(f64::INFINITY, f64::min)));
    }
    let label = |name| format!("{name} in {} h", WINDOW / HOUR);
    [
        Series::new(label("largest value"), largest, Style::Line, 0),
        Series::new(label("smallest value"), smallest, Style::Dashed, 1),
    ]
}

/// Draws the track of the tip in the last window of each level, seen from above.
fn draw_tracks(out: &Path, record: &Record, scene: &Centrifuge) -> io::Result<()> {
    let track = |(k, level): (usize, &f64)| {
        let end = scene.time * (k + 1) as f64;
        let start = end - (2.0 * WINDOW).min(scene.time);
        let samples = record
            .times
            .iter()
            .zip(&record.tips)
            .filter(|(t, _)| (start..end).contains(*t));
        let path = samples
            .map(|(t, tip)| ((t - start) / HOUR, [tip.x, tip.y]))
            .collect();
        Orbit {
            name: format!("{level} g"),
            path,
            behind: Vec::new(),
        }
    };
    let tracks: Vec<Orbit> = scene.levels.iter().enumerate().map(track).collect();
    let title = format!(
        "Tip tracks in the last {} h at each level, top view",
        2.0 * WINDOW / HOUR
    );
    Figure::new(out.join("tracks.svg"), title).orbits(&tracks)
}

/// Draws amplitudes and periods against gravity, and writes them to a table.
fn draw_levels(out: &Path, levels: &[Level]) -> io::Result<()> {
    let columns = [
        "gravity_g",
        "endogenous_s",
        "endogenous_m",
        "exogenous_s",
        "exogenous_m",
    ];
    let mut table = Table::create(out.join("levels.csv"), &columns)?;
    let (mut amplitudes, mut periods) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    for Level {
        gravity,
        oscillations,
    } in levels
    {
        let mut row = vec![*gravity];
        for (k, wave) in oscillations.iter().enumerate() {
            // An oscillation that does not occur has zero amplitude and no period.
            let (amplitude, period) =
                wave.map_or((0.0, f64::NAN), |wave| (wave.ellipse.major, wave.period));
            amplitudes[k].push((*gravity, 1e3 * amplitude));
            periods[k].push((*gravity, period / MINUTE));
            row.extend([period, amplitude]);
        }
        table.row(&row)?;
    }
    table.finish()?;
    let names = [
        "endogenous: period of the oscillator",
        "exogenous: delayed gravitropic response",
    ];
    let series = |points: [Vec<(f64, f64)>; 2]| -> Vec<Series> {
        let named = points.into_iter().zip(names).enumerate();
        named
            .map(|(k, (points, name))| Series::new(name, points, Style::Points, k))
            .collect()
    };
    let (sizes, times) = (series(amplitudes), series(periods));
    let strips = [
        Strip {
            label: "amplitude (mm)",
            series: &sizes,
        },
        Strip {
            label: "period (min)",
            series: &times,
        },
    ];
    let title = "Oscillations of the tip at different levels of gravity";
    Figure::new(out.join("levels.svg"), title).strips("gravity (g)", &strips)
}
