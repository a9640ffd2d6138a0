//! Random growing shoots that meet obstacles reach the end of their run, without penetration and
//! within the cone of friction.

use crate::fixtures::random::{Draw, number};
use crate::fixtures::shoots::{HOUR, RADIUS, WEIGHT, rod, tissue};
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::support::{Contact, Cylinder, HalfSpace, Obstacle, Sphere, Support};
use morphorod::tropism::Oscillator;
use morphorod::{DynLaws, Shoot, Still};

/// Obstacles of any kind.
type Obstacles = Vec<Contact<Box<dyn Obstacle + Send + Sync>>>;

/// Duration of a run and longest step, s.
const RUN: (f64, f64) = (10.0 * HOUR, 240.0);

/// A growing shoot of random size, stiffness, inclination and oscillator.
fn shoot<S: Support + Send + Sync + 'static>(seed: u64, support: S) -> Shoot<DynLaws> {
    let mut draw = Draw::new(seed);
    let length = draw.uniform(0.03, 0.09);
    let youngs_modulus = 1e7 * 10.0_f64.powf(draw.uniform(0.0, 1.0));
    let growth = UniformGrowth {
        zone_length: draw.uniform(0.02, 0.07),
        time: draw.uniform(20.0, 40.0) * HOUR,
    };
    let oscillator = Oscillator::new(draw.uniform(0.0, 1.0), draw.uniform(0.4, 2.0) * HOUR);
    let builder = rod(tissue(youngs_modulus), length);
    let builder = builder.growth(growth).tropism(oscillator).load(WEIGHT);
    builder
        .scene(Still::tilted(draw.uniform(0.0, 1.7)))
        .support(support)
        .into_dyn()
        .build()
        .unwrap()
}

/// One or two obstacles between the straight shoot and its shape at the end of a run without them.
fn obstacles(seed: u64) -> Obstacles {
    let mut draw = Draw::new(seed + 1_000_000);
    let straight = shoot(seed, ());
    let (mut free, tangent) = (shoot(seed, ()), straight.tip().normalize());
    MethodOfSteps::new(RUN.1).advance(&mut free, RUN.0).unwrap();
    let (length, most) = (
        straight.rod().length(),
        if draw.chance(0.7) { 1 } else { 2 },
    );
    let friction = [0.0, 0.3, 1.0][seed as usize % 3];
    let mut all = Obstacles::new();
    for _ in 0..1000 {
        let s = draw.uniform(0.4, 1.0);
        let way = free.rod().at(s * free.rod().length()).unwrap().0 - tangent * (s * length);
        let Some(side) = way.try_normalize(1e-3 * length) else {
            continue;
        };
        let size = 5e-4 * 40.0_f64.powf(draw.uniform(0.0, 1.0));
        let surface = tangent * (s * length) + way * draw.uniform(0.2, 0.9);
        let (centre, across) = (surface + side * (size + RADIUS), draw.vector(1.0));
        let obstacle: Box<dyn Obstacle + Send + Sync> = match draw.uniform(0.0, 3.0) as u8 {
            0 => Box::new(HalfSpace {
                through: centre,
                normal: across * 0.5 - side,
            }),
            1 => Box::new(Cylinder {
                through: centre,
                along: across,
                radius: size,
            }),
            _ => Box::new(Sphere {
                centre,
                radius: size,
            }),
        };
        let clear = |i: i32| {
            obstacle
                .distance(&(tangent * (length * f64::from(i) / 100.0)), 0.0)
                .value
                > 2.0 * RADIUS
        };
        if (0..=100).all(clear) {
            all.push(Contact {
                obstacle,
                radius: RADIUS,
                friction,
            });
        }
        if all.len() == most {
            break;
        }
    }
    all
}

/// Runs a shoot with its obstacles. Returns the number of steps in contact, or the failure.
fn run(seed: u64) -> Result<usize, String> {
    let all = obstacles(seed);
    let mut shoot = shoot(seed, obstacles(seed));
    let (mut run, mut touching) = (MethodOfSteps::new(RUN.1), 0);
    while shoot.time() < RUN.0 {
        let _ = run
            .step(&mut shoot, RUN.0)
            .map_err(|error| error.to_string())?;
        let (rod, time) = (shoot.rod(), shoot.time());
        touching += usize::from(!shoot.reactions().is_empty());
        let line = rod.centre_line_at(101);
        for contact in &all {
            for place in &line[1..] {
                let gap = contact.obstacle.distance(place, 0.0).value - contact.radius;
                // Elements without nodes at the contacts represent the shape of the shoot between
                // them.
                if gap < -1e-4 * rod.length() {
                    return Err(format!("penetration of {gap:e} m at {time} s"));
                }
            }
        }
        for reaction in shoot.reactions() {
            let friction = all[reaction.obstacle.unwrap()].friction;
            let tangential = (reaction.force.norm_squared() - reaction.normal.powi(2))
                .max(0.0)
                .sqrt();
            // Rounding of the difference of squares is the square root of 1e-16.
            if !(reaction.normal >= 0.0 && tangential <= (friction + 1e-6) * reaction.normal) {
                return Err(format!("{reaction:?} at {time} s"));
            }
        }
    }
    Ok(touching)
}

#[test]
fn random_growing_shoots_that_meet_obstacles_reach_their_end() {
    let (count, mut failures, mut touching) = (number("MORPHOROD_CASES", 12), Vec::new(), 0);
    for seed in 0..count {
        match run(seed) {
            Ok(steps) => touching += u64::from(steps > 0),
            Err(failure) => failures.push((seed, failure)),
        }
    }
    println!("{touching} of {count} shoots touch, failures: {failures:?}");
    // With 60 cases all shoots reach their end. Some shoots that wind about a pole or slip off its
    // end do not.
    assert!(failures.len() as u64 * 30 <= count, "{failures:?}");
    assert!(
        touching * 2 > count,
        "{touching} of {count} shoots touch an obstacle"
    );
}
