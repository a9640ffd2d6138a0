//! A rectangular panel with two axes.

use plotters::style::text_anchor::{HPos, VPos};

use super::canvas::{Canvas, Label, Point};
use super::colour::{FRAME, GRID};
use super::range::Range;
use super::ticks::{Ticks, linear_ticks, linear_ticks_across, log_subticks, log_ticks};
use super::{LABEL_SIZE, TICK_SIZE};

/// Space above the frame of a panel, for its title.
pub const ABOVE: f64 = 34.0;
/// Space below the frame of a panel, for tick labels and axis label.
pub const BELOW: f64 = 66.0;
/// Space to the right of the frame, for half of the last tick label.
pub const RIGHT: f64 = 26.0;
/// Smallest space to the left of the frame. A common value aligns panels in a column.
pub const LEFT: f64 = 92.0;

/// Rectangle in pixels; y points down.
#[derive(Clone, Copy)]
pub struct Rect {
    /// Left edge.
    pub left: f64,
    /// Upper edge.
    pub top: f64,
    /// Right edge.
    pub right: f64,
    /// Lower edge.
    pub bottom: f64,
}

impl Rect {
    /// Width in pixels.
    pub fn width(&self) -> f64 {
        self.right - self.left
    }

    /// Height in pixels.
    pub fn height(&self) -> f64 {
        self.bottom - self.top
    }

    /// The corners clockwise from the upper left one, which is repeated at the end.
    pub fn outline(&self) -> [Point; 5] {
        let Self {
            left,
            top,
            right,
            bottom,
        } = *self;
        [
            (left, top),
            (right, top),
            (right, bottom),
            (left, bottom),
            (left, top),
        ]
    }
}

/// An axis of a panel.
#[derive(Clone)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// Visible range; logarithms to base ten if the axis is logarithmic.
    pub range: Range,
    /// Whether the axis is logarithmic.
    pub log: bool,
}

impl Axis {
    /// Returns a linear axis.
    pub fn linear(label: &str, range: Range) -> Self {
        Self {
            label: label.into(),
            range,
            log: false,
        }
    }

    /// Returns about `count` ticks.
    pub fn ticks(&self, count: usize) -> Ticks {
        if self.log {
            log_ticks(self.range, count)
        } else {
            linear_ticks(self.range, count)
        }
    }

    /// Ticks of a vertical axis.
    fn ticks_upwards(&self, pixels: f64) -> Ticks {
        self.ticks(((pixels / 42.0) as usize).max(2))
    }

    /// Ticks of a horizontal axis.
    fn ticks_across(&self, pixels: f64) -> Ticks {
        match self.log {
            true => log_ticks(self.range, ((pixels / 60.0) as usize).max(2)),
            false => linear_ticks_across(self.range, pixels, TICK_SIZE),
        }
    }

    fn subticks(&self) -> Vec<f64> {
        if self.log {
            log_subticks(self.range)
        } else {
            Vec::new()
        }
    }
}

/// Frame and axes of a panel.
pub struct Panel {
    frame: Rect,
    x: Axis,
    y: Axis,
}

impl Panel {
    /// Returns a panel that fills a cell, labels included. With `equal`, one range is extended
    /// until both axes have the same scale.
    pub fn new(cell: Rect, mut x: Axis, mut y: Axis, equal: bool) -> Self {
        let mut frame = Rect {
            left: cell.left + LEFT,
            top: cell.top + ABOVE,
            right: cell.right - RIGHT,
            bottom: cell.bottom - BELOW,
        };
        let (x_data, y_data) = (x.range, y.range);
        // The margin depends on the width of the tick labels, and the labels depend on the margin
        // through the range. Two iterations suffice.
        for _ in 0..2 {
            if equal {
                let (width, height) = (frame.width(), frame.height());
                let per_pixel = (x_data.length() / width).max(y_data.length() / height);
                x.range = x_data.at_least(per_pixel * width);
                y.range = y_data.at_least(per_pixel * height);
            }
            let labels = y.ticks_upwards(frame.height()).width(TICK_SIZE);
            frame.left = (cell.left + labels + 48.0).max(frame.left);
        }
        Self { frame, x, y }
    }

