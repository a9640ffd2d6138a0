//! Characteristic roots of an upright shoot against its length, and the onset of oscillations.
//!
//! A small tilt of the upright shoot is a sum of modes exp(λt), whose λ are the roots of the
//! characteristic matrix. Re λ is the growth rate of a mode, and 2π/Im λ its period. Gravitropism
//! and proprioception act with a delay. With increasing length, the weight amplifies the delayed
//! response, until one mode grows. The length at which the rightmost root crosses the imaginary
//! axis is the critical length of the model of Agostinelli, DeSimone and Noselli (2021), Front.
//! Plant Sci. 12:608005. It is 6.56 cm for the default parameters.
//!
//! # Results
//! One root crosses the imaginary axis at the critical length, and all other roots stay to the left
//! of it. Beyond the critical length, the growth rate increases steeply and the period decreases.
//! Infinitely many roots accumulate at the essential spectrum, which depends neither on the weight
//! nor on the length. Roots close to it have wavelengths that no mesh resolves. Roots are therefore
//! computed only to the right of a line between the essential spectrum and the axis. Triangles mark
//! the points at which a root crosses this line.
//!
//! The last picture varies the reaction time τ̄r and the memory time τ̄m of proprioception, together
//! and one at a time. The dotted line is the critical length without proprioception. For a given
//! growth time, proprioception decreases the critical length only if its delay and memory are
//! sufficiently long (section 3.1 of the paper, case 3). Short ones increase it: the response then
//! acts as damping. Kinks and jumps of the curves are changes of the mode that becomes unstable first. A curve
//! ends where the essential spectrum becomes unstable, so that no length is stable.
//!
//! # Options
//! - `--tau-r-bar 6 --tau-m-bar 6`: another delay and memory of proprioception, min.
//! - `--statoliths`: avalanche dynamics of the statoliths with a time constant of 2 min. This
//!   additional delay reduces the critical length and increases the period.
//! - `--eta 0`, a shoot without proprioception, and `--tau-g 40`, half the growth rate: larger
//!   critical lengths.
//! - `--tau-g 3`: the essential spectrum is unstable at every length, because of proprioception
//!   alone. There is no onset, and the program ends with an error message that states the reason.

#[path = "onset/proprioception.rs"]
mod proprioception;

use std::error::Error;
use std::f64::consts::TAU;
use std::io;
use std::path::Path;
use std::process::ExitCode;

use morphorod::ShootParameters;
use morphorod::stability::{Linearisation, Root, StabilityError};
use morphorod::tropism::Memory;
use morphorod_plot::{Axes, Figure, Opt, Options, Series, Style, Table, println};
use nalgebra::Complex;
use proprioception::{compare_lengths, critical, error};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
const CM: f64 = 0.01;
/// Shortest and longest shoot, m.
const LENGTHS: [f64; 2] = [0.03, 0.0785];
/// Self-buckling length of the upright shoot (Greenhill 1881), m.
const BUCKLING: f64 = 0.079_334;
/// Number of intervals between the shortest and the longest shoot.
const STEPS: usize = 99;
/// Real part of the line to the right of which roots are computed, divided by that of the essential
/// spectrum.
const LINE: f64 = 0.6;

/// Family of shoots that differ in length.
#[derive(Clone, Copy)]
struct Kind {
    parameters: ShootParameters,
    statoliths: bool,
    elements: usize,
}

impl Kind {
    /// Linearisation about the upright shoot.
    fn at(&self, length: f64, elements: usize) -> Result<Linearisation, StabilityError> {
        let parameters = ShootParameters {
            length,
            ..self.parameters
        };
        let shoot = parameters.reduced().elements(elements);
        // The upright shoot is a steady state. A tilted one would need solve_steady_state.
        if self.statoliths {
            let tropism = parameters.steering(parameters.statoliths());
            Linearisation::about(&shoot.tropism(tropism).build()?)
        } else {
            Linearisation::about(&shoot.build()?)
        }
    }

    /// Real part of the essential spectrum, 1/s, or `None` without proprioception.
    fn essential(&self) -> Result<Option<f64>, StabilityError> {
        Ok(self
            .at(LENGTHS[0], self.elements)?
            .essential_spectrum()?
            .first()
            .map(|root| root.re))
    }

