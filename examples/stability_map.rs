//! When does an upright shoot begin to oscillate? The map of growth time against length, for three kinds of shoot.
//!
//! This is figure 4 of Agostinelli, DeSimone and Noselli (2021), *Nutations in Plant Shoots*, Front. Plant Sci. 12:608005.
//! The upright shoot of the reduced model (all of it differentiates, none of it elongates) is always in equilibrium. It
//! stays upright if every small tilt dies out. If not, the delay between sensing and growing makes it swing: a root of
//! its characteristic matrix has crossed the imaginary axis. Each curve is where one root does.
//!
//! - *A, gravity alone*: the shoot senses gravity but not its own bending.
//! - *B, microgravity*: it senses its bending but not gravity, and has no weight.
//! - *C, both*.
//!
//! # What to see
//! Right of the solid curves the shoot is stable, in the grey area it is not. Lengths are in units of Greenhill's ℓc, where an upright shoot buckles
//! under its weight whatever it senses; in A and C oscillations begin before that, sooner the faster the shoot grows.
//! Curve 1, which rises up to ℓc, is a swing of the whole shoot, with the same period of 87.6 min at every point of it. 2 and
//! 3 are shorter waves, and f, close to ℓc, fast ones (11.7, 6.0, 4.0 min) that answer one turn too late, or two, or three.
//! They are dashed where something else is unstable already; in A one of them is the boundary for short shoots. There are
//! infinitely many more.
//! In B (curve ∞) waves of every length become unstable at once, at the same growth time whatever the shoot's length: not
//! a root crosses but the *essential spectrum*. It does so in C, too: the branches pile up at this line, and left of it
//! infinitely many roots are unstable.
//!
//! The markers are the three numbers that the paper prints.
//!
//! # What to try
//! `--tolerance 1e-4`: how many elements do the curves need, and how long does it take? Fast growth makes short waves; each
//! curve is followed with few elements and corrected with as many as it needs. The column `mesh_error` is what the mesh puts the
//! length off, relative to it (in B the growth time), as the crate estimates it. Where the count of other unstable roots is not resolved, the
//! column `others_unstable` says NaN, and what is dashed is told by the other curves. The example `onset` looks at
//! one growth time more closely.

mod common;
#[path = "stability_map/curves.rs"]
mod curves;

use std::cell::Cell;
use std::error::Error;
use std::panic::resume_unwind;
use std::process::ExitCode;
use std::time::Instant;

use common::{Axes, Opt, Options, Series, Style, Table, panels_figure};
use curves::{Cost, Curve, HOUR, Kind, Start, WINDOW, curves_of, greenhill, is_right_of};
use morphorod::stability::{Crossing, Refinement, StabilityError, onset};
use morphorod::tropism::Memory;

const MINUTE: f64 = 60.0;

/// A wave that has a curve: its name in the picture, label in the legend, and colour.
type Wave = (&'static str, &'static str, usize);
/// Waves with a slow swing, and the length over Greenhill's at which their names stand.
const WAVES: [(Wave, f64); 3] = [
    (("1", "the whole shoot swings, slowly", 0), 0.72),
    (("2", "a shorter wave", 1), 0.8),
    (("3", "one that is shorter still", 2), 0.91),
];
/// Fast swings, and growth times, h, at which their names stand: next to each other, as the curves are close.
const FAST: (Wave, [f64; 3]) = (("f", "fast swings, a turn or more too late", 5), [2.6, 1.25, 1.8]);
/// The essential spectrum.
const ESSENTIAL: (Wave, f64) = (("∞", "waves of every length at once", 6), 0.72);

