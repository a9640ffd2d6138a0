//! Forces of beans that touch a hanging support, predicted from their measured geometry and
//! stiffness.
//!
//! Ohad, Porat and Meroz (2026, bioRxiv 2026.03.16.712031) measured the force of circumnutating
//! beans on a light straw that hangs like a pendulum. The table `bean_events.csv` has 71 contacts.
//! The model of an event is an upright stem with an overhanging arm. It is an elastic rod of
//! varying stiffness without weight. Its intrinsic curvature bends the arm by a right angle and
//! rotates with the measured period. The prediction has no fitted number. The support is a pendulum
//! of the measured mass and length. Its displacement is small, hence it acts as a spring. Two
//! bounds of the grip are simulated: the place of contact is fixed to the support, or slides on it
//! without friction. Runs with coefficients of friction of 0.3, 1 and 3 are between them.
//!
//! The place of contact would move on a circle if there were no support. Its displacement since the
//! first contact is a chord of this circle. Without slip the force is therefore close to a sine of
//! half of the angular frequency ω of circumnutation.
//!
//! # Agreement with the measurements
//! - The time scale. Without slip the frequency of the force is 0.99 ω/2. The measured one is 0.94
//!   ω/2, with a scatter of 20 % in the 46 events whose fit reaches the maximum of the force.
//! - The independence of the mass of the support. A support of ten times the mass changes the force
//!   by less than 1 %, because the arm is softer than the pendulum. Measured force and mass have a
//!   rank correlation of 0.1.
//! - The need for grip. With a coefficient of friction of 1 the stem slips off after 0.16 (rigid
//!   upright part) or 0.51 (whole stem) of a period. The fits of beans that twine span 0.75 of a
//!   period (median), which is their limit.
//!
//! # Differences from the measurements
//! - The amplitude of single events. Without slip the peak force is 0.6 of the measured one
//!   (median) if the whole stem bends and twists, and 2.3 if the upright part is rigid; other
//!   readings of the geometry give 0.3 to 0.9. The scatter is a factor of 2 to 2.5, and the rank
//!   correlation with measured forces is between −0.3 and 0.1. The modulus is measured near the tip
//!   and extrapolated along most stems.
//! - Weight. At a density of 1000 kg/m³ the weight of the arm alone would cause 0.67 (median) of
//!   the curvature that it has at its base if it is curved over half of its length (`sag.svg`), and
//!   1.3 if it is curved over all of it.
//! - Some fits of the measured force end before the maximum. The figure of the frequencies marks
//!   them.

mod data;
mod figures;
mod statistics;
mod stem;

use std::error::Error;
use std::f64::consts::{FRAC_PI_2, PI};
use std::process::ExitCode;
use std::time::Instant;

use data::{Event, GRAVITY, modulus, radius};
use morphorod::ensemble;
use morphorod_plot::{Options, Progress, Table, println};
use statistics::{median, rank_correlation, scatter};
use stem::{CLAMPED, Force, Grip, MAIN, OTHERS, Reading, simulate};

/// Grips of the first two readings. The first two grips are the bounds.
const GRIPS: [Grip; 5] = [
    Grip::NoSlip,
    Grip::Friction(0.0),
    Grip::Friction(0.3),
    Grip::Friction(1.0),
    Grip::Friction(3.0),
];
/// Factor of the mass of the support that tests its effect.
const HEAVIER: f64 = 10.0;

/// Result of a simulation, or the error message.
type Outcome = Result<Force, String>;

/// Simulates all events.
fn all(events: &[Event], reading: &Reading, grip: Grip) -> Result<Vec<Outcome>, Box<dyn Error>> {
    let mut outcomes = Vec::with_capacity(events.len());
    let member = |k: usize| simulate(&events[k], reading, grip).map_err(|error| error.to_string());
    ensemble::run(0..events.len(), ensemble::cores(), member, |_, outcome| {
        outcomes.push(outcome);
        Ok::<(), Box<dyn Error>>(())
    })?;
    Ok(outcomes)
}

