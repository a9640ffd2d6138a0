//! The stability of a circular orbit: characteristic roots in the turning frame, where it stands still.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};

use super::{CircularOrbit, CircularSolver, Problem};
use crate::cycle::autonomous::check_autonomous;
use crate::cycle::error::CycleError;
use crate::cycle::gmres::Krylov;
use crate::cycle::map::variation::Variation;
use crate::cycle::periodic::PeriodicSolver;
use crate::cycle::periodic::find::start_of_waves;
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::stability::AnalyticMatrix;

/// Multipliers that are smaller than this die out within a turn; the map does not tell them from its rounding for long.
const SMALLEST: f64 = 1e-3;
/// Turns of the frame between which the map over a whole turn cannot tell.
const FRAMES: i32 = 3;
/// A root that the map and the characteristic function put further apart than this, in units of the rate of turning, is not one.
const APART: f64 = 1e-3;
/// Roots that are closer than this, in the same units, are one.
const SAME: f64 = 1e-6;

/// A characteristic root of a circular orbit, with Im λ ≥ 0; its conjugate is one too.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TurningRoot {
    /// λ in the turning frame, 1/s. Over a turn a disturbance is multiplied by exp(λT), and has turned with the shape.
    pub value: Complex<f64>,
    /// How far the return map, a method of its own, puts it from there, 1/s.
    pub difference: f64,
}

/// The leading characteristic roots of a circular orbit.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TurningRoots {
    /// Rightmost first, without the trivial one.
    pub roots: Vec<TurningRoot>,
    /// |λ| of the root that the turning of the whole has, 1/s: zero but for rounding and differences. Infinite if the map did not show
    /// it, as next to the onset, where the radius hardly decays and the two are hard to tell apart.
    pub trivial: f64,
}

impl TurningRoots {
    /// How many roots have a positive real part, conjugates counted.
    #[must_use]
    pub fn unstable(&self) -> usize {
        let right = self.roots.iter().filter(|root| root.value.re > 0.0);
        right.map(|root| if root.value.im > 0.0 { 2 } else { 1 }).sum()
    }
}

impl CircularOrbit {
    /// The leading roots of the orbit, of small disturbances exp(λt) in the turning frame: found by Arnoldi's method on the linearised
    /// return map with `most` vectors, and brought to the last digits on the characteristic function. The shoot is that whose orbit
    /// this is. On 8 elements a dozen vectors give the three leading ones.
    ///
    /// # Errors
    /// No vector, or a map that is not linearised.
    pub fn roots(&self, shoot: &Shoot<impl Model>, most: usize) -> Result<TurningRoots, CycleError> {
        Krylov::check(most)?;
        let function = Characteristic::of(shoot, self)?;
        let (period, mut roots) = (self.period(), Vec::<TurningRoot>::new());
        let mut trivial = f64::INFINITY;
        for (multiplier, _) in self.multipliers(&function, shoot, most)? {
            if !(multiplier.norm() > SMALLEST) {
                continue;
            }
            let first = multiplier.ln() / period;
            let frame = |k: i32| first + Complex::new(0.0, TAU / period * f64::from(k));
            // In which frame it is a root shows in Newton's step.
            let steps = (-FRAMES..=FRAMES).map(|k| (frame(k), function.step(frame(k)).norm()));
            let best = steps.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(first, |best| best.0);
            let Some(value) = function.polish(best) else { continue };
            let difference = (value - best).norm();
            let same = |a: Complex<f64>, b: Complex<f64>| (a - b).norm() < SAME * self.rate.abs();
            if same(value, Complex::ZERO) {
                trivial = trivial.min(value.norm());
            } else if difference < APART * self.rate.abs() {
                let value = Complex::new(value.re, value.im.abs());
                if !roots.iter().any(|root| same(root.value, value)) {
                    roots.push(TurningRoot { value, difference });
                }
            }
        }
        roots.sort_by(|a, b| b.value.re.total_cmp(&a.value.re));
        Ok(TurningRoots { roots, trivial })
    }

