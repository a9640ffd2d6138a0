//! The rod by shooting with the crate `differential-equations`, in three dimensions: position, frame (a quaternion) and couple along
//! the rod as an initial value problem, and the couple at the base such that none is left at the tip.
//!
//! Twice. First by the crate's solver of boundary value problems, as a user would ([`offered`]): it seeks all ten numbers at the base by
//! Newton's method with differences. Then by its integrators alone, under a search made for this problem ([`tailored`]):
//! three unknowns, no trajectory stored, the method prepared once. Both know the force beforehand, have units in which no factor is
//! left, and a right-hand side for equal bending stiffnesses, all of which `morphorod` does not presume.

use differential_equations::control::ControlFlag;
use differential_equations::interpolate::Interpolation;
use differential_equations::ode::{ODE, OrdinaryNumericalMethod, solve_ode};
use differential_equations::prelude::*;
use nalgebra::{Matrix3, Vector3};

use crate::problem::{Candidate, POISSON};

/// What the two are called in tables.
const OFFERED: &str = "differential-equations BVP";
const TAILORED: &str = "differential-equations IVP";
/// Tolerances, relative and absolute, that are tried.
const TOLERANCES: [f64; 8] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-12];
/// First guesses of the couple at the base, over that of a straight rod: it, and half of it, which is closer to a bent rod's.
const GUESSES: [f64; 2] = [1.0, 0.5];
/// Pieces of the rod in multiple shooting.
const SEGMENTS: usize = 4;
/// Shots in a search at most; good ones take a dozen.
const MOST_SHOTS: usize = 100;
/// Newton iterations of the crate's solver at most; good ones take half a dozen.
const MOST_ITERATIONS: usize = 25;
/// Differences for the derivative by the base couple: the root of the rounding error.
const DIFFERENCE: f64 = 1.5e-8;

/// Position, quaternion (scalar first) of the frame, couple, in the fixed frame; over the length and E I.
type State = [f64; 10];

/// The right-hand side, with arc length for time.
struct Rod {
    load: f64,
}

impl ODE<f64, State> for Rod {
    fn diff(&self, s: f64, y: &State, rate: &mut State) {
        let [_, _, _, w, x, yy, z, mx, my, mz] = *y;
        let tangent = [2.0 * (x * z + w * yy), 2.0 * (yy * z - w * x), 1.0 - 2.0 * (x * x + yy * yy)];
        // K⁻¹ m for equal bending stiffnesses: 1 across the tangent, E I/(G J) = 1 + ν along it.
        let along = POISSON * (mx * tangent[0] + my * tangent[1] + mz * tangent[2]);
        let [a, b, c] = [mx + along * tangent[0], my + along * tangent[1], mz + along * tangent[2]];
        // The weight beyond, downwards; m' = −d3 × n.
        let n = -self.load * (1.0 - s);
        *rate = [
            tangent[0],
            tangent[1],
            tangent[2],
            0.5 * (-a * x - b * yy - c * z),
            0.5 * (a * w + b * z - c * yy),
            0.5 * (b * w + c * x - a * z),
            0.5 * (c * w + a * yy - b * x),
            -tangent[1] * n,
            tangent[0] * n,
            0.0,
        ];
    }
}

impl Boundary<f64, State> for Rod {
    fn boundary(&self, base: &State, tip: &State, left: &mut State) {
        let clamp = start(Vector3::zeros());
        for k in 0..7 {
            left[k] = base[k] - clamp[k];
        }
        left[7..].copy_from_slice(&tip[7..]);
    }
}

/// The state at the base, with the frame that turns the vertical d3 outwards.
fn start(couple: Vector3<f64>) -> State {
    let half = 0.5_f64.sqrt();
    [0.0, 0.0, 0.0, half, 0.0, half, 0.0, couple.x, couple.y, couple.z]
}

/// Stores nothing.
struct Quiet;

impl Solout<f64, State> for Quiet {
    fn solout<I: Interpolation<f64, State> + ?Sized>(
        &mut self,
        _: f64,
        _: f64,
        _: &State,
        _: &State,
        _: &mut I,
        _: &mut Solution<f64, State>,
    ) -> ControlFlag<f64, State> {
        ControlFlag::Continue
    }
}

