//! Strips: panels one below the other with a common horizontal axis.

use std::io;

use super::Figure;
use super::canvas::Canvas;
use super::legend::{draw_legend, legend_width};
use super::lines::{Axes, Series, draw_series, fitted_axes};
use super::panel::{ABOVE, BELOW, Panel, Rect};

/// Height of the frame of a strip in pixels.
const FRAME: f64 = 190.0;
/// Distance between the frames of two strips in pixels, for the tick labels of the upper one.
const BETWEEN: f64 = 44.0;

/// One quantity as a function of the common variable.
#[derive(Clone, Copy)]
pub struct Strip<'a> {
    /// Quantity and unit.
    pub label: &'a str,
    /// Series of the strip; their labels are in a legend at the right.
    pub series: &'a [Series],
}

impl Figure {
    /// Draws strips one below the other.
    pub fn strips(&self, x_label: &str, strips: &[Strip]) -> io::Result<()> {
        let band = self.band();
        let top = band - ABOVE;
        self.draw(1, top + strips_height(strips.len()), |canvas| {
            draw_strips(canvas, self.wide(), top, x_label, strips);
        })
    }
}

/// Returns the height of `count` strips with their labels.
pub fn strips_height(count: usize) -> f64 {
    match count {
        0 => 0.0,
        _ => ABOVE + (FRAME + BETWEEN) * count as f64 - BETWEEN + BELOW + 10.0,
    }
}

/// Draws strips over the whole width, from `top` downwards.
pub fn draw_strips(canvas: &mut Canvas, wide: f64, top: f64, x_label: &str, strips: &[Strip]) {
    let all: Vec<&Series> = strips.iter().flat_map(|strip| strip.series).collect();
    let (x, _) = fitted_axes("", "", &all, Axes::Linear);
    let right = wide - legend_width(&all);
    // Series with equal labels have one entry.
    let mut entered: Vec<&str> = vec![""];
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
        let listed: Vec<&Series> = shown.into_iter().filter(|one| !entered.contains(&one.label.as_str())).collect();
        entered.extend(listed.iter().map(|one| one.label.as_str()));
        draw_legend(canvas, &listed, right, panel.frame().top);
    }
}
