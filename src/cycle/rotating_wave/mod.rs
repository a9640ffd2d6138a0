//! Circular orbits: a shape that turns rigidly about the vertical while its base stays clamped.

mod corotating;
mod equations;
mod roots;

pub use roots::{TurningRoot, TurningRoots};

use std::f64::consts::TAU;

use nalgebra::{Complex, Vector3};

use super::corrector;
use super::error::CycleError;
use super::extended::Conditions;
use crate::error::ParameterError;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::Root;
use corotating::quarter;

/// A start for the search of an orbit: the intrinsic strain at every material point of the growth zone, components along the
/// directors at one time, 1/m, and the rate at which all turns, 1/s, positive if counterclockwise as seen from above the apex.
#[derive(Debug, Clone, PartialEq)]
pub struct Turning {
    /// Intrinsic strain, 1/m.
    pub strain: Vec<Vector3<f64>>,
    /// Rate, 1/s.
    pub rate: f64,
}

impl Turning {
    /// The mode of an upright shoot, turning counterclockwise with its tip at a distance of about `radius` (m).
    #[must_use]
    pub fn of_mode(root: &Root, radius: f64) -> Self {
        // In one plane it is Re[ψ exp(iωt)], in the other a quarter of a period later.
        let pair = |psi: &Vector3<Complex<f64>>| {
            let psi = if psi.x.norm() > psi.y.norm() { psi.x } else { psi.y };
            Vector3::new(psi.re, psi.im, 0.0) * radius
        };
        Self { strain: root.strain.iter().map(pair).collect(), rate: root.value.im }
    }

    /// The shape of a rod, as it is at one time of a run, say, turning at a rate (1/s).
    #[must_use]
    pub fn of_rod(rod: &Rod, rate: f64) -> Self {
        Self { strain: rod.points()[rod.zone()].iter().map(|point| point.intrinsic).collect(), rate }
    }
}

/// A circular orbit: every point of the shoot goes round the axis at one rate, in a shape that does not change.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct CircularOrbit {
    /// The rate at which all turns, 1/s, counterclockwise positive.
    pub rate: f64,
    /// The shape at one time.
    pub rod: Rod,
    /// Newton iterations.
    pub iterations: usize,
    /// What is left of the growth gradients, relative to the largest.
    pub residual: f64,
}

impl CircularOrbit {
    /// The time of a turn, s.
    #[must_use]
    pub fn period(&self) -> f64 {
        TAU / self.rate.abs()
    }

    /// The distance of the tip from the axis, m.
    #[must_use]
    pub fn radius(&self) -> f64 {
        let (tip, axis) = (self.rod.tip(), self.rod.frames()[0] * Vector3::z());
        (tip - axis * axis.dot(&tip)).norm()
    }

    /// The height of the tip along the axis, m.
    #[must_use]
    pub fn height(&self) -> f64 {
        (self.rod.frames()[0] * Vector3::z()).dot(&self.rod.tip())
    }

    /// The orbit as a start for the search of another.
    #[must_use]
    pub fn as_start(&self) -> Turning {
        Turning::of_rod(&self.rod, self.rate)
    }
}

/// Finds circular orbits of upright shoots: Newton's method for shape and rate together.
///
/// In the turning frame nothing changes, so that an orbit is a stationary state there: ν ẑ × u* = REGR gradient at every
/// material point, with the laws' variables what they are when their stimuli go round once in 2π/ν.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircularSolver {
    /// Largest growth gradient that may be left, relative to the largest there is, 1e-11 unless said otherwise.
    pub tolerance: f64,
    /// Bound on the iterations, 40 unless said otherwise.
    pub max_iterations: usize,
}

impl Default for CircularSolver {
    /// 1e-11, at most 40 iterations.
    fn default() -> Self {
        Self { tolerance: 1e-11, max_iterations: 40 }
    }
}

impl CircularSolver {
    /// The rotating wave of the shoot's laws on its elements to which Newton's method converges from an initial guess. The shoot is not
    /// changed.
    ///
    /// # Errors
    /// A shoot that elongates, that has no axis, or of which some tissue does not steer; no rotating wave near the initial guess.
    pub fn solve(&self, shoot: &Shoot<impl Model>, start: &Turning) -> Result<CircularOrbit, CycleError> {
        ParameterError::positive("tolerance of a circular orbit", self.tolerance)?;
        let guess = equations::unknowns(start);
        // The phase of the guess is kept.
        let (tangent, weights) = (quarter(&guess.start.strain), guess.start.weights());
        let conditions = Conditions::default().with_phases_of(&guess, &[tangent], &weights);
        corrector::solve(*self, shoot, guess, &conditions)
    }
}
