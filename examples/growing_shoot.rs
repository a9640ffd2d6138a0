//! Circumnutation of a growing shoot: endogenous oscillator, gravitropism, proprioception,
//! lignification and self-weight.
//!
//! This example reproduces the second video of Agostinelli, DeSimone and Noselli (2021), *Nutations
//! in Plant Shoots*, Front. Plant Sci. 12:608005, and draws the tip track in the manner of their
//! figure 7A. A shoot of 6.8 cm grows in its last 7 cm. An endogenous oscillator with a period of
//! 24 min bends it in all directions, one after the other. Gravitropism and proprioception
//! straighten it with a delay. The gravitropic stimulus comes from statoliths, which follow the
//! avalanche dynamics with a time constant of 2 min. Tissue that has left the growth zone
//! lignifies.
//!
//! # Results
//! At first the tip describes small ellipses with the period of the oscillator. When the shoot
//! exceeds a critical length, the delayed gravitropic response overshoots, and an oscillation with
//! a period of about 95 min grows. Its ellipses are narrow at first and become circles. The tip
//! continues to rise. A table shows their axes in windows of six hours.
//!
//! The lower panel of the figure shows the share of the oscillator in the motion. It is the part of
//! the squared amplitudes that belongs to the period of the oscillator, among all periods found in
//! a window of four hours. The share decreases from more than 0.8 to almost zero.
//!
//! # Options
//! - `--alpha 0.01`, the third video: a weak oscillator. The slow oscillation is nearly the same at
//!   the end, because it results from the delays. The oscillator only provides the initial
//!   perturbation. With `--alpha 0` an upright shoot remains upright unless `--imperfection` adds
//!   small lateral forces.
//! - `--tolerance 1e-5`: steps and elements are chosen such that the estimated error is below this
//!   part of the length.
//! - `--checkpoint FILE`, with `--features serde`: an interrupted run continues from the last whole
//!   hour with identical results.
//! - `--step 45 --elements 16 --out fine`, and then a run with `--compare fine/tip.csv`: the error
//!   of the default settings.
//!
//! The function [`growing_shoot`] defines the laws of the shoot.

#[path = "growing_shoot/oscillations.rs"]
mod oscillations;

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use morphorod::integrator::{Adaptive, ConstantHistory, Integrator, MethodOfSteps, Statistics};
use morphorod::load::{ApicalForce, Distributed};
use morphorod::{Model, ParameterError, Shoot, ShootParameters};
use morphorod_plot::{
    Figure, Film, Frame, Opt, Options, Progress, Strip, Table, VtkSeries, println, stations,
};
use nalgebra::Vector3;

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// Longest time between two rows of the table with a fixed step, s.
const LONGEST_ROW: f64 = 5.0 * MINUTE;
/// Period of the oscillator τe, s.
const OSCILLATOR: f64 = 24.0 * MINUTE;

