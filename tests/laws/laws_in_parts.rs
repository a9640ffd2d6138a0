//! Composition of laws: declarations, chained memories, tuples, boxed laws, and user-defined
//! models.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{
    BETA, ETA, HOUR, MEMORY, RADIUS, STATOLITHS, WEIGHT, YOUNG, gravitropism, growing, righting,
    steering,
};
use approx::{abs_diff_eq, assert_abs_diff_eq};
use morphorod::constitutive::LinearElastic;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps, Simulation};
use morphorod::load::{Distributed, Load, Weight};
use morphorod::stability::{Linearisation, solve_steady_state};
use morphorod::tropism::{
    Declaration, DirectionalTropism, Growing, Memory, Oscillator, Perception, Proprioception,
    Remembered, Response, Rotation, SettledStatoliths, Site, Size, Source, TropismLaw, Variable,
};
use morphorod::{DynLaws, Laws, Model, Shoot, State, Still};
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use std::{cell::Cell, sync::Arc};

/// The laws of the growing shoot.
fn all_laws() -> impl TropismLaw {
    let (gravitropism, proprioception) = steering(STATOLITHS);
    (Oscillator::new(0.2, 1440.0), gravitropism, proprioception)
}

/// A law that borrows a value which is neither `Send` nor `'static`.
struct Counted<'a>(&'a Cell<usize>);

impl TropismLaw for Counted<'_> {
    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        self.0.set(self.0.get() + 1);
        Vector3::zeros()
    }
}

#[test]
fn laws_may_borrow_and_need_not_cross_threads() {
    let calls = Cell::new(0);
    let proprioception: Box<dyn TropismLaw> =
        Box::new(Proprioception { sensitivity: ETA }.remembered(MEMORY));
    let mut shoot = righting()
        .tropism((Counted(&calls), proprioception))
        .build()
        .unwrap();
    let _ = MethodOfSteps::new(360.0).advance(&mut shoot, HOUR).unwrap();
    assert!(calls.get() > 0);
    assert!(
        Linearisation::about(&shoot).is_err(),
        "a shoot that still rises is not stationary"
    );
}

#[test]
fn declaration_of_combined_laws_lists_variables_stimuli_and_delays() {
    let declared = Declaration::of(&all_laws());
    assert_eq!(
        declared.size(),
        Size {
            variables: 7,
            stimuli: 5,
            reads_present: false
        }
    );
    assert_eq!(declared.size(), all_laws().size());
    assert!(!declared.reads_position());
    let component = |k, turn| {
        Variable::unread()
            .relaxing_in(120.0)
            .approaching(Source::Stimulus(k))
            .turning(turn)
    };
    // No rate depends on the memories of these laws.
    let read = Variable {
        coupled: false,
        ..Variable::read_after(720.0).relaxing_in(720.0)
    };
    let memory = |remembers, rotation| Variable {
        remembers,
        rotation,
        ..read
    };
    let expected = [
        component(0, Rotation::First),
        component(1, Rotation::Second),
        component(2, Rotation::Invariant),
        // These memories follow the normal of the pile and the bend. The stimuli of the bend are
        // declared after the three components of the vertical.
        memory(Source::Variable(0), Rotation::First),
        memory(Source::Variable(1), Rotation::Second),
        memory(Source::Stimulus(3), Rotation::First),
        memory(Source::Stimulus(4), Rotation::Second),
    ];
    assert_eq!(declared.variables(), expected);
    assert_eq!(
        (declared.shortest_delay(), declared.longest_delay()),
        (720.0, 720.0)
    );
    // A law without delayed variables does not limit the step.
    assert_eq!(
        Declaration::of(&Oscillator::new(0.2, 1440.0)).shortest_delay(),
        f64::INFINITY
    );
}

