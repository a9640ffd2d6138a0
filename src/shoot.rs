//! A shoot: a state together with the laws that it obeys, built and checked in one place.

use crate::basis::Order;
use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::growth::{GrowthLaw, NoGrowth, exit_before_start};
use crate::load::Load;
use crate::rod::Rod;
use crate::scene::{Scene, Still};
use crate::state::State;
use crate::tropism::TropismLaw;

/// How fine the elements of a growing shoot are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mesh {
    /// Longest element in the growth zone, m. A longer one is cut in two.
    pub growing: f64,
    /// Longest element outside it that comes about by merging, m.
    pub mature: f64,
    /// Mature elements are merged while that changes no angle by more than this, rad.
    pub merge_tolerance: f64,
}

/// A shoot with its laws. Build one with [`Shoot::builder`], move it in time with an
/// [`Integrator`](crate::integrator::Integrator).
#[derive(Debug, Clone, PartialEq)]
pub struct Shoot<G, T, C, L, S> {
    pub(crate) growth: G,
    pub(crate) tropism: T,
    pub(crate) constitutive: C,
    pub(crate) load: L,
    pub(crate) scene: S,
    pub(crate) mesh: Mesh,
    pub(crate) state: State,
}

impl<C: Constitutive> Shoot<NoGrowth, (), C, (), Still> {
    /// Begins a shoot of the given elastic law: by default without growth, tropism or load, upright under gravity.
    pub fn builder(constitutive: C) -> ShootBuilder<C> {
        ShootBuilder {
            constitutive,
            growth: NoGrowth,
            tropism: (),
            load: (),
            scene: Still::upright(),
            radius: |_| f64::NAN,
            plan: Plan { length: f64::NAN, elements: 8, order: Order::default(), merge_tolerance: 1e-4 },
        }
    }
}

impl<G: GrowthLaw, T: TropismLaw, C: Constitutive, L: Load, S: Scene> Shoot<G, T, C, L, S> {
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
    pub fn tip(&self) -> nalgebra::Vector3<f64> {
        self.state.rod.tip()
    }

    /// Goes back, or forth, to a state of this shoot that was cloned before.
    pub fn restore(&mut self, state: &State) {
        self.state.clone_from(state);
    }

    /// The rod, to be perturbed. The next equilibrium starts from what is left here.
    #[must_use]
    pub fn rod_mut(&mut self) -> &mut Rod {
        &mut self.state.rod
    }

    /// The growth law.
    #[must_use]
    pub fn growth(&self) -> &G {
        &self.growth
    }

    /// The tropism laws.
    #[must_use]
    pub fn tropism(&self) -> &T {
        &self.tropism
    }

    /// The elastic law.
    #[must_use]
    pub fn constitutive(&self) -> &C {
        &self.constitutive
    }

    /// The loads.
    #[must_use]
    pub fn load(&self) -> &L {
        &self.load
    }

