//! Statoliths in cells that are tilted, turned and left without weight: the pile's normal against closed forms.

use crate::fixtures::shoots;
use std::f64::consts::TAU;

use crate::fixtures::shoots::{Clinostat, HOUR, MEMORY, RADIUS, YOUNG};
use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::Unloaded;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps, Statistics};
use morphorod::tropism::{Gravitropism, Remembered, Response, Statoliths};
use morphorod::{Laws, Scene, Shoot};
use nalgebra::{UnitQuaternion, Vector3};

const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

type CellLaws<S> = Laws<LinearElastic, Ongoing<UniformGrowth>, Remembered<Gravitropism<Statoliths>>, (), S>;

/// A shoot that feels gravity but does not answer, in a scene.
struct Cell<S> {
    run: MethodOfSteps<Unloaded>,
    shoot: Shoot<CellLaws<S>>,
    statistics: Statistics,
}

impl<S: Scene> Cell<S> {
    fn new(avalanche_time: f64, step: f64, scene: S) -> Self {
        let shoot = Shoot::builder(YOUNG)
            .length(0.05)
            .radius(RADIUS)
            .elements(1)
            .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 20.0 * HOUR }))
            .tropism(Gravitropism { sensitivity: 0.0, perception: Statoliths { avalanche_time } }.remembered(MEMORY))
            .scene(scene)
            .build()
            .unwrap();
        Self { run: MethodOfSteps::with_solver(step, Unloaded), shoot, statistics: Statistics::default() }
    }

    /// The normal of the pile at time `t`, components along the directors.
    fn normal(&mut self, t: f64) -> Vector3<f64> {
        self.statistics += self.run.advance(&mut self.shoot, t).unwrap();
        Vector3::from_column_slice(&self.shoot.state().variables(0).unwrap()[..3])
    }

    /// The angle from the upward vertical to the normal, and by how much the normal's length is off 1.
    fn lean(&mut self, t: f64) -> (f64, f64) {
        let h = self.normal(t);
        let up = -self.shoot.rod().frames()[0].inverse_transform_vector(&self.shoot.model().scene.gravity(t));
        (h.cross(&up).norm().atan2(h.dot(&up)), (h.norm() - 1.0).abs())
    }
}

/// A pot that stands upright and is tilted by an angle just after 100 s.
struct Tilted(f64);

impl Scene for Tilted {
    fn gravity(&self, _t: f64) -> Vector3<f64> {
        DOWN
    }
    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), if t > 100.0 { self.0 } else { 0.0 })
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        if t < 100.0 { 100.0 } else { f64::INFINITY }
    }
}

#[test]
fn a_pile_in_a_tilted_cell_avalanches_as_in_the_closed_form() {
    // Equation (6) of doi 10.3389/fpls.2021.608005 turns h towards the vertical at φ̇ = −sin φ/τa:
    // tan(φ/2) = tan(φ0/2) exp(−t/τa).
    for degrees in [10.0_f64, 90.0, 170.0, 179.9] {
        for avalanche in [1e-4, 1e-2, 1.0, 5.0, 20.0, 60.0, 120.0, 1e3, 1e6] {
            let mut cell = Cell::new(avalanche, 90.0, Tilted(degrees.to_radians()));
            assert!(cell.lean(99.0).0 < 1e-15, "it is settled until the jump");
            let (mut angle, mut size) = (0.0_f64, 0.0_f64);
            for t in (1..=60).map(|i| 30.0 * f64::from(i)) {
                let exact = 2.0 * ((0.5 * degrees.to_radians()).tan() * (-t / avalanche).exp()).atan();
                let (lean, off) = cell.lean(100.0 + t);
                (angle, size) = (angle.max((lean - exact).abs()), size.max(off));
            }
            // Four collocation points in a step of at most the avalanche time: sixth order, z⁶/(6! 2⁶ …) of a radian.
            // A slide that is over within a step is halved until it is resolved to a part in ten of a step, to 1e-4.
            let bound = if avalanche >= 100.0 { 1e-7 } else { 1e-4 };
            assert!(angle < bound && size < 2.0 * bound, "{degrees}°, τa = {avalanche} s: {angle:e} rad, |h| {size:e}");
        }
    }
}

