//! A growing shoot that meets a pole and winds round it.
//!
//! An endogenous oscillator bends the growing part of a shoot to an arc, whose direction rotates
//! about the shoot. The tissue leaves the growth zone with the curvature κ* (1/m) that it has then.
//! The direction of this curvature rotates along the shoot by τ* = ω/v (1/m), where ω (rad/s) is
//! the angular frequency of the oscillator and v (m/s) the speed of growth. The mature part is
//! therefore a helix with curvature κ* and torsion τ*, of radius κ*/(κ*² + τ*²). A shoot with κ*
//! much smaller than τ* is almost straight, circumnutates, and slips off a pole that it meets. Here
//! both are of the order of the curvature of the pole: the oscillator completes one period while
//! the shoot grows by about one turn of the helix. The base is inclined so that the axis of the
//! helix is vertical.
//!
//! A vertical pole stands beside the base. The shoot meets it, and its growing part continues to
//! rotate round it. If the pole with the shoot is thicker than the helix, the shoot presses on it
//! along the whole contact. Otherwise it touches the pole at a few places.
//!
//! # Results
//! With the default values the radius of the helix is 1.80 mm, and the axis of the shoot is wound
//! with a radius of 2 mm. The program prints the number of turns between the lowest and the highest
//! contact, the smallest and the largest normal force of a contact, the tension and the pitch.
//!
//! # Options
//! - `--pole`, `--gap`: radius of the pole, and distance of its surface from the surface of the
//!   shoot at the base.
//! - `--friction 0.3 --pole 1`: a thin pole with friction.
//! - `--yields 10`: a pole on springs, which moves by 10 mm/N without rotation. The force on it is
//!   in `force.svg`.
//! - `--film`: an animation in space.
//! - `--map`: whether a shoot winds, leans, slips off or passes, over the radius of the pole and
//!   the friction.
//! - `--limit`: the thinnest and the thickest pole on which a wound rod remains without friction,
//!   compared with a closed form and with a shooting method.

#[path = "twining/coil.rs"]
mod coil;
#[path = "twining/limit.rs"]
mod limit;
#[path = "twining/map.rs"]
mod map;
#[path = "twining/record.rs"]
mod record;

use std::error::Error;
use std::f64::consts::{PI, TAU};
use std::process::ExitCode;
use std::time::Instant;

use morphorod::constitutive::{Lignifying, LinearElastic};
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{IntegrationError, Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::support::{Contact, Cylinder, Distance, Obstacle};
use morphorod::tropism::Oscillator;
use morphorod::{Model, Order, ParameterError, Shoot, Still};
use morphorod_plot::{Film, Frame, Opt, Options, Progress, println};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use record::Record;

const HOUR: f64 = 3600.0;
/// Radius of the shoot, m.
const RADIUS: f64 = 0.5e-3;
/// Period of the oscillator, s.
const PERIOD: f64 = 4.0 * HOUR;
/// Length of the growth zone, m.
const ZONE: f64 = 8e-3;
/// Length at t = 0, relative to the growth zone.
const INITIAL: f64 = 0.4;

/// A pole on springs.
struct Pole {
    body: Cylinder,
    /// Displacement per horizontal force, m/N.
    yields: f64,
}

impl Obstacle for Pole {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        self.body.distance(place, time)
    }

    fn compliance(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(self.yields, self.yields, 0.0))
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.body.check()
    }
}

/// Parameters of a run.
#[derive(Debug, Clone, Copy)]
struct Setup {
    /// Curvature κ* with which tissue leaves the growth zone, 1/m.
    curvature: f64,
    /// Speed of growth, m/s.
    speed: f64,
    /// Radius of the pole, m.
    pole: f64,
    /// Distance between the surfaces of pole and shoot at the base, m.
    gap: f64,
    /// Displacement of the pole per horizontal force, m/N.
    yields: f64,
    /// Coefficient of friction.
    friction: f64,
    /// Number of elements of the growth zone.
    elements: usize,
    /// Time step, s.
    step: f64,
    /// Duration, s.
    end: f64,
    /// Largest number of evaluations of the forces in the rod.
    work: usize,
}

