//! Replacement of the laws of a shoot between two runs.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots;
use crate::fixtures::shoots::{
    HOUR, MEMORY, STATOLITHS, WEIGHT, YOUNG, elongating, reduced, righting, rod, steering,
};
use approx::{abs_diff_eq, assert_abs_diff_eq};
use morphorod::constitutive::{Graded, Tissue};
use morphorod::growth::{CosineProfile, GrowthLaw, UniformGrowth};
use morphorod::integrator::{ConstantHistory, Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Load, PointForce};
use morphorod::stability::Linearisation;
use morphorod::tropism::{
    Declaration, DirectionalTropism, Growing, Memory, Perception, Proprioception, Response,
    SettledStatoliths, Site, Source, Statoliths, TropismLaw,
};
use morphorod::{Model, Order, Scene, Shoot, State, StateError, Still, Turned};
use nalgebra::{UnitQuaternion, Vector3};

const STEP: f64 = 120.0;
const CHANGE: f64 = 2.3 * HOUR;
const END: f64 = 5.0 * HOUR;

fn run(shoot: &mut Shoot<impl Model>, until: f64) {
    let _ = MethodOfSteps::new(STEP)
        .advance(shoot, until)
        .expect("advances");
}

/// Gravitropism and proprioception, multiplied by a factor from the time `CHANGE` on. The law
/// declares this discontinuity in `next_discontinuity`.
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
    fn initial(&self, stimuli: &[f64], variables: &mut [f64]) {
        steering(STATOLITHS).initial(stimuli, variables);
    }
    fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> {
        steering(STATOLITHS).gradient(at, past, now) * if at.time >= CHANGE { self.0 } else { 1.0 }
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        if t < CHANGE { CHANGE } else { f64::INFINITY }
    }
}

#[test]
fn parameter_set_by_hand_acts_like_a_law_that_announces_its_change() {
    let mut announced = righting()
        .tropism(Weakened(0.3))
        .into_dyn()
        .build()
        .unwrap();
    run(&mut announced, END);
    let mut shoot = righting()
        .tropism(steering(STATOLITHS))
        .into_dyn()
        .build()
        .unwrap();
    run(&mut shoot, CHANGE);
    let (mut gravitropism, mut proprioception) = steering(STATOLITHS);
    gravitropism.response.sensitivity *= 0.3;
    proprioception.response.sensitivity *= 0.3;
    let model = shoot
        .model()
        .clone()
        .with_tropism((gravitropism, proprioception))
        .into_dyn();
    shoot = shoot.with_model(model).unwrap();
    run(&mut shoot, END);
    // Both runs take the same steps. They differ by rounding errors, because the announced law is
    // evaluated within a few rounding errors of the time of its change.
    assert_abs_diff_eq!(
        InNorm(shoot.tip()),
        InNorm(announced.tip()),
        epsilon = 1e-15
    );
    // The change displaces the tip by more than 0.01 mm.
    let mut unchanged = righting()
        .tropism(steering(STATOLITHS))
        .into_dyn()
        .build()
        .unwrap();
    run(&mut unchanged, END);
    assert!((unchanged.tip() - announced.tip()).norm() > 1e-5);
}

#[test]
fn replaced_scene_acts_like_a_base_tilted_at_that_time() {
    let upright = || reduced(0.05, 20.0 * HOUR);
    let mut announced = upright()
        .scene(Turned::tilted(0.5, CHANGE, f64::INFINITY))
        .into_dyn()
        .build()
        .unwrap();
    run(&mut announced, END);
    let mut shoot = upright().into_dyn().build().unwrap();
    run(&mut shoot, CHANGE);
    let mut shoot = shoot
        .with_model(
            shoot
                .model()
                .clone()
                .with_scene(Still::tilted(0.5))
                .into_dyn(),
        )
        .unwrap();
    run(&mut shoot, END);
    assert_abs_diff_eq!(
        InNorm(shoot.tip()),
        InNorm(announced.tip()),
        epsilon = 1e-15
    );
    assert!(shoot.tip().x > 0.001);
}

#[test]
fn added_load_acts_at_once_and_its_removal_restores_the_shape() {
    let force = Vector3::new(1e-5, 0.0, -2e-5);
    let mut shoot = reduced(0.05, 20.0 * HOUR).into_dyn().build().unwrap();
    run(&mut shoot, CHANGE);
    let before = shoot.tip();
    let load = (WEIGHT, ApicalForce(move |_| force));
    let mut pulled = shoot
        .with_model(shoot.model().clone().with_load(load).into_dyn())
        .unwrap();
    assert_eq!(
        pulled.tip(),
        before,
        "only an integrator computes the new shape"
    );
    // Advancing to the present time takes no step and computes the new shape.
    let statistics = MethodOfSteps::new(STEP)
        .advance(&mut pulled, CHANGE)
        .unwrap();
    assert_eq!((statistics.steps, statistics.equilibria), (0, 1));
    assert!(pulled.tip().x > 5e-4);
    let mut released = pulled.with_model(shoot.model().clone()).unwrap();
    run(&mut released, CHANGE);
    assert_abs_diff_eq!(InNorm(released.tip()), InNorm(before), epsilon = 1e-12);
}

