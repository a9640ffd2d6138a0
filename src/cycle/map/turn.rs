//! A state that is turned about the vertical as a whole.

use super::state::Start;
use crate::cycle::error::CycleError;
use crate::tropism::{Declaration, Rotation, Source};

/// A turn of all about the tangent of the base: components 1 and 2 of the strain turn as pairs, the variables as they are declared.
#[derive(Debug, Clone)]
pub(crate) struct Turn {
    /// By how much, rad, counterclockwise as seen from above the apex.
    pub angle: f64,
    /// Of every variable of a point.
    variables: Vec<Rotation>,
}

impl Turn {
    pub fn new(laws: &Declaration, angle: f64) -> Result<Self, CycleError> {
        let number = laws.size().variables;
        let of = |k: usize| if k < number { laws.rotation(Source::Variable(k)) } else { Rotation::Undeclared };
        let variables: Vec<Rotation> = (0..number).map(of).collect();
        let known = |k: &usize| match of(*k) {
            Rotation::Undeclared => false,
            Rotation::Invariant => true,
            Rotation::First => of(*k + 1) == Rotation::Second,
            Rotation::Second => *k > 0 && of(*k - 1) == Rotation::First,
        };
        match (0..number).find(|k| !known(k)) {
            Some(variable) => Err(CycleError::Undeclared { variable }),
            None => Ok(Self { angle, variables }),
        }
    }

    /// Another turn of the same kind of states.
    pub fn by(&self, angle: f64) -> Self {
        Self { angle, ..self.clone() }
    }

    /// The state turned back by the angle.
    pub fn back(&self, start: &Start) -> Start {
        let (sine, cosine) = self.angle.sin_cos();
        self.map(start, [cosine, -sine, 1.0])
    }

    /// The rate at which a state changes that is turned, by the angle.
    pub fn rate(&self, start: &Start) -> Start {
        self.map(start, [0.0, 1.0, 0.0])
    }

    /// Pairs times a matrix of the form (a, −b; b, a), what stays times c.
    fn map(&self, start: &Start, [a, b, c]: [f64; 3]) -> Start {
        let mut out = start.clone();
        let pair = |x: &mut [f64]| (x[0], x[1]) = (a * x[0] - b * x[1], b * x[0] + a * x[1]);
        out.strain.as_mut_slice().chunks_exact_mut(2).for_each(pair);
        let points = std::iter::once(&mut out.variables).chain(out.slopes.iter_mut().flatten());
        for variables in points.flat_map(|all| all.as_mut_slice().chunks_exact_mut(self.variables.len().max(1))) {
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

/// The state turned back, if there is anything to turn it.
pub(crate) fn turned_back(turn: Option<&Turn>, start: Start) -> Start {
    match turn {
        Some(turn) => turn.back(&start),
        None => start,
    }
}
