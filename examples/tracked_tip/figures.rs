//! The figures of a tracked tip.

use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;

use morphorod::tracking::{Nutation, RidgePoint, Search, Track};

use super::common::{Axes, Map, Series, Style, lines_figure, map_figure, panels_figure};
use super::report::COLUMNS;
use super::{HOUR, MINUTE};

const MM_PER_M: f64 = 1e3;
/// Columns of the scalogram's picture.
const ACROSS: usize = 220;
/// Powers at the ends of its colours, in variances: far below those of white noise, so that a small motion is seen beside a large one.
const LIMITS: [f64; 2] = [1e-2, 100.0];
/// A line is broken where its points are further apart, h.
const BREAK: f64 = 0.3;
/// The same for the logarithm of a period: more than a ridge changes from one time to the next.
const LEAP: f64 = 0.2;

/// Draws all.
pub fn draw(
    out: &Path,
    path: &Track,
    found: &Nutation,
    rows: &[[f64; COLUMNS.len()]],
    window: f64,
) -> Result<(), Box<dyn Error>> {
    paths(out, path, found, window)?;
    scalogram(out, path, found, rows)?;
    amplitudes(out, found, rows)
}

/// The path as it was tracked, and its last hours with the ellipses that they are made of.
fn paths(out: &Path, path: &Track, found: &Nutation, window: f64) -> Result<(), Box<dyn Error>> {
    let end = path.times().last().copied().unwrap_or(0.0);
    let place = |k: usize| (MM_PER_M * path.positions()[k].x, MM_PER_M * path.positions()[k].y);
    let (astray, good): (Vec<usize>, Vec<usize>) =
        (0..path.times().len()).partition(|k| found.outliers.binary_search(k).is_ok());
    let mut line: Vec<(f64, f64)> = Vec::new();
    for (i, k) in good.iter().enumerate() {
        if i > 0 && path.times()[*k] - path.times()[good[i - 1]] > BREAK * HOUR {
            line.push((f64::NAN, f64::NAN));
        }
        line.push(place(*k));
    }
    let outliers = astray.iter().map(|k| place(*k)).collect();
    let whole = [Series::new("positions", line, Style::Line, 5), Series::new("outliers", outliers, Style::Points, 1)];
    // About the middle of the last window.
    let last = path.between(end - window, end);
    let recent: Vec<(f64, f64)> =
        good.iter().filter(|k| path.times()[**k] >= end - window).map(|k| place(*k)).collect();
    let middle = |of: fn(&(f64, f64)) -> f64| recent.iter().map(of).sum::<f64>() / recent.len().max(1) as f64;
    let (x, y) = (middle(|p| p.0), middle(|p| p.1));
    let about = recent.iter().map(|p| (p.0 - x, p.1 - y)).collect();
    let mut recent = vec![Series::new("positions about their mean", about, Style::Points, 5)];
    let oscillations = last.oscillations(&Search::default()).map_or_else(|_| vec![], |found| found.oscillations);
    for (k, wave) in oscillations.iter().take(2).enumerate() {
        let round = (0..=120).map(|k| {
            let (sine, cosine) = (TAU * f64::from(k) / 120.0).sin_cos();
            let (along, across) = (wave.ellipse.major * cosine, wave.ellipse.minor * sine);
            let (s, c) = wave.ellipse.direction.sin_cos();
            (MM_PER_M * (along * c - across * s), MM_PER_M * (along * s + across * c))
        });
        let label = format!("ellipse of {:.1} min", wave.period / MINUTE);
        recent.push(Series::new(label, round.collect(), Style::Line, [1, 6][k % 2]));
    }
    let title = format!("the last {} h, and their ellipses", window / HOUR);
    let panels: [(&str, &[Series]); 2] = [("as tracked", &whole), (&title, &recent)];
    Ok(panels_figure(out.join("path.svg"), "The path of a tracked tip", "x (mm)", "y (mm)", &panels, Axes::Equal)?)
}

