//! Scenes drawn at random over wide ranges: each ends in a sound state, or in an error that leaves
//! the shoot unchanged.
//!
//! `MORPHOROD_SCENES=100000 MORPHOROD_SEED=7 cargo test --workspace --test all random_scenes
//! -- --nocapture` draws more and other scenes, and prints their outcomes and the slowest of them.

use std::time::Instant;

use crate::fixtures::random::{Draw, number};
use crate::fixtures::shoots::assert_sound;
use morphorod::constitutive::{Lignifying, LinearElastic};
use morphorod::growth::{CosineProfile, LinearProfile, Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Distributed, PointForce, Weight, Whirl};
use morphorod::tropism::{
    Gravitropism, Memory, Oscillator, Proprioception, Response, SettledStatoliths, Statoliths,
};
use morphorod::{DynLaws, Order, Section, Shoot, ShootBuilder, State, Still, checkpoint};

/// Outcome of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum End {
    Refused,
    Error,
    Answer,
}

fn scene(seed: u64) -> End {
    let mut draw = Draw::new(seed);
    let radius = draw.log(1e-5, 0.1);
    let length = radius * draw.log(5.0, 2000.0);
    let young = LinearElastic {
        youngs_modulus: draw.log(1e4, 1e11),
        poissons_ratio: draw.uniform(-0.9, 0.5),
    };
    let stiffening = if draw.chance(0.5) {
        draw.log(1.0, 1e6)
    } else {
        1.0
    };
    let lignifying = Lignifying {
        young,
        mature_modulus: stiffening * young.youngs_modulus,
        time: draw.log(1.0, 1e7),
    };
    let order =
        [Order::Two, Order::Four, Order::Six, Order::Eight][draw.uniform(0.0, 4.0) as usize];
    let (flat, tapers) = (draw.log(0.3, 3.0), draw.chance(0.3));
    let builder = Shoot::builder(lignifying)
        .length(length)
        .elements(1 + draw.log(1.0, 10.0) as usize)
        .order(order)
        .merge_tolerance(draw.log(1e-8, 1e-2))
        .section(move |s| {
            let r = if tapers {
                radius * (1.0 - 0.7 * s / length)
            } else {
                radius
            };
            Section::ellipse(r, r * flat)
        })
        .scene(Still::tilted(draw.uniform(-3.2, 3.2)));
    let weight = draw.chance(0.8).then(|| Weight {
        density: draw.log(1.0, 2e4),
    });
    // Forces are given as multiples of the weight of a shoot of water.
    let force = draw.log(1e-6, 10.0) * 1e4 * radius * radius * length;
    let wind = draw
        .chance(0.3)
        .then(|| Distributed(draw.vector(force / length)));
    let pull = draw.chance(0.3).then(|| {
        let pull = draw.vector(force);
        ApicalForce(move |t: f64| pull * (1.0 + (1e-3 * t).sin()))
    });
    let tug = draw.chance(0.2).then(|| PointForce {
        force: draw.vector(force),
        initial_apex_distance: length * draw.unit(),
    });
    let whirl = draw.chance(0.2).then(|| Whirl {
        force,
        period: draw.log(60.0, 1e5),
        turns: draw.uniform(0.1, 5.0),
    });
    grow(
        builder.load((weight, wind, pull, (tug, whirl))).into_dyn(),
        draw,
        length,
    )
}

fn grow(builder: ShootBuilder<DynLaws>, mut draw: Draw, length: f64) -> End {
    let (zone_length, time) = (length * draw.log(0.2, 20.0), draw.log(600.0, 1e7));
    let ongoing = Ongoing(UniformGrowth {
        zone_length: zone_length.max(length),
        time,
    });
    let builder = match draw.uniform(0.0, 5.0) as usize {
        0 => builder
            .growth(UniformGrowth { zone_length, time })
            .into_dyn(),
        1 => builder
            .growth(LinearProfile { zone_length, time })
            .into_dyn(),
        2 => builder
            .growth(CosineProfile { zone_length, time })
            .into_dyn(),
        3 => builder.growth(ongoing).into_dyn(),
        _ => builder,
    };
    steer(builder, draw)
}

