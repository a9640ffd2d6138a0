//! How many roots lie right of a line: the argument principle.

use nalgebra::{Complex, DMatrix};

use super::linear::LocalPart;
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

/// Part of the spectrum: the zeros of the determinant of a matrix that is analytic in λ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// The isolated roots of a block of unknowns.
    Block(usize),
    /// The essential spectrum of a block of the local problem at the points of a kind.
    Essential(usize),
}

/// Halvings of a panel after which a root is taken to lie on the line.
const DEPTH: usize = 45;
/// Longest panel against the distance of the nearest root, by its ends and middle.
const CLEAR: f64 = 2.0;

impl Linearisation {
    pub(super) fn part(&self, z: Complex<f64>, part: Part) -> (DMatrix<Complex<f64>>, DMatrix<Complex<f64>>) {
        match part {
            Part::Block(block) => self.matrix(z, &self.blocks[block]),
            Part::Essential(block) => {
                let (kind, components) = &self.local_blocks[block];
                self.local_matrix(z, *kind, components)
            }
        }
    }

    /// A function whose zeros are the roots of a part, that tends to one far right and has no pole right of the essential
    /// spectrum; and its logarithmic derivative.
    ///
    /// For a block it is det(M D⁻¹), D the local problems at its points: M is D and something compact, so this
    /// determinant has a limit as the mesh is refined, and only the isolated roots. For a local problem it is
    /// det D/(λ + c)ⁿ, c > 0.
    pub(super) fn characteristic(&self, z: Complex<f64>, part: Part) -> (Complex<f64>, Complex<f64>) {
        let (matrix, slope) = self.part(z, part);
        let n = matrix.nrows();
        match part {
            Part::Essential(_) => {
                let c = z + Complex::from(self.slowest_rate());
                let (value, log_slope) = determinant(matrix / c, slope / c);
                (value, log_slope - Complex::from(n as f64) / c)
            }
            Part::Block(block) => {
                let (mut value, mut log_slope) = (Complex::<f64>::ONE, Complex::<f64>::ZERO);
                let mut divisors = Vec::with_capacity(n);
                let lu = matrix.lu();
                for LocalPart { kind, components, rows } in &self.local_parts[block] {
                    let (local, local_slope) = self.local_matrix(z, *kind, components);
                    let (d, d_slope) = determinant(local, local_slope);
                    divisors.extend(std::iter::repeat_n(d.powf(1.0 / components.len() as f64), rows.len()));
                    let points = (rows.len() / components.len()) as f64;
                    log_slope -= d_slope * points;
                }
                // Pivot by pivot, or the determinants of many points over- or underflow.
                for (pivot, divisor) in lu.u().diagonal().iter().zip(&divisors) {
                    value *= pivot / divisor;
                }
                value *= lu.p().determinant::<Complex<f64>>();
                let quotient = lu.solve(&slope).map_or(Complex::from(f64::INFINITY), |q| q.trace());
                (value, log_slope + quotient)
            }
        }
    }

    /// The number of roots with Re λ > `abscissa`.
    ///
    /// # Errors
    /// A root on the line, which cannot be counted.
    pub(super) fn count(&self, part: Part, abscissa: f64) -> Result<usize, StabilityError> {
        let radius = self.bound(abscissa);
        let f = |w: f64| self.characteristic(Complex::new(abscissa, w), part);
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
            turn += argument(&f, (w, value), (next, next_value), 0).ok_or(StabilityError::NoConvergence {
                what: "count of roots (one lies on the line)",
                residual: next_value.0.norm().min(value.0.norm()),
            })?;
            (w, value) = (next, next_value);
        }
        // What is left of the argument from `top` to infinity, where f = 1.
        turn -= value.0.arg();
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
            let f = |t: f64| {
                let (value, log_slope) = self.characteristic(corner + side * t, part);
                (value, log_slope * side)
            };
            turn += argument(&f, (0.0, f(0.0)), (1.0, f(1.0)), 0)?;
        }
        let count = turn / std::f64::consts::TAU;
        let nearest = count.round();
        ((count - nearest).abs() < 0.05 && nearest >= 0.0).then_some(nearest as usize)
    }

    /// The number of roots with a positive real part, none missed, or that it is infinite.
    ///
    /// Roots within a millionth of the slowest rate of the axis are not told from it, or within a ten-thousandth where no
    /// law senses the strain at its own place: with η = 0 they pile up at λ = 0 from the left, and rounding scatters them.
    ///
    /// # Errors
    /// A root on the line.
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
}

impl Linearisation {
    /// How far right of the axis a root must lie to count as unstable, 1/s.
    pub(super) fn threshold(&self) -> f64 {
        (if self.local_blocks.is_empty() { 1e-4 } else { 1e-6 }) * self.slowest_rate()
    }
}

/// det A and tr(A⁻¹ A').
fn determinant(matrix: DMatrix<Complex<f64>>, slope: DMatrix<Complex<f64>>) -> (Complex<f64>, Complex<f64>) {
    let lu = matrix.lu();
    let quotient = lu.solve(&slope).map_or(Complex::from(f64::INFINITY), |q| q.trace());
    (lu.determinant(), quotient)
}

/// A value and its logarithmic derivative.
type Sample = (Complex<f64>, Complex<f64>);

/// The change of the argument of `f` between two points, by halving until it is small and sure.
fn argument(f: &impl Fn(f64) -> Sample, (a, fa): (f64, Sample), (b, fb): (f64, Sample), depth: usize) -> Option<f64> {
    let middle = 0.5 * (a + b);
    let fm = f(middle);
    let (left, right) = ((fm.0 / fa.0).arg(), (fb.0 / fm.0).arg());
    if !(left.is_finite() && right.is_finite()) {
        return None;
    }
    // |f'/f| is about the inverse distance of the nearest root. Two roots that are close to the line and to each other turn
    // the argument by 2π between samples that differ by nothing, and the derivative of the argument does not show it: hence
    // the panel must also be short against that distance.
    let steepest = fa.1.norm().max(fm.1.norm()).max(fb.1.norm());
    if left.abs() < 0.5 && right.abs() < 0.5 && (left - right).abs() < 0.25 && (b - a) * steepest < CLEAR {
        return Some(left + right);
    }
    if depth == DEPTH {
        return None;
    }
    Some(argument(f, (a, fa), (middle, fm), depth + 1)? + argument(f, (middle, fm), (b, fb), depth + 1)?)
}
