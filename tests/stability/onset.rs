//! Onset of oscillations of the upright shoot, compared with the linear theory of Agostinelli,
//! DeSimone and Noselli (2021), section 3.1: EI [(1 + b) θ'' + a θ'] + q (ℓ − s) θ = 0. The
//! reference values were computed to ten digits by other codes.

use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::load::Weight;
use morphorod::stability::{Linearisation, StabilityError, onset, solve_steady_state};
use morphorod::tropism::{
    Gravitropism, Memory, Oscillator, Proprioception, Response, SettledStatoliths, Statoliths,
};
use morphorod::{Shoot, Still};

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use nalgebra::Complex;

use crate::fixtures::upright::{HOUR, MEMORY, MINUTE, YOUNG, linearisation};

/// Period at onset (s) for equal memories, τm = τr = 12 min. The frequency x = ωτr satisfies x tan
/// x = 1 for any length and growth time.
const PERIOD: f64 = 87.638_358_711_642_3 * MINUTE;

#[test]
fn length_and_period_at_onset_agree_with_linear_theory() {
    // τg (h), η, length at onset (m) and search range (m). The paper gives the lengths 6.56 and
    // 7.24 cm.
    let cases = [
        (20.0, 20.0, 0.065_614_866_491, [0.060, 0.070]),
        (40.0, 20.0, 0.072_407_759_341, [0.066, 0.077]),
        (10.0, 20.0, 0.052_368_383_610, [0.045, 0.060]),
        (20.0, 0.0, 0.071_003_931_291, [0.064, 0.075]),
    ];
    for (hours, eta, length, [from, to]) in cases {
        let found = onset(
            |l| linearisation(l, hours * HOUR, 0.8, eta, SettledStatoliths, 4),
            from,
            to,
        )
        .unwrap();
        // The relative error of four elements of order eight, with finite differences of relative
        // error 1e-9, is 1e-9.
        for (value, expected) in [(found.parameters[0], length), (found.period(), PERIOD)] {
            let agrees = relative_eq!(value, expected, epsilon = 0.0, max_relative = 1e-8);
            assert!(
                agrees,
                "{hours} h, η = {eta}: {value} against {expected}, {found:?}"
            );
        }
        assert!(!found.essential);
    }
}

#[test]
fn slow_statoliths_reduce_the_length_at_onset() {
    let statoliths = Statoliths {
        avalanche_time: 2.0 * MINUTE,
    };
    let found = onset(
        |l| linearisation(l, 20.0 * HOUR, 0.8, 20.0, statoliths, 4),
        0.06,
        0.07,
    )
    .unwrap();
    // The reference length has ten digits, the reference period nine.
    assert_relative_eq!(
        found.parameters[0],
        0.064_595_221_175,
        epsilon = 0.0,
        max_relative = 1e-8
    );
    assert_relative_eq!(
        found.period(),
        92.769_230_7 * MINUTE,
        epsilon = 0.0,
        max_relative = 1e-8
    );
}

#[test]
fn length_at_onset_converges_at_least_at_order_eight() {
    let error = |elements| {
        let family = |l| linearisation(l, 20.0 * HOUR, 0.8, 20.0, SettledStatoliths, elements);
        (onset(family, 0.06, 0.07).unwrap().parameters[0] / 0.065_614_866_491 - 1.0).abs()
    };
    // On these coarse meshes the errors (1e-5 to 1e-9) are much larger than the error of the finite
    // differences in the matrix, which is 1e-10.
    let (one, three) = (error(1), error(3));
    let order = (one / three).ln() / 3.0_f64.ln();
    assert!(
        order > 7.5,
        "observed order {order}: errors {one:e} and {three:e}"
    );
}

#[test]
fn onset_in_microgravity_is_that_of_the_essential_spectrum() {
    let family = |growth_time: f64| weightless(20.0, growth_time, MEMORY);
    let found = onset(family, 2.0 * HOUR, 6.0 * HOUR).unwrap();
    assert!(found.essential);
    // The growth time follows from 1 + b(iω) = 0. The paper gives 3.5 h.
    assert_abs_diff_eq!(
        found.parameters[0] / HOUR,
        3.524_494_109_609_37,
        epsilon = 1e-9
    );
    assert_relative_eq!(found.period(), PERIOD, epsilon = 0.0, max_relative = 1e-9);
    let unstable = family(3.0 * HOUR).unwrap().unstable();
    assert!(
        matches!(unstable, Err(StabilityError::InfinitelyMany { abscissa }) if abscissa > 0.0),
        "{unstable:?}"
    );
}

/// Linearisation about the straight shape of a weightless shoot with proprioception only. The
/// growth time is in seconds.
fn weightless(eta: f64, growth_time: f64, memory: Memory) -> Result<Linearisation, StabilityError> {
    let shoot = Shoot::builder(YOUNG)
        .length(0.05)
        .radius(5e-4)
        .elements(2)
        .growth(Ongoing(UniformGrowth {
            zone_length: 0.07,
            time: growth_time,
        }))
        .tropism(Proprioception { sensitivity: eta }.remembered(memory))
        .scene(Still::weightless())
        .into_dyn()
        .build()?;
    Linearisation::about(&shoot)
}

