//! Results for one shoot: characteristic roots of the upright shape, and response to a small
//! perturbation.

use std::error::Error;

use morphorod::integrator::{IntegrationError, Integrator, MethodOfSteps};
use morphorod::rod::MaterialPoint;
use morphorod::stability::{Linearisation, StabilityError, onset};
use morphorod::{ParameterError, ReducedModel, Shoot, ShootParameters};
use nalgebra::Vector3;

use super::grid::Grid;

/// Initial bending angle due to the perturbation, rad. It is small compared with oscillations of
/// tens of degrees.
const PERTURBATION: f64 = 0.01;
/// Duration of the final interval in which the amplitude is determined, s. Periods are at most 90
/// min.
pub const LAST: f64 = 5400.0;
/// Largest length in the search for an onset, divided by the self-buckling length, at which the
/// equilibrium is singular.
const BELOW_BUCKLING: f64 = 0.9995;

/// Names and units of the results of a point.
pub const COLUMNS: [&str; 6] = [
    "length_m",
    "eta",
    "growth_rate_per_s",
    "period_s",
    "unstable_roots",
    "amplitude_m",
];

/// Results for one shoot, in the order of [`COLUMNS`].
///
/// Growth rate and period are those of the rightmost isolated root. They are NaN if the mesh
/// resolves no isolated root, which is the case for very stable shoots. If the upright shoot is
/// mechanically unstable, the number of unstable roots is NaN, too. The amplitude is the largest
/// distance of the tip from the vertical in the last [`LAST`] seconds. It is NaN if the curvature
/// becomes so large that no equilibrium is found on this mesh.
pub type Numbers = [f64; COLUMNS.len()];

/// Builds the upright shoot.
fn upright(grid: &Grid, length: f64, eta: f64) -> Result<Shoot<ReducedModel>, ParameterError> {
    let parameters = ShootParameters {
        length,
        growth_time: grid.growth_time,
        gravitropic_sensitivity: grid.beta,
        proprioceptive_sensitivity: eta,
        ..ShootParameters::default()
    };
    parameters.reduced().elements(grid.elements).build()
}

/// Computes the results of one point of the grid.
///
/// # Errors
/// Returns an error if a setting is invalid.
pub fn compute_point(
    grid: &Grid,
    length: f64,
    eta: f64,
) -> Result<Numbers, Box<dyn Error + Send + Sync>> {
    let [growth_rate, period, unstable] = roots(grid, length, eta)?;
    Ok([
        length,
        eta,
        growth_rate,
        period,
        unstable,
        amplitude(grid, length, eta)?,
    ])
}

/// Growth rate, 1/s, and period, s, of the rightmost root, and number of unstable roots.
fn roots(grid: &Grid, length: f64, eta: f64) -> Result<[f64; 3], StabilityError> {
    let linear = match Linearisation::about(&upright(grid, length, eta)?) {
        Ok(linear) => linear,
        Err(StabilityError::MechanicallyUnstable { .. }) => return Ok([f64::NAN; 3]),
        Err(error) => return Err(error),
    };
    let [growth_rate, period] = match linear.rightmost() {
        Ok(root) => [root.growth_rate(), root.period()],
        Err(error) if is_unresolved(&error) => [f64::NAN; 2],
        Err(error) => return Err(error),
    };
    let unstable = match linear.unstable() {
        Ok(number) => number as f64,
        Err(StabilityError::InfinitelyMany { .. }) => f64::INFINITY,
        Err(error) if is_unresolved(&error) => f64::NAN,
        Err(error) => return Err(error),
    };
    Ok([growth_rate, period, unstable])
}

/// Whether the settings are valid, but the roots cannot be computed on this mesh.
fn is_unresolved(error: &StabilityError) -> bool {
    use StabilityError::{NoConvergence, NoIsolatedRoot, UnderResolved};
    matches!(
        error,
        NoIsolatedRoot | UnderResolved { .. } | NoConvergence { .. }
    )
}

/// Largest distance of the tip from the vertical in the final interval, m. The perturbation is
/// three-dimensional, with different planes of bending at base and tip, so that it excites both
/// planar and circular oscillations.
fn amplitude(grid: &Grid, length: f64, eta: f64) -> Result<f64, IntegrationError> {
    let mut shoot = upright(grid, length, eta)?;
    let bend = PERTURBATION / length;
    shoot.set_intrinsic(|p: &MaterialPoint| {
        Vector3::new(bend, bend * (1.0 - p.apex_distance / length), 0.0)
    });
    let mut integrator = MethodOfSteps::new(grid.step);
    let mut simulate = || -> Result<f64, IntegrationError> {
        let _ = integrator.advance(&mut shoot, (grid.time - LAST).max(0.0))?;
        let mut farthest = 0.0_f64;
        while shoot.time() < grid.time {
            let _ = integrator.step(&mut shoot, grid.time)?;
            farthest = farthest.max(shoot.tip().xy().norm());
        }
        Ok(farthest)
    };
    match simulate() {
        Err(IntegrationError::Equilibrium { .. }) => Ok(f64::NAN),
        other => other,
    }
}

/// Critical length for a proprioceptive sensitivity, m, if it lies inside the grid.
#[must_use]
pub fn critical_length(grid: &Grid, eta: f64) -> Option<f64> {
    let to = grid.lengths.to.min(BELOW_BUCKLING * buckling_length());
    if !(grid.lengths.from < to) {
        return None;
    }
    let family = |length: f64| Linearisation::about(&upright(grid, length, eta)?);
    // The curve has a gap if there is no crossing or if the mesh does not resolve it.
    onset(family, grid.lengths.from, to)
        .ok()
        .map(|found| found.parameters[0])
}

/// Self-buckling length of Greenhill (1881), m.
#[must_use]
pub fn buckling_length() -> f64 {
    ShootParameters::default().self_buckling_length(9.81)
}
