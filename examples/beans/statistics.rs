//! Medians, scatter and rank correlation.

/// Median; NaN without values.
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[middle],
        _ => 0.5 * (sorted[middle - 1] + sorted[middle]),
    }
}

/// Standard deviation of the decimal logarithms of positive values.
pub fn scatter(values: &[f64]) -> f64 {
    let logs = || values.iter().map(|value| value.log10());
    let mean = logs().sum::<f64>() / values.len() as f64;
    (logs().map(|log| (log - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

/// Spearman's rank correlation. Equal values have their mean rank.
pub fn rank_correlation(pairs: &[(f64, f64)]) -> f64 {
    let ranks = |value: fn(&(f64, f64)) -> f64| -> Vec<f64> {
        let rank = |x: f64| {
            let below = pairs.iter().filter(|pair| value(pair) < x).count() as f64;
            let equal = pairs.iter().filter(|pair| value(pair) == x).count() as f64;
            below + 0.5 * (equal - 1.0)
        };
        pairs.iter().map(|pair| rank(value(pair))).collect()
    };
    let (a, b) = (ranks(|pair| pair.0), ranks(|pair| pair.1));
    let mean = 0.5 * (pairs.len() as f64 - 1.0);
    let product = |a: &[f64], b: &[f64]| {
        a.iter()
            .zip(b)
            .map(|(x, y)| (x - mean) * (y - mean))
            .sum::<f64>()
    };
    product(&a, &b) / (product(&a, &a) * product(&b, &b)).sqrt()
}
