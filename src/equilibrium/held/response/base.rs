//! The displacement of a free base, which moves all places alike.

use nalgebra::{DVector, Matrix3, Vector3};

use super::LinearResponse;
use crate::equilibrium::system::System;

impl LinearResponse {
    /// The first coordinates of all places and of a free base.
    fn displaced(&self) -> Vec<usize> {
        self.places.iter().map(|place| place.first).chain([self.size() - 3]).collect()
    }

    /// Adds the displacements of all places by that of a free base to the compliance.
    pub(super) fn add_base(&mut self, system: &System) {
        let Some(compliance) = self.base else { return };
        let firsts = self.displaced();
        for (a, b) in firsts.iter().flat_map(|a| firsts.iter().map(move |b| (*a, *b))) {
            let mut block = self.compliance.fixed_view_mut::<3, 3>(a, b);
            block += Matrix3::from_diagonal_element(compliance);
        }
        // Reactions do not exert couples on the frames in this displacement.
        let zero = vec![Vector3::zeros(); system.elements.len() + 1];
        self.columns.extend((0..3).map(|_| [zero.clone(), zero.clone()]));
    }

    /// Adds the displacement of a free base by the unbalanced force.
    pub(super) fn displace_base(&self, system: &System, moved: &mut DVector<f64>) {
        let Some(compliance) = self.base else { return };
        let by = system.base * compliance;
        for first in self.displaced() {
            let mut rows = moved.fixed_rows_mut::<3>(first);
            rows += by;
        }
    }
}
