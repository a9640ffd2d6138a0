//! The equations of a shoot in the corotating frame of a rotating wave, where the wave is stationary.
//!
//! The residual at each material point is ν ẑ × u*/REGR − gradient. The shape is rotated to seven phases, where
//! the laws sense it, and harmonic balance gives the periodic variables. The laws therefore need not declare how
//! their variables rotate.

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use crate::cycle::error::CycleError;
use crate::cycle::extended::DIFFERENCE;
use crate::cycle::harmonic::{HarmonicBalance, HarmonicVariables};
use crate::cycle::map::{PRECISE, bends, check_gradients, driven_points};
use crate::cycle::phase_grid::{PhaseGrid, WAVES};
use crate::cycle::rotated::rotated;
use crate::cycle::sensitivity::stimuli_by_strain;
use crate::cycle::symmetry::{check_equilibrium, check_tropism, least_gradient};
use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
use crate::error::ParameterError;
use crate::linearisation::{AnalyticMatrix, SteadyLaws, check_steady, visit_stimuli};
use crate::load::InternalForce;
use crate::model::{Model, check_unsupported};
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::tropism::{Growing, TropismLaw};

/// Derivatives by the strain, and by the logarithm of the rate.
type DerivativesOfResidual = (DMatrix<f64>, DVector<f64>);

/// The shoot in the corotating frame.
pub struct Corotating<'a, M: Model> {
    pub(super) shoot: &'a Shoot<M>,
    pub(in crate::cycle) phases: PhaseGrid,
    /// Rod in equilibrium at the first phase.
    pub rod: Rod,
    /// Rate of rotation ν, rad/s, counterclockwise positive.
    pub rate: f64,
    /// REGR of each point of the zone, 1/s.
    regr: Vec<f64>,
    places: Vec<Growing>,
    /// Stimuli of each point, a column for each phase.
    stimuli: Vec<DMatrix<f64>>,
    /// Periodic variables of each point.
    pub(in crate::cycle) periodic: Vec<HarmonicVariables>,
    /// Growth gradients at the first phase.
    gradients: Vec<Vector3<f64>>,
}

impl<'a, M: Model> Corotating<'a, M> {
    /// The frame of a shoot with a strain (components 1 and 2 at each point of the zone, 1/m) and a rate (rad/s,
    /// counterclockwise positive), with the equilibrium, and with stimuli and growth gradients over a rotation.
    /// `shape` is the initial guess of the equilibrium.
    pub fn new(shoot: &'a Shoot<M>, strain: &DVector<f64>, rate: f64, shape: Option<&Rod>) -> Result<Self, CycleError> {
        check_unsupported(&shoot.model)?;
        let (places, regr) = driven_points(shoot)?;
        let mut rod = shoot.state.rod.clone();
        let zone = rod.zone();
        let (what, counts) = ("number of strains of the initial guess", [strain.len() / 2, zone.len()]);
        ParameterError::count(what, counts, "that of the points of the zone")?;
        ParameterError::unless(rate != 0.0 && rate.is_finite(), "rate of the initial guess", rate, "not zero (rad/s)")?;
        for (point, strain) in rod.points[zone].iter_mut().zip(strain.as_slice().chunks_exact(2)) {
            ParameterError::finite("strain of the initial guess", strain[0] + strain[1], "1/m")?;
            (point.intrinsic.x, point.intrinsic.y) = (strain[0], strain[1]);
        }
        if strain.amax() == 0.0 {
            return Err(CycleError::Stationary { strain: 0.0 });
        }
        if let Some(shape) = shape {
            rod.guess_shape(shape);
        }
        let (material, law, environment) = (shoot.model.constitutive(), shoot.model.tropism(), shoot.environment());
        let force = InternalForce::of(&rod, shoot.model.load(), &environment);
        let _ = NewtonSolver::with_tolerance(PRECISE).equilibrate(&mut rod, material, &force)?;
        // The steady variables are the initial guess of the periodic ones.
        check_steady(law, &SteadyLaws::of(shoot, &rod, &force))?;
        let phases = PhaseGrid::new(WAVES);
        let mut stimuli = vec![DMatrix::zeros(law.size().stimuli, phases.len()); places.len()];
        for (j, phase) in phases.angles.iter().enumerate() {
            let rod = rotated(&rod, *phase);
            visit_stimuli(shoot, &rod, &force, |i, _, x| stimuli[i].column_mut(j).copy_from_slice(x));
        }
        let balance = HarmonicBalance::new(law, &phases, rate);
        let periodic = balance.solve_all(&places, &stimuli)?;
        let gradients = balance.gradients(&places, &periodic, &stimuli, 0);
        check_gradients(gradients.iter())?;
        Ok(Self { shoot, phases, rod, rate, regr, places, stimuli, periodic, gradients })
    }

