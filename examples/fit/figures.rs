//! Figures of a fit: data with the fitted shoot, residuals, and confidence ellipses.

use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;

use morphorod::fit::{Estimates, Verdict};

use super::data::{Points, Timed};
use morphorod_plot::{Axes, Figure, Series, Style, Table};

const HOUR: f64 = 3600.0;
const MM_PER_M: f64 = 1e3;

/// 90 % quantile of χ² with two degrees of freedom.
const QUANTILE: f64 = 4.605_170;

/// Draws all figures, and writes the residuals. `paths` are those of the fitted shoot.
pub fn draw(
    out: &Path,
    data: &Points,
    paths: &[Timed],
    found: &Estimates,
) -> Result<(), Box<dyn Error>> {
    let pairs = |points: &[[f64; 2]]| points.iter().map(|[x, y]| (*x, *y)).collect::<Vec<_>>();
    let mut series = Vec::new();
    for (label, style, sets) in [
        ("data", Style::Points, &data.points[..]),
        ("fit", Style::Line, paths),
    ] {
        for (hours, points) in sets {
            let one = Series::new(
                label,
                pairs(points),
                style,
                if label == "data" { 5 } else { 0 },
            );
            series.push(if data.lines { one.at_time(*hours) } else { one });
        }
    }
    let ([x, y], axes) = (
        data.axes,
        if data.is_plane() {
            Axes::Equal
        } else {
            Axes::Linear
        },
    );
    Figure::new(out.join("fit.svg"), "Data and the fitted shoot").lines(x, y, &series, axes)?;

    let unit = if data.is_angle() {
        "residual_rad"
    } else {
        "residual_m"
    };
    let mut table = Table::create(out.join("residuals.csv"), &["series", "t_s", unit])?;
    for (index, time, value) in &found.residuals {
        table.row(&[*index as f64, *time, *value])?;
    }
    table.finish()?;
    let (factor, y) = if data.is_angle() {
        (1_f64.to_degrees(), "residual (degrees)")
    } else {
        (MM_PER_M, "residual (mm)")
    };
    let residual = |(_, time, value): &(usize, f64, f64)| (time / HOUR, factor * value);
    let residuals = found.residuals.iter().map(residual).collect();
    let residuals = [Series::new(
        "simulated minus measured",
        residuals,
        Style::Points,
        5,
    )];
    let title = format!(
        "Residuals: correlation of successive values {:.2}",
        found.lag_one
    );
    Figure::new(out.join("residuals.svg"), title).lines("time (h)", y, &residuals, Axes::Linear)?;
    ellipses(out, found)
}

/// Draws the regions that contain two parameters with a probability of 90 %, for at most three
/// pairs of successive logarithmic parameters.
fn ellipses(out: &Path, found: &Estimates) -> Result<(), Box<dyn Error>> {
    let has_error = |k: &usize| {
        matches!(
            found.parameters[*k].verdict,
            Verdict::Identifiable | Verdict::PracticallyNot
        )
    };
    let known: Vec<usize> = (0..found.parameters.len())
        .filter(has_error)
        .filter(|k| found.parameters[*k].relative)
        .collect();
    let (mut panels, correlations) = (Vec::new(), found.correlations());
    for pair in known.chunks_exact(2).take(3) {
        let [a, b] = [&found.parameters[pair[0]], &found.parameters[pair[1]]];
        let correlation = correlations[pair[0]][pair[1]];
        let rest = (1.0 - correlation * correlation).max(0.0).sqrt();
        let point = |k: u32| {
            let (sine, cosine) = (TAU * f64::from(k) / 100.0).sin_cos();
            let scale = 100.0 * QUANTILE.sqrt();
            (
                scale * a.error * cosine,
                scale * b.error * (correlation * cosine + rest * sine),
            )
        };
        let labels = [a, b].map(|one| format!("difference of {} (%)", one.name));
        panels.push((
            labels,
            [Series::new(
                "",
                (0..=100).map(point).collect(),
                Style::Line,
                0,
            )],
        ));
    }
    if panels.is_empty() {
        return Ok(());
    }
    let panels: Vec<(&str, [&str; 2], &[Series])> = panels
        .iter()
        .map(|([a, b], series)| ("", [a.as_str(), b.as_str()], &series[..]))
        .collect();
    let title = "Regions around the estimates with a probability of 90 %";
    Ok(Figure::new(out.join("ellipses.svg"), title).separate_panels(&panels, Axes::Linear)?)
}
