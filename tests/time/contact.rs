//! Shoots in time that are held, or that touch an obstacle: balance of forces, saved states, and
//! shoots that a support does not affect.

use crate::fixtures::held::assert_close;
use crate::fixtures::shoots::{HOUR, RADIUS, WEIGHT, YOUNG, rod, tissue};
use morphorod::checkpoint::{from_bytes, to_bytes};
use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::NewtonSolver;
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{
    Adaptive, ConstantHistory, IntegrationError, Integrator, MethodOfSteps,
};
use morphorod::load::Distributed;
use morphorod::support::{
    Contact, Cylinder, Distance, Hold, Moving, Obstacle, Slip, Sphere, Support,
};
use morphorod::tropism::Oscillator;
use morphorod::{DynLaws, Model, Shoot, ShootBuilder, State, Still};
use nalgebra::Vector3;

pub(super) const TISSUE: LinearElastic = tissue(1e8);
pub(super) const GROWTH: UniformGrowth = UniformGrowth {
    zone_length: 0.05,
    time: 40.0 * HOUR,
};
const LENGTH: f64 = 0.06;
pub(super) const PERIOD: f64 = 2.0 * HOUR;

/// A shoot of 6 cm whose oscillator sweeps it in circles of a period of 2 h.
pub(super) fn nutating<S: Support + Send + Sync + 'static>(support: S) -> ShootBuilder<DynLaws> {
    let builder = rod(TISSUE, LENGTH).growth(GROWTH);
    builder
        .tropism(Oscillator::new(1.0, PERIOD))
        .load(WEIGHT)
        .scene(Still::upright())
        .support(support)
        .into_dyn()
}

/// A vertical pole of 2 mm radius at a distance from the base (m).
pub(super) fn pole(distance: f64, friction: f64) -> Contact<Cylinder> {
    let obstacle = Cylinder {
        through: Vector3::x() * distance,
        along: Vector3::z(),
        radius: 2e-3,
    };
    Contact {
        obstacle,
        radius: RADIUS,
        friction,
    }
}

/// Total weight, N, which acts downwards.
fn weight(shoot: &Shoot<impl Model>) -> Vector3<f64> {
    Vector3::z() * (-WEIGHT.density * 9.81 * shoot.rod().volume())
}

/// Fails unless the force in the shoot at the base balances its weight and the reactions, and
/// returns the number of reactions.
fn assert_balance(shoot: &Shoot<impl Model>, tolerance: f64) -> usize {
    let base = shoot.profile().at(0.0).unwrap().force;
    let sum: Vector3<f64> = shoot
        .reactions()
        .iter()
        .map(|reaction| reaction.force)
        .sum();
    let error = (base - sum - weight(shoot)).norm() / (sum.norm() + weight(shoot).norm());
    assert!(
        error <= tolerance,
        "at {} s: relative error {error:e}",
        shoot.time()
    );
    shoot.reactions().len()
}

#[test]
fn reactions_balance_the_weight_through_gain_and_loss_of_contact() {
    for friction in [0.0, 0.3] {
        let mut shoot = nutating(pole(0.02, friction)).build().unwrap();
        let mut run = MethodOfSteps::new(120.0);
        let (mut numbers, mut ratio) = (Vec::new(), 0.0_f64);
        while shoot.time() < 6.0 * HOUR {
            let _ = run.step(&mut shoot, 6.0 * HOUR).unwrap();
            numbers.push(assert_balance(&shoot, 1e-9));
            for reaction in shoot.reactions() {
                assert!(
                    reaction.normal >= 0.0 && reaction.obstacle == Some(0),
                    "{reaction:?}"
                );
                let place = shoot.rod().at(reaction.arc_length).unwrap().0 - Vector3::x() * 0.02;
                let (distance, normal) = (
                    place.xy().norm(),
                    Vector3::new(place.x, place.y, 0.0).normalize(),
                );
                assert!(
                    (distance - 2e-3 - RADIUS).abs() < 1e-7 * LENGTH,
                    "{distance} at {} s",
                    shoot.time()
                );
                let tangential = (reaction.force - normal * reaction.normal).norm();
                assert!(
                    tangential <= friction * reaction.normal * (1.0 + 1e-6) + 1e-9,
                    "{tangential} {reaction:?}"
                );
                ratio = ratio.max(tangential / reaction.normal);
                assert_eq!(reaction.slip.is_some(), friction > 0.0);
            }
        }
        println!("friction {friction}: largest ratio {ratio}");
        assert!(
            numbers
                .windows(2)
                .filter(|pair| (pair[0] > 0) != (pair[1] > 0))
                .count()
                >= 4,
            "{numbers:?}"
        );
    }
}

