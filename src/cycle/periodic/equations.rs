//! Periodic orbits as solutions of the extended system: fixed points of the return map.

use nalgebra::DVector;

use super::PeriodicSolver;
use super::guess::{state_of_mode, state_of_orbit};
use super::linear::{ReturnMapJacobian, check_no_circle, flow, symmetries};
use super::orbit::PeriodicOrbit;
use super::resolution::error_of;
use crate::cycle::autonomous::check_autonomous;
use crate::cycle::axis::check_axis;
use crate::cycle::corrector::STATIONARY;
use crate::cycle::equations::{Effort, Equations, Observation};
use crate::cycle::error::CycleError;
use crate::cycle::extended::{Bordered, Conditions, Symmetry, Unknowns};
use crate::cycle::map::grid::Grid;
use crate::cycle::map::return_map::{self, ReturnMap, Trajectory};
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::Root;

/// Largest number of intervals that a solver chooses. Runs with more take minutes.
const MOST: usize = 256;

/// A state that has been mapped over a period.
pub struct Mapped<'a, M: Model> {
    return_map: ReturnMap<'a, M>,
    path: Trajectory,
}

impl Equations for PeriodicSolver {
    type Orbit = PeriodicOrbit;
    type Evaluation<'a, M: Model + 'a> = Mapped<'a, M>;
    type Jacobian = ReturnMapJacobian;

    // The linearisation costs as much as a dozen iterations.
    const KEEP: f64 = 0.2;
    const FLOQUET: bool = true;

    fn of_mode<M: Model>(&self, shoot: &Shoot<M>, root: &Root, amplitude: f64) -> Result<Unknowns, CycleError> {
        let (period, angle) = (self.return_of(root), self.angle.unwrap_or(0.0));
        let start = state_of_mode(&mut self.return_map(shoot, period)?, root, amplitude, period)?;
        Ok(Unknowns { start, clock: period, forced: false, angle, parameter: 0.0 })
    }

    fn of_orbit<M: Model>(&self, shoot: &Shoot<M>, orbit: &PeriodicOrbit) -> Result<Unknowns, CycleError> {
        let (period, angle) = (self.return_after(orbit), self.angle_of(orbit));
        let start = state_of_orbit(&self.return_map(shoot, period)?, orbit, period)?;
        Ok(Unknowns { start, clock: period, forced: false, angle, parameter: 0.0 })
    }

    fn tolerance(&self) -> f64 {
        self.tolerance
    }

    fn max_iterations(&self) -> usize {
        self.max_iterations
    }

    fn extend_past<M: Model>(&self, shoot: &Shoot<M>, at: &mut Unknowns) -> Result<bool, CycleError> {
        return_map::extend_past(shoot.model.tropism(), &mut at.start, self.intervals, at.clock)
    }

