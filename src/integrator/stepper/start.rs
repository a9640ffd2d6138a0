//! Start of a run: the first equilibrium and the history before it.

use super::phases::RATE;
use super::{FIRST_STEP, HistoryFunction, IntegrationError, Outcome, Run};
use crate::equilibrium::{Equilibrium, EquilibriumSolver};
use crate::model::{Model, Support, next_discontinuity};
use crate::numerics::interpolation::lagrange_derivatives;
use crate::scene::{after, before};
use crate::state::History;

impl<M: Model, E: EquilibriumSolver> Run<'_, M, E> {
    /// Solves the equilibrium at the present time, unless it is `known`, and sets the history of
    /// the laws.
    pub(super) fn begin(
        &mut self,
        past: &impl HistoryFunction,
        known: Option<Equilibrium>,
    ) -> Outcome {
        let Self { stepper, shoot, .. } = self;
        let now = shoot.state.time;
        let discontinuity = next_discontinuity(&shoot.model, before(now))? <= after(now);
        stepper.begin_increment(shoot);
        match known.filter(|_| !discontinuity && shoot.model.support().is_absent()) {
            Some(known) => {
                let environment = stepper.move_base(shoot, now)?;
                stepper
                    .force
                    .update(&shoot.state.rod, shoot.model.load(), &environment);
                stepper.statistics.equilibrium_error = known.error;
            }
            None => {
                let time = if discontinuity { before(now) } else { now };
                let found = self.solve_equilibrium(time)?;
                self.stepper.statistics.add_equilibrium(&found);
            }
        }
        let Self { stepper, shoot, .. } = self;
        let (state, tropism) = (&mut shoot.state, shoot.model.tropism());
        state.predictor.allocate(&state.rod, now);
        (state.smooth_since, state.changed) = (now, false);
        let (size, longest) = (stepper.laws.size(), stepper.laws.longest_delay());
        // A history that varies is sampled as finely as the first steps, relative to the longest
        // delay. The present has two levels: one with the rates of the past, and one with the rates
        // that follow from the stimuli.
        let intervals = if past.is_constant() {
            1
        } else {
            FIRST_STEP.recip() as usize
        };
        let first = if longest == 0.0 { intervals } else { 0 };
        let times = (first..=intervals)
            .map(|i| now - longest * (1.0 - i as f64 / intervals as f64))
            .chain([now]);
        let mut history = History::zeros(
            (size.variables, size.stimuli),
            state.rod.zone().len(),
            times,
        );
        if size.variables + size.stimuli > 0 {
            let rod = (&state.rod, state.contact.shape.as_ref());
            stepper.visit_stimuli(rod, &shoot.model, now, |i, site, stimuli| {
                for level in 0..history.levels() {
                    let time = history.time(level) - now;
                    let point = history.at_mut(level, i);
                    past.variables(tropism, time, site, stimuli, point.variables);
                    point.stimuli.copy_from_slice(stimuli);
                }
            })?;
        }
        if !past.is_constant() && longest > 0.0 {
            differentiate(&mut history);
        }
        state.history = history;
        stepper.evaluate_rates(shoot);
        if !shoot.state.history.is_finite() {
            let mut present = shoot.state.history.each_present();
            let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
            let undefined = present.any(|point| finite(point.variables) && !finite(point.rates));
            let what = if undefined {
                RATE
            } else {
                "history of the variables of the tropism laws"
            };
            return Err(IntegrationError::NotFinite { what, time: now });
        }
        for point in shoot.state.history.each_present() {
            stepper
                .laws
                .check_rates(point.variables, point.rates, point.stimuli)?;
        }
        if discontinuity {
            self.pass_discontinuity(0)
        } else {
            Ok(())
        }
    }
}

/// Sets the rates of a sampled history to the derivatives of the polynomials through five samples,
/// of fourth order.
fn differentiate(history: &mut History) {
    // The rates of the last level follow from the stimuli.
    let known = history.levels() - 1;
    let times: Vec<f64> = (0..known).map(|level| history.time(level)).collect();
    for level in 0..known {
        let first = level.saturating_sub(2).min(known - 5);
        let weights = lagrange_derivatives(&times[first..first + 5], times[level]);
        for point in 0..history.points() {
            for k in 0..history.size().0 {
                let rate = (0..5)
                    .map(|j| weights[j] * history.variables(first + j, point)[k])
                    .sum();
                history.at_mut(level, point).rates[k] = rate;
            }
        }
    }
}
