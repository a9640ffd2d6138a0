//! Synthetic table of a tracker: the tip of a simulated shoot and a fixed stake, in frames and
//! pixels, with y downwards.

use std::error::Error;
use std::fmt::Write;

use morphorod::constitutive::{Lignifying, LinearElastic};
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::tropism::{Gravitropism, Memory, Oscillator, Proprioception, Response, Statoliths};
use morphorod::{Model, ParameterError, Shoot};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
const DAY: f64 = 86400.0;

/// Time between frames, s.
pub const FRAME: f64 = 2.0 * MINUTE;
/// Size of a pixel, m.
pub const PIXEL: f64 = 0.1e-3;
/// Number of frames, for 36 h.
const FRAMES: u32 = 1080;
/// Centre of the image, where the base of the shoot is, in pixels.
const CENTRE: [f64; 2] = [640.0, 512.0];
/// Standard deviation of the noise of a coordinate, in pixels, typical of trackers.
const NOISE: f64 = 0.4;
/// Largest displacement of an outlier, in pixels.
const ASTRAY: f64 = 150.0;
/// Drift of the stage over all frames, in pixels.
const DRIFT: [f64; 2] = [60.0, -35.0];
/// Frames without light.
const DARK: std::ops::Range<u32> = 630..690;

/// The shoot of the example `growing_shoot`.
fn shoot() -> Result<Shoot<impl Model>, ParameterError> {
    let memory = Memory {
        time: 12.0 * MINUTE,
        delay: 12.0 * MINUTE,
    };
    let young = LinearElastic {
        youngs_modulus: 10e6,
        poissons_ratio: 0.5,
    };
    Shoot::builder(Lignifying {
        young,
        mature_modulus: 200.0 * young.youngs_modulus,
        time: 6.0 * DAY,
    })
    .length(0.068)
    .radius(0.5e-3)
    .growth(UniformGrowth {
        zone_length: 0.07,
        time: 40.0 * HOUR,
    })
    .tropism((
        Oscillator::new(0.2, 24.0 * MINUTE),
        Gravitropism {
            sensitivity: 0.8,
            perception: Statoliths {
                avalanche_time: 2.0 * MINUTE,
            },
        }
        .remembered(memory),
        Proprioception { sensitivity: 20.0 }.remembered(memory),
    ))
    .load(Weight { density: 1000.0 })
    .build()
}

/// Pseudo-random numbers that are the same in every run (xorshift).
struct Draw(u64);

impl Draw {
    /// Uniformly distributed number from 0 to 1.
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Two independent numbers with the standard normal distribution (Box and Muller).
    fn normal(&mut self) -> [f64; 2] {
        let size = (-2.0 * (self.unit() + f64::MIN_POSITIVE).ln()).sqrt();
        let (sine, cosine) = (std::f64::consts::TAU * self.unit()).sin_cos();
        [size * cosine, size * sine]
    }
}

/// Returns the table: the tip from above and a stake beside it, with noise, drift of the stage,
/// lost frames, outliers and two hours without light.
pub fn table() -> Result<String, Box<dyn Error>> {
    let mut shoot = shoot()?;
    let mut run = MethodOfSteps::new(90.0);
    let mut draw = Draw(0x5eed_0f1e_55ed_0071);
    let mut text = String::from(
        "# Made by `cargo run --release --example tracked_tip -- --make FILE`: a simulated shoot.\n",
    );
    text += "# A frame is 120 s, a pixel 0.1 mm; y points down.\nframe,track,x,y\n";
    for frame in 0..FRAMES {
        run.advance(&mut shoot, FRAME * f64::from(frame))?;
        let tip = shoot.tip();
        let part = f64::from(frame) / f64::from(FRAMES);
        for (track, place) in [
            ("tip", [tip.x / PIXEL, -tip.y / PIXEL]),
            ("stake", [-310.0, 225.0]),
        ] {
            let (noise, lost, astray) = (draw.normal(), draw.unit() < 0.03, draw.unit() < 0.01);
            let off = [draw.unit() - 0.5, draw.unit() - 0.5];
            if lost || DARK.contains(&frame) {
                continue;
            }
            let at = [0, 1].map(|c| {
                let far = if astray { 2.0 * ASTRAY * off[c] } else { 0.0 };
                CENTRE[c] + place[c] + DRIFT[c] * part + NOISE * noise[c] + far
            });
            writeln!(text, "{frame},{track},{:.2},{:.2}", at[0], at[1])?;
        }
    }
    Ok(text)
}
