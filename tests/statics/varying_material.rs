//! Sections, stiffnesses and densities that vary along the shoot and move with the tissue.

use std::f64::consts::PI;

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::rods::solve_tight;
use crate::fixtures::shoots::{RADIUS, WEIGHT, YOUNG, rod, tissue};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::constitutive::{Constitutive, Graded, LinearElastic, Tissue};
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Distributed, GradedWeight, InternalForce, Load, Weight};
use morphorod::rod::Rod;
use morphorod::tropism::{
    Gravitropism, Memory, Oscillator, Response, SettledStatoliths, TropismLaw,
};
use morphorod::{Order, ParameterError, Scene, Section, Shoot, Still};
use nalgebra::{UnitQuaternion, Vector3};

const LENGTH: f64 = 0.1;
const GRAVITY: f64 = 9.81;

/// The equilibrium of an upright rod that is straight without load.
fn at_rest<S: Into<Section>>(
    section: impl Fn(f64) -> S,
    law: &dyn Constitutive,
    load: &dyn Load,
    order: Order,
) -> Rod {
    let nodes = Rod::equal_nodes(LENGTH, 16);
    let mut rod = Rod::straight(&nodes, section, UnitQuaternion::identity(), order).unwrap();
    let _ = solve_tight(&mut rod, law, load, &Still::upright().environment(0.0)).unwrap();
    rod
}

fn pull(x: f64, y: f64, z: f64) -> ApicalForce<impl Fn(f64) -> Vector3<f64>> {
    ApicalForce(move |_| Vector3::new(x, y, z))
}

#[test]
fn elliptic_section_bends_like_a_circular_one_of_equal_stiffness() {
    // The section is nearly round and lightly loaded, because a thin blade that is bent in its
    // stiff plane buckles sideways.
    let (a, b) = (1.2e-3, 1e-3);
    let blade = |_: f64| Section::ellipse(a, b);
    // A force along e1 bends the blade about d2, with I2 = π a³ b/4. A force along e2 bends it
    // about d1, with I1 = π a b³/4.
    for (force, moment) in [
        (pull(1e-3, 0.0, 0.0), a.powi(3) * b),
        (pull(0.0, 1e-3, 0.0), a * b.powi(3)),
    ] {
        let circle = tissue(1e7 * moment / RADIUS.powi(4));
        let elliptic = at_rest(blade, &YOUNG, &force, Order::Eight);
        let circular = at_rest(|_| RADIUS, &circle, &force, Order::Eight);
        assert!(circular.tip().xy().norm() > 0.005);
        // The two plane problems are identical, and both equilibria are solved to 1e-14 rad.
        assert_abs_diff_eq!(
            InNorm(elliptic.tip()),
            InNorm(circular.tip()),
            epsilon = 1e-13 * LENGTH
        );
    }
}

#[test]
fn torsion_constant_of_an_ellipse_is_saint_venants() {
    // Reference: S. Timoshenko and J. N. Goodier, Theory of Elasticity, §106:
    // J = π a³ b³/(a² + b²).
    let (a, b): (f64, f64) = (1.5e-3, 0.7e-3);
    let expected = PI * a.powi(3) * b.powi(3) / (a * a + b * b);
    let section = Section::ellipse(a, b);
    assert_relative_eq!(
        section.torsion_constant(),
        expected,
        epsilon = 0.0,
        max_relative = 1e-14
    );
    let law = LinearElastic {
        youngs_modulus: 1e7,
        poissons_ratio: 0.3,
    };
    assert_relative_eq!(
        law.stiffness(section).z,
        1e7 / 2.6 * expected,
        epsilon = 0.0,
        max_relative = 1e-14
    );
    // A circle has J = 2 I.
    assert_abs_diff_eq!(
        law.stiffness(RADIUS).z / law.stiffness(RADIUS).x,
        1.0 / 1.3,
        epsilon = 1e-14
    );
}