/// Values after a rotation of the directors by `angle` about d3, transformed as their declared
/// rotation requires.
fn turned(values: &[f64], rotation: impl Fn(usize) -> Rotation, angle: f64) -> Vec<f64> {
    let (sin, cos) = angle.sin_cos();
    let turn = |i: usize| match rotation(i) {
        Rotation::First => cos * values[i] + sin * values[i + 1],
        Rotation::Second => cos * values[i] - sin * values[i - 1],
        Rotation::Invariant => values[i],
        Rotation::Undeclared => panic!("the rotation of {i} is undeclared"),
    };
    (0..values.len()).map(turn).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn rates_match_declared_memories_and_rotations(
        y in prop::collection::vec(-2.0_f64..2.0, 7),
        x in prop::collection::vec(-2.0_f64..2.0, 5),
        angle in -3.0_f64..3.0,
    ) {
        // The oscillator is omitted because its phase depends on time and not on the directors.
        let laws = steering(STATOLITHS);
        let declared = Declaration::of(&laws);
        let rates = |y: &[f64], x: &[f64]| {
            let mut rates = vec![0.0; y.len()];
            laws.rates(y, x, &mut rates);
            rates
        };
        let found = rates(&y, &x);
        for (i, variable) in declared.variables().iter().enumerate() {
            let remembered = match variable.remembers {
                Source::Stimulus(k) => x[k],
                Source::Variable(k) => y[k],
                Source::Computed => continue,
            };
            // The rounding is that of one subtraction and one division.
            let (rate, expected) = (found[i] * variable.time_constant, remembered - y[i]);
            prop_assert!(abs_diff_eq!(rate, expected, epsilon = 1e-15), "variable {i}: {rate} against {expected}");
        }
        let variable = |i| declared.rotation(Source::Variable(i));
        let stimulus = |i| declared.rotation(Source::Stimulus(i));
        let (yt, xt) = (turned(&y, variable, angle), turned(&x, stimulus, angle));
        for (rate, expected) in rates(&yt, &xt).iter().zip(turned(&found, variable, angle)) {
            // Rates are below 1/s, because they are at most 2 · 2³/120 s.
            prop_assert!(abs_diff_eq!(*rate, expected, epsilon = 1e-15), "{rate} against {expected}");
        }
        let at = Growing::new(0.0, RADIUS, 0.01);
        let gradient = Rotation3::from_axis_angle(&Vector3::z_axis(), -angle) * laws.gradient(&at, &y, &[]);
        let found = laws.gradient(&at, &yt, &[]);
        // The gradient is at most 0.8 · 2/r + 20 · 2.
        prop_assert!(abs_diff_eq!(InNorm(found), InNorm(gradient), epsilon = 1e-11), "{found} against {gradient}");
    }
}

/// Perception of light from the fixed direction (0.8, 0, 0.6).
struct Sunlight;

impl Perception for Sunlight {
    type Signal = [f64; 2];

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let light = site.along_directors(&Vector3::new(0.8, 0.0, 0.6));
        stimuli.copy_from_slice(&[light.x, light.y]);
    }
}

/// The response to [`Sunlight`] with two chained memories, written as one law.
struct WrittenOut {
    stages: [f64; 2],
    delay: f64,
}

impl TropismLaw for WrittenOut {
    fn declare(&self, to: &mut Declaration) {
        to.stimuli(2);
        for variable in [Variable::unread(), Variable::read_after(self.delay)] {
            let stage = self.stages[usize::from(variable.delay.is_some())];
            to.variable(variable.relaxing_in(stage));
            to.variable(variable.relaxing_in(stage));
        }
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        Sunlight.sense(site, stimuli);
    }
    fn rates(&self, y: &[f64], x: &[f64], rates: &mut [f64]) {
        for j in 0..2 {
            rates[j] = (x[j] - y[j]) / self.stages[0];
            rates[2 + j] = (y[j] - y[2 + j]) / self.stages[1];
        }
    }
    fn gradient(&self, at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::new(-past[3], past[2], 0.0) * (0.8 / at.section.radius())
    }
}

