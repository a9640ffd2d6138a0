//! Extended systems: the equations of an orbit with its scalar unknowns and their conditions.
//!
//! The unknowns are a state x and scalars: the logarithm of the period T or of the rate of rotation
//! ν, the angle of a relative periodic orbit, and the parameter of a branch. The strain in a state
//! is components 1 and 2 of u* at the material points. [`OrbitUnknowns`] contain T or ν itself; a
//! difference contains its change. Each scalar unknown is determined by a linear condition: a phase
//! condition for time, one for rotation, and the pseudo-arclength condition for the parameter.
//! Newton's method solves the bordered system
//!
//! ```text
//! J δx + Σ columns δs = −residual,     rows · δx + corners δs = residuals of the conditions.
//! ```
//!
//! See E. J. Doedel, *Lecture notes on numerical analysis of nonlinear equations* (2007), and the
//! extended systems of DDE-BIFTOOL.

use nalgebra::DVector;

use super::error::{CycleError, Outcome};
use super::map::PhaseState;

/// Half-width of central differences by period, rate and parameter; relative to period and rate,
/// and for the parameter relative to its range. Their truncation error is of the order of its
/// square, 1e-10, as is the rounding error of 1e-15 divided by it.
pub(super) const DIFFERENCE: f64 = 1e-5;

/// Unknowns of the extended system, or a difference of two: an update of Newton's method, or a
/// secant or tangent of a branch.
#[derive(Debug, Clone)]
pub struct OrbitUnknowns {
    /// State of the shoot at t = 0.
    pub(in crate::cycle) start: PhaseState,
    /// Period (s), or rate of rotation (rad/s, counterclockwise positive).
    pub period_or_rate: f64,
    /// Whether the period is that of the forcing, and not an unknown.
    pub forced: bool,
    /// Rotation of the shoot over a period, rad, counterclockwise positive.
    pub angle: f64,
    /// Parameter of the branch.
    pub parameter: f64,
}

impl OrbitUnknowns {
    /// The unknowns at a distance along a difference.
    pub fn along(&self, difference: &Self, distance: f64) -> Self {
        Self {
            start: self
                .start
                .with_values(&(self.start.flat() + difference.start.flat() * distance)),
            period_or_rate: self.period_or_rate + difference.period_or_rate * distance,
            forced: self.forced,
            angle: self.angle + difference.angle * distance,
            parameter: self.parameter + difference.parameter * distance,
        }
    }

    /// The difference to other unknowns with a past of the same length.
    pub fn to(&self, other: &Self) -> Self {
        other.along(self, -1.0)
    }

    /// The difference multiplied by a number.
    pub fn scaled(&self, by: f64) -> Self {
        let (period_or_rate, angle, parameter) = (
            self.period_or_rate * by,
            self.angle * by,
            self.parameter * by,
        );
        Self {
            start: self.start.with_values(&(self.start.flat() * by)),
            period_or_rate,
            angle,
            parameter,
            ..*self
        }
    }

    /// The same unknowns with a past as long as that of others.
    pub fn with_past_of(mut self, other: &Self) -> Self {
        self.start.keep(other.start.slopes.len());
        self
    }
}

/// A linear condition on strain, variables and parameter.
pub struct Condition {
    /// Coefficients of strain and variables.
    pub state: DVector<f64>,
    /// Coefficient of the parameter.
    pub parameter: f64,
    /// Prescribed value of the linear form.
    pub value: f64,
}

impl Condition {
    /// The condition with given coefficients that some unknowns satisfy.
    pub fn through(state: DVector<f64>, parameter: f64, at: &OrbitUnknowns) -> Self {
        let value = state.dot(&at.start.present()) + parameter * at.parameter;
        Self {
            state,
            parameter,
            value,
        }
    }

    fn residual(&self, at: &OrbitUnknowns) -> f64 {
        self.value - self.state.dot(&at.start.present()) - self.parameter * at.parameter
    }
}

/// The pseudo-arclength condition of a branch.
pub struct Arclength {
    /// The condition.
    pub condition: Condition,
    /// Range of the parameter.
    pub range: [f64; 2],
}

impl Arclength {
    /// Two parameters for a difference quotient at a third one. They lie within the range if the
    /// third one does, since the family may not be defined outside.
    pub fn beside(&self, parameter: f64) -> [f64; 2] {
        let [from, to] = self.range;
        let step = DIFFERENCE * (to - from);
        let both = [parameter - step, parameter + step];
        if (from..=to).contains(&parameter) {
            both.map(|beside| beside.clamp(from, to))
        } else {
            both
        }
    }
}

/// The conditions that close the extended system.
#[derive(Default)]
pub struct ExtraConditions {
    /// Phase conditions in time and in rotation. Where none is given, an update has no component
    /// along the tangent of the symmetry.
    pub phases: Vec<Condition>,
    /// Weights of strain and variables in the phase conditions; by default those of the state.
    pub weights: Option<DVector<f64>>,
    /// The pseudo-arclength condition; none if the parameter is fixed.
    pub arclength: Option<Arclength>,
}

