//! Curves in one panel, coloured by time: profiles along the shoot, and phase portraits.

use std::io;

use super::colour::ColourScale;
use super::panel::{ABOVE, Axis, Panel, Rect};
use super::range::Range;
use super::{BAR_COLUMN, Figure, MM_PER_M, S_PER_H};

impl Figure {
    /// Draws a quantity along the shoot at several times.
    ///
    /// Each profile consists of a time (s) and of pairs of an arc length (m) and a value; `label`
    /// has the quantity and its unit. Values that are not finite are gaps.
    pub fn profiles(&self, label: &str, profiles: &[(f64, Vec<(f64, f64)>)]) -> io::Result<()> {
        let curve = |(time, places): &(f64, Vec<(f64, f64)>)| -> Vec<[f64; 3]> {
            places
                .iter()
                .map(|(s, value)| [*time, MM_PER_M * s, *value])
                .collect()
        };
        self.coloured(
            ["arc length (mm)", label],
            &profiles.iter().map(curve).collect::<Vec<_>>(),
        )
    }

    /// Draws a phase portrait: one quantity against another one, coloured by time.
    ///
    /// Each state consists of a time (s) and two values; `labels` have their quantities and units.
    pub fn phase(&self, labels: [&str; 2], states: &[(f64, f64, f64)]) -> io::Result<()> {
        self.coloured(
            labels,
            &[states.iter().map(|(time, x, y)| [*time, *x, *y]).collect()],
        )
    }

    /// Draws curves, whose points have a time (s) and two coordinates.
    fn coloured(&self, labels: [&str; 2], curves: &[Vec<[f64; 3]>]) -> io::Result<()> {
        let range = |k: usize| {
            Range::of(curves.iter().flatten().map(move |point| point[k]))
                .not_empty()
                .padded(0.04)
        };
        let wide = self.wide(1);
        let bottom = self.tall(wide);
        let cell = Rect {
            left: 0.0,
            top: self.band() - ABOVE,
            right: wide - BAR_COLUMN,
            bottom,
        };
        let panel = Panel::new(
            cell,
            Axis::linear(labels[0], range(1)),
            Axis::linear(labels[1], range(2)),
            false,
        );
        let time = ColourScale::time(curves.iter().flatten().map(|point| point[0] / S_PER_H));
        self.draw(1, bottom + 10.0, |canvas| {
            panel.draw(canvas, "");
            for curve in curves {
                let at = |[t, x, y]: &[f64; 3]| {
                    (t / S_PER_H, panel.at(*x, *y).filter(|_| t.is_finite()))
                };
                time.line(canvas, curve.iter().map(at), 2.4);
            }
            let frame = panel.frame();
            time.draw_bar(canvas, frame.right + 38.0, frame.top, frame.bottom);
        })
    }
}
