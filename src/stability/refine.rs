//! Meshes that are refined until an estimate of their error is below a tolerance.

use std::cell::Cell;

use nalgebra::{SVector, Vector1};

use super::error::StabilityError;
use super::follow::Follower;
use super::linearisation::{Linearisation, Unstable};
use super::mesh_error::{Convergence, ROUNDING, check_finer, size};
use super::modes::Root;
use super::onset::{Onset, crossings, onset};
use crate::error::ParameterError;

/// The smallest tolerance: what waves that are amplified along the shoot make of the rounding.
const SMALLEST: f64 = 1e-9;
/// How far beyond a crossing roots are counted, in fractions of the parameter's range.
const BEYOND: f64 = 1e-5;
/// The share of the slowest rate below which a root is zero as far as its relative error goes.
const NEAR_ZERO: f64 = 1e-3;
/// A correction may stop at this share of the tolerance.
const CLOSE: f64 = 1e-2;

/// To which relative tolerance, and on which meshes.
///
/// ```
/// # use morphorod::Shoot;
/// # use morphorod::constitutive::LinearElastic;
/// # use morphorod::growth::{Ongoing, UniformGrowth};
/// # use morphorod::load::Weight;
/// # use morphorod::stability::{Linearisation, Refinement, StabilityError};
/// # use morphorod::tropism::{Gravitropism, Memory, Response, SettledStatoliths};
/// # let memory = Memory { time: 720.0, delay: 720.0 };
/// let family = |length: f64, elements: usize| -> Result<Linearisation, StabilityError> {
///     let shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
///         .length(length).radius(5e-4).elements(elements)
///         .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: 72e3 }))
///         .tropism(Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(memory))
///         .load(Weight { density: 1000.0 })
///         .build()?;
///     Linearisation::about(&shoot)
/// };
/// let found = Refinement::to(1e-8).onset(family, 0.06, 0.075)?;
/// assert!((found.parameter / 0.071003931291 - 1.0).abs() < 1e-8, "m");
/// let error = found.parameter_error.expect("always there after a refinement");
/// println!("{} ± {error:.0e} m on {} elements", found.parameter, found.elements);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// The functions of this page take families of a parameter's value *and the number of elements*, and ask for more of these
/// until the answer moves so little from one mesh to the next that the estimated error of the finer one is below the
/// tolerance. A family that has a shoot, and not how to build it, cuts its elements: with `first` 1 the second argument is
/// the number of parts for [`Linearisation::refined`]. What the estimate means and how far it is to be trusted:
/// [`guide::stability`](crate::guide::stability). Meshes have `first` elements, then 3/2, 2, 3, 4, 6, 8 times as many and so on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// The largest error of the mesh, relative to the answer.
    pub tolerance: f64,
    /// Elements of the first mesh.
    pub first: usize,
    /// The largest number of elements.
    pub last: usize,
}

/// A crossing on its way to finer meshes.
type Climber = (Follower<1>, Convergence);

impl Refinement {
    /// From four elements on to at most 64.
    #[must_use]
    pub fn to(tolerance: f64) -> Self {
        Self { tolerance, first: 4, last: 64 }
    }

    pub(super) fn check(&self) -> Result<(), ParameterError> {
        let ok = self.tolerance >= SMALLEST && self.tolerance < 1.0;
        ParameterError::unless(ok, "tolerance of the mesh", self.tolerance, "at least 1e-9, and below 1")?;
        ParameterError::unless(self.first > 0, "elements of the first mesh", self.first as f64, "at least 1")?;
        // An answer is held against that on another mesh.
        let ok = self.meshes().nth(1).is_some();
        let requirement =
            "enough for two meshes: half as many again as those of the first if these are even, else twice as many";
        ParameterError::unless(ok, "elements of the finest mesh", self.last as f64, requirement)
    }

    /// The numbers of elements.
    pub(super) fn meshes(self) -> impl Iterator<Item = usize> {
        let all = (0..).filter_map(move |k: u32| {
            let doubled = self.first.saturating_mul(1 << (k / 2).min(60));
            if k.is_multiple_of(2) {
                Some(doubled)
            } else {
                // One and a half times as many, if that is a whole number.
                doubled.is_multiple_of(2).then(|| doubled.saturating_add(doubled / 2))
            }
        });
        all.take_while(move |&n| n <= self.last)
    }

    /// How close to a crossing a correction must come.
    pub(super) fn close<const N: usize>(&self, sizes: &SVector<f64, N>) -> f64 {
        (CLOSE * self.tolerance).max(ROUNDING) * sizes.min()
    }

