//! The parts of a rod in contact with obstacles, and the conditions at their ends.

use nalgebra::{DVector, Vector3};

use super::data::HeldSearch;
use super::sites::Site;
use super::touch::{SAME, all_stations};
use crate::constitutive::{Constitutive, Tissue, strain_under};
use crate::load::Load;
use crate::rod::Rod;
use crate::support::Patch;

/// Distance of a contact from a node, relative to the element, below which the element is not divided.
pub(super) const AT_NODE: f64 = 1e-4;
/// Largest distance of a contact at a point from its node, relative to the length. The error of the shape is
/// proportional to its square.
const PLACED_NODE: f64 = 1e-6;
/// Largest slope of a rod against an obstacle at a contact that is tangential.
const TANGENTIAL: f64 = 1e-5;

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
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
    pub(super) fn unknown(&self, patches: &[Patch]) -> Vec<(usize, bool)> {
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

    /// The contacts at points that do not slide, since the rod is more curved than the obstacle, and are not
    /// tangential.
    pub(super) fn skew(&self, rod: &Rod, patches: &[Patch]) -> Vec<(usize, bool)> {
        let skew = |patch: &Patch| {
            let (slope, bend) = self.approach(rod, patch.obstacle, patch.from);
            patch.from == patch.to && patch.to < self.length * (1.0 - SAME) && bend < 0.0 && slope.abs() > TANGENTIAL
        };
        (0..patches.len()).filter(|i| skew(&patches[*i])).map(|i| (i, false)).collect()
    }

    /// The violation of the condition at each unknown place: a contact at a point is tangential, and at the end of a
    /// longer contact the curvature of the rod is that of the obstacle (times the length).
    pub(super) fn misplacement(&self, rod: &Rod, patches: &[Patch], unknown: &[(usize, bool)]) -> DVector<f64> {
        DVector::from_iterator(
            unknown.len(),
            unknown.iter().map(|(i, end)| {
                let patch = &patches[*i];
                let s = if *end { patch.to } else { patch.from };
                let (slope, bend) = self.approach(rod, patch.obstacle, s);
                if patch.from == patch.to { slope } else { bend * self.length }
            }),
        )
    }

    /// First (1) and second (1/m) derivative of the gap along the rod at an arc length (m).
    pub(super) fn approach(&self, rod: &Rod, obstacle: usize, s: f64) -> (f64, f64) {
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
    pub(super) fn couples_beyond(&self, rod: &Rod, e: usize, x: f64) -> Vector3<f64> {
        let joints = &self.system.joints;
        let each = joints.confined.iter().zip(&joints.held);
        let beyond = each.filter(|((node, _), _)| *node > e + usize::from(x >= 1.0));
        beyond.map(|((node, _), held)| rod.frames()[*node] * -held).sum()
    }

    /// Whether a contact at a point is inside an element or not tangential, or the rod has nodes of contacts that
    /// have moved.
    pub(super) fn misses_node(&self, rod: &Rod, patches: &[Patch]) -> bool {
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
        misses || patches.iter().any(slides) || rod.elements() > self.parent.elements() + self.cuts(patches).len()
    }

    /// The arc lengths (m) of the nodes that patches add: their ends, and places beside them that resolve the layer in
    /// which the rod bends from the obstacle.
    pub(super) fn cuts(&self, patches: &[Patch]) -> Vec<f64> {
        let mut cuts = Vec::new();
        let longest = self.length / self.parent.elements() as f64;
        for patch in patches {
            cuts.extend([patch.from, patch.to]);
            let mut distance = self.layer.max(SAME * self.length);
            while distance < 0.7 * longest {
                cuts.extend([patch.from - distance, patch.to + distance]);
                distance *= 3.0;
            }
        }
        cuts.retain(|s| *s >= 0.0 && *s <= self.length);
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|a, b| *a - *b <= SAME * self.length);
        cuts
    }

    /// The length √(B/n) over which the rod bends beside a contact, m, for the largest force n (N) between given
    /// reactions in their order along the rod. It is rounded to a power of two, so that the nodes do not move with each
    /// change of the force.
    pub(super) fn bending_length(&self, rod: &Rod, reactions: &[Vector3<f64>]) -> f64 {
        let time = self.force.environment().time;
        let stiffness = |point| self.material.respond(&Tissue::of(point, time), &Vector3::zeros()).tangent;
        let bending = rod.points().iter().map(stiffness).map(|k| k[(0, 0)].min(k[(1, 1)]));
        let mut force = self.force.load_at_base() + reactions.iter().sum::<Vector3<f64>>();
        let mut largest = force.norm();
        for reaction in reactions {
            force -= reaction;
            largest = largest.max(force.norm());
        }
        let length = (bending.fold(f64::INFINITY, f64::min) / largest).sqrt();
        length.log2().round().exp2()
    }

    /// The forces of all sites in their order along the rod, N.
    pub(super) fn forces_along(&self) -> Vec<Vector3<f64>> {
        let force = |site: &Site| (site.element as f64 + site.x, site.force + site.spring_force());
        let mut all: Vec<_> = self.sites.iter().map(force).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.into_iter().map(|(_, force)| force).collect()
    }

    /// Changes the kind of patches: a contact at the apex that is not pressed there becomes one at a point before it,
    /// and a point where the rod is more curved than the obstacle becomes a longer contact.
    pub(super) fn reshape(&self, rod: &Rod, patches: &mut [Patch]) -> bool {
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
}