#[test]
fn cantilever_of_graded_stiffness_matches_beam_theory() {
    // The stiffness is E I = E I₀ (1 + c σ) with σ = ℓ − s, and a small force F acts across the
    // tip. The curvature is θ' = F σ/(E I₀ (1 + c σ)). With x = c ℓ, the deflection is ∫ σ θ' dσ =
    // (F/(E I₀)) ∫ σ²/(1 + c σ) dσ = (F/(E I₀ c³)) (x²/2 − x + ln(1 + x)).
    let (force, c) = (1e-9, 25.0);
    let graded = Graded {
        law: YOUNG,
        factor: |tissue: &Tissue| 1.0 + c * tissue.initial_apex_distance,
    };
    let x: f64 = c * LENGTH;
    let deflection =
        force / (YOUNG.stiffness(RADIUS).x * c.powi(3)) * (x * x / 2.0 - x + x.ln_1p());
    let mut errors = Vec::new();
    for order in Order::ALL {
        let tip = at_rest(|_| RADIUS, &graded, &pull(force, 0.0, 0.0), order).tip();
        errors.push((tip.x / deflection - 1.0).abs());
    }
    // The relative error of beam theory is the square of the relative deflection of 2.4e-6. The
    // discretisation error of sixteen elements of order eight is smaller than the bound.
    assert!(
        deflection < 1e-5 * LENGTH && errors[3] < 1e-10,
        "{errors:?}"
    );
    assert!(
        errors[0] > 1e-5 && errors.is_sorted_by(|a, b| a > b),
        "{errors:?}"
    );
}

#[test]
fn tapering_blade_matches_beam_theory() {
    // With a₁ = a (1 + c σ) and a₂ constant, I2 grows as (1 + c σ)³. The integral is
    // ∫ σ²/(1 + c σ)³ dσ = (ln(1 + x) + 2/(1 + x) − 1/(2 (1 + x)²) − 3/2)/c³.
    let (force, c) = (1e-9, 25.0);
    let blade = |s: f64| Section::ellipse(RADIUS * (1.0 + c * (LENGTH - s)), RADIUS);
    let y: f64 = 1.0 + c * LENGTH;
    let integral = (y.ln() + 2.0 / y - 0.5 / (y * y) - 1.5) / c.powi(3);
    let tip = at_rest(blade, &YOUNG, &pull(force, 0.0, 0.0), Order::Eight).tip();
    let deflection = force / YOUNG.stiffness(RADIUS).x * integral;
    assert_relative_eq!(tip.x, deflection, epsilon = 0.0, max_relative = 1e-10);
}

/// Weight of a rod: the downward component of the internal force at its base, N.
fn weight_at_base(rod: &Rod, load: &impl Load) -> f64 {
    -InternalForce::of(rod, load, &Still::upright().environment(0.0))
        .at_base()
        .z
}

#[test]
fn density_moves_with_the_growing_tissue() {
    // With ρ = ρ₀ (1 + c S) and S = ℓ₀ − σ₀, every point of the zone moves as σ = σ₀ exp(t/τ). The
    // weight of the zone is g A ρ₀ ∫ (1 + c (ℓ₀ − σ exp(−t/τ))) dσ over (0, ℓg). The weight of
    // mature tissue follows from its exit time.
    let (length, zone, time, c, hours) = (0.05, 0.06, 20.0 * 3600.0, 8.0, 30.0);
    let growth = UniformGrowth {
        zone_length: zone,
        time,
    };
    let density =
        move |tissue: &Tissue| 1000.0 * (1.0 + c * (length - tissue.initial_apex_distance));
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
    // From the time `full`, when ℓ = ℓg, tissue leaves the zone at the speed ℓg/τ. At t* it has σ₀
    // = ℓg exp(−t*/τ).
    let full = time * f64::ln(zone / length);
    let in_zone = zone * (1.0 + c * length) - c * f64::exp(-t / time) * zone * zone / 2.0;
    let left = zone / time
        * ((1.0 + c * length) * (t - full)
            + c * zone * time * (f64::exp(-t / time) - f64::exp(-full / time)));
    let area = PI * (2.0 * RADIUS).powi(2);
    let expected = GRAVITY * area * 1000.0 * (in_zone + left);
    let found = weight_at_base(shoot.rod(), &GradedWeight(density));
    // Elements of order eight represent σ₀, an exponential of s in mature tissue, to 1e-8. Merging
    // preserves its mean.
    assert_relative_eq!(found, expected, epsilon = 0.0, max_relative = 1e-8);
    // A constant graded density equals the same uniform density.
    let (graded, uniform) = (GradedWeight(|_: &Tissue| 1000.0), WEIGHT);
    let (graded, uniform) = (
        weight_at_base(shoot.rod(), &graded),
        weight_at_base(shoot.rod(), &uniform),
    );
    assert_relative_eq!(graded, uniform, epsilon = 0.0, max_relative = 1e-13);
}

