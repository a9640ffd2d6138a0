//! How far does a shoot swing, and which swing is stable? Its limit cycles, found at once instead of waited for.
//!
//! A shoot that is longer than the onset of oscillations may swing to and fro in a plane or go round in a circle. Agostinelli, DeSimone
//! and Noselli (2021), Front. Plant Sci. 12:608005, saw in simulations that the first is left and the second is kept. Here both are
//! solved for, along a parameter and round folds if there are any, and their stability is a number: the multipliers of Floquet.
//!
//! # What to see
//! Both branches begin at the onset, with excursions that grow as the square root of the length beyond it; near it that of the plane
//! swing is √(4/3) times that of the circle. The circle is stable all the way. The plane swing is stable in its plane and unstable out of it: a disturbance to
//! the side grows, until the shoot goes round. The circle's period does not change with the length; that of the swing gets longer, near the onset with the
//! fourth power of its excursion.
//!
//! # What to try
//! - `--over eta --from 15 --to 25` and `--over tau-g --from 18 --to 24`: the sense of bending, or how slowly tissue grows.
//! - `--elements 8 --intervals 16`: how accurate are the defaults?

mod common;
#[path = "limit_cycles/exact.rs"]
mod exact;

use std::error::Error;
use std::f64::consts::PI;
use std::process::ExitCode;
use std::time::Instant;

use common::figure::{Strip, strips_figure};
use common::{Opt, Options, Progress, Series, Style, Table};
use exact::exact_orbit;
use morphorod::constitutive::LinearElastic;
use morphorod::cycle::{Bifurcation, BranchPoint, Continuation, Disturbances, PeriodicSolver, RotatingWaveSolver};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::load::Weight;
use morphorod::stability::{Linearisation, onset};
use morphorod::tropism::{Gravitropism, Memory, Proprioception, Response, SettledStatoliths};
use morphorod::{Model, ParameterError, Shoot};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
const MM: f64 = 1e-3;
/// The tip of the first guess is so far from the axis, m.
const FIRST: f64 = 4.0 * MM;

/// The onset is looked for within the range over this before the first value.
const BEFORE: f64 = 10.0;
/// The first step of the parameter is its range over this.
const FIRST_STEP: f64 = 100.0;

/// A shoot of the reduced model: of constant length, all of it steering, with statoliths that settle at once.
struct Parameters {
    memory: Memory,
    growth_time: f64,
    density: f64,
    youngs_modulus: f64,
    radius: f64,
    beta: f64,
    eta: f64,
    length: f64,
}

/// The shoots, but for the parameter that is varied.
struct Scene {
    elements: usize,
    over: String,
    length: f64,
}

impl Scene {
    fn parameters(&self, value: f64) -> Parameters {
        let of = |name: &str, usual: f64| if self.over == name { value } else { usual };
        Parameters {
            memory: Memory { time: 12.0 * MINUTE, delay: 12.0 * MINUTE },
            growth_time: HOUR * of("tau-g", 20.0),
            density: 1000.0,
            youngs_modulus: 10e6,
            radius: 0.5e-3,
            beta: of("beta", 0.8),
            eta: of("eta", 20.0),
            length: of("length", self.length) / 100.0,
        }
    }

    fn at(&self, value: f64) -> Result<Shoot<impl Model + use<>>, ParameterError> {
        let Parameters { memory, growth_time, density, youngs_modulus, radius, beta, eta, length } =
            self.parameters(value);
        let nodes: Vec<f64> = (0..=self.elements).map(|i| length * i as f64 / self.elements as f64).collect();
        Shoot::builder(LinearElastic { youngs_modulus, poissons_ratio: 0.5 })
            .length(length)
            .radius(radius)
            .nodes(&nodes)
            .growth(Ongoing(UniformGrowth { zone_length: 1.0, time: growth_time }))
            .tropism((
                Gravitropism { sensitivity: beta, perception: SettledStatoliths }.remembered(memory),
                Proprioception { sensitivity: eta }.remembered(memory),
            ))
            .load(Weight { density })
            .build()
    }
}

/// A cycle at a value of the parameter.
struct Found {
    parameter: f64,
    /// Largest distance of the tip from the axis, m.
    amplitude: f64,
    /// s.
    period: f64,
    /// Growth rates of the two disturbances that grow most or decay least, 1/s: of a swing, one in its plane and one out of it. Not a
    /// number if no second one is found.
    rates: [f64; 2],
    unstable: usize,
    /// By how much what must be zero is not, over a period: what the intervals leave.
    defect: f64,
    iterations: usize,
    bifurcation: Option<Bifurcation>,
}

