//! The main job: a shoot that grows, steers, stiffens, bends under its own weight and nutates.
//!
//! This is the second video of Agostinelli, DeSimone and Noselli (2021), *Nutations in Plant Shoots*, Front. Plant Sci.
//! 12:608005, and the picture of the tip's path is drawn like their figure 7A. A shoot of 6.8 cm grows in its last 7 cm. An
//! oscillator in its tissue bends it to all sides in turn, once in 24 min; gravity, as felt by statoliths, and its own
//! bending tell it to stand straight, but with a delay; tissue that has stopped growing turns to wood.
//!
//! # What to see
//! At first the tip draws small figures in the rhythm of the oscillator. As the shoot grows longer its answers come too
//! late: they overshoot, and a slow swing of an hour and a half builds up from the small one. It is wide and nearly
//! plane at first, then it rounds to a circle, which goes on rising on a base that has become stiff.
//!
//! Under the path stands how much of the motion is the oscillator's: its part of the squared amplitudes of all periods that are
//! found in four hours about each time. From nearly all it falls to next to nothing.
//!
//! # What to try
//! - `--alpha 0.01`, the third video: with a weak oscillator the slow swing alone is left. It comes from the delays, not
//!   from the oscillator, which only gives it the first push. Where even that is missing (`--alpha 0`) an exactly upright
//!   shoot stays upright, until `--imperfection` lays a breath of wind on it.
//! - `--tolerance 1e-5`: steps, elements and merging are chosen for an error of at most that part of the length.
//! - `--checkpoint FILE`, with `--features serde`: a run that is killed and started again goes on from the last whole hour, to the
//!   same bits.
//! - `--step 45 --elements 16 --out fine`, then a run with `--compare fine/tip.csv`: how accurate are the defaults?
//!
//! The laws are put together in [`growing_shoot`]; the rest is a loop over time that writes down the tip.

mod camera;
mod common;
#[path = "growing_shoot/oscillations.rs"]
mod oscillations;

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use common::{Film, Opt, Options, Progress, Strip, Table, VtkSeries, path_figure, shapes_figure, write_tube};
use morphorod::constitutive::{Lignifying, LinearElastic};
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Adaptive, ConstantHistory, Integrator, MethodOfSteps, Statistics};
use morphorod::load::{ApicalForce, Distributed, Weight};
use morphorod::tropism::{Gravitropism, Memory, Oscillator, Proprioception, Response, Statoliths};
use morphorod::{Model, ParameterError, Shoot};
use nalgebra::Vector3;

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
const DAY: f64 = 86400.0;
/// Period of the oscillator τe, s.
const OSCILLATOR: f64 = 24.0 * MINUTE;