#[test]
fn couple_and_strain_agree_with_the_differentiated_shape_in_contact() {
    let mut shoot = nutating(pole(0.02, 0.0)).elements(16).build().unwrap();
    let mut run = MethodOfSteps::with_solver(120.0, NewtonSolver::with_tolerance(1e-13));
    let (mut compared, mut largest) = (0, [0.0_f64; 2]);
    while shoot.time() < 4.0 * HOUR {
        let _ = run.step(&mut shoot, 4.0 * HOUR).unwrap();
        if shoot.reactions().is_empty() {
            continue;
        }
        compared += 1;
        let (profile, rod) = (shoot.profile(), shoot.rod());
        let p = rod.order().points();
        let scale = profile
            .sample(50)
            .iter()
            .map(|place| place.curvature())
            .fold(0.0, f64::max);
        let stiffness = TISSUE.stiffness(RADIUS);
        for (i, point) in rod.points().iter().enumerate() {
            let place = profile
                .at(rod
                    .arc_length_of(LENGTH - point.initial_apex_distance)
                    .unwrap())
                .unwrap();
            let strain = rod.strain(i / p, i % p).unwrap();
            let elastic = stiffness.component_mul(&(strain - place.intrinsic));
            largest[0] = largest[0].max((place.strain - strain).norm() / scale);
            largest[1] = largest[1].max((place.couple - elastic).norm() / (scale * stiffness.x));
        }
        // Moment of the weight and of the reactions about the base.
        let at = |s: f64| rod.at(s).unwrap().0;
        let points = rod.centre_line_at(4001);
        let per = weight(&shoot) / 4000.0;
        let mut moment: Vector3<f64> = points
            .windows(2)
            .map(|ends| (0.5 * (ends[0] + ends[1])).cross(&per))
            .sum();
        moment += shoot
            .reactions()
            .iter()
            .map(|one| at(one.arc_length).cross(&one.force))
            .sum::<Vector3<f64>>();
        let base = profile.at(0.0).unwrap();
        let error = (base.frame * base.couple - moment).norm() / (scale * stiffness.x);
        assert!(error < 1e-6, "moment at {} s: {error:e}", shoot.time());
    }
    println!(
        "{compared} shapes, strain {:e}, couple {:e}",
        largest[0], largest[1]
    );
    // A contact is up to 1e-6 of the length beside the node at which the force jumps.
    assert!(
        compared > 20 && largest.iter().all(|error| *error < 2e-5),
        "{largest:?}"
    );
}

/// A shoot on an inclined base.
fn inclined<S: Support + Send + Sync + 'static>(support: S) -> ShootBuilder<DynLaws> {
    nutating(support)
        .tropism(Oscillator::new(0.3, PERIOD))
        .scene(Still::tilted(0.5))
        .into_dyn()
}

