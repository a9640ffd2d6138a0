//! Growth that goes on for a hundred growth times: lengths and the tissue near the apex, against closed forms and quadrature.

use crate::fixtures::shoots;
use crate::fixtures::shoots::{HOUR, YOUNG};
use morphorod::equilibrium::Unloaded;
use morphorod::growth::{CosineProfile, GrowthLaw, LinearProfile, UniformGrowth};
use morphorod::integrator::{IntegrationError, Integrator, MethodOfSteps};
use morphorod::quadrature::gauss;
use morphorod::rod::Rod;
use morphorod::{Laws, Order, Shoot, State};

const ZONE: f64 = 0.03;
const TIME: f64 = 20.0 * HOUR;
const UNIFORM: UniformGrowth = UniformGrowth { zone_length: ZONE, time: TIME };
const LINEAR: LinearProfile = LinearProfile { zone_length: ZONE, time: TIME };
const COSINE: CosineProfile = CosineProfile { zone_length: ZONE, time: TIME };

/// A law of one's own, of mean 1/τg: REGR = (½ + 3x (1 − x))/τg with x = σ/ℓg.
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

/// A shoot that nothing bends.
fn shoot<G: GrowthLaw>(
    growth: G,
    length: f64,
    elements: usize,
    order: Order,
) -> Shoot<Laws<morphorod::constitutive::LinearElastic, G>> {
    let builder = Shoot::builder(YOUNG).length(length).radius(0.01 * length).elements(elements).order(order);
    builder.growth(growth).build().unwrap()
}

/// Distances of the ends of growing elements from the apex, m, added up from the apex where they are small; the apex last.
fn zone_nodes(rod: &Rod) -> Vec<f64> {
    let mut distances = vec![0.0];
    for e in (rod.first_growing()..rod.elements()).rev() {
        distances.push(distances[distances.len() - 1] + rod.element_length(e));
    }
    distances.reverse();
    distances
}

/// The time (s) that tissue takes from `a` to `b` (m from the apex) under a law that does not change in time: ∫ dσ/V, on pieces on
/// which the integrand is smooth.
fn travel(law: &impl GrowthLaw, a: f64, b: f64) -> f64 {
    let ((x, w), pieces) = (gauss(8), 32);
    let ratio = (b / a).ln() / f64::from(pieces);
    let place = |i: u32, x: f64| a * (ratio * (f64::from(i) + x)).exp();
    let each = (0..pieces).flat_map(|i| x.iter().zip(&w).map(move |(x, w)| (place(i, *x), *w)));
    each.map(|(sigma, w)| w * ratio * sigma / law.apical_speed(sigma, 0.0)).sum()
}