#[test]
fn chained_memories_filter_twice_and_add_their_delays() {
    let light = DirectionalTropism {
        sensitivity: 0.8,
        perception: Sunlight,
    };
    let twice = light
        .remembered(Memory {
            time: 600.0,
            delay: 100.0,
        })
        .remembered(Memory {
            time: 300.0,
            delay: 200.0,
        });
    let declared = Declaration::of(&twice);
    assert_eq!(declared.delays().collect::<Vec<_>>(), [300.0; 2]);
    assert_eq!(declared.variables()[2].remembers, Source::Variable(0));
    fn tip(law: impl TropismLaw + Send + Sync + 'static) -> Vector3<f64> {
        let mut shoot = righting().tropism(law).into_dyn().build().unwrap();
        MethodOfSteps::new(150.0)
            .advance(&mut shoot, 5.0 * HOUR)
            .unwrap();
        shoot.tip()
    }
    let (found, expected) = (
        tip(twice),
        tip(WrittenOut {
            stages: [600.0, 300.0],
            delay: 300.0,
        }),
    );
    // Only the order of operations differs. A stable shoot does not amplify the rounding errors of
    // positions of 5 cm.
    assert_abs_diff_eq!(InNorm(found), InNorm(expected), epsilon = 1e-14);
    let once = DirectionalTropism {
        sensitivity: 0.8,
        perception: Sunlight,
    }
    .remembered(Memory {
        time: 600.0,
        delay: 300.0,
    });
    // The second memory has an effect.
    assert!((tip(once) - expected).norm() > 1e-4);
}

/// A law that responds to the present bend or to its memory. The gradient is NaN if the present or
/// past values that it receives contradict its declaration.
struct Straightens {
    at_once: bool,
}

impl TropismLaw for Straightens {
    fn declare(&self, to: &mut Declaration) {
        let bend = to.stimulus_pair();
        if self.at_once {
            to.with_present();
        } else {
            to.memories(2, bend, 720.0, Some(720.0));
        }
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        stimuli.copy_from_slice(&[site.strain.x, site.strain.y]);
    }
    fn rates(&self, y: &[f64], x: &[f64], rates: &mut [f64]) {
        for (rate, (y, x)) in rates.iter_mut().zip(y.iter().zip(x)) {
            *rate = MEMORY.rate(*y, *x);
        }
    }
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        variables.copy_from_slice(&stimuli[..variables.len()]);
    }
    fn gradient(&self, _at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> {
        if now.is_empty() == self.at_once || past.is_empty() != self.at_once {
            return Vector3::repeat(f64::NAN);
        }
        let bend = if self.at_once { now } else { past };
        Vector3::new(bend[0], bend[1], 0.0) * -ETA
    }
}

#[test]
fn present_stimuli_are_empty_for_laws_that_do_not_request_them() {
    let gravitropism = || gravitropism(SettledStatoliths);
    for at_once in [false, true] {
        let mut shoot = righting()
            .tropism((gravitropism(), Straightens { at_once }))
            .into_dyn()
            .build()
            .unwrap();
        MethodOfSteps::new(300.0)
            .advance(&mut shoot, 1800.0)
            .unwrap();
        solve_steady_state(&mut shoot).unwrap();
        let both = (Straightens { at_once: true }, Straightens { at_once });
        let mut shoot = righting()
            .tropism((gravitropism(), both))
            .into_dyn()
            .build()
            .unwrap();
        MethodOfSteps::new(300.0)
            .advance(&mut shoot, 1800.0)
            .unwrap();
        solve_steady_state(&mut shoot).unwrap();
        let _ = Linearisation::about(&shoot).unwrap();
    }
}

