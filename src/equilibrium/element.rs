//! Energy, gradient and Hessian of one element, and the elimination of its interior rotations.
//!
//! The element's energy is ∫ W(u − u*) − n · p′ ds with the frames R₀ exp(φ̂) exp(θ̂(ξ)): φ turns the whole element,
//! θ is the polynomial through the rotation vectors of its nodes. Derivation: `docs/method.md`, "One element".

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::Inertia;
use crate::constitutive::{Constitutive, Tissue};
use crate::reference_element::{MAX_POINTS, ReferenceElement};
use crate::rod::{MaterialPoint, centre_line_tangent, weighted};
use crate::so3::{Form, hat, s_functions};

/// Largest number of unknowns of an element: p rotation vectors and the turn of the whole.
const MAX: usize = 3 * (MAX_POINTS + 1);

/// What the equilibrium of one element depends on.
pub(super) struct ElementData<'a> {
    pub frame: &'a UnitQuaternion<f64>,
    pub rotations: &'a [Vector3<f64>],
    pub points: &'a [MaterialPoint],
    /// The force n at the material points, in the fixed frame, N.
    pub forces: &'a [Vector3<f64>],
    /// Time, s, from which the age of the tissue follows.
    pub time: f64,
}

/// Derivatives of an element's energy, then the factors of its interior.
///
/// Unknowns in order: rotation vectors of the nodes 1 … p, then the turn φ of the whole element. The first 3 (p − 1)
/// are interior; [`condense`](Self::condense) eliminates them.
#[derive(Debug, Clone)]
pub(super) struct ElementSystem {
    gradient: [Vector3<f64>; MAX_POINTS + 1],
    /// The gradient after the elimination, by components.
    condensed: [f64; MAX],
    /// Lower triangle; after the elimination the interior columns hold the factor L and their diagonal the pivots.
    hessian: [[f64; MAX]; MAX],
    /// Jr(θ)⁻¹ at the last node: a turn of the last frame's change of its rotation vector.
    chain: Matrix3<f64>,
}

/// The element's part of the condensed system: blocks for the turns of its last frame (1) and of its first (0).
pub(super) struct Condensed {
    pub h11: Matrix3<f64>,
    /// Rows of the first frame, columns of the last.
    pub h01: Matrix3<f64>,
    pub h00: Matrix3<f64>,
}

impl Default for ElementSystem {
    fn default() -> Self {
        Self {
            gradient: [Vector3::zeros(); MAX_POINTS + 1],
            condensed: [0.0; MAX],
            hessian: [[0.0; MAX]; MAX],
            chain: Matrix3::identity(),
        }
    }
}

