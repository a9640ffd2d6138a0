//! The fit: searches from several initial guesses in growing parts of the data, and estimates of the noise.

use std::fmt::Display;

use super::answer::{ambiguous_frames, estimates};
use super::problem::{Problem, Run};
use super::residuals::{Steps, simulate};
use super::search::{End, Loss, Reached, search};
use super::series::{MAD, Series};
use super::starts::initial_guesses;
use super::{Estimates, Family, Fit, FitError, Parameter};
use crate::ensemble;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::tracking::median;

/// End of a search in a part of the data, whose result is the initial guess of the next search.
const INTERMEDIATE: End = End { accuracy: 0.1, iterations: 20 };

/// Predicted length of a step, in standard errors, at which the last search ends.
const FINAL: f64 = 1e-3;

/// Relative change below which the estimate of a noise has converged. The standard error of a noise from a thousand
/// coordinates is 2 %.
const NOISE_ACCURACY: f64 = 0.01;

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
        let run =
            |values: &[f64], until: f64, steps: Steps<'_>| simulate(family, data, self.step, (values, until), steps);
        let values: Vec<f64> = family.parameters.iter().map(|parameter| parameter.start).collect();
        let mut problem = self.problem(&family.parameters, data, values, &run);
        let (reached, objectives) = self.search(&mut problem, data)?;
        if let Some(failure) = reached.failure {
            return Err(failure);
        }
        let mut found = estimates(&problem, data, &reached, objectives, (self.loss, self.widest))?;
        let problem = |error: E| FitError::Family { values: family.named(&found.values()), problem: error.to_string() };
        let shoot = (family.build)(&found.values()).map_err(problem)?;
        let last = data.iter().filter_map(|series| series.times.last()).copied().fold(shoot.time(), f64::max);
        let (duration, linear) = (last - shoot.time(), &found.linear);
        let without_effect = linear.without_effect.len() == linear.free.len();
        if without_effect && !linear.free.is_empty() && duration < self.step {
            return Err(FitError::NoEffect { duration });
        }
        found.warnings.extend(ambiguous_frames(&shoot, data)?);
        Ok(found)
    }

    /// Least-squares problem of all data for the given values of all parameters, with the rough noise of each series
    /// whose noise is not given.
    pub(super) fn problem<'a>(
        &self,
        parameters: &'a [Parameter],
        data: &[Series],
        values: Vec<f64>,
        run: &'a Run<'a>,
    ) -> Problem<'a> {
        let free = (0..parameters.len()).filter(|k| !parameters[*k].is_fixed()).collect();
        let noise = data.iter().map(|series| series.noise.unwrap_or_else(|| series.rough_noise())).collect();
        Problem { parameters, values, free, run, noise, until: f64::INFINITY, threads: self.threads }
    }

    /// Searches for the estimates. Returns the point that the last search reached, and the objectives of all searches
    /// in the last part of the data, the smallest first.
    fn search(&self, problem: &mut Problem, data: &[Series]) -> Result<(Reached, Vec<f64>), FitError> {
        let times = || data.iter().flat_map(|series| series.times.iter().copied());
        let (first, last) = (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
        let mut points = initial_guesses(problem, self.starts);
        let given = points[0].clone();
        let mut objectives = Vec::new();
        let until = |part: &f64| if *part == 1.0 { f64::INFINITY } else { first + part * (last - first) };
        let enough = |until: &f64| times().filter(|time| time <= until).count() > problem.free.len();
        let mut parts: Vec<f64> = self.windows.iter().map(until).filter(enough).collect();
        if parts.is_empty() && self.starts > 1 {
            parts.push(f64::INFINITY);
        }
        for until in parts {
            let threads = (self.threads / points.len()).max(1);
            let part = Problem { until, threads, ..problem.clone() };
            let found = ensemble::collect(points.len(), self.threads, |i| {
                // The shoot at the end of an earlier search may fail at a later time.
                search(&part, self.loss, points[i].clone(), INTERMEDIATE)
                    .or_else(|_| search(&part, self.loss, given.clone(), INTERMEDIATE))
            });
            let (found, errors): (Vec<_>, Vec<_>) = found.into_iter().partition(Result::is_ok);
            let mut found: Vec<Reached> = found.into_iter().flatten().collect();
            if let (true, Some(Err(error))) = (found.is_empty(), errors.into_iter().next()) {
                return Err(error);
            }
            found.sort_by(|a, b| a.objective.total_cmp(&b.objective));
            objectives = found.iter().map(|reached| reached.objective).collect();
            found.truncate(points.len().div_ceil(2));
            points = found.into_iter().map(|reached| reached.x).collect();
        }
        let last = points.swap_remove(0);
        let end = End { accuracy: FINAL, iterations: self.iterations };
        let mut reached = search(problem, self.loss, last, end).or_else(|_| search(problem, self.loss, given, end))?;
        let mut noises = 0;
        while self.estimate_noise(problem, data, &reached) {
            noises += 1;
            reached = search(problem, self.loss, reached.x, end)?;
            if noises == NOISE_ESTIMATES {
                reached.converged = false;
                break;
            }
        }
        Ok((reached, objectives))
    }

    /// Estimates the noise of each series for which it is not given. Returns whether a noise has changed.
    fn estimate_noise(&self, problem: &mut Problem, data: &[Series], reached: &Reached) -> bool {
        let mut changed = false;
        let n = reached.at.residuals.len();
        for index in data.iter().enumerate().filter(|(_, series)| series.noise.is_none()).map(|(index, _)| index) {
            let all = reached.at.rows.iter().zip(reached.at.residuals.iter());
            let sizes: Vec<f64> = all.filter(|(row, _)| row.series == index).map(|(_, r)| r.abs()).collect();
            // Part of the squares that the fit does not absorb.
            let share = 1.0 - problem.free.len() as f64 / n as f64;
            let ratio = match self.loss {
                Loss::Squares => (sizes.iter().map(|r| r * r).sum::<f64>() / (sizes.len() as f64 * share)).sqrt(),
                Loss::Huber(_) => MAD * median(sizes) / share.sqrt(),
            };
            // Exact data have residuals of the size of rounding errors. Their noise is not reduced further.
            if ratio > f64::EPSILON && (ratio - 1.0).abs() > NOISE_ACCURACY {
                problem.noise[index] *= ratio;
                changed = true;
            }
        }
        changed
    }
}
