//! Solvers outside the crate: energy, couples and tangent of a rod at its frames, and the solvers
//! of the example `own_solver`.

#[path = "../../examples/own_solver/arc_length.rs"]
mod arc_length;
#[path = "../../examples/own_solver/elastica.rs"]
mod elastica;
#[path = "../../examples/own_solver/relaxation.rs"]
mod relaxation;

use std::f64::consts::FRAC_PI_2;

use super::elastica::bisshopp_drucker;
use crate::fixtures::in_norm::InNorm;
use crate::fixtures::rods::{bending_stiffness, solve_tight, weightless};
use crate::fixtures::shoots::{HOUR, RADIUS, WEIGHT, YOUNG, growing, righting};
use approx::assert_abs_diff_eq;
use arc_length::{Family, Point};
use morphorod::constitutive::{Constitutive, ElasticResponse, LineResponse, Timoshenko, Tissue};
use morphorod::equilibrium::{
    Equilibrium, EquilibriumError, EquilibriumSolver, NewtonSolver, RodEnergy,
};
use morphorod::integrator::{IntegrationError, Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Distributed, InternalForce, Weight};
use morphorod::rod::{Rod, RodError};
use morphorod::{Order, Scene, Section, Still};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use relaxation::DynamicRelaxation;

fn turn(vector: Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(vector)
}

/// Energy (B/2) (κ² + κ⁴/(2 κ0²)) of bending and twist, with κ0 = 20 1/m.
struct Stiffening;

impl Constitutive for Stiffening {
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        let (b, square) = (
            YOUNG.stiffness(tissue.section),
            strain.norm_squared() / 400.0,
        );
        let b = b.x;
        ElasticResponse {
            energy: 0.5 * b * strain.norm_squared() * (1.0 + 0.5 * square),
            couple: strain * (b * (1.0 + square)),
            tangent: Matrix3::identity() * (b * (1.0 + square))
                + strain * strain.transpose() * (2.0 * b / 400.0),
        }
    }

    fn line_response(&self, _tissue: &Tissue, force: &Vector3<f64>) -> Option<LineResponse> {
        // v = e3 + C F, with a soft, anisotropic C.
        let compliance = Matrix3::new(8.0, 1.0, 0.0, 1.0, 5.0, 0.5, 0.0, 0.5, 3.0);
        let strain = Vector3::z() + compliance * force;
        Some(LineResponse {
            strain,
            energy: 0.5 * force.dot(&(compliance * force)),
            compliance,
        })
    }
}

/// A bent and twisted rod that is not in equilibrium.
fn bent(order: Order, elements: usize) -> Rod {
    let base = turn(Vector3::new(0.4, -0.2, 0.3));
    let mut rod = Rod::uniform(0.1, 1e-3, base, elements, order).unwrap();
    rod.set_intrinsic(|point| Vector3::new(3.0, -5.0, 2.0) * (1.0 + 10.0 * point.apex_distance));
    let last = (rod.nodes() - 1) as f64;
    let shape = |node: usize| {
        let x = node as f64 / last;
        base * turn(Vector3::new(0.9 * x, -0.5 * x * x, 0.7 * (2.0 * x).sin()))
    };
    rod.set_shape(&(0..rod.nodes()).map(shape).collect::<Vec<_>>(), &[])
        .unwrap();
    rod
}

fn loads() -> (
    Weight,
    Distributed,
    ApicalForce<impl Fn(f64) -> Vector3<f64>>,
) {
    let apical = ApicalForce(|_: f64| Vector3::new(1e-2, 2e-2, -3e-2));
    (WEIGHT, Distributed(Vector3::new(0.1, 0.0, 0.05)), apical)
}

