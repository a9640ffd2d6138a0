//! Exchange of the laws of a shoot.

use super::builder::check_tissue;
use super::{MOST_ELEMENTS, Mesh, SAME_PLACE, Shoot, jumps};
use crate::error::ParameterError;
use crate::model::{GrowthLaw, Model, check};
use crate::state::{State, StateError};
use crate::tropism::{Declaration, TropismLaw};

impl<M: Model> Shoot<M> {
    /// The same shoot under other laws from the present time on: another parameter, an additional
    /// load, a tilted pot. The new shoot keeps state and history; `self` does not change.
    ///
    /// The new tropism laws continue with the variables and stimuli at the material points, in
    /// their order. Laws with the same numbers of them but another meaning are not detected. Tissue
    /// outside a new, shorter growth zone becomes mature at the present time. If growth ends
    /// altogether, the tissue stays in the zone and does not age. Without a support, the shoot has
    /// no reactions from now on.
    ///
    /// The change is a discontinuity. The next call of an integrator, for example `advance` to the
    /// present time, computes the shape under the new laws and restarts with short steps.
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
    /// // Weight acts from now on.
    /// let mut shoot = shoot.with_model(shoot.model().with_load(Weight { density: 1000.0 }))?;
    /// integrator.advance(&mut shoot, 7200.0)?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// - a parameter out of range, at some place at least
    /// - tropism laws with other numbers of variables or stimuli, or with delays that the history
    ///   does not cover: see [`with_model_restarted`](Self::with_model_restarted)
    /// - a growth zone in which mature tissue would grow again
    /// - a load that jumps outside the shoot
    pub fn with_model<N: Model>(&self, model: N) -> Result<Shoot<N>, StateError> {
        let mut state = self.state.clone();
        let started = state.history.levels() > 0;
        if started {
            check_history(&state, model.tropism())?;
        }
        state.changed = started;
        self.adopt(model, state)
    }

    /// The same shoot under other laws, without history: for tropism laws with other variables.
    /// [`Integrator::start`](crate::integrator::Integrator::start) sets a new history, which is
    /// empty otherwise.
    ///
    /// # Errors
    /// See [`with_model`](Self::with_model); those of the history do not occur.
    pub fn with_model_restarted<N: Model>(&self, model: N) -> Result<Shoot<N>, StateError> {
        let mut state = self.state.clone();
        state.forget();
        self.adopt(model, state)
    }

    /// Checks a model against a state and adapts mesh and growth zone.
    fn adopt<N: Model>(&self, model: N, mut state: State) -> Result<Shoot<N>, StateError> {
        check(&model, state.rod.length())?;
        let (growth, old) = (model.growth(), self.model.growth());
        let zone = growth.zone_length();
        // The number of elements in the zone does not change.
        let divided = growth.elongates() && zone.is_finite();
        let longest_element = if divided {
            zone / self.resolution
        } else {
            self.mesh.longest_element
        };
        state.check_length(MOST_ELEMENTS * longest_element)?;
        if growth.elongates() && !(old.elongates() && old.zone_length() == zone) {
            confine(&mut state, zone)?;
        }
        keep_jumps(&mut state, &model)?;
        state.release_if_absent(model.support());
        check_tissue(&state.rod, &model, state.time)?;
        let mesh = Mesh {
            longest_element,
            ..self.mesh
        };
        Ok(Shoot {
            model,
            mesh,
            resolution: self.resolution,
            state,
        })
    }
}

/// Returns an error for tropism laws that cannot continue from the history of a state.
fn check_history(state: &State, tropism: &impl TropismLaw) -> Result<(), StateError> {
    let (size, laws) = (tropism.size(), Declaration::of(tropism));
    state.check_laws((size.variables, size.stimuli))?;
    Ok(state.check_reach(laws.longest_delay())?)
}

/// Makes tissue mature that is outside a new growth zone of the given length (m).
fn confine(state: &mut State, zone: f64) -> Result<(), StateError> {
    let rod = &state.rod;
    let first = rod.first_growing;
    // Ends of elements move by the exact flow, so their distances are accurate to rounding.
    let (growing, margin) = (
        rod.node_distance[first.min(rod.elements())],
        SAME_PLACE * rod.length(),
    );
    let requirement =
        "at most that of the present one, since mature tissue does not grow again (m)";
    let ok = first == 0 || zone <= growing + margin;
    ParameterError::unless(ok, "length of the new growth zone", zone, requirement)?;
    if zone < growing - margin {
        let e =
            state.rod.node_distance[first..].partition_point(|node| *node > zone + margin) + first;
        // The boundary lies in the element below node `e`, or on it.
        if state.rod.node_distance[e] < zone - margin {
            let x = state.rod.coordinate_at_distance(e - 1, zone);
            state.split(e - 1, x);
        }
        let now = state.time;
        state
            .mature(e - first)
            .iter_mut()
            .for_each(|point| point.exit_time = now);
    }
    Ok(())
}

/// Adds nodes where the load jumps or the shoot is held, and protects them from merging.
fn keep_jumps(state: &mut State, model: &impl Model) -> Result<(), StateError> {
    for distance in jumps(model, state.time, state.rod.initial_length)? {
        let Some((e, x)) = state.rod.locate_initial(distance) else {
            continue;
        };
        if x > SAME_PLACE && x < 1.0 - SAME_PLACE {
            state.split(e, x);
        }
        state.rod.kept[e + usize::from(x > SAME_PLACE)] = true;
    }
    Ok(())
}
