//! SVG figures of the examples.
//!
//! The `plotters` crate serves as the drawing backend only. Its chart builder
//! knows neither equal scales on both axes nor colour bars, and it places
//! labels by a coarse estimate of their width; the axes here are our own.

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

pub use frames::{FramedShape, frames_figure};
pub use lines::{Axes, Series, Style, lines_figure, panels_figure};
pub use map::{Map, map_figure};
pub use orbits::{Orbit, TimedPath, orbits_figure};
pub use path::path_figure;
pub use shapes::shapes_figure;
pub use strips::{Strip, strips_figure};

/// Width of every figure in pixels.
const WIDTH: f64 = 1200.0;
/// Height of the band at the top that holds the figure's title.
const TITLE_BAND: f64 = 62.0;
/// Width kept at the right of coloured figures for the colour bar.
const BAR_COLUMN: f64 = 130.0;

/// Font size of the figure's title.
const TITLE_SIZE: f64 = 26.0;
/// Font size of axis labels and panel titles.
const LABEL_SIZE: f64 = 20.0;
/// Font size of the numbers at the ticks and of legends.
const TICK_SIZE: f64 = 17.0;

/// Points of a line closer than this many pixels are drawn as one.
const MERGED: f64 = 0.7;

/// Lengths come in metres and are shown in millimetres.
const MM_PER_M: f64 = 1e3;

/// The figure's title, centred over the whole width.
fn draw_title(canvas: &mut canvas::Canvas, title: &str) {
    let label = canvas::Label { size: TITLE_SIZE, ..canvas::Label::new(WIDTH / 2.0, TITLE_BAND / 2.0) };
    canvas.text(title, label.fitted(title, WIDTH - 40.0));
}
