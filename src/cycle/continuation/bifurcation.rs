//! Bifurcations of a branch: their location and their kind.

use nalgebra::Complex;

use super::exponents::{Bifurcation, growing, kind, lists};
use super::{BranchPoint, BranchState, Continuation, OrbitSolver, observe};
use crate::cycle::corrector::Corrected;
use crate::cycle::error::CycleError;
use crate::model::Model;
use crate::shoot::Shoot;

/// Largest number of evaluations of the search for a bifurcation.
const TRIALS: usize = 40;
/// Modulus of the real part of a vanishing exponent times the period, and width of its bracket in units of the step, at which a
/// bifurcation is located. Smaller exponents are rounding beside the trivial ones.
const ZERO: f64 = 1e-7;

/// Largest relative difference between the exponents of a conjugate pair.
const PAIR: f64 = 1e-9;
/// Distance from the ends of a step at which the slope of the parameter is evaluated, and from a fold at which the exponent that vanishes
/// there is distinguished from the trivial ones, in units of the step.
const ASIDE: f64 = 1e-2;
/// Half-width of the first parabola of the search for a fold.
const WIDTH: f64 = 0.1;
/// Factor between the widths of successive parabolas.
const NARROW: f64 = 0.2;

impl<S: OrbitSolver, F, M: Model> Continuation<S, F>
where
    F: FnMut(f64) -> Result<Shoot<M>, CycleError>,
{
    /// Locates the bifurcations between the last point and another, and appends them to the queue.
    pub(super) fn bifurcations_between(&mut self, to: &BranchState) -> Result<(), CycleError> {
        // A planar orbit has two lists, its neighbours may have one.
        let apart = [&self.last, to].iter().all(|place| !place.exponents.lists()[1].is_empty());
        let sets = |place: &BranchState| lists(&place.exponents, apart);
        let counts = |place: &BranchState| sets(place).map(|set| growing(&set));
        if counts(&self.last) == counts(to) {
            return Ok(());
        }
        let (first, last) = ((0.0, sets(&self.last)), (1.0, sets(to)));
        let mut parts = vec![[first.clone(), last.clone()]];
        let mut found = Vec::new();
        // At a fold a real exponent passes zero.
        let real =
            |place: &BranchState| place.exponents.lists()[0].iter().filter(|x| x.im == 0.0 && x.re > 0.0).count();
        let passes = real(&self.last) != real(to);
        if let Some(fold) = if passes { self.fold(to)? } else { None } {
            parts.clear();
            for (end, aside) in [(first, fold - ASIDE), (last, fold + ASIDE)] {
                if (0.0..=1.0).contains(&aside) {
                    let other = (aside, lists(&self.observe_between(to, aside)?.exponents, apart));
                    parts.push(if aside < fold { [end, other] } else { [other, end] });
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
                // Sorted by their real parts, each of these passes zero; of a pair both at once.
                while next < low.max(high) {
                    let [a, b] = ends.each_ref().map(|end| end.1[set].get(next).map(|x| (end.0, x.re)));
                    let (Some(a), Some(b)) = (a, b) else { break };
                    let (share, point) = self.locate(to, (set, next, apart), [a, b])?;
                    let pair = |x: &Complex<f64>, y: &Complex<f64>| (y - x.conj()).norm() <= PAIR * x.norm();
                    next += match lists(&point.exponents, apart)[set].get(next..next + 2) {
                        Some([x, y]) if x.im != 0.0 && pair(x, y) => 2,
                        _ => 1,
                    };
                    found.push((share, point));
                }
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.waiting.extend(found.into_iter().map(|(_, point)| point));
        Ok(())
    }

    /// The orbit at a share of the secant from the last point to another.
    fn between(&mut self, to: &BranchState, share: f64) -> Result<Corrected<S::Orbit, Shoot<M>>, CycleError> {
        let from = self.last.unknowns.clone().with_past_of(&to.unknowns);
        let secant = from.to(&to.unknowns);
        let guess = from.along(&secant, share);
        let conditions = self.inner.arclength(&secant, &guess);
        self.correct(guess, conditions)
    }

    fn observe_between(&mut self, to: &BranchState, share: f64) -> Result<BranchPoint<S::Orbit>, CycleError> {
        let found = self.between(to, share)?;
        Ok(observe(&self.solver, found)?.0)
    }

    /// The extremum of the parameter between the last point and another, as a share of the secant.
    fn fold(&mut self, to: &BranchState) -> Result<Option<f64>, CycleError> {
        let mut parameter = |share: f64| Ok::<_, CycleError>(self.between(to, share)?.unknowns.parameter);
        // A little beyond the ends: where the fold is next to one, the exponents say to which step it belongs. Slopes by three points err by
        // the square of the distance.
        let mut slope = |at: f64, step: f64| {
            let [a, b, c] = [parameter(at)?, parameter(at + step)?, parameter(at + 2.0 * step)?];
            Ok::<_, CycleError>((4.0 * b - 3.0 * a - c) / step)
        };
        let (begins, ends) = (slope(-ASIDE, ASIDE)?, slope(1.0 + ASIDE, -ASIDE)?);
        if begins * ends > 0.0 {
            return Ok(None);
        }
        // Where the slope would vanish if it were linear; then by parabolas, whose vertex errs by the cube of their width.
        let mut share = (begins / (begins - ends)).clamp(0.0, 1.0);
        let mut width = WIDTH;
        while width > ASIDE * ASIDE {
            let [a, b, c] = [parameter(share - width)?, parameter(share)?, parameter(share + width)?];
            let shift = 0.5 * (a - c) / (a - 2.0 * b + c);
            if !shift.is_finite() {
                break;
            }
            share += shift.clamp(-2.0, 2.0) * width;
            width *= NARROW;
        }
        Ok(Some(share))
    }

    /// The zero of the real part of an exponent, given by its list and its index, between two shares of the secant: regula falsi with the
    /// modification of Illinois.
    fn locate(
        &mut self,
        to: &BranchState,
        (set, index, apart): (usize, usize, bool),
        [mut low, mut high]: [(f64, f64); 2],
    ) -> Result<(f64, BranchPoint<S::Orbit>), CycleError> {
        let mut parameter = to.unknowns.parameter;
        for _ in 0..TRIALS {
            let share = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let mut point = self.observe_between(to, share)?;
            parameter = point.parameter;
            let Some(exponent) = lists(&point.exponents, apart)[set].get(index).copied() else { break };
            if exponent.re.abs() * point.period < ZERO || high.0 - low.0 < ZERO {
                point.bifurcation = Some(kind(exponent * point.period, S::FLOQUET));
                return Ok((share, point));
            }
            // The value at the end that is kept is halved.
            if (exponent.re > 0.0) == (high.1 > 0.0) {
                high = (share, exponent.re);
                low.1 *= 0.5;
            } else {
                low = (share, exponent.re);
                high.1 *= 0.5;
            }
        }
        Err(CycleError::BifurcationNotLocated { parameter, width: high.0 - low.0 })
    }
}
