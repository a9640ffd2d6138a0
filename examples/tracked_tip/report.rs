//! Printed results of a whole track and of the decision between the mechanisms.

use morphorod_plot::println;
use std::collections::BTreeMap;
use std::error::Error;

use morphorod::tracking::{Nutation, Oscillation, Oscillations, Search, Track};

use super::criteria::{decimal, uncertain};
use super::mechanism::{Component, Judgement, Source, Verdict};
use super::{HOUR, MINUTE};

const MM_PER_M: f64 = 1e3;

/// Prints the oscillations of a whole track.
pub fn oscillations(path: &Track, found: &Oscillations, share: f64) -> Result<(), Box<dyn Error>> {
    println!("oscillations of the whole track, by least squares:");
    for (k, wave) in found.oscillations.iter().enumerate() {
        println!("  {}", oscillation(wave, k == 0));
    }
    println!("  pattern: {}", found.pattern());
    let part = path.share(share, &Search::default())?;
    println!(
        "  share of {} min in the squared amplitudes: {part:.3}",
        share / MINUTE
    );
    println!(
        "  residual {:.3} mm, drift of degree {}",
        MM_PER_M * found.noise,
        found.drift
    );
    Ok(())
}

fn oscillation(wave: &Oscillation, largest: bool) -> String {
    let (ellipse, error) = (wave.ellipse, MM_PER_M * wave.axis_error);
    let role = match wave.harmonic {
        _ if largest => "largest".to_owned(),
        Some(order) => format!("harmonic {order} of the largest"),
        None => "not a harmonic of the largest".to_owned(),
    };
    // The direction follows from the difference of the axes, which vanishes for a circle.
    let turn = wave.axis_error / (ellipse.major - ellipse.minor);
    let direction = match ellipse.direction.to_degrees() {
        angle if turn < 0.5 => {
            format!(
                "major axis at {} ± {}°",
                decimal(angle, 0),
                decimal(turn.to_degrees().ceil(), 0)
            )
        }
        _ => "major axis undetermined".to_owned(),
    };
    format!(
        "{} min, {role}: semi-axes {} and {} mm, {direction}, {}",
        uncertain(wave.period / MINUTE, wave.period_error / MINUTE),
        uncertain(MM_PER_M * ellipse.major, error),
        uncertain(MM_PER_M * ellipse.minor, error),
        match ellipse.sense {
            Some(sense) => format!(
                "{} (minor axis {:.1} standard errors)",
                sense,
                ellipse.minor / wave.axis_error
            ),
            None => format!(
                "sense undetermined (minor axis {:.1} standard errors)",
                ellipse.minor / wave.axis_error
            ),
        },
    )
}

/// Prints the quantities of tracking pipelines.
pub fn nutation(found: &Nutation, band: [f64; 2]) {
    println!(
        "by wavelets, periods from {:.1} to {:.1} min:",
        band[0] / MINUTE,
        band[1] / MINUTE
    );
    match (
        found.period,
        found.period_quartiles,
        found.amplitude,
        found.sampling,
    ) {
        (Some(period), Some([lower, upper]), Some(amplitude), Some(sampling)) => {
            let (median, range) = (period / MINUTE, (upper - lower) / MINUTE);
            println!(
                "  the tip nutates: median period {median:.2} min, interquartile range {} min",
                small(range)
            );
            println!("  largest semi-major axis {:.2} mm", MM_PER_M * amplitude);
            let turns = found.turns.map_or(String::new(), |turns| {
                format!(", {turns:.1} turns of the velocity")
            });
            println!(
                "  sense {}{turns}",
                found
                    .sense
                    .map_or("undetermined".into(), |sense| sense.to_string())
            );
            println!("  sampling interval over half of the median period: {sampling:.3}");
        }
        _ => println!("  the tip does not nutate"),
    }
    for [short, long] in &found.unresolved {
        println!(
            "  the periods {:.1} and {:.1} min are not resolved: two oscillations, or one of changing amplitude",
            short / MINUTE,
            long / MINUTE
        );
    }
    println!(
        "  power in this band over the whole power: {:.3}",
        found.band_power
    );
    if let Some(floor) = found.noise_floor {
        println!("  noise of a coordinate {:.3} mm", MM_PER_M * floor);
    }
    let missing: f64 = found.gaps.iter().map(|[from, to]| to - from).sum();
    println!(
        "  {} outliers; gaps: {}, in total {} h",
        found.outliers.len(),
        found.gaps.len(),
        decimal(missing / HOUR, 2)
    );
}

/// Prints the number of windows without a result for each reason.
pub fn failures(failures: &BTreeMap<String, usize>, windows: usize) {
    println!(
        "{windows} windows:{}",
        if failures.is_empty() {
            " all have results"
        } else {
            ""
        }
    );
    for (reason, count) in failures {
        println!("  {count} windows have {reason}");
    }
}

/// Prints the mechanism, with its criteria.
pub fn mechanism(found: &Judgement, windows: usize, window: f64) {
    println!(
        "mechanism, from {windows} windows of {:.2} h:",
        window / HOUR
    );
    for component in &found.components {
        let [period, spread] = component.period.map(|value| value / MINUTE);
        let shown = component.waves.len();
        let relation = component
            .derived
            .as_ref()
            .map_or(String::new(), |relation| format!(", {relation}"));
        println!(
            "  {period:.2} min (half of the range {} min, {shown} of {windows} windows){relation}",
            small(spread)
        );
        for criterion in &component.criteria {
            println!(
                "    [{}] {}",
                criterion.source.map_or("neutral", source),
                criterion.text
            );
        }
    }
    for text in &found.criteria {
        println!("  {text}");
    }
    println!("verdict: {}", verdict(found));
    for reason in &found.reasons {
        println!("  {reason}");
    }
}

/// A positive number with two decimals.
fn small(value: f64) -> String {
    if value < 0.005 {
        "below 0.01".into()
    } else {
        format!("{value:.2}")
    }
}

fn source(source: Source) -> &'static str {
    match source {
        Source::Oscillator => "oscillator",
        Source::Delayed => "delayed gravitropism",
    }
}

fn verdict(found: &Judgement) -> String {
    let of = |source: Source| {
        let own = |component: &&Component| component.source == Some(source);
        let periods: Vec<String> = found
            .components
            .iter()
            .filter(own)
            .map(|component| format!("{:.1} min", component.period[0] / MINUTE))
            .collect();
        if periods.is_empty() {
            String::new()
        } else {
            format!(" ({})", periods.join(", "))
        }
    };
    let [oscillator, delayed] = [of(Source::Oscillator), of(Source::Delayed)];
    match found.verdict {
        Verdict::Oscillator => format!("an internal oscillator{oscillator}"),
        Verdict::Delayed => format!("delayed gravitropism{delayed}"),
        Verdict::Both => {
            format!("an internal oscillator{oscillator} and delayed gravitropism{delayed}")
        }
        Verdict::Undecided => "the track does not decide, because".into(),
    }
}
