//! Pseudo-arclength continuation of equilibria in a parameter of the load, through folds.

use morphorod::Environment;
use morphorod::constitutive::Constitutive;
use morphorod::equilibrium::{EquilibriumError, RodEnergy};
use morphorod::load::{InternalForce, Load};
use morphorod::rod::Rod;
use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};

/// Largest number of corrections of a point.
const MAX_CORRECTIONS: usize = 20;
/// Rotation of a correction, rad, and change of the parameter after which only rounding remains,
/// since Newton's method squares the error.
const NEGLIGIBLE: f64 = 1e-8;

/// Rods of a family: an elastic law, and a load that depends on a parameter.
pub struct Family<'a, C, F> {
    pub material: &'a C,
    pub load: F,
    pub environment: Environment,
    /// Change of the parameter that counts as much as a mean rotation of 1 rad.
    pub scale: f64,
}

/// Point of a branch of equilibria.
#[derive(Debug, Clone)]
pub struct Point {
    /// Parameter of the load.
    pub parameter: f64,
    /// The rod in equilibrium.
    pub rod: Rod,
    /// Number of negative eigenvalues of the tangent: zero for a stable equilibrium.
    pub negative: usize,
    /// Unit tangent of the branch: rotations of the nodes except the base (rad), then the scaled
    /// parameter.
    pub direction: DVector<f64>,
}

impl Point {
    /// Derivative of the parameter by arclength: zero at a fold.
    pub fn slope(&self) -> f64 {
        self.direction[self.direction.len() - 1]
    }
}

