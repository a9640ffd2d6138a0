//! Shoots whose base is not at the origin, or moves.

use std::f64::consts::TAU;

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{HOUR, RADIUS, WEIGHT, YOUNG, righting, rod, tissue};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::checkpoint::{from_bytes, to_bytes};
use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::NewtonSolver;
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Adaptive, IntegrationError, Integrator, MethodOfSteps, TimeStepper};
use morphorod::rod::Rod;
use morphorod::support::{Contact, Cylinder, Hold, Joint};
use morphorod::tropism::{
    Declaration, DirectionalTropism, Memory, Oscillator, Perception, Response, Site, Source,
};
use morphorod::{Along, DynLaws, Order, Scene, Shoot, ShootBuilder, State, Still};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// An offset in space, m.
const OFFSET: Vector3<f64> = Vector3::new(0.31, -0.17, 0.23);
const TISSUE: LinearElastic = tissue(1e8);

/// A nutating, growing shoot with its base at a place (m), held and in contact beside it.
fn nutating(place: Vector3<f64>) -> Shoot<DynLaws> {
    let pole = Cylinder {
        through: place + Vector3::new(7.5e-3, 0.0, 0.045),
        along: Vector3::new(0.1, 1.0, 0.2),
        radius: 2e-3,
    };
    let spring = Hold::place(0.02).spring(place + Vector3::z() * 0.04, Matrix3::identity() * 0.02);
    let hold = Hold::apex().on_plane(place + Vector3::y() * 2e-3, Vector3::y_axis());
    rod(TISSUE, 0.06)
        .growth(UniformGrowth {
            zone_length: 0.05,
            time: 40.0 * HOUR,
        })
        .tropism(Oscillator::new(1.0, 2.0 * HOUR))
        .load(WEIGHT)
        .scene(Along {
            scene: Still::tilted(0.1),
            path: move |_| place,
        })
        .support((
            spring,
            hold,
            Contact {
                obstacle: pole,
                radius: RADIUS,
                friction: 0.3,
            },
        ))
        .into_dyn()
        .build()
        .unwrap()
}

#[test]
fn translated_scene_gives_the_same_shape_and_reactions() {
    let [mut shoot, mut moved] = [Vector3::zeros(), OFFSET].map(nutating);
    let mut touched = 0;
    for hours in 1..5 {
        for shoot in [&mut shoot, &mut moved] {
            MethodOfSteps::new(240.0)
                .advance(shoot, 0.5 * HOUR * f64::from(hours))
                .unwrap();
        }
        // The tolerance of the frames, 1e-11 rad, with the history of friction.
        for (a, b) in shoot
            .rod()
            .centre_line_at(31)
            .iter()
            .zip(moved.rod().centre_line_at(31))
        {
            assert_abs_diff_eq!(InNorm(*a), InNorm(b - OFFSET), epsilon = 1e-10);
        }
        assert_eq!(shoot.reactions().len(), moved.reactions().len());
        for (a, b) in shoot.reactions().iter().zip(moved.reactions()) {
            assert_abs_diff_eq!(
                InNorm(a.force),
                InNorm(b.force),
                epsilon = 1e-6 * a.force.norm().max(1e-4)
            );
        }
        touched += usize::from(
            shoot
                .reactions()
                .iter()
                .any(|reaction| reaction.obstacle.is_some()),
        );
    }
    assert!(touched > 0, "the shoot touches the pole");
}

#[test]
fn all_positions_are_in_the_fixed_frame() {
    let mut shoot = righting()
        .scene(Along {
            scene: Still::tilted(1.0),
            path: |_| OFFSET,
        })
        .into_dyn()
        .build()
        .unwrap();
    let mut still = righting()
        .scene(Still::tilted(1.0))
        .into_dyn()
        .build()
        .unwrap();
    assert_eq!(shoot.rod().base_position(), OFFSET);
    for shoot in [&mut shoot, &mut still] {
        MethodOfSteps::new(180.0).advance(shoot, HOUR).unwrap();
    }
    let (a, b) = (still.rod(), shoot.rod());
    // The rounding of the offset.
    let same = |a: Vector3<f64>, b: Vector3<f64>| {
        assert_abs_diff_eq!(InNorm(a + OFFSET), InNorm(b), epsilon = 1e-15)
    };
    same(still.tip(), shoot.tip());
    same(a.at(0.02).unwrap().0, b.at(0.02).unwrap().0);
    same(a.centre_line()[3].1, b.centre_line()[3].1);
    same(a.centre_line_at(7)[4], b.centre_line_at(7)[4]);
    same(
        still.profile().at(0.03).unwrap().position,
        shoot.profile().at(0.03).unwrap().position,
    );
    assert_eq!(b.centre_line_at(1), [OFFSET]);
    assert_eq!(b.at(0.0).unwrap().0, OFFSET);
    // Laws that sense the shape do not depend on the position.
    assert_eq!(a.frames(), b.frames());
}

