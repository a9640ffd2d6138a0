//! Crossings of the axis to a tolerance: sought on a coarse mesh, and corrected on finer ones.

use nalgebra::{SVector, Vector1};

use super::follow::Follower;
use super::mesh_error::{Convergence, MeshError, ROUNDING, check_finer, size};
use super::onset::{BEYOND, Onset, crossings, onset};
use super::refinement::Refinement;
use crate::stability::error::StabilityError;
use crate::stability::spectrum::{Linearisation, Unstable};

/// A family of linearisations with one parameter on one mesh.
type Family<'a> = dyn FnMut(f64) -> Result<Linearisation, StabilityError> + 'a;

/// A crossing of the axis on one mesh, with its error there.
#[derive(Clone, Copy)]
pub(super) struct Crossing<const N: usize> {
    pub place: Follower<N>,
    pub error: MeshError<N>,
    pub convergence: Convergence,
}

impl<const N: usize> Crossing<N> {
    /// A crossing on the first mesh, whose error is unknown.
    pub fn new(place: Follower<N>) -> Self {
        let error =
            MeshError { parameters: SVector::repeat(f64::INFINITY), frequency: f64::INFINITY, relative: f64::INFINITY };
        Self { place, error, convergence: Convergence::default() }
    }
}

impl Refinement {
    /// Largest distance between a crossing and its correction: a hundredth of the tolerance, but not below rounding.
    pub(super) fn close<const N: usize>(&self, sizes: &SVector<f64, N>) -> f64 {
        (1e-2 * self.tolerance).max(ROUNDING) * sizes.min()
    }

    /// Corrects a crossing on a finer mesh. Returns its error on the mesh before.
    pub(super) fn go_finer<const N: usize>(
        &self,
        crossing: &mut Crossing<N>,
        free: &SVector<f64, N>,
        sizes: &SVector<f64, N>,
        family: &mut impl FnMut(&SVector<f64, N>) -> Result<Linearisation, StabilityError>,
    ) -> Result<MeshError<N>, StabilityError> {
        let (before, place) = (crossing.place, &mut crossing.place);
        let linear = family(&before.at)?;
        check_finer(before.elements, &linear)?;
        place.change_mesh(before.root, &linear)?;
        place.correct(free, self.close(sizes), family)?;
        let frequency_size = if place.root.im == 0.0 { place.rate } else { place.root.im.abs() };
        let error = |share: f64| {
            let error = |change: f64, size: f64| (change.abs() * share).max(ROUNDING * size);
            let parameters = (place.at - before.at).zip_map(sizes, error);
            let frequency = error(place.root.im.abs() - before.root.im.abs(), frequency_size);
            let relative = parameters.component_div(sizes).max().max(frequency / frequency_size);
            MeshError { parameters, frequency, relative }
        };
        let coarse = error(1.0);
        crossing.error = error(crossing.convergence.error_share(coarse.relative, before.elements, &linear));
        Ok(coarse)
    }

    /// As [`onset`](super::onset()), to the tolerance. The error of the parameter is relative to the parameter, or to the larger
    /// end of a range that contains zero; that of the frequency to the frequency, or to the slowest rate if nothing oscillates.
    ///
    /// # Errors
    /// Those of [`onset`](super::onset()), a tolerance that is not positive or below 1e-9, or
    /// [`ToleranceNotMet`](StabilityError::ToleranceNotMet).
    pub fn onset(
        &self,
        mut family: impl FnMut(f64, usize) -> Result<Linearisation, StabilityError>,
        from: f64,
        to: f64,
    ) -> Result<Onset, StabilityError> {
        let search = |at: &mut Family| Ok((vec![onset(at, from, to)?], vec![Unstable::Finite(0)]));
        // No other root may be unstable just beyond the crossing.
        let count = |at: &mut Family, found: &[Crossing<1>]| {
            let beyond = |place: &Follower<1>| place.at[0] - place.slope[0].re.signum() * BEYOND * (to - from).abs();
            let clamped = |place: &Follower<1>| beyond(place).clamp(from.min(to), from.max(to));
            found.iter().map(|crossing| at(clamped(&crossing.place))?.unstable()).collect()
        };
        let found = self.refine_crossings(&mut family, [from, to], search, count)?;
        found.into_iter().next().ok_or(StabilityError::NoConvergence { what: "onset", residual: f64::INFINITY })
    }

    /// As [`crossings`](super::crossings()), to the tolerance, in terms of [`onset`](Self::onset).
    ///
    /// # Errors
    /// Those of [`crossings`](super::crossings()), a tolerance that is not positive or below 1e-9, or
    /// [`ToleranceNotMet`](StabilityError::ToleranceNotMet).
    pub fn crossings(
        &self,
        mut family: impl FnMut(f64, usize) -> Result<Linearisation, StabilityError>,
        from: f64,
        to: f64,
    ) -> Result<Vec<Onset>, StabilityError> {
        // The number of roots that cross must be the same on all meshes.
        let ends = |at: &mut Family| [from, to].iter().map(|end| at(*end)?.unstable()).collect::<Result<Vec<_>, _>>();
        let search = |at: &mut Family| Ok((crossings(&mut *at, from, to)?, ends(at)?));
        self.refine_crossings(&mut family, [from, to], search, |at, _| ends(at))
    }

    /// Crossings that are corrected from mesh to mesh. `search` returns those of one mesh, and the numbers of unstable roots
    /// that `count` must return on the last mesh.
    fn refine_crossings(
        &self,
        family: &mut impl FnMut(f64, usize) -> Result<Linearisation, StabilityError>,
        [from, to]: [f64; 2],
        search: impl Fn(&mut Family) -> Result<(Vec<Onset>, Vec<Unstable>), StabilityError>,
        count: impl Fn(&mut Family, &[Crossing<1>]) -> Result<Vec<Unstable>, StabilityError>,
    ) -> Result<Vec<Onset>, StabilityError> {
        self.check()?;
        let (found, _) = self.converge(|n, coarser: Option<(Vec<Crossing<1>>, Vec<Unstable>)>| {
            let mut at = |x: f64| family(x, n);
            let Some((mut found, unstable)) = coarser else {
                let (found, unstable) = search(&mut at)?;
                return Ok(((found.iter().map(|onset| Crossing::new(onset.crossing)).collect(), unstable), None));
            };
            for crossing in &mut found {
                let sizes = Vector1::new(size(crossing.place.at[0], from, to));
                let _ = self.go_finer(crossing, &Vector1::new(1.0), &sizes, &mut |x| at(x[0]))?;
            }
            let error = found.iter().map(|crossing| crossing.error.relative).fold(0.0, f64::max);
            if error <= self.tolerance && count(&mut at, &found)? != unstable {
                let what = "number of unstable roots on a finer mesh";
                return Err(StabilityError::NoConvergence { what, residual: error });
            }
            Ok(((found, unstable), Some(error)))
        })?;
        let with_error = |Crossing { place, error, .. }: &Crossing<1>| {
            let (parameter_error, frequency_error) = (Some(error.parameters[0]), Some(error.frequency));
            Onset { parameter_error, frequency_error, ..Onset::of(place) }
        };
        Ok(found.iter().map(with_error).collect())
    }
}
