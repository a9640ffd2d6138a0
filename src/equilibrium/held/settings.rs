//! Numbers of the search for reactions that were chosen by experiment, with their reasons.

/// Settings of the search.
pub(super) struct Settings {
    /// Largest rotation of a frame in a step, rad. The quadratic model of the energy does not hold beyond it.
    pub largest_turn: f64,
    /// Part of the radius of an obstacle by which a candidate may move in a step beyond its gap. Between candidates it
    /// is the largest displacement relative to the sum of gap and radius. The linear model of the gap holds within it,
    /// and a rod does not pass through a thin pole.
    pub approach: f64,
    /// Largest number of iterations of Newton's method or of a descent nearby. Nearly all successful searches take
    /// fewer. A descent to any equilibrium is limited by the bound of the whole search alone.
    pub iterations: usize,
    /// Largest displacement of the centre line from the initial guess in a descent nearby, relative to the length. It
    /// exceeds the motions that follow failures of Newton's method next to an equilibrium.
    pub near_motion: f64,
    /// As `near_motion`, in a descent to any equilibrium. A rod that nothing holds moves by about half of its length
    /// in each step, without end.
    pub far_motion: f64,
    /// Number of halvings of a step before the tangent is shifted instead.
    pub halvings: usize,
    /// First shift of the tangent, relative to the force in the rod.
    pub first_shift: f64,
    /// Factor by which the shift increases after a rejection. After a whole step it decreases by at least this factor.
    pub shift_factor: f64,
    /// Smallest shift, relative to the force in the rod. The steps past the end of a branch of equilibria are longer
    /// for a smaller shift.
    pub least_shift: f64,
    /// Largest shift, relative to the force in the rod or to that at which the rod buckles. Forces far from
    /// equilibrium may leave the bordered matrix indefinite at any shift.
    pub largest_shift: f64,
    /// Decrease of the merit that a step must achieve, relative to the predicted one (Armijo).
    pub decrease: f64,
    /// Relative decrease of the residual that a step must achieve otherwise.
    pub residual_decrease: f64,
    /// Ratio of the rotations in two successive steps above which Newton's method does not converge quadratically.
    pub slow: f64,
    /// Rotation in a step below which the iteration may end, and the merit is not compared without friction, rad: its
    /// change is close to rounding.
    pub small_turn: f64,
    /// Largest number of steps by which the rod returns to its conditions, with the existing factors.
    pub corrections: usize,
    /// Penetration after a corrected step, relative to the length, above which the step is shortened. The penetration
    /// before the step times 1 − share/2 is permitted in addition.
    pub permitted: f64,
    /// Largest number of times that contacts are added to a step that would penetrate an obstacle.
    pub additions: usize,
    /// Largest number of further shares for which the contact problem of a step is solved.
    pub shortenings: usize,
    /// Number of failed shares after which the next one that is out of range ends the search for a share. A share fails
    /// if its contact problem is not solved or its rotation does not decrease.
    pub failures: usize,
    /// Violation of a condition that is attributed to rounding, relative to the length.
    pub rounding: f64,
    /// Largest number of times that nodes move to contacts in a search. Afterwards the nodes stay.
    pub placements: usize,
    /// Largest motion of the end of a segment each time, relative to an element.
    pub placing_motion: f64,
    /// Rotation in a step below which nodes may move, rad.
    pub placing_turn: f64,
    /// As `placing_turn`, for a step in which the contacts keep their states.
    pub settled_turn: f64,
    /// Rotation in a step below which, with obstacles, steps with the same factors follow, rad, and their largest
    /// number.
    pub chord_turn: f64,
    pub chords: usize,
    /// Error relative to the tolerance at which these steps end. A contact whose force is almost zero must not begin
    /// and end in turn in steps of time whose errors differ.
    pub chord_error: f64,
    /// Distance of a node from the place of a contact that is not corrected, relative to the length. The error of the
    /// shape is proportional to its square, and that of the force at the end of a contact segment to itself.
    pub placed: f64,
    /// Distance within which contact points are one, and within which no station is added beside a candidate, relative
    /// to an element; shortest distance of a station inside a contact segment from its ends, relative to its element.
    pub near: f64,
    /// Second derivative of the gap along the rod, times the length, below which a contact is no point.
    pub flat: f64,
    /// Largest slope of the rod against an obstacle at a contact point.
    pub tangential: f64,
    /// Largest slope of the rod against an obstacle at a station where the rod follows the obstacle. It is about twenty
    /// times the depth to which a coarse rod penetrates between two stations, relative to their distance.
    pub steep: f64,
    /// Gap of an open contact point that is no candidate any more, relative to the length.
    pub far: f64,
    /// Largest number of saddles that are left from one with the least energy so far to the next one with less energy.
    pub saddles: usize,
    /// Largest rotation by which a saddle is left, rad: large against the rounding of the gradient, and small enough
    /// for the quadratic model.
    pub saddle_turn: f64,
    /// Number of inverse iterations for the softest direction.
    pub softenings: usize,
    /// Largest increase of the number of negative directions in a search for an unstable equilibrium.
    pub passed: usize,
    /// Largest rotation of a hold or the base in an increment, rad.
    pub increment_turn: f64,
    /// Largest displacement of a hold or the base in an increment, relative to the length.
    pub increment_motion: f64,
    /// Smallest increment, as a share of the motion of the holds.
    pub smallest_increment: f64,
}

pub(super) const SETTINGS: Settings = Settings {
    largest_turn: 0.5,
    approach: 0.5,
    iterations: 60,
    near_motion: 1e-3,
    far_motion: 1e2,
    halvings: 5,
    first_shift: 0.1,
    shift_factor: 4.0,
    least_shift: 1e-6,
    largest_shift: 1e12,
    decrease: 1e-4,
    residual_decrease: 0.2,
    slow: 0.25,
    small_turn: 1e-4,
    corrections: 6,
    additions: 8,
    shortenings: 9,
    failures: 1,
    permitted: 1e-5,
    rounding: 1e-12,
    placements: 12,
    placing_motion: 0.3,
    placing_turn: 1e-3,
    settled_turn: 1e-2,
    chord_turn: 1e-3,
    chords: 6,
    chord_error: 1e-3,
    placed: 3e-10,
    near: 0.1,
    flat: 1e-3,
    tangential: 1e-6,
    steep: 0.05,
    far: 1e-2,
    saddles: 4,
    saddle_turn: 0.1,
    softenings: 12,
    passed: 3,
    increment_turn: 0.3,
    increment_motion: 0.05,
    smallest_increment: 1e-6,
};

/// Distance of two places that are one, relative to the length.
pub(super) const SAME: f64 = 1e-9;
