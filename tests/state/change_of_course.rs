//! Laws that are exchanged while a shoot lives.

use crate::fixtures::shoots;
use crate::fixtures::shoots::{HOUR, MEMORY, RADIUS, STATOLITHS, WEIGHT, YOUNG, reduced, righting, steering};
use morphorod::constitutive::{Graded, Tissue};
use morphorod::growth::{CosineProfile, NoGrowth, UniformGrowth, length};
use morphorod::integrator::{EmptyHistory, Integrator, MethodOfSteps, SteadyHistory};
use morphorod::load::{ApicalForce, Load, PointForce};
use morphorod::stability::Linearisation;
use morphorod::tropism::{
    Declaration, Growing, Memory, Perception, Proprioception, Response, SettledStatoliths, Site, Source, Statoliths,
    TropismLaw,
};
use morphorod::{Laws, Model, Order, Scene, Shoot, State, StateError, Still, Turned};
use nalgebra::{UnitQuaternion, Vector3};

const STEP: f64 = 120.0;
const CHANGE: f64 = 2.3 * HOUR;
const END: f64 = 5.0 * HOUR;

fn run(shoot: &mut Shoot<impl Model>, until: f64) {
    let _ = MethodOfSteps::new(STEP).advance(shoot, until).expect("advances");
}

/// Gravitropism and proprioception, multiplied by `factor` from `CHANGE` on, which it announces.
struct Weakened(f64);

impl TropismLaw for Weakened {
    fn declare(&self, to: &mut Declaration) {
        steering(STATOLITHS).declare(to);
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        steering(STATOLITHS).sense(site, stimuli);
    }
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        steering(STATOLITHS).rates(variables, stimuli, rates);
    }
    fn at_rest(&self, stimuli: &[f64], variables: &mut [f64]) {
        steering(STATOLITHS).at_rest(stimuli, variables);
    }
    fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> {
        steering(STATOLITHS).gradient(at, past, now) * if at.time >= CHANGE { self.0 } else { 1.0 }
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        if t < CHANGE { CHANGE } else { f64::INFINITY }
    }
}

#[test]
fn a_parameter_moved_by_hand_is_a_law_that_announces_its_change() {
    let mut announced = righting().tropism(Weakened(0.3)).build().unwrap();
    run(&mut announced, END);
    let mut shoot = righting().tropism(steering(STATOLITHS)).build().unwrap();
    run(&mut shoot, CHANGE);
    let (mut gravitropism, mut proprioception) = shoot.model().tropism;
    gravitropism.response.sensitivity *= 0.3;
    proprioception.response.sensitivity *= 0.3;
    let model = Laws { tropism: (gravitropism, proprioception), ..*shoot.model() };
    shoot.set_model(model).unwrap();
    run(&mut shoot, END);
    // The same steps and the same numbers, but that the announced law is read beside its change, by units of rounding of time.
    let apart = (shoot.tip() - announced.tip()).norm();
    assert!(apart < 1e-15, "{apart} m");
    // The change shows.
    let mut unchanged = righting().tropism(steering(STATOLITHS)).build().unwrap();
    run(&mut unchanged, END);
    assert!((unchanged.tip() - announced.tip()).norm() > 1e-5);
}

#[test]
fn a_scene_exchanged_is_a_pot_that_is_turned() {
    let turned = || reduced(0.05, 20.0 * HOUR);
    let mut announced = turned().scene(Turned::tilted(0.5, CHANGE, f64::INFINITY)).build().unwrap();
    run(&mut announced, END);
    let mut shoot = turned().build().unwrap();
    run(&mut shoot, CHANGE);
    let laws = Laws { scene: Still::tilted(0.5), ..*shoot.model() };
    let mut shoot = shoot.with_model(laws).unwrap();
    run(&mut shoot, END);
    assert!((shoot.tip() - announced.tip()).norm() < 1e-15 && shoot.tip().x > 0.001);
}

#[test]
fn a_load_is_hung_on_and_taken_off_at_once() {
    let force = Vector3::new(1e-5, 0.0, -2e-5);
    let mut shoot = reduced(0.05, 20.0 * HOUR).build().unwrap();
    run(&mut shoot, CHANGE);
    let before = shoot.tip();
    let load = (WEIGHT, ApicalForce(move |_| force));
    let Laws { constitutive, growth, tropism, scene, .. } = *shoot.model();
    let mut pulled = shoot.with_model(Laws { constitutive, growth, tropism, load, scene }).unwrap();
    assert_eq!(pulled.tip(), before, "the shape is found by an integrator");
    // To the present time: nothing but the new shape.
    let statistics = MethodOfSteps::new(STEP).advance(&mut pulled, CHANGE).unwrap();
    assert_eq!((statistics.steps, statistics.equilibria), (0, 1));
    assert!(pulled.tip().x > 5e-4);
    let mut released = pulled.with_model(*shoot.model()).unwrap();
    run(&mut released, CHANGE);
    assert!((released.tip() - before).norm() < 1e-12);
}

