//! Lines and points over linear or logarithmic axes.

use std::io;

use plotters::style::RGBColor;

use super::canvas::{Canvas, Label, Point};
use super::colour::{AREA, ColourScale, DOT, ordered, paler, palette};
use super::legend::{
    draw_badge, draw_below, draw_legend, draw_marker, height_below, is_beside, legend_width, listed,
};
use super::panel::{ABOVE, Axis, Panel, Rect};
use super::range::Range;
use super::{BAR_COLUMN, Figure, MERGED};

/// Radius of grey dots, pixels.
pub const DOT_RADIUS: f64 = 2.4;

/// Kinds of series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A solid line.
    Line,
    /// A dashed line.
    Dashed,
    /// A dotted line.
    Dotted,
    /// A line of dashes and dots in turn.
    DashDot,
    /// A thin, pale, dashed line, for what is behind a body.
    Hidden,
    /// Markers only.
    Points,
    /// Markers joined by a thin line, in the order of the points.
    Marked,
    /// Small grey dots, for measured positions behind a line.
    Dots,
    /// The polygon with these corners, filled with light grey. The axes then have no margin.
    Area,
    /// The text of the series in a circle at each point; identifies a curve in prints without
    /// colour.
    Badge,
    /// The text of the series, centred at each point.
    Text,
    /// The text of the series, right of each point.
    Beside,
}

impl Style {
    /// Lengths of the dashes and gaps of a line in widths of the line; empty for a solid line.
    /// Round ends lengthen dashes by one width.
    pub(super) fn pattern(self) -> &'static [f64] {
        match self {
            Self::Dashed => &[4.0, 3.5],
            Self::Dotted => &[0.3, 2.7],
            Self::DashDot => &[6.0, 3.0, 0.3, 3.0],
            Self::Hidden => &[2.5, 3.5],
            _ => &[],
        }
    }

    /// Width of a line, pixels.
    pub(super) fn width(self) -> f64 {
        match self {
            Self::Hidden => 1.4,
            _ => 2.4,
        }
    }
}

/// Scales of the two axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// Two linear axes, each fitted to the data.
    Linear,
    /// Two linear axes with the same scale, for positions in a plane. Each panel is fitted to its
    /// own data.
    Equal,
    /// Linear x axis and logarithmic y axis.
    LogY,
    /// Logarithmic x axis and linear y axis.
    LogX,
    /// Two logarithmic axes, for errors against step sizes or run times.
    LogLog,
}

/// One set of points in a figure.
#[derive(Clone, Debug)]
pub struct Series {
    /// Text in the legend; no entry if empty.
    pub label: String,
    /// Points in the units of the axes. Points that are not finite, or not positive on a
    /// logarithmic axis, are omitted.
    pub points: Vec<(f64, f64)>,
    /// Kind of series.
    pub style: Style,
    /// Index in the palette of eight colours; also selects the marker.
    pub colour: usize,
    /// Position on the ordered colour scale, from 0 to 1; replaces the colour of the palette.
    pub rank: Option<f64>,
    /// Time, h, which gives the colour on a colour bar; replaces the other colours.
    pub time: Option<f64>,
    /// Text at the points; in the legend, text on the line sample.
    pub text: String,
}

impl Series {
    /// Returns a series with a colour of the palette.
    pub fn new(
        label: impl Into<String>,
        points: Vec<(f64, f64)>,
        style: Style,
        colour: usize,
    ) -> Self {
        Self {
            label: label.into(),
            points,
            style,
            colour,
            rank: None,
            time: None,
            text: String::new(),
        }
    }

    /// Returns a text at one place.
    pub fn text(text: impl Into<String>, at: (f64, f64), style: Style, colour: usize) -> Self {
        Self {
            text: text.into(),
            ..Self::new("", vec![at], style, colour)
        }
    }

    /// Adds a badge to the line sample in the legend.
    pub fn with_badge(self, text: impl Into<String>) -> Self {
        Self {
            text: text.into(),
            ..self
        }
    }

    /// Colours one of `count` series of an ordered quantity: `index` 0 is dark and `count − 1` is
    /// light.
    pub fn ordered(self, index: usize, count: usize) -> Self {
        Self {
            rank: Some(index as f64 / count.saturating_sub(1).max(1) as f64),
            ..self
        }
    }

    /// Colours one of several series by its time, h, with a colour bar at the right of the figure.
    pub fn at_time(self, hours: f64) -> Self {
        Self {
            time: Some(hours),
            ..self
        }
    }

