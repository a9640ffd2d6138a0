//! Times at which contacts begin and end: order in time, the times themselves, their cost, and
//! saved states.

use std::f64::consts::PI;

use super::contact::{GROWTH, PERIOD, TISSUE, nutating, pole};
use crate::fixtures::shoots::{HOUR, MEMORY, RADIUS, WEIGHT, order, rod, tissue};
use approx::assert_abs_diff_eq;
use morphorod::checkpoint::{from_bytes, to_bytes};
use morphorod::equilibrium::NewtonSolver;
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Adaptive, Integrator, MethodOfSteps, Statistics};
use morphorod::support::{Contact, Cylinder, Distance, HalfSpace, Joint, Obstacle};
use morphorod::tropism::{
    Gravitropism, Oscillator, Proprioception, Remembered, Response, SettledStatoliths,
    Thigmotropism, Touch,
};
use morphorod::{DynLaws, Shoot, ShootParameters, State, Still};
use nalgebra::Vector3;

/// Growth in which no tissue leaves the growth zone, so that all runs have the same elements.
const STRETCHING: UniformGrowth = UniformGrowth {
    zone_length: 0.07,
    ..GROWTH
};

/// A shoot with an oscillator of a given period (s) and strength, and gravitropism of a given
/// sensitivity, which may touch an obstacle.
fn swinging<O>(
    contact: Contact<O>,
    (period, strength): (f64, f64),
    sensitivity: f64,
) -> Shoot<DynLaws>
where
    O: Obstacle + Send + Sync + 'static,
{
    let laws = (Oscillator::new(strength, period), raising(sensitivity));
    nutating(contact)
        .growth(STRETCHING)
        .tropism(laws)
        .into_dyn()
        .build()
        .unwrap()
}

/// The paper's gravitropism with another sensitivity.
fn raising(sensitivity: f64) -> Remembered<Gravitropism> {
    let parameters = ShootParameters {
        gravitropic_sensitivity: sensitivity,
        ..ShootParameters::default()
    };
    parameters.steering(SettledStatoliths).0
}

/// A wall at a distance (m) from the base, which the shoot touches with its apex.
fn wall(distance: f64) -> Contact<HalfSpace> {
    let obstacle = HalfSpace {
        through: Vector3::x() * distance,
        normal: -Vector3::x(),
    };
    Contact {
        obstacle,
        radius: RADIUS,
        friction: 0.0,
    }
}

/// Nodes at contacts are not nodes of the state, at which laws act and whose elements are compared.
#[test]
fn adaptive_runs_in_contact_keep_their_tolerance_at_output_times() {
    let shoot = || {
        let obstacle = Cylinder {
            through: Vector3::new(0.012, 0.0, 0.0165),
            along: Vector3::y(),
            radius: 3e-4,
        };
        let growth = UniformGrowth {
            zone_length: 0.02,
            time: 10.0 * HOUR,
        };
        let builder = rod(TISSUE, 0.03).scene(Still::tilted(0.6)).growth(growth);
        builder
            .tropism(raising(0.5))
            .support(Contact {
                obstacle,
                radius: RADIUS,
                friction: 0.0,
            })
            .build()
            .unwrap()
    };
    let mut fine = shoot();
    let _ = steps_of(10.0).advance(&mut fine, HOUR).unwrap();
    for tolerance in [1e-4, 1e-5] {
        let (mut shoot, mut touching) = (shoot(), false);
        let show = |shoot: &Shoot<_>| touching |= !shoot.reactions().is_empty();
        let cost = Adaptive::new(tolerance)
            .advance_showing(&mut shoot, HOUR, [120.0, HOUR], show)
            .unwrap();
        let error = (shoot.tip() - fine.tip()).norm() / shoot.rod().length();
        println!("{tolerance:e}: {error:e}, {cost}");
        assert!(touching && error < tolerance, "{tolerance:e}: {error:e}");
    }
}

