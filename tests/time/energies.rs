//! Energies of a shoot: closed forms, the work of a load that changes slowly, and the power of
//! growth.

use crate::fixtures::shoots::{RADIUS, WEIGHT, YOUNG, rod, tissue};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::constitutive::{Constitutive, Timoshenko};
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::growth::{GrowthLaw, UniformGrowth};
use morphorod::integrator::{ConstantHistory, Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Load};
use morphorod::support::{Contact, Distance, Hold, Obstacle, Support};
use morphorod::tropism::{Handedness, Oscillator};
use morphorod::{Along, DynLaws, Scene, Shoot, ShootParameters, Still};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

const LENGTH: f64 = 0.05;

/// A shoot without growth.
fn shoot(
    law: impl Constitutive + Send + Sync + 'static,
    load: impl Load + Send + Sync + 'static,
    scene: Still,
    support: impl Support + Send + Sync + 'static,
) -> Shoot<DynLaws> {
    let builder = rod(law, LENGTH).growth(()).load(load).scene(scene);
    builder.support(support).into_dyn().build().unwrap()
}

#[test]
fn uniformly_bent_shoot_and_its_elastic_joint_have_energies_of_closed_form() {
    let (angle, joint) = (0.5, 2e-6);
    let frame = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
    let law = YOUNG;
    let mut shoot = shoot(
        law,
        (),
        Still::weightless(),
        Hold::apex().elastic_joint(frame, joint),
    );
    MethodOfSteps::new(60.0).advance(&mut shoot, 60.0).unwrap();
    // A couple bends the shoot uniformly by the angle φ: E I φ/ℓ = K (θ − φ).
    let stiffness = law.stiffness(RADIUS).y / LENGTH;
    let bent = angle * joint / (joint + stiffness);
    let energies = shoot.energies();
    // The equilibrium has an error of 1e-11 rad.
    assert_relative_eq!(
        energies.elastic,
        0.5 * stiffness * bent * bent,
        epsilon = 0.0,
        max_relative = 1e-9
    );
    assert_relative_eq!(
        energies.support,
        0.5 * joint * (angle - bent).powi(2),
        epsilon = 0.0,
        max_relative = 1e-9
    );
    assert_eq!(energies.load, 0.0);
    assert_eq!(energies.total(), energies.elastic + energies.support);
    for place in shoot.profile().sample(5) {
        assert_relative_eq!(
            place.elastic_energy * LENGTH,
            energies.elastic,
            epsilon = 0.0,
            max_relative = 1e-8
        );
    }
}

#[test]
fn heavy_cantilever_has_the_energy_of_small_deflection() {
    let law = tissue(1e10);
    let mut shoot = shoot(law, WEIGHT, Still::tilted(FRAC_PI_2), ());
    MethodOfSteps::new(60.0).advance(&mut shoot, 60.0).unwrap();
    let (q, stiffness) = (
        9.81 * WEIGHT.density * shoot.rod().volume() / LENGTH,
        law.stiffness(RADIUS).x,
    );
    // m = q (ℓ − s)²/2, and W = ∫ m²/(2 E I) ds. The load has done twice this work.
    let elastic = q * q * LENGTH.powi(5) / (40.0 * stiffness);
    // The linear theory has a relative error of the order of the square of the slope, q ℓ³/(6 E I).
    let slope = q * LENGTH.powi(3) / (6.0 * stiffness);
    let energies = shoot.energies();
    assert_relative_eq!(
        energies.elastic,
        elastic,
        epsilon = 0.0,
        max_relative = 4.0 * slope * slope
    );
    assert_relative_eq!(
        energies.load,
        -2.0 * elastic,
        epsilon = 0.0,
        max_relative = 4.0 * slope * slope
    );
    // The solver evaluates the same energy in other variables.
    let mut rod = shoot.rod().clone();
    let found = NewtonSolver::default()
        .solve(&mut rod, &law, &WEIGHT, &shoot.environment())
        .unwrap();
    assert_relative_eq!(
        energies.total(),
        found.energy,
        epsilon = 0.0,
        max_relative = 1e-10
    );
    // The integral of the density by the trapezoidal rule, with an error of 1e-6 at 1001 places.
    let places = shoot.profile().sample(1001);
    let sum: f64 = places
        .windows(2)
        .map(|ends| 0.5 * (ends[0].elastic_energy + ends[1].elastic_energy))
        .sum();
    assert_relative_eq!(
        sum * LENGTH / 1000.0,
        energies.elastic,
        epsilon = 0.0,
        max_relative = 1e-5
    );
}