#[test]
fn tissue_outside_a_shorter_zone_stops_growing() {
    let (initial, zone, time) = (0.05, 0.06, 20.0 * HOUR);
    let mut shoot = elongating(initial, zone, time)
        .scene(Still::tilted(0.3))
        .into_dyn()
        .build()
        .unwrap();
    // The first change occurs while the whole shoot grows, the second when a part is mature.
    for (change, new_zone) in [(2.0 * HOUR, 0.017), (8.0 * HOUR, 0.03)] {
        let mut shoot = shoot.clone();
        run(&mut shoot, change);
        let old = UniformGrowth {
            zone_length: zone,
            time,
        }
        .length(initial, change);
        let growth = UniformGrowth {
            zone_length: new_zone,
            time: 30.0 * HOUR,
        };
        let laws = shoot.model().clone().with_growth(growth).into_dyn();
        shoot = shoot.with_model(laws).unwrap();
        let range = shoot.rod().growth_zone();
        assert_abs_diff_eq!(range.end - range.start, new_zone, epsilon = 1e-15);
        run(&mut shoot, change + 3.0 * HOUR);
        let expected = old + new_zone / (30.0 * HOUR) * 3.0 * HOUR;
        assert_abs_diff_eq!(shoot.rod().length(), expected, epsilon = 1e-12);
        let range = shoot.rod().growth_zone();
        assert_abs_diff_eq!(range.end - range.start, new_zone, epsilon = 1e-12);
        assert!(shoot.longest_element() <= new_zone / 8.0 * (1.0 + 1e-12));
        // The exit time of tissue that stopped growing at the change is the time of the change.
        let stopped = shoot
            .rod()
            .points()
            .iter()
            .filter(|point| point.exit_time == change)
            .count();
        assert!(stopped > 0);
        // A zone that includes mature tissue is refused. A shoot without growth is accepted.
        let wide = shoot
            .model()
            .clone()
            .with_growth(UniformGrowth {
                zone_length: zone,
                time,
            })
            .into_dyn();
        let error = shoot.with_model(wide).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains("growth zone is 0.06"), "{error}");
        let mut still = shoot
            .with_model(shoot.model().clone().with_growth(()).into_dyn())
            .unwrap();
        let (length, strains) = (still.rod().length(), still.rod().points().to_vec());
        run(&mut still, change + 6.0 * HOUR);
        assert_eq!(still.rod().length(), length);
        assert!(
            still
                .rod()
                .points()
                .iter()
                .zip(&strains)
                .all(|(now, then)| now.intrinsic == then.intrinsic)
        );
    }
    run(&mut shoot, HOUR);
}

#[test]
fn added_point_force_gets_a_node() {
    let mut shoot = reduced(0.05, 20.0 * HOUR).into_dyn().build().unwrap();
    run(&mut shoot, HOUR);
    let force = Vector3::new(2e-5, 0.0, 0.0);
    let elements = shoot.rod().elements();
    for (apex_distance, more) in [(0.0137, 1), (0.05 / 8.0, 0), (0.0, 0), (0.05, 0)] {
        let load = (
            WEIGHT,
            PointForce {
                initial_apex_distance: apex_distance,
                force,
            },
        );
        let mut pulled = shoot
            .with_model(shoot.model().clone().with_load(load).into_dyn())
            .unwrap();
        assert_eq!(pulled.rod().elements(), elements + more);
        let nodes = pulled.rod().centre_line();
        assert!(
            nodes
                .iter()
                .any(|(s, _)| abs_diff_eq!(*s, 0.05 - apex_distance, epsilon = 1e-12)),
            "{nodes:?}"
        );
        run(&mut pulled, 2.0 * HOUR);
    }
}

#[test]
fn state_saved_after_a_change_of_laws_has_the_same_future() {
    let mut shoot = righting().into_dyn().build().unwrap();
    run(&mut shoot, CHANGE);
    let mut changed = shoot
        .with_model(
            shoot
                .model()
                .clone()
                .with_scene(Still::tilted(1.0))
                .into_dyn(),
        )
        .unwrap();
    let kept: State = changed.state().clone();
    run(&mut changed, END);
    let mut resumed = righting()
        .scene(Still::tilted(1.0))
        .into_dyn()
        .build()
        .unwrap();
    resumed.restore(&kept).unwrap();
    run(&mut resumed, END);
    assert_eq!(resumed.state(), changed.state());
}

