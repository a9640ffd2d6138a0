//! Orbits of random shoots. The leading root or multiplier is compared with the growth of a
//! disturbance in time.

use std::f64::consts::TAU;

use super::cycles::Parameters;
use super::mode;
use crate::fixtures::random::{Draw, number};
use approx::relative_eq;
use morphorod::cycle::{CycleError, PeriodicSolver, RotatingWaveSolver};
use morphorod::equilibrium::NewtonSolver;
use morphorod::integrator::{HistoryFunction, Integrator, MethodOfSteps};
use morphorod::tropism::{Memory, Site, TropismLaw};
use morphorod::{DynLaws, Shoot};
use nalgebra::{Complex, DMatrix, DVector, Vector3};

/// Largest relative disturbance of the strain for decaying and for growing disturbances. The second
/// is smaller, because the square of a growing disturbance affects the fit.
const SIZES: [f64; 2] = [1e-2, 1e-3];
/// Factor by which the leading part of a decaying or growing disturbance changes during a run,
/// within the bounds on the number of periods.
const CHANGES: [f64; 2] = [1e8, 1e3];
/// Bounds on the number of periods. After the smallest number, faster parts have decayed. The
/// largest number bounds the cost.
const PERIODS: [f64; 2] = [8.0, 40.0];
/// Modulus below which multipliers are not distinguished. After eight periods such a disturbance is
/// below the rounding error.
const SMALL: f64 = 0.15;
/// Number of leading multipliers that are fitted: three pairs.
const FITTED: usize = 6;

/// History of a circular orbit. The stimuli rotate at its rate, and each pair of variables is the
/// memory of a pair of stimuli.
pub(super) struct Circling {
    pub(super) rate: f64,
    pub(super) memory: Memory,
}

impl HistoryFunction for Circling {
    fn is_constant(&self) -> bool {
        false
    }

    fn variables(
        &self,
        _law: &impl TropismLaw,
        t: f64,
        _site: &Site,
        stimuli: &[f64],
        variables: &mut [f64],
    ) {
        let factor = Complex::from_polar(1.0, self.rate * t)
            / Complex::new(1.0, self.rate * self.memory.time);
        for (pair, known) in variables.chunks_exact_mut(2).zip(stimuli.chunks_exact(2)) {
            let value = Complex::new(known[0], known[1]) * factor;
            pair.copy_from_slice(&[value.re, value.im]);
        }
    }
}

fn strain(shoot: &Shoot<DynLaws>) -> DVector<f64> {
    let points = &shoot.rod().points()[shoot.rod().zone()];
    DVector::from_iterator(
        2 * points.len(),
        points
            .iter()
            .flat_map(|point| [point.intrinsic.x, point.intrinsic.y]),
    )
}

/// Factor by which a small disturbance of an orbit grows in a period. The shoot has the strain of
/// the orbit, and `expected` determines the size of the disturbance.
///
/// A shift in time and a rotation are constant from period to period, and the error of the time
/// steps adds a constant increment to them. Second differences of the strain eliminate both.
/// Growing disturbances satisfy a linear recurrence, which is fitted to the last differences.
/// Multipliers of decaying disturbances form clusters that the fit cannot resolve. The result is
/// then the mean decay over the second half of the run.
pub(super) fn growth_in_time(
    mut shoot: Shoot<DynLaws>,
    history: &impl HistoryFunction,
    period: f64,
    delay: f64,
    expected: f64,
) -> f64 {
    let [fewest, most] = PERIODS;
    let change = if expected < 1.0 {
        CHANGES[0]
    } else {
        CHANGES[1]
    };
    let periods = (change.ln() / expected.ln().abs())
        .clamp(fewest, most)
        .ceil();
    let size = if expected < 1.0 {
        SIZES[0]
    } else {
        SIZES[1] * expected.powf(-periods)
    } * strain(&shoot).amax();
    let mut k = 0.0_f64;
    shoot.set_intrinsic(|point| {
        k += 1.0;
        point.intrinsic + Vector3::new(1.0 + 0.3 * (2.0 * k).sin(), 0.8 + 0.3 * k.cos(), 0.0) * size
    });
    let mut run = MethodOfSteps::with_solver(
        (period / 120.0).min(delay),
        NewtonSolver::with_tolerance(1e-12),
    );
    run.start(&mut shoot, history).unwrap();
    let mut strains = vec![strain(&shoot)];
    for k in 1..=periods as u32 {
        run.advance(&mut shoot, f64::from(k) * period).unwrap();
        strains.push(strain(&shoot));
    }
    let mut differences: Vec<_> = strains
        .windows(3)
        .map(|three| &three[2] - &three[1] * 2.0 + &three[0])
        .collect();
    let last = differences.pop().unwrap();
    if expected < 1.0 {
        let half = differences.len() / 2;
        return (last.norm() / differences[half].norm())
            .powf(1.0 / (differences.len() - half) as f64);
    }
    let known = DMatrix::from_columns(&differences[differences.len() - FITTED..]);
    // Smaller singular values result from second-order terms and rounding errors.
    let negligible = 1e-3 * known.norm();
    let coefficients = known.svd(true, true).solve(&last, negligible).unwrap();
    let companion = DMatrix::from_fn(FITTED, FITTED, |row, column| {
        if row == 0 {
            coefficients[FITTED - 1 - column]
        } else {
            f64::from(u8::from(column + 1 == row))
        }
    });
    companion
        .complex_eigenvalues()
        .iter()
        .map(|x| x.norm())
        .fold(0.0, f64::max)
}

