//! The equations of a rotating wave as an extended system: the unknowns are the strain and the rate of rotation.

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use super::corotating::Corotating;
use super::{RotatingWave, RotatingWaveSolver, unknowns};
use crate::cycle::disturbances::Disturbances;
use crate::cycle::equations::{Computed, Effort, Equations, EvaluatedEquations, Newton, OBSERVED, Observation};
use crate::cycle::error::CycleError;
use crate::cycle::extended::{Border, BorderedSystem, OrbitUnknowns, StateJacobian, Symmetry};
use crate::cycle::symmetry::check_autonomous;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::Root;

impl Equations for RotatingWaveSolver {
    type Orbit = RotatingWave;
    type Jacobian = DMatrix<f64>;
    type Evaluation<'a, M: Model + 'a> = Corotating<'a, M>;
    const FLOQUET: bool = false;

    fn newton(&self) -> Newton {
        // A Jacobian costs as much as an evaluation, and is computed in each iteration. An iteration has one
        // equilibrium, so that their number is limited as well.
        Newton { tolerance: self.tolerance, max_iterations: self.max_iterations, max_work: usize::MAX, keep: 0.0 }
    }

    fn of_mode<M: Model>(&self, _shoot: &Shoot<M>, root: &Root, amplitude: f64) -> Result<OrbitUnknowns, CycleError> {
        // The strain in one plane is Re[ψ exp(iωt)], that in the other one is a quarter of a period later.
        let pair = |psi: &Vector3<Complex<f64>>| {
            let psi = if psi.x.norm() > psi.y.norm() { psi.x } else { psi.y };
            [psi.re * amplitude, psi.im * amplitude]
        };
        Ok(unknowns(DVector::from_vec(root.strain.iter().flat_map(pair).collect()), root.value.im))
    }

    fn of_orbit<M: Model>(&self, _shoot: &Shoot<M>, orbit: &RotatingWave) -> Result<OrbitUnknowns, CycleError> {
        Ok(orbit.unknowns())
    }

    fn evaluate<'a, M: Model>(&self, shoot: &'a Shoot<M>, at: &OrbitUnknowns, rods: Vec<Rod>) -> Computed<'a, Self, M> {
        Corotating::new(shoot, &at.start.strain, at.clock, rods.first())
    }

    fn observe<M: Model>(&self, orbit: &RotatingWave, shoot: &Shoot<M>) -> Result<Observation, CycleError> {
        let found = orbit.roots(shoot, OBSERVED)?;
        let pairs = found.roots.iter().flat_map(|root| {
            let conjugate = (root.value.im > 0.0).then(|| root.value.conj());
            [Some(root.value), conjugate].into_iter().flatten()
        });
        let exponents = Disturbances::Spatial(pairs.collect());
        Ok(Observation { excursion: orbit.radius(), period: orbit.period(), exponents, trivial: found.trivial })
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
        (self.difference(), self.relative_residual())
    }

    fn check(&self) -> Result<(), CycleError> {
        check_autonomous(self.shoot, &self.rod)?;
        self.check_axis()
    }

    fn linearise(&mut self) -> Result<Option<(DMatrix<f64>, Vec<Symmetry>)>, CycleError> {
        // A shift in time is a rotation.
        let tangent = self.turning();
        Ok(self.derivatives()?.map(|(by_strain, column)| (by_strain, vec![Symmetry { tangent, column }])))
    }

    fn into_orbit(
        self,
        _known: Option<BorderedSystem<DMatrix<f64>>>,
        effort: Effort,
    ) -> Result<(RotatingWave, Vec<DVector<f64>>), CycleError> {
        self.check_axis()?;
        let symmetry_tangents = vec![self.turning()];
        let Effort { iterations, residual, .. } = effort;
        Ok((RotatingWave { rate: self.rate, rod: self.rod, iterations, residual }, symmetry_tangents))
    }
}

/// A dense Jacobian, solved by LU factorisation of the bordered matrix.
impl StateJacobian for DMatrix<f64> {
    fn solve(&self, border: &[Border], residuals: &DVector<f64>) -> Result<Option<DVector<f64>>, CycleError> {
        let (n, more) = (residuals.len() - border.len(), border.len());
        let mut matrix = self.clone().resize(n + more, n + more, 0.0);
        let mut right = residuals.clone();
        right.rows_mut(0, n).neg_mut();
        for (k, Border { column, row, corner }) in border.iter().enumerate() {
            matrix.view_mut((0, n + k), (n, 1)).copy_from(column);
            matrix.view_mut((n + k, 0), (1, row.len())).copy_from(&row.transpose());
            matrix[(n + k, n + k)] = *corner;
        }
        Ok(matrix.lu().solve(&right))
    }
}
