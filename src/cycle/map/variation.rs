//! The linearised time-stepping map: what a small disturbance of a state becomes after a period.

use nalgebra::{DMatrix, DVector, Dyn, LU};

use super::march::{self, March, Path, Reading};
use super::state::{Start, carried};
use super::turn::{Turn, turned_back};
use crate::cycle::error::CycleError;
use crate::cycle::sensitivity::stimuli_by_strain;
use crate::model::Model;
use crate::scene::Scene;

/// The derivatives of everything along a path. With a path that comes back it makes the multipliers of Floquet.
pub(crate) struct Variation {
    intervals: Vec<Interval>,
    readings: Vec<Vec<Option<Reading>>>,
    upto: Vec<Vec<f64>>,
    whole: Vec<f64>,
    regr: Vec<f64>,
    kept: usize,
    length: f64,
    implicit: bool,
    sizes: (usize, usize),
    turn: Option<Turn>,
}

struct Interval {
    stages: Vec<Stage>,
    /// Of every point.
    slopes: Vec<LU<f64, Dyn, Dyn>>,
}

struct Stage {
    /// The stimuli by the strain.
    response: DMatrix<f64>,
    /// Of every point.
    rates_y: Vec<DMatrix<f64>>,
    rates_x: Vec<DMatrix<f64>>,
    gradient_y: Vec<DMatrix<f64>>,
    gradient_x: Option<Vec<DMatrix<f64>>>,
}

/// Passes over an interval whose laws read what lies in it.
const PASSES: usize = 60;

impl Variation {
    pub fn of(march: &March<impl Model>, path: &Path, period: f64) -> Result<Self, CycleError> {
        let scene = march.shoot.model.scene();
        Self::with_responses(march, path, period, |time, stage| {
            stimuli_by_strain(
                march.shoot,
                &stage.rod,
                &scene.environment(march.shoot.environment().time + time),
                &[0.0],
            )
        })
    }

    /// The same, with the stimuli by the strain given for a time since the start (s) and a stage.
    pub fn with_responses(
        march: &March<impl Model>,
        path: &Path,
        period: f64,
        mut response: impl FnMut(f64, &march::Stage) -> Result<DMatrix<f64>, CycleError>,
    ) -> Result<Self, CycleError> {
        let (k, s, p) = (march.grid.intervals, march.grid.order(), march.places.len());
        let length = period / k as f64;
        let (readings, implicit) = march.readings(period);
        let mut intervals = Vec::with_capacity(k);
        for (n, stages) in path.stages.iter().enumerate() {
            let mut made = Vec::with_capacity(s);
            for (i, stage) in stages.iter().enumerate() {
                let response = response((n as f64 + march.grid.stages[i]) * length, stage)?;
                let (mut rates_y, mut rates_x) = (Vec::with_capacity(p), Vec::with_capacity(p));
                let (mut gradient_y, mut gradient_x) = (Vec::with_capacity(p), Vec::with_capacity(p));
                for point in 0..p {
                    let [y, x, ..] = march.derivatives(point, stage, false);
                    let [.., gy, gx] = march.derivatives(point, stage, true);
                    rates_y.push(y);
                    rates_x.push(x);
                    gradient_y.push(gy);
                    gradient_x.push(gx);
                }
                let gradient_x = march.reads_present.then_some(gradient_x);
                made.push(Stage { response, rates_y, rates_x, gradient_y, gradient_x });
            }
            let slopes = (0..p).map(|point| march.matrix(point, length, stages).lu()).collect();
            intervals.push(Interval { stages: made, slopes });
        }
        Ok(Self {
            intervals,
            readings,
            upto: march.grid.upto.clone(),
            whole: march.grid.whole.clone(),
            regr: march.regr.clone(),
            kept: march.kept,
            length,
            implicit,
            sizes: (march.variables, march.stimuli),
            turn: march.turn.clone(),
        })
    }

