//! Settings of a fit, and the fit itself.

use std::fmt::Display;

use super::Estimates;
use super::answer::{ambiguous_frames, estimates};
use super::problem::{Problem, Run};
use super::residuals::{Steps, simulate};
use super::search::{End, Loss, Reached, search};
use super::series::{Kind, MAD, Series};
use super::starts::initial_guesses;
use super::{Family, FitError, Parameter};
use crate::ensemble;
use crate::error::ParameterError;
use crate::growth::GrowthLaw;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::tracking::median;

/// End of a search in a part of the data, whose result is the initial guess of the next search.
const INTERMEDIATE: End = End { accuracy: 0.1, iterations: 20 };

/// End of the last search, in all data.
const FINAL: End = End { accuracy: 1e-3, iterations: 60 };

/// Relative change below which the estimate of a noise has converged. The standard error of a noise from a thousand
/// coordinates is 2 %.
const NOISE_ACCURACY: f64 = 0.01;

/// Largest number of estimates of the noise.
const NOISE_ESTIMATES: usize = 6;

/// Smallest threshold of Huber's loss, for which almost all residuals are in its linear part.
const LEAST_THRESHOLD: f64 = 0.01;

/// Largest number of initial values. Their searches take hours.
const MOST_STARTS: usize = 1_000_000;

/// Largest number of time steps of a simulation, which takes seconds.
const MOST_STEPS: f64 = 1e5;

/// Part of the duration of a series in which the tip is near its initial position.
const EARLY: f64 = 0.1;

/// Ratio of the sizes of data and shoot, or of shoot and data, that only a wrong unit explains.
const WRONG_UNIT: f64 = 30.0;

