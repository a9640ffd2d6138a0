//! Tip tracks and shapes of two superposed oscillations: epitrochoid and hypotrochoid.
//!
//! This example reproduces the fifth and the sixth video of Agostinelli, DeSimone and Noselli
//! (2021), *Nutations in Plant Shoots*, Front. Plant Sci. 12:608005, and their figure 6. A shoot of
//! 6.565 cm is slightly longer than the critical length. A rotating force brings it near its
//! circular orbit, with a period of an hour and a half. An internal oscillator with a period of 20
//! min acts at the same time. The statoliths follow the avalanche dynamics with a time constant of
//! 2 min, unless `--settled` is given.
//!
//! # Results
//! If both motions have the same sense, the tip describes an *epitrochoid* with T_slow/T_fast − 1
//! loops per revolution, which point inwards. If the senses are opposite, it is a *hypotrochoid*
//! with T_slow/T_fast + 1 loops, which point outwards. The ratio is not an integer, so the track
//! does not close and rotates from one revolution to the next. The printed periods, amplitudes and
//! patterns are computed from the track alone, as for a measured plant. The figure `shapes.svg`
//! shows the shoot with its directors at eight times of the last revolution.
//!
//! # Options
//! - `--alpha 0.1`, a weak oscillator: waves instead of loops. `--period 15`: more loops.
//! - `--settled`: statoliths that follow gravity without delay. The critical length is larger then,
//!   and the slow oscillation of a shoot of 6.565 cm decays: its amplitude is 8.0 mm after 40 h and
//!   2.3 mm after 140 h (`--settled --hours 150`, mean of the largest and the smallest distance of
//!   the tip from the vertical in six hours, and half their difference).

use std::error::Error;
use std::process::ExitCode;

use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::Whirl;
use morphorod::tracking::{self, Oscillations, Search};
use morphorod::tropism::{Handedness, Oscillator, Perception, SettledStatoliths};
use morphorod::{Model, ParameterError, Shoot, ShootParameters};
use morphorod_plot::{
    Figure, Film, Frame, FramedPanel, FramedShape, Opt, Options, Orbit, Progress, Table, TimedPath,
    println,
};
use nalgebra::Vector3;

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// Sampling interval of the tip, s.
const INTERVAL: f64 = MINUTE;
/// Time after which the transient has decayed, s.
const TRANSIENT: f64 = 20.0 * HOUR;
/// Duration of the part of the track that is drawn in grey, s.
const SHOWN: f64 = 8.0 * HOUR;

/// Returns a shoot of constant length, on which a rotating force acts for the first two
/// revolutions, counterclockwise.
fn whirled_shoot(
    parameters: ShootParameters,
    handedness: Handedness,
    elements: usize,
    settled: bool,
) -> Result<Shoot<impl Model>, ParameterError> {
    let perception: Box<dyn Perception<Signal = [f64; 2]>> = if settled {
        Box::new(SettledStatoliths)
    } else {
        Box::new(parameters.statoliths())
    };
    let oscillator = Oscillator {
        handedness,
        ..parameters.oscillator()
    };
    let (gravitropism, proprioception) = parameters.steering(perception);
    let whirl = Whirl {
        force: 1e-5,
        period: 93.0 * MINUTE,
        turns: 2.0,
    };
    parameters
        .reduced()
        .elements(elements)
        .tropism((oscillator, gravitropism, proprioception))
        .load((parameters.weight(), whirl))
        .build()
}

/// Samples of the shoot at intervals of [`INTERVAL`].
#[derive(Default)]
struct Record {
    /// Times, s.
    times: Vec<f64>,
    /// Positions of the tip, m.
    tips: Vec<Vector3<f64>>,
    /// Centre lines with the directors at base and tip.
    shapes: Vec<FramedShape>,
}

impl Record {
    fn add(&mut self, shoot: &Shoot<impl Model>) {
        self.times.push(shoot.time());
        self.tips.push(shoot.tip());
        self.shapes
            .push(FramedShape::of(shoot.rod(), shoot.time() / HOUR));
    }

    /// Returns the oscillations of the horizontal track after the transient, or `None` if the run
    /// is too short.
    fn analyse(&self) -> Result<Option<Oscillations>, Box<dyn Error>> {
        let path = tracking::Track::seen_along(&Vector3::z(), self.times.clone(), &self.tips)?;
        let track = path.between(TRANSIENT, f64::INFINITY);
        // The slow period is an hour and a half. A shorter track does not distinguish it from
        // drift.
        let long = track
            .times()
            .last()
            .is_some_and(|last| last - TRANSIENT > 6.0 * HOUR);
        Ok(if long {
            Some(track.oscillations(&Search::default())?)
        } else {
            None
        })
    }

