//! Mechanism of the movement of a tracked tip: an internal oscillator, delayed gravitropism, or
//! both.
//!
//! The program reads a comma-separated table of positions, one in a row: `t,x,y[,z]` or
//! `frame,x,y`, with a column of names if there are several tracks. It computes periods, ellipses,
//! senses of rotation and the pattern of the movement, for the whole track and in a sliding window,
//! and compares them with both mechanisms of Agostinelli, DeSimone and Noselli (2021). The module
//! [`mechanism`] explains the decision. Every criterion is printed with its number and uncertainty,
//! and with the mechanism for which it speaks.
//!
//! Without options the program reads the table beside this file: the shoot of the example
//! `growing_shoot` from above, with noise, outliers, lost frames, two hours of darkness and a drift
//! of the stage. A second track is a fixed stake.
//!
//! # Results
//! At first the oscillation of the internal oscillator (24 min) is the largest. The slow one (90
//! min) grows by more than a forced oscillation can, and its ratio to 24 min is not a whole number.
//! The verdict is both mechanisms.
//!
//! # Options to try
//! - `--track stake`: the stake does not move, and the verdict says so.
//! - `--delay 12 --memory 12`: the periods are compared with that at the onset of delayed
//!   gravitropism.
//! - `--window 3 --every 1`: shorter windows cannot resolve the slow period well.
//! - A table of your own, whose scale, time unit and axes are required: `--file mine.csv --time
//!   frame --columns x,y --seconds 60 --mm 0.05 --axes +x,-y`. Lengths (`--lengths`) and tracks at
//!   several levels of gravity (`--gravity`) decide where the tip alone does not.
//! - A table of positions in space, one a minute, without times and without a header, as in the
//!   experiment of that paper: `--file mine.csv --time '' --columns 1,2,3 --seconds 60 --mm 10
//!   --axes +1,+2,+3` for centimetres. The figure `average.svg` corresponds to their figure
//!   7B: the positions from above in grey, and their moving average over ten positions.
//! - `--centre-lines lines.csv`, with the same options: rows of one time are points from the base
//!   to the tip. Their curvature along the arc is written to `curvature.csv`.
//!
//! The example `fit` estimates the parameters of a shoot from such a table.

mod average;
mod criteria;
mod evidence;
mod figures;
mod mechanism;
mod report;
mod rows;
mod synthetic;
mod table;

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

use mechanism::{Context, Level};
use morphorod::tracking::{Nutation, Search};
use morphorod_plot::centre_lines::curvature;
use morphorod_plot::track_options;
use morphorod_plot::tracks::{Layout, Track};
use morphorod_plot::{Opt, Options, Table, println};
use nalgebra::Vector3;

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
const M_PER_MM: f64 = 1e-3;

fn options() -> Options {
    let positions = "table of positions; by default the table of this example";
    let mut all = track_options::declarations(
        positions,
        "table of centre lines, whose curvature is written",
        "frame",
    );
    all.extend([
        Opt::value("seen-along", "X,Y,Z", "0,0,1", "axis towards the observer, for three coordinates"),
        Opt::value("lengths", "NAME", "", "column of the length of the shoot"),
        Opt::value("lengths-mm", "MM", "1", "unit of the lengths, mm"),
        Opt::value(
            "base",
            "MM",
            "",
            "coordinate of the base along --seen-along, mm: three coordinates then give the height, used as length",
        ),
        Opt::value("gravity", "NAME", "", "column of the level of gravity, in multiples of 9.81 m/s²"),
        Opt::value("delay", "MIN", "", "delay of the gravitropic response, min, if known"),
        Opt::value("memory", "MIN", "0", "memory time of the gravitropic response, min, beside --delay"),
        Opt::value("shortest", "MIN", "10", "shortest period of the wavelets, min"),
        Opt::value("longest", "MIN", "120", "longest period of the wavelets, min"),
        Opt::value("window", "H", "6", "length of the sliding window, h"),
        Opt::value("every", "H", "0.5", "time from one window to the next, h"),
        Opt::value("share", "MIN", "24", "period whose share in the squared amplitudes is computed, min"),
        Opt::value("average", "N", "10", "number of positions in the moving average"),
        Opt::value("width", "MM", "2", "length over which the curvature is smoothed, mm"),
        Opt::value("make", "FILE", "", "only write the table of this example to a file"),
    ]);
    Options::parse(
        "tracked_tip",
        "mechanism of the movement of a tracked tip",
        &all,
    )
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = options();
    if options.flag("make") {
        let file = options.text("make");
        morphorod_plot::file::write_whole(Path::new(file), synthetic::table()?)?;
        println!("{file} was written");
        return Ok(());
    }
    let layout = table::layout(&options)?;
    let axis = table::axis(options.text("seen-along"))?;
    let given = |name: &str| options.flag(name).then(|| options.positive(name));
    let delays = given("delay").map(|delay| {
        let memory = options.get_if("memory", "0 or larger", |value: &f64| *value >= 0.0);
        [MINUTE * delay, MINUTE * memory]
    });
    let base = options
        .flag("base")
        .then(|| M_PER_MM * options.get::<f64>("base"));
    if base.is_some() && layout.coordinates.len() < 3 {
        return Err(
            "--base needs three coordinates, of which it subtracts the one along --seen-along"
                .into(),
        );
    }
    let [shortest, longest] = ["shortest", "longest"].map(|name| MINUTE * options.positive(name));
    let [window, every] = ["window", "every"].map(|name| HOUR * options.positive(name));
    let share = MINUTE * options.positive("share");
    let width = M_PER_MM * options.positive("width");
    let average = options.get_if("average", "larger than 0", |count: &usize| *count > 0);
    let out = options.out_dir();
    if options.flag("centre-lines") {
        return curvatures(&options, &layout, width, &out);
    }

    let (file, tracks) = table::tracks(&options, &layout)?;
    let track = track_options::chosen(&tracks, options.text("track"))?;
    let path = projected(track, &axis)?;
    let name = if track.name.is_empty() {
        file
    } else {
        format!("track '{}'", track.name)
    };
    println!(
        "{name}: {} positions in {:.2} h",
        track.times.len(),
        path.duration() / HOUR
    );
    let found = path.oscillations(&Search::default())?;
    report::oscillations(&path, &found, share)?;

    // A band of a track needs three of its longest periods.
    let window = window.min(path.duration());
    let band = |duration: f64| [shortest, longest.min(duration / 3.0)];
    let nutation = path
        .nutation(band(path.duration()))
        .unwrap_or_else(|error| {
            println!("no result by wavelets: {error}");
            Nutation::default()
        });
    report::nutation(&nutation, band(path.duration()));
    let windows = evidence::windows(&path, &found.outliers, window, every)?;
    let (rows, failures) = rows::rows(&windows, band(window), share.min(window));
    report::failures(&failures, windows.len());

    let lengths = lengths(track, &axis, base);
    if lengths.is_empty() {
        println!("length unknown: give --lengths, or three coordinates and --base");
    }
    let observations = evidence::observe(&windows, &lengths);
    let context = Context {
        window,
        delays,
        gravity: track.gravity,
        levels: levels(&tracks, track, &axis)?,
    };
    let judgement = mechanism::judge(&observations, &context);
    report::mechanism(&judgement, observations.len(), window);

    let mut table = Table::create(out.join("windows.csv"), &rows::COLUMNS)?;
    rows.iter().try_for_each(|row| table.row(row))?;
    table.finish()?;
    let mut table = Table::create(
        out.join("ridge.csv"),
        &["t_s", "period_s", "amplitude_m", "direction_rad"],
    )?;
    for (place, direction) in nutation.ridge.iter().zip(&nutation.direction) {
        table.row(&[place.time, place.period, place.ellipse.major, *direction])?;
    }
    table.finish()?;
    figures::draw(&out, &path, &nutation, &rows, window)?;
    figures::average(&out, &path, &nutation.outliers, average)?;
    figures::mechanism(&out, &judgement, &observations)?;
    println!(
        "windows.csv, ridge.csv, path.svg, average.svg, scalogram.svg, amplitude.svg and mechanism.svg are in {}",
        out.display()
    );
    Ok(())
}

