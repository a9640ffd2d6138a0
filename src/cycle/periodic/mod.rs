//! Periodic orbits: the solver, the orbits, their multipliers, and runs in time that start on them.
//!
//! An orbit is a fixed point of the return map, x(T) = x(0), or a relative one, x(T) = R(φ) x(0).
//! Newton's method solves for x, T and φ by single shooting over one period. The phase conditions
//! are those of DDE-BIFTOOL (`psol`).

mod equations;
mod guess;
mod history;
mod linear;
mod multipliers;
mod orbit;
mod plane;
mod resolution;

pub(super) use equations::MAX_INTERVALS;
pub use multipliers::Multipliers;
pub use orbit::PeriodicOrbit;

use std::f64::consts::TAU;

use super::corrector::{self, check_amplitude};
use super::equations::Equations;
use super::error::{CycleError, Outcome};
use super::extended::{ExtraConditions, OrbitUnknowns};
use super::map::{ReturnMap, TimeGrid};
use super::symmetry::check_periodic;
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::stability::Root;

/// Finds periodic orbits of shoots whose length is constant.
///
/// A period T is divided into intervals with Radau points; the grid is fixed in t/T. The unknowns
/// are a state, which contains the variables over the longest delay, and the period. The return map
/// contracts all but about ten directions, so that GMRES solves the linear system of a Newton
/// iteration with twenty to forty applications of the linearised map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodicSolver {
    /// Initial number of intervals in a period, from 1 to 1000, 16 by default; 8 are sufficient for
    /// half a swing. The number is doubled until [`accuracy`](Self::accuracy) is met. Orbits that
    /// come close to buckling need more.
    pub intervals: usize,
    /// Number of Radau points in an interval, from 1 to 16, 6 by default. In each interval strain
    /// and variables are polynomials of this degree.
    pub stages: usize,
    /// Largest relative difference between a state and the state one period later; positive, 1e-10
    /// by default.
    pub tolerance: f64,
    /// Largest estimate of the relative error of period and shape due to the grid; positive, 1e-6
    /// by default.
    pub accuracy: f64,
    /// Largest number of iterations for each number of intervals, 30 by default.
    pub max_iterations: usize,
    /// Largest number of equilibria in all iterations of a search, without those of linearisations;
    /// one million by default. It is checked after every integration over a period.
    pub max_work: usize,
    /// Initial guess of the angle of a relative periodic orbit, rad, from −2π to 2π,
    /// counterclockwise positive as seen from above the apex. `None`, the default, for periodic
    /// orbits. A shoot that is symmetric about the tangent of its base may have rotated about it
    /// after a period, as on a rosette; the angle is then an unknown like the period. A swing in a
    /// plane has rotated by π after half its period. With this angle it takes half the intervals
    /// and half the work, and the period of the orbit is half that of the swing.
    pub angle: Option<f64>,
}

impl Default for PeriodicSolver {
    /// 16 intervals of 6 points, a residual of 1e-10, an accuracy of 1e-6, at most 30 iterations
    /// and a million equilibria, no angle.
    fn default() -> Self {
        Self {
            intervals: 16,
            stages: 6,
            tolerance: 1e-10,
            accuracy: 1e-6,
            max_iterations: 30,
            max_work: 1_000_000,
            angle: None,
        }
    }
}

impl PeriodicSolver {
    /// The orbit to which Newton's method converges from a mode of the upright shoot: a swing in a
    /// plane, in which the tip moves by about `amplitude` (m), or the place that moves most if the
    /// apex is held. The shoot is not changed.
    ///
    /// # Errors
    /// A shoot that elongates or that has tissue in the zone without growth, a root that does not
    /// oscillate, no orbit near the guess, contact with an obstacle, or an angle of a shoot with a
    /// support.
    pub fn from_mode(
        &self,
        shoot: &Shoot<impl Model>,
        root: &Root,
        amplitude: f64,
    ) -> Result<PeriodicOrbit, CycleError> {
        ParameterError::positive("frequency of the mode", root.value.im, "rad/s")?;
        check_amplitude(shoot, amplitude)?;
        let guess = self.of_mode(shoot, root, amplitude)?;
        corrector::solve(*self, shoot, guess, &ExtraConditions::default())
    }

