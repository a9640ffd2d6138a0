//! Settings of the example from its options: the shoot, its parameters, and the fit.

use std::error::Error;

use morphorod::fit::{Family, Fit, Loss, Parameter, Series};
use morphorod::tropism::Handedness;
use morphorod::{DynLaws, ParameterError, Shoot};
use morphorod_plot::Options;

use super::data::{self, Points};
use super::plants::{Draw, OSCILLATOR, PARAMETERS, Plant, Seen, index};

const HOUR: f64 = 3600.0;
const M_PER_MM: f64 = 1e-3;

/// Largest force of the push of the synthetic circumnutating shoot, N.
const PUSH: [f64; 2] = [2e-5, 1e-5];

/// Factor of the initial values of a fit to synthetic data.
const AWAY: f64 = 1.3;

/// The shoot and its parameters.
pub struct Setting {
    /// Properties that are not parameters.
    pub plant: Plant,
    /// Values of [`PARAMETERS`]: given ones, and initial ones of free parameters.
    pub values: Vec<f64>,
    /// Names of the free parameters.
    pub free: Vec<&'static str>,
    /// Indices of parameters with their bounds.
    bounds: Vec<(usize, [f64; 2])>,
    /// Whether the data are a table of the user.
    own: bool,
    /// Whether the synthetic shoot is horizontal and has a constant length.
    pub righting: bool,
}

impl Setting {
    /// Reads the options.
    pub fn new(options: &Options) -> Result<Self, Box<dyn Error>> {
        let (own, case) = (
            options.flag("file") || options.flag("centre-lines"),
            options.text("case"),
        );
        if !own && !["righting", "circumnutation"].contains(&case) {
            return Err(
                format!("there is no case '{case}': give righting or circumnutation").into(),
            );
        }
        let righting = !own && case == "righting";
        let zone = options.get_if("zone", "0 or larger", |zone: &f64| *zone >= 0.0);
        let plant = Plant {
            constant: righting || own && zone == 0.0,
            mature_modulus: None,
            proprioceptive: None,
            handedness: Handedness::Counterclockwise,
        };
        let pushed = |axis: usize| if own || righting { 0.0 } else { PUSH[axis] };
        let value = |(name, value, _): &(&str, f64, f64)| match *name {
            "l_0" => {
                M_PER_MM
                    * if righting {
                        50.0
                    } else {
                        options.positive("length")
                    }
            }
            "l_g" if zone > 0.0 => M_PER_MM * zone,
            "tau_g" => {
                HOUR * if righting {
                    20.0
                } else {
                    options.positive("growth-hours")
                }
            }
            "alpha" => options.get("alpha"),
            "r" => M_PER_MM * options.positive("radius"),
            "tilt" => if righting {
                90.0_f64
            } else {
                options.get("tilt")
            }
            .to_radians(),
            "push_x" => pushed(0),
            "push_y" => pushed(1),
            _ => *value,
        };
        let mut values: Vec<f64> = PARAMETERS.iter().map(value).collect();
        for (k, text) in named(options.text("set"), "--set")? {
            values[k] = number(text, "--set")?;
        }
        let free = match options.text("free") {
            "" if righting => vec!["beta", "eta", "tau_m", "tau_r", "E", "l_0"],
            // An exactly straight and upright shoot stays straight, and its parameters have no
            // effect.
            "" if own && options.text("view") == "above" => {
                vec!["beta", "eta", "tau_m", "tau_r", "l_0", "bend_x", "bend_y"]
            }
            "" => vec!["beta", "eta", "tau_m", "tau_r", "l_0"],
            text => text
                .split(',')
                .map(|name| known(name.trim()))
                .collect::<Result<_, _>>()?,
        };
        let bounds = named(options.text("bounds"), "--bounds")?
            .into_iter()
            .map(|(k, text)| {
                let (low, high) = text
                    .split_once(':')
                    .ok_or_else(|| format!("--bounds needs LOW:HIGH, not '{text}'"))?;
                Ok::<_, Box<dyn Error>>((k, [number(low, "--bounds")?, number(high, "--bounds")?]))
            });
        Ok(Self {
            plant,
            values,
            free,
            bounds: bounds.collect::<Result<_, _>>()?,
            own,
            righting,
        })
    }

