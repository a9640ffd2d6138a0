//! Where roots cross the axis as a parameter changes.

use std::cell::Cell;

use nalgebra::Vector1;

use super::error::StabilityError;
use super::follow::Follower;
use super::linearisation::{Linearisation, Unstable};
use super::roots::{roots_right_of, threshold, with_conjugate};
use super::spectrum::{Found, Part};
use crate::error::ParameterError;

/// A root with |Re λ| below this share of its size, or of the slowest rate, is on the axis. Rounding is 1e-13.
const ON_AXIS: f64 = 1e-11;
/// Where rounding is larger the root jumps to and fro across the axis, by less than this.
const NEXT_TO_AXIS: f64 = 1e-9;

/// A crossing of the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
#[must_use]
#[non_exhaustive]
pub struct Onset {
    /// The parameter's value.
    pub parameter: f64,
    /// The angular frequency there, 1/s; zero if the crossing is at λ = 0, where nothing oscillates.
    pub frequency: f64,
    /// Whether the essential spectrum crosses: waves of every length at once.
    pub essential: bool,
    /// |Re λ| that is left, 1/s.
    pub residual: f64,
    /// Linearisations that it took.
    pub linearisations: usize,
    /// Elements of the growth zone on the mesh that it was found on.
    pub elements: usize,
    /// By how much the mesh puts the parameter off, estimated; none if nobody has asked for it, see
    /// [`with_error`](Self::with_error) and [`Refinement`](super::Refinement).
    pub parameter_error: Option<f64>,
    /// The same for the frequency, 1/s.
    pub frequency_error: Option<f64>,
    pub(super) crossing: Follower<1>,
}

impl Onset {
    /// The period at onset, s; infinite for a crossing at λ = 0.
    #[must_use]
    pub fn period(&self) -> f64 {
        std::f64::consts::TAU / self.frequency
    }

    /// By how much the mesh puts the period off, estimated, s; none if nobody has asked for it, or for a crossing at λ = 0.
    #[must_use]
    pub fn period_error(&self) -> Option<f64> {
        let oscillates = self.frequency > 0.0;
        self.frequency_error.filter(|_| oscillates).map(|error| self.period() * error / self.frequency)
    }

    pub(super) fn of(crossing: &Follower<1>, linearisations: usize) -> Self {
        Self {
            parameter: crossing.at[0],
            frequency: crossing.frequency(),
            essential: matches!(crossing.part, Part::Essential(_)),
            residual: crossing.root.re.abs(),
            linearisations,
            elements: crossing.elements,
            parameter_error: None,
            frequency_error: None,
            crossing: *crossing,
        }
    }
}

/// Finds the value of a parameter between `from` and `to` at which the rightmost root, isolated or essential, crosses the
/// axis. `family` makes the shoot of a parameter's value stationary and linearises it.
///
/// The numbers of unstable roots at the ends must differ, one of them being zero.
///
/// # Errors
/// What `family` reports, a range without a crossing, or a root that is lost.
pub fn onset(
    mut family: impl FnMut(f64) -> Result<Linearisation, StabilityError>,
    from: f64,
    to: f64,
) -> Result<Onset, StabilityError> {
    check_range(from, to)?;
    let linearisations = Cell::new(0);
    let mut at = |parameter: f64| {
        linearisations.set(linearisations.get() + 1);
        family(parameter)
    };
    let (first, last) = (at(from)?, at(to)?);
    let ends = [first.unstable()?, last.unstable()?];
    let (stable_end, unstable, linear) = match ends.map(number) {
        [0, n] if n > 0 => (from, to, last),
        [n, 0] if n > 0 => (to, from, first),
        [unstable_from, unstable_to] => {
            return Err(match ends {
                [Unstable::Infinite { abscissa }, _] | [_, Unstable::Infinite { abscissa }] => {
                    StabilityError::InfinitelyMany { abscissa }
                }
                _ => StabilityError::NoCrossing { from, to, unstable_from, unstable_to },
            });
        }
    };
    let mut stable = stable_end;
    // The leading root at the unstable end is followed to the axis. Where that fails the range is halved by counting.
    let mut leading = Follower::new(&linear, Vector1::new(unstable), linear.leading()?);
    for _ in 0..60 {
        let crossing = follow_to_axis(&mut at, leading, stable)?;
        let next = match &crossing {
            // It must be the last to cross: nothing is unstable just beyond.
            Some(crossing) => {
                let beyond = crossing.at[0] + (stable_end - crossing.at[0]).signum() * 1e-5 * (to - from).abs();
                beyond.clamp(from.min(to), from.max(to))
            }
            None => 0.5 * (stable + leading.at[0]),
        };
        let linear = at(next)?;
        match (number(linear.unstable()?), crossing) {
            (0, Some(crossing)) => return Ok(Onset::of(&crossing, linearisations.get())),
            (0, None) => stable = next,
            (_, crossing) => {
                stable = if crossing.is_some() { stable_end } else { stable };
                leading = Follower::new(&linear, Vector1::new(next), linear.leading()?);
            }
        }
    }
    Err(StabilityError::NoConvergence { what: "onset", residual: leading.root.re })
}

