//! Motion of tissue over a step. The growth law moves material points and ends of elements. The
//! lengths of elements follow from their ends.

use super::{IntegrationError, Outcome, StepInterval, Stepper};
use crate::growth::{GrowthLaw, zone_elongation};
use crate::model::Model;
use crate::rod::MaterialPoint;
use crate::shoot::Shoot;

/// Name of the stretch in errors.
const STRETCH: &str = "stretch of growing tissue, by REGR and apical speed of the growth law (which must announce its \
                       jumps in time by `next_discontinuity`),";

impl Stepper {
    /// Moves the points and nodes of the zone. The points of the first `leaving` elements leave it.
    ///
    /// Points are stretched one by one. The integral of their lengths per coordinate is the length
    /// of the element up to the resolution of the mesh. They are then scaled to the distance
    /// between its ends. Without this, the difference, even if it is rounding, would grow with the
    /// tissue at the apex by exp(∫ REGR dt).
    pub(super) fn elongate(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        step: StepInterval,
    ) -> Outcome {
        let growth = shoot.model.growth();
        if !growth.elongates() {
            return Ok(());
        }
        let StepInterval {
            leaving,
            growth: [from, to],
            ..
        } = step;
        let rod = &mut shoot.state.rod;
        let (zone, first, p) = (rod.zone(), rod.first_growing, rod.order().points());
        let points = &mut rod.points[zone];
        let (leaving_points, staying) = points.split_at_mut((leaving * p).min(points.len()));
        for point in leaving_points {
            // These points leave the zone before the node that is on the boundary at the end of the
            // step.
            point.exit_time = growth
                .exit_time(point.apex_distance, from, to)
                .unwrap_or(to);
            stretch(growth, [from, point.exit_time], point);
        }
        staying
            .iter_mut()
            .for_each(|point| stretch(growth, [from, to], point));
        // The length of a leaving element is a difference of distances beyond the boundary. A
        // difference of distances from the apex would lose digits.
        let mut before = None;
        for i in first..=rod.elements() {
            let sigma = rod.node_distance[i];
            let leaves = leaving > 0 && i <= first + leaving;
            let beyond = leaves.then(|| beyond_zone(growth, sigma, from, to));
            let distance = beyond.map_or_else(
                || growth.flow(sigma, from, to).0,
                |beyond| growth.zone_length() + beyond,
            );
            if let Some(e) = i.checked_sub(1).filter(|e| *e >= first) {
                let length = match (before, beyond) {
                    (Some(before), Some(beyond)) => before - beyond,
                    _ => rod.node_distance[e] - distance,
                };
                IntegrationError::finite(
                    rod.set_element_length(e, length).is_finite(),
                    STRETCH,
                    to,
                )?;
                if !(rod.least_jacobian(e) > 0.0) {
                    return Err(IntegrationError::Uneven {
                        time: to,
                        element: e,
                        ratio: rod.jacobian_ratio(e),
                    });
                }
            }
            rod.node_distance[i] = distance;
            before = beyond;
        }
        Ok(())
    }
}

/// Moves a point of the zone, and stretches its tissue.
fn stretch(growth: &impl GrowthLaw, [from, to]: [f64; 2], point: &mut MaterialPoint) {
    let (distance, stretch) = growth.flow(point.apex_distance, from, to);
    point.apex_distance = distance;
    point.jacobian *= stretch;
}

/// Returns the distance of a node beyond the boundary of the zone at the end of the step, m;
/// negative inside the zone.
fn beyond_zone(growth: &impl GrowthLaw, sigma: f64, from: f64, to: f64) -> f64 {
    let zone = growth.zone_length();
    if sigma >= zone {
        return sigma - zone + zone_elongation(growth, from, to, 1);
    }
    match growth.exit_time(sigma, from, to) {
        Some(exit) => zone_elongation(growth, exit, to, 1),
        None => growth.flow(sigma, from, to).0 - zone,
    }
}
