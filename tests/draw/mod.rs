//! Random numbers for scenes that nobody has tried.

#![allow(dead_code)] // Every test uses a part of it.

use std::f64::consts::TAU;

use morphorod::orbit::PlanePath;
use nalgebra::{Vector2, Vector3};

/// A number of the environment, or a usual one.
pub fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).map_or(usual, |text| text.parse().unwrap())
}

/// Numbers that look random and are the same in every run (xorshift).
pub struct Draw(u64);

impl Draw {
    pub fn new(seed: u64) -> Self {
        let mut draw = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        (0..20).for_each(|_| _ = draw.unit());
        draw
    }

    pub fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn uniform(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.unit()
    }

    pub fn log(&mut self, from: f64, to: f64) -> f64 {
        self.uniform(from.ln(), to.ln()).exp()
    }

    pub fn chance(&mut self, of: f64) -> bool {
        self.unit() < of
    }

    pub fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.uniform(-size, size))
    }

    /// Two numbers that are normally distributed.
    pub fn normal(&mut self) -> Vector2<f64> {
        let (size, angle) = ((-2.0 * (self.unit() + f64::MIN_POSITIVE).ln()).sqrt(), TAU * self.unit());
        Vector2::new(size * angle.cos(), size * angle.sin())
    }
}

/// A path at even times (s).
pub fn path(count: u32, every: f64, at: impl FnMut(f64) -> Vector2<f64>) -> PlanePath {
    let times: Vec<f64> = (0..count).map(|k| every * f64::from(k)).collect();
    let positions = times.iter().copied().map(at).collect();
    PlanePath::new(times, positions).unwrap()
}

/// A place on a circle about the origin.
pub fn circle(t: f64, period: f64, radius: f64) -> Vector2<f64> {
    let (sine, cosine) = (TAU * t / period).sin_cos();
    Vector2::new(cosine, sine) * radius
}
