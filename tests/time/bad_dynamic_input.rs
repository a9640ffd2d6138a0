//! Invalid parameters are refused with an error that names the parameter, its value and the
//! requirement. Nothing panics, and no state contains NaN.

use crate::fixtures::messages::names;
use crate::fixtures::shoots::{
    MEMORY, RADIUS, WEIGHT, YOUNG, gravitropism, growing, reduced, righting, rod,
};
use morphorod::constitutive::{Lignifying, LinearElastic};
use morphorod::growth::{CosineProfile, GrowthLaw, LinearProfile, Ongoing, UniformGrowth};
use morphorod::load::{ApicalForce, Distributed, Pulse, Weight, Whirl};
use morphorod::tropism::{
    Gravitropism, Memory, Oscillator, Proprioception, Response, SettledStatoliths, Statoliths,
};
use morphorod::{ParameterError, Shoot, Still};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

const NOT_POSITIVE: [f64; 6] = [0.0, -0.0, -1.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
const NEGATIVE: [f64; 4] = [-1e-9, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
const NOT_FINITE: [f64; 3] = [f64::INFINITY, f64::NEG_INFINITY, f64::NAN];

/// Asserts that the error contains the name of the parameter, its value and a requirement.
fn assert_names(error: &ParameterError, words: &str, value: f64) {
    assert!(
        error.name.contains(words),
        "“{error}” does not name the {words}"
    );
    assert!(
        error.value.to_bits() == value.to_bits() || error.value.is_nan() && value.is_nan(),
        "“{error}”, not {value}"
    );
    assert!(!error.requirement.is_empty());
    let text = error.to_string();
    assert!(
        text.contains(error.name) && text.contains(error.requirement),
        "{text}"
    );
    assert!(names(&text, error.value), "{text}");
}

/// Asserts that building with each of the values returns an error that names the parameter.
fn refused<T>(words: &str, values: &[f64], build: impl Fn(f64) -> Result<T, ParameterError>) {
    for value in values {
        match build(*value) {
            Ok(_) => panic!("a {words} of {value} was accepted"),
            Err(error) => assert_names(&error, words, *value),
        }
    }
}

#[test]
fn invalid_geometry_and_material_are_refused_by_name() {
    refused("length", &NOT_POSITIVE, |x| {
        rod(YOUNG, x).into_dyn().build()
    });
    refused("radius", &NOT_POSITIVE, |x| {
        Shoot::builder(YOUNG)
            .length(0.05)
            .radius(x)
            .into_dyn()
            .build()
    });
    // The radius is invalid in one part of the shoot only.
    refused("radius", &NOT_POSITIVE, |x| {
        Shoot::builder(YOUNG)
            .length(0.05)
            .section(move |s| if s > 0.04 { x } else { RADIUS })
            .into_dyn()
            .build()
    });
    // The message for a missing value has no digits.
    for (error, setter) in [
        (
            Shoot::builder(YOUNG)
                .radius(RADIUS)
                .into_dyn()
                .build()
                .unwrap_err(),
            "given by `length`",
        ),
        (
            Shoot::builder(YOUNG)
                .length(0.05)
                .into_dyn()
                .build()
                .unwrap_err(),
            "given by `radius`",
        ),
    ] {
        let said = error.to_string();
        assert!(
            error.missing
                && said.contains("missing")
                && said.contains(setter)
                && !said.contains("NaN"),
            "{said}"
        );
    }
    refused("number of elements", &[0.0], |_| {
        rod(YOUNG, 0.05).elements(0).into_dyn().build()
    });
    refused("merge tolerance", &NEGATIVE, |x| {
        growing().merge_tolerance(x).into_dyn().build()
    });

    let elastic = |e: f64, nu: f64| LinearElastic {
        youngs_modulus: e,
        poissons_ratio: nu,
    };
    let with = |law: LinearElastic| rod(law, 0.05).into_dyn().build();
    refused("Young's modulus", &NOT_POSITIVE, |x| with(elastic(x, 0.5)));
    let not_poisson = [
        -1.0,
        -1.5,
        0.5000001,
        1.0,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ];
    refused("Poisson's ratio", &not_poisson, |x| with(elastic(1e7, x)));
    assert!(with(elastic(1e7, 0.5)).is_ok() && with(elastic(1e7, -0.999)).is_ok());
    let lignifying = |law: Lignifying| rod(law, 0.05).into_dyn().build();
    let sound = Lignifying {
        young: YOUNG,
        mature_modulus: 2e9,
        time: 1e5,
    };
    refused("Young's modulus of mature", &NOT_POSITIVE, |x| {
        lignifying(Lignifying {
            mature_modulus: x,
            ..sound
        })
    });
    refused("lignification time", &NOT_POSITIVE, |x| {
        lignifying(Lignifying { time: x, ..sound })
    });
    refused("Young's modulus", &NOT_POSITIVE, |x| {
        lignifying(Lignifying {
            young: elastic(x, 0.5),
            ..sound
        })
    });
    refused("Poisson's ratio", &not_poisson, |x| {
        lignifying(Lignifying {
            young: elastic(1e7, x),
            ..sound
        })
    });
}

fn grown(law: impl GrowthLaw + Send + Sync + 'static) -> Result<(), ParameterError> {
    rod(YOUNG, 0.05).growth(law).into_dyn().build().map(|_| ())
}

#[test]
fn invalid_growth_is_refused_by_name() {
    let (zone_length, time) = (0.07, 72e3);
    refused("length of the growth zone", &NOT_POSITIVE, |x| {
        grown(UniformGrowth {
            zone_length: x,
            time,
        })
    });
    refused("length of the growth zone", &NOT_POSITIVE, |x| {
        grown(LinearProfile {
            zone_length: x,
            time,
        })
    });
    refused("length of the growth zone", &NOT_POSITIVE, |x| {
        grown(CosineProfile {
            zone_length: x,
            time,
        })
    });
    refused("length of the growth zone", &NOT_POSITIVE, |x| {
        grown(Ongoing(UniformGrowth {
            zone_length: x,
            time,
        }))
    });
    refused("growth time", &NOT_POSITIVE, |x| {
        grown(UniformGrowth {
            zone_length,
            time: x,
        })
    });
    refused("growth time", &NOT_POSITIVE, |x| {
        grown(LinearProfile {
            zone_length,
            time: x,
        })
    });
    refused("growth time", &NOT_POSITIVE, |x| {
        grown(CosineProfile {
            zone_length,
            time: x,
        })
    });
    refused("growth time", &NOT_POSITIVE, |x| {
        grown(Ongoing(UniformGrowth {
            zone_length,
            time: x,
        }))
    });
    // A shoot of constant length may be as long as its zone, but not longer.
    let growth = Ongoing(UniformGrowth { zone_length, time });
    let constant = |length: f64| reduced(length, time).growth(growth).into_dyn().build();
    refused(
        "length of a shoot of constant length",
        &[0.0701, 1.0],
        constant,
    );
    assert!(constant(0.07).is_ok());
}

/// User-defined growth law that checks nothing.
struct Careless {
    zone: f64,
    rate: f64,
}

impl GrowthLaw for Careless {
    fn regr(&self, _sigma: f64, _t: f64) -> f64 {
        self.rate
    }
    fn zone_length(&self) -> f64 {
        self.zone
    }
}

#[test]
fn invalid_growth_of_a_law_that_checks_nothing_is_an_error() {
    refused("length of the growth zone", &[0.0, -1.0, f64::NAN], |x| {
        grown(Careless {
            zone: x,
            rate: 1e-5,
        })
    });
    for rate in NOT_FINITE {
        for length in [0.05, 0.09] {
            let law = Careless { zone: 0.07, rate };
            let built = rod(YOUNG, length).growth(law).into_dyn().build();
            let error = built.map(|_| ()).expect_err("an infinite rate");
            assert!(
                error.name.contains("growth rate") && !error.value.is_finite(),
                "{error}"
            );
        }
    }
}

#[test]
fn invalid_tropisms_are_refused_by_name() {
    let gravity = Gravitropism {
        sensitivity: 0.8,
        perception: SettledStatoliths,
    };
    let bend = Proprioception { sensitivity: 20.0 };
    refused("tropic sensitivity", &NOT_FINITE, |x| {
        righting()
            .tropism(
                Gravitropism {
                    sensitivity: x,
                    ..gravity
                }
                .remembered(MEMORY),
            )
            .into_dyn()
            .build()
    });
    refused("proprioceptive sensitivity", &NOT_FINITE, |x| {
        righting()
            .tropism(Proprioception { sensitivity: x }.remembered(MEMORY))
            .into_dyn()
            .build()
    });
    let memory = |time: f64, delay: f64| Memory { time, delay };
    for delay in [0.0, 720.0] {
        refused("memory time", &NOT_POSITIVE, |x| {
            righting()
                .tropism(gravity.remembered(memory(x, delay)))
                .into_dyn()
                .build()
        });
        refused("memory time", &NOT_POSITIVE, |x| {
            righting()
                .tropism((
                    gravity.remembered(MEMORY),
                    bend.remembered(memory(x, delay)),
                ))
                .into_dyn()
                .build()
        });
    }
    refused("reaction time", &NEGATIVE, |x| {
        righting()
            .tropism(gravity.remembered(memory(720.0, x)))
            .into_dyn()
            .build()
    });
    refused("reaction time", &NEGATIVE, |x| {
        righting()
            .tropism((
                gravity.remembered(MEMORY),
                bend.remembered(memory(720.0, x)),
            ))
            .into_dyn()
            .build()
    });
    refused("avalanche time", &NOT_POSITIVE, |x| {
        let statoliths = Statoliths { avalanche_time: x };
        righting()
            .tropism(gravitropism(statoliths))
            .into_dyn()
            .build()
    });
    let oscillator = Oscillator::new(0.2, 1440.0);
    refused("oscillator", &NOT_POSITIVE, |x| {
        righting()
            .tropism(Oscillator {
                period: x,
                ..oscillator
            })
            .into_dyn()
            .build()
    });
    refused("oscillator", &NOT_FINITE, |x| {
        righting()
            .tropism(Oscillator {
                sensitivity: x,
                ..oscillator
            })
            .into_dyn()
            .build()
    });
    refused("oscillator", &NOT_FINITE, |x| {
        righting()
            .tropism(Oscillator {
                phase: x,
                ..oscillator
            })
            .into_dyn()
            .build()
    });
    // Laws inside an option, a tuple or a box are validated too.
    refused("oscillator", &NOT_POSITIVE, |x| {
        righting()
            .tropism(Some(Oscillator {
                period: x,
                ..oscillator
            }))
            .into_dyn()
            .build()
    });
    refused("oscillator", &NOT_POSITIVE, |x| {
        righting()
            .tropism((
                bend.remembered(MEMORY),
                Box::new(Oscillator {
                    period: x,
                    ..oscillator
                }),
            ))
            .into_dyn()
            .build()
    });
}

#[test]
fn invalid_loads_and_scenes_are_refused_by_name() {
    refused("density", &NEGATIVE, |x| {
        righting().load(Weight { density: x }).into_dyn().build()
    });
    refused("distributed load", &NOT_FINITE, |x| {
        righting()
            .load(Distributed(Vector3::new(0.0, x, 0.0)))
            .into_dyn()
            .build()
    });
    refused("apical force", &NOT_FINITE, |x| {
        righting()
            .load(ApicalForce(move |_| Vector3::new(x, 0.0, 0.0)))
            .into_dyn()
            .build()
    });
    let pulse = Pulse {
        peak: Vector3::x(),
        start: 0.0,
        duration: 720.0,
    };
    refused("apical pulse", &NOT_FINITE, |x| {
        righting()
            .load(Pulse {
                peak: Vector3::new(0.0, x, 0.0),
                ..pulse
            })
            .into_dyn()
            .build()
    });
    refused("apical pulse", &NOT_FINITE, |x| {
        righting()
            .load(Pulse { start: x, ..pulse })
            .into_dyn()
            .build()
    });
    refused("apical pulse", &NOT_POSITIVE, |x| {
        righting()
            .load((
                WEIGHT,
                Pulse {
                    duration: x,
                    ..pulse
                },
            ))
            .into_dyn()
            .build()
    });
    let whirl = Whirl {
        force: 1e-5,
        period: 5000.0,
        turns: 2.0,
    };
    refused("rotating force", &NOT_FINITE, |x| {
        righting()
            .load(Whirl { force: x, ..whirl })
            .into_dyn()
            .build()
    });
    refused("rotating force", &NOT_POSITIVE, |x| {
        righting()
            .load(Whirl { period: x, ..whirl })
            .into_dyn()
            .build()
    });
    refused("rotating force", &NOT_POSITIVE, |x| {
        righting()
            .load((WEIGHT, Whirl { turns: x, ..whirl }))
            .into_dyn()
            .build()
    });
    refused("gravity", &NOT_FINITE, |x| {
        righting()
            .scene(Still {
                gravity: Vector3::new(0.0, 0.0, x),
                ..Still::upright()
            })
            .into_dyn()
            .build()
    });
    let base = |w: f64| UnitQuaternion::new_unchecked(Quaternion::new(w, 0.0, 0.0, 0.0));
    refused("base", &NOT_FINITE, |x| {
        righting()
            .scene(Still {
                base: base(x),
                ..Still::upright()
            })
            .into_dyn()
            .build()
    });
    for w in [0.0, 2.0, 0.5] {
        let built = righting()
            .scene(Still {
                base: base(w),
                ..Still::upright()
            })
            .into_dyn()
            .build();
        assert!(built.is_err(), "a quaternion of norm {w} is not a rotation");
    }
}

#[test]
fn steering_without_growth_is_refused_unless_requested() {
    let shoot = || rod(YOUNG, 0.05).tropism(Oscillator::new(0.2, 1440.0));
    let error = shoot()
        .into_dyn()
        .build()
        .map(|_| ())
        .unwrap_err()
        .to_string();
    assert!(error.contains("growth of a shoot that steers"), "{error}");
    assert!(shoot().growth(()).into_dyn().build().is_ok());
    assert!(rod(YOUNG, 0.05).into_dyn().build().is_ok());
}
