//! Statoliths in cells that are tilted, rotated or weightless. The normal of the pile is compared
//! with closed forms.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots;
use approx::abs_diff_eq;
use std::f64::consts::TAU;

use crate::fixtures::shoots::{Clinostat, HOUR, MEMORY, reduced};
use morphorod::equilibrium::Unloaded;
use morphorod::integrator::{Integrator, MethodOfSteps, Statistics};
use morphorod::tropism::{Gravitropism, Perception, Response, SettledStatoliths, Statoliths};
use morphorod::{DynLaws, Model, Scene, Shoot};
use nalgebra::{UnitQuaternion, Vector3};

const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// A shoot in a given scene, with gravitropism of zero sensitivity.
struct Cell {
    run: MethodOfSteps<Unloaded>,
    shoot: Shoot<DynLaws>,
    statistics: Statistics,
}

impl Cell {
    fn new(avalanche_time: f64, step: f64, scene: impl Scene + Send + Sync + 'static) -> Self {
        let shoot = reduced(0.05, 20.0 * HOUR)
            .elements(1)
            .tropism(
                Gravitropism {
                    sensitivity: 0.0,
                    perception: Statoliths { avalanche_time },
                }
                .remembered(MEMORY),
            )
            .load(())
            .scene(scene)
            .into_dyn()
            .build()
            .unwrap();
        Self {
            run: MethodOfSteps::with_solver(step, Unloaded),
            shoot,
            statistics: Statistics::default(),
        }
    }

    /// Normal of the pile at time `t` (s), as components along the directors.
    fn normal(&mut self, t: f64) -> Vector3<f64> {
        self.statistics += self.run.advance(&mut self.shoot, t).unwrap();
        Vector3::from_column_slice(&self.shoot.state().variables(0).unwrap()[..3])
    }

    /// Angle from the upward vertical to the normal (rad), and the deviation of the length of the
    /// normal from 1, at time `t` (s).
    fn lean(&mut self, t: f64) -> (f64, f64) {
        let h = self.normal(t);
        let up = -self.shoot.rod().frames()[0]
            .inverse_transform_vector(&self.shoot.model().scene().gravity(t));
        (
            h.cross(&up).norm().atan2(h.dot(&up)),
            (h.norm() - 1.0).abs(),
        )
    }
}

/// A pot that is upright until 100 s and is then tilted by an angle (rad).
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
fn pile_in_a_tilted_cell_avalanches_by_the_closed_form() {
    // Equation (6) of doi 10.3389/fpls.2021.608005 rotates h towards the vertical at φ̇ = −sin
    // φ/τa. Its solution is tan(φ/2) = tan(φ0/2) exp(−t/τa).
    for degrees in [10.0_f64, 90.0, 170.0, 179.9] {
        for avalanche in [1e-4, 1e-2, 1.0, 5.0, 20.0, 60.0, 120.0, 1e3, 1e6] {
            let mut cell = Cell::new(avalanche, 90.0, Tilted(degrees.to_radians()));
            assert!(
                cell.lean(99.0).0 < 1e-15,
                "the pile is tilted before the cell is"
            );
            let (mut angle, mut size) = (0.0_f64, 0.0_f64);
            for t in (1..=60).map(|i| 30.0 * f64::from(i)) {
                let exact =
                    2.0 * ((0.5 * degrees.to_radians()).tan() * (-t / avalanche).exp()).atan();
                let (lean, off) = cell.lean(100.0 + t);
                (angle, size) = (angle.max((lean - exact).abs()), size.max(off));
            }
            // Collocation with four points has sixth order. The error is z⁶/(6! 2⁶ …) rad for a
            // step of z ≤ 1 avalanche times. A step that contains a whole avalanche is halved until
            // a tenth of a step resolves the avalanche with an error of 1e-4.
            let bound = if avalanche >= 100.0 { 1e-7 } else { 1e-4 };
            assert!(
                angle < bound && size < 2.0 * bound,
                "{degrees}°, τa = {avalanche} s: {angle:e} rad, |h| {size:e}"
            );
        }
    }
}

#[test]
fn normal_of_an_inverted_pile_stays_a_unit_vector() {
    // The inverted pile is an unstable equilibrium. Rounding may move h in any direction, but h
    // remains a unit vector.
    for avalanche in [1e-4, 1e-2, 1.0, 5.0, 20.0, 60.0, 120.0, 1e3] {
        let mut cell = Cell::new(avalanche, 90.0, Tilted(std::f64::consts::PI));
        let worst = (1..=60)
            .map(|i| cell.lean(100.0 + 30.0 * f64::from(i)).1)
            .fold(0.0, f64::max);
        assert!(
            worst < 2e-4,
            "τa = {avalanche} s: |h| differs from 1 by {worst:e}"
        );
    }
}

