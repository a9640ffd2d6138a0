//! Newton's method on the energy of the frames, globalised: diagonal shift, bound on the step, line search.

use nalgebra::Vector3;

use super::system::{Configuration, System};
use super::{Equilibrium, EquilibriumError, EquilibriumSolver, Inertia, forces_at_points};
use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::load::Load;
use crate::rod::Rod;
use crate::scene::Moment;

/// No step turns a frame further than this, rad: beyond it the quadratic model says nothing.
const LARGEST_TURN: f64 = 1.0;
/// Steps shorter than this are taken without a line search, rad: the energy no longer tells them apart from rounding.
const SMALL_TURN: f64 = 1e-4;
/// Steps shorter than this are followed by one with the same factors, whose size tells the error.
const CHORD_TURN: f64 = 0.05;
/// Steps shorter than this leave nothing but rounding behind, rad: Newton's method squares them.
const NEAR_TURN: f64 = 1e-8;
/// A shifted step shorter than this finds next to no gradient, rad: the frames are at a saddle.
const SADDLE_TURN: f64 = 1e-3 * SMALL_TURN;
/// A saddle is left at most this often: in bending about d2, about d1, and in twist.
const SADDLES: usize = 3;
/// Fraction of the predicted decrease that a step must achieve (Armijo).
const DECREASE: f64 = 1e-4;
/// Couples are balanced to rounding when what is left of them is below this fraction of force times length.
const BALANCED: f64 = 1e-14;

/// Calls what is generic over the number of Gauss points in an element.
macro_rules! with_points {
    ($rod:expr, $points:ident => $call:expr) => {
        match $rod.order.points() {
            1 => {
                const $points: usize = 1;
                $call
            }
            2 => {
                const $points: usize = 2;
                $call
            }
            3 => {
                const $points: usize = 3;
                $call
            }
            _ => {
                const $points: usize = 4;
                $call
            }
        }
    };
}

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
    system: System,
    /// Where the call started.
    initial: Configuration,
}

impl Default for NewtonSolver {
    /// Error 1e-11 rad, at most 1000 iterations, stable equilibria only.
    fn default() -> Self {
        Self {
            tolerance: 1e-11,
            max_iterations: 1000,
            branch: Branch::Stable,
            system: System::default(),
            initial: Configuration::default(),
        }
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
        let Self { tolerance, max_iterations, branch, .. } = *self;
        Self { tolerance, max_iterations, branch, ..Self::default() }
    }
}

impl EquilibriumSolver for NewtonSolver {
    fn solve<C: Constitutive, L: Load>(
        &mut self,
        rod: &mut Rod,
        material: &C,
        load: &L,
        moment: &Moment,
    ) -> Result<Equilibrium, EquilibriumError> {
        ParameterError::positive("tolerance of the equilibrium", self.tolerance)?;
        self.initial.keep(rod);
        let answer = with_points!(rod, P => self.minimise::<P>(rod, material, load, moment));
        if answer.is_err() {
            self.initial.restore(rod);
        }
        answer
    }
}

impl NewtonSolver {
    /// The signs of the energy's second derivative at the frames that the rod has, whether in equilibrium or not.
    ///
    /// # Errors
    /// An input that is not finite.
    pub fn inertia<C: Constitutive, L: Load>(
        &mut self,
        rod: &Rod,
        material: &C,
        load: &L,
        moment: &Moment,
    ) -> Result<Inertia, EquilibriumError> {
        forces_at_points(rod, load, moment, &mut self.system.forces);
        with_points!(rod, P => self.system.assemble::<P>(rod, material, moment.time, 0.0)).map(|(_, inertia)| inertia)
    }

