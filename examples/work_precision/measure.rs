//! Measurement of run times.

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

/// Largest number of repetitions after the first run.
const RUNS: usize = 7;
/// Duration after which no further repetition begins, s. The relative disturbance by other programs
/// is small for long runs.
const ENOUGH: f64 = 0.1;
/// Smallest number of repetitions after the first run.
const LEAST: usize = 1;
/// Smallest measured duration, s. Shorter runs are repeated and timed together.
const LONG_ENOUGH: f64 = 2e-3;

/// Returns the result of `work` and its shortest run time, s. If `quick`, `work` runs once.
pub fn measure<T>(
    quick: bool,
    mut work: impl FnMut() -> Result<T, Box<dyn Error>>,
) -> Result<(T, f64), Box<dyn Error>> {
    let clock = Instant::now();
    let result = work()?;
    let mut best = clock.elapsed().as_secs_f64();
    if quick {
        return Ok((result, best));
    }
    let together = (LONG_ENOUGH / best).ceil().max(1.0) as usize;
    let all = Instant::now();
    for run in 0..RUNS {
        if run >= LEAST && all.elapsed().as_secs_f64() > ENOUGH {
            break;
        }
        let clock = Instant::now();
        for _ in 0..together {
            black_box(work()?);
        }
        best = best.min(clock.elapsed().as_secs_f64() / together as f64);
    }
    Ok((result, best))
}