/// How the base couple is improved from shot to shot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Search {
    /// Newton's method: the derivative by differences, three shots more each time.
    Newton,
    /// Broyden's method: the derivative by differences once, then from what the shots show.
    Broyden,
}

/// All methods, tolerances, searches and guesses under a load q̂.
pub fn candidates(load: f64) -> Vec<Candidate> {
    let mut out = Vec::new();
    for (tolerance, guess) in TOLERANCES.into_iter().flat_map(|tolerance| GUESSES.map(|guess| (tolerance, guess))) {
        // A straight rod's weight has an arm of half the length.
        let couple = Vector3::new(0.0, 0.5 * guess * load, 0.0);
        macro_rules! push {
            ($($method:ident),*) => {$({
                let method = ExplicitRungeKutta::$method().rtol(tolerance).atol(tolerance);
                let name = format!("{} {tolerance:e} from {guess} times the straight couple", stringify!($method));
                for search in [Search::Newton, Search::Broyden] {
                    let method = method.clone();
                    let solve = Box::new(move || tailored(method.clone(), load, couple, tolerance, search));
                    out.push(Candidate { peer: TAILORED.into(), setting: format!("{name}; {search:?}"), solve });
                }
                // No closer than the integration itself, as in the other search.
                let close = tolerance * load;
                let single = Shooting::single(method.clone()).max_iterations(MOST_ITERATIONS).tolerance(close);
                let solve = Box::new(move || offered(single.clone(), load, couple));
                out.push(Candidate { peer: OFFERED.into(), setting: format!("{name}; single"), solve });
                let multiple = Shooting::multiple(method).max_iterations(MOST_ITERATIONS);
                let multiple = multiple.segments(SEGMENTS).tolerance(close);
                let solve = Box::new(move || offered(multiple.clone(), load, couple));
                out.push(Candidate { peer: OFFERED.into(), setting: format!("{name}; multiple"), solve });
            })*};
        }
        push!(dopri5, dop853, rkv655e, rkv766e, rkv877e, rkv988e);
    }
    out
}

/// The tip by the crate's own solver of boundary value problems, from a guess of the couple at the base.
fn offered(method: impl BVPMethod<f64, State>, load: f64, couple: Vector3<f64>) -> Option<Vector3<f64>> {
    let rod = Rod { load };
    let found = BVP::ode(&rod, 0.0, 1.0, start(couple)).method(method).solve().ok()?;
    let (_, tip) = found.last().ok()?;
    Some(Vector3::new(tip[0], tip[1], tip[2]))
}

/// The tip by a search for the base couple alone.
fn tailored<M>(
    mut method: M,
    load: f64,
    mut couple: Vector3<f64>,
    tolerance: f64,
    search: Search,
) -> Option<Vector3<f64>>
where
    M: OrdinaryNumericalMethod<f64, State> + Interpolation<f64, State>,
{
    let rod = Rod { load };
    let mut shot = |couple: Vector3<f64>| -> Option<(Vector3<f64>, Vector3<f64>)> {
        solve_ode(&mut method, &rod, 0.0, 1.0, &start(couple), &mut Quiet).ok()?;
        let end = method.y();
        let left = Vector3::new(end[7], end[8], end[9]);
        left.iter().all(|part| part.is_finite()).then(|| (left, Vector3::new(end[0], end[1], end[2])))
    };
    let (mut left, mut tip) = shot(couple)?;
    let mut shots = 1;
    let mut derivative = None;
    while shots < MOST_SHOTS {
        // No closer than the integration itself.
        if left.norm() <= tolerance * couple.norm() {
            return Some(tip);
        }
        let slope = match derivative.filter(|_| search == Search::Broyden) {
            Some(slope) => slope,
            None => {
                let step = DIFFERENCE.max(tolerance.sqrt()) * couple.norm();
                let mut slope = Matrix3::zeros();
                for k in 0..3 {
                    let mut beside = couple;
                    beside[k] += step;
                    slope.set_column(k, &((shot(beside)?.0 - left) / step));
                }
                shots += 3;
                slope
            }
        };
        let change = -slope.lu().solve(&left)?;
        couple += change;
        let before = left;
        (left, tip) = shot(couple)?;
        shots += 1;
        derivative = Some(slope + (left - before - slope * change) * change.transpose() / change.norm_squared());
    }
    None
}
