//! Data of the example, synthetic or read from a table.

use std::error::Error;

use morphorod::fit::{Estimates, Parameter, Series, View};
use morphorod::{DynLaws, Shoot};
use nalgebra::{Vector2, Vector3};

use super::plants::{Draw, Plant, Seen};
use morphorod_plot::tracks::Layout;
use morphorod_plot::{Options, println, track_options};

const HOUR: f64 = 3600.0;
const MM_PER_M: f64 = 1e3;

/// Largest number of centre lines in the figure.
const SHOWN: usize = 8;

/// Directions of the coordinates of the data.
#[derive(Clone, Copy, PartialEq)]
enum Shown {
    /// Two directions: their indices in space, and the indices of these coordinates in the data.
    Plane([usize; 2], [usize; 2]),
    /// One direction over time: its index in space.
    Along(usize),
    /// Angle of the tip over time.
    Angle,
}

/// Time (h), and points in the units of the axes.
pub type Timed = (f64, Vec<[f64; 2]>);

/// Data in the form in which the figures show them.
pub struct Points {
    /// Times of the frames, s.
    pub times: Vec<f64>,
    /// Points of each frame.
    pub points: Vec<Timed>,
    /// Labels of the axes.
    pub axes: [&'static str; 2],
    /// Whether the data are centre lines.
    pub lines: bool,
    shown: Shown,
    // Whether the data have all three coordinates.
    space: bool,
}

impl Points {
    fn new(series: &Series, shown: Shown, lines: bool, space: bool) -> Self {
        let name = |index: usize| ["x (mm)", "y (mm)", "z (mm)"][index];
        let axes = match shown {
            Shown::Plane([a, b], _) => [name(a), name(b)],
            Shown::Along(a) => ["time (h)", name(a)],
            Shown::Angle => ["time (h)", "angle (degrees)"],
        };
        let times = series.times().to_vec();
        let mut points = Self {
            times,
            points: Vec::new(),
            axes,
            lines,
            shown,
            space,
        };
        for (index, (time, frame)) in series.times().iter().zip(series.frames()).enumerate() {
            // The data of a view with fewer than three coordinates are the first coordinates of a
            // point.
            let point = |p: &Vector3<f64>| match shown {
                Shown::Plane(_, [a, b]) => [MM_PER_M * p[a], MM_PER_M * p[b]],
                Shown::Along(_) => [time / HOUR, MM_PER_M * p.x],
                Shown::Angle => [time / HOUR, p.x.to_degrees()],
            };
            if !lines || points.has_line(index) {
                points
                    .points
                    .push((time / HOUR, frame.iter().map(point).collect()));
            }
        }
        points
    }

    /// Place in space (m) of a measured point. Coordinates that the view does not show are those of
    /// the fitted place. `None` for angles.
    pub fn place(
        &self,
        measured: &Vector3<f64>,
        fitted: Vector3<f64>,
        found: &Estimates,
    ) -> Option<Vector3<f64>> {
        let (axes, columns): (&[usize], &[usize]) = match &self.shown {
            _ if self.space => (&[0, 1, 2], &[0, 1, 2]),
            Shown::Plane(axes, columns) => (axes, columns),
            Shown::Along(axis) => (std::slice::from_ref(axis), &[0]),
            Shown::Angle => return None,
        };
        let mut place = fitted;
        for (axis, column) in axes.iter().zip(columns) {
            place[*axis] = measured[*column] - offset(found, *column);
        }
        Some(place)
    }

    /// Whether both axes are directions in space.
    pub fn is_plane(&self) -> bool {
        matches!(self.shown, Shown::Plane(..))
    }

    /// Whether the data are angles.
    pub fn is_angle(&self) -> bool {
        self.shown == Shown::Angle
    }

    /// Whether the fitted centre line at the time with an index is drawn.
    pub fn has_line(&self, index: usize) -> bool {
        self.lines && index.is_multiple_of(self.times.len().div_ceil(SHOWN))
    }

    /// Image of a position (m, fixed frame) in the units of the axes. For one direction, the first
    /// component is zero.
    pub fn image(&self, p: &Vector3<f64>, found: &Estimates) -> [f64; 2] {
        match self.shown {
            Shown::Plane([a, b], [i, j]) => [
                MM_PER_M * (p[a] + offset(found, i)),
                MM_PER_M * (p[b] + offset(found, j)),
            ],
            Shown::Along(a) => [0.0, MM_PER_M * (p[a] + offset(found, 0))],
            Shown::Angle => [0.0; 2],
        }
    }

