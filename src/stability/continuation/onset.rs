//! Values of a parameter at which roots cross the imaginary axis.

use nalgebra::Vector1;

use super::follow::Follower;
use super::mesh_error::{ROUNDING, check_finer};
use crate::error::ParameterError;
use crate::stability::error::StabilityError;
use crate::stability::spectrum::{Linearisation, Part, Unstable};

/// Largest |Re λ| of a root on the axis, relative to its modulus or to the slowest rate. Its rounding error is 1e-13; where
/// waves amplify this, the root jumps across the axis by up to a hundred times the value.
const ON_AXIS: f64 = 1e-11;
/// Distance from a crossing at which unstable roots are counted, relative to the range of the parameter. It is far above the
/// error of the crossing, and far below the distance of two crossings that differ.
pub(super) const BEYOND: f64 = 1e-5;

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
    /// |Re λ| at the crossing, 1/s.
    pub residual: f64,
    /// Number of elements of the growth zone.
    pub elements: usize,
    /// Estimate of the error of the parameter due to the mesh; see [`with_error`](Self::with_error) and
    /// [`Refinement`](super::Refinement).
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

    /// Estimate of the error of the period due to the mesh, s; none if the error was not estimated, or for a crossing at λ = 0.
    #[must_use]
    pub fn period_error(&self) -> Option<f64> {
        let oscillates = self.frequency > 0.0;
        self.frequency_error.filter(|_| oscillates).map(|error| self.period() * error / self.frequency)
    }

    /// The crossing with an estimate of the error due to its mesh: the distance from the crossing of `finer`, the same family on
    /// a finer mesh, which is evaluated once, at the parameter of this crossing. The relative error of the estimate is the ratio
    /// of the errors of the two meshes: 1/200 for elements of order eight and half the length that resolve the waves.
    ///
    /// ```
    /// # use morphorod::Shoot;
    /// # use morphorod::constitutive::LinearElastic;
    /// # use morphorod::growth::{Ongoing, UniformGrowth};
    /// # use morphorod::stability::{Linearisation, StabilityError, onset};
    /// # use morphorod::load::Weight;
    /// # use morphorod::tropism::{Gravitropism, Memory, Response, SettledStatoliths};
    /// # let memory = Memory { time: 720.0, delay: 720.0 };
    /// let family = |length: f64, elements: usize| -> Result<Linearisation, StabilityError> {
    ///     let shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
    ///         .length(length).radius(5e-4).elements(elements)
    ///         .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: 72e3 }))
    ///         .tropism(Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(memory))
    ///         .load(Weight { density: 1000.0 })
    ///         .build()?;
    ///     // An upright shoot is in a steady state as it is built.
    ///     Linearisation::about(&shoot)
    /// };
    /// let found = onset(|length| family(length, 2), 0.06, 0.075)?.with_error(|length| family(length, 4))?;
    /// let error = found.parameter_error.expect("asked for");
    /// assert!(error > 1e-9 * found.parameter && error < 1e-5 * found.parameter);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Errors of `finer`, a mesh that is not finer, or one without a root near this one.
    pub fn with_error(
        self,
        finer: impl FnOnce(f64) -> Result<Linearisation, StabilityError>,
    ) -> Result<Self, StabilityError> {
        let linear = finer(self.parameter)?;
        check_finer(self.elements, &linear)?;
        let mut there = self.crossing;
        there.change_mesh(there.root, &linear)?;
        let step = there.step_to_axis(&Vector1::new(1.0));
        let frequency = there.predict(&(there.at + step)).im.abs();
        Ok(Self {
            parameter_error: Some(step[0].abs().max(ROUNDING * self.parameter.abs())),
            frequency_error: Some((frequency - self.crossing.root.im.abs()).abs().max(ROUNDING * self.frequency)),
            ..self
        })
    }

    pub(super) fn of(crossing: &Follower<1>) -> Self {
        Self {
            parameter: crossing.at[0],
            frequency: crossing.frequency(),
            essential: matches!(crossing.part, Part::Essential(_)),
            residual: crossing.root.re.abs(),
            elements: crossing.elements,
            parameter_error: None,
            frequency_error: None,
            crossing: *crossing,
        }
    }
}

/// Finds the value of a parameter between `from` and `to` at which the rightmost root, isolated or essential, crosses the
/// axis. `family` returns the linearisation about the steady state at a value of the parameter.
///
/// The numbers of unstable roots at the ends must differ, one of them being zero.
///
/// # Errors
/// Errors of `family`, a range without a crossing, or a root that is lost.
pub fn onset(
    mut family: impl FnMut(f64) -> Result<Linearisation, StabilityError>,
    from: f64,
    to: f64,
) -> Result<Onset, StabilityError> {
    check_range(from, to)?;
    let (first, last) = (family(from)?, family(to)?);
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
    // The leading root at the unstable end is followed to the axis. If that fails, the range is bisected by counts.
    let mut leading = Follower::new(&linear, Vector1::new(unstable), linear.leading()?);
    for _ in 0..60 {
        let crossing = follow_to_axis(&mut family, leading, stable)?;
        let next = match &crossing {
            // It must be the last root to cross: none is unstable just beyond.
            Some(crossing) => {
                let beyond = crossing.at[0] + (stable_end - crossing.at[0]).signum() * BEYOND * (to - from).abs();
                beyond.clamp(from.min(to), from.max(to))
            }
            None => 0.5 * (stable + leading.at[0]),
        };
        let linear = family(next)?;
        match (number(linear.unstable()?), crossing) {
            (0, Some(crossing)) => return Ok(Onset::of(&crossing)),
            (0, None) => stable = next,
            (_, crossing) => {
                stable = if crossing.is_some() { stable_end } else { stable };
                leading = Follower::new(&linear, Vector1::new(next), linear.leading()?);
            }
        }
    }
    Err(StabilityError::NoConvergence { what: "onset", residual: leading.root.re })
}

/// Finds every value of a parameter between `from` and `to` at which the number of unstable roots changes. Roots that cross
/// the axis twice between two counts are not found.
///
/// # Errors
/// Errors of `family`, infinitely many unstable roots somewhere in the range, or a root that is lost.
pub fn crossings(
    mut family: impl FnMut(f64) -> Result<Linearisation, StabilityError>,
    from: f64,
    to: f64,
) -> Result<Vec<Onset>, StabilityError> {
    check_range(from, to)?;
    let mut at = |parameter: f64| {
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
        // The root that has crossed last is sought if at most two pairs have crossed; else the range is bisected first.
        let last = if change <= 4 || narrow { more.1.next_to_axis()? } else { None };
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
    Ok(found.iter().map(Onset::of).collect())
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

/// Follows an unstable root to the axis by the secant method for its real part, between its parameter and `end`; none if the
/// root is lost or does not reach the axis.
fn follow_to_axis(
    family: &mut impl FnMut(f64) -> Result<Linearisation, StabilityError>,
    mut root: Follower<1>,
    end: f64,
) -> Result<Option<Follower<1>>, StabilityError> {
    let (mut unstable, mut stable) = (root.at[0], end);
    // A small first step determines the slope.
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
    Ok(root.is_on_axis(100.0 * ON_AXIS).then_some(root))
}
