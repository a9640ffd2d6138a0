//! Entrainment of a circumnutating shoot by periodic tilts.

use std::error::Error;
use std::f64::consts::TAU;

use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::tropism::Memory;
use morphorod::{Model, ParameterError, Scene, Shoot, Still};
use morphorod_plot::{Series, Style, println};
use nalgebra::{UnitQuaternion, Vector3};

use super::{HOUR, MINUTE, Panel, TISSUE, found, responses};

/// Memory time and delay, for which the shoot oscillates with a period of 2.5 h, as hypocotyls of
/// sunflower do.
const MEMORY: Memory = Memory {
    time: 20.5 * MINUTE,
    delay: 20.5 * MINUTE,
};
/// Growth time, s; in proportion to the memory time, so that oscillations begin at 6.56 cm.
const GROWTH: f64 = 20.0 / 12.0 * 20.5 * HOUR;
/// Length, m.
const LENGTH: f64 = 0.067;
/// Number of periods of the tilt; the second half is evaluated.
const PERIODS: u32 = 60;
/// Time steps in a period of the tilt.
const STEPS: u32 = 32;

/// Base that is tilted towards e1 and back.
struct Rocker {
    /// Largest angle, rad.
    angle: f64,
    /// Period, s.
    period: f64,
}

impl Scene for Rocker {
    fn gravity(&self, t: f64) -> Vector3<f64> {
        Still::upright().gravity(t)
    }

    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        Still::tilted(self.angle * (TAU * t / self.period).sin()).base
    }
}

/// Returns a shoot that is bent in the plane of the tilt.
fn shoot(scene: Rocker) -> Result<Shoot<impl Model>, ParameterError> {
    let mut shoot = Shoot::builder(TISSUE)
        .length(LENGTH)
        .radius(super::RADIUS)
        .elements(3)
        .growth(Ongoing(UniformGrowth {
            zone_length: 0.1,
            time: GROWTH,
        }))
        .tropism(responses(MEMORY))
        .load(Weight { density: 1000.0 })
        .scene(scene)
        .build()?;
    shoot.set_intrinsic(|_| Vector3::y() * 8.0);
    Ok(shoot)
}

/// Mean and standard deviation of the period of the tip in the second half of a run, s.
fn period(scene: Rocker) -> Result<[f64; 2], Box<dyn Error>> {
    let step = scene.period / f64::from(STEPS);
    let mut shoot = shoot(scene)?;
    let mut run = MethodOfSteps::new(step);
    let (mut last, mut crossings) = (0.0, Vec::new());
    for k in 0..=PERIODS * STEPS {
        run.advance(&mut shoot, step * f64::from(k))?;
        let now = shoot.tip().x;
        if k > PERIODS * STEPS / 2 && last < 0.0 && now >= 0.0 {
            crossings.push(step * (f64::from(k) - now / (now - last)));
        }
        last = now;
    }
    let periods: Vec<f64> = crossings.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mean = periods.iter().sum::<f64>() / periods.len() as f64;
    let variance = periods
        .iter()
        .map(|period| (period - mean).powi(2))
        .sum::<f64>()
        / periods.len() as f64;
    Ok([mean, variance.sqrt()])
}

/// Tilts a shoot with several periods and two amplitudes.
pub fn run() -> Result<Panel, Box<dyn Error>> {
    let [natural, _] = period(Rocker {
        angle: 0.0,
        period: 150.0 * MINUTE,
    })?;
    println!(
        "1. entrainment: period without tilts {:.2} min",
        natural / MINUTE
    );
    let (mut series, mut rows) = (Vec::new(), Vec::new());
    for (colour, degrees) in [2.0_f64, 4.0].into_iter().enumerate() {
        let (mut locked, mut points) = (Vec::new(), Vec::new());
        for k in 0..=24 {
            let tilt = natural * (0.64 + 0.03 * f64::from(k));
            let [mean, deviation] = period(Rocker {
                angle: degrees.to_radians(),
                period: tilt,
            })?;
            rows.push([tilt / MINUTE, degrees, mean / MINUTE, f64::NAN]);
            points.push((tilt / HOUR, mean / HOUR));
            // An entrained shoot has the period of the tilt, and all its periods are equal.
            if (mean / tilt - 1.0).abs() < 1e-3 && deviation < 1e-2 * mean {
                locked.push(tilt / MINUTE);
            }
        }
        match (locked.first(), locked.last()) {
            (Some(first), Some(last)) => {
                println!("   tilts of {degrees}°: entrained from {first:.0} to {last:.0} min")
            }
            _ => println!("   tilts of {degrees}°: not entrained"),
        }
        series.push(found(points.clone(), colour));
        series.push(Series::new("", points, Style::Marked, colour));
    }
    let hours = |share: f64| share * natural / HOUR;
    series.push(Series::new(
        "",
        vec![(hours(0.64), hours(0.64)), (hours(1.36), hours(1.36))],
        Style::Dashed,
        6,
    ));
    for (text, x, y) in [
        ("2°", 0.8, 1.04),
        ("2°", 1.17, 1.06),
        ("4°", 0.755, 0.88),
        ("4°", 1.34, 1.12),
        ("period of the tilts", 1.12, 1.32),
    ] {
        series.push(Series::text(text, (hours(x), hours(y)), Style::Text, 6));
    }
    Ok(Panel {
        name: "1. Entrainment by tilts of 2° and 4°",
        labels: ["period of the tilts (h)", "mean period of the tip (h)"],
        series,
        rows,
    })
}
