//! Shoots in time with springs of the user, hinged bases in scenes that rotate, and obstacles that
//! yield.

use crate::fixtures::shoots::{HOUR, RADIUS, WEIGHT, rod, tissue};
use approx::assert_abs_diff_eq;
use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::NewtonSolver;
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::support::{
    Argument, Contact, Distance, Elastic, Energy, Hold, Joint, Obstacle, Potential, Slip, Support,
};
use morphorod::tropism::Oscillator;
use morphorod::{DynLaws, Scene, ShootBuilder, Still};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

const TISSUE: LinearElastic = tissue(1e8);
const GROWTH: UniformGrowth = UniformGrowth {
    zone_length: 0.05,
    time: 40.0 * HOUR,
};
const LENGTH: f64 = 0.06;

fn nutating<S: Support + Send + Sync + 'static>(support: S) -> ShootBuilder<DynLaws> {
    let builder = rod(TISSUE, LENGTH).growth(GROWTH);
    builder
        .tropism(Oscillator::new(1.0, 2.0 * HOUR))
        .load(WEIGHT)
        .support(support)
        .into_dyn()
}

/// A rope to an anchor, which becomes taut at a length (m), and shorter in time (m/s).
#[derive(Clone, Copy)]
struct Rope {
    anchor: Vector3<f64>,
    length: f64,
    speed: f64,
    stiffness: f64,
}

impl Potential for Rope {
    fn energy(&self, place: &Vector3<f64>, time: f64) -> Energy {
        let from = place - self.anchor;
        let (distance, stretch) = (from.norm(), from.norm() - self.length + self.speed * time);
        if stretch <= 0.0 {
            return Energy {
                value: 0.0,
                gradient: Vector3::zeros(),
                stiffness: Matrix3::zeros(),
            };
        }
        let along = from / distance;
        let across = Matrix3::identity() - along * along.transpose();
        Energy {
            value: 0.5 * self.stiffness * stretch * stretch,
            gradient: along * (self.stiffness * stretch),
            stiffness: (along * along.transpose() + across * (stretch / distance)) * self.stiffness,
        }
    }
}

#[test]
fn rope_pulls_a_growing_shoot_only_while_it_is_taut() {
    // The place is in the growth zone and moves with the tissue. Its distance from the anchor
    // oscillates by nutation.
    let rope = Rope {
        anchor: Vector3::new(-0.04, 0.0, 0.03),
        length: 0.043,
        speed: 2e-7,
        stiffness: 0.2,
    };
    let tied = Elastic {
        initial_apex_distance: 0.02,
        argument: Argument::Position,
        potential: rope,
    };
    let (mut shoot, mut free) = (
        nutating(tied).build().unwrap(),
        nutating(()).build().unwrap(),
    );
    let (mut run, mut other) = (MethodOfSteps::new(120.0), MethodOfSteps::new(120.0));
    let (mut slack, mut taut, mut moved) = (0, 0, 0.0_f64);
    while shoot.time() < 4.0 * HOUR {
        let _ = run.step(&mut shoot, 4.0 * HOUR).unwrap();
        let _ = other.step(&mut free, 4.0 * HOUR).unwrap();
        let [reaction] = shoot.reactions() else {
            panic!("one spring")
        };
        assert_abs_diff_eq!(reaction.initial_apex_distance, 0.02, epsilon = 1e-15);
        let place = shoot.rod().at(reaction.arc_length).unwrap().0;
        let gradient = rope.energy(&place, shoot.time()).gradient;
        // The default tolerance of the frames, 1e-11 rad, moves the place by 1e-12 m.
        assert_abs_diff_eq!(
            (reaction.force + gradient).norm(),
            0.0,
            epsilon = 1e-11 * rope.stiffness
        );
        *(if gradient == Vector3::zeros() {
            &mut slack
        } else {
            &mut taut
        }) += 1;
        moved = moved.max((shoot.tip() - free.tip()).norm());
    }
    println!("{slack} slack, {taut} taut, {moved:e} m");
    assert!(
        slack > 10 && taut > 10 && moved > 1e-3,
        "{slack} slack, {taut} taut, {moved:e} m"
    );
}

/// A scene that rotates as a whole: the base about two axes, and gravity with a share of that
/// rotation.
struct Tumbling {
    /// Whether the base rotates and gravity is fixed. Otherwise the base is fixed, and gravity
    /// rotates the other way.
    base: bool,
}

fn turn(t: f64) -> UnitQuaternion<f64> {
    let about = |axis, rate: f64| UnitQuaternion::from_axis_angle(&axis, rate * t / HOUR);
    about(Vector3::x_axis(), 0.4) * about(Vector3::z_axis(), 0.7) * about(Vector3::y_axis(), 0.3)
}

impl Scene for Tumbling {
    fn gravity(&self, t: f64) -> Vector3<f64> {
        let down = Vector3::new(1.0, 2.0, -9.0);
        if self.base {
            down
        } else {
            turn(t).inverse() * down
        }
    }

    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        if self.base {
            turn(t)
        } else {
            UnitQuaternion::identity()
        }
    }
}