/// Power by time and period, the ridge, and the cone of influence.
fn scalogram(out: &Path, path: &Track, found: &Nutation, rows: &[[f64; COLUMNS.len()]]) -> Result<(), Box<dyn Error>> {
    let scalogram = &found.scalogram;
    let (start, duration) = (path.times()[0], path.duration());
    let step = duration / ACROSS as f64;
    let hours: Vec<f64> = (0..ACROSS).map(|k| (start + step * (k as f64 + 0.5)) / HOUR).collect();
    let minutes: Vec<f64> = if scalogram.periods.is_empty() {
        vec![1.0, 10.0]
    } else {
        scalogram.periods.iter().map(|period| period / MINUTE).collect()
    };
    // The nearest time that the scalogram has; in a gap it has none.
    let nearest = |hour: &f64| {
        let t = HOUR * hour;
        let after = scalogram.times.partition_point(|other| *other < t);
        let near = [after.saturating_sub(1), after].into_iter().filter(|k| *k < scalogram.times.len());
        let off = |k: &usize| (scalogram.times[*k] - t).abs();
        near.min_by(|a, b| off(a).total_cmp(&off(b))).filter(|k| off(k) <= step)
    };
    let columns: Vec<Option<usize>> = hours.iter().map(nearest).collect();
    let power = |j: usize, k: &Option<usize>| k.and_then(|k| scalogram.power.get(j).map(|row| row[k]));
    let values =
        (0..minutes.len()).flat_map(|j| columns.iter().map(move |k| power(j, k).unwrap_or(f64::NAN))).collect();
    // At each time the longest period that lies outside the cone.
    let edge = |(hour, k): (&f64, &Option<usize>)| {
        let longest =
            k.and_then(|k| (0..minutes.len()).rev().find(|j| scalogram.outside_cone.get(*j).is_some_and(|row| row[k])));
        // Where all of them do there is no edge.
        (*hour, longest.filter(|j| j + 1 < minutes.len()).map_or(f64::NAN, |j| minutes[j]))
    };
    let cone = hours.iter().zip(&columns).map(edge).collect();
    let fitted = rows.iter().map(|row| (row[0] / HOUR, row[2] / MINUTE)).collect();
    let over = [
        Series::new("cone of influence: above it ends and gaps are seen", cone, Style::Dashed, 1),
        Series::new("ridge", along(found, |place| place.period / MINUTE), Style::Line, 6),
        Series::new("largest period in a window, by least squares", fitted, Style::Points, 3),
    ];
    let map = Map {
        axes: ["time (h)", "period (min)"],
        points: [hours, minutes],
        log: true,
        values,
        label: "power |W|²/σ² (1)",
        limits: LIMITS,
    };
    Ok(map_figure(out.join("scalogram.svg"), "Wavelet scalogram of a tracked tip", &map, &over)?)
}

/// Numbers of the ridge against time (h), with a break wherever it has one, or leaps to another period.
fn along(found: &Nutation, number: impl Fn(&RidgePoint) -> f64) -> Vec<(f64, f64)> {
    let mut line: Vec<(f64, f64)> = Vec::with_capacity(found.ridge.len());
    for (k, place) in found.ridge.iter().enumerate() {
        if k > 0 {
            let before = &found.ridge[k - 1];
            if place.time - before.time > BREAK * HOUR || (place.period / before.period).ln().abs() > LEAP {
                line.push((f64::NAN, f64::NAN));
            }
        }
        line.push((place.time / HOUR, number(place)));
    }
    line
}

/// Amplitudes against time.
fn amplitudes(out: &Path, found: &Nutation, rows: &[[f64; COLUMNS.len()]]) -> Result<(), Box<dyn Error>> {
    let column = |k: usize| rows.iter().map(|row| (row[0] / HOUR, MM_PER_M * row[k])).collect();
    let series = [
        Series::new("along the ridge", along(found, |place| MM_PER_M * place.ellipse.major), Style::Line, 0),
        Series::new("largest ellipse in a window: semi-major axis", column(4), Style::Points, 1),
        Series::new("semi-minor axis", column(5), Style::Points, 2),
    ];
    let file = out.join("amplitude.svg");
    Ok(lines_figure(file, "Amplitude of a tracked tip", "time (h)", "amplitude (mm)", &series, Axes::Linear)?)
}
