//! Mesh refinement: computation of a result on finer meshes until its estimated error meets a
//! tolerance.

use std::iter::{once, successors};

use nalgebra::Complex;

use super::follow::find_alike;
use super::mesh_error::{ACCURACY, Convergence, ROUNDING, check_finer};
use crate::error::ParameterError;
use crate::linearisation::{MOST_RESOLVED_ELEMENTS, Outcome, StabilityError};
use crate::model::Model;
use crate::shoot::Shoot;
use crate::stability::spectrum::{Linearisation, Root, SpectrumPart};

/// Relative tolerance and range of meshes of a mesh refinement.
///
/// ```
/// # use morphorod::ShootParameters;
/// # use morphorod::stability::{Linearisation, Refinement, StabilityError};
/// let family = |length: f64, elements: usize| -> Result<Linearisation, StabilityError> {
///     let parameters = ShootParameters {
///         length,
///         growth_time: 72e3,
///         proprioceptive_sensitivity: 0.0,
///         ..Default::default()
///     };
///     let shoot = parameters.reduced().elements(elements).build()?;
///     Linearisation::about(&shoot)
/// };
/// let found = Refinement::to(1e-8).onset(family, 0.06, 0.075)?;
/// let [length] = found.parameters;
/// assert!((length / 0.071003931291 - 1.0).abs() < 1e-8, "m");
/// let [error] = found.parameter_errors.expect("estimated by a refinement");
/// println!("{length} ± {error:.0e} m on {} elements", found.elements);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Each method takes a family of linearisations, whose last argument is *the number of elements*,
/// and increases this number until the estimated error of the result, from its change between two
/// meshes, is below the tolerance. A family that cannot build its shoot anew divides the elements:
/// with `first` 1 the number is that of the parts for [`Linearisation::refined`]. The reliability
/// of the estimate: [`guide::stability`](crate::guide::stability). Meshes have `first` elements,
/// then 3/2, 2, 3, 4, 6, 8 times as many and so on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// Largest error due to the mesh, relative to the result; at least 1e-9, and below 1.
    pub tolerance: f64,
    /// Number of elements of the first mesh; at least 1.
    pub first: usize,
    /// Largest number of elements. An estimate needs two meshes: at least 3/2 of `first` if that is
    /// even, otherwise twice `first`.
    pub last: usize,
}

impl Refinement {
    /// A refinement from four to at most 64 elements.
    #[must_use]
    pub fn to(tolerance: f64) -> Self {
        Self {
            tolerance,
            first: 4,
            last: 64,
        }
    }

    pub(super) fn check(&self) -> Result<(), ParameterError> {
        let ok = self.tolerance >= ACCURACY && self.tolerance < 1.0;
        ParameterError::unless(
            ok,
            "tolerance of the mesh",
            self.tolerance,
            "at least 1e-9, and below 1",
        )?;
        ParameterError::unless(
            self.first > 0,
            "elements of the first mesh",
            self.first as f64,
            "at least 1",
        )?;
        // An estimate requires two meshes.
        let ok = self.meshes().nth(1).is_some();
        let requirement = "enough for two meshes: half as many again as those of the first if these are even, else twice as many";
        ParameterError::unless(
            ok,
            "elements of the finest mesh",
            self.last as f64,
            requirement,
        )
    }

    /// The numbers of elements: each doubling, and between two of them one and a half times as many
    /// if that is a whole number.
    fn meshes(self) -> impl Iterator<Item = usize> {
        let doubled = successors(Some(self.first), |n| n.checked_mul(2));
        let all = doubled
            .flat_map(|n| once(n).chain(n.is_multiple_of(2).then(|| n.saturating_add(n / 2))));
        all.take_while(move |&n| n <= self.last)
    }

    /// Largest distance between a crossing of a size and its correction: a hundredth of the
    /// tolerance, but not below rounding.
    pub(super) fn close(&self, size: f64) -> f64 {
        (1e-2 * self.tolerance).max(ROUNDING) * size
    }

