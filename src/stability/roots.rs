//! The rightmost roots and their modes.

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use super::count::Part;
use super::{Linearisation, StabilityError};
use crate::error::ParameterError;
use crate::quadrature::rule;

/// How a mode moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Polarisation {
    /// To and fro in a plane.
    Planar,
    /// Round: the tip goes on an ellipse.
    Turning,
    /// A double root of an isotropic shoot: to and fro in any plane, or round in either sense.
    Isotropic,
}

/// A characteristic root, with Im λ ≥ 0; its conjugate is one too.
#[derive(Debug, Clone)]
pub struct Root {
    /// λ, 1/s: growth rate and angular frequency.
    pub value: Complex<f64>,
    /// The smallest singular direction's |M(λ) v| relative to |M(λ)| |v|.
    pub residual: f64,
    /// How many of the shoot's uncoupled parts share it.
    pub multiplicity: usize,
    /// How the mode moves.
    pub polarisation: Polarisation,
    /// The disturbance of the intrinsic strain at the points of the growth zone, components along the directors, 1/m.
    pub strain: Vec<Vector3<Complex<f64>>>,
    /// The displacement of the ends of the elements that goes with it, base first, m. The apex moves by 1 m at most.
    pub displacement: Vec<Vector3<Complex<f64>>>,
}

impl Root {
    /// The growth rate, 1/s: positive if the disturbance grows.
    #[must_use]
    pub fn growth_rate(&self) -> f64 {
        self.value.re
    }

    /// The period, s; infinite if the mode does not oscillate.
    #[must_use]
    pub fn period(&self) -> f64 {
        std::f64::consts::TAU / self.value.im.abs()
    }
}

/// More roots than this in a region are not told apart by their power sums.
const MOST: usize = 6;

impl Linearisation {
    /// −f/f', the step of Newton's method for the determinant.
    pub(super) fn newton_step(&self, z: Complex<f64>, part: Part) -> Complex<f64> {
        let (matrix, slope) = self.part(z, part);
        match matrix.lu().solve(&slope) {
            Some(quotient) => -Complex::<f64>::ONE / quotient.trace(),
            // Exactly singular: z is a root.
            None => Complex::ZERO,
        }
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

    /// All roots of a part with Re λ > `abscissa` and Im λ ≥ 0, rightmost first; at most a few.
    ///
    /// Their number and power sums are contour integrals of f'/f (Delves and Lyness, Math. Comp. 21, 543 (1967)); Newton's
    /// method then makes each exact.
    pub(super) fn roots_right_of(&self, part: Part, abscissa: f64) -> Result<Vec<Complex<f64>>, StabilityError> {
        let count = self.count(part, abscissa)?;
        if count == 0 {
            return Ok(Vec::new());
        }
        if count > MOST {
            return self.split_region(part, abscissa, count);
        }
        let radius = self.bound(abscissa).max(abscissa * 1.1);
        let centre = 0.5 * (abscissa + radius);
        let size = 0.5 * (radius - abscissa).max(radius);
        let (x, w) = rule::<8>();
        let corners = [
            Complex::new(radius, 0.0),
            Complex::new(radius, radius),
            Complex::new(abscissa, radius),
            Complex::new(abscissa, 0.0),
        ];
        let mut panels = 8;
        let mut sums = vec![0.0; MOST + 1];
        loop {
            sums.fill(0.0);
            for side in corners.windows(2) {
                for i in 0..panels {
                    // Panels shrink towards the end of the last side, the real axis near the line.
                    let at = |i: usize| {
                        let t = i as f64 / panels as f64;
                        if side[1].im == 0.0 { 1.0 - (1.0 - t) * (1.0 - t) } else { t }
                    };
                    let (a, b) = (at(i), at(i + 1));
                    for (x, w) in x.iter().zip(w) {
                        let z = side[0] + (side[1] - side[0]) * (a + (b - a) * x);
                        let term =
                            -Complex::<f64>::ONE / self.newton_step(z, part) * (side[1] - side[0]) * ((b - a) * w);
                        let place = (z - centre) / size;
                        let mut power = Complex::<f64>::ONE;
                        for sum in &mut sums[..=count] {
                            // The lower half of the contour is the mirror image.
                            *sum += (power * term).im / std::f64::consts::PI;
                            power *= place;
                        }
                    }
                }
            }
            if (sums[0] - count as f64).abs() < 1e-3 {
                break;
            }
            panels *= 2;
            if panels > 1024 {
                return Err(StabilityError::NoConvergence {
                    what: "contour integral of roots",
                    residual: sums[0] - count as f64,
                });
            }
        }
        let mut found: Vec<Complex<f64>> = Vec::new();
        for guess in roots_of_sums(&sums[1..=count]) {
            let z = self.polish(Complex::from(centre) + guess * size, part)?;
            let z = Complex::new(z.re, z.im.abs());
            if z.re > abscissa && !found.iter().any(|other| (other - z).norm() < 1e-9 * z.norm()) {
                found.push(z);
            }
        }
        let pairs: usize = found.iter().map(|z| if z.im > 1e-12 * z.norm() { 2 } else { 1 }).sum();
        if pairs != count {
            return self.split_region(part, abscissa, count);
        }
        found.sort_by(|a, b| b.re.total_cmp(&a.re));
        Ok(found)
    }

    /// Finds a line further right that leaves fewer roots, and takes those: enough for the rightmost.
    fn split_region(&self, part: Part, abscissa: f64, count: usize) -> Result<Vec<Complex<f64>>, StabilityError> {
        let (mut low, mut high) = (abscissa, self.bound(abscissa));
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match self.count(part, middle) {
                Ok(0) => high = middle,
                Ok(n) if n < count => return self.roots_right_of(part, middle),
                Ok(_) => low = middle,
                // A root on the line: any other line will do.
                Err(_) => high = 0.5 * (middle + high),
            }
        }
        // Not to be parted: a root that occurs several times, or roots closer than rounding.
        let z =
            self.polish(Complex::new(low, 0.0), part).or_else(|_| self.polish(Complex::new(low, low.abs()), part))?;
        Ok(vec![Complex::new(z.re, z.im.abs())])
    }

