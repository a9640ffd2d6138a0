//! The twist at which a straight rod under tension buckles between clamps.

use std::error::Error;

use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver, Unloaded};
use morphorod::load::ApicalForce;
use morphorod::rod::Rod;
use morphorod::support::Hold;
use morphorod::{Order, Scene, Still};
use nalgebra::{UnitQuaternion, Vector3};

use crate::Measured;
use crate::measure::measure;
use crate::report::{Program, Row, bisected};

/// Length, m.
const LENGTH: f64 = 1.0;
/// Radius, m.
const RADIUS: f64 = 0.01;
/// The shear modulus is E/3.
const MATERIAL: LinearElastic = LinearElastic {
    youngs_modulus: 1e6,
    poissons_ratio: 0.5,
};

/// Greenhill's critical couple M ℓ/B of a rod between clamps under the tension T, with `tension` =
/// T ℓ²/B.
///
/// The deflection w = x + i y satisfies B w'''' − i M w''' − T w'' = 0 and w = w' = 0 at both ends.
/// With m = M ℓ/B, τ = T ℓ²/B and k = √(m²/4 − τ) there is a solution if 2 k (cos k − cos m/2) = τ
/// sin k.
fn critical_couple(tension: f64) -> f64 {
    let couple = |k: f64| 2.0 * (k * k + tension).sqrt();
    let condition = |k: f64| 2.0 * (k.cos() - (0.5 * couple(k)).cos()) - tension * k.sin() / k;
    // The condition is negative for small k.
    let step = 1e-3;
    let mut k = step;
    while condition(k) <= 0.0 {
        k += step;
    }
    couple(bisected((k - step, k), |k| condition(k) > 0.0))
}

/// Twist at which the straight rod loses stability, rad.
fn critical_twist(
    solver: &mut NewtonSolver,
    tension: f64,
    elements: usize,
) -> Result<f64, Box<dyn Error>> {
    let stiffness = MATERIAL.stiffness(RADIUS);
    let scene = Still::weightless();
    let environment = scene.environment(0.0);
    let pull = ApicalForce(|_t: f64| Vector3::z() * (tension * stiffness.x / LENGTH.powi(2)));
    let mut stable = |twist: f64| -> Result<bool, Box<dyn Error>> {
        // The straight rod with uniform twist, which is an equilibrium.
        let mut rod = Rod::uniform(LENGTH, RADIUS, scene.base, elements, Order::Eight)?;
        rod.set_intrinsic(|_| Vector3::z() * (twist / LENGTH));
        let _ = Unloaded.solve(&mut rod, &MATERIAL, &(), &environment)?;
        rod.set_intrinsic(|_| Vector3::zeros());
        let clamp = Hold::apex()
            .on_line(Vector3::zeros(), Vector3::z_axis())
            .held(UnitQuaternion::from_axis_angle(&Vector3::z_axis(), twist));
        let held = solver.solve_held(&mut rod, &MATERIAL, &pull, &clamp, &environment)?;
        Ok(held.equilibrium.inertia.negative == 0)
    };
    // No rod, however long, buckles below the couple 2 √(B T).
    let least = 2.0 * tension.sqrt();
    let [mut low, mut high] =
        [least, least + 10.0].map(|couple| couple * stiffness.x / stiffness.z);
    while high - low > 1e-10 * high {
        let middle = 0.5 * (low + high);
        if stable(middle)? {
            low = middle
        } else {
            high = middle
        }
    }
    Ok(0.5 * (low + high))
}

/// Solves the experiment on several meshes for each tension.
pub fn measured(quick: bool) -> Measured {
    let stiffness = MATERIAL.stiffness(RADIUS);
    let mut solver = NewtonSolver {
        stable_only: false,
        ..NewtonSolver::default()
    };
    let (tensions, meshes): (&[f64], &[usize]) = if quick {
        (&[10.0], &[12])
    } else {
        (&[1.0, 10.0, 30.0], &[12, 24, 48])
    };
    let mut rows = Vec::new();
    for &tension in tensions {
        let reference = critical_couple(tension) * stiffness.x / stiffness.z;
        for &elements in meshes {
            let (found, seconds) =
                measure(quick, || critical_twist(&mut solver, tension, elements))?;
            let (error, program) = ((found / reference - 1.0).abs(), Program::Morphorod);
            let tension = Some(tension);
            rows.push(Row {
                experiment: "twist",
                tension,
                program,
                elements,
                error,
                discretisation: None,
                seconds,
            });
        }
    }
    Ok(rows)
}
