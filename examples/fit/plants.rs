//! The family of shoots of this example, and synthetic data.

use std::f64::consts::PI;
use std::ops::Range;

use morphorod::constitutive::{Lignifying, LinearElastic};
use morphorod::equilibrium::NewtonSolver;
use morphorod::fit::{Family, Parameter, Series, View};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{Pulse, Weight};
use morphorod::tropism::{
    Gravitropism, Handedness, Memory, Oscillator, Proprioception, Response, SettledStatoliths,
};
use morphorod::{DynLaws, ParameterError, Shoot, Still};
use nalgebra::Vector3;

const HOUR: f64 = 3600.0;

/// Names of the parameters, their values in SI units, and the ratio of their bounds to these
/// values.
pub const PARAMETERS: [(&str, f64, f64); 22] = [
    ("beta", 0.8, 10.0),
    ("eta", 20.0, 10.0),
    ("tau_m", 720.0, 5.0),
    ("tau_r", 720.0, 5.0),
    ("tau_g", 40.0 * HOUR, 5.0),
    ("l_g", 0.07, 5.0),
    ("alpha", 0.0, 10.0),
    ("tau_e", 1440.0, 1.5),
    ("phase", 0.0, 1.0),
    ("E", 1e7, 5.0),
    ("l_0", 0.068, 2.0),
    ("bend_x", 0.0, 1.0),
    ("bend_y", 0.0, 1.0),
    ("r", 5e-4, 3.0),
    ("rho", 1000.0, 2.0),
    ("stiffening", 200.0, 10.0),
    ("tau_l", 144.0 * HOUR, 10.0),
    ("tilt", 0.0, 1.0),
    ("push_x", 0.0, 1.0),
    ("push_y", 0.0, 1.0),
    ("push_z", 0.0, 1.0),
    ("push_time", 720.0, 2.0),
];

/// Text of `--help` about the names in [`PARAMETERS`].
pub const NAMES: &str = "given values, and initial values of free parameters, in SI units: beta, eta, tau_m, tau_r, \
                         tau_g, l_g, E, l_0; oscillator alpha, tau_e, phase; initial curvature bend_x, bend_y; radius \
                         r; density rho; stiffening, the modulus of mature tissue over E, and its time tau_l; tilt of \
                         the base; largest force at the tip during the first push_time, push_x, push_y, push_z";

/// Index in [`PARAMETERS`] of the parameter with a name.
pub fn index(name: &str) -> Option<usize> {
    PARAMETERS.iter().position(|(other, ..)| *other == name)
}

/// Indices in [`PARAMETERS`] of the sensitivity, period and phase of the oscillator.
pub const OSCILLATOR: Range<usize> = 6..9;

/// Largest initial curvature of a fit, 1/m, which is that of a circle with a radius of 2 cm.
const MOST_BENT: f64 = 50.0;

/// Largest force of a push in a fit, N, ten times the weight of the default shoot.
const HARDEST: f64 = 5e-3;

/// Part of the shoot that a camera shows, and the view.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// Twenty points of the centre line in space.
    Lines,
    /// The tip in space.
    Tip,
    /// The tip from above.
    Above,
}

/// Properties of the shoot that are not parameters of the fit.
#[derive(Clone, Copy)]
pub struct Plant {
    /// Whether the length is constant while differential growth continues.
    pub constant: bool,
    /// Young's modulus of mature tissue, Pa. For `None` it is that of young tissue times the
    /// stiffening.
    pub mature_modulus: Option<f64>,
    /// Memory and delay of proprioception. For `None` they are those of gravitropism.
    pub proprioceptive: Option<Memory>,
    /// Sense of rotation of the internal oscillator.
    pub handedness: Handedness,
}

impl Plant {
    /// Shoot with the given values of [`PARAMETERS`] and an oscillator.
    pub fn build(
        self,
        p: &[f64],
        oscillator: Oscillator,
    ) -> Result<Shoot<DynLaws>, ParameterError> {
        let memory = Memory {
            time: p[2],
            delay: p[3],
        };
        let push = Pulse {
            peak: Vector3::new(p[18], p[19], p[20]),
            start: 0.0,
            duration: p[21],
        };
        let young = LinearElastic {
            youngs_modulus: p[9],
            poissons_ratio: 0.5,
        };
        let mature_modulus = self.mature_modulus.unwrap_or(p[15] * p[9]);
        let shoot = Shoot::builder(Lignifying {
            young,
            mature_modulus,
            time: p[16],
        })
        .length(p[10])
        .radius(p[13])
        .load((Weight { density: p[14] }, push))
        .scene(Still::tilted(p[17]));
        let growth = UniformGrowth {
            zone_length: p[5],
            time: p[4],
        };
        let proprioception =
            Proprioception { sensitivity: p[1] }.remembered(self.proprioceptive.unwrap_or(memory));
        let gravitropism = Gravitropism {
            sensitivity: p[0],
            perception: SettledStatoliths,
        }
        .remembered(memory);
        let shoot = shoot.tropism((oscillator, gravitropism, proprioception));
        let mut shoot = if self.constant {
            shoot
                .growth(Ongoing(UniformGrowth {
                    zone_length: 1.0,
                    ..growth
                }))
                .into_dyn()
                .build()?
        } else {
            shoot.growth(growth).into_dyn().build()?
        };
        let bend = Vector3::new(p[11], p[12], 0.0);
        if bend != Vector3::zeros() {
            shoot.set_intrinsic(|_| bend);
        }
        Ok(shoot)
    }

