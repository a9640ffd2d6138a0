//! Energy, gradient and Hessian of one element, and the elimination of its interior rotations.
//!
//! The element's energy is ∫ W(u − u*) + Φ(v) − n · p′ ds with the frames R₀ exp(φ̂) exp(θ̂(ξ)): φ
//! rotates the whole element, θ is the polynomial through the rotation vectors of its nodes.
//! Derivation: `docs/method.md`, "One element".

mod nodes;

use nalgebra::{Matrix3, SimdComplexField, SimdPartialOrd, SimdValue, UnitQuaternion, Vector3};

use super::Inertia;
use super::elimination::{Elimination, Row, vector_at};
use super::line::line_yields;
use super::points::{Responses, at_points, vectors_at_points};
use crate::constitutive::{Constitutive, Tissue};
use crate::load::{InternalForce, PointReaction};
use crate::reference_element::{
    AtPoints, ChordPoint, MAX_POINTS, ReferenceElement, interpolated, total,
};
use crate::rod::{MaterialPoint, Rod, centre_line_tangent, weighted, weighted_jacobian};
use crate::so3::{Form, Real, s_functions};

/// Data on which the equilibrium of an element depends.
pub(super) struct ElementData<'a> {
    /// Quadrature and interpolation.
    pub reference: &'static ReferenceElement,
    pub frame: &'a UnitQuaternion<f64>,
    pub rotations: &'a [Vector3<f64>],
    pub points: &'a [MaterialPoint],
    /// The force n at the material points, in the fixed frame, N.
    pub forces: &'a [Vector3<f64>],
    /// Reactions of supports inside the element.
    pub inside: &'a [PointReaction],
    /// Time, s, from which the age of the tissue follows.
    pub time: f64,
}

/// Derivatives of the energy of an element, later the factors of its interior.
///
/// The unknowns are the rotation vectors of the nodes 1 … p and the rotation φ of the whole
/// element, in this order. The first 3 (p − 1) are interior; [`condense`](Self::condense)
/// eliminates them.
#[derive(Debug, Clone, Default)]
pub(super) struct ElementSystem {
    gradient: [Vector3<f64>; MAX_POINTS + 1],
    /// Components of the gradient after the elimination.
    pub condensed: Row,
    pub hessian: Elimination,
    /// Jr(θ)⁻¹ at the last node: the change of its rotation vector by a rotation of the last frame.
    inverse: Form,
    chain: Matrix3<f64>,
    /// Smallest bending or twist of the element by a couple, ∫ ds/K with the largest K, rad/(N m),
    /// at the last Hessian.
    pub compliance: f64,
    /// Largest strain of the centre line by the force, |C| |n|, at the last Hessian.
    pub yielding: f64,
}

/// Contribution of the element to the condensed system: blocks for the rotations of its last frame
/// (1) and of its first (0).
pub(super) struct Condensed {
    pub h11: Matrix3<f64>,
    /// Rows of the first frame, columns of the last.
    pub h01: Matrix3<f64>,
    pub h00: Matrix3<f64>,
}