/// A horizontal floor that yields, without friction.
struct Mattress;

impl Obstacle for Mattress {
    fn distance(&self, place: &Vector3<f64>, _time: f64) -> Distance {
        Distance {
            value: place.z + 2e-3,
            normal: Vector3::z(),
            curvature: Matrix3::zeros(),
        }
    }
    fn compliance(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 2.0))
    }
}

/// The force on the apex during the run, N.
fn force(t: f64) -> Vector3<f64> {
    let phase = t / 600.0;
    Vector3::new(4e-5 * phase, 5e-5 * phase.sin(), -1e-4 * phase * phase)
}

/// Change of the energies without that of the force on the apex in a run of some steps, and the
/// work of this force by the trapezoidal rule, J.
fn balance(mut shoot: Shoot<DynLaws>, steps: usize) -> [f64; 2] {
    let step = 600.0 / steps as f64;
    let mut solver = MethodOfSteps::new(step);
    solver.advance(&mut shoot, 0.0).unwrap();
    let energy = |shoot: &Shoot<DynLaws>| {
        let energies = shoot.energies();
        energies.elastic + energies.support + shoot.load_energy(&WEIGHT)
    };
    let (start, mut work) = (energy(&shoot), 0.0);
    for k in 0..steps {
        let (tip, time) = (shoot.tip(), [k, k + 1].map(|k| k as f64 * step));
        solver.advance(&mut shoot, time[1]).unwrap();
        work += 0.5 * (force(time[0]) + force(time[1])).dot(&(shoot.tip() - tip));
    }
    [energy(&shoot) - start, work]
}

/// Checks that the change of the energy is the work, up to an error of second order in the step.
fn check_balance(shoot: &Shoot<DynLaws>) {
    let errors = [8, 16, 32].map(|steps| {
        let [energy, work] = balance(shoot.clone(), steps);
        (energy - work) / work
    });
    println!("relative errors of the balance {errors:?}");
    assert!(errors[2].abs() < 1e-3, "{errors:?}");
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((order - 2.0).abs() < 0.2, "{errors:?}");
    }
}

#[test]
fn work_of_a_slow_load_is_stored_in_bending_shear_and_springs() {
    let law = Timoshenko::circular(YOUNG);
    let spring =
        Hold::place(0.02).spring(Vector3::new(0.04, 1e-3, 0.0), Matrix3::identity() * 5e-3);
    let load = (WEIGHT, ApicalForce(force));
    check_balance(&shoot(law, load, Still::tilted(FRAC_PI_2), ()));
    check_balance(&shoot(law, load, Still::tilted(FRAC_PI_2), spring));
}

#[test]
fn work_of_a_slow_load_is_stored_in_an_obstacle_that_yields() {
    let load = (WEIGHT, ApicalForce(force));
    let floor = Contact {
        obstacle: Mattress,
        radius: RADIUS,
        friction: 0.0,
    };
    let shoot = shoot(YOUNG, load, Still::tilted(FRAC_PI_2), floor);
    check_balance(&shoot);
}

const GROWTH: UniformGrowth = UniformGrowth {
    zone_length: 0.04,
    time: 72e3,
};
const OSCILLATOR: Oscillator = Oscillator {
    sensitivity: 0.3,
    period: 7200.0,
    phase: 0.4,
    handedness: Handedness::Counterclockwise,
};

