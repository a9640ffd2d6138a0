//! The iteration of Newton's method on the energy of the frames, globalised: diagonal shift, bound on the step, line search.

use nalgebra::Vector3;

use super::system::System;
use super::unloaded::take_intrinsic_shape;
use super::{Equilibrium, EquilibriumError, Inertia};
use crate::constitutive::Constitutive;
use crate::load::InternalForce;
use crate::rod::Rod;

/// No step turns a frame further than this, rad: beyond it the quadratic model says nothing.
const LARGEST_TURN: f64 = 1.0;
/// Steps shorter than this are taken without a line search, rad: the energy no longer tells them apart from rounding.
const SMALL_TURN: f64 = 1e-4;
/// Steps shorter than this are followed by one with the same factors, whose size tells the error.
const CHORD_TURN: f64 = 0.05;
/// Chord steps that follow one another at most: a gradient and its solution cost a quarter of what a fresh tangent does.
const CHORDS: i32 = 4;
/// The smallest pivot, relative to that without load, is to be so many times what a step may change of it by the load.
const SAFE_LOAD: f64 = 2.0;
/// And so many times the step, whatever the load.
const SAFE: f64 = 10.0;
/// Steps shorter than this leave nothing but rounding behind, rad: Newton's method squares them.
const NEAR_TURN: f64 = 1e-8;
/// A shifted step shorter than this, and hardly shorter than the one before, finds next to no gradient, rad: the frames are at a saddle.
const SADDLE_TURN: f64 = 1e-3 * SMALL_TURN;
/// A saddle is left at most this often: thrice in bending about d2, about d1, and in twist.
const SADDLES: usize = 9;
/// Passes of the inverse iteration that finds the direction in which the energy falls most.
const PASSES: usize = 8;
/// How far a frame is turned to leave a saddle, rad.
const PUSH: f64 = 0.1;
/// No rotation vector within an element becomes longer, rad: at π it would jump to the other side.
const LARGEST_ROTATION: f64 = 3.1;
/// A line search that comes to steps as short as this finds nothing, rad.
const SHORTEST_TURN: f64 = 1e-10;
/// Fraction of the predicted decrease that a step must achieve (Armijo).
const DECREASE: f64 = 1e-4;
/// Couples are balanced to rounding when what is left of them is below this fraction of force times length.
const BALANCED: f64 = 1e-14;

/// One search for an equilibrium: what one iteration hands to the next.
pub(super) struct Search<'a, C, const P: usize> {
    system: &'a mut System,
    material: &'a C,
    force: &'a InternalForce,
    /// Whether the equilibrium has to be stable.
    stable: bool,
    /// The largest acceptable error of a frame, rad.
    tolerance: f64,
    length: f64,
    largest_force: f64,
    /// The shift of the present tangent, N; zero where it is positive definite by itself.
    shift: f64,
    /// The last shift that was not zero, N; zero before there was one.
    last_shift: f64,
    /// The largest rotation in the present step, rad.
    turn: f64,
    /// Whether the present step is not much shorter than the one before.
    stagnates: bool,
    /// How often a saddle was left.
    saddles: usize,
    /// Where the tip was when the tangent was not positive definite for the first time (m), and the largest number of negative pivots.
    lost: Option<(Vector3<f64>, usize)>,
    /// The longest step since, rad.
    longest_turn: f64,
    /// The answer as far as it is known: counts, and energy and inertia of the last assembly.
    found: Equilibrium,
}

impl<'a, C: Constitutive, const P: usize> Search<'a, C, P> {
    pub fn new(
        system: &'a mut System,
        rod: &Rod,
        material: &'a C,
        force: &'a InternalForce,
        stable: bool,
        tolerance: f64,
    ) -> Self {
        Self {
            system,
            material,
            force,
            stable,
            tolerance,
            length: rod.length(),
            largest_force: force.largest(),
            shift: 0.0,
            last_shift: 0.0,
            turn: f64::INFINITY,
            stagnates: false,
            saddles: 0,
            lost: None,
            longest_turn: 0.0,
            found: Equilibrium::default(),
        }
    }

    /// Moves the rod to an equilibrium in at most `bound` iterations.
    pub fn run(mut self, rod: &mut Rod, bound: usize) -> Result<Equilibrium, EquilibriumError> {
        for iteration in 1..=bound {
            self.found.iterations = iteration;
            self.find_tangent(rod)?;
            self.find_step()?;
            if iteration == 1 && self.is_far(rod) && self.moves_to_intrinsic_shape(rod) {
                continue;
            }
            if self.is_at_saddle() {
                self.leave_saddle(rod)?;
                continue;
            }
            if self.is_balanced_to_rounding() {
                self.found.error = self.turn;
                return Ok(self.finish(rod));
            }
            let fraction = self.search_line(rod)?;
            if fraction == 1.0 && self.shift == 0.0 && self.turn < CHORD_TURN {
                let (error, shrinks) = self.follow_chords(rod);
                if self.accepts(rod, error, shrinks)? {
                    return Ok(self.finish(rod));
                }
            }
        }
        Err(self.not_found(bound))
    }

