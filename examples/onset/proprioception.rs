//! Critical length against delay and memory of proprioception, and the times at which it equals the
//! critical length without proprioception.

use std::error::Error;
use std::path::Path;

use morphorod::ShootParameters;
use morphorod::ensemble;
use morphorod::stability::{Crossing, Refinement, StabilityError};
use morphorod::tropism::Memory;
use morphorod_plot::{Axes, Figure, Series, Style, Table, println};

use super::{CM, Kind, MINUTE};

/// Shortest and longest shoot of the search for the critical length, m. The self-buckling length is
/// 7.933 cm.
const SEARCH: [f64; 2] = [0.003, 0.0793];
/// Number of intervals of the search.
const INTERVALS: usize = 12;
/// Length below a crossing, m, and number of intervals in which earlier crossings are sought. A slow
/// mode can become unstable and stable again shortly below the crossing of a fast mode. Windows of
/// instability that are shorter than an interval, 0.4 mm, are not found.
const WINDOW: f64 = 0.0064;
const WINDOW_INTERVALS: usize = 16;
/// Number of elements of the first mesh on which roots are counted. Refusals of unresolved waves
/// make a coarse mesh reliable.
const COUNTED: usize = 2;
/// Relative error of lengths and times due to the mesh.
const REFINEMENT: Refinement = Refinement {
    tolerance: 1e-8,
    first: 4,
    last: 64,
};
/// Range of the varied time, s, and number of points.
const TIMES: [f64; 2] = [0.5 * MINUTE, 100.0 * MINUTE];
const POINTS: usize = 36;
/// Smallest ratio of the periods of two modes. Along a mode, the period changes by less from point
/// to point.
const MODES: f64 = 1.2;
/// Ratio of the times of two points beside a change of the mode.
const KINK: f64 = 1.005;
/// The time that is not varied, s.
const FIXED: f64 = 12.0 * MINUTE;

/// Name in the output, label in the picture, and memory of proprioception of a given time.
struct Variant {
    name: &'static str,
    label: &'static str,
    style: Style,
    memory: fn(f64) -> Memory,
}

const VARIANTS: [Variant; 3] = [
    Variant {
        name: "delay and memory",
        label: "delay τ̄r = memory τ̄m",
        style: Style::Line,
        memory: |time| Memory { time, delay: time },
    },
    Variant {
        name: "delay alone",
        label: "delay τ̄r, memory 12 min",
        style: Style::Dashed,
        memory: |delay| Memory { time: FIXED, delay },
    },
    Variant {
        name: "memory alone",
        label: "memory τ̄m, delay 12 min",
        style: Style::DashDot,
        memory: |time| Memory { time, delay: FIXED },
    },
];

impl Kind {
    /// The same shoots with another memory of proprioception.
    fn with_memory(&self, proprioceptive_memory: Memory) -> Self {
        let parameters = ShootParameters {
            proprioceptive_memory,
            ..self.parameters
        };
        Self {
            parameters,
            ..*self
        }
    }

    /// Number of unstable roots on the first mesh that resolves their wavelengths.
    fn unstable(&self, length: f64) -> Result<usize, StabilityError> {
        let mut elements = COUNTED;
        loop {
            match self.at(length, elements)?.unstable() {
                Err(StabilityError::UnderResolved { .. }) if elements < REFINEMENT.last => {
                    elements *= 2;
                }
                other => return other,
            }
        }
    }
}

/// First of several equal intervals of lengths, m, at whose end roots are unstable.
fn unstable_interval(
    kind: &Kind,
    [from, to]: [f64; 2],
    intervals: usize,
) -> Result<Option<[f64; 2]>, StabilityError> {
    let length = |i: usize| from + (to - from) * i as f64 / intervals as f64;
    for i in 1..=intervals {
        if kind.unstable(length(i))? > 0 {
            return Ok(Some([length(i - 1), length(i)]));
        }
    }
    Ok(None)
}

/// Smallest length at which a root crosses the imaginary axis. Unstable roots are counted at
/// increasing lengths, because any mode may become unstable first.
pub fn critical(kind: &Kind) -> Result<Crossing<1>, StabilityError> {
    let onset = |[from, to]: [f64; 2]| {
        REFINEMENT.onset(|length, elements| kind.at(length, elements), from, to)
    };
    // Without an unstable length, the search in the whole range returns the error.
    let crossing = onset(unstable_interval(kind, SEARCH, INTERVALS)?.unwrap_or(SEARCH))?;
    let [length] = crossing.parameters;
    let below = [
        (length - WINDOW).max(SEARCH[0]),
        length - 0.5 * WINDOW / WINDOW_INTERVALS as f64,
    ];
    match unstable_interval(kind, below, WINDOW_INTERVALS)? {
        Some(interval) => onset(interval),
        None => Ok(crossing),
    }
}

/// Estimated error of the parameter of a crossing: that of the mesh, and the relative error of 1e-9
/// of the differences in the characteristic matrix.
pub fn error(crossing: &Crossing<1>) -> f64 {
    let [parameter] = crossing.parameters;
    let mesh = crossing.parameter_errors.map_or(f64::NAN, |[error]| error);
    mesh + 1e-9 * parameter
}

