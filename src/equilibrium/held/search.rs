//! The data of a search for an equilibrium of a rod with supports, and its loads.

use nalgebra::{DVector, UnitQuaternion, Vector3};

use super::candidate::{Candidate, deepest};
use super::elastic::{ElasticLaws, Spring, elastic_joint};
use super::increment::{Before, Motion};
use super::law::Status;
use super::line::Line;
use super::linear::{Factors, Role};
use super::mechanics::Mechanics;
use super::obstacles::Obstacles;
use super::settings::SAME;
use super::sites::{HeldFrame, HeldSite, sort};
use crate::equilibrium::joints::Joints;
use crate::equilibrium::{Equilibrium, EquilibriumError, IncrementStart, Inertia};
use crate::load::PointReaction;
use crate::rod::Rod;
use crate::so3;
use crate::support::{Joint, Patch, Reaction, Slip, Support};

/// Least spring at a free base that remains in a step, relative to the force in the rod over its
/// length. A softer one amplifies rounding, and with a stiffer one the search converges slowly
/// where only friction prevents a rigid motion.
const LEAST_SPRING: f64 = 1e-2;

/// Stiffness of a direction, relative to that of the rod without load, below which the tangent is
/// not inverted in it. The supports may permit this direction, so that its stiffness is compared
/// with its uncertainty.
const SOFT: f64 = 1e-2;

/// A search for an equilibrium of a rod with supports.
pub(in crate::equilibrium) struct HeldSearch<'a> {
    pub(super) body: Box<dyn Mechanics + 'a>,
    /// The rod without additional nodes at contacts.
    pub(super) parent: &'a Rod,
    pub(super) sites: Vec<HeldSite>,
    pub(super) frames: Vec<HeldFrame>,
    pub(super) laws: ElasticLaws<'a>,
    pub(super) obstacles: Obstacles<'a>,
    pub(super) candidates: Vec<Candidate>,
    /// The start of the increment in time; `None` for a rod without past.
    pub(super) start: Option<&'a IncrementStart>,
    /// The rod at the start of the increment.
    pub(super) before: Before,
    /// The motion of the base and the obstacles in the increment; `None` without obstacles and for
    /// a rod without past.
    pub(super) motion: Option<Motion>,
    /// The centre line at the last evaluation of the candidates.
    pub(super) line: Line,
    /// Length over which the rod bends beside a contact, m.
    pub(super) layer: f64,
    /// Whether the equilibrium has to be stable.
    pub(super) stable: bool,
    /// Rotation vectors of the last equilibrium, to which an extrapolated initial guess is compared.
    pub(in crate::equilibrium) last: Option<&'a [Vector3<f64>]>,
    /// Whether the search returns to the start of the increment in time.
    pub(super) returns: bool,
    /// Whether the descent to any equilibrium is omitted.
    pub(in crate::equilibrium) omits_descent: bool,
    pub(super) tolerance: f64,
    pub(super) length: f64,
    /// Length of an element of the rod without additional nodes, m.
    pub(super) element: f64,
    /// Whether the next step omits neutral directions only: the last one hardly moved the rod, but
    /// may have omitted others.
    pub(super) completes: bool,
    /// Unknowns whose diagonal entry was increased, and the increases.
    pub(super) boosts: Vec<(usize, f64)>,
    /// Weight of violated distances in the merit, N: at least twice the largest force of a contact
    /// or hold. A step reduces it by at most a factor of four.
    pub(super) weight: f64,
    /// Largest energy so far over the length, N: the magnitude of the reactions on a rod without
    /// load.
    pub(super) energy_scale: f64,
    pub(super) found: Equilibrium,
    /// Number of iterations at which the present increment of the load path fails.
    pub(super) bound: usize,
    /// Number of increments of the load path, including those that failed.
    pub(super) increments: usize,
    /// Largest rotation of the frame of an elastic joint at the start of a step (rad), and the arc
    /// length of the joint (m).
    pub(super) largest_joint_turn: Option<(f64, f64)>,
}

