//! The growing shoot of the paper's supplementary video 2: it elongates, steers, stiffens, sags and
//! nutates.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{HOUR, assert_sound, growing, tips};
use approx::{assert_abs_diff_eq, assert_relative_eq, relative_eq};
use morphorod::integrator::{Integrator, MethodOfSteps};
use nalgebra::Vector3;

/// Time (s), length and tip (m) of the growing shoot ("video 2" of doi 10.3389/fpls.2021.608005: ℓ0
/// = 6.8 cm, ℓg = 7 cm, α = 0.2, τe = 24 min, τg = 40 h, lignification, statoliths) under a lateral
/// load of 1e-6 N/m along −e2 and an apical load of 1e-7 N along −e1 and along −e2, default past.
/// Converged to 2e-9 m in time step, mesh and order by a code that is independent of this crate. A
/// third code agrees to 2e-7 m, its own limit.
const REFERENCE: [[f64; 5]; 11] = [
    [
        0.0,
        0.068000000000,
        -0.000056885129,
        -0.000071669657,
        0.067999927291,
    ],
    [
        3600.0,
        0.069721428196,
        0.001021192878,
        0.000253087255,
        0.069712529847,
    ],
    [
        7200.0,
        0.071470872419,
        -0.001865298949,
        0.000174361313,
        0.071441942050,
    ],
    [
        10800.0,
        0.073220872419,
        0.003335478211,
        -0.000536258475,
        0.073125291446,
    ],
    [
        14400.0,
        0.074970872419,
        -0.005644071847,
        0.000625228975,
        0.074697571164,
    ],
    [
        18000.0,
        0.076720872419,
        0.008002411656,
        -0.000290353143,
        0.076176563724,
    ],
    [
        21600.0,
        0.078470872419,
        -0.008646514531,
        -0.000375753532,
        0.077835521248,
    ],
    [
        25200.0,
        0.080220872419,
        0.006360306506,
        0.000910117051,
        0.079876582501,
    ],
    [
        28800.0,
        0.081970872419,
        -0.001992932687,
        -0.000621406599,
        0.081935731692,
    ],
    [
        32400.0,
        0.083720872419,
        0.000004323547,
        -0.000693063198,
        0.083716306792,
    ],
    [
        36000.0,
        0.085470872419,
        -0.005145737387,
        0.001963993418,
        0.085221331606,
    ],
];

fn hours() -> [f64; 11] {
    REFERENCE.map(|row| row[0])
}

fn largest_error(tips: &[Vector3<f64>]) -> f64 {
    let errors = REFERENCE
        .iter()
        .zip(tips)
        .map(|(row, tip)| (tip - Vector3::new(row[2], row[3], row[4])).norm());
    errors.fold(0.0, f64::max)
}

#[test]
fn tip_matches_the_reference_at_every_hour() {
    let mut shoot = growing().into_dyn().build().unwrap();
    let (tips, statistics) = tips(&mut shoot, 90.0, &hours());
    let error = largest_error(&tips);
    // The documented error is 1e-5 m at the default settings. Steps of 90 s are a sixteenth of the
    // oscillator's period, with a fourth-order error of 1e-6 m on the tip's swing of a centimetre.
    assert!(error < 1e-5, "{error:e} m");
    // Each step solves one equilibrium. One iteration suffices from an initial guess that is
    // extrapolated from the last five equilibria.
    assert_eq!(statistics.equilibria, statistics.steps + 1);
    assert!(statistics.steps < 410, "{statistics:?}");
    assert!(
        10 * statistics.iterations <= 11 * statistics.equilibria
            && 10 * statistics.factorisations <= 11 * statistics.equilibria,
        "{statistics:?}"
    );
    assert_sound(&shoot);
}

#[test]
fn step_of_a_quarter_of_a_period_takes_one_newton_iteration() {
    // No polynomial in time extrapolates an oscillation of four steps a period, but the intrinsic
    // strain at the end of a step is known. Initial guesses are then off by about 5e-3 rad, and one
    // or two chord steps, each with one gradient, reach 1e-8 rad.
    let mut shoot = growing().into_dyn().build().unwrap();
    let cost = MethodOfSteps::new(360.0)
        .advance(&mut shoot, 10.0 * HOUR)
        .unwrap();
    assert!(
        cost.iterations <= cost.equilibria + 3 && cost.factorisations <= cost.equilibria + 3,
        "{cost:?}"
    );
    assert!(cost.evaluations <= 2 * cost.equilibria, "{cost:?}");
}

#[test]
fn refined_run_matches_the_reference_to_a_tenth_of_a_micrometre() {
    let mut shoot = growing().elements(16).into_dyn().build().unwrap();
    let (tips, statistics) = tips(&mut shoot, 45.0, &hours());
    let error = largest_error(&tips);
    // Half the step has a sixteenth of the error of 1e-6 m at 90 s. The error of the reference is
    // 2e-9 m.
    assert!(error < 1e-7, "{error:e} m");
    // At half the step the extrapolated initial guess is so good that one iteration suffices.
    assert!(
        10 * statistics.iterations <= 11 * statistics.equilibria,
        "{statistics:?}"
    );
}

