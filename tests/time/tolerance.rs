//! Digits instead of steps: an integrator that is given a tolerance keeps it, and its estimate is near the true error.

use crate::fixtures::shoots;
use std::f64::consts::FRAC_PI_2;

use crate::fixtures::shoots::{HOUR, RADIUS, WEIGHT, YOUNG, growing, righting, steering};
use morphorod::constitutive::{Lignifying, LinearElastic};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{
    Adaptive, EmptyHistory, IntegrationError, Integrator, Iterated, MethodOfSteps, SteadyHistory,
};
use morphorod::load::{ApicalForce, Pulse, Weight};
use morphorod::tropism::{
    Gravitropism, Memory, Oscillator, Perception, Proprioception, Response, SettledStatoliths, Statoliths,
};
use morphorod::{DynLaws, Model, Shoot, Still};
use nalgebra::Vector3;

/// Where a shoot is at equal times: its length, and places along it.
type Place = (f64, Vec<Vector3<f64>>);
type Path = Vec<Place>;

const LOOKS: u32 = 23;

fn path(mut shoot: Shoot<impl Model>, integrator: &mut impl Integrator, end: f64) -> Result<Path, IntegrationError> {
    let times = (0..=LOOKS).map(|k| (end * f64::from(k) / f64::from(LOOKS)).min(end));
    let mut path = Vec::new();
    let show = |shoot: &Shoot<_>| path.push((shoot.rod().length(), shoot.rod().centre_line_at(5)));
    integrator.advance_showing(&mut shoot, end, times, show)?;
    Ok(path)
}

/// The largest distance between two paths, relative to the length.
fn distance(a: &Path, b: &Path) -> f64 {
    let at = |(a, b): (&Place, &Place)| a.1.iter().zip(&b.1).map(|(x, y)| (x - y).norm() / a.0).fold(0.0, f64::max);
    a.iter().zip(b).map(at).fold(0.0, f64::max)
}

/// The true error and the estimate of a run with a tolerance, against a fine run of fixed resolution.
fn errors<M: Model>(make: impl Fn(usize) -> Shoot<M>, end: f64, step: f64, tolerances: &[f64]) -> Vec<(f64, f64)> {
    let mut fine = MethodOfSteps::new(step);
    fine.solver.tolerance = 1e-12;
    let exact = path(make(14), &mut fine, end).unwrap();
    tolerances
        .iter()
        .map(|&tolerance| {
            let mut integrator = Adaptive::new(tolerance);
            let found = path(make(8), &mut integrator, end).unwrap();
            let mut shoot = make(8);
            let estimate = integrator.advance(&mut shoot, end).unwrap().error.unwrap();
            assert!(estimate <= tolerance, "{estimate:e} for {tolerance:e}");
            (distance(&found, &exact), estimate)
        })
        .collect()
}

#[test]
fn the_tolerance_is_kept_and_the_estimate_is_near() {
    let tolerances = [1e-3, 1e-4, 1e-5, 1e-6];
    let fast = Statoliths { avalanche_time: 1e-3 };
    let all = [
        errors(|n| righting().elements(n).into_dyn().build().unwrap(), 4.0 * HOUR, 15.0, &tolerances),
        errors(
            |n| righting().elements(n).tropism(steering(fast)).into_dyn().build().unwrap(),
            4.0 * HOUR,
            15.0,
            &tolerances,
        ),
        errors(
            |n| growing().elements(n).merge_tolerance(1e-8).into_dyn().build().unwrap(),
            3.0 * HOUR,
            15.0,
            &tolerances,
        ),
    ];
    for (scene, errors) in all.iter().enumerate() {
        for ((error, estimate), tolerance) in errors.iter().zip(tolerances) {
            assert!(*error <= tolerance, "scene {scene}, {tolerance:e}: {error:e}");
            // What was promised of the estimate. That of a run that is looked at is made before it, and belongs to another one: it is
            // held against the error of that in `random_shoots`.
            let ratio = estimate / error;
            assert!(
                ratio > 0.3 && ratio < 60.0,
                "scene {scene}, {tolerance:e}: error {error:e}, estimate {estimate:e}"
            );
        }
    }
}

