//! Shoots that shear and stretch: growth, steering, saved states, stability, and runs with a
//! tolerance.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{
    HOUR, RADIUS, STATOLITHS, WEIGHT, YOUNG, growing, righting, rod, steering, tissue,
};
use approx::{assert_abs_diff_eq, assert_relative_eq, assert_relative_ne};
use morphorod::constitutive::{Constitutive, Graded, LinearElastic, Timoshenko, Tissue};
use morphorod::equilibrium::EquilibriumError;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{
    Adaptive, ConstantHistory, IntegrationError, Integrator, MethodOfSteps,
};
use morphorod::load::{ApicalForce, PointForce};
use morphorod::stability::{Linearisation, Root, solve_steady_state};
use morphorod::{DynLaws, Shoot, ShootBuilder, ShootParameters, State, Still};
use nalgebra::{UnitQuaternion, Vector3};

/// Tissue a thousand times softer against shear and stretch than against bending, so that shear and
/// stretch are large.
fn soft() -> Timoshenko<LinearElastic> {
    let Timoshenko {
        law,
        youngs_modulus,
        shear_modulus,
        shear_factor,
    } = Timoshenko::circular(YOUNG);
    Timoshenko {
        law,
        youngs_modulus: 1e-3 * youngs_modulus,
        shear_modulus: 1e-3 * shear_modulus,
        shear_factor,
    }
}

/// The growing shoot of soft tissue, in which lignification raises all stiffnesses by one factor.
fn lignifying() -> ShootBuilder<DynLaws> {
    let wood = ShootParameters::default().lignifying();
    let graded = Graded {
        law: soft(),
        factor: move |tissue: &Tissue| wood.ratio(tissue.age),
    };
    let laws = growing()
        .into_dyn()
        .build()
        .unwrap()
        .model()
        .clone()
        .with_constitutive(graded);
    Shoot::of(laws.into_dyn()).length(0.068).radius(RADIUS)
}

#[test]
fn growth_lengthens_the_unstretched_rod_and_weight_stretches_it() {
    // ℓ = ℓ0 exp(t/τg) while the whole shoot grows; a hanging shoot stretches by ρ g ℓ²/(2 E).
    let time = 40.0 * HOUR;
    let down = Still {
        base: UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI),
        ..Still::upright()
    };
    let mut shoot = rod(soft(), 0.05)
        .growth(UniformGrowth {
            zone_length: 0.2,
            time,
        })
        .load(WEIGHT)
        .scene(down)
        .into_dyn()
        .build()
        .unwrap();
    for hours in [5.0, 20.0] {
        let _ = MethodOfSteps::new(600.0)
            .advance(&mut shoot, hours * HOUR)
            .unwrap();
        let length = 0.05 * (hours * HOUR / time).exp();
        let stretched = length + 1000.0 * 9.81 * length * length / (2.0 * soft().youngs_modulus);
        assert!(stretched > 1.02 * length);
        // The bound covers the rounding of 120 growth factors.
        let rounding = 500.0 * f64::EPSILON;
        assert_relative_eq!(
            shoot.rod().length(),
            length,
            epsilon = 0.0,
            max_relative = rounding
        );
        assert_relative_eq!(
            shoot.tip().norm(),
            stretched,
            epsilon = 0.0,
            max_relative = rounding
        );
        assert_relative_eq!(
            shoot.rod().centre_line_length(),
            stretched,
            epsilon = 0.0,
            max_relative = rounding
        );
    }
}

