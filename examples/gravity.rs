//! A centrifuge in orbit: the same shoot at no weight, a tenth of ours, almost ours, ours, and three times as much.
//!
//! Experiments in orbit ask what nutations are: does an oscillator drive them from within, or are they what becomes of late
//! answers to gravity? Agostinelli, DeSimone and Noselli (2021), *Nutations in Plant Shoots*, Front. Plant Sci. 12:608005,
//! answer that both exist, and can be told apart. Here a centrifuge carries one shoot of constant length from one level of
//! gravity to the next, and its path is read at each.
//!
//! # What the model says
//! Statoliths show where down is, and not how strong gravity is: their answer at 0.1 g is that at 3 g. Only the weight grows
//! with g. It makes the shoot sag, more than its answers to gravity can mend in time; so it is the weight that sets the slow
//! swing going. In weightlessness piles of statoliths press on nothing and tell nothing ([`Piles`]), and the shoot has no weight.
//!
//! # What to see
//! The oscillator's small circles, of 24 min, are there at every level. The slow swing is not: at 0 and 0.1 g there is none, at
//! 0.8 g and at 1 g it is a wide circle, with a period that changes little. At 3 g the shoot, at nine tenths of the length at which it
//! would buckle, hangs down as it goes round. Where the swing is wide, the tip's small circles shrink. Where it is absent, their size
//! is compared with that of linear theory.
//!
//! # What to try
//! - `--levels 1,0,1`: to orbit and back. `--levels 0.4,0.6,0.7`: where does the swing begin?
//! - `--alpha 0`: no oscillator. Nothing moves then, since nothing gives the first push; a shoot is exactly upright here.
//! - `--frozen`: equation (6) of the paper to the letter. In weightlessness a pile stays where it lay and goes on telling so: after
//!   `--levels 1,0` the shoot is bent for good.

mod common;
#[path = "gravity/report.rs"]
mod report;

use std::error::Error;
use std::process::ExitCode;

use common::{Opt, Options, Progress, Table};
use morphorod::constitutive::LinearElastic;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::tropism::{
    Declaration, Gravitropism, Memory, Oscillator, Perception, Proprioception, Response, Site, Source, Statoliths,
    TropismLaw,
};
use morphorod::{Model, ParameterError, Scene, Shoot};
use nalgebra::{UnitQuaternion, Vector3};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// The acceleration at the ground, 1 g, m/s².
const GROUND: f64 = 9.81;
/// Period of the oscillator τe, s.
const OSCILLATOR: f64 = 24.0 * MINUTE;
/// Radius of the shoot, m.
const RADIUS: f64 = 0.5e-3;
/// The shoot is looked at so often, s.
const INTERVAL: f64 = 2.0 * MINUTE;

/// A centrifuge that turns fast enough for so many g, one level after the other, each for the same time. The axis of its arm
/// is the shoot's: all of it is along e3.
#[derive(Clone)]
struct Centrifuge {
    /// Levels, in units of the ground's.
    levels: Vec<f64>,
    /// Time at each of them, s.
    time: f64,
}

impl Centrifuge {
    /// The level at a time.
    fn level(&self, t: f64) -> f64 {
        let last = self.levels.len() - 1;
        self.levels[((t / self.time).max(0.0) as usize).min(last)]
    }
}

impl Scene for Centrifuge {
    fn gravity(&self, t: f64) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, -GROUND * self.level(t))
    }

    fn base(&self, _t: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::identity()
    }

    /// Integrators must not step over a switch.
    fn next_discontinuity(&self, t: f64) -> f64 {
        let switches = (1..self.levels.len()).map(|k| self.time * k as f64);
        switches.into_iter().find(|switch| *switch > t).unwrap_or(f64::INFINITY)
    }
}

/// Piles of statoliths that tell nothing in weightlessness, when they press on nothing: what the paper calls microgravity.
struct Piles {
    statoliths: Statoliths,
    /// Whether they go on telling where they lay.
    frozen: bool,
}

impl Perception for Piles {
    type Signal = [f64; 2];

