//! Picard iteration for the variables of a point that depend on each other, over one interval.

use std::array::from_fn;

use super::ORDER;
use super::memories::Parts;
use super::relaxation::{Kernel, LANES, Lanes};
use crate::state::LEVELS;
use crate::tropism::TropismLaw;

/// Largest number of sweeps over an interval before it is halved. An interval that resolves the
/// nonlinearity well has a contraction by 1/16 in each sweep, and reaches [`TOLERANCE`] in this
/// number of sweeps. With twelve sweeps, avalanches of statoliths from 170° on were integrated with
/// errors of 1.4e-4 rad instead of 5e-5 rad.
const MAX_SWEEPS: usize = 9;
/// Largest error of a converged variable, relative to its size and its change in the interval: far
/// below any error in time.
pub(super) const TOLERANCE: f64 = 1e-12;

/// Group of iterated variables at consecutive places among the variables of a point. Values in
/// further lanes are NaN.
#[derive(Debug, Clone, Copy, Default)]
struct Group {
    /// Place of the first variable, and the number of variables.
    first: usize,
    count: usize,
    /// The stimuli that the variables approach. Others have a place after the last one.
    sources: [usize; LANES],
    /// 1/τ.
    inverse: Lanes,
    /// Variables at the start of the interval.
    start: Lanes,
    /// Variables at the present node.
    value: Lanes,
    /// Absolute change of the variables over the interval at the initial rate.
    motion: Lanes,
    /// Largest effect of a change of N in this sweep on each variable, relative to its size and its
    /// motion, since variables may have different units.
    change: Lanes,
    /// N at each node.
    forcing: [Lanes; ORDER],
    /// x/τ at each node, with the stimulus x that the variable approaches: N if it is its linear
    /// memory.
    target: [Lanes; ORDER],
}

impl Group {
    /// Evaluates the variables at node `j`.
    // Not inlined, so that the operations on one group are vectorised.
    #[inline(never)]
    fn integrate_to(&mut self, j: usize, kernel: &Kernel) {
        let mut value: Lanes = from_fn(|i| kernel.decay[j][i] * self.start[i]);
        for l in 0..ORDER {
            for i in 0..LANES {
                value[i] += kernel.integral[j][l][i] * self.forcing[l][i];
            }
        }
        self.value = value;
    }

    /// Sets N = ẏ + y/τ at node `j`.
    #[inline(never)]
    fn force(&mut self, j: usize, rate: &Lanes, kernel: &Kernel) {
        let (value, forcing) = (&self.value, &mut self.forcing[j]);
        for i in 0..LANES {
            let new = rate[i] + value[i] * self.inverse[i];
            let motion = kernel.reach[i] * (new - forcing[i]).abs();
            let change = motion / (value[i].abs() + self.motion[i] + f64::MIN_POSITIVE);
            self.change[i] = if change > self.change[i] {
                change
            } else {
                self.change[i]
            };
            forcing[i] = new;
        }
    }

    /// Entries of the group in a list with a number for each variable. Values in further lanes are
    /// arbitrary.
    #[inline]
    fn gather(&self, from: &[f64]) -> Lanes {
        let after = from.get(self.first..).unwrap_or_default();
        after
            .first_chunk()
            .copied()
            .unwrap_or_else(|| from_fn(|i| after.get(i).copied().unwrap_or(0.0)))
    }
}

/// Iteration for some of the variables of a point.
#[derive(Debug, Clone, Default)]
pub(super) struct Picard {
    /// Number of variables of a point.
    variables: usize,
    groups: Vec<Group>,
    /// Variables at a node, and numbers for further lanes of the last group. Variables that are not
    /// iterated are NaN.
    values: Vec<f64>,
    /// Rates, and numbers for further lanes.
    rates: Vec<f64>,
    /// Whether the last interval of this step converged. Its N − x/τ is then the initial guess of
    /// the next one.
    follows: bool,
    /// Slowest contraction of the sweeps over the last interval of this step; infinite if it is not
    /// known.
    contraction: f64,
}

impl Picard {
    /// Allocates the workspace for a number of variables, some of which are iterated.
    pub fn set(&mut self, variables: usize, parts: &Parts) {
        self.variables = variables;
        self.groups.clear();
        self.groups.extend(parts.groups().map(|iterated| {
            let mut group = Group {
                sources: [usize::MAX; LANES],
                count: iterated.len(),
                ..Group::default()
            };
            group.first = iterated
                .first()
                .map_or(variables, |iterated| iterated.variable);
            for (i, iterated) in iterated.iter().enumerate() {
                group.inverse[i] = 1.0 / iterated.time;
                group.sources[i] = iterated.source;
            }
            group
        }));
        for numbers in [&mut self.values, &mut self.rates] {
            numbers.clear();
            numbers.resize(variables + LANES, f64::NAN);
        }
    }

    /// Begins a step: there is no initial guess, and rates that the law does not write are NaN.
    pub fn begin_step(&mut self) {
        self.forget();
        self.rates.fill(f64::NAN);
    }

    /// Discards what the last interval contributes to the next one.
    fn forget(&mut self) {
        (self.follows, self.contraction) = (false, f64::INFINITY);
    }

    /// An iterated variable at the start of the interval, and its N at each node. The variable is
    /// given by its group times [`LANES`] plus its lane.
    #[inline]
    pub fn course(&self, place: usize) -> (f64, [f64; LEVELS]) {
        let (group, lane) = (&self.groups[place / LANES], place % LANES);
        let value = |node| {
            group
                .forcing
                .get(node)
                .map_or(0.0, |forcing: &Lanes| forcing[lane])
        };
        (group.start[lane], from_fn(value))
    }

