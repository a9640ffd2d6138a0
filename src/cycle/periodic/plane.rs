//! The plane of a swing: which disturbances are in it, and which lead out of it.

use nalgebra::{DVector, Vector2};

use crate::cycle::error::CycleError;
use crate::cycle::map::monodromy::Monodromy;
use crate::cycle::map::phase_state::PhaseState;
use crate::cycle::map::return_map::{ReturnMap, Trajectory};
use crate::model::Model;
use crate::tropism::{Declaration, Rotation, Source};

/// Largest bend across the plane of a swing, relative to the bend in it.
const ACROSS: f64 = 1e-6;
/// What a disturbance in the plane makes out of it, and the other way round, is less than this share: responses are differences of
/// equilibria.
const MIXED: f64 = 1e-5;

/// A plane to which a path keeps, with what disturbances in it and out of it do to the variables.
#[derive(Debug, Clone)]
pub(super) struct Plane {
    bend: Vector2<f64>,
    variables: Vec<Variable>,
}

/// What a disturbance does to a variable.
#[derive(Debug, Clone, Copy)]
enum Variable {
    /// The first of a pair: one in the plane changes it in a direction, one that leads out of it across.
    Pair(Vector2<f64>),
    /// One in the plane changes it, one that leads out does not.
    Inside,
    /// The other way round.
    Outside,
    /// The second of a pair, or one of which nothing is known.
    Other,
}

impl Plane {
    /// The plane of a path, if it keeps to one and disturbances in it do not mix with those that lead out of it.
    pub fn of(
        return_map: &ReturnMap<impl Model>,
        path: &Trajectory,
        start: &PhaseState,
        monodromy: &Monodromy,
    ) -> Result<Option<Self>, CycleError> {
        let strains = || path.strains.iter().flat_map(|strain| pairs(strain.as_slice()));
        let bend = direction(strains);
        let largest = |direction| strains().map(|u| u.dot(&direction).abs()).fold(0.0, f64::max);
        if !(largest(across(bend)) < ACROSS * largest(bend)) {
            return Ok(None);
        }
        let mut ends = Vec::with_capacity(2);
        for along in [bend, across(bend)] {
            ends.push(monodromy.apply(&disturbance(start, along))?);
        }
        for (end, own) in ends.iter().zip([bend, across(bend)]) {
            let largest = |along| pairs(end.strain.as_slice()).map(|u| u.dot(&along).abs()).fold(0.0, f64::max);
            if largest(across(own)) > MIXED * largest(own) {
                return Ok(None);
            }
        }
        let (laws, v) = (Declaration::of(return_map.shoot.model.tropism()), return_map.variables);
        let variables = (0..v).map(|k| match laws.rotation(Source::Variable(k)) {
            Rotation::First if k + 1 < v => pair(&ends, v, k),
            Rotation::Invariant => one(&ends, v, k),
            _ => Some(Variable::Other),
        });
        Ok(variables.collect::<Option<_>>().map(|variables| Self { bend, variables }))
    }

    /// Leaves of a disturbance what is in the plane, or what leads out of it.
    pub fn project(&self, start: &mut PhaseState, out: bool) {
        let keep = |pair: &mut [f64], along: Vector2<f64>| {
            let along = if out { across(along) } else { along };
            let size = pair[0] * along.x + pair[1] * along.y;
            (pair[0], pair[1]) = (size * along.x, size * along.y);
        };
        start.strain.as_mut_slice().chunks_exact_mut(2).for_each(|pair| keep(pair, self.bend));
        let all = std::iter::once(&mut start.variables).chain(start.slopes.iter_mut().flatten());
        for own in all.flat_map(|all| all.as_mut_slice().chunks_exact_mut(self.variables.len().max(1))) {
            for (k, variable) in self.variables.iter().enumerate() {
                match variable {
                    Variable::Pair(along) => keep(&mut own[k..k + 2], *along),
                    Variable::Inside if out => own[k] = 0.0,
                    Variable::Outside if !out => own[k] = 0.0,
                    _ => {}
                }
            }
        }
    }
}

/// A state that differs by a bend along a direction alone, of no special shape.
fn disturbance(start: &PhaseState, along: Vector2<f64>) -> PhaseState {
    let mut out = start.with_values(&DVector::zeros(start.flat().len()));
    for (k, strain) in out.strain.as_mut_slice().chunks_exact_mut(2).enumerate() {
        let size = 1.0 + 0.3 * (2.0 * k as f64).sin();
        (strain[0], strain[1]) = (size * along.x, size * along.y);
    }
    out
}

/// The values of a variable, of `v`, at all points now and over the past; of a pair both.
fn values(end: &PhaseState, v: usize, k: usize) -> impl Iterator<Item = Vector2<f64>> {
    let all = std::iter::once(&end.variables).chain(end.slopes.iter().flatten());
    all.flat_map(move |all| all.as_slice().chunks_exact(v).map(move |own| Vector2::new(own[k], own[(k + 1) % v])))
}

/// What disturbances do to a pair; none if what they do is not at right angles.
fn pair(ends: &[PhaseState], v: usize, k: usize) -> Option<Variable> {
    let [inside, outside] = [0, 1].map(|which| direction(|| values(&ends[which], v, k)));
    let largest =
        |which: usize, along: Vector2<f64>| values(&ends[which], v, k).map(|y| y.dot(&along).abs()).fold(0.0, f64::max);
    let [first, second] = [largest(0, inside), largest(1, outside)];
    // The larger response says the direction.
    let along = if first >= second { inside } else { across(outside) };
    let mixed = largest(0, across(along)) > MIXED * first || largest(1, along) > MIXED * second;
    (!mixed).then_some(if first.max(second) > 0.0 { Variable::Pair(along) } else { Variable::Other })
}

/// What disturbances do to a variable that does not turn; none if both change it.
fn one(ends: &[PhaseState], v: usize, k: usize) -> Option<Variable> {
    let [inside, outside] =
        [0, 1].map(|which| values(&ends[which], v, k).map(|y: Vector2<f64>| y.x.abs()).fold(0.0, f64::max));
    match (outside <= MIXED * inside, inside <= MIXED * outside) {
        (true, true) => Some(Variable::Other),
        (true, false) => Some(Variable::Inside),
        (false, true) => Some(Variable::Outside),
        (false, false) => None,
    }
}

fn pairs(all: &[f64]) -> impl Iterator<Item = Vector2<f64>> {
    all.chunks_exact(2).map(|pair| Vector2::new(pair[0], pair[1]))
}

fn across(along: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-along.y, along.x)
}

/// The principal direction of some vectors; that of a director exactly.
fn direction<I: Iterator<Item = Vector2<f64>>>(all: impl Fn() -> I) -> Vector2<f64> {
    let [xx, xy, yy] = all().fold([0.0; 3], |[xx, xy, yy], u| [xx + u.x * u.x, xy + u.x * u.y, yy + u.y * u.y]);
    if xy == 0.0 {
        return if xx >= yy { Vector2::x() } else { Vector2::y() };
    }
    let (sine, cosine) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
    Vector2::new(cosine, sine)
}