#[test]
fn essential_spectrum_without_delay_is_the_root_of_a_quadratic() {
    // With τr = 0 the equation 1 + b = 0 is τg λ (1 + λ τm) + η = 0. Its roots are stable for any
    // growth time.
    let (eta, time) = (20.0, 720.0);
    for hours in [0.5, 3.0, 20.0] {
        let growth_time: f64 = hours * HOUR;
        let linear = weightless(eta, growth_time, Memory { time, delay: 0.0 }).unwrap();
        let root = linear.essential_spectrum().unwrap()[0];
        let expected = 0.5
            * (Complex::from(1.0 / (time * time) - 4.0 * eta / (growth_time * time)).sqrt()
                - 1.0 / time);
        // Newton's method has a relative error of 1e-13 for roots of about 1e-3/s.
        assert!(
            abs_diff_eq!(root.re, expected.re, epsilon = 1e-14),
            "{hours} h: {root} against {expected}"
        );
        assert!(
            abs_diff_eq!(root.im, expected.im.abs(), epsilon = 1e-14),
            "{hours} h: {root} against {expected}"
        );
        assert_eq!(linear.unstable().unwrap(), 0);
    }
}

#[test]
fn onset_of_negative_proprioception_is_at_zero_frequency() {
    // For η < 0 the curvature grows exponentially without oscillations.
    let family = |eta: f64| weightless(eta, 20.0 * HOUR, MEMORY);
    let found = onset(family, 5.0, -5.0).unwrap();
    // Near zero λ ≈ −η/τg. The search locates λ on the imaginary axis to within 1e-11 of the
    // slowest rate, 1/(720 s), so that |η| is at most 1e-9.
    assert!(found.essential);
    assert_abs_diff_eq!(found.parameters[0], 0.0, epsilon = 1e-8);
    assert_eq!((found.frequency, found.period()), (0.0, f64::INFINITY));
}

#[test]
fn rigid_shoot_with_gravitropism_alone_is_stable() {
    // The shoot is stable in the limit of infinite stiffness. For growth times of at least three
    // hours, tissue a million times stiffer than real tissue is rigid enough. Waves are amplified
    // by exp(2 β ℓ τm/(r τg)) along the shoot, so that its elasticity is not negligible for faster
    // growth.
    for hours in [3.0, 5.0, 10.0, 20.0, 40.0, 100.0, 1000.0] {
        for elements in [2, 3, 4, 8] {
            let mut stiff = YOUNG;
            stiff.youngs_modulus *= 1e6;
            let shoot = Shoot::builder(stiff)
                .length(0.065)
                .radius(5e-4)
                .elements(elements)
                .growth(Ongoing(UniformGrowth {
                    zone_length: 0.07,
                    time: hours * HOUR,
                }))
                .tropism(
                    Gravitropism {
                        sensitivity: 0.8,
                        perception: SettledStatoliths,
                    }
                    .remembered(MEMORY),
                )
                .load(Weight { density: 1000.0 })
                .into_dyn()
                .build()
                .unwrap();
            let linear = Linearisation::about(&shoot).unwrap();
            // The count includes only roots to the right of 1e-6/τm.
            assert_eq!(
                linear.unstable().unwrap(),
                0,
                "τg = {hours} h, {elements} elements"
            );
            assert!(matches!(
                linear.rightmost(),
                Err(StabilityError::NoIsolatedRoot)
            ));
        }
    }
}

#[test]
fn missing_onset_forcing_and_missing_stationary_state_are_reported() {
    let upright = |l| linearisation(l, 20.0 * HOUR, 0.8, 20.0, SettledStatoliths, 3);
    let error = onset(upright, 0.05, 0.06).unwrap_err();
    assert!(
        matches!(error, StabilityError::NoCrossing { unstable: [0, 0] }),
        "{error}"
    );
    assert!(matches!(
        onset(upright, f64::NAN, 0.06),
        Err(StabilityError::Parameter(_))
    ));
    // An upright shoot longer than Greenhill's length (7.93 cm) buckles.
    assert!(matches!(
        upright(0.08),
        Err(StabilityError::MechanicallyUnstable { negative: 2 })
    ));

    let shoot = |law: bool, tilt: f64| {
        let oscillator = law.then(|| Oscillator::new(0.2, 24.0 * MINUTE));
        let gravity = Gravitropism {
            sensitivity: 0.8,
            perception: SettledStatoliths,
        }
        .remembered(MEMORY);
        Shoot::builder(YOUNG)
            .length(0.05)
            .radius(5e-4)
            .elements(3)
            .growth(Ongoing(UniformGrowth {
                zone_length: 0.07,
                time: 20.0 * HOUR,
            }))
            .tropism((oscillator, gravity))
            .load(Weight { density: 1000.0 })
            .scene(Still::tilted(tilt))
            .into_dyn()
            .build()
            .unwrap()
    };
    let forced = Linearisation::about(&shoot(true, 0.0)).unwrap_err();
    // The gradient of the oscillator rotates on a circle of radius α/r = 400/m, where α = 0.2.
    assert!(
        matches!(forced, StabilityError::NotAutonomous { change } if change > 100.0 && change <= 800.0),
        "{forced}"
    );
    let mut tilted = shoot(false, 0.5);
    let before = tilted.state().clone();
    let none = solve_steady_state(&mut tilted).unwrap_err();
    assert_eq!(none, StabilityError::NoProprioception);
    assert_eq!(&before, tilted.state());
    let moving = Linearisation::about(&tilted).unwrap_err();
    assert!(
        matches!(moving, StabilityError::NotSteadyState { .. }),
        "{moving}"
    );
    let nothing = Shoot::builder(YOUNG)
        .length(0.05)
        .radius(5e-4)
        .into_dyn()
        .build()
        .unwrap();
    assert!(matches!(
        Linearisation::about(&nothing),
        Err(StabilityError::NothingDriven)
    ));
}
