//! Centre lines of a shoot at several times in two projections.

use std::io;

use super::colour::ColourScale;
use super::panel::{ABOVE, Axis, BELOW, LEFT, Panel, RIGHT, Rect};
use super::path::{NAMES, space_ranges};
use super::{BAR_COLUMN, Figure, MM_PER_M, S_PER_H};

impl Figure {
    /// Draws centre lines coloured by time in the planes x–z and y–z with equal scales.
    ///
    /// Each shape consists of a time (s) and the points of the centre line (m).
    pub fn shapes(&self, shapes: &[(f64, Vec<impl Into<[f64; 3]> + Copy>)]) -> io::Result<()> {
        let (wide, band) = (self.wide(2), self.band());
        let shapes: Vec<(f64, Vec<[f64; 3]>)> = shapes
            .iter()
            .filter(|(time, _)| time.is_finite())
            .map(|(time, line)| {
                (
                    time / S_PER_H,
                    line.iter()
                        .map(|p| (*p).into().map(|c| c * MM_PER_M))
                        .collect(),
                )
            })
            .collect();
        let all = shapes.iter().flat_map(|(_, line)| line.iter().copied());
        let [x, y, z] = space_ranges(all.filter(|p| p.iter().all(|c| c.is_finite())));
        let time = ColourScale::time(shapes.iter().map(|s| s.0));

        let column = (wide - BAR_COLUMN) / 2.0;
        let side = x.length().max(y.length());
        let frame_height = ((column - LEFT - RIGHT) * z.length() / side).clamp(360.0, 760.0);
        let height = band + ABOVE + frame_height + BELOW + 10.0;
        self.draw(2, height, |canvas| {
            for (col, range, name) in [(0, x, "front view"), (1, y, "side view")] {
                let across = Axis::linear(NAMES[col], range.at_least(side));
                let left = column * col as f64;
                let cell = Rect {
                    left,
                    top: band,
                    right: left + column,
                    bottom: height - 10.0,
                };
                let panel = Panel::new(cell, across, Axis::linear(NAMES[2], z), true);
                panel.draw(canvas, name);
                for (hours, line) in &shapes {
                    time.line(
                        canvas,
                        line.iter().map(|p| (*hours, panel.at(p[col], p[2]))),
                        2.6,
                    );
                }
            }
            let bottom = height - 10.0 - BELOW;
            time.draw_bar(canvas, wide - BAR_COLUMN + 12.0, band + ABOVE, bottom);
        })
    }
}
