//! Checks of laws: every wrong sign is found, with its component, and the laws of the crate pass.

use crate::fixtures::shoots::{STATOLITHS, WEIGHT, YOUNG, gravitropism, rod};
use morphorod::check::{self, LawError, Quantity};
use morphorod::constitutive::{
    Constitutive, ElasticResponse, Graded, Lignifying, LineResponse, LinearElastic, Timoshenko,
    Tissue,
};
use morphorod::growth::{CosineProfile, GrowthLaw, LinearProfile, Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::rod::Rod;
use morphorod::tropism::{
    Declaration, Gravitropism, Growing, Handedness, Memory, Oscillator, Perception, Proprioception,
    Response, SettledStatoliths, Site, Source, Statoliths, TropismLaw, Variable,
};
use morphorod::{Environment, Order, Section, Still};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// A law with the sign of one quantity changed.
struct Flipped<L> {
    law: L,
    wrong: Quantity,
}

impl<L> Flipped<L> {
    /// The sign of a quantity.
    fn sign(&self, quantity: Quantity) -> f64 {
        if self.wrong == quantity { -1.0 } else { 1.0 }
    }
}

/// A law with all couplings, W = ½ u · K u + q (u · u)²/4, and a centre line with the energy ½ n ·
/// C n + c (n · n)²·3/4 as a function of the force.
struct Coupled {
    stiffness: Matrix3<f64>,
    quartic: f64,
    compliance: Matrix3<f64>,
    softening: f64,
}

/// A stiffness of 1e-7 N m² and a compliance of 0.1/N, with which strains of 10/m and forces of 0.1
/// N are nonlinear.
fn coupled() -> Coupled {
    let shape = Matrix3::new(1.0, 0.3, -0.2, 0.3, 1.4, 0.25, -0.2, 0.25, 0.8);
    Coupled {
        stiffness: shape * 1e-7,
        quartic: 1e-10,
        compliance: shape * 0.1,
        softening: 0.5,
    }
}

impl Constitutive for Flipped<Coupled> {
    fn respond(&self, _tissue: &Tissue, u: &Vector3<f64>) -> ElasticResponse {
        let Coupled {
            stiffness, quartic, ..
        } = self.law;
        let linear = stiffness * u;
        let couple = linear + u * (quartic * u.norm_squared());
        let tangent = stiffness
            + Matrix3::identity() * (quartic * u.norm_squared())
            + u * u.transpose() * (2.0 * quartic);
        ElasticResponse {
            energy: self.sign(Quantity::EnergySlope(0))
                * (0.5 * linear.dot(u) + quartic * u.norm_squared().powi(2) / 4.0),
            couple: Vector3::from_fn(|i, _| self.sign(Quantity::Couple(i)) * couple[i]),
            tangent: Matrix3::from_fn(|i, j| self.sign(Quantity::Tangent(i, j)) * tangent[(i, j)]),
        }
    }

    fn line_response(&self, _tissue: &Tissue, n: &Vector3<f64>) -> Option<LineResponse> {
        let Coupled {
            compliance,
            softening,
            ..
        } = self.law;
        // v = e3 + C n + c (n · n) n, so that Φ = n · (v − e3) − Ψ with Ψ = ½ n · C n + c (n ·
        // n)²/4.
        let square = n.norm_squared();
        let change = compliance * n + n * (softening * square);
        let by_force = compliance
            + Matrix3::identity() * (softening * square)
            + n * n.transpose() * (2.0 * softening);
        let energy = 0.5 * n.dot(&(compliance * n)) + 0.75 * softening * square * square;
        Some(LineResponse {
            strain: Vector3::z()
                + Vector3::from_fn(|i, _| self.sign(Quantity::LineStrain(i)) * change[i]),
            energy: self.sign(Quantity::LineEnergySlope(0)) * energy,
            compliance: Matrix3::from_fn(|i, j| {
                self.sign(Quantity::Compliance(i, j)) * by_force[(i, j)]
            }),
        })
    }
}

impl<G: GrowthLaw> GrowthLaw for Flipped<G> {
    fn regr(&self, sigma: f64, t: f64) -> f64 {
        self.sign(Quantity::Regr) * self.law.regr(sigma, t)
    }
    fn zone_length(&self) -> f64 {
        self.law.zone_length()
    }
    fn apical_speed(&self, sigma: f64, t: f64) -> f64 {
        self.sign(Quantity::ApicalSpeed) * self.law.apical_speed(sigma, t)
    }
    fn flow(&self, sigma: f64, from: f64, to: f64) -> (f64, f64) {
        let [distance, stretch] = [Quantity::Distance, Quantity::Stretch].map(|quantity| {
            let to = from + self.sign(quantity) * (to - from);
            self.law.flow(sigma, from, to)
        });
        (distance.0, stretch.1)
    }
    fn exit_time(&self, sigma: f64, from: f64, until: f64) -> Option<f64> {
        let exit = self.law.exit_time(sigma, from, until)?;
        Some(from + self.sign(Quantity::ExitTime) * (exit - from))
    }
}

impl<T: TropismLaw> TropismLaw for Flipped<T> {
    fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> {
        let gradient = self.law.gradient(at, past, now);
        Vector3::from_fn(|c, _| self.sign(Quantity::Gradient(c)) * gradient[c])
    }
    fn declare(&self, to: &mut Declaration) {
        self.law.declare(to);
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        self.law.sense(site, stimuli);
        stimuli
            .iter_mut()
            .enumerate()
            .for_each(|(k, x)| *x *= self.sign(Quantity::Stimulus(k)));
    }
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.law.rates(variables, stimuli, rates);
        rates
            .iter_mut()
            .enumerate()
            .for_each(|(k, rate)| *rate *= self.sign(Quantity::Rate(k)));
    }
    fn coupled_rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.law.coupled_rates(variables, stimuli, rates);
        let signs = |k| self.sign(Quantity::CoupledRate(k)) * self.sign(Quantity::Rate(k));
        rates
            .iter_mut()
            .enumerate()
            .for_each(|(k, rate)| *rate *= signs(k));
    }
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        self.law.steady(stimuli, variables);
        variables
            .iter_mut()
            .enumerate()
            .for_each(|(k, y)| *y *= self.sign(Quantity::Steady(k)));
    }
}