    /// What becomes of a disturbance after a period.
    pub fn apply(&self, start: &Start) -> Result<Start, CycleError> {
        let mut slopes = start.slopes.clone();
        let mut begins = start.begins(&self.whole);
        let mut strain = start.strain.clone();
        for (n, interval) in self.intervals.iter().enumerate() {
            let present = self.kept + n;
            slopes.push(vec![DVector::zeros(start.variables.len()); self.upto.len()]);
            let mut stimuli: Vec<DVector<f64>> = Vec::new();
            let mut strain_slopes = Vec::new();
            for pass in 0..PASSES {
                strain_slopes = self.strain_slopes(interval, present, &begins, &slopes, &stimuli);
                let now: Vec<DVector<f64>> = (0..self.upto.len())
                    .map(|i| &interval.stages[i].response * carried(&strain, &strain_slopes, &self.upto[i]))
                    .collect();
                let change = now.iter().zip(&stimuli).map(|(a, b)| (a - b).norm()).sum::<f64>();
                let size = now.iter().map(DVector::norm).sum::<f64>();
                let done = pass > 0 && change <= 1e-14 * size;
                stimuli = now;
                self.carry(interval, &begins[present], &mut slopes[present], &stimuli);
                if done || !self.implicit {
                    break;
                }
                if pass + 1 == PASSES {
                    return Err(CycleError::Variables { change: change / size });
                }
            }
            strain = carried(&strain, &strain_slopes, &self.whole);
            begins.push(carried(&begins[present], &slopes[present], &self.whole));
        }
        let k = self.intervals.len();
        let variables = begins.pop().unwrap_or_else(|| start.variables.clone());
        let end = Start { strain, variables, slopes: slopes[k..].to_vec() };
        Ok(turned_back(self.turn.as_ref(), end))
    }

    fn strain_slopes(
        &self,
        interval: &Interval,
        present: usize,
        begins: &[DVector<f64>],
        slopes: &[Vec<DVector<f64>>],
        stimuli: &[DVector<f64>],
    ) -> Vec<DVector<f64>> {
        let ((v, m), p) = (self.sizes, self.regr.len());
        let mut out = vec![DVector::zeros(2 * p); self.upto.len()];
        let mut past = vec![0.0; v];
        for (i, stage) in interval.stages.iter().enumerate() {
            for point in 0..p {
                for (a, reading) in self.readings[i].iter().enumerate() {
                    past[a] = reading.as_ref().map_or(0.0, |(at, weights)| {
                        let (at, k) = ((present as isize + at) as usize, point * v + a);
                        begins[at][k] + weights.iter().zip(&slopes[at]).map(|(w, slope)| w * slope[k]).sum::<f64>()
                    });
                }
                for c in 0..2 {
                    let by_past = (0..v).map(|a| stage.gradient_y[point][(c, a)] * past[a]).sum::<f64>();
                    let by_present = match (&stage.gradient_x, stimuli.get(i)) {
                        (Some(gradient), Some(x)) => {
                            (0..m).map(|b| gradient[point][(c, b)] * x[point * m + b]).sum::<f64>()
                        }
                        _ => 0.0,
                    };
                    out[i][2 * point + c] = self.length * self.regr[point] * (by_past + by_present);
                }
            }
        }
        out
    }

    /// The slopes of the variables of all points.
    fn carry(&self, interval: &Interval, begin: &DVector<f64>, slopes: &mut [DVector<f64>], stimuli: &[DVector<f64>]) {
        let ((v, m), s) = (self.sizes, self.upto.len());
        if v == 0 {
            return;
        }
        for point in 0..self.regr.len() {
            let (y, mut right) = (begin.rows(point * v, v), DVector::zeros(v * s));
            for (i, stage) in interval.stages.iter().enumerate() {
                let x = stimuli[i].rows(point * m, m);
                let rate = (&stage.rates_y[point] * y + &stage.rates_x[point] * x) * self.length;
                right.rows_mut(i * v, v).copy_from(&rate);
            }
            // Regular: it was solved with when the path was made.
            let _ = interval.slopes[point].solve_mut(&mut right);
            for (i, slope) in slopes.iter_mut().enumerate() {
                slope.rows_mut(point * v, v).copy_from(&right.rows(i * v, v));
            }
        }
    }
}
