//! Poles that are thinner than the distance of the places at which contact is evaluated.

use crate::fixtures::shoots::{RADIUS, YOUNG};
use morphorod::constitutive::Timoshenko;
use morphorod::equilibrium::{EquilibriumError, Held, NewtonSolver};
use morphorod::load::Weight;
use morphorod::rod::Rod;
use morphorod::support::{Contact, Cylinder, Distance, Hold, Obstacle};
use morphorod::{Order, Scene, Still};
use nalgebra::{UnitQuaternion, Vector3};
use std::cell::Cell;

const LENGTH: f64 = 0.05;

/// An upright weightless rod that bends towards a pole of a radius (m) across it.
fn bent_towards_a_pole(radius: f64, elements: usize) -> Result<Held, EquilibriumError> {
    bent(NewtonSolver::default(), radius, elements)
}

/// As [`bent_towards_a_pole`], with any solver.
fn bent(solver: NewtonSolver, radius: f64, elements: usize) -> Result<Held, EquilibriumError> {
    bent_towards(solver, pole(radius), elements)
}

/// A pole of a radius (m) across the rod.
fn pole(radius: f64) -> Cylinder {
    Cylinder {
        through: Vector3::new(0.08, 0.0, 0.6) * LENGTH,
        along: Vector3::y(),
        radius,
    }
}

/// As [`bent_towards_a_pole`], with any solver and obstacle.
fn bent_towards(
    mut solver: NewtonSolver,
    obstacle: impl Obstacle,
    elements: usize,
) -> Result<Held, EquilibriumError> {
    let still = Still {
        base: Still::tilted(0.0).base,
        ..Still::weightless()
    };
    let mut rod = Rod::uniform(LENGTH, RADIUS, still.base, elements, Order::Eight).unwrap();
    rod.set_intrinsic(|_| Vector3::y() * 30.0);
    let support = Contact {
        obstacle,
        radius: 0.0,
        friction: 0.0,
    };
    solver.solve_held(&mut rod, &YOUNG, &(), &support, &still.environment(0.0))
}

#[test]
fn rod_touches_a_pole_that_is_thinner_than_the_distance_of_its_stations() {
    // The distance of the stations is 0.05 of the length with eight elements.
    let thick = bent_towards_a_pole(2e-2 * LENGTH, 8).unwrap();
    for radius in [1e-2, 4e-3] {
        let held = bent_towards_a_pole(radius * LENGTH, 8).unwrap();
        assert_eq!(held.reactions.len(), 1);
        // The shape changes by about the radius.
        let moved = (held.rod.tip() - thick.rod.tip()).norm();
        assert!(moved < 0.05 * LENGTH, "{moved}");
    }
}

#[test]
fn rod_never_passes_through_a_thin_pole() {
    // The free shape is on the other side: its tip has x = 0.62 of the length, that of the rod at
    // the pole 0.33. The smallest radius takes 450 iterations.
    for radius in [2e-3, 2e-4, 1e-4, 2e-5] {
        for elements in [4, 8, 32] {
            let held = bent_towards_a_pole(radius * LENGTH, elements).unwrap();
            assert!(held.rod.tip().x < 0.4 * LENGTH, "{radius} {elements}");
        }
    }
    // The search does not reach the thinnest pole in the permitted number of iterations.
    let solver = NewtonSolver {
        max_iterations: 100,
        ..NewtonSolver::default()
    };
    let thinnest = bent(solver, 2e-5 * LENGTH, 8);
    assert!(thinnest.is_err_and(|error| matches!(error, EquilibriumError::NoConvergence { .. })));
}

#[test]
fn held_frame_that_rotates_does_not_move_the_rod_through_a_pole() {
    // A rod beside no pole is an arc, whose tip has x = (1 − cos 1.2)/1.2 = 0.53 of the length.
    let tip = |radius: f64, elements: usize| {
        let still = Still::weightless();
        let mut rod = Rod::uniform(LENGTH, RADIUS, still.base, elements, Order::Eight).unwrap();
        let frame = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 1.2);
        let contact = Contact {
            obstacle: pole(radius * LENGTH),
            radius: 0.0,
            friction: 0.0,
        };
        let support = (Hold::apex().held(frame), contact);
        let mut solver = NewtonSolver::default();
        let held = solver
            .solve_held(&mut rod, &YOUNG, &(), &support, &still.environment(0.0))
            .unwrap();
        let pushed = held
            .reactions
            .iter()
            .filter(|at| at.obstacle.is_some() && at.normal > 0.0)
            .count();
        assert_eq!(pushed, 1, "{radius} {elements}");
        held.rod.tip() / LENGTH
    };
    let tips = [2e-2, 2e-3].map(|radius| {
        let [coarse, fine] = [4, 16].map(|elements| tip(radius, elements));
        assert!((coarse - fine).norm() < 1e-6, "{coarse}");
        fine.x
    });
    // The place of contact moves by the difference of the radii, and the tip moves by 1.3 times as
    // much.
    let ratio = (tips[1] - tips[0]) / 1.8e-2;
    assert!(tips[0] > 0.3 && (1.0..2.0).contains(&ratio), "{tips:?}");
}

