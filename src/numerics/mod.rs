//! Numerical methods that do not depend on rods: quadrature, interpolation, scalar equations, dense
//! matrices, Krylov subspaces, sines and Fourier sums.

pub(crate) mod dense;
pub(crate) mod fourier;
pub(crate) mod interpolation;
pub(crate) mod krylov;
pub(crate) mod quadrature;
pub(crate) mod scalar;
pub(crate) mod sines;