/// Light from one side, which requires a separate memory.
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
fn laws_with_other_variables_require_a_new_history() {
    let mut shoot = reduced(0.05, 20.0 * HOUR).into_dyn().build().unwrap();
    run(&mut shoot, CHANGE);
    let light = DirectionalTropism {
        sensitivity: 0.8,
        perception: Light,
    }
    .remembered(MEMORY);
    let (gravity, own) = steering(SettledStatoliths);
    let lit = shoot
        .model()
        .clone()
        .with_tropism((gravity, own, light))
        .into_dyn();
    let error = shoot.with_model(lit.clone()).map(|_| ()).unwrap_err();
    assert!(
        matches!(
            error,
            StateError::Laws {
                expected: (6, _),
                found: (4, _)
            }
        ),
        "{error}"
    );
    let mut seen = shoot.with_model_restarted(lit.clone()).unwrap();
    assert_eq!((seen.time(), seen.tip()), (CHANGE, shoot.tip()));
    let mut integrator = MethodOfSteps::new(STEP);
    let _ = integrator
        .start(&mut seen, &ConstantHistory::Steady)
        .unwrap();
    let _ = integrator.advance(&mut seen, END).unwrap();
    let mut fresh = shoot.with_model_restarted(lit).unwrap();
    let _ = integrator
        .start(&mut fresh, &ConstantHistory::Empty)
        .unwrap();
    let _ = integrator.advance(&mut fresh, END).unwrap();
    assert!(seen.tip().x > fresh.tip().x && fresh.tip().x > 1e-3);
}

#[test]
fn invalid_new_laws_are_refused_and_the_shoot_is_unchanged() {
    // The laws have static types, because the test changes their parameters and compares whole
    // shoots.
    let mut shoot = reduced(0.05, 20.0 * HOUR).build().unwrap();
    run(&mut shoot, CHANGE);
    let before = shoot.clone();
    let refuse = |change: &dyn Fn(&mut shoots::Reduced), words: &str| {
        let mut model = *shoot.model();
        change(&mut model);
        let error = shoot.with_model(model).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
        assert!(shoot == before);
    };
    refuse(&|laws| laws.load.density = -1.0, "density is -1");
    refuse(
        &|laws| laws.growth.0.zone_length = 0.04,
        "length of a shoot of constant length",
    );
    refuse(
        &|laws| laws.tropism.0.memory.delay = 5000.0,
        "longest delay of the laws is 5000",
    );
    refuse(
        &|laws| laws.tropism.1.memory.time = f64::NAN,
        "memory time is not a number",
    );
    // A load with a jump outside the shoot is refused.
    for apex_distance in [0.051, f64::INFINITY] {
        let jumping = shoot
            .model()
            .with_load((WEIGHT, Jump(apex_distance)))
            .into_dyn();
        let error = shoot.with_model(jumping).map(|_| ()).unwrap_err();
        assert!(
            error.to_string().contains("at which a load jumps"),
            "{error}"
        );
    }
    // The history is long enough for shorter delays and can be used with other memory times.
    let mut model = *shoot.model();
    model.tropism.0.memory = Memory {
        time: 300.0,
        delay: 240.0,
    };
    shoot = shoot.with_model(model).unwrap();
    run(&mut shoot, END);
    // Statoliths add variables, for which there is no history.
    let own = Proprioception { sensitivity: 20.0 }.remembered(MEMORY);
    let piled = (
        steering(Statoliths {
            avalanche_time: 120.0,
        })
        .0,
        own,
    );
    let piled = shoot.model().with_tropism(piled).into_dyn();
    assert!(shoot.with_model(piled.clone()).is_err());
    // A shoot that no integrator has started accepts any laws.
    let young = reduced(0.05, 20.0 * HOUR).build().unwrap();
    assert!(young.with_model(piled).is_ok());
}

