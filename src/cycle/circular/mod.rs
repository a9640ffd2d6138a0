//! Circular orbits: a shape that turns rigidly about the vertical while its base stays clamped.

mod roots;

pub use roots::{TurningRoot, TurningRoots};

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use super::autonomous::{check_autonomous, check_gradients, driven_points};
use super::axis::{broken, check_rest, least_gradient};
use super::error::CycleError;
use super::fourier::Circle;
use super::map::march::PRECISE;
use super::point::{Round, Steady};
use super::sensitivity::stimuli_by_strain;
use super::turned::turned;
use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
use crate::error::ParameterError;
use crate::linear::{SteadyLaws, check_steady, visit_stimuli};
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::Root;
use crate::tropism::{Growing, TropismLaw};

/// Waves in one turn that are followed. Of a law that knows no direction of its own all that is known along the directors has
/// waves 0 and ±1; products of three of these are still told apart.
const WAVES: usize = 3;

/// A start for the search of an orbit: the intrinsic strain at every material point of the growth zone, components along the
/// directors at one time, 1/m, and the rate at which all turns, 1/s, positive if counterclockwise as seen from above the apex.
#[derive(Debug, Clone, PartialEq)]
pub struct Turning {
    /// Intrinsic strain, 1/m.
    pub strain: Vec<Vector3<f64>>,
    /// Rate, 1/s.
    pub rate: f64,
}

impl Turning {
    /// The mode of an upright shoot, turning counterclockwise with its tip at a distance of about `radius` (m).
    #[must_use]
    pub fn of_mode(root: &Root, radius: f64) -> Self {
        // In one plane it is Re[ψ exp(iωt)], in the other a quarter of a period later.
        let pair = |psi: &Vector3<Complex<f64>>| {
            let psi = if psi.x.norm() > psi.y.norm() { psi.x } else { psi.y };
            Vector3::new(psi.re, psi.im, 0.0) * radius
        };
        Self { strain: root.strain.iter().map(pair).collect(), rate: root.value.im }
    }

    /// The shape of a rod, as it is at one time of a run, say, turning at a rate (1/s).
    #[must_use]
    pub fn of_rod(rod: &Rod, rate: f64) -> Self {
        Self { strain: rod.points()[rod.zone()].iter().map(|point| point.intrinsic).collect(), rate }
    }
}

/// A circular orbit: every point of the shoot goes round the axis at one rate, in a shape that does not change.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct CircularOrbit {
    /// The rate at which all turns, 1/s, counterclockwise positive.
    pub rate: f64,
    /// The shape at one time.
    pub rod: Rod,
    /// Newton iterations.
    pub iterations: usize,
    /// What is left of the growth gradients, relative to the largest.
    pub residual: f64,
}

impl CircularOrbit {
    /// The time of a turn, s.
    #[must_use]
    pub fn period(&self) -> f64 {
        TAU / self.rate.abs()
    }

    /// The distance of the tip from the axis, m.
    #[must_use]
    pub fn radius(&self) -> f64 {
        let (tip, axis) = (self.rod.tip(), self.rod.frames()[0] * Vector3::z());
        (tip - axis * axis.dot(&tip)).norm()
    }

    /// The height of the tip along the axis, m.
    #[must_use]
    pub fn height(&self) -> f64 {
        (self.rod.frames()[0] * Vector3::z()).dot(&self.rod.tip())
    }

    /// The orbit as a start for the search of another.
    #[must_use]
    pub fn as_start(&self) -> Turning {
        Turning::of_rod(&self.rod, self.rate)
    }
}

/// Finds circular orbits of upright shoots: Newton's method for shape and rate together.
///
/// In the turning frame nothing changes, so that an orbit is a stationary state there: ν ẑ × u* = REGR gradient at every
/// material point, with the laws' variables what they are when their stimuli go round once in 2π/ν.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircularSolver {
    /// Largest growth gradient that may be left, relative to the largest there is, 1e-11 unless said otherwise.
    pub tolerance: f64,
    /// Bound on the iterations, 40 unless said otherwise.
    pub max_iterations: usize,
}

impl Default for CircularSolver {
    /// 1e-11, at most 40 iterations.
    fn default() -> Self {
        Self { tolerance: 1e-11, max_iterations: 40 }
    }
}