#[test]
fn a_pile_that_is_turned_upside_down_stays_a_unit_vector() {
    // Upside down is an equilibrium that rounding may leave in any direction; whatever it does, h is a direction.
    for avalanche in [1e-4, 1e-2, 1.0, 5.0, 20.0, 60.0, 120.0, 1e3] {
        let mut cell = Cell::new(avalanche, 90.0, Tilted(std::f64::consts::PI));
        let worst = (1..=60).map(|i| cell.lean(100.0 + 30.0 * f64::from(i)).1).fold(0.0, f64::max);
        assert!(worst < 2e-4, "τa = {avalanche} s: |h| is off by {worst:e}");
    }
}

#[test]
fn on_a_slow_clinostat_the_pile_lags_by_a_constant_angle() {
    // In the turning frame φ̇ = Ω − sin φ/τa comes to rest at sin φ = Ωτa.
    let rate = TAU / HOUR;
    for avalanche in [1e-4, 1.0, 20.0, 120.0, 500.0] {
        let exact = (rate * avalanche).asin();
        let errors = [90.0, 45.0, 22.5].map(|step| {
            let (lag, off) = Cell::new(avalanche, step, Clinostat(rate)).lean(8.0 * HOUR);
            assert!(off < 1e-6, "τa = {avalanche} s: |h| is off by {off:e}");
            (lag - exact).abs()
        });
        // Cubics through the last four verticals, Ω dt = 0.157, 0.079 and 0.039 rad apart, are off by up to
        // 0.04 (Ω dt)⁴ within the step, most of it in length: sin φ (1 + m) = Ωτa.
        for (error, dt) in errors.into_iter().zip([90.0, 45.0, 22.5]) {
            let bound = 0.04 * (rate * dt).powi(4) * (1.0 + exact.tan());
            assert!(error < bound, "τa = {avalanche} s, step {dt} s: {error:e} > {bound:e}");
        }
    }
}

#[test]
fn on_a_fast_clinostat_the_pile_slips() {
    // Ωτa > 1: no rest. The reference integrates φ̇ = Ω − sin φ/τa in 1e5 steps of the classical Runge–Kutta method.
    let (rate, avalanche, end) = (TAU / 600.0, 200.0, 2.0 * HOUR);
    let (mut phi, h) = (0.0_f64, end / 1e5);
    let slope = |phi: f64| rate - phi.sin() / avalanche;
    for _ in 0..100_000 {
        let k1 = slope(phi);
        let k2 = slope(phi + 0.5 * h * k1);
        let k3 = slope(phi + 0.5 * h * k2);
        phi += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + slope(phi + h * k3));
    }
    assert!(phi > TAU, "it does not slip");
    let errors = [60.0, 30.0, 15.0, 7.5].map(|step| {
        let mut cell = Cell::new(avalanche, step, Clinostat(rate));
        let h = cell.normal(end);
        // Positive when the pile is behind.
        let up = -cell.shoot.model().scene.gravity(end).normalize();
        let lag = h.cross(&up).y.atan2(h.dot(&up));
        ((lag - phi + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU).abs()
    });
    assert!(shoots::order(&errors) >= 3.5, "order {}: {errors:?}", shoots::order(&errors));
    assert!(errors[3] < 1e-4, "{errors:?}");
}

/// Gravity along −e1 that ceases just after 200 s.
struct Orbit;

impl Scene for Orbit {
    fn gravity(&self, t: f64) -> Vector3<f64> {
        if t > 200.0 { Vector3::zeros() } else { UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 1e-3 * t) * DOWN }
    }
    fn base(&self, _t: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::identity()
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        if t < 200.0 { 200.0 } else { f64::INFINITY }
    }
}

#[test]
fn without_weight_the_pile_stands_still() {
    for avalanche in [1e-3, 120.0, 1e5] {
        let mut cell = Cell::new(avalanche, 90.0, Orbit);
        let before = cell.normal(200.0);
        for t in [201.0, 1000.0, 4.0 * HOUR] {
            // ĝ does not exist and ḣ = 0. What decays in a step and what comes back are sums of their own: some tens of
            // roundings in each of a hundred and sixty steps.
            let moved = (cell.normal(t) - before).norm();
            assert!(moved < 160.0 * 64.0 * f64::EPSILON, "τa = {avalanche} s: {moved:e} after {t} s");
        }
    }
}
