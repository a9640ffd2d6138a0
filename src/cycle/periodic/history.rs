//! From an orbit into a run in time.

use nalgebra::Vector3;

use super::orbit::PeriodicOrbit;
use crate::cycle::error::CycleError;
use crate::cycle::map::grid::Grid;
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::HistoryFunction;
use crate::tropism::{Site, TropismLaw};

/// What came before a state of an orbit: the history function of a run that starts on it.
#[derive(Debug, Clone)]
pub struct OrbitHistory {
    orbit: PeriodicOrbit,
    grid: Grid,
    /// Distance from the apex of every point of the zone, m.
    distances: Vec<f64>,
}

impl PeriodicOrbit {
    /// Gives a shoot the intrinsic strain of the orbit, of the state from which it was found, at its present time. Returns what came before: with
    /// [`start(&mut shoot, &history)`](crate::integrator::Integrator::start) of an integrator the shoot takes its shape, and from then on it goes round.
    ///
    /// # Errors
    /// A shoot with another number of points or variables than that whose orbit this is, or of a driven one at another phase of what
    /// drives it; it is then as it was.
    pub fn enter(&self, shoot: &mut Shoot<impl Model>) -> Result<OrbitHistory, CycleError> {
        let zone = shoot.rod().zone();
        self.start.check(zone.len(), shoot.model().tropism().size().variables)?;
        if let Some(began) = self.driven_from {
            let (what, turns) =
                ("time since the driven orbit was found, in periods", (shoot.time() - began) / self.period);
            // A phase that is known to so many roundings.
            ParameterError::unless((turns - turns.round()).abs() < 1e-9, what, turns, "a whole number")?;
        }
        let first = zone.start;
        let distances = shoot.rod().points()[zone].iter().map(|point| point.apex_distance).collect();
        // Mature tissue below the zone keeps what it has.
        let before = std::iter::repeat_n(None, first);
        let mut strains = before.chain(self.start.strain.as_slice().chunks(2).map(Some));
        shoot.set_intrinsic(|point| match strains.next().flatten() {
            Some(pair) => Vector3::new(pair[0], pair[1], point.intrinsic.z),
            None => point.intrinsic,
        });
        let grid = Grid::new(self.settings.intervals, self.settings.stages);
        Ok(OrbitHistory { orbit: self.clone(), grid, distances })
    }
}

impl HistoryFunction for OrbitHistory {
    fn is_constant(&self) -> bool {
        false
    }

    fn variables(&self, law: &impl TropismLaw, t: f64, site: &Site, _stimuli: &[f64], variables: &mut [f64]) {
        let (start, settings) = (&self.orbit.start, &self.orbit.settings);
        let own = law.size().variables;
        if own * self.distances.len() != start.variables.len() {
            // Of other laws than those of the orbit nothing is known; integrators refuse what is no number.
            variables.fill(f64::NAN);
            return;
        }
        let near = |a: &f64, b: &f64| (a - site.apex_distance).abs().total_cmp(&(b - site.apex_distance).abs());
        let point = (0..self.distances.len()).min_by(|a, b| near(&self.distances[*a], &self.distances[*b]));
        let Some(first) = point.map(|point| point * own) else { return };
        let grid = &self.grid;
        // Backwards, interval by interval, to that of the time; further back the oldest goes on.
        let time = t * settings.intervals as f64 / self.orbit.period;
        let kept = start.slopes.len();
        // In this order a time that is no number is that of the last interval.
        let back = (-time).ceil().max(1.0).min(kept as f64) as usize;
        let upto = grid.integrals(time + back as f64);
        for (a, variable) in variables.iter_mut().enumerate() {
            *variable = start.variables[first + a];
            for slopes in &start.slopes[kept - back..] {
                *variable -= slopes.iter().zip(&grid.whole).map(|(slope, w)| w * slope[first + a]).sum::<f64>();
            }
            *variable +=
                start.slopes[kept - back].iter().zip(&upto).map(|(slope, w)| w * slope[first + a]).sum::<f64>();
        }
    }
}