#[test]
fn held_places_keep_their_position_while_tissue_grows() {
    for initial_apex_distance in [0.0, 0.02] {
        let hold =
            Hold::place(initial_apex_distance).on_plane(Vector3::z() * 0.033, Vector3::z_axis());
        let mut shoot = inclined(hold).build().unwrap();
        let mut run = MethodOfSteps::new(300.0);
        let mut places = Vec::new();
        while shoot.time() < 5.0 * HOUR {
            let _ = run.step(&mut shoot, 5.0 * HOUR).unwrap();
            assert_eq!(assert_balance(&shoot, 1e-9), 1);
            let reaction = shoot.reactions()[0];
            let place = shoot.rod().at(reaction.arc_length).unwrap().0;
            assert!(
                (place.z - 0.033).abs() < 1e-10,
                "{} at {} s",
                place.z,
                shoot.time()
            );
            // The plane has no friction.
            assert!(
                reaction.force.xy().norm() < 1e-9 * weight(&shoot).norm(),
                "{reaction:?}"
            );
            assert!(
                (reaction.initial_apex_distance - initial_apex_distance).abs() < 1e-15,
                "{reaction:?}"
            );
            places.push(reaction.arc_length);
        }
        assert!(shoot.rod().length() > LENGTH + 0.004);
        assert!(
            places.windows(2).all(|pair| pair[1] > pair[0]),
            "{places:?}"
        );
    }
}

#[test]
fn apex_follows_a_moving_hold() {
    let at = |t: f64| {
        Vector3::new(
            0.03 + 0.004 * (t / HOUR).sin(),
            0.002 * (2.0 * t / HOUR).sin(),
            0.05,
        )
    };
    let mut shoot = inclined(Moving(move |t: f64| Hold::apex().at(at(t))))
        .build()
        .unwrap();
    let mut run = MethodOfSteps::new(300.0);
    while shoot.time() < 4.0 * HOUR {
        let _ = run.step(&mut shoot, 4.0 * HOUR).unwrap();
        assert_eq!(assert_balance(&shoot, 1e-9), 1);
        let error = (shoot.tip() - at(shoot.time())).norm();
        assert!(error < 1e-9, "{error:e} at {} s", shoot.time());
    }
}

#[test]
fn resumed_runs_in_contact_return_the_same_bytes() {
    for friction in [0.0, 0.3] {
        let build = || nutating(pole(0.02, friction)).build().unwrap();
        let mut whole = build();
        let mut run = MethodOfSteps::new(120.0);
        let mut resumed_in_contact = 0;
        for hour in 1..=5 {
            let until = (f64::from(hour) - 0.05) * HOUR;
            run.advance(&mut whole, until).unwrap();
            resumed_in_contact += usize::from(!whole.reactions().is_empty());
            let bytes = to_bytes(whole.state()).unwrap();
            let state: State = from_bytes(&bytes).unwrap();
            assert!(to_bytes(&state).unwrap() == bytes);
            let mut resumed = build();
            resumed.restore(&state).unwrap();
            assert_eq!(resumed.reactions(), whole.reactions());
            let mut other = whole.clone();
            for shoot in [&mut resumed, &mut other] {
                MethodOfSteps::new(120.0)
                    .advance(shoot, until + 0.5 * HOUR)
                    .unwrap();
            }
            assert!(
                to_bytes(resumed.state()).unwrap() == to_bytes(other.state()).unwrap(),
                "{friction} at {until} s"
            );
        }
        // The uninterrupted run keeps its integrator; a resumed one has a new integrator.
        let (mut one, mut two) = (build(), build());
        run = MethodOfSteps::new(120.0);
        run.advance(&mut one, 0.7 * HOUR).unwrap();
        two.restore(one.state()).unwrap();
        run.advance(&mut one, 2.0 * HOUR).unwrap();
        MethodOfSteps::new(120.0)
            .advance(&mut two, 2.0 * HOUR)
            .unwrap();
        assert!(
            to_bytes(one.state()).unwrap() == to_bytes(two.state()).unwrap(),
            "{friction}"
        );
        assert!(resumed_in_contact > 0);
    }
}

