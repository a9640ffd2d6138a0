//! Track of a point in space and its three projections.

use std::io;

use plotters::style::RGBColor;

use super::canvas::{Canvas, Label, Point};
use super::colour::ColourScale;
use super::panel::{ABOVE, Axis, BELOW, LEFT, Panel, RIGHT, Rect};
use super::range::Range;
use super::strips::{Strip, draw_strips, strips_height};
use super::view::{View, extent};
use super::{BAR_COLUMN, Figure, MM_PER_M, S_PER_H};

/// Names of the axes in space.
pub const NAMES: [&str; 3] = ["x (mm)", "y (mm)", "z (mm)"];

impl Figure {
    /// Draws a track coloured by time: a view in space, a top view, a front view and a side view.
    /// Strips over time are drawn below.
    ///
    /// Each place consists of a time (s) and a position (m). Places that are not finite are gaps.
    pub fn path(
        &self,
        path: &[(f64, impl Into<[f64; 3]> + Copy)],
        strips: &[Strip],
    ) -> io::Result<()> {
        let (wide, band) = (self.wide(2), self.band());
        let path: Vec<(f64, [f64; 3])> = path
            .iter()
            .map(|(time, p)| (time / S_PER_H, (*p).into().map(|c| c * MM_PER_M)))
            .collect();
        let usable = |p: &&(f64, [f64; 3])| p.0.is_finite() && p.1.iter().all(|c| c.is_finite());
        let ranges = space_ranges(path.iter().filter(usable).map(|p| p.1));
        let [x, y, z] = ranges;
        let time = ColourScale::time(path.iter().filter(usable).map(|p| p.0));

        let column = (wide - BAR_COLUMN) / 2.0;
        let frame_width = column - LEFT - RIGHT;
        let side = x.length().max(y.length());
        let (view_width, view_height) = extent(ranges);
        let upper = row_height(frame_width, y.length() / x.length())
            .max(row_height(frame_width, view_height / view_width));
        let lower = row_height(frame_width, z.length() / side);
        let split = band + upper + ABOVE + BELOW;
        let height = split + lower + ABOVE + BELOW + 10.0;
        let cell = |col: usize, top: f64, bottom: f64| {
            let left = column * col as f64;
            Rect {
                left,
                top,
                right: left + column,
                bottom,
            }
        };

        let view = View::new(cell(0, band, split), ranges);
        // Front view and side view have the same width and hence the same scale.
        let panels = [
            (cell(1, band, split), 0, x, 1, y, "top view"),
            (
                cell(0, split, height),
                0,
                x.at_least(side),
                2,
                z,
                "front view",
            ),
            (
                cell(1, split, height),
                1,
                y.at_least(side),
                2,
                z,
                "side view",
            ),
        ];
        self.draw(2, height + strips_height(strips, wide), |canvas| {
            draw_strips(canvas, wide, height, "time (h)", strips);
            view.draw(canvas, NAMES);
            let shadow: Vec<Point> = path.iter().filter_map(|p| view.foot(p.1)).collect();
            if shadow.len() > 1 {
                canvas.line(&shadow, RGBColor(0xC8, 0xC8, 0xC8), 1.5);
            }
            draw_path(canvas, &time, &path, |p| view.at(p));
            for (cell, i, across, j, upwards, name) in panels {
                let (h, v) = (NAMES[i], NAMES[j]);
                let panel = Panel::new(
                    cell,
                    Axis::linear(h, across),
                    Axis::linear(v, upwards),
                    true,
                );
                panel.draw(canvas, name);
                draw_path(canvas, &time, &path, |p| panel.at(p[i], p[j]));
            }
            let left = wide - BAR_COLUMN + 12.0;
            let bottom = split - BELOW;
            time.draw_bar(canvas, left, band + ABOVE, bottom);
            draw_key(canvas, left, bottom + 40.0);
        })
    }
}

/// Returns the ranges of the coordinates with a margin. Each is at least a fraction of the largest,
/// so that a straight track still spans a box.
pub fn space_ranges(points: impl Iterator<Item = [f64; 3]> + Clone) -> [Range; 3] {
    let raw = [0, 1, 2].map(|i| Range::of(points.clone().map(move |p| p[i])));
    let largest = raw.iter().map(|r| r.length()).fold(0.0, f64::max);
    let magnitude = raw.iter().map(|r| r.magnitude()).fold(0.0, f64::max);
    // The rounding errors of a stationary point are not magnified.
    let largest = if magnitude < 1e-9 {
        1.0
    } else if largest < 1e-6 * magnitude {
        0.2 * magnitude
    } else {
        largest
    };
    raw.map(|r| r.at_least(0.3 * largest).padded(0.06))
}

/// Returns the height of a row of panels for data with the given ratio of height to width. Limits
/// keep the figure on a page.
fn row_height(frame_width: f64, aspect: f64) -> f64 {
    (frame_width * aspect).clamp(280.0, 560.0)
}

fn draw_path(
    canvas: &mut Canvas,
    time: &ColourScale,
    path: &[(f64, [f64; 3])],
    at: impl Fn([f64; 3]) -> Option<Point>,
) {
    let shown = || {
        path.iter()
            .map(|(hours, p)| (*hours, at(*p).filter(|_| hours.is_finite())))
    };
    time.line(canvas, shown(), 2.2);
    let mut visible = shown().filter_map(|(hours, p)| Some((hours, p?)));
    if let Some(first) = visible.next() {
        let last = visible.next_back().unwrap_or(first);
        canvas.ring(first.1, 5.0, time.colour(first.0), 2.0);
        canvas.dot(last.1, 5.5, time.colour(last.0));
    }
}

fn draw_key(canvas: &mut Canvas, left: f64, top: f64) {
    let dark = Label::new(0.0, 0.0).colour;
    canvas.ring((left + 11.0, top), 5.0, dark, 2.0);
    canvas.dot((left + 11.0, top + 26.0), 5.5, dark);
    for (text, y) in [("start", top), ("end", top + 26.0)] {
        canvas.text_beside(text, left + 28.0, y);
    }
}