#[test]
fn tissue_outside_a_shorter_zone_stops_growing() {
    let (initial, zone, time) = (0.05, 0.06, 20.0 * HOUR);
    let mut shoot = Shoot::builder(YOUNG)
        .length(initial)
        .radius(RADIUS)
        .growth(UniformGrowth { zone_length: zone, time })
        .tropism(steering(SettledStatoliths))
        .load(WEIGHT)
        .scene(Still::tilted(0.3))
        .build()
        .unwrap();
    // Once while everything grows, once when a part is mature already.
    for (change, new_zone) in [(2.0 * HOUR, 0.017), (8.0 * HOUR, 0.03)] {
        let mut shoot = shoot.clone();
        run(&mut shoot, change);
        let old = length(&UniformGrowth { zone_length: zone, time }, initial, change);
        let laws = Laws { growth: UniformGrowth { zone_length: new_zone, time: 30.0 * HOUR }, ..*shoot.model() };
        shoot.set_model(laws).unwrap();
        let range = shoot.rod().growth_zone();
        assert!((range.end - range.start - new_zone).abs() < 1e-15);
        run(&mut shoot, change + 3.0 * HOUR);
        let expected = old + new_zone / (30.0 * HOUR) * 3.0 * HOUR;
        assert!((shoot.rod().length() - expected).abs() < 1e-12, "{} for {expected}", shoot.rod().length());
        let range = shoot.rod().growth_zone();
        assert!((range.end - range.start - new_zone).abs() < 1e-12);
        assert!(shoot.mesh().longest_element <= new_zone / 8.0 * (1.0 + 1e-12));
        // What stopped at the change says so.
        let stopped = shoot.rod().points().iter().filter(|point| point.exit_time == change).count();
        assert!(stopped > 0);
        // A zone that would wake it is refused, and growth may end altogether.
        let wide = Laws { growth: UniformGrowth { zone_length: zone, time }, ..*shoot.model() };
        let error = shoot.with_model(wide).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains("growth zone is 0.06"), "{error}");
        let Laws { constitutive, tropism, load, scene, .. } = *shoot.model();
        let mut still = shoot.with_model(Laws { constitutive, growth: NoGrowth, tropism, load, scene }).unwrap();
        let (length, strains) = (still.rod().length(), still.rod().points().to_vec());
        run(&mut still, change + 6.0 * HOUR);
        assert_eq!(still.rod().length(), length);
        assert!(still.rod().points().iter().zip(&strains).all(|(now, then)| now.intrinsic == then.intrinsic));
    }
    run(&mut shoot, HOUR);
}

#[test]
fn a_point_force_that_is_hung_on_gets_its_node() {
    let mut shoot = reduced(0.05, 20.0 * HOUR).build().unwrap();
    run(&mut shoot, HOUR);
    let force = Vector3::new(2e-5, 0.0, 0.0);
    let elements = shoot.rod().elements();
    for (apex_distance, more) in [(0.0137, 1), (0.05 / 8.0, 0), (0.0, 0), (0.05, 0)] {
        let Laws { constitutive, growth, tropism, scene, .. } = *shoot.model();
        let load = (WEIGHT, PointForce { initial_apex_distance: apex_distance, force });
        let mut pulled = shoot.with_model(Laws { constitutive, growth, tropism, load, scene }).unwrap();
        assert_eq!(pulled.rod().elements(), elements + more);
        assert!(pulled.rod().centre_line().iter().any(|(s, _)| (s - (0.05 - apex_distance)).abs() < 1e-12));
        run(&mut pulled, 2.0 * HOUR);
    }
}

#[test]
fn a_change_survives_saving() {
    let mut shoot = righting().build().unwrap();
    run(&mut shoot, CHANGE);
    let laws = Laws { scene: Still::tilted(1.0), ..*shoot.model() };
    let mut changed = shoot.with_model(laws).unwrap();
    let kept: State = changed.state().clone();
    run(&mut changed, END);
    let mut resumed = Laws { ..laws };
    resumed.scene = Still::tilted(1.0);
    let mut again = righting().scene(resumed.scene).build().unwrap();
    again.restore(&kept).unwrap();
    run(&mut again, END);
    assert_eq!(again.state(), changed.state());
}

/// Light from one side, in need of a memory of its own.
#[derive(Clone, Copy)]
struct Light;

