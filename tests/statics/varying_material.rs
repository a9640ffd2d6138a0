//! Sections, stiffness and density that vary along the shoot and stay with the tissue.

use std::f64::consts::PI;

use crate::fixtures::shoots::{RADIUS, YOUNG};
use morphorod::constitutive::{Constitutive, Graded, LinearElastic, Tissue};
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::growth::{NoGrowth, Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Distributed, GradedWeight, InternalForce, Load, Weight};
use morphorod::rod::Rod;
use morphorod::tropism::{Gravitropism, Memory, Oscillator, Response, SettledStatoliths, TropismLaw};
use morphorod::{Order, ParameterError, Scene, Section, Shoot, Still};
use nalgebra::{UnitQuaternion, Vector3};

const LENGTH: f64 = 0.1;
const GRAVITY: f64 = 9.81;

/// The shape at rest of a straight upright rod.
fn at_rest<S: Into<Section>>(
    section: impl Fn(f64) -> S,
    law: &impl Constitutive,
    load: &impl Load,
    order: Order,
) -> Rod {
    let nodes = Rod::equal_nodes(LENGTH, 16);
    let mut rod = Rod::straight(&nodes, section, UnitQuaternion::identity(), order).unwrap();
    let _ = NewtonSolver::with_tolerance(1e-14).solve(&mut rod, law, load, &Still::upright().environment(0.0)).unwrap();
    rod
}

fn pull(x: f64, y: f64, z: f64) -> ApicalForce<impl Fn(f64) -> Vector3<f64>> {
    ApicalForce(move |_| Vector3::new(x, y, z))
}

#[test]
fn an_ellipse_bends_in_either_plane_as_a_circle_of_its_stiffness() {
    // Nearly round and lightly loaded: a thin blade that is bent in its stiff plane gives way sideways.
    let (a, b) = (1.2e-3, 1e-3);
    let blade = |_: f64| Section::ellipse(a, b);
    // Along e1 it bends about d2, with I2 = π a³ b/4; along e2 about d1, with I1 = π a b³/4.
    for (force, moment) in [(pull(1e-3, 0.0, 0.0), a.powi(3) * b), (pull(0.0, 1e-3, 0.0), a * b.powi(3))] {
        let circle = LinearElastic { youngs_modulus: 1e7 * moment / RADIUS.powi(4), ..YOUNG };
        let elliptic = at_rest(blade, &YOUNG, &force, Order::Eight);
        let circular = at_rest(|_| RADIUS, &circle, &force, Order::Eight);
        assert!(circular.tip().xy().norm() > 0.005);
        // Both are solved to 1e-14 rad, and the plane problem is the same.
        let apart = (elliptic.tip() - circular.tip()).norm();
        assert!(apart < 1e-13 * LENGTH, "{apart} m");
    }
}

#[test]
fn a_twisted_ellipse_has_saint_venants_torsion_constant() {
    // From S. Timoshenko and J. N. Goodier, Theory of Elasticity, §106: J = π a³ b³/(a² + b²).
    let (a, b): (f64, f64) = (1.5e-3, 0.7e-3);
    let expected = PI * a.powi(3) * b.powi(3) / (a * a + b * b);
    let section = Section::ellipse(a, b);
    assert!((section.torsion_constant() / expected - 1.0).abs() < 1e-14);
    let law = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.3 };
    assert!((law.stiffness(section).z / (1e7 / 2.6 * expected) - 1.0).abs() < 1e-14);
    assert!((law.stiffness(RADIUS).z / law.stiffness(RADIUS).x - 1.0 / 1.3).abs() < 1e-14, "a circle: J = 2 I");
}

