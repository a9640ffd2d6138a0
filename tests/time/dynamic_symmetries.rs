//! Symmetries of the growing, steering, loaded shoot: rotating the scene rotates the solution,
//! reflecting it reflects the solution, and a change of the units of length, time and force leaves
//! it unchanged.

use std::f64::consts::PI;

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{DAY, HOUR, MINUTE, remembering};
use approx::assert_abs_diff_eq;
use morphorod::equilibrium::NewtonSolver;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Distributed};
use morphorod::tropism::{Handedness, Memory, Oscillator};
use morphorod::{ShootParameters, Still};
use nalgebra::{Matrix3, Rotation3, Unit, UnitQuaternion, Vector3};
use proptest::prelude::*;

/// Parameters of a run of two hours with a shoot 1 mm longer than its growth zone, in given units.
#[derive(Debug, Clone, Copy)]
struct Case {
    gravity: Vector3<f64>,
    base: UnitQuaternion<f64>,
    pull: Vector3<f64>,
    wind: Vector3<f64>,
    phase: f64,
    handedness: Handedness,
    /// Units of length, time and force.
    units: [f64; 3],
}

/// Positions of the ends of the elements, and the frames there.
struct Answer {
    positions: Vec<Vector3<f64>>,
    frames: Vec<Matrix3<f64>>,
}

impl Case {
    fn run(&self) -> Answer {
        let [m, s, n] = self.units;
        let memory = Memory {
            time: 12.0 * MINUTE * s,
            delay: 11.0 * MINUTE * s,
        };
        let (pull, period) = (self.pull * n, 77.0 * MINUTE * s);
        let youngs_modulus = 1e7 * n / (m * m);
        let parameters = ShootParameters {
            length: 0.066 * m,
            zone_length: 0.065 * m,
            growth_time: 20.0 * HOUR * s,
            youngs_modulus,
            mature_modulus: 200.0 * youngs_modulus,
            poissons_ratio: 0.4,
            lignification_time: 6.0 * DAY * s,
            avalanche_time: 2.0 * MINUTE * s,
            oscillator_period: 24.0 * MINUTE * s,
            // The solution depends only on the weight per volume, ρ g.
            density: 1000.0 * n / m.powi(3),
            ..remembering(memory, memory)
        };
        let (oscillator, gravitropism, proprioception) = parameters.tropism();
        let oscillator = Oscillator {
            phase: self.phase,
            handedness: self.handedness,
            ..oscillator
        };
        let builder = parameters
            .shoot()
            .section(move |at| 5e-4 * m * (1.0 - 3.0 * at / m))
            .elements(4);
        let mut shoot = builder
            .tropism((oscillator, gravitropism, proprioception))
            .load((
                parameters.weight(),
                Distributed(self.wind * (n / m)),
                ApicalForce(move |t: f64| pull * (2.0 * PI * t / period).cos()),
            ))
            .scene(Still {
                gravity: self.gravity,
                base: self.base,
            })
            .into_dyn()
            .build()
            .unwrap();
        let _ = MethodOfSteps::with_solver(90.0 * s, NewtonSolver::default())
            .advance(&mut shoot, 2.0 * HOUR * s)
            .unwrap();
        Answer {
            positions: shoot
                .rod()
                .centre_line()
                .iter()
                .map(|(_, x)| x / m)
                .collect(),
            frames: shoot
                .rod()
                .frames()
                .iter()
                .map(|frame| frame.to_rotation_matrix().into_inner())
                .collect(),
        }
    }
}

/// Tolerance of angles, rad. The algebraic error, at most Newton's tolerance of 1e-11 rad, and
/// rounding differ between the two runs in each of ninety steps. In two hours the shoot magnifies
/// these errors by a small factor only. At 180 s the ratio of step to avalanche time is near the
/// value at which the integrator begins to halve steps. Only one of two runs that differ by
/// rounding may then halve a step, and the runs differ by the error of the step, 1e-8.
const ANGLE: f64 = 1e-10;

fn assert_same(expected: impl Iterator<Item = (Vector3<f64>, Matrix3<f64>)>, found: &Answer) {
    let mut count = 0;
    for ((x, frame), (y, other)) in expected.zip(found.positions.iter().zip(&found.frames)) {
        assert_abs_diff_eq!(InNorm(x), InNorm(*y), epsilon = ANGLE * 0.066);
        assert_abs_diff_eq!(InNorm(frame), InNorm(*other), epsilon = 2.0 * ANGLE);
        count += 1;
    }
    assert_eq!(count, found.positions.len());
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-size..size).prop_map(Vector3::from)
}

fn turn() -> impl Strategy<Value = UnitQuaternion<f64>> {
    vector(3.0).prop_map(UnitQuaternion::from_scaled_axis)
}

