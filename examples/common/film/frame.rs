//! What a film shows at one time.

/// A shoot at one time. Positions are in m, in the fixed frame; directions are unit vectors.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// Time, s.
    pub time: f64,
    /// Length, m.
    pub length: f64,
    /// Arc length where the growth zone begins, as a part of the length.
    pub zone: f64,
    /// Points of the centre line, equally spaced from base to apex.
    pub line: Vec<[f64; 3]>,
    /// Places with their directors d1 and d2.
    pub directors: Vec<[[f64; 3]; 3]>,
    /// Places in the growth zone with the normal h of their statoliths.
    pub piles: Vec<[[f64; 3]; 2]>,
}
