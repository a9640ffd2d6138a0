//! Motion of material points under uniform growth, compared with the closed form. The points are
//! traced without a simulation, and followed in a simulated shoot whose elements are split many
//! times.

use crate::fixtures::gauss::gauss;
use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{HOUR, RADIUS, YOUNG, rod};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use morphorod::Shoot;
use morphorod::equilibrium::Unloaded;
use morphorod::growth::{GrowthLaw, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::rod::Rod;
use morphorod::tropism::{Declaration, Growing, Site, TropismLaw};
use nalgebra::Vector3;
use std::f64::consts::LN_2;

/// Equations (2) and (3) in closed form, doi 10.3389/fpls.2021.608005. With T0 = τg ln(ℓg/ℓ0) the
/// length is ℓ0 exp(t/τg) up to T0 and ℓg (1 + (t − T0)/τg) after it if ℓ0 < ℓg, and ℓ0 + ℓg t/τg
/// otherwise.
#[derive(Debug, Clone, Copy)]
struct Closed {
    initial: f64,
    zone: f64,
    time: f64,
}

impl Closed {
    fn law(&self) -> UniformGrowth {
        UniformGrowth {
            zone_length: self.zone,
            time: self.time,
        }
    }

    fn length(&self, t: f64) -> f64 {
        let full = self.time * (self.zone / self.initial).ln();
        if self.initial >= self.zone {
            self.initial + self.zone * t / self.time
        } else if t <= full {
            self.initial * (t / self.time).exp()
        } else {
            self.zone * (1.0 + (t - full) / self.time)
        }
    }

    /// Arc length, stretch and exit time of the point that is at distance `sigma` from the apex at
    /// t = 0.
    fn point(&self, sigma: f64, t: f64) -> (f64, f64, f64) {
        let exit = self.time * (self.zone / sigma).ln();
        if sigma >= self.zone {
            let early = -self.time * (sigma - self.zone) / self.zone;
            (self.initial - sigma, 1.0, early)
        } else if t <= exit {
            (
                self.length(t) - sigma * (t / self.time).exp(),
                (t / self.time).exp(),
                exit,
            )
        } else {
            (self.length(exit) - self.zone, self.zone / sigma, exit)
        }
    }
}

/// The cases are ℓ0 < ℓg (figure 3 of the paper: 1 cm, 3 cm, 20 h), video 2 (6.8 cm, 7 cm, 40 h),
/// ℓ0 = ℓg, and ℓ0 > ℓg.
const CASES: [Closed; 4] = [
    Closed {
        initial: 0.01,
        zone: 0.03,
        time: 20.0 * HOUR,
    },
    Closed {
        initial: 0.068,
        zone: 0.07,
        time: 40.0 * HOUR,
    },
    Closed {
        initial: 0.03,
        zone: 0.03,
        time: 20.0 * HOUR,
    },
    Closed {
        initial: 0.05,
        zone: 0.03,
        time: 20.0 * HOUR,
    },
];

#[test]
fn traced_uniform_growth_matches_the_closed_form() {
    for case in CASES {
        let law = case.law();
        for t in (0..=32).map(|i| f64::from(i) * 0.125 * case.time) {
            let now = case.length(t);
            // The rounding of a few operations on numbers of the size of the length is far below
            // 1e-12 of it.
            assert_relative_eq!(
                law.length(case.initial, t),
                now,
                epsilon = 0.0,
                max_relative = 1e-12
            );
            for start in (0..17).map(|i| case.initial * f64::from(i) / 16.0) {
                let traced = law.trace(case.initial, start, t);
                let (place, stretch, exit) = case.point(case.initial - start, t);
                assert!(
                    abs_diff_eq!(traced.arc_length, place, epsilon = 1e-12 * now),
                    "{case:?} {start} {t}: {traced:?} against the place {place}"
                );
                assert!(
                    relative_eq!(traced.stretch, stretch, epsilon = 0.0, max_relative = 1e-12),
                    "{case:?} {start} {t}: {traced:?} against the stretch {stretch}"
                );
                assert_eq!(
                    traced.exit_time.is_some(),
                    exit <= t,
                    "{case:?} {start} {t}: {traced:?}"
                );
                if let Some(found) = traced.exit_time {
                    assert!(
                        abs_diff_eq!(found, exit, epsilon = 1e-12 * case.time),
                        "{case:?} {start} {t}: {found} against {exit}"
                    );
                }
            }
        }
    }
}

/// Arc lengths (m) of the material points of a rod, from the ends of the elements and the integral
/// of the jacobian.
fn places(rod: &Rod) -> Vec<f64> {
    let p = rod.order().points();
    let ((x, w), line) = (gauss(p), rod.centre_line());
    let place = |i: usize| {
        let points = &rod.points()[i / p * p..(i / p + 1) * p];
        // The Lagrange polynomial of point j.
        let polynomial = |j: usize, y: f64| {
            (0..p)
                .filter(|k| *k != j)
                .map(|k| (y - x[k]) / (x[j] - x[k]))
                .product::<f64>()
        };
        let inner = x.iter().zip(&w).map(|(y, w)| {
            let jacobian = (0..p).map(|j| polynomial(j, x[i % p] * y) * points[j].jacobian);
            w * x[i % p] * jacobian.sum::<f64>()
        });
        line[i / p].0 + inner.sum::<f64>()
    };
    (0..rod.points().len()).map(place).collect()
}

#[test]
fn material_points_of_simulated_shoot_follow_the_closed_form() {
    for (case, growth_times) in CASES.into_iter().zip([4.0, 0.5, 4.0, 3.0]) {
        // The radius identifies the point, because it is proportional to the initial apex distance.
        // It is linear in every element, and uniform growth and splitting keep it linear.
        let initial = case.initial;
        let mut shoot = Shoot::builder(YOUNG)
            .length(initial)
            .section(move |s| 0.01 * (initial - s))
            .elements(4)
            .merge_tolerance(0.0)
            .growth(case.law())
            .into_dyn()
            .build()
            .unwrap();
        let first_nodes: Vec<f64> = shoot
            .rod()
            .centre_line()
            .iter()
            .map(|(s, _)| initial - s)
            .collect();
        let mut run = MethodOfSteps::with_solver(0.1 * HOUR, Unloaded);
        let (mut splits, mut worst) = (0, [0.0_f64; 4]);
        for t in (1..=4).map(|i| 0.25 * f64::from(i) * growth_times * case.time) {
            splits += run.advance(&mut shoot, t).unwrap().splits;
            let (rod, now) = (shoot.rod(), case.length(t));
            worst[0] = worst[0].max((rod.length() / now - 1.0).abs());
            assert_relative_eq!(shoot.tip().z, now, epsilon = 0.0, max_relative = 1e-12);
            assert_eq!(shoot.tip().xy().norm(), 0.0);
            for (point, place) in rod.points().iter().zip(places(rod)) {
                let (exact, _, exit) = case.point(100.0 * point.section.radius(), t);
                worst[1] = worst[1].max((place - exact).abs() / now);
                // At the boundary itself, rounding may place a point on either side.
                let near = 1e-12 * case.time;
                assert!(
                    point.exit_time.is_infinite() || point.exit_time <= t,
                    "{point:?} at {t}"
                );
                if exit < t - near {
                    worst[2] = worst[2].max((point.exit_time - exit).abs() / case.time);
                } else if exit > t + near {
                    assert!(
                        point.exit_time.is_infinite(),
                        "{point:?} at {t} has not left before {exit}"
                    );
                    worst[3] = worst[3].max(
                        (point.apex_distance / (now - exact) - 1.0).abs() * (now - exact) / now,
                    );
                }
            }
            // Elements are split and never moved relative to the tissue. The first nodes therefore
            // remain nodes.
            let line = rod.centre_line();
            for sigma in &first_nodes[..first_nodes.len() - 1] {
                let (exact, ..) = case.point(*sigma, t);
                let nearest = line
                    .iter()
                    .map(|(s, _)| (s - exact).abs())
                    .fold(f64::INFINITY, f64::min);
                worst[1] = worst[1].max(nearest / now);
            }
        }
        // Each of the hundreds of steps and splits adds an error of one or two ulps of the length.
        assert!(worst.iter().all(|e| *e < 1e-12), "{case:?}: {worst:?}");
        assert!(splits > 20, "no element was split in {case:?}");
    }
}

#[test]
fn very_long_growth_zone_takes_no_extra_steps() {
    // A zone length above the length of the shoot represents growth of the whole shoot. No tissue
    // leaves the zone, and no step is shortened.
    for zone in [0.06, 1.0, 1e9, 1e300, f64::MAX] {
        let growth = UniformGrowth {
            zone_length: zone,
            time: 20.0 * HOUR,
        };
        let mut shoot = rod(YOUNG, 0.05).growth(growth).into_dyn().build().unwrap();
        let statistics = MethodOfSteps::with_solver(600.0, Unloaded)
            .advance(&mut shoot, HOUR)
            .unwrap();
        assert_eq!(statistics.steps, 12, "{zone}");
        assert_abs_diff_eq!(shoot.rod().length(), 0.05 * f64::exp(0.05), epsilon = 1e-15);
    }
}

#[test]
fn tropisms_receive_the_material_point() {
    /// A law that requires the motion of uniform growth since t = 0.
    struct Identified;
    impl TropismLaw for Identified {
        fn declare(&self, to: &mut Declaration) {
            to.stimuli(1);
        }
        fn sense(&self, site: &Site, stimuli: &mut [f64]) {
            check_uniform(
                site.environment.time,
                site.apex_distance,
                site.initial_apex_distance,
            );
            stimuli[0] = 0.0;
        }
        fn gradient(&self, at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
            check_uniform(at.time, at.apex_distance, at.initial_apex_distance);
            Vector3::zeros()
        }
    }
    fn check_uniform(time: f64, distance: f64, initial: f64) {
        // Points move by a formula at each of a hundred steps.
        assert_relative_eq!(
            distance,
            initial * f64::exp(time / 72e3),
            epsilon = 0.0,
            max_relative = 1e-12
        );
    }
    let growth = UniformGrowth {
        zone_length: 0.07,
        time: 72e3,
    };
    let builder = rod(YOUNG, 0.02).growth(growth).tropism(Identified);
    let mut shoot = builder.into_dyn().build().unwrap();
    MethodOfSteps::new(360.0).advance(&mut shoot, 36e3).unwrap();
}

#[test]
fn constant_growth_gradient_bends_by_gradient_times_logarithm_of_stretch() {
    /// Growth rate REGR (1 + δ·x), equation (4), with δ along d1 and d2, 1/m.
    struct Gradient([f64; 2]);
    impl TropismLaw for Gradient {
        fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
            Vector3::new(self.0[1], -self.0[0], 0.0)
        }
    }
    let delta = [300.0, -70.0];
    let growth = UniformGrowth {
        zone_length: 0.07,
        time: 40.0 * HOUR,
    };
    let mut shoot = Shoot::builder(YOUNG)
        .length(2e-3)
        .radius(RADIUS)
        .elements(1)
        .growth(growth)
        .tropism(Gradient(delta))
        .into_dyn()
        .build()
        .unwrap();
    // The shoot is shorter than the growth zone. REGR is 1/τg everywhere, so that the length
    // doubles in τg ln 2, and the integral of REGR over this time is ln 2.
    MethodOfSteps::with_solver(900.0, Unloaded)
        .advance(&mut shoot, growth.time * LN_2)
        .unwrap();
    assert_relative_eq!(
        shoot.rod().length(),
        4e-3,
        epsilon = 0.0,
        max_relative = 1e-13
    );
    let expected = Vector3::new(delta[1], -delta[0], 0.0) * LN_2;
    for place in shoot.profile().sample(5) {
        // The rate is constant, so that only the rounding of 111 steps remains.
        assert_abs_diff_eq!(
            InNorm(place.strain),
            InNorm(expected),
            epsilon = 1e-12 * expected.norm()
        );
    }
}
