//! A rod on a coarser mesh.

use super::{MaterialPoint, Rod};
use crate::reference_element::MAX_POINTS;

/// A place in a rod.
pub(crate) struct ElementPlace {
    pub element: usize,
    /// Weights of the material points of the element.
    pub weights: [f64; MAX_POINTS],
}

impl Rod {
    /// A straight rod whose elements each replace about `ratio` neighbours of this one, with the
    /// tissue at its material points, and their places in this rod. Inside elements lengths are
    /// taken as proportional to the coordinate.
    pub(crate) fn coarsened(&self, ratio: usize) -> Option<(Self, Vec<ElementPlace>)> {
        let (reference, n, ends) = (self.reference(), self.elements(), self.ends());
        let count = (n / ratio).max(1);
        let nodes: Vec<f64> = (0..=count).map(|i| ends[i * n / count]).collect();
        let mut coarse = Self::straight(
            &nodes,
            |_| self.points[0].section,
            self.frames[0],
            self.order,
        )
        .ok()?;
        coarse.base_position = self.base_position;
        let (mut places, mut e) = (Vec::with_capacity(coarse.points.len()), 0);
        for point in &mut coarse.points {
            let s = ends[n] - point.apex_distance;
            while e + 1 < n && s > ends[e + 1] {
                e += 1;
            }
            let weights = reference.at_points((s - ends[e]) / (ends[e + 1] - ends[e]));
            let tissue = MaterialPoint::weighted(self.element_points(e), &weights);
            *point = MaterialPoint {
                jacobian: point.jacobian,
                apex_distance: point.apex_distance,
                ..tissue
            };
            places.push(ElementPlace {
                element: e,
                weights,
            });
        }
        Some((coarse, places))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Order;
    use approx::assert_relative_eq;
    use nalgebra::{UnitQuaternion, Vector3};

    #[test]
    fn coarse_rod_has_the_tissue_at_its_points() {
        let radius = |s: f64| 1e-3 * (1.0 - 4.0 * s);
        for order in [Order::Four, Order::Six, Order::Eight] {
            for elements in [3, 5, 9, 16] {
                let nodes: Vec<f64> = (0..=elements)
                    .map(|i| 0.1 * (f64::from(i) / f64::from(elements)).powi(2))
                    .collect();
                let mut rod =
                    Rod::straight(&nodes, radius, UnitQuaternion::identity(), order).unwrap();
                rod.set_intrinsic(|point| Vector3::y() * (1.0 + 7.0 * point.apex_distance));
                let (coarse, places) = rod.coarsened(4).unwrap();
                assert_eq!(coarse.elements(), (rod.elements() / 4).max(1));
                // Interpolation of linear fields is exact. Its rounding is a few units.
                assert_relative_eq!(coarse.length(), rod.length(), max_relative = 1e-14);
                for (point, at) in coarse.points().iter().zip(&places) {
                    assert_relative_eq!(
                        point.section.along_d1,
                        radius(0.1 - point.apex_distance),
                        max_relative = 1e-13
                    );
                    assert_relative_eq!(
                        point.intrinsic.y,
                        1.0 + 7.0 * point.apex_distance,
                        max_relative = 1e-13
                    );
                    let each = rod.element_points(at.element).iter().zip(&at.weights);
                    let place: f64 = each
                        .map(|(point, weight)| point.apex_distance * weight)
                        .sum();
                    assert_relative_eq!(place, point.apex_distance, max_relative = 1e-12);
                }
            }
        }
    }
}
