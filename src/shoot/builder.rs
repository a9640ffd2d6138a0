//! Builder of shoots.

use std::sync::Arc;

use super::nodes::{equal_nodes, insert_node, user_nodes};
use super::{Mesh, Shoot, jumps};
use crate::equilibrium::{LARGEST_TOLERANCE, check_stiffness};
use crate::error::ParameterError;
use crate::growth::{GrowthLaw, exit_before_start};
use crate::load::{InternalForce, Load};
use crate::model::{Constitutive, DynLaws, Laws, Model, Support, TropismLaw, check};
use crate::reference_element::Order;
use crate::rod::{Rod, Tissue};
use crate::scene::{Scene, Still};
use crate::section::Section;
use crate::state::State;

impl<C: Constitutive> Shoot<Laws<C>> {
    /// A builder of a shoot with the given elastic law. By default it has no growth, tropism or
    /// load, and an upright base under gravity.
    pub fn builder(constitutive: C) -> ShootBuilder<Laws<C>> {
        let laws = Laws {
            constitutive,
            growth: (),
            tropism: (),
            load: (),
            scene: Still::upright(),
            support: (),
        };
        ShootBuilder {
            grows: false,
            ..Shoot::of(laws)
        }
    }
}

impl<M: Model> Shoot<M> {
    /// A builder of a shoot with the given model.
    pub fn of(model: M) -> ShootBuilder<M> {
        ShootBuilder {
            model,
            section: None,
            length: None,
            elements: 8,
            nodes: None,
            steers: false,
            grows: true,
            order: Order::default(),
            merge_tolerance: 1e-4,
        }
    }
}

/// Builder of a [`Shoot`]: laws, length, section and mesh. [`build`](Self::build) checks them.
///
/// Length and section are required.
#[derive(Debug, Clone)]
#[must_use]
pub struct ShootBuilder<M> {
    model: M,
    section: Option<SectionAlong>,
    length: Option<f64>,
    elements: usize,
    nodes: Option<Vec<f64>>,
    /// Whether a tropism was given.
    steers: bool,
    /// Whether a growth law was given. A tropism without one is an error.
    grows: bool,
    order: Order,
    merge_tolerance: f64,
}

/// The section as a function of the arc length from the base (m).
#[derive(Clone)]
struct SectionAlong(Arc<dyn Fn(f64) -> Section + Send + Sync>);

impl std::fmt::Debug for SectionAlong {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?} at the base", (self.0)(0.0))
    }
}

impl<C, G, T, L, S, U> ShootBuilder<Laws<C, G, T, L, S, U>> {
    /// Sets the growth law.
    pub fn growth<N: GrowthLaw>(self, growth: N) -> ShootBuilder<Laws<C, N, T, L, S, U>> {
        Self {
            grows: true,
            ..self
        }
        .with(|laws| laws.with_growth(growth))
    }

    /// Sets the tropism law, or a tuple of laws. Steering is differential growth, so
    /// [`build`](Self::build) returns an error for a tropism without [`growth`](Self::growth). An
    /// explicit `growth(())` is accepted.
    pub fn tropism<N: TropismLaw>(self, tropism: N) -> ShootBuilder<Laws<C, G, N, L, S, U>> {
        Self {
            steers: true,
            ..self
        }
        .with(|laws| laws.with_tropism(tropism))
    }

    /// Sets the load, or a tuple of loads.
    pub fn load<N: Load>(self, load: N) -> ShootBuilder<Laws<C, G, T, N, S, U>> {
        self.with(|laws| laws.with_load(load))
    }

    /// Sets gravity and the frame of the base.
    pub fn scene<N: Scene>(self, scene: N) -> ShootBuilder<Laws<C, G, T, L, N, U>> {
        self.with(|laws| laws.with_scene(scene))
    }

    /// Sets what holds the shoot besides its base, and what it may touch: a support or a tuple of
    /// supports.
    pub fn support<N: Support>(self, support: N) -> ShootBuilder<Laws<C, G, T, L, S, N>> {
        self.with(|laws| laws.with_support(support))
    }
}

impl<C, G, T, L, S, U> ShootBuilder<Laws<C, G, T, L, S, U>>
where
    C: Constitutive + Send + Sync + 'static,
    G: GrowthLaw + Send + Sync + 'static,
    T: TropismLaw + Send + Sync + 'static,
    L: Load + Send + Sync + 'static,
    S: Scene + Send + Sync + 'static,
    U: Support + Send + Sync + 'static,
{
    /// Converts the laws into laws of one common type: see [`DynLaws`].
    pub fn into_dyn(self) -> ShootBuilder<DynLaws> {
        self.with(Laws::into_dyn)
    }
}

