//! The rightmost isolated root lies to the right of the essential spectrum, even if that spectrum
//! is unstable. Mesh refinement changes the root by no more than its estimated error.
//!
//! `MORPHOROD_CASES=300 cargo test --workspace --test all stability::isolated -- --nocapture` tests
//! 300 random shoots. `MORPHOROD_SEED` selects other shoots.

use std::time::Instant;

use morphorod::stability::{Linearisation, Refinement, Root, StabilityError, solve_steady_state};
use morphorod::tropism::{Memory, Statoliths};
use morphorod::{DynLaws, Shoot, ShootParameters, Still};

use crate::fixtures::random::{Draw, number};
use crate::fixtures::shoots::remembering;
use crate::fixtures::upright::continuous::Upright;

#[test]
fn rightmost_root_right_of_an_unstable_essential_spectrum_is_that_of_the_continuous_problem() {
    let memory = |time, delay| Memory { time, delay };
    let cases = [
        (
            0.055,
            49.0,
            memory(400.0, 1300.0),
            memory(110.0, 1850.0),
            19_700.0,
            0.052,
        ),
        (
            0.35,
            28.0,
            memory(1100.0, 10_000.0),
            memory(1100.0, 10_000.0),
            21_000.0,
            0.065,
        ),
        (
            0.2,
            40.0,
            memory(1800.0, 34_000.0),
            memory(1800.0, 34_000.0),
            58_000.0,
            0.060,
        ),
        (
            0.2,
            24.0,
            memory(130.0, 415.0),
            memory(565.0, 3600.0),
            12_200.0,
            0.045,
        ),
    ];
    for (beta, eta, gravity, bending, growth_time, length) in cases {
        let shoot = Upright {
            beta,
            eta,
            gravity,
            bending,
            growth_time,
        };
        for elements in [6, 12] {
            let linear = shoot.linear(length, elements).unwrap();
            let Err(StabilityError::InfinitelyMany { abscissa }) = linear.unstable() else {
                panic!("{shoot:?}")
            };
            let found = linear.rightmost().unwrap().value;
            assert!(
                found.re > abscissa && abscissa > 0.0,
                "{found} and the essential spectrum at {abscissa}"
            );
            let exact = shoot.root(length, found);
            // The last of these shoots has the shortest waves, and a relative error of 4e-7 on six
            // elements. `approx` cannot compare complex numbers without its feature `num-complex`.
            assert!(
                (found - exact).norm() < 1e-6 * exact.norm(),
                "{elements} elements: {found} and {exact}"
            );
        }
    }
}

/// Shoot with random memories, delays, sensitivities, growth time, stiffness, length and tilt. Each
/// of three properties has a probability of one half: an upright base, equal memories of
/// gravitropism and proprioception, and settled statoliths. One shoot in twelve has an unstable
/// essential spectrum.
struct Random {
    gravity: Memory,
    bending: Memory,
    avalanche_time: Option<f64>,
    beta: f64,
    eta: f64,
    growth_time: f64,
    stiffness: f64,
    length: f64,
    tilt: f64,
}

impl Random {
    fn new(seed: u64) -> Self {
        let mut draw = Draw::new(seed);
        let mut memory = || {
            let time = draw.log(60.0, 3000.0);
            Memory {
                time,
                delay: time * draw.log(0.05, 20.0),
            }
        };
        let (gravity, bending) = (memory(), memory());
        let gravity = if draw.chance(0.5) { bending } else { gravity };
        let avalanche_time = draw.chance(0.5).then(|| draw.log(1.0, 600.0));
        let stiffness = draw.log(3e6, 1e8);
        // Greenhill's critical length for this stiffness.
        let greenhill = (7.837 * stiffness * 5e-4_f64.powi(2) / 4.0 / (1000.0 * 9.81)).cbrt();
        Self {
            gravity,
            bending,
            avalanche_time,
            tilt: if draw.chance(0.5) {
                0.0
            } else {
                draw.uniform(0.0, 1.5)
            },
            beta: draw.log(0.05, 5.0),
            eta: draw.log(0.3, 60.0),
            growth_time: draw.log(1e4, 4e5),
            stiffness,
            length: greenhill * draw.uniform(0.1, 0.95),
        }
    }

    fn linear(&self, elements: usize) -> Result<Linearisation, StabilityError> {
        Linearisation::about(&self.shoot(elements)?)
    }

    /// Shoot in its steady state.
    fn shoot(&self, elements: usize) -> Result<Shoot<DynLaws>, StabilityError> {
        let parameters = ShootParameters {
            length: self.length,
            growth_time: self.growth_time,
            youngs_modulus: self.stiffness,
            gravitropic_sensitivity: self.beta,
            proprioceptive_sensitivity: self.eta,
            ..remembering(self.gravity, self.bending)
        };
        let builder = parameters.reduced().elements(elements);
        let builder = builder.scene(Still::tilted(self.tilt));
        let mut shoot = if let Some(avalanche_time) = self.avalanche_time {
            let statoliths = Statoliths { avalanche_time };
            let laws = parameters.steering(statoliths);
            builder.tropism(laws).into_dyn().build()?
        } else {
            builder.into_dyn().build()?
        };
        solve_steady_state(&mut shoot)?;
        Ok(shoot)
    }
}

/// Root to the right of the essential spectrum. `None` if it does not exist, or if the mesh does
/// not resolve the waves there.
fn conclusive(answer: Result<Root, StabilityError>) -> Option<Root> {
    use StabilityError::{NoIsolatedRoot, ToleranceNotMet, UnderResolved};
    match answer {
        Err(NoIsolatedRoot | UnderResolved { .. } | ToleranceNotMet { .. }) => None,
        answer => Some(answer.unwrap()),
    }
}

