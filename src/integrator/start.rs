//! The beginning of a run: the first equilibrium and the past.

use std::collections::VecDeque;

use super::IntegrationError;
use super::past::Past;
use super::stepper::{Stepper, longest, place};
use crate::equilibrium::EquilibriumSolver;
use crate::model::Model;
use crate::quadrature::lagrange_derivatives;
use crate::sensing::visit_sites;
use crate::shoot::Shoot;
use crate::state::{History, Level};
use crate::tropism::TropismLaw;

/// Intervals into which a past that varies is sampled, over the longest delay.
const SAMPLES: usize = 64;

impl Stepper {
    /// Finds the equilibrium at the present time and gives the laws a past.
    pub fn begin(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        past: &impl Past,
    ) -> Result<(), IntegrationError> {
        let now = shoot.state.time;
        let environment = place(shoot, now)?;
        self.settle(shoot, solver, &environment)?;
        shoot.state.make_room_for_guesses();
        shoot.state.smooth_since = now;
        let tropism = shoot.model.tropism();
        let (v, m) = (tropism.variables(), tropism.stimuli());
        let width = 2 * v + m;
        let mut delays = vec![0.0; v];
        tropism.delays(&mut delays);
        let longest = longest(&delays);
        // Levels before now, and now twice: with the rates of the past, and with those that the stimuli cause.
        let intervals = if past.is_constant() { 1 } else { SAMPLES };
        let rod = &shoot.state.rod;
        let points = rod.points().len() - rod.first_growing() * rod.order().points();
        let times = (0..=intervals).map(|i| now - longest * (1.0 - i as f64 / intervals as f64)).chain([now]);
        let mut levels: VecDeque<Level> = times.map(|time| Level { time, rows: vec![0.0; points * width] }).collect();
        if longest == 0.0 {
            levels.drain(..intervals);
        }
        let position = tropism.needs_position();
        let mut stimuli = vec![0.0; m];
        visit_sites(rod, shoot.model.constitutive(), &self.force, position, |i, site| {
            tropism.sense(site, &mut stimuli);
            for level in &mut levels {
                let row = &mut level.rows[i * width..(i + 1) * width];
                past.variables(tropism, level.time - now, site, &stimuli, &mut row[..v]);
                row[2 * v..].copy_from_slice(&stimuli);
            }
            if let Some(level) = levels.back_mut() {
                let (values, seen) = level.rows[i * width..(i + 1) * width].split_at_mut(2 * v);
                let (y, rates) = values.split_at_mut(v);
                tropism.rates(y, seen, rates);
            }
        });
        if !past.is_constant() && longest > 0.0 {
            differentiate(&mut levels, v, width);
        }
        if levels.iter().any(|level| level.rows.iter().any(|x| !x.is_finite())) {
            return Err(IntegrationError::NotFinite { what: "past of the variables", time: now });
        }
        shoot.state.history = History { variables: v, stimuli: m, levels };
        Ok(())
    }
}

/// Fills in the rates of a sampled past by differentiating the polynomials through five samples: fourth order.
fn differentiate(levels: &mut VecDeque<Level>, v: usize, width: usize) {
    // The last level is the present with the rates that follow from the stimuli.
    let known = levels.len() - 1;
    let times: Vec<f64> = levels.iter().take(known).map(|level| level.time).collect();
    for i in 0..known {
        let first = i.saturating_sub(2).min(known - 5);
        let weights = lagrange_derivatives(&times[first..first + 5], times[i]);
        for at in 0..levels[i].rows.len() / width.max(1) {
            for k in 0..v {
                let rate = (0..5).map(|j| weights[j] * levels[first + j].rows[at * width + k]).sum();
                levels[i].rows[at * width + v + k] = rate;
            }
        }
    }
}
