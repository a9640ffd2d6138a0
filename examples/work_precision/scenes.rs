//! The scenes, their settings, and their reference solutions.

use std::error::Error;
use std::f64::consts::FRAC_PI_2;

use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::integrator::{Adaptive, ConstantHistory, Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Distributed, Weight, Whirl};
use morphorod::rod::Rod;
use morphorod::tropism::Statoliths;
use morphorod::{Model, Order, Scene as _, Shoot, ShootParameters, Still};
use nalgebra::Vector3;

use crate::measure::measure;
use crate::report::{Method, Point, ROUNDING, Scene};

const HOUR: f64 = 3600.0;
const RADIUS: f64 = 5e-4;
const YOUNG: LinearElastic = LinearElastic {
    youngs_modulus: 1e7,
    poissons_ratio: 0.5,
};
const WEIGHT: Weight = Weight { density: 1000.0 };
/// Tolerances.
const TOLERANCES: [f64; 7] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];

/// Number of compared points of a centre line, both ends included. Several are in each of the
/// shortest elements.
const PLACES: usize = 1001;
/// Label of errors of the tip.
const TIP: &str = "error of the tip / length (1)";
/// Label of errors of the centre line.
const LINE: &str = "largest error of the centre line / length (1)";

type Measured = Result<Scene, Box<dyn Error>>;
/// Computes a scene. If the argument is true, few settings are run once.
type Compute = fn(bool) -> Measured;

/// All scenes with their names.
pub const ALL: [(&str, Compute); 8] = [
    ("horizontal base", horizontal_base),
    ("heavy base", heavy_base),
    ("helix", helix),
    ("righting", righting),
    ("growing shoot", growing_shoot),
    ("circular orbit", circular_orbit),
    ("fast statoliths", fast_statoliths),
    ("snap-through", snap_through),
];

/// Returns the first item only if `quick`, otherwise all items.
fn some<T>(quick: bool, all: &[T]) -> &[T] {
    if quick { &all[..1] } else { all }
}

/// Distance of two tips, divided by the length of the shoot.
fn distance(a: &Vector3<f64>, b: &Vector3<f64>, length: f64) -> f64 {
    (a - b).norm() / length
}

/// Largest distance of two centre lines, divided by the length.
fn distance_of_lines(a: &Rod, b: &Rod) -> f64 {
    let (a, b, length) = (
        a.centre_line_at(PLACES),
        b.centre_line_at(PLACES),
        b.length(),
    );
    a.iter()
        .zip(&b)
        .map(|(a, b)| distance(a, b, length))
        .fold(0.0, f64::max)
}

/// Equilibrium of a rod with a horizontal base and a given density (kg/m³).
fn lying(
    quick: bool,
    name: &'static str,
    what: &'static str,
    density: f64,
    exact: &Rod,
) -> Measured {
    let (scene, weight, length) = (Still::tilted(FRAC_PI_2), Weight { density }, exact.length());
    let mut methods = Vec::new();
    for order in Order::ALL {
        let mut points = Vec::new();
        for &elements in some(quick, &[2, 4, 6, 8, 12, 16, 32, 64]) {
            let mut solver = NewtonSolver::with_tolerance(1e-13);
            let (rod, seconds) = measure(quick, || {
                let mut rod = Rod::uniform(length, RADIUS, scene.base, elements, order)?;
                let _ = solver.solve(&mut rod, &YOUNG, &weight, &scene.environment(0.0))?;
                Ok(rod)
            })?;
            let error = distance_of_lines(&rod, exact);
            points.push(Point {
                setting: format!("{elements} elements"),
                error,
                estimate: None,
                seconds,
            });
        }
        methods.push(Method {
            name: format!("order {}", order.exponent()),
            by_tolerance: false,
            points,
        });
    }
    let mut points = Vec::new();
    for &tolerance in some(quick, &TOLERANCES) {
        let mut integrator = Adaptive::new(tolerance);
        let shoot = Shoot::builder(YOUNG)
            .length(length)
            .radius(RADIUS)
            .load(weight)
            .scene(scene)
            .build()?;
        let ((shoot, cost), seconds) = measure(quick, || {
            let mut shoot = shoot.clone();
            let cost = integrator.start(&mut shoot, &ConstantHistory::Empty)?;
            Ok((shoot, cost))
        })?;
        let error = distance_of_lines(shoot.rod(), exact);
        points.push(Point {
            setting: format!("tolerance {tolerance:e}"),
            error,
            estimate: cost.error,
            seconds,
        });
    }
    methods.push(Method {
        name: "by tolerance".to_owned(),
        by_tolerance: true,
        points,
    });
    Ok(Scene {
        name,
        what,
        error: LINE,
        methods,
    })
}