#[test]
fn arc_lengths_of_nodes_are_the_places_of_their_frames() {
    for order in [Order::Two, Order::Four, Order::Eight] {
        let mut shoot = growing().order(order).elements(3).build().unwrap();
        // Divided elements are not equal, and the tissue of an element grows unevenly.
        MethodOfSteps::new(300.0).advance(&mut shoot, HOUR).unwrap();
        let (rod, lengths) = (shoot.rod(), shoot.rod().node_arc_lengths());
        assert!(lengths.len() == rod.nodes() && lengths[0] == 0.0);
        assert_abs_diff_eq!(lengths[rod.nodes() - 1], rod.length(), epsilon = 1e-15);
        for (s, frame) in lengths.into_iter().zip(rod.node_frames()) {
            let (_, at) = rod.at(s).unwrap();
            assert!(at.angle_to(&frame) < 1e-12, "{order:?} {s}");
        }
    }
}

#[test]
fn couples_and_tangent_are_the_derivatives_of_the_energy() {
    let laws: [&dyn Constitutive; 3] = [&YOUNG, &Timoshenko::circular(YOUNG), &Stiffening];
    for (law, order) in laws
        .iter()
        .flat_map(|law| Order::ALL.map(|order| (law, order)))
    {
        let rod = bent(order, 2);
        let force = InternalForce::of(&rod, &loads(), &Still::upright().environment(0.0));
        let energy = RodEnergy::new(law, &force);
        let frames = rod.node_frames();
        // The energy after rotations about component `a` of node `i` and `b` of node `j`, from `s`
        // and `t` in rad.
        let at = |[i, a]: [usize; 2], [j, b]: [usize; 2], s: f64, t: f64| {
            let mut turns = vec![Vector3::zeros(); frames.len()];
            turns[i][a] += s;
            turns[j][b] += t;
            let frames: Vec<_> = frames
                .iter()
                .zip(turns)
                .map(|(frame, by)| frame * turn(by))
                .collect();
            let mut rod = rod.clone();
            rod.set_shape(&frames, &[]).unwrap();
            energy.energy(&rod).unwrap()
        };
        let (value, couples) = energy.couples(&rod).unwrap();
        assert_eq!(
            (couples.len(), value),
            (rod.nodes(), energy.energy(&rod).unwrap())
        );
        let tangent = energy.tangent(&rod).unwrap().to_dense();
        let (scale, stiffest) = (
            couples.iter().map(Vector3::norm).fold(0.0, f64::max),
            tangent.amax(),
        );
        let unknowns: Vec<_> = (1..frames.len())
            .flat_map(|i| [0, 1, 2].map(|a| [i, a]))
            .collect();
        for (row, &p) in unknowns.iter().enumerate() {
            // Differences of fourth order: truncation 1e-12 and rounding 1e-13 of the energy over
            // the step.
            let slope = |h: f64| (at(p, p, h, 0.0) - at(p, p, -h, 0.0)) / (2.0 * h);
            let found = -(4.0 * slope(1e-3) - slope(2e-3)) / 3.0;
            assert_abs_diff_eq!(found, couples[p[0]][p[1]], epsilon = 1e-9 * scale);
            for (column, &q) in unknowns.iter().enumerate().skip(row) {
                let curvature = |h: f64| {
                    (at(p, q, h, h) - at(p, q, h, -h) - at(p, q, -h, h) + at(p, q, -h, -h))
                        / (4.0 * h * h)
                };
                let found = (4.0 * curvature(4e-3) - curvature(8e-3)) / 3.0;
                // Rounding of the energy, 1e-18 J, over the square of the step, and a truncation of
                // fourth order.
                assert_abs_diff_eq!(found, tangent[(row, column)], epsilon = 1e-7 * stiffest);
                assert_eq!(tangent[(row, column)], tangent[(column, row)]);
            }
        }
    }
}