#[test]
fn state_contains_the_position_of_the_base() {
    let scene = || Along {
        scene: Still::tilted(0.3),
        path: |t: f64| OFFSET + Vector3::x() * (1e-6 * t),
    };
    let mut shoot = righting().scene(scene()).into_dyn().build().unwrap();
    MethodOfSteps::new(180.0).advance(&mut shoot, HOUR).unwrap();
    assert_eq!(shoot.rod().base_position(), OFFSET + Vector3::x() * 3.6e-3);
    let read: State = from_bytes(&to_bytes(shoot.state()).unwrap()).unwrap();
    assert!(&read == shoot.state());
    let mut restored = righting().scene(scene()).into_dyn().build().unwrap();
    restored.restore(&read).unwrap();
    assert_eq!(restored.tip(), shoot.tip());
}

#[test]
fn position_that_is_not_finite_is_refused() {
    let mut rod = Rod::uniform(0.05, RADIUS, UnitQuaternion::identity(), 4, Order::Six).unwrap();
    let kept = rod.clone();
    let error = rod
        .set_base_position(Vector3::new(0.0, f64::NAN, 0.0))
        .unwrap_err();
    assert!(
        error.to_string().contains("position of the base"),
        "{error}"
    );
    assert_eq!(rod, kept);
    let path = |t: f64| Vector3::x() * if t > 1000.0 { f64::INFINITY } else { 0.0 };
    let mut shoot = righting()
        .scene(Along {
            scene: Still::upright(),
            path,
        })
        .into_dyn()
        .build()
        .unwrap();
    let error = MethodOfSteps::new(180.0)
        .advance(&mut shoot, HOUR)
        .unwrap_err();
    assert!(
        matches!(
            error,
            IntegrationError::NotFinite {
                what: "position of the base",
                ..
            }
        ),
        "{error}"
    );
    let scene = Along {
        scene: Still::upright(),
        path: |_| Vector3::repeat(f64::NAN),
    };
    let error = righting().scene(scene).into_dyn().build().unwrap_err();
    assert!(
        error.to_string().contains("position of the base"),
        "{error}"
    );
}

#[test]
fn energy_does_not_depend_on_the_position() {
    let solve = |place: Vector3<f64>| {
        let scene = Still::tilted(1.2);
        let mut rod = Rod::uniform(0.05, RADIUS, scene.base, 8, Order::Eight).unwrap();
        rod.set_base_position(place).unwrap();
        let pole = Cylinder {
            through: place + Vector3::new(0.02, 0.0, -0.002),
            along: Vector3::y(),
            radius: 1e-3,
        };
        let hold = Hold::apex().at(apex(place));
        let support = (
            Joint::Ball,
            hold,
            Contact {
                obstacle: pole,
                radius: RADIUS,
                friction: 0.2,
            },
        );
        let held = NewtonSolver::default()
            .solve_held(&mut rod, &YOUNG, &WEIGHT, &support, &scene.environment(0.0))
            .unwrap();
        assert!(
            held.reactions
                .iter()
                .any(|reaction| reaction.obstacle.is_some()),
            "{:?}",
            held.reactions
        );
        assert_abs_diff_eq!(InNorm(held.rod.tip()), InNorm(apex(place)), epsilon = 1e-12);
        held.equilibrium.energy
    };
    // The energy is least, so that its error is of second order in that of the shape.
    assert_relative_eq!(solve(OFFSET), solve(Vector3::zeros()), max_relative = 1e-9);
}

/// The place of the apex in `energy_does_not_depend_on_the_position`, m.
fn apex(place: Vector3<f64>) -> Vector3<f64> {
    place + Vector3::new(0.035, 0.01, -0.002)
}

/// A lamp at a place (m).
#[derive(Clone, Copy)]
struct Lamp(Vector3<f64>);

impl Perception for Lamp {
    type Signal = [f64; 2];

    fn declare(&self, to: &mut Declaration) -> Source {
        to.with_position().stimulus_pair()
    }

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let light = site.along_directors(&(self.0 - site.position).normalize());
        stimuli.copy_from_slice(&[light.x, light.y]);
    }
}

