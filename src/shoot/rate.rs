//! Rate of differential growth of a shoot.

use nalgebra::Vector3;

use super::Shoot;
use crate::growth::GrowthLaw;
use crate::model::Model;
use crate::tropism::{Declaration, Growing, TropismLaw};

impl<M: Model> Shoot<M> {
    /// The present rate of differential growth, ∫ |∂u*/∂t| ds over the growth zone, rad/s. In a shoot of
    /// constant length without load it bounds the angular velocity of the frames relative to the base. Zero
    /// before an integrator has started the shoot.
    #[must_use]
    pub fn steering_rate(&self) -> f64 {
        let rod = &self.state.rod;
        let mature = std::iter::repeat_n(0.0, rod.zone().start);
        rod.integral(mature.chain(self.intrinsic_rates().iter().map(Vector3::norm)))
    }

    /// The rates ∂u*/∂t (1/(m s), components along the directors) at the points of the rod in the growth zone. Empty
    /// before an integrator has started the shoot.
    pub(crate) fn intrinsic_rates(&self) -> Vec<Vector3<f64>> {
        let (growth, tropism, history) = (self.model.growth(), self.model.tropism(), &self.state.history);
        let (laws, rod, time) = (Declaration::of(tropism), &self.state.rod, self.environment().time);
        let size = laws.size();
        if history.levels() < 2 || history.size() != (size.variables, size.stimuli) {
            return Vec::new();
        }
        // Variables without a delay are not read.
        let read = |delay: f64, tau: f64| history.reading(time - delay, tau);
        let each = laws.variables().iter();
        let readings: Vec<_> = each.map(|at| at.delay.map(|delay| read(delay, at.time_constant))).collect();
        let mut past = vec![0.0; readings.len()];
        let each = rod.points()[rod.zone()].iter().enumerate();
        each.map(|(i, point)| {
            for (k, reading) in readings.iter().enumerate() {
                reading.iter().for_each(|reading| history.read_some(reading, i, &[k], &mut past));
            }
            let at = Growing::of(point, time, point.apex_distance);
            let present = size.present(history.stimuli(history.levels() - 1, i));
            tropism.gradient(&at, &past, present) * growth.regr(point.apex_distance, time)
        })
        .collect()
    }
}