    /// Point of the figure for the tip of a shoot, in the units of the axes.
    pub fn tip(&self, shoot: &Shoot<DynLaws>, found: &Estimates) -> [f64; 2] {
        let [x, y] = self.image(&shoot.tip(), found);
        let tangent = shoot.rod().apex_frame() * Vector3::z();
        match self.shown {
            Shown::Plane(..) => [x, y],
            Shown::Along(_) => [shoot.time() / HOUR, y],
            Shown::Angle => [shoot.time() / HOUR, tangent.z.atan2(tangent.x).to_degrees()],
        }
    }
}

/// Names of the coordinates of the base in the view.
const ORIGIN: [&str; 3] = ["x_0", "y_0", "z_0"];

/// Coordinate of the base in the view, m.
fn offset(found: &Estimates, index: usize) -> f64 {
    found
        .get(ORIGIN[index])
        .map_or(0.0, |estimate| estimate.value)
}

/// Data, their points in the figures, and the parameters of the camera.
type Data = (Series, Points, Vec<Parameter>);

/// Synthetic data of a shoot with the given parameter values. `setting` contains the duration (h),
/// the time between frames (s) and the time step (s); `noise` is in metres.
pub fn synthetic(
    plant: Plant,
    values: &[f64],
    setting: [f64; 3],
    seen: Seen,
    noise: f64,
    draw: &mut Draw,
) -> Result<Data, Box<dyn Error>> {
    let series = plant.measured(values, setting, seen, noise, draw)?;
    let shown = if seen == Seen::Above { [0, 1] } else { [0, 2] };
    let points = Points::new(
        &series,
        Shown::Plane(shown, shown),
        seen == Seen::Lines,
        seen != Seen::Above,
    );
    Ok((series, points, Vec::new()))
}

/// Data of the tables that the options name. The time of the start of the shoot becomes zero.
pub fn read(options: &Options) -> Result<Data, Box<dyn Error>> {
    let mut layout = track_options::layout(options)?;
    let (shown, view) = view(options, &layout)?;
    if shown == Shown::Angle {
        layout.metres = Some(options.positive("degrees").to_radians());
    }
    let lines = options.flag("centre-lines");
    let (times, frames): (Vec<f64>, Vec<Vec<[f64; 3]>>) = if lines {
        let found = track_options::centre_lines(options, &layout)?;
        found
            .into_iter()
            .map(|line| (line.time, line.points))
            .unzip()
    } else {
        let tracks = track_options::tracks(options.text("file"), &layout)?;
        let track = track_options::chosen(&tracks, options.text("track"))?;
        (
            track.times.clone(),
            track.positions.iter().map(|p| vec![*p]).collect(),
        )
    };
    let start = if options.flag("start-time") {
        layout.seconds.unwrap_or(1.0) * options.get::<f64>("start-time")
    } else {
        times.first().copied().unwrap_or(0.0)
    };
    let omitted = HOUR * options.get_if("omit", "0 or larger", |hours: &f64| *hours >= 0.0);
    let count = times.len();
    let keep = |k: &usize| {
        times[*k] - start >= omitted
            && !(options.flag("omit-repeated") && *k > 0 && frames[*k] == frames[*k - 1])
    };
    let kept: Vec<usize> = (0..times.len()).filter(keep).collect();
    let (times, frames): (Vec<f64>, Vec<_>) = kept
        .iter()
        .map(|k| (times[*k] - start, frames[*k].clone()))
        .unzip();
    if kept.len() < count {
        println!("{} of {count} frames are omitted", count - kept.len());
    }
    let first_coordinates = || frames.iter().flatten().map(|p| p[0]).collect::<Vec<_>>();
    let series = match shown {
        Shown::Angle => Series::angles(times, &first_coordinates(), view),
        Shown::Along(_) => Series::coordinates(times, &first_coordinates(), view),
        Shown::Plane(..) if layout.coordinates.len() == 2 => {
            let plane =
                |frame: &Vec<[f64; 3]>| frame.iter().map(|p| Vector2::new(p[0], p[1])).collect();
            Series::centre_lines_in(times, &frames.iter().map(plane).collect::<Vec<_>>(), view)
        }
        Shown::Plane(..) => {
            let space = |frame: &Vec<[f64; 3]>| frame.iter().map(|p| Vector3::from(*p)).collect();
            Series::centre_lines(times, frames.iter().map(space).collect())
        }
    };
    let points = Points::new(&series, shown, lines, layout.coordinates.len() == 3);
    if !options.flag("origin") {
        return Ok((series, points, Vec::new()));
    }
    let names = &ORIGIN[..layout.coordinates.len()];
    let parameters = names
        .iter()
        .map(|name| Parameter::linear(name, [-1.0, 1.0]))
        .collect();
    Ok((series.with_offset(names), points, parameters))
}

/// Directions of the coordinates of a table, and their view.
fn view(options: &Options, layout: &Layout) -> Result<(Shown, View), Box<dyn Error>> {
    let (name, count) = (options.text("view"), layout.coordinates.len());
    let along = |index: usize| -> Result<(Shown, View), Box<dyn Error>> {
        Ok((
            Shown::Along(index),
            View::matrix(&[Vector3::ith(index, 1.0)])?,
        ))
    };
    match (name, count) {
        ("above" | "side", 3) => {
            let shown = if name == "above" { [0, 1] } else { [0, 2] };
            Ok((Shown::Plane(shown, shown), View::space()))
        }
        ("above", 2) => Ok((Shown::Plane([0, 1], [0, 1]), View::above())),
        ("side", 2) => Ok((Shown::Plane([0, 2], [0, 1]), View::side())),
        ("x", 1) => along(0),
        ("y", 1) => along(1),
        ("z", 1) => along(2),
        ("angle", 1) if !options.flag("degrees") => {
            Err("--view angle needs the unit of the angles: --degrees 1, or 57.29578 for rad".into())
        }
        ("angle", 1) => Ok((Shown::Angle, View::side())),
        _ => Err(format!(
            "--view is '{name}' for {count} columns: give above or side for two or three; x, y, z or angle for one"
        )
        .into()),
    }
}
