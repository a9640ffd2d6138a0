//! Characteristic roots, critical parameters and their error estimates.

mod edges;
mod extreme;
mod isolated;
mod laws;
mod many_memories;
mod onset;
mod refinement;
mod refusals;
mod roots;
mod steady;
