//! Overshoot of a tilted shoot, and its steady shape.

use std::error::Error;
use std::f64::consts::FRAC_PI_2;

use morphorod::equilibrium::Unloaded;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{ConstantHistory, Integrator, MethodOfSteps};
use morphorod::load::{Load, Weight};
use morphorod::stability::solve_steady_state;
use morphorod::tropism::Memory;
use morphorod::{Model, ParameterError, Shoot, Still};
use morphorod_plot::{Series, Style, println};
use nalgebra::Vector3;

use super::{BETA, ETA, HOUR, Panel, RADIUS, TISSUE, closed, direction, found, responses};

/// Time τg/η in which proprioception acts, s.
const TIME: f64 = HOUR;
/// Convergence length Lc = ηr/β, m.
const CONVERGENCE: f64 = ETA * RADIUS / BETA;

/// Returns a shoot of a length (m) on a base that is tilted by an angle (rad). Its responses have
/// no delay.
fn shoot(length: f64, tilt: f64, load: impl Load) -> Result<Shoot<impl Model>, ParameterError> {
    Shoot::builder(TISSUE)
        .length(length)
        .radius(RADIUS)
        .elements(16)
        .growth(Ongoing(UniformGrowth {
            zone_length: 0.2,
            time: ETA * TIME,
        }))
        .tropism(responses(Memory {
            time: 1e-3,
            delay: 0.0,
        }))
        .load(load)
        .scene(Still::tilted(tilt))
        .build()
}

/// Angles of the apex over that of the base at multiples of a twentieth of the time.
fn angles(balance: f64, tilt: f64, steps: u32) -> Result<Vec<f64>, Box<dyn Error>> {
    let mut shoot = shoot(balance * CONVERGENCE, tilt, ())?;
    let mut run = MethodOfSteps::with_solver(0.0125 * TIME, Unloaded);
    // The memories begin at the stimuli, since a step does not resolve their time.
    run.start(&mut shoot, &ConstantHistory::Steady)?;
    let mut angles = Vec::new();
    for k in 0..=steps {
        run.advance(&mut shoot, 0.05 * TIME * f64::from(k))?;
        let tangent = shoot.rod().apex_frame() * Vector3::z();
        angles.push(tangent.x.atan2(tangent.z) / tilt);
    }
    Ok(angles)
}

/// Balance number beyond which the apex passes the vertical, by bisection.
fn threshold(tilt: f64) -> Result<f64, Box<dyn Error>> {
    let (mut low, mut high) = (1.5, 6.0);
    while high - low > 1e-4 {
        let middle = 0.5 * (low + high);
        let angles = angles(middle, tilt, 80)?;
        // The parabola through the lowest angle and its neighbours gives the minimum.
        let at = (1..angles.len() - 1)
            .min_by(|i, j| angles[*i].total_cmp(&angles[*j]))
            .unwrap_or(1);
        let (slope, bend) = (
            0.5 * (angles[at + 1] - angles[at - 1]),
            angles[at + 1] - 2.0 * angles[at] + angles[at - 1],
        );
        let lowest = angles[at]
            - if bend > 0.0 {
                0.5 * slope * slope / bend
            } else {
                0.0
            };
        if lowest > 0.0 {
            low = middle
        } else {
            high = middle
        }
    }
    Ok(0.5 * (low + high))
}

/// Angle of the apex over that of the base in the linear theory, after the time T τg/η: 1 − Σ
/// (−1)^m B^(m+1)/(m+1)! P(m+1, T), with the regularised incomplete gamma function P.
fn linear_angle(balance: f64, time: f64) -> f64 {
    let (mut angle, mut power, mut sign) = (1.0, balance, 1.0);
    let (mut term, mut sum) = ((-time).exp(), (-time).exp());
    for m in 0..60 {
        angle -= sign * power * (1.0 - sum);
        sign = -sign;
        power *= balance / f64::from(m + 2);
        term *= time / f64::from(m + 1);
        sum += term;
    }
    angle
}

/// Compares the angle of the apex with the linear theory, and finds the balance number at which
/// overshoot begins.
pub fn overshoot() -> Result<Panel, Box<dyn Error>> {
    let (mut series, mut rows, mut worst) = (Vec::new(), Vec::new(), 0.0_f64);
    let tilt = 1e-3;
    for (colour, balance) in [1.0, 2.8, 6.0, 12.0].into_iter().enumerate() {
        let angles = angles(balance, tilt, 120)?;
        let points: Vec<(f64, f64)> = (0..).map(|k| 0.05 * f64::from(k)).zip(angles).collect();
        for (time, angle) in &points {
            worst = worst.max((angle - linear_angle(balance, *time)).abs());
            rows.push([*time, balance, *angle, linear_angle(balance, *time)]);
        }
        let line = (0..=300)
            .map(|i| 0.02 * f64::from(i))
            .map(|t| (t, linear_angle(balance, t)))
            .collect();
        series.push(closed(line, colour));
        series.push(found(points.into_iter().step_by(6).collect(), colour));
        let place = [(5.0, 0.42), (5.0, 0.12), (0.75, -0.2), (0.45, -0.3)][colour];
        series.push(Series::text(
            format!("B = {balance}"),
            place,
            Style::Beside,
            colour,
        ));
    }
    println!(
        "5. overshoot: begins at B = {:.4} for a small tilt, {:.4} at 90°",
        threshold(1e-3)?,
        threshold(FRAC_PI_2)?
    );
    println!("   largest difference from the linear theory {worst:.1e} of the tilt of the base");
    Ok(Panel {
        name: "5. Overshoot and balance number",
        labels: ["time × η/τg (1)", "angle of the apex / tilt (1)"],
        series,
        rows,
    })
}

/// Compares steady shapes of shoots with weight with the closed form.
pub fn steady() -> Result<Panel, Box<dyn Error>> {
    let (mut series, mut rows, mut worst) = (Vec::new(), Vec::new(), 0.0_f64);
    for (colour, degrees) in [30.0_f64, 90.0, 150.0, 175.0].into_iter().enumerate() {
        let mut shoot = shoot(
            4.0 * CONVERGENCE,
            degrees.to_radians(),
            Weight { density: 1000.0 },
        )?;
        solve_steady_state(&mut shoot)?;
        let closed_form = |x: f64| 2.0 * ((0.5 * degrees.to_radians()).tan() * (-x).exp()).atan();
        let mut points = Vec::new();
        for k in 0..=10 {
            let x = 0.4 * f64::from(k);
            let [angle, _] = direction(&shoot, x * CONVERGENCE);
            worst = worst.max((angle - closed_form(x)).abs());
            points.push((x, angle.to_degrees()));
            rows.push([x, degrees, angle.to_degrees(), closed_form(x).to_degrees()]);
        }
        let line = (0..=100)
            .map(|i| 0.04 * f64::from(i))
            .map(|x| (x, closed_form(x).to_degrees()))
            .collect();
        series.push(closed(line, colour));
        series.push(found(points, colour));
    }
    println!("6. steady tilt: largest difference from the closed form {worst:.1e} rad");
    Ok(Panel {
        name: "6. Steady shape of a tilted shoot",
        labels: ["arc length / Lc (1)", "angle from the vertical (°)"],
        series,
        rows,
    })
}
