//! Film of a fit: the fitted shoot and the data.

use std::error::Error;
use std::path::Path;

use morphorod::fit::{Estimates, Series};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::{DynLaws, Shoot};
use morphorod_plot::{Film, Frame};

use super::data::Points;

/// Number of intervals between frames at times without data.
const FRAMES: u32 = 200;
/// Largest number of times whose data are shown.
const MOST: usize = 1000;

/// Writes a film of the data and of the fitted shoot, which is given at its initial time. `step` is
/// the time step, s.
pub fn write(
    file: &Path,
    mut shoot: Shoot<DynLaws>,
    (series, points): (&Series, &Points),
    found: &Estimates,
    step: f64,
) -> Result<(), Box<dyn Error>> {
    if points.is_angle() {
        return Err("angles of the tip have no places for a film".into());
    }
    let about = "Dots are measured points; the shoot has the estimated parameters.";
    let mut film = Film::new("Data and the fitted shoot", about, 0.5);
    let every = series.times().len().div_ceil(MOST).max(1);
    let mut shown = series
        .times()
        .iter()
        .zip(series.frames())
        .step_by(every)
        .peekable();
    let last = series.times().last().copied().unwrap_or(0.0);
    // Rounding must not lead beyond the last time.
    let grid = (0..=FRAMES).map(|k| (last * f64::from(k) / f64::from(FRAMES)).min(last));
    let mut times: Vec<f64> = shown.clone().map(|(time, _)| *time).chain(grid).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    MethodOfSteps::new(step).advance_showing(&mut shoot, last, times, |shoot| {
        film.push(Frame::of(shoot, None));
        let Some((time, measured)) = shown.next_if(|(time, _)| **time <= shoot.time()) else {
            return;
        };
        // The points of a centre line begin beyond the base.
        let line = shoot.rod().centre_line_at(measured.len() + 1);
        let places = measured
            .iter()
            .zip(line.iter().skip(1))
            .filter_map(|(p, fitted)| points.place(p, *fitted, found));
        film.add_measured(*time, places.map(Into::into).collect());
    })?;
    Ok(film.write(file)?)
}
