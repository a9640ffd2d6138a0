//! The upright reduced shoot and its linear problem.

#![allow(dead_code, reason = "each test takes what it needs")]

pub mod continuous;

use morphorod::Shoot;
use morphorod::constitutive::LinearElastic;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::load::Weight;
use morphorod::stability::{Linearisation, StabilityError, StationarySolver};
use morphorod::tropism::{Gravitropism, Memory, Perception, Proprioception, Response};

pub const MINUTE: f64 = 60.0;
pub const HOUR: f64 = 3600.0;
pub const YOUNG: LinearElastic = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
pub const MEMORY: Memory = Memory { time: 12.0 * MINUTE, delay: 12.0 * MINUTE };

/// The linear problem of the upright shoot of constant length (m), with the default radius, density and stiffness.
pub fn linear_problem(
    length: f64,
    growth_time: f64,
    beta: f64,
    eta: f64,
    statoliths: impl Perception<Signal = [f64; 2]>,
    elements: usize,
) -> Result<Linearisation, StabilityError> {
    let mut shoot = Shoot::builder(YOUNG)
        .length(length)
        .radius(5e-4)
        .elements(elements)
        .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: growth_time }))
        .tropism((
            Gravitropism { sensitivity: beta, perception: statoliths }.remembered(MEMORY),
            Proprioception { sensitivity: eta }.remembered(MEMORY),
        ))
        .load(Weight { density: 1000.0 })
        .build()?;
    let _ = StationarySolver::default().solve(&mut shoot)?;
    Linearisation::about(&shoot)
}
