//! Newton's method for a rod with supports.

use nalgebra::{DMatrix, DVector, Dyn, LU, SymmetricEigen, Vector3};

use super::border::{Basis, Border, Column, upto_parts};
use super::friction::{Before, OldTouch};
use super::sites::{Friction, HeldFrame, Site, sort, turn_frames};
use super::touch::{Obstacles, all_stations, largest_share, place};
use crate::constitutive::{Constitutive, line_strain_under};
use crate::equilibrium::system::{Configuration, System};
use crate::equilibrium::{Equilibrium, EquilibriumError, Inertia};
use crate::load::{InternalForce, Load, PointReaction};
use crate::rod::{Rod, Tissue};
use crate::so3;
use crate::support::{Patch, Reaction, Slip, Support};

/// Largest rotation of a frame in a step, rad.
const LARGEST_TURN: f64 = 0.5;
/// Largest rotation of a frame in a Newton step that is shortened to `LARGEST_TURN`, rad. For a longer one the tangent is
/// almost singular, and is shifted.
const LONGEST_STEP: f64 = 10.0;
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
/// Rotation in a step below which the steps are expected to converge, rad.
const CLOSE_TURN: f64 = 0.02;
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
/// Largest number of steps by which a contact slides to the place of least gap.
const SLIDES: usize = 8;
/// Distance from the place of least gap that is attributed to rounding, relative to the length.
const LEVEL: f64 = 1e-14;
/// Largest number of changes of the contacts in a step.
const CONTACT_CHANGES: usize = 60;
/// Compliance of a contact that sticks, relative to that of the rod to a force on its apex.
const STICKINESS: f64 = 1e-9;
/// Smallest flexibility of a hold, relative to the largest, with which it moves to first order.
const STRAIGHT: f64 = 1e-6;

/// Memory of a search.
#[derive(Debug, Default)]
pub(crate) struct HeldWorkspace {
    border: Border,
}

/// A search for an equilibrium of a rod with supports.
pub(in crate::equilibrium) struct HeldSearch<'a, C, L, const P: usize> {
    pub(super) system: &'a mut System,
    pub(super) border: &'a mut Border,
    pub(super) material: &'a C,
    pub(super) load: &'a L,
    pub(super) force: &'a mut InternalForce,
    /// The rod without additional nodes at contacts.
    pub(super) parent: &'a Rod,
    pub(super) obstacles: Obstacles<'a>,
    /// Tangents ∂p/∂s of the centre line at the material points.
    pub(super) tangents: Vec<Vector3<f64>>,
    /// Whether steps are not blocked by obstacles.
    pub(super) frozen: bool,
    /// The rod at the end of the increment before, with the time since then (s). Friction depends on the displacement.
    pub(super) before: Before<'a>,
    /// Whether the equilibrium has to be stable.
    stable: bool,
    tolerance: f64,
    pub(super) length: f64,
    pub(super) sites: Vec<Site>,
    pub(super) frames: Vec<HeldFrame>,
    /// Largest force of a reaction per unit of violated condition: the weight of the conditions in the merit.
    weight: f64,
    boosts: Vec<(usize, f64)>,
    /// Largest energy so far over the length, N: the magnitude of the reactions on a rod without load.
    energy_scale: f64,
    /// Factor by which penetrations and slopes at contacts may be larger after many changes of the contacts.
    pub(super) leniency: f64,
    found: Equilibrium,
}

/// The matrix of the reactions, D − Bᵀ K⁻¹ B, scaled to a diagonal of the order of one and diagonalised.
struct Dense {
    scale: DVector<f64>,
    eigen: SymmetricEigen<f64, Dyn>,
    /// Factors of the matrix with friction that slides, which is not symmetric.
    coupled: Option<LU<f64, Dyn, Dyn>>,
}

impl Dense {
    fn of(dense: &DMatrix<f64>, scale: DVector<f64>, coupled: Option<DMatrix<f64>>) -> Self {
        let n = scale.len();
        let scaled = |m: DMatrix<f64>| DMatrix::from_fn(n, n, |i, j| m[(i, j)] * scale[i] * scale[j]);
        let coupled = coupled.map(|coupled| scaled(coupled).lu());
        let scaled = DMatrix::from_fn(n, n, |i, j| dense[(i, j)] * scale[i] * scale[j]);
        let eigen = if n > 0 {
            SymmetricEigen::new(scaled)
        } else {
            SymmetricEigen { eigenvectors: scaled, eigenvalues: DVector::zeros(0) }
        };
        Self { scale, eigen, coupled }
    }

    /// Solves for the reactions. Neutral directions keep their reactions.
    fn solve(&self, rhs: &DVector<f64>) -> DVector<f64> {
        if let Some(coupled) = &self.coupled {
            let scaled = rhs.component_mul(&self.scale);
            let unknown = || DVector::from_element(rhs.len(), f64::NAN);
            return coupled.solve(&scaled).unwrap_or_else(unknown).component_mul(&self.scale);
        }
        let mut y = self.eigen.eigenvectors.tr_mul(&rhs.component_mul(&self.scale));
        for (y, value) in y.iter_mut().zip(self.eigen.eigenvalues.iter()) {
            *y = if value.abs() <= NEUTRAL { 0.0 } else { *y / value };
        }
        (&self.eigen.eigenvectors * y).component_mul(&self.scale)
    }
}

