//! Chapters: short programs for what people want to do, how to write a law, and six for who doubts the numbers.

/// How to read, stop, change, vary and multiply shoots.
#[doc = include_str!("../docs/recipes.md")]
pub mod recipes {}

/// How to write a state to a file, and go on from it.
// Its program needs a format to write in, and is run among the tests.
#[cfg_attr(not(doctest), doc = include_str!("../docs/saving.md"))]
pub mod saving {}

/// How to write a growth profile, a tropism and an elastic law.
#[doc = include_str!("../docs/own-laws.md")]
#[doc = concat!("<figure style=\"margin: 0\"><style>figure svg { width: 100%; height: auto }</style>\n", include_str!("../docs/pictures/own_law.svg"), "</figure>")]
pub mod own_laws {}

/// How the numbers come about, and where the method ends.
#[doc = include_str!("../docs/method.md")]
pub mod method {}

/// How stationary shoots, characteristic roots and onsets are found, and what they cannot tell.
#[doc = include_str!("../docs/stability.md")]
#[doc = concat!("<figure style=\"margin: 0\"><style>figure svg { width: 100%; height: auto }</style>\n", include_str!("../docs/pictures/stability_map.svg"), "</figure>")]
pub mod stability {}

/// How limit cycles are found, and how stable they are.
#[doc = include_str!("../docs/cycles.md")]
#[doc = concat!("<figure style=\"margin: 0\"><style>figure svg { width: 100%; height: auto }</style>\n", include_str!("../docs/pictures/bifurcation.svg"), "</figure>")]
pub mod cycles {}

/// What a tolerance means, how far its estimate can be trusted, and error against run time in tables.
#[doc = include_str!("../docs/accuracy.md")]
#[doc = concat!("<figure style=\"margin: 0\"><style>figure svg { width: 100%; height: auto }</style>\n", include_str!("../docs/pictures/work_precision.svg"), "</figure>")]
pub mod accuracy {}

/// Where the time of a step goes, what it needs at least, what was done and what did not pay.
#[doc = include_str!("../docs/performance.md")]
pub mod performance {}

/// What was tried at the edges, and what came out.
#[doc = include_str!("../docs/extremes.md")]
pub mod extremes {}