#[test]
fn pile_lags_by_a_constant_angle_on_a_slow_clinostat() {
    // In the rotating frame φ̇ = Ω − sin φ/τa has the steady state sin φ = Ωτa.
    let rate = TAU / HOUR;
    for avalanche in [1e-4, 1.0, 20.0, 120.0, 500.0] {
        let exact = (rate * avalanche).asin();
        for step in [90.0, 45.0, 22.5] {
            let (lag, off) = Cell::new(avalanche, step, Clinostat(rate)).lean(8.0 * HOUR);
            // The verticals are interpolated by cubics through the last four values, which are Ω dt
            // = 0.157, 0.079 and 0.039 rad apart. The error within the step is at most 0.04 (Ω
            // dt)⁴. Its relative error m is mostly in the length, which |h| approaches, so that sin
            // φ (1 + m) = Ωτa.
            let bound = 0.04 * (rate * step).powi(4);
            assert!(
                off < bound,
                "τa = {avalanche} s, step {step} s: |h| differs from 1 by {off:e} > {bound:e}"
            );
            let (error, bound) = ((lag - exact).abs(), bound * (1.0 + exact.tan()));
            assert!(
                error < bound,
                "τa = {avalanche} s, step {step} s: {error:e} > {bound:e}"
            );
        }
    }
}

/// The tip of a steered shoot after four hours on a clinostat with one turn per hour, m.
fn tip(
    perception: impl Perception<Signal = [f64; 2]> + Send + Sync + 'static,
    step: f64,
) -> Vector3<f64> {
    let clinostat = Clinostat(TAU / HOUR);
    let shoot = shoots::reduced(0.05, 20.0 * HOUR)
        .tropism(shoots::steering(perception))
        .scene(clinostat);
    let mut shoot = shoot.elements(6).build().unwrap();
    MethodOfSteps::new(step)
        .advance(&mut shoot, 4.0 * HOUR)
        .unwrap();
    shoot.tip()
}

#[test]
fn fast_avalanches_give_the_shape_of_settled_statoliths_at_any_step() {
    for step in [360.0, 180.0, 90.0] {
        let difference = tip(
            Statoliths {
                avalanche_time: 1e-6,
            },
            step,
        ) - tip(SettledStatoliths, step);
        // The pile lags by 1e-6 s. A tip at 5 cm that makes one turn per hour moves at 9e-5 m/s,
        // and so by 9e-11 m during this lag.
        assert!(difference.norm() < 1e-10, "step {step} s: {difference:e}");
    }
}

#[test]
fn pile_slips_on_a_fast_clinostat() {
    // With Ωτa > 1 there is no steady state. The reference integrates φ̇ = Ω − sin φ/τa in 1e5
    // steps of the classical Runge–Kutta method.
    let (rate, avalanche, end) = (TAU / 600.0, 200.0, 2.0 * HOUR);
    let (mut phi, h) = (0.0_f64, end / 1e5);
    let slope = |phi: f64| rate - phi.sin() / avalanche;
    for _ in 0..100_000 {
        let k1 = slope(phi);
        let k2 = slope(phi + 0.5 * h * k1);
        let k3 = slope(phi + 0.5 * h * k2);
        phi += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + slope(phi + h * k3));
    }
    assert!(phi > TAU, "the reference does not slip: {phi}");
    let errors = [60.0, 30.0, 15.0, 7.5].map(|step| {
        let mut cell = Cell::new(avalanche, step, Clinostat(rate));
        let h = cell.normal(end);
        // The lag is positive when the pile is behind.
        let up = -cell.shoot.model().scene().gravity(end).normalize();
        let lag = h.cross(&up).y.atan2(h.dot(&up));
        ((lag - phi + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU).abs()
    });
    assert!(
        shoots::order(&errors) >= 3.5,
        "order {}: {errors:?}",
        shoots::order(&errors)
    );
    assert!(errors[3] < 1e-4, "{errors:?}");
}

/// Gravity that rotates slowly from −e3 towards −e1 and vanishes after 200 s.
struct Orbit;

impl Scene for Orbit {
    fn gravity(&self, t: f64) -> Vector3<f64> {
        if t > 200.0 {
            Vector3::zeros()
        } else {
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 1e-3 * t) * DOWN
        }
    }
    fn base(&self, _t: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::identity()
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        if t < 200.0 { 200.0 } else { f64::INFINITY }
    }
}

#[test]
fn pile_does_not_move_without_gravity() {
    for avalanche in [1e-3, 120.0, 1e5] {
        let mut cell = Cell::new(avalanche, 90.0, Orbit);
        let before = cell.normal(200.0);
        for t in [201.0, 1000.0, 4.0 * HOUR] {
            // The direction of gravity is undefined, and ḣ = 0. The decay and the gain of h in a
            // step are separate sums. Each of the 160 steps has some tens of rounding errors.
            let (normal, rounding) = (cell.normal(t), 160.0 * 64.0 * f64::EPSILON);
            assert!(
                abs_diff_eq!(
                    InNorm(normal.normalize()),
                    InNorm(before.normalize()),
                    epsilon = rounding
                ),
                "τa = {avalanche} s, t = {t} s: {normal} against {before}"
            );
            // The error of the length at the end of gravity decays.
            let off = |h: &Vector3<f64>| (h.norm() - 1.0).abs();
            assert!(
                off(&normal) <= off(&before) * f64::exp(-(t - 200.0) / avalanche) + rounding,
                "{normal}"
            );
        }
    }
}
