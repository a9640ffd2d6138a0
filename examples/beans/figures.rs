//! Figures of predicted against measured quantities.

use std::error::Error;
use std::path::Path;

use morphorod_plot::{Axes, Figure, Series, Style};

use crate::data::Event;
use crate::{Outcome, sag};

/// Line of equality over a range.
fn equality(low: f64, high: f64) -> Series {
    Series::new("equal", vec![(low, low), (high, high)], Style::Dashed, 6)
}

/// Draws all figures, for the whole stem and for one with a rigid upright part. The first two grips
/// are the bounds of the force.
pub fn draw(
    events: &[Event],
    names: &[String],
    readings: [&[Vec<Outcome>]; 2],
    out: &Path,
) -> Result<(), Box<dyn Error>> {
    let grips = readings[0];
    let panels = readings.map(|grips| {
        let mut series = vec![equality(0.05, 2.0)];
        for (k, name) in names.iter().enumerate().take(2) {
            let both = events.iter().zip(&grips[k]);
            let points = both.filter_map(|(event, outcome)| {
                Some((1e3 * event.force, 1e3 * outcome.as_ref().ok()?.peak))
            });
            series.push(Series::new(
                name.as_str(),
                points.collect(),
                Style::Points,
                k,
            ));
        }
        series
    });
    let panels = [
        ("whole stem", &panels[0][..]),
        ("rigid upright part", &panels[1][..]),
    ];
    Figure::new(out.join("force.svg"), "Force of beans on a hanging support").panels(
        "measured peak force (mN)",
        "predicted peak force (mN)",
        &panels,
        Axes::LogLog,
    )?;

    let mut series = Vec::new();
    for (k, name) in names.iter().enumerate() {
        let mut shares: Vec<f64> = grips[k]
            .iter()
            .flatten()
            .map(|force| force.contact)
            .collect();
        let one = cumulative(name, &mut shares, Style::Line);
        // The first case has no slip, and the others are ordered by their friction.
        series.push(match k {
            0 => Series {
                style: Style::Dotted,
                ..one
            },
            _ => one.ordered(k - 1, names.len() - 1),
        });
    }
    let mut measured: Vec<f64> = events
        .iter()
        .map(|event| event.fitted / event.period)
        .collect();
    series.push(Series {
        colour: 6,
        ..cumulative("measured", &mut measured, Style::Dashed)
    });
    Figure::new(out.join("contact.svg"), "Time in contact with the support").lines(
        "time in contact over the period (1)",
        "share of events with less (1)",
        &series,
        Axes::Linear,
    )?;

    let ratio = |reaches: bool| {
        let chosen = events
            .iter()
            .filter(move |event| event.reaches_maximum() == reaches);
        chosen
            .map(|event| {
                (
                    event.fitted / event.period,
                    event.frequency / event.half_frequency(),
                )
            })
            .collect()
    };
    let predicted = events.iter().zip(&grips[0]).filter_map(|(event, outcome)| {
        Some((
            event.fitted / event.period,
            outcome.as_ref().ok()?.frequency / event.half_frequency(),
        ))
    });
    let series = [
        Series::new("measured", ratio(true), Style::Points, 0),
        Series::new("fit without maximum", ratio(false), Style::Points, 1),
        Series::new("no slip", predicted.collect(), Style::Points, 2),
    ];
    Figure::new(out.join("frequency.svg"), "Frequency of the force").lines(
        "duration of the measured fit over the period (1)",
        "frequency over ω/2 (1)",
        &series,
        Axes::LogY,
    )?;

    let sags: Vec<[f64; 2]> = events.iter().map(sag).collect();
    let series = [
        equality(8.0, 60.0),
        Series::new(
            "events",
            sags.iter()
                .map(|[measured, weight]| (*measured, *weight))
                .collect(),
            Style::Points,
            0,
        ),
    ];
    Figure::new(out.join("sag.svg"), "Curvature at the base of the arm").lines(
        "measured curvature (1/m)",
        "by weight alone (1/m)",
        &series,
        Axes::LogLog,
    )?;
    Ok(())
}

/// Distribution of values over the events.
fn cumulative(name: &str, values: &mut [f64], style: Style) -> Series {
    values.sort_by(f64::total_cmp);
    let number = values.len() as f64;
    let points = values
        .iter()
        .enumerate()
        .map(|(i, value)| (*value, (i as f64 + 0.5) / number))
        .collect();
    Series::new(name, points, style, 0)
}
