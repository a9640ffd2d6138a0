//! Shoots that shear and stretch: as they grow, steer, are saved, are asked for their stability, and are held to a tolerance.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::fixtures::shoots::{
    DAY, HOUR, Imperfection, RADIUS, STATOLITHS, WEIGHT, YOUNG, growing, righting, steering,
};
use morphorod::constitutive::{Constitutive, Graded, Lignifying, LinearElastic, Timoshenko, Tissue};
use morphorod::equilibrium::EquilibriumError;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Adaptive, EmptyHistory, IntegrationError, Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, PointForce, Weight};
use morphorod::stability::{Linearisation, Root, StationarySolver};
use morphorod::tropism::{Gravitropism, Oscillator, Proprioception, Remembered, Statoliths};
use morphorod::{Laws, Model, Shoot, ShootBuilder, State, Still};
use nalgebra::{UnitQuaternion, Vector3};

/// Tissue a thousand times softer against shear and stretch than against bending: what it does then is not small.
fn soft() -> Timoshenko<LinearElastic> {
    let Timoshenko { law, youngs_modulus, shear_modulus, shear_factor } = Timoshenko::circular(YOUNG);
    Timoshenko { law, youngs_modulus: 1e-3 * youngs_modulus, shear_modulus: 1e-3 * shear_modulus, shear_factor }
}

type Gravity = Remembered<Gravitropism<Statoliths>>;
type Bend = Remembered<Proprioception>;

/// The growing shoot of soft tissue that lignifies in every way.
fn lignifying() -> ShootBuilder<Laws<impl Constitutive + Copy, UniformGrowth, (Oscillator, Gravity, Bend), Imperfection>>
{
    let wood = Lignifying { young: YOUNG, mature_modulus: 200.0 * YOUNG.youngs_modulus, time: 6.0 * DAY };
    let laws = growing()
        .build()
        .unwrap()
        .model()
        .with_constitutive(Graded { law: soft(), factor: move |tissue: &Tissue| wood.ratio(tissue.age) });
    Shoot::of(laws).length(0.068).radius(RADIUS)
}

#[test]
fn growth_lengthens_the_unstretched_rod_and_its_weight_stretches_what_there_is() {
    // ℓ = ℓ0 exp(t/τg) while all of it grows; hanging, it stretches by ρ g ℓ²/(2 E).
    let time = 40.0 * HOUR;
    let down = Still { base: UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI), ..Still::upright() };
    let mut shoot = Shoot::builder(soft())
        .length(0.05)
        .radius(RADIUS)
        .growth(UniformGrowth { zone_length: 0.2, time })
        .load(WEIGHT)
        .scene(down)
        .into_dyn()
        .build()
        .unwrap();
    for hours in [5.0, 20.0] {
        let _ = MethodOfSteps::new(600.0).advance(&mut shoot, hours * HOUR).unwrap();
        let length = 0.05 * (hours * HOUR / time).exp();
        let stretched = length + 1000.0 * 9.81 * length * length / (2.0 * soft().youngs_modulus);
        // Rounding of 120 factors of growth.
        let close = |x: f64, y: f64| (x / y - 1.0).abs() < 500.0 * f64::EPSILON;
        assert!(stretched > 1.02 * length && close(shoot.rod().length(), length));
        assert!(close(shoot.tip().norm(), stretched) && close(shoot.rod().centre_line_length(), stretched));
    }
}

#[test]
fn a_growing_shoot_that_is_saved_goes_on_bit_by_bit() {
    let mut shoot = lignifying().into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(120.0);
    let _ = run.advance(&mut shoot, 4.0 * HOUR).unwrap();
    let (s, line) = (shoot.rod().length(), shoot.rod().centre_line_length());
    assert!((line / s - 1.0).abs() > 1e-3, "it stretches: {line} for {s}");
    let state: State = postcard::from_bytes(&postcard::to_allocvec(shoot.state()).unwrap()).unwrap();
    assert_eq!(&state, shoot.state());
    let mut resumed = lignifying().into_dyn().build().unwrap();
    resumed.restore(&state).unwrap();
    assert_eq!(resumed.tip(), shoot.tip());
    let merged = run.advance(&mut shoot, 8.0 * HOUR).unwrap();
    let _ = MethodOfSteps::new(120.0).advance(&mut resumed, 8.0 * HOUR).unwrap();
    assert!(resumed.state() == shoot.state());
    assert!(merged.merges > 0 && merged.splits > 0, "{merged:?}");
    // Under other laws nodes are put where a load jumps: cut elements are the same line.
    let clip = PointForce { initial_apex_distance: 0.0301, force: Vector3::x() * 1e-7 };
    let other = shoot.with_model(shoot.model().clone().with_load(clip).into_dyn()).unwrap();
    assert_eq!(other.rod().elements(), shoot.rod().elements() + 1);
    // A polynomial of degree p in rotations and of p − 1 in the strain of the line, integrated by p points on either part.
    assert!((other.tip() - shoot.tip()).norm() < 1e-9 * s, "{:e}", (other.tip() - shoot.tip()).norm());
    assert!((other.rod().centre_line_length() - shoot.rod().centre_line_length()).abs() < 1e-9 * s);
}