    /// Returns the colour of the series.
    pub(super) fn paint(&self) -> RGBColor {
        let colour = self.rank.map_or_else(|| palette(self.colour), ordered);
        match self.style {
            Style::Hidden => paler(colour),
            _ => colour,
        }
    }
}

impl Figure {
    /// Draws several series in one panel with the legend at its right, or below a narrow panel.
    pub fn lines(
        &self,
        x_label: &str,
        y_label: &str,
        series: &[Series],
        axes: Axes,
    ) -> io::Result<()> {
        self.panels(x_label, y_label, &[("", series)], axes)
    }

    /// Draws several panels side by side with one legend. The legend is at the right of a single
    /// panel, or below several panels and narrow ones. Panels with [`Axes::Equal`] have their own
    /// ranges; other panels share theirs.
    pub fn panels(
        &self,
        x_label: &str,
        y_label: &str,
        panels: &[(&str, &[Series])],
        axes: Axes,
    ) -> io::Result<()> {
        let panels: Vec<_> = panels
            .iter()
            .map(|(name, series)| (*name, [x_label, y_label], *series, axes))
            .collect();
        self.draw_panels(&panels, axes == Axes::Equal)
    }

    /// Draws several panels, each with its name, the labels of its axes, and its own ranges. More
    /// than three panels are in rows of two, and the height of the figure is that of a row.
    pub fn separate_panels(
        &self,
        panels: &[(&str, [&str; 2], &[Series])],
        axes: Axes,
    ) -> io::Result<()> {
        let panels: Vec<_> = panels
            .iter()
            .map(|(name, labels, series)| (*name, *labels, *series, axes))
            .collect();
        self.draw_panels(&panels, true)
    }

    /// Draws panels as [`separate_panels`](Self::separate_panels), each with its own kind of axes.
    pub fn mixed_panels(&self, panels: &[(&str, [&str; 2], &[Series], Axes)]) -> io::Result<()> {
        self.draw_panels(panels, true)
    }

    /// Draws panels with names and labels, and legend or colour bar.
    fn draw_panels(
        &self,
        panels: &[(&str, [&str; 2], &[Series], Axes)],
        own_ranges: bool,
    ) -> io::Result<()> {
        let (wide, band) = (self.wide(panels.len()), self.band());
        let tall = self.tall(wide);
        let times = || {
            panels
                .iter()
                .flat_map(|(_, _, series, _)| *series)
                .filter_map(|one| one.time)
        };
        let time = times().next().map(|_| ColourScale::time(times()));
        let coloured = |one: &Series| match (&time, one.time) {
            (Some(scale), Some(time)) => Series {
                rank: Some(scale.share(time)),
                ..one.clone()
            },
            _ => one.clone(),
        };
        let panels: Vec<(&str, [&str; 2], Vec<Series>, Axes)> = panels
            .iter()
            .map(|(name, labels, all, axes)| {
                (*name, *labels, all.iter().map(coloured).collect(), *axes)
            })
            .collect();
        let all: Vec<&Series> = panels.iter().flat_map(|(_, _, series, _)| series).collect();
        let listed = listed(&all);
        let right = panels.len() == 1 && time.is_none() && is_beside(&listed, wide);
        let beside = if right {
            legend_width(&listed)
        } else {
            time.as_ref().map_or(0.0, |_| BAR_COLUMN)
        };
        let columns = if panels.len() > 3 {
            2
        } else {
            panels.len().max(1)
        };
        let width = (wide - beside) / columns as f64;
        // A panel without a name needs no space for it.
        let top = if panels.iter().all(|(name, ..)| name.is_empty()) {
            band - ABOVE
        } else {
            band
        };
        let row = tall - top;
        let bottom = tall + row * panels.len().div_ceil(columns).saturating_sub(1) as f64;
        let height = bottom
            + 10.0
            + if right {
                0.0
            } else {
                height_below(&listed, wide)
            };
        self.draw(panels.len(), height, |canvas| {
            let mut frame = Rect {
                left: 0.0,
                top,
                right: wide,
                bottom,
            };
            for (i, (name, labels, series, axes)) in panels.iter().enumerate() {
                let (left, down) = (width * (i % columns) as f64, row * (i / columns) as f64);
                let cell = Rect {
                    left,
                    top: top + down,
                    right: left + width,
                    bottom: tall + down,
                };
                let shown = if own_ranges {
                    series.iter().collect()
                } else {
                    all.clone()
                };
                let (x, y) = fitted_axes(labels[0], labels[1], &shown, *axes);
                let panel = Panel::new(cell, x, y, *axes == Axes::Equal);
                let (areas, rest): (Vec<&Series>, _) =
                    series.iter().partition(|one| one.style == Style::Area);
                areas
                    .into_iter()
                    .for_each(|one| draw_series(canvas, &panel, one));
                panel.draw(canvas, name);
                rest.into_iter()
                    .for_each(|one| draw_series(canvas, &panel, one));
                frame = panel.frame();
            }
            time.iter().for_each(|time| {
                time.draw_bar(canvas, frame.right + 38.0, frame.top, frame.bottom)
            });
            if right {
                draw_legend(canvas, &listed, wide - beside, frame.top);
            } else {
                draw_below(canvas, &listed, wide, bottom);
            }
        })
    }
}

