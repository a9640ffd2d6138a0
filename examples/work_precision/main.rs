//! Error against run time: how long must one wait for so many digits?
//!
//! Eight scenes, from a horizontal rod at rest to ten hours of growth and a shoot that is led over. Each is computed at many fixed resolutions, of every
//! order and with every integrator that takes it, and by tolerance. Errors are true ones, against closed forms or far finer runs of
//! another resolution; a run time is the shortest of eight, of fewer where they are long.
//!
//! # What to see
//! One figure a scene, with logarithmic axes: lower and further left is better. The slope of a series is minus its order over the
//! power of its cost, until something else than what is varied limits the error. The runs that were given a tolerance should lie next to the best of the
//! others, though these had to be found by trying.
//!
//! # What to try
//! - `--scene growing`, one scene alone. `--write docs/accuracy.md` puts the tables into that chapter.

#[path = "../common/mod.rs"]
mod common;
mod measure;
mod report;
mod scenes;

use std::error::Error;
use std::process::ExitCode;

use common::{Opt, Options, Progress};
use report::Scene;

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "work_precision",
        "error against run time, scene by scene",
        &[
            Opt::value("scene", "NAME", "", "one scene alone: its first word"),
            Opt::value("write", "FILE", "", "a chapter into which the tables are put, between its two marks"),
            Opt::flag("quick", "a few settings, each run once: whether it works, not how fast"),
        ],
    );
    let out = options.out_dir();
    let quick = options.flag("quick");
    let progress = Progress::new("error against run time");
    let mut scenes: Vec<Scene> = Vec::new();
    let chosen: Vec<_> = scenes::ALL.iter().filter(|(name, _)| name.starts_with(options.text("scene"))).collect();
    if chosen.is_empty() {
        return Err(format!("no scene {:?}", options.text("scene")).into());
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
    println!("tables and figures in {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    common::finish(run())
}
