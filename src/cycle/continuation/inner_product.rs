//! The inner product of differences along a branch, and the conditions that it defines.

use std::ops::RangeInclusive;

use nalgebra::DVector;

use crate::cycle::extended::{Arclength, Condition, ExtraConditions, OrbitUnknowns};

/// The inner product along a branch: the mean square of strain times the length of the shoot, plus
/// that of the variables, scaled to the norm of the strain at the first point, plus the square of
/// the parameter over its range.
#[derive(Debug, Clone)]
pub struct InnerProduct {
    /// Weights of the squares of strain and variables.
    pub weights: DVector<f64>,
    /// Range of the parameter, and weight of its square.
    pub range: [f64; 2],
    parameter: f64,
    /// Length of the first shoot, m.
    pub length: f64,
}

impl InnerProduct {
    /// The product for a branch with given first point, length of the shoot (m) and range of the
    /// parameter.
    pub fn new(first: &OrbitUnknowns, length: f64, range: &RangeInclusive<f64>) -> Self {
        let weights = first.start.weights() * (length.powi(2) / first.start.strain.len() as f64);
        let range = [*range.start(), *range.end()];
        Self {
            weights,
            range,
            parameter: (range[1] - range[0]).powi(2).recip(),
            length,
        }
    }

    /// The product of two differences.
    pub fn product(&self, a: &OrbitUnknowns, b: &OrbitUnknowns) -> f64 {
        self.of_states(&a.start.present(), &b.start.present())
            + a.parameter * b.parameter * self.parameter
    }

    /// The product of strain and variables.
    pub fn of_states(&self, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
        self.weights.component_mul(a).dot(b)
    }

    /// The norm of a difference.
    pub fn norm(&self, tangent: &OrbitUnknowns) -> f64 {
        self.product(tangent, tangent).sqrt()
    }

    /// The pseudo-arclength condition: the projection on a tangent is that of the guess.
    pub fn arclength(&self, tangent: &OrbitUnknowns, guess: &OrbitUnknowns) -> ExtraConditions {
        let (state, parameter) = (
            self.weights.component_mul(&tangent.start.present()),
            tangent.parameter,
        );
        let condition = Condition::through(state, parameter * self.parameter, guess);
        ExtraConditions {
            arclength: Some(Arclength {
                condition,
                range: self.range,
            }),
            ..self.at_fixed_parameter()
        }
    }

    /// The conditions for a fixed parameter.
    pub fn at_fixed_parameter(&self) -> ExtraConditions {
        ExtraConditions {
            weights: Some(self.weights.clone()),
            ..ExtraConditions::default()
        }
    }

    /// A difference without its components along symmetry tangents, which lead to other states of
    /// the same orbit.
    pub fn without(
        &self,
        tangent: &OrbitUnknowns,
        symmetry_tangents: &[DVector<f64>],
    ) -> OrbitUnknowns {
        let mut out = tangent.clone();
        for symmetry in symmetry_tangents {
            let size = self.of_states(symmetry, symmetry);
            if size > 0.0 {
                let component = self.of_states(symmetry, &out.start.present()) / size;
                let mut state = out.start.flat();
                state
                    .rows_mut(0, symmetry.len())
                    .axpy(-component, symmetry, 1.0);
                out.start = out.start.with_values(&state);
            }
        }
        out
    }

    /// A difference without these components, of unit norm.
    pub fn unit(
        &self,
        tangent: &OrbitUnknowns,
        symmetry_tangents: &[DVector<f64>],
    ) -> OrbitUnknowns {
        let out = self.without(tangent, symmetry_tangents);
        out.scaled(self.norm(&out).recip())
    }

    /// Whether a rotating wave lies between two relative periodic orbits, whose symmetry tangents
    /// are given. On the wave a shift in time is a rotation; the component of the shift orthogonal
    /// to the rotation changes its sign.
    pub fn wave_between(&self, a: &[DVector<f64>], b: &[DVector<f64>]) -> bool {
        let shift = |symmetry_tangents: &[DVector<f64>]| {
            let [time, rotation] = symmetry_tangents else {
                return None;
            };
            Some(
                time - rotation
                    * (self.of_states(time, rotation) / self.of_states(rotation, rotation)),
            )
        };
        shift(a)
            .zip(shift(b))
            .is_some_and(|(a, b)| self.of_states(&a, &b) < 0.0)
    }
}
