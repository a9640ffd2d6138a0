//! Tests of the return map with the exact solution of a linear delay differential equation.

use approx::assert_abs_diff_eq;
use nalgebra::Complex;

use super::*;
use crate::constitutive::LinearElastic;
use crate::cycle::map::Monodromy;
use crate::growth::{Ongoing, UniformGrowth};
use crate::scene::Still;
use crate::tropism::{Memory, Proprioception, Response};

/// Growth time τg (s) and proprioceptive sensitivity η.
const LAW: (f64, f64) = (72e3, 20.0);
/// Memory time τm and delay τr, s.
const MEMORY: Memory = Memory {
    time: 720.0,
    delay: 900.0,
};

/// A weightless shoot with proprioception. Its strain is the intrinsic strain, and each component
/// at each point independently satisfies u̇ = −(η/τg) y(t − τr) with τm ẏ = u − y.
fn shoot() -> Shoot<impl Model> {
    Shoot::builder(LinearElastic {
        youngs_modulus: 1e7,
        poissons_ratio: 0.5,
    })
    .length(0.05)
    .radius(5e-4)
    .elements(1)
    .growth(Ongoing(UniformGrowth {
        zone_length: 0.07,
        time: LAW.0,
    }))
    .tropism(Proprioception { sensitivity: LAW.1 }.remembered(MEMORY))
    .scene(Still::weightless())
    .build()
    .unwrap()
}

/// The root λ of λ (1 + λτm) + (η/τg) exp(−λτr) = 0 with Im λ > 0 next to the axis, by Newton's
/// method.
fn root() -> Complex<f64> {
    let gain = LAW.1 / LAW.0;
    let mut z = Complex::new(0.0, 5e-4);
    for _ in 0..30 {
        let late = (-z * MEMORY.delay).exp() * gain;
        z -= (z * (z * MEMORY.time + 1.0) + late)
            / (z * (2.0 * MEMORY.time) + 1.0 - late * MEMORY.delay);
    }
    let residual = z * (z * MEMORY.time + 1.0) + (-z * MEMORY.delay).exp() * gain;
    assert!(
        z.im > 1e-4 && residual.norm() < 1e-15 * z.norm(),
        "{z} {residual}"
    );
    z
}

/// Complex amplitude of a component of the strain, 1/m, which differs from point to point. The
/// second component is zero, since an element represents a planar strain exactly.
fn amplitude(k: usize) -> Complex<f64> {
    if k.is_multiple_of(2) {
        Complex::from_polar(2.0 + (k as f64).sin(), 0.7 * k as f64)
    } else {
        Complex::ZERO
    }
}

/// The exact solution Re(a exp(λt)) at a time, with its past.
fn exact(return_map: &ReturnMap<impl Model>, period: f64, time: f64) -> PhaseState {
    let (root, numbers) = (root(), 2 * return_map.places.len());
    let length = period / return_map.grid.intervals as f64;
    let wave = |factor: Complex<f64>, t: f64| {
        DVector::from_fn(numbers, |k, _| {
            (amplitude(k) * factor * (root * t).exp()).re
        })
    };
    let remembered = (root * MEMORY.time + 1.0).inv();
    let interval = |n: usize| {
        let begin = time + (n as f64 - return_map.kept as f64) * length;
        return_map
            .grid
            .stages
            .iter()
            .map(|c| wave(remembered * root * length, begin + c * length))
            .collect()
    };
    PhaseState {
        strain: wave(Complex::ONE, time),
        variables: wave(remembered, time),
        slopes: (0..return_map.kept).map(interval).collect(),
    }
}

/// The largest error of the strain after a period, relative to its size.
fn error(intervals: usize, stages: usize, period: f64) -> f64 {
    let shoot = shoot();
    let mut return_map =
        ReturnMap::new(&shoot, TimeGrid::new(intervals, stages), period, None).unwrap();
    let end = return_map
        .run(&exact(&return_map, period, 0.0), period)
        .unwrap()
        .end;
    let exact = exact(&return_map, period, period);
    (end.strain - &exact.strain).amax() / exact.strain.amax()
}

#[test]
fn the_return_map_multiplies_a_wave_by_exp_lambda_t() {
    // Six stages in each of eight intervals of a seventh of the oscillation: the error of the
    // interpolation is below 1e-9.
    let (shoot, period) = (shoot(), 9000.0);
    let mut return_map = ReturnMap::new(&shoot, TimeGrid::new(8, 6), period, None).unwrap();
    let end = return_map
        .run(&exact(&return_map, period, 0.0), period)
        .unwrap()
        .end;
    let exact = exact(&return_map, period, period);
    assert_eq!(end.slopes.len(), return_map.kept);
    assert_abs_diff_eq!(
        end.strain,
        exact.strain,
        epsilon = 1e-8 * exact.strain.amax()
    );
    assert_abs_diff_eq!(
        end.variables,
        exact.variables,
        epsilon = 1e-8 * exact.variables.amax()
    );
    for (found, exact) in end
        .slopes
        .iter()
        .flatten()
        .zip(exact.slopes.iter().flatten())
    {
        assert_abs_diff_eq!(found, exact, epsilon = 1e-6 * exact.amax());
    }
}

#[test]
fn the_return_map_converges_with_the_order_of_its_interpolation() {
    // Delayed values are those of polynomials of order s + 1. The factor of their error depends on
    // the position between the stages, which is the same for both grids: the delay is 4/3 of an
    // interval and then 16/3.
    for stages in [2, 3] {
        let period = 12.0 * 0.75 * MEMORY.delay;
        let order = (error(12, stages, period) / error(48, stages, period)).log2() / 2.0;
        // Intervals of 675 s are a tenth of a wave: terms of higher order change the observed one
        // by a third.
        assert_abs_diff_eq!(order, stages as f64 + 1.0, epsilon = 0.4);
    }
}

#[test]
fn the_derivative_of_a_linear_map_is_the_map() {
    // A delay that lies within an interval, and one that is longer.
    for period in [9000.0, 2000.0] {
        let shoot = shoot();
        let mut return_map = ReturnMap::new(&shoot, TimeGrid::new(4, 3), period, None).unwrap();
        let start = exact(&return_map, period, 0.0);
        let path = return_map.run(&start, period).unwrap();
        let moved = Monodromy::of(&return_map, &path)
            .unwrap()
            .apply(&start)
            .unwrap();
        // Equilibria are solved to 1e-13, and the stimuli are linearised by differences that are
        // good to 1e-9.
        let size = path.end.flat().amax();
        assert_abs_diff_eq!(moved.flat(), path.end.flat(), epsilon = 1e-9 * size);
    }
}

#[test]
fn a_past_shorter_than_the_delay_is_an_error() {
    let shoot = shoot();
    let mut return_map = ReturnMap::new(&shoot, TimeGrid::new(4, 3), 2000.0, None).unwrap();
    let start = exact(&return_map, 2000.0, 0.0);
    // 900 s are 1.8 intervals of 500 s; with half an interval in reserve the state contains three.
    assert_eq!(return_map.kept, 3);
    return_map.kept = 1;
    assert!(matches!(
        return_map.run(&start, 2000.0),
        Err(CycleError::Parameter(_))
    ));
}
