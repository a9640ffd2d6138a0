//! Energy of a rod as a function of the frames at its nodes, with its derivatives: what a solver of
//! equilibria needs.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::EquilibriumError;
use super::element::{ElementData, ElementSystem};
use super::line::{check_line, strain_line};
use super::points::with_points;
use crate::constitutive::Constitutive;
use crate::load::InternalForce;
use crate::rod::Rod;

/// The energy of a rod under a load, as a function of the frames at its [nodes](Rod::node_frames),
///
/// ```text
/// Π = ∫ W(u − u*) + Φ(v) − n · p′ ds,   R′ = R û,   p′ = R v,
/// ```
///
/// with the elastic energies W of bending and twist and Φ of shear and stretch, and the force n in
/// the rod, equations (1) and (9) to (12). Its derivatives are by rotations φi of the frames, Ri →
/// Ri exp(φ̂i), with components along the directors of the node. The strain v follows from the
/// frames point by point and minimises the energy, so that it is not an unknown.
/// [`NewtonSolver`](super::NewtonSolver) minimises the same function, from the same elements. It
/// eliminates the nodes inside elements, whose rotation vectors it changes additively.
///
/// This is the interface for [solvers](super::EquilibriumSolver) outside the crate, together with
/// [`Rod::set_shape`](crate::rod::Rod::set_shape). The chapter [own
/// methods](crate::guide::own_methods) has examples.
///
/// ```
/// # use morphorod::{Order, Scene, Still, constitutive::LinearElastic, load::{InternalForce, Weight}, rod::Rod};
/// use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver, RodEnergy};
///
/// # let scene = Still::tilted(0.5);
/// # let mut rod = Rod::uniform(0.05, 0.5e-3, scene.base, 4, Order::Eight)?;
/// # let (tissue, load) = (LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 }, Weight { density: 1000.0 });
/// # let environment = scene.environment(0.0);
/// let force = InternalForce::of(&rod, &load, &environment);
/// let found = NewtonSolver::default().equilibrate(&mut rod, &tissue, &force)?;
/// let (energy, couples) = RodEnergy::new(&tissue, &force).couples(&rod)?;
/// assert!((energy - found.energy).abs() < 1e-12 * energy.abs());
/// // The couples balance, except that of the clamp at the base.
/// assert!(couples[1..].iter().all(|couple| couple.norm() < 1e-9 * couples[0].norm()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct RodEnergy<'a, C> {
    pub(super) material: &'a C,
    pub(super) force: &'a InternalForce,
}

impl<'a, C: Constitutive> RodEnergy<'a, C> {
    /// The energy under an elastic law and the force in a rod. The methods return
    /// [`Parameter`](EquilibriumError::Parameter) for a rod with another number of material points
    /// than the rod of the force. A force that was computed for other lengths or another time is
    /// not detected.
    #[must_use]
    pub fn new(material: &'a C, force: &'a InternalForce) -> Self {
        Self { material, force }
    }

    /// The energy Π at the frames of a rod, J.
    ///
    /// # Errors
    /// [`NotFinite`](EquilibriumError::NotFinite) for an energy that is not finite, and
    /// [`Parameter`](EquilibriumError::Parameter).
    pub fn energy(&self, rod: &Rod) -> Result<f64, EquilibriumError> {
        Ok(self.couples(rod)?.0)
    }

    /// The energy Π, J, and the residual: the unbalanced couples −∂Π/∂φi on the nodes, N m, along
    /// the directors of each node, [`Rod::nodes`](crate::rod::Rod::nodes) of them. They vanish in
    /// equilibrium, except that of the base, which is minus the couple of the clamp. The force of
    /// the clamp is minus [`InternalForce::at_base`].
    ///
    /// # Errors
    /// [`NotFinite`](EquilibriumError::NotFinite) for an energy or a couple that is not finite, and
    /// [`Parameter`](EquilibriumError::Parameter).
    pub fn couples(&self, rod: &Rod) -> Result<(f64, Vec<Vector3<f64>>), EquilibriumError> {
        self.force.check(rod)?;
        let (energy, mut gradient) = with_points!(rod.order().points(), self.gradient::<P>(rod));
        EquilibriumError::finite(energy.is_finite(), "energy of the elastic law")?;
        for slope in &mut gradient {
            *slope = -*slope;
            EquilibriumError::finite(slope.norm_squared().is_finite(), "couple on a node")?;
        }
        Ok((energy, gradient))
    }

