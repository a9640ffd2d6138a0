//! Energy of a rod with its derivatives, factorised tangent and steps.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::element::{ElementData, ElementSystem};
use super::error::Outcome;
use super::joints::Joints;
use super::points::with_points;
use super::tangent::Tangent;
use super::{EquilibriumError, Inertia, RodEnergy};
use crate::constitutive::Constitutive;
use crate::numerics::scalar::largest;
use crate::rod::Rod;
use crate::so3;

/// Energy, gradient and tangent of a rod. The workspace is reused by successive calls.
#[derive(Debug, Default)]
pub(super) struct System {
    /// Number of Gauss points in an element at the last assembly.
    pub(super) points: usize,
    pub elements: Vec<ElementSystem>,
    pub tangent: Tangent,
    /// Workspace of the search on a coarser mesh.
    pub coarse: Option<Box<System>>,
    /// Joints of frames with supports; none for a rod with a clamped base and no supports.
    pub joints: Joints,
    /// Largest unbalanced couple on a frame in the last [`balance`](Self::balance), or the
    /// unbalanced force on a free base times the length if this is larger, N m.
    pub unbalanced: f64,
    /// Smallest pivot of the last tangent relative to that of the same rod without load: a measure
    /// of the distance from instability.
    pub resistance: f64,
    /// Unbalanced couples on the frames after [`balance`](Self::balance), from base (zero) to apex,
    /// N m.
    pub couples: Vec<Vector3<f64>>,
    /// Unbalanced force on a free base, N; zero otherwise.
    pub base_force: Vector3<f64>,
    /// Rotations of the frames in the current step, from base (zero) to apex, rad.
    pub turns: Vec<Vector3<f64>>,
    /// Changes of the rotation vectors of every element in the current step.
    pub steps: Vec<Vector3<f64>>,
    /// Displacement of a free base in the current step, m; zero otherwise.
    pub base_motion: Vector3<f64>,
    /// Configuration at the start of the current step.
    pub start: Configuration,
    /// Configuration at the start of the search.
    pub initial: Configuration,
}

/// The degrees of freedom of a rod.
#[derive(Debug, Default)]
pub(super) struct Configuration {
    frames: Vec<UnitQuaternion<f64>>,
    rotations: Vec<Vector3<f64>>,
    /// Position of the base, m.
    pub position: Vector3<f64>,
}

impl Configuration {
    pub fn keep(&mut self, rod: &Rod) {
        self.frames.clone_from(&rod.frames);
        self.rotations.clone_from(&rod.rotations);
        self.position = rod.base_position;
    }

    /// Largest angle between a frame and that of another configuration, rad.
    pub fn largest_turn_to(&self, other: &Self) -> f64 {
        self.frames
            .iter()
            .zip(&other.frames)
            .map(|(a, b)| a.angle_to(b))
            .fold(0.0, f64::max)
    }

    pub fn restore(&self, rod: &mut Rod) {
        rod.frames.clone_from(&self.frames);
        rod.rotations.clone_from(&self.rotations);
        rod.base_position = self.position;
    }
}

impl System {
    /// Assembles, condenses and factorises the tangent at the rod's frames. `shift` (N), times the
    /// length that belongs to a frame, is added to its diagonal. Returns the energy, J, and the
    /// signs of the pivots.
    pub fn assemble(
        &mut self,
        rod: &Rod,
        body: &RodEnergy<impl Constitutive>,
        shift: f64,
    ) -> Outcome<(f64, Inertia)> {
        let (energy, mut inertia) = self.condense(rod, body, shift)?;
        self.balance();
        let interior = inertia.margin;
        let compliance = self.elements.iter().map(|element| element.compliance);
        self.resistance = interior.min(self.tangent.factorise(&mut inertia, compliance.clone())?);
        if !self.tangent.neutral.is_empty() {
            let least = f64::EPSILON * body.force.largest() * rod.length();
            self.tangent.find_unbalanced(
                &self.couples[self.joints.first_free()..],
                compliance,
                least,
            );
        }
        Ok((energy, inertia))
    }

    /// Assembles and condenses the tangent as [`assemble`](Self::assemble). Returns the energy, J,
    /// and the signs of the pivots inside the elements.
    pub fn condense(
        &mut self,
        rod: &Rod,
        body: &RodEnergy<impl Constitutive>,
        shift: f64,
    ) -> Outcome<(f64, Inertia)> {
        let n = rod.elements();
        self.points = rod.order().points();
        self.elements.resize_with(n, ElementSystem::default);
        self.couples.resize(n + 1, Vector3::zeros());
        self.turns.resize(n + 1, Vector3::zeros());
        self.steps.resize(n * self.points, Vector3::zeros());
        let first = self.joints.first_free();
        self.tangent.reset(n + 1 - first)?;
        let mut inertia = Inertia::default();
        let mut energy = 0.0;
        with_points!(
            self.points,
            for (e, element) in self.elements.iter_mut().enumerate() {
                let data = ElementData::of(rod, body.force, e);
                energy += element.evaluate::<P, true>(body.material, &data);
                let own = shift * rod.length_of(e) / P as f64;
                let blocks = element.condense::<P>(&data, own, &mut inertia);
                let last = e + 1 - first;
                self.tangent
                    .add_diagonal(last, &(blocks.h11 + Matrix3::from_diagonal_element(own)));
                if last > 0 {
                    // The base, if it rotates, is at the end of one element only.
                    let own = if e == 0 { own } else { 0.0 };
                    self.tangent.add_diagonal(
                        last - 1,
                        &(blocks.h00 + Matrix3::from_diagonal_element(own)),
                    );
                    self.tangent.set_coupling(last, &blocks.h01);
                }
            }
        );
        EquilibriumError::finite(energy.is_finite(), "energy of the elastic law")?;
        Ok((energy, inertia))
    }

