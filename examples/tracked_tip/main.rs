//! What the tracked tip of a plant does: periods, ellipses, senses, the pattern's name, and the numbers of tracking pipelines.
//!
//! Reads a comma-separated table of positions, one a row: `t,x,y[,z]` or `frame,x,y`, several tracks told apart by a column. Without
//! options it reads the table beside this file, which the crate made itself: the shoot of the example `growing_shoot` seen from above, with
//! noise, outliers, lost frames, two hours of darkness, and a stage that drifts; and a stake that stands still.
//!
//! # What to see
//! At first the tip goes round in the 24 minutes of its oscillator. After half a day slow swings of an hour and a half take over; the
//! ridge of the scalogram goes up from one to the other, and the share of the 24 minutes falls to nothing.
//!
//! # What to try
//! - `--track stake`: it does not nutate, and the program says so.
//! - A table of your own. What it does not say has to be given, as nothing is guessed:
//!   `--file mine.csv --time frame --columns x,y --seconds 60 --mm 0.05 --axes +x,-y`.
//! - `--centre-lines lines.csv`, with the same options: rows of one time are points from the base to the tip; their curvature along the
//!   arc goes to `curvature.csv`.

#[path = "../common/mod.rs"]
mod common;
mod figures;
mod report;
mod synthetic;

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

use common::centre_lines::{curvature, read_centre_lines};
use common::tracks::{Layout, Track, TrackError, read_tracks};
use common::{Opt, Options, Table};
use morphorod::tracking;
use nalgebra::Vector3;

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
const M_PER_MM: f64 = 1e-3;
/// The table that comes with the example.
const SHIPPED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/tracked_tip/shoot_from_above.csv");

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "tracked_tip",
        "what the tracked tip of a plant does",
        &[
            Opt::value("file", "FILE", "", "table of positions; without one, a table that comes with the example"),
            Opt::value("time", "NAME", "frame", "column of times or frame numbers"),
            Opt::value("columns", "NAMES", "x,y", "columns of two or three coordinates"),
            Opt::value("tracks", "NAME", "", "column that tells tracks apart, if there are several"),
            Opt::value("track", "TRACK", "", "which track; without it, the first"),
            Opt::value("seconds", "S", "", "s in a unit of the time column: from frame to frame, or 1"),
            Opt::value("mm", "MM", "", "mm in a unit of the coordinates: the size of a pixel, or 1"),
            Opt::value("axes", "SIGNS", "", "where they point: +x,+y right and up; +x,-y as in images, y down"),
            Opt::value("seen-along", "X,Y,Z", "0,0,1", "axis along which three coordinates are seen"),
            Opt::value("shortest", "MIN", "10", "shortest period of the band, min"),
            Opt::value("longest", "MIN", "120", "longest period of the band, min"),
            Opt::value("window", "H", "6", "length of the sliding window, h"),
            Opt::value("every", "H", "0.5", "from one window to the next, h"),
            Opt::value("share", "MIN", "24", "period whose share in the motion is told, min"),
            Opt::value("centre-lines", "FILE", "", "table of centre lines, whose curvature is written"),
            Opt::value("width", "MM", "2", "length over which curvature is smoothed, mm"),
            Opt::value("make", "FILE", "", "write the table that comes with the example, and nothing else"),
        ],
    );
    if options.flag("make") {
        let file = options.text("make");
        common::file::write_whole(Path::new(file), synthetic::table()?)?;
        println!("made {file}");
        return Ok(());
    }
    let columns: Vec<&str> = options.text("columns").split(',').map(str::trim).collect();
    // The table that comes with the example is known; of any other nothing is.
    let shipped = !options.flag("file") && !options.flag("centre-lines");
    let given = |name: &str| options.flag(name).then(|| options.positive(name));
    let layout = Layout {
        time: options.text("time"),
        track: Some(options.text("tracks")).filter(|name| !name.is_empty()).or(shipped.then_some("track")),
        seconds: given("seconds").or(shipped.then_some(synthetic::FRAME)),
        metres: given("mm").map(|mm| M_PER_MM * mm).or(shipped.then_some(synthetic::PIXEL)),
        signs: match options.text("axes") {
            "" => shipped.then(|| vec![1.0, -1.0]),
            text => Some(signs(text, &columns)?),
        },
        coordinates: columns,
    };
    let out = options.out_dir();
    if options.flag("centre-lines") {
        let width = M_PER_MM * options.positive("width");
        return curvatures(options.text("centre-lines"), &layout, options.text("track"), width, &out);
    }
    let file = if shipped { SHIPPED } else { options.text("file") };
    let tracks = read_tracks(file, &layout).map_err(|error| explained(file, &error))?;
    let track = chosen(&tracks, options.text("track"))?;
    let axis: Vec<f64> = options
        .text("seen-along")
        .split(',')
        .map(|text| text.trim().parse().map_err(|_| format!("--seen-along: '{text}' is not a number")))
        .collect::<Result<_, _>>()?;
    if axis.len() != 3 {
        return Err("--seen-along takes three numbers, as in 0,0,1".into());
    }
    let positions: Vec<_> = track.positions.iter().map(|p| Vector3::from(*p)).collect();
    let path = tracking::Track::seen_along(&Vector3::from_row_slice(&axis), track.times.clone(), &positions)?;

    let band = [MINUTE * options.positive("shortest"), MINUTE * options.positive("longest")];
    let share = MINUTE * options.positive("share");
    let name = if track.name.is_empty() { file.to_owned() } else { format!("track '{}'", track.name) };
    println!("{name}: {} positions in {:.2} h", track.times.len(), path.duration() / HOUR);
    let found = report::whole(&path, band, share)?;
    let (length, every) = (HOUR * options.positive("window"), HOUR * options.positive("every"));
    let rows = report::windows(&path, band, share, length, every)?;
    let mut table = Table::create(out.join("windows.csv"), &report::COLUMNS)?;
    rows.iter().try_for_each(|row| table.row(row))?;
    table.finish()?;
    let mut table = Table::create(out.join("ridge.csv"), &["t_s", "period_s", "amplitude_m", "direction_rad"])?;
    for (place, direction) in found.ridge.iter().zip(&found.direction) {
        table.row(&[place.time, place.period, place.ellipse.major, *direction])?;
    }
    table.finish()?;
    figures::draw(&out, &path, &found, &rows, length)?;
    println!("windows.csv, ridge.csv, path.svg, scalogram.svg and amplitude.svg are in {}", out.display());
    Ok(())
}