fn horizontal_base(quick: bool) -> Measured {
    let (scene, what) = (
        Still::tilted(FRAC_PI_2),
        "equilibrium of a horizontal rod, q ℓ³/(E I) = 4.5",
    );
    let mut exact = Rod::uniform(0.0659, RADIUS, scene.base, 128, Order::Eight)?;
    let _ = NewtonSolver::with_tolerance(1e-13).solve(
        &mut exact,
        &YOUNG,
        &WEIGHT,
        &scene.environment(0.0),
    )?;
    // Initial value problem of the elastica, integrated with 40 digits; see
    // tests/statics/horizontal_base.rs.
    let tip = Vector3::new(0.057_253_565_806_158_82, 0.0, -0.030_426_176_324_779_89);
    let error = distance(&exact.tip(), &tip, 0.0659);
    // The distance is due to rounding.
    if error > ROUNDING {
        return Err(
            format!("the reference of the horizontal base has an error of {error:.1e}").into(),
        );
    }
    lying(quick, "horizontal base", what, WEIGHT.density, &exact)
}

fn heavy_base(quick: bool) -> Measured {
    // The load is 66 times that of the horizontal base. The reference has 400 elements, whose
    // lengths form a geometric sequence with ratio 1.02.
    let stiffness = YOUNG.stiffness(RADIUS).x;
    let per_length = 300.0 * stiffness / 0.0659_f64.powi(3);
    let density = per_length / (9.81 * std::f64::consts::PI * RADIUS * RADIUS);
    let scene = Still::tilted(FRAC_PI_2);
    let ratio: f64 = 1.02;
    let mut nodes: Vec<f64> = (0..=400)
        .map(|i| 0.0659 * (ratio.powi(i) - 1.0) / (ratio.powi(400) - 1.0))
        .collect();
    nodes[400] = 0.0659;
    let mut rod = Rod::straight(&nodes, |_| RADIUS, scene.base, Order::Eight)?;
    let _ = NewtonSolver::with_tolerance(1e-13).solve(
        &mut rod,
        &YOUNG,
        &Weight { density },
        &scene.environment(0.0),
    )?;
    lying(
        quick,
        "heavy base",
        "equilibrium of a heavy horizontal rod, q ℓ³/(E I) = 300",
        density,
        &rod,
    )
}

fn helix(quick: bool) -> Measured {
    // A helix of ten turns and 10 cm: intrinsic curvature κ and twist τ with √(κ² + τ²) ℓ = 20 π.
    let (length, turn) = (0.1, 20.0 * std::f64::consts::PI / 0.1);
    let (curvature, twist) = (0.6 * turn, 0.8 * turn);
    // After an integer number of turns, the tip lies on the axis (κ, 0, τ)/√(κ² + τ²) at the
    // distance ℓ τ/√(κ² + τ²).
    let exact = Vector3::new(0.6, 0.0, 0.8) * (0.8 * length);
    let mut methods = Vec::new();
    for order in Order::ALL {
        let mut points = Vec::new();
        for &elements in some(quick, &[32, 64, 128, 256]) {
            let mut rod = Rod::uniform(length, RADIUS, Still::upright().base, elements, order)?;
            rod.set_intrinsic(|_| Vector3::new(curvature, 0.0, twist));
            let mut solver = NewtonSolver::with_tolerance(1e-13);
            let (tip, seconds) = measure(quick, || {
                let mut rod = rod.clone();
                let environment = Still::upright().environment(0.0);
                let _ = solver.solve(&mut rod, &YOUNG, &Weight { density: 1e-9 }, &environment)?;
                Ok(rod.tip())
            })?;
            let error = distance(&tip, &exact, length);
            points.push(Point {
                setting: format!("{elements} elements"),
                error,
                estimate: None,
                seconds,
            });
        }
        methods.push(Method {
            name: format!("order {}", order.exponent()),
            by_tolerance: false,
            points,
        });
    }
    Ok(Scene {
        error: TIP,
        name: "helix",
        what: "equilibrium of a rod with the intrinsic shape of a helix of ten turns",
        methods,
    })
}

