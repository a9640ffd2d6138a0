//! Characteristic roots, critical parameters and their error estimates.

mod edges;
mod extreme;
mod laws;
mod onset;
mod refinement;
mod refusals;
mod roots;
mod transient;
