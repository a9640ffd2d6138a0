//! The stability of a rotating wave: characteristic roots in the corotating frame, where it is stationary.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix};

use super::corotating::Corotating;
use super::equations::unknowns;
use super::{RotatingWave, RotatingWaveSolver};
use crate::cycle::error::CycleError;
use crate::cycle::map::monodromy::Monodromy;
use crate::cycle::periodic::PeriodicSolver;
use crate::cycle::periodic::guess::state_of_waves;
use crate::cycle::spectrum::{Spectrum, check_count};
use crate::error::ParameterError;
use crate::linear::{AnalyticMatrix, newton, newton_step};
use crate::model::Model;
use crate::shoot::Shoot;

/// Largest number of rotations of the frame in a period that is tried: the return map does not determine this number.
const FRAMES: i32 = 3;
/// Largest distance between a root of the return map and one of the characteristic function, in units of the rate of rotation.
const APART: f64 = 1e-3;
/// Largest modulus of the trivial root, in the same units: the error of the differences.
const TRIVIAL: f64 = 1e-6;
/// Smallest frequency of a root that is not real, in the same units.
const REAL: f64 = 1e-9;
/// Largest number of intervals of the return map. It is doubled until its roots agree with those of the characteristic function.
const INTERVALS: usize = 128;

/// A characteristic root of a rotating wave, with Im λ ≥ 0; its conjugate is one too.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct WaveRoot {
    /// λ in the corotating frame, 1/s. Over a period a disturbance is multiplied by exp(λT), and rotates with the shape.
    pub value: Complex<f64>,
    /// Distance from the root that the return map, another method, gives, 1/s.
    pub difference: f64,
}

/// The leading characteristic roots of a rotating wave: all those to the right of `line`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct WaveRoots {
    /// Roots, rightmost first, without the trivial one.
    pub roots: Vec<WaveRoot>,
    /// Real part to the right of which the list is complete, 1/s, negative.
    pub line: f64,
    /// |λ| of the root of a rotation of the whole, 1/s: zero but for rounding and differences.
    pub trivial: f64,
}

impl WaveRoots {
    /// Number of roots with positive real part, conjugates counted. The list contains all of them.
    #[must_use]
    pub fn unstable(&self) -> usize {
        let right = self.roots.iter().filter(|root| root.value.re > 0.0);
        right.map(|root| if root.value.im > 0.0 { 2 } else { 1 }).sum()
    }
}

impl RotatingWave {
    /// The leading roots of the orbit, of small disturbances exp(λt) in the corotating frame: at least `count`, conjugates not counted,
    /// unless the others decay to less than 1e-3 within a period. They are found by Arnoldi's method with deflation on the linearised
    /// return map, and corrected by Newton's method on the characteristic function. The numbers of Krylov vectors and of intervals are
    /// chosen by convergence. The shoot is the one whose orbit this is.
    ///
    /// # Errors
    /// A count that is not from 1 to 19, a map that is not linearised, roots that do not converge, or on which the two methods
    /// disagree.
    pub fn roots(&self, shoot: &Shoot<impl Model>, count: usize) -> Result<WaveRoots, CycleError> {
        // Both of a pair and the trivial root are eigenvalues of the map.
        let wanted = if count == 0 { 0 } else { count.saturating_mul(2).saturating_add(1) };
        check_count(wanted)?;
        let function = Characteristic::of(shoot, self)?;
        let mut intervals = PeriodicSolver::default().intervals;
        loop {
            let solver = PeriodicSolver { intervals, ..PeriodicSolver::default() };
            let spectrum = self.spectrum(&function, shoot, &solver, wanted)?;
            if let Some(roots) = self.polished(&function, &spectrum) {
                return Ok(roots);
            }
            intervals *= 2;
            if intervals > INTERVALS {
                return Err(CycleError::RootsDisagree { intervals: INTERVALS });
            }
        }
    }

    /// Roots of the characteristic function, one for each multiplier; none unless they agree.
    fn polished(&self, function: &Characteristic<impl Model>, spectrum: &Spectrum) -> Option<WaveRoots> {
        let (period, rate) = (self.period(), self.rate.abs());
        let zero = function.polish(Complex::ZERO, &[])?;
        let mut known = vec![zero];
        let mut multipliers: Vec<Complex<f64>> = spectrum.values.iter().map(|(value, _)| *value).collect();
        let distance = |z: &Complex<f64>| (z - 1.0).norm();
        let nearest =
            (0..multipliers.len()).min_by(|a, b| distance(&multipliers[*a]).total_cmp(&distance(&multipliers[*b])))?;
        let trivial = multipliers.remove(nearest);
        if !(zero.norm() < TRIVIAL * rate && distance(&trivial) < APART * rate * period) {
            return None;
        }
        let mut roots = Vec::<WaveRoot>::new();
        for multiplier in multipliers.into_iter().filter(|multiplier| multiplier.im >= 0.0) {
            let first = multiplier.ln() / period;
            let frame = |k: i32| first + Complex::new(0.0, TAU / period * f64::from(k));
            // The step of Newton's method is short in the frame in which it is a root.
            let steps = (-FRAMES..=FRAMES).map(|k| (frame(k), function.step(frame(k), &known).norm()));
            let best = steps.min_by(|a, b| a.1.total_cmp(&b.1))?.0;
            let value = function.polish(best, &known)?;
            let difference = (value - best).norm();
            if !(difference < APART * rate) {
                return None;
            }
            // A real multiplier belongs to a real root or to half a pair.
            let value = Complex::new(value.re, value.im.abs());
            let value = if value.im < REAL * rate { Complex::from(value.re) } else { value };
            known.push(value);
            if value.im > 0.0 {
                known.push(value.conj());
            }
            roots.push(WaveRoot { value, difference });
        }
        roots.sort_by(|a, b| b.value.re.total_cmp(&a.value.re));
        Some(WaveRoots { roots, line: spectrum.radius.ln() / period, trivial: zero.norm() })
    }