impl CircularSolver {
    /// The orbit of the shoot's laws on its elements that Newton's method reaches from a start. The shoot is not changed.
    ///
    /// # Errors
    /// A shoot that elongates, that has no axis, or of which some tissue does not steer; no orbit near the start.
    pub fn solve(&self, shoot: &Shoot<impl Model>, start: &Turning) -> Result<CircularOrbit, CycleError> {
        ParameterError::positive("tolerance of a circular orbit", self.tolerance)?;
        let mut problem = Problem::new(shoot, start)?;
        let (mut iterations, mut last) = (0, f64::INFINITY);
        loop {
            match problem.evaluate() {
                // No shape at rest for the start is what is wrong with it; later it is an iteration that has gone astray.
                Err(CycleError::Equilibrium(_)) if iterations > 0 => {
                    return Err(CycleError::NotConverged { iterations, residual: last });
                }
                answer => answer?,
            }
            if iterations == 0 {
                check_autonomous(shoot, &problem.rod)?;
                problem.check_axis()?;
            }
            let residual = problem.relative_residual();
            if residual <= self.tolerance {
                problem.check_axis()?;
                let (rod, rate) = (problem.rod, problem.rate);
                return Ok(CircularOrbit { rate, rod, iterations, residual });
            }
            if iterations == self.max_iterations || !residual.is_finite() {
                return Err(CycleError::NotConverged { iterations, residual });
            }
            last = residual;
            problem.step(iterations, residual)?;
            iterations += 1;
        }
    }
}

/// Derivatives by strain and rate.
type Derivatives = (DMatrix<f64>, DVector<f64>);

/// The shoot in the turning frame.
pub(super) struct Problem<'a, M: Model> {
    shoot: &'a Shoot<M>,
    pub circle: Circle,
    solver: NewtonSolver,
    pub rod: Rod,
    pub rate: f64,
    /// REGR of every point of the zone, 1/s.
    regr: Vec<f64>,
    places: Vec<Growing>,
    /// Of every point, a column for every phase.
    stimuli: Vec<DMatrix<f64>>,
    pub steady: Vec<Steady>,
    /// At the first phase.
    gradients: Vec<Vector3<f64>>,
    /// The strain against which phases are told, of unit norm.
    reference: DVector<f64>,
}

impl<'a, M: Model> Problem<'a, M> {
    pub fn new(shoot: &'a Shoot<M>, start: &Turning) -> Result<Self, CycleError> {
        let (places, regr) = driven_points(shoot)?;
        let mut rod = shoot.state.rod.clone();
        let zone = rod.zone();
        let (what, points) = ("number of strains of the start", start.strain.len() as f64);
        ParameterError::unless(start.strain.len() == zone.len(), what, points, "that of the points of the zone")?;
        let what = "rate of the start";
        ParameterError::unless(start.rate != 0.0 && start.rate.is_finite(), what, start.rate, "not zero (1/s)")?;
        for (point, strain) in rod.points_mut()[zone].iter_mut().zip(&start.strain) {
            ParameterError::finite("strain of the start", strain.sum())?;
            point.intrinsic = *strain;
        }
        let mut out = Self {
            shoot,
            circle: Circle::new(WAVES),
            solver: NewtonSolver::with_tolerance(PRECISE),
            rod,
            rate: start.rate,
            regr,
            places,
            stimuli: Vec::new(),
            steady: Vec::new(),
            gradients: Vec::new(),
            reference: DVector::zeros(0),
        };
        let strain = out.strain();
        let strain = strain.try_normalize(0.0).ok_or(CycleError::Stationary { strain: 0.0 })?;
        out.reference = strain;
        Ok(out)
    }

