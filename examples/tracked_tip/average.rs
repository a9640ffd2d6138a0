//! Moving average of tracked positions.

use nalgebra::Vector2;

/// Returns the means of `count` consecutive positions. Positions on both sides of an interval
/// longer than `gap` (s) have no common mean: each part of the track between such gaps has a line of
/// its own, and parts with fewer positions have none.
pub fn moving_average(
    times: &[f64],
    positions: &[Vector2<f64>],
    count: usize,
    gap: f64,
) -> Vec<Vec<Vector2<f64>>> {
    let mut parts: Vec<Vec<Vector2<f64>>> = Vec::new();
    for (k, position) in positions.iter().enumerate() {
        match parts.last_mut() {
            Some(part) if times[k] - times[k - 1] <= gap => part.push(*position),
            _ => parts.push(vec![*position]),
        }
    }
    let mean = |window: &[Vector2<f64>]| window.iter().sum::<Vector2<f64>>() / count as f64;
    parts
        .iter()
        .map(|part| part.windows(count).map(mean).collect())
        .filter(|line: &Vec<_>| !line.is_empty())
        .collect()
}
