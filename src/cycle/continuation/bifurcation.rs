//! Bifurcations: their kinds, and their location between two points of a branch.
//!
//! The test functions are the real parts of the exponents, sorted by size, and at a fold the
//! parameter, which has an extremum there. A fold is sought only if the number of real positive
//! exponents changes.

use std::f64::consts::PI;

use nalgebra::Complex;

use super::{BranchPoint, BranchState, Continuation, OnBranch, OrbitSolver, observe};
use crate::cycle::disturbances::Disturbances;
use crate::cycle::error::{CycleError, Outcome};
use crate::model::Model;
use crate::numerics::scalar::{bracketed_root, maximum, sort_by_value};
use crate::shoot::Shoot;

/// Accuracy of a bifurcation: modulus of the real part of its exponent times the period, relative
/// difference between the exponents of a conjugate pair, and width of the bracket in units of the
/// step. It is above the error of differences in the trivial exponents.
const ZERO: f64 = 1e-7;
/// Distance from the ends of a step, in units of the step, at which the slope of the parameter is
/// evaluated, and from a fold, at which the critical exponent is distinguished from the trivial
/// ones.
const ASIDE: f64 = 1e-2;
/// Largest imaginary part of an exponent times the period, or distance of this product from ±π,
/// that counts as zero. Two nearly equal exponents are accurate to the square root of the error of
/// the linearisation, 1e-6.
const NEAR: f64 = 1e-3;

/// A bifurcation on a branch of orbits: an exponent crosses the imaginary axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Bifurcation {
    /// The parameter has an extremum, beyond which this branch has no orbit.
    Fold,
    /// A real exponent crosses zero and the parameter has no extremum: a branch with less symmetry
    /// begins, for example one of ellipses at a planar swing.
    Pitchfork,
    /// A multiplier crosses −1: a branch of orbits with twice the period begins.
    PeriodDoubling,
    /// A pair of exponents crosses the imaginary axis: quasiperiodic motion on a torus begins.
    Torus,
}

impl<S: OrbitSolver, M: Model, F: FnMut(f64) -> Result<Shoot<M>, CycleError>> Continuation<S, F> {
    /// Locates the bifurcations between the last point and the next one, and appends them to the
    /// queue.
    pub(super) fn bifurcations_between(&mut self, to: &BranchState) -> Outcome {
        // A planar orbit has two lists. Its neighbours may have one list.
        let apart = [&self.last, to]
            .iter()
            .all(|place| !place.exponents.lists()[1].is_empty());
        let sets = |place: &BranchState| lists(&place.exponents, apart);
        let counts = |place: &BranchState| sets(place).map(|set| growing(&set));
        if counts(&self.last) == counts(to) {
            return Ok(());
        }
        let (first, last) = ((0.0, sets(&self.last)), (1.0, sets(to)));
        let mut parts = vec![[first.clone(), last.clone()]];
        let mut found = Vec::new();
        // At a fold a real exponent changes its sign. Without such a change no fold is sought.
        let real = |place: &BranchState| {
            place.exponents.lists()[0]
                .iter()
                .filter(|x| x.im == 0.0 && x.re > 0.0)
                .count()
        };
        let passes = real(&self.last) != real(to);
        if let Some(fold) = if passes { self.fold(to)? } else { None } {
            parts.clear();
            for (end, aside) in [(first, fold - ASIDE), (last, fold + ASIDE)] {
                if (0.0..=1.0).contains(&aside) {
                    let other = (
                        aside,
                        lists(&self.observe_between(to, aside)?.exponents, apart),
                    );
                    parts.push(if aside < fold {
                        [end, other]
                    } else {
                        [other, end]
                    });
                }
            }
            let mut point = self.observe_between(to, fold)?;
            point.bifurcation = Some(Bifurcation::Fold);
            found.push((fold, point));
        }
        for ends in &parts {
            for set in 0..2 {
                let [low, high] = ends.each_ref().map(|end| growing(&end.1[set]));
                let mut next = low.min(high);
                // The real parts with these indices change their signs; those of a conjugate pair
                // coincide.
                while next < low.max(high) {
                    let [a, b] = ends
                        .each_ref()
                        .map(|end| end.1[set].get(next).map(|x| (end.0, x.re)));
                    let (Some(a), Some(b)) = (a, b) else { break };
                    let (share, point) = self.locate(to, (set, next, apart), [a, b])?;
                    let pair = |x: &Complex<f64>, y: &Complex<f64>| {
                        (y - x.conj()).norm() <= ZERO * x.norm()
                    };
                    next += match lists(&point.exponents, apart)[set].get(next..next + 2) {
                        Some([x, y]) if x.im != 0.0 && pair(x, y) => 2,
                        _ => 1,
                    };
                    found.push((share, point));
                }
            }
        }
        sort_by_value(&mut found, |(share, _)| *share);
        self.waiting
            .extend(found.into_iter().map(|(_, point)| point));
        Ok(())
    }