#[test]
fn resumed_run_of_a_stretching_shoot_repeats_the_uninterrupted_run() {
    let mut shoot = lignifying().build().unwrap();
    let mut run = MethodOfSteps::new(120.0);
    let _ = run.advance(&mut shoot, 4.0 * HOUR).unwrap();
    let (s, line) = (shoot.rod().length(), shoot.rod().centre_line_length());
    // The length of the centre line differs from the unstretched length by more than 0.1 %.
    assert!((line / s - 1.0).abs() > 1e-3, "{line} m of {s} m");
    let state: State =
        postcard::from_bytes(&postcard::to_allocvec(shoot.state()).unwrap()).unwrap();
    assert_eq!(&state, shoot.state());
    let mut resumed = lignifying().build().unwrap();
    resumed.restore(&state).unwrap();
    assert_eq!(resumed.tip(), shoot.tip());
    let merged = run.advance(&mut shoot, 8.0 * HOUR).unwrap();
    let _ = MethodOfSteps::new(120.0)
        .advance(&mut resumed, 8.0 * HOUR)
        .unwrap();
    assert!(resumed.state() == shoot.state());
    assert!(merged.merges > 0 && merged.splits > 0, "{merged:?}");
    // A load that jumps inside an element requires a node there. Cutting the element leaves the
    // centre line unchanged.
    let clip = PointForce {
        initial_apex_distance: 0.0301,
        force: Vector3::x() * 1e-7,
    };
    let other = shoot
        .with_model(shoot.model().clone().with_load(clip).into_dyn())
        .unwrap();
    assert_eq!(other.rod().elements(), shoot.rod().elements() + 1);
    // The two parts interpolate polynomials of degree p in the rotations and p − 1 in the strain of
    // the centre line, with p points each.
    assert_abs_diff_eq!(InNorm(other.tip()), InNorm(shoot.tip()), epsilon = 1e-9 * s);
    assert_abs_diff_eq!(
        other.rod().centre_line_length(),
        shoot.rod().centre_line_length(),
        epsilon = 1e-9 * s
    );
}

#[test]
fn boxed_and_graded_stretching_laws_give_the_same_shoot() {
    let build = |law: Box<dyn Constitutive + Send + Sync>| {
        let builder = rod(law, 0.05).load(WEIGHT).scene(Still::tilted(FRAC_PI_2));
        let growth = Ongoing(UniformGrowth {
            zone_length: 0.07,
            time: 20.0 * HOUR,
        });
        let mut shoot = builder
            .growth(growth)
            .tropism(steering(STATOLITHS))
            .into_dyn()
            .build()
            .unwrap();
        let _ = MethodOfSteps::new(120.0).advance(&mut shoot, HOUR).unwrap();
        shoot.tip()
    };
    let direct = build(Box::new(soft()));
    // Shear and stretch move the tip by more than 0.1 % of the length.
    assert!((direct - build(Box::new(YOUNG))).norm() > 1e-3 * 0.05);
    // A factor of two on a law with half the moduli gives the same bits, because multiplication by
    // a power of two is exact.
    let half = Timoshenko {
        law: tissue(0.5 * YOUNG.youngs_modulus),
        youngs_modulus: 0.5 * soft().youngs_modulus,
        shear_modulus: 0.5 * soft().shear_modulus,
        ..soft()
    };
    assert_eq!(
        build(Box::new(Graded {
            law: half,
            factor: |_: &Tissue| 2.0
        })),
        direct
    );
}

/// Upright shoot with tropisms, of the given tissue, with a downward force (N) at half its height.
fn upright(law: impl Constitutive + Send + Sync + 'static, force: f64) -> Shoot<DynLaws> {
    rod(law, 0.05)
        .elements(4)
        .growth(Ongoing(UniformGrowth {
            zone_length: 0.07,
            time: 20.0 * HOUR,
        }))
        .tropism(steering(STATOLITHS))
        .load(PointForce {
            initial_apex_distance: 0.025,
            force: Vector3::z() * -force,
        })
        .into_dyn()
        .build()
        .unwrap()
}

