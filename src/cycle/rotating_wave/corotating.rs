//! The laws of a shoot in the frame that rotates with a wave, where the wave is stationary.

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use crate::cycle::autonomous::{check_autonomous, check_gradients, driven_points};
use crate::cycle::axis::{broken, check_rest, least_gradient};
use crate::cycle::error::CycleError;
use crate::cycle::fourier::Circle;
use crate::cycle::map::march::PRECISE;
use crate::cycle::point::{Round, Steady};
use crate::cycle::sensitivity::{look, stimuli_by_strain};
use crate::cycle::turned::{take_shape, turned};
use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
use crate::error::ParameterError;
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::{SteadyState, check_steady};
use crate::tropism::{Growing, TropismLaw};

/// Waves in one turn that are resolved. Of a law that knows no direction of its own all that is known along the directors has
/// waves 0 and ±1; products of three of these are still told apart.
const WAVES: usize = 3;

/// The shoot in the turning frame.
pub struct Corotating<'a, M: Model> {
    shoot: &'a Shoot<M>,
    pub(in crate::cycle) circle: Circle,
    solver: NewtonSolver,
    pub rod: Rod,
    pub rate: f64,
    /// REGR of every point of the zone, 1/s.
    regr: Vec<f64>,
    places: Vec<Growing>,
    /// Of every point, a column for every phase.
    stimuli: Vec<DMatrix<f64>>,
    pub(in crate::cycle) steady: Vec<Steady>,
    /// At the first phase.
    gradients: Vec<Vector3<f64>>,
}

impl<'a, M: Model> Corotating<'a, M> {
    /// The frame of a shoot with a strain (components 1 and 2 at every point of the zone, 1/m) and a rate (1/s). The shape of `rod`, of a
    /// shoot with as many points, is the initial guess of the equilibrium.
    pub fn new(shoot: &'a Shoot<M>, strain: &DVector<f64>, rate: f64, shape: Option<&Rod>) -> Result<Self, CycleError> {
        let (places, regr) = driven_points(shoot)?;
        let mut rod = shoot.state.rod.clone();
        let zone = rod.zone();
        let (what, points) = ("number of strains of the start", strain.len() / 2);
        ParameterError::unless(points == zone.len(), what, points as f64, "that of the points of the zone")?;
        ParameterError::unless(rate != 0.0 && rate.is_finite(), "rate of the start", rate, "not zero (1/s)")?;
        for (point, strain) in rod.points[zone].iter_mut().zip(strain.as_slice().chunks_exact(2)) {
            ParameterError::finite("strain of the start", strain[0] + strain[1])?;
            (point.intrinsic.x, point.intrinsic.y) = (strain[0], strain[1]);
        }
        if strain.amax() == 0.0 {
            return Err(CycleError::Stationary { strain: 0.0 });
        }
        if let Some(shape) = shape {
            take_shape(&mut rod, shape);
        }
        Ok(Self {
            shoot,
            circle: Circle::new(WAVES),
            solver: NewtonSolver::with_tolerance(PRECISE),
            rod,
            rate,
            regr,
            places,
            stimuli: Vec::new(),
            steady: Vec::new(),
            gradients: Vec::new(),
        })
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
        check_steady(self.law(), &SteadyState::of(self.shoot, &self.rod, &force))?;
        let m = self.law().size().stimuli;
        let mut stimuli = vec![DMatrix::zeros(m, self.circle.len()); self.places.len()];
        for (j, phase) in self.circle.phases.iter().enumerate() {
            let rod = turned(&self.rod, *phase);
            look(self.shoot, &rod, &force, |i, x| stimuli[i].column_mut(j).copy_from_slice(x));
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

    /// ν ẑ × u*/REGR − gradient, components 1 and 2.
    pub fn residual(&self) -> DVector<f64> {
        let turning = self.turning();
        DVector::from_fn(turning.len(), |k, _| self.rate * turning[k] / self.regr[k / 2] - self.gradients[k / 2][k % 2])
    }

    pub fn relative_residual(&self) -> f64 {
        let largest = self.gradients.iter().map(|gradient| gradient.norm()).fold(f64::MIN_POSITIVE, f64::max);
        self.residual().amax() / largest
    }

    /// The derivatives of the residual by the strain, and by the logarithm of the rate. None if the laws are singular.
    pub fn derivatives(&self) -> Result<Option<(DMatrix<f64>, DVector<f64>)>, CycleError> {
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
        Ok(Some((by_strain, by_rate * self.rate)))
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

    /// Refuses laws, loads or a scene that change in time.
    pub fn check_autonomous(&self) -> Result<(), CycleError> {
        check_autonomous(self.shoot, &self.rod)
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
pub fn quarter(pairs: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(pairs.len(), |k, _| if k % 2 == 0 { -pairs[k + 1] } else { pairs[k - 1] })
}
