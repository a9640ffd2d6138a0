//! Cycles of shoots that are driven: an oscillator, a clinostat, a load that comes and goes.

use nalgebra::DVector;

use super::PeriodicSolver;
use super::orbit::PeriodicOrbit;
use crate::cycle::autonomous::check_period;
use crate::cycle::corrector;
use crate::cycle::error::CycleError;
use crate::cycle::extended::{Conditions, Unknowns};
use crate::cycle::map::phase_state::PhaseState;
use crate::error::ParameterError;
use crate::linear::visit_stimuli;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::tropism::TropismLaw;

impl PeriodicSolver {
    /// The cycle of a shoot that something drives with a period (s), from a straight shoot at rest: what it settles to, if its
    /// multipliers are below one. The cycle is that from the shoot's present time on. Of a shoot that nothing drives it is the
    /// stationary state. The shoot is not changed.
    ///
    /// # Errors
    /// A shoot that elongates or of which some tissue does not steer, a period that is not positive or that what
    /// drives the shoot does not have in common, no cycle near the straight shoot.
    pub fn forced(&self, shoot: &Shoot<impl Model>, period: f64) -> Result<PeriodicOrbit, CycleError> {
        let (what, angle) = ("angle of a cycle that is driven", self.angle.unwrap_or(0.0));
        ParameterError::unless(self.angle.is_none(), what, angle, "none: what drives it has no axis")?;
        let mut return_map = self.return_map(shoot, period)?;
        let (v, points) = (return_map.variables, return_map.places.len());
        let strain = DVector::zeros(2 * points);
        let (rod, force) = return_map.equilibrate_at(&strain, 0.0)?;
        check_period(shoot, &rod, period)?;
        let mut variables = DVector::zeros(v * points);
        visit_stimuli(shoot, &rod, &force, |i, _, stimuli| {
            shoot.model().tropism().steady(stimuli, &mut variables.as_mut_slice()[i * v..(i + 1) * v]);
        });
        let slopes = vec![vec![DVector::zeros(v * points); return_map.grid.order()]; return_map.kept];
        let start = PhaseState { strain, variables, slopes };
        let guess = Unknowns { start, clock: period, forced: true, angle: 0.0, parameter: 0.0 };
        corrector::solve(*self, shoot, guess, &Conditions::default())
    }
}
