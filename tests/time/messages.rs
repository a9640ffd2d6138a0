//! Messages of mistakes of a new user: each names its cause, without NaN, infinity, `0.000e0` and
//! rows of zeros.

use std::error::Error;

use crate::fixtures::shoots::{RADIUS, WEIGHT, growing, righting, rod, tissue};
use morphorod::constitutive::Constitutive;
use morphorod::cycle::{PeriodicSolver, RotatingWaveSolver};
use morphorod::equilibrium::{Equilibrium, EquilibriumError, EquilibriumSolver, NewtonSolver};
use morphorod::fit::{Family, Fit, Series};
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Adaptive, Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, InternalForce, PointForce, Weight};
use morphorod::rod::Rod;
use morphorod::stability::{Linearisation, onset};
use morphorod::support::{Contact, Hold, Moving, Sphere};
use morphorod::tracking::Track;
use morphorod::tropism::{Memory, Oscillator, Proprioception, Response};
use morphorod::{DynLaws, ShootBuilder, Still};
use nalgebra::{Vector2, Vector3};

const NAN: f64 = f64::NAN;
const INF: f64 = f64::INFINITY;

pub(super) type Outcome = Result<(), Box<dyn Error>>;

fn build(builder: ShootBuilder<DynLaws>) -> Outcome {
    builder.build()?;
    Ok(())
}

/// Advances a shoot by an hour, after a change of the integrator.
pub(super) fn run(
    builder: ShootBuilder<DynLaws>,
    change: impl FnOnce(&mut MethodOfSteps),
) -> Outcome {
    let mut integrator = MethodOfSteps::new(120.0);
    change(&mut integrator);
    let _ = integrator.advance(&mut builder.build()?, 3600.0)?;
    Ok(())
}

/// Newton's method with a mistake.
pub(super) struct Wrong<F>(pub F);

impl<F: FnMut(&mut Rod, &mut Equilibrium)> EquilibriumSolver for Wrong<F> {
    fn equilibrate(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        let mut found = NewtonSolver::default().equilibrate(rod, material, force)?;
        (self.0)(rod, &mut found);
        Ok(found)
    }
}

fn solve(mistake: fn(&mut Rod, &mut Equilibrium)) -> Outcome {
    let _ = MethodOfSteps::with_solver(120.0, Wrong(mistake))
        .advance(&mut growing().build()?, 600.0)?;
    Ok(())
}

fn track(times: &[f64], x: f64) -> Outcome {
    let _ = Track::new(times.to_vec(), vec![Vector2::new(x, 0.0); times.len()])?
        .nutation([600.0, 7200.0])?;
    Ok(())
}

fn fit(times: &[f64], x: f64) -> Outcome {
    let family = Family {
        parameters: Vec::new(),
        build: |_: &[f64]| growing().build(),
    };
    let positions = vec![Vector3::new(x, 0.0, 0.05); times.len()];
    let _ = Fit::default().run(&family, &[Series::tips(times.to_vec(), &positions)])?;
    Ok(())
}

/// Searches for an orbit of a given period (s) of a shoot with an oscillator of 1440 s.
fn forced_by_oscillator(period: f64) -> Outcome {
    let shoot = righting()
        .tropism(Oscillator::new(0.1, 1440.0))
        .scene(Still::upright())
        .build()?;
    let _ = PeriodicSolver::default().forced(&shoot, period)?;
    Ok(())
}

fn mode(amplitude: f64) -> Outcome {
    let shoot = righting().scene(Still::upright()).build()?;
    let root = Linearisation::about(&shoot)?.rightmost()?;
    let _ = RotatingWaveSolver::default().from_mode(&shoot, &root, amplitude)?;
    Ok(())
}

/// Fails unless an answer is an error whose message contains the words and is readable.
pub(super) fn assert_says<T>(answer: Result<T, impl Error + 'static>, words: &str) {
    assert_clear(vec![(words, answer.map(|_| ()).map_err(Box::from))]);
}

