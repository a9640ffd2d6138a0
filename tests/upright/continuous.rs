//! The continuous problem of the upright shoot with memories of any kind, to rounding: EI [(1 + b) θ'' + a θ'] + q (ℓ − s) θ = 0,
//! θ(0) = 0, (1 + b) θ'(ℓ) + a θ(ℓ) = 0.

use morphorod::Shoot;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::load::Weight;
use morphorod::nalgebra::{Complex, Matrix2, Vector2};
use morphorod::stability::{Linearisation, StabilityError};
use morphorod::tropism::{Gravitropism, Memory, Proprioception, Response, SettledStatoliths};

use super::YOUNG;

/// An upright shoot but for its length: default radius, density and stiffness.
#[derive(Debug, Clone, Copy)]
pub struct Upright {
    pub beta: f64,
    pub eta: f64,
    pub gravity: Memory,
    pub bending: Memory,
    /// s.
    pub growth_time: f64,
}

impl Upright {
    /// As the crate sees it, on a mesh.
    pub fn linear(&self, length: f64, elements: usize) -> Result<Linearisation, StabilityError> {
        let shoot = Shoot::builder(YOUNG)
            .length(length)
            .radius(5e-4)
            .elements(elements)
            .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: self.growth_time }))
            .tropism((
                Gravitropism { sensitivity: self.beta, perception: SettledStatoliths }.remembered(self.gravity),
                Proprioception { sensitivity: self.eta }.remembered(self.bending),
            ))
            .load(Weight { density: 1000.0 })
            .build()?;
        Linearisation::about(&shoot)
    }

    /// (1 + b) θ' + a θ at the apex, relative to its larger term, for θ'(0) = 1. By Taylor series, element by element, in
    /// each of which the shortest wave turns by half a radian: 34 terms leave rounding.
    fn value(&self, z: Complex<f64>, length: f64) -> Complex<f64> {
        let filter = |memory: Memory| {
            let Memory { time, delay } = memory;
            (-z * delay).exp() / (z * self.growth_time * (z * time + 1.0))
        };
        let radius: f64 = 5e-4;
        let a = filter(self.gravity) * (self.beta / radius);
        let b = filter(self.bending) * self.eta + 1.0;
        let weight = 1000.0 * 9.81 * std::f64::consts::PI * radius * radius / YOUNG.stiffness(radius).x;
        let (wave, fall) = (a / b, b.inv() * weight);
        let parts = 4 + (2.0 * wave.norm() * length).ceil() as usize;
        let h = length / parts as f64;
        let (mut angle, mut slope) = (Complex::ZERO, Complex::ONE);
        for part in 0..parts {
            let above = length - h * part as f64;
            let mut terms = vec![angle, slope];
            for k in 0..34 {
                let before = if k > 0 { terms[k - 1] } else { Complex::ZERO };
                let bend = wave * terms[k + 1] * (k + 1) as f64 + fall * (terms[k] * above - before);
                terms.push(-bend / ((k + 1) * (k + 2)) as f64);
            }
            let horner = |sum: Complex<f64>, term: Complex<f64>| sum * h + term;
            angle = terms.iter().rev().fold(Complex::ZERO, |sum, term| horner(sum, *term));
            let slopes = terms.iter().enumerate().skip(1).rev();
            slope = slopes.fold(Complex::ZERO, |sum, (k, term)| horner(sum, *term * k as f64));
        }
        (b * slope + a * angle) / (b * slope).norm().max((a * angle).norm())
    }

    /// Length and angular frequency of the crossing of the axis next to a guess, by Newton's method.
    pub fn crossing(&self, length: f64, frequency: f64) -> (f64, f64) {
        let mut x = Vector2::new(length, frequency);
        for _ in 0..30 {
            let value = |x: Vector2<f64>| {
                let z = self.value(Complex::new(0.0, x[1]), x[0]);
                Vector2::new(z.re, z.im)
            };
            let column = |k: usize| {
                let mut step = Vector2::zeros();
                step[k] = 1e-6 * x[k];
                (value(x + step) - value(x - step)) / (2.0 * step[k])
            };
            let step = Matrix2::from_columns(&[column(0), column(1)]).lu().solve(&value(x)).expect("a simple crossing");
            x -= step;
            if step.component_div(&x).amax() < 1e-13 {
                break;
            }
        }
        (x[0], x[1])
    }
}
