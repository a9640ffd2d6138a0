//! Values of a parameter at which roots cross the imaginary axis. They are found on one mesh, or to
//! a tolerance: those of a coarse mesh are then corrected on finer ones.

use nalgebra::Vector1;

use super::crossing::Crossing;
use super::follow::{Follower, LinearFamily};
use super::mesh_error::{Estimated, size};
use super::refinement::Refinement;
use crate::error::ParameterError;
use crate::linearisation::{Outcome, StabilityError};
use crate::numerics::scalar::sort_by_value;
use crate::stability::spectrum::Linearisation;

/// Largest |Re λ| of a root on the axis, relative to its modulus or to the slowest rate. Its
/// rounding error is 1e-13. Amplified waves can increase the rounding error to a hundred times this
/// value.
const ON_AXIS: f64 = 1e-11;

/// A family of linearisations with one parameter on one mesh.
type FamilyOfNumber<'a> = dyn FnMut(f64) -> Outcome<Linearisation> + 'a;
/// Finds the crossings of a family, and the numbers of unstable roots that must be found on the
/// last mesh.
type Search<'a> = dyn Fn(&mut FamilyOfNumber) -> Outcome<(Vec<Crossing<1>>, Vec<usize>)> + 'a;
/// Counts the unstable roots of a family at estimated crossings or at the ends of the range.
type Count<'a> = dyn Fn(&mut FamilyOfNumber, &[Estimated<1>]) -> Outcome<Vec<usize>> + 'a;

/// Finds the value of a parameter between `from` and `to` at which the rightmost root, isolated or
/// essential, crosses the axis. `family` returns the linearisation about the steady state at a
/// value of the parameter.
///
/// The numbers of unstable roots at the ends must differ, one of them being zero.
///
/// # Errors
/// Errors of `family`, a range without a crossing, or a root that is lost.
#[doc(alias("critical length", "circumnutation"))]
pub fn onset(
    mut family: impl FnMut(f64) -> Result<Linearisation, StabilityError>,
    from: f64,
    to: f64,
) -> Result<Crossing<1>, StabilityError> {
    check_range(from, to)?;
    let (first, last) = (family(from)?, family(to)?);
    let (stable_end, unstable, linear) = match [first.count_unstable()?, last.count_unstable()?] {
        [0, n] if n > 0 => (from, to, last),
        [n, 0] if n > 0 => (to, from, first),
        _ => {
            return Err(StabilityError::NoCrossing {
                unstable: [first.unstable()?, last.unstable()?],
            });
        }
    };
    let mut stable = stable_end;
    // The leading root at the unstable end is followed to the axis. If that fails, the range is
    // bisected by counts.
    let mut leading = Follower::new(&linear, Vector1::new(unstable), linear.leading()?);
    for _ in 0..60 {
        let crossing = follow_to_axis(&mut |at| family(at[0]), leading, stable)?;
        let next = match &crossing {
            // It must be the last root to cross: no root is unstable just beyond.
            Some(crossing) => beyond(crossing.at[0], stable_end - crossing.at[0], from, to),
            None => 0.5 * (stable + leading.at[0]),
        };
        let linear = family(next)?;
        match (linear.count_unstable()?, crossing) {
            (0, Some(crossing)) => return Ok(Crossing::at(crossing)),
            (0, None) => stable = next,
            (_, crossing) => {
                stable = if crossing.is_some() {
                    stable_end
                } else {
                    stable
                };
                leading = Follower::new(&linear, Vector1::new(next), linear.leading()?);
            }
        }
    }
    Err(StabilityError::NoConvergence {
        what: "onset",
        residual: leading.root.re,
    })
}

