//! SVG figures of the examples.
//!
//! The crate `plotters` writes the SVG elements. The modules here draw axes, legends and colour
//! bars, because the chart builder of `plotters` has neither equal scales on both axes nor colour
//! bars.

mod canvas;
mod colour;
mod frames;
mod legend;
mod lines;
mod map;
mod orbits;
mod panel;
mod path;
mod range;
mod shapes;
mod strips;
mod ticks;
mod view;

pub use frames::{FramedPanel, FramedShape, frames_figure};
pub use lines::{Axes, Series, Style, lines_figure, panels_figure};
pub use map::{Map, map_figure};
pub use orbits::{Orbit, TimedPath, orbits_figure};
pub use path::path_figure;
pub use shapes::shapes_figure;
pub use strips::{Strip, strips_figure};

/// Width of every figure in pixels.
const WIDTH: f64 = 1200.0;
/// Height of the band at the top for the title of the figure.
const TITLE_BAND: f64 = 62.0;
/// Width of the column for the colour bar at the right.
const BAR_COLUMN: f64 = 130.0;

/// Font size of the title of the figure.
const TITLE_SIZE: f64 = 26.0;
/// Font size of axis labels and panel titles.
const LABEL_SIZE: f64 = 20.0;
/// Font size of tick labels and legends.
const TICK_SIZE: f64 = 17.0;

/// Distance in pixels below which successive points of a line are merged.
const MERGED: f64 = 0.7;

/// Conversion of lengths from metres to the millimetres of the axes.
const MM_PER_M: f64 = 1e3;

/// Draws the title of the figure, centred over the whole width.
fn draw_title(canvas: &mut canvas::Canvas, title: &str) {
    let label = canvas::Label { size: TITLE_SIZE, ..canvas::Label::new(WIDTH / 2.0, TITLE_BAND / 2.0) };
    canvas.text(title, label.fitted(title, WIDTH - 40.0));
}
