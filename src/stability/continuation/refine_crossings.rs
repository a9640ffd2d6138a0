//! Crossings of the axis to a tolerance: sought on a coarse mesh, and corrected on finer ones.

use nalgebra::Vector1;

use super::crossing::Crossing;
use super::mesh_error::{Estimated, size};
use super::onset::{beyond, count, crossings, onset};
use super::refinement::Refinement;
use crate::linearisation::StabilityError;
use crate::stability::spectrum::Linearisation;

/// A family of linearisations with one parameter on one mesh.
type LinearisedFamily<'a> = dyn FnMut(f64) -> Result<Linearisation, StabilityError> + 'a;

impl Refinement {
    /// Finds an onset as [`onset`](super::onset()) does, to the tolerance. The error of the parameter is
    /// relative to the parameter, or to the larger end of a range that contains zero. That of the frequency is
    /// relative to the frequency, or to the slowest rate if nothing oscillates.
    ///
    /// # Errors
    /// Errors of [`onset`](super::onset()), a tolerance below 1e-9 or a range of meshes that is too small, or
    /// [`ToleranceNotMet`](StabilityError::ToleranceNotMet).
    pub fn onset(
        &self,
        family: impl FnMut(f64, usize) -> Result<Linearisation, StabilityError>,
        from: f64,
        to: f64,
    ) -> Result<Crossing<1>, StabilityError> {
        let search = |at: &mut LinearisedFamily| Ok((vec![onset(at, from, to)?], vec![0]));
        // No other root may be unstable just beyond the crossing.
        let counts = |at: &mut LinearisedFamily, found: &[Estimated<1>]| {
            let places = found.iter().map(|one| beyond(one.place.at[0], -one.place.slope[0].re, from, to));
            places.map(|place| count(&at(place)?)).collect()
        };
        let found = self.refine_crossings(family, [from, to], search, counts)?;
        found.into_iter().next().ok_or(StabilityError::NoConvergence { what: "onset", residual: f64::INFINITY })
    }

    /// Finds crossings as [`crossings`](super::crossings()) does, to the tolerance; errors are relative as in
    /// [`onset`](Self::onset).
    ///
    /// # Errors
    /// Errors of [`crossings`](super::crossings()), a tolerance below 1e-9 or a range of meshes that is too small, or
    /// [`ToleranceNotMet`](StabilityError::ToleranceNotMet).
    pub fn crossings(
        &self,
        family: impl FnMut(f64, usize) -> Result<Linearisation, StabilityError>,
        from: f64,
        to: f64,
    ) -> Result<Vec<Crossing<1>>, StabilityError> {
        // The number of roots that cross must be the same on all meshes.
        let ends =
            |at: &mut LinearisedFamily| [from, to].iter().map(|end| count(&at(*end)?)).collect::<Result<Vec<_>, _>>();
        let search = |at: &mut LinearisedFamily| Ok((crossings(&mut *at, from, to)?, ends(at)?));
        self.refine_crossings(family, [from, to], search, |at, _| ends(at))
    }

    /// Corrects crossings from mesh to mesh. `search` returns those of one mesh, and the numbers of unstable
    /// roots that `counts` must return on the last mesh.
    fn refine_crossings(
        &self,
        mut family: impl FnMut(f64, usize) -> Result<Linearisation, StabilityError>,
        [from, to]: [f64; 2],
        search: impl Fn(&mut LinearisedFamily) -> Result<(Vec<Crossing<1>>, Vec<usize>), StabilityError>,
        counts: impl Fn(&mut LinearisedFamily, &[Estimated<1>]) -> Result<Vec<usize>, StabilityError>,
    ) -> Result<Vec<Crossing<1>>, StabilityError> {
        self.check()?;
        let (found, _) = self.converge(|n, coarser: Option<(Vec<Estimated<1>>, Vec<usize>)>| {
            let mut at = |x: f64| family(x, n);
            let Some((mut found, unstable)) = coarser else {
                let (found, unstable) = search(&mut at)?;
                return Ok(((found.iter().map(|one| Estimated::new(one.place)).collect(), unstable), None));
            };
            for one in &mut found {
                let sizes = Vector1::new(size(one.place.at[0], from, to));
                let _ = one.refine(&Vector1::new(1.0), &sizes, self.close(sizes[0]), &mut |x| at(x[0]))?;
            }
            let error = found.iter().map(|one| one.error.relative).fold(0.0, f64::max);
            if error <= self.tolerance && counts(&mut at, &found)? != unstable {
                let what = "number of unstable roots on a finer mesh";
                return Err(StabilityError::NoConvergence { what, residual: error });
            }
            Ok(((found, unstable), Some(error)))
        })?;
        Ok(found.iter().map(|one| Crossing::at(one.place).estimated(&one.error)).collect())
    }
}