/// Numbers that look random and are the same in every run.
struct Draw(u64);

impl Draw {
    fn uniform(&mut self, from: f64, to: f64) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        from + (to - from) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn log(&mut self, from: f64, to: f64) -> f64 {
        self.uniform(from.ln(), to.ln()).exp()
    }

    fn chance(&mut self, of: f64) -> bool {
        self.uniform(0.0, 1.0) < of
    }
}

/// What a random shoot came to: whether it kept its tolerance, and its estimate over its true error.
type Verdict = (bool, f64);

fn judge<M: Model>(make: impl Fn(usize) -> Shoot<M>, end: f64, tolerance: f64) -> Option<Verdict> {
    let mut integrator = Adaptive::new(tolerance);
    integrator.max_steps = 15_000;
    let mut shoot = make(8);
    let cost = match integrator.advance(&mut shoot, end) {
        // A shoot that snaps, or falls, has no smooth path.
        Err(IntegrationError::ToleranceNotMet { .. } | IntegrationError::Equilibrium { .. }) => return None,
        cost => cost.unwrap(),
    };
    let last = vec![(shoot.rod().length(), shoot.rod().centre_line_at(5))];
    let elements = (2 * shoot.rod().elements()).clamp(12, 30);
    let mut fine = Iterated::new(0.4 * end / cost.steps as f64);
    (fine.tolerance, fine.solver.tolerance) = (1e-12, 1e-12);
    let exact = path(make(elements), &mut fine, end).unwrap();
    let mut shown = make(8);
    // Its estimate is that of the whole way.
    let estimate = integrator.step(&mut shown, end).unwrap().error.unwrap();
    let found = path(make(8), &mut integrator, end).unwrap();
    let error = distance(&found, &exact);
    let at_end = distance(&last, &exact[LOOKS as usize..].to_vec());
    println!(
        "{tolerance:.1e}: error {error:.1e} on the way, {at_end:.1e} at the end; estimates {estimate:.1e}, {:.1e}",
        cost.error?
    );
    Some((error.max(at_end) <= tolerance, estimate / error))
}

fn random_shoot(seed: u64) -> Option<Verdict> {
    let mut draw = Draw(seed * 7919 + 12345);
    (0..20).for_each(|_| _ = draw.uniform(0.0, 1.0));
    let length = draw.uniform(0.02, 0.07);
    let zone = draw.uniform(0.02, 0.1);
    let young = LinearElastic { youngs_modulus: draw.log(8e6, 4e7), poissons_ratio: 0.5 };
    let mut memory = || Memory { time: draw.log(120.0, 2400.0), delay: draw.log(60.0, 2400.0) };
    let (gravity, mut bend) = (memory(), memory());
    if draw.chance(0.2) {
        bend.delay = 0.0;
    }
    let (beta, eta, avalanche_time) = (draw.uniform(0.1, 1.5), draw.uniform(1.0, 30.0), draw.log(1e-3, 600.0));
    let oscillator = draw.chance(0.3).then(|| Oscillator::new(draw.uniform(0.02, 0.3), draw.log(600.0, 5000.0)));
    let (settled, grows, stiffens) = (draw.chance(0.4), draw.chance(0.5), draw.chance(0.5));
    let (time, tilt) = (draw.uniform(10.0, 60.0) * HOUR, draw.uniform(0.0, 2.5));
    let (end, tolerance) = (draw.log(0.3, 8.0) * HOUR, 10_f64.powf(-draw.uniform(3.0, 7.0)));
    let mature_modulus = if stiffens { 100.0 } else { 1.0 } * young.youngs_modulus;
    let build = |elements: usize| {
        Shoot::builder(Lignifying { young, mature_modulus, time: 72.0 * HOUR })
            .length(length)
            .radius(RADIUS)
            .elements(elements)
            .merge_tolerance(1e-9)
            .load(WEIGHT)
            .scene(Still::tilted(tilt))
    };
    fn laws<P: Perception<Signal = [f64; 2]>>(
        perception: P,
        (oscillator, beta, gravity, eta, bend): (Option<Oscillator>, f64, Memory, f64, Memory),
    ) -> impl morphorod::tropism::TropismLaw {
        (
            oscillator,
            Gravitropism { sensitivity: beta, perception }.remembered(gravity),
            Proprioception { sensitivity: eta }.remembered(bend),
        )
    }
    let steering = (oscillator, beta, gravity, eta, bend);
    let growth = |zone_length: f64| UniformGrowth { zone_length, time };
    let constant = Ongoing(growth(zone.max(length)));
    let slow = Statoliths { avalanche_time };
    match (grows, settled) {
        (true, true) => judge(
            |n| build(n).growth(growth(zone)).tropism(laws(SettledStatoliths, steering)).into_dyn().build().unwrap(),
            end,
            tolerance,
        ),
        (true, false) => judge(
            |n| build(n).growth(growth(zone)).tropism(laws(slow, steering)).into_dyn().build().unwrap(),
            end,
            tolerance,
        ),
        (false, true) => judge(
            |n| build(n).growth(constant).tropism(laws(SettledStatoliths, steering)).into_dyn().build().unwrap(),
            end,
            tolerance,
        ),
        (false, false) => judge(
            |n| build(n).growth(constant).tropism(laws(slow, steering)).into_dyn().build().unwrap(),
            end,
            tolerance,
        ),
    }
}