#[test]
fn roots_of_a_stretching_shoot_are_those_of_a_rigid_line_under_haringx_force() {
    // To first order a force P rotates the frames as P (1 + P/(κ G A) − P/(E A)) would without
    // shear and stretch, and the laws depend on frames and strains alone. The roots are the same up
    // to the error of differences, 1e-9.
    let area = PI * RADIUS * RADIUS;
    let (shear, stretch) = (
        soft().shear_factor * soft().shear_modulus * area,
        soft().youngs_modulus * area,
    );
    let force = 1.2e-3;
    let effective = force * (1.0 + force / shear - force / stretch);
    assert_relative_ne!(effective, force, epsilon = 0.0, max_relative = 0.01);
    fn roots(mut shoot: Shoot<DynLaws>) -> Vec<Root> {
        solve_steady_state(&mut shoot).unwrap();
        Linearisation::about(&shoot).unwrap().roots(-2e-4).unwrap()
    }
    let (soft_roots, rigid, wrong) = (
        roots(upright(soft(), force)),
        roots(upright(YOUNG, effective)),
        roots(upright(YOUNG, force)),
    );
    assert!(
        !soft_roots.is_empty() && soft_roots.len() == rigid.len(),
        "{} {}",
        soft_roots.len(),
        rigid.len()
    );
    // Norms of differences are compared, because approx supports complex numbers only with a
    // disabled feature of num-complex.
    for (a, b) in soft_roots.iter().zip(&rigid) {
        assert!(
            (a.value - b.value).norm() < 1e-7 * b.value.norm(),
            "{} {}",
            a.value,
            b.value
        );
    }
    assert!((soft_roots[0].value - wrong[0].value).norm() > 1e-4 * wrong[0].value.norm());
    // Below the force the line leans by 1 + P/(κ G A) − P/(E A) times the angle of the frames,
    // above it by that angle.
    let middle = |root: &Root| {
        root.displacement[4].dotc(&root.displacement[2]) / root.displacement[4].norm_squared()
    };
    let (found, frames) = (middle(&soft_roots[0]), middle(&rigid[0]));
    let lean = frames * (effective / force);
    let expected = lean / (lean + 1.0 - frames);
    assert!(
        (found - expected).norm() < 1e-7 && (found - frames).norm() > 0.05,
        "{found} {expected} {frames}"
    );
}

#[test]
fn first_equilibrium_of_a_stretching_shoot_keeps_the_tolerance() {
    for tolerance in [1e-4, 1e-7, 1e-9] {
        let settle = |tolerance: f64| {
            let laws = righting()
                .into_dyn()
                .build()
                .unwrap()
                .model()
                .clone()
                .with_constitutive(soft());
            let mut shoot = Shoot::of(laws.into_dyn())
                .length(0.05)
                .radius(RADIUS)
                .build()
                .unwrap();
            let found = Adaptive::new(tolerance)
                .start(&mut shoot, &ConstantHistory::Empty)
                .unwrap();
            (shoot, found)
        };
        let ((shoot, found), (finest, _)) = (settle(tolerance), settle(1e-12));
        let error = found.error.expect("an estimate");
        let places = |shoot: &Shoot<_>| shoot.rod().centre_line_at(33);
        let off = places(&shoot)
            .iter()
            .zip(places(&finest))
            .map(|(a, b)| (a - b).norm() / 0.05)
            .fold(0.0, f64::max);
        assert!(
            error <= tolerance && off <= tolerance,
            "{tolerance:e}: {off:e}, by its estimate {error:e}"
        );
    }
}

#[test]
fn crushed_tissue_is_an_error_that_leaves_the_shoot_unchanged() {
    // The weight compresses the base by a strain of ρ g ℓ/E = 0.4 %. The force compresses it to
    // zero length.
    let law = Timoshenko {
        youngs_modulus: 5e3,
        ..Timoshenko::circular(YOUNG)
    };
    let crush = |force: f64| {
        let mut shoot = rod(law, 2e-3)
            .growth(Ongoing(UniformGrowth {
                zone_length: 0.07,
                time: 20.0 * HOUR,
            }))
            .tropism(steering(STATOLITHS))
            .load((
                WEIGHT,
                ApicalForce(move |t: f64| Vector3::z() * (-force * t / HOUR)),
            ))
            .into_dyn()
            .build()
            .unwrap();
        let mut run = MethodOfSteps::new(600.0);
        let _ = run.advance(&mut shoot, 600.0).unwrap();
        let before = shoot.state().clone();
        (run.advance(&mut shoot, HOUR), before == *shoot.state())
    };
    let most =
        law.youngs_modulus * PI * RADIUS * RADIUS - 1000.0 * 9.81 * 2e-3 * PI * RADIUS * RADIUS;
    assert!(crush(0.999 * most).0.is_ok());
    let (answer, unharmed) = crush(1.001 * most);
    let crushed = matches!(
        answer,
        Err(IntegrationError::Equilibrium {
            error: EquilibriumError::Crushed { .. },
            ..
        })
    );
    assert!(crushed && unharmed, "{answer:?}");
}
