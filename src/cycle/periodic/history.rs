//! Runs in time that start on a periodic orbit: the orbit as a history function.

use nalgebra::Vector3;

use super::orbit::PeriodicOrbit;
use crate::cycle::error::CycleError;
use crate::cycle::map::{Polynomials, TimeGrid};
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::HistoryFunction;
use crate::tropism::{Site, TropismLaw};

/// The variables of an orbit before its initial state.
#[derive(Debug, Clone)]
struct OrbitHistory {
    past: Polynomials,
    grid: TimeGrid,
    /// Length of an interval, s.
    length: f64,
    /// Distance from the apex of each material point of the zone, m.
    distances: Vec<f64>,
}

impl PeriodicOrbit {
    /// Gives a shoot the intrinsic strain of the initial state of the orbit, at its present time.
    /// Returns the history before: with [`start(&mut shoot,
    /// &history)`](crate::integrator::Integrator::start) of an integrator the shoot takes its
    /// shape, and following steps advance it along the orbit.
    ///
    /// # Errors
    /// A shoot with another number of material points or variables, or, for a forced orbit, at
    /// another phase of the forcing. The shoot is then unchanged.
    pub fn enter<M: Model>(
        &self,
        shoot: &mut Shoot<M>,
    ) -> Result<impl HistoryFunction + Clone + use<M>, CycleError> {
        let zone = shoot.rod().zone();
        self.start
            .check(zone.len(), shoot.model().tropism().size().variables)?;
        if let Some(began) = self.forced_from {
            let (what, periods) = (
                "time since the forced orbit was found, in periods",
                (shoot.time() - began) / self.period,
            );
            // A phase after many periods has that many roundings.
            ParameterError::unless(
                (periods - periods.round()).abs() < 1e-9,
                what,
                periods,
                "a whole number",
            )?;
        }
        let first = zone.start;
        let distances = shoot.rod().points()[zone]
            .iter()
            .map(|point| point.apex_distance)
            .collect();
        // Mature tissue below the zone keeps its strain.
        let before = std::iter::repeat_n(None, first);
        let mut strains = before.chain(self.start.strain.as_slice().chunks(2).map(Some));
        shoot.set_intrinsic(|point| match strains.next().flatten() {
            Some(pair) => Vector3::new(pair[0], pair[1], point.intrinsic.z),
            None => point.intrinsic,
        });
        let grid = TimeGrid::new(self.settings.intervals, self.settings.stages);
        let (past, length) = (
            Polynomials::of(&self.start, &grid),
            self.period / grid.intervals as f64,
        );
        Ok(OrbitHistory {
            past,
            grid,
            length,
            distances,
        })
    }
}

impl HistoryFunction for OrbitHistory {
    fn is_constant(&self) -> bool {
        false
    }

    fn variables(
        &self,
        law: &impl TropismLaw,
        t: f64,
        site: &Site,
        _stimuli: &[f64],
        variables: &mut [f64],
    ) {
        let own = law.size().variables;
        if own * self.distances.len() != self.past.begins[0].len() {
            // The history of other laws is unknown. Integrators return an error for NaN.
            variables.fill(f64::NAN);
            return;
        }
        let near = |a: &f64, b: &f64| {
            (a - site.apex_distance)
                .abs()
                .total_cmp(&(b - site.apex_distance).abs())
        };
        let point =
            (0..self.distances.len()).min_by(|a, b| near(&self.distances[*a], &self.distances[*b]));
        let Some(first) = point.map(|point| point * own) else {
            return;
        };
        let (time, kept) = (t / self.length, self.past.slopes.len());
        // The polynomial of the oldest interval is extrapolated. In this order of `max` and `min`
        // NaN is a time in the last interval.
        let back = (-time).ceil().max(1.0).min(kept as f64) as usize;
        let weights = self.grid.integrals(time + back as f64);
        for (a, variable) in variables.iter_mut().enumerate() {
            *variable = self.past.value(kept - back, &weights, first + a);
        }
    }
}