#[test]
fn a_graded_cantilever_bends_as_beam_theory_says() {
    // E I = E I₀ (1 + c σ) with σ = ℓ − s and a small force F across the tip: θ' = F σ/(E I₀ (1 + c σ)), so that the deflection
    // is ∫ σ θ' dσ = (F/E I₀) ∫ σ²/(1 + c σ) dσ = (F/(E I₀ c³)) (x²/2 − x + ln(1 + x)), x = c ℓ.
    let (force, c) = (1e-9, 25.0);
    let graded = Graded { law: YOUNG, factor: |tissue: &Tissue| 1.0 + c * tissue.initial_apex_distance };
    let x: f64 = c * LENGTH;
    let deflection = force / (YOUNG.stiffness(RADIUS).x * c.powi(3)) * (x * x / 2.0 - x + x.ln_1p());
    let mut errors = Vec::new();
    for order in Order::ALL {
        let tip = at_rest(|_| RADIUS, &graded, &pull(force, 0.0, 0.0), order).tip();
        errors.push((tip.x / deflection - 1.0).abs());
    }
    // A deflection of 5e-6 of the length bends the theory by the square of that; sixteen elements of order eight resolve the rest.
    assert!(deflection < 1e-5 * LENGTH && errors[3] < 1e-10, "{errors:?}");
    assert!(errors[0] > 1e-5 && errors.is_sorted_by(|a, b| a > b), "{errors:?}");
}

#[test]
fn a_blade_that_tapers_bends_as_beam_theory_says() {
    // a₁ = a (1 + c σ) and a₂ constant: I2 grows as (1 + c σ)³, and ∫ σ²/(1 + c σ)³ dσ = (ln(1 + x) + 2/(1 + x) − 1/(2 (1 + x)²) − 3/2)/c³.
    let (force, c) = (1e-9, 25.0);
    let blade = |s: f64| Section::ellipse(RADIUS * (1.0 + c * (LENGTH - s)), RADIUS);
    let y: f64 = 1.0 + c * LENGTH;
    let integral = (y.ln() + 2.0 / y - 0.5 / (y * y) - 1.5) / c.powi(3);
    let tip = at_rest(blade, &YOUNG, &pull(force, 0.0, 0.0), Order::Eight).tip();
    let deflection = force / YOUNG.stiffness(RADIUS).x * integral;
    assert!((tip.x / deflection - 1.0).abs() < 1e-10, "{} for {deflection}", tip.x);
}

/// The force in a shoot at its base, N.
fn weight_at_base(rod: &Rod, load: &impl Load) -> f64 {
    -InternalForce::of(rod, load, &Still::upright().environment(0.0)).at_base().z
}

#[test]
fn density_stays_with_the_tissue_as_it_grows() {
    // ρ = ρ₀ (1 + c S) with S = ℓ₀ − σ₀, and every point of the zone moves as σ = σ₀ exp(t/τ): after an hour the weight of the zone is
    // g A ρ₀ ∫ (1 + c (ℓ₀ − σ exp(−t/τ))) dσ over (0, ℓg), and that of tissue that has left it follows from when it left.
    let (length, zone, time, c, hours) = (0.05, 0.06, 20.0 * 3600.0, 8.0, 30.0);
    let growth = UniformGrowth { zone_length: zone, time };
    let density = move |tissue: &Tissue| 1000.0 * (1.0 + c * (length - tissue.initial_apex_distance));
    let mut shoot = Shoot::builder(YOUNG)
        .length(length)
        .radius(2.0 * RADIUS)
        .growth(growth)
        .load(GradedWeight(density))
        .into_dyn()
        .build()
        .unwrap();
    let t = hours * 3600.0;
    let statistics = MethodOfSteps::new(900.0).advance(&mut shoot, t).unwrap();
    assert!(statistics.splits > 0 && statistics.merges > 0);
    // What has left: between full (ℓ = ℓg) and now the zone sheds its end, at ℓg/τ, where σ₀ = ℓg exp(−t*/τ).
    let full = time * f64::ln(zone / length);
    let in_zone = zone * (1.0 + c * length) - c * f64::exp(-t / time) * zone * zone / 2.0;
    let left = zone / time
        * ((1.0 + c * length) * (t - full) + c * zone * time * (f64::exp(-t / time) - f64::exp(-full / time)));
    let area = PI * (2.0 * RADIUS).powi(2);
    let expected = GRAVITY * area * 1000.0 * (in_zone + left);
    let found = weight_at_base(shoot.rod(), &GradedWeight(density));
    // Elements of order eight hold σ₀, an exponential of s in mature tissue, to 1e-8; merging keeps its mean.
    assert!((found / expected - 1.0).abs() < 1e-8, "{found} N for {expected} N");
    // A uniform density is a uniform density.
    let (graded, uniform) = (GradedWeight(|_: &Tissue| 1000.0), Weight { density: 1000.0 });
    let ratio = weight_at_base(shoot.rod(), &graded) / weight_at_base(shoot.rod(), &uniform);
    assert!((ratio - 1.0).abs() < 1e-13, "{ratio}");
}