/// Settings of a simulation in time.
struct Course<'a> {
    /// Simulated time, s.
    end: f64,
    /// Numbers of elements.
    elements: &'a [usize],
    /// Fixed time steps, s.
    steps: &'a [f64],
    /// Number of elements and step (s) of the reference.
    fine: (usize, f64),
}

/// Runs a shoot to the time of the reference `exact`, and compares the centre lines.
fn timed<M: Model>(
    quick: bool,
    shoot: &Shoot<M>,
    integrator: &mut impl Integrator,
    exact: &Shoot<M>,
    setting: String,
) -> Result<Point, Box<dyn Error>>
where
    Shoot<M>: Clone,
{
    let ((shoot, cost), seconds) = measure(quick, || {
        let mut shoot = shoot.clone();
        let cost = integrator.advance(&mut shoot, exact.time())?;
        Ok((shoot, cost))
    })?;
    let error = distance_of_lines(shoot.rod(), exact.rod());
    Ok(Point {
        setting,
        error,
        estimate: cost.error,
        seconds,
    })
}

/// Computes a scene in time. The error is that of the centre line at the end.
fn in_time<M: Model>(
    quick: bool,
    (name, what): (&'static str, &'static str),
    make: impl Fn(usize) -> Result<Shoot<M>, Box<dyn Error>>,
    course: &Course,
) -> Measured
where
    Shoot<M>: Clone,
{
    let mut exact = make(course.fine.0)?;
    let mut reference = MethodOfSteps::new(course.fine.1);
    reference.solver.tolerance = 1e-12;
    reference.advance(&mut exact, course.end)?;
    let mut methods = Vec::new();
    for &elements in some(quick, course.elements) {
        let (shoot, mut points) = (make(elements)?, Vec::new());
        for &step in some(quick, course.steps) {
            points.push(timed(
                quick,
                &shoot,
                &mut MethodOfSteps::new(step),
                &exact,
                format!("{step} s"),
            )?);
        }
        methods.push(Method {
            name: format!("steps with {elements} elements"),
            by_tolerance: false,
            points,
        });
    }
    let (shoot, mut points) = (make(8)?, Vec::new());
    // The smallest tolerance is below the error of the reference.
    for &tolerance in some(quick, &TOLERANCES[..6]) {
        let setting = format!("tolerance {tolerance:e}");
        points.push(timed(
            quick,
            &shoot,
            &mut Adaptive::new(tolerance),
            &exact,
            setting,
        )?);
    }
    methods.push(Method {
        name: "by tolerance".to_owned(),
        by_tolerance: true,
        points,
    });
    Ok(Scene {
        name,
        what,
        error: LINE,
        methods,
    })
}

/// Parameters of a shoot of the given length (m) with the growth time of 20 h.
fn short_growth(length: f64) -> ShootParameters {
    ShootParameters {
        length,
        growth_time: 20.0 * HOUR,
        ..ShootParameters::default()
    }
}

fn righting(quick: bool) -> Measured {
    let course = Course {
        end: 1.5 * HOUR,
        elements: &[3, 4, 6, 8],
        steps: &[360.0, 180.0, 90.0, 45.0, 22.5],
        fine: (16, 2.0),
    };
    let what = "righting of a horizontal shoot, after 1.5 h";
    in_time(
        quick,
        ("righting", what),
        |elements| {
            let builder = short_growth(0.05).reduced().elements(elements);
            Ok(builder.scene(Still::tilted(FRAC_PI_2)).build()?)
        },
        &course,
    )
}

fn fast_statoliths(quick: bool) -> Measured {
    let course = Course {
        end: 1.5 * HOUR,
        elements: &[3, 4, 6, 8],
        steps: &[360.0, 180.0, 90.0, 45.0, 22.5],
        fine: (16, 2.0),
    };
    let what = "righting with statolith avalanches of 1 ms, after 1.5 h";
    let statoliths = Statoliths {
        avalanche_time: 1e-3,
    };
    in_time(
        quick,
        ("fast statoliths", what),
        |elements| {
            let parameters = short_growth(0.05);
            let builder = parameters.reduced().elements(elements);
            let steered = builder.tropism(parameters.steering(statoliths));
            Ok(steered.scene(Still::tilted(FRAC_PI_2)).build()?)
        },
        &course,
    )
}

