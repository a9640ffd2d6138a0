//! The interface between one kind of orbit and the corrector and continuation, which are common to
//! all kinds.

use std::fmt::Debug;

use nalgebra::{Complex, DVector};

use super::disturbances::Disturbances;
use super::error::{CycleError, Outcome};
use super::extended::{BorderedSystem, OrbitUnknowns, StateJacobian, Symmetry};
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::Root;

/// Smallest number of exponents of a point of a branch.
pub const OBSERVED: usize = 2;

/// Settings of Newton's method.
pub struct Newton {
    /// Largest relative residual of a solution.
    pub tolerance: f64,
    /// Largest number of iterations.
    pub max_iterations: usize,
    /// Largest number of equilibria of a search on all grids.
    pub max_work: usize,
    /// Largest ratio of a residual to the previous one for which the Jacobian is kept.
    pub keep: f64,
}

/// Cost and accuracy of a converged iteration.
pub struct Effort {
    /// Number of Newton iterations.
    pub iterations: usize,
    /// Number of solved equilibria.
    pub equilibria: usize,
    /// Relative residual.
    pub residual: f64,
}

/// Stability and size of an orbit.
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

/// The equations of one kind of orbit, with the settings of its solver.
pub trait Equations: Clone {
    /// The solution.
    type Orbit: Clone + Debug;
    /// The derivative of the residual by the state.
    type Jacobian: StateJacobian;
    /// The equations at some unknowns.
    type Evaluation<'a, M: Model + 'a>: EvaluatedEquations<Self>;
    /// Whether exponents are logarithms of Floquet multipliers, determined up to multiples of
    /// 2πi/T.
    const FLOQUET: bool;

    /// Settings of Newton's method.
    fn newton(&self) -> Newton;

    /// Initial guess from a mode, with a small amplitude of the tip (m).
    fn of_mode<M: Model>(
        &self,
        shoot: &Shoot<M>,
        root: &Root,
        amplitude: f64,
    ) -> Outcome<OrbitUnknowns>;

    /// Initial guess from a known orbit.
    fn of_orbit<M: Model>(&self, shoot: &Shoot<M>, orbit: &Self::Orbit) -> Outcome<OrbitUnknowns>;

    /// Evaluates the residual. `rods` of an earlier evaluation are the initial guesses of the
    /// equilibria.
    fn evaluate<'a, M: Model>(
        &self,
        shoot: &'a Shoot<M>,
        at: &OrbitUnknowns,
        rods: Vec<Rod>,
    ) -> Computed<'a, Self, M>;

    /// Size and stability of an orbit: at least [`OBSERVED`] leading exponents, and all with
    /// positive real part.
    fn observe<M: Model>(&self, orbit: &Self::Orbit, shoot: &Shoot<M>) -> Outcome<Observation>;

    /// Extends the past in a state if a delay of the shoot is longer. Returns whether it did.
    fn extend_past<M: Model>(&self, _shoot: &Shoot<M>, _at: &mut OrbitUnknowns) -> Outcome<bool> {
        Ok(false)
    }

    /// Returns an error unless the grid in time resolves an orbit.
    fn check_resolution(&self, _orbit: &Self::Orbit) -> Outcome {
        Ok(())
    }

    /// Refines the grid in time, and returns the given unknowns or differences on it. `None`,
    /// without a change, if there is no finer grid.
    fn refine<const N: usize>(
        &mut self,
        _states: [OrbitUnknowns; N],
    ) -> Option<[OrbitUnknowns; N]> {
        None
    }
}

/// The equations of a shoot at some unknowns, or the reason why they are not evaluated.
pub type Computed<'a, E, M> = Result<<E as Equations>::Evaluation<'a, M>, CycleError>;

/// The equations of an orbit at some unknowns.
pub trait EvaluatedEquations<E: Equations> {
    /// Rods in equilibrium.
    fn rods(&self) -> Vec<Rod>;

    /// Number of equilibria solved so far.
    fn equilibria(&self) -> usize;

    /// The residual, and its norm relative to the terms of which it is the difference.
    fn residual(&self) -> (DVector<f64>, f64);

    /// Returns an error unless the shoot has the properties that the equations assume.
    fn check(&self) -> Outcome;

    /// The Jacobian and the symmetries: a shift in time first, then a rotation if it has an unknown
    /// of its own. None if the laws are singular.
    fn linearise(&mut self) -> Outcome<Option<(E::Jacobian, Vec<Symmetry>)>>;

    /// The tangents of the symmetries.
    fn symmetry_tangents(&self) -> Vec<DVector<f64>>;

    /// The orbit at converged unknowns. The linearisation at nearby unknowns may be known.
    fn into_orbit(
        self,
        known: Option<BorderedSystem<E::Jacobian>>,
        effort: Effort,
    ) -> Outcome<E::Orbit>;
}