impl ElementSystem {
    /// Evaluates the energy and its gradient, and the Hessian if requested. Returns the energy, J.
    pub fn evaluate<const P: usize, const HESSIAN: bool>(
        &mut self,
        material: &impl Constitutive,
        data: &ElementData,
    ) -> f64 {
        let rotate = data.frame.to_rotation_matrix().into_inner();
        let (shape, slopes) = (
            &data.reference.shape_at_points,
            &data.reference.slope_at_points,
        );
        let inverse = AtPoints::ONE / at_points::<P>(1.0, |g| data.points[g].jacobian);
        let weight =
            data.reference.weights_at_points * at_points::<P>(1.0, |g| data.points[g].jacobian);
        let theta = interpolated(data.rotations, shape);
        let slope = interpolated(data.rotations, slopes) * inverse;
        let s = s_functions(theta.dot(&theta));
        let (to_strain, exp) = (Form::right_jacobian(&s), Form::exp(&s));
        let strain =
            to_strain.apply(&theta, &slope) - vectors_at_points::<P>(|g| data.points[g].intrinsic);
        let force =
            rotate.transpose().map(AtPoints::splat) * vectors_at_points::<P>(|g| data.forces[g]);
        let along_directors = exp.transpose().apply(&theta, &force);
        let response = Responses::of::<P>(
            material,
            (data.points, data.time),
            &strain,
            &along_directors,
        );
        let (couple, along, load) = (response.couple * weight, response.along, force * weight);
        let turned = exp.apply(&theta, &along);
        let mut energy = total(weight * response.energy - load.dot(&turned));

        // Derivative of the strain by that of θ along the element coordinate.
        let strain_slope = to_strain.matrix(&theta) * inverse;
        let by_theta =
            to_strain.gradient(&theta, &couple, &slope) - exp.gradient(&theta, &load, &along);
        let by_slope = strain_slope.transpose() * couple;
        for k in 0..P {
            self.gradient[k] = (by_theta * shape[k] + by_slope * slopes[k]).map(total);
        }
        self.gradient[P] = load.cross(&turned).map(total);

        if HESSIAN {
            let tangent = response.tangent * weight;
            self.compliance = total(weight / response.stiffness);
            let strain_theta = to_strain.jacobian(&theta, &slope);
            let (c_theta, c_slope) = (tangent * strain_theta, tangent * strain_slope);
            let mut a = symmetric_product(&strain_theta, &c_theta)
                + to_strain.hessian(&theta, &couple, &slope)
                - exp.hessian(&theta, &load, &along);
            let b = strain_theta.transpose() * c_slope
                + to_strain.transpose().jacobian(&theta, &couple).transpose() * inverse;
            let c = symmetric_product(&strain_slope, &c_slope);
            let turned_theta = exp.jacobian(&theta, &along);
            let (mut theta_turn, mut turn_turn) = turn_hessians(&load, &turned, &turned_theta);
            self.yielding = 0.0;
            if let Some(compliance) = &response.line {
                let [theta_yields, mixed_yields, turn_yields] =
                    line_yields(&(compliance * weight), &exp, &theta, &force);
                let size = |m: &Matrix3<AtPoints>| m.component_mul(m).sum().simd_sqrt();
                self.yielding =
                    (size(compliance) * force.dot(&force).simd_sqrt()).simd_horizontal_max();
                a -= theta_yields;
                theta_turn -= mixed_yields;
                turn_turn -= turn_yields;
            }
            self.hessian.clear();
            let bt = b.transpose();
            for l in 0..P {
                let x = a * shape[l] + b * slopes[l];
                let y = bt * shape[l] + c * slopes[l];
                for k in 0..=l {
                    self.hessian.set_block(
                        3 * k,
                        3 * l,
                        &(x * shape[k] + y * slopes[k]).map(total),
                    );
                }
                self.hessian
                    .set_block(3 * l, 3 * P, &(theta_turn * shape[l]).map(total));
            }
            self.hessian.set_block(3 * P, 3 * P, &turn_turn.map(total));
        }
        if !data.inside.is_empty() {
            energy -= self.add_inside::<P, HESSIAN>(data);
        }
        // The gradient by the current frames requires this factor even without a Hessian.
        let theta = data.rotations[P - 1];
        self.inverse = Form::inverse_right_jacobian(&s_functions(theta.norm_squared()));
        self.chain = self.inverse.matrix(&theta);
        energy
    }

