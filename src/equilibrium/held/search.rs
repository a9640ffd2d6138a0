//! Newton's method for a rod with supports.

use nalgebra::{DMatrix, DVector, Dyn, SymmetricEigen, Vector3};

use super::border::{Border, Column, upto_parts};
use super::sites::{HeldFrame, Site, sort, turn_frames};
use crate::constitutive::{Constitutive, line_strain_under};
use crate::equilibrium::system::{Configuration, System};
use crate::equilibrium::{Equilibrium, EquilibriumError, Inertia};
use crate::error::ParameterError;
use crate::load::{InternalForce, PointReaction};
use crate::rod::{Rod, Tissue};
use crate::so3;
use crate::support::{Reaction, Support};

/// Largest rotation of a frame in a step, rad.
const LARGEST_TURN: f64 = 0.5;
/// Largest displacement of a hold in an increment, relative to the length of the rod.
const LARGEST_MOVE: f64 = 0.05;
/// Largest rotation of a held frame in an increment, rad.
const LARGEST_INCREMENT: f64 = 0.3;
/// Smallest increment, as a share of the motion of the holds.
const SMALLEST_SHARE: f64 = 1e-6;
/// Number of Newton iterations after which an increment is halved.
const ITERATIONS: usize = 400;
/// Rotation in a step below which the energy is not compared, rad: its change is close to rounding.
const SMALL_TURN: f64 = 1e-4;
/// Fraction of the predicted decrease that a step must achieve (Armijo), the usual value.
const DECREASE: f64 = 1e-4;
/// Number of saddles that are left.
const SADDLES: usize = 4;
/// Largest rotation by which a saddle is left, rad.
const PUSH: f64 = 0.1;
/// Largest eigenvalue of the bordered matrix that is attributed to rounding, relative to its scale.
const NEUTRAL: f64 = 1e-8;
/// Bound on the change of an eigenvalue of the scaled matrix of the reactions by a step, relative to the rotation and
/// to the change of a reaction times its flexibility over the length.
const OUTDATED: f64 = 10.0;
/// Eigenvalue of the scaled matrix of the reactions below which the inertia is evaluated at the equilibrium.
const CLOSE: f64 = 1e-3;
/// Largest rotation in a step that may be due to rounding, rad.
const STAGNANT: f64 = 1e-6;
/// Largest unbalanced couple that is due to rounding, relative to the largest force times the length.
const BALANCED: f64 = 1e-13;
/// Largest number of steps by which the rod returns to the conditions.
const RESTORATIONS: usize = 6;
/// Violation of the conditions relative to the length at which this ends.
const RESTORED: f64 = 1e-12;
/// Violation of the conditions relative to the length that is acceptable if it does not decrease further.
const ACCEPTED: f64 = 1e-8;
/// Smallest flexibility of a hold, relative to the largest, with which it moves to first order.
const STRAIGHT: f64 = 1e-6;

/// Memory of a search.
#[derive(Debug, Default)]
pub(crate) struct HeldWorkspace {
    border: Border,
}

/// A search for an equilibrium of a rod with supports.
pub(in crate::equilibrium) struct HeldSearch<'a, C, const P: usize> {
    system: &'a mut System,
    border: &'a mut Border,
    material: &'a C,
    force: &'a mut InternalForce,
    /// Whether the equilibrium has to be stable.
    stable: bool,
    tolerance: f64,
    length: f64,
    sites: Vec<Site>,
    frames: Vec<HeldFrame>,
    /// Largest force of a reaction per unit of violated condition: the weight of the conditions in the merit.
    weight: f64,
    boosts: Vec<(usize, f64)>,
    found: Equilibrium,
}

/// The matrix of the reactions, D − Bᵀ K⁻¹ B, scaled to a diagonal of the order of one and diagonalised.
struct Dense {
    scale: DVector<f64>,
    eigen: SymmetricEigen<f64, Dyn>,
}

