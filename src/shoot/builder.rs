//! Building a shoot: everything is collected, checked once, and put together.

use std::sync::Arc;

use super::{MOST_ELEMENTS, Mesh, SAME_PLACE, Shoot, jumps};
use crate::constitutive::Constitutive;
use crate::equilibrium::check_stiffness;
use crate::error::ParameterError;
use crate::growth::{GrowthLaw, NoGrowth, exit_before_start};
use crate::load::Load;
use crate::model::{DynLaws, Laws, Model, check};
use crate::reference_element::Order;
use crate::rod::{Rod, Tissue};
use crate::scene::{Scene, Still};
use crate::section::Section;
use crate::state::State;
use crate::tropism::TropismLaw;

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

/// Collects what a shoot is made of; [`build`](Self::build) checks it once.
#[derive(Debug, Clone)]
#[must_use]
pub struct ShootBuilder<M> {
    model: M,
    section: Option<SectionAlong>,
    length: Option<f64>,
    elements: usize,
    nodes: Option<Vec<f64>>,
    /// Whether a tropism was given, and a growth law: steering without growth is a mistake unless it is asked for.
    steers: bool,
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

impl<C, G, T, L, S> ShootBuilder<Laws<C, G, T, L, S>> {
    /// How the shoot grows.
    pub fn growth<N: GrowthLaw>(mut self, growth: N) -> ShootBuilder<Laws<C, N, T, L, S>> {
        self.grows = true;
        self.with(|laws| laws.with_growth(growth))
    }

    /// How the shoot steers: a law, or a tuple of laws. Steering is differential growth: without
    /// [`growth`](Self::growth) nothing would come of it, and [`build`](Self::build) refuses; `growth(NoGrowth)` asks for it.
    pub fn tropism<N: TropismLaw>(mut self, tropism: N) -> ShootBuilder<Laws<C, G, N, L, S>> {
        self.steers = true;
        self.with(|laws| laws.with_tropism(tropism))
    }

    /// What loads the shoot: a load, or a tuple of loads.
    pub fn load<N: Load>(self, load: N) -> ShootBuilder<Laws<C, G, T, N, S>> {
        self.with(|laws| laws.with_load(load))
    }