#[test]
fn tapered_section_moves_with_the_growing_tissue() {
    let growth = UniformGrowth {
        zone_length: 0.06,
        time: 20.0 * 3600.0,
    };
    let taper = |s: f64| Section::ellipse(1e-3 * (1.0 - 8.0 * s), 0.8e-3 * (1.0 - 6.0 * s));
    let mut shoot = Shoot::builder(YOUNG)
        .length(0.05)
        .section(taper)
        .growth(growth)
        .into_dyn()
        .build()
        .unwrap();
    let _ = MethodOfSteps::new(900.0)
        .advance(&mut shoot, 30.0 * 3600.0)
        .unwrap();
    for point in shoot.rod().points() {
        let expected = taper(0.05 - point.initial_apex_distance);
        // The two semi-axes are linear in the initial apex distance. Splitting and merging change
        // them only by rounding.
        assert_abs_diff_eq!(point.section.along_d1, expected.along_d1, epsilon = 1e-16);
        assert_abs_diff_eq!(point.section.along_d2, expected.along_d2, epsilon = 1e-16);
    }
}

/// Mean rate of change of the intrinsic strain during the first 120 s, 1/(m s), of an unloaded
/// shoot. The shoot leans along e1, and its directors are rotated by 0.7 rad about its axis.
fn bending_rate(law: impl TropismLaw + Send + Sync + 'static, section: Section) -> Vector3<f64> {
    let base = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.5);
    let mut shoot = Shoot::builder(YOUNG)
        .length(0.05)
        .section(move |_| section)
        .growth(Ongoing(UniformGrowth {
            zone_length: 0.06,
            time: 72e3,
        }))
        .tropism(law)
        .scene(Still {
            base: base * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7),
            ..Still::upright()
        })
        .into_dyn()
        .build()
        .unwrap();
    let _ = MethodOfSteps::new(60.0).advance(&mut shoot, 120.0).unwrap();
    shoot.rod().points()[0].intrinsic / 120.0
}

#[test]
fn differential_growth_scales_with_the_semi_axis_across_which_it_acts() {
    // In equation (7), r u̇1* = −β REGR M[h2] is the differential growth across d2, and r u̇2* = β
    // REGR M[h1] that across d1. Both memories start at zero and have the same time constant. The
    // two rates are therefore in proportion to h2/a2 and h1/a1. The same holds for (5).
    let (a, b) = (1e-3, 0.25e-3);
    let gravity = || {
        Gravitropism {
            sensitivity: 0.8,
            perception: SettledStatoliths,
        }
        .remembered(Memory {
            time: 60.0,
            delay: 60.0,
        })
    };
    let oscillator = || Oscillator {
        phase: 0.6,
        ..Oscillator::new(0.2, 1440.0)
    };
    for (round, flat) in [
        (
            bending_rate(gravity(), Section::circle(RADIUS)),
            bending_rate(gravity(), Section::ellipse(a, b)),
        ),
        (
            bending_rate(oscillator(), Section::circle(RADIUS)),
            bending_rate(oscillator(), Section::ellipse(a, b)),
        ),
    ] {
        assert!(round.x != 0.0 && round.y != 0.0);
        // The shoots bend by 1e-4 rad in this time. The relative change of the response to gravity
        // is of the same size.
        assert_relative_eq!(
            flat.x / round.x,
            RADIUS / b,
            epsilon = 0.0,
            max_relative = 1e-3
        );
        assert_relative_eq!(
            flat.y / round.y,
            RADIUS / a,
            epsilon = 0.0,
            max_relative = 1e-3
        );
    }
}

#[test]
fn errors_of_varying_material_name_the_quantity_and_the_place() {
    let build = |factor: f64| {
        let law = Graded {
            law: YOUNG,
            factor: move |tissue: &Tissue| {
                if tissue.initial_apex_distance < 0.02 {
                    factor
                } else {
                    1.0
                }
            },
        };
        rod(law, LENGTH).growth(()).into_dyn().build().map(|_| ())
    };
    let named = |error: ParameterError, name: &str| {
        let place = error.place.expect("a place");
        assert!(
            error.name.contains(name) && place > 0.079 && place < 0.09,
            "{error}"
        );
        assert!(
            error
                .to_string()
                .contains(&format!("at {} m", (1e5 * place).round() / 1e5)),
            "{error}"
        );
    };
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        named(build(bad).unwrap_err(), "stiffness");
        let heavy = GradedWeight(move |tissue: &Tissue| {
            if tissue.initial_apex_distance < 0.02 {
                bad
            } else {
                1.0
            }
        });
        let built = rod(YOUNG, LENGTH).load(heavy).into_dyn().build();
        // A density may be zero, or negative for buoyancy.
        if bad.is_finite() {
            assert!(built.is_ok())
        } else {
            named(built.unwrap_err(), "force per length")
        }
        let section = move |s: f64| Section::ellipse(RADIUS, if s > 0.08 { bad } else { RADIUS });
        named(
            Shoot::builder(YOUNG)
                .length(LENGTH)
                .section(section)
                .into_dyn()
                .build()
                .unwrap_err(),
            "semi-axis",
        );
    }
    assert_eq!(build(1.0), Ok(()));
}