/// Reads `+x,-y`: a sign for each of the columns, by their names.
fn signs(text: &str, columns: &[&str]) -> Result<Vec<f64>, String> {
    let wrong = || format!("--axes is '{text}', but must give the signs of all columns, as in +{}", columns.join(",-"));
    let given: Vec<&str> = text.split(',').map(str::trim).collect();
    if given.len() != columns.len() {
        return Err(wrong());
    }
    let sign = |(axis, column): (&&str, &&str)| match axis.strip_suffix(column) {
        Some("+") => Ok(1.0),
        Some("-") => Ok(-1.0),
        _ => Err(wrong()),
    };
    given.iter().zip(columns).map(sign).collect()
}

/// The option that gives what is missing.
fn explained(file: &str, error: &TrackError) -> String {
    let hint = match error {
        TrackError::NotGiven(what) if what.starts_with("the time") => ": give --seconds",
        TrackError::NotGiven(what) if what.starts_with("the scale") => ": give --mm",
        TrackError::NotGiven(_) => ": give --axes, as in +x,-y for an image whose y points down",
        TrackError::NoColumn(..) => ": --time, --columns and --tracks name them",
        _ => "",
    };
    format!("{file}: {error}{hint}")
}

/// The track of a name, or the first.
fn chosen<'a>(tracks: &'a [Track], name: &str) -> Result<&'a Track, String> {
    let names: Vec<&str> = tracks.iter().map(|track| track.name.as_str()).collect();
    let found = if name.is_empty() { tracks.first() } else { tracks.iter().find(|track| track.name == name) };
    found.ok_or_else(|| format!("there is no track '{name}'; there are '{}'", names.join("', '")))
}

/// Writes the curvature along all centre lines of a file.
fn curvatures(file: &str, layout: &Layout, track: &str, width: f64, out: &Path) -> Result<(), Box<dyn Error>> {
    let lines = read_centre_lines(file, layout, track).map_err(|error| explained(file, &error))?;
    let columns = ["t_s", "s_m", "curvature_x_per_m", "curvature_y_per_m", "curvature_z_per_m"];
    let mut table = Table::create(out.join("curvature.csv"), &columns)?;
    for line in &lines {
        let (number, width_mm) = (line.points.len(), width / M_PER_MM);
        let places = curvature(&line.points, width)
            .ok_or_else(|| format!("at {} s, {number} points are too few for a --width of {width_mm} mm", line.time))?;
        for place in places {
            let [x, y, z] = place.curvature;
            table.row(&[line.time, place.arc_length, x, y, z])?;
        }
    }
    table.finish()?;
    println!("{} centre lines; curvature.csv is in {}", lines.len(), out.display());
    Ok(())
}

fn main() -> ExitCode {
    common::finish(run())
}
