//! Pseudo-arclength continuation of orbits along a parameter, with the location of bifurcations.
//!
//! The predictor is the secant of the last two points. The corrector solves for orbit and parameter
//! with the condition that the projection on the secant is that of the predictor (H. B. Keller
//! 1977), so that folds are passed. The step is halved if the corrector fails or the direction
//! changes by more than 26°.

mod bifurcation;
mod inner_product;

pub use bifurcation::Bifurcation;

use std::collections::VecDeque;
use std::ops::RangeInclusive;

use nalgebra::{Complex, DVector};

use super::corrector::{Corrected, correct, correct_resolved};
use super::disturbances::Disturbances;
use super::equations::{Equations, Observation};
use super::error::{CycleError, Outcome};
use super::extended::{ExtraConditions, OrbitUnknowns};
use crate::error::{ParameterError, ensure};
use crate::model::Model;
use crate::numerics::scalar::sort_by_value;
use crate::shoot::Shoot;
use crate::stability::{Crossing, Linearisation};
use bifurcation::growing;
use inner_product::InnerProduct;

/// Cosine of the largest angle between successive secants, 26°. With a larger angle the step is
/// halved.
const TURN: f64 = 0.9;
/// Cosine of the angle below which the next step is longer, 11°.
const EASY: f64 = 0.98;
/// Factor by which an easy step is lengthened; 1.5² = 2.25 offsets one halving.
const LONGER: f64 = 1.5;
/// Smallest step, relative to the smaller of the first and the largest step: twelve halvings.
const SHORTEST: f64 = 2.5e-4;
/// Largest share of the first secant along the symmetries, which lead to other states of the same
/// orbit.
const ROUND: f64 = 0.02;
/// Smallest excursion, in lengths of the shoot. Near an onset exponents vanish with its square, and
/// are not distinguished from the trivial ones.
const LEAST: f64 = 0.01;

/// A solver of orbits that can be continued along a parameter: a
/// [`RotatingWaveSolver`](super::RotatingWaveSolver) or a
/// [`PeriodicSolver`](super::PeriodicSolver). It cannot be implemented for other types.
pub trait OrbitSolver: Equations {}

impl OrbitSolver for super::RotatingWaveSolver {}
impl OrbitSolver for super::PeriodicSolver {}

/// A point of a branch of orbits.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct BranchPoint<O> {
    /// Value of the parameter.
    pub parameter: f64,
    /// The orbit.
    pub orbit: O,
    /// Largest distance of the tip from the axis, the tangent of the base, during a period, m. For
    /// a rotating wave it is the radius.
    pub excursion: f64,
    /// Period, s. A relative periodic orbit returns rotated after it.
    pub period: f64,
    /// Leading exponents λ of disturbances exp(λt), 1/s, largest real part first, without the
    /// trivial ones: at least two, and all with positive real part. Those of a rotating wave are in
    /// the corotating frame. Both of a conjugate pair are listed.
    pub exponents: Disturbances<Complex<f64>>,
    /// Largest modulus of the trivial exponents times the period. It is the error due to the grid
    /// and to differences, and zero for exact orbits.
    pub trivial: f64,
    /// The bifurcation at this point, if there is one.
    pub bifurcation: Option<Bifurcation>,
}

impl<O> BranchPoint<O> {
    /// Number of exponents with positive real part. At a bifurcation rounding decides whether the
    /// critical ones are counted.
    #[must_use]
    pub fn unstable(&self) -> usize {
        growing(self.exponents.iter())
    }
}

/// A corrected orbit with its shoot.
type OnBranch<S, M> = Corrected<<S as Equations>::Orbit, Shoot<M>>;

/// The last point of a branch: its unknowns, symmetry tangents and exponents.
#[derive(Debug, Clone)]
struct BranchState {
    unknowns: OrbitUnknowns,
    symmetry_tangents: Vec<DVector<f64>>,
    exponents: Disturbances<Complex<f64>>,
}

