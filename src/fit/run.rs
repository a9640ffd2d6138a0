//! The fit: searches from several initial guesses in growing parts of the data, and estimates of the noise.

use std::fmt::Display;

use nalgebra::DVector;

use super::answer::estimates;
use super::problem::Problem;
use super::search::{End, Outcome, Reached, search};
use super::series::Series;
use super::starts::initial_guesses;
use super::warning::ambiguous_frames;
use super::{Estimates, Family, Fit, FitError};
use crate::ensemble;
use crate::model::Model;
use crate::shoot::Shoot;

/// End of a search in a part of the data, whose result is the initial guess of the next search.
const INTERMEDIATE: End = End { accuracy: 0.1, iterations: 20 };

/// Predicted length of a step, in standard errors, at which the last search ends.
const FINAL: f64 = 1e-3;

/// Largest number of estimates of the noise. Usually two suffice. The fit has not converged if this number does not.
const NOISE_ESTIMATES: usize = 20;

impl Fit {
    /// Estimates the parameters of a family of shoots from data of one shoot.
    ///
    /// # Errors
    /// Settings, parameters or data that are invalid; the error of the family or of a simulation at the initial values,
    /// or where such errors prevent any further step. A search that does not converge is a
    /// [`Warning`](super::Warning::NotConverged).
    pub fn run<M: Model, E: Display>(
        &self,
        family: &Family<impl Fn(&[f64]) -> Result<Shoot<M>, E> + Sync>,
        data: &[Series],
    ) -> Result<Estimates, FitError> {
        self.check(family, data)?;
        let mut problem = self.problem(family, data, family.initial_values());
        let (points, objectives) = self.guesses(&problem)?;
        let reached = self.last_search(&mut problem, points)?;
        if let Outcome::Failed(failure) = reached.outcome {
            return Err(failure);
        }
        let mut found = estimates(&problem, &reached, objectives, self.widest)?;
        let shoot = family.shoot(&found.values())?;
        let last = data.iter().filter_map(|series| series.times.last()).copied().fold(shoot.time(), f64::max);
        let (duration, linear) = (last - shoot.time(), &found.linear);
        let without_effect = linear.without_effect.len() == linear.free.len();
        if without_effect && !linear.free.is_empty() && duration < self.step {
            return Err(FitError::NoEffect { duration });
        }
        found.warnings.extend(ambiguous_frames(&shoot, data)?);
        Ok(found)
    }

    /// Initial guesses of the last search, the best first, from searches in growing parts of the data; and the
    /// objectives of the searches in the last part.
    fn guesses(&self, problem: &Problem) -> Result<(Vec<DVector<f64>>, Vec<f64>), FitError> {
        let times = || problem.data.iter().flat_map(|series| series.times.iter().copied());
        let (first, last) = (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
        let until = |part: &f64| if *part == 1.0 { f64::INFINITY } else { first + part * (last - first) };
        let enough = |until: &f64| times().filter(|time| time <= until).count() > problem.free.len();
        let mut parts: Vec<f64> = self.windows.iter().map(until).filter(enough).collect();
        if parts.is_empty() && self.starts > 1 {
            parts.push(f64::INFINITY);
        }
        let (mut points, mut objectives) = (initial_guesses(problem, self.starts), Vec::new());
        for until in parts {
            let part = Problem { until, threads: (self.threads / points.len()).max(1), ..problem.clone() };
            let found = ensemble::collect(points.len(), self.threads, |i| {
                // The shoot at the end of an earlier search may fail at a later time.
                search(&part, points[i].clone(), INTERMEDIATE)
                    .or_else(|_| search(&part, problem.coordinates(), INTERMEDIATE))
            });
            let (found, failed): (Vec<_>, Vec<_>) = found.into_iter().partition(Result::is_ok);
            if found.is_empty() {
                failed.into_iter().collect::<Result<Vec<_>, _>>()?;
            }
            let mut found: Vec<_> = found.into_iter().flatten().map(|reached| reached.point).collect();
            found.sort_by(|a, b| a.objective.total_cmp(&b.objective));
            objectives = found.iter().map(|point| point.objective).collect();
            found.truncate(points.len().div_ceil(2));
            points = found.into_iter().map(|point| point.x).collect();
        }
        Ok((points, objectives))
    }

    /// Searches in all data from the first of the guesses, again after each change of an estimated noise.
    fn last_search(&self, problem: &mut Problem, guesses: Vec<DVector<f64>>) -> Result<Reached, FitError> {
        let end = End { accuracy: FINAL, iterations: self.iterations };
        let mut reached =
            search(problem, guesses[0].clone(), end).or_else(|_| search(problem, problem.coordinates(), end))?;
        for _ in 0..NOISE_ESTIMATES {
            if !problem.estimate_noise(&reached.point) {
                return Ok(reached);
            }
            reached = search(problem, reached.point.x, end)?;
        }
        Ok(Reached { outcome: Outcome::Unfinished, ..reached })
    }
}
