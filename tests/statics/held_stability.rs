//! Loss of stability of held rods, found by the signs of eigenvalues, and shapes beyond it.
//!
//! The reference numbers were computed by shooting (DOP853, tolerance 2e-14) and by Chebyshev
//! collocation, which agree to the digits given.

use std::f64::consts::{PI, TAU};

use crate::fixtures::held::{Held, about, assert_close, bisect};
use crate::fixtures::rods::bending_stiffness;
use morphorod::load::{ApicalForce, Load};
use morphorod::support::{Hold, Joint, Support};
use nalgebra::{UnitQuaternion, Vector3};

/// Length, m.
const LENGTH: f64 = 0.1;
/// Ratio of the stiffnesses to bending and twist, 1 + ν.
const RATIO: f64 = 1.5;
/// Number of elements of order eight.
const ELEMENTS: usize = 16;
/// Required relative accuracy of critical values. Eigenvalues that are neutral to rounding limit it
/// to about 1e-7.
const CRITICAL: f64 = 1e-6;

/// Axial force on the apex in units of E I/ℓ², positive in tension.
fn axial(force: f64) -> impl Load {
    let force = Vector3::z() * (force * bending_stiffness() / (LENGTH * LENGTH));
    ApicalForce(move |_| force)
}

fn upright<L: Load>(load: L) -> Held<L> {
    Held::straight(LENGTH, 0.0, ELEMENTS, load)
}

/// The value between a stable and an unstable one at which a held rod loses stability. Each rod
/// begins at the stable value.
fn critical<L: Load>(held: &mut Held<L>, range: (f64, f64), support: impl Fn(f64) -> Hold) -> f64 {
    held.stable_only = false;
    held.hold(&support(range.0));
    let stable = held.rod.clone();
    assert_eq!(held.signs().0, 0);
    bisect(range, 1e-8, |value| {
        held.rod.clone_from(&stable);
        held.hold(&support(value)).signs().0 > 0
    })
}

/// Signs a little below and above a critical value.
fn around<L: Load>(
    held: &mut Held<L>,
    critical: f64,
    support: impl Fn(f64) -> Hold,
) -> [(usize, usize); 2] {
    [1.0 - 1e-4, 1.0 + 1e-4].map(|factor| held.hold(&support(factor * critical)).signs())
}

#[test]
fn straight_rods_buckle_at_eulers_loads() {
    let guided = Hold::apex().on_line(Vector3::zeros(), Vector3::z_axis());
    let frame = UnitQuaternion::identity();
    // The first root of tan x = x, for the rod with one clamp and one pin.
    let root = bisect((4.4, 4.6), 1e-15, |x| x.tan() > x);
    // Support, load P ℓ²/(E I), negative and neutral eigenvalues beyond the load. A rod that hinges
    // about one axis buckles in one plane, and one with ball joints at both ends twists freely.
    type Case = (Box<dyn Support>, f64, (usize, usize));
    let cases: [Case; 5] = [
        (Box::new(guided.held(frame)), 4.0 * PI * PI, (2, 0)),
        (Box::new(guided), root * root, (2, 0)),
        (
            Box::new((Joint::Hinge(Vector3::y_axis()), guided)),
            PI * PI,
            (1, 0),
        ),
        (Box::new((Joint::Ball, guided)), PI * PI, (2, 1)),
        (Box::new(Hold::apex().held(frame)), PI * PI, (2, 0)),
    ];
    for (support, exact, beyond) in cases {
        let at = |load: f64| {
            let signs = upright(axial(-load)).inertia(&support);
            (signs.negative, signs.neutral)
        };
        assert_close(
            "load",
            bisect((0.5 * exact, 1.5 * exact), 1e-9, |load| at(load).0 > 0),
            exact,
            CRITICAL,
        );
        assert_eq!(
            (at(0.99 * exact), at(1.01 * exact)),
            ((0, beyond.1), beyond)
        );
    }
}

/// Ring whose ends meet at the base, without strain energy of twist.
fn ring() -> Held<()> {
    let mut held = upright(());
    held.rod.set_intrinsic(|_| Vector3::y() * (TAU / LENGTH));
    held.hold(&());
    held.rod.set_intrinsic(|_| Vector3::zeros());
    held.stable_only = false;
    held
}

/// Closes the ring with a number of turns of twist.
fn closed(turns: f64) -> Hold {
    Hold::apex()
        .at(Vector3::zeros())
        .held(about(Vector3::z_axis(), TAU * turns))
}

#[test]
fn twisted_ring_buckles_after_zajacs_number_of_turns() {
    // J. H. Michell (1889), and E. E. Zajac (1962), J. Appl. Mech. 29, 136–142: 2π √3 B/C.
    let exact = 3_f64.sqrt() * RATIO;
    let mut held = ring();
    // A small step changes the reactions more than the shape.
    assert_eq!(held.hold(&closed(0.01)).signs(), (0, 1));
    for step in 0..=10 {
        held.hold(&closed(0.25 * f64::from(step)));
        // The ring rotates freely about its held tangent.
        assert_eq!(held.signs(), (0, 1), "after {step} quarter turns");
    }
    assert_close(
        "turns",
        critical(&mut held, (2.5, 2.7), closed),
        exact,
        CRITICAL,
    );
    // Two eigenvalues change sign together.
    assert_eq!(around(&mut held, exact, closed), [(0, 1), (2, 1)]);
}

