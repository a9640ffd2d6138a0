//! Safe calls with wrong sizes, indices, times and numbers. Each call returns a result or an error
//! without a panic, and an error leaves the shoot unchanged.

use std::sync::{Arc, LazyLock};

use crate::fixtures::shoots::{HOUR, Reduced, YOUNG, growing, reduced};
use morphorod::constitutive::{Constitutive, Graded, Lignifying, LinearElastic, Tissue};
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver, Unloaded};
use morphorod::growth::{CosineProfile, GrowthLaw, LinearProfile, Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{
    ApicalForce, Distributed, GradedWeight, InternalForce, Load, PointForce, Pulse, Weight, Whirl,
};
use morphorod::profile::Profile;
use morphorod::rod::Rod;
use morphorod::stability::{Linearisation, solve_steady_state};
use morphorod::tropism::{Memory, Oscillator, Proprioception, Response};
use morphorod::{DynLaws, Order, Scene, Section, Shoot, Still, Turned};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

/// Growing shoot before a run, at the start of the run, and during the run.
static GROWING: LazyLock<[Shoot<DynLaws>; 3]> = LazyLock::new(|| {
    [None, Some(0.0), Some(0.7 * HOUR)].map(|until| {
        let mut shoot = growing().elements(2).into_dyn().build().unwrap();
        if let Some(until) = until {
            let _ = MethodOfSteps::new(360.0)
                .advance(&mut shoot, until)
                .unwrap();
        }
        shoot
    })
});
static REDUCED: LazyLock<Shoot<Reduced>> = LazyLock::new(|| {
    let mut shoot = reduced(0.05, 20.0 * HOUR)
        .elements(3)
        .order(Order::Four)
        .build()
        .unwrap();
    let _ = MethodOfSteps::new(360.0)
        .advance(&mut shoot, 0.4 * HOUR)
        .unwrap();
    shoot
});

/// Strategy for typical, extreme and invalid numbers.
fn number() -> impl Strategy<Value = f64> {
    let odd = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.05,
        0.068,
        5e-4,
        1e7,
        1000.0,
        720.0,
        2519.9,
        2520.0,
        1e-9,
        1e-300,
        5e-324,
        1e300,
        f64::MAX,
        f64::MIN,
        f64::EPSILON,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ];
    prop_oneof![3 => prop::sample::select(odd.to_vec()), 1 => -0.1..0.1_f64, 1 => 0.0..5000.0_f64, 1 => any::<f64>()]
}

fn index() -> impl Strategy<Value = usize> {
    prop_oneof![4 => 0..12_usize, 1 => Just(usize::MAX), 1 => any::<u16>().prop_map(usize::from)]
}

/// Whether the frames, the tip and the length of a rod are finite.
fn sound(rod: &Rod) -> bool {
    let frames = rod.frames().iter().all(|frame| frame.norm().is_finite());
    frames && rod.tip().iter().all(|x| x.is_finite()) && rod.length().is_finite()
}

/// Calls every query of a rod.
fn read_rod(rod: &Rod, [a, _, _, _]: [f64; 4], [i, j, ..]: [usize; 3]) {
    let _ = (
        rod.strain(i, j),
        rod.line_strain(i, j),
        rod.at(a),
        rod.arc_length_of(a),
    );
    let _ = (
        rod.centre_line(),
        rod.centre_line_at(i % 5000),
        rod.growth_zone(),
        rod.volume(),
        rod.apex_frame(),
    );
}

