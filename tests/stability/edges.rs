//! Cases in which a stability analysis could silently give a wrong result: laws with unstable
//! variables or different planes, roots that are hard to find, and small stability boundaries.

use std::f64::consts::PI;

use approx::{abs_diff_eq, assert_relative_eq};
use morphorod::load::Load;
use morphorod::stability::{
    BoundarySettings, Linearisation, StabilityError, boundary, crossings, onset, solve_steady_state,
};
use morphorod::tropism::{
    Declaration, Gravitropism, Growing, Memory, Proprioception, Remembered, Response,
    SettledStatoliths, Site, TropismLaw, Variable,
};
use morphorod::{Scene, Still};
use nalgebra::Vector3;

use crate::fixtures::shoots::{ETA, HOUR, MEMORY, STATOLITHS, WEIGHT, reduced, steering};
use crate::fixtures::upright::linearisation;

/// Linearisation about the upright shape of a shoot with the given laws, load, scene, growth time
/// (h), length (m) and number of elements.
pub(super) fn analyse(
    laws: impl TropismLaw + Send + Sync + 'static,
    load: impl Load + Send + Sync + 'static,
    scene: impl Scene + Send + Sync + 'static,
    hours: f64,
    length: f64,
    elements: usize,
) -> Result<Linearisation, StabilityError> {
    let shoot = reduced(length, hours * HOUR)
        .elements(elements)
        .tropism(laws)
        .load(load)
        .scene(scene)
        .into_dyn()
        .build()?;
    Linearisation::about(&shoot)
}

pub(super) const BENDING: Remembered<Proprioception> = Remembered {
    response: Proprioception { sensitivity: ETA },
    memory: MEMORY,
};

/// Law in one plane that depends on either the strain or the tilt, through two variables with
/// linear dynamics.
struct Own {
    /// Whether the stimulus is the strain. Otherwise it is the tilt of the frame.
    strain: bool,
    sensitivity: f64,
    /// Matrix a in ẏ_i = a_i1 y1 + a_i2 y2 + b_i x, where b is `drive`. The gradient depends on y1.
    matrix: [[f64; 2]; 2],
    drive: [f64; 2],
    delay: f64,
    plane: usize,
}

impl TropismLaw for Own {
    fn gradient(&self, at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        let size = if self.strain {
            -self.sensitivity
        } else {
            self.sensitivity / at.section.radius()
        };
        let (component, sign) = if self.plane == 0 || self.strain {
            (1 - self.plane, 1.0)
        } else {
            (0, -1.0)
        };
        Vector3::ith(component, sign * size * past[0])
    }
    fn declare(&self, to: &mut Declaration) {
        to.stimuli(1);
        to.variable(Variable::read_after(self.delay));
        to.variable(Variable::unread());
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let up = site.along_directors(&site.environment.up());
        stimuli[0] = if self.strain {
            site.strain[1 - self.plane]
        } else {
            up[self.plane]
        };
    }
    fn rates(&self, y: &[f64], x: &[f64], rates: &mut [f64]) {
        for i in 0..2 {
            rates[i] = self.matrix[i][0] * y[0] + self.matrix[i][1] * y[1] + self.drive[i] * x[0];
        }
    }
}

#[test]
fn law_with_an_unstable_variable_makes_infinitely_many_roots_unstable() {
    // ẏ = μ y + x/τ with μ > 0. For any feedback g > 0, both roots of λ² − μ λ + g have positive
    // real parts.
    let law = |rate: f64| Own {
        strain: true,
        sensitivity: 1.0,
        matrix: [[rate, 0.0], [0.0, -1.0]],
        drive: [1.0 / 720.0, 0.0],
        delay: 0.0,
        plane: 0,
    };
    for rate in [1e-3, 1e-5] {
        let answer = analyse(law(rate), (), Still::upright(), 20.0, 0.05, 3)
            .unwrap()
            .unstable();
        let infinite =
            matches!(answer, Err(StabilityError::InfinitelyMany { abscissa }) if abscissa > 0.0);
        assert!(infinite, "{answer:?}");
    }
    // The feedback loop of a resonator y'' = w² (x − y) − c y' with unit gain is stable if c > 1/τg
    // (Routh's criterion).
    let resonator = |damping: f64| Own {
        strain: true,
        sensitivity: 1.0,
        matrix: [[0.0, 1.0], [-1e-4, -damping]],
        drive: [0.0, 1e-4],
        delay: 0.0,
        plane: 0,
    };
    let limit = 1.0 / (20.0 * HOUR);
    for (damping, stable) in [
        (0.1 * limit, false),
        (0.7 * limit, false),
        (1.5 * limit, true),
        (20.0 * limit, true),
    ] {
        let answer = analyse(resonator(damping), (), Still::upright(), 20.0, 0.05, 3)
            .unwrap()
            .unstable();
        assert_eq!(answer == Ok(0), stable, "{damping}: {answer:?}");
    }
}