#[test]
fn derivative_of_couples_is_the_tangent_and_half_the_turned_couple() {
    let rod = bent(Order::Four, 2);
    let force = InternalForce::of(&rod, &loads(), &Still::upright().environment(0.0));
    let (law, frames) = (YOUNG, rod.node_frames());
    let energy = RodEnergy::new(&law, &force);
    let (_, couples) = energy.couples(&rod).unwrap();
    let tangent = energy.tangent(&rod).unwrap().to_dense();
    for (column, (i, axis)) in (1..frames.len())
        .flat_map(|i| [0, 1, 2].map(|axis| (i, Vector3::ith(axis, 1.0))))
        .enumerate()
    {
        let after = |by: f64| {
            let (mut rod, mut frames) = (rod.clone(), frames.clone());
            frames[i] *= turn(axis * by);
            rod.set_shape(&frames, &[]).unwrap();
            energy.couples(&rod).unwrap().1
        };
        let (h, scale) = (1e-5, tangent.amax());
        for (j, (a, b)) in after(h).iter().zip(&after(-h)).enumerate().skip(1) {
            let own = if i == j {
                axis.cross(&couples[j]) * 0.5
            } else {
                Vector3::zeros()
            };
            let expected = -tangent.fixed_view::<3, 1>(3 * (j - 1), column).into_owned() - own;
            // The central difference has a relative error of 1e-10, and rounding of 1e-11.
            assert_abs_diff_eq!((a - b) / (2.0 * h), expected, epsilon = 1e-9 * scale);
        }
    }
}

#[test]
fn energy_of_an_arc_is_that_of_its_bending_and_of_its_load() {
    let (curvature, length) = (10.0, 0.1);
    let pull = Vector3::new(0.02, 0.0, -0.03);
    for order in [Order::Six, Order::Eight] {
        let mut rod = Rod::uniform(length, RADIUS, UnitQuaternion::identity(), 16, order).unwrap();
        let p = order.points();
        // The frames at all nodes of an arc follow from the intrinsic strain without load.
        rod.set_intrinsic(|_| Vector3::y() * curvature);
        let free = InternalForce::of(&rod, &(), &weightless());
        let _ = NewtonSolver::default()
            .equilibrate(&mut rod, &YOUNG, &free)
            .unwrap();
        rod.set_intrinsic(|_| Vector3::zeros());
        let frames = rod.node_frames();
        for e in 0..=16 {
            let exact = turn(Vector3::y() * (curvature * length * e as f64 / 16.0));
            assert_abs_diff_eq!(frames[e * p].angle_to(&exact), 0.0, epsilon = 1e-11);
        }
        let force = InternalForce::of(&rod, &ApicalForce(move |_: f64| pull), &weightless());
        let energy = RodEnergy::new(&YOUNG, &force).energy(&rod).unwrap();
        let angle: f64 = curvature * length;
        let tip = Vector3::new(1.0 - angle.cos(), 0.0, angle.sin()) / curvature;
        let exact = 0.5 * bending_stiffness() * curvature * curvature * length - pull.dot(&tip);
        // The quadrature has an error of order 12 and more in the length of an element, 1e-14 here.
        assert_abs_diff_eq!(energy, exact, epsilon = 1e-12 * exact.abs());
    }
}

#[test]
fn couple_of_the_base_balances_the_moment_of_the_load() {
    let base = turn(Vector3::new(0.3, 0.8, -0.2));
    let mut rod = Rod::uniform(0.1, RADIUS, base, 8, Order::Eight).unwrap();
    let pull = Vector3::new(1e-4, -2e-4, 5e-5);
    let law = Timoshenko::circular(YOUNG);
    let load = ApicalForce(move |_: f64| pull);
    let _ = solve_tight(&mut rod, &law, &load, &weightless()).unwrap();
    let force = InternalForce::of(&rod, &load, &weightless());
    let (_, couples) = RodEnergy::new(&law, &force).couples(&rod).unwrap();
    let moment = rod.tip().cross(&pull);
    // The solver balances couples to its tolerance of 1e-14 rad, times the stiffness of an element.
    assert_abs_diff_eq!(
        InNorm(base * couples[0]),
        InNorm(moment),
        epsilon = 1e-9 * moment.norm()
    );
    assert!(
        couples[1..]
            .iter()
            .all(|couple| couple.norm() < 1e-9 * moment.norm())
    );
    let strains = RodEnergy::new(&law, &force).line_strains(&rod).unwrap();
    assert_eq!(strains.len(), rod.points().len());
    for (i, strain) in strains.iter().enumerate() {
        assert_eq!(Some(*strain), rod.line_strain(i / 4, i % 4));
    }
}

