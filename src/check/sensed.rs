//! Stimuli, variables and rates of a tropism law at a site, and what must hold among them.

use nalgebra::Vector3;

use super::error::{At, Checked, LawError, Quantity};
use crate::tropism::{
    Declaration, Growing, Site, Source, TropismLaw, Variable, rates_in_steady_state,
};

/// Largest rate of a variable in its steady state relative to the terms that cancel in it. It
/// allows for laws that compute their steady state by iteration.
const STEADY: f64 = 1e-8;
/// Relative error of values that are computed in two ways by a few operations.
pub(super) const SAME: f64 = 1e-9;
/// Factors by which variables of states differ from steady and initial ones. Those of neighbours
/// are different.
const FACTORS: [f64; 5] = [1.31, 0.74, 1.13, 0.58, 0.87];

/// Stimuli at a site, and states of the variables there.
pub(super) struct Sensed<'a, T> {
    law: &'a T,
    declaration: &'a Declaration,
    at: At,
    place: Growing,
    pub stimuli: Vec<f64>,
    steady: Vec<f64>,
    /// States that are not steady.
    pub states: [Vec<f64>; 2],
}

/// Calls a function that writes `number` values, and returns an error for one that is not written
/// or not finite.
fn written(
    at: At,
    number: usize,
    quantity: impl Fn(usize) -> Quantity,
    write: impl FnOnce(&mut [f64]),
) -> Result<Vec<f64>, LawError> {
    let mut values = vec![f64::NAN; number];
    write(&mut values);
    values
        .iter()
        .enumerate()
        .try_for_each(|(k, value)| at.finite(quantity(k), *value))?;
    Ok(values)
}

impl<'a, T: TropismLaw> Sensed<'a, T> {
    pub fn new(
        law: &'a T,
        declaration: &'a Declaration,
        at: At,
        site: &Site,
    ) -> Result<Self, LawError> {
        let (size, counted) = (declaration.size(), law.size());
        let requirement = "the number that is declared";
        at.equal(
            Quantity::Stimuli,
            [counted.stimuli, size.stimuli].map(|n| n as f64),
            0.0,
            requirement,
        )?;
        at.equal(
            Quantity::Variables,
            [counted.variables, size.variables].map(|n| n as f64),
            0.0,
            requirement,
        )?;
        let mut site = *site;
        if !declaration.reads_position() {
            site.position = Vector3::repeat(f64::NAN);
        }
        let stimuli = written(at, size.stimuli, Quantity::Stimulus, |to| {
            law.sense(&site, to)
        })?;
        let steady = written(at, size.variables, Quantity::Steady, |to| {
            law.steady(&stimuli, to)
        })?;
        let initial = written(at, size.variables, Quantity::Initial, |to| {
            law.initial(&stimuli, to)
        })?;
        let factors = || FACTORS.iter().cycle();
        let mixed = steady
            .iter()
            .zip(&initial)
            .map(|(y, start)| 0.5 * (y + start));
        let states = [
            steady
                .iter()
                .zip(factors())
                .map(|(y, factor)| y * factor)
                .collect(),
            mixed
                .zip(factors().skip(2))
                .map(|(y, factor)| y * factor)
                .collect(),
        ];
        let place = Growing::at(&site);
        Ok(Self {
            law,
            declaration,
            at,
            place,
            stimuli,
            steady,
            states,
        })
    }

    /// Rates in a state.
    pub fn rates(&self, state: &[f64]) -> Result<Vec<f64>, LawError> {
        written(self.at, state.len(), Quantity::Rate, |to| {
            self.law.rates(state, &self.stimuli, to)
        })
    }

    /// Growth gradient in a state and under stimuli, without the variables that it does not read.
    pub fn gradient(&self, state: &[f64], stimuli: &[f64]) -> Result<Vector3<f64>, LawError> {
        let read = |(y, variable): (&f64, &Variable)| {
            if variable.delay.is_some() {
                *y
            } else {
                f64::NAN
            }
        };
        let past: Vec<_> = state
            .iter()
            .zip(self.declaration.variables())
            .map(read)
            .collect();
        let gradient =
            self.law
                .gradient(&self.place, &past, self.declaration.size().present(stimuli));
        (0..3).try_for_each(|c| self.at.finite(Quantity::Gradient(c), gradient[c]))?;
        Ok(gradient)
    }

    /// Compares the methods of the law with each other.
    pub fn check(&self) -> Checked {
        for state in &self.states {
            let rates = self.rates(state)?;
            self.check_memories(state, &rates)?;
            self.check_coupled(state, &rates)?;
            self.gradient(state, &self.stimuli)?;
        }
        self.check_steady()
    }

    fn check_steady(&self) -> Checked {
        let rates = |y: &[f64]| rates_in_steady_state(self.law, &self.place, y, &self.stimuli);
        let vanishes = |(rate, terms): &(f64, f64)| rate.abs() <= STEADY * terms;
        let found = rates(&self.steady);
        if found.iter().all(vanishes) {
            return Ok(());
        }
        // A wrong variable also changes the rates of others. If one has the wrong sign, all rates
        // vanish without it.
        let flipped = (0..found.len()).find(|k| {
            let mut steady = self.steady.clone();
            steady[*k] = -steady[*k];
            rates(&steady).iter().all(vanishes)
        });
        let share = |k: &usize| found[*k].0.abs() / found[*k].1;
        let largest = (0..found.len())
            .filter(|k| !vanishes(&found[*k]))
            .max_by(|a, b| share(a).total_cmp(&share(b)));
        let k = flipped.or(largest).unwrap_or(0);
        let requirement = "since the rates vanish in the steady state";
        Err(self
            .at
            .error(Quantity::Steady(k), [found[k].0, 0.0], requirement))
    }

    fn check_memories(&self, state: &[f64], rates: &[f64]) -> Checked {
        for (k, variable) in self.declaration.variables().iter().enumerate() {
            variable
                .check_rate(k, rates[k], state, &self.stimuli)
                .map_err(|expected| {
                    let requirement = "that of the declared memory, (x − y)/τ";
                    self.at
                        .error(Quantity::Rate(k), [rates[k], expected], requirement)
                })?;
        }
        Ok(())
    }

    fn check_coupled(&self, state: &[f64], rates: &[f64]) -> Checked {
        let variables = self.declaration.variables();
        // Memories of a memory are integrated together with it.
        let reads = |k: usize| {
            variables
                .iter()
                .any(|other| other.remembers == Source::Variable(k))
        };
        let is_read =
            |k: usize| reads(k) || variables[k].turns.is_some_and(|(_, other)| reads(other));
        let omitted = |k: usize| {
            !variables[k].coupled && variables[k].remembers != Source::Computed && !is_read(k)
        };
        let known: Vec<_> = state
            .iter()
            .enumerate()
            .map(|(k, y)| if omitted(k) { f64::NAN } else { *y })
            .collect();
        let mut coupled = vec![f64::NAN; state.len()];
        self.law.coupled_rates(&known, &self.stimuli, &mut coupled);
        for k in (0..state.len()).filter(|k| !omitted(*k)) {
            let size = rates[k].abs() + (state[k] / variables[k].time_constant).abs();
            let requirement = "that of `rates`, without the variables that are not coupled";
            self.at.equal(
                Quantity::CoupledRate(k),
                [coupled[k], rates[k]],
                SAME * size,
                requirement,
            )?;
        }
        Ok(())
    }
}
