//! Initial guesses of periodic orbits: modes, runs in time, other orbits, and the straight shoot.

use nalgebra::{Complex, DMatrix, DVector};

use super::orbit::PeriodicOrbit;
use crate::cycle::error::Outcome;
use crate::cycle::harmonic::{HarmonicBalance, HarmonicPoint};
use crate::cycle::map::{PhaseState, ReturnMap, TimeGrid, bends};
use crate::cycle::phase_grid::{PhaseGrid, WAVES};
use crate::error::ParameterError;
use crate::linearisation::{SteadyLaws, visit_stimuli};
use crate::model::Model;
use crate::rod::Rod;
use crate::stability::Root;
use crate::state::Reading;

impl<M: Model> ReturnMap<'_, M> {
    /// The state of an orbit on the grid of this map, for a period (s).
    pub(in crate::cycle) fn state_of_orbit(
        &self,
        orbit: &PeriodicOrbit,
        period: f64,
    ) -> Outcome<PhaseState> {
        orbit
            .start
            .check(self.places.len(), self.laws.size().variables)?;
        let mut start = orbit.start.clone();
        let old = TimeGrid::new(orbit.settings.intervals, orbit.settings.stages);
        let ratio = (old.intervals as f64 / orbit.period) / (self.grid.intervals as f64 / period);
        if ratio != 1.0 || old.stages != self.grid.stages {
            start = start.on_grid(&old, &self.grid, self.kept, ratio);
        }
        // The number of intervals of the past depends on the period.
        start.keep(self.kept);
        Ok(start)
    }

    /// The present state of a run in time with its past, for a period (s).
    pub(in crate::cycle) fn state_of_run(&self, period: f64) -> Outcome<PhaseState> {
        let (history, now, points) = (
            &self.shoot.state.history,
            self.shoot.time(),
            self.places.len(),
        );
        let (what, levels) = ("levels of the history of the run", history.levels());
        let requirement = "at least 2: an integrator must have advanced the shoot";
        ParameterError::unless(levels >= 2, what, levels as f64, requirement)?;
        let length = period / self.grid.intervals as f64;
        let read = |reading: Reading| {
            let all = (0..points).flat_map(|point| history.read(&reading, point));
            DVector::from_iterator(self.laws.size().variables * points, all)
        };
        let oldest = history.oldest().unwrap_or(now);
        let slope = |n: usize, stage: &f64| {
            // Before the beginning of the run the oldest slopes are used.
            let time = (now + (n as f64 - self.kept as f64 + stage) * length).max(oldest);
            read(history.slope(time)) * length
        };
        let interval = |n: usize| {
            self.grid
                .stages
                .iter()
                .map(|stage| slope(n, stage))
                .collect()
        };
        Ok(PhaseState {
            strain: bends(self.shoot.rod()),
            variables: read(history.reading(now, f64::INFINITY)),
            slopes: (0..self.kept).map(interval).collect(),
        })
    }

    /// The state at t = 0 of a mode with an amplitude of the tip (m), with the periodic variables
    /// that its stimuli cause.
    pub(in crate::cycle) fn state_of_mode(
        &mut self,
        root: &Root,
        amplitude: f64,
        period: f64,
    ) -> Outcome<PhaseState> {
        let (_, m, p) = self.sizes();
        let (what, counts) = ("number of strains of the mode", [root.strain.len(), p]);
        ParameterError::count(what, counts, "that of the points of the zone")?;
        for strain in &root.strain {
            ParameterError::finite("strain of the mode", strain.map(|x| x.re + x.im).sum(), "")?;
        }
        let phases = PhaseGrid::new(WAVES);
        // Strain of the state about which the laws are linearised; zero if it is upright.
        let mean = bends(self.shoot.rod());
        // The initial phase is that of the largest deviation, and not that of the passage through
        // the mean.
        let parts = root.strain.iter().map(|s| {
            (
                s.map(|x| x.re).norm_squared(),
                s.map(|x| x.im).norm_squared(),
            )
        });
        let (bent, passing) = parts.fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
        let first = if bent < passing {
            Complex::new(0.0, -amplitude)
        } else {
            Complex::from(amplitude)
        };
        let at = |phase: f64| {
            let turn = first * Complex::from_polar(1.0, phase);
            DVector::from_fn(2 * p, |k, _| {
                mean[k] + (root.strain[k / 2][k % 2] * turn).re
            })
        };
        let mut stimuli = vec![DMatrix::zeros(m, phases.len()); p];
        for (j, phase) in phases.angles.iter().enumerate() {
            let (rod, force) = self.equilibrate_at(&at(*phase), 0.0)?;
            visit_stimuli(self.shoot, &rod, &force, |i, _, x| {
                stimuli[i].column_mut(j).copy_from_slice(x)
            });
        }
        let balance = HarmonicBalance::new(self.shoot.model.tropism(), &phases, root.value.im);
        let points = self
            .places
            .iter()
            .zip(stimuli)
            .map(|(at, stimuli)| balance.solve(*at, stimuli));
        let points: Vec<_> = points.collect::<Result<_, _>>()?;
        Ok(self.state_of_waves(&phases, &points, at(0.0), root.value.im * period))
    }

    /// The state at t = 0 of variables that are known on a grid of phases. The phase changes by
    /// `turn` (rad) in a period.
    pub(in crate::cycle) fn state_of_waves(
        &self,
        phases: &PhaseGrid,
        periodic: &[HarmonicPoint],
        strain: DVector<f64>,
        turn: f64,
    ) -> PhaseState {
        let (v, _, p) = self.sizes();
        let in_interval = turn / self.grid.intervals as f64;
        // Values, or slopes, at a time in units of an interval.
        let read = |time: f64, slope: bool| {
            let values = phases.earlier(-in_interval * time);
            let weights = if slope {
                &values * &phases.derivative * in_interval
            } else {
                values
            };
            let each =
                |k: usize| (weights.row(0) * periodic[k / v].variables.row(k % v).transpose())[0];
            DVector::from_fn(v * p, |k, _| each(k))
        };
        let slopes = (0..self.kept).map(|n| {
            let begin = n as f64 - self.kept as f64;
            self.grid
                .stages
                .iter()
                .map(|stage| read(begin + stage, true))
                .collect()
        });
        PhaseState {
            strain,
            variables: read(0.0, false),
            slopes: slopes.collect(),
        }
    }

    /// The straight shoot with the steady variables of its stimuli, and its rod in equilibrium.
    pub(in crate::cycle) fn state_of_steady_laws(&mut self) -> Outcome<(PhaseState, Rod)> {
        let (v, _, points) = self.sizes();
        let strain = DVector::zeros(2 * points);
        let (rod, force) = self.equilibrate_at(&strain, 0.0)?;
        let variables = DVector::from_column_slice(
            SteadyLaws::of(self.shoot, &rod, &force)
                .variables
                .as_slice(),
        );
        let slopes = vec![vec![DVector::zeros(v * points); self.grid.order()]; self.kept];
        Ok((
            PhaseState {
                strain,
                variables,
                slopes,
            },
            rod,
        ))
    }
}
