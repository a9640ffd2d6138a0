//! Newton's method on the energy of the frames, globalised: diagonal shift, bound on the step, line search.

use nalgebra::{UnitQuaternion, Vector3};

use super::element::{ElementData, ElementSystem};
use super::tangent::Tangent;
use super::{Equilibrium, EquilibriumError, EquilibriumSolver, Inertia};
use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::load::{InternalForce, Load};
use crate::rod::Rod;
use crate::scene::Environment;
use crate::so3;

/// No step turns a frame further than this, rad: beyond it the quadratic model says nothing.
const LARGEST_TURN: f64 = 1.0;
/// Steps shorter than this are taken without a line search, rad: the energy no longer tells them apart from rounding.
const SMALL_TURN: f64 = 1e-4;
/// Steps shorter than this are followed by one with the same factors, whose size tells the error.
const CHORD_TURN: f64 = 0.05;
/// Steps shorter than this leave nothing but rounding behind, rad: Newton's method squares them.
const NEAR_TURN: f64 = 1e-8;
/// Fraction of the predicted decrease that a step must achieve (Armijo).
const DECREASE: f64 = 1e-4;

/// Couples are balanced to rounding when what is left of them is below this fraction of force times length.
const BALANCED: f64 = 1e-14;

/// Which equilibria are acceptable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Branch {
    /// A stable one: the energy is minimised, and saddles are left on their way down.
    #[default]
    Stable,
    /// The one nearest to the first guess, stable or not: plain Newton with a bounded step.
    Nearest,
}

/// Newton's method over faer's sparse LDLᵀ factorisation, equations (9) to (12).
///
/// Keeps settings and memory, no state: two calls with equal rods give equal answers.
#[derive(Debug)]
pub struct NewtonSolver {
    /// Largest acceptable error of a frame against the exact minimum of the discrete energy, rad.
    pub tolerance: f64,
    /// Bound on the iterations.
    pub max_iterations: usize,
    /// Which equilibria are acceptable.
    pub branch: Branch,
    work: Work,
}

#[derive(Debug, Default)]
struct Work {
    systems: Vec<ElementSystem>,
    tangent: Tangent,
    forces: Vec<Vector3<f64>>,
    /// The largest unbalanced couple on a frame at the last assembly, N m.
    unbalanced: f64,
    /// Turn of every frame in the present step, the base's (zero) first.
    turns: Vec<Vector3<f64>>,
    /// Steps of the rotation vectors of every element.
    steps: Vec<Vector3<f64>>,
    /// Where the present step starts.
    start: Shape,
    /// Where the call started.
    initial: Shape,
}

/// The degrees of freedom of a rod.
#[derive(Debug, Default)]
struct Shape {
    frames: Vec<UnitQuaternion<f64>>,
    rotations: Vec<Vector3<f64>>,
}

impl Shape {
    fn keep(&mut self, rod: &Rod) {
        self.frames.clone_from(&rod.frames);
        self.rotations.clone_from(&rod.rotations);
    }

    fn restore(&self, rod: &mut Rod) {
        rod.frames.clone_from(&self.frames);
        rod.rotations.clone_from(&self.rotations);
    }
}

impl Default for NewtonSolver {
    /// Error 1e-11 rad, at most 1000 iterations, stable equilibria only.
    fn default() -> Self {
        Self { tolerance: 1e-11, max_iterations: 1000, branch: Branch::Stable, work: Work::default() }
    }
}

impl NewtonSolver {
    /// A solver with the given largest error of a frame, rad, and the other defaults.
    #[must_use]
    pub fn with_tolerance(tolerance: f64) -> Self {
        Self { tolerance, ..Self::default() }
    }
}

impl Clone for NewtonSolver {
    /// Clones the settings; the memory is made anew when it is needed.
    fn clone(&self) -> Self {
        Self {
            tolerance: self.tolerance,
            max_iterations: self.max_iterations,
            branch: self.branch,
            work: Work::default(),
        }
    }
}

impl EquilibriumSolver for NewtonSolver {
    fn equilibrate(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        ParameterError::positive("tolerance of the equilibrium", self.tolerance)?;
        self.work.initial.keep(rod);
        let answer = match rod.order.points() {
            1 => self.run::<1>(rod, material, force),
            2 => self.run::<2>(rod, material, force),
            3 => self.run::<3>(rod, material, force),
            _ => self.run::<4>(rod, material, force),
        };
        if answer.is_err() {
            self.work.initial.restore(rod);
        }
        answer
    }
}