#[test]
fn shape_is_returned_as_it_was_set() {
    for order in Order::ALL {
        let mut rod = bent(order, 3);
        let (before, frames) = (rod.clone(), rod.node_frames());
        rod.set_shape(&frames, &[]).unwrap();
        for (i, (a, b)) in rod.node_frames().iter().zip(&frames).enumerate() {
            // Rounding of a logarithm and an exponential.
            assert!(a.angle_to(b) < 1e-14, "node {i}");
        }
        assert_eq!(rod.frames()[0], before.frames()[0]);
        assert_abs_diff_eq!(InNorm(rod.tip()), InNorm(before.tip()), epsilon = 1e-15);
        // A stretch of one half shortens the centre line.
        rod.set_shape(&frames, &vec![Vector3::z() * 0.5; rod.points().len()])
            .unwrap();
        assert_abs_diff_eq!(
            InNorm(rod.tip()),
            InNorm(before.tip() * 0.5),
            epsilon = 1e-15
        );
    }
}

#[test]
fn invalid_shapes_are_refused_and_leave_the_rod_unchanged() {
    let rod = bent(Order::Four, 3);
    let (frames, none) = (rod.node_frames(), Vec::new());
    let strains = vec![Vector3::z(); 6];
    let refused = |frames: &[UnitQuaternion<f64>], strains: &[Vector3<f64>]| {
        let mut changed = rod.clone();
        let error = changed.set_shape(frames, strains).unwrap_err();
        assert!(changed == rod, "{error}");
        error
    };
    let with = |node: usize, frame: UnitQuaternion<f64>| {
        let mut frames = frames.clone();
        frames[node] = frame;
        frames
    };
    let count = |what: &'static str, found: usize, expected: usize| RodError::Count {
        what,
        found,
        expected,
    };
    assert_eq!(refused(&frames[1..], &none), count("frames at nodes", 6, 7));
    assert_eq!(
        refused(&frames, &strains[1..]),
        count("strains of the centre line", 5, 6)
    );
    for part in [f64::NAN, f64::INFINITY, 1.1, 0.0] {
        let broken = UnitQuaternion::new_unchecked(Quaternion::new(part, 0.0, 0.0, 0.0));
        for node in [0, 3, 6] {
            let error = refused(&with(node, broken), &none);
            assert!(
                matches!(error, RodError::Value { what: "norm of frame", index, .. } if index == node),
                "{error}"
            );
        }
    }
    let error = refused(&with(0, frames[0] * turn(Vector3::x() * 1e-8)), &none);
    assert!(
        matches!(
            error,
            RodError::Value {
                what: "rotation of the base by frame",
                ..
            }
        ),
        "{error}"
    );
    let error = refused(&with(4, frames[2] * turn(Vector3::x() * 3.12)), &none);
    assert!(
        matches!(error, RodError::Folded { element: 1, rotation } if rotation > 3.1),
        "{error}"
    );
    for (z, what) in [
        (f64::NAN, "square of strain of the centre line"),
        (0.0, "stretch of point"),
        (-1.0, "stretch of point"),
    ] {
        let mut strains = strains.clone();
        strains[2].z = z;
        let error = refused(&frames, &strains);
        assert!(
            matches!(error, RodError::Value { what: found, index: 2, .. } if found == what),
            "{error}"
        );
    }
}

