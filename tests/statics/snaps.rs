//! Shoots far above their critical length snap from one stable shape to another, and the integrator
//! counts the snaps.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots;
use crate::fixtures::shoots::{HOUR, RADIUS, WEIGHT, YOUNG, reduced, rod};
use approx::{abs_diff_eq, assert_abs_diff_eq};
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{IntegrationError, Integrator, MethodOfSteps, Statistics};
use morphorod::load::ApicalForce;
use morphorod::support::{Contact, HalfSpace};
use morphorod::{Order, Section, Shoot, Still};
use nalgebra::Vector3;

/// Greenhill's length of the default shoot, (7.837 E I/q)^(1/3), m.
const CRITICAL: f64 = 0.079333;

/// Tip (m) and statistics of a shoot with tropisms after 24 h. The length is `times` the critical
/// length, and the tilt is in radians.
fn after_a_day(
    times: f64,
    tilt: f64,
    elements: usize,
) -> Result<(Vector3<f64>, Statistics), IntegrationError> {
    let length = times * CRITICAL;
    let mut shoot = reduced(length, 20.0 * HOUR)
        .elements(elements)
        .scene(Still::tilted(tilt))
        .into_dyn()
        .build()
        .unwrap();
    let cost = MethodOfSteps::new(90.0).advance(&mut shoot, 24.0 * HOUR)?;
    shoots::assert_sound(&shoot);
    Ok((shoot.tip(), cost))
}

#[test]
fn shoots_far_above_the_critical_length_snap_alike_on_two_meshes() {
    // The shoot bends over and snaps from side to side for hours. On a tilted base, both meshes
    // give the same number of snaps and the same final tip. In equilibrium under
    // q ℓ³/(E I) = 300, the error of sixteen elements is 6e-7 of the length, and that of 32 is 2e-8
    // (example `work_precision`, heavy base). Here q ℓ³/(E I) is 26 and 63 on sixteen elements, and
    // 212 on 32. The effect of a snap decays with the memory time of 12 min.
    for (times, elements) in [(1.5, [32, 16]), (2.0, [32, 16]), (3.0, [48, 32])] {
        let (fine, with_fine) = after_a_day(times, 0.3, elements[0]).unwrap();
        let (coarse, with_coarse) = after_a_day(times, 0.3, elements[1]).unwrap();
        println!(
            "{times}: {} snaps, at last at {:?} s, by {} m",
            with_fine.snaps, with_fine.last_snap, with_fine.largest_jump
        );
        assert!(with_fine.snaps > 0 && with_fine.snaps == with_coarse.snaps);
        assert!(
            with_fine.largest_jump > 0.1 * CRITICAL
                && with_fine.largest_jump < 2.0 * times * CRITICAL
        );
        assert!(
            abs_diff_eq!(
                InNorm(fine),
                InNorm(coarse),
                epsilon = 3e-7 * times * CRITICAL
            ),
            "{times}: {fine} against {coarse}"
        );
    }
    // At five times the critical length the run succeeds with elements that are short enough at the
    // base.
    assert!(after_a_day(5.0, 0.3, 32).is_ok());
    // At ten times the critical length, one of eight elements would rotate by π. This is an error.
    let error = after_a_day(10.0, 0.3, 8).unwrap_err();
    assert!(error.to_string().contains("would rotate by π"), "{error}");
}

