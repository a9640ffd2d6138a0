//! A shoot: a state together with the laws that it obeys, built and checked in one place.

mod builder;
mod change;
mod rate;

pub use builder::ShootBuilder;

use nalgebra::Vector3;

use crate::error::ParameterError;
use crate::load::Load;
use crate::model::{DynLaws, Model};
use crate::profile::Profile;
use crate::rod::{MaterialPoint, Rod};
use crate::scene::{Environment, Scene, after};
use crate::state::{State, StateError};
use crate::tropism::TropismLaw;

/// Places that are nearer to each other than this fraction of the length are one.
const SAME_PLACE: f64 = 1e-9;

/// The number of elements of the longest kind that a shoot must stay below, so that a mistaken length or state is refused
/// before memory is asked for it.
const MOST_ELEMENTS: f64 = 1e6;

/// How fine the elements of a growing shoot are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mesh {
    /// Longest element, m: a longer one in the growth zone is cut in two, and merging outside it makes none that is longer.
    pub longest_element: f64,
    /// Mature elements are merged while that turns what lies beyond by no more than this, rad:
    /// [`ShootBuilder::merge_tolerance`].
    pub merge_tolerance: f64,
}

/// A shoot with its laws. Build one with [`Shoot::builder`], move it in time with an
/// [`Integrator`](crate::integrator::Integrator).
#[derive(Debug, Clone, PartialEq)]
pub struct Shoot<M> {
    pub(crate) model: M,
    pub(crate) mesh: Mesh,
    /// How many of the longest elements the growth zone, or a shoot of constant length, is divided into.
    pub(crate) resolution: f64,
    pub(crate) state: State,
}

impl<M: Model> Shoot<M> {
    /// The laws.
    #[must_use]
    pub fn model(&self) -> &M {
        &self.model
    }

    /// The state: time, shape, intrinsic strains and history.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The rod at the present time.
    #[must_use]
    pub fn rod(&self) -> &Rod {
        &self.state.rod
    }

    /// The present time, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// The position of the apex, the base at the origin, in the fixed frame, m.
    #[must_use]
    pub fn tip(&self) -> Vector3<f64> {
        self.state.rod.tip()
    }

    /// Time and gravity as they are now; at a discontinuity, as they are after it.
    #[must_use]
    pub fn environment(&self) -> Environment {
        let State { time, smooth_since, .. } = self.state;
        self.model.scene().environment(if time == smooth_since { after(time) } else { time })
    }

    /// What the shoot is like at any place along it: strain and intrinsic strain, couple and force, growth rate. An integrator
    /// must have started it, so that it is at rest.
    ///
    /// ```
    /// # use morphorod::Shoot;
    /// # use morphorod::constitutive::LinearElastic;
    /// # use morphorod::growth::UniformGrowth;
    /// # use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # use morphorod::load::Weight;
    /// # let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
    /// #     .length(0.05).radius(5e-4).growth(UniformGrowth { zone_length: 0.03, time: 72e3 })
    /// #     .load(Weight { density: 1000.0 }).scene(morphorod::Still::tilted(0.5)).build()?;
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
        Profile::growing(&state.rod, model.constitutive(), model.load(), model.growth(), self.environment())
    }

    /// Goes back, or forth, to a state of this shoot that was kept before, or to one of a shoot with the same laws, on
    /// whatever mesh.
    ///
    /// A state knows how many numbers its laws kept, but not the laws or their parameters. To go on under other laws restore the state
    /// under those that it had, and exchange them with [`set_model`](Self::set_model) or [`with_model`](Self::with_model), so
    /// that the shape is found anew and nodes are put where loads jump.
    ///
    /// # Errors
    /// A state that is not consistent in itself, whose history is of other laws, or that is so long that this shoot's mesh
    /// would have a million elements. The shoot is then as it was.
    pub fn restore(&mut self, state: &State) -> Result<(), StateError> {
        state.check()?;
        let size = self.model.tropism().size();
        state.check_laws((size.variables, size.stimuli))?;
        state.check_length(MOST_ELEMENTS * self.mesh.longest_element)?;
        self.state.copy_from(state);
        Ok(())
    }

    /// Gives every material point an intrinsic strain (1/m), as [`Rod::set_intrinsic`] does. It may disturb a shoot in the middle of a
    /// run.
    ///
    /// The change is a discontinuity. The next call of an integrator finds the new shape and begins afresh from there.
    pub fn set_intrinsic(&mut self, strain: impl FnMut(&MaterialPoint) -> Vector3<f64>) {
        self.state.rod.set_intrinsic(strain);
        (self.state.changed, self.state.plan) = (self.state.history.levels() > 0, None);
    }

    /// How fine the elements are kept.
    #[must_use]
    pub fn mesh(&self) -> Mesh {
        self.mesh
    }
}

/// The places at which a load jumps on a shoot of a length at t = 0 (m), by their distance from the apex then, m.
fn jumps(load: &impl Load, length: f64) -> Result<Vec<f64>, ParameterError> {
    let jumps = load.jumps();
    for &distance in &jumps {
        let name = "distance from the apex at t = 0 at which a load jumps";
        let on = distance >= 0.0 && distance <= length;
        ParameterError::unless(on, name, distance, "between 0 and the length at t = 0 (m)")?;
    }
    Ok(jumps)
}

/// A shoot whose laws can cross threads can do so itself.
const _: () = {
    const fn crosses_threads<T: Send + Sync>() {}
    crosses_threads::<Shoot<DynLaws>>();
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::LinearElastic;
    use crate::rod::RodError;
    use crate::state::StateError;

    #[test]
    fn a_state_that_lacks_a_point_is_refused() {
        let tissue = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
        let mut shoot = Shoot::builder(tissue).length(0.05).radius(5e-4).elements(2).build().unwrap();
        let (kept, mut lacking) = (shoot.state.clone(), shoot.state.clone());
        lacking.rod.remove_last_point();
        let expected = RodError::Size { what: "material points", found: 7, expected: 8, elements: 2 };
        assert_eq!(shoot.restore(&lacking), Err(StateError::Rod(expected)));
        assert_eq!(shoot.state, kept);
        let mut long = kept.clone();
        long.rod.points_mut().iter_mut().for_each(|point| point.jacobian *= 1e6);
        long.rod.node_distances_mut().iter_mut().for_each(|distance| *distance *= 1e6);
        let error = shoot.restore(&long).unwrap_err();
        assert!(matches!(&error, StateError::Parameter(error) if error.name == "length of the rod"), "{error}");
        assert_eq!(shoot.state, kept);
    }
}
