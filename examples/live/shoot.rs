//! Shoot of the live page: numbered parameters, their change during the simulation, and the data
//! that the page draws.

use std::cell::Cell;
use std::error::Error;
use std::rc::Rc;

use morphorod::constitutive::{Lignifying, LinearElastic};
use morphorod::growth::{GrowthLaw, Ongoing, UniformGrowth};
use morphorod::integrator::{ConstantHistory, Integrator, MethodOfSteps};
use morphorod::load::{Cut, Load, Pulse, Weight, Whirl};
use morphorod::nalgebra::Vector3;
use morphorod::stability::{Linearisation, onset};
use morphorod::support::Contact;
use morphorod::tracking::{Search, Track};
use morphorod::tropism::{
    Gravitropism, Handedness, Memory, Oscillator, Proprioception, Remembered, Response, Statoliths,
};
use morphorod::{Environment, Laws, Shoot, ShootParameters, Still};

use morphorod_plot::Frame;

use super::pole::{Motion, Pole};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// Radius, m.
const RADIUS: f64 = 5e-4;
/// Density, kg/m³.
const DENSITY: f64 = 1000.0;
/// Interval (s) at which the tip position is stored. Period and amplitude are computed from these
/// positions.
const EVERY: f64 = 2.0 * MINUTE;
/// Duration of the stored tip track divided by the sum of memory time and reaction time. The stored
/// duration is at least 6 h. A period is about four of these sums. Several periods are needed to
/// distinguish the oscillation from the drift.
const RECENT: f64 = 12.0;
/// Largest number of positions from which period and amplitude are computed. The run time grows
/// quadratically with this number.
const MOST_READ: usize = 240;
/// Largest time step, s.
const STEP: f64 = MINUTE;
/// Largest speed of the pole, m/s: 1 mm in the largest time step.
const SPEED: f64 = 1e-3 / MINUTE;
/// Smallest gap between the pole and the base, m.
const GAP: f64 = 1e-3;

/// Parameters that the page can change, in the units of the page. The page refers to them by their
/// indices.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(usize)]
pub enum Parameter {
    /// Amplitude α of the oscillator.
    Alpha,
    /// Gravitropic sensitivity β.
    Beta,
    /// Proprioceptive sensitivity η.
    Eta,
    /// Growth time τg, h.
    GrowthTime,
    /// Memory time τm = τ̄m, min.
    MemoryTime,
    /// Reaction time τr = τ̄r, min.
    ReactionTime,
    /// Gravitational acceleration |g|, m/s².
    Gravity,
    /// Young's modulus E0 of young tissue, MPa.
    Stiffness,
    /// Tilt of the base towards e1, degrees.
    Tilt,
    /// Period τe of the oscillator, min.
    OscillatorPeriod,
    /// Sense of rotation of the oscillator: 1 for counterclockwise, −1 for clockwise.
    OscillatorSense,
    /// Component of the user's force on the apex along e1, µN.
    PushX,
    /// Component of the user's force on the apex along e2, µN.
    PushY,
    /// Component of the user's force on the apex along e3, µN.
    PushZ,
    /// Initial length, cm.
    Length,
    /// 1 if the shoot grows in length, 0 if its length is constant.
    Grows,
    /// Initial perturbation: 0 for none, 1 for the two pulses of the fourth video, 2 for the
    /// rotating force of the fifth and sixth videos.
    Kick,
    /// Component of the place of the pole along e1, mm.
    PoleX,
    /// Component of the place of the pole along e2, mm.
    PoleY,
    /// Radius of the pole, mm; zero without a pole.
    PoleRadius,
}
use Parameter as P;

/// Number of parameters.
pub const PARAMETERS: usize = P::PoleRadius as usize + 1;

/// Parameters of the shoot of the second video.
const DEFAULTS: [f64; PARAMETERS] = [
    0.2, 0.8, 20.0, 40.0, 12.0, 12.0, 9.81, 10.0, 0.0, 24.0, 1.0, 0.0, 0.0, 0.0, 6.8, 1.0, 0.0,
    20.0, 0.0, 0.0,
];

