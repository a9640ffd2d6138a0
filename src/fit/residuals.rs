//! Differences between a simulated shoot and the data.

use std::f64::consts::{PI, TAU};
use std::fmt::Display;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::Vector3;

use super::series::Series;
use super::{Family, FitError};
use crate::equilibrium::NewtonSolver;
use crate::integrator::{Grid, IntegrationError, Integrator, MethodOfSteps};
use crate::model::{GrowthLaw, Model, next_discontinuity};
use crate::numerics::interpolation::lagrange;
use crate::numerics::scalar::sort_by_value;
use crate::rod::Rod;
use crate::shoot::Shoot;

/// Tolerance of the equilibria of a fit, rad. Difference quotients of runs require equilibria that
/// are accurate to rounding.
const EQUILIBRIUM: f64 = 1e-11;

/// Number of intervals between the points of the centre line with which the search for the nearest
/// point begins.
const INTERVALS: usize = 32;

/// Accuracy of the arc length of the nearest point, relative to the length of the shoot. The
/// distance across the tangent changes with the square of an error of the arc length.
const NEAREST: f64 = 1e-8;

/// Largest number of iterations for the arc length of the nearest point.
const ITERATIONS: usize = 20;

/// Number of points of an interpolation. With a tenth of a period between them, its error is 4e-4
/// of the amplitude.
const NODES: usize = 6;

/// Shortest piece of a path over the time step. Shorter ones are rounding.
const SHORTEST: f64 = 1e-3;

/// Origin of a residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Origin {
    /// Index of the series.
    pub series: usize,
    /// Index of the residual in its frame.
    pub index: usize,
    /// Time of the frame, s.
    pub time: f64,
}

/// Residuals of a run (simulated minus measured coordinates, in the unit of the data, or angles,
/// rad) in the order of time, and the grid of the run.
pub(super) type Output = (Vec<(Origin, f64)>, Grid);

/// Work of all simulations of a fit, and its limit, in evaluations of the forces in an element.
pub(super) struct Work {
    pub limit: usize,
    pub done: AtomicUsize,
}

/// Simulates the shoot of the family with the given values of all parameters, up to the last frame
/// at or before the time `until` (s). The run follows a grid, or chooses and records one.
pub(super) fn simulate<M: Model, E: Display>(
    family: &Family<impl Fn(&[f64]) -> Result<Shoot<M>, E>>,
    data: &[Series],
    (step, work): (f64, &Work),
    (values, until): (&[f64], f64),
    grid: Option<&Grid>,
) -> Result<Output, FitError> {
    let mut shoot = family.shoot(values)?;
    let (start, length) = (shoot.time(), shoot.rod().length());
    let mut integrator =
        MethodOfSteps::with_solver(step, NewtonSolver::with_tolerance(EQUILIBRIUM));
    match grid {
        None => integrator.record(),
        Some(grid) => integrator.follow(grid.clone()),
    }
    // Frames at which steps end, and frames at which the path is interpolated.
    let (mut stops, mut dense) = (Vec::new(), Vec::new());
    for (series, data) in data.iter().enumerate() {
        let frames = data
            .times
            .iter()
            .enumerate()
            .take_while(|(_, time)| **time <= until);
        let frames = frames.map(|(frame, time)| (*time, (series, frame)));
        if data.is_dense(step) {
            dense.extend(frames);
        } else {
            stops.extend(frames.map(|(time, frame)| (time, Some(frame))));
        }
    }
    let last = dense.iter().map(|(time, _)| *time).reduce(f64::max);
    let mut path = last.map_or(Ok(Path::default()), |last| Path::until(last, step, &shoot))?;
    stops.extend(path.times.iter().map(|time| (*time, None)));
    sort_by_value(&mut stops, |(time, _)| *time);
    let cameras: Vec<_> = data
        .iter()
        .map(|series| Camera::of(series, family, values))
        .collect();
    let mut residuals = Vec::new();
    let mut add = |(series, frame): (usize, usize), of_frame: Vec<f64>| {
        let row = |index| Origin {
            series,
            index,
            time: data[series].times[frame],
        };
        residuals.extend(
            of_frame
                .into_iter()
                .enumerate()
                .map(|(index, r)| (row(index), r)),
        );
    };
    let end = stops.last().map_or(start, |(time, _)| *time);
    for (time, frame) in stops {
        let elements = shoot.rod().elements();
        integrator.max_work =
            work.limit.saturating_sub(work.done.load(Ordering::Relaxed)) / elements;
        let statistics = integrator
            .advance(&mut shoot, time)
            .map_err(|error| match error {
                IntegrationError::WorkLimit { .. } => {
                    let growth = shoot.model().growth();
                    let grown = if growth.elongates() {
                        growth.length(length, end - start)
                    } else {
                        length
                    };
                    FitError::WorkLimit {
                        limit: work.limit,
                        duration: end - start,
                        lengths: [length, grown],
                    }
                }
                error => FitError::Run {
                    values: family.named(values),
                    error: Box::new(error),
                },
            })?;
        work.done
            .fetch_add(elements * statistics.work(), Ordering::Relaxed);
        match frame {
            Some(frame) => add(frame, cameras[frame.0].residuals(shoot.rod(), frame.1)),
            None => path.tips.push(tip_of(shoot.rod())),
        }
    }
    for (time, frame) in dense {
        add(
            frame,
            cameras[frame.0].tip_residuals(path.at(time), frame.1),
        );
    }
    sort_by_value(&mut residuals, |(origin, _): &(Origin, f64)| origin.time);
    Ok((residuals, integrator.take_grid()))
}

