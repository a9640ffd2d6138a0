//! Where the slow swing of a shoot ends: a pendulum, ellipses that get rounder, and a circle.
//!
//! This is the fourth video of Agostinelli, DeSimone and Noselli (2021), *Nutations in Plant Shoots*, Front. Plant Sci.
//! 12:608005, and their figure 5. A shoot of constant length, 6.59 cm, a little beyond the onset of oscillations, has no
//! oscillator of its own. A pull of 12 min at its tip sets it swinging; after 30 h another one pulls it across.
//!
//! # What to see
//! The first pull makes it a pendulum: by symmetry it stays in its plane, for ever. The second one takes it out of the plane,
//! and the swing opens to an ellipse, and rounds to a circle. Planes are unstable, circles are stable. On the circle the shape no
//! longer changes but only turns about the vertical; the directors show that it does not twist with it: d1 at the base
//! stands still.
//!
//! # What to try
//! - `--settled --hours 400 --step 45`: statoliths that settle at once. The circular orbit is known exactly then, from a problem in one
//!   variable that [`exact_orbit`] solves: its shape is plane, it feels no torsion, and it turns in 87.638 min whatever its size.
//! - `--modulus 3e7`, another shear modulus. The text of the paper prints μ = 2E(1 + ν), which is 3e7 Pa, where E/(2(1 + ν)), a
//!   ninth of it, is meant. With statoliths the shoot twists a little as it goes round: by up to 0.040 1/m, or 0.0045 1/m if it
//!   resists more. The orbit is the same in seven digits. Settled it does not twist at all.

mod camera;
mod common;
#[path = "limit_cycles/exact.rs"]
mod exact;
#[path = "limit_cycles/report.rs"]
mod report;

use std::error::Error;
use std::f64::consts::TAU;
use std::process::ExitCode;

use common::{Film, FramedShape, Opt, Options, Progress, Table};
use exact::{exact_orbit, rate};
use morphorod::constitutive::{Constitutive, ElasticResponse, Tissue};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{Pulse, Weight};
use morphorod::tracking::{self, Oscillations, Search, Track};
use morphorod::tropism::{Gravitropism, Memory, Perception, Proprioception, Response, SettledStatoliths, Statoliths};
use morphorod::{Model, ParameterError, Shoot};
use nalgebra::{Matrix3, Vector3};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// When the second pull begins, s.
const ACROSS: f64 = 30.0 * HOUR;
/// How long a pull lasts, s.
const PULL: f64 = 12.0 * MINUTE;
/// The shoot is looked at so often, s.
const INTERVAL: f64 = 2.0 * MINUTE;
/// What is read as one orbit, s.
const WINDOW: f64 = 8.0 * HOUR;
/// Radius and height of the tip (m) and period (s) of the circular orbit with statoliths of 2 min and the shear modulus of
/// incompressible tissue: two unlike methods, harmonic balance and spectral time steps, agree on these digits.
const WITH_STATOLITHS: [f64; 3] = [29.4264635e-3, 56.0385542e-3, 92.7509782 * MINUTE];

/// Constants of the shoot.
struct Parameters {
    length: f64,
    radius: f64,
    growth_time: f64,
    beta: f64,
    eta: f64,
    memory: Memory,
    density: f64,
    youngs_modulus: f64,
}

const SHOOT: Parameters = Parameters {
    length: 0.0659,
    radius: 0.5e-3,
    growth_time: 20.0 * HOUR,
    beta: 0.8,
    eta: 20.0,
    memory: Memory { time: 12.0 * MINUTE, delay: 12.0 * MINUTE },
    density: 1000.0,
    youngs_modulus: 1e7,
};

/// Linear elasticity with any shear modulus; that of a material with E and ν is E/(2(1 + ν)).
struct Elastic {
    youngs_modulus: f64,
    shear_modulus: f64,
}

impl Constitutive for Elastic {
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        let [first, second] = tissue.section.second_moments().map(|moment| self.youngs_modulus * moment);
        let stiffness = Vector3::new(first, second, self.shear_modulus * tissue.section.torsion_constant());
        let couple = stiffness.component_mul(strain);
        ElasticResponse { energy: 0.5 * couple.dot(strain), couple, tangent: Matrix3::from_diagonal(&stiffness) }
    }
}

/// The shoot, pulled along (2, 1, 0) at first and along (1, −2, 0) later.
fn kicked_shoot(
    shear_modulus: f64,
    elements: usize,
    perception: Box<dyn Perception<Signal = [f64; 2]>>,
) -> Result<Shoot<impl Model>, ParameterError> {
    let Parameters { youngs_modulus, memory, .. } = SHOOT;
    let pull = |direction, start| Pulse { peak: direction * 1e-5, start, duration: PULL };
    Shoot::builder(Elastic { youngs_modulus, shear_modulus })
        .length(SHOOT.length)
        .radius(SHOOT.radius)
        .elements(elements)
        .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: SHOOT.growth_time }))
        .tropism((
            Gravitropism { sensitivity: SHOOT.beta, perception }.remembered(memory),
            Proprioception { sensitivity: SHOOT.eta }.remembered(memory),
        ))
        .load((
            Weight { density: SHOOT.density },
            pull(Vector3::new(2.0, 1.0, 0.0), 0.0),
            pull(Vector3::new(1.0, -2.0, 0.0), ACROSS),
        ))
        .build()
}

/// What is seen of the shoot, every [`INTERVAL`].
#[derive(Default)]
struct Record {
    /// Times, s.
    times: Vec<f64>,
    tips: Vec<Vector3<f64>>,
    shapes: Vec<FramedShape>,
    /// The largest twist at any time, 1/m.
    twist: Vec<f64>,
}

