//! Laws that write a wrong steady state. The analyses that use it return an error that names the
//! law.

use morphorod::cycle::{CycleError, RotatingWaveSolver};
use morphorod::stability::{Linearisation, StabilityError, solve_steady_state};
use morphorod::tropism::{Declaration, Growing, Site, TropismLaw};
use morphorod::{DynLaws, Shoot, Still};
use nalgebra::Vector3;

use crate::fixtures::shoots::{HOUR, MEMORY, RADIUS, reduced};
use crate::stability::edges::BENDING;

/// Gravitropism with memory that writes a multiple of the stimuli as its steady state.
#[derive(Clone, Copy)]
struct Upwards {
    /// Ratio of the written state to the stimuli, which is one for the steady state.
    multiple: f64,
    /// Whether `steady` writes the initial state, as its default implementation does.
    provided: bool,
}

impl TropismLaw for Upwards {
    fn declare(&self, to: &mut Declaration) {
        let up = to.stimulus_pair();
        to.memories(2, up, MEMORY.time, Some(MEMORY.delay));
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        stimuli.copy_from_slice(site.along_directors(&site.environment.up()).xy().as_slice());
    }
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        (0..2).for_each(|k| rates[k] = MEMORY.rate(variables[k], stimuli[k]));
    }
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        if self.provided {
            return self.initial(stimuli, variables);
        }
        (0..2).for_each(|k| variables[k] = self.multiple * stimuli[k]);
    }
    fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::new(-past[1], past[0], 0.0) * (0.8 / RADIUS)
    }
}

const RIGHT: Upwards = Upwards {
    multiple: 1.0,
    provided: false,
};

/// Laws that write the initial state, the negative of the steady state, and a state with a relative
/// error of 1e-6.
const WRONG: [Upwards; 3] = [
    Upwards {
        provided: true,
        ..RIGHT
    },
    Upwards {
        multiple: -1.0,
        ..RIGHT
    },
    Upwards {
        multiple: 1.0 + 1e-6,
        ..RIGHT
    },
];

/// Shoot with a length of 6.7 cm on a base tilted by `tilt` (rad). The law is the second of two, so
/// that its variables have the numbers 2 and 3.
fn shoot(law: Upwards, tilt: f64) -> Shoot<DynLaws> {
    let builder = reduced(0.067, 20.0 * HOUR)
        .elements(3)
        .tropism((BENDING, law));
    builder
        .scene(Still::tilted(tilt))
        .into_dyn()
        .build()
        .unwrap()
}

/// Rate (1/s) of variable 2 and its share of the terms. Panics unless the error names the law and
/// this variable.
fn named(error: StabilityError) -> (f64, f64) {
    let message = error.to_string();
    let StabilityError::NotSteady {
        law,
        variable: 2,
        rate,
        share,
    } = error
    else {
        panic!("{message}")
    };
    assert!(
        law.ends_with("Upwards") && message.contains(law),
        "{message}"
    );
    (rate, share)
}

#[test]
fn stationary_shape_for_a_wrong_steady_state_is_refused_and_the_law_is_named() {
    for law in WRONG {
        let mut tilted = shoot(law, 0.3);
        let before = tilted.state().clone();
        let (rate, share) = named(solve_steady_state(&mut tilted).unwrap_err());
        assert_eq!(tilted.state(), &before);
        let multiple = if law.provided { 0.0 } else { law.multiple };
        // The rate is (1 − multiple) x/τm, where |x| ≤ 1. The magnitudes of its terms sum to (1 +
        // |multiple|) |x|/τm.
        let expected = (1.0 - multiple).abs() / (1.0 + multiple.abs());
        approx::assert_relative_eq!(share, expected, epsilon = 0.0, max_relative = 1e-6);
        assert!(rate != 0.0 && rate.abs() < 2.0 / MEMORY.time, "{rate}");
    }
    assert!(solve_steady_state(&mut shoot(RIGHT, 0.3)).is_ok());
}

#[test]
fn linearisation_about_a_wrong_steady_state_is_refused_and_the_law_is_named() {
    let mut right = shoot(RIGHT, 0.3);
    solve_steady_state(&mut right).unwrap();
    assert!(Linearisation::about(&right).is_ok());
    for law in WRONG {
        // The intrinsic strains are those of the stationary shoot with the right law.
        let mut wrong = shoot(law, 0.3);
        wrong.set_intrinsic({
            let mut strains = right
                .rod()
                .points()
                .iter()
                .map(|point| point.intrinsic)
                .collect::<Vec<_>>()
                .into_iter();
            move |_| strains.next().unwrap()
        });
        named(Linearisation::about(&wrong).unwrap_err());
        named(Linearisation::refined(&wrong, 2).unwrap_err());
        // The stimuli of the upright shoot are zero, and the steady state of its variables is zero
        // too.
        assert!(Linearisation::about(&shoot(law, 0.0)).is_ok());
    }
}

#[test]
fn circular_orbit_for_a_wrong_steady_state_is_refused_and_the_law_is_named() {
    let upright = shoot(RIGHT, 0.0);
    let root = Linearisation::about(&upright).unwrap().rightmost().unwrap();
    assert!(
        RotatingWaveSolver::default()
            .from_mode(&upright, &root, 0.03)
            .is_ok()
    );
    for law in WRONG {
        let error = RotatingWaveSolver::default()
            .from_mode(&shoot(law, 0.0), &root, 0.03)
            .unwrap_err();
        let CycleError::Stability(error) = error else {
            panic!("{error}")
        };
        named(error);
    }
}
