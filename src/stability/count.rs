//! How many roots lie right of a line: the argument principle.

use nalgebra::Complex;

use super::characteristic::{Part, Sample};
use super::short_waves::BLURRED;
use super::{Linearisation, StabilityError};

/// The number of unstable roots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unstable {
    /// So many roots have a positive real part, each counted as often as it occurs.
    Finite(usize),
    /// The essential spectrum lies right of the axis, up to this real part (1/s): infinitely many roots, on any mesh as
    /// many as the mesh has points.
    Infinite {
        /// Largest real part of the essential spectrum, 1/s.
        abscissa: f64,
    },
}

/// Halvings of a panel after which a root is taken to lie on the line.
const DEPTH: usize = 45;
/// Longest panel against the distance of the nearest root, by its ends and middle.
const CLEAR: f64 = 2.0;

impl Linearisation {
    /// The number of roots with Re λ > `abscissa`.
    ///
    /// # Errors
    /// A root on the line, which cannot be counted.
    pub(super) fn count(&self, part: Part, abscissa: f64) -> Result<usize, StabilityError> {
        let radius = self.bound(abscissa);
        let mut coarsest = 0.0_f64;
        let mut f = |w: f64| {
            let z = Complex::new(abscissa, w);
            let transfers = self.transfers_at(z);
            let sample = self.characteristic_from(z, &transfers, part);
            coarsest = coarsest.max(self.blur(z, &transfers, &sample, part));
            sample
        };
        // From the real axis up to where no root is: the other half mirrors it, the arc far right contributes nothing
        // because f is real at its right end and within 1 of 1 beyond the bound. Octave by octave from what the line's
        // distance from zero resolves, since without proprioception everything piles up there.
        let top = 8.0 * radius;
        let slow = self.slowest_rate();
        let octaves = (top / (0.25 * abscissa.abs()).clamp(1e-12 * slow, 0.1 * slow)).log2().ceil() as i32;
        let mut turn = 0.0;
        let (mut w, mut value) = (0.0, f(0.0));
        for octave in (0..=octaves).rev() {
            let next = top * 0.5_f64.powi(octave);
            let next_value = f(next);
            let change = argument(&mut f, (w, value), (next, next_value), 0);
            turn += match change {
                Some(change) => change,
                None if coarsest >= BLURRED => return Err(StabilityError::Coarse { blur: coarsest }),
                None => {
                    let residual = next_value.value.norm().min(value.value.norm());
                    let what = "count of roots (one lies on the line)";
                    return Err(StabilityError::NoConvergence { what, residual });
                }
            };
            (w, value) = (next, next_value);
        }
        // What is left of the argument from `top` to infinity, where f = 1.
        turn -= value.value.arg();
        if !(coarsest < BLURRED) {
            return Err(StabilityError::Coarse { blur: coarsest });
        }
        let count = -turn / std::f64::consts::PI;
        let nearest = count.round();
        if (count - nearest).abs() > 0.05 || nearest < 0.0 || !count.is_finite() {
            return Err(StabilityError::NoConvergence { what: "count of roots", residual: count - nearest });
        }
        Ok(nearest as usize)
    }

    /// The number of roots in a rectangle; none if one lies on its sides.
    pub(super) fn count_within(&self, part: Part, low: Complex<f64>, high: Complex<f64>) -> Option<usize> {
        let corners = [low, Complex::new(high.re, low.im), high, Complex::new(low.re, high.im)];
        let mut turn = 0.0;
        for (i, &corner) in corners.iter().enumerate() {
            let side = corners[(i + 1) % 4] - corner;
            let mut f = |t: f64| {
                let at = self.characteristic(corner + side * t, part);
                Sample { log_slope: at.log_slope * side, nearness: at.nearness * side.norm(), ..at }
            };
            let ends = [f(0.0), f(1.0)];
            turn += argument(&mut f, (0.0, ends[0]), (1.0, ends[1]), 0)?;
        }
        let count = turn / std::f64::consts::TAU;
        let nearest = count.round();
        ((count - nearest).abs() < 0.05 && nearest >= 0.0).then_some(nearest as usize)
    }

    /// The number of roots with a positive real part, none missed, or that it is infinite.
    ///
    /// Roots within a millionth of the slowest rate of the axis are not told from it.
    ///
    /// # Errors
    /// A root on the line, or a mesh that does not resolve the waves that matter.
    pub fn unstable(&self) -> Result<Unstable, StabilityError> {
        let line = self.threshold();
        for block in 0..self.local_blocks.len() {
            if self.count(Part::Essential(block), line)? > 0 {
                let abscissa = self.essential()?.first().map_or(0.0, |z| z.re);
                return Ok(Unstable::Infinite { abscissa });
            }
        }
        let mut sum = 0;
        for (block, twins) in self.distinct_blocks() {
            sum += twins * self.count(Part::Block(block), line)?;
        }
        Ok(Unstable::Finite(sum))
    }

    /// How far right of the axis a root must lie to count as unstable, 1/s.
    pub(super) fn threshold(&self) -> f64 {
        1e-6 * self.slowest_rate()
    }
}

/// The change of the argument of `f` between two points, by halving until it is small and sure.
fn argument(
    f: &mut impl FnMut(f64) -> Sample,
    (a, fa): (f64, Sample),
    (b, fb): (f64, Sample),
    depth: usize,
) -> Option<f64> {
    let middle = 0.5 * (a + b);
    let fm = f(middle);
    let (left, right) = ((fm.value / fa.value).arg(), (fb.value / fm.value).arg());
    if !(left.is_finite() && right.is_finite()) {
        return None;
    }
    // |f'/f| is about the inverse distance of the nearest root. Two roots that are close to the line and to each other turn
    // the argument by 2π between samples that differ by nothing, and the derivative of the argument does not show it: hence
    // the panel must also be short against that distance.
    let steepest = [fa, fm, fb].map(|at| at.log_slope.norm().max(at.nearness)).into_iter().fold(0.0, f64::max);
    if left.abs() < 0.5 && right.abs() < 0.5 && (left - right).abs() < 0.25 && (b - a) * steepest < CLEAR {
        return Some(left + right);
    }
    if depth == DEPTH {
        return None;
    }
    Some(argument(f, (a, fa), (middle, fm), depth + 1)? + argument(f, (middle, fm), (b, fb), depth + 1)?)
}
