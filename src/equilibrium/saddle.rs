//! Leaving a saddle of the energy.

use nalgebra::Vector3;

use super::EquilibriumError;
use super::error::Outcome;
use super::search::{NEGLIGIBLE_TURN, NewtonSearch};
use crate::constitutive::Constitutive;
use crate::rod::Rod;

/// Largest number of saddles that are left: three each by bending about d2, by bending about d1 and
/// by twist.
const SADDLES: usize = 9;
/// Number of inverse iterations for the direction of steepest decrease of the energy.
const PASSES: usize = 8;
/// Largest rotation of a frame by which a saddle is left, rad: large against the rounding of the
/// gradient, and small enough for the quadratic model of the energy.
const PUSH: f64 = 0.1;

impl<C: Constitutive> NewtonSearch<'_, C> {
    /// Whether the gradient vanishes at a saddle. While steps become much shorter, the remaining
    /// gradient may give a neutral direction a negative pivot. A shift that is larger than
    /// necessary makes steps short far from a saddle, too.
    pub(super) fn is_at_saddle(&self) -> bool {
        let negligible =
            self.turn < NEGLIGIBLE_TURN && (self.shift_is_needed || self.has_only_rounding());
        self.stable && self.shift > 0.0 && negligible && self.stagnates
    }

    /// Bends the rod in the direction of steepest decrease of the energy among rotations about one
    /// axis. The axis changes with each saddle.
    pub(super) fn leave_saddle(&mut self, rod: &mut Rod) -> Outcome {
        if self.saddles == SADDLES {
            self.shift = 0.0;
            return Err(EquilibriumError::Unstable {
                negative: self.assemble(rod)?.1.negative,
            });
        }
        let axis = [Vector3::y(), Vector3::x(), Vector3::z()][self.saddles % 3];
        self.saddles += 1;
        self.system.start.keep(rod);
        self.system.tangent.fix_neutral();
        self.system.soften(rod, &axis, PASSES);
        self.longest_turn = self.longest_turn.max(PUSH);
        self.system.advance(rod, PUSH / self.system.largest_turn());
        Ok(())
    }
}
