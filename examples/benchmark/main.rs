//! Static experiments of the public benchmark of rod programs `cosseratbench`, with this crate.
//!
//! The benchmark (github.com/jakeryderv/cosseratbench, results 0.2) describes physical experiments
//! and measures programs against closed forms. This example solves its experiments in equilibrium,
//! and shows error and run time beside the published ones of PyElastica 1.0.0 and MuJoCo 3.13.0.
//!
//! 1. **Cantilever:** a clamped beam with a small force at its tip. The reference is the deflection
//!    of the linear beam, F ℓ³/(3 E I).
//! 2. **Catenary:** a cable that is pinned at both ends, under its weight. The reference is the
//!    elastic catenary without bending stiffness.
//! 3. **Twist:** a straight rod under tension with both ends clamped, of which one slides along the
//!    axis. The measured quantity is the twist at which it buckles. The reference is Greenhill's
//!    problem in closed form.
//!
//! # Results
//! The figure has one panel for each experiment. A program is better if its points are further to
//! the left and lower. References 1 and 2 are approximations themselves: the difference from them
//! is 4.1e-4 and 4.7e-4 at any resolution. The dashed line is the error of the discretisation
//! alone, which is the difference from a fine mesh.
//!
//! Run times are not comparable in detail. The published ones were measured on another machine, and
//! the other programs integrate a damped motion in time until it ends, where this crate solves for
//! the equilibrium.

#[path = "../work_precision/measure.rs"]
mod measure;

mod cantilever;
mod catenary;
mod published;
mod report;
mod twist;

use std::error::Error;
use std::process::ExitCode;

use morphorod_plot::{Opt, Options, println};
use report::Row;

/// Result of an experiment: one row for each mesh and case.
type Measured = Result<Vec<Row>, Box<dyn Error>>;

/// An experiment of the benchmark.
pub struct Experiment {
    /// Name in the benchmark.
    pub name: &'static str,
    /// Title of its panel: the compared quantity.
    pub title: &'static str,
    /// Solves the experiment on several meshes; on one mesh, and only once, if the argument is
    /// true.
    pub measure: fn(bool) -> Measured,
}

/// All experiments, in the order of the panels.
const EXPERIMENTS: [Experiment; 3] = [
    Experiment {
        name: "cantilever",
        title: "cantilever: deflection of the tip",
        measure: cantilever::measured,
    },
    Experiment {
        name: "catenary",
        title: "catenary: distance / length",
        measure: catenary::measured,
    },
    Experiment {
        name: "twist",
        title: "twist at tensions 1, 10, 30",
        measure: twist::measured,
    },
];

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "benchmark",
        "static experiments of the benchmark cosseratbench, beside published results",
        &[Opt::flag(
            "quick",
            "one mesh, solved once: a test of the program, not a measurement",
        )],
    );
    let (out, quick) = (options.out_dir(), options.flag("quick"));
    let mut rows = Vec::new();
    for experiment in &EXPERIMENTS {
        let mut found = (experiment.measure)(quick)?;
        found.extend(published::rows(experiment.name));
        report::print(experiment, &found);
        rows.append(&mut found);
    }
    report::write_table(&rows, &out.join("benchmark.csv"))?;
    report::draw(&rows, &out.join("benchmark.svg"))?;
    println!("wrote benchmark.csv and benchmark.svg to {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
