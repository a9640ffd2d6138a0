//! Measurements as a table, as figures, and as a summary in a chapter.

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use morphorod_plot::file::write_between_marks;
use morphorod_plot::table::duration;
use morphorod_plot::{Axes, Figure, Series, Style, println};

/// Errors below this are rounding errors, which show no order of convergence.
pub const ROUNDING: f64 = 2e-13;

/// Result of one setting.
pub struct Point {
    pub setting: String,
    /// True error, relative to the length (or to the time, for the time of an event).
    pub error: f64,
    /// Relative error estimate of the integrator, if it returns one.
    pub estimate: Option<f64>,
    /// Run time, s.
    pub seconds: f64,
}

/// Results that differ in one setting.
pub struct Method {
    pub name: String,
    /// Whether the setting is a tolerance instead of a resolution.
    pub by_tolerance: bool,
    pub points: Vec<Point>,
}

/// Scene and its results.
pub struct Scene {
    pub name: &'static str,
    /// Description of the scene for titles.
    pub what: &'static str,
    /// Description of the error, for the axis of the figure.
    pub error: &'static str,
    pub methods: Vec<Method>,
}

impl Scene {
    pub fn print(&self) {
        println!("{}: {}", self.name, self.what);
        for method in &self.methods {
            for point in &method.points {
                let estimate = point
                    .estimate
                    .map_or(String::new(), |e| format!("  estimate {e:.1e}"));
                println!(
                    "  {:<24} {:<22} error {:.1e}  {:>10.3} ms{estimate}",
                    method.name,
                    point.setting,
                    point.error,
                    1e3 * point.seconds
                );
            }
        }
    }

    pub fn draw(&self, out: &Path) -> Result<(), Box<dyn Error>> {
        let series: Vec<Series> = self
            .methods
            .iter()
            .enumerate()
            .map(|(colour, method)| {
                let points = method
                    .points
                    .iter()
                    .map(|p| (1e3 * p.seconds, p.error.max(1e-17)))
                    .collect();
                Series::new(method.name.clone(), points, Style::Marked, colour)
            })
            .collect();
        let file = out.join(format!("{}.svg", self.name.replace(' ', "_")));
        let title = format!("Error against run time: {}", self.what);
        Figure::new(file, title).lines("run time (ms)", self.error, &series, Axes::LogLog)?;
        Ok(())
    }

    /// Shortest run time (s) in which a fixed resolution reaches an error, by logarithmic
    /// interpolation between settings.
    fn fixed_time(&self, error: f64) -> Option<f64> {
        let mut best: Option<f64> = None;
        for method in self.methods.iter().filter(|method| !method.by_tolerance) {
            for pair in method.points.windows(2) {
                let (a, b) = (&pair[0], &pair[1]);
                let time = if b.error <= error && error <= a.error && b.error < a.error {
                    let share = (a.error / error).ln() / (a.error / b.error.max(1e-17)).ln();
                    a.seconds * (b.seconds / a.seconds).powf(share)
                } else if a.error <= error {
                    a.seconds
                } else {
                    continue;
                };
                best = Some(best.map_or(time, |best| best.min(time)));
            }
        }
        best
    }

    /// Fastest fixed resolution whose error is at most `level`.
    fn fastest_fixed(&self, level: f64) -> Option<(&Method, &Point)> {
        let fixed = self.methods.iter().filter(|method| !method.by_tolerance);
        let points =
            fixed.flat_map(|method| method.points.iter().map(move |point| (method, point)));
        points
            .filter(|(_, p)| p.error <= level)
            .min_by(|(_, a), (_, b)| a.seconds.total_cmp(&b.seconds))
    }

    /// Result for the tolerance `level`.
    fn with_tolerance(&self, level: f64) -> Option<&Point> {
        let mut points = self
            .methods
            .iter()
            .filter(|method| method.by_tolerance)
            .flat_map(|method| &method.points);
        points.find(|point| point.setting == format!("tolerance {level:e}"))
    }

    /// Run times by tolerance, divided by that of the best fixed resolution with the same true
    /// error.
    fn ratios(&self) -> Vec<f64> {
        let points = self
            .methods
            .iter()
            .filter(|method| method.by_tolerance)
            .flat_map(|method| &method.points);
        points
            .filter_map(|p| Some(p.seconds / self.fixed_time(p.error.max(ROUNDING))?))
            .collect()
    }
}

pub fn print_ratios(scenes: &[Scene]) {
    println!("{}", ratios(scenes));
}

/// Sentences about the cost of runs by tolerance and about their estimates.
fn ratios(scenes: &[Scene]) -> String {
    let mut text = String::new();
    let mut ratios: Vec<f64> = scenes.iter().flat_map(Scene::ratios).collect();
    ratios.sort_by(f64::total_cmp);
    if let (Some(worst), Some(median)) = (ratios.last(), ratios.get(ratios.len() / 2)) {
        text += &format!(
            "Run time by tolerance, divided by that of the best fixed resolution with the same true error: \
             median {median:.1}, largest {worst:.1}. "
        );
    }
    let mut quality: Vec<f64> = scenes
        .iter()
        .flat_map(|scene| &scene.methods)
        .flat_map(|method| &method.points)
        .filter_map(|point| Some(point.estimate? / point.error.max(ROUNDING)))
        .collect();
    quality.sort_by(f64::total_cmp);
    if let (Some(least), Some(most)) = (quality.first(), quality.last()) {
        text += &format!("Estimate divided by true error: {least:.1} to {most:.0}.");
    }
    text
}

pub fn write_table(scenes: &[Scene], file: &Path) -> Result<(), Box<dyn Error>> {
    let mut text = "scene,method,setting,error,estimate,time_s\n".to_owned();
    for scene in scenes {
        for method in &scene.methods {
            for point in &method.points {
                let estimate = point.estimate.map_or(String::new(), |e| format!("{e:e}"));
                writeln!(
                    text,
                    "{},{},{},{:e},{estimate},{:e}",
                    scene.name, method.name, point.setting, point.error, point.seconds
                )?;
            }
        }
    }
    Ok(fs::write(file, text)?)
}

/// Errors for which the chapter compares a fixed resolution with a run by tolerance.
const LEVELS: [f64; 2] = [1e-4, 1e-6];

/// Writes a summary of the scenes that have runs by tolerance between the marks of a chapter.
pub fn write_chapter(scenes: &[Scene], file: &Path) -> Result<(), Box<dyn Error>> {
    let mut table = String::new();
    writeln!(
        table,
        "| scene | error | fixed resolution | time | true error by tolerance | estimate | time |"
    )?;
    writeln!(table, "|---|---|---|---|---|---|---|")?;
    for scene in scenes {
        for level in LEVELS {
            let Some(point) = scene.with_tolerance(level) else {
                continue;
            };
            let (setting, time) = match scene.fastest_fixed(level) {
                Some((method, fixed)) => (
                    format!("{}: {}", method.name, fixed.setting),
                    duration(fixed.seconds),
                ),
                None => ("–".to_owned(), "–".to_owned()),
            };
            let estimate = point
                .estimate
                .map_or("–".to_owned(), |e| format!("{e:.1e}"));
            writeln!(
                table,
                "| {} | {level:e} | {setting} | {time} | {:.1e} | {estimate} | {} |",
                capitalised(scene.name),
                point.error,
                duration(point.seconds)
            )?;
        }
    }
    Ok(write_between_marks(
        file,
        &format!("{table}\n{}", ratios(scenes)),
    )?)
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(letters).collect()
    })
}
