//! Strips: panels one below the other with a common horizontal axis.

use std::io;

use super::Figure;
use super::canvas::Canvas;
use super::legend::{draw_below, draw_legend, height_below, is_beside, legend_width, listed};
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
    /// Series of the strip; their labels are in a legend at the right, or below all strips if it is
    /// wide.
    pub series: &'a [Series],
}

impl Figure {
    /// Draws strips one below the other.
    pub fn strips(&self, x_label: &str, strips: &[Strip]) -> io::Result<()> {
        let band = self.band();
        let (wide, top) = (self.wide(1), band - ABOVE);
        self.draw(1, top + strips_height(strips, wide), |canvas| {
            draw_strips(canvas, wide, top, x_label, strips);
        })
    }
}

/// Returns the height of strips with their labels and legend.
pub fn strips_height(strips: &[Strip], wide: f64) -> f64 {
    let listed = entries(strips);
    let below = if is_beside(&listed, wide) {
        0.0
    } else {
        height_below(&listed, wide)
    };
    if strips.is_empty() {
        0.0
    } else {
        frames_height(strips) + below + 10.0
    }
}

/// Returns the height of strips with their labels.
fn frames_height(strips: &[Strip]) -> f64 {
    ABOVE + (FRAME + BETWEEN) * strips.len() as f64 - BETWEEN + BELOW
}

/// Returns the entries of the legend.
fn entries<'a>(strips: &[Strip<'a>]) -> Vec<&'a Series> {
    listed(
        &strips
            .iter()
            .flat_map(|strip| strip.series)
            .collect::<Vec<_>>(),
    )
}

/// Draws strips over the whole width, from `top` downwards.
pub fn draw_strips(canvas: &mut Canvas, wide: f64, top: f64, x_label: &str, strips: &[Strip]) {
    let all: Vec<&Series> = strips.iter().flat_map(|strip| strip.series).collect();
    let (x, _) = fitted_axes("", "", &all, Axes::Linear);
    let mut listed = entries(strips);
    let beside = is_beside(&listed, wide);
    let right = if beside {
        wide - legend_width(&listed)
    } else {
        wide
    };
    for (i, strip) in strips.iter().enumerate() {
        let shown: Vec<&Series> = strip.series.iter().collect();
        let (_, y) = fitted_axes("", strip.label, &shown, Axes::Linear);
        let mut x = x.clone();
        if i + 1 == strips.len() {
            x.label = x_label.into();
        }
        let top = top + (FRAME + BETWEEN) * i as f64;
        let panel = Panel::new(
            Rect {
                left: 0.0,
                top,
                right,
                bottom: top + ABOVE + FRAME + BELOW,
            },
            x,
            y,
            false,
        );
        panel.draw(canvas, "");
        shown
            .iter()
            .for_each(|one| draw_series(canvas, &panel, one));
        if beside {
            // Each entry is next to the first strip with such a series.
            let here = |one: &&Series| strip.series.iter().any(|other| other.label == one.label);
            let (own, rest): (Vec<&Series>, _) = listed.into_iter().partition(here);
            draw_legend(canvas, &own, right, panel.frame().top);
            listed = rest;
        }
    }
    if !beside {
        draw_below(canvas, &listed, wide, top + frames_height(strips));
    }
}