/// Conditions of the reactions at one iteration: rows of T and D, and right-hand sides.
struct Conditions {
    /// Linear functions of the rotations.
    columns: Vec<Column>,
    /// The combination of them that each condition contains.
    parts: Basis,
    /// What each condition belongs to.
    roles: Vec<Role>,
    /// Diagonal of D.
    diagonal: Vec<f64>,
    /// Violated distances, m.
    residuals: Vec<f64>,
    /// The combinations of conditions that are solved for. Those of neighbouring contacts are divided differences,
    /// which couple only neighbours.
    basis: Basis,
}

impl Conditions {
    /// The values of the combinations.
    fn combine(&self, values: &[f64]) -> DVector<f64> {
        let sum = |combination: &Vec<(usize, f64)>| combination.iter().map(|(i, factor)| factor * values[*i]).sum();
        DVector::from_iterator(self.basis.len(), self.basis.iter().map(sum))
    }

    /// The combinations that are solved for, in terms of the columns.
    fn composed(&self, parts: &Basis) -> Basis {
        let compose = |combination: &Vec<(usize, f64)>| {
            let each = combination.iter().flat_map(|(i, factor)| parts[*i].iter().map(move |(c, f)| (*c, f * factor)));
            each.collect()
        };
        self.basis.iter().map(compose).collect()
    }

    /// The changes of the normal and of the tangential forces of contacts that stick.
    fn sticking(&self, changes: &DVector<f64>) -> Vec<(usize, f64, Vector3<f64>)> {
        let mut all: Vec<(usize, f64, Vector3<f64>)> = Vec::new();
        for (role, change) in self.roles.iter().zip(changes.iter()) {
            match role {
                Role::Fixed(site, _) => all.push((*site, *change, Vector3::zeros())),
                Role::Stick(site, direction) => {
                    if let Some((.., force)) = all.iter_mut().find(|(other, ..)| other == site) {
                        *force += direction * *change;
                    }
                }
                _ => {}
            }
        }
        all
    }

    /// The reactions to the conditions, given those to the combinations.
    fn distribute(&self, reactions: &DVector<f64>) -> DVector<f64> {
        let mut sum = DVector::zeros(reactions.len());
        for (combination, reaction) in self.basis.iter().zip(reactions.iter()) {
            combination.iter().for_each(|(i, factor)| sum[*i] += factor * reaction);
        }
        sum
    }
}

/// A step with the contacts that it keeps and gains.
struct ContactStep {
    /// Energy of the rod before the step, J.
    energy: f64,
    inertia: Inertia,
    conditions: Conditions,
    dense: Dense,
    changes: DVector<f64>,
    /// The fraction of the step that is safe.
    fraction: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Role {
    /// Component of the force of a hold: site and direction.
    Fixed(usize, Vector3<f64>),
    /// Spring, or another stiffness.
    Spring,
    /// Tangential component of a force of friction: site and direction.
    Stick(usize, Vector3<f64>),
    /// Motion of the place of a contact along the rod: site, and factor of the motion, m.
    Slide(usize, f64),
    /// Increase of a pivot, or another negative stiffness.
    Boost,
}

impl<'a, C: Constitutive, L: Load, const P: usize> HeldSearch<'a, C, L, P> {
    pub fn new(
        (system, workspace): (&'a mut System, &'a mut HeldWorkspace),
        rod: &'a Rod,
        (material, load): (&'a C, &'a L),
        force: &'a mut InternalForce,
        support: &'a impl Support,
        (stable, tolerance): (bool, f64),
    ) -> Result<Self, EquilibriumError> {
        let time = force.environment().time;
        let contacts = support.contacts();
        let compliances = contacts.iter().map(|contact| contact.obstacle.compliance()).collect();
        let obstacles = Obstacles { yielded: vec![Vector3::zeros(); contacts.len()], compliances, contacts, time };
        let (sites, frames) = sort(rod, support.base(), &support.holds(time), &mut system.joints)?;
        Ok(Self {
            system,
            border: &mut workspace.border,
            material,
            load,
            force,
            parent: rod,
            obstacles,
            tangents: Vec::new(),
            frozen: false,
            before: Before::new(rod, 0.0),
            stable,
            tolerance,
            length: rod.length(),
            sites,
            frames,
            weight: 0.0,
            boosts: Vec::new(),
            energy_scale: 0.0,
            leniency: 1.0,
            found: Equilibrium::default(),
        })
    }

    /// Sets the rod at the end of the increment before, and the time since then (s).
    pub fn since(&mut self, before: &'a Rod, time: f64) {
        self.before = Before::new(before, time);
    }

