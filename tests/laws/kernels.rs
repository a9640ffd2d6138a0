//! Memory kernels: exact responses, fits, and their stability.

use std::f64::consts::PI;

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{
    BETA, ETA, HOUR, MEMORY, MINUTE, STATOLITHS, reduced, righting, steering,
};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::cycle::RotatingWaveSolver;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::stability::{Linearisation, onset};
use morphorod::tropism::{
    AtApex, Declaration, Filtered, Gravitropism, Growing, KernelTerm, Light, Localised,
    MemoryKernel, Phototropism, PointLight, Proprioception, RandomDrive, Response,
    SettledStatoliths, TropismLaw, Variable,
};
use morphorod::{DynLaws, Shoot, Still};
use nalgebra::{Complex, Vector3};

/// Kernel with a negative lobe and an integral of one: a decay, and a damped oscillation with a
/// period of 100 min.
fn lobed() -> MemoryKernel {
    let mut terms = vec![
        KernelTerm {
            amplitude: 2e-3,
            time: 20.0 * MINUTE,
            frequency: 2.0 * PI / (100.0 * MINUTE),
            phase: -0.9,
        },
        KernelTerm::decay(-0.5e-3, 6.0 * MINUTE),
    ];
    let integral = MemoryKernel {
        terms: terms.clone(),
        delay: 0.0,
    }
    .integral();
    terms.iter_mut().for_each(|term| term.amplitude /= integral);
    MemoryKernel {
        terms,
        delay: 10.0 * MINUTE,
    }
}

/// Gravitropism and proprioception that a kernel filters.
fn filtered(kernel: &MemoryKernel) -> (Filtered<Gravitropism>, Filtered<Proprioception>) {
    (
        Gravitropism {
            sensitivity: BETA,
            perception: SettledStatoliths,
        }
        .filtered(kernel.clone()),
        Proprioception { sensitivity: ETA }.filtered(kernel.clone()),
    )
}

#[test]
fn kernel_of_an_exponential_memory_gives_the_same_shoot() {
    let kernel = MemoryKernel::from(MEMORY);
    let tip = |mut shoot: Shoot<DynLaws>| {
        MethodOfSteps::new(180.0)
            .advance(&mut shoot, 3.0 * HOUR)
            .unwrap();
        shoot.tip()
    };
    let one = tip(righting()
        .tropism(steering(SettledStatoliths))
        .into_dyn()
        .build()
        .unwrap());
    let other = tip(righting()
        .tropism(filtered(&kernel))
        .into_dyn()
        .build()
        .unwrap());
    // The weight a τ may differ from one by rounding.
    assert_abs_diff_eq!(InNorm(one), InNorm(other), epsilon = 1e-15);
    assert_relative_eq!(kernel.integral(), 1.0, epsilon = 0.0, max_relative = 1e-15);
}

#[test]
fn laws_of_light_memory_and_place_agree_with_their_declarations() {
    let lamp = PointLight {
        position: Vector3::new(0.4, 0.3, 0.5),
        power: 2.0,
    };
    let light = Light {
        source: lamp,
        strength: |irradiance: f64| irradiance / (1.0 + irradiance),
    };
    let laws = (
        Gravitropism {
            sensitivity: BETA,
            perception: STATOLITHS,
        }
        .filtered(lobed()),
        Localised {
            law: Proprioception { sensitivity: ETA }.filtered(lobed()),
            from: 0.0,
            to: 0.02,
            edge: 0.01,
        },
        Phototropism {
            sensitivity: BETA,
            perception: light,
        }
        .filtered(lobed()),
        Phototropism {
            sensitivity: BETA,
            perception: AtApex(light),
        }
        .remembered(MEMORY),
        RandomDrive {
            sensitivity: 0.1,
            correlation_time: 600.0,
            seed: 1,
        },
    );
    let shoot = righting()
        .tropism(laws)
        .scene(Still::tilted(0.8))
        .into_dyn()
        .build()
        .unwrap();
    shoot.check_laws().unwrap();
}