    fn not_found(&mut self, iterations: usize) -> EquilibriumError {
        self.system.balance::<P>();
        let (step, residual, force) = (self.turn, self.system.unbalanced, self.largest_force);
        EquilibriumError::NoConvergence { iterations, step, residual, force }
    }

    fn finish(&self, rod: &Rod) -> Equilibrium {
        let lost = self.lost.filter(|(_, negative)| !self.is_turned_at_no_cost(*negative));
        let jump = lost.map(|(tip, _)| (rod.tip() - tip).norm());
        Equilibrium { jump, resistance: self.system.resistance, ..self.found }
    }

    /// Whether the answer has neutral directions for all `negative` pivots that were met, next to where these were met. A shoot that is
    /// buckled on an upright base turns about the vertical at no cost; on the way to its equilibrium, where couples are not
    /// balanced yet, the energy falls or rises a little in that direction, and nothing has lost its stability.
    fn is_turned_at_no_cost(&self, negative: usize) -> bool {
        negative <= self.found.inertia.neutral && self.longest_turn < LARGEST_TURN
    }

    fn assemble(&mut self, rod: &Rod) -> Result<(f64, Inertia), EquilibriumError> {
        self.system.assemble::<P>(rod, self.material, self.force, self.shift)
    }

    /// A force of the size that acts in the rod, N. Without load it is the strain energy per length.
    fn force_scale(&self) -> f64 {
        self.largest_force.max(self.found.energy.abs() / self.length).max(f64::MIN_POSITIVE)
    }

    /// Assembles and factorises the tangent, with growing shifts until no pivot is negative if the equilibrium has to be
    /// stable.
    fn find_tangent(&mut self, rod: &Rod) -> Result<(), EquilibriumError> {
        self.shift = 0.0;
        let mut negative = None;
        loop {
            (self.found.energy, self.found.inertia) = self.assemble(rod)?;
            self.found.factorisations += 1;
            // Without a shift.
            negative.get_or_insert(self.found.inertia.negative);
            if !self.stable || self.found.inertia.negative == 0 {
                break;
            }
            self.shift = if self.shift > 0.0 {
                4.0 * self.shift
            } else if self.last_shift > 0.0 {
                self.last_shift / 16.0
            } else {
                // A shift of the size of the force in the rod makes any rod in tension or near it convex.
                0.1 * self.force_scale()
            };
            if !self.shift.is_finite() {
                return Err(EquilibriumError::NotFinite { what: "tangent" });
            }
        }
        if self.shift > 0.0 {
            self.last_shift = self.shift;
            let (_, most) = self.lost.get_or_insert_with(|| (rod.tip(), 0));
            *most = negative.unwrap_or(0).max(*most);
        }
        Ok(())
    }

    /// Solves for the Newton step.
    fn find_step(&mut self) -> Result<(), EquilibriumError> {
        self.system.solve::<P>();
        let last = std::mem::replace(&mut self.turn, self.system.largest_turn());
        self.stagnates = !(self.turn < 0.5 * last);
        if self.lost.is_some() {
            self.longest_turn = self.longest_turn.max(self.turn);
        }
        if self.turn.is_finite() { Ok(()) } else { Err(EquilibriumError::NotFinite { what: "Newton step" }) }
    }

    /// Whether the first guess is a straight rod far from a minimum: the tangent is not positive definite there, or the step too
    /// long. A bent one is somebody's choice of a branch.
    fn is_far(&self, rod: &Rod) -> bool {
        let far = self.stable && (self.shift > 0.0 || self.turn > LARGEST_TURN);
        far && rod.rotations.iter().all(|theta| *theta == Vector3::zeros())
    }

    /// Gives the rod the shape that it would have without load if its energy is lower there than where it is: from far away the
    /// better first guess.
    fn moves_to_intrinsic_shape(&mut self, rod: &mut Rod) -> bool {
        self.system.start.keep(rod);
        if take_intrinsic_shape(rod).is_ok() {
            let trial = self.system.evaluate::<P>(rod, self.material, self.force);
            self.found.evaluations += 1;
            if trial < self.found.energy {
                return true;
            }
        }
        self.system.start.restore(rod);
        false
    }

    /// Whether there is next to no gradient, yet no minimum. While steps become much shorter it may be the gradient that is left
    /// which makes a neutral direction look like one in which the energy falls.
    fn is_at_saddle(&self) -> bool {
        self.stable && self.shift > 0.0 && self.turn < SADDLE_TURN && self.stagnates
    }

    /// Bends the rod a little in the direction in which the energy falls most, of those that turn about one axis, another one each time.
    fn leave_saddle(&mut self, rod: &mut Rod) -> Result<(), EquilibriumError> {
        if self.saddles == SADDLES {
            self.shift = 0.0;
            return Err(EquilibriumError::Unstable { negative: self.assemble(rod)?.1.negative });
        }
        let axis = [Vector3::y(), Vector3::x(), Vector3::z()][self.saddles % 3];
        self.saddles += 1;
        self.system.start.keep(rod);
        self.system.soften::<P>(rod, &axis, PASSES);
        self.longest_turn = self.longest_turn.max(PUSH);
        self.system.advance::<P>(rod, PUSH / self.system.largest_turn());
        Ok(())
    }

