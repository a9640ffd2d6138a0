//! Families of shoots and their parameters.

use std::fmt::Display;

use super::error::{FitError, refuse};
use super::series::Series;
use crate::model::Model;
use crate::shoot::Shoot;

/// Smallest distance of the bounds relative to the larger one, ten times the step of a difference
/// quotient.
const CLOSEST: f64 = 1e-4;

/// Largest absolute value. Squares and products of bounds are finite.
const LARGEST: f64 = 1e100;

/// Smallest standard deviation of a prior, relative to the unknown, whose rounding then is 1e-4 of
/// it.
const NARROWEST: f64 = 1e-12;

/// A parameter of a family of shoots: its name, initial value, bounds and prior.
#[derive(Debug, Clone, PartialEq)]
#[must_use]
#[non_exhaustive]
pub struct Parameter {
    /// Name, used in estimates and messages, and by series that refer to the parameter.
    pub name: String,
    /// Initial value, in the unit of the parameter.
    pub start: f64,
    /// Smallest and largest value, in the unit of the parameter. The parameter is fixed if they are
    /// equal.
    pub bounds: [f64; 2],
    /// Whether the search uses the logarithm of the parameter.
    pub logarithmic: bool,
    /// Centre and standard deviation of a Gaussian prior, or `None` without a prior. The centre is
    /// a value of the parameter. The deviation is that of the logarithm (without unit) if the
    /// parameter is logarithmic, otherwise that of the parameter, in its unit.
    pub prior: Option<[f64; 2]>,
}

impl Parameter {
    /// Positive parameter between two bounds, searched on a logarithmic scale from their geometric
    /// mean.
    pub fn positive(name: &str, bounds: [f64; 2]) -> Self {
        Self {
            bounds,
            logarithmic: true,
            ..Self::fixed(name, (bounds[0] * bounds[1]).sqrt())
        }
    }

    /// Parameter of any sign between two bounds, searched on a linear scale from their mean.
    pub fn linear(name: &str, bounds: [f64; 2]) -> Self {
        Self {
            bounds,
            ..Self::fixed(name, 0.5 * (bounds[0] + bounds[1]))
        }
    }

    /// Parameter with a known value.
    pub fn fixed(name: &str, value: f64) -> Self {
        Self {
            name: name.to_owned(),
            start: value,
            bounds: [value; 2],
            logarithmic: false,
            prior: None,
        }
    }

    /// Sets the initial value.
    pub fn starting(self, start: f64) -> Self {
        Self { start, ..self }
    }

    /// Sets a Gaussian prior: see [`prior`](Self::prior).
    pub fn with_prior(self, centre: f64, deviation: f64) -> Self {
        Self {
            prior: Some([centre, deviation]),
            ..self
        }
    }

    /// Whether the value is known.
    #[must_use]
    pub fn is_fixed(&self) -> bool {
        self.bounds[0] == self.bounds[1]
    }

    /// Unknown of a search for a value of the parameter: ln value, or the value over the distance
    /// of the bounds.
    pub(super) fn unknown(&self, value: f64) -> f64 {
        if self.logarithmic {
            value.ln()
        } else {
            value / self.unit()
        }
    }

    /// Value of the parameter for its unknown.
    pub(super) fn value(&self, unknown: f64) -> f64 {
        if self.logarithmic {
            unknown.exp()
        } else {
            unknown * self.unit()
        }
    }

    /// Bounds of the unknown.
    pub(super) fn limits(&self) -> [f64; 2] {
        self.bounds.map(|bound| self.unknown(bound))
    }

    /// Residual of the prior for an unknown, and its derivative: the difference from the centre
    /// over the standard deviation, and the inverse of the latter. `None` without a prior.
    pub(super) fn prior_residual(&self, unknown: f64) -> Option<[f64; 2]> {
        let [centre, deviation] = self.prior?;
        let deviation = deviation / self.unit();
        Some([
            (unknown - self.unknown(centre)) / deviation,
            1.0 / deviation,
        ])
    }

    /// Error of the estimate over that of its unknown: the distance of the bounds of a linear
    /// parameter, otherwise one. Errors of logarithmic parameters are relative.
    pub(super) fn unit(&self) -> f64 {
        if self.logarithmic || self.is_fixed() {
            1.0
        } else {
            self.bounds[1] - self.bounds[0]
        }
    }