    /// The orbit at a share of the secant from the last point to the next one.
    fn between(&mut self, to: &BranchState, share: f64) -> Outcome<OnBranch<S, M>> {
        let from = self.last.unknowns.clone().with_past_of(&to.unknowns);
        let secant = from.to(&to.unknowns);
        let guess = from.along(&secant, share);
        let conditions = self.inner.arclength(&secant, &guess);
        self.correct(guess, conditions)
    }

    /// The point of the branch at a share of the secant.
    fn observe_between(&mut self, to: &BranchState, share: f64) -> Outcome<BranchPoint<S::Orbit>> {
        let found = self.between(to, share)?;
        Ok(observe(&self.solver, found)?.0)
    }

    /// The share of the secant at which the parameter has an extremum, if any.
    fn fold(&mut self, to: &BranchState) -> Outcome<Option<f64>> {
        let mut parameter =
            |share: f64| Ok::<_, CycleError>(self.between(to, share)?.unknowns.parameter);
        // One-sided differences of second order, from slightly beyond the ends: the exponents
        // decide to which step a fold at an end belongs.
        let mut slope = |at: f64, step: f64| {
            let [a, b, c] = [
                parameter(at)?,
                parameter(at + step)?,
                parameter(at + 2.0 * step)?,
            ];
            Ok::<_, CycleError>((4.0 * b - 3.0 * a - c) / step)
        };
        let (first, last) = (slope(-ASIDE, ASIDE)?, slope(1.0 + ASIDE, -ASIDE)?);
        if first * last > 0.0 {
            return Ok(None);
        }
        // The zero of a linear slope is the initial guess.
        let guess = (first / (first - last)).clamp(0.0, 1.0);
        let found = maximum(guess, 10.0 * ASIDE, ASIDE * ASIDE, |share| {
            Ok(first.signum() * parameter(share)?)
        });
        found.map(Some)
    }

    /// The share of the secant, between two shares with known values, at which the real part of an
    /// exponent vanishes, and the point there. The exponent is given by its list and its index.
    fn locate(
        &mut self,
        to: &BranchState,
        (set, index, apart): (usize, usize, bool),
        ends: [(f64, f64); 2],
    ) -> Outcome<(f64, BranchPoint<S::Orbit>)> {
        let what = "a bifurcation is not located";
        let lost = |parameter: f64| CycleError::Lost {
            what,
            parameter,
            step: ends[1].0 - ends[0].0,
        };
        let mut found = None;
        bracketed_root(ends, ZERO, |share| {
            let mut point = self.observe_between(to, share)?;
            let exponent = lists(&point.exponents, apart)[set].get(index).copied();
            let exponent = exponent.ok_or(lost(point.parameter))?;
            point.bifurcation = Some(kind(exponent * point.period, S::FLOQUET));
            let zero = exponent.re.abs() * point.period < ZERO;
            found = Some((share, point));
            Ok::<_, CycleError>(if zero { 0.0 } else { exponent.re })
        })?;
        found.ok_or(lost(to.unknowns.parameter))
    }
}

/// Number of exponents with positive real part.
pub(super) fn growing<'a>(exponents: impl IntoIterator<Item = &'a Complex<f64>>) -> usize {
    exponents
        .into_iter()
        .filter(|exponent| exponent.re > 0.0)
        .count()
}

/// The exponents in the plane and out of it, or all in one list unless `divided`, largest real part
/// first.
fn lists(exponents: &Disturbances<Complex<f64>>, divided: bool) -> [Vec<Complex<f64>>; 2] {
    if divided {
        return exponents.lists().map(<[_]>::to_vec);
    }
    let mut all: Vec<_> = exponents.iter().copied().collect();
    sort_by_value(&mut all, |exponent| -exponent.re);
    [all, Vec::new()]
}

/// The kind of a bifurcation with a critical exponent times the period, which is the logarithm of a
/// multiplier if `floquet`.
fn kind(exponent: Complex<f64>, floquet: bool) -> Bifurcation {
    let angle = exponent.im.abs();
    if angle < NEAR {
        Bifurcation::Pitchfork
    } else if floquet && (angle - PI).abs() < NEAR {
        Bifurcation::PeriodDoubling
    } else {
        Bifurcation::Torus
    }
}