/// The shape of a rod and its supports, to which the search returns after an attempt that has
/// failed.
#[derive(Clone)]
pub(super) struct Snapshot {
    pub(super) rod: Rod,
    sites: Vec<HeldSite>,
    frames: Vec<HeldFrame>,
    joints: Joints,
    pub(super) candidates: Vec<Candidate>,
    before: Before,
    energy_scale: f64,
    /// The progress on the load path.
    progress: Option<f64>,
}

impl<'a> HeldSearch<'a> {
    pub fn new(
        mut body: Box<dyn Mechanics + 'a>,
        rod: &'a Rod,
        support: &'a dyn Support,
        (stable, tolerance): (bool, f64),
    ) -> Result<Self, EquilibriumError> {
        let time = body.force().environment().time;
        let obstacles = Obstacles::new(support.contacts(), time);
        let mut joints = Joints::default();
        let (sites, frames, laws) = sort(rod, support, time, &mut joints)?;
        body.system_mut().joints = joints;
        Ok(Self {
            before: Before::new(rod, time, obstacles.yielded.clone()),
            start: None,
            motion: None,
            body,
            parent: rod,
            sites,
            frames,
            laws,
            obstacles,
            candidates: Vec::new(),
            line: Line::default(),
            layer: f64::INFINITY,
            stable,
            last: None,
            returns: false,
            omits_descent: false,
            tolerance,
            length: rod.length(),
            element: rod.length() / rod.elements() as f64,
            completes: false,
            boosts: Vec::new(),
            weight: 0.0,
            energy_scale: 0.0,
            found: Equilibrium::default(),
            bound: usize::MAX,
            increments: 0,
            largest_joint_turn: None,
        })
    }

    /// Sets the start of the increment, and the joint of the base.
    pub fn since(&mut self, start: &'a IncrementStart, joint: Option<Joint>) {
        self.start = Some(start);
        let (rod, end) = (&start.rod, self.obstacles.time);
        self.before = Before::new(
            rod,
            start.time,
            self.obstacles.displacements_by(&start.reactions),
        );
        if !self.obstacles.contacts.is_empty() {
            self.motion = Some(Motion::new(
                rod,
                self.parent,
                (end, end - start.time),
                joint,
            ));
        }
    }

    /// Takes the forces of an earlier equilibrium as initial guess.
    pub fn guess_forces(&mut self, reactions: &[Reaction]) {
        for (site, reaction) in self
            .sites
            .iter_mut()
            .zip(reactions.iter().filter(|at| at.obstacle.is_none()))
        {
            site.force = project(&site.fixed, &reaction.force);
            site.spring
                .iter_mut()
                .for_each(|spring| spring.force = reaction.force);
        }
    }

    /// Takes the forces and contacts of an earlier equilibrium as initial guess.
    pub fn guess(
        &mut self,
        rod: &mut Rod,
        (reactions, patches): (&[Reaction], &[Patch]),
        shape: Option<&Rod>,
    ) {
        self.guess_forces(reactions);
        // A rod without the nodes of contacts does not resolve their forces. Only its motion is of
        // use.
        if self.guess_contacts(rod, (reactions, patches))
            && let Some(shape) = shape
        {
            let mut last = self.parent.clone();
            last.sample_shape(shape);
            rod.sample_motion(shape, [&last, self.parent]);
        }
    }