impl Perception for Light {
    type Signal = [f64; 2];
    fn declare(&self, to: &mut Declaration) -> Source {
        to.stimulus_pair()
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let light = site.along_directors(&Vector3::x());
        stimuli.copy_from_slice(&[light.x, light.y]);
    }
}

#[test]
fn laws_that_keep_other_numbers_need_a_past() {
    let mut shoot = reduced(0.05, 20.0 * HOUR).build().unwrap();
    run(&mut shoot, CHANGE);
    let light = morphorod::tropism::DirectionalTropism { sensitivity: 0.8, perception: Light }.remembered(MEMORY);
    let Laws { constitutive, growth, tropism: (gravity, own), load, scene } = *shoot.model();
    let lit = Laws { constitutive, growth, tropism: (gravity, own, light), load, scene };
    let error = shoot.with_model(lit).map(|_| ()).unwrap_err();
    assert!(matches!(error, StateError::Laws { own_variables: 6, variables: 4, .. }), "{error}");
    let mut seen = shoot.with_model_restarted(lit).unwrap();
    assert_eq!((seen.time(), seen.tip()), (CHANGE, shoot.tip()));
    let mut integrator = MethodOfSteps::new(STEP);
    let _ = integrator.start(&mut seen, &SteadyHistory).unwrap();
    let _ = integrator.advance(&mut seen, END).unwrap();
    let mut fresh = shoot.with_model_restarted(lit).unwrap();
    let _ = integrator.start(&mut fresh, &EmptyHistory).unwrap();
    let _ = integrator.advance(&mut fresh, END).unwrap();
    assert!(seen.tip().x > fresh.tip().x && fresh.tip().x > 1e-3);
}

#[test]
fn what_cannot_be_is_refused_and_the_shoot_is_as_it_was() {
    let mut shoot = reduced(0.05, 20.0 * HOUR).build().unwrap();
    run(&mut shoot, CHANGE);
    let before = shoot.clone();
    let mut refuse = |change: &dyn Fn(&mut shoots::Reduced), words: &str| {
        let mut model = *shoot.model();
        change(&mut model);
        let error = shoot.set_model(model).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
        assert!(shoot == before);
    };
    refuse(&|laws| laws.load.density = -1.0, "density is -1");
    refuse(&|laws| laws.growth.0.zone_length = 0.04, "length of a shoot of constant length");
    refuse(&|laws| laws.tropism.0.memory.delay = 5000.0, "longest delay of the new laws is 5000");
    refuse(&|laws| laws.tropism.1.memory.time = f64::NAN, "memory time is NaN");
    // Off the shoot.
    let Laws { constitutive, growth, tropism, scene, .. } = *shoot.model();
    for apex_distance in [0.051, f64::INFINITY] {
        let load = (WEIGHT, Jump(apex_distance));
        let error = shoot.with_model(Laws { constitutive, growth, tropism, load, scene }).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains("at which a load jumps"), "{error}");
    }
    // Shorter delays and other memories can live on the history.
    let mut model = *shoot.model();
    model.tropism.0.memory = Memory { time: 300.0, delay: 240.0 };
    shoot.set_model(model).unwrap();
    run(&mut shoot, END);
    // Statoliths keep numbers of their own.
    let own = Proprioception { sensitivity: 20.0 }.remembered(MEMORY);
    let piled = (steering(Statoliths { avalanche_time: 120.0 }).0, own);
    let Laws { constitutive, growth, load, scene, .. } = *shoot.model();
    assert!(shoot.with_model(Laws { constitutive, growth, tropism: piled, load, scene }).is_err());
    // A shoot that no integrator has started takes any laws.
    let young = reduced(0.05, 20.0 * HOUR).build().unwrap();
    assert!(young.with_model(Laws { constitutive, growth, tropism: piled, load, scene }).is_ok());
}

/// Jumps at a distance from the apex.
struct Jump(f64);

impl Load for Jump {
    fn force(&self, _: &morphorod::load::Cut, _: &morphorod::Environment) -> Vector3<f64> {
        Vector3::zeros()
    }
    fn jumps(&self) -> Vec<f64> {
        vec![self.0]
    }
}

#[test]
fn the_order_in_time_survives_a_change() {
    // The same force by hand, switched on and off, at steps that halve: fourth order, as everywhere.
    let constant = |_: f64| Vector3::new(1e-5, 0.0, 0.0);
    let tip = |step: f64| {
        let mut integrator = MethodOfSteps::new(step);
        let mut shoot = reduced(0.05, 20.0 * HOUR).scene(Still::tilted(0.3)).build().unwrap();
        let _ = integrator.advance(&mut shoot, CHANGE).unwrap();
        let Laws { constitutive, growth, tropism, load, scene } = *shoot.model();
        let pulled = Laws { constitutive, growth, tropism, load: (load, ApicalForce(constant)), scene };
        let mut shoot = shoot.with_model(pulled).unwrap();
        let _ = integrator.advance(&mut shoot, END).unwrap();
        shoot.tip()
    };
    let finest = tip(7.5);
    let errors = [240.0, 120.0, 60.0].map(|step| (tip(step) - finest).norm());
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!(order > 3.7, "{errors:?}");
    }
}