/// Pseudo-arclength continuation of orbits: an iterator over the points of a branch. It ends at an
/// end of the parameter's range, where the excursion falls below a hundredth of the length near an
/// onset, and where relative periodic orbits become a rotating wave. Beyond it the branch repeats
/// its orbits, rotated by π/2. Bifurcations between two points are located and returned as points.
/// A fold is sought only between points whose numbers of real positive exponents differ. An error
/// ends the branch.
///
/// `family` returns the shoot for a value of the parameter. All its shoots have the same number of
/// material points. Derivatives by the parameter are differences over 1e-5 of the range. Parameters
/// slightly outside the range may be evaluated if the branch ends there.
#[derive(Debug, Clone)]
pub struct Continuation<S: OrbitSolver, F> {
    solver: S,
    family: F,
    largest_step: f64,
    inner: InnerProduct,
    first_step: f64,
    /// Length of the next step.
    step: f64,
    last: BranchState,
    /// Direction of the next step, of unit norm.
    tangent: OrbitUnknowns,
    /// Whether that direction is a guess and not a secant.
    rough: bool,
    /// Points that have been computed and not yet returned.
    waiting: VecDeque<BranchPoint<S::Orbit>>,
    ended: bool,
}

impl<S: OrbitSolver, M: Model, F: FnMut(f64) -> Result<Shoot<M>, CycleError>> Continuation<S, F> {
    /// The branch that begins at an onset of oscillations (a Hopf bifurcation) in the range, found
    /// by [`onset`](crate::stability::onset()) or [`crossings`](crate::stability::crossings()). The
    /// first point has about the given `amplitude` of the tip (m), at least a hundredth of the
    /// length; its parameter is computed.
    ///
    /// The mode is that of the root which crosses the axis with the frequency of the onset. It need
    /// not be the rightmost root: without proprioception infinitely many roots accumulate at zero.
    ///
    /// # Errors
    /// A range or an amplitude out of range, an onset without oscillations or one of the essential
    /// spectrum, a shoot without a root at this frequency, errors of the corrector at the first
    /// point (no orbit near the guess, or one that no grid in time resolves), or a first parameter
    /// outside the range.
    pub fn from_onset(
        mut solver: S,
        mut family: F,
        onset: &Crossing<1>,
        amplitude: f64,
        within: RangeInclusive<f64>,
    ) -> Result<Self, CycleError> {
        let [parameter] = onset.parameters;
        check_range(&within, ("onset", parameter))?;
        ParameterError::positive("frequency of the onset", onset.frequency, "rad/s")?;
        let shoot = family(parameter)?;
        let share = amplitude / shoot.rod().length();
        let what = "amplitude of the first orbit, in lengths of the shoot";
        ParameterError::unless((LEAST..1.0).contains(&share), what, share, "from 0.01 to 1")?;
        let root = onset.mode(&Linearisation::about(&shoot)?)?;
        let of_amplitude = |solver: &S, amplitude: f64| {
            Ok::<_, CycleError>(OrbitUnknowns {
                parameter,
                ..solver.of_mode(&shoot, &root, amplitude)?
            })
        };
        let guess = of_amplitude(&solver, amplitude)?;
        let inner = InnerProduct::new(&guess, shoot.rod().length(), &within);
        let conditions = inner.arclength(&of_amplitude(&solver, 0.0)?.to(&guess), &guess);
        let found = correct_resolved(&mut solver, &mut family, guess, &conditions)?;
        let (what, parameter) = ("parameter of the first orbit", found.unknowns.parameter);
        ParameterError::unless(
            within.contains(&parameter),
            what,
            parameter,
            "within the given range: extend it",
        )?;
        let secant = of_amplitude(&solver, 0.0)?
            .with_past_of(&found.unknowns)
            .to(&found.unknowns);
        Self::begin(solver, family, inner, secant, found)
    }

    /// The branch that begins at a known orbit, at a value of the parameter. `step` is the first
    /// change of the parameter, in its unit; negative for decreasing parameters.
    ///
    /// # Errors
    /// A range or a step out of range, an orbit of another shoot, or errors of the corrector at the
    /// first point.
    pub fn from_orbit(
        mut solver: S,
        mut family: F,
        orbit: &S::Orbit,
        parameter: f64,
        step: f64,
        within: RangeInclusive<f64>,
    ) -> Result<Self, CycleError> {
        check_range(&within, ("parameter of the initial guess", parameter))?;
        let (name, ok) = (
            "first step of the parameter",
            step != 0.0 && step.abs() <= within.end() - within.start(),
        );
        ParameterError::unless(
            ok,
            name,
            step,
            "positive or negative, and at most the length of the range",
        )?;
        let shoot = family(parameter)?;
        let guess = OrbitUnknowns {
            parameter,
            ..solver.of_orbit(&shoot, orbit)?
        };
        let inner = InnerProduct::new(&guess, shoot.rod().length(), &within);
        let found = correct_resolved(&mut solver, &mut family, guess, &inner.at_fixed_parameter())?;
        let tangent = OrbitUnknowns {
            parameter: step,
            ..found.unknowns.to(&found.unknowns)
        };
        Self::begin(solver, family, inner, tangent, found)
    }

