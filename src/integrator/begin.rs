//! The beginning of a run: the first equilibrium and the history before it.

use super::step_size::starts_at_discontinuity;
use super::stepper::Stepper;
use super::{HistoryFunction, IntegrationError, Outcome, STIMULUS};
use crate::equilibrium::EquilibriumSolver;
use crate::error::ParameterError;
use crate::model::Model;
use crate::quadrature::lagrange_derivatives;
use crate::scene::before;
use crate::sensing::visit_sites;
use crate::shoot::Shoot;
use crate::state::History;
use crate::tropism::{Source, TropismLaw};

/// Intervals into which a history that varies is sampled, over the longest delay.
const SAMPLES: usize = 64;

impl Stepper {
    /// Finds the equilibrium at the present time and gives the laws a history.
    pub fn begin(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        past: &impl HistoryFunction,
    ) -> Outcome {
        let now = shoot.state.time;
        let discontinuity = starts_at_discontinuity(shoot)?;
        self.equilibrate(shoot, solver, if discontinuity { before(now) } else { now })?;
        let (state, tropism) = (&mut shoot.state, shoot.model.tropism());
        state.predictor.make_room(&state.rod, now);
        (state.smooth_since, state.changed) = (now, false);
        let (size, longest) = (self.laws.size(), self.laws.longest_delay());
        // Levels before now, and now twice: with the rates of the past, and with those that the stimuli cause.
        let intervals = if past.is_constant() { 1 } else { SAMPLES };
        let first = if longest == 0.0 { intervals } else { 0 };
        let times = (first..=intervals).map(|i| now - longest * (1.0 - i as f64 / intervals as f64)).chain([now]);
        let mut history = History::zeros((size.variables, size.stimuli), state.rod.zone().len(), times);
        let mut stimuli = vec![0.0; size.stimuli];
        let (position, mut finite) = (self.laws.reads_position(), true);
        visit_sites(&state.rod, shoot.model.constitutive(), &self.force, position, |i, site| {
            tropism.sense(site, &mut stimuli);
            finite &= stimuli.iter().all(|x| x.is_finite());
            for level in 0..history.levels() {
                let time = history.time(level) - now;
                let point = history.at_mut(level, i);
                past.variables(tropism, time, site, &stimuli, point.variables);
                point.stimuli.copy_from_slice(&stimuli);
            }
        });
        if !finite {
            return Err(IntegrationError::NotFinite { what: STIMULUS, time: now });
        }
        if !past.is_constant() && longest > 0.0 {
            differentiate(&mut history);
        }
        state.history = history;
        self.find_rates(shoot);
        if !shoot.state.history.is_finite() {
            return Err(IntegrationError::NotFinite { what: "history of the variables", time: now });
        }
        self.check_memories(&mut shoot.state.history)?;
        if discontinuity { self.pass_discontinuity(shoot, solver) } else { Ok(()) }
    }

    /// Refuses laws whose rates are not those of the linear memories that they declare.
    fn check_memories(&self, history: &mut History) -> Result<(), ParameterError> {
        for point in history.each_present() {
            for (i, variable) in self.laws.variables().iter().enumerate() {
                let x = match variable.remembers {
                    Source::Stimulus(k) => point.stimuli[k],
                    Source::Variable(k) => point.variables[k],
                    Source::Computed => continue,
                };
                let (y, change) = (point.variables[i], point.rates[i] * variable.time_constant);
                // One subtraction and one quotient, however the law writes them.
                let linear = (change - (x - y)).abs() <= 16.0 * f64::EPSILON * (x.abs() + y.abs());
                let name = "rate of a variable that is declared a memory, times its time constant";
                ParameterError::unless(linear, name, change, "what it remembers minus itself")?;
            }
        }
        Ok(())
    }
}

/// Fills in the rates of a sampled history by differentiating the polynomials through five samples: fourth order.
fn differentiate(history: &mut History) {
    // The last level is the present with the rates that follow from the stimuli.
    let known = history.levels() - 1;
    let times: Vec<f64> = (0..known).map(|level| history.time(level)).collect();
    for level in 0..known {
        let first = level.saturating_sub(2).min(known - 5);
        let weights = lagrange_derivatives(&times[first..first + 5], times[level]);
        for point in 0..history.points() {
            for k in 0..history.size().0 {
                let rate = (0..5).map(|j| weights[j] * history.variables(first + j, point)[k]).sum();
                history.at_mut(level, point).rates[k] = rate;
            }
        }
    }
}
