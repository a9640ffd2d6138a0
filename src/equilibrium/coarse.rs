//! Initial guess for a straight rod: its equilibrium on a coarser mesh.

use nalgebra::Vector3;

use super::RodEnergy;
use super::search::NewtonSearch;
use crate::constitutive::Constitutive;
use crate::reference_element::MAX_POINTS;
use crate::rod::Rod;

/// Number of elements that a coarse element replaces. The three or four tangents of a search from
/// the straight shape cost as much as one on the mesh of the rod.
const RATIO: usize = 4;
/// Smallest number of elements for which a coarse mesh saves time.
const SMALLEST: usize = 3;
/// Largest error of a frame on the coarse mesh, rad. One Newton step and chord steps reduce it to
/// rounding.
const TOLERANCE: f64 = 1e-3;
/// Largest number of iterations on the coarse mesh, which cost as much as four on the mesh of the
/// rod.
const ITERATIONS: usize = 16;
/// Smallest resistance of a shape on the coarse mesh. The error of this mesh might hide that a
/// shape with less is unstable, which [`Equilibrium::jump`](super::Equilibrium::jump) has to
/// report.
const RESISTANCE: f64 = 0.3;

impl<C: Constitutive> NewtonSearch<'_, C> {
    /// Gives a straight rod the shape of its equilibrium on a coarser mesh, if it bends and all
    /// shapes of the search are far from instability. Returns whether the shape has changed.
    pub(super) fn guess_on_coarse_mesh(&mut self, rod: &mut Rod) -> bool {
        let p = rod.order().points();
        // A coarse mesh of a lower order is too inaccurate: unstable straight shapes were stable on
        // it.
        if !self.stable || p < MAX_POINTS || rod.elements() < SMALLEST || !self.bends_straight(rod)
        {
            return false;
        }
        let Some((mut coarse, places)) = rod.coarsened(RATIO) else {
            return false;
        };
        let force = self.body.force.interpolated(p, &places);
        let body = RodEnergy::new(self.body.material, &force);
        let mut system = self.system.coarse.take().unwrap_or_default();
        let mut search = NewtonSearch::new(&mut system, &coarse, &body, true, TOLERANCE);
        search.least_resistance = RESISTANCE;
        let found = search.run(&mut coarse, ITERATIONS);
        self.system.coarse = Some(system);
        if found.is_err() {
            return false;
        }
        self.system.initial.keep(rod);
        rod.sample_shape(&coarse);
        true
    }

    /// Whether a rod is straight, and bends under its intrinsic strain or a force across it.
    fn bends_straight(&self, rod: &Rod) -> bool {
        let tangent = rod.frames()[0] * Vector3::z();
        rod.rotations.iter().all(|theta| *theta == Vector3::zeros())
            && (self
                .body
                .force
                .at_points()
                .iter()
                .any(|force| tangent.cross(force) != Vector3::zeros())
                || rod
                    .points()
                    .iter()
                    .any(|point| point.intrinsic != Vector3::zeros()))
    }
}