    /// Writes the values of a group to the list of all variables. The next groups overwrite further
    /// lanes.
    #[inline]
    fn scatter(values: &mut [f64], group: &Group) {
        values[group.first..group.first + LANES].copy_from_slice(&group.value);
    }

    /// Evaluates the rates of the present values.
    #[inline]
    fn evaluate_rates(&mut self, law: &impl TropismLaw, stimuli: &[f64]) {
        law.coupled_rates(
            &self.values[..self.variables],
            stimuli,
            &mut self.rates[..self.variables],
        );
    }

    /// Sets the initial guess of an interval that starts with variables `y`, and with their rates
    /// if these are known. N − x/τ, with the stimulus x that a variable approaches, changes as in
    /// the last interval that converged in this step, or is constant.
    pub fn begin(
        &mut self,
        law: &impl TropismLaw,
        stimuli: &[&[f64]; ORDER],
        (y, rates): (&[f64], Option<&[f64]>),
        kernels: &[Kernel],
    ) {
        let follows = self.follows;
        for group in &mut self.groups {
            group.start = group.gather(y);
        }
        if rates.is_none() {
            for group in &mut self.groups {
                group.value = group.start;
                group.value[group.count..].fill(f64::NAN);
                Self::scatter(&mut self.values, group);
            }
            self.evaluate_rates(law, stimuli[0]);
        }
        for (group, kernel) in self.groups.iter_mut().zip(kernels) {
            let rate = group.gather(rates.unwrap_or(&self.rates));
            group.motion = from_fn(|i| kernel.reach[i] * rate[i].abs());
            let forcing: Lanes = from_fn(|i| rate[i] + group.start[i] * group.inverse[i]);
            // N − x/τ at the start of the last interval, and x/τ at the start of this one.
            let (mut rest, mut first) = ([0.0; LANES], [0.0; LANES]);
            for (j, stimuli) in stimuli.iter().enumerate() {
                let (at, target) = (&mut group.forcing[j], &mut group.target[j]);
                let change: Lanes = if follows {
                    from_fn(|i| at[i] - target[i])
                } else {
                    [0.0; LANES]
                };
                *target = from_fn(|i| {
                    group.inverse[i] * stimuli.get(group.sources[i]).copied().unwrap_or(0.0)
                });
                if j == 0 {
                    (rest, first) = (change, *target);
                }
                *at = from_fn(|i| forcing[i] + (target[i] - first[i]) + (change[i] - rest[i]));
            }
        }
    }

    /// Evaluates the variables at node `j` from N at all nodes.
    #[inline]
    fn integrate_to(&mut self, j: usize, kernels: &[Kernel]) {
        for (group, kernel) in self.groups.iter_mut().zip(kernels) {
            group.integrate_to(j, kernel);
            Self::scatter(&mut self.values, group);
        }
    }

    /// Evaluates N at node `j`.
    #[inline]
    fn force(&mut self, law: &impl TropismLaw, j: usize, stimuli: &[f64], kernels: &[Kernel]) {
        self.evaluate_rates(law, stimuli);
        for (group, kernel) in self.groups.iter_mut().zip(kernels) {
            group.force(j, &group.gather(&self.rates), kernel);
        }
    }

    /// Largest relative effect of a change of N on a variable since the last call.
    #[inline]
    fn take_change(&mut self) -> f64 {
        let changes = self
            .groups
            .iter_mut()
            .flat_map(|group| std::mem::take(&mut group.change));
        changes.fold(
            0.0,
            |largest, change| if change > largest { change } else { largest },
        )
    }

    /// Iterates from the initial guess of N, with the stimuli at each node. Writes the variables at
    /// the end of the interval to `y`. Returns whether the iteration converged.
    pub fn sweep(
        &mut self,
        law: &impl TropismLaw,
        stimuli: &[&[f64]; ORDER],
        y: &mut [f64],
        kernels: &[Kernel],
    ) -> bool {
        // The contraction of the sweeps may alternate between large and small if two variables
        // depend on each other. The error estimate therefore needs that of two sweeps, or the
        // slowest one of the last interval.
        let (mut last, mut last_ratio, mut slowest) = (f64::INFINITY, self.contraction, 0.0_f64);
        for sweep in 0..MAX_SWEEPS {
            // Each node uses the new values at the nodes before it (Gauss–Seidel).
            for j in 1..ORDER {
                self.integrate_to(j, kernels);
                self.force(law, j, stimuli[j], kernels);
            }
            let change = self.take_change();
            if change == f64::INFINITY {
                break;
            }
            let ratio = change / last;
            slowest = slowest.max(ratio);
            // The error estimate is the expected next change, by the slower contraction.
            let next = change * ratio.max(last_ratio);
            if change <= TOLERANCE || (sweep > 0 && next <= TOLERANCE) {
                self.integrate_to(ORDER - 1, kernels);
                let mut finite = true;
                for group in &self.groups {
                    for (y, value) in y
                        .iter_mut()
                        .skip(group.first)
                        .zip(&group.value[..group.count])
                    {
                        *y = *value;
                        finite &= value.is_finite();
                    }
                }
                self.follows = finite;
                self.contraction = if sweep > 1 {
                    slowest
                } else {
                    self.contraction.max(ratio)
                };
                return finite;
            }
            if sweep > 1 {
                // The expected next change of the last sweep is above the tolerance, even with the
                // faster one of the last two contractions.
                let remaining = (MAX_SWEEPS - sweep) as i32;
                if change * ratio.min(last_ratio).powi(remaining) > TOLERANCE {
                    break;
                }
            }
            if sweep > 0 {
                last_ratio = ratio;
            }
            last = change;
        }
        // Values that did not converge may be NaN, and are not used as an initial guess.
        self.forget();
        false
    }
}
