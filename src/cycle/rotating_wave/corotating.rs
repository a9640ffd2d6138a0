//! The equations of a shoot in the corotating frame of a rotating wave, where the wave is
//! stationary.
//!
//! The residual at each material point is ν ẑ × u*/REGR − gradient. The shape is rotated to seven
//! phases, where the laws sense it, and harmonic balance gives the periodic variables. The laws
//! therefore need not declare how their variables rotate.

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use super::{RotatingWave, RotatingWaveSolver, unknowns};
use crate::cycle::disturbances::Disturbances;
use crate::cycle::equations::{
    Computed, Effort, Equations, EvaluatedEquations, Newton, OBSERVED, Observation,
};
use crate::cycle::error::{CycleError, Outcome};
use crate::cycle::extended::{
    Border, BorderedSystem, DIFFERENCE, OrbitUnknowns, StateJacobian, Symmetry,
};
use crate::cycle::harmonic::{HarmonicBalance, HarmonicPoint};
use crate::cycle::map::{PRECISE, bends, check_gradients, driven_points};
use crate::cycle::phase_grid::{PhaseGrid, WAVES};
use crate::cycle::rotated::rotated;
use crate::cycle::sensitivity::stimuli_by_strain;
use crate::cycle::symmetry::{check_autonomous, check_equilibrium, check_tropism, least_gradient};
use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
use crate::error::{ParameterError, ensure};
use crate::linearisation::{AnalyticMatrix, SteadyLaws, check_steady, visit_stimuli};
use crate::load::InternalForce;
use crate::model::{Model, TropismLaw, check_unsupported};
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::Root;

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
    /// The points of the zone with their periodic variables.
    pub(in crate::cycle) points: Vec<HarmonicPoint>,
    /// Growth gradients at the first phase.
    gradients: Vec<Vector3<f64>>,
}

impl<'a, M: Model> Corotating<'a, M> {
    /// The frame of a shoot with a strain (components 1 and 2 at each point of the zone, 1/m) and a
    /// rate (rad/s, counterclockwise positive), with the equilibrium, and with stimuli and growth
    /// gradients over a rotation. `shape` is the initial guess of the equilibrium.
    pub fn new(
        shoot: &'a Shoot<M>,
        strain: &DVector<f64>,
        rate: f64,
        shape: Option<&Rod>,
    ) -> Result<Self, CycleError> {
        check_unsupported(&shoot.model)?;
        let (places, regr) = driven_points(shoot)?;
        let mut rod = shoot.state.rod.clone();
        let zone = rod.zone();
        let (what, counts) = (
            "number of strains of the initial guess",
            [strain.len() / 2, zone.len()],
        );
        ParameterError::count(what, counts, "that of the points of the zone")?;
        ParameterError::unless(
            rate != 0.0 && rate.is_finite(),
            "rate of the initial guess",
            rate,
            "not zero (rad/s)",
        )?;
        for (point, strain) in rod.points[zone]
            .iter_mut()
            .zip(strain.as_slice().chunks_exact(2))
        {
            ParameterError::finite("strain of the initial guess", strain[0] + strain[1], "1/m")?;
            (point.intrinsic.x, point.intrinsic.y) = (strain[0], strain[1]);
        }
        ensure(strain.amax() != 0.0, CycleError::Stationary { strain: 0.0 })?;
        if let Some(shape) = shape {
            rod.guess_shape(shape);
        }
        let (material, law, environment) = (
            shoot.model.constitutive(),
            shoot.model.tropism(),
            shoot.environment(),
        );
        let force = InternalForce::of(&rod, shoot.model.load(), &environment);
        let _ = NewtonSolver::with_tolerance(PRECISE).equilibrate(&mut rod, material, &force)?;
        // The steady variables are the initial guess of the periodic ones.
        check_steady(law, &SteadyLaws::of(shoot, &rod, &force))?;
        let phases = PhaseGrid::new(WAVES);
        let mut stimuli = vec![DMatrix::zeros(law.size().stimuli, phases.len()); places.len()];
        for (j, phase) in phases.angles.iter().enumerate() {
            let rod = rotated(&rod, *phase);
            visit_stimuli(shoot, &rod, &force, |i, _, x| {
                stimuli[i].column_mut(j).copy_from_slice(x)
            });
        }
        let balance = HarmonicBalance::new(law, &phases, rate);
        let points = places
            .into_iter()
            .zip(stimuli)
            .map(|(at, stimuli)| balance.solve(at, stimuli));
        let points: Vec<_> = points.collect::<Result<_, _>>()?;
        let gradients: Vec<_> = points
            .iter()
            .map(|point| balance.gradient(point, 0))
            .collect();
        check_gradients(&gradients)?;
        Ok(Self {
            shoot,
            phases,
            rod,
            rate,
            regr,
            points,
            gradients,
        })
    }

