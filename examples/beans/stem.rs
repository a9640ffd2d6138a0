//! The model of an event: a graded stem whose curvature rotates pushes a support.

use std::f64::consts::{FRAC_PI_2, TAU};

use morphorod::constitutive::{Graded, LinearElastic, Tissue};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::support::{Contact, Distance, Hold, Obstacle, Support};
use morphorod::tropism::{Growing, TropismLaw};
use morphorod::{Order, Shoot, Still};
use nalgebra::{Matrix3, Vector3};

use crate::data::{Event, modulus, radius};

/// Growth time of the differential growth, s. The law divides by it, so that it has no effect.
const GROWTH_TIME: f64 = 3600.0;
/// Radius of the support, a straw, m. It is not in the table.
const STRAW: f64 = 2e-3;
/// Number of time steps of a period.
const STEPS: u32 = 80;
/// Angle by which the stem is before the support at t = 0, rad.
const BEFORE: f64 = 0.02;
/// Share of a period that is simulated. The force without slip has its maximum at one half.
const SHARE: f64 = 0.75;

/// A reading of the measured geometry and stiffness.
#[derive(Debug, Clone, Copy)]
pub struct Reading {
    pub name: &'static str,
    /// Share of the arm, from its base, that is curved. The stem turns by a right angle there.
    pub curved: f64,
    /// Whether the upright part bends and twists.
    pub upright_yields: bool,
    /// Whether the modulus varies along the stem. Otherwise it is that of the place of contact.
    pub graded: bool,
}

/// The whole stem bends and twists.
pub const MAIN: Reading = Reading {
    name: "whole stem",
    curved: 0.5,
    upright_yields: true,
    graded: true,
};

/// The upright part is rigid, as on a stake.
pub const CLAMPED: Reading = Reading {
    name: "rigid upright part",
    upright_yields: false,
    ..MAIN
};

/// Other readings, which are compared without slip.
pub const OTHERS: [Reading; 4] = [
    Reading {
        name: "curved over a tenth of the arm",
        curved: 0.1,
        ..MAIN
    },
    Reading {
        name: "curved over the whole arm",
        curved: 1.0,
        ..MAIN
    },
    Reading {
        name: "rigid, curved over the whole arm",
        curved: 1.0,
        ..CLAMPED
    },
    Reading {
        name: "modulus of the place of contact",
        graded: false,
        ..MAIN
    },
];

/// Curvature of the arm whose direction rotates about the stem with the period of circumnutation.
#[derive(Debug, Clone, Copy)]
struct Rotating {
    /// Distances of the curved part from the apex, m.
    part: [f64; 2],
    /// 1/m.
    curvature: f64,
    /// rad/s.
    frequency: f64,
}

impl Rotating {
    fn strain(&self, from_apex: f64, time: f64) -> Vector3<f64> {
        let (sin, cos) = (self.frequency * time - BEFORE).sin_cos();
        let inside = from_apex > self.part[0] && from_apex < self.part[1];
        Vector3::new(-sin, cos, 0.0) * if inside { self.curvature } else { 0.0 }
    }
}

impl TropismLaw for Rotating {
    fn gradient(&self, at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        // The derivative of a rotating vector is perpendicular to it.
        let quarter = FRAC_PI_2 / self.frequency;
        self.strain(at.initial_apex_distance, at.time + quarter) * (self.frequency * GROWTH_TIME)
    }

    fn shortest_period(&self) -> f64 {
        TAU / self.frequency
    }
}

/// A vertical straw that yields like a pendulum.
struct Straw {
    through: Vector3<f64>,
    /// m/N.
    compliance: f64,
}

impl Obstacle for Straw {
    fn distance(&self, place: &Vector3<f64>, _time: f64) -> Distance {
        let across = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0));
        let from = across * (place - self.through);
        let norm = from.norm().max(f64::MIN_POSITIVE);
        let normal = from / norm;
        let curvature = (across - normal * normal.transpose()) / norm;
        Distance {
            value: norm - STRAW,
            normal,
            curvature,
        }
    }

    fn compliance(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(self.compliance, self.compliance, 0.0))
    }
}

/// How the stem holds on to the support.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grip {
    /// The place of contact is fixed to the support.
    NoSlip,
    /// Coulomb's law with a coefficient of friction.
    Friction(f64),
}

/// Predicted force.
#[derive(Debug, Clone, Copy)]
pub struct Force {
    /// Maximum of the horizontal force, N.
    pub peak: f64,
    /// Angular frequency of the sine from the beginning of the contact that fits the force best,
    /// rad/s.
    pub frequency: f64,
    /// Time in contact over the period, at most [`SHARE`].
    pub contact: f64,
}

