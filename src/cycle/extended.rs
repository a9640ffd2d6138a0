//! The extended system of an orbit.
//!
//! Its unknowns are a state, the period or the rate of rotation, an angle for relative periodic orbits, and a parameter for points of a
//! branch. Each scalar unknown comes with a linear condition: a phase condition in time, one in rotation, and pseudo-arclength for the
//! parameter.

use nalgebra::DVector;

use super::error::CycleError;
use super::map::phase_state::PhaseState;

/// Relative half-width of central differences by period, rate and parameter, of the latter relative to its range. Their error is of the
/// order of its square, and that of the rounding of 1e-15 divided by it: 1e-10.
pub(super) const DIFFERENCE: f64 = 1e-5;

/// Unknowns of the extended system.
#[derive(Debug, Clone)]
pub struct Unknowns {
    /// The state of the shoot.
    pub(in crate::cycle) start: PhaseState,
    /// Period (s), or rate of rotation (1/s).
    pub clock: f64,
    /// Whether the period is that of the forcing, and no unknown.
    pub forced: bool,
    /// Rotation of the whole after a period, rad.
    pub angle: f64,
    /// The parameter of the family.
    pub parameter: f64,
}

impl Unknowns {
    /// Adds a share of an update.
    pub fn add(&mut self, update: &Update, share: f64) {
        self.start = self.start.with_values(&(self.start.flat() + &update.state * share));
        self.clock *= 1.0 + update.stretch * share;
        self.angle += update.angle * share;
        self.parameter += update.parameter * share;
    }
}

/// A Newton update of the unknowns.
pub struct Update {
    /// Change of the state.
    pub state: DVector<f64>,
    /// Relative change of the period or the rate.
    pub stretch: f64,
    /// Change of the angle, rad.
    angle: f64,
    /// Change of the parameter.
    parameter: f64,
}

impl Update {
    fn is_finite(&self) -> bool {
        self.state.iter().chain([&self.stretch, &self.angle, &self.parameter]).all(|x| x.is_finite())
    }
}

/// A linear condition on strain, variables and parameter.
#[derive(Debug, Clone)]
pub struct Condition {
    /// Coefficients of strain and variables.
    pub state: DVector<f64>,
    /// Coefficient of the parameter.
    pub parameter: f64,
    /// Sum that is prescribed.
    pub value: f64,
}

impl Condition {
    /// The condition that holds at given unknowns.
    pub fn through(state: DVector<f64>, parameter: f64, at: &Unknowns) -> Self {
        let value = state.dot(&at.start.present()) + parameter * at.parameter;
        Self { state, parameter, value }
    }

    fn residual(&self, at: &Unknowns) -> f64 {
        self.value - self.state.dot(&at.start.present()) - self.parameter * at.parameter
    }
}

/// The pseudo-arclength condition of a branch.
#[derive(Debug, Clone)]
pub struct Arclength {
    /// The condition.
    pub condition: Condition,
    /// Range of the parameter.
    pub range: [f64; 2],
}

impl Arclength {
    /// Two parameters for a central difference at one. There may be no shoot outside the range, which is left only if the parameter is
    /// outside.
    pub fn beside(&self, parameter: f64) -> [f64; 2] {
        let [from, to] = self.range;
        let step = DIFFERENCE * (to - from);
        let both = [parameter - step, parameter + step];
        if (from..=to).contains(&parameter) { both.map(|beside| beside.clamp(from, to)) } else { both }
    }
}

/// The conditions that close the extended system.
#[derive(Debug, Clone, Default)]
pub struct Conditions {
    /// Phase conditions in time and in rotation. Where none is given, an update has no component along the symmetry's tangent.
    pub phases: Vec<Condition>,
    /// Weights of strain and variables in those; by default those of the state.
    pub weights: Option<DVector<f64>>,
    /// The pseudo-arclength condition; none if the parameter is fixed.
    pub arclength: Option<Arclength>,
}

