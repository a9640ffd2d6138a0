//! Characteristic roots of held shoots: supports without effect, limits of stiff springs, and exact
//! linear theory.

use crate::fixtures::secant::zero_near;
use crate::fixtures::shoots::{BETA, ETA, HOUR, MEMORY, RADIUS, WEIGHT, reduced};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::load::Load;
use morphorod::stability::{Linearisation, Root, solve_steady_state};
use morphorod::support::{Hold, Joint, Support};
use morphorod::tropism::Memory;
use morphorod::{DynLaws, Shoot, Still};
use nalgebra::{Complex, Matrix2, Matrix3, UnitQuaternion, Vector3};

pub const GROWTH_TIME: f64 = 20.0 * HOUR;
/// Length of the shoots, m. Free ones oscillate with increasing amplitude.
pub const LENGTH: f64 = 0.067;
/// Bending stiffness of the tissue, N m².
const STIFFNESS: f64 = 4.908738521234052e-7;

/// A shoot of constant length (m) on a base with a given lean (rad), with a load and a support.
pub fn shoot(
    (length, lean, elements): (f64, f64, usize),
    load: impl Load + Send + Sync + 'static,
    support: impl Support + Send + Sync + 'static,
) -> Shoot<DynLaws> {
    reduced(length, GROWTH_TIME)
        .elements(elements)
        .load(load)
        .scene(Still::tilted(lean))
        .support(support)
        .into_dyn()
        .build()
        .unwrap()
}

/// A heavy upright shoot with a support, on four elements.
fn heavy(support: impl Support + Send + Sync + 'static) -> Shoot<DynLaws> {
    shoot((LENGTH, 0.0, 4), WEIGHT, support)
}

/// The roots right of a line (1/s).
fn roots(shoot: &Shoot<DynLaws>, line: f64) -> Vec<Root> {
    Linearisation::about(shoot).unwrap().roots(line).unwrap()
}

pub fn upright() -> UnitQuaternion<f64> {
    UnitQuaternion::identity()
}

pub fn top() -> Vector3<f64> {
    Vector3::z() * LENGTH
}

/// A spring of equal stiffness (N/m) in all horizontal directions at the apex.
pub fn lateral(stiffness: f64) -> Hold {
    Hold::apex().spring(
        top(),
        Matrix3::from_diagonal(&Vector3::new(stiffness, stiffness, 0.0)),
    )
}

#[test]
fn supports_without_effect_leave_the_roots_of_the_free_shoot() {
    let free = roots(&heavy(()), -3e-4);
    assert_eq!(
        free.len(),
        2,
        "the sway of the whole shoot, and a decaying mode"
    );
    let weak = Hold::apex().spring(top(), Matrix3::identity() * 1e-12);
    let supports: [(&str, Box<dyn Support + Send + Sync>, f64); 4] = [
        ("a hold without conditions", Box::new(Hold::apex()), 0.0),
        // A spring of 1e-4 N/m changes the first root by 3.6e-5 1/s; the change is proportional to
        // the stiffness.
        ("a weak spring", Box::new(weak), 3.6e-13),
        (
            "a joint without stiffness",
            Box::new(Hold::place(0.5 * LENGTH).elastic_joint(upright(), 0.0)),
            0.0,
        ),
        // An upright shoot does not move vertically, to first order.
        (
            "a vertical spring",
            Box::new(Hold::apex().spring(top(), vertical(1e-3))),
            0.0,
        ),
    ];
    for (name, support, change) in supports {
        let held = roots(&heavy(support), -3e-4);
        assert_eq!(held.len(), free.len(), "{name}");
        for (held, free) in held.iter().zip(&free) {
            assert_eq!(held.multiplicity, 2, "{name}");
            // X is computed by differences with a relative error of 1e-9.
            let error = (held.value - free.value).norm();
            assert!(
                error <= 1.5 * change + 1e-9 * free.value.norm(),
                "{name}: {} {}",
                held.value,
                free.value
            );
        }
    }
}

fn vertical(stiffness: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, stiffness))
}

#[test]
fn roots_with_a_stiff_spring_approach_those_with_a_guide() {
    let guide = roots(
        &heavy(Hold::apex().on_line(top(), Vector3::z_axis())),
        -2.5e-4,
    );
    assert_eq!(guide.len(), 1);
    let errors = [1e2, 1e3, 1e4].map(|stiffness| {
        let spring = roots(&heavy(lateral(stiffness)), -2.5e-4);
        // An intrinsic strain that almost only loads the spring decays slowly. With the guide it
        // does not decay; this root zero is not listed.
        assert_eq!(spring.len(), 2);
        [
            spring[0].value.norm(),
            (spring[1].value - guide[0].value).norm(),
        ]
    });
    for k in [0, 1] {
        // Both are proportional to the compliance of the spring. The relative error of this law is
        // the ratio of the stiffness of the shoot, 5e-3 N/m, to that of the spring, at least 100
        // N/m, times a number of the order of one.
        assert_relative_eq!(
            errors[0][k],
            10.0 * errors[1][k],
            epsilon = 0.0,
            max_relative = 1e-3
        );
        assert_relative_eq!(
            errors[1][k],
            10.0 * errors[2][k],
            epsilon = 0.0,
            max_relative = 1e-3
        );
    }
}