    fn evaluate<'a, M: Model>(
        &self,
        shoot: &'a Shoot<M>,
        at: &Unknowns,
        rods: Vec<Rod>,
    ) -> Result<Mapped<'a, M>, CycleError> {
        let mut return_map = self.return_map(shoot, at.clock)?;
        at.start.check(return_map.places.len(), return_map.variables)?;
        (return_map.kept, return_map.guesses) = (at.start.slopes.len(), rods);
        return_map.set_angle(at.angle);
        let path = return_map.run(&at.start, at.clock)?;
        // The stationary state is a fixed point for any period.
        let strain = path.largest_move();
        if !at.forced && strain * shoot.rod().length() < STATIONARY {
            return Err(CycleError::Stationary { strain });
        }
        Ok(Mapped { return_map, path })
    }

    fn rods<M: Model>(here: &Mapped<M>) -> Vec<Rod> {
        here.return_map.guesses.clone()
    }

    fn equilibria<M: Model>(here: &Mapped<M>) -> usize {
        here.return_map.equilibria
    }

    fn residual<M: Model>(&self, here: &Mapped<M>, at: &Unknowns) -> (DVector<f64>, f64) {
        let size = at.start.residual(&here.path.end, self.least(here.return_map.shoot, at.forced));
        (here.path.end.flat() - at.start.flat(), size)
    }

    fn check<M: Model>(&self, here: &Mapped<M>, at: &Unknowns) -> Result<(), CycleError> {
        if at.forced { Ok(()) } else { check_autonomous(here.return_map.shoot, &here.path.stages[0][0].rod) }
    }

    fn linearise<M: Model>(
        &self,
        here: &mut Mapped<M>,
        at: &Unknowns,
    ) -> Result<Option<(ReturnMapJacobian, Vec<Symmetry>)>, CycleError> {
        let Mapped { return_map, path } = here;
        let symmetries = if at.forced { Vec::new() } else { symmetries(return_map, &at.start, at.clock, path)? };
        Ok(Some((ReturnMapJacobian::of(return_map, &at.start, at.clock, path)?, symmetries)))
    }

    fn orbit<M: Model>(
        &self,
        mut here: Mapped<M>,
        at: &Unknowns,
        known: Option<Bordered<ReturnMapJacobian>>,
        effort: Effort,
    ) -> Result<(PeriodicOrbit, Vec<DVector<f64>>), CycleError> {
        let Effort { iterations, equilibria, residual } = effort;
        let linear = match known {
            Some(known) => known,
            None => {
                let failed = CycleError::NotConverged { iterations, residual };
                let (jacobian, symmetries) = self.linearise(&mut here, at)?.ok_or(failed)?;
                Bordered::new(jacobian, symmetries, &Conditions::default(), at)
            }
        };
        let Mapped { return_map, path } = here;
        check_no_circle(&return_map, &at.start, &path)?;
        check_axis(&return_map, &path, at.clock)?;
        let least = self.least(return_map.shoot, at.forced);
        let error = error_of(&return_map, &at.start, at.clock, &path, &linear, least)?;
        let rotation = return_map.turn.as_ref().map(|turn| turn.rate(&at.start).present());
        let tangents = std::iter::once(flow(&return_map, &at.start, &path)).chain(rotation).collect();
        let orbit = PeriodicOrbit {
            period: at.clock,
            angle: at.angle,
            iterations,
            equilibria,
            residual,
            error,
            start: at.start.clone(),
            settings: *self,
            driven_from: at.forced.then(|| return_map.shoot.time()),
        };
        Ok((orbit, tangents))
    }

    fn check_resolution(&self, orbit: &PeriodicOrbit) -> Result<(), CycleError> {
        let (error, intervals) = (orbit.error, self.intervals);
        if error <= self.accuracy { Ok(()) } else { Err(CycleError::Unresolved { error, intervals }) }
    }

    fn refined(&self) -> Option<Self> {
        let intervals = 2 * self.intervals;
        (intervals <= MOST).then_some(Self { intervals, ..*self })
    }

    fn on_finer_grid(&self, mut at: Unknowns) -> Unknowns {
        let [old, new] = [self.intervals, 2 * self.intervals].map(|intervals| Grid::new(intervals, self.stages));
        at.start = at.start.on_grid(&old, &new, 2 * at.start.slopes.len(), 0.5);
        at
    }

    fn observe<M: Model>(
        &self,
        orbit: &PeriodicOrbit,
        shoot: &Shoot<M>,
        count: usize,
    ) -> Result<Observation, CycleError> {
        let (mut return_map, path) = orbit.retrace(shoot)?;
        let found = orbit.multipliers_on(&return_map, &path, count)?;
        let (excursion, _) = orbit.largest_excursion_on(&mut return_map, &path)?;
        let exponents = found.values.map(|list| list.iter().map(|one| one.root(orbit.period)).collect());
        Ok(Observation { excursion, period: orbit.period, exponents, trivial: found.trivial / orbit.period })
    }
}