/// Critical lengths (m) at increasing times (s), up to the time at which the essential spectrum
/// becomes unstable. Times without an onset below the self-buckling length are left out. The places
/// at which another mode becomes unstable first are located by bisection.
fn curve(kind: &Kind, variant: &Variant) -> Result<Vec<(f64, Crossing<1>)>, StabilityError> {
    let at = |time: f64| critical(&kind.with_memory((variant.memory)(time)));
    let time = |i: usize| TIMES[0] * (TIMES[1] / TIMES[0]).powf(i as f64 / (POINTS - 1) as f64);
    let found = ensemble::collect(POINTS, ensemble::cores(), |i| (time(i), at(time(i))));
    let mut points = Vec::new();
    for (time, found) in found {
        match found {
            Ok(crossing) => points.push((time, crossing)),
            Err(StabilityError::InfinitelyMany { .. } | StabilityError::NoCrossing { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    let is_wide = |pair: &[(f64, Crossing<1>)]| {
        let ratio = pair[0].1.period() / pair[1].1.period();
        ratio.max(1.0 / ratio) > MODES && pair[1].0 > KINK * pair[0].0
    };
    while let Some(i) = points.windows(2).position(is_wide) {
        let middle = (points[i].0 * points[i + 1].0).sqrt();
        points.insert(i + 1, (middle, at(middle)?));
    }
    Ok(points)
}

/// Times, s, at which the critical length equals that without proprioception, with their errors.
fn equal_lengths(
    kind: &Kind,
    variant: &Variant,
    points: &[(f64, Crossing<1>)],
    without: &Crossing<1>,
) -> Result<Vec<(f64, f64)>, StabilityError> {
    let [length] = without.parameters;
    let mut times = Vec::new();
    for pair in points.windows(2) {
        let [from, to] = [pair[0].0, pair[1].0];
        let [before, after] = [pair[0].1.parameters[0], pair[1].1.parameters[0]];
        if (before - length) * (after - length) > 0.0 {
            continue;
        }
        // At this length, the time of proprioception is the parameter that a root needs to cross.
        let family = |time, elements| {
            kind.with_memory((variant.memory)(time))
                .at(length, elements)
        };
        let found = match REFINEMENT.onset(family, from, to) {
            // The critical length jumps past this one to another mode.
            Err(StabilityError::NoCrossing { .. }) => continue,
            found => found?,
        };
        let slope = (to - from) / (after - before);
        times.push((
            found.parameters[0],
            error(&found) + slope.abs() * error(without),
        ));
    }
    Ok(times)
}

/// Computes, prints and draws the critical length against delay and memory of proprioception.
pub fn compare_lengths(kind: &Kind, out: &Path) -> Result<(), Box<dyn Error>> {
    let mut gravitropism_alone = *kind;
    gravitropism_alone.parameters.proprioceptive_sensitivity = 0.0;
    let without = critical(&gravitropism_alone)?;
    println!(
        "without proprioception    {:.8} cm, estimated error {:.0e} cm",
        without.parameters[0] / CM,
        error(&without) / CM
    );
    let columns = [
        "variant",
        "delay_s",
        "memory_s",
        "length_m",
        "length_error_m",
        "period_s",
    ];
    let mut table = Table::create(out.join("proprioception.csv"), &columns)?;
    let mut series = Vec::new();
    let mut equal = Vec::new();
    for (i, variant) in VARIANTS.iter().enumerate() {
        let points = curve(kind, variant)?;
        for (time, crossing) in &points {
            let memory = (variant.memory)(*time);
            table.row(&[
                i as f64,
                memory.delay,
                memory.time,
                crossing.parameters[0],
                error(crossing),
                crossing.period(),
            ])?;
        }
        for (time, error) in equal_lengths(kind, variant, &points, &without)? {
            let there = critical(&kind.with_memory((variant.memory)(time)))?;
            println!(
                "the same length with {} of {time:.6} s, estimated error {error:.0e} s: {:.8} cm, period {:.4} min",
                variant.name,
                there.parameters[0] / CM,
                there.period() / MINUTE
            );
            equal.push((time / MINUTE, without.parameters[0] / CM));
        }
        let line = points
            .iter()
            .map(|(time, crossing)| (time / MINUTE, crossing.parameters[0] / CM))
            .collect();
        series.push(Series::new(variant.label, line, variant.style, i));
    }
    table.finish()?;
    let level = TIMES.map(|time| (time / MINUTE, without.parameters[0] / CM));
    series.push(Series::new(
        "without proprioception",
        level.to_vec(),
        Style::Dotted,
        6,
    ));
    for place in &equal {
        series.push(Series::text(
            format!("{:.2} min", place.0),
            // Right of the marker and above the dotted line.
            (1.35 * place.0, place.1 + 0.22),
            Style::Text,
            6,
        ));
    }
    series.push(Series::new("equal lengths", equal, Style::Points, 3));
    Figure::new(
        out.join("proprioception.svg"),
        "Critical length and proprioception",
    )
    .lines(
        "delay or memory of proprioception (min)",
        "critical length (cm)",
        &series,
        Axes::LogX,
    )?;
    Ok(())
}