#[test]
fn laws_sense_positions_in_the_fixed_frame() {
    let tip = |lamp: Vector3<f64>, place: Vector3<f64>| {
        let scene = Along {
            scene: Still::upright(),
            path: move |_| place,
        };
        let mut shoot = rod(YOUNG, 0.05)
            .growth(UniformGrowth {
                zone_length: 0.05,
                time: 40.0 * HOUR,
            })
            .tropism(
                DirectionalTropism {
                    sensitivity: 0.8,
                    perception: Lamp(lamp),
                }
                .remembered(Memory {
                    time: 600.0,
                    delay: 0.0,
                }),
            )
            .scene(scene)
            .into_dyn()
            .build()
            .unwrap();
        MethodOfSteps::new(240.0)
            .advance(&mut shoot, 2.0 * HOUR)
            .unwrap();
        shoot.tip() - place
    };
    let lamp = Vector3::new(0.1, 0.0, 0.1);
    let expected = tip(lamp, Vector3::zeros());
    assert_abs_diff_eq!(
        InNorm(tip(lamp + OFFSET, OFFSET)),
        InNorm(expected),
        epsilon = 1e-11
    );
    assert!(
        (tip(lamp, OFFSET) - expected).norm() > 1e-3,
        "a shoot elsewhere bends otherwise"
    );
}

/// A base that rotates about the horizontal axis e1 with a period (s).
#[derive(Clone, Copy)]
struct Clinostat(f64);

impl Scene for Clinostat {
    fn gravity(&self, _t: f64) -> Vector3<f64> {
        Still::upright().gravity
    }
    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), TAU * t / self.0)
    }
}

#[test]
fn steps_in_which_the_base_makes_turns_are_refused() {
    let build = |turns: f64| {
        let builder = rod(YOUNG, 0.05).scene(Clinostat(60.0 / turns));
        builder.load(WEIGHT).into_dyn()
    };
    let begin = |builder: ShootBuilder<DynLaws>| {
        let mut shoot = builder.build().unwrap();
        TimeStepper::default()
            .begin(&mut shoot, &mut NewtonSolver::default(), 60.0)
            .map(|_| ())
    };
    let refused = |answer: Result<(), IntegrationError>| {
        matches!(answer, Err(IntegrationError::BaseTurns { .. }))
    };
    for turns in (33..=6000).map(|i| 0.01 * f64::from(i)) {
        assert!(refused(begin(build(turns))), "{turns} turns");
    }
    begin(build(0.3)).unwrap();
    // The frame of the scene has no effect on a base that rotates freely, and only the axis on one
    // with a hinge.
    let spring = Hold::apex().spring(Vector3::new(0.015, 0.01, 0.045), Matrix3::identity() * 0.2);
    let base = Hold::place(0.05).at(Vector3::zeros());
    begin(build(0.5).support((Joint::Ball, spring)).into_dyn()).unwrap();
    begin(build(0.5).support((Joint::Free, base, spring)).into_dyn()).unwrap();
    begin(
        build(0.5)
            .support((Joint::Hinge(Vector3::x_axis()), spring))
            .into_dyn(),
    )
    .unwrap();
    assert!(refused(begin(
        build(0.5)
            .support((Joint::Hinge(Vector3::y_axis()), spring))
            .into_dyn()
    )));
}

#[test]
fn clinostat_needs_steps_of_a_twentieth_of_a_rotation() {
    // Six rotations of ten minutes.
    let (period, until) = (600.0, 3600.0);
    let shoot = || {
        righting()
            .scene(Clinostat(period))
            .into_dyn()
            .build()
            .unwrap()
    };
    let with_steps = |each: f64| {
        let mut shoot = shoot();
        MethodOfSteps::new(period / each)
            .advance(&mut shoot, until)
            .unwrap();
        shoot.tip()
    };
    // The error of the fine run is 1/256 of that with forty steps a rotation.
    let fine = with_steps(160.0);
    let errors = [20.0, 40.0].map(|each| (with_steps(each) - fine).norm());
    // These numbers are in the chapter on the method.
    assert_relative_eq!(errors[0], 1.4e-6, max_relative = 0.1);
    assert_relative_eq!(errors[1], 1.2e-7, max_relative = 0.1);
    let mut shoot = shoot();
    let tolerance = 1e-5;
    Adaptive::new(tolerance).advance(&mut shoot, until).unwrap();
    assert!((shoot.tip() - fine).norm() <= tolerance * shoot.rod().length());
}