/// Returns a shoot with all laws of the model. `imperfect` adds small lateral forces.
fn growing_shoot(
    alpha: f64,
    elements: usize,
    imperfect: bool,
) -> Result<Shoot<impl Model>, ParameterError> {
    let parameters = ShootParameters {
        oscillator_sensitivity: alpha,
        oscillator_period: OSCILLATOR,
        ..ShootParameters::default()
    };
    let wind = Distributed(Vector3::new(0.0, -1e-6, 0.0));
    let pull = ApicalForce(|_t: f64| Vector3::new(-1e-7, -1e-7, 0.0));
    parameters
        .shoot()
        .elements(elements)
        .load((parameters.weight(), imperfect.then_some((wind, pull))))
        .build()
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "growing_shoot",
        "circumnutation of a growing shoot with all laws of the model",
        &[
            Opt::value("hours", "H", "40", "time to simulate, h"),
            Opt::value(
                "alpha",
                "A",
                "0.2",
                "sensitivity of the endogenous oscillator",
            ),
            Opt::value(
                "elements",
                "N",
                "8",
                "smallest number of elements in the growth zone",
            ),
            Opt::value(
                "step",
                "S",
                "90",
                "longest time step, s; rounded down to a whole fraction of an hour",
            ),
            Opt::value(
                "tolerance",
                "T",
                "",
                "error tolerance relative to the length; replaces --step and --elements",
            ),
            Opt::flag(
                "imperfection",
                "small lateral forces that break the symmetry",
            ),
            Opt::value(
                "checkpoint",
                "FILE",
                "",
                "saves the run every simulated hour; an existing file is resumed",
            ),
            Opt::flag(
                "film",
                "also write film.html, an animation in space for the browser",
            ),
            Opt::value(
                "render",
                "N",
                "",
                "also write N + 1 shapes for three-dimensional rendering, as VTK and as tubes (OBJ)",
            ),
            Opt::value(
                "compare",
                "FILE",
                "",
                "tip.csv of another run; print the largest distance at common times",
            ),
        ],
    );
    let end = HOUR * options.positive("hours");
    let by_tolerance = options.flag("tolerance");
    if by_tolerance && (options.flag("step") || options.flag("elements")) {
        return Err(
            "--tolerance cannot be combined with --step or --elements, which it replaces".into(),
        );
    }
    // Whole hours are among the ends of steps.
    let step = HOUR / (HOUR / options.positive("step")).ceil();
    let out = options.out_dir();

    let alpha = options.get("alpha");
    let mut shoot = growing_shoot(alpha, options.get("elements"), options.flag("imperfection"))?;
    let settings = ["alpha", "elements", "step", "tolerance"]
        .map(|name| options.text(name))
        .join(" ");
    let settings = format!("{settings} {}", options.flag("imperfection"));
    let file = Some(options.text("checkpoint"))
        .filter(|file| !file.is_empty())
        .map(Path::new);
    if file.is_some() && !cfg!(feature = "serde") {
        return Err(NO_SERDE.into());
    }
    let mut record = Record {
        interval: end / 20.0,
        ..Record::default()
    };
    let about = format!(
        "Agostinelli, DeSimone and Noselli (2021), {}: {ABOUT}",
        video(alpha)
    );
    let mut film = options
        .flag("film")
        .then(|| Film::new("Circumnutation of a growing shoot", &about, 2.0));
    if film.is_some() && file.is_some() {
        return Err(
            "--film cannot be combined with --checkpoint, because a checkpoint does not contain the frames".into()
        );
    }
    if let Some(file) = file.filter(|file| file.exists()) {
        resume(file, &settings, &mut shoot, &mut record)?;
        println!("resumed at {:.1} h", shoot.time() / HOUR);
    }
    let shapes = options.flag("render").then(|| options.positive("render"));
    let mut render = shapes
        .map(|count| VtkSeries::create(out.join("render"), end / count))
        .transpose()?;
    let progress = Progress::new("growing shoot");
    let clock = Instant::now();

    let mut saved = shoot.time();
    let mut show = |shoot: &Shoot<_>, record: &mut Record| -> Result<(), Box<dyn Error>> {
        record.add(shoot);
        render
            .iter_mut()
            .try_for_each(|series| series.push(shoot.time(), || stations(shoot, 101)))?;
        film.iter_mut()
            .for_each(|film| film.push(Frame::of(shoot, Some(0))));
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
        // The table has a row after every step, and whole hours are among the times. The first call
        // chooses steps and elements for the whole run.
        let mut until = end;
        while shoot.time() < end {
            cost += integrator.step(&mut shoot, until)?;
            show(&shoot, &mut record)?;
            until = (HOUR * (shoot.time() / HOUR + 1e-9).floor() + HOUR).min(end);
        }
    } else {
        let mut integrator = MethodOfSteps::new(step);
        if record.rows.is_empty() {
            cost += integrator.start(&mut shoot, &ConstantHistory::Empty)?;
            show(&shoot, &mut record)?;
        }
        let rows = (step / LONGEST_ROW).ceil() as u32;
        for k in (shoot.time() / step).round() as u32..(end / step).ceil() as u32 {
            let until = (step * f64::from(k + 1)).min(end);
            // The integrator interpolates the rows within a long step.
            let within =
                (1..rows).map(|row| step * (f64::from(k) + f64::from(row) / f64::from(rows)));
            let mut shown = Ok(());
            if rows > 1 {
                cost += integrator.advance_showing(
                    &mut shoot,
                    until,
                    within.filter(|t| *t < until),
                    |shoot| {
                        if shown.is_ok() {
                            shown = show(shoot, &mut record);
                        }
                    },
                )?;
            } else {
                cost += integrator.advance(&mut shoot, until)?;
            }
            shown?;
            show(&shoot, &mut record)?;
        }
    }

    let wall = clock.elapsed().as_secs_f64();
    progress.finish();
    let mut table = Table::create(
        out.join("tip.csv"),
        &["t_s", "length_m", "x_m", "y_m", "z_m"],
    )?;
    record.rows.iter().try_for_each(|row| table.row(row))?;
    table.finish()?;
    let path: Vec<(f64, [f64; 3])> = record
        .rows
        .iter()
        .map(|[t, _, tip @ ..]| (*t, *tip))
        .collect();
    let track = oscillations::horizontal_track(&record.rows)?;
    let shares = oscillations::shares(&track);
    let curves = oscillations::curves(&shares);
    let strip = Strip {
        label: "share (1)",
        series: &curves,
    };
    let strips = if shares.is_empty() { &[][..] } else { &[strip] };
    Figure::new(
        out.join("tip.svg"),
        format!("Tip track of a growing shoot, α = {alpha}"),
    )
    .path(&path, strips)?;
    let title = format!(
        "Centre lines of a growing shoot every {} h, α = {alpha}",
        record.interval / HOUR
    );
    Figure::new(out.join("shapes.svg"), title).shapes(&record.shapes)?;
    println!(
        "length after {} h: {:.2} cm; run time {wall:.3} s",
        end / HOUR,
        100.0 * shoot.rod().length()
    );
    if by_tolerance {
        println!(
            "  {} time steps, and {} trial steps",
            cost.steps, cost.trial_steps
        );
    } else {
        println!("  {} time steps of at most {step} s", cost.steps);
    }
    println!(
        "  {} equilibria, {} Newton iterations, {} elements at the end",
        cost.equilibria,
        cost.iterations,
        shoot.rod().elements()
    );
    if let Some(error) = cost.error {
        println!("  estimated error of the shape: {error:.1e} of the length");
    }
    oscillations::print_last(&track);
    oscillations::print_shares(&shares);
    oscillations::print_axis_ratios(&track);
    if render.is_some() {
        println!("wrote render/shoot.pvd and render/shoot_….obj for three-dimensional rendering");
    }
    if let Some(film) = film {
        film.write(out.join("film.html"))?;
        println!("wrote film.html for the browser");
    }
    if !options.text("compare").is_empty() {
        compare(&path, Path::new(options.text("compare")))?;
    }
    println!("wrote tip.csv, tip.svg and shapes.svg to {}", out.display());
    Ok(())
}