fn circular_orbit(quick: bool) -> Measured {
    let whirl = Whirl {
        force: 1e-5,
        period: 87.6 * 60.0,
        turns: 2.0,
    };
    let make = |elements: usize| -> Result<Shoot<_>, Box<dyn Error>> {
        let builder = short_growth(0.0659).reduced().elements(elements);
        Ok(builder.load((WEIGHT, whirl)).build()?)
    };
    let course = Course {
        end: 10.0 * HOUR,
        elements: &[3, 4, 6],
        steps: &[360.0, 180.0, 120.0, 90.0, 60.0, 45.0],
        fine: (12, 5.0),
    };
    in_time(
        quick,
        (
            "circular orbit",
            "circular orbit started by a rotating force, after 10 h",
        ),
        make,
        &course,
    )
}

fn growing_shoot(quick: bool) -> Measured {
    let make = |elements: usize| -> Result<Shoot<_>, Box<dyn Error>> {
        Ok(ShootParameters::default()
            .shoot()
            .elements(elements)
            // From 1e-3 with three elements to 1e-6 with eight, so that the error of merging is below
            // that of the elements.
            .merge_tolerance(1e-3 * 4_f64.powi(3 - elements as i32))
            .load((
                WEIGHT,
                Distributed(Vector3::new(0.0, -1e-6, 0.0)),
                ApicalForce((|_t: f64| Vector3::new(-1e-7, -1e-7, 0.0)) as fn(f64) -> Vector3<f64>),
            ))
            .build()?)
    };
    let (hours, what) = match quick {
        true => (1.0, "growing shoot (video 2), after 1 h"),
        false => (10.0, "growing shoot (video 2), after 10 h"),
    };
    let course = Course {
        end: hours * HOUR,
        elements: &[3, 4, 6, 8],
        steps: &[360.0, 240.0, 180.0, 144.0, 90.0, 60.0, 45.0, 30.0],
        fine: (14, 10.0),
    };
    in_time(quick, ("growing shoot", what), make, &course)
}

/// Snap-through of a shoot that is longer than the self-buckling length. A horizontal force at its
/// apex bends it to one side, decreases and reverses, until the shoot snaps to the other side. A
/// small transverse force breaks the symmetry. Errors are those of the time at which the tip passes
/// the vertical, and of the tip at the end.
fn snap_through(quick: bool) -> Measured {
    let make = |elements: usize| -> Result<Shoot<_>, Box<dyn Error>> {
        let force =
            (|t: f64| Vector3::new(1e-5 * (1.0 - t / HOUR), 1e-8, 0.0)) as fn(f64) -> Vector3<f64>;
        Ok(Shoot::builder(YOUNG)
            .length(0.09)
            .radius(RADIUS)
            .elements(elements)
            .load((WEIGHT, ApicalForce(force)))
            .build()?)
    };
    let run = |shoot: &Shoot<_>, step: f64| -> Result<(f64, Vector3<f64>), Box<dyn Error>> {
        let mut shoot = shoot.clone();
        let mut integrator = MethodOfSteps::new(step);
        integrator.solver.tolerance = 1e-11;
        integrator.advance_until(&mut shoot, 6.0 * HOUR, |shoot| -shoot.tip().x)?;
        let time = shoot.time();
        integrator.advance(&mut shoot, 6.0 * HOUR)?;
        Ok((time, shoot.tip()))
    };
    let exact = run(&make(24)?, 60.0)?;
    let mut methods = Vec::new();
    for &step in some(quick, &[360.0, 120.0]) {
        for (k, name) in ["time", "tip"].into_iter().enumerate() {
            let mut points = Vec::new();
            for &elements in some(quick, &[2, 4, 6, 8, 12]) {
                let shoot = make(elements)?;
                let ((time, tip), seconds) = measure(quick, || run(&shoot, step))?;
                let errors = [
                    (time - exact.0).abs() / exact.0,
                    distance(&tip, &exact.1, 0.09),
                ];
                points.push(Point {
                    setting: format!("{elements} elements"),
                    error: errors[k],
                    estimate: None,
                    seconds,
                });
            }
            methods.push(Method {
                name: format!("{name} with steps of {step} s"),
                by_tolerance: false,
                points,
            });
        }
    }
    Ok(Scene {
        name: "snap-through",
        error: "relative error of the time or of the tip",
        what: "snap-through of a buckled shoot",
        methods,
    })
}