/// Path of the tip at points between which it is interpolated. Each piece between two
/// discontinuities of the laws, where the path has a kink, has points at equal intervals.
#[derive(Default)]
struct Path {
    /// Times, s.
    times: Vec<f64>,
    /// Index of the first point of each piece, and of the last point of the last piece.
    ends: Vec<usize>,
    /// Position of the tip (m) and unit tangent there, at the first of the times.
    tips: Vec<[Vector3<f64>; 2]>,
}

impl Path {
    /// Path without tips of a shoot at its start, to the last time (s), with intervals up to `step`
    /// (s).
    fn until(last: f64, step: f64, shoot: &Shoot<impl Model>) -> Result<Self, FitError> {
        let (mut from, shortest) = (shoot.time(), SHORTEST * step);
        let last = last.max(from + step);
        let mut path = Self {
            times: vec![from],
            ends: vec![0],
            tips: Vec::new(),
        };
        while from < last {
            let next = next_discontinuity(shoot.model(), from + shortest)?;
            let to = if next < last - shortest { next } else { last };
            // The number is the same if a parameter displaces the discontinuity a little.
            let count = ((to - from) / step - SHORTEST)
                .ceil()
                .max((NODES - 1) as f64);
            path.times
                .extend((1..count as usize).map(|k| from + (to - from) * k as f64 / count));
            path.times.push(to);
            path.ends.push(path.times.len() - 1);
            from = to;
        }
        Ok(path)
    }

    /// Tip and tangent at a time (s) by interpolation.
    fn at(&self, time: f64) -> [Vector3<f64>; 2] {
        let piece = self
            .ends
            .partition_point(|end| self.times[*end] < time)
            .clamp(1, self.ends.len() - 1);
        let (start, end) = (self.ends[piece - 1], self.ends[piece]);
        let next = self.times.partition_point(|other| *other < time);
        let first = next.saturating_sub(NODES / 2).clamp(start, end + 1 - NODES);
        let weights: [f64; NODES] = lagrange(&self.times[first..first + NODES], time);
        let sum = |i: usize| {
            (0..NODES)
                .map(|k| self.tips[first + k][i] * weights[k])
                .sum()
        };
        [sum(0), sum(1)]
    }
}

/// Position of the tip (m), and unit tangent there.
fn tip_of(rod: &Rod) -> [Vector3<f64>; 2] {
    [rod.tip(), rod.apex_frame() * Vector3::z()]
}

/// View of a series with the values of its scale and offset.
struct Camera<'a> {
    series: &'a Series,
    scale: f64,
    offset: Vector3<f64>,
}

