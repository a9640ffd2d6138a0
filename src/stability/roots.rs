//! The characteristic roots: found by Newton's method, checked by counting.

use nalgebra::Complex;

use super::characteristic::Part;
use super::modes::Root;
use super::{Linearisation, StabilityError};
use crate::error::ParameterError;

/// How many roots a root with Im λ ≥ 0 stands for: two with its conjugate.
pub(super) fn pair(z: &Complex<f64>) -> usize {
    if z.im > 1e-9 * z.norm() { 2 } else { 1 }
}

/// A pole further from a root than this share of it has nothing to do with it.
const NEIGHBOUR: f64 = 0.3;
/// Points on a line from which Newton's method may start.
const GRID: usize = 48;

impl Linearisation {
    /// −f/f', the step of Newton's method for the characteristic function of a part.
    pub(super) fn newton_step(&self, z: Complex<f64>, part: Part) -> Complex<f64> {
        let slope = self.characteristic(z, part).log_slope;
        // At a root to the last digit: a pivot is zero.
        if slope.re.is_infinite() { Complex::ZERO } else { -Complex::<f64>::ONE / slope }
    }

    /// Newton's method for a root near `start`.
    pub(super) fn polish(&self, start: Complex<f64>, part: Part) -> Result<Complex<f64>, StabilityError> {
        let mut z = start;
        let mut last = f64::INFINITY;
        let scale = self.slowest_rate() * 1e-3;
        for _ in 0..60 {
            let step = self.newton_step(z, part);
            z += step;
            let size = step.norm();
            if !size.is_finite() {
                break;
            }
            // Rounding of the determinant's quotient; beyond it steps no longer shrink.
            if size <= 1e-13 * z.norm().max(scale) || (size < 1e-9 * z.norm().max(scale) && size >= last) {
                return Ok(z);
            }
            last = size;
        }
        Err(StabilityError::NoConvergence { what: "characteristic root", residual: last })
    }

    /// All roots of a part with Re λ > `abscissa` and Im λ ≥ 0, rightmost first.
    ///
    /// Newton's method is started where its step is shortest along lines in the region; whether that has found them all is
    /// told by counting. If not, the lines are drawn more densely.
    pub(super) fn roots_right_of(&self, part: Part, abscissa: f64) -> Result<Vec<Complex<f64>>, StabilityError> {
        let count = self.count(part, abscissa)?;
        let mut found: Vec<Complex<f64>> = Vec::new();
        let mut pairs = 0;
        let top = self.bound(abscissa);
        for refinement in 0..2 {
            if pairs >= count {
                break;
            }
            let lines = 1 + 2 * refinement;
            for line in 0..lines {
                let re = abscissa + (top - abscissa) * (line as f64 / lines as f64).powi(2);
                for z in self.near_line(part, re, GRID << refinement) {
                    if z.re > abscissa && !found.iter().any(|other| (other - z).norm() < 1e-8 * z.norm()) {
                        found.push(z);
                    }
                }
            }
            pairs = found.iter().map(pair).sum();
        }
        if pairs != count {
            // By halving the region, which misses none.
            let corner = Complex::new(abscissa, -0.01 * top);
            let mut all = Vec::new();
            self.isolate(part, corner, Complex::new(top, top), None, 0, &mut all)?;
            found.clear();
            for z in all {
                let z = Complex::new(z.re, z.im.abs());
                if !found.iter().any(|other| (other - z).norm() < 1e-8 * z.norm()) {
                    found.push(z);
                }
            }
            pairs = found.iter().map(pair).sum();
        }
        if pairs != count {
            let residual = count as f64 - pairs as f64;
            return Err(StabilityError::NoConvergence {
                what: "search for all roots (some are multiple or too close)",
                residual,
            });
        }
        found.sort_by(|a, b| b.re.total_cmp(&a.re));
        Ok(found)
    }