    /// The branch with a first point and a guess of its direction.
    fn begin(
        solver: S,
        family: F,
        inner: InnerProduct,
        tangent: OrbitUnknowns,
        found: OnBranch<S, M>,
    ) -> Outcome<Self> {
        let (point, last) = observe(&solver, found)?;
        let (step, tangent) = (
            inner.norm(&tangent),
            inner.unit(&tangent, &last.symmetry_tangents),
        );
        Ok(Self {
            solver,
            family,
            largest_step: 0.05,
            inner,
            first_step: step,
            step,
            last,
            tangent,
            rough: true,
            waiting: VecDeque::from([point]),
            ended: false,
        })
    }

    /// Sets the largest step, 0.05 by default: the root of the sum of squares of the root mean
    /// square of strain times length (rad) and of the parameter over its range.
    ///
    /// # Errors
    /// A step that is not positive.
    pub fn largest_step(mut self, step: f64) -> Result<Self, CycleError> {
        ParameterError::positive("longest step along a branch", step, "")?;
        self.largest_step = step;
        Ok(self)
    }

    /// Takes a step, which is halved until it succeeds. Returns false at the end of the branch.
    fn advance(&mut self) -> Outcome<bool> {
        loop {
            let error = match self.try_step() {
                // The branch returns to the stationary state, or to a rotating wave.
                Err(CycleError::Stationary { .. } | CycleError::RotatingWave) => return Ok(false),
                Err(CycleError::Unresolved { .. }) if self.refine() => continue,
                Err(error) => error,
                going_on => return going_on,
            };
            self.step = 0.5 * self.step.min(self.largest_step);
            ensure(
                self.step >= SHORTEST * self.first_step.min(self.largest_step),
                error,
            )?;
        }
    }

    /// Refines the grid in time. Returns false if there is no finer grid.
    fn refine(&mut self) -> bool {
        let states = [self.last.unknowns.clone(), self.tangent.clone()];
        let Some(finer) = self.solver.refine(states) else {
            return false;
        };
        [self.last.unknowns, self.tangent] = finer;
        true
    }

    /// Takes a step. If it fails the branch is unchanged. Returns false at the end of the branch.
    fn try_step(&mut self) -> Outcome<bool> {
        let step = self.step.min(self.largest_step);
        let from = self.last.unknowns.clone();
        let guess = from.along(&self.tangent, step);
        let mut bound = self.bound_before(guess.parameter);
        let mut found = match bound {
            Some(bound) => self.at_bound(&from, &self.tangent.clone(), bound)?,
            None => self.correct(guess.clone(), self.inner.arclength(&self.tangent, &guess))?,
        };
        if let Some(passed) = self.bound_before(found.unknowns.parameter) {
            let from = from.clone().with_past_of(&found.unknowns);
            found = self.at_bound(&from, &from.to(&found.unknowns), passed)?;
            bound = Some(passed);
        }
        // The branch repeats its orbits, half a period later, beyond the stationary state and
        // beyond a rotating wave.
        let passes_wave = || {
            self.inner
                .wave_between(&self.last.symmetry_tangents, &found.symmetry_tangents)
        };
        let turned = self
            .inner
            .of_states(&from.start.present(), &found.unknowns.start.present())
            < 0.0;
        if turned || !self.rough && passes_wave() {
            return Ok(false);
        }
        let secant = from.with_past_of(&found.unknowns).to(&found.unknowns);
        let size = self.inner.norm(&secant);
        if bound.is_some() && !(size > f64::EPSILON) {
            // The branch began at the bound.
            return Ok(false);
        }
        let turn = self.inner.product(&secant, &self.tangent) / size;
        // If the tangent is a guess, only its sign is compared. The secant must not lead along the
        // symmetries.
        let round = size
            - self
                .inner
                .norm(&self.inner.without(&secant, &self.last.symmetry_tangents));
        let ahead = if self.rough {
            turn > 0.0 && round < ROUND * size
        } else {
            turn > TURN
        };
        let what = "the direction of the branch changes by more than 26°";
        ensure(
            ahead,
            CycleError::Lost {
                what,
                parameter: self.last.unknowns.parameter,
                step,
            },
        )?;
        let (point, place) = observe(&self.solver, found)?;
        if point.excursion < LEAST * self.inner.length {
            return Ok(false);
        }
        self.bifurcations_between(&place)?;
        self.tangent = self.inner.unit(&secant, &place.symmetry_tangents);
        self.step = size * if turn > EASY { LONGER } else { 1.0 };
        self.rough = false;
        self.last = place;
        self.waiting.push_back(point);
        Ok(bound.is_none())
    }

