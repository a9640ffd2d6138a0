//! Growth map: arc lengths of 17 material points of a growing shoot over time.
//!
//! A growth law determines the arc length of each material point without any mechanics. This
//! example reproduces figure 3 of Agostinelli, DeSimone and Noselli (2021), Front. Plant Sci.
//! 12:608005. A shoot of 1 cm grows in its last 3 cm with a growth time of 20 h.
//!
//! # Results
//! While the shoot is shorter than 3 cm, all tissue grows and the length increases exponentially.
//! Afterwards material points leave the growth zone one after the other and keep their arc length,
//! and the length increases linearly.
//!
//! # Options
//! `--profile linear` and `--profile cosine`: the growth rate is largest at the apex, or in the
//! middle of the growth zone. The arc lengths are then integrated numerically. Finally the apex has
//! the same velocity for all three profiles, because the mean growth rate in the zone is the same.

use std::error::Error;
use std::process::ExitCode;

use morphorod::growth::{CosineProfile, GrowthLaw, LinearProfile, UniformGrowth};
use morphorod_plot::{Axes, Figure, Opt, Options, Series, Style, Table, println};

const HOUR: f64 = 3600.0;
/// Length at t = 0, m.
const INITIAL: f64 = 0.01;
/// Number of material points, the first at the base and the last at the apex.
const POINTS: usize = 17;

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "growth_map",
        "arc lengths of 17 material points of a growing shoot",
        &[
            Opt::value("hours", "H", "60", "duration, h"),
            Opt::value(
                "profile",
                "NAME",
                "uniform",
                "profile of the growth rate: uniform, linear or cosine",
            ),
        ],
    );
    let hours = options.positive("hours");
    let name: String = options.get_if("profile", "uniform, linear or cosine", |p: &String| {
        ["uniform", "linear", "cosine"].contains(&p.as_str())
    });
    let out = options.out_dir();

    // A box is needed only because the law is chosen at run time.
    let (zone_length, time) = (0.03, 20.0 * HOUR);
    let law: Box<dyn GrowthLaw> = match name.as_str() {
        "linear" => Box::new(LinearProfile { zone_length, time }),
        "cosine" => Box::new(CosineProfile { zone_length, time }),
        _ => Box::new(UniformGrowth { zone_length, time }),
    };
    law.check(INITIAL)?;

    let starts: Vec<f64> = (0..POINTS)
        .map(|i| INITIAL * i as f64 / (POINTS - 1) as f64)
        .collect();
    let names: Vec<String> = (0..POINTS).map(|i| format!("s{i}_m")).collect();
    let mut columns = vec!["t_s", "length_m", "boundary_m"];
    columns.extend(names.iter().map(String::as_str));
    let mut table = Table::create(out.join("growth_map.csv"), &columns)?;
    let (mut paths, mut boundary) = (vec![Vec::new(); POINTS], Vec::new());
    for row in 0..=240 {
        let t = HOUR * hours * f64::from(row) / 240.0;
        let total = law.length(INITIAL, t);
        // The growth zone begins at the base while the shoot is shorter than the zone.
        let base_end = (total - zone_length).max(0.0);
        let places: Vec<f64> = starts
            .iter()
            .map(|start| law.trace(INITIAL, *start, t).arc_length)
            .collect();
        for (path, place) in paths.iter_mut().zip(&places) {
            path.push((t / HOUR, 100.0 * place));
        }
        if base_end > 0.0 {
            boundary.push((t / HOUR, 100.0 * base_end));
        }
        table.row(&[vec![t, total, base_end], places].concat())?;
    }
    table.finish()?;

    let mut series: Vec<Series> = paths
        .into_iter()
        .map(|path| Series::new("", path, Style::Line, 0))
        .collect();
    series[0].label = format!("{POINTS} material points from base to apex");
    series.push(Series::new(
        "lower end of the growth zone",
        boundary,
        Style::Dashed,
        1,
    ));
    let title = format!("Growth map, {name} profile of the growth rate");
    Figure::new(out.join("growth_map.svg"), title).lines(
        "time (h)",
        "arc length (cm)",
        &series,
        Axes::Linear,
    )?;

    println!(
        "{name} profile: length {:.1} cm at 0 h, {:.6} cm at {hours} h",
        100.0 * INITIAL,
        100.0 * law.length(INITIAL, hours * HOUR)
    );
    for start in starts.iter().step_by(4) {
        let end = law.trace(INITIAL, *start, hours * HOUR);
        let exit = end.exit_time.map_or("in the growth zone".into(), |t| {
            format!("left the zone at {:.4} h", t / HOUR)
        });
        println!(
            "  material point at {:.2} cm: finally at {:.6} cm, {exit}",
            100.0 * start,
            100.0 * end.arc_length
        );
    }
    println!(
        "wrote growth_map.csv and growth_map.svg to {}",
        out.display()
    );
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