#[test]
fn snap_is_counted_with_its_time_and_jump() {
    // A force whose sign reverses bends a shoot above its critical length. The shoot snaps through
    // once and then bends to the other side. The section is broader across the plane of bending, so
    // that the shoot stays in that plane.
    let force = |t: f64| Vector3::new(2e-5 * (1.0 - t / HOUR), 0.0, 0.0);
    let mut shoot = Shoot::builder(YOUNG)
        .section(|_| Section::ellipse(RADIUS, 2.0 * RADIUS))
        .length(0.085)
        .load((WEIGHT, ApicalForce(force)))
        .into_dyn()
        .build()
        .unwrap();
    let mut run = MethodOfSteps::new(60.0);
    let before = run.advance(&mut shoot, HOUR).unwrap();
    assert!(before.snaps == 0 && shoot.tip().x > 0.0, "{before:?}");
    let after = run.advance(&mut shoot, 4.0 * HOUR).unwrap();
    assert!(
        after.snaps == 1 && shoot.tip().x < 0.0,
        "{after:?}, {:?}",
        shoot.tip()
    );
    let when = after.last_snap.unwrap();
    assert!(when > HOUR && when < 4.0 * HOUR);
    // The tip jumps from one side to the other.
    assert!(after.largest_jump > 0.5 * shoot.tip().x.abs(), "{after:?}");
    // The time of the snap does not depend on the elements or the step, to within one step.
    let mut fine = Shoot::builder(YOUNG)
        .section(|_| Section::ellipse(RADIUS, 2.0 * RADIUS))
        .length(0.085)
        .elements(16)
        .load((WEIGHT, ApicalForce(force)))
        .into_dyn()
        .build()
        .unwrap();
    let again = MethodOfSteps::new(20.0)
        .advance(&mut fine, 4.0 * HOUR)
        .unwrap();
    assert_eq!(again.snaps, 1, "{again:?}");
    assert_abs_diff_eq!(again.last_snap.unwrap(), when, epsilon = 60.0);
    // A floor that the shoot never touches changes neither the number of snaps nor their time.
    let floor = HalfSpace {
        through: -Vector3::z(),
        normal: Vector3::z(),
    };
    let mut above = Shoot::builder(YOUNG)
        .section(|_| Section::ellipse(RADIUS, 2.0 * RADIUS))
        .length(0.085)
        .load((WEIGHT, ApicalForce(force)))
        .support(Contact {
            obstacle: floor,
            radius: RADIUS,
            friction: 0.0,
        })
        .into_dyn()
        .build()
        .unwrap();
    let beside = MethodOfSteps::new(60.0)
        .advance(&mut above, 4.0 * HOUR)
        .unwrap();
    assert_eq!(
        (beside.snaps, beside.last_snap),
        (1, Some(when)),
        "{beside:?}"
    );
    assert_abs_diff_eq!(InNorm(above.tip()), InNorm(shoot.tip()), epsilon = 1e-8);
    assert!(
        beside.largest_jump > 0.5 * above.tip().x.abs(),
        "{beside:?}"
    );
}

#[test]
fn buckled_shoot_keeps_bending_in_its_plane_without_snaps() {
    // The shoot grows on an upright base from 0.99 to 1.14 of its critical length. It buckles once,
    // in the plane of d1, and then bends further. A rotation about the vertical is neutral. It must
    // not be counted as a snap or move the shoot out of the plane.
    for (order, step) in [
        (Order::Four, 100.0),
        (Order::Four, 1000.0),
        (Order::Eight, 90.0),
        (Order::Eight, 1000.0),
    ] {
        let mut shoot = rod(YOUNG, 0.99 * CRITICAL)
            .order(order)
            .growth(UniformGrowth {
                zone_length: 0.03,
                time: 20.0 * HOUR,
            })
            .load(WEIGHT)
            .into_dyn()
            .build()
            .unwrap();
        let found = MethodOfSteps::new(step)
            .advance(&mut shoot, 8.0 * HOUR)
            .unwrap();
        let tip = shoot.tip();
        assert!(tip.x.abs() > 0.8 * shoot.rod().length(), "{tip:?}");
        // Only rounding rotates the shoot out of its plane.
        assert!(
            tip.y.abs() < 1e-6 * tip.x.abs(),
            "{order:?}, {step} s: {tip:?}"
        );
        // The initial guess may be extrapolated from upright shapes in the step after buckling. A
        // second snap is therefore allowed.
        let critical_at = 0.01 * CRITICAL / 0.03 * 20.0 * HOUR;
        let last = found.last_snap.unwrap();
        assert!(
            found.snaps <= 2,
            "{order:?}, {step} s: {} snaps",
            found.snaps
        );
        assert!(
            last > critical_at && last < critical_at + 2.0 * step,
            "{order:?}, {step} s: {last}"
        );
    }
}

#[test]
fn number_of_snaps_of_a_buckled_shoot_does_not_depend_on_the_step() {
    // On a base that is upright up to 1e-9 rad a rotation about the vertical is soft, but not
    // neutral. The initial guess of each step has a negative pivot in this direction, although the
    // shoot bends smoothly.
    for tilt in [0.0, 1e-9] {
        let counts = [600.0, 60.0, 10.0].map(|step| {
            let mut shoot = rod(YOUNG, 0.99 * CRITICAL)
                .growth(UniformGrowth {
                    zone_length: 0.03,
                    time: 20.0 * HOUR,
                })
                .load(WEIGHT)
                .scene(Still::tilted(tilt))
                .into_dyn()
                .build()
                .unwrap();
            MethodOfSteps::new(step)
                .advance(&mut shoot, 8.0 * HOUR)
                .unwrap()
                .snaps
        });
        // It buckles once.
        assert_eq!(counts, [1, 1, 1], "tilt {tilt}");
    }
}
