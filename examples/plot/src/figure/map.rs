//! Maps: a quantity as a function of two parameters, shown by colour.

use std::io;

use plotters::style::RGBColor;

use super::colour::{AREA, ColourScale};
use super::legend::{draw_below, height_below};
use super::lines::{Series, Style, draw_series, runs};
use super::panel::{ABOVE, Axis, BELOW, Panel, Rect};
use super::range::Range;
use super::{BAR_COLUMN, Figure};

/// Height of a map beyond that of other panels.
const BEYOND: f64 = 10.0;
/// Width of the white border of lines, which separates them from the colours below.
const HALO: f64 = 6.0;
/// Overlap of adjacent cells in pixels. Cells without overlap would show seams.
const OVERLAP: f64 = 1.5;

/// Values at the points of a grid.
pub struct Map<'a> {
    /// Quantities and units of both axes.
    pub axes: [&'a str; 2],
    /// Points along both axes, increasing and equally spaced; on a logarithmic axis, with equal
    /// ratios.
    pub points: [Vec<f64>; 2],
    /// Whether the second axis is logarithmic.
    pub log: bool,
    /// Values, row by row from the first point of the second axis. NaN is drawn in grey.
    pub values: Vec<f64>,
    /// Quantity and unit of the values.
    pub label: &'a str,
    /// Values at the ends of the logarithmic colour bar. Values outside have the colour of the
    /// nearer end.
    pub limits: [f64; 2],
}

impl Figure {
    /// Draws a map with a colour bar, series on top of it, and a legend below.
    pub fn map(&self, map: &Map, over: &[Series]) -> io::Result<()> {
        let (wide, band) = (self.wide(1), self.band());
        let x = Axis::linear(map.axes[0], cells(&map.points[0]));
        let upwards: Vec<f64> = map.points[1]
            .iter()
            .map(|value| if map.log { value.log10() } else { *value })
            .collect();
        let y = Axis {
            log: map.log,
            ..Axis::linear(map.axes[1], cells(&upwards))
        };
        let listed: Vec<&Series> = over.iter().filter(|one| !one.label.is_empty()).collect();
        let tall = self.tall(wide) + BEYOND;
        let cell = Rect {
            left: 0.0,
            top: band - ABOVE,
            right: wide - BAR_COLUMN,
            bottom: tall,
        };
        let panel = Panel::new(cell, x, y, false);
        let scale = ColourScale::logarithmic(map.label, map.limits[0], map.limits[1]);
        self.draw(1, tall + 10.0 + height_below(&listed, wide), |canvas| {
            panel.draw(canvas, "");
            let Rect {
                left,
                top,
                right,
                bottom,
            } = panel.frame();
            let [across, upwards] = [0, 1].map(|axis| map.points[axis].len());
            let (width, height) = (
                (right - left) / across as f64,
                (bottom - top) / upwards as f64,
            );
            for (k, value) in map.values.iter().enumerate() {
                let (i, j) = ((k % across) as f64, (k / across) as f64);
                let (west, south) = (left + width * i, bottom - height * j);
                let (east, north) = (
                    (west + width + OVERLAP).min(right),
                    (south - height - OVERLAP).max(top),
                );
                let colour = if value.is_finite() {
                    scale.colour(*value)
                } else {
                    AREA
                };
                canvas.area(
                    &[(west, south), (east, south), (east, north), (west, north)],
                    colour,
                );
            }
            for one in over {
                // A border would join the markers of a series.
                for run in runs(&panel, one)
                    .iter()
                    .filter(|_| one.style != Style::Points)
                {
                    canvas.line(run, RGBColor(255, 255, 255), HALO);
                }
                draw_series(canvas, &panel, one);
            }
            panel.draw_frame(canvas);
            scale.draw_bar(canvas, wide - BAR_COLUMN + 12.0, top, bottom);
            draw_below(canvas, &listed, wide, tall + 0.1 * BELOW);
        })
    }
}

/// Returns the range of cells centred at equally spaced points.
fn cells(points: &[f64]) -> Range {
    let range = Range::of(points.iter().copied());
    match points.len() {
        0 | 1 => range.not_empty(),
        n => range.padded(0.5 / (n - 1) as f64),
    }
}