    /// Returns an error unless the initial value, the bounds and the prior are valid, and the name
    /// is not repeated.
    fn check(&self, is_repeated: bool) -> Result<(), FitError> {
        let ([low, high], is_free) = (self.bounds, !self.is_fixed());
        let is_normal = |[centre, deviation]: [f64; 2]| {
            deviation > 0.0 && deviation.is_finite() && self.unknown(centre).is_finite()
        };
        let is_finite = [low, high, self.start].iter().all(|x| x.abs() <= LARGEST);
        let is_apart = high - low > CLOSEST * low.abs().max(high.abs());
        // Rounding of the unknown changes the residual of an exact prior.
        let largest = self
            .limits()
            .iter()
            .fold(1.0_f64, |largest, x| largest.max(x.abs()));
        let is_exact = self
            .prior_residual(0.0)
            .is_some_and(|[_, slope]| slope * NARROWEST * largest > 1.0);
        let wrong_prior = "has a prior without a finite centre and a positive standard deviation";
        let conditions = [
            (
                !is_finite,
                "has an initial value or a bound that is not finite or beyond 1e100",
            ),
            (self.name.is_empty(), "has an empty name"),
            (low > high, "has a lower bound above its upper bound"),
            (
                is_free && !is_apart,
                "has bounds that are almost equal: fix it",
            ),
            (
                self.logarithmic && !(low > 0.0),
                "has a bound that is not positive, though its scale is logarithmic",
            ),
            (
                !(self.start >= low && self.start <= high),
                "has an initial value outside its bounds",
            ),
            (!self.prior.is_none_or(is_normal), wrong_prior),
            (
                is_free && is_exact,
                "has a prior that is almost exact: fix it",
            ),
            (is_repeated, "has the name of an earlier parameter"),
        ];
        refuse(&conditions).map_err(|problem| FitError::Parameter {
            name: self.name.clone(),
            problem,
        })
    }
}

/// Initial values of parameters.
pub(super) fn initial_values(parameters: &[Parameter]) -> Vec<f64> {
    parameters.iter().map(|parameter| parameter.start).collect()
}

/// Indices of the parameters without a known value.
pub(super) fn free(parameters: &[Parameter]) -> Vec<usize> {
    (0..parameters.len())
        .filter(|k| !parameters[*k].is_fixed())
        .collect()
}

/// A family of shoots: parameters, and a function from their values to a shoot at its start.
///
/// The function receives the values of all parameters in their order, including fixed ones. It may
/// start the shoot with a history by [`Integrator::start`](crate::integrator::Integrator::start).
/// Parameters that only a series uses, such as the scale of a camera, are in the same list.
#[derive(Debug, Clone)]
pub struct Family<F> {
    /// Parameters, in the order in which `build` receives their values.
    pub parameters: Vec<Parameter>,
    /// Function from the values of the parameters to a shoot, or an error with a message.
    pub build: F,
}

impl<F> Family<F> {
    /// Index of the parameter with a name.
    pub(super) fn index(&self, name: &str) -> Option<usize> {
        self.parameters
            .iter()
            .position(|parameter| parameter.name == name)
    }

    /// Names of all parameters with the given values.
    pub(super) fn named(&self, values: &[f64]) -> Vec<(String, f64)> {
        self.parameters
            .iter()
            .zip(values)
            .map(|(parameter, value)| (parameter.name.clone(), *value))
            .collect()
    }

    /// Shoot with the given values of all parameters.
    pub(super) fn shoot<M: Model, E: Display>(&self, values: &[f64]) -> Result<Shoot<M>, FitError>
    where
        F: Fn(&[f64]) -> Result<Shoot<M>, E>,
    {
        let problem = |error: E| FitError::Family {
            values: self.named(values),
            problem: error.to_string(),
        };
        (self.build)(values).map_err(problem)
    }

    /// Returns an error unless the parameters are valid, and the family has all parameters that the
    /// data name.
    pub(super) fn check_parameters(&self, data: &[Series]) -> Result<(), FitError> {
        for (index, parameter) in self.parameters.iter().enumerate() {
            parameter.check(self.index(&parameter.name) != Some(index))?;
        }
        let mut used = data.iter().enumerate().flat_map(|(series, data)| {
            data.scale
                .iter()
                .chain(data.offset.iter().flatten())
                .map(move |name| (series, name))
        });
        let unknown = used.find(|(_, name)| self.index(name).is_none());
        unknown.map_or(Ok(()), |(series, name)| {
            Err(FitError::UnknownName {
                series,
                name: name.clone(),
            })
        })
    }
}