    /// Follows a crossing onto a finer mesh, and tells its error on the mesh that it comes from and on this one.
    pub(super) fn go_finer<const N: usize>(
        &self,
        crossing: &mut Follower<N>,
        convergence: &mut Convergence,
        free: &SVector<f64, N>,
        sizes: &SVector<f64, N>,
        family: &mut impl FnMut(&SVector<f64, N>) -> Result<Linearisation, StabilityError>,
    ) -> Result<[MeshError<N>; 2], StabilityError> {
        let before = *crossing;
        let linear = family(&before.at)?;
        check_finer(before.elements, &linear)?;
        crossing.change_mesh(before.root, &linear)?;
        // Each parameter in its own unit.
        crossing.correct(free, self.close(sizes), family)?;
        let swing = if crossing.root.im == 0.0 { crossing.rate } else { crossing.root.im.abs() };
        let error = |share: f64| {
            let error = |moved: f64, size: f64| (moved.abs() * share).max(ROUNDING * size);
            let parameters = (crossing.at - before.at).zip_map(sizes, error);
            let frequency = error(crossing.root.im.abs() - before.root.im.abs(), swing);
            MeshError { parameters, frequency, relative: parameters.component_div(sizes).max().max(frequency / swing) }
        };
        let coarse = error(1.0);
        Ok([coarse, error(convergence.share_that_is_left(coarse.relative, before.elements, &linear))])
    }

    /// As [`onset`](super::onset()), to the tolerance. The parameter's error is relative to the parameter, or to the larger
    /// end of a range that holds zero; the frequency's relative to the frequency, or to the slowest rate if nothing oscillates.
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
        self.check()?;
        let count = Cell::new(0);
        let mut known: Option<Climber> = None;
        let mut reached = Reached::default();
        for n in self.meshes() {
            let mut at = |x: f64| {
                count.set(count.get() + 1);
                family(x, n)
            };
            if let Some((mut crossing, mut convergence)) = known {
                let sizes = Vector1::new(size(crossing.at[0], from, to));
                let error =
                    self.go_finer(&mut crossing, &mut convergence, &Vector1::new(1.0), &sizes, &mut |x| at(x[0]));
                if let Some([_, error]) = reached.unless_lost(error)? {
                    known = Some((crossing, convergence));
                    reached.at(n, error.relative);
                    if error.relative > self.tolerance {
                        continue;
                    }
                    // Nothing else may be unstable just beyond.
                    let beyond = crossing.at[0] - crossing.slope[0].re.signum() * BEYOND * (to - from).abs();
                    let beyond = at(beyond.clamp(from.min(to), from.max(to)))?.unstable();
                    if reached.unless_lost(beyond)? == Some(Unstable::Finite(0)) {
                        return Ok(error.of(&crossing, count.get()));
                    }
                }
            }
            known = reached.unless_lost(onset(at, from, to))?.map(|found| (found.crossing, Convergence::default()));
        }
        Err(reached.not_met(self.tolerance))
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
        self.check()?;
        let count = Cell::new(0);
        let mut known: Option<(Vec<Climber>, [Unstable; 2])> = None;
        let mut reached = Reached::default();
        for n in self.meshes() {
            let mut at = |x: f64| {
                count.set(count.get() + 1);
                family(x, n)
            };
            if let Some((places, numbers)) = &mut known {
                let moves = places.iter_mut().map(|(place, convergence)| {
                    let sizes = Vector1::new(size(place.at[0], from, to));
                    self.go_finer(place, convergence, &Vector1::new(1.0), &sizes, &mut |x| at(x[0]))
                });
                if let Some(errors) = reached.unless_lost(moves.collect::<Result<Vec<_>, _>>())? {
                    let error = errors.iter().map(|[_, error]| error.relative).fold(0.0, f64::max);
                    reached.at(n, error);
                    if error > self.tolerance {
                        continue;
                    }
                    // As many roots have crossed as on the mesh where they were sought.
                    if reached.unless_lost(ends(&mut at, from, to))? == Some(*numbers) {
                        let found = errors.iter().zip(places.iter());
                        return Ok(found.map(|([_, error], (place, _))| error.of(place, count.get())).collect());
                    }
                }
            }
            let all = reached.unless_lost(crossings(&mut at, from, to))?;
            let numbers = reached.unless_lost(ends(&mut at, from, to))?;
            let places = all.map(|found| found.iter().map(|onset| (onset.crossing, Convergence::default())).collect());
            known = places.zip(numbers);
        }
        Err(reached.not_met(self.tolerance))
    }

    /// The isolated roots with Re λ > `line` as [`Linearisation::roots`] finds them, to the tolerance, relative to |λ| or to a
    /// thousandth of the slowest rate. `family` makes the linear problem on a mesh of so many elements.
    ///
    /// # Errors
    /// Those of [`Linearisation::roots`], a tolerance that is not positive or below 1e-9, or
    /// [`ToleranceNotMet`](StabilityError::ToleranceNotMet).
    pub fn roots(
        &self,
        family: impl FnMut(usize) -> Result<Linearisation, StabilityError>,
        line: f64,
    ) -> Result<Vec<Root>, StabilityError> {
        self.find(family, |linear| linear.roots(line))
    }

    /// The rightmost isolated root as [`Linearisation::rightmost`] finds it, to the tolerance, in terms of
    /// [`roots`](Self::roots).
    ///
    /// # Errors
    /// Those of [`Linearisation::rightmost`], a tolerance that is not positive or below 1e-9, or
    /// [`ToleranceNotMet`](StabilityError::ToleranceNotMet).
    pub fn rightmost(
        &self,
        family: impl FnMut(usize) -> Result<Linearisation, StabilityError>,
    ) -> Result<Root, StabilityError> {
        let found = self.find(family, |linear| Ok(vec![linear.rightmost()?]))?;
        found.into_iter().next().ok_or(StabilityError::NoIsolatedRoot)
    }

    /// Roots that are sought on every mesh anew, until those of two meshes are as many and near enough.
    fn find(
        &self,
        mut family: impl FnMut(usize) -> Result<Linearisation, StabilityError>,
        sought: impl Fn(&Linearisation) -> Result<Vec<Root>, StabilityError>,
    ) -> Result<Vec<Root>, StabilityError> {
        self.check()?;
        let mut known: Option<(usize, Vec<Root>)> = None;
        let mut convergence = Convergence::default();
        let mut reached = Reached::default();
        for n in self.meshes() {
            let answer = family(n).and_then(|linear| Ok((sought(&linear)?, linear)));
            let Some((mut roots, linear)) = reached.unless_lost(answer)? else {
                (known, convergence) = (None, Convergence::just_resolved());
                continue;
            };
            if let Some((elements, coarse)) = &known {
                check_finer(*elements, &linear)?;
                let smallest = NEAR_ZERO * linear.slowest_rate();
                let moved: Vec<f64> = roots.iter().map(|root| distance(root, coarse)).collect();
                let sizes: Vec<f64> = roots.iter().map(|root| root.value.norm().max(smallest)).collect();
                let farthest = moved.iter().zip(&sizes).map(|(moved, size)| moved / size).fold(ROUNDING, f64::max);
                let share = convergence.share_that_is_left(farthest, *elements, &linear);
                for ((root, moved), size) in roots.iter_mut().zip(moved).zip(sizes) {
                    root.error = Some((moved * share).max(ROUNDING * size));
                }
                let relative =
                    if coarse.len() == roots.len() { (farthest * share).max(ROUNDING) } else { f64::INFINITY };
                reached.at(n, relative);
                if relative <= self.tolerance {
                    return Ok(roots);
                }
            }
            known = Some((linear.elements(), roots));
        }
        Err(reached.not_met(self.tolerance))
    }
}