/// A straight rod whose tip is pulled back bends towards d1, where a pole is nearer than the
/// deflection. It may touch the pole there, or roll about the line of its ends to a plane in which
/// it does not reach the pole, since a section that is circular has no plane of its own.
#[test]
fn straight_rod_that_buckles_does_not_pass_a_pole() {
    let still = Still::weightless();
    let place = |x: f64, z: f64| Vector3::new(x, 0.0, z) * LENGTH;
    let hold = Hold::apex().at(place(0.0, 0.98));
    // The deflection at half of the height relative to the length, and the number of contacts that
    // push.
    let deflection = |contacts: Vec<Contact<Cylinder>>| {
        let mut rod = Rod::uniform(LENGTH, RADIUS, still.base, 8, Order::Eight).unwrap();
        let support = (hold, contacts);
        let mut solver = NewtonSolver::default();
        let held = solver
            .solve_held(&mut rod, &YOUNG, &(), &support, &still.environment(0.0))
            .unwrap();
        let height = |at: &Vector3<f64>| (at.z - 0.5 * LENGTH).abs();
        let line = held.rod.centre_line_at(201);
        let beside = line
            .iter()
            .min_by(|a, b| height(a).total_cmp(&height(b)))
            .unwrap();
        let pushes = held
            .reactions
            .iter()
            .filter(|at| at.obstacle.is_some() && at.normal > 0.0)
            .count();
        (beside.x / LENGTH, beside.xy().norm() / LENGTH, pushes)
    };
    let (_, free, _) = deflection(vec![]);
    assert!(free > 0.08, "{free}");
    for radius in [7e-3, 1e-3] {
        let centre = 0.01 + radius;
        let pole = Cylinder {
            through: place(centre, 0.5),
            along: Vector3::y(),
            radius: radius * LENGTH,
        };
        let (beside, away, pushes) = deflection(vec![Contact {
            obstacle: pole,
            radius: 0.0,
            friction: 0.0,
        }]);
        // A further node changes the shape of eight elements by 2.6e-9 of the length, and that of
        // sixteen by 6e-11.
        let rolled = (away - free).abs() < 1e-8;
        assert!(
            beside < centre && (pushes > 0 || rolled),
            "{radius}: {beside}, {away}, {pushes}"
        );
    }
}

/// An obstacle that counts the evaluations of its distance.
struct Counted<'a>(Cylinder, &'a Cell<usize>);

impl Obstacle for Counted<'_> {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        self.1.set(self.1.get() + 1);
        self.0.distance(place, time)
    }
}

#[test]
fn search_for_places_near_a_pole_takes_a_number_of_evaluations_that_hardly_depends_on_the_radius() {
    let evaluations = |radius: f64| {
        let count = Cell::new(0);
        let held = bent_towards(
            NewtonSolver::default(),
            Counted(pole(radius * LENGTH), &count),
            8,
        )
        .unwrap();
        count.get() / held.equilibrium.iterations
    };
    // Intervals are halved down to the distance from the pole, which adds a few for each factor of
    // two of the radius.
    let (thick, thin) = (evaluations(2e-2), evaluations(1e-4));
    println!("{thick} and {thin} evaluations for each iteration");
    assert!(thin < 2 * thick, "{thick} {thin}");
}

#[test]
fn penetration_of_a_rod_that_shears_is_contained_in_its_error() {
    let still = Still::tilted(std::f64::consts::FRAC_PI_2);
    for (softer, least) in [(10.0, 1e-9), (100.0, 1e-7)] {
        let soft = YOUNG.youngs_modulus / softer;
        let law = Timoshenko {
            law: YOUNG,
            youngs_modulus: soft,
            shear_modulus: soft / 3.0,
            shear_factor: 0.9,
        };
        for elements in [8, 32] {
            let through = Vector3::new(0.6 * LENGTH, 0.0, -3e-3);
            let pole = Cylinder {
                through,
                along: Vector3::y(),
                radius: 2e-3,
            };
            let support = Contact {
                obstacle: pole,
                radius: RADIUS,
                friction: 0.0,
            };
            let mut rod = Rod::uniform(LENGTH, RADIUS, still.base, elements, Order::Eight).unwrap();
            let load = Weight { density: 1000.0 };
            let held = NewtonSolver::default().solve_held(
                &mut rod,
                &law,
                &load,
                &support,
                &still.environment(0.0),
            );
            let held = held.unwrap();
            let depth = |place: &Vector3<f64>| RADIUS - support.obstacle.distance(place, 0.0).value;
            let deepest = held
                .rod
                .centre_line_at(20_001)
                .iter()
                .map(depth)
                .fold(0.0, f64::max)
                / LENGTH;
            // The strain of the centre line between the material points is interpolated in two
            // ways, and its jump at the contact is spread over an element.
            let error = held.equilibrium.error;
            assert!(
                deepest > least && (0.5..2.0).contains(&(error / deepest)),
                "{softer}: {deepest:e}, {error:e}"
            );
        }
    }
}
