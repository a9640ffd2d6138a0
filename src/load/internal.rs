//! Internal force of the rod, which does not depend on its shape under dead loads.

use nalgebra::Vector3;

use super::{Cut, Load};
use crate::error::ParameterError;
use crate::numerics::scalar::largest;
use crate::reference_element::MAX_POINTS;
use crate::rod::{ElementPlace, Rod, Tissue, weighted};
use crate::scene::Environment;
use crate::support::Reaction;

/// Internal force n(s) of equation (11) at every material point of a rod, at one time.
///
/// It does not depend on the frames. It is computed once before the equilibrium is solved.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct InternalForce {
    environment: Environment,
    cuts: Vec<Cut>,
    forces: Vec<Vector3<f64>>,
    at_base: Vector3<f64>,
    /// The forces and that at the base under the load alone; empty without reactions.
    loads: Vec<Vector3<f64>>,
    load_at_base: Vector3<f64>,
    /// Couples of supports: index of the node at which each acts, and the couple in the fixed
    /// frame, N m.
    couples: Vec<(usize, Vector3<f64>)>,
    /// The reactions of [`react`](Self::react).
    reactions: Vec<Reaction>,
    /// Reactions inside elements, in the order of the elements, and the forces at the material
    /// points without those inside the own element; empty if all reactions are at ends of elements.
    inside: Vec<PointReaction>,
    beyond: Vec<Vector3<f64>>,
}

/// Largest relative difference of the lengths of a rod and of the rod for which a force was
/// computed: far above rounding, and below any change by growth that matters.
const ROUNDING: f64 = 1e-6;

/// Distance of a reaction from an end of an element, relative to its length, that is due to
/// rounding of its place.
const AT_END: f64 = 1e-9;

/// Force (N) and couple (N m) of a support on a rod at coordinate `x` of an element, in the fixed
/// frame. A couple acts at the last end of the element only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PointReaction {
    pub element: usize,
    pub x: f64,
    pub force: Vector3<f64>,
    pub couple: Vector3<f64>,
}

/// The reactions on element `e`, from a list that is sorted by elements.
fn of_element(reactions: &[PointReaction], e: usize) -> &[PointReaction] {
    let [from, to] = [e, e + 1].map(|e| reactions.partition_point(|at| at.element < e));
    &reactions[from..to]
}

impl InternalForce {
    /// Internal force of a rod under a load.
    #[must_use]
    pub fn of(rod: &Rod, load: &impl Load, environment: &Environment) -> Self {
        let mut force = Self::default();
        force.update(rod, load, environment);
        force
    }

    /// The force at places in elements of `p` material points.
    pub(crate) fn interpolated(&self, p: usize, places: &[ElementPlace]) -> Self {
        let at = |at: &ElementPlace| weighted(&self.forces[at.element * p..][..p], &at.weights);
        Self {
            environment: self.environment,
            forces: places.iter().map(at).collect(),
            ..Self::default()
        }
    }

