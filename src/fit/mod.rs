//! Estimation of the parameters of a shoot from its tracked tip or centre lines.
//!
//! A [`Family`] is a function from parameters to a shoot. A [`Series`] contains data. [`Fit::run`]
//! searches for the parameters for which the simulated shoot is closest to the data. It returns
//! [`Estimates`] with standard errors, correlations, and a [`Verdict`] on each parameter: whether
//! these data, or any data of this kind, determine it.
//!
//! ```
//! use morphorod::fit::{Family, Fit, Parameter, Series};
//! # use morphorod::integrator::{Integrator, MethodOfSteps};
//! # use morphorod::tropism::Memory;
//! # use morphorod::{ShootParameters, Still};
//! // A weightless horizontal shoot of 5 cm that rises, with unknown sensitivities and delay.
//! let build = |p: &[f64]| {
//!     let memory = Memory { time: 720.0, delay: p[2] };
//!     let shoot = ShootParameters {
//!         length: 0.05,
//!         growth_time: 72e3,
//!         gravitropic_sensitivity: p[0],
//!         proprioceptive_sensitivity: p[1],
//!         gravitropic_memory: memory,
//!         proprioceptive_memory: memory,
//!         ..Default::default()
//!     };
//!     shoot.reduced().elements(4).load(()).scene(Still::tilted(1.57)).build()
//! };
//! # let mut plant = build(&[0.8, 20.0, 720.0])?;
//! # let mut table = String::new();
//! # let mut integrator = MethodOfSteps::new(300.0);
//! # for k in 1..=24 {
//! #     integrator.advance(&mut plant, 600.0 * f64::from(k))?;
//! #     let p = plant.tip();
//! #     table += &format!("{},{},{},{}\n", plant.time(), p.x, p.y, p.z);
//! # }
//! // `table` is a file of the times (s) and coordinates (m) of the tip: t,x,y,z.
//! let number = |text: &str| text.trim().parse::<f64>();
//! let rows: Vec<Vec<f64>> = table.lines().map(|l| l.split(',').map(number).collect()).collect::<Result<_, _>>()?;
//! let tips: Vec<_> = rows.iter().map(|row| nalgebra::Vector3::new(row[1], row[2], row[3])).collect();
//! let data = Series::tips(rows.iter().map(|row| row[0]).collect(), &tips).with_noise(1e-4);
//! let parameters = vec![
//!     Parameter::positive("beta", [0.1, 5.0]),
//!     Parameter::positive("eta", [2.0, 100.0]),
//!     Parameter::positive("delay", [100.0, 3000.0]),
//! ];
//! let found = Fit { step: 300.0, ..Fit::default() }.run(&Family { parameters, build }, &[data])?;
//! println!("{found}");
//! assert!((found.get("beta").expect("its name").value / 0.8 - 1.0).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Method
//!
//! The residuals are the differences of simulated and measured coordinates over their noise. A
//! point of a centre line has no known arc length; its residual is its distance from the simulated
//! line across the tangent. A bounded Levenberg–Marquardt search minimises the loss of the
//! residuals and of the priors: from several initial guesses in growing parts of the data, then
//! from the best one in all data, and again after each estimate of the noise. Jacobians are
//! difference quotients of runs that follow the [grid](crate::integrator::Grid) of one run. On a
//! fixed grid the simulated path is smooth in all parameters. Relative errors are below 1e-4 for
//! the one-sided quotients of the search, and below 1e-6 for the central ones of the standard
//! errors.
//!
//! Standard errors are those of the linearised problem. They account for outliers, with a robust
//! [`Loss`], and for the correlation of successive residuals.

// Order of the files for a reader: `run.rs` has the main loop. Its `guess` searches in growing
// parts of the data, and `last_search` in all data. Both call `search.rs` for a `Problem`, the
// residuals over the noise (`problem.rs`), which `residuals.rs` simulates and `jacobian.rs`
// differentiates. `answer.rs` assembles the estimates from the point that the last search has
// reached, with `noise.rs`, `confidence.rs` and `warning.rs`. `settings.rs`, `parameter.rs` and
// `series.rs` contain the input and its checks. `dependence.rs`, `profile.rs` and `scan.rs` are
// further methods of a `Fit`, which begin from estimates.

mod answer;
mod confidence;
mod dependence;
mod error;
mod estimate;
mod jacobian;
mod loss;
mod noise;
mod parameter;
mod problem;
mod profile;
mod residuals;
mod run;
mod scan;
mod search;
mod series;
mod settings;
mod warning;

pub use dependence::Dependence;
pub use error::FitError;
pub use estimate::{Estimate, Estimates, Verdict, WeakDirection};
pub use loss::Loss;
pub use parameter::{Family, Parameter};
pub use scan::{Scan, ScanLine};
pub use series::{Series, View};
pub use settings::Fit;
pub use warning::Warning;
