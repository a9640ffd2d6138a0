//! Estimation of the parameters of a shoot from a tracked tip or from centre lines.
//!
//! The program fits a family of shoots to data. It prints every estimate with its standard error and a verdict: whether
//! these data, or any data of this kind, determine the parameter. Without options it simulates a horizontal shoot that
//! rises, adds noise to its centre lines, and estimates its parameters.
//!
//! # Results
//! All six parameters are identifiable. The sensitivities are known to 0.05 %, the memory and reaction times to 0.4 %.
//! If the growth time is free as well (`--free beta,eta,tau_m,tau_r,tau_g`), the program prints that β, η and τg are
//! known only in combination.
//!
//! For the tip of a circumnutating shoot the program also scans for an internal oscillator. With `--alpha 0.05` the
//! scan finds its period, 24 min, and the comparison prefers the fit with an oscillator.
//!
//! # Options to try
//! - `--case circumnutation`: the tip of a growing shoot from above.
//! - `--case circumnutation --hours 10 --alpha 0.05`: an internal oscillator, which the scan finds.
//! - `--noise 1`: noise of 1 mm.
//! - `--table`: standard errors of several experiments. The computation takes minutes.
//! - A table of your own, whose units and axes are required as for `tracked_tip`: `--file mine.csv --time t --columns
//!   x,y --seconds 1 --mm 1 --axes +x,+y --view above --length 68 --growth-hours 40 --zone 70 --free
//!   beta,eta,tau_m,tau_r,l_0`. The initial curvature, `bend_x` and `bend_y`, is among the free parameters of tips from
//!   above by default.

mod data;
mod design;
mod figures;
mod plants;

use std::error::Error;
use std::process::ExitCode;

use morphorod::Shoot;
use morphorod::fit::{Estimates, Fit, Loss, Verdict};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::tropism::Handedness;
use morphorod_plot::{Opt, Options, println, track_options};
use plants::{Draw, OSCILLATOR, PARAMETERS, Plant, Seen};

const HOUR: f64 = 3600.0;
const MINUTE: f64 = 60.0;
const M_PER_MM: f64 = 1e-3;

/// Probability of a false alarm below which the program reports an oscillator.
const ALARM: f64 = 0.01;