#[test]
fn the_same_laws_again_change_nothing() {
    // On coarse meshes the length of the elements is that of the zone only to the mesh's accuracy.
    for order in Order::ALL {
        let mut shoot = Shoot::builder(YOUNG)
            .length(0.05)
            .radius(RADIUS)
            .order(order)
            .growth(CosineProfile { zone_length: 0.03, time: 20.0 * HOUR })
            .load(WEIGHT)
            .build()
            .unwrap();
        for hour in 1..=20 {
            run(&mut shoot, f64::from(hour) * HOUR);
            let model = *shoot.model();
            shoot.set_model(model).unwrap();
        }
    }
}

#[test]
fn growth_may_begin_and_zones_may_come_and_go() {
    let resting = Shoot::builder(YOUNG).length(0.05).radius(RADIUS).load(WEIGHT).build().unwrap();
    let growth = UniformGrowth { zone_length: 0.06, time: 20.0 * HOUR };
    let mut shoot = resting.with_model(resting.model().with_growth(growth)).unwrap();
    run(&mut shoot, HOUR);
    assert!((shoot.rod().length() - 0.05 * f64::exp(0.05)).abs() < 1e-15);
    // A zone that is halved and doubled on a shoot shorter than both keeps its number of elements.
    let mut shoot = resting.with_model(resting.model().with_growth(growth)).unwrap();
    for i in 0..12 {
        let zone_length = if i % 2 == 0 { 0.12 } else { 0.06 };
        let model = shoot.model().with_growth(UniformGrowth { zone_length, ..growth });
        shoot.set_model(model).unwrap();
        run(&mut shoot, 60.0 * f64::from(i));
        assert!((shoot.mesh().longest_element - zone_length / 8.0).abs() < 1e-16);
    }
    assert!(shoot.rod().elements() <= 16, "{}", shoot.rod().elements());
}

#[test]
fn a_force_is_hung_where_it_belongs_at_every_order() {
    let force = Vector3::new(2e-5, 0.0, 0.0);
    for order in Order::ALL {
        for initial_apex_distance in [0.0137, 0.0201, 0.0333] {
            let load = (WEIGHT, PointForce { initial_apex_distance, force });
            let mut built = Shoot::builder(YOUNG).length(0.05).radius(RADIUS).order(order).load(load).build().unwrap();
            let bare = Shoot::builder(YOUNG).length(0.05).radius(RADIUS).order(order).load(WEIGHT).build().unwrap();
            let mut hung = bare.with_model(bare.model().with_load(load)).unwrap();
            assert_eq!(hung.rod().elements(), built.rod().elements());
            run(&mut built, 1.0);
            run(&mut hung, 1.0);
            assert!((hung.tip() - built.tip()).norm() < 1e-9, "{order:?}: {} {}", hung.tip(), built.tip());
        }
    }
}

#[test]
fn new_laws_are_asked_at_every_place() {
    let shoot = reduced(0.05, 20.0 * HOUR).build().unwrap();
    for factor in [0.0, -1.0, f64::NAN] {
        let graded = Graded { law: YOUNG, factor: move |_: &Tissue| factor };
        let error = shoot.with_model(shoot.model().with_constitutive(graded)).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains("stiffness K1"), "{error}");
    }
}

/// Gravity that sets in just after a time.
#[derive(Clone, Copy)]
struct SetsIn(f64);

impl Scene for SetsIn {
    fn gravity(&self, t: f64) -> Vector3<f64> {
        Vector3::z() * if t > self.0 { -9.81 } else { -1.0 }
    }
    fn base(&self, _t: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::identity()
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        if t < self.0 { self.0 } else { f64::INFINITY }
    }
}

#[test]
fn stability_at_a_discontinuity_is_that_after_it() {
    let mut shoot = reduced(0.06, 20.0 * HOUR).scene(SetsIn(HOUR)).build().unwrap();
    run(&mut shoot, HOUR);
    let at = Linearisation::about(&shoot).unwrap().rightmost().unwrap().value;
    run(&mut shoot, HOUR + 1.0);
    let after = Linearisation::about(&shoot).unwrap().rightmost().unwrap().value;
    assert!((at - after).norm() < 1e-9 * after.norm(), "{at} {after}");
}
