//! Profiles of rods with supports: couples and forces with the reactions, against closed forms and
//! balance.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::fixtures::held::{Held, about, assert_close};
use crate::fixtures::in_norm::InNorm;
use crate::fixtures::rods::{DENSITY, GRAVITY, bending_stiffness, density_for};
use crate::fixtures::shoots::{RADIUS, WEIGHT};
use approx::assert_abs_diff_eq;
use morphorod::constitutive::Constitutive;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::load::{Load, Weight};
use morphorod::profile::Profile;
use morphorod::rod::Rod;
use morphorod::support::{Contact, Cylinder, HalfSpace, Hold, Support};
use morphorod::{Order, Scene};
use nalgebra::{Matrix3, Vector3};

/// Length, m.
const LENGTH: f64 = 0.05;

/// Couple (N m) and force (N) at an arc length of a rod, both in the fixed frame.
fn at(held: &Held<impl Load>, rod: &Rod, s: f64) -> (Vector3<f64>, Vector3<f64>) {
    let law: &dyn Constitutive = &held.law;
    let place = Profile::of(rod, &law, &held.load, &held.scene.environment(0.0))
        .at(s)
        .unwrap();
    (place.frame * place.couple, place.force)
}

/// Weight per length of the default rod with a dimensionless load q ℓ³/B, N/m.
fn per_length(load: f64) -> f64 {
    load * bending_stiffness() / LENGTH.powi(3)
}

/// A horizontal rod along e1 under its weight, with a dimensionless load and a support.
fn horizontal(load: f64, support: &dyn Support) -> Held<Weight> {
    let weight = Weight {
        density: density_for(load, LENGTH),
    };
    let mut held = Held::straight(LENGTH, FRAC_PI_2, 8, weight);
    held.hold(support);
    held
}

#[test]
fn propped_cantilever_has_the_couple_and_the_force_of_beam_theory_at_its_base() {
    // The closed forms are those of a small deflection. Their errors are of the order of the square
    // of the load.
    let load = 1e-4;
    let q = per_length(load);
    let prop = Hold::apex().on_plane(Vector3::zeros(), Vector3::z_axis());
    let guide = Hold::apex()
        .on_line(Vector3::zeros(), Vector3::x_axis())
        .held(about(Vector3::y_axis(), FRAC_PI_2));
    for (support, couple, force) in [(prop, 1.0 / 8.0, 5.0 / 8.0), (guide, 1.0 / 12.0, 1.0 / 2.0)] {
        let mut held = horizontal(load, &support);
        let (m, n) = at(&held, &held.rod, 0.0);
        assert_abs_diff_eq!(
            InNorm(m / (q * LENGTH * LENGTH)),
            InNorm(Vector3::y() * couple),
            epsilon = 1e-8
        );
        assert_abs_diff_eq!(
            InNorm(n / (q * LENGTH)),
            InNorm(-Vector3::z() * force),
            epsilon = 1e-8
        );
        // An equilibrium without the support removes the reactions.
        let (law, environment): (&dyn Constitutive, _) = (&held.law, held.scene.environment(0.0));
        let _ = NewtonSolver::default()
            .solve(&mut held.rod, &law, &held.load, &environment)
            .unwrap();
        assert!(held.rod.reactions().is_empty());
        let (m, n) = at(&held, &held.rod, 0.0);
        assert_abs_diff_eq!(
            InNorm(m / (q * LENGTH * LENGTH)),
            InNorm(Vector3::y() * 0.5),
            epsilon = 1e-8
        );
        assert_abs_diff_eq!(
            InNorm(n / (q * LENGTH)),
            InNorm(-Vector3::z()),
            epsilon = 1e-14
        );
    }
}

#[test]
fn couple_of_a_held_rod_balances_weight_and_reactions_at_any_place() {
    let load = 30.0;
    let q = -Vector3::z() * per_length(load);
    let prop = Hold::apex().on_plane(Vector3::zeros(), Vector3::z_axis());
    let clamp = Hold::apex()
        .on_plane(Vector3::zeros(), Vector3::z_axis())
        .held(about(Vector3::y_axis(), 1.0));
    // The spring acts at a node, where the force jumps.
    let spring = Hold::place(0.5 * LENGTH).spring(Vector3::zeros(), Matrix3::identity() * 1e-3);
    for support in [&prop as &dyn Support, &clamp, &spring] {
        let held = horizontal(load, support);
        for i in 0..20 {
            // No place is a node inside the rod, where couple and force may jump.
            let s = LENGTH * (f64::from(i) / 20.0).powf(1.1);
            let (m, n) = at(&held, &held.rod, s);
            let beyond = held.reactions.iter().filter(|at| at.arc_length > s);
            let force =
                q * (LENGTH - s) + beyond.map(|reaction| reaction.force).sum::<Vector3<f64>>();
            let scale = per_length(load) * LENGTH;
            assert_abs_diff_eq!(InNorm(n / scale), InNorm(force / scale), epsilon = 1e-12);
            let couple = held.couple_beyond(s, &q) / (scale * LENGTH);
            // Eight elements of order eight resolve the shape to 1e-9.
            assert_abs_diff_eq!(InNorm(m / (scale * LENGTH)), InNorm(couple), epsilon = 1e-8);
        }
    }
}

