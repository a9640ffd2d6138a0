//! Numbers of the search for reactions that were chosen by experiment, with their reasons.

/// Largest rotation of a frame in a step, rad. The quadratic model of the energy does not hold
/// beyond it.
pub(super) const LARGEST_TURN: f64 = 0.5;
/// Part of the radius of an obstacle by which a candidate may move in a step beyond its gap.
/// Between candidates it is the largest displacement relative to the sum of gap and radius. The
/// linear model of the gap holds within it, and a rod does not pass through a thin pole.
pub(super) const APPROACH: f64 = 0.5;
/// Largest number of iterations of Newton's method or of a descent nearby. Nearly all successful
/// searches take fewer. A descent to any equilibrium is limited by the bound of the whole search
/// alone.
pub(super) const ITERATIONS: usize = 60;
/// Largest displacement of the centre line from the initial guess in a descent nearby, relative to
/// the length. It exceeds the motions that follow failures of Newton's method next to an
/// equilibrium.
pub(super) const NEAR_MOTION: f64 = 1e-3;
/// As `NEAR_MOTION`, in a descent to any equilibrium. A rod that nothing holds moves by about half
/// of its length in each step, without end.
pub(super) const FAR_MOTION: f64 = 1e2;
/// Number of halvings of a step before the tangent is shifted instead.
pub(super) const HALVINGS: usize = 5;
/// First shift of the tangent, relative to the force in the rod.
pub(super) const FIRST_SHIFT: f64 = 0.1;
/// Factor by which the shift increases after a rejection. After a whole step it decreases by at
/// least this factor.
pub(super) const SHIFT_FACTOR: f64 = 4.0;
/// Smallest shift, relative to the force in the rod. The steps past the end of a branch of
/// equilibria are longer for a smaller shift.
pub(super) const LEAST_SHIFT: f64 = 1e-6;
/// Largest shift, relative to the force in the rod or to that at which the rod buckles. Forces far
/// from equilibrium may leave the bordered matrix indefinite at any shift.
pub(super) const LARGEST_SHIFT: f64 = 1e12;
/// Decrease of the merit that a step must achieve, relative to the predicted one (Armijo).
pub(super) const DECREASE: f64 = 1e-4;
/// Relative decrease of the residual that a step must achieve otherwise.
pub(super) const RESIDUAL_DECREASE: f64 = 0.2;
/// Ratio of the rotations in two successive steps above which Newton's method does not converge
/// quadratically.
pub(super) const SLOW: f64 = 0.25;
/// Rotation in a step below which the iteration may end, and the merit is not compared without
/// friction, rad: its change is close to rounding.
pub(super) const SMALL_TURN: f64 = 1e-4;
/// Largest number of steps by which the rod returns to its conditions, with the existing factors.
pub(super) const CORRECTIONS: usize = 6;
/// Penetration after a corrected step, relative to the length, above which the step is shortened.
/// The penetration before the step times 1 − share/2 is permitted in addition.
pub(super) const PERMITTED: f64 = 1e-5;
/// Largest number of times that contacts are added to a step that would penetrate an obstacle.
pub(super) const ADDITIONS: usize = 8;
/// Largest number of further shares for which the contact problem of a step is solved.
pub(super) const SHORTENINGS: usize = 9;
/// Number of failed shares after which the next one that is out of range ends the search for a
/// share. A share fails if its contact problem is not solved or its rotation does not decrease.
pub(super) const FAILURES: usize = 1;
/// Violation of a condition that is attributed to rounding, relative to the length.
pub(super) const ROUNDING: f64 = 1e-12;
/// Largest number of times that nodes move to contacts in a search. Afterwards the nodes stay.
pub(super) const PLACEMENTS: usize = 12;
/// Largest motion of the end of a segment each time, relative to an element.
pub(super) const PLACING_MOTION: f64 = 0.3;
/// Rotation in a step below which nodes may move, rad.
pub(super) const PLACING_TURN: f64 = 1e-3;
/// As `PLACING_TURN`, for a step in which the contacts keep their states.
pub(super) const SETTLED_TURN: f64 = 1e-2;
/// Rotation in a step below which, with obstacles, steps with the same factors follow, rad.
pub(super) const CHORD_TURN: f64 = 1e-3;
/// Largest number of these steps.
pub(super) const CHORDS: usize = 6;
/// Error relative to the tolerance at which these steps end. A contact whose force is almost zero
/// must not begin and end in turn in steps of time whose errors differ.
pub(super) const CHORD_ERROR: f64 = 1e-3;
/// Distance of a node from the place of a contact that is not corrected, relative to the length.
/// The error of the shape is proportional to its square, and that of the force at the end of a
/// contact segment to itself.
pub(super) const PLACED: f64 = 3e-10;
/// Distance within which contact points are one, and within which no station is added beside a
/// candidate, relative to an element; shortest distance of a station inside a contact segment from
/// its ends, relative to its element.
pub(super) const NEAR: f64 = 0.1;
/// Second derivative of the gap along the rod, times the length, below which a contact is no point.
pub(super) const FLAT: f64 = 1e-3;
/// Largest slope of the rod against an obstacle at a contact point.
pub(super) const TANGENTIAL: f64 = 1e-6;
/// Largest slope of the rod against an obstacle at a station where the rod follows the obstacle. It
/// is about twenty times the depth to which a coarse rod penetrates between two stations, relative
/// to their distance.
pub(super) const STEEP: f64 = 0.05;
/// Gap of an open contact point that is no candidate any more, relative to the length.
pub(super) const FAR: f64 = 1e-2;
/// Largest number of saddles that are left from one with the least energy so far to the next one
/// with less energy.
pub(super) const SADDLES: usize = 4;
/// Largest rotation by which a saddle is left, rad: large against the rounding of the gradient, and
/// small enough for the quadratic model.
pub(super) const SADDLE_TURN: f64 = 0.1;
/// Number of inverse iterations for the softest direction.
pub(super) const SOFTENINGS: usize = 12;
/// Largest increase of the number of negative directions in a search for an unstable equilibrium.
pub(super) const PASSED: usize = 3;
/// Largest rotation of a hold or the base in an increment, rad.
pub(super) const INCREMENT_TURN: f64 = 0.3;
/// Largest displacement of a hold or the base in an increment, relative to the length.
pub(super) const INCREMENT_MOTION: f64 = 0.05;
/// Smallest increment, as a part of the load path.
pub(super) const SMALLEST_INCREMENT: f64 = 1e-6;
/// Distance of two places that are one, relative to the length.
pub(super) const SAME: f64 = 1e-9;
