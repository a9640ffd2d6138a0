//! A cable that is pinned at both ends, under its weight.

use std::error::Error;
use std::f64::consts::{FRAC_PI_2, PI};

use morphorod::constitutive::{LinearElastic, Timoshenko};
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver, Unloaded};
use morphorod::load::Weight;
use morphorod::rod::Rod;
use morphorod::support::{Hold, Joint};
use morphorod::{Order, Scene, Still};
use nalgebra::Vector3;

use crate::Measured;
use crate::measure::measure;
use crate::report::{Program, Row, bisected};

/// Length without stretch, m.
const LENGTH: f64 = 1.0;
/// Distance of the pins, m.
const SPAN: f64 = 0.8;
/// Radius, m.
const RADIUS: f64 = 0.005;
/// The shear modulus is E/3.
const MATERIAL: LinearElastic = LinearElastic {
    youngs_modulus: 1e6,
    poissons_ratio: 0.5,
};
/// Density, kg/m³.
const WEIGHT: Weight = Weight { density: 1000.0 };
/// Number of elements of the mesh whose error is neglected.
const FINE: usize = 128;
/// Number of places at which shapes are compared.
const PLACES: usize = 101;

/// Elastic catenary between pins at equal heights.
struct Catenary {
    /// Horizontal force, N.
    tension: f64,
    /// Weight per length without stretch, N/m.
    weight: f64,
    /// Stiffness to stretch E A, N.
    stiffness: f64,
}

impl Catenary {
    /// The catenary of the experiment, with gravity in m/s².
    fn of(gravity: f64) -> Self {
        let area = PI * RADIUS * RADIUS;
        let with = |tension| Self {
            tension,
            weight: WEIGHT.density * area * gravity,
            stiffness: 1e6 * area,
        };
        // The span increases with the tension.
        with(bisected((1e-3, 1e3), |tension| {
            with(tension).at(LENGTH).x > SPAN
        }))
    }

    /// Place of the tissue at a distance from the first pin along the cable without stretch, m.
    fn at(&self, s: f64) -> Vector3<f64> {
        // Vertical part of the tension: at the first pin, which bears half of the weight, and at s.
        let first = 0.5 * self.weight * LENGTH;
        let here = self.weight * s - first;
        let hang = (here / self.tension).asinh() + (first / self.tension).asinh();
        let rise = self.tension.hypot(here) - self.tension.hypot(first);
        let stretch = Vector3::new(self.tension * s, 0.0, 0.5 * self.weight * s * s - first * s)
            / self.stiffness;
        Vector3::new(self.tension * hang, 0.0, rise) / self.weight + stretch
    }

    /// Distance of a place from the curve, m. `s` is the distance of its tissue along the cable.
    /// The nearest place of the curve is close to that of the same tissue.
    fn distance(&self, place: &Vector3<f64>, s: f64) -> f64 {
        let (mut nearest, step) = (s, 1e-6);
        for _ in 0..3 {
            let tangent = (self.at(nearest + step) - self.at(nearest - step)) / (2.0 * step);
            nearest += (place - self.at(nearest)).dot(&tangent) / tangent.norm_squared();
        }
        (place - self.at(nearest.clamp(0.0, LENGTH))).norm()
    }
}

/// Places of the cable in equilibrium, m. The search begins with a circular arc.
fn hanging(
    solver: &mut NewtonSolver,
    elements: usize,
) -> Result<Vec<Vector3<f64>>, Box<dyn Error>> {
    let half = bisected((1e-3, PI), |half| half.sin() / half < SPAN / LENGTH);
    let scene = Still::tilted(FRAC_PI_2 + half);
    let environment = scene.environment(0.0);
    let mut rod = Rod::uniform(LENGTH, RADIUS, scene.base, elements, Order::Eight)?;
    rod.set_intrinsic(|_| -Vector3::y() * (2.0 * half / LENGTH));
    let _ = Unloaded.solve(&mut rod, &MATERIAL, &(), &environment)?;
    rod.set_intrinsic(|_| Vector3::zeros());
    let pins = (Joint::Ball, Hold::apex().at(Vector3::x() * SPAN));
    let material = Timoshenko::circular(MATERIAL);
    let held = solver.solve_held(&mut rod, &material, &WEIGHT, &pins, &environment)?;
    Ok(held.rod.centre_line_at(PLACES))
}

/// Solves the experiment on several meshes.
pub fn measured(quick: bool) -> Measured {
    let catenary = Catenary::of(Still::upright().gravity.norm());
    let mut solver = NewtonSolver::default();
    let exact = hanging(&mut solver, FINE)?;
    let meshes: &[usize] = if quick { &[8] } else { &[4, 8, 16, 32] };
    let row = |&elements: &usize| {
        let (places, seconds) = measure(quick, || hanging(&mut solver, elements))?;
        let tissue = |i: usize| LENGTH * i as f64 / (PLACES - 1) as f64;
        let distances = places
            .iter()
            .enumerate()
            .map(|(i, place)| catenary.distance(place, tissue(i)));
        let error = distances.fold(0.0, f64::max) / LENGTH;
        let differences = places
            .iter()
            .zip(&exact)
            .map(|(place, exact)| (place - exact).norm());
        let discretisation = Some(differences.fold(0.0, f64::max) / LENGTH);
        let program = Program::Morphorod;
        Ok(Row {
            experiment: "catenary",
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
