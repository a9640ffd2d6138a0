//! Colours that readers with a colour vision deficiency can distinguish.

use plotters::style::RGBColor;

use super::canvas::{Canvas, Label, Point};
use super::panel::{Axis, Rect};
use super::range::Range;
use super::{MERGED, TICK_SIZE};

/// Lines of frames and axes.
pub const FRAME: RGBColor = RGBColor(0x55, 0x55, 0x55);
/// Grid lines.
pub const GRID: RGBColor = RGBColor(0xE4, 0xE4, 0xE4);

/// Filled areas: darker than the grid and lighter than all lines.
pub const AREA: RGBColor = RGBColor(0xDD, 0xDD, 0xDD);

/// Dots of measured positions: darker than filled areas, and lighter than all lines.
pub const DOT: RGBColor = RGBColor(0xAA, 0xAA, 0xAA);

/// Palette of Okabe and Ito. The first colours have the strongest contrast; yellow, which is faint
/// on white, is last.
const OKABE_ITO: [RGBColor; 8] = [
    RGBColor(0x00, 0x72, 0xB2),
    RGBColor(0xD5, 0x5E, 0x00),
    RGBColor(0x00, 0x9E, 0x73),
    RGBColor(0xCC, 0x79, 0xA7),
    RGBColor(0xE6, 0x9F, 0x00),
    RGBColor(0x56, 0xB4, 0xE9),
    RGBColor(0x00, 0x00, 0x00),
    RGBColor(0xF0, 0xE4, 0x42),
];

/// Returns a colour of the categorical palette; the index is taken modulo the number of colours.
pub fn palette(index: usize) -> RGBColor {
    OKABE_ITO[index % OKABE_ITO.len()]
}

/// Returns the mean of a colour and white, for lines behind a body.
pub fn paler(RGBColor(red, green, blue): RGBColor) -> RGBColor {
    let mean = |part: u8| 255 - (255 - part) / 2;
    RGBColor(mean(red), mean(green), mean(blue))
}

/// Returns a colour of the ordered scale; `place` is between 0 and 1.
pub fn ordered(place: f64) -> RGBColor {
    step_colour((place.clamp(0.0, 1.0) * (STEPS - 1) as f64).round() as usize)
}

/// Equidistant samples of the viridis colour map.
const VIRIDIS: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 45.0, 123.0],
    [59.0, 82.0, 139.0],
    [44.0, 114.0, 142.0],
    [33.0, 144.0, 140.0],
    [39.0, 173.0, 129.0],
    [93.0, 200.0, 99.0],
    [170.0, 220.0, 50.0],
    [253.0, 231.0, 37.0],
];

/// Number of colours along a colour scale. More colours would be indistinguishable and would divide
/// lines into more pieces.
const STEPS: usize = 96;

/// Colour scale of a quantity.
#[derive(Clone)]
pub struct ColourScale {
    axis: Axis,
}

impl ColourScale {
    /// Returns a scale of time, in hours, over the finite values of `hours`.
    pub fn time(hours: impl Iterator<Item = f64>) -> Self {
        let range = Range::of(hours);
        // If there is a single time, the scale begins at zero.
        let range = match range.length() > 0.0 {
            true => range.not_empty(),
            false if range.centre() == 0.0 => Range { lo: 0.0, hi: 1.0 },
            false => Range {
                lo: range.centre().min(0.0),
                hi: range.centre().max(0.0),
            },
        };
        Self {
            axis: Axis::linear("time (h)", range),
        }
    }

    /// Returns a scale of the share of an interval.
    pub fn share_of(label: &str) -> Self {
        Self {
            axis: Axis::linear(label, Range { lo: 0.0, hi: 1.0 }),
        }
    }

    /// Returns a logarithmic scale. Values outside have the colour of the nearer end.
    pub fn logarithmic(label: &str, lo: f64, hi: f64) -> Self {
        let range = Range {
            lo: lo.log10(),
            hi: hi.log10(),
        };
        Self {
            axis: Axis {
                label: label.into(),
                range,
                log: true,
            },
        }
    }