#[test]
fn section_that_jumps_at_a_node_is_kept_through_growth_and_merging() {
    let grown = |merge_tolerance: f64, thin: f64| {
        let nodes: Vec<f64> = (0..=10).map(|i| 0.005 * f64::from(i)).collect();
        let mut shoot = Shoot::builder(YOUNG)
            .length(0.05)
            .section(move |s| if s < 0.04 { 1e-3 } else { thin })
            .nodes(&nodes)
            .merge_tolerance(merge_tolerance)
            .growth(UniformGrowth {
                zone_length: 0.03,
                time: 20.0 * 3600.0,
            })
            .load(Distributed(Vector3::x() * 1e-6))
            .scene(Still::weightless())
            .into_dyn()
            .build()
            .unwrap();
        let _ = MethodOfSteps::new(600.0)
            .advance(&mut shoot, 40.0 * 3600.0)
            .unwrap();
        shoot
    };
    for thin in [5e-4, 2e-4] {
        let (merged, all) = (grown(1e-4, thin), grown(0.0, thin));
        assert!(merged.rod().elements() < all.rod().elements() / 2);
        assert_abs_diff_eq!(
            InNorm(merged.tip()),
            InNorm(all.tip()),
            epsilon = 1e-6 * 0.1
        );
        assert_relative_eq!(
            merged.rod().volume(),
            all.rod().volume(),
            epsilon = 0.0,
            max_relative = 1e-9
        );
        let least = merged
            .rod()
            .points()
            .iter()
            .map(|point| point.section.radius())
            .fold(1.0, f64::min);
        assert_relative_eq!(least, thin, epsilon = 0.0, max_relative = 1e-12);
        let kept = merged.state().clone();
        merged.clone().restore(&kept).unwrap();
    }
}

#[test]
fn section_that_jumps_within_an_element_is_refused() {
    let jump = |s: f64| if s < 0.042 { 1e-3 } else { 1e-4 };
    let error = Shoot::builder(YOUNG)
        .length(0.05)
        .section(jump)
        .into_dyn()
        .build()
        .unwrap_err();
    assert!(
        error.to_string().contains("put a node where it jumps") && error.place.is_some(),
        "{error}"
    );
    let nodes = [0.0, 0.01, 0.02, 0.03, 0.042, 0.05];
    assert!(
        Shoot::builder(YOUNG)
            .length(0.05)
            .section(jump)
            .nodes(&nodes)
            .into_dyn()
            .build()
            .is_ok()
    );
}

#[test]
fn graded_weight_acts_alike_alone_in_a_tuple_and_in_an_option() {
    let scene = Still::tilted(1.0);
    let tip = |load: &dyn Load| {
        let mut rod = Rod::uniform(0.06, RADIUS, scene.base, 8, Order::Eight).unwrap();
        let mut solver = NewtonSolver::with_tolerance(1e-13);
        let law: &dyn Constitutive = &YOUNG;
        let _ = solver
            .solve(&mut rod, &law, &load, &scene.environment(0.0))
            .unwrap();
        rod.tip()
    };
    let graded = || GradedWeight(|_: &Tissue| 1000.0);
    let uniform = tip(&WEIGHT);
    let (alone, in_tuple, in_option) = (
        tip(&graded()),
        tip(&(graded(), None::<Weight>)),
        tip(&Some(graded())),
    );
    for found in [alone, in_tuple, in_option] {
        // The sums have the same terms. The bound covers the tolerances of the two equilibria.
        assert_abs_diff_eq!(
            InNorm(found),
            InNorm(uniform),
            epsilon = 1e-12 * 0.06 + 1e-13
        );
    }
}