#[test]
fn energies_refuse_another_rod_and_numbers_that_are_not_finite() {
    let (rod, other) = (bent(Order::Four, 3), bent(Order::Four, 4));
    let now = weightless();
    let force = InternalForce::of(&other, &loads(), &now);
    let law = YOUNG;
    let energy = RodEnergy::new(&law, &force);
    let errors = [
        energy.energy(&rod).unwrap_err(),
        energy.couples(&rod).unwrap_err(),
        energy.tangent(&rod).unwrap_err(),
        energy.line_strains(&rod).unwrap_err(),
    ];
    for error in errors {
        assert!(
            error
                .to_string()
                .contains("points at which the force is known"),
            "{error}"
        );
    }
    let force = InternalForce::of(&rod, &ApicalForce(|_: f64| Vector3::x() * f64::NAN), &now);
    let energy = RodEnergy::new(&law, &force);
    assert!(matches!(
        energy.couples(&rod),
        Err(EquilibriumError::NotFinite {
            what: "energy of the elastic law"
        })
    ));
    assert!(matches!(
        energy.tangent(&rod),
        Err(EquilibriumError::NotFinite { what: "tangent" })
    ));
    // A force of 1 N shortens the soft centre line by more than its length.
    let force = InternalForce::of(&rod, &ApicalForce(|_: f64| Vector3::z() * -1.0), &now);
    assert!(matches!(
        RodEnergy::new(&Stiffening, &force).line_strains(&rod),
        Err(EquilibriumError::Crushed { .. })
    ));
}

#[test]
fn dynamic_relaxation_finds_the_elastica_of_a_cantilever() {
    // The tip of a cantilever along e1 under P = 2 E I/ℓ² along −e3 (Bisshopp and Drucker 1945).
    let [along, down, _] = bisshopp_drucker(2.0);
    let base = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
    let mut rod = Rod::uniform(0.1, RADIUS, base, 8, Order::Eight).unwrap();
    let force = bending_stiffness() / 0.01;
    let load = ApicalForce(move |_: f64| Vector3::z() * (-2.0 * force));
    let mut solver = DynamicRelaxation {
        tolerance: 1e-10,
        max_steps: 100_000,
    };
    let found = solver
        .solve(&mut rod, &YOUNG, &load, &weightless())
        .unwrap();
    let exact = Vector3::new(along, 0.0, -down) * 0.1;
    // The error of the tip is at most that of the frames times the length.
    assert_abs_diff_eq!(InNorm(rod.tip()), InNorm(exact), epsilon = 1e-11);
    assert!(found.error <= 1e-10 && found.evaluations < 3000, "{found}");
    // With too few steps the rod does not change.
    let before = rod.clone();
    let mut short = DynamicRelaxation {
        max_steps: 10,
        ..solver
    };
    let error = short
        .solve(&mut rod, &YOUNG, &(), &weightless())
        .unwrap_err();
    assert!(
        matches!(
            error,
            EquilibriumError::NoConvergence { iterations: 10, .. }
        ) && rod == before,
        "{error}"
    );
}

#[test]
fn shoot_with_dynamic_relaxation_moves_as_with_newtons_method() {
    let shoot = || righting().elements(2).into_dyn().build().unwrap();
    let (mut own, mut exact) = (shoot(), shoot());
    let solver = DynamicRelaxation {
        tolerance: 1e-9,
        max_steps: 100_000,
    };
    MethodOfSteps::with_solver(720.0, solver)
        .advance(&mut own, 2.0 * HOUR)
        .unwrap();
    MethodOfSteps::new(720.0)
        .advance(&mut exact, 2.0 * HOUR)
        .unwrap();
    // Each solver has an error of its tolerance, at most 1e-8 rad times the length.
    assert_abs_diff_eq!(InNorm(own.tip()), InNorm(exact.tip()), epsilon = 1e-9);
}