#[test]
fn integral_of_a_kernel_is_that_of_its_values() {
    let kernel = MemoryKernel {
        delay: 0.0,
        ..lobed()
    };
    // Simpson's rule over 50 decay times, with an error of (h/τ)⁴/180.
    let (n, span) = (60_000, 50.0 * 20.0 * MINUTE);
    let h = span / f64::from(n);
    let weight = |i: i32| {
        if i == 0 || i == n {
            1.0
        } else {
            2.0 + 2.0 * f64::from(i % 2)
        }
    };
    let sum: f64 = (0..=n)
        .map(|i| weight(i) * kernel.at(f64::from(i) * h))
        .sum::<f64>()
        * h
        / 3.0;
    assert_relative_eq!(kernel.integral(), sum, epsilon = 0.0, max_relative = 1e-9);
    assert_relative_eq!(sum, 1.0, epsilon = 0.0, max_relative = 1e-9);
}

#[test]
fn oscillating_memory_is_exact_for_steps_of_any_length() {
    let (tau, frequency) = (90.0, 0.03);
    // The weak response does not move the shoot, so that the stimulus is constant.
    let term = KernelTerm {
        amplitude: 1.0 / tau,
        time: tau,
        frequency,
        phase: 0.0,
    };
    let kernel = MemoryKernel {
        terms: vec![term],
        delay: 0.0,
    };
    let law = Gravitropism {
        sensitivity: 1e-13,
        perception: SettledStatoliths,
    }
    .filtered(kernel);
    let tilt = 0.7_f64;
    for step in [10.0, 300.0, 5000.0] {
        let shoot = righting()
            .tropism(law.clone())
            .load(())
            .scene(Still::tilted(tilt));
        let mut shoot = shoot.into_dyn().build().unwrap();
        MethodOfSteps::new(step).advance(&mut shoot, step).unwrap();
        // ż = (x − z)/τ + iωz with x = h1 = −sin(tilt).
        let rate = Complex::new(-1.0 / tau, frequency);
        let z = Complex::from(-tilt.sin()) * ((rate * step).exp() - 1.0) / (rate * tau);
        // Steps of 1/64 and more lead up to this time, each with a rounding error.
        let y = shoot.state().variables(5).unwrap();
        assert_abs_diff_eq!(y[..4], [z.re, 0.0, z.im, 0.0], epsilon = 1e-13);
    }
}

