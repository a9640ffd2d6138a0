//! Two oscillations at once: loops within a circle, and loops without.
//!
//! These are the fifth and the sixth video of Agostinelli, DeSimone and Noselli (2021), *Nutations in Plant Shoots*, Front.
//! Plant Sci. 12:608005, and their figure 6. A shoot of 6.565 cm is a little too long for its late answers to gravity: once
//! brought near its circular orbit, it goes round for ever, once in an hour and a half. An oscillator in its tissue bends it to all
//! sides in turn besides, once in 20 min.
//!
//! # What to see
//! Both motions add up. Where they go round in the same sense, the tip draws an *epitrochoid*: T_slow/T_fast − 1 loops in a
//! turn, which point inwards. Where the oscillator goes the other way round it is a *hypotrochoid*, with T_slow/T_fast + 1
//! loops that point outwards. The quotient is no whole number, so the figure does not close: it turns from one round to the next.
//! What is printed is read from the path alone, as one would read that of a plant.
//!
//! # What to try
//! `--alpha 0.1`, a weak oscillator, draws waves instead of loops; `--alpha 0.6`. `--period 15`, a faster one, more loops.

mod camera;
mod common;

use std::error::Error;
use std::process::ExitCode;

use common::{Film, Opt, Options, Orbit, Progress, Table, TimedPath, orbits_figure};
use morphorod::constitutive::LinearElastic;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{Weight, Whirl};
use morphorod::tracking::{self, Oscillations, Pattern, Search};
use morphorod::tropism::{Gravitropism, Handedness, Memory, Oscillator, Proprioception, Response, Statoliths};
use morphorod::{Model, ParameterError, Shoot};
use nalgebra::Vector3;

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// The shoot is looked at so often, s.
const INTERVAL: f64 = MINUTE;
/// What came before has died out, s.
const SETTLED: f64 = 20.0 * HOUR;
/// Shown beside the round that stands out, s.
const SHOWN: f64 = 8.0 * HOUR;

/// A shoot of constant length that is whirled round for two turns at first, counterclockwise.
fn whirled_shoot(oscillator: Oscillator, elements: usize) -> Result<Shoot<impl Model>, ParameterError> {
    let memory = Memory { time: 12.0 * MINUTE, delay: 12.0 * MINUTE };
    Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
        .length(0.06565)
        .radius(0.5e-3)
        .elements(elements)
        .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 20.0 * HOUR }))
        .tropism((
            oscillator,
            Gravitropism { sensitivity: 0.8, perception: Statoliths { avalanche_time: 2.0 * MINUTE } }
                .remembered(memory),
            Proprioception { sensitivity: 20.0 }.remembered(memory),
        ))
        .load((Weight { density: 1000.0 }, Whirl { force: 1e-5, period: 93.0 * MINUTE, turns: 2.0 }))
        .build()
}