    /// Oscillator with the given values of [`PARAMETERS`].
    pub fn oscillator(self, p: &[f64]) -> Oscillator {
        Oscillator {
            sensitivity: p[6],
            period: p[7],
            phase: p[8],
            handedness: self.handedness,
        }
    }

    /// Family of these shoots. The initial values of the parameters in `free` are their `values`
    /// times `factor`, except for period, phase and initial curvature. The other parameters are
    /// fixed. `more` contains parameters of the camera.
    pub fn family(
        self,
        values: &[f64],
        free: &[&str],
        factor: f64,
        more: Vec<Parameter>,
    ) -> Family<impl Fn(&[f64]) -> Result<Shoot<DynLaws>, ParameterError> + Sync + use<>> {
        let parameter = |((name, _, range), value): (&(&str, f64, f64), &f64)| match *name {
            name if !free.contains(&name) => Parameter::fixed(name, *value),
            "bend_x" | "bend_y" => {
                Parameter::linear(name, [-MOST_BENT, MOST_BENT]).starting(*value)
            }
            "phase" => Parameter::linear(name, [value - PI, value + PI]),
            "tilt" => Parameter::linear(name, [-PI, PI]).starting(*value),
            "push_x" | "push_y" | "push_z" => {
                Parameter::linear(name, [-HARDEST, HARDEST]).starting(*value)
            }
            "alpha" if *value == 0.0 => {
                Parameter::linear(name, [0.0, 1.0]).starting(factor * value)
            }
            name => Parameter::positive(name, [value / range, value * range])
                .starting(value * if name == "tau_e" { 1.0 } else { factor }),
        };
        let parameters = PARAMETERS
            .iter()
            .zip(values)
            .map(parameter)
            .chain(more)
            .collect();
        Family {
            parameters,
            build: move |p: &[f64]| self.build(p, self.oscillator(p)),
        }
    }

    /// Data of the shoot with the given values: the measured points with normal noise (m). The
    /// array contains the duration (h), the time between frames (s) and the time step (s).
    pub fn measured(
        self,
        p: &[f64],
        [hours, interval, step]: [f64; 3],
        seen: Seen,
        noise: f64,
        draw: &mut Draw,
    ) -> Result<Series, Box<dyn std::error::Error>> {
        let mut shoot = self.build(p, self.oscillator(p))?;
        let mut integrator = MethodOfSteps::with_solver(step, NewtonSolver::with_tolerance(1e-11));
        let times: Vec<f64> = (1..=(hours * HOUR / interval) as u32)
            .map(|k| interval * f64::from(k))
            .collect();
        let mut frames = Vec::new();
        for time in &times {
            integrator.advance(&mut shoot, *time)?;
            let points = if seen == Seen::Lines {
                shoot.rod().centre_line_at(21).split_off(1)
            } else {
                vec![shoot.tip()]
            };
            frames.push(
                points
                    .iter()
                    .map(|p| p + Vector3::from_fn(|_, _| noise * draw.normal()))
                    .collect::<Vec<_>>(),
            );
        }
        let tips: Vec<_> = frames.iter().map(|frame| frame[frame.len() - 1]).collect();
        Ok(match seen {
            Seen::Lines => Series::centre_lines(times, frames),
            Seen::Tip => Series::tips(times, &tips),
            Seen::Above => {
                let track = tips
                    .iter()
                    .map(|p| nalgebra::Vector2::new(p.x, p.y))
                    .collect();
                Series::track(
                    &morphorod::tracking::Track::new(times, track)?,
                    View::above(),
                )
            }
        })
    }
}

/// Pseudorandom numbers by xorshift (G. Marsaglia, J. Stat. Softw. 8, 14, 2003).
pub struct Draw(u64);

impl Draw {
    /// Sequence with the given seed.
    pub fn new(seed: u64) -> Self {
        let mut draw = Self(seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        for _ in 0..20 {
            draw.uniform();
        }
        draw
    }

    /// Uniform number from 0 to 1.
    fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Standard normal number by Box and Muller's method.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (2.0 * PI * self.uniform()).cos()
    }
}
