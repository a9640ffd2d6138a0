//! Map over the radius and the distance of the pole.

use std::error::Error;
use std::path::Path;

use morphorod::ensemble;
use morphorod::integrator::IntegrationError;

use crate::{PERIOD, Setup};
use morphorod_plot::{Axes, Figure, Progress, Series, Style, Table, println};

/// Classes of the map, with the index of their colour.
const CLASSES: [&str; 5] = ["passes", "slips off", "leans", "winds", "fails"];

/// Runs one shoot of the map and returns the index of its class, and the error.
fn class(setup: &Setup) -> Result<(usize, Option<IntegrationError>), Box<dyn Error>> {
    let (mut touched, mut free, mut turns) = (false, false, 0.0_f64);
    let mut shoot = setup.shoot()?;
    let error = setup.run(&mut shoot, |shoot| {
        let touches = !shoot.reactions().is_empty();
        touched |= touches;
        if shoot.time() >= setup.end - PERIOD {
            free |= !touches;
            turns = turns.max(setup.turns(shoot).abs());
        }
        Ok(())
    })?;
    let found = match (touched, free, turns >= 1.0) {
        _ if error.is_some() => 4,
        (false, ..) => 0,
        (_, true, _) => 1,
        (.., winds) => 2 + usize::from(winds),
    };
    Ok((found, error))
}

/// Computes the map and writes map.csv and map.svg.
pub fn map(base: &Setup, size: usize, out: &Path) -> Result<(), Box<dyn Error>> {
    let mu = if base.friction > 0.0 { base.friction } else { 0.2 };
    let share = |i: usize| i as f64 / (size - 1).max(1) as f64;
    let mut cells = Vec::new();
    for friction in [0.0, mu] {
        for (i, j) in (0..size).flat_map(|i| (0..size).map(move |j| (i, j))) {
            let (pole, distance) = (1e-3 + 5e-3 * share(i), 0.01 + 0.03 * share(j));
            cells.push(Setup { pole, distance, friction, step: 2.0 * base.step, retries: 0, ..*base });
        }
    }
    let progress = Progress::new("map");
    let mut found = Vec::with_capacity(cells.len());
    let member = |k: usize| match class(&cells[k]) {
        Ok((class, error)) => (class, error.map_or(String::new(), |error| error.to_string())),
        Err(error) => (4, error.to_string()),
    };
    ensemble::run(0..cells.len(), ensemble::cores(), member, |k, result| {
        found.push(result);
        progress.set((k + 1) as f64 / cells.len() as f64);
        Ok::<(), Box<dyn Error>>(())
    })?;
    progress.finish();
    let mut table = Table::create(out.join("map.csv"), &["friction", "pole_m", "distance_m", "class"])?;
    let mut panels = [Vec::new(), Vec::new()];
    for (panel, series) in panels.iter_mut().enumerate() {
        let half = || cells.iter().zip(&found).skip(panel * size * size).take(size * size);
        for (index, name) in CLASSES.into_iter().enumerate() {
            let points: Vec<_> = half()
                .filter(|(_, found)| found.0 == index)
                .map(|(cell, _)| (1e3 * cell.pole, 100.0 * cell.distance))
                .collect();
            println!("friction {}: {} of {} {name}", cells[panel * size * size].friction, points.len(), size * size);
            if !points.is_empty() {
                series.push(Series::new(name, points, Style::Points, index));
            }
        }
        for (cell, (class, error)) in half() {
            table.row(&[cell.friction, cell.pole, cell.distance, *class as f64])?;
            if !error.is_empty() {
                println!("  pole {:.2} mm, distance {:.2} cm: {error}", 1e3 * cell.pole, 100.0 * cell.distance);
            }
        }
    }
    table.finish()?;
    let names = ["without friction".to_string(), format!("friction {mu}")];
    let panels = [(names[0].as_str(), &panels[0][..]), (names[1].as_str(), &panels[1][..])];
    let title = "Shoots that meet a pole";
    let labels = ["radius of the pole (mm)", "distance of the pole (cm)"];
    Figure::new(out.join("map.svg"), title).panels(labels[0], labels[1], &panels, Axes::Linear)?;
    println!("wrote map.csv and map.svg to {}", out.display());
    Ok(())
}
