//! Stability of a rotating wave: characteristic roots λ of det M(λ) = 0 in the corotating frame,
//! where the wave is stationary.
//!
//! The leading multipliers of the return map give initial guesses of all leading roots. Newton's
//! method on the determinant corrects them. A multiplier μ = exp(λT) determines λ up to multiples
//! of 2πi/T. Roots that are real in the fixed frame are pairs λ ± iν in the corotating frame, whose
//! two multipliers are equal. Each root of a pair is therefore assigned a multiplier of its own. If
//! a multiplier has no root nearby, the grid of the map is refined.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix};

use super::corotating::Corotating;
use super::{RotatingWave, RotatingWaveSolver};
use crate::cycle::corrector::check_residual;
use crate::cycle::equations::EvaluatedEquations;
use crate::cycle::error::{CycleError, Outcome};
use crate::cycle::map::{Monodromy, bends};
use crate::cycle::periodic::{MAX_INTERVALS, PeriodicSolver};
use crate::cycle::sensitivity::ASYMMETRY;
use crate::cycle::spectrum::{Eigenvalue, LeadingSpectrum, MOST_VALUES, remove_nearest};
use crate::error::{ParameterError, ensure};
use crate::linearisation::{newton, newton_step};
use crate::model::Model;
use crate::numerics::scalar::sort_by_value;
use crate::shoot::Shoot;

/// Largest multiple of 2πi/T that is tried for a root.
const FRAMES: i32 = 3;
/// Largest distance between a root and that of the return map, relative to the rate of rotation.
const APART: f64 = 1e-3;
/// Smallest frequency of a root that is not real, relative to the rate of rotation.
const REAL: f64 = 1e-9;

/// The leading characteristic roots of a rotating wave: all roots to the right of `line`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct WaveRoots {
    /// Roots with Im λ ≥ 0, 1/s, rightmost first. Their conjugates and the trivial root are
    /// omitted.
    pub roots: Vec<Eigenvalue>,
    /// Real part to the right of which the list is complete, 1/s, negative.
    pub line: f64,
    /// Modulus of the trivial root, that of a rotation, 1/s. It is zero up to rounding and the
    /// error of differences.
    pub trivial: f64,
}

impl WaveRoots {
    /// Number of roots with positive real part, conjugates included. The list contains all of them.
    #[must_use]
    pub fn unstable(&self) -> usize {
        let right = self.roots.iter().filter(|root| root.value.re > 0.0);
        right
            .map(|root| if root.value.im > 0.0 { 2 } else { 1 })
            .sum()
    }
}

impl RotatingWave {
    /// Computes the leading roots in the corotating frame: at least `count`, without conjugates,
    /// unless the others decay to less than 1e-3 within a period. The shoot is the one whose orbit
    /// this is.
    ///
    /// # Errors
    /// A count that is not from 1 to 19, laws that cannot be linearised, roots that do not
    /// converge, or multipliers without a root.
    pub fn roots(&self, shoot: &Shoot<impl Model>, count: usize) -> Result<WaveRoots, CycleError> {
        // Conjugates and the trivial root are eigenvalues of the map, too.
        const { assert!(2 * 19 < MOST_VALUES) };
        ParameterError::unless(
            (1..=19).contains(&count),
            "number of roots",
            count as f64,
            "from 1 to 19",
        )?;
        let wanted = 2 * count + 1;
        let function = Characteristic::of(shoot, self)?;
        let mut intervals = PeriodicSolver::default().intervals;
        loop {
            let solver = PeriodicSolver {
                intervals,
                ..PeriodicSolver::default()
            };
            let spectrum = function.spectrum(&solver, wanted)?;
            match self.polished(&function, &spectrum) {
                Ok(roots) => return Ok(roots),
                // More intervals would take minutes.
                Err(error) if intervals == MAX_INTERVALS => {
                    return Err(CycleError::Unresolved { error, intervals });
                }
                Err(_) => intervals *= 2,
            }
        }
    }

    /// One root for each multiplier. If they differ, returns the difference relative to the rate;
    /// infinite if a root is not found.
    fn polished(
        &self,
        function: &Characteristic<impl Model>,
        spectrum: &LeadingSpectrum,
    ) -> Result<WaveRoots, f64> {
        let (period, rate) = (self.period(), self.rate.abs());
        let zero = function.polish(Complex::ZERO, &[])?;
        let mut known = vec![zero];
        let mut multipliers = spectrum.values.clone();
        let distance =
            remove_nearest(&mut multipliers, Complex::ONE, f64::INFINITY).ok_or(f64::INFINITY)?;
        let near = zero.norm() < ASYMMETRY * rate && distance < APART * rate * period;
        ensure(near, (distance / period).max(zero.norm()) / rate)?;
        let mut roots = Vec::<Eigenvalue>::new();
        // Largest multipliers first. The conjugate of a root has a multiplier of its own.
        multipliers.reverse();
        while let Some(Eigenvalue {
            value: multiplier, ..
        }) = multipliers.pop()
        {
            let first = multiplier.ln() / period;
            let frame = |k: i32| first + Complex::new(0.0, TAU / period * f64::from(k));
            // The Newton step is shortest from the value next to a root.
            let steps =
                (-FRAMES..=FRAMES).map(|k| (frame(k), function.step(frame(k), &known).norm()));
            let best = steps
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .ok_or(f64::INFINITY)?
                .0;
            let value = function.polish(best, &known)?;
            let difference = (value - best).norm();
            ensure(difference < APART * rate, difference / rate)?;
            let value = Complex::new(value.re, value.im.abs());
            let value = if value.im < REAL * rate {
                Complex::from(value.re)
            } else {
                value
            };
            known.push(value);
            if value.im > 0.0 {
                known.push(value.conj());
                remove_nearest(&mut multipliers, multiplier.conj(), APART * rate * period);
            }
            roots.push(Eigenvalue {
                value,
                residual: difference,
            });
        }
        sort_by_value(&mut roots, |root| -root.value.re);
        Ok(WaveRoots {
            roots,
            line: spectrum.radius.ln() / period,
            trivial: zero.norm(),
        })
    }
}