    /// The orbit at an end of the range. The initial guess is on a secant.
    fn at_bound(
        &mut self,
        from: &OrbitUnknowns,
        secant: &OrbitUnknowns,
        bound: f64,
    ) -> Outcome<OnBranch<S, M>> {
        let mut guess = from.along(secant, (bound - from.parameter) / secant.parameter);
        guess.parameter = bound;
        self.correct(guess, self.inner.at_fixed_parameter())
    }

    /// The orbit near a guess. It has the phases of the last point, unless the direction is a
    /// guess.
    fn correct(
        &mut self,
        guess: OrbitUnknowns,
        mut conditions: ExtraConditions,
    ) -> Outcome<OnBranch<S, M>> {
        if !self.rough {
            let BranchState {
                unknowns,
                symmetry_tangents,
                ..
            } = &self.last;
            conditions = conditions.with_phases_of(unknowns, symmetry_tangents);
        }
        let found = correct(&self.solver, &mut self.family, guess, &conditions, &mut 0)?;
        self.solver.check_resolution(&found.orbit)?;
        Ok(found)
    }

    /// The end of the range that a parameter has passed; none if it is within the range.
    fn bound_before(&self, parameter: f64) -> Option<f64> {
        let bound = parameter.clamp(self.inner.range[0], self.inner.range[1]);
        ((parameter - bound).abs() > 0.0).then_some(bound)
    }
}

impl<S: OrbitSolver, M: Model, F: FnMut(f64) -> Result<Shoot<M>, CycleError>> Iterator
    for Continuation<S, F>
{
    type Item = Result<BranchPoint<S::Orbit>, CycleError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.waiting.is_empty() && !self.ended {
            let going_on = self.advance();
            self.ended = !matches!(going_on, Ok(true));
            if let Err(error) = going_on {
                return Some(Err(error));
            }
        }
        self.waiting.pop_front().map(Ok)
    }
}

/// The point of a branch at an orbit, with its exponents.
fn observe<S: OrbitSolver, M: Model>(
    solver: &S,
    found: OnBranch<S, M>,
) -> Outcome<(BranchPoint<S::Orbit>, BranchState)> {
    let Corrected {
        orbit,
        unknowns,
        symmetry_tangents,
        shoot,
    } = found;
    let Observation {
        excursion,
        period,
        exponents,
        trivial,
    } = solver.observe(&orbit, &shoot)?;
    let exponents = exponents.map(|mut list| {
        sort_by_value(&mut list, |exponent| -exponent.re);
        list
    });
    let place = BranchState {
        unknowns,
        symmetry_tangents,
        exponents: exponents.clone(),
    };
    let (parameter, trivial) = (place.unknowns.parameter, trivial * period);
    Ok((
        BranchPoint {
            parameter,
            orbit,
            excursion,
            period,
            exponents,
            trivial,
            bifurcation: None,
        },
        place,
    ))
}

/// Returns an error for a range that is empty or that does not contain a value.
fn check_range(
    within: &RangeInclusive<f64>,
    (name, start): (&'static str, f64),
) -> Result<(), ParameterError> {
    let (what, range) = ("range of the parameter", within.end() - within.start());
    ParameterError::unless(range > 0.0 && range.is_finite(), what, range, "positive")?;
    ParameterError::unless(
        within.contains(&start),
        name,
        start,
        "within the given range: extend it",
    )
}