    /// The orbit near a run in time, from the present state of the shoot and its history, with an
    /// initial guess of the period (s) that is accurate to about a tenth. The shoot is not changed.
    ///
    /// An inaccurate guess may lead to a multiple of the period. A run between a swing and a
    /// rotating wave may lead to either of them; excursion and multipliers distinguish them.
    ///
    /// # Errors
    /// Errors of [`from_mode`](Self::from_mode), or a shoot that no integrator has advanced.
    pub fn from_run(
        &self,
        shoot: &Shoot<impl Model>,
        period: f64,
    ) -> Result<PeriodicOrbit, CycleError> {
        let return_map = self.return_map(shoot, period)?;
        let (start, angle) = (return_map.state_of_run(period)?, self.angle.unwrap_or(0.0));
        let guess = OrbitUnknowns {
            start,
            period_or_rate: period,
            forced: false,
            angle,
            parameter: 0.0,
        };
        corrector::solve(*self, shoot, guess, &ExtraConditions::default())
    }

    /// The orbit of a shoot near that of another one with as many material points and variables,
    /// for example of a slightly shorter shoot. For the same shoot with twice the intervals, the
    /// differences of the two orbits and of their multipliers are the errors of the first.
    ///
    /// A whole swing leads to half a swing with an [`angle`](Self::angle) of π, and back without
    /// one. A rosette needs an angle; without one the nearest orbit may be a rotating wave.
    ///
    /// # Errors
    /// Errors of [`from_mode`](Self::from_mode), or a shoot with another number of points or
    /// variables.
    pub fn from_orbit(
        &self,
        shoot: &Shoot<impl Model>,
        orbit: &PeriodicOrbit,
    ) -> Result<PeriodicOrbit, CycleError> {
        corrector::solve(
            *self,
            shoot,
            self.of_orbit(shoot, orbit)?,
            &ExtraConditions::default(),
        )
    }

    /// The orbit of a shoot with periodic forcing (an oscillator, a clinostat, an alternating load)
    /// of a period (s), from the straight shoot. A run in time converges to it if its multipliers
    /// have a modulus below one. The orbit begins at the present time of the shoot. Without forcing
    /// it is the stationary state. The shoot is not changed.
    ///
    /// # Errors
    /// A shoot that elongates or that has tissue in the zone without growth, a period that is not
    /// positive or not that of the forcing, an angle, no orbit near the straight shoot.
    pub fn forced(
        &self,
        shoot: &Shoot<impl Model>,
        period: f64,
    ) -> Result<PeriodicOrbit, CycleError> {
        let (what, angle) = ("angle of a forced orbit", self.angle.unwrap_or(0.0));
        ParameterError::unless(
            self.angle.is_none(),
            what,
            angle,
            "none: the forcing has no axis",
        )?;
        let mut return_map = self.return_map(shoot, period)?;
        let (start, rod) = return_map.state_of_steady_laws()?;
        check_periodic(shoot, &rod, period)?;
        let guess = OrbitUnknowns {
            start,
            period_or_rate: period,
            forced: true,
            angle: 0.0,
            parameter: 0.0,
        };
        corrector::solve(*self, shoot, guess, &ExtraConditions::default())
    }

    /// The return map of a shoot for periods near the given one (s). Checks the settings.
    pub(super) fn return_map<'a, M: Model>(
        &self,
        shoot: &'a Shoot<M>,
        period: f64,
    ) -> Outcome<ReturnMap<'a, M>> {
        let (what, number) = ("intervals in a period", self.intervals);
        ParameterError::unless(
            (1..=1000).contains(&number),
            what,
            number as f64,
            "from 1 to 1000",
        )?;
        // More intervals are more efficient than more stages, whose cost increases with the third
        // power.
        let (what, number) = ("points in an interval", self.stages);
        ParameterError::unless(
            (1..=16).contains(&number),
            what,
            number as f64,
            "from 1 to 16",
        )?;
        ParameterError::positive("tolerance of a periodic orbit", self.tolerance, "")?;
        ParameterError::positive("accuracy of a periodic orbit", self.accuracy, "")?;
        let (what, angle) = ("angle of a periodic orbit", self.angle.unwrap_or(0.0));
        ParameterError::unless(angle.abs() <= TAU, what, angle, "from −2π to 2π (rad)")?;
        ReturnMap::new(
            shoot,
            TimeGrid::new(self.intervals, self.stages),
            period,
            self.angle,
        )
    }

    /// Period of the map over that of a swing: the settings may be for half a swing.
    fn share(&self) -> f64 {
        if self.angle.is_some_and(|angle| angle.cos() < 0.0) {
            0.5
        } else {
            1.0
        }
    }
}
