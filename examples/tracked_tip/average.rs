//! Moving average of a tracked tip.

use morphorod::tracking::Track;

/// Returns the moving average over `count` positions of each part of a track between intervals
/// longer than `gap` (s). Parts with fewer positions have none.
pub fn moving_average(track: &Track, count: usize, gap: f64) -> Vec<Track> {
    track
        .times()
        .chunk_by(|earlier, later| later - earlier <= gap)
        .filter_map(|part| {
            let part = track.between(part[0], part[part.len() - 1]);
            part.moving_average(count).ok()
        })
        .collect()
}
