//! Profiles: position, strain, couple, force and growth at any arc length of a rod in equilibrium.

use crate::fixtures::gauss::gauss;
use crate::fixtures::in_norm::InNorm;
use crate::fixtures::rods::solve_tight;
use crate::fixtures::shoots::{DAY, HOUR, MEMORY, RADIUS, WEIGHT, YOUNG, reduced, rod};
use approx::{abs_diff_eq, assert_abs_diff_eq};
use morphorod::constitutive::{Constitutive, Tissue};
use morphorod::equilibrium::{EquilibriumSolver, Unloaded};
use morphorod::growth::{GrowthLaw, LinearProfile};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, GradedWeight, Load, PointForce};
use morphorod::profile::{Place, Profile};
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};
use nalgebra::{UnitQuaternion, Vector3};

const LENGTH: f64 = 0.06;

/// The profile of a tilted rod in equilibrium, evaluated at the given arc lengths.
fn read(
    law: &dyn Constitutive,
    load: &dyn Load,
    order: Order,
    elements: usize,
    places: &[f64],
) -> Vec<Place> {
    let scene = Still::tilted(1.2);
    let mut rod = Rod::uniform(LENGTH, RADIUS, scene.base, elements, order).unwrap();
    let environment = scene.environment(0.0);
    let _ = solve_tight(&mut rod, law, load, &environment).unwrap();
    let profile = Profile::of(&rod, &law, &load, &environment);
    places.iter().map(|s| profile.at(*s).unwrap()).collect()
}

#[test]
fn unloaded_helix_has_constant_strain_and_curvature() {
    let mut rod =
        Rod::uniform(LENGTH, RADIUS, UnitQuaternion::identity(), 3, Order::Eight).unwrap();
    // The intrinsic shape is a helix, bent by 20/m and twisted by 9/m. Its curvature is 20/m
    // everywhere.
    rod.set_intrinsic(|_| Vector3::new(0.0, 20.0, 9.0));
    let _ = Unloaded
        .solve(&mut rod, &YOUNG, &(), &Still::weightless().environment(0.0))
        .unwrap();
    let profile = Profile::of(&rod, &YOUNG, &(), &Still::weightless().environment(0.0));
    let places = profile.sample(41);
    assert_eq!(places.len(), 41);
    for (i, place) in places.iter().enumerate() {
        let s = LENGTH * i as f64 / 40.0;
        assert_abs_diff_eq!(place.arc_length, s, epsilon = 1e-16);
        assert_abs_diff_eq!(place.apex_distance, LENGTH - s, epsilon = 1e-16);
        assert_abs_diff_eq!(
            InNorm(place.strain),
            InNorm(Vector3::new(0.0, 20.0, 9.0)),
            epsilon = 1e-12
        );
        assert_abs_diff_eq!(place.curvature(), 20.0, epsilon = 1e-12);
        assert_eq!(
            (
                place.couple.norm(),
                place.force.norm(),
                place.regr,
                place.speed
            ),
            (0.0, 0.0, 0.0, 0.0)
        );
        // In the frame of the base, the axis of the helix is parallel to u. The frame rotates about
        // it by |u| s.
        let expected = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 20.0, 9.0) * s);
        // Three elements of order eight resolve 0.44 rad each to 1e-11.
        assert_abs_diff_eq!(place.frame.angle_to(&expected), 0.0, epsilon = 1e-10);
        let (position, frame) = rod.at(s).unwrap();
        assert_abs_diff_eq!(InNorm(place.position), InNorm(position), epsilon = 1e-13);
        assert_abs_diff_eq!(place.frame.angle_to(&frame), 0.0, epsilon = 1e-15);
        assert_abs_diff_eq!(
            InNorm(place.tangent()),
            InNorm(frame * Vector3::z()),
            epsilon = 1e-15
        );
    }
}

#[test]
fn couple_of_cantilever_is_the_moment_of_its_end_force() {
    let force = Vector3::new(2e-4, -1e-4, 5e-5);
    let pull = ApicalForce(move |_| force);
    let places: Vec<f64> = (0..=20).map(|i| LENGTH * f64::from(i) / 20.0).collect();
    let found = read(&YOUNG, &pull, Order::Eight, 6, &places);
    let tip = found[20].position;
    for place in &found {
        assert_eq!(place.force, force);
        // m = (p(ℓ) − p(s)) × F. Both sides are integrated by the same rule and differ only by
        // rounding.
        let moment = (tip - place.position).cross(&force);
        assert_abs_diff_eq!(
            InNorm(place.frame * place.couple),
            InNorm(moment),
            epsilon = 1e-14 * tip.norm() * force.norm()
        );
        assert_abs_diff_eq!(
            InNorm(place.strain),
            InNorm(place.couple.component_div(&YOUNG.stiffness(RADIUS))),
            epsilon = 1e-10
        );
    }
}