    /// Harmonic balance at a rate of rotation (rad/s).
    fn balance_at(&self, rate: f64) -> HarmonicBalance<'_, M::Tropism> {
        HarmonicBalance::new(self.shoot.model.tropism(), &self.phases, rate)
    }

    /// ẑ × u*: derivative of the strain by the angle of rotation.
    pub fn turning(&self) -> DVector<f64> {
        rotation_tangent(&bends(&self.rod))
    }

    /// ν ẑ × u*/REGR − gradient, components 1 and 2.
    pub fn difference(&self) -> DVector<f64> {
        let turning = self.turning();
        DVector::from_fn(turning.len(), |k, _| self.rate * turning[k] / self.regr[k / 2] - self.gradients[k / 2][k % 2])
    }

    /// The largest residual, relative to the largest gradient.
    pub fn relative_residual(&self) -> f64 {
        let largest = self.gradients.iter().map(|gradient| gradient.norm()).fold(f64::MIN_POSITIVE, f64::max);
        self.difference().amax() / largest
    }

    /// Derivatives of the residual by the strain, and by the logarithm of the rate. None if the laws are singular.
    pub fn derivatives(&self) -> Result<Option<DerivativesOfResidual>, CycleError> {
        let n = 2 * self.places.len();
        let Some(inner) = self.matrix(Complex::ZERO, &self.responses()?) else { return Ok(None) };
        let by_strain = DMatrix::from_fn(n, n, |row, column| inner.value[(row, column)].re / self.regr[row / 2]);
        // Central differences of the gradients by the rate, for the same shape.
        let change = DIFFERENCE * self.rate;
        let turning = self.turning();
        let mut by_rate = DVector::from_fn(n, |k, _| turning[k] / self.regr[k / 2]);
        for sign in [1.0, -1.0] {
            let balance = self.balance_at(self.rate + sign * change);
            let periodic = balance.solve_all(&self.places, &self.stimuli)?;
            for (i, gradient) in balance.gradients(&self.places, &periodic, &self.stimuli, 0).iter().enumerate() {
                for c in 0..2 {
                    by_rate[2 * i + c] -= sign * gradient[c] / (2.0 * change);
                }
            }
        }
        Ok(Some((by_strain, by_rate * self.rate)))
    }

    /// Derivatives of the stimuli of each point at all phases by the strain.
    pub fn responses(&self) -> Result<DMatrix<f64>, CycleError> {
        let force = InternalForce::of(&self.rod, self.shoot.model.load(), &self.shoot.environment());
        stimuli_by_strain(self.shoot, &self.rod, &force, &self.phases.angles)
    }

    /// The characteristic matrix M(λ) = λ + ν ẑ × − REGR ∂gradient, and its derivative by λ. None if the
    /// laws are singular.
    pub(in crate::cycle) fn matrix(&self, z: Complex<f64>, responses: &DMatrix<f64>) -> Option<AnalyticMatrix> {
        let mut out = AnalyticMatrix::lambda(z, 2 * self.places.len());
        let balance = self.balance_at(self.rate);
        let rows = responses.nrows() / self.places.len();
        // Points with the same derivatives of the laws have the same response.
        let mut known: Option<(usize, [DMatrix<Complex<f64>>; 2])> = None;
        for i in 0..self.places.len() {
            out.value[(2 * i, 2 * i + 1)] -= Complex::from(self.rate);
            out.value[(2 * i + 1, 2 * i)] += Complex::from(self.rate);
            let parts = match known.take() {
                Some((other, parts)) if self.periodic[i].is_like(&self.periodic[other]) => (other, parts),
                _ => (i, balance.response(&self.periodic[i], z)?),
            };
            // One real product for components 1 and 2 of value and derivative, real and imaginary parts.
            let four = |row: usize, column: usize| {
                let z = parts.1[row / 4][(row % 2, column)];
                if row & 2 == 0 { z.re } else { z.im }
            };
            let by_strain = DMatrix::from_fn(8, rows, four) * responses.rows(i * rows, rows) * self.regr[i];
            for (k, matrix) in [&mut out.value, &mut out.derivative].into_iter().enumerate() {
                let mut own = matrix.rows_mut(2 * i, 2);
                own -= by_strain.rows(4 * k, 2).zip_map(&by_strain.rows(4 * k + 2, 2), Complex::new);
            }
            known = Some(parts);
        }
        Some(out)
    }

    /// Returns an error unless the shoot is invariant under rotations: the rotated shape is in equilibrium at all
    /// phases, and the growth gradients rotate with it.
    pub fn check_axis(&self) -> Result<(), CycleError> {
        for j in 1..self.phases.len() {
            let phase = self.phases.angles[j];
            check_equilibrium(self.shoot, &self.rod, phase)?;
            let balance = self.balance_at(self.rate);
            let (sine, cosine) = phase.sin_cos();
            let least = least_gradient(self.rod.length());
            let largest = self.gradients.iter().map(|gradient| gradient.norm()).fold(least, f64::max);
            for (then, now) in
                balance.gradients(&self.places, &self.periodic, &self.stimuli, j).iter().zip(&self.gradients)
            {
                let expected = Vector3::new(cosine * now.x - sine * now.y, sine * now.x + cosine * now.y, now.z);
                check_tropism((then - expected).norm() / largest)?;
            }
        }
        Ok(())
    }
}

/// Derivative of pairs by the angle of rotation: each pair rotated by π/2.
pub fn rotation_tangent(pairs: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(pairs.len(), |k, _| if k % 2 == 0 { -pairs[k + 1] } else { pairs[k - 1] })
}
