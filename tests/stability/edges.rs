//! Where an analysis of stability could go wrong without a word: what grows by itself, what is forced, what hides.

use std::cell::Cell;
use std::f64::consts::PI;

use morphorod::constitutive::LinearElastic;
use morphorod::growth::{GrowthLaw, Ongoing, UniformGrowth};
use morphorod::load::{ApicalForce, Load, Weight};
use morphorod::stability::{
    BoundaryPoint, BoundarySettings, Linearisation, StabilityError, StationarySolver, Unstable, boundary, crossings,
    onset,
};
use morphorod::tropism::{
    Declaration, Gravitropism, Growing, Memory, Proprioception, Remembered, Response, SettledStatoliths, Site,
    Statoliths, TropismLaw, Variable,
};
use morphorod::{Scene, Shoot, Still};
use nalgebra::{UnitQuaternion, Vector3};

use crate::fixtures::upright::{HOUR, MEMORY, MINUTE, YOUNG, linear_problem};

fn analyse<T: TropismLaw, L: Load, S: Scene>(
    laws: T,
    load: L,
    scene: S,
    hours: f64,
    length: f64,
    elements: usize,
) -> Result<Linearisation, StabilityError> {
    let shoot = Shoot::builder(YOUNG)
        .length(length)
        .radius(5e-4)
        .elements(elements)
        .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: hours * HOUR }))
        .tropism(laws)
        .load(load)
        .scene(scene)
        .build()?;
    Linearisation::about(&shoot)
}

const WEIGHT: Weight = Weight { density: 1000.0 };
const BENDING: Remembered<Proprioception> =
    Remembered { response: Proprioception { sensitivity: 20.0 }, memory: MEMORY };

/// Feels the turn or the strain about d2 (and d1 if it is not of one plane), through variables of its own.
struct Own {
    /// Reads the strain, or the turn of the frame.
    strain: bool,
    sensitivity: f64,
    /// ẏ1 = a11 y1 + a12 y2 + b1 x and so on; y1 is read.
    matrix: [[f64; 2]; 2],
    drive: [f64; 2],
    delay: f64,
    plane: usize,
}

impl TropismLaw for Own {
    fn gradient(&self, at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        let size = if self.strain { -self.sensitivity } else { self.sensitivity / at.section.radius() };
        let (component, sign) = if self.plane == 0 || self.strain { (1 - self.plane, 1.0) } else { (0, -1.0) };
        Vector3::ith(component, sign * size * past[0])
    }
    fn declare(&self, to: &mut Declaration) {
        to.stimuli(1);
        to.variable(Variable::read_after(self.delay));
        to.variable(Variable::unread());
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let up = site.along_directors(&site.environment.up());
        stimuli[0] = if self.strain { site.strain[1 - self.plane] } else { up[self.plane] };
    }
    fn rates(&self, y: &[f64], x: &[f64], rates: &mut [f64]) {
        for i in 0..2 {
            rates[i] = self.matrix[i][0] * y[0] + self.matrix[i][1] * y[1] + self.drive[i] * x[0];
        }
    }
}

#[test]
fn variables_that_grow_by_themselves_are_unstable_at_every_point() {
    // ẏ = μ y + x/τ with μ > 0, whatever it is fed back to: D = λ² − μ λ + g has both its roots on the right.
    let law = |rate: f64| Own {
        strain: true,
        sensitivity: 1.0,
        matrix: [[rate, 0.0], [0.0, -1.0]],
        drive: [1.0 / 720.0, 0.0],
        delay: 0.0,
        plane: 0,
    };
    for rate in [1e-3, 1e-5] {
        let answer = analyse(law(rate), (), Still::upright(), 20.0, 0.05, 3).unwrap().unstable().unwrap();
        assert!(matches!(answer, Unstable::Infinite { abscissa } if abscissa > 0.0), "{answer:?}");
    }
    // A resonator, y'' = w² (x − y) − c y': with gain one it is damped if c > 1/τg (Routh).
    let resonator = |damping: f64| Own {
        strain: true,
        sensitivity: 1.0,
        matrix: [[0.0, 1.0], [-1e-4, -damping]],
        drive: [0.0, 1e-4],
        delay: 0.0,
        plane: 0,
    };
    let limit = 1.0 / (20.0 * HOUR);
    for (damping, stable) in [(0.1 * limit, false), (0.7 * limit, false), (1.5 * limit, true), (20.0 * limit, true)] {
        let answer = analyse(resonator(damping), (), Still::upright(), 20.0, 0.05, 3).unwrap().unstable().unwrap();
        assert_eq!(answer == Unstable::Finite(0), stable, "{damping}: {answer:?}");
    }
}