impl Found {
    /// A place whose cycle is so many times what comes back, perhaps turned.
    fn of<O>(point: &BranchPoint<O>, parts: f64, iterations: usize) -> Self {
        let mut rates: Vec<f64> = match &point.exponents {
            Disturbances::Planar { in_plane, out_of_plane } => {
                [in_plane, out_of_plane].into_iter().filter_map(|list| list.first()).map(|x| x.re).collect()
            }
            // One of a conjugate pair suffices.
            Disturbances::Spatial(all) => all.iter().filter(|x| x.im >= 0.0).map(|x| x.re).take(2).collect(),
        };
        rates.resize(2, f64::NAN);
        rates.sort_by(|a, b| b.total_cmp(a));
        Self {
            parameter: point.parameter,
            amplitude: point.excursion,
            period: parts * point.period,
            rates: [rates[0], rates[1]],
            unstable: point.unstable(),
            defect: point.trivial,
            iterations,
            bifurcation: point.bifurcation,
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "bifurcation",
        "limit cycles along a parameter: how far the tip swings, and which swings are stable",
        &[
            Opt::value("over", "NAME", "length", "parameter that is varied: length (cm), eta, beta or tau-g (h)"),
            Opt::value("from", "X", "6.57", "its first value, beyond the onset"),
            Opt::value("to", "X", "7.6", "its last value"),
            Opt::value("step", "X", "0.044", "longest step along a branch, in rad of bend and in shares of the range"),
            Opt::value("length", "CM", "6.8", "length of the shoot where something else is varied, cm"),
            Opt::value("elements", "N", "4", "elements"),
            Opt::value(
                "intervals",
                "N",
                "8",
                "intervals of half a swing at first, six points in each; doubled where they do not suffice",
            ),
        ],
    );
    let known = |name: &String| ["length", "eta", "beta", "tau-g"].contains(&name.as_str());
    let over = options.get_if("over", "length, eta, beta or tau-g", known);
    let scene = Scene { elements: options.get("elements"), over, length: options.positive("length") };
    let (from, to) = (options.positive("from"), options.positive("to"));
    let step = options.positive("step");
    // After half a swing the shoot is where it was, turned by π: half the work.
    let solver = PeriodicSolver { intervals: options.get("intervals"), angle: Some(PI), ..PeriodicSolver::default() };
    let out = options.out_dir();

    let (clock, progress) = (Instant::now(), Progress::new("bifurcation"));
    let (within, first) = (from.min(to)..=from.max(to), (to - from) / FIRST_STEP);
    let family = |value: f64| Ok(scene.at(value)?);
    let shoot = scene.at(from)?;
    let root = Linearisation::about(&shoot)?.rightmost()?;
    // Where both branches begin, if that is just before the first value.
    let before = from - (to - from) / BEFORE;
    let begin = onset(|value| Linearisation::about(&scene.at(value)?), before, from).ok();
    let done = |value: f64| progress.set(((value - from) / (to - from)).clamp(0.0, 1.0));

    let circular = RotatingWaveSolver::default();
    let circle = circular.from_mode(&shoot, &root, FIRST)?;
    let mut circles = Vec::new();
    for point in Continuation::from_orbit(circular, family, &circle, from, first, within.clone())?.largest_step(step)? {
        let point = point?;
        done(point.parameter);
        circles.push(Found::of(&point, 1.0, point.orbit.iterations));
    }
    // Near the onset it swings √(4/3) times as far as it goes round.
    let start = solver.from_mode(&shoot, &root, (4.0_f64 / 3.0).sqrt() * circle.radius())?;
    let mut planes = Vec::new();
    for point in Continuation::from_orbit(solver, family, &start, from, first, within)?.largest_step(step)? {
        let point = point?;
        done(point.parameter);
        planes.push(Found::of(&point, 2.0, point.orbit.iterations));
    }
    progress.finish();

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
    let mut table = Table::create(out.join("cycles.csv"), &columns)?;
    for (circular, list) in [(1.0, &circles), (0.0, &planes)] {
        for found in list {
            let unstable = found.unstable as f64;
            let [inside, outside] = found.rates;
            let iterations = found.iterations as f64;
            table.row(&[
                circular,
                found.parameter,
                found.amplitude,
                found.period,
                unstable,
                inside,
                outside,
                iterations,
                found.defect,
            ])?;
        }
    }
    table.finish()?;
    let unit = match scene.over.as_str() {
        "length" => "length ℓ (cm)",
        "eta" => "proprioceptive sensitivity η",
        "beta" => "gravitropic sensitivity β",
        _ => "growth time τg (h)",
    };
    let lines = |of: &dyn Fn(&Found) -> f64| {
        let mut series = Vec::new();
        for (colour, name, list) in [(0, "circular orbit", &circles), (1, "swing in a plane", &planes)] {
            let mut named = [false; 2];
            // Pieces between the places at which the stability changes, which belong to both.
            let mut from = 0;
            for to in 1..list.len() {
                if list[to].bifurcation.is_none() && to + 1 < list.len() {
                    continue;
                }
                // The number of disturbances is that of a place inside; the ends are on the edge.
                let stable =
                    list[from..=to].iter().filter(|one| one.bifurcation.is_none()).all(|one| one.unstable == 0);
                let (words, style) = if stable { ("stable", Style::Line) } else { ("unstable", Style::Dashed) };
                let first = !std::mem::replace(&mut named[usize::from(stable)], true);
                let name = if first { format!("{name}, {words}") } else { String::new() };
                let points: Vec<_> = list[from..=to].iter().map(|one| (one.parameter, of(one))).collect();
                series.push(Series::new(name, points, style, colour));
                from = to;
            }
        }
        for (colour, kind) in
            (2..).zip([Bifurcation::Fold, Bifurcation::Pitchfork, Bifurcation::PeriodDoubling, Bifurcation::Torus])
        {
            let here = circles.iter().chain(&planes).filter(|one| one.bifurcation == Some(kind));
            let points: Vec<_> = here.map(|one| (one.parameter, of(one))).collect();
            if !points.is_empty() {
                series.push(Series::new(words(kind).to_string(), points, Style::Points, colour));
            }
        }
        series
    };
    let mut amplitudes = lines(&|found| found.amplitude / MM);
    let exact = circles.iter().step_by(2).filter_map(|found| {
        let [radius, _] = exact_orbit(&scene.parameters(found.parameter))?;
        Some((found.parameter, radius / MM))
    });
    amplitudes.push(Series::new("circular, exact", exact.collect(), Style::Points, 0));
    if let Some(begin) = begin {
        amplitudes.push(Series::new("onset of oscillations", vec![(begin.parameters[0], 0.0)], Style::Points, 7));
        println!("oscillations begin at {:.6}", begin.parameters[0]);
    }
    let strips = [
        Strip { label: "excursion (mm)", series: &amplitudes },
        Strip { label: "period (min)", series: &lines(&|found| found.period / MINUTE) },
    ];
    strips_figure(out.join("cycles.svg"), "The limit cycles of a shoot, and which are stable", unit, &strips)?;

    for (name, list) in [("circular orbits", &circles), ("swings in a plane", &planes)] {
        let stable = list.iter().filter(|found| found.unstable == 0).count();
        println!("{name}: {}, of which {stable} are stable", list.len());
        let edges = list.iter().filter_map(|found| Some((found.parameter, found.bifurcation?)));
        for (parameter, special) in edges {
            println!("  at {parameter:.6}: {}", words(special));
        }
        for found in [list.first(), list.last()].into_iter().flatten() {
            let rates: Vec<String> =
                found.rates.iter().filter(|r| r.is_finite()).map(|r| format!("{:+.8}", HOUR * r)).collect();
            println!(
                "  at {:.4}: excursion {:.8} mm, period {:.8} min, leading rates {} per h, trivial ones off by {:.0e}",
                found.parameter,
                found.amplitude / MM,
                found.period / MINUTE,
                rates.join(" and "),
                found.defect,
            );
        }
    }
    println!("{:.1} s; cycles.csv and cycles.svg are in {}", clock.elapsed().as_secs_f64(), out.display());
    Ok(())
}

fn words(special: Bifurcation) -> &'static str {
    match special {
        Bifurcation::Fold => "fold",
        Bifurcation::Pitchfork => "pitchfork",
        Bifurcation::PeriodDoubling => "period doubling",
        Bifurcation::Torus => "torus",
        _ => "another change of stability",
    }
}

fn main() -> ExitCode {
    common::finish(run())
}
