use super::*;
use crate::equilibrium::line::samples::{BENDING, Yielding};
use crate::reference_element::Order;
use crate::section::Section;
use crate::so3;

/// An element with arbitrary data, in units in which everything is of order one.
#[derive(Clone)]
struct Sample {
    reference: &'static ReferenceElement,
    frames: [UnitQuaternion<f64>; 2],
    rotations: Vec<Vector3<f64>>,
    points: Vec<MaterialPoint>,
    forces: Vec<Vector3<f64>>,
    inside: Vec<PointReaction>,
    material: &'static (dyn Constitutive + Sync),
}

const LAWS: [&(dyn Constitutive + Sync); 2] = [&BENDING, &Yielding];

fn sample(order: Order, material: &'static (dyn Constitutive + Sync)) -> Sample {
    // Irrational multiples of an integer have no special direction or magnitude.
    let mut state = 0.0_f64;
    let mut next = move || {
        state += 1.0;
        (state * 2.399_963).sin() * 0.8
    };
    let mut vector = move || Vector3::new(next(), next(), next());
    let p = order.points();
    let start = so3::exp(&vector());
    let rotations: Vec<_> = (0..p).map(|_| vector()).collect();
    let end = start * so3::exp(&rotations[p - 1]);
    let points: Vec<MaterialPoint> = (0..p)
        .map(|_| MaterialPoint {
            intrinsic: vector(),
            jacobian: 1.3,
            apex_distance: 0.0,
            initial_apex_distance: 0.0,
            exit_time: f64::INFINITY,
            section: Section::circle(1.0),
        })
        .collect();
    let forces = (0..p).map(|_| vector()).collect();
    // The elements of a rod with shear or stretch have no reactions inside.
    let places = if material
        .line_response(&Tissue::of(&points[0], 0.0), &Vector3::x())
        .is_none()
    {
        2
    } else {
        0
    };
    let reaction = |i| PointReaction {
        element: 0,
        x: [0.3, 0.8][i],
        force: vector(),
        couple: Vector3::zeros(),
    };
    let inside = (0..places).map(reaction).collect();
    Sample {
        reference: ReferenceElement::of(order),
        frames: [start, end],
        rotations,
        points,
        forces,
        inside,
        material,
    }
}

fn evaluate<const P: usize>(s: &Sample) -> (f64, ElementSystem) {
    let mut system = ElementSystem::default();
    let energy = system.evaluate::<P, true>(&s.material, &s.data());
    (energy, system)
}

impl Sample {
    fn data(&self) -> ElementData<'_> {
        ElementData {
            reference: self.reference,
            frame: &self.frames[0],
            rotations: &self.rotations,
            points: &self.points,
            forces: &self.forces,
            inside: &self.inside,
            time: 0.0,
        }
    }

    /// Rotates the last frame and the first about their own axes, at fixed interior rotation
    /// vectors.
    fn turned(&self, last: &Vector3<f64>, first: &Vector3<f64>) -> Self {
        let frames = [
            self.frames[0] * so3::exp(first),
            self.frames[1] * so3::exp(last),
        ];
        let mut rotations = self.rotations.clone();
        if let Some(end) = rotations.last_mut() {
            *end = so3::log(&(frames[0].inverse() * frames[1]));
        }
        Self {
            frames,
            rotations,
            ..self.clone()
        }
    }
}

/// The gradient with respect to rotations of both frames, at fixed interior rotation vectors.
fn frame_gradient<const P: usize>(s: &Sample) -> [f64; 6] {
    let (_, system) = evaluate::<P>(s);
    let (end, whole) = (system.gradient[P - 1], system.gradient[P]);
    let (g1, g0) = (system.chain.tr_mul(&end), whole - system.chain * end);
    [g1.x, g1.y, g1.z, g0.x, g0.y, g0.z]
}

fn unit(i: usize, h: f64) -> (Vector3<f64>, Vector3<f64>) {
    let mut v = [Vector3::zeros(); 2];
    v[i / 3][i % 3] = h;
    (v[0], v[1])
}

