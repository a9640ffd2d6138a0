//! The plane of a planar orbit: the splitting of disturbances into those in the plane and those out
//! of it.
//!
//! If the laws commute with the reflection in the plane, the monodromy operator maps both subspaces
//! into themselves, and each has its own spectrum. How a variable is reflected is not declared. It
//! is determined by trial, from the images of one disturbance in the plane and of one out of it.

use nalgebra::{DVector, Vector2};

use super::linear::Traced;
use crate::cycle::error::CycleError;
use crate::cycle::map::{Monodromy, PhaseState};
use crate::cycle::sensitivity::ASYMMETRY;
use crate::model::Model;
use crate::tropism::{Rotation, Source};

/// Largest relative component of an image in the other subspace: ten times the error of differences
/// of equilibria.
const MIXED: f64 = 1e-5;

/// The plane of an orbit, with the subspaces of strain and variables in it and out of it.
pub(super) struct OrbitPlane {
    /// Direction of the strain of the orbit.
    bend: Vector2<f64>,
    variables: Vec<Subspace>,
}

/// The subspace to which a variable belongs.
enum Subspace {
    /// First of a pair, with the direction of its component in the plane.
    Pair(Vector2<f64>),
    /// Variable that changes with disturbances in the plane only.
    Inside,
    /// Variable that changes with disturbances out of the plane only.
    Outside,
    /// Second of a pair, or a variable that neither disturbance changes.
    Other,
}

impl OrbitPlane {
    /// The plane of a trajectory; none if it is not planar, or if the two kinds of disturbances are
    /// coupled.
    pub fn of(
        traced: &Traced<impl Model>,
        monodromy: &Monodromy,
    ) -> Result<Option<Self>, CycleError> {
        let Traced {
            return_map, path, ..
        } = traced;
        let strains = || {
            path.strains
                .iter()
                .flat_map(|strain| pairs(strain.as_slice()))
        };
        let bend = direction(strains);
        if !(largest(strains(), across(bend)) < ASYMMETRY * largest(strains(), bend)) {
            return Ok(None);
        }
        let ends =
            [bend, across(bend)].map(|along| monodromy.apply(&disturbance(&path.start, along)));
        let ends: Vec<PhaseState> = ends.into_iter().collect::<Result<_, _>>()?;
        for (end, own) in ends.iter().zip([bend, across(bend)]) {
            let strains = || pairs(end.strain.as_slice());
            if largest(strains(), across(own)) > MIXED * largest(strains(), own) {
                return Ok(None);
            }
        }
        let (laws, v) = (&return_map.laws, return_map.laws.size().variables);
        let variables = (0..v).map(|k| match laws.rotation(Source::Variable(k)) {
            Rotation::First if k + 1 < v => pair(&ends, v, k),
            Rotation::Invariant => one(&ends, v, k),
            _ => Some(Subspace::Other),
        });
        Ok(variables
            .collect::<Option<_>>()
            .map(|variables| Self { bend, variables }))
    }

    /// Projects a disturbance on the subspace in the plane, or on that out of it.
    pub fn project(&self, start: &mut PhaseState, out: bool) {
        let keep = |pair: &mut [f64], along: Vector2<f64>| {
            let along = if out { across(along) } else { along };
            let size = pair[0] * along.x + pair[1] * along.y;
            (pair[0], pair[1]) = (size * along.x, size * along.y);
        };
        start
            .strain
            .as_mut_slice()
            .chunks_exact_mut(2)
            .for_each(|pair| keep(pair, self.bend));
        for own in start.variables_of_points(self.variables.len()) {
            for (k, variable) in self.variables.iter().enumerate() {
                match variable {
                    Subspace::Pair(along) => keep(&mut own[k..k + 2], *along),
                    Subspace::Inside if out => own[k] = 0.0,
                    Subspace::Outside if !out => own[k] = 0.0,
                    _ => {}
                }
            }
        }
    }
}

/// A disturbance of the strain along a direction, without symmetry along the shoot.
fn disturbance(start: &PhaseState, along: Vector2<f64>) -> PhaseState {
    let mut out = start.with_values(&DVector::zeros(start.flat().len()));
    for (k, strain) in out.strain.as_mut_slice().chunks_exact_mut(2).enumerate() {
        let size = 1.0 + 0.3 * (2.0 * k as f64).sin();
        (strain[0], strain[1]) = (size * along.x, size * along.y);
    }
    out
}

/// The values of variable `k` of `v` and of the next one, at all points and times.
fn values(end: &PhaseState, v: usize, k: usize) -> impl Iterator<Item = Vector2<f64>> {
    let all = std::iter::once(&end.variables).chain(end.slopes.iter().flatten());
    all.flat_map(move |all| {
        all.as_slice()
            .chunks_exact(v)
            .map(move |own| Vector2::new(own[k], own[(k + 1) % v]))
    })
}

/// The direction of a pair in the plane; none if its changes by the two disturbances are not
/// orthogonal.
fn pair(ends: &[PhaseState], v: usize, k: usize) -> Option<Subspace> {
    let [inside, outside] = [0, 1].map(|which| direction(|| values(&ends[which], v, k)));
    let largest = |which: usize, along: Vector2<f64>| largest(values(&ends[which], v, k), along);
    let [first, second] = [largest(0, inside), largest(1, outside)];
    // The direction of the larger change is the more accurate one.
    let along = if first >= second {
        inside
    } else {
        across(outside)
    };
    let mixed = largest(0, across(along)) > MIXED * first || largest(1, along) > MIXED * second;
    (!mixed).then_some(if first.max(second) > 0.0 {
        Subspace::Pair(along)
    } else {
        Subspace::Other
    })
}

/// The subspace of an invariant variable; none if both disturbances change it.
fn one(ends: &[PhaseState], v: usize, k: usize) -> Option<Subspace> {
    let [inside, outside] = [0, 1].map(|which| largest(values(&ends[which], v, k), Vector2::x()));
    match (outside <= MIXED * inside, inside <= MIXED * outside) {
        (true, true) => Some(Subspace::Other),
        (true, false) => Some(Subspace::Inside),
        (false, true) => Some(Subspace::Outside),
        (false, false) => None,
    }
}

/// The components of a vector as pairs.
fn pairs(all: &[f64]) -> impl Iterator<Item = Vector2<f64>> {
    all.chunks_exact(2)
        .map(|pair| Vector2::new(pair[0], pair[1]))
}

/// The largest modulus of the components of some vectors along a direction.
fn largest(all: impl Iterator<Item = Vector2<f64>>, along: Vector2<f64>) -> f64 {
    all.map(|u| u.dot(&along).abs()).fold(0.0, f64::max)
}

/// The direction rotated by a right angle.
fn across(along: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-along.y, along.x)
}

/// The principal direction of some vectors. It is exact if it is that of a director.
fn direction<I: Iterator<Item = Vector2<f64>>>(all: impl Fn() -> I) -> Vector2<f64> {
    let [xx, xy, yy] = all().fold([0.0; 3], |[xx, xy, yy], u| {
        [xx + u.x * u.x, xy + u.x * u.y, yy + u.y * u.y]
    });
    if xy == 0.0 {
        return if xx >= yy { Vector2::x() } else { Vector2::y() };
    }
    let (sine, cosine) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
    Vector2::new(cosine, sine)
}
