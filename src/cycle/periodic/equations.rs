//! The equations of a periodic orbit, x(T) = x(0), or x(T) = R(φ) x(0) for a relative one, by the
//! return map (shooting with collocation). The return map rotates the state after a period back by
//! φ, so that the residual is the image minus the state for both kinds of orbit.

use nalgebra::DVector;

use super::PeriodicSolver;
use super::linear::Traced;
use super::orbit::PeriodicOrbit;
use super::resolution::error_of;
use crate::cycle::corrector::STATIONARY;
use crate::cycle::equations::{
    Computed, Effort, Equations, EvaluatedEquations, Newton, OBSERVED, Observation,
};
use crate::cycle::error::{CycleError, Outcome};
use crate::cycle::extended::{BorderedSystem, ExtraConditions, OrbitUnknowns, Symmetry};
use crate::cycle::map::{Monodromy, PhaseState, TimeGrid, Trajectory, kept};
use crate::cycle::symmetry::check_autonomous;
use crate::error::ensure;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::Root;
use crate::tropism::Declaration;

/// Largest number of intervals in a period that is chosen automatically. More take minutes.
pub(crate) const MAX_INTERVALS: usize = 256;

impl Equations for PeriodicSolver {
    type Orbit = PeriodicOrbit;
    type Jacobian = Monodromy;
    type Evaluation<'a, M: Model + 'a> = Traced<'a, M>;
    const FLOQUET: bool = true;

    fn newton(&self) -> Newton {
        // A Jacobian costs as much as twelve iterations. It is kept as long as each iteration
        // reduces the residual at least fivefold.
        Newton {
            tolerance: self.tolerance,
            max_iterations: self.max_iterations,
            max_work: self.max_work,
            keep: 0.2,
        }
    }

    fn of_mode<M: Model>(
        &self,
        shoot: &Shoot<M>,
        root: &Root,
        amplitude: f64,
    ) -> Outcome<OrbitUnknowns> {
        let (share, angle) = (self.share(), self.angle.unwrap_or(0.0));
        let period = share * root.period();
        let start = self
            .return_map(shoot, period)?
            .state_of_mode(root, amplitude, period)?;
        Ok(OrbitUnknowns {
            start,
            period_or_rate: period,
            forced: false,
            angle,
            parameter: 0.0,
        })
    }

    fn of_orbit<M: Model>(
        &self,
        shoot: &Shoot<M>,
        orbit: &PeriodicOrbit,
    ) -> Outcome<OrbitUnknowns> {
        // A whole orbit becomes half a swing, or the reverse.
        let (period, angle) = match orbit.settings.angle {
            None => (self.share() * orbit.period, self.angle.unwrap_or(0.0)),
            Some(_) if self.angle.is_none() && orbit.angle.cos() < 0.0 => {
                (2.0 * orbit.period, orbit.angle)
            }
            Some(_) => (orbit.period, orbit.angle),
        };
        let start = self
            .return_map(shoot, period)?
            .state_of_orbit(orbit, period)?;
        Ok(OrbitUnknowns {
            start,
            period_or_rate: period,
            forced: false,
            angle,
            parameter: 0.0,
        })
    }

