//! At what length does a shoot begin to swing by itself? Its characteristic roots as it gets longer.
//!
//! A small tilt of the upright shoot develops as a sum of exp(λt) with many complex λ. Re λ is a growth rate: negative if
//! the tilt dies out. Im λ makes it a swing of period 2π/Im λ. The shoot steers itself upright, but by what it sensed a
//! while ago; a long shoot that sags under its own weight answers too strongly and too late. The length at which the
//! rightmost root crosses the axis is the onset of nutations in the model of Agostinelli, DeSimone and Noselli (2021),
//! Front. Plant Sci. 12:608005: 6.56 cm with the values that are the defaults here.
//!
//! # What to see
//! One root crosses at the critical length, and the others stay far left. Past it the growth rate rises steeply and the
//! period gets shorter. Curves begin (triangles) where roots are looked for: further left, infinitely many pile up at
//! the essential spectrum, where waves are so short that neither weight nor length matters.
//!
//! # What to try
//! - `--statoliths`: the pile of statoliths in a cell takes 2 min to turn, one more delay; the shoot swings sooner and more
//!   slowly.
//! - `--eta 0`, a shoot that does not sense its own bending, and `--tau-g 40`, one that grows half as fast: both stay
//!   upright for longer.
//! - `--tau-g 3`: sensing its bending alone makes the shoot unstable, at any length. There is no onset then, and the
//!   program says why.

mod common;

use std::error::Error;
use std::f64::consts::TAU;
use std::process::ExitCode;

use common::{Axes, Opt, Options, Series, Style, Table, lines_figure};
use morphorod::Shoot;
use morphorod::constitutive::LinearElastic;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::load::Weight;
use morphorod::stability::{Linearisation, Root, StabilityError, onset};
use morphorod::tropism::{Gravitropism, Memory, Proprioception, Response, SettledStatoliths, Statoliths};
use nalgebra::Complex;

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
const CM: f64 = 0.01;
const MEMORY: Memory = Memory { time: 12.0 * MINUTE, delay: 12.0 * MINUTE };
/// Lengths that are looked at, m. An upright shoot of more than 7.93 cm buckles under its weight.
const LENGTHS: [f64; 2] = [0.03, 0.0785];
/// How many steps from the first to the last.
const STEPS: usize = 99;

/// The shoots that are compared: everything but the length.
struct Kind {
    growth_time: f64,
    gravitropism: f64,
    proprioception: f64,
    statoliths: bool,
    elements: usize,
}

impl Kind {
    /// The linearisation of the upright shoot of a length.
    fn at(&self, length: f64, elements: usize) -> Result<Linearisation, StabilityError> {
        let shoot = Shoot::builder(LinearElastic { youngs_modulus: 10e6, poissons_ratio: 0.5 })
            .length(length)
            .radius(0.5e-3)
            .elements(elements)
            // All of the shoot is growth zone; it differentiates, but does not get longer.
            .growth(Ongoing(UniformGrowth { zone_length: 2.0 * LENGTHS[1], time: self.growth_time }))
            .load(Weight { density: 1000.0 });
        let bending = Proprioception { sensitivity: self.proprioception }.remembered(MEMORY);
        let sensitivity = self.gravitropism;
        // An upright shoot is in a steady state when it is built. solve_steady_state finds that of a tilted one.
        if self.statoliths {
            let statoliths = Statoliths { avalanche_time: 2.0 * MINUTE };
            Linearisation::about(
                &shoot
                    .tropism((Gravitropism { sensitivity, perception: statoliths }.remembered(MEMORY), bending))
                    .build()?,
            )
        } else {
            let statoliths = SettledStatoliths;
            Linearisation::about(
                &shoot
                    .tropism((Gravitropism { sensitivity, perception: statoliths }.remembered(MEMORY), bending))
                    .build()?,
            )
        }
    }

    /// The roots right of a line that stands off what piles up; none if two meshes do not resolve the waves that matter.
    fn roots(&self, length: f64) -> Result<Option<Vec<Root>>, StabilityError> {
        for elements in [self.elements, 2 * self.elements] {
            let linear = self.at(length, elements)?;
            // Isolated roots lie right of the essential spectrum, where ever shorter waves pile up that no mesh
            // resolves. Without proprioception they pile up at zero instead.
            let line = linear.essential_spectrum()?.first().map_or(0.002 / MEMORY.time, |root| 0.6 * root.re);
            match linear.roots(line) {
                Err(StabilityError::UnderResolved { .. }) => {}
                other => return other.map(Some),
            }
        }
        Ok(None)
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "onset",
        "the characteristic roots of an upright shoot as it gets longer, and where it begins to oscillate",
        &[
            Opt::value("tau-g", "H", "20", "growth time, h"),
            Opt::value("beta", "B", "0.8", "gravitropic sensitivity"),
            Opt::value("eta", "E", "20", "proprioceptive sensitivity"),
            Opt::value("elements", "N", "6", "elements of a shoot; fast growth needs more"),
            Opt::flag("statoliths", "statoliths that turn within 2 min, not at once"),
        ],
    );
    let kind = Kind {
        growth_time: HOUR * options.positive("tau-g"),
        gravitropism: options.get("beta"),
        proprioception: options.get_if("eta", "0 or larger", |eta: &f64| *eta >= 0.0),
        statoliths: options.flag("statoliths"),
        elements: options.get_if("elements", "larger than 0", |n: &usize| *n > 0),
    };
    let out = options.out_dir();

