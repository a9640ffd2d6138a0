//! Places at which holds and springs act on a rod, and frames that are held.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::elastic::{ElasticLaw, ElasticLaws, Spring};
use crate::equilibrium::EquilibriumError;
use crate::equilibrium::joints::{ElasticJoint, FreeBase, Joints};
use crate::error::ParameterError;
use crate::rod::Rod;
use crate::so3;
use crate::support::{
    Argument, Elastic, Hold, Joint, Orientation, Position, Support, closest_about,
};

/// Largest distance of a held place from a node at t = 0, relative to the length then. It must not
/// be relative to the element, which may be short at the boundary of the growth zone.
const AT_NODE: f64 = 1e-9;
/// As [`AT_NODE`], for a node that is protected from merging: merged elements beside it interpolate
/// the distances at t = 0 with an error. It was up to 1e-7 of the length in shoots of order eight
/// that had doubled their length.
const AT_KEPT_NODE: f64 = 1e-5;

/// A place at which a support acts.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct HeldSite {
    pub node: usize,
    /// Unit vectors along which the position is given.
    pub fixed: Vec<Vector3<f64>>,
    /// Position in these directions, m.
    pub target: Vector3<f64>,
    pub spring: Option<Spring>,
    /// Force of the hold on the rod, without springs, N.
    pub force: Vector3<f64>,
    /// Position in the present configuration, m.
    pub position: Vector3<f64>,
}

impl HeldSite {
    /// A site at a node, without condition yet.
    fn at_node(node: usize, spring: Option<Spring>) -> Self {
        let zero = Vector3::zeros();
        Self {
            node,
            fixed: Vec::new(),
            target: zero,
            spring,
            force: zero,
            position: zero,
        }
    }

    /// Element and coordinate of the site.
    pub fn place(&self) -> (usize, f64) {
        place_of(self.node)
    }

    /// The directions in which the position is given, with the distances by which it differs, m.
    pub fn missing(&self) -> impl Iterator<Item = (Vector3<f64>, f64)> + '_ {
        let from = self.position - self.target;
        self.fixed.iter().map(move |d| (*d, d.dot(&from)))
    }

    /// The force of the hold and the spring on the rod, N.
    pub fn reaction(&self) -> Vector3<f64> {
        self.force + self.spring.map_or(Vector3::zeros(), |spring| spring.force)
    }
}

/// The place of a node: the end of an element, or the base.
pub(super) fn place_of(node: usize) -> (usize, f64) {
    node.checked_sub(1)
        .map_or((0, 0.0), |element| (element, 1.0))
}

/// The node at a distance from the apex at t = 0 (m).
pub(super) fn node_at(rod: &Rod, distance: f64) -> Result<usize, ParameterError> {
    let (name, length) = ("distance of a held place from the apex", rod.initial_length);
    let on = distance >= 0.0 && distance <= length * (1.0 + AT_NODE);
    ParameterError::unless(on, name, distance, "between 0 and the length at t = 0 (m)")?;
    let node = rod.locate_initial(distance).and_then(|(e, _)| {
        let [first, last] = [0.0, 1.0].map(|x| (rod.initial_apex_distance(e, x) - distance).abs());
        let (node, off) = if first <= last {
            (e, first)
        } else {
            (e + 1, last)
        };
        let permitted = if rod.kept[node] {
            AT_KEPT_NODE
        } else {
            AT_NODE
        };
        (off <= permitted * length).then_some(node)
    });
    let requirement =
        "that of an end of an element, as at holds that exist when the shoot is built (m)";
    node.ok_or_else(|| ParameterError::refused(name, distance, requirement))
}

/// A unit vector across another one, and the one across both.
pub(super) fn across(normal: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let first = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
    [first, normal.cross(&first)]
}

/// The site of a hold of the position; `None` for a hold of the frame alone.
fn site_of(hold: &Hold, node: usize, laws: &mut ElasticLaws) -> Option<HeldSite> {
    let mut site = HeldSite::at_node(node, None);
    match hold.position {
        Position::Free => return None,
        Position::At(point) => {
            (site.fixed, site.target) = (vec![Vector3::x(), Vector3::y(), Vector3::z()], point)
        }
        Position::OnLine { through, along } => {
            (site.fixed, site.target) = (across(&along).to_vec(), through)
        }
        Position::OnPlane { through, normal } => {
            (site.fixed, site.target) = (vec![normal.into_inner()], through)
        }
        Position::Spring { anchor, stiffness } => {
            site.spring = Some(Spring::new(laws.springs.len()));
            laws.springs.push(ElasticLaw::Linear(stiffness, anchor));
        }
    }
    Some(site)
}

/// A frame that is held, up to a rotation about an axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct HeldFrame {
    pub node: usize,
    pub frame: UnitQuaternion<f64>,
    /// The axis along the directors; `None` for a frame that does not rotate.
    pub axis: Option<Vector3<f64>>,
}

impl HeldFrame {
    /// The rotation, along the directors, from the present frame to the closest one that is
    /// permitted, rad.
    pub fn missing(&self, rod: &Rod) -> Vector3<f64> {
        let present = rod.frames()[self.node];
        let permitted = match self.axis {
            None => self.frame,
            Some(axis) => closest_about(&axis, &self.frame, &present),
        };
        so3::log(&(present.inverse() * permitted))
    }

    /// The projection to the free directions, along the directors.
    pub fn projection(&self) -> Matrix3<f64> {
        self.axis
            .map_or(Matrix3::zeros(), |axis| axis * axis.transpose())
    }
}

