//! Branches of periodic orbits along a parameter, and their stability.
//!
//! A shoot that is longer than the critical length oscillates, in a vertical plane (planar orbit)
//! or such that its tip describes a circle (circular orbit). In the simulations of Agostinelli,
//! DeSimone and Noselli (2021), Front. Plant Sci. 12:608005, planar orbits are transient and
//! circular orbits persist. This example solves the equations of both orbits directly, instead of
//! simulating until transients have decayed. It follows both branches along a parameter by
//! pseudo-arclength continuation, and computes the growth rates of disturbances (Floquet exponents)
//! at each point.
//!
//! # Results
//! Both branches begin at the onset of oscillations. Near the onset, the excursion of the tip grows
//! as the square root of the distance from it, and the excursion of the planar orbit is √(4/3)
//! times that of the circular orbit. All circular orbits are stable. All planar orbits are stable
//! against disturbances in their plane and unstable against disturbances out of it. The period of
//! the circular orbit depends only on the memories. The period of the planar orbit increases with
//! the length, near the onset with the fourth power of the excursion. The figure shows the
//! excursion A, its ratio to the exact radius R of the circular orbit, and the period.
//!
//! # Options
//! - `--over eta --from 15 --to 25` varies the proprioceptive sensitivity, `--over tau-g --from 18
//!   --to 24` the growth time.
//! - `--elements 8 --intervals 16` refines the discretisation, to check the accuracy of the
//!   default.

#[path = "limit_cycles/exact.rs"]
mod exact;

use std::error::Error;
use std::f64::consts::PI;
use std::io;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use exact::exact_orbit;
use morphorod::cycle::{
    Bifurcation, BranchPoint, Continuation, Disturbances, PeriodicSolver, RotatingWaveSolver,
};
use morphorod::stability::{Linearisation, onset};
use morphorod::{Model, ParameterError, Shoot, ShootParameters};
use morphorod_plot::figure::{Figure, Strip};
use morphorod_plot::{Opt, Options, Progress, Series, Style, Table, println};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
const MM: f64 = 1e-3;
/// Excursion of the tip in the first initial guess, m.
const FIRST: f64 = 4.0 * MM;

/// Range of the parameter divided by the length of the interval below its first value in which the
/// onset is located.
const BEFORE: f64 = 10.0;
/// Range of the parameter divided by its first step.
const FIRST_STEP: f64 = 100.0;
/// Excursion of planar orbits divided by that of circular orbits in the limit at the onset,
/// squared.
const PLANAR_RATIO_SQUARED: f64 = 4.0 / 3.0;

/// Family of shoots with one varied parameter.
struct Family {
    elements: usize,
    /// Name of the varied parameter.
    over: String,
    /// Length where another parameter is varied, cm.
    length: f64,
}

impl Family {
    fn parameters(&self, value: f64) -> ShootParameters {
        let of = |name: &str, default: f64| if self.over == name { value } else { default };
        ShootParameters {
            length: of("length", self.length) / 100.0,
            growth_time: HOUR * of("tau-g", 20.0),
            gravitropic_sensitivity: of("beta", 0.8),
            proprioceptive_sensitivity: of("eta", 20.0),
            ..ShootParameters::default()
        }
    }

    /// Returns the shoot of the reduced model, with settled statoliths.
    fn at(&self, value: f64) -> Result<Shoot<impl Model + use<>>, ParameterError> {
        let parameters = self.parameters(value);
        let nodes: Vec<f64> = (0..=self.elements)
            .map(|i| parameters.length * i as f64 / self.elements as f64)
            .collect();
        parameters.reduced().nodes(&nodes).build()
    }
}

/// Periodic orbit at one value of the parameter.
struct Sample {
    parameter: f64,
    /// Largest distance of the tip from the vertical through the base, m.
    excursion: f64,
    /// Period, s.
    period: f64,
    /// Growth rates of the two leading disturbances, 1/s, the larger one first. For planar orbits,
    /// one is in the plane and one out of it. NaN if no second one is computed.
    rates: [f64; 2],
    /// Number of unstable disturbances.
    unstable: usize,
    /// Largest modulus of the trivial exponents times the period. They are zero for exact orbits.
    defect: f64,
    iterations: usize,
    bifurcation: Option<Bifurcation>,
}

