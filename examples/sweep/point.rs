//! What is asked of one shoot: is the upright shape stable, and what becomes of a small kick?

use std::error::Error;

use morphorod::constitutive::LinearElastic;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{IntegrationError, Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::rod::MaterialPoint;
use morphorod::stability::{Linearisation, StabilityError, onset};
use morphorod::tropism::{Gravitropism, Memory, Proprioception, Response, SettledStatoliths};
use morphorod::{Model, ParameterError, Scene, Shoot, Still};
use nalgebra::Vector3;

use super::grid::Grid;

/// The shoots of Agostinelli, DeSimone and Noselli (2021): memory and delay, s; radius, m; tissue; weight.
const MEMORY: Memory = Memory { time: 720.0, delay: 720.0 };
const RADIUS: f64 = 0.5e-3;
const TISSUE: LinearElastic = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
const WEIGHT: Weight = Weight { density: 1000.0 };
/// The kick turns the tip by so many radians: small against the swings of tens of degrees that may become of it.
const KICK: f64 = 0.01;
/// The amplitude is taken over the last time, s: at onset a swing takes 90 minutes at most, and less where the shoot is unstable.
pub const LAST: f64 = 5400.0;
/// An onset is sought up to this part of the length at which the shoot buckles: at it no equilibrium is found.
const BELOW_BUCKLING: f64 = 0.9995;

/// Names and units of the numbers of a point.
pub const COLUMNS: [&str; 6] = ["length_m", "eta", "growth_rate_per_s", "period_s", "unstable_roots", "amplitude_m"];

/// What is known of one shoot, in the order of [`COLUMNS`].
///
/// Growth rate and period are those of the rightmost isolated root, NaN if there is none that the mesh resolves, which happens
/// where the shoot is very stable. If the upright shoot buckles by itself, the number of its unstable roots is NaN, too.
/// The amplitude is the tip's largest distance from the vertical in the last [`LAST`] seconds, NaN where the shoot curls up so
/// much that the elements do not follow.
pub type Numbers = [f64; COLUMNS.len()];

/// The upright shoot.
fn upright(grid: &Grid, length: f64, eta: f64) -> Result<Shoot<impl Model + use<>>, ParameterError> {
    let gravitropism = Gravitropism { sensitivity: grid.beta, perception: SettledStatoliths };
    Shoot::builder(TISSUE)
        .length(length)
        .radius(RADIUS)
        .elements(grid.elements)
        // All of it is growth zone, and stays so; it differentiates, but does not get longer.
        .growth(Ongoing(UniformGrowth { zone_length: 2.0 * length, time: grid.growth_time }))
        .tropism((gravitropism.remembered(MEMORY), Proprioception { sensitivity: eta }.remembered(MEMORY)))
        .load(WEIGHT)
        .build()
}

/// Everything about one point of the grid.
///
/// # Errors
/// Settings that make no sense.
pub fn look_at(grid: &Grid, length: f64, eta: f64) -> Result<Numbers, Box<dyn Error + Send + Sync>> {
    let [growth_rate, period, unstable] = roots(grid, length, eta)?;
    Ok([length, eta, growth_rate, period, unstable, amplitude(grid, length, eta)?])
}

/// Growth rate, 1/s, and period, s, of the rightmost root, and how many are unstable.
fn roots(grid: &Grid, length: f64, eta: f64) -> Result<[f64; 3], StabilityError> {
    let linear = match Linearisation::about(&upright(grid, length, eta)?) {
        Ok(linear) => linear,
        Err(StabilityError::MechanicallyUnstable { .. }) => return Ok([f64::NAN; 3]),
        Err(error) => return Err(error),
    };
    let [growth_rate, period] = match linear.rightmost() {
        Ok(root) => [root.growth_rate(), root.period()],
        Err(error) if is_no_answer(&error) => [f64::NAN; 2],
        Err(error) => return Err(error),
    };
    let unstable = match linear.unstable() {
        Ok(number) => number as f64,
        Err(StabilityError::InfinitelyMany { .. }) => f64::INFINITY,
        Err(error) if is_no_answer(&error) => f64::NAN,
        Err(error) => return Err(error),
    };
    Ok([growth_rate, period, unstable])
}

/// Whether a question about roots was in order, but this mesh has no answer.
fn is_no_answer(error: &StabilityError) -> bool {
    use StabilityError::{NoConvergence, NoIsolatedRoot, UnderResolved};
    matches!(error, NoIsolatedRoot | UnderResolved { .. } | NoConvergence { .. })
}

/// How far the tip swings in the end, m, after a kick in space: with different bends at base and tip, in planes at a right angle,
/// it excites swings in a plane and circles alike.
fn amplitude(grid: &Grid, length: f64, eta: f64) -> Result<f64, IntegrationError> {
    let mut shoot = upright(grid, length, eta)?;
    let bend = KICK / length;
    shoot.set_intrinsic(|p: &MaterialPoint| Vector3::new(bend, bend * (1.0 - p.apex_distance / length), 0.0));
    let mut integrator = MethodOfSteps::new(grid.step);
    let mut follow = || -> Result<f64, IntegrationError> {
        let _ = integrator.advance(&mut shoot, (grid.time - LAST).max(0.0))?;
        let mut farthest = 0.0_f64;
        while shoot.time() < grid.time {
            let _ = integrator.step(&mut shoot, grid.time)?;
            farthest = farthest.max(shoot.tip().xy().norm());
        }
        Ok(farthest)
    };
    match follow() {
        Err(IntegrationError::Equilibrium { .. }) => Ok(f64::NAN),
        other => other,
    }
}

/// The length, m, at which shoots of a sensitivity begin to swing by themselves, if the grid has it.
#[must_use]
pub fn critical_length(grid: &Grid, eta: f64) -> Option<f64> {
    let to = grid.lengths.to.min(BELOW_BUCKLING * buckling_length());
    if !(grid.lengths.from < to) {
        return None;
    }
    let family = |length: f64| Linearisation::about(&upright(grid, length, eta)?);
    // No crossing, or a mesh that does not tell: the curve then has a gap.
    onset(family, grid.lengths.from, to).ok().map(|found| found.parameters[0])
}

/// The length, m, at which an upright shoot buckles under its weight whatever it senses.
#[must_use]
pub fn buckling_length() -> f64 {
    let gravity = Still::upright().environment(0.0).gravity.norm();
    let per_length = WEIGHT.density * gravity * std::f64::consts::PI * RADIUS * RADIUS;
    (Weight::GREENHILL * TISSUE.stiffness(RADIUS).x / per_length).cbrt()
}
