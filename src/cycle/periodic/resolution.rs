//! Error estimate of a periodic orbit, by comparison with a grid of higher order.

use super::linear::Traced;
use crate::cycle::error::{CycleError, Outcome};
use crate::cycle::extended::BorderedSystem;
use crate::cycle::map::{Monodromy, ReturnMap, TimeGrid};
use crate::model::Model;
use crate::numerics::scalar::largest;

/// Estimates the relative error of period and shape due to the grid.
///
/// The orbit is mapped over a period on a grid with two more stages, whose error is smaller by the
/// square of the length of an interval over the time scale of the rates. One Newton step corrects
/// the difference of start and end there. The estimate is the largest relative change of the
/// period, of the state, and of the strain along the orbit.
pub(super) fn error_of(
    traced: &Traced<impl Model>,
    linear: &BorderedSystem<Monodromy>,
) -> Outcome<f64> {
    let Traced {
        at,
        return_map,
        path,
        ..
    } = traced;
    let (start, period, kept) = (&path.start, path.period, return_map.kept);
    let grid = TimeGrid::new(return_map.grid.intervals, return_map.grid.order() + 2);
    let mut fine = ReturnMap::new(
        return_map.shoot,
        grid,
        period,
        return_map.turn.as_ref().map(|turn| turn.angle),
    )?;
    fine.kept = kept;
    let near = |stage: &f64| {
        let distance = |k: &usize| (return_map.grid.stages[*k] - stage).abs();
        (0..return_map.grid.order()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    let nearest: Vec<usize> = fine.grid.stages.iter().filter_map(near).collect();
    fine.guesses = path
        .stages
        .iter()
        .flat_map(|stages| nearest.iter().map(|k| stages[*k].rod.clone()))
        .collect();
    let finer = fine.run(
        &start.on_grid(&return_map.grid, &fine.grid, kept, 1.0),
        period,
    )?;
    let end = finer.end.on_grid(&fine.grid, &return_map.grid, kept, 1.0);
    let update = linear.update(at, &(end.flat() - start.flat()), &[])?;
    let update = update.ok_or(CycleError::not_converged(0, f64::INFINITY))?;
    let size = path
        .strains
        .iter()
        .map(|strain| strain.norm())
        .fold(traced.least(), f64::max);
    let along = path
        .strains
        .iter()
        .zip(&finer.strains)
        .map(|(one, other)| (one - other).norm() / size);
    let all = along.chain([
        (update.period_or_rate / period).abs(),
        update.start.strain.norm() / size,
    ]);
    // `f64::max` would drop a NaN.
    Ok(largest(all))
}