    /// Computes a result on finer meshes until the estimate of its relative error meets the
    /// tolerance. `on_mesh` takes the number of elements and the result on the mesh before, if
    /// there is one. It returns a result, and an estimate of its error if possible. If the
    /// resolution does not suffice, it is called without the result on the mesh before, and then on
    /// the next mesh. On the last mesh it is called only with such a result, without which there is
    /// no estimate.
    ///
    /// # Errors
    /// [`ToleranceNotMet`](StabilityError::ToleranceNotMet), or the last error if there was no
    /// estimate; errors of `on_mesh` that are not due to the resolution.
    pub(super) fn converge<A>(
        &self,
        mut on_mesh: impl FnMut(usize, Option<A>) -> Outcome<(A, Option<f64>)>,
    ) -> Outcome<A> {
        let (mut known, mut failure) = (None, None);
        let (mut error, mut elements) = (f64::INFINITY, 0);
        let mut meshes = self.meshes().peekable();
        while let Some(n) = meshes.next() {
            let anew = meshes.peek().map(|_| None);
            for coarser in known.take().map(Some).into_iter().chain(anew) {
                match on_mesh(n, coarser) {
                    Ok((answer, Some(estimate))) if estimate <= self.tolerance => {
                        return Ok(answer);
                    }
                    Ok((answer, estimate)) => {
                        (error, elements) =
                            estimate.map_or((error, elements), |estimate| (estimate, n));
                        known = Some(answer);
                        break;
                    }
                    Err(error) if depends_on_mesh(&error) => failure = Some(error),
                    Err(error) => return Err(error),
                }
            }
        }
        Err(match failure {
            Some(failure) if error.is_infinite() => failure,
            _ => StabilityError::ToleranceNotMet {
                tolerance: self.tolerance,
                error,
                elements,
            },
        })
    }

    /// Finds the isolated roots with Re λ > `line` (1/s) as [`Linearisation::roots`] does, to the
    /// tolerance, relative to |λ| or to a thousandth of the slowest rate. `family` returns the
    /// linearisation on a mesh with a number of elements.
    ///
    /// # Errors
    /// Errors of [`Linearisation::roots`], a tolerance below 1e-9 or a range of meshes that is too
    /// small, or [`ToleranceNotMet`](StabilityError::ToleranceNotMet).
    pub fn roots(
        &self,
        family: impl FnMut(usize) -> Result<Linearisation, StabilityError>,
        line: f64,
    ) -> Result<Vec<Root>, StabilityError> {
        Ok(self
            .refine_roots(family, |linear| Ok(((), linear.roots(line)?)))?
            .1)
    }

    /// Finds the rightmost isolated root as [`Linearisation::rightmost`] does, to the tolerance;
    /// its error is relative as in [`roots`](Self::roots).
    ///
    /// # Errors
    /// Errors of [`Linearisation::rightmost`], a tolerance below 1e-9 or a range of meshes that is
    /// too small, or [`ToleranceNotMet`](StabilityError::ToleranceNotMet).
    pub fn rightmost(
        &self,
        family: impl FnMut(usize) -> Result<Linearisation, StabilityError>,
    ) -> Result<Root, StabilityError> {
        let (_, found) = self.refine_roots(family, |linear| Ok(((), vec![linear.rightmost()?])))?;
        found
            .into_iter()
            .next()
            .ok_or(StabilityError::NoIsolatedRoot)
    }

    /// Seeks roots on every mesh, until those of two meshes agree in number and value, and a
    /// further answer agrees, too. Returns the finer linearisation, and its roots with their
    /// errors.
    fn refine_roots<A: PartialEq>(
        &self,
        mut family: impl FnMut(usize) -> Outcome<Linearisation>,
        sought: impl Fn(&Linearisation) -> Outcome<(A, Vec<Root>)>,
    ) -> Outcome<(Linearisation, Vec<Root>)> {
        self.check()?;
        let (found, ..) = self.converge(|n, coarser: Option<OnMesh<A>>| {
            let mut linear = family(n)?;
            let (answer, mut roots) = sought(&linear)?;
            let Some(((mut coarse, of_coarse), before, mut convergence)) = coarser else {
                let convergence = Convergence {
                    just_resolved: n > self.first,
                    ..Convergence::default()
                };
                return Ok((((linear, roots), answer, convergence), None));
            };
            check_finer(coarse.elements(), &linear)?;
            let sizes = roots.iter().map(|root| linear.size(root.value));
            let changes: Vec<f64> = roots
                .iter()
                .map(|root| distance(root, &of_coarse))
                .collect();
            let largest = changes
                .iter()
                .zip(sizes)
                .map(|(change, size)| change / size)
                .fold(ROUNDING, f64::max);
            let share = convergence.error_share(largest, coarse.elements(), &linear);
            for (root, change) in roots.iter_mut().zip(changes) {
                root.error = Some((change * share).max(ROUNDING * linear.size(root.value)));
            }
            let agree = of_coarse.len() == roots.len() && before == answer;
            let estimate = if agree {
                (largest * share).max(ROUNDING)
            } else {
                f64::INFINITY
            };
            coarse.coarser = None;
            linear.coarser = Some((Box::new(coarse), share));
            Ok((((linear, roots), answer, convergence), Some(estimate)))
        })?;
        Ok(found)
    }
}

