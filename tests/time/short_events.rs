//! Events that are shorter than the steps of a run.

use super::tolerance::{Path, distance};
use crate::fixtures::shoots::{WEIGHT, reduced};
use morphorod::integrator::{Adaptive, Integrator, MethodOfSteps, Statistics};
use morphorod::load::{Load, Pulse, Whirl};
use morphorod::tropism::{Memory, Proprioception, Response};
use morphorod::{DynLaws, Shoot, Still};
use nalgebra::Vector3;

const END: f64 = 4000.0;

/// Shoot on a tilted base with proprioception of a given memory time and delay (s), its weight and
/// an additional load.
fn pushed(load: impl Load + Send + Sync + 'static, time: f64, delay: f64) -> Shoot<DynLaws> {
    reduced(0.05, 72e3)
        .tropism(Proprioception { sensitivity: 20.0 }.remembered(Memory { time, delay }))
        .scene(Still::tilted(0.5))
        .load((WEIGHT, load))
        .into_dyn()
        .build()
        .unwrap()
}

/// Shapes at 21 equidistant times and at times during the event and shortly after it.
fn path(
    mut shoot: Shoot<DynLaws>,
    integrator: &mut impl Integrator,
    event: f64,
) -> (Path, Statistics) {
    let mut times: Vec<f64> = (0..=20).map(|k| END * f64::from(k) / 20.0).collect();
    times.extend([0.25, 0.5, 0.75, 1.0, 1.2, 1.5].map(|share| share * event));
    times.sort_by(f64::total_cmp);
    times.dedup();
    let mut path = Path::new();
    let show = |shoot: &Shoot<_>| path.push((shoot.rod().length(), shoot.rod().centre_line_at(5)));
    let statistics = integrator
        .advance_showing(&mut shoot, END, times.iter().copied(), show)
        .unwrap();
    (path, statistics)
}

#[test]
fn events_shorter_than_a_step_keep_the_tolerance() {
    let whirl = || {
        pushed(
            Whirl {
                force: 3e-5,
                period: 300.0,
                turns: 1.0,
            },
            720.0,
            720.0,
        )
    };
    let pulse = |duration: f64| Pulse {
        peak: Vector3::new(0.0, 3e-5, 0.0),
        start: 0.0,
        duration,
    };
    let (slow, fast) = (
        || pushed(pulse(300.0), 720.0, 720.0),
        || pushed(pulse(60.0), 240.0, 137.0),
    );
    type Scene<'a> = (&'a dyn Fn() -> Shoot<DynLaws>, f64, [f64; 2]);
    let scenes: [Scene; 3] = [
        (&whirl, 300.0, [1e-4, 1e-6]),
        (&slow, 300.0, [1e-4, 1e-6]),
        (&fast, 60.0, [1e-5, 1e-7]),
    ];
    for (scene, (shoot, event, tolerances)) in scenes.iter().enumerate() {
        // The reference divides the event into 30 steps. With 60 steps it changes by less than a
        // tenth of the errors below.
        let mut fine = MethodOfSteps::new(event / 30.0);
        (fine.tolerance, fine.solver.tolerance) = (1e-12, 1e-12);
        let (exact, _) = path(shoot(), &mut fine, *event);
        for tolerance in *tolerances {
            let (found, statistics) = path(shoot(), &mut Adaptive::new(tolerance), *event);
            let (error, estimate) = (distance(&found, &exact), statistics.error.unwrap());
            assert!(
                error <= tolerance,
                "scene {scene}, {tolerance:e}: error {error:e}"
            );
            // Documented range of the ratio of estimate to error.
            let ratio = estimate / error;
            assert!(
                (0.1..30.0).contains(&ratio),
                "scene {scene}, {tolerance:e}: error {error:e}, estimate {estimate:e}"
            );
        }
    }
}

/// The first call ends before a pulse that begins one delay after the start of the run. A second
/// pulse begins at the same time or up to 1e-4 s later.
#[test]
fn discontinuities_that_nearly_coincide_are_passed() {
    let pulse = |start: f64| Pulse {
        peak: Vector3::new(0.0, 3e-5, 0.0),
        start,
        duration: 60.0,
    };
    for (gap, stop) in [
        (0.0, 719.95),
        (0.0, 719.999),
        (1e-10, 719.95),
        (1e-12, 500.0),
        (1e-4, 500.0),
    ] {
        let mut shoot = pushed((pulse(720.0), pulse(720.0 + gap)), 720.0, 720.0);
        let mut integrator = Adaptive::new(1e-5);
        for until in [stop, END] {
            let cost = integrator
                .advance(&mut shoot, until)
                .unwrap_or_else(|error| panic!("{gap:e}, {stop}: {error}"));
            // The larger count is 58 steps if both pulses begin at the same time. Very short
            // steps would increase this number.
            assert!(cost.steps <= 70, "{gap:e}, {stop}: {cost:?}");
        }
    }
}