prop_compose! {
    fn cases()(base in turn(), pull in vector(5e-6), wind in vector(2e-5), phase in -3.0..3.0) -> Case {
        let gravity = Vector3::new(0.0, 0.0, -9.81);
        Case { gravity, base, pull, wind, phase, handedness: Handedness::Counterclockwise, units: [1.0; 3] }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn rotating_the_scene_about_any_axis_rotates_the_solution(case in cases(), turn in turn()) {
        let turned = Case {
            gravity: turn * case.gravity,
            base: turn * case.base,
            pull: turn * case.pull,
            wind: turn * case.wind,
            ..case
        };
        let (one, other) = (case.run(), turned.run());
        let matrix = turn.to_rotation_matrix().into_inner();
        assert_same(one.positions.iter().zip(&one.frames).map(|(x, frame)| (turn * x, matrix * frame)), &other);
    }

    /// The reflection Q flips d1 of the base, or d2. Directors dj become Q dj, except that the
    /// flipped one becomes −Q dj, so that the frame stays right-handed. The axial vector u becomes
    /// −Q u: along the new directors, the component about the flipped one stays and the other two
    /// change sign. An oscillator (cos φ, sin φ) becomes (cos φ, −sin φ) or (−cos φ, sin φ): the
    /// opposite handedness, and for d2 an additional phase of π.
    #[test]
    fn reflecting_the_scene_and_the_oscillator_reflects_the_solution(
        case in cases(), normal in vector(1.0), second in any::<bool>(),
    ) {
        prop_assume!(normal.norm() > 0.1);
        let normal = Unit::new_normalize(normal);
        let mirror = Matrix3::identity() - 2.0 * normal.as_ref() * normal.transpose();
        let flip = if second { Vector3::new(1.0, -1.0, 1.0) } else { Vector3::new(-1.0, 1.0, 1.0) };
        let mirrored = |frame: &Matrix3<f64>| mirror * frame * Matrix3::from_diagonal(&flip);
        let base = mirrored(case.base.to_rotation_matrix().matrix());
        let image = Case {
            gravity: mirror * case.gravity,
            base: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(base)),
            pull: mirror * case.pull,
            wind: mirror * case.wind,
            phase: if second { case.phase + PI } else { case.phase },
            handedness: Handedness::Clockwise,
            ..case
        };
        let (one, other) = (case.run(), image.run());
        assert_same(one.positions.iter().zip(&one.frames).map(|(x, frame)| (mirror * x, mirrored(frame))), &other);
    }

    #[test]
    fn changed_units_of_length_time_and_force_change_nothing(
        case in cases(), powers in prop::array::uniform3(-3.0..3.0),
    ) {
        let rescaled = Case { units: powers.map(|p: f64| 10.0_f64.powf(p)), ..case };
        let (one, other) = (case.run(), rescaled.run());
        assert_same(one.positions.iter().copied().zip(one.frames.iter().copied()), &other);
    }
}

#[test]
fn extreme_units_of_length_change_nothing() {
    // In large units of length, strains have values of about 1e4, while the components of statolith
    // normals are below 1.
    let case = Case {
        gravity: Vector3::new(0.0, 0.0, -9.81),
        base: UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
            0.7276, -0.2724, 0.6296, 0.0,
        )),
        pull: Vector3::zeros(),
        wind: Vector3::zeros(),
        phase: -2.3675,
        handedness: Handedness::Counterclockwise,
        units: [1.0; 3],
    };
    let one = case.run();
    for power in [-4.0, -2.8536, 2.0, 4.0] {
        let other = Case {
            units: [10.0_f64.powf(power), 1.0, 1.0],
            ..case
        }
        .run();
        assert_same(
            one.positions
                .iter()
                .copied()
                .zip(one.frames.iter().copied()),
            &other,
        );
    }
}

#[test]
fn handedness_and_phase_of_the_oscillator_change_the_solution() {
    // The test of reflections is meaningful only if these parameters change the solution.
    let case = Case {
        gravity: Vector3::new(0.0, 0.0, -9.81),
        base: UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.2, 0.1)),
        pull: Vector3::new(1e-6, 0.0, 2e-6),
        wind: Vector3::new(0.0, 1e-5, 0.0),
        phase: 0.4,
        handedness: Handedness::Counterclockwise,
        units: [1.0; 3],
    };
    let tip = |case: Case| *case.run().positions.last().unwrap();
    let (plain, reversed) = (
        tip(case),
        tip(Case {
            handedness: Handedness::Clockwise,
            ..case
        }),
    );
    let shifted = tip(Case {
        phase: case.phase + PI,
        ..case
    });
    // Distances are bounded from below. The `_ne` macros of approx would require one component to
    // differ by as much.
    assert!((plain - reversed).norm() > 1e-4 && (plain - shifted).norm() > 1e-4);
}