impl Sample {
    /// Converts a point of a branch. A full period of the orbit consists of `parts` periods of the
    /// solver.
    fn new<O>(point: &BranchPoint<O>, parts: f64, iterations: usize) -> Self {
        let mut rates: Vec<f64> = match &point.exponents {
            Disturbances::Planar {
                in_plane,
                out_of_plane,
            } => [in_plane, out_of_plane]
                .into_iter()
                .filter_map(|list| list.first())
                .map(|x| x.re)
                .collect(),
            // One exponent of each conjugate pair suffices.
            Disturbances::Spatial(all) => all
                .iter()
                .filter(|x| x.im >= 0.0)
                .map(|x| x.re)
                .take(2)
                .collect(),
        };
        rates.resize(2, f64::NAN);
        rates.sort_by(|a, b| b.total_cmp(a));
        Self {
            parameter: point.parameter,
            excursion: point.excursion,
            period: parts * point.period,
            rates: [rates[0], rates[1]],
            unstable: point.unstable(),
            defect: point.trivial,
            iterations,
            bifurcation: point.bifurcation,
        }
    }
}

/// Branches of circular and of planar orbits.
struct Branches {
    circular: Vec<Sample>,
    planar: Vec<Sample>,
    /// Parameter at the onset of oscillations, if it is close to the first value.
    onset: Option<f64>,
}

/// Range of the parameter and settings of the continuation.
struct Settings {
    from: f64,
    to: f64,
    /// Largest step along a branch.
    step: f64,
    /// Intervals of half a period.
    intervals: usize,
}

/// Follows both branches.
fn branches(family: &Family, settings: &Settings) -> Result<Branches, Box<dyn Error>> {
    let &Settings {
        from,
        to,
        step,
        intervals,
    } = settings;
    let progress = Progress::new("bifurcation");
    let done = |value: f64| progress.set(((value - from) / (to - from)).clamp(0.0, 1.0));
    let (within, first) = (from.min(to)..=from.max(to), (to - from) / FIRST_STEP);
    let at = |value: f64| Ok(family.at(value)?);
    let shoot = family.at(from)?;
    let root = Linearisation::about(&shoot)?.rightmost()?;

    let solver = RotatingWaveSolver::default();
    let circle = solver.from_mode(&shoot, &root, FIRST)?;
    let mut circular = Vec::new();
    for point in Continuation::from_orbit(solver, at, &circle, from, first, within.clone())?
        .largest_step(step)?
    {
        let point = point?;
        done(point.parameter);
        circular.push(Sample::new(&point, 1.0, point.orbit.iterations));
    }
    // After half a period, the shoot has its initial shape, rotated by π. Solving for half a period
    // halves the work.
    let solver = PeriodicSolver {
        intervals,
        angle: Some(PI),
        ..PeriodicSolver::default()
    };
    let start = solver.from_mode(&shoot, &root, PLANAR_RATIO_SQUARED.sqrt() * circle.radius())?;
    let mut planar = Vec::new();
    for point in
        Continuation::from_orbit(solver, at, &start, from, first, within)?.largest_step(step)?
    {
        let point = point?;
        done(point.parameter);
        planar.push(Sample::new(&point, 2.0, point.orbit.iterations));
    }
    progress.finish();
    let before = from - (to - from) / BEFORE;
    let onset = onset(
        |value| Linearisation::about(&family.at(value)?),
        before,
        from,
    )
    .ok();
    Ok(Branches {
        circular,
        planar,
        onset: onset.map(|found| found.parameters[0]),
    })
}

