//! Endogenous and exogenous oscillations of a shoot at different levels of gravity.
//!
//! Experiments in orbit test whether an endogenous oscillator or the delayed gravitropic response
//! causes nutations. Agostinelli, DeSimone and Noselli (2021), *Nutations in Plant Shoots*, Front.
//! Plant Sci. 12:608005, conclude that both exist and can be distinguished. In this example, a
//! centrifuge subjects a shoot of constant length to 0, 0.1, 0.8, 1 and 3 g, for 60 h each. The
//! oscillations are determined from the tip track at each level.
//!
//! # Model
//! Statoliths indicate the direction of gravity, but not its magnitude. The gravitropic response is
//! therefore the same at 0.1 g and at 3 g, and only the weight is proportional to g. The weight
//! increases the deflection of the shoot, and thereby causes the exogenous oscillation. In
//! weightlessness the shoot has no weight, and statoliths give no signal ([`Piles`]).
//!
//! # Results
//! The endogenous oscillation, with a period of 24 min, occurs at each level. The exogenous
//! oscillation does not occur at 0 and 0.1 g. At 0.8 and 1 g it is wide and nearly circular, with a
//! period of about 91 min. At 3 g, where the shoot has nine tenths of its buckling length, the tip
//! hangs below the base. The amplitude of the endogenous oscillation is smaller where the exogenous
//! oscillation occurs. Where it does not occur, the amplitude is compared with linear theory.
//!
//! # Options
//! - `--levels 1,0,1`: from the ground to orbit and back. `--levels 0.4,0.6,0.7`: the onset of the
//!   exogenous oscillation.
//! - `--alpha 0`: no oscillator. The upright shoot remains upright, because there is no
//!   perturbation.
//! - `--frozen`: equation (6) of the paper without modification. In weightlessness the statoliths
//!   keep their last direction and their signal. After `--levels 1,0` the shoot remains curved.

#[path = "gravity/report.rs"]
mod report;

use std::error::Error;
use std::process::ExitCode;

use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::tropism::{
    Declaration, Oscillator, Perception, Site, Source, Statoliths, TropismLaw,
};
use morphorod::{Model, ParameterError, Scene, Shoot, ShootParameters};
use morphorod_plot::{Opt, Options, Progress, Table, println};
use nalgebra::{UnitQuaternion, Vector3};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// Gravitational acceleration on the ground, 1 g, m/s².
const GROUND: f64 = 9.81;
/// Period of the oscillator τe, s.
const OSCILLATOR: f64 = 24.0 * MINUTE;
/// Sampling interval of the tip, s.
const INTERVAL: f64 = 2.0 * MINUTE;

/// Centrifuge with several levels of acceleration in succession, all along −e3.
#[derive(Clone)]
struct Centrifuge {
    /// Levels in units of 1 g.
    levels: Vec<f64>,
    /// Duration of each level, s.
    time: f64,
}

impl Centrifuge {
    /// Returns the level at a time.
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

    /// Integrators do not step over a change of level.
    fn next_discontinuity(&self, t: f64) -> f64 {
        let switches = (1..self.levels.len()).map(|k| self.time * k as f64);
        switches
            .into_iter()
            .find(|switch| *switch > t)
            .unwrap_or(f64::INFINITY)
    }
}

/// Statoliths that give no signal in weightlessness, which the paper calls microgravity.
struct Piles {
    statoliths: Statoliths,
    /// Whether the last direction remains the signal in weightlessness.
    frozen: bool,
}

impl Perception for Piles {
    type Signal = [f64; 2];

