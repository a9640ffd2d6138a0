//! Printed results and figures.

use std::error::Error;
use std::path::Path;

use morphorod::tracking::{Pattern, Track};

use super::orbits::{Orbits, Rates};
use super::{ACROSS, HOUR, MINUTE, PULSE, Record, WINDOW};
use morphorod_plot::{Figure, FramedPanel, Orbit, Series, Strip, Style, Table, println};

/// Prints the oscillations before the second pulse, after it, and at the end.
pub fn print(record: &Record, track: &Track, end: f64, exact: Option<[f64; 3]>) {
    for (name, to) in [
        ("before the second pulse", ACROSS),
        ("after the second pulse", ACROSS + PULSE + WINDOW),
        ("at the end", end),
    ] {
        let Some(found) = record.analyse(track, to - WINDOW, to) else {
            println!(
                "{name}: no analysis, it requires {} h without a pulse",
                WINDOW / HOUR
            );
            continue;
        };
        let Some(first) = found.oscillations.first() else {
            continue;
        };
        let kind = match found.pattern() {
            Pattern::Pendular => "pendular",
            Pattern::Elliptic => "elliptic",
            Pattern::Circular => "circular",
            _ => "two periods",
        };
        let ellipse = first.ellipse;
        let sense = ellipse
            .sense
            .map_or("no definite sense".into(), |sense| sense.to_string());
        println!(
            "{name}, {:.1} to {:.1} h: {kind}, {sense}, period {:.5} min, \
             semi-axes {:.5} and {:.5} mm, roundness {:.6}",
            (to - WINDOW) / HOUR,
            to / HOUR,
            first.period / MINUTE,
            1e3 * ellipse.major,
            1e3 * ellipse.minor,
            ellipse.roundness()
        );
        if let (true, Some([radius, _, period])) = (to == end && ellipse.roundness() > 0.9, exact) {
            println!(
                "  reference: period {:.7} min, radius {:.6} mm; relative differences {:.0e} and {:.0e}",
                period / MINUTE,
                1e3 * radius,
                (first.period / period - 1.0).abs(),
                (0.5 * (ellipse.major + ellipse.minor) / radius - 1.0).abs()
            );
        }
    }
    if let (Some(tip), Some(twist)) = (record.tips.last(), record.twist.last()) {
        let height = exact.map_or(String::new(), |exact| {
            format!(" (reference: {:.6} mm)", 1e3 * exact[1])
        });
        println!(
            "at the end: height of the tip {:.6} mm{height}, largest twist {twist:.1e} 1/m",
            1e3 * tip.z
        );
    }
}

/// Prints the periodic orbits of the undisturbed shoot with the growth rates of their disturbances.
pub fn print_orbits(found: &Result<Orbits, Box<dyn Error>>, has_proprioception: bool) {
    let orbits = match found {
        Ok(orbits) => orbits,
        Err(error) => return println!("periodic orbits of the undisturbed shoot: none, {error}"),
    };
    let per_hour = |rate: f64| format!("{:+.5}", HOUR * rate);
    let modulations = |rates: &Rates| match &rates.modulations[..] {
        [] => "smaller than the others".to_owned(),
        some => some
            .iter()
            .map(|rate| per_hour(*rate))
            .collect::<Vec<_>>()
            .join(" and "),
    };
    let stability = |unstable: bool| if unstable { "unstable" } else { "stable" };
    println!(
        "periodic orbits of the undisturbed shoot, solved directly, growth rates of disturbances per h:"
    );
    let rates = &orbits.circular_rates;
    println!(
        "  circular: period {:.6} min, radius {:.6} mm: {}; modulations {}, others at most {}",
        orbits.circle.period() / MINUTE,
        1e3 * orbits.circle.radius(),
        stability(rates.unstable()),
        modulations(rates),
        per_hour(rates.others)
    );
    let [inside, outside] = &orbits.planar_rates;
    println!(
        "  planar: period {:.6} min, excursion {:.6} mm: {}; modulations {} in its plane and {} out of it, others \
         at most {}",
        orbits.planar_period / MINUTE,
        1e3 * orbits.planar_excursion,
        stability(inside.unstable() || outside.unstable()),
        modulations(inside),
        modulations(outside),
        per_hour(inside.others.max(outside.others))
    );
    if !has_proprioception {
        println!(
            "  without proprioception the others, short waves, accumulate at zero from below; the largest depends on \
             the mesh"
        );
    }
}

