//! Figures as SVG, and as PNG with the feature `png`.
//!
//! The crate `plotters` writes the SVG elements. The modules here draw axes, legends and colour
//! bars, because the chart builder of `plotters` has neither equal scales on both axes nor colour
//! bars.

mod canvas;
mod colour;
mod coloured;
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

pub use frames::{FramedPanel, FramedShape};
pub use lines::{Axes, Series, Style};
pub use map::Map;
pub use orbits::{Orbit, TimedPath};
pub use strips::Strip;

use std::io;
use std::path::PathBuf;

use canvas::{Canvas, Label};

/// Widths in pixels of figures with one column of panels and with several, unless another one is
/// chosen. In print, on one column of a journal (85 mm) and on two (178 mm), letters of `TICK_SIZE`
/// have 5.1 and 7.2 points.
const WIDTHS: [f64; 2] = [800.0, 1200.0];
/// Height of panels relative to the width of the figure.
const ASPECT: f64 = 0.625;
/// Smallest width of a column of panels.
const LEAST: f64 = 300.0;
/// Height of the band at the top for the title of the figure, and without a title.
const TITLE_BAND: [f64; 2] = [62.0, 14.0];
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
/// Conversion of times from seconds to the hours of the axes.
const S_PER_H: f64 = 3600.0;
/// Pixels in a millimetre and in a point of the printed figure (CSS: 96 pixels in an inch).
const PIXELS_PER_MM: f64 = 96.0 / 25.4;
const PIXELS_PER_POINT: f64 = 96.0 / 72.0;

/// File, title and sizes of a figure. Each method that returns a result draws and writes a figure
/// of one kind.
#[derive(Clone, Debug)]
pub struct Figure {
    file: PathBuf,
    title: String,
    width: Option<f64>,
    height: Option<f64>,
    // Pixels of the figure per pixel of the constants above, which are for letters of `TICK_SIZE`.
    scale: f64,
}

impl Figure {
    /// Returns a figure that is written to a file with the ending `svg`, or `png` with 300 dots per
    /// inch. An empty title takes no space.
    pub fn new(file: impl Into<PathBuf>, title: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            title: title.into(),
            width: None,
            height: None,
            scale: 1.0,
        }
    }

    /// Sets the width, mm. The default is 800 pixels on a screen, 212 mm, for one column of panels,
    /// and 1200 pixels, 317 mm, for several.
    pub fn width(self, mm: f64) -> Self {
        Self {
            width: Some(mm * PIXELS_PER_MM),
            ..self
        }
    }

    /// Sets the height without a legend below the panels, mm. It has no effect on figures whose
    /// height results from equal scales or from a number of strips.
    pub fn height(self, mm: f64) -> Self {
        Self {
            height: Some(mm * PIXELS_PER_MM),
            ..self
        }
    }

    /// Sets the font size of tick labels and legends, points. Other letters, lines and margins
    /// change in proportion. The default is 12.75 points.
    pub fn font_size(self, points: f64) -> Self {
        Self {
            scale: points * PIXELS_PER_POINT / TICK_SIZE,
            ..self
        }
    }

    /// Width of a figure with a number of columns of panels, in pixels of the constants.
    fn wide(&self, columns: usize) -> f64 {
        self.width.unwrap_or(WIDTHS[usize::from(columns > 1)]) / self.scale
    }

    /// Lower edge of panels with their labels.
    fn tall(&self, wide: f64) -> f64 {
        self.height
            .map_or(ASPECT * wide, |height| height / self.scale)
    }

    /// Height of the band at the top.
    fn band(&self) -> f64 {
        TITLE_BAND[usize::from(self.title.is_empty())]
    }

    /// Draws the title and the content of a figure with a number of columns of panels, and writes
    /// the file.
    fn draw(
        &self,
        columns: usize,
        height: f64,
        content: impl FnOnce(&mut Canvas),
    ) -> io::Result<()> {
        let (wide, least) = (self.wide(columns), LEAST * columns.min(2) as f64);
        // The negated comparison rejects sizes that are not numbers.
        if !(self.scale > 0.0 && wide >= least && height >= LEAST && wide.max(height) < 1e5) {
            let [width, height, least] =
                [wide, height, least].map(|x| x * self.scale / PIXELS_PER_MM);
            let message = format!(
                "{}: a figure of {width:.0} mm by {height:.0} mm has no room for letters of {:.1} points: \
                 it needs a width of {least:.0} mm",
                self.file.display(),
                self.scale * TICK_SIZE / PIXELS_PER_POINT
            );
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        canvas::write(&self.file, [wide, height], self.scale, |canvas| {
            let label = Label {
                size: TITLE_SIZE,
                ..Label::new(wide / 2.0, self.band() / 2.0)
            };
            canvas.text(&self.title, label.fitted(&self.title, wide - 40.0));
            content(canvas);
        })
    }
}
