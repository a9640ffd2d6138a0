//! The return map along a trajectory: its bordered linear systems, and the tangents of its
//! symmetries.

use nalgebra::DVector;

use super::PeriodicSolver;
use crate::cycle::error::{CycleError, Outcome};
use crate::cycle::extended::{Border, DIFFERENCE, OrbitUnknowns, StateJacobian, Symmetry};
use crate::cycle::map::{Monodromy, PRECISE, ReturnMap, StateRotation, Trajectory, carried};
use crate::model::Model;
use crate::numerics::interpolation::lagrange_value;
use crate::numerics::krylov::gmres;
use crate::rod::Rod;
use crate::shoot::Shoot;

/// Largest dimension of a Krylov subspace. A return map contracts all but about ten directions.
const KRYLOV: usize = 80;
/// Relative residual of the linear system of a Newton iteration.
const LINEAR: f64 = 1e-4;
/// One minus the cosine of the angle between the tangents of time and rotation, below which an
/// orbit is a rotating wave. An ellipse whose axes differ by a thousandth has more.
const CIRCLE: f64 = 1e-7;

/// The Jacobian J of the residual is the monodromy operator M minus the identity. GMRES solves the
/// bordered system of [`extended`](crate::cycle::extended) with the signs of its first rows
/// reversed: (I − M) δx − Σ columns δs = residual.
impl StateJacobian for Monodromy {
    fn solve(&self, border: &[Border], residuals: &DVector<f64>) -> Outcome<Option<DVector<f64>>> {
        let (size, more) = (residuals.len() - border.len(), border.len());
        // Scalar unknowns and conditions are scaled such that columns and rows have norm one.
        let inverse = |norm: f64| norm.max(f64::MIN_POSITIVE).recip();
        let scales = DVector::from_fn(more, |k, _| inverse(border[k].column.norm()));
        let weights = DVector::from_fn(more, |k, _| {
            inverse(border[k].row.norm().hypot(border[k].corner * scales[k]))
        });
        let mut right = residuals.clone();
        right.rows_mut(size, more).component_mul_assign(&weights);
        let (mut found, left) = gmres(&right, LINEAR, KRYLOV, |x| {
            let mut out = x.clone();
            let change = x.rows(0, size).clone_owned();
            let mut state = out.rows_mut(0, size);
            state -= self.apply_flat(&change)?;
            for (
                k,
                Border {
                    column,
                    row,
                    corner,
                },
            ) in border.iter().enumerate()
            {
                out.rows_mut(0, size)
                    .axpy(-x[size + k] * scales[k], column, 1.0);
                out[size + k] = weights[k]
                    * (row.dot(&change.rows(0, row.len())) + corner * scales[k] * x[size + k]);
            }
            Ok::<_, CycleError>(out)
        })?;
        found.rows_mut(size, more).component_mul_assign(&scales);
        // GMRES fails if it does not even halve the residual.
        Ok((left < 0.5).then_some(found))
    }
}

/// A state that has been mapped over a period: its trajectory, and the return map that made it.
pub struct Traced<'a, M: Model> {
    /// Settings of the map and of its residual.
    pub(crate) solver: PeriodicSolver,
    /// Unknowns at the beginning of the period.
    pub(crate) at: OrbitUnknowns,
    pub(crate) return_map: ReturnMap<'a, M>,
    pub(crate) path: Trajectory,
}

impl<'a, M: Model> Traced<'a, M> {
    /// Maps a state over a period, and rotates the result back by the angle. `rods` are initial
    /// guesses of the equilibria.
    pub(crate) fn of(
        solver: PeriodicSolver,
        shoot: &'a Shoot<M>,
        at: OrbitUnknowns,
        rods: Vec<Rod>,
    ) -> Outcome<Self> {
        let mut return_map = solver.return_map(shoot, at.period_or_rate)?;
        at.start
            .check(return_map.places.len(), return_map.laws.size().variables)?;
        (return_map.kept, return_map.guesses) = (at.start.slopes.len(), rods);
        return_map
            .turn
            .iter_mut()
            .for_each(|turn| turn.angle = at.angle);
        let path = return_map.run(&at.start, at.period_or_rate)?;
        Ok(Self {
            solver,
            at,
            return_map,
            path,
        })
    }

    /// Smallest norm of the strain in a residual, 1/m. The strain of a forced orbit may be zero up
    /// to the rounding of equilibria.
    pub(crate) fn least(&self) -> f64 {
        let length = self.return_map.shoot.rod().length();
        if self.at.forced {
            PRECISE / (self.solver.tolerance * length)
        } else {
            f64::MIN_POSITIVE
        }
    }

    /// The symmetries of an autonomous orbit: the shift in time, whose unknown is the logarithm of
    /// the period, and the rotation, whose unknown is the angle, if there is one.
    pub(crate) fn symmetries(&mut self) -> Outcome<Vec<Symmetry>> {
        let Self {
            return_map, path, ..
        } = self;
        let ahead = return_map
            .run(&path.start, path.period * (1.0 + DIFFERENCE))?
            .end
            .flat();
        let behind = return_map
            .run(&path.start, path.period * (1.0 - DIFFERENCE))?
            .end
            .flat();
        let by_angle = return_map
            .turn
            .as_ref()
            .map(|turn| -turn.rate(&path.end).flat());
        let columns = std::iter::once((ahead - behind) / (2.0 * DIFFERENCE)).chain(by_angle);
        self.check_not_circular()?;
        Ok(self
            .tangents()
            .zip(columns)
            .map(|(tangent, column)| Symmetry { tangent, column })
            .collect())
    }

    /// The tangents of the symmetries at the beginning of the period.
    pub(crate) fn tangents(&self) -> impl Iterator<Item = DVector<f64>> {
        let rotation = self
            .return_map
            .turn
            .as_ref()
            .map(|turn| turn.rate(&self.path.start).present());
        std::iter::once(self.flow()).chain(rotation)
    }

    /// Returns an error for a rotating wave if the angle is unknown: it returns rotated after any
    /// time.
    pub(crate) fn check_not_circular(&self) -> Outcome {
        let circular = self
            .return_map
            .turn
            .as_ref()
            .is_some_and(|turn| self.is_circular(turn));
        if circular {
            Err(CycleError::RotatingWave)
        } else {
            Ok(())
        }
    }

    /// Whether the tangents of a shift in time and of a rotation are parallel.
    pub(crate) fn is_circular(&self, turn: &StateRotation) -> bool {
        let start = &self.path.start;
        let weights = start.weights().map(f64::sqrt);
        let [time, rotation] = [self.flow(), turn.rate(start).present()]
            .map(|tangent| tangent.component_mul(&weights));
        time.dot(&rotation).abs() > (1.0 - CIRCLE) * time.norm() * rotation.norm()
    }

    /// Derivative of strain and variables by time at the beginning of the period, times the length
    /// of an interval.
    pub(crate) fn flow(&self) -> DVector<f64> {
        // The slope of the strain is extrapolated. That of the variables is the one at the last
        // Radau point of the past.
        let Self {
            return_map, path, ..
        } = self;
        let stages = &return_map.grid.stages;
        let at_start: Vec<f64> = (0..stages.len())
            .map(|k| lagrange_value(stages, k, 0.0))
            .collect();
        let strain = carried(
            &DVector::zeros(path.start.strain.len()),
            &path.strain_slopes[0],
            &at_start,
        );
        let variables = path.start.slopes.last().and_then(|slopes| slopes.last());
        let all = strain
            .iter()
            .chain(variables.iter().flat_map(|rate| rate.iter()))
            .copied();
        DVector::from_vec(all.collect())
    }
}