    /// Computes the force of another rod or at another time, without allocation if the capacity
    /// suffices.
    pub(crate) fn update(&mut self, rod: &Rod, load: &impl Load, environment: &Environment) {
        let reference = rod.reference();
        let p = reference.p;
        let total = rod.length();
        self.environment = *environment;
        self.cuts.resize(rod.points().len(), Cut::default());
        self.forces.resize(rod.points().len(), Vector3::zeros());
        // The sum begins at the apex, which avoids cancellation for short elements near it.
        let (mut length, mut volume, mut distributed) = (0.0, 0.0, Vector3::zeros());
        for e in (0..rod.elements()).rev() {
            let points = rod.element_points(e);
            let mut area = [0.0; MAX_POINTS];
            let mut per_length = [Vector3::zeros(); MAX_POINTS];
            for j in 0..p {
                area[j] = points[j].section.area();
                per_length[j] =
                    load.per_length(&Tissue::of(&points[j], environment.time), environment);
            }
            for g in 0..p {
                let (mut length_beyond, mut volume_beyond, mut force) =
                    (length, volume, distributed);
                for j in 0..p {
                    let part = (reference.weights[j] - reference.upto[g][j]) * points[j].jacobian;
                    length_beyond += part;
                    volume_beyond += part * area[j];
                    force += per_length[j] * part;
                }
                let (arc_length, initial_apex_distance) =
                    (total - length_beyond, points[g].initial_apex_distance);
                let cut = Cut {
                    arc_length,
                    length_beyond,
                    volume_beyond,
                    initial_apex_distance,
                };
                self.forces[e * p + g] = force + load.force(&cut, environment);
                self.cuts[e * p + g] = cut;
            }
            for j in 0..p {
                let whole = reference.weights[j] * points[j].jacobian;
                length += whole;
                volume += whole * area[j];
                distributed += per_length[j] * whole;
            }
        }
        let initial_apex_distance = rod.initial_length;
        let whole = Cut {
            arc_length: 0.0,
            length_beyond: total,
            volume_beyond: volume,
            initial_apex_distance,
        };
        self.at_base = distributed + load.force(&whole, environment);
        self.loads.clear();
        self.couples.clear();
        self.reactions.clear();
        self.inside.clear();
        self.beyond.clear();
    }

    /// Replaces the reactions of supports. At the material points of an element, a reaction inside
    /// it is distributed so that its work is that on the polynomial through the tangents at these
    /// points. Unless the rod `yields`, [`on_element`](Self::on_element) returns these reactions
    /// with their places instead.
    pub(crate) fn set_reactions(&mut self, rod: &Rod, reactions: &[PointReaction], yields: bool) {
        let reference = rod.reference();
        if self.loads.is_empty() {
            self.loads.clone_from(&self.forces);
            self.load_at_base = self.at_base;
        }
        self.at_base = self.load_at_base
            + reactions
                .iter()
                .map(|reaction| reaction.force)
                .sum::<Vector3<f64>>();
        let with_couple = reactions.iter().filter(|at| at.couple != Vector3::zeros());
        self.couples.clear();
        self.couples
            .extend(with_couple.map(|at| (at.element + usize::from(at.x > 0.5), at.couple)));
        let mut inside: Vec<_> = reactions
            .iter()
            .copied()
            .filter(|at| at.force != Vector3::zeros())
            .collect();
        inside.sort_by_key(|reaction| reaction.element);
        self.inside.clear();
        self.inside.extend(
            inside
                .iter()
                .filter(|reaction| reaction.x < 1.0 && !yields)
                .copied(),
        );
        self.beyond.clear();
        let mut beyond = self.at_base - self.load_at_base;
        for e in 0..rod.elements() {
            let own = of_element(&inside, e);
            own.iter().for_each(|reaction| beyond -= reaction.force);
            let range = e * reference.p..(e + 1) * reference.p;
            for (to, load) in self.forces[range.clone()]
                .iter_mut()
                .zip(&self.loads[range.clone()])
            {
                *to = load + beyond;
            }
            if !self.inside.is_empty() {
                let at_end = own.iter().filter(|reaction| reaction.x >= 1.0);
                let at_end: Vector3<f64> = at_end.map(|reaction| reaction.force).sum();
                self.beyond.extend(
                    self.forces[range.clone()]
                        .iter()
                        .map(|force| force + at_end),
                );
            }
            for reaction in own {
                let upto = reference.integral_upto(reaction.x);
                for (g, to) in self.forces[range.clone()].iter_mut().enumerate() {
                    *to += reaction.force * (upto[g] / reference.weights[g]);
                }
            }
        }
    }

    /// Force at the base under the load alone, without reactions, in the fixed frame, N.
    pub(crate) fn load_at_base(&self) -> Vector3<f64> {
        if self.loads.is_empty() {
            self.at_base
        } else {
            self.load_at_base
        }
    }

    /// The forces on an element of `p` material points: those at these points that act beyond the
    /// element or are distributed, and the reactions inside the element.
    pub(crate) fn on_element(&self, e: usize, p: usize) -> (&[Vector3<f64>], &[PointReaction]) {
        let range = e * p..(e + 1) * p;
        if self.inside.is_empty() {
            return (&self.forces[range], &[]);
        }
        (&self.beyond[range], of_element(&self.inside, e))
    }