    /// Gives the rod nodes at contacts of an earlier equilibrium, whose forces are the initial
    /// guess. Returns whether there are any.
    pub(super) fn guess_contacts(
        &mut self,
        rod: &mut Rod,
        (reactions, patches): (&[Reaction], &[Patch]),
    ) -> bool {
        // A contact at the apex stays there as the rod elongates.
        let apex = self.before.rod.length().min(self.length) * (1.0 - SAME);
        let place = |s: f64| if s >= apex { self.length } else { s };
        let inside = |patch: &Patch| {
            let obstacle = self.obstacles.index(patch.obstacle, patch.surface)?;
            Some(Patch {
                obstacle,
                surface: 0,
                from: place(patch.from),
                to: place(patch.to),
            })
        };
        let inside: Vec<Patch> = patches.iter().filter_map(inside).collect();
        if inside.is_empty() {
            return false;
        }
        self.locate(rod);
        let old = old_candidates(reactions, &self.obstacles);
        self.body.force_mut().react(rod, reactions);
        let along = reactions
            .iter()
            .map(|at| (at.arc_length, at.force))
            .collect();
        self.layer = self.bending_length(rod, along);
        self.arrange(rod, &inside, &old);
        true
    }

    pub(super) fn snapshot(&self, rod: &Rod) -> Snapshot {
        Snapshot {
            rod: rod.clone(),
            sites: self.sites.clone(),
            frames: self.frames.clone(),
            joints: self.body.system().joints.clone(),
            candidates: self.candidates.clone(),
            before: self.before.clone(),
            energy_scale: self.energy_scale,
            progress: self.motion.as_ref().map(|motion| motion.progress),
        }
    }

    pub(super) fn restore(&mut self, rod: &mut Rod, snapshot: &Snapshot) {
        let Snapshot {
            rod: shape,
            sites,
            frames,
            joints,
            candidates,
            before,
            energy_scale,
            progress,
        } = snapshot.clone();
        (*rod, self.sites, self.frames, self.candidates) = (shape, sites, frames, candidates);
        (
            self.body.system_mut().joints,
            self.before,
            self.energy_scale,
        ) = (joints, before, energy_scale);
        if let Some(progress) = progress {
            self.set_progress(progress);
        }
        self.body.renew_load(rod);
        self.locate(rod);
    }

    /// Applies the present reactions to the rod.
    pub(super) fn apply(&mut self, rod: &Rod) {
        let point = |(element, x), force| PointReaction {
            element,
            x,
            force,
            couple: Vector3::zeros(),
        };
        let sites = self
            .sites
            .iter()
            .map(|site| point(site.place(), site.reaction()));
        let candidates = self
            .candidates
            .iter()
            .map(|at| point((at.element, at.x), at.force));
        let all: Vec<PointReaction> = sites.chain(candidates).collect();
        let yields = self.yields(rod);
        self.body.force_mut().set_reactions(rod, &all, yields);
    }

    /// Assembles and factorises the tangent with a shift (N).
    pub(super) fn factorise(&mut self, rod: &Rod, shift: f64) -> Result<Factors, EquilibriumError> {
        let (energy, mut pivots) = self.body.condense(rod, shift)?;
        self.stretch_joints(rod);
        self.record_joint_turns(rod);
        self.spring_base(rod, &mut pivots);
        let system = self.body.system_mut();
        system.joints.apply(&mut system.tangent);
        // The stations of a line contact hold the rod, and a rod that follows an obstacle may have
        // a soft pivot in every element.
        let follows = |at: &Candidate| !at.point && at.status != Status::Open;
        let soft = if self.candidates.iter().any(follows) {
            0.0
        } else {
            SOFT / system.compliance()
        };
        system
            .tangent
            .factorise_boosted(&mut pivots, &mut self.boosts, soft)?;
        self.found.factorisations += 1 + self.boosts.len();
        self.energy_scale = self.energy_scale.max(energy.abs() / self.length);
        Ok(Factors {
            energy,
            pivots,
            shift,
        })
    }