/// `MORPHOROD_CASES=200 cargo test --workspace --test tolerance random -- --nocapture` draws more and prints what came of them.
#[test]
fn random_shoots() {
    let cases: u64 = std::env::var("MORPHOROD_CASES").map_or(24, |cases| cases.parse().unwrap());
    let verdicts: Vec<Verdict> = (11..11 + cases).filter_map(random_shoot).collect();
    let count = |holds: &dyn Fn(&Verdict) -> bool| verdicts.iter().filter(|verdict| holds(verdict)).count();
    let (all, kept) = (verdicts.len(), count(&|(kept, _)| *kept));
    let near = count(&|(_, ratio)| (0.3..30.0).contains(ratio));
    println!("{all} of {cases} shoots with an answer, {kept} keep the tolerance, {near} estimates within 0.3 and 30");
    // Promised: 97 of 100. Of few, one may miss.
    assert!(all - kept <= 1 + 3 * all / 100, "{kept} of {all}");
    // Eight of ten: where the first trial is far better than what was asked for, the estimate is too large or too small by more.
    assert!(near * 10 >= all * 8, "{near} of {all}");
    assert!(all as u64 * 10 >= cases * 9);
}

#[test]
fn a_shape_at_rest_keeps_its_tolerance() {
    // q ℓ³/(E I) from light to 300, against 64 elements that are 1.1 times as long from each to the next.
    for density in [100.0, 1000.0, 66_000.0] {
        let ratio = 1.1_f64;
        let mut nodes: Vec<f64> = (0..=64).map(|i| 0.0659 * (ratio.powi(i) - 1.0) / (ratio.powi(64) - 1.0)).collect();
        nodes[64] = 0.0659;
        let lying = || {
            Shoot::builder(YOUNG).length(0.0659).radius(RADIUS).load(Weight { density }).scene(Still::tilted(FRAC_PI_2))
        };
        let mut exact = lying().nodes(&nodes).into_dyn().build().unwrap();
        let mut fine = MethodOfSteps::new(1.0);
        fine.solver.tolerance = 1e-13;
        fine.advance(&mut exact, 0.0).unwrap();
        for tolerance in [1e-3, 1e-5, 1e-7, 1e-9, 1e-11] {
            let mut shoot = lying().into_dyn().build().unwrap();
            let cost = Adaptive::new(tolerance).start(&mut shoot, &EmptyHistory).unwrap();
            let error = (shoot.tip() - exact.tip()).norm() / 0.0659;
            let estimate = cost.error.unwrap();
            assert!(
                error <= tolerance && estimate <= 1.01 * tolerance,
                "{density}, {tolerance:e}: {error:e}, {estimate:e}"
            );
            // Rounding comes to 1e-13.
            assert!(estimate > 0.3 * error - 1e-13, "{density}, {tolerance:e}: {estimate:e} for {error:e}");
        }
    }
}

