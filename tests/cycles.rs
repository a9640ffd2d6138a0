//! Limit cycles that are found: circular orbits against the exact two-point problem, and against numbers that were computed by
//! two other methods.

mod shoots;

use morphorod::cycle::{CircularSolver, PeriodicSolver, Turning};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::stability::Linearisation;
use shoots::{HOUR, MINUTE, STATOLITHS, WEIGHT, reduced, steering};

#[test]
fn quick() {
    for length in [0.0659, 0.067, 0.068, 0.07] {
        for elements in [8, 16] {
            let shoot = reduced(length, 20.0 * HOUR).elements(elements).load(WEIGHT).build().unwrap();
            let root = Linearisation::about(&shoot).unwrap().rightmost().unwrap();
            let begin = Turning::of_mode(&root, 0.015);
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
            if elements == 16 {
                continue;
            }
            let clock = std::time::Instant::now();
            let roots = orbit.roots(&shoot, 12);
            println!("{:?}", clock.elapsed());
            match roots {
                Ok(roots) => println!(
                    "  {:?} trivial {:.1e}",
                    roots.roots.iter().map(|z| (z.value * HOUR, z.difference * HOUR)).collect::<Vec<_>>(),
                    roots.trivial * HOUR
                ),
                Err(error) => println!("  {error}"),
            }
        }
    }
}

#[test]
fn statoliths() {
    let shoot = reduced(0.0659, 20.0 * HOUR).tropism(steering(STATOLITHS)).elements(8).build().unwrap();
    let root = Linearisation::about(&shoot).unwrap().rightmost().unwrap();
    let orbit = CircularSolver::default().solve(&shoot, &Turning::of_mode(&root, 0.03)).unwrap();
    println!(
        "{:.10} {:.10} {:.10} {} {:e}",
        1e3 * orbit.radius(),
        1e3 * orbit.height(),
        orbit.period() / MINUTE,
        orbit.iterations,
        orbit.residual
    );
    let clock = std::time::Instant::now();
    let roots = orbit.roots(&shoot, 12).unwrap();
    println!(
        "  {:?} trivial {:.1e} {:?}",
        roots.roots.iter().map(|z| (z.value * HOUR, z.difference * HOUR)).collect::<Vec<_>>(),
        roots.trivial * HOUR,
        clock.elapsed()
    );
}

#[test]
fn pendular() {
    let mut last = None;
    for (length, amplitude) in
        [(0.0659, 0.0167), (0.067, 0.034), (0.068, 0.042), (0.07, 0.05), (0.072, 0.05), (0.074, 0.05)]
    {
        for elements in [4, 8] {
            let shoot = reduced(length, 20.0 * HOUR)
                .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: 20.0 * HOUR }))
                .nodes(&(0..=elements).map(|i| length * f64::from(i) / f64::from(elements)).collect::<Vec<_>>())
                .build()
                .unwrap();
            let root = Linearisation::about(&shoot).unwrap().rightmost().unwrap();
            let solver = PeriodicSolver { intervals: 16, ..PeriodicSolver::default() };
            let clock = std::time::Instant::now();
            let found = match &last {
                Some(orbit) if elements == 4 => solver.from_orbit(&shoot, orbit),
                _ => solver.from_mode(&shoot, &root, amplitude),
            };
            let orbit = match found {
                Ok(orbit) => orbit,
                Err(error) => {
                    println!("{length} {error}");
                    continue;
                }
            };
            let found = clock.elapsed();
            let (excursion, rod) = orbit.largest_excursion(&shoot).unwrap();
            println!(
                "{length} {elements} its {} {} {:.9} {:.9} {:.9} {:.1e} {:?}",
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
                    list.iter()
                        .take(2)
                        .map(|m| (m.value.re, m.value.im, m.residual, m.root(orbit.period) * HOUR))
                        .collect::<Vec<_>>()
                );
            }
            if elements == 4 {
                last = Some(orbit);
            }
        }
    }
}