    /// Takes the forces of an earlier equilibrium as initial guess.
    pub fn guess_forces(&mut self, reactions: &[Reaction]) {
        for (site, reaction) in self.sites.iter_mut().zip(reactions.iter().filter(|at| at.obstacle.is_none())) {
            site.force = reaction.force;
        }
    }

    /// Takes the forces and contacts of an earlier equilibrium as initial guess.
    pub fn guess(&mut self, rod: &mut Rod, (reactions, patches): (&[Reaction], &[Patch])) {
        self.guess_forces(reactions);
        let number = self.obstacles.contacts.len();
        let mut inside: Vec<Patch> = patches.iter().filter(|patch| patch.obstacle < number).copied().collect();
        for patch in &mut inside {
            (patch.from, patch.to) = (patch.from.min(self.length), patch.to.min(self.length));
        }
        if !inside.is_empty() {
            self.locate(rod);
            // The end of a longer contact has two reactions.
            let mut pushes: Vec<OldTouch> = Vec::new();
            for at in reactions {
                let Some(obstacle) = at.obstacle else { continue };
                let same = |old: &&mut OldTouch| old.obstacle == obstacle && old.arc_length == at.arc_length;
                match pushes.iter_mut().find(same) {
                    Some(old) => (old.push, old.force) = (old.push + at.normal, old.force + at.force),
                    None => {
                        pushes.push(OldTouch { obstacle, arc_length: at.arc_length, push: at.normal, force: at.force })
                    }
                }
            }
            self.arrange(rod, &inside, pushes);
        }
    }

