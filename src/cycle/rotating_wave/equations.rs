//! Rotating waves as solutions of the extended system.

use nalgebra::{DMatrix, DVector};

use super::corotating::{Corotating, rotation_tangent};
use super::{RotatingWave, RotatingWaveSolver, WaveGuess};
use crate::cycle::disturbances::Disturbances;
use crate::cycle::equations::{Effort, Equations, Observation};
use crate::cycle::error::CycleError;
use crate::cycle::extended::{Border, Bordered, Jacobian, Symmetry, Unknowns};
use crate::cycle::map::phase_state::PhaseState;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::Root;

/// The unknowns of an initial guess.
pub fn unknowns(guess: &WaveGuess) -> Unknowns {
    let pairs = guess.strain.iter().flat_map(|strain| [strain.x, strain.y]);
    let strain = DVector::from_vec(pairs.collect());
    let start = PhaseState { strain, variables: DVector::zeros(0), slopes: Vec::new() };
    Unknowns { start, clock: guess.rate, forced: false, angle: 0.0, parameter: 0.0 }
}

impl Equations for RotatingWaveSolver {
    type Orbit = RotatingWave;
    type Evaluation<'a, M: Model + 'a> = Corotating<'a, M>;
    type Jacobian = DMatrix<f64>;

    // The matrix costs as much as an evaluation.
    const KEEP: f64 = 0.0;
    const FLOQUET: bool = false;

    fn of_mode<M: Model>(&self, _shoot: &Shoot<M>, root: &Root, amplitude: f64) -> Result<Unknowns, CycleError> {
        Ok(unknowns(&WaveGuess::of_mode(root, amplitude)))
    }

    fn of_orbit<M: Model>(&self, _shoot: &Shoot<M>, orbit: &RotatingWave) -> Result<Unknowns, CycleError> {
        Ok(unknowns(&orbit.as_guess()))
    }

    fn tolerance(&self) -> f64 {
        self.tolerance
    }

    fn max_iterations(&self) -> usize {
        self.max_iterations
    }

    fn extend_past<M: Model>(&self, _shoot: &Shoot<M>, _at: &mut Unknowns) -> Result<bool, CycleError> {
        Ok(false)
    }

    fn evaluate<'a, M: Model>(
        &self,
        shoot: &'a Shoot<M>,
        at: &Unknowns,
        rods: Vec<Rod>,
    ) -> Result<Corotating<'a, M>, CycleError> {
        let mut here = Corotating::new(shoot, &at.start.strain, at.clock, rods.first())?;
        here.evaluate()?;
        Ok(here)
    }

    fn rods<M: Model>(here: &Corotating<M>) -> Vec<Rod> {
        vec![here.rod.clone()]
    }

    fn equilibria<M: Model>(_here: &Corotating<M>) -> usize {
        1
    }

    fn residual<M: Model>(&self, here: &Corotating<M>, _at: &Unknowns) -> (DVector<f64>, f64) {
        (here.residual(), here.relative_residual())
    }

    fn check<M: Model>(&self, here: &Corotating<M>, _at: &Unknowns) -> Result<(), CycleError> {
        here.check_autonomous()?;
        here.check_axis()
    }

    fn linearise<M: Model>(
        &self,
        here: &mut Corotating<M>,
        at: &Unknowns,
    ) -> Result<Option<(DMatrix<f64>, Vec<Symmetry>)>, CycleError> {
        let tangent = rotation_tangent(&at.start.strain);
        // A shift in time is a rotation.
        Ok(here.derivatives()?.map(|(by_strain, column)| (by_strain, vec![Symmetry { tangent, column }])))
    }

    fn orbit<M: Model>(
        &self,
        here: Corotating<M>,
        at: &Unknowns,
        _known: Option<Bordered<DMatrix<f64>>>,
        effort: Effort,
    ) -> Result<(RotatingWave, Vec<DVector<f64>>), CycleError> {
        here.check_axis()?;
        let Effort { iterations, residual, .. } = effort;
        let orbit = RotatingWave { rate: here.rate, rod: here.rod, iterations, residual };
        Ok((orbit, vec![rotation_tangent(&at.start.strain)]))
    }

    fn check_resolution(&self, _orbit: &RotatingWave) -> Result<(), CycleError> {
        Ok(())
    }

    fn refined(&self) -> Option<Self> {
        // There is no grid in time.
        None
    }

    fn on_finer_grid(&self, at: Unknowns) -> Unknowns {
        at
    }

    fn observe<M: Model>(
        &self,
        orbit: &RotatingWave,
        shoot: &Shoot<M>,
        count: usize,
    ) -> Result<Observation, CycleError> {
        let found = orbit.roots(shoot, count)?;
        let pairs = found.roots.iter().flat_map(|root| {
            let conjugate = (root.value.im > 0.0).then(|| root.value.conj());
            [Some(root.value), conjugate].into_iter().flatten()
        });
        let exponents = Disturbances::Spatial(pairs.collect());
        Ok(Observation { excursion: orbit.radius(), period: orbit.period(), exponents, trivial: found.trivial })
    }
}

impl Jacobian for DMatrix<f64> {
    fn solve(
        &self,
        border: &[Border],
        residual: &DVector<f64>,
        conditions: &[f64],
    ) -> Result<Option<(DVector<f64>, DVector<f64>)>, CycleError> {
        let (n, more) = (residual.len(), border.len());
        let mut matrix = self.clone().resize(n + more, n + more, 0.0);
        let mut right = -residual.clone().resize_vertically(n + more, 0.0);
        for (k, Border { column, row, corner }) in border.iter().enumerate() {
            matrix.view_mut((0, n + k), (n, 1)).copy_from(column);
            matrix.view_mut((n + k, 0), (1, row.len())).copy_from(&row.transpose());
            matrix[(n + k, n + k)] = *corner;
            right[n + k] = conditions[k];
        }
        let found = matrix.lu().solve(&right);
        Ok(found.map(|found| (found.rows(0, n).clone_owned(), found.rows(n, more).clone_owned())))
    }
}