impl<M> ShootBuilder<M> {
    /// Replaces the model.
    fn with<N>(self, change: impl FnOnce(M) -> N) -> ShootBuilder<N> {
        let Self {
            model,
            section,
            length,
            elements,
            nodes,
            steers,
            grows,
            order,
            merge_tolerance,
        } = self;
        ShootBuilder {
            model: change(model),
            section,
            length,
            elements,
            nodes,
            steers,
            grows,
            order,
            merge_tolerance,
        }
    }

    /// Sets the length at t = 0, m; positive and finite. [`build`](Self::build) returns an error
    /// otherwise.
    pub fn length(self, length: f64) -> Self {
        Self {
            length: Some(length),
            ..self
        }
    }

    /// Sets the number of elements in the growth zone, or in the whole shoot if it does not
    /// elongate; 8 by default. As the shoot grows, the zone has at least this number of elements.
    pub fn elements(self, elements: usize) -> Self {
        Self { elements, ..self }
    }

    /// Sets the ends of the elements instead of equal elements: increasing arc lengths from the
    /// base at t = 0 (m), from 0 to the length. Heavy rods need shorter elements near the base.
    ///
    /// Nodes are added where loads jump and where the growth zone begins. The longest element in
    /// the zone at t = 0 is the longest that growth and merging permit later. Merging keeps the
    /// given nodes, where the section may have kinks.
    pub fn nodes(self, nodes: &[f64]) -> Self {
        Self {
            nodes: Some(nodes.to_vec()),
            ..self
        }
    }

    /// Sets the order of accuracy of the shape; eight by default.
    pub fn order(self, order: Order) -> Self {
        Self { order, ..self }
    }

    /// Sets the largest rotation (rad) of the part beyond by which merging of mature elements may
    /// change the shape, at most 0.1; 1e-4 by default. Zero disables merging.
    ///
    /// Inside a merged element the root mean square of the lost angle is at most twenty times the
    /// tolerance, up to 2e-3 rad, or the tolerance if that is larger. With p material points in an
    /// element, the moments of the lost angle of degree 0 to p − 2 vanish, so that the tip moves by
    /// far less. The relative change of an element's compliance is at most a hundredth of the
    /// tolerance.
    pub fn merge_tolerance(self, tolerance: f64) -> Self {
        Self {
            merge_tolerance: tolerance,
            ..self
        }
    }

    /// Sets the radius of a uniform circular section, m; positive and smaller than the length.
    pub fn radius(self, radius: f64) -> Self {
        self.section(move |_| radius)
    }

    /// Sets the section, or the radius (m) of a circular one, as a function of the arc length from
    /// the base at t = 0 (m). The section stays with the material.
    ///
    /// The shape has its full order for a function that is smooth within the elements; kinks need
    /// [`nodes`](Self::nodes).
    ///
    /// ```
    /// use morphorod::constitutive::LinearElastic;
    /// use morphorod::{Section, Shoot};
    /// // A blade, 4 mm by 2 mm at the base and half of that at the tip.
    /// let blade = |s: f64| Section::ellipse(2e-3 * (1.0 - 5.0 * s), 1e-3 * (1.0 - 5.0 * s));
    /// let law = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
    /// let shoot = Shoot::builder(law).length(0.1).section(blade).build()?;
    /// // A cone.
    /// let cone = Shoot::builder(law).length(0.1).section(|s| 2e-3 * (1.0 - 5.0 * s)).build()?;
    /// # let _ = (shoot, cone);
    /// # Ok::<(), morphorod::ParameterError>(())
    /// ```
    pub fn section<S: Into<Section>>(
        self,
        section: impl Fn(f64) -> S + Send + Sync + 'static,
    ) -> Self {
        Self {
            section: Some(SectionAlong(Arc::new(move |s| section(s).into()))),
            ..self
        }
    }
}

