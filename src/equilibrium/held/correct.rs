//! Newton's method for the places of contacts.

use nalgebra::{DMatrix, DVector};

use super::data::HeldSearch;
use super::touch::SAME;
use crate::constitutive::Constitutive;
use crate::equilibrium::EquilibriumError;
use crate::load::Load;
use crate::rod::Rod;
use crate::support::Patch;

/// Number of Newton iterations with the contacts of an initial guess.
pub(super) const FOLLOWING: usize = 40;
/// Number of corrections of the places of contacts.
const CORRECTIONS: usize = 30;
/// Displacement of a contact that estimates derivatives, relative to the length.
const DIFFERENCE: f64 = 1e-6;
/// Largest displacement of a contact in a correction, relative to an element.
const LARGEST_SHIFT: f64 = 0.2;
/// Length of a free end beyond a contact that becomes longer, relative to an element, which is taken as none.
const SHORT_END: f64 = 0.3;
/// Slope, or curvature relative to the obstacle times the length, below which a place is not corrected.
const WELL_PLACED: f64 = 1e-6;
/// Tolerance (rad) of the equilibria from which derivatives are estimated: the rotations by a displacement
/// `DIFFERENCE` are larger.
const ESTIMATE: f64 = 1e-7;
/// Tolerance (rad) of the equilibrium at places that still move, relative to their motion over the length.
const EARLY: f64 = 1e-3;
/// Largest error of the place of a contact, relative to the length.
const PLACED: f64 = 1e-11;
/// Largest motion of the ends of a contact, relative to the length, that leaves the contacts the same.
const UNMOVED: f64 = 1e-7;
/// Largest pull of a contact that is attributed to rounding, relative to the force in the rod.
const PULL: f64 = 1e-13;

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Corrects the places of contacts. Returns whether the contacts have changed otherwise.
    pub(super) fn correct(&mut self, rod: &mut Rod, bound: usize, touching: f64) -> Result<bool, EquilibriumError> {
        let mut patches = self.patches(rod, touching);
        self.layer = self.bending_length(rod, &self.forces_along());
        if patches.is_empty() {
            return Ok(false);
        }
        let skew = self.skew(rod, &patches);
        if !skew.is_empty() {
            let mut moved = patches.clone();
            self.pinned = true;
            let placed = self.try_place(rod, &mut moved, &skew, bound);
            self.pinned = false;
            // A contact that is tangential now, and where the rod is more curved still, becomes longer below.
            let curved = |at: &Patch| self.approach(rod, at.obstacle, at.from).1 < 0.0;
            if placed && !skew.iter().any(|(i, _)| curved(&moved[*i])) {
                return Ok(true);
            }
            if placed {
                patches = moved;
            }
        }
        let reshaped = self.reshape(rod, &mut patches);
        let unknown = self.unknown(&patches);
        if reshaped {
            // A contact that becomes longer is placed at once: at a first estimate of its ends it may pull.
            let mut moved = patches.clone();
            if unknown.is_empty() || !self.try_place(rod, &mut moved, &unknown, bound) {
                self.arrange(rod, &patches);
            }
            return Ok(true);
        }
        if unknown.is_empty() {
            let misses = self.misses_node(rod, &patches);
            if misses {
                self.arrange(rod, &patches);
            }
            return Ok(misses);
        }
        self.arrange(rod, &patches);
        self.frozen = true;
        let result = self.place(rod, &mut patches, &unknown, bound);
        self.frozen = false;
        result?;
        // The equilibrium at the new places may be blocked elsewhere or pull.
        let before = patches;
        self.find(rod, bound)?;
        let changed = self.patches(rod, touching);
        let same = changed.len() == before.len()
            && changed.iter().zip(&before).all(|(a, b)| {
                let moved = (a.from - b.from).abs() + (a.to - b.to).abs();
                a.obstacle == b.obstacle && moved < UNMOVED * self.length
            });
        let least = -PULL * self.force_scale();
        let pulls = self.sites.iter().any(|site| site.touch.is_some_and(|touch| touch.push < least));
        let mut again = before.clone();
        Ok(!same || pulls || self.reshape(rod, &mut again))
    }

    /// Corrects places in few iterations. Returns whether it succeeds; otherwise the rod and its contacts are those
    /// before.
    fn try_place(&mut self, rod: &mut Rod, patches: &mut [Patch], unknown: &[(usize, bool)], bound: usize) -> bool {
        let before = self.snapshot(rod);
        self.arrange(rod, patches);
        self.frozen = true;
        let placed = self.place(rod, patches, unknown, bound.min(FOLLOWING)).is_ok();
        self.frozen = false;
        if !placed {
            self.restore(rod, before);
        }
        placed
    }

    /// Newton's method for the places, with secant updates.
    fn place(
        &mut self,
        rod: &mut Rod,
        patches: &mut [Patch],
        unknown: &[(usize, bool)],
        bound: usize,
    ) -> Result<(), EquilibriumError> {
        self.find(rod, bound)?;
        let mut value = self.misplacement(rod, patches, unknown);
        // Well placed contacts are not moved. Other nodes would change its shape by the interpolation error,
        // which contacts that stick would resist with large forces.
        if value.amax() <= WELL_PLACED {
            return Ok(());
        }
        let mut jacobian = self.derivatives(rod, (patches, unknown), &value, bound)?;
        for _ in 0..CORRECTIONS {
            let Some(mut step) = jacobian.clone().lu().solve(&-&value) else { break };
            let longest = step.amax();
            let allowed = LARGEST_SHIFT * self.length / self.parent.elements() as f64;
            if longest > allowed {
                step *= allowed / longest;
            }
            let mut moved = patches.to_vec();
            shift(&mut moved, unknown, &step);
            self.extend_to_apex(&mut moved, patches);
            if self.clip(&mut moved) {
                self.arrange(rod, &moved);
                return self.find(rod, bound);
            }
            self.arrange(rod, &moved);
            self.find_to(rod, bound, EARLY * longest / self.length)?;
            let new = self.misplacement(rod, &moved, unknown);
            patches.copy_from_slice(&moved);
            // Broyden's update.
            let lacking = &new - &value - &jacobian * &step;
            let square = step.norm_squared();
            if square > 0.0 {
                jacobian += lacking * step.transpose() / square;
            }
            value = new;
            if longest <= PLACED * self.length {
                return Ok(());
            }
        }
        Err(self.contacts_not_found(value.amax()))
    }

    /// The derivatives of the misplacements, which are `value` at present, by the places, from differences. The rod and
    /// its contacts are those before.
    fn derivatives(
        &mut self,
        rod: &mut Rod,
        (patches, unknown): (&[Patch], &[(usize, bool)]),
        value: &DVector<f64>,
        bound: usize,
    ) -> Result<DMatrix<f64>, EquilibriumError> {
        let step = DIFFERENCE * self.length;
        let mut matrix = DMatrix::zeros(unknown.len(), unknown.len());
        for (k, at) in unknown.iter().enumerate() {
            let before = self.snapshot(rod);
            let mut moved = patches.to_vec();
            shift(&mut moved, &[*at], &DVector::from_element(1, -step));
            self.arrange(rod, &moved);
            self.find_to(rod, bound, ESTIMATE)?;
            matrix.set_column(k, &((value - self.misplacement(rod, &moved, unknown)) / step));
            self.restore(rod, before);
        }
        Ok(matrix)
    }

    /// Moves the end of a contact that becomes longer to the apex if it is close to it: the length of a short free end
    /// is a double root of its condition.
    fn extend_to_apex(&self, moved: &mut [Patch], before: &[Patch]) {
        let element = self.length / self.parent.elements() as f64;
        for (patch, before) in moved.iter_mut().zip(before) {
            let longer = patch.to > before.to && patch.to - patch.from > element;
            let free = before.to < self.length * (1.0 - SAME);
            if longer && free && patch.to > self.length - SHORT_END * element {
                patch.to = self.length.next_up();
            }
        }
    }

    /// Clips patches that reach beyond the base or the apex, and reduces those that have ended to a point. Returns
    /// whether there were any.
    fn clip(&self, patches: &mut [Patch]) -> bool {
        let outside = |patch: &Patch| patch.from > patch.to || patch.to > self.length || patch.from < 0.0;
        if !patches.iter().any(outside) {
            return false;
        }
        for patch in patches {
            patch.to = patch.to.min(self.length);
            patch.from = patch.from.clamp(0.0, self.length);
            if patch.from > patch.to {
                let middle = 0.5 * (patch.from + patch.to);
                (patch.from, patch.to) = (middle, middle);
            }
        }
        true
    }

    /// Newton's iteration with a tolerance (rad) that is at least that of the result.
    fn find_to(&mut self, rod: &mut Rod, bound: usize, tolerance: f64) -> Result<(), EquilibriumError> {
        let own = self.tolerance;
        self.tolerance = own.max(tolerance);
        let result = self.find(rod, bound);
        self.tolerance = own;
        result
    }
}

/// Moves the ends of patches; both ends of a contact at a point.
fn shift(patches: &mut [Patch], unknown: &[(usize, bool)], by: &DVector<f64>) {
    for ((i, end), by) in unknown.iter().zip(by.iter()) {
        let patch = &mut patches[*i];
        let point = patch.from == patch.to;
        if *end || point {
            patch.to += by;
        }
        if !*end || point {
            patch.from += by;
        }
    }
}
