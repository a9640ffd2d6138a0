//! The energy of a whole rod with its derivatives, the factorised tangent, and the steps that follow from it.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::element::{ElementData, ElementSystem};
use super::tangent::Tangent;
use super::{EquilibriumError, Inertia};
use crate::constitutive::Constitutive;
use crate::load::InternalForce;
use crate::rod::Rod;
use crate::so3;

/// Energy, gradient and tangent of a rod. The memory is kept from one call to the next.
#[derive(Debug, Default)]
pub(super) struct System {
    elements: Vec<ElementSystem>,
    tangent: Tangent,
    /// The largest couple on a frame that [`balance`](Self::balance) found, N m.
    pub unbalanced: f64,
    /// The smallest pivot of the last tangent relative to that of the same rod without load: how far the load is from making
    /// it unstable.
    pub resistance: f64,
    /// Couples on the frames, then their turns in the present step; the base's (zero) first.
    turns: Vec<Vector3<f64>>,
    /// Steps of the rotation vectors of every element.
    steps: Vec<Vector3<f64>>,
    /// Where the present step starts.
    pub start: Configuration,
    /// Where the search for an equilibrium starts.
    pub initial: Configuration,
}

/// The degrees of freedom of a rod.
#[derive(Debug, Default)]
pub(super) struct Configuration {
    frames: Vec<UnitQuaternion<f64>>,
    rotations: Vec<Vector3<f64>>,
}

impl Configuration {
    pub fn keep(&mut self, rod: &Rod) {
        self.frames.clone_from(&rod.frames);
        self.rotations.clone_from(&rod.rotations);
    }

    pub fn restore(&self, rod: &mut Rod) {
        rod.frames.clone_from(&self.frames);
        rod.rotations.clone_from(&self.rotations);
    }
}

impl System {
    fn data<'a, const P: usize>(rod: &'a Rod, force: &'a InternalForce, e: usize) -> ElementData<'a> {
        ElementData {
            frame: &rod.frames[e],
            rotations: rod.element_rotations(e),
            points: rod.element_points(e),
            forces: &force.at_points()[e * P..(e + 1) * P],
            time: force.environment().time,
        }
    }

    /// Assembles, condenses and factorises the tangent at the rod's frames, with `shift` (N) on its diagonal per length.
    /// Returns the energy, J, and the signs of the pivots.
    pub fn assemble<const P: usize>(
        &mut self,
        rod: &Rod,
        material: &impl Constitutive,
        force: &InternalForce,
        shift: f64,
    ) -> Result<(f64, Inertia), EquilibriumError> {
        let n = rod.elements();
        self.elements.resize_with(n, ElementSystem::default);
        self.turns.resize(n + 1, Vector3::zeros());
        self.steps.resize(n * P, Vector3::zeros());
        self.tangent.reset(n)?;
        let mut inertia = Inertia::default();
        let mut energy = 0.0;
        for e in 0..n {
            let data = Self::data::<P>(rod, force, e);
            let element = &mut self.elements[e];
            energy += element.evaluate::<P, true>(rod.reference(), material, &data);
            let share = shift * rod.element_length(e) / P as f64;
            let blocks = element.condense::<P>(&data, share, &mut inertia);
            self.tangent.add_diagonal(e, &(blocks.h11 + Matrix3::from_diagonal_element(share)));
            if e > 0 {
                self.tangent.add_diagonal(e - 1, &blocks.h00);
                self.tangent.set_coupling(e, &blocks.h01);
            }
        }
        self.balance::<P>();
        let interior = inertia.margin;
        let compliance = self.elements.iter().map(|element| element.compliance);
        self.resistance = interior.min(self.tangent.factorise(&mut inertia, compliance)?);
        if energy.is_finite() { Ok((energy, inertia)) } else { Err(EquilibriumError::NotFinite { what: "energy" }) }
    }

    /// What a couple on the apex bends or twists the rod by at least, rad/(N m); of the last assembly.
    pub fn compliance(&self) -> f64 {
        self.elements.iter().map(|element| element.compliance).sum()
    }

    /// How much the centre line yields to the force at most, |C| |n|; of the last assembly. Zero without shear and stretch.
    pub fn yielding(&self) -> f64 {
        self.elements.iter().map(|element| element.yielding).fold(0.0, f64::max)
    }