/// Writes both branches as a table.
fn write_table(file: &Path, branches: &Branches) -> io::Result<()> {
    let columns = [
        "circular",
        "parameter",
        "excursion_m",
        "period_s",
        "unstable_disturbances",
        "leading_rate_per_s",
        "next_rate_per_s",
        "newton_iterations",
        "trivial_defect",
    ];
    let mut table = Table::create(file, &columns)?;
    for (circular, samples) in [(1.0, &branches.circular), (0.0, &branches.planar)] {
        for Sample {
            parameter,
            excursion,
            period,
            rates,
            unstable,
            defect,
            iterations,
            ..
        } in samples
        {
            let (unstable, iterations) = (*unstable as f64, *iterations as f64);
            table.row(&[
                circular, *parameter, *excursion, *period, unstable, rates[0], rates[1],
                iterations, *defect,
            ])?;
        }
    }
    table.finish()
}

/// Series of a quantity along both branches: solid where the orbits are stable, with markers at
/// bifurcations.
fn lines(branches: &Branches, quantity: impl Fn(&Sample) -> f64) -> Vec<Series> {
    let Branches {
        circular, planar, ..
    } = branches;
    let mut series = Vec::new();
    for (colour, name, samples) in [(0, "circular orbit", circular), (1, "planar orbit", planar)] {
        let mut named = [false; 2];
        // Pieces between bifurcations. The point at a bifurcation belongs to both pieces.
        let mut from = 0;
        for to in 1..samples.len() {
            if samples[to].bifurcation.is_none() && to + 1 < samples.len() {
                continue;
            }
            // The stability of a piece is that of its inner points.
            let stable = samples[from..=to]
                .iter()
                .filter(|one| one.bifurcation.is_none())
                .all(|one| one.unstable == 0);
            let (words, style) = if stable {
                ("stable", Style::Line)
            } else {
                ("unstable", Style::Dashed)
            };
            let first = !std::mem::replace(&mut named[usize::from(stable)], true);
            let label = if first {
                format!("{name}, {words}")
            } else {
                String::new()
            };
            let points = samples[from..=to]
                .iter()
                .map(|one| (one.parameter, quantity(one)))
                .collect();
            series.push(Series::new(label, points, style, colour));
            from = to;
        }
    }
    let kinds = [
        Bifurcation::Fold,
        Bifurcation::Pitchfork,
        Bifurcation::PeriodDoubling,
        Bifurcation::Torus,
    ];
    for (colour, kind) in (2..).zip(kinds) {
        let here = circular
            .iter()
            .chain(planar)
            .filter(|one| one.bifurcation == Some(kind));
        let points: Vec<_> = here.map(|one| (one.parameter, quantity(one))).collect();
        if !points.is_empty() {
            series.push(Series::new(name_of(kind), points, Style::Points, colour));
        }
    }
    series
}

/// Draws excursion, its ratio to the exact circular orbit, and period.
fn draw(file: &Path, family: &Family, branches: &Branches) -> io::Result<()> {
    let unit = match family.over.as_str() {
        "length" => "length ℓ (cm)",
        "eta" => "proprioceptive sensitivity η",
        "beta" => "gravitropic sensitivity β",
        _ => "growth time τg (h)",
    };
    let radius =
        |parameter: f64| exact_orbit(&family.parameters(parameter)).map(|[radius, _]| radius);
    let mut excursions = lines(branches, |one| one.excursion / MM);
    let mut ratios = lines(branches, |one| {
        radius(one.parameter).map_or(f64::NAN, |exact| one.excursion / exact)
    });
    let some = branches.circular.iter().step_by(2);
    let exact = some
        .filter_map(|one| Some((one.parameter, radius(one.parameter)? / MM)))
        .collect();
    excursions.push(Series::new(
        "exact radius R of the circular orbit",
        exact,
        Style::Points,
        0,
    ));
    if let Some(onset) = branches.onset {
        let label = "onset of oscillations, with the limit √(4/3) of A/R for planar orbits";
        excursions.push(Series::new(label, vec![(onset, 0.0)], Style::Points, 6));
        ratios.push(Series::new(
            label,
            vec![(onset, PLANAR_RATIO_SQUARED.sqrt())],
            Style::Points,
            6,
        ));
    }
    let strips = [
        Strip {
            label: "excursion A (mm)",
            series: &excursions,
        },
        Strip {
            label: "A/R (1)",
            series: &ratios,
        },
        Strip {
            label: "period (min)",
            series: &lines(branches, |one| one.period / MINUTE),
        },
    ];
    Figure::new(
        file,
        "Circular and planar periodic orbits of a shoot, and their stability",
    )
    .strips(unit, &strips)
}