    /// Gravity and base.
    #[must_use]
    pub fn scene(&self) -> &S {
        &self.scene
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
pub struct ShootBuilder<C, G = NoGrowth, T = (), L = (), S = Still, R = fn(f64) -> f64> {
    constitutive: C,
    growth: G,
    tropism: T,
    load: L,
    scene: S,
    radius: R,
    plan: Plan,
}

/// The plain numbers of a builder.
#[derive(Debug, Clone, Copy)]
struct Plan {
    length: f64,
    elements: usize,
    order: Order,
    merge_tolerance: f64,
}

impl<C, G, T, L, S, R> ShootBuilder<C, G, T, L, S, R> {
    /// The length at t = 0, m.
    pub fn length(mut self, length: f64) -> Self {
        self.plan.length = length;
        self
    }

    /// The number of elements in the growth zone, or in the whole shoot if it has no zone; 8 by default. A zone that
    /// grows keeps at least so many.
    pub fn elements(mut self, elements: usize) -> Self {
        self.plan.elements = elements;
        self
    }

    /// The order of accuracy of the shape.
    pub fn order(mut self, order: Order) -> Self {
        self.plan.order = order;
        self
    }

    /// How much an angle may change when mature elements are merged, rad; zero keeps all of them. 1e-4 by default: what
    /// is lost has no moments, so the tip feels far less.
    pub fn merge_tolerance(mut self, tolerance: f64) -> Self {
        self.plan.merge_tolerance = tolerance;
        self
    }

    /// The radius of a uniform section, m.
    pub fn radius(self, radius: f64) -> ShootBuilder<C, G, T, L, S, impl Fn(f64) -> f64> {
        self.taper(move |_| radius)
    }

    /// The radius of the section (m) as a function of the arc length from the base at t = 0 (m). It stays with the
    /// material.
    pub fn taper<N: Fn(f64) -> f64>(self, radius: N) -> ShootBuilder<C, G, T, L, S, N> {
        let Self { constitutive, growth, tropism, load, scene, plan, .. } = self;
        ShootBuilder { constitutive, growth, tropism, load, scene, radius, plan }
    }

    /// How the shoot grows.
    pub fn growth<N>(self, growth: N) -> ShootBuilder<C, N, T, L, S, R> {
        let Self { constitutive, tropism, load, scene, radius, plan, .. } = self;
        ShootBuilder { constitutive, growth, tropism, load, scene, radius, plan }
    }

    /// How the shoot steers: a law, or a tuple of laws.
    pub fn tropism<N>(self, tropism: N) -> ShootBuilder<C, G, N, L, S, R> {
        let Self { constitutive, growth, load, scene, radius, plan, .. } = self;
        ShootBuilder { constitutive, growth, tropism, load, scene, radius, plan }
    }

    /// What loads the shoot: a load, or a tuple of loads.
    pub fn load<N>(self, load: N) -> ShootBuilder<C, G, T, N, S, R> {
        let Self { constitutive, growth, tropism, scene, radius, plan, .. } = self;
        ShootBuilder { constitutive, growth, tropism, load, scene, radius, plan }
    }

    /// Gravity and the base.
    pub fn scene<N>(self, scene: N) -> ShootBuilder<C, G, T, L, N, R> {
        let Self { constitutive, growth, tropism, load, radius, plan, .. } = self;
        ShootBuilder { constitutive, growth, tropism, load, scene, radius, plan }
    }
}

impl<C, G, T, L, S, R> ShootBuilder<C, G, T, L, S, R>
where
    C: Constitutive,
    G: GrowthLaw,
    T: TropismLaw,
    L: Load,
    S: Scene,
    R: Fn(f64) -> f64,
{
    /// Checks every parameter and makes a straight shoot without intrinsic strain, at t = 0. An integrator finds its
    /// first equilibrium when it starts.
    ///
    /// # Errors
    /// The first parameter that makes no sense.
    pub fn build(self) -> Result<Shoot<G, T, C, L, S>, ParameterError> {
        let Plan { length, elements, order, merge_tolerance } = self.plan;
        ParameterError::positive("length", length)?;
        ParameterError::unless(elements > 0, "number of elements", elements as f64, "at least 1")?;
        ParameterError::not_negative("merge tolerance", merge_tolerance)?;
        self.growth.check(length)?;
        self.tropism.check()?;
        self.constitutive.check()?;
        self.load.check()?;
        self.scene.check()?;
        let zone = self.growth.zone_length();
        let grows = self.growth.elongates();
        ParameterError::unless(zone > 0.0, "length of the growth zone", zone, "positive (m)")?;
        // An element in the zone is never longer than this; a shoot of constant length is all of one piece.
        let longest = if grows && zone.is_finite() { zone } else { length } / elements as f64;
        let mature = if grows { (length - zone).max(0.0) } else { 0.0 };
        let wanted = length / longest;
        ParameterError::unless(wanted < 1e6, "number of elements over the whole length", wanted, "below 1e6")?;
        // A whisker more than a whole number of elements is rounding.
        let count = |length: f64| (length / longest * (1.0 - 1e-12)).ceil() as usize;
        let below = count(mature);
        let above = count(length - mature).max(1);
        let mut nodes: Vec<f64> = (0..below).map(|i| mature * i as f64 / below as f64).collect();
        nodes.extend((0..=above).map(|i| mature + (length - mature) * i as f64 / above as f64));
        let base = self.scene.base(0.0);
        let mut rod = Rod::straight(&nodes, &self.radius, base, order)?;
        rod.first_growing = below;
        let p = order.points();
        for point in &mut rod.points[..below * p] {
            point.exit_time = exit_before_start(&self.growth, point.apex_distance);
        }
        let volume = rod.volume();
        ParameterError::unless(volume.is_finite() && volume > 0.0, "volume", volume, "positive and finite (m³)")?;
        Ok(Shoot {
            growth: self.growth,
            tropism: self.tropism,
            constitutive: self.constitutive,
            load: self.load,
            scene: self.scene,
            mesh: Mesh { growing: longest, mature: longest, merge_tolerance },
            state: State::new(rod),
        })
    }
}
