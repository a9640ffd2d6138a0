//! Perception at the apex of a shoot.

use nalgebra::Vector3;

use super::perception::forward_signal;
use super::{Declaration, Perception, Site, Source};
use crate::error::ParameterError;

/// Perception of the apex in place of the tissue that responds: all points receive the signal of
/// the apex at the same time, as components along its directors. The delay of a
/// [`Memory`](super::Memory) is the time in which the signal reaches the tissue. Strain and couple
/// at the apex are NaN, and the section is that of the tissue that responds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AtApex<P>(
    /// The perception.
    pub P,
);

impl<P: Perception> Perception for AtApex<P> {
    type Signal = P::Signal;

    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let unknown = Vector3::repeat(f64::NAN);
        let apex = Site {
            frame: site.rod.apex_frame(),
            strain: unknown,
            couple: unknown,
            arc_length: site.rod.length(),
            apex_distance: 0.0,
            initial_apex_distance: 0.0,
            position: site.tip,
            ..*site
        };
        self.0.sense(&apex, stimuli);
    }

    forward_signal!(self, self.0);
}