/// A hundred growth times: of everything, the error relative to itself.
fn a_hundred_growth_times(law: impl GrowthLaw + Copy) {
    for (elements, order) in [(4, Order::Eight), (3, Order::Four), (3, Order::Two)] {
        let mut shoot = shoot(law, 0.05, elements, order);
        let mut run = MethodOfSteps::with_solver(TIME / 10.0, Unloaded);
        let mut most = 0;
        for i in 0..=100 {
            let time = f64::from(i) * TIME;
            run.advance(&mut shoot, time).unwrap();
            let rod = shoot.rod();
            // All these laws are of mean 1/τg.
            let exact = 0.05 + ZONE * time / TIME;
            // A thousand steps, each of which costs an ulp of the length.
            assert!(
                (rod.length() / exact - 1.0).abs() < 1e-12,
                "{order:?}, {time} s: {:e}",
                rod.length() / exact - 1.0
            );
            let nodes = zone_nodes(rod);
            assert!((nodes[0] / ZONE - 1.0).abs() < 1e-12, "the zone is {} m long", nodes[0]);
            most = most.max(nodes.len());
            // Names of the tissue in the zone fall towards the apex, however small they have become.
            let names = rod.points()[rod.zone()].iter().map(|point| point.initial_apex_distance);
            assert!(names.clone().all(|name| name > 0.0) && names.clone().zip(names.skip(1)).all(|(a, b)| a > b));
            if i % 10 != 0 {
                continue;
            }
            // Where the ends of its elements are a tenth of a growth time later.
            run.advance(&mut shoot, time + 0.1 * TIME).unwrap();
            let later = zone_nodes(shoot.rod());
            let moved = |sigma: f64| {
                let nearest = later.iter().copied().min_by(|a, b| {
                    let late = |b: f64| (travel(&law, sigma, b) - 0.1 * TIME).abs();
                    late(*a).total_cmp(&late(*b))
                });
                nearest.unwrap()
            };
            for ends in nodes.windows(2).take(nodes.len() - 2) {
                // They have left the zone.
                if travel(&law, ends[0], ZONE) < 0.1 * TIME {
                    continue;
                }
                let [a, b] = [moved(ends[0]), moved(ends[1])];
                // Each end off by what it is late, at its speed.
                let off = |from: f64, to: f64| (travel(&law, from, to) - 0.1 * TIME) * law.apical_speed(to, 0.0);
                let error = (off(ends[0], a) - off(ends[1], b)) / (a - b);
                // Motion that is integrated costs 1e-13 in a growth time, elements of a sixteenth of the zone magnify it.
                assert!(error.abs() < 1e-11, "{order:?}, {time} s, {ends:?}: {error:e}");
            }
        }
        // Halves of elements as long as a part of the zone, and up to three more for every octave over which the cosine's apex is stretched
        // unevenly, of which σ ~ t^(−1/2) passes five.
        assert!(most <= 2 * elements + 16, "{order:?}: {most} nodes in the zone");
        // What it has become is a shoot.
        let saved = serde_json::to_string(shoot.state()).unwrap();
        assert!(serde_json::from_str::<State>(&saved).unwrap() == *shoot.state());
    }
}

#[test]
fn a_hundred_growth_times_of_uniform_growth() {
    a_hundred_growth_times(UNIFORM);
}

#[test]
fn a_hundred_growth_times_of_the_linear_profile() {
    a_hundred_growth_times(LINEAR);
}

#[test]
fn a_hundred_growth_times_of_the_cosine_profile() {
    a_hundred_growth_times(COSINE);
}

#[test]
fn a_hundred_growth_times_of_a_law_of_ones_own() {
    a_hundred_growth_times(Parabola);
}

#[test]
fn names_near_the_apex_keep_their_digits() {
    // Uniform growth: σ exp(−t/τg) at t = 0, 4e-44 of it after a hundred growth times.
    let mut shoot = shoot(UNIFORM, 0.05, 8, Order::Eight);
    let mut run = MethodOfSteps::with_solver(TIME / 20.0, Unloaded);
    let time = 100.0 * TIME;
    run.advance(&mut shoot, time).unwrap();
    for point in &shoot.rod().points()[shoot.rod().zone()] {
        let name = point.apex_distance * (-time / TIME).exp();
        // 145 cuts and 2000 steps, an ulp or two each.
        assert!((point.initial_apex_distance / name - 1.0).abs() < 1e-11, "{point:?} for {name:e}");
    }
}

/// The largest error of a place in the zone after a growth time, relative to the zone, if it is reckoned from the name of its tissue.
fn misplaced(law: impl GrowthLaw + Copy, elements: usize, order: Order) -> f64 {
    let mut shoot = shoot(law, 0.05, elements, order);
    MethodOfSteps::with_solver(TIME / 50.0, Unloaded).advance(&mut shoot, TIME).unwrap();
    let rod = shoot.rod();
    let off = |point: &morphorod::rod::MaterialPoint| {
        let late = travel(&law, point.initial_apex_distance, point.apex_distance) - TIME;
        (late * law.apical_speed(point.apex_distance, 0.0)).abs() / ZONE
    };
    rod.points()[rod.zone()].iter().map(off).fold(0.0, f64::max)
}

