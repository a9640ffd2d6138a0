//! Numerical methods that do not depend on rods: quadrature, interpolation, scalar equations and Krylov subspaces.

pub(crate) mod interpolation;
pub(crate) mod krylov;
pub(crate) mod quadrature;
pub(crate) mod scalar;
