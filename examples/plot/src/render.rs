//! Files for three-dimensional rendering: VTK polydata with a time series, and a tube as Wavefront
//! OBJ.
//!
//! `ParaView` and `PyVista` read VTK files, and Blender reads OBJ files. Both are short text
//! formats, so that no crate is needed for them. Their specifications are *VTK File Formats*
//! (Kitware) and *Object Files (.obj)* (Wavefront, 1995).

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use morphorod::nalgebra::Vector3;
use morphorod::profile::Place;
use morphorod::{Model, Shoot};

use super::file::write_whole;

/// Number of vertices around a tube.
const SIDES: usize = 16;

/// Cross-section of a shoot. Vectors are in the fixed frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station {
    /// Position of the centre line, m.
    pub position: [f64; 3],
    /// Directors d1, d2, d3; unit vectors.
    pub directors: [[f64; 3]; 3],
    /// Semi-axes of the section along d1 and d2, m.
    pub semi_axes: [f64; 2],
}

/// Returns equally spaced cross-sections from base to apex, for three-dimensional rendering.
pub fn stations(shoot: &Shoot<impl Model>, count: usize) -> Vec<Station> {
    let section = |place: Place| Station {
        position: place.position.into(),
        directors: [Vector3::x(), Vector3::y(), Vector3::z()]
            .map(|axis| (place.frame * axis).into()),
        semi_axes: [place.tissue.section.along_d1, place.tissue.section.along_d2],
    };
    shoot
        .profile()
        .sample(count)
        .into_iter()
        .map(section)
        .collect()
}

/// Time series of shapes: a polyline (`.vtp`) and a tube (`.obj`) for each time, and `shoot.pvd`,
/// which lists the polylines.
#[derive(Debug)]
pub struct VtkSeries {
    folder: PathBuf,
    /// Time between two shapes, s.
    interval: f64,
    /// Times (s) and file names.
    files: Vec<(f64, String)>,
}

impl VtkSeries {
    /// Creates the folder of a series with a shape after each interval (s).
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn create(folder: impl Into<PathBuf>, interval: f64) -> io::Result<Self> {
        let folder = folder.into();
        std::fs::create_dir_all(&folder)?;
        Ok(Self {
            folder,
            interval,
            files: Vec::new(),
        })
    }

    /// Writes the shape at a time (s) and updates the list, if no shape of this interval was
    /// written before.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn push(&mut self, time: f64, shape: impl FnOnce() -> Vec<Station>) -> io::Result<()> {
        // Times that are multiples of the interval up to rounding belong to the later interval.
        let number = |time: f64| (time / self.interval + 1e-9).floor();
        if self
            .files
            .last()
            .is_some_and(|(last, _)| number(*last) == number(time))
        {
            return Ok(());
        }
        let (shape, name) = (shape(), format!("shoot_{:04}", self.files.len()));
        write_tube(self.folder.join(format!("{name}.obj")), &shape)?;
        write_whole(&self.folder.join(format!("{name}.vtp")), polydata(&shape))?;
        self.files.push((time, format!("{name}.vtp")));
        write_whole(&self.folder.join("shoot.pvd"), self.collection())
    }

    fn collection(&self) -> String {
        let mut text = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n",
        );
        for (time, name) in &self.files {
            let _ = writeln!(
                text,
                "<DataSet timestep=\"{time}\" part=\"0\" file=\"{name}\"/>"
            );
        }
        text + "</Collection>\n</VTKFile>\n"
    }
}

/// Returns a polyline with the semi-axes and the directors at its points.
fn polydata(stations: &[Station]) -> String {
    let n = stations.len();
    let semi_axes = stations.iter().flat_map(|station| station.semi_axes);
    let director = |k: usize| {
        stations
            .iter()
            .flat_map(move |station| station.directors[k])
    };
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">\n",
    );
    let _ = writeln!(
        text,
        "<PolyData>\n<Piece NumberOfPoints=\"{n}\" NumberOfVerts=\"0\" NumberOfLines=\"1\" \
         NumberOfStrips=\"0\" NumberOfPolys=\"0\">"
    );
    text += "<Points>\n";
    array(
        &mut text,
        "Float64",
        "position_m",
        3,
        stations.iter().flat_map(|station| station.position),
    );
    text += "</Points>\n<Lines>\n";
    array(&mut text, "Int64", "connectivity", 1, 0..n);
    array(&mut text, "Int64", "offsets", 1, [n]);
    text += "</Lines>\n<PointData Scalars=\"radius_m\">\n";
    array(
        &mut text,
        "Float64",
        "radius_m",
        1,
        stations.iter().map(|station| radius(station.semi_axes)),
    );
    array(&mut text, "Float64", "semi_axes_m", 2, semi_axes);
    for (k, name) in ["d1", "d2", "d3"].into_iter().enumerate() {
        array(&mut text, "Float64", name, 3, director(k));
    }
    text + "</PointData>\n</Piece>\n</PolyData>\n</VTKFile>\n"
}

fn array(
    text: &mut String,
    kind: &str,
    name: &str,
    width: usize,
    values: impl IntoIterator<Item = impl std::fmt::Display>,
) {
    let _ = writeln!(
        text,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{width}\" format=\"ascii\">"
    );
    for value in values {
        let _ = write!(text, "{value} ");
    }
    text.push_str("\n</DataArray>\n");
}

/// Returns the radius of the circle with the area of a section, m.
fn radius([a, b]: [f64; 2]) -> f64 {
    (a * b).sqrt()
}

/// Writes the surface of a shoot as a closed tube.
///
/// # Errors
/// Errors of the file system.
pub fn write_tube(file: impl AsRef<Path>, stations: &[Station]) -> io::Result<()> {
    write_whole(file.as_ref(), tube(stations))
}

/// Returns vertices in metres, quadrilaterals with outward normals, and one polygon at each end.
fn tube(stations: &[Station]) -> String {
    let mut text = String::from("# lengths in metres\no shoot\n");
    for Station {
        position,
        directors: [d1, d2, _],
        semi_axes: [a, b],
    } in stations
    {
        for side in 0..SIDES {
            let (sin, cos) = (TAU * side as f64 / SIDES as f64).sin_cos();
            let [x, y, z] = [0, 1, 2].map(|i| position[i] + a * cos * d1[i] + b * sin * d2[i]);
            let _ = writeln!(text, "v {x} {y} {z}");
        }
    }
    // Vertices are numbered from one.
    let vertex = |ring: usize, side: usize| 1 + ring * SIDES + side % SIDES;
    for ring in 1..stations.len() {
        for side in 0..SIDES {
            let [a, b] = [side, side + 1].map(|side| vertex(ring - 1, side));
            let [c, d] = [side + 1, side].map(|side| vertex(ring, side));
            let _ = writeln!(text, "f {a} {b} {c} {d}");
        }
    }
    for (ring, reversed) in [(0, true), (stations.len().saturating_sub(1), false)] {
        text.push('f');
        for side in 0..SIDES {
            let side = if reversed { SIDES - 1 - side } else { side };
            let _ = write!(text, " {}", vertex(ring, side));
        }
        text.push('\n');
    }
    text
}