/// The path of a tip.
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

    /// What the path is made of once it is settled, seen from above; nothing if the run is too short for it.
    fn read(&self) -> Result<Option<Oscillations>, Box<dyn Error>> {
        let path = tracking::Track::seen_along(&Vector3::z(), self.times.clone(), &self.tips)?;
        let settled = path.between(SETTLED, f64::INFINITY);
        // The slow oscillation takes an hour and a half; it is to be told from drift.
        let long = settled.times().last().is_some_and(|last| last - SETTLED > 6.0 * HOUR);
        Ok(if long { Some(settled.oscillations(&Search::default())?) } else { None })
    }

    /// Times and horizontal positions of the last so many seconds.
    fn last(&self, duration: f64) -> TimedPath {
        let from = self.times.last().map_or(0.0, |last| last - duration);
        let both = self.times.iter().zip(&self.tips).filter(|(t, _)| **t >= from);
        both.map(|(t, tip)| (t / HOUR, [tip.x, tip.y])).collect()
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "trochoids",
        "a shoot that goes round, with an oscillator of the same sense and of the other",
        &[
            Opt::value("hours", "H", "40", "time to simulate, h"),
            Opt::value("alpha", "A", "0.3", "sensitivity of the endogenous oscillator"),
            Opt::value("period", "MIN", "20", "period of the oscillator, min"),
            Opt::value("step", "S", "60", "longest time step, s"),
            Opt::value("elements", "N", "4", "elements"),
            Opt::flag("film", "also two films, which show the shoot in space and play in a browser"),
        ],
    );
    let end = HOUR * options.positive("hours");
    let (alpha, period) = (options.get("alpha"), MINUTE * options.positive("period"));
    let mut integrator = MethodOfSteps::new(options.positive("step"));
    let elements = options.get("elements");
    let out = options.out_dir();

    let mut orbits = Vec::new();
    let mut table = Table::create(out.join("tip.csv"), &["same_sense", "t_s", "x_m", "y_m", "z_m"])?;
    for (name, handedness, pattern, about) in [
        ("the same sense", Handedness::Counterclockwise, "epitrochoid", SAME),
        ("opposite senses", Handedness::Clockwise, "hypotrochoid", OPPOSITE),
    ] {
        let mut shoot = whirled_shoot(Oscillator { handedness, ..Oscillator::new(alpha, period) }, elements)?;
        let progress = Progress::new(name);
        let mut record = Record::default();
        let title = format!("Two oscillations at once: {pattern}");
        let mut film = options.flag("film").then(|| Film::new(&title, about, 1.0));
        for k in 0..=(end / INTERVAL).ceil() as u32 {
            integrator.advance(&mut shoot, (INTERVAL * f64::from(k)).min(end))?;
            record.look(&shoot);
            // The oscillator has no variables.
            film.iter_mut().for_each(|film| film.push(camera::look(&shoot, Some(0))));
            progress.set(shoot.time() / end);
        }
        progress.finish();
        let same = f64::from(u8::from(handedness == Handedness::Counterclockwise));
        for (t, tip) in record.times.iter().zip(&record.tips) {
            table.row(&[same, *t, tip.x, tip.y, tip.z])?;
        }
        if let Some(film) = film {
            film.write(out.join(format!("film-{pattern}.html")))?;
        }
        let found = record.read()?;
        let slow = found.as_ref().and_then(|found| {
            let periods = found.oscillations.iter().take(2).map(|wave| wave.period);
            periods.max_by(f64::total_cmp)
        });
        println!("{name}: {}", found.map_or(TOO_SHORT.into(), |found| told(&found)));
        let path = record.last(slow.unwrap_or(SHOWN));
        orbits.push(Orbit { name, path, behind: record.last(SHOWN) });
    }
    table.finish()?;
    orbits_figure(out.join("tip.svg"), "The path of the tip from above, the last round in colour", &orbits)?;
    if options.flag("film") {
        println!("film-epitrochoid.html and film-hypotrochoid.html play in a browser");
    }
    println!("tip.csv and tip.svg are in {}", out.display());
    Ok(())
}

const SAME: &str = "Agostinelli, DeSimone and Noselli (2021), fifth video: a shoot of constant length goes round in an hour and a \
    half, and an oscillator of 20 min bends it in the same sense. The loops point inwards.";
const OPPOSITE: &str = "Agostinelli, DeSimone and Noselli (2021), sixth video: a shoot of constant length goes round in an hour and a \
    half, and an oscillator of 20 min bends it in the opposite sense. The loops point outwards.";

const TOO_SHORT: &str = "periods are left out, they need a run of 26 h";

/// Periods, amplitudes, senses and the name of the pattern.
fn told(found: &Oscillations) -> String {
    let wave = |wave: &tracking::Oscillation| {
        let sense = wave.ellipse.sense.map_or("no sense".into(), |sense| format!("{sense:?}").to_lowercase());
        format!("every {:.3} min by {:.3} mm, {sense}", wave.period / MINUTE, 1e3 * wave.ellipse.major)
    };
    let waves: Vec<String> = found.oscillations.iter().take(2).map(wave).collect();
    let pattern = match found.pattern() {
        Pattern::Epitrochoid { loops, .. } => format!("an epitrochoid of {loops:.3} loops in a turn, about {loops:.0}"),
        Pattern::Hypotrochoid { loops, .. } => {
            format!("a hypotrochoid of {loops:.3} loops in a turn, about {loops:.0}")
        }
        other => format!("{other:?}"),
    };
    format!("{}: {pattern}", waves.join("; "))
}

fn main() -> ExitCode {
    common::finish(run())
}
