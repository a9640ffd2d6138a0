//! Newton's method for a fixed point of the time-stepping map, with further unknowns: the period, a parameter.

use nalgebra::DVector;

use crate::cycle::error::CycleError;
use crate::cycle::map::march::{March, Path};
use crate::cycle::map::state::{Start, carried};
use crate::cycle::map::turn::Turn;
use crate::cycle::map::variation::Variation;
use crate::model::Model;
use crate::numerics::interpolation::lagrange;
use crate::numerics::krylov::gmres;

/// Krylov's subspaces grow up to this: a return map contracts all but a handful of directions.
const KRYLOV: usize = 80;
/// A linearisation is kept that leaves less than this share of what was left.
const SERVES: f64 = 0.2;
/// What a step of Newton's method leaves of its linear problem.
const LINEAR: f64 = 1e-4;
/// Step of the central differences by the period, relative: they err by 1e-10.
const STRETCH: f64 = 1e-5;

/// One minus the cosine of the angle between the change by time and that by a turn, below which they are one: an ellipse whose axes differ by
/// a thousandth has more.
const CIRCLE: f64 = 1e-7;

/// An unknown besides the state, with the condition that goes with it.
pub(crate) struct Further {
    /// How the end of a period changes with it.
    pub column: DVector<f64>,
    /// The condition: weights of the first numbers of the state, and of the first further unknowns.
    pub state: DVector<f64>,
    pub others: Vec<f64>,
}

/// The return map, linearised by the state and by further unknowns.
pub(crate) struct Linear {
    variation: Variation,
    further: Vec<Further>,
}

impl Linear {
    pub fn of(march: &March<impl Model>, period: f64, path: &Path, further: Vec<Further>) -> Result<Self, CycleError> {
        Ok(Self { variation: Variation::of(march, path, period)?, further })
    }

    /// One that was made when so much was left, as long as it has reduced that by much.
    pub fn that_serves(kept: Option<(Self, f64)>, residual: f64) -> Option<Self> {
        kept.and_then(|(linear, before)| (residual <= SERVES * before).then_some(linear))
    }

    /// The changes of the state and of the further unknowns, by what is left of the map and of the conditions, after so many iterations.
    pub fn step(
        &self,
        start: &Start,
        left: &DVector<f64>,
        conditions: &[f64],
        iterations: usize,
    ) -> Result<(DVector<f64>, Vec<f64>), CycleError> {
        let (size, more) = (left.len(), self.further.len());
        // Unknowns and conditions are measured so that they weigh as much as the others.
        let scales: Vec<f64> =
            self.further.iter().map(|one| one.column.norm().max(f64::MIN_POSITIVE).recip()).collect();
        let weights: Vec<f64> = self
            .further
            .iter()
            .map(|one| {
                let others = one.others.iter().zip(&scales).map(|(w, scale)| (w * scale).powi(2));
                (one.state.norm_squared() + others.sum::<f64>()).sqrt().max(f64::MIN_POSITIVE).recip()
            })
            .collect();
        let mut right = DVector::zeros(size + more);
        right.rows_mut(0, size).copy_from(left);
        for (k, (condition, weight)) in conditions.iter().zip(&weights).enumerate() {
            right[size + k] = condition * weight;
        }
        let (mut found, linear) = gmres(&right, LINEAR, KRYLOV, |x| {
            let mut out = x.clone();
            let change = x.rows(0, size).clone_owned();
            let mut rest = out.rows_mut(0, size);
            rest -= self.variation.apply(&start.with_values(&change))?.flat();
            for (k, one) in self.further.iter().enumerate() {
                rest.axpy(-x[size + k] * scales[k], &one.column, 1.0);
            }
            for (k, one) in self.further.iter().enumerate() {
                let others = one.others.iter().zip(&scales).enumerate().map(|(j, (w, scale))| w * scale * x[size + j]);
                out[size + k] = weights[k] * (one.state.dot(&change.rows(0, one.state.len())) + others.sum::<f64>());
            }
            Ok::<_, CycleError>(out)
        })?;
        // Krylov's method must reduce what is left.
        if !(linear < 0.5) {
            return Err(CycleError::NotConverged { iterations, residual: linear });
        }
        let others = (0..more).map(|k| found[size + k] * scales[k]).collect();
        found = found.rows(0, size).clone_owned();
        Ok((found, others))
    }
}

/// The logarithm of the period as an unknown: what would only shift the time is no change of the state.
///
/// Strain and variables both count, with weights: of a swing in which all goes to and fro at once, a change of the strain alone may be
/// one of the amplitude as well as one of the phase.
pub(crate) fn period_unknown(
    march: &mut March<impl Model>,
    start: &Start,
    period: f64,
    path: &Path,
    weights: &DVector<f64>,
) -> Result<Further, CycleError> {
    let ahead = march.run(start, period * (1.0 + STRETCH))?.end.flat();
    let behind = march.run(start, period * (1.0 - STRETCH))?.end.flat();
    let state = flow(march, start, path).component_mul(weights);
    Ok(Further { column: (ahead - behind) / (2.0 * STRETCH), state, others: Vec::new() })
}

/// The angle by which all is turned back as an unknown, if there is one: what would only turn all is no change of the state.
pub(crate) fn angle_unknown(
    march: &March<impl Model>,
    start: &Start,
    path: &Path,
    weights: &DVector<f64>,
) -> Result<Option<Further>, CycleError> {
    check_no_circle(march, start, path)?;
    Ok(march.turn.as_ref().map(|turn| {
        let state = turn.rate(start).present().component_mul(weights);
        Further { column: -turn.rate(&path.end).flat(), state, others: Vec::new() }
    }))
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
