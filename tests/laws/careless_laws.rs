//! Tropism laws whose declarations contradict what they compute are refused.

use crate::fixtures::shoots::{HOUR, MEMORY, RADIUS, STATOLITHS, YOUNG, righting, steering};
use morphorod::check;
use morphorod::constitutive::Tissue;
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::support::Sphere;
use morphorod::tropism::{
    Declaration, DirectionalTropism, Gravitropism, Growing, Perception, Response,
    SettledStatoliths, Site, Source, TropismLaw, Variable,
};
use nalgebra::Vector3;

/// A law with configurable declarations that writes only the rates of its first `written`
/// variables.
#[derive(Debug)]
struct Careless {
    variable: Variable,
    declared: usize,
    written: usize,
    with_position: bool,
}

impl TropismLaw for Careless {
    fn declare(&self, to: &mut Declaration) {
        to.stimuli(1);
        for _ in 0..self.declared {
            to.variable(self.variable);
        }
        if self.with_position {
            to.with_position();
        }
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        stimuli[0] = site.position.x;
    }
    fn rates(&self, _y: &[f64], _x: &[f64], rates: &mut [f64]) {
        rates[..self.written].fill(0.0);
    }
    fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::x() * past[0]
    }
}

#[test]
fn laws_that_contradict_their_declarations_are_refused() {
    let sound = Careless {
        variable: Variable::read_after(720.0),
        declared: 2,
        written: 2,
        with_position: true,
    };
    let start = |law: Careless| {
        let mut shoot = righting().tropism(law).into_dyn().build().unwrap();
        let before = shoot.state().clone();
        let answer = MethodOfSteps::new(90.0).advance(&mut shoot, 90.0);
        assert!(answer.is_ok() || shoot.state() == &before);
        answer.map_err(|error| error.to_string())
    };
    assert!(start(Careless { ..sound }).is_ok());
    assert!(
        start(Careless {
            written: 1,
            ..sound
        })
        .unwrap_err()
        .contains("rate of a variable")
    );
    // Positions are not finite for laws that do not request them.
    assert!(
        start(Careless {
            with_position: false,
            ..sound
        })
        .unwrap_err()
        .contains("not finite")
    );
    // This law keeps the default implementation of the rates.
    struct Forgetful;
    impl TropismLaw for Forgetful {
        fn declare(&self, to: &mut Declaration) {
            let x = to.stimuli(1);
            to.memories(1, x, 720.0, Some(720.0));
        }
        fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
            Vector3::x() * past[0]
        }
    }
    let mut shoot = righting().tropism(Forgetful).into_dyn().build().unwrap();
    assert!(
        MethodOfSteps::new(90.0)
            .advance(&mut shoot, 90.0)
            .unwrap_err()
            .to_string()
            .contains("not finite")
    );
    // This perception declares fewer stimuli than the size of its signal.
    struct Narrow;
    impl Perception for Narrow {
        type Signal = [f64; 2];
        fn declare(&self, to: &mut Declaration) -> Source {
            to.stimuli(1)
        }
        fn sense(&self, _site: &Site, stimuli: &mut [f64]) {
            stimuli.fill(0.0);
        }
    }
    let law = DirectionalTropism {
        sensitivity: 1.0,
        perception: Narrow,
    }
    .remembered(MEMORY);
    let error = righting()
        .tropism(law)
        .into_dyn()
        .build()
        .map(|_| ())
        .unwrap_err();
    assert!(
        error
            .to_string()
            .contains("index of what a variable remembers"),
        "{error}"
    );
    // The rates of this law are not those of its declared memory.
    struct Leaky;
    impl TropismLaw for Leaky {
        fn declare(&self, to: &mut Declaration) {
            let x = to.stimuli(1);
            to.memories(1, x, 720.0, Some(720.0));
        }
        fn sense(&self, _site: &Site, stimuli: &mut [f64]) {
            stimuli[0] = 1.0;
        }
        fn rates(&self, y: &[f64], x: &[f64], rates: &mut [f64]) {
            rates[0] = (x[0] - 1.1 * y[0]) / 700.0;
        }
        fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
            Vector3::x() * past[0]
        }
    }
    let mut shoot = righting().tropism(Leaky).into_dyn().build().unwrap();
    let error = MethodOfSteps::new(90.0)
        .advance(&mut shoot, 90.0)
        .unwrap_err()
        .to_string();
    assert!(error.contains("declared a memory"), "{error}");
    // This perception does not write the rate of its own variable. It is refused even after a run
    // of another shoot with the same integrator, which leaves finite numbers in the work space.
    struct Lazy;
    impl Perception for Lazy {
        type Signal = [f64; 2];
        fn declare(&self, to: &mut Declaration) -> Source {
            to.variable(Variable::unread());
            to.stimulus_pair()
        }
        fn sense(&self, site: &Site, stimuli: &mut [f64]) {
            let light = site.along_directors(&Vector3::new(0.8, 0.0, 0.6));
            stimuli.copy_from_slice(&[light.x, light.y]);
        }
    }
    let mut run = MethodOfSteps::new(90.0);
    run.advance(&mut righting().into_dyn().build().unwrap(), HOUR)
        .unwrap();
    let law = DirectionalTropism {
        sensitivity: 1.0,
        perception: Lazy,
    }
    .remembered(MEMORY);
    let mut shoot = righting().tropism(law).into_dyn().build().unwrap();
    assert!(
        run.advance(&mut shoot, 90.0)
            .unwrap_err()
            .to_string()
            .contains("not finite")
    );
    // Declarations are checked when the shoot is built.
    for delay in [-5.0, f64::NAN, f64::INFINITY] {
        let law = Careless {
            variable: Variable::read_after(delay),
            ..sound
        };
        assert!(
            righting()
                .tropism(law)
                .into_dyn()
                .build()
                .unwrap_err()
                .to_string()
                .contains("delay of a tropism law")
        );
    }
    for time in [0.0, -600.0, f64::NAN] {
        let law = Careless {
            variable: sound.variable.relaxing_in(time),
            ..sound
        };
        assert!(
            righting()
                .tropism(law)
                .into_dyn()
                .build()
                .unwrap_err()
                .to_string()
                .contains("time constant of a variable")
        );
    }
}