    /// Sets the spring of a free base to the bending stiffness of the rod plus twice the force over
    /// the reach, so that the force displaces the base by at most a half of the reach.
    fn spring_base(&mut self, rod: &Rod, inertia: &mut Inertia) {
        let Some(mut base) = self.body.system().joints.free_base else {
            return;
        };
        let (place, scale) = (rod.base_position(), self.force_scale());
        let radii = (0..self.obstacles.contacts.len()).map(|obstacle| {
            let gap = self.obstacles.gap_at(obstacle, &place);
            0.5 * (Obstacles::radius(&gap) - gap.value)
        });
        let reach = radii.fold(self.length, f64::min).max(1e-3 * self.length);
        let bending = 1.0 / (self.body.system().compliance() * self.length.powi(2));
        (base.reach, base.stiffness) = (reach, bending + 2.0 * scale / reach);
        base.least = if base.exact {
            0.0
        } else {
            LEAST_SPRING * scale / (base.length * base.stiffness)
        };
        self.body.system_mut().joints.free_base = Some(base);
        inertia.positive += 3;
    }

    /// Records the largest rotation of the frame of an elastic joint.
    fn record_joint_turns(&mut self, rod: &Rod) {
        let joints = self.body.system().joints.elastic.iter();
        let turns = joints.zip(&self.laws.joints).map(|(joint, (frame, _))| {
            let turn = joint_turn(frame, rod, joint.node).norm();
            (turn, rod.ends()[joint.node])
        });
        self.largest_joint_turn = turns
            .chain(self.largest_joint_turn)
            .max_by(|a, b| a.0.total_cmp(&b.0));
    }

    /// Evaluates the elastic joints at the frames of a rod. Returns their energy, J.
    pub(super) fn stretch_joints(&mut self, rod: &Rod) -> f64 {
        let (mut sum, time) = (0.0, self.obstacles.time);
        for (joint, (frame, law)) in self
            .body
            .system_mut()
            .joints
            .elastic
            .iter_mut()
            .zip(&self.laws.joints)
        {
            let turn = joint_turn(frame, rod, joint.node);
            let energy = law.energy(&turn, time);
            *joint = elastic_joint(joint.node, &turn, &energy);
            sum += energy.value;
        }
        sum
    }

    /// Energy of the rod, its loads, springs and obstacles (J) at the last evaluation, which
    /// returned `energy`. The work of the reactions is not part of it.
    pub(super) fn potential(&mut self, rod: &Rod, energy: f64) -> f64 {
        let joints = self.stretch_joints(rod);
        let springs: f64 = self
            .sites
            .iter()
            .filter_map(|site| Some(site.spring?.energy))
            .sum();
        let (base, system_base) = (rod.base_position(), self.body.system().joints.free_base);
        let sites = self
            .sites
            .iter()
            .map(|site| site.reaction().dot(&(site.position - base)));
        let candidates = self.candidates.iter().map(|at| {
            let yielded = self.obstacles.yielded[at.obstacle];
            at.force.dot(&(at.position - base)) - 0.5 * at.force.dot(&yielded)
        });
        let moved = system_base.map_or(0.0, |_| self.body.force().load_at_base().dot(&base));
        energy + joints + springs + sites.chain(candidates).sum::<f64>() - moved
    }

    /// Adds changes of the reactions of holds and springs.
    pub(super) fn add_links(&mut self, roles: &[Role], changes: &DVector<f64>, fraction: f64) {
        for (role, change) in roles.iter().zip(changes.iter()) {
            match role {
                Role::Hold(site, direction) => {
                    let site = &mut self.sites[*site];
                    let force = site.force + direction * (fraction * change);
                    // Rounding of a force that was large may exceed the present one.
                    site.force = project(&site.fixed, &force);
                }
                Role::Spring(site, axis) => {
                    if let Some(spring) = &mut self.sites[*site].spring {
                        spring.force += axis * (fraction * change);
                    }
                }
                Role::Boost => {}
            }
        }
    }

    /// Magnitude of the force in the rod, N: without load the energy per length.
    pub(super) fn force_scale(&self) -> f64 {
        self.body
            .force()
            .largest()
            .max(self.energy_scale)
            .max(f64::MIN_POSITIVE)
    }