#[test]
fn what_is_no_tolerance_is_refused() {
    let before = righting().into_dyn().build().unwrap();
    let mut shoot = before.clone();
    for tolerance in [0.0, -1e-5, f64::NAN, f64::INFINITY, 1e-13, 0.2] {
        let mut integrator = Adaptive::new(tolerance);
        for error in [
            integrator.advance(&mut shoot, HOUR).unwrap_err(),
            integrator.start(&mut shoot, &EmptyHistory).unwrap_err(),
            integrator.step(&mut shoot, HOUR).unwrap_err(),
        ] {
            assert!(error.to_string().contains("from 1e-12, the smallest that is possible"), "{error}");
        }
        assert!(shoot.state() == before.state());
    }
    // Not in the steps allowed: what was reached is named.
    let mut integrator = Adaptive::new(1e-8);
    integrator.max_steps = 300;
    let error = integrator.advance(&mut shoot, 4.0 * HOUR).unwrap_err();
    let IntegrationError::ToleranceNotMet { tolerance, reached, steps } = error else { panic!("{error}") };
    assert!(tolerance == 1e-8 && reached > 1e-8 && reached < 1e-2 && steps <= 300, "{error}");
    assert!(shoot.state() == before.state());
    assert!(integrator.advance(&mut shoot, f64::NAN).is_err() && integrator.advance(&mut shoot, -1.0).is_err());
    assert!(shoot.state() == before.state());
}

#[test]
fn what_was_chosen_is_part_of_the_state() {
    let end = 3.0 * HOUR;
    let make = || growing().into_dyn().build().unwrap();
    let mut whole = make();
    let mut integrator = Adaptive::new(1e-4);
    let first = integrator.step(&mut whole, end).unwrap();
    assert!(first.steps == 1 && first.trial_steps > 0);
    let kept = whole.state().clone();
    let rest = integrator.advance(&mut whole, end).unwrap();
    assert!(rest.trial_steps == 0 && rest.error == first.error, "the same plan");
    // Elsewhere, and by an integrator that has never seen it.
    let mut resumed = make();
    resumed.restore(&kept).unwrap();
    let again = Adaptive::new(1e-4).advance(&mut resumed, end).unwrap();
    assert!(resumed.state() == whole.state() && again == rest);
    // Another tolerance is another plan.
    let mut other = make();
    other.restore(&kept).unwrap();
    assert!(Adaptive::new(1e-3).advance(&mut other, end).unwrap().trial_steps > 0);
    // Two runs are the same bit by bit.
    let mut twice = make();
    integrator.advance(&mut twice, end).unwrap();
    let mut once = make();
    Adaptive::new(1e-4).advance(&mut once, end).unwrap();
    assert!(once.state() == twice.state());
}

#[test]
fn errors_of_one_call_after_another_add_up() {
    let mut integrator = Adaptive::new(1e-5);
    let mut shoot = righting().into_dyn().build().unwrap();
    integrator.start(&mut shoot, &SteadyHistory).unwrap();
    let mut last = 0.0;
    for hour in 1..=3 {
        let error = integrator.advance(&mut shoot, f64::from(hour) * HOUR).unwrap().error.unwrap();
        assert!(error > last && error <= 1e-5 * f64::from(hour), "{hour}: {error:e}");
        last = error;
    }
    // No time, no error.
    let before = shoot.clone();
    assert_eq!(integrator.advance(&mut shoot, 3.0 * HOUR).unwrap().steps, 0);
    assert!(shoot.state() == before.state());
}

#[test]
fn trials_are_a_part_of_the_work() {
    let mut shoot = growing().into_dyn().build().unwrap();
    let cost = Adaptive::new(1e-5).advance(&mut shoot, 10.0 * HOUR).unwrap();
    // Measured: 222 steps of trials, which are coarse, for 680 of the answer, and 1.4 Newton iterations an equilibrium.
    assert!(cost.trial_steps * 2 <= cost.steps, "{cost:?}");
    assert!(cost.steps < 900 && cost.iterations * 2 < cost.equilibria * 3, "{cost:?}");
    assert!(shoot.rod().elements() <= 24, "{}", shoot.rod().elements());
}