impl Dense {
    fn of(dense: &DMatrix<f64>, scale: DVector<f64>) -> Self {
        let scaled = DMatrix::from_fn(dense.nrows(), dense.ncols(), |i, j| dense[(i, j)] * scale[i] * scale[j]);
        // The decomposition of nalgebra requires at least one row; supports of frames alone have no reactions.
        let none = || SymmetricEigen { eigenvectors: DMatrix::zeros(0, 0), eigenvalues: DVector::zeros(0) };
        let eigen = if scaled.is_empty() { none() } else { SymmetricEigen::new(scaled) };
        Self { scale, eigen }
    }

    /// Solves for the reactions. Neutral directions keep their reactions.
    fn solve(&self, rhs: &DVector<f64>) -> DVector<f64> {
        let mut y = self.eigen.eigenvectors.tr_mul(&rhs.component_mul(&self.scale));
        for (y, value) in y.iter_mut().zip(self.eigen.eigenvalues.iter()) {
            *y = if value.abs() <= NEUTRAL { 0.0 } else { *y / value };
        }
        (&self.eigen.eigenvectors * y).component_mul(&self.scale)
    }
}

/// Conditions of the reactions at one iteration: rows of T and D, and right-hand sides.
struct Conditions {
    columns: Vec<Column>,
    /// What each column belongs to.
    roles: Vec<Role>,
    /// Diagonal of D.
    diagonal: Vec<f64>,
    /// Violated distances, m.
    residuals: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Role {
    /// Component of the force of a hold: site and direction.
    Fixed(usize, Vector3<f64>),
    /// Spring.
    Spring,
    /// Increase of a pivot.
    Boost,
}

impl<'a, C: Constitutive, const P: usize> HeldSearch<'a, C, P> {
    pub fn new(
        (system, workspace): (&'a mut System, &'a mut HeldWorkspace),
        rod: &Rod,
        material: &'a C,
        force: &'a mut InternalForce,
        support: &impl Support,
        (stable, tolerance): (bool, f64),
    ) -> Result<Self, EquilibriumError> {
        let time = force.environment().time;
        let (sites, frames) = sort(rod, support.base(), &support.holds(time), &mut system.joints)?;
        Ok(Self {
            system,
            border: &mut workspace.border,
            material,
            force,
            stable,
            tolerance,
            length: rod.length(),
            sites,
            frames,
            weight: 0.0,
            boosts: Vec::new(),
            found: Equilibrium::default(),
        })
    }

    /// Takes the forces of an earlier equilibrium as initial guess.
    pub fn guess(&mut self, reactions: &[Reaction]) {
        for (site, reaction) in self.sites.iter_mut().zip(reactions) {
            site.force = reaction.force;
        }
    }

