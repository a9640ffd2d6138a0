//! Distances from bodies: derivatives, nearest points, and composition.

use approx::{assert_abs_diff_eq, assert_relative_eq};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{ConvexPolyhedron, Cuboid, Distance, HalfSpace, Obstacle, Sphere, Union};
use crate::error::ParameterError;

/// A pseudo-random number below one (SplitMix64), which depends on an index.
fn unit(index: u64) -> f64 {
    let mix = |z: u64, shift: u32, factor: u64| (z ^ (z >> shift)).wrapping_mul(factor);
    let z = mix(
        index.wrapping_mul(0x9e37_79b9_7f4a_7c15),
        30,
        0xbf58_476d_1ce4_e5b9,
    );
    let z = mix(z, 27, 0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// A vector with components between −1 and 1.
fn vector(index: u64) -> Vector3<f64> {
    Vector3::from_fn(|i, _| 2.0 * unit(3 * index + i as u64) - 1.0)
}

/// A box of the order of one in an inclined frame.
fn inclined() -> Cuboid {
    let frame = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.8, 0.5));
    Cuboid {
        centre: Vector3::new(0.2, -0.1, 0.4),
        frame,
        half_edges: Vector3::new(0.5, 0.8, 0.3),
    }
}

/// The half spaces of a box.
fn sides(cuboid: &Cuboid) -> Vec<HalfSpace> {
    let side = |i: usize| {
        let normal =
            cuboid.frame * Vector3::ith(i / 2, if i.is_multiple_of(2) { 1.0 } else { -1.0 });
        HalfSpace {
            through: cuboid.centre + normal * cuboid.half_edges[i / 2],
            normal: normal * 2.0,
        }
    };
    (0..6).map(side).collect()
}

/// A polyhedron of planes at distances of 0.3 to 1 from the origin.
fn random(seed: u64, number: u64) -> ConvexPolyhedron {
    let plane = |i: u64| {
        let normal = vector(1000 * seed + i).normalize();
        HalfSpace {
            through: normal * (0.3 + 0.7 * unit(9000 * seed + i)),
            normal,
        }
    };
    ConvexPolyhedron::new((1..=number).map(plane).collect()).unwrap()
}

/// Compares the derivatives at a place with central differences. Returns the rank of the curvature.
fn check_derivatives(obstacle: &impl Obstacle, place: &Vector3<f64>) -> usize {
    let step = 1e-6;
    let here = obstacle.distance(place, 0.0);
    assert_relative_eq!(here.normal.norm(), 1.0, epsilon = 1e-14);
    assert_abs_diff_eq!(
        (here.curvature * here.normal).norm(),
        0.0,
        epsilon = 1e-12 * (1.0 + here.curvature.norm())
    );
    for i in 0..3 {
        let along = Vector3::ith(i, step);
        let [ahead, behind] =
            [1.0, -1.0].map(|side| obstacle.distance(&(place + along * side), 0.0));
        // Rounding over the step is 1e-10.
        assert_abs_diff_eq!(
            (ahead.value - behind.value) / (2.0 * step),
            here.normal[i],
            epsilon = 1e-8
        );
        let change = (ahead.normal - behind.normal) / (2.0 * step);
        assert_abs_diff_eq!(
            (change - here.curvature.column(i)).norm(),
            0.0,
            epsilon = 1e-7
        );
    }
    here.curvature.rank(1e-9)
}

#[test]
fn derivatives_of_the_distance_are_those_of_differences_in_all_regions() {
    let bodies: [&dyn Obstacle; 2] = [&inclined(), &random(7, 9)];
    for body in bodies {
        // The rank of the curvature is 0 at a face, 1 at an edge, and 2 at a corner. The last
        // region is the inside.
        let mut regions = [0; 4];
        for place in (0..400).map(|i| vector(i) * 1.5) {
            let here = body.distance(&place, 0.0);
            let same = |k: u64| {
                let there = body.distance(&(place + vector(k) * 1e-5), 0.0);
                (there.normal - here.normal).norm() < 1e-3
                    && there.curvature.rank(1e-9) == here.curvature.rank(1e-9)
            };
            // Differences across a boundary between two regions have another error.
            if here.value.abs() > 0.05 && (0..8).all(same) {
                let rank = check_derivatives(&body, &place);
                regions[if here.value < 0.0 { 3 } else { rank }] += 1;
            }
        }
        assert!(regions.iter().all(|number| *number > 5), "{regions:?}");
    }
}