/// Panics unless a leading modulus agrees with the growth observed in time.
pub(super) fn assert_growth(what: &str, leading: f64, seen: f64) {
    let equal = if leading < 1.0 {
        // The parts of a cluster interfere. Over a run, the interference changes the sum by less
        // than a factor of ten relative to the decay.
        relative_eq!(seen.ln(), leading.ln(), epsilon = 0.0, max_relative = 0.4)
    } else {
        // The parts that are not fitted and the square of the disturbance cause a relative error of
        // a few hundredths.
        relative_eq!(seen, leading, epsilon = 0.0, max_relative = 0.05)
    };
    assert!(
        equal || leading.max(seen) < SMALL,
        "{what}: {leading} against {seen} in time"
    );
}

/// Random shoot beyond the onset of oscillations, with its parameters.
fn draw(random: &mut Draw) -> (Parameters, Shoot<DynLaws>) {
    loop {
        let youngs_modulus = random.log(7e6, 1.5e7);
        let parameters = Parameters {
            youngs_modulus,
            beta: random.log(0.4, 2.0),
            eta: random.log(5.0, 30.0),
            growth_time: random.log(2.5e4, 1.5e5),
            memory: Memory {
                time: random.log(300.0, 1500.0),
                delay: random.log(200.0, 1500.0),
            },
            length: random.uniform(0.055, 0.076) * (youngs_modulus / 1e7).cbrt(),
        };
        let shoot = parameters.shoot(4);
        if let Ok(root) =
            morphorod::stability::Linearisation::about(&shoot).and_then(|linear| linear.rightmost())
            && root.value.re > 0.0
            && root.value.im > 0.0
        {
            return (parameters, shoot);
        }
    }
}

/// Outcome for an orbit: the leading modulus and the growth in time, or an error.
type Outcome = Result<[f64; 2], CycleError>;

fn of_circle(parameters: &Parameters, shoot: &Shoot<DynLaws>, amplitude: f64) -> Outcome {
    let circle = RotatingWaveSolver::default().from_mode(shoot, &mode(shoot), amplitude)?;
    let found = circle.roots(shoot, 1)?;
    let rightmost = found.roots[0].value.re;
    assert!(
        found.line < 0.0
            && found
                .roots
                .iter()
                .all(|root| root.residual < 1e-3 * circle.rate.abs())
    );
    assert_eq!(found.unstable() > 0, rightmost > 0.0);
    let mut moved = shoot.clone();
    let mut strains = circle.rod.points()[circle.rod.zone()]
        .iter()
        .map(|point| point.intrinsic);
    moved.set_intrinsic(|_| strains.next().unwrap());
    let leading = (rightmost * circle.period()).exp();
    let history = Circling {
        rate: circle.rate,
        memory: parameters.memory,
    };
    Ok([
        leading,
        growth_in_time(
            moved,
            &history,
            TAU / circle.rate.abs(),
            parameters.memory.delay,
            leading,
        ),
    ])
}

fn of_swing(parameters: &Parameters, shoot: &Shoot<DynLaws>, amplitude: f64) -> Outcome {
    let swing = PeriodicSolver::default().from_mode(shoot, &mode(shoot), amplitude)?;
    assert!(swing.error <= 1e-6);
    let found = swing.multipliers(shoot, 1)?;
    let leading = found
        .values
        .iter()
        .map(|one| one.value.norm())
        .fold(0.0, f64::max);
    assert_eq!(found.unstable() > 0, leading > 1.0);
    assert!(found.radius < leading && found.trivial < 1e-3, "{found:?}");
    let mut moved = shoot.clone();
    let history = swing.enter(&mut moved)?;
    Ok([
        leading,
        growth_in_time(
            moved,
            &history,
            swing.period,
            parameters.memory.delay,
            leading,
        ),
    ])
}

/// Comparison of roots of circles and multipliers of swings with integration in time.
/// `MORPHOROD_CASES` sets the number of shoots.
#[test]
fn leading_roots_and_multipliers_of_random_orbits_are_the_growth_of_disturbances_in_time() {
    let (cases, mut random) = (
        number("MORPHOROD_CASES", 1),
        Draw::new(number("MORPHOROD_SEED", 1)),
    );
    let mut counts = [[0; 3]; 2];
    for case in 0..cases {
        let (parameters, shoot) = draw(&mut random);
        for (k, (what, of)) in [
            ("circle", of_circle as fn(&_, &_, f64) -> Outcome),
            ("swing", of_swing),
        ]
        .iter()
        .enumerate()
        {
            let amplitudes = [0.15, 0.3, 0.45, 0.6].map(|share| share * parameters.length);
            let outcomes = amplitudes
                .iter()
                .map(|amplitude| of(&parameters, &shoot, *amplitude));
            let none = |error: &CycleError| {
                matches!(
                    error,
                    CycleError::NotConverged { .. }
                        | CycleError::Stationary { .. }
                        | CycleError::Equilibrium(_)
                )
            };
            let outcome = outcomes
                .into_iter()
                .find(|outcome| !outcome.as_ref().is_err_and(none));
            println!("{case} {what} {parameters:?}: {outcome:?}");
            match outcome {
                Some(Ok([leading, seen])) => {
                    counts[k][0] += 1;
                    assert_growth(&format!("{case} {what} {parameters:?}"), leading, seen);
                }
                Some(Err(_)) => counts[k][1] += 1,
                None => counts[k][2] += 1,
            }
        }
    }
    println!("orbits whose growth agrees, errors that give notice, no orbit: {counts:?}");
    // Documented errors are permitted for at most one orbit in ten.
    for [agree, errors, _] in counts {
        assert!(agree > 0 && errors * 10 <= agree + errors, "{counts:?}");
    }
}
