//! The equations of a periodic orbit: x(T) = x(0), or x(T) = R(φ) x(0) for a relative one, by the return map
//! (shooting with collocation).

use nalgebra::DVector;

use super::PeriodicSolver;
use super::guess::{state_of_mode, state_of_orbit};
use super::linear::Traced;
use super::orbit::PeriodicOrbit;
use super::resolution::error_of;
use crate::cycle::corrector::STATIONARY;
use crate::cycle::equations::{Computed, Effort, Equations, EvaluatedEquations, Newton, OBSERVED, Observation};
use crate::cycle::error::CycleError;
use crate::cycle::extended::{BorderedSystem, ExtraConditions, OrbitUnknowns, Symmetry};
use crate::cycle::map::{Monodromy, TimeGrid, Trajectory, kept};
use crate::cycle::symmetry::{check_autonomous, check_axis};
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::Root;
use crate::tropism::Declaration;

/// Largest number of intervals in a period that is chosen automatically. More take minutes.
pub(crate) const MAX_INTERVALS: usize = 256;

/// A state that has been mapped over a period.
pub struct Mapped<'a, M: Model> {
    solver: PeriodicSolver,
    at: OrbitUnknowns,
    traced: Traced<'a, M>,
}

impl Equations for PeriodicSolver {
    type Orbit = PeriodicOrbit;
    type Jacobian = Monodromy;
    type Evaluation<'a, M: Model + 'a> = Mapped<'a, M>;
    const FLOQUET: bool = true;

    fn newton(&self) -> Newton {
        // A linearisation costs as much as twelve iterations, so that it is kept while the residual decreases
        // fivefold.
        Newton { tolerance: self.tolerance, max_iterations: self.max_iterations, max_work: self.max_work, keep: 0.2 }
    }

    fn of_mode<M: Model>(&self, shoot: &Shoot<M>, root: &Root, amplitude: f64) -> Result<OrbitUnknowns, CycleError> {
        let (share, angle) = (self.share(), self.angle.unwrap_or(0.0));
        let period = share * root.period();
        let start = state_of_mode(&mut self.return_map(shoot, period)?, root, amplitude, period)?;
        Ok(OrbitUnknowns { start, clock: period, forced: false, angle, parameter: 0.0 })
    }

    fn of_orbit<M: Model>(&self, shoot: &Shoot<M>, orbit: &PeriodicOrbit) -> Result<OrbitUnknowns, CycleError> {
        // A whole orbit becomes half a swing, or the reverse.
        let (period, angle) = match orbit.settings.angle {
            None => (self.share() * orbit.period, self.angle.unwrap_or(0.0)),
            Some(_) if self.angle.is_none() && orbit.angle.cos() < 0.0 => (2.0 * orbit.period, orbit.angle),
            Some(_) => (orbit.period, orbit.angle),
        };
        let start = state_of_orbit(&self.return_map(shoot, period)?, orbit, period)?;
        Ok(OrbitUnknowns { start, clock: period, forced: false, angle, parameter: 0.0 })
    }