fn steer(builder: ShootBuilder<DynLaws>, mut draw: Draw) -> End {
    let mut memory = || Memory {
        time: draw.log(1e-3, 1e5),
        delay: if draw.chance(0.15) {
            0.0
        } else {
            draw.log(1.0, 1e4)
        },
    };
    let memories = [memory(), memory(), memory()];
    let oscillator = draw
        .chance(0.4)
        .then(|| Oscillator::new(draw.log(1e-3, 10.0), draw.log(60.0, 1e5)));
    let settled = draw.chance(0.5).then(|| {
        Gravitropism {
            sensitivity: draw.log(0.01, 100.0),
            perception: SettledStatoliths,
        }
        .remembered(memories[0])
    });
    let slow = draw.chance(0.4).then(|| {
        let statoliths = Statoliths {
            avalanche_time: draw.log(1e-4, 1e5),
        };
        Gravitropism {
            sensitivity: draw.log(0.01, 100.0),
            perception: statoliths,
        }
        .remembered(memories[1])
    });
    let bend = draw.chance(0.7).then(|| {
        Proprioception {
            sensitivity: draw.log(0.1, 1000.0),
        }
        .remembered(memories[2])
    });
    match builder
        .tropism((oscillator, settled, slow, bend))
        .into_dyn()
        .build()
    {
        Ok(shoot) => run(shoot, draw),
        Err(_) => End::Refused,
    }
}

fn run(mut shoot: Shoot<DynLaws>, mut draw: Draw) -> End {
    let size = draw.log(1.0, 1e4);
    let (twice, saved) = (draw.chance(0.1), draw.chance(0.1));
    let mut end = End::Answer;
    for _ in 0..12 {
        let until = shoot.time() + 4.0 * size * draw.unit();
        let before = shoot.state().clone();
        let answer = MethodOfSteps::new(size).step(&mut shoot, until);
        if let Err(error) = &answer {
            if std::env::var("MORPHOROD_SHOW").is_ok() {
                println!("{error}");
            }
            assert!(before == *shoot.state(), "{answer:?} changed the shoot");
            end = End::Error;
            break;
        }
        assert_sound(&shoot);
        // A state that is saved and read between two steps has the same bits.
        if saved {
            let read: State =
                checkpoint::from_bytes(&checkpoint::to_bytes(shoot.state()).unwrap()).unwrap();
            assert!(read == *shoot.state());
            shoot.restore(&read).unwrap();
        }
        // A repeated call gives the same bits.
        if twice {
            let after = shoot.state().clone();
            shoot.restore(&before).unwrap();
            assert!(
                MethodOfSteps::new(size).step(&mut shoot, until) == answer
                    && after == *shoot.state()
            );
        }
    }
    end
}

#[test]
fn random_scenes_end_in_a_sound_state_or_an_error() {
    let (scenes, seed) = (
        number("MORPHOROD_SCENES", 2000),
        number("MORPHOROD_SEED", 1),
    );
    let mut ends = std::collections::BTreeMap::new();
    let mut slowest = (0.0, 0);
    for k in 0..scenes {
        let clock = Instant::now();
        let found =
            std::panic::catch_unwind(|| scene(seed.wrapping_mul(1_000_003).wrapping_add(k)));
        let end = found.unwrap_or_else(|_| panic!("scene {k} of seed {seed}"));
        *ends.entry(end).or_insert(0_u64) += 1;
        let time = clock.elapsed().as_secs_f64();
        if time > 0.5 && std::env::var("MORPHOROD_SHOW").is_ok() {
            println!("number {k}: {time:.2} s, {end:?}");
        }
        if time > slowest.0 {
            slowest = (time, k);
        }
    }
    println!(
        "{scenes} scenes: {ends:?}; the slowest, number {}, took {:.2} s",
        slowest.1, slowest.0
    );
    // At least a third of the scenes must run for the test to be meaningful.
    assert!(
        3 * ends.get(&End::Answer).copied().unwrap_or(0) > scenes,
        "{ends:?}"
    );
}