    let mut linearisations = 0;
    let family = |length| {
        linearisations += 1;
        kind.at(length, kind.elements)
    };
    let critical = onset(family, LENGTHS[0], LENGTHS[1])?;
    println!("critical length  {:.8} cm", critical.parameters[0] / CM);
    println!("period there     {:.6} min", critical.period() / MINUTE);
    println!("found with {linearisations} linearisations");
    // Roots of neighbouring lengths that are closest to each other belong to one curve.
    let mut table = Table::create(out.join("roots.csv"), &["length_m", "root", "growth_rate_per_s", "period_s"])?;
    let mut curves: Vec<Vec<(f64, Complex<f64>)>> = Vec::new();
    let mut unresolved = 0;
    for i in 0..=STEPS {
        let length = LENGTHS[0] + (LENGTHS[1] - LENGTHS[0]) * i as f64 / STEPS as f64;
        let Some(roots) = kind.roots(length)? else {
            unresolved += 1;
            continue;
        };
        let mut free: Vec<usize> = (0..curves.len()).collect();
        for root in roots {
            let distance = |k: &usize| curves[*k].last().map_or(f64::MAX, |(_, z)| (z - root.value).norm());
            let nearest = free.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let curve = match nearest.filter(|k| distance(k) < 0.1 / MEMORY.time + 0.2 * root.value.norm()) {
                Some(curve) => curve,
                None => {
                    curves.push(Vec::new());
                    curves.len() - 1
                }
            };
            free.retain(|k| *k != curve);
            curves[curve].push((length, root.value));
            table.row(&[length, curve as f64, root.growth_rate(), root.period()])?;
        }
    }
    table.finish()?;
    if unresolved > 0 {
        println!(
            "{unresolved} of {} lengths have waves that the mesh does not resolve; --elements takes more",
            STEPS + 1
        );
    }

    let draw = |file: &str, title: &str, label: &str, of: &dyn Fn(Complex<f64>) -> f64, at: f64| {
        let mut series: Vec<Series> = Vec::new();
        let (mut names, mut cut, mut last) = (Vec::new(), Vec::new(), Vec::new());
        for (k, curve) in curves.iter().enumerate() {
            let line: Vec<(f64, f64)> = curve.iter().map(|(length, z)| (length / CM, of(*z))).collect();
            let name = (k + 1).to_string();
            names.push(Series::text(&name, line[line.len() / 3], Style::Badge, k));
            for end in [line[0], line[line.len() - 1]] {
                if end.0 > 0.9999 * LENGTHS[1] / CM {
                    last.push(end)
                } else if end.0 > 1.0001 * LENGTHS[0] / CM {
                    cut.push(end)
                }
            }
            series.push(Series::new(format!("root {name}"), line, Style::Line, k).with_badge(name));
        }
        series.extend(names);
        series.push(Series::new("onset", vec![(critical.parameters[0] / CM, at)], Style::Points, 3));
        let near = "begins or ends: beyond it roots pile up, and none is looked for";
        series.push(Series::new(if cut.is_empty() { "" } else { near }, cut, Style::Points, 6));
        let buckles = "the last length that is looked at: soon after it, the shoot buckles";
        series.push(Series::new(if last.is_empty() { "" } else { buckles }, last, Style::Points, 5));
        lines_figure(out.join(file), title, "length (cm)", label, &series, Axes::Linear)
    };
    draw("growth_rate.svg", "Characteristic roots: how fast a tilt grows", "growth rate (1/h)", &|z| HOUR * z.re, 0.0)?;
    let period = |z: Complex<f64>| if z.im > 0.0 { TAU / z.im / MINUTE } else { f64::NAN };
    draw(
        "period.svg",
        "Characteristic roots: how long a swing takes",
        "period (min)",
        &period,
        critical.period() / MINUTE,
    )?;
    println!("roots.csv, growth_rate.svg and period.svg are in {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    common::finish(run())
}