impl<P: Perception> Perception for Flipped<P> {
    type Signal = P::Signal;
    fn declare(&self, to: &mut Declaration) -> Source {
        self.law.declare(to)
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        self.law.sense(site, stimuli);
    }
    fn signal(&self, variables: &[f64], stimuli: &[f64]) -> P::Signal {
        let mut signal = self.law.signal(variables, stimuli);
        signal
            .as_mut()
            .iter_mut()
            .enumerate()
            .for_each(|(k, x)| *x *= self.sign(Quantity::Signal(k)));
        signal
    }
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.law.rates(variables, stimuli, rates);
    }
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        self.law.steady(stimuli, variables);
    }
}

/// Pairs of a strain (1/m) and a force (N): generic ones.
fn points() -> [(Vector3<f64>, Vector3<f64>); 2] {
    let (strain, force) = (Vector3::new(12.0, -7.0, 5.0), Vector3::new(0.1, -0.2, 0.15));
    [(strain, force), (-strain * 0.3, force * -0.02)]
}

/// Calls `check` with two sites of a bent rod on an inclined base.
fn at_sites<T>(check: impl FnOnce(&[Site]) -> T) -> T {
    let base = UnitQuaternion::from_scaled_axis(Vector3::new(0.7, -0.4, 0.3));
    let mut rod = Rod::uniform(0.05, 5e-4, base, 2, Order::Four).unwrap();
    rod.set_intrinsic(|_| Vector3::new(4.0, -9.0, 2.0));
    let environment = Environment {
        time: 600.0,
        gravity: Vector3::new(0.0, 0.0, -9.81),
    };
    let site = |arc_length: f64| {
        let mut site = Site::new(
            environment,
            base * UnitQuaternion::from_scaled_axis(Vector3::x() * arc_length),
            &rod,
        );
        site.strain = Vector3::new(3.0, -8.0, 1.0);
        site.couple = Vector3::new(2e-6, 1e-6, -1e-6);
        site.position = Vector3::new(0.01, -0.02, 0.03);
        (site.arc_length, site.apex_distance) = (arc_length, 0.05 - arc_length);
        site
    };
    check(&[site(0.01), site(0.04)])
}

const MEMORY: Memory = Memory {
    time: 720.0,
    delay: 720.0,
};

/// Gravitropism and proprioception with seven variables: the statoliths, two memories of them, two
/// memories of strain.
fn steering() -> impl TropismLaw + Copy {
    (
        gravitropism(STATOLITHS),
        Proprioception { sensitivity: 20.0 }.remembered(MEMORY),
    )
}