    /// Times and horizontal positions in the last `duration` seconds.
    fn last(&self, duration: f64) -> TimedPath {
        let from = self.times.last().map_or(0.0, |last| last - duration);
        let both = self
            .times
            .iter()
            .zip(&self.tips)
            .filter(|(t, _)| **t >= from);
        both.map(|(t, tip)| (t / HOUR, [tip.x, tip.y])).collect()
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "trochoids",
        "tip tracks and shapes of two superposed oscillations with equal and with opposite sense",
        &[
            Opt::value("hours", "H", "40", "time to simulate, h"),
            Opt::value(
                "alpha",
                "A",
                "0.3",
                "sensitivity of the endogenous oscillator",
            ),
            Opt::value("period", "MIN", "20", "period of the oscillator, min"),
            Opt::value("step", "S", "60", "longest time step, s"),
            Opt::value("elements", "N", "4", "elements"),
            Opt::flag("settled", "statoliths without avalanche dynamics"),
            Opt::flag("film", "also write two films for the browser"),
        ],
    );
    let end = HOUR * options.positive("hours");
    let parameters = ShootParameters {
        length: 0.06565,
        growth_time: 20.0 * HOUR,
        oscillator_sensitivity: options.get("alpha"),
        oscillator_period: MINUTE * options.positive("period"),
        ..ShootParameters::default()
    };
    let mut integrator = MethodOfSteps::new(options.positive("step"));
    let (elements, settled) = (options.get("elements"), options.flag("settled"));
    let out = options.out_dir();
    let statoliths = if settled {
        "settled, without dynamics"
    } else {
        "avalanche dynamics, time constant 2 min"
    };
    println!("statoliths: {statoliths}");

    let changed = settled || ["alpha", "period"].iter().any(|name| options.flag(name));
    let relation = if changed {
        "with other parameters than in"
    } else {
        "as in"
    };
    let mut orbits = Vec::new();
    let mut panels = Vec::new();
    let mut table = Table::create(
        out.join("tip.csv"),
        &["same_sense", "t_s", "x_m", "y_m", "z_m"],
    )?;
    for (name, handedness, pattern, [video, sense]) in [
        (
            "equal senses",
            Handedness::Counterclockwise,
            "epitrochoid",
            ["fifth", "same"],
        ),
        (
            "opposite senses",
            Handedness::Clockwise,
            "hypotrochoid",
            ["sixth", "opposite"],
        ),
    ] {
        let mut shoot = whirled_shoot(parameters, handedness, elements, settled)?;
        let progress = Progress::new(name);
        let mut record = Record::default();
        let title = format!("Two oscillations at once: {pattern}");
        let about = format!(
            "Agostinelli, DeSimone and Noselli (2021), {relation} the {video} video: the tip of a shoot of constant \
             length describes a circle, and an internal oscillator acts in the {sense} sense."
        );
        let mut film = options.flag("film").then(|| Film::new(&title, &about, 1.0));
        for k in 0..=(end / INTERVAL).ceil() as u32 {
            integrator.advance(&mut shoot, (INTERVAL * f64::from(k)).min(end))?;
            record.add(&shoot);
            // The oscillator and settled statoliths have no variables.
            film.iter_mut()
                .for_each(|film| film.push(Frame::of(&shoot, (!settled).then_some(0))));
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
        let found = record.analyse()?;
        let slow = found.as_ref().and_then(|found| {
            let periods = found.oscillations.iter().take(2).map(|wave| wave.period);
            periods.max_by(f64::total_cmp)
        });
        println!(
            "{name}: {}",
            found.map_or(TOO_SHORT.into(), |found| description(&found))
        );
        let path = record.last(slow.unwrap_or(SHOWN));
        orbits.push(Orbit {
            name: format!("{pattern}, {name}"),
            path,
            behind: record.last(SHOWN),
        });
        // A short run is shown from its beginning.
        let revolution = slow.unwrap_or(SHOWN) / HOUR;
        panels.push(FramedPanel::of_period(
            pattern,
            &record.shapes,
            end / HOUR,
            revolution,
        ));
    }
    table.finish()?;
    Figure::new(
        out.join("tip.svg"),
        "Tip tracks, top view: last revolution in colour, last 8 h in grey",
    )
    .orbits(&orbits)?;
    Figure::new(
        out.join("shapes.svg"),
        "Eight shapes in the last revolution, with directors at base and tip",
    )
    .frames(&panels)?;
    if options.flag("film") {
        println!("wrote film-epitrochoid.html and film-hypotrochoid.html for the browser");
    }
    println!("wrote tip.csv, tip.svg and shapes.svg to {}", out.display());
    Ok(())
}

const TOO_SHORT: &str = "no periods: they need a run of at least 26 h";

/// Describes periods, amplitudes, senses and the pattern.
fn description(found: &Oscillations) -> String {
    let wave = |wave: &tracking::Oscillation| {
        let sense = wave
            .ellipse
            .sense
            .map_or("no definite sense".into(), |sense| sense.to_string());
        format!(
            "period {:.3} min, amplitude {:.3} mm, {sense}",
            wave.period / MINUTE,
            1e3 * wave.ellipse.major
        )
    };
    let waves: Vec<String> = found.oscillations.iter().take(2).map(wave).collect();
    format!("{}: {}", waves.join("; "), found.pattern())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
