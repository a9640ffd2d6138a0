//! Swings as places on a branch.

use nalgebra::DVector;

use super::follow::{Condition, Corrected, Follow, Look, Same, Unknowns};
use crate::cycle::autonomous::check_autonomous;
use crate::cycle::error::CycleError;
use crate::cycle::map::grid::Grid;
use crate::cycle::map::march::{March, Path};
use crate::cycle::periodic::PeriodicOrbit;
use crate::cycle::periodic::PeriodicSolver;
use crate::cycle::periodic::find::{start_of_mode, start_of_orbit};
use crate::cycle::periodic::newton::{Further, Linear, angle_unknown, flow, period_unknown};
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::Root;

impl Follow for PeriodicSolver {
    type Orbit = PeriodicOrbit;

    const MULTIPLIED: bool = true;

    fn small<M: Model>(
        &self,
        shoot: &Shoot<M>,
        root: &Root,
        amplitude: f64,
        parameter: f64,
    ) -> Result<Unknowns, CycleError> {
        let (period, angle) = (self.return_of(root), self.angle.unwrap_or(0.0));
        let mut march = self.march(shoot, period)?;
        Ok(Unknowns { start: start_of_mode(&mut march, root, amplitude, period)?, clock: period, angle, parameter })
    }

    fn known<M: Model>(&self, shoot: &Shoot<M>, orbit: &PeriodicOrbit, parameter: f64) -> Result<Unknowns, CycleError> {
        let period = self.return_after(orbit);
        let march = self.march(shoot, period)?;
        let (start, angle) = (start_of_orbit(&march, orbit, period)?, self.angle_of(orbit));
        Ok(Unknowns { start, clock: period, angle, parameter })
    }

    fn correct<M: Model>(
        &self,
        family: &mut impl FnMut(f64) -> Result<Shoot<M>, CycleError>,
        mut at: Unknowns,
        condition: &Condition,
    ) -> Result<Corrected<PeriodicOrbit, M>, CycleError> {
        let (mut iterations, mut equilibria, mut last) = (0, 0, f64::INFINITY);
        let mut kept: Option<(Linear, f64)> = None;
        let mut guesses: Vec<Rod> = Vec::new();
        loop {
            let astray = |error: CycleError| error.after(iterations, last);
            let shoot = family(at.parameter).map_err(astray)?;
            let mut march = self.march(&shoot, at.clock).map_err(astray)?;
            at.start.check(march.places.len(), march.variables)?;
            if march.kept > at.start.slopes.len() {
                at.start.keep(march.kept);
                kept = None;
            }
            march.kept = at.start.slopes.len();
            march.guesses = std::mem::take(&mut guesses);
            march.set_angle(at.angle);
            let path = march.run(&at.start, at.clock).map_err(astray)?;
            equilibria += path.equilibria;
            let flat = at.start.flat();
            let left = path.end.flat() - &flat;
            let residual = at.start.residual(&path.end, self.least(&shoot, false));
            let converged =
                residual <= self.tolerance && (iterations > 0 || condition.left(&at).abs() <= self.tolerance);
            if !converged && (iterations == self.max_iterations || !residual.is_finite()) {
                return Err(CycleError::NotConverged { iterations, residual });
            }
            // For the estimate of the error any linearisation near the orbit serves.
            let linear = match Linear::that_serves(kept.take(), if converged { 0.0 } else { residual }) {
                Some(linear) => linear,
                None => {
                    let known = march.guesses.clone();
                    let mut beside = |parameter: f64| {
                        let shoot = family(parameter)?;
                        let mut march = self.march(&shoot, at.clock)?;
                        at.start.check(march.places.len(), march.variables)?;
                        (march.kept, march.guesses) = (at.start.slopes.len(), known.clone());
                        march.set_angle(at.angle);
                        Ok::<_, CycleError>(march.run(&at.start, at.clock)?.end.flat())
                    };
                    let [before, after] = condition.beside(at.parameter);
                    let column = (beside(after)? - beside(before)?) / (after - before);
                    let further = bordering(&mut march, &at, &path, condition, column)?;
                    equilibria += 4 * path.equilibria;
                    Linear::of(&march, at.clock, &path, further)?
                }
            };
            if converged {
                check_autonomous(&shoot, &path.stages[0][0].rod)?;
                let error = self.checked_error(&march, &at.start, at.clock, &path, &linear, false)?;
                if !(error <= self.accuracy) {
                    return Err(CycleError::Unresolved { error, intervals: self.intervals });
                }
                let orbit = PeriodicOrbit {
                    period: at.clock,
                    angle: at.angle,
                    iterations,
                    equilibria,
                    residual,
                    error,
                    start: at.start.clone(),
                    settings: *self,
                    driven_from: None,
                };
                let turned = march.turn.as_ref().map(|turn| turn.rate(&at.start).present());
                let directions = std::iter::once(flow(&march, &at.start, &path)).chain(turned).collect();
                return Ok(Corrected { orbit, unknowns: at, same: Same { directions }, shoot });
            }
            let conditions = [condition.phase_left(0, &at), condition.left(&at), condition.phase_left(1, &at)];
            let (change, others) = linear.step(&at.start, &left, &conditions, iterations)?;
            at.start = at.start.with_values(&(flat + change));
            at.clock *= 1.0 + others[0];
            at.angle += others.get(2).copied().unwrap_or(0.0);
            at.parameter = condition.fixed.unwrap_or(at.parameter + others[1]);
            (iterations, last) = (iterations + 1, residual);
            kept = Some((linear, residual));
            guesses = std::mem::take(&mut march.guesses);
        }
    }

    fn refined(&self) -> Option<Self> {
        Self::refined(self)
    }

    fn on_finer_grid(&self, mut at: Unknowns) -> Unknowns {
        let [old, new] = [self.intervals, 2 * self.intervals].map(|intervals| Grid::new(intervals, self.stages));
        at.start = at.start.on_grid(&old, &new, 2 * at.start.slopes.len(), 0.5);
        at
    }

    fn look<M: Model>(&self, orbit: &PeriodicOrbit, shoot: &Shoot<M>, count: usize) -> Result<Look, CycleError> {
        let (mut march, path) = orbit.go_round(shoot)?;
        let found = orbit.multipliers_on(&march, &path, count)?;
        let (excursion, _) = orbit.largest_excursion_on(&mut march, &path)?;
        let exponents = found.sets.map(|set| set.iter().map(|one| one.root(orbit.period)).collect());
        Ok(Look { excursion, period: orbit.period, exponents, trivial: found.trivial / orbit.period })
    }
}

/// The columns and rows by which the period, the parameter and the angle border the linearised map.
fn bordering(
    march: &mut March<impl Model>,
    at: &Unknowns,
    path: &Path,
    condition: &Condition,
    column: DVector<f64>,
) -> Result<Vec<Further>, CycleError> {
    let parameter = Further { column, state: condition.state.clone(), others: vec![0.0, condition.parameter] };
    let mut time = period_unknown(march, &at.start, at.clock, path, &condition.weights)?;
    let mut angle = angle_unknown(march, &at.start, path, &condition.weights)?;
    for (k, unknown) in [Some(&mut time), angle.as_mut()].into_iter().flatten().enumerate() {
        if let Some(phase) = condition.phase(k) {
            unknown.state.clone_from(phase);
        }
    }
    Ok([time, parameter].into_iter().chain(angle).collect())
}