impl Conditions {
    /// Adds the phase conditions that a reference satisfies: no shift along its symmetry tangents.
    pub fn with_phases_of(mut self, reference: &Unknowns, tangents: &[DVector<f64>], weights: &DVector<f64>) -> Self {
        let phase = |tangent: &DVector<f64>| Condition::through(weights.component_mul(tangent), 0.0, reference);
        self.phases = tangents.iter().map(phase).collect();
        self
    }

    /// Whether the pseudo-arclength condition holds.
    pub fn hold(&self, at: &Unknowns, tolerance: f64) -> bool {
        self.arclength.as_ref().is_none_or(|arclength| arclength.condition.residual(at).abs() <= tolerance)
    }

    /// Residuals of the phase conditions, of which there are `phases`, and of pseudo-arclength.
    pub fn residuals(&self, phases: usize, at: &Unknowns) -> Vec<f64> {
        let phases = (0..phases).map(|k| self.phases.get(k).map_or(0.0, |phase| phase.residual(at)));
        phases.chain(self.arclength.iter().map(|arclength| arclength.condition.residual(at))).collect()
    }
}

/// A scalar unknown of the extended system, with the condition that comes with it.
#[derive(Debug, Clone)]
pub struct Border {
    /// Derivative of the residual by the unknown.
    pub column: DVector<f64>,
    /// Coefficients of strain and variables in the condition.
    pub row: DVector<f64>,
    /// Coefficient of the unknown in its own condition.
    pub corner: f64,
}

/// A continuous symmetry of the equations, with the scalar unknown that its phase condition determines.
pub struct Symmetry {
    /// Derivative of strain and variables along the symmetry.
    pub tangent: DVector<f64>,
    /// Derivative of the residual by the unknown.
    pub column: DVector<f64>,
}

/// Updates of the state and of the scalar unknowns.
pub type Updates = (DVector<f64>, DVector<f64>);

/// The derivative of a residual by the state.
pub trait Jacobian {
    /// Solves the bordered system: residual + derivatives · update = 0, and rows · update = `conditions`. Returns the updates of the
    /// state and of the scalar unknowns, or none if the linear system is not solved.
    fn solve(
        &self,
        border: &[Border],
        residual: &DVector<f64>,
        conditions: &[f64],
    ) -> Result<Option<Updates>, CycleError>;
}

/// The linearised extended system.
pub struct Bordered<J> {
    jacobian: J,
    border: Vec<Border>,
    /// Number of symmetries, whose borders come first.
    pub symmetries: usize,
}

impl<J: Jacobian> Bordered<J> {
    /// The system with the phase conditions of `conditions`, without a parameter.
    pub fn new(jacobian: J, symmetries: Vec<Symmetry>, conditions: &Conditions, at: &Unknowns) -> Self {
        let weights = conditions.weights.clone().unwrap_or_else(|| at.start.weights());
        let border = symmetries.into_iter().enumerate().map(|(k, Symmetry { tangent, column })| {
            let given = conditions.phases.get(k).map(|phase| phase.state.clone());
            Border { column, row: given.unwrap_or_else(|| weights.component_mul(&tangent)), corner: 0.0 }
        });
        let border: Vec<Border> = border.collect();
        Self { jacobian, symmetries: border.len(), border }
    }

    /// The same system with the parameter as an unknown.
    pub fn with(mut self, parameter: Border) -> Self {
        self.border.push(parameter);
        self
    }

    /// The Newton update for a residual and the residuals of conditions; those that are not given are zero.
    pub fn update(&self, residual: &DVector<f64>, conditions: &[f64]) -> Result<Option<Update>, CycleError> {
        let mut values = conditions.to_vec();
        values.resize(self.border.len(), 0.0);
        let Some((state, scalars)) = self.jacobian.solve(&self.border, residual, &values)? else { return Ok(None) };
        let scalar = |k: usize, there: bool| if there { scalars[k] } else { 0.0 };
        let (stretch, angle) = (scalar(0, self.symmetries > 0), scalar(1, self.symmetries > 1));
        let parameter = scalar(self.symmetries, self.border.len() > self.symmetries);
        let update = Update { state, stretch, angle, parameter };
        Ok(update.is_finite().then_some(update))
    }
}
