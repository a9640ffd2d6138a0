//! Newton's method for orbits of all kinds.
//!
//! One iteration serves periodic orbits, relative periodic orbits and rotating waves, of a single shoot or on a branch. The kinds differ
//! in their [`Equations`], single orbits and points of a branch in their [`Conditions`].

use std::borrow::Borrow;

use nalgebra::DVector;

use super::equations::{Effort, Equations};
use super::error::CycleError;
use super::extended::{Border, Bordered, Conditions, Unknowns, Update};
use super::map::phase_state::PhaseState;
use crate::model::Model;
use crate::shoot::Shoot;

/// Strain times length (rad) below which a state counts as the stationary one: such orbits are not visible.
pub const STATIONARY: f64 = 1e-6;
/// Largest relative change of the period or the rate by an update while the stationary state is deflated.
const STRETCH: f64 = 0.2;

/// A solution of the extended system.
pub struct Corrected<O, B> {
    pub orbit: O,
    pub unknowns: Unknowns,
    /// Tangents of the symmetries at the state: the directions of a shift in time and of a rotation.
    pub tangents: Vec<DVector<f64>>,
    pub shoot: B,
}

/// Solves the extended system by Newton's method on one grid in time. The Jacobian is kept while the residual decreases fast.
///
/// # Errors
/// Errors of evaluation: at the initial guess as they are, later as `NotConverged`.
pub fn correct<S: Equations, M: Model, B: Borrow<Shoot<M>>>(
    equations: &S,
    family: &mut impl FnMut(f64) -> Result<B, CycleError>,
    mut at: Unknowns,
    conditions: &Conditions,
) -> Result<Corrected<S::Orbit, B>, CycleError> {
    let tolerance = equations.tolerance();
    let deflated = conditions.arclength.is_none() && !at.forced;
    let (mut iterations, mut equilibria, mut last) = (0, 0, f64::INFINITY);
    let mut kept: Option<(Bordered<S::Jacobian>, f64)> = None;
    let mut rods = Vec::new();
    loop {
        let diverged = |error: CycleError| error.after(iterations, last);
        let shoot = family(at.parameter).map_err(diverged)?;
        if equations.extend_past(shoot.borrow(), &mut at).map_err(diverged)? {
            // The Jacobian has another size.
            kept = None;
        }
        let mut here = equations.evaluate(shoot.borrow(), &at, std::mem::take(&mut rods)).map_err(diverged)?;
        if iterations == 0 && conditions.arclength.is_none() {
            equations.check(&here, &at)?;
        }
        let (residual, size) = equations.residual(&here, &at);
        if size <= tolerance && (iterations > 0 || conditions.hold(&at, tolerance)) {
            let effort = Effort { iterations, equilibria: equilibria + S::equilibria(&here), residual: size };
            let known = kept.map(|(bordered, _)| bordered);
            let (orbit, tangents) = equations.orbit(here, &at, known, effort)?;
            return Ok(Corrected { orbit, unknowns: at, tangents, shoot });
        }
        let failed = || CycleError::NotConverged { iterations, residual: size };
        if iterations == equations.max_iterations() || !size.is_finite() {
            return Err(failed());
        }
        let bordered = match kept.take().filter(|(_, before)| size <= S::KEEP * before) {
            Some((bordered, _)) => bordered,
            None => {
                let parameter = match &conditions.arclength {
                    None => None,
                    Some(arclength) => {
                        let known = S::rods(&here);
                        let mut beside = |parameter: f64| {
                            let shoot = family(parameter)?;
                            let here = equations.evaluate(shoot.borrow(), &at, known.clone())?;
                            equilibria += S::equilibria(&here);
                            Ok::<_, CycleError>(equations.residual(&here, &at).0)
                        };
                        let [before, after] = arclength.beside(at.parameter);
                        let column = (beside(after)? - beside(before)?) / (after - before);
                        let condition = &arclength.condition;
                        Some(Border { column, row: condition.state.clone(), corner: condition.parameter })
                    }
                };
                let (jacobian, symmetries) = equations.linearise(&mut here, &at)?.ok_or_else(failed)?;
                let bordered = Bordered::new(jacobian, symmetries, conditions, &at);
                match parameter {
                    Some(parameter) => bordered.with(parameter),
                    None => bordered,
                }
            }
        };
        let update = bordered.update(&residual, &conditions.residuals(bordered.symmetries, &at))?.ok_or_else(failed)?;
        at.add(&update, if deflated { deflated_share(&at.start, &update) } else { 1.0 });
        if deflated && at.start.strain.amax() * shoot.borrow().rod().length() < STATIONARY {
            return Err(CycleError::Stationary { strain: at.start.strain.amax() });
        }
        rods = S::rods(&here);
        equilibria += S::equilibria(&here);
        kept = Some((bordered, size));
        (iterations, last) = (iterations + 1, size);
    }
}

/// Solves the extended system, on a grid in time that is refined until it resolves the orbit.
pub fn correct_resolved<S: Equations, M: Model, B: Borrow<Shoot<M>>>(
    equations: &mut S,
    family: &mut impl FnMut(f64) -> Result<B, CycleError>,
    mut guess: Unknowns,
    conditions: &Conditions,
) -> Result<Corrected<S::Orbit, B>, CycleError> {
    loop {
        let found = correct(equations, family, guess, conditions)?;
        let Err(error) = equations.check_resolution(&found.orbit) else { return Ok(found) };
        let refined = equations.refined().ok_or(error)?;
        guess = equations.on_finer_grid(found.unknowns);
        *equations = refined;
    }
}

/// The orbit of one shoot near an initial guess.
pub fn solve<S: Equations>(
    mut equations: S,
    shoot: &Shoot<impl Model>,
    guess: Unknowns,
    conditions: &Conditions,
) -> Result<S::Orbit, CycleError> {
    Ok(correct_resolved(&mut equations, &mut |_| Ok(shoot), guess, conditions)?.orbit)
}

/// Share of an update that is added. It is the share of Newton's method for the residual over the norm of the strain, which deflates the
/// stationary state: both updates have the same direction. Strain and period change by a bounded factor.
fn deflated_share(start: &PhaseState, update: &Update) -> f64 {
    let (size, change) = (start.strain.norm(), update.state.rows(0, start.strain.len()));
    if !(size > 0.0) {
        return 1.0;
    }
    let towards_zero = -change.dot(&start.strain) / start.strain.norm_squared();
    let most = (size / change.norm()).min(STRETCH / update.stretch.abs());
    (1.0 - towards_zero).recip().clamp(-most, most)
}