    /// Finds the roots in a rectangle: halves it until each part holds one, from where Newton's method finds it.
    fn isolate(
        &self,
        part: Part,
        low: Complex<f64>,
        high: Complex<f64>,
        known: Option<usize>,
        depth: usize,
        out: &mut Vec<Complex<f64>>,
    ) -> Result<(), StabilityError> {
        let error =
            StabilityError::NoConvergence { what: "search for all roots (some are multiple)", residual: low.re };
        let Some(number) = known.or_else(|| self.count_within(part, low, high)) else { return Err(error) };
        if number == 0 {
            return Ok(());
        }
        let inside = |z: Complex<f64>| z.re > low.re && z.re < high.re && z.im > low.im && z.im < high.im;
        if number == 1
            && let Ok(z) = self.polish(0.5 * (low + high), part)
            && inside(z)
        {
            out.push(z);
            return Ok(());
        }
        if depth == 60 {
            return Err(error);
        }
        let size = high - low;
        // Off the middle, and elsewhere if a root lies on the cut.
        for share in [0.47, 0.61, 0.35] {
            let (first_high, second_low) = if size.re > size.im {
                let cut = low.re + share * size.re;
                (Complex::new(cut, high.im), Complex::new(cut, low.im))
            } else {
                let cut = low.im + share * size.im;
                (Complex::new(high.re, cut), Complex::new(low.re, cut))
            };
            let Some(first) = self.count_within(part, low, first_high) else { continue };
            if first > number {
                continue;
            }
            self.isolate(part, low, first_high, Some(first), depth + 1, out)?;
            return self.isolate(part, second_low, high, Some(number - first), depth + 1, out);
        }
        Err(error)
    }

    /// Roots that Newton's method finds from a line, with Im λ ≥ 0; each may occur more than once.
    fn near_line(&self, part: Part, re: f64, points: usize) -> Vec<Complex<f64>> {
        let top = self.bound(re);
        let at = |i: usize| Complex::new(re, top * (i as f64 / points as f64).powi(2));
        let steps: Vec<f64> = (0..=points).map(|i| self.newton_step(at(i), part).norm()).collect();
        let shortest = |i: usize| {
            let left = i == 0 || steps[i] <= steps[i - 1];
            left && (i == points || steps[i] <= steps[i + 1])
        };
        let starts = (0..=points).filter(|&i| steps[i].is_finite() && shortest(i));
        let roots = starts.filter_map(|i| self.polish(at(i), part).ok()).filter(|z| !self.is_of_the_mesh(*z, part));
        roots.map(|z| Complex::new(z.re, z.im.abs())).collect()
    }

    /// Whether a zero belongs to a pole next to it: an element's own root, moved a little by the rest of the shoot.
    fn is_of_the_mesh(&self, z: Complex<f64>, part: Part) -> bool {
        let Part::Block(block) = part else { return false };
        (0..self.elements[block].len()).any(|element| {
            let Ok(pole) = self.polish(z, Part::Element(block, element)) else { return false };
            let distance = (pole - z).norm();
            // Around both; as many zeros as poles make no root.
            let reach = (3.0 * distance).max(1e-6 * z.norm());
            let corner = Complex::new(reach, 1.1 * reach);
            distance < NEIGHBOUR * z.norm() && self.count_within(part, z - corner, z + corner) == Some(0)
        })
    }

    /// The essential spectrum: for every kind of material point the root of its local problem that lies furthest to the
    /// right, rightmost first. Infinitely many roots of ever shorter waves pile up there. Empty if no law senses the
    /// strain where it acts.
    ///
    /// # Errors
    /// A root that is not found.
    pub fn essential(&self) -> Result<Vec<Complex<f64>>, StabilityError> {
        let mut out: Vec<Complex<f64>> = Vec::new();
        for block in 0..self.local_blocks.len() {
            if let Some(root) = self.rightmost_of(Part::Essential(block))?
                && !out.iter().any(|other| (other - root).norm() < 1e-9 * root.norm())
            {
                out.push(root);
            }
        }
        out.sort_by(|a, b| b.re.total_cmp(&a.re));
        Ok(out)
    }