/// The places and frames of a leaning shoot in its steady state are held there. The roots zero of
/// the holds are neither counted nor listed.
#[test]
fn roots_zero_of_rigid_holds_are_removed_on_coarse_meshes_as_well() {
    let leaning = |elements: usize, support: Box<dyn Support + Send + Sync>| {
        let mut shoot = shoot((0.05, 1.0, elements), WEIGHT, support);
        solve_steady_state(&mut shoot).unwrap();
        shoot
    };
    for elements in [2, 4, 6] {
        let free = leaning(elements, Box::new(()));
        let (apex, (_, middle)) = (free.tip(), free.rod().at(0.025).unwrap());
        let holds = [
            Hold::apex().at(apex),
            Hold::apex().on_line(apex, Vector3::x_axis()),
            Hold::apex().on_plane(apex, Vector3::y_axis()),
            Hold::place(0.025).held(middle),
        ];
        for hold in holds {
            // The free shoot is stable, and the holds make it stiffer.
            assert_eq!(
                Linearisation::about(&leaning(elements, Box::new(hold)))
                    .unwrap()
                    .unstable()
                    .unwrap(),
                0
            );
        }
    }
    let apex = leaning(6, Box::new(())).tip();
    let rightmost = |hold: Hold| {
        Linearisation::about(&leaning(6, Box::new(hold)))
            .unwrap()
            .roots(-2.4e-4)
            .unwrap()
    };
    let (rigid, stiff) = (
        rightmost(Hold::apex().at(apex)),
        rightmost(Hold::apex().spring(apex, Matrix3::identity() * 1e4)),
    );
    assert_eq!(
        (rigid.len(), stiff.len()),
        (1, 4),
        "the spring has three roots next to zero"
    );
    // The spring is stiffer than the shoot by a factor of 1e6.
    assert_abs_diff_eq!(
        (rigid[0].value - stiff[3].value).norm(),
        0.0,
        epsilon = 1e-5 * rigid[0].value.norm()
    );
}

/// A plane holds an upright shoot across the plane, and leaves it free in it.
#[test]
fn apex_guided_in_a_vertical_plane_has_the_roots_of_a_free_and_of_a_guided_shoot() {
    let free = roots(&heavy(()), -3e-4);
    let guided = roots(
        &heavy(Hold::apex().on_line(top(), Vector3::z_axis())),
        -3e-4,
    );
    let both = roots(
        &heavy(Hold::apex().on_plane(Vector3::zeros(), Vector3::x_axis())),
        -3e-4,
    );
    assert_eq!(both.len(), free.len() + guided.len());
    for (name, alone, sideways) in [("free", free, false), ("guided", guided, true)] {
        for root in alone {
            // Responses are differences, with a relative error of 1e-9.
            let near = |other: &&Root| (other.value - root.value).norm() < 1e-8 * root.value.norm();
            let found = both
                .iter()
                .find(near)
                .unwrap_or_else(|| panic!("{name}: {}", root.value));
            assert_eq!(found.multiplicity, 1);
            // The middle of the shoot moves across the plane for a root of the guided shoot, along
            // it for a free one.
            let middle = found.displacement[2];
            assert_abs_diff_eq!(
                middle[usize::from(sideways)].norm(),
                0.0,
                epsilon = 1e-6 * middle.norm()
            );
        }
    }
}

/// The function exp(−λ delay)/(λ τg (1 + λ time)) of the memory.
fn filter(z: Complex<f64>) -> Complex<f64> {
    let Memory { time, delay } = MEMORY;
    (-z * delay).exp() / (z * GROWTH_TIME * (z * time + 1.0))
}

/// Without load the couple of the guide's reaction R is R (ℓ − s), so that
/// θ' + κ θ = R (ℓ − s)/((1 + b) E I) with κ = a/(1 + b), θ(0) = 0. The apex stays on the axis,
/// ∫θ ds = 0, if z = κℓ satisfies z²/2 = 1 − (1 + z) exp(−z).
#[test]
fn weightless_shoot_with_a_guided_apex_has_the_roots_of_the_closed_form() {
    let shoot = shoot(
        (LENGTH, 0.0, 8),
        (),
        Hold::apex().on_line(top(), Vector3::z_axis()),
    );
    let found = roots(&shoot, -2.4e-4);
    let condition = |z: Complex<f64>| z * z * 0.5 - 1.0 + (z + 1.0) * (-z).exp();
    let kappa =
        |lambda: Complex<f64>| filter(lambda) * (BETA / RADIUS) / (filter(lambda) * ETA + 1.0);
    assert_eq!(found.len(), 1);
    let (root, guess) = (&found[0], Complex::new(-1.4, -7.6));
    let z = zero_near(condition, guess);
    let exact = zero_near(|lambda| kappa(lambda) * LENGTH - z, root.value);
    // Six elements of order eight have an error of 1.5e-7, eight one of 2e-8.
    assert!(
        (root.value - exact).norm() < 5e-8 * exact.norm(),
        "{} against {exact}, z = {z}",
        root.value
    );
    assert_eq!(root.multiplicity, 2);
}

