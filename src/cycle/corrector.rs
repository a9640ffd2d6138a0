//! The corrector: Newton's method for the extended system.
//!
//! One iteration solves periodic orbits, relative periodic orbits and rotating waves, of a single
//! shoot or on a branch. The kinds of orbits differ in their [`Equations`]; single orbits and
//! points of a branch differ in their [`ExtraConditions`].
//!
//! The stationary state solves the equations of a periodic orbit for any period. For single orbits
//! this solution is deflated: Newton's method is applied to the residual divided by the norm of the
//! strain (P. E. Farrell, Á. Birkisson & S. W. Funke 2015). The deflation of eigenvectors in
//! `spectrum` is another method.

use std::borrow::Borrow;

use nalgebra::DVector;

use super::equations::{Effort, Equations, EvaluatedEquations};
use super::error::CycleError;
use super::extended::{Border, BorderedSystem, ExtraConditions, OrbitUnknowns};
use crate::error::{ParameterError, ensure};
use crate::model::Model;
use crate::shoot::Shoot;

/// Strain times length of the shoot (rad) below which a state is stationary: the motion of the tip
/// is a millionth of the length.
pub const STATIONARY: f64 = 1e-6;
/// Largest relative change of the period or rate in an iteration with deflation.
const STRETCH: f64 = 0.2;

/// Ratio of the residual of an orbit that is evaluated again to the tolerance of its search. With
/// other initial guesses the equilibria differ by rounding.
const AGAIN: f64 = 100.0;

/// Returns an error for the relative residual of an orbit that belongs to another shoot, given the
/// tolerance with which it was found.
pub fn check_residual(residual: f64, tolerance: f64) -> Result<(), ParameterError> {
    let (what, requirement) = (
        "relative residual of the orbit",
        "near zero: take the shoot whose orbit this is",
    );
    ParameterError::unless(residual <= AGAIN * tolerance, what, residual, requirement)
}

/// A solution of the extended system.
pub struct Corrected<O, B> {
    pub orbit: O,
    pub unknowns: OrbitUnknowns,
    /// Tangents of the symmetries at the state: the directions of a shift in time and of a
    /// rotation.
    pub symmetry_tangents: Vec<DVector<f64>>,
    pub shoot: B,
}

/// Solves the extended system on one grid in time. The Jacobian is kept while the residual
/// decreases fast. `equilibria` is the number of equilibria of the search so far, to which those of
/// this grid are added.
///
/// # Errors
/// Errors of the evaluation at the initial guess. Equilibrium and parameter errors of later
/// iterations are returned as `NotConverged`, all other errors unchanged.
pub fn correct<S: Equations, M: Model, B: Borrow<Shoot<M>>>(
    equations: &S,
    family: &mut impl FnMut(f64) -> Result<B, CycleError>,
    mut at: OrbitUnknowns,
    conditions: &ExtraConditions,
    equilibria: &mut usize,
) -> Result<Corrected<S::Orbit, B>, CycleError> {
    let newton = equations.newton();
    let deflated = conditions.arclength.is_none() && !at.forced;
    let (mut iterations, mut last) = (0, f64::INFINITY);
    let mut kept: Option<(BorderedSystem<S::Jacobian>, f64)> = None;
    let mut rods = Vec::new();
    loop {
        let diverged = |error: CycleError| error.after(iterations, last);
        let shoot = family(at.parameter).map_err(diverged)?;
        if equations
            .extend_past(shoot.borrow(), &mut at)
            .map_err(diverged)?
        {
            // The Jacobian has another size.
            kept = None;
        }
        let mut here = equations
            .evaluate(shoot.borrow(), &at, std::mem::take(&mut rods))
            .map_err(diverged)?;
        *equilibria += here.equilibria();
        if iterations == 0 && conditions.arclength.is_none() {
            here.check()?;
        }
        let (residual, size) = here.residual();
        // The pseudo-arclength condition must hold if there was no iteration.
        let on_branch = || {
            conditions
                .residuals(0, &at)
                .iter()
                .all(|residual| residual.abs() <= newton.tolerance)
        };
        if size <= newton.tolerance && (iterations > 0 || on_branch()) {
            let effort = Effort {
                iterations,
                equilibria: *equilibria,
                residual: size,
            };
            let symmetry_tangents = here.symmetry_tangents();
            let orbit = here.into_orbit(kept.map(|(bordered, _)| bordered), effort)?;
            return Ok(Corrected {
                orbit,
                unknowns: at,
                symmetry_tangents,
                shoot,
            });
        }
        let failed = || CycleError::not_converged(iterations, size);
        ensure(
            iterations < newton.max_iterations && size.is_finite(),
            failed(),
        )?;
        ensure(
            *equilibria < newton.max_work,
            CycleError::WorkLimit {
                work: *equilibria,
                residual: size,
            },
        )?;
        let bordered = match kept
            .take()
            .filter(|(_, before)| size <= newton.keep * before)
        {
            Some((bordered, _)) => bordered,
            None => {
                let mut parameter = None;
                if let Some(arclength) = &conditions.arclength {
                    let known = here.rods();
                    let mut beside = |parameter: f64| {
                        let shoot = family(parameter)?;
                        let here = equations.evaluate(shoot.borrow(), &at, known.clone())?;
                        *equilibria += here.equilibria();
                        Ok::<_, CycleError>(here.residual().0)
                    };
                    let [before, after] = arclength.beside(at.parameter);
                    let column = (beside(after)? - beside(before)?) / (after - before);
                    let condition = &arclength.condition;
                    parameter = Some(Border {
                        column,
                        row: condition.state.clone(),
                        corner: condition.parameter,
                    });
                }
                let (jacobian, symmetries) = here.linearise()?.ok_or_else(failed)?;
                BorderedSystem::new(jacobian, symmetries, parameter, conditions, &at)
            }
        };
        let values = conditions.residuals(bordered.symmetries, &at);
        let update = bordered
            .update(&at, &residual, &values)?
            .ok_or_else(failed)?;
        at = at.along(
            &update,
            if deflated {
                deflated_share(&at, &update)
            } else {
                1.0
            },
        );
        let strain = at.start.strain.amax();
        let stationary = deflated && strain * shoot.borrow().rod().length() < STATIONARY;
        ensure(!stationary, CycleError::Stationary { strain })?;
        rods = here.rods();
        kept = Some((bordered, size));
        (iterations, last) = (iterations + 1, size);
    }
}