#[test]
fn normals_are_continuous_across_the_regions_outside() {
    let bodies: [&dyn Obstacle; 2] = [&inclined(), &random(7, 9)];
    for obstacle in bodies {
        // A path around the body at a distance of at least 0.3: the normal turns by at most the
        // path over that radius.
        let at = |t: f64| Vector3::new((3.0 * t).cos(), (5.0 * t).sin(), (3.0 * t).sin()) * 3.0;
        let (mut before, step) = (obstacle.distance(&at(0.0), 0.0), 1e-3);
        for (t, last) in (1..6300).map(|k| (f64::from(k) * step, f64::from(k - 1) * step)) {
            let next = obstacle.distance(&at(t), 0.0);
            let moved = (at(t) - at(last)).norm();
            if before.value > 0.3 && next.value > 0.3 {
                assert!(
                    (next.normal - before.normal).norm() <= moved / 0.3 * (1.0 + 1e-3),
                    "{t}"
                );
                assert!(
                    (next.value - before.value).abs() <= moved * (1.0 + 1e-9),
                    "{t}"
                );
            }
            before = next;
        }
    }
}

/// The nearest place of an intersection of half spaces by cyclic projection to the half spaces (J.
/// P. Boyle and R. L. Dykstra, 1986).
fn projected(half_spaces: &[HalfSpace], place: &Vector3<f64>) -> Vector3<f64> {
    let (mut at, mut corrections) = (*place, vec![Vector3::zeros(); half_spaces.len()]);
    for _ in 0..20_000 {
        for (half, correction) in half_spaces.iter().zip(&mut corrections) {
            let from = at + *correction;
            let distance = half.distance(&from, 0.0);
            at = from - distance.normal * distance.value.max(0.0);
            *correction = from - at;
        }
    }
    at
}

#[test]
fn distance_from_random_polyhedra_is_that_of_the_projection() {
    let mut outside = 0;
    for seed in 0..12 {
        // Four planes often form an unbounded body.
        let polyhedron = random(seed, 4 + seed);
        for place in (0..6).map(|i| vector(100 * seed + i) * 3.0) {
            let (nearest, found) = (
                projected(polyhedron.half_spaces(), &place),
                polyhedron.distance(&place, 0.0),
            );
            let (own, distance) = (place - found.normal * found.value, (place - nearest).norm());
            if distance > 1e-6 {
                outside += 1;
                // The projection converges linearly.
                assert_relative_eq!(found.value, distance, epsilon = 1e-7);
                assert_abs_diff_eq!((own - nearest).norm(), 0.0, epsilon = 1e-6);
            } else {
                let highest = polyhedron
                    .half_spaces()
                    .iter()
                    .map(|half| half.distance(&place, 0.0).value);
                assert_abs_diff_eq!(
                    found.value,
                    highest.fold(f64::MIN, f64::max),
                    epsilon = 1e-15
                );
            }
        }
    }
    assert!(outside > 40, "{outside}");
}

#[test]
fn box_is_the_polyhedron_of_its_sides() {
    let cuboid = inclined();
    let mut planes = sides(&cuboid);
    // Planes that are repeated, pass through an edge, or do not meet the body have no effect.
    let edge = cuboid.frame * Vector3::new(0.5, 0.8, 0.0) + cuboid.centre;
    planes.extend([
        planes[0],
        HalfSpace {
            through: edge,
            normal: cuboid.frame * Vector3::new(1.0, 2.0, 0.0),
        },
    ]);
    planes.push(HalfSpace {
        through: Vector3::x() * 9.0,
        normal: Vector3::x(),
    });
    let polyhedron = ConvexPolyhedron::new(planes).unwrap();
    for place in (0..500).map(|i| vector(i) * 2.0) {
        let (one, other) = (
            cuboid.distance(&place, 0.0),
            polyhedron.distance(&place, 0.0),
        );
        assert_abs_diff_eq!(one.value, other.value, epsilon = 1e-14);
        // Near a face, the normal of an edge is the difference of nearly equal places.
        assert_abs_diff_eq!((one.normal - other.normal).norm(), 0.0, epsilon = 1e-11);
    }
}

#[test]
fn bodies_without_corners_are_polyhedra() {
    let up = HalfSpace {
        through: Vector3::z() * 0.1,
        normal: Vector3::z(),
    };
    let down = HalfSpace {
        through: Vector3::zeros(),
        normal: -Vector3::z(),
    };
    let half = ConvexPolyhedron::new(vec![up, up]).unwrap();
    let plate = ConvexPolyhedron::new(vec![up, down]).unwrap();
    let place = Vector3::new(3.0, -2.0, 0.5);
    assert_eq!(half.distance(&place, 0.0), up.distance(&place, 0.0));
    assert_eq!(plate.distance(&place, 0.0), up.distance(&place, 0.0));
    assert_eq!(plate.distance(&-place, 0.0), down.distance(&-place, 0.0));
    assert!(!half.has_edges() && !plate.has_edges());
    // A wedge with its edge along e2.
    let side = HalfSpace {
        through: Vector3::z() * 0.1,
        normal: Vector3::x(),
    };
    let wedge = ConvexPolyhedron::new(vec![up, side])
        .unwrap()
        .distance(&Vector3::new(0.3, 7.0, 0.5), 0.0);
    let expected = Distance {
        value: 0.5,
        normal: Vector3::new(0.6, 0.0, 0.8),
        curvature: Matrix3::new(0.64, 0.0, -0.48, 0.0, 0.0, 0.0, -0.48, 0.0, 0.36) * 2.0,
    };
    assert_relative_eq!(wedge.value, expected.value, max_relative = 1e-15);
    assert_relative_eq!(wedge.normal, expected.normal, max_relative = 1e-15);
    assert_relative_eq!(wedge.curvature, expected.curvature, epsilon = 1e-15);
}