/// Power of growth, W: the rate of the energy in constant frames.
///
/// With the length J of tissue per material coordinate the energy is ∫ (W(θ′/J − u*) − n · t) J. It
/// changes by J̇ = REGR J and by u̇* at the rate
///
/// ```text
/// ∫ REGR (W − m · u − n · t) − m · u̇* − ṅ · t ds.
/// ```
///
/// The weight n beyond a place increases by that of the tissue that grows there.
fn power(shoot: &Shoot<DynLaws>) -> f64 {
    let (profile, length) = (shoot.profile(), shoot.rod().length());
    let tip = profile.at(length).unwrap();
    let (sin, cos) = (TAU * shoot.time() / OSCILLATOR.period + OSCILLATOR.phase).sin_cos();
    let gradient = Vector3::new(cos, sin, 0.0) * (OSCILLATOR.sensitivity / RADIUS);
    let density = |s: f64| {
        let place = profile.at(s).unwrap();
        let (tangent, gravity) = (place.frame * place.line_strain, shoot.environment().gravity);
        let weight =
            gravity * (WEIGHT.density * place.tissue.section.area() * (tip.speed - place.speed));
        let work = place.couple.dot(&place.strain) + place.force.dot(&tangent);
        place.regr * (place.elastic_energy - work - place.couple.dot(&gradient))
            - weight.dot(&tangent)
    };
    // Three Gauss points on each quarter of each element, since the intrinsic strain has kinks at
    // the nodes.
    let rod = shoot.rod();
    let gauss = [
        (-0.6_f64.sqrt(), 5.0 / 18.0),
        (0.0, 8.0 / 18.0),
        (0.6_f64.sqrt(), 5.0 / 18.0),
    ];
    let (mut start, mut sum) = (0.0, 0.0);
    for e in 0..rod.elements() {
        let h = rod.element_length(e).unwrap() / 4.0;
        for k in 0..4 {
            let middle = start + h * (f64::from(k) + 0.5);
            sum += gauss
                .map(|(x, w)| w * h * density(middle + 0.5 * h * x))
                .iter()
                .sum::<f64>();
        }
        start += 4.0 * h;
    }
    sum
}

/// A shoot that grows, with an oscillator and weight.
fn growing(scene: impl Scene + Send + Sync + 'static) -> Shoot<DynLaws> {
    let builder = rod(YOUNG, LENGTH).growth(GROWTH).tropism(OSCILLATOR);
    builder
        .load(WEIGHT)
        .scene(scene)
        .merge_tolerance(0.0)
        .into_dyn()
        .build()
        .unwrap()
}

#[test]
fn power_of_growth_is_the_integral_over_the_places_of_the_profile() {
    let mut shoot = growing(Still::tilted(0.5));
    let mut solver = MethodOfSteps::with_solver(600.0, NewtonSolver::with_tolerance(1e-12));
    let powers: [_; 13] = std::array::from_fn(|k| {
        solver.advance(&mut shoot, 600.0 * k as f64).unwrap();
        [shoot.growth_power(), power(&shoot)]
    });
    let largest = powers
        .iter()
        .map(|[_, expected]| expected.abs())
        .fold(0.0, f64::max);
    // The central differences have the largest error, 4e-12 of the largest power.
    for [found, expected] in powers {
        println!(
            "{found:e} W, difference {:e} of the largest",
            (found - expected) / largest
        );
        assert_relative_eq!(
            found,
            expected,
            epsilon = 1e-10 * largest,
            max_relative = 0.0
        );
    }
}

/// REGR of 1/τ within 1 cm of the apex and between 2 and 3 cm. Both zones end inside elements,
/// except at 3 cm.
struct TwoZones {
    /// τ, s.
    time: f64,
}

impl GrowthLaw for TwoZones {
    fn regr(&self, sigma: f64, _t: f64) -> f64 {
        if sigma < 0.01 || (0.02 < sigma && sigma <= 0.03) {
            1.0 / self.time
        } else {
            0.0
        }
    }

    fn zone_length(&self) -> f64 {
        0.03
    }

