//! Where the rightmost root crosses the axis as a parameter changes.

use nalgebra::Complex;

use super::characteristic::Part;
use super::count::Unstable;
use super::roots::pair;
use super::{Linearisation, StabilityError};
use crate::error::ParameterError;

/// A crossing of the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
#[must_use]
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
}

impl Onset {
    /// The period at onset, s; infinite for a crossing at λ = 0.
    #[must_use]
    pub fn period(&self) -> f64 {
        std::f64::consts::TAU / self.frequency
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
    ParameterError::finite("start of the parameter's range", from)?;
    ParameterError::finite("end of the parameter's range", to)?;
    let mut linearisations = 2;
    let (first, last) = (family(from)?, family(to)?);
    let (a, b) = (first.unstable()?, last.unstable()?);
    let number = |u: Unstable| match u {
        Unstable::Finite(n) => n,
        Unstable::Infinite { .. } => usize::MAX,
    };
    let (mut stable, mut unstable, mut linear) = match (number(a), number(b)) {
        (0, n) if n > 0 => (from, to, last),
        (n, 0) if n > 0 => (to, from, first),
        (unstable_from, unstable_to) => {
            for end in [a, b] {
                if let Unstable::Infinite { abscissa } = end {
                    return Err(StabilityError::InfinitelyMany { abscissa });
                }
            }
            return Err(StabilityError::NoCrossing { from, to, unstable_from, unstable_to });
        }
    };
    // The leading root at the unstable end, followed along the parameter by the secant of its real part; where the secant
    // leaves the bracket or the root is lost, the bracket is halved by counting.
    let (mut part, mut root) = leading(&linear)?;
    let mut previous: Option<(f64, Complex<f64>)> = None;
    let mut current = (unstable, root);
    for _ in 0..60 {
        let width = unstable - stable;
        if root.re.abs() <= 1e-11 * root.norm().max(linear.slowest_rate()) || width.abs() <= 1e-15 * unstable.abs() {
            break;
        }
        let slope = previous.map(|(p, z)| (current.1 - z) / (current.0 - p));
        let mut next = match slope {
            Some(slope) if slope.re != 0.0 => current.0 - current.1.re / slope.re,
            // A first small step to learn the slope.
            _ => current.0 - 1e-3 * (current.0 - stable),
        };
        // Strictly inside, with room for rounding at the ends.
        let (low, high) = (stable.min(unstable), stable.max(unstable));
        if !(next > low && next < high) {
            next = 0.5 * (stable + unstable);
        }
        let candidate = family(next)?;
        linearisations += 1;
        let guess = slope.map_or(current.1, |slope| current.1 + slope * (next - current.0));
        // A root that comes to λ = 0 has no size of its own there.
        let near = 0.2 * guess.norm().max(0.1 * candidate.slowest_rate());
        let tracked = candidate.polish(guess, part).ok().filter(|z| (z - guess).norm() < near);
        let z = match tracked {
            Some(z) => z,
            None => match candidate.unstable()? {
                Unstable::Finite(0) => {
                    stable = next;
                    continue;
                }
                _ => {
                    (part, root) = leading(&candidate)?;
                    (unstable, linear) = (next, candidate);
                    previous = None;
                    current = (next, root);
                    continue;
                }
            },
        };
        previous = Some(current);
        current = (next, z);
        root = z;
        if z.re > 0.0 {
            unstable = next;
        } else {
            stable = next;
        }
        linear = candidate;
    }
    // A loop that ended otherwise has found no crossing to report.
    if root.re.abs() > 1e-9 * root.norm().max(linear.slowest_rate()) {
        return Err(StabilityError::NoConvergence { what: "onset", residual: root.re.abs() });
    }
    // The root that was followed must be the last to cross: nothing is unstable just beyond.
    let stable_end = if a == Unstable::Finite(0) { from } else { to };
    let beyond = current.0 + (stable_end - current.0).signum() * 1e-5 * (to - from).abs();
    if number(family(beyond.clamp(from.min(to), from.max(to)))?.unstable()?) != 0 {
        let rest = onset(family, beyond, stable_end)?;
        return Ok(Onset { linearisations: rest.linearisations + linearisations + 1, ..rest });
    }
    Ok(Onset {
        parameter: current.0,
        frequency: frequency(&linear, root),
        essential: matches!(part, Part::Essential(_)),
        residual: root.re.abs(),
        linearisations: linearisations + 1,
    })
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
    ParameterError::finite("start of the parameter's range", from)?;
    ParameterError::finite("end of the parameter's range", to)?;
    let mut linearisations = 0;
    let mut at = |parameter: f64| -> Result<(f64, Linearisation, usize), StabilityError> {
        let linear = family(parameter)?;
        linearisations += 1;
        match linear.unstable()? {
            Unstable::Finite(number) => Ok((parameter, linear, number)),
            Unstable::Infinite { abscissa } => Err(StabilityError::InfinitelyMany { abscissa }),
        }
    };
    let mut found: Vec<Onset> = Vec::new();
    let mut brackets = vec![(at(from)?, at(to)?)];
    while let Some((a, b)) = brackets.pop() {
        if a.2 == b.2 {
            continue;
        }
        let ends = [a.0, b.0];
        let (fewer, more) = if a.2 < b.2 { (&a, &b) } else { (&b, &a) };
        let known = found.len();
        let narrow = (ends[1] - ends[0]).abs() <= 1e-9 * (to - from).abs();
        // A pair in each of two planes at most, or it is not worth the search.
        if (more.2 - fewer.2 <= 4 || narrow)
            && let Some((z, part, number)) = next_to_axis(&more.1)?
            && (number == more.2 - fewer.2 || narrow)
        {
            // That root has crossed last. The secant of its real part from that end, if it stays between the ends.
            if let Some(crossing) = crossing(&mut at, more.0, z, part, ends)? {
                found.push(crossing);
            }
        }
        if found.len() == known && narrow {
            let residual = (more.2 - fewer.2) as f64;
            return Err(StabilityError::NoConvergence { what: "search for a root that crosses the axis", residual });
        }
        if found.len() == known {
            let middle = at(0.5 * (a.0 + b.0))?;
            brackets.push((middle.clone(), b));
            brackets.push((a, middle));
        }
    }
    found.sort_by(|a, b| a.parameter.total_cmp(&b.parameter));
    found.iter_mut().for_each(|crossing| crossing.linearisations = linearisations);
    Ok(found)
}

/// The unstable root next to the axis, and how many roots it stands for.
fn next_to_axis(linear: &Linearisation) -> Result<Option<(Complex<f64>, Part, usize)>, StabilityError> {
    let mut best: Option<(Complex<f64>, Part, usize)> = None;
    for (block, twins) in linear.distinct_blocks() {
        let part = Part::Block(block);
        if let Some(z) = linear.roots_right_of(part, linear.threshold())?.last()
            && best.is_none_or(|(other, ..)| z.re < other.re)
        {
            best = Some((*z, part, pair(z) * twins));
        }
    }
    Ok(best)
}

/// Newton's method for the parameter at which a root is on the axis; none if it leaves the ends.
fn crossing(
    at: &mut impl FnMut(f64) -> Result<(f64, Linearisation, usize), StabilityError>,
    start: f64,
    root: Complex<f64>,
    part: Part,
    ends: [f64; 2],
) -> Result<Option<Onset>, StabilityError> {
    let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    let (mut p, mut z) = (start, root);
    // A first small step into the bracket to learn the slope.
    let mut next = p + 1e-3 * (ends[0] + ends[1] - 2.0 * p);
    for _ in 0..20 {
        let (_, linear, _) = at(next)?;
        let Ok(moved) = linear.polish(z, part) else { return Ok(None) };
        if (moved - z).norm() > 0.3 * z.norm().max(0.1 * linear.slowest_rate()) {
            return Ok(None);
        }
        let slope = (moved - z) / (next - p);
        (p, z) = (next, moved);
        if z.re.abs() <= 1e-11 * z.norm().max(linear.slowest_rate()) {
            return Ok(Some(Onset {
                parameter: p,
                frequency: frequency(&linear, z),
                essential: false,
                residual: z.re.abs(),
                linearisations: 0,
            }));
        }
        next = p - z.re / slope.re;
        if !(next >= low && next <= high) || next == p {
            return Ok(None);
        }
    }
    Ok(None)
}

/// The angular frequency of a root on the axis; zero up to rounding is zero.
fn frequency(linear: &Linearisation, root: Complex<f64>) -> f64 {
    if root.im.abs() < 1e-9 * linear.slowest_rate() { 0.0 } else { root.im.abs() }
}

/// The rightmost root and the part of the spectrum that it belongs to.
pub(super) fn leading(linear: &Linearisation) -> Result<(Part, Complex<f64>), StabilityError> {
    let mut best: Option<(Part, Complex<f64>)> = None;
    for part in linear.parts() {
        if let Some(z) = linear.rightmost_of(part)?
            && best.is_none_or(|(_, other)| z.re > other.re + 1e-9 * z.norm())
        {
            best = Some((part, z));
        }
    }
    best.ok_or(StabilityError::NoIsolatedRoot)
}
