//! A shoot that is laid on its side rights itself.
//!
//! A pot is tipped over: the shoot of 5 cm points sideways, and sags. Gravitropism bends it upwards wherever it is not
//! vertical; proprioception unbends it wherever it is curved. Length stays the same here and differential growth goes on
//! everywhere: the reduced model of Agostinelli, DeSimone and Noselli (2021), Front. Plant Sci. 12:608005.
//!
//! The two responses are in balance where η θ' = −(β/r) sin θ, with θ the angle from the vertical: where the curvature is
//! proportional to the tilt, *whatever the weight and the stiffness*, since it is the visible curvature that the shoot
//! senses. With k = β/(ηr) and a horizontal base that shape is, in closed form,
//!
//!   x(s) = (2/k) atan tanh(k s/2),  z(s) = ln cosh(k s)/k.
//!
//! # What to see
//! The shoot rises within an hour, overshoots, since it answers to what was some time ago, and comes to rest in the dashed
//! shape. 1/k is the distance from the base within which it turns; it does not depend on the length.
//!
//! # What to try
//! `--modulus 6e6` or `1e9`, a shoot that sags more or not at all: another beginning, the same end. `--delay 30`: answers
//! so late that the shoot never comes to rest. `--beta 1.6 --eta 40`: only the quotient of the two shapes the end.

mod common;

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::process::ExitCode;

use common::{Axes, Opt, Options, Progress, Series, Style, Table, lines_figure};
use morphorod::constitutive::LinearElastic;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::tropism::{Gravitropism, Memory, Proprioception, Response, SettledStatoliths};
use morphorod::{Shoot, Still};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
const LENGTH: f64 = 0.05;
const RADIUS: f64 = 0.5e-3;

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "righting",
        "a shoot that is laid on its side rights itself",
        &[
            Opt::value("hours", "H", "24", "time to simulate, h"),
            Opt::value("beta", "B", "0.8", "gravitropic sensitivity"),
            Opt::value("eta", "N", "20", "proprioceptive sensitivity"),
            Opt::value("delay", "MIN", "12", "memory and reaction time of both, min"),
            Opt::value("modulus", "PA", "1e7", "Young's modulus, Pa"),
            Opt::value("elements", "N", "8", "elements"),
            Opt::value("step", "S", "90", "time step, s"),
        ],
    );
    let end = HOUR * options.positive("hours");
    let (beta, eta) = (options.get("beta"), options.get_if("eta", "not 0", |eta| *eta != 0.0));
    let delay = MINUTE * options.get::<f64>("delay");
    let out = options.out_dir();

    let memory = Memory { time: delay, delay };
    let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: options.get("modulus"), poissons_ratio: 0.5 })
        .length(LENGTH)
        .radius(RADIUS)
        .elements(options.get("elements"))
        .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 20.0 * HOUR }))
        .tropism((
            Gravitropism { sensitivity: beta, perception: SettledStatoliths }.remembered(memory),
            Proprioception { sensitivity: eta }.remembered(memory),
        ))
        .load(Weight { density: 1000.0 })
        .scene(Still::tilted(FRAC_PI_2))
        .build()?;
    let mut integrator = MethodOfSteps::new(options.get("step"));

    // The tip at equal intervals, and the whole shape at a few times that lie closer together in the beginning.
    let pictures = [0, 10, 20, 30, 50, 80, 480];
    let mut table = Table::create(out.join("tip.csv"), &["t_s", "length_m", "x_m", "y_m", "z_m"])?;
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
        if pictures.contains(&row) {
            let line = shoot.rod().centre_line_at(26).into_iter();
            let style = if row == 480 { Style::Points } else { Style::Line };
            let points = line.map(|p| (1e3 * p.x, 1e3 * p.z)).collect();
            shapes.push(Series::new(format!("{} h", t / HOUR), points, style, shapes.len()));
        }
        progress.set(t / end);
    }
    progress.finish();
    table.finish()?;

    let k = beta / (eta * RADIUS);
    let closed = |s: f64| (2.0 / k * (k * s / 2.0).tanh().atan(), (k * s).cosh().ln() / k);
    let (x, z) = closed(LENGTH);
    let tip = shoot.tip();
    println!("after {} h the tip is at ({:.10}, {:.10}) m,", end / HOUR, tip.x, tip.z);
    println!("in the stationary shape at ({x:.10}, {z:.10}) m, {:.1e} m away", (tip.x - x).hypot(tip.z - z));

    let rest = |value: f64| vec![(0.0, 1e3 * value), (end / HOUR / 3.0, 1e3 * value)];
    let series = [
        Series::new("height z", height, Style::Line, 0),
        Series::new("distance x", across, Style::Line, 1),
        Series::new("stationary, closed form", rest(z), Style::Dashed, 6),
        Series::new("", rest(x), Style::Dashed, 6),
    ];
    let title = "The tip of a shoot that rights itself";
    lines_figure(out.join("tip.svg"), title, "time (h)", "position of the tip (mm)", &series, Axes::Linear)?;
    let line = (0..=100).map(|i| closed(LENGTH * f64::from(i) / 100.0));
    shapes.push(Series::new(
        "stationary, closed form",
        line.map(|(x, z)| (1e3 * x, 1e3 * z)).collect(),
        Style::Dashed,
        6,
    ));
    lines_figure(out.join("shapes.svg"), "A shoot that rights itself", "x (mm)", "z (mm)", &shapes, Axes::Equal)?;
    println!("tip.csv, tip.svg and shapes.svg are in {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    common::finish(run())
}
