//! The fit: searches from several initial guesses in growing parts of the data, and estimates of
//! the noise.

use std::fmt::Display;
use std::sync::{Mutex, PoisonError};

use nalgebra::DVector;

use super::answer::estimates;
use super::parameter::initial_values;
use super::problem::{Point, Problem};
use super::search::{Reached, StoppingRule, search};
use super::series::{Series, span};
use super::warning::ambiguous_frames;
use super::{Estimates, Family, Fit, FitError, Warning};
use crate::ensemble;
use crate::model::Model;
use crate::numerics::scalar::sort_by_value;
use crate::shoot::Shoot;

/// End of a search in a part of the data, whose result is the initial guess of the next search.
const INTERMEDIATE: StoppingRule = StoppingRule {
    accuracy: 0.1,
    iterations: 20,
};

/// Predicted length of a step, in standard errors, at which the last search ends.
const FINAL: f64 = 1e-3;

/// Largest number of estimates of the noise. Usually two suffice. The fit has not converged if this
/// number does not.
const NOISE_ESTIMATES: usize = 20;

/// Prime bases of the Halton sequence (J. H. Halton, Numer. Math. 2, 84, 1960) for successive free
/// parameters. Further parameters use them again.
const PRIMES: [u32; 24] = [
    2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89,
];

impl Fit {
    /// Estimates the parameters of a family of shoots from data of one shoot.
    ///
    /// # Errors
    /// Settings, parameters or data that are invalid; the error of the family or of a simulation at
    /// the initial values, or where such errors prevent any further step; work beyond
    /// [`max_work`](Self::max_work). A search that does not converge is a
    /// [`Warning`](super::Warning::NotConverged).
    pub fn run<M: Model, E: Display>(
        &self,
        family: &Family<impl Fn(&[f64]) -> Result<Shoot<M>, E> + Sync>,
        data: &[Series],
    ) -> Result<Estimates, FitError> {
        self.run_showing(family, data, |_| {})
    }

    /// The same as [`run`](Self::run). After each search but the last one, `show` receives the
    /// completed part of the work, below 1: the simulated times of the completed searches over
    /// those of all.
    ///
    /// # Errors
    /// The errors of [`run`](Self::run).
    pub fn run_showing<M: Model, E: Display>(
        &self,
        family: &Family<impl Fn(&[f64]) -> Result<Shoot<M>, E> + Sync>,
        data: &[Series],
        show: impl Fn(f64) + Sync,
    ) -> Result<Estimates, FitError> {
        family.check(self, data)?;
        let mut problem = family.problem(self, data, initial_values(&family.parameters));
        let (guess, objectives) = self.guess(&problem, show)?;
        let Reached { point, converged } = self.last_search(&mut problem, &guess)?;
        let is_converged = converged?;
        let mut found = Estimates {
            objectives,
            ..estimates(&problem, &point, self.widest)?
        };
        if !is_converged {
            found.warnings.insert(
                0,
                Warning::NotConverged {
                    iterations: self.iterations,
                },
            );
        }
        let shoot = family.shoot(&found.values())?;
        let (duration, linear) = (span(data)[1] - shoot.time(), &found.linear);
        let without_effect = linear.without_effect.len() == linear.free.len();
        if without_effect && !linear.free.is_empty() && duration < self.step {
            return Err(FitError::NoEffect { duration });
        }
        found.warnings.extend(ambiguous_frames(&shoot, data)?);
        Ok(found)
    }

    /// Initial guess of the last search, from searches in growing parts of the data; and the
    /// objectives of the searches in the last part.
    fn guess(
        &self,
        problem: &Problem,
        show: impl Fn(f64) + Sync,
    ) -> Result<(DVector<f64>, Vec<f64>), FitError> {
        let [first, last] = span(problem.data);
        let until = |part: f64| last - (1.0 - part) * (last - first);
        let times = || problem.data.iter().flat_map(|series| &series.times);
        let enough =
            |part: &f64| times().filter(|time| **time <= until(*part)).count() > problem.free.len();
        let mut parts: Vec<f64> = self.windows.iter().copied().filter(enough).collect();
        if parts.is_empty() && self.starts > 1 {
            parts.push(1.0);
        }
        let counts = std::iter::successors(Some(self.starts), |count| Some(count.div_ceil(2)));
        let stages: Vec<(f64, usize)> = parts.into_iter().zip(counts).collect();
        // The last search is one more in all data.
        let all = 1.0
            + stages
                .iter()
                .map(|(part, count)| part * *count as f64)
                .sum::<f64>();
        let done = Mutex::new(0.0);
        let (mut guesses, mut objectives) = (initial_guesses(problem, self.starts), Vec::new());
        for (part, count) in stages {
            guesses.truncate(count);
            let threads = (self.threads / guesses.len()).max(1);
            let in_part = Problem {
                until: until(part),
                threads,
                ..problem.clone()
            };
            let reached = ensemble::collect(guesses.len(), self.threads, |i| {
                let reached = search_from(&in_part, &guesses[i], INTERMEDIATE);
                let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
                *done += part;
                show(*done / all);
                reached
            });
            let (reached, failed): (Vec<_>, Vec<_>) = reached.into_iter().partition(Result::is_ok);
            let mut found: Vec<Point> = reached
                .into_iter()
                .flatten()
                .map(|reached| reached.point)
                .collect();
            sort_by_value(&mut found, |point| point.objective);
            (objectives, guesses) = found
                .into_iter()
                .map(|point| (point.objective, point.x))
                .unzip();
            failed
                .into_iter()
                .find_map(Result::err)
                .filter(|_| guesses.is_empty())
                .map_or(Ok(()), Err)?;
        }
        Ok((guesses.swap_remove(0), objectives))
    }

    /// Searches in all data from a guess, again after each change of an estimated noise.
    fn last_search(
        &self,
        problem: &mut Problem,
        guess: &DVector<f64>,
    ) -> Result<Reached, FitError> {
        let end = StoppingRule {
            accuracy: FINAL,
            iterations: self.iterations,
        };
        let mut reached = search_from(problem, guess, end)?;
        for _ in 0..NOISE_ESTIMATES {
            if !problem.estimate_noise(&reached.point) {
                return Ok(reached);
            }
            reached = search(problem, reached.point.x, end)?;
        }
        Ok(Reached {
            converged: Ok(false),
            ..reached
        })
    }
}

/// Search from a guess. A search that returns an error, such as that of a shoot which fails at a
/// later time than the part of the data of the search before, begins again at the initial values of
/// the family.
fn search_from(
    problem: &Problem,
    guess: &DVector<f64>,
    end: StoppingRule,
) -> Result<Reached, FitError> {
    search(problem, guess.clone(), end).or_else(|_| search(problem, problem.unknowns(), end))
}

/// Unknowns of the given initial values, and of `count` − 1 others that cover the space between the
/// bounds evenly.
fn initial_guesses(problem: &Problem, count: usize) -> Vec<DVector<f64>> {
    let others = (1..count).map(|index| {
        DVector::from_fn(problem.free.len(), |i, _| {
            let [low, high] = problem.limits(i);
            low + (high - low) * radical_inverse(index as u32, PRIMES[i % PRIMES.len()])
        })
    });
    std::iter::once(problem.unknowns()).chain(others).collect()
}

/// Radical inverse of `index`: its digits in a base, mirrored at the radix point.
fn radical_inverse(index: u32, base: u32) -> f64 {
    if index == 0 {
        0.0
    } else {
        (f64::from(index % base) + radical_inverse(index / base, base)) / f64::from(base)
    }
}
