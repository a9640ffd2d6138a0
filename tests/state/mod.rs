//! The state as a value: saved, restored, changed, inspected.

mod any_call;
mod change_of_course;
mod checkpoints;
mod foreign_states;
mod order_after_changes;
mod state_is_a_value;
