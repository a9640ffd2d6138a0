//! A circumnutating shoot that meets a pole: contact, friction, and winding.
//!
//! A shoot of 6 cm grows in its last 5 cm, by 6.25 mm in an hour. An endogenous oscillator with a
//! period of 2 h bends the growing part to an arc, which rotates about the axis of the shoot. A
//! vertical pole is in the way of the apex. It acts on the shoot with a normal force, and with
//! friction by the law of Coulomb. Tissue that has left the growth zone lignifies.
//!
//! # Results
//! The shoot touches the pole once in every circle, slides over it, and slips off with its apex. The
//! contact is higher in each circle, because the shoot grows. Twelve contacts begin in 24 h. The
//! turning angle about the pole is at most 0.14 turns in the first circles and increases in the
//! last three: the apex passes behind the pole before the growing part swings back. It reaches 0.47
//! turns with a friction of 0.2, and 0.53 turns without friction. The shoot is in contact for 38 %
//! and 28 % of the time.
//!
//! The map contains shoots that pass, shoots that slip off, shoots that lean, and runs that fail with
//! an error. The last ones are at poles close to the base, where a strongly curved shoot would wind with
//! friction. A single run repeats such steps with half their length.
//!
//! # Options
//! - `--friction 0`: no friction.
//! - `--distance`, `--pole`: place and radius of the pole.
//! - `--straight`: the shoot is straight at t = 0. The oscillator then leaves a constant curvature in
//!   all tissue.
//! - `--map`: runs on a grid of pole radii and distances, without friction and with the friction
//!   of `--friction`. A friction of 0 is replaced by 0.2. Each run has one of these classes:
//!
//!   | class | last period of the oscillator |
//!   |---|---|
//!   | passes | the shoot has never touched the pole |
//!   | slips off | it touched the pole, and is free for some time in the last period |
//!   | leans | in contact throughout, and the turning angle is always less than a full turn |
//!   | winds | in contact throughout, and the turning angle reaches a full turn |
//!   | fails | the run ended with an error, which is printed |
//!
//! The turning angle is that of the horizontal vector from the axis of the pole to the shoot, from
//! the lowest contact to the apex.

#[path = "twining/map.rs"]
mod map;

