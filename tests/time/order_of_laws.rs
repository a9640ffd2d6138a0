//! Order in time with light, memory kernels, localised differential growth and the stochastic
//! drive: as without them.

use crate::fixtures::shoots::{
    BETA, ETA, HOUR, MEMORY, MINUTE, STATOLITHS, elongating, order, righting, steering,
};
use crate::time::order_in_time::{LEAST, errors};
use morphorod::integrator::MethodOfSteps;
use morphorod::tropism::{
    AtApex, During, Gravitropism, Handedness, KernelTerm, Light, Localised, MemoryKernel,
    Oscillator, Phototropism, PointLight, Proprioception, RandomDrive, Response, SettledStatoliths,
    TropismLaw,
};
use morphorod::{DynLaws, Shoot};
use nalgebra::Vector3;

const HOURS: [f64; 3] = [HOUR, 2.0 * HOUR, 4.0 * HOUR];

/// Shoot of constant length that rights itself, with a further law.
fn with(law: impl TropismLaw + Send + Sync + 'static) -> Shoot<DynLaws> {
    righting()
        .elements(4)
        .tropism((steering(SettledStatoliths), law))
        .into_dyn()
        .build()
        .unwrap()
}

fn assert_order(name: &str, shoot: impl Fn() -> Shoot<DynLaws>, steps: [f64; 4], fine: f64) {
    let found = errors(shoot, MethodOfSteps::new, &HOURS, steps, fine);
    let slope = order(&found);
    println!("{name}: {slope:.2} {found:?}");
    assert!(slope >= LEAST, "{name}: order {slope:.2}, errors {found:?}");
    // Errors near rounding would have a meaningless slope.
    assert!(found[3] > 1e-11, "{name}: {found:?}");
}

const STEPS: [f64; 4] = [180.0, 90.0, 45.0, 22.5];

#[test]
fn light_that_moves_and_is_switched_keeps_fourth_order() {
    let moving = |t: f64, position: &Vector3<f64>| {
        let (sin, cos) = (t / 2000.0).sin_cos();
        let lamp = PointLight {
            position: Vector3::new(0.3 * cos, 0.3 * sin, 0.2),
            power: 2.0,
        };
        morphorod::tropism::LightSource::light(&lamp, t, position)
    };
    // Neither time is a multiple of a step.
    let source = During {
        source: moving,
        from: 1234.5,
        until: 6543.2,
    };
    let light = Light {
        source,
        strength: |irradiance: f64| irradiance / (irradiance + 1.0),
    };
    let law = Phototropism {
        sensitivity: BETA,
        perception: light,
    }
    .remembered(MEMORY);
    assert_order("light", || with(law), STEPS, 4.5);
    let law = Phototropism {
        sensitivity: BETA,
        perception: AtApex(light),
    }
    .remembered(MEMORY);
    assert_order("light at the apex", || with(law), STEPS, 4.5);
}

#[test]
fn memory_kernels_keep_fourth_order() {
    let oscillation = KernelTerm {
        amplitude: 1.2e-3,
        time: 30.0 * MINUTE,
        frequency: 1.5e-3,
        phase: -0.8,
    };
    let kernel = MemoryKernel {
        terms: vec![KernelTerm::decay(4e-4, 600.0), oscillation],
        delay: 700.0,
    };
    let laws = || Proprioception { sensitivity: ETA }.filtered(kernel.clone());
    let settled = || {
        Gravitropism {
            sensitivity: BETA,
            perception: SettledStatoliths,
        }
        .filtered(kernel.clone())
    };
    let make = || {
        righting()
            .elements(4)
            .tropism((settled(), laws()))
            .into_dyn()
            .build()
            .unwrap()
    };
    assert_order("kernel", make, [360.0, 180.0, 90.0, 45.0], 6.0);
    let slow = || {
        Gravitropism {
            sensitivity: BETA,
            perception: STATOLITHS,
        }
        .filtered(kernel.clone())
    };
    let make = || {
        righting()
            .elements(4)
            .tropism((slow(), laws()))
            .into_dyn()
            .build()
            .unwrap()
    };
    assert_order(
        "kernel of statoliths",
        make,
        [360.0, 180.0, 90.0, 45.0],
        6.0,
    );
}

#[test]
fn localised_growth_keeps_fourth_order_while_tissue_passes_its_edges() {
    let forwards = Oscillator::new(0.3, 40.0 * MINUTE);
    let backwards = Oscillator {
        handedness: Handedness::Clockwise,
        ..forwards
    };
    let law = Localised {
        law: (forwards, backwards),
        from: 8e-3,
        to: 16e-3,
        edge: 4e-3,
    };
    let make = || {
        elongating(0.03, 0.02, 5.0 * HOUR)
            .elements(8)
            .merge_tolerance(1e-8)
            .tropism((steering(SettledStatoliths), law))
            .into_dyn()
            .build()
            .unwrap()
    };
    assert_order("localised", make, STEPS, 4.5);
}

#[test]
fn stochastic_drive_keeps_fourth_order() {
    let law = RandomDrive {
        sensitivity: 0.3,
        correlation_time: 1440.0,
        seed: 3,
    };
    assert_order("random", || with(law), [90.0, 45.0, 22.5, 11.25], 2.5);
}
