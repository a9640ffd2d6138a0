//! Settings of a fit, and their check with the data.

use std::fmt::Display;

use super::error::refuse;
use super::parameter::{free, initial_values};
use super::series::Series;
use super::{Family, FitError, Loss};
use crate::ensemble;
use crate::error::ParameterError;
use crate::model::{GrowthLaw, Model};
use crate::shoot::Shoot;

/// Smallest threshold of Huber's loss, for which almost all residuals are in its linear part.
const LEAST_THRESHOLD: f64 = 0.01;

/// Largest number of initial values and of iterations. More take hours.
const MOST_STARTS: usize = 1_000_000;

/// Largest number of time steps of a simulation, which takes seconds.
const MOST_STEPS: f64 = 1e5;

/// Part of the duration of a series in which the tip is near its initial position.
const EARLY: f64 = 0.1;

/// Ratio of the sizes of data and shoot, or of shoot and data, that only a wrong unit explains,
/// such as cm for mm.
const WRONG_UNIT: f64 = 7.0;

/// Settings of a fit.
///
/// ```
/// use morphorod::fit::{Fit, Loss};
/// let fit = Fit { loss: Loss::ROBUST, starts: 20, ..Fit::default() };
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Longest time step of the simulations, s; 120 s by default, and at most a tenth of the
    /// shortest period in the motion. Steps end at the times of the data, except for tips in frames
    /// closer than half a step: the path is then interpolated between the steps. The interpolation
    /// is inaccurate within three steps of a discontinuity of the laws, such as the end of a push.
    pub step: f64,
    /// Loss of residuals; [`Loss::Squares`] by default.
    pub loss: Loss,
    /// Number of initial guesses, from 1 to 1,000,000: the initial values of the family, and others
    /// between the bounds; 8 by default. A search from a single guess often ends in a local
    /// minimum.
    pub starts: usize,
    /// Largest number of iterations of the last search, from 1 to 1,000,000; 200 by default.
    pub iterations: usize,
    /// Parts of the duration of the data, each positive and at most 1, that are fitted one after
    /// the other; a quarter, half and all by default. A part with too few frames is skipped. After
    /// each part, only the better half of the searches is continued.
    pub windows: Vec<f64>,
    /// Largest standard error of an identifiable parameter; 0.5 by default. It is relative for a
    /// logarithmic parameter, otherwise it is divided by the distance of the bounds.
    pub widest: f64,
    /// Largest work of all successful simulations of a [`run`](Self::run), in evaluations of the
    /// forces in an element; 100 million by default, which take three to five minutes on one core.
    /// Times in a wrong unit may exceed it. A profile, the dependences, and each trial oscillator
    /// of a scan have the same limit.
    pub max_work: usize,
    /// Number of threads; that of the machine by default.
    pub threads: usize,
}

impl Default for Fit {
    fn default() -> Self {
        Self {
            step: 120.0,
            loss: Loss::Squares,
            starts: 8,
            iterations: 200,
            windows: vec![0.25, 0.5, 1.0],
            widest: 0.5,
            max_work: 100_000_000,
            threads: ensemble::cores(),
        }
    }
}

impl<M: Model, E: Display, F: Fn(&[f64]) -> Result<Shoot<M>, E>> Family<F> {
    /// Returns an error unless the settings, the family, the data and the shoot at the initial
    /// values are valid, and the data can determine the parameters.
    pub(super) fn check(&self, fit: &Fit, data: &[Series]) -> Result<(), FitError> {
        ParameterError::positive("time step of a fit", fit.step, "s")?;
        ParameterError::positive(
            "largest standard error of an identifiable parameter",
            fit.widest,
            "",
        )?;
        if let Loss::Huber(threshold) = fit.loss {
            let ok = threshold >= LEAST_THRESHOLD && threshold.is_finite();
            ParameterError::unless(
                ok,
                "threshold of Huber's loss",
                threshold,
                "0.01 or larger, and finite",
            )?;
        }
        for (name, number) in [
            ("number of starts", fit.starts),
            ("number of iterations", fit.iterations),
        ] {
            ParameterError::unless(
                (1..=MOST_STARTS).contains(&number),
                name,
                number as f64,
                "from 1 to 1,000,000",
            )?;
        }
        for part in &fit.windows {
            ParameterError::unless(
                *part > 0.0 && *part <= 1.0,
                "part of the data",
                *part,
                "positive and at most 1",
            )?;
        }
        self.check_parameters(data)?;
        let shoot = self.shoot(&initial_values(&self.parameters))?;
        let free = free(&self.parameters).len();
        for (index, series) in data.iter().enumerate() {
            series.check(index, shoot.time())?;
            let duration = series.times[series.times.len() - 1] - shoot.time();
            let requirement = "long enough that the data end within 100,000 steps: are their times in s, and counted \
                from the start of the shoot?";
            ParameterError::unless(
                duration <= MOST_STEPS * fit.step,
                "time step of a fit",
                fit.step,
                requirement,
            )?;
            // The likelihood has no maximum if a fit can explain a series exactly.
            let enough = if data.len() > 1 { 0 } else { free + 1 };
            let is_exact = series.noise.is_none()
                && series.varying_count() <= free
                && series.count() >= enough;
            let problem =
                "has no more coordinates than there are parameters: its noise must be given";
            refuse(&[(is_exact, problem)]).map_err(|problem| FitError::Series {
                series: index,
                problem,
            })?;
            check_unit(index, series, &shoot)?;
        }
        let coordinates: usize = data.iter().map(Series::count).sum();
        let parameters = free + usize::from(data.iter().any(|series| series.noise.is_none()));
        if coordinates < parameters.max(1) {
            Err(FitError::Insufficient {
                coordinates,
                parameters,
            })
        } else {
            Ok(())
        }
    }
}

/// Returns an error if the sizes of a series and of the shoot, at its start or at the end of the
/// data, differ by a factor that suggests a wrong unit. Angles have no size, and a scale or an
/// offset may explain any size.
fn check_unit(index: usize, series: &Series, shoot: &Shoot<impl Model>) -> Result<(), FitError> {
    if series.is_angle || series.scale.is_some() || series.offset.is_some() {
        return Ok(());
    }
    let (observed, length, start) = (series.extent(), shoot.rod().length(), shoot.time());
    let duration = series.times[series.times.len() - 1] - start;
    let growth = shoot.model().growth();
    let last = if growth.elongates() {
        growth.length(length, duration)
    } else {
        length
    };
    let longest = length.max(last)
        * series
            .view
            .0
            .iter()
            .map(|row| row.norm())
            .fold(0.0, f64::max);
    let expected = if series.dimension() == 3 {
        // With times in another unit the shoot would grow far beyond the data.
        last
    } else if series.times[0] - start <= EARLY * duration {
        series.view.image(&shoot.tip()).norm()
    } else {
        // The tip may be close to the line of sight to the base, such as that of a risen shoot from
        // above.
        0.0
    };
    let sizes = [
        (observed > WRONG_UNIT * longest, longest),
        (observed * WRONG_UNIT < expected, expected),
    ];
    let wrong = sizes.into_iter().find(|(is_wrong, _)| *is_wrong);
    wrong.map_or(Ok(()), |(_, modelled)| {
        Err(FitError::Unit {
            series: index,
            observed,
            modelled,
        })
    })
}
