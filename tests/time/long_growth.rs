//! Growth over up to a hundred growth times: lengths and the tissue near the apex, against closed
//! forms and quadrature.

use std::sync::Arc;

use crate::fixtures::gauss::gauss;
use crate::fixtures::random::long;
use crate::fixtures::shoots;
use crate::fixtures::shoots::{HOUR, YOUNG};
use approx::{assert_relative_eq, relative_eq};
use morphorod::equilibrium::Unloaded;
use morphorod::growth::{CosineProfile, GrowthLaw, LinearProfile, UniformGrowth};
use morphorod::integrator::{IntegrationError, Integrator, MethodOfSteps};
use morphorod::rod::Rod;
use morphorod::{DynLaws, Order, Shoot, State};

const ZONE: f64 = 0.03;
const TIME: f64 = 20.0 * HOUR;
const UNIFORM: UniformGrowth = UniformGrowth {
    zone_length: ZONE,
    time: TIME,
};
const LINEAR: LinearProfile = LinearProfile {
    zone_length: ZONE,
    time: TIME,
};
const COSINE: CosineProfile = CosineProfile {
    zone_length: ZONE,
    time: TIME,
};

/// User-defined law of mean 1/τg: REGR = (½ + 3x (1 − x))/τg with x = σ/ℓg.
#[derive(Debug, Clone, Copy)]
struct Parabola;

impl GrowthLaw for Parabola {
    fn regr(&self, sigma: f64, _t: f64) -> f64 {
        let x = sigma / ZONE;
        (0.5 + 3.0 * x * (1.0 - x)) / TIME
    }
    fn zone_length(&self) -> f64 {
        ZONE
    }
}

/// Growth law of any type, shared by several shoots.
type AnyGrowth = Arc<dyn GrowthLaw + Send + Sync>;

/// Shoot without load and steering, which remains straight.
fn shoot(growth: AnyGrowth, length: f64, elements: usize, order: Order) -> Shoot<DynLaws> {
    let builder = Shoot::builder(YOUNG)
        .length(length)
        .radius(0.01 * length)
        .elements(elements)
        .order(order);
    builder.growth(growth).into_dyn().build().unwrap()
}

/// Distances of the ends of growing elements from the apex, m, with the apex last. The sum starts
/// at the apex, where lengths are small.
fn zone_nodes(rod: &Rod) -> Vec<f64> {
    let mut distances = vec![0.0];
    for e in ((rod.zone().start / rod.order().points())..rod.elements()).rev() {
        distances.push(distances[distances.len() - 1] + rod.element_length(e).unwrap());
    }
    distances.reverse();
    distances
}

/// Time (s) that tissue takes from `a` to `b` (m from the apex) under a law that does not depend on
/// time: ∫ dσ/V, on pieces on which the integrand is smooth.
fn travel(law: &dyn GrowthLaw, a: f64, b: f64) -> f64 {
    let ((x, w), pieces) = (gauss(8), 32);
    let ratio = (b / a).ln() / f64::from(pieces);
    let place = |i: u32, x: f64| a * (ratio * (f64::from(i) + x)).exp();
    let each = (0..pieces).flat_map(|i| x.iter().zip(&w).map(move |(x, w)| (place(i, *x), *w)));
    each.map(|(sigma, w)| w * ratio * sigma / law.apical_speed(sigma, 0.0))
        .sum()
}

/// Growth times of a run under a law whose motion the crate integrates numerically. It takes 512
/// Runge–Kutta steps for each material point and growth time, so a hundred growth times take 4 to 9
/// s; `MORPHOROD_LONG=1` requests them.
///
/// Forty growth times suffice to detect the defects that are specific to such a law. The motion of
/// tissue is compared over a tenth of a growth time, with a bound for that interval alone: a wrong
/// motion or stretch fails at once, and one of elements that have grown from tissue at the apex
/// fails after 10 or 20 growth times, when most of the zone has been renewed. Elements near the
/// apex that are cut once in a growth time, instead of once in an octave of σ, add forty nodes and
/// exceed the bound, 16 beyond two for each element. Rounding errors of lengths accumulate over a
/// thousand steps in code that all laws share. The uniform law and the linear profile test this
/// code over a hundred growth times.
fn growth_times_of_integrated_laws() -> u32 {
    if long() { 100 } else { 40 }
}

