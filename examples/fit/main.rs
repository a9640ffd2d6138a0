//! Estimation of the parameters of a shoot from a tracked tip or from centre lines.
//!
//! The program fits a family of shoots to data. It prints every estimate with its standard error
//! and a verdict: whether these data, or any data of this kind, determine the parameter. Without
//! options it simulates a horizontal shoot that rises, adds noise to its centre lines, and
//! estimates its parameters.
//!
//! # Results
//! All six parameters are identifiable. The sensitivities are known to 0.05 %, the memory and
//! reaction times to 0.4 %. If the growth time is free as well (`--free
//! beta,eta,tau_m,tau_r,tau_g`), the program prints that β, η and τg are known only in combination.
//!
//! The program compares the residuals with the scatter of neighbouring frames, and prints warnings
//! with their probable causes, and the relative change of every estimate per relative change of a
//! given value.
//!
//! For the tip of a circumnutating shoot the program also scans for an internal oscillator, among
//! all periods that the data resolve. With `--alpha 0.05` the scan finds its period, 24 min, and
//! the comparison prefers the fit with an oscillator.
//!
//! # Options to try
//! - `--film`: an animation of the fitted shoot with the data.
//! - `--case circumnutation`: the tip of a growing shoot from above.
//! - `--case circumnutation --hours 10 --alpha 0.05`: an internal oscillator, which the scan finds.
//! - `--noise 1`: noise of 1 mm.
//! - `--table`: standard errors of several experiments. The computation takes minutes.
//! - A table of your own, whose units and axes are required as for `tracked_tip`: `--file mine.csv
//!   --time t --columns x,y --seconds 1 --mm 1 --axes +x,+y --view above --length 68 --growth-hours
//!   40 --zone 70 --free beta,eta,tau_m,tau_r,l_0`. The initial curvature, `bend_x` and `bend_y`,
//!   is among the free parameters of tips from above by default.
//! - `--set E=8e6,push_x=2e-5,push_y=1e-5,tau_l=4e5`: given values, here of the modulus, of a push
//!   in the first 12 min and of the time of lignification, and initial values of free parameters.
//!   `--bounds tau_r=300:1500` limits them. `--start-time 0` sets the time of the table at which
//!   the shoot starts, and `--omit 2` omits the first two hours.
//! - Tables of trackers: `--time FRAME --columns POSITION_X,POSITION_Y --tracks TRACK_ID` for
//!   TrackMate, `--time frame --columns tip_x,tip_y` for a point `tip` of DeepLabCut, and `--time
//!   frame_idx --columns tip.x,tip.y` for SLEAP.

mod analysis;
mod data;
mod design;
mod figures;
mod film;
mod plants;
mod setting;

use std::error::Error;
use std::process::ExitCode;

use analysis::Analysis;
use data::{Points, Timed};
use morphorod::Shoot;
use morphorod::fit::Estimates;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod_plot::{Opt, Options, println, track_options};
use plants::{NAMES, Plant};
use setting::Setting;

const HOUR: f64 = 3600.0;
const MINUTE: f64 = 60.0;
const M_PER_MM: f64 = 1e-3;