#[test]
fn tuples_of_laws_act_as_their_sum() {
    let bend = |share: f64| {
        Proprioception {
            sensitivity: share * ETA,
        }
        .remembered(MEMORY)
    };
    let up = |share: f64| {
        DirectionalTropism {
            sensitivity: share * BETA,
            perception: SettledStatoliths,
        }
        .remembered(MEMORY)
    };
    let six = (
        up(0.5),
        bend(0.25),
        up(0.25),
        bend(0.5),
        up(0.25),
        bend(0.25),
    );
    let mut six = righting().tropism(six).into_dyn().build().unwrap();
    let nested = ((up(0.5), up(0.5)), Some(bend(1.0)), None::<Oscillator>);
    let mut nested = righting().tropism(nested).into_dyn().build().unwrap();
    let mut two = righting().into_dyn().build().unwrap();
    for shoot in [&mut six, &mut nested, &mut two] {
        advance(shoot, 4.0 * HOUR);
    }
    // Only the order of sums differs, which changes the rounding errors of positions of 5 cm.
    assert_abs_diff_eq!(InNorm(six.tip()), InNorm(two.tip()), epsilon = 1e-13);
    assert_abs_diff_eq!(InNorm(nested.tip()), InNorm(two.tip()), epsilon = 1e-13);
}

/// Integrates a shoot with steps of 3 min.
fn advance(shoot: &mut Shoot<impl Model>, until: f64) {
    MethodOfSteps::new(180.0).advance(shoot, until).unwrap();
}

#[test]
fn boxed_laws_reproduce_statically_typed_laws_bit_for_bit() {
    let mut shoot = growing().build().unwrap();
    advance(&mut shoot, 2.0 * HOUR);
    let mut boxed = growing().into_dyn().build().unwrap();
    advance(&mut boxed, 2.0 * HOUR);
    assert!(boxed.state() == shoot.state());
}

/// A user-defined model with a field besides its laws.
struct Specimen {
    name: &'static str,
    growth: Ongoing<UniformGrowth>,
    steering: (
        Remembered<DirectionalTropism<SettledStatoliths>>,
        Remembered<Proprioception>,
    ),
    pot: Still,
}

impl Model for Specimen {
    type Growth = Ongoing<UniformGrowth>;
    type Tropism = (
        Remembered<DirectionalTropism<SettledStatoliths>>,
        Remembered<Proprioception>,
    );
    type Constitutive = LinearElastic;
    type Load = Weight;
    type Scene = Still;
    type Support = ();

    fn growth(&self) -> &Ongoing<UniformGrowth> {
        &self.growth
    }
    fn tropism(&self) -> &Self::Tropism {
        &self.steering
    }
    fn constitutive(&self) -> &LinearElastic {
        &YOUNG
    }
    fn load(&self) -> &Weight {
        &WEIGHT
    }
    fn scene(&self) -> &Still {
        &self.pot
    }
    fn support(&self) -> &() {
        &()
    }
}

#[test]
fn user_written_model_matches_the_provided_one() {
    let expected = {
        let mut shoot = righting().build().unwrap();
        advance(&mut shoot, HOUR);
        shoot
    };
    let Laws {
        growth,
        tropism,
        scene,
        ..
    } = *expected.model();
    let specimen = Specimen {
        name: "Helianthus 7",
        growth,
        steering: tropism,
        pot: scene,
    };
    let mut shoot = Shoot::of(specimen)
        .length(0.05)
        .radius(RADIUS)
        .build()
        .unwrap();
    advance(&mut shoot, HOUR);
    assert!(shoot.state() == expected.state());
    assert_eq!(shoot.model().name, "Helianthus 7");
}