impl<C: Constitutive, L: Load, F: Fn(f64) -> L> Family<'_, C, F> {
    /// The point at a parameter, by Newton's method from a rod close to it. The branch goes towards
    /// increasing parameters.
    pub fn begin(&self, rod: &Rod, parameter: f64) -> Result<Point, EquilibriumError> {
        let mut direction = DVector::zeros(3 * (rod.nodes() - 1) + 1);
        let last = direction.len() - 1;
        direction[last] = 1.0;
        let start = Point {
            parameter,
            rod: rod.clone(),
            negative: 0,
            direction,
        };
        // Orthogonal to this direction the parameter does not change.
        self.correct(&start, 0.0)
    }

    /// The point at a distance `step` along the branch.
    pub fn advance(&self, from: &Point, step: f64) -> Result<Point, EquilibriumError> {
        self.correct(from, step)
    }

    /// The fold between two points of which the second is at a distance `step` from the first:
    /// bisection and secants for the distance at which the slope vanishes.
    pub fn fold(&self, from: &Point, step: f64) -> Result<Point, EquilibriumError> {
        let (mut near, mut far) = (
            (0.0, from.slope()),
            (step, self.advance(from, step)?.slope()),
        );
        loop {
            let secant = near.0 - near.1 * (far.0 - near.0) / (far.1 - near.1);
            let width = far.0 - near.0;
            // The secant alone would keep one end.
            let distance = secant.clamp(near.0 + 0.1 * width, far.0 - 0.1 * width);
            let point = self.advance(from, distance)?;
            // The error of the parameter is quadratic in that of the distance.
            if width < NEGLIGIBLE * step || point.slope().abs() < NEGLIGIBLE {
                return Ok(point);
            }
            let at = (distance, point.slope());
            if at.1 * near.1 > 0.0 {
                near = at
            } else {
                far = at
            }
        }
    }

    /// Newton's method for the equilibrium at a distance along the direction of a point.
    fn correct(&self, from: &Point, step: f64) -> Result<Point, EquilibriumError> {
        let mut rod = from.rod.clone();
        let (unknowns, mut parameter) = (from.direction.len() - 1, from.parameter);
        let mut change = &from.direction * step;
        for iteration in 0..=MAX_CORRECTIONS {
            rotate(&mut rod, &change)?;
            parameter += self.scale * change[unknowns];
            let (couples, bordered) = self.linearise(&rod, parameter, &from.direction)?;
            let factors = bordered.lu();
            if iteration > 0 && change.amax() < NEGLIGIBLE {
                // The direction of the branch keeps couples and solves the bordered system with
                // unit projection.
                let unit =
                    DVector::from_fn(unknowns + 1, |row, _| f64::from(u8::from(row == unknowns)));
                let direction = factors
                    .solve(&unit)
                    .ok_or(EquilibriumError::NotFinite { what: "direction" })?;
                let direction = &direction / self.norm(&direction);
                let force = self.force(&rod, parameter);
                let tangent = RodEnergy::new(self.material, &force)
                    .tangent(&rod)?
                    .to_dense();
                let negative = tangent
                    .symmetric_eigenvalues()
                    .iter()
                    .filter(|value| **value < 0.0)
                    .count();
                return Ok(Point {
                    parameter,
                    rod,
                    negative,
                    direction,
                });
            }
            // The condition of the arclength is linear, and holds since the prediction.
            change = DVector::zeros(unknowns + 1);
            change.rows_mut(0, unknowns).copy_from(&couples);
            change = factors
                .solve(&change)
                .ok_or(EquilibriumError::NotFinite { what: "correction" })?;
        }
        let (residual, force) = (0.0, 0.0);
        Err(EquilibriumError::NoConvergence {
            iterations: MAX_CORRECTIONS,
            step: change.amax(),
            residual,
            force,
            contact: None,
        })
    }

    fn force(&self, rod: &Rod, parameter: f64) -> InternalForce {
        InternalForce::of(rod, &(self.load)(parameter), &self.environment)
    }

    /// The unbalanced couples of the nodes except the base, and the tangent bordered by the
    /// derivative by the scaled parameter and by a direction.
    fn linearise(
        &self,
        rod: &Rod,
        parameter: f64,
        direction: &DVector<f64>,
    ) -> Result<(DVector<f64>, DMatrix<f64>), EquilibriumError> {
        let couples = |parameter: f64| -> Result<DVector<f64>, EquilibriumError> {
            let (_, couples) =
                RodEnergy::new(self.material, &self.force(rod, parameter)).couples(rod)?;
            let free = couples[1..]
                .iter()
                .flat_map(|couple| couple.iter().copied());
            Ok(DVector::from_iterator(direction.len() - 1, free))
        };
        let unknowns = direction.len() - 1;
        let mut bordered = DMatrix::zeros(unknowns + 1, unknowns + 1);
        let force = self.force(rod, parameter);
        let tangent = RodEnergy::new(self.material, &force)
            .tangent(rod)?
            .to_dense();
        bordered
            .view_mut((0, 0), (unknowns, unknowns))
            .copy_from(&tangent);
        // The couples are linear in a dead load, so that a difference is exact up to rounding.
        let by_parameter = couples(parameter + self.scale)? - couples(parameter)?;
        bordered
            .view_mut((0, unknowns), (unknowns, 1))
            .copy_from(&-by_parameter);
        let weight = 1.0 / unknowns as f64;
        bordered
            .view_mut((unknowns, 0), (1, unknowns))
            .copy_from(&(direction.rows(0, unknowns).transpose() * weight));
        bordered[(unknowns, unknowns)] = direction[unknowns];
        Ok((couples(parameter)?, bordered))
    }

    /// Norm of a direction: root mean square of the rotations, and scaled parameter.
    fn norm(&self, direction: &DVector<f64>) -> f64 {
        let unknowns = direction.len() - 1;
        (direction.rows(0, unknowns).norm_squared() / unknowns as f64 + direction[unknowns].powi(2))
            .sqrt()
    }
}

/// Rotates the nodes of a rod except the base by rotation vectors along their directors, rad.
fn rotate(rod: &mut Rod, change: &DVector<f64>) -> Result<(), EquilibriumError> {
    let mut frames = rod.node_frames();
    for (frame, turn) in frames[1..]
        .iter_mut()
        .zip(change.as_slice().chunks_exact(3))
    {
        *frame *= UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(turn));
    }
    Ok(rod.set_shape(&frames, &[])?)
}