#[test]
fn a_boxed_law_and_a_graded_one_give_the_same_shoot() {
    let build = |law: Box<dyn Constitutive + Send + Sync>| {
        let builder = Shoot::builder(law).length(0.05).radius(RADIUS).load(WEIGHT).scene(Still::tilted(FRAC_PI_2));
        let growth = Ongoing(UniformGrowth { zone_length: 0.07, time: 20.0 * HOUR });
        let mut shoot = builder.growth(growth).tropism(steering(STATOLITHS)).into_dyn().build().unwrap();
        let _ = MethodOfSteps::new(120.0).advance(&mut shoot, HOUR).unwrap();
        shoot.tip()
    };
    let direct = build(Box::new(soft()));
    assert!((direct - build(Box::new(YOUNG))).norm() > 1e-3 * 0.05, "shear and stretch show");
    // Twice a law of half the moduli: powers of two change no bit.
    let half = Timoshenko {
        law: LinearElastic { youngs_modulus: 0.5 * YOUNG.youngs_modulus, ..YOUNG },
        youngs_modulus: 0.5 * soft().youngs_modulus,
        shear_modulus: 0.5 * soft().shear_modulus,
        ..soft()
    };
    assert_eq!(build(Box::new(Graded { law: half, factor: |_: &Tissue| 2.0 })), direct);
}

/// An upright shoot that steers, of some law, with a force at half its height.
fn upright(law: impl Constitutive, force: f64) -> Shoot<impl Model> {
    Shoot::builder(law)
        .length(0.05)
        .radius(RADIUS)
        .elements(4)
        .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 20.0 * HOUR }))
        .tropism(steering(STATOLITHS))
        .load(PointForce { initial_apex_distance: 0.025, force: Vector3::z() * -force })
        .build()
        .unwrap()
}

#[test]
fn an_upright_shoot_under_p_has_the_roots_of_a_rigid_line_under_haringx_p() {
    // To first order a force P turns the frames as P (1 + P/(κ G A) − P/(E A)) would without shear and stretch, and
    // the laws see frames and strains alone. So the roots are the same, but for the error of differences, 1e-9.
    let area = PI * RADIUS * RADIUS;
    let (shear, stretch) = (soft().shear_factor * soft().shear_modulus * area, soft().youngs_modulus * area);
    let force = 1.2e-3;
    let effective = force * (1.0 + force / shear - force / stretch);
    assert!((effective / force - 1.0).abs() > 0.01);
    fn roots(mut shoot: Shoot<impl Model>) -> Vec<Root> {
        let _ = StationarySolver::default().solve(&mut shoot).unwrap();
        Linearisation::about(&shoot).unwrap().roots(-2e-4).unwrap()
    }
    let (soft_roots, rigid, wrong) =
        (roots(upright(soft(), force)), roots(upright(YOUNG, effective)), roots(upright(YOUNG, force)));
    assert!(!soft_roots.is_empty() && soft_roots.len() == rigid.len(), "{} {}", soft_roots.len(), rigid.len());
    for (a, b) in soft_roots.iter().zip(&rigid) {
        assert!((a.value - b.value).norm() < 1e-7 * b.value.norm(), "{} {}", a.value, b.value);
    }
    assert!((soft_roots[0].value - wrong[0].value).norm() > 1e-4 * wrong[0].value.norm());
    // Below the force the line leans by 1 + P/(κ G A) − P/(E A) times as much as the frames, above it as they do.
    let middle = |root: &Root| root.displacement[4].dotc(&root.displacement[2]) / root.displacement[4].norm_squared();
    let (found, frames) = (middle(&soft_roots[0]), middle(&rigid[0]));
    let lean = frames * (effective / force);
    let expected = lean / (lean + 1.0 - frames);
    assert!((found - expected).norm() < 1e-7 && (found - frames).norm() > 0.05, "{found} {expected} {frames}");
}

#[test]
fn a_shape_at_rest_keeps_the_tolerance_that_it_is_given() {
    for tolerance in [1e-4, 1e-7, 1e-9] {
        let settle = |tolerance: f64| {
            let laws = righting().build().unwrap().model().with_constitutive(soft());
            let mut shoot = Shoot::of(laws).length(0.05).radius(RADIUS).into_dyn().build().unwrap();
            let found = Adaptive::new(tolerance).start(&mut shoot, &EmptyHistory).unwrap();
            (shoot, found)
        };
        let ((shoot, found), (finest, _)) = (settle(tolerance), settle(1e-12));
        let error = found.error.expect("an estimate");
        let places = |shoot: &Shoot<_>| shoot.rod().centre_line_at(33);
        let off = places(&shoot).iter().zip(places(&finest)).map(|(a, b)| (a - b).norm() / 0.05).fold(0.0, f64::max);
        assert!(error <= tolerance && off <= tolerance, "{tolerance:e}: {off:e}, by its estimate {error:e}");
    }
}

#[test]
fn a_shoot_that_is_crushed_is_an_error_that_leaves_it() {
    // A weight ten thousand times that of water compresses the foot by ρ g ℓ/E = 0.5 of itself, and the force by the rest.
    let law = Timoshenko { youngs_modulus: 5e3, ..Timoshenko::circular(YOUNG) };
    let crush = |force: f64| {
        let mut shoot = Shoot::builder(law)
            .length(2e-3)
            .radius(RADIUS)
            .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 20.0 * HOUR }))
            .tropism(steering(STATOLITHS))
            .load((Weight { density: 1000.0 }, ApicalForce(move |t: f64| Vector3::z() * (-force * t / HOUR))))
            .into_dyn()
            .build()
            .unwrap();
        let mut run = MethodOfSteps::new(600.0);
        let _ = run.advance(&mut shoot, 600.0).unwrap();
        let before = shoot.state().clone();
        (run.advance(&mut shoot, HOUR), before == *shoot.state())
    };
    let most = law.youngs_modulus * PI * RADIUS * RADIUS - 1000.0 * 9.81 * 2e-3 * PI * RADIUS * RADIUS;
    assert!(crush(0.999 * most).0.is_ok());
    let (answer, unharmed) = crush(1.001 * most);
    let crushed = matches!(answer, Err(IntegrationError::Equilibrium { source: EquilibriumError::Crushed { .. }, .. }));
    assert!(crushed && unharmed, "{answer:?}");
}
