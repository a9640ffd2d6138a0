//! Properties of every equilibrium: the couples balance at every point, and the energy is
//! stationary. The energy is a minimum if the solver reports a stable rod. Strains, moments and
//! energies are computed from frames and positions by formulas in this file.
//!
//! `MORPHOROD_SCENES=5000 MORPHOROD_SEED=7 cargo test --workspace --test all laws_of_nature` sets
//! the number of random rods and their seed.

use std::f64::consts::PI;

use crate::fixtures::random::{Draw, number};
use morphorod::constitutive::{Constitutive, LinearElastic};
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::load::{ApicalForce, Distributed, Load, Weight};
use morphorod::profile::{Place, Profile};
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};
use nalgebra::{UnitQuaternion, Vector3};

/// Number of elements. Between nodes, frames and their derivatives are of fourth order in the
/// length of the elements. The error with this number of elements is 1e-9.
const ELEMENTS: usize = 96;
const STEPS: usize = 600;

/// A rod under loads that are given by formulas.
struct Case {
    length: f64,
    /// Radius at the base, m.
    radius: f64,
    /// Relative decrease of the radius from the base to the apex.
    taper: f64,
    tissue: LinearElastic,
    density: f64,
    apical: Vector3<f64>,
    wind: Vector3<f64>,
    /// Coefficients a and b of the intrinsic strain u*(s) = a + b s/ℓ, 1/m.
    strain: [Vector3<f64>; 2],
    scene: Still,
}

impl Case {
    fn draw(draw: &mut Draw) -> Self {
        let radius = draw.log(1e-5, 1e-1);
        let length = radius * draw.log(20.0, 500.0);
        let tissue = LinearElastic {
            youngs_modulus: draw.log(1e4, 1e11),
            poissons_ratio: draw.uniform(-0.5, 0.5),
        };
        let stiffness = tissue.youngs_modulus * PI * radius.powi(4) / 4.0;
        // The unit of the loads is a force that bends the rod by about a radian.
        let force = stiffness / (length * length);
        Self {
            length,
            radius,
            taper: if draw.chance(0.5) {
                draw.uniform(0.0, 0.4)
            } else {
                0.0
            },
            tissue,
            density: draw.log(1e-2, 30.0) * force / (9.81 * PI * radius * radius * length),
            apical: if draw.chance(0.5) {
                draw.vector(3.0 * force)
            } else {
                Vector3::zeros()
            },
            wind: if draw.chance(0.5) {
                draw.vector(5.0 * force / length)
            } else {
                Vector3::zeros()
            },
            strain: [draw.vector(2.0 / length), draw.vector(2.0 / length)],
            scene: Still::tilted(draw.uniform(-3.1, 3.1)),
        }
    }

    fn radius_at(&self, s: f64) -> f64 {
        self.radius * (1.0 - self.taper * s / self.length)
    }

    fn stiffness(&self, s: f64) -> Vector3<f64> {
        let moment = PI * self.radius_at(s).powi(4) / 4.0;
        let (young, shear) = (
            self.tissue.youngs_modulus,
            self.tissue.youngs_modulus / (2.0 * (1.0 + self.tissue.poissons_ratio)),
        );
        Vector3::new(young * moment, young * moment, 2.0 * shear * moment)
    }

    fn intrinsic(&self, s: f64) -> Vector3<f64> {
        self.strain[0] + self.strain[1] * (s / self.length)
    }

    /// The force per length, N/m.
    fn force(&self, s: f64) -> Vector3<f64> {
        self.wind - Vector3::z() * (9.81 * self.density * PI * self.radius_at(s).powi(2))
    }

    /// The equilibrium, and the number of directions in which its energy decreases.
    fn solve(&self, stable_only: bool) -> (Rod, usize) {
        let nodes: Vec<f64> = (0..=ELEMENTS)
            .map(|k| k as f64 / ELEMENTS as f64 * self.length)
            .collect();
        let section = |s: f64| self.radius_at(s);
        let mut rod = Rod::straight(&nodes, section, self.scene.base, Order::Eight).unwrap();
        rod.set_intrinsic(|point| self.intrinsic(self.length - point.apex_distance));
        let mut solver = NewtonSolver {
            tolerance: 1e-13,
            stable_only,
            ..NewtonSolver::default()
        };
        let (law, load): (&dyn Constitutive, &dyn Load) = (&self.tissue, &self.loads());
        let found = solver
            .solve(&mut rod, &law, &load, &self.scene.environment(0.0))
            .unwrap();
        (rod, found.inertia.negative)
    }

    fn loads(
        &self,
    ) -> (
        Weight,
        ApicalForce<impl Fn(f64) -> Vector3<f64> + use<>>,
        Distributed,
    ) {
        let pull = self.apical;
        (
            Weight {
                density: self.density,
            },
            ApicalForce(move |_| pull),
            Distributed(self.wind),
        )
    }

