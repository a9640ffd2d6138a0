//! Tests of single growth laws and tropism laws, and of the variables that tropism laws keep.

mod careless_laws;
mod checked_laws;
mod drives;
mod growth_integrated;
mod growth_motion;
mod kernels;
mod known_experiments;
mod laws_in_parts;
mod laws_of_nature;
mod light;
mod memories;
mod profile;
mod statoliths;
mod touch;
mod waving_roots;
