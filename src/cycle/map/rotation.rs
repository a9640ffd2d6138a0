//! Rotations of a state about the tangent of the base.

use super::phase_state::PhaseState;
use crate::cycle::error::CycleError;
use crate::tropism::{Declaration, Rotation, Source};

/// A rotation of a state about the tangent of the base. Components 1 and 2 of the strain rotate as
/// pairs, variables as declared.
#[derive(Debug, Clone)]
pub(crate) struct StateRotation {
    /// Angle, rad, counterclockwise as seen from above the apex.
    pub angle: f64,
    /// Declared rotation of each variable of a point.
    variables: Vec<Rotation>,
}

impl StateRotation {
    /// The rotation by an angle (rad).
    ///
    /// # Errors
    /// A variable whose rotation is not declared.
    pub fn new(laws: &Declaration, angle: f64) -> Result<Self, CycleError> {
        let number = laws.size().variables;
        let variables: Vec<Rotation> = (0..number)
            .map(|k| laws.rotation(Source::Variable(k)))
            .collect();
        let declared = |k: usize| {
            variables[k] != Rotation::Undeclared
                && Rotation::missing_partner(&variables, k).is_none()
        };
        match (0..number).find(|k| !declared(*k)) {
            Some(variable) => Err(CycleError::Undeclared { variable }),
            None => Ok(Self { angle, variables }),
        }
    }

    /// The rotation of the same kind of states by another angle (rad).
    pub fn by(&self, angle: f64) -> Self {
        Self {
            angle,
            ..self.clone()
        }
    }

    /// The state rotated by the negative angle.
    pub fn back(&self, start: &PhaseState) -> PhaseState {
        let (sine, cosine) = self.angle.sin_cos();
        self.map(start, [cosine, -sine, 1.0])
    }

    /// The tangent of the rotation: the derivative of a rotated state by the angle.
    pub fn rate(&self, start: &PhaseState) -> PhaseState {
        self.map(start, [0.0, 1.0, 0.0])
    }

    /// Multiplies pairs by the matrix (a, −b; b, a) and invariant variables by c.
    fn map(&self, start: &PhaseState, [a, b, c]: [f64; 3]) -> PhaseState {
        let mut out = start.clone();
        let pair = |x: &mut [f64]| (x[0], x[1]) = (a * x[0] - b * x[1], b * x[0] + a * x[1]);
        out.strain.as_mut_slice().chunks_exact_mut(2).for_each(pair);
        for variables in out.variables_of_points(self.variables.len()) {
            for (k, rotation) in self.variables.iter().enumerate() {
                match rotation {
                    Rotation::First => pair(&mut variables[k..k + 2]),
                    Rotation::Second => {}
                    Rotation::Invariant | Rotation::Undeclared => variables[k] *= c,
                }
            }
        }
        out
    }
}