    /// The profile at the ends and midpoints of steps.
    fn places(&self, rod: &Rod) -> Vec<Place> {
        let (loads, environment) = (self.loads(), self.scene.environment(0.0));
        let (law, load): (&dyn Constitutive, &dyn Load) = (&self.tissue, &loads);
        Profile::of(rod, &law, &load, &environment).sample(2 * STEPS + 1)
    }

    /// Energy of the shape (J) with the given strain (1/m) at the ends and midpoints of steps.
    /// Frames and positions are integrated by the classical Runge–Kutta method, and energies by
    /// Simpson's rule.
    fn energy(&self, strain: &[Vector3<f64>]) -> f64 {
        let h = self.length / STEPS as f64;
        let density = |k: usize, p: &Vector3<f64>| {
            let s = 0.5 * h * k as f64;
            let elastic = strain[k] - self.intrinsic(s);
            0.5 * elastic.component_mul(&elastic).dot(&self.stiffness(s)) - self.force(s).dot(p)
        };
        let (mut q, mut p) = (*self.scene.base.quaternion(), Vector3::zeros());
        let mut energy = 0.0;
        for k in 0..STEPS {
            let rate = |q: &nalgebra::Quaternion<f64>, u: &Vector3<f64>| {
                let turn = nalgebra::Quaternion::from_imag(*u);
                (
                    q * turn * 0.5,
                    UnitQuaternion::new_unchecked(*q) * Vector3::z(),
                )
            };
            let [start, middle, end] = [strain[2 * k], strain[2 * k + 1], strain[2 * k + 2]];
            let (q1, p1) = rate(&q, &start);
            let (q2, p2) = rate(&(q + q1 * (0.5 * h)), &middle);
            let (q3, p3) = rate(&(q + q2 * (0.5 * h)), &middle);
            let (q4, p4) = rate(&(q + q3 * h), &end);
            // The midpoint is that of the cubic Hermite interpolant between both ends.
            let next = p + (p1 + p2 * 2.0 + p3 * 2.0 + p4) * (h / 6.0);
            let next_q = (q + (q1 + q2 * 2.0 + q3 * 2.0 + q4) * (h / 6.0)).normalize();
            let beyond = UnitQuaternion::new_unchecked(next_q) * Vector3::z();
            let half = (p + next) * 0.5 + (p1 - beyond) * (h / 8.0);
            energy += h / 6.0
                * (density(2 * k, &p)
                    + 4.0 * density(2 * k + 1, &half)
                    + density(2 * k + 2, &next));
            (p, q) = (next, next_q);
        }
        energy - self.apical.dot(&p)
    }

    /// The first and second derivatives of the energy along a change of the strain.
    fn variations(&self, strain: &[Vector3<f64>], change: &[Vector3<f64>]) -> (f64, f64) {
        let at = |size: f64| {
            let moved: Vec<Vector3<f64>> = strain
                .iter()
                .zip(change)
                .map(|(u, v)| u + v * size)
                .collect();
            self.energy(&moved)
        };
        let e = 3e-3;
        let [a, b, zero, c, d] = [-2.0 * e, -e, 0.0, e, 2.0 * e].map(at);
        (
            (8.0 * (c - b) - (d - a)) / (12.0 * e),
            (16.0 * (c + b) - (d + a) - 30.0 * zero) / (12.0 * e * e),
        )
    }

    /// A change of the strain by five random waves, of about a radian over the length.
    fn waves(&self, draw: &mut Draw) -> Vec<Vector3<f64>> {
        let waves: Vec<Vector3<f64>> = (0..5).map(|_| draw.vector(1.0 / self.length)).collect();
        let at = |s: f64| {
            waves
                .iter()
                .enumerate()
                .map(|(k, wave)| wave * (k as f64 * PI * s).cos())
                .sum()
        };
        (0..=2 * STEPS)
            .map(|k| at(k as f64 / (2 * STEPS) as f64))
            .collect()
    }

    /// E I/ℓ at the base, and its sum with the work of the loads, N m.
    fn scale(&self) -> (f64, f64) {
        let stiffness = self.stiffness(0.0).x / self.length;
        let work = (self.apical.norm()
            + (0..=4)
                .map(|k| self.force(0.25 * k as f64 * self.length).norm())
                .sum::<f64>()
                * 0.2
                * self.length)
            * self.length;
        (stiffness, stiffness + work)
    }
}