    fn apical_speed(&self, sigma: f64, _t: f64) -> f64 {
        (sigma.min(0.01) + (sigma.min(0.03) - 0.02).max(0.0)) / self.time
    }
}

/// Relative error of the balance of energy over twenty hours on a mesh, with Simpson's rule for the
/// work of growth over samples at an interval (s).
fn balance_error(elements: usize, interval: f64) -> f64 {
    let builder = rod(YOUNG, LENGTH).growth(TwoZones { time: 36e3 });
    let builder = builder
        .load(WEIGHT)
        .scene(Still::tilted(0.5))
        .merge_tolerance(0.0)
        .elements(elements);
    let mut shoot = builder.build().unwrap();
    let (mut energies, mut work) = (Vec::new(), 0.0);
    let pairs = (36_000.0 / interval) as usize;
    for k in 0..=2 * pairs {
        MethodOfSteps::new(600.0)
            .advance(&mut shoot, interval * k as f64)
            .unwrap();
        energies.push(shoot.energies().total());
        let ends = k == 0 || k == 2 * pairs;
        let weight = if ends { 1.0 } else { [2.0, 4.0][k % 2] };
        work += shoot.growth_power() * weight * interval / 3.0;
    }
    let change = energies[2 * pairs] - energies[0];
    ((work - change) / change).abs()
}

#[test]
fn power_of_growth_is_that_of_the_discretised_shoot_if_zones_end_inside_elements() {
    let errors = [1200.0, 600.0, 300.0].map(|interval| balance_error(16, interval));
    println!("errors {errors:?} of the energy exchanged");
    for pair in errors.windows(2) {
        // Four is the order of Simpson's rule.
        assert_abs_diff_eq!((pair[0] / pair[1]).log2(), 4.0, epsilon = 0.2);
    }
    // The last error is 2.6e-11. Rates of single points, without regard to the lengths of elements,
    // leave 5e-5.
    assert!(errors[2] < 1e-10);
}

#[test]
fn new_tissue_has_the_energy_of_its_height_above_the_origin() {
    let height = 0.3;
    let raised = Along {
        scene: Still::tilted(0.5),
        path: move |_: f64| Vector3::new(0.1, 0.0, height),
    };
    let [below, above] = [growing(Still::tilted(0.5)), growing(raised)].map(|mut shoot| {
        MethodOfSteps::new(600.0)
            .advance(&mut shoot, 600.0)
            .unwrap();
        shoot.growth_power()
    });
    let weight = 9.81 * WEIGHT.density * PI * RADIUS * RADIUS * GROWTH.zone_length / GROWTH.time;
    // The central differences have errors of 1e-10.
    assert_relative_eq!(
        above - below,
        weight * height,
        epsilon = 0.0,
        max_relative = 1e-9
    );
}

#[test]
fn tissue_that_has_just_become_mature_has_the_power_of_lignification() {
    let law = ShootParameters::default().lignifying();
    let [long, short] = [LENGTH, 0.03].map(|zone_length| UniformGrowth {
        zone_length,
        time: 72e3,
    });
    for start in [0.0, 1e5] {
        let builder = rod(law, LENGTH).load(WEIGHT).scene(Still::tilted(0.5));
        let mut shoot = builder.growth(long).build().unwrap();
        MethodOfSteps::new(600.0)
            .advance(&mut shoot, start)
            .unwrap();
        // Laws are evaluated a few units of rounding after the exchange, which makes tissue mature.
        let mut shoot = shoot
            .with_model_restarted((*shoot.model()).with_growth(short))
            .unwrap();
        let mut run = MethodOfSteps::new(1.0);
        let _ = run.start(&mut shoot, &ConstantHistory::Empty).unwrap();
        let at_once = shoot.growth_power();
        run.advance(&mut shoot, start + 1.0).unwrap();
        let soon = shoot.growth_power();
        // The growth and the lignification of one second change the power by about 1e-4 of itself.
        // Without the lignification of this tissue it is smaller by a third at least.
        assert_relative_eq!(at_once, soon, epsilon = 0.0, max_relative = 1e-3);
    }
}
