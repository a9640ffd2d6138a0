//! Counts of work for scenes from a bare rod to the full shoot, which do not depend on the machine.
//! Absent features add no work.

use std::f64::consts::FRAC_PI_2;

use crate::fixtures::shoots::{ETA, HOUR, MEMORY, STATOLITHS, WEIGHT, YOUNG, gravitropism, rod};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps, Statistics};
use morphorod::load::Whirl;
use morphorod::tropism::{Oscillator, Proprioception, Response, SettledStatoliths};
use morphorod::{DynLaws, ShootBuilder, ShootParameters, Still};

/// Statistics of two hours in steps of 90 s on four elements of order eight, and the bytes of the
/// final state per material point.
fn count(builder: ShootBuilder<DynLaws>) -> (Statistics, usize) {
    let mut shoot = builder.build().unwrap();
    let cost = MethodOfSteps::new(90.0)
        .advance(&mut shoot, 2.0 * HOUR)
        .unwrap();
    let bytes = postcard::to_allocvec(shoot.state()).unwrap().len() / shoot.rod().points().len();
    println!(
        "{:>4} steps {:>4} equilibria {:>4} iterations {:>4} gradients {bytes:>6} bytes a point",
        cost.steps, cost.equilibria, cost.iterations, cost.evaluations
    );
    (cost, bytes)
}

fn straight() -> ShootBuilder<DynLaws> {
    rod(YOUNG, 0.068)
        .elements(4)
        .scene(Still::tilted(0.1))
        .into_dyn()
}

/// `cargo test --workspace --test all ladder -- --nocapture` prints the table of
/// docs/performance.md.
#[test]
fn each_added_feature_adds_only_its_own_cost() {
    let paper = ShootParameters::default();
    let growth = paper.growth();
    let (gravity, bend) = paper.steering(SettledStatoliths);
    let slow = gravitropism(STATOLITHS);
    let oscillator = paper.oscillator();
    let (bare, bare_bytes) = count(straight());
    // No load or law acts. The initial guess is the solution, and one tangent verifies it.
    assert!(
        bare.iterations == bare.equilibria && bare.halvings == 0,
        "{bare:?}"
    );
    let (heavy, heavy_bytes) = count(straight().load(WEIGHT).into_dyn());
    // The shape is constant: no history is stored, and every equilibrium but the first needs only
    // one tangent.
    assert!(heavy.equilibria == bare.equilibria && heavy_bytes == bare_bytes);
    assert!(heavy.iterations < heavy.equilibria + 6, "{heavy:?}");
    let (growing, growing_bytes) = count(straight().load(WEIGHT).growth(growth).into_dyn());
    // The shoot grows by 5 %, and each new boundary of elements adds a few bytes.
    assert!(
        growing.equilibria == heavy.equilibria && growing_bytes < heavy_bytes + 64,
        "{growing:?} {growing_bytes}"
    );
    let (one, one_bytes) = count(
        straight()
            .load(WEIGHT)
            .growth(growth)
            .tropism(gravity)
            .into_dyn(),
    );
    // The history stores two variables, their rates and two stimuli at about a dozen levels.
    assert!(
        one.equilibria == growing.equilibria && one_bytes > growing_bytes,
        "{one:?} {one_bytes}"
    );
    let (two, two_bytes) = count(
        straight()
            .load(WEIGHT)
            .growth(growth)
            .tropism((gravity, bend))
            .into_dyn(),
    );
    assert!(
        two.equilibria == one.equilibria && two.halvings == 0,
        "{two:?}"
    );
    // The second law adds as much as the first: each has two variables.
    let (first, second) = (one_bytes - growing_bytes, two_bytes - one_bytes);
    assert!(
        second.abs_diff(first) * 10 < first,
        "{first} and {second} bytes"
    );
    let (swinging, swinging_bytes) = count(
        straight()
            .load(WEIGHT)
            .growth(growth)
            .tropism((oscillator, gravity, bend))
            .into_dyn(),
    );
    // The oscillator has no variables.
    assert!(
        swinging_bytes.abs_diff(two_bytes) * 100 < two_bytes,
        "{two_bytes} and {swinging_bytes} bytes"
    );
    let (settling, settling_bytes) = count(
        straight()
            .load(WEIGHT)
            .growth(growth)
            .tropism((oscillator, slow, bend))
            .into_dyn(),
    );
    assert!(
        settling.equilibria == swinging.equilibria && settling_bytes > swinging_bytes,
        "{settling:?}"
    );
    let whole = rod(paper.lignifying(), 0.068)
        .elements(4)
        .scene(Still::tilted(0.1))
        .load(WEIGHT);
    let (whole, _) = count(
        whole
            .growth(growth)
            .tropism((oscillator, slow, bend))
            .into_dyn(),
    );
    assert!(whole.equilibria == settling.equilibria, "{whole:?}");
    // Each step evaluates one tangent and one gradient, except at the start.
    assert!(
        whole.iterations <= whole.equilibria + 12 && whole.evaluations <= whole.iterations + 24,
        "{whole:?}"
    );
}

#[test]
fn absent_laws_change_no_count() {
    let constant = Ongoing(UniformGrowth {
        zone_length: 0.07,
        time: 20.0 * HOUR,
    });
    let bend = Proprioception { sensitivity: ETA }.remembered(MEMORY);
    let with = || {
        straight()
            .load(WEIGHT)
            .growth(constant)
            .scene(Still::tilted(FRAC_PI_2))
    };
    let plain = count(with().tropism(bend).into_dyn());
    // Absent laws of several types are combined with the one that is present.
    assert_eq!(count(with().tropism((bend, ())).into_dyn()), plain);
    assert_eq!(
        count(
            with()
                .tropism((None::<Oscillator>, bend, ((), ())))
                .into_dyn()
        ),
        plain
    );
    assert_eq!(
        count(with().tropism(bend).load((WEIGHT, ())).into_dyn()),
        plain
    );
    assert_eq!(
        count(
            with()
                .tropism(bend)
                .load((WEIGHT, None::<Whirl>))
                .into_dyn()
        ),
        plain
    );
    assert_eq!(size_of_val(&(bend, ())), size_of_val(&bend));
}
