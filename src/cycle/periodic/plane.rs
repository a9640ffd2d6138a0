//! The plane of a swing: which disturbances are in it, and which lead out of it.

use nalgebra::Vector2;

use crate::cycle::map::march::{March, Path};
use crate::cycle::map::state::Start;
use crate::model::Model;
use crate::tropism::{Declaration, Rotation, Source};

/// Of a swing in a plane what is across is less than this share.
const ACROSS: f64 = 1e-6;

/// A plane to which a path keeps: the directions, along d1 and d2, in which strain and pairs of variables lie all along.
#[derive(Debug, Clone)]
pub(crate) struct Plane {
    bend: Vector2<f64>,
    variables: Vec<Variable>,
}

/// What a variable does in the plane.
#[derive(Debug, Clone, Copy)]
enum Variable {
    /// The first of a pair, which lies in a direction.
    Pair(Vector2<f64>),
    /// One that does not turn: what leads out of the plane leaves it as it is.
    Invariant,
    /// The second of a pair, or one of which nothing is known.
    Other,
}

impl Plane {
    /// The plane of a path, if it keeps to one.
    pub fn of(march: &March<impl Model>, path: &Path) -> Option<Self> {
        let bend = direction(|| path.strains.iter().flat_map(|strain| pairs(strain.as_slice())))?;
        let (laws, v) = (Declaration::of(march.shoot.model.tropism()), march.variables);
        let variable = |k: usize| match laws.rotation(Source::Variable(k)) {
            Rotation::Invariant => Some(Variable::Invariant),
            Rotation::First if k + 1 < v => {
                let values = || {
                    let points = path.stages.iter().flatten().flat_map(|stage| stage.variables.as_slice().chunks(v));
                    points.map(|own| Vector2::new(own[k], own[k + 1]))
                };
                // A pair that does not show on the way says nothing of its direction.
                let shows = values().any(|pair| pair != Vector2::zeros());
                if shows { direction(values).map(Variable::Pair) } else { Some(Variable::Other) }
            }
            _ => Some(Variable::Other),
        };
        Some(Self { bend, variables: (0..v).map(variable).collect::<Option<_>>()? })
    }

    /// The bend in the plane, or that out of it.
    pub fn bend(&self, out: bool) -> Vector2<f64> {
        if out { across(self.bend) } else { self.bend }
    }

    /// Leaves of a disturbance what is in the plane, or what leads out of it.
    pub fn project(&self, start: &mut Start, out: bool) {
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
                    Variable::Invariant if out => own[k] = 0.0,
                    Variable::Invariant | Variable::Other => {}
                }
            }
        }
    }
}

fn pairs(all: &[f64]) -> impl Iterator<Item = Vector2<f64>> {
    all.chunks_exact(2).map(|pair| Vector2::new(pair[0], pair[1]))
}

fn across(along: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-along.y, along.x)
}

/// The direction in which all vectors lie, if there is one: their principal direction, that of a director exactly.
fn direction<I: Iterator<Item = Vector2<f64>>>(all: impl Fn() -> I) -> Option<Vector2<f64>> {
    let [xx, xy, yy] = all().fold([0.0; 3], |[xx, xy, yy], u| [xx + u.x * u.x, xy + u.x * u.y, yy + u.y * u.y]);
    let along = if xy == 0.0 {
        if xx >= yy { Vector2::x() } else { Vector2::y() }
    } else {
        let (sine, cosine) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
        Vector2::new(cosine, sine)
    };
    let largest = |direction: Vector2<f64>| all().map(|u| u.dot(&direction).abs()).fold(0.0, f64::max);
    (largest(across(along)) < ACROSS * largest(along)).then_some(along)
}
