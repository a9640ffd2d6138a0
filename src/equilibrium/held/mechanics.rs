//! Mechanics of a rod, independent of the types of its laws.

use nalgebra::{Matrix3, Vector3};

use crate::constitutive::{Constitutive, Tissue, strain_near};
use crate::equilibrium::element::ElementData;
use crate::equilibrium::elimination::Row;
use crate::equilibrium::line::strain_line;
use crate::equilibrium::points::with_points;
use crate::equilibrium::system::System;
use crate::equilibrium::{EquilibriumError, Inertia, RodEnergy};
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

    /// Assembles and condenses the tangent with a shift (N). Returns the energy (J) and the signs
    /// of the pivots inside the elements.
    fn condense(&mut self, rod: &Rod, shift: f64) -> Result<(f64, Inertia), EquilibriumError>;

    /// Evaluates the energy (J) and its gradient at the present shape.
    fn evaluate(&mut self, rod: &Rod) -> f64;

    /// Writes the unbalanced couples at the last evaluation to the system.
    fn balance(&mut self);

    /// The derivatives of the chord from the start of an element to a coordinate by the unknowns of
    /// the element, eliminated as the gradient: one row for each component.
    fn chord_rows(&self, rod: &Rod, element: usize, x: f64) -> [Row; 3];

    /// The derivatives of the tangent d3 at a coordinate of an element, as
    /// [`chord_rows`](Self::chord_rows).
    fn tangent_rows(&self, rod: &Rod, element: usize, x: f64) -> [Row; 3];

    /// The compliance of the centre line at a Gauss point in the fixed frame, 1/N; `None` without
    /// shear and stretch.
    fn line_compliance(&self, rod: &Rod, element: usize, g: usize) -> Option<Matrix3<f64>>;

    /// The tangent stiffness of tissue without elastic strain, N m².
    fn stiffness(&self, point: &MaterialPoint) -> Matrix3<f64>;

    /// The elastic strain by a couple along the directors (N m), given an approximation of it.
    fn strain_under(
        &self,
        point: &MaterialPoint,
        near: &Vector3<f64>,
        couple: &Vector3<f64>,
    ) -> Vector3<f64>;

    /// Strains of the centre line at the material points.
    fn strain_line(&self, rod: &Rod) -> Vec<Vector3<f64>>;
}

/// A rod of given laws under a load.
pub(in crate::equilibrium) struct Body<'a, C, L> {
    pub system: &'a mut System,
    pub material: &'a C,
    pub load: &'a L,
    pub force: &'a mut InternalForce,
}

impl<C: Constitutive, L: Load> Body<'_, C, L> {
    fn time(&self) -> f64 {
        self.force.environment().time
    }
}

impl<C: Constitutive, L: Load> Mechanics for Body<'_, C, L> {
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
        self.system
            .condense(rod, &RodEnergy::new(self.material, self.force), shift)
    }

    fn evaluate(&mut self, rod: &Rod) -> f64 {
        self.system
            .evaluate(rod, &RodEnergy::new(self.material, self.force))
    }

    fn balance(&mut self) {
        self.system.balance();
        self.system.balance_base(&self.force.at_base());
    }

    fn chord_rows(&self, rod: &Rod, element: usize, x: f64) -> [Row; 3] {
        let data = ElementData::of(rod, self.force, element);
        let system = &self.system.elements[element];
        with_points!(
            rod.order().points(),
            system.chord_rows::<P>(self.material, &data, x)
        )
    }

    fn tangent_rows(&self, rod: &Rod, element: usize, x: f64) -> [Row; 3] {
        let data = ElementData::of(rod, self.force, element);
        let system = &self.system.elements[element];
        with_points!(rod.order().points(), system.tangent_rows::<P>(&data, x))
    }

    fn line_compliance(&self, rod: &Rod, element: usize, g: usize) -> Option<Matrix3<f64>> {
        let i = element * rod.order().points() + g;
        let frame = rod.frame_at_point(element, g);
        let along = frame.inverse_transform_vector(&self.force.at_points()[i]);
        let line = self
            .material
            .line_response(&Tissue::of(&rod.points()[i], self.time()), &along)?;
        let turn = frame.to_rotation_matrix().into_inner();
        Some(turn * line.compliance * turn.transpose())
    }

    fn stiffness(&self, point: &MaterialPoint) -> Matrix3<f64> {
        self.material
            .respond(&Tissue::of(point, self.time()), &Vector3::zeros())
            .tangent
    }

    fn strain_under(
        &self,
        point: &MaterialPoint,
        near: &Vector3<f64>,
        couple: &Vector3<f64>,
    ) -> Vector3<f64> {
        strain_near(
            self.material,
            &Tissue::of(point, self.time()),
            || *near,
            couple,
        )
    }

    fn strain_line(&self, rod: &Rod) -> Vec<Vector3<f64>> {
        strain_line(Vec::new(), rod, self.material, self.force)
    }
}