type Steering = (
    Remembered<Gravitropism<Statoliths>>,
    Remembered<Proprioception>,
    Oscillator,
);
type Loads = (Weight, Hand, Option<(Pulse, Pulse)>, Option<Whirl>);
type Model = Laws<
    Lignifying,
    Box<dyn GrowthLaw + Send + Sync>,
    Steering,
    Loads,
    Still,
    Option<Contact<Pole>>,
>;
type Failure = Box<dyn Error>;

/// Constant force on the apex, N, in the fixed frame.
#[derive(Debug, Clone, Copy)]
pub struct Hand(Vector3<f64>);

impl Load for Hand {
    fn force(&self, _cut: &Cut, _environment: &Environment) -> Vector3<f64> {
        self.0
    }
}

/// Period and amplitude of the largest oscillation in the stored tip track.
#[derive(Debug, Clone, Copy)]
pub struct Reading {
    /// Period, s.
    pub period: f64,
    /// Semi-axes of the ellipse, m. The second is negative if the sense of rotation is clockwise.
    pub axes: [f64; 2],
}

/// Simulation of a shoot with its parameters and its stored tip track.
pub struct Live {
    values: [f64; PARAMETERS],
    motion: Rc<Cell<Motion>>,
    shoot: Shoot<Model>,
    tips: Vec<(f64, Vector3<f64>)>,
}

impl Live {
    /// Returns the shoot of the second video at t = 0.
    pub fn new() -> Result<Self, Failure> {
        let motion = Rc::new(Cell::new(Motion::at_rest(requested(&DEFAULTS))));
        let shoot = build(&DEFAULTS, &motion)?;
        let mut live = Self {
            values: DEFAULTS,
            motion,
            shoot,
            tips: Vec::new(),
        };
        live.restart()?;
        Ok(live)
    }

    /// Value of a parameter, or `None` if its number is invalid.
    pub fn value(&self, number: usize) -> Option<f64> {
        self.values.get(number).copied()
    }

    /// Changes a parameter during the simulation. Initial length, growth and perturbation take
    /// effect at the next restart. The pole moves to another place while the simulation advances.
    pub fn set(&mut self, number: usize, value: f64) -> Result<(), Failure> {
        let mut values = self.values;
        *values
            .get_mut(number)
            .ok_or_else(|| format!("there is no parameter {number}"))? = value;
        if number == P::PoleRadius as usize {
            // A thicker pole must not contain the base.
            let place = self.motion.get().at(self.shoot.time());
            self.motion
                .set(Motion::at_rest(beside_base(place, &values)));
        }
        if number < P::Length as usize || number == P::PoleRadius as usize {
            // The change fails if a new delay is longer than the history. The shoot is then
            // restarted with the stimuli of its first equilibrium at all earlier times.
            self.shoot = self
                .shoot
                .with_model(model(&values, &self.motion))
                .or_else(|_| {
                    let mut shoot = self
                        .shoot
                        .with_model_restarted(model(&values, &self.motion))?;
                    integrator(&values).start(&mut shoot, &ConstantHistory::Steady)?;
                    Ok::<_, Failure>(shoot)
                })?;
        }
        self.values = values;
        Ok(())
    }

    /// Restarts the simulation at t = 0 with the current parameters.
    pub fn restart(&mut self) -> Result<(), Failure> {
        self.motion.set(Motion::at_rest(beside_base(
            requested(&self.values),
            &self.values,
        )));
        let mut shoot = build(&self.values, &self.motion)?;
        integrator(&self.values).start(&mut shoot, &ConstantHistory::Empty)?;
        self.tips = vec![(0.0, shoot.tip())];
        self.shoot = shoot;
        Ok(())
    }

    /// Advances the simulation by a number of seconds.
    pub fn advance(&mut self, seconds: f64) -> Result<(), Failure> {
        let (until, mut integrator) = (self.shoot.time() + seconds, integrator(&self.values));
        self.move_pole(seconds);
        loop {
            let next = self.tips.last().map_or(0.0, |(time, _)| time + EVERY);
            integrator.advance(&mut self.shoot, next.min(until))?;
            if next > until {
                break;
            }
            self.tips.push((next, self.shoot.tip()));
        }
        let recent = RECENT
            * MINUTE
            * (self.values[P::MemoryTime as usize] + self.values[P::ReactionTime as usize]);
        let old = self
            .tips
            .partition_point(|(time, _)| *time < until - recent.max(6.0 * HOUR));
        self.tips.drain(..old);
        Ok(())
    }