/// Sorts the supports of a rod at a time (s), besides contacts, into sites, held frames, and the
/// laws of springs and elastic joints.
pub(super) fn sort<'a>(
    rod: &Rod,
    support: &'a dyn Support,
    time: f64,
    joints: &mut Joints,
) -> Result<(Vec<HeldSite>, Vec<HeldFrame>, ElasticLaws<'a>), EquilibriumError> {
    joints.base_rotates = support.base().is_some();
    let free = FreeBase {
        length: rod.length(),
        reach: rod.length(),
        stiffness: 1.0,
        least: 0.0,
        exact: false,
    };
    joints.free_base = (support.base() == Some(Joint::Free)).then_some(free);
    let (mut sites, mut frames, mut laws) =
        (Vec::new(), Vec::<HeldFrame>::new(), ElasticLaws::default());
    if let Some(Joint::Hinge(axis)) = support.base() {
        frames.push(HeldFrame {
            node: 0,
            frame: rod.frames()[0],
            axis: Some(axis.into_inner()),
        });
    }
    let mut held = Vec::new();
    for hold in support.holds(time) {
        let node = node_at(rod, hold.initial_apex_distance)?;
        let (name, place) = (
            "number of holds of one place",
            rod.initial_length - hold.initial_apex_distance,
        );
        // A hold that moves is checked at the present time.
        hold.check().map_err(|error| error.at(place))?;
        ParameterError::unless(!held.contains(&node), name, 2.0, "one")
            .map_err(|error| error.at(place))?;
        held.push(node);
        check_base(node, hold.position == Position::Free, joints)?;
        sites.extend(site_of(&hold, node, &mut laws));
        match hold.orientation {
            Orientation::Free => {}
            Orientation::Held(frame) => frames.push(HeldFrame {
                node,
                frame,
                axis: None,
            }),
            Orientation::Hinge { frame, axis } => {
                frames.push(HeldFrame {
                    node,
                    frame,
                    axis: Some(axis.into_inner()),
                });
            }
            Orientation::Spring { frame, stiffness } => {
                joints.elastic.push(ElasticJoint {
                    node,
                    ..ElasticJoint::default()
                });
                laws.joints.push((
                    frame,
                    ElasticLaw::Linear(Matrix3::identity() * stiffness, Vector3::zeros()),
                ));
            }
        }
    }
    for Elastic {
        initial_apex_distance,
        argument,
        potential,
    } in support.potentials()
    {
        let node = node_at(rod, initial_apex_distance)?;
        check_base(node, argument != Argument::Position, joints)?;
        match argument {
            Argument::Position => {
                let spring = Some(Spring::new(laws.springs.len()));
                sites.push(HeldSite::at_node(node, spring));
                laws.springs.push(ElasticLaw::User(potential));
            }
            Argument::Rotation { frame } => {
                joints.elastic.push(ElasticJoint {
                    node,
                    ..ElasticJoint::default()
                });
                laws.joints.push((frame, ElasticLaw::User(potential)));
            }
        }
    }
    frames.sort_by_key(|frame| frame.node);
    joints
        .confined
        .extend(frames.iter().map(|frame| (frame.node, frame.projection())));
    Ok((sites, frames, laws))
}

/// Returns an error for a support at the base, unless it acts on the frame of a base that rotates,
/// or on a free base.
fn check_base(node: usize, on_frame: bool, joints: &Joints) -> Result<(), ParameterError> {
    let requirement = "positive (m): the base is clamped; a hold or spring there requires `Joint::Free`, a frame or an \
                       elastic joint `Joint::Ball` or `Joint::Hinge`";
    let ok = node > 0 || on_frame && joints.base_rotates || joints.free_base.is_some();
    ParameterError::unless(ok, "distance of a hold from the base", 0.0, requirement)
}

/// Rotates frames by shares of a rotation vector along their directors, which increases linearly
/// with the node from `from` to `at`. Frames beyond follow: they keep their position relative to
/// `at`, or rotate by shares that decrease to zero at `to`.
pub(super) fn turn_frames(
    rod: &mut Rod,
    turn: &Vector3<f64>,
    from: usize,
    at: usize,
    to: Option<usize>,
) {
    let lengths: Vec<f64> = (0..rod.elements()).map(|e| rod.length_of(e)).collect();
    let part = |a: usize, b: usize| lengths[a..b].iter().sum::<f64>();
    let share = |e: usize, x: f64| match to {
        _ if e < from => 0.0,
        _ if e < at => (part(from, e) + x * lengths[e]) / part(from, at),
        Some(to) if e < to => 1.0 - (part(at, e) + x * lengths[e]) / part(at, to),
        _ => 0.0,
    };
    let old = rod.clone();
    let rigid = old.frames()[at] * so3::exp(turn) * old.frames()[at].inverse();
    let moved = |e: usize, x: f64| {
        let frame = old.frame_within(e, x);
        if e >= at && to.is_none() {
            rigid * frame
        } else {
            frame * so3::exp(&(turn * share(e, x)))
        }
    };
    if at == 0 {
        rod.frames[0] = moved(0, 0.0);
    }
    bend(rod, moved);
}

/// Gives a rod the shape in which the frames relative to the first one are a function of element
/// and coordinate. The frame of the base does not change.
fn bend(rod: &mut Rod, frame: impl Fn(usize, f64) -> UnitQuaternion<f64>) {
    let (p, reference) = (rod.order().points(), rod.reference());
    for (e, rotations) in rod.rotations.chunks_mut(p).enumerate() {
        let start = frame(e, 0.0).inverse();
        for (rotation, x) in rotations.iter_mut().zip(&reference.nodes[1..]) {
            *rotation = so3::log(&(start * frame(e, *x)));
        }
    }
    rod.chain_frames();
}