#[test]
fn couple_strain_and_position_converge_at_their_order_between_material_points() {
    // With 212 places, every part of an element is sampled on every mesh.
    let places: Vec<f64> = (0..=211).map(|i| LENGTH * f64::from(i) / 211.0).collect();
    let graded = GradedWeight(|tissue: &Tissue| 1000.0 + 2e4 * tissue.initial_apex_distance);
    let finest = read(&YOUNG, &graded, Order::Eight, 96, &places);
    for order in Order::ALL {
        let error = |elements: usize| {
            let found = read(&YOUNG, &graded, order, elements, &places);
            let apart = found.iter().zip(&finest).map(|(a, b)| {
                let couple = (a.couple - b.couple).norm() / finest[0].couple.norm();
                let strain = (a.strain - b.strain).norm() / finest[0].strain.norm();
                let position = (a.position - b.position).norm() / LENGTH;
                [
                    couple,
                    strain,
                    position,
                    (a.force - b.force).norm() / finest[0].force.norm(),
                ]
            });
            apart
                .reduce(|a, b| std::array::from_fn(|k| f64::max(a[k], b[k])))
                .unwrap()
        };
        let p = order.points() as i32;
        let (coarse, fine) = (error(16), error(32));
        for k in 0..3 {
            // The order of convergence is p + 2, except with one point, where the order 2 p of the
            // frames limits it. The floor of the error is rounding. Half an order is allowed
            // because the places have other relative positions within finer elements.
            let expected = coarse[k] / 2.0_f64.powf(f64::from((p + 2).min(2 * p)) - 0.5);
            assert!(
                fine[k] < expected.max(1e-12),
                "order {order:?}, quantity {k}: {:e} then {:e}",
                coarse[k],
                fine[k]
            );
        }
        // Two points or more represent a linear density exactly.
        assert!(p == 1 || fine[3] < 1e-13, "{:e}", fine[3]);
    }
}

#[test]
fn arc_length_of_inverts_the_initial_apex_distance_at_every_order() {
    for order in Order::ALL {
        let rod = Rod::uniform(LENGTH, RADIUS, UnitQuaternion::identity(), 4, order).unwrap();
        let (load, environment) = (WEIGHT, Still::upright().environment(0.0));
        let profile = Profile::of(&rod, &YOUNG, &load, &environment);
        for place in profile.sample(37) {
            // Initial apex distances are linear along a rod that has not grown.
            let found = rod
                .arc_length_of(LENGTH - place.tissue.initial_apex_distance)
                .unwrap();
            assert!(
                abs_diff_eq!(found, place.arc_length, epsilon = 1e-15),
                "{order:?}: {found} against {}",
                place.arc_length
            );
        }
    }
}

#[test]
fn point_force_loads_only_the_part_below_it() {
    let force = Vector3::new(1e-4, 0.0, 0.0);
    let load = PointForce {
        initial_apex_distance: 0.4 * LENGTH,
        force,
    };
    let shoot = |steps: f64| {
        let mut shoot = rod(YOUNG, LENGTH).load(load).into_dyn().build().unwrap();
        let _ = MethodOfSteps::new(60.0).advance(&mut shoot, steps).unwrap();
        shoot
    };
    let shoot = shoot(60.0);
    let profile = shoot.profile();
    let at = |x: f64| profile.at(x * LENGTH).unwrap();
    assert_eq!(
        (at(0.599).force, at(0.601).force),
        (force, Vector3::zeros())
    );
    assert!(at(0.601).couple.norm() == 0.0 && at(0.599).couple.norm() > 0.0);
}

