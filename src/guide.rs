//! Chapters: recipes, laws and methods of your own, and the method with its accuracy, run time and
//! limits.

// The chapters end with definitions of their links for readers of the files. Of several definitions
// of a label the first counts, so that those of `links.md` lead to the pages of the documentation.
// `tests/project/links.rs` checks both.

/// Text of a chapter after the definitions of links in `links.md`: first those of chapters, then
/// those of items, which are code.
macro_rules! chapter {
    ($file:literal) => {
        concat!(
            "\n\n",
            include_str!("links.md"),
            "\n",
            include_str!(concat!("../", $file))
        )
    };
}

/// Picture of a chapter.
macro_rules! picture {
    ($name:literal) => {
        concat!(
            "<figure style=\"margin: 0\"><style>figure svg { width: 100%; height: auto }</style>\n",
            include_str!(concat!("../docs/pictures/", $name, ".svg")),
            "</figure>"
        )
    };
}

/// Short programs: reading, stopping, changing and varying shoots, and many shoots at once.
#[doc = chapter!("docs/recipes.md")]
pub mod recipes {}

/// Writing a state to a file, and continuing from it.
// The program of this chapter needs a serialisation format. It runs as one of the tests.
#[cfg_attr(not(doctest), doc = chapter!("docs/saving.md"))]
pub mod saving {}

/// Light, touch, memories of any shape, differential growth at one place, and a stochastic drive.
#[doc = chapter!("docs/laws.md")]
#[doc = picture!("sensing_set_angle")]
#[doc = picture!("sensing_kernel")]
#[doc = picture!("sensing_pulses")]
#[doc = picture!("sensing_hook")]
#[doc = picture!("sensing_random")]
#[doc = picture!("sensing_touch")]
pub mod laws {}

/// Experiments on gravitropism and circumnutation, with published results and closed forms; waves
/// of roots.
#[doc = chapter!("docs/experiments.md")]
#[doc = picture!("experiments")]
#[doc = picture!("roots_waves")]
#[doc = picture!("roots_plate")]
pub mod experiments {}

/// Writing a growth profile, a tropism and an elastic law.
#[doc = chapter!("docs/own-laws.md")]
#[doc = picture!("own_law")]
pub mod own_laws {}

/// Writing a solver of equilibria and an integrator.
#[doc = chapter!("docs/own-methods.md")]
#[doc = picture!("own_solver")]
pub mod own_methods {}

/// Equations, discretisation and limits of the method.
#[doc = chapter!("docs/method.md")]
pub mod method {}

/// Holds, springs, joints, obstacles and friction, their reactions, and the method.
#[doc = chapter!("docs/supports.md")]
pub mod supports {}

/// Parameters of a shoot from data: identifiability, experimental design, and the test for an
/// oscillator.
#[doc = chapter!("docs/fit.md")]
pub mod fit {}

/// Steady states, characteristic roots and onsets of oscillations, and their limits.
#[doc = chapter!("docs/stability.md")]
#[doc = picture!("stability_map")]
pub mod stability {}

/// Periodic orbits, their stability and their bifurcations.
#[doc = chapter!("docs/cycles.md")]
#[doc = picture!("bifurcation")]
pub mod cycles {}

/// Meaning of the tolerances, reliability of the error estimates, and tables of error against run
/// time.
#[doc = chapter!("docs/accuracy.md")]
#[doc = picture!("work_precision")]
pub mod accuracy {}

/// Run time of a time step by its parts, cost of a scene, and comparison with other programs.
#[doc = chapter!("docs/performance.md")]
pub mod performance {}

/// Results at extreme parameters.
#[doc = chapter!("docs/extremes.md")]
pub mod extremes {}

/// Choices that rest on measurements, with the numbers and the alternatives.
#[doc = chapter!("docs/decisions.md")]
pub mod decisions {}

/// Modules, layers, traits and the steps of a run, for readers of the code.
#[doc = chapter!("ARCHITECTURE.md")]
pub mod architecture {}