/// A kernel from the literature: its name, K(t) in any unit, the time until which it is sampled
/// (s).
type Known = (&'static str, fn(f64) -> f64, f64);

/// Gamma distribution of shape k + 1 and time t in units of its scale.
fn gamma(k: i32, t: f64) -> f64 {
    t.powi(k) * (-t).exp() / (1..=k).map(f64::from).product::<f64>()
}

const KNOWN: [Known; 5] = [
    // Statoliths of 2 min and a memory of 13 min in a row (Chauvet and others, J. Exp. Bot.
    // 70:1955, 2019).
    (
        "cascade",
        |t| (-t / 780.0).exp() - (-t / 120.0).exp(),
        8000.0,
    ),
    // Gamma distribution of delays, of shape 5.
    ("gamma", |t| gamma(4, t / 600.0), 15_000.0),
    // Positive and later negative lobe, as measured for wheat coleoptiles by Rivière and Meroz
    // (PNAS 120:e2306655120, 2023).
    (
        "lobes",
        |t| gamma(2, t / 300.0) - 0.6 * gamma(5, t / 500.0),
        15_000.0,
    ),
    // Adaptation with a zero integral, as of bacterial chemotaxis (Clark and Grant, PNAS 102:9150,
    // 2005).
    (
        "adaptation",
        |t| (t / 300.0 - 0.5 * (t / 300.0).powi(2)) * (-t / 300.0).exp(),
        6000.0,
    ),
    // Damped oscillation that begins smoothly.
    (
        "oscillation",
        |t| (1.0 - (-t / 600.0).exp()).powi(3) * (-t / 3000.0).exp() * (t / 1500.0).cos(),
        30_000.0,
    ),
];

#[test]
fn five_kernels_are_fitted_to_a_thousandth_by_at_most_six_exponentials() {
    for (name, kernel, span) in KNOWN {
        let samples = 400;
        let spacing = span / f64::from(samples);
        let values: Vec<f64> = (0..=samples)
            .map(|i| kernel(f64::from(i) * spacing))
            .collect();
        let (fit, error) = MemoryKernel::fit(&values, spacing, 6).unwrap();
        let exponentials: usize = fit
            .terms
            .iter()
            .map(|term| if term.frequency > 0.0 { 2 } else { 1 })
            .sum();
        let largest = values
            .iter()
            .fold(0.0, |largest: f64, value| largest.max(value.abs()));
        let between = |i: i32| {
            let t = f64::from(i) * 0.1 * spacing;
            (fit.at(t) - kernel(t)).abs() / largest
        };
        let found = (0..=10 * samples).map(between).fold(0.0, f64::max);
        println!(
            "{name}: {} terms, {exponentials} exponentials, stated error {error:.1e}, found {found:.1e}",
            fit.terms.len()
        );
        assert!(exponentials <= 6 && error < 1e-3, "{name}: {error:e}");
        // The error at ten times as many times.
        assert!(
            found < 1e-3 && found < 2.0 * error + 1e-12,
            "{name}: {found:e}, stated {error:e}"
        );
    }
}

#[test]
fn exponentials_are_recovered_and_bad_values_are_refused() {
    let kernel = MemoryKernel {
        delay: 0.0,
        ..lobed()
    };
    let values: Vec<f64> = (0..200).map(|i| kernel.at(60.0 * f64::from(i))).collect();
    let (fit, error) = MemoryKernel::fit(&values, 60.0, 3).unwrap();
    assert!(error < 1e-10, "{error:e}");
    let mut found = fit.terms.clone();
    found.sort_by(|a, b| b.frequency.total_cmp(&a.frequency));
    for (found, expected) in found.iter().zip(&kernel.terms) {
        let numbers = |term: &KernelTerm| {
            // An amplitude of either sign is that of a phase that differs by π.
            let z = Complex::from_polar(term.amplitude, term.phase);
            [
                1e3 * z.re,
                1e3 * z.im,
                term.time / HOUR,
                term.frequency * HOUR,
            ]
        };
        // Rounding of the values, times the condition of the fit.
        assert_abs_diff_eq!(numbers(found)[..], numbers(expected)[..], epsilon = 1e-8);
    }
    // Squares of these values overflow, and a rule that ignored NaN would state the error zero.
    let large: Vec<f64> = values.iter().map(|value| 1e303 * value).collect();
    assert!(MemoryKernel::fit(&large, 60.0, 3).unwrap().1 < 1e-10);
    let alternating: Vec<f64> = (0..82)
        .map(|i| if i % 2 == 0 { 1e300 } else { -1e300 })
        .collect();
    // The values between the fitted ones have the other sign.
    let (kernel, error) = MemoryKernel::fit(&alternating, 60.0, 6).unwrap();
    assert!(kernel.check().is_ok() && error > 1.0, "{error}");
    // An unlimited QR iteration for the eigenvalues of this fit does not end.
    let ones = [1, 3, 10, 11, 14, 17, 21];
    let jumps: Vec<f64> = (0..24)
        .map(|i| f64::from(u8::from(ones.contains(&i))))
        .collect();
    let answer = MemoryKernel::fit(&jumps, 1.0, 5);
    assert!(answer.is_ok_and(|(kernel, error)| kernel.check().is_ok() && error.is_finite()));
    let refused = |values: &[f64], spacing: f64, most: usize| {
        MemoryKernel::fit(values, spacing, most)
            .unwrap_err()
            .to_string()
    };
    assert!(refused(&values, 0.0, 3).contains("spacing"));
    assert!(refused(&values, 60.0, 0).contains("exponentials"));
    assert!(refused(&values[..15], 60.0, 3).contains("number of values"));
    assert!(refused(&[0.0; 40], 60.0, 3).contains("not zero"));
    assert!(refused(&[f64::NAN; 40], 60.0, 3).contains("sum of the values"));
    assert!(refused(&[1.0; 40], 60.0, 1).contains("decays"));
    let growing: Vec<f64> = (0..40).map(|i| (0.1 * f64::from(i)).exp()).collect();
    assert!(refused(&growing, 60.0, 1).contains("decays"));
    let bad = |term: KernelTerm| {
        MemoryKernel {
            terms: vec![term],
            delay: 0.0,
        }
        .check()
        .unwrap_err()
        .name
    };
    assert_eq!(
        bad(KernelTerm::decay(1.0, 0.0)),
        "decay time of a memory kernel"
    );
    assert_eq!(
        bad(KernelTerm {
            frequency: -1.0,
            ..KernelTerm::decay(1.0, 1.0)
        }),
        "angular frequency of a memory kernel"
    );
    assert_eq!(
        bad(KernelTerm::decay(f64::NAN, 1.0)),
        "amplitude of a memory kernel"
    );
}

/// A law that declares the variables of a damped oscillation itself: what each turns with, and the
/// second time constant.
struct Paired([(f64, usize); 2], f64);

impl TropismLaw for Paired {
    fn declare(&self, to: &mut Declaration) {
        let remembers = to.stimuli(1);
        for (turns, time_constant) in self.0.into_iter().zip([300.0, self.1]) {
            to.variable(Variable {
                turns: Some(turns),
                remembers,
                time_constant,
                ..Variable::read_after(0.0)
            });
        }
    }

    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::zeros()
    }
}

