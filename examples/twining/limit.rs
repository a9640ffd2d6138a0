//! Rod with intrinsic curvature κ* and twist τ* that is wound round a pole without friction: closed
//! form and rod.
//!
//! A helix of pitch angle α on a cylinder of radius R has the curvature κ = cos²α/R and the torsion
//! τ = sin α cos α/R. If force and couple along the axis vanish, α minimises the energy, and
//! tension and pressure are
//!
//! ```text
//! B (κ − κ*) 2τ = C (τ − τ*) cos(2α)/R,   n_b = C (τ − τ*) κ − B (κ − κ*) τ,   n_t = −n_b/tan α,   p = n_t κ − n_b τ.
//! ```
//!
//! The pressure vanishes at R = κ*/(κ*² + τ*²), the radius of the free helix, and is positive for
//! larger R. Thinner poles are not held along the whole contact.

use std::error::Error;
use std::f64::consts::PI;
use std::path::Path;

use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::load::ApicalForce;
use morphorod::rod::Rod;
use morphorod::support::{Contact, Cylinder, Hold};
use morphorod::{Order, Scene, Still};
use morphorod_plot::{Axes, Figure, Series, Style, Table, println};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::coil::{FOLD, fold, follow};
use crate::{RADIUS, Setup};

/// Elastic law of the rod, weightless.
const TISSUE: LinearElastic = LinearElastic {
    youngs_modulus: 1e7,
    poissons_ratio: 0.5,
};
/// Number of elements in a quarter of a turn.
const ELEMENTS: usize = 24;

/// Helix on a cylinder in equilibrium without axial force and couple.
struct Helix {
    /// Radius of the cylinder to the centre line, m.
    radius: f64,
    /// Pitch angle α, rad.
    pitch: f64,
    curvature: f64,
    torsion: f64,
    /// Components of the force along the binormal and the tangent, N.
    force: [f64; 2],
    /// Force of the cylinder per length, N/m.
    pressure: f64,
}

impl Helix {
    /// The helix on a cylinder of a radius (m) for an intrinsic curvature and twist (1/m).
    fn new(radius: f64, [curvature, twist]: [f64; 2]) -> Self {
        let (bending, twisting) = (TISSUE.stiffness(RADIUS).x, TISSUE.stiffness(RADIUS).z);
        let strain = |pitch: f64| {
            (
                pitch.cos().powi(2) / radius,
                pitch.sin() * pitch.cos() / radius,
            )
        };
        // Derivative of the energy by the pitch angle. It is negative for a flat coil, and positive
        // at π/4 or beyond.
        let slope = |pitch: f64| {
            let (kappa, tau) = strain(pitch);
            twisting * (tau - twist) * (2.0 * pitch).cos() / radius
                - bending * (kappa - curvature) * 2.0 * tau
        };
        let (mut low, mut high) = (0.0, 0.5 * PI);
        // Sixty halvings reach the spacing of the numbers.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if slope(middle) < 0.0 {
                low = middle
            } else {
                high = middle
            }
        }
        let (kappa, tau) = strain(low);
        let across = twisting * (tau - twist) * kappa - bending * (kappa - curvature) * tau;
        let along = -across / low.tan();
        let pressure = along * kappa - across * tau;
        Self {
            radius,
            pitch: low,
            curvature: kappa,
            torsion: tau,
            force: [across, along],
            pressure,
        }
    }

    /// Frame at a polar angle (rad), whose columns are normal, binormal and tangent.
    fn frame(&self, angle: f64) -> UnitQuaternion<f64> {
        let outward = Vector3::new(angle.cos(), angle.sin(), 0.0);
        let around = Vector3::new(-angle.sin(), angle.cos(), 0.0);
        let tangent = around * self.pitch.cos() + Vector3::z() * self.pitch.sin();
        let binormal = Vector3::z() * self.pitch.cos() - around * self.pitch.sin();
        let columns = Matrix3::from_columns(&[-outward, binormal, tangent]);
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns))
    }

    /// Pressure (N/m) in the middle of a quarter of a turn, computed from the contacts of a rod.
    fn computed(&self, [curvature, twist]: [f64; 2]) -> Result<f64, Box<dyn Error>> {
        let length = 0.5 * PI * self.radius / self.pitch.cos();
        let (start, end) = (self.frame(0.0), self.frame(0.5 * PI));
        let still = Still {
            base: start,
            ..Still::weightless()
        };
        let environment = still.environment(0.0);
        let mut rod = Rod::uniform(length, RADIUS, start, ELEMENTS, Order::Eight)?;
        let mut solver = NewtonSolver::default();
        let wound = Vector3::new(0.0, self.curvature, self.torsion);
        rod.set_intrinsic(|_| wound);
        let _ = solver.solve(&mut rod, &TISSUE, &(), &environment)?;
        let obstacle = Cylinder {
            through: Vector3::x() * -self.radius,
            along: Vector3::z(),
            radius: self.radius,
        };
        let support = (
            Contact {
                obstacle,
                radius: 0.0,
                friction: 0.0,
            },
            Hold::apex().held(end),
        );
        let pull = end * Vector3::new(0.0, self.force[0], self.force[1]);
        let mut reactions = Vec::new();
        // The shape remains the helix while the intrinsic strain and the load change.
        for share in [0.25, 0.5, 0.75, 1.0] {
            let strain = wound + (Vector3::new(0.0, curvature, twist) - wound) * share;
            rod.set_intrinsic(|_| strain);
            let load = ApicalForce(move |_: f64| pull * share);
            reactions = solver
                .solve_held(&mut rod, &TISSUE, &load, &support, &environment)?
                .reactions;
        }
        let each = length / ELEMENTS as f64;
        let (from, to) = (4.0 * each, length - 4.0 * each);
        let contacts = reactions
            .iter()
            .filter(|reaction| reaction.obstacle.is_some());
        // A contact at a node belongs to both of its elements.
        let pushed = contacts.map(|contact| {
            let s = contact.arc_length;
            let share = match (s - from).abs().min((s - to).abs()) < 1e-6 * each {
                true => 0.5,
                false => f64::from(u8::from(s > from && s < to)),
            };
            share * contact.normal
        });
        Ok(pushed.sum::<f64>() / (to - from))
    }
}

