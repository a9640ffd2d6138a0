//! Limit cycles that are found: circular orbits against the exact two-point problem, and against numbers that were computed by
//! two other methods.

mod shoots;

use std::f64::consts::TAU;

use morphorod::Shoot;
use morphorod::cycle::{CircularSolver, PeriodicSolver, Turning};
use morphorod::stability::Linearisation;
use shoots::{HOUR, MINUTE, WEIGHT, reduced};

#[test]
fn quick() {
    let mut start = None;
    for length in [0.0659, 0.067, 0.068, 0.07] {
        let shoot = reduced(length, 20.0 * HOUR).elements(8).load(WEIGHT).build().unwrap();
        let begin = start.take().unwrap_or_else(|| {
            let root = Linearisation::about(&shoot).unwrap().rightmost().unwrap();
            Turning::of_mode(&root, 0.015)
        });
        let clock = std::time::Instant::now();
        let orbit = CircularSolver::default().solve(&shoot, &begin).unwrap();
        println!(
            "{length} {} {:.10} {:.10} {:.10} {:?} {:.1e} {:?}",
            orbit.iterations,
            1e3 * orbit.radius(),
            1e3 * orbit.height(),
            orbit.period() / MINUTE,
            orbit.rate,
            orbit.residual,
            clock.elapsed()
        );
        let clock = std::time::Instant::now();
        let roots = orbit.roots(&shoot, -0.4 / HOUR);
        println!("{:?}", clock.elapsed());
        match roots {
            Ok(roots) => println!(
                "  {:?} trivial {:.1e}",
                roots.roots.iter().map(|z| z * HOUR).collect::<Vec<_>>(),
                roots.trivial * HOUR
            ),
            Err(error) => println!("  {error}"),
        }
        start = Some(orbit.as_start());
    }
}

#[test]
fn pendular() {
    for (length, amplitude) in [(0.0659, 0.0167), (0.067, 0.034)] {
        let shoot = reduced(length, 20.0 * HOUR).elements(4).load(WEIGHT).build().unwrap();
        let root = Linearisation::about(&shoot).unwrap().rightmost().unwrap();
        for intervals in [12, 16, 24] {
            let clock = std::time::Instant::now();
            let solver = PeriodicSolver { intervals, ..PeriodicSolver::default() };
            let orbit = match solver.from_mode(&shoot, &root, amplitude) {
                Ok(orbit) => orbit,
                Err(error) => {
                    println!("{error}");
                    continue;
                }
            };
            let found = clock.elapsed();
            let (excursion, rod) = orbit.largest_excursion(&shoot).unwrap();
            println!(
                "{length} {intervals} its {} {} {:.9} {:.9} {:.9} {:.1e} {:?}",
                orbit.iterations,
                orbit.equilibria,
                1e3 * excursion,
                1e3 * rod.tip().z,
                orbit.period / MINUTE,
                orbit.residual,
                found
            );
            let clock = std::time::Instant::now();
            let multipliers = orbit.multipliers(&shoot, 16).unwrap();
            println!("{:?}", clock.elapsed());
            for list in multipliers {
                println!(
                    "   {:?}",
                    list.iter().take(4).map(|m| (m.value.re, m.value.im, m.residual)).collect::<Vec<_>>()
                );
            }
        }
    }
}
