//! Families of shoots and synthetic data.

use std::f64::consts::FRAC_PI_2;

use crate::fixtures::random::Draw;
use crate::fixtures::shoots::{HOUR, remembering};
use morphorod::fit::{Family, Parameter};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::tropism::{Memory, Oscillator, SettledStatoliths};
use morphorod::{DynLaws, ParameterError, Shoot, ShootParameters, Still};
use nalgebra::Vector3;

/// Noise of a coordinate, m.
pub const NOISE: f64 = 1e-4;

/// Names of the parameters: β, η, τm (s), τr (s), τg (s), E (Pa), ℓ0 (m).
pub const NAMES: [&str; 7] = ["beta", "eta", "tau_m", "tau_r", "tau_g", "E", "l_0"];

/// True values of the parameters.
pub const TRUTH: [f64; 7] = [0.8, 20.0, 720.0, 720.0, 72e3, 1e7, 0.05];

/// Function from the values of the parameters to a shoot.
pub type Build = fn(&[f64]) -> Result<Shoot<DynLaws>, ParameterError>;

/// A horizontal shoot of constant length that rises, with the parameters of [`NAMES`].
pub fn righting(p: &[f64]) -> Result<Shoot<DynLaws>, ParameterError> {
    oscillating(p, Oscillator::new(0.0, HOUR))
}

/// The same shoot with an internal oscillator.
pub fn oscillating(p: &[f64], oscillator: Oscillator) -> Result<Shoot<DynLaws>, ParameterError> {
    let memory = Memory {
        time: p[2],
        delay: p[3],
    };
    let parameters = ShootParameters {
        gravitropic_sensitivity: p[0],
        proprioceptive_sensitivity: p[1],
        growth_time: p[4],
        youngs_modulus: p[5],
        length: p[6],
        ..remembering(memory, memory)
    };
    let (gravitropism, proprioception) = parameters.steering(SettledStatoliths);
    let builder = parameters.reduced().elements(4);
    builder
        .tropism((oscillator, gravitropism, proprioception))
        .scene(Still::tilted(FRAC_PI_2))
        .into_dyn()
        .build()
}

/// Family of righting shoots. The initial values of the free parameters are their true values times
/// `factor`.
pub fn family(free: &[&str], factor: f64) -> Family<Build> {
    let parameter = |(name, truth): (&&str, &f64)| {
        if free.contains(name) {
            Parameter::positive(name, [truth / 5.0, truth * 5.0]).starting(truth * factor)
        } else {
            Parameter::fixed(name, *truth)
        }
    };
    Family {
        parameters: NAMES.iter().zip(&TRUTH).map(parameter).collect(),
        build: righting,
    }
}

/// Times (s) every 10 min over six hours, and `count` points (m) of the true shoot at each time,
/// from base to tip, with noise (m).
pub fn measured(count: usize, noise: f64, seed: u64) -> (Vec<f64>, Vec<Vec<Vector3<f64>>>) {
    measured_of(righting(&TRUTH).unwrap(), count, noise, seed)
}

/// The same data of a given shoot.
pub fn measured_of(
    mut shoot: Shoot<DynLaws>,
    count: usize,
    noise: f64,
    seed: u64,
) -> (Vec<f64>, Vec<Vec<Vector3<f64>>>) {
    let mut integrator = MethodOfSteps::new(120.0);
    let mut draw = Draw::new(seed);
    let times: Vec<f64> = (1..=36).map(|k| HOUR / 6.0 * f64::from(k)).collect();
    let mut frame = |time: &f64| {
        integrator.advance(&mut shoot, *time).unwrap();
        let points = if count == 1 {
            vec![shoot.tip()]
        } else {
            shoot.rod().centre_line_at(count + 1)[1..].to_vec()
        };
        let mut noisy = |p: Vector3<f64>| p + Vector3::from_fn(|_, _| noise * draw.normal().x);
        points.into_iter().map(&mut noisy).collect()
    };
    let frames = times.iter().map(&mut frame).collect();
    (times, frames)
}

/// Times (s) and positions of the tip (m) of the true shoot, with noise (m).
pub fn tips(noise: f64, seed: u64) -> (Vec<f64>, Vec<Vector3<f64>>) {
    let (times, frames) = measured(1, noise, seed);
    (times, frames.into_iter().map(|frame| frame[0]).collect())
}