#[test]
fn planes_that_differ_are_no_twins_however_slow_another_law_is() {
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
            Gravitropism { sensitivity: 1e-9, perception: SettledStatoliths }.remembered(Memory { time, delay: 0.0 })
        });
        let laws = (plane(0, 720.0, 720.0), plane(1, 200.0, 100.0), BENDING, slow);
        analyse(laws, WEIGHT, Still::upright(), 20.0, 0.07, 6).unwrap().unstable().unwrap()
    };
    let alone = count(None);
    assert_eq!(alone, Unstable::Finite(2));
    for time in [1e6, 1e8] {
        assert_eq!(count(Some(time)), alone, "{time}");
    }
}

#[test]
fn the_essential_spectrum_is_found_left_of_the_slowest_rate_and_without_memory() {
    // 1 + b = 0 by Newton's method from many places, against what the crate says.
    for (time, delay, hours) in [(100.0, 900.0, 40.0), (300.0, 900.0, 40.0), (720.0, 720.0, 20.0)] {
        let memory = Memory { time, delay };
        let laws = Proprioception { sensitivity: 20.0 }.remembered(memory);
        let found = analyse(laws, (), Still::upright(), hours, 0.05, 2).unwrap().essential_spectrum().unwrap()[0];
        let growth = hours * HOUR;
        let mut best = f64::NEG_INFINITY;
        for k in 0..400 {
            let start =
                nalgebra::Complex::new(-3e-3 + 3e-3 * f64::from(k % 20) / 20.0, 1e-2 * f64::from(k / 20) / 20.0);
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
        assert!((found.re - best).abs() < 1e-10, "{time} s, {delay} s: {found} against {best}");
    }
    /// Proprioception without memory or delay: λ = −η/τg.
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
    let found = analyse(AtOnce, (), Still::upright(), 20.0, 0.05, 2).unwrap().essential_spectrum().unwrap()[0];
    assert!((found.re * 72e3 / -20.0 - 1.0).abs() < 1e-8 && found.im == 0.0, "{found}");
}

#[test]
fn an_isolated_root_crosses_at_zero() {
    /// Bends every point further the way the apex leans: u̇* = k REGR M[tilt of the apex].
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
    // At λ = 0 the strain is uniform, η θ' = k θ(ℓ) = k ℓ θ'.
    let expected = 20.0 / length;
    for found in [onset(family, 100.0, 900.0).unwrap(), crossings(family, 100.0, 900.0).unwrap()[0]] {
        // On the axis to 1e-11 of 1/720 s, where the root moves by 1e-7/s for a change of one in k.
        assert!((found.parameter / expected - 1.0).abs() < 1e-8, "{found:?}");
        assert_eq!(found.frequency, 0.0, "{found:?}");
    }
}

#[test]
fn what_depends_on_time_is_forced() {
    /// Gravity that turns once in an hour, as on a clinostat.
    struct Clinostat;
    impl Scene for Clinostat {
        fn gravity(&self, t: f64) -> Vector3<f64> {
            UnitQuaternion::from_scaled_axis(Vector3::x() * (2.0 * PI * t / 3600.0)) * Vector3::new(0.0, 0.0, -9.81)
        }
        fn base(&self, _t: f64) -> UnitQuaternion<f64> {
            UnitQuaternion::identity()
        }
    }
    let laws = || (Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(MEMORY), BENDING);
    let answer = analyse(laws(), WEIGHT, Clinostat, 20.0, 0.05, 3);
    assert!(matches!(answer, Err(StabilityError::Forced { .. })), "{answer:?}");
    let pull = ApicalForce(|t: f64| Vector3::new(1e-7 * (2.0 * PI * t / 1440.0).sin(), 0.0, 0.0));
    let answer = analyse(laws(), (WEIGHT, pull), Still::upright(), 20.0, 0.05, 3);
    assert!(matches!(answer, Err(StabilityError::Forced { .. })), "{answer:?}");
    // A pull along the shoot, which does not bend it as it stands.
    let pull = ApicalForce(|t: f64| Vector3::new(0.0, 0.0, 1e-7 * (2.0 * PI * t / 1440.0).sin()));
    let answer = analyse(laws(), (WEIGHT, pull), Still::upright(), 20.0, 0.05, 3);
    assert!(matches!(answer, Err(StabilityError::Forced { .. })), "{answer:?}");
    // However little it changes: by 1e-11 of itself.
    let pull = ApicalForce(|t: f64| Vector3::new(0.0, 0.0, 1e-3 * (1.0 + 1e-11 * (2.0 * PI * t / 1440.0).sin())));
    let answer = analyse(laws(), ((), pull), Still::upright(), 20.0, 0.05, 3);
    assert!(matches!(answer, Err(StabilityError::Forced { .. })), "{answer:?}");
    let steady = ApicalForce(|_| Vector3::new(0.0, 0.0, 1e-7));
    assert!(analyse(laws(), (WEIGHT, steady), Still::upright(), 20.0, 0.05, 3).is_ok());
}

/// Days and nights of growth: nothing shows on a shoot that stands, but its answers are not those of a mean.
#[test]
fn growth_by_the_clock_is_forced() {
    #[derive(Debug, Clone)]
    struct Days;
    impl GrowthLaw for Days {
        fn regr(&self, _sigma: f64, time: f64) -> f64 {
            (1.0 + 0.5 * (2.0 * PI * time / (24.0 * HOUR)).sin()) / (20.0 * HOUR)
        }
        fn zone_length(&self) -> f64 {
            0.1
        }
    }
    let gravitropism = Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(MEMORY);
    let shoot = Shoot::builder(YOUNG)
        .length(0.05)
        .radius(5e-4)
        .growth(Ongoing(Days))
        .tropism((gravitropism, BENDING))
        .load(WEIGHT)
        .into_dyn()
        .build()
        .unwrap();
    let answer = Linearisation::about(&shoot).map(|_| ());
    assert!(matches!(answer, Err(StabilityError::Forced { .. })), "{answer:?}");
}

#[test]
fn a_small_closed_boundary_is_followed_all_around() {
    // The length is the one at onset on a circle of radius r in (a, b).
    let radius = 0.05_f64;
    let family = |a: f64, b: f64| {
        let length = 0.065_614_866_491 + 0.004 * ((a * a + b * b) / (radius * radius) - 1.0);
        linear_problem(length, 20.0 * HOUR, 0.8, 20.0, SettledStatoliths, 3)
    };
    let settings = |parameters: [f64; 2], step: f64| BoundarySettings {
        start: BoundaryPoint { parameters, frequency: 0.860_333_589 / MEMORY.delay },
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
        // All around, up to the last step and to what chords are shorter than arcs.
        assert!(traveled > 0.8 * round && traveled < 1.3 * round, "{step}: {traveled} of {round}");
    }
    let answer = boundary(family, &settings([3.0, 0.0], 0.05));
    assert!(matches!(answer, Err(StabilityError::Parameter(_))));
}

#[test]
fn coarse_meshes_do_not_pass_for_stable() {
    // β, η, τm, τr of both, τg (h), length. Finer meshes find dozens of unstable roots, or find themselves too coarse.
    let cases = [
        (2.280_986, 1.754_145_65, [951.073, 1974.152], 11_348.48 / HOUR, 0.042_481_8),
        (2.0, 5.0, [720.0, 1440.0], 2.0, 0.07),
        (20.0, 15.0, [720.0, 720.0], 24.0, 0.075),
        (3.0, 0.0, [720.0, 720.0], 2.0, 0.075),
    ];
    for (beta, eta, [time, delay], hours, length) in cases {
        for elements in [1, 2, 3, 4] {
            let memory = Memory { time, delay };
            let laws = (
                Gravitropism { sensitivity: beta, perception: SettledStatoliths }.remembered(memory),
                Proprioception { sensitivity: eta }.remembered(memory),
            );
            let answer = analyse(laws, WEIGHT, Still::upright(), hours, length, elements).unwrap().unstable();
            let told = matches!(answer, Err(StabilityError::UnderResolved { .. }) | Ok(Unstable::Infinite { .. }));
            assert!(told, "β {beta}, {elements} elements: {answer:?}");
        }
    }
}

#[test]
fn a_righted_shoot_with_slow_statoliths_has_its_roots() {
    let statoliths = Statoliths { avalanche_time: 2.0 * MINUTE };
    let laws = (Gravitropism { sensitivity: 0.8, perception: statoliths }.remembered(MEMORY), BENDING);
    let growth = |length: f64, elements: usize| {
        let mut shoot = Shoot::builder(YOUNG)
            .length(length)
            .radius(5e-4)
            .elements(elements)
            .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: 20.0 * HOUR }))
            .tropism(laws)
            .load(WEIGHT)
            .scene(Still::tilted(0.5))
            .into_dyn()
            .build()?;
        let _ = StationarySolver::default().solve(&mut shoot)?;
        Linearisation::about(&shoot)
    };
    let [coarse, fine] = [4, 6].map(|elements| growth(0.068, elements).unwrap().rightmost().unwrap().value);
    // Order eight: 1e-6 of the root on four elements.
    assert!((coarse - fine).norm() < 1e-6 * fine.norm(), "{coarse} and {fine}");
    let found = crossings(|length| growth(length, 4), 0.060, 0.068).unwrap();
    assert!(!found.is_empty());
}