    /// Adds the derivatives of the energy by the reactions inside the element, for a rod without
    /// shear and stretch. Returns their work, J.
    #[inline(never)]
    fn add_inside<const P: usize, const HESSIAN: bool>(&mut self, data: &ElementData) -> f64 {
        let (rotate, along) = (
            data.frame.to_rotation_matrix().into_inner(),
            centre_line_tangent(),
        );
        let mut work = 0.0;
        for (reaction, k) in data
            .inside
            .iter()
            .flat_map(|reaction| (0..P).map(move |k| (reaction, k)))
        {
            let (shape, length) = data.part_of_chord(reaction.x, k);
            let (theta, load) = (
                weighted(data.rotations, &shape),
                rotate.tr_mul(&reaction.force) * length,
            );
            let exp = Form::exp(&s_functions(theta.norm_squared()));
            let turned = exp.apply(&theta, &along);
            work += load.dot(&turned);
            let by_theta = exp.gradient(&theta, &load, &along);
            (0..P).for_each(|n| self.gradient[n] -= by_theta * shape[n]);
            self.gradient[P] += load.cross(&turned);
            if HESSIAN {
                let a = exp.hessian(&theta, &load, &along);
                let (theta_turn, turn_turn) =
                    turn_hessians(&load, &turned, &exp.jacobian(&theta, &along));
                for l in 0..P {
                    for m in 0..=l {
                        self.hessian
                            .add_block(3 * m, 3 * l, &(a * (-shape[l] * shape[m])));
                    }
                    self.hessian
                        .add_block(3 * l, 3 * P, &(theta_turn * shape[l]));
                }
                self.hessian.add_block(3 * P, 3 * P, &turn_turn);
            }
        }
        work
    }

    /// The derivatives of the chord from the start of the element to coordinate `x` by its
    /// unknowns: one row for each component in the fixed frame, eliminated as the gradient. With
    /// shear or stretch, the chord inside the element is that of the polynomial through the
    /// tangents at the Gauss points.
    pub fn chord_rows<const P: usize>(
        &self,
        material: &impl Constitutive,
        data: &ElementData,
        x: f64,
    ) -> [Row; 3] {
        let rotate = data.frame.to_rotation_matrix().into_inner();
        let line_at = |g: usize, along: &Vector3<f64>| {
            material.line_response(&Tissue::of(&data.points[g], data.time), along)
        };
        let (exact, upto) = (
            x < 1.0 && line_at(0, &Vector3::zeros()).is_none(),
            data.reference.within(x),
        );
        let mut rows = [Row::default(); 3];
        for g in 0..P {
            let (shape, length) = if exact {
                data.part_of_chord(x, g)
            } else {
                (data.reference.shape[g], upto[g] * data.points[g].jacobian)
            };
            let theta = weighted(data.rotations, &shape);
            let exp = Form::exp(&s_functions(theta.norm_squared()));
            let force = rotate.tr_mul(&data.forces[g]);
            let line = line_at(g, &exp.transpose().apply(&theta, &force));
            let strain = line.map_or(centre_line_tangent(), |line| line.strain);
            for (k, row) in rows.iter_mut().enumerate() {
                let unit = rotate.row(k).transpose() * length;
                let mut by_theta = exp.gradient(&theta, &unit, &strain);
                let mut by_turn = exp.apply(&theta, &strain).cross(&unit);
                if let Some(line) = &line {
                    // A force changes the strain of the centre line, on which the load then works.
                    let more = line.compliance * exp.transpose().apply(&theta, &unit);
                    by_theta += exp.gradient(&theta, &force, &more);
                    by_turn += exp.apply(&theta, &more).cross(&force);
                }
                add_derivatives::<P>(row, &shape, [by_theta, by_turn]);
            }
        }
        for row in &mut rows {
            self.hessian.reduce::<P>(row);
        }
        rows
    }

    /// The derivatives of the tangent d3 at coordinate `x` by the unknowns of the element, as
    /// [`chord_rows`](Self::chord_rows).
    pub fn tangent_rows<const P: usize>(&self, data: &ElementData, x: f64) -> [Row; 3] {
        let rotate = data.frame.to_rotation_matrix().into_inner();
        let shape = data.reference.at_nodes(x);
        let theta = weighted(data.rotations, &shape);
        let exp = Form::exp(&s_functions(theta.norm_squared()));
        let mut rows = [Row::default(); 3];
        for (k, row) in rows.iter_mut().enumerate() {
            let (unit, strain) = (rotate.row(k).transpose(), centre_line_tangent());
            let by_theta = exp.gradient(&theta, &unit, &strain);
            let by_turn = exp.apply(&theta, &strain).cross(&unit);
            add_derivatives::<P>(row, &shape, [by_theta, by_turn]);
            self.hessian.reduce::<P>(row);
        }
        rows
    }

