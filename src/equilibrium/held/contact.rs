//! The contacts of a rod: where steps are blocked, which places are released, and where contacts begin and end.

use nalgebra::{DMatrix, DVector, Vector3};

use super::friction::OldTouch;
use super::search::HeldSearch;
use super::sites::{Friction, Site};
use super::touch::{CLEAR, Penetration, Place, all_stations, penetrations, place};
use crate::constitutive::{Constitutive, Tissue, strain_under};
use crate::equilibrium::EquilibriumError;
use crate::load::Load;
use crate::rod::Rod;
use crate::support::Patch;

/// Number of changes of the contacts in one search.
const CHANGES: usize = 30;
/// Number of changes after which smaller penetrations and slopes at contacts are accepted.
const PATIENCE: i32 = 8;
/// Largest factor by which these are larger then.
const LARGEST_LENIENCY: f64 = 1e3;
/// Number of corrections of the places of contacts.
const CORRECTIONS: usize = 30;
/// Distance of two places that are one, relative to the length.
const SAME: f64 = 1e-9;
/// Distance of a contact from a node, relative to the element, below which the element is not divided.
const AT_NODE: f64 = 1e-4;
/// Largest gap, relative to an element, between two contacts that are one at first. Contacts that the elements do not
/// resolve yet alternate with small gaps.
const TOUCHING: f64 = 1e-4;
/// Displacement of a contact that estimates derivatives, relative to the length.
const DIFFERENCE: f64 = 1e-6;
/// Largest distance of a contact at a point from its node, relative to the length. The error of the shape is
/// proportional to its square.
const PLACED_NODE: f64 = 1e-6;
/// Largest slope of a rod against an obstacle at a contact that is tangential.
const TANGENTIAL: f64 = 1e-5;
/// Largest error of the place of a contact, relative to the length.
const PLACED: f64 = 1e-11;

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Whether the rod may touch obstacles in a step.
    pub(super) fn approaches(&self) -> bool {
        !self.frozen && !self.obstacles.contacts.is_empty()
    }

    /// The arc lengths of the contacts, with their obstacles.
    fn touches(&self, rod: &Rod) -> Vec<(usize, f64)> {
        let touching = self.sites.iter().filter_map(|site| Some((site, site.touch?)));
        touching.map(|(site, touch)| (touch.obstacle, self.place_of(rod, (site.element, site.x)).arc_length)).collect()
    }

    pub(super) fn place_of(&self, rod: &Rod, at: (usize, f64)) -> Place {
        place_along(rod, &self.tangents, at)
    }

    /// The places at which the rod penetrates obstacles.
    pub(super) fn penetrations(&self, rod: &Rod) -> Vec<Penetration> {
        penetrations(rod, &self.tangents, &self.obstacles, &self.touches(rod), (self.length, CLEAR * self.leniency))
    }

    /// Adds contacts where the rod penetrates obstacles: at the deepest place, and at all stations beside a contact.
    /// Unless `strict`, a contact that slides to the place of least gap is left alone. Returns whether there is a new
    /// one.
    pub(super) fn touch(&mut self, rod: &Rod, penetrations: &[Penetration], strict: bool) -> bool {
        let number = self.sites.len();
        let margin = SAME * self.length;
        for Penetration { obstacle, stations, deepest, between } in penetrations {
            let places: Vec<f64> =
                self.sites.iter().map(|site| self.place_of(rod, (site.element, site.x)).arc_length).collect();
            let near = |s: f64| s >= between.0 - margin && s <= between.1 + margin;
            let (deep, reach) = (self.place_of(rod, *deepest).arc_length, self.length / self.parent.elements() as f64);
            let slides = self.sites.iter().zip(&places).any(|(site, s)| {
                let close = near(*s) || (s - deep).abs() < reach;
                let touch = site.touch.filter(|touch| touch.obstacle == *obstacle && close);
                touch.is_some_and(|touch| touch.floats && touch.approach.1 > 0.0)
            });
            if slides && !strict {
                continue;
            }
            let mut beside = false;
            for (site, s) in self.sites.iter_mut().zip(&places) {
                if let Some(touch) = &mut site.touch
                    && touch.obstacle == *obstacle
                    && near(*s)
                {
                    beside = true;
                    touch.floats = false;
                }
            }
            if beside && !stations.is_empty() {
                let new = stations.iter().map(|at| Site::touching(*obstacle, *at, 0.0, false));
                self.sites.extend(new);
            } else {
                let at_apex = deepest.0 + 1 == rod.elements() && deepest.1 >= 1.0;
                self.sites.push(Site::touching(*obstacle, *deepest, 0.0, !at_apex));
            }
        }
        self.sites.len() > number
    }

    /// Keeps a contact at the apex if the gap would be less beyond it, and lets it slide otherwise.
    pub(super) fn settle_apex(&mut self, rod: &Rod) {
        for site in self.sites.iter_mut().filter(|site| site.element + 1 == rod.elements() && site.x >= 1.0) {
            if let Some(touch) = &mut site.touch {
                let (slope, bend) = touch.approach;
                touch.floats = slope > 0.0 && bend > 0.0;
            }
        }
    }

    /// Merges contacts that have slid to the same place, and removes those at the base, which does not move.
    pub(super) fn merge_sites(&mut self, rod: &Rod) {
        let mut kept: Vec<(usize, f64, usize)> = Vec::new();
        let mut i = 0;
        while i < self.sites.len() {
            let site = &self.sites[i];
            let Some(touch) = site.touch else {
                i += 1;
                continue;
            };
            let s = self.place_of(rod, (site.element, site.x)).arc_length;
            let margin = SAME * self.length;
            if s <= margin {
                self.sites.remove(i);
                continue;
            }
            let same = kept.iter().find(|(obstacle, at, _)| *obstacle == touch.obstacle && (at - s).abs() <= margin);
            if let Some((.., first)) = same
                && let Some(first) = &mut self.sites[*first].touch
            {
                first.push += touch.push;
                self.sites.remove(i);
            } else {
                kept.push((touch.obstacle, s, i));
                i += 1;
            }
        }
    }

    /// Computes the load of a rod with new elements.
    fn renew_force(&mut self, rod: &Rod) {
        let environment = *self.force.environment();
        self.force.update(rod, self.load, &environment);
    }

    /// Finds an equilibrium with its contacts: contacts that pull are released, and their places are corrected.
    pub(super) fn settle(&mut self, rod: &mut Rod, bound: usize) -> Result<(), EquilibriumError> {
        let mut touching = TOUCHING * self.length / self.parent.elements() as f64;
        for change in 0..CHANGES {
            // Contacts with almost no force may be lost and found again in turn.
            self.leniency = 10.0_f64.powi(change as i32 - PATIENCE).clamp(1.0, LARGEST_LENIENCY);
            self.find(rod, bound)?;
            if !self.obstacles.contacts.is_empty() {
                let penetrations = self.penetrations(rod);
                if self.touch(rod, &penetrations, true) {
                    continue;
                }
            }
            if self.correct(rod, bound, touching)? {
                touching = (0.1 * touching).max(SAME * self.length);
                continue;
            }
            return Ok(());
        }
        Err(self.not_found(f64::NAN))
    }

    /// The patches in contact, in order of obstacle and arc length. Two contacts are in one patch if no free station
    /// is between them.
    pub(super) fn patches(&self, rod: &Rod, touching: f64) -> Vec<Patch> {
        let touching_sites = self.sites.iter().filter_map(|site| Some((site, site.touch?)));
        let mut touches: Vec<(usize, f64, f64)> = touching_sites
            .map(|(site, touch)| (touch.obstacle, self.place_of(rod, (site.element, site.x)).arc_length, touch.push))
            .collect();
        touches.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let all = all_stations(rod, &self.tangents);
        let free = |obstacle: usize, from: f64, to: f64| {
            all.iter().any(|place| {
                let between = place.arc_length > from && place.arc_length < to;
                between && self.obstacles.gap(obstacle, &place.position).value > touching
            })
        };
        let mut patches: Vec<(Patch, Vec<(f64, f64)>)> = Vec::new();
        for (obstacle, s, push) in touches {
            let joins = patches.last().is_some_and(|(patch, _)| {
                let margin = SAME * self.length;
                patch.obstacle == obstacle && !free(obstacle, patch.to + margin, s - margin)
            });
            match patches.last_mut() {
                Some((patch, pushes)) if joins => {
                    patch.to = s;
                    pushes.push((s, push));
                }
                _ => patches.push((Patch { obstacle, from: s, to: s }, vec![(s, push)])),
            }
        }
        // Two neighbouring stations carry the force of a contact at a point between them.
        let resolved = |(mut patch, pushes): (Patch, Vec<(f64, f64)>)| {
            if let [(a, p), (b, q)] = pushes[..]
                && p + q > 0.0
            {
                patch.from = (a * p + b * q) / (p + q);
                patch.to = patch.from;
            }
            patch
        };
        let mut patches: Vec<Patch> = patches.into_iter().map(resolved).collect();
        let first = all.first().map_or(0.0, |place| place.arc_length);
        for patch in patches.iter_mut().filter(|patch| patch.to > patch.from && patch.from <= first * (1.0 + SAME)) {
            // A contact along the first element may begin at the base.
            if self.obstacles.gap(patch.obstacle, &Vector3::zeros()).value <= touching {
                patch.from = 0.0;
            }
        }
        patches
    }

    /// The places that are unknown in a list of patches: index of the patch, and whether it is its end.
    fn unknown(&self, patches: &[Patch]) -> Vec<(usize, bool)> {
        let inside = |s: f64| s < self.length * (1.0 - SAME);
        let mut unknown = Vec::new();
        for (i, patch) in patches.iter().enumerate() {
            if patch.to > patch.from && patch.from > SAME * self.length && inside(patch.from) {
                unknown.push((i, false));
            }
            if patch.to > patch.from && inside(patch.to) {
                unknown.push((i, true));
            }
        }
        unknown
    }

    /// The violation of the condition at each unknown place: a contact at a point is tangential, and at the end of a
    /// longer contact the curvature of the rod is that of the obstacle (times the length).
    fn misplacement(&self, rod: &Rod, patches: &[Patch], unknown: &[(usize, bool)]) -> DVector<f64> {
        DVector::from_iterator(
            unknown.len(),
            unknown.iter().map(|(i, end)| {
                let patch = &patches[*i];
                let s = if *end { patch.to } else { patch.from };
                let (slope, bend) = self.approach(rod, patch.obstacle, s);
                let _ = slope;
                bend * self.length
            }),
        )
    }

    /// First (1) and second (1/m) derivative of the gap along the rod at an arc length (m).
    fn approach(&self, rod: &Rod, obstacle: usize, s: f64) -> (f64, f64) {
        let Some((e, x)) = rod.locate(s) else { return (f64::NAN, f64::NAN) };
        let position = self.place_of(rod, (e, x)).position;
        let gap = self.obstacles.gap(obstacle, &position);
        let (frame, point) = (rod.frame_within(e, x), rod.point_within(e, x));
        // The couple at the place, integrated from the apex.
        let mut couple: Vector3<f64> = self.couples_beyond(rod, e, x);
        let force = |i: usize| self.force.at_points()[i];
        for i in (e + 1) * P..rod.points().len() {
            let weight = rod.reference().weights[i % P] * rod.points()[i].jacobian;
            couple += self.tangents[i].cross(&force(i)) * weight;
        }
        let reference = rod.reference();
        let upto = if x < 1.0 { reference.integral_upto(x) } else { [0.0; crate::reference_element::MAX_POINTS] };
        for g in 0..P {
            let i = e * P + g;
            let part = if x < 1.0 { (reference.weights[g] - upto[g]) * rod.points()[i].jacobian } else { 0.0 };
            couple += self.tangents[i].cross(&force(i)) * part;
        }
        let near = rod.strain_within(e, x) - point.intrinsic;
        let tissue = Tissue::of(&point, self.force.environment().time);
        let local = frame.inverse_transform_vector(&couple);
        let strain = point.intrinsic + strain_under(self.material, &tissue, &near, &local);
        let tangent = frame * Vector3::z();
        let bend = frame * strain.cross(&Vector3::z());
        (gap.normal.dot(&tangent), gap.normal.dot(&bend) + tangent.dot(&(gap.curvature * tangent)))
    }

    /// The couples of held frames beyond a place, N m.
    fn couples_beyond(&self, rod: &Rod, e: usize, x: f64) -> Vector3<f64> {
        let joints = &self.system.joints;
        let each = joints.confined.iter().zip(&joints.held);
        let beyond = each.filter(|((node, _), _)| *node > e + usize::from(x >= 1.0));
        beyond.map(|((node, _), held)| rod.frames()[*node] * -held).sum()
    }

    /// Corrects the places of contacts. Returns whether the contacts have changed otherwise.
    fn correct(&mut self, rod: &mut Rod, bound: usize, touching: f64) -> Result<bool, EquilibriumError> {
        let mut patches = self.patches(rod, touching);
        if patches.is_empty() {
            return Ok(false);
        }
        if self.reshape(rod, &mut patches) {
            self.arrange(rod, &patches, Vec::new());
            return Ok(true);
        }
        let unknown = self.unknown(&patches);
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

    /// Whether a contact at a point is inside an element or not tangential, or the rod has nodes of contacts that have moved.
    fn misses_node(&self, rod: &Rod, patches: &[Patch]) -> bool {
        let misses = patches.iter().any(|patch| {
            rod.locate(patch.from).is_some_and(|(e, x)| {
                let distance = x.min(1.0 - x) * rod.length_of(e);
                distance > (PLACED_NODE * self.length).max(2.0 * AT_NODE * rod.length_of(e))
            })
        });
        let slides = |patch: &Patch| {
            let (slope, bend) = self.approach(rod, patch.obstacle, patch.from);
            patch.from == patch.to
                && patch.to < self.length * (1.0 - SAME)
                && bend > 0.0
                && slope.abs() > TANGENTIAL * self.leniency
        };
        misses || patches.iter().any(slides) || rod.elements() > self.parent.elements() + patches.len()
    }

    /// Newton's method for the places, with secant updates.
    fn place(
        &mut self,
        rod: &mut Rod,
        patches: &mut [Patch],
        unknown: &[(usize, bool)],
        bound: usize,
    ) -> Result<(), EquilibriumError> {
        self.find(rod, bound)?;
        let mut value = self.misplacement(rod, patches, unknown);
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
                    self.find(rod, bound)?;
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
            let Some(mut step) = matrix.clone().lu().solve(&-&value) else { return Err(self.not_found(f64::NAN)) };
            let longest = step.amax();
            let allowed = 0.2 * self.length / self.parent.elements() as f64;
            if longest > allowed {
                step *= allowed / longest;
            }
            let mut moved = patches.to_vec();
            shift(&mut moved, unknown, &step);
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
            self.find(rod, bound)?;
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
        Err(self.not_found(value.amax()))
    }

    /// Changes the kind of patches: a contact at the apex that is not pressed there becomes one at a point before it,
    /// and a point where the rod is more curved than the obstacle becomes a longer contact.
    fn reshape(&self, rod: &Rod, patches: &mut [Patch]) -> bool {
        let mut changed = false;
        let reach = self.length / self.parent.elements() as f64;
        for patch in patches {
            let (slope, bend) = self.approach(rod, patch.obstacle, patch.from);
            let point = patch.from == patch.to;
            let at_apex = patch.to >= self.length * (1.0 - SAME);
            if point && at_apex && slope > 1e-9 {
                patch.from -= 0.05 * reach;
                patch.to = if bend < 0.0 { self.length } else { patch.from };
                changed = true;
            } else if point && !at_apex && bend < 0.0 && slope.abs() > TANGENTIAL {
                // The gap is less on one side.
                patch.from = (patch.from - 0.25 * reach * slope.signum()).clamp(SAME * self.length, self.length);
                patch.to = patch.from;
                changed = true;
            } else if point && !at_apex && bend * self.length < -1e-6 && slope.abs() < TANGENTIAL {
                patch.from -= 0.05 * reach;
                patch.to = (patch.to + 0.05 * reach).min(self.length);
                changed = true;
            }
        }
        changed
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
            })
            .collect();
        // The tangential forces at the end of the increment before, at the contacts that the rod had then.
        let earlier: Vec<(usize, f64, Vector3<f64>)> = if old.is_empty() {
            let touching = self.sites.iter().filter_map(|site| Some((site, site.touch?)));
            touching
                .map(|(site, touch)| {
                    let s = self.place_of(rod, (site.element, site.x)).arc_length;
                    (touch.obstacle, s, touch.friction.map_or(Vector3::zeros(), |at| at.earlier))
                })
                .collect()
        } else {
            old.iter().map(|at| (at.obstacle, at.arc_length, at.force)).collect()
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
        let mut cuts: Vec<f64> = patches.iter().flat_map(|patch| [patch.from, patch.to]).collect();
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|a, b| *a - *b <= SAME * self.length);
        *rod = self.parent.with_nodes(&cuts, AT_NODE);
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
            let mut ends = vec![patch.from];
            if patch.to > patch.from {
                ends.push(patch.to);
            }
            // An end close to a node has no station of its own. The base does not move.
            for s in ends.iter().filter(|s| **s > margin) {
                let covered = stations.iter().any(|place| (place.arc_length - s).abs() <= margin);
                if !covered && let Some((element, x)) = rod.locate(*s) {
                    let floats = patch.from == patch.to && patch.to < self.length * (1.0 - SAME);
                    self.sites.push(Site::touching(patch.obstacle, (element, x), push(*s), floats));
                }
            }
            for place in &stations {
                let inside = place.arc_length >= patch.from - margin && place.arc_length <= patch.to + margin;
                if inside {
                    let push = push(place.arc_length);
                    let floats = patch.from == patch.to && patch.to < self.length * (1.0 - SAME);
                    let at = (place.element, place.x);
                    self.sites.push(Site::touching(patch.obstacle, at, push, floats));
                }
            }
        }
        let places: Vec<f64> =
            self.sites.iter().map(|site| place_along(rod, &tangents, (site.element, site.x)).arc_length).collect();
        for (site, s) in self.sites.iter_mut().zip(places) {
            let Some(touch) = &mut site.touch else { continue };
            let coefficient = self.obstacles.contacts[touch.obstacle].friction;
            if coefficient == 0.0 {
                continue;
            }
            let mut friction = Friction::new(coefficient);
            let near = earlier.iter().filter(|(obstacle, ..)| *obstacle == touch.obstacle);
            let nearest = near.min_by(|a, b| (a.1 - s).abs().total_cmp(&(b.1 - s).abs()));
            friction.earlier = nearest.map_or(Vector3::zeros(), |(.., force)| *force);
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
fn place_along(rod: &Rod, tangents: &[Vector3<f64>], (element, x): (usize, f64)) -> Place {
    let (mut start, mut from) = (0.0, Vector3::zeros());
    for e in 0..element {
        let end = place(rod, tangents, (e, 1.0), start, &from);
        (start, from) = (end.arc_length, end.position);
    }
    place(rod, tangents, (element, x), start, &from)
}
