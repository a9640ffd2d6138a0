//! A state of the return map, with the past that the laws read.

use nalgebra::DVector;

use super::grid::Grid;
use crate::error::ParameterError;
use crate::numerics::interpolation::lagrange;

/// A state: strain, variables, and the rates of the variables over the last intervals, times an interval's length.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PhaseState {
    /// Components 1 and 2 of the intrinsic strain, point by point, 1/m.
    pub strain: DVector<f64>,
    /// The variables, point by point.
    pub variables: DVector<f64>,
    /// Slopes of the variables, interval by interval, the oldest first, stage by stage.
    pub slopes: Vec<Vec<DVector<f64>>>,
}

impl PhaseState {
    pub fn flat(&self) -> DVector<f64> {
        let slopes = self.slopes.iter().flatten().flat_map(|slope| slope.iter());
        let all: Vec<f64> = self.strain.iter().chain(self.variables.iter()).chain(slopes).copied().collect();
        DVector::from_vec(all)
    }

    /// A state of the same sizes with other values.
    pub fn with_values(&self, flat: &DVector<f64>) -> Self {
        let (n, v) = (self.strain.len(), self.variables.len());
        let mut at = n + v;
        let mut out = self.clone();
        out.strain.copy_from(&flat.rows(0, n));
        out.variables.copy_from(&flat.rows(n, v));
        for slope in out.slopes.iter_mut().flatten() {
            slope.copy_from(&flat.rows(at, v));
            at += v;
        }
        out
    }

    /// Returns an error for another number of points, or of variables at each.
    pub fn check(&self, points: usize, variables: usize) -> Result<(), ParameterError> {
        let (what, own) = ("material points of the orbit", self.strain.len() / 2);
        let same = own == points && self.variables.len() == variables * points;
        ParameterError::unless(same, what, own as f64, "those of the shoot, with its variables")
    }

    /// By how much another state differs, relative to the larger of the two: in all, or in the strain alone if that is more, beside which variables may
    /// be large. Strain below `least` (1/m) is none.
    pub fn residual(&self, end: &Self, least: f64) -> f64 {
        let relative = |a: &DVector<f64>, b: &DVector<f64>| (a - b).norm() / a.norm().max(b.norm()).max(least);
        let [all, strain] = [relative(&self.flat(), &end.flat()), relative(&self.strain, &end.strain)];
        // `f64::max` would drop a NaN.
        if all > strain || all.is_nan() { all } else { strain }
    }

    /// Strain and variables.
    pub fn present(&self) -> DVector<f64> {
        let all = self.strain.iter().chain(self.variables.iter()).copied();
        DVector::from_vec(all.collect())
    }

    /// Weights of the squares of strain and variables: the latter count as much as the strain in this state. Of the size of variables that are
    /// zero nothing is known.
    pub fn weights(&self) -> DVector<f64> {
        let ratio = self.strain.norm_squared() / self.variables.norm_squared();
        let ratio = if ratio.is_finite() { ratio } else { 1.0 };
        let (bends, all) = (self.strain.len(), self.strain.len() + self.variables.len());
        DVector::from_fn(all, |k, _| if k < bends { 1.0 } else { ratio })
    }

    /// The same state with its past on another grid, whose intervals are `ratio` times as long.
    pub fn on_grid(&self, old: &Grid, new: &Grid, kept: usize, ratio: f64) -> Self {
        let at = |time: f64| {
            // In intervals of the old grid, backwards from the present. The oldest interval is extrapolated.
            let time = time * ratio;
            let back = (-time).ceil().clamp(1.0, self.slopes.len() as f64) as usize;
            let mut weights = vec![0.0; old.order()];
            lagrange(&old.stages, time + back as f64, &mut weights);
            let mut slope = DVector::zeros(self.variables.len());
            let known = &self.slopes[self.slopes.len() - back];
            known.iter().zip(&weights).for_each(|(known, w)| slope.axpy(w * ratio, known, 1.0));
            slope
        };
        let interval = |n: usize| new.stages.iter().map(|stage| at(n as f64 - kept as f64 + stage)).collect();
        Self { slopes: (0..kept).map(interval).collect(), ..self.clone() }
    }

    /// Sets the number of intervals of the past. A past that is too short is continued by copies of the oldest interval.
    pub fn keep(&mut self, kept: usize) {
        self.slopes.drain(..self.slopes.len().saturating_sub(kept));
        if self.slopes.is_empty() {
            return;
        }
        while self.slopes.len() < kept {
            let oldest = self.slopes[0].clone();
            self.slopes.insert(0, oldest);
        }
    }

    /// The variables at the beginning of every interval of the past, the oldest first, and now.
    pub fn begins(&self, whole: &[f64]) -> Vec<DVector<f64>> {
        let mut backwards = vec![self.variables.clone()];
        for slopes in self.slopes.iter().rev() {
            let mut before = backwards[backwards.len() - 1].clone();
            slopes.iter().zip(whole).for_each(|(slope, w)| before.axpy(-w, slope, 1.0));
            backwards.push(before);
        }
        backwards.reverse();
        backwards
    }
}

/// The value at the begin of an interval plus the weighted sum of its slopes.
pub(crate) fn carried(begin: &DVector<f64>, slopes: &[DVector<f64>], weights: &[f64]) -> DVector<f64> {
    let mut out = begin.clone();
    slopes.iter().zip(weights).for_each(|(slope, w)| out.axpy(*w, slope, 1.0));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_that_is_not_a_number_has_no_finite_residual() {
        let state = |strain: f64, variable: f64, slope: f64| PhaseState {
            strain: DVector::from_element(2, strain),
            variables: DVector::from_element(1, variable),
            slopes: vec![vec![DVector::from_element(1, slope)]],
        };
        let sound = state(1.0, 2.0, 3.0);
        assert_eq!(sound.residual(&sound, f64::MIN_POSITIVE), 0.0);
        for odd in [f64::NAN, f64::INFINITY] {
            for end in [state(odd, 2.0, 3.0), state(1.0, odd, 3.0), state(1.0, 2.0, odd)] {
                let residual = sound.residual(&end, f64::MIN_POSITIVE);
                assert!(residual.is_nan(), "{end:?}: {residual}");
            }
        }
    }
}
