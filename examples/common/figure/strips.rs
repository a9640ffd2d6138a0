//! Quantities one under the other, over the same axis.

use std::io;
use std::path::Path;

use super::canvas::{Canvas, write_svg};
use super::legend::{draw_legend, legend_width};
use super::lines::{Axes, Series, draw_series, fitted_axes};
use super::panel::{ABOVE, BELOW, Panel, Rect};
use super::{TITLE_BAND, WIDTH, draw_title};

/// Height of the frame of a strip.
const FRAME: f64 = 190.0;
/// Between the frames of two strips: the upper one's tick labels.
const BETWEEN: f64 = 44.0;

/// One quantity over the common axis.
#[derive(Clone, Copy)]
pub struct Strip<'a> {
    /// Quantity and unit.
    pub label: &'a str,
    /// What is shown; labels stand in a legend at the right.
    pub series: &'a [Series],
}

/// Draws strips one under the other over one axis.
pub fn strips_figure(file: impl AsRef<Path>, title: &str, x_label: &str, strips: &[Strip]) -> io::Result<()> {
    let top = TITLE_BAND - ABOVE;
    write_svg(file.as_ref(), WIDTH, top + strips_height(strips.len()), |canvas| {
        draw_title(canvas, title);
        draw_strips(canvas, top, x_label, strips);
    })
}

/// Height of so many strips with their labels.
pub fn strips_height(count: usize) -> f64 {
    match count {
        0 => 0.0,
        _ => ABOVE + (FRAME + BETWEEN) * count as f64 - BETWEEN + BELOW + 10.0,
    }
}

/// Draws strips over the whole width, from `top` downwards.
pub fn draw_strips(canvas: &mut Canvas, top: f64, x_label: &str, strips: &[Strip]) {
    let all: Vec<&Series> = strips.iter().flat_map(|strip| strip.series).collect();
    let (x, _) = fitted_axes("", "", &all, Axes::Linear);
    let right = WIDTH - legend_width(&all);
    // What several strips show has one entry.
    let mut told: Vec<&str> = vec![""];
    for (i, strip) in strips.iter().enumerate() {
        let shown: Vec<&Series> = strip.series.iter().collect();
        let (_, y) = fitted_axes("", strip.label, &shown, Axes::Linear);
        let mut x = x.clone();
        if i + 1 == strips.len() {
            x.label = x_label.into();
        }
        let top = top + (FRAME + BETWEEN) * i as f64;
        let panel = Panel::new(Rect { left: 0.0, top, right, bottom: top + ABOVE + FRAME + BELOW }, x, y, false);
        panel.draw(canvas, "");
        shown.iter().for_each(|one| draw_series(canvas, &panel, one));
        let listed: Vec<&Series> = shown.into_iter().filter(|one| !told.contains(&one.label.as_str())).collect();
        told.extend(listed.iter().map(|one| one.label.as_str()));
        draw_legend(canvas, &listed, right, panel.frame().top);
    }
}