#[test]
fn errors_leave_a_held_shoot_unchanged() {
    // From one hour on the hold is out of reach.
    let at = |t: f64| Vector3::new(0.03 + 0.1 * ((t - HOUR) / HOUR).max(0.0), 0.0, 0.045);
    let mut shoot = inclined((
        Moving(move |t: f64| Hold::apex().at(at(t))),
        pole(0.05, 0.3),
    ))
    .build()
    .unwrap();
    let mut run = MethodOfSteps::new(300.0);
    run.advance(&mut shoot, HOUR).unwrap();
    let before = (shoot.clone(), to_bytes(shoot.state()).unwrap());
    let error = run.advance(&mut shoot, 2.0 * HOUR).unwrap_err();
    assert!(
        matches!(error, IntegrationError::Equilibrium { .. }),
        "{error}"
    );
    assert!(
        to_bytes(shoot.state()).unwrap() == before.1 && shoot.reactions() == before.0.reactions()
    );
}

#[test]
fn absent_support_changes_no_bit() {
    let free = || {
        let builder = rod(TISSUE, LENGTH).growth(GROWTH).load(WEIGHT);
        builder
            .tropism(Oscillator::new(1.0, PERIOD))
            .scene(Still::upright())
            .into_dyn()
            .build()
            .unwrap()
    };
    let mut shoots = [
        free(),
        nutating(()).build().unwrap(),
        nutating(((), ())).build().unwrap(),
    ];
    for shoot in &mut shoots {
        MethodOfSteps::new(120.0)
            .advance(shoot, 5.0 * HOUR)
            .unwrap();
    }
    let bytes = shoots.map(|shoot| to_bytes(shoot.state()).unwrap());
    assert!(bytes[0] == bytes[1] && bytes[0] == bytes[2]);
}

#[test]
fn distant_obstacle_leaves_the_track_of_a_free_shoot() {
    let times: Vec<f64> = (1..=20).map(|i| 0.5 * HOUR * f64::from(i)).collect();
    let solver = || NewtonSolver::with_tolerance(1e-12);
    // The places of the tip, and the number of factorisations.
    let track = |mut shoot: Shoot<DynLaws>| -> (Vec<Vector3<f64>>, usize) {
        let mut run = MethodOfSteps::with_solver(120.0, solver());
        let mut cost = 0;
        let tip = |t: &f64| {
            cost += run.advance(&mut shoot, *t).unwrap().factorisations;
            assert!(shoot.reactions().is_empty());
            shoot.tip()
        };
        (times.iter().map(tip).collect(), cost)
    };
    let (free, cost) = track(nutating(()).build().unwrap());
    for friction in [0.0, 0.3] {
        let (other, beside) = track(nutating(pole(0.5, friction)).build().unwrap());
        assert!(
            beside == cost && other == free,
            "friction {friction}: {beside} instead of {cost}"
        );
    }
}

#[test]
fn a_resting_shoot_with_friction_does_not_creep() {
    // The base is horizontal. The shoot rests on a horizontal bar, and a lateral load is within the
    // cone of friction.
    let bar = Cylinder {
        through: Vector3::new(0.045, 0.0, -6e-3),
        along: Vector3::y(),
        radius: 2e-3,
    };
    let support = Contact {
        obstacle: bar,
        radius: RADIUS,
        friction: 0.5,
    };
    let mut shoot = rod(YOUNG, LENGTH)
        .load((WEIGHT, Distributed(Vector3::y() * 1e-5)))
        .scene(Still::tilted(std::f64::consts::FRAC_PI_2))
        .support(support)
        .into_dyn()
        .build()
        .unwrap();
    let mut run = MethodOfSteps::new(90.0);
    let _ = run.step(&mut shoot, 1e6).unwrap();
    let (first, tip) = (shoot.reactions().to_vec(), shoot.tip());
    assert_eq!(first.len(), 1, "{first:?}");
    for _ in 0..1000 {
        let _ = run.step(&mut shoot, 1e6).unwrap();
    }
    let last = shoot.reactions();
    println!("creep {:e} m", (shoot.tip() - tip).norm());
    assert!(
        last[0].slip == Some(Slip::Sticks)
            && (last[0].force - first[0].force).norm() < 1e-7 * first[0].normal
    );
    assert!((shoot.tip() - tip).norm() <= 1e-9 * LENGTH);
    assert_close(
        "place of contact",
        last[0].arc_length,
        first[0].arc_length,
        1e-9,
    );
}

