//! Results as text, as a table and as a figure.

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::{EXPERIMENTS, Experiment};
use morphorod_plot::table::duration;
use morphorod_plot::{Axes, Figure, Series, Style, println};

/// Errors below this are shown at this value.
const LEAST: f64 = 1e-13;

/// Programs.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Program {
    Morphorod,
    PyElastica,
    MuJoCo,
}

impl Program {
    const ALL: [Self; 3] = [Self::Morphorod, Self::PyElastica, Self::MuJoCo];

    fn name(self) -> &'static str {
        match self {
            Self::Morphorod => "morphorod",
            Self::PyElastica => "PyElastica 1.0.0",
            Self::MuJoCo => "MuJoCo 3.13.0",
        }
    }
}

/// Result of a program on one mesh.
pub struct Row {
    pub experiment: &'static str,
    /// Dimensionless tension T ℓ²/B of the experiment `twist`.
    pub tension: Option<f64>,
    pub program: Program,
    /// Number of elements.
    pub elements: usize,
    /// Relative difference from the reference of the benchmark.
    pub error: f64,
    /// Relative difference from a fine mesh, if the reference of the benchmark is an approximation.
    pub discretisation: Option<f64>,
    /// Run time, s.
    pub seconds: f64,
}

/// Bisects an interval at whose upper end, but not at whose lower end, a condition holds.
pub fn bisected((mut low, mut high): (f64, f64), condition: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if condition(middle) {
            high = middle
        } else {
            low = middle
        }
    }
    0.5 * (low + high)
}

pub fn print(experiment: &Experiment, rows: &[Row]) {
    println!("{}", experiment.title);
    for row in rows {
        let tension = row
            .tension
            .map_or(String::new(), |tension| format!("tension {tension:>2}, "));
        let elements = format!("{tension}{} elements", row.elements);
        let alone = row
            .discretisation
            .map_or(String::new(), |e| format!("  discretisation alone {e:.1e}"));
        let (name, seconds) = (row.program.name(), duration(row.seconds));
        println!(
            "  {name:<17} {elements:<24} error {:.1e} {seconds:>9}{alone}",
            row.error
        );
    }
}

pub fn write_table(rows: &[Row], file: &Path) -> Result<(), Box<dyn Error>> {
    let mut text =
        "experiment,tension,program,elements,relative_error,discretisation_error,time_s\n"
            .to_owned();
    let optional = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:e}"));
    for row in rows {
        let (tension, alone) = (optional(row.tension), optional(row.discretisation));
        let (name, elements) = (row.program.name(), row.elements);
        writeln!(
            text,
            "{},{tension},{name},{elements},{:e},{alone},{:e}",
            row.experiment, row.error, row.seconds
        )?;
    }
    Ok(fs::write(file, text)?)
}

/// Draws error against run time, with one panel for each experiment.
pub fn draw(rows: &[Row], file: &Path) -> Result<(), Box<dyn Error>> {
    let panels: Vec<(&str, Vec<Series>)> = EXPERIMENTS
        .iter()
        .map(|experiment| (experiment.title, series(experiment.name, rows)))
        .collect();
    let panels: Vec<(&str, &[Series])> = panels
        .iter()
        .map(|(title, series)| (*title, &series[..]))
        .collect();
    let title = "Error against run time of static experiments";
    Figure::new(file, title).panels("run time (s)", "relative error (1)", &panels, Axes::LogLog)?;
    Ok(())
}

/// Series of an experiment: meshes of one program and case are joined by a line.
fn series(experiment: &str, rows: &[Row]) -> Vec<Series> {
    let mut all = Vec::new();
    for (colour, program) in Program::ALL.into_iter().enumerate() {
        let of = |row: &&Row| row.experiment == experiment && row.program == program;
        let mut cases: Vec<Option<f64>> = rows.iter().filter(of).map(|row| row.tension).collect();
        cases.dedup();
        for case in cases {
            let shown: Vec<&Row> = rows
                .iter()
                .filter(of)
                .filter(|row| row.tension == case)
                .collect();
            let points = shown
                .iter()
                .map(|row| (row.seconds, row.error.max(LEAST)))
                .collect();
            all.push(Series::new(program.name(), points, Style::Marked, colour));
            let points = shown
                .iter()
                .filter_map(|row| Some((row.seconds, row.discretisation?.max(LEAST))));
            let (points, name): (Vec<_>, _) = (
                points.collect(),
                format!("{}, discretisation alone", program.name()),
            );
            if !points.is_empty() {
                all.push(Series::new(name, points, Style::Dashed, colour));
            }
        }
    }
    all
}