/// Settings of a fit.
///
/// ```
/// use morphorod::fit::{Fit, Loss};
/// let fit = Fit { loss: Loss::ROBUST, starts: 8, ..Fit::default() };
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Longest time step of the simulations, s; 120 s by default. Steps end at the times of the data.
    pub step: f64,
    /// Loss of residuals; [`Loss::Squares`] by default.
    pub loss: Loss,
    /// Number of initial guesses, from 1 to 1,000,000: the initial values of the family, and others between the
    /// bounds; 1 by default.
    pub starts: usize,
    /// Parts of the duration of the data, each positive and at most 1, that are fitted one after the other; a quarter,
    /// half and all by default. A part with too few frames is skipped. After each part, only the better half of the
    /// searches is continued.
    pub windows: Vec<f64>,
    /// Largest standard error of an identifiable parameter; 0.5 by default. It is relative for a logarithmic parameter,
    /// otherwise it is divided by the distance of the bounds.
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
    /// Settings, parameters or data that are invalid; the error of the family or of a simulation at the initial values,
    /// or where such errors prevent any further step; [`NotConverged`](FitError::NotConverged) otherwise.
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
        if !reached.converged {
            let values = family.named(&problem.values_at(&reached.x));
            return Err(FitError::NotConverged { iterations: reached.iterations, values });
        }
        let found = estimates(&problem, data, &reached, objectives, (self.loss, self.widest))?;
        let problem = |error: E| FitError::Family { values: family.named(&found.values()), problem: error.to_string() };
        let shoot = (family.build)(&found.values()).map_err(problem)?;
        let last = data.iter().filter_map(|series| series.times.last()).copied().fold(shoot.time(), f64::max);
        let (duration, without_effect) = (last - shoot.time(), found.without_effect.len() == found.free.len());
        if without_effect && !found.free.is_empty() && duration < self.step {
            return Err(FitError::NoEffect { duration });
        }
        Ok(Estimates { ambiguous_frames: ambiguous_frames(&shoot, data)?, ..found })
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

    /// Returns an error unless the settings, the family, the data and the shoot at the initial values are valid, and
    /// the data can determine the parameters.
    pub(super) fn check<M: Model, E: Display>(
        &self,
        family: &Family<impl Fn(&[f64]) -> Result<Shoot<M>, E>>,
        data: &[Series],
    ) -> Result<(), FitError> {
        ParameterError::positive("time step of a fit", self.step, "s")?;
        ParameterError::positive("largest standard error of an identifiable parameter", self.widest, "")?;
        if let Loss::Huber(threshold) = self.loss {
            let ok = threshold >= LEAST_THRESHOLD && threshold.is_finite();
            ParameterError::unless(ok, "threshold of Huber's loss", threshold, "0.01 or larger, and finite")?;
        }
        let (starts, requirement) = (self.starts, "from 1 to 1,000,000");
        ParameterError::unless((1..=MOST_STARTS).contains(&starts), "number of starts", starts as f64, requirement)?;
        for part in &self.windows {
            ParameterError::unless(*part > 0.0 && *part <= 1.0, "part of the data", *part, "positive and at most 1")?;
        }
        family.check(data)?;
        let values: Vec<f64> = family.parameters.iter().map(|parameter| parameter.start).collect();
        let problem = |error: E| FitError::Family { values: family.named(&values), problem: error.to_string() };
        let shoot = (family.build)(&values).map_err(problem)?;
        let free = family.parameters.iter().filter(|parameter| !parameter.is_fixed()).count();
        let mut coordinates = 0;
        for (index, series) in data.iter().enumerate() {
            series.check(index, shoot.time())?;
            let duration = series.times[series.times.len() - 1] - shoot.time();
            let requirement = "long enough that the data end within 100,000 steps: are their times in s?";
            ParameterError::unless(duration <= MOST_STEPS * self.step, "time step of a fit", self.step, requirement)?;
            coordinates += series.residuals();
            // The likelihood has no maximum if a fit can explain a series exactly.
            let enough = if data.len() > 1 { 0 } else { free + 1 };
            if series.noise.is_none() && series.varying_residuals() <= free && series.residuals() >= enough {
                let problem = "has no more coordinates than there are parameters: its noise must be given";
                return Err(FitError::Series { series: index, problem });
            }
            check_unit(index, series, &shoot)?;
        }
        let parameters = free + usize::from(data.iter().any(|series| series.noise.is_none()));
        if coordinates < parameters.max(1) { Err(FitError::Insufficient { coordinates, parameters }) } else { Ok(()) }
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
        let mut reached =
            search(problem, self.loss, last, FINAL).or_else(|_| search(problem, self.loss, given, FINAL))?;
        for _ in 0..NOISE_ESTIMATES {
            if !self.estimate_noise(problem, data, &reached) {
                break;
            }
            reached = search(problem, self.loss, reached.x, FINAL)?;
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

/// Returns an error if the sizes of a series and of the shoot, at its start or at the end of the data, differ by a
/// factor that suggests a wrong unit. Angles have no size, and a scale or an offset may explain any size.
fn check_unit(index: usize, series: &Series, shoot: &Shoot<impl Model>) -> Result<(), FitError> {
    if series.kind == Kind::Angle || series.scale.is_some() || series.offset.is_some() {
        return Ok(());
    }
    let length = shoot.rod().length();
    let norm = series.view.0.iter().map(|row| row.norm()).fold(0.0, f64::max);
    let (observed, modelled) = (series.extent(), length * norm);
    let duration = series.times[series.times.len() - 1] - shoot.time();
    let expected = if series.dimension() == 3 {
        length
    } else if series.times[0] - shoot.time() <= EARLY * duration {
        series.view.0.iter().map(|row| row.dot(&shoot.tip()).powi(2)).sum::<f64>().sqrt()
    } else {
        // The tip may be close to the line of sight to the base, such as that of a risen shoot from above.
        0.0
    };
    if observed > WRONG_UNIT * modelled || observed * WRONG_UNIT < expected {
        return Err(FitError::Unit { series: index, observed, modelled });
    }
    // With times in another unit the shoot would grow far beyond the data.
    let growth = shoot.model().growth();
    let longest = if growth.elongates() { growth.length(length, shoot.time() + duration) } else { length };
    let far = series.dimension() == 3 && observed * WRONG_UNIT < longest;
    if far { Err(FitError::Unit { series: index, observed, modelled: longest }) } else { Ok(()) }
}