/// Finds every value of a parameter between `from` and `to` at which roots cross the axis for good: the number of unstable
/// roots changes there. Roots that cross and come back between two counts are not seen.
///
/// # Errors
/// What `family` reports, infinitely many unstable roots somewhere in the range, or a root that is lost.
pub fn crossings(
    mut family: impl FnMut(f64) -> Result<Linearisation, StabilityError>,
    from: f64,
    to: f64,
) -> Result<Vec<Onset>, StabilityError> {
    check_range(from, to)?;
    let linearisations = Cell::new(0);
    let mut at = |parameter: f64| {
        linearisations.set(linearisations.get() + 1);
        let linear = family(parameter)?;
        match linear.unstable()? {
            Unstable::Finite(number) => Ok((parameter, linear, number)),
            Unstable::Infinite { abscissa } => Err(StabilityError::InfinitelyMany { abscissa }),
        }
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
        // The root that has crossed last. A pair in each of two planes at most, or it is not worth the search.
        let last = if change <= 4 || narrow { next_to_axis(&more.1)? } else { None };
        let crossing = match last {
            Some((root, number)) if number == change || narrow => {
                let root = Follower::new(&more.1, Vector1::new(more.0), root);
                follow_to_axis(&mut |parameter| Ok(at(parameter)?.1), root, fewer.0)?
            }
            _ => None,
        };
        match crossing {
            Some(crossing) => found.push(crossing),
            None if narrow => {
                let what = "search for a root that crosses the axis";
                return Err(StabilityError::NoConvergence { what, residual: change as f64 });
            }
            None => {
                let middle = at(0.5 * (a.0 + b.0))?;
                brackets.push((middle.clone(), b));
                brackets.push((a, middle));
            }
        }
    }
    found.sort_by(|a, b| a.at[0].total_cmp(&b.at[0]));
    Ok(found.iter().map(|crossing| Onset::of(crossing, linearisations.get())).collect())
}

fn check_range(from: f64, to: f64) -> Result<(), ParameterError> {
    ParameterError::finite("start of the parameter's range", from)?;
    ParameterError::finite("end of the parameter's range", to)
}

fn number(unstable: Unstable) -> usize {
    match unstable {
        Unstable::Finite(number) => number,
        Unstable::Infinite { .. } => usize::MAX,
    }
}

/// A root with its part of the spectrum, and how many roots it stands for.
type Candidate = (Found, usize);

/// The unstable root next to the axis.
fn next_to_axis(linear: &Linearisation) -> Result<Option<Candidate>, StabilityError> {
    let mut best: Option<Candidate> = None;
    for (name, block) in linear.spectrum.blocks() {
        if let Some(z) = roots_right_of(block, threshold(block))?.last()
            && best.is_none_or(|((_, other), _)| z.re < other.re)
        {
            best = Some(((name, *z), with_conjugate(z) * block.multiplicity));
        }
    }
    Ok(best)
}

/// Follows an unstable root to the axis by the secant of its real part, between its parameter and `end`; none if it is lost
/// or does not get there.
fn follow_to_axis(
    family: &mut impl FnMut(f64) -> Result<Linearisation, StabilityError>,
    mut root: Follower<1>,
    end: f64,
) -> Result<Option<Follower<1>>, StabilityError> {
    let (mut unstable, mut stable) = (root.at[0], end);
    // A first small step to learn the slope.
    let mut next = unstable + 1e-3 * (stable - unstable);
    for _ in 0..40 {
        let to = Vector1::new(next);
        if root.advance(to, root.predict(&to), &family(next)?).is_err() {
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
    Ok(root.is_on_axis(NEXT_TO_AXIS).then_some(root))
}
