//! Equilibria of rods with supports: holds, springs, elastic joints, and contacts with obstacles.
//!
//! An iteration factorises the tangent of the rod with the present contact forces as dead loads.
//! The response of this linear rod at its [candidates](candidate), the places that may touch an
//! obstacle, is a small matrix. On it the complete problem of unilateral contact with Coulomb
//! friction is solved ([`reduced`]), with the exact shapes of the obstacles. Which contacts are
//! open, stick or slide is part of the solution.
//!
//! | term | meaning |
//! |---|---|
//! | site | place with a hold or a spring |
//! | candidate | place that may touch an obstacle: a point, where the gap is least, or a station of a segment |
//! | segment | part of the rod that follows an obstacle; its stations are quadrature points with pressure |
//! | patch | point or segment of contact in the result |
//! | link | condition of a hold, a spring, an increased pivot of the tangent, or the spring at a free base |
//! | shift | force that, times the length that belongs to a frame, is added to the diagonal of the tangent, N |
//! | descent | the iteration with a shift that makes the tangent positive in permitted directions before each step |
//! | step | motion of the rod in an iteration; the contact problem of the linear rod has its own steps ([`solve`]) |
//! | share | part of the residual that the linear step removes |
//! | fraction | part of this step by which the rod moves |
//! | progress | part of the load path that is done |
//! | factor | number by which a motion may be longer without passing an obstacle |
//! | end | last frame of an element; place where a segment ends ([`ends`]); of the rod: the apex, or a free base |
//! | increment | part of the motion of holds, base and obstacles, and the time step to which it belongs |
//! | jump | motion in an increment that no branch of equilibria explains |
//! | valley | shapes of least energy across a direction in which the energy changes little |
//!
//! ```text
//! run
//!   follow                         compares the equilibrium with that before a time step        path
//!   move_holds                     increments of holds, base and obstacles                      path
//!     release                      the energy that an increment releases: a jump?               continuation
//!   settle                         Newton's method; if it fails, a descent nearby, then to any path
//!     find                         iterates, and once more without moving nodes if that fails  newton
//!       iterate                    until the rod is in equilibrium on nodes at the contacts    newton
//!         drop, add candidates                                                                 newton, candidates
//!         step                     attempts with a larger shift of the tangent each            newton
//!           attempt                                                                            attempt
//!             factorise            tangent with contact forces as dead loads, and the shift    search
//!             linearise            compliance between holds, springs and candidates            linearise, response
//!             test_tangent         straight rods, negative directions                          attempt, saddle
//!             solve_trial          contact problem, and the step of the rod                    step, reduced, solve
//!             leave_saddle         instead of steps that stagnate at a saddle                  saddle
//!             fit                  a share of the residual whose step is in range              attempt
//!               correct            return to the conditions, with the same factors             step
//!             add_to               candidates where the step penetrates; a new linear rod      attempt
//!             descend              first fraction of the step that is an improvement           merit
//!               reach_floor        corrections across the step                                 valley
//!         try_to_finish            after a whole step without a shift                          newton
//!           chord                  further steps with the same factors                         step
//!           move_nodes             nodes to the contacts and to the ends of segments           newton, placement
//!           find_inertia           number of negative directions that the supports permit      newton, inertia
//! ```
//!
//! In a search for a stable equilibrium, an attempt that is not accepted has one of these outcomes.
//! In contact, Newton's method does not test the tangent before a step, since it may be negative on
//! the way to a stable equilibrium. In contact and with a shift it does not test the tangent, and
//! rejects what is lost without a shift.
//!
//! | what is found | Newton's method in contact, without a shift | a descent, or a rod without contact |
//! |---|---|---|
//! | the rod is too straight to yield to a violated condition | it is bent: moved | the same |
//! | the tangent is negative in a permitted direction | lost, if the line search shortens the step | rejected |
//! | the step is not finite, or longer than 10 rad | lost if the tangent is negative, rejected otherwise | rejected |
//! | no share of the step is in range | lost; rejected if nodes have moved before | rejected |
//! | no fraction of the step is an improvement | lost if the tangent is negative, rejected otherwise | rejected |
//! | the steps stagnate at a saddle | – | moved; an error after four saddles without less energy |
//!
//! A rejected attempt is repeated with a larger shift, up to a largest one, where the iteration
//! fails. With a shift, a step that is not finite is an error. A lost attempt makes the iteration
//! fail. The next way of [`trial::Reach`], if there is one, begins again from the initial guess; a
//! search for a stable equilibrium without obstacles has only Newton's method. A search for an
//! unstable equilibrium rejects no tangent and no long step. It is lost where the number of
//! negative directions is larger by more than `settings::PASSED` than at first.

mod attempt;
mod candidate;
mod candidates;
mod checks;
mod complementarity;
mod continuation;
mod elastic;
mod ends;
mod failure;
mod increment;
mod inertia;
mod law;
mod line;
mod linear;
mod linearise;
mod mechanics;
mod merit;
mod nearby;
mod newton;
mod obstacles;
mod path;
mod placement;
mod press;
mod reactions;
mod reduced;
mod response;
mod saddle;
mod search;
mod settings;
mod sites;
mod solve;
mod step;
mod trial;
mod valley;

pub(super) use line::jump_between;
pub(super) use mechanics::Body;
pub(super) use search::HeldSearch;