/// What a search has come to.
pub(super) struct Reached {
    /// The estimated error, relative.
    error: f64,
    /// Elements of the last mesh that had one.
    elements: usize,
    /// Why the last mesh that had none had none.
    lost: Option<StabilityError>,
}

impl Default for Reached {
    fn default() -> Self {
        Self { error: f64::INFINITY, elements: 0, lost: None }
    }
}

impl Reached {
    pub fn at(&mut self, elements: usize, error: f64) {
        (self.error, self.elements) = (error, elements);
    }

    /// None for what a finer mesh may do away with.
    pub fn unless_lost<T>(&mut self, answer: Result<T, StabilityError>) -> Result<Option<T>, StabilityError> {
        use StabilityError::{MechanicallyUnstable, NoConvergence, UnderResolved, Unresolved};
        match answer {
            Ok(answer) => Ok(Some(answer)),
            // A step that a coarse mesh has made too long may end where the shoot buckles.
            Err(
                error @ (UnderResolved { .. } | Unresolved { .. } | NoConvergence { .. } | MechanicallyUnstable { .. }),
            ) => {
                self.lost = Some(error);
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// The error of a search that has come to the finest mesh.
    pub fn not_met(self, tolerance: f64) -> StabilityError {
        let Self { error, elements, lost } = self;
        match lost {
            Some(lost) if error.is_infinite() => lost,
            _ => StabilityError::ToleranceNotMet { tolerance, error, elements },
        }
    }
}

/// How far a root is from the nearest of some others, 1/s.
fn distance(root: &Root, others: &[Root]) -> f64 {
    others.iter().map(|other| (other.value - root.value).norm()).fold(f64::INFINITY, f64::min)
}

/// The numbers of unstable roots at two values of a parameter.
fn ends(
    family: &mut impl FnMut(f64) -> Result<Linearisation, StabilityError>,
    from: f64,
    to: f64,
) -> Result<[Unstable; 2], StabilityError> {
    Ok([family(from)?.unstable()?, family(to)?.unstable()?])
}

/// The error of a crossing on a mesh, estimated.
#[derive(Debug, Clone, Copy)]
pub(super) struct MeshError<const N: usize> {
    pub parameters: SVector<f64, N>,
    /// 1/s.
    pub frequency: f64,
    /// The largest of them, each relative to its size.
    pub relative: f64,
}

impl<const N: usize> MeshError<N> {
    /// The larger ones of two.
    pub fn larger(&self, other: &Self) -> Self {
        Self {
            parameters: self.parameters.sup(&other.parameters),
            frequency: self.frequency.max(other.frequency),
            relative: self.relative.max(other.relative),
        }
    }
}

impl MeshError<1> {
    /// A crossing with its error.
    fn of(&self, crossing: &Follower<1>, linearisations: usize) -> Onset {
        let (parameter_error, frequency_error) = (Some(self.parameters[0]), Some(self.frequency));
        Onset { parameter_error, frequency_error, ..Onset::of(crossing, linearisations) }
    }
}
