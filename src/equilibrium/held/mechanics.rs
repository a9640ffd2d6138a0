//! Mechanics of a rod, independent of the types of its laws and of its order.

use nalgebra::{Matrix3, Vector3};

use crate::constitutive::{Constitutive, Tissue, strain_under};
use crate::equilibrium::elimination::Row;
use crate::equilibrium::line::strain_line;
use crate::equilibrium::system::System;
use crate::equilibrium::{EquilibriumError, Inertia};
use crate::load::{InternalForce, Load};
use crate::rod::{MaterialPoint, Rod};

/// The mechanics of a rod under its load and the present reactions.
pub(in crate::equilibrium) trait Mechanics {
    fn system(&self) -> &System;

    fn system_mut(&mut self) -> &mut System;

    /// The force in the rod.
    fn force(&self) -> &InternalForce;

    fn force_mut(&mut self) -> &mut InternalForce;

    /// Computes the load of a rod with new elements.
    fn renew_load(&mut self, rod: &Rod);

    /// Assembles and condenses the tangent with a shift (N). Returns the energy (J) and the signs of the pivots inside
    /// the elements.
    fn condense(&mut self, rod: &Rod, shift: f64) -> Result<(f64, Inertia), EquilibriumError>;

    /// Evaluates the energy (J) and its gradient at the present shape.
    fn evaluate(&mut self, rod: &Rod) -> f64;

    /// Writes the unbalanced couples at the last evaluation to the system.
    fn balance(&mut self);

    /// Solves for the step with the factorised tangent and the couples of the system.
    fn solve(&mut self);

    /// The derivative of the energy along the step, J.
    fn slope(&self) -> f64;

    /// Moves the rod from the start of the step by a fraction of the step.
    fn advance(&self, rod: &mut Rod, fraction: f64);

    /// The derivatives of the chord from the start of an element to a coordinate by the unknowns of the element,
    /// eliminated as the gradient: one row for each component.
    fn chord_rows(&self, rod: &Rod, element: usize, x: f64) -> [Row; 3];

    /// The derivatives of the tangent d3 at a coordinate of an element, as [`chord_rows`](Self::chord_rows).
    fn tangent_rows(&self, rod: &Rod, element: usize, x: f64) -> [Row; 3];

    /// The compliance of the centre line at a Gauss point in the fixed frame, 1/N; `None` without shear and stretch.
    fn line_compliance(&self, rod: &Rod, element: usize, g: usize) -> Option<Matrix3<f64>>;

    /// The tangent stiffness of tissue without elastic strain, N m².
    fn stiffness(&self, point: &MaterialPoint) -> Matrix3<f64>;

    /// The elastic strain by a couple along the directors (N m), given an approximation of it.
    fn strain_under(&self, point: &MaterialPoint, near: &Vector3<f64>, couple: &Vector3<f64>) -> Vector3<f64>;

    /// Strains of the centre line at the material points.
    fn strain_line(&self, rod: &Rod) -> Vec<Vector3<f64>>;
}

/// A rod of given laws, with `P` Gauss points in an element.
struct Body<'a, C, L, const P: usize> {
    system: &'a mut System,
    material: &'a C,
    load: &'a L,
    force: &'a mut InternalForce,
}

impl<C: Constitutive, L: Load, const P: usize> Body<'_, C, L, P> {
    fn time(&self) -> f64 {
        self.force.environment().time
    }
}

impl<C: Constitutive, L: Load, const P: usize> Mechanics for Body<'_, C, L, P> {
    fn system(&self) -> &System {
        self.system
    }

    fn system_mut(&mut self) -> &mut System {
        self.system
    }

    fn force(&self) -> &InternalForce {
        self.force
    }

    fn force_mut(&mut self) -> &mut InternalForce {
        self.force
    }

    fn renew_load(&mut self, rod: &Rod) {
        let environment = *self.force.environment();
        self.force.update(rod, self.load, &environment);
    }

    fn condense(&mut self, rod: &Rod, shift: f64) -> Result<(f64, Inertia), EquilibriumError> {
        self.system.condense::<P>(rod, self.material, self.force, shift)
    }

    fn evaluate(&mut self, rod: &Rod) -> f64 {
        self.system.evaluate::<P>(rod, self.material, self.force)
    }

    fn balance(&mut self) {
        self.system.balance::<P>();
        self.system.balance_base(&self.force.at_base());
    }

    fn solve(&mut self) {
        self.system.solve::<P>();
    }

    fn slope(&self) -> f64 {
        self.system.slope::<P>()
    }

    fn advance(&self, rod: &mut Rod, fraction: f64) {
        self.system.advance::<P>(rod, fraction);
    }

    fn chord_rows(&self, rod: &Rod, element: usize, x: f64) -> [Row; 3] {
        let data = System::data::<P>(rod, self.force, element);
        self.system.elements[element].chord_rows::<P>(rod.reference(), self.material, &data, x)
    }

    fn tangent_rows(&self, rod: &Rod, element: usize, x: f64) -> [Row; 3] {
        let data = System::data::<P>(rod, self.force, element);
        self.system.elements[element].tangent_rows::<P>(rod.reference(), &data, x)
    }

    fn line_compliance(&self, rod: &Rod, element: usize, g: usize) -> Option<Matrix3<f64>> {
        let i = element * P + g;
        let frame = rod.frame_at_point(element, g);
        let along = frame.inverse_transform_vector(&self.force.at_points()[i]);
        let line = self.material.line_response(&Tissue::of(&rod.points()[i], self.time()), &along)?;
        let turn = frame.to_rotation_matrix().into_inner();
        Some(turn * line.compliance * turn.transpose())
    }

    fn stiffness(&self, point: &MaterialPoint) -> Matrix3<f64> {
        self.material.respond(&Tissue::of(point, self.time()), &Vector3::zeros()).tangent
    }

    fn strain_under(&self, point: &MaterialPoint, near: &Vector3<f64>, couple: &Vector3<f64>) -> Vector3<f64> {
        strain_under(self.material, &Tissue::of(point, self.time()), near, couple)
    }

    fn strain_line(&self, rod: &Rod) -> Vec<Vector3<f64>> {
        let mut strains = Vec::new();
        strain_line(&mut strains, rod, self.material, self.force);
        strains
    }
}

/// The mechanics of a rod under a load.
pub(in crate::equilibrium) fn body_of<'a, C: Constitutive, L: Load>(
    rod: &Rod,
    (material, load): (&'a C, &'a L),
    force: &'a mut InternalForce,
    system: &'a mut System,
) -> Box<dyn Mechanics + 'a> {
    match rod.order().points() {
        1 => Box::new(Body::<C, L, 1> { system, material, load, force }),
        2 => Box::new(Body::<C, L, 2> { system, material, load, force }),
        3 => Box::new(Body::<C, L, 3> { system, material, load, force }),
        _ => Box::new(Body::<C, L, 4> { system, material, load, force }),
    }
}
