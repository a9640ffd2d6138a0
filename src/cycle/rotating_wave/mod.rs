//! Rotating waves (relative equilibria): shapes that rotate rigidly about the vertical while the
//! base stays clamped.
//!
//! A rotating wave with the rate ν is stationary in the corotating frame: ν ẑ × u* = REGR ·
//! gradient at each material point, with the variables that periodic stimuli of the frequency ν
//! cause, which harmonic balance gives. The leading multipliers of the return map are the initial
//! guesses of Newton's method for the characteristic roots, det M(λ) = 0. See BifurcationKit,
//! "modulated travelling waves".

mod corotating;
mod roots;

pub use roots::WaveRoots;

use std::f64::consts::TAU;

use nalgebra::{DVector, Vector3};

use super::corrector::{self, check_amplitude};
use super::equations::Equations;
use super::error::{CycleError, Outcome};
use super::extended::{ExtraConditions, OrbitUnknowns};
use super::map::{PhaseState, bends};
use super::rotated::excursion;
use crate::error::ParameterError;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::Root;
use corotating::rotation_tangent;

/// A rotating wave: each point of the shoot moves on a circle about the axis, at the same rate, and
/// the shape is constant.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RotatingWave {
    /// Rate of rotation, rad/s, counterclockwise positive as seen from above the apex.
    pub rate: f64,
    /// The shape at one time.
    pub rod: Rod,
    /// Number of Newton iterations.
    pub iterations: usize,
    /// Residual of the growth gradients, relative to the largest gradient.
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
        excursion(&self.rod, &self.rod.frames()[0])
    }

    /// The height of the tip above the base along the axis, m.
    #[must_use]
    pub fn height(&self) -> f64 {
        (self.rod.frames()[0] * Vector3::z()).dot(&(self.rod.tip() - self.rod.base_position()))
    }
}

/// Finds rotating waves of upright shoots by Newton's method for shape and rate.
#[derive(Debug, Clone, Copy, PartialEq)]
#[doc(alias = "circumnutation")]
pub struct RotatingWaveSolver {
    /// Largest residual of the growth gradients, relative to the largest gradient, 1e-11 by
    /// default.
    pub tolerance: f64,
    /// Largest number of iterations, 40 by default.
    pub max_iterations: usize,
}

impl Default for RotatingWaveSolver {
    /// 1e-11, at most 40 iterations.
    fn default() -> Self {
        Self {
            tolerance: 1e-11,
            max_iterations: 40,
        }
    }
}

impl RotatingWaveSolver {
    /// The rotating wave to which Newton's method converges from a mode of the upright shoot, which
    /// rotates counterclockwise with the tip at a distance of about `radius` (m) from the axis;
    /// clockwise for the conjugate mode. The shoot is not changed.
    ///
    /// # Errors
    /// A shoot that elongates, that is not symmetric about the tangent of its base, or that has
    /// tissue in the zone without growth; a tolerance that is not positive, a root that does not
    /// oscillate, or no rotating wave near the guess.
    pub fn from_mode(
        &self,
        shoot: &Shoot<impl Model>,
        root: &Root,
        radius: f64,
    ) -> Result<RotatingWave, CycleError> {
        check_amplitude(shoot, radius)?;
        self.solve(shoot, self.of_mode(shoot, root, radius)?)
    }

    /// The rotating wave near a run in time, from the present intrinsic strain of the shoot, with
    /// an initial guess of the rate of rotation (rad/s), counterclockwise positive as seen from
    /// above the apex. [`Shoot::set_intrinsic`] makes any other initial guess. The shoot is not
    /// changed.
    ///
    /// # Errors
    /// Errors of [`from_mode`](Self::from_mode), or a rate that is zero or not finite.
    pub fn from_run(
        &self,
        shoot: &Shoot<impl Model>,
        rate: f64,
    ) -> Result<RotatingWave, CycleError> {
        self.solve(shoot, unknowns(bends(shoot.rod()), rate))
    }

    /// The rotating wave of a shoot near that of another one with as many material points. The
    /// initial guess has the shape and the signed rate of `orbit`. The shoot is not changed.
    ///
    /// # Errors
    /// Errors of [`from_mode`](Self::from_mode), or a shoot with another number of points.
    pub fn from_orbit(
        &self,
        shoot: &Shoot<impl Model>,
        orbit: &RotatingWave,
    ) -> Result<RotatingWave, CycleError> {
        self.solve(shoot, self.of_orbit(shoot, orbit)?)
    }

    /// Solves with the phase of the guess.
    fn solve(&self, shoot: &Shoot<impl Model>, guess: OrbitUnknowns) -> Outcome<RotatingWave> {
        ParameterError::positive("tolerance of a rotating wave", self.tolerance, "")?;
        let tangent = rotation_tangent(&guess.start.strain);
        let conditions = ExtraConditions::default().with_phases_of(&guess, &[tangent]);
        corrector::solve(*self, shoot, guess, &conditions)
    }
}

/// The unknowns of a strain (components 1 and 2 at each point of the zone, 1/m) that rotates at a
/// rate (rad/s, counterclockwise positive).
fn unknowns(strain: DVector<f64>, rate: f64) -> OrbitUnknowns {
    let start = PhaseState {
        strain,
        variables: DVector::zeros(0),
        slopes: Vec::new(),
    };
    OrbitUnknowns {
        start,
        period_or_rate: rate,
        forced: false,
        angle: 0.0,
        parameter: 0.0,
    }
}
