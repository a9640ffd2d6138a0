//! Expected standard errors of several experiments. The program fits exact data, and assumes the
//! noise of a camera.

use morphorod_plot::println;
use std::error::Error;
use std::f64::consts::FRAC_PI_2;

use morphorod::fit::{Fit, Parameter, Verdict};
use morphorod::tropism::{Handedness, Memory};

use super::plants::{Draw, PARAMETERS, Plant, Seen};

/// Time from one frame to the next, s.
const INTERVAL: f64 = 300.0;

/// Time step, s.
const STEP: f64 = 100.0;

/// An experiment.
struct Case {
    name: &'static str,
    plant: Plant,
    /// Values that differ from [`PARAMETERS`].
    values: &'static [(&'static str, f64)],
    /// Names of the free parameters.
    free: &'static [&'static str],
    /// Duration, h.
    hours: f64,
    /// Part of the shoot that the camera shows.
    seen: Seen,
    /// Whether the scale of the camera is free.
    scale: bool,
}

/// Horizontal shoot of constant length.
const RIGHTING: Plant = Plant {
    constant: true,
    mature_modulus: None,
    proprioceptive: None,
    handedness: Handedness::Counterclockwise,
};

/// Upright growing shoot.
const GROWING: Plant = Plant {
    constant: false,
    ..RIGHTING
};

/// Shoot of video 2, whose mature tissue and proprioceptive memory are known.
const VIDEO: Plant = Plant {
    mature_modulus: Some(2e9),
    proprioceptive: Some(Memory {
        time: 720.0,
        delay: 720.0,
    }),
    ..GROWING
};

/// Upright shoot below the onset of circumnutation, whose laws have different memory times.
const SHORT: Plant = Plant {
    constant: true,
    proprioceptive: Some(Memory {
        time: 1200.0,
        delay: 720.0,
    }),
    ..GROWING
};

/// Values of the righting shoot.
const RIGHTING_VALUES: &[(&str, f64)] = &[("l_0", 0.05), ("tau_g", 72e3), ("tilt", FRAC_PI_2)];

/// Values of the upright shoot below the onset.
const SHORT_VALUES: &[(&str, f64)] = &[
    ("l_0", 0.05),
    ("tau_g", 72e3),
    ("push_x", 2e-6),
    ("push_y", 1e-6),
];

/// Values of a shoot that begins to circumnutate from an angle of 0.4°. The push is too small to
/// determine lengths.
const TILTED: &[(&str, f64)] = &[("tilt", 0.0075), ("push_x", 4e-8), ("push_y", 2e-8)];

/// Values of an upright growing shoot with an oscillator and an initial push.
const PUSHED: &[(&str, f64)] = &[("alpha", 0.2), ("push_x", 4e-6), ("push_y", 2e-6)];

/// Free parameters of the righting shoot.
const SIX: &[&str] = &["beta", "eta", "tau_m", "tau_r", "E", "l_0"];

/// Free parameters of a growing shoot.
const EIGHT: &[&str] = &["beta", "eta", "tau_m", "tau_r", "tau_g", "l_g", "E", "l_0"];

/// Free parameters of a growing shoot with an internal oscillator.
const NINE: &[&str] = &[
    "beta", "eta", "tau_m", "tau_r", "tau_g", "l_g", "alpha", "E", "l_0",
];

/// Experiments in the order of the table.
fn cases() -> Vec<Case> {
    let case = |name, plant, values, free, hours, seen| Case {
        name,
        plant,
        values,
        free,
        hours,
        seen,
        scale: false,
    };
    let righting = |name, free, seen| case(name, RIGHTING, RIGHTING_VALUES, free, 6.0, seen);
    let growing = |name, seen| case(name, VIDEO, &[("alpha", 0.2)], NINE, 10.0, seen);
    let free = case(
        "the same, camera scale free",
        GROWING,
        TILTED,
        EIGHT,
        20.0,
        Seen::Above,
    );
    vec![
        righting("righting 6 h, centre lines", SIX, Seen::Lines),
        righting("the same, tip", SIX, Seen::Tip),
        righting(
            "the same, centre lines, tau_g free",
            &["beta", "eta", "tau_m", "tau_r", "tau_g", "E", "l_0"],
            Seen::Lines,
        ),
        growing("growing with oscillator 10 h, centre lines", Seen::Lines),
        growing("the same, tip", Seen::Tip),
        growing("the same, tip from above", Seen::Above),
        case(
            "circumnutation 20 h, from above",
            GROWING,
            TILTED,
            EIGHT,
            20.0,
            Seen::Above,
        ),
        Case {
            scale: true,
            ..free
        },
        case(
            "with oscillator 20 h, from above",
            GROWING,
            PUSHED,
            NINE,
            20.0,
            Seen::Above,
        ),
        case(
            "upright 5 cm below onset 10 h, tip",
            SHORT,
            SHORT_VALUES,
            &["beta", "eta", "tau_m", "tau_r"],
            10.0,
            Seen::Tip,
        ),
    ]
}

/// Prints the standard errors of all cases for a noise of each coordinate (m).
pub fn print(noise: f64) -> Result<(), Box<dyn Error>> {
    let mm = 1e3 * noise;
    println!(
        "Standard errors in per cent (! structurally, ? practically not identifiable); {mm} mm, a frame every 5 min"
    );
    for case in cases() {
        let value = |(name, value, _): &(&str, f64, f64)| {
            case.values
                .iter()
                .find(|(other, _)| other == name)
                .map_or(*value, |(_, value)| *value)
        };
        let values: Vec<f64> = PARAMETERS.iter().map(value).collect();
        let setting = [case.hours, INTERVAL, STEP];
        let data = case
            .plant
            .measured(&values, setting, case.seen, 0.0, &mut Draw::new(0))?
            .with_noise(noise);
        let (data, more) = if case.scale {
            (
                data.with_scale("scale"),
                vec![Parameter::positive("scale", [0.2, 5.0])],
            )
        } else {
            (data, vec![])
        };
        let fit = Fit {
            step: STEP,
            starts: 1,
            windows: vec![1.0],
            ..Fit::default()
        };
        let found = fit.run(&case.plant.family(&values, case.free, 1.0, more), &[data])?;
        let mut line = format!("{:<44}", case.name);
        for estimate in found
            .parameters
            .iter()
            .filter(|estimate| estimate.verdict != Verdict::Fixed)
        {
            let unit = if estimate.relative {
                1.0
            } else {
                estimate.value.abs()
            };
            let error = 100.0 * estimate.error / unit;
            line += &match estimate.verdict {
                Verdict::StructurallyNot => format!("  {} !", estimate.name),
                Verdict::PracticallyNot => format!("  {} {error:.2}?", estimate.name),
                _ => format!("  {} {error:.2}", estimate.name),
            };
        }
        println!("{line}");
    }
    Ok(())
}