/// Solves the extended system on grids in time that are refined until one resolves the orbit.
pub fn correct_resolved<S: Equations, M: Model, B: Borrow<Shoot<M>>>(
    equations: &mut S,
    family: &mut impl FnMut(f64) -> Result<B, CycleError>,
    mut guess: OrbitUnknowns,
    conditions: &ExtraConditions,
) -> Result<Corrected<S::Orbit, B>, CycleError> {
    let mut equilibria = 0;
    loop {
        let found = correct(equations, family, guess, conditions, &mut equilibria)?;
        let Err(error) = equations.check_resolution(&found.orbit) else {
            return Ok(found);
        };
        [guess] = equations.refine([found.unknowns]).ok_or(error)?;
    }
}

/// Solves for the orbit of one shoot near an initial guess.
pub fn solve<S: Equations>(
    mut equations: S,
    shoot: &Shoot<impl Model>,
    guess: OrbitUnknowns,
    conditions: &ExtraConditions,
) -> Result<S::Orbit, CycleError> {
    Ok(correct_resolved(&mut equations, &mut |_| Ok(shoot), guess, conditions)?.orbit)
}

/// Share of an update that is added with deflation. Newton's method for the residual over the norm
/// of the strain has an update in the same direction, whose length follows from the change of the
/// norm. The strain changes at most by its norm.
fn deflated_share(at: &OrbitUnknowns, update: &OrbitUnknowns) -> f64 {
    let strain = &at.start.strain;
    let (size, change) = (strain.norm(), &update.start.strain);
    if !(size > 0.0) {
        return 1.0;
    }
    let towards_zero = -change.dot(strain) / strain.norm_squared();
    let most =
        (size / change.norm()).min(STRETCH / (update.period_or_rate / at.period_or_rate).abs());
    (1.0 - towards_zero).recip().clamp(-most, most)
}

/// Returns an error for an amplitude (m) of an initial guess that no orbit of the shoot can have.
pub(super) fn check_amplitude(
    shoot: &Shoot<impl Model>,
    amplitude: f64,
) -> Result<(), ParameterError> {
    let ok = amplitude > 0.0 && amplitude < shoot.rod().length();
    let requirement = "positive and smaller than the length of the shoot (m)";
    ParameterError::unless(ok, "amplitude of the initial guess", amplitude, requirement)
}
