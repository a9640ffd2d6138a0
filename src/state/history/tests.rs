//! Tests of the interpolation in the history, and of the levels that it keeps.

use approx::{assert_abs_diff_eq, assert_relative_eq};

use super::*;
use crate::reference_element::MAX_POINTS;

/// A history of two points with one variable and one stimulus each. The values of the second point
/// are twice those of the first. The stimulus is minus the variable.
fn history(times: &[f64], value: impl Fn(f64) -> f64, rate: impl Fn(f64) -> f64) -> History {
    let mut out = History::zeros((1, 1), 2, times.iter().copied());
    for (level, time) in times.iter().enumerate() {
        for point in 0..2 {
            let factor = (point + 1) as f64;
            let record = out.at_mut(level, point);
            record.variables[0] = factor * value(*time);
            record.rates[0] = factor * rate(*time);
            record.stimuli[0] = -factor * value(*time);
        }
    }
    out
}

/// Variable of a point at a time.
fn read(history: &History, time: f64, point: usize) -> f64 {
    history.read(&history.reading(time, f64::INFINITY), point)[0]
}

fn times(history: &History) -> Vec<f64> {
    (0..history.levels())
        .map(|level| history.time(level))
        .collect()
}

#[test]
fn hermite_interpolation_reproduces_cubics() {
    let value = |t: f64| 2.0 - t + 3.0 * t * t - 0.5 * t * t * t;
    let rate = |t: f64| -1.0 + 6.0 * t - 1.5 * t * t;
    // Steps of different lengths.
    let history = history(&[-1.0, -0.25, 0.0, 2.0, 2.125], value, rate);
    for k in 0..=50 {
        let t = -1.0 + 3.125 * f64::from(k) / 50.0;
        for point in 0..2 {
            let factor = (point + 1) as f64;
            // Rounding of four terms below ten. The rates are divided by steps of 1/8 or more.
            assert_abs_diff_eq!(read(&history, t, point), factor * value(t), epsilon = 1e-13);
            let slope = history.read(&history.slope(t), point)[0];
            assert_abs_diff_eq!(slope, factor * rate(t), epsilon = 1e-12);
        }
    }
}

#[test]
fn interpolated_values_are_of_fourth_order_and_interpolated_rates_of_third() {
    let errors = |pieces: usize| {
        let levels: Vec<f64> = (0..=pieces).map(|k| k as f64 / pieces as f64).collect();
        let history = history(&levels, f64::exp, f64::exp);
        let mut largest = [0.0_f64; 2];
        for t in (0..1000).map(|k| (f64::from(k) + 0.5) / 1000.0) {
            let slope = history.read(&history.slope(t), 0)[0];
            largest[0] = largest[0].max((read(&history, t, 0) - t.exp()).abs());
            largest[1] = largest[1].max((slope - t.exp()).abs());
        }
        largest
    };
    let (coarse, fine) = (errors(16), errors(32));
    // The error is largest in the last piece. Its middle moves by 1/64 between the two meshes,
    // which changes the error by 2 %.
    assert_abs_diff_eq!((coarse[0] / fine[0]).log2(), 4.0, epsilon = 0.05);
    assert_abs_diff_eq!((coarse[1] / fine[1]).log2(), 3.0, epsilon = 0.05);
    // The remainder of the Hermite cubic is h⁴/384 times the fourth derivative, which is at most e.
    assert_relative_eq!(
        fine[0],
        1f64.exp() * 32f64.powi(-4) / 384.0,
        epsilon = 0.0,
        max_relative = 0.03
    );
}

#[test]
fn a_reading_at_the_time_of_a_level_returns_the_stored_value_bit_for_bit() {
    // Times and values without short binary fractions.
    let levels = [0.1, 0.7, 1.9, 2.3];
    let history = history(&levels, |t| (1.0 + t).ln(), |t| 1.0 / (1.0 + t));
    for (level, t) in levels.into_iter().enumerate() {
        for point in 0..2 {
            let stored = history.variables(level, point)[0];
            assert_eq!(
                read(&history, t, point).to_bits(),
                stored.to_bits(),
                "level {level}"
            );
        }
    }
}

#[test]
fn readings_on_either_side_of_a_discontinuity_use_the_piece_of_that_side() {
    // The rate changes from 1 to −2 at t = 1, where two levels have the same time.
    let mut history = history(
        &[0.0, 1.0, 1.0, 3.0],
        |t| if t > 1.0 { 3.0 - 2.0 * t } else { t },
        |_| 1.0,
    );
    for level in [2, 3] {
        history.at_mut(level, 0).rates[0] = -2.0;
    }
    assert_eq!(history.discontinuities().collect::<Vec<_>>(), [2]);
    // The pieces are straight lines. Rounding is that of numbers below ten.
    assert_abs_diff_eq!(read(&history, 0.9, 0), 0.9, epsilon = 1e-15);
    assert_abs_diff_eq!(read(&history, 1.1, 0), 0.8, epsilon = 1e-15);
    assert_eq!(read(&history, 1.0, 0), 1.0);
    // The rates differ. At the discontinuity the later rate is returned.
    let slope = |t: f64| history.read(&history.slope(t), 0)[0];
    assert_abs_diff_eq!(slope(1.0 - 1e-9), 1.0, epsilon = 1e-14);
    assert_abs_diff_eq!(slope(1.0), -2.0, epsilon = 1e-14);
}

