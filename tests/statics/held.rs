//! Rods with held ends and springs, compared with reference numbers and closed forms.
//!
//! The reference numbers were computed by shooting (DOP853, tolerance 2e-14) and by Chebyshev
//! collocation, which agree to the twelve digits given. Rods are bent in the plane of e1 and e3.

use std::f64::consts::FRAC_PI_2;

use super::elastica::legendre;
use crate::fixtures::held::{Held, assert_close, bisect};
use crate::fixtures::random::Draw;
use crate::fixtures::rods::{DENSITY, GRAVITY, bending_stiffness, density_for};
use crate::fixtures::shoots::{RADIUS, WEIGHT};
use morphorod::load::Weight;
use morphorod::support::{Hold, Joint};
use nalgebra::{Matrix3, Vector3};

/// Required relative accuracy with at most sixteen elements of order eight. Their largest error
/// here is 5e-10.
const ACCURACY: f64 = 1e-9;
/// Length, m. Results are given relative to it, except those of the default weight.
const LENGTH: f64 = 0.05;

/// Weight per length of the default shoot, N/m.
fn default_weight() -> Vector3<f64> {
    -Vector3::z() * (DENSITY * GRAVITY * std::f64::consts::PI * RADIUS * RADIUS)
}

/// Clamped horizontal rod with q ℓ³/(E I) = `load` and a frictionless prop under its apex.
fn propped(load: f64, elements: usize) -> Held<Weight> {
    let mut held = Held::straight(
        LENGTH,
        FRAC_PI_2,
        elements,
        Weight {
            density: density_for(load, LENGTH),
        },
    );
    held.hold(&Hold::apex().on_plane(Vector3::zeros(), Vector3::z_axis()));
    held
}

/// Reaction of the prop relative to the weight.
fn prop_share(held: &Held<Weight>, load: f64) -> f64 {
    held.reaction().0.z * LENGTH * LENGTH / (load * bending_stiffness())
}

#[test]
fn propped_cantilever_matches_reference_numbers() {
    // Load q ℓ³/(E I); reaction over q ℓ; tip x/ℓ; couple M(0) ℓ/(E I); tip angle.
    for (load, reaction, tip, couple, angle) in [
        (
            1.0,
            0.375_010_073_983_558,
            0.999_925_612_986_759_7,
            -0.124_989_926_676_706_16,
            0.020_830_922_618_785_955,
        ),
        (
            10.0,
            0.375_991_338_135_435_1,
            0.992_731_876_435_747_9,
            -1.240_149_891_330_392,
            0.205_975_597_059_400_8,
        ),
    ] {
        let held = propped(load, 8);
        assert_eq!(held.signs(), (0, 0));
        assert_close("reaction", prop_share(&held, load), reaction, ACCURACY);
        assert_close("tip", held.rod.tip().x / LENGTH, tip, ACCURACY);
        let weight = -Vector3::z() * (load * bending_stiffness() / LENGTH.powi(3));
        let base = -held.couple_beyond(0.0, &weight).y * LENGTH / bending_stiffness();
        assert_close("couple", base, couple, ACCURACY);
        let tangent = held.rod.apex_frame() * Vector3::z();
        assert_close("angle", tangent.z.atan2(tangent.x), angle, ACCURACY);
        // The prop is frictionless, and its height is met to rounding of the sum over elements.
        assert_eq!((held.reaction().0.x, held.reaction().0.y), (0.0, 0.0));
        assert!(
            held.rod.tip().z.abs() < 1e-14 * LENGTH,
            "{:e}",
            held.rod.tip().z
        );
    }
}

#[test]
fn reaction_of_a_prop_at_small_load_is_three_eighths_of_the_weight() {
    // R/(q ℓ) = 3/8 + c λ² + O(λ⁴) with λ = q ℓ³/(E I). Richardson extrapolation removes the next
    // term.
    let excess = |load: f64| (prop_share(&propped(load, 16), load) - 0.375) / (load * load);
    let coefficient = (4.0 * excess(0.5) - excess(1.0)) / 3.0;
    // Half a unit of the last digit given. Rounding of 1e-14 of the reaction contributes 1e-13.
    assert!((coefficient - 1.007_56e-5).abs() < 5e-11, "{coefficient:e}");
    // At λ = 0.01 the quadratic term is 1e-9. Rounding of the reaction is amplified by the small
    // angles.
    assert_close(
        "reaction",
        prop_share(&propped(0.01, 16), 0.01),
        0.375 + 1.007_56e-9,
        1e-12,
    );
}

