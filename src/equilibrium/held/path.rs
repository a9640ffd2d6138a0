//! The load path of a search: holds move in increments from their present places to the requested ones.

use nalgebra::Vector3;

use super::before::{Before, OldTouch};
use super::data::{Found, HeldSearch, HeldWorkspace};
use super::sites::{Friction, sort, turn_frames};
use super::touch::{Obstacles, all_stations};
use crate::constitutive::Constitutive;
use crate::equilibrium::system::System;
use crate::equilibrium::{Equilibrium, EquilibriumError};
use crate::error::ParameterError;
use crate::load::{InternalForce, Load};
use crate::rod::{Rod, Tissue};
use crate::support::{Patch, Reaction, Slip, Support};

/// Largest displacement of a hold in an increment, relative to the length of the rod.
const LARGEST_MOVE: f64 = 0.05;
/// Largest rotation of a held frame in an increment, rad.
const LARGEST_INCREMENT: f64 = 0.3;
/// Smallest increment, as a share of the motion of the holds.
const SMALLEST_SHARE: f64 = 1e-6;
/// Number of Newton iterations after which an increment is halved.
const ITERATIONS: usize = 400;

/// Displacement, relative to the length, by which the derivative of a distance is checked.
pub(super) const DISTANCE_STEP: f64 = 1e-6;
/// Largest error of this derivative, for example at an edge of an obstacle.
pub(super) const DISTANCE_ERROR: f64 = 1e-3;

impl<'a, C: Constitutive, L: Load, const P: usize> HeldSearch<'a, C, L, P> {
    pub fn new(
        (system, workspace): (&'a mut System, &'a mut HeldWorkspace),
        rod: &'a Rod,
        (material, load): (&'a C, &'a L),
        force: &'a mut InternalForce,
        support: &'a impl Support,
        (stable, tolerance): (bool, f64),
    ) -> Result<Self, EquilibriumError> {
        let time = force.environment().time;
        let contacts = support.contacts();
        let compliances = contacts.iter().map(|contact| contact.obstacle.compliance()).collect();
        let none = vec![Vector3::zeros(); contacts.len()];
        let (forces, step, yielded) = (none.clone(), none.clone(), none);
        let obstacles = Obstacles { contacts, compliances, forces, step, yielded, time };
        let (sites, frames, laws) = sort(rod, support, time, &mut system.joints)?;
        Ok(Self {
            system,
            border: &mut workspace.border,
            material,
            load,
            force,
            parent: rod,
            before: Before::new(rod, 0.0, obstacles.displacements(&[])),
            obstacles,
            tangents: Vec::new(),
            layer: f64::INFINITY,
            frozen: false,
            softened: false,
            pinned: false,
            stable,
            tolerance,
            length: rod.length(),
            sites,
            frames,
            laws,
            quick: false,
            weight: 0.0,
            boosts: Vec::new(),
            energy_scale: 0.0,
            leniency: 1.0,
            found: Equilibrium::default(),
            iteration_limit: usize::MAX,
            increments: 0,
            foundations: 0,
        })
    }

    /// Determines whether the search ends after its first failure, without increments and estimates of the contacts.
    pub fn end_early(&mut self, quick: bool) {
        self.quick = quick;
    }

