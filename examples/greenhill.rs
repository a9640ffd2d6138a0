//! How tall can a shoot stand? Greenhill's self-buckling length, and the shape just past it.
//!
//! The shortest useful program: no growth and no time, only an elastic rod under its own weight. A straight upright rod is
//! always in equilibrium. It is stable as long as the second derivative of its energy has no negative eigenvalue, and the
//! solver counts those for any rod that it is given. So the critical length is found by bisection, and can be compared
//! with the one that A. G. Greenhill (1881, Proc. Camb. Phil. Soc. 4:65) found by means of Bessel functions:
//!
//!   ℓc = (α0 E I/q)^(1/3),  α0 = (9/4) j²,  j the first zero of the Bessel function of order −1/3,
//!
//! with E I the bending stiffness and q the weight per unit length.
//!
//! # What to try
//! A thicker or a stiffer shoot: `--radius 1`, `--modulus 1e9`. How does the length grow with either?

mod common;

use std::error::Error;
use std::process::ExitCode;

use common::{Axes, Opt, Options, Series, Style, Table, lines_figure};
use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::load::Weight;
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "greenhill",
        "the length at which an upright shoot buckles under its own weight",
        &[
            Opt::value("radius", "MM", "0.5", "radius of the shoot, mm"),
            Opt::value("modulus", "PA", "1e7", "Young's modulus, Pa"),
        ],
    );
    let radius = 1e-3 * options.positive("radius");
    let youngs_modulus = options.positive("modulus");
    let out = options.out_dir();

    let tissue = LinearElastic { youngs_modulus, poissons_ratio: 0.5 };
    let weight = Weight { density: 1000.0 };
    let still = Still::upright();
    let now = still.environment(0.0);
    let straight = |length: f64| Rod::uniform(length, radius, still.base, 16, Order::Eight);
    let mut solver = NewtonSolver::default();

    let per_length = weight.density * still.gravity.norm() * std::f64::consts::PI * radius * radius;
    let exact = (Weight::GREENHILL * tissue.stiffness(radius).x / per_length).cbrt();
    let (mut stable, mut buckled) = (0.5 * exact, 2.0 * exact);
    while buckled - stable > 1e-13 * exact {
        let middle = 0.5 * (stable + buckled);
        let unstable = solver.inertia(&straight(middle)?, &tissue, &weight, &now)?.negative > 0;
        if unstable { buckled = middle } else { stable = middle }
    }
    println!("critical length    {:.10} cm", 100.0 * stable);
    println!("Greenhill's        {:.10} cm, relative difference {:.1e}", 100.0 * exact, stable / exact - 1.0);

    let mut table = Table::create(out.join("shapes.csv"), &["length_m", "s_m", "x_m", "y_m", "z_m"])?;
    let mut series = Vec::new();
    for (i, past) in [1.0, 1.001, 1.01, 1.05, 1.2, 1.5].into_iter().enumerate() {
        let mut rod = straight(past * stable)?;
        let found = solver.solve(&mut rod, &tissue, &weight, &now)?;
        println!(
            "at {past:5} of it: the tip is {:.6} cm off the vertical, {} negative eigenvalues",
            100.0 * rod.tip().xy().norm(),
            found.inertia.negative
        );
        let mut line = Vec::new();
        for (i, p) in rod.centre_line_at(101).into_iter().enumerate() {
            let s = rod.length() * i as f64 / 100.0;
            table.row(&[rod.length(), s, p.x, p.y, p.z])?;
            line.push((100.0 * p.x, 100.0 * p.z));
        }
        series.push(Series::new(format!("{past} × critical"), line, Style::Line, i));
    }
    table.finish()?;
    lines_figure(
        out.join("shapes.svg"),
        "An upright shoot past its critical length",
        "x (cm)",
        "z (cm)",
        &series,
        Axes::Equal,
    )?;
    println!("shapes.csv and shapes.svg are in {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    common::finish(run())
}