/// Finds every value of a parameter between `from` and `to` at which the number of unstable roots
/// changes. Roots that cross the axis twice between two counts are not found.
///
/// # Errors
/// Errors of `family`, infinitely many unstable roots somewhere in the range, or a root that is
/// lost.
pub fn crossings(
    mut family: impl FnMut(f64) -> Result<Linearisation, StabilityError>,
    from: f64,
    to: f64,
) -> Result<Vec<Crossing<1>>, StabilityError> {
    check_range(from, to)?;
    let mut at = |parameter: f64| -> Result<_, StabilityError> {
        let linear = family(parameter)?;
        let number = linear.unstable()?;
        Ok((parameter, linear, number))
    };
    let mut found: Vec<Follower<1>> = Vec::new();
    let mut brackets = vec![(at(from)?, at(to)?)];
    while let Some((a, b)) = brackets.pop() {
        if a.2 == b.2 {
            continue;
        }
        let narrow = (b.0 - a.0).abs() <= 1e-9 * (to - from).abs();
        let (fewer, more) = if a.2 < b.2 { (&a, &b) } else { (&b, &a) };
        let change = more.2 - fewer.2;
        // The root that has crossed last is sought if at most two pairs have crossed; else the
        // range is bisected first.
        let last = if change <= 4 || narrow {
            more.1.next_to_axis()?
        } else {
            None
        };
        let crossing = match last {
            Some((root, number)) if number == change || narrow => {
                let root = Follower::new(&more.1, Vector1::new(more.0), root);
                follow_to_axis(&mut |parameter| Ok(at(parameter[0])?.1), root, fewer.0)?
            }
            _ => None,
        };
        match crossing {
            Some(crossing) => found.push(crossing),
            None if narrow => {
                let what = "search for a root that crosses the axis";
                return Err(StabilityError::NoConvergence {
                    what,
                    residual: change as f64,
                });
            }
            None => {
                let middle = at(0.5 * (a.0 + b.0))?;
                brackets.push((middle.clone(), b));
                brackets.push((a, middle));
            }
        }
    }
    sort_by_value(&mut found, |crossing| crossing.at[0]);
    Ok(found.into_iter().map(Crossing::at).collect())
}

fn check_range(from: f64, to: f64) -> Result<(), ParameterError> {
    ParameterError::finite("start of the parameter's range", from, "")?;
    ParameterError::finite("end of the parameter's range", to, "")?;
    ParameterError::unless(
        from != to,
        "end of the parameter's range",
        to,
        "another value than its start",
    )
}

/// The value of the parameter just beyond a crossing, in a direction (its sign), at which unstable
/// roots are counted. Its distance of 1e-5 of the range is far above the error of the crossing, and
/// far below the distance of two crossings.
fn beyond(crossing: f64, direction: f64, from: f64, to: f64) -> f64 {
    (crossing + direction.signum() * 1e-5 * (to - from).abs()).clamp(from.min(to), from.max(to))
}

/// Follows an unstable root to the axis by the secant method for its real part, between its
/// parameter and `end`; none if the root is lost or does not reach the axis.
fn follow_to_axis(
    family: &mut LinearFamily<1>,
    mut root: Follower<1>,
    end: f64,
) -> Outcome<Option<Follower<1>>> {
    let (mut unstable, mut stable) = (root.at[0], end);
    // A small first step determines the slope.
    let mut next = unstable + 1e-3 * (stable - unstable);
    for _ in 0..40 {
        let to = Vector1::new(next);
        if root.advance(to, root.predict(&to), &family(&to)?).is_err() {
            return Ok(None);
        }
        if root.is_on_axis(ON_AXIS) || (stable - unstable).abs() <= 1e-15 * next.abs() {
            break;
        }
        if root.root.re > 0.0 {
            unstable = next;
        } else {
            stable = next;
        }
        next += root.step_to_axis(&Vector1::new(1.0))[0];
        if !(next > stable.min(unstable) && next < stable.max(unstable)) {
            return Ok(None);
        }
    }
    Ok(root.is_on_axis(100.0 * ON_AXIS).then_some(root))
}

