//! The stability of a circular orbit: characteristic roots in the turning frame, where it stands still.

use nalgebra::{Complex, DMatrix};

use super::circular::{CircularOrbit, Problem};
use super::error::CycleError;
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::stability::{Analytic, AnalyticMatrix, Sample, Scales, roots_right_of};

/// The characteristic roots of a circular orbit.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TurningRoots {
    /// The roots λ right of the line with Im λ ≥ 0, 1/s, rightmost first, without the trivial one. The multiplier of a root over a turn is
    /// exp(λT).
    pub roots: Vec<Complex<f64>>,
    /// |λ| of the root that the turning of the whole has, 1/s: zero but for rounding and differences.
    pub trivial: f64,
}

impl TurningRoots {
    /// How many roots have a positive real part, conjugates counted.
    #[must_use]
    pub fn unstable(&self) -> usize {
        let right = self.roots.iter().filter(|root| root.re > 0.0);
        right.map(|root| if root.im > 0.0 { 2 } else { 1 }).sum()
    }
}

impl CircularOrbit {
    /// The roots right of a `line` (1/s), with small disturbances exp(λt) in the turning frame. The shoot is that whose orbit this is;
    /// the line must lie right of its essential spectrum, see
    /// [`Linearisation::essential_spectrum`](crate::stability::Linearisation::essential_spectrum).
    ///
    /// # Errors
    /// A line that is not finite, or roots that are not all found.
    pub fn roots(&self, shoot: &Shoot<impl Model>, line: f64) -> Result<TurningRoots, CycleError> {
        ParameterError::finite("line right of which roots are sought", line)?;
        let function = Characteristic::of(shoot, self)?;
        let mut roots = roots_right_of(&function, line.min(-function.slowest_rate() * 1e-3))?;
        let trivial = (0..roots.len()).min_by(|a, b| roots[*a].norm().total_cmp(&roots[*b].norm()));
        let trivial = trivial.map_or(f64::INFINITY, |at| roots.remove(at).norm());
        roots.retain(|root| root.re > line);
        Ok(TurningRoots { roots, trivial })
    }
}

/// det M(λ)/(λ + c)ⁿ with M = λ + ν ẑ × − REGR ∂gradient.
struct Characteristic<'a, M: Model> {
    problem: Problem<'a, M>,
    responses: DMatrix<f64>,
    slowest: f64,
}

impl<'a, M: Model> Characteristic<'a, M> {
    fn of(shoot: &'a Shoot<M>, orbit: &CircularOrbit) -> Result<Self, CycleError> {
        let mut problem = Problem::new(shoot, &orbit.as_start())?;
        problem.rod = orbit.rod.clone();
        problem.evaluate()?;
        let responses = problem.responses()?;
        let slowest = problem.rate.abs();
        Ok(Self { problem, responses, slowest })
    }

    fn matrix(&self, z: Complex<f64>) -> AnalyticMatrix {
        let n = self.responses.ncols();
        let nan = || [DMatrix::from_element(n, n, Complex::from(f64::NAN)), DMatrix::identity(n, n)];
        let [value, derivative] = self.problem.matrix(z, &self.responses).unwrap_or_else(nan);
        AnalyticMatrix { value, derivative }
    }
}

impl<M: Model> Analytic for Characteristic<'_, M> {
    fn at(&self, z: Complex<f64>) -> Sample {
        let (pivots, trace) = self.matrix(z).pivots();
        // Left of all lines.
        let divisor = z + Complex::from(4.0 * self.slowest);
        let value = pivots.iter().map(|pivot| pivot / divisor).product();
        Sample { value, log_derivative: trace - divisor.inv() * pivots.len() as f64, nearness: divisor.norm().recip() }
    }

    fn scales(&self) -> &dyn Scales {
        self
    }
}

impl<M: Model> Scales for Characteristic<'_, M> {
    /// |λ| of a root is at most ν and the norm of what the laws answer, which falls with the frequency: it is doubled until it exceeds
    /// that by a half.
    fn bound(&self, abscissa: f64) -> f64 {
        let mut radius = 2.0 * self.slowest;
        for _ in 0..60 {
            let z = Complex::new(abscissa, radius);
            let mut answer = self.matrix(z).value;
            (0..answer.nrows()).for_each(|k| answer[(k, k)] -= z);
            // Twice for what lies beyond, where delays change the phase.
            if !(2.0 * answer.norm() > z.norm()) {
                break;
            }
            radius *= 1.5;
        }
        radius
    }

    fn slowest_rate(&self) -> f64 {
        self.slowest
    }
}
