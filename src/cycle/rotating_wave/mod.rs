//! Rotating waves (relative equilibria): shapes that rotate rigidly about the vertical while their base stays clamped.

mod corotating;
mod equations;
mod roots;

pub use roots::{WaveRoot, WaveRoots};

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
use corotating::rotation_tangent;

/// Initial guess of a rotating wave.
#[derive(Debug, Clone, PartialEq)]
pub struct WaveGuess {
    /// Intrinsic strain at every material point of the growth zone, components along the directors at one time, 1/m.
    pub strain: Vec<Vector3<f64>>,
    /// Rate of rotation, 1/s, counterclockwise positive as seen from above the apex.
    pub rate: f64,
}

impl WaveGuess {
    /// The mode of an upright shoot, rotating counterclockwise with its tip at a distance of about `radius` (m).
    #[must_use]
    pub fn of_mode(root: &Root, radius: f64) -> Self {
        // In one plane it is Re[ψ exp(iωt)], in the other a quarter of a period later.
        let pair = |psi: &Vector3<Complex<f64>>| {
            let psi = if psi.x.norm() > psi.y.norm() { psi.x } else { psi.y };
            Vector3::new(psi.re, psi.im, 0.0) * radius
        };
        Self { strain: root.strain.iter().map(pair).collect(), rate: root.value.im }
    }

    /// The shape of a rod, for example at one time of a run, with a rate of rotation (1/s).
    #[must_use]
    pub fn of_rod(rod: &Rod, rate: f64) -> Self {
        Self { strain: rod.points()[rod.zone()].iter().map(|point| point.intrinsic).collect(), rate }
    }
}

/// A rotating wave: every point of the shoot moves on a circle about the axis at one rate, and the shape does not change.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RotatingWave {
    /// Rate of rotation, 1/s, counterclockwise positive.
    pub rate: f64,
    /// The shape at one time.
    pub rod: Rod,
    /// Newton iterations.
    pub iterations: usize,
    /// Residual of the growth gradients, relative to the largest.
    pub residual: f64,
}

impl RotatingWave {
    /// The period of a rotation, s.
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

    /// The initial guess of another rotating wave.
    #[must_use]
    pub fn as_guess(&self) -> WaveGuess {
        WaveGuess::of_rod(&self.rod, self.rate)
    }
}

/// Finds rotating waves of upright shoots by Newton's method for shape and rate together.
///
/// A rotating wave is stationary in the frame that rotates with it: ν ẑ × u* = REGR gradient at every material point. The laws'
/// variables are those of stimuli with the period 2π/ν.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotatingWaveSolver {
    /// Largest residual of the growth gradients, relative to the largest gradient, 1e-11 by default.
    pub tolerance: f64,
    /// Largest number of iterations, 40 by default.
    pub max_iterations: usize,
}

impl Default for RotatingWaveSolver {
    /// 1e-11, at most 40 iterations.
    fn default() -> Self {
        Self { tolerance: 1e-11, max_iterations: 40 }
    }
}

impl RotatingWaveSolver {
    /// The rotating wave of the shoot's laws on its elements to which Newton's method converges from an initial guess. The shoot is not
    /// changed.
    ///
    /// # Errors
    /// A shoot that elongates, that has no axis, or of which some tissue does not steer; no rotating wave near the initial guess.
    pub fn solve(&self, shoot: &Shoot<impl Model>, start: &WaveGuess) -> Result<RotatingWave, CycleError> {
        ParameterError::positive("tolerance of a circular orbit", self.tolerance)?;
        let guess = equations::unknowns(start);
        // The phase of the guess is kept.
        let (tangent, weights) = (rotation_tangent(&guess.start.strain), guess.start.weights());
        let conditions = Conditions::default().with_phases_of(&guess, &[tangent], &weights);
        corrector::solve(*self, shoot, guess, &conditions)
    }
}