#[test]
fn stiffness_and_section_stay_with_the_tissue_as_it_grows() {
    let growth = UniformGrowth { zone_length: 0.06, time: 20.0 * 3600.0 };
    let taper = |s: f64| Section::ellipse(1e-3 * (1.0 - 8.0 * s), 0.8e-3 * (1.0 - 6.0 * s));
    let mut shoot = Shoot::builder(YOUNG).length(0.05).section(taper).growth(growth).into_dyn().build().unwrap();
    let _ = MethodOfSteps::new(900.0).advance(&mut shoot, 30.0 * 3600.0).unwrap();
    for point in shoot.rod().points() {
        let expected = taper(0.05 - point.initial_apex_distance);
        // Both are linear in the name of the place, so splitting and merging treat them alike: rounding.
        assert!((point.section.along_d1 - expected.along_d1).abs() < 1e-16);
        assert!((point.section.along_d2 - expected.along_d2).abs() < 1e-16);
    }
}

/// How fast a shoot without load that leans along e1 + e2 begins to bend, 1/(m s).
fn bending_rate(law: impl TropismLaw, section: Section) -> Vector3<f64> {
    let base = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.5);
    let mut shoot = Shoot::builder(YOUNG)
        .length(0.05)
        .section(move |_| section)
        .growth(Ongoing(UniformGrowth { zone_length: 0.06, time: 72e3 }))
        .tropism(law)
        .scene(Still { base: base * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7), ..Still::upright() })
        .build()
        .unwrap();
    let _ = MethodOfSteps::new(60.0).advance(&mut shoot, 120.0).unwrap();
    shoot.rod().points()[0].intrinsic / 120.0
}

#[test]
fn growth_differs_across_the_semi_axis_that_bends() {
    // Equation (7): r u̇1* = −β REGR M[h2] differs across d2, r u̇2* = β REGR M[h1] across d1. The memory fills from zero at the
    // same pace in both, so the two rates compare as h2/a2 and h1/a1; (5) in the same way.
    let (a, b) = (1e-3, 0.25e-3);
    let gravity = || {
        Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(Memory { time: 60.0, delay: 60.0 })
    };
    let oscillator = || Oscillator { phase: 0.6, ..Oscillator::new(0.2, 1440.0) };
    for (round, flat) in [
        (bending_rate(gravity(), Section::circle(RADIUS)), bending_rate(gravity(), Section::ellipse(a, b))),
        (bending_rate(oscillator(), Section::circle(RADIUS)), bending_rate(oscillator(), Section::ellipse(a, b))),
    ] {
        assert!(round.x != 0.0 && round.y != 0.0);
        // The shoots bend by 1e-4 rad meanwhile, which changes what gravity asks for by as much.
        assert!((flat.x / round.x / (RADIUS / b) - 1.0).abs() < 1e-3, "{flat} for {round}");
        assert!((flat.y / round.y / (RADIUS / a) - 1.0).abs() < 1e-3, "{flat} for {round}");
    }
}

#[test]
fn a_bad_place_is_named() {
    let build = |factor: f64| {
        let law = Graded {
            law: YOUNG,
            factor: move |tissue: &Tissue| if tissue.initial_apex_distance < 0.02 { factor } else { 1.0 },
        };
        Shoot::builder(law).length(LENGTH).radius(RADIUS).growth(NoGrowth).into_dyn().build().map(|_| ())
    };
    let named = |error: ParameterError, name: &str| {
        let place = error.place.expect("a place");
        assert!(error.name.contains(name) && place > 0.079 && place < 0.09, "{error}");
        assert!(error.to_string().contains(&format!("at {place:.4} m")), "{error}");
    };
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        named(build(bad).unwrap_err(), "stiffness");
        let heavy = GradedWeight(move |tissue: &Tissue| if tissue.initial_apex_distance < 0.02 { bad } else { 1.0 });
        let built = Shoot::builder(YOUNG).length(LENGTH).radius(RADIUS).load(heavy).into_dyn().build();
        // A density may be zero, or negative: buoyancy.
        if bad.is_finite() {
            assert!(built.is_ok())
        } else {
            named(built.unwrap_err(), "force per length")
        }
        let section = move |s: f64| Section::ellipse(RADIUS, if s > 0.08 { bad } else { RADIUS });
        named(Shoot::builder(YOUNG).length(LENGTH).section(section).into_dyn().build().unwrap_err(), "semi-axis");
    }
    assert_eq!(build(1.0), Ok(()));
}

