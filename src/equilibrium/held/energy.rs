//! Places of reactions, and the energy of a rod with its supports.

use nalgebra::{DVector, Vector3};

use super::conditions::{Conditions, Role};
use super::data::HeldSearch;
use super::elastic::elastic_joint;
use super::sites::{Friction, Site};
use super::touch::{place, starts};
use crate::constitutive::{Constitutive, line_strain_under};
use crate::load::{Load, PointReaction};
use crate::rod::{Rod, Tissue};
use crate::so3;
use crate::support::Energy;

/// Largest number of steps by which a contact slides to the place of least gap.
const SLIDES: usize = 8;
/// Distance from the place of least gap that is attributed to rounding, relative to the length.
const LEVEL: f64 = 1e-14;

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Evaluates the sites on the shape of a rod: positions, gaps, springs and friction. Contacts whose gap is least
    /// along the rod slide to that place.
    pub(super) fn locate(&mut self, rod: &Rod) {
        let time = self.force.environment().time;
        self.tangents.clear();
        self.tangents.extend((0..rod.points().len()).map(|i| {
            let frame = rod.frame_at_point(i / P, i % P);
            let tissue = Tissue::of(&rod.points()[i], time);
            frame * line_strain_under(self.material, &tissue, &frame, &self.force.at_points()[i])
        }));
        let starts = starts(rod, &self.tangents);
        let mut sites = std::mem::take(&mut self.sites);
        for site in &mut sites {
            self.place_site(rod, site, &starts);
            if let Some(spring) = &mut site.spring {
                spring.locate(&self.laws, &site.position, time);
            }
            self.press(rod, site);
        }
        self.sites = sites;
    }

    /// Computes the position of a site, given those of the first ends of the elements (m). For a contact it also
    /// evaluates the gap, and moves the contact along the rod to the place where the gap is least.
    fn place_site(&self, rod: &Rod, site: &mut Site, starts: &[Vector3<f64>]) {
        for last in (0..=SLIDES).map(|slides| slides == SLIDES) {
            site.position = place(rod, &self.tangents, (site.element, site.x), 0.0, &starts[site.element]).position;
            let Some(touch) = &mut site.touch else { break };
            touch.gap = self.obstacles.gap(touch.obstacle, &site.position);
            let frame = rod.frame_within(site.element, site.x);
            let bend = frame * rod.strain_within(site.element, site.x).cross(&Vector3::z());
            let (tangent, gap) = (frame * Vector3::z(), &touch.gap);
            let (slope, bend) =
                (gap.normal.dot(&tangent), gap.normal.dot(&bend) + tangent.dot(&(gap.curvature * tangent)));
            (touch.tangent, touch.approach) = (tangent, (slope, bend));
            if last || !touch.floats || !(bend > 0.0) || slope.abs() <= LEVEL * bend * self.length {
                break;
            }
            // Beside a straight rod the place of least gap is within this distance.
            let reach = 1.0 / gap.curvature.norm();
            slide(rod, site, (-slope / bend).clamp(-reach, reach));
            if site.element + 1 == rod.elements() && site.x >= 1.0 {
                // The gap is least at the apex, where it is not stationary.
                site.touch.iter_mut().for_each(|touch| touch.floats = false);
            }
        }
    }

    /// Sets the force of a contact to the normal force and the friction at its present gap.
    fn press(&self, rod: &Rod, site: &mut Site) {
        let Some(touch) = &mut site.touch else { return };
        site.force = touch.gap.normal * touch.push;
        let coefficient = self.obstacles.contacts[touch.obstacle].friction;
        if coefficient > 0.0 {
            let material = rod.initial_apex_distance(site.element, site.x);
            let anchor = self.before.anchor(material, &self.obstacles, touch.obstacle);
            let friction = touch.friction.get_or_insert_with(|| Friction::new(coefficient));
            friction.locate(&touch.gap.normal, &(site.position - anchor), touch.push);
            site.force += friction.force;
        }
    }

    /// Evaluates the elastic joints at the frames of a rod. Returns their energy, J.
    pub(super) fn stretch_joints(&mut self, rod: &Rod) -> f64 {
        let mut sum = 0.0;
        for (joint, (frame, law)) in self.system.joints.elastic.iter_mut().zip(&self.laws.joints) {
            let turn = so3::log(&(frame.inverse() * rod.frames()[joint.node]));
            let Energy { value, gradient, stiffness } = law.energy(&turn, self.obstacles.time);
            *joint = elastic_joint(joint.node, &turn, &gradient, &stiffness);
            sum += value;
        }
        sum
    }

    /// Applies the present reactions to the rod.
    pub(super) fn apply(&mut self, rod: &Rod) {
        let reactions = self.sites.iter().map(|site| PointReaction {
            element: site.element,
            x: site.x,
            force: site.force + site.spring_force(),
            couple: Vector3::zeros(),
        });
        self.force.set_reactions(rod, reactions);
    }

    /// Energy of the rod, its loads, springs and obstacles (J), at the last evaluation, which returned `energy`.
    /// `applied` are the forces in it and the places at which they act.
    pub(super) fn potential(&mut self, rod: &Rod, energy: f64, applied: &[(Vector3<f64>, (usize, f64))]) -> f64 {
        let joints = self.stretch_joints(rod);
        let springs: f64 = self.sites.iter().filter_map(|site| Some(site.spring?.energy)).sum();
        let work = |(force, at): &(Vector3<f64>, _)| force.dot(&self.place_of(rod, *at).position);
        let obstacles = self.obstacles.energy();
        energy + joints + springs + obstacles + applied.iter().map(work).sum::<f64>()
    }

    /// Magnitude of the force in the rod, N: without load the energy per length.
    pub(super) fn force_scale(&self) -> f64 {
        self.force.largest().max(self.energy_scale).max(f64::MIN_POSITIVE)
    }

    /// Sum of the violated distances, m.
    pub(super) fn violation(&self) -> f64 {
        self.sites.iter().flat_map(Site::missing).map(|(_, distance)| distance.abs()).sum()
    }

    /// The derivative of the potential along the step.
    pub(super) fn slope(
        &self,
        applied: &[(Vector3<f64>, (usize, f64))],
        conditions: &Conditions,
        changes: &DVector<f64>,
    ) -> f64 {
        let mut slope = self.system.slope::<P>();
        for (i, role) in conditions.roles.iter().enumerate() {
            let missing = conditions.residuals[i];
            match role {
                // The gradient contains the reactions, whose work is that of the moved sites.
                Role::Fixed(site, direction) => slope -= direction.dot(&applied[*site].0) * missing,
                // A spring that violates its law is not in balance with its energy.
                Role::Elastic(..) => slope -= missing * (changes[i] - conditions.diagonal[i] * missing),
                _ => {}
            }
        }
        slope
    }

    /// Magnitude of the largest reaction of a hold or contact after the changes of a step, N.
    pub(super) fn largest_reaction(&self, conditions: &Conditions, changes: &DVector<f64>) -> f64 {
        let each = conditions.roles.iter().zip(changes.iter()).map(|(role, change)| match role {
            Role::Fixed(site, direction) => (direction.dot(&self.sites[*site].force) + change).abs(),
            _ => 0.0,
        });
        each.fold(0.0, f64::max)
    }
}

/// Moves a site along the rod by a length (m), at most by the length of its element.
fn slide(rod: &Rod, site: &mut Site, by: f64) {
    let length = rod.length_of(site.element);
    let mut rest = site.x * length + by.clamp(-length, length);
    while rest < 0.0 && site.element > 0 {
        site.element -= 1;
        rest += rod.length_of(site.element);
    }
    while rest > rod.length_of(site.element) && site.element + 1 < rod.elements() {
        rest -= rod.length_of(site.element);
        site.element += 1;
    }
    site.x = (rest / rod.length_of(site.element)).clamp(0.0, 1.0);
}