impl<'a> Camera<'a> {
    /// Camera of a series for the values of all parameters.
    fn of<F>(series: &'a Series, family: &Family<F>, values: &[f64]) -> Self {
        let value = |name: &String| family.index(name).map_or(0.0, |index| values[index]);
        let name = |k: usize| series.offset.as_ref().and_then(|names| names.get(k));
        let offset = Vector3::from_fn(|k, _| name(k).map_or(0.0, value));
        Self {
            series,
            scale: series.scale.as_ref().map_or(1.0, value),
            offset,
        }
    }

    /// Image of a vector, without the offset.
    fn direction(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        self.scale * self.series.view.image(vector)
    }

    /// Image of a position (m).
    fn point(&self, position: &Vector3<f64>) -> Vector3<f64> {
        self.direction(position) + self.offset
    }

    /// Residuals of a frame, in the unit of the data, or rad. Those of the tip are the first, so
    /// that they have the same indices in all frames, whatever the number of points.
    fn residuals(&self, rod: &Rod, frame: usize) -> Vec<f64> {
        let mut residuals = self.tip_residuals(tip_of(rod), frame);
        if let [inner @ .., _] = &self.series.frames[frame][..]
            && !inner.is_empty()
        {
            let line: Vec<_> = rod
                .centre_line_at(INTERVALS + 1)
                .iter()
                .map(|p| self.point(p))
                .collect();
            let ends = rod.centre_line();
            residuals.extend(
                inner
                    .iter()
                    .flat_map(|point| self.across(rod, &ends, &line, point)),
            );
        }
        residuals
    }

    /// Residuals of the tip, or of its angle, for a simulated position and tangent.
    fn tip_residuals(&self, [tip, tangent]: [Vector3<f64>; 2], frame: usize) -> Vec<f64> {
        let measured = self.series.last_point(frame);
        let mut difference = self.point(&tip) - measured;
        if self.series.is_angle {
            let tangent = self.direction(&tangent);
            difference.x = (tangent.y.atan2(tangent.x) - measured.x + PI).rem_euclid(TAU) - PI;
        }
        difference
            .iter()
            .take(self.series.dimension())
            .copied()
            .collect()
    }

    /// Components, across the tangent, of the distance of the nearest point of the centre line from
    /// a measured point: one in a plane, two in space. `ends` are the ends of the elements with
    /// their arc lengths (m). `line` has images of points of the centre line at equal distances of
    /// arc length.
    fn across(
        &self,
        rod: &Rod,
        ends: &[(f64, Vector3<f64>)],
        line: &[Vector3<f64>],
        point: &Vector3<f64>,
    ) -> Vec<f64> {
        let length = rod.length();
        let square = |k: &usize| (line[*k] - point).norm_squared();
        let nearest = (0..line.len())
            .min_by(|a, b| square(a).total_cmp(&square(b)))
            .unwrap_or(0);
        let mut s = length * nearest as f64 / INTERVALS as f64;
        let (mut residual, mut directors) = (Vector3::zeros(), [Vector3::zeros(); 3]);
        for _ in 0..ITERATIONS {
            let Some((element, x)) = rod.locate(s) else {
                break;
            };
            let frame = rod.frame_within(element, x);
            residual = self.point(&(ends[element].1 + rod.chord(element, x))) - point;
            directors = [Vector3::x(), Vector3::y(), Vector3::z()]
                .map(|axis| self.direction(&(frame * axis)));
            let slope = directors[2].norm_squared();
            let change = if slope > 0.0 {
                -residual.dot(&directors[2]) / slope
            } else {
                0.0
            };
            let from = s;
            s = (s + change).clamp(0.0, length);
            if (s - from).abs() <= NEAREST * length {
                break;
            }
        }
        let [d1, d2, tangent] = directors.map(|d| d.try_normalize(0.0).unwrap_or(d));
        // In a plane, the direction across the tangent is unique. In space, it is a plane, which d1
        // and d2 span.
        if self.series.dimension() == 2 {
            vec![residual.y * tangent.x - residual.x * tangent.y]
        } else {
            vec![residual.dot(&d1), residual.dot(&d2)]
        }
    }
}
