//! Estimates of parameters, with their uncertainty.

use std::fmt::Display;

use nalgebra::{DMatrix, DVector};

use super::confidence::LinearTheory;
use super::jacobian::DIFFERENCE;
use super::parameter::free;
use super::problem::Problem;
use super::series::Series;
use super::{Family, Fit, FitError, Loss, Parameter, Warning};
use crate::model::Model;
use crate::shoot::Shoot;
use crate::tracking::root_mean_square;

/// 95 % quantile of the normal distribution: the half width of an interval of 90 % over the
/// standard error.
pub(super) const QUANTILE_95: f64 = 1.644_853_626_951_472_6;

/// Relative size below which the change of a function along a combination without effect is zero.
/// The size is relative to the sum of the absolute contributions of the parameters. The components
/// of such a combination have errors up to 1e-10 over the next singular value.
const CANCELLED: f64 = 1e-4;

/// Identifiability of a parameter from the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Verdict {
    /// The standard error is at most [`Fit::widest`](super::Fit::widest).
    Identifiable,
    /// The standard error exceeds [`Fit::widest`](super::Fit::widest). More, other or more accurate
    /// data may determine the parameter.
    PracticallyNot,
    /// A combination of changes of this parameter, and possibly others, leaves every datum
    /// unchanged. More accurate data of this kind, or more frames in this time, do not determine
    /// the parameter.
    StructurallyNot,
    /// The estimate is at a bound, and has no standard error.
    AtBound,
    /// The value of the parameter is given.
    Fixed,
}

/// Estimate of one parameter.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Estimate {
    /// Name of the parameter.
    pub name: String,
    /// Estimated value, in the unit of the parameter.
    pub value: f64,
    /// Standard error: relative (of the logarithm) for a logarithmic parameter, otherwise in the
    /// unit of the parameter. It is infinite if the parameter belongs to a combination without
    /// effect on the data, and zero if the parameter is fixed or at a bound.
    pub error: f64,
    /// Whether the error is relative.
    pub relative: bool,
    /// Identifiability of the parameter from the data.
    pub verdict: Verdict,
}

impl Estimate {
    /// Interval that contains the true value with a probability of 90 %, in the unit of the
    /// parameter, if errors are normal on the scale of the search.
    #[must_use]
    pub fn interval(&self) -> [f64; 2] {
        let end = |change: f64| {
            if self.relative {
                self.value * change.exp()
            } else {
                self.value + change
            }
        };
        [-QUANTILE_95, QUANTILE_95].map(|quantile| end(quantile * self.error))
    }
}

/// Combination of changes of parameters that the data do not determine.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct WeakDirection {
    /// Names of parameters and their components: changes of ln value for logarithmic parameters,
    /// otherwise of the value over the distance of its bounds. The largest is ±1.
    pub components: Vec<(String, f64)>,
    /// Standard error of the amplitude of this combination; infinite for a combination without
    /// effect on the data.
    pub error: f64,
    /// Whether no data of this kind determine the combination.
    pub structural: bool,
    /// Whether each of the components is a change of the logarithm.
    pub(super) logarithmic: Vec<bool>,
}

impl std::fmt::Display for WeakDirection {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names: Vec<&str> = self
            .components
            .iter()
            .map(|(name, _)| name.as_str())
            .collect();
        let Some((last, first)) = names.split_last() else {
            return Ok(());
        };
        if first.is_empty() {
            let effect = if self.structural {
                "has no effect on the data"
            } else {
                "hardly changes the data"
            };
            return write!(f, "{last} {effect}");
        }
        let (known, effect) = match self.structural {
            true => ("known only in combination", "leave every datum unchanged"),
            false => (
                "hardly known except in combination",
                "hardly change the data",
            ),
        };
        write!(f, "{} and {last} are {known}: changes of", first.join(", "))?;
        for ((name, component), logarithmic) in self.components.iter().zip(&self.logarithmic) {
            let unit = if *logarithmic { "ln" } else { "ranges of" };
            let small = component.abs() < 0.01;
            let component = if small {
                format!("{component:+.0e}")
            } else {
                format!("{component:+.2}")
            };
            write!(f, " {component} {unit} {name}")?;
        }
        write!(f, " {effect}")
    }
}

