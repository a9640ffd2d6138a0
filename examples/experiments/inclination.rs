//! Rate of bending of inclined shoots at several levels of gravity.

use std::error::Error;

use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::tropism::{Gravitropism, Memory, Response, Statoliths};
use morphorod::{Shoot, Still};
use morphorod_plot::{Series, Style, println};
use nalgebra::Vector3;

use super::{BETA, GROUND, HOUR, MINUTE, Panel, RADIUS, TISSUE, closed, direction, found};

/// Growth time, s.
const GROWTH: f64 = 20.0 * HOUR;
/// Length, m.
const LENGTH: f64 = 0.01;
/// Memory time and delay, s.
const MEMORY: Memory = Memory {
    time: 12.0 * MINUTE,
    delay: 12.0 * MINUTE,
};

/// Compares the mean rate of rotation of the apex between one and two delays with (βℓ/(r τg)) sin
/// θ0 (1 − (τm/τr) (1 − exp(−τr/τm))), which is exact for a shoot without sag: within this time the
/// response reads a past in which the shoot was straight.
pub fn run() -> Result<Panel, Box<dyn Error>> {
    let share = 1.0 - MEMORY.time / MEMORY.delay * (1.0 - (-MEMORY.delay / MEMORY.time).exp());
    let rate = (BETA * LENGTH / (RADIUS * GROWTH) * share).to_degrees() * HOUR;
    let levels = [0.1, 0.3, 1.0, 3.0];
    let (mut series, mut rows, mut worst) = (Vec::new(), Vec::new(), [0.0_f64; 4]);
    series.push(closed(
        (0..=90)
            .map(|i| f64::from(2 * i))
            .map(|x| (x, rate * x.to_radians().sin()))
            .collect(),
        0,
    ));
    for (index, level) in levels.into_iter().enumerate() {
        let mut points = Vec::new();
        for degrees in [15.0_f64, 45.0, 75.0, 90.0, 120.0, 150.0] {
            let gravity = Vector3::z() * (-GROUND * level);
            let perception = Statoliths {
                avalanche_time: 2.0 * MINUTE,
            };
            let mut shoot = Shoot::builder(TISSUE)
                .length(LENGTH)
                .radius(RADIUS)
                .growth(Ongoing(UniformGrowth {
                    zone_length: 0.1,
                    time: GROWTH,
                }))
                .tropism(
                    Gravitropism {
                        sensitivity: BETA,
                        perception,
                    }
                    .remembered(MEMORY),
                )
                .load(Weight { density: 1000.0 })
                .scene(Still {
                    gravity,
                    ..Still::tilted(degrees.to_radians())
                })
                .build()?;
            let mut run = MethodOfSteps::new(MINUTE);
            run.advance(&mut shoot, MEMORY.delay)?;
            let [before, _] = direction(&shoot, LENGTH);
            run.advance(&mut shoot, 2.0 * MEMORY.delay)?;
            let [after, _] = direction(&shoot, LENGTH);
            let bending = (before - after).to_degrees() / (MEMORY.delay / HOUR);
            let expected = rate * degrees.to_radians().sin();
            worst[index] = worst[index].max((bending / expected - 1.0).abs());
            points.push((degrees, bending));
            rows.push([degrees, level, bending, expected]);
        }
        series.push(found(points, index));
        let (marker, at) = (
            ["●", "■", "▲", "◆"][index],
            (150.0, rate * (0.98 - 0.1 * index as f64)),
        );
        series.push(Series::text(
            format!("{marker} {level} g"),
            at,
            Style::Beside,
            index,
        ));
    }
    println!("4. inclination: largest relative difference from the sine law");
    for (level, worst) in levels.iter().zip(worst) {
        println!("   at {level} g: {:.2} %, by the sag", 100.0 * worst);
    }
    Ok(Panel {
        name: "4. Inclination and magnitude of gravity",
        labels: ["inclination (°)", "rate of rotation of the apex (°/h)"],
        series,
        rows,
    })
}