    /// Harmonic balance at a rate of rotation (rad/s).
    fn balance_at(&self, rate: f64) -> HarmonicBalance<'_> {
        HarmonicBalance::new(self.shoot.model.tropism(), &self.phases, rate)
    }

    /// ẑ × u*: derivative of the strain by the angle of rotation.
    pub fn turning(&self) -> DVector<f64> {
        rotation_tangent(&bends(&self.rod))
    }

    /// Derivatives of the stimuli of each point at all phases by the strain.
    pub fn responses(&self) -> Result<DMatrix<f64>, CycleError> {
        let force = InternalForce::of(
            &self.rod,
            self.shoot.model.load(),
            &self.shoot.environment(),
        );
        stimuli_by_strain(self.shoot, &self.rod, &force, &self.phases.angles)
    }

    /// The characteristic matrix M(λ) = λ + ν ẑ × − REGR ∂gradient, and its derivative by λ. None
    /// if the laws are singular.
    pub(in crate::cycle) fn matrix(
        &self,
        z: Complex<f64>,
        responses: &DMatrix<f64>,
    ) -> Option<AnalyticMatrix> {
        let mut out = AnalyticMatrix::lambda(z, 2 * self.points.len());
        let balance = self.balance_at(self.rate);
        let rows = responses.nrows() / self.points.len();
        // Points with the same derivatives of the laws have the same response.
        let mut known: Option<(usize, [DMatrix<Complex<f64>>; 2])> = None;
        for (i, point) in self.points.iter().enumerate() {
            out.value[(2 * i, 2 * i + 1)] -= Complex::from(self.rate);
            out.value[(2 * i + 1, 2 * i)] += Complex::from(self.rate);
            let parts = match known.take() {
                Some((other, parts)) if point.is_like(&self.points[other]) => (other, parts),
                _ => (i, balance.response(point, z)?),
            };
            // One real product for components 1 and 2 of value and derivative, real and imaginary
            // parts.
            let four = |row: usize, column: usize| {
                let z = parts.1[row / 4][(row % 2, column)];
                if row & 2 == 0 { z.re } else { z.im }
            };
            let by_strain =
                DMatrix::from_fn(8, rows, four) * responses.rows(i * rows, rows) * self.regr[i];
            for (k, matrix) in [&mut out.value, &mut out.derivative]
                .into_iter()
                .enumerate()
            {
                let mut own = matrix.rows_mut(2 * i, 2);
                own -= by_strain
                    .rows(4 * k, 2)
                    .zip_map(&by_strain.rows(4 * k + 2, 2), Complex::new);
            }
            known = Some(parts);
        }
        Some(out)
    }

    /// Returns an error unless the shoot is invariant under rotations: the rotated shape is in
    /// equilibrium at all phases, and the growth gradients rotate with it.
    pub fn check_axis(&self) -> Result<(), CycleError> {
        for j in 1..self.phases.len() {
            let phase = self.phases.angles[j];
            check_equilibrium(self.shoot, &self.rod, phase)?;
            let balance = self.balance_at(self.rate);
            let (sine, cosine) = phase.sin_cos();
            let least = least_gradient(self.rod.length());
            let largest = self
                .gradients
                .iter()
                .map(|gradient| gradient.norm())
                .fold(least, f64::max);
            for (point, now) in self.points.iter().zip(&self.gradients) {
                let expected = Vector3::new(
                    cosine * now.x - sine * now.y,
                    sine * now.x + cosine * now.y,
                    now.z,
                );
                check_tropism((balance.gradient(point, j) - expected).norm() / largest)?;
            }
        }
        Ok(())
    }
}

impl Equations for RotatingWaveSolver {
    type Orbit = RotatingWave;
    type Jacobian = DMatrix<f64>;
    type Evaluation<'a, M: Model + 'a> = Corotating<'a, M>;
    const FLOQUET: bool = false;

    fn newton(&self) -> Newton {
        // A Jacobian costs as much as an evaluation, and is computed in each iteration. An
        // iteration has one equilibrium, so that their number is limited as well.
        Newton {
            tolerance: self.tolerance,
            max_iterations: self.max_iterations,
            max_work: usize::MAX,
            keep: 0.0,
        }
    }

    fn of_mode<M: Model>(
        &self,
        _shoot: &Shoot<M>,
        root: &Root,
        amplitude: f64,
    ) -> Outcome<OrbitUnknowns> {
        // The strain in one plane is Re[ψ exp(iωt)], that in the other one is a quarter of a period
        // later.
        let pair = |psi: &Vector3<Complex<f64>>| {
            let psi = if psi.x.norm() > psi.y.norm() {
                psi.x
            } else {
                psi.y
            };
            [psi.re * amplitude, psi.im * amplitude]
        };
        Ok(unknowns(
            DVector::from_vec(root.strain.iter().flat_map(pair).collect()),
            root.value.im,
        ))
    }

    fn of_orbit<M: Model>(
        &self,
        _shoot: &Shoot<M>,
        orbit: &RotatingWave,
    ) -> Outcome<OrbitUnknowns> {
        Ok(unknowns(bends(&orbit.rod), orbit.rate))
    }