    /// The essential spectrum: for every kind of material point the root of its local problem that lies furthest to the
    /// right, rightmost first. Infinitely many roots of ever shorter waves pile up there. Empty if no law senses the
    /// strain where it acts.
    ///
    /// # Errors
    /// A root that is not found.
    pub fn essential(&self) -> Result<Vec<Complex<f64>>, StabilityError> {
        let mut out: Vec<Complex<f64>> = Vec::new();
        for kind in 0..self.transfers.len() {
            let part = Part::Essential(kind);
            if self.transfers[kind].local.norm() == 0.0 {
                continue;
            }
            if let Some(root) = self.rightmost_of(part)? {
                out.push(root);
            }
        }
        out.sort_by(|a, b| b.re.total_cmp(&a.re));
        Ok(out)
    }

    /// The line left of which nothing is sought: nine tenths of the way to the memories' own rates, where T has poles.
    fn leftmost(&self) -> f64 {
        let rates = self.transfers.iter().flat_map(|t| t.rates_y.diagonal().iter().copied().collect::<Vec<_>>());
        0.9 * rates.filter(|r| *r < 0.0).fold(f64::NEG_INFINITY, f64::max).max(-1e3 * self.slowest_rate())
    }

    /// The rightmost root of a part, if there is one right of the memories' own rates.
    pub(super) fn rightmost_of(&self, part: Part) -> Result<Option<Complex<f64>>, StabilityError> {
        let left = self.leftmost();
        // Lines ever further left, until one has roots right of it.
        let mut line = 1e-6 * self.slowest_rate();
        loop {
            let roots = self.roots_right_of(part, line);
            match roots {
                Ok(roots) if !roots.is_empty() => return Ok(roots.into_iter().next()),
                Ok(_) | Err(StabilityError::NoConvergence { .. }) if line > left => {}
                Ok(_) => return Ok(None),
                Err(error) => return Err(error),
            }
            line = if line > 0.0 { 0.02 * left } else { (1.7 * line).max(left * (1.0 + 1e-12)) };
            if line <= left {
                let roots = self.roots_right_of(part, left)?;
                return Ok(roots.into_iter().next());
            }
        }
    }

