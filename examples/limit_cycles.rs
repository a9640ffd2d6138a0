//! Limit cycles of a shoot of constant length: pendular, elliptic and circular oscillations.
//!
//! This example reproduces the fourth video of Agostinelli, DeSimone and Noselli (2021), *Nutations
//! in Plant Shoots*, Front. Plant Sci. 12:608005, and their figure 5. A shoot of 6.59 cm is
//! slightly longer than the critical length and has no endogenous oscillator. A pulse of force at
//! the apex, which lasts 12 min, starts an oscillation. After 30 h a second pulse acts in the
//! perpendicular direction. The statoliths follow the avalanche dynamics with a time constant of 2
//! min, unless `--settled` is given.
//!
//! The example also solves for the circular and the planar periodic orbit of the undisturbed shoot,
//! and prints the growth rates of their leading disturbances.
//!
//! # Results
//! After the first pulse the oscillation is planar, and by symmetry it remains in its plane. After
//! the second pulse the tip describes ellipses, which become circles. Planar oscillations are thus
//! unstable, and circular oscillations are stable. A shoot on the circular orbit has a constant
//! shape that rotates about the vertical. Its cross-sections do not rotate with the shape, as the
//! directors show.
//!
//! # Options
//! - `--settled --hours 400 --step 45`: statoliths that follow gravity without delay. In this case
//!   [`exact_orbit`] computes the circular orbit from an ordinary differential equation. The shape
//!   is plane and without twist, and the period is 87.638 min for every amplitude.
//! - `--eta 0 --length 7.15 --settled --hours 200 --step 45`: graviceptive oscillations, without
//!   proprioception. The critical length is 7.1003931 cm.
//! - `--modulus 3e7`: another shear modulus. The text of the paper prints μ = 2E(1 + ν), which is
//!   3e7 Pa, instead of E/(2(1 + ν)), which is a ninth of it. With avalanche dynamics the twist on
//!   the circular orbit is at most 0.040 1/m for E/(2(1 + ν)) and 0.0045 1/m for 3e7 Pa. The orbits
//!   agree to seven digits. With `--settled` there is no twist.

#[path = "limit_cycles/exact.rs"]
mod exact;
#[path = "limit_cycles/orbits.rs"]
mod orbits;
#[path = "limit_cycles/report.rs"]
mod report;

use std::error::Error;
use std::f64::consts::TAU;
use std::process::ExitCode;

use exact::{exact_orbit, rate};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::Pulse;
use morphorod::tracking::{self, Oscillations, Search, Track};
use morphorod::tropism::{Perception, SettledStatoliths};
use morphorod::{Model, Shoot, ShootParameters};
use morphorod_plot::{Film, Frame, FramedShape, Opt, Options, Progress, Table, println};
use nalgebra::Vector3;

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// Start of the second pulse, s.
const ACROSS: f64 = 30.0 * HOUR;
/// Duration of a pulse, s.
const PULSE: f64 = 12.0 * MINUTE;
/// Sampling interval of the shoot, s.
const INTERVAL: f64 = 2.0 * MINUTE;
/// Window of the analysis of an oscillation, s.
const WINDOW: f64 = 8.0 * HOUR;

/// Returns a pulse of force at the apex.
fn pulse(direction: Vector3<f64>, start: f64) -> Pulse {
    Pulse {
        peak: direction * 1e-5,
        start,
        duration: PULSE,
    }
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
    /// Largest magnitude of the twist along the shoot at each time, 1/m.
    twist: Vec<f64>,
}

impl Record {
    fn add(&mut self, shoot: &Shoot<impl Model>) {
        let rod = shoot.rod();
        self.times.push(shoot.time());
        self.tips.push(rod.tip());
        self.shapes.push(FramedShape::of(rod, shoot.time() / HOUR));
        let profile = shoot.profile().sample(21);
        self.twist.push(
            profile
                .iter()
                .map(|place| place.strain.z.abs())
                .fold(0.0, f64::max),
        );
    }

    /// Returns the oscillations in a part of the horizontal track, or `None` if the second pulse
    /// lies in it or the run is shorter.
    fn analyse(&self, track: &Track, from: f64, to: f64) -> Option<Oscillations> {
        let disturbed = from < ACROSS + PULSE && to > ACROSS;
        if disturbed || from < 0.0 || self.times.last().is_none_or(|last| to > last + 1.0) {
            return None;
        }
        track
            .between(from - 1.0, to + 1.0)
            .oscillations(&Search::default())
            .ok()
    }

