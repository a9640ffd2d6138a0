//! What a branch of cycles needs of those who find them, whether they go round or to and fro.

use std::fmt::Debug;
use std::ops::RangeInclusive;

use nalgebra::{Complex, DVector};

use crate::cycle::error::CycleError;
use crate::cycle::map::state::Start;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::stability::Root;

/// A solver whose cycles can be followed.
pub trait Follow: Sized {
    /// What it finds.
    type Orbit: Clone + Debug;

    /// Whether exponents are logarithms of multipliers, and known up to 2πi over the period.
    const MULTIPLIED: bool;

    /// A cycle of small amplitude (m), from a mode at a value of the parameter.
    fn small<M: Model>(
        &self,
        shoot: &Shoot<M>,
        root: &Root,
        amplitude: f64,
        parameter: f64,
    ) -> Result<Unknowns, CycleError>;

    /// A cycle that has been found.
    fn known<M: Model>(&self, shoot: &Shoot<M>, orbit: &Self::Orbit, parameter: f64) -> Result<Unknowns, CycleError>;

    /// The cycle near a guess, on the line or plane of a condition.
    fn correct<M: Model>(
        &self,
        family: &mut impl FnMut(f64) -> Result<Shoot<M>, CycleError>,
        guess: Unknowns,
        condition: &Condition,
    ) -> Result<Corrected<Self::Orbit, M>, CycleError>;

    /// The solver on a finer grid in time; none if there is none.
    fn refined(&self) -> Option<Self>;

    /// The same place on that grid.
    fn on_finer_grid(&self, at: Unknowns) -> Unknowns;

    /// Its excursion, period and at least `count` leading exponents, all growing ones among them.
    fn look<M: Model>(&self, orbit: &Self::Orbit, shoot: &Shoot<M>, count: usize) -> Result<Look, CycleError>;
}

/// What is read off a cycle.
#[derive(Debug, Clone)]
pub struct Look {
    /// The largest distance of the tip from the axis, m.
    pub excursion: f64,
    /// s.
    pub period: f64,
    /// Exponents λ of disturbances exp(λt), 1/s, without the trivial ones: in the plane of the motion, or all, and out of it.
    pub exponents: [Vec<Complex<f64>>; 2],
    /// Largest modulus of the trivial exponents, which are not in the sets, 1/s.
    pub trivial: f64,
}

/// A cycle that has been found.
pub struct Corrected<O, M: Model> {
    pub orbit: O,
    pub unknowns: Unknowns,
    pub(super) same: Same,
    pub shoot: Shoot<M>,
}

/// States that are the same cycle: directions, of strain and variables, in which a state goes as time passes, and as all is turned.
#[derive(Debug, Clone, Default)]
pub(super) struct Same {
    pub directions: Vec<DVector<f64>>,
}

/// Where a branch is: a state, the period (s) or the rate (1/s), an angle, and the parameter.
#[derive(Debug, Clone)]
pub struct Unknowns {
    pub(super) start: Start,
    pub(super) clock: f64,
    /// Of what comes back turned, rad.
    pub(super) angle: f64,
    pub parameter: f64,
}

impl Unknowns {
    /// The same with as much of the past as another.
    pub(super) fn with_past_of(mut self, other: &Self) -> Self {
        self.start.keep(other.start.slopes.len());
        self
    }

    /// The way to another place on the branch, which keeps as much of the past.
    pub(super) fn to(&self, other: &Self) -> Way {
        Way {
            state: other.start.flat() - self.start.flat(),
            present: self.start.present().len(),
            clock: other.clock - self.clock,
            angle: other.angle - self.angle,
            parameter: other.parameter - self.parameter,
        }
    }

    /// The place that is reached by so much of a way.
    pub(super) fn along(&self, way: &Way, share: f64) -> Self {
        Self {
            start: self.start.with_values(&(self.start.flat() + &way.state * share)),
            clock: self.clock + way.clock * share,
            angle: self.angle + way.angle * share,
            parameter: self.parameter + way.parameter * share,
        }
    }
}

/// A way from one place to another.
#[derive(Debug, Clone)]
pub(super) struct Way {
    state: DVector<f64>,
    /// How many of the state's numbers are strain and variables.
    present: usize,
    clock: f64,
    angle: f64,
    pub parameter: f64,
}

impl Way {
    /// A change of the parameter alone.
    pub fn of_parameter(from: &Unknowns, change: f64) -> Self {
        let state = DVector::zeros(from.start.flat().len());
        Self { state, present: from.start.present().len(), clock: 0.0, angle: 0.0, parameter: change }
    }

    /// The same way from a place, on the finer grid of a solver.
    pub fn on_finer_grid(&self, from: &Unknowns, solver: &impl Follow) -> Self {
        // Interpolation is linear: a change of a state is interpolated like a state.
        let change = Unknowns { start: from.start.with_values(&self.state), ..from.clone() };
        Self { state: solver.on_finer_grid(change).start.flat(), ..self.clone() }
    }

    /// Strain and variables.
    fn present(&self) -> DVector<f64> {
        self.state.rows(0, self.present).clone_owned()
    }

    pub fn scaled(&self, by: f64) -> Self {
        let (clock, angle, parameter) = (self.clock * by, self.angle * by, self.parameter * by);
        Self { state: &self.state * by, present: self.present, clock, angle, parameter }
    }
}

/// How far places of a branch are from one another: the root mean square of the strain times the length of the shoot, that of the
/// variables by as much as they are of the strain at the first place, and the parameter over its range.
#[derive(Debug, Clone)]
pub(super) struct Measure {
    /// Of strain and variables.
    weights: DVector<f64>,
    /// Of the first shoot, m.
    pub length: f64,
    range: f64,
    within: [f64; 2],
}

