//! Table and picture of a whole sweep.

use std::io;
use std::path::Path;

use super::grid::Grid;
use super::point::{COLUMNS, LAST, Numbers, buckling_length};
use crate::common::file::write_whole;
use crate::common::table::number;
use crate::common::{Map, Series, Style, map_figure};

/// Lengths are shown in centimetres and amplitudes in millimetres.
const CM_PER_M: f64 = 1e2;
const MM_PER_M: f64 = 1e3;
const HOUR: f64 = 3600.0;
/// Amplitudes at the ends of the colour bar, mm: a swing that nobody sees, and more than any shoot of the map can swing.
const LIMITS: [f64; 2] = [1e-4, 1e2];

/// Writes all points as one table.
///
/// # Errors
/// Those of the file system.
pub fn write_table(file: &Path, rows: &[Vec<Numbers>]) -> io::Result<()> {
    let mut text = format!("{}\n", COLUMNS.join(","));
    for point in rows.iter().flatten() {
        text += &format!("{}\n", point.map(number).join(","));
    }
    write_whole(file, text)
}

/// Draws the map: amplitudes by colour, over them where the growth rate is zero. `onsets` are critical lengths, m, one for each
/// row where there is one.
///
/// # Errors
/// Those of the file system.
pub fn draw(file: &Path, grid: &Grid, rows: &[Vec<Numbers>], onsets: &[Option<f64>]) -> io::Result<()> {
    let etas = grid.etas.values();
    let place = |length: f64, eta: f64| (CM_PER_M * length, eta);
    let curve = onsets.iter().zip(&etas).map(|(length, eta)| place(length.unwrap_or(f64::NAN), *eta)).collect();
    let buckling = [etas[0], etas[etas.len() - 1]].map(|eta| place(buckling_length(), eta));
    let amplitudes: Vec<f64> = rows.iter().flatten().map(|point| MM_PER_M * point[COLUMNS.len() - 1]).collect();
    let mut over = vec![
        Series::new("onset: the growth rate of small swings is zero", curve, Style::Line, 6),
        Series::new("from here on the shoot buckles under its weight", buckling.to_vec(), Style::Dashed, 1),
    ];
    if amplitudes.iter().any(|amplitude| amplitude.is_nan()) {
        let label = "the shoot curls up, and the elements do not follow";
        over.push(Series::new(label, Vec::new(), Style::Area, 0));
    }
    let hours = grid.time / HOUR;
    let map = Map {
        axes: ["length of the shoot (cm)", "proprioceptive sensitivity η (1)"],
        points: [grid.lengths.values().iter().map(|length| CM_PER_M * length).collect(), etas],
        log: false,
        values: amplitudes,
        label: &format!("tip's largest swing in the last {} h (mm)", LAST.min(grid.time) / HOUR),
        limits: LIMITS,
    };
    map_figure(file, &format!("What becomes of a small kick within {hours} hours"), &map, &over)
}
