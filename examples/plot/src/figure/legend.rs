//! The legend, and the markers and badges of series.

use super::TICK_SIZE;
use super::canvas::{Canvas, Label, Point, text_width};
use super::colour::{AREA, DOT, palette};
use super::lines::{DOT_RADIUS, Series, Style};

/// Length of a line sample.
const SAMPLE: f64 = 38.0;
/// Largest width of a line of text; longer labels are wrapped.
const TEXT: f64 = 300.0;
/// Height of a line of text.
const LINE: f64 = 23.0;

/// Least width of a column of a legend below the panels, and the margin at its left.
const COLUMN: f64 = 370.0;
const MARGIN: f64 = 60.0;

/// Space between two entries.
const GAP: f64 = 7.0;

/// Returns the series with an entry in the legend. Series with equal labels have one entry.
pub fn listed<'a>(all: &[&'a Series]) -> Vec<&'a Series> {
    let mut listed: Vec<&Series> = Vec::new();
    for one in all {
        if !one.label.is_empty() && listed.iter().all(|other| other.label != one.label) {
            listed.push(one);
        }
    }
    listed
}

/// Whether a legend is at the right of a panel. In a narrow figure it would leave no room for the
/// panel.
pub fn is_beside(listed: &[&Series], wide: f64) -> bool {
    legend_width(listed) < 0.3 * wide
}

/// Returns the columns of a legend below the panels, each with its left edge.
fn columns<'a, 'b>(
    series: &'a [&'b Series],
    wide: f64,
) -> impl Iterator<Item = (f64, &'a [&'b Series])> {
    let count = ((wide / COLUMN) as usize).max(1);
    let place = move |i: usize| MARGIN + (wide - MARGIN) / count as f64 * i as f64;
    series
        .chunks(series.len().div_ceil(count).max(1))
        .enumerate()
        .map(move |(i, column)| (place(i), column))
}

/// Returns the height of a legend below the panels.
pub fn height_below(series: &[&Series], wide: f64) -> f64 {
    columns(series, wide)
        .map(|(_, column)| legend_height(column))
        .fold(0.0, f64::max)
}

/// Draws a legend in columns below the panels.
pub fn draw_below(canvas: &mut Canvas, series: &[&Series], wide: f64, top: f64) {
    columns(series, wide).for_each(|(left, column)| draw_legend(canvas, column, left, top));
}

/// Returns the height of a legend.
fn legend_height(series: &[&Series]) -> f64 {
    series
        .iter()
        .map(|s| LINE * wrapped(&s.label).len() as f64 + GAP)
        .sum()
}

/// Returns the width of a legend, or zero if no series has a label.
pub fn legend_width(series: &[&Series]) -> f64 {
    let lines = series.iter().flat_map(|s| wrapped(&s.label));
    let widest = lines.map(|l| text_width(&l, TICK_SIZE)).fold(0.0, f64::max);
    if widest > 0.0 {
        SAMPLE + 10.0 + widest + 16.0
    } else {
        0.0
    }
}

/// Draws the legend with its upper left corner at (`left`, `top`).
pub fn draw_legend(canvas: &mut Canvas, series: &[&Series], left: f64, top: f64) {
    let mut y = top + 0.5 * LINE;
    for one in series {
        let ends = [(left, y), (left + SAMPLE, y)];
        let colour = one.paint();
        match one.style {
            Style::Line | Style::Dashed | Style::Dotted | Style::DashDot | Style::Hidden => {
                canvas.dashed(&ends, colour, one.style.width(), one.style.pattern());
            }
            Style::Marked => canvas.line(&ends, colour, 1.4),
            Style::Area => {
                let (right, above, under) = (left + SAMPLE, y - 9.0, y + 9.0);
                canvas.area(
                    &[(left, above), (right, above), (right, under), (left, under)],
                    AREA,
                );
            }
            Style::Dots => canvas.dot((left + 0.5 * SAMPLE, y), DOT_RADIUS, DOT),
            Style::Points | Style::Badge | Style::Text | Style::Beside => {}
        }
        if matches!(one.style, Style::Points | Style::Marked) {
            draw_marker(canvas, (left + 0.5 * SAMPLE, y), one);
        }
        if !one.text.is_empty() {
            draw_badge(canvas, (left + 0.5 * SAMPLE, y), &one.text, one.colour);
        }
        for line in wrapped(&one.label) {
            canvas.text_beside(&line, left + SAMPLE + 10.0, y);
            y += LINE;
        }
        y += GAP;
    }
}

/// Draws the marker of a series. Its shape depends on the colour index, for prints without colour.
pub fn draw_marker(canvas: &mut Canvas, centre: Point, series: &Series) {
    let paint = series.paint();
    // Corners of a square, a triangle or a diamond.
    let corners: &[Point] = match series.colour % 8 {
        0 => return canvas.dot(centre, 5.0, paint),
        4 => return canvas.ring(centre, 4.4, paint, 1.8),
        1 | 5 => &[(-4.4, -4.4), (4.4, -4.4), (4.4, 4.4), (-4.4, 4.4)],
        2 | 6 => &[(0.0, -6.2), (5.8, 4.2), (-5.8, 4.2)],
        _ => &[(0.0, -6.4), (6.4, 0.0), (0.0, 6.4), (-6.4, 0.0)],
    };
    let corners: Vec<Point> = corners
        .iter()
        .map(|c| (centre.0 + c.0, centre.1 + c.1))
        .collect();
    canvas.area(&corners, paint);
}

/// Draws a short text in a circle.
pub fn draw_badge(canvas: &mut Canvas, centre: Point, text: &str, colour: usize) {
    canvas.ring(centre, 9.0, palette(colour), 1.6);
    // The middle of a line of text is slightly above the middle of its digits.
    let label = Label {
        size: 0.85 * TICK_SIZE,
        ..Label::new(centre.0, centre.1 + 0.5)
    };
    canvas.text(text, label);
}

/// Wraps a label at spaces into lines that fit the legend.
fn wrapped(label: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in label.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width(&format!("{line} {word}"), TICK_SIZE) <= TEXT => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}