    /// Factorises the tangent at an equilibrium.
    ///
    /// # Errors
    /// An input that is not finite.
    pub(crate) fn linearise<'a, C: Constitutive, L: Load>(
        &'a mut self,
        rod: &Rod,
        material: &'a C,
        load: &L,
        moment: &Moment,
    ) -> Result<FactorisedTangent<'a, C>, EquilibriumError> {
        self.inertia(rod, material, load, moment)?;
        Ok(FactorisedTangent { system: &mut self.system, material, time: moment.time })
    }

    /// The iteration of Newton's method, for elements of `P` Gauss points.
    fn minimise<const P: usize>(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        load: &impl Load,
        moment: &Moment,
    ) -> Result<Equilibrium, EquilibriumError> {
        forces_at_points(rod, load, moment, &mut self.system.forces);
        let forces = self.system.forces.iter().map(Vector3::norm);
        if !forces.clone().all(f64::is_finite) {
            return Err(EquilibriumError::NotFinite { what: "force in the rod" });
        }
        let mut search = Search::<_, P> {
            largest_force: forces.fold(0.0, f64::max),
            length: rod.length(),
            system: &mut self.system,
            material,
            time: moment.time,
            stable: self.branch == Branch::Stable,
            tolerance: self.tolerance,
            shift: 0.0,
            last_shift: 0.0,
            turn: f64::INFINITY,
            stagnates: false,
            saddles: 0,
            found: Equilibrium::default(),
        };
        for iteration in 1..=self.max_iterations {
            search.found.iterations = iteration;
            search.find_tangent(rod)?;
            search.find_step()?;
            if search.is_at_saddle() {
                search.leave_saddle(rod)?;
            } else if search.is_balanced_to_rounding() {
                search.found.error = search.turn;
                return Ok(search.found);
            } else {
                let whole = search.search_line(rod)? == 1.0;
                if whole && search.shift == 0.0 && search.turn < CHORD_TURN {
                    let chord = search.follow_chord(rod);
                    if search.accepts(rod, &chord)? {
                        return Ok(search.found);
                    }
                }
            }
        }
        search.system.balance::<P>();
        Err(EquilibriumError::NoConvergence {
            iterations: self.max_iterations,
            step: search.turn,
            residual: search.system.unbalanced,
            force: search.largest_force,
        })
    }
}

/// The tangent at an equilibrium, factorised.
pub(crate) struct FactorisedTangent<'a, C> {
    system: &'a mut System,
    material: &'a C,
    time: f64,
}

impl<C: Constitutive> FactorisedTangent<'_, C> {
    /// Moves the frames of `rod` to equilibrium again, to first order. It is a copy of the rod that was linearised,
    /// whose intrinsic strain was disturbed a little.
    pub fn follow(&mut self, rod: &mut Rod) {
        with_points!(rod, P => {
            self.system.evaluate::<P>(rod, self.material, self.time);
            self.system.balance::<P>();
            self.system.solve::<P>();
            self.system.start.keep(rod);
            self.system.advance::<P>(rod, 1.0);
        });
    }
}

/// One search for an equilibrium: what one iteration hands to the next.
struct Search<'a, C, const P: usize> {
    system: &'a mut System,
    material: &'a C,
    time: f64,
    /// Whether the equilibrium has to be stable.
    stable: bool,
    tolerance: f64,
    length: f64,
    largest_force: f64,
    /// The shift of the present tangent, N; zero where it is positive definite by itself.
    shift: f64,
    /// The last shift that was not zero, N; zero before there was one.
    last_shift: f64,
    /// The largest rotation in the present step, rad.
    turn: f64,
    /// Whether the present step is not much shorter than the one before.
    stagnates: bool,
    /// Number of saddles left.
    saddles: usize,
    /// The answer as far as it is known: counts, and energy and inertia of the last assembly.
    found: Equilibrium,
}

/// What a chord step tells about the Newton step before it.
struct Chord {
    /// Estimated largest error of a frame, rad.
    error: f64,
    /// Whether the chord step is clearly shorter than the Newton step.
    shrinks: bool,
}

