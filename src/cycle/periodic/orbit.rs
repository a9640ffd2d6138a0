//! A periodic orbit: its shapes and its largest excursion.

use nalgebra::Vector3;

use super::PeriodicSolver;
use crate::cycle::autonomous::{check_autonomous, check_period};
use crate::cycle::error::CycleError;
use crate::cycle::map::phase_state::{PhaseState, carried};
use crate::cycle::map::return_map::{ReturnMap, Trajectory};
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;

/// A periodic orbit of a shoot.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct PeriodicOrbit {
    /// The period, s: the time after which the shoot comes back, turned by the angle. For half a swing it is half the period of the swing.
    pub period: f64,
    /// Rotation of the shoot about the tangent of the base after a period, rad, counterclockwise as seen from above the apex; zero
    /// for an orbit without an angle.
    pub angle: f64,
    /// Newton iterations, on the last number of intervals.
    pub iterations: usize,
    /// Equilibria that were solved.
    pub equilibria: usize,
    /// Relative difference between a state and that one period later.
    pub residual: f64,
    /// Estimate of the relative error of period and shape that the intervals leave, by one on more stages.
    pub error: f64,
    pub(crate) start: PhaseState,
    pub(crate) settings: PeriodicSolver,
    /// When a cycle that something drives was begun, s; none if its period is its own.
    pub(crate) driven_from: Option<f64>,
}

impl PeriodicOrbit {
    /// Goes round once.
    pub(crate) fn retrace<'a, M: Model>(
        &self,
        shoot: &'a Shoot<M>,
    ) -> Result<(ReturnMap<'a, M>, Trajectory), CycleError> {
        let mut return_map = self.settings.return_map(shoot, self.period)?;
        self.start.check(return_map.places.len(), return_map.variables)?;
        return_map.kept = self.start.slopes.len();
        return_map.set_angle(self.angle);
        let path = return_map.run(&self.start, self.period)?;
        if self.driven_from.is_none() {
            check_autonomous(shoot, &path.stages[0][0].rod)?;
        } else {
            check_period(shoot, &path.stages[0][0].rod, self.period)?;
        }
        let residual = self.start.residual(&path.end, self.settings.least(shoot, self.driven_from.is_some()));
        // What is found with other first guesses differs by rounding.
        if !(residual <= 100.0 * self.settings.tolerance) {
            return Err(CycleError::NotConverged { iterations: 0, residual });
        }
        Ok((return_map, path))
    }

    /// The shape at the start and after every interval of the period, as it is at rest: with the times since the start, s.
    ///
    /// # Errors
    /// An equilibrium that is not found.
    pub fn shapes(&self, shoot: &Shoot<impl Model>) -> Result<Vec<(f64, Rod)>, CycleError> {
        let (mut return_map, path) = self.retrace(shoot)?;
        let length = self.period / self.settings.intervals as f64;
        let all = path.strains.iter().enumerate();
        all.map(|(n, strain)| Ok((n as f64 * length, return_map.equilibrate_at(strain, n as f64 * length)?.0)))
            .collect()
    }

    /// The largest distance of the tip from the tangent of the base (m), and the rod at that time: a maximum in time, interpolated
    /// between the points.
    ///
    /// # Errors
    /// An equilibrium that is not found.
    pub fn largest_excursion(&self, shoot: &Shoot<impl Model>) -> Result<(f64, Rod), CycleError> {
        let (mut return_map, path) = self.retrace(shoot)?;
        self.largest_excursion_on(&mut return_map, &path)
    }

    pub(crate) fn largest_excursion_on(
        &self,
        return_map: &mut ReturnMap<impl Model>,
        path: &Trajectory,
    ) -> Result<(f64, Rod), CycleError> {
        let excursion = |rod: &Rod| {
            let (tip, axis) = (rod.tip(), rod.frames()[0] * Vector3::z());
            (tip - axis * axis.dot(&tip)).norm()
        };
        let all = path
            .stages
            .iter()
            .enumerate()
            .flat_map(|(n, stages)| stages.iter().enumerate().map(move |(i, stage)| (n, i, stage)));
        let best = all.max_by(|a, b| excursion(&a.2.rod).total_cmp(&excursion(&b.2.rod)));
        let Some((n, i, stage)) = best else { return Err(CycleError::NotConverged { iterations: 0, residual: 1.0 }) };
        let length = self.period / self.settings.intervals as f64;
        let stages = return_map.grid.stages.clone();
        let mut at = |time: f64| {
            // Inside the interval or beyond its ends, where the neighbour's polynomial is as good.
            let whole = time.floor().clamp(0.0, (self.settings.intervals - 1) as f64);
            let n = whole as usize;
            let weights = return_map.grid.integrals(time - whole);
            let strain = carried(&path.strains[n], &path.strain_slopes[n], &weights);
            return_map.equilibrate_at(&strain, time * length).map(|(rod, _)| rod)
        };
        // Parabolas through three times, ever closer: their vertex errs by the cube of their width.
        let first = n as f64 + stages[i];
        let (mut time, mut width) = (first, 0.2);
        let mut found = stage.rod.clone();
        for _ in 0..40 {
            let [before, now, after] = [at(time - width)?, at(time)?, at(time + width)?];
            let [a, b, c] = [&before, &now, &after].map(excursion);
            let curvature = a - 2.0 * b + c;
            // The tip goes round at the same distance: every time is as good.
            if curvature.abs() <= 1e-12 * b {
                found = now;
                break;
            }
            let shift = if curvature < 0.0 { (0.5 * (a - c) / curvature).clamp(-2.0, 2.0) } else { (c - a).signum() };
            // No further than a stage or two.
            time = (time + shift * width).clamp(first - 0.5, first + 0.5);
            found = now;
            if shift.abs() < 0.1 {
                width *= 0.2;
            }
            // A difference of excursions of 1e-13 is rounding; the excursion errs by the square of the time's error.
            if width < 1e-3 && shift.abs() < 0.1 {
                break;
            }
        }
        Ok((excursion(&found), found))
    }
}
