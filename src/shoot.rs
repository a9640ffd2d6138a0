//! A shoot: a state together with the laws that it obeys, built and checked in one place.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::growth::{GrowthLaw, NoGrowth, exit_before_start};
use crate::load::Load;
use crate::model::{BoxedLaws, Laws, Model};
use crate::reference_element::Order;
use crate::rod::{MaterialPoint, Rod};
use crate::scene::{Scene, Still};
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
    /// Mature elements are merged while that changes no angle by more than this, rad.
    pub merge_tolerance: f64,
}

/// A shoot with its laws. Build one with [`Shoot::builder`], move it in time with an
/// [`Integrator`](crate::integrator::Integrator).
#[derive(Debug, Clone, PartialEq)]
pub struct Shoot<M> {
    pub(crate) model: M,
    pub(crate) mesh: Mesh,
    pub(crate) state: State,
}

impl<C: Constitutive> Shoot<Laws<C>> {
    /// Begins a shoot of the given elastic law: by default without growth, tropism or load, upright under gravity.
    pub fn builder(constitutive: C) -> ShootBuilder<Laws<C>> {
        let laws = Laws { constitutive, growth: NoGrowth, tropism: (), load: (), scene: Still::upright() };
        ShootBuilder { grows: false, ..Shoot::of(laws) }
    }
}

impl<M: Model> Shoot<M> {
    /// Begins a shoot of the given model.
    pub fn of(model: M) -> ShootBuilder<M> {
        ShootBuilder {
            model,
            section: Section(Arc::new(|_| f64::NAN)),
            length: f64::NAN,
            elements: 8,
            nodes: None,
            steers: false,
            grows: true,
            order: Order::default(),
            merge_tolerance: 1e-4,
        }
    }

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

    /// Goes back, or forth, to a state of this shoot that was kept before, or to one of a shoot with the same laws, on
    /// whatever mesh.
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

    /// Gives every material point an intrinsic strain, as [`Rod::set_intrinsic`] does: to disturb a shoot, say.
    pub fn set_intrinsic(&mut self, strain: impl FnMut(&MaterialPoint) -> Vector3<f64>) {
        self.state.rod.set_intrinsic(strain);
    }

    /// How fine the elements are kept.
    #[must_use]
    pub fn mesh(&self) -> Mesh {
        self.mesh
    }
}

/// Collects what a shoot is made of; [`build`](Self::build) checks it once.
#[derive(Debug, Clone)]
#[must_use]
pub struct ShootBuilder<M> {
    model: M,
    section: Section,
    length: f64,
    elements: usize,
    nodes: Option<Vec<f64>>,
    /// Whether a tropism was given, and a growth law: steering without growth is a mistake unless it is asked for.
    steers: bool,
    grows: bool,
    order: Order,
    merge_tolerance: f64,
}

/// The radius of the section (m) as a function of the arc length from the base (m).
#[derive(Clone)]
struct Section(Arc<dyn Fn(f64) -> f64 + Send + Sync>);

impl std::fmt::Debug for Section {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Section(radius {} m at the base)", (self.0)(0.0))
    }
}

impl<C, G, T, L, S> ShootBuilder<Laws<C, G, T, L, S>> {
    /// How the shoot grows.
    pub fn growth<N: GrowthLaw>(mut self, growth: N) -> ShootBuilder<Laws<C, N, T, L, S>> {
        self.grows = true;
        self.with(|Laws { constitutive, tropism, load, scene, .. }| Laws { constitutive, growth, tropism, load, scene })
    }

    /// How the shoot steers: a law, or a tuple of laws. Steering is differential growth: without
    /// [`growth`](Self::growth) nothing would come of it, and [`build`](Self::build) refuses; `growth(NoGrowth)` asks for it.
    pub fn tropism<N: TropismLaw>(mut self, tropism: N) -> ShootBuilder<Laws<C, G, N, L, S>> {
        self.steers = true;
        self.with(|Laws { constitutive, growth, load, scene, .. }| Laws { constitutive, growth, tropism, load, scene })
    }

    /// What loads the shoot: a load, or a tuple of loads.
    pub fn load<N: Load>(self, load: N) -> ShootBuilder<Laws<C, G, T, N, S>> {
        self.with(|Laws { constitutive, growth, tropism, scene, .. }| Laws {
            constitutive,
            growth,
            tropism,
            load,
            scene,
        })
    }

