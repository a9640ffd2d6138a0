//! Known experiments on gravitropism and circumnutation, each with its closed form or its published
//! result.
//!
//! The chapter `docs/experiments.md` lists them with the experiments of other examples.
//!
//! 1. *Entrainment.* A circumnutating shoot is tilted periodically. It follows the tilt if the
//!    periods are close to each other, and beats otherwise (H. Andersen and A. Johnsson 1972,
//!    Physiol. Plant. 26:44–51 and 52–61).
//! 2. *Clinostat.* A horizontal shoot rotates about its own tangent. Its shape is fixed in space
//!    (H. Oliveri and others 2024, Phys. Rev. E 110:014405) and has a closed form.
//! 3. *Centrifuge.* The period of circumnutation between 1 and 9 g (A. H. Brown and D. K. Chapman
//!    1977, Plant Physiol. 59:636–640).
//! 4. *Inclination.* The rate at which an inclined shoot bends is proportional to the sine of the
//!    inclination and does not depend on the magnitude of gravity (H. Chauvet and others 2016, Sci.
//!    Rep. 6:35431).
//! 5. *Overshoot.* The apex of a tilted shoot passes the vertical if the balance number B = βℓ/(ηr)
//!    exceeds 2.8 (R. Bastien and others 2013, PNAS 110:755–760). β and η are the gravitropic and
//!    the proprioceptive sensitivity (without unit), ℓ is the length and r the radius (m).
//! 6. *Steady tilt.* The angle θ from the vertical, θ0 at the base, decays with the arc length s
//!    (m) as tan(θ/2) = tan(θ0/2) exp(−s/Lc) with Lc = ηr/β (same source).
//!
//! # Results
//! Experiments 2, 5 and 6 agree with their closed forms. Experiment 4 agrees with the sine law to 1
//! % at 3 g, where the shoot sags; g is the gravitational acceleration on the ground. The period of
//! experiment 3 changes by 0.23 %. In experiment 1 larger tilts entrain the shoot in a wider range
//! of periods.

#[path = "experiments/centrifuge.rs"]
mod centrifuge;
#[path = "experiments/clinostat.rs"]
mod clinostat;
#[path = "experiments/entrainment.rs"]
mod entrainment;
#[path = "experiments/inclination.rs"]
mod inclination;
#[path = "experiments/tilt.rs"]
mod tilt;

use std::error::Error;
use std::process::ExitCode;

use morphorod::Shoot;
use morphorod::constitutive::LinearElastic;
use morphorod::tropism::{
    Gravitropism, Memory, Proprioception, Response, SettledStatoliths, TropismLaw,
};
use morphorod_plot::{Axes, Figure, Options, Series, Style, Table, println};
use nalgebra::Vector3;

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// Gravitational acceleration on the ground, m/s².
const GROUND: f64 = 9.81;
/// Radius r, m.
const RADIUS: f64 = 0.5e-3;
/// Gravitropic and proprioceptive sensitivity, β and η.
const BETA: f64 = 0.8;
const ETA: f64 = 20.0;
const TISSUE: LinearElastic = LinearElastic {
    youngs_modulus: 1e7,
    poissons_ratio: 0.5,
};

/// Result of an experiment.
struct Panel {
    /// Title of its panel.
    name: &'static str,
    labels: [&'static str; 2],
    series: Vec<Series>,
    /// Rows of the table: abscissa of the panel, parameter of the curve, result, and closed form or
    /// NaN.
    rows: Vec<[f64; 4]>,
}

/// Gravitropism and proprioception with one memory.
fn responses(memory: Memory) -> impl TropismLaw {
    (
        Gravitropism {
            sensitivity: BETA,
            perception: SettledStatoliths,
        }
        .remembered(memory),
        Proprioception { sensitivity: ETA }.remembered(memory),
    )
}

/// Tangent at a place (m), as the angle from the vertical and the azimuth, rad.
fn direction(shoot: &Shoot<impl morphorod::Model>, s: f64) -> [f64; 2] {
    let Some((_, frame)) = shoot.rod().at(s) else {
        return [f64::NAN; 2];
    };
    let tangent = frame * Vector3::z();
    [
        tangent.x.hypot(tangent.y).atan2(tangent.z),
        tangent.y.atan2(tangent.x),
    ]
}

/// Points of shoots, with the legend that all panels share.
fn found(points: Vec<(f64, f64)>, colour: usize) -> Series {
    Series::new(
        if colour == 0 { "shoots" } else { "" },
        points,
        Style::Points,
        colour,
    )
}

/// Line of a closed form, with the legend that all panels share.
fn closed(points: Vec<(f64, f64)>, colour: usize) -> Series {
    Series::new(
        if colour == 0 { "closed form" } else { "" },
        points,
        Style::Line,
        colour,
    )
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "experiments",
        "known experiments on gravitropism and circumnutation",
        &[],
    );
    let out = options.out_dir();
    let panels = [
        entrainment::run()?,
        clinostat::run()?,
        centrifuge::run()?,
        inclination::run()?,
        tilt::overshoot()?,
        tilt::steady()?,
    ];
    let mut table = Table::create(
        out.join("experiments.csv"),
        &["experiment", "x", "parameter", "y", "closed_form"],
    )?;
    for (number, panel) in (1..).zip(&panels) {
        for [x, parameter, y, closed] in &panel.rows {
            table.row(&[f64::from(number), *x, *parameter, *y, *closed])?;
        }
    }
    table.finish()?;
    let panels: Vec<_> = panels
        .iter()
        .map(|panel| (panel.name, panel.labels, &panel.series[..]))
        .collect();
    let figure = Figure::new(
        out.join("experiments.svg"),
        "Experiments on gravitropism and circumnutation",
    );
    figure
        .height(130.0)
        .separate_panels(&panels, Axes::Linear)?;
    println!(
        "wrote experiments.csv and experiments.svg to {}",
        out.display()
    );
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
