//! Differences between points of a branch, and their norm.

use std::ops::RangeInclusive;

use nalgebra::DVector;

use crate::cycle::equations::Equations;
use crate::cycle::extended::{Arclength, Condition, Conditions, Unknowns};

impl Unknowns {
    /// The same unknowns with as long a past as others.
    pub(super) fn with_past_of(mut self, other: &Self) -> Self {
        self.start.keep(other.start.slopes.len());
        self
    }

    /// The difference to other unknowns with as long a past.
    pub(super) fn to(&self, other: &Self) -> Tangent {
        Tangent {
            state: other.start.flat() - self.start.flat(),
            present: self.start.present().len(),
            clock: other.clock - self.clock,
            angle: other.angle - self.angle,
            parameter: other.parameter - self.parameter,
        }
    }

    /// The unknowns at a distance along a tangent.
    pub(super) fn along(&self, tangent: &Tangent, distance: f64) -> Self {
        Self {
            start: self.start.with_values(&(self.start.flat() + &tangent.state * distance)),
            clock: self.clock + tangent.clock * distance,
            forced: self.forced,
            angle: self.angle + tangent.angle * distance,
            parameter: self.parameter + tangent.parameter * distance,
        }
    }
}

/// A difference of unknowns: a secant of a branch, or its tangent.
#[derive(Debug, Clone)]
pub struct Tangent {
    state: DVector<f64>,
    /// Number of leading components of the state that are strain and variables.
    present: usize,
    clock: f64,
    angle: f64,
    /// Change of the parameter.
    pub parameter: f64,
}

impl Tangent {
    /// A change of the parameter alone.
    pub fn of_parameter(from: &Unknowns, change: f64) -> Self {
        let state = DVector::zeros(from.start.flat().len());
        Self { state, present: from.start.present().len(), clock: 0.0, angle: 0.0, parameter: change }
    }

    /// The same tangent at some unknowns, on the finer grid of a solver.
    pub fn on_finer_grid(&self, from: &Unknowns, solver: &impl Equations) -> Self {
        // Interpolation is linear: a change of a state is interpolated like a state.
        let change = Unknowns { start: from.start.with_values(&self.state), ..from.clone() };
        Self { state: solver.on_finer_grid(change).start.flat(), ..self.clone() }
    }

    /// Strain and variables.
    fn present(&self) -> DVector<f64> {
        self.state.rows(0, self.present).clone_owned()
    }

    fn scaled(&self, by: f64) -> Self {
        let (clock, angle, parameter) = (self.clock * by, self.angle * by, self.parameter * by);
        Self { state: &self.state * by, present: self.present, clock, angle, parameter }
    }
}

/// The inner product along a branch. It is the mean square of strain times the length of the shoot, that of the variables, scaled to the
/// size of the strain at the first point, and the square of the parameter over its range.
#[derive(Debug, Clone)]
pub struct InnerProduct {
    /// Weights of the squares of strain and variables.
    weights: DVector<f64>,
    range: [f64; 2],
}

impl InnerProduct {
    /// The product for a branch with a first point, a length (m) and a range of the parameter.
    pub fn new(first: &Unknowns, length: f64, range: &RangeInclusive<f64>) -> Self {
        let weights = first.start.weights() * (length.powi(2) / first.start.strain.len() as f64);
        Self { weights, range: [*range.start(), *range.end()] }
    }

    /// Weight of the square of the parameter.
    fn of_parameter(&self) -> f64 {
        (self.range[1] - self.range[0]).powi(2).recip()
    }

    /// The product of two tangents.
    pub fn product(&self, a: &Tangent, b: &Tangent) -> f64 {
        self.of_states(&a.present(), &b.present()) + a.parameter * b.parameter * self.of_parameter()
    }

    /// The product of strain and variables.
    pub fn of_states(&self, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
        self.weights.component_mul(a).dot(b)
    }

    /// The norm of a tangent.
    pub fn norm(&self, tangent: &Tangent) -> f64 {
        self.product(tangent, tangent).sqrt()
    }

    /// The pseudo-arclength condition that the projection on a tangent is that of a guess.
    pub fn arclength(&self, tangent: &Tangent, guess: &Unknowns) -> Conditions {
        let (state, parameter) = (self.weights.component_mul(&tangent.present()), tangent.parameter);
        let condition = Condition::through(state, parameter * self.of_parameter(), guess);
        Conditions { arclength: Some(Arclength { condition, range: self.range }), ..self.at_fixed_parameter() }
    }

    /// The conditions for a fixed parameter.
    pub fn at_fixed_parameter(&self) -> Conditions {
        Conditions { weights: Some(self.weights.clone()), ..Conditions::default() }
    }

    /// Adds the phase conditions that some unknowns satisfy, whose symmetry tangents are given.
    pub fn with_phases_of(&self, conditions: Conditions, at: &Unknowns, symmetries: &[DVector<f64>]) -> Conditions {
        conditions.with_phases_of(at, symmetries, &self.weights)
    }

    /// A tangent without its components along symmetry tangents, which lead to other states of the same orbit.
    pub fn without(&self, tangent: &Tangent, symmetries: &[DVector<f64>]) -> Tangent {
        let mut out = tangent.clone();
        for symmetry in symmetries {
            let size = self.of_states(symmetry, symmetry);
            if size > 0.0 {
                let component = self.of_states(symmetry, &out.present()) / size;
                out.state.rows_mut(0, out.present).axpy(-component, symmetry, 1.0);
            }
        }
        out
    }

    /// The same, of unit norm.
    pub fn unit(&self, tangent: &Tangent, symmetries: &[DVector<f64>]) -> Tangent {
        let out = self.without(tangent, symmetries);
        out.scaled(self.norm(&out).recip())
    }

    /// Whether two rosettes lie on either side of a rotating wave. There a shift in time is a rotation; the component of the shift that is
    /// no rotation changes its sign.
    pub fn wave_between(&self, a: &[DVector<f64>], b: &[DVector<f64>]) -> bool {
        let shift = |symmetries: &[DVector<f64>]| {
            let [time, rotation] = symmetries else { return None };
            Some(time - rotation * (self.of_states(time, rotation) / self.of_states(rotation, rotation)))
        };
        shift(a).zip(shift(b)).is_some_and(|(a, b)| self.of_states(&a, &b) < 0.0)
    }
}
