//! Convex polyhedra as obstacles.

use nalgebra::{Matrix3, Vector3};

use super::obstacle::round;
use super::{Distance, HalfSpace, Obstacle};
use crate::error::ParameterError;

/// Least thickness of a polyhedron, relative to the largest distance of its planes' points from the
/// origin.
const THINNEST: f64 = 1e-9;
/// Distance relative to the same length below which places coincide.
const SAME: f64 = 1e-12;
/// Sine of the angle between planes that count as parallel.
const PARALLEL: f64 = 1e-9;

/// A convex polyhedron: the intersection of half spaces, bounded or not, such as a wedge, a prism
/// or a pyramid.
///
/// The distance outside is that from the nearest point of a face, an edge or a corner. Inside it is
/// that from the plane of the nearest face. As for a [`Cuboid`](super::Cuboid), a shoot bends over
/// an edge as over a cylinder of the radius of the contact, and a contact of radius zero is an
/// error if there are edges.
///
/// ```
/// use morphorod::nalgebra::Vector3;
/// use morphorod::support::{ConvexPolyhedron, HalfSpace};
///
/// // A ridge along e2, 2 cm below the base.
/// let side = |x: f64| HalfSpace { through: Vector3::z() * -0.02, normal: Vector3::new(x, 0.0, 1.0) };
/// let ridge = ConvexPolyhedron::new(vec![side(-1.0), side(1.0)])?;
/// # let _ = ridge;
/// # Ok::<(), morphorod::ParameterError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(try_from = "Vec<HalfSpace>", into = "Vec<HalfSpace>")
)]
pub struct ConvexPolyhedron {
    half_spaces: Vec<HalfSpace>,
    planes: Vec<Face>,
    edges: Vec<Edge>,
    /// Distance below which places coincide, m.
    same: f64,
}

/// The half space n · x ≤ d.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Face {
    /// Unit normal n, which points out of the half space.
    normal: Vector3<f64>,
    /// Signed distance d of the plane from the origin, m.
    offset: f64,
}

impl Face {
    /// Signed distance of a place, m.
    fn above(&self, place: &Vector3<f64>) -> f64 {
        self.normal.dot(place) - self.offset
    }
}

/// An edge: the places `through` + x `along` for x from `from` to `to` (m), which may be infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Edge {
    through: Vector3<f64>,
    along: Vector3<f64>,
    from: f64,
    to: f64,
}

impl ConvexPolyhedron {
    /// The intersection of half spaces. Half spaces that contain the others have no effect.
    ///
    /// The time is of third order in the number of half spaces. That of a distance is of first
    /// order.
    ///
    /// # Errors
    /// No half space, an invalid one, or half spaces whose intersection is empty or has no
    /// thickness.
    pub fn new(half_spaces: Vec<HalfSpace>) -> Result<Self, ParameterError> {
        half_spaces.iter().try_for_each(HalfSpace::check)?;
        let size = half_spaces
            .iter()
            .map(|half| half.through.norm())
            .fold(0.0, f64::max);
        let size = if size > 0.0 { size } else { 1.0 };
        let plane = |half: &HalfSpace| {
            let normal = half.normal.normalize();
            Face {
                normal,
                offset: normal.dot(&half.through),
            }
        };
        let planes: Vec<Face> = half_spaces.iter().map(plane).collect();
        let (name, number) = ("number of half spaces of a polyhedron", planes.len() as f64);
        ParameterError::unless(!planes.is_empty(), name, number, "at least 1")?;
        let thinner = |plane: &Face| Face {
            offset: plane.offset - THINNEST * size,
            ..*plane
        };
        let thinner: Vec<Face> = planes.iter().map(thinner).collect();
        let requirement = "positive: the half spaces must have an inside in common (m³)";
        ParameterError::unless(
            !is_empty(&thinner, SAME * size),
            "volume of a polyhedron",
            0.0,
            requirement,
        )?;
        let edges = edges(&planes, SAME * size);
        Ok(Self {
            half_spaces,
            planes,
            edges,
            same: SAME * size,
        })
    }

    /// The half spaces.
    pub fn half_spaces(&self) -> &[HalfSpace] {
        &self.half_spaces
    }
}