    /// Moves the pole towards the requested place during the next seconds, round the base.
    fn move_pole(&self, seconds: f64) {
        let (motion, time) = (self.motion.get(), self.shoot.time());
        let now = motion.at(time);
        let step = (requested(&self.values) - now).cap_magnitude(SPEED * seconds);
        self.motion
            .set(motion.then(beside_base(now + step, &self.values), time, seconds));
    }

    /// Current shape of the shoot for a drawing.
    pub fn look(&self) -> Frame {
        Frame::of(&self.shoot, Some(0))
    }

    /// Tip position, m.
    pub fn tip(&self) -> Vector3<f64> {
        self.shoot.tip()
    }

    /// Place of the pole on the floor and its radius, m. The radius is zero without a pole.
    pub fn pole(&self) -> [f64; 3] {
        let place = self.motion.get().at(self.shoot.time());
        [place.x, place.y, 1e-3 * self.values[P::PoleRadius as usize]]
    }

    /// Largest oscillation in the stored tip track, viewed from above. `None` if no oscillation is
    /// found.
    pub fn read(&self) -> Option<Reading> {
        let (times, places): (_, Vec<_>) = self
            .tips
            .iter()
            .step_by(self.tips.len().div_ceil(MOST_READ))
            .copied()
            .unzip();
        let path = Track::seen_along(&Vector3::z(), times, &places).ok()?;
        let search = Search {
            most: 2,
            ..Search::default()
        };
        let largest = *path.oscillations(&search).ok()?.oscillations.first()?;
        let sign = if largest.ellipse.sense == Some(Handedness::Clockwise) {
            -1.0
        } else {
            1.0
        };
        Some(Reading {
            period: largest.period,
            axes: [largest.ellipse.major, sign * largest.ellipse.minor],
        })
    }

    /// Self-buckling length (m) of an upright shoot with the current parameters, by Greenhill's
    /// formula.
    pub fn buckling_length(&self) -> f64 {
        let parameters = ShootParameters {
            youngs_modulus: 1e6 * self.values[P::Stiffness as usize],
            ..ShootParameters::default()
        };
        parameters.self_buckling_length(self.values[P::Gravity as usize])
    }

    /// Critical length (m) at which oscillations begin, for a shoot that responds to stimuli along
    /// its whole length. `None` if there is no such length or no steady state.
    pub fn critical_length(&self) -> Option<f64> {
        let longest = self.buckling_length();
        let laws = model(&self.values, &self.motion);
        let elastic = laws.constitutive.young;
        let (gravitropism, bending, _) = laws.tropism;
        let at = |length: f64| {
            let shoot = Shoot::builder(elastic)
                .length(length)
                .radius(RADIUS)
                .growth(Ongoing(UniformGrowth {
                    zone_length: 2.0 * length,
                    time: self.growth_time(),
                }))
                .tropism((gravitropism, bending))
                .load(Weight { density: DENSITY })
                .scene(Still {
                    base: Still::upright().base,
                    ..laws.scene
                })
                .build()?;
            Linearisation::about(&shoot)
        };
        if !longest.is_finite() {
            return None;
        }
        onset(at, 0.2 * longest, 0.99 * longest)
            .ok()
            .map(|found| found.parameters[0])
    }

    fn growth_time(&self) -> f64 {
        HOUR * self.values[P::GrowthTime as usize]
    }
}

fn integrator(values: &[f64; PARAMETERS]) -> MethodOfSteps {
    MethodOfSteps::new(STEP.min(MINUTE * values[P::ReactionTime as usize]))
}

/// Requested place of the pole, m.
fn requested(values: &[f64; PARAMETERS]) -> Vector3<f64> {
    1e-3 * Vector3::new(values[P::PoleX as usize], values[P::PoleY as usize], 0.0)
}

