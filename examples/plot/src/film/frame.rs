//! Frames of a film.

use morphorod::nalgebra::Vector3;
use morphorod::{Model, Shoot};

/// Number of points of the centre line in a frame.
const LINE: usize = 41;
/// Number of positions with directors.
const STATIONS: usize = 6;
/// Number of positions with statoliths in the growth zone.
const PILES: usize = 5;

/// A shoot at one time. Positions (m) and unit vectors are in the fixed frame.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// Time, s.
    pub time: f64,
    /// Length, m.
    pub length: f64,
    /// Arc length of the lower end of the growth zone, relative to the length.
    pub zone: f64,
    /// Equally spaced points of the centre line from base to apex.
    pub line: Vec<[f64; 3]>,
    /// Positions with the directors d1 and d2.
    pub directors: Vec<[[f64; 3]; 3]>,
    /// Positions in the growth zone with the normal h of the pile of statoliths.
    pub piles: Vec<[[f64; 3]; 2]>,
}

impl Frame {
    /// Returns the frame of a shoot. `statoliths` is the index of the first variable of h, or
    /// `None` if the laws have no such variable. It is 0 if
    /// [`Statoliths`](morphorod::tropism::Statoliths) are the first law with variables.
    pub fn of(shoot: &Shoot<impl Model>, statoliths: Option<usize>) -> Self {
        let rod = shoot.rod();
        let (length, zone) = (rod.length(), rod.growth_zone());
        let directors = (1..=STATIONS).filter_map(|i| {
            let (at, frame) = rod.at(length * i as f64 / (STATIONS + 1) as f64)?;
            let [d1, d2] = [Vector3::x(), Vector3::y()].map(|axis| (frame * axis).into());
            Some([at.into(), d1, d2])
        });
        let piles = (0..PILES).filter_map(|i| {
            let first = statoliths?;
            let s = zone.start + (zone.end - zone.start) * (i as f64 + 0.5) / PILES as f64;
            let (at, frame) = rod.at(s)?;
            Some([at.into(), (frame * pile(shoot, length - s, first)?).into()])
        });
        Self {
            time: shoot.time(),
            length,
            zone: zone.start / length,
            line: rod
                .centre_line_at(LINE)
                .into_iter()
                .map(Into::into)
                .collect(),
            directors: directors.collect(),
            piles: piles.collect(),
        }
    }
}

/// Returns the components of h along the directors at a distance (m) from the apex, interpolated
/// between material points.
fn pile(shoot: &Shoot<impl Model>, distance: f64, first: usize) -> Option<Vector3<f64>> {
    let points = shoot.rod().points();
    let h = |i: usize| {
        Some(Vector3::from_column_slice(
            shoot.state().variables(i)?.get(first..first + 3)?,
        ))
    };
    let beyond = points
        .partition_point(|point| point.apex_distance > distance)
        .min(points.len() - 1);
    let Some(before) = beyond.checked_sub(1).filter(|i| h(*i).is_some()) else {
        return h(beyond);
    };
    let (from, to) = (points[before].apex_distance, points[beyond].apex_distance);
    let share = ((from - distance) / (from - to)).clamp(0.0, 1.0);
    h(before)?.lerp(&h(beyond)?, share).try_normalize(0.0)
}
