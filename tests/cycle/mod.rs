//! Limit cycles, their multipliers and their branches.

mod bad_cycles;
mod branches;
mod circular_orbit;
mod cycles;
mod rosettes;
