//! Growing (morphoelastic) rods in three dimensions: plant shoots that elongate, bend by delayed
//! responses to gravity and to their own curvature, stiffen with age, sag under their weight and
//! nutate.
//!
//! The model is that of Agostinelli, DeSimone and Noselli, *Nutations in Plant Shoots: Endogenous
//! and Exogenous Factors in the Presence of Mechanical Deformations*, Front. Plant Sci. 12:608005
//! (2021), doi 10.3389/fpls.2021.608005. Equation numbers refer to this paper. Each part of the
//! model is a law behind a small trait. A shoot combines six laws, provided by the crate or written
//! by you: growth, tropism, elasticity, load, scene and support.
//!
//! # A shoot that rights itself
//!
//! A shoot of constant length with a horizontal base bends upwards by gravitropism. Proprioception
//! limits its curvature. [`ShootParameters`] has the parameters of the paper and builds its shoots;
//! the README combines single laws.
//!
//! ```
//! use morphorod::integrator::{Integrator, MethodOfSteps};
//! use morphorod::{ShootParameters, Still};
//!
//! let parameters = ShootParameters { length: 0.05, growth_time: 72e3, ..Default::default() };
//! let base = Still::tilted(std::f64::consts::FRAC_PI_2);
//! let mut shoot = parameters.reduced().scene(base).build()?;
//!
//! let statistics = MethodOfSteps::new(180.0).advance(&mut shoot, 24.0 * 3600.0)?;
//! // The steady state is known in closed form: the tip is 19.177114 mm beside the base and 41.339853 mm above it.
//! assert!((shoot.tip().z - 0.041339853).abs() < 2e-8);
//! assert_eq!(statistics.steps, 486);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # An equilibrium without growth
//!
//! A rod, an elastic law, a load and a solver suffice. Here a horizontal rod sags under its weight.
//!
//! ```
//! use morphorod::constitutive::LinearElastic;
//! use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
//! use morphorod::load::Weight;
//! use morphorod::rod::Rod;
//! use morphorod::{Order, Scene, Still};
//!
//! let scene = Still::tilted(std::f64::consts::FRAC_PI_2);
//! let mut rod = Rod::uniform(0.0659, 0.5e-3, scene.base, 8, Order::Eight)?;
//! let tissue = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
//! let found = NewtonSolver::default().solve(&mut rod, &tissue, &Weight { density: 1000.0 }, &scene.environment(0.0))?;
//! assert!((rod.tip().z + 0.030426176325).abs() < 1e-11);
//! assert_eq!(found.inertia.negative, 0, "stable");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What is inside
//!
//! | module | content |
//! |---|---|
//! | [`rod`] | the discretised rod: material points, frames, shape |
//! | [`growth`] | elongation of the tissue: [`GrowthLaw`](growth::GrowthLaw) |
//! | [`tropism`] | differential growth in response to stimuli: [`TropismLaw`](tropism::TropismLaw) |
//! | [`constitutive`] | elasticity: [`Constitutive`](constitutive::Constitutive) |
//! | [`load`] | weight and other forces: [`Load`](load::Load) |
//! | [`support`] | holds, springs, joints and obstacles: [`Support`](support::Support) |
//! | [`equilibrium`] | equilibria of a rod: [`EquilibriumSolver`](equilibrium::EquilibriumSolver) |
//! | [`check`] | whether the methods of a law of your own agree with each other |
//! | [`profile`] | strain, force, couple and growth rate at any place along a rod |
//! | [`integrator`] | integration in time: [`Integrator`](integrator::Integrator) |
//! | [`stability`] | steady states, characteristic roots, onset of oscillations |
//! | [`cycle`] | periodic orbits and rotating waves, their stability and bifurcations |
//! | [`ensemble`] | many shoots on threads and in job arrays: [`run`](ensemble::run) |
//! | [`fit`] | estimation of parameters from tracked tips and centre lines |
//! | [`tracking`] | analysis of measured or simulated tip tracks: periods, ellipses, directions |
//! | [`guide`] | [recipes](guide::recipes), the [method](guide::method), and further chapters; among them |
//! | | [light, touch, memory kernels](guide::laws), [own laws](guide::own_laws) and |
//! | | [own methods](guide::own_methods) |
//!
//! A [`Shoot`] has a state and a [`Model`], its six laws as one type; [`Laws`] is the usual one. A
//! [`Scene`] is gravity and the base as functions of time.
//!
//! # Features
//!
//! With the feature `serde`, which is off by default, [`State`], [`Rod`](rod::Rod) and the laws,
//! loads and scenes of the crate implement `Serialize` and `Deserialize`, and there is a module
//! `checkpoint`.
//!
//! A [`State`] that is written and read is equal bit for bit if the format keeps every bit of a
//! number, as binary formats do. `serde_json` requires its feature `float_roundtrip` for this.
//!
//! # Units and axes
//!
//! All quantities are in SI units, and angles in radians. Vectors are in a fixed frame {e1, e2, e3}
//! unless stated as "along the directors". e3 points up, and an upright base has d1 = e1, d2 = e2,
//! d3 = e3. The director d3 is the tangent, from base to apex. Strains are right-handed: positive
//! u2 bends the rod towards d1, negative u1 towards d2, and positive u3 twists d1 towards d2.

#![forbid(unsafe_code)]

pub mod check;
#[cfg(feature = "serde")]
pub mod checkpoint;
mod compositions;
pub mod constitutive;
pub mod cycle;
pub mod ensemble;
pub mod equilibrium;
mod error;
pub mod fit;
pub mod growth;
pub mod guide;
pub mod integrator;
mod linearisation;
pub mod load;
mod model;
mod numerics;
mod pointers;
pub mod profile;
mod reference_element;
pub mod rod;
mod scene;
mod section;
mod sensing;
mod shoot;
mod so3;
pub mod stability;
mod state;
pub mod support;
pub mod tracking;
pub mod tropism;

pub use error::ParameterError;
pub use model::{DynLaws, Laws, Model};
pub use nalgebra;
pub use reference_element::Order;
pub use scene::{Along, Environment, Scene, Still, Turned};
pub use section::Section;
pub use shoot::{Energies, FullModel, ReducedModel, Shoot, ShootBuilder, ShootParameters};
pub use state::{State, StateError};

/// The programs of the README, compiled and run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
