//! Circular orbits as places on a branch.

use nalgebra::{DMatrix, DVector, Vector3};

use super::follow::{Condition, Corrected, Follow, Look, Same, Unknowns};
use crate::cycle::circular::{CircularOrbit, CircularSolver, Problem, Turning, quarter};
use crate::cycle::error::CycleError;
use crate::cycle::map::state::Start;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::stability::Root;

fn unknowns(turning: &Turning, parameter: f64) -> Unknowns {
    let pairs = turning.strain.iter().flat_map(|strain| [strain.x, strain.y]);
    let strain = DVector::from_vec(pairs.collect());
    let start = Start { strain, variables: DVector::zeros(0), slopes: Vec::new() };
    Unknowns { start, clock: turning.rate, angle: 0.0, parameter }
}

fn turning(at: &Unknowns) -> Turning {
    let pairs = at.start.strain.as_slice().chunks(2);
    Turning { strain: pairs.map(|pair| Vector3::new(pair[0], pair[1], 0.0)).collect(), rate: at.clock }
}

impl Follow for CircularSolver {
    type Orbit = CircularOrbit;

    const MULTIPLIED: bool = false;

    fn small<M: Model>(
        &self,
        _shoot: &Shoot<M>,
        root: &Root,
        amplitude: f64,
        parameter: f64,
    ) -> Result<Unknowns, CycleError> {
        Ok(unknowns(&Turning::of_mode(root, amplitude), parameter))
    }

    fn known<M: Model>(
        &self,
        _shoot: &Shoot<M>,
        orbit: &CircularOrbit,
        parameter: f64,
    ) -> Result<Unknowns, CycleError> {
        Ok(unknowns(&orbit.as_start(), parameter))
    }

    fn correct<M: Model>(
        &self,
        family: &mut impl FnMut(f64) -> Result<Shoot<M>, CycleError>,
        mut at: Unknowns,
        condition: &Condition,
    ) -> Result<Corrected<CircularOrbit, M>, CycleError> {
        let n = at.start.strain.len();
        let (mut iterations, mut last) = (0, f64::INFINITY);
        loop {
            let astray = |error: CycleError| error.after(iterations, last);
            let shoot = family(at.parameter).map_err(astray)?;
            let mut problem = Problem::new(&shoot, &turning(&at)).map_err(astray)?;
            problem.evaluate().map_err(astray)?;
            let residual = problem.relative_residual();
            if residual <= self.tolerance {
                problem.check_axis()?;
                let (rate, rod) = (problem.rate, problem.rod);
                let orbit = CircularOrbit { rate, rod, iterations, residual };
                let same = Same { directions: vec![quarter(&at.start.strain)] };
                return Ok(Corrected { orbit, unknowns: at, same, shoot });
            }
            let failed = || CycleError::NotConverged { iterations, residual };
            if iterations == self.max_iterations || !residual.is_finite() {
                return Err(failed());
            }
            let (by_strain, by_rate) = problem.derivatives()?.ok_or_else(failed)?;
            let mut beside = |parameter: f64| {
                let shoot = family(parameter)?;
                let mut beside = Problem::new(&shoot, &turning(&at))?;
                beside.evaluate()?;
                Ok::<_, CycleError>(beside.residual())
            };
            let [before, after] = condition.beside(at.parameter);
            let by_parameter = (beside(after)? - beside(before)?) / (after - before);
            let mut matrix = DMatrix::zeros(n + 2, n + 2);
            matrix.view_mut((0, 0), (n, n)).copy_from(&by_strain);
            matrix.view_mut((0, n), (n, 1)).copy_from(&by_rate);
            matrix.view_mut((0, n + 1), (n, 1)).copy_from(&by_parameter);
            let phase = condition.phase(0).cloned().unwrap_or_else(|| problem.phase());
            matrix.view_mut((n, 0), (1, n)).copy_from(&phase.transpose());
            matrix.view_mut((n + 1, 0), (1, n)).copy_from(&condition.state.transpose());
            matrix[(n + 1, n + 1)] = condition.parameter;
            let mut right = DVector::zeros(n + 2);
            right.rows_mut(0, n).copy_from(&-problem.residual());
            right[n] = condition.phase_left(0, &at);
            right[n + 1] = condition.left(&at);
            let change = matrix.lu().solve(&right).filter(|x| x.iter().all(|x| x.is_finite())).ok_or_else(failed)?;
            at.start.strain += change.rows(0, n);
            at.clock += change[n];
            at.parameter = condition.fixed.unwrap_or(at.parameter + change[n + 1]);
            (iterations, last) = (iterations + 1, residual);
        }
    }

    fn refined(&self) -> Option<Self> {
        // A circle has no intervals.
        None
    }

    fn on_finer_grid(&self, at: Unknowns) -> Unknowns {
        at
    }

    fn look<M: Model>(&self, orbit: &CircularOrbit, shoot: &Shoot<M>, count: usize) -> Result<Look, CycleError> {
        let found = orbit.roots(shoot, count)?;
        let pairs = found.roots.iter().flat_map(|root| {
            let conjugate = (root.value.im > 0.0).then(|| root.value.conj());
            [Some(root.value), conjugate].into_iter().flatten()
        });
        let exponents = [pairs.collect(), Vec::new()];
        Ok(Look { excursion: orbit.radius(), period: orbit.period(), exponents, trivial: found.trivial })
    }
}