/// Fails unless all outcomes are errors whose messages contain the words and are readable.
pub(super) fn assert_clear(mistakes: Vec<(&str, Outcome)>) {
    for (words, outcome) in mistakes {
        let text = outcome.expect_err(words).to_string();
        assert!(text.contains(words), "“{text}” does not contain “{words}”");
        let bad = ["NaN", "inf ", "inf,", "0.0e0", "0.000e0", "00000000"]
            .into_iter()
            .find(|bad| text.contains(bad));
        assert!(
            bad.is_none() && (15..400).contains(&text.len()),
            "“{text}”: {bad:?}"
        );
    }
}

#[test]
fn messages_of_the_builder_name_value_and_requirement() {
    let sensitive = Proprioception { sensitivity: 1.0 };
    let tissue = tissue(INF);
    let far = PointForce {
        initial_apex_distance: 10.0,
        force: Vector3::x(),
    };
    let sphere = |friction| Contact {
        obstacle: Sphere {
            centre: Vector3::x(),
            radius: 0.1,
        },
        radius: RADIUS,
        friction,
    };
    assert_clear(vec![
        (
            "length is not a number but must be positive and finite (m)",
            build(growing().length(NAN).into_dyn()),
        ),
        (
            "length is infinite",
            build(growing().length(INF).into_dyn()),
        ),
        (
            "length is minus infinity",
            build(growing().length(-INF).into_dyn()),
        ),
        (
            "radius is 0.5 but must be positive and smaller than the length (m)",
            build(growing().radius(0.5).into_dyn()),
        ),
        (
            "at least 2, the ends of the shoot",
            build(growing().nodes(&[]).into_dyn()),
        ),
        (
            "arc length of a node",
            build(growing().length(0.05).nodes(&[0.0, NAN, 0.05]).into_dyn()),
        ),
        (
            "Young's modulus is infinite",
            build(rod(tissue, 0.05).into_dyn()),
        ),
        (
            "tilt or frame of the base is not a number",
            build(growing().scene(Still::tilted(NAN)).into_dyn()),
        ),
        (
            "density is not a number",
            build(growing().load(Weight { density: NAN }).into_dyn()),
        ),
        (
            "load jumps is 10 but must be between 0 and the length",
            build(growing().load(far).into_dyn()),
        ),
        ("are as long as those of the growth zone: are its length", {
            build(
                growing()
                    .growth(UniformGrowth {
                        zone_length: 1e-9,
                        time: 72e3,
                    })
                    .into_dyn(),
            )
        }),
        (
            "growth time is 0",
            build(
                growing()
                    .growth(UniformGrowth {
                        zone_length: 0.04,
                        time: 0.0,
                    })
                    .into_dyn(),
            ),
        ),
        (
            "memory time is 0",
            build(
                growing()
                    .tropism(sensitive.remembered(Memory {
                        time: 0.0,
                        delay: 1.0,
                    }))
                    .into_dyn(),
            ),
        ),
        ("phase of the oscillator is infinite", {
            build(
                growing()
                    .tropism(Oscillator {
                        phase: INF,
                        ..Oscillator::new(0.2, 1440.0)
                    })
                    .into_dyn(),
            )
        }),
        (
            "held position is not a number",
            build(
                growing()
                    .support(Hold::apex().at(Vector3::repeat(NAN)))
                    .into_dyn(),
            ),
        ),
        (
            "friction is -0.3",
            build(growing().support(sphere(-0.3)).into_dyn()),
        ),
        (
            "friction is not a number",
            build(growing().support(sphere(NAN)).into_dyn()),
        ),
    ]);
}