/// Returns the place nearest to another one (m) at which there is a gap between pole and base.
fn beside_base(place: Vector3<f64>, values: &[f64; PARAMETERS]) -> Vector3<f64> {
    let (far, least) = (
        place.norm(),
        1e-3 * values[P::PoleRadius as usize] + RADIUS + GAP,
    );
    if far > 0.0 {
        place * (least / far).max(1.0)
    } else {
        least * Vector3::x()
    }
}

fn model(values: &[f64; PARAMETERS], motion: &Rc<Cell<Motion>>) -> Model {
    let of = |parameter: Parameter| values[parameter as usize];
    let memory = Memory {
        time: MINUTE * of(P::MemoryTime),
        delay: MINUTE * of(P::ReactionTime),
    };
    let young = LinearElastic {
        youngs_modulus: 1e6 * of(P::Stiffness),
        poissons_ratio: 0.5,
    };
    let (zone_length, time) = (0.07, HOUR * of(P::GrowthTime));
    let growth: Box<dyn GrowthLaw + Send + Sync> = if of(P::Grows) > 0.0 {
        Box::new(UniformGrowth { zone_length, time })
    } else {
        // The whole shoot responds to stimuli, because a zone of 1 m is longer than all shoots.
        Box::new(Ongoing(UniformGrowth {
            zone_length: 1.0,
            time,
        }))
    };
    let handedness = if of(P::OscillatorSense) > 0.0 {
        Handedness::Counterclockwise
    } else {
        Handedness::Clockwise
    };
    let statoliths = Statoliths {
        avalanche_time: 2.0 * MINUTE,
    };
    let upright = Still::tilted(of(P::Tilt).to_radians());
    let kicks = |x: f64, y: f64, start: f64| Pulse {
        peak: 1e-5 * Vector3::new(x, y, 0.0),
        start: start * MINUTE,
        duration: 12.0 * MINUTE,
    };
    Laws {
        constitutive: Lignifying {
            young,
            mature_modulus: 200.0 * young.youngs_modulus,
            time: 144.0 * HOUR,
        },
        growth,
        tropism: (
            Gravitropism {
                sensitivity: of(P::Beta),
                perception: statoliths,
            }
            .remembered(memory),
            Proprioception {
                sensitivity: of(P::Eta),
            }
            .remembered(memory),
            Oscillator {
                handedness,
                ..Oscillator::new(of(P::Alpha), MINUTE * of(P::OscillatorPeriod))
            },
        ),
        load: (
            Weight { density: DENSITY },
            Hand(1e-6 * Vector3::new(of(P::PushX), of(P::PushY), of(P::PushZ))),
            (of(P::Kick) == 1.0).then(|| (kicks(2.0, 1.0, 0.0), kicks(1.0, -2.0, 1800.0))),
            (of(P::Kick) == 2.0).then_some(Whirl {
                force: 1e-5,
                period: 93.0 * MINUTE,
                turns: 2.0,
            }),
        ),
        scene: Still {
            gravity: Vector3::new(0.0, 0.0, -of(P::Gravity)),
            ..upright
        },
        support: (of(P::PoleRadius) > 0.0).then(|| {
            let obstacle = Pole {
                radius: 1e-3 * of(P::PoleRadius),
                motion: motion.clone(),
            };
            Contact {
                obstacle,
                radius: RADIUS,
                friction: 0.0,
            }
        }),
    }
}

fn build(values: &[f64; PARAMETERS], motion: &Rc<Cell<Motion>>) -> Result<Shoot<Model>, Failure> {
    let elements = if values[P::Grows as usize] > 0.0 {
        8
    } else {
        6
    };
    let length = 0.01 * values[P::Length as usize];
    let mut builder = Shoot::of(model(values, motion))
        .length(length)
        .radius(RADIUS)
        .elements(elements);
    if values[P::Grows as usize] == 0.0 {
        // The growth zone is longer than the shoot. The nodes are equally spaced along the shoot.
        let nodes: Vec<f64> = (0..=elements)
            .map(|i| length * i as f64 / elements as f64)
            .collect();
        builder = builder.nodes(&nodes);
    }
    Ok(builder.build()?)
}
