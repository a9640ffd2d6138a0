//! Steps of a held rod along a valley of the energy.
//!
//! The energy of a buckled rod of circular section between clamps is the same for all planes of
//! bending, and that of a rod between pins for all rotations about the line of the pins. A small
//! disturbance selects one of them, far from the present one: the rod moves along the floor of a
//! valley, as [a free one](crate::equilibrium). A long step δ leaves the floor. Corrections lead back
//! to it. They are steps with the same factors and conditions that are perpendicular to δ in the
//! rotations of the frames.

use nalgebra::{DMatrix, DVector, Vector3};

use super::linear::{Conditions, Linear};
use super::search::HeldSearch;
use crate::equilibrium::elimination::Row;
use crate::equilibrium::valley::{CORRECTIONS, product};
use crate::rod::Rod;

impl HeldSearch<'_> {
    /// Whether a rod without contact may follow a valley: nothing else bounds its motion.
    pub(super) fn may_follow_valley(&self) -> bool {
        self.stable && self.obstacles.contacts.is_empty()
    }

    /// Corrects the rod, which has moved by a part of a step of the system, towards the floor of
    /// the valley, until a correction is not shorter than half of the one before. The part has the
    /// given length (rad). The step of the system does not change.
    pub(super) fn reach_floor(&mut self, rod: &mut Rod, linear: &Linear, length: f64) {
        let system = self.body.system_mut();
        let turns = system.turns.clone();
        let steps = system.steps.clone();
        let base_motion = system.base_motion;
        // The response to couples in proportion to the rotations in the step.
        system.couples.clone_from(&turns);
        let elements = system.elements.iter_mut();
        elements.for_each(|element| element.condensed = Row::default());
        system.base_force = Vector3::zeros();
        system.joints.confine(&mut system.couples);
        let direction = system.couples.clone();
        let moved = &linear.rows * linear.response.free(system);
        system.solve();
        let response = system.turns.clone();
        let n = linear.roles.len();
        let own = product(&direction, &response);
        let mut matrix = DMatrix::zeros(n + 1, n + 1);
        matrix.view_mut((0, 0), (n, n)).copy_from(&linear.matrix);
        matrix.view_mut((0, n), (n, 1)).copy_from(&moved);
        matrix.view_mut((n, 0), (1, n)).tr_copy_from(&moved);
        matrix[(n, n)] = own;
        let mut scale = linear.solver.scale.clone().push(1.0 / own.abs().sqrt());
        if !scale[n].is_finite() {
            scale[n] = 1.0;
        }
        let solver = Conditions::new(&matrix, scale);
        let mut last = length;
        for _ in 0..CORRECTIONS {
            self.balance(rod);
            let violations = self.residuals(&linear.roles);
            if violations.len() != n {
                break;
            }
            let free = &linear.rows * linear.response.free(self.body.system_mut());
            let along = product(&response, &self.body.system().couples);
            let violations = (DVector::from_vec(violations) + free).push(along);
            let forces = solver.solve(&-violations);
            let links = forces.rows(0, n).into_owned();
            let reactions = linear.rows.tr_mul(&links);
            let system = self.body.system_mut();
            linear.response.load(system, &reactions);
            let couples = system.couples.iter_mut().zip(&direction);
            couples.for_each(|(couple, direction)| *couple += direction * forces[n]);
            system.solve();
            let turn = system.largest_turn();
            if !(turn < 0.5 * last) {
                break;
            }
            last = turn;
            let system = self.body.system_mut();
            system.start.keep(rod);
            system.advance(rod, 1.0);
            self.add_links(&linear.roles, &links, 1.0);
            self.apply(rod);
            self.locate(rod);
        }
        let system = self.body.system_mut();
        (system.turns, system.steps, system.base_motion) = (turns, steps, base_motion);
    }
}
