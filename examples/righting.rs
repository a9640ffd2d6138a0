//! Gravitropic righting of a shoot with a horizontal base.
//!
//! A shoot of 5 cm is placed horizontally and sags under its weight. Gravitropism bends it upwards
//! where it is not vertical, and proprioception reduces its curvature. The length is constant, and
//! differential growth occurs everywhere. This is the reduced model of Agostinelli, DeSimone and
//! Noselli (2021), Front. Plant Sci. 12:608005, with settled statoliths.
//!
//! The shoot is stationary if η θ' = −(β/r) sin θ, where θ is the angle from the vertical.
//! Proprioception depends on the visible curvature, so that this condition contains *neither the
//! weight nor the stiffness*. With k = β/(ηr) and a horizontal base, the stationary shape is
//!
//!   x(s) = (2/k) atan tanh(k s/2),  z(s) = ln cosh(k s)/k.
//!
//! # Results
//! The shoot rises within an hour, overshoots because of the delay, and converges to the stationary
//! shape. It is curved over a distance of about 1/k from the base, which does not depend on its
//! length.
//!
//! # Options
//! - `--modulus 6e6` or `--modulus 1e9`: other initial deflections, the same stationary shape.
//! - `--delay 30`: a delay for which the shoot does not become stationary.
//! - `--beta 1.6 --eta 40`: the stationary shape depends only on the ratio β/η.

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::process::ExitCode;

use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::tropism::Memory;
use morphorod::{ShootParameters, Still};
use morphorod_plot::{Axes, Figure, Opt, Options, Progress, Series, Style, Table, println};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
const LENGTH: f64 = 0.05;

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "righting",
        "gravitropic righting of a shoot with a horizontal base",
        &[
            Opt::value("hours", "H", "24", "time to simulate, h"),
            Opt::value("beta", "B", "0.8", "gravitropic sensitivity"),
            Opt::value("eta", "N", "20", "proprioceptive sensitivity"),
            Opt::value(
                "delay",
                "MIN",
                "12",
                "memory and reaction time of both responses, min",
            ),
            Opt::value("modulus", "PA", "1e7", "Young's modulus, Pa"),
            Opt::value("elements", "N", "8", "elements"),
            Opt::value("step", "S", "90", "time step, s"),
        ],
    );
    let end = HOUR * options.positive("hours");
    let (beta, eta) = (
        options.get("beta"),
        options.get_if("eta", "different from 0", |eta| *eta != 0.0),
    );
    let delay = MINUTE * options.get::<f64>("delay");
    let out = options.out_dir();

    let memory = Memory { time: delay, delay };
    let parameters = ShootParameters {
        length: LENGTH,
        youngs_modulus: options.get("modulus"),
        growth_time: 20.0 * HOUR,
        gravitropic_sensitivity: beta,
        gravitropic_memory: memory,
        proprioceptive_sensitivity: eta,
        proprioceptive_memory: memory,
        ..ShootParameters::default()
    };
    let mut shoot = parameters
        .reduced()
        .elements(options.get("elements"))
        .scene(Still::tilted(FRAC_PI_2))
        .build()?;
    let mut integrator = MethodOfSteps::new(options.get("step"));

    // The tip is recorded at equal intervals, and the centre line at a few times, most of them at
    // the beginning.
    let shown = [0, 10, 20, 30, 50, 80, 480];
    let mut table = Table::create(
        out.join("tip.csv"),
        &["t_s", "length_m", "x_m", "y_m", "z_m"],
    )?;
    let (mut across, mut height, mut shapes) = (Vec::new(), Vec::new(), Vec::new());
    let progress = Progress::new("righting");
    for row in 0..=480 {
        let t = end * f64::from(row) / 480.0;
        integrator.advance(&mut shoot, t)?;
        let tip = shoot.tip();
        table.row(&[t, shoot.rod().length(), tip.x, tip.y, tip.z])?;
        if row <= 160 {
            across.push((t / HOUR, 1e3 * tip.x));
            height.push((t / HOUR, 1e3 * tip.z));
        }
        if let Some(index) = shown.iter().position(|shown| *shown == row) {
            let line = shoot.rod().centre_line_at(26).into_iter();
            let style = if row == 480 {
                Style::Points
            } else {
                Style::Line
            };
            let points = line.map(|p| (1e3 * p.x, 1e3 * p.z)).collect();
            shapes.push(
                Series::new(format!("{} h", t / HOUR), points, style, 0)
                    .ordered(index, shown.len()),
            );
        }
        progress.set(t / end);
    }
    progress.finish();
    table.finish()?;

    let k = beta / (eta * parameters.radius);
    let closed = |s: f64| {
        (
            2.0 / k * (k * s / 2.0).tanh().atan(),
            (k * s).cosh().ln() / k,
        )
    };
    let (x, z) = closed(LENGTH);
    let tip = shoot.tip();
    println!(
        "tip after {} h:        x = {:.10} m, z = {:.10} m",
        end / HOUR,
        tip.x,
        tip.z
    );
    println!("stationary shape:       x = {x:.10} m, z = {z:.10} m");
    println!(
        "distance between them:  {:.1e} m",
        (tip.x - x).hypot(tip.z - z)
    );

    let stationary = |value: f64| vec![(0.0, 1e3 * value), (end / HOUR / 3.0, 1e3 * value)];
    let series = [
        Series::new("height z", height, Style::Line, 0),
        Series::new("horizontal distance x", across, Style::Dashed, 1),
        Series::new("stationary, closed form", stationary(z), Style::Dotted, 6),
        Series::new("", stationary(x), Style::Dotted, 6),
    ];
    let title = "Righting of a horizontal shoot: position of the tip";
    Figure::new(out.join("tip.svg"), title).lines(
        "time (h)",
        "position of the tip (mm)",
        &series,
        Axes::Linear,
    )?;
    let line = (0..=100).map(|i| closed(LENGTH * f64::from(i) / 100.0));
    shapes.push(Series::new(
        "stationary, closed form",
        line.map(|(x, z)| (1e3 * x, 1e3 * z)).collect(),
        Style::Dashed,
        6,
    ));
    Figure::new(
        out.join("shapes.svg"),
        "Righting of a horizontal shoot: centre lines",
    )
    .lines("x (mm)", "z (mm)", &shapes, Axes::Equal)?;
    println!("wrote tip.csv, tip.svg and shapes.svg to {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
