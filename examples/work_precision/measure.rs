//! The run time of a piece of work.

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

/// Runs of which the shortest counts.
const RUNS: usize = 7;
/// Of long runs fewer do: they are repeated for this time (s), and so often at least. What disturbs a run is a small part of a long one.
const ENOUGH: f64 = 0.1;
const LEAST: usize = 1;
/// Work that is done in less than this is timed several times together, s.
const LONG_ENOUGH: f64 = 2e-3;

/// What `work` returns, and the time (s) that it takes: the shortest of some runs, a single one if it is `quick`.
pub fn measure<T>(
    quick: bool,
    mut work: impl FnMut() -> Result<T, Box<dyn Error>>,
) -> Result<(T, f64), Box<dyn Error>> {
    let clock = Instant::now();
    let answer = work()?;
    let mut best = clock.elapsed().as_secs_f64();
    if quick {
        return Ok((answer, best));
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
    Ok((answer, best))
}
