//! Maps: a quantity as a function of two parameters, shown by colour.

use std::io;
use std::path::Path;

use plotters::style::RGBColor;

use super::canvas::write_svg;
use super::colour::{AREA, ColourScale};
use super::legend::{draw_legend, legend_height};
use super::lines::{Series, Style, draw_series, runs};
use super::panel::{ABOVE, Axis, BELOW, Panel, Rect};
use super::range::Range;
use super::{BAR_COLUMN, TITLE_BAND, WIDTH, draw_title};

/// Lower edge of the panel with its labels; the legend is below it.
const BOTTOM: f64 = 760.0;
/// Width of the white border of lines, which separates them from the colours below.
const HALO: f64 = 6.0;
/// Overlap of adjacent cells in pixels. Cells without overlap would show seams.
const OVERLAP: f64 = 0.6;

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

/// Draws a map with a colour bar, series on top of it, and a legend below.
pub fn map_figure(file: impl AsRef<Path>, title: &str, map: &Map, over: &[Series]) -> io::Result<()> {
    let x = Axis::linear(map.axes[0], cells(&map.points[0]));
    let upwards: Vec<f64> = map.points[1].iter().map(|value| if map.log { value.log10() } else { *value }).collect();
    let y = Axis { log: map.log, ..Axis::linear(map.axes[1], cells(&upwards)) };
    let listed: Vec<&Series> = over.iter().filter(|one| !one.label.is_empty()).collect();
    let columns: Vec<&[&Series]> = listed.chunks(listed.len().div_ceil(3).max(1)).collect();
    let below = columns.iter().map(|column| legend_height(column)).fold(0.0, f64::max);
    let cell = Rect { left: 0.0, top: TITLE_BAND - ABOVE, right: WIDTH - BAR_COLUMN, bottom: BOTTOM };
    let panel = Panel::new(cell, x, y, false);
    let scale = ColourScale::logarithmic(map.label, map.limits[0], map.limits[1]);
    write_svg(file.as_ref(), WIDTH, BOTTOM + 10.0 + below, |canvas| {
        draw_title(canvas, title);
        panel.draw(canvas, "");
        let Rect { left, top, right, bottom } = panel.frame();
        let [across, upwards] = [0, 1].map(|axis| map.points[axis].len());
        let (width, height) = ((right - left) / across as f64, (bottom - top) / upwards as f64);
        for (k, value) in map.values.iter().enumerate() {
            let (i, j) = ((k % across) as f64, (k / across) as f64);
            let (west, south) = (left + width * i, bottom - height * j);
            let (east, north) = ((west + width + OVERLAP).min(right), (south - height - OVERLAP).max(top));
            let colour = if value.is_finite() { scale.colour(*value) } else { AREA };
            canvas.area(&[(west, south), (east, south), (east, north), (west, north)], colour);
        }
        for one in over {
            // A border would join the markers of a series.
            for run in runs(&panel, one).iter().filter(|_| one.style != Style::Points) {
                canvas.line(run, RGBColor(255, 255, 255), HALO);
            }
            draw_series(canvas, &panel, one);
        }
        panel.draw_frame(canvas);
        scale.draw_bar(canvas, WIDTH - BAR_COLUMN + 12.0, top, bottom);
        for (i, column) in columns.iter().enumerate() {
            draw_legend(canvas, column, 60.0 + (WIDTH - 60.0) / 3.0 * i as f64, BOTTOM + 0.1 * BELOW);
        }
    })
}

/// Returns the range of cells centred at equally spaced points.
fn cells(points: &[f64]) -> Range {
    let range = Range::of(points.iter().copied());
    match points.len() {
        0 | 1 => range.not_empty(),
        n => range.padded(0.5 / (n - 1) as f64),
    }
}