/// Checks that a wrong quantity is reported as `expected`.
fn found(wrong: Quantity, expected: Quantity, answer: Result<(), LawError>) {
    let error = answer.expect_err(&format!("{wrong:?} is not found"));
    // These two are found by their derivatives.
    let expected = match expected {
        Quantity::LineStrain(i) => Quantity::LineStrainSlope(i, 0),
        Quantity::ApicalSpeed => Quantity::ApicalSpeedSlope,
        other => other,
    };
    assert_eq!(error.quantity, expected, "{wrong:?}: {error}");
    // The sign is wrong, so that the two numbers differ.
    assert!(
        (error.value - error.expected).abs() > 0.1 * error.value.abs(),
        "{error}"
    );
    let message = error.to_string();
    assert!(
        ["Flipped", "must be"]
            .iter()
            .all(|words| message.contains(words)),
        "{error}"
    );
    assert!(!message.contains("not a number"), "{error}");
}

#[test]
fn wrong_signs_of_elastic_laws_are_found() {
    let mut wrong = vec![Quantity::EnergySlope(0), Quantity::LineEnergySlope(0)];
    for i in 0..3 {
        wrong.extend([Quantity::Couple(i), Quantity::LineStrain(i)]);
        wrong.extend((0..3).flat_map(|j| [Quantity::Tangent(i, j), Quantity::Compliance(i, j)]));
    }
    assert_eq!(wrong.len(), 26);
    let tissue = Tissue::young(5e-4);
    for wrong in wrong {
        found(
            wrong,
            wrong,
            check::elastic_law(
                &Flipped {
                    law: coupled(),
                    wrong,
                },
                &tissue,
                &points(),
            ),
        );
    }
    let sound = Flipped {
        law: coupled(),
        wrong: Quantity::Regr,
    };
    assert_eq!(check::elastic_law(&sound, &tissue, &points()), Ok(()));
}

#[test]
fn wrong_signs_of_growth_laws_are_found() {
    let (points, zone_length, time) = ([(0.01, 0.0), (0.02, 5e3)], 0.04, 72e3);
    let (uniform, linear) = (
        UniformGrowth { zone_length, time },
        LinearProfile { zone_length, time },
    );
    for wrong in [
        Quantity::Regr,
        Quantity::ApicalSpeed,
        Quantity::Distance,
        Quantity::Stretch,
        Quantity::ExitTime,
    ] {
        found(
            wrong,
            wrong,
            check::growth_law(
                &Flipped {
                    law: uniform,
                    wrong,
                },
                &points,
                3600.0,
            ),
        );
        found(
            wrong,
            wrong,
            check::growth_law(&Flipped { law: linear, wrong }, &points, 3600.0),
        );
    }
}

#[test]
fn wrong_signs_of_tropisms_are_found() {
    let mut wrong: Vec<_> = (3..7)
        .map(|k| (Quantity::Rate(k), Quantity::Rate(k)))
        .collect();
    wrong.extend((0..3).map(|k| (Quantity::CoupledRate(k), Quantity::CoupledRate(k))));
    wrong.extend((0..7).map(|k| (Quantity::Steady(k), Quantity::Steady(k))));
    // A rotation does not tell which component of a pair is wrong.
    wrong.extend([0, 1].map(|k| (Quantity::Stimulus(k), Quantity::Stimulus(0))));
    wrong.extend([3, 4].map(|k| (Quantity::Stimulus(k), Quantity::Stimulus(3))));
    wrong.extend([0, 1].map(|k| (Quantity::Rate(k), Quantity::Rate(0))));
    wrong.extend([0, 1].map(|k| (Quantity::Gradient(k), Quantity::Gradient(0))));
    for (wrong, expected) in wrong {
        let law = Flipped {
            law: steering(),
            wrong,
        };
        found(
            wrong,
            expected,
            at_sites(|sites| check::tropism_law(&law, sites)),
        );
    }
    for wrong in [Quantity::Signal(0), Quantity::Signal(1)] {
        let law = Flipped {
            law: Statoliths {
                avalanche_time: 120.0,
            },
            wrong,
        };
        found(
            wrong,
            wrong,
            at_sites(|sites| check::perception(&law, sites)),
        );
    }
}

/// Growth in the first half of each day of 24 h.
struct Nights(UniformGrowth);