#[test]
fn profile_of_growing_shoot_matches_traced_growth() {
    let (initial, zone, time) = (0.05, 0.03, 20.0 * HOUR);
    let law = LinearProfile {
        zone_length: zone,
        time,
    };
    let mut shoot = rod(YOUNG, initial)
        .growth(law)
        .load(WEIGHT)
        .into_dyn()
        .build()
        .unwrap();
    let now = 9.0 * HOUR;
    let _ = MethodOfSteps::new(300.0).advance(&mut shoot, now).unwrap();
    let (rod, profile) = (shoot.rod(), shoot.profile());
    let range = rod.growth_zone();
    assert_abs_diff_eq!(range.end, law.length(initial, now), epsilon = 1e-12);
    assert_abs_diff_eq!(range.end - range.start, zone, epsilon = 1e-12);
    for i in 0..=30 {
        let start = initial * f64::from(i) / 30.0;
        let exact = law.trace(initial, start, now);
        // Initial apex distances between material points are interpolated with order four in
        // elements of 1/13 of the shoot.
        let s = rod.arc_length_of(start).unwrap();
        assert!(
            abs_diff_eq!(s, exact.arc_length, epsilon = 1e-7),
            "{start}: {s} against {}",
            exact.arc_length
        );
        let place = profile.at(s).unwrap();
        assert_abs_diff_eq!(
            place.tissue.initial_apex_distance,
            initial - start,
            epsilon = 1e-9
        );
        assert_eq!(place.tissue.age > 0.0, s < range.start - 1e-9, "{s}");
        // The expected speed is the derivative of the traced path, by central differences over two
        // minutes.
        let at = |t: f64| law.trace(initial, start, t).arc_length;
        let speed = (at(now + 60.0) - at(now - 60.0)) / 120.0;
        if (s - range.start).abs() > 1e-4 {
            assert!(
                abs_diff_eq!(place.speed, speed, epsilon = 1e-5 * zone / time),
                "{s}: {} against {speed}",
                place.speed
            );
            let regr = if s > range.start {
                2.0 * (1.0 - (range.end - s) / zone) / time
            } else {
                0.0
            };
            assert!(
                abs_diff_eq!(place.regr, regr, epsilon = 1e-9 / time),
                "{s}: {} against {regr}",
                place.regr
            );
        }
    }
    // The age of tissue is the time since it left the growth zone, s.
    let half = 0.5 * range.start.max(initial - zone) + 0.5 * (initial - zone);
    let place = profile.at(half).unwrap();
    let exit = law
        .trace(initial, initial - place.tissue.initial_apex_distance, now)
        .exit_time
        .unwrap();
    assert_abs_diff_eq!(place.tissue.age, now - exit, epsilon = 1e-5 * DAY);
}

#[test]
fn profile_of_tropic_shoot_contains_its_intrinsic_strain() {
    let mut shoot = reduced(LENGTH, 72e3)
        .scene(Still::tilted(1.2))
        .into_dyn()
        .build()
        .unwrap();
    let _ = MethodOfSteps::new(0.25 * MEMORY.delay)
        .advance(&mut shoot, 6.0 * HOUR)
        .unwrap();
    let (rod, profile) = (shoot.rod(), shoot.profile());
    let mut below = 0.0;
    for e in 0..rod.elements() {
        for g in 0..rod.order().points() {
            // In a uniform element, the material points are at the nodes of the Gauss rule.
            let x = gauss(rod.order().points()).0[g];
            let place = profile
                .at(below + x * rod.element_length(e).unwrap())
                .unwrap();
            let point = &rod.points()[e * rod.order().points() + g];
            assert_abs_diff_eq!(
                InNorm(place.intrinsic),
                InNorm(point.intrinsic),
                epsilon = 1e-11 * point.intrinsic.norm()
            );
            // The strain from differentiated rotations converges with order p + 1, and that from
            // couples with order p + 2.
            assert_abs_diff_eq!(
                InNorm(place.strain),
                InNorm(rod.strain(e, g).unwrap()),
                epsilon = 1e-4 * place.strain.norm()
            );
            assert_eq!((place.regr, place.speed), (1.0 / 72e3, 0.0));
        }
        below += rod.element_length(e).unwrap();
    }
}

#[test]
fn places_beyond_the_ends_of_a_rod_have_no_profile() {
    let scene = Still::upright();
    let rod = Rod::uniform(LENGTH, RADIUS, scene.base, 2, Order::Four).unwrap();
    let (load, environment) = (WEIGHT, scene.environment(0.0));
    let profile = Profile::of(&rod, &YOUNG, &load, &environment);
    assert!(profile.at(f64::NAN).is_none() && rod.arc_length_of(f64::NAN).is_none());
    for beyond in [
        -1.0,
        -1e-6 * LENGTH,
        LENGTH * (1.0 + 1e-6),
        f64::INFINITY,
        f64::NEG_INFINITY,
    ] {
        assert!(
            profile.at(beyond).is_none() && rod.at(beyond).is_none(),
            "{beyond}"
        );
    }
    // A place that is beyond an end by rounding is at the end.
    assert_eq!(profile.at(-1e-12 * LENGTH), profile.at(0.0));
    let [beyond, apex] = [LENGTH * (1.0 + 1e-12), LENGTH].map(|s| profile.at(s).unwrap());
    assert_abs_diff_eq!(beyond.arc_length, LENGTH, epsilon = 1e-16);
    assert_abs_diff_eq!(
        InNorm(beyond.position),
        InNorm(apex.position),
        epsilon = 1e-16
    );
    assert_eq!(profile.sample(0).len(), 0);
    assert_eq!(profile.sample(1), [profile.at(0.0).unwrap()]);
    assert_abs_diff_eq!(rod.arc_length_of(-5.0).unwrap(), 0.0, epsilon = 1e-16);
    assert_abs_diff_eq!(rod.arc_length_of(5.0).unwrap(), LENGTH, epsilon = 1e-16);
    assert_abs_diff_eq!(
        rod.arc_length_of(0.31 * LENGTH).unwrap(),
        0.31 * LENGTH,
        epsilon = 1e-16
    );
    assert_eq!(rod.growth_zone(), 0.0..rod.length());
}
