//! Characteristic roots, critical parameters and their error estimates.

mod edges;
mod extreme;
mod held;
mod held_in_time;
mod held_refusals;
mod isolated;
mod laws;
mod many_memories;
mod onset;
mod proprioception;
mod refinement;
mod refusals;
mod roots;
mod steady;
