//! Period of circumnutation at several levels of gravity.

use std::error::Error;

use morphorod::cycle::{RotatingWave, RotatingWaveSolver};
use morphorod::stability::Linearisation;
use morphorod::tropism::Memory;
use morphorod::{Model, ParameterError, Shoot, ShootParameters, Still};
use morphorod_plot::{Series, Style, println};
use nalgebra::Vector3;

use super::{GROUND, HOUR, MINUTE, Panel, found};

/// Memory time and delay, those of the sunflower of experiment 1.
const MEMORY: Memory = Memory {
    time: 20.5 * MINUTE,
    delay: 20.5 * MINUTE,
};
/// Growth time, s. Fast growth makes the response so strong that a short shoot oscillates at 1 g,
/// which does not buckle at 9 g.
const GROWTH: f64 = 8.0 * HOUR;
/// Length, m.
const LENGTH: f64 = 0.03;

/// Returns an upright shoot at a level of gravity (g). Its statoliths follow gravity with a time
/// constant of 2 min.
fn shoot(level: f64) -> Result<Shoot<impl Model>, ParameterError> {
    let parameters = ShootParameters {
        length: LENGTH,
        growth_time: GROWTH,
        gravitropic_memory: MEMORY,
        proprioceptive_memory: MEMORY,
        ..ShootParameters::default()
    };
    parameters
        .reduced()
        .elements(6)
        .tropism(parameters.steering(parameters.statoliths()))
        .scene(Still {
            gravity: Vector3::z() * (-GROUND * level),
            ..Still::upright()
        })
        .build()
}

/// Follows the circular orbit from 1 to 9 g.
pub fn run() -> Result<Panel, Box<dyn Error>> {
    let solver = RotatingWaveSolver::default();
    let mut last: Option<RotatingWave> = None;
    let (mut periods, mut rows, mut stable) = (Vec::new(), Vec::new(), true);
    let mut ends = [[f64::NAN; 2]; 2];
    for level in (1..=9).map(f64::from) {
        let shoot = shoot(level)?;
        let wave = match &last {
            Some(wave) => solver.from_orbit(&shoot, wave)?,
            None => solver.from_mode(
                &shoot,
                &Linearisation::about(&shoot)?.rightmost()?,
                0.2 * LENGTH,
            )?,
        };
        stable &= wave.roots(&shoot, 2)?.unstable() == 0;
        let (period, radius) = (wave.period() / MINUTE, 1e3 * wave.radius());
        periods.push((level, period));
        rows.extend([
            [level, 0.0, period, f64::NAN],
            [level, 1.0, radius, f64::NAN],
        ]);
        if level == 1.0 {
            ends[0] = [period, radius];
        }
        ends[1] = [period, radius];
        last = Some(wave);
    }
    let [[first, wide], [final_period, narrow]] = ends;
    println!("3. centrifuge: period {first:.2} min at 1 g, {final_period:.2} min at 9 g");
    println!(
        "   radius of the tip {wide:.2} mm at 1 g, {narrow:.2} mm at 9 g; all orbits are stable: {stable}"
    );
    // A text at zero shows the change in proportion to the period.
    let change = format!(
        "decrease of the period: {:.2} %",
        100.0 * (1.0 - final_period / first)
    );
    let series = vec![
        found(periods, 0),
        Series::text(
            format!("radius of the tip: {wide:.1} mm"),
            (3.15, 120.0),
            Style::Text,
            0,
        ),
        Series::text(format!("{narrow:.1} mm"), (8.5, 120.0), Style::Text, 0),
        Series::text(change, (5.0, 0.0), Style::Text, 0),
    ];
    Ok(Panel {
        name: "3. Period in a centrifuge",
        labels: ["gravity (g)", "period of circumnutation (min)"],
        series,
        rows,
    })
}
