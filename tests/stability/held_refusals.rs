//! Held shoots that a stability analysis must refuse.

use super::held::{LENGTH, lateral, shoot, top};
use crate::fixtures::shoots::WEIGHT;
use approx::assert_abs_diff_eq;
use morphorod::ParameterError;
use morphorod::equilibrium::EquilibriumError;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::stability::{Linearisation, StabilityError, solve_steady_state};
use morphorod::support::{Contact, Cylinder, Distance, HalfSpace, Hold, Moving, Obstacle, Support};
use morphorod::{DynLaws, Shoot};
use nalgebra::{Matrix3, Vector3};

fn heavy(support: impl Support + Send + Sync + 'static) -> Shoot<DynLaws> {
    shoot((LENGTH, 0.0, 4), WEIGHT, support)
}

fn refusal(shoot: &Shoot<DynLaws>) -> StabilityError {
    Linearisation::about(shoot).map(|_| ()).unwrap_err()
}

#[test]
fn straight_shoot_whose_apex_is_held_at_its_length_is_refused() {
    let error = refusal(&heavy(Hold::apex().at(top())));
    let parameter = |error: &ParameterError| {
        error.name == "neutral directions of the held rod" && error.value == 1.0
    };
    let expected = matches!(&error, StabilityError::Equilibrium(EquilibriumError::Parameter(error)) if parameter(error));
    assert!(expected, "{error}");
}

#[test]
fn shoot_that_touches_an_obstacle_is_refused_and_a_distant_obstacle_has_no_effect() {
    let radius = 0.5e-3;
    let pole = |x: f64| {
        let cylinder = Cylinder {
            through: Vector3::new(x, 0.0, 0.05),
            along: Vector3::y(),
            radius: 2e-3,
        };
        Contact {
            obstacle: cylinder,
            radius,
            friction: 0.0,
        }
    };
    // At first the shoot is straight and leans to x = 0.027 m at the height of the pole, and sags.
    let mut leaning = shoot((LENGTH, 0.5, 4), WEIGHT, pole(0.031));
    MethodOfSteps::new(300.0)
        .advance(&mut leaning, 0.0)
        .unwrap();
    assert!(
        !leaning.reactions().is_empty(),
        "the shoot leans on the pole"
    );
    // The apex of the steady shape is at x = 0.006 m and z = 0.066 m.
    let mut blocked = shoot((LENGTH, 0.5, 4), WEIGHT, pole(0.008));
    let before = blocked.clone();
    for error in [
        refusal(&leaning),
        solve_steady_state(&mut blocked).unwrap_err(),
    ] {
        let contacts = matches!(&error, StabilityError::Equilibrium(EquilibriumError::Parameter(error))
            if error.name == "number of contacts with obstacles" && error.value == 1.0);
        assert!(contacts, "{error}");
    }
    assert!(
        blocked.state() == before.state(),
        "an error leaves the shoot as it is"
    );
    let root = |shoot: &Shoot<DynLaws>| {
        Linearisation::about(shoot)
            .unwrap()
            .rightmost()
            .unwrap()
            .value
    };
    let (alone, beside) = (root(&heavy(())), root(&heavy(pole(0.01))));
    // Responses are differences, with a relative error of 1e-9.
    assert_abs_diff_eq!((alone - beside).norm(), 0.0, epsilon = 1e-9 * alone.norm());
}

#[test]
fn hold_away_from_the_shape_that_the_laws_request_permits_no_steady_state() {
    let mut free = shoot((LENGTH, 0.5, 4), WEIGHT, ());
    solve_steady_state(&mut free).unwrap();
    let mut held = shoot((LENGTH, 0.5, 4), WEIGHT, Hold::apex().at(free.tip() * 0.99));
    let before = held.clone();
    let error = solve_steady_state(&mut held).unwrap_err();
    assert!(
        matches!(error, StabilityError::NotSteadyState { gradient, .. } if gradient > 1.0),
        "{error}"
    );
    assert!(
        held.state() == before.state(),
        "an error leaves the shoot as it is"
    );
}

/// A plane that moves upwards towards the apex.
struct Rising;

impl Obstacle for Rising {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        let plane = HalfSpace {
            through: Vector3::z() * (0.08 + 1e-9 * time),
            normal: -Vector3::z(),
        };
        plane.distance(place, time)
    }
}

#[test]
fn supports_that_move_are_refused_and_those_that_only_may_move_are_not() {
    let anchor = |x: f64| Hold::apex().spring(top() + Vector3::x() * x, Matrix3::identity() * 1e-9);
    let stiffness = |k: f64| lateral(1e-4 * (1.0 + k));
    let moving: [(&str, Box<dyn Support + Send + Sync>); 4] = [
        (
            "anchor",
            Box::new(Moving(move |t: f64| anchor(1e-6 * (t / 900.0).sin()))),
        ),
        (
            "stiffness",
            Box::new(Moving(move |t: f64| stiffness(1e-9 * (t / 900.0).sin()))),
        ),
        (
            "line",
            Box::new(Moving(|t: f64| {
                Hold::apex().on_line(Vector3::z() * t, Vector3::z_axis())
            })),
        ),
        (
            "obstacle",
            Box::new(Contact {
                obstacle: Rising,
                radius: 5e-4,
                friction: 0.0,
            }),
        ),
    ];
    for (name, support) in moving {
        let error = refusal(&heavy(support));
        assert!(
            matches!(error, StabilityError::NotAutonomous { .. }),
            "{name}: {error}"
        );
    }
    let still = heavy(Moving(move |_: f64| stiffness(0.0)));
    assert!(Linearisation::about(&still).is_ok());
}
