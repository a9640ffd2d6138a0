//! A shoot that grows, bends upwards against gravity and sags, as in the README. It prints the
//! length and the tip for every hour.

use std::io::{Write, stdout};

use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::tropism::{Gravitropism, Memory, Proprioception, Response, SettledStatoliths};
use morphorod::{Shoot, Still, constitutive::LinearElastic, growth::UniformGrowth, load::Weight};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let memory = Memory {
        time: 720.0,
        delay: 720.0,
    }; // SI units throughout
    let mut shoot = Shoot::builder(LinearElastic {
        youngs_modulus: 1e7,
        poissons_ratio: 0.5,
    })
    .length(0.03)
    .radius(0.5e-3)
    .growth(UniformGrowth {
        zone_length: 0.04,
        time: 72e3,
    })
    .tropism((
        Gravitropism {
            sensitivity: 0.8,
            perception: SettledStatoliths,
        }
        .remembered(memory),
        Proprioception { sensitivity: 20.0 }.remembered(memory),
    ))
    .load(Weight { density: 1000.0 })
    .scene(Still::tilted(0.5)) // the base leans by 0.5 rad
    .build()?;
    let mut integrator = MethodOfSteps::new(120.0); // time step, s
    for hour in 0..=10 {
        integrator.advance(&mut shoot, 3600.0 * f64::from(hour))?;
        writeln!(
            stdout(),
            "{hour} h: {:.4} m long, tip at {:.4?} m",
            shoot.rod().length(),
            shoot.tip().as_slice()
        )?;
    }
    Ok(())
}
