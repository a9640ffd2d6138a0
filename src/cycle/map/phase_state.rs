//! States of the return map. The delayed variables make the phase space infinite-dimensional; a
//! state contains the slopes of the variables over the longest delay.

use nalgebra::DVector;

use super::grid::TimeGrid;
use crate::error::ParameterError;
use crate::numerics::interpolation::lagrange_value;
use crate::rod::Rod;

/// A state of the shoot, with its past.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PhaseState {
    /// Components 1 and 2 of the intrinsic strain, point by point, 1/m.
    pub strain: DVector<f64>,
    /// Variables of the laws, point by point.
    pub variables: DVector<f64>,
    /// Slopes of the variables times the length of an interval, interval by interval, the oldest
    /// first, stage by stage.
    pub slopes: Vec<Vec<DVector<f64>>>,
}

/// Components 1 and 2 of the intrinsic strain at the points of the growth zone of a rod, 1/m.
pub(crate) fn bends(rod: &Rod) -> DVector<f64> {
    let points = rod.points()[rod.zone()].iter();
    DVector::from_vec(
        points
            .flat_map(|point| [point.intrinsic.x, point.intrinsic.y])
            .collect(),
    )
}

impl PhaseState {
    /// All components in one vector: strain, variables, slopes.
    pub fn flat(&self) -> DVector<f64> {
        let all = [&self.strain, &self.variables]
            .into_iter()
            .chain(self.slopes.iter().flatten());
        DVector::from_vec(all.flat_map(|part| part.iter().copied()).collect())
    }

    /// A state of the same sizes with the components of a vector.
    pub fn with_values(&self, flat: &DVector<f64>) -> Self {
        let (mut out, mut at) = (self.clone(), 0);
        let present = [&mut out.strain, &mut out.variables];
        for part in present.into_iter().chain(out.slopes.iter_mut().flatten()) {
            part.copy_from(&flat.rows(at, part.len()));
            at += part.len();
        }
        out
    }

    /// The variables and slopes of each material point, which has `number` of them, at all times.
    pub fn variables_of_points(&mut self, number: usize) -> impl Iterator<Item = &mut [f64]> {
        let all = std::iter::once(&mut self.variables).chain(self.slopes.iter_mut().flatten());
        all.flat_map(move |all| all.as_mut_slice().chunks_exact_mut(number.max(1)))
    }

    /// Returns an error unless the state has given numbers of material points, and of variables at
    /// each point.
    pub fn check(&self, points: usize, variables: usize) -> Result<(), ParameterError> {
        let own = self.strain.len() / 2;
        ParameterError::count(
            "number of material points of the orbit",
            [own, points],
            "that of the shoot",
        )?;
        let counts = [self.variables.len(), variables * points];
        ParameterError::count(
            "number of variables of the orbit at all points",
            counts,
            "that of the shoot",
        )
    }

    /// Norm of the difference to another state, relative to the larger norm: of all components, or
    /// of the strain if that is larger, since variables may have a much larger norm. `least` (1/m)
    /// is a lower bound of the norm.
    pub fn residual(&self, end: &Self, least: f64) -> f64 {
        let relative =
            |a: &DVector<f64>, b: &DVector<f64>| (a - b).norm() / a.norm().max(b.norm()).max(least);
        let [all, strain] = [
            relative(&self.flat(), &end.flat()),
            relative(&self.strain, &end.strain),
        ];
        // `f64::max` would drop a NaN.
        if all > strain || all.is_nan() {
            all
        } else {
            strain
        }
    }

    /// Strain and variables.
    pub fn present(&self) -> DVector<f64> {
        let all = self.strain.iter().chain(self.variables.iter()).copied();
        DVector::from_vec(all.collect())
    }

    /// Weights of the squares of strain and variables, such that both have the same norm in this
    /// state. The weights are one if the variables are zero.
    pub fn weights(&self) -> DVector<f64> {
        let ratio = self.strain.norm_squared() / self.variables.norm_squared();
        let ratio = if ratio.is_finite() { ratio } else { 1.0 };
        let (bends, all) = (self.strain.len(), self.strain.len() + self.variables.len());
        DVector::from_fn(all, |k, _| if k < bends { 1.0 } else { ratio })
    }

    /// The same state with `kept` intervals of the past on another grid, whose intervals are
    /// `ratio` times as long.
    pub fn on_grid(&self, old: &TimeGrid, new: &TimeGrid, kept: usize, ratio: f64) -> Self {
        let at = |time: f64| {
            // Time in intervals of the old grid. The polynomial of the oldest interval is
            // extrapolated.
            let time = time * ratio;
            let back = (-time).ceil().clamp(1.0, self.slopes.len() as f64) as usize;
            let weight = |k: usize| lagrange_value(&old.stages, k, time + back as f64);
            let mut slope = DVector::zeros(self.variables.len());
            let known = &self.slopes[self.slopes.len() - back];
            known
                .iter()
                .enumerate()
                .for_each(|(k, known)| slope.axpy(weight(k) * ratio, known, 1.0));
            slope
        };
        let interval = |n: usize| {
            new.stages
                .iter()
                .map(|stage| at(n as f64 - kept as f64 + stage))
                .collect()
        };
        Self {
            slopes: (0..kept).map(interval).collect(),
            ..self.clone()
        }
    }

    /// Sets the number of intervals of the past. A past that is too short is continued by copies of
    /// the oldest interval.
    pub fn keep(&mut self, kept: usize) {
        self.slopes.drain(..self.slopes.len().saturating_sub(kept));
        let Some(oldest) = self.slopes.first().cloned() else {
            return;
        };
        while self.slopes.len() < kept {
            self.slopes.insert(0, oldest.clone());
        }
    }
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
            for end in [
                state(odd, 2.0, 3.0),
                state(1.0, odd, 3.0),
                state(1.0, 2.0, odd),
            ] {
                let residual = sound.residual(&end, f64::MIN_POSITIVE);
                assert!(residual.is_nan(), "{end:?}: {residual}");
            }
        }
    }
}