impl Refinement {
    /// Finds an onset as the function [`onset()`] does, to the tolerance. The error of the
    /// parameter is relative to the parameter, or to the larger end of a range that contains zero.
    /// That of the frequency is relative to the frequency, or to the slowest rate if nothing
    /// oscillates.
    ///
    /// # Errors
    /// Errors of [`onset()`], a tolerance below 1e-9 or a range of meshes that is too small, or
    /// [`ToleranceNotMet`](StabilityError::ToleranceNotMet).
    pub fn onset(
        &self,
        mut family: impl FnMut(f64, usize) -> Result<Linearisation, StabilityError>,
        from: f64,
        to: f64,
    ) -> Result<Crossing<1>, StabilityError> {
        let search = |at: &mut FamilyOfNumber| Ok((vec![onset(at, from, to)?], vec![0]));
        // No other root may be unstable just beyond the crossing.
        let counts = |at: &mut FamilyOfNumber, found: &[Estimated<1>]| {
            let places = found
                .iter()
                .map(|one| beyond(one.place.at[0], -one.place.slope[0].re, from, to));
            places.map(|place| at(place)?.count_unstable()).collect()
        };
        let found = self.refine_crossings(&mut family, [from, to], &search, &counts)?;
        found
            .into_iter()
            .next()
            .ok_or(StabilityError::NoConvergence {
                what: "onset",
                residual: f64::INFINITY,
            })
    }

    /// Finds crossings as the function [`crossings()`] does, to the tolerance; errors are relative
    /// as in [`onset`](Self::onset).
    ///
    /// # Errors
    /// Errors of [`crossings()`], a tolerance below 1e-9 or a range of meshes that is too small, or
    /// [`ToleranceNotMet`](StabilityError::ToleranceNotMet).
    pub fn crossings(
        &self,
        mut family: impl FnMut(f64, usize) -> Result<Linearisation, StabilityError>,
        from: f64,
        to: f64,
    ) -> Result<Vec<Crossing<1>>, StabilityError> {
        // The number of roots that cross must be the same on all meshes.
        let ends = |at: &mut FamilyOfNumber| {
            [from, to]
                .iter()
                .map(|end| at(*end)?.count_unstable())
                .collect::<Result<Vec<_>, _>>()
        };
        let search = |at: &mut FamilyOfNumber| Ok((crossings(&mut *at, from, to)?, ends(at)?));
        self.refine_crossings(&mut family, [from, to], &search, &|at, _| ends(at))
    }

    /// Corrects crossings from mesh to mesh. The numbers of unstable roots that `counts` returns on
    /// the last mesh must be those of `search`.
    fn refine_crossings(
        &self,
        family: &mut dyn FnMut(f64, usize) -> Outcome<Linearisation>,
        [from, to]: [f64; 2],
        search: &Search,
        counts: &Count,
    ) -> Outcome<Vec<Crossing<1>>> {
        self.check()?;
        let (found, _) = self.converge(|n, coarser: Option<(Vec<Estimated<1>>, Vec<usize>)>| {
            let mut at = |x: f64| family(x, n);
            let Some((mut found, unstable)) = coarser else {
                let (found, unstable) = search(&mut at)?;
                return Ok((
                    (
                        found.iter().map(|one| Estimated::new(one.place)).collect(),
                        unstable,
                    ),
                    None,
                ));
            };
            for one in &mut found {
                let sizes = Vector1::new(size(one.place.at[0], from, to));
                let _ = one.refine(&Vector1::new(1.0), &sizes, self.close(sizes[0]), &mut |x| {
                    at(x[0])
                })?;
            }
            let error = found
                .iter()
                .map(|one| one.error.relative)
                .fold(0.0, f64::max);
            if error <= self.tolerance && counts(&mut at, &found)? != unstable {
                let what = "number of unstable roots on a finer mesh";
                return Err(StabilityError::NoConvergence {
                    what,
                    residual: error,
                });
            }
            Ok(((found, unstable), Some(error)))
        })?;
        Ok(found
            .iter()
            .map(|one| Crossing::at(one.place).estimated(&one.error))
            .collect())
    }
}
