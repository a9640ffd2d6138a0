//! Synthetic table of a tracker: the tip of a simulated shoot and a fixed stake, in frames and
//! pixels, with y downwards.

use std::error::Error;
use std::fmt::Write;

use morphorod::ShootParameters;
use morphorod::integrator::{Integrator, MethodOfSteps};

const MINUTE: f64 = 60.0;

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
    // The shoot of the example `growing_shoot`.
    let mut shoot = ShootParameters::default().shoot().build()?;
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