    /// The tangent ∂²Π/∂φi∂φj, N m, which is exact at any frames, in equilibrium or not.
    ///
    /// A rotation φj changes the [couple](Self::couples) of node i by −∂²Π/∂φi∂φj · φj. The couple
    /// cj of the rotated node also changes by −½ φj × cj, since rotations do not commute. This part
    /// vanishes in equilibrium.
    ///
    /// # Errors
    /// [`NotFinite`](EquilibriumError::NotFinite) for an entry that is not finite, and
    /// [`Parameter`](EquilibriumError::Parameter).
    pub fn tangent(&self, rod: &Rod) -> Result<NodeTangent, EquilibriumError> {
        self.force.check(rod)?;
        let tangent = with_points!(rod.order().points(), self.hessian::<P>(rod));
        EquilibriumError::finite(
            tangent
                .blocks
                .iter()
                .all(|(.., block)| block.sum().is_finite()),
            "tangent",
        )?;
        Ok(tangent)
    }

    /// The strain v of the centre line at the material points that minimises the energy at the
    /// frames of a rod, along the directors; empty for a law without shear and stretch. A solver
    /// passes it to [`Rod::set_shape`](crate::rod::Rod::set_shape) with the frames of the
    /// equilibrium.
    ///
    /// # Errors
    /// [`Crushed`](EquilibriumError::Crushed), [`NotFinite`](EquilibriumError::NotFinite), and
    /// [`Parameter`](EquilibriumError::Parameter).
    pub fn line_strains(&self, rod: &Rod) -> Result<Vec<Vector3<f64>>, EquilibriumError> {
        self.force.check(rod)?;
        let strains = strain_line(Vec::new(), rod, self.material, self.force);
        check_line(&strains, self.force)?;
        Ok(strains)
    }

    fn gradient<const P: usize>(&self, rod: &Rod) -> (f64, Vec<Vector3<f64>>) {
        let (mut energy, mut element) = (0.0, ElementSystem::default());
        let mut gradient = vec![Vector3::zeros(); rod.nodes()];
        for e in 0..rod.elements() {
            let data = ElementData::of(rod, self.force, e);
            energy += element.evaluate::<P, false>(self.material, &data);
            element.add_node_gradient::<P>(&data, &mut gradient[e * P..=(e + 1) * P]);
        }
        (energy, gradient)
    }

    fn hessian<const P: usize>(&self, rod: &Rod) -> NodeTangent {
        let mut element = ElementSystem::default();
        let mut blocks: Vec<(usize, usize, Matrix3<f64>)> = Vec::new();
        for e in 0..rod.elements() {
            let data = ElementData::of(rod, self.force, e);
            element.evaluate::<P, true>(self.material, &data);
            let of_nodes = element.node_hessian::<P>(&data);
            // The last block of the element before has the same node.
            if let Some((.., last)) = blocks.last_mut() {
                *last += of_nodes[0][0];
            } else {
                blocks.push((0, 0, of_nodes[0][0]));
            }
            let pairs = (0..=P).flat_map(|k| (k..=P).map(move |l| (k, l))).skip(1);
            blocks.extend(pairs.map(|(k, l)| (e * P + k, e * P + l, of_nodes[k][l])));
        }
        NodeTangent {
            nodes: rod.nodes(),
            blocks,
        }
    }
}

/// The second derivative of the energy of a rod by the rotations of its nodes, N m: symmetric, with
/// full blocks of the p + 1 nodes of each element.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeTangent {
    nodes: usize,
    blocks: Vec<(usize, usize, Matrix3<f64>)>,
}

impl NodeTangent {
    /// The blocks on and above the diagonal: indices i ≤ j of two nodes, and ∂²Π/∂φi∂φj with the
    /// components of φi as rows. Each pair of nodes of an element occurs once. Node 0 is the base,
    /// whose rows and columns a solver for a clamped rod leaves out. The blocks can be written to a
    /// matrix of any library for linear algebra.
    pub fn blocks(&self) -> impl Iterator<Item = (usize, usize, &Matrix3<f64>)> {
        self.blocks.iter().map(|(i, j, block)| (*i, *j, block))
    }

    /// The whole matrix for the nodes except the base: component c of φi belongs to row 3 (i − 1) +
    /// c. Its memory grows with the square of the number of nodes.
    #[must_use]
    pub fn to_dense(&self) -> DMatrix<f64> {
        let size = 3 * (self.nodes - 1);
        let mut dense = DMatrix::zeros(size, size);
        for (i, j, block) in self.blocks().filter(|(i, ..)| *i > 0) {
            let (row, column) = (3 * (i - 1), 3 * (j - 1));
            dense.fixed_view_mut::<3, 3>(row, column).copy_from(block);
            dense
                .fixed_view_mut::<3, 3>(column, row)
                .copy_from(&block.transpose());
        }
        dense
    }
}