#[test]
fn a_jump_of_the_value_is_not_smoothed() {
    let mut history = history(&[0.0, 1.0, 1.0, 2.0], |_| 5.0, |_| 0.0);
    (0..2).for_each(|level| history.at_mut(level, 0).variables[0] = 4.0);
    for t in [0.0, 0.5, 1.0 - 1e-12] {
        assert_eq!(read(&history, t, 0), 4.0);
    }
    for t in [1.0, 1.5, 2.0] {
        assert_eq!(read(&history, t, 0), 5.0);
    }
}

#[test]
fn before_the_first_level_the_variables_are_constant() {
    let history = history(&[1.0, 2.0, 3.0], |t| t * t, |t| 2.0 * t);
    for t in [-1e9, 0.0, 0.999_999] {
        assert_eq!(read(&history, t, 0), 1.0);
        assert_eq!(read(&history, t, 1), 2.0);
    }
    assert_eq!(history.oldest(), Some(1.0));
}

#[test]
fn beyond_the_last_level_the_last_polynomial_continues() {
    let history = history(&[0.0, 1.0, 2.0], |t| t * t * t, |t| 3.0 * t * t);
    // 2.5³, by a cubic with coefficients below twenty.
    assert_abs_diff_eq!(read(&history, 2.5, 0), 15.625, epsilon = 1e-13);
}

