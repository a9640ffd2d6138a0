//! A shoot: a state together with the laws that it obeys.

mod builder;
mod change;
mod check_laws;
mod energies;
mod nodes;
mod parameters;
mod power;
mod rate;

pub use builder::ShootBuilder;
pub use energies::Energies;
pub use parameters::{FullModel, ReducedModel, ShootParameters};

use nalgebra::Vector3;

use crate::error::ParameterError;
use crate::model::{GrowthLaw, Load, Model, Support, TropismLaw};
use crate::profile::Profile;
use crate::rod::{MaterialPoint, Rod};
use crate::scene::{Environment, Scene};
use crate::state::{State, StateError};
use crate::support::{Joint, Reaction};

/// Largest distance of two places that are treated as one, relative to the length.
const SAME_PLACE: f64 = 1e-9;

/// Upper bound of the length of a shoot over that of its longest element. A mistaken length or
/// state is an error before memory is allocated for it.
const MOST_ELEMENTS: f64 = 1e6;

/// Criteria for dividing and merging the elements of a shoot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mesh {
    /// Largest length of an element, m. A longer one in the growth zone is divided, and merging
    /// creates none.
    pub longest_element: f64,
    /// Largest rotation by the merging of mature elements, rad: see
    /// [`ShootBuilder::merge_tolerance`].
    pub merge_tolerance: f64,
}

/// A state together with the laws that it obeys. [`Shoot::builder`] builds a shoot, and an
/// [`Integrator`](crate::integrator::Integrator) advances it in time.
#[derive(Debug, Clone, PartialEq)]
pub struct Shoot<M> {
    pub(crate) model: M,
    pub(crate) mesh: Mesh,
    /// Length of the growth zone, or of a shoot of constant length, over that of the longest
    /// element.
    pub(crate) resolution: f64,
    pub(crate) state: State,
}

impl<M: Model> Shoot<M> {
    /// The laws of the shoot.
    #[must_use]
    pub fn model(&self) -> &M {
        &self.model
    }

    /// The state: time, shape, intrinsic strains and history.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The rod at the present time, in its current shape. In contact with an obstacle it has
    /// additional nodes, where contacts begin and end.
    #[must_use]
    pub fn rod(&self) -> &Rod {
        self.state.shape()
    }

    /// The forces and couples on the shoot in the last equilibrium: of the holds of positions in
    /// their order, of the springs with a potential, of the contacts, and of the holds of frames
    /// alone. Empty without a support, and before the first call of an integrator.
    #[must_use]
    pub fn reactions(&self) -> &[Reaction] {
        self.state.rod.reactions()
    }

    /// The present time, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// The position of the apex in the fixed frame, m.
    #[must_use]
    pub fn tip(&self) -> Vector3<f64> {
        self.rod().tip()
    }

    /// Present time and gravity. At a discontinuity they are the limits after it.
    #[must_use]
    pub fn environment(&self) -> Environment {
        self.model.scene().environment(self.state.time_of_laws())
    }