/// Draws the tip track, the shapes, and semi-axes and period over time.
pub fn draw(
    out: &Path,
    record: &Record,
    track: &Track,
    end: f64,
    exact: Option<[f64; 3]>,
) -> Result<(), Box<dyn Error>> {
    let (opens, rounds) = (ACROSS + 8.0 * HOUR, end - 4.0 * HOUR);
    let parts = [
        ("first pulse: planar", 0.0, ACROSS.min(end)),
        ("second pulse: elliptic", ACROSS, opens.min(end)),
        ("increasingly circular", opens, rounds),
        ("end of the run", rounds.max(opens), end),
    ];
    let orbits: Vec<Orbit> = parts
        .iter()
        .map(|(name, from, to)| Orbit {
            name: format!("{name}, {:.0} to {:.0} h", from / HOUR, to / HOUR),
            path: record.between(*from, *to),
            behind: Vec::new(),
        })
        .filter(|orbit| orbit.path.len() > 1)
        .collect();
    Figure::new(out.join("tip.svg"), "Tip track, top view").orbits(&orbits)?;

    let period = exact.map_or(90.0 * MINUTE, |exact| exact[2]);
    let panel = |name, end| FramedPanel::of_period(name, &record.shapes, end / HOUR, period / HOUR);
    let mut panels = vec![panel("planar oscillation", ACROSS.min(end))];
    if end > opens {
        panels.push(panel("circular oscillation", end));
    }
    let title = "Eight shapes in one period, with directors at base and tip";
    Figure::new(out.join("shapes.svg"), title).frames(&panels)?;

    let mut table = Table::create(
        out.join("cycle.csv"),
        &[
            "t_s",
            "period_s",
            "semi_major_m",
            "semi_minor_m",
            "roundness",
        ],
    )?;
    let (mut major, mut minor, mut periods) = (Vec::new(), Vec::new(), Vec::new());
    let mut middle = 0.5 * WINDOW;
    while middle + 0.5 * WINDOW <= end {
        let (from, to) = (middle - 0.5 * WINDOW, middle + 0.5 * WINDOW);
        let found = record
            .analyse(track, from, to)
            .and_then(|found| found.oscillations.first().copied());
        // The curves have a gap where no analysis is possible.
        let hours = middle / HOUR;
        let [a, b, period] = found.map_or([f64::NAN; 3], |wave| {
            [wave.ellipse.major, wave.ellipse.minor, wave.period]
        });
        major.push((hours, 1e3 * a));
        minor.push((hours, 1e3 * b));
        periods.push((hours, period / MINUTE));
        if found.is_some() {
            table.row(&[middle, period, a, b, b / a])?;
        }
        middle += 2.0 * HOUR;
    }
    table.finish()?;
    let (Some(from), Some(to)) = (major.first().map(|p| p.0), major.last().map(|p| p.0)) else {
        return Ok(());
    };
    let level = |value: f64| {
        Series::new(
            "reference: circular orbit",
            vec![(from, value), (to, value)],
            Style::Dashed,
            6,
        )
    };
    let mut axes = vec![
        Series::new("semi-major axis", major, Style::Marked, 0),
        Series::new("semi-minor axis", minor, Style::Marked, 1),
    ];
    let mut time = vec![Series::new("period", periods, Style::Marked, 2)];
    if let Some([radius, _, period]) = exact {
        axes.push(level(1e3 * radius));
        time.push(level(period / MINUTE));
    }
    let strips = [
        Strip {
            label: "semi-axes (mm)",
            series: &axes,
        },
        Strip {
            label: "period (min)",
            series: &time,
        },
    ];
    Figure::new(
        out.join("cycle.svg"),
        "Oscillation of the tip, from windows of 8 h without a pulse",
    )
    .strips("time (h)", &strips)?;
    Ok(())
}