use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use morphorod::constitutive::{Lignifying, LinearElastic};
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{IntegrationError, Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::support::{Contact, Cylinder, Slip};
use morphorod::tropism::Oscillator;
use morphorod::{Model, ParameterError, Shoot};
use morphorod_plot::{Axes, Figure, Film, Frame, Opt, Options, Progress, Series, Strip, Style, Table, println};
use nalgebra::Vector3;

const HOUR: f64 = 3600.0;
/// Radius of the shoot, m.
const RADIUS: f64 = 0.5e-3;
/// Period of the oscillator τe, s.
const PERIOD: f64 = 2.0 * HOUR;
/// Growth time τg, s.
const GROWTH_TIME: f64 = 8.0 * HOUR;

/// Parameters of a run.
#[derive(Debug, Clone, Copy)]
struct Setup {
    /// Sensitivity of the oscillator.
    alpha: f64,
    /// Distance of the axis of the pole from the base, m.
    distance: f64,
    /// Radius of the pole, m.
    pole: f64,
    /// Coefficient of friction.
    friction: f64,
    /// Time step, s.
    step: f64,
    /// Number of steps that are repeated with half their length after an error of the solver.
    retries: usize,
    /// Duration, s.
    end: f64,
    /// Whether the shoot is straight at t = 0.
    straight: bool,
}

impl Setup {
    /// Returns a shoot that circumnutates already at t = 0: its growing part is an arc, unless `straight`.
    fn shoot(&self) -> Result<Shoot<impl Model>, ParameterError> {
        let young = LinearElastic { youngs_modulus: 1e9, poissons_ratio: 0.5 };
        let pole = Cylinder { through: Vector3::x() * self.distance, along: Vector3::z(), radius: self.pole };
        Shoot::builder(Lignifying { young, mature_modulus: 100.0 * young.youngs_modulus, time: 6.0 * HOUR })
            .length(0.06)
            .radius(RADIUS)
            .growth(UniformGrowth { zone_length: 0.05, time: GROWTH_TIME })
            .tropism(Oscillator::new(self.alpha, PERIOD))
            .load(Weight { density: 1000.0 })
            .support(Contact { obstacle: pole, radius: RADIUS, friction: self.friction })
            .build()
            .map(|mut shoot| {
                if self.straight {
                    return shoot;
                }
                // The integral of the oscillator from t = 0 has a constant part, which this curvature removes.
                let curvature = self.alpha / (RADIUS * GROWTH_TIME) * PERIOD / TAU;
                let strain = |growing| if growing { -Vector3::y() * curvature } else { Vector3::zeros() };
                shoot.set_intrinsic(|point| strain(point.exit_time == f64::INFINITY));
                shoot
            })
    }

    /// Integrates a shoot, and shows it at the start and after every step. After an error the shoot has the state of
    /// the last step.
    fn run<M: Model>(
        &self,
        shoot: &mut Shoot<M>,
        mut show: impl FnMut(&Shoot<M>) -> Result<(), Box<dyn Error>>,
    ) -> Result<Option<IntegrationError>, Box<dyn Error>> {
        let mut integrator = MethodOfSteps { retries: self.retries, ..MethodOfSteps::new(self.step) };
        let steps = (self.end / self.step).ceil() as u32;
        for k in 0..=steps {
            if let Err(error) = integrator.advance(shoot, (self.step * f64::from(k)).min(self.end)) {
                return Ok(Some(error));
            }
            show(shoot)?;
        }
        Ok(None)
    }

    /// Turning angle of the shoot about the axis of the pole beyond the lowest contact, in turns.
    fn turns(&self, shoot: &Shoot<impl Model>) -> f64 {
        let Some(first) = shoot.reactions().first() else { return 0.0 };
        let rod = shoot.rod();
        let beyond = (0..=200).filter_map(|i| {
            let s = first.arc_length + (rod.length() - first.arc_length) * f64::from(i) / 200.0;
            Some((rod.at(s)?.0 - Vector3::x() * self.distance).xy())
        });
        let beyond: Vec<_> = beyond.collect();
        let angles = beyond.windows(2).map(|ends| ends[0].perp(&ends[1]).atan2(ends[0].dot(&ends[1])));
        angles.sum::<f64>() / TAU
    }
}

/// A contact of the shoot with the pole at a time.
struct Touch {
    /// Time, h.
    hours: f64,
    /// Arc length and height, m.
    place: [f64; 2],
    /// Normal and tangential force, N.
    force: [f64; 2],
    slip: Option<Slip>,
}

/// Results of a run.
#[derive(Default)]
struct Record {
    /// Time (s), length (m), tip (m), turning angle (turns), and number of contacts.
    rows: Vec<[f64; 7]>,
    touches: Vec<Touch>,
    /// Times (h) and centre lines (cm).
    shapes: Vec<(f64, Vec<Vector3<f64>>)>,
}

impl Record {
    fn add(&mut self, shoot: &Shoot<impl Model>, setup: &Setup) {
        let (time, tip, rod) = (shoot.time(), shoot.tip(), shoot.rod());
        let number = shoot.reactions().len() as f64;
        self.rows.push([time, rod.length(), tip.x, tip.y, tip.z, setup.turns(shoot), number]);
        for reaction in shoot.reactions() {
            let Some((place, _)) = rod.at(reaction.arc_length) else { continue };
            // The square of the force minus that of its normal part may be negative by rounding.
            let tangential = (reaction.force.norm_squared() - reaction.normal.powi(2)).max(0.0).sqrt();
            self.touches.push(Touch {
                hours: time / HOUR,
                place: [reaction.arc_length, place.z],
                force: [reaction.normal, tangential],
                slip: reaction.slip,
            });
        }
        if time >= setup.end / 16.0 * self.shapes.len() as f64 - 1e-6 {
            self.shapes.push((time / HOUR, rod.centre_line_at(201).iter().map(|point| 100.0 * point).collect()));
        }
    }

    fn write(&self, setup: &Setup, out: &Path) -> Result<(), Box<dyn Error>> {
        let columns = ["t_s", "length_m", "x_m", "y_m", "z_m", "turns", "contacts"];
        let mut table = Table::create(out.join("tip.csv"), &columns)?;
        self.rows.iter().try_for_each(|row| table.row(row))?;
        table.finish()?;
        let columns = ["t_s", "s_m", "height_m", "normal_n", "tangential_n", "sticks"];
        let mut table = Table::create(out.join("contact.csv"), &columns)?;
        for Touch { hours, place, force, slip } in &self.touches {
            let sticks = if *slip == Some(Slip::Sticks) { 1.0 } else { 0.0 };
            table.row(&[hours * HOUR, place[0], place[1], force[0], force[1], sticks])?;
        }
        table.finish()?;
        self.draw_shapes(setup, out)?;
        self.draw_contacts(out)
    }

    /// Draws the shapes over time with the pole, from the side and from above.
    fn draw_shapes(&self, setup: &Setup, out: &Path) -> Result<(), Box<dyn Error>> {
        let (x, r) = (100.0 * setup.distance, 100.0 * setup.pole);
        let all = || self.shapes.iter().flat_map(|(_, line)| line.iter().map(|point| point.z));
        let (low, high) = (all().fold(0.0, f64::min), all().fold(0.0, f64::max));
        let edges = |x: f64| vec![(x, low), (x, high)];
        let circle = (0..=72).map(|i| (TAU * f64::from(i) / 72.0).sin_cos()).map(|(sin, cos)| (x + r * cos, r * sin));
        let poles = [vec![edges(x - r), edges(x + r)], vec![circle.collect()]];
        let views = [("side", "z (cm)"), ("above", "y (cm)")];
        for (view, ((name, label), pole)) in views.into_iter().zip(poles).enumerate() {
            let project = |p: &Vector3<f64>| (p.x, if view == 0 { p.z } else { p.y });
            let mut series = Vec::new();
            for (hours, line) in &self.shapes {
                series.push(Series::new("", line.iter().map(project).collect(), Style::Line, 0).at_time(*hours));
            }
            for (i, edge) in pole.into_iter().enumerate() {
                series.push(Series::new(if i == 0 { "pole" } else { "" }, edge, Style::Line, 6));
            }
            let title = format!("Circumnutating shoot and a pole, seen from {}", ["the side", "above"][view]);
            Figure::new(out.join(format!("{name}.svg")), title).lines("x (cm)", label, &series, Axes::Equal)?;
        }
        Ok(())
    }

    /// Draws forces and places of the contacts over time.
    fn draw_contacts(&self, out: &Path) -> Result<(), Box<dyn Error>> {
        let points = |value: &dyn Fn(&Touch) -> f64, sticks: bool| -> Vec<(f64, f64)> {
            let chosen = self.touches.iter().filter(|touch| (touch.slip == Some(Slip::Sticks)) == sticks);
            chosen.map(|touch| (touch.hours, value(touch))).collect()
        };
        let series = |value: &dyn Fn(&Touch) -> f64| {
            let sliding = Series::new("slides", points(value, false), Style::Points, 0);
            let sticking = Series::new("sticks", points(value, true), Style::Points, 1);
            [sliding, sticking].into_iter().filter(|one| !one.points.is_empty()).collect::<Vec<_>>()
        };
        let all = [
            ("normal force (mN)", series(&|touch| 1e3 * touch.force[0])),
            ("tangential (mN)", series(&|touch| 1e3 * touch.force[1])),
            ("arc length (cm)", series(&|touch| 100.0 * touch.place[0])),
            ("height (cm)", series(&|touch| 100.0 * touch.place[1])),
        ];
        let turns = self.rows.iter().map(|row| (row[0] / HOUR, row[5])).collect();
        let turns = [Series::new("", turns, Style::Line, 2)];
        let mut strips: Vec<Strip> = all.iter().map(|(label, series)| Strip { label, series }).collect();
        strips.push(Strip { label: "turns (1)", series: &turns });
        Figure::new(out.join("contact.svg"), "Contacts of the shoot with the pole").strips("time (h)", &strips)?;
        Ok(())
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "twining",
        "a circumnutating shoot that meets a pole",
        &[
            Opt::value("hours", "H", "24", "time to simulate, h"),
            Opt::value("alpha", "A", "0.5", "sensitivity of the endogenous oscillator"),
            Opt::value("distance", "CM", "3", "distance of the axis of the pole from the base, cm"),
            Opt::value("pole", "MM", "4", "radius of the pole, mm"),
            Opt::value("friction", "MU", "0.2", "coefficient of friction"),
            Opt::value("step", "S", "120", "time step, s"),
            Opt::flag("straight", "start with a straight shoot, which curls"),
            Opt::flag("film", "also write film.html, an animation in space for the browser, without the pole"),
            Opt::flag("map", "map over radius and distance of the pole instead of a single run"),
            Opt::value("size", "N", "5", "number of radii and of distances of the map"),
        ],
    );
    let setup = Setup {
        alpha: options.get("alpha"),
        distance: 0.01 * options.positive("distance"),
        pole: 1e-3 * options.positive("pole"),
        friction: options.get("friction"),
        step: options.positive("step"),
        retries: 10,
        end: HOUR * options.positive("hours"),
        straight: options.flag("straight"),
    };
    let size = options.get_if("size", "at least 2", |size: &usize| *size >= 2);
    let out = options.out_dir();
    if options.flag("map") {
        return map::map(&setup, size, &out);
    }
    let mut shoot = setup.shoot()?;
    let mut record = Record::default();
    let about = "An endogenous oscillator sweeps the shoot in circles, and a vertical pole is in its way.";
    let mut film = options.flag("film").then(|| Film::new("Circumnutating shoot and a pole", about, 1.0));
    let progress = Progress::new("twining");
    let clock = Instant::now();
    let error = setup.run(&mut shoot, |shoot| {
        record.add(shoot, &setup);
        film.iter_mut().for_each(|film| film.push(Frame::of(shoot, None)));
        progress.set(shoot.time() / setup.end);
        Ok(())
    })?;
    progress.finish();
    println!("run time {:.3} s", clock.elapsed().as_secs_f64());
    if record.rows.is_empty() {
        return Err(error.map_or("the run has no step".into(), Box::from));
    }
    let touched: Vec<bool> = record.rows.iter().map(|row| row[6] > 0.0).collect();
    let share = touched.iter().filter(|touches| **touches).count() as f64 / touched.len() as f64;
    let turns = record.rows.iter().map(|row| row[5]).fold(0.0, |most: f64, turns| most.max(turns.abs()));
    println!("length after {:.2} h: {:.2} cm", shoot.time() / HOUR, 100.0 * shoot.rod().length());
    if let Some(first) = touched.iter().position(|touches| *touches) {
        println!(
            "  first contact at {:.2} h, in contact for {:.0} % of the time",
            record.rows[first][0] / HOUR,
            100.0 * share
        );
    }
    println!("  largest turning angle about the pole: {turns:.3} turns");
    let gained = touched.windows(2).filter(|pair| !pair[0] && pair[1]).count();
    println!(
        "  contact gained {gained} times, at most {:.0} contacts at a time",
        record.rows.iter().map(|row| row[6]).fold(0.0, f64::max)
    );
    record.write(&setup, &out)?;
    if let Some(film) = film {
        film.write(out.join("film.html"))?;
        println!("wrote film.html for the browser");
    }
    println!("wrote tip.csv, contact.csv, side.svg, above.svg and contact.svg to {}", out.display());
    error.map_or(Ok(()), |error| Err(error.into()))
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