#[test]
fn messages_of_runs_name_the_first_cause() {
    let leaving = Moving(|t: f64| Hold::apex().at(Vector3::z() * (0.045 + 1e-4 * t)));
    let broken = ApicalForce(|t: f64| Vector3::x() * if t > 1000.0 { NAN } else { 0.0 });
    let idle = |run: &mut MethodOfSteps| (run.solver.max_iterations, run.retries) = (0, 60);
    let memory = Memory {
        time: 1e-300,
        delay: 720.0,
    };
    let until = |condition: f64| -> Outcome {
        let _ = MethodOfSteps::new(120.0)
            .advance_until(&mut growing().build()?, 600.0, |_| condition)?;
        Ok(())
    };
    let adaptive = |tolerance: f64| -> Outcome {
        let _ = Adaptive::new(tolerance).advance(&mut growing().build()?, 600.0)?;
        Ok(())
    };
    assert_clear(vec![
        (
            "time step is not a number",
            run(growing().into_dyn(), |run| run.step = NAN),
        ),
        (
            "tolerance of the equilibrium is 0",
            run(growing().into_dyn(), |run| run.solver.tolerance = 0.0),
        ),
        (
            "exceeds its limit `max_work` of 0 evaluations",
            run(growing().into_dyn(), |run| run.max_work = 0),
        ),
        (
            "no equilibrium after 0 iterations: no step was accepted;",
            run(growing().into_dyn(), idle),
        ),
        (
            "memory time is too short",
            run(
                growing()
                    .tropism(Proprioception { sensitivity: 1.0 }.remembered(memory))
                    .into_dyn(),
                |_| (),
            ),
        ),
        (
            "the force of the load on the rod is not finite",
            run(growing().load(broken).into_dyn(), |run| run.retries = 60),
        ),
        (
            "at 240 s: distance of a hold from the base is 0.069",
            run(growing().load(WEIGHT).support(leaving).into_dyn(), |run| {
                run.retries = 2
            }),
        ),
        ("its value is minus infinity", until(-INF)),
        ("the condition is not finite", until(NAN)),
        ("tolerance is not a number", adaptive(NAN)),
        (
            "the equilibrium solver has changed the material points of the rod",
            solve(|rod, _| rod.set_intrinsic(|_| Vector3::x() * 5.0)),
        ),
        (
            "error that the equilibrium solver reports is not a number",
            solve(|_, found| found.error = NAN),
        ),
        (
            "error that the equilibrium solver reports is -1",
            solve(|_, found| found.error = -1.0),
        ),
        (
            "energy that the equilibrium solver reports is infinite",
            solve(|_, found| found.energy = INF),
        ),
        (
            "jump that the equilibrium solver reports is not a number",
            solve(|_, found| found.jump = Some(NAN)),
        ),
        (
            "margin of stability that the equilibrium solver reports",
            solve(|_, found| found.inertia.margin = NAN),
        ),
    ]);
}

#[test]
fn messages_of_analyses_name_the_wrong_input() {
    let line = |length: f64| {
        Linearisation::about(&righting().length(length).scene(Still::upright()).build()?)
    };
    let period = |period: f64| -> Outcome {
        let shoot = righting().scene(Still::upright()).build()?;
        let _ = PeriodicSolver::default().forced(&shoot, period)?;
        Ok(())
    };
    assert_clear(vec![
        ("the number of positions is 0", track(&[], 0.0)),
        ("position number 0 is not finite", track(&[0.0, 1.0], NAN)),
        (
            "position number 1 has a time that is not later",
            track(&[1.0, 0.0], 0.0),
        ),
        ("series 0 has no frames", fit(&[], 0.0)),
        (
            "frame number 0 of series 0 has a coordinate that is not finite",
            fit(&[1.0, 2.0], NAN),
        ),
        (
            "frame number 1 of series 0 has a time that is not later",
            fit(&[2.0, 1.0], 0.0),
        ),
        ("amplitude of the initial guess is 20", mode(20.0)),
        ("amplitude of the initial guess is not a number", mode(NAN)),
        ("period is not a number", period(NAN)),
        (
            "the forcing must be the same after the given period",
            forced_by_oscillator(1000.0),
        ),
        (
            "start of the parameter's range is not a number",
            onset(line, NAN, 0.06).map(|_| ()).map_err(Box::from),
        ),
        (
            "end of the parameter's range is 0.06 but must be another value than its start",
            onset(line, 0.06, 0.06).map(|_| ()).map_err(Box::from),
        ),
        (
            "no root crosses the axis",
            onset(line, 0.02, 0.03).map(|_| ()).map_err(Box::from),
        ),
    ]);
}
