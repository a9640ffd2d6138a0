//! The linearised return map: its bordered linear systems, and its symmetries.

use nalgebra::DVector;

use crate::cycle::error::CycleError;
use crate::cycle::extended::{Border, DIFFERENCE, Jacobian, Symmetry};
use crate::cycle::map::monodromy::Monodromy;
use crate::cycle::map::phase_state::{PhaseState, carried};
use crate::cycle::map::return_map::{ReturnMap, Trajectory};
use crate::cycle::map::rotation::StateRotation;
use crate::model::Model;
use crate::numerics::interpolation::lagrange;
use crate::numerics::krylov::gmres;

/// Largest dimension of a Krylov subspace: a return map contracts all but a handful of directions.
const KRYLOV: usize = 80;
/// Relative residual to which the linear system of a Newton iteration is solved.
const LINEAR: f64 = 1e-4;

/// One minus the cosine of the angle between the tangents of time and rotation, below which an orbit is a rotating wave. An ellipse whose
/// axes differ by a thousandth has more.
const CIRCLE: f64 = 1e-7;

/// The derivative of the return map by the state.
pub struct ReturnMapJacobian {
    monodromy: Monodromy,
    /// A state, for its sizes.
    start: PhaseState,
}

impl ReturnMapJacobian {
    pub(crate) fn of(
        return_map: &ReturnMap<impl Model>,
        start: &PhaseState,
        period: f64,
        path: &Trajectory,
    ) -> Result<Self, CycleError> {
        Ok(Self { monodromy: Monodromy::of(return_map, path, period)?, start: start.clone() })
    }
}

impl Jacobian for ReturnMapJacobian {
    fn solve(
        &self,
        border: &[Border],
        residual: &DVector<f64>,
        conditions: &[f64],
    ) -> Result<Option<(DVector<f64>, DVector<f64>)>, CycleError> {
        let (size, more) = (residual.len(), border.len());
        // Scalar unknowns and conditions are scaled to the size of the others.
        let inverse = |norm: f64| norm.max(f64::MIN_POSITIVE).recip();
        let scales = DVector::from_fn(more, |k, _| inverse(border[k].column.norm()));
        let weights = DVector::from_fn(more, |k, _| inverse(border[k].row.norm().hypot(border[k].corner * scales[k])));
        let mut right = residual.clone().resize_vertically(size + more, 0.0);
        for (k, condition) in conditions.iter().enumerate() {
            right[size + k] = condition * weights[k];
        }
        let (found, left) = gmres(&right, LINEAR, KRYLOV, |x| {
            let mut out = x.clone();
            let change = x.rows(0, size).clone_owned();
            let mut rest = out.rows_mut(0, size);
            rest -= self.monodromy.apply(&self.start.with_values(&change))?.flat();
            for (k, Border { column, .. }) in border.iter().enumerate() {
                rest.axpy(-x[size + k] * scales[k], column, 1.0);
            }
            for (k, Border { row, corner, .. }) in border.iter().enumerate() {
                out[size + k] = weights[k] * (row.dot(&change.rows(0, row.len())) + corner * scales[k] * x[size + k]);
            }
            Ok::<_, CycleError>(out)
        })?;
        let scalars = found.rows(size, more).component_mul(&scales);
        // A system whose residual is not even halved is not solved.
        Ok((left < 0.5).then(|| (found.rows(0, size).clone_owned(), scalars)))
    }
}

/// The symmetries of an orbit that nothing drives: shifts in time, with the logarithm of the period as the unknown, and rotations of the
/// whole, with the angle as the unknown if there is one.
pub(crate) fn symmetries(
    return_map: &mut ReturnMap<impl Model>,
    start: &PhaseState,
    period: f64,
    path: &Trajectory,
) -> Result<Vec<Symmetry>, CycleError> {
    let ahead = return_map.run(start, period * (1.0 + DIFFERENCE))?.end.flat();
    let behind = return_map.run(start, period * (1.0 - DIFFERENCE))?.end.flat();
    let time = Symmetry { tangent: flow(return_map, start, path), column: (ahead - behind) / (2.0 * DIFFERENCE) };
    check_no_circle(return_map, start, path)?;
    let rotation = return_map
        .turn
        .as_ref()
        .map(|turn| Symmetry { tangent: turn.rate(start).present(), column: -turn.rate(&path.end).flat() });
    Ok(std::iter::once(time).chain(rotation).collect())
}

/// Refuses a circle if an angle is unknown: it returns rotated after any time.
pub(crate) fn check_no_circle(
    return_map: &ReturnMap<impl Model>,
    start: &PhaseState,
    path: &Trajectory,
) -> Result<(), CycleError> {
    let circle = return_map.turn.as_ref().is_some_and(|turn| is_circle(return_map, start, path, turn));
    if circle { Err(CycleError::RotatingWave) } else { Ok(()) }
}

/// Whether the change of a state in time is a rotation of the whole.
pub(crate) fn is_circle(
    return_map: &ReturnMap<impl Model>,
    start: &PhaseState,
    path: &Trajectory,
    turn: &StateRotation,
) -> bool {
    let weights = start.weights().map(f64::sqrt);
    let [time, turned] =
        [flow(return_map, start, path), turn.rate(start).present()].map(|direction| direction.component_mul(&weights));
    time.dot(&turned).abs() > (1.0 - CIRCLE) * time.norm() * turned.norm()
}

/// Derivative of strain and variables in time at the start, per interval.
pub(crate) fn flow(return_map: &ReturnMap<impl Model>, start: &PhaseState, path: &Trajectory) -> DVector<f64> {
    // The derivative of the strain is extrapolated. That of the variables is known at the last point of the last interval.
    let mut at_start = vec![0.0; return_map.grid.order()];
    lagrange(&return_map.grid.stages, 0.0, &mut at_start);
    let strain = carried(&DVector::zeros(start.strain.len()), &path.strain_slopes[0], &at_start);
    let variables = start.slopes.last().and_then(|slopes| slopes.last());
    let all = strain.iter().chain(variables.iter().flat_map(|rate| rate.iter())).copied();
    DVector::from_vec(all.collect())
}