#[test]
fn spring_at_the_middle_matches_reference_numbers() {
    // Stiffness k ℓ³/(E I); reaction, N; tip z and x, m.
    for (stiffness, reaction, z, x) in [
        (
            1.0,
            1.582_972_780_476_753_7e-5,
            -0.011_346_536_389_044_048,
            0.048_501_748_034_429_11,
        ),
        (
            24.0,
            0.000_203_168_856_516_097_46,
            -0.006_749_442_119_682_154,
            0.049_455_645_788_169_175,
        ),
        (
            1000.0,
            0.000_399_503_043_158_751_9,
            -0.001_655_563_959_268_097_8,
            0.049_948_644_155_526_106,
        ),
    ] {
        let mut held = Held::straight(LENGTH, FRAC_PI_2, 8, WEIGHT);
        let along = Vector3::z() * (stiffness * bending_stiffness() / LENGTH.powi(3));
        let spring =
            Hold::place(0.5 * LENGTH).spring(Vector3::zeros(), along * Vector3::z().transpose());
        held.hold(&spring);
        assert_close("reaction", held.reaction().0.z, reaction, ACCURACY);
        assert_close(
            "force of the spring",
            held.reaction().0.z,
            -along.z * held.place(0.5).z,
            ACCURACY,
        );
        assert_close("tip z", held.rod.tip().z, z, ACCURACY);
        assert_close("tip x", held.rod.tip().x, x, ACCURACY);
        assert_eq!(held.signs(), (0, 0));
        // A spring removes no direction. Each element has four rotations with three components.
        assert_eq!(held.found.inertia.positive, 3 * 4 * 8);
    }
}

#[test]
fn spring_at_small_load_follows_the_linear_beam() {
    // A linear cantilever deflects by 17 q ℓ⁴/(384 E I) at the middle and has the compliance
    // ℓ³/(24 E I) there. With k = 24 E I/ℓ³, half of the deflection remains: R = 24 · 17/768 q ℓ.
    let load = 1e-4;
    let mut held = Held::straight(
        LENGTH,
        FRAC_PI_2,
        8,
        Weight {
            density: density_for(load, LENGTH),
        },
    );
    let stiffness = Matrix3::from_diagonal(&Vector3::new(
        0.0,
        0.0,
        24.0 * bending_stiffness() / LENGTH.powi(3),
    ));
    held.hold(&Hold::place(0.5 * LENGTH).spring(Vector3::zeros(), stiffness));
    // The relative deviation is of order λ² = 1e-8.
    assert_close("reaction", prop_share(&held, load), 0.53125, 1e-8);
}

/// Modulus k of the elastica with relative shortening D = 2 (1 − E(k)/K(k)), and K(k).
pub(super) fn modulus(shortening: f64) -> (f64, f64) {
    let complete = |k: f64| legendre(FRAC_PI_2, k);
    let k = bisect((1e-3, 0.999), 1e-15, |k| {
        2.0 * (1.0 - complete(k).1 / complete(k).0) > shortening
    });
    (k, complete(k).0)
}

/// Apex on the axis of the clamped rod at a relative shortening, with a frame as at the base or
/// free.
fn apex(held: &Held<impl morphorod::load::Load>, shortening: f64, clamped: bool) -> Hold {
    let hold = Hold::apex().at(Vector3::x() * (held.rod.length() * (1.0 - shortening)));
    if clamped {
        hold.held(held.scene.base)
    } else {
        hold
    }
}

#[test]
fn closed_forms_of_the_elastica_give_the_reference_numbers() {
    // Shortening, load of the clamped rod, P ℓ²/(E I), and midpoint offset over ℓ. All digits agree
    // but the rounding of the modulus, which the load amplifies.
    for (shortening, load, offset) in [
        (0.1, 4.0 * 10.392_563_948_288_947, 0.194_924_311_375_573_9),
        (0.3, 46.612_120_879_831_394, 0.314_312_612_956_107_1),
        (0.5, 4.0 * 13.318_528_149_060_826, 0.373_306_427_445_209_14),
    ] {
        let (k, complete) = modulus(shortening);
        assert_close("load", 16.0 * complete * complete, load, 1e-12);
        assert_close("offset", k / complete, offset, 1e-11);
    }
}

#[test]
fn pinned_and_clamped_elasticas_match_elliptic_integrals() {
    // P ℓ²/(E I) is 4 K² between pins and 16 K² between clamps, the couple at a clamp 8 k K E I/ℓ,
    // the angle at a pin 2 asin k, and the offset of the middle k/K ℓ.
    let couple = bending_stiffness() / LENGTH;
    for shortening in [0.05, 0.1, 0.2, 0.3, 0.5] {
        let (k, complete) = modulus(shortening);
        let mut pinned = Held::straight(LENGTH, FRAC_PI_2, 16, ());
        let support = (
            Joint::Hinge(Vector3::y_axis()),
            apex(&pinned, shortening, false),
        );
        pinned.hold(&support);
        assert_close(
            "load",
            -pinned.reaction().0.x * LENGTH / couple,
            4.0 * complete * complete,
            ACCURACY,
        );
        assert_close(
            "offset",
            pinned.place(0.5).z.abs(),
            LENGTH * k / complete,
            ACCURACY,
        );
        let tangent = pinned.rod.apex_frame() * Vector3::z();
        assert_close(
            "angle",
            tangent.z.abs().atan2(tangent.x),
            2.0 * k.asin(),
            ACCURACY,
        );
        assert_eq!(pinned.signs(), (0, 0));
        // Between clamps the spans of the bend are half as long, and the clamped rod of shortening
        // 0.5 has an error of 2e-9.
        if shortening <= 0.3 {
            let mut clamped = Held::straight(LENGTH, FRAC_PI_2, 16, ());
            let support = apex(&clamped, shortening, true);
            clamped.hold(&support);
            let (force, moment) = clamped.reaction();
            assert_close(
                "load",
                -force.x * LENGTH / couple,
                16.0 * complete * complete,
                ACCURACY,
            );
            assert_close(
                "couple",
                moment.norm() / couple,
                8.0 * k * complete,
                ACCURACY,
            );
            let middle = clamped.place(0.5);
            assert_close(
                "offset",
                middle.y.hypot(middle.z),
                LENGTH * k / complete,
                ACCURACY,
            );
            // The rod without weight rotates freely about its chord.
            assert_eq!(clamped.signs(), (0, 1));
        }
    }
}