    fn declare(&self, to: &mut Declaration) -> Source {
        self.statoliths.declare(to);
        // The signal is not always the normal h of the pile.
        Source::Computed
    }

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        self.statoliths.sense(site, stimuli);
    }

    fn signal(&self, h: &[f64], stimuli: &[f64]) -> [f64; 2] {
        // The stimuli are the unit vector opposite to gravity. They vanish without gravity.
        let weightless = stimuli.iter().all(|x| *x == 0.0);
        if weightless && !self.frozen {
            [0.0; 2]
        } else {
            self.statoliths.signal(h, stimuli)
        }
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

/// Returns gravitropism and proprioception.
fn responses(frozen: bool) -> impl TropismLaw {
    let paper = ShootParameters::default();
    paper.steering(Piles {
        statoliths: paper.statoliths(),
        frozen,
    })
}

/// Returns a shoot of constant length in a centrifuge. Its growth time τg is 8 h.
fn shoot(
    scene: Centrifuge,
    tropism: impl TropismLaw,
    length: f64,
) -> Result<Shoot<impl Model>, ParameterError> {
    let parameters = ShootParameters {
        length,
        growth_time: 8.0 * HOUR,
        ..ShootParameters::default()
    };
    let builder = parameters.reduced().elements(6);
    builder.tropism(tropism).scene(scene).build()
}

/// Track of the tip.
#[derive(Default)]
struct Record {
    /// Times, s.
    times: Vec<f64>,
    /// Positions of the tip, m.
    tips: Vec<Vector3<f64>>,
}

impl Record {
    fn add(&mut self, shoot: &Shoot<impl Model>) {
        self.times.push(shoot.time());
        self.tips.push(shoot.tip());
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "gravity",
        "endogenous and exogenous oscillations of a shoot at different levels of gravity",
        &[
            Opt::value("hours", "H", "60", "duration of each level, h"),
            Opt::value(
                "levels",
                "G,G,…",
                "0,0.1,0.8,1,3",
                "levels of gravity in succession, g",
            ),
            Opt::value(
                "alpha",
                "A",
                "0.2",
                "sensitivity of the endogenous oscillator",
            ),
            Opt::value("length", "CM", "5", "length of the shoot, at most 7 cm"),
            Opt::value("step", "S", "120", "longest time step, s"),
            Opt::flag("frozen", "statoliths keep their signal in weightlessness"),
        ],
    );
    let scene = Centrifuge {
        levels: levels(options.text("levels"))?,
        time: HOUR * options.positive("hours"),
    };
    let (alpha, length) = (options.get("alpha"), 0.01 * options.positive("length"));
    let frozen = options.flag("frozen");
    let laws = (Oscillator::new(alpha, OSCILLATOR), responses(frozen));
    let mut shoot = shoot(scene.clone(), laws, length)?;
    let mut integrator = MethodOfSteps::new(options.positive("step"));
    let out = options.out_dir();

    let end = scene.time * scene.levels.len() as f64;
    let progress = Progress::new("gravity");
    let mut record = Record::default();
    for k in 0..=(end / INTERVAL).ceil() as u32 {
        integrator.advance(&mut shoot, (INTERVAL * f64::from(k)).min(end))?;
        record.add(&shoot);
        progress.set(shoot.time() / end);
    }
    progress.finish();

    let mut table = Table::create(
        out.join("tip.csv"),
        &["t_s", "gravity_g", "x_m", "y_m", "z_m"],
    )?;
    for (t, tip) in record.times.iter().zip(&record.tips) {
        table.row(&[*t, scene.level(*t), tip.x, tip.y, tip.z])?;
    }
    table.finish()?;
    let oscillations = report::analyse(&record, &scene, alpha, length)?;
    report::draw(&out, &record, &scene, &oscillations)?;
    println!(
        "wrote tip.csv, tip.svg, tracks.svg and, for longer runs, levels.csv and levels.svg to {}",
        out.display()
    );
    Ok(())
}

/// Parses the levels, which are separated by commas.
fn levels(text: &str) -> Result<Vec<f64>, String> {
    let level = |part: &str| {
        part.trim()
            .parse()
            .ok()
            .filter(|level: &f64| (0.0..1e3).contains(level))
    };
    let wrong = || {
        format!(
            "option --levels has the value '{text}', but must be a list of numbers from 0 to 1000, separated by commas"
        )
    };
    text.split(',')
        .map(level)
        .collect::<Option<Vec<f64>>>()
        .ok_or_else(wrong)
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