    /// Whether couples balance to rounding of the largest: they cannot be balanced better. Where the shape is all but
    /// free to move, rounding still turns the frames, by the present step, which is the error then.
    fn is_balanced_to_rounding(&self) -> bool {
        self.shift == 0.0
            && self.stagnates
            && self.turn < CHORD_TURN
            && self.system.unbalanced <= BALANCED * self.force_scale() * self.length
    }

    /// Moves the rod along the step, by a fraction of it that lowers the energy enough. Returns the fraction.
    fn search_line(&mut self, rod: &mut Rod) -> Result<f64, EquilibriumError> {
        let mut fraction = (LARGEST_TURN / self.turn).min(1.0);
        let slope = self.system.slope::<P>();
        let energy = self.found.energy;
        // The energy is known to rounding of its largest terms.
        let slack = 64.0 * f64::EPSILON * energy.abs();
        let longest = largest_rotation(rod).0.max(LARGEST_ROTATION);
        self.system.start.keep(rod);
        loop {
            self.system.advance::<P>(rod, fraction);
            let trial = self.system.evaluate::<P>(rod, self.material, self.force);
            self.found.evaluations += 1;
            let tiny = self.turn < SMALL_TURN;
            let falls = trial <= energy + DECREASE * fraction * slope + slack;
            let (rotation, node) = largest_rotation(rod);
            let folds = self.stable && rotation > longest;
            if trial.is_finite() && !folds && (falls || tiny || !self.stable) {
                self.found.energy = trial;
                return Ok(fraction);
            }
            self.system.start.restore(rod);
            if fraction * self.turn < SHORTEST_TURN {
                return Err(match folds {
                    true => EquilibriumError::Folded { element: node / P },
                    false => self.not_found(self.found.iterations),
                });
            }
            fraction *= 0.5;
        }
    }

    /// Chord steps: with the old factors from the gradient at the new frames, the first of which the line search has left. They
    /// cost little, and their sizes tell the error that they leave. Returns that error, rad, and whether the last one was
    /// clearly shorter than the step before it; at rounding level it is not.
    fn follow_chords(&mut self, rod: &mut Rod) -> (f64, bool) {
        let (mut last, mut more) = (self.turn, CHORDS);
        loop {
            more -= 1;
            self.system.balance::<P>();
            self.system.solve::<P>();
            let rest = self.system.largest_turn();
            if !(rest < 0.5 * last) {
                return (last.max(rest), false);
            }
            self.system.start.keep(rod);
            self.system.advance::<P>(rod, 1.0);
            // What the chord step leaves shrinks by the same ratio again, or by what the turn has changed of the tangent.
            let ratio = (rest / last).max(self.turn);
            let error = 4.0 * rest * ratio;
            if error <= self.tolerance || !self.is_safe() || error * ratio.powi(more) > self.tolerance {
                return (error, true);
            }
            self.found.energy = self.system.evaluate::<P>(rod, self.material, self.force);
            self.found.evaluations += 1;
            last = rest;
        }
    }

    /// Whether the signs of the tangent at the last step's start are those at its end: its smallest pivot is safe from a change of
    /// that size. Relative to the elastic tangent, turns φ change it by |n| ℓ² φ/K at most, in what the force does along the rod
    /// (by the square of 2/π of that) and in the couples that it causes (by 2/π).
    fn is_safe(&self) -> bool {
        // A third derivative of ½ n · C n by turns is 4 |C| |n|² at most, where that of n · d3 is |n|.
        let force = self.largest_force * (1.0 + 4.0 * self.system.yielding());
        let load = force * self.length * self.system.compliance();
        self.stable && self.system.resistance > (SAFE_LOAD * load).max(SAFE) * self.turn
    }

    /// Whether the frames are an equilibrium of the wanted kind, within the tolerance, given their error, rad, and whether the
    /// last chord step was clearly shorter than the one before.
    fn accepts(&mut self, rod: &Rod, error: f64, shrinks: bool) -> Result<bool, EquilibriumError> {
        // Where the signs are not safe, the answer is made as good as rounding allows, and a tangent is made there.
        let safe = self.is_safe();
        if !(error <= self.tolerance && (safe || !shrinks || self.turn < NEAR_TURN)) {
            return Ok(false);
        }
        self.found.error = error;
        if !safe {
            self.found.inertia = self.assemble(rod)?.1;
            self.found.factorisations += 1;
        }
        Ok(!self.stable || self.found.inertia.negative == 0)
    }
}

/// The longest rotation vector within an element, rad, and its number.
fn largest_rotation(rod: &Rod) -> (f64, usize) {
    let sizes = rod.rotations.iter().map(Vector3::norm).zip(0..);
    sizes.fold((0.0, 0), |a, b| if b.0 > a.0 { b } else { a })
}
