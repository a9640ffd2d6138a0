//! Assembly of the result of a fit at the point that its search has reached.

use nalgebra::DVector;

use super::confidence::{Confidence, uncertain};
use super::estimate::{Estimate, Estimates, Input, Linear, Verdict, WeakDirection, deviation};
use super::jacobian::Jacobian;
use super::problem::Problem;
use super::search::{Loss, Reached, priors};
use super::series::Series;
use super::singular::Singular;
use super::warning::warnings;
use super::{FitError, Parameter, Warning};
use crate::error::ParameterError;
use crate::model::{Model, next_discontinuity};
use crate::scene::{after, before};
use crate::shoot::Shoot;

/// Component of a weak combination, relative to the largest, above which the combination names the parameter.
const NAMED: f64 = 0.1;

/// Estimates at the point that a search has reached, without warnings about ambiguous frames.
pub(super) fn estimates(
    problem: &Problem,
    data: &[Series],
    reached: &Reached,
    objectives: Vec<f64>,
    (loss, widest): (Loss, f64),
) -> Result<Estimates, FitError> {
    // Parameters at a bound are fixed there, and have no standard error.
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
    let reached = Reached { x, at: problem.evaluate(&problem.coordinates(&values))?, failure: None, ..*reached };
    let relative = |series: usize| data[series].size() / problem.noise[series];
    let size = reached.at.rows.iter().map(|row| relative(row.series).powi(2)).sum::<f64>().sqrt();
    let both: Jacobian = problem.jacobian(&reached.x, &reached.at, size)?;
    let jacobian = both.extrapolated();
    let slopes: Vec<_> = priors(&problem, &reached.x).map(|(i, [_, slope])| (i, slope)).collect();
    let [coarse, singular] = [&both.coarse, &jacobian].map(|matrix| Singular::of(matrix, &both.rounding, &slopes));
    let found = singular.as_ref().map_or_else(
        || Confidence::none(free.len()),
        |singular| Confidence::of(&problem, loss, &reached, (&jacobian, singular)),
    );
    // With no more frames than parameters, further frames may determine a combination without effect.
    let mut times: Vec<f64> = reached.at.rows.iter().map(|row| row.time).collect();
    times.dedup();
    let enough_frames = times.len() > free.len();
    let without_effect = singular.as_ref().map_or(vec![], Singular::without_effect);
    let values_of =
        |singular: &Option<Singular>| singular.as_ref().map_or(vec![], |one| one.values.as_slice().to_vec());
    let estimates = Estimates {
        parameters: parameter_estimates(parameters, &values, &free, (&found, &without_effect), (widest, enough_frames)),
        weak: weak_directions(&problem, (&found, &without_effect), (widest, enough_frames)),
        warnings: Vec::new(),
        chi_squared: 2.0 * reached.objective,
        degrees_of_freedom: reached.at.residuals.len().saturating_sub(free.len()),
        noise: problem.noise.clone(),
        lag_one: found.lag_one,
        residuals: residuals(&problem, &reached),
        objectives,
        singular_values: [&coarse, &singular].map(values_of),
        input: Input { family: parameters.to_vec(), data: data.to_vec(), loss },
        linear: Linear {
            free,
            covariance: found.covariance,
            white: found.white,
            redundancy: found.redundancy,
            without_effect,
        },
    };
    let mut warnings = warnings(data, &estimates.residuals, estimates.lag_one);
    let at_bound = estimates.parameters.iter().filter(|one| one.verdict == Verdict::AtBound);
    warnings.extend(at_bound.map(|one| Warning::AtBound { name: one.name.clone() }));
    if !reached.converged {
        warnings.insert(0, Warning::NotConverged { iterations: reached.iterations });
    }
    Ok(Estimates { warnings, ..estimates })
}

/// Estimates of all parameters.
fn parameter_estimates(
    parameters: &[Parameter],
    values: &[f64],
    free: &[usize],
    (found, without_effect): (&Confidence, &[DVector<f64>]),
    (widest, enough_frames): (f64, bool),
) -> Vec<Estimate> {
    let estimate = |(k, parameter): (usize, &Parameter)| {
        let (name, value, relative) = (parameter.name.clone(), values[k], parameter.logarithmic);
        let (error, verdict) = match free.iter().position(|other| *other == k) {
            None if parameter.is_fixed() => (0.0, Verdict::Fixed),
            None => (0.0, Verdict::AtBound),
            Some(i) if without_effect.iter().any(|change| change[i] != 0.0) => {
                (f64::INFINITY, if enough_frames { Verdict::StructurallyNot } else { Verdict::PracticallyNot })
            }
            Some(i) => {
                let error = deviation(found.covariance[(i, i)]);
                let unit = if relative { 1.0 } else { parameter.slope(value) };
                let verdict = if error <= widest { Verdict::Identifiable } else { Verdict::PracticallyNot };
                (error * unit, verdict)
            }
        };
        Estimate { name, value, error, relative, verdict }
    };
    parameters.iter().enumerate().map(estimate).collect()
}

/// Warnings about frames whose times are, up to rounding, those of a discontinuity of the laws. The shoot is at its
/// start.
pub(super) fn ambiguous_frames(shoot: &Shoot<impl Model>, data: &[Series]) -> Result<Vec<Warning>, ParameterError> {
    let last = data.iter().filter_map(|series| series.times.last()).copied().fold(f64::NEG_INFINITY, f64::max);
    let mut frames = vec![Vec::new(); data.len()];
    let mut time = next_discontinuity(shoot.model(), before(shoot.time()))?;
    while time <= last {
        for (series, frames) in data.iter().zip(&mut frames) {
            let first = series.times.partition_point(|t| *t < before(time));
            frames.extend((first..series.times.len()).take_while(|k| series.times[*k] <= after(time)));
        }
        time = next_discontinuity(shoot.model(), after(time))?;
    }
    let warning = |(series, frames)| Warning::AmbiguousFrames { series, frames };
    Ok(frames.into_iter().enumerate().filter(|(_, frames)| !frames.is_empty()).map(warning).collect())
}

/// Residuals with the index of their series and their time (s), in the unit of the data, or rad.
fn residuals(problem: &Problem, reached: &Reached) -> Vec<(usize, f64, f64)> {
    let rows = reached.at.rows.iter().zip(reached.at.residuals.iter());
    rows.map(|(row, r)| (row.series, row.time, r * problem.noise[row.series])).collect()
}

/// Combinations without effect, and then those with a standard error above `widest`, the largest error first.
fn weak_directions(
    problem: &Problem,
    (found, without_effect): (&Confidence, &[DVector<f64>]),
    (widest, enough_frames): (f64, bool),
) -> Vec<WeakDirection> {
    let undetermined = without_effect.iter().map(|changes| (changes.clone(), f64::INFINITY));
    let parameter = |i: usize| &problem.parameters[problem.free[i]];
    let direction = |(changes, error): (DVector<f64>, f64)| {
        // All components of a combination without effect are exact.
        let named = |i: &usize| changes[*i].abs() > if error.is_infinite() { 0.0 } else { NAMED };
        let sign = (0..changes.len()).find(named).map_or(1.0, |i| changes[i].signum());
        let component = |i: usize| (parameter(i).name.clone(), sign * changes[i]);
        let components = (0..changes.len()).filter(named).map(component).collect();
        let logarithmic = (0..changes.len()).filter(named).map(|i| parameter(i).logarithmic).collect();
        WeakDirection { components, error, structural: enough_frames && error.is_infinite(), logarithmic }
    };
    undetermined.chain(uncertain(&found.covariance, widest)).map(direction).collect()
}