    /// Data, their points in the figures, and the parameters of the camera.
    pub fn data(
        &self,
        options: &Options,
    ) -> Result<(Series, Points, Vec<Parameter>), Box<dyn Error>> {
        let seen = if self.righting {
            Seen::Lines
        } else {
            Seen::Above
        };
        let (series, points, cameras) = if self.own {
            data::read(options)?
        } else {
            let setting = [
                options.positive("hours"),
                300.0,
                options.positive("step").min(100.0),
            ];
            let noise = M_PER_MM * options.positive("noise");
            data::synthetic(
                self.plant,
                &self.values,
                setting,
                seen,
                noise,
                &mut Draw::new(1),
            )?
        };
        if !options.flag("known-noise") {
            return Ok((series, points, cameras));
        }
        let unit = if points.is_angle() {
            1_f64.to_radians()
        } else {
            M_PER_MM
        };
        Ok((
            series.with_noise(unit * options.positive("known-noise")),
            points,
            cameras,
        ))
    }

    /// Settings of the fit.
    pub fn fit(options: &Options) -> Fit {
        let loss = if options.flag("robust") {
            Loss::ROBUST
        } else {
            Loss::Squares
        };
        let [starts, iterations, max_work] =
            ["starts", "iterations", "max-work"].map(|name| options.get(name));
        Fit {
            step: options.positive("step"),
            loss,
            starts,
            iterations,
            max_work,
            ..Fit::default()
        }
    }

    /// Family without an oscillator, unless its sensitivity is free or given. For synthetic data,
    /// the initial values differ from the true ones. `cameras` are parameters of the camera.
    pub fn family(
        &self,
        cameras: &[Parameter],
    ) -> Family<impl Fn(&[f64]) -> Result<Shoot<DynLaws>, ParameterError> + Sync + use<>> {
        let mut values = self.values.clone();
        if !self.own && !self.free.contains(&"alpha") {
            values[OSCILLATOR.start] = 0.0;
        }
        self.bounded(self.plant.family(
            &values,
            &self.free,
            if self.own { 1.0 } else { AWAY },
            cameras.to_vec(),
        ))
    }

    /// The family with the bounds of the options.
    pub fn bounded<F>(&self, mut family: Family<F>) -> Family<F> {
        for (k, bounds) in &self.bounds {
            let parameter = &mut family.parameters[*k];
            if !parameter.is_fixed() {
                parameter.bounds = *bounds;
                parameter.start = parameter
                    .start
                    .clamp(bounds[0].min(bounds[1]), bounds[1].max(bounds[0]));
            }
        }
        family
    }
}

/// The name of a parameter, if it exists.
fn known(name: &str) -> Result<&'static str, String> {
    index(name).map(|k| PARAMETERS[k].0).ok_or_else(|| {
        let names: Vec<&str> = PARAMETERS.iter().map(|(name, ..)| *name).collect();
        format!(
            "there is no parameter '{name}'; the parameters are {}",
            names.join(", ")
        )
    })
}

/// Reads `name=text,…`: indices of parameters with their texts.
fn named<'a>(text: &'a str, option: &str) -> Result<Vec<(usize, &'a str)>, String> {
    let one = |part: &'a str| {
        let (name, value) = part
            .split_once('=')
            .ok_or_else(|| format!("{option} needs NAME=…, not '{part}'"))?;
        let name = known(name.trim())?;
        Ok((index(name).unwrap_or_default(), value.trim()))
    };
    text.split(',')
        .map(str::trim)
        .filter(|part| !part.is_empty())
        .map(one)
        .collect()
}

/// Reads a finite number of an option.
fn number(text: &str, option: &str) -> Result<f64, String> {
    let number = text
        .trim()
        .parse()
        .ok()
        .filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| format!("{option} needs a finite number, not '{text}'"))
}