    /// Moves the holds from their present places to the requested ones in increments, each of which ends in
    /// equilibrium.
    pub fn run(
        mut self,
        rod: &mut Rod,
        bound: usize,
    ) -> Result<(Equilibrium, Vec<Reaction>, Vec<Patch>), EquilibriumError> {
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
        while done < 1.0 {
            let next = if done + share > 1.0 - 1e-9 { 1.0 } else { done + share };
            let before = (rod.clone(), self.sites.clone(), self.frames.clone(), self.system.joints.clone());
            for ((site, start), goal) in self.sites.iter_mut().zip(&starts).zip(&goals) {
                site.target = start + (goal - start) * next;
            }
            self.turn_held(rod, (next - done) / (1.0 - done));
            match self.settle(rod, bound.min(ITERATIONS)) {
                Ok(()) => done = next,
                Err(error) if error.is_recoverable() && share > SMALLEST_SHARE && done + share > done => {
                    (*rod, self.sites, self.frames, self.system.joints) = before;
                    self.force.update(rod, self.load, &self.force.environment().clone());
                    share *= 0.5;
                    if number == 1.0 && far == 0.0 && turned == 0.0 {
                        return Err(error);
                    }
                }
                Err(error) => return Err(error),
            }
        }
        let (reactions, patches) = (self.reactions(rod), self.patches(rod, 0.0));
        Ok((self.found, reactions, patches))
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
    pub(super) fn locate(&mut self, rod: &Rod) {
        let time = self.force.environment().time;
        self.tangents.clear();
        self.tangents.extend((0..rod.points().len()).map(|i| {
            let frame = rod.frame_at_point(i / P, i % P);
            let tissue = Tissue::of(&rod.points()[i], time);
            frame * line_strain_under(self.material, &tissue, &frame, &self.force.at_points()[i])
        }));
        let mut starts = vec![Vector3::zeros()];
        for e in 0..rod.elements() {
            starts.push(place(rod, &self.tangents, (e, 1.0), 0.0, &starts[e]).position);
        }
        self.obstacles.yield_to(&self.sites);
        for site in &mut self.sites {
            for last in (0..=SLIDES).map(|slides| slides == SLIDES) {
                site.position = place(rod, &self.tangents, (site.element, site.x), 0.0, &starts[site.element]).position;
                let Some(touch) = &mut site.touch else { break };
                touch.gap = self.obstacles.gap(touch.obstacle, &site.position);
                let frame = rod.frame_within(site.element, site.x);
                let bend = frame * rod.strain_within(site.element, site.x).cross(&Vector3::z());
                let (tangent, gap) = (frame * Vector3::z(), &touch.gap);
                let (slope, bend) =
                    (gap.normal.dot(&tangent), gap.normal.dot(&bend) + tangent.dot(&(gap.curvature * tangent)));
                (touch.tangent, touch.approach) = (tangent, (slope, bend));
                if last || !touch.floats || !(bend > 0.0) || slope.abs() <= LEVEL * bend * self.length {
                    break;
                }
                slide(rod, site, -slope / bend);
                if site.element + 1 == rod.elements() && site.x >= 1.0 {
                    // The gap is least at the apex, where it is not stationary.
                    site.touch.iter_mut().for_each(|touch| touch.floats = false);
                }
            }
            if let Some(touch) = &mut site.touch {
                site.force = touch.gap.normal * touch.push;
                let coefficient = self.obstacles.contacts[touch.obstacle].friction;
                if coefficient > 0.0 {
                    let material = rod.initial_apex_distance(site.element, site.x);
                    let anchor = self.before.anchor(material, &self.obstacles, touch.obstacle);
                    let friction = touch.friction.get_or_insert_with(|| Friction::new(coefficient));
                    friction.locate(&touch.gap.normal, &(site.position - anchor), touch.push);
                    site.force += friction.force;
                }
            }
        }
    }

    /// Applies the present reactions to the rod.
    pub(super) fn apply(&mut self, rod: &Rod) {
        let reactions = self.sites.iter().map(|site| PointReaction {
            element: site.element,
            x: site.x,
            force: site.force + site.spring_force(),
            couple: Vector3::zeros(),
        });
        self.force.set_reactions(rod, reactions);
    }

    /// Energy of the rod, its loads and springs (J), at the last evaluation, which returned `energy`.
    /// `applied` are the forces in it and the places at which they act.
    fn potential(&mut self, rod: &Rod, energy: f64, applied: &[(Vector3<f64>, (usize, f64))]) -> f64 {
        let joints = self.system.joints.stretch(rod);
        let springs: f64 = self.sites.iter().map(Site::spring_energy).sum();
        let work = |(force, at): &(Vector3<f64>, _)| force.dot(&self.place_of(rod, *at).position);
        energy + joints + springs + applied.iter().map(work).sum::<f64>()
    }

    /// Magnitude of the force in the rod, N: without load the energy per length.
    pub(super) fn force_scale(&self) -> f64 {
        self.force.largest().max(self.energy_scale).max(f64::MIN_POSITIVE)
    }

    fn violation(&self) -> f64 {
        self.sites.iter().flat_map(Site::missing).map(|(_, distance)| distance.abs()).sum()
    }

    fn conditions(&self) -> Conditions {
        let mut conditions = Conditions {
            columns: Vec::new(),
            parts: Vec::new(),
            roles: Vec::new(),
            diagonal: Vec::new(),
            residuals: Vec::new(),
            basis: Vec::new(),
        };
        let mut add = |columns: &[(Column, f64)], role, diagonal, residual| {
            let first = conditions.columns.len();
            conditions.parts.push(columns.iter().enumerate().map(|(i, (_, factor))| (first + i, *factor)).collect());
            conditions.columns.extend(columns.iter().map(|(column, _)| *column));
            conditions.roles.push(role);
            conditions.diagonal.push(diagonal);
            conditions.residuals.push(residual);
        };
        let floor = 1e-9 * self.force_scale();
        let stickiness = STICKINESS * self.length.powi(2) * self.system.compliance();
        for (i, site) in self.sites.iter().enumerate() {
            let (element, x) = (site.element, site.x);
            let place = |direction| Column::Place { element, x, direction };
            for (direction, residual) in site.missing() {
                add(&[(place(direction), 1.0)], Role::Fixed(i, direction), 0.0, residual);
            }
            if let Some((touch, friction)) = site.touch.as_ref().and_then(|touch| Some((touch, touch.friction?))) {
                if friction.sticks {
                    // A tiny compliance determines the forces of contacts that an inextensible rod connects.
                    let lag = friction.force - friction.earlier;
                    for direction in touch.tangential() {
                        let residual = direction.dot(&(friction.slip + lag * stickiness));
                        add(&[(place(direction), 1.0)], Role::Stick(i, direction), -stickiness, residual);
                    }
                } else {
                    // The force turns with the direction of the slip: a stiffness μ λ/|Δ| across it.
                    let sideways = touch.gap.normal.cross(&friction.direction);
                    let stiffness = friction.coefficient * touch.push / friction.slip.norm();
                    if stiffness > 0.0 && stiffness.is_finite() {
                        add(&[(place(sideways), stiffness.sqrt())], Role::Spring, -1.0, 0.0);
                    }
                }
            }
            if let Some(touch) = &site.touch {
                // The normal force turns with the normal: a stiffness −λ ∇²g.
                let eigen = touch.gap.curvature.symmetric_eigen();
                for (along, value) in eigen.eigenvectors.column_iter().zip(eigen.eigenvalues.iter()) {
                    let stiffness = -touch.push * value;
                    if stiffness != 0.0 {
                        let role = if stiffness > 0.0 { Role::Spring } else { Role::Boost };
                        let column = (place(along.into_owned()), stiffness.abs().sqrt());
                        add(&[column], role, -stiffness.signum(), 0.0);
                    }
                }
                let (slope, bend) = touch.approach;
                if touch.floats && bend > 0.0 {
                    // The place moves along the rod so that the gap stays least: a stiffness λ/g″ (docs/method.md).
                    let factor = (touch.push.max(floor) / bend).sqrt();
                    let turns = Column::Tangent { element, x, direction: touch.gap.normal };
                    let bends = place(touch.gap.curvature * touch.tangent);
                    let columns = [(turns, factor), (bends, factor)];
                    add(&columns, Role::Slide(i, 1.0 / (factor * bend)), -1.0, factor * slope);
                }
            }
            for (along, stiffness) in &site.springs {
                add(&[(place(*along), stiffness.sqrt())], Role::Spring, -1.0, 0.0);
            }
        }
        for (unknown, increase) in &self.boosts {
            // The unknown is scaled so that its diagonal entry is one.
            add(&[(Column::Turn { unknown: *unknown }, 1.0)], Role::Boost, 1.0 / increase, 0.0);
        }
        conditions.basis = self.differences(&conditions.roles);
        conditions
    }

    /// Divided differences of the gaps at the contacts with each obstacle along the rod, up to the second; the other
    /// conditions as they are.
    fn differences(&self, roles: &[Role]) -> Basis {
        let mut basis: Basis = (0..roles.len()).map(|i| vec![(i, 1.0)]).collect();
        for obstacle in 0..self.obstacles.contacts.len() {
            let mut along: Vec<(f64, usize)> = Vec::new();
            for (i, role) in roles.iter().enumerate() {
                if let Role::Fixed(site, _) = role
                    && self.sites[*site].touch.is_some_and(|touch| touch.obstacle == obstacle)
                {
                    along.push((self.sites[*site].element as f64 + self.sites[*site].x, i));
                }
            }
            along.sort_by(|a, b| a.0.total_cmp(&b.0));
            for k in 1..along.len() {
                let (s, i) = along[k];
                let (before, j) = along[k - 1];
                let slope = 1.0 / (s - before).max(1e-9);
                let mut difference = vec![(i, slope), (j, -slope)];
                if k > 1 {
                    let (first, l) = along[k - 2];
                    let slope = 1.0 / (before - first).max(1e-9);
                    difference[1].1 -= slope;
                    difference.push((l, slope));
                }
                basis[i] = difference;
            }
        }
        basis
    }

    /// The columns of the reactions if contacts slide: the friction follows the normal force. `None` if none does.
    fn sliding(&self, conditions: &mut Conditions) -> Option<Basis> {
        let mut acts = conditions.parts.clone();
        let mut slides = false;
        for (i, role) in conditions.roles.iter().enumerate() {
            if let Role::Fixed(at, _) = role
                && let Site { element, x, touch: Some(touch), .. } = self.sites[*at]
                && let Some(friction) = touch.friction.filter(|friction| !friction.sticks)
            {
                slides = true;
                acts[i].push((conditions.columns.len(), -friction.coefficient));
                conditions.columns.push(Column::Place { element, x, direction: friction.direction });
            }
        }
        // The point at which friction acts moves along the rod with the contact.
        for (i, role) in conditions.roles.iter().enumerate() {
            if let Role::Slide(at, factor) = role
                && let Site { element, x, touch: Some(touch), .. } = self.sites[*at]
                && let Some(friction) = touch.friction
            {
                slides = true;
                acts[i].push((conditions.columns.len(), *factor));
                conditions.columns.push(Column::Tangent { element, x, direction: friction.force });
            }
        }
        slides.then_some(acts)
    }

    /// Second derivatives of the energy by the reactions, from obstacles that yield: −dᵢ S dⱼ for forces along dᵢ and
    /// dⱼ on an obstacle of compliance S.
    fn yields_of_obstacles(&self, conditions: &Conditions) -> DMatrix<f64> {
        let n = conditions.roles.len();
        let acting = |role: &Role| match role {
            Role::Fixed(site, d) | Role::Stick(site, d) => Some((self.sites[*site].touch?.obstacle, *d)),
            _ => None,
        };
        let each: Vec<_> = conditions.roles.iter().map(acting).collect();
        let plain = DMatrix::from_fn(n, n, |i, j| match (each[i], each[j]) {
            (Some((a, d)), Some((b, e))) if a == b => -d.dot(&(self.obstacles.compliances[a] * e)),
            _ => 0.0,
        });
        if plain.iter().all(|value| *value == 0.0) {
            return plain;
        }
        let mut basis = DMatrix::<f64>::zeros(n, n);
        for (i, combination) in conditions.basis.iter().enumerate() {
            combination.iter().for_each(|(j, factor)| basis[(i, *j)] += factor);
        }
        &basis * plain * basis.transpose()
    }

    /// Assembles and factorises the tangent with a shift. Returns the energy (J) and the signs of its pivots.
    fn factorise(&mut self, rod: &Rod, shift: f64) -> Result<(f64, Inertia), EquilibriumError> {
        let (energy, mut inertia) = self.system.condense::<P>(rod, self.material, self.force, shift)?;
        let joints = self.system.joints.clone();
        joints.apply(&mut self.system.tangent, rod);
        self.system.joints.stretch(rod);
        self.system.tangent.factorise_boosted(&mut inertia, &mut self.boosts)?;
        self.found.factorisations += 1 + self.boosts.len();
        self.energy_scale = self.energy_scale.max(energy.abs() / self.length);
        if energy.is_finite() { Ok((energy, inertia)) } else { Err(EquilibriumError::NotFinite { what: "energy" }) }
    }

    /// Computes the matrix of the reactions for the factorised tangent, whose pivots have the signs `inertia`. Returns
    /// it with the inertia on the directions that the conditions permit.
    fn close(&mut self, rod: &Rod, mut inertia: Inertia) -> Result<(Inertia, Conditions, Dense), EquilibriumError> {
        let conditions = self.conditions();
        let (mut conditions, mut dense) = (conditions, DMatrix::zeros(0, 0));
        let acts = self.sliding(&mut conditions);
        let basis = conditions.composed(&conditions.parts);
        let acts = acts.map(|acts| conditions.composed(&acts));
        let (columns, force) = (&conditions.columns, &*self.force);
        self.border.assemble::<P>(self.system, rod, self.material, force, columns, &basis, acts.as_ref());
        let yields = &self.border.yields + self.yields_of_obstacles(&conditions);
        dense.clone_from(&(&yields - &self.border.gram));
        let mut coupled = yields - &self.border.coupling;
        for (i, d) in conditions.diagonal.iter().enumerate() {
            dense[(i, i)] += d;
            coupled[(i, i)] += d;
        }
        // The bordered matrix has one negative eigenvalue for every condition and every spring.
        let scale = DVector::from_fn(dense.nrows(), |i, _| {
            1.0 / (self.border.sizes[i] - self.border.yields[(i, i)] + conditions.diagonal[i].abs())
                .sqrt()
                .max(f64::MIN_POSITIVE)
        });
        let finite = dense.iter().all(|value| value.is_finite());
        if !finite {
            return Err(EquilibriumError::NotFinite { what: "tangent" });
        }
        let dense = Dense::of(&dense, scale, acts.is_some().then_some(coupled));
        let expected = conditions.roles.iter().filter(|role| **role != Role::Boost).count();
        let positive = conditions.roles.len() - expected;
        let mut negative = inertia.negative;
        let mut above = inertia.positive;
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
        Ok((inertia, conditions, dense))
    }

    /// The inertia at the present configuration.
    pub fn inertia(mut self, rod: &Rod) -> Result<Inertia, EquilibriumError> {
        self.locate(rod);
        self.apply(rod);
        let (_, inertia) = self.factorise(rod, 0.0)?;
        self.close(rod, inertia).map(|(inertia, ..)| inertia)
    }

    /// Solves for the step of rotations and reactions. Returns the changes of the reactions.
    fn step(&mut self, conditions: &Conditions, dense: &Dense) -> DVector<f64> {
        self.system.balance::<P>();
        self.respond(conditions, dense)
    }

    /// Solves for the response to the unbalanced couples and the violated conditions.
    fn respond(&mut self, conditions: &Conditions, dense: &Dense) -> DVector<f64> {
        let free = self.border.step::<P>(self.system);
        let rhs = free + conditions.combine(&conditions.residuals);
        let changes = dense.solve(&rhs);
        self.border.load::<P>(self.system, &changes);
        self.system.solve::<P>();
        conditions.distribute(&changes)
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
            let mut missing = self.sites.iter().flat_map(Site::missing).map(|(_, distance)| distance);
            let missing = conditions.roles.iter().map(|role| match role {
                Role::Fixed(..) => missing.next().unwrap_or(0.0),
                _ => 0.0,
            });
            let missing: Vec<f64> = missing.collect();
            let changes = dense.solve(&conditions.combine(&missing));
            self.border.load::<P>(self.system, &changes);
            self.system.solve::<P>();
            self.system.start.keep(rod);
            self.system.advance::<P>(rod, 1.0);
        }
        self.locate(rod);
        self.violation() <= ACCEPTED * self.length
    }