/// The shoot, with every law of the model at work at once.
fn growing_shoot(alpha: f64, elements: usize, imperfect: bool) -> Result<Shoot<impl Model>, ParameterError> {
    let memory = Memory { time: 12.0 * MINUTE, delay: 12.0 * MINUTE };
    let young = LinearElastic { youngs_modulus: 10e6, poissons_ratio: 0.5 };
    let wind = Distributed(Vector3::new(0.0, -1e-6, 0.0));
    let pull = ApicalForce(|_t: f64| Vector3::new(-1e-7, -1e-7, 0.0));
    Shoot::builder(Lignifying { young, mature_modulus: 200.0 * young.youngs_modulus, time: 6.0 * DAY })
        .length(0.068)
        .radius(0.5e-3)
        .elements(elements)
        .growth(UniformGrowth { zone_length: 0.07, time: 40.0 * HOUR })
        .tropism((
            Oscillator::new(alpha, OSCILLATOR),
            Gravitropism { sensitivity: 0.8, perception: Statoliths { avalanche_time: 2.0 * MINUTE } }
                .remembered(memory),
            Proprioception { sensitivity: 20.0 }.remembered(memory),
        ))
        .load((Weight { density: 1000.0 }, imperfect.then_some((wind, pull))))
        .build()
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "growing_shoot",
        "a shoot that grows, steers, stiffens, bends under its own weight and nutates",
        &[
            Opt::value("hours", "H", "40", "time to simulate, h"),
            Opt::value("alpha", "A", "0.2", "sensitivity of the endogenous oscillator"),
            Opt::value("elements", "N", "8", "elements in the growth zone, at least"),
            Opt::value("step", "S", "90", "longest time step, s; shortened so that whole hours are met"),
            Opt::value(
                "tolerance",
                "T",
                "",
                "largest error relative to the length: steps and elements are chosen by it",
            ),
            Opt::flag("imperfection", "a breath of wind and of pull at the apex, which break the symmetry"),
            Opt::value(
                "checkpoint",
                "FILE",
                "",
                "kept up to date every hour of growth; a run goes on from it if it is there",
            ),
            Opt::flag("film", "also film.html, which shows the shoot in space and plays in a browser"),
            Opt::flag(
                "render",
                "also shoot.pvd (VTK, one file for each shape) and shoot.obj (the last shape as a tube)",
            ),
            Opt::value("compare", "FILE", "", "another tip.csv; print how far this run is from it at common times"),
        ],
    );
    let end = HOUR * options.positive("hours");
    let by_tolerance = options.flag("tolerance");
    if by_tolerance && (options.flag("step") || options.flag("elements")) {
        return Err("--tolerance chooses steps and elements: leave out --step and --elements".into());
    }
    let longest = options.positive("step");
    // A row of the table after every step, at whole hours among others and at least every 5 min.
    let rows_per_hour = (HOUR / longest.min(5.0 * MINUTE)).ceil();
    let out = options.out_dir();

    let mut shoot = growing_shoot(options.get("alpha"), options.get("elements"), options.flag("imperfection"))?;
    let settings = ["alpha", "elements", "step", "tolerance"].map(|name| options.text(name)).join(" ");
    let settings = format!("{settings} {}", options.flag("imperfection"));
    let file = Some(options.text("checkpoint")).filter(|file| !file.is_empty()).map(Path::new);
    if file.is_some() && !cfg!(feature = "serde") {
        return Err(NO_SERDE.into());
    }
    let mut record = Record { interval: end / 20.0, ..Record::default() };
    let about = format!("Agostinelli, DeSimone and Noselli (2021), {}: {ABOUT}", video(options.get("alpha")));
    let mut film = options.flag("film").then(|| Film::new("The tip of a growing shoot nutates", &about, 2.0));
    if film.is_some() && file.is_some() {
        return Err("--film with --checkpoint: a film shows the whole run, a checkpoint holds only its end".into());
    }
    if let Some(file) = file.filter(|file| file.exists()) {
        resume(file, &settings, &mut shoot, &mut record)?;
        println!("going on from {:.1} h", shoot.time() / HOUR);
    }
    let mut render = if options.flag("render") { Some(VtkSeries::create(out.join("render"))?) } else { None };
    let progress = Progress::new("growing shoot");
    let clock = Instant::now();

    let mut saved = shoot.time();
    let mut show = |shoot: &Shoot<_>, record: &mut Record| -> Result<(), Box<dyn Error>> {
        if record.look(shoot) {
            render.iter_mut().try_for_each(|series| series.push(shoot.time(), &camera::stations(shoot, 101)))?;
        }
        film.iter_mut().for_each(|film| film.push(camera::look(shoot, Some(0))));
        progress.set(shoot.time() / end);
        if let Some(file) = file.filter(|_| shoot.time() >= saved + HOUR - 1e-6) {
            save(file, &settings, shoot, record)?;
            saved = shoot.time();
        }
        Ok(())
    };
    let mut cost = Statistics::default();
    if by_tolerance {
        let mut integrator = Adaptive::new(options.positive("tolerance"));
        // Every hour, so that the table can be compared, and all steps between; the choice is for the whole way.
        let mut until = end;
        while shoot.time() < end {
            cost += integrator.step(&mut shoot, until)?;
            show(&shoot, &mut record)?;
            until = (HOUR * (shoot.time() / HOUR + 1e-9).floor() + HOUR).min(end);
        }
    } else {
        let step = HOUR / rows_per_hour;
        let mut integrator = MethodOfSteps::new(step);
        if record.rows.is_empty() {
            cost += integrator.start(&mut shoot, &ConstantHistory::Empty)?;
        }
        for row in record.rows.len()..=(end / step).ceil() as usize {
            cost += integrator.advance(&mut shoot, (row as f64 * step).min(end))?;
            show(&shoot, &mut record)?;
        }
    }

    let wall = clock.elapsed().as_secs_f64();
    progress.finish();
    let mut table = Table::create(out.join("tip.csv"), &["t_s", "length_m", "x_m", "y_m", "z_m"])?;
    record.rows.iter().try_for_each(|row| table.row(row))?;
    table.finish()?;
    let times: Vec<f64> = record.rows.iter().map(|row| row[0] / HOUR).collect();
    let tips: Vec<[f64; 3]> = record.rows.iter().map(|row| [row[2], row[3], row[4]]).collect();
    let path = oscillations::seen_from_above(&record.rows)?;
    let shares = oscillations::shares(&path);
    let curves = oscillations::curves(&shares);
    let strip = Strip { label: "share of the motion", series: &curves };
    let strips = if shares.is_empty() { &[][..] } else { &[strip] };
    path_figure(out.join("tip.svg"), "The path of the tip of a growing shoot", &times, &tips, strips)?;
    let title = format!("A growing shoot, every {} h", record.interval / HOUR);
    shapes_figure(out.join("shapes.svg"), &title, &record.shapes)?;
    println!("{} h of growth, to a length of {:.2} cm, in {wall:.3} s:", end / HOUR, 100.0 * shoot.rod().length());
    println!("  {} time steps, {} more in trial runs, {} equilibria,", cost.steps, cost.trial_steps, cost.equilibria);
    println!("  {} Newton iterations, {} elements at the end", cost.iterations, shoot.rod().elements());
    if let Some(error) = cost.error {
        println!("  estimated error of the shape {error:.1e} of the length");
    }
    oscillations::tell(&path);
    oscillations::tell_shares(&shares);
    if options.flag("render") {
        write_tube(out.join("shoot.obj"), &camera::stations(&shoot, 201))?;
        println!("render/shoot.pvd and shoot.obj are for three-dimensional rendering");
    }
    if let Some(film) = film {
        film.write(out.join("film.html"))?;
        println!("film.html plays in a browser");
    }
    if !options.text("compare").is_empty() {
        compare(&times, &tips, Path::new(options.text("compare")))?;
    }
    println!("tip.csv, tip.svg and shapes.svg are in {}", out.display());
    Ok(())
}

