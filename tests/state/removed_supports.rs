//! Shoots whose support is removed while they touch it.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{HOUR, MEMORY, RADIUS, WEIGHT, YOUNG, rod};
use approx::assert_abs_diff_eq;
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::support::{Contact, Cylinder};
use morphorod::tropism::{Proprioception, Response};
use morphorod::{DynLaws, Shoot, Still};
use nalgebra::Vector3;

/// A leaning shoot that sags on a horizontal pole after a few hours of growth.
fn leaning(pole: bool, sensing: bool) -> Shoot<DynLaws> {
    let pole = pole.then_some(Contact {
        obstacle: Cylinder {
            through: Vector3::new(0.025, 0.0, 0.032),
            along: Vector3::y(),
            radius: 2e-3,
        },
        radius: RADIUS,
        friction: 0.0,
    });
    // With sensitivity zero the law has stimuli, and no effect on the shape.
    let law = sensing.then_some(Proprioception { sensitivity: 0.0 }.remembered(MEMORY));
    let builder = rod(YOUNG, 0.04).load(WEIGHT).scene(Still::tilted(0.5));
    let builder = builder.growth(UniformGrowth {
        zone_length: 0.04,
        time: 20.0 * HOUR,
    });
    builder
        .tropism(law)
        .support(pole)
        .into_dyn()
        .build()
        .unwrap()
}

fn run(shoot: &mut Shoot<DynLaws>, hours: f64) {
    let _ = MethodOfSteps::new(600.0)
        .advance(shoot, hours * HOUR)
        .expect("advances");
}

#[test]
fn shoot_whose_support_is_removed_or_not_restored_is_one_that_never_had_it() {
    for sensing in [false, true] {
        let (mut held, mut free) = (leaning(true, sensing), leaning(false, sensing));
        run(&mut held, 10.0);
        run(&mut free, 11.0);
        assert_eq!(held.reactions().len(), 1);
        let removed = held
            .with_model(leaning(false, sensing).model().clone())
            .unwrap();
        let mut restored = leaning(false, sensing);
        restored.restore(held.state()).unwrap();
        for mut shoot in [removed, restored] {
            assert!(shoot.reactions().is_empty());
            run(&mut shoot, 11.0);
            assert!(shoot.reactions().is_empty());
            // Growth alone does not depend on the shape, so both have the same equilibrium. Its
            // frames have errors of 1e-11 rad.
            assert_abs_diff_eq!(
                InNorm(shoot.tip()),
                InNorm(free.tip()),
                epsilon = 1e-11 * free.rod().length()
            );
            let [couple, expected] =
                [&shoot, &free].map(|shoot| shoot.profile().at(0.0).unwrap().couple);
            // The couple at the base is the weight times the distance of its centre.
            let weight = free.profile().at(0.0).unwrap().force.norm();
            assert_abs_diff_eq!(
                (couple - expected).norm(),
                0.0,
                epsilon = 1e-11 * weight * free.rod().length()
            );
        }
    }
}
