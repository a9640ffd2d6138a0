//! Settings of a fit, and the fit itself.

use std::fmt::Display;

use super::Estimates;
use super::answer::{ambiguous, estimates};
use super::problem::{Problem, Run};
use super::residuals::simulate;
use super::search::{End, Loss, Reached, search};
use super::series::{Kind, MAD, Series};
use super::{Family, FitError, Parameter, starts};
use crate::ensemble;
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;

/// Ends of searches in a part of the data, which need not be more accurate than the start of the next one, and in all.
const INTERMEDIATE: End = End { accuracy: 0.1, iterations: 20 };
const FINAL: End = End { accuracy: 1e-3, iterations: 60 };

/// Relative change at which estimates of the noise end, far below the standard error of a noise from a thousand
/// coordinates, and their largest number.
const NOISE: f64 = 0.01;
const NOISES: usize = 6;

/// Smallest threshold of Huber's loss: almost all residuals are in its linear part.
const LEAST_THRESHOLD: f64 = 0.01;

/// Largest number of initial values, whose searches take hours.
const MOST_STARTS: usize = 1_000_000;

/// Largest number of time steps of a simulation, which take seconds.
const MOST_STEPS: f64 = 1e5;

/// Part of the duration of a series in which the tip is near its initial position.
const EARLY: f64 = 0.1;

/// Ratio of sizes of data and shoot that only a wrong unit explains.
const WRONG_UNIT: f64 = 100.0;

/// Settings of a fit.
///
/// ```
/// use morphorod::fit::{Fit, Loss};
/// let fit = Fit { loss: Loss::ROBUST, starts: 8, ..Fit::default() };
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Longest time step of the simulations, s; 120 by default. Steps end at the times of the data.
    pub step: f64,
    /// Loss of residuals; [`Loss::Squares`] by default.
    pub loss: Loss,
    /// Number of initial values: that of the family, and others between the bounds; 1 by default.
    pub starts: usize,
    /// Parts of the data, by duration, to which the searches are fitted one after the other; a quarter, half and all by
    /// default. After each part the worse half of the searches ends.
    pub windows: Vec<f64>,
    /// Largest standard error of an identifiable parameter: relative for logarithmic ones, else over the distance of
    /// its bounds; 0.5 by default.
    pub widest: f64,
    /// Number of threads; that of the machine by default.
    pub threads: usize,
}

impl Default for Fit {
    fn default() -> Self {
        Self {
            step: 120.0,
            loss: Loss::Squares,
            starts: 1,
            windows: vec![0.25, 0.5, 1.0],
            widest: 0.5,
            threads: ensemble::cores(),
        }
    }
}

