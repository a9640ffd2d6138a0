//! The nodes and sites of given contacts.

use nalgebra::Vector3;

use super::before::OldTouch;
use super::data::HeldSearch;
use super::patches::AT_NODE;
use super::sites::{Friction, Site};
use super::touch::{Place, SAME, all_stations, place};
use crate::constitutive::Constitutive;
use crate::load::Load;
use crate::rod::Rod;
use crate::support::Patch;

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Gives the rod nodes at the ends of patches, and contacts at all stations in them, with the present forces.
    pub(super) fn arrange(&mut self, rod: &mut Rod, patches: &[Patch]) {
        let present = self.present_touches(rod);
        self.arrange_with(rod, patches, &present);
    }

    /// The present contacts with their forces.
    pub(super) fn present_touches(&self, rod: &Rod) -> Vec<OldTouch> {
        let touching = self.sites.iter().filter_map(|site| Some((site, site.touch?)));
        let old = touching.map(|(site, touch)| OldTouch {
            obstacle: touch.obstacle,
            arc_length: self.place_of(rod, (site.element, site.x)).arc_length,
            push: touch.push,
            friction: touch.friction,
        });
        old.collect()
    }

    /// Gives the rod nodes at the ends of patches, and contacts at all stations in them. Each takes the forces of the
    /// nearest one of `old`.
    pub(super) fn arrange_with(&mut self, rod: &mut Rod, patches: &[Patch], old: &[OldTouch]) {
        self.divide(rod, patches);
        self.renew_force(rod);
        let tangents: Vec<Vector3<f64>> =
            (0..rod.points().len()).map(|i| rod.frame_at_point(i / P, i % P) * Vector3::z()).collect();
        let stations = all_stations(rod, &tangents);
        for patch in patches {
            let new = self.contacts_of(rod, patch, &stations);
            for (arc_length, mut site) in new {
                if let Some(touch) = &mut site.touch {
                    touch.push = nearest(old.iter(), touch.obstacle, arc_length).map_or(0.0, |at| at.push);
                    let rubbing = old.iter().filter(|at| at.friction.is_some());
                    touch.friction = match self.obstacles.contacts[touch.obstacle].friction {
                        0.0 => None,
                        coefficient => nearest(rubbing, touch.obstacle, arc_length)
                            .and_then(|at| at.friction)
                            .map(|friction| Friction { force: friction.earlier, ..friction })
                            .or_else(|| Some(Friction::new(coefficient))),
                    };
                }
                self.sites.push(site);
            }
        }
    }

    /// Gives the rod nodes at the ends of patches, and moves the sites and frames of holds to their nodes. The contacts
    /// are removed.
    fn divide(&mut self, rod: &mut Rod, patches: &[Patch]) {
        self.sites.retain(|site| site.touch.is_none());
        let source = rod.clone();
        let nodes: Vec<f64> = source.centre_line().iter().map(|(s, _)| *s).collect();
        *rod = self.parent.with_nodes(&self.cuts(patches), AT_NODE);
        rod.sample_shape(&source);
        let new: Vec<f64> = rod.centre_line().iter().map(|(s, _)| *s).collect();
        let margin = SAME * self.length;
        // Holds are at ends of elements of the parent, which are ends of elements of each rod.
        let moved = |node: usize| new.iter().position(|s| (s - nodes[node]).abs() <= margin).unwrap_or(node);
        for site in &mut self.sites {
            site.element = moved(site.element + 1).saturating_sub(1);
        }
        self.frames.iter_mut().for_each(|frame| frame.node = moved(frame.node));
        let joints: Vec<usize> = self.system.joints.nodes().map(moved).collect();
        self.system.joints.set_nodes(joints.into_iter());
    }

    /// Contacts at the ends of a patch and at all stations in it, without forces, and their arc lengths (m).
    fn contacts_of(&self, rod: &Rod, patch: &Patch, stations: &[Place]) -> Vec<(f64, Site)> {
        let margin = SAME * self.length;
        let floats = patch.from == patch.to && patch.to < self.length * (1.0 - SAME) && !self.pinned;
        let mut contacts = Vec::new();
        let mut ends = vec![patch.from];
        if patch.to > patch.from {
            ends.push(patch.to);
        }
        // An end close to a node has no station of its own. The base does not move.
        for s in ends.iter().filter(|s| **s > margin) {
            let covered = stations.iter().any(|place| (place.arc_length - s).abs() <= margin);
            if !covered && let Some(at) = rod.locate(*s) {
                contacts.push((*s, Site::touching(patch.obstacle, at, 0.0, floats)));
            }
        }
        for place in stations {
            let inside = place.arc_length >= patch.from - margin && place.arc_length <= patch.to + margin;
            // Two stations next to each other would act as a couple.
            let close = AT_NODE * rod.length_of(place.element);
            let doubled = ends.iter().any(|s| {
                let distance = (place.arc_length - s).abs();
                distance > margin && distance <= 2.0 * close
            });
            if inside && !doubled {
                contacts
                    .push((place.arc_length, Site::touching(patch.obstacle, (place.element, place.x), 0.0, floats)));
            }
        }
        contacts
    }
}

/// The contact with an obstacle that is nearest to an arc length (m).
pub(super) fn nearest<'b>(
    all: impl Iterator<Item = &'b OldTouch>,
    obstacle: usize,
    arc_length: f64,
) -> Option<&'b OldTouch> {
    let distance = |at: &OldTouch| (at.arc_length - arc_length).abs();
    all.filter(|at| at.obstacle == obstacle).min_by(|a, b| distance(a).total_cmp(&distance(b)))
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
