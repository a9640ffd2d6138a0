//! What the laws of a shoot ask for when it has been as it is for ever.

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};

use super::StabilityError;
use crate::load::{InternalForce, Load};
use crate::model::Model;
use crate::rod::Rod;
use crate::scene::Scene;
use crate::sensing::visit_sites;
use crate::shoot::Shoot;
use crate::tropism::{Declaration, Growing, Site, TropismLaw};

/// Turn of a frame for differences, rad: central ones then err by 1e-9 of a third derivative, and rounding by 1e-12.
const TURN: f64 = 1e-4;

/// Variables, stimuli and gradients of a shoot that has been as it is for ever.
pub(super) struct Settled {
    pub gradients: Vec<Vector3<f64>>,
    pub stimuli: Vec<Vec<f64>>,
    pub variables: Vec<Vec<f64>>,
    pub places: Vec<Growing>,
    /// ∂stimuli/∂strain at each point; empty before it is [asked for](Self::differentiate).
    pub local: Vec<DMatrix<f64>>,
    /// ∂stimuli/∂turn of the frame at each point, about the directors, 1/rad; empty likewise.
    pub turn: Vec<DMatrix<f64>>,
}

impl Settled {
    /// Evaluates the laws of `shoot` on `rod` under `load`.
    pub fn of(shoot: &Shoot<impl Model>, rod: &Rod, force: &InternalForce) -> Self {
        let law = shoot.model.tropism();
        let laws = Declaration::of(law);
        let size = laws.size();
        let points = rod.points().len() - rod.first_growing() * rod.order().points();
        let blank = Growing { time: force.environment().time, radius: 0.0, apex_distance: 0.0 };
        let mut out = Self {
            gradients: vec![Vector3::zeros(); points],
            stimuli: vec![vec![0.0; size.stimuli]; points],
            variables: vec![vec![0.0; size.variables]; points],
            places: vec![blank; points],
            local: Vec::new(),
            turn: Vec::new(),
        };
        visit_sites(rod, shoot.model.constitutive(), force, laws.needs_position(), |i, site| {
            law.sense(site, &mut out.stimuli[i]);
            law.steady(&out.stimuli[i], &mut out.variables[i]);
            out.places[i] =
                Growing { time: force.environment().time, radius: site.radius, apex_distance: site.apex_distance };
            out.gradients[i] = law.gradient(&out.places[i], &out.variables[i], size.present(&out.stimuli[i]));
        });
        out
    }

    /// Fills in the derivatives of the stimuli by the strain and by the turn of the frame.
    pub fn differentiate(&mut self, shoot: &Shoot<impl Model>, rod: &Rod, force: &InternalForce) {
        let law = shoot.model.tropism();
        let laws = Declaration::of(law);
        let m = laws.size().stimuli;
        self.local = vec![DMatrix::zeros(m, 3); self.places.len()];
        self.turn = self.local.clone();
        visit_sites(rod, shoot.model.constitutive(), force, laws.needs_position(), |i, site| {
            let sensed = |site: &Site| {
                let mut x = vec![0.0; m];
                law.sense(site, &mut x);
                DVector::from_vec(x)
            };
            for c in 0..3 {
                let axis = Vector3::ith(c, 1.0);
                // Stimuli are mostly linear in the strain; a step of a thousandth of 1/radius does for the rest.
                let h = 1e-3 / site.radius;
                let bent = |sign: f64| sensed(&Site { strain: site.strain + axis * (sign * h), ..*site });
                self.local[i].set_column(c, &((bent(1.0) - bent(-1.0)) / (2.0 * h)));
                let turned = |sign: f64| {
                    let frame = site.frame * UnitQuaternion::from_scaled_axis(axis * (sign * TURN));
                    sensed(&Site { frame, ..*site })
                };
                self.turn[i].set_column(c, &((turned(1.0) - turned(-1.0)) / (2.0 * TURN)));
            }
        });
    }

    /// The largest gradient asked for, 1/m.
    pub fn largest(&self) -> f64 {
        self.gradients.iter().map(Vector3::norm).fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
    }
}

/// Refuses what depends on time: laws, loads, gravity, the base.
pub(super) fn check_unforced(
    shoot: &Shoot<impl Model>,
    rod: &Rod,
    load: &impl Load,
    settled: &Settled,
) -> Result<(), StabilityError> {
    let law = shoot.model.tropism();
    let laws = Declaration::of(law);
    let size = laws.size();
    let time = shoot.state.time;
    let base = shoot.model.scene().base(time);
    let (mut stimuli, mut variables) = (vec![0.0; size.stimuli], vec![0.0; size.variables]);
    let mut change = 0.0_f64;
    // Incommensurate times, from seconds to days: no period divides them all.
    for later in [1.0, 7.3, 101.1, 977.7, 6151.3, 40_009.9].map(|after| time + after) {
        let force = InternalForce::of(rod, load, &shoot.model.scene().environment(later));
        // A base that has turned shows in nothing that is sensed on the rod as it is.
        change = change.max(base.angle_to(&shoot.model.scene().base(later)) / rod.length());
        visit_sites(rod, shoot.model.constitutive(), &force, laws.needs_position(), |i, site| {
            law.sense(site, &mut stimuli);
            law.steady(&stimuli, &mut variables);
            let at = Growing { time: later, ..settled.places[i] };
            change = change.max((law.gradient(&at, &variables, size.present(&stimuli)) - settled.gradients[i]).norm());
        });
    }
    // Rounding of a gradient of the size of 1/radius.
    let size = settled.places.first().map_or(1.0, |place| 1.0 / place.radius);
    if change > 1e-12 * size { Err(StabilityError::Forced { change }) } else { Ok(()) }
}