/// The characteristic function det M(λ), with M = λ + ν ẑ × − REGR ∂gradient.
struct Characteristic<'a, M: Model> {
    problem: Corotating<'a, M>,
    responses: DMatrix<f64>,
}

impl<'a, M: Model> Characteristic<'a, M> {
    fn of(shoot: &'a Shoot<M>, orbit: &RotatingWave) -> Outcome<Self> {
        let (length, own) = (orbit.rod.length(), shoot.rod().length());
        let what = "length of the shoot of the orbit";
        // The sum of the lengths of elements has rounding errors.
        ParameterError::unless(
            (length - own).abs() <= 1e-12 * own,
            what,
            length,
            "that of the shoot (m)",
        )?;
        let problem = Corotating::new(shoot, &bends(&orbit.rod), orbit.rate, Some(&orbit.rod))?;
        problem.check()?;
        let tolerance = orbit.residual.max(RotatingWaveSolver::default().tolerance);
        check_residual(problem.residual().1, tolerance)?;
        let responses = problem.responses()?;
        Ok(Self { problem, responses })
    }

    /// The leading multipliers of the return map over a rotation.
    fn spectrum(&self, solver: &PeriodicSolver, wanted: usize) -> Outcome<LeadingSpectrum> {
        let (problem, period) = (&self.problem, TAU / self.problem.rate.abs());
        let mut return_map = solver.return_map(problem.shoot, period)?;
        let (strain, turn) = (bends(&problem.rod), problem.rate * period);
        let start = return_map.state_of_waves(&problem.phases, &problem.points, strain, turn);
        let path = return_map.run(&start, period)?;
        let response = |time: f64| self.response_at(problem.rate * time);
        let monodromy =
            Monodromy::with_responses(&return_map, &path, |time, _| Ok(response(time)))?;
        LeadingSpectrum::of(start.flat().len(), wanted, &mut |x| monodromy.apply_flat(x))
    }

    /// Derivatives of the stimuli of all points by the strain, for the shape rotated by an angle
    /// (rad).
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
        // The derivatives at the phases are by the strain before the rotation.
        let (sine, cosine) = angle.sin_cos();
        DMatrix::from_fn(points * m, 2 * points, |row, k| {
            let (a, b) = (out[(row, k - k % 2)], out[(row, k - k % 2 + 1)]);
            if k % 2 == 0 {
                cosine * a - sine * b
            } else {
                sine * a + cosine * b
            }
        })
    }

    /// The step of Newton's method for det M(z)/Π (z − known); NaN if the laws are singular.
    fn step(&self, z: Complex<f64>, known: &[Complex<f64>]) -> Complex<f64> {
        let Some(matrix) = self.problem.matrix(z, &self.responses) else {
            return Complex::from(f64::NAN);
        };
        let (_, trace) = matrix.pivots();
        newton_step(
            trace
                - known
                    .iter()
                    .map(|root| (z - root).inv())
                    .sum::<Complex<f64>>(),
        )
    }

    /// The root near a guess that differs from the known ones. An error is infinite: no root is
    /// found.
    fn polish(&self, start: Complex<f64>, known: &[Complex<f64>]) -> Result<Complex<f64>, f64> {
        // The accuracy is the rounding error of the determinant.
        newton(
            start,
            1e-12,
            |_| self.problem.rate.abs(),
            |z| self.step(z, known),
        )
        .map_err(|_| f64::INFINITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unstable_roots_are_counted_with_conjugates() {
        let root = |re, im| Eigenvalue {
            value: Complex::new(re, im),
            residual: 0.0,
        };
        let of = |roots: &[Eigenvalue]| {
            WaveRoots {
                roots: roots.to_vec(),
                line: -1.0,
                trivial: 0.0,
            }
            .unstable()
        };
        assert_eq!(of(&[]), 0);
        assert_eq!(
            of(&[
                root(2.0, 1.0),
                root(1.0, 0.0),
                root(0.0, 3.0),
                root(-1.0, 1.0)
            ]),
            3
        );
    }
}