impl ElementSystem {
    /// Evaluates the energy and its gradient, and the Hessian if asked for. Returns the energy, J.
    pub fn evaluate<const P: usize, const HESSIAN: bool>(
        &mut self,
        reference: &ReferenceElement,
        material: &impl Constitutive,
        data: &ElementData,
    ) -> f64 {
        self.gradient.fill(Vector3::zeros());
        if HESSIAN {
            for row in &mut self.hessian[..3 * (P + 1)] {
                row.fill(0.0);
            }
        }
        let rotate = data.frame.to_rotation_matrix().into_inner();
        let mut energy = 0.0;
        for g in 0..P {
            let point = &data.points[g];
            let inverse = 1.0 / point.jacobian;
            let weight = reference.weights[g] * point.jacobian;
            let theta = weighted(data.rotations, &reference.shape[g]);
            let slope = weighted(data.rotations, &reference.slope[g]) * inverse;
            let s = s_functions(theta.norm_squared());
            let (to_strain, exp) = (Form::right_jacobian(&s), Form::exp(&s));
            let strain = to_strain.apply(&theta, &slope);
            let response = material.respond(&Tissue::of(point, data.time), &(strain - point.intrinsic));
            let force = rotate.tr_mul(&data.forces[g]);
            let along = centre_line_tangent();
            let turned = exp.apply(&theta, &along);
            energy += weight * (response.energy - force.dot(&turned));

            let jr = to_strain.matrix(&theta);
            let by_theta =
                (to_strain.gradient(&theta, &response.couple, &slope) - exp.gradient(&theta, &force, &along)) * weight;
            let by_slope = jr.tr_mul(&response.couple) * (weight * inverse);
            for k in 0..P {
                self.gradient[k] += by_theta * reference.shape[g][k] + by_slope * reference.slope[g][k];
            }
            self.gradient[P] -= turned.cross(&force) * weight;

            if HESSIAN {
                let strain_theta = to_strain.jacobian(&theta, &slope);
                let c_theta = response.tangent * strain_theta;
                let c_slope = response.tangent * jr;
                let a = (strain_theta.tr_mul(&c_theta) + to_strain.hessian(&theta, &response.couple, &slope)
                    - exp.hessian(&theta, &force, &along))
                    * weight;
                let b = (strain_theta.tr_mul(&c_slope)
                    + to_strain.transpose().jacobian(&theta, &response.couple).transpose())
                    * (weight * inverse);
                let c = jr.tr_mul(&c_slope) * (weight * inverse * inverse);
                let bt = b.transpose();
                for l in 0..P {
                    let (shape, slope) = (reference.shape[g][l], reference.slope[g][l]);
                    let x = a * shape + b * slope;
                    let y = bt * shape + c * slope;
                    for k in l..P {
                        let block = x * reference.shape[g][k] + y * reference.slope[g][k];
                        self.add(3 * k, 3 * l, &block);
                    }
                }
                let turn_theta = hat(&force) * exp.jacobian(&theta, &along) * weight;
                for k in 0..P {
                    self.add(3 * P, 3 * k, &(turn_theta * reference.shape[g][k]));
                }
                let turn_turn =
                    Matrix3::from_diagonal_element(force.dot(&turned)) - symmetric_part(&(turned * force.transpose()));
                self.add(3 * P, 3 * P, &(turn_turn * weight));
            }
        }
        // Also without a Hessian: a balance of couples on frames that have moved needs the present one.
        let theta = data.rotations[P - 1];
        self.chain = Form::inverse_right_jacobian(&s_functions(theta.norm_squared())).matrix(&theta);
        energy
    }

    #[inline]
    fn add(&mut self, row: usize, col: usize, block: &Matrix3<f64>) {
        for i in 0..3 {
            for j in 0..3 {
                self.hessian[row + i][col + j] += block[(i, j)];
            }
        }
    }