/// Grows a shoot for a number of growth times and asserts that relative errors of lengths and
/// positions are small.
fn assert_stays_accurate(law: impl GrowthLaw + Copy + Send + Sync + 'static, growth_times: u32) {
    let law: AnyGrowth = Arc::new(law);
    for (elements, order) in [(4, Order::Eight), (3, Order::Four), (3, Order::Two)] {
        let mut shoot = shoot(law.clone(), 0.05, elements, order);
        let mut run = MethodOfSteps::with_solver(TIME / 10.0, Unloaded);
        let mut most = 0;
        for i in 0..=growth_times {
            let time = f64::from(i) * TIME;
            run.advance(&mut shoot, time).unwrap();
            let rod = shoot.rod();
            // The mean of all these laws over the zone is 1/τg.
            let exact = 0.05 + ZONE * time / TIME;
            // The bound covers at most a thousand steps, each with a rounding error of one ulp of
            // the length.
            assert!(
                relative_eq!(rod.length(), exact, epsilon = 0.0, max_relative = 1e-12),
                "{order:?}, {time} s: length {} m, expected {exact} m",
                rod.length()
            );
            let nodes = zone_nodes(rod);
            assert!(
                relative_eq!(nodes[0], ZONE, epsilon = 0.0, max_relative = 1e-12),
                "{order:?}, {time} s: the zone is {} m long, expected {ZONE} m",
                nodes[0]
            );
            most = most.max(nodes.len());
            // Initial apex distances in the zone decrease strictly towards the apex, even when they
            // are very small.
            let names = rod.points()[rod.zone()]
                .iter()
                .map(|point| point.initial_apex_distance);
            assert!(
                names.clone().all(|name| name > 0.0)
                    && names.clone().zip(names.skip(1)).all(|(a, b)| a > b)
            );
            if i % 10 != 0 {
                continue;
            }
            // Positions of the same element ends a tenth of a growth time later.
            run.advance(&mut shoot, time + 0.1 * TIME).unwrap();
            let later = zone_nodes(shoot.rod());
            let moved = |sigma: f64| {
                let nearest = later.iter().copied().min_by(|a, b| {
                    let late = |b: f64| (travel(&*law, sigma, b) - 0.1 * TIME).abs();
                    late(*a).total_cmp(&late(*b))
                });
                nearest.unwrap()
            };
            for ends in nodes.windows(2).take(nodes.len() - 2) {
                // Skip elements that have left the zone meanwhile.
                if travel(&*law, ends[0], ZONE) < 0.1 * TIME {
                    continue;
                }
                let [a, b] = [moved(ends[0]), moved(ends[1])];
                // The position error of an end is its delay multiplied by its speed.
                let off = |from: f64, to: f64| {
                    (travel(&*law, from, to) - 0.1 * TIME) * law.apical_speed(to, 0.0)
                };
                let error = (off(ends[0], a) - off(ends[1], b)) / (a - b);
                // Numerical integration of the motion has an error of 1e-13 in a growth time.
                // Elements of a sixteenth of the zone magnify it.
                assert!(
                    error.abs() < 1e-11,
                    "{order:?}, {time} s, {ends:?}: {error:e}"
                );
            }
        }
        // The zone contains halves of the initial elements. Up to three more are added for every
        // octave of σ over which the cosine profile stretches its apex unevenly; σ ~ t^(−1/2)
        // passes five octaves in a hundred growth times.
        assert!(
            most <= 2 * elements + 16,
            "{order:?}: {most} nodes in the zone"
        );
        // The final state is valid, and deserialisation accepts it.
        let saved = serde_json::to_string(shoot.state()).unwrap();
        assert!(serde_json::from_str::<State>(&saved).unwrap() == *shoot.state());
    }
}

