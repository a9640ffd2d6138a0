//! Readers of tracked centre lines, and their curvature along the arc.

use std::path::Path;

use morphorod::nalgebra::{Matrix4, Vector3, Vector4};

use super::tracks::{Layout, Row, TrackError, not_later, rows, text_of};

/// Range of the Gaussian weights in standard deviations. At its ends they are 4e-6.
const REACH: f64 = 5.0;

/// Number of coefficients of a cubic.
const LEAST: usize = 4;

/// Centre line at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct CentreLine {
    /// Time, s.
    pub time: f64,
    /// Points from the base to the tip, m.
    pub points: Vec<[f64; 3]>,
}

/// Curvature at a place of a centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvaturePlace {
    /// Arc length from the base along the smoothed line, m.
    pub arc_length: f64,
    /// Curvature binormal r' × r'', 1/m. For a line in the plane of an image the third component is
    /// the signed curvature, positive where the line turns counterclockwise from the base to the
    /// tip. The norm is the curvature in space.
    pub curvature: [f64; 3],
}

/// Reads the centre lines of a file: rows of the same time are points of one line, from the base to
/// the tip. If the table has a column of tracks, the lines of `track` are read.
pub fn read_centre_lines(
    file: impl AsRef<Path>,
    layout: &Layout,
    track: &str,
) -> Result<Vec<CentreLine>, TrackError> {
    centre_lines(&text_of(file.as_ref())?, layout, track)
}

/// Reads the centre lines of a table.
pub fn centre_lines(
    text: &str,
    layout: &Layout,
    track: &str,
) -> Result<Vec<CentreLine>, TrackError> {
    let mut found: Vec<CentreLine> = Vec::new();
    for row in rows(text, layout)?
        .into_iter()
        .filter(|row| row.track == track)
    {
        let Row {
            line,
            track,
            time,
            position,
            ..
        } = row;
        match found.last_mut() {
            Some(last) if last.time == time => last.points.push(position),
            Some(last) if time < last.time => {
                return Err(not_later(layout, line, track, [time, last.time]));
            }
            _ => found.push(CentreLine {
                time,
                points: vec![position],
            }),
        }
    }
    if found.is_empty() {
        Err(TrackError::Empty)
    } else {
        Ok(found)
    }
}

/// Curvature at each point of a centre line, by local cubic least squares. The weights of the
/// neighbouring points are a Gaussian with the standard deviation `width` (m) along the line.
///
/// Away from the ends a sinusoidal curvature of wavelength λ is multiplied by exp(−2π²
/// `width`²/λ²), which is 0.95 at λ = 20 `width`. Noise ε of the coordinates of points at distances
/// δ causes the noise ε (3 δ/(8 √π `width`⁵))^½ of the curvature there, and a few times more at the
/// ends. The result is `None` if fewer than four points are within the range of the weights, if
/// points coincide, or if the width is not positive.
pub fn curvature(points: &[[f64; 3]], width: f64) -> Option<Vec<CurvaturePlace>> {
    if !(width > 0.0 && width.is_finite()) {
        return None;
    }
    let points: Vec<Vector3<f64>> = points.iter().map(|p| Vector3::from(*p)).collect();
    // Noise lengthens the chords uniformly. The curvature does not depend on the parameter.
    let mut chords = vec![0.0];
    for pair in points.windows(2) {
        chords.push(chords[chords.len() - 1] + (pair[1] - pair[0]).norm());
    }
    let (mut found, mut arc_length, mut before): (Vec<CurvaturePlace>, f64, Option<(f64, f64)>) =
        (vec![], 0.0, None);
    for (i, u) in chords.iter().enumerate().take(points.len()) {
        let [first, second] = derivatives(&points, &chords, i, width)?;
        let speed = first.norm();
        if let Some((place, slower)) = before {
            arc_length += 0.5 * (speed + slower) * (u - place);
        }
        before = Some((*u, speed));
        let binormal = first.cross(&second) / speed.powi(3);
        if !binormal.iter().all(|x| x.is_finite()) {
            return None;
        }
        found.push(CurvaturePlace {
            arc_length,
            curvature: binormal.into(),
        });
    }
    Some(found)
}

/// First and second derivative with respect to the chord length of the cubic that fits the points
/// around a point.
fn derivatives(
    points: &[Vector3<f64>],
    chords: &[f64],
    i: usize,
    width: f64,
) -> Option<[Vector3<f64>; 2]> {
    let (mut moments, mut right) = ([0.0; 7], [Vector3::zeros(); 4]);
    let near = chords
        .iter()
        .zip(points)
        .filter(|(u, _)| (*u - chords[i]).abs() <= REACH * width);
    if near.clone().count() < LEAST {
        return None;
    }
    for (u, point) in near {
        let x = (u - chords[i]) / width;
        let mut term = (-0.5 * x * x).exp();
        for (k, moment) in moments.iter_mut().enumerate() {
            *moment += term;
            if let Some(right) = right.get_mut(k) {
                *right += (point - points[i]) * term;
            }
            term *= x;
        }
    }
    let factors = Matrix4::from_fn(|j, k| moments[j + k]).cholesky()?;
    let of = |row: Vector4<f64>| -> Vector3<f64> {
        right.iter().zip(row.iter()).map(|(r, x)| r * *x).sum()
    };
    Some([
        of(factors.solve(&Vector4::y())) / width,
        of(factors.solve(&Vector4::z())) * 2.0 / (width * width),
    ])
}
