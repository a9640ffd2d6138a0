//! Where the upright shoot begins to oscillate, against the linear theory of Agostinelli, DeSimone and Noselli (2021),
//! section 3.1: EI [(1 + b) θ'' + a θ'] + q (ℓ − s) θ = 0, solved to ten digits by other codes.

use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::load::Weight;
use morphorod::stability::{Linearisation, StabilityError, StationarySolver, Unstable, onset};
use morphorod::tropism::{Gravitropism, Memory, Oscillator, Proprioception, Response, SettledStatoliths, Statoliths};
use morphorod::{Shoot, Still};

use nalgebra::Complex;

use crate::fixtures::upright::{HOUR, MEMORY, MINUTE, YOUNG, linear_problem};

/// Equal kernels, τm = τr = 12 min: onset at x tan x = 1 with x = ωτr, whatever the length and the growth time.
const PERIOD: f64 = 87.638_358_711_642_3 * MINUTE;

#[test]
fn length_and_period_at_onset_are_those_of_the_linear_theory() {
    // τg (h), η, length (m) and its range. The lengths are printed as 6.56 and 7.24 cm in the paper.
    let cases = [
        (20.0, 20.0, 0.065_614_866_491, [0.060, 0.070]),
        (40.0, 20.0, 0.072_407_759_341, [0.066, 0.077]),
        (10.0, 20.0, 0.052_368_383_610, [0.045, 0.060]),
        (20.0, 0.0, 0.071_003_931_291, [0.064, 0.075]),
    ];
    for (hours, eta, length, [from, to]) in cases {
        let found = onset(|l| linear_problem(l, hours * HOUR, 0.8, eta, SettledStatoliths, 4), from, to).unwrap();
        // Promised are seven digits; four elements of order eight and differences of 1e-9 leave 1e-9.
        assert!((found.parameter / length - 1.0).abs() < 1e-8, "{hours} h, η = {eta}: {found:?}");
        assert!((found.period() / PERIOD - 1.0).abs() < 1e-8, "{hours} h, η = {eta}: {found:?}");
        assert!(!found.essential);
    }
}

#[test]
fn slow_statoliths_bring_the_onset_forward() {
    let statoliths = Statoliths { avalanche_time: 2.0 * MINUTE };
    let found = onset(|l| linear_problem(l, 20.0 * HOUR, 0.8, 20.0, statoliths, 4), 0.06, 0.07).unwrap();
    // Ten and nine digits are known of length and period.
    assert!((found.parameter / 0.064_595_221_175 - 1.0).abs() < 1e-8, "{found:?}");
    assert!((found.period() / (92.769_230_7 * MINUTE) - 1.0).abs() < 1e-8, "{found:?}");
}

#[test]
fn the_length_at_onset_converges_at_the_order_of_the_shape_at_least() {
    let error = |elements| {
        let family = |l| linear_problem(l, 20.0 * HOUR, 0.8, 20.0, SettledStatoliths, elements);
        (onset(family, 0.06, 0.07).unwrap().parameter / 0.065_614_866_491 - 1.0).abs()
    };
    // Coarse meshes, whose errors (1e-5 to 1e-9) are far above the 1e-10 of the differences that make the matrix.
    let (one, three) = (error(1), error(3));
    let order = (one / three).ln() / 3.0_f64.ln();
    assert!(order > 7.5, "observed order {order}: errors {one:e} and {three:e}");
}

#[test]
fn in_microgravity_all_waves_begin_to_oscillate_at_once() {
    let family = |growth_time: f64| weightless(20.0, growth_time, MEMORY);
    let found = onset(family, 2.0 * HOUR, 6.0 * HOUR).unwrap();
    assert!(found.essential);
    // The root of 1 + b(iω) = 0; the paper prints 3.5 h.
    assert!((found.parameter / HOUR - 3.524_494_109_609_37).abs() < 1e-9, "{}", found.parameter / HOUR);
    assert!((found.period() / PERIOD - 1.0).abs() < 1e-9);
    assert!(
        matches!(family(3.0 * HOUR).unwrap().unstable().unwrap(), Unstable::Infinite { abscissa } if abscissa > 0.0)
    );
}

/// A weightless shoot that senses its bending only.
fn weightless(eta: f64, growth_time: f64, memory: Memory) -> Result<Linearisation, StabilityError> {
    let shoot = Shoot::builder(YOUNG)
        .length(0.05)
        .radius(5e-4)
        .elements(2)
        .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: growth_time }))
        .tropism(Proprioception { sensitivity: eta }.remembered(memory))
        .scene(Still::weightless())
        .into_dyn()
        .build()?;
    Linearisation::about(&shoot)
}

