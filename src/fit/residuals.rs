//! Differences between a simulated shoot and the data.

use std::f64::consts::{PI, TAU};
use std::fmt::Display;

use nalgebra::Vector3;

use super::series::{Kind, Series};
use super::{Family, FitError};
use crate::equilibrium::NewtonSolver;
use crate::integrator::{Grid, Integrator, MethodOfSteps};
use crate::model::Model;
use crate::numerics::interpolation::lagrange;
use crate::rod::Rod;
use crate::shoot::Shoot;

/// Tolerance of the equilibria of a fit, rad. Difference quotients of runs require equilibria that are accurate to
/// rounding.
const EQUILIBRIUM: f64 = 1e-11;

/// Number of intervals between the points of the centre line with which the search for the nearest point begins.
const INTERVALS: usize = 32;

/// Accuracy of the arc length of the nearest point, relative to the length of the shoot. The distance across the
/// tangent changes with the square of an error of the arc length.
const NEAREST: f64 = 1e-8;

/// Largest number of iterations for the arc length of the nearest point.
const ITERATIONS: usize = 20;

/// Interval of the frames of a tip over the time step below which the tip is interpolated between the steps.
const DENSE: f64 = 0.5;

/// Number of points of an interpolation. With a tenth of a period between them, its error is 4e-4 of the amplitude.
const NODES: usize = 6;

/// Time steps and elements of a run.
pub(super) enum Steps<'a> {
    /// The integrator chooses and records them.
    Record,
    /// They are those of an earlier run.
    Follow(&'a Grid),
}

/// Origin of a residual: the series, the coordinate and the time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    /// Index of the series.
    pub series: usize,
    /// Index of the residual in its frame.
    pub coordinate: usize,
    /// Time of the frame, s.
    pub time: f64,
}

/// Residuals of a run, in the order of time.
pub(super) struct Output {
    /// Simulated minus measured coordinates, in the unit of the data, or angles, rad.
    pub residuals: Vec<f64>,
    /// Origin of each residual.
    pub rows: Vec<Row>,
    /// Grid of the run.
    pub grid: Grid,
}

/// Simulates the shoot of the family with the given values of all parameters, up to the last frame at or before the
/// time `until` (s).
pub(super) fn simulate<M: Model, E: Display>(
    family: &Family<impl Fn(&[f64]) -> Result<Shoot<M>, E>>,
    data: &[Series],
    step: f64,
    (values, until): (&[f64], f64),
    steps: Steps,
) -> Result<Output, FitError> {
    let problem = |error: E| FitError::Family { values: family.named(values), problem: error.to_string() };
    let mut shoot = (family.build)(values).map_err(problem)?;
    let mut integrator = MethodOfSteps::with_solver(step, NewtonSolver::with_tolerance(EQUILIBRIUM));
    match steps {
        Steps::Record => integrator.record(),
        Steps::Follow(grid) => integrator.follow(grid.clone()),
    }
    let dense: Vec<bool> = data.iter().map(|series| is_dense(series, step)).collect();
    let dense_times = data.iter().zip(&dense).filter(|(_, dense)| **dense).flat_map(|(series, _)| &series.times);
    let last = dense_times.copied().filter(|time| *time <= until).fold(f64::NEG_INFINITY, f64::max);
    let mut path = Path::until(shoot.time(), last, step);
    let cameras: Vec<_> = data.iter().map(|series| Camera::of(series, family, values)).collect();
    let mut next = vec![0; data.len()];
    let (mut residuals, mut rows) = (Vec::new(), Vec::new());
    loop {
        let frames = data.iter().zip(&next).zip(&dense).filter(|(_, dense)| !**dense);
        let times = frames.filter_map(|((series, next), _)| series.times.get(*next)).chain(path.next_time());
        let time = times.copied().fold(f64::INFINITY, f64::min);
        if !(time <= until && time.is_finite()) {
            break;
        }
        integrator
            .advance(&mut shoot, time)
            .map_err(|error| FitError::Run { values: family.named(values), error: Box::new(error) })?;
        path.record(time, shoot.rod());
        for (index, series) in data.iter().enumerate().filter(|(index, _)| !dense[*index]) {
            if series.times.get(next[index]) == Some(&time) {
                let before = residuals.len();
                cameras[index].compare(shoot.rod(), series.kind, &series.frames[next[index]], &mut residuals);
                let count = residuals.len() - before;
                rows.extend((0..count).map(|coordinate| Row { series: index, coordinate, time }));
                next[index] += 1;
            }
        }
    }
    for (index, series) in data.iter().enumerate().filter(|(index, _)| dense[*index]) {
        for (time, frame) in series.times.iter().zip(&series.frames).take_while(|(time, _)| **time <= last) {
            let Some(measured) = frame.last() else { continue };
            let before = residuals.len();
            cameras[index].compare_tip(path.at(*time), series.kind, measured, &mut residuals);
            let count = residuals.len() - before;
            rows.extend((0..count).map(|coordinate| Row { series: index, coordinate, time: *time }));
        }
    }
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|i, k| rows[*i].time.total_cmp(&rows[*k].time));
    let residuals = order.iter().map(|i| residuals[*i]).collect();
    Ok(Output { residuals, rows: order.iter().map(|i| rows[*i]).collect(), grid: integrator.take_grid() })
}