#[test]
fn variables_of_an_oscillation_that_do_not_match_are_refused() {
    let build = |law| righting().tropism(law).into_dyn().build().map(|_| ());
    assert!(build(Paired([(1e-3, 1), (-1e-3, 0)], 300.0)).is_ok());
    for law in [
        Paired([(1e-3, 1), (-2e-3, 0)], 300.0),
        Paired([(1e-3, 1), (-1e-3, 1)], 300.0),
        Paired([(1e-3, 7), (-1e-3, 0)], 300.0),
        Paired([(1e-3, 1), (-1e-3, 0)], 400.0),
        Paired([(f64::INFINITY, 1), (f64::NEG_INFINITY, 0)], 300.0),
        Paired([(0.0, 1), (0.0, 0)], 300.0),
    ] {
        assert_eq!(
            build(law).unwrap_err().name,
            "angular frequency of a damped oscillation"
        );
    }
}

/// Laplace transform of a kernel with its delay.
fn transform(kernel: &MemoryKernel, z: Complex<f64>) -> Complex<f64> {
    let term = |term: &KernelTerm| {
        let pole = Complex::new(1.0 / term.time, -term.frequency);
        let half = Complex::from_polar(0.5 * term.amplitude, term.phase);
        half / (z + pole) + half.conj() / (z + pole.conj())
    };
    kernel.terms.iter().map(term).sum::<Complex<f64>>() * (-z * kernel.delay).exp()
}

/// Upright shoot of a length (m) with its weight.
fn upright(kernel: &MemoryKernel, length: f64) -> Shoot<DynLaws> {
    reduced(length, 20.0 * HOUR)
        .elements(4)
        .tropism(filtered(kernel))
        .into_dyn()
        .build()
        .unwrap()
}

#[test]
fn onset_and_rotating_wave_have_the_frequency_at_which_the_kernel_lags_by_a_quarter() {
    let kernel = lobed();
    let found = onset(
        |length| Linearisation::about(&upright(&kernel, length)),
        0.04,
        0.075,
    )
    .unwrap();
    // With one kernel for both laws the response is real at the onset: K̂(iω)/(iω) is negative.
    let response =
        transform(&kernel, Complex::new(0.0, found.frequency)) / Complex::new(0.0, found.frequency);
    assert!(response.re < 0.0, "{response}");
    // Derivatives by differences have a relative error of 1e-9.
    assert_abs_diff_eq!(response.arg().abs(), PI, epsilon = 1e-7);
    // In the rotating frame the filters multiply by the same complex number at any amplitude.
    let length = found.parameters[0] * 1.003;
    let shoot = upright(&kernel, length);
    let root = Linearisation::about(&shoot).unwrap().rightmost().unwrap();
    let wave = RotatingWaveSolver::default()
        .from_mode(&shoot, &root, 0.02)
        .unwrap();
    assert!(wave.radius() > 1e-3, "{}", wave.radius());
    assert_relative_eq!(
        wave.rate.abs(),
        found.frequency,
        epsilon = 0.0,
        max_relative = 1e-7
    );
}
