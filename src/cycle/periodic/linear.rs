//! The linearised return map: its bordered linear systems, and its symmetries.

use nalgebra::DVector;

use crate::cycle::error::CycleError;
use crate::cycle::extended::{Border, Jacobian, Symmetry};
use crate::cycle::gmres::gmres;
use crate::cycle::map::march::{March, Path};
use crate::cycle::map::state::{Start, carried};
use crate::cycle::map::turn::Turn;
use crate::cycle::map::variation::Variation;
use crate::model::Model;
use crate::quadrature::lagrange;

/// Largest dimension of a Krylov subspace: a return map contracts all but a handful of directions.
const KRYLOV: usize = 80;
/// Relative residual to which the linear system of a Newton iteration is solved.
const LINEAR: f64 = 1e-4;
/// Relative residual above which it counts as unsolved.
const UNSOLVED: f64 = 0.5;
/// Step of the central differences by the period, relative: they err by 1e-10.
const STRETCH: f64 = 1e-5;

/// One minus the cosine of the angle between the change by time and that by a turn, below which they are one: an ellipse whose axes differ by
/// a thousandth has more.
const CIRCLE: f64 = 1e-7;

/// The derivative of the return map by the state.
pub struct Monodromy {
    variation: Variation,
    /// A state, for its sizes.
    start: Start,
}

impl Monodromy {
    pub(crate) fn of(march: &March<impl Model>, start: &Start, period: f64, path: &Path) -> Result<Self, CycleError> {
        Ok(Self { variation: Variation::of(march, path, period)?, start: start.clone() })
    }
}

impl Jacobian for Monodromy {
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
            rest -= self.variation.apply(&self.start.with_values(&change))?.flat();
            for (k, Border { column, .. }) in border.iter().enumerate() {
                rest.axpy(-x[size + k] * scales[k], column, 1.0);
            }
            for (k, Border { row, corner, .. }) in border.iter().enumerate() {
                out[size + k] = weights[k] * (row.dot(&change.rows(0, row.len())) + corner * scales[k] * x[size + k]);
            }
            Ok::<_, CycleError>(out)
        })?;
        let scalars = found.rows(size, more).component_mul(&scales);
        Ok((left < UNSOLVED).then(|| (found.rows(0, size).clone_owned(), scalars)))
    }
}

/// The symmetries of an orbit that nothing drives: shifts in time, with the logarithm of the period as the unknown, and rotations of the
/// whole, with the angle as the unknown if there is one.
pub(crate) fn symmetries(
    march: &mut March<impl Model>,
    start: &Start,
    period: f64,
    path: &Path,
) -> Result<Vec<Symmetry>, CycleError> {
    let ahead = march.run(start, period * (1.0 + STRETCH))?.end.flat();
    let behind = march.run(start, period * (1.0 - STRETCH))?.end.flat();
    let time = Symmetry { tangent: flow(march, start, path), column: (ahead - behind) / (2.0 * STRETCH) };
    check_no_circle(march, start, path)?;
    let rotation = march
        .turn
        .as_ref()
        .map(|turn| Symmetry { tangent: turn.rate(start).present(), column: -turn.rate(&path.end).flat() });
    Ok(std::iter::once(time).chain(rotation).collect())
}

/// Refuses a circle if an angle is unknown: it returns rotated after any time.
pub(crate) fn check_no_circle(march: &March<impl Model>, start: &Start, path: &Path) -> Result<(), CycleError> {
    let circle = march.turn.as_ref().is_some_and(|turn| is_circle(march, start, path, turn));
    if circle { Err(CycleError::Circle) } else { Ok(()) }
}

/// Whether the change of a state in time is a rotation of the whole.
pub(crate) fn is_circle(march: &March<impl Model>, start: &Start, path: &Path, turn: &Turn) -> bool {
    let weights = start.weights().map(f64::sqrt);
    let [time, turned] =
        [flow(march, start, path), turn.rate(start).present()].map(|direction| direction.component_mul(&weights));
    time.dot(&turned).abs() > (1.0 - CIRCLE) * time.norm() * turned.norm()
}

/// How strain and variables change in time at the start, per interval.
pub(crate) fn flow(march: &March<impl Model>, start: &Start, path: &Path) -> DVector<f64> {
    // Of the strain by extrapolation, of the variables at the last point of the last interval.
    let mut at_start = vec![0.0; march.grid.order()];
    lagrange(&march.grid.stages, 0.0, &mut at_start);
    let strain = carried(&DVector::zeros(start.strain.len()), &path.strain_slopes[0], &at_start);
    let variables = start.slopes.last().and_then(|slopes| slopes.last());
    let all = strain.iter().chain(variables.iter().flat_map(|rate| rate.iter())).copied();
    DVector::from_vec(all.collect())
}