    #[inline]
    fn block(&self, row: usize, col: usize) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| self.hessian[(row + i).max(col + j)][(row + i).min(col + j)])
    }

    fn vector(values: &[f64; MAX], at: usize) -> Vector3<f64> {
        Vector3::new(values[at], values[at + 1], values[at + 2])
    }

    /// Adds `shift` to the diagonal of the interior unknowns, eliminates them, and passes from the rotation vector of
    /// the last node to the turn of the last frame. Counts the interior pivots.
    pub fn condense<const P: usize>(&mut self, data: &ElementData, shift: f64, inertia: &mut Inertia) -> Condensed {
        let (m, n) = (3 * (P - 1), 3 * (P + 1));
        let mut diagonal = [0.0; MAX];
        for k in 0..m {
            self.hessian[k][k] += shift;
            diagonal[k] = self.hessian[k][k].abs();
        }
        for k in 0..m {
            let pivot = self.hessian[k][k];
            inertia.count(pivot, diagonal[k], super::tangent::NEUTRAL * diagonal[k]);
            let inverse = if pivot == 0.0 { 0.0 } else { 1.0 / pivot };
            let column: [f64; MAX] = std::array::from_fn(|i| self.hessian[i][k]);
            for i in k + 1..n {
                let l = column[i] * inverse;
                for j in k + 1..=i {
                    self.hessian[i][j] -= l * column[j];
                }
                self.hessian[i][k] = l;
            }
        }
        let theta = data.rotations[P - 1];
        let inverse = Form::inverse_right_jacobian(&s_functions(theta.norm_squared()));
        let (chain, chain_t) = (self.chain, self.chain.transpose());
        // Second derivatives of the last rotation vector, contracted with the gradient there (docs/method.md).
        let g = self.gradient[P - 1];
        let by_last = inverse.transpose().jacobian(&theta, &g);
        let by_first = inverse.jacobian(&theta, &g);
        let (pp, tp, tt) = (self.block(m, m), self.block(m + 3, m), self.block(m + 3, m + 3));
        let mixed = chain_t * (tp.transpose() - pp * chain_t) - by_last * chain_t;
        Condensed {
            h11: chain_t * pp * chain + symmetric_part(&(by_last * chain)),
            h01: mixed.transpose(),
            h00: chain * pp * chain_t - chain * tp.transpose() - tp * chain_t
                + tt
                + symmetric_part(&(by_first * chain_t)),
        }
    }

    /// Eliminates from the gradient with the factors of [`condense`](Self::condense). Returns what is left: the gradient by
    /// the turns of the last and of the first frame.
    pub fn condense_gradient<const P: usize>(&mut self) -> (Vector3<f64>, Vector3<f64>) {
        let (m, n) = (3 * (P - 1), 3 * (P + 1));
        let mut g: [f64; MAX] = std::array::from_fn(|i| self.gradient[i / 3][i % 3]);
        for k in 0..m {
            for i in k + 1..n {
                g[i] -= self.hessian[i][k] * g[k];
            }
        }
        self.condensed = g;
        let last = Self::vector(&g, m);
        (self.chain.tr_mul(&last), Self::vector(&g, m + 3) - self.chain * last)
    }

    /// The Newton step of the interior rotation vectors from the gradient of
    /// [`condense_gradient`](Self::condense_gradient), given the turns of the last and of the first frame.
    pub fn recover<const P: usize>(&self, last: &Vector3<f64>, first: &Vector3<f64>, steps: &mut [Vector3<f64>]) {
        let (m, n) = (3 * (P - 1), 3 * (P + 1));
        let mut x = self.condensed;
        let outer = self.chain * last - self.chain.tr_mul(first);
        x[m..m + 3].copy_from_slice(outer.as_slice());
        x[m + 3..n].copy_from_slice(first.as_slice());
        for k in (0..m).rev() {
            let pivot = self.hessian[k][k];
            x[k] = if pivot == 0.0 { 0.0 } else { -x[k] / pivot };
            for i in k + 1..n {
                x[k] -= self.hessian[i][k] * x[i];
            }
        }
        for (k, step) in steps.iter_mut().enumerate().take(P - 1) {
            *step = Self::vector(&x, 3 * k);
        }
        steps[P - 1] = outer;
    }

    /// The derivative of the energy along a step: rotation vectors of the nodes 1 … p, and the turn of the element.
    pub fn slope<const P: usize>(&self, steps: &[Vector3<f64>], first: &Vector3<f64>) -> f64 {
        (0..P).map(|k| self.gradient[k].dot(&steps[k])).sum::<f64>() + self.gradient[P].dot(first)
    }
}

