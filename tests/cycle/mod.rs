//! Periodic orbits of shoots, their multipliers and their branches.

mod absent_orbits;
mod branches;
mod circular_orbit;
mod complete_lists;
mod cycles;
mod extreme_orbits;
mod held;
mod misuses;
mod onsets;
mod orbits_in_time;
mod random_orbits;
mod refused_branches;
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

/// Builder of the reduced model with a given length (m), elements of equal length and a growth zone
/// that contains the whole shoot.
fn shoot(length: f64, elements: u32) -> ShootBuilder<Reduced> {
    let nodes: Vec<f64> = (0..=elements)
        .map(|i| length * f64::from(i) / f64::from(elements))
        .collect();
    reduced(length, GROWTH_TIME)
        .growth(Ongoing(UniformGrowth {
            zone_length: 1.0,
            time: GROWTH_TIME,
        }))
        .nodes(&nodes)
}

/// Rightmost root of the linearisation about the stationary state of a shoot, with its mode.
fn mode(shoot: &Shoot<DynLaws>) -> Root {
    Linearisation::about(shoot).unwrap().rightmost().unwrap()
}

/// Quantities of disturbances in the plane of an orbit and out of it. Panics if the orbit does not
/// lie in a plane.
fn planes<T: Clone>(disturbances: &Disturbances<T>) -> [Vec<T>; 2] {
    match disturbances {
        Disturbances::Planar {
            in_plane,
            out_of_plane,
        } => [in_plane.clone(), out_of_plane.clone()],
        Disturbances::Spatial(_) => panic!("the orbit does not lie in a plane"),
    }
}

/// Family of shoots along a parameter. All families have the same type, hence the continuation is
/// compiled only once for each solver.
fn family(
    shoots: impl Fn(f64) -> Result<Shoot<DynLaws>, CycleError> + 'static,
) -> impl FnMut(f64) -> Result<Shoot<DynLaws>, CycleError> + Clone {
    shared_family(Rc::new(shoots))
}

/// Family of shoots from a shared closure. This function is not generic, and its closure has the
/// same type for all families.
fn shared_family(
    shoots: Rc<dyn Fn(f64) -> Result<Shoot<DynLaws>, CycleError>>,
) -> impl FnMut(f64) -> Result<Shoot<DynLaws>, CycleError> + Clone {
    move |parameter| shoots(parameter)
}

/// Panics unless two complex numbers differ by at most the tolerance. `approx` compares complex
/// numbers only with an optional feature.
#[track_caller]
fn assert_complex_eq(case: impl Display, a: Complex<f64>, b: Complex<f64>, tolerance: f64) {
    assert!(
        abs_diff_eq!((a - b).norm(), 0.0, epsilon = tolerance),
        "{case}: {a} against {b}, tolerance {tolerance:e}"
    );
}
