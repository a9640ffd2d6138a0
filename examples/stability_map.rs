//! Stability boundaries of an upright shoot in the plane of growth time and length.
//!
//! This example reproduces figure 4 of Agostinelli, DeSimone and Noselli (2021), *Nutations in
//! Plant Shoots*, Front. Plant Sci. 12:608005. The upright shoot of the reduced model is a steady
//! state: its length is constant, and differential growth acts everywhere. It is stable if all
//! characteristic roots have negative real parts. On each curve of the map, one pair of roots lies
//! on the imaginary axis. There are three kinds of shoot:
//!
//! - *A: gravitropism alone*, without proprioception.
//! - *B: microgravity*: proprioception alone, without weight.
//! - *C: both responses*: gravitropism and proprioception, with weight.
//!
//! # Results
//! The first picture has the boundary of each kind as a solid curve, and those of the two other
//! kinds as dashed, dotted or dash-dotted curves. The shoot is stable to the right of the solid
//! curve and unstable in the grey area. Lengths are divided by the self-buckling length ℓc of
//! Greenhill (1881). In A and C, oscillations begin below this length. The critical length increases
//! with the growth time. In B, all lengths become unstable at the same growth time, which the
//! program also computes for eight lengths from 1 to 20 cm. The markers are the three numbers that
//! the paper states.
//!
//! The second picture has all modes:
//!
//! - Curve 1 is the mode with the longest wavelength. Its period is 87.6 min at every point of the
//!   curve.
//! - Curves 2 and 3 are modes of shorter wavelength. In A, curve 2 is the boundary for short
//!   shoots. There are infinitely many further modes of this kind.
//! - Curves f are modes with short periods (11.7, 6.0 and 4.0 min) close to ℓc. The phase lag of
//!   the delayed response contains one, two or three additional full cycles.
//! - Curve ∞ is the *essential spectrum*. In B, modes of all wavelengths become unstable at the
//!   same growth time, independently of the length. In C, curves 1, 2, 3, … approach this line for
//!   short shoots, and infinitely many roots are unstable to the left of it.
//!
//! A curve is dashed where other roots are unstable.
//!
//! # Options
//! `--tolerance 1e-4` computes the curves on coarser meshes in less time. Each curve is followed on
//! a coarse mesh and corrected on finer meshes up to the tolerance. The column `mesh_error` is the
//! estimated relative error of the length (in B, of the growth time). The column `others_unstable`
//! is NaN where the mesh does not resolve the number of other unstable roots; the other curves then
//! determine whether a curve is dashed. The example `onset` shows the roots for one growth time.

#[path = "stability_map/curves.rs"]
mod curves;

use std::cell::Cell;
use std::error::Error;
use std::process::ExitCode;
use std::time::Instant;

use curves::{Cost, Curve, HOUR, Kind, Start, WINDOW, curves_of, greenhill, is_right_of};
use morphorod::stability::{Crossing, Refinement, StabilityError, onset};
use morphorod::{ShootParameters, ensemble};
use morphorod_plot::{Axes, Figure, Opt, Options, Series, Style, Table, println};

const MINUTE: f64 = 60.0;

/// Name of a mode in the picture, its label in the legend, and its colour.
type Mode = (&'static str, &'static str, usize);
/// Modes with long periods, and the relative lengths at which their names are placed.
const SLOW: [(Mode, f64); 3] = [
    (("1", "mode with the longest wavelength", 0), 0.72),
    (("2", "second wavelength", 1), 0.8),
    (("3", "third wavelength", 2), 0.91),
];
/// Modes with short periods, and the growth times, h, at which their names are placed so that they
/// do not overlap.
const FAST: (Mode, [f64; 3]) = (
    ("f", "modes with periods of 12 min and less", 5),
    [2.6, 1.25, 1.8],
);
/// Essential spectrum.
const ESSENTIAL: (Mode, f64) = (("∞", "essential spectrum: all wavelengths", 6), 0.72);