    /// The leading multipliers of the return map over a rotation.
    fn spectrum<M: Model>(
        &self,
        function: &Characteristic<M>,
        shoot: &Shoot<M>,
        solver: &PeriodicSolver,
        wanted: usize,
    ) -> Result<Spectrum, CycleError> {
        let (period, problem) = (self.period(), &function.problem);
        let mut return_map = solver.return_map(shoot, period)?;
        let start =
            state_of_waves(&return_map, &problem.phases, &problem.steady, problem.strain(), problem.rate * period);
        let path = return_map.run(&start, period)?;
        let monodromy = Monodromy::with_responses(&return_map, &path, period, |time, _| {
            Ok(function.response_at(problem.rate * time))
        })?;
        Spectrum::of(start.flat().len(), wanted, |x| Ok(monodromy.apply(&start.with_values(x))?.flat()))
    }
}

/// det M(λ) with M = λ + ν ẑ × − REGR ∂gradient.
struct Characteristic<'a, M: Model> {
    problem: Corotating<'a, M>,
    responses: DMatrix<f64>,
}

impl<'a, M: Model> Characteristic<'a, M> {
    fn of(shoot: &'a Shoot<M>, orbit: &RotatingWave) -> Result<Self, CycleError> {
        let (length, own) = (orbit.rod.length(), shoot.rod().length());
        let what = "length of the shoot of the orbit";
        // Equal but for the rounding of a sum.
        ParameterError::unless((length - own).abs() <= 1e-12 * own, what, length, "that of the shoot (m)")?;
        let strain = unknowns(&orbit.as_guess()).start.strain;
        let mut problem = Corotating::new(shoot, &strain, orbit.rate, None)?;
        problem.rod = orbit.rod.clone();
        problem.evaluate()?;
        problem.check_autonomous()?;
        problem.check_axis()?;
        // What is found with another first guess differs by rounding.
        let residual = problem.relative_residual();
        if !(residual <= 100.0 * orbit.residual.max(RotatingWaveSolver::default().tolerance)) {
            return Err(CycleError::NotConverged { iterations: 0, residual });
        }
        let responses = problem.responses()?;
        Ok(Self { problem, responses })
    }

    /// Derivatives of the stimuli of all points by their strain, for the shape rotated by an angle.
    fn response_at(&self, angle: f64) -> DMatrix<f64> {
        let (points, phases) = (self.responses.ncols() / 2, self.problem.phases.len());
        let m = self.responses.nrows() / (points * phases);
        let weights = self.problem.phases.earlier(-angle);
        let mut out = DMatrix::zeros(points * m, 2 * points);
        for point in 0..points {
            for j in 0..phases {
                let part = self.responses.rows((point * phases + j) * m, m) * weights[(0, j)];
                let mut rows = out.rows_mut(point * m, m);
                rows += part;
            }
        }
        // The known derivatives are by the strain before the rotation.
        let (sine, cosine) = angle.sin_cos();
        for point in 0..points {
            for row in 0..out.nrows() {
                let (a, b) = (out[(row, 2 * point)], out[(row, 2 * point + 1)]);
                out[(row, 2 * point)] = cosine * a - sine * b;
                out[(row, 2 * point + 1)] = sine * a + cosine * b;
            }
        }
        out
    }

    /// The step of Newton's method for f(z)/Π (z − known); not a number where there is none.
    fn step(&self, z: Complex<f64>, known: &[Complex<f64>]) -> Complex<f64> {
        let Some([value, derivative]) = self.problem.matrix(z, &self.responses) else {
            return Complex::from(f64::NAN);
        };
        let (_, trace) = AnalyticMatrix { value, derivative }.pivots();
        newton_step(trace - known.iter().map(|root| (z - root).inv()).sum::<Complex<f64>>())
    }

    /// The root near a guess that is none of the known ones.
    fn polish(&self, start: Complex<f64>, known: &[Complex<f64>]) -> Option<Complex<f64>> {
        // The accuracy is the rounding error of the determinant.
        newton(start, 1e-12, |_| self.problem.rate.abs(), |z| self.step(z, known)).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unstable_roots_are_counted_with_their_conjugates() {
        let root = |re, im| WaveRoot { value: Complex::new(re, im), difference: 0.0 };
        let of = |roots: &[WaveRoot]| WaveRoots { roots: roots.to_vec(), line: -1.0, trivial: 0.0 }.unstable();
        assert_eq!(of(&[]), 0);
        assert_eq!(of(&[root(2.0, 1.0), root(1.0, 0.0), root(0.0, 3.0), root(-1.0, 1.0)]), 3);
    }
}
