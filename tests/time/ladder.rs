//! What a scene lacks costs nothing: a ladder of scenes, from a bare rod to the full shoot, by counts that no machine changes.

use std::f64::consts::FRAC_PI_2;

use crate::fixtures::shoots::{BETA, DAY, ETA, HOUR, MEMORY, RADIUS, STATOLITHS, WEIGHT, YOUNG};
use morphorod::constitutive::Lignifying;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps, Statistics};
use morphorod::tropism::{Gravitropism, Oscillator, Proprioception, Response, SettledStatoliths};
use morphorod::{Model, Shoot, ShootBuilder, Still};

/// Of two hours in steps of 90 s on four elements of order eight: what was counted, and the bytes of the state at the end for
/// every material point.
fn climb(builder: ShootBuilder<impl Model>) -> (Statistics, usize) {
    let mut shoot = builder.build().unwrap();
    let cost = MethodOfSteps::new(90.0).advance(&mut shoot, 2.0 * HOUR).unwrap();
    let bytes = postcard::to_allocvec(shoot.state()).unwrap().len() / shoot.rod().points().len();
    println!(
        "{:>4} steps {:>4} equilibria {:>4} iterations {:>4} gradients {bytes:>6} bytes a point",
        cost.steps, cost.equilibria, cost.iterations, cost.evaluations
    );
    (cost, bytes)
}

fn rod() -> ShootBuilder<morphorod::Laws<morphorod::constitutive::LinearElastic>> {
    Shoot::builder(YOUNG).length(0.068).radius(RADIUS).elements(4).scene(Still::tilted(0.1))
}

/// `cargo test --workspace --test ladder -- --nocapture` prints the table of docs/performance.md.
#[test]
fn every_rung_costs_what_it_adds() {
    let growth = UniformGrowth { zone_length: 0.07, time: 40.0 * HOUR };
    let gravity = Gravitropism { sensitivity: BETA, perception: SettledStatoliths }.remembered(MEMORY);
    let slow = Gravitropism { sensitivity: BETA, perception: STATOLITHS }.remembered(MEMORY);
    let bend = Proprioception { sensitivity: ETA }.remembered(MEMORY);
    let oscillator = Oscillator::new(0.2, 1440.0);
    let wood = Lignifying { young: YOUNG, mature_modulus: 2e9, time: 6.0 * DAY };
    let (bare, bare_bytes) = climb(rod());
    // Nothing acts: the first guess is the answer, with one tangent to prove it.
    assert!(bare.iterations == bare.equilibria && bare.halvings == 0, "{bare:?}");
    let (heavy, heavy_bytes) = climb(rod().load(WEIGHT));
    // At rest it stays: no history is kept of it, and no more tangents than equilibria but for the first.
    assert!(heavy.equilibria == bare.equilibria && heavy_bytes == bare_bytes);
    assert!(heavy.iterations < heavy.equilibria + 6, "{heavy:?}");
    let (growing, growing_bytes) = climb(rod().load(WEIGHT).growth(growth));
    // It grows by 5 %: the same elements, and a little more for each new boundary.
    assert!(growing.equilibria == heavy.equilibria && growing_bytes < heavy_bytes + 64, "{growing:?} {growing_bytes}");
    let (one, one_bytes) = climb(rod().load(WEIGHT).growth(growth).tropism(gravity));
    // Two variables, their rates and two stimuli at some dozen levels.
    assert!(one.equilibria == growing.equilibria && one_bytes > growing_bytes, "{one:?} {one_bytes}");
    let (two, two_bytes) = climb(rod().load(WEIGHT).growth(growth).tropism((gravity, bend)));
    assert!(two.equilibria == one.equilibria && two.halvings == 0, "{two:?}");
    // As much again: two variables each.
    let (first, second) = (one_bytes - growing_bytes, two_bytes - one_bytes);
    assert!(second.abs_diff(first) * 10 < first, "{first} and {second} bytes");
    let (swinging, swinging_bytes) = climb(rod().load(WEIGHT).growth(growth).tropism((oscillator, gravity, bend)));
    // It has no variables.
    assert!(swinging_bytes.abs_diff(two_bytes) * 100 < two_bytes, "{two_bytes} and {swinging_bytes} bytes");
    let (settling, settling_bytes) = climb(rod().load(WEIGHT).growth(growth).tropism((oscillator, slow, bend)));
    assert!(settling.equilibria == swinging.equilibria && settling_bytes > swinging_bytes, "{settling:?}");
    let whole = Shoot::builder(wood).length(0.068).radius(RADIUS).elements(4).scene(Still::tilted(0.1)).load(WEIGHT);
    let (whole, _) = climb(whole.growth(growth).tropism((oscillator, slow, bend)));
    assert!(whole.equilibria == settling.equilibria, "{whole:?}");
    // One tangent and one gradient a step, but for the start.
    assert!(whole.iterations <= whole.equilibria + 12 && whole.evaluations <= whole.iterations + 24, "{whole:?}");
}

#[test]
fn what_is_absent_changes_no_count() {
    let constant = Ongoing(UniformGrowth { zone_length: 0.07, time: 20.0 * HOUR });
    let bend = Proprioception { sensitivity: ETA }.remembered(MEMORY);
    let with = || rod().load(WEIGHT).growth(constant).scene(Still::tilted(FRAC_PI_2));
    let plain = climb(with().tropism(bend));
    // Absent laws of every kind, beside the one that is there.
    assert_eq!(climb(with().tropism((bend, ()))), plain);
    assert_eq!(climb(with().tropism((None::<Oscillator>, bend, ((), ())))), plain);
    assert_eq!(climb(with().tropism(bend).load((WEIGHT, ()))), plain);
    assert_eq!(climb(with().tropism(bend).load((WEIGHT, None::<morphorod::load::Whirl>))), plain);
    assert_eq!(size_of_val(&(bend, ())), size_of_val(&bend));
}