    fn multipliers<M: Model>(
        &self,
        function: &Characteristic<M>,
        shoot: &Shoot<M>,
        most: usize,
    ) -> Result<Vec<(Complex<f64>, f64)>, CycleError> {
        let (period, problem) = (self.period(), &function.problem);
        let mut march = PeriodicSolver::default().march(shoot, period)?;
        let start = start_of_waves(&march, &problem.circle, &problem.steady, problem.strain(), problem.rate * period);
        let path = march.run(&start, period)?;
        let variation =
            Variation::with_responses(&march, &path, period, |time, _| Ok(function.response_at(problem.rate * time)))?;
        let mut begin = start.with_values(&DVector::zeros(start.flat().len()));
        // No mode is orthogonal to this: its entries have no pattern.
        begin.strain.iter_mut().enumerate().for_each(|(k, x)| *x = 1.0 + 0.7 * (3.0 * k as f64).sin());
        let apply = |x: &DVector<f64>| Ok::<_, CycleError>(variation.apply(&start.with_values(x))?.flat());
        let begin = apply(&begin.flat())?;
        Ok(Krylov::of(&begin, most, 1e-13, apply, |_| false)?.eigenvalues()?)
    }
}

/// det M(λ) with M = λ + ν ẑ × − REGR ∂gradient.
struct Characteristic<'a, M: Model> {
    problem: Problem<'a, M>,
    responses: DMatrix<f64>,
}

impl<'a, M: Model> Characteristic<'a, M> {
    fn of(shoot: &'a Shoot<M>, orbit: &CircularOrbit) -> Result<Self, CycleError> {
        let (length, own) = (orbit.rod.length(), shoot.rod().length());
        let what = "length of the shoot of the orbit";
        // Equal but for the rounding of a sum.
        ParameterError::unless((length - own).abs() <= 1e-12 * own, what, length, "that of the shoot (m)")?;
        let mut problem = Problem::new(shoot, &orbit.as_start())?;
        problem.rod = orbit.rod.clone();
        problem.evaluate()?;
        check_autonomous(shoot, &problem.rod)?;
        problem.check_axis()?;
        // What is found with another first guess differs by rounding.
        let residual = problem.relative_residual();
        if !(residual <= 100.0 * orbit.residual.max(CircularSolver::default().tolerance)) {
            return Err(CycleError::NotConverged { iterations: 0, residual });
        }
        let responses = problem.responses()?;
        Ok(Self { problem, responses })
    }

    /// The stimuli of all points by their strain when all has turned by an angle.
    fn response_at(&self, angle: f64) -> DMatrix<f64> {
        let (points, phases) = (self.responses.ncols() / 2, self.problem.circle.len());
        let m = self.responses.nrows() / (points * phases);
        let weights = self.problem.circle.earlier(-angle);
        let mut out = DMatrix::zeros(points * m, 2 * points);
        for point in 0..points {
            for j in 0..phases {
                let part = self.responses.rows((point * phases + j) * m, m) * weights[(0, j)];
                let mut rows = out.rows_mut(point * m, m);
                rows += part;
            }
        }
        // They are by the strain before it has turned.
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

    /// −f/f′, the step of Newton's method; not a number where there is none.
    fn step(&self, z: Complex<f64>) -> Complex<f64> {
        let Some([value, derivative]) = self.problem.matrix(z, &self.responses) else {
            return Complex::from(f64::NAN);
        };
        let (_, trace) = AnalyticMatrix { value, derivative }.pivots();
        if trace.re.is_infinite() { Complex::ZERO } else { -trace.inv() }
    }

    fn polish(&self, start: Complex<f64>) -> Option<Complex<f64>> {
        let (mut z, mut last) = (start, f64::INFINITY);
        for _ in 0..30 {
            let step = self.step(z);
            z += step;
            let size = step.norm();
            // Below rounding of the function steps no longer shrink.
            if size < 1e-12 * self.problem.rate.abs() || (size < 1e-8 * self.problem.rate.abs() && size >= last) {
                return Some(z);
            }
            if !size.is_finite() {
                break;
            }
            last = size;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unstable_roots_are_counted_with_their_conjugates() {
        let root = |re, im| TurningRoot { value: Complex::new(re, im), difference: 0.0 };
        let of = |roots: &[TurningRoot]| TurningRoots { roots: roots.to_vec(), trivial: 0.0 }.unstable();
        assert_eq!(of(&[]), 0);
        assert_eq!(of(&[root(2.0, 1.0), root(1.0, 0.0), root(0.0, 3.0), root(-1.0, 1.0)]), 3);
    }
}