/// A beam on two cylinders without a clamp. Each mesh begins with the base of the equilibrium on
/// the mesh before.
#[test]
fn adaptive_run_finds_the_equilibrium_of_a_beam_without_a_clamp() {
    let cylinder = |x: f64| {
        let obstacle = Cylinder {
            through: Vector3::new(x, 0.0, -1.5e-3),
            along: Vector3::y(),
            radius: 1e-3,
        };
        Contact {
            obstacle,
            radius: RADIUS,
            friction: 0.3,
        }
    };
    let stiff = tissue(1e9);
    let beam = || {
        let builder = rod(stiff, 0.1).load(WEIGHT).scene(Still::tilted(0.5 * PI));
        builder
            .support((Joint::Free, cylinder(0.01), cylinder(0.07)))
            .build()
            .unwrap()
    };
    let normals = |shoot: &Shoot<_>| {
        shoot
            .reactions()
            .iter()
            .map(|at| at.normal)
            .collect::<Vec<_>>()
    };
    // The weight acts at 0.05 m: 1/3 of it on the first cylinder, 2/3 on the second. The slope of
    // the beam, 5e-4 at the first cylinder, gives friction, a tenth of the weight, a vertical part
    // of 5e-5 of the weight.
    let weight = WEIGHT.density * 9.81 * PI * RADIUS * RADIUS * 0.1;
    for tolerance in [1e-3, 1e-5, 1e-8] {
        let mut beam = beam();
        let cost = Adaptive::new(tolerance).advance(&mut beam, 0.0).unwrap();
        assert!(cost.error.unwrap() <= tolerance);
        let normals = normals(&beam);
        assert!(normals.len() == 2 && cost.snaps == 0, "{normals:?}");
        assert_abs_diff_eq!(normals[0] / weight, 1.0 / 3.0, epsilon = 1e-4);
        assert_abs_diff_eq!(normals[1] / weight, 2.0 / 3.0, epsilon = 1e-4);
    }
}

/// An integrator whose equilibria have no visible error.
fn steps_of(step: f64) -> MethodOfSteps {
    MethodOfSteps::with_solver(step, NewtonSolver::with_tolerance(1e-12))
}

/// Largest errors of the tip (m) in and out of contact for each step, at 15 times, against a run
/// with the shortest step over four. `changes` is the number of times at which the contact begins
/// or ends.
fn errors<const N: usize>(
    build: impl Fn() -> Shoot<DynLaws>,
    until: f64,
    steps: [f64; N],
    changes: usize,
) -> [[f64; N]; 2] {
    let track = |step: f64| {
        let (mut shoot, mut run, mut cost) = (build(), steps_of(step), Statistics::default());
        let tip = |i: u32| {
            cost += run
                .advance(&mut shoot, until * f64::from(i) / 15.0)
                .unwrap();
            (shoot.tip(), !shoot.reactions().is_empty())
        };
        let track: Vec<(Vector3<f64>, bool)> = (1..=15).map(tip).collect();
        assert_eq!(cost.contact_changes, changes, "step {step} s");
        track
    };
    let fine = track(0.25 * steps[N - 1]);
    let all = steps.map(track);
    let found = [true, false].map(|touching| {
        all.each_ref().map(|track| {
            let each = track
                .iter()
                .zip(&fine)
                .filter(|(_, exact)| exact.1 == touching);
            each.map(|(at, exact)| (at.0 - exact.0).norm())
                .fold(0.0, f64::max)
        })
    });
    println!("in contact {:.2} {:?}", order(&found[0]), found[0]);
    println!("out of contact {:.2} {:?}", order(&found[1]), found[1]);
    found
}

#[test]
fn shape_in_frictionless_contact_has_no_memory() {
    // The oscillator does not depend on the shape. Shapes in contact then depend on the present
    // intrinsic strain only.
    let build = || {
        nutating(pole(0.02, 0.0))
            .growth(STRETCHING)
            .into_dyn()
            .build()
            .unwrap()
    };
    for errors in errors(build, 4.0 * HOUR, [240.0, 120.0, 60.0], 0) {
        assert!(errors[0] < 1e-11 && errors[2] < 1e-13, "{errors:?}");
    }
}

#[test]
fn touching_and_leaving_a_wall_keeps_the_order_in_time() {
    let build = || swinging(wall(0.025), (PERIOD, 1.0), 0.1);
    let [touching, free] = errors(build, 4.0 * HOUR, [480.0, 240.0, 120.0, 60.0], 4);
    // The order is that of the method, four. Equilibria with the apex on a wall have errors of up
    // to 2e-8 m, above the error of the shortest step.
    assert!(
        order(&free) >= 4.0 && order(&touching) >= 3.0,
        "{touching:?} {free:?}"
    );
}

