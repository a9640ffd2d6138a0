//! Shapes in space with their directors, one over the other.

use std::io;
use std::path::Path;

use plotters::style::text_anchor::HPos;

use super::canvas::{Label, Point, write_svg};
use super::colour::{ColourScale, palette};
use super::panel::{ABOVE, BELOW, Rect};
use super::path::{NAMES, space_ranges};
use super::view::{View, extent};
use super::{BAR_COLUMN, MM_PER_M, TICK_SIZE, TITLE_BAND, WIDTH, draw_title};

/// Length at which a director is drawn, over the largest extent of the shapes.
const LENGTH: f64 = 0.09;

/// A centre line with directors along it.
#[derive(Clone, Debug)]
pub struct FramedShape {
    /// Time, h.
    pub hours: f64,
    /// Points of the centre line, m.
    pub line: Vec<[f64; 3]>,
    /// Places on it (m), each with two directors, which are of length 1.
    pub directors: Vec<[[f64; 3]; 3]>,
}

/// Draws shapes with their directors in panels side by side, coloured by time.
pub fn frames_figure(file: impl AsRef<Path>, title: &str, panels: &[(&str, &[FramedShape])]) -> io::Result<()> {
    let all = || panels.iter().flat_map(|(_, shapes)| shapes.iter());
    let points = all().flat_map(|shape| shape.line.iter().map(|p| p.map(|c| c * MM_PER_M)));
    let ranges = space_ranges(points).map(|range| range.padded(LENGTH));
    let director = LENGTH * ranges.iter().map(|range| range.length()).fold(0.0, f64::max);
    let time = ColourScale::time(all().map(|shape| shape.hours));
    let column = (WIDTH - BAR_COLUMN) / panels.len().max(2) as f64;
    let (width, height) = extent(ranges);
    let row = ABOVE + (column - 167.0) * height / width + BELOW;
    write_svg(file.as_ref(), WIDTH, TITLE_BAND + row + 40.0, |canvas| {
        draw_title(canvas, title);
        for (i, (name, shapes)) in panels.iter().enumerate() {
            let left = column * i as f64;
            let view =
                View::new(Rect { left, top: TITLE_BAND, right: left + column, bottom: TITLE_BAND + row }, ranges);
            view.draw(canvas, NAMES);
            canvas.text(name, Label::new(left + 0.5 * column, TITLE_BAND + 14.0));
            for shape in *shapes {
                let mm = |p: &[f64; 3]| p.map(|c| c * MM_PER_M);
                let line: Vec<(f64, Option<Point>)> =
                    shape.line.iter().map(|p| (shape.hours, view.at(mm(p)))).collect();
                time.line(canvas, &line, 2.6);
                for [place, directors @ ..] in &shape.directors {
                    let from = mm(place);
                    for (d, colour) in directors.iter().zip([0, 1]) {
                        let to = [0, 1, 2].map(|axis| from[axis] + director * d[axis]);
                        if let (Some(from), Some(to)) = (view.at(from), view.at(to)) {
                            canvas.line(&[from, to], palette(colour), 1.6);
                        }
                    }
                }
            }
        }
        time.draw_bar(canvas, WIDTH - BAR_COLUMN + 12.0, TITLE_BAND + ABOVE, TITLE_BAND + row - BELOW);
        let y = TITLE_BAND + row + 14.0;
        for (name, colour, x) in [("director d1", 0, 92.0), ("director d2", 1, 272.0)] {
            canvas.line(&[(x, y), (x + 34.0, y)], palette(colour), 2.4);
            canvas.text(name, Label { size: TICK_SIZE, h: HPos::Left, ..Label::new(x + 44.0, y) });
        }
    })
}