impl<M: Model> ShootBuilder<M> {
    /// Checks all parameters and builds a straight shoot without intrinsic strain, at t = 0. An
    /// integrator computes its first equilibrium when it starts.
    ///
    /// # Errors
    /// The first parameter that is missing or out of range.
    pub fn build(self) -> Result<Shoot<M>, ParameterError> {
        let Self {
            elements,
            order,
            merge_tolerance,
            ..
        } = self;
        let model = &self.model;
        let requirement = "positive and finite (m), given by `length`";
        let length = self
            .length
            .ok_or(ParameterError::missing("length", requirement))?;
        ParameterError::unless(
            length > 0.0 && length.is_finite(),
            "length",
            length,
            requirement,
        )?;
        let section = "positive and smaller than the length (m), given by `radius` or `section`";
        let SectionAlong(along) = self
            .section
            .ok_or(ParameterError::missing("radius", section))?;
        along(0.0).check(length, section)?;
        ParameterError::unless(
            elements > 0,
            "number of elements",
            elements as f64,
            "at least 1",
        )?;
        let ok = (0.0..=LARGEST_TOLERANCE).contains(&merge_tolerance);
        ParameterError::unless(
            ok,
            "merge tolerance",
            merge_tolerance,
            "from 0 to 0.1 (rad)",
        )?;
        if self.steers && !self.grows {
            let growth = "given by `growth`, since steering is differential growth; use `growth(())` for none";
            return Err(ParameterError::missing(
                "growth of a shoot that steers",
                growth,
            ));
        }
        check(model, length)?;
        let (growth, zone) = (model.growth(), model.growth().zone_length());
        let grows = growth.elongates();
        let mature = if grows { (length - zone).max(0.0) } else { 0.0 };
        let mut kept = vec![mature];
        let (mut nodes, longest) = match &self.nodes {
            Some(nodes) => {
                kept.extend_from_slice(
                    nodes
                        .get(1..nodes.len().saturating_sub(1))
                        .unwrap_or_default(),
                );
                user_nodes(nodes, length, mature)?
            }
            None => {
                let longest = if grows && zone.is_finite() {
                    zone
                } else {
                    length
                } / elements as f64;
                (equal_nodes(length, mature, longest)?, longest)
            }
        };
        // Discontinuities are at nodes: the boundary of the growth zone, and places where loads
        // jump.
        kept.extend(
            jumps(model, 0.0, length)?
                .iter()
                .map(|distance| length - distance),
        );
        for place in &mut kept {
            *place = insert_node(&mut nodes, *place);
        }
        let scene = model.scene();
        let mut rod = Rod::straight(&nodes, |s| along(s), scene.base(0.0), order)?;
        rod.set_base_position(scene.position(0.0))?;
        let to_keep = nodes
            .iter()
            .zip(0..)
            .filter(|(node, _)| kept[1..].contains(node));
        to_keep.for_each(|(_, i)| rod.kept[i] = true);
        let below = nodes.iter().take_while(|node| **node < kept[0]).count();
        for point in rod.mature(below) {
            point.exit_time = exit_before_start(growth, point.apex_distance);
        }
        check_tissue(&rod, model, 0.0)?;
        check_resolved(&rod, |s| along(s))?;
        let volume = rod.volume();
        ParameterError::unless(
            volume.is_finite() && volume > 0.0,
            "volume",
            volume,
            "positive and finite (m³)",
        )?;
        let mesh = Mesh {
            longest_element: longest,
            merge_tolerance,
        };
        let divided = if grows && zone.is_finite() {
            zone
        } else {
            length
        };
        Ok(Shoot {
            model: self.model,
            mesh,
            resolution: divided / longest,
            state: State::new(rod),
        })
    }
}

/// Returns an error for a law without stiffness and for a load that is not finite, at some place of
/// the rod at a time (s).
pub(super) fn check_tissue(rod: &Rod, model: &impl Model, time: f64) -> Result<(), ParameterError> {
    check_stiffness(rod, model.constitutive(), time)?;
    let environment = model.scene().environment(time);
    ParameterError::finite("gravity", environment.gravity.sum(), "m/s²")?;
    for point in rod.points() {
        let tissue = Tissue::of(point, time);
        let place = rod.initial_length - tissue.initial_apex_distance;
        let force = model.load().per_length(&tissue, &environment).sum();
        ParameterError::finite("force per length", force, "N/m")
            .map_err(|error| error.at(place))?;
    }
    let force = InternalForce::of(rod, model.load(), &environment);
    ParameterError::finite(
        "force of the load on the whole shoot",
        force.at_base().sum(),
        "N",
    )?;
    for (cut, force) in force.cuts().iter().zip(force.at_points()) {
        let finite = ParameterError::finite(
            "force of the load on the part beyond a place",
            force.sum(),
            "N",
        );
        finite.map_err(|error| error.at(cut.arc_length))?;
    }
    Ok(())
}

/// Returns an error for a section that the elements do not resolve, such as one that jumps inside
/// an element. Its polynomial might become negative when the element is divided.
fn check_resolved(rod: &Rod, section: impl Fn(f64) -> Section) -> Result<(), ParameterError> {
    let (length, mut start) = (rod.initial_length, 0.0);
    for e in 0..rod.elements() {
        let h = rod.length_of(e);
        for x in [0.02, 0.25, 0.5, 0.75, 0.98] {
            let (s, found) = (start + h * x, rod.point_within(e, x).section);
            let given = section(s);
            for (found, given) in [
                (found.along_d1, given.along_d1),
                (found.along_d2, given.along_d2),
            ] {
                let (what, ratio) = (
                    "interpolated semi-axis of the section over the given one",
                    found / given,
                );
                let ok = ratio > 0.5 && ratio < 2.0;
                ParameterError::unless(
                    ok,
                    what,
                    ratio,
                    "between a half and two; put a node where it jumps",
                )
                .map_err(|error| error.at(s.min(length)))?;
            }
        }
        start += h;
    }
    Ok(())
}
