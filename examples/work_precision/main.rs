//! Error against run time of equilibria and of simulations in time.
//!
//! The example computes eight scenes, from a horizontal rod in equilibrium to ten hours of growth
//! and a snap-through. Each scene is computed at many fixed resolutions, with all orders of
//! elements and with all integrators that can compute it, and to several tolerances. Errors are
//! differences from closed forms or from much finer runs: the largest distance of the centre line
//! at the end. A tolerance is a limit for the estimate of this distance at all times. Nodes of
//! elements, the tip among them, are more accurate than places inside elements. A run time is the
//! shortest of eight, or of fewer if a run takes long.
//!
//! # Results
//! There is one figure for each scene, with logarithmic axes. A method is better if its curve is
//! further to the left and lower. As long as the varied setting determines the error, the slope of
//! a curve is minus the order of convergence divided by the exponent of the cost. In the median,
//! runs by tolerance take twice as long as the best fixed resolution with the same error at the
//! end. That resolution is not known in advance.
//!
//! # Options
//! - `--scene growing` computes one scene only.
//! - `--write docs/accuracy.md` writes a summary into that chapter.

mod measure;
mod report;
mod scenes;

use std::error::Error;
use std::process::ExitCode;

use morphorod_plot::{Opt, Options, Progress, println};
use report::Scene;

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "work_precision",
        "error against run time of eight scenes",
        &[
            Opt::value(
                "scene",
                "NAME",
                "",
                "compute only scenes whose names begin with NAME",
            ),
            Opt::value(
                "write",
                "FILE",
                "",
                "chapter into which the summary is written, between two marks",
            ),
            Opt::flag(
                "quick",
                "few settings, each run once: a test of the program, not a measurement",
            ),
        ],
    );
    let out = options.out_dir();
    let quick = options.flag("quick");
    let progress = Progress::new("error against run time");
    let mut scenes: Vec<Scene> = Vec::new();
    let chosen: Vec<_> = scenes::ALL
        .iter()
        .filter(|(name, _)| name.starts_with(options.text("scene")))
        .collect();
    if chosen.is_empty() {
        return Err(format!(
            "no scene has a name that begins with {:?}",
            options.text("scene")
        )
        .into());
    }
    for (i, (_, measure)) in chosen.iter().enumerate() {
        let scene = measure(quick)?;
        progress.suspend(|| scene.print());
        scene.draw(&out)?;
        scenes.push(scene);
        progress.set((i + 1) as f64 / chosen.len() as f64);
    }
    progress.finish();
    report::write_table(&scenes, &out.join("work_precision.csv"))?;
    report::print_ratios(&scenes);
    if !options.text("write").is_empty() {
        report::write_chapter(&scenes, options.text("write").as_ref())?;
    }
    println!(
        "wrote work_precision.csv and one figure for each scene to {}",
        out.display()
    );
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
