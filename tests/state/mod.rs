//! Tests of the state of a shoot: saving, restoring, changing and comparing states, and replacing
//! laws.

mod any_call;
mod change_of_course;
mod checkpoints;
mod foreign_states;
mod order_after_changes;
mod removed_supports;
mod state_is_a_value;
