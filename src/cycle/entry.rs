//! From an orbit into a run in time.

use nalgebra::Vector3;

use super::error::CycleError;
use super::periodic::PeriodicOrbit;
use crate::error::ParameterError;
use crate::integrator::HistoryFunction;
use crate::model::Model;
use crate::quadrature::{gauss, lagrange};
use crate::shoot::Shoot;
use crate::tropism::{Site, TropismLaw};

/// What came before a state of an orbit: the history function of a run that starts on it.
#[derive(Debug, Clone)]
pub struct OrbitHistory {
    orbit: PeriodicOrbit,
    /// Distance from the apex of every point of the zone, m.
    distances: Vec<f64>,
}

impl PeriodicOrbit {
    /// Puts a shoot on the orbit at its present time, the state from which the orbit was found, and returns what came before:
    /// give it to [`Integrator::start`](crate::integrator::Integrator::start), and the shoot goes round.
    ///
    /// # Errors
    /// A shoot with another number of points or variables than that whose orbit this is; it is then as it was.
    pub fn enter(&self, shoot: &mut Shoot<impl Model>) -> Result<OrbitHistory, CycleError> {
        let zone = shoot.rod().zone();
        let (points, variables) = (self.start.strain.len() / 2, shoot.model().tropism().size().variables);
        let same = zone.len() == points && self.start.variables.len() == variables * points;
        let what = "material points of the orbit";
        ParameterError::unless(same, what, points as f64, "those of the shoot whose orbit it is, with its variables")?;
        let first = zone.start;
        let distances = shoot.rod().points()[zone].iter().map(|point| point.apex_distance).collect();
        // Mature tissue below the zone keeps what it has.
        let before = std::iter::repeat_n(None, first);
        let mut strains = before.chain(self.start.strain.as_slice().chunks(2).map(Some));
        shoot.set_intrinsic(|point| match strains.next().flatten() {
            Some(pair) => Vector3::new(pair[0], pair[1], point.intrinsic.z),
            None => point.intrinsic,
        });
        Ok(OrbitHistory { orbit: self.clone(), distances })
    }
}

impl HistoryFunction for OrbitHistory {
    fn is_constant(&self) -> bool {
        false
    }

    fn variables(&self, law: &impl TropismLaw, t: f64, site: &Site, _stimuli: &[f64], variables: &mut [f64]) {
        let (start, settings) = (&self.orbit.start, &self.orbit.settings);
        let own = law.size().variables;
        let near = |a: &f64, b: &f64| (a - site.apex_distance).abs().total_cmp(&(b - site.apex_distance).abs());
        let point = (0..self.distances.len()).min_by(|a, b| near(&self.distances[*a], &self.distances[*b]));
        let Some(first) = point.map(|point| point * own) else { return };
        let (stages, weights) = gauss(settings.stages);
        // Backwards, interval by interval, to that of the time; further back the oldest goes on.
        let time = t * settings.intervals as f64 / self.orbit.period;
        let kept = start.slopes.len();
        let back = (-time).ceil().clamp(1.0, kept as f64) as usize;
        let (from, mut values) = (time + back as f64, vec![0.0; settings.stages]);
        for (a, variable) in variables.iter_mut().enumerate() {
            *variable = start.variables[first + a];
            for slopes in &start.slopes[kept - back..] {
                *variable -= slopes.iter().zip(&weights).map(|(slope, w)| w * slope[first + a]).sum::<f64>();
            }
            for (at, weight) in stages.iter().zip(&weights) {
                lagrange(&stages, from * at, &mut values);
                let slope: f64 = start.slopes[kept - back].iter().zip(&values).map(|(s, l)| l * s[first + a]).sum();
                *variable += from * weight * slope;
            }
        }
    }
}
