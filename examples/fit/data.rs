//! Data of the example: synthetic, or read from a table.

use std::error::Error;

use morphorod::fit::{Estimates, Parameter, Series, View};
use nalgebra::{Vector2, Vector3};

use super::M_PER_MM;
use super::common::Options;
use super::common::centre_lines::read_centre_lines;
use super::common::tracks::{Layout, read_tracks};
use super::plants::{Draw, Plant, Seen};

/// Number of centre lines in the figure.
const SHOWN: usize = 8;

/// Data as the figures show them.
pub struct Points {
    pub times: Vec<f64>,
    /// Points in two coordinates, m.
    pub points: Vec<[f64; 2]>,
    pub lines: bool,
    pub axes: [&'static str; 2],
    /// Time from one frame to the next, s.
    pub interval: f64,
    above: bool,
}

impl Points {
    /// Whether the fitted centre line at the time with an index is drawn.
    pub fn shown(&self, index: usize) -> bool {
        self.lines && index.is_multiple_of(self.times.len().div_ceil(SHOWN))
    }

    /// Coordinates of a position (m, fixed frame) in the view.
    pub fn seen(&self, p: &Vector3<f64>, found: &Estimates) -> [f64; 2] {
        let offset = |name: &str| found.get(name).map_or(0.0, |estimate| estimate.value);
        [p.x + offset("x_0"), if self.above { p.y } else { p.z } + offset("y_0")]
    }

    fn new(times: &[f64], frames: &[Vec<[f64; 2]>], lines: bool, above: bool) -> Self {
        let axes = if above { ["x (mm)", "y (mm)"] } else { ["x (mm)", "z (mm)"] };
        let interval =
            if times.len() > 1 { (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64 } else { 0.0 };
        let mut points = Self { times: times.to_vec(), points: Vec::new(), lines, axes, interval, above };
        for (index, frame) in frames.iter().enumerate() {
            if !lines || points.shown(index) {
                points.points.extend(frame);
            }
        }
        points
    }
}

type Data = (Series, Points, Vec<Parameter>);

/// Data of a shoot with the given parameter values.
pub fn synthetic(
    plant: Plant,
    values: &[f64],
    setting: [f64; 3],
    seen: Seen,
    noise: f64,
    draw: &mut Draw,
) -> Result<Data, Box<dyn Error>> {
    let series = plant.measured(values, setting, seen, noise, draw)?;
    let above = seen == Seen::Above;
    let flat = |p: &Vector3<f64>| [p.x, if above { p.y } else { p.z }];
    let frames: Vec<Vec<[f64; 2]>> = series.frames().iter().map(|frame| frame.iter().map(flat).collect()).collect();
    let points = Points::new(series.times(), &frames, seen == Seen::Lines, above);
    Ok((series, points, Vec::new()))
}

/// Data of the tables that the options name. Times are counted from the first one.
pub fn read(options: &Options) -> Result<Data, Box<dyn Error>> {
    let coordinates: Vec<&str> = options.text("columns").split(',').map(str::trim).collect();
    let given = |name: &str| options.flag(name).then(|| options.positive(name));
    let sign = |text: &str| if text.trim().starts_with('-') { -1.0 } else { 1.0 };
    let layout = Layout {
        time: options.text("time"),
        coordinates: coordinates.clone(),
        track: None,
        seconds: given("seconds"),
        metres: given("mm").map(|mm| M_PER_MM * mm),
        signs: options.flag("axes").then(|| options.text("axes").split(',').map(sign).collect()),
        length: None,
        gravity: None,
    };
    let lines = options.flag("centre-lines");
    let (times, frames): (Vec<f64>, Vec<Vec<[f64; 3]>>) = if lines {
        let found = read_centre_lines(options.text("centre-lines"), &layout, "")?;
        found.into_iter().map(|line| (line.time, line.points)).unzip()
    } else {
        let track = read_tracks(options.text("file"), &layout)?.swap_remove(0);
        (track.times, track.positions.into_iter().map(|p| vec![p]).collect())
    };
    let start = times.first().copied().unwrap_or(0.0);
    let times: Vec<f64> = times.iter().map(|time| time - start).collect();
    let above = match options.text("view") {
        "above" => true,
        "side" => false,
        other => return Err(format!("there is no view '{other}': give above or side").into()),
    };
    let plane = coordinates.len() == 2;
    let flat = |p: &[f64; 3]| [p[0], if plane || above { p[1] } else { p[2] }];
    let shown: Vec<Vec<[f64; 2]>> = frames.iter().map(|frame| frame.iter().map(flat).collect()).collect();
    let points = Points::new(&times, &shown, lines, above);
    let view = if above { View::above() } else { View::side() };
    let series = if plane {
        let frames: Vec<Vec<Vector2<f64>>> =
            shown.iter().map(|frame| frame.iter().map(|p| Vector2::from(*p)).collect()).collect();
        Series::centre_lines_in(times, &frames, view)
    } else {
        let frames = frames.iter().map(|frame| frame.iter().map(|p| Vector3::from(*p)).collect()).collect();
        Series::centre_lines(times, frames)
    };
    if !options.flag("origin") {
        return Ok((series, points, Vec::new()));
    }
    let names: &[&str] = if plane { &["x_0", "y_0"] } else { &["x_0", "y_0", "z_0"] };
    let parameters = names.iter().map(|name| Parameter::linear(name, [-1.0, 1.0])).collect();
    Ok((series.with_offset(names), points, parameters))
}