/// Result of a fit: estimates of all parameters with their uncertainty, noise, residuals and
/// warnings.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Estimates {
    /// All parameters in the order of the family.
    pub parameters: Vec<Estimate>,
    /// Combinations that the data do not determine.
    pub weak: Vec<WeakDirection>,
    /// Reasons to doubt the estimates; empty if the model explains the data up to their scatter.
    pub warnings: Vec<Warning>,
    /// Twice the loss of all residuals and priors at the estimates.
    pub chi_squared: f64,
    /// Number of residuals minus number of free parameters that are not at a bound.
    pub degrees_of_freedom: usize,
    /// Noise of each series, given or estimated, in the unit of its data, or rad for angles.
    pub noise: Vec<f64>,
    /// Estimated correlation of the noise in successive frames of a coordinate. The standard errors
    /// account for it.
    pub lag_one: f64,
    /// Residuals (simulated minus measured) in the order of time: index of the series, time (s),
    /// and value in the unit of the data, or rad for angles.
    pub residuals: Vec<(usize, f64, f64)>,
    /// Objectives that the remaining searches reached in the last of
    /// [`Fit::windows`](super::Fit::windows), the smallest first. An objective is the loss of all
    /// residuals and priors, half of `chi_squared`. If a noise is estimated, the objectives belong
    /// to its first rough estimate, and `chi_squared` to the last one.
    pub objectives: Vec<f64>,
    /// Singular values, the largest first, of the Jacobian of the residuals over the noise, whose
    /// columns are divided by their norms.
    pub singular_values: Vec<f64>,
    /// Parameters of the family of the fit.
    pub(super) family: Vec<Parameter>,
    /// Data of the fit.
    pub(super) data: Vec<Series>,
    /// Loss of the fit.
    pub(super) loss: Loss,
    /// Uncertainty in the linearised problem.
    pub(super) linear: LinearTheory,
}

impl<M: Model, E: Display, F: Fn(&[f64]) -> Result<Shoot<M>, E> + Sync> Family<F> {
    /// Problem of the data, the noise and the loss of some estimates.
    pub(super) fn problem_of<'a>(
        &'a self,
        fit: &Fit,
        estimates: &'a Estimates,
        values: Vec<f64>,
    ) -> Problem<'a> {
        let (noise, loss) = (estimates.noise.clone(), estimates.loss);
        Problem {
            noise,
            loss,
            ..self.problem(fit, &estimates.data, values)
        }
    }
}

impl Estimates {
    /// χ² per degree of freedom. It is about one if the model and the given noise are correct. If
    /// the noise is estimated, it is about one for any model.
    #[must_use]
    pub fn reduced_chi_squared(&self) -> f64 {
        self.chi_squared / self.degrees_of_freedom.max(1) as f64
    }

    /// Bayesian information criterion −2 ln L + k ln n of another family minus that of this one (G.
    /// Schwarz, Ann. Stat. 6, 461, 1978), with k parameters and n coordinates, both fitted to the
    /// same data. A positive difference favours this family; above 10 the evidence is very strong
    /// (R. E. Kass and A. E. Raftery, J. Am. Stat. Assoc. 90, 773, 1995). For a family with an
    /// internal oscillator, use [`Fit::scan_oscillator`](super::Fit::scan_oscillator) first.
    ///
    /// Correlated residuals contain less information. Therefore n and the difference of −2 ln L are
    /// divided by the number of successive residuals that contain the information of one, the
    /// larger of those of both fits.
    ///
    /// # Errors
    /// [`OtherData`](FitError::OtherData) if data, noise or loss differ.
    pub fn compare(&self, other: &Self) -> Result<f64, FitError> {
        let same = self.data.len() == other.data.len() && self.loss == other.loss;
        if !(same && self.data.iter().zip(&other.data).all(|(a, b)| a.equals(b))) {
            return Err(FitError::OtherData);
        }
        let redundancy = self.linear.redundancy.max(other.linear.redundancy);
        let n = self.residuals.len() as f64 / redundancy;
        // Minus twice the logarithm of the likelihood and the priors, up to a constant that depends
        // on the data only.
        let deviance = |found: &Self| {
            let logarithms = found
                .residuals
                .iter()
                .map(|(series, ..)| found.noise[*series].ln());
            found.chi_squared + 2.0 * logarithms.sum::<f64>()
        };
        // A parameter at a bound was free to be elsewhere.
        let parameters = |found: &Self| free(&found.family).len() as f64;
        Ok((deviance(other) - deviance(self)) / redundancy
            + (parameters(other) - parameters(self)) * n.max(1.0).ln())
    }