/// Returns the video of the paper that has the given sensitivity of the oscillator.
fn video(alpha: f64) -> String {
    match alpha {
        0.2 => "second video".into(),
        0.01 => "third video, with a weak endogenous oscillator".into(),
        _ => format!("second video, but with α = {alpha}"),
    }
}

const ABOUT: &str = "an endogenous oscillator, gravitropism and proprioception bend the shoot, and tissue that has \
    left the growth zone lignifies.";

const NO_SERDE: &str =
    "--checkpoint needs `cargo run --release --features serde --example growing_shoot`";

/// Results of the run. Together with the state of the shoot they are sufficient to resume it.
#[derive(Default)]
struct Record {
    /// Time (s), length (m) and position of the tip (m).
    rows: Vec<[f64; 5]>,
    /// Times (s) and centre lines (m) of 21 equally spaced shapes.
    shapes: Vec<(f64, Vec<[f64; 3]>)>,
    /// Time between two shapes, s.
    interval: f64,
}

impl Record {
    /// Records the tip, and the centre line if its time has come.
    fn add(&mut self, shoot: &Shoot<impl Model>) {
        let (time, tip) = (shoot.time(), shoot.tip());
        self.rows
            .push([time, shoot.rod().length(), tip.x, tip.y, tip.z]);
        if time >= self.interval * self.shapes.len() as f64 - 1e-6 {
            let line = shoot.rod().centre_line_at(101);
            self.shapes
                .push((time, line.into_iter().map(Into::into).collect()));
        }
    }
}

#[cfg(feature = "serde")]
fn save(
    file: &Path,
    settings: &str,
    shoot: &Shoot<impl Model>,
    record: &Record,
) -> Result<(), Box<dyn Error>> {
    let all = (settings, shoot.state(), &record.rows, &record.shapes);
    Ok(morphorod_plot::file::write_whole(
        file,
        morphorod::checkpoint::to_bytes(&all)?,
    )?)
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
        return Err(format!(
            "{} belongs to a run with other options: {made_with} instead of {settings}",
            file.display()
        )
        .into());
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

/// Prints the largest distance between the tips of this and of another run at common times.
fn compare(path: &[(f64, [f64; 3])], other: &Path) -> Result<(), Box<dyn Error>> {
    let mut largest = 0.0_f64;
    let mut common = 0;
    for row in morphorod_plot::table::read(other)? {
        let Some((_, tip)) = path.iter().find(|(time, _)| (time - row[0]).abs() < 1e-6) else {
            continue;
        };
        largest = largest.max((Vector3::from(*tip) - Vector3::from_row_slice(&row[2..5])).norm());
        common += 1;
    }
    println!(
        "  largest distance from {}: {largest:.1e} m at {common} common times",
        other.display()
    );
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
