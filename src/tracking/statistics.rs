//! Medians and quantiles, and a significance threshold.

/// Significance threshold: an estimate over its standard error. Normal noise exceeds it in one case
/// of 370.
pub(super) const SIGNIFICANT: f64 = 3.0;
/// Probability with which white noise alone is taken for an oscillation, or for nutation. The
/// probability is larger for noise that is correlated over a large part of a track.
pub(super) const FALSE_ALARM: f64 = 1e-4;
/// Median of a gamma distribution of shape 2, the solution of (1 + u) e⁻ᵘ = 1/2.
pub(super) const GAMMA_MEDIAN: f64 = 1.678_346_990_016_660_7;

/// Smallest number of positions that are analysed, and of frequencies from which the noise floor is
/// estimated. Eight positions are 16 data for the 13 unknowns of a cubic drift and a wave; the
/// median of eight powers has a standard error of about a third.
pub(super) const LEAST: usize = 8;

/// The median of values; for an even number the larger of the two in the middle, and zero for none.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() {
        0.0
    } else {
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}

/// The values for which `used` is true.
pub(super) fn chosen<T: Copy>(values: &[T], used: &[bool]) -> Vec<T> {
    values
        .iter()
        .zip(used)
        .filter(|(_, used)| **used)
        .map(|(value, _)| *value)
        .collect()
}

/// Standard deviation of a normal distribution over its median absolute deviation.
const MAD: f64 = 1.482_602_218_505_602;

/// Standard deviation of normal numbers of mean zero from the median of their sizes, which few
/// outliers hardly change.
pub(crate) fn robust_deviation(values: impl Iterator<Item = f64>) -> f64 {
    MAD * median(values.map(f64::abs).collect())
}

/// Root mean square of some values; zero for none.
pub(crate) fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Normal deviate of χ² with given degrees of freedom that is a `ratio` times its mean: its cube
/// root is almost normal (E. B. Wilson and M. M. Hilferty, Proc. Natl. Acad. Sci. 17, 684, 1931).
pub(crate) fn normal_deviate(ratio: f64, freedom: f64) -> f64 {
    let variance = 2.0 / (9.0 * freedom);
    (ratio.cbrt() - (1.0 - variance)) / variance.sqrt()
}

/// The median sampling interval.
pub(crate) fn median_gap(times: &[f64]) -> f64 {
    median(times.windows(2).map(|w| w[1] - w[0]).collect())
}

/// Interval that determines the resolved frequencies: the median interval, or a quarter of the mean
/// one if this is longer, as for positions in pairs or bursts.
pub(super) fn resolved_interval(times: &[f64]) -> f64 {
    let duration = times
        .last()
        .zip(times.first())
        .map_or(0.0, |(last, first)| last - first);
    median_gap(times).max(0.25 * duration / times.len().max(1) as f64)
}

/// The quantile of sorted values for a probability, linear between neighbours; zero for no values.
pub(super) fn quantile(sorted: &[f64], probability: f64) -> f64 {
    let place = probability * sorted.len().saturating_sub(1) as f64;
    let (lower, upper) = (place.floor() as usize, place.ceil() as usize);
    match (sorted.get(lower), sorted.get(upper)) {
        (Some(a), Some(b)) => a + (b - a) * place.fract(),
        _ => 0.0,
    }
}