    /// Returns times (h) and horizontal positions (m) between two times (s).
    fn between(&self, from: f64, to: f64) -> morphorod_plot::TimedPath {
        let both = self
            .times
            .iter()
            .zip(&self.tips)
            .filter(|(t, _)| (from..=to).contains(*t));
        both.map(|(t, tip)| (t / HOUR, [tip.x, tip.y])).collect()
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "limit_cycles",
        "pendular, elliptic and circular oscillations of a shoot of constant length",
        &[
            Opt::value("hours", "H", "120", "time to simulate, h"),
            Opt::value("step", "S", "120", "longest time step, s"),
            Opt::value("elements", "N", "4", "elements"),
            Opt::flag(
                "settled",
                "statoliths without avalanche dynamics; the circular orbit is then known exactly",
            ),
            Opt::value(
                "modulus",
                "PA",
                "",
                "shear modulus, Pa; by default E/3, the smallest, where E = 1e7 Pa is Young's modulus",
            ),
            Opt::value("length", "CM", "6.59", "length of the shoot, cm"),
            Opt::value("eta", "N", "20", "proprioceptive sensitivity η"),
            Opt::flag(
                "film",
                "also write film.html, an animation in space for the browser",
            ),
        ],
    );
    let end = HOUR * options.positive("hours");
    let settled = options.flag("settled");
    let mut parameters = ShootParameters {
        length: options.positive("length") / 100.0,
        growth_time: 20.0 * HOUR,
        proprioceptive_sensitivity: options.get_if("eta", "0 or larger", |eta: &f64| *eta >= 0.0),
        ..ShootParameters::default()
    };
    if options.flag("modulus") {
        // The shear modulus is E/(2(1 + ν)).
        let modulus = options.positive("modulus");
        parameters.poissons_ratio = 0.5 * parameters.youngs_modulus / modulus - 1.0;
    }
    let perception = || -> Box<dyn Perception<Signal = [f64; 2]>> {
        if settled {
            Box::new(SettledStatoliths)
        } else {
            Box::new(parameters.statoliths())
        }
    };
    let undisturbed = parameters
        .reduced()
        .tropism(parameters.steering(perception()))
        .elements(orbits::ELEMENTS)
        .build()?;
    let found = orbits::find(&undisturbed);
    let mut shoot = parameters
        .reduced()
        .tropism(parameters.steering(perception()))
        .load((
            parameters.weight(),
            pulse(Vector3::new(2.0, 1.0, 0.0), 0.0),
            pulse(Vector3::new(1.0, -2.0, 0.0), ACROSS),
        ))
        .elements(options.get("elements"))
        .build()?;
    let mut integrator = MethodOfSteps::new(options.positive("step"));
    let out = options.out_dir();
    let statoliths = if settled {
        "settled, without dynamics"
    } else {
        "avalanche dynamics, time constant 2 min"
    };
    println!("statoliths: {statoliths}");

    let progress = Progress::new("limit cycles");
    let mut record = Record::default();
    let video = if settled
        || ["length", "eta", "modulus"]
            .iter()
            .any(|name| options.flag(name))
    {
        "with other parameters than in the fourth video"
    } else {
        "fourth video"
    };
    let about = format!("Agostinelli, DeSimone and Noselli (2021), {video}: {ABOUT}");
    let mut film = options
        .flag("film")
        .then(|| Film::new("From a pendular to a circular oscillation", &about, 2.0));
    for k in 0..=(end / INTERVAL).ceil() as u32 {
        integrator.advance(&mut shoot, (INTERVAL * f64::from(k)).min(end))?;
        record.add(&shoot);
        // Settled statoliths have no variables.
        film.iter_mut()
            .for_each(|film| film.push(Frame::of(&shoot, (!settled).then_some(0))));
        progress.set(shoot.time() / end);
    }
    progress.finish();

    let mut table = Table::create(
        out.join("tip.csv"),
        &["t_s", "x_m", "y_m", "z_m", "largest_twist_per_m"],
    )?;
    for ((t, tip), twist) in record.times.iter().zip(&record.tips).zip(&record.twist) {
        table.row(&[*t, tip.x, tip.y, tip.z, *twist])?;
    }
    table.finish()?;
    let exact = if settled {
        let period = TAU / rate(&parameters.gravitropic_memory);
        exact_orbit(&parameters).map(|[radius, height]| [radius, height, period])
    } else {
        let known = |orbits: &orbits::Orbits| {
            let circle = &orbits.circle;
            [circle.radius(), circle.height(), circle.period()]
        };
        found.as_ref().ok().map(known)
    };
    let track = tracking::Track::seen_along(&Vector3::z(), record.times.clone(), &record.tips)?;
    report::print(&record, &track, end, exact);
    report::print_orbits(&found, parameters.proprioceptive_sensitivity > 0.0);
    report::draw(&out, &record, &track, end, exact)?;
    if let Some(film) = film {
        film.write(out.join("film.html"))?;
        println!("wrote film.html for the browser");
    }
    println!(
        "wrote tip.csv, tip.svg, shapes.svg, cycle.csv and, for longer runs, cycle.svg to {}",
        out.display()
    );
    Ok(())
}

const ABOUT: &str = "after a pulse of force, a shoot of constant length oscillates in a plane. After a perpendicular \
    pulse at 30 h the oscillation becomes circular.";

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