/// Whether the frames of a series are so close that steps to each of them would be far shorter than necessary.
fn is_dense(series: &Series, step: f64) -> bool {
    series.kind != Kind::CentreLine && series.spacing() < DENSE * step
}

/// Path of the tip at equal intervals of about a time step, for frames between them.
struct Path {
    /// Times, s.
    times: Vec<f64>,
    /// Position of the tip (m) and unit tangent there, at the first of the times.
    tips: Vec<[Vector3<f64>; 2]>,
}

impl Path {
    /// Path without points, from a start (s) to the last time (s). It has no times if the last time is not finite.
    fn until(start: f64, last: f64, step: f64) -> Self {
        let count = if last.is_finite() { ((last - start) / step).ceil().max(1.0) as usize } else { 0 };
        let time = |k: usize| if k == count { last } else { start + (last - start) * k as f64 / count as f64 };
        let times = if count == 0 { Vec::new() } else { (0..=count).map(time).collect() };
        Self { times, tips: Vec::new() }
    }

    /// Next time at which the path needs the shoot, s.
    fn next_time(&self) -> Option<&f64> {
        self.times.get(self.tips.len())
    }

    /// Appends the tip of a rod if the time is the next one of the path.
    fn record(&mut self, time: f64, rod: &Rod) {
        if self.next_time() == Some(&time) {
            self.tips.push(tip(rod));
        }
    }

    /// Tip and tangent at a time (s) by interpolation.
    fn at(&self, time: f64) -> [Vector3<f64>; 2] {
        let count = NODES.min(self.times.len());
        let after = self.times.partition_point(|other| *other < time);
        let first = after.saturating_sub(count / 2).min(self.times.len() - count);
        let mut weights = [0.0; NODES];
        lagrange(&self.times[first..first + count], time, &mut weights[..count]);
        let sum = |i: usize| (0..count).map(|k| self.tips[first + k][i] * weights[k]).sum();
        [sum(0), sum(1)]
    }
}

/// Position of the tip (m), and unit tangent there.
fn tip(rod: &Rod) -> [Vector3<f64>; 2] {
    [rod.tip(), rod.apex_frame() * Vector3::z()]
}

/// View with the values of its scale and offset.
struct Camera<'a> {
    rows: &'a [Vector3<f64>],
    scale: f64,
    offset: Vector3<f64>,
}

impl<'a> Camera<'a> {
    /// Camera of a series for the values of all parameters.
    fn of<F>(series: &'a Series, family: &Family<F>, values: &[f64]) -> Self {
        let value = |name: &String| family.index(name).map_or(0.0, |index| values[index]);
        let mut offset = Vector3::zeros();
        for (k, name) in series.offset.iter().flatten().enumerate().take(3) {
            offset[k] = value(name);
        }
        Self { rows: &series.view.0, scale: series.scale.as_ref().map_or(1.0, value), offset }
    }

