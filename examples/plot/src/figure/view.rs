//! Orthographic view of a box in space with three axes.

use plotters::style::RGBColor;
use plotters::style::text_anchor::{HPos, VPos};

use super::canvas::{Canvas, Label, Point, text_width};
use super::colour::{FRAME, GRID};
use super::panel::Rect;
use super::range::Range;
use super::ticks::linear_ticks;
use super::{LABEL_SIZE, TICK_SIZE};

/// Azimuth and elevation of the viewing direction, degrees. The x axis points to the right, y into
/// the picture and z up.
const EYE_DEG: (f64, f64) = (-60.0, 24.0);

/// View of the box that three ranges span, with the same scale in all directions.
pub struct View {
    ranges: [Range; 3],
    centre: Point,
    pixels_per_unit: f64,
    right: f64,
}

impl View {
    /// Returns the largest view of the box that fits into a cell, labels included.
    pub fn new(cell: Rect, ranges: [Range; 3]) -> Self {
        let frame = Rect {
            left: cell.left + 92.0,
            top: cell.top + 34.0,
            right: cell.right - 75.0,
            bottom: cell.bottom - 62.0,
        };
        let (width, height) = extent(ranges);
        Self {
            ranges,
            centre: (
                0.5 * (frame.left + frame.right),
                0.5 * (frame.top + frame.bottom),
            ),
            pixels_per_unit: (frame.width() / width).min(frame.height() / height),
            right: cell.right,
        }
    }

    /// Returns the pixel position of a point in space, or `None` if it is outside the box.
    pub fn at(&self, p: [f64; 3]) -> Option<Point> {
        let inside = |axis: usize| {
            let Range { lo, hi } = self.ranges[axis];
            let slack = 1e-6 * (hi - lo);
            (lo - slack..=hi + slack).contains(&p[axis])
        };
        (0..3).all(inside).then(|| self.pixel(p))
    }

    /// Returns the pixel position of the vertical projection of a point onto the floor of the box.
    pub fn foot(&self, p: [f64; 3]) -> Option<Point> {
        self.at(p)
            .map(|_| self.pixel([p[0], p[1], self.ranges[2].lo]))
    }

    /// Draws the floor and the two rear walls with ticks.
    pub fn draw(&self, canvas: &mut Canvas, labels: [&str; 3]) {
        let [x, y, z] = self.ranges;
        let faces = [
            [
                [x.lo, y.lo, z.lo],
                [x.hi, y.lo, z.lo],
                [x.hi, y.hi, z.lo],
                [x.lo, y.hi, z.lo],
            ],
            [
                [x.lo, y.hi, z.lo],
                [x.hi, y.hi, z.lo],
                [x.hi, y.hi, z.hi],
                [x.lo, y.hi, z.hi],
            ],
            [
                [x.lo, y.lo, z.lo],
                [x.lo, y.hi, z.lo],
                [x.lo, y.hi, z.hi],
                [x.lo, y.lo, z.hi],
            ],
        ];
        let faces = faces.map(|face| face.map(|p| self.pixel(p)));
        for (face, shade) in faces.iter().zip([0xF4, 0xFA, 0xF7]) {
            canvas.area(face, RGBColor(shade, shade, shade));
        }
        for (axis, label) in labels.into_iter().enumerate() {
            self.draw_axis(canvas, axis, label);
        }
        for [a, b, c, d] in faces {
            canvas.line(&[a, b, c, d, a], FRAME, 1.0);
        }
    }

    fn draw_axis(&self, canvas: &mut Canvas, axis: usize, label: &str) {
        let [x, y, z] = self.ranges;
        let (from, to) = (self.ranges[axis].lo, self.ranges[axis].hi);
        // The edge with the ticks is part of the outline of the box. Grid lines extend from it over
        // two faces.
        let along = |v: f64| match axis {
            0 => [[v, y.lo, z.lo], [v, y.hi, z.lo], [v, y.hi, z.hi]],
            1 => [[x.hi, v, z.lo], [x.lo, v, z.lo], [x.lo, v, z.hi]],
            _ => [[x.lo, y.lo, v], [x.lo, y.hi, v], [x.hi, y.hi, v]],
        };
        let (a, b) = (self.pixel(along(from)[0]), self.pixel(along(to)[0]));
        let length = (b.0 - a.0).hypot(b.1 - a.1);
        let ticks = linear_ticks(self.ranges[axis], ((length / 48.0) as usize).max(1));
        // Direction of the labels from the edge, pointing away from the box.
        let (out, h, v) = match axis {
            0 => ((-0.25, 1.0), HPos::Center, VPos::Top),
            1 => ((1.0, 0.45), HPos::Left, VPos::Center),
            _ => ((-1.0, 0.0), HPos::Right, VPos::Center),
        };
        let beside = |p: Point, by: f64| (p.0 + by * out.0, p.1 + by * out.1);
        for (value, text) in ticks.labelled() {
            let path = along(value).map(|p| self.pixel(p));
            canvas.line(&path, GRID, 1.0);
            canvas.line(&[path[0], beside(path[0], 6.0)], FRAME, 1.2);
            let (lx, ly) = beside(path[0], 10.0);
            canvas.text(
                text,
                Label {
                    size: TICK_SIZE,
                    h,
                    v,
                    ..Label::new(lx, ly)
                },
            );
        }
        let text = ticks.axis_label(label);
        let middle = (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1));
        let width = ticks.width(TICK_SIZE);
        let (lx, ly) = match axis {
            0 => (middle.0 - 20.0, middle.1 + 36.0),
            1 => {
                // A label that exceeds the cell is shifted back along the edge.
                let x = middle.0 + 18.0 + width;
                let excess = x + text_width(&text, LABEL_SIZE) - self.right;
                (
                    x - excess.max(0.0),
                    middle.1 + 26.0 + 0.75 * excess.max(0.0),
                )
            }
            _ => (middle.0 - 28.0 - width, middle.1),
        };
        let label = Label {
            h: if axis == 1 { HPos::Left } else { HPos::Center },
            v: if axis == 0 { VPos::Top } else { VPos::Center },
            upwards: axis == 2,
            ..Label::new(lx, ly)
        };
        canvas.text(&text, label);
    }

    fn pixel(&self, p: [f64; 3]) -> Point {
        let relative = [0, 1, 2].map(|axis| p[axis] - self.ranges[axis].centre());
        let (right, up) = project(relative);
        (
            self.centre.0 + self.pixels_per_unit * right,
            self.centre.1 - self.pixels_per_unit * up,
        )
    }
}

/// Returns width and height of the projected box in the units of the ranges.
pub fn extent(ranges: [Range; 3]) -> (f64, f64) {
    // Two opposite corners of the box bound each component, hence the absolute values.
    let ((rx, ux), (ry, uy), (rz, uz)) = (
        project([1.0, 0.0, 0.0]),
        project([0.0, 1.0, 0.0]),
        project([0.0, 0.0, 1.0]),
    );
    let sum = |c: [f64; 3]| (0..3).map(|i| c[i].abs() * ranges[i].length()).sum();
    (sum([rx, ry, rz]), sum([ux, uy, uz]))
}

/// Returns the components of a vector along the right and up directions of the picture.
fn project(p: [f64; 3]) -> (f64, f64) {
    let (sin_a, cos_a) = EYE_DEG.0.to_radians().sin_cos();
    let (sin_e, cos_e) = EYE_DEG.1.to_radians().sin_cos();
    let right = -sin_a * p[0] + cos_a * p[1];
    let up = -sin_e * cos_a * p[0] - sin_e * sin_a * p[1] + cos_e * p[2];
    (right, up)
}