    /// Gravity and the base.
    pub fn scene<N: Scene>(self, scene: N) -> ShootBuilder<Laws<C, G, T, L, N>> {
        self.with(|laws| laws.with_scene(scene))
    }
}

impl<C, G, T, L, S> ShootBuilder<Laws<C, G, T, L, S>>
where
    C: Constitutive + Send + Sync + 'static,
    G: GrowthLaw + Send + Sync + 'static,
    T: TropismLaw + Send + Sync + 'static,
    L: Load + Send + Sync + 'static,
    S: Scene + Send + Sync + 'static,
{
    /// Converts the laws into laws of one common type: see [`DynLaws`].
    pub fn into_dyn(self) -> ShootBuilder<DynLaws> {
        self.with(Laws::into_dyn)
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
        self.length = Some(length);
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
    /// growth zone ends; as a zone grows its elements stay shorter than the longest that it has now. Growth and merging keep all
    /// of them, since a section may have its kinks there.
    pub fn nodes(mut self, nodes: &[f64]) -> Self {
        self.nodes = Some(nodes.to_vec());
        self
    }

    /// The order of accuracy of the shape.
    pub fn order(mut self, order: Order) -> Self {
        self.order = order;
        self
    }

    /// How much mature elements that are merged may turn what lies beyond them, rad; zero keeps all of them. 1e-4 by default. Inside
    /// an element an angle may change by twenty times that, up to 2e-3 (root of the mean square), or by the tolerance if that is
    /// larger: what is lost has no moments, so that the tip moves by far less. The stiffness of an element is held to a hundredth of
    /// the tolerance, relative to itself.
    pub fn merge_tolerance(mut self, tolerance: f64) -> Self {
        self.merge_tolerance = tolerance;
        self
    }

    /// The radius of a uniform circular section, m.
    pub fn radius(self, radius: f64) -> Self {
        self.taper(move |_| radius)
    }

    /// The radius of a circular section (m) as a function of the arc length from the base at t = 0 (m). It stays with the
    /// material.
    pub fn taper(self, radius: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        self.section(move |s| Section::circle(radius(s)))
    }

    /// The section as a function of the arc length from the base at t = 0 (m). It stays with the material. A function that is
    /// smooth within the elements keeps their order; put [`nodes`](Self::nodes) where it has a kink.
    ///
    /// ```
    /// use morphorod::constitutive::LinearElastic;
    /// use morphorod::{Section, Shoot};
    /// // A blade, 4 mm by 2 mm at the base and half of that at the tip.
    /// let blade = |s: f64| Section::ellipse(2e-3 * (1.0 - 5.0 * s), 1e-3 * (1.0 - 5.0 * s));
    /// let law = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
    /// let shoot = Shoot::builder(law).length(0.1).section(blade).build()?;
    /// # let _ = shoot;
    /// # Ok::<(), morphorod::ParameterError>(())
    /// ```
    pub fn section(mut self, section: impl Fn(f64) -> Section + Send + Sync + 'static) -> Self {
        self.section = Some(SectionAlong(Arc::new(section)));
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
        let Self { elements, order, merge_tolerance, .. } = self;
        let model = &self.model;
        let length = "positive and finite (m), given by `length`";
        let length = self.length.ok_or(ParameterError::missing("length", length)).and_then(|value| {
            let ok = value > 0.0 && value.is_finite();
            ParameterError::unless(ok, "length", value, length).map(|()| value)
        })?;
        let section = "positive and smaller than the length (m), given by `radius`, `taper` or `section`";
        let SectionAlong(along) = self.section.ok_or(ParameterError::missing("radius", section))?;
        along(0.0).check(length, section)?;
        ParameterError::unless(elements > 0, "number of elements", elements as f64, "at least 1")?;
        ParameterError::not_negative("merge tolerance", merge_tolerance)?;
        if self.steers && !self.grows {
            let growth = "given by `growth`: steering is differential growth; `growth(NoGrowth)` if there is none";
            return Err(ParameterError::missing("growth of a shoot that steers", growth));
        }
        check(model, length)?;
        let (growth, zone) = (model.growth(), model.growth().zone_length());
        let grows = growth.elongates();
        ParameterError::unless(zone > 0.0, "length of the growth zone", zone, "positive (m)")?;
        let mature = if grows { (length - zone).max(0.0) } else { 0.0 };
        let mut kept = vec![mature];
        let (mut nodes, longest) = match &self.nodes {
            // Nodes of one's own may stand where the section has a kink.
            Some(nodes) => {
                kept.extend_from_slice(nodes.get(1..nodes.len().saturating_sub(1)).unwrap_or_default());
                own_nodes(nodes, length, mature)?
            }
            // An element in the zone is never longer than its share; a shoot of constant length is all of one piece.
            None => {
                let longest = if grows && zone.is_finite() { zone } else { length } / elements as f64;
                (equal_nodes(length, mature, longest)?, longest)
            }
        };
        // Discontinuities are at nodes: the boundary of the growth zone, and places where loads jump.
        kept.extend(jumps(model.load(), length)?.iter().map(|distance| length - distance));
        for place in &mut kept {
            *place = insert_node(&mut nodes, *place);
        }
        let base = model.scene().base(0.0);
        let mut rod = Rod::straight(&nodes, |s| along(s), base, order)?;
        let to_keep = nodes.iter().zip(0..).filter(|(node, _)| kept[1..].contains(node));
        to_keep.for_each(|(_, i)| rod.keep_node(i));
        let below = nodes.iter().take_while(|node| **node < kept[0]).count();
        for point in rod.mature(below) {
            point.exit_time = exit_before_start(growth, point.apex_distance);
        }
        check_tissue(&rod, model, 0.0)?;
        check_resolved(&rod, |s| along(s))?;
        let volume = rod.volume();
        ParameterError::unless(volume.is_finite() && volume > 0.0, "volume", volume, "positive and finite (m³)")?;
        let mesh = Mesh { longest_element: longest, merge_tolerance };
        let divided = if grows && zone.is_finite() { zone } else { length };
        Ok(Shoot { model: self.model, mesh, resolution: divided / longest, state: State::new(rod) })
    }
}

/// Refuses laws that have no sound answer for the tissue at some place.
pub(super) fn check_tissue(rod: &Rod, model: &impl Model, time: f64) -> Result<(), ParameterError> {
    check_stiffness(rod, model.constitutive(), time)?;
    let environment = model.scene().environment(time);
    for point in rod.points() {
        let tissue = Tissue::of(point, time);
        let place = rod.initial_length() - tissue.initial_apex_distance;
        let force = model.load().per_length(&tissue, &environment).sum();
        ParameterError::finite("force per length", force).map_err(|error| error.at(place))?;
    }
    Ok(())
}

/// Refuses a section that the elements do not resolve, as one that jumps inside an element: cut, it might become negative.
fn check_resolved(rod: &Rod, section: impl Fn(f64) -> Section) -> Result<(), ParameterError> {
    let (length, mut start) = (rod.initial_length(), 0.0);
    for e in 0..rod.elements() {
        let h = rod.element_length(e);
        for x in [0.02, 0.25, 0.5, 0.75, 0.98] {
            let (s, found) = (start + h * x, rod.section_within(e, x));
            let given = section(s);
            for (found, given) in [(found.along_d1, given.along_d1), (found.along_d2, given.along_d2)] {
                let (what, ratio) = ("section as the elements hold it, relative to the one given", found / given);
                let ok = ratio > 0.5 && ratio < 2.0;
                ParameterError::unless(ok, what, ratio, "between a half and two: put nodes where it jumps")
                    .map_err(|error| error.at(s.min(length)))?;
            }
        }
        start += h;
    }
    Ok(())
}

/// Nodes at equal distances of at most `longest` (m), behind the growth zone and in it.
fn equal_nodes(length: f64, mature: f64, longest: f64) -> Result<Vec<f64>, ParameterError> {
    check_number(length, longest)?;
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
    check_number(length, longest)?;
    Ok((nodes, longest))
}

/// Refuses elements of which a million would lie on the shoot.
fn check_number(length: f64, longest: f64) -> Result<(), ParameterError> {
    let wanted = length / longest;
    ParameterError::unless(wanted < MOST_ELEMENTS, "number of elements over the whole length", wanted, "below 1e6")
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
