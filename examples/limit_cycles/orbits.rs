//! Circular and planar periodic orbits of the undisturbed shoot, and their stability.
//!
//! The equations of the orbits are solved directly, so that unstable orbits are found as well.

use std::error::Error;
use std::f64::consts::PI;

use morphorod::cycle::{
    Disturbances, Eigenvalue, PeriodicSolver, RotatingWave, RotatingWaveSolver,
};
use morphorod::stability::Linearisation;
use morphorod::{Model, Shoot};
use nalgebra::Complex;

/// Elements of the shoot. The relative error of radius and period is below 1e-8.
pub const ELEMENTS: usize = 6;
/// Initial guess of the radius of the circular orbit over the length of the shoot.
const GUESS: f64 = 0.3;
/// Least number of multipliers of the planar orbit.
const MULTIPLIERS: usize = 4;
/// Excursion of planar orbits over that of circular orbits in the limit at the onset, squared.
const RATIO_SQUARED: f64 = 4.0 / 3.0;

/// Growth rates of disturbances of an orbit, 1/s.
pub struct Rates {
    /// Leading rates of modulations of the oscillation, the larger one first.
    pub modulations: Vec<f64>,
    /// Leading rate of all other disturbances. They are nearly static, short waves.
    pub others: f64,
}

impl Rates {
    /// Separates the rates of modulations from the others.
    fn new(all: impl Iterator<Item = (f64, bool)> + Clone) -> Self {
        let rates = |of: bool| {
            all.clone()
                .filter(move |(_, modulates)| *modulates == of)
                .map(|(rate, _)| rate)
        };
        Self {
            modulations: rates(true).take(2).collect(),
            others: rates(false).fold(f64::NEG_INFINITY, f64::max),
        }
    }

    pub fn unstable(&self) -> bool {
        self.others > 0.0 || self.modulations.iter().any(|rate| *rate > 0.0)
    }
}

/// Both orbits and the growth rates of their disturbances.
pub struct Orbits {
    pub circle: RotatingWave,
    pub circular_rates: Rates,
    /// Period of the planar orbit, s.
    pub planar_period: f64,
    /// Largest distance of the tip from the vertical on the planar orbit, m.
    pub planar_excursion: f64,
    /// Growth rates of disturbances in the plane of the planar orbit and out of it.
    pub planar_rates: [Rates; 2],
}

/// Finds both orbits of a shoot without disturbances.
pub fn find(shoot: &Shoot<impl Model>) -> Result<Orbits, Box<dyn Error>> {
    let root = Linearisation::about(shoot)?.rightmost()?;
    if root.value.re <= 0.0 {
        return Err("the upright shoot is stable".into());
    }
    let circle =
        RotatingWaveSolver::default().from_mode(shoot, &root, GUESS * shoot.rod().length())?;
    let roots = circle.roots(shoot, 2)?.roots;
    // What is static in the fixed frame rotates with the rate of the wave in the corotating frame.
    let modulates = |value: Complex<f64>| (value.im.abs() / circle.rate.abs() - 1.0).abs() > 0.5;
    let circular_rates = Rates::new(
        roots
            .iter()
            .map(|root| (root.value.re, modulates(root.value))),
    );
    // After half a period the shoot has rotated by π. Half a period takes half the work.
    let solver = PeriodicSolver {
        intervals: 8,
        angle: Some(PI),
        ..PeriodicSolver::default()
    };
    let planar = solver.from_mode(shoot, &root, RATIO_SQUARED.sqrt() * circle.radius())?;
    let Disturbances::Planar {
        in_plane,
        out_of_plane,
    } = planar.multipliers(shoot, MULTIPLIERS)?.values
    else {
        return Err("the second orbit does not lie in a plane".into());
    };
    // What is static has the multiplier −1 for a rotation by π.
    let rates = |multipliers: &[Eigenvalue]| {
        Rates::new(
            multipliers
                .iter()
                .map(|one| (one.value.norm().ln() / planar.period, one.value.re > 0.0)),
        )
    };
    Ok(Orbits {
        circular_rates,
        planar_period: 2.0 * planar.period,
        planar_excursion: planar.largest_excursion(shoot)?.0,
        planar_rates: [rates(&in_plane), rates(&out_of_plane)],
        circle,
    })
}