/// Number of random shoots. The seven default shoots take less than three seconds of processor
/// time. Two of them have an unstable essential spectrum.
fn cases() -> u64 {
    number("MORPHOROD_CASES", 7)
}

#[test]
fn rightmost_roots_of_random_shoots_move_by_no_more_than_their_errors() {
    let seed = number("MORPHOROD_SEED", 17);
    let (mut stationary, mut positive, mut compared, mut refined) = (0, 0, 0, 0);
    for seed in seed..seed + cases() {
        let random = Random::new(seed);
        let elements = 4 + (seed % 5) as usize;
        // A tilted shoot may have no stationary shape that is resolved on these meshes.
        let (Ok(coarse), Ok(fine)) = (random.linear(elements), random.linear(2 * elements)) else {
            continue;
        };
        stationary += 1;
        let abscissa = fine
            .essential_spectrum()
            .unwrap()
            .first()
            .map_or(f64::NEG_INFINITY, |root| root.re);
        positive += u32::from(abscissa > 0.0);
        let isolated = |root: &Root| {
            assert!(
                root.value.re > abscissa,
                "{seed}: {} and {abscissa}",
                root.value
            )
        };
        let roots = [&coarse, &fine].map(|linear| conclusive(linear.rightmost()));
        roots.iter().flatten().for_each(isolated);
        // The error estimate of a root is its distance from the root to which Newton's method
        // converges on the finer mesh. The rightmost root of the finer mesh is expected to be this
        // root. The relative rounding error of the finite differences is 1e-10.
        let moves = |root: &Root, other: &Root, error: f64| {
            let moved = (root.value - other.value).norm();
            assert!(
                moved <= 1.000_001 * error + 1e-10 * root.value.norm(),
                "{seed}: {moved:e} of {error:e}"
            );
        };
        if let [Some(root), Some(other)] = &roots {
            compared += 1;
            moves(
                root,
                other,
                root.clone().with_error(&fine).unwrap().error.unwrap(),
            );
        }
        let meshes = Refinement {
            last: 24,
            ..Refinement::to(1e-5)
        };
        if let Some(root) = conclusive(meshes.rightmost(|elements| random.linear(elements))) {
            isolated(&root);
            // The strain has values at four points of each element, so that this mesh has twice as
            // many elements.
            let finer = random
                .linear(root.strain.len() / 2)
                .unwrap()
                .rightmost()
                .unwrap();
            refined += 1;
            moves(&root, &finer, root.error.unwrap());
        }
    }
    println!(
        "{stationary} of {} shoots are stationary, {positive} with an unstable essential spectrum",
        cases()
    );
    println!("{compared} roots compared on two meshes, {refined} refined");
    assert!(
        compared + refined > 0,
        "none of the shoots has an isolated root that is resolved"
    );
}

/// Refinement increases the number of answers from 180 to 198 of 200 random steady shoots on eight
/// elements. The others are not resolved by two meshes of at most 128 elements, and are refused
/// after three seconds.
#[test]
fn linearisations_that_refine_themselves_answer_with_errors_that_a_finer_mesh_confirms() {
    let seed = number("MORPHOROD_SEED", 17);
    let (mut steady, mut answered, mut refined, mut compared, mut slowest) = (0, 0, 0, 0, 0.0_f64);
    // The number of cases is that of steady shoots, since others have no linearisation.
    let shoots = (seed..).filter_map(|seed| Some((seed, Random::new(seed).shoot(8).ok()?)));
    for (seed, shoot) in shoots.take(cases() as usize) {
        steady += 1;
        let start = Instant::now();
        let found = Linearisation::resolved(&shoot, 1e-6);
        slowest = slowest.max(start.elapsed().as_secs_f64());
        let linear = match found {
            Err(StabilityError::UnderResolved { .. } | StabilityError::ToleranceNotMet { .. }) => {
                continue;
            }
            linear => linear.unwrap(),
        };
        answered += 1;
        let count = linear.unstable();
        assert!(
            matches!(count, Ok(_) | Err(StabilityError::InfinitelyMany { .. })),
            "{seed}: {count:?}"
        );
        let before = Linearisation::about(&shoot).unwrap();
        refined +=
            u32::from(before.unstable() != count || conclusive(before.rightmost()).is_none());
        let root = match linear.rightmost() {
            Err(StabilityError::NoIsolatedRoot) => continue,
            root => root.unwrap(),
        };
        let error = root.error.unwrap();
        assert!(
            error <= 1.000_001e-6 * root.value.norm(),
            "{seed}: {error:e}"
        );
        if linear.elements() > 24 {
            continue;
        }
        // The root of a mesh with half as many elements again. The relative error of the finite
        // differences is 1e-10.
        let finer = Linearisation::refined(&shoot, linear.elements() / 8 * 3 / 2).unwrap();
        let moved = (
            root.clone().with_error(&finer).unwrap().error.unwrap(),
            finer.unstable(),
        );
        assert!(
            moved.0 <= error + 1e-10 * root.value.norm(),
            "{seed}: {:e} of {error:e}",
            moved.0
        );
        assert_eq!(moved.1.is_ok(), count.is_ok());
        assert_eq!(moved.1.unwrap_or(usize::MAX), count.unwrap_or(usize::MAX));
        compared += 1;
    }
    println!(
        "{answered} of {steady} steady shoots, {refined} of them not on their own mesh, {compared} compared"
    );
    println!("the slowest answer or refusal takes {slowest:.1} s");
    assert!(100 * answered >= 99 * steady && compared > 0);
}