    fn evaluate<'a, M: Model>(
        &self,
        shoot: &'a Shoot<M>,
        at: &OrbitUnknowns,
        rods: Vec<Rod>,
    ) -> Computed<'a, Self, M> {
        Corotating::new(shoot, &at.start.strain, at.period_or_rate, rods.first())
    }

    fn observe<M: Model>(&self, orbit: &RotatingWave, shoot: &Shoot<M>) -> Outcome<Observation> {
        let found = orbit.roots(shoot, OBSERVED)?;
        let conjugate = |value: Complex<f64>| (value.im > 0.0).then(|| value.conj());
        let pairs = found
            .roots
            .iter()
            .flat_map(|root| [Some(root.value), conjugate(root.value)])
            .flatten();
        let exponents = Disturbances::Spatial(pairs.collect());
        Ok(Observation {
            excursion: orbit.radius(),
            period: orbit.period(),
            exponents,
            trivial: found.trivial,
        })
    }
}

impl<M: Model> EvaluatedEquations<RotatingWaveSolver> for Corotating<'_, M> {
    fn rods(&self) -> Vec<Rod> {
        vec![self.rod.clone()]
    }

    fn equilibria(&self) -> usize {
        1
    }

    fn residual(&self) -> (DVector<f64>, f64) {
        let turning = self.turning();
        let difference =
            |k: usize| self.rate * turning[k] / self.regr[k / 2] - self.gradients[k / 2][k % 2];
        let out = DVector::from_fn(turning.len(), |k, _| difference(k));
        let largest = self
            .gradients
            .iter()
            .map(|gradient| gradient.norm())
            .fold(f64::MIN_POSITIVE, f64::max);
        let relative = out.amax() / largest;
        (out, relative)
    }

    fn check(&self) -> Outcome {
        check_autonomous(self.shoot, &self.rod)?;
        self.check_axis()
    }

    fn linearise(&mut self) -> Outcome<Option<(DMatrix<f64>, Vec<Symmetry>)>> {
        let n = 2 * self.points.len();
        let Some(inner) = self.matrix(Complex::ZERO, &self.responses()?) else {
            return Ok(None);
        };
        let by_strain = DMatrix::from_fn(n, n, |row, column| {
            inner.value[(row, column)].re / self.regr[row / 2]
        });
        // Central differences of the gradients by the rate, for the same shape.
        let change = DIFFERENCE * self.rate;
        let turning = self.turning();
        let mut by_rate = DVector::from_fn(n, |k, _| turning[k] / self.regr[k / 2]);
        for sign in [1.0, -1.0] {
            let balance = self.balance_at(self.rate + sign * change);
            for (i, point) in self.points.iter().enumerate() {
                let gradient =
                    balance.gradient(&balance.solve(point.at, point.stimuli.clone())?, 0);
                for c in 0..2 {
                    by_rate[2 * i + c] -= sign * gradient[c] / (2.0 * change);
                }
            }
        }
        // A shift in time is a rotation.
        Ok(Some((
            by_strain,
            vec![Symmetry {
                tangent: turning,
                column: by_rate * self.rate,
            }],
        )))
    }

    fn symmetry_tangents(&self) -> Vec<DVector<f64>> {
        vec![self.turning()]
    }

    fn into_orbit(
        self,
        _: Option<BorderedSystem<DMatrix<f64>>>,
        effort: Effort,
    ) -> Outcome<RotatingWave> {
        self.check_axis()?;
        let Effort {
            iterations,
            residual,
            ..
        } = effort;
        Ok(RotatingWave {
            rate: self.rate,
            rod: self.rod,
            iterations,
            residual,
        })
    }
}

/// A dense Jacobian, solved by LU factorisation of the bordered matrix.
impl StateJacobian for DMatrix<f64> {
    fn solve(&self, border: &[Border], residuals: &DVector<f64>) -> Outcome<Option<DVector<f64>>> {
        let (n, more) = (residuals.len() - border.len(), border.len());
        let mut matrix = self.clone().resize(n + more, n + more, 0.0);
        let mut right = residuals.clone();
        right.rows_mut(0, n).neg_mut();
        for (
            k,
            Border {
                column,
                row,
                corner,
            },
        ) in border.iter().enumerate()
        {
            matrix.view_mut((0, n + k), (n, 1)).copy_from(column);
            matrix
                .view_mut((n + k, 0), (1, row.len()))
                .copy_from(&row.transpose());
            matrix[(n + k, n + k)] = *corner;
        }
        Ok(matrix.lu().solve(&right))
    }
}

/// Derivative of pairs by the angle of rotation: each pair rotated by π/2.
pub fn rotation_tangent(pairs: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(pairs.len(), |k, _| {
        if k % 2 == 0 {
            -pairs[k + 1]
        } else {
            pairs[k - 1]
        }
    })
}