#[test]
fn a_section_that_jumps_at_a_node_survives_growth() {
    let grown = |merge_tolerance: f64, thin: f64| {
        let nodes: Vec<f64> = (0..=10).map(|i| 0.005 * f64::from(i)).collect();
        let mut shoot = Shoot::builder(YOUNG)
            .length(0.05)
            .taper(move |s| if s < 0.04 { 1e-3 } else { thin })
            .nodes(&nodes)
            .merge_tolerance(merge_tolerance)
            .growth(UniformGrowth { zone_length: 0.03, time: 20.0 * 3600.0 })
            .load(Distributed(Vector3::x() * 1e-6))
            .scene(Still::weightless())
            .into_dyn()
            .build()
            .unwrap();
        let _ = MethodOfSteps::new(600.0).advance(&mut shoot, 40.0 * 3600.0).unwrap();
        shoot
    };
    for thin in [5e-4, 2e-4] {
        let (merged, all) = (grown(1e-4, thin), grown(0.0, thin));
        assert!(merged.rod().elements() < all.rod().elements() / 2);
        assert!((merged.tip() - all.tip()).norm() < 1e-6 * 0.1, "{} {}", merged.tip(), all.tip());
        assert!((merged.rod().volume() / all.rod().volume() - 1.0).abs() < 1e-9);
        let least = merged.rod().points().iter().map(|point| point.section.radius()).fold(1.0, f64::min);
        assert!((least / thin - 1.0).abs() < 1e-12, "{least}");
        let kept = merged.state().clone();
        merged.clone().restore(&kept).unwrap();
    }
}

#[test]
fn a_section_that_jumps_within_an_element_is_refused() {
    let jump = |s: f64| if s < 0.042 { 1e-3 } else { 1e-4 };
    let error = Shoot::builder(YOUNG).length(0.05).taper(jump).into_dyn().build().unwrap_err();
    assert!(error.to_string().contains("put nodes where it jumps") && error.place.is_some(), "{error}");
    let nodes = [0.0, 0.01, 0.02, 0.03, 0.042, 0.05];
    assert!(Shoot::builder(YOUNG).length(0.05).taper(jump).nodes(&nodes).into_dyn().build().is_ok());
}

#[test]
fn a_weight_by_its_density_acts_in_company_too() {
    let tip = |load: &dyn Fn(&mut morphorod::rod::Rod)| {
        let base = morphorod::Still::tilted(1.0).base;
        let mut rod = morphorod::rod::Rod::uniform(0.06, 5e-4, base, 8, morphorod::Order::Eight).unwrap();
        load(&mut rod);
        rod.tip()
    };
    let solve = |rod: &mut morphorod::rod::Rod, load: &dyn morphorod::load::Load| {
        use morphorod::Scene;
        use morphorod::equilibrium::EquilibriumSolver;
        let tissue = morphorod::constitutive::LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
        let environment = morphorod::Still::tilted(1.0).environment(0.0);
        let mut solver = morphorod::equilibrium::NewtonSolver::with_tolerance(1e-13);
        let _ = solver.solve(rod, &tissue, &load, &environment).unwrap();
    };
    let graded = || morphorod::load::GradedWeight(|_: &morphorod::constitutive::Tissue| 1000.0);
    let whole = tip(&|rod| solve(rod, &morphorod::load::Weight { density: 1000.0 }));
    let alone = tip(&|rod| solve(rod, &graded()));
    let beside = tip(&|rod| solve(rod, &(graded(), None::<morphorod::load::Weight>)));
    let perhaps = tip(&|rod| solve(rod, &Some(graded())));
    for found in [alone, beside, perhaps] {
        // Sums of the same numbers, and the tolerance of two equilibria.
        assert!((found - whole).norm() < 1e-12 * 0.06 + 1e-13, "{found:?} {whole:?}");
    }
}