#[test]
fn gradient_matches_differences_of_the_energy() {
    for material in LAWS {
        let s = sample(Order::Six, material);
        let gradient = frame_gradient::<3>(&s);
        for (i, value) in gradient.iter().enumerate() {
            let h = 1e-5;
            let energy = |h: f64| {
                let (last, first) = unit(i, h);
                evaluate::<3>(&s.turned(&last, &first)).0
            };
            // Central difference: h² times a third derivative of order ten, and rounding 1e-16/h.
            assert!(((energy(h) - energy(-h)) / (2.0 * h) - value).abs() < 1e-8);
        }
    }
}

#[test]
fn condensed_hessian_without_interior_matches_differences_of_the_gradient() {
    // With one Gauss point there is no interior, so the condensed blocks are the whole Hessian. It
    // is symmetric in the chart exp(φ̂), the difference of the gradient is one in moving frames:
    // they differ by the antisymmetric part, half the couple.
    for material in LAWS {
        let s = sample(Order::Two, material);
        let (_, mut system) = evaluate::<1>(&s);
        let mut inertia = Inertia::default();
        let blocks = system.condense::<1>(&s.data(), 0.0, &mut inertia);
        let h = 1e-5;
        for i in 0..6 {
            for j in 0..6 {
                let difference = |i: usize, j: usize| {
                    let (plus, minus) = (unit(j, h), unit(j, -h));
                    (frame_gradient::<1>(&s.turned(&plus.0, &plus.1))[i]
                        - frame_gradient::<1>(&s.turned(&minus.0, &minus.1))[i])
                        / (2.0 * h)
                };
                let expected = 0.5 * (difference(i, j) + difference(j, i));
                let value = match (i / 3, j / 3) {
                    (0, 0) => blocks.h11[(i, j)],
                    (1, 1) => blocks.h00[(i - 3, j - 3)],
                    (1, 0) => blocks.h01[(i - 3, j)],
                    _ => blocks.h01[(j - 3, i)],
                };
                assert!(
                    (value - expected).abs() < 1e-7,
                    "({i}, {j}): {value} against {expected}"
                );
            }
        }
    }
}

#[test]
fn hessian_matches_differences_of_the_gradient() {
    for material in LAWS {
        let s = sample(Order::Eight, material);
        let (_, system) = evaluate::<4>(&s);
        let h = 1e-5;
        for j in 0..12 {
            let gradient = |h: f64| {
                let mut moved = s.clone();
                moved.rotations[j / 3][j % 3] += h;
                evaluate::<4>(&moved).1.gradient
            };
            let (plus, minus) = (gradient(h), gradient(-h));
            for i in j..15 {
                let expected = (plus[i / 3][i % 3] - minus[i / 3][i % 3]) / (2.0 * h);
                let value = system.hessian.rows[j].as_flattened()[i];
                assert!(
                    (value - expected).abs() < 1e-6,
                    "({i}, {j}): {value} against {expected}"
                );
            }
        }
    }
}

#[test]
fn rows_of_a_chord_are_the_gradients_of_the_work_of_unit_forces_at_its_end() {
    let mut s = sample(Order::Eight, &BENDING);
    s.inside.clear();
    // The rows are not reduced, since the interior was not eliminated.
    let (_, free) = evaluate::<4>(&s);
    for x in [0.0, 0.3, 0.8] {
        let rows = free.chord_rows::<4>(&s.material, &s.data(), x);
        for (k, row) in rows.iter().enumerate() {
            let force = Vector3::ith(k, 1.0);
            let inside = vec![PointReaction {
                element: 0,
                x,
                force,
                couple: Vector3::zeros(),
            }];
            let (_, loaded) = evaluate::<4>(&Sample {
                inside,
                ..s.clone()
            });
            for n in 0..=4 {
                // Rounding of gradients of order one.
                let difference = free.gradient[n] - loaded.gradient[n] - vector_at(row, 3 * n);
                assert!(difference.norm() < 1e-13, "{x} {k} {n}: {difference}");
            }
        }
    }
}