#[test]
fn roots_of_two_planes_with_different_laws_are_counted_separately_beside_a_slow_third_law() {
    let plane = |plane, time: f64, delay| Own {
        strain: false,
        sensitivity: 0.8,
        matrix: [[-1.0 / time, 0.0], [0.0, -1.0 / time]],
        drive: [1.0 / time, 0.0],
        delay,
        plane,
    };
    let count = |slow: Option<f64>| {
        let slow = slow.map(|time| {
            Gravitropism {
                sensitivity: 1e-9,
                perception: SettledStatoliths,
            }
            .remembered(Memory { time, delay: 0.0 })
        });
        let laws = (
            plane(0, 720.0, 720.0),
            plane(1, 200.0, 100.0),
            BENDING,
            slow,
        );
        analyse(laws, WEIGHT, Still::upright(), 20.0, 0.07, 6)
            .unwrap()
            .unstable()
            .unwrap()
    };
    let alone = count(None);
    assert_eq!(alone, 2);
    for time in [1e6, 1e8] {
        assert_eq!(count(Some(time)), alone, "{time}");
    }
}

#[test]
fn essential_spectrum_agrees_with_its_scalar_equation_left_of_the_slowest_rate_and_without_memory()
{
    // The reference is the rightmost root of 1 + b = 0, computed by Newton's method from 400
    // initial guesses.
    for (time, delay, hours) in [
        (100.0, 900.0, 40.0),
        (300.0, 900.0, 40.0),
        (720.0, 720.0, 20.0),
    ] {
        let memory = Memory { time, delay };
        let laws = Proprioception { sensitivity: 20.0 }.remembered(memory);
        let found = analyse(laws, (), Still::upright(), hours, 0.05, 2)
            .unwrap()
            .essential_spectrum()
            .unwrap()[0];
        let growth = hours * HOUR;
        let mut best = f64::NEG_INFINITY;
        for k in 0..400 {
            let start = nalgebra::Complex::new(
                -3e-3 + 3e-3 * f64::from(k % 20) / 20.0,
                1e-2 * f64::from(k / 20) / 20.0,
            );
            let mut z = start;
            for _ in 0..60 {
                let lag = (-z * delay).exp() * 20.0;
                let f = growth * z * (z * time + 1.0) + lag;
                z -= f / (growth * (z * (2.0 * time) + 1.0) - lag * delay);
            }
            let f = growth * z * (z * time + 1.0) + (-z * delay).exp() * 20.0;
            if f.norm() < 1e-9 {
                best = best.max(z.re);
            }
        }
        assert!(
            abs_diff_eq!(found.re, best, epsilon = 1e-10),
            "{time} s, {delay} s: {found} against {best}"
        );
    }
    /// Proprioception without memory or delay, for which λ = −η/τg.
    struct AtOnce;
    impl TropismLaw for AtOnce {
        fn gradient(&self, _at: &Growing, _past: &[f64], now: &[f64]) -> Vector3<f64> {
            Vector3::new(-20.0 * now[0], -20.0 * now[1], 0.0)
        }
        fn declare(&self, to: &mut Declaration) {
            to.with_present().stimuli(2);
        }
        fn sense(&self, site: &Site, stimuli: &mut [f64]) {
            stimuli.copy_from_slice(&[site.strain.x, site.strain.y]);
        }
    }
    let found = analyse(AtOnce, (), Still::upright(), 20.0, 0.05, 2)
        .unwrap()
        .essential_spectrum()
        .unwrap()[0];
    assert_relative_eq!(found.re, -20.0 / 72e3, epsilon = 0.0, max_relative = 1e-8);
    assert_eq!(found.im, 0.0);
}

