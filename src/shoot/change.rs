//! A change of course: the same shoot under other laws.

use super::builder::check_tissue;
use super::{MOST_ELEMENTS, Mesh, SAME_PLACE, Shoot, jumps};
use crate::error::ParameterError;
use crate::growth::GrowthLaw;
use crate::model::Model;
use crate::state::{State, StateError};
use crate::tropism::{Declaration, TropismLaw};

impl<M: Model> Shoot<M> {
    /// The same shoot under other laws from the present time on: a parameter moved by hand, a weight hung on, a pot tilted. What it
    /// has grown to stays, and so does its history; this shoot stays as it is.
    ///
    /// Tropism laws go on with the numbers that the present ones keep at the material points, in their order: laws of another meaning
    /// that keep as many are not told apart. Tissue that stops growing because the zone is shorter leaves it now; tissue that stops
    /// because growth ends altogether stays in the zone, and does not age.
    ///
    /// The change is a discontinuity. The next call of an integrator, be it `advance` to the present time, finds the shape
    /// under the new laws and begins afresh from there.
    ///
    /// ```
    /// # use morphorod::constitutive::LinearElastic;
    /// # use morphorod::growth::{Ongoing, UniformGrowth};
    /// # use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # use morphorod::load::Weight;
    /// # use morphorod::tropism::{Memory, Proprioception, Response};
    /// # use morphorod::{Shoot, Still};
    /// # let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
    /// #     .length(0.05).radius(5e-4).growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 72e3 }))
    /// #     .tropism(Proprioception { sensitivity: 20.0 }.remembered(Memory { time: 720.0, delay: 720.0 }))
    /// #     .scene(Still::tilted(0.5)).build()?;
    /// let mut integrator = MethodOfSteps::new(120.0);
    /// integrator.advance(&mut shoot, 3600.0)?;
    /// // From now on it feels its weight.
    /// let mut shoot = shoot.with_model(shoot.model().with_load(Weight { density: 1000.0 }))?;
    /// integrator.advance(&mut shoot, 7200.0)?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Parameters that make no sense, at some place at least; tropism laws that keep other numbers than the present ones, or look
    /// back further than the history reaches, see [`with_model_restarted`](Self::with_model_restarted); a growth zone that would make mature tissue
    /// grow again; a load that jumps off the shoot.
    pub fn with_model<N: Model>(&self, model: N) -> Result<Shoot<N>, StateError> {
        let mut state = self.state.clone();
        let started = state.history.levels() > 0;
        if started {
            check_history(&state, model.tropism())?;
        }
        state.changed = started;
        self.adopt(model, state)
    }

    /// The same shoot under other laws, with its history forgotten: the way to laws that keep other numbers. Give them a past
    /// with [`Integrator::start`](crate::integrator::Integrator::start), or they begin with an empty one.
    ///
    /// # Errors
    /// Those of [`with_model`](Self::with_model) that are not about the history.
    pub fn with_model_restarted<N: Model>(&self, model: N) -> Result<Shoot<N>, StateError> {
        let mut state = self.state.clone();
        state.forget();
        self.adopt(model, state)
    }

    /// Exchanges the laws for others of the same types, as [`with_model`](Self::with_model) does.
    ///
    /// # Errors
    /// See there; the shoot is then as it was.
    pub fn set_model(&mut self, model: M) -> Result<(), StateError> {
        *self = self.with_model(model)?;
        Ok(())
    }

    fn adopt<N: Model>(&self, model: N, mut state: State) -> Result<Shoot<N>, StateError> {
        model.check(state.rod.length())?;
        let (growth, old) = (model.growth(), self.model.growth());
        let zone = growth.zone_length();
        ParameterError::unless(zone > 0.0, "length of the growth zone", zone, "positive (m)")?;
        // As many elements in the zone as before.
        let divided = growth.elongates() && zone.is_finite();
        let longest_element = if divided { zone / self.resolution } else { self.mesh.longest_element };
        state.check_length(MOST_ELEMENTS * longest_element)?;
        if growth.elongates() && !(old.elongates() && old.zone_length() == zone) {
            confine(&mut state, zone)?;
        }
        keep_jumps(&mut state, &model)?;
        check_tissue(&state.rod, &model, state.time)?;
        let mesh = Mesh { longest_element, ..self.mesh };
        Ok(Shoot { model, mesh, resolution: self.resolution, state })
    }
}

/// Refuses tropism laws that cannot live on the history of a state.
fn check_history(state: &State, tropism: &impl TropismLaw) -> Result<(), StateError> {
    let (size, laws) = (tropism.size(), Declaration::of(tropism));
    state.check_laws((size.variables, size.stimuli))?;
    Ok(state.check_reach(laws.longest_delay())?)
}

/// Takes tissue out of the growth zone that is not in a new one of so many metres.
fn confine(state: &mut State, zone: f64) -> Result<(), StateError> {
    let rod = &state.rod;
    let first = rod.first_growing();
    // Ends of elements move by the exact flow.
    let (growing, margin) = (rod.node_distances()[first.min(rod.elements())], SAME_PLACE * rod.length());
    let ok = first == 0 || zone <= growing + margin;
    let what = "length of the new growth zone";
    ParameterError::unless(ok, what, zone, "not longer than the present one: mature tissue does not grow again (m)")?;
    if zone < growing - margin {
        let e = state.rod.node_distances()[first..].partition_point(|node| *node > zone + margin) + first;
        // The boundary lies in the element below node `e`, or on it.
        if state.rod.node_distances()[e] < zone - margin {
            let x = state.rod.coordinate_at_distance(e - 1, zone);
            state.split(e - 1, x);
        }
        let now = state.time;
        state.mature(e - first, |_| now);
    }
    Ok(())
}

/// Puts nodes to keep where the load jumps.
fn keep_jumps(state: &mut State, model: &impl Model) -> Result<(), StateError> {
    for distance in jumps(model.load(), state.rod.initial_length())? {
        let Some((e, x)) = state.rod.locate_initial(distance) else { continue };
        let node = if x <= SAME_PLACE {
            e
        } else if x >= 1.0 - SAME_PLACE {
            e + 1
        } else {
            state.split(e, x);
            e + 1
        };
        state.rod.keep_node(node);
    }
    Ok(())
}