    /// Solves for the step with the contacts that it keeps, gains and loses. Returns the fraction of it that is safe.
    fn step_with_contacts(&mut self, rod: &mut Rod, shift: f64) -> Result<ContactStep, EquilibriumError> {
        let (mut energy, mut pivots) = self.factorise(rod, shift)?;
        let mut from = Configuration::default();
        for change in 0..CONTACT_CHANGES {
            let (inertia, conditions, dense) = self.close(rod, pivots)?;
            let changes = self.step(&conditions, &dense);
            let turn = self.system.largest_turn();
            let mut fraction = f64::min(1.0, LARGEST_TURN / turn);
            if !self.approaches() || !turn.is_finite() {
                return Ok(ContactStep { energy, inertia, conditions, dense, changes, fraction });
            }
            // Contacts that would pull are lost.
            let mut pulling: Vec<usize> = Vec::new();
            for (role, by) in conditions.roles.iter().zip(changes.iter()) {
                if let Role::Fixed(site, _) = role
                    && let Some(touch) = self.sites[*site].touch
                    && touch.push + by < 0.0
                {
                    pulling.push(*site);
                }
            }
            let sticking = conditions.sticking(&changes);
            let number = pulling.len();
            pulling.retain(|site| !self.slips_instead(*site, &sticking));
            if pulling.len() < number {
                self.apply(rod);
                (energy, pivots) = self.factorise(rod, shift)?;
                continue;
            }
            if !pulling.is_empty() {
                pulling.sort_unstable();
                let mut loaded = false;
                for site in pulling.iter().rev() {
                    loaded |= self.sites.remove(*site).touch.is_some_and(|touch| touch.push != 0.0);
                }
                if loaded {
                    self.apply(rod);
                    (energy, pivots) = self.factorise(rod, shift)?;
                }
                continue;
            }
            from.keep(rod);
            let before = all_stations(rod, &self.tangents);
            self.system.start.keep(rod);
            self.system.advance::<P>(rod, fraction);
            self.locate(rod);
            let share = largest_share(&self.obstacles, &before, &all_stations(rod, &self.tangents));
            if share < 1.0 {
                fraction *= share;
                from.restore(rod);
                self.system.advance::<P>(rod, fraction);
                self.locate(rod);
            }
            let penetrations = self.penetrations(rod);
            from.restore(rod);
            self.locate(rod);
            // Contacts may be lost and found again in turn, since the rod does not follow the linear step exactly. Then
            // contacts are only lost, and the next step finds those that are missing.
            if change > CONTACT_CHANGES / 2 || !self.touch(rod, &penetrations, false) {
                return Ok(ContactStep { energy, inertia, conditions, dense, changes, fraction });
            }
            self.locate(rod);
            self.merge_sites(rod);
        }
        Err(self.not_found(f64::NAN))
    }

