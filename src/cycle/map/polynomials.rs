//! The variables of the laws as functions of time: a polynomial in each interval, given by its
//! value at the beginning and its slopes at the Radau points.

use nalgebra::DVector;

use super::grid::TimeGrid;
use super::phase_state::PhaseState;

/// A delayed value of the variables.
pub(crate) struct DelayedReading {
    /// Interval in which it lies, relative to the present one.
    pub interval: isize,
    /// Weights of the slopes there.
    pub weights: Vec<f64>,
}

/// The delayed values that the equations of an interval read.
pub(crate) struct Readings {
    /// The value of each variable at each stage; none for variables that the gradient does not
    /// depend on.
    pub stages: Vec<Vec<Option<DelayedReading>>>,
    /// Whether the equations depend on values inside the interval.
    pub implicit: bool,
}

/// The variables over the past that a state contains, and over the intervals that have been
/// integrated since.
#[derive(Debug, Clone)]
pub(crate) struct Polynomials {
    /// Variables at the beginning of each interval, the oldest first.
    pub begins: Vec<DVector<f64>>,
    /// Slopes of the variables times the length of an interval, interval by interval, stage by
    /// stage.
    pub slopes: Vec<Vec<DVector<f64>>>,
}

impl Polynomials {
    /// The past of a state. The variables are integrated backwards from the present.
    pub fn of(start: &PhaseState, grid: &TimeGrid) -> Self {
        let mut begins = vec![start.variables.clone()];
        for slopes in start.slopes.iter().rev() {
            let mut before = begins[begins.len() - 1].clone();
            slopes
                .iter()
                .zip(&grid.whole)
                .for_each(|(slope, w)| before.axpy(-w, slope, 1.0));
            begins.push(before);
        }
        begins.reverse();
        Self {
            begins,
            slopes: start.slopes.clone(),
        }
    }

    /// Component `k` of the variables in an interval.
    pub fn value(&self, interval: usize, weights: &[f64], k: usize) -> f64 {
        self.begins[interval][k] + weighted(&self.slopes[interval], weights, k)
    }

    /// Component `k` of the variables at a delayed time, as seen from the last interval.
    pub fn read(&self, reading: &DelayedReading, k: usize) -> f64 {
        let last = self.slopes.len() as isize - 1;
        self.value((last + reading.interval) as usize, &reading.weights, k)
    }

    /// The beginning and the slopes of the last interval.
    pub fn last(&mut self) -> (&DVector<f64>, &mut [DVector<f64>]) {
        let last = self.slopes.len() - 1;
        (&self.begins[last], &mut self.slopes[last])
    }

    /// Completes the last interval: its end is the beginning of the next one.
    pub fn complete(&mut self, grid: &TimeGrid) {
        let last = self.slopes.len() - 1;
        self.begins
            .push(carried(&self.begins[last], &self.slopes[last], &grid.whole));
    }

    /// The state with the last value of the variables, and a past without the first `intervals`
    /// intervals.
    pub fn into_state(mut self, strain: DVector<f64>, intervals: usize) -> PhaseState {
        let variables = self.begins.swap_remove(self.begins.len() - 1);
        PhaseState {
            strain,
            variables,
            slopes: self.slopes.split_off(intervals),
        }
    }
}

/// Component `k` of the weighted sum of slopes.
pub(crate) fn weighted(slopes: &[DVector<f64>], weights: &[f64], k: usize) -> f64 {
    slopes
        .iter()
        .zip(weights)
        .map(|(slope, w)| w * slope[k])
        .sum()
}

/// The value at the beginning of an interval plus the weighted sum of its slopes.
pub(crate) fn carried(
    begin: &DVector<f64>,
    slopes: &[DVector<f64>],
    weights: &[f64],
) -> DVector<f64> {
    let mut out = begin.clone();
    slopes
        .iter()
        .zip(weights)
        .for_each(|(slope, w)| out.axpy(*w, slope, 1.0));
    out
}