impl GrowthLaw for Nights {
    fn regr(&self, sigma: f64, t: f64) -> f64 {
        if t.rem_euclid(86_400.0) < 43_200.0 {
            self.0.regr(sigma, t)
        } else {
            0.0
        }
    }
    fn zone_length(&self) -> f64 {
        self.0.zone_length
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        43_200.0 * ((t / 43_200.0).floor() + 1.0)
    }
}

#[test]
fn laws_of_the_crate_pass() {
    let young = LinearElastic {
        youngs_modulus: 1e7,
        poissons_ratio: 0.4,
    };
    let mut tissue = Tissue::young(Section::ellipse(5e-4, 3e-4));
    (tissue.age, tissue.initial_apex_distance) = (1e5, 0.03);
    let lignifying = Lignifying {
        young,
        mature_modulus: 2e9,
        time: 5e5,
    };
    let factor = |tissue: &Tissue| 1.0 + 20.0 * tissue.initial_apex_distance;
    for answer in [
        check::elastic_law(&young, &tissue, &points()),
        check::elastic_law(&lignifying, &tissue, &points()),
        check::elastic_law(&Timoshenko::circular(young), &tissue, &points()),
        check::elastic_law(
            &Graded {
                law: lignifying,
                factor,
            },
            &tissue,
            &points(),
        ),
        check::elastic_law(
            &Graded {
                law: Timoshenko::circular(young),
                factor,
            },
            &tissue,
            &points(),
        ),
        // Forces of the size of a weight, 1e-5 N, cause strains of 1e-6.
        check::elastic_law(
            &Timoshenko::circular(young),
            &tissue,
            &[(points()[0].0, points()[0].1 * 1e-4)],
        ),
    ] {
        assert_eq!(answer, Ok(()));
    }
    let (zone_length, time) = (0.04, 72e3);
    // The last point is outside the zone.
    let points = [(1e-5, 0.0), (0.01, 100.0), (0.039, 5e3), (0.05, 5e3)];
    for answer in [
        check::growth_law(&(), &points, 3600.0),
        check::growth_law(&UniformGrowth { zone_length, time }, &points, 3600.0),
        check::growth_law(&LinearProfile { zone_length, time }, &points, 3600.0),
        check::growth_law(&CosineProfile { zone_length, time }, &points, 3600.0),
        check::growth_law(
            &Ongoing(LinearProfile { zone_length, time }),
            &points,
            3600.0,
        ),
        check::growth_law(&UniformGrowth { zone_length, time }, &[(0.0, 0.0)], 3600.0),
        check::growth_law(
            &Nights(UniformGrowth { zone_length, time }),
            &[(0.01, 5e4), (0.039, 1e3)],
            3600.0,
        ),
    ] {
        assert_eq!(answer, Ok(()));
    }
    let oscillator = Oscillator {
        phase: 0.3,
        handedness: Handedness::Clockwise,
        ..Oscillator::new(0.2, 1440.0)
    };
    let twice = Gravitropism {
        sensitivity: -0.8,
        perception: SettledStatoliths,
    }
    .remembered(MEMORY)
    .remembered(MEMORY);
    at_sites(|sites| {
        for answer in [
            check::tropism_law(&(), sites),
            check::tropism_law(&oscillator, sites),
            check::tropism_law(&twice, sites),
            check::tropism_law(&(oscillator, steering(), vec![twice]), sites),
            check::response(&twice, sites),
            check::response(&Proprioception { sensitivity: 20.0 }, sites),
            check::response(
                &Gravitropism {
                    sensitivity: 0.8,
                    perception: Statoliths::default(),
                },
                sites,
            ),
            check::perception(&SettledStatoliths, sites),
            check::perception(&Statoliths::default(), sites),
        ] {
            assert_eq!(answer, Ok(()));
        }
    });
    // Stimuli that are rounding errors, on an upright rod.
    let rod = Rod::uniform(0.05, 5e-4, UnitQuaternion::identity(), 2, Order::Four).unwrap();
    let environment = Environment {
        time: 0.0,
        gravity: Vector3::new(0.0, 0.0, -9.81),
    };
    let nearly_upright = UnitQuaternion::from_scaled_axis(Vector3::new(1e-16, -3e-17, 0.2));
    let site = Site::new(environment, nearly_upright, &rod);
    assert_eq!(check::tropism_law(&steering(), &[site]), Ok(()));
}

