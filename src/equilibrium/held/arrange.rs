//! The places of contacts: corrections, and nodes at them.

use nalgebra::{DMatrix, DVector, Vector3};

use super::before::OldTouch;
use super::data::HeldSearch;
use super::sites::{Friction, Site};
use super::touch::{Place, SAME, all_stations, place};
use crate::constitutive::Constitutive;
use crate::equilibrium::EquilibriumError;
use crate::load::Load;
use crate::rod::Rod;
use crate::support::Patch;

/// Number of Newton iterations with the contacts of an initial guess.
pub(super) const FOLLOWING: usize = 40;
/// Number of corrections of the places of contacts.
const CORRECTIONS: usize = 30;
/// Distance of a contact from a node, relative to the element, below which the element is not divided.
const AT_NODE: f64 = 1e-4;
/// Displacement of a contact that estimates derivatives, relative to the length.
const DIFFERENCE: f64 = 1e-6;
/// Length of a free end beyond a contact that becomes longer, relative to an element, which is taken as none.
const SHORT_END: f64 = 0.3;
/// Slope, or curvature relative to the obstacle times the length, below which a place is not corrected.
const WELL_PLACED: f64 = 1e-6;
/// Tolerance (rad) of the equilibria from which derivatives are estimated: the rotations by a displacement
/// `DIFFERENCE` are larger.
const ESTIMATE: f64 = 1e-7;
/// Tolerance (rad) of the equilibrium at places that still move, relative to their motion over the length.
const EARLY: f64 = 1e-3;
/// Largest error of the place of a contact, relative to the length.
const PLACED: f64 = 1e-11;

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Corrects the places of contacts. Returns whether the contacts have changed otherwise.
    pub(super) fn correct(&mut self, rod: &mut Rod, bound: usize, touching: f64) -> Result<bool, EquilibriumError> {
        let mut patches = self.patches(rod, touching);
        self.layer = self.bending_length(rod);
        if patches.is_empty() {
            return Ok(false);
        }
        let skew = self.skew(rod, &patches);
        if !skew.is_empty() {
            let mut moved = patches.clone();
            self.pinned = true;
            let placed = self.try_place(rod, &mut moved, &skew, bound);
            self.pinned = false;
            // A contact that is tangential now, and where the rod is more curved still, becomes longer below.
            let curved = |at: &Patch| self.approach(rod, at.obstacle, at.from).1 < 0.0;
            if placed && !skew.iter().any(|(i, _)| curved(&moved[*i])) {
                return Ok(true);
            }
            if placed {
                patches = moved;
            }
        }
        let reshaped = self.reshape(rod, &mut patches);
        let unknown = self.unknown(&patches);
        if reshaped {
            // A contact that becomes longer is placed at once: at a first estimate of its ends it may pull.
            let mut moved = patches.clone();
            if unknown.is_empty() || !self.try_place(rod, &mut moved, &unknown, bound) {
                self.arrange(rod, &patches, Vec::new());
            }
            return Ok(true);
        }
        if unknown.is_empty() {
            if !self.misses_node(rod, &patches) {
                return Ok(false);
            }
            self.arrange(rod, &patches, Vec::new());
            return Ok(true);
        }
        self.arrange(rod, &patches, Vec::new());
        self.frozen = true;
        let result = self.place(rod, &mut patches, &unknown, bound);
        self.frozen = false;
        result?;
        // The equilibrium at the new places may be blocked elsewhere or pull.
        let before = patches;
        self.find(rod, bound)?;
        let changed = self.patches(rod, touching);
        let same = changed.len() == before.len()
            && changed.iter().zip(&before).all(|(a, b)| {
                a.obstacle == b.obstacle && (a.from - b.from).abs() + (a.to - b.to).abs() < 1e-7 * self.length
            });
        let pulls =
            self.sites.iter().any(|site| site.touch.is_some_and(|touch| touch.push < -1e-13 * self.force_scale()));
        let mut again = before.clone();
        Ok(!same || pulls || self.reshape(rod, &mut again))
    }

    /// Corrects places in few iterations. Returns whether it succeeds; otherwise the rod and its contacts are those
    /// before.
    fn try_place(&mut self, rod: &mut Rod, patches: &mut [Patch], unknown: &[(usize, bool)], bound: usize) -> bool {
        let kept = (rod.clone(), self.sites.clone(), self.frames.clone(), self.system.joints.clone());
        self.arrange(rod, patches, Vec::new());
        self.frozen = true;
        let placed = self.place(rod, patches, unknown, bound.min(FOLLOWING)).is_ok();
        self.frozen = false;
        if !placed {
            (*rod, self.sites, self.frames, self.system.joints) = kept;
            self.renew_force(rod);
            self.locate(rod);
        }
        placed
    }

    /// Newton's method for the places, with secant updates.
    pub(super) fn place(
        &mut self,
        rod: &mut Rod,
        patches: &mut [Patch],
        unknown: &[(usize, bool)],
        bound: usize,
    ) -> Result<(), EquilibriumError> {
        self.find(rod, bound)?;
        let mut value = self.misplacement(rod, patches, unknown);
        // Well placed contacts are not moved. Other nodes would change its shape by the interpolation error,
        // which contacts that stick would resist with large forces.
        if value.amax() <= WELL_PLACED {
            return Ok(());
        }
        let mut jacobian: Option<DMatrix<f64>> = None;
        for _ in 0..CORRECTIONS {
            if jacobian.is_none() {
                let step = DIFFERENCE * self.length;
                let mut matrix = DMatrix::zeros(unknown.len(), unknown.len());
                for (k, at) in unknown.iter().enumerate() {
                    let (kept, sites) = (rod.clone(), self.sites.clone());
                    let frames = (self.frames.clone(), self.system.joints.clone());
                    let mut moved = patches.to_vec();
                    shift(&mut moved, &[*at], &DVector::from_element(1, -step));
                    self.arrange(rod, &moved, Vec::new());
                    self.find_to(rod, bound, ESTIMATE)?;
                    let change = (&value - self.misplacement(rod, &moved, unknown)) / step;
                    matrix.set_column(k, &change);
                    *rod = kept;
                    self.sites = sites;
                    (self.frames, self.system.joints) = frames;
                    self.renew_force(rod);
                }
                jacobian = Some(matrix);
            }
            let Some(matrix) = &mut jacobian else { break };
            let Some(mut step) = matrix.clone().lu().solve(&-&value) else {
                return Err(self.contacts_not_found(value.amax()));
            };
            let longest = step.amax();
            let allowed = 0.2 * self.length / self.parent.elements() as f64;
            if longest > allowed {
                step *= allowed / longest;
            }
            let mut moved = patches.to_vec();
            shift(&mut moved, unknown, &step);
            // The length of a short free end is a double root of its condition.
            let reach = SHORT_END * self.length / self.parent.elements() as f64;
            for (patch, before) in moved.iter_mut().zip(patches.iter()) {
                let longer = patch.to > before.to && patch.to - patch.from > reach / SHORT_END;
                if longer && patch.to > self.length - reach && before.to < self.length * (1.0 - SAME) {
                    patch.to = self.length.next_up();
                }
            }
            if moved.iter().any(|patch| patch.from > patch.to || patch.to > self.length || patch.from < 0.0) {
                // A contact ends or reaches the base or the apex.
                for patch in &mut moved {
                    patch.to = patch.to.min(self.length);
                    patch.from = patch.from.clamp(0.0, self.length);
                    if patch.from > patch.to {
                        let middle = 0.5 * (patch.from + patch.to);
                        (patch.from, patch.to) = (middle, middle);
                    }
                }
                self.arrange(rod, &moved, Vec::new());
                return self.find(rod, bound);
            }
            self.arrange(rod, &moved, Vec::new());
            self.find_to(rod, bound, EARLY * longest / self.length)?;
            let new = self.misplacement(rod, &moved, unknown);
            patches.copy_from_slice(&moved);
            let difference = &new - &value;
            // Broyden's update.
            let lacking = &difference - &*matrix * &step;
            let square = step.norm_squared();
            if square > 0.0 {
                *matrix += lacking * step.transpose() / square;
            }
            value = new;
            if longest <= PLACED * self.length {
                return Ok(());
            }
        }
        Err(self.contacts_not_found(value.amax()))
    }

    /// Newton's iteration with a tolerance (rad) that is at least that of the result.
    fn find_to(&mut self, rod: &mut Rod, bound: usize, tolerance: f64) -> Result<(), EquilibriumError> {
        let own = self.tolerance;
        self.tolerance = own.max(tolerance);
        let result = self.find(rod, bound);
        self.tolerance = own;
        result
    }

    /// Gives the rod nodes at the ends of patches, and contacts at all stations in them.
    pub(super) fn arrange(&mut self, rod: &mut Rod, patches: &[Patch], mut old: Vec<OldTouch>) {
        let present: Vec<OldTouch> = self
            .sites
            .iter()
            .filter_map(|site| Some((site, site.touch?)))
            .map(|(site, touch)| OldTouch {
                obstacle: touch.obstacle,
                arc_length: self.place_of(rod, (site.element, site.x)).arc_length,
                push: touch.push,
                force: touch.gap.normal * touch.push + touch.friction.map_or(Vector3::zeros(), |at| at.force),
                slid: touch.friction.is_some_and(|at| at.slid),
            })
            .collect();
        // The tangential forces at the end of the increment before, at the contacts that the rod had then.
        let earlier: Vec<(usize, f64, Vector3<f64>, bool)> = if old.is_empty() {
            let touching = self.sites.iter().filter_map(|site| Some((site, site.touch?)));
            touching
                .map(|(site, touch)| {
                    let s = self.place_of(rod, (site.element, site.x)).arc_length;
                    let (force, slid) = touch.friction.map_or((Vector3::zeros(), false), |at| (at.earlier, at.slid));
                    (touch.obstacle, s, force, slid)
                })
                .collect()
        } else {
            old.iter().map(|at| (at.obstacle, at.arc_length, at.force, at.slid)).collect()
        };
        let sticking: Vec<(usize, f64, Friction)> = self
            .sites
            .iter()
            .filter_map(|site| Some((site, site.touch?)))
            .filter_map(|(site, touch)| {
                let (s, friction) = (self.place_of(rod, (site.element, site.x)).arc_length, touch.friction?);
                Some((touch.obstacle, s, friction))
            })
            .collect();
        old.extend(present);
        let source = rod.clone();
        let held: Vec<f64> =
            self.sites.iter().map(|site| self.place_of(rod, (site.element, site.x)).arc_length).collect();
        let nodes: Vec<f64> = rod.centre_line().iter().map(|(s, _)| *s).collect();
        let frames: Vec<f64> = self.frames.iter().map(|frame| nodes[frame.node]).collect();
        let joints: Vec<f64> = self.system.joints.nodes().map(|node| nodes[node]).collect();
        *rod = self.parent.with_nodes(&self.cuts(patches), AT_NODE);
        rod.sample_shape(&source);
        let nodes: Vec<f64> = rod.centre_line().iter().map(|(s, _)| *s).collect();
        let margin = SAME * self.length;
        let node_at = |s: f64| nodes.iter().position(|node| (node - s).abs() <= margin);
        for (site, s) in self.sites.iter_mut().zip(held).filter(|(site, _)| site.touch.is_none()) {
            site.element = node_at(s).and_then(|node| node.checked_sub(1)).unwrap_or(site.element);
        }
        self.frames.iter_mut().zip(frames).for_each(|(frame, s)| frame.node = node_at(s).unwrap_or(frame.node));
        self.system.joints.set_nodes(joints.iter().map(|s| node_at(*s).unwrap_or(0)));
        self.sites.retain(|site| site.touch.is_none());
        self.renew_force(rod);
        let tangents: Vec<Vector3<f64>> =
            (0..rod.points().len()).map(|i| rod.frame_at_point(i / P, i % P) * Vector3::z()).collect();
        let stations = all_stations(rod, &tangents);
        for patch in patches {
            let push = |s: f64| {
                let near = old.iter().filter(|at| at.obstacle == patch.obstacle);
                let distance = |at: &OldTouch| (at.arc_length - s).abs();
                near.min_by(|a, b| distance(a).total_cmp(&distance(b))).map_or(0.0, |at| at.push)
            };
            let floats = patch.from == patch.to && patch.to < self.length * (1.0 - SAME) && !self.pinned;
            let mut ends = vec![patch.from];
            if patch.to > patch.from {
                ends.push(patch.to);
            }
            // An end close to a node has no station of its own. The base does not move.
            for s in ends.iter().filter(|s| **s > margin) {
                let covered = stations.iter().any(|place| (place.arc_length - s).abs() <= margin);
                if !covered && let Some((element, x)) = rod.locate(*s) {
                    self.sites.push(Site::touching(patch.obstacle, (element, x), push(*s), floats));
                }
            }
            for place in &stations {
                let inside = place.arc_length >= patch.from - margin && place.arc_length <= patch.to + margin;
                // Two stations next to each other would act as a couple.
                let close = AT_NODE * rod.length_of(place.element);
                let doubled = ends.iter().any(|s| {
                    let distance = (place.arc_length - s).abs();
                    distance > margin && distance <= 2.0 * close
                });
                if inside && !doubled {
                    let push = push(place.arc_length);
                    let at = (place.element, place.x);
                    self.sites.push(Site::touching(patch.obstacle, at, push, floats));
                }
            }
        }
        self.hand_over_friction(rod, &tangents, &earlier, &sticking);
    }

    /// Gives each contact with friction the state of the nearest contact with the same obstacle before.
    /// `earlier` are the tangential forces (N) at the end of the increment before and whether they slid, `sticking` the
    /// present states.
    fn hand_over_friction(
        &mut self,
        rod: &Rod,
        tangents: &[Vector3<f64>],
        earlier: &[(usize, f64, Vector3<f64>, bool)],
        sticking: &[(usize, f64, Friction)],
    ) {
        let places: Vec<f64> =
            self.sites.iter().map(|site| place_along(rod, tangents, (site.element, site.x)).arc_length).collect();
        for (site, s) in self.sites.iter_mut().zip(places) {
            let Some(touch) = &mut site.touch else { continue };
            let coefficient = self.obstacles.contacts[touch.obstacle].friction;
            if coefficient == 0.0 {
                continue;
            }
            let mut friction = Friction::new(coefficient);
            let near = earlier.iter().filter(|(obstacle, ..)| *obstacle == touch.obstacle);
            let nearest = near.min_by(|a, b| (a.1 - s).abs().total_cmp(&(b.1 - s).abs()));
            (friction.earlier, friction.slid) = nearest.map_or((Vector3::zeros(), false), |at| (at.2, at.3));
            friction.force = friction.earlier;
            let near = sticking.iter().filter(|(obstacle, ..)| *obstacle == touch.obstacle);
            if let Some((.., old)) = near.min_by(|a, b| (a.1 - s).abs().total_cmp(&(b.1 - s).abs())) {
                (friction.sticks, friction.direction) = (old.sticks, old.direction);
                (friction.last_slip, friction.changes) = (old.last_slip, old.changes);
            }
            touch.friction = Some(friction);
        }
    }
}

/// Moves the ends of patches; both ends of a contact at a point.
fn shift(patches: &mut [Patch], unknown: &[(usize, bool)], by: &DVector<f64>) {
    for ((i, end), by) in unknown.iter().zip(by.iter()) {
        let patch = &mut patches[*i];
        let point = patch.from == patch.to;
        if *end || point {
            patch.to += by;
        }
        if !*end || point {
            patch.from += by;
        }
    }
}

/// The place at coordinate `x` of an element, for given tangents.
pub(super) fn place_along(rod: &Rod, tangents: &[Vector3<f64>], (element, x): (usize, f64)) -> Place {
    let (mut start, mut from) = (0.0, Vector3::zeros());
    for e in 0..element {
        let end = place(rod, tangents, (e, 1.0), start, &from);
        (start, from) = (end.arc_length, end.position);
    }
    place(rod, tangents, (element, x), start, &from)
}