#[test]
fn ring_with_half_a_turn_of_twist_has_the_energy_of_uniform_strain() {
    let mut held = ring();
    held.hold(&closed(0.25)).hold(&closed(0.5));
    // The reference number has twelve digits. The ring is exact at the nodes of every mesh.
    assert_close(
        "energy",
        held.found.energy,
        0.000_113_043_717_063_593_11,
        1e-11,
    );
    let (force, couple) = held.reaction();
    let (bending, twist) = (
        TAU * bending_stiffness() / LENGTH,
        PI * bending_stiffness() / (RATIO * LENGTH),
    );
    // m = E I κ d2 + C τ d3 at the apex. The force along the binormal has the size C τ κ.
    assert_close("bending couple", couple.xy().norm(), bending, 1e-9);
    assert_close("twisting couple", couple.z, twist, 1e-9);
    assert_close("force", force.norm(), twist * TAU / LENGTH, 1e-9);
}

/// Straight rod on the axis whose clamped apex is twisted by a torque M ℓ/(E I).
fn twisted(torque: f64) -> Hold {
    let frame = about(Vector3::z_axis(), RATIO * torque);
    Hold::apex()
        .on_line(Vector3::zeros(), Vector3::z_axis())
        .held(frame)
}

#[test]
fn clamped_rod_buckles_at_greenhills_torque() {
    // Tension T ℓ²/(E I) and critical torque M ℓ/(E I) of B w'''' − i M w''' − T w'' = 0.
    for (tension, exact) in [(0.0, 8.986_818_915_818_128), (50.0, 15.589_323_932_753_883)] {
        let mut held = upright(axial(tension));
        let mut torque = 0.0;
        while torque < exact - 1.0 {
            torque += 1.0;
            held.hold(&twisted(torque));
            assert_eq!(held.signs(), (0, 0));
            assert_close(
                "torque",
                held.reaction().1.z * LENGTH / bending_stiffness(),
                torque,
                1e-12,
            );
        }
        assert_close(
            "torque",
            critical(&mut held, (torque, torque + 1.5), twisted),
            exact,
            CRITICAL,
        );
        assert_eq!(around(&mut held, exact, twisted), [(0, 0), (2, 0)]);
    }
}

#[test]
fn buckled_rod_that_is_twisted_matches_reference_numbers() {
    // Shortening; axial force n ℓ²/(E I); twisting couple, distance of the middle from the axis,
    // and base couple in units of E I/ℓ and ℓ, after half a turn from the planar elastica.
    for (shortening, force, twist, distance, base) in [
        (
            0.1,
            -37.395_827_447_590_06,
            1.878_720_620_044_067_6,
            0.186_010_248_198_391_57,
            4.435_259_732_744_798,
        ),
        (
            0.2,
            -38.081_100_400_668_15,
            1.601_285_490_726_012_8,
            0.250_278_962_471_102_8,
            5.955_190_384_565_951,
        ),
    ] {
        let mut held = upright(());
        let end = Vector3::z() * (LENGTH * (1.0 - shortening));
        for quarter in 0..=4 {
            held.hold(
                &Hold::apex()
                    .at(end)
                    .held(about(Vector3::z_axis(), 0.25 * PI * f64::from(quarter))),
            );
            assert_eq!(held.signs(), (0, 1));
        }
        let (n, m) = held.reaction();
        let unit = bending_stiffness() / LENGTH;
        // With sixteen elements the largest error is 2e-10.
        assert_close("force", n.z * LENGTH / unit, force, 1e-9);
        assert_close("twisting couple", m.z / unit, twist, 1e-9);
        assert_close(
            "distance",
            held.place(0.5).xy().norm() / LENGTH,
            distance,
            1e-9,
        );
        assert_close(
            "base couple",
            held.couple_beyond(0.0, &Vector3::zeros()).norm() / unit,
            base,
            1e-9,
        );
    }
}

#[test]
fn planar_arch_loses_stability_out_of_its_plane() {
    let shortened = |shortening: f64| {
        Hold::apex()
            .at(Vector3::z() * (LENGTH * (1.0 - shortening)))
            .held(UnitQuaternion::identity())
    };
    let mut held = upright(());
    held.stable_only = false;
    for tenth in 1..=5 {
        held.hold(&shortened(0.1 * f64::from(tenth)));
        // The arch rotates freely about its chord.
        assert_eq!(held.signs(), (0, 1), "shortening 0.{tenth}");
    }
    let value = critical(&mut held, (0.5, 0.6), shortened);
    // The rotation about the chord may count as positive beyond the value, where its eigenvalue
    // rounds to 2e-9.
    assert_eq!(
        around(&mut held, value, shortened).map(|signs| signs.0),
        [0, 1]
    );
    // The branch remains in the plane of e1 and e3.
    assert!(
        held.place(0.5).y.abs() < 1e-9 * LENGTH,
        "{:e}",
        held.place(0.5).y
    );
    // With 32 elements the value is 0.542673099. The shooting method of the reference brackets it
    // by 0.5 and 0.6.
    assert_close("shortening", value, 0.542_673_1, CRITICAL);
}

#[test]
fn stable_ring_has_one_neutral_direction_on_every_mesh() {
    // The ring rotates freely about its held tangent. The reactions change by all of their size in
    // the first step.
    for elements in 6..=12 {
        let mut held = Held::straight(LENGTH, 0.0, elements, ());
        held.rod.set_intrinsic(|_| Vector3::y() * (TAU / LENGTH));
        held.hold(&());
        held.rod.set_intrinsic(|_| Vector3::zeros());
        held.stable_only = false;
        for step in 0..30 {
            held.hold(&closed(0.08 * f64::from(step)));
            // Eigenvalues up to 1e-8 count as neutral. The largest is 2.3e-10, by the error of the
            // solver. Before this error took account of the change of the reactions, it was 1e-7.
            assert_eq!(held.signs(), (0, 1), "{elements} elements, step {step}");
            assert!(
                held.found.inertia.margin < 1e-9,
                "{elements} elements, step {step}: {:?}",
                held.found.inertia
            );
        }
    }
}