/// Which video of the paper a sensitivity of the oscillator makes.
fn video(alpha: f64) -> String {
    match alpha {
        0.2 => "second video".into(),
        0.01 => "third video, with a weak oscillator".into(),
        _ => format!("second video, but with α = {alpha}"),
    }
}

const ABOUT: &str = "an oscillator in the tissue, gravity and the shoot's own bending steer it; tissue that has left the growth zone \
    turns to wood.";

const NO_SERDE: &str = "--checkpoint needs `cargo run --release --features serde --example growing_shoot`";

/// What is written down on the way; with the state of the shoot, enough to go on from there.
#[derive(Default)]
struct Record {
    /// Time (s), length, place of the tip (m).
    rows: Vec<[f64; 5]>,
    /// Twenty shapes, at equal times (h), and the last.
    shapes: Vec<(f64, Vec<[f64; 3]>)>,
    /// Between two of them, s.
    interval: f64,
}

impl Record {
    /// Records the tip, and the shape if it is due. Returns whether it was.
    fn look(&mut self, shoot: &Shoot<impl Model>) -> bool {
        let (time, tip) = (shoot.time(), shoot.tip());
        self.rows.push([time, shoot.rod().length(), tip.x, tip.y, tip.z]);
        let due = time >= self.interval * self.shapes.len() as f64 - 1e-6;
        if due {
            let line = shoot.rod().centre_line_at(101);
            self.shapes.push((time / HOUR, line.into_iter().map(Into::into).collect()));
        }
        due
    }
}

#[cfg(feature = "serde")]
fn save(file: &Path, settings: &str, shoot: &Shoot<impl Model>, record: &Record) -> Result<(), Box<dyn Error>> {
    let all = (settings, shoot.state(), &record.rows, &record.shapes);
    Ok(common::file::write_whole(file, morphorod::checkpoint::to_bytes(&all)?)?)
}

#[cfg(feature = "serde")]
fn resume(
    file: &Path,
    settings: &str,
    shoot: &mut Shoot<impl Model>,
    record: &mut Record,
) -> Result<(), Box<dyn Error>> {
    let (made_with, state, rows, shapes): (String, morphorod::State, _, _) =
        morphorod::checkpoint::from_bytes(&std::fs::read(file)?)
            .map_err(|error| format!("{}: {error}", file.display()))?;
    if made_with != settings {
        return Err(format!("{} is of a run with other options: {made_with}, not {settings}", file.display()).into());
    }
    shoot.restore(&state)?;
    (record.rows, record.shapes) = (rows, shapes);
    Ok(())
}

#[cfg(not(feature = "serde"))]
fn save(_: &Path, _: &str, _: &Shoot<impl Model>, _: &Record) -> Result<(), Box<dyn Error>> {
    Err(NO_SERDE.into())
}

#[cfg(not(feature = "serde"))]
fn resume(
    file: &Path,
    settings: &str,
    shoot: &mut Shoot<impl Model>,
    record: &mut Record,
) -> Result<(), Box<dyn Error>> {
    save(file, settings, shoot, record)
}

/// Prints the largest distance between the tip and that of another run, at the times that both have.
fn compare(hours: &[f64], tips: &[[f64; 3]], other: &Path) -> Result<(), Box<dyn Error>> {
    let mut largest = 0.0_f64;
    let mut common = 0;
    for row in common::table::read(other)? {
        let Some(i) = hours.iter().position(|h| (h * HOUR - row[0]).abs() < 1e-6) else { continue };
        largest = largest.max((Vector3::from(tips[i]) - Vector3::from_row_slice(&row[2..5])).norm());
        common += 1;
    }
    println!("  at {common} common times at most {largest:.1e} m from {}", other.display());
    Ok(())
}

fn main() -> ExitCode {
    common::finish(run())
}
