//! Figures of a tracked tip: path, scalogram, amplitudes, mechanism.

use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;

use morphorod::tracking::{Nutation, RidgePoint, Search, Track};
use nalgebra::Vector2;

use super::average::moving_average;
use super::mechanism::{Component, Judgement, Observation};
use super::rows::COLUMNS;
use super::{HOUR, MINUTE};
use morphorod_plot::{Axes, Figure, Map, Series, Style};

const MM_PER_M: f64 = 1e3;
/// Number of columns of the scalogram in the figure.
const ACROSS: usize = 220;
/// Smallest and largest power of the colour scale, in variances. The smallest is far below that of
/// white noise, which shows small motions beside large ones.
const LIMITS: [f64; 2] = [1e-2, 100.0];
/// Largest time between neighbouring points of a line, h.
const BREAK: f64 = 0.3;
/// Largest difference of the logarithms of the periods of neighbouring points of a ridge.
const LEAP: f64 = 0.2;

/// Draws all figures.
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

/// Draws the tracked path, and the last window without its drift, with the ellipses of its two
/// largest oscillations.
fn paths(out: &Path, path: &Track, found: &Nutation, window: f64) -> Result<(), Box<dyn Error>> {
    let end = path.times().last().copied().unwrap_or(0.0);
    let place = |k: usize| {
        (
            MM_PER_M * path.positions()[k].x,
            MM_PER_M * path.positions()[k].y,
        )
    };
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
    let whole = [
        Series::new("positions", line, Style::Line, 5),
        Series::new("outliers", outliers, Style::Points, 1),
    ];
    // The drift would displace the positions from the ellipses.
    let last = path
        .between(end - window, end)
        .oscillations(&Search::default());
    let (oscillations, about) = last.map_or_else(
        |_| (vec![], vec![]),
        |last| {
            let good = |k: &usize| last.outliers.binary_search(k).is_err();
            let place = |k: usize| {
                (
                    MM_PER_M * last.without_drift[k].x,
                    MM_PER_M * last.without_drift[k].y,
                )
            };
            let about = (0..last.without_drift.len())
                .filter(good)
                .map(place)
                .collect();
            (last.oscillations, about)
        },
    );
    let mut recent = vec![Series::new(
        "positions less the drift",
        about,
        Style::Points,
        5,
    )];
    for (k, wave) in oscillations.iter().take(2).enumerate() {
        let round = (0..=120).map(|k| {
            let (sine, cosine) = (TAU * f64::from(k) / 120.0).sin_cos();
            let (along, across) = (wave.ellipse.major * cosine, wave.ellipse.minor * sine);
            let (s, c) = wave.ellipse.direction.sin_cos();
            (
                MM_PER_M * (along * c - across * s),
                MM_PER_M * (along * s + across * c),
            )
        });
        let label = format!("ellipse, period {:.1} min", wave.period / MINUTE);
        recent.push(Series::new(
            label,
            round.collect(),
            Style::Line,
            [1, 6][k % 2],
        ));
    }
    let title = format!("the last {} h and the largest oscillations", window / HOUR);
    let panels: [(&str, &[Series]); 2] = [("tracked path", &whole), (&title, &recent)];
    Ok(
        Figure::new(out.join("path.svg"), "Path of a tracked tip").panels(
            "x (mm)",
            "y (mm)",
            &panels,
            Axes::Equal,
        )?,
    )
}

/// Draws the positions without outliers as grey dots, and their moving average as a line.
pub fn average(
    out: &Path,
    path: &Track,
    outliers: &[usize],
    count: usize,
) -> Result<(), Box<dyn Error>> {
    let good = || (0..path.times().len()).filter(|k| outliers.binary_search(k).is_err());
    let times: Vec<f64> = good().map(|k| path.times()[k]).collect();
    let positions = good().map(|k| path.positions()[k]).collect();
    let track = Track::new(times, positions)?;
    let place = |p: &Vector2<f64>| (MM_PER_M * p.x, MM_PER_M * p.y);
    let mut line: Vec<(f64, f64)> = Vec::new();
    for part in moving_average(&track, count, BREAK * HOUR) {
        line.extend(part.positions().iter().map(place));
        line.push((f64::NAN, f64::NAN));
    }
    let dots = track.positions().iter().map(place).collect();
    let label = format!("mean of {count} positions");
    let series = [
        Series::new("positions", dots, Style::Dots, 5),
        Series::new(label, line, Style::Line, 0),
    ];
    let figure = Figure::new(out.join("average.svg"), "Tracked tip, moving average");
    Ok(figure.lines("x (mm)", "y (mm)", &series, Axes::Equal)?)
}

