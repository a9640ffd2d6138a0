//! Settings of a fit, and the fit itself.

use std::fmt::Display;

use nalgebra::{DMatrix, DVector};

use super::confidence::{Confidence, confidence, singular};
use super::estimate::{Estimate, Estimates, Verdict, WeakDirection, repeated};
use super::problem::{DIFFERENCE, Problem, RATIO, Run, extrapolated};
use super::residuals::simulate;
use super::search::{Loss, Reached, search};
use super::series::{MAD, Series};
use super::{Family, FitError, Parameter, parallel, starts};
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;

/// Accuracy of intermediate and final searches, in standard errors, and their largest numbers of iterations.
const INTERMEDIATE: (f64, usize) = (0.1, 20);
const FINAL: (f64, usize) = (1e-3, 60);

/// Largest number of estimates of the noise, and relative change at which they end.
const NOISE: (usize, f64) = (6, 0.01);

/// Ratio of sizes of data and shoot that only a wrong unit explains.
const WRONG_UNIT: f64 = 100.0;

/// Component of a weak combination, relative to the largest, above which a parameter is named.
const NAMED: f64 = 0.1;

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
        let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        Self { step: 120.0, loss: Loss::Squares, starts: 1, windows: vec![0.25, 0.5, 1.0], widest: 0.5, threads }
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
        if !reached.converged {
            let values = family.named(&problem.values_at(&reached.x));
            return Err(FitError::NotConverged { iterations: reached.iterations, values });
        }
        self.estimates(&problem, data, &reached, objectives)
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
            ParameterError::positive("threshold of Huber's loss", threshold)?;
        }
        let ok = self.windows.iter().all(|part| *part > 0.0 && *part <= 1.0);
        ParameterError::unless(ok, "part of the data", f64::NAN, "positive and at most 1")?;
        family.check(data)?;
        let values: Vec<f64> = family.parameters.iter().map(|parameter| parameter.start).collect();
        let problem = |error: E| FitError::Family { values: family.named(&values), problem: error.to_string() };
        let shoot = (family.build)(&values).map_err(problem)?;
        let (mut coordinates, length) = (0, shoot.rod().length());
        for (index, series) in data.iter().enumerate() {
            series.check(index, shoot.time())?;
            coordinates += series.residuals();
            let norm = series.view.0.iter().map(|row| row.norm()).fold(0.0, f64::max);
            let (observed, modelled) = (series.extent(), length * norm);
            let whole = series.dimension() == 3;
            let wrong = observed > WRONG_UNIT * modelled || whole && observed * WRONG_UNIT < modelled;
            if wrong && series.scale.is_none() && series.offset.is_none() {
                return Err(FitError::Unit { series: index, observed, modelled });
            }
        }
        let parameters = family.parameters.iter().filter(|parameter| !parameter.is_fixed()).count();
        if coordinates < parameters { Err(FitError::Insufficient { coordinates, parameters }) } else { Ok(()) }
    }

    /// Searches the estimates. Returns the point that was reached and the objectives of all searches of the last part.
    fn search(&self, problem: &mut Problem, data: &[Series]) -> Result<(Reached, Vec<f64>), FitError> {
        let times = || data.iter().flat_map(|series| series.times.iter().copied());
        let (first, last) = (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
        let mut points = starts::starts(problem, self.starts.max(1));
        let mut objectives = Vec::new();
        for part in &self.windows {
            let until = if *part == 1.0 { f64::INFINITY } else { first + part * (last - first) };
            let frames = data.iter().flat_map(|series| &series.times).filter(|time| **time <= until).count();
            if frames <= problem.free.len() {
                continue;
            }
            let threads = (self.threads / points.len()).max(1);
            let part = Problem { until, threads, ..problem.clone() };
            let found = parallel::map(points.len(), self.threads, |i| {
                search(&part, self.loss, points[i].clone(), INTERMEDIATE)
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
        let mut reached = search(problem, self.loss, points.swap_remove(0), FINAL)?;
        for _ in 0..NOISE.0 {
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
            if ratio > f64::EPSILON && (ratio - 1.0).abs() > NOISE.1 {
                problem.noise[index] *= ratio;
                changed = true;
            }
        }
        changed
    }

    /// The answer at a point that a search has reached.
    fn estimates(
        &self,
        problem: &Problem,
        data: &[Series],
        reached: &Reached,
        objectives: Vec<f64>,
    ) -> Result<Estimates, FitError> {
        // Parameters at a bound have no error, and the others have that for their values there.
        let (parameters, x) = (problem.parameters, &reached.x);
        let values = problem.values_at(x);
        let at_bound = |i: usize| {
            let [low, high] = parameters[problem.free[i]].limits();
            x[i] <= low || x[i] >= high
        };
        let inner: Vec<usize> = (0..x.len()).filter(|i| !at_bound(*i)).collect();
        let free: Vec<usize> = inner.iter().map(|i| problem.free[*i]).collect();
        let problem = Problem { free: free.clone(), values: values.clone(), ..problem.clone() };
        let x = DVector::from_iterator(inner.len(), inner.iter().map(|i| x[*i]));
        let reached = Reached { x, at: problem.evaluate(&problem.coordinates(&values))?, ..*reached };
        let [coarse, fine] = problem.jacobians(&reached.x, &reached.at, [DIFFERENCE, DIFFERENCE / RATIO])?;
        let jacobian = extrapolated(&coarse, &fine);
        let found = confidence(&problem, self.loss, &reached, &jacobian);
        let fallback = || Confidence {
            covariance: DMatrix::zeros(free.len(), free.len()),
            white: DMatrix::zeros(free.len(), free.len()),
            singular: DVector::zeros(free.len()),
            directions: DMatrix::identity(free.len(), free.len()),
            lag_one: 0.0,
        };
        let found = found.unwrap_or_else(fallback);
        let coarse = singular(&problem, &reached.x, &coarse).map_or(vec![], |(s, _)| s.as_slice().to_vec());
        let (n, k) = (reached.at.residuals.len(), free.len());
        let logarithms = reached.at.rows.iter().map(|row| problem.noise[row.series].ln()).sum::<f64>();
        Ok(Estimates {
            parameters: self.each(parameters, &values, &free, &found),
            correlations: correlations(parameters.len(), &free, &found.covariance),
            weak: weak_directions(&problem, &found, self.widest),
            chi_squared: 2.0 * reached.objective,
            degrees_of_freedom: n.saturating_sub(k),
            noise: problem.noise.clone(),
            lag_one: found.lag_one,
            residuals: residuals(&problem, &reached),
            repeated_frames: repeated(data),
            objectives,
            deviance: 2.0 * (reached.objective + logarithms),
            singular_values: [coarse, found.singular.as_slice().to_vec()],
            family: parameters.to_vec(),
            free,
            covariance: found.covariance,
            white: found.white,
        })
    }

    /// Estimates of all parameters.
    fn each(&self, parameters: &[Parameter], values: &[f64], free: &[usize], found: &Confidence) -> Vec<Estimate> {
        let of = |(k, parameter): (usize, &Parameter)| {
            let (name, value, relative) = (parameter.name.clone(), values[k], parameter.logarithmic);
            let (error, verdict) = match free.iter().position(|other| *other == k) {
                None if parameter.is_fixed() => (0.0, Verdict::Fixed),
                None => (0.0, Verdict::AtBound),
                Some(i) if found.is_in_structural(i) => (f64::INFINITY, Verdict::StructurallyNot),
                Some(i) => {
                    let error = found.covariance[(i, i)].max(0.0).sqrt();
                    let certain = error <= self.widest;
                    let unit = if relative { 1.0 } else { parameter.slope(value) };
                    (error * unit, if certain { Verdict::Identifiable } else { Verdict::PracticallyNot })
                }
            };
            Estimate { name, value, error, relative, verdict }
        };
        parameters.iter().enumerate().map(of).collect()
    }
}

/// Residuals with their series and time, m.
fn residuals(problem: &Problem, reached: &Reached) -> Vec<(usize, f64, f64)> {
    let rows = reached.at.rows.iter().zip(reached.at.residuals.iter());
    rows.map(|(row, r)| (row.series, row.time, r * problem.noise[row.series])).collect()
}

fn correlations(count: usize, free: &[usize], covariance: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let mut matrix = vec![vec![0.0; count]; count];
    for k in 0..count {
        matrix[k][k] = 1.0;
    }
    for (i, k) in free.iter().enumerate() {
        for (j, l) in free.iter().enumerate().filter(|(j, _)| *j != i) {
            let size = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
            matrix[*k][*l] = if size > 0.0 { covariance[(i, j)] / size } else { 0.0 };
        }
    }
    matrix
}

/// Combinations with a standard error above `widest`, the weakest first.
fn weak_directions(problem: &Problem, found: &Confidence, widest: f64) -> Vec<WeakDirection> {
    let mut order: Vec<usize> = (0..found.singular.len()).collect();
    order.sort_by(|a, b| found.singular[*a].total_cmp(&found.singular[*b]));
    let direction = |j: usize| {
        let (column, structural) = (found.directions.column(j), found.is_structural(j));
        let largest = column.amax();
        let named = |i: &usize| column[*i].abs() > NAMED * largest;
        let sign = (0..column.len()).find(named).map_or(1.0, |i| column[i].signum());
        let component = |i: usize| (problem.parameters[problem.free[i]].name.clone(), sign * column[i] / largest);
        let components = (0..column.len()).filter(named).map(component).collect();
        let along = column / largest;
        let error = if structural {
            f64::INFINITY
        } else {
            let inverse = 1.0 / found.singular[j];
            inverse / along.norm()
        };
        WeakDirection { components, error, structural }
    };
    order.into_iter().map(direction).take_while(|weak| weak.structural || weak.error > widest).collect()
}