/// Simulates an event.
pub fn simulate(
    event: &Event,
    reading: &Reading,
    grip: Grip,
) -> Result<Force, Box<dyn std::error::Error>> {
    let curved = event.arm * reading.curved;
    let angle = |s: f64| FRAC_PI_2 * (s / curved).min(1.0);
    // Distance of the place of contact from the vertical through the upright part, and its height:
    // integrals over an arc and a straight part.
    let s = event.arm - event.contact;
    let (sin, cos) = angle(s).sin_cos();
    let rho = curved / FRAC_PI_2;
    let out = rho * (1.0 - cos) + (s - curved).max(0.0);
    let place = Vector3::new(out, 0.0, event.height + rho * sin);
    match grip {
        Grip::NoSlip => {
            let k = event.stiffness();
            // The support does not stretch: vertically it is much stiffer than a pendulum.
            let stiffness = Matrix3::from_diagonal(&Vector3::new(k, k, 1e3 * k));
            run(
                event,
                reading,
                Hold::place(event.contact).spring(place, stiffness),
            )
        }
        Grip::Friction(friction) => {
            let shoot = radius(event.contact);
            let through = place + Vector3::y() * (STRAW + shoot);
            let obstacle = Straw {
                through,
                compliance: 1.0 / event.stiffness(),
            };
            run(
                event,
                reading,
                Contact {
                    obstacle,
                    radius: shoot,
                    friction,
                },
            )
        }
    }
}

fn run(
    event: &Event,
    reading: &Reading,
    support: impl Support,
) -> Result<Force, Box<dyn std::error::Error>> {
    let (length, arm, contact) = (event.length(), event.arm, event.contact);
    let curved = arm * reading.curved;
    let law = Rotating {
        part: [arm - curved, arm],
        curvature: FRAC_PI_2 / curved,
        frequency: TAU / event.period,
    };
    let (graded, yields) = (reading.graded, reading.upright_yields);
    let factor = move |tissue: &Tissue| {
        let from_tip = tissue.initial_apex_distance;
        match from_tip > arm && !yields {
            true => 1e3 * modulus(from_tip),
            false => modulus(if graded { from_tip } else { contact }),
        }
    };
    // Elements end at the ends of the curved part and at the place of contact.
    let mut nodes = vec![0.0, 0.5 * event.height, event.height];
    nodes.extend((1..=8).map(|i| event.height + curved * f64::from(i) / 8.0));
    nodes.extend((1..=4).map(|i| event.height + curved + (arm - curved) * f64::from(i) / 4.0));
    nodes.push(length - contact);
    nodes.sort_by(f64::total_cmp);
    nodes.dedup_by(|b, a| *b - *a < 1e-9 * length);
    let mut shoot = Shoot::builder(Graded {
        law: LinearElastic {
            youngs_modulus: 1.0,
            poissons_ratio: 0.5,
        },
        factor,
    })
    .length(length)
    .nodes(&nodes)
    .section(move |s: f64| radius((length - s).max(0.0)))
    .order(Order::Four)
    .growth(Ongoing(UniformGrowth {
        zone_length: 2.0 * length,
        time: GROWTH_TIME,
    }))
    .tropism(law)
    .scene(Still::weightless())
    .support(support)
    .build()?;
    shoot.set_intrinsic(|point| law.strain(point.initial_apex_distance, 0.0));
    let step = event.period / f64::from(STEPS);
    let mut integrator = MethodOfSteps {
        retries: 10,
        ..MethodOfSteps::new(step)
    };
    // Times since the contact began, s, and horizontal forces, N.
    let mut forces: Vec<[f64; 2]> = Vec::new();
    let steps = (SHARE * f64::from(STEPS)).round() as u32;
    for k in 0..=steps {
        let time = step * f64::from(k);
        integrator.advance(&mut shoot, time)?;
        let reactions = shoot.reactions();
        if !reactions.is_empty() {
            let force = reactions
                .iter()
                .map(|reaction| reaction.force)
                .sum::<Vector3<f64>>();
            forces.push([time - BEFORE / TAU * event.period, force.xy().norm()]);
        } else if !forces.is_empty() {
            break;
        }
    }
    let last = forces.last().ok_or("the stem does not reach the support")?[0];
    let peak = forces.iter().map(|[_, force]| *force).fold(0.0, f64::max);
    Ok(Force {
        peak,
        frequency: frequency(&forces, event.half_frequency()),
        contact: last / event.period,
    })
}

/// Angular frequency w (rad/s) of the sine A sin(w t) with the least square deviation from forces
/// over time. It is between a quarter and eight times a given one.
fn frequency(forces: &[[f64; 2]], near: f64) -> f64 {
    let deviation = |w: f64| {
        let sines = || forces.iter().map(|[time, force]| ((w * time).sin(), force));
        let (square, product) = sines().fold((0.0, 0.0), |(a, b), (sine, force)| {
            (a + sine * sine, b + sine * force)
        });
        // The sum of squares of the forces is the same for all frequencies.
        -product * product / square.max(f64::MIN_POSITIVE)
    };
    // Ratios are 2^(i/100).
    let trials = (-200..=300).map(|i| near * (f64::from(i) / 100.0).exp2());
    trials
        .min_by(|a, b| deviation(*a).total_cmp(&deviation(*b)))
        .unwrap_or(near)
}