    fn declare(&self, to: &mut Declaration) -> Source {
        self.statoliths.declare(to);
        // The signal is not always where the pile lies.
        Source::Computed
    }

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        self.statoliths.sense(site, stimuli);
    }

    fn signal(&self, h: &[f64], stimuli: &[f64]) -> [f64; 2] {
        // The stimuli are the unit vector that points up; there is none without gravity.
        let weightless = stimuli.iter().all(|x| *x == 0.0);
        if weightless && !self.frozen { [0.0; 2] } else { self.statoliths.signal(h, stimuli) }
    }

    fn rates(&self, h: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.statoliths.rates(h, stimuli, rates);
    }

    fn steady(&self, stimuli: &[f64], h: &mut [f64]) {
        self.statoliths.steady(stimuli, h);
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.statoliths.check()
    }
}

/// Answers to gravity and to the own bend.
fn steering(frozen: bool) -> impl TropismLaw {
    let memory = Memory { time: 12.0 * MINUTE, delay: 12.0 * MINUTE };
    let perception = Piles { statoliths: Statoliths { avalanche_time: 2.0 * MINUTE }, frozen };
    (
        Gravitropism { sensitivity: 0.8, perception }.remembered(memory),
        Proprioception { sensitivity: 20.0 }.remembered(memory),
    )
}

/// The shoot in a centrifuge. It is of constant length and grows fast, τg = 8 h.
fn shoot(scene: Centrifuge, tropism: impl TropismLaw, length: f64) -> Result<Shoot<impl Model>, ParameterError> {
    Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
        .length(length)
        .radius(RADIUS)
        .elements(6)
        .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 8.0 * HOUR }))
        .tropism(tropism)
        .load(Weight { density: 1000.0 })
        .scene(scene)
        .build()
}

/// The path of the tip.
#[derive(Default)]
struct Record {
    /// Times, s.
    times: Vec<f64>,
    tips: Vec<Vector3<f64>>,
}

impl Record {
    fn look(&mut self, shoot: &Shoot<impl Model>) {
        self.times.push(shoot.time());
        self.tips.push(shoot.tip());
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "gravity",
        "a shoot in a centrifuge in orbit: which of its two oscillations is left at which gravity?",
        &[
            Opt::value("hours", "H", "60", "time at each level of gravity, h"),
            Opt::value("levels", "G,G,…", "0,0.1,0.8,1,3", "levels of gravity, one after the other, in g"),
            Opt::value("alpha", "A", "0.2", "sensitivity of the endogenous oscillator"),
            Opt::value("length", "CM", "5", "length of the shoot, at most 7 cm"),
            Opt::value("step", "S", "120", "longest time step, s"),
            Opt::flag("frozen", "in weightlessness statoliths go on telling where they lay"),
        ],
    );
    let scene = Centrifuge { levels: levels(options.text("levels"))?, time: HOUR * options.positive("hours") };
    let (alpha, length) = (options.get("alpha"), 0.01 * options.positive("length"));
    let frozen = options.flag("frozen");
    let laws = (Oscillator::new(alpha, OSCILLATOR), steering(frozen));
    let mut shoot = shoot(scene.clone(), laws, length)?;
    let mut integrator = MethodOfSteps::new(options.positive("step"));
    let out = options.out_dir();

    let end = scene.time * scene.levels.len() as f64;
    let progress = Progress::new("gravity");
    let mut record = Record::default();
    for k in 0..=(end / INTERVAL).ceil() as u32 {
        integrator.advance(&mut shoot, (INTERVAL * f64::from(k)).min(end))?;
        record.look(&shoot);
        progress.set(shoot.time() / end);
    }
    progress.finish();

    let mut table = Table::create(out.join("tip.csv"), &["t_s", "gravity_g", "x_m", "y_m", "z_m"])?;
    for (t, tip) in record.times.iter().zip(&record.tips) {
        table.row(&[*t, scene.level(*t), tip.x, tip.y, tip.z])?;
    }
    table.finish()?;
    let readings = report::read(&record, &scene, alpha, length)?;
    report::draw(&out, &record, &scene, &readings)?;
    println!("tip.csv, tip.svg and, of longer runs, levels.csv and levels.svg are in {}", out.display());
    Ok(())
}

/// Numbers between commas.
fn levels(text: &str) -> Result<Vec<f64>, String> {
    let level = |part: &str| part.trim().parse().ok().filter(|level: &f64| (0.0..1e3).contains(level));
    let wrong =
        || format!("option --levels has the value '{text}', but must be numbers from 0 to 1000 with commas between");
    text.split(',').map(level).collect::<Option<Vec<f64>>>().ok_or_else(wrong)
}

fn main() -> ExitCode {
    common::finish(run())
}
