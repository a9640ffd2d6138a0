//! Rate of differential growth of a shoot.

use nalgebra::Vector3;

use super::Shoot;
use crate::model::{GrowthLaw, Model, TropismLaw};
use crate::rod::MaterialPoint;
use crate::tropism::{Declaration, Growing};

impl<M: Model> Shoot<M> {
    /// The present rate of differential growth, ∫ |∂u*/∂t| ds over the growth zone, rad/s. In a
    /// shoot of constant length without load it bounds the angular velocity of the frames relative
    /// to the base. Zero before an integrator has started the shoot.
    #[must_use]
    pub fn steering_rate(&self) -> f64 {
        let rod = &self.state.rod;
        let mature = std::iter::repeat_n(0.0, rod.zone().start);
        rod.integral(mature.chain(self.intrinsic_rates().iter().map(Vector3::norm)))
    }

    /// The rates ∂u*/∂t (1/(m s), components along the directors) at the points of the rod in the
    /// growth zone. Empty before an integrator has started the shoot.
    pub(crate) fn intrinsic_rates(&self) -> Vec<Vector3<f64>> {
        let (rod, own): (_, &[f64]) = (&self.state.rod, &[1.0]);
        self.rates(
            rod.zone()
                .enumerate()
                .map(|(i, point)| (rod.points()[point], i, own)),
        )
    }

    /// The rates at the given coordinates of each element in the growth zone, for variables and
    /// stimuli that are polynomials through those at the points of the element.
    pub(crate) fn intrinsic_rates_within(&self, places: &[f64]) -> Vec<Vector3<f64>> {
        let (rod, p) = (&self.state.rod, self.state.rod.order().points());
        let places: Vec<_> = places
            .iter()
            .map(|x| (*x, rod.reference().at_points(*x)))
            .collect();
        self.rates((rod.first_growing..rod.elements()).flat_map(|e| {
            let first = (e - rod.first_growing) * p;
            places
                .iter()
                .map(move |(x, weights)| (rod.point_within(e, *x), first, &weights[..p]))
        }))
    }

    /// The rates at material points. The variables and stimuli of each are weighted sums over
    /// successive points in the zone, given by the index of the first one and the weights.
    fn rates<'a>(
        &self,
        points: impl Iterator<Item = (MaterialPoint, usize, &'a [f64])>,
    ) -> Vec<Vector3<f64>> {
        let (growth, tropism, history) = (
            self.model.growth(),
            self.model.tropism(),
            &self.state.history,
        );
        let (laws, time) = (Declaration::of(tropism), self.environment().time);
        let size = laws.size();
        if history.levels() < 2 || history.size() != (size.variables, size.stimuli) {
            return Vec::new();
        }
        // Variables without a delay are not read.
        let read = |delay: f64, tau: f64| history.reading(time - delay, tau);
        let variables = laws.variables().iter();
        let readings: Vec<_> = variables
            .map(|at| at.delay.map(|delay| read(delay, at.time_constant)))
            .collect();
        let (mut past, mut one) = (vec![0.0; readings.len()], vec![0.0; readings.len()]);
        let mut present = vec![0.0; size.stimuli];
        let rate = |(point, first, weights): (MaterialPoint, usize, &[f64])| {
            past.fill(0.0);
            present.fill(0.0);
            for (i, weight) in (first..).zip(weights) {
                for (k, reading) in readings.iter().enumerate() {
                    reading
                        .iter()
                        .for_each(|reading| history.read_some(reading, i, &[k], &mut one));
                    past[k] += weight * one[k];
                }
                let stimuli = history.stimuli(history.levels() - 1, i);
                present
                    .iter_mut()
                    .zip(stimuli)
                    .for_each(|(sum, stimulus)| *sum += weight * stimulus);
            }
            let at = Growing::of(&point, time, point.apex_distance);
            tropism.gradient(&at, &past, size.present(&present))
                * growth.regr(point.apex_distance, time)
        };
        points.map(rate).collect()
    }
}