    /// The isolated roots with Re λ > `abscissa` (1/s), rightmost first, with their modes. The line must lie right of the
    /// essential spectrum and of the rates of the memories, −1/τm.
    ///
    /// # Errors
    /// A line that does not, or a root that is not found.
    pub fn roots(&self, abscissa: f64) -> Result<Vec<Root>, StabilityError> {
        let left = self.leftmost();
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
        for block in 0..self.blocks.len() {
            for value in self.roots_right_of(Part::Block(block), abscissa)? {
                let same = |root: &&mut Root| (root.value - value).norm() < 1e-6 * value.norm();
                if let Some(known) = found.iter_mut().find(same) {
                    known.multiplicity += 1;
                    known.polarisation = Polarisation::Isotropic;
                } else {
                    found.push(self.mode(value, block));
                }
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
        let mut best: Option<(Complex<f64>, usize)> = None;
        for block in 0..self.blocks.len() {
            if let Some(z) = self.rightmost_of(Part::Block(block))?
                && best.is_none_or(|(other, _)| z.re > other.re + 1e-9 * z.norm())
            {
                best = Some((z, block));
            }
        }
        let Some((value, block)) = best else {
            return Err(StabilityError::NoConvergence { what: "rightmost root", residual: f64::NAN });
        };
        let mut root = self.mode(value, block);
        for other in (0..self.blocks.len()).filter(|&other| other != block) {
            let step = self.newton_step(value, Part::Block(other)).norm();
            if step < 1e-6 * value.norm() {
                root.multiplicity += 1;
                root.polarisation = Polarisation::Isotropic;
            }
        }
        Ok(root)
    }

    /// The mode of a root of a block, by inverse iteration.
    fn mode(&self, value: Complex<f64>, block: usize) -> Root {
        let indices = &self.blocks[block];
        let (matrix, _) = self.matrix(value, indices);
        let lu = matrix.clone().lu();
        let n = indices.len();
        // No mode is orthogonal to this: its entries have no pattern.
        let mut v = DVector::from_fn(n, |i, _| Complex::new(1.0 + 0.1 * (i as f64).sin(), 0.3 * (i as f64).cos()));
        for _ in 0..3 {
            if let Some(next) = lu.solve(&v) {
                let norm = next.norm();
                if norm.is_finite() && norm > 0.0 {
                    v = next / Complex::from(norm);
                }
            }
        }
        let residual = (&matrix * &v).norm() / (matrix.norm() * v.norm());
        let mut all: DVector<Complex<f64>> = DVector::zeros(self.unknowns.len());
        for (i, &unknown) in indices.iter().enumerate() {
            all[unknown] = v[i];
        }
        let moved: DVector<Complex<f64>> = self.displacement.map(Complex::from) * &all;
        let rows = moved.nrows();
        let tip = moved.rows(rows - 3, 3).norm();
        let scale = if tip > 0.0 { Complex::from(1.0 / tip) } else { Complex::ONE };
        let displacement: Vec<Vector3<Complex<f64>>> =
            (0..rows / 3).map(|k| Vector3::from_fn(|i, _| moved[3 * k + i] * scale)).collect();
        let mut strain = vec![Vector3::zeros(); self.kind.len()];
        for (&(i, c), z) in self.unknowns.iter().zip(all.iter()) {
            strain[i][c] = *z * scale;
        }
        let polarisation = displacement.last().map_or(Polarisation::Planar, polarisation);
        Root { value, residual, multiplicity: 1, polarisation, strain, displacement }
    }
}

/// A displacement a exp(iωt) is planar if its real and imaginary parts are parallel.
fn polarisation(tip: &Vector3<Complex<f64>>) -> Polarisation {
    let (re, im) = (tip.map(|z| z.re), tip.map(|z| z.im));
    let area = re.cross(&im).norm();
    if area < 1e-6 * tip.norm_squared() { Polarisation::Planar } else { Polarisation::Turning }
}

/// The numbers whose power sums are given: Newton's identities, then the eigenvalues of the companion matrix.
fn roots_of_sums(sums: &[f64]) -> Vec<Complex<f64>> {
    let n = sums.len();
    let mut e = vec![1.0; n + 1];
    for k in 1..=n {
        let total: f64 =
            (1..=k).map(|i| if i % 2 == 1 { e[k - i] * sums[i - 1] } else { -e[k - i] * sums[i - 1] }).sum();
        e[k] = total / k as f64;
    }
    // z^n − e1 z^(n−1) + e2 z^(n−2) − …
    let companion = DMatrix::from_fn(n, n, |i, j| {
        if i == 0 {
            if j % 2 == 0 { e[j + 1] } else { -e[j + 1] }
        } else if i == j + 1 {
            1.0
        } else {
            0.0
        }
    });
    companion.complex_eigenvalues().iter().copied().collect()
}