    /// Distances of the held places from their targets in each held direction, m.
    pub(super) fn hold_violations(&self) -> impl Iterator<Item = f64> {
        self.sites
            .iter()
            .flat_map(HeldSite::missing)
            .map(|(_, distance)| distance.abs())
    }

    /// Sum of the distances by which holds and contacts are violated, m.
    pub(super) fn violation(&self) -> f64 {
        self.hold_violations()
            .chain(
                self.candidates
                    .iter()
                    .map(|at| (-self.least_gap(at)).max(0.0)),
            )
            .sum()
    }

    /// The least gap beside a candidate, m: that of the parabola through its place, within half an
    /// element. A candidate that has not moved to the place of least gap yet would hide a
    /// penetration there.
    fn least_gap(&self, at: &Candidate) -> f64 {
        let ((slope, bend), reach) = (at.approach(), 0.5 * self.element);
        let inside = self.end(at).is_none_or(|outward| slope * outward > 0.0);
        let moved = if at.follows_gap && inside {
            (-slope / bend).clamp(-reach, reach)
        } else {
            0.0
        };
        at.gap.value + moved * (slope + 0.5 * bend * moved)
    }

    /// Largest distance by which a hold or a contact is violated, m.
    pub(super) fn largest_violation(&self) -> f64 {
        let loaded = self
            .candidates
            .iter()
            .filter(|at| at.status != Status::Open)
            .map(|at| at.gap.value.abs());
        self.hold_violations()
            .chain(loaded)
            .fold(deepest(&self.candidates), f64::max)
    }

    /// The inertia at the present configuration.
    pub fn inertia(mut self, rod: &Rod) -> Result<Inertia, EquilibriumError> {
        self.locate(rod);
        self.apply(rod);
        let linear = self.linear_rod(rod)?;
        Ok(self.inertia_of(&linear, false))
    }

    /// The reactions of springs and elastic joints at a shape. Holds keep the forces of the initial
    /// guess.
    pub fn reactions_at(mut self, rod: &Rod) -> Vec<Reaction> {
        self.locate(rod);
        self.sites
            .iter_mut()
            .filter_map(|site| site.spring.as_mut())
            .for_each(Spring::relax);
        self.stretch_joints(rod);
        self.reactions(rod)
    }
}

impl Drop for HeldSearch<'_> {
    /// Removes the joints from the workspace, which a free rod may use next.
    fn drop(&mut self) {
        self.body.system_mut().joints = Joints::default();
    }
}

/// Candidates with the forces of earlier reactions. The end of a contact segment has two reactions.
fn old_candidates(reactions: &[Reaction], obstacles: &Obstacles) -> Vec<Candidate> {
    let mut all: Vec<Candidate> = Vec::new();
    for at in reactions {
        let Some(obstacle) = at
            .obstacle
            .and_then(|obstacle| obstacles.index(obstacle, at.surface))
        else {
            continue;
        };
        if let Some(same) = all
            .iter_mut()
            .find(|old| old.obstacle == obstacle && old.arc_length == at.arc_length)
        {
            same.force += at.force;
            continue;
        }
        let status = if at.slip == Some(Slip::Sticks) {
            Status::Sticking
        } else {
            Status::Sliding
        };
        let new = Candidate::at(obstacle, at.arc_length, (0, 0.0), false);
        all.push(Candidate {
            force: at.force,
            status,
            ..new
        });
    }
    all
}

/// The rotation vector (rad) from the frame of an elastic joint to that of the rod at its node.
fn joint_turn(frame: &UnitQuaternion<f64>, rod: &Rod, node: usize) -> Vector3<f64> {
    so3::log(&(frame.inverse() * rod.frames()[node]))
}

/// The projection of a vector on orthonormal vectors.
pub(super) fn project(directions: &[Vector3<f64>], vector: &Vector3<f64>) -> Vector3<f64> {
    directions.iter().map(|d| d * d.dot(vector)).sum()
}