#[test]
fn continuation_passes_the_folds_at_which_a_leaning_column_snaps() {
    let (weight, section) = (4.0, Section::ellipse(0.5e-3, 1e-3));
    let law = YOUNG;
    let unit = law.stiffness(section).y / 0.01;
    let rod = Rod::straight(
        &Rod::equal_nodes(0.1, 8),
        |_| section,
        UnitQuaternion::identity(),
        Order::Eight,
    )
    .unwrap();
    let load = |force: f64| ApicalForce(move |_: f64| Vector3::new(force, 0.0, -weight) * unit);
    let family = Family {
        material: &law,
        load,
        environment: weightless(),
        scale: 10.0,
    };
    let mut start = rod.clone();
    let _ = solve_tight(&mut start, &law, &load(-2.0), &weightless()).unwrap();
    let mut branch: Vec<Point> = vec![family.begin(&start, -2.0).unwrap()];
    let mut folds = Vec::new();
    while branch[branch.len() - 1].parameter < 2.0 {
        let last = &branch[branch.len() - 1];
        let next = family.advance(last, 0.03).unwrap();
        if next.slope() * last.slope() < 0.0 {
            folds.push(family.fold(last, 0.03).unwrap());
        }
        branch.push(next);
    }
    let exact = elastica::fold_force(weight);
    assert_eq!(folds.len(), 2);
    for (fold, sign) in folds.iter().zip([1.0, -1.0]) {
        // The mesh has an error of 5e-11, and the elliptic integrals of 1e-12.
        assert_abs_diff_eq!(fold.parameter, sign * exact, epsilon = 2e-10);
    }
    // Between the folds the shapes are unstable, with one negative direction.
    let between = |point: &Point| point.slope() < 0.0;
    assert!(
        branch
            .iter()
            .all(|point| point.negative == usize::from(between(point)))
    );
    // The solver of the crate finds the stable shapes of the branch, and snaps behind the first
    // fold.
    for (force, snaps) in [(exact - 0.01, false), (exact + 0.01, true)] {
        let near = branch
            .iter()
            .filter(|point| point.slope() > 0.0 && point.parameter < exact);
        let near = near
            .min_by(|a, b| {
                (a.parameter - force)
                    .abs()
                    .total_cmp(&(b.parameter - force).abs())
            })
            .unwrap();
        assert!(near.rod.tip().x < 0.0);
        let mut rod = near.rod.clone();
        let found = solve_tight(&mut rod, &law, &load(force), &weightless()).unwrap();
        assert_eq!(
            (found.jump.is_some(), rod.tip().x > 0.0),
            (snaps, snaps),
            "{force}"
        );
        let closest = branch
            .iter()
            .filter(|point| (point.rod.tip().x > 0.0) == snaps && point.negative == 0);
        let closest = closest
            .min_by(|a, b| {
                (a.parameter - force)
                    .abs()
                    .total_cmp(&(b.parameter - force).abs())
            })
            .unwrap();
        let point = family.begin(&closest.rod, force).unwrap();
        assert_abs_diff_eq!(InNorm(point.rod.tip()), InNorm(rod.tip()), epsilon = 1e-11);
    }
}

/// A solver that exchanges the rod for another one.
#[derive(Clone, Copy)]
enum Careless {
    MoreElements,
    OtherBase,
    Mature,
}

impl EquilibriumSolver for Careless {
    fn equilibrate(
        &mut self,
        rod: &mut Rod,
        _material: &impl Constitutive,
        _force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        match self {
            Self::MoreElements => {
                *rod = Rod::uniform(0.05, RADIUS, rod.frames()[0], 9, rod.order())?
            }
            Self::OtherBase => rod.set_base(UnitQuaternion::identity())?,
            Self::Mature => rod.set_mature(0.0),
        }
        Ok(Equilibrium::default())
    }
}

#[test]
fn solvers_that_exchange_the_rod_of_a_shoot_are_refused() {
    let mut shoot = righting().elements(2).into_dyn().build().unwrap();
    MethodOfSteps::new(360.0).advance(&mut shoot, HOUR).unwrap();
    for careless in [
        Careless::MoreElements,
        Careless::OtherBase,
        Careless::Mature,
    ] {
        let before = shoot.state().clone();
        let error = MethodOfSteps::with_solver(360.0, careless)
            .advance(&mut shoot, 2.0 * HOUR)
            .unwrap_err();
        let changed = matches!(
            &error,
            IntegrationError::Equilibrium {
                error: EquilibriumError::Changed { .. },
                ..
            }
        );
        assert!(changed, "{error}");
        assert!(*shoot.state() == before);
    }
}