fn symmetric_part(m: &Matrix3<f64>) -> Matrix3<f64> {
    (m + m.transpose()) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::LinearElastic;
    use crate::reference_element::Order;
    use crate::section::Section;
    use crate::so3;

    /// An element with arbitrary data, in units in which everything is of order one.
    struct Sample {
        frames: [UnitQuaternion<f64>; 2],
        rotations: Vec<Vector3<f64>>,
        points: Vec<MaterialPoint>,
        forces: Vec<Vector3<f64>>,
    }

    const MATERIAL: LinearElastic = LinearElastic { youngs_modulus: 4.0, poissons_ratio: 0.3 };

    fn sample(order: Order) -> Sample {
        // Irrational multiples of an integer: no special direction, no special size.
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
        let points = (0..p)
            .map(|_| MaterialPoint {
                intrinsic: vector(),
                jacobian: 1.3,
                apex_distance: 0.0,
                initial_apex_distance: 0.0,
                exit_time: f64::INFINITY,
                section: Section::circle(1.0),
            })
            .collect();
        Sample { frames: [start, end], rotations, points, forces: (0..p).map(|_| vector()).collect() }
    }

    fn evaluate<const P: usize>(order: Order, s: &Sample) -> (f64, ElementSystem) {
        let mut system = ElementSystem::default();
        let data = s.data();
        let energy = system.evaluate::<P, true>(ReferenceElement::of(order), &MATERIAL, &data);
        (energy, system)
    }

    impl Sample {
        fn data(&self) -> ElementData<'_> {
            ElementData {
                frame: &self.frames[0],
                rotations: &self.rotations,
                points: &self.points,
                forces: &self.forces,
                time: 0.0,
            }
        }

        /// Turns the last frame (about its own axes) and the first, the interior rotation vectors staying.
        fn turned(&self, last: &Vector3<f64>, first: &Vector3<f64>) -> Self {
            let frames = [self.frames[0] * so3::exp(first), self.frames[1] * so3::exp(last)];
            let mut rotations = self.rotations.clone();
            if let Some(end) = rotations.last_mut() {
                *end = so3::log(&(frames[0].inverse() * frames[1]));
            }
            Self { frames, rotations, points: self.points.clone(), forces: self.forces.clone() }
        }
    }

    /// The gradient by the turns of both frames, interior rotation vectors held.
    fn held_gradient<const P: usize>(order: Order, s: &Sample) -> [f64; 6] {
        let (_, system) = evaluate::<P>(order, s);
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
    fn gradient_is_the_difference_of_the_energy() {
        let order = Order::Six;
        let s = sample(order);
        let gradient = held_gradient::<3>(order, &s);
        for (i, value) in gradient.iter().enumerate() {
            let h = 1e-5;
            let energy = |h: f64| {
                let (last, first) = unit(i, h);
                evaluate::<3>(order, &s.turned(&last, &first)).0
            };
            // Central difference: h² times a third derivative of order ten, and rounding 1e-16/h.
            assert!(((energy(h) - energy(-h)) / (2.0 * h) - value).abs() < 1e-8);
        }
    }

    #[test]
    fn condensed_hessian_without_interior_is_the_difference_of_the_gradient() {
        // With one Gauss point there is no interior, so the condensed blocks are the whole Hessian. It is symmetric in
        // the chart exp(φ̂), the difference of the gradient is one in moving frames: they differ by the antisymmetric
        // part, half the couple.
        let order = Order::Two;
        let s = sample(order);
        let (_, mut system) = evaluate::<1>(order, &s);
        let mut inertia = Inertia::default();
        let blocks = system.condense::<1>(&s.data(), 0.0, &mut inertia);
        let h = 1e-5;
        for i in 0..6 {
            for j in 0..6 {
                let difference = |i: usize, j: usize| {
                    let (plus, minus) = (unit(j, h), unit(j, -h));
                    (held_gradient::<1>(order, &s.turned(&plus.0, &plus.1))[i]
                        - held_gradient::<1>(order, &s.turned(&minus.0, &minus.1))[i])
                        / (2.0 * h)
                };
                let expected = 0.5 * (difference(i, j) + difference(j, i));
                let value = match (i / 3, j / 3) {
                    (0, 0) => blocks.h11[(i, j)],
                    (1, 1) => blocks.h00[(i - 3, j - 3)],
                    (1, 0) => blocks.h01[(i - 3, j)],
                    _ => blocks.h01[(j - 3, i)],
                };
                assert!((value - expected).abs() < 1e-7, "({i}, {j}): {value} against {expected}");
            }
        }
    }

    #[test]
    fn hessian_by_rotation_vectors_is_the_difference_of_the_gradient() {
        let order = Order::Eight;
        let s = sample(order);
        let (_, system) = evaluate::<4>(order, &s);
        let h = 1e-5;
        for j in 0..12 {
            let gradient = |h: f64| {
                let mut moved =
                    Sample { rotations: s.rotations.clone(), points: s.points.clone(), forces: s.forces.clone(), ..s };
                moved.rotations[j / 3][j % 3] += h;
                evaluate::<4>(order, &moved).1.gradient
            };
            let (plus, minus) = (gradient(h), gradient(-h));
            for i in j..15 {
                let expected = (plus[i / 3][i % 3] - minus[i / 3][i % 3]) / (2.0 * h);
                let value = system.hessian[i][j];
                assert!((value - expected).abs() < 1e-6, "({i}, {j}): {value} against {expected}");
            }
        }
    }
}