#[test]
fn pinned_rods_at_random_places_are_elasticas() {
    // The leading parts of the tangent of such a rod may be singular. The rod begins straight, along
    // the base.
    let mut draw = Draw::new(31);
    for case in 0..100 {
        let mut component = || draw.uniform(-1.0, 1.0);
        let direction = Vector3::new(component(), component(), component()).normalize();
        let distance = draw.uniform(0.2, 0.95);
        let mut rod = Held::straight(LENGTH, 0.0, 8, ());
        rod.hold(&(
            Joint::Ball,
            Hold::apex().at(direction * (distance * LENGTH)),
        ));
        let (_, complete) = modulus(1.0 - distance);
        let expected = direction * (-4.0 * complete * complete);
        let found = rod.reaction().0 * LENGTH * LENGTH / bending_stiffness();
        // The error of eight elements, relative to the load.
        let error = (found - expected).norm() / expected.norm();
        assert!(error < 1e-6, "{case}: {error:e}, {direction}, {distance}");
        assert_eq!(rod.signs().0, 0, "{case}");
    }
}

#[test]
fn heavy_rod_between_held_ends_hangs_as_in_the_reference() {
    let (length, shortening) = (0.08, 0.1);
    let unit = bending_stiffness() / length;
    let rod = || Held::straight(length, FRAC_PI_2, 16, WEIGHT);

    let mut pinned = rod();
    let support = (
        Joint::Hinge(Vector3::y_axis()),
        apex(&pinned, shortening, false),
    );
    pinned.hold(&support);
    assert_close(
        "force",
        pinned.reaction().0.x * length / unit,
        -5.871_588_981_632_084,
        ACCURACY,
    );
    assert_close(
        "middle",
        pinned.place(0.5).z,
        -0.015_573_504_719_362_407,
        ACCURACY,
    );
    let tangent = pinned.rod.frames()[0] * Vector3::z();
    assert_close(
        "angle",
        tangent.z.atan2(tangent.x),
        -0.642_374_809_216_940_3,
        ACCURACY,
    );

    let mut clamped = rod();
    let support = apex(&clamped, shortening, true);
    clamped.hold(&support);
    assert_close(
        "force",
        clamped.reaction().0.x * length / unit,
        -37.919_246_136_391_735,
        ACCURACY,
    );
    assert_close(
        "middle",
        clamped.place(0.5).z,
        -0.015_619_606_715_968_251,
        ACCURACY,
    );
    let base = -clamped.couple_beyond(0.0, &default_weight()).y / unit;
    assert_close("couple", base, -4.342_168_670_503_857, ACCURACY);
    for held in [&pinned, &clamped] {
        assert_eq!(held.signs(), (0, 0));
        // Each end bears half of the weight by symmetry.
        assert_close(
            "vertical force",
            held.reaction().0.z,
            -0.5 * default_weight().z * length,
            ACCURACY,
        );
    }
}

#[test]
fn hanging_arch_is_stable_and_standing_arch_topples_about_its_chord() {
    // The weight is added to an arch that bends to either side.
    let arch = |side: f64| {
        let mut held = Held::straight(
            0.08,
            FRAC_PI_2,
            16,
            Weight {
                density: side * DENSITY,
            },
        );
        let support = apex(&held, 0.1, true);
        held.hold(&support);
        (held.load, held.stable_only) = (WEIGHT, false);
        held.hold(&support);
        held
    };
    let (hanging, standing) = (arch(1.0), arch(-1.0));
    assert!(hanging.place(0.5).z < 0.0 && standing.place(0.5).z > 0.0);
    assert!(hanging.found.energy < standing.found.energy);
    // A rotation about the chord does not strain an isotropic rod.
    assert_eq!((hanging.signs(), standing.signs()), ((0, 0), (1, 0)));
    // The weight stretches the hanging arch and compresses the standing one.
    assert!(standing.reaction().0.x < hanging.reaction().0.x);
}