#[test]
fn without_delay_the_essential_spectrum_is_that_of_a_quadratic() {
    // 1 + b = 0 with τr = 0 is τg λ (1 + λ τm) + η = 0: stable at any growth time.
    let (eta, time) = (20.0, 720.0);
    for hours in [0.5, 3.0, 20.0] {
        let growth_time: f64 = hours * HOUR;
        let linear = weightless(eta, growth_time, Memory { time, delay: 0.0 }).unwrap();
        let root = linear.essential_spectrum().unwrap()[0];
        let expected =
            0.5 * (Complex::from(1.0 / (time * time) - 4.0 * eta / (growth_time * time)).sqrt() - 1.0 / time);
        // The law's own derivatives are exact; Newton's method leaves 1e-13 of a root of 1e-3/s.
        assert!((root.re - expected.re).abs() < 1e-14 && (root.im - expected.im.abs()).abs() < 1e-14, "{root}");
        assert_eq!(linear.unstable().unwrap(), Unstable::Finite(0));
    }
}

#[test]
fn a_crossing_at_zero_has_no_frequency() {
    // A shoot that bends further when it is bent (η < 0) is unstable without a swing.
    let family = |eta: f64| weightless(eta, 20.0 * HOUR, MEMORY);
    let found = onset(family, 5.0, -5.0).unwrap();
    // λ ≈ −η/τg next to zero, and it is on the axis to 1e-11 of the slowest rate, 1/720 s: |η| < 1e-9.
    assert!(found.essential && found.parameter.abs() < 1e-8, "{found:?}");
    assert_eq!((found.frequency, found.period()), (0.0, f64::INFINITY));
}

#[test]
fn a_rigid_shoot_with_gravitropism_alone_is_always_stable() {
    // Stable in the limit of any stiffness. A million times stiffer than real tissue is as good as rigid from three
    // hours on; faster growth amplifies waves by exp(2 β ℓ τm/(r τg)) along the shoot, and the rest of its elasticity tells.
    for hours in [3.0, 5.0, 10.0, 20.0, 40.0, 100.0, 1000.0] {
        for elements in [2, 3, 4, 8] {
            let mut stiff = YOUNG;
            stiff.youngs_modulus *= 1e6;
            let shoot = Shoot::builder(stiff)
                .length(0.065)
                .radius(5e-4)
                .elements(elements)
                .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: hours * HOUR }))
                .tropism(Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(MEMORY))
                .load(Weight { density: 1000.0 })
                .into_dyn()
                .build()
                .unwrap();
            let linear = Linearisation::about(&shoot).unwrap();
            // Counted right of 1e-6/τm.
            assert_eq!(linear.unstable().unwrap(), Unstable::Finite(0), "τg = {hours} h, {elements} elements");
            assert!(matches!(linear.rightmost(), Err(StabilityError::NoIsolatedRoot)));
        }
    }
}

#[test]
fn ranges_and_laws_without_an_onset_are_told() {
    let upright = |l| linear_problem(l, 20.0 * HOUR, 0.8, 20.0, SettledStatoliths, 3);
    let error = onset(upright, 0.05, 0.06).unwrap_err();
    assert!(matches!(error, StabilityError::NoCrossing { unstable_from: 0, unstable_to: 0, .. }), "{error}");
    assert!(matches!(onset(upright, f64::NAN, 0.06), Err(StabilityError::Parameter(_))));
    // Past Greenhill's length (7.93 cm) an upright shoot falls before it oscillates.
    assert!(matches!(upright(0.08), Err(StabilityError::MechanicallyUnstable { negative: 2 })));

    let shoot = |law: bool, tilt: f64| {
        let oscillator = law.then(|| Oscillator::new(0.2, 24.0 * MINUTE));
        let gravity = Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(MEMORY);
        Shoot::builder(YOUNG)
            .length(0.05)
            .radius(5e-4)
            .elements(3)
            .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 20.0 * HOUR }))
            .tropism((oscillator, gravity))
            .load(Weight { density: 1000.0 })
            .scene(Still::tilted(tilt))
            .into_dyn()
            .build()
            .unwrap()
    };
    let forced = Linearisation::about(&shoot(true, 0.0)).unwrap_err();
    // The oscillator's gradient turns on a circle of radius α/r = 400/m.
    assert!(matches!(forced, StabilityError::Forced { change } if change > 100.0 && change <= 800.0), "{forced}");
    let mut tilted = shoot(false, 0.5);
    let before = tilted.state().clone();
    let none = StationarySolver::default().solve(&mut tilted).unwrap_err();
    assert!(matches!(none, StabilityError::Unresolved { .. } | StabilityError::NoStationaryState { .. }), "{none}");
    assert_eq!(&before, tilted.state());
    let moving = Linearisation::about(&tilted).unwrap_err();
    assert!(matches!(moving, StabilityError::NotStationary { .. }), "{moving}");
    let nothing = Shoot::builder(YOUNG).length(0.05).radius(5e-4).into_dyn().build().unwrap();
    assert!(matches!(Linearisation::about(&nothing), Err(StabilityError::NothingDriven)));
}