#[test]
fn declarations_that_a_law_does_not_keep_are_found() {
    /// A law that reads a variable which it declares unread, or declares one component of a vector
    /// alone.
    struct Careless {
        variable: Variable,
    }
    impl TropismLaw for Careless {
        fn declare(&self, to: &mut Declaration) {
            to.variable(self.variable);
        }
        fn rates(&self, y: &[f64], _x: &[f64], rates: &mut [f64]) {
            rates[0] = -y[0];
        }
        fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
            Vector3::x() * past[0]
        }
    }
    let quantity = |variable| {
        at_sites(|sites| check::tropism_law(&Careless { variable }, sites))
            .map_err(|error| error.quantity)
    };
    use morphorod::tropism::Rotation;
    assert_eq!(quantity(Variable::read_after(0.0)), Ok(()));
    assert_eq!(quantity(Variable::unread()), Err(Quantity::Gradient(0)));
    assert_eq!(
        quantity(Variable::read_after(0.0).turning(Rotation::First)),
        Err(Quantity::VariableRotation(0))
    );
    // The default rates are NaN, and a law that reads the position must declare it.
    struct Blind(bool);
    impl Perception for Blind {
        type Signal = [f64; 2];
        fn declare(&self, to: &mut Declaration) -> Source {
            if self.0 {
                to.variable(Variable::unread());
            }
            to.stimulus_pair()
        }
        fn sense(&self, site: &Site, stimuli: &mut [f64]) {
            let along = site.along_directors(&if self.0 { Vector3::x() } else { site.position });
            stimuli.copy_from_slice(&[along.x, along.y]);
        }
    }
    let quantity = |perception: Blind| {
        at_sites(|sites| check::perception(&perception, sites)).map_err(|e| e.quantity)
    };
    assert_eq!(quantity(Blind(true)), Err(Quantity::Rate(0)));
    let error = at_sites(|sites| check::perception(&Blind(true), sites)).unwrap_err();
    assert!(
        error.to_string().contains("is not a number at site 0"),
        "{error}"
    );
    assert_eq!(quantity(Blind(false)), Err(Quantity::Stimulus(0)));
}

#[test]
fn laws_of_a_shoot_are_checked_at_its_places() {
    let growth = UniformGrowth {
        zone_length: 0.04,
        time: 72e3,
    };
    let builder = rod(Timoshenko::circular(YOUNG), 0.06)
        .growth(growth)
        .load(WEIGHT);
    let builder = builder.tropism(steering()).scene(Still::tilted(0.4));
    let mut shoot = builder.clone().build().unwrap();
    // Before and after growth, upright and bent.
    assert_eq!(shoot.check_laws(), Ok(()));
    MethodOfSteps::new(300.0)
        .advance(&mut shoot, 7200.0)
        .unwrap();
    assert_eq!(shoot.check_laws(), Ok(()));
    let quantity = |answer: Result<(), LawError>| answer.map_err(|error| error.quantity);
    for wrong in [
        Quantity::Rate(5),
        Quantity::Steady(2),
        Quantity::CoupledRate(1),
    ] {
        let shoot = builder
            .clone()
            .tropism(Flipped {
                law: steering(),
                wrong,
            })
            .build()
            .unwrap();
        assert_eq!(quantity(shoot.check_laws()), Err(wrong));
    }
    let wrong = Quantity::ExitTime;
    let shoot = builder.clone().growth(Flipped {
        law: LinearProfile {
            zone_length: 0.04,
            time: 72e3,
        },
        wrong,
    });
    assert_eq!(quantity(shoot.build().unwrap().check_laws()), Err(wrong));
    let wrong = Quantity::Tangent(2, 0);
    let flipped = Flipped {
        law: coupled(),
        wrong,
    };
    let shoot = rod(flipped, 0.06).build().unwrap();
    assert_eq!(quantity(shoot.check_laws()), Err(wrong));
}

#[test]
fn points_of_a_growth_check_must_be_finite_and_its_span_positive() {
    let law = UniformGrowth {
        zone_length: 0.03,
        time: 72e3,
    };
    for span in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = check::growth_law(&law, &[(0.01, 3600.0)], span).unwrap_err();
        assert_eq!(error.quantity, Quantity::Span, "{error}");
    }
    for point in [(f64::NAN, 3600.0), (0.01, f64::INFINITY)] {
        let error = check::growth_law(&law, &[point], 3600.0).unwrap_err();
        assert_eq!(error.quantity, Quantity::Point, "{error}");
    }
}