    /// Gravity and the base.
    pub fn scene<N: Scene>(self, scene: N) -> ShootBuilder<Laws<C, G, T, L, N>> {
        self.with(|Laws { constitutive, growth, tropism, load, .. }| Laws {
            constitutive,
            growth,
            tropism,
            load,
            scene,
        })
    }
}

impl<M> ShootBuilder<M> {
    /// The same with another model.
    fn with<N>(self, change: impl FnOnce(M) -> N) -> ShootBuilder<N> {
        let Self { model, section, length, elements, nodes, steers, grows, order, merge_tolerance } = self;
        ShootBuilder { model: change(model), section, length, elements, nodes, steers, grows, order, merge_tolerance }
    }

    /// The length at t = 0, m.
    pub fn length(mut self, length: f64) -> Self {
        self.length = length;
        self
    }

    /// The number of elements in the growth zone, or in the whole shoot if it has no zone; 8 by default. A zone that
    /// grows keeps at least so many.
    pub fn elements(mut self, elements: usize) -> Self {
        self.elements = elements;
        self
    }

    /// The ends of the elements, by their arc length from the base at t = 0, m, instead of equal ones: from 0 to the length,
    /// increasing. Heavy rods want shorter elements near the base. Further nodes are put where loads jump and where the
    /// growth zone ends; as a zone grows its elements stay shorter than the longest that it has now.
    pub fn nodes(mut self, nodes: &[f64]) -> Self {
        self.nodes = Some(nodes.to_vec());
        self
    }

    /// The order of accuracy of the shape.
    pub fn order(mut self, order: Order) -> Self {
        self.order = order;
        self
    }

    /// How much an angle may change when mature elements are merged, rad; zero keeps all of them. 1e-4 by default: what
    /// is lost has no moments, so the tip moves by far less.
    pub fn merge_tolerance(mut self, tolerance: f64) -> Self {
        self.merge_tolerance = tolerance;
        self
    }

    /// The radius of a uniform section, m.
    pub fn radius(self, radius: f64) -> Self {
        self.taper(move |_| radius)
    }

    /// The radius of the section (m) as a function of the arc length from the base at t = 0 (m). It stays with the
    /// material.
    pub fn taper(mut self, radius: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        self.section = Section(Arc::new(radius));
        self
    }
}

impl<M: Model> ShootBuilder<M> {
    /// Checks every parameter and makes a straight shoot without intrinsic strain, at t = 0. An integrator finds its
    /// first equilibrium when it starts.
    ///
    /// # Errors
    /// The first parameter that makes no sense.
    pub fn build(self) -> Result<Shoot<M>, ParameterError> {
        let Self { ref section, length, elements, order, merge_tolerance, .. } = self;
        let model = &self.model;
        ParameterError::unless(
            length > 0.0 && length.is_finite(),
            "length",
            length,
            "positive and finite (m), given by `length`",
        )?;
        let radius = (section.0)(0.0);
        let slender = radius > 0.0 && radius < length;
        ParameterError::unless(
            slender,
            "radius",
            radius,
            "positive and smaller than the length (m), given by `radius` or `taper`",
        )?;
        ParameterError::unless(elements > 0, "number of elements", elements as f64, "at least 1")?;
        ParameterError::not_negative("merge tolerance", merge_tolerance)?;
        let sound = self.grows || !self.steers;
        ParameterError::unless(
            sound,
            "growth of a shoot that steers",
            0.0,
            "given by `growth`: steering is differential growth",
        )?;
        model.check(length)?;
        let (growth, zone) = (model.growth(), model.growth().zone_length());
        let grows = growth.elongates();
        ParameterError::unless(zone > 0.0, "length of the growth zone", zone, "positive (m)")?;
        let mature = if grows { (length - zone).max(0.0) } else { 0.0 };
        let (mut nodes, longest) = match &self.nodes {
            Some(nodes) => own_nodes(nodes, length, mature)?,
            // An element in the zone is never longer than its share; a shoot of constant length is all of one piece.
            None => {
                let longest = if grows && zone.is_finite() { zone } else { length } / elements as f64;
                (equal_nodes(length, mature, longest)?, longest)
            }
        };
        // Where something changes abruptly a node stands: at the boundary of the growth zone and where loads jump.
        let mut kept = vec![mature];
        for distance in model.load().jumps() {
            let on = distance >= 0.0 && distance <= length;
            ParameterError::unless(on, "distance from the apex at which a load jumps", distance, "on the shoot (m)")?;
            kept.push(length - distance);
        }
        for place in &mut kept {
            *place = insert_node(&mut nodes, *place);
        }
        let base = model.scene().base(0.0);
        let mut rod = Rod::straight(&nodes, |s| (section.0)(s), base, order)?;
        for (node, kept_node) in nodes.iter().zip(&mut rod.kept) {
            *kept_node = kept[1..].contains(node);
        }
        let below = nodes.iter().take_while(|node| **node < kept[0]).count();
        rod.first_growing = below;
        let p = order.points();
        for point in &mut rod.points[..below * p] {
            point.exit_time = exit_before_start(growth, point.apex_distance);
        }
        let volume = rod.volume();
        ParameterError::unless(volume.is_finite() && volume > 0.0, "volume", volume, "positive and finite (m³)")?;
        let mesh = Mesh { longest_element: longest, merge_tolerance };
        Ok(Shoot { model: self.model, mesh, state: State::new(rod) })
    }
}