/// Predicted and measured peak force (N) of the simulated events.
fn forces(events: &[Event], outcomes: &[Outcome]) -> Vec<(f64, f64)> {
    let both = events.iter().zip(outcomes);
    both.filter_map(|(event, outcome)| Some((outcome.as_ref().ok()?.peak, event.force)))
        .collect()
}

/// Prints how predicted and measured forces compare.
fn compare(name: &str, events: &[Event], outcomes: &[Outcome]) {
    let forces = forces(events, outcomes);
    let ratios: Vec<f64> = forces
        .iter()
        .map(|(predicted, measured)| predicted / measured)
        .collect();
    let frequencies = events.iter().zip(outcomes).filter_map(|(event, outcome)| {
        let force = outcome.as_ref().ok()?;
        Some(force.frequency / event.half_frequency())
    });
    let contacts = outcomes.iter().flatten().map(|force| force.contact);
    println!(
        "{name:36} {:3} {:8.3} {:8.2} {:12.2} {:10.2} {:8.2}",
        forces.len(),
        median(ratios.iter().copied()),
        scatter(&ratios),
        rank_correlation(&forces),
        median(frequencies),
        median(contacts),
    );
}

/// Curvature (1/m) of the arm at its base, as measured and as its weight alone would bend it there
/// if it were straight and horizontal.
fn sag(event: &Event) -> [f64; 2] {
    let number = 1000;
    let spacing = event.arm / f64::from(number);
    // Midpoint rule for the couple of the weight.
    let couple = (0..number).map(|i| {
        let from_tip = (f64::from(i) + 0.5) * spacing;
        1000.0 * GRAVITY * PI * radius(from_tip).powi(2) * (event.arm - from_tip) * spacing
    });
    let stiffness = modulus(event.arm) * 0.25 * PI * radius(event.arm).powi(4);
    [
        FRAC_PI_2 / (MAIN.curved * event.arm),
        couple.sum::<f64>() / stiffness,
    ]
}

fn name(grip: Grip) -> String {
    match grip {
        Grip::NoSlip => "no slip".into(),
        Grip::Friction(friction) => format!("friction {friction}"),
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "beans",
        "forces of beans on a hanging support, predicted and measured",
        &[],
    );
    let out = options.out_dir();
    let events = data::events()?;
    let clock = Instant::now();
    let progress = Progress::new("beans");
    let total = (2 * GRIPS.len() + OTHERS.len() + 1) as f64;
    let mut done = 0.0;
    let mut simulated = |reading: &Reading, grip: Grip, events: &[Event]| {
        let outcomes = all(events, reading, grip);
        done += 1.0;
        progress.set(done / total);
        outcomes
    };
    let mut whole = Vec::new();
    let mut clamped = Vec::new();
    for grip in GRIPS {
        whole.push(simulated(&MAIN, grip, &events)?);
        clamped.push(simulated(&CLAMPED, grip, &events)?);
    }
    let mut others = Vec::new();
    for reading in &OTHERS {
        others.push(simulated(reading, Grip::NoSlip, &events)?);
    }
    let heavier: Vec<Event> = events
        .iter()
        .map(|event| Event {
            mass: HEAVIER * event.mass,
            ..*event
        })
        .collect();
    let heavier = simulated(&MAIN, Grip::NoSlip, &heavier)?;
    progress.finish();
    println!(
        "{} events, run time {:.1} s",
        events.len(),
        clock.elapsed().as_secs_f64()
    );
    println!(
        "medians: peak force over the measured one, its scatter (log10) and rank correlation, frequency over ω/2,"
    );
    println!("time in contact over the period (at most 0.75)");
    println!(
        "{:36} {:>3} {:>8} {:>8} {:>12} {:>10} {:>8}",
        "", "n", "ratio", "scatter", "correlation", "frequency", "contact"
    );
    for (reading, grips) in [(&MAIN, &whole), (&CLAMPED, &clamped)] {
        println!("{}:", reading.name);
        for (grip, outcomes) in GRIPS.iter().zip(grips) {
            compare(&name(*grip), &events, outcomes);
            for (event, outcome) in events.iter().zip(outcomes) {
                if let Err(error) = outcome {
                    println!("  event {}: {error}", event.number);
                }
            }
        }
    }
    println!("other readings, without slip:");
    for (reading, outcomes) in OTHERS.iter().zip(&others) {
        compare(reading.name, &events, outcomes);
    }
    report(&events, &whole[0], &heavier);
    write(&events, &whole, &out)?;
    figures::draw(&events, &GRIPS.map(name), [&whole, &clamped], &out)?;
    println!(
        "wrote events.csv, force.svg, contact.svg, frequency.svg and sag.svg to {}",
        out.display()
    );
    Ok(())
}

