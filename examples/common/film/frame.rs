//! Frames of a film.

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