/// A pole across the way of a straight rod along e3, which moves along −e1.
struct Approaching {
    speed: f64,
}

impl Obstacle for Approaching {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        let through = Vector3::new(3e-3 - self.speed * time, 0.0, 0.07);
        Cylinder {
            through,
            along: Vector3::y(),
            radius: 2e-3,
        }
        .distance(place, time)
    }

    fn velocity(&self, _place: &Vector3<f64>, _time: f64) -> Vector3<f64> {
        -Vector3::x() * self.speed
    }
}

#[test]
fn pole_pushes_a_straight_rod_and_does_not_pass_it() {
    for (speed, friction, step) in [(1e-5, 0.1, 0.3), (1e-5, 0.0, 0.3), (1e-3, 0.3, 1.0)] {
        let contact = Contact {
            obstacle: Approaching { speed },
            radius: 1e-3,
            friction,
        };
        let builder = Shoot::builder(TISSUE)
            .length(0.1)
            .radius(1e-3)
            .scene(Still::weightless());
        let mut shoot = builder.support(contact).build().unwrap();
        MethodOfSteps::new(step).advance(&mut shoot, step).unwrap();
        let place = shoot.rod().at(0.07).unwrap().0;
        // The rod touches the pole from the first instant. Sliding along the curved rod has a
        // second-order effect.
        let way = speed * step;
        assert!(
            (place.x + way).abs() < 1e-3 * way,
            "{speed} {friction}: {place:?}"
        );
        assert!(
            shoot.reactions().iter().all(|at| at.force.x < 0.0),
            "{:?}",
            shoot.reactions()
        );
    }
}

#[test]
fn heavy_rod_slides_off_the_middle_of_a_frictionless_sphere() {
    for (tilt, place) in [(0.4_f64, 0.04), (0.75, 0.06), (1.2, 0.09)] {
        let (up, across) = (tilt.cos(), tilt.sin());
        // The sphere is in the plane of the rod, below it, and holds it in an unstable equilibrium.
        let centre = Vector3::new(
            place * across + 0.016 * up,
            0.0,
            place * up - 0.016 * across,
        );
        let contact = Contact {
            obstacle: Sphere {
                centre,
                radius: 0.01,
            },
            radius: RADIUS,
            friction: 0.0,
        };
        let builder = || rod(YOUNG, 0.11).load(WEIGHT).scene(Still::tilted(tilt));
        let mut shoot = builder().support(contact).build().unwrap();
        let mut free = builder().build().unwrap();
        let _ = MethodOfSteps::new(60.0).advance(&mut shoot, 0.0).unwrap();
        let _ = MethodOfSteps::new(60.0).advance(&mut free, 0.0).unwrap();
        // The rod falls to the stable equilibrium without contact. The tolerance of both is 1e-8
        // rad.
        assert!(shoot.reactions().is_empty(), "{tilt}");
        assert!(
            (shoot.tip() - free.tip()).norm() < 1e-9,
            "{tilt}: {:?} {:?}",
            shoot.tip(),
            free.tip()
        );
    }
}

#[test]
fn first_equilibrium_of_a_shoot_does_not_depend_on_the_one_before() {
    // The tip of the straight shoot is inside the pole.
    let build = || {
        nutating(pole(0.02, 0.3))
            .scene(Still::tilted(0.32))
            .into_dyn()
            .build()
            .unwrap()
    };
    let mut first = build();
    let mut adaptive = Adaptive::new(1e-4);
    adaptive.advance(&mut first, 600.0).unwrap();
    let (mut used, mut fresh) = (build(), build());
    adaptive.start(&mut used, &ConstantHistory::Empty).unwrap();
    Adaptive::new(1e-4)
        .start(&mut fresh, &ConstantHistory::Empty)
        .unwrap();
    assert!(
        used.reactions().len() == 1 && used.state() == fresh.state(),
        "{:?}",
        used.reactions()
    );
}