    /// Returns the pixel position of a pair of values, or `None` if it is outside the frame.
    pub fn at(&self, x: f64, y: f64) -> Option<Point> {
        let x = if self.x.log { x.log10() } else { x };
        let y = if self.y.log { y.log10() } else { y };
        let (px, py) = (self.pixel_x(x), self.pixel_y(y));
        let shown = px.is_finite()
            && py.is_finite()
            && (self.frame.left - 1.0..=self.frame.right + 1.0).contains(&px)
            && (self.frame.top - 1.0..=self.frame.bottom + 1.0).contains(&py);
        shown.then_some((px, py))
    }

    /// Draws the grid, the frame, ticks, labels, and the title above the frame.
    pub fn draw(&self, canvas: &mut Canvas, title: &str) {
        let Rect {
            left,
            top,
            right,
            bottom,
        } = self.frame;
        let x_ticks = self.x.ticks_across(self.frame.width());
        let y_ticks = self.y.ticks_upwards(self.frame.height());
        for x in x_ticks.values.iter().map(|v| self.pixel_x(*v)) {
            canvas.line(&[(x, top), (x, bottom)], GRID, 1.0);
        }
        for y in y_ticks.values.iter().map(|v| self.pixel_y(*v)) {
            canvas.line(&[(left, y), (right, y)], GRID, 1.0);
        }
        for x in self.x.subticks().into_iter().map(|v| self.pixel_x(v)) {
            canvas.line(&[(x, bottom - 4.0), (x, bottom)], FRAME, 1.0);
        }
        for y in self.y.subticks().into_iter().map(|v| self.pixel_y(v)) {
            canvas.line(&[(left, y), (left + 4.0, y)], FRAME, 1.0);
        }
        self.draw_frame(canvas);
        for (v, text) in x_ticks.labelled() {
            let x = self.pixel_x(v);
            canvas.line(&[(x, bottom), (x, bottom + 6.0)], FRAME, 1.2);
            canvas.text(
                text,
                Label {
                    size: TICK_SIZE,
                    v: VPos::Top,
                    ..Label::new(x, bottom + 10.0)
                },
            );
        }
        for (v, text) in y_ticks.labelled() {
            let y = self.pixel_y(v);
            canvas.line(&[(left - 6.0, y), (left, y)], FRAME, 1.2);
            canvas.text(
                text,
                Label {
                    size: TICK_SIZE,
                    h: HPos::Right,
                    ..Label::new(left - 10.0, y)
                },
            );
        }
        let (x_label, y_label) = (
            x_ticks.axis_label(&self.x.label),
            y_ticks.axis_label(&self.y.label),
        );
        let (x_mid, y_mid) = (0.5 * (left + right), 0.5 * (top + bottom));
        let below = Label {
            v: VPos::Top,
            ..Label::new(x_mid, bottom + 36.0)
        };
        canvas.text(&x_label, below.fitted(&x_label, self.frame.width() + LEFT));
        let beside = Label {
            upwards: true,
            ..Label::new(left - 28.0 - y_ticks.width(TICK_SIZE), y_mid)
        };
        canvas.text(
            &y_label,
            beside.fitted(&y_label, self.frame.height() + BELOW),
        );
        let above = Label {
            size: LABEL_SIZE,
            v: VPos::Bottom,
            ..Label::new(x_mid, top - 4.0)
        };
        canvas.text(title, above.fitted(title, self.frame.width() + LEFT));
    }

    /// Draws the frame. Maps call this again because their cells cover it.
    pub fn draw_frame(&self, canvas: &mut Canvas) {
        canvas.line(&self.frame.outline(), FRAME, 1.2);
    }

    /// Returns the frame of the panel.
    pub fn frame(&self) -> Rect {
        self.frame
    }

    fn pixel_x(&self, x: f64) -> f64 {
        let Range { lo, hi } = self.x.range;
        self.frame.left + self.frame.width() * (x - lo) / (hi - lo)
    }

    fn pixel_y(&self, y: f64) -> f64 {
        let Range { lo, hi } = self.y.range;
        self.frame.bottom - self.frame.height() * (y - lo) / (hi - lo)
    }
}
