//! How well the intervals of a period resolve an orbit.

use super::linear::ReturnMapJacobian;
use crate::cycle::error::CycleError;
use crate::cycle::extended::Bordered;
use crate::cycle::map::grid::Grid;
use crate::cycle::map::phase_state::PhaseState;
use crate::cycle::map::return_map::{ReturnMap, Trajectory};
use crate::model::Model;

/// Number of stages by which the second grid exceeds the first: its error is smaller by the square of an interval, in units of the time
/// in which the rates change.
const MORE: usize = 2;

/// Estimate of the relative error of period and shape that the intervals leave.
///
/// The orbit is mapped over a period on a grid with more stages. One step of Newton's method reduces the difference of start and end
/// there. The estimate is the largest of its changes of period and state and of the change of the strain along the period, relative. Strain
/// below `least` (1/m) counts as none.
pub(super) fn error_of(
    return_map: &ReturnMap<impl Model>,
    start: &PhaseState,
    period: f64,
    path: &Trajectory,
    linear: &Bordered<ReturnMapJacobian>,
    least: f64,
) -> Result<f64, CycleError> {
    let grid = Grid::new(return_map.grid.intervals, return_map.grid.order() + MORE);
    let mut fine = ReturnMap::new(return_map.shoot, grid, period, return_map.turn.as_ref().map(|turn| turn.angle))?;
    fine.kept = return_map.kept;
    let near = |stage: &f64| {
        let distance = |k: &usize| (return_map.grid.stages[*k] - stage).abs();
        (0..return_map.grid.order()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    let nearest: Vec<usize> = fine.grid.stages.iter().filter_map(near).collect();
    fine.guesses = path.stages.iter().flat_map(|stages| nearest.iter().map(|k| stages[*k].rod.clone())).collect();
    let finer = fine.run(&start.on_grid(&return_map.grid, &fine.grid, return_map.kept, 1.0), period)?;
    let end = finer.end.on_grid(&fine.grid, &return_map.grid, return_map.kept, 1.0);
    let update = linear.update(&(end.flat() - start.flat()), &[])?;
    let update = update.ok_or(CycleError::NotConverged { iterations: 0, residual: f64::INFINITY })?;
    let change = start.with_values(&update.state);
    let size = path.strains.iter().map(|strain| strain.norm()).fold(least, f64::max);
    let along = path.strains.iter().zip(&finer.strains).map(|(one, other)| (one - other).norm() / size);
    let all = along.chain([update.stretch.abs(), change.strain.norm() / size]);
    // `f64::max` would drop a NaN.
    Ok(all.fold(0.0, |largest, error| if error <= largest { largest } else { error }))
}
