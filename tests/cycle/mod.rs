//! Periodic orbits of shoots, their multipliers and their branches.

mod absent_orbits;
mod branches;
mod circular_orbit;
mod complete_lists;
mod cycles;
mod extreme_orbits;
mod orbits_in_time;
mod random_orbits;
mod relative_orbits;
mod resolution;
mod rosettes;

use std::fmt::Display;
use std::rc::Rc;

use crate::fixtures::exact_orbit::GROWTH_TIME;
use crate::fixtures::shoots::{Reduced, reduced};
use approx::abs_diff_eq;
use morphorod::cycle::{CycleError, Disturbances};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::stability::{Linearisation, Root};
use morphorod::{DynLaws, Shoot, ShootBuilder};
use nalgebra::Complex;

/// A shoot of any length (m) whose growth zone is the whole shoot, with elements of equal length.
fn shoot(length: f64, elements: u32) -> ShootBuilder<Reduced> {
    let nodes: Vec<f64> = (0..=elements).map(|i| length * f64::from(i) / f64::from(elements)).collect();
    reduced(length, GROWTH_TIME).growth(Ongoing(UniformGrowth { zone_length: 1.0, time: GROWTH_TIME })).nodes(&nodes)
}

/// The leading mode of a shoot about its stationary state.
fn mode(shoot: &Shoot<DynLaws>) -> Root {
    Linearisation::about(shoot).unwrap().rightmost().unwrap()
}

/// Quantities of disturbances in the plane of an orbit and out of it. Fails for an orbit without a plane.
fn planes<T: Clone>(disturbances: &Disturbances<T>) -> [Vec<T>; 2] {
    match disturbances {
        Disturbances::Planar { in_plane, out_of_plane } => [in_plane.clone(), out_of_plane.clone()],
        Disturbances::Spatial(_) => panic!("the orbit does not lie in a plane"),
    }
}

/// A family of shoots along a parameter. All families are of one type, so that branches are
/// compiled once for each solver.
fn family(
    shoots: impl Fn(f64) -> Result<Shoot<DynLaws>, CycleError> + 'static,
) -> impl FnMut(f64) -> Result<Shoot<DynLaws>, CycleError> + Clone {
    shared_family(Rc::new(shoots))
}

/// This function is not generic: its closure has the same type for all families.
fn shared_family(
    shoots: Rc<dyn Fn(f64) -> Result<Shoot<DynLaws>, CycleError>>,
) -> impl FnMut(f64) -> Result<Shoot<DynLaws>, CycleError> + Clone {
    move |parameter| shoots(parameter)
}

/// Fails unless two complex numbers of a case differ by at most the tolerance. `approx` compares no
/// complex numbers without a feature.
#[track_caller]
fn assert_complex_eq(case: impl Display, a: Complex<f64>, b: Complex<f64>, tolerance: f64) {
    assert!(abs_diff_eq!((a - b).norm(), 0.0, epsilon = tolerance), "{case}: {a} against {b}, tolerance {tolerance:e}");
}