/// Projection of a track along the axis towards the observer.
fn projected(
    track: &Track,
    axis: &Vector3<f64>,
) -> Result<morphorod::tracking::Track, Box<dyn Error>> {
    let positions: Vec<_> = track.positions.iter().map(|p| Vector3::from(*p)).collect();
    Ok(morphorod::tracking::Track::seen_along(
        axis,
        track.times.clone(),
        &positions,
    )?)
}

/// Times (s) and lengths (m): those of the table, or the height of the tip over the base.
fn lengths(track: &Track, axis: &Vector3<f64>, base: Option<f64>) -> Vec<evidence::Length> {
    if !track.lengths.is_empty() {
        return track
            .times
            .iter()
            .zip(&track.lengths)
            .map(|(t, length)| [*t, *length])
            .collect();
    }
    let height = |p: &[f64; 3], base: f64| Vector3::from(*p).dot(&axis.normalize()) - base;
    let heights = base.map(|base| {
        track
            .times
            .iter()
            .zip(&track.positions)
            .map(move |(t, p)| [*t, height(p, base)])
    });
    heights.map_or(vec![], Iterator::collect)
}

/// Oscillations of all other tracks at known levels of gravity.
fn levels(
    tracks: &[Track],
    own: &Track,
    axis: &Vector3<f64>,
) -> Result<Vec<Level>, Box<dyn Error>> {
    let mut levels = Vec::new();
    for track in tracks.iter().filter(|track| track.name != own.name) {
        let Some(gravity) = track.gravity else {
            continue;
        };
        let path = projected(track, axis)?;
        let found = path.oscillations(&Search::default())?;
        levels.push(Level {
            gravity,
            observation: evidence::observation(0.0, None, &found, path.times().len()),
        });
    }
    Ok(levels)
}

/// Writes the curvature along all centre lines of a file.
fn curvatures(
    options: &Options,
    layout: &Layout,
    width: f64,
    out: &Path,
) -> Result<(), Box<dyn Error>> {
    let lines = track_options::centre_lines(options, layout)?;
    let columns = [
        "t_s",
        "s_m",
        "curvature_x_per_m",
        "curvature_y_per_m",
        "curvature_z_per_m",
    ];
    let mut table = Table::create(out.join("curvature.csv"), &columns)?;
    for line in &lines {
        let (number, width_mm) = (line.points.len(), width / M_PER_MM);
        let places = curvature(&line.points, width).ok_or_else(|| {
            format!(
                "the centre line at {} s has {number} points, too few for --width {width_mm} (mm)",
                line.time
            )
        })?;
        for place in places {
            let [x, y, z] = place.curvature;
            table.row(&[line.time, place.arc_length, x, y, z])?;
        }
    }
    table.finish()?;
    println!(
        "curvature of {} centre lines: curvature.csv in {}",
        lines.len(),
        out.display()
    );
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