    /// Newton's iteration for the present targets.
    pub(super) fn find(&mut self, rod: &mut Rod, bound: usize) -> Result<(), EquilibriumError> {
        let (mut last_shift, mut saddles, mut last, mut bowed) = (0.0, 0, f64::INFINITY, false);
        for _ in 0..bound {
            self.found.iterations += 1;
            self.apply(rod);
            self.locate(rod);
            self.settle_apex(rod);
            self.merge_sites(rod);
            for touch in self.sites.iter_mut().filter_map(|site| site.touch.as_mut()) {
                // Where the gap is not least along the rod, the contact does not slide.
                touch.floats &= touch.approach.1 > 0.0;
            }
            self.apply(rod);
            let mut shift = 0.0;
            let ContactStep { energy, conditions, dense, changes, fraction, .. } = loop {
                let step = self.step_with_contacts(rod, shift)?;
                if shift == 0.0 {
                    self.found.inertia = step.inertia;
                }
                let far = self.system.largest_turn() > LONGEST_STEP;
                if !self.stable || step.inertia.negative == 0 && !far {
                    break step;
                }
                shift = if shift > 0.0 {
                    4.0 * shift
                } else if last_shift > 0.0 {
                    last_shift / 16.0
                } else {
                    0.1 * self.force_scale()
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
            let apply = |site: &Site| (site.force + site.spring_force(), (site.element, site.x));
            let applied: Vec<_> = self.sites.iter().map(apply).collect();
            let value = self.potential(rod, energy, &applied);
            self.found.energy = value;
            let violation = self.violation();
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
            let slope = self.slope(&applied, &conditions, &changes);
            // Reactions far from the equilibrium may be much larger than those in it.
            self.weight = (0.25 * self.weight).max(2.0 * self.largest_reaction(&conditions, &changes));
            let predicted = slope - self.weight * violation;
            let merit = value + self.weight * violation;
            let mut from = Configuration::default();
            from.keep(rod);
            let step = (self.system.turns.clone(), self.system.steps.clone());
            // Close to the equilibrium a step that is much shorter than the last one needs no line search. The merit does
            // not decrease there if the elements resolve a contact poorly.
            let converges = shift == 0.0 && turn < CLOSE_TURN && (turn < 0.25 * last || predicted > 0.0);
            let mut fraction = fraction;
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
                let value = self.potential(rod, energy, &applied);
                let trial = value + self.weight * self.violation();
                let slack = 1e-12 * (merit.abs() + self.force_scale() * self.length);
                let falls = trial <= merit + DECREASE * fraction * predicted + slack;
                if trial.is_finite() && (falls || turn < SMALL_TURN || converges || !self.stable || self.has_friction())
                {
                    self.found.energy = value;
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
                if let Role::Stick(site, direction) = role
                    && let Some(friction) = self.sites[*site].touch.as_mut().and_then(|touch| touch.friction.as_mut())
                {
                    friction.force += direction * (fraction * change);
                }
                if let Role::Fixed(site, direction) = role {
                    let site = &mut self.sites[*site];
                    match &mut site.touch {
                        Some(touch) => touch.push += fraction * change,
                        None => site.force += direction * (fraction * change),
                    }
                }
            }
            if self.regulate_friction(rod, turn) {
                last = f64::INFINITY;
                continue;
            }
            // The inertia is that before the step, whose effect on an eigenvalue must not change its sign.
            let held = |role: &Role| matches!(role, Role::Fixed(site, _) if self.sites[*site].touch.is_none());
            let each = conditions.roles.iter().zip(changes.iter().zip(&self.border.sizes));
            let each = each.filter(|(role, _)| held(role)).map(|(_, (change, size))| (change * size).abs());
            let changed = each.fold(0.0, f64::max) / self.length;
            let least = dense.eigen.eigenvalues.iter().map(|value| value.abs()).fold(f64::INFINITY, f64::min);
            let mut outdated = least > NEUTRAL && least < OUTDATED * (changed + turn);
            // The energy is that before the step, which may stretch the rod without a rotation.
            let stretches = (0..changes.len()).map(|i| (changes[i] * self.border.yields[(i, i)]).abs());
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
                        let (_, pivots) = self.factorise(rod, 0.0)?;
                        self.found.inertia = self.close(rod, pivots)?.0;
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

    pub(super) fn not_found(&self, step: f64) -> EquilibriumError {
        EquilibriumError::NoConvergence {
            iterations: self.found.iterations,
            step,
            residual: self.system.unbalanced,
            force: self.force.largest(),
        }
    }

    /// The derivative of the potential along the step.
    fn slope(&self, applied: &[(Vector3<f64>, (usize, f64))], conditions: &Conditions, changes: &DVector<f64>) -> f64 {
        let mut slope = self.system.slope::<P>();
        // The gradient contains the reactions, whose work is that of the moved sites.
        let _ = changes;
        for (i, role) in conditions.roles.iter().enumerate() {
            if let Role::Fixed(site, direction) = role {
                slope -= direction.dot(&applied[*site].0) * conditions.residuals[i];
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
            parts: conditions.parts.clone(),
            roles: conditions.roles.clone(),
            diagonal: conditions.diagonal.clone(),
            residuals: vec![0.0; conditions.residuals.len()],
            basis: conditions.basis.clone(),
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
            self.respond(&still, dense);
            turns.clone_from(&self.system.turns);
        }
        self.system.start.keep(rod);
        let fraction = PUSH / self.system.largest_turn();
        self.system.advance::<P>(rod, fraction);
    }

    /// The reactions at the equilibrium.
    fn reactions(&self, rod: &Rod) -> Vec<Reaction> {
        let starts: Vec<f64> = rod.centre_line().iter().map(|(s, _)| *s).collect();
        let reaction = |element: usize, x: f64| Reaction {
            arc_length: starts[element] + upto_parts(rod, element, x)[..P].iter().sum::<f64>(),
            initial_apex_distance: rod.initial_apex_distance(element, x),
            force: Vector3::zeros(),
            couple: Vector3::zeros(),
            length: 0.0,
            obstacle: None,
            normal: 0.0,
            slip: None,
        };
        let mut all: Vec<Reaction> = Vec::new();
        for site in &self.sites {
            let force = site.force + site.spring_force();
            let touch = site.touch.as_ref();
            let (obstacle, normal) = (touch.map(|touch| touch.obstacle), touch.map_or(0.0, |touch| touch.push));
            let slip = touch.and_then(|touch| touch.friction).map(|friction| match friction.sticks {
                true => Slip::Sticks,
                false => Slip::Slides,
            });
            all.push(Reaction { force, obstacle, normal, slip, ..reaction(site.element, site.x) });
        }
        self.spread(rod, &mut all);
        let joints = &self.system.joints;
        let mut couples = Vec::new();
        for ((node, _), held) in joints.confined.iter().zip(&joints.held) {
            // The couple of the support balances the rod's.
            let couple = rod.frames()[*node] * -held;
            couples.push((*node, couple));
        }
        for ((node, ..), along) in joints.elastic.iter().zip(&joints.couples) {
            couples.push((*node, rod.frames()[*node] * along));
        }
        for (node, couple) in couples {
            let at_node = |site: &Site| site.touch.is_none() && site.element + 1 == node;
            match self.sites.iter().position(at_node) {
                Some(i) => all[i].couple = couple,
                None if node == 0 => {
                    let initial_apex_distance = rod.initial_length();
                    all.push(Reaction { couple, arc_length: 0.0, initial_apex_distance, ..reaction(0, 0.0) });
                }
                None => all.push(Reaction { couple, ..reaction(node - 1, 1.0) }),
            }
        }
        all
    }
}

/// Moves a site along the rod by a length (m), at most by the length of its element.
fn slide(rod: &Rod, site: &mut Site, by: f64) {
    let length = rod.length_of(site.element);
    let mut rest = site.x * length + by.clamp(-length, length);
    while rest < 0.0 && site.element > 0 {
        site.element -= 1;
        rest += rod.length_of(site.element);
    }
    while rest > rod.length_of(site.element) && site.element + 1 < rod.elements() {
        rest -= rod.length_of(site.element);
        site.element += 1;
    }
    site.x = (rest / rod.length_of(site.element)).clamp(0.0, 1.0);
}

/// The part of a vector along some orthonormal vectors.
fn project(directions: &[Vector3<f64>], vector: &Vector3<f64>) -> Vector3<f64> {
    directions.iter().map(|d| d * d.dot(vector)).sum()
}