    /// The parts of an eliminated row that belong to the rotations of the last and of the first
    /// frame, with `points` Gauss points.
    #[inline]
    pub fn outer(&self, row: &Row, points: usize) -> (Vector3<f64>, Vector3<f64>) {
        let m = 3 * (points - 1);
        let (last, whole) = (vector_at(row, m), vector_at(row, m + 3));
        (self.chain.tr_mul(&last), whole - self.chain * last)
    }

    /// Subtracts a multiple of an eliminated row from the eliminated gradient.
    pub fn subtract(&mut self, row: &Row, factor: f64) {
        for (to, from) in self
            .condensed
            .as_flattened_mut()
            .iter_mut()
            .zip(row.as_flattened())
        {
            *to -= factor * from;
        }
    }

    /// Adds `shift` to the diagonal of the interior unknowns, eliminates them, and changes the
    /// unknown from the rotation vector of the last node to the rotation of the last frame. Counts
    /// the interior pivots.
    pub fn condense<const P: usize>(
        &mut self,
        data: &ElementData,
        shift: f64,
        inertia: &mut Inertia,
    ) -> Condensed {
        let m = 3 * (P - 1);
        self.hessian.eliminate::<P>(shift, inertia);
        let theta = data.rotations[P - 1];
        let (chain, chain_t) = (self.chain, self.chain.transpose());
        // Second derivatives of the last rotation vector, contracted with the gradient there
        // (docs/method.md).
        let g = self.gradient[P - 1];
        let [by_last, by_first] = chain_slopes(&self.inverse, &theta, &g);
        let (pp, tt) = (
            self.hessian.diagonal_block(m),
            self.hessian.diagonal_block(m + 3),
        );
        let pt = self.hessian.block(m, m + 3);
        let (pp_chain_t, chain_pt) = (pp * chain_t, chain * pt);
        let mixed = chain_t * (pt - pp_chain_t) - by_last * chain_t;
        Condensed {
            h11: chain_t * pp * chain + symmetric_part(&(by_last * chain)),
            h01: mixed.transpose(),
            h00: chain * pp_chain_t - chain_pt - chain_pt.transpose()
                + tt
                + symmetric_part(&(by_first * chain_t)),
        }
    }

    /// Eliminates the interior from the gradient with the factors of [`condense`](Self::condense).
    /// Returns the gradient by the rotations of the last and of the first frame.
    pub fn condense_gradient<const P: usize>(&mut self) -> (Vector3<f64>, Vector3<f64>) {
        for k in 0..=P {
            self.condensed.as_flattened_mut()[3 * k..3 * k + 3]
                .copy_from_slice(self.gradient[k].as_slice());
        }
        self.hessian.reduce::<P>(&mut self.condensed);
        self.outer(&self.condensed, P)
    }

    /// The sum of the unbalanced couples on the interior nodes of an element with `points` Gauss
    /// points, N m.
    pub fn interior_couples(&self, points: usize) -> f64 {
        self.gradient[..points - 1].iter().map(Vector3::norm).sum()
    }

    /// The Newton step of the interior rotation vectors from the gradient of
    /// [`condense_gradient`](Self::condense_gradient), given the rotations of the last and of the
    /// first frame.
    pub fn recover<const P: usize>(
        &self,
        last: &Vector3<f64>,
        first: &Vector3<f64>,
        steps: &mut [Vector3<f64>],
    ) {
        let m = 3 * (P - 1);
        let mut x = Row::default();
        let outer = self.chain * last - self.chain.tr_mul(first);
        x.as_flattened_mut()[m..m + 3].copy_from_slice(outer.as_slice());
        x.as_flattened_mut()[m + 3..m + 6].copy_from_slice(first.as_slice());
        self.hessian.recover::<P>(&self.condensed, &mut x);
        for (k, step) in steps.iter_mut().enumerate().take(P - 1) {
            *step = vector_at(&x, 3 * k);
        }
        steps[P - 1] = outer;
    }

