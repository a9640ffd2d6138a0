//! Assembly of the result of a fit at the point that its search has reached.

use nalgebra::DVector;

use super::confidence::{LinearTheory, Singular, uncertain};
use super::estimate::{Estimate, Estimates, Verdict, WeakDirection, deviation};
use super::noise::Noise;
use super::problem::{Point, Problem};
use super::warning::warnings;
use super::{FitError, Parameter, Warning};

/// Component of a weak combination, relative to the largest, above which the combination names the
/// parameter.
const NAMED: f64 = 0.1;

/// Distance from a bound up to which an unknown is at the bound. Central quotients with shorter
/// steps have relative errors by rounding of 1e-7 and more.
const EDGE: f64 = 1e-7;

/// Estimates at the point that a search has reached, without warnings about ambiguous frames and
/// without the objectives of the searches in the last part of the data.
pub(super) fn estimates(
    problem: &Problem,
    reached: &Point,
    widest: f64,
) -> Result<Estimates, FitError> {
    // Parameters at a bound are fixed there, and have no standard error.
    let is_inner = |i: &usize| {
        let ([low, high], x) = (problem.limits(*i), reached.x[*i]);
        low + EDGE < x && x < high - EDGE
    };
    let free: Vec<usize> = (0..problem.free.len())
        .filter(is_inner)
        .map(|i| problem.free[i])
        .collect();
    let problem = Problem {
        free,
        values: problem.values_at(&reached.x),
        ..problem.clone()
    };
    let point = problem.at(problem.unknowns())?;
    let jacobian = problem.jacobian(&point)?;
    let slopes: Vec<_> = problem
        .priors(&point.x)
        .map(|(i, [_, slope])| (i, slope))
        .collect();
    let singular = Singular::of(&jacobian, &slopes);
    let derivatives = point.residuals.map(|r| problem.loss.slope(r));
    let noise = Noise::of(&derivatives, &point.rows, &jacobian, &singular.inverse());
    let linear = LinearTheory::of(&problem, &point, &jacobian, &singular, &noise);
    // With no more frames than parameters, further frames may determine a combination without
    // effect.
    let structural = point.rows.chunk_by(|a, b| a.time == b.time).count() > problem.free.len();
    let all = point.rows.iter().zip(&point.residuals);
    let residuals: Vec<_> = all
        .map(|(row, r)| (*row, r * problem.noise[row.series]))
        .collect();
    let parameters = parameter_estimates(&problem, &linear, widest, structural);
    let at_bound = parameters
        .iter()
        .filter(|one| one.verdict == Verdict::AtBound);
    let at_bound = at_bound.map(|one| Warning::AtBound {
        name: one.name.clone(),
    });
    let of_data = warnings(problem.data, problem.loss, &residuals, &noise);
    Ok(Estimates {
        weak: weak_directions(&problem, &linear, widest, structural),
        warnings: of_data.into_iter().chain(at_bound).collect(),
        parameters,
        chi_squared: 2.0 * reached.objective,
        degrees_of_freedom: point.residuals.len().saturating_sub(problem.free.len()),
        noise: problem.noise.clone(),
        lag_one: noise.lag_one(),
        residuals: residuals
            .iter()
            .map(|(row, r)| (row.series, row.time, *r))
            .collect(),
        objectives: Vec::new(),
        singular_values: singular.values.as_slice().to_vec(),
        family: problem.parameters.to_vec(),
        data: problem.data.to_vec(),
        loss: problem.loss,
        linear,
    })
}

/// Estimates of all parameters. Combinations without effect are `structural` if further frames do
/// not change that.
fn parameter_estimates(
    problem: &Problem,
    linear: &LinearTheory,
    widest: f64,
    structural: bool,
) -> Vec<Estimate> {
    let estimate = |(k, parameter): (usize, &Parameter)| {
        let (name, value, relative) = (
            parameter.name.clone(),
            problem.values[k],
            parameter.logarithmic,
        );
        let (error, verdict) = match problem.free.iter().position(|other| *other == k) {
            None if parameter.is_fixed() => (0.0, Verdict::Fixed),
            None => (0.0, Verdict::AtBound),
            Some(i) if linear.without_effect.iter().any(|change| change[i] != 0.0) => (
                f64::INFINITY,
                if structural {
                    Verdict::StructurallyNot
                } else {
                    Verdict::PracticallyNot
                },
            ),
            Some(i) => {
                let error = deviation(linear.covariance[(i, i)]);
                let verdict = if error <= widest {
                    Verdict::Identifiable
                } else {
                    Verdict::PracticallyNot
                };
                (error * parameter.unit(), verdict)
            }
        };
        Estimate {
            name,
            value,
            error,
            relative,
            verdict,
        }
    };
    problem
        .parameters
        .iter()
        .enumerate()
        .map(estimate)
        .collect()
}

/// Combinations without effect, and then those with a standard error above `widest`, the largest
/// error first.
fn weak_directions(
    problem: &Problem,
    linear: &LinearTheory,
    widest: f64,
    structural: bool,
) -> Vec<WeakDirection> {
    let undetermined = linear
        .without_effect
        .iter()
        .map(|changes| (changes.clone(), f64::INFINITY));
    let parameter = |i: usize| &problem.parameters[problem.free[i]];
    let direction = |(changes, error): (DVector<f64>, f64)| {
        // All components of a combination without effect are exact.
        let named = |i: &usize| changes[*i].abs() > if error.is_infinite() { 0.0 } else { NAMED };
        let sign = (0..changes.len())
            .find(named)
            .map_or(1.0, |i| changes[i].signum());
        let component = |i: usize| {
            (
                (parameter(i).name.clone(), sign * changes[i]),
                parameter(i).logarithmic,
            )
        };
        let (components, logarithmic) = (0..changes.len()).filter(named).map(component).unzip();
        WeakDirection {
            components,
            error,
            structural: structural && error.is_infinite(),
            logarithmic,
        }
    };
    undetermined
        .chain(uncertain(&linear.covariance, widest))
        .map(direction)
        .collect()
}