#[test]
fn couple_jumps_by_that_of_a_held_frame() {
    let (mut held, unit) = (
        Held::straight(LENGTH, 0.0, 8, ()),
        bending_stiffness() / (1.5 * LENGTH),
    );
    let middle = Hold::place(0.5 * LENGTH).held(about(Vector3::z_axis(), 1.0));
    held.hold(&(middle, Hold::apex().held(about(Vector3::z_axis(), 0.4))));
    // Each half of length ℓ/2 is twisted uniformly: by 1 rad up to the middle, and by −0.6 rad
    // beyond.
    for (s, couple) in [(0.0, 2.0), (0.4, 2.0), (0.6, -1.2), (0.99, -1.2)] {
        let (m, n) = at(&held, &held.rod, s * LENGTH);
        assert_abs_diff_eq!(
            InNorm(m / unit),
            InNorm(Vector3::z() * couple),
            epsilon = 1e-12
        );
        assert_eq!(n, Vector3::zeros());
    }
}

#[test]
fn profile_in_contact_has_the_couple_of_the_reference_on_either_mesh() {
    // Rows 5.27 to 5.29 of the boundary value problems with contact: see `contact.rs`.
    let (length, depth, couple) = (0.09, 0.03, 1.3171035754573045e-05);
    let plane = HalfSpace {
        through: Vector3::z() * -depth,
        normal: Vector3::z(),
    };
    let floor = Contact {
        obstacle: plane,
        radius: 0.0,
        friction: 0.0,
    };
    let mut held = Held::straight(length, FRAC_PI_2, 16, WEIGHT);
    let (law, environment): (&dyn Constitutive, _) = (&held.law, held.scene.environment(0.0));
    let support: &dyn Support = &floor;
    let found = NewtonSolver::default()
        .solve_held(&mut held.rod, &law, &held.load, &support, &environment)
        .expect("a contact");
    for rod in [&found.rod, &held.rod] {
        assert_eq!(rod.reactions(), found.reactions);
        let (m, n) = at(&held, rod, 0.0);
        assert_close("couple", m.y, couple, 1e-6);
        let pushed: f64 = found.reactions.iter().map(|at| at.force.z).sum();
        assert_close(
            "force",
            n.z,
            pushed - DENSITY * GRAVITY * PI * RADIUS * RADIUS * length,
            1e-12,
        );
    }
}

#[test]
fn force_at_the_base_balances_weight_and_a_contact_inside_the_first_element() {
    // The mesh of the rod before the search has no node at the contact.
    for order in Order::ALL {
        let mut held = Held::of_order(
            LENGTH,
            FRAC_PI_2,
            (3, order),
            Weight {
                density: density_for(10.0, LENGTH),
            },
        );
        let through = Vector3::new(0.15, 0.0, -0.01) * LENGTH;
        let pole = Cylinder {
            through,
            along: Vector3::y(),
            radius: 0.01 * LENGTH,
        };
        held.hold(&Contact {
            obstacle: pole,
            radius: 0.0,
            friction: 0.0,
        });
        let contact = held.reaction().0;
        assert!(
            contact.z > 0.0 && held.reactions[0].arc_length < LENGTH / 3.0,
            "{:?}",
            held.reactions
        );
        let (_, force) = at(&held, &held.rod, 0.0);
        let weight = -Vector3::z() * per_length(10.0) * LENGTH;
        // Only rounding separates the sums.
        assert_abs_diff_eq!(
            (force - weight - contact).norm(),
            0.0,
            epsilon = 1e-12 * contact.norm()
        );
        let (_, force) = at(&held, &held.rod, LENGTH * 0.5);
        assert_abs_diff_eq!(
            (force - weight * 0.5).norm(),
            0.0,
            epsilon = 1e-12 * contact.norm()
        );
    }
}