    fn law(&self) -> &'a M::Tropism {
        self.shoot.model.tropism()
    }

    fn round(&self) -> Round<'_, M::Tropism> {
        Round::new(self.law(), &self.circle, self.rate)
    }

    /// Components 1 and 2 of the intrinsic strain, point by point.
    pub fn strain(&self) -> DVector<f64> {
        let points = &self.rod.points()[self.rod.zone()];
        DVector::from_iterator(2 * points.len(), points.iter().flat_map(|point| [point.intrinsic.x, point.intrinsic.y]))
    }

    /// ẑ × u*: how the strain changes when all turns.
    fn turning(&self) -> DVector<f64> {
        quarter(&self.strain())
    }

    /// Finds the shape at rest, what its points sense as it goes round, and what the laws ask for.
    pub fn evaluate(&mut self) -> Result<(), CycleError> {
        let environment = self.shoot.environment();
        let material = self.shoot.model.constitutive();
        let force = InternalForce::of(&self.rod, self.shoot.model.load(), &environment);
        let _ = self.solver.equilibrate(&mut self.rod, material, &force)?;
        // The steady variables are the initial guess of those that go round.
        check_steady(self.law(), &SteadyLaws::of(self.shoot, &self.rod, &force))?;
        let m = self.law().size().stimuli;
        let mut stimuli = vec![DMatrix::zeros(m, self.circle.len()); self.places.len()];
        for (j, phase) in self.circle.phases.iter().enumerate() {
            let rod = turned(&self.rod, *phase);
            visit_stimuli(self.shoot, &rod, &force, |i, _, x| stimuli[i].column_mut(j).copy_from_slice(x));
        }
        self.stimuli = stimuli;
        let round = self.round();
        let steady = round.settle_all(&self.places, &self.stimuli)?;
        let gradients = self.asked_for(&round, &steady, 0);
        check_gradients(gradients.iter())?;
        (self.steady, self.gradients) = (steady, gradients);
        Ok(())
    }

    fn asked_for(&self, round: &Round<M::Tropism>, steady: &[Steady], phase: usize) -> Vec<Vector3<f64>> {
        let all = self.places.iter().zip(steady).zip(&self.stimuli);
        all.map(|((at, steady), stimuli)| round.gradient(at, steady, stimuli, phase)).collect()
    }

    /// Weights of the strain in the condition that it has the phase of the start: their sum is zero.
    pub fn phase(&self) -> DVector<f64> {
        quarter(&self.reference)
    }

    /// ν ẑ × u*/REGR − gradient, components 1 and 2.
    pub fn residual(&self) -> DVector<f64> {
        let turning = self.turning();
        DVector::from_fn(turning.len(), |k, _| self.rate * turning[k] / self.regr[k / 2] - self.gradients[k / 2][k % 2])
    }

    pub fn relative_residual(&self) -> f64 {
        let largest = self.gradients.iter().map(|gradient| gradient.norm()).fold(f64::MIN_POSITIVE, f64::max);
        self.residual().amax() / largest
    }

    /// The derivatives of the residual by the strain, and by the rate.
    pub fn derivatives(&self) -> Result<Option<Derivatives>, CycleError> {
        let n = 2 * self.places.len();
        let Some([inner, _]) = self.matrix(Complex::ZERO, &self.responses()?) else { return Ok(None) };
        let by_strain = DMatrix::from_fn(n, n, |row, column| inner[(row, column)].re / self.regr[row / 2]);
        // By the rate: central differences of the laws, the shape staying. Their response is smooth over an octave.
        let change = 1e-5 * self.rate;
        let turning = self.turning();
        let mut by_rate = DVector::from_fn(n, |k, _| turning[k] / self.regr[k / 2]);
        for sign in [1.0, -1.0] {
            let round = Round::new(self.law(), &self.circle, self.rate + sign * change);
            let settled = round.settle_all(&self.places, &self.stimuli)?;
            for (i, gradient) in self.asked_for(&round, &settled, 0).iter().enumerate() {
                for c in 0..2 {
                    by_rate[2 * i + c] -= sign * gradient[c] / (2.0 * change);
                }
            }
        }
        Ok(Some((by_strain, by_rate)))
    }

    /// One step of Newton's method, after so many that left this residual; the phase is that of the start.
    fn step(&mut self, iterations: usize, residual: f64) -> Result<(), CycleError> {
        let n = 2 * self.places.len();
        let failed = || CycleError::NotConverged { iterations, residual };
        let (by_strain, by_rate) = self.derivatives()?.ok_or_else(failed)?;
        let mut matrix = DMatrix::zeros(n + 1, n + 1);
        matrix.view_mut((0, 0), (n, n)).copy_from(&by_strain);
        matrix.view_mut((0, n), (n, 1)).copy_from(&by_rate);
        matrix.view_mut((n, 0), (1, n)).copy_from(&self.phase().transpose());
        let mut right = DVector::zeros(n + 1);
        right.rows_mut(0, n).copy_from(&self.residual());
        right[n] = self.phase().dot(&self.strain());
        let change = matrix.lu().solve(&right).filter(|x| x.iter().all(|x| x.is_finite())).ok_or_else(failed)?;
        // Newton's method for the residual over the size of the strain, which the stationary state, at zero, no longer solves: the
        // same direction, longer or shorter. No further than what is there, nor than a third of the rate.
        let strain = self.strain();
        let (size, towards_zero) = (strain.norm(), change.rows(0, n).dot(&strain) / strain.norm_squared());
        let share = (1.0 - towards_zero).recip();
        let most = (size / change.rows(0, n).norm()).min(self.rate.abs() / (3.0 * change[n].abs()));
        let share = share.clamp(-most, most);
        let first = self.rod.zone().start;
        for k in 0..n {
            self.rod.points_mut()[first + k / 2].intrinsic[k % 2] -= share * change[k];
        }
        self.rate -= share * change[n];
        let strain = self.strain();
        if strain.amax() * self.rod.length() < 1e-6 {
            return Err(CycleError::Stationary { strain: strain.amax() });
        }
        Ok(())
    }

    /// The stimuli of every point at all phases by the strain.
    pub fn responses(&self) -> Result<DMatrix<f64>, CycleError> {
        stimuli_by_strain(self.shoot, &self.rod, &self.shoot.environment(), &self.circle.phases)
    }

    /// λ + ν ẑ × − REGR ∂gradient, and its derivative by λ.
    pub fn matrix(&self, z: Complex<f64>, responses: &DMatrix<f64>) -> Option<[DMatrix<Complex<f64>>; 2]> {
        let n = 2 * self.places.len();
        let mut value = DMatrix::from_diagonal_element(n, n, z);
        let mut derivative = DMatrix::identity(n, n);
        let round = self.round();
        let rows = responses.nrows() / self.places.len();
        // Of linear laws one point stands for all.
        let mut known: Option<(usize, [DMatrix<Complex<f64>>; 2])> = None;
        for i in 0..self.places.len() {
            value[(2 * i, 2 * i + 1)] -= Complex::from(self.rate);
            value[(2 * i + 1, 2 * i)] += Complex::from(self.rate);
            let parts = match known.take() {
                Some((other, parts)) if self.steady[i].is_like(&self.steady[other]) => (other, parts),
                _ => (i, round.response(&self.steady[i], z)?),
            };
            // Components 1 and 2 of both, real and imaginary parts: one product of real numbers.
            let four = |row: usize, column: usize| {
                let z = parts.1[row / 4][(row % 2, column)];
                if row & 2 == 0 { z.re } else { z.im }
            };
            let by_strain = DMatrix::from_fn(8, rows, four) * responses.rows(i * rows, rows) * self.regr[i];
            for (k, out) in [&mut value, &mut derivative].into_iter().enumerate() {
                let mut own = out.rows_mut(2 * i, 2);
                own -= by_strain.rows(4 * k, 2).zip_map(&by_strain.rows(4 * k + 2, 2), Complex::new);
            }
            known = Some(parts);
        }
        Some([value, derivative])
    }

    /// Refuses what is not the same after a turn: the shape is at rest at one phase, and must be so at all; and what the laws ask for
    /// must turn with it.
    pub fn check_axis(&self) -> Result<(), CycleError> {
        for j in 1..self.circle.len() {
            let phase = self.circle.phases[j];
            check_rest(self.shoot, &self.rod, phase)?;
            let round = self.round();
            let (sine, cosine) = phase.sin_cos();
            let least = least_gradient(self.rod.length());
            let largest = self.gradients.iter().map(|gradient| gradient.norm()).fold(least, f64::max);
            for (then, now) in self.asked_for(&round, &self.steady, j).iter().zip(&self.gradients) {
                let expected = Vector3::new(cosine * now.x - sine * now.y, sine * now.x + cosine * now.y, now.z);
                broken("tropism", (then - expected).norm() / largest)?;
            }
        }
        Ok(())
    }
}

/// The pairs, each a quarter of a turn further.
pub(crate) fn quarter(pairs: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(pairs.len(), |k, _| if k % 2 == 0 { -pairs[k + 1] } else { pairs[k - 1] })
}