/// A linearisation with the roots sought, a further answer, and the convergence so far.
type OnMesh<A> = ((Linearisation, Vec<Root>), A, Convergence);

impl Linearisation {
    /// Linearises a shoot about its present state, which must be a steady state, on a mesh that
    /// resolves its waves. The elements are divided into 2, 3, 4, 6, 8 … parts. Refinement ends
    /// when the number of unstable roots and the rightmost isolated root agree on two meshes, and
    /// the estimated error of the root is below `tolerance`, relative to |λ| or to a thousandth of
    /// the slowest rate. The shoot is not changed.
    ///
    /// The roots that [`roots`](Self::roots) and [`rightmost`](Self::rightmost) then return have an
    /// estimate of their [error](Root::error), from the mesh before.
    ///
    /// ```
    /// # use morphorod::ShootParameters;
    /// # use morphorod::stability::Linearisation;
    /// // Fast growth causes short waves.
    /// let parameters = ShootParameters {
    ///     length: 0.07,
    ///     growth_time: 12e3,
    ///     proprioceptive_sensitivity: 5.0,
    ///     ..Default::default()
    /// };
    /// let shoot = parameters.reduced().elements(2).build()?;
    /// let linear = Linearisation::resolved(&shoot, 1e-6)?;
    /// println!("{} unstable roots on {} elements", linear.unstable()?, linear.elements());
    /// let root = linear.rightmost()?;
    /// assert!(root.error.is_some_and(|error| error < 1e-6 * root.value.norm()));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Errors of [`about`](Self::about), a tolerance below 1e-9, or a tolerance that the finest
    /// mesh does not meet. This mesh has at most 128 elements in the whole shoot, or two parts of
    /// each element if the shoot has more than 64.
    pub fn resolved(shoot: &Shoot<impl Model>, tolerance: f64) -> Result<Self, StabilityError> {
        let elements = shoot.rod().elements();
        let meshes = Refinement {
            tolerance,
            first: 1,
            last: (MOST_RESOLVED_ELEMENTS / elements).max(2),
        };
        let answers = |linear: &Self| {
            let number = linear.count_unstable()?;
            match linear.rightmost() {
                Err(StabilityError::NoIsolatedRoot) => Ok((number, Vec::new())),
                root => Ok((number, vec![root?])),
            }
        };
        let mut found = meshes.refine_roots(|parts| Self::refined(shoot, parts), answers);
        if let Err(StabilityError::ToleranceNotMet {
            elements: parts, ..
        }) = &mut found
        {
            *parts *= elements;
        }
        Ok(found?.0)
    }

    /// The size to which the error of a root is relative, 1/s: |λ|, or a thousandth of the slowest
    /// rate.
    fn size(&self, root: Complex<f64>) -> f64 {
        root.norm().max(self.characteristic.smallest_modulus())
    }

    /// Estimated error of a root due to the mesh, 1/s. None without a coarser mesh, or without a
    /// root next to this one on that mesh.
    pub(in crate::stability) fn error_of(
        &self,
        part: SpectrumPart,
        root: Complex<f64>,
    ) -> Option<f64> {
        let (coarser, share) = self.coarser.as_ref()?;
        let there = find_alike(coarser, part, root).ok()?.value;
        Some(((there - root).norm() * share).max(ROUNDING * self.size(root)))
    }
}

/// Whether a finer mesh may give a result. A step of the parameters that is too long because of a
/// coarse mesh may lead to parameters at which the shoot buckles.
fn depends_on_mesh(error: &StabilityError) -> bool {
    use StabilityError::{MechanicallyUnstable, NoConvergence, UnderResolved};
    matches!(
        error,
        UnderResolved { .. } | NoConvergence { .. } | MechanicallyUnstable { .. }
    )
}

/// Distance of a root from the nearest of some others, 1/s.
fn distance(root: &Root, others: &[Root]) -> f64 {
    others
        .iter()
        .map(|other| (other.value - root.value).norm())
        .fold(f64::INFINITY, f64::min)
}

impl Root {
    /// The root with an estimate of the error due to its mesh: the distance from the root of
    /// `finer`, the linearisation of the same shoot on a finer mesh.
    ///
    /// # Errors
    /// A mesh that is not finer, or without a root near this one.
    pub fn with_error(self, finer: &Linearisation) -> Result<Self, StabilityError> {
        check_finer(
            self.strain.len() / finer.characteristic.points_per_element(),
            finer,
        )?;
        // The number of the block does not matter: the root is sought in all of them.
        let there = find_alike(finer, SpectrumPart::Isolated(0), self.value)?.value;
        let error = (there - self.value)
            .norm()
            .max(ROUNDING * self.value.norm());
        Ok(Self {
            error: Some(error),
            ..self
        })
    }
}
