//! Families of shoots.

use std::fmt::Display;

use super::series::Series;
use super::{FitError, Parameter};
use crate::model::Model;
use crate::shoot::Shoot;

/// A family of shoots: parameters, and a function from their values to a shoot at its start.
///
/// The function receives the values of all parameters in their order, including fixed ones. It may start the shoot
/// with a history by [`Integrator::start`](crate::integrator::Integrator::start). Parameters that only a series uses,
/// such as the scale of a camera, are in the same list.
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
        self.parameters.iter().position(|parameter| parameter.name == name)
    }

    /// Names of all parameters with the given values.
    pub(super) fn named(&self, values: &[f64]) -> Vec<(String, f64)> {
        self.parameters.iter().zip(values).map(|(parameter, value)| (parameter.name.clone(), *value)).collect()
    }

    /// Initial values of all parameters.
    pub(super) fn initial_values(&self) -> Vec<f64> {
        self.parameters.iter().map(|parameter| parameter.start).collect()
    }

    /// Shoot with the given values of all parameters.
    pub(super) fn shoot<M: Model, E: Display>(&self, values: &[f64]) -> Result<Shoot<M>, FitError>
    where
        F: Fn(&[f64]) -> Result<Shoot<M>, E>,
    {
        let problem = |error: E| FitError::Family { values: self.named(values), problem: error.to_string() };
        (self.build)(values).map_err(problem)
    }

    /// Returns an error unless the parameters are valid, and the family has all parameters that the data name.
    pub(super) fn check(&self, data: &[Series]) -> Result<(), FitError> {
        for (index, parameter) in self.parameters.iter().enumerate() {
            parameter.check()?;
            if self.index(&parameter.name) != Some(index) {
                let problem = "has the name of an earlier parameter";
                return Err(FitError::Parameter { name: parameter.name.clone(), problem });
            }
        }
        for (series, data) in data.iter().enumerate() {
            for name in data.scale.iter().chain(data.offset.iter().flatten()) {
                if self.index(name).is_none() {
                    return Err(FitError::UnknownName { series, name: name.clone() });
                }
            }
        }
        Ok(())
    }
}
