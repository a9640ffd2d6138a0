//! Error against run time: what accuracy costs, for a shape at rest and for a growing shoot.
//!
//! The shape is the horizontal base, whose tip is known to 16 digits; the growing shoot is video 2 of the paper over ten
//! hours, with a small imperfection, measured against a far finer run of its own. Times are the shortest of a few
//! repetitions on one thread. Read the figure from the right: the fastest setting for an error stands lowest.

mod common;

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::process::ExitCode;
use std::time::Instant;

use common::{Axes, Opt, Options, Series, Style, Table, lines_figure};
use morphorod::constitutive::{Lignifying, LinearElastic};
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Distributed, Weight};
use morphorod::rod::Rod;
use morphorod::tropism::{Gravitropism, Memory, Oscillator, Proprioception, Response, Statoliths};
use morphorod::{Order, Scene, Shoot, Still};
use nalgebra::Vector3;

const HOUR: f64 = 3600.0;
const YOUNG: LinearElastic = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "accuracy",
        "error against run time, at rest and in growth",
        &[Opt::value("hours", "H", "10", "simulated time of the growing shoot, h")],
    );
    let hours = options.get_if::<f64>("hours", "positive", |h| *h > 0.0);
    let out = options.out_dir();

    println!("horizontal base: error of the tip relative to the length, from straight");
    let mut table = Table::create(out.join("horizontal_base.csv"), &["order", "elements", "error", "time_s"])?;
    let mut series = Vec::new();
    for (colour, order) in Order::ALL.into_iter().enumerate() {
        let mut points = Vec::new();
        for elements in [1, 2, 4, 8, 16, 32, 64] {
            let (time, error) = horizontal_base(order, elements)?;
            println!("  order {}  {elements:>3} elements  {error:.1e}  {:>6.1} µs", order.exponent(), 1e6 * time);
            table.row(&[order.exponent() as f64, elements as f64, error, time])?;
            points.push((1e6 * time, error));
        }
        series.push(Series::new(format!("order {}", order.exponent()), points, Style::Marked, colour));
    }
    table.finish()?;
    let file = out.join("horizontal_base.svg");
    lines_figure(
        file,
        "Horizontal base",
        "run time (µs)",
        "error of the tip, relative to the length",
        &series,
        Axes::LogLog,
    )?;

    println!("growing shoot, {hours} h: error of the tip relative to the length");
    let exact = growing_shoot(hours, 16, 10.0)?.1;
    let mut table = Table::create(out.join("growing_shoot.csv"), &["elements", "step_s", "error", "time_s"])?;
    let mut series = Vec::new();
    for (colour, elements) in [3, 4, 8].into_iter().enumerate() {
        let mut points = Vec::new();
        for step in [360.0, 240.0, 180.0, 144.0, 90.0, 60.0, 45.0, 30.0] {
            let (time, tip, length) = growing_shoot(hours, elements, step)?;
            let error = (tip - exact).norm() / length;
            println!("  {elements:>2} elements  {step:>4} s  {error:.1e}  {:>6.1} ms", 1e3 * time);
            table.row(&[elements as f64, step, error, time])?;
            points.push((1e3 * time, error));
        }
        series.push(Series::new(format!("{elements} elements"), points, Style::Marked, colour));
    }
    table.finish()?;
    let file = out.join("growing_shoot.svg");
    lines_figure(
        file,
        "Growing shoot",
        "run time (ms)",
        "error of the tip, relative to the length",
        &series,
        Axes::LogLog,
    )?;
    println!("tables and figures in {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    common::finish(run())
}

/// Time (s) and error of the default rod, 6.59 cm long, laid on its side.
fn horizontal_base(order: Order, elements: usize) -> Result<(f64, f64), Box<dyn Error>> {
    let exact = Vector3::new(0.057_253_565_806_158_82, 0.0, -0.030_426_176_324_779_89);
    let scene = Still::tilted(FRAC_PI_2);
    let mut solver = NewtonSolver::with_tolerance(1e-13);
    let mut best = f64::INFINITY;
    let mut error = 0.0;
    for _ in 0..20 {
        let mut rod = Rod::uniform(0.0659, 5e-4, scene.base, elements, order)?;
        let clock = Instant::now();
        let _ = solver.solve(&mut rod, &YOUNG, &Weight { density: 1000.0 }, &scene.environment(0.0))?;
        best = best.min(clock.elapsed().as_secs_f64());
        error = (rod.tip() - exact).norm() / 0.0659;
    }
    Ok((best, error))
}

/// Time (s), tip (m) and length (m) of video 2 with a small imperfection.
fn growing_shoot(hours: f64, elements: usize, step: f64) -> Result<(f64, Vector3<f64>, f64), Box<dyn Error>> {
    let memory = Memory { time: 720.0, delay: 720.0 };
    let mut shoot = Shoot::builder(Lignifying { young: YOUNG, mature_modulus: 2e9, time: 144.0 * HOUR })
        .length(0.068)
        .radius(5e-4)
        .elements(elements)
        .growth(UniformGrowth { zone_length: 0.07, time: 40.0 * HOUR })
        .tropism((
            Oscillator::new(0.2, 1440.0),
            Gravitropism { sensitivity: 0.8, perception: Statoliths { avalanche_time: 120.0 } }.remembered(memory),
            Proprioception { sensitivity: 20.0 }.remembered(memory),
        ))
        .load((
            Weight { density: 1000.0 },
            Distributed(Vector3::new(0.0, -1e-6, 0.0)),
            ApicalForce(|_t: f64| Vector3::new(-1e-7, -1e-7, 0.0)),
        ))
        .build()?;
    let clock = Instant::now();
    MethodOfSteps::new(step).advance(&mut shoot, hours * HOUR)?;
    Ok((clock.elapsed().as_secs_f64(), shoot.tip(), shoot.rod().length()))
}