    /// The energy, J, and its gradient at the rod's frames; the factors stay.
    pub fn evaluate<const P: usize>(&mut self, rod: &Rod, material: &impl Constitutive, force: &InternalForce) -> f64 {
        let mut energy = 0.0;
        for (e, element) in self.elements.iter_mut().enumerate() {
            let data = Self::data::<P>(rod, force, e);
            energy += element.evaluate::<P, false>(rod.reference(), material, &data);
        }
        energy
    }

    /// Writes the negative gradient by the frames, the couples that are not balanced, to `turns`. It is that of the last
    /// evaluation, condensed with the factors of the last assembly.
    pub fn balance<const P: usize>(&mut self) {
        self.turns.fill(Vector3::zeros());
        for (e, element) in self.elements.iter_mut().enumerate() {
            let (g1, g0) = element.condense_gradient::<P>();
            self.turns[e + 1] -= g1;
            if e > 0 {
                self.turns[e] -= g0;
            }
        }
        self.unbalanced = self.turns.iter().map(Vector3::norm).fold(0.0, f64::max);
    }

    /// The step that the factorised tangent takes from the gradient in `turns`.
    pub fn solve<const P: usize>(&mut self) {
        self.tangent.solve(&mut self.turns[1..]);
        self.recover::<P>();
    }

    /// What the turns in the present step make of the rotation vectors within the elements.
    fn recover<const P: usize>(&mut self) {
        for (e, element) in self.elements.iter().enumerate() {
            element.recover::<P>(&self.turns[e + 1], &self.turns[e], &mut self.steps[e * P..(e + 1) * P]);
        }
    }

    /// Makes the present step the direction in which the rod is softest, of those that turn about an axis of the base: inverse
    /// iteration with the factors at hand, from an even bend.
    pub fn soften<const P: usize>(&mut self, rod: &Rod, axis: &Vector3<f64>, passes: usize) {
        let mut s = 0.0;
        for (e, turn) in self.turns.iter_mut().skip(1).enumerate() {
            s += rod.element_length(e);
            *turn = rod.frames[e + 1].inverse() * (rod.frames[0] * axis) * s;
        }
        for _ in 0..passes {
            let largest = self.turns.iter().map(Vector3::norm).fold(0.0, f64::max);
            // The couples that this turn, weighted by length, stands for.
            for (e, turn) in self.turns.iter_mut().skip(1).enumerate() {
                *turn *= rod.element_length(e) / largest;
            }
            self.tangent.solve(&mut self.turns[1..]);
        }
        self.recover::<P>();
    }

    /// The largest rotation in the present step, rad; not a number if one is.
    pub fn largest_turn(&self) -> f64 {
        let sizes = self.turns.iter().chain(&self.steps).map(Vector3::norm);
        sizes.fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
    }

    /// The derivative of the energy along the present step, J.
    pub fn slope<const P: usize>(&self) -> f64 {
        let each = self.elements.iter().enumerate();
        each.map(|(e, element)| element.slope::<P>(&self.steps[e * P..(e + 1) * P], &self.turns[e])).sum()
    }

    /// Moves the rod by the step that the factorised tangent takes from the gradient at its frames.
    pub fn follow<const P: usize>(&mut self, rod: &mut Rod, material: &impl Constitutive, force: &InternalForce) {
        self.evaluate::<P>(rod, material, force);
        self.balance::<P>();
        self.solve::<P>();
        self.start.keep(rod);
        self.advance::<P>(rod, 1.0);
    }

    /// Moves the rod from the start of the step by a fraction of it.
    pub fn advance<const P: usize>(&self, rod: &mut Rod, fraction: f64) {
        for (i, turn) in self.turns.iter().enumerate().skip(1) {
            let frame = self.start.frames[i] * so3::exp(&(turn * fraction));
            rod.frames[i] = UnitQuaternion::new_normalize(frame.into_inner());
        }
        for e in 0..rod.elements() {
            for k in e * P..(e + 1) * P - 1 {
                rod.rotations[k] = self.start.rotations[k] + self.steps[k] * fraction;
            }
            rod.rotations[(e + 1) * P - 1] = so3::log(&(rod.frames[e].inverse() * rod.frames[e + 1]));
        }
    }
}