#[test]
fn touch_keeps_the_order_in_time() {
    // The force per length at the apex rises to 0.4 N/m, from the threshold to half of the
    // saturation in 20 min.
    let perception = Touch {
        width: 0.015,
        threshold: 0.05,
        saturation: 0.5,
    };
    let build = |sensitivity| {
        let touch = Thigmotropism {
            sensitivity,
            perception,
        }
        .remembered(MEMORY);
        let laws = (Oscillator::new(1.0, PERIOD), raising(0.1), touch);
        nutating(wall(0.025))
            .growth(STRETCHING)
            .tropism(laws)
            .into_dyn()
            .build()
            .unwrap()
    };
    let mut without = build(0.0);
    steps_of(120.0).advance(&mut without, 4.0 * HOUR).unwrap();
    for sensitivity in [0.3, -0.3] {
        let [touching, free] = errors(
            || build(sensitivity),
            4.0 * HOUR,
            [240.0, 120.0, 60.0, 30.0],
            4,
        );
        assert!(
            order(&free) >= 3.5 && order(&touching) >= 3.0,
            "{touching:?} {free:?}"
        );
        let mut shoot = build(sensitivity);
        steps_of(120.0).advance(&mut shoot, 4.0 * HOUR).unwrap();
        let moved = (shoot.tip() - without.tip()).norm();
        println!("moves the tip by {moved:e} m");
        assert!(moved > 1e4 * free[3], "{moved}");
    }
}

#[test]
fn a_fast_swing_against_a_wall_keeps_the_order_in_time() {
    // At the longest step, ten steps in a period, the error is not yet that of the limit of short
    // steps.
    let build = || swinging(wall(0.012), (0.5 * HOUR, 2.0), 0.1);
    let found = errors(build, HOUR, [180.0, 90.0, 45.0], 4);
    assert!(found.iter().all(|errors| order(errors) >= 2.5), "{found:?}");
}

#[test]
fn rising_off_a_wall_keeps_the_order_in_time() {
    // The shoot leans on the wall at first. Gravitropism and proprioception raise it.
    let build = || {
        let laws = (
            raising(0.5),
            Proprioception { sensitivity: 5.0 }.remembered(MEMORY),
        );
        let growth = UniformGrowth {
            zone_length: 0.1,
            time: 20.0 * HOUR,
        };
        let builder = rod(TISSUE, 0.06).growth(growth).tropism(laws).load(WEIGHT);
        builder
            .scene(Still::tilted(1.2))
            .support(wall(0.05))
            .into_dyn()
            .build()
            .unwrap()
    };
    let [_, free] = errors(build, 4.0 * HOUR, [480.0, 240.0, 120.0], 1);
    assert!(order(&free) >= 3.5, "{free:?}");
}

#[test]
fn slipping_off_a_pole_keeps_the_order_in_time() {
    // The shoot jumps when its apex passes the pole.
    let build = || swinging(pole(0.02, 0.0), (PERIOD, 1.0), 0.1);
    let found = errors(build, 4.0 * HOUR, [480.0, 240.0, 120.0], 4);
    assert!(found.iter().all(|errors| order(errors) >= 3.5), "{found:?}");
}

#[test]
fn jump_of_a_shoot_that_slips_off_is_the_motion_of_its_tip() {
    let mut shoot = swinging(pole(0.02, 0.0), (PERIOD, 1.0), 0.1);
    let (mut run, mut snaps) = (steps_of(120.0), 0);
    while shoot.time() < 4.0 * HOUR {
        let before = shoot.tip();
        let cost = run.step(&mut shoot, 4.0 * HOUR).unwrap();
        if cost.snaps == 0 {
            continue;
        }
        snaps += 1;
        // An equilibrium within 1e-3 of the length is no snap. The jump starts at the extrapolated
        // shape. Where the shoot slips off, this shape differs from the last one by the fast motion
        // before, about 1e-5 m.
        let (jump, moved) = (cost.largest_jump, (shoot.tip() - before).norm());
        assert!(jump > 1e-3 * shoot.rod().length(), "{cost:?}");
        assert_abs_diff_eq!(jump, moved, epsilon = 5e-5);
    }
    assert!(snaps > 0);
}

#[test]
fn friction_has_first_order() {
    // Displacements since the start of a step determine friction.
    let build = || {
        nutating(pole(0.02, 0.3))
            .growth(STRETCHING)
            .into_dyn()
            .build()
            .unwrap()
    };
    let found = errors(build, 4.0 * HOUR, [240.0, 120.0, 60.0, 30.0], 0);
    assert!(order(&found[0]) >= 0.9 && found[0][3] < 3e-5, "{found:?}");
    // Free shapes do not depend on the history.
    assert!(found[1][0] < 1e-11, "{found:?}");
}

#[test]
fn contact_begins_when_the_free_shoot_reaches_the_wall() {
    let build = |distance| swinging(wall(distance), (PERIOD, 1.0), 0.1);
    let (mut free, mut touching) = (build(1.0), build(0.025));
    let reach = |shoot: &Shoot<DynLaws>| shoot.tip().x + RADIUS - 0.025;
    let _ = steps_of(120.0)
        .advance_until(&mut free, HOUR, reach)
        .unwrap();
    let (mut run, mut changes) = (steps_of(120.0), 0);
    while changes == 0 {
        changes += run.step(&mut touching, HOUR).unwrap().contact_changes;
    }
    assert_eq!(touching.reactions().len(), 1);
    // A change is located to 64⁻³ of a step of 120 s, and errors in time of 1e-9 m at 2e-5 m/s are
    // as small.
    assert_abs_diff_eq!(touching.time(), free.time(), epsilon = 5e-4);
}

