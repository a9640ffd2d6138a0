//! What is left at which gravity, printed and drawn.

use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;

use morphorod::stability::Linearisation;
use morphorod::tracking::{self, Ellipse, Oscillation, Search};
use nalgebra::{Complex, Vector3};

use super::common::{Series, Strip, Style, Table, strips_figure};
use super::{Centrifuge, HOUR, MINUTE, OSCILLATOR, RADIUS, Record, shoot, steering};

/// So much of the time at a level is read, its end: what came before is to have died out.
const READ: f64 = 0.4;
/// Less cannot be read, s.
const LEAST: f64 = 6.0 * HOUR;

/// The oscillations at one level.
pub struct Reading {
    level: f64,
    /// That of the oscillator's period, and the largest of those that are slower.
    both: [Option<Oscillation>; 2],
}

/// Reads and prints the oscillations at every level; none if the run is too short.
pub fn read(record: &Record, scene: &Centrifuge, alpha: f64, length: f64) -> Result<Vec<Reading>, Box<dyn Error>> {
    if READ * scene.time < LEAST {
        println!("oscillations are left out, they need {} h at each level", LEAST / READ / HOUR);
        return Ok(Vec::new());
    }
    let path = tracking::Track::seen_along(&Vector3::z(), record.times.clone(), &record.tips)?;
    let mut readings = Vec::new();
    for (k, level) in scene.levels.iter().enumerate() {
        let end = scene.time * (k + 1) as f64;
        let found = path.between(end - READ * scene.time, end).oscillations(&Search::default())?.oscillations;
        let endogenous = found.iter().find(|wave| (wave.period / OSCILLATOR - 1.0).abs() < 0.05).copied();
        let exogenous = found.iter().find(|wave| wave.period > 1.5 * OSCILLATOR).copied();
        let told = |wave: Option<Oscillation>| {
            wave.map_or("none".into(), |wave| {
                let (ellipse, minutes) = (wave.ellipse, wave.period / MINUTE);
                format!("{:.4} mm every {minutes:.3} min, roundness {:.3}", 1e3 * ellipse.major, ellipse.roundness())
            })
        };
        print!("{level} g: endogenous {}; exogenous {}", told(endogenous), told(exogenous));
        if exogenous.is_none() && alpha != 0.0 {
            print!("; linear theory {:.4} mm", 1e3 * linear_amplitude(*level, alpha, length)?);
        }
        println!();
        readings.push(Reading { level: *level, both: [endogenous, exogenous] });
    }
    Ok(readings)
}

/// The semi-major axis, m, of what an oscillator makes of the upright shoot at one level, to first order in its sensitivity.
fn linear_amplitude(level: f64, alpha: f64, length: f64) -> Result<f64, Box<dyn Error>> {
    let still = Centrifuge { levels: vec![level], time: HOUR };
    let linear = Linearisation::about(&shoot(still, steering(false), length)?)?;
    let size = Complex::from(alpha / RADIUS);
    let gradient = Vector3::new(size, size * -Complex::i(), Complex::ZERO);
    let answer = linear.response(TAU / OSCILLATOR, &gradient)?;
    let tip = answer.displacement.last().copied().unwrap_or_default().xy();
    // Re[d exp(iωt)] = Re d cos ωt − Im d sin ωt.
    Ok(Ellipse::of(&tip.map(|z| z.re), &tip.map(|z| -z.im)).major)
}

/// Draws the tip through time, and both oscillations against gravity.
pub fn draw(out: &Path, record: &Record, scene: &Centrifuge, readings: &[Reading]) -> Result<(), Box<dyn Error>> {
    let end = scene.time * scene.levels.len() as f64;
    let steps = scene.levels.iter().enumerate().flat_map(|(k, level)| {
        let from = scene.time / HOUR * k as f64;
        [(from, *level), (from + scene.time / HOUR, *level)]
    });
    let mut gravity = vec![Series::new("", steps.collect(), Style::Line, 6)];
    let highest = scene.levels.iter().fold(0.0, |highest: f64, level| highest.max(*level));
    for (k, level) in scene.levels.iter().enumerate() {
        let middle = scene.time / HOUR * (k as f64 + 0.5);
        let beside = if *level > 0.5 * highest { -0.12 * highest } else { 0.12 * highest };
        gravity.push(Series::text(format!("{level} g"), (middle, level + beside), Style::Text, 6));
    }
    let along = |axis: usize| {
        let points = record.times.iter().zip(&record.tips).map(|(t, tip)| (t / HOUR, 1e3 * tip[axis]));
        points.collect::<Vec<_>>()
    };
    let across = [Series::new("", along(0), Style::Line, 0)];
    let height = [Series::new("", along(2), Style::Line, 2)];
    let strips = [
        Strip { label: "gravity (g)", series: &gravity },
        Strip { label: "tip, x (mm)", series: &across },
        Strip { label: "tip, z (mm)", series: &height },
    ];
    let title = format!("A shoot in a centrifuge, {} h", end / HOUR);
    strips_figure(out.join("tip.svg"), &title, "time (h)", &strips)?;
    if readings.is_empty() {
        return Ok(());
    }

    let columns = ["gravity_g", "endogenous_s", "endogenous_m", "exogenous_s", "exogenous_m"];
    let mut table = Table::create(out.join("levels.csv"), &columns)?;
    let (mut amplitudes, mut periods) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    for Reading { level, both } in readings {
        let mut row = vec![*level];
        for (k, wave) in both.iter().enumerate() {
            // An oscillation that is not there has no amplitude, and no period.
            let (amplitude, period) = wave.map_or((0.0, f64::NAN), |wave| (wave.ellipse.major, wave.period));
            amplitudes[k].push((*level, 1e3 * amplitude));
            periods[k].push((*level, period / MINUTE));
            row.extend([period, amplitude]);
        }
        table.row(&row)?;
    }
    table.finish()?;
    let names = ["endogenous: the oscillator's", "exogenous: late answers to gravity"];
    let curves = |of: &mut [Vec<(f64, f64)>; 2]| -> Vec<Series> {
        let sorted = |points: &mut Vec<(f64, f64)>| {
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            std::mem::take(points)
        };
        of.iter_mut().enumerate().map(|(k, points)| Series::new(names[k], sorted(points), Style::Marked, k)).collect()
    };
    let (sizes, times) = (curves(&mut amplitudes), curves(&mut periods));
    let strips = [Strip { label: "amplitude (mm)", series: &sizes }, Strip { label: "period (min)", series: &times }];
    let title = "Both oscillations against gravity";
    Ok(strips_figure(out.join("levels.svg"), title, "gravity (g)", &strips)?)
}