#[test]
fn joint_of_a_rotating_base_gives_the_shape_in_the_rotating_frame() {
    // A spring that rotates with the base keeps the shoot from a free rotation about the vertical.
    for joint in [Joint::Hinge(Vector3::y_axis()), Joint::Ball] {
        let shoot = |base: bool| {
            let solver = NewtonSolver::with_tolerance(1e-12);
            let shoot = nutating((joint, Magnet { follows: base }))
                .scene(Tumbling { base })
                .into_dyn()
                .build()
                .unwrap();
            (shoot, MethodOfSteps::with_solver(300.0, solver))
        };
        let ((mut moving, mut run), (mut still, mut other)) = (shoot(true), shoot(false));
        for hour in 1..=4 {
            let until = f64::from(hour) * HOUR;
            run.advance(&mut moving, until).unwrap();
            other.advance(&mut still, until).unwrap();
            let error = moving.tip() - turn(until) * still.tip();
            println!("{joint:?}: {:e} m", error.norm());
            // The tolerance of the frames is 1e-12 rad in each of 48 steps.
            assert_abs_diff_eq!(error.norm(), 0.0, epsilon = 1e-10 * LENGTH);
            if let Joint::Hinge(axis) = joint {
                // The axis of the hinge is that of the scene.
                let axes =
                    moving.rod().frames()[0] * axis.into_inner() - turn(until) * axis.into_inner();
                assert_abs_diff_eq!(axes.norm(), 0.0, epsilon = 1e-11);
            }
        }
    }
}

/// A spring to the place of the upright apex, which may rotate with the base.
struct Magnet {
    follows: bool,
}

impl Potential for Magnet {
    fn energy(&self, place: &Vector3<f64>, time: f64) -> Energy {
        let anchor = Vector3::new(0.3, 0.2, 0.9) * LENGTH;
        let (stiffness, from) = (
            0.2,
            place
                - if self.follows {
                    turn(time) * anchor
                } else {
                    anchor
                },
        );
        let value = 0.5 * stiffness * from.norm_squared();
        Energy {
            value,
            gradient: from * stiffness,
            stiffness: Matrix3::identity() * stiffness,
        }
    }
}

impl Support for Magnet {
    fn potentials(&self) -> Vec<Elastic<&dyn Potential>> {
        vec![Elastic {
            initial_apex_distance: 0.0,
            argument: Argument::Position,
            potential: self,
        }]
    }
}

/// Gravity that increases from zero, obliquely.
struct Rising;

impl Scene for Rising {
    fn gravity(&self, t: f64) -> Vector3<f64> {
        Vector3::new(1.0, 0.2, 0.1) * (9.81 * t / HOUR)
    }

    fn base(&self, _t: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::identity()
    }
}

/// An inclined plane on springs, through the upright apex.
struct Panel;

impl Panel {
    fn compliance_of_rod() -> f64 {
        LENGTH.powi(3) / (1e8 * std::f64::consts::PI * RADIUS.powi(4) / 4.0)
    }
}

impl Obstacle for Panel {
    fn distance(&self, place: &Vector3<f64>, _time: f64) -> Distance {
        let normal = Vector3::new(-1.0, 0.0, -0.3).normalize();
        Distance {
            value: normal.dot(&(place - Vector3::z() * LENGTH)),
            normal,
            curvature: Matrix3::zeros(),
        }
    }

    fn compliance(&self) -> Matrix3<f64> {
        Matrix3::new(1.0, 0.2, 0.1, 0.2, 0.8, -0.2, 0.1, -0.2, 1.3) * Self::compliance_of_rod()
    }
}

#[test]
fn apex_sticks_to_a_yielding_obstacle_over_many_steps() {
    // The displacement of the obstacle adds up over the steps to that of a spring.
    let spring = Hold::apex().spring(
        Vector3::z() * LENGTH,
        Panel.compliance().try_inverse().unwrap().symmetric_part(),
    );
    let plain = || rod(TISSUE, LENGTH).load(WEIGHT).scene(Rising);
    let contact = Contact {
        obstacle: Panel,
        radius: 0.0,
        friction: 5.0,
    };
    let (mut sticking, mut held) = (
        plain().support(contact).into_dyn().build().unwrap(),
        plain().support(spring).into_dyn().build().unwrap(),
    );
    for shoot in [&mut sticking, &mut held] {
        MethodOfSteps::new(600.0).advance(shoot, HOUR).unwrap();
    }
    let force = held.reactions()[0].force;
    println!("{:?}, tip {:?}", sticking.reactions(), held.tip());
    assert_eq!(sticking.reactions()[0].slip, Some(Slip::Sticks));
    // A contact that sticks has a compliance of 1e-9 of that of the rod.
    assert_abs_diff_eq!(
        (sticking.reactions()[0].force - force).norm(),
        0.0,
        epsilon = 1e-6 * force.norm()
    );
    assert_abs_diff_eq!(
        (sticking.tip() - held.tip()).norm(),
        0.0,
        epsilon = 1e-8 * LENGTH
    );
    assert!((held.tip() - Vector3::z() * LENGTH).norm() > 0.01 * LENGTH);
}

#[test]
fn held_places_leave_the_growth_zone_and_remain_held() {
    // The first place leaves the zone of 0.05 m within the first step, the second one after 21 h.
    // Elements beside it become short at the boundary of the zone, and merge later.
    for (distance, hours) in [(0.049998, 1.0), (0.03, 23.0)] {
        let plane = Vector3::z() * (0.9 * (LENGTH - distance));
        let hold = Hold::place(distance).on_plane(plane, Vector3::z_axis());
        let shoot = nutating(hold)
            .tropism(Oscillator::new(0.3, 2.0 * HOUR))
            .scene(Still::tilted(0.5))
            .into_dyn();
        let mut shoot = shoot.build().unwrap();
        let mut run = MethodOfSteps::new(300.0);
        while shoot.time() < hours * HOUR {
            let _ = run.step(&mut shoot, hours * HOUR).unwrap();
            let place = shoot.rod().at(shoot.reactions()[0].arc_length).unwrap().0;
            // The solver returns to the conditions up to 1e-12 of the length, or 1e-8 of it if they
            // do not decrease.
            assert_abs_diff_eq!(place.z, plane.z, epsilon = 1e-8 * LENGTH);
        }
        let left = shoot.rod().growth_zone().start;
        assert!(shoot.reactions()[0].arc_length < left, "{distance}");
    }
}
