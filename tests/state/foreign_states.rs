//! States that are damaged or belong to another shoot. The error names the cause, and the shoot
//! remains unchanged.

use std::sync::Arc;

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{DAY, HOUR, YOUNG, growing, reduced, righting, rod};
use approx::assert_abs_diff_eq;
use morphorod::growth::{CosineProfile, GrowthLaw, LinearProfile, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::rod::{Rod, RodError};
use morphorod::{Along, Order, Scene, StateError, Still, Turned};
use nalgebra::{UnitQuaternion, Vector3};

#[test]
fn state_of_other_laws_is_refused() {
    let mut foreign = growing().elements(4).into_dyn().build().unwrap();
    let mut shoot = righting().elements(4).into_dyn().build().unwrap();
    // A state before a run has no history, so that only its rod is checked.
    shoot.restore(foreign.state()).unwrap();
    let mut shoot = righting().elements(4).into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(90.0);
    run.advance(&mut foreign, 0.2 * HOUR).unwrap();
    run.advance(&mut shoot, 0.1 * HOUR).unwrap();
    let kept = shoot.state().clone();
    let error = shoot.restore(foreign.state()).unwrap_err();
    assert!(matches!(error, StateError::Laws { .. }), "{error}");
    assert!(&kept == shoot.state());
    run.advance(&mut shoot, 0.2 * HOUR).unwrap();
}

#[test]
fn state_of_another_growth_zone_is_refused() {
    let build = |zone_length: f64| {
        let growth = UniformGrowth {
            zone_length,
            time: 20.0 * HOUR,
        };
        rod(YOUNG, 0.05).growth(growth).into_dyn().build().unwrap()
    };
    for (zone, other, hours) in [
        (0.04, 0.02, 0.0),
        (0.04, 0.02, 1.0),
        (0.02, 0.04, 1.0),
        (0.1, 0.04, 1.0),
    ] {
        let (mut foreign, mut shoot) = (build(zone), build(other));
        MethodOfSteps::new(300.0)
            .advance(&mut foreign, hours * HOUR)
            .unwrap();
        let kept = shoot.state().clone();
        let error = shoot.restore(foreign.state()).unwrap_err().to_string();
        assert!(
            error.contains("length of the growth zone of the state is 0.0"),
            "{zone} {other}: {error}"
        );
        assert!(&kept == shoot.state());
        build(zone).restore(foreign.state()).unwrap();
    }
}

#[test]
fn state_of_another_scene_is_refused() {
    type AnyScene = Arc<dyn Scene + Send + Sync>;
    let build = |scene: &AnyScene| righting().scene(scene.clone()).into_dyn().build().unwrap();
    let weak = Still {
        gravity: Still::upright().gravity * 0.1,
        ..Still::tilted(0.5)
    };
    let path = |t: f64| Vector3::x() * (1e-3 * t / HOUR);
    let lean: AnyScene = Arc::new(Still::tilted(0.5));
    let cases: [(AnyScene, AnyScene, &str); 4] = [
        (
            Arc::new(Still::tilted(0.6)),
            lean.clone(),
            "rotation of the base of the state from that of the scene is 0.1 ",
        ),
        // The state is at the discontinuity.
        (
            Arc::new(Turned::tilted(0.5, HOUR, DAY)),
            Arc::new(Still::upright()),
            "is 0.5 but must be zero up to rounding",
        ),
        (
            Arc::new(weak),
            lean.clone(),
            "difference of the gravity of the state from that of the scene is 8.829 but",
        ),
        (
            Arc::new(Along {
                scene: Still::tilted(0.5),
                path,
            }),
            lean,
            "base of the state from that of the scene is 0.001 ",
        ),
    ];
    let mut run = MethodOfSteps::new(360.0);
    for (own, other, words) in cases {
        let (mut foreign, mut shoot) = (build(&own), build(&other));
        // A state before its first equilibrium has no scene yet.
        shoot.restore(foreign.state()).unwrap();
        run.advance(&mut foreign, HOUR).unwrap();
        build(&own).restore(foreign.state()).unwrap();
        let kept = shoot.state().clone();
        let error = shoot.restore(foreign.state()).unwrap_err().to_string();
        assert!(
            error.contains(words),
            "“{error}” does not contain “{words}”"
        );
        assert!(&kept == shoot.state());
        // The scene may be exchanged as other laws.
        let mut changed = foreign.with_model(shoot.model().clone()).unwrap();
        shoot.restore(changed.state()).unwrap();
        run.advance(&mut changed, 1.5 * HOUR).unwrap();
        shoot.restore(changed.state()).unwrap();
    }
}

#[test]
fn state_of_another_mesh_is_accepted() {
    let mut run = MethodOfSteps::new(90.0);
    let mut coarse = growing()
        .elements(2)
        .order(Order::Four)
        .into_dyn()
        .build()
        .unwrap();
    run.advance(&mut coarse, 1.5 * HOUR).unwrap();
    let mut shoot = growing().elements(8).into_dyn().build().unwrap();
    run.advance(&mut shoot, 0.5 * HOUR).unwrap();
    shoot.restore(coarse.state()).unwrap();
    assert!(coarse.state() == shoot.state());
    run.advance(&mut shoot, 2.5 * HOUR).unwrap();
    run.advance(&mut coarse, 2.5 * HOUR).unwrap();
    assert!(shoot.rod().elements() > coarse.rod().elements());
    assert_abs_diff_eq!(InNorm(shoot.tip()), InNorm(coarse.tip()), epsilon = 1e-3);
}

#[test]
fn state_with_a_nan_strain_is_refused() {
    let mut shoot = righting().elements(4).into_dyn().build().unwrap();
    let kept = shoot.state().clone();
    shoot.set_intrinsic(|_| Vector3::repeat(f64::NAN));
    let broken = shoot.state().clone();
    let error = shoot.restore(&broken).unwrap_err();
    let expected = "square of intrinsic strain";
    assert!(
        matches!(error, StateError::Rod(RodError::Value { what, index: 0, .. }) if what == expected),
        "{error}"
    );
    shoot.restore(&kept).unwrap();
    assert!(&kept == shoot.state());
}

/// Advances shoots on coarse meshes for 69 hours. Panics unless each shoot accepts all of its own
/// states.
fn assert_own_states_are_accepted(growth: impl GrowthLaw + Copy + Send + Sync + 'static) {
    for (order, elements) in [(Order::Two, 16), (Order::Eight, 2)] {
        let mut shoot = reduced(0.05, 20.0 * HOUR)
            .growth(growth)
            .elements(elements)
            .order(order)
            .into_dyn()
            .build()
            .unwrap();
        let mut run = MethodOfSteps::new(600.0);
        for hours in (0..72).step_by(3) {
            run.advance(&mut shoot, HOUR * f64::from(hours)).unwrap();
            let kept = shoot.state().clone();
            shoot
                .restore(&kept)
                .unwrap_or_else(|error| panic!("{order:?}, {elements}, {hours} h: {error}"));
        }
    }
}

#[test]
fn states_of_coarse_meshes_are_accepted() {
    let (zone_length, time) = (0.03, 20.0 * HOUR);
    assert_own_states_are_accepted(LinearProfile { zone_length, time });
    assert_own_states_are_accepted(CosineProfile { zone_length, time });
}

#[test]
fn queries_off_the_rod_return_none() {
    let mut rod = Rod::uniform(0.1, 1e-3, UnitQuaternion::identity(), 3, Order::Four).unwrap();
    rod.set_intrinsic(|_| Vector3::x());
    assert!(rod.strain(2, 1).is_some());
    for (element, g) in [(3, 0), (0, 2), (usize::MAX, usize::MAX)] {
        assert_eq!(rod.strain(element, g), None);
    }
    for s in [f64::NAN, f64::NEG_INFINITY, -1.0, f64::INFINITY, 7.0] {
        assert_eq!(rod.at(s), None);
    }
    assert!(rod.centre_line_at(0).is_empty());
    assert_eq!(rod.centre_line_at(1), [Vector3::zeros()]);
    let ends = rod.centre_line_at(2);
    assert!(ends.len() == 2 && ends[0] == Vector3::zeros());
    assert_abs_diff_eq!(InNorm(ends[1]), InNorm(rod.tip()), epsilon = 1e-15);
}

mod written {
    use std::sync::LazyLock;

    use morphorod::State;
    use proptest::prelude::*;
    use serde_json::Value;

    use super::*;

    /// Serialised states before a run, at its start, and at two times during the run.
    static STATES: LazyLock<Vec<Value>> = LazyLock::new(|| {
        let mut shoot = growing().elements(4).into_dyn().build().unwrap();
        let mut states = vec![serde_json::to_value(shoot.state()).unwrap()];
        for t in [0.0, 0.5 * HOUR, 1.7 * HOUR] {
            MethodOfSteps::new(90.0).advance(&mut shoot, t).unwrap();
            states.push(serde_json::to_value(shoot.state()).unwrap());
        }
        states
    });

    fn read(value: &Value) -> Result<State, String> {
        // The value is converted to text, as in a file.
        serde_json::from_str(&value.to_string()).map_err(|error| error.to_string())
    }

    /// Error message for the state at 1.7 h after `damage`.
    fn refusal(damage: impl Fn(&mut Value)) -> String {
        let mut value = STATES[3].clone();
        read(&value).unwrap();
        damage(&mut value);
        read(&value).unwrap_err()
    }

    #[test]
    fn levels_of_any_generation_are_read() {
        let mut value = STATES[3].clone();
        for level in value["history"]["levels"].as_array_mut().unwrap() {
            level["generation"] = 255.into();
        }
        let mut shoot = growing().elements(4).into_dyn().build().unwrap();
        shoot.restore(&read(&value).unwrap()).unwrap();
        // The breaking points of these levels are passed without an overflow of the generation.
        MethodOfSteps::new(90.0)
            .advance(&mut shoot, 2.5 * HOUR)
            .unwrap();
    }

    #[test]
    fn messages_name_the_damaged_part() {
        let message = refusal(|state| state["format"] = 99.into());
        assert!(
            message.contains("format 99; this version reads format 15"),
            "{message}"
        );
        let message = refusal(|state| _ = state.as_object_mut().unwrap().remove("format"));
        assert!(message.contains("missing field `format`"), "{message}");
        let message = refusal(|state| _ = state["rod"]["points"].as_array_mut().unwrap().pop());
        assert!(
            message.contains("number of material points is 35 but the elements require 36"),
            "{message}"
        );
        let message =
            refusal(|state| state["rod"]["points"][2]["section"]["along_d2"] = (-1.0).into());
        assert!(
            message.contains("semi-axis along d2 of point number 2 is -1 but must be positive"),
            "{message}"
        );
        let message = refusal(|state| state["rod"]["frames"][0][0] = 2.0.into());
        assert!(message.contains("unit quaternion"), "{message}");
        let message = refusal(|state| state["rod"]["base_position"][1] = 1e200.into());
        assert!(
            message.contains("square of the position of the base"),
            "{message}"
        );
        let message = refusal(|state| state["rod"]["first_growing"] = 99.into());
        assert!(
            message.contains("first element of the growth zone number 0 is 99"),
            "{message}"
        );
        let message = refusal(|state| {
            state["rod"]["reactions"] = serde_json::json!([{
                "arc_length": 0.01, "initial_apex_distance": 0.0, "force": [1e308, 1e308, 0.0],
                "couple": [0.0, 0.0, 0.0], "length": 0.0, "obstacle": null, "surface": 0, "normal": 0.0, "slip": null
            }]);
        });
        assert!(
            message.contains("sum of reaction number 0 is infinite but must be finite"),
            "{message}"
        );
        let message = refusal(|state| state["history"]["levels"][1]["time"] = 0.0.into());
        assert!(message.contains("later than the one before"), "{message}");
        let message = refusal(|state| {
            _ = state["history"]["levels"][1]["rows"]
                .as_array_mut()
                .unwrap()
                .pop()
        });
        assert!(
            message.contains("number of values at a level of the history"),
            "{message}"
        );
        let message = refusal(|state| state["predictor"]["known"] = 6.into());
        assert!(message.contains("earlier equilibria"), "{message}");
        let message = refusal(|state| state["merge_next"] = u64::MAX.into());
        assert!(message.contains("merger was tried last"), "{message}");
        let message = refusal(|state| state["history"]["variables"] = u64::MAX.into());
        assert!(message.contains("values at a level"), "{message}");
        let rod = r#"{"order":"Two","base_position":[0.0,0.0,0.0],"frames":[],"rotations":[],"line_strains":[],
            "points":[],"node_distance":[],"initial_length":1.0,"kept":[],"first_growing":0,"loss":[],
            "reactions":[]}"#;
        let message = serde_json::from_str::<Rod>(rod).unwrap_err().to_string();
        assert!(
            message.contains("number of frames is 0 but the elements require 2"),
            "{message}"
        );
    }

    #[derive(Debug, Clone, Copy)]
    enum Damage {
        Drop,
        Duplicate,
        Negate,
        Null,
        Swap,
    }

    /// Damages a list or a value at the end of a random walk through the state, so that short parts
    /// are damaged as often as long ones. A list of lists or objects on the walk is itself damaged
    /// with a probability of one third.
    fn damage(node: &mut Value, kind: Damage, walk: &[usize]) {
        let Some((at, rest)) = walk.split_first() else {
            return;
        };
        let lists = matches!(kind, Damage::Drop | Damage::Duplicate | Damage::Swap);
        match node {
            Value::Array(items) if !items.is_empty() => {
                let (count, place) = (items.len(), at % items.len());
                let deeper = items[place].is_array() || items[place].is_object();
                if !lists || deeper && at % 3 > 0 {
                    return damage(&mut items[place], kind, rest);
                }
                let other = rest.first().map_or(0, |at| at % count);
                match kind {
                    Damage::Drop => _ = items.remove(place),
                    Damage::Duplicate => items.insert(other, items[place].clone()),
                    _ => items.swap(place, other),
                }
            }
            Value::Object(fields) if !fields.is_empty() => {
                let place = at % fields.len();
                if let Some(field) = fields.values_mut().nth(place) {
                    damage(field, kind, rest);
                }
            }
            Value::Number(number) if matches!(kind, Damage::Negate) => {
                let whole = number.as_i64().map(|n| Value::from(-n));
                *node = whole.unwrap_or_else(|| Value::from(-number.as_f64().unwrap()));
            }
            node if matches!(kind, Damage::Null) => *node = Value::Null,
            _ => {}
        }
    }

    fn kinds() -> impl Strategy<Value = Damage> {
        prop_oneof![
            Just(Damage::Drop),
            Just(Damage::Duplicate),
            Just(Damage::Negate),
            Just(Damage::Null),
            Just(Damage::Swap)
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(1000) })]

        #[test]
        fn damaged_state_is_an_error_or_a_valid_state(
            which in 0..4_usize,
            damages in prop::collection::vec((kinds(), prop::collection::vec(any::<usize>(), 12)), 1..3),
        ) {
            let mut value = STATES[which].clone();
            for (kind, walk) in &damages {
                damage(&mut value, *kind, walk);
            }
            match read(&value) {
                Err(message) => prop_assert!(!message.is_empty()),
                Ok(state) => {
                    let mut shoot = growing().elements(4).into_dyn().build().unwrap();
                    let before = shoot.state().clone();
                    if let Err(error) = shoot.restore(&state) {
                        prop_assert!(!error.to_string().is_empty());
                        prop_assert!(&before == shoot.state());
                    } else if MethodOfSteps::new(90.0).advance(&mut shoot, state.time() + 200.0).is_ok() {
                        let after = shoot.state().clone();
                        // The new state is finite and valid.
                        prop_assert!(shoot.restore(&after).is_ok(), "{:?}", shoot.restore(&after));
                        prop_assert!(shoot.tip().iter().all(|x| x.is_finite()));
                    } else {
                        prop_assert!(&state == shoot.state());
                    }
                }
            }
        }
    }
}
