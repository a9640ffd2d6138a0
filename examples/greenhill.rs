//! Self-buckling of an upright shoot: Greenhill's critical length, and buckled shapes.
//!
//! This example solves for equilibria of an elastic rod under its own weight, without growth. The
//! straight upright rod is always an equilibrium. It is stable if the second derivative of the
//! energy has no negative eigenvalue. The solver counts the negative eigenvalues, and bisection
//! yields the critical length. It is compared with the result of A. G. Greenhill (1881, Proc. Camb.
//! Phil. Soc. 4:65):
//!
//!   ℓc = (α0 E I/q)^(1/3),  α0 = (9/4) j²,  j the first zero of the Bessel function of order −1/3,
//!
//! where E I is the bending stiffness and q is the weight per unit length.
//!
//! # Results
//! The computed critical length agrees with Greenhill's to 3e-10 of its value. A
//! shoot that is longer by 1 % bends considerably, and a shoot that is longer by half hangs below
//! its base.
//!
//! # Options
//! `--radius 1` and `--modulus 1e9`: a thicker and a stiffer shoot. The critical length is
//! proportional to (E r²)^(1/3).

use std::error::Error;
use std::process::ExitCode;

use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::load::Weight;
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};
use morphorod_plot::{Axes, Figure, Opt, Options, Series, Style, Table, println};

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "greenhill",
        "critical length of an upright shoot under its own weight",
        &[
            Opt::value("radius", "MM", "0.5", "radius of the shoot, mm"),
            Opt::value("modulus", "PA", "1e7", "Young's modulus, Pa"),
        ],
    );
    let radius = 1e-3 * options.positive("radius");
    let youngs_modulus = options.positive("modulus");
    let out = options.out_dir();

    let tissue = LinearElastic {
        youngs_modulus,
        poissons_ratio: 0.5,
    };
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
        let unstable = solver
            .inertia(&straight(middle)?, &tissue, &weight, &now)?
            .negative
            > 0;
        if unstable {
            buckled = middle
        } else {
            stable = middle
        }
    }
    println!("critical length:     {:.10} cm", 100.0 * stable);
    println!(
        "Greenhill's result:  {:.10} cm, relative difference {:.1e}",
        100.0 * exact,
        stable / exact - 1.0
    );

    let mut table = Table::create(
        out.join("shapes.csv"),
        &["length_m", "s_m", "x_m", "y_m", "z_m"],
    )?;
    let mut series = Vec::new();
    let ratios = [1.0, 1.001, 1.01, 1.05, 1.2, 1.5];
    for (index, ratio) in ratios.into_iter().enumerate() {
        let mut rod = straight(ratio * stable)?;
        let found = solver.solve(&mut rod, &tissue, &weight, &now)?;
        println!(
            "{ratio:5} × critical length: distance of the tip from the vertical {:.6} cm, {} negative eigenvalues",
            100.0 * rod.tip().xy().norm(),
            found.inertia.negative
        );
        let mut line = Vec::new();
        for (i, p) in rod.centre_line_at(101).into_iter().enumerate() {
            let s = rod.length() * i as f64 / 100.0;
            table.row(&[rod.length(), s, p.x, p.y, p.z])?;
            line.push((100.0 * p.x, 100.0 * p.z));
        }
        let label = format!("{ratio} × critical length");
        series.push(Series::new(label, line, Style::Line, 0).ordered(index, ratios.len()));
    }
    table.finish()?;
    Figure::new(
        out.join("shapes.svg"),
        "Buckled shapes of a shoot longer than its critical length",
    )
    .lines("x (cm)", "z (cm)", &series, Axes::Equal)?;
    println!("wrote shapes.csv and shapes.svg to {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