/// Holds of the upright shoot in the linear theory.
#[derive(Debug, Clone, Copy, Default)]
struct Springs {
    /// Stiffness of a lateral spring at the apex, N/m.
    apex: f64,
    /// Stiffness of an elastic joint at mid-height, N m/rad.
    middle: f64,
    /// Compliance of the base to a couple, rad/(N m).
    base: f64,
}

/// The equations of the upright shoot with tilt θ, couple M = E I [(1 + b) θ' + a θ] and
/// displacement x: M' = −q (ℓ − s) θ − R with the lateral reaction R = −k x(ℓ), M jumps by K θ at
/// the joint, θ(0) = C M(0), M(ℓ) = 0.
impl Springs {
    /// The determinant of the conditions at the apex, by the classical Runge–Kutta method.
    fn value(&self, z: Complex<f64>) -> Complex<f64> {
        let weight = 1000.0 * 9.81 * std::f64::consts::PI * RADIUS * RADIUS;
        let (a, b) = (filter(z) * (BETA / RADIUS), filter(z) * ETA + 1.0);
        let zero = Complex::ZERO;
        let ends = [(Complex::from(1.0), 0.0), (zero, 1.0)].map(|(couple, reaction)| {
            let steps = 800;
            let h = LENGTH / f64::from(steps);
            let rate = |s: f64, [angle, couple, _]: [Complex<f64>; 3]| {
                let bend = (couple / STIFFNESS - a * angle) / b;
                [bend, -angle * (weight * (LENGTH - s)) - reaction, angle]
            };
            let along = |y: [Complex<f64>; 3], k: [Complex<f64>; 3], h: f64| {
                [0, 1, 2].map(|i| y[i] + k[i] * h)
            };
            let mut y = [couple * self.base, couple, zero];
            for step in 0..steps {
                if 2 * step == steps {
                    y[1] += y[0] * self.middle;
                }
                let s = h * f64::from(step);
                let first = rate(s, y);
                let second = rate(s + 0.5 * h, along(y, first, 0.5 * h));
                let third = rate(s + 0.5 * h, along(y, second, 0.5 * h));
                let fourth = rate(s + h, along(y, third, h));
                y = [0, 1, 2].map(|i| {
                    y[i] + (first[i] + (second[i] + third[i]) * 2.0 + fourth[i]) * (h / 6.0)
                });
            }
            [y[1] / 1e-6, (y[2] * self.apex + reaction) / 1e-3]
        });
        Matrix2::from_fn(|row, column| ends[column][row]).determinant()
    }

    fn support(&self) -> Box<dyn Support + Send + Sync> {
        let (middle, apex) = (
            Hold::place(0.5 * LENGTH).elastic_joint(upright(), self.middle),
            lateral(self.apex),
        );
        if self.base == 0.0 {
            return Box::new((middle, apex));
        }
        Box::new((
            Joint::Ball,
            Hold::place(LENGTH).elastic_joint(upright(), 1.0 / self.base),
            middle,
            apex,
        ))
    }
}

#[test]
fn roots_of_elastically_held_shoots_are_those_of_the_continuous_linear_theory() {
    let free = Springs::default();
    let cases = [
        free,
        Springs { apex: 1e-4, ..free },
        Springs { apex: 0.5, ..free },
        Springs {
            middle: 1e-6,
            ..free
        },
        Springs {
            middle: 1e-4,
            ..free
        },
        Springs { base: 1e4, ..free },
        Springs {
            apex: 2e-4,
            middle: 2e-6,
            base: 2e4,
        },
    ];
    for springs in cases {
        let found = roots(&shoot((LENGTH, 0.0, 8), WEIGHT, springs.support()), -2.4e-4);
        assert!(!found.is_empty());
        for root in &found {
            let exact = zero_near(|z| springs.value(z), root.value);
            // Eight elements of order eight leave 4e-7 for the shortest waves, the Runge–Kutta
            // method 1e-10.
            assert!(
                (root.value - exact).norm() < 1e-6 * exact.norm(),
                "{springs:?}: {} {exact}",
                root.value
            );
        }
    }
}