    /// The line left of which nothing is sought: nine tenths of the way to the memories' own rates, where T has poles.
    pub(super) fn leftmost(&self) -> f64 {
        let rates = self.transfers.iter().flat_map(|t| &t.memory).map(|rate| rate.re);
        0.9 * rates.filter(|r| *r < 0.0).fold(f64::NEG_INFINITY, f64::max).max(-1e3 * self.slowest_rate())
    }

    /// The rightmost root of a part, if there is one right of the memories' own rates.
    ///
    /// For a block also right of the essential spectrum, left of which its characteristic function has poles.
    pub(super) fn rightmost_of(&self, part: Part) -> Result<Option<Complex<f64>>, StabilityError> {
        let slow = self.slowest_rate();
        let mut left = self.leftmost();
        if matches!(part, Part::Block(_)) {
            // Without proprioception everything piles up at zero.
            let essential = self.essential()?.first().map_or(0.0, |z| z.re);
            left = left.max(essential + 1e-4 * slow);
        }
        // Ever closer to what cannot be told from the essential spectrum, until a line has roots on its right.
        let mut line = self.threshold();
        for _ in 0..12 {
            if self.count(part, line)? > 0 {
                let near = self.near_line(part, line, GRID).into_iter().filter(|z| z.re > line);
                let best = near.max_by(|a, b| a.re.total_cmp(&b.re));
                // A whisker right of it nothing may be left.
                let clear = |z: &Complex<f64>| z.re + 1e-7 * z.norm().max(slow);
                return match best {
                    Some(z) if self.count(part, clear(&z))? == 0 => Ok(Some(z)),
                    _ => Ok(self.roots_right_of(part, line)?.first().copied()),
                };
            }
            line = left + (line - left) * 0.5;
        }
        Ok(None)
    }

    /// The isolated roots with Re λ > `abscissa` (1/s), rightmost first, with their modes. The line must lie right of the
    /// essential spectrum and of the rates of the memories, −1/τm.
    ///
    /// # Errors
    /// A line that does not, or a root that is not found.
    pub fn roots(&self, abscissa: f64) -> Result<Vec<Root>, StabilityError> {
        let left = self.leftmost();
        ParameterError::finite("line right of which roots are sought", abscissa)?;
        ParameterError::unless(
            abscissa >= left,
            "line right of which roots are sought",
            abscissa,
            "right of −0.9/τm (1/s)",
        )?;
        let essential = self.essential()?.first().map_or(f64::NEG_INFINITY, |z| z.re);
        ParameterError::unless(
            abscissa > essential,
            "line right of which roots are sought",
            abscissa,
            "right of the essential spectrum (1/s)",
        )?;
        let mut found: Vec<Root> = Vec::new();
        for (block, twins) in self.distinct_blocks() {
            for value in self.roots_right_of(Part::Block(block), abscissa)? {
                found.push(self.mode(value, block, twins));
            }
        }
        found.sort_by(|a, b| b.value.re.total_cmp(&a.value.re));
        Ok(found)
    }

    /// The rightmost root, with its mode.
    ///
    /// # Errors
    /// Infinitely many unstable roots, or none found right of the rates of the memories.
    pub fn rightmost(&self) -> Result<Root, StabilityError> {
        let mut best: Option<(Complex<f64>, usize, usize)> = None;
        for (block, twins) in self.distinct_blocks() {
            if let Some(z) = self.rightmost_of(Part::Block(block))?
                && best.is_none_or(|(other, ..)| z.re > other.re)
            {
                best = Some((z, block, twins));
            }
        }
        let Some((value, block, twins)) = best else { return Err(StabilityError::NoIsolatedRoot) };
        Ok(self.mode(value, block, twins))
    }
}