/// A place on every curve of a panel, and the number of linearisations. `micro` is the onset in weightlessness.
fn starts(kind: Kind, micro: &Crossing<1>) -> Result<(Vec<Start>, usize), StabilityError> {
    if kind.weightless {
        return Ok((vec![([micro.parameters[0], 0.6], micro.frequency)], 0));
    }
    // The lowest branch, then all others that cross one line.
    let linearisations = Cell::new(0);
    let at = |hours: f64, ratio: f64, n: usize| {
        linearisations.set(linearisations.get() + 1);
        kind.at(hours, ratio, n)
    };
    let main = onset(|ratio| at(20.0, ratio, kind.refinement.first), 0.3, 0.99)?;
    let mut starts = vec![([20.0, main.parameters[0]], main.frequency)];
    // The fast one comes close to Greenhill's length at any growth time.
    let fast = kind.crossings(|ratio, n| at(20.0, ratio, n), 0.99, 0.9995)?;
    let quickest = if kind.proprioception > 0.0 { 5.5 } else { 6.5 };
    let others = kind.crossings(|hours, n| at(hours, 0.985, n), quickest, 60.0)?;
    starts.extend(fast.iter().map(|at| ([20.0, at.parameters[0]], at.frequency)));
    // The fast ones cross that line, too; they have the same period everywhere.
    let known = |at: &Crossing<1>| fast.iter().any(|other| (other.frequency / at.frequency - 1.0).abs() < 0.01);
    let others: Vec<Crossing<1>> = others.into_iter().filter(|at| !known(at)).collect();
    let place = |at: &Crossing<1>| ([at.parameters[0], 0.985], at.frequency);
    starts.extend(others.iter().rev().map(place));
    Ok((starts, linearisations.get()))
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "stability_map",
        "boundaries of stability of an upright shoot, growth time against length",
        &[Opt::value("tolerance", "X", "3e-7", "largest error of the mesh, relative to growth time and length")],
    );
    let tolerance = options.get_if("tolerance", "between 1e-9 and 1", |x: &f64| *x >= 1e-9 && *x < 1.0);
    let refinement = Refinement::to(tolerance);
    let out = options.out_dir();
    let kind = |gravitropism, proprioception, weightless| Kind {
        gravitropism,
        proprioception,
        weightless,
        memory: Memory { time: 12.0 * MINUTE, delay: 12.0 * MINUTE },
        refinement,
    };
    let kinds = [
        ("A: gravity alone", kind(0.8, 0.0, false)),
        ("B: microgravity", kind(0.0, 20.0, true)),
        ("C: both", kind(0.8, 20.0, false)),
    ];
    let [_, weightless, both] = kinds.map(|(_, kind)| kind);
    let clock = Instant::now();
    let mut cost = Cost::default();

    // The three numbers of the paper.
    let micro = refinement.onset(|hours, n| weightless.at(hours, 0.6, n), 2.0, 6.0)?;
    println!("microgravity: growth time    {:.8} h, paper 3.5 h", micro.parameters[0]);
    let mut printed = vec![(micro.parameters[0], 0.6)];
    for (hours, paper) in [(20.0, 6.56), (40.0, 7.24)] {
        let at = refinement.onset(|ratio, n| both.at(hours, ratio, n), 0.3, 0.99)?;
        let length = 100.0 * at.parameters[0] * greenhill();
        println!(
            "both, {hours} h: critical length {length:.8} cm, paper {paper} cm, period {:.4} min",
            at.period() / MINUTE
        );
        printed.push((hours, at.parameters[0]));
    }

    let columns =
        ["panel", "branch", "growth_time_s", "length_m", "period_s", "others_unstable", "mesh_error", "elements"];
    let mut table = Table::create(out.join("stability_map.csv"), &columns)?;
    let mut panels: Vec<(&str, Vec<Series>)> = Vec::new();
    // The panels at once: what one core is at when the others are done is short.
    let found = std::thread::scope(|scope| {
        let threads = kinds.map(|(_, kind)| {
            scope.spawn(move || -> Result<(Vec<Curve>, usize), StabilityError> {
                let (starts, linearisations) = starts(kind, &micro)?;
                Ok((curves_of(kind, &starts)?, linearisations))
            })
        });
        threads.map(|thread| thread.join().unwrap_or_else(|panic| resume_unwind(panic)))
    });
    for (panel, ((name, kind), found)) in kinds.into_iter().zip(found).enumerate() {
        let mut series = Vec::new();
        let (mut swift, mut badges) = (Vec::new(), Vec::new());
        let mut edge: Vec<(f64, f64)> = Vec::new();
        let (mut slow, mut quick) = (0, 0);
        let (curves, linearisations) = found?;
        cost.linearisations += linearisations;
        for (branch, curve) in curves.iter().enumerate() {
            cost.add(curve);
            let points = &curve.points;
            let mut pieces: [Vec<(f64, f64)>; 2] = [Vec::new(), Vec::new()];
            for ((point, unstable), error) in points.iter().zip(&curve.unstable).zip(&curve.errors) {
                let [hours, ratio] = point.parameters;
                let (others, first) = match unstable {
                    Some(number) => (*number, *number == 0.0),
                    // The mesh does not tell; the other curves do, as far as they are known.
                    None => (f64::NAN, !curves.iter().any(|other| is_right_of(other, point.parameters))),
                };
                let period = point.period();
                let (length, elements) = (ratio * greenhill(), point.elements as f64);
                table.row(&[panel as f64, branch as f64, HOUR * hours, length, period, others, *error, elements])?;
                // Each point is drawn once; the other style has a gap there.
                pieces[usize::from(first)].push((hours, ratio));
                pieces[usize::from(!first)].push((f64::NAN, f64::NAN));
                edge.extend(first.then_some((hours, ratio)));
            }
            let periods: Vec<f64> = points.iter().map(|p| p.period() / MINUTE).collect();
            let (least, most) = periods.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), p| (a.min(*p), b.max(*p)));
            let elements = points.iter().map(|p| p.elements).max().unwrap_or_default();
            let error = curve.errors.iter().copied().fold(0.0, f64::max);
            println!(
                "{name}, branch {branch}: {} points, periods {least:.1} to {most:.1} min, {elements} elements, error {error:.1e}",
                points.len()
            );
            // The name stands at a place along one of the axes.
            let ((badge, label, colour), axis, place) = if kind.weightless {
                (ESSENTIAL.0, 1, ESSENTIAL.1)
            } else if most < 20.0 {
                quick += 1;
                (FAST.0, 0, FAST.1[(quick - 1) % 3])
            } else {
                slow += 1;
                let (wave, ratio) = WAVES[(slow - 1).min(2)];
                (wave, 1, ratio)
            };
            let off = |p: &Crossing<2>| (p.parameters[axis] - place).abs();
            let named = points.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
            let [dashed, solid] = pieces;
            let drawn = [
                Series::new(label, solid, Style::Line, colour).with_badge(badge),
                Series::new("", dashed, Style::Dashed, colour),
            ];
            // In the legend the slow ones come first.
            if axis == 1 {
                series.extend(drawn)
            } else {
                swift.extend(drawn)
            }
            badges.extend(named.map(|p| Series::text(badge, p.parameters.into(), Style::Badge, colour)));
        }
        series.extend(swift);
        series.extend(badges);
        // Unstable is what lies left of the solid curves and above them.
        edge.sort_by(|a, b| a.1.total_cmp(&b.1));
        let [[left, bottom], [right, _]] = WINDOW;
        let end = if kind.weightless { micro.parameters[0] } else { right };
        edge.extend([(end, 1.0), (left, 1.0), (left, bottom)]);
        let area = if panel == 2 { "unstable: small tilts grow" } else { "" };
        series.push(Series::new(area, edge, Style::Area, 6));
        // Where there is room for it between the curves; the legend says it of the grey area, too.
        if let Some(place) = [Some((2.6, 0.88)), None, Some((17.0, 0.95))][panel] {
            series.push(Series::text("unstable", place, Style::Text, 6));
        }
        series.push(Series::text("stable", (21.0, 0.42), Style::Text, 6));
        panels.push((name, series));
    }
    table.finish()?;
    println!(
        "{} points of curves off by {:.1e} of their length at most, {} linearisations, {:.2} s",
        cost.points,
        cost.error,
        cost.linearisations,
        clock.elapsed().as_secs_f64()
    );

    // In C the essential spectrum is that of B.
    let ((badge, _, colour), at) = ESSENTIAL;
    let essential = panels[1].1[0].points.clone();
    panels[2].1.push(Series::new("", essential, Style::Dashed, colour));
    panels[2].1.push(Series::text(badge, (micro.parameters[0], at), Style::Badge, colour));
    panels[2].1.push(Series::new("dashed: something else is unstable already", Vec::new(), Style::Dashed, 6));
    panels[1].1.push(Series::new("", printed[..1].to_vec(), Style::Points, 3));
    panels[2].1.push(Series::new("numbers that the paper prints", printed[1..].to_vec(), Style::Points, 3));
    let panels: Vec<(&str, &[Series])> = panels.iter().map(|(name, series)| (*name, series.as_slice())).collect();
    panels_figure(
        out.join("stability_map.svg"),
        "Where an upright shoot begins to oscillate",
        "growth time (h)",
        "length over Greenhill's, ℓ/ℓc",
        &panels,
        Axes::LogX,
    )?;
    println!("stability_map.csv and stability_map.svg are in {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    common::finish(run())
}