impl Measure {
    pub fn new(first: &Unknowns, length: f64, within: &RangeInclusive<f64>) -> Self {
        let within = [*within.start(), *within.end()];
        let weights = first.start.weights();
        Self {
            weights: weights * (length.powi(2) / first.start.strain.len() as f64),
            length,
            range: within[1] - within[0],
            within,
        }
    }

    pub fn product(&self, a: &Way, b: &Way) -> f64 {
        self.weights.component_mul(&a.present()).dot(&b.present()) + a.parameter * b.parameter / self.range.powi(2)
    }

    /// The product of two states: negative of those that are half a period apart.
    pub fn agreement(&self, a: &Unknowns, b: &Unknowns) -> f64 {
        self.weights.component_mul(&a.start.present()).dot(&b.start.present())
    }

    pub fn size(&self, way: &Way) -> f64 {
        self.product(way, way).sqrt()
    }

    /// The condition that a place lies as far along a way as a guess.
    pub fn condition(&self, way: &Way, guess: &Unknowns) -> Condition {
        let state = self.weights.component_mul(&way.present());
        let parameter = way.parameter / self.range.powi(2);
        let mut out = Condition { state, parameter, ..self.at(0.0) };
        (out.value, out.fixed) = (0.0, None);
        out.value = -out.left(guess);
        out
    }

    /// A value of the parameter as the condition.
    pub fn at(&self, parameter: f64) -> Condition {
        let (weight, within) = (self.range.recip(), self.within);
        let (weights, state) = (self.weights.clone(), DVector::zeros(self.weights.len()));
        let (value, fixed) = (weight * parameter, Some(parameter));
        Condition { weights, state, parameter: weight, value, fixed, within, phases: Vec::new() }
    }

    /// How far a way leads along a direction, in units of it.
    fn part(&self, way: &Way, direction: &DVector<f64>) -> f64 {
        let weighted = self.weights.component_mul(direction);
        let size = weighted.dot(direction);
        if size > 0.0 { weighted.dot(&way.present()) / size } else { 0.0 }
    }

    /// A way without what leads to other states of the same cycle.
    pub fn without(&self, way: &Way, same: &Same) -> Way {
        let mut out = way.clone();
        for direction in &same.directions {
            let part = self.part(&out, direction);
            out.state.rows_mut(0, out.present).axpy(-part, direction, 1.0);
        }
        out
    }

    /// The same, of unit size.
    pub fn unit(&self, way: &Way, same: &Same) -> Way {
        let out = self.without(way, same);
        out.scaled(self.size(&out).recip())
    }

    /// Whether two rosettes are on either side of a circle. There a shift in time is a turn; beyond it the two differ by the opposite.
    pub fn circle_between(&self, a: &Same, b: &Same) -> bool {
        let differ = |same: &Same| {
            let [time, turn] = &same.directions[..] else { return None };
            let along = |x: &DVector<f64>| self.weights.component_mul(x).dot(turn);
            Some(time - turn * (along(time) / along(turn)))
        };
        let products = differ(a).zip(differ(b)).map(|(a, b)| self.weights.component_mul(&a).dot(&b));
        products.is_some_and(|product| product < 0.0)
    }
}

/// Step of the central differences by the parameter, over its range: they err by 1e-10.
const DIFFERENCE: f64 = 1e-5;

/// A linear condition on strain, variables and parameter.
#[derive(Debug, Clone)]
pub struct Condition {
    /// Weights of the squares of strain and variables.
    pub(super) weights: DVector<f64>,
    pub(super) state: DVector<f64>,
    pub(super) parameter: f64,
    value: f64,
    /// The parameter, if that is the condition: to the last bit, as there may be no shoot beyond the end of the range.
    pub(super) fixed: Option<f64>,
    /// The range of the parameter.
    within: [f64; 2],
    /// Weights of strain and variables, and values, by which a state is told from others of the same cycle; none if they are those of the
    /// guess.
    phases: Vec<(DVector<f64>, f64)>,
}

impl Condition {
    /// The same, with a state that is neither later than that of a place nor turned against it: else a branch would spend its steps on
    /// going round a cycle.
    pub(super) fn beside_place(mut self, place: &Unknowns, same: &Same) -> Self {
        let phase = |direction: &DVector<f64>| {
            let weights = self.weights.component_mul(direction);
            let value = weights.dot(&place.start.present());
            (weights, value)
        };
        self.phases = same.directions.iter().map(phase).collect();
        self
    }

    /// Weights of strain and variables by which one such phase is told, if it is not that of the guess.
    pub(super) fn phase(&self, k: usize) -> Option<&DVector<f64>> {
        self.phases.get(k).map(|(weights, _)| weights)
    }

    /// What is left of it.
    pub(super) fn phase_left(&self, k: usize, at: &Unknowns) -> f64 {
        self.phases.get(k).map_or(0.0, |(weights, value)| value - weights.dot(&at.start.present()))
    }

    /// Two parameters beside one, for differences: within the range, outside which there may be no shoot.
    pub(super) fn beside(&self, parameter: f64) -> [f64; 2] {
        let [from, to] = self.within;
        let step = DIFFERENCE * (to - from);
        let both = [parameter - step, parameter + step];
        if (from..=to).contains(&parameter) { both.map(|beside| beside.clamp(from, to)) } else { both }
    }

    /// What is left of it.
    pub(super) fn left(&self, at: &Unknowns) -> f64 {
        self.value - self.state.dot(&at.start.present()) - self.parameter * at.parameter
    }
}