/// Builds a rod, changes it, and solves for its equilibrium.
fn call_rod([a, b, c, d]: [f64; 4], [i, j, k]: [usize; 3]) {
    let order = Order::ALL[k % 4];
    let base = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), a);
    let _ = Rod::straight(&[0.0, a, b], |_| c, base, order);
    let _ = Rod::straight(&vec![a; j % 5], |s| Section::ellipse(b, s + c), base, order);
    let Ok(mut rod) = Rod::uniform(a, b, base, 1 + i % 6, order) else {
        return;
    };
    match j % 4 {
        0 => rod.set_intrinsic(|point| Vector3::new(c, d, point.apex_distance)),
        1 => rod.set_mature(c),
        2 => _ = rod.set_base(UnitQuaternion::from_axis_angle(&Vector3::x_axis(), c)),
        _ => {}
    }
    read_rod(&rod, [c, d, a, b], [i, j, k]);
    let environment = Still::tilted(0.3).environment(d);
    let law = LinearElastic {
        youngs_modulus: c,
        poissons_ratio: d,
    };
    let mut solver = NewtonSolver::with_tolerance(if k == 0 { a } else { 1e-10 });
    solver.max_iterations = 30;
    for n in 0..3 {
        let before = format!("{rod:?}");
        let answer = match n {
            0 => solver.solve(&mut rod, &law, &Weight { density: d }, &environment),
            1 => Unloaded.solve(&mut rod, &law, &(), &environment),
            _ => {
                let law: Arc<dyn Constitutive + Send + Sync> = Arc::new(Graded {
                    law: YOUNG,
                    factor: move |_: &Tissue| c,
                });
                let load: Arc<dyn Load + Send + Sync> = Arc::new(Distributed(Vector3::x() * d));
                solver.solve(&mut rod, &law, &load, &environment)
            }
        };
        match answer {
            // Sums overflow if the length of the rod is close to the largest finite number.
            Ok(_) => assert!(sound(&rod) || a > 1e300, "{rod:?}"),
            // The debug output is compared, because NaN is not equal to itself.
            Err(_) => assert_eq!(format!("{rod:?}"), before),
        }
        // The internal force of another rod is refused if the numbers of points differ.
        let foreign = InternalForce::of(GROWING[0].rod(), &(), &environment);
        let fits = rod.points().len() == GROWING[0].rod().points().len();
        let answer = solver.equilibrate(&mut rod, &law, &foreign);
        assert!(fits || answer.is_err());
    }
    let load = GradedWeight(|_: &Tissue| d);
    let profile = Profile::of(&rod, &law, &load, &environment);
    let _ = (profile.at(a), profile.at(c), profile.sample(i % 30));
}

/// Builds a shoot from arbitrary numbers.
fn call_builder([a, b, c, d]: [f64; 4], [i, j, k]: [usize; 3]) {
    let law = Lignifying {
        young: LinearElastic {
            youngs_modulus: 1e7,
            poissons_ratio: b,
        },
        mature_modulus: c,
        time: d,
    };
    let _ = law.check();
    let bend = Proprioception { sensitivity: b }.remembered(Memory { time: c, delay: d });
    let builder = Shoot::builder(law)
        .length(a)
        .section(move |s| b + c * s)
        .elements(i)
        .order(Order::ALL[j % 4]);
    let builder = builder.merge_tolerance(c).scene(Turned::tilted(a, b, c));
    let load = (
        PointForce {
            initial_apex_distance: a,
            force: Vector3::z() * b,
        },
        Pulse {
            peak: Vector3::x() * c,
            start: d,
            duration: a,
        },
        Whirl {
            force: a,
            period: b,
            turns: c,
        },
        ApicalForce(move |t| Vector3::y() * (d * t)),
    );
    let built = match k % 5 {
        0 => builder
            .growth(UniformGrowth {
                zone_length: c,
                time: d,
            })
            .tropism(bend)
            .into_dyn()
            .build()
            .map(|shoot| shoot.time()),
        1 => builder
            .growth(LinearProfile {
                zone_length: c,
                time: d,
            })
            .load(load)
            .into_dyn()
            .build()
            .map(|shoot| shoot.time()),
        2 => builder
            .growth(Ongoing(CosineProfile {
                zone_length: c,
                time: d,
            }))
            .into_dyn()
            .build()
            .map(|shoot| shoot.time()),
        3 => builder
            .growth(())
            .nodes(&[0.0, b, a])
            .into_dyn()
            .build()
            .map(|shoot| shoot.time()),
        _ => builder
            .tropism((bend, Oscillator::new(c, d)))
            .nodes(&vec![a; i % 4])
            .into_dyn()
            .build()
            .map(|shoot| shoot.time()),
    };
    assert!(built.is_err() || a > 0.0 && a.is_finite());
    // The growth laws are also called directly.
    for law in [
        &UniformGrowth {
            zone_length: 0.07,
            time: 72e3,
        } as &dyn GrowthLaw,
        &LinearProfile {
            zone_length: 0.07,
            time: 72e3,
        },
    ] {
        let _ = (law.regr(a, b), law.apical_speed(a, b), law.check(c));
        if a.abs() < 1.0 && b.abs() < 1e6 && c.abs() < 1e6 {
            let _ = (
                law.flow(a, b, c),
                law.exit_time(a, b, c),
                law.length(a, b.abs()),
                law.trace(a, d, c.abs()),
            );
        }
    }
}