#[test]
fn changes_of_contact_are_located_only_if_a_law_has_a_stimulus() {
    let cost = |mut shoot: Shoot<DynLaws>| {
        MethodOfSteps::new(120.0)
            .advance(&mut shoot, 4.0 * HOUR)
            .unwrap()
    };
    let located = cost(swinging(wall(0.025), (PERIOD, 1.0), 0.1));
    // Bisection to 64⁻³ of a step takes 18 trials and the step itself, of which those with the
    // change are undone.
    assert!(
        located.contact_changes == 4 && located.contact_trials <= 4 * 19,
        "{located:?}"
    );
    let without = cost(nutating(wall(0.025)).build().unwrap());
    assert_eq!((without.contact_changes, without.contact_trials), (0, 0));
    let distant = cost(swinging(wall(1.0), (PERIOD, 1.0), 0.1));
    assert_eq!((distant.contact_changes, distant.contact_trials), (0, 0));
}

#[test]
fn runs_resumed_around_located_changes_return_the_same_bytes() {
    let build = || swinging(pole(0.02, 0.0), (PERIOD, 1.0), 0.1);
    let mut whole = build();
    MethodOfSteps::new(120.0)
        .advance(&mut whole, 2.0 * HOUR)
        .unwrap();
    let (mut stepped, mut changes) = (build(), 0);
    while stepped.time() < 2.0 * HOUR {
        // Each step is made from a restored state, by a new integrator.
        let state: State = from_bytes(&to_bytes(stepped.state()).unwrap()).unwrap();
        stepped = build();
        stepped.restore(&state).unwrap();
        let cost = MethodOfSteps::new(120.0)
            .step(&mut stepped, 2.0 * HOUR)
            .unwrap();
        assert!(cost.steps <= 1, "{cost:?}");
        changes += cost.contact_changes;
    }
    assert_eq!(changes, 2);
    assert!(to_bytes(stepped.state()).unwrap() == to_bytes(whole.state()).unwrap());
}

/// A wall that oscillates by an amplitude (m) with a period (s).
struct Trembling {
    amplitude: f64,
    period: f64,
}

impl Obstacle for Trembling {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        let shift = self.amplitude * (2.0 * PI * time / self.period).sin();
        let wall = HalfSpace {
            through: Vector3::x() * (0.025 + shift),
            normal: -Vector3::x(),
        };
        wall.distance(place, time)
    }
}

#[test]
fn contacts_that_begin_and_end_often_do_not_stall_a_run() {
    // The apex approaches the wall at 2e-5 m/s. For 400 s contact begins and ends in each period of
    // the wall.
    let obstacle = Trembling {
        amplitude: 4e-3,
        period: 3.1,
    };
    let mut shoot = swinging(
        Contact {
            obstacle,
            radius: RADIUS,
            friction: 0.0,
        },
        (PERIOD, 1.0),
        0.1,
    );
    let cost = MethodOfSteps::new(240.0)
        .advance(&mut shoot, 0.6 * HOUR)
        .unwrap();
    println!(
        "{} changes, {} steps, {} equilibria",
        cost.contact_changes, cost.steps, cost.equilibria
    );
    // These 400 s are less than two steps. In the time of a step, changes are located until there
    // are 128 levels, each with about one trial or less. Without this bound there would be 490
    // equilibria.
    assert!(
        cost.contact_changes >= 5 && cost.equilibria < 400,
        "{cost:?}"
    );
}

#[test]
fn adaptive_steps_keep_their_tolerance_where_a_shoot_slips_off() {
    let build = || swinging(pole(0.02, 0.0), (PERIOD, 1.0), 0.1);
    let (mut exact, mut shoot) = (build(), build());
    steps_of(30.0).advance(&mut exact, 2.0 * HOUR).unwrap();
    let cost = Adaptive::new(1e-4).advance(&mut shoot, 2.0 * HOUR).unwrap();
    let error = (shoot.tip() - exact.tip()).norm() / exact.rod().length();
    println!(
        "estimate {:?}, error {error:e}, {} changes",
        cost.error, cost.contact_changes
    );
    assert!(
        cost.contact_changes == 2
            && cost
                .error
                .is_some_and(|bound| error <= bound && bound <= 1e-4),
        "{cost:?}"
    );
}