#[test]
fn length_follows_the_closed_form() {
    // ℓ0 exp(t/τg) up to T0 = τg ln(ℓg/ℓ0) = 1.16 h, then ℓg (1 + (t − T0)/τg).
    let full = 40.0 * HOUR * (0.07_f64 / 0.068).ln();
    let mut shoot = growing().into_dyn().build().unwrap();
    for row in REFERENCE {
        let t = row[0];
        let exact = if t <= full {
            0.068 * (t / 144e3).exp()
        } else {
            0.07 * (1.0 + (t - full) / 144e3)
        };
        // The reference is printed to 1e-12 m.
        assert_abs_diff_eq!(exact, row[1], epsilon = 1e-12);
        let _ = tips(&mut shoot, 180.0, &[t]);
        assert_relative_eq!(
            shoot.rod().length(),
            exact,
            epsilon = 0.0,
            max_relative = 1e-12
        );
    }
}

#[test]
fn boundary_of_the_growth_zone_is_always_between_two_elements() {
    let mut shoot = growing().into_dyn().build().unwrap();
    for t in [0.5, 1.0, 1.2, 1.5, 3.0, 6.1].map(|h| h * HOUR) {
        let _ = tips(&mut shoot, 100.0, &[t]);
        let rod = shoot.rod();
        let first = rod.zone().start / rod.order().points();
        let (mature, growing) = rod.points().split_at(first * rod.order().points());
        assert!(
            mature.iter().all(|point| point.exit_time <= t)
                && growing.iter().all(|p| p.exit_time.is_infinite())
        );
        if first > 0 {
            // The bound covers rounding in sums of about fifty lengths.
            let zone = rod.length() - rod.centre_line()[first].0;
            assert!(
                relative_eq!(zone, 0.07, epsilon = 0.0, max_relative = 1e-12),
                "the zone is {zone} m long at {t} s"
            );
        } else {
            assert!(
                t < 40.0 * HOUR * (0.07_f64 / 0.068).ln(),
                "no tissue has left the zone after {t} s"
            );
        }
        // Exit times increase towards the apex.
        assert!(
            mature
                .windows(2)
                .all(|pair| pair[0].exit_time < pair[1].exit_time)
        );
    }
}

#[test]
fn merging_mature_elements_moves_the_tip_by_less_than_its_tolerance() {
    let run = |tolerance: f64| {
        let mut shoot = growing()
            .merge_tolerance(tolerance)
            .into_dyn()
            .build()
            .unwrap();
        let (tips, statistics) = tips(&mut shoot, 90.0, &hours());
        (tips, statistics, shoot.rod().elements())
    };
    let (exact, statistics, all) = run(0.0);
    assert_eq!(statistics.merges, 0);
    // If nothing is merged, every step adds a mature element.
    assert!(all > 350, "{all} elements");
    for tolerance in [1e-3, 1e-4, 1e-5] {
        let (tips, _, elements) = run(tolerance);
        let off = tips
            .iter()
            .zip(&exact)
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f64::max);
        // The bound is the tolerance, an angle in rad, times the length of the shoot.
        assert!(off < tolerance * 0.0855, "tolerance {tolerance}: {off:e} m");
        assert!(
            elements < all / 4,
            "tolerance {tolerance}: {elements} of {all} elements are left"
        );
    }
}

#[test]
fn number_of_mature_elements_follows_the_slow_swings_not_the_ripples() {
    let mut shoot = growing().elements(8).into_dyn().build().unwrap();
    for t in [10.0, 20.0, 40.0].map(|h| h * HOUR) {
        let _ = tips(&mut shoot, 90.0, &[t]);
        let rod = shoot.rod();
        let growing = rod.elements() - rod.zone().start / rod.order().points();
        // Elements are halved at an eighth of the zone, so lengths are between a sixteenth and an
        // eighth; the boundary of the zone adds one element.
        assert!(
            (8..=17).contains(&growing),
            "{growing} elements in the zone at {t} s"
        );
        // One period of the oscillator leaves a ripple of wavelength ℓg τe/τg = 0.7 mm. Its loss in
        // merging does not depend on the length of the element. The slow swing, of 90 min and 2.6
        // mm, must be resolved to 2e-3 rad: an element of eighth order covers nearly two swings.
        let mature = rod.zone().start / rod.order().points();
        let swings = (rod.length() - 0.07) / 2.6e-3;
        assert!(
            (mature as f64) < 0.6 * swings + 8.0,
            "{mature} elements for {swings} swings"
        );
    }
    assert_sound(&shoot);
}

#[test]
fn merging_preserves_the_bending_of_fresh_tissue() {
    // Compare the default tolerance with a hundredth of it after 40 h. The lost part of the
    // intrinsic strain has zero moments. The relative change of the bend of an element is at most
    // 1e-6. A total bend of one radian on an arm of 14 cm gives 1.4e-7 m, which the slow swing
    // magnifies slightly. Without that bound the error of the tip is 1e-5 m.
    let tip = |tolerance: f64| {
        let mut shoot = growing()
            .elements(8)
            .merge_tolerance(tolerance)
            .into_dyn()
            .build()
            .unwrap();
        tips(&mut shoot, 90.0, &[40.0 * HOUR]).0[0]
    };
    assert_abs_diff_eq!(InNorm(tip(1e-4)), InNorm(tip(1e-6)), epsilon = 2e-6);
}