/// Lengths of shoots in microgravity, cm.
const LENGTHS: [f64; 8] = [1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0];
/// Line of each boundary in the panels of the other kinds.
const OTHERS: [Style; 3] = [Style::Dashed, Style::Dotted, Style::DashDot];
/// Relative length at which the name of each boundary is placed.
const BADGES: [f64; 3] = [0.75, 0.5, 0.62];
/// Places in each panel, growth time (h) and relative length, at which the texts do not cover
/// curves. In B there is no room for the second.
const STABLE: (f64, f64) = (21.0, 0.42);
const UNSTABLE: [Option<(f64, f64)>; 3] = [Some((11.0, 0.95)), None, Some((11.0, 0.95))];
const UNSTABLE_WITH_MODES: [Option<(f64, f64)>; 3] = [Some((2.6, 0.88)), None, Some((17.0, 0.95))];

/// Returns one point on each curve of a panel, and the number of linearisations. `micro` is the
/// onset in microgravity.
fn starts(kind: Kind, micro: &Crossing<1>) -> Result<(Vec<Start>, usize), StabilityError> {
    if kind.weightless {
        return Ok((vec![([micro.parameters[0], 0.6], micro.frequency)], 0));
    }
    // Curve 1, then all other curves that cross one horizontal line.
    let linearisations = Cell::new(0);
    let at = |hours: f64, ratio: f64, n: usize| {
        linearisations.set(linearisations.get() + 1);
        kind.at(hours, ratio, n)
    };
    let main = onset(|ratio| at(20.0, ratio, kind.refinement.first), 0.3, 0.99)?;
    let mut starts = vec![([20.0, main.parameters[0]], main.frequency)];
    // The modes with short periods are close to the self-buckling length at every growth time.
    let fast = kind.crossings(|ratio, n| at(20.0, ratio, n), 0.99, 0.9995)?;
    let quickest = if kind.parameters.proprioceptive_sensitivity > 0.0 {
        5.5
    } else {
        6.5
    };
    let others = kind.crossings(|hours, n| at(hours, 0.985, n), quickest, 60.0)?;
    starts.extend(
        fast.iter()
            .map(|at| ([20.0, at.parameters[0]], at.frequency)),
    );
    // These modes cross the horizontal line, too. Their periods are constant along the curves.
    let known = |at: &Crossing<1>| {
        fast.iter()
            .any(|other| (other.frequency / at.frequency - 1.0).abs() < 0.01)
    };
    let others: Vec<Crossing<1>> = others.into_iter().filter(|at| !known(at)).collect();
    let place = |at: &Crossing<1>| ([at.parameters[0], 0.985], at.frequency);
    starts.extend(others.iter().rev().map(place));
    Ok((starts, linearisations.get()))
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "stability_map",
        "stability boundaries of an upright shoot in the plane of growth time and length",
        &[Opt::value(
            "tolerance",
            "X",
            "3e-7",
            "largest relative error of growth time and length due to the mesh",
        )],
    );
    let tolerance = options.get_if("tolerance", "between 1e-9 and 1", |x: &f64| {
        *x >= 1e-9 && *x < 1.0
    });
    let refinement = Refinement::to(tolerance);
    let out = options.out_dir();
    let kind = |beta, eta, weightless| Kind {
        parameters: ShootParameters {
            gravitropic_sensitivity: beta,
            proprioceptive_sensitivity: eta,
            ..ShootParameters::default()
        },
        weightless,
        refinement,
    };
    let kinds = [
        ("A: gravitropism alone", kind(0.8, 0.0, false)),
        ("B: microgravity", kind(0.0, 20.0, true)),
        ("C: both responses", kind(0.8, 20.0, false)),
    ];
    let [_, weightless, both] = kinds.map(|(_, kind)| kind);
    let clock = Instant::now();
    let mut cost = Cost::default();

    // The three numbers that the paper states.
    let micro = refinement.onset(|hours, n| weightless.at(hours, 0.6, n), 2.0, 6.0)?;
    println!(
        "microgravity: critical growth time {:.8} h (paper: 3.5 h)",
        micro.parameters[0]
    );
    let thresholds = LENGTHS.map(|cm| {
        refinement.onset(
            |hours, n| weightless.at(hours, 0.01 * cm / greenhill(), n),
            2.0,
            6.0,
        )
    });
    let mut spread = 0.0_f64;
    for threshold in thresholds {
        spread = spread.max((threshold?.parameters[0] / micro.parameters[0] - 1.0).abs());
    }
    println!(
        "microgravity: {} lengths from {} to {} cm, largest relative difference {spread:.1e}",
        LENGTHS.len(),
        LENGTHS[0],
        LENGTHS[LENGTHS.len() - 1]
    );
    let mut stated = vec![(micro.parameters[0], 0.6)];
    for (hours, paper) in [(20.0, 6.56), (40.0, 7.24)] {
        let at = refinement.onset(|ratio, n| both.at(hours, ratio, n), 0.3, 0.99)?;
        let length = 100.0 * at.parameters[0] * greenhill();
        println!(
            "growth time {hours} h: critical length {length:.8} cm (paper: {paper} cm), period {:.4} min",
            at.period() / MINUTE
        );
        stated.push((hours, at.parameters[0]));
    }

    let columns = [
        "panel",
        "branch",
        "growth_time_s",
        "length_m",
        "period_s",
        "others_unstable",
        "mesh_error",
        "elements",
    ];
    let mut table = Table::create(out.join("stability_map.csv"), &columns)?;
    let mut modes: Vec<Vec<Series>> = Vec::new();
    let mut boundaries: Vec<Vec<(f64, f64)>> = Vec::new();
    // The panels are computed concurrently, so that all cores are used.
    let found = ensemble::collect(
        kinds.len(),
        kinds.len(),
        |k| -> Result<(Vec<Curve>, usize), StabilityError> {
            let (starts, linearisations) = starts(kinds[k].1, &micro)?;
            Ok((curves_of(kinds[k].1, &starts)?, linearisations))
        },
    );
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
            for ((point, unstable), error) in points.iter().zip(&curve.unstable).zip(&curve.errors)
            {
                let [hours, ratio] = point.parameters;
                let (others, first) = match unstable {
                    Some(number) => (*number, *number == 0.0),
                    // The mesh does not resolve the number. The other curves determine the style.
                    None => (
                        f64::NAN,
                        !curves
                            .iter()
                            .any(|other| is_right_of(other, point.parameters)),
                    ),
                };
                let period = point.period();
                let (length, elements) = (ratio * greenhill(), point.elements as f64);
                table.row(&[
                    panel as f64,
                    branch as f64,
                    HOUR * hours,
                    length,
                    period,
                    others,
                    *error,
                    elements,
                ])?;
                // Each point belongs to one of the two styles; NaN is a gap in the other.
                pieces[usize::from(first)].push((hours, ratio));
                pieces[usize::from(!first)].push((f64::NAN, f64::NAN));
                edge.extend(first.then_some((hours, ratio)));
            }
            let periods: Vec<f64> = points.iter().map(|p| p.period() / MINUTE).collect();
            let (least, most) = periods
                .iter()
                .fold((f64::INFINITY, 0.0_f64), |(a, b), p| (a.min(*p), b.max(*p)));
            let elements = points.iter().map(|p| p.elements).max().unwrap_or_default();
            let error = curve.errors.iter().copied().fold(0.0, f64::max);
            println!(
                "{name}, branch {branch}: {} points, periods {least:.1} to {most:.1} min, at most {elements} elements, \
                 error {error:.1e}",
                points.len()
            );
            // The name is placed at a given growth time (axis 0) or relative length (axis 1).
            let ((badge, label, colour), axis, place) = if kind.weightless {
                (ESSENTIAL.0, 1, ESSENTIAL.1)
            } else if most < 20.0 {
                quick += 1;
                (FAST.0, 0, FAST.1[(quick - 1) % 3])
            } else {
                slow += 1;
                let (mode, ratio) = SLOW[(slow - 1).min(2)];
                (mode, 1, ratio)
            };
            let off = |p: &Crossing<2>| (p.parameters[axis] - place).abs();
            let named = points.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
            let [dashed, solid] = pieces;
            let drawn = [
                Series::new(label, solid, Style::Line, colour).with_badge(badge),
                Series::new("", dashed, Style::Dashed, colour),
            ];
            // In the legend, modes with long periods come first.
            if axis == 1 {
                series.extend(drawn)
            } else {
                swift.extend(drawn)
            }
            badges.extend(
                named.map(|p| Series::text(badge, p.parameters.into(), Style::Badge, colour)),
            );
        }
        series.extend(swift);
        series.extend(badges);
        edge.sort_by(|a, b| a.1.total_cmp(&b.1));
        boundaries.push(edge);
        modes.push(series);
    }
    table.finish()?;
    println!(
        "{} points, largest relative error {:.1e}, {} linearisations, {:.2} s",
        cost.points,
        cost.error,
        cost.linearisations,
        clock.elapsed().as_secs_f64()
    );

    let names = kinds.map(|(name, _)| name);
    let figure = |file: &str, title: &str| Figure::new(out.join(file), title);
    let draw = |figure: Figure, panels: &[Vec<Series>]| {
        let panels: Vec<(&str, &[Series])> = names
            .iter()
            .zip(panels)
            .map(|(name, series)| (*name, series.as_slice()))
            .collect();
        figure.panels(
            "growth time τg (h)",
            "length / self-buckling length, ℓ/ℓc",
            &panels,
            Axes::LogX,
        )
    };
    draw(
        figure(
            "stability_map.svg",
            "Stability boundaries of an upright shoot",
        ),
        &compared(&names, &boundaries, &stated),
    )?;
    // In C, the essential spectrum is that in B.
    let ((badge, _, colour), at) = ESSENTIAL;
    let essential = modes[1][0].points.clone();
    modes[2].extend([
        Series::new("", essential, Style::Dashed, colour),
        Series::text(badge, (micro.parameters[0], at), Style::Badge, colour),
        Series::new(
            "dashed: other roots are unstable",
            Vec::new(),
            Style::Dashed,
            6,
        ),
    ]);
    for (panel, series) in modes.iter_mut().enumerate() {
        series.extend(background(
            panel,
            &boundaries[panel],
            UNSTABLE_WITH_MODES[panel],
        ));
    }
    draw(figure("modes.svg", "Modes on the imaginary axis"), &modes)?;
    println!(
        "wrote stability_map.csv, stability_map.svg and modes.svg to {}",
        out.display()
    );
    Ok(())
}