#[test]
fn uniform_growth_stays_accurate_for_a_hundred_growth_times() {
    assert_stays_accurate(UNIFORM, 100);
}

#[test]
fn linear_profile_stays_accurate_for_a_hundred_growth_times() {
    assert_stays_accurate(LINEAR, 100);
}

#[test]
fn cosine_profile_stays_accurate_for_many_growth_times() {
    assert_stays_accurate(COSINE, growth_times_of_integrated_laws());
}

#[test]
fn user_defined_growth_stays_accurate_for_many_growth_times() {
    assert_stays_accurate(Parabola, growth_times_of_integrated_laws());
}

#[test]
fn tiny_initial_apex_distances_keep_relative_accuracy() {
    // Uniform growth: tissue now at σ was at σ exp(−t/τg) initially, a factor of 4e-44 after a
    // hundred growth times.
    let mut shoot = shoot(Arc::new(UNIFORM), 0.05, 8, Order::Eight);
    let mut run = MethodOfSteps::with_solver(TIME / 20.0, Unloaded);
    let time = 100.0 * TIME;
    run.advance(&mut shoot, time).unwrap();
    for point in &shoot.rod().points()[shoot.rod().zone()] {
        let exact = point.apex_distance * (-time / TIME).exp();
        // The bound covers 145 cuts and 2000 steps, each with a rounding error of one or two ulp.
        assert_relative_eq!(
            point.initial_apex_distance,
            exact,
            epsilon = 0.0,
            max_relative = 1e-11
        );
    }
}

/// Largest error of an apex distance after one growth time, relative to the zone, computed from the
/// initial apex distance of the same tissue.
fn position_error(law: AnyGrowth, elements: usize, order: Order) -> f64 {
    let mut shoot = shoot(law.clone(), 0.05, elements, order);
    MethodOfSteps::with_solver(TIME / 50.0, Unloaded)
        .advance(&mut shoot, TIME)
        .unwrap();
    let rod = shoot.rod();
    let off = |point: &morphorod::rod::MaterialPoint| {
        let late = travel(&*law, point.initial_apex_distance, point.apex_distance) - TIME;
        (late * law.apical_speed(point.apex_distance, 0.0)).abs() / ZONE
    };
    rod.points()[rod.zone()].iter().map(off).fold(0.0, f64::max)
}

#[test]
fn positions_of_points_converge_at_the_order_of_the_elements() {
    for order in [Order::Two, Order::Four, Order::Six, Order::Eight] {
        let p = order.points() as i32;
        // These meshes are fine enough to show the order and coarse enough for errors above
        // rounding.
        let meshes = if p > 2 { [2, 4, 8] } else { [8, 16, 32] };
        for (law, errors) in [
            (
                "linear",
                meshes.map(|elements| position_error(Arc::new(LINEAR), elements, order)),
            ),
            (
                "user-defined",
                meshes.map(|elements| position_error(Arc::new(Parabola), elements, order)),
            ),
        ] {
            // The observed order must reach that of the elements unless errors are near rounding. A
            // half is subtracted because coarse and fine meshes are cut at different positions.
            let observed = shoots::order(&errors.map(|error| error.max(1e-14)));
            let least = if errors[2] < 1e-13 {
                0.0
            } else {
                f64::from(2 * p) - 0.5
            };
            assert!(
                observed > least,
                "{law}, {order:?}: order {observed}, errors {errors:?}"
            );
        }
    }
}

#[test]
fn length_follows_the_closed_form_from_tiny_and_huge_initial_lengths() {
    for start in [1e-3 * ZONE, 1e3 * ZONE] {
        for elements in [1, 8] {
            let mut shoot = shoot(Arc::new(UNIFORM), start, elements, Order::Eight);
            let mut run = MethodOfSteps::with_solver(TIME / 20.0, Unloaded);
            run.advance(&mut shoot, 20.0 * TIME).unwrap();
            let exact = if start < ZONE {
                ZONE * (21.0 - (ZONE / start).ln())
            } else {
                start + 20.0 * ZONE
            };
            // The bound covers hundreds of steps, each with a rounding error of one ulp.
            assert!(
                relative_eq!(
                    shoot.rod().length(),
                    exact,
                    epsilon = 0.0,
                    max_relative = 1e-12
                ),
                "from {start} m, {elements} elements: {} m, expected {exact} m",
                shoot.rod().length()
            );
        }
    }
}

