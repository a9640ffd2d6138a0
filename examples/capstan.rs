//! A rod wound on a drum that rotates below it: the growth of its tension by friction.
//!
//! The base of the rod is a ball joint. The force on its apex turns, which winds the rod on the
//! drum. The surface of the drum moves towards the apex throughout, so that all of the contact
//! slides and pulls at the base.
//!
//! The program compares the ratio of the tensions with the closed form of an elastic rod
//! (`capstan/drum.rs`), and with exp(μ Φ) of a thread without bending stiffness.
//!
//! ```text
//! cargo run --release --example capstan
//! ```
//!
//! A smaller tension (`--tension 2 --elements 48`) shows longer tails and a larger difference from
//! a thread. Several turns need more elements: `--turns 1.5 --friction 0.5 --tension 25 --elements
//! 96`.

#[path = "capstan/drum.rs"]
mod drum;

use std::error::Error;
use std::f64::consts::TAU;
use std::process::ExitCode;

use drum::{CIRCLE, Drum, TURN, closed_form};
use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::NewtonSolver;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::ApicalForce;
use morphorod::support::{Contact, Cylinder, Joint};
use morphorod::{Shoot, Still};
use morphorod_plot::{Axes, Figure, Opt, Options, Progress, Series, Style, Table, println};
use nalgebra::Vector3;

