//! Share of intervals that contain the true value. `MORPHOROD_CASES=200` draws as many data sets for each kind of
//! noise, and `--nocapture` prints the shares.

use super::plants::{NAMES, NOISE, TRUTH, family, tips};
use crate::fixtures::random::{Draw, number};
use approx::assert_abs_diff_eq;
use morphorod::fit::{Fit, Loss, Series};
use nalgebra::Vector3;

const FREE: [&str; 6] = ["beta", "eta", "tau_m", "tau_r", "E", "l_0"];

/// Number of draws from which on the shares are compared.
const MANY: u64 = 100;

/// Fits draws of the tip of a righting shoot. `noise` returns that of a frame from the last one.
///
/// `lag_one` is the correlation of the noise of successive frames, and `within` the asked accuracy of the share.
fn assert_coverage(
    what: &str,
    loss: Loss,
    (lag_one, within): (f64, f64),
    mut noise: impl FnMut(&mut Draw, &mut Vector3<f64>) -> Vector3<f64>,
) {
    let (times, exact) = tips(0.0, 0);
    let (mut inside, mut near, mut total, mut correlation) = (0.0, 0.0, 0.0, 0.0);
    let draws = number("MORPHOROD_CASES", 3);
    for seed in 0..draws {
        let (mut draw, mut last) = (Draw::new(1000 + seed), Vector3::zeros());
        let positions: Vec<_> = exact.iter().map(|p| p + noise(&mut draw, &mut last)).collect();
        let data = [Series::tips(times.clone(), &positions)];
        let fit = Fit { step: 200.0, loss, windows: vec![1.0], ..Fit::default() };
        let found = fit.run(&family(&FREE, 1.1), &data).unwrap();
        correlation += found.lag_one / draws as f64;
        for name in FREE {
            let (estimate, k) = (found.get(name).unwrap(), NAMES.iter().position(|other| *other == name).unwrap());
            let [low, high] = estimate.interval();
            inside += f64::from(u8::from(low <= TRUTH[k] && TRUTH[k] <= high));
            let deviation = (estimate.value / TRUTH[k]).ln() / estimate.error;
            near += f64::from(u8::from(deviation.abs() <= 3.0));
            total += 1.0;
            // One of 1e4 normal draws is farther, and those of correlated noise or outliers have longer tails.
            if draws < MANY {
                assert_abs_diff_eq!(deviation, 0.0, epsilon = 5.0);
            }
        }
    }
    // Three standard errors of a correlation from three times 36 frames.
    assert_abs_diff_eq!(correlation, lag_one, epsilon = 0.3);
    println!(
        "{what}: {:.1} % inside, {:.2} % within three standard errors",
        100.0 * inside / total,
        100.0 * near / total
    );
    if draws >= MANY {
        // The standard error of the share of 200 draws is 1 %.
        assert_abs_diff_eq!(inside / total, 0.9, epsilon = within);
    }
}

/// Normal noise in each coordinate, m.
fn white(draw: &mut Draw) -> Vector3<f64> {
    Vector3::from_fn(|_, _| NOISE * draw.normal().x)
}

#[test]
fn intervals_contain_the_truth_as_often_as_they_say_for_white_noise() {
    assert_coverage("white noise", Loss::Squares, (0.0, 0.05), |draw, _| white(draw));
}

#[test]
fn intervals_contain_the_truth_as_often_as_they_say_with_outliers() {
    assert_coverage("outliers of 3 mm in 3 % of frames", Loss::ROBUST, (0.0, 0.05), |draw, _| {
        let outlier = if draw.chance(0.03) { 30.0 } else { 0.0 };
        white(draw) + white(draw) * outlier
    });
}

#[test]
fn intervals_contain_the_truth_as_often_as_they_say_for_autoregressive_noise() {
    assert_coverage("autoregressive noise, 0.8", Loss::Squares, (0.8, 0.05), |draw, last| {
        let first = *last == Vector3::zeros();
        *last = if first { white(draw) } else { *last * 0.8 + white(draw) * 0.6 };
        *last
    });
}

/// A slow drift of the camera under the noise of single frames: no autoregressive process of first order.
#[test]
fn intervals_contain_the_truth_as_often_as_they_say_for_a_drift_below_white_noise() {
    let part = 0.5_f64.sqrt();
    // The drift has half of the variance, and successive values have a correlation of 0.95. The correlation time, 20
    // frames, is more than half of the record, so that its estimate is uncertain.
    assert_coverage("white noise and a drift", Loss::Squares, (0.475, 0.1), |draw, last| {
        let first = *last == Vector3::zeros();
        *last = if first { white(draw) } else { *last * 0.95 + white(draw) * (1.0 - 0.95_f64.powi(2)).sqrt() };
        (*last + white(draw)) * part
    });
}
