//! Solution of the problem by shooting, with the crate `differential-equations`.
//!
//! The initial value problem integrates position, frame (a quaternion) and couple along the rod.
//! The unknown couple at the base is determined such that the couple at the tip is zero. There are
//! two variants:
//!
//! - [`general`] uses the crate's solver for boundary value problems. It determines all ten
//!   variables at the base by Newton's method with finite differences.
//! - [`tailored`] uses the integrators of the crate with a search for this problem. It has three
//!   unknowns, stores no trajectory and constructs the integrator once.
//!
//! Both variants exploit three properties of the problem: the force is known in advance, the
//! bending stiffnesses are equal, and the variables are dimensionless. `morphorod` exploits none of
//! these properties.

use differential_equations::control::ControlFlag;
use differential_equations::interpolate::Interpolation;
use differential_equations::ode::{ODE, OrdinaryNumericalMethod, solve_ode};
use differential_equations::prelude::*;
use nalgebra::{Matrix3, Vector3};

use crate::problem::{Candidate, POISSON};

/// Name of the first variant in tables.
const GENERAL: &str = "differential-equations BVP";
/// Name of the second variant in tables.
const TAILORED: &str = "differential-equations IVP";
/// Relative and absolute tolerances.
const TOLERANCES: [f64; 8] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-12];
/// Initial guesses of the couple at the base, divided by the couple of a straight rod. The second
/// is closer to the couple of a bent rod.
const GUESSES: [f64; 2] = [1.0, 0.5];
/// Number of segments in multiple shooting.
const SEGMENTS: usize = 4;
/// Largest number of integrations in a search. Successful searches need about twelve.
const MAX_INTEGRATIONS: usize = 100;
/// Largest number of Newton iterations of the crate's solver. Successful runs need about six.
const MAX_ITERATIONS: usize = 25;
/// Relative step of finite differences with respect to the base couple, the square root of the
/// rounding error.
const DIFFERENCE: f64 = 1.5e-8;

/// Position, quaternion of the frame (scalar first) and couple in the fixed frame, in units of the
/// length and of E I.
type State = [f64; 10];

/// Right-hand side, with the arc length as independent variable.
struct Rod {
    load: f64,
}

impl ODE<f64, State> for Rod {
    fn diff(&self, s: f64, y: &State, rate: &mut State) {
        let [_, _, _, w, x, yy, z, mx, my, mz] = *y;
        let tangent = [
            2.0 * (x * z + w * yy),
            2.0 * (yy * z - w * x),
            1.0 - 2.0 * (x * x + yy * yy),
        ];
        // K⁻¹ m for equal bending stiffnesses: the factor is 1 normal to the tangent, and
        // E I/(G J) = 1 + ν along it.
        let along = POISSON * (mx * tangent[0] + my * tangent[1] + mz * tangent[2]);
        let [a, b, c] = [
            mx + along * tangent[0],
            my + along * tangent[1],
            mz + along * tangent[2],
        ];
        // Vertical component n of the force, due to the weight beyond s. The balance of moments is
        // m' = −d3 × n e3.
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
    fn boundary(&self, base: &State, tip: &State, residual: &mut State) {
        let clamp = start(Vector3::zeros());
        for k in 0..7 {
            residual[k] = base[k] - clamp[k];
        }
        residual[7..].copy_from_slice(&tip[7..]);
    }
}

/// State at the base. The frame is rotated such that d3 is horizontal.
fn start(couple: Vector3<f64>) -> State {
    let half = 0.5_f64.sqrt();
    [
        0.0, 0.0, 0.0, half, 0.0, half, 0.0, couple.x, couple.y, couple.z,
    ]
}

/// Output handler that stores nothing.
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

/// Iteration for the base couple.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Search {
    /// Newton's method with finite differences, three more integrations in each iteration.
    Newton,
    /// Broyden's method, with finite differences in the first iteration only.
    Broyden,
}

/// Candidates with all integrators, tolerances, searches and initial guesses for a load q̂.
pub fn candidates(load: f64) -> Vec<Candidate> {
    let mut out = Vec::new();
    for (tolerance, guess) in TOLERANCES
        .into_iter()
        .flat_map(|tolerance| GUESSES.map(|guess| (tolerance, guess)))
    {
        // The weight of a straight rod acts at half the length.
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
                // The tolerance of the search is that of the integration, as in the other variant.
                let close = tolerance * load;
                let single = Shooting::single(method.clone()).max_iterations(MAX_ITERATIONS).tolerance(close);
                let solve = Box::new(move || general(single.clone(), load, couple));
                out.push(Candidate { peer: GENERAL.into(), setting: format!("{name}; single"), solve });
                let multiple = Shooting::multiple(method).max_iterations(MAX_ITERATIONS);
                let multiple = multiple.segments(SEGMENTS).tolerance(close);
                let solve = Box::new(move || general(multiple.clone(), load, couple));
                out.push(Candidate { peer: GENERAL.into(), setting: format!("{name}; multiple"), solve });
            })*};
        }
        push!(dopri5, dop853, rkv655e, rkv766e, rkv877e, rkv988e);
    }
    out
}

/// Tip by the crate's solver for boundary value problems, from an initial guess of the couple at
/// the base.
fn general(
    method: impl BVPMethod<f64, State>,
    load: f64,
    couple: Vector3<f64>,
) -> Option<Vector3<f64>> {
    let rod = Rod { load };
    let found = BVP::ode(&rod, 0.0, 1.0, start(couple))
        .method(method)
        .solve()
        .ok()?;
    let (_, tip) = found.last().ok()?;
    Some(Vector3::new(tip[0], tip[1], tip[2]))
}

/// Tip by a search for the base couple.
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
    let mut integrate = |couple: Vector3<f64>| -> Option<(Vector3<f64>, Vector3<f64>)> {
        solve_ode(&mut method, &rod, 0.0, 1.0, &start(couple), &mut Quiet).ok()?;
        let end = method.y();
        let residual = Vector3::new(end[7], end[8], end[9]);
        residual
            .iter()
            .all(|part| part.is_finite())
            .then(|| (residual, Vector3::new(end[0], end[1], end[2])))
    };
    let (mut residual, mut tip) = integrate(couple)?;
    let mut integrations = 1;
    let mut derivative = None;
    while integrations < MAX_INTEGRATIONS {
        // The tolerance of the search is that of the integration.
        if residual.norm() <= tolerance * couple.norm() {
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
                    slope.set_column(k, &((integrate(beside)?.0 - residual) / step));
                }
                integrations += 3;
                slope
            }
        };
        let change = -slope.lu().solve(&residual)?;
        couple += change;
        let before = residual;
        (residual, tip) = integrate(couple)?;
        integrations += 1;
        derivative = Some(
            slope
                + (residual - before - slope * change) * change.transpose() / change.norm_squared(),
        );
    }
    None
}