    /// Returns the colour of a value.
    pub fn colour(&self, value: f64) -> RGBColor {
        step_colour(self.step(value))
    }

    /// Returns the place of a value on the scale, from 0 to 1 inside it.
    pub fn share(&self, value: f64) -> f64 {
        let place = if self.axis.log { value.log10() } else { value };
        (place - self.axis.range.lo) / self.axis.range.length()
    }

    fn step(&self, value: f64) -> usize {
        ((self.share(value) * STEPS as f64).max(0.0) as usize).min(STEPS - 1)
    }

    /// Draws a line coloured by a value at each point; `None` is a gap.
    pub fn line(
        &self,
        canvas: &mut Canvas,
        path: impl Iterator<Item = (f64, Option<Point>)>,
        width: f64,
    ) {
        let (mut run, mut run_step): (Vec<Point>, _) = (Vec::new(), 0);
        let mut path = path.peekable();
        while let Some((value, point)) = path.next() {
            let Some(point) = point else {
                canvas.line(&run, step_colour(run_step), width);
                run.clear();
                continue;
            };
            let step = self.step(value);
            if let Some(&last) = run.last() {
                // Points close to the last one would only enlarge the file.
                let near = (last.0 - point.0).hypot(last.1 - point.1) < MERGED;
                if near && path.peek().is_some() {
                    continue;
                }
                if step != run_step {
                    if run.len() > 1 {
                        canvas.line(&run, step_colour(run_step), width);
                    }
                    run = vec![last];
                }
            }
            run_step = step;
            run.push(point);
        }
        canvas.line(&run, step_colour(run_step), width);
    }

    /// Draws the colour bar with its lower left corner at (`left`, `bottom`).
    pub fn draw_bar(&self, canvas: &mut Canvas, left: f64, top: f64, bottom: f64) {
        let right = left + 22.0;
        let Axis {
            range, label: name, ..
        } = &self.axis;
        // On a logarithmic scale, the positions of ticks and the range are logarithms.
        let y = |place: f64| bottom - (bottom - top) * (place - range.lo) / range.length();
        for step in 0..STEPS {
            let lower = bottom - (bottom - top) * step as f64 / STEPS as f64;
            // Each area extends to the top and the next ones cover it. Adjacent areas would show
            // seams.
            let corners = [(left, lower), (right, lower), (right, top), (left, top)];
            canvas.area(&corners, step_colour(step));
        }
        canvas.line(
            &Rect {
                left,
                top,
                right,
                bottom,
            }
            .outline(),
            FRAME,
            1.0,
        );
        let ticks = self.axis.ticks(((bottom - top) / 50.0) as usize);
        let unit = ticks.axis_label(name);
        for (place, text) in ticks.labelled() {
            canvas.line(&[(right, y(place)), (right + 6.0, y(place))], FRAME, 1.0);
            canvas.text_beside(text, right + 10.0, y(place));
        }
        let widest = ticks.width(TICK_SIZE);
        let label = Label {
            upwards: true,
            ..Label::new(right + 10.0 + widest + 16.0, (top + bottom) / 2.0)
        };
        canvas.text(&unit, label.fitted(&unit, bottom - top));
    }
}

fn step_colour(step: usize) -> RGBColor {
    // The last tenth of the map is a yellow that is too faint on white.
    let place = 0.92 * step as f64 / (STEPS - 1) as f64 * (VIRIDIS.len() - 1) as f64;
    let lower = place as usize;
    let part = place - lower as f64;
    let mix = |c: usize| {
        let (a, b) = (VIRIDIS[lower][c], VIRIDIS[lower + 1][c]);
        (a + part * (b - a)).round() as u8
    };
    RGBColor(mix(0), mix(1), mix(2))
}