impl ExtraConditions {
    /// Adds phase conditions: the difference to a reference is orthogonal to the tangents of its
    /// symmetries.
    pub fn with_phases_of(
        mut self,
        reference: &OrbitUnknowns,
        symmetry_tangents: &[DVector<f64>],
    ) -> Self {
        let weights = self.weights_at(reference);
        let phase = |tangent: &DVector<f64>| {
            Condition::through(weights.component_mul(tangent), 0.0, reference)
        };
        self.phases = symmetry_tangents.iter().map(phase).collect();
        self
    }

    /// Weights of the phase conditions at some unknowns.
    fn weights_at(&self, at: &OrbitUnknowns) -> DVector<f64> {
        self.weights.clone().unwrap_or_else(|| at.start.weights())
    }

    /// Residuals of a number of phase conditions and of the pseudo-arclength condition.
    pub fn residuals(&self, number: usize, at: &OrbitUnknowns) -> Vec<f64> {
        let phases =
            (0..number).map(|k| self.phases.get(k).map_or(0.0, |phase| phase.residual(at)));
        phases
            .chain(
                self.arclength
                    .iter()
                    .map(|arclength| arclength.condition.residual(at)),
            )
            .collect()
    }
}

/// A scalar unknown of the extended system, with its condition: log T or log ν, the angle, or the
/// parameter.
pub struct Border {
    /// Derivative of the residual by the unknown.
    pub column: DVector<f64>,
    /// Coefficients of strain and variables in the condition.
    pub row: DVector<f64>,
    /// Coefficient of the unknown in its own condition.
    pub corner: f64,
}

/// A continuous symmetry of the equations, with the scalar unknown that its phase condition
/// determines: log T or log ν for a shift in time, the angle for a rotation.
pub struct Symmetry {
    /// Derivative of strain and variables along the symmetry.
    pub tangent: DVector<f64>,
    /// Derivative of the residual by the unknown.
    pub column: DVector<f64>,
}

/// The derivative J of a residual by the state.
pub trait StateJacobian {
    /// Solves the bordered system for the update of the state and of the scalar unknowns, given the
    /// residual and the residuals of the conditions. Returns none if the linear solver fails.
    fn solve(&self, border: &[Border], residuals: &DVector<f64>) -> Outcome<Option<DVector<f64>>>;
}

/// The linearised extended system.
pub struct BorderedSystem<J> {
    jacobian: J,
    border: Vec<Border>,
    /// Number of symmetries, whose borders come first.
    pub symmetries: usize,
}

impl<J: StateJacobian> BorderedSystem<J> {
    /// The system with the phase conditions of `conditions`, and with the border of the parameter
    /// if it is unknown.
    pub fn new(
        jacobian: J,
        symmetries: Vec<Symmetry>,
        parameter: Option<Border>,
        conditions: &ExtraConditions,
        at: &OrbitUnknowns,
    ) -> Self {
        let (number, weights) = (symmetries.len(), conditions.weights_at(at));
        let phases = symmetries
            .into_iter()
            .enumerate()
            .map(|(k, Symmetry { tangent, column })| {
                let given = conditions.phases.get(k).map(|phase| phase.state.clone());
                Border {
                    column,
                    row: given.unwrap_or_else(|| weights.component_mul(&tangent)),
                    corner: 0.0,
                }
            });
        Self {
            jacobian,
            border: phases.chain(parameter).collect(),
            symmetries: number,
        }
    }

    /// The Newton update at some unknowns, for a residual and the residuals of the conditions.
    /// Conditions without a residual hold.
    pub fn update(
        &self,
        at: &OrbitUnknowns,
        residual: &DVector<f64>,
        conditions: &[f64],
    ) -> Result<Option<OrbitUnknowns>, CycleError> {
        let n = residual.len();
        let mut residuals = residual
            .clone()
            .resize_vertically(n + self.border.len(), 0.0);
        residuals
            .iter_mut()
            .skip(n)
            .zip(conditions)
            .for_each(|(to, condition)| *to = *condition);
        let Some(found) = self.jacobian.solve(&self.border, &residuals)? else {
            return Ok(None);
        };
        let scalars = &found.as_slice()[n..];
        let symmetry = |k: usize| if k < self.symmetries { scalars[k] } else { 0.0 };
        let update = OrbitUnknowns {
            start: at.start.with_values(&found.rows(0, n).clone_owned()),
            forced: at.forced,
            // The unknown is the logarithm of the period or rate.
            period_or_rate: symmetry(0) * at.period_or_rate,
            angle: symmetry(1),
            parameter: scalars.get(self.symmetries).copied().unwrap_or(0.0),
        };
        let finite = found
            .iter()
            .chain([&update.period_or_rate])
            .all(|x| x.is_finite());
        Ok(finite.then_some(update))
    }
}