#[test]
fn a_choice_holds_for_its_own_steps_alone() {
    let mut shoot = righting().into_dyn().build().unwrap();
    let mut integrator = Adaptive::new(1e-5);
    integrator.step(&mut shoot, 4.0 * HOUR).unwrap();
    // Coarse steps in between: what was chosen is forgotten with them.
    MethodOfSteps::new(720.0).advance(&mut shoot, HOUR).unwrap();
    assert!(integrator.advance(&mut shoot, 4.0 * HOUR).unwrap().trial_steps > 0);
}

#[test]
fn delays_and_spans_of_any_size() {
    // Far shorter than a step, or than the time ahead.
    for delay in [1e-3, 0.05, 1.0] {
        let memory = |delay: f64| Memory { time: 720.0, delay };
        let laws = || {
            let gravity = Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(memory(delay));
            (gravity, Proprioception { sensitivity: 20.0 }.remembered(memory(720.0)))
        };
        let make = || righting().tropism(laws()).into_dyn().build().unwrap();
        let (mut found, mut exact) = (make(), make());
        let cost = Adaptive::new(1e-5).advance(&mut found, 2.0 * HOUR).unwrap();
        Iterated::new(10.0).advance(&mut exact, 2.0 * HOUR).unwrap();
        let error = (found.tip() - exact.tip()).norm() / 0.05;
        assert!(error < 1e-5 && cost.steps < 3000, "{delay} s: {error:e}, {cost:?}");
    }
    let mut shoot = righting().elements(3).into_dyn().build().unwrap();
    let mut integrator = Adaptive::new(1e-4);
    integrator.advance(&mut shoot, 36000.0).unwrap();
    for until in [36000_f64.next_up(), 36000.0 + 1e-10, 36000.001] {
        integrator.advance(&mut shoot, until).unwrap();
        assert_eq!(shoot.time(), until);
    }
}

#[test]
fn kinks_that_fall_together_and_loads_that_all_but_vanish() {
    // The beginning of the pulse, read after the delay, a rounding or a moment behind its end.
    for duration in [720.0, 720.0_f64.next_down(), 719.95, 720.05] {
        let pulse = Pulse { peak: Vector3::new(1e-6, 0.0, 0.0), start: 1000.1, duration };
        let mut shoot = righting().load((WEIGHT, pulse)).into_dyn().build().unwrap();
        MethodOfSteps::new(120.0).advance(&mut shoot, HOUR).unwrap();
    }
    // A gust whose force falls below the smallest number with all digits.
    let gust = ApicalForce(|t: f64| Vector3::new((-((t - 9000.0) / 120.0).powi(2)).exp() * 1e-5, 0.0, 0.0));
    let mut shoot = shoots::reduced(0.05, 20.0 * HOUR).load((WEIGHT, gust)).into_dyn().build().unwrap();
    MethodOfSteps::new(120.0).advance(&mut shoot, 3.0 * HOUR).unwrap();
}

#[test]
fn growth_whose_tissue_leaves_the_zone() {
    let make = |elements: usize| {
        Shoot::builder(YOUNG)
            .length(0.04)
            .radius(RADIUS)
            .growth(UniformGrowth { zone_length: 0.04, time: 20.0 * HOUR })
            .tropism(steering(SettledStatoliths))
            .load(WEIGHT)
            .scene(Still::tilted(60_f64.to_radians()))
            .elements(elements)
            .merge_tolerance(1e-8)
            .into_dyn()
            .build()
            .unwrap()
    };
    let tolerances = [1e-3, 1e-4, 1e-5, 1e-6];
    for ((error, estimate), tolerance) in errors(make, 6.0 * HOUR, 15.0, &tolerances).iter().zip(tolerances) {
        assert!(*error <= tolerance && estimate / error > 0.3, "{tolerance:e}: {error:e}, {estimate:e}");
    }
    // Steps of 45 s err by 2e-8 here. When positions were interpolated across kinks it took four times as many.
    let cost = Adaptive::new(1e-6).advance(&mut make(8), 6.0 * HOUR).unwrap();
    assert!(cost.steps + cost.trial_steps < 1500, "{} and {}", cost.steps, cost.trial_steps);
}

