//! The thickest pole that a planar coil holds without friction (Goriely and Neukirch 2006, Phys.
//! Rev. Lett. 97, 184302).
//!
//! A rod with the intrinsic curvature κ* is wound on a pole of radius R. Between the arc in contact
//! and the tip, which touches the pole, a bridge is free. The angle of the tip to the surface
//! increases with κ* R, and the equilibrium ceases to exist at a fold, close to a tip perpendicular
//! to the surface.

use std::error::Error;

use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::rod::Rod;
use morphorod::support::{Contact, Cylinder};
use morphorod::{Order, Scene, Still};
use nalgebra::Vector3;

/// Largest κ* R, by shooting with the elastica of the bridge in independent code, six digits.
pub const FOLD: f64 = 3.30927;
/// Radius of the pole, length and radius of the rod, m.
const SIZE: [f64; 3] = [0.01, 0.032, 0.5e-3];

/// Follows the coil with increasing κ* R. Returns the angle of the tip to the surface (°) and κ* R.
pub fn follow() -> Result<Vec<(f64, f64)>, Box<dyn Error>> {
    let [radius, length, thickness] = SIZE;
    let tissue = LinearElastic {
        youngs_modulus: 1e7,
        poissons_ratio: 0.5,
    };
    let environment = Still::weightless().environment(0.0);
    let pole = Cylinder {
        through: Vector3::x() * radius,
        along: Vector3::y(),
        radius,
    };
    let support = Contact {
        obstacle: pole,
        radius: 0.0,
        friction: 0.0,
    };
    let mut rod = Rod::uniform(length, thickness, Still::upright().base, 20, Order::Eight)?;
    rod.set_intrinsic(|_| Vector3::y() * (0.9 / radius));
    // The coil is stable in its plane only.
    let mut solver = NewtonSolver {
        stable_only: false,
        ..NewtonSolver::default()
    };
    let _ = solver.solve(&mut rod, &tissue, &(), &environment)?;
    let mut angles = Vec::new();
    // With longer steps the search for an unstable equilibrium may converge to one outside the
    // plane.
    let equal_steps = (22..=60).map(|twentieths| f64::from(twentieths) / 20.0);
    for product in equal_steps.chain([3.1, 3.2, 3.25, 3.28, 3.3, 3.305, 3.307]) {
        rod.set_intrinsic(|_| Vector3::y() * (product / radius));
        let held = solver.solve_held(&mut rod, &tissue, &(), &support, &environment)?;
        let outward = held.rod.tip() - pole.through;
        let tangent = held.rod.apex_frame() * Vector3::z();
        let angle = f64::atan2(-tangent.dot(&outward), tangent.cross(&outward).norm()).to_degrees();
        angles.push((angle, product));
    }
    Ok(angles)
}

/// The largest κ* R, which is a maximum as a function of the angle: that of the parabola through
/// the last three points. NaN for fewer points.
pub fn fold(angles: &[(f64, f64)]) -> f64 {
    let [.., a, b, c] = angles[..] else {
        return f64::NAN;
    };
    let slope = |a: (f64, f64), b: (f64, f64)| (b.1 - a.1) / (b.0 - a.0);
    let bend = (slope(b, c) - slope(a, b)) / (c.0 - a.0);
    let first = slope(b, c) + bend * (c.0 - b.0);
    c.1 - first * first / (4.0 * bend)
}
