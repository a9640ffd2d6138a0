//! Properties of a support: its rigid conditions, and its changes in time.

use nalgebra::Vector3;

use crate::numerics::scalar::relative;
use crate::rod::Rod;
use crate::support::{Hold, Orientation, Position, Support};

/// The number of rigid conditions of a support at a time (s): components of positions and frames
/// that it holds.
pub(crate) fn rigid_conditions(support: &impl Support, time: f64) -> usize {
    let position = |hold: &Hold| match hold.position {
        Position::Free | Position::Spring { .. } => 0,
        Position::OnPlane { .. } => 1,
        Position::OnLine { .. } => 2,
        Position::At(_) => 3,
    };
    let frame = |hold: &Hold| match hold.orientation {
        Orientation::Free | Orientation::Spring { .. } => 0,
        Orientation::Hinge { .. } => 2,
        Orientation::Held(_) => 3,
    };
    support
        .holds(time)
        .iter()
        .map(|hold| position(hold) + frame(hold))
        .sum()
}

/// The largest change of a support of a rod between two times (s): of places relative to the
/// length, of directions and frames in radians, of stiffnesses relative to the larger one, of the
/// distances of obstacles from the ends of the elements relative to the length. It is 1 if the
/// number or the kind of the holds changes.
pub(crate) fn change_of_support(support: &impl Support, rod: &Rod, (now, then): (f64, f64)) -> f64 {
    if support.is_absent() {
        return 0.0;
    }
    let length = rod.length();
    let [first, second] = [now, then].map(|time| support.holds(time));
    let changes = first
        .iter()
        .zip(&second)
        .map(|(one, other)| change_of_hold(one, other, length));
    let changed = changes.fold(f64::from(u8::from(first.len() != second.len())), f64::max);
    let line = rod.centre_line();
    let moved = support.contacts().into_iter().flat_map(|contact| {
        let distance =
            move |place: &Vector3<f64>, time| contact.obstacle.distance(place, time).value;
        line.iter()
            .map(move |(_, place)| (distance(place, now) - distance(place, then)).abs() / length)
    });
    moved.fold(changed, f64::max)
}

fn change_of_hold(one: &Hold, other: &Hold, length: f64) -> f64 {
    let apart = |a: &Vector3<f64>, b: &Vector3<f64>| (a - b).norm() / length;
    let position = match (&one.position, &other.position) {
        (Position::Free, Position::Free) => 0.0,
        (Position::At(a), Position::At(b)) => apart(a, b),
        (
            Position::OnLine {
                through: a,
                along: d,
            },
            Position::OnLine {
                through: b,
                along: e,
            },
        )
        | (
            Position::OnPlane {
                through: a,
                normal: d,
            },
            Position::OnPlane {
                through: b,
                normal: e,
            },
        ) => apart(a, b).max((d.into_inner() - e.into_inner()).norm()),
        (
            Position::Spring {
                anchor: a,
                stiffness: k,
            },
            Position::Spring {
                anchor: b,
                stiffness: l,
            },
        ) => apart(a, b).max(relative((k - l).norm(), k.norm(), l.norm())),
        _ => 1.0,
    };
    let orientation = match (&one.orientation, &other.orientation) {
        (Orientation::Free, Orientation::Free) => 0.0,
        (Orientation::Held(a), Orientation::Held(b)) => a.angle_to(b),
        (Orientation::Hinge { frame: a, axis: d }, Orientation::Hinge { frame: b, axis: e }) => {
            a.angle_to(b).max((d.into_inner() - e.into_inner()).norm())
        }
        (
            Orientation::Spring {
                frame: a,
                stiffness: k,
            },
            Orientation::Spring {
                frame: b,
                stiffness: l,
            },
        ) => a.angle_to(b).max(relative((k - l).abs(), *k, *l)),
        _ => 1.0,
    };
    let place = (one.initial_apex_distance - other.initial_apex_distance).abs() / length;
    place.max(position).max(orientation)
}
