//! Integration in time from periodic orbits, and orbits of user-defined laws and of forced shoots.

use std::f64::consts::TAU;

use super::cycles::{circle, multipliers, plain, swing};
use super::shoot;
use crate::fixtures::exact_orbit::rate;
use crate::fixtures::in_norm::InNorm;
use crate::fixtures::random::Draw;
use crate::fixtures::shoots::{ETA, HOUR, MEMORY, MINUTE, RADIUS, STATOLITHS, steering};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::cycle::{CycleError, PeriodicSolver};
use morphorod::equilibrium::NewtonSolver;
use morphorod::growth::{GrowthLaw, Ongoing};
use morphorod::integrator::{HistoryFunction, IntegrationError, Integrator, MethodOfSteps};
use morphorod::stability::Linearisation;
use morphorod::tracking::{Search, Track};
use morphorod::tropism::{
    DirectionalTropism, Oscillator, Perception, Proprioception, Response, SettledStatoliths, Site,
    Source,
};
use morphorod::{DynLaws, Model, Shoot};
use nalgebra::{Complex, Vector3};

/// Comparison with the time integrator, an independent method. A small disturbance out of the plane
/// is multiplied by the multiplier in each period.
#[test]
fn disturbance_out_of_the_plane_grows_in_time_by_the_multiplier() {
    let mut shoot = plain(0.067, 4);
    let orbit = swing(&shoot, 0.034, 16);
    let ([_, multiplier], _) = multipliers(&shoot, &orbit);
    let (_, rod) = orbit.largest_excursion(&shoot).unwrap();
    let about = if rod.tip().x.abs() > rod.tip().y.abs() {
        0
    } else {
        1
    };
    let history = orbit.enter(&mut shoot).unwrap();
    // The curvature of the swing is 10 1/m. The final disturbance is 1e-3 of it, and the nonlinear
    // effect on its growth is the square of this ratio. The error of an equilibrium is 1e-8 of the
    // curvature.
    shoot.set_intrinsic(|point| point.intrinsic + Vector3::ith(about, 2e-3));
    let mut run =
        MethodOfSteps::with_solver(orbit.period / 240.0, NewtonSolver::with_tolerance(1e-11));
    run.start(&mut shoot, &history).unwrap();
    let aside = |shoot: &Shoot<DynLaws>| {
        if about == 0 {
            shoot.tip().y
        } else {
            shoot.tip().x
        }
    };
    let mut seen = Vec::new();
    for k in 0..=18 {
        run.advance(&mut shoot, f64::from(k) * orbit.period)
            .unwrap();
        seen.push(aside(&shoot));
    }
    // The part of the disturbance that rotates the swing is constant at equal phases. Differences
    // between successive periods eliminate it. The first eight periods contain decaying parts with
    // multipliers of 0.24, which are reduced to 1e-5.
    let growth = ((seen[18] - seen[17]) / (seen[8] - seen[7])).powf(0.1);
    assert_relative_eq!(growth, multiplier.re, epsilon = 0.0, max_relative = 1e-4);
}

/// Perception of light from a lamp above the shoot, at a given position (m). Tissue perceives the
/// direction to the lamp.
struct Lamp(Vector3<f64>);

impl Perception for Lamp {
    type Signal = [f64; 2];

    fn declare(&self, to: &mut morphorod::tropism::Declaration) -> Source {
        to.with_position().stimulus_pair()
    }

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let light = site.along_directors(&(self.0 - site.position).normalize());
        stimuli.copy_from_slice(&[light.x, light.y]);
    }
}

