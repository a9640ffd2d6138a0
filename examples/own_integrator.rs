//! Two integrators that are written outside the library from the parts of a time step, with their
//! observed order.
//!
//! `TimeStepper` divides elements, moves the tissue and keeps the history of the laws. The
//! integrators determine the intrinsic strain, the shape and the variables of the laws. The chapter
//! `docs/own-methods.md` explains the parts.
//!
//! 1. **Heun's method** (`own_integrator/heun.rs`), of second order, with one equilibrium per step.
//!    The shoot grows and rights itself, and tissue leaves its growth zone.
//! 2. **Kinematics** (`own_integrator/kinematic.rs`). A shoot without weight has the intrinsic
//!    strain, and no equilibrium is solved. While it is shorter than its growth zone, an oscillator
//!    bends it to an arc that is known in closed form.
//!
//! # Options
//! `--hours 8`: a longer run of the first shoot.

#[path = "own_integrator/heun.rs"]
mod heun;
#[path = "own_integrator/kinematic.rs"]
mod kinematic;

use std::error::Error;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::process::ExitCode;

use heun::Heun;
use kinematic::Kinematic;
use morphorod::equilibrium::NewtonSolver;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::{Model, Order, Shoot, ShootParameters, Still};
use morphorod_plot::{Axes, Figure, Opt, Options, Series, Style, Table, println};
use nalgebra::{UnitQuaternion, Vector3};

const HOUR: f64 = 3600.0;
/// Growth time of both shoots, s.
const GROWTH_TIME: f64 = 20.0 * HOUR;
/// Steps, s.
const STEPS: [f64; 5] = [480.0, 240.0, 120.0, 60.0, 30.0];

/// A growing shoot with a horizontal base, whose tissue leaves the growth zone.
fn righting() -> Result<Shoot<impl Model>, morphorod::ParameterError> {
    let parameters = ShootParameters {
        length: 0.05,
        zone_length: 0.04,
        growth_time: GROWTH_TIME,
        avalanche_time: 1200.0,
        ..ShootParameters::default()
    };
    Shoot::builder(parameters.young())
        .length(parameters.length)
        .radius(parameters.radius)
        .elements(4)
        .growth(parameters.growth())
        .tropism(parameters.steering(parameters.statoliths()))
        .load(parameters.weight())
        .scene(Still::tilted(FRAC_PI_2))
        .build()
}

/// The angle (rad) between the apical frame of a weightless shoot with an oscillator, and the
/// closed form, after `time` seconds. While the whole shoot grows, u1* = A sin ωt and u2* = A (1 −
/// cos ωt) with A = α/(r τg ω).
fn kinematic_error(step: f64, time: f64) -> Result<f64, Box<dyn Error>> {
    let parameters = ShootParameters {
        length: 0.03,
        growth_time: GROWTH_TIME,
        ..ShootParameters::default()
    };
    let law = parameters.oscillator();
    let mut shoot = Shoot::builder(parameters.young())
        .length(parameters.length)
        .radius(parameters.radius)
        .elements(8)
        .order(Order::Two)
        .growth(parameters.growth())
        .tropism(law)
        .scene(Still::weightless())
        .build()?;
    Kinematic::new(step).advance(&mut shoot, time)?;
    let rate = TAU / law.period;
    let (sin, cos) = (rate * time).sin_cos();
    let strain = Vector3::new(sin, 1.0 - cos, 0.0)
        * (law.sensitivity / (parameters.radius * GROWTH_TIME * rate));
    let exact =
        UnitQuaternion::from_scaled_axis(strain * (parameters.length * (time / GROWTH_TIME).exp()));
    Ok(shoot.rod().apex_frame().angle_to(&exact))
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "own_integrator",
        "integrators written outside the library: Heun's method and kinematics",
        &[Opt::value(
            "hours",
            "H",
            "4",
            "time to simulate with Heun's method, h",
        )],
    );
    let end = HOUR * options.positive("hours");
    let out = options.out_dir();

    let mut exact = righting()?;
    MethodOfSteps::new(15.0).advance(&mut exact, end)?;
    let mut table = Table::create(
        out.join("errors.csv"),
        &["step_s", "heun_m", "kinematic_rad"],
    )?;
    let (mut heun, mut kinematic) = (Vec::new(), Vec::new());
    // The closed form is compared after 5/8 of the period of the oscillator.
    println!("step (s)   Heun: error of the tip (m)   kinematics: error of the apical frame (rad)");
    for step in STEPS {
        let mut shoot = righting()?;
        Heun::new(step, NewtonSolver::with_tolerance(1e-10)).advance(&mut shoot, end)?;
        let errors = [
            (shoot.tip() - exact.tip()).norm(),
            kinematic_error(step, 900.0)?,
        ];
        println!("{step:8}   {:26.2e}   {:43.2e}", errors[0], errors[1]);
        table.row(&[step, errors[0], errors[1]])?;
        heun.push((step, errors[0] / 1e-3));
        kinematic.push((step, errors[1]));
    }
    table.finish()?;
    for (name, errors) in [("Heun's method", &heun), ("kinematics", &kinematic)] {
        let halvings = (errors.len() - 1) as f64;
        println!(
            "observed order of {name}: {:.2}",
            (errors[0].1 / errors[errors.len() - 1].1).log2() / halvings
        );
    }
    let last = heun[heun.len() - 1].1;
    let second = STEPS
        .map(|step| (step, last * (step / STEPS[STEPS.len() - 1]).powi(2)))
        .to_vec();
    let series = [
        Series::new("Heun: error of the tip (mm)", heun, Style::Marked, 0),
        Series::new(
            "kinematics: apical frame (rad)",
            kinematic,
            Style::Marked,
            1,
        ),
        Series::new("second order", second, Style::Dashed, 5),
    ];
    let title = "Integrators written outside the library";
    Figure::new(out.join("order.svg"), title).lines(
        "step (s)",
        "error (mm, rad)",
        &series,
        Axes::LogLog,
    )?;
    println!("wrote errors.csv and order.svg to {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