#[test]
fn onset_of_a_real_root_is_found_at_zero_frequency() {
    /// Law that bends every point in the direction in which the apex is tilted: u̇* = k REGR M[tilt
    /// of the apex].
    struct Topple(f64);
    impl TropismLaw for Topple {
        fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
            Vector3::y() * (self.0 * past[0])
        }
        fn declare(&self, to: &mut Declaration) {
            to.stimuli(1);
            to.variable(Variable::read_after(720.0));
        }
        fn sense(&self, site: &Site, stimuli: &mut [f64]) {
            let tangent = *site.rod.frames().last().unwrap() * Vector3::z();
            stimuli[0] = tangent.x;
        }
        fn rates(&self, y: &[f64], x: &[f64], rates: &mut [f64]) {
            rates[0] = (x[0] - y[0]) / 720.0;
        }
    }
    let length = 0.05;
    let family = |k: f64| analyse((Topple(k), BENDING), (), Still::upright(), 20.0, length, 3);
    // At λ = 0 the strain is uniform, and η θ' = k θ(ℓ) = k ℓ θ'.
    let expected = 20.0 / length;
    for found in [
        onset(family, 100.0, 900.0).unwrap(),
        crossings(family, 100.0, 900.0).unwrap()[0],
    ] {
        // The search locates the root on the imaginary axis to within 1e-11 of 1/(720 s). The root
        // changes by 1e-7/s if k changes by one.
        assert_relative_eq!(
            found.parameters[0],
            expected,
            epsilon = 0.0,
            max_relative = 1e-8
        );
        assert_eq!(found.frequency, 0.0, "{found:?}");
    }
}

#[test]
fn small_closed_stability_boundary_is_followed_all_around() {
    // The length equals the length at onset on a circle in the plane (a, b).
    let radius = 0.05_f64;
    let family = |a: f64, b: f64| {
        let length = 0.065_614_866_491 + 0.004 * ((a * a + b * b) / (radius * radius) - 1.0);
        linearisation(length, 20.0 * HOUR, 0.8, 20.0, SettledStatoliths, 3)
    };
    let settings = |start: [f64; 2], step: f64| BoundarySettings {
        start,
        frequency: 0.860_333_589 / MEMORY.delay,
        direction: [0.0, 1.0],
        low: [-2.0, -2.0],
        high: [2.0, 2.0],
        step,
        points: 1000,
    };
    for step in [0.01, 0.05] {
        let curve = boundary(family, &settings([radius, 0.0], step)).unwrap();
        let chords = curve.windows(2).map(|pair| {
            let [a, b] = [0, 1].map(|k| pair[1].parameters[k] - pair[0].parameters[k]);
            a.hypot(b)
        });
        let round = 2.0 * PI * radius;
        let traveled: f64 = chords.sum();
        // The tolerance covers the last step and the difference between chords and arcs.
        assert!(
            traveled > 0.8 * round && traveled < 1.3 * round,
            "{step}: {traveled} of {round}"
        );
    }
    let answer = boundary(family, &settings([3.0, 0.0], 0.05));
    assert!(matches!(answer, Err(StabilityError::Parameter(_))));
}

#[test]
fn roots_of_a_shoot_on_a_tilted_base_with_statoliths_converge_with_the_mesh() {
    let laws = steering(STATOLITHS);
    let linear = |length: f64, elements: usize| {
        let mut shoot = reduced(length, 20.0 * HOUR)
            .elements(elements)
            .tropism(laws)
            .scene(Still::tilted(0.5))
            .into_dyn()
            .build()?;
        solve_steady_state(&mut shoot)?;
        Linearisation::about(&shoot)
    };
    let [coarse, fine] =
        [4, 6].map(|elements| linear(0.068, elements).unwrap().rightmost().unwrap().value);
    // The order is eight, and the relative error on four elements is less than 1e-6. `approx`
    // cannot compare complex numbers without its feature `num-complex`.
    assert!(
        (coarse - fine).norm() < 1e-6 * fine.norm(),
        "{coarse} and {fine}"
    );
    let found = crossings(|length| linear(length, 4), 0.060, 0.068).unwrap();
    assert!(!found.is_empty());
}