/// Nodes at equal distances of at most `longest` (m), behind the growth zone and in it.
fn equal_nodes(length: f64, mature: f64, longest: f64) -> Result<Vec<f64>, ParameterError> {
    let wanted = length / longest;
    ParameterError::unless(wanted < MOST_ELEMENTS, "number of elements over the whole length", wanted, "below 1e6")?;
    // What exceeds a whole number of elements by rounding alone does not make another one.
    let count = |length: f64| (length / longest * (1.0 - 1e-12)).ceil() as usize;
    let (below, above) = (count(mature), count(length - mature).max(1));
    let mut nodes: Vec<f64> = (0..below).map(|i| mature * i as f64 / below as f64).collect();
    nodes.extend((0..=above).map(|i| mature + (length - mature) * i as f64 / above as f64));
    Ok(nodes)
}

/// Nodes that were given, and the longest element that they make in the growth zone, m.
fn own_nodes(nodes: &[f64], length: f64, mature: f64) -> Result<(Vec<f64>, f64), ParameterError> {
    let [first, last] = [nodes.first(), nodes.last()].map(|node| node.copied().unwrap_or(f64::NAN));
    ParameterError::unless(first == 0.0, "arc length of the first node", first, "0")?;
    let spans = (last - length).abs() <= SAME_PLACE * length;
    ParameterError::unless(spans, "arc length of the last node", last, "the length (m)")?;
    let mut nodes = nodes.to_vec();
    nodes.pop();
    nodes.push(length);
    insert_node(&mut nodes, mature);
    let growing = nodes.windows(2).filter(|ends| ends[0] >= mature * (1.0 - SAME_PLACE));
    let longest = growing.map(|ends| ends[1] - ends[0]).fold(0.0, f64::max);
    Ok((nodes, longest))
}

/// Puts a node at an arc length (m), unless there is one. Returns where the node is.
fn insert_node(nodes: &mut Vec<f64>, place: f64) -> f64 {
    let length = nodes.last().copied().unwrap_or(0.0);
    match nodes.iter().find(|node| (**node - place).abs() <= SAME_PLACE * length) {
        Some(node) => *node,
        None => {
            nodes.insert(nodes.partition_point(|node| *node < place), place);
            place
        }
    }
}

/// A shoot whose laws can cross threads can do so itself.
const _: () = {
    const fn crosses_threads<T: Send + Sync>() {}
    crosses_threads::<Shoot<BoxedLaws>>();
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
        lacking.rod.points.pop();
        let expected = RodError::Size { what: "material points", found: 7, expected: 8, elements: 2 };
        assert_eq!(shoot.restore(&lacking), Err(StateError::Rod(expected)));
        assert_eq!(shoot.state, kept);
        let mut long = kept.clone();
        long.rod.points.iter_mut().for_each(|point| point.jacobian *= 1e6);
        let error = shoot.restore(&long).unwrap_err();
        assert!(matches!(error, StateError::Value { what: "length of the rod", .. }), "{error}");
        assert_eq!(shoot.state, kept);
    }
}