    /// The profile of the shoot: strain, intrinsic strain, couple, force and growth rate at any
    /// place. The shoot must be in equilibrium, as after any call of an integrator.
    ///
    /// ```
    /// # use morphorod::ShootParameters;
    /// # use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # let parameters = ShootParameters { length: 0.05, zone_length: 0.03, growth_time: 72e3, ..Default::default() };
    /// # let mut shoot = parameters.shoot().scene(morphorod::Still::tilted(0.5)).build()?;
    /// MethodOfSteps::new(600.0).advance(&mut shoot, 36e3)?;
    /// let profile = shoot.profile();
    /// let tip = profile.at(shoot.rod().length()).expect("a number");
    /// println!("the tip moves away from the base by {:.2} mm/h", 3.6e6 * tip.speed);
    /// for place in profile.sample(20) {
    ///     println!("{} {} {}", place.arc_length, place.curvature(), place.couple.y);
    /// }
    /// # assert!((tip.speed - 0.03 / 72e3).abs() < 1e-18);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn profile(&self) -> Profile<'_, M::Constitutive, M::Load, M::Growth> {
        let Self { model, state, .. } = self;
        let laws = (model.constitutive(), model.load(), model.growth());
        Profile::growing(state.shape(), laws, self.environment())
    }

    /// Replaces the state by an earlier one of this shoot, or by one of a shoot with the same laws,
    /// on any mesh.
    ///
    /// A state contains the number of variables and stimuli of its laws, but not the laws or their
    /// parameters. To continue under other laws, restore the state under its own laws and exchange
    /// them by [`with_model`](Self::with_model), which adds nodes where loads jump and has the
    /// shape recomputed.
    ///
    /// # Errors
    /// A state that is inconsistent, whose history has other numbers of variables or stimuli, or
    /// whose length exceeds a million times the longest element of this shoot or is not permitted
    /// by its growth law, or whose growth zone is not that of this law, or whose base or gravity is
    /// not that of the scene of this shoot at the time of the state. The shoot does not change
    /// then.
    pub fn restore(&mut self, state: &State) -> Result<(), StateError> {
        state.check()?;
        let size = self.model.tropism().size();
        state.check_laws((size.variables, size.stimuli))?;
        state.check_length(MOST_ELEMENTS * self.mesh.longest_element)?;
        self.model.growth().check(state.rod.length())?;
        self.check_zone(state, SAME_PLACE)?;
        self.check_scene(state)?;
        self.state.copy_from(state);
        self.state.release_if_absent(self.model.support());
        Ok(())
    }

    /// Returns an error unless the growing part of a state is as long as the growth zone of the law
    /// of this shoot, or the whole shoot grows and is shorter. The accuracy is relative to the
    /// length of the shoot.
    pub(crate) fn check_zone(&self, state: &State, accuracy: f64) -> Result<(), ParameterError> {
        let (growth, rod) = (self.model.growth(), &state.rod);
        let (zone, first) = (growth.zone_length(), rod.first_growing);
        if !growth.elongates() {
            return Ok(());
        }
        let (growing, margin) = (
            rod.node_distance[first.min(rod.elements())],
            accuracy * rod.length(),
        );
        let same = growing <= zone + margin && (first == 0 || growing >= zone - margin);
        let requirement = "that of the shoot's growth law, `zone_length`, which is constant (m): restore a state \
            under its own laws, and compare the methods of the law by `check::growth_law`";
        ParameterError::unless(
            same,
            "length of the growth zone of the state",
            growing,
            requirement,
        )
    }

    /// Returns an error unless gravity and base of a state are those of the scene of this shoot, up
    /// to rounding. A state before the first equilibrium, or after an exchange of the laws, has no
    /// scene yet. A joint frees the base.
    fn check_scene(&self, state: &State) -> Result<(), ParameterError> {
        if state.changed || state.history.levels() == 0 {
            return Ok(());
        }
        let (scene, joint, time) = (
            self.model.scene(),
            self.model.support().base(),
            state.time_of_laws(),
        );
        let requirement = "zero up to rounding: restore the state under its own scene, and exchange it by `with_model`";
        let same = |ok: bool, name: &'static str, difference: f64, unit: &'static str| {
            ParameterError::unless(ok, name, difference, requirement)
                .map_err(|error| ParameterError { unit, ..error })
        };
        let (gravity, position) = (scene.gravity(time), scene.position(time));
        let difference = (gravity - state.gravity).norm();
        let ok = difference <= SAME_PLACE * gravity.norm();
        same(
            ok,
            "difference of the gravity of the state from that of the scene",
            difference,
            "m/s²",
        )?;
        if joint.is_none() {
            let turn = scene.base(time).angle_to(&state.rod.frames()[0]);
            same(
                turn <= SAME_PLACE,
                "rotation of the base of the state from that of the scene",
                turn,
                "rad",
            )?;
        }
        if joint != Some(Joint::Free) {
            let distance = (position - state.rod.base_position()).norm();
            let ok = distance <= SAME_PLACE * (state.rod.length() + position.norm());
            same(
                ok,
                "distance of the base of the state from that of the scene",
                distance,
                "m",
            )?;
        }
        Ok(())
    }

    /// Sets the intrinsic strain of every material point (along the directors, 1/m), as
    /// [`Rod::set_intrinsic`] does. It may be called between two steps, to disturb a shoot.
    ///
    /// The change is a discontinuity: the next call of an integrator computes the new shape and
    /// restarts with short steps.
    pub fn set_intrinsic(&mut self, strain: impl FnMut(&MaterialPoint) -> Vector3<f64>) {
        self.state.rod.set_intrinsic(strain);
        (self.state.changed, self.state.plan) = (self.state.history.levels() > 0, None);
    }

    /// The largest length of an element, m. Longer elements in the zone are divided, and merging
    /// creates none.
    #[must_use]
    pub fn longest_element(&self) -> f64 {
        self.mesh.longest_element
    }
}

/// Places at which a load jumps or the shoot is held at a time (s), by their distance from the apex
/// at t = 0 (m), on a shoot of the given length at t = 0 (m).
fn jumps(model: &impl Model, time: f64, length: f64) -> Result<Vec<f64>, ParameterError> {
    let name = "distance from the apex at t = 0 at which a load jumps";
    let loaded = model
        .load()
        .jumps()
        .into_iter()
        .map(|distance| (name, distance));
    let held = model
        .support()
        .holds(time)
        .into_iter()
        .map(|hold| hold.initial_apex_distance);
    let elastic = model
        .support()
        .potentials()
        .into_iter()
        .map(|elastic| elastic.initial_apex_distance);
    let held = held
        .chain(elastic)
        .map(|distance| ("distance of a held place from the apex at t = 0", distance));
    let checked = loaded.chain(held).map(|(name, distance)| {
        let on = distance >= 0.0 && distance <= length;
        ParameterError::unless(on, name, distance, "between 0 and the length at t = 0 (m)")
            .map(|()| distance)
    });
    checked.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::LinearElastic;
    use crate::model::DynLaws;
    use crate::rod::RodError;
    use crate::state::StateError;

    /// A shoot is `Send` and `Sync` if its laws are.
    const _: () = {
        const fn crosses_threads<T: Send + Sync>() {}
        crosses_threads::<Shoot<DynLaws>>();
    };

    #[test]
    fn inconsistent_states_are_refused() {
        let tissue = LinearElastic {
            youngs_modulus: 1e7,
            poissons_ratio: 0.5,
        };
        let mut shoot = Shoot::builder(tissue)
            .length(0.05)
            .radius(5e-4)
            .elements(2)
            .build()
            .unwrap();
        let (kept, mut lacking) = (shoot.state.clone(), shoot.state.clone());
        lacking.rod.points.pop();
        let expected = RodError::Count {
            what: "material points",
            found: 7,
            expected: 8,
        };
        assert_eq!(shoot.restore(&lacking), Err(StateError::Rod(expected)));
        assert_eq!(shoot.state, kept);
        let mut long = kept.clone();
        long.rod
            .points
            .iter_mut()
            .for_each(|point| point.jacobian *= 1e6);
        long.rod
            .node_distance
            .iter_mut()
            .for_each(|distance| *distance *= 1e6);
        let error = shoot.restore(&long).unwrap_err();
        assert!(
            matches!(&error, StateError::Parameter(error) if error.name == "length of the rod"),
            "{error}"
        );
        assert_eq!(shoot.state, kept);
    }
}