    /// Sets the rod and its reactions at the end of the increment before, and the time since then (s).
    pub fn since(&mut self, (rod, time, reactions): (&'a Rod, f64, &[Reaction])) {
        self.before = Before::new(rod, time, self.obstacles.displacements(reactions));
    }

    /// Takes the forces of an earlier equilibrium as initial guess.
    pub fn guess_forces(&mut self, reactions: &[Reaction]) {
        for (site, reaction) in self.sites.iter_mut().zip(reactions.iter().filter(|at| at.obstacle.is_none())) {
            site.force = project(&site.fixed, &reaction.force);
            site.spring.iter_mut().for_each(|spring| spring.force = reaction.force);
        }
    }

    /// Takes the forces and contacts of an earlier equilibrium as initial guess.
    pub fn guess(&mut self, rod: &mut Rod, (reactions, patches): (&[Reaction], &[Patch]), shape: Option<&Rod>) {
        self.guess_forces(reactions);
        let forces = reactions.iter().filter_map(|reaction| Some((reaction.obstacle?, reaction.force)));
        self.obstacles.pull(self.obstacles.sums(forces));
        let number = self.obstacles.contacts.len();
        let mut inside: Vec<Patch> = patches.iter().filter(|patch| patch.obstacle < number).copied().collect();
        for patch in &mut inside {
            (patch.from, patch.to) = (patch.from.min(self.length), patch.to.min(self.length));
        }
        if !inside.is_empty() {
            self.locate(rod);
            let old = self.old_touches(reactions);
            self.force.react(rod, reactions);
            let mut along: Vec<&Reaction> = reactions.iter().collect();
            along.sort_by(|a, b| a.arc_length.total_cmp(&b.arc_length));
            let forces: Vec<Vector3<f64>> = along.iter().map(|reaction| reaction.force).collect();
            self.layer = self.bending_length(rod, &forces);
            self.arrange_with(rod, &inside, &old);
            // A rod without the nodes of contacts does not resolve their forces, so that its shape is a poor guess.
            if let Some(shape) = shape {
                let base = rod.frames()[0];
                rod.sample_shape(shape);
                if !self.system.joints.base_rotates {
                    rod.shape_mut().0[0] = base;
                    rod.chain_frames();
                }
            }
        }
    }

    /// The contacts of an earlier equilibrium. The end of a longer contact has two reactions.
    fn old_touches(&self, reactions: &[Reaction]) -> Vec<OldTouch> {
        let mut all: Vec<OldTouch> = Vec::new();
        for at in reactions {
            let Some((obstacle, contact)) = at.obstacle.and_then(|i| Some((i, self.obstacles.contacts.get(i)?))) else {
                continue;
            };
            let same = all.iter_mut().find(|old| old.obstacle == obstacle && old.arc_length == at.arc_length);
            let touch = match same {
                Some(touch) => touch,
                None => {
                    let slid = at.slip == Some(Slip::Slides);
                    let friction = Friction { slid, ..Friction::new(contact.friction) };
                    let friction = (contact.friction > 0.0).then_some(friction);
                    all.push(OldTouch { obstacle, arc_length: at.arc_length, push: 0.0, friction });
                    let last = all.len() - 1;
                    &mut all[last]
                }
            };
            touch.push += at.normal;
            touch.friction.iter_mut().for_each(|friction| friction.earlier += at.force);
        }
        all
    }

    /// Returns an error for an obstacle whose function is not a signed distance: its gradient must be a unit vector
    /// and the derivative of the distance, at all stations of the rod.
    fn check_obstacles(&self, rod: &Rod) -> Result<(), ParameterError> {
        if self.obstacles.contacts.is_empty() {
            return Ok(());
        }
        let step = DISTANCE_STEP * self.length;
        for station in all_stations(rod, &self.tangents) {
            for obstacle in 0..self.obstacles.contacts.len() {
                let gap = self.obstacles.gap(obstacle, &station.position);
                let (name, norm) = ("norm of the gradient of the distance from an obstacle", gap.normal.norm());
                let at = |error: ParameterError| error.at(station.arc_length);
                ParameterError::unless((norm - 1.0).abs() < DISTANCE_ERROR, name, norm, "1").map_err(at)?;
                let ahead = self.obstacles.gap(obstacle, &(station.position + gap.normal * step)).value;
                let (name, slope) =
                    ("derivative of the distance from an obstacle along its gradient", (ahead - gap.value) / step);
                ParameterError::unless((slope - 1.0).abs() < DISTANCE_ERROR, name, slope, "1").map_err(at)?;
            }
        }
        Ok(())
    }

    /// Returns an error for a hold that is farther from the base than the rod reaches without stretch.
    pub(super) fn check_reach(&self, rod: &Rod) -> Result<(), ParameterError> {
        let tissue = rod.points().first().map(|point| Tissue::of(point, self.obstacles.time));
        let stretches = |tissue| self.material.line_response(&tissue, &Vector3::zeros()).is_some();
        if tissue.is_none_or(stretches) {
            return Ok(());
        }
        for site in &self.sites {
            let reach = self.place_of(rod, (site.element, site.x)).arc_length;
            let (name, distance) = ("distance of a hold from the base", project(&site.fixed, &site.target).norm());
            let requirement = "at most the arc length of its place (m), since the rod does not stretch";
            let ok = site.touch.is_some() || distance <= reach * (1.0 + 1e-12);
            ParameterError::unless(ok, name, distance, requirement).map_err(|error| error.at(reach))?;
        }
        self.check_between(rod)
    }

    /// Finds the equilibrium. Returns an error for laws of supports that are invalid where the search ends.
    pub fn run(mut self, rod: &mut Rod, bound: usize) -> Result<Found, EquilibriumError> {
        let moved = self.move_holds(rod, bound);
        if moved.as_ref().err().is_none_or(EquilibriumError::is_recoverable) {
            self.check_end(rod)?;
        }
        moved?;
        if !self.frames.is_empty() {
            // The last step may change reactions that do not affect the shape.
            self.balance_frames(rod);
            self.found.evaluations += 1;
        }
        let (reactions, patches) = (self.reactions(rod), self.patches(rod, 0.0));
        Ok(Found {
            equilibrium: self.found,
            increments: self.increments,
            foundations: self.foundations,
            reactions,
            patches,
        })
    }

    /// Moves the holds from their present places to the requested ones in increments, each of which ends in
    /// equilibrium.
    fn move_holds(&mut self, rod: &mut Rod, bound: usize) -> Result<(), EquilibriumError> {
        self.locate(rod);
        self.check_reach(rod)?;
        self.check_obstacles(rod)?;
        self.check_start(rod)?;
        let goals: Vec<Vector3<f64>> = self.sites.iter().map(|site| site.target).collect();
        let starts: Vec<Vector3<f64>> =
            self.sites.iter().map(|site| site.target + project(&site.fixed, &(site.position - site.target))).collect();
        let far = goals.iter().zip(&starts).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / self.length;
        let turned = self.frames.iter().map(|frame| frame.missing(rod).norm()).fold(0.0, f64::max);
        let number = (far / LARGEST_MOVE).max(turned / LARGEST_INCREMENT).ceil().max(1.0);
        let (mut done, mut share) = (0.0, 1.0 / number);
        while done < 1.0 {
            let next = if done + share > 1.0 - 1e-9 { 1.0 } else { done + share };
            let before = self.snapshot(rod);
            for ((site, start), goal) in self.sites.iter_mut().zip(&starts).zip(&goals) {
                site.target = start + (goal - start) * next;
            }
            self.turn_held(rod, (next - done) / (1.0 - done));
            self.increments += 1;
            match self.settle(rod, bound.min(ITERATIONS)) {
                Ok(()) => done = next,
                Err(error)
                    if error.is_recoverable()
                        && !self.quick
                        && share > SMALLEST_SHARE
                        && done + share > done
                        && (number > 1.0 || far > 0.0 || turned > 0.0) =>
                {
                    self.restore(rod, before);
                    share *= 0.5;
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Rotates the held frames by a share of the rotations that they lack.
    pub(super) fn turn_held(&mut self, rod: &mut Rod, share: f64) {
        for i in 0..self.frames.len() {
            let turn = self.frames[i].missing(rod) * share;
            if turn.norm() > 0.0 {
                let at = self.frames[i].node;
                let from = if i > 0 { self.frames[i - 1].node } else { 0 };
                turn_frames(rod, &turn, from, at, self.frames.get(i + 1).map(|next| next.node));
            }
        }
    }
}

/// The part of a vector along some orthonormal vectors.
pub(super) fn project(directions: &[Vector3<f64>], vector: &Vector3<f64>) -> Vector3<f64> {
    directions.iter().map(|d| d * d.dot(vector)).sum()
}
