//! Error of an equilibrium whose stiffness is discontinuous or steep inside an element.
//!
//! The quadrature of an element represents a discontinuity of the stiffness at the border between
//! two material points. The halves of the element may have a border at the same place. Both meshes
//! then have the same wrong shape, and their difference does not show the error.

use nalgebra::Vector3;

use crate::integrator::stepper::compliance;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;

/// Largest relative difference, for a smooth compliance or rate, from the polynomial through its
/// values at the points of an element.
pub(super) const SMOOTH: f64 = 0.1;

/// Returns the possible error of the rotation of each element of `coarse` if its compliance is not
/// smooth, rad; zero if it is smooth. The elements of the shoot are the halves of these.
pub(super) fn hidden_turns(coarse: &Rod, shoot: &Shoot<impl Model>) -> Vec<f64> {
    let (compliance, fine) = (
        compliance(shoot.model.constitutive(), shoot.time()),
        &shoot.state.rod,
    );
    let (p, reference) = (coarse.reference().p, coarse.reference());
    let values = |rod: &Rod| -> Vec<f64> { rod.points().iter().map(&compliance).collect() };
    let (before, after) = (values(coarse), values(fine));
    // Relative difference between the compliance at a point of the halves and the polynomial
    // through `others` at its coordinate x.
    let departure = |i: usize, others: &[f64], x: f64| {
        let expected: f64 = others
            .iter()
            .zip(reference.at_points(x))
            .map(|(value, w)| value * w)
            .sum();
        (1.0 - expected / after[i]).abs()
    };
    let elastic = |i: usize| -> Vector3<f64> {
        fine.strain_at_point(i / p, i % p) - fine.points()[i].intrinsic
    };
    let within = |e: usize| {
        let own = &before[e * p..(e + 1) * p];
        let share = |k: usize| {
            departure(
                2 * e * p + k,
                own,
                0.5 * ((k / p) as f64 + reference.points[k % p]),
            )
        };
        if (0..2 * p).all(|k| share(k) <= SMOOTH) {
            return 0.0;
        }
        let turn = |k: usize| {
            let i = 2 * e * p + k;
            reference.weights[k % p] * fine.points()[i].jacobian * elastic(i).norm() * share(k)
        };
        (0..2 * p).map(turn).sum()
    };
    let mut hidden: Vec<f64> = (0..coarse.elements()).map(within).collect();
    // Between the last point of an element and the first point of the next.
    for e in 1..coarse.elements() {
        let (last, first) = (2 * e * p - 1, 2 * e * p);
        let gaps = [last, first].map(|i| reference.points[0] * fine.points()[i].jacobian);
        // The polynomial of the longer element is extrapolated.
        let share = if gaps[0] > gaps[1] {
            departure(
                first,
                &after[first - p..first],
                1.0 + reference.points[0] * gaps[1] / gaps[0],
            )
        } else {
            departure(
                last,
                &after[first..first + p],
                -reference.points[0] * gaps[0] / gaps[1],
            )
        };
        if !(share <= SMOOTH || coarse.kept[e]) {
            let turn =
                (gaps[0] + gaps[1]) * elastic(last).norm().max(elastic(first).norm()) * share;
            hidden[e - 1] += turn;
            hidden[e] += turn;
        }
    }
    hidden
}