/// A law that declares one more variable and stimulus from call `n` of `declare` on, counted from
/// zero.
struct Widening {
    answers: std::sync::atomic::AtomicUsize,
    n: usize,
}

impl TropismLaw for Widening {
    fn declare(&self, to: &mut Declaration) {
        let answers = self
            .answers
            .fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        for _ in 0..1 + usize::from(answers >= self.n) {
            let x = to.stimuli(1);
            to.memories(1, x, 720.0, Some(720.0));
        }
    }
    fn sense(&self, _site: &Site, stimuli: &mut [f64]) {
        stimuli.fill(1.0);
    }
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        for (k, rate) in rates.iter_mut().enumerate() {
            *rate = (stimuli[k] - variables[k]) / 720.0;
        }
    }
    fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::x() * past[0]
    }
}

#[test]
fn law_that_changes_its_declarations_at_any_time_is_refused() {
    let (mut refused, mut unharmed) = (0, 0);
    for n in (0..200).chain((200..9000).step_by(97)) {
        let law = Widening {
            answers: 0.into(),
            n,
        };
        // The law is between two laws of the crate. An additional variable would shift those of the
        // second one.
        let Ok(mut shoot) = righting()
            .elements(2)
            .tropism((steering(STATOLITHS), law, steering(STATOLITHS)))
            .into_dyn()
            .build()
        else {
            refused += 1;
            continue;
        };
        let mut integrator = MethodOfSteps::new(180.0);
        for hour in 1..=2 {
            let before = shoot.state().clone();
            match integrator.advance(&mut shoot, 0.5 * HOUR * f64::from(hour)) {
                Ok(_) => unharmed += 1,
                Err(error) => {
                    refused += 1;
                    assert!(!error.is_recoverable(), "{error}");
                    assert_eq!(shoot.state(), &before);
                }
            }
        }
    }
    assert!(refused > 100 && unharmed > 0, "{refused} {unharmed}");
}

/// A law that writes its stimulus at the apex only: the point next to it.
struct Apical;

impl TropismLaw for Apical {
    fn declare(&self, to: &mut Declaration) {
        let x = to.stimuli(1);
        to.memories(1, x, 720.0, Some(720.0));
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        if site.apex_distance < 2e-3 {
            stimuli[0] = 1.0;
        }
    }
    fn rates(&self, y: &[f64], x: &[f64], rates: &mut [f64]) {
        rates[0] = (x[0] - y[0]) / 720.0;
    }
    fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::x() * past[0]
    }
}

#[test]
fn law_that_does_not_write_a_stimulus_at_each_point_is_refused() {
    let mut shoot = righting().tropism(Apical).into_dyn().build().unwrap();
    let (rod, before) = (shoot.rod(), shoot.state().clone());
    let written = rod
        .points()
        .iter()
        .filter(|point| point.apex_distance < 2e-3)
        .count();
    assert!(written > 0 && written < rod.points().len(), "{written}");
    let error = MethodOfSteps::new(90.0)
        .advance(&mut shoot, 90.0)
        .unwrap_err()
        .to_string();
    assert!(error.contains("stimulus of a tropism law"), "{error}");
    assert_eq!(shoot.state(), &before);
}

#[test]
fn checks_of_laws_at_no_place_are_errors() {
    let obstacle = Sphere {
        centre: Vector3::x(),
        radius: 0.1,
    };
    let perception = SettledStatoliths;
    let gravitropism = Gravitropism {
        sensitivity: 0.8,
        perception,
    };
    let tissue = Tissue::young(RADIUS);
    for answer in [
        check::elastic_law(&YOUNG, &tissue, &[]),
        check::growth_law(
            &UniformGrowth {
                zone_length: 0.04,
                time: 72e3,
            },
            &[],
            3600.0,
        ),
        check::tropism_law(&gravitropism.remembered(MEMORY), &[]),
        check::response(&gravitropism, &[]),
        check::perception(&perception, &[]),
        check::obstacle(&obstacle, &[], 0.0),
    ] {
        let error = answer.unwrap_err();
        assert_eq!(
            (error.quantity, error.value),
            (check::Quantity::Points, 0.0)
        );
        assert!(
            error
                .to_string()
                .contains("is 0 in the arguments of the check but must be at least 1"),
            "{error}"
        );
    }
}
