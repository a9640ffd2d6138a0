//! What disturbances grow to before they decay: a closed form, runs in time, and shoots for which there is no answer.

use morphorod::constitutive::LinearElastic;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps, SteadyHistory};
use morphorod::load::Weight;
use morphorod::stability::{Linearisation, StabilityError, StationarySolver, Unstable};
use morphorod::tropism::{Gravitropism, Memory, Proprioception, Response, SettledStatoliths};
use morphorod::{Model, Shoot};

const HOUR: f64 = 3600.0;

/// An upright shoot of 6.5 cm with memories of 12 min.
fn upright(stiffness: f64, growth_time: f64, eta: f64, elements: usize) -> Shoot<impl Model> {
    let memory = Memory { time: 720.0, delay: 720.0 };
    let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: stiffness, poissons_ratio: 0.5 })
        .length(0.065)
        .radius(5e-4)
        .elements(elements)
        .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: growth_time }))
        .tropism((
            Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(memory),
            Proprioception { sensitivity: eta }.remembered(memory),
        ))
        .load(Weight { density: 1000.0 })
        .into_dyn()
        .build()
        .unwrap();
    let _ = StationarySolver::default().solve(&mut shoot).unwrap();
    shoot
}

/// Without weight and gravitropism every disturbance obeys τ ü + u̇ + b u = 0 with u̇ = −b u at first, b = η/τg.
#[test]
fn of_a_shoot_without_weight_all_disturbances_swing_alike() {
    let (tau, eta, growth_time) = (14400.0, 20.0, 20.0 * HOUR);
    let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
        .length(0.05)
        .radius(5e-4)
        .elements(2)
        .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: growth_time }))
        .tropism(Proprioception { sensitivity: eta }.remembered(Memory { time: tau, delay: 0.0 }))
        .into_dyn()
        .build()
        .unwrap();
    let _ = StationarySolver::default().solve(&mut shoot).unwrap();
    let found = Linearisation::about(&shoot).unwrap().transient_growth(10.0 * HOUR).unwrap();
    let (b, decay) = (eta / growth_time, 0.5 / tau);
    let omega = (b / tau - decay * decay).sqrt();
    let sine = (decay - b) / omega;
    let exact = |t: f64| ((-decay * t).exp() * ((omega * t).cos() + sine * (omega * t).sin())).abs();
    let off = |(t, gain): &(f64, f64)| (gain - exact(*t)).abs();
    let worst = found.history.iter().map(off).fold(0.0, f64::max);
    // The estimate is the move by half of the terms. Errors fall as their number squared: a third of the move is left, or less,
    // and 1e-6 is what the repeats of the series leave.
    assert!(worst < found.error.max(1e-6) && found.error <= 1e-4, "{worst:e}, estimated {:e}", found.error);
    // Where u̇ = 0 it has swung back to further than it was.
    let time = (std::f64::consts::PI - (b / (decay * sine + omega)).atan()) / omega;
    assert!((found.gain - exact(time)).abs() < 1e-4 && found.gain > 1.2, "{}", found.gain);
    // A maximum that is off by ε is found where it is flat by ε.
    let flat = (2e-4_f64).sqrt() / omega;
    assert!((found.time - time).abs() < flat, "{} s, {time} s", found.time);
}

/// Lets the disturbance with the largest gain go, and holds the tip's way against the gains.
fn assert_as_in_time(mut shoot: Shoot<impl Model>, least: f64, most: f64) {
    let linear = Linearisation::about(&shoot).unwrap();
    assert_eq!(linear.unstable().unwrap(), Unstable::Finite(0));
    let duration = 11.0 * HOUR;
    let found = linear.transient_growth(duration).unwrap();
    assert!((least..most).contains(&found.gain), "{}", found.gain);
    assert!(found.error <= 1e-4 * found.gain.max(1.0));
    assert!(found.history.iter().all(|(_, gain)| *gain <= found.gain * (1.0 + 1e-12)));
    // The largest deflection stays at 1e-4 of the length, so that cubic terms are 1e-8 of it.
    let size = 1e-4 * 0.065 / found.gain;
    let rest = shoot.tip();
    let mut strain = found.strain.iter();
    shoot.set_intrinsic(|point| point.intrinsic + size * strain.next().expect("all tissue grows"));
    let mut run = MethodOfSteps::new(90.0);
    run.solver.tolerance = 1e-13;
    run.start(&mut shoot, &SteadyHistory).unwrap();
    for &(t, gain) in found.history.iter().step_by(8).skip(1) {
        if t > found.time {
            break;
        }
        let _ = run.advance(&mut shoot, t).unwrap();
        let moved = (shoot.tip() - rest).norm() / size;
        // No disturbance does more than the gain says.
        assert!(moved <= gain + 1e-3 * found.gain, "{moved} beside {gain} at {t} s");
    }
    let _ = run.advance(&mut shoot, found.time).unwrap();
    let moved = (shoot.tip() - rest).norm() / size;
    // The step's own error, 2e-4 of what grows so fast, and the estimate's.
    assert!((moved / found.gain - 1.0).abs() < 1e-3, "{moved} beside {}", found.gain);
}

#[test]
fn disturbances_grow_in_time_as_the_gain_says() {
    assert_as_in_time(upright(1e7, 20.0 * HOUR, 20.0, 4), 1.5, 1.7);
    assert_as_in_time(upright(1e9, 3.0 * HOUR, 2.0, 8), 195.0, 210.0);
}

#[test]
fn the_gain_hardly_depends_on_the_mesh() {
    let gain = |elements: usize| {
        let found = Linearisation::about(&upright(1e9, 3.0 * HOUR, 2.0, elements)).unwrap();
        found.transient_growth(11.0 * HOUR).unwrap().gain
    };
    let (coarse, fine) = (gain(8), gain(12));
    assert!((coarse / fine - 1.0).abs() < 1e-3, "{coarse}, {fine}");
}

#[test]
fn an_unstable_shoot_grows_at_the_rate_of_its_root() {
    let linear = Linearisation::about(&upright(1e7, 17.0 * HOUR, 20.0, 4)).unwrap();
    let rate = linear.rightmost().unwrap().growth_rate();
    assert!(rate > 0.0);
    // Peaks of the gain, once the other roots have decayed.
    let found = linear.transient_growth(60.0 * HOUR).unwrap();
    let peaks: Vec<(f64, f64)> = found
        .history
        .windows(3)
        .filter(|w| w[1].0 > 30.0 * HOUR && w[1].1 > w[0].1 && w[1].1 >= w[2].1)
        .map(|w| w[1])
        .collect();
    let (first, last) = (peaks[0], peaks[peaks.len() - 1]);
    let measured = (last.1 / first.1).ln() / (last.0 - first.0);
    // Peaks are sampled some thirty times a period, so that a hundredth is lost of one.
    assert!((measured / rate - 1.0).abs() < 0.05, "{measured:e} beside {rate:e}");
}

#[test]
fn durations_that_make_no_sense() {
    let linear = Linearisation::about(&upright(1e7, 20.0 * HOUR, 20.0, 4)).unwrap();
    for duration in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = linear.transient_growth(duration).unwrap_err();
        assert!(matches!(error, StabilityError::Parameter(_)) && error.to_string().contains("duration"), "{error}");
    }
    // So short that nothing happens.
    let found = linear.transient_growth(1e-3).unwrap();
    assert!((found.gain - 1.0).abs() < 1e-6, "{}", found.gain);
    // A thousand years.
    let error = linear.transient_growth(3e10).unwrap_err();
    assert!(matches!(error, StabilityError::TooMuchWork { .. }), "{error}");
}
