//! Table and picture of a complete sweep.

use std::io;
use std::path::Path;

use super::grid::Grid;
use super::point::{COLUMNS, LAST, Numbers, buckling_length};
use morphorod_plot::file::write_whole;
use morphorod_plot::table::number;
use morphorod_plot::{Figure, Map, Series, Style};

/// Factor from metres to centimetres, the unit of displayed lengths.
const CM_PER_M: f64 = 1e2;
/// Factor from metres to millimetres, the unit of displayed amplitudes.
const MM_PER_M: f64 = 1e3;
const HOUR: f64 = 3600.0;
/// Amplitudes at the ends of the colour bar, mm. The upper limit exceeds all lengths of the default
/// grid.
const LIMITS: [f64; 2] = [1e-4, 1e2];

/// Writes all points as one table.
///
/// # Errors
/// Returns errors of the file system.
pub fn write_table(file: &Path, rows: &[Vec<Numbers>]) -> io::Result<()> {
    let mut text = format!("{}\n", COLUMNS.join(","));
    for point in rows.iter().flatten() {
        text += &format!("{}\n", point.map(number).join(","));
    }
    write_whole(file, text)
}

/// Draws the amplitudes as colours, with the critical lengths and the self-buckling length.
/// `onsets` are the critical lengths of the rows, m.
///
/// # Errors
/// Returns errors of the file system.
pub fn draw(
    file: &Path,
    grid: &Grid,
    rows: &[Vec<Numbers>],
    onsets: &[Option<f64>],
) -> io::Result<()> {
    let etas = grid.etas.values();
    let point_at = |length: f64, eta: f64| (CM_PER_M * length, eta);
    let curve = onsets
        .iter()
        .zip(&etas)
        .map(|(length, eta)| point_at(length.unwrap_or(f64::NAN), *eta))
        .collect();
    let buckling = [etas[0], etas[etas.len() - 1]].map(|eta| point_at(buckling_length(), eta));
    let amplitudes: Vec<f64> = rows
        .iter()
        .flatten()
        .map(|point| MM_PER_M * point[COLUMNS.len() - 1])
        .collect();
    let mut over = vec![
        Series::new("onset of oscillations", curve, Style::Line, 6),
        Series::new(
            "self-buckling length (Greenhill)",
            buckling.to_vec(),
            Style::Dashed,
            1,
        ),
    ];
    if amplitudes.iter().any(|amplitude| amplitude.is_nan()) {
        let label = "no equilibrium on this mesh: strongly curved shoots";
        over.push(Series::new(label, Vec::new(), Style::Area, 0));
    }
    let hours = grid.time / HOUR;
    let map = Map {
        axes: ["length of the shoot (cm)", "proprioceptive sensitivity η"],
        points: [
            grid.lengths
                .values()
                .iter()
                .map(|length| CM_PER_M * length)
                .collect(),
            etas,
        ],
        log: false,
        values: amplitudes,
        label: &format!(
            "amplitude of the tip in the last {} h (mm)",
            LAST.min(grid.time) / HOUR
        ),
        limits: LIMITS,
    };
    Figure::new(
        file,
        format!("Oscillation amplitude {hours} h after a small perturbation"),
    )
    .map(&map, &over)
}