impl NewtonSolver {
    /// The signs of the energy's second derivative at the frames that the rod has, whether in equilibrium or not.
    ///
    /// # Errors
    /// An input that is not finite.
    pub fn inertia(
        &mut self,
        rod: &Rod,
        material: &impl Constitutive,
        load: &impl Load,
        environment: &Environment,
    ) -> Result<Inertia, EquilibriumError> {
        self.inertia_under(rod, material, &InternalForce::of(rod, load, environment))
    }

    fn inertia_under(
        &mut self,
        rod: &Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Inertia, EquilibriumError> {
        self.work.forces.clear();
        self.work.forces.extend_from_slice(force.at_points());
        let time = force.environment().time;
        match rod.order.points() {
            1 => self.work.assemble::<1>(rod, material, time, 0.0),
            2 => self.work.assemble::<2>(rod, material, time, 0.0),
            3 => self.work.assemble::<3>(rod, material, time, 0.0),
            _ => self.work.assemble::<4>(rod, material, time, 0.0),
        }
        .map(|(_, inertia)| inertia)
    }

    /// Factorises the tangent at an equilibrium, for [`follow`](Self::follow).
    pub(crate) fn factorise(
        &mut self,
        rod: &Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<(), EquilibriumError> {
        self.inertia_under(rod, material, force).map(|_| ())
    }

    /// Moves the frames of an equilibrium whose intrinsic strain was disturbed a little to where they are in equilibrium
    /// again, to first order, with the factors of [`factorise`](Self::factorise).
    pub(crate) fn follow<C: Constitutive>(&mut self, rod: &mut Rod, material: &C, force: &InternalForce) {
        match rod.order.points() {
            1 => self.work.follow::<1>(rod, material, force.environment().time),
            2 => self.work.follow::<2>(rod, material, force.environment().time),
            3 => self.work.follow::<3>(rod, material, force.environment().time),
            _ => self.work.follow::<4>(rod, material, force.environment().time),
        }
    }

    fn run<const P: usize>(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        let work = &mut self.work;
        work.forces.clear();
        work.forces.extend_from_slice(force.at_points());
        let largest_force = force.largest();
        if !largest_force.is_finite() {
            return Err(EquilibriumError::NotFinite { what: "force in the rod" });
        }
        let time = force.environment().time;
        let stable = self.branch == Branch::Stable;
        let mut outcome = Equilibrium::default();
        // The last shift that served, from which the next search for one starts.
        let mut held = 0.0;
        let mut kicks = 0;
        let mut last_turn = f64::INFINITY;
        let length = rod.length();
        for iteration in 1..=self.max_iterations {
            outcome.iterations = iteration;
            let mut shift = 0.0;
            let mut inertia;
            let mut unit;
            loop {
                (outcome.energy, inertia) = work.assemble::<P>(rod, material, time, shift)?;
                outcome.factorisations += 1;
                // A shift of the size of the force in the rod makes any rod in tension or near it convex. Without load it
                // is the strain energy per length that bends the rod, a force too.
                unit = largest_force.max(outcome.energy.abs() / length).max(f64::MIN_POSITIVE);
                if !stable || inertia.negative == 0 {
                    break;
                }
                shift = if shift > 0.0 {
                    4.0 * shift
                } else if held > 0.0 {
                    held / 16.0
                } else {
                    0.1 * unit
                };
                if !shift.is_finite() {
                    return Err(EquilibriumError::NotFinite { what: "tangent" });
                }
            }
            if shift > 0.0 {
                held = shift;
            }
            let plain = shift == 0.0;
            work.solve::<P>();
            let turn = work.largest_turn();
            let stagnates = turn > 0.5 * last_turn;
            last_turn = turn;
            if !turn.is_finite() {
                return Err(EquilibriumError::NotFinite { what: "Newton step" });
            }

            if stable && !plain && turn < 1e-3 * SMALL_TURN {
                // Next to no gradient, yet not a minimum: a saddle. Leave it in a direction that breaks the symmetry.
                if kicks == 3 {
                    let negative = work.assemble::<P>(rod, material, time, 0.0)?.1.negative;
                    return Err(EquilibriumError::Unstable { negative });
                }
                Work::kick(rod, kicks);
                kicks += 1;
                continue;
            }

            // Couples that balance to rounding of the largest cannot be balanced better. Where the shape is all but free
            // to move, rounding still turns the frames, by the step that is reported as the error then.
            if plain && stagnates && turn < CHORD_TURN && work.unbalanced <= BALANCED * unit * length {
                outcome.error = turn;
                outcome.inertia = inertia;
                return Ok(outcome);
            }

            let mut fraction = (LARGEST_TURN / turn).min(1.0);
            let slope = work.slope::<P>();
            work.start.keep(rod);
            let energy = outcome.energy;
            loop {
                work.advance::<P>(rod, fraction);
                let trial = work.evaluate::<P>(rod, material, time);
                outcome.evaluations += 1;
                // The energy is known to rounding of its largest terms.
                let slack = 64.0 * f64::EPSILON * energy.abs();
                let small = fraction * turn < SMALL_TURN;
                if trial.is_finite() && (small || !stable || trial <= energy + DECREASE * fraction * slope + slack) {
                    outcome.energy = trial;
                    break;
                }
                work.start.restore(rod);
                if small {
                    return Err(EquilibriumError::NotFinite { what: "energy" });
                }
                fraction *= 0.5;
            }

            if plain && fraction == 1.0 && turn < CHORD_TURN {
                // The gradient at the new frames is at hand: a step with the old factors costs little and its size is
                // the error that was left.
                work.solve_again::<P>();
                let rest = work.largest_turn();
                // What the chord leaves shrinks by the same ratio again, or by what the turn has changed of the tangent;
                // at rounding level it does not shrink.
                let shrinks = rest < 0.5 * turn;
                let error = if shrinks { 4.0 * rest * (rest / turn).max(turn) } else { turn.max(rest) };
                if shrinks {
                    work.start.keep(rod);
                    work.advance::<P>(rod, 1.0);
                }
                // The tangent was that of the last step's start, and its signs are those at the answer where its smallest
                // pivot is safe from a change of that size. Where not, the answer is made as good as rounding allows, and a
                // tangent is made there.
                let safe = stable && inertia.margin >= 10.0 * turn;
                if error <= self.tolerance && (safe || !shrinks || turn < NEAR_TURN) {
                    outcome.error = error;
                    if !safe {
                        inertia = work.assemble::<P>(rod, material, time, 0.0)?.1;
                        outcome.factorisations += 1;
                    }
                    outcome.inertia = inertia;
                    if !stable || inertia.negative == 0 {
                        return Ok(outcome);
                    }
                }
            }
        }
        Err(EquilibriumError::NoConvergence {
            iterations: self.max_iterations,
            step: last_turn,
            residual: work.residual::<P>(),
            force: largest_force,
        })
    }
}

impl Work {
    fn data<'a, const P: usize>(rod: &'a Rod, forces: &'a [Vector3<f64>], e: usize, time: f64) -> ElementData<'a> {
        ElementData {
            frame: &rod.frames[e],
            rotations: rod.element_rotations(e),
            points: rod.element_points(e),
            forces: &forces[e * P..(e + 1) * P],
            time,
        }
    }

    /// Assembles, condenses and factorises the tangent at the rod's frames.
    fn assemble<const P: usize>(
        &mut self,
        rod: &Rod,
        material: &impl Constitutive,
        time: f64,
        shift: f64,
    ) -> Result<(f64, Inertia), EquilibriumError> {
        let n = rod.elements();
        self.systems.resize_with(n, ElementSystem::default);
        self.turns.clear();
        self.turns.resize(n + 1, Vector3::zeros());
        self.steps.resize(n * P, Vector3::zeros());
        self.tangent.reset(n)?;
        let mut inertia = Inertia::default();
        let mut energy = 0.0;
        for e in 0..n {
            let data = Self::data::<P>(rod, &self.forces, e, time);
            let system = &mut self.systems[e];
            energy += system.evaluate::<P, true>(rod.basis(), material, &data);
            let share = shift * rod.element_length(e) / P as f64;
            let blocks = system.condense::<P>(&data, &[share; P], &mut inertia);
            let on_node = nalgebra::Matrix3::from_diagonal_element(share);
            self.tangent.add_diagonal(e, &(blocks.h11 + on_node));
            self.turns[e + 1] -= blocks.g1;
            if e > 0 {
                self.tangent.add_diagonal(e - 1, &blocks.h00);
                self.tangent.set_coupling(e, &blocks.h01);
                self.turns[e] -= blocks.g0;
            }
        }
        self.unbalanced = self.turns[1..].iter().map(Vector3::norm).fold(0.0, f64::max);
        let frames = self.tangent.factorise()?;
        inertia.negative += frames.negative;
        inertia.neutral += frames.neutral;
        inertia.positive += frames.positive;
        inertia.margin = inertia.margin.min(frames.margin);
        if energy.is_finite() { Ok((energy, inertia)) } else { Err(EquilibriumError::NotFinite { what: "energy" }) }
    }

    /// The Newton step from the gradient that stands in `turns`.
    fn solve<const P: usize>(&mut self) {
        self.tangent.solve(&mut self.turns[1..]);
        for (e, system) in self.systems.iter().enumerate() {
            system.recover::<P>(&self.turns[e + 1], &self.turns[e], &mut self.steps[e * P..(e + 1) * P]);
        }
    }

    /// The step with the kept factors from the gradient that was evaluated last.
    fn solve_again<const P: usize>(&mut self) {
        self.turns.fill(Vector3::zeros());
        for (e, system) in self.systems.iter().enumerate() {
            let (g1, g0) = system.condensed_gradient::<P>();
            self.turns[e + 1] -= g1;
            if e > 0 {
                self.turns[e] -= g0;
            }
        }
        self.solve::<P>();
    }

    fn follow<const P: usize>(&mut self, rod: &mut Rod, material: &impl Constitutive, time: f64) {
        self.evaluate::<P>(rod, material, time);
        self.solve_again::<P>();
        self.start.keep(rod);
        self.advance::<P>(rod, 1.0);
    }

    fn evaluate<const P: usize>(&mut self, rod: &Rod, material: &impl Constitutive, time: f64) -> f64 {
        let mut energy = 0.0;
        for (e, system) in self.systems.iter_mut().enumerate() {
            let data = Self::data::<P>(rod, &self.forces, e, time);
            energy += system.evaluate::<P, false>(rod.basis(), material, &data);
        }
        energy
    }

    /// The largest rotation in the present step, rad.
    fn largest_turn(&self) -> f64 {
        self.turns
            .iter()
            .chain(&self.steps)
            .map(Vector3::norm)
            .fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
    }

    fn slope<const P: usize>(&self) -> f64 {
        let each = self.systems.iter().enumerate();
        each.map(|(e, system)| system.slope::<P>(&self.steps[e * P..(e + 1) * P], &self.turns[e])).sum()
    }

    /// The largest unbalanced couple on a frame, N m.
    fn residual<const P: usize>(&self) -> f64 {
        let mut before = Vector3::zeros();
        let mut largest = 0.0_f64;
        for (e, system) in self.systems.iter().enumerate() {
            let (g1, g0) = system.condensed_gradient::<P>();
            if e > 0 {
                largest = largest.max((before + g0).norm());
            }
            before = g1;
        }
        largest.max(before.norm())
    }

    /// Moves the rod from the start of the step by a fraction of it.
    fn advance<const P: usize>(&self, rod: &mut Rod, fraction: f64) {
        for (i, turn) in self.turns.iter().enumerate().skip(1) {
            let frame = self.start.frames[i] * so3::exp(&(turn * fraction));
            rod.frames[i] = UnitQuaternion::new_normalize(frame.into_inner());
        }
        for e in 0..rod.elements() {
            for k in e * P..(e + 1) * P - 1 {
                rod.rotations[k] = self.start.rotations[k] + self.steps[k] * fraction;
            }
            rod.rotations[(e + 1) * P - 1] = so3::log(&(rod.frames[e].inverse() * rod.frames[e + 1]));
        }
    }

    /// Bends the rod a little, about d2 of the base first, then about d1, then twists it.
    fn kick(rod: &mut Rod, number: usize) {
        let axis = [Vector3::y(), Vector3::x(), Vector3::z()][number % 3];
        let basis = rod.basis();
        let p = basis.p;
        let share = 0.1 / rod.length();
        for e in 0..rod.elements() {
            let h = rod.element_length(e);
            for k in 0..p {
                rod.rotations[e * p + k] += axis * (share * h * basis.nodes[k + 1]);
            }
        }
        rod.chain_frames();
    }
}