impl TryFrom<Vec<HalfSpace>> for ConvexPolyhedron {
    type Error = ParameterError;

    fn try_from(half_spaces: Vec<HalfSpace>) -> Result<Self, ParameterError> {
        Self::new(half_spaces)
    }
}

impl From<ConvexPolyhedron> for Vec<HalfSpace> {
    fn from(polyhedron: ConvexPolyhedron) -> Self {
        polyhedron.half_spaces
    }
}

impl Obstacle for ConvexPolyhedron {
    fn distance(&self, place: &Vector3<f64>, _time: f64) -> Distance {
        let face = |plane: &Face| Distance {
            value: plane.above(place),
            normal: plane.normal,
            curvature: Matrix3::zeros(),
        };
        let highest = self
            .planes
            .iter()
            .map(face)
            .reduce(|a, b| if b.value > a.value { b } else { a });
        let highest = highest.unwrap_or_else(Distance::nowhere);
        if !(highest.value > 0.0) {
            return highest;
        }
        let inside = |place: &Vector3<f64>| {
            self.planes
                .iter()
                .all(|plane| plane.above(place) <= self.same)
        };
        let above = |plane: &&Face| {
            let height = plane.above(place);
            height > 0.0 && inside(&(place - plane.normal * height))
        };
        if let Some(plane) = self.planes.iter().find(above) {
            return face(plane);
        }
        let edges = self.edges.iter().map(|edge| {
            let at = edge
                .along
                .dot(&(place - edge.through))
                .max(edge.from)
                .min(edge.to);
            (edge, at, place - edge.through - edge.along * at)
        });
        let Some((edge, at, from)) =
            edges.min_by(|a, b| a.2.norm_squared().total_cmp(&b.2.norm_squared()))
        else {
            return highest;
        };
        let corner = at == edge.from || at == edge.to;
        let along = if corner { Vector3::zeros() } else { edge.along };
        round(&from, Matrix3::identity() - along * along.transpose(), 0.0)
    }

    fn has_edges(&self) -> bool {
        !self.edges.is_empty()
    }
}

/// Whether the intersection of half spaces is empty. Places within `same` (m) coincide.
fn is_empty(planes: &[Face], same: f64) -> bool {
    let pairs = || {
        planes
            .iter()
            .enumerate()
            .flat_map(|(i, a)| planes[..i].iter().map(move |b| (a, b)))
    };
    if pairs().any(|(a, b)| crossing(a, b).is_some()) {
        // The smallest faces of such a polyhedron are edges or corners, and each corner belongs to
        // an edge.
        return edges(planes, same).is_empty();
    }
    pairs().any(|(a, b)| a.normal.dot(&b.normal) < 0.0 && a.offset + b.offset < 0.0)
}

/// The line in which two planes intersect, without ends.
fn crossing(a: &Face, b: &Face) -> Option<Edge> {
    let across = a.normal.cross(&b.normal);
    let along = across.try_normalize(PARALLEL)?;
    let through = b.normal.cross(&across) * a.offset + across.cross(&a.normal) * b.offset;
    let through = through / across.norm_squared();
    Some(Edge {
        through,
        along,
        from: f64::NEG_INFINITY,
        to: f64::INFINITY,
    })
}

/// The edges of an intersection of half spaces: the part of each line in which two planes intersect
/// that is in all of them. Places within `same` (m) coincide.
fn edges(planes: &[Face], same: f64) -> Vec<Edge> {
    let mut all = Vec::new();
    for (i, a) in planes.iter().enumerate() {
        for (j, b) in planes[..i].iter().enumerate() {
            let Some(mut edge) = crossing(a, b) else {
                continue;
            };
            for (_, plane) in planes
                .iter()
                .enumerate()
                .filter(|(k, _)| *k != i && *k != j)
            {
                let (above, slope) = (plane.above(&edge.through), plane.normal.dot(&edge.along));
                if slope > PARALLEL {
                    edge.to = edge.to.min(-above / slope);
                } else if slope < -PARALLEL {
                    edge.from = edge.from.max(-above / slope);
                } else if above > same {
                    (edge.from, edge.to) = (f64::INFINITY, f64::NEG_INFINITY);
                }
            }
            if edge.from <= edge.to {
                all.push(edge);
            }
        }
    }
    all
}
