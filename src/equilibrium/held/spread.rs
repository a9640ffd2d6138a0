//! Reactions of contacts that are longer than a point: forces at their ends, and pressure between.

use nalgebra::Vector3;

use super::data::HeldSearch;
use super::touch::SAME;
use crate::constitutive::Constitutive;
use crate::load::Load;
use crate::numerics::interpolation::lagrange;
use crate::numerics::quadrature::lobatto_weights;
use crate::rod::Rod;
use crate::support::Reaction;

/// Force at a point, relative to the force at a station, that is attributed to rounding.
const NONE: f64 = 1e-6;

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Divides the reactions at the stations of longer contacts into the pressure, which is gathered with the weights of
    /// the stations, and the forces at a point at the ends of a contact, where the rod lifts off. Sets the lengths of
    /// gathered reactions.
    pub(super) fn spread(&self, rod: &Rod, all: &mut Vec<Reaction>) {
        if P < 3 {
            return;
        }
        let (nodes, weights) = lobatto_weights(P - 1);
        let line = rod.centre_line();
        let margin = SAME * self.length;
        let find = |all: &[Reaction], obstacle: usize, s: f64| {
            all.iter().position(|at| at.obstacle == Some(obstacle) && (at.arc_length - s).abs() <= margin)
        };
        // The pressure at the first and the last station of an element, extrapolated from those inside.
        let mut ends: Vec<(usize, f64, Vector3<f64>)> = Vec::new();
        for obstacle in 0..self.obstacles.contacts.len() {
            for e in 0..rod.elements() {
                let (from, length) = (line[e].0, rod.length_of(e));
                let stations: Option<Vec<usize>> =
                    nodes[1..P - 1].iter().map(|x| find(all, obstacle, from + x * length)).collect();
                let (Some(inside), Some(first), Some(last)) =
                    (stations, find(all, obstacle, from), find(all, obstacle, from + length))
                else {
                    continue;
                };
                let mut values = vec![0.0; P - 2];
                for (index, x) in [(first, 0.0), (last, 1.0)] {
                    lagrange(&nodes[1..P - 1], x, &mut values);
                    let share = weights[0] * length;
                    let pressure = inside.iter().zip(&nodes[1..]).zip(&values).map(|((i, _), value)| {
                        let k = inside.iter().position(|other| other == i).unwrap_or(0);
                        all[*i].force * (value / (weights[k + 1] * length))
                    });
                    ends.push((index, share, pressure.sum::<Vector3<f64>>() * share));
                }
                for (k, i) in inside.iter().enumerate() {
                    all[*i].length = weights[k + 1] * length;
                }
            }
        }
        let number = all.len();
        for i in 0..number {
            let parts: Vec<_> = ends.iter().filter(|(index, ..)| *index == i).collect();
            let length: f64 = parts.iter().map(|(_, share, _)| share).sum();
            if parts.len() == 2 {
                // Between two elements in contact there is no force at a point.
                all[i].length = length;
            } else if let [(_, _, force)] = parts[..] {
                let whole = all[i];
                let normal = |force: &Vector3<f64>| {
                    let size = whole.force.norm();
                    if size > 0.0 { whole.normal * force.dot(&whole.force) / (size * size) } else { 0.0 }
                };
                let rest = whole.force - force;
                // There is no force at a point at an end where the rod does not lift off.
                if rest.norm() <= NONE * whole.force.norm() {
                    all[i].length = length;
                    continue;
                }
                all.push(Reaction { force: *force, normal: normal(force), length, ..whole });
                all[i] = Reaction { force: rest, normal: normal(&rest), ..whole };
            }
        }
    }
}
