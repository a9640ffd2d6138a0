//! Map over the radius of the pole and the friction.

use std::error::Error;
use std::path::Path;

use morphorod::ensemble;
use morphorod::integrator::IntegrationError;
use morphorod_plot::{Axes, Figure, Progress, Series, Style, Table, println};

use crate::{PERIOD, Setup};

/// Classes of the map. The index of a class is that of its colour.
const CLASSES: [&str; 5] = ["passes", "slips off", "leans", "winds", "unfinished"];
/// Radii of the pole, m.
const RADII: [f64; 6] = [0.5e-3, 1e-3, 1.25e-3, 1.5e-3, 2e-3, 3e-3];
/// Coefficients of friction.
const FRICTIONS: [f64; 3] = [0.0, 0.1, 0.3];
/// Smallest number of turns of a shoot that winds. It bears on opposite sides of the pole several
/// times.
const WOUND: f64 = 2.0;
/// Longest time step, s. With steps of 600 s the thickest pole is in another class for the largest
/// friction than with steps of 60 and 120 s.
const LONGEST_STEP: f64 = 300.0;
/// Largest number of evaluations of the forces in the rod in a run.
const WORK: usize = 4000;

/// Result of a run.
struct Cell {
    class: usize,
    /// Largest number of turns between the lowest and the highest contact.
    turns: f64,
    /// Time of the end, s.
    end: f64,
    error: Option<IntegrationError>,
}

/// Runs one shoot of the map. A shoot that has wound before its run ended with an error winds.
fn cell(setup: &Setup) -> Result<Cell, Box<dyn Error>> {
    let (mut touched, mut free, mut turns) = (false, false, 0.0_f64);
    let mut shoot = setup.shoot()?;
    let error = setup.run(&mut shoot, |shoot| {
        let touches = !shoot.reactions().is_empty();
        touched |= touches;
        turns = turns.max(setup.turns(shoot).abs());
        free |= !touches && shoot.time() >= setup.end - PERIOD;
        Ok(())
    })?;
    let class = match (touched, free) {
        _ if turns >= WOUND => 3,
        _ if error.is_some() => 4,
        (false, _) => 0,
        (_, true) => 1,
        _ => 2,
    };
    Ok(Cell {
        class,
        turns,
        end: shoot.time(),
        error,
    })
}

/// Computes the map and writes map.csv and map.svg.
pub fn map(base: &Setup, out: &Path) -> Result<(), Box<dyn Error>> {
    let base = Setup {
        work: WORK,
        step: base.step.min(LONGEST_STEP),
        ..*base
    };
    let setups: Vec<Setup> = FRICTIONS
        .iter()
        .flat_map(|&friction| {
            RADII.iter().map(move |&pole| Setup {
                pole,
                friction,
                ..base
            })
        })
        .collect();
    let progress = Progress::new("map");
    let mut cells = Vec::with_capacity(setups.len());
    let member = |k: usize| cell(&setups[k]).map_err(|error| error.to_string());
    ensemble::run(0..setups.len(), ensemble::cores(), member, |k, result| {
        cells.push(result?);
        progress.set((k + 1) as f64 / setups.len() as f64);
        Ok::<(), Box<dyn Error>>(())
    })?;
    progress.finish();
    let mut table = Table::create(
        out.join("map.csv"),
        &["friction", "pole_m", "class", "turns", "end_s"],
    )?;
    println!("friction  pole (mm)  turns  end (h)");
    for (setup, cell) in setups.iter().zip(&cells) {
        table.row(&[
            setup.friction,
            setup.pole,
            cell.class as f64,
            cell.turns,
            cell.end,
        ])?;
        let error = cell
            .error
            .as_ref()
            .map_or(String::new(), |error| format!(": {error}"));
        let (pole, end) = (1e3 * setup.pole, cell.end / crate::HOUR);
        println!(
            "{:8} {pole:10.2} {:6.2} {end:8.2}  {}{error}",
            setup.friction, cell.turns, CLASSES[cell.class]
        );
    }
    table.finish()?;
    let found = |class: usize| {
        let chosen = setups
            .iter()
            .zip(&cells)
            .filter(move |(_, cell)| cell.class == class);
        chosen
            .map(|(setup, _)| (1e3 * setup.pole, setup.friction))
            .collect::<Vec<_>>()
    };
    let all = CLASSES
        .into_iter()
        .enumerate()
        .map(|(i, name)| Series::new(name, found(i), Style::Points, i));
    let series: Vec<Series> = all.filter(|series| !series.points.is_empty()).collect();
    Figure::new(out.join("map.svg"), "Shoots that meet a pole").lines(
        "radius of the pole (mm)",
        "coefficient of friction (1)",
        &series,
        Axes::Linear,
    )?;
    println!("wrote map.csv and map.svg to {}", out.display());
    Ok(())
}
