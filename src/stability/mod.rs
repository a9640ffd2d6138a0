//! When does a shoot begin to oscillate? Stationary shoots, their characteristic roots, and where these cross the axis.
//!
//! A shoot is *stationary* when it is in mechanical equilibrium and its laws ask for no change of the intrinsic strain:
//! [`StationarySolver`] finds such a state. [`Linearisation`] is the linear problem of small disturbances δu* exp(λt)
//! about it, with whatever laws the shoot was built from and with the delays entering exactly:
//!
//! ```text
//! M(λ) δu* = 0,   M(λ) = λ − T(λ) X,   T = REGR [G_y exp(−λd) (λ − F_y)⁻¹ F_x + G_x].
//! ```
//!
//! X turns a disturbance of the intrinsic strain into that of the stimuli, by way of the equilibrium; F are the laws' rates
//! and G their gradients. All derivatives are differences of the laws' own functions; so one
//! written downstream is covered as it stands. [`onset`] finds where the rightmost root crosses the axis as a parameter
//! changes, [`crossings`] where any root does, and [`boundary`] follows a crossing in two parameters. [`Refinement`] has the same
//! to a tolerance, on meshes that it chooses; `with_error` tells the error of a mesh of one's own. Method, cost and
//! limits: [`guide::stability`](crate::guide::stability).
//!
//! At which length does an upright shoot begin to oscillate, and how fast?
//!
//! ```
//! use morphorod::Shoot;
//! use morphorod::constitutive::LinearElastic;
//! use morphorod::growth::{Ongoing, UniformGrowth};
//! use morphorod::load::Weight;
//! use morphorod::stability::{Linearisation, StabilityError, StationarySolver, Unstable, onset};
//! use morphorod::tropism::{Gravitropism, Memory, Proprioception, Response, SettledStatoliths};
//!
//! let memory = Memory { time: 720.0, delay: 720.0 };
//! // The linear problem of the shoot of a length (m). Its waves need more elements the longer it is.
//! let family = |length: f64| -> Result<Linearisation, StabilityError> {
//!     let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
//!         .length(length)
//!         .radius(0.5e-3)
//!         .elements(4)
//!         .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: 72e3 }))
//!         .tropism((
//!             Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(memory),
//!             Proprioception { sensitivity: 20.0 }.remembered(memory),
//!         ))
//!         .load(Weight { density: 1000.0 })
//!         .build()?;
//!     StationarySolver::default().solve(&mut shoot)?;
//!     Linearisation::about(&shoot)
//! };
//! assert_eq!(family(0.06)?.unstable()?, Unstable::Finite(0));
//! let found = onset(family, 0.06, 0.07)?;
//! assert!((found.parameter - 0.065614866).abs() < 1e-9, "m");
//! assert!((found.period() / 60.0 - 87.638359).abs() < 1e-5, "min");
//! let leading = family(0.067)?.rightmost()?;
//! assert!(leading.growth_rate() > 0.0 && leading.period() < 90.0 * 60.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod analytic;
mod bends;
mod block;
mod boundary;
mod count;
mod effort;
mod error;
mod follow;
mod inverse_transform;
mod linear;
mod linearisation;
mod mesh_error;
mod modes;
mod onset;
mod refine;
mod refine_boundary;
mod response;
mod roots;
mod sets;
mod short_waves;
mod spectrum;
mod stationary;
mod steady;
mod transfer;
mod transient;

pub(crate) use analytic::AnalyticMatrix;
pub(crate) use bends::visit_bends;
pub use boundary::{BoundaryPoint, BoundarySettings, boundary};
pub use error::StabilityError;
pub(crate) use linear::precise_solver;
pub use linearisation::{Linearisation, Unstable};
pub use modes::{Polarisation, Root};
pub use onset::{Onset, crossings, onset};
pub use refine::Refinement;
pub use refine_boundary::{RefinedBoundary, RefinedPoint};
pub use response::Response;
pub use stationary::{Stationary, StationarySolver};
pub(crate) use steady::{SteadyState, change_of_causes, check_steady, check_unforced, relative};
pub use transient::TransientGrowth;