fn options() -> Options {
    let lines = "table of centre lines: rows of one time, from the base to the tip";
    let mut all =
        track_options::declarations("table of positions or angles of the tip", lines, "t");
    all.extend([
        Opt::value(
            "view",
            "NAME",
            "above",
            "above or side for two columns; x, y, z, or angle of the tip from the horizontal, for one",
        ),
        Opt::value("degrees", "DEG", "", "unit of angles, degrees: 1, or 57.29578 for rad"),
        Opt::flag("origin", "estimate the position of the base in the view"),
        Opt::value("start-time", "T", "", "time at which the shoot starts, as in the table; by default the first time"),
        Opt::value("omit", "H", "0", "hours after the start whose frames are not fitted, such as a transient"),
        Opt::flag("omit-repeated", "omit frames that are equal to the frame before them"),
        Opt::value("known-noise", "MM", "", "standard deviation of a coordinate, mm or degrees; otherwise estimated"),
        Opt::value("length", "MM", "68", "length at the start, mm"),
        Opt::value("radius", "MM", "0.5", "radius, mm"),
        Opt::value("zone", "MM", "70", "length of the growth zone, mm; 0 for a shoot of constant length"),
        Opt::value("growth-hours", "H", "40", "growth time, h"),
        Opt::value("tilt", "DEG", "0", "angle of the base from the vertical, degrees"),
        Opt::value(
            "free",
            "NAMES",
            "",
            "parameters to estimate; by default beta,eta,tau_m,tau_r,l_0, and bends from above",
        ),
        Opt::value("set", "NAME=X,…", "", NAMES),
        Opt::value("bounds", "NAME=LOW:HIGH,…", "", "bounds of free parameters, in SI units"),
        Opt::value("starts", "N", "8", "number of initial guesses"),
        Opt::value("iterations", "N", "200", "largest number of iterations of the last search"),
        Opt::value("max-work", "N", "100000000", "largest work of a fit, in evaluations of the forces in an element"),
        Opt::value("periods", "MIN:MAX", "", "periods of the scan for an oscillator, min; by default those resolved"),
        Opt::flag("robust", "Huber's loss, for data with outliers"),
        Opt::value("step", "S", "150", "time step, s"),
        Opt::value("case", "NAME", "righting", "synthetic data: righting or circumnutation"),
        Opt::value("alpha", "A", "0", "sensitivity of the internal oscillator of synthetic data"),
        Opt::value("noise", "MM", "0.1", "noise of synthetic data, mm"),
        Opt::value("hours", "H", "6", "duration of synthetic data, h"),
        Opt::flag("film", "also write film.html, an animation of the fitted shoot with the data, for the browser"),
        Opt::flag("table", "only print standard errors of several experiments"),
    ]);
    Options::parse(
        "fit",
        "estimation of the parameters of a shoot from a tracked tip or centre lines",
        &all,
    )
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = options();
    if options.flag("table") {
        return design::print(M_PER_MM * options.positive("noise"));
    }
    let setting = Setting::new(&options)?;
    let (series, points, cameras) = setting.data(&options)?;
    let out = options.out_dir();
    let analysis = Analysis {
        fit: Setting::fit(&options),
        setting,
        series: [series],
        cameras,
    };
    let (plant, found) = analysis.run(&options)?;
    let paths = paths(plant, &found, &points, analysis.fit.step)?;
    figures::draw(&out, &points, &paths, &found)?;
    if options.flag("film") {
        let shoot = plant.build(&found.values(), plant.oscillator(&found.values()))?;
        film::write(
            &out.join("film.html"),
            shoot,
            (&analysis.series[0], &points),
            &found,
            analysis.fit.step,
        )?;
        println!("wrote film.html to {}, for a browser", out.display());
    }
    println!(
        "wrote residuals.csv, fit.svg, residuals.svg and ellipses.svg to {}",
        out.display()
    );
    Ok(())
}

/// Paths of the fitted shoot in the units of the axes. `step` is the time step, s.
fn paths(
    plant: Plant,
    found: &Estimates,
    points: &Points,
    step: f64,
) -> Result<Vec<Timed>, Box<dyn Error>> {
    let mut shoot = plant.build(&found.values(), plant.oscillator(&found.values()))?;
    let mut integrator = MethodOfSteps::new(step);
    let last = points.times.last().copied().unwrap_or(0.0);
    let mut paths = Vec::new();
    if points.lines {
        let line = |shoot: &Shoot<_>| {
            let line = shoot.rod().centre_line_at(40);
            paths.push((
                shoot.time() / HOUR,
                line.iter().map(|p| points.image(p, found)).collect(),
            ));
        };
        let shown = points
            .times
            .iter()
            .enumerate()
            .filter(|(index, _)| points.has_line(*index));
        integrator.advance_showing(&mut shoot, last, shown.map(|(_, time)| *time), line)?;
    } else {
        let minutes = (0..=(last / MINUTE) as u32).map(|minute| MINUTE * f64::from(minute));
        let mut path = Vec::new();
        integrator.advance_showing(&mut shoot, last, minutes, |shoot| {
            path.push(points.tip(shoot, found))
        })?;
        paths.push((0.0, path));
    }
    Ok(paths)
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
