//! Chapters: recipes, laws and methods of your own, and the method with its accuracy, run time and limits.

/// Short programs: reading, stopping, changing and varying shoots, and many shoots at once.
#[doc = include_str!("../docs/recipes.md")]
pub mod recipes {}

/// Writing a state to a file, and continuing from it.
// The program of this chapter needs a serialisation format. It runs as one of the tests.
#[cfg_attr(not(doctest), doc = include_str!("../docs/saving.md"))]
pub mod saving {}

/// Writing a growth profile, a tropism and an elastic law.
#[doc = include_str!("../docs/own-laws.md")]
#[doc = concat!(
    "<figure style=\"margin: 0\"><style>figure svg { width: 100%; height: auto }</style>\n",
    include_str!("../docs/pictures/own_law.svg"),
    "</figure>"
)]
pub mod own_laws {}

/// Writing a solver of equilibria and an integrator.
#[doc = include_str!("../docs/own-methods.md")]
#[doc = concat!(
    "<figure style=\"margin: 0\"><style>figure svg { width: 100%; height: auto }</style>\n",
    include_str!("../docs/pictures/own_solver.svg"),
    "</figure>"
)]
pub mod own_methods {}

/// Equations, discretisation and limits of the method.
#[doc = include_str!("../docs/method.md")]
pub mod method {}

/// Holds, springs, joints, obstacles and friction, their reactions, and the method.
#[doc = include_str!("../docs/supports.md")]
pub mod supports {}

/// Parameters of a shoot from data: identifiability, experimental design, and the test for an oscillator.
#[doc = include_str!("../docs/fit.md")]
pub mod fit {}

/// Steady states, characteristic roots and onsets of oscillations, and their limits.
#[doc = include_str!("../docs/stability.md")]
#[doc = concat!(
    "<figure style=\"margin: 0\"><style>figure svg { width: 100%; height: auto }</style>\n",
    include_str!("../docs/pictures/stability_map.svg"),
    "</figure>"
)]
pub mod stability {}

/// Periodic orbits, their stability and their bifurcations.
#[doc = include_str!("../docs/cycles.md")]
#[doc = concat!(
    "<figure style=\"margin: 0\"><style>figure svg { width: 100%; height: auto }</style>\n",
    include_str!("../docs/pictures/bifurcation.svg"),
    "</figure>"
)]
pub mod cycles {}

/// Meaning of the tolerances, reliability of the error estimates, and tables of error against run time.
#[doc = include_str!("../docs/accuracy.md")]
#[doc = concat!(
    "<figure style=\"margin: 0\"><style>figure svg { width: 100%; height: auto }</style>\n",
    include_str!("../docs/pictures/work_precision.svg"),
    "</figure>"
)]
pub mod accuracy {}

/// Run time of a time step by its parts, lower bounds, and optimisations with their effect.
#[doc = include_str!("../docs/performance.md")]
pub mod performance {}

/// Results at extreme parameters.
#[doc = include_str!("../docs/extremes.md")]
pub mod extremes {}