    /// The force of the reactions in each element, N: at its first end, at its material points, and
    /// at its last end; empty without reactions. At an end it is the sum of the reactions beyond.
    /// Those at a last end are beyond.
    pub(crate) fn reactions_in_elements(&self, rod: &Rod) -> Vec<Vector3<f64>> {
        let p = rod.order().points();
        let places: Vec<_> = self
            .reactions
            .iter()
            .filter_map(|at| Some((rod.locate(at.arc_length)?, at.force)))
            .collect();
        let beyond = |e: usize, x: f64| {
            let each = places
                .iter()
                .filter(|((element, at), _)| *element > e || *element == e && *at > x);
            each.map(|(_, force)| force).sum::<Vector3<f64>>()
        };
        let each = self
            .forces
            .iter()
            .zip(&self.loads)
            .map(|(force, load)| force - load)
            .collect::<Vec<_>>();
        let inside = |(e, points): (usize, &[Vector3<f64>])| {
            let (first, last) = (beyond(e, AT_END), beyond(e, 1.0 - AT_END));
            std::iter::once(first)
                .chain(points.to_vec())
                .chain([last])
                .collect::<Vec<_>>()
        };
        each.chunks(p).enumerate().flat_map(inside).collect()
    }

    /// Adds the reactions of a support in an equilibrium of the rod.
    pub(crate) fn react(&mut self, rod: &Rod, reactions: &[Reaction]) {
        let at = |reaction: &Reaction| {
            let (element, x) = rod.locate(reaction.arc_length)?;
            Some(PointReaction {
                element,
                x,
                force: reaction.force,
                couple: reaction.couple,
            })
        };
        if !reactions.is_empty() {
            let points: Vec<_> = reactions.iter().filter_map(at).collect();
            self.set_reactions(rod, &points, rod.yields());
            self.reactions.clear();
            self.reactions.extend_from_slice(reactions);
        }
    }

    /// The reactions of the support that [`react`](Self::react) has added.
    pub(crate) fn reactions(&self) -> &[Reaction] {
        &self.reactions
    }

    /// Couples of supports at a node, in the fixed frame, N m.
    pub(crate) fn couples_at(&self, node: usize) -> impl Iterator<Item = &Vector3<f64>> {
        self.couples
            .iter()
            .filter(move |(at, _)| *at == node)
            .map(|(_, couple)| couple)
    }

    /// Time and gravity.
    #[must_use]
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Cuts through the material points, from base to apex.
    #[must_use]
    pub fn cuts(&self) -> &[Cut] {
        &self.cuts
    }

    /// Force n at the material points, from base to apex, in the fixed frame, N.
    #[must_use]
    pub fn at_points(&self) -> &[Vector3<f64>] {
        &self.forces
    }

    /// Force n at the base, in the fixed frame, N: the total load.
    #[must_use]
    pub fn at_base(&self) -> Vector3<f64> {
        self.at_base
    }

    /// Checks that a rod has as many material points as the rod for which the force was computed,
    /// and its length.
    ///
    /// # Errors
    /// The number of points at which the force is known, or the length.
    pub(crate) fn check(&self, rod: &Rod) -> Result<(), ParameterError> {
        let counts = [self.forces.len(), rod.points().len()];
        ParameterError::count(
            "number of points at which the force is known",
            counts,
            "that of the rod",
        )?;
        let (name, own) = (
            "length of the rod for which the force is known",
            rod.length(),
        );
        let length = self
            .cuts
            .first()
            .map_or(own, |cut| cut.arc_length + cut.length_beyond);
        let ok = (length - own).abs() <= ROUNDING * own;
        ParameterError::unless(ok, name, length, "that of the rod (m)")
    }

    /// Largest norm of the force at a material point, N; NaN if the norm at one of them is NaN.
    #[must_use]
    pub fn largest(&self) -> f64 {
        largest(self.forces.iter().map(Vector3::norm_squared)).sqrt()
    }
}