impl Setup {
    /// Torsion τ* of the helix, 1/m.
    fn torsion(&self) -> f64 {
        TAU / (PERIOD * self.speed)
    }

    /// Distance of the axis of the pole from the base, m. The pole is in the direction of e1.
    fn distance(&self) -> f64 {
        self.pole + RADIUS + self.gap
    }

    fn cylinder(&self) -> Cylinder {
        Cylinder {
            through: Vector3::x() * self.distance(),
            along: Vector3::z(),
            radius: self.pole,
        }
    }

    /// Returns a shoot that circumnutates at t = 0. It is shorter than the growth zone, and the
    /// oscillator bends it towards the pole when its base leaves the zone.
    fn shoot(&self) -> Result<Shoot<impl Model>, ParameterError> {
        let time = ZONE / self.speed;
        let sensitivity = self.curvature * TAU * RADIUS * time / PERIOD;
        let phase = PI - TAU / PERIOD * time * (1.0 / INITIAL).ln();
        // The axis of the helix is the sum of the torsion along the tangent and the curvature along
        // the binormal, here d2 of the base.
        let lean = self.curvature.atan2(self.torsion());
        let base = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), lean);
        let young = LinearElastic {
            youngs_modulus: 1e7,
            poissons_ratio: 0.5,
        };
        Shoot::builder(Lignifying {
            young,
            mature_modulus: 3.0 * young.youngs_modulus,
            time: 12.0 * HOUR,
        })
        .length(INITIAL * ZONE)
        .radius(RADIUS)
        .growth(UniformGrowth {
            zone_length: ZONE,
            time,
        })
        .tropism(Oscillator {
            phase,
            ..Oscillator::new(sensitivity, PERIOD)
        })
        .load(Weight { density: 1000.0 })
        .scene(Still {
            base,
            ..Still::upright()
        })
        .support(Contact {
            obstacle: Pole {
                body: self.cylinder(),
                yields: self.yields,
            },
            radius: RADIUS,
            friction: self.friction,
        })
        // Contacts are searched at every point of an element, and their number determines the run
        // time.
        .order(Order::Four)
        .elements(self.elements)
        .merge_tolerance(1e-2)
        .build()
        .map(|mut shoot| {
            // The integral of the oscillator from t = 0 has a constant part, which this curvature
            // removes.
            let strain = Vector3::new(phase.sin(), -phase.cos(), 0.0) * self.curvature;
            shoot.set_intrinsic(|_| strain);
            shoot
        })
    }

    /// Integrates a shoot, and shows it at the start and after every step. After an error the shoot
    /// has the state of the last step.
    fn run<M: Model>(
        &self,
        shoot: &mut Shoot<M>,
        mut show: impl FnMut(&Shoot<M>) -> Result<(), Box<dyn Error>>,
    ) -> Result<Option<IntegrationError>, Box<dyn Error>> {
        let mut integrator = MethodOfSteps {
            retries: 10,
            max_work: self.work,
            ..MethodOfSteps::new(self.step)
        };
        let steps = (self.end / self.step).ceil() as u32;
        for k in 0..=steps {
            match integrator.advance(shoot, (self.step * f64::from(k)).min(self.end)) {
                Ok(statistics) => {
                    integrator.max_work = integrator.max_work.saturating_sub(statistics.work())
                }
                Err(error) => return Ok(Some(error)),
            }
            show(shoot)?;
        }
        Ok(None)
    }

    /// Angle of the shoot about the axis of the pole from the lowest to the highest contact, in
    /// turns.
    fn turns(&self, shoot: &Shoot<impl Model>) -> f64 {
        let places = || shoot.reactions().iter().map(|reaction| reaction.arc_length);
        let (low, high) = (
            places().fold(f64::INFINITY, f64::min),
            places().fold(0.0, f64::max),
        );
        if low >= high {
            return 0.0;
        }
        let from_axis = |i: i32| {
            let (place, _) = shoot.rod().at(low + (high - low) * f64::from(i) / 400.0)?;
            Some((place - Vector3::x() * self.distance()).xy())
        };
        let points: Vec<_> = (0..=400).filter_map(from_axis).collect();
        points
            .windows(2)
            .map(|ends| ends[0].perp(&ends[1]).atan2(ends[0].dot(&ends[1])))
            .sum::<f64>()
            / TAU
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "twining",
        "a growing shoot that meets a pole and winds round it",
        &[
            Opt::value("hours", "H", "9", "time to simulate, h"),
            Opt::value(
                "curvature",
                "K",
                "400",
                "curvature with which tissue leaves the growth zone, 1/m",
            ),
            Opt::value("speed", "MM", "6.28", "speed of growth, mm/h"),
            Opt::value("pole", "MM", "1.5", "radius of the pole, mm"),
            Opt::value(
                "gap",
                "MM",
                "1.5",
                "distance between pole and shoot at the base, mm",
            ),
            Opt::value("friction", "MU", "0", "coefficient of friction"),
            Opt::value(
                "yields",
                "MM",
                "0",
                "displacement of the pole by a horizontal force of 1 N, mm",
            ),
            Opt::value("step", "S", "600", "time step, s"),
            Opt::value(
                "elements",
                "N",
                "4",
                "number of elements of the growth zone",
            ),
            Opt::flag(
                "film",
                "also write film.html, an animation in space for the browser",
            ),
            Opt::flag(
                "map",
                "map over the radius of the pole and the friction instead of a single run",
            ),
            Opt::flag(
                "limit",
                "thinnest and thickest pole that a wound rod holds without friction, instead of a run",
            ),
        ],
    );
    let setup = Setup {
        curvature: options.positive("curvature"),
        speed: 1e-3 / HOUR * options.positive("speed"),
        pole: 1e-3 * options.positive("pole"),
        gap: 1e-3 * options.positive("gap"),
        friction: options.get("friction"),
        yields: 1e-3
            * options.get_if("yields", "finite and at least 0", |by: &f64| {
                by.is_finite() && *by >= 0.0
            }),
        elements: options.get_if("elements", "at least 1", |elements: &usize| *elements >= 1),
        step: options.positive("step"),
        end: HOUR * options.positive("hours"),
        work: usize::MAX,
    };
    let out = options.out_dir();
    if options.flag("map") {
        return map::map(&setup, &out);
    }
    if options.flag("limit") {
        limit::limit(&setup, &out)?;
        return limit::coil();
    }
    let mut shoot = setup.shoot()?;
    let mut record = Record::default();
    let about = "An endogenous oscillator turns the growing part of a shoot round a vertical pole.";
    let mut film = options
        .flag("film")
        .then(|| Film::new("Shoot that winds round a pole", about, 1.0));
    film.iter_mut()
        .for_each(|film| film.add_pole(setup.cylinder()));
    let progress = Progress::new("twining");
    let clock = Instant::now();
    let error = setup.run(&mut shoot, |shoot| {
        record.add(shoot, &setup);
        film.iter_mut()
            .for_each(|film| film.push(Frame::of(shoot, None)));
        progress.set(shoot.time() / setup.end);
        Ok(())
    })?;
    progress.finish();
    println!("run time {:.2} s", clock.elapsed().as_secs_f64());
    record.report(&shoot, &setup);
    record.write(&shoot, &setup, &out)?;
    if let Some(film) = film {
        film.write(out.join("film.html"))?;
        println!("wrote film.html for the browser");
    }
    println!(
        "wrote tip.csv, contact.csv, profile.csv, side.svg, above.svg, force.svg and contact.svg to {}",
        out.display()
    );
    error.map_or(Ok(()), |error| Err(error.into()))
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