#[test]
fn a_load_that_is_exchanged() {
    let light = || righting().load(Weight { density: 100.0 });
    let heavy = |shoot: &Shoot<DynLaws>| {
        shoot.with_model(shoot.model().clone().with_load(Weight { density: 20_000.0 }).into_dyn()).unwrap()
    };
    let mut fine = light().elements(32).into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(15.0);
    run.solver.tolerance = 1e-12;
    run.advance(&mut fine, HOUR).unwrap();
    let mut fine = heavy(&fine);
    run.advance(&mut fine, HOUR).unwrap();
    for tolerance in [1e-4, 1e-6] {
        let mut integrator = Adaptive::new(tolerance);
        let mut shoot = light().into_dyn().build().unwrap();
        let before = integrator.advance(&mut shoot, HOUR).unwrap().error.unwrap();
        let mut shoot = heavy(&shoot);
        // At the same time: the elements were chosen for the lighter one.
        let after = integrator.advance(&mut shoot, HOUR).unwrap().error.unwrap();
        let error = (shoot.tip() - fine.tip()).norm() / 0.05;
        assert!(error <= before + tolerance && after > 0.3 * error, "{tolerance:e}: {error:e}, {after:e}");
    }
}

#[test]
fn elements_that_would_fold_are_halved() {
    // P ℓ²/(E I) = 510, straight down on an upright shoot: it is bent over, and hangs beside its base.
    let load = ApicalForce(|_t: f64| Vector3::new(0.0, 0.0, -0.1));
    let make = |elements| {
        Shoot::builder(YOUNG).length(0.05).radius(5e-4).elements(elements).load(load).into_dyn().build().unwrap()
    };
    let (mut shoot, mut fine) = (make(8), make(64));
    let cost = Adaptive::new(1e-6).advance(&mut shoot, 0.0).unwrap();
    assert!(cost.error.is_some_and(|error| error <= 1e-6));
    let _ = MethodOfSteps::new(1.0).advance(&mut fine, 0.0).unwrap();
    // It falls to any side.
    assert!((shoot.tip().z - fine.tip().z).abs() < 1e-6 * 0.05);
}

#[test]
fn elements_that_are_far_too_coarse_are_not_taken_for_steps_that_are() {
    // Without proprioception the tip goes on to curl: the first three elements and five differ by more than 0.02 of the length.
    let (gravitropism, _) = steering(SettledStatoliths);
    let make = |elements: usize| {
        let curls = (gravitropism, Proprioception { sensitivity: 0.0 }.remembered(shoots::MEMORY));
        righting().tropism(curls).elements(elements).into_dyn().build().unwrap()
    };
    for (found, estimate) in errors(make, 24.0 * HOUR, 45.0, &[1e-3, 1e-5]) {
        assert!(found <= 1.01 * estimate && estimate < 30.0 * found, "{found:e}, estimated {estimate:e}");
    }
    let cost = Adaptive::new(1e-4).advance(&mut make(3), 24.0 * HOUR).unwrap();
    assert!(cost.steps + cost.trial_steps < 3000, "{cost:?}");
}

#[test]
fn what_merging_moves_inside_an_element_is_below_the_tolerance() {
    // A shoot that leans and leaves a smooth bend behind its zone: elements that are merged move the line between their ends.
    let make = |elements: usize| {
        Shoot::builder(YOUNG)
            .length(0.04)
            .radius(RADIUS)
            .elements(elements)
            .merge_tolerance(1e-9)
            .growth(UniformGrowth { zone_length: 0.03, time: 20.0 * HOUR })
            .tropism(steering(SettledStatoliths))
            .load(WEIGHT)
            .scene(Still::tilted(0.7))
            .into_dyn()
            .build()
            .unwrap()
    };
    let end = 6.0 * HOUR;
    let mut fine = MethodOfSteps::new(30.0);
    fine.solver.tolerance = 1e-12;
    let exact = path(make(14), &mut fine, end).unwrap();
    for tolerance in [1e-4, 3e-5, 1e-5, 3e-6] {
        let mut integrator = Adaptive::new(tolerance);
        // It takes some hundred, trials included.
        integrator.max_steps = 5000;
        let found = path(make(8), &mut integrator, end).unwrap();
        let error = distance(&found, &exact);
        assert!(error < tolerance, "{tolerance:e}: {error:e}");
    }
}