#[test]
fn shoot_with_a_user_defined_law_has_a_circle_and_a_swing() {
    let lamp = Lamp(Vector3::z() * 0.5);
    let mut shoot = shoot(0.068, 4)
        .tropism((
            DirectionalTropism {
                sensitivity: 0.8,
                perception: lamp,
            }
            .remembered(MEMORY),
            Proprioception { sensitivity: ETA }.remembered(MEMORY),
        ))
        .into_dyn()
        .build()
        .unwrap();
    let circular = circle(&shoot, 0.03);
    assert_eq!(circular.roots(&shoot, 2).unwrap().unstable(), 0);
    // With equal memories the rate is that of every circular orbit and does not depend on the
    // perception.
    assert_relative_eq!(circular.rate, rate(), epsilon = 0.0, max_relative = 1e-10);

    let orbit = swing(&shoot, 0.04, 16);
    let ([_, outside], _) = multipliers(&shoot, &orbit);
    assert!(outside.norm() > 1.1, "{outside}");
    // After three periods the tip returns to its initial position, up to the amplified error of the
    // steps.
    let history = orbit.enter(&mut shoot).unwrap();
    let mut run = MethodOfSteps::new(orbit.period / 240.0);
    run.start(&mut shoot, &history).unwrap();
    let before = shoot.tip();
    run.advance(&mut shoot, 3.0 * orbit.period).unwrap();
    assert_abs_diff_eq!(InNorm(shoot.tip()), InNorm(before), epsilon = 1e-6 * 0.068);
    // The tip is on the opposite side half a period later.
    run.advance(&mut shoot, 3.5 * orbit.period).unwrap();
    let mirrored = Vector3::new(-before.x, -before.y, before.z);
    assert_abs_diff_eq!(
        InNorm(shoot.tip()),
        InNorm(mirrored),
        epsilon = 2e-6 * 0.068
    );
    assert!(orbit.period > 0.9 * TAU / rate());
}

/// Weak oscillator below the onset. The forced orbit is the linear response, and integration in
/// time from this orbit remains on it.
#[test]
fn forced_orbit_of_an_oscillator_is_the_linear_response() {
    let (alpha, period) = (1e-3, 24.0 * MINUTE);
    let still = plain(0.05, 4);
    let linear = Linearisation::about(&still).unwrap();
    let gradient = Vector3::new(
        Complex::from(alpha / RADIUS),
        Complex::new(0.0, -alpha / RADIUS),
        Complex::from(0.0),
    );
    let response = linear.response(TAU / period, &gradient).unwrap();
    let expected = response
        .displacement
        .last()
        .unwrap()
        .fixed_rows::<2>(0)
        .norm()
        / 2.0_f64.sqrt();

    let (gravitropism, proprioception) = steering(SettledStatoliths);
    let mut driven = shoot(0.05, 4)
        .tropism((Oscillator::new(alpha, period), gravitropism, proprioception))
        .into_dyn()
        .build()
        .unwrap();
    let orbit = PeriodicSolver::default().forced(&driven, period).unwrap();
    let other = PeriodicSolver::default().forced(&driven, 1.1 * period);
    assert!(
        matches!(other, Err(CycleError::NotInvariant { .. })),
        "{other:?}"
    );
    let (excursion, _) = orbit.largest_excursion(&driven).unwrap();
    // The radius of the motion of the tip is 4e-5 of the length. The relative nonlinear effect is
    // the square of this ratio.
    assert_relative_eq!(excursion, expected, epsilon = 0.0, max_relative = 1e-6);
    // All disturbances decay.
    let found = orbit.multipliers(&driven, 2).unwrap();
    assert_eq!((found.unstable(), found.trivial), (0, 0.0), "{found:?}");
    let history = orbit.enter(&mut driven).unwrap();
    let mut run = MethodOfSteps::with_solver(period / 64.0, NewtonSolver::with_tolerance(1e-12));
    run.start(&mut driven, &history).unwrap();
    let before = driven.tip();
    run.advance(&mut driven, 5.0 * period).unwrap();
    // The error due to 64 steps in a period is 1e-5 of the excursion.
    assert_abs_diff_eq!(
        InNorm(driven.tip()),
        InNorm(before),
        epsilon = 1e-4 * excursion
    );
}

/// The rate of a user's growth law changes by half of its mean within the period. Integration in
/// time from the forced orbit remains on it.
#[test]
fn forced_orbit_of_a_growth_rate_that_depends_on_time_is_followed_in_time() {
    #[derive(Clone, Debug)]
    struct Rhythm(f64);
    impl GrowthLaw for Rhythm {
        fn regr(&self, _sigma: f64, time: f64) -> f64 {
            (1.0 + 0.5 * (TAU * time / self.0).sin()) / (20.0 * HOUR)
        }
        fn zone_length(&self) -> f64 {
            0.1
        }
    }
    let period = 240.0 * MINUTE;
    let (gravitropism, proprioception) = steering(SettledStatoliths);
    let growth = Ongoing(Rhythm(period));
    let mut driven = shoot(0.05, 4)
        .growth(growth)
        .tropism((Oscillator::new(1e-3, period), gravitropism, proprioception))
        .into_dyn()
        .build()
        .unwrap();
    let orbit = PeriodicSolver::default().forced(&driven, period).unwrap();
    let (excursion, _) = orbit.largest_excursion(&driven).unwrap();
    let history = orbit.enter(&mut driven).unwrap();
    let mut run = MethodOfSteps::with_solver(period / 128.0, NewtonSolver::with_tolerance(1e-12));
    run.start(&mut driven, &history).unwrap();
    let before = driven.tip();
    run.advance(&mut driven, 3.0 * period).unwrap();
    // The error due to 128 steps in a period is 5e-7 of the excursion.
    assert_abs_diff_eq!(
        InNorm(driven.tip()),
        InNorm(before),
        epsilon = 5e-6 * excursion
    );
}