/// Compares pressures and the radius without pressure, and writes limit.csv and limit.svg.
pub fn limit(setup: &Setup, out: &Path) -> Result<(), Box<dyn Error>> {
    let intrinsic = [setup.curvature, setup.torsion()];
    let free = intrinsic[0] / (intrinsic[0].powi(2) + intrinsic[1].powi(2));
    let unit = TISSUE.stiffness(RADIUS).x * intrinsic[0].powi(3);
    let columns = [
        "radius_over_free",
        "pitch_deg",
        "pressure_n_per_m",
        "computed_n_per_m",
    ];
    let mut table = Table::create(out.join("limit.csv"), &columns)?;
    let mut computed = Vec::new();
    println!("radius of the free helix {:.4} mm", 1e3 * free);
    println!("R/free  pitch (°)  pressure (N/m)  computed");
    let ratios = [1.005, 1.01, 1.015, 1.1, 1.2, 1.4, 1.7, 2.0];
    for ratio in ratios {
        let helix = Helix::new(ratio * free, intrinsic);
        let pressure = helix.computed(intrinsic)?;
        table.row(&[ratio, helix.pitch.to_degrees(), helix.pressure, pressure])?;
        println!(
            "{ratio:6.3}  {:9.4}  {:14.8}  {pressure:.8}",
            helix.pitch.to_degrees(),
            helix.pressure
        );
        computed.push((ratio, pressure / unit));
    }
    table.finish()?;
    // Parabola through the first three ratios, whose spacing is that of the first one from 1.
    let [a, b, c] = [computed[0].1, computed[1].1, computed[2].1];
    let (first, second) = (b - a, c - 2.0 * b + a);
    // a + first x + second x (x − 1)/2 = 0, in spacings from the first ratio.
    let slope = first - 0.5 * second;
    let root = -2.0 * a / (slope + (slope * slope - 2.0 * second * a).sqrt());
    let spacing = ratios[1] - ratios[0];
    println!(
        "radius without pressure over that of the free helix: 1 {:+.1e}",
        ratios[0] + spacing * root - 1.0
    );
    let curve = (0..=100).map(|i| 1.0 + f64::from(i) / 100.0);
    let curve = curve
        .map(|ratio| (ratio, Helix::new(ratio * free, intrinsic).pressure / unit))
        .collect();
    let series = [
        Series::new("closed form", curve, Style::Line, 0),
        Series::new("computed", computed, Style::Points, 1),
    ];
    let labels = ["radius over that of the free helix", "pressure over B κ*³"];
    let figure = Figure::new(out.join("limit.svg"), "Helix on a pole without friction");
    figure.lines(labels[0], labels[1], &series, Axes::Linear)?;
    println!("wrote limit.csv and limit.svg to {}", out.display());
    Ok(())
}

/// Prints the angle of the tip of a flat coil to the surface, and the largest κ* R.
pub fn coil() -> Result<(), Box<dyn Error>> {
    let angles = follow()?;
    println!("flat coil on a pole: κ* R, angle of the tip to the surface (°)");
    for (angle, product) in &angles {
        println!("{product:6.3}  {angle:.4}");
    }
    let fold = fold(&angles);
    println!(
        "largest κ* R: {fold:.5}, by shooting {FOLD}, relative difference {:.1e}",
        fold / FOLD - 1.0
    );
    Ok(())
}
