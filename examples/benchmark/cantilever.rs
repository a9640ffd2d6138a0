//! A clamped beam with a small force at its tip.

use std::f64::consts::FRAC_PI_2;

use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::load::ApicalForce;
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};
use nalgebra::Vector3;

use crate::Measured;
use crate::measure::measure;
use crate::report::{Program, Row};

/// Length, m.
const LENGTH: f64 = 1.0;
/// Radius, m.
const RADIUS: f64 = 0.02;
/// The shear modulus is E/3.
const MATERIAL: LinearElastic = LinearElastic {
    youngs_modulus: 1e6,
    poissons_ratio: 0.5,
};
/// Force downwards, N.
const FORCE: f64 = 7.5e-3;
/// Number of elements of the mesh whose error is neglected.
const FINE: usize = 32;

/// Solves the experiment on several meshes.
pub fn measured(quick: bool) -> Measured {
    let reference = FORCE * LENGTH.powi(3) / (3.0 * MATERIAL.stiffness(RADIUS).x);
    let scene = Still {
        gravity: Vector3::zeros(),
        ..Still::tilted(FRAC_PI_2)
    };
    let load = ApicalForce(|_t: f64| -Vector3::z() * FORCE);
    let mut solver = NewtonSolver::default();
    let mut deflection = |elements: usize| {
        measure(quick, || {
            let mut rod = Rod::uniform(LENGTH, RADIUS, scene.base, elements, Order::Eight)?;
            let _ = solver.solve(&mut rod, &MATERIAL, &load, &scene.environment(0.0))?;
            Ok(-rod.tip().z)
        })
    };
    let (exact, _) = deflection(FINE)?;
    let meshes: &[usize] = if quick { &[1] } else { &[1, 2, 4] };
    let row = |&elements: &usize| {
        let (found, seconds) = deflection(elements)?;
        let error = (found / reference - 1.0).abs();
        let discretisation = Some((found / exact - 1.0).abs());
        let program = Program::Morphorod;
        Ok(Row {
            experiment: "cantilever",
            tension: None,
            program,
            elements,
            error,
            discretisation,
            seconds,
        })
    };
    meshes.iter().map(row).collect()
}
