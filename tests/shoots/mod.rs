//! Shoots that several tests share, with the parameters of Agostinelli, DeSimone and Noselli (2021), *Nutations in Plant
//! Shoots*, Front. Plant Sci. 12:608005, doi 10.3389/fpls.2021.608005.
#![allow(dead_code)] // Every test uses a part of it.

use std::f64::consts::FRAC_PI_2;

use morphorod::constitutive::{Lignifying, LinearElastic};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps, Statistics};
use morphorod::load::{ApicalForce, Distributed, Weight};
use morphorod::tropism::{
    Gravitropism, Memory, Oscillator, Perception, Proprioception, Remembered, Response, SettledStatoliths, Statoliths,
};
use morphorod::{Laws, Model, Scene, Shoot, ShootBuilder, Still};
use nalgebra::{UnitQuaternion, Vector3};

pub const MINUTE: f64 = 60.0;
pub const HOUR: f64 = 3600.0;
pub const DAY: f64 = 24.0 * HOUR;

/// Radius r, m.
pub const RADIUS: f64 = 5e-4;
/// Gravitropic sensitivity β.
pub const BETA: f64 = 0.8;
/// Proprioceptive sensitivity η.
pub const ETA: f64 = 20.0;
/// Memory and reaction times τm = τr.
pub const MEMORY: Memory = Memory { time: 12.0 * MINUTE, delay: 12.0 * MINUTE };
/// Young tissue: E = 10 MPa, ν = 0.5.
pub const YOUNG: LinearElastic = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
/// Avalanche time of the statoliths, 2 min.
pub const STATOLITHS: Statoliths = Statoliths { avalanche_time: 2.0 * MINUTE };
/// The shoot's own weight, 1000 kg/m³.
pub const WEIGHT: Weight = Weight { density: 1000.0 };

/// Response to gravity and to the own bend.
pub type Steering<S = SettledStatoliths> = (Remembered<Gravitropism<S>>, Remembered<Proprioception>);

/// The default steering with the given sense of gravity.
pub fn steering<S: Perception<Signal = [f64; 2]>>(statoliths: S) -> Steering<S> {
    (
        Gravitropism { sensitivity: BETA, perception: statoliths }.remembered(MEMORY),
        Proprioception { sensitivity: ETA }.remembered(MEMORY),
    )
}

/// The laws of the reduced model.
pub type Reduced = Laws<LinearElastic, Ongoing<UniformGrowth>, Steering, Weight>;

/// The laws of the growing shoot.
pub type Growing = Laws<
    Lignifying,
    UniformGrowth,
    (Oscillator, Remembered<Gravitropism<Statoliths>>, Remembered<Proprioception>),
    Imperfection,
>;

/// The reduced model: constant length (m), growth zone 7 cm, growth time in s, weight, h = −ĝ.
pub fn reduced(length: f64, growth_time: f64) -> ShootBuilder<Reduced> {
    Shoot::builder(YOUNG)
        .length(length)
        .radius(RADIUS)
        .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: growth_time }))
        .tropism(steering(SettledStatoliths))
        .load(WEIGHT)
}

/// The shoot that rights itself: reduced model, ℓ = 5 cm, base tangent along e1 (d1 = −e3, d2 = e2), τg = 20 h.
pub fn righting() -> ShootBuilder<Reduced> {
    reduced(0.05, 20.0 * HOUR).scene(Still::tilted(FRAC_PI_2))
}

/// The weak extra loads of the growing shoot's reference: they choose the plane in which an upright shoot starts to bend.
pub type Imperfection = (Weight, Distributed, ApicalForce<fn(f64) -> Vector3<f64>>);

/// The growing shoot ("video 2"): ℓ0 = 6.8 cm, ℓg = 7 cm, α = 0.2, τe = 24 min, τg = 40 h, lignification over 6 days from
/// 10 MPa to 2 GPa, statoliths; with a lateral load of 1e-6 N/m along −e2 and an apical load of 1e-7 N along −e1 and −e2.
pub fn growing() -> ShootBuilder<Growing> {
    let (gravitropism, proprioception) = steering(STATOLITHS);
    Shoot::builder(Lignifying { young: YOUNG, mature_modulus: 200.0 * YOUNG.youngs_modulus, time: 6.0 * DAY })
        .length(0.068)
        .radius(RADIUS)
        .growth(UniformGrowth { zone_length: 0.07, time: 40.0 * HOUR })
        .tropism((Oscillator::new(0.2, 24.0 * MINUTE), gravitropism, proprioception))
        .load((
            WEIGHT,
            Distributed(Vector3::new(0.0, -1e-6, 0.0)),
            ApicalForce((|_| Vector3::new(-1e-7, -1e-7, 0.0)) as fn(f64) -> Vector3<f64>),
        ))
}

/// Carries a shoot to each of the times (s) in turn with the method of steps; the tips there and what it cost.
pub fn tips(shoot: &mut Shoot<impl Model>, step: f64, times: &[f64]) -> (Vec<Vector3<f64>>, Statistics) {
    let mut run = MethodOfSteps::new(step);
    let mut total = Statistics::default();
    let tips = times.iter().map(|t| {
        total += run.advance(shoot, *t).expect("this scene has a solution at all times");
        shoot.tip()
    });
    (tips.collect(), total)
}

/// The observed order of errors from steps that halve: the mean slope over all halvings.
pub fn order(errors: &[f64]) -> f64 {
    (errors[0] / errors[errors.len() - 1]).log2() / (errors.len() - 1) as f64
}

/// Fails unless every number of the shape is finite and every frame is orthonormal to 1e-12.
pub fn assert_sound(shoot: &Shoot<impl Model>) {
    let rod = shoot.rod();
    for frame in rod.frames() {
        let matrix = frame.to_rotation_matrix().into_inner();
        let off = (matrix.transpose() * matrix - nalgebra::Matrix3::identity()).norm();
        // A product of rotations loses an ulp at a time; renormalised, a frame stays within a few of them.
        assert!(off < 1e-12, "frame off orthonormal by {off:e}");
    }
    for point in rod.points() {
        assert!(point.intrinsic.iter().all(|u| u.is_finite()), "{point:?}");
        assert!(point.jacobian > 0.0 && point.jacobian.is_finite(), "{point:?}");
    }
    assert!(shoot.tip().iter().all(|x| x.is_finite()));
    assert!(
        shoot.tip().norm() <= rod.length() * (1.0 + 1e-12),
        "an inextensible rod cannot reach further than its length"
    );
    for i in 0..rod.points().len() {
        if let Some(variables) = shoot.state().variables(i) {
            assert!(variables.iter().all(|y| y.is_finite()), "variables of point {i}: {variables:?}");
        }
    }
}

/// Gravity that turns about e2, as on a clinostat, at a rate in rad/s.
pub struct Clinostat(pub f64);

impl Scene for Clinostat {
    fn gravity(&self, t: f64) -> Vector3<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), self.0 * t) * Vector3::new(0.0, 0.0, -9.81)
    }
    fn base(&self, _t: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::identity()
    }
}