#[test]
fn growth_zone_shorter_than_an_element_grows_at_the_exact_rate() {
    // The number of elements refers to the zone. With one element, the zone is a single element of
    // the largest possible length.
    let mut shoot = shoot(Arc::new(LINEAR), 1.0, 1, Order::Four);
    MethodOfSteps::with_solver(TIME / 20.0, Unloaded)
        .advance(&mut shoot, 30.0 * TIME)
        .unwrap();
    let exact = 1.0 + 30.0 * ZONE;
    assert_relative_eq!(
        shoot.rod().length(),
        exact,
        epsilon = 0.0,
        max_relative = 1e-12
    );
}

/// Growth during the first third of each growth time.
#[derive(Debug, Clone, Copy)]
struct OnAndOff;

impl OnAndOff {
    /// Total duration of growth by time `t`, s.
    fn grown(t: f64) -> f64 {
        TIME * (t / TIME).floor() / 3.0 + (t % TIME).min(TIME / 3.0)
    }
}

impl GrowthLaw for OnAndOff {
    fn regr(&self, _sigma: f64, t: f64) -> f64 {
        if t.rem_euclid(TIME) < TIME / 3.0 {
            1.0 / TIME
        } else {
            0.0
        }
    }
    fn zone_length(&self) -> f64 {
        ZONE
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        let begun = TIME * (t / TIME).floor();
        [begun + TIME / 3.0, begun + TIME, begun + TIME * (4.0 / 3.0)]
            .into_iter()
            .find(|time| *time > t)
            .unwrap_or(f64::INFINITY)
    }
}

#[test]
fn growth_that_starts_and_stops_has_the_exact_length() {
    let mut shoot = shoot(Arc::new(OnAndOff), 0.05, 4, Order::Eight);
    // Most starts and stops do not coincide with multiples of the step.
    let mut run = MethodOfSteps::with_solver(TIME / 17.3, Unloaded);
    for t in [0.2, 0.5, 3.1, 30.0].map(|t| t * TIME) {
        run.advance(&mut shoot, t).unwrap();
        let exact = 0.05 + ZONE * OnAndOff::grown(t) / TIME;
        // The integrator steps onto each start and stop, up to a few units of rounding of the time.
        assert!(
            relative_eq!(
                shoot.rod().length(),
                exact,
                epsilon = 0.0,
                max_relative = 1e-12
            ),
            "{t} s: {} m, expected {exact} m",
            shoot.rod().length()
        );
    }
}

/// Growth that is up to 5000 times as fast in a layer that is thin compared with the elements.
#[derive(Debug, Clone, Copy)]
struct Layer;

impl GrowthLaw for Layer {
    fn regr(&self, sigma: f64, _t: f64) -> f64 {
        (0.01 + 50.0 * (-((sigma - 0.55 * ZONE) / (0.02 * ZONE)).powi(2)).exp()) / TIME
    }
    fn zone_length(&self) -> f64 {
        ZONE
    }
}

#[test]
fn stretch_that_material_points_do_not_resolve_is_an_error() {
    let mut shoot = shoot(Arc::new(Layer), 0.05, 1, Order::Eight);
    let before = shoot.state().clone();
    let error = MethodOfSteps::with_solver(TIME, Unloaded)
        .advance(&mut shoot, 3.0 * TIME)
        .unwrap_err();
    assert!(
        matches!(error, IntegrationError::Uneven { ratio, .. } if ratio > 2.0)
            && error.is_recoverable(),
        "{error}"
    );
    assert!(*shoot.state() == before);
}