/// Draws the power against time and period, the ridge, and the cone of influence.
fn scalogram(
    out: &Path,
    path: &Track,
    found: &Nutation,
    rows: &[[f64; COLUMNS.len()]],
) -> Result<(), Box<dyn Error>> {
    let scalogram = &found.scalogram;
    let (start, duration) = (path.times()[0], path.duration());
    let step = duration / ACROSS as f64;
    let hours: Vec<f64> = (0..ACROSS)
        .map(|k| (start + step * (k as f64 + 0.5)) / HOUR)
        .collect();
    let minutes: Vec<f64> = if scalogram.periods.is_empty() {
        vec![1.0, 10.0]
    } else {
        scalogram
            .periods
            .iter()
            .map(|period| period / MINUTE)
            .collect()
    };
    // The nearest time of the scalogram; `None` in a gap.
    let nearest = |hour: &f64| {
        let t = HOUR * hour;
        let after = scalogram.times.partition_point(|other| *other < t);
        let near = [after.saturating_sub(1), after]
            .into_iter()
            .filter(|k| *k < scalogram.times.len());
        let off = |k: &usize| (scalogram.times[*k] - t).abs();
        near.min_by(|a, b| off(a).total_cmp(&off(b)))
            .filter(|k| off(k) <= step)
    };
    let columns: Vec<Option<usize>> = hours.iter().map(nearest).collect();
    let power =
        |j: usize, k: &Option<usize>| k.and_then(|k| scalogram.power.get(j).map(|row| row[k]));
    let values = (0..minutes.len())
        .flat_map(|j| columns.iter().map(move |k| power(j, k).unwrap_or(f64::NAN)))
        .collect();
    // The longest period outside the cone of influence at each time.
    let edge = |(hour, k): (&f64, &Option<usize>)| {
        let longest = k.and_then(|k| {
            (0..minutes.len())
                .rev()
                .find(|j| scalogram.outside_cone.get(*j).is_some_and(|row| row[k]))
        });
        // There is no edge where all periods are outside the cone.
        (
            *hour,
            longest
                .filter(|j| j + 1 < minutes.len())
                .map_or(f64::NAN, |j| minutes[j]),
        )
    };
    let cone = hours.iter().zip(&columns).map(edge).collect();
    let fitted = rows
        .iter()
        .map(|row| (row[0] / HOUR, row[2] / MINUTE))
        .collect();
    let over = [
        Series::new(
            "cone of influence: above it, ends and gaps have an effect",
            cone,
            Style::Dashed,
            1,
        ),
        Series::new(
            "ridge",
            along(found, |place| place.period / MINUTE),
            Style::Line,
            6,
        ),
        Series::new(
            "period of the largest oscillation in a window",
            fitted,
            Style::Points,
            3,
        ),
    ];
    let map = Map {
        axes: ["time (h)", "period (min)"],
        points: [hours, minutes],
        log: true,
        values,
        label: "power |W|²/σ² (1)",
        limits: LIMITS,
    };
    Ok(Figure::new(
        out.join("scalogram.svg"),
        "Wavelet scalogram of a tracked tip",
    )
    .map(&map, &over)?)
}

/// Quantity along the ridge against time (h). The line is broken at gaps and where the ridge
/// changes to another period.
fn along(found: &Nutation, number: impl Fn(&RidgePoint) -> f64) -> Vec<(f64, f64)> {
    let mut line: Vec<(f64, f64)> = Vec::with_capacity(found.ridge.len());
    for (k, place) in found.ridge.iter().enumerate() {
        if k > 0 {
            let before = &found.ridge[k - 1];
            if place.time - before.time > BREAK * HOUR
                || (place.period / before.period).ln().abs() > LEAP
            {
                line.push((f64::NAN, f64::NAN));
            }
        }
        line.push((place.time / HOUR, number(place)));
    }
    line
}

/// Draws the amplitudes against time.
fn amplitudes(
    out: &Path,
    found: &Nutation,
    rows: &[[f64; COLUMNS.len()]],
) -> Result<(), Box<dyn Error>> {
    let column = |k: usize| {
        rows.iter()
            .map(|row| (row[0] / HOUR, MM_PER_M * row[k]))
            .collect()
    };
    let series = [
        Series::new(
            "semi-major axis along the ridge",
            along(found, |place| MM_PER_M * place.ellipse.major),
            Style::Line,
            0,
        ),
        Series::new(
            "semi-major axis of the largest oscillation in a window",
            column(4),
            Style::Points,
            1,
        ),
        Series::new(
            "semi-minor axis of the largest oscillation in a window",
            column(5),
            Style::Points,
            2,
        ),
    ];
    let file = out.join("amplitude.svg");
    Ok(
        Figure::new(file, "Semi-axes of the oscillations of a tracked tip").lines(
            "time (h)",
            "semi-axis (mm)",
            &series,
            Axes::Linear,
        )?,
    )
}

/// Draws the amplitudes of all oscillations that are neither harmonics nor combinations of others.
/// The logarithmic axis shows exponential growth as a straight line.
pub fn mechanism(
    out: &Path,
    found: &Judgement,
    observations: &[Observation],
) -> Result<(), Box<dyn Error>> {
    let amplitudes = |component: &Component| {
        component
            .waves
            .iter()
            .map(|(k, wave)| (observations[*k].time / HOUR, MM_PER_M * wave.amplitude[0]))
            .collect()
    };
    let fundamental = found
        .components
        .iter()
        .filter(|component| component.derived.is_none());
    let series: Vec<Series> = fundamental
        .enumerate()
        .map(|(k, component)| {
            let label = format!("period {:.1} min", component.period[0] / MINUTE);
            Series::new(label, amplitudes(component), Style::Points, k)
        })
        .collect();
    if series.is_empty() {
        return Ok(());
    }
    let title = "Amplitudes of the oscillations of a tracked tip";
    let file = out.join("mechanism.svg");
    Ok(Figure::new(file, title).lines(
        "centre of the window (h)",
        "semi-major axis (mm)",
        &series,
        Axes::LogY,
    )?)
}