    /// The derivative of the energy along a step: rotation vectors of the nodes 1 … p, and the
    /// rotation of the element.
    pub fn slope<const P: usize>(&self, steps: &[Vector3<f64>], first: &Vector3<f64>) -> f64 {
        (0..P).map(|k| self.gradient[k].dot(&steps[k])).sum::<f64>() + self.gradient[P].dot(first)
    }
}

impl<'a> ElementData<'a> {
    /// The data of element `e` of a rod under a force.
    pub fn of(rod: &'a Rod, force: &'a InternalForce, e: usize) -> Self {
        let (forces, inside) = force.on_element(e, rod.order().points());
        Self {
            reference: rod.reference(),
            frame: &rod.frames[e],
            rotations: rod.element_rotations(e),
            points: rod.element_points(e),
            forces,
            inside,
            time: force.environment().time,
        }
    }

    /// The values of the nodal polynomials at point k of the Gauss rule from the start of the
    /// element to `x`, and the weight of the point, m.
    fn part_of_chord(&self, x: f64, k: usize) -> ([f64; MAX_POINTS], f64) {
        let ChordPoint {
            weight,
            points,
            nodes,
        } = self.reference.chord_point(k, x);
        (nodes, weight * weighted_jacobian(self.points, &points))
    }
}

/// Adds the derivatives at a place to a row: `by[0]`, by the rotation vector at the place, times
/// the values `shape` of the nodal polynomials there, and `by[1]`, by the rotation of the whole
/// element.
fn add_derivatives<const P: usize>(
    row: &mut Row,
    shape: &[f64; MAX_POINTS],
    by: [Vector3<f64>; 2],
) {
    let row = row.as_flattened_mut();
    for i in 0..3 {
        (0..P).for_each(|n| row[3 * n + i] += by[0][i] * shape[n]);
        row[3 * P + i] += by[1][i];
    }
}

/// Second derivatives of the energy −F · R v of a load F on a rotated vector R v: the mixed ones by
/// the rotation vector θ and the rotation φ of the whole element, and those by φ alone. `turned` is
/// R v, and `turned_theta` is its derivative by θ.
#[inline]
fn turn_hessians<T: Real>(
    load: &Vector3<T>,
    turned: &Vector3<T>,
    turned_theta: &Matrix3<T>,
) -> (Matrix3<T>, Matrix3<T>) {
    let mixed = Matrix3::from_fn(|i, j| load.cross(&turned_theta.column(i))[j]);
    (
        mixed,
        Matrix3::from_diagonal_element(load.dot(turned))
            - symmetric_part(&(turned * load.transpose())),
    )
}

/// The product aᵀ b, for matrices for which it is symmetric.
#[inline]
fn symmetric_product<T: Real>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    let entry = |i: usize, j: usize| a.column(i).dot(&b.column(j));
    let [x, y, z] = [0, 1, 2].map(|i| entry(i, i));
    let [xy, xz, yz] = [(0, 1), (0, 2), (1, 2)].map(|(i, j)| entry(i, j));
    Matrix3::new(x, xy, xz, xy, y, yz, xz, yz, z)
}

/// Second derivatives of a rotation vector by rotations of the frame of the node and of the first
/// frame, contracted with the gradient `g` by the rotation vector: B = ∂(Aᵀ g)/∂θ and C = ∂(A
/// g)/∂θ, where `inverse` is A.
#[inline]
fn chain_slopes(inverse: &Form, theta: &Vector3<f64>, g: &Vector3<f64>) -> [Matrix3<f64>; 2] {
    [
        inverse.transpose().jacobian(theta, g),
        inverse.jacobian(theta, g),
    ]
}

#[inline]
fn symmetric_part<T: Real>(m: &Matrix3<T>) -> Matrix3<T> {
    (m + m.transpose()) * T::splat(0.5)
}

#[cfg(test)]
mod tests;