    /// Moves the holds from their present places to the requested ones in increments, each of which ends in
    /// equilibrium.
    pub fn run(mut self, rod: &mut Rod, bound: usize) -> Result<(Equilibrium, Vec<Reaction>), EquilibriumError> {
        self.locate(rod);
        for site in &mut self.sites {
            let from = site.position;
            let springs = !site.springs.is_empty();
            site.force = if springs { Vector3::zeros() } else { project(&site.fixed, &site.force) };
            let _ = from;
        }
        let goals: Vec<Vector3<f64>> = self.sites.iter().map(|site| site.target).collect();
        let starts: Vec<Vector3<f64>> =
            self.sites.iter().map(|site| site.target + project(&site.fixed, &(site.position - site.target))).collect();
        let far = goals.iter().zip(&starts).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / self.length;
        let turned = self.frames.iter().map(|frame| frame.missing(rod).norm()).fold(0.0, f64::max);
        let number = (far / LARGEST_MOVE).max(turned / LARGEST_INCREMENT).ceil().max(1.0);
        let (mut done, mut share) = (0.0, 1.0 / number);
        let mut before = Configuration::default();
        while done < 1.0 {
            let next = if done + share > 1.0 - 1e-9 { 1.0 } else { done + share };
            before.keep(rod);
            let forces: Vec<_> = self.sites.iter().map(|site| site.force).collect();
            for ((site, start), goal) in self.sites.iter_mut().zip(&starts).zip(&goals) {
                site.target = start + (goal - start) * next;
            }
            self.turn_held(rod, (next - done) / (1.0 - done));
            match self.find(rod, bound.min(ITERATIONS)) {
                Ok(()) => done = next,
                Err(error) if error.is_recoverable() && share > SMALLEST_SHARE && done + share > done => {
                    before.restore(rod);
                    self.sites.iter_mut().zip(forces).for_each(|(site, force)| site.force = force);
                    share *= 0.5;
                    if number == 1.0 && far == 0.0 && turned == 0.0 {
                        return Err(error);
                    }
                }
                Err(error) => return Err(error),
            }
        }
        let reactions = self.reactions(rod);
        Ok((self.found, reactions))
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

    /// Computes the positions of the sites.
    fn locate(&mut self, rod: &Rod) {
        let (time, p) = (self.force.environment().time, P);
        let reach = self.sites.iter().map(|site| site.element + 1).max().unwrap_or(0);
        let mut start = Vector3::zeros();
        for e in 0..reach {
            let tangents: [Vector3<f64>; P] = std::array::from_fn(|g| {
                let (frame, i) = (rod.frame_at_point(e, g), e * p + g);
                let tissue = Tissue::of(&rod.points()[i], time);
                frame * line_strain_under(self.material, &tissue, &frame, &self.force.at_points()[i])
            });
            let chord = |x: f64| {
                tangents.iter().zip(upto_parts(rod, e, x)).map(|(tangent, part)| tangent * part).sum::<Vector3<f64>>()
            };
            for site in self.sites.iter_mut().filter(|site| site.element == e) {
                site.position = start + chord(site.x);
            }
            start += chord(1.0);
        }
    }

    /// Applies the present reactions to the rod.
    fn apply(&mut self, rod: &Rod) {
        let reactions = self.sites.iter().map(|site| PointReaction {
            element: site.element,
            x: site.x,
            force: site.force + site.spring_force(),
            couple: Vector3::zeros(),
        });
        self.force.set_reactions(rod, reactions);
    }

    /// Energy of the rod, its loads and springs (J), at the last evaluation, which returned `energy`.
    fn potential(&mut self, rod: &Rod, energy: f64, applied: &[Vector3<f64>]) -> f64 {
        let joints = self.system.joints.stretch(rod);
        let each = self.sites.iter().zip(applied);
        energy + joints + each.map(|(site, force)| force.dot(&site.position) + site.spring_energy()).sum::<f64>()
    }

    fn violation(&self) -> f64 {
        let each = self.sites.iter();
        each.flat_map(|site| site.fixed.iter().map(|d| d.dot(&(site.position - site.target)).abs())).sum()
    }

    fn conditions(&self) -> Conditions {
        let mut conditions =
            Conditions { columns: Vec::new(), roles: Vec::new(), diagonal: Vec::new(), residuals: Vec::new() };
        let mut add = |column, role, diagonal, residual| {
            conditions.columns.push(column);
            conditions.roles.push(role);
            conditions.diagonal.push(diagonal);
            conditions.residuals.push(residual);
        };
        for (i, site) in self.sites.iter().enumerate() {
            let place = |direction| Column::Place { element: site.element, x: site.x, direction };
            for direction in &site.fixed {
                let residual = direction.dot(&(site.position - site.target));
                add(place(*direction), Role::Fixed(i, *direction), 0.0, residual);
            }
            for (along, stiffness) in &site.springs {
                add(place(along * stiffness.sqrt()), Role::Spring, -1.0, 0.0);
            }
        }
        for (unknown, increase) in &self.boosts {
            // The unknown is scaled so that its diagonal entry is one.
            add(Column::Turn { unknown: *unknown }, Role::Boost, 1.0 / increase, 0.0);
        }
        conditions
    }

    /// Assembles the tangent with a shift, and counts the signs of its pivots.
    fn assemble(&mut self, rod: &Rod, shift: f64) -> Result<(f64, Inertia, Conditions, Dense), EquilibriumError> {
        let (energy, mut inertia) = self.system.condense::<P>(rod, self.material, self.force, shift)?;
        let joints = self.system.joints.clone();
        joints.apply(&mut self.system.tangent, rod);
        self.system.joints.stretch(rod);
        self.system.tangent.factorise_boosted(&mut inertia, &mut self.boosts)?;
        self.found.factorisations += 1 + self.boosts.len();
        let conditions = self.conditions();
        self.border.assemble::<P>(self.system, rod, self.material, self.force, &conditions.columns);
        let mut dense = &self.border.yields - &self.border.gram;
        for (i, d) in conditions.diagonal.iter().enumerate() {
            dense[(i, i)] += d;
        }
        self.system.balance::<P>();
        // The bordered matrix has one negative eigenvalue for every condition and every spring.
        let scale = DVector::from_fn(dense.nrows(), |i, _| {
            1.0 / (self.border.sizes[i] - self.border.yields[(i, i)] + conditions.diagonal[i].abs())
                .sqrt()
                .max(f64::MIN_POSITIVE)
        });
        let finite = dense.iter().all(|value| value.is_finite());
        if !(energy.is_finite() && finite) {
            return Err(EquilibriumError::NotFinite { what: "tangent" });
        }
        let dense = Dense::of(&dense, scale);
        let expected = conditions.roles.iter().filter(|role| **role != Role::Boost).count();
        let positive = conditions.roles.len() - expected;
        let mut negative = inertia.negative;
        let mut above = inertia.positive;
        if std::env::var("DBG").is_ok() {
            eprintln!("   K neg {} eig {:?}", inertia.negative, dense.eigen.eigenvalues.as_slice());
        }
        for value in dense.eigen.eigenvalues.iter() {
            inertia.margin = inertia.margin.min(value.abs());
            if value.abs() <= NEUTRAL {
                inertia.neutral += 1;
            } else if *value < 0.0 {
                negative += 1;
            } else {
                above += 1;
            }
        }
        inertia.negative = negative.saturating_sub(expected);
        inertia.positive = above.saturating_sub(positive + self.system.joints.confined_directions() + expected);
        Ok((energy, inertia, conditions, dense))
    }

    /// The inertia at the present configuration.
    pub fn inertia(mut self, rod: &Rod) -> Result<Inertia, EquilibriumError> {
        self.locate(rod);
        self.apply(rod);
        self.assemble(rod, 0.0).map(|(_, inertia, ..)| inertia)
    }

    /// Solves for the step of rotations and reactions. Returns the changes of the reactions.
    fn step(&mut self, conditions: &Conditions, dense: &Dense) -> DVector<f64> {
        let free = self.border.step::<P>(self.system);
        let rhs = DVector::from_fn(free.len(), |i, _| free[i] + conditions.residuals[i]);
        let changes = dense.solve(&rhs);
        self.border.load::<P>(self.system, &changes);
        self.system.solve::<P>();
        changes
    }

    /// Moves the rod back to the conditions, by steps with the existing factors. Returns whether it succeeds.
    fn restore_conditions(&mut self, rod: &mut Rod, conditions: &Conditions, dense: &Dense) -> bool {
        let mut last = f64::INFINITY;
        for _ in 0..RESTORATIONS {
            self.locate(rod);
            let violation = self.violation();
            if violation <= RESTORED * self.length {
                return true;
            }
            if !(violation < 0.5 * last) {
                return violation <= ACCEPTED * self.length;
            }
            last = violation;
            for element in &mut self.system.elements {
                element.clear_gradient();
            }
            self.system.turns.fill(Vector3::zeros());
            let rhs = DVector::from_iterator(
                conditions.roles.len(),
                conditions.roles.iter().map(|role| match role {
                    Role::Fixed(site, d) => d.dot(&(self.sites[*site].position - self.sites[*site].target)),
                    _ => 0.0,
                }),
            );
            let changes = dense.solve(&rhs);
            self.border.load::<P>(self.system, &changes);
            self.system.solve::<P>();
            self.system.start.keep(rod);
            self.system.advance::<P>(rod, 1.0);
        }
        self.locate(rod);
        self.violation() <= ACCEPTED * self.length
    }

    /// Newton's iteration for the present targets.
    fn find(&mut self, rod: &mut Rod, bound: usize) -> Result<(), EquilibriumError> {
        let (mut last_shift, mut saddles, mut last, mut bowed) = (0.0, 0, f64::INFINITY, false);
        for _ in 0..bound {
            self.found.iterations += 1;
            self.apply(rod);
            self.locate(rod);
            self.apply(rod);
            let mut shift = 0.0;
            let (energy, inertia, conditions, dense) = loop {
                let assembled = self.assemble(rod, shift)?;
                if shift == 0.0 {
                    self.found.inertia = assembled.1;
                }
                if !self.stable || assembled.1.negative == 0 {
                    break assembled;
                }
                shift = if shift > 0.0 {
                    4.0 * shift
                } else if last_shift > 0.0 {
                    last_shift / 16.0
                } else {
                    0.1 * self.force.largest().max(f64::MIN_POSITIVE)
                };
            };
            if shift > 0.0 {
                last_shift = shift;
            }
            if !bowed && self.is_straight(&conditions) {
                bowed = true;
                let missing = conditions.residuals.iter().map(|x| x.abs()).fold(0.0, f64::max) / self.length;
                self.bow(rod, 2.0 * missing.sqrt());
                continue;
            }
            let applied: Vec<_> = self.sites.iter().map(|site| site.force + site.spring_force()).collect();
            let value = self.potential(rod, energy, &applied);
            self.found.energy = value;
            let violation = self.violation();
            let changes = self.step(&conditions, &dense);
            let turn = self.system.largest_turn();
            if !turn.is_finite() {
                return Err(EquilibriumError::NotFinite { what: "Newton step" });
            }
            if shift > 0.0 && turn < 1e-7 && turn > 0.25 * last || shift > 0.0 && turn < 1e-10 {
                // A saddle of the energy: the softest direction leads away from it.
                if saddles == SADDLES {
                    return Err(EquilibriumError::Unstable { negative: self.found.inertia.negative });
                }
                self.leave_saddle(rod, &conditions, &dense, saddles);
                saddles += 1;
                last = f64::INFINITY;
                continue;
            }
            if std::env::var("DBG").is_ok() {
                eprintln!(
                    "it {} turn {turn:.2e} shift {shift:.2e} viol {violation:.2e} inertia {:?} boosts {:?} value {value:e}",
                    self.found.iterations,
                    self.found.inertia,
                    self.boosts.len()
                );
            }
            let slope = self.slope(&applied, &conditions, &changes);
            self.weight = self.weight.max(2.0 * self.largest_reaction(&conditions, &changes));
            let predicted = slope - self.weight * violation;
            let merit = value + self.weight * violation;
            let mut from = Configuration::default();
            from.keep(rod);
            let step = (self.system.turns.clone(), self.system.steps.clone());
            let mut fraction = f64::min(1.0, LARGEST_TURN / turn);
            loop {
                self.system.start.keep(rod);
                self.system.advance::<P>(rod, fraction);
                if turn >= SMALL_TURN {
                    let mut stepped = Configuration::default();
                    stepped.keep(rod);
                    if !self.restore_conditions(rod, &conditions, &dense) {
                        stepped.restore(rod);
                    }
                }
                let energy = self.system.evaluate::<P>(rod, self.material, self.force);
                self.found.evaluations += 1;
                self.locate(rod);
                let trial = self.potential(rod, energy, &applied) + self.weight * self.violation();
                let slack = 1e-12 * (merit.abs() + self.force.largest() * self.length);
                let falls = trial <= merit + DECREASE * fraction * predicted + slack;
                if trial.is_finite() && (falls || turn < SMALL_TURN || !self.stable) {
                    break;
                }
                from.restore(rod);
                (self.system.turns, self.system.steps) = step.clone();
                if fraction * turn < 1e-9 {
                    return Err(self.not_found(turn));
                }
                fraction *= 0.5;
            }
            for (role, change) in conditions.roles.iter().zip(changes.iter()) {
                if let Role::Fixed(site, direction) = role {
                    self.sites[*site].force = self.sites[*site].force + direction * (fraction * change);
                }
            }
            // The inertia is that before the step, whose effect on an eigenvalue must not change its sign.
            let each = changes.iter().zip(&self.border.sizes);
            let changed = each.map(|(change, size)| (change * size).abs()).fold(0.0, f64::max) / self.length;
            let least = dense.eigen.eigenvalues.iter().map(|value| value.abs()).fold(f64::INFINITY, f64::min);
            let mut outdated = least > NEUTRAL && least < OUTDATED * (changed + turn);
            // The energy is that before the step, which may stretch the rod without a rotation.
            let stretches = changes.iter().enumerate().map(|(i, c)| (c * self.border.yields[(i, i)]).abs());
            outdated |= stretches.fold(0.0, f64::max) > ACCEPTED * self.length;
            if fraction == 1.0 && shift == 0.0 && turn < 1e-4 {
                // The next error is the square of the step.
                let ratio = (turn / last.min(1.0)).max(turn);
                let error = 4.0 * turn * ratio.min(1.0);
                // The places of a rod that stretches depend on the reactions.
                self.apply(rod);
                self.locate(rod);
                let apart = self.violation() > RESTORED * self.length;
                // Close to a loss of stability rounding rotates the frames in every iteration.
                let rounds = turn < STAGNANT
                    && !apart
                    && (0.25 * turn..STAGNANT).contains(&last)
                    && self.system.unbalanced <= BALANCED * self.force.largest() * self.length;
                if (error <= self.tolerance || turn < 1e-13) && !outdated && !apart || rounds {
                    self.found.error = if rounds { error.max(turn) } else { error };
                    if least < CLOSE || last.is_infinite() || self.found.inertia.negative > 0 {
                        // A step that is small for the shape may change the sign of an eigenvalue close to zero, and
                        // the reactions of a first iteration are those of the initial guess.
                        self.found.inertia = self.assemble(rod, 0.0)?.1;
                    }
                    if !self.stable || self.found.inertia.negative == 0 {
                        self.locate(rod);
                        self.apply(rod);
                        return Ok(());
                    }
                }
            }
            last = turn;
        }
        Err(self.not_found(last))
    }

    /// Whether the rod cannot move in a direction in which a hold has to move, to first order: a straight rod between
    /// two holds.
    fn is_straight(&self, conditions: &Conditions) -> bool {
        let flexible = |i: usize| self.border.gram[(i, i)].abs();
        // A rod that stretches moves in its own direction.
        let inextensible = |i: usize| self.border.yields[(i, i)] == 0.0;
        let largest = (0..conditions.roles.len()).map(flexible).fold(0.0, f64::max);
        let each = conditions.roles.iter().zip(&conditions.residuals).enumerate();
        let rigid = |(i, (role, missing)): (usize, (&Role, &f64))| {
            let rigid = flexible(i) < STRAIGHT * largest && inextensible(i);
            matches!(role, Role::Fixed(..)) && missing.abs() > 1e-12 * self.length && rigid
        };
        each.into_iter().any(rigid)
    }

    /// Bends a straight rod by up to `angle` (rad) towards its load, or towards d1 without one.
    fn bow(&mut self, rod: &mut Rod, angle: f64) {
        let tangent = (rod.tip() / self.length).try_normalize(1e-6).unwrap_or_else(|| rod.frames()[0] * Vector3::z());
        let load = self.force.load_at_base();
        let side = load - tangent * tangent.dot(&load);
        let side = side.try_normalize(1e-9 * load.norm()).unwrap_or_else(|| rod.frames()[0] * Vector3::x());
        let axis = tangent.cross(&side);
        let (length, mut at) = (self.length, 0.0);
        let places: Vec<f64> = (0..=rod.elements())
            .map(|e| {
                let s = at;
                at += if e < rod.elements() { rod.length_of(e) } else { 0.0 };
                s
            })
            .collect();
        let old = rod.clone();
        let (p, reference) = (P, rod.reference());
        let moved = |e: usize, x: f64| {
            let s = places[e] + x * (places[e + 1] - places[e]);
            so3::exp(&(axis * (angle * (std::f64::consts::TAU * s / length).sin()))) * old.frame_within(e, x)
        };
        let (_, rotations) = rod.shape_mut();
        for e in 0..old.elements() {
            let start = moved(e, 0.0).inverse();
            for k in 0..p {
                rotations[e * p + k] = so3::log(&(start * moved(e, reference.nodes[k + 1])));
            }
        }
        rod.chain_frames();
    }

    fn not_found(&self, step: f64) -> EquilibriumError {
        EquilibriumError::NoConvergence {
            iterations: self.found.iterations,
            step,
            residual: self.system.unbalanced,
            force: self.force.largest(),
        }
    }

    /// The derivative of the potential along the step.
    fn slope(&self, applied: &[Vector3<f64>], conditions: &Conditions, changes: &DVector<f64>) -> f64 {
        let mut slope = self.system.slope::<P>();
        // The gradient contains the reactions, whose work is that of the moved sites.
        let _ = changes;
        for (i, role) in conditions.roles.iter().enumerate() {
            if let Role::Fixed(site, direction) = role {
                slope -= direction.dot(&applied[*site]) * conditions.residuals[i];
            }
        }
        slope
    }

    fn largest_reaction(&self, conditions: &Conditions, changes: &DVector<f64>) -> f64 {
        let each = conditions.roles.iter().zip(changes.iter()).map(|(role, change)| match role {
            Role::Fixed(site, direction) => (direction.dot(&self.sites[*site].force) + change).abs(),
            _ => 0.0,
        });
        each.fold(0.0, f64::max)
    }

    /// Moves the rod along the softest direction that the supports permit.
    fn leave_saddle(&mut self, rod: &mut Rod, conditions: &Conditions, dense: &Dense, number: usize) {
        // Inverse iteration with the shifted tangent, from rotations about an axis.
        let axis = Vector3::ith([1, 0, 2, 1][number % 4], 1.0);
        let count = self.system.turns.len();
        let mut turns: Vec<Vector3<f64>> = (0..count).map(|i| axis * (i as f64 / count as f64 + 0.3).sin()).collect();
        let mut still = Conditions {
            columns: conditions.columns.clone(),
            roles: conditions.roles.clone(),
            diagonal: conditions.diagonal.clone(),
            residuals: vec![0.0; conditions.residuals.len()],
        };
        still.residuals.fill(0.0);
        for _ in 0..12 {
            let largest = turns.iter().map(Vector3::norm).fold(0.0, f64::max);
            for element in &mut self.system.elements {
                element.clear_gradient();
            }
            for (e, (to, turn)) in self.system.turns.iter_mut().zip(&turns).enumerate() {
                let length = if e > 0 { rod.length_of(e - 1) } else { 0.0 };
                *to = turn * (length / largest);
            }
            self.system.joints.confine(&mut self.system.turns);
            self.step(&still, dense);
            turns.clone_from(&self.system.turns);
        }
        self.system.start.keep(rod);
        let fraction = PUSH / self.system.largest_turn();
        self.system.advance::<P>(rod, fraction);
    }

    /// The reactions at the equilibrium.
    fn reactions(&self, rod: &Rod) -> Vec<Reaction> {
        let line: Vec<f64> = rod.centre_line().iter().map(|(s, _)| *s).collect();
        let reaction = |node: usize, force, couple| Reaction {
            arc_length: line[node],
            initial_apex_distance: if node == 0 {
                rod.initial_length()
            } else {
                rod.initial_apex_distance(node - 1, 1.0)
            },
            force,
            couple,
            length: 0.0,
            obstacle: None,
            normal: 0.0,
            slip: None,
        };
        let zero = Vector3::zeros();
        let mut all: Vec<Reaction> = Vec::new();
        for site in &self.sites {
            all.push(reaction(site.element + 1, site.force + site.spring_force(), zero));
        }
        let joints = &self.system.joints;
        let mut couples = Vec::new();
        for ((node, _), held) in joints.confined.iter().zip(&joints.held) {
            // The couple of the support balances the rod's.
            couples.push((*node, -held));
        }
        for ((node, ..), couple) in joints.elastic.iter().zip(&joints.couples) {
            couples.push((*node, *couple));
        }
        for (node, along) in couples {
            let couple = rod.frames()[node] * along;
            match all.iter_mut().find(|at| at.arc_length == line[node]) {
                Some(at) => at.couple = couple,
                None => all.push(reaction(node, zero, couple)),
            }
        }
        all
    }
}

/// The part of a vector along some orthonormal vectors.
fn project(directions: &[Vector3<f64>], vector: &Vector3<f64>) -> Vector3<f64> {
    directions.iter().map(|d| d * d.dot(vector)).sum()
}

/// Returns an error for a bad tolerance.
pub(in crate::equilibrium) fn check_tolerance(tolerance: f64) -> Result<(), ParameterError> {
    ParameterError::positive("tolerance of the equilibrium", tolerance)
}