#[test]
fn a_stationary_shoot_may_be_twisted_and_a_delay_must_make_sense() {
    /// Asks for a twist of 10/m, and has an odd delay.
    struct Twist<'a> {
        delay: &'a Cell<f64>,
    }
    impl TropismLaw for Twist<'_> {
        fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
            Vector3::z() * (-5.0 * past[0])
        }
        fn declare(&self, to: &mut Declaration) {
            to.stimuli(1);
            to.variable(Variable::read_after(self.delay.get()));
        }
        fn sense(&self, site: &Site, stimuli: &mut [f64]) {
            stimuli[0] = site.strain.z - 10.0;
        }
        fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
            variables[0] = stimuli[0];
        }
        fn rates(&self, y: &[f64], x: &[f64], rates: &mut [f64]) {
            rates[0] = (x[0] - y[0]) / 720.0;
        }
    }
    let delay = Cell::new(720.0);
    let shoot = || {
        Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
            .length(0.05)
            .radius(5e-4)
            .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: 20.0 * HOUR }))
            .tropism(Twist { delay: &delay })
            .build()
    };
    let mut twisted = shoot().unwrap();
    let _ = StationarySolver::default().solve(&mut twisted).unwrap();
    assert!((twisted.rod().strain(0, 0).unwrap().z - 10.0).abs() < 1e-6);
    assert!(Linearisation::about(&twisted).is_ok());
    for odd in [f64::NAN, -100.0] {
        delay.set(720.0);
        let mut shoot_of_sound_laws = shoot().unwrap();
        let _ = StationarySolver::default().solve(&mut shoot_of_sound_laws).unwrap();
        // A law that changes its mind; a shoot is not built of an odd one in the first place.
        delay.set(odd);
        assert!(matches!(Linearisation::about(&shoot_of_sound_laws), Err(StabilityError::Parameter(_))), "{odd}");
        assert!(shoot().is_err(), "{odd}");
    }
}
