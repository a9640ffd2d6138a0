//! Centre lines in space with their directors, superposed, and the track of the tip.

use std::io;

use morphorod::nalgebra::Vector3;
use morphorod::rod::Rod;
use plotters::style::RGBColor;

use super::canvas::{Label, Point};
use super::colour::{ColourScale, palette};
use super::lines::Style;
use super::panel::{ABOVE, BELOW, Rect};
use super::path::{NAMES, space_ranges};
use super::view::{View, extent};
use super::{BAR_COLUMN, Figure, MM_PER_M};

/// Number of points of the centre line of a shape.
const LINE: usize = 41;
/// Number of shapes in a period.
const SHAPES: usize = 8;
/// Length of a director in the figure, relative to the largest extent of the shapes.
const LENGTH: f64 = 0.11;
/// Lines of the directors d1 and d2.
const DIRECTORS: [Style; 2] = [Style::Line, Style::Dotted];
/// Colours of the tip track and of its projection onto the floor.
const TRACK: [RGBColor; 2] = [RGBColor(0x77, 0x77, 0x77), RGBColor(0xCC, 0xCC, 0xCC)];

/// Centre line with directors.
#[derive(Clone, Debug)]
pub struct FramedShape {
    /// Time, h.
    pub hours: f64,
    /// Points of the centre line, m.
    pub line: Vec<[f64; 3]>,
    /// Positions on the centre line (m), each with the unit directors d1 and d2.
    pub directors: Vec<[[f64; 3]; 3]>,
}

impl FramedShape {
    /// Returns the shape of a rod at a time (h), with the directors at base and tip.
    pub fn of(rod: &Rod, hours: f64) -> Self {
        let places = [0.0, rod.length()].into_iter().filter_map(|s| rod.at(s));
        let directors = places
            .map(|(place, frame)| {
                [place, frame * Vector3::x(), frame * Vector3::y()].map(Into::into)
            })
            .collect();
        Self {
            hours,
            line: rod
                .centre_line_at(LINE)
                .into_iter()
                .map(Into::into)
                .collect(),
            directors,
        }
    }
}

/// One panel of [`Figure::frames`](super::Figure::frames).
pub struct FramedPanel<'a> {
    /// Title of the panel.
    pub name: &'a str,
    /// Shapes of the shoot.
    pub shapes: Vec<FramedShape>,
    /// Positions of the tip, m.
    pub track: Vec<[f64; 3]>,
}

impl<'a> FramedPanel<'a> {
    /// Returns eight shapes of a period (h) that ends at `end` (h), and the tip track in it.
    ///
    /// `record` contains shapes in the order of time. The times of the panel are relative to the
    /// beginning of the period, so that equal phases have equal colours. A period that begins
    /// before zero is cut there.
    pub fn of_period(name: &'a str, record: &[FramedShape], end: f64, period: f64) -> Self {
        let at = |k: usize| end - period * (SHAPES - k) as f64 / SHAPES as f64;
        let nearest = |hours: f64| {
            let distance = |shape: &&FramedShape| (shape.hours - hours).abs();
            record
                .iter()
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        };
        let begin = at(0).max(0.0);
        let shapes = (1..=SHAPES).filter_map(|k| nearest(at(k).max(0.0)));
        // The track begins one sample earlier, so that the orbit is closed.
        let first = record
            .iter()
            .rposition(|shape| shape.hours <= begin)
            .unwrap_or(0);
        let inside = record[first..].iter().filter(|shape| shape.hours <= end);
        Self {
            name,
            shapes: shapes
                .map(|shape| FramedShape {
                    hours: shape.hours - begin,
                    ..shape.clone()
                })
                .collect(),
            track: inside
                .filter_map(|shape| shape.line.last().copied())
                .collect(),
        }
    }
}

impl Figure {
    /// Draws shapes with their directors, coloured by time, and tip tracks. The panels are side by
    /// side.
    pub fn frames(&self, panels: &[FramedPanel]) -> io::Result<()> {
        let (wide, band) = (self.wide(2), self.band());
        let all = || panels.iter().flat_map(|panel| panel.shapes.iter());
        let mm = |p: &[f64; 3]| p.map(|c| c * MM_PER_M);
        let points = all().flat_map(|shape| shape.line.iter().map(mm));
        let ranges = space_ranges(points).map(|range| range.padded(LENGTH));
        let director = LENGTH
            * ranges
                .iter()
                .map(|range| range.length())
                .fold(0.0, f64::max);
        let time = ColourScale::time(all().map(|shape| shape.hours));
        let column = (wide - BAR_COLUMN) / panels.len().max(2) as f64;
        let (width, height) = extent(ranges);
        let row = ABOVE + (column - 167.0) * height / width + BELOW;
        self.draw(2, band + row + 40.0, |canvas| {
            for (
                i,
                FramedPanel {
                    name,
                    shapes,
                    track,
                },
            ) in panels.iter().enumerate()
            {
                let left = column * i as f64;
                let view = View::new(
                    Rect {
                        left,
                        top: band,
                        right: left + column,
                        bottom: band + row,
                    },
                    ranges,
                );
                view.draw(canvas, NAMES);
                canvas.text(name, Label::new(left + 0.5 * column, band + 14.0));
                let projection: Vec<Point> =
                    track.iter().filter_map(|p| view.foot(mm(p))).collect();
                canvas.line(&projection, TRACK[1], 1.6);
                let tip: Vec<Point> = track.iter().filter_map(|p| view.at(mm(p))).collect();
                canvas.line(&tip, TRACK[0], 1.6);
                for shape in shapes {
                    time.line(
                        canvas,
                        shape.line.iter().map(|p| (shape.hours, view.at(mm(p)))),
                        2.6,
                    );
                    for [position, directors @ ..] in &shape.directors {
                        let from = mm(position);
                        for (d, colour) in directors.iter().zip([0, 1]) {
                            let to = [0, 1, 2].map(|axis| from[axis] + director * d[axis]);
                            if let (Some(from), Some(to)) = (view.at(from), view.at(to)) {
                                canvas.dashed(
                                    &[from, to],
                                    palette(colour),
                                    2.2,
                                    DIRECTORS[colour].pattern(),
                                );
                            }
                        }
                    }
                }
            }
            time.draw_bar(
                canvas,
                wide - BAR_COLUMN + 12.0,
                band + ABOVE,
                band + row - BELOW,
            );
            let y = band + row + 14.0;
            let projection = "its projection onto the floor";
            let samples = [
                ("director d1", palette(0), DIRECTORS[0]),
                ("director d2", palette(1), DIRECTORS[1]),
                ("tip track", TRACK[0], Style::Line),
                (projection, TRACK[1], Style::Line),
            ];
            for (i, (name, colour, style)) in samples.into_iter().enumerate() {
                let x = 92.0 + 190.0 * i as f64;
                canvas.dashed(&[(x, y), (x + 34.0, y)], colour, 2.4, style.pattern());
                canvas.text_beside(name, x + 44.0, y);
            }
        })
    }
}
