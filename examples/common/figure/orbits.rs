//! Paths in a plane side by side, coloured by time.

use std::io;
use std::path::Path;

use plotters::style::RGBColor;

use super::canvas::{Point, write_svg};
use super::colour::ColourScale;
use super::panel::{ABOVE, Axis, BELOW, LEFT, Panel, RIGHT, Rect};
use super::path::NAMES;
use super::range::Range;
use super::{BAR_COLUMN, MM_PER_M, TITLE_BAND, WIDTH, draw_title};

/// Paths that stand in the background.
const FAINT: RGBColor = RGBColor(0xBB, 0xBB, 0xBB);

/// Times (h) and positions (m).
pub type TimedPath = Vec<(f64, [f64; 2])>;

/// A path that has a panel.
pub struct Orbit<'a> {
    /// Stands above the panel.
    pub name: &'a str,
    /// The path, coloured by time.
    pub path: TimedPath,
    /// More of it, in grey behind it.
    pub behind: TimedPath,
}

/// Draws paths in panels of the same scale, two in a row.
pub fn orbits_figure(file: impl AsRef<Path>, title: &str, orbits: &[Orbit]) -> io::Result<()> {
    let points = || orbits.iter().flat_map(|orbit| orbit.path.iter().chain(&orbit.behind));
    let [x, y] = [0, 1].map(|axis| Range::of(points().map(move |p| MM_PER_M * p.1[axis])));
    let side = x.length().max(y.length()).max(1e-6);
    let [x, y] = [x, y].map(|range| range.at_least(0.5 * side).padded(0.05));
    let time = ColourScale::time(orbits.iter().flat_map(|orbit| orbit.path.iter().map(|p| p.0)));
    let column = (WIDTH - BAR_COLUMN) / 2.0;
    let frame_width = column - LEFT - RIGHT;
    let row = ABOVE + frame_width * y.length() / x.length() + BELOW;
    let height = TITLE_BAND + row * orbits.len().div_ceil(2) as f64 + 10.0;
    write_svg(file.as_ref(), WIDTH, height, |canvas| {
        draw_title(canvas, title);
        for (i, orbit) in orbits.iter().enumerate() {
            let (left, top) = (column * (i % 2) as f64, TITLE_BAND + row * (i / 2) as f64);
            let cell = Rect { left, top, right: left + column, bottom: top + row };
            let panel = Panel::new(cell, Axis::linear(NAMES[0], x), Axis::linear(NAMES[1], y), true);
            panel.draw(canvas, orbit.name);
            let at = |p: &(f64, [f64; 2])| panel.at(MM_PER_M * p.1[0], MM_PER_M * p.1[1]);
            let behind: Vec<Point> = orbit.behind.iter().filter_map(at).collect();
            canvas.line(&behind, FAINT, 1.4);
            let path: Vec<(f64, Option<Point>)> = orbit.path.iter().map(|p| (p.0, at(p))).collect();
            time.line(canvas, &path, 2.6);
        }
        time.draw_bar(canvas, WIDTH - BAR_COLUMN + 12.0, TITLE_BAND + ABOVE, TITLE_BAND + row - BELOW);
    })
}
