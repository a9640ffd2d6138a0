//! Growth, tropism and the variables they keep, one law at a time.

mod careless_laws;
mod growth_integrated;
mod growth_motion;
mod laws_in_parts;
mod laws_of_nature;
mod memories;
mod profile;
mod statoliths;
