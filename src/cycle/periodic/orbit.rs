//! A periodic orbit: its shapes and its largest excursion. Both are evaluated on a trajectory of
//! the return map from the stored state.

use super::PeriodicSolver;
use super::linear::Traced;
use crate::cycle::corrector::check_residual;
use crate::cycle::equations::EvaluatedEquations;
use crate::cycle::error::{CycleError, Outcome};
use crate::cycle::extended::OrbitUnknowns;
use crate::cycle::map::{PhaseState, carried};
use crate::cycle::rotated::excursion;
use crate::cycle::symmetry::check_periodic;
use crate::model::{Model, Scene};
use crate::numerics::scalar::maximum;
use crate::rod::Rod;
use crate::shoot::Shoot;

/// A periodic orbit of a shoot, or a relative one: x(T) = R(φ) x(0). The state x is the strain, the
/// variables of the laws, and their slopes over the longest delay; R(φ) is the rotation by the
/// angle φ about the tangent of the base.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct PeriodicOrbit {
    /// Period T, s: the time after which the shoot returns, rotated by the angle. For half a swing
    /// it is half the period of the swing.
    pub period: f64,
    /// Angle φ by which the shoot has rotated about the tangent of the base after a period, rad,
    /// counterclockwise as seen from above the apex; zero for an orbit without an angle.
    pub angle: f64,
    /// Number of Newton iterations on the last grid in time.
    pub iterations: usize,
    /// Number of solved equilibria on all grids in time, without those of linearisations.
    pub equilibria: usize,
    /// Euclidean norm of x(T) − R(φ) x(0) relative to the larger norm of both states: of all
    /// components, or of the strain alone if that is larger.
    pub residual: f64,
    /// Estimate of the relative error due to the grid in time: the largest of that of the period
    /// and that of the strain along the orbit, by the Euclidean norm relative to the largest norm.
    pub error: f64,
    pub(crate) start: PhaseState,
    pub(crate) settings: PeriodicSolver,
    /// Time at which a forced orbit begins, s; none for an autonomous one.
    pub(crate) forced_from: Option<f64>,
}

impl PeriodicOrbit {
    /// Maps the state of the orbit over a period, and checks that it returns.
    pub(crate) fn retrace<'a, M: Model>(&self, shoot: &'a Shoot<M>) -> Outcome<Traced<'a, M>> {
        let (start, forced) = (self.start.clone(), self.forced_from.is_some());
        let at = OrbitUnknowns {
            start,
            period_or_rate: self.period,
            forced,
            angle: self.angle,
            parameter: 0.0,
        };
        let traced = Traced::of(self.settings, shoot, at, Vec::new())?;
        traced.check()?;
        if forced {
            check_periodic(shoot, &traced.path.stages[0][0].rod, self.period)?;
        }
        check_residual(traced.residual().1, self.settings.tolerance)?;
        Ok(traced)
    }

    /// The rods in equilibrium at the ends of all intervals, those of the period included, with the
    /// times since the beginning of the period, s.
    ///
    /// # Errors
    /// A shoot that is not the one of the orbit, or an equilibrium that is not found.
    pub fn shapes(&self, shoot: &Shoot<impl Model>) -> Result<Vec<(f64, Rod)>, CycleError> {
        let Traced {
            mut return_map,
            path,
            ..
        } = self.retrace(shoot)?;
        let length = self.period / self.settings.intervals as f64;
        let all = path.strains.iter().enumerate();
        all.map(|(n, strain)| {
            Ok((
                n as f64 * length,
                return_map.equilibrate_at(strain, n as f64 * length)?.0,
            ))
        })
        .collect()
    }

    /// The largest distance of the tip from the tangent of the scene's base (m), and the rod at
    /// that time, which is interpolated between the stages.
    ///
    /// # Errors
    /// A shoot that is not the one of the orbit, or an equilibrium that is not found.
    pub fn largest_excursion(&self, shoot: &Shoot<impl Model>) -> Result<(f64, Rod), CycleError> {
        self.largest_excursion_on(&mut self.retrace(shoot)?)
    }

    pub(crate) fn largest_excursion_on(
        &self,
        traced: &mut Traced<impl Model>,
    ) -> Outcome<(f64, Rod)> {
        let Traced {
            return_map, path, ..
        } = traced;
        let (shoot, length) = (
            return_map.shoot,
            self.period / self.settings.intervals as f64,
        );
        // The base of the scene, from which the base of a held shoot may rotate.
        let base = |time: f64| {
            shoot
                .model
                .scene()
                .base(shoot.environment().time + time * length)
        };
        let all = path.stages.iter().enumerate().flat_map(|(n, stages)| {
            let times = return_map.grid.stages.iter().map(move |c| n as f64 + c);
            times
                .zip(stages)
                .map(|(time, stage)| (time, excursion(&stage.rod, &base(time))))
        });
        let best = all.max_by(|a, b| a.1.total_cmp(&b.1));
        let (first, _) = best.ok_or(CycleError::not_converged(0, f64::INFINITY))?;
        // The rod at a time in intervals. Beyond the ends of the period the neighbouring
        // polynomials are extrapolated.
        let mut at = |time: f64| {
            let interval = time
                .floor()
                .clamp(0.0, (self.settings.intervals - 1) as f64);
            let n = interval as usize;
            let weights = return_map.grid.integrals(time - interval);
            let strain = carried(&path.strains[n], &path.strain_slopes[n], &weights);
            return_map
                .equilibrate_at(&strain, time * length)
                .map(|(rod, _)| rod)
        };
        // The excursion has an error of the order of the square of that of the time, which is below
        // 1e-6.
        let time = maximum(first, 0.2, 1e-3, |time| {
            Ok::<_, CycleError>(excursion(&at(time)?, &base(time)))
        })?;
        let rod = at(time)?;
        Ok((excursion(&rod, &base(time)), rod))
    }
}