/// Load without force that declares a jump at a distance from the apex.
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
fn change_of_laws_keeps_fourth_order_in_time() {
    let constant = |_: f64| Vector3::new(1e-5, 0.0, 0.0);
    let tip = |step: f64| {
        let mut integrator = MethodOfSteps::new(step);
        let mut shoot = reduced(0.05, 20.0 * HOUR)
            .scene(Still::tilted(0.3))
            .into_dyn()
            .build()
            .unwrap();
        let _ = integrator.advance(&mut shoot, CHANGE).unwrap();
        let pulled = shoot
            .model()
            .clone()
            .with_load((WEIGHT, ApicalForce(constant)))
            .into_dyn();
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
fn setting_the_same_laws_again_is_accepted_on_coarse_meshes() {
    // On coarse meshes the sum of the element lengths equals the length of the zone only to the
    // accuracy of the mesh.
    for order in Order::ALL {
        let mut shoot = rod(YOUNG, 0.05)
            .order(order)
            .growth(CosineProfile {
                zone_length: 0.03,
                time: 20.0 * HOUR,
            })
            .load(WEIGHT)
            .into_dyn()
            .build()
            .unwrap();
        for hour in 1..=20 {
            run(&mut shoot, f64::from(hour) * HOUR);
            let model = shoot.model().clone();
            shoot = shoot.with_model(model).unwrap();
        }
    }
}

#[test]
fn growth_may_begin_late_and_its_zone_may_change_repeatedly() {
    let resting = rod(YOUNG, 0.05).load(WEIGHT).into_dyn().build().unwrap();
    let growth = UniformGrowth {
        zone_length: 0.06,
        time: 20.0 * HOUR,
    };
    let mut shoot = resting
        .with_model(resting.model().clone().with_growth(growth).into_dyn())
        .unwrap();
    run(&mut shoot, HOUR);
    assert_abs_diff_eq!(shoot.rod().length(), 0.05 * f64::exp(0.05), epsilon = 1e-15);
    // The number of elements remains bounded if a zone longer than the shoot is doubled and halved
    // repeatedly.
    let mut shoot = resting
        .with_model(resting.model().clone().with_growth(growth).into_dyn())
        .unwrap();
    for i in 0..12 {
        let zone_length = if i % 2 == 0 { 0.12 } else { 0.06 };
        let model = shoot
            .model()
            .clone()
            .with_growth(UniformGrowth {
                zone_length,
                ..growth
            })
            .into_dyn();
        shoot = shoot.with_model(model).unwrap();
        run(&mut shoot, 60.0 * f64::from(i));
        assert_abs_diff_eq!(shoot.longest_element(), zone_length / 8.0, epsilon = 1e-16);
    }
    assert!(shoot.rod().elements() <= 16, "{}", shoot.rod().elements());
}

#[test]
fn added_point_force_gives_the_shape_of_one_present_from_the_start_at_every_order() {
    let force = Vector3::new(2e-5, 0.0, 0.0);
    for order in Order::ALL {
        for initial_apex_distance in [0.0137, 0.0201, 0.0333] {
            let load = (
                WEIGHT,
                PointForce {
                    initial_apex_distance,
                    force,
                },
            );
            let builder = rod(YOUNG, 0.05).order(order);
            let mut built = builder.clone().load(load).into_dyn().build().unwrap();
            let bare = builder.load(WEIGHT).into_dyn().build().unwrap();
            let mut loaded = bare
                .with_model(bare.model().clone().with_load(load).into_dyn())
                .unwrap();
            assert_eq!(loaded.rod().elements(), built.rod().elements());
            run(&mut built, 1.0);
            run(&mut loaded, 1.0);
            assert!(
                abs_diff_eq!(InNorm(loaded.tip()), InNorm(built.tip()), epsilon = 1e-9),
                "{order:?}, {initial_apex_distance} m: {:?} against {:?}",
                loaded.tip(),
                built.tip()
            );
        }
    }
}

#[test]
fn new_laws_are_checked_at_every_material_point() {
    let shoot = reduced(0.05, 20.0 * HOUR).into_dyn().build().unwrap();
    for factor in [0.0, -1.0, f64::NAN] {
        let graded = Graded {
            law: YOUNG,
            factor: move |_: &Tissue| factor,
        };
        let laws = shoot.model().clone().with_constitutive(graded).into_dyn();
        let error = shoot.with_model(laws).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains("stiffness K1"), "{error}");
    }
}

/// Gravity that increases to its full value immediately after a given time (s).
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
    let mut shoot = reduced(0.06, 20.0 * HOUR)
        .scene(SetsIn(HOUR))
        .into_dyn()
        .build()
        .unwrap();
    run(&mut shoot, HOUR);
    let at = Linearisation::about(&shoot)
        .unwrap()
        .rightmost()
        .unwrap()
        .value;
    run(&mut shoot, HOUR + 1.0);
    let after = Linearisation::about(&shoot)
        .unwrap()
        .rightmost()
        .unwrap()
        .value;
    // `approx` cannot compare complex numbers without its feature `num-complex`.
    assert!((at - after).norm() < 1e-9 * after.norm(), "{at} {after}");
}