/// Radius of the rod, m.
const RADIUS: f64 = 0.5e-3;
/// Length of a tail, relative to its decay length √(B/F).
const TAIL: f64 = 15.0;
/// Width and height of the figure of the shapes, mm. The straight rod is longer than the tails are
/// wide.
const SHAPES: [f64; 2] = [150.0, 190.0];

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "capstan",
        "a rod wound on a rotating drum with friction",
        &[
            Opt::value("turns", "N", "1", "angle between the tails in turns"),
            Opt::value("friction", "MU", "0.3", "coefficient of friction"),
            Opt::value(
                "tension",
                "F",
                "100",
                "tension of the slack tail over B/Rc²",
            ),
            Opt::value("elements", "N", "40", "number of elements"),
            Opt::value("steps", "N", "30", "number of steps for each turn"),
        ],
    );
    let [turns, friction, tension] =
        ["turns", "friction", "tension"].map(|name| options.positive(name));
    let [elements, per_turn] =
        ["elements", "steps"].map(|name| options.positive(name).round() as usize);
    let out = options.out_dir();

    let tissue = LinearElastic {
        youngs_modulus: 1e7,
        poissons_ratio: 0.5,
    };
    let unit = tissue.stiffness(RADIUS).x / (CIRCLE * CIRCLE);
    let tail = TAIL * CIRCLE / tension.sqrt();
    let steps = (turns * per_turn as f64).ceil() as usize;
    let angle = move |t: f64| TAU * turns * t.min(1.0);
    let pull = move |t: f64| Vector3::new(angle(t).sin(), 0.0, angle(t).cos()) * (tension * unit);
    // The drum touches the rod when the force begins to turn.
    let centre = Vector3::new(1.001 * CIRCLE, 0.0, tail);
    let cylinder = Cylinder {
        through: centre,
        along: Vector3::y(),
        radius: CIRCLE - RADIUS,
    };
    let drum = Drum {
        cylinder,
        rate: TURN * steps as f64,
    };
    let mut shoot = Shoot::builder(tissue)
        .length(2.0 * tail + TAU * turns * CIRCLE)
        .radius(RADIUS)
        .elements(elements)
        .load(ApicalForce(pull))
        .scene(Still::weightless())
        .support((
            Joint::Ball,
            Contact {
                obstacle: drum,
                radius: RADIUS,
                friction,
            },
        ))
        .build()?;
    // With friction that slides the inertia does not decide stability.
    let solver = NewtonSolver {
        stable_only: false,
        ..NewtonSolver::with_tolerance(1e-10)
    };
    let mut integrator = MethodOfSteps {
        retries: 20,
        ..MethodOfSteps::with_solver(1.0 / steps as f64, solver)
    };

    let columns = [
        "angle_rad",
        "ratio",
        "closed_form",
        "thread",
        "relative_error",
    ];
    let mut table = Table::create(out.join("capstan.csv"), &columns)?;
    let [
        mut found,
        mut exact,
        mut thread,
        mut errors,
        mut differences,
    ] = [const { Vec::new() }; 5];
    let progress = Progress::new("winding");
    let (mut shapes, mut last) = (Vec::new(), (0.0, 1.0, 1.0));
    let shown: Vec<usize> = [0.0, 0.25, 0.5, 1.0]
        .iter()
        .map(|share| (share * steps as f64).round() as usize)
        .collect();
    for step in 0..=steps {
        let t = step as f64 / steps as f64;
        let _ = integrator.advance(&mut shoot, t)?;
        progress.set(t);
        let base = shoot.profile().at(0.0).ok_or("no base")?.force;
        let ratio = base.norm() / (tension * unit);
        // The angle from the force at the base to that at the apex, without whole turns.
        let between = angle(t) - base.x.atan2(base.z);
        let expected = closed_form(friction, between, tension, ratio);
        if shown.contains(&step) {
            let line = shoot
                .rod()
                .centre_line_at(401)
                .iter()
                .map(|p| (1e3 * p.x, 1e3 * p.z))
                .collect();
            let label = format!("{:.0}°", angle(t).to_degrees());
            shapes
                .push(Series::new(label, line, Style::Line, 0).ordered(shapes.len(), shown.len()));
        }
        // Before the contact is longer than a point, the closed form does not apply.
        if shoot
            .reactions()
            .iter()
            .filter(|at| at.obstacle.is_some())
            .count()
            < 3
        {
            continue;
        }
        let degrees = between.to_degrees();
        let elementary = (friction * between).exp();
        table.row(&[between, ratio, expected, elementary, ratio / expected - 1.0])?;
        found.push((degrees, ratio));
        exact.push((degrees, expected));
        thread.push((degrees, elementary));
        errors.push((degrees, (ratio / expected - 1.0).abs()));
        differences.push((degrees, (elementary / expected - 1.0).abs()));
        last = (between, ratio, expected);
    }
    progress.finish();
    table.finish()?;
    let (between, ratio, expected) = last;
    println!("angle between the asymptotes {:.6} turns", between / TAU);
    println!("ratio of the tensions        {ratio:.9}, closed form {expected:.9}");
    println!(
        "relative error               {:.1e}",
        ratio / expected - 1.0
    );
    println!(
        "thread without stiffness     {:.9}",
        (friction * between).exp()
    );

    let circle = |k: u32| {
        let at = TAU * f64::from(k) / 200.0;
        (
            1e3 * (centre.x + (CIRCLE - RADIUS) * at.cos()),
            1e3 * (centre.z + (CIRCLE - RADIUS) * at.sin()),
        )
    };
    shapes.push(Series::new(
        "drum",
        (0..=200).map(circle).collect(),
        Style::Line,
        6,
    ));
    let title = "A rod that is wound on a drum";
    Figure::new(out.join("shapes.svg"), title)
        .width(SHAPES[0])
        .height(SHAPES[1])
        .lines("place x (mm)", "height z (mm)", &shapes, Axes::Equal)?;
    let ratios = [
        Series::new("rod", found, Style::Marked, 0),
        Series::new("closed form", exact, Style::Line, 1),
        Series::new("thread, exp(μ Φ)", thread, Style::Dashed, 2),
    ];
    let (x, y) = (
        "angle Φ between the tails (°)",
        "ratio of the tensions F1/F0",
    );
    Figure::new(out.join("ratio.svg"), "Tension of a rod on a rotating drum").lines(
        x,
        y,
        &ratios,
        Axes::Linear,
    )?;
    let errors = [
        Series::new("rod", errors, Style::Marked, 0),
        Series::new("thread, exp(μ Φ)", differences, Style::Dashed, 2),
    ];
    let title = "Difference of the ratio of the tensions from the closed form";
    Figure::new(out.join("error.svg"), title).panels(
        x,
        "relative difference",
        &[("", &errors[..])],
        Axes::LogY,
    )?;
    println!(
        "wrote capstan.csv, shapes.svg, ratio.svg and error.svg to {}",
        out.display()
    );
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