#[test]
fn forgotten_levels_do_not_change_what_is_read_after_the_horizon() {
    let levels = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
    let whole = history(&levels, f64::sin, f64::cos);
    let (mut short, mut spare) = (whole.clone(), Spare::new());
    short.forget(4.5, &mut spare);
    // The piece that contains the horizon is kept, with the levels of the forcing before it.
    assert_eq!(times(&short), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
    assert_eq!(
        spare.len(),
        1,
        "the memory of dropped levels is kept for new levels"
    );
    for t in [4.5, 4.75, 5.0, 7.9, 8.0] {
        for (point, tau) in [(0, f64::INFINITY), (1, 0.5)] {
            let read = |history: &History| history.read(&history.reading(t, tau), point)[0];
            assert_eq!(read(&short).to_bits(), read(&whole).to_bits());
        }
    }
    // A horizon at a level needs no further level.
    short.forget(5.0, &mut spare);
    assert_eq!(times(&short), [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
    short.forget(100.0, &mut spare);
    assert_eq!(
        times(&short),
        [5.0, 6.0, 7.0, 8.0],
        "the last four levels are always kept"
    );
}

/// Levels after a discontinuity at t = 0, at which the steps double, and a memory with the time
/// constant `tau` of the stimulus `x` with the derivatives `slopes`. Its value is one at t = 0.
fn relaxing(tau: f64, slopes: [fn(f64) -> f64; 4]) -> (History, impl Fn(f64) -> f64) {
    let smooth = move |t: f64| slopes.iter().rfold(0.0, |sum, slope| slope(t) - tau * sum);
    let value = move |t: f64| smooth(t) + (1.0 - smooth(0.0)) * (-t / tau).exp();
    let times = [-1.0, 0.0, 0.0, 0.25, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0];
    (
        history(&times, value, move |t| (slopes[0](t) - value(t)) / tau),
        value,
    )
}

#[test]
fn memories_of_polynomials_are_read_exactly_after_a_discontinuity() {
    let zero = |_: f64| 0.0;
    // The forcing is linear in the two pieces after a discontinuity, and quadratic and cubic in the
    // next ones.
    let line = [|t: f64| 2.0 - t, |_| -1.0, zero, zero];
    let cubic = [
        |t: f64| t * t * t - t,
        |t: f64| 3.0 * t * t - 1.0,
        |t: f64| 6.0 * t,
        |_| 6.0,
    ];
    for tau in [0.02, 0.1, 0.5] {
        for (slopes, from) in [(line, 0.0), (cubic, 1.0)] {
            let (history, value) = relaxing(tau, slopes);
            for t in (0..200).map(|k| from + (5.0 - from) * (f64::from(k) + 0.5) / 200.0) {
                let read = history.read(&history.reading(t, tau), 0)[0];
                // The values reach 120, and rates multiply a rounding of 1e-16 by the ratio of
                // piece and time constant, up to 50.
                assert_abs_diff_eq!(read, value(t), epsilon = 6e-13);
            }
        }
    }
}

#[test]
fn a_new_level_extrapolates_the_variables_at_their_rates_and_keeps_rates_and_stimuli() {
    let (mut history, mut spare) = (history(&[0.0, 1.0], |t| 2.0 + t, |_| 3.0), Spare::new());
    history.push(1.5, 0, &mut spare);
    assert_eq!(
        (history.levels(), history.time(2), history.last_step()),
        (3, 1.5, 0.5)
    );
    for (point, factor) in [1.0, 2.0].into_iter().enumerate() {
        assert_eq!(history.present(point), Some(&[factor * 4.5][..]));
        assert_eq!(history.stimuli(2, point), [-factor * 3.0]);
        assert_eq!(history.at_mut(2, point).rates, [factor * 3.0]);
    }
    assert_eq!(history.present(2), None);
}

#[test]
fn smooth_levels_are_the_last_ones_since_a_discontinuity_that_are_apart() {
    let history = history(&[0.0, 1.0, 1.0, 2.0, 2.001, 3.0], |t| t, |_| 1.0);
    assert_eq!(history.smooth(ORDER, -1.0, 0.0)[..], [2, 3, 4, 5]);
    // The later one of two levels that are close to each other is returned.
    assert_eq!(history.smooth(ORDER, -1.0, 0.01)[..], [0, 2, 4, 5]);
    assert_eq!(
        history.smooth(ORDER, 1.0, 0.01)[..],
        [2, 4, 5],
        "no level from before the discontinuity"
    );
}

#[test]
fn passings_are_the_level_times_plus_the_delay() {
    let history = history(&[0.0, 1.0, 2.5], |t| t, |_| 1.0);
    assert_eq!(
        history.passings(0.5, 0.5, 3.5).collect::<Vec<_>>(),
        [1.5, 3.0]
    );
}

#[test]
fn each_step_visits_every_point_with_its_own_past_and_reports_the_first_failure() {
    // The rates are those of the variables at t = 1.
    let mut history = history(&[0.0, 1.0, 2.0], |t| t, |_| 1.0);
    let last_two = history.smooth(ORDER, 1.0, 0.0);
    assert_eq!(last_two[..], [1, 2]);
    let visited = history.each_step((&last_two, 0), |[before, slope], stimuli, now, rates| {
        let factor = before[0];
        assert_eq!(slope, [factor]);
        assert_eq!(
            (stimuli[0], stimuli[1]),
            (&[-factor][..], &[-2.0 * factor][..])
        );
        (now[0], rates[0]) = (10.0 * factor, 20.0 * factor);
        true
    });
    assert_eq!(visited, Ok(()));
    assert_eq!(
        (history.variables(2, 0), history.variables(2, 1)),
        (&[10.0][..], &[20.0][..])
    );
    assert_eq!(history.at_mut(2, 1).rates, [40.0]);
    assert_eq!(
        history.each_step((&last_two, 0), |[before, _], _, _, _| before[0] < 1.5),
        Err(1)
    );
    let mut visited = 0;
    let mut count = |_: [&[f64]; 2], _: &[&[f64]; LEVELS], now: &mut [f64], _: &mut [f64]| {
        visited += 1;
        now[0] == 20.0
    };
    assert_eq!(
        history.each_step((&last_two, 1), &mut count),
        Ok(()),
        "only the second point"
    );
    assert_eq!(visited, 1);
    assert_eq!(history.levels(), 3, "a failure loses no level");
}

#[test]
fn some_variables_of_several_points_are_read_as_those_of_each_point() {
    let history = history(&[0.0, 1.0, 2.5], |t| (1.0 + t).ln(), |t| 1.0 / (1.0 + t));
    let reading = history.reading(1.7, f64::INFINITY);
    let mut some = [7.0; 2];
    history.read_some(&reading, 0, &[], &mut some);
    assert_eq!(some, [7.0; 2], "no variable is read");
    history.read_some(&reading, 0, &[0], &mut some);
    assert_eq!(
        some.map(f64::to_bits),
        [0, 1].map(|point| read(&history, 1.7, point).to_bits())
    );
    let mut second = [0.0];
    history.read_some(&reading, 1, &[0], &mut second);
    assert_eq!(second[0], some[1]);
}

#[test]
fn points_that_leave_the_zone_are_dropped_at_every_level() {
    let mut short = history(&[0.0, 1.0], |t| 1.0 + t, |_| 1.0);
    let whole = short.clone();
    short.drain(1);
    assert_eq!(short.points(), 1);
    for level in 0..2 {
        assert_eq!(short.variables(level, 0), whole.variables(level, 1));
        assert_eq!(short.stimuli(level, 0), whole.stimuli(level, 1));
    }
}

#[test]
fn division_of_an_element_interpolates_its_points_and_moves_no_others() {
    // Elements of two points whose variable is the number of the point. Each part has the values at
    // a quarter and at three quarters of the element, in order.
    let mut history = History::zeros((1, 1), 6, [0.0, 1.0].into_iter());
    for level in 0..2 {
        (0..6).for_each(|point| history.at_mut(level, point).variables[0] = point as f64);
    }
    let mut part = [[0.0; MAX_POINTS]; MAX_POINTS];
    (part[0][..2]).copy_from_slice(&[0.75, 0.25]);
    (part[1][..2]).copy_from_slice(&[0.25, 0.75]);
    history.split(2, 2, &[part, part]);
    assert_eq!(history.points(), 8);
    for level in 0..2 {
        let values: Vec<f64> = (0..8)
            .map(|point| history.variables(level, point)[0])
            .collect();
        assert_eq!(values, [0.0, 1.0, 2.25, 2.75, 2.25, 2.75, 4.0, 5.0]);
    }
}
