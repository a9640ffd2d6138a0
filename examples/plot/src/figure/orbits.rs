//! Tracks in a plane, side by side, coloured by time.

use std::io;

use plotters::style::RGBColor;

use super::canvas::Point;
use super::colour::ColourScale;
use super::panel::{ABOVE, Axis, BELOW, LEFT, Panel, RIGHT, Rect};
use super::path::NAMES;
use super::range::Range;
use super::{BAR_COLUMN, Figure, MM_PER_M};

/// Colour of tracks in the background.
const FAINT: RGBColor = RGBColor(0xBB, 0xBB, 0xBB);
/// Number of pieces of the interpolating curve between two samples.
const PIECES: u32 = 6;

/// Times (h) and positions (m).
pub type TimedPath = Vec<(f64, [f64; 2])>;

/// Track of one panel.
pub struct Orbit {
    /// Title of the panel.
    pub name: String,
    /// Track, coloured by time.
    pub path: TimedPath,
    /// Longer part of the track, drawn in grey behind it.
    pub behind: TimedPath,
}

impl Figure {
    /// Draws tracks in panels of the same scale, two in a row, coloured by the share of the time of
    /// each. Cubic Hermite interpolation connects the samples.
    pub fn orbits(&self, orbits: &[Orbit]) -> io::Result<()> {
        let (wide, band) = (self.wide(2), self.band());
        let points = || {
            orbits
                .iter()
                .flat_map(|orbit| orbit.path.iter().chain(&orbit.behind))
        };
        let [x, y] = [0, 1].map(|axis| Range::of(points().map(move |p| MM_PER_M * p.1[axis])));
        let side = x.length().max(y.length()).max(1e-6);
        let [x, y] = [x, y].map(|range| range.at_least(0.5 * side).padded(0.05));
        // Tracks of one panel would have nearly one colour on a scale of the time of all.
        let time = ColourScale::share_of("share of the time of a panel (1)");
        let column = (wide - BAR_COLUMN) / 2.0;
        let frame_width = column - LEFT - RIGHT;
        let row = ABOVE + frame_width * y.length() / x.length() + BELOW;
        let height = band + row * orbits.len().div_ceil(2) as f64 + 10.0;
        self.draw(2, height, |canvas| {
            for (i, orbit) in orbits.iter().enumerate() {
                let (left, top) = (column * (i % 2) as f64, band + row * (i / 2) as f64);
                let cell = Rect {
                    left,
                    top,
                    right: left + column,
                    bottom: top + row,
                };
                let panel = Panel::new(
                    cell,
                    Axis::linear(NAMES[0], x),
                    Axis::linear(NAMES[1], y),
                    true,
                );
                panel.draw(canvas, &orbit.name);
                let at = |p: &(f64, [f64; 2])| panel.at(MM_PER_M * p.1[0], MM_PER_M * p.1[1]);
                let behind: Vec<Point> =
                    interpolated(&orbit.behind).iter().filter_map(at).collect();
                canvas.line(&behind, FAINT, 1.4);
                let track = interpolated(&orbit.path);
                let (from, to) = (
                    track.first().map_or(0.0, |p| p.0),
                    track.last().map_or(1.0, |p| p.0),
                );
                time.line(
                    canvas,
                    track.iter().map(|p| ((p.0 - from) / (to - from), at(p))),
                    2.6,
                );
            }
            time.draw_bar(
                canvas,
                wide - BAR_COLUMN + 12.0,
                band + ABOVE,
                band + row - BELOW,
            );
        })
    }
}

/// Inserts points between the samples of a track by cubic Hermite interpolation in time. The slopes
/// are central differences, and one-sided differences at the ends.
fn interpolated(track: &[(f64, [f64; 2])]) -> TimedPath {
    let slope = |i: usize| {
        let (before, after) = (
            track[i.saturating_sub(1)],
            track[(i + 1).min(track.len() - 1)],
        );
        [0, 1].map(|axis| (after.1[axis] - before.1[axis]) / (after.0 - before.0))
    };
    let mut points = Vec::new();
    for i in 1..track.len() {
        let ((from, a), (to, b)) = (track[i - 1], track[i]);
        let (da, db, h) = (slope(i - 1), slope(i), to - from);
        for k in 0..PIECES {
            let u = f64::from(k) / f64::from(PIECES);
            let at = |axis: usize| {
                let (rise, v) = (b[axis] - a[axis], 1.0 - u);
                a[axis] + u * u * (3.0 - 2.0 * u) * rise + h * u * v * (v * da[axis] - u * db[axis])
            };
            points.push((from + u * h, [at(0), at(1)]));
        }
    }
    points.extend(track.last());
    points
}