impl Fit {
    /// Estimates the parameters of a family of shoots from data of one shoot.
    ///
    /// # Errors
    /// Settings, parameters or data that are invalid; a family without a shoot at the initial values; and
    /// [`NotConverged`](FitError::NotConverged).
    pub fn run<M: Model, E: Display>(
        &self,
        family: &Family<impl Fn(&[f64]) -> Result<Shoot<M>, E> + Sync>,
        data: &[Series],
    ) -> Result<Estimates, FitError> {
        self.check(family, data)?;
        let run = |values: &[f64], until: f64, steps: super::residuals::Steps<'_>| {
            simulate(family, data, self.step, (values, until), steps)
        };
        let values: Vec<f64> = family.parameters.iter().map(|parameter| parameter.start).collect();
        let mut problem = self.problem(&family.parameters, data, values, &run);
        let (reached, objectives) = self.search(&mut problem, data)?;
        if let Some(failure) = reached.failure {
            return Err(failure);
        }
        if !reached.converged {
            let values = family.named(&problem.values_at(&reached.x));
            return Err(FitError::NotConverged { iterations: reached.iterations, values });
        }
        let found = estimates(&problem, data, &reached, objectives, (self.loss, self.widest))?;
        let problem = |error: E| FitError::Family { values: family.named(&found.values()), problem: error.to_string() };
        let shoot = (family.build)(&found.values()).map_err(problem)?;
        Ok(Estimates { ambiguous_frames: ambiguous(&shoot, data)?, ..found })
    }

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

    pub(super) fn check<M: Model, E: Display>(
        &self,
        family: &Family<impl Fn(&[f64]) -> Result<Shoot<M>, E>>,
        data: &[Series],
    ) -> Result<(), FitError> {
        ParameterError::positive("time step of a fit", self.step)?;
        ParameterError::positive("largest standard error of an identifiable parameter", self.widest)?;
        if let Loss::Huber(threshold) = self.loss {
            let ok = threshold >= LEAST_THRESHOLD && threshold.is_finite();
            ParameterError::unless(ok, "threshold of Huber's loss", threshold, "0.01 or larger, and finite")?;
        }
        let (starts, requirement) = (self.starts, "from 1 to 1,000,000");
        ParameterError::unless((1..=MOST_STARTS).contains(&starts), "number of starts", starts as f64, requirement)?;
        let ok = self.windows.iter().all(|part| *part > 0.0 && *part <= 1.0);
        ParameterError::unless(ok, "part of the data", f64::NAN, "positive and at most 1")?;
        family.check(data)?;
        let values: Vec<f64> = family.parameters.iter().map(|parameter| parameter.start).collect();
        let problem = |error: E| FitError::Family { values: family.named(&values), problem: error.to_string() };
        let shoot = (family.build)(&values).map_err(problem)?;
        let (mut coordinates, length) = (0, shoot.rod().length());
        for (index, series) in data.iter().enumerate() {
            series.check(index, shoot.time())?;
            let duration = series.times[series.times.len() - 1] - shoot.time();
            let requirement = "long enough that the data end within 100,000 steps: are their times in s?";
            ParameterError::unless(duration <= MOST_STEPS * self.step, "time step of a fit", self.step, requirement)?;
            coordinates += series.residuals();
            let own = |name: &&String| family.index(name).is_some_and(|k| !family.parameters[k].is_fixed());
            let own = series.scale.iter().chain(series.offset.iter().flatten()).filter(own).count();
            if series.noise.is_none() && series.residuals() <= own {
                let problem = "has no more coordinates than parameters of its own, which leaves its noise unknown";
                return Err(FitError::Series { series: index, problem });
            }
            let norm = series.view.0.iter().map(|row| row.norm()).fold(0.0, f64::max);
            let (observed, modelled) = (series.extent(), length * norm);
            // The tip may approach the line of sight to the base later, as a rising shoot does that is seen from above.
            let early = series.times[0] - shoot.time() <= EARLY * duration;
            let image = || series.view.0.iter().map(|row| row.dot(&shoot.tip()).powi(2)).sum::<f64>().sqrt();
            let seen = if series.dimension() == 3 {
                length
            } else if early {
                image()
            } else {
                0.0
            };
            let wrong = observed > WRONG_UNIT * modelled || observed * WRONG_UNIT < seen;
            if wrong && series.kind != Kind::Angle && series.scale.is_none() && series.offset.is_none() {
                return Err(FitError::Unit { series: index, observed, modelled });
            }
        }
        let free = family.parameters.iter().filter(|parameter| !parameter.is_fixed()).count();
        let parameters = free + usize::from(data.iter().any(|series| series.noise.is_none()));
        if coordinates < parameters { Err(FitError::Insufficient { coordinates, parameters }) } else { Ok(()) }
    }

    /// Searches the estimates. Returns the point that was reached and the objectives of all searches of the last part.
    fn search(&self, problem: &mut Problem, data: &[Series]) -> Result<(Reached, Vec<f64>), FitError> {
        let times = || data.iter().flat_map(|series| series.times.iter().copied());
        let (first, last) = (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
        let mut points = starts::starts(problem, self.starts);
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
                // The end of an earlier part may have no shoot that lasts longer.
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
        let mut reached =
            search(problem, self.loss, last, FINAL).or_else(|_| search(problem, self.loss, given, FINAL))?;
        for _ in 0..NOISES {
            if !self.estimate_noise(problem, data, &reached) {
                break;
            }
            reached = search(problem, self.loss, reached.x, FINAL)?;
        }
        Ok((reached, objectives))
    }

    /// Estimates the noise of the series for which it is not given. Returns whether it has changed.
    fn estimate_noise(&self, problem: &mut Problem, data: &[Series], reached: &Reached) -> bool {
        let mut changed = false;
        let n = reached.at.residuals.len();
        for index in data.iter().enumerate().filter(|(_, series)| series.noise.is_none()).map(|(index, _)| index) {
            let of_series = reached.at.rows.iter().zip(reached.at.residuals.iter());
            let mut sizes: Vec<f64> = of_series.filter(|(row, _)| row.series == index).map(|(_, r)| r.abs()).collect();
            sizes.sort_by(f64::total_cmp);
            let share = 1.0 - problem.free.len() as f64 / n as f64;
            let ratio = match self.loss {
                Loss::Squares => (sizes.iter().map(|r| r * r).sum::<f64>() / (sizes.len() as f64 * share)).sqrt(),
                Loss::Huber(_) => MAD * sizes[sizes.len() / 2] / share.sqrt(),
            };
            // Data without noise have residuals by rounding.
            if ratio > f64::EPSILON && (ratio - 1.0).abs() > NOISE {
                problem.noise[index] *= ratio;
                changed = true;
            }
        }
        changed
    }
}