/// The history of an orbit can be evaluated at a time that is NaN without a panic. Laws with other
/// variables are rejected.
#[test]
fn history_of_an_orbit_is_refused_by_other_laws() {
    let mut swinging = plain(0.067, 4);
    let history = swing(&swinging, 0.034, 12).enter(&mut swinging).unwrap();
    let site = Site::new(
        swinging.environment(),
        swinging.rod().frames()[0],
        swinging.rod(),
    );
    let mut variables = [f64::INFINITY; 4];
    history.variables(
        swinging.model().tropism(),
        f64::NAN,
        &site,
        &[],
        &mut variables,
    );
    // The other laws have seven variables instead of four. The history has no values for the
    // additional ones.
    let mut others = shoot(0.067, 4)
        .tropism(steering(STATOLITHS))
        .into_dyn()
        .build()
        .unwrap();
    let refused = MethodOfSteps::new(60.0).start(&mut others, &history);
    assert!(
        matches!(refused, Err(IntegrationError::NotFinite { .. })),
        "{refused:?}"
    );
}

/// A shoot can enter a forced orbit only at the phase of the forcing at which the orbit was
/// computed.
#[test]
fn forced_orbit_is_entered_only_at_its_phase() {
    let period = 24.0 * MINUTE;
    let (gravitropism, proprioception) = steering(SettledStatoliths);
    let laws = (Oscillator::new(1e-3, period), gravitropism, proprioception);
    let mut driven = shoot(0.05, 4).tropism(laws).into_dyn().build().unwrap();
    let orbit = PeriodicSolver::default().forced(&driven, period).unwrap();
    let mut run = MethodOfSteps::new(60.0);
    run.advance(&mut driven, 0.3 * period).unwrap();
    let before = driven.clone();
    assert!(matches!(
        orbit.enter(&mut driven),
        Err(CycleError::Parameter(_))
    ));
    assert!(
        driven.state() == before.state(),
        "an error leaves the shoot unchanged"
    );
    run.advance(&mut driven, 2.0 * period).unwrap();
    assert!(orbit.enter(&mut driven).is_ok());
}

/// The motion of the tip on a periodic orbit has the period of the orbit and only odd harmonics,
/// because the second half of a swing is the mirror image of the first. The search returns at most
/// four oscillations, although more harmonics exceed the noise.
#[test]
fn oscillations_of_the_tip_of_a_nonlinear_swing_are_odd_harmonics() {
    let shoot = plain(0.074, 6);
    let orbit = swing(&shoot, 0.0567, 64);
    let shapes = orbit.shapes(&shoot).unwrap();
    // The last shape is the first shape of the next period.
    let period = &shapes[..64];
    // These tracks contain 4.7 to 15.6 periods of 88 min.
    for count in [300, 450, 610, 830, 980, 1000] {
        let (mut times, mut positions) = (Vec::new(), Vec::new());
        let mut draw = Draw::new(1);
        for k in 0..count {
            let (time, rod) = &period[k % 64];
            times.push((k / 64) as f64 * orbit.period + time);
            // The noise is a ten-thousandth of the largest excursion.
            positions.push(rod.tip().xy() + draw.normal() * 5.7e-6);
        }
        let found = Track::new(times, positions)
            .unwrap()
            .oscillations(&Search::default())
            .unwrap();
        let mut waves = found.oscillations.clone();
        waves.sort_by(|a, b| b.period.total_cmp(&a.period));
        let orders: Vec<_> = waves.iter().map(|wave| wave.harmonic).collect();
        assert_eq!(
            orders,
            [None, Some(3), Some(5), Some(7)],
            "{count}: {waves:?}"
        );
        // The tolerance is three standard errors.
        assert!(
            (waves[0].period - orbit.period).abs() < 3.0 * waves[0].period_error,
            "{count}: {waves:?}"
        );
    }
}
