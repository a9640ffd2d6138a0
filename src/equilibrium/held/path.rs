//! The load path of a search: holds move in increments from their present places to the requested ones.

use nalgebra::Vector3;

use super::search::{Found, HeldSearch, project};
use super::settings::SETTINGS;
use super::sites::turn_frames;
use crate::equilibrium::EquilibriumError;
use crate::rod::Rod;

impl HeldSearch<'_> {
    /// Finds the equilibrium. Returns an error for laws of supports that are invalid where the search ends.
    pub fn run(mut self, rod: &mut Rod, bound: usize) -> Result<Found, EquilibriumError> {
        self.bound = bound;
        let moved = self.move_holds(rod);
        if moved.as_ref().err().is_none_or(EquilibriumError::is_recoverable) {
            self.check_end(rod)?;
        }
        moved?;
        if !self.frames.is_empty() {
            // The last step may change reactions that do not affect the shape.
            self.balance_frames(rod);
            self.found.evaluations += 1;
        }
        let (mut reactions, mut patches) = (self.reactions(rod), self.patches(rod, 0.0));
        self.obstacles.name(&mut reactions, &mut patches);
        Ok(Found { equilibrium: self.found, increments: self.increments, reactions, patches })
    }

    /// Moves the holds from their present places to the requested ones in increments, each of which ends in
    /// equilibrium.
    fn move_holds(&mut self, rod: &mut Rod) -> Result<(), EquilibriumError> {
        self.locate(rod);
        self.check_reach(rod)?;
        self.check_obstacles(rod)?;
        self.check_start(rod)?;
        self.lay(rod);
        let goals: Vec<Vector3<f64>> = self.sites.iter().map(|site| site.target).collect();
        let starts: Vec<Vector3<f64>> =
            self.sites.iter().map(|site| site.target + project(&site.fixed, &(site.position - site.target))).collect();
        let far = goals.iter().zip(&starts).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / self.length;
        let turned = self.frames.iter().map(|frame| frame.missing(rod).norm()).fold(0.0, f64::max);
        let (largest_turn, largest_move) = SETTINGS.increment;
        let number = (far / largest_move).max(turned / largest_turn).ceil().max(1.0);
        let (mut done, mut share) = (0.0, 1.0 / number);
        let moves = number > 1.0 || far > 0.0 || turned > 0.0;
        let each = self.bound;
        while done < 1.0 {
            let next = if done + share > 1.0 - 1e-9 { 1.0 } else { done + share };
            let before = self.snapshot(rod);
            for ((site, start), goal) in self.sites.iter_mut().zip(&starts).zip(&goals) {
                site.target = start + (goal - start) * next;
            }
            self.turn_held(rod, (next - done) / (1.0 - done));
            self.increments += 1;
            self.bound = self.found.iterations + each;
            let smallest = !moves || share <= SETTINGS.smallest_increment || done + share <= done;
            match self.settle(rod) {
                Ok(()) => done = next,
                Err(error) if error.is_recoverable() && !smallest => {
                    self.restore(rod, &before);
                    share *= 0.5;
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Finds the equilibrium of an increment: next to the initial guess, or by a descent in which the tangent is
    /// positive on the permitted directions.
    fn settle(&mut self, rod: &mut Rod) -> Result<(), EquilibriumError> {
        let guess = self.snapshot(rod);
        let result = self.find(rod, false);
        trace!("CALL t={:.6} unguarded {} its {} fact {}", self.obstacles.time, result.as_ref().map_or_else(|e| e.to_string().chars().take(40).collect::<String>(), |()| "ok".to_string()), self.found.iterations, self.found.factorisations);
        let contacts = !self.obstacles.contacts.is_empty();
        match result {
            Err(error) if contacts && !self.nearby && error.is_recoverable() => {
                self.restore(rod, &guess);
                let tip = rod.tip();
                let result = self.find(rod, true);
                trace!("CALL   guarded {} its {} fact {} moved {:.1e}", result.is_ok(), self.found.iterations, self.found.factorisations, (rod.tip() - tip).norm());
                result?;
                self.found.jump = Some((rod.tip() - tip).norm());
                Ok(())
            }
            result => result,
        }
    }

    /// Rotates the held frames by a share of the rotations that they lack.
    fn turn_held(&mut self, rod: &mut Rod, share: f64) {
        for i in 0..self.frames.len() {
            let turn = self.frames[i].missing(rod) * share;
            if turn.norm() > 0.0 {
                let at = self.frames[i].node;
                let from = if i > 0 { self.frames[i - 1].node } else { 0 };
                turn_frames(rod, &turn, from, at, self.frames.get(i + 1).map(|next| next.node));
            }
        }
    }
}
