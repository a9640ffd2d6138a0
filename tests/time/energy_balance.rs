//! Balance of energy over a run: the work of growth, of loads and of obstacles is the change of the
//! energies.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::fixtures::shoots::{HOUR, MEMORY, RADIUS, WEIGHT, YOUNG, rod};
use morphorod::constitutive::{Constitutive, Lignifying, Timoshenko};
use morphorod::equilibrium::NewtonSolver;
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::ApicalForce;
use morphorod::support::{Contact, Cylinder, Distance, Obstacle, Slip};
use morphorod::tropism::{Gravitropism, Handedness, Oscillator, Response, SettledStatoliths};
use morphorod::{DynLaws, Shoot, ShootBuilder, Still};
use nalgebra::Vector3;

/// Length at t = 0, m.
const LENGTH: f64 = 0.05;
/// Period of the oscillator and of the force on the apex, s.
const PERIOD: f64 = 8.0 * HOUR;
/// Beginning of the balance, s: the short steps after the start are over.
const START: f64 = 4.0 * HOUR;

/// A pole across the shoot, at rest or with a displacement of `velocity` (m/s) times a function of
/// time (s).
#[derive(Clone, Copy)]
struct Pole {
    velocity: Vector3<f64>,
    /// Whether the function is a sine with a period of an hour; otherwise it is the time.
    swings: bool,
}

impl Pole {
    const STILL: Self = Self {
        velocity: Vector3::new(0.0, 0.0, 0.0),
        swings: false,
    };
    /// Rate of the swings, 1/s.
    const RATE: f64 = TAU / HOUR;

    fn velocity_at(&self, time: f64) -> Vector3<f64> {
        if self.swings {
            self.velocity * (Self::RATE * time).cos()
        } else {
            self.velocity
        }
    }
}

impl Obstacle for Pole {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        let time_of_motion = if self.swings {
            (Self::RATE * time).sin() / Self::RATE
        } else {
            time
        };
        let through = Vector3::new(0.035, 0.0, -0.0065) + self.velocity * time_of_motion;
        Cylinder {
            through,
            along: Vector3::y(),
            radius: 0.005,
        }
        .distance(place, time)
    }
    fn velocity(&self, _: &Vector3<f64>, time: f64) -> Vector3<f64> {
        self.velocity_at(time)
    }
}

/// The force on the apex at a time, N: a fraction of the weight of 0.4 to 0.6 mN.
fn force(t: f64) -> Vector3<f64> {
    let phase = TAU * t / PERIOD;
    Vector3::new(
        1e-6 * phase.cos(),
        2e-6 * (0.7 * phase).sin(),
        -5e-6 * (1.0 + 0.3 * phase.sin()),
    )
}

const OSCILLATOR: Oscillator = Oscillator {
    sensitivity: 0.05,
    period: PERIOD,
    phase: 0.4,
    handedness: Handedness::Counterclockwise,
};

/// A horizontal shoot that grows over a pole in its growth zone. Merging of elements would change
/// the energies.
fn builder(law: impl Constitutive + Send + Sync + 'static) -> ShootBuilder<DynLaws> {
    rod(law, LENGTH)
        .growth(UniformGrowth {
            zone_length: 0.04,
            time: 80.0 * HOUR,
        })
        .load((WEIGHT, ApicalForce(force)))
        .scene(Still::tilted(FRAC_PI_2))
        .merge_tolerance(0.0)
        .into_dyn()
}

/// Simpson's rule for three equidistant times, in units of the step.
const SIMPSON: [f64; 3] = [1.0 / 3.0, 4.0 / 3.0, 1.0 / 3.0];
/// Factors of F(tᵢ) · x(tⱼ) in the work ∫ F · dx, the integral for the parabolas through F and x,
/// times six.
const WORK: [[f64; 3]; 3] = [[-3.0, 4.0, -1.0], [-4.0, 0.0, 4.0], [1.0, -4.0, 3.0]];

/// Works of growth, load, friction and pole over two steps, J, by the shapes at their ends.
fn works(shapes: [&Shoot<DynLaws>; 3], step: f64, obstacle: Pole) -> [f64; 4] {
    let (mut growth, mut load, mut friction, mut pole) = (0.0, 0.0, 0.0, 0.0);
    for ((shoot, weight), factors) in shapes.into_iter().zip(SIMPSON).zip(WORK) {
        growth += step * weight * shoot.growth_power();
        // The work of a force on the tissue at the initial distance d from the apex.
        let work = |force: &Vector3<f64>, d: f64| {
            let each = shapes.iter().zip(factors).map(|(shoot, factor)| {
                let s = shoot.rod().arc_length_of(LENGTH - d).unwrap();
                shoot.rod().at(s).unwrap().0 * (factor / 6.0)
            });
            force.dot(&each.sum::<Vector3<f64>>())
        };
        load += work(&force(shoot.time()), 0.0);
        for reaction in shoot.reactions() {
            let moves = step * weight * reaction.force.dot(&obstacle.velocity_at(shoot.time()));
            pole += moves;
            friction += work(&reaction.force, reaction.initial_apex_distance) - moves;
        }
    }
    [growth, load, friction, pole]
}