#[test]
fn boxed_and_shared_laws_compose_like_plain_laws() {
    let mut expected = righting()
        .tropism(steering(STATOLITHS))
        .into_dyn()
        .build()
        .unwrap();
    advance(&mut expected, HOUR);
    let (plain, proprioception) = steering(STATOLITHS);
    // Perceptions, responses, laws and models may be boxed, shared or borrowed.
    let shared = Arc::new(STATOLITHS);
    let sensed = gravitropism(shared.clone());
    let boxed: Box<dyn Perception<Signal = [f64; 2]> + Send + Sync> = Box::new(&STATOLITHS);
    let dynamic = gravitropism(boxed);
    let answered = Arc::new(plain.response).remembered(MEMORY);
    let laws: [Box<dyn TropismLaw + Send + Sync>; 3] =
        [Box::new(sensed), Box::new(dynamic), Box::new(answered)];
    for law in laws {
        let mut shoot = righting()
            .tropism((law, proprioception))
            .into_dyn()
            .build()
            .unwrap();
        advance(&mut shoot, HOUR);
        assert!(shoot.state() == expected.state());
    }
    let model = Arc::new(expected.model().clone());
    for _ in 0..2 {
        let mut shoot = Shoot::of(model.clone())
            .length(0.05)
            .radius(RADIUS)
            .build()
            .unwrap();
        advance(&mut shoot, HOUR);
        assert!(shoot.state() == expected.state());
    }
}

#[test]
fn shoots_of_different_models_share_a_list_of_simulations() {
    // The two shoots differ in the types of their models.
    let mut alone = (
        righting().build().unwrap(),
        growing().into_dyn().build().unwrap(),
    );
    advance(&mut alone.0, HOUR);
    advance(&mut alone.1, HOUR);
    let mut list: Vec<Box<dyn Simulation + Send>> = vec![
        Box::new((righting().build().unwrap(), MethodOfSteps::new(180.0))),
        Box::new((
            growing().into_dyn().build().unwrap(),
            MethodOfSteps::new(180.0),
        )),
    ];
    let starts: Vec<State> = list
        .iter()
        .map(|simulation| simulation.state().clone())
        .collect();
    for _ in 0..2 {
        std::thread::scope(|scope| {
            for simulation in &mut list {
                scope.spawn(move || {
                    while simulation.state().time() < HOUR {
                        assert_eq!(simulation.step(HOUR).unwrap().steps, 1);
                    }
                });
            }
        });
        assert!(list[0].state() == alone.0.state() && list[1].state() == alone.1.state());
        assert_eq!(list[1].state().rod().tip(), alone.1.tip());
        for (simulation, start) in list.iter_mut().zip(&starts) {
            simulation.restore(start).unwrap();
        }
    }
    assert_eq!(list[0].advance(HOUR).unwrap().splits, 0);
}

/// A list of laws or loads equals the tuple of them.
#[test]
fn lists_of_laws_and_loads_equal_tuples() {
    let (gravitropism, proprioception) = steering(SettledStatoliths);
    let force = |x: f64| Distributed(Vector3::x() * x);
    let boxed: Vec<Box<dyn TropismLaw + Send + Sync>> =
        vec![Box::new(gravitropism), Box::new(proprioception)];
    let loads: Vec<Box<dyn Load + Send + Sync>> =
        vec![Box::new(force(1e-5)), Box::new(force(2e-5))];
    let run = |mut shoot: Shoot<DynLaws>| {
        MethodOfSteps::new(90.0).advance(&mut shoot, HOUR).unwrap();
        shoot.tip()
    };
    let tuple = run(righting()
        .tropism((gravitropism, proprioception))
        .load(force(3e-5))
        .into_dyn()
        .build()
        .unwrap());
    let list = run(righting()
        .tropism(boxed)
        .load(loads)
        .into_dyn()
        .build()
        .unwrap());
    // Only the order of additions differs.
    approx::assert_abs_diff_eq!((tuple - list).norm(), 0.0, epsilon = 1e-14);
    let same = run(righting()
        .tropism(vec![proprioception; 2])
        .into_dyn()
        .build()
        .unwrap());
    let pair = run(righting()
        .tropism((proprioception, proprioception))
        .into_dyn()
        .build()
        .unwrap());
    assert_eq!(same, pair);
}