    fn evaluate<'a, M: Model>(
        &self,
        shoot: &'a Shoot<M>,
        at: &OrbitUnknowns,
        rods: Vec<Rod>,
    ) -> Computed<'a, Self, M> {
        let traced = Traced::of(*self, shoot, at.clone(), rods)?;
        // The stationary state is a fixed point for any period.
        let Trajectory {
            stages, strains, ..
        } = &traced.path;
        let changes = stages
            .iter()
            .flatten()
            .map(|stage| (&stage.strain - &strains[0]).amax());
        let strain = changes.fold(0.0, f64::max);
        let moves = strain * shoot.rod().length() >= STATIONARY;
        ensure(at.forced || moves, CycleError::Stationary { strain })?;
        Ok(traced)
    }

    fn observe<M: Model>(&self, orbit: &PeriodicOrbit, shoot: &Shoot<M>) -> Outcome<Observation> {
        let mut traced = orbit.retrace(shoot)?;
        let found = orbit.multipliers_on(&traced, OBSERVED)?;
        let (excursion, _) = orbit.largest_excursion_on(&mut traced)?;
        // The logarithm of a multiplier determines λ up to multiples of 2πi/T; that with the
        // smallest |Im λ| is returned.
        let exponents = found.values.map(|list| {
            list.iter()
                .map(|one| one.value.ln() / orbit.period)
                .collect()
        });
        Ok(Observation {
            excursion,
            period: orbit.period,
            exponents,
            trivial: found.trivial / orbit.period,
        })
    }

    fn extend_past<M: Model>(&self, shoot: &Shoot<M>, at: &mut OrbitUnknowns) -> Outcome<bool> {
        let (longest, own) = (
            Declaration::of(shoot.model.tropism()).longest_delay(),
            at.start.slopes.len(),
        );
        // Differences by the period change the delay by far less than a tenth of an interval.
        let short = longest * self.intervals as f64 / at.period_or_rate + 0.1 > own as f64;
        if short {
            at.start
                .keep(own.max(kept(longest, self.intervals, at.period_or_rate)?));
        }
        Ok(short)
    }

    fn check_resolution(&self, orbit: &PeriodicOrbit) -> Outcome {
        let (error, intervals) = (orbit.error, self.intervals);
        if error <= self.accuracy {
            Ok(())
        } else {
            Err(CycleError::Unresolved { error, intervals })
        }
    }

    fn refine<const N: usize>(&mut self, states: [OrbitUnknowns; N]) -> Option<[OrbitUnknowns; N]> {
        let [old, new] = [self.intervals, 2 * self.intervals]
            .map(|intervals| TimeGrid::new(intervals, self.stages));
        // Interpolation is linear, so that a change of a state is interpolated like a state.
        let finer = |start: &PhaseState| start.on_grid(&old, &new, 2 * start.slopes.len(), 0.5);
        (new.intervals <= MAX_INTERVALS).then(|| {
            self.intervals = new.intervals;
            states.map(|at| OrbitUnknowns {
                start: finer(&at.start),
                ..at
            })
        })
    }
}

impl<M: Model> EvaluatedEquations<PeriodicSolver> for Traced<'_, M> {
    fn rods(&self) -> Vec<Rod> {
        self.return_map.guesses.clone()
    }

    fn equilibria(&self) -> usize {
        self.return_map.equilibria
    }

    fn residual(&self) -> (DVector<f64>, f64) {
        let (start, end) = (&self.path.start, &self.path.end);
        (end.flat() - start.flat(), start.residual(end, self.least()))
    }

    fn check(&self) -> Outcome {
        if self.at.forced {
            Ok(())
        } else {
            check_autonomous(self.return_map.shoot, &self.path.stages[0][0].rod)
        }
    }

    fn linearise(&mut self) -> Outcome<Option<(Monodromy, Vec<Symmetry>)>> {
        let symmetries = if self.at.forced {
            Vec::new()
        } else {
            self.symmetries()?
        };
        Ok(Some((
            Monodromy::of(&self.return_map, &self.path)?,
            symmetries,
        )))
    }

    fn symmetry_tangents(&self) -> Vec<DVector<f64>> {
        self.tangents().collect()
    }

    fn into_orbit(
        mut self,
        known: Option<BorderedSystem<Monodromy>>,
        effort: Effort,
    ) -> Outcome<PeriodicOrbit> {
        let Effort {
            iterations,
            equilibria,
            residual,
        } = effort;
        let linear = match known {
            Some(known) => known,
            None => {
                let (jacobian, symmetries) = self
                    .linearise()?
                    .ok_or(CycleError::not_converged(iterations, residual))?;
                BorderedSystem::new(
                    jacobian,
                    symmetries,
                    None,
                    &ExtraConditions::default(),
                    &self.at,
                )
            }
        };
        self.check_not_circular()?;
        self.return_map.check_axis(&self.path)?;
        let error = error_of(&self, &linear)?;
        let Self {
            solver,
            at,
            return_map,
            ..
        } = self;
        Ok(PeriodicOrbit {
            period: at.period_or_rate,
            angle: at.angle,
            iterations,
            equilibria,
            residual,
            error,
            start: at.start,
            settings: solver,
            forced_from: at.forced.then(|| return_map.shoot.time()),
        })
    }
}