/// Balance of a run.
struct Balance {
    /// Works of growth, load, friction and pole, extrapolated, J.
    works: [f64; 4],
    /// Sum of the absolute works of all pairs of steps, J.
    exchanged: f64,
    /// Errors relative to the energy exchanged, of the works with twice the step, with the step,
    /// and extrapolated.
    errors: [f64; 3],
}

/// Computes the balance over some hours in contact with the pole, with a step (s).
fn balance(mut shoot: Shoot<DynLaws>, pole: Pole, hours: f64, step: f64) -> Balance {
    // An error of the equilibrium is a force that does work, too.
    let mut solver = MethodOfSteps::with_solver(step, NewtonSolver::with_tolerance(1e-11));
    solver.advance(&mut shoot, START).unwrap();
    let energy = |shoot: &Shoot<DynLaws>| shoot.energies().elastic + shoot.load_energy(&WEIGHT);
    let start = energy(&shoot);
    let (mut sums, mut exchanged) = ([[0.0; 4]; 3], 0.0);
    for four in 0..(hours * HOUR / (4.0 * step)).round() as u32 {
        let shapes = [0, 1, 2, 3, 4].map(|k| {
            solver
                .advance(&mut shoot, START + step * f64::from(4 * four + k))
                .unwrap();
            assert_eq!(shoot.reactions().len(), 1);
            assert!(pole.swings || shoot.reactions()[0].slip == Some(Slip::Slides));
            shoot.clone()
        });
        let [a, b, c, d, e] = shapes.each_ref();
        let coarse = works([a, c, e], 2.0 * step, pole);
        let halves = [[a, b, c], [c, d, e]].map(|shapes| works(shapes, step, pole));
        for i in 0..4 {
            let fine = halves[0][i] + halves[1][i];
            // The rule has order four.
            let extrapolated = fine + (fine - coarse[i]) / 15.0;
            for (sum, work) in sums.iter_mut().zip([coarse[i], fine, extrapolated]) {
                sum[i] += work;
            }
            exchanged += extrapolated.abs();
        }
    }
    let change = energy(&shoot) - start;
    let errors = sums.map(|works| (change - works.iter().sum::<f64>()) / exchanged);
    println!(
        "change {change:e} J, works {:?} J, exchanged {exchanged:e} J, errors {errors:?}",
        sums[2]
    );
    Balance {
        works: sums[2],
        exchanged,
        errors,
    }
}

/// Checks the balance of a shoot that slides on the pole all the time. Each work exceeds 1 % of the
/// energy exchanged, except those with the indices in `absent`.
fn check(shoot: Shoot<DynLaws>, pole: Pole, hours: f64, absent: &[usize]) {
    let Balance {
        works,
        exchanged,
        errors,
    } = balance(shoot, pole, hours, 450.0);
    let [_, _, friction, _] = works;
    assert!(friction < 0.0, "{works:?}");
    for (i, work) in works.iter().enumerate() {
        assert!(
            absent.contains(&i) || work.abs() > 0.01 * exchanged,
            "{i} {works:?} {exchanged}"
        );
    }
    assert!(
        ((errors[0] / errors[1]).log2() - 4.0).abs() < 0.1,
        "{errors:?}"
    );
    // The extrapolated works have order six; their errors are 6e-11 and 4e-10.
    assert!(errors[2].abs() < 1e-8, "{errors:?}");
}

/// A shoot that touches a pole with friction.
fn touching(builder: ShootBuilder<DynLaws>, pole: Pole) -> Shoot<DynLaws> {
    builder
        .support(Contact {
            obstacle: pole,
            radius: RADIUS,
            friction: 0.3,
        })
        .into_dyn()
        .build()
        .unwrap()
}

#[test]
fn growth_load_and_friction_change_the_energy_over_40_hours() {
    let shoot = touching(builder(YOUNG).tropism(OSCILLATOR).into_dyn(), Pole::STILL);
    check(shoot, Pole::STILL, 40.0, &[3]);
}

#[test]
fn moving_pole_memory_and_lignification_enter_the_balance() {
    let pole = Pole {
        velocity: Vector3::new(-2e-8, 0.0, 1e-8),
        swings: false,
    };
    let tropism = Gravitropism {
        sensitivity: 0.02,
        perception: SettledStatoliths,
    }
    .remembered(MEMORY);
    let law = Lignifying {
        young: YOUNG,
        mature_modulus: 2e8,
        time: 40.0 * HOUR,
    };
    check(
        touching(builder(law).tropism((OSCILLATOR, tropism)).into_dyn(), pole),
        pole,
        8.0,
        &[1],
    );
}

#[test]
fn balance_is_less_accurate_while_slip_reverses_and_with_shear() {
    // While slip reverses, friction changes within a step.
    let pole = Pole {
        velocity: Vector3::x() * 1e-6,
        swings: true,
    };
    for (step, stated) in [(300.0, 5e-7), (75.0, 2.5e-8)] {
        let error = balance(touching(builder(YOUNG), pole), pole, 4.0, step).errors[1].abs();
        assert!(
            (0.5 * stated..2.0 * stated).contains(&error),
            "{step}: {error:e}"
        );
    }
    // A line that shears has a kink at the pole.
    let error = balance(
        touching(builder(Timoshenko::circular(YOUNG)), Pole::STILL),
        Pole::STILL,
        4.0,
        300.0,
    )
    .errors[1]
        .abs();
    assert!((0.5e-7..2e-7).contains(&error), "{error:e}");
}
