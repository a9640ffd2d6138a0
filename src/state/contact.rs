//! The part of the state that a support adds besides the reactions of the rod: contacts, and the shape with nodes.

use super::StateError;
use crate::error::ParameterError;
use crate::rod::Rod;
use crate::support::Patch;

/// Contacts of a shoot with obstacles. Empty without a support.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ContactState {
    /// The rod with additional nodes where contacts begin and end; `None` for a rod without such nodes.
    pub shape: Option<Rod>,
    pub patches: Vec<Patch>,
}

impl ContactState {
    /// Copies `source`, without allocation if both are empty.
    pub fn copy_from(&mut self, source: &Self) {
        self.patches.clone_from(&source.patches);
        self.shape.clone_from(&source.shape);
    }

    /// Takes the elements of the shape whose tissue has left the growth zone out of its zone, as those of the rod.
    pub fn mature(&mut self) {
        if let Some(shape) = &mut self.shape {
            let elements = shape.points()[shape.zone()].chunks(shape.order().points());
            let left = elements.take_while(|element| element[0].exit_time < f64::INFINITY).count();
            let _ = shape.mature(left);
        }
    }

    /// Returns an error if a number is invalid or the shape is not one of `rod`.
    pub fn check(&self, rod: &Rod) -> Result<(), StateError> {
        if let Some(shape) = &self.shape {
            shape.check()?;
            let (name, excess) = ("length of the shape in excess of the rod", shape.length() - rod.length());
            ParameterError::unless(excess.abs() <= 1e-9 * rod.length(), name, excess, "zero (m)")?;
        }
        let sum = self.patches.iter().map(|patch| patch.from + patch.to).sum();
        Ok(ParameterError::finite("sum of the places of contacts", sum)?)
    }
}