/// Unstable area of a panel, which extends to the left of its boundary and above it, and the texts.
fn background(panel: usize, boundary: &[(f64, f64)], unstable: Option<(f64, f64)>) -> Vec<Series> {
    let [[left, bottom], [right, _]] = WINDOW;
    // In A and C all shoots of the self-buckling length are unstable.
    let end = boundary
        .last()
        .map_or(right, |last| if panel == 1 { last.0 } else { right });
    let mut area = boundary.to_vec();
    area.extend([(end, 1.0), (left, 1.0), (left, bottom)]);
    let mut series = vec![
        Series::new("unstable: a small tilt grows", area, Style::Area, 6),
        Series::text("stable", STABLE, Style::Text, 6),
    ];
    series.extend(unstable.map(|place| Series::text("unstable", place, Style::Text, 6)));
    series
}

/// Panels as in figure 4 of the paper: the boundary of the own kind, and those of the others.
fn compared(
    names: &[&str; 3],
    boundaries: &[Vec<(f64, f64)>],
    stated: &[(f64, f64)],
) -> Vec<Vec<Series>> {
    let badges = ["A", "B", "C"];
    let mut panels = Vec::new();
    for own in 0..3 {
        let mut series = Vec::new();
        for (kind, boundary) in boundaries.iter().enumerate() {
            let (style, colour) = if kind == own {
                (Style::Line, 6)
            } else {
                (OTHERS[kind], kind)
            };
            series.push(Series::new("", boundary.clone(), style, colour));
            // The boundaries do not cross at these heights.
            let off = |point: &(f64, f64)| (point.1 - BADGES[kind]).abs();
            let named = boundary.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
            series.extend(
                named.map(|place| Series::text(badges[kind], *place, Style::Badge, colour)),
            );
        }
        series.extend(background(own, &boundaries[own], UNSTABLE[own]));
        panels.push(series);
    }
    // The legend has each line once.
    let entry = |label: String, style, colour| Series::new(label, Vec::new(), style, colour);
    panels[0].push(entry("solid: kind of the panel".into(), Style::Line, 6));
    for (kind, name) in names.iter().enumerate() {
        let (badge, name) = name.split_once(": ").unwrap_or(("", name));
        panels[0].push(entry(name.into(), OTHERS[kind], kind).with_badge(badge));
    }
    panels[1].push(Series::new("", stated[..1].to_vec(), Style::Points, 3));
    panels[2].push(Series::new(
        "values stated in the paper",
        stated[1..].to_vec(),
        Style::Points,
        3,
    ));
    panels
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