/// Advances a shoot to arbitrary times.
fn call_integrator<M: morphorod::Model + Clone>(
    shoot: &Shoot<M>,
    [a, b, c, d]: [f64; 4],
    [i, j, k]: [usize; 3],
) {
    let mut moved = shoot.clone();
    let (now, before) = (shoot.time(), shoot.state().clone());
    // The distance in time is limited, so that no case takes several seconds.
    let near = |t: f64| {
        if (t - now).abs() < 3000.0 || !t.is_finite() {
            t
        } else {
            now + 1.0
        }
    };
    let step = if a > 0.0 && a < 60.0 { 60.0 + a } else { a };
    let mut steps = MethodOfSteps::new(step);
    let answer = match k % 6 {
        0 => steps.advance(&mut moved, near(b)),
        1 => steps.step(&mut moved, near(b)),
        2 => steps.advance_until(&mut moved, near(b), |shoot| shoot.tip().x * c + d),
        3 => steps.advance_showing(&mut moved, near(b), [c, d].map(near), |shoot| {
            assert!(sound(shoot.rod()))
        }),
        4 => steps.advance_showing(&mut moved, now + 200.0, [now, c, d], |_| {}),
        _ => steps.advance_until(&mut moved, now + 400.0, |_| c),
    };
    match answer {
        Ok(_) => assert!(sound(moved.rod())),
        Err(error) => assert!(moved.state() == &before, "{error}"),
    }
    let _ = (
        moved.steering_rate(),
        moved.state().variables(i),
        moved.profile().at(a),
        moved.profile().sample(j % 20),
    );
    read_rod(moved.rod(), [a, b, c, d], [i, j, k]);
}

/// Restores states of other shoots, replaces laws, and analyses the stability of the changed shoot.
fn call_shoot([a, b, c, d]: [f64; 4], [i, j, _]: [usize; 3]) {
    let mut shoot = REDUCED.clone();
    let before = shoot.state().clone();
    let foreign = &GROWING[i % 3];
    let restored = shoot.restore(foreign.state());
    assert!(
        restored.is_ok() == (i % 3 == 0),
        "a state with a history of other laws is refused"
    );
    if restored.is_err() {
        assert!(shoot.state() == &before);
    }
    let mut shoot = REDUCED.clone();
    let mut laws = *shoot.model();
    match j % 6 {
        0 => laws.load.density = a,
        1 => laws.growth.0.zone_length = b,
        2 => laws.tropism.0.memory = Memory { time: c, delay: d },
        3 => laws.tropism.1.response.sensitivity = d,
        4 => laws.scene.gravity = Vector3::new(a, b, c),
        _ => laws.constitutive.youngs_modulus = c,
    }
    if let Ok(changed) = shoot.with_model(laws) {
        shoot = changed;
        let kept = shoot.clone();
        let advanced = MethodOfSteps::new(360.0).advance(&mut shoot, kept.time() + 400.0);
        assert!(if advanced.is_ok() {
            sound(shoot.rod())
        } else {
            shoot == kept
        });
        if i == 0 {
            let _ =
                solve_steady_state(&mut shoot).map(|_| Linearisation::about(&shoot).map(|_| ()));
        }
    }
    let jump = PointForce {
        initial_apex_distance: a,
        force: Vector3::x() * b,
    };
    let grown = GROWING[2].with_model(GROWING[2].model().clone().with_load(jump).into_dyn());
    assert!(grown.is_err() || (0.0..=0.068).contains(&a));
    let wide = GROWING[2].with_model(
        GROWING[2]
            .model()
            .clone()
            .with_growth(UniformGrowth {
                zone_length: c,
                time: 72e3,
            })
            .into_dyn(),
    );
    if let Ok(mut wide) = wide {
        let _ = MethodOfSteps::new(360.0).advance(&mut wide, GROWING[2].time() + 400.0);
        assert!(sound(wide.rod()));
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 10_000,
        failure_persistence: None,
        max_shrink_iters: 200,
        ..ProptestConfig::default()
    })]
    #[test]
    fn any_call_returns_a_result_or_an_error(
        which in 0..5_u8, numbers in prop::array::uniform4(number()), indices in prop::array::uniform3(index()),
    ) {
        match which {
            0 => call_rod(numbers, indices),
            1 => call_builder(numbers, indices),
            2 => call_integrator(&GROWING[indices[2] % 3], numbers, indices),
            3 => call_integrator(&REDUCED, numbers, indices),
            _ => call_shoot(numbers, indices),
        }
    }
}