    fn evaluate<'a, M: Model>(&self, shoot: &'a Shoot<M>, at: &OrbitUnknowns, rods: Vec<Rod>) -> Computed<'a, Self, M> {
        let traced = Traced::of(self, shoot, (&at.start, at.clock, at.angle), rods)?;
        // The stationary state is a fixed point for any period.
        let Trajectory { stages, strains, .. } = &traced.path;
        let changes = stages.iter().flatten().map(|stage| (&stage.strain - &strains[0]).amax());
        let strain = changes.fold(0.0, f64::max);
        if !at.forced && strain * shoot.rod().length() < STATIONARY {
            return Err(CycleError::Stationary { strain });
        }
        Ok(Mapped { solver: *self, at: at.clone(), traced })
    }

    fn observe<M: Model>(&self, orbit: &PeriodicOrbit, shoot: &Shoot<M>) -> Result<Observation, CycleError> {
        let mut traced = orbit.retrace(shoot)?;
        let found = orbit.multipliers_on(&traced, OBSERVED)?;
        let (excursion, _) = orbit.largest_excursion_on(&mut traced)?;
        // The logarithm of a multiplier determines λ up to multiples of 2πi/T; that with the smallest |Im λ| is
        // returned.
        let exponents = found.values.map(|list| list.iter().map(|one| one.value.ln() / orbit.period).collect());
        Ok(Observation { excursion, period: orbit.period, exponents, trivial: found.trivial / orbit.period })
    }

    fn extend_past<M: Model>(&self, shoot: &Shoot<M>, at: &mut OrbitUnknowns) -> Result<bool, CycleError> {
        let (longest, own) = (Declaration::of(shoot.model.tropism()).longest_delay(), at.start.slopes.len());
        // Differences by the period change the delay by far less than a tenth of an interval.
        let short = longest * self.intervals as f64 / at.clock + 0.1 > own as f64;
        if short {
            at.start.keep(own.max(kept(longest, self.intervals, at.clock)?));
        }
        Ok(short)
    }

    fn check_resolution(&self, orbit: &PeriodicOrbit) -> Result<(), CycleError> {
        let (error, intervals) = (orbit.error, self.intervals);
        if error <= self.accuracy { Ok(()) } else { Err(CycleError::Unresolved { error, intervals }) }
    }

    fn refined(&self) -> Option<Self> {
        let intervals = 2 * self.intervals;
        (intervals <= MAX_INTERVALS).then_some(Self { intervals, ..*self })
    }

    fn on_finer_grid(&self, mut at: OrbitUnknowns) -> OrbitUnknowns {
        let [old, new] = [self.intervals, 2 * self.intervals].map(|intervals| TimeGrid::new(intervals, self.stages));
        at.start = at.start.on_grid(&old, &new, 2 * at.start.slopes.len(), 0.5);
        at
    }
}

impl<M: Model> EvaluatedEquations<PeriodicSolver> for Mapped<'_, M> {
    fn rods(&self) -> Vec<Rod> {
        self.traced.return_map.guesses.clone()
    }

    fn equilibria(&self) -> usize {
        self.traced.return_map.equilibria
    }

    fn residual(&self) -> (DVector<f64>, f64) {
        let (start, end) = (&self.traced.path.start, &self.traced.path.end);
        let least = self.solver.least(self.traced.return_map.shoot, self.at.forced);
        (end.flat() - start.flat(), start.residual(end, least))
    }

    fn check(&self) -> Result<(), CycleError> {
        let Traced { return_map, path } = &self.traced;
        if self.at.forced { Ok(()) } else { check_autonomous(return_map.shoot, &path.stages[0][0].rod) }
    }

    fn linearise(&mut self) -> Result<Option<(Monodromy, Vec<Symmetry>)>, CycleError> {
        let symmetries = if self.at.forced { Vec::new() } else { self.traced.symmetries()? };
        Ok(Some((Monodromy::of(&self.traced.return_map, &self.traced.path)?, symmetries)))
    }

    fn into_orbit(
        mut self,
        known: Option<BorderedSystem<Monodromy>>,
        effort: Effort,
    ) -> Result<(PeriodicOrbit, Vec<DVector<f64>>), CycleError> {
        let Effort { iterations, equilibria, residual } = effort;
        let linear = match known {
            Some(known) => known,
            None => {
                let (jacobian, symmetries) =
                    self.linearise()?.ok_or(CycleError::not_converged(iterations, residual))?;
                BorderedSystem::new(jacobian, symmetries, None, &ExtraConditions::default(), &self.at)
            }
        };
        let Self { solver, at, traced } = self;
        traced.check_not_circular()?;
        let return_map = &traced.return_map;
        check_axis(return_map, &traced.path)?;
        let error = error_of(&traced, &at, &linear, solver.least(return_map.shoot, at.forced))?;
        let rotation = return_map.turn.as_ref().map(|turn| turn.rate(&at.start).present());
        let symmetry_tangents = std::iter::once(traced.flow()).chain(rotation).collect();
        let orbit = PeriodicOrbit {
            period: at.clock,
            angle: at.angle,
            iterations,
            equilibria,
            residual,
            error,
            start: at.start,
            settings: solver,
            forced_from: at.forced.then(|| return_map.shoot.time()),
        };
        Ok((orbit, symmetry_tangents))
    }
}