/// Norm of the difference between the couple K (u − u*) at a place and the moment of all forces
/// beyond it, N m. Both are computed from frames and positions alone.
fn unbalanced(case: &Case, places: &[Place], k: usize) -> f64 {
    let h = case.length / (2 * STEPS) as f64;
    // The difference formula is of fourth order in twice the spacing of the places.
    let turn = |a: usize, b: usize| (places[a].frame.inverse() * places[b].frame).scaled_axis();
    let (near, far) = (
        turn(k - 1, k + 1) / (2.0 * h),
        turn(k - 2, k + 2) / (4.0 * h),
    );
    let strain = (near * 4.0 - far) / 3.0;
    let couple = case
        .stiffness(places[k].arc_length)
        .component_mul(&(strain - case.intrinsic(places[k].arc_length)));
    let here = places[k].position;
    let arm = |j: usize| (places[j].position - here).cross(&case.force(places[j].arc_length));
    let beyond = (k..2 * STEPS)
        .step_by(2)
        .map(|j| (arm(j) + arm(j + 1) * 4.0 + arm(j + 2)) * (h / 3.0));
    let moment: Vector3<f64> =
        beyond.sum::<Vector3<f64>>() + (places[2 * STEPS].position - here).cross(&case.apical);
    (places[k].frame * couple - moment).norm()
}

#[test]
fn couples_balance_and_stable_equilibria_minimise_the_energy() {
    let (scenes, seed) = (number("MORPHOROD_SCENES", 150), number("MORPHOROD_SEED", 1));
    let (mut residual, mut slope) = (0.0_f64, 0.0_f64);
    for scene in 0..scenes {
        let mut draw = Draw::new(seed.wrapping_mul(1_000_003).wrapping_add(scene));
        let case = Case::draw(&mut draw);
        let (rod, negative) = case.solve(true);
        assert_eq!(negative, 0, "scene {scene}");
        let places = case.places(&rod);
        let (stiffness, scale) = case.scale();
        for k in (2..2 * STEPS - 2).step_by(74) {
            residual = residual.max(unbalanced(&case, &places, k) / scale);
        }
        let strain: Vec<Vector3<f64>> = places.iter().map(|place| place.strain).collect();
        for _ in 0..3 {
            let (first, second) = case.variations(&strain, &case.waves(&mut draw));
            slope = slope.max(first.abs() / scale);
            assert!(
                second > 1e-4 * stiffness,
                "scene {scene}: {second:e} beside {stiffness:e}"
            );
        }
    }
    println!(
        "{scenes} rods: couples unbalanced by {residual:.1e}, the energy's slope is {slope:.1e}"
    );
    // The strain of the elements and the strain of the difference formula have errors of 1e-9. The
    // energy is computed from the strain of the profile, which has a smaller error. The rounding
    // error of the energy, divided by the size of the change, is at least 1e-13.
    assert!(residual < 1e-8 && slope < 1e-10, "{residual:e} {slope:e}");
}

/// An upright rod above the critical load is in equilibrium, but its energy decreases when it
/// tilts.
#[test]
fn energy_of_an_unstable_upright_rod_decreases_along_its_first_mode() {
    let mut draw = Draw::new(3);
    let upright = Case {
        apical: Vector3::zeros(),
        wind: Vector3::zeros(),
        strain: [Vector3::zeros(); 2],
        scene: Still::upright(),
        taper: 0.0,
        ..Case::draw(&mut draw)
    };
    // Greenhill's limit is q ℓ³/(E I) = 7.8373.
    for (load, falls) in [(7.8, false), (7.9, true)] {
        let density = load * upright.stiffness(0.0).x
            / (9.81 * PI * upright.radius.powi(2) * upright.length.powi(3));
        let case = Case {
            density,
            ..Case {
                strain: upright.strain,
                scene: Still::upright(),
                ..upright
            }
        };
        let (rod, negative) = case.solve(false);
        assert_eq!(negative, if falls { 2 } else { 0 });
        let strain: Vec<Vector3<f64>> =
            case.places(&rod).iter().map(|place| place.strain).collect();
        // The second derivative along this approximation of the first mode exceeds the lowest one
        // by less than half a percent.
        let lean: Vec<Vector3<f64>> = (0..=2 * STEPS)
            .map(|k| Vector3::y() / case.length * mode(k as f64 / (2 * STEPS) as f64))
            .collect();
        let (first, second) = case.variations(&strain, &lean);
        let scale = case.scale().1;
        assert!(
            first.abs() < 1e-8 * scale && (second < 0.0) == falls,
            "{load}: {first:e} {second:e}"
        );
    }
}

/// θ' of the buckling mode of a rod under its own weight, as a series in (1 − x)³. The mode
/// satisfies θ'' = −λ (1 − x) θ with θ(0) = 0 and θ'(1) = 0.
fn mode(x: f64) -> f64 {
    let cube = 7.837_347 * (1.0 - x).powi(3);
    let (mut term, mut sum) = (1.0, 0.0);
    // θ = Σ (−λ)ⁿ y³ⁿ/Π 3k (3k − 1), y = 1 − x.
    for n in 1..12 {
        let m = 3.0 * f64::from(n);
        term *= -cube / (m * (m - 1.0));
        sum -= m * term;
    }
    sum / (1.0 - x).max(1e-9)
}