    /// Image of a vector, without the offset.
    fn direction(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        let mut image = Vector3::zeros();
        for (k, row) in self.rows.iter().enumerate() {
            image[k] = self.scale * row.dot(vector);
        }
        image
    }

    /// Image of a position (m).
    fn point(&self, position: &Vector3<f64>) -> Vector3<f64> {
        self.direction(position) + self.offset
    }

    /// Appends the residuals of a frame, in the unit of the data, or rad. Those of the tip are the last.
    fn compare(&self, rod: &Rod, kind: Kind, frame: &[Vector3<f64>], residuals: &mut Vec<f64>) {
        let Some((last, inner)) = frame.split_last() else { return };
        // The tip is first: its coordinates have the same indices in all frames, whatever the number of points.
        self.compare_tip(tip(rod), kind, last, residuals);
        if kind == Kind::CentreLine && !inner.is_empty() {
            let samples: Vec<_> = rod.centre_line_at(INTERVALS + 1).iter().map(|p| self.point(p)).collect();
            let nodes = rod.centre_line();
            inner.iter().for_each(|point| self.compare_inner((rod, &nodes), &samples, point, residuals));
        }
    }

    /// Appends the residuals of the tip, or of its angle, for a simulated position and tangent.
    fn compare_tip(
        &self,
        [tip, tangent]: [Vector3<f64>; 2],
        kind: Kind,
        measured: &Vector3<f64>,
        residuals: &mut Vec<f64>,
    ) {
        if kind == Kind::Angle {
            let tangent = self.direction(&tangent);
            let difference = tangent.y.atan2(tangent.x) - measured.x;
            residuals.push((difference + PI).rem_euclid(TAU) - PI);
        } else {
            residuals.extend((self.point(&tip) - measured).iter().take(self.rows.len()));
        }
    }

    /// Appends the components, across the tangent, of the distance of the nearest point of the centre line from a
    /// measured point: one in a plane, two in space. `nodes` are the ends of the elements with their arc lengths (m).
    /// `samples` are images of the line at equal arc lengths.
    fn compare_inner(
        &self,
        (rod, nodes): (&Rod, &[(f64, Vector3<f64>)]),
        samples: &[Vector3<f64>],
        point: &Vector3<f64>,
        residuals: &mut Vec<f64>,
    ) {
        let length = rod.length();
        let square = |k: &usize| (samples[*k] - point).norm_squared();
        let nearest = (0..samples.len()).min_by(|a, b| square(a).total_cmp(&square(b))).unwrap_or(0);
        let mut s = length * nearest as f64 / INTERVALS as f64;
        let mut last = (Vector3::zeros(), [Vector3::zeros(); 3]);
        for _ in 0..ITERATIONS {
            let Some((element, x)) = rod.locate(s) else { break };
            let position = nodes[element].1 + rod.chord(element, x);
            let frame = rod.frame_within(element, x);
            let directors = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| self.direction(&(frame * axis)));
            let residual = self.point(&position) - point;
            last = (residual, directors);
            let slope = directors[2].norm_squared();
            let change = if slope > 0.0 { -residual.dot(&directors[2]) / slope } else { 0.0 };
            let new = (s + change).clamp(0.0, length);
            let moved = (new - s).abs();
            s = new;
            if moved <= NEAREST * length {
                break;
            }
        }
        // In a plane, the direction across the tangent is unique. In space, the images of d1 and d2 are orthogonalised
        // against that of the tangent.
        let (residual, [d1, d2, tangent]) = last;
        let unit = |v: Vector3<f64>| if v.norm() > 0.0 { v.normalize() } else { v };
        let tangent = unit(tangent);
        if self.rows.len() == 2 {
            residuals.push(residual.x * -tangent.y + residual.y * tangent.x);
            return;
        }
        let first = unit(d1 - tangent * d1.dot(&tangent));
        let rest = d2 - tangent * d2.dot(&tangent);
        let second = unit(rest - first * rest.dot(&first));
        residuals.extend([residual.dot(&first), residual.dot(&second)]);
    }
}