#[test]
fn bodies_without_volume_and_invalid_parameters_are_refused() {
    let plane = |x: f64, y: f64, z: f64, distance: f64| {
        let normal = Vector3::new(x, y, z);
        HalfSpace {
            through: normal * distance,
            normal,
        }
    };
    let refused = |planes: Vec<HalfSpace>, part: &str| {
        let error = ConvexPolyhedron::new(planes).unwrap_err().to_string();
        assert!(error.contains(part), "{error} instead of {part}");
    };
    refused(Vec::new(), "number of half spaces");
    refused(vec![plane(0.0, 0.0, 0.0, 1.0)], "normal of a half space");
    // Half spaces that exclude each other, a plate without thickness, and prisms of both kinds.
    refused(
        vec![plane(0.0, 0.0, 1.0, -1.0), plane(0.0, 0.0, -1.0, -1.0)],
        "volume",
    );
    refused(
        vec![plane(0.0, 0.0, 1.0, 0.5), plane(0.0, 0.0, -1.0, -0.5)],
        "volume",
    );
    let prism = |distance: f64| {
        vec![
            plane(1.0, 1.0, 0.0, distance),
            plane(-1.0, 1.0, 0.0, distance),
            plane(0.0, -1.0, 0.0, 0.5),
        ]
    };
    refused(prism(-0.5), "volume");
    assert!(ConvexPolyhedron::new(prism(0.5)).is_ok());
    refused(
        vec![
            plane(1.0, 0.0, 0.0, 0.0),
            plane(0.0, 1.0, 0.0, 0.0),
            plane(-1.0, -1.0, 0.0, 0.0),
        ],
        "volume",
    );
    refused(
        [
            prism(0.5),
            vec![plane(0.0, 0.0, 1.0, 0.0), plane(0.0, 0.0, -1.0, 0.0)],
        ]
        .concat(),
        "volume",
    );
    let error = |error: Result<(), ParameterError>| error.unwrap_err().name;
    let cuboid = inclined();
    assert!(cuboid.check().is_ok());
    assert_eq!(
        error(
            Cuboid {
                half_edges: Vector3::new(1.0, 0.0, 1.0),
                ..cuboid
            }
            .check()
        ),
        "half an edge of a box"
    );
    assert_eq!(
        error(
            Cuboid {
                centre: Vector3::x() * f64::NAN,
                ..cuboid
            }
            .check()
        ),
        "centre of a box"
    );
    let frame = UnitQuaternion::new_unchecked(cuboid.frame.into_inner() * 2.0);
    assert!(error(Cuboid { frame, ..cuboid }.check()).contains("frame of a box"));
    assert_eq!(
        error(Union::<Cuboid>(Vec::new()).check()),
        "number of members of a union"
    );
    assert_eq!(
        error(Union(vec![Soft]).check()),
        "compliance of a member of a union"
    );
    // No input is a panic.
    for place in [
        Vector3::repeat(f64::NAN),
        Vector3::repeat(f64::INFINITY),
        cuboid.centre,
    ] {
        let _ = (
            cuboid.distance(&place, 0.0),
            random(7, 9).distance(&place, 0.0),
        );
        let _ = Union::<Cuboid>(Vec::new()).distance_to(3, &place, 0.0);
    }
}

/// A place that yields.
struct Soft;

impl Obstacle for Soft {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        Sphere {
            centre: Vector3::zeros(),
            radius: 1.0,
        }
        .distance(place, time)
    }

    fn compliance(&self) -> Matrix3<f64> {
        Matrix3::identity()
    }
}

#[test]
fn union_has_the_surfaces_of_its_members() {
    let ball = |x: f64| Sphere {
        centre: Vector3::x() * x,
        radius: 0.5,
    };
    let inner: Box<dyn Obstacle> = Box::new(Union(vec![ball(0.0), ball(1.0)]));
    let union = Union(vec![
        Box::new(inclined()) as Box<dyn Obstacle>,
        inner,
        Box::new(ball(2.0)),
    ]);
    let members: [&dyn Obstacle; 4] = [&inclined(), &ball(0.0), &ball(1.0), &ball(2.0)];
    assert_eq!(union.surfaces(), 4);
    for place in (0..50).map(|i| vector(i) * 3.0) {
        for (i, member) in members.iter().enumerate() {
            assert_eq!(
                union.distance_to(i, &place, 0.0),
                member.distance(&place, 0.0)
            );
        }
        let least = members
            .iter()
            .map(|member| member.distance(&place, 0.0).value)
            .fold(f64::MAX, f64::min);
        assert_eq!(union.distance(&place, 0.0).value, least);
    }
}