/// Prints the numbers of stable orbits, the bifurcations, and the first and the last orbit of each
/// branch.
fn print(branches: &Branches) {
    if let Some(onset) = branches.onset {
        println!("onset of oscillations: {onset:.6}");
    }
    for (name, samples) in [
        ("circular orbits", &branches.circular),
        ("planar orbits", &branches.planar),
    ] {
        let stable = samples.iter().filter(|one| one.unstable == 0).count();
        println!("{name}: {} computed, {stable} stable", samples.len());
        for (parameter, kind) in samples
            .iter()
            .filter_map(|one| Some((one.parameter, one.bifurcation?)))
        {
            println!("  at {parameter:.6}: {}", name_of(kind));
        }
        for one in [samples.first(), samples.last()].into_iter().flatten() {
            let rates = one.rates.iter().filter(|rate| rate.is_finite());
            let rates: Vec<String> = rates.map(|rate| format!("{:+.8}", HOUR * rate)).collect();
            println!(
                "  at {:.4}: excursion {:.8} mm, period {:.8} min, leading growth rates {} per h, error of the trivial \
                 exponents {:.0e}",
                one.parameter,
                one.excursion / MM,
                one.period / MINUTE,
                rates.join(" and "),
                one.defect,
            );
        }
    }
}

fn name_of(kind: Bifurcation) -> &'static str {
    match kind {
        Bifurcation::Fold => "fold",
        Bifurcation::Pitchfork => "pitchfork",
        Bifurcation::PeriodDoubling => "period doubling",
        Bifurcation::Torus => "torus bifurcation",
        _ => "another change of stability",
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "bifurcation",
        "branches of circular and planar periodic orbits along a parameter, and their stability",
        &[
            Opt::value(
                "over",
                "NAME",
                "length",
                "varied parameter: length (cm), eta, beta or tau-g (h)",
            ),
            Opt::value(
                "from",
                "X",
                "6.57",
                "first value of the parameter, beyond the onset of oscillations",
            ),
            Opt::value("to", "X", "7.6", "last value of the parameter"),
            Opt::value("step", "X", "0.044", STEP_HELP),
            Opt::value(
                "length",
                "CM",
                "6.8",
                "length of the shoot if another parameter is varied, cm",
            ),
            Opt::value("elements", "N", "4", "elements"),
            Opt::value("intervals", "N", "8", INTERVALS_HELP),
        ],
    );
    let known = |name: &String| ["length", "eta", "beta", "tau-g"].contains(&name.as_str());
    let over = options.get_if("over", "length, eta, beta or tau-g", known);
    let family = Family {
        elements: options.get("elements"),
        over,
        length: options.positive("length"),
    };
    let settings = Settings {
        from: options.positive("from"),
        to: options.positive("to"),
        step: options.positive("step"),
        intervals: options.get("intervals"),
    };
    let out = options.out_dir();

    let clock = Instant::now();
    let branches = branches(&family, &settings)?;
    write_table(&out.join("cycles.csv"), &branches)?;
    draw(&out.join("cycles.svg"), &family, &branches)?;
    print(&branches);
    println!(
        "{:.1} s; wrote cycles.csv and cycles.svg to {}",
        clock.elapsed().as_secs_f64(),
        out.display()
    );
    Ok(())
}

const STEP_HELP: &str = "largest step along a branch: root of the sum of squares of the mean change of bending (rad) \
    and of the change of the parameter divided by its range";
const INTERVALS_HELP: &str = "initial number of intervals in half a period of a planar orbit, with six points each; \
    doubled until the estimated relative error is below 1e-6";

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