    /// Value of a function of the parameter values (in the order of the family), and its standard
    /// error by linear propagation, both in the unit of the function. The error is infinite if the
    /// function changes along a combination without effect on the data.
    pub fn derived(&self, function: impl Fn(&[f64]) -> f64) -> [f64; 2] {
        let (values, linear) = (self.values(), &self.linear);
        let slope = |k: &usize| {
            let parameter = &self.family[*k];
            let at = |change: f64| {
                let mut values = values.clone();
                values[*k] = parameter.value(parameter.unknown(values[*k]) + change);
                function(&values)
            };
            (at(DIFFERENCE) - at(-DIFFERENCE)) / (2.0 * DIFFERENCE)
        };
        let gradient = DVector::from_iterator(linear.free.len(), linear.free.iter().map(slope));
        let is_undetermined = linear.without_effect.iter().any(|change| {
            let parts = gradient.component_mul(change);
            parts.sum().abs() > CANCELLED * parts.abs().sum()
        });
        let variance = gradient.dot(&(&linear.covariance * &gradient));
        [
            function(&values),
            if is_undetermined {
                f64::INFINITY
            } else {
                deviation(variance)
            },
        ]
    }

    /// Values of all parameters, in their units and in the order of the family.
    #[must_use]
    pub fn values(&self) -> Vec<f64> {
        self.parameters
            .iter()
            .map(|parameter| parameter.value)
            .collect()
    }

    /// Estimate of the parameter with the given name; `None` if there is no such parameter.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Estimate> {
        self.parameters
            .iter()
            .find(|parameter| parameter.name == name)
    }

    /// Correlations of the estimates, in the order of the parameters. Those of parameters without a
    /// standard error are zero outside the diagonal.
    #[must_use]
    pub fn correlations(&self) -> Vec<Vec<f64>> {
        let LinearTheory {
            free, covariance, ..
        } = &self.linear;
        let mut all = DMatrix::<f64>::identity(self.parameters.len(), self.parameters.len());
        for (i, j) in (0..free.len()).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let correlation = covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt();
            let defined = if correlation.is_finite() {
                correlation
            } else {
                0.0
            };
            all[(free[i], free[j])] = defined;
            all[(free[j], free[i])] = defined;
        }
        all.row_iter()
            .map(|row| row.iter().copied().collect())
            .collect()
    }
}

impl std::fmt::Display for Estimates {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for Estimate {
            name,
            value,
            error,
            relative,
            verdict,
        } in &self.parameters
        {
            let known = error.is_finite();
            let error = if *relative {
                format!("{:.3} %", 100.0 * error)
            } else {
                format!("{error:.3e}")
            };
            let known = match verdict {
                Verdict::Fixed => "(given)".to_owned(),
                Verdict::AtBound => "(at a bound, without an error)".to_owned(),
                Verdict::StructurallyNot => "structurally not identifiable".to_owned(),
                Verdict::PracticallyNot if known => {
                    format!("± {error}, practically not identifiable")
                }
                Verdict::PracticallyNot => "practically not identifiable".to_owned(),
                Verdict::Identifiable => format!("± {error}"),
            };
            writeln!(f, "{name:>12} = {value:.6e} {known}")?;
        }
        self.weak
            .iter()
            .try_for_each(|weak| writeln!(f, "{weak}"))?;
        for (index, (series, noise)) in self.data.iter().zip(&self.noise).enumerate() {
            let of_series = self
                .residuals
                .iter()
                .filter(|(of, ..)| *of == index)
                .map(|(.., r)| *r);
            let (size, scatter) = (
                root_mean_square(&of_series.collect::<Vec<_>>()),
                series.scatter(),
            );
            let origin = if series.noise.is_some() {
                "given"
            } else {
                "estimated"
            };
            writeln!(
                f,
                "series {index}: residuals {size:.3e}, scatter of neighbouring frames {scatter:.3e}, noise {noise:.3e} \
                 ({origin})"
            )?;
        }
        if self.data.iter().any(|series| series.noise.is_some()) {
            writeln!(
                f,
                "χ² per degree of freedom {:.3}",
                self.reduced_chi_squared()
            )?;
        }
        writeln!(f, "correlation of successive residuals {:.2}", self.lag_one)?;
        if self.warnings.is_empty() {
            return write!(
                f,
                "verdict: the model explains the data up to their scatter"
            );
        }
        write!(
            f,
            "verdict: do not rely on these estimates before the following is explained:"
        )?;
        self.warnings
            .iter()
            .try_for_each(|warning| write!(f, "\n- {warning}"))
    }
}

/// Standard deviation. It is infinite if the variance overflows.
pub(super) fn deviation(variance: f64) -> f64 {
    if variance.is_finite() {
        variance.max(0.0).sqrt()
    } else {
        f64::INFINITY
    }
}
