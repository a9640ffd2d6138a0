//! What the corrector and a branch need of one kind of orbit.

use std::fmt::Debug;

use nalgebra::{Complex, DVector};

use super::disturbances::Disturbances;
use super::error::CycleError;
use super::extended::{Bordered, Jacobian, Symmetry, Unknowns};
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::Root;

/// What the iteration of an orbit took.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Newton iterations.
    pub iterations: usize,
    /// Equilibria that were solved.
    pub equilibria: usize,
    /// Relative residual.
    pub residual: f64,
}

/// Stability and size of an orbit.
#[derive(Debug, Clone)]
pub struct Observation {
    /// Largest distance of the tip from the axis, m.
    pub excursion: f64,
    /// Period, s.
    pub period: f64,
    /// Exponents λ of disturbances exp(λt), 1/s, without the trivial ones.
    pub exponents: Disturbances<Complex<f64>>,
    /// Largest modulus of the trivial exponents, 1/s.
    pub trivial: f64,
}

/// A Jacobian and the symmetries of the equations: time first, then rotation if it has an unknown of its own.
pub type Linearised<J> = (J, Vec<Symmetry>);

/// The equations of one kind of orbit, as the settings of its solver make them.
pub trait Equations: Clone {
    /// The solution.
    type Orbit: Clone + Debug;
    /// The residual at some unknowns, with what its derivatives need.
    type Evaluation<'a, M: Model + 'a>;
    /// The linearisation by the state.
    type Jacobian: Jacobian;
    /// Largest ratio of a residual to the previous one for which the Jacobian is kept.
    const KEEP: f64;
    /// Whether exponents are logarithms of multipliers, known up to 2πi over the period.
    const FLOQUET: bool;

    /// Initial guess with a small amplitude (m), from a mode.
    fn of_mode<M: Model>(&self, shoot: &Shoot<M>, root: &Root, amplitude: f64) -> Result<Unknowns, CycleError>;

    /// Initial guess from a known orbit.
    fn of_orbit<M: Model>(&self, shoot: &Shoot<M>, orbit: &Self::Orbit) -> Result<Unknowns, CycleError>;

    /// Largest relative residual of a solution.
    fn tolerance(&self) -> f64;

    /// Bound on the iterations.
    fn max_iterations(&self) -> usize;

    /// Extends the past of a state if the delays of a shoot exceed it. Returns whether it did.
    fn extend_past<M: Model>(&self, shoot: &Shoot<M>, at: &mut Unknowns) -> Result<bool, CycleError>;

    /// Evaluates the residual. Rods of an earlier evaluation are initial guesses of the equilibria.
    fn evaluate<'a, M: Model>(
        &self,
        shoot: &'a Shoot<M>,
        at: &Unknowns,
        rods: Vec<Rod>,
    ) -> Result<Self::Evaluation<'a, M>, CycleError>;

    /// Rods of an evaluation.
    fn rods<M: Model>(here: &Self::Evaluation<'_, M>) -> Vec<Rod>;

    /// Equilibria that an evaluation and its linearisation have solved.
    fn equilibria<M: Model>(here: &Self::Evaluation<'_, M>) -> usize;

    /// The residual, and its size relative to what it is a difference of.
    fn residual<M: Model>(&self, here: &Self::Evaluation<'_, M>, at: &Unknowns) -> (DVector<f64>, f64);

    /// Checks the shoot for the properties that the equations assume.
    fn check<M: Model>(&self, here: &Self::Evaluation<'_, M>, at: &Unknowns) -> Result<(), CycleError>;

    /// The linearisation; none if the laws are singular.
    fn linearise<M: Model>(
        &self,
        here: &mut Self::Evaluation<'_, M>,
        at: &Unknowns,
    ) -> Result<Option<Linearised<Self::Jacobian>>, CycleError>;

    /// The orbit of a converged iteration, and the tangents of its symmetries. A Jacobian of a nearby state may be known.
    fn orbit<M: Model>(
        &self,
        here: Self::Evaluation<'_, M>,
        at: &Unknowns,
        known: Option<Bordered<Self::Jacobian>>,
        effort: Effort,
    ) -> Result<(Self::Orbit, Vec<DVector<f64>>), CycleError>;

    /// Returns an error unless the grid in time resolves an orbit.
    fn check_resolution(&self, orbit: &Self::Orbit) -> Result<(), CycleError>;

    /// The solver on a finer grid in time; none if there is none.
    fn refined(&self) -> Option<Self>;

    /// The same state on that grid.
    fn on_finer_grid(&self, at: Unknowns) -> Unknowns;

    /// Size and stability of an orbit: at least `count` leading exponents, and all with a positive real part.
    fn observe<M: Model>(&self, orbit: &Self::Orbit, shoot: &Shoot<M>, count: usize)
    -> Result<Observation, CycleError>;
}
