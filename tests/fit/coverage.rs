//! Share of intervals that contain the true value. With `MORPHOROD_CASES=200`, each kind of noise
//! has 200 draws. `--nocapture` prints the shares.

use super::plants::{NAMES, NOISE, TRUTH, family, tips};
use crate::fixtures::random::{Draw, number};
use approx::assert_abs_diff_eq;
use morphorod::fit::{Fit, Loss, Series};
use nalgebra::Vector3;

const FREE: [&str; 6] = ["beta", "eta", "tau_m", "tau_r", "E", "l_0"];

/// Smallest number of draws for which the test compares the shares.
const MANY: u64 = 100;

/// Fits draws of the tip of a righting shoot, and compares the share of intervals of 90 % that
/// contain the true value.
///
/// `noise` returns the noise of a frame and may change a state, which is zero before the first
/// frame. `lag_one` is the correlation of the noise in successive frames, and `within` the
/// tolerance of the share.
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
        let positions: Vec<_> = exact
            .iter()
            .map(|p| p + noise(&mut draw, &mut last))
            .collect();
        let data = [Series::tips(times.clone(), &positions)];
        let fit = Fit {
            step: 200.0,
            loss,
            starts: 1,
            windows: vec![1.0],
            ..Fit::default()
        };
        let found = fit.run(&family(&FREE, 1.1), &data).unwrap();
        correlation += found.lag_one / draws as f64;
        for name in FREE {
            let (estimate, k) = (
                found.get(name).unwrap(),
                NAMES.iter().position(|other| *other == name).unwrap(),
            );
            let [low, high] = estimate.interval();
            inside += f64::from(u8::from(low <= TRUTH[k] && TRUTH[k] <= high));
            let deviation = (estimate.value / TRUTH[k]).ln() / estimate.error;
            near += f64::from(u8::from(deviation.abs() <= 3.0));
            total += 1.0;
            // The probability of a larger normal deviation is 6e-7. Correlated noise and outliers
            // have longer tails.
            if draws < MANY {
                assert_abs_diff_eq!(deviation, 0.0, epsilon = 5.0);
            }
        }
    }
    // The tolerance is three standard errors of a correlation from three draws of 36 frames.
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
fn intervals_contain_the_truth_at_the_stated_rate_for_white_noise() {
    assert_coverage("white noise", Loss::Squares, (0.0, 0.05), |draw, _| {
        white(draw)
    });
}

#[test]
fn intervals_contain_the_truth_at_the_stated_rate_with_outliers() {
    assert_coverage(
        "outliers of 3 mm in 3 % of frames",
        Loss::ROBUST,
        (0.0, 0.05),
        |draw, _| {
            let outlier = if draw.chance(0.03) { 30.0 } else { 0.0 };
            white(draw) + white(draw) * outlier
        },
    );
}

#[test]
fn intervals_contain_the_truth_at_the_stated_rate_for_autoregressive_noise() {
    assert_coverage(
        "autoregressive noise, 0.8",
        Loss::Squares,
        (0.8, 0.05),
        |draw, last| {
            let first = *last == Vector3::zeros();
            *last = if first {
                white(draw)
            } else {
                *last * 0.8 + white(draw) * 0.6
            };
            *last
        },
    );
}

/// The noise is the sum of a slow drift of the camera and of white noise. It is not an
/// autoregressive process of first order.
#[test]
fn intervals_contain_the_truth_at_the_stated_rate_for_the_sum_of_drift_and_white_noise() {
    let part = 0.5_f64.sqrt();
    // The drift has half of the variance, and successive values have a correlation of 0.95. The
    // correlation time of 20 frames is more than half of the record. Its estimate is therefore
    // uncertain.
    assert_coverage(
        "white noise and a drift",
        Loss::Squares,
        (0.475, 0.1),
        |draw, last| {
            let first = *last == Vector3::zeros();
            *last = if first {
                white(draw)
            } else {
                *last * 0.95 + white(draw) * (1.0 - 0.95_f64.powi(2)).sqrt()
            };
            (*last + white(draw)) * part
        },
    );
}