#[test]
fn points_inside_elements_converge() {
    for order in [Order::Two, Order::Four, Order::Six, Order::Eight] {
        let p = order.points() as i32;
        // Fine enough to show the order, and coarse enough to stay above rounding.
        let meshes = if p > 2 { [2, 4, 8] } else { [8, 16, 32] };
        for (law, errors) in [
            ("linear", meshes.map(|elements| misplaced(LINEAR, elements, order))),
            ("own", meshes.map(|elements| misplaced(Parabola, elements, order))),
        ] {
            // The order of the elements, down to rounding; less a half, since few elements are cut elsewhere than many.
            let observed = shoots::order(&errors.map(|error| error.max(1e-14)));
            let least = if errors[2] < 1e-13 { 0.0 } else { f64::from(2 * p) - 0.5 };
            assert!(observed > least, "{law}, {order:?}: {observed}, {errors:?}");
        }
    }
}

#[test]
fn short_and_long_beginnings() {
    for start in [1e-3 * ZONE, 1e3 * ZONE] {
        for elements in [1, 8] {
            let mut shoot = shoot(UNIFORM, start, elements, Order::Eight);
            let mut run = MethodOfSteps::with_solver(TIME / 20.0, Unloaded);
            run.advance(&mut shoot, 20.0 * TIME).unwrap();
            let exact = if start < ZONE { ZONE * (21.0 - (ZONE / start).ln()) } else { start + 20.0 * ZONE };
            // Hundreds of steps of an ulp each.
            assert!(
                (shoot.rod().length() / exact - 1.0).abs() < 1e-12,
                "{start}: {:e}",
                shoot.rod().length() / exact - 1.0
            );
        }
    }
}

#[test]
fn a_zone_that_is_shorter_than_an_element() {
    // The element behind the zone is as long as the zone is divided into; one of the whole zone is the longest there can be.
    let mut shoot = shoot(LINEAR, 1.0, 1, Order::Four);
    MethodOfSteps::with_solver(TIME / 20.0, Unloaded).advance(&mut shoot, 30.0 * TIME).unwrap();
    let exact = 1.0 + 30.0 * ZONE;
    assert!((shoot.rod().length() / exact - 1.0).abs() < 1e-12);
}

/// Growth for the first third of each growth time.
#[derive(Debug, Clone, Copy)]
struct OnAndOff;

impl OnAndOff {
    /// How long it has grown by `t`, s.
    fn grown(t: f64) -> f64 {
        TIME * (t / TIME).floor() / 3.0 + (t % TIME).min(TIME / 3.0)
    }
}

impl GrowthLaw for OnAndOff {
    fn regr(&self, _sigma: f64, t: f64) -> f64 {
        if t.rem_euclid(TIME) < TIME / 3.0 { 1.0 / TIME } else { 0.0 }
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
fn growth_that_starts_and_stops() {
    let mut shoot = shoot(OnAndOff, 0.05, 4, Order::Eight);
    // No step meets a start or a stop by itself.
    let mut run = MethodOfSteps::with_solver(TIME / 17.3, Unloaded);
    for t in [0.2, 0.5, 3.1, 30.0].map(|t| t * TIME) {
        run.advance(&mut shoot, t).unwrap();
        let exact = 0.05 + ZONE * OnAndOff::grown(t) / TIME;
        // Each start and stop is met up to a few units of rounding of the time.
        assert!((shoot.rod().length() / exact - 1.0).abs() < 1e-12, "{t}: {:e}", shoot.rod().length() / exact - 1.0);
    }
}

/// Growth that tears tissue apart: a hundred times as fast in a layer that is thin against the elements.
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
fn stretch_that_points_do_not_resolve_is_told() {
    let mut shoot = shoot(Layer, 0.05, 1, Order::Eight);
    let before = shoot.state().clone();
    let error = MethodOfSteps::with_solver(TIME, Unloaded).advance(&mut shoot, 3.0 * TIME).unwrap_err();
    assert!(
        matches!(error, IntegrationError::Uneven { ratio, .. } if ratio > 2.0) && error.is_recoverable(),
        "{error}"
    );
    assert!(*shoot.state() == before);
}
