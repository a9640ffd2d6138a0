//! A growing shoot in a groove: one obstacle of two surfaces, and two obstacles.

use crate::fixtures::shoots::{MEMORY, RADIUS, WEIGHT, YOUNG, rod};
use morphorod::Still;
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::support::{Contact, HalfSpace, Support, Union};
use morphorod::tropism::{Gravitropism, Response, SettledStatoliths};
use nalgebra::Vector3;

#[test]
fn shoot_grows_along_a_groove_as_along_two_obstacles() {
    let friction = 0.2;
    let sides = [-1.0, 0.5].map(|y| {
        let normal = Vector3::new(0.0, y, 1.0);
        Contact {
            obstacle: HalfSpace {
                through: Vector3::z() * -2e-3,
                normal,
            },
            radius: RADIUS,
            friction,
        }
    });
    let groove = Union(sides.map(|contact| contact.obstacle).to_vec());
    let groove: Vec<Contact<Union<HalfSpace>>> = vec![Contact {
        obstacle: groove,
        radius: RADIUS,
        friction,
    }];
    let grow = |support: Box<dyn Support + Send + Sync>| {
        let mut shoot = rod(YOUNG, 0.02)
            .elements(4)
            .growth(UniformGrowth {
                zone_length: 0.04,
                time: 72e3,
            })
            .tropism(
                Gravitropism {
                    sensitivity: 0.02,
                    perception: SettledStatoliths,
                }
                .remembered(MEMORY),
            )
            .load(WEIGHT)
            .scene(Still::tilted(1.7))
            .support(support)
            .into_dyn()
            .build()
            .unwrap();
        let mut integrator = MethodOfSteps::new(600.0);
        let (mut touched, mut changes) = (Vec::new(), 0);
        for hour in 1..=8 {
            changes += integrator
                .advance(&mut shoot, 3600.0 * f64::from(hour))
                .unwrap()
                .contact_changes;
            let contacts: Vec<(usize, usize)> = shoot
                .reactions()
                .iter()
                .filter_map(|at| Some((at.obstacle?, at.surface)))
                .collect();
            touched.push(contacts);
        }
        (shoot.rod().tip(), touched, changes)
    };
    let (tip, touched, changes) = grow(Box::new(groove));
    let (other, separate, others) = grow(Box::new(sides.to_vec()));
    println!("{touched:?} {changes}");
    assert!(
        touched.iter().any(|contacts| contacts.contains(&(0, 1))),
        "{touched:?}"
    );
    assert_eq!((tip, changes), (other, others));
    let surfaces: Vec<Vec<(usize, usize)>> = separate
        .iter()
        .map(|contacts| {
            contacts
                .iter()
                .map(|(obstacle, _)| (0, *obstacle))
                .collect()
        })
        .collect();
    assert_eq!(touched, surfaces);
}