/// Prints the comparison with one fitted number, the measured time scales, the effect of the mass,
/// and the sag.
fn report(events: &[Event], bound: &[Outcome], heavier: &[Outcome]) {
    let forces = forces(events, bound);
    let factor = 1.0
        / median(
            forces
                .iter()
                .map(|(predicted, measured)| predicted / measured),
        );
    let within = forces.iter().filter(|(predicted, measured)| {
        (factor * predicted / measured).log10().abs() < 2f64.log10()
    });
    println!(
        "one fitted number, the factor {factor:.3} of the modulus: {} of {} forces within a factor of 2",
        within.count(),
        forces.len()
    );
    let measured = |chosen: &dyn Fn(&&Event) -> bool| {
        let ratios: Vec<f64> = events
            .iter()
            .filter(chosen)
            .map(|event| event.frequency / event.half_frequency())
            .collect();
        (
            ratios.len(),
            median(ratios.iter().copied()),
            scatter(&ratios),
        )
    };
    let (number, ratio, spread) = measured(&|event| event.reaches_maximum());
    println!(
        "measured frequency over ω/2: {ratio:.2}, scatter {spread:.2}, in {number} events with a maximum;"
    );
    let (number, ratio, spread) = measured(&|event| !event.reaches_maximum());
    println!("  {ratio:.2}, scatter {spread:.2}, in {number} events whose fit ends before it");
    for twined in [true, false] {
        let fits = events
            .iter()
            .filter(|event| event.twined == twined)
            .map(|event| event.fitted / event.period);
        println!(
            "measured contact over the period, {}: {:.2}",
            if twined { "twined" } else { "slipped" },
            median(fits)
        );
    }
    let changes = bound
        .iter()
        .zip(heavier)
        .filter_map(|(one, ten)| Some(ten.as_ref().ok()?.peak / one.as_ref().ok()?.peak));
    println!(
        "peak force on a support of {HEAVIER} times the mass: {:.3} of that",
        median(changes)
    );
    let masses: Vec<_> = events
        .iter()
        .map(|event| (event.mass, event.force))
        .collect();
    println!(
        "rank correlation of measured force and mass: {:.2}",
        rank_correlation(&masses)
    );
    let sags = events
        .iter()
        .map(sag)
        .map(|[measured, weight]| weight / measured);
    println!(
        "curvature by weight at the base of the arm over the measured one: {:.2}",
        median(sags)
    );
}

/// Writes the table of events.
fn write(
    events: &[Event],
    grips: &[Vec<Outcome>],
    out: &std::path::Path,
) -> Result<(), Box<dyn Error>> {
    let columns = [
        "event",
        "measured_n",
        "no_slip_n",
        "frictionless_n",
        "measured_rad_per_s",
        "no_slip_rad_per_s",
        "contact_friction_0_3",
        "contact_friction_1",
        "contact_friction_3",
    ];
    let mut table = Table::create(out.join("events.csv"), &columns)?;
    for (i, event) in events.iter().enumerate() {
        let get =
            |grip: usize, value: fn(&Force) -> f64| grips[grip][i].as_ref().map_or(f64::NAN, value);
        table.row(&[
            event.number,
            event.force,
            get(0, |force| force.peak),
            get(1, |force| force.peak),
            event.frequency,
            get(0, |force| force.frequency),
            get(2, |force| force.contact),
            get(3, |force| force.contact),
            get(4, |force| force.contact),
        ])?;
    }
    Ok(table.finish()?)
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
