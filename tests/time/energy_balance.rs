//! Balance of energy over a run: the work of growth, of loads and of obstacles is the change of the energies.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::fixtures::shoots::{HOUR, MEMORY, RADIUS, WEIGHT, YOUNG};
use morphorod::constitutive::{Constitutive, Lignifying};
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

/// A pole across the shoot, which moves at a constant velocity (m/s).
struct Pole(Vector3<f64>);

impl Obstacle for Pole {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        let through = Vector3::new(0.035, 0.0, -0.0065) + self.0 * time;
        Cylinder { through, along: Vector3::y(), radius: 0.005 }.distance(place, time)
    }
    fn velocity(&self, _: &Vector3<f64>, _: f64) -> Vector3<f64> {
        self.0
    }
}

/// The force on the apex at a time, N: a fraction of the weight of 0.4 to 0.6 mN.
fn force(t: f64) -> Vector3<f64> {
    let phase = TAU * t / PERIOD;
    Vector3::new(1e-6 * phase.cos(), 2e-6 * (0.7 * phase).sin(), -5e-6 * (1.0 + 0.3 * phase.sin()))
}

const OSCILLATOR: Oscillator =
    Oscillator { sensitivity: 0.05, period: PERIOD, phase: 0.4, handedness: Handedness::Counterclockwise };

/// A horizontal shoot that grows over a pole in its growth zone. Merging of elements would change the energies.
fn builder(law: impl Constitutive + Send + Sync + 'static) -> ShootBuilder<DynLaws> {
    Shoot::builder(law)
        .length(LENGTH)
        .radius(RADIUS)
        .growth(UniformGrowth { zone_length: 0.04, time: 80.0 * HOUR })
        .load((WEIGHT, ApicalForce(force)))
        .scene(Still::tilted(FRAC_PI_2))
        .merge_tolerance(0.0)
        .into_dyn()
}

/// Simpson's rule for three equidistant times, in units of the step.
const SIMPSON: [f64; 3] = [1.0 / 3.0, 4.0 / 3.0, 1.0 / 3.0];
/// Factors of F(tᵢ) · x(tⱼ) in the work ∫ F · dx, the integral for the parabolas through F and x, times six.
const WORK: [[f64; 3]; 3] = [[-3.0, 4.0, -1.0], [-4.0, 0.0, 4.0], [1.0, -4.0, 3.0]];

/// Works of growth, load, friction and pole over two steps, J, by the shapes at their ends. `velocity` is that of the
/// pole (m/s).
fn works(shapes: [&Shoot<DynLaws>; 3], step: f64, velocity: Vector3<f64>) -> [f64; 4] {
    let (mut growth, mut load, mut friction, mut pole) = (0.0, 0.0, 0.0, 0.0);
    for ((shoot, weight), factors) in shapes.into_iter().zip(SIMPSON).zip(WORK) {
        growth += step * weight * shoot.growth_power();
        // The work of a force on the tissue at the initial distance d from the apex.
        let work = |force: &Vector3<f64>, d: f64| {
            let each = shapes.iter().zip(factors).map(|(shoot, factor)| {
                let s = shoot.rod().arc_length_of(LENGTH - d).unwrap();
                shoot.profile().at(s).unwrap().position * (factor / 6.0)
            });
            force.dot(&each.sum::<Vector3<f64>>())
        };
        load += work(&force(shoot.time()), 0.0);
        for reaction in shoot.reactions() {
            let moves = step * weight * reaction.force.dot(&velocity);
            pole += moves;
            friction += work(&reaction.force, reaction.initial_apex_distance) - moves;
        }
    }
    [growth, load, friction, pole]
}

/// Checks the balance over some hours in contact with the pole, which slides all the time. Each work exceeds 1 % of the
/// energy exchanged, except those with the indices in `absent`.
fn check(mut shoot: Shoot<DynLaws>, hours: f64, velocity: Vector3<f64>, absent: &[usize]) {
    let step = 450.0;
    // An error of the equilibrium is a force that does work, too.
    let mut solver = MethodOfSteps::with_solver(step, NewtonSolver::with_tolerance(1e-11));
    solver.advance(&mut shoot, START).unwrap();
    let energy = |shoot: &Shoot<DynLaws>| shoot.energies().elastic + shoot.load_energy(&WEIGHT);
    let start = energy(&shoot);
    // Works with twice the step, with the step, and extrapolated; and the sum of the absolute works.
    let (mut sums, mut exchanged) = ([[0.0; 4]; 3], 0.0);
    for four in 0..(hours * HOUR / (4.0 * step)).round() as u32 {
        let shapes = [0, 1, 2, 3, 4].map(|k| {
            solver.advance(&mut shoot, START + step * f64::from(4 * four + k)).unwrap();
            assert!(matches!(shoot.reactions(), [at] if at.slip == Some(Slip::Slides)));
            shoot.clone()
        });
        let [a, b, c, d, e] = shapes.each_ref();
        let coarse = works([a, c, e], 2.0 * step, velocity);
        let halves = [[a, b, c], [c, d, e]].map(|shapes| works(shapes, step, velocity));
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
    println!("change {change:e} J, works {:?} J, exchanged {exchanged:e} J, errors {errors:?}", sums[2]);
    let [_, _, friction, _] = sums[2];
    assert!(friction < 0.0, "{sums:?}");
    for (i, work) in sums[2].iter().enumerate() {
        assert!(absent.contains(&i) || work.abs() > 0.01 * exchanged, "{i} {sums:?} {exchanged}");
    }
    assert!(((errors[0] / errors[1]).log2() - 4.0).abs() < 0.1, "{errors:?}");
    // The extrapolated works have order six; their errors are 6e-11 and 4e-10.
    assert!(errors[2].abs() < 1e-8, "{errors:?}");
}

#[test]
fn growth_load_and_friction_change_the_energy_over_40_hours() {
    let still = Vector3::zeros();
    let pole = Contact { obstacle: Pole(still), radius: RADIUS, friction: 0.3 };
    let shoot = builder(YOUNG).tropism(OSCILLATOR).support(pole).into_dyn().build().unwrap();
    check(shoot, 40.0, still, &[3]);
}

#[test]
fn moving_pole_memory_and_lignification_enter_the_balance() {
    let velocity = Vector3::new(-2e-8, 0.0, 1e-8);
    let pole = Contact { obstacle: Pole(velocity), radius: RADIUS, friction: 0.3 };
    let tropism = Gravitropism { sensitivity: 0.02, perception: SettledStatoliths }.remembered(MEMORY);
    let law = Lignifying { young: YOUNG, mature_modulus: 2e8, time: 40.0 * HOUR };
    let shoot = builder(law).tropism((OSCILLATOR, tropism)).support(pole).into_dyn().build().unwrap();
    check(shoot, 8.0, velocity, &[1]);
}