    /// Smallest bending or twist of the rod by a couple on the apex, rad/(N m), at the last
    /// assembly.
    pub fn compliance(&self) -> f64 {
        self.elements.iter().map(|element| element.compliance).sum()
    }

    /// Largest strain of the centre line by the force, |C| |n|, at the last assembly. Zero without
    /// shear and stretch.
    pub fn yielding(&self) -> f64 {
        self.elements
            .iter()
            .map(|element| element.yielding)
            .fold(0.0, f64::max)
    }

    /// The energy, J, and its gradient at the current frames. The factorisation does not change.
    pub fn evaluate(&mut self, rod: &Rod, body: &RodEnergy<impl Constitutive>) -> f64 {
        let mut energy = 0.0;
        with_points!(
            self.points,
            for (e, element) in self.elements.iter_mut().enumerate() {
                energy += element
                    .evaluate::<P, false>(body.material, &ElementData::of(rod, body.force, e));
            }
        );
        energy
    }

    /// Sets the unbalanced couples, the negative gradient by the frames. It is that of the last
    /// evaluation, condensed with the factorisation of the last assembly.
    pub fn balance(&mut self) {
        self.couples.fill(Vector3::zeros());
        with_points!(
            self.points,
            for (e, element) in self.elements.iter_mut().enumerate() {
                let (g1, g0) = element.condense_gradient::<P>();
                self.couples[e + 1] -= g1;
                self.couples[e] -= g0;
            }
        );
        self.joints.release(&mut self.couples);
        self.unbalanced = self.couples.iter().map(Vector3::norm).fold(0.0, f64::max);
        self.base_force = Vector3::zeros();
    }

    /// Sets the unbalanced force on a free base after [`balance`](Self::balance), given the force
    /// at the base (N).
    pub fn balance_base(&mut self, force: &Vector3<f64>) {
        if let Some(base) = &self.joints.free_base {
            self.base_force = *force;
            self.unbalanced = self.unbalanced.max(force.norm() * base.length);
        }
    }

    /// Solves for the step by the unbalanced couples and force, with the factorised tangent.
    pub fn solve(&mut self) {
        self.turns.clone_from(&self.couples);
        self.tangent
            .solve(&mut self.turns[self.joints.first_free()..]);
        self.base_motion = self
            .joints
            .free_base
            .map_or_else(Vector3::zeros, |base| self.base_force / base.stiffness);
        self.recover();
    }

    /// Recovers the changes of the rotation vectors in the elements from the rotations of the
    /// frames.
    pub fn recover(&mut self) {
        with_points!(
            self.points,
            for (e, element) in self.elements.iter().enumerate() {
                element.recover::<P>(
                    &self.turns[e + 1],
                    &self.turns[e],
                    &mut self.steps[e * P..(e + 1) * P],
                );
            }
        );
    }

    /// Sets the current step to the softest direction of the rod among rotations about an axis of
    /// the base, by inverse iteration with the existing factorisation from uniform bending.
    pub fn soften(&mut self, rod: &Rod, axis: &Vector3<f64>, passes: usize) {
        let mut s = 0.0;
        for (e, turn) in self.turns.iter_mut().skip(1).enumerate() {
            s += rod.length_of(e);
            *turn = rod.frames()[e + 1].inverse() * (rod.frames()[0] * axis) * s;
        }
        for _ in 0..passes {
            let largest = self.turns.iter().map(Vector3::norm).fold(0.0, f64::max);
            // Couples are proportional to the rotations, weighted by length.
            for (e, turn) in self.turns.iter_mut().skip(1).enumerate() {
                *turn *= rod.length_of(e) / largest;
            }
            self.tangent.solve(&mut self.turns[1..]);
        }
        self.recover();
    }

    /// The largest rotation in the current step, rad, or displacement of a free base relative to
    /// the length; NaN if one is.
    pub fn largest_turn(&self) -> f64 {
        let base = self
            .joints
            .free_base
            .map(|base| self.base_motion.norm() / base.length);
        largest(
            self.turns
                .iter()
                .chain(&self.steps)
                .map(Vector3::norm)
                .chain(base),
        )
    }

    /// The derivative of the energy along the current step, J.
    pub fn slope(&self) -> f64 {
        let each = self.elements.iter().enumerate();
        with_points!(
            self.points,
            each.map(
                |(e, element)| element.slope::<P>(&self.steps[e * P..(e + 1) * P], &self.turns[e])
            )
            .sum()
        )
    }

    /// Moves the rod from the start of the step by a fraction of the step.
    pub fn advance(&self, rod: &mut Rod, fraction: f64) {
        if self.joints.free_base.is_some() {
            rod.base_position = self.start.position + self.base_motion * fraction;
        }
        for (i, turn) in self.turns.iter().enumerate().skip(self.joints.first_free()) {
            let frame = self.start.frames[i] * so3::exp(&(turn * fraction));
            rod.frames[i] = UnitQuaternion::new_normalize(frame.into_inner());
        }
        with_points!(
            self.points,
            for e in 0..rod.elements() {
                for k in e * P..(e + 1) * P - 1 {
                    rod.rotations[k] = self.start.rotations[k] + self.steps[k] * fraction;
                }
                rod.rotations[(e + 1) * P - 1] =
                    so3::log(&(rod.frames[e].inverse() * rod.frames[e + 1]));
            }
        );
    }
}
