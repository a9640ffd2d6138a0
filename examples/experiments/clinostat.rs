//! Shape of a shoot that rotates about the tangent of its base.

use std::error::Error;
use std::f64::consts::{FRAC_PI_2, TAU};

use morphorod::equilibrium::Unloaded;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::tropism::Memory;
use morphorod::{Scene, Shoot, Still};
use morphorod_plot::{Series, Style, println};
use nalgebra::{UnitQuaternion, Vector3};

use super::{BETA, ETA, HOUR, Panel, RADIUS, TISSUE, closed, direction, found, responses};

/// Growth time, s.
const GROWTH: f64 = 20.0 * HOUR;
/// Length, m.
const LENGTH: f64 = 0.03;

/// Horizontal base that rotates about its tangent.
struct Clinostat {
    /// Rate, rad/s.
    rate: f64,
}

impl Scene for Clinostat {
    fn gravity(&self, t: f64) -> Vector3<f64> {
        Still::upright().gravity(t)
    }

    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        Still::tilted(FRAC_PI_2).base
            * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.rate * t)
    }
}

/// Compares shoots with the closed form. Tissue rotates about the tangent t of a shape that is
/// fixed in space, t' = k [(e3 − (t·e3) t) + W t × e3]/(1 + W²), with k = β/(ηr) and W = Ωτg/η for
/// the rate Ω. The angle from the vertical and the azimuth obey θ' = −k sin θ/(1 + W²) and
/// φ' = −kW/(1 + W²).
pub fn run() -> Result<Panel, Box<dyn Error>> {
    let k = BETA / (ETA * RADIUS);
    let (mut bending, mut turning, mut rows, mut worst) =
        (Vec::new(), Vec::new(), Vec::new(), 0.0_f64);
    for w in [0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0] {
        let rate = w * ETA / GROWTH;
        let mut shoot = Shoot::builder(TISSUE)
            .length(LENGTH)
            .radius(RADIUS)
            .growth(Ongoing(UniformGrowth {
                zone_length: 0.1,
                time: GROWTH,
            }))
            .tropism(responses(Memory {
                time: 1e-3,
                delay: 0.0,
            }))
            .scene(Clinostat { rate })
            .build()?;
        let step = (TAU / rate / 80.0).min(0.05 * GROWTH / ETA);
        MethodOfSteps::with_solver(step, Unloaded).advance(&mut shoot, 30.0 * GROWTH / ETA)?;
        let [angle, azimuth] = direction(&shoot, LENGTH);
        // Averages along the shoot.
        let bend = -(0.5 * angle).tan().ln() / (k * LENGTH);
        let turn = -azimuth / (k * LENGTH);
        let expected = [1.0 / (1.0 + w * w), w / (1.0 + w * w)];
        worst = worst
            .max((bend - expected[0]).abs())
            .max((turn - expected[1]).abs());
        bending.push((w, bend));
        turning.push((w, turn));
        rows.extend([[w, 0.0, bend, expected[0]], [w, 1.0, turn, expected[1]]]);
    }
    println!("2. clinostat: largest difference from the closed form {worst:.1e} k");
    let line = |f: fn(f64) -> f64| {
        (0..=120)
            .map(|i| 0.05 * f64::from(i))
            .map(|w| (w, f(w) / (1.0 + w * w)))
            .collect()
    };
    let series = vec![
        closed(line(|_| 1.0), 0),
        closed(line(|w| w), 1),
        found(bending, 0),
        found(turning, 1),
        Series::text("towards the vertical", (2.2, 0.85), Style::Text, 0),
        Series::text("about the vertical", (3.9, 0.42), Style::Text, 1),
    ];
    Ok(Panel {
        name: "2. Shape on a clinostat",
        labels: [
            "rate of rotation × τg/η (1)",
            "rotation along the shoot / k (1)",
        ],
        series,
        rows,
    })
}