/// Returns axes whose ranges contain all series.
pub fn fitted_axes(x_label: &str, y_label: &str, series: &[&Series], axes: Axes) -> (Axis, Axis) {
    let (log_x, log_y) = match axes {
        Axes::Linear | Axes::Equal => (false, false),
        Axes::LogX => (true, false),
        Axes::LogY => (false, true),
        Axes::LogLog => (true, true),
    };
    let shown = || {
        let points = series.iter().flat_map(|s| s.points.iter().copied());
        points.filter(move |(x, y)| usable(*x, log_x) && usable(*y, log_y))
    };
    let padding = if series.iter().any(|one| one.style == Style::Area) {
        0.0
    } else {
        0.04
    };
    (
        fitted_axis(x_label, shown().map(|p| p.0), log_x, padding),
        fitted_axis(y_label, shown().map(|p| p.1), log_y, padding),
    )
}

fn usable(value: f64, log: bool) -> bool {
    value.is_finite() && (!log || value > 0.0)
}

fn fitted_axis(label: &str, values: impl Iterator<Item = f64>, log: bool, padding: f64) -> Axis {
    let range = if log {
        // The range is at least half a decade, so that it contains ticks.
        Range::of(values.map(f64::log10)).at_least(0.5)
    } else {
        Range::of(values).not_empty()
    };
    Axis {
        label: label.into(),
        range: range.padded(padding),
        log,
    }
}

/// Returns the visible points of a series in pixels. A point that is omitted divides the line.
pub fn runs(panel: &Panel, series: &Series) -> Vec<Vec<Point>> {
    let points: Vec<Option<Point>> = series
        .points
        .iter()
        .map(|(x, y)| panel.at(*x, *y))
        .collect();
    let runs = points.split(Option::is_none).filter(|run| !run.is_empty());
    runs.map(|run| run.iter().copied().flatten().collect())
        .collect()
}

/// Draws a series in a panel.
pub fn draw_series(canvas: &mut Canvas, panel: &Panel, series: &Series) {
    let colour = series.paint();
    for run in &runs(panel, series) {
        match series.style {
            Style::Line | Style::Dashed | Style::Dotted | Style::DashDot | Style::Hidden => {
                let (width, pattern) = (series.style.width(), series.style.pattern());
                canvas.dashed(&thinned(run), colour, width, pattern);
            }
            Style::Marked if run.len() > 1 => canvas.line(&thinned(run), colour, 1.4),
            Style::Area => canvas.area(run, AREA),
            _ => {}
        }
        for point in thinned(run) {
            match series.style {
                Style::Points | Style::Marked => draw_marker(canvas, point, series),
                Style::Dots => canvas.dot(point, DOT_RADIUS, DOT),
                Style::Badge => draw_badge(canvas, point, &series.text, series.colour),
                Style::Text => canvas.text(&series.text, Label::new(point.0, point.1)),
                Style::Beside => canvas.text_beside(&series.text, point.0 + 9.0, point.1),
                Style::Line
                | Style::Dashed
                | Style::Dotted
                | Style::DashDot
                | Style::Hidden
                | Style::Area => {}
            }
        }
    }
}

/// Omits points close to the preceding one, which would only enlarge the file.
fn thinned(run: &[Point]) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::with_capacity(run.len());
    for (i, p) in run.iter().enumerate() {
        let near = kept
            .last()
            .is_some_and(|k| (k.0 - p.0).hypot(k.1 - p.1) < MERGED);
        if !near || i + 1 == run.len() {
            kept.push(*p);
        }
    }
    kept
}
