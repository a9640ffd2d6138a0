//! Figures, films, files for three-dimensional rendering, tables and progress bars for runs of
//! `morphorod`.
//!
//! A run collects plain numbers, and one more line draws each figure:
//!
//! ```no_run
//! use morphorod::integrator::{Integrator, MethodOfSteps};
//! use morphorod::{Shoot, constitutive::LinearElastic, growth::UniformGrowth};
//! use morphorod_plot::Figure;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let stem = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
//! # let growth = UniformGrowth { zone_length: 0.04, time: 72e3 };
//! # let mut shoot = Shoot::builder(stem).length(0.03).radius(0.5e-3).growth(growth).build()?;
//! let (mut path, mut shapes, mut bending, mut states) = (vec![], vec![], vec![], vec![]);
//! let times = (1..=300).map(|k| 120.0 * f64::from(k));
//! MethodOfSteps::new(120.0).advance_showing(&mut shoot, 36e3, times, |shoot| {
//!     path.push((shoot.time(), shoot.tip()));
//!     shapes.push((shoot.time(), shoot.rod().centre_line_at(50)));
//!     let curvature = shoot.profile().sample(50).into_iter().map(|at| (at.arc_length, at.strain.norm()));
//!     bending.push((shoot.time(), curvature.collect()));
//!     states.push((shoot.time(), 1e3 * shoot.tip().x, 1e3 * shoot.tip().z));
//! })?;
//! Figure::new("tip.svg", "Path of the tip").path(&path, &[])?;
//! Figure::new("shapes.svg", "Shapes").width(170.0).font_size(8.0).shapes(&shapes)?; // mm and points
//! Figure::new("curvature.svg", "").profiles("curvature (1/m)", &bending)?; // no title
//! Figure::new("phase.svg", "").phase(["x (mm)", "z (mm)"], &states)?;
//! # Ok(())
//! # }
//! ```
//!
//! The feature `png` permits file names that end with `.png`. [`Figure::lines`],
//! [`Figure::panels`], [`Figure::strips`] and [`Figure::map`] draw any other numbers. [`Film`]
//! collects a [`Frame`] for each time and writes a page that plays in a browser; [`VtkSeries`] and
//! [`write_tube`] write files for `ParaView` and Blender.
//!
//! For a browser (`wasm32`) the package has neither figures nor progress bars.

pub mod centre_lines;
#[cfg(not(target_family = "wasm"))]
pub mod figure;
pub mod file;
pub mod film;
pub mod options;
pub mod output;
#[cfg(not(target_family = "wasm"))]
pub mod progress;
pub mod render;
pub mod table;
pub mod track_options;
pub mod tracks;

#[cfg(not(target_family = "wasm"))]
pub use figure::{
    Axes, Figure, FramedPanel, FramedShape, Map, Orbit, Series, Strip, Style, TimedPath,
};
pub use film::{Film, Frame};
pub use options::{Opt, Options};
pub use output::finish;
#[cfg(not(target_family = "wasm"))]
pub use progress::Progress;
pub use render::{Station, VtkSeries, stations, write_tube};
pub use table::Table;
