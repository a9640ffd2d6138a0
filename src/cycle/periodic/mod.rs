//! Periodic orbits: how they are sought, found, read, and entered by a run in time.

mod equations;
mod forced;
pub(super) mod guess;
mod history;
mod linear;
mod multipliers;
mod orbit;
mod plane;
mod resolution;

pub use history::OrbitHistory;
pub use multipliers::{Multiplier, Multipliers};
pub use orbit::PeriodicOrbit;

use super::corrector;
use super::equations::Equations;
use super::error::CycleError;
use super::extended::{Conditions, Unknowns};
use super::map::grid::Grid;
use super::map::return_map::{PRECISE, ReturnMap};
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::stability::Root;
use guess::state_of_run;

/// Points in an interval at most: beyond, intervals serve better, and the work grows with their cube.
const STAGES: usize = 16;

/// Finds periodic orbits of shoots whose length does not change.
///
/// A period is divided into intervals with Radau points; the grid is one of t/T, and moves with the period. Unknown are a state, with
/// its variables over the longest delay, and the period. The return map contracts all but a handful of directions, so that Krylov's
/// method solves the linear problems of Newton's in a few dozen applications of the linearised map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodicSolver {
    /// Number of intervals in a period at first, 16 by default; 8 are sufficient for half a swing. The number is doubled until
    /// [`accuracy`](Self::accuracy) is met: where the shoot almost buckles during its swing more are necessary.
    pub intervals: usize,
    /// Radau points in each, 6 unless said otherwise, at most 16: the order of accuracy inside an interval.
    pub stages: usize,
    /// Largest relative difference between a state and that one period later, 1e-10 unless said otherwise.
    pub tolerance: f64,
    /// Largest estimate of the relative error of period and shape that the intervals may leave, 1e-6 by default.
    pub accuracy: f64,
    /// Largest number of iterations for each number of intervals, 30 by default.
    pub max_iterations: usize,
    /// Initial guess of the angle of a relative periodic orbit, rad. `None`, the default, for periodic orbits. A shoot that is
    /// symmetric about the tangent of its base may have rotated about it after a period, as on a rosette; the angle is then an
    /// unknown like the period. A swing in a plane has rotated by π after half its period. With this angle it takes half the
    /// intervals and half the work, and the period that is found is half that of the swing.
    pub angle: Option<f64>,
}

impl Default for PeriodicSolver {
    /// 16 intervals of 6 points, a residual of 1e-10, an accuracy of 1e-6, at most 30 iterations, no angle.
    fn default() -> Self {
        Self { intervals: 16, stages: 6, tolerance: 1e-10, accuracy: 1e-6, max_iterations: 30, angle: None }
    }
}

impl PeriodicSolver {
    /// The orbit that Newton's method reaches from a mode of the upright shoot, to and fro in its plane, with the tip moving by about
    /// `amplitude` (m). The shoot is not changed.
    ///
    /// # Errors
    /// A shoot that elongates or of which some tissue does not steer, a root that does not oscillate, no orbit near the start.
    pub fn from_mode(
        &self,
        shoot: &Shoot<impl Model>,
        root: &Root,
        amplitude: f64,
    ) -> Result<PeriodicOrbit, CycleError> {
        ParameterError::positive("frequency of the mode", root.value.im)?;
        ParameterError::positive("amplitude of the start", amplitude)?;
        let guess = self.of_mode(shoot, root, amplitude)?;
        corrector::solve(*self, shoot, guess, &Conditions::default())
    }

    /// The orbit near which a run in time is: from the shoot's present state and its history, with a first guess of the period (s), good
    /// to a tenth. The shoot is not changed.
    ///
    /// A guess that is far off may lead to a multiple of the period. A run that is on its way from a swing to a circle may lead to
    /// either: excursion and multipliers tell.
    ///
    /// # Errors
    /// Those of [`from_mode`](Self::from_mode), or a shoot that no integrator has moved.
    pub fn from_run(&self, shoot: &Shoot<impl Model>, period: f64) -> Result<PeriodicOrbit, CycleError> {
        let return_map = self.return_map(shoot, period)?;
        let (start, angle) = (state_of_run(&return_map, period)?, return_map.angle());
        let guess = Unknowns { start, clock: period, forced: false, angle, parameter: 0.0 };
        corrector::solve(*self, shoot, guess, &Conditions::default())
    }

    /// The orbit of a shoot near that of another with as many material points and the same number of variables: the shoot a little
    /// longer or stiffer. For the same shoot, on twice the intervals, the difference of the two orbits and of their multipliers says
    /// how accurate the first was.
    ///
    /// From a whole swing it leads to half a swing with an [`angle`](Self::angle) of π, and back without one. A rosette needs
    /// an angle; without one the nearest orbit may be a circle.
    ///
    /// # Errors
    /// Those of [`from_mode`](Self::from_mode), or a shoot with another number of points or variables.
    pub fn from_orbit(&self, shoot: &Shoot<impl Model>, orbit: &PeriodicOrbit) -> Result<PeriodicOrbit, CycleError> {
        corrector::solve(*self, shoot, self.of_orbit(shoot, orbit)?, &Conditions::default())
    }

    pub(super) fn return_map<'a, M: Model>(
        &self,
        shoot: &'a Shoot<M>,
        period: f64,
    ) -> Result<ReturnMap<'a, M>, CycleError> {
        let (what, number) = ("intervals in a period", self.intervals);
        ParameterError::unless((1..=1000).contains(&number), what, number as f64, "from 1 to 1000")?;
        let (what, number) = ("points in an interval", self.stages);
        ParameterError::unless((1..=STAGES).contains(&number), what, number as f64, "from 1 to 16")?;
        ParameterError::positive("tolerance of a periodic orbit", self.tolerance)?;
        ParameterError::positive("accuracy of a periodic orbit", self.accuracy)?;
        ParameterError::finite("angle of a periodic orbit", self.angle.unwrap_or(0.0))?;
        ReturnMap::new(shoot, Grid::new(self.intervals, self.stages), period, self.angle)
    }

    /// The strain that counts as none in a residual, 1/m. What is driven may start from nothing, and end there if nothing drives it: there
    /// angles are rounding.
    pub(crate) fn least(&self, shoot: &Shoot<impl Model>, driven: bool) -> f64 {
        if driven { PRECISE / (self.tolerance * shoot.rod().length()) } else { f64::MIN_POSITIVE }
    }
}