fn options() -> Options {
    let lines = "table of centre lines: rows of one time, from the base to the tip";
    let mut all = track_options::declarations("table of positions or angles of the tip", lines, "t");
    all.extend([
        Opt::value(
            "view",
            "NAME",
            "above",
            "above or side for two columns; x, y, z, or angle of the tip from the horizontal, for one",
        ),
        Opt::value("degrees", "DEG", "", "unit of angles, degrees: 1, or 57.29578 for rad"),
        Opt::flag("origin", "estimate the position of the base in the view"),
        Opt::value("length", "MM", "68", "length at the first time, mm"),
        Opt::value("radius", "MM", "0.5", "radius, mm"),
        Opt::value("zone", "MM", "70", "length of the growth zone, mm; 0 for a shoot of constant length"),
        Opt::value("growth-hours", "H", "40", "growth time, h"),
        Opt::value("tilt", "DEG", "0", "angle of the base from the vertical, degrees"),
        Opt::value("free", "NAMES", "", "parameters to estimate"),
        Opt::value("starts", "N", "1", "number of initial values"),
        Opt::flag("robust", "Huber's loss, for data with outliers"),
        Opt::value("step", "S", "150", "time step, s"),
        Opt::value("case", "NAME", "righting", "synthetic data: righting or circumnutation"),
        Opt::value("alpha", "A", "0", "sensitivity of the internal oscillator of synthetic data"),
        Opt::value("noise", "MM", "0.1", "noise of synthetic data, mm"),
        Opt::value("hours", "H", "6", "duration of synthetic data, h"),
        Opt::flag("table", "only print standard errors of several experiments"),
    ]);
    Options::parse("fit", "estimation of the parameters of a shoot from a tracked tip or centre lines", &all)
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = options();
    if options.flag("table") {
        return design::print(M_PER_MM * options.positive("noise"));
    }
    let own = options.flag("file") || options.flag("centre-lines");
    let righting = !own && options.text("case") == "righting";
    if !own && !["righting", "circumnutation"].contains(&options.text("case")) {
        return Err(format!("there is no case '{}': give righting or circumnutation", options.text("case")).into());
    }
    let zone = options.get_if("zone", "0 or larger", |zone: &f64| *zone >= 0.0);
    let mut plant = Plant {
        constant: righting || own && zone == 0.0,
        tilt: if righting { 90.0_f64 } else { options.get("tilt") }.to_radians(),
        push: if own || righting { 0.0 } else { 1e-5 },
        radius: M_PER_MM * options.positive("radius"),
        mature_modulus: None,
        proprioceptive: None,
        handedness: Handedness::Counterclockwise,
    };
    let length = if righting { 50.0 } else { options.positive("length") };
    let growth_time = if righting { 20.0 } else { options.positive("growth-hours") };
    let values: Vec<f64> = PARAMETERS
        .iter()
        .map(|(name, value, _)| match *name {
            "l_0" => M_PER_MM * length,
            "l_g" if zone > 0.0 => M_PER_MM * zone,
            "tau_g" => HOUR * growth_time,
            "alpha" => options.get("alpha"),
            _ => *value,
        })
        .collect();
    let free: Vec<&str> = match options.text("free") {
        "" if righting => vec!["beta", "eta", "tau_m", "tau_r", "E", "l_0"],
        // An exactly straight and upright shoot stays straight, and its parameters have no effect.
        "" if own && options.text("view") == "above" => {
            vec!["beta", "eta", "tau_m", "tau_r", "l_0", "bend_x", "bend_y"]
        }
        "" => vec!["beta", "eta", "tau_m", "tau_r", "l_0"],
        text => text.split(',').map(str::trim).collect(),
    };
    if let Some(name) = free.iter().find(|name| PARAMETERS.iter().all(|(other, ..)| other != *name)) {
        let names: Vec<&str> = PARAMETERS.iter().map(|(name, ..)| *name).collect();
        return Err(format!("there is no parameter '{name}'; the parameters are {}", names.join(", ")).into());
    }
    let step = options.positive("step");
    let noise = M_PER_MM * options.positive("noise");
    let seen = if righting { Seen::Lines } else { Seen::Above };
    let (series, points, cameras) = if own {
        data::read(&options)?
    } else {
        let setting = [options.positive("hours"), 300.0, step.min(100.0)];
        data::synthetic(plant, &values, setting, seen, noise, &mut Draw::new(1))?
    };
    let out = options.out_dir();

    // For synthetic data, the initial values differ from the true ones. The first family has no oscillator unless its
    // sensitivity is free.
    let factor = if own { 1.0 } else { 1.3 };
    let mut start = values.clone();
    if !free.contains(&"alpha") {
        start[OSCILLATOR.start] = 0.0;
    }
    let family = plant.family(&start, &free, factor, cameras);
    let loss = if options.flag("robust") { Loss::ROBUST } else { Loss::Squares };
    let fit = Fit { step, loss, starts: options.get("starts"), ..Fit::default() };
    let series = [series];
    let mut found = fit.run(&family, &series)?;
    println!("{found}");
    report(&found, &free);

    if !righting && !free.contains(&"alpha") {
        let build = |p: &[f64], oscillator| plant.build(p, oscillator);
        let shortest = 1080.0_f64.max(2.0 * points.interval);
        let scan = fit.scan_oscillator(build, &found, [shortest, 2.0 * shortest])?;
        let best = scan.best.oscillator;
        println!("oscillator: score {:.1}, probability without one {:.1e}", scan.best.score, scan.false_alarm);
        if scan.false_alarm < ALARM {
            let (minutes, sense) = (best.period / MINUTE, best.handedness);
            println!("  period {minutes:.1} min, {sense:?}, sensitivity {:.3}", best.sensitivity);
            // The other initial values are those of the first fit, whose estimates may be far from the truth.
            let mut start = start.clone();
            start[OSCILLATOR].copy_from_slice(&[best.sensitivity, best.period, best.phase]);
            let names: Vec<&str> = free.iter().copied().chain(["alpha", "tau_e", "phase"]).collect();
            let more = family.parameters[PARAMETERS.len()..].to_vec();
            plant.handedness = best.handedness;
            let with = fit.run(&plant.family(&start, &names, 1.0, more), &series)?;
            println!("{with}\nBIC without an oscillator minus BIC with it: {:.1}", with.compare(&found)?);
            found = with;
        }
    }

    let mut shoot = plant.build(&found.values(), plant.oscillator(&found.values()))?;
    let mut integrator = MethodOfSteps::new(step);
    let last = points.times.last().copied().unwrap_or(0.0);
    let mut paths = Vec::new();
    if points.lines {
        let line = |shoot: &Shoot<_>| {
            let line = shoot.rod().centre_line_at(40);
            paths.push((shoot.time() / HOUR, line.iter().map(|p| points.image(p, &found)).collect()));
        };
        let shown = points.times.iter().enumerate().filter(|(index, _)| points.has_line(*index));
        integrator.advance_showing(&mut shoot, last, shown.map(|(_, time)| *time), line)?;
    } else {
        let minutes = (0..=(last / MINUTE) as u32).map(|minute| MINUTE * f64::from(minute));
        let mut path = Vec::new();
        integrator.advance_showing(&mut shoot, last, minutes, |shoot| path.push(points.tip(shoot, &found)))?;
        paths.push((0.0, path));
    }
    figures::draw(&out, &points, &paths, &found)?;
    println!("wrote residuals.csv, fit.svg, residuals.svg and ellipses.svg to {}", out.display());
    Ok(())
}

/// Prints warnings about the data and the fit.
fn report(found: &Estimates, free: &[&str]) {
    for (frames, what) in [
        (&found.repeated_frames, "are equal to the frame before them"),
        (&found.ambiguous_frames, "are at a discontinuity of the laws"),
    ] {
        let frames: Vec<usize> = frames.iter().flatten().copied().collect();
        if !frames.is_empty() {
            println!("frames {frames:?} {what}");
        }
    }
    let has_no_effect = |name: &&str| found.get(name).is_some_and(|one| one.verdict == Verdict::StructurallyNot);
    if free.iter().all(has_no_effect) {
        println!("the fitted shoot does not move: give --tilt, or an initial curvature by --free bend_x,bend_y,…");
    }
    if found.lag_one > 0.3 {
        println!(
            "successive residuals are correlated (the noise is not white, or the model is wrong): errors are larger"
        );
    }
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
