//! Critical length of the upright shoot against delay and memory of proprioception (Agostinelli,
//! DeSimone and Noselli 2021, section 3.1, case 3), and the critical growth time in microgravity.
//!
//! The reference values are independent of this crate: with x = ℓ − s and c = a/(1 + b), the power
//! series in x of the solution of θ'' − c θ' + q x θ/(EI (1 + b)) = 0 with θ(0) = 1, θ'(0) = c is
//! zero at x = ℓ for λ = iω. Newton's method for ω and ℓ was run with 30 digits in mpmath. The
//! initial guesses are the smallest lengths at which a count by the argument principle on the same
//! series is not zero.

use morphorod::stability::{Linearisation, Refinement, StabilityError};
use morphorod::tropism::Memory;
use morphorod::{ShootParameters, Still};

use approx::assert_relative_eq;

use crate::fixtures::upright::{HOUR, MINUTE};

/// Parameters with a growth time of 20 h, and a delay and a memory of proprioception (s).
fn with_memory(delay: f64, time: f64) -> ShootParameters {
    ShootParameters {
        growth_time: 20.0 * HOUR,
        proprioceptive_memory: Memory { time, delay },
        ..ShootParameters::default()
    }
}

/// Linearisation of the upright shoot of constant length (m).
fn upright(
    parameters: ShootParameters,
    length: f64,
    elements: usize,
) -> Result<Linearisation, StabilityError> {
    let parameters = ShootParameters {
        length,
        ..parameters
    };
    Linearisation::about(&parameters.reduced().elements(elements).into_dyn().build()?)
}

/// Critical length without proprioception, m.
const WITHOUT: f64 = 0.071_003_931_290_963_9;

#[test]
fn critical_length_depends_on_delay_and_memory_of_proprioception() {
    // Delay and memory (s), critical length (m), and period (min).
    let cases = [
        (60.0, 60.0, 0.078_968_926_289_197_7, 6.410_887_234_37),
        (240.0, 240.0, 0.072_492_275_829_724, 57.807_313_92),
        (360.0, 360.0, 0.070_033_319_003_467_3, 66.430_350_328),
        (1500.0, 1500.0, 0.063_286_827_118_163_8, 119.503_541_15),
        (3000.0, 3000.0, 0.046_453_677_788_029_4, 349.210_133_536),
        (300.0, 720.0, 0.068_962_256_807_744_3, 74.218_086_753_1),
        (3000.0, 720.0, 0.053_410_094_438_292_2, 174.186_355_016),
        (720.0, 300.0, 0.066_803_879_791_698_4, 76.840_910_614_8),
        (720.0, 3000.0, 0.068_033_247_233_329_8, 96.543_852_480_4),
    ];
    for (delay, time, length, period) in cases {
        let parameters = with_memory(delay, time);
        // No root is unstable at shorter lengths, so that this onset is the first.
        for part in 1..8 {
            let shorter = length * f64::from(part) / 8.0;
            let unstable = upright(parameters, shorter, 8).unwrap().unstable();
            assert_eq!(
                unstable,
                Ok(0),
                "τ̄r = {delay} s, τ̄m = {time} s, {shorter} m"
            );
        }
        let found = Refinement::to(1e-8)
            .onset(
                |length, elements| upright(parameters, length, elements),
                0.9 * length,
                1.004 * length,
            )
            .unwrap();
        // The tolerance of the refinement is 1e-8. The largest measured error is 3e-9.
        assert_relative_eq!(
            found.parameters[0],
            length,
            epsilon = 0.0,
            max_relative = 2e-8
        );
        assert_relative_eq!(
            found.period(),
            period * MINUTE,
            epsilon = 0.0,
            max_relative = 2e-8
        );
    }
}

#[test]
fn short_delay_and_memory_of_proprioception_increase_the_critical_length() {
    // Time (s) at which the critical length is that without proprioception, both times equal or
    // delay alone, and period there (min).
    let both: fn(f64) -> ShootParameters = |time| with_memory(time, time);
    let delay_alone: fn(f64) -> ShootParameters = |delay| with_memory(delay, 720.0);
    let cases = [
        (both, 308.594_079_299_87, 62.880_174_29),
        (delay_alone, 69.828_677_512_848, 67.597_544_49),
    ];
    for (parameters, time, period) in cases {
        let family = |time, elements| upright(parameters(time), WITHOUT, elements);
        let found = Refinement::to(1e-8)
            .onset(family, 0.9 * time, 1.1 * time)
            .unwrap();
        // The tolerance of the refinement is 1e-8. The largest measured error is 3e-9.
        assert_relative_eq!(
            found.parameters[0],
            time,
            epsilon = 0.0,
            max_relative = 2e-8
        );
        assert_relative_eq!(
            found.period(),
            period * MINUTE,
            epsilon = 0.0,
            max_relative = 2e-8
        );
        // At this length, shorter times are stable. At longer ones a pair of conjugate roots is
        // unstable in each of two planes.
        let unstable = |factor: f64| family(factor * time, 8).unwrap().unstable();
        assert_eq!(unstable(0.99), Ok(0));
        assert_eq!(unstable(1.01), Ok(4));
    }
}

#[test]
fn critical_growth_time_in_microgravity_does_not_depend_on_the_length() {
    for length in [0.01, 0.02, 0.03, 0.05, 0.07, 0.10, 0.15, 0.20] {
        let family = |growth_time: f64, elements| {
            let parameters = ShootParameters {
                length,
                growth_time,
                gravitropic_sensitivity: 0.0,
                ..ShootParameters::default()
            };
            let shoot = parameters
                .reduced()
                .elements(elements)
                .scene(Still::weightless())
                .into_dyn()
                .build()?;
            Linearisation::about(&shoot)
        };
        let found = Refinement::to(1e-8)
            .onset(family, 2.0 * HOUR, 6.0 * HOUR)
            .unwrap();
        assert!(found.essential, "{length} m");
        // The growth time follows from 1 + b(iω) = 0. The essential spectrum does not depend on the
        // mesh, and the search for the axis has a relative error below 1e-9.
        assert_relative_eq!(
            found.parameters[0],
            3.524_494_109_609_37 * HOUR,
            epsilon = 0.0,
            max_relative = 1e-8
        );
    }
}
