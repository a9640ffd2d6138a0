//! Lines and points over linear or logarithmic axes.

use std::io;
use std::path::Path;

use super::canvas::{Canvas, Point, write_svg};
use super::colour::palette;
use super::legend::{draw_legend, draw_marker, legend_width};
use super::panel::{Axis, Panel, Rect};
use super::range::Range;
use super::{MERGED, TITLE_BAND, WIDTH, draw_title};

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A solid line.
    Line,
    /// A dashed line.
    Dashed,
    /// Markers only.
    Points,
    /// Markers joined by a thin line, in the order of the points.
    Marked,
}

/// Scales of the two axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// Both linear, each fitted to the data.
    Linear,
    /// Both linear with the same scale, for positions in a plane.
    Equal,
    /// x linear, y logarithmic.
    LogY,
    /// Both logarithmic, for errors over step sizes or run times.
    LogLog,
}

/// One set of points in a figure.
#[derive(Clone, Debug)]
pub struct Series {
    /// Text in the legend; no entry if empty.
    pub label: String,
    /// Points in the units of the axes; those that are not finite, or not
    /// positive on a logarithmic axis, are left out.
    pub points: Vec<(f64, f64)>,
    /// How the series is drawn.
    pub style: Style,
    /// Index into the palette of eight colours; also selects the marker.
    pub colour: usize,
}

impl Series {
    /// A series of the given style.
    pub fn new(label: impl Into<String>, points: Vec<(f64, f64)>, style: Style, colour: usize) -> Self {
        Self { label: label.into(), points, style, colour }
    }
}

/// Draws several series in one panel, with the legend at its right.
pub fn lines_figure(
    file: impl AsRef<Path>,
    title: &str,
    x_label: &str,
    y_label: &str,
    series: &[Series],
    axes: Axes,
) -> io::Result<()> {
    let (log_x, log_y) = match axes {
        Axes::Linear | Axes::Equal => (false, false),
        Axes::LogY => (false, true),
        Axes::LogLog => (true, true),
    };
    let shown = || {
        let points = series.iter().flat_map(|s| s.points.iter().copied());
        points.filter(move |(x, y)| usable(*x, log_x) && usable(*y, log_y))
    };
    let x = fitted_axis(x_label, shown().map(|p| p.0), log_x);
    let y = fitted_axis(y_label, shown().map(|p| p.1), log_y);
    let legend = legend_width(series);
    let height = 760.0;
    let cell = Rect {
        left: 0.0,
        // The title of the figure is the title of the panel.
        top: TITLE_BAND - 34.0,
        right: WIDTH - legend,
        bottom: height - 10.0,
    };
    let panel = Panel::new(cell, x, y, axes == Axes::Equal);
    write_svg(file.as_ref(), WIDTH, height, |canvas| {
        draw_title(canvas, title);
        panel.draw(canvas, "");
        for one in series {
            draw_series(canvas, &panel, one);
        }
        draw_legend(canvas, series, WIDTH - legend, panel.frame().top);
    })
}

fn usable(value: f64, log: bool) -> bool {
    value.is_finite() && (!log || value > 0.0)
}

fn fitted_axis(label: &str, values: impl Iterator<Item = f64>, log: bool) -> Axis {
    let range = if log {
        // Half a decade at least, or the ticks would have nothing to mark.
        Range::of(values.map(f64::log10)).at_least(0.5)
    } else {
        Range::of(values).not_empty()
    };
    Axis { label: label.into(), range: range.padded(0.04), log }
}

fn draw_series(canvas: &mut Canvas, panel: &Panel, series: &Series) {
    let colour = palette(series.colour);
    let places = series.points.iter().map(|(x, y)| panel.at(*x, *y));
    // Points left out split a line instead of being bridged by it.
    let mut runs: Vec<Vec<Point>> = vec![Vec::new()];
    for place in places {
        match (place, runs.last_mut()) {
            (Some(point), Some(run)) => run.push(point),
            (None, Some(run)) if !run.is_empty() => runs.push(Vec::new()),
            _ => {}
        }
    }
    for run in runs.iter().filter(|run| !run.is_empty()) {
        match series.style {
            Style::Line => canvas.line(&thinned(run), colour, 2.4),
            Style::Dashed => canvas.dashed(&thinned(run), colour, 2.4),
            Style::Marked if run.len() > 1 => canvas.line(&thinned(run), colour, 1.4),
            Style::Marked | Style::Points => {}
        }
        if matches!(series.style, Style::Points | Style::Marked) {
            for point in thinned(run) {
                draw_marker(canvas, point, series.colour);
            }
        }
    }
}

/// Without the points that fall on the one before: they would only swell the
/// file.
fn thinned(run: &[Point]) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::with_capacity(run.len());
    for (i, p) in run.iter().enumerate() {
        let near = kept.last().is_some_and(|k| (k.0 - p.0).hypot(k.1 - p.1) < MERGED);
        if !near || i + 1 == run.len() {
            kept.push(*p);
        }
    }
    kept
}