impl Record {
    fn look(&mut self, shoot: &Shoot<impl Model>) {
        let rod = shoot.rod();
        self.times.push(shoot.time());
        self.tips.push(rod.tip());
        let places = (0..=5).filter_map(|k| rod.at(rod.length() * f64::from(k) / 5.0));
        let directors =
            places.map(|(place, frame)| [place, frame * Vector3::x(), frame * Vector3::y()].map(Into::into)).collect();
        let line = rod.centre_line_at(41).into_iter().map(Into::into).collect();
        self.shapes.push(FramedShape { hours: shoot.time() / HOUR, line, directors });
        let profile = shoot.profile().sample(21);
        self.twist.push(profile.iter().map(|place| place.strain.z.abs()).fold(0.0, f64::max));
    }

    /// What a part of the path is made of, seen from above; nothing if it is too short, or the second pull is in it.
    fn read(&self, path: &Track, from: f64, to: f64) -> Option<Oscillations> {
        let pulled = from < ACROSS + PULL && to > ACROSS;
        if pulled || from < 0.0 || self.times.last().is_none_or(|last| to > last + 1.0) {
            return None;
        }
        path.between(from - 1.0, to + 1.0).oscillations(&Search::default()).ok()
    }

    /// Times and horizontal positions between two times.
    fn between(&self, from: f64, to: f64) -> common::TimedPath {
        let both = self.times.iter().zip(&self.tips).filter(|(t, _)| (from..=to).contains(*t));
        both.map(|(t, tip)| (t / HOUR, [tip.x, tip.y])).collect()
    }

    /// Eight shapes within a period that ends at a time.
    fn turn(&self, end: f64, period: f64) -> Vec<FramedShape> {
        let at = |k: u32| (end - period * f64::from(8 - k) / 8.0) / HOUR;
        let nearest = |hours: f64| {
            let off = |shape: &&FramedShape| (shape.hours - hours).abs();
            self.shapes.iter().min_by(|a, b| off(a).total_cmp(&off(b))).cloned()
        };
        let shapes = (1..=8).filter_map(|k| nearest(at(k).max(0.0)));
        // Times within the period, so that equal colours are equal parts of it.
        shapes.map(|shape| FramedShape { hours: shape.hours - at(0).max(0.0), ..shape }).collect()
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "limit_cycles",
        "a shoot that is kicked swings like a pendulum; kicked across, it comes to go round",
        &[
            Opt::value("hours", "H", "120", "time to simulate, h"),
            Opt::value("step", "S", "120", "longest time step, s"),
            Opt::value("elements", "N", "4", "elements"),
            Opt::flag("settled", "statoliths settle at once: the circular orbit is known exactly"),
            Opt::value(
                "modulus",
                "PA",
                "",
                "shear modulus, Pa; E/3, a third of Young's modulus of 1e7 Pa, if not given",
            ),
            Opt::flag("film", "also film.html, which shows the shoot in space and plays in a browser"),
        ],
    );
    let end = HOUR * options.positive("hours");
    let settled = options.flag("settled");
    let usual = SHOOT.youngs_modulus / 3.0;
    let shear_modulus = if options.flag("modulus") { options.positive("modulus") } else { usual };
    let perception: Box<dyn Perception<Signal = [f64; 2]>> =
        if settled { Box::new(SettledStatoliths) } else { Box::new(Statoliths { avalanche_time: 2.0 * MINUTE }) };
    let mut shoot = kicked_shoot(shear_modulus, options.get("elements"), perception)?;
    let mut integrator = MethodOfSteps::new(options.positive("step"));
    let out = options.out_dir();

    let progress = Progress::new("limit cycles");
    let mut record = Record::default();
    let mut film = options.flag("film").then(|| Film::new("From a pendulum to a circle", ABOUT, 2.0));
    for k in 0..=(end / INTERVAL).ceil() as u32 {
        integrator.advance(&mut shoot, (INTERVAL * f64::from(k)).min(end))?;
        record.look(&shoot);
        // Those that are settled have no variables.
        film.iter_mut().for_each(|film| film.push(camera::look(&shoot, (!settled).then_some(0))));
        progress.set(shoot.time() / end);
    }
    progress.finish();

    let mut table = Table::create(out.join("tip.csv"), &["t_s", "x_m", "y_m", "z_m", "largest_twist_per_m"])?;
    for ((t, tip), twist) in record.times.iter().zip(&record.tips).zip(&record.twist) {
        table.row(&[*t, tip.x, tip.y, tip.z, *twist])?;
    }
    table.finish()?;
    let exact = if settled {
        exact_orbit(&SHOOT).map(|[radius, height]| [radius, height, TAU / rate(&SHOOT.memory)])
    } else {
        (shear_modulus == usual).then_some(WITH_STATOLITHS)
    };
    let path = tracking::Track::seen_along(&Vector3::z(), record.times.clone(), &record.tips)?;
    report::tell(&record, &path, end, exact);
    report::draw(&out, &record, &path, end, exact)?;
    if let Some(film) = film {
        film.write(out.join("film.html"))?;
        println!("film.html plays in a browser");
    }
    println!("tip.csv, tip.svg, shapes.svg and, of longer runs, cycle.csv and cycle.svg are in {}", out.display());
    Ok(())
}

const ABOUT: &str = "Agostinelli, DeSimone and Noselli (2021), fourth video: a shoot of constant length is pulled once, and swings in \
    a plane; pulled across after 30 h, it comes to go round.";

fn main() -> ExitCode {
    common::finish(run())
}
