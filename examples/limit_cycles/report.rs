//! What came out, printed and drawn.

use std::error::Error;
use std::path::Path;

use morphorod::tracking::{Pattern, Track};

use super::common::{Orbit, Series, Strip, Style, Table, frames_figure, orbits_figure, strips_figure};
use super::{ACROSS, HOUR, MINUTE, PULL, Record, WINDOW};

/// Prints what the orbit is before the second pull, after it and at the end.
pub fn tell(record: &Record, path: &Track, end: f64, exact: Option<[f64; 3]>) {
    for (name, to) in [("in a plane", ACROSS), ("kicked across", ACROSS + PULL + WINDOW), ("at the end", end)] {
        let Some(found) = record.read(path, to - WINDOW, to) else {
            println!("{name}: left out, the run does not have {} h without a pull for it", WINDOW / HOUR);
            continue;
        };
        let Some(first) = found.oscillations.first() else { continue };
        let name_of = match found.pattern() {
            Pattern::Pendular => "pendular",
            Pattern::Elliptic => "elliptic",
            Pattern::Circular => "circular",
            _ => "of two periods",
        };
        let ellipse = first.ellipse;
        let sense = ellipse.sense.map_or("no sense".into(), |sense| format!("{sense:?}").to_lowercase());
        println!(
            "{name}, {:.1} to {:.1} h: {name_of}, every {:.5} min, semi-axes {:.5} and {:.5} mm, {sense}, roundness {:.6}",
            (to - WINDOW) / HOUR,
            to / HOUR,
            first.period / MINUTE,
            1e3 * ellipse.major,
            1e3 * ellipse.minor,
            ellipse.roundness()
        );
        if let (true, Some([radius, _, period])) = (to == end && ellipse.roundness() > 0.9, exact) {
            println!(
                "  exactly: every {:.7} min, radius {:.6} mm; off by {:.0e} and {:.0e} of it",
                period / MINUTE,
                1e3 * radius,
                (first.period / period - 1.0).abs(),
                (0.5 * (ellipse.major + ellipse.minor) / radius - 1.0).abs()
            );
        }
    }
    if let (Some(tip), Some(twist)) = (record.tips.last(), record.twist.last()) {
        let height = exact.map_or(String::new(), |exact| format!(", on the exact orbit {:.6} mm", 1e3 * exact[1]));
        println!("the tip is at last {:.6} mm high{height}; twist up to {twist:.1e} 1/m", 1e3 * tip.z);
    }
}

/// Draws the path, the shapes, and the orbit through time.
pub fn draw(
    out: &Path,
    record: &Record,
    path: &Track,
    end: f64,
    exact: Option<[f64; 3]>,
) -> Result<(), Box<dyn Error>> {
    let (opens, rounds) = (ACROSS + 8.0 * HOUR, end - 4.0 * HOUR);
    let parts = [
        ("kicked: in a plane", 0.0, ACROSS),
        ("kicked across: it opens", ACROSS, opens),
        ("it gets rounder", opens, rounds),
        ("the last four hours", rounds.max(opens), end),
    ];
    let orbits: Vec<Orbit> = parts
        .iter()
        .map(|(name, from, to)| Orbit { name, path: record.between(*from, *to), behind: Vec::new() })
        .filter(|orbit| orbit.path.len() > 1)
        .collect();
    orbits_figure(out.join("tip.svg"), "The path of the tip from above", &orbits)?;

    let period = exact.map_or(90.0 * MINUTE, |exact| exact[2]);
    let (first, last) = (record.turn(ACROSS.min(end), period), record.turn(end, period));
    let mut panels = vec![("a swing in a plane", first.as_slice())];
    if end > opens {
        panels.push(("a turn of the circle", last.as_slice()));
    }
    frames_figure(out.join("shapes.svg"), "Shapes in one period, with directors", &panels)?;

    let mut table =
        Table::create(out.join("cycle.csv"), &["t_s", "period_s", "semi_major_m", "semi_minor_m", "roundness"])?;
    let (mut major, mut minor, mut periods) = (Vec::new(), Vec::new(), Vec::new());
    let mut middle = 0.5 * WINDOW;
    while middle + 0.5 * WINDOW <= end {
        let (from, to) = (middle - 0.5 * WINDOW, middle + 0.5 * WINDOW);
        let found = record.read(path, from, to).and_then(|found| found.oscillations.first().copied());
        // Where there is none the curves have a gap.
        let hours = middle / HOUR;
        let [a, b, period] = found.map_or([f64::NAN; 3], |wave| [wave.ellipse.major, wave.ellipse.minor, wave.period]);
        major.push((hours, 1e3 * a));
        minor.push((hours, 1e3 * b));
        periods.push((hours, period / MINUTE));
        if found.is_some() {
            table.row(&[middle, period, a, b, b / a])?;
        }
        middle += 2.0 * HOUR;
    }
    table.finish()?;
    let (Some(from), Some(to)) = (major.first().map(|p| p.0), major.last().map(|p| p.0)) else { return Ok(()) };
    let level = |value: f64| Series::new("exact circle", vec![(from, value), (to, value)], Style::Dashed, 6);
    let mut axes = vec![
        Series::new("semi-major axis", major, Style::Marked, 0),
        Series::new("semi-minor axis", minor, Style::Marked, 1),
    ];
    let mut time = vec![Series::new("period", periods, Style::Marked, 2)];
    if let Some([radius, _, period]) = exact {
        axes.push(level(1e3 * radius));
        time.push(level(period / MINUTE));
    }
    let strips = [Strip { label: "semi-axes (mm)", series: &axes }, Strip { label: "period (min)", series: &time }];
    strips_figure(
        out.join("cycle.svg"),
        "The orbit, read over eight hours at a time: none where a kick lies between",
        "time (h)",
        &strips,
    )?;
    Ok(())
}
