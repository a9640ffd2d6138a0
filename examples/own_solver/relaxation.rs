//! Dynamic relaxation: the rod moves as if its nodes had inertia, until it rests in an equilibrium.

use morphorod::constitutive::{Constitutive, Tissue};
use morphorod::equilibrium::{Equilibrium, EquilibriumError, EquilibriumSolver, RodEnergy};
use morphorod::load::InternalForce;
use morphorod::rod::Rod;
use nalgebra::{UnitQuaternion, Vector3};

/// Ratio of the inertia of a node to the smallest one with which a step of unit time is stable: the
/// tangent changes while the rod moves.
const INERTIA: f64 = 2.0;

/// Solver by dynamic relaxation with kinetic damping.
///
/// A step of unit time adds the unbalanced couple of each node, over its inertia, to its angular
/// velocity, and rotates the node by this velocity. The inertia is proportional to the sum of the
/// row of the tangent, the bound of Gershgorin for its eigenvalues, so that the steps are stable.
/// Where the motion begins to increase the energy, all velocities are set to zero. The method needs
/// no linear solver, and its number of steps is proportional to the number of nodes.
#[derive(Debug, Clone, Copy)]
pub struct DynamicRelaxation {
    /// Largest acceptable error of a frame, rad.
    pub tolerance: f64,
    /// Largest number of steps.
    pub max_steps: usize,
}

impl EquilibriumSolver for DynamicRelaxation {
    fn equilibrate(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        let energy = RodEnergy::new(material, force);
        let compliance = compliance(rod, material, force.environment().time);
        // The rod itself changes only when an equilibrium is found.
        let (mut shape, mut frames) = (rod.clone(), rod.node_frames());
        let mut inertia = inertia(&shape, &energy)?;
        let mut velocities = vec![Vector3::zeros(); frames.len()];
        let (mut found, mut largest) = (Equilibrium::default(), 0.0);
        for step in 1..=self.max_steps {
            let (value, couples) = energy.couples(&shape)?;
            (found.evaluations, found.energy) = (step, value);
            // A couple on a node rotates the nodes beyond it by at most the couple times the
            // compliance.
            largest = couples[1..].iter().map(Vector3::norm).fold(0.0, f64::max);
            found.error = couples[1..].iter().map(Vector3::norm).sum::<f64>() * compliance;
            if found.error <= self.tolerance {
                rod.set_shape(&frames, &energy.line_strains(&shape)?)?;
                return Ok(found);
            }
            let power: f64 = couples
                .iter()
                .zip(&velocities)
                .skip(1)
                .map(|(c, v)| c.dot(v))
                .sum();
            if power < 0.0 {
                velocities.fill(Vector3::zeros());
                inertia = self::inertia(&shape, &energy)?;
            }
            for i in 1..frames.len() {
                velocities[i] += couples[i] / inertia[i];
                frames[i] = UnitQuaternion::new_normalize(
                    (frames[i] * rotation(&velocities[i])).into_inner(),
                );
            }
            shape.set_shape(&frames, &[])?;
        }
        Err(EquilibriumError::NoConvergence {
            iterations: self.max_steps,
            step: velocities.iter().map(Vector3::norm).fold(0.0, f64::max),
            residual: largest,
            force: force.largest(),
            contact: None,
        })
    }
}

/// The rotation by a rotation vector along the directors, rad.
fn rotation(vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(*vector)
}

/// The inertia of each node, N m s² with a step of one second: the sums of the rows of the tangent
/// over four are stable.
fn inertia(
    shape: &Rod,
    energy: &RodEnergy<'_, impl Constitutive>,
) -> Result<Vec<f64>, EquilibriumError> {
    let mut sums = vec![0.0; shape.nodes()];
    for (i, j, block) in energy.tangent(shape)?.blocks() {
        let size = block.norm();
        sums[i] += size;
        if i != j {
            sums[j] += size;
        }
    }
    Ok(sums.into_iter().map(|sum| 0.25 * INERTIA * sum).collect())
}

/// Largest rotation of the apex by a couple of 1 N m, ∫ ds/K with the smallest stiffness K, rad/(N
/// m).
fn compliance(rod: &Rod, material: &impl Constitutive, time: f64) -> f64 {
    let p = rod.order().points();
    let stiffness = |tissue: &Tissue| {
        material
            .respond(tissue, &Vector3::zeros())
            .tangent
            .diagonal()
            .min()
    };
    let of_element = |e: usize| {
        let points = &rod.points()[e * p..(e + 1) * p];
        let least = points
            .iter()
            .map(|point| stiffness(&Tissue::of(point, time)))
            .fold(f64::INFINITY, f64::min);
        rod.element_length(e).unwrap_or(0.0) / least
    };
    (0..rod.elements()).map(of_element).sum()
}