impl<C: Constitutive, const P: usize> Search<'_, C, P> {
    fn assemble(&mut self, rod: &Rod) -> Result<(f64, Inertia), EquilibriumError> {
        self.system.assemble::<P>(rod, self.material, self.time, self.shift)
    }

    /// A force of the size that acts in the rod, N. Without load it is the strain energy per length.
    fn force_scale(&self) -> f64 {
        self.largest_force.max(self.found.energy.abs() / self.length).max(f64::MIN_POSITIVE)
    }

    /// Assembles and factorises the tangent, with growing shifts until no pivot is negative if the equilibrium has to be
    /// stable.
    fn find_tangent(&mut self, rod: &Rod) -> Result<(), EquilibriumError> {
        self.shift = 0.0;
        loop {
            (self.found.energy, self.found.inertia) = self.assemble(rod)?;
            self.found.factorisations += 1;
            if !self.stable || self.found.inertia.negative == 0 {
                break;
            }
            self.shift = if self.shift > 0.0 {
                4.0 * self.shift
            } else if self.last_shift > 0.0 {
                self.last_shift / 16.0
            } else {
                // A shift of the size of the force in the rod makes any rod in tension or near it convex.
                0.1 * self.force_scale()
            };
            if !self.shift.is_finite() {
                return Err(EquilibriumError::NotFinite { what: "tangent" });
            }
        }
        if self.shift > 0.0 {
            self.last_shift = self.shift;
        }
        Ok(())
    }

    /// Solves for the Newton step.
    fn find_step(&mut self) -> Result<(), EquilibriumError> {
        self.system.solve::<P>();
        let last = std::mem::replace(&mut self.turn, self.system.largest_turn());
        self.stagnates = self.turn > 0.5 * last;
        if self.turn.is_finite() { Ok(()) } else { Err(EquilibriumError::NotFinite { what: "Newton step" }) }
    }

    /// Whether there is next to no gradient, yet no minimum.
    fn is_at_saddle(&self) -> bool {
        self.stable && self.shift > 0.0 && self.turn < SADDLE_TURN
    }

    /// Bends the rod a little in a direction that breaks the symmetry, another one each time.
    fn leave_saddle(&mut self, rod: &mut Rod) -> Result<(), EquilibriumError> {
        if self.saddles == SADDLES {
            self.shift = 0.0;
            return Err(EquilibriumError::Unstable { negative: self.assemble(rod)?.1.negative });
        }
        disturb(rod, self.saddles);
        self.saddles += 1;
        Ok(())
    }

    /// Whether couples balance to rounding of the largest: they cannot be balanced better. Where the shape is all but
    /// free to move, rounding still turns the frames, by the present step, which is the error then.
    fn is_balanced_to_rounding(&self) -> bool {
        self.shift == 0.0
            && self.stagnates
            && self.turn < CHORD_TURN
            && self.system.unbalanced <= BALANCED * self.force_scale() * self.length
    }

    /// Moves the rod along the step, by a fraction of it that lowers the energy enough. Returns the fraction.
    fn search_line(&mut self, rod: &mut Rod) -> Result<f64, EquilibriumError> {
        let mut fraction = (LARGEST_TURN / self.turn).min(1.0);
        let slope = self.system.slope::<P>();
        let energy = self.found.energy;
        // The energy is known to rounding of its largest terms.
        let slack = 64.0 * f64::EPSILON * energy.abs();
        self.system.start.keep(rod);
        loop {
            self.system.advance::<P>(rod, fraction);
            let trial = self.system.evaluate::<P>(rod, self.material, self.time);
            self.found.evaluations += 1;
            let small = fraction * self.turn < SMALL_TURN;
            if trial.is_finite() && (small || !self.stable || trial <= energy + DECREASE * fraction * slope + slack) {
                self.found.energy = trial;
                return Ok(fraction);
            }
            self.system.start.restore(rod);
            if small {
                return Err(EquilibriumError::NotFinite { what: "energy" });
            }
            fraction *= 0.5;
        }
    }

    /// A step with the old factors from the gradient at the new frames, which the line search has left. It costs little,
    /// and its size is the error that the Newton step left.
    fn follow_chord(&mut self, rod: &mut Rod) -> Chord {
        self.system.balance::<P>();
        self.system.solve::<P>();
        let (turn, rest) = (self.turn, self.system.largest_turn());
        // At rounding level the chord step is no shorter than the Newton step.
        let shrinks = rest < 0.5 * turn;
        if !shrinks {
            return Chord { error: turn.max(rest), shrinks };
        }
        self.system.start.keep(rod);
        self.system.advance::<P>(rod, 1.0);
        // What the chord step leaves shrinks by the same ratio again, or by what the turn has changed of the tangent.
        Chord { error: 4.0 * rest * (rest / turn).max(turn), shrinks }
    }

    /// Whether the frames are an equilibrium of the wanted kind, within the tolerance.
    fn accepts(&mut self, rod: &Rod, chord: &Chord) -> Result<bool, EquilibriumError> {
        // The tangent was that of the last step's start, and its signs are those at the answer where its smallest pivot is
        // safe from a change of that size. Where not, the answer is made as good as rounding allows, and a tangent is made
        // there.
        let safe = self.stable && self.found.inertia.margin >= 10.0 * self.turn;
        let exhausted = !chord.shrinks || self.turn < NEAR_TURN;
        if !(chord.error <= self.tolerance && (safe || exhausted)) {
            return Ok(false);
        }
        self.found.error = chord.error;
        if !safe {
            self.found.inertia = self.assemble(rod)?.1;
            self.found.factorisations += 1;
        }
        Ok(!self.stable || self.found.inertia.negative == 0)
    }
}

/// Bends the rod a little: about d2 of the base the first time, then about d1, then twists it.
fn disturb(rod: &mut Rod, time: usize) {
    let axis = [Vector3::y(), Vector3::x(), Vector3::z()][time % SADDLES];
    let basis = rod.basis();
    let share = 0.1 / rod.length();
    for e in 0..rod.elements() {
        let h = rod.element_length(e);
        for k in 0..basis.p {
            rod.rotations[e * basis.p + k] += axis * (share * h * basis.nodes[k + 1]);
        }
    }
    rod.chain_frames();
}
