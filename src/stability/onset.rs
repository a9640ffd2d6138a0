//! Where the rightmost root crosses the axis as a parameter changes.

use nalgebra::Complex;

use super::count::{Part, Unstable};
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
        let tracked = candidate.polish(guess, part).ok().filter(|z| (z - guess).norm() < 0.2 * guess.norm());
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
    // The root that was followed must be the last to cross: nothing is unstable just beyond.
    let beyond = current.0 + (stable - current.0).signum() * 1e-5 * (to - from).abs();
    if number(family(beyond.clamp(from.min(to), from.max(to)))?.unstable()?) != 0 {
        let rest = onset(family, beyond, if a == Unstable::Finite(0) { from } else { to })?;
        return Ok(Onset { linearisations: rest.linearisations + linearisations + 1, ..rest });
    }
    let frequency = if root.im.abs() < 1e-9 * linear.slowest_rate() { 0.0 } else { root.im.abs() };
    Ok(Onset {
        parameter: current.0,
        frequency,
        essential: matches!(part, Part::Essential(_)),
        residual: root.re.abs(),
        linearisations: linearisations + 1,
    })
}

/// The rightmost root and the part of the spectrum that it belongs to.
pub(super) fn leading(linear: &Linearisation) -> Result<(Part, Complex<f64>), StabilityError> {
    let mut best: Option<(Part, Complex<f64>)> = None;
    let essential = (0..linear.local_blocks.len()).map(Part::Essential);
    let blocks = linear.distinct_blocks().into_iter().map(|(block, _)| Part::Block(block));
    for part in essential.chain(blocks) {
        if let Some(z) = linear.rightmost_of(part)?
            && best.is_none_or(|(_, other)| z.re > other.re + 1e-9 * z.norm())
        {
            best = Some((part, z));
        }
    }
    best.ok_or(StabilityError::NoConvergence { what: "leading root", residual: f64::NAN })
}
