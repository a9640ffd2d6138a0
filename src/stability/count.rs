//! How many roots lie right of a line: the argument principle.

use nalgebra::{Complex, DMatrix};

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
    /// The essential spectrum at the points of a kind.
    Essential(usize),
}

/// Panels on the line to begin with.
const PANELS: usize = 32;
/// Halvings of a panel after which a root is taken to lie on the line.
const DEPTH: usize = 30;

impl Linearisation {
    pub(super) fn part(&self, z: Complex<f64>, part: Part) -> (DMatrix<Complex<f64>>, DMatrix<Complex<f64>>) {
        match part {
            Part::Block(block) => self.matrix(z, &self.blocks[block]),
            Part::Essential(kind) => self.local_matrix(z, kind),
        }
    }

    /// det M(λ)/(λ + c)ⁿ up to a positive factor, with c > 0 so that it tends to one far right and has no pole there.
    fn characteristic(&self, z: Complex<f64>, part: Part, c: f64) -> Complex<f64> {
        let (matrix, _) = self.part(z, part);
        (matrix / (z + Complex::from(c))).lu().determinant()
    }

    /// The number of roots with Re λ > `abscissa`.
    ///
    /// # Errors
    /// A root on the line, which cannot be counted.
    pub(super) fn count(&self, part: Part, abscissa: f64) -> Result<usize, StabilityError> {
        let radius = self.bound(abscissa);
        let c = 2.0 * abscissa.abs() + self.slowest_rate();
        let f = |w: f64| self.characteristic(Complex::new(abscissa, w), part, c);
        // From the real axis up to where no root is: the other half mirrors it, the arc far right contributes nothing
        // because f is real at its right end and within 1 of 1 beyond the bound. Denser towards zero, where slow roots are.
        let top = 8.0 * radius;
        let mut turn = 0.0;
        let (mut w, mut value) = (0.0, f(0.0));
        for i in 1..=PANELS {
            let next = top * (i as f64 / PANELS as f64).powi(2);
            let next_value = f(next);
            turn += argument(&f, (w, value), (next, next_value), 0).ok_or(StabilityError::NoConvergence {
                what: "count of roots (one lies on the line)",
                residual: next_value.norm().min(value.norm()),
            })?;
            (w, value) = (next, next_value);
        }
        // What is left of the argument from `top` to infinity, where f = 1.
        turn -= value.arg();
        let count = -turn / std::f64::consts::PI;
        let nearest = count.round();
        if (count - nearest).abs() > 0.05 || nearest < 0.0 || !count.is_finite() {
            return Err(StabilityError::NoConvergence { what: "count of roots", residual: count - nearest });
        }
        Ok(nearest as usize)
    }

    /// The number of roots with a positive real part, none missed, or that it is infinite.
    ///
    /// Roots within a millionth of the slowest rate of the axis are not told from it: with η = 0 they pile up at λ = 0
    /// from the left, and rounding scatters them.
    ///
    /// # Errors
    /// A root on the line.
    pub fn unstable(&self) -> Result<Unstable, StabilityError> {
        let line = 1e-6 * self.slowest_rate();
        for kind in 0..self.transfers.len() {
            if self.count(Part::Essential(kind), line)? > 0 {
                let abscissa = self.essential()?.first().map_or(0.0, |z| z.re);
                return Ok(Unstable::Infinite { abscissa });
            }
        }
        let mut sum = 0;
        for block in 0..self.blocks.len() {
            sum += self.count(Part::Block(block), line)?;
        }
        Ok(Unstable::Finite(sum))
    }
}

/// The change of the argument of `f` between two points, by halving until it is small and sure.
fn argument(
    f: &impl Fn(f64) -> Complex<f64>,
    (a, fa): (f64, Complex<f64>),
    (b, fb): (f64, Complex<f64>),
    depth: usize,
) -> Option<f64> {
    let middle = 0.5 * (a + b);
    let fm = f(middle);
    let (left, right) = ((fm / fa).arg(), (fb / fm).arg());
    if !(left.is_finite() && right.is_finite()) {
        return None;
    }
    // Both halves turn by less than half a radian, and about equally: no turn between the samples was missed.
    if left.abs() < 0.5 && right.abs() < 0.5 && (left - right).abs() < 0.25 {
        return Some(left + right);
    }
    if depth == DEPTH {
        return None;
    }
    Some(argument(f, (a, fa), (middle, fm), depth + 1)? + argument(f, (middle, fm), (b, fb), depth + 1)?)
}