    /// Memory time of gravitropism, s.
    fn memory_time(&self) -> f64 {
        self.parameters.gravitropic_memory.time
    }

    /// Roots to the right of the line, or `None` if neither of two meshes resolves their
    /// wavelengths.
    fn roots(&self, length: f64) -> Result<Option<Vec<Root>>, StabilityError> {
        for elements in [self.elements, 2 * self.elements] {
            let linear = self.at(length, elements)?;
            // Without proprioception, roots accumulate at zero.
            let line = linear
                .essential_spectrum()?
                .first()
                .map_or(0.002 / self.memory_time(), |root| LINE * root.re);
            match linear.roots(line) {
                Err(StabilityError::UnderResolved { .. }) => {}
                other => return other.map(Some),
            }
        }
        Ok(None)
    }
}

/// Lengths and values of one root.
type Curve = Vec<(f64, Complex<f64>)>;

/// Computes the roots for all lengths, writes them as a table, and returns one curve for each root.
fn follow_roots(kind: &Kind, file: &Path) -> Result<Vec<Curve>, Box<dyn Error>> {
    let mut table = Table::create(file, &["length_m", "root", "growth_rate_per_s", "period_s"])?;
    let mut curves: Vec<Curve> = Vec::new();
    let mut unresolved = 0;
    for i in 0..=STEPS {
        let length = LENGTHS[0] + (LENGTHS[1] - LENGTHS[0]) * i as f64 / STEPS as f64;
        let Some(roots) = kind.roots(length)? else {
            unresolved += 1;
            continue;
        };
        // A root continues the curve whose last value is closest.
        let mut free: Vec<usize> = (0..curves.len()).collect();
        for root in roots {
            let distance = |k: &usize| {
                curves[*k]
                    .last()
                    .map_or(f64::MAX, |(_, z)| (z - root.value).norm())
            };
            let nearest = free
                .iter()
                .copied()
                .min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let curve = match nearest
                .filter(|k| distance(k) < 0.1 / kind.memory_time() + 0.2 * root.value.norm())
            {
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
            "{unresolved} of {} lengths are not resolved by the mesh; increase --elements",
            STEPS + 1
        );
    }
    Ok(curves)
}

/// Series of a quantity along all curves, with the point at the onset.
fn series_of(
    curves: &[Curve],
    quantity: impl Fn(Complex<f64>) -> f64,
    onset: (f64, f64),
) -> Vec<Series> {
    let (mut series, mut badges, mut ends) = (Vec::new(), Vec::new(), Vec::new());
    for (k, curve) in curves.iter().enumerate() {
        let line: Vec<(f64, f64)> = curve
            .iter()
            .map(|(length, z)| (length / CM, quantity(*z)))
            .collect();
        let name = (k + 1).to_string();
        badges.push(Series::text(&name, line[line.len() / 2], Style::Badge, k));
        let inside = |at: &f64| *at > 1.0001 * LENGTHS[0] / CM && *at < 0.9999 * LENGTHS[1] / CM;
        ends.extend(
            [line[0], line[line.len() - 1]]
                .into_iter()
                .filter(|(length, _)| inside(length)),
        );
        series.push(Series::new(format!("root {name}"), line, Style::Line, k).with_badge(name));
    }
    series.extend(badges);
    series.push(Series::new(
        "onset of oscillations",
        vec![onset],
        Style::Points,
        3,
    ));
    let label = "limit of the computed roots: roots accumulate at the essential spectrum and are not computed near it";
    series.push(Series::new(
        if ends.is_empty() { "" } else { label },
        ends,
        Style::Points,
        6,
    ));
    series
}

/// Draws growth rates, with zero, the essential spectrum (1/s) and the self-buckling length.
fn draw_growth_rates(
    file: &Path,
    curves: &[Curve],
    critical: f64,
    essential: Option<f64>,
) -> io::Result<()> {
    let lengths = curves.iter().flatten().map(|(length, _)| length / CM);
    let (shortest, buckling) = (lengths.fold(critical / CM, f64::min), BUCKLING / CM);
    let level = |rate: f64| vec![(shortest, rate), (buckling, rate)];
    let rates = || curves.iter().flatten().map(|(_, z)| HOUR * z.re);
    let (least, most) = (rates().fold(0.0, f64::min), rates().fold(0.0, f64::max));
    let lowest = essential.map_or(least, |rate| HOUR * rate);
    let mut series = vec![Series::new(
        "stability limit, Re λ = 0",
        level(0.0),
        Style::Line,
        6,
    )];
    if essential.is_some() {
        series.push(Series::new(
            "essential spectrum",
            level(lowest),
            Style::Dashed,
            6,
        ));
    }
    let wall = vec![(buckling, lowest), (buckling, most)];
    series.push(Series::new(
        "self-buckling length (Greenhill)",
        wall,
        Style::Dashed,
        4,
    ));
    series.extend(series_of(curves, |z| HOUR * z.re, (critical / CM, 0.0)));
    let title = "Growth rates of the characteristic roots of an upright shoot";
    Figure::new(file, title).lines(
        "length (cm)",
        "growth rate Re λ (1/h)",
        &series,
        Axes::Linear,
    )
}

fn draw_periods(file: &Path, curves: &[Curve], critical: (f64, f64)) -> io::Result<()> {
    let period = |z: Complex<f64>| {
        if z.im > 0.0 {
            TAU / z.im / MINUTE
        } else {
            f64::NAN
        }
    };
    let series = series_of(curves, period, (critical.0 / CM, critical.1 / MINUTE));
    let title = "Periods of the characteristic roots of an upright shoot";
    Figure::new(file, title).lines("length (cm)", "period 2π/Im λ (min)", &series, Axes::Linear)
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "onset",
        "characteristic roots of an upright shoot against its length, and the onset of oscillations",
        &[
            Opt::value("tau-g", "H", "20", "growth time, h"),
            Opt::value("beta", "B", "0.8", "gravitropic sensitivity"),
            Opt::value("eta", "E", "20", "proprioceptive sensitivity"),
            Opt::value("tau-r-bar", "M", "12", "delay of proprioception, min"),
            Opt::value("tau-m-bar", "M", "12", "memory of proprioception, min"),
            Opt::value("elements", "N", "6", "elements; fast growth requires more"),
            Opt::flag(
                "statoliths",
                "statoliths with avalanche dynamics, with a time constant of 2 min",
            ),
        ],
    );
    let parameters = ShootParameters {
        growth_time: HOUR * options.positive("tau-g"),
        gravitropic_sensitivity: options.get("beta"),
        proprioceptive_sensitivity: options.get_if("eta", "0 or larger", |eta: &f64| *eta >= 0.0),
        proprioceptive_memory: Memory {
            time: MINUTE * options.positive("tau-m-bar"),
            delay: MINUTE * options.positive("tau-r-bar"),
        },
        ..ShootParameters::default()
    };
    let kind = Kind {
        parameters,
        statoliths: options.flag("statoliths"),
        elements: options.get_if("elements", "larger than 0", |n: &usize| *n > 0),
    };
    let out = options.out_dir();

    let critical = critical(&kind)?;
    println!(
        "critical length           {:.8} cm, estimated error {:.0e} cm",
        critical.parameters[0] / CM,
        error(&critical) / CM
    );
    println!(
        "period at this length     {:.6} min",
        critical.period() / MINUTE
    );
    let curves = follow_roots(&kind, &out.join("roots.csv"))?;
    draw_growth_rates(
        &out.join("growth_rate.svg"),
        &curves,
        critical.parameters[0],
        kind.essential()?,
    )?;
    draw_periods(
        &out.join("period.svg"),
        &curves,
        (critical.parameters[0], critical.period()),
    )?;
    let mut files = "roots.csv, growth_rate.svg and period.svg";
    if kind.parameters.proprioceptive_sensitivity > 0.0 {
        compare_lengths(&kind, &out)?;
        files = "roots.csv, growth_rate.svg, period.svg, proprioception.csv and proprioception.svg";
    }
    println!("wrote {files} to {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
