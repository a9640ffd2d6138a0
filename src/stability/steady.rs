//! Stimuli, variables and gradients of a shoot whose state has lasted for ever.

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};

use super::error::StabilityError;
use crate::growth::GrowthLaw;
use crate::load::{InternalForce, Load};
use crate::model::Model;
use crate::rod::Rod;
use crate::scene::Scene;
use crate::sensing::visit_sites;
use crate::shoot::Shoot;
use crate::tropism::{Declaration, Growing, Site, TropismLaw, law_matrices};

/// Turn of a frame for differences, rad: central ones then err by 1e-9 of a third derivative, and rounding by 1e-12.
const TURN: f64 = 1e-4;

/// Largest rate of a variable in the steady state of a law, relative to the terms that cancel in it. It leaves room for laws that solve
/// for their steady state by iteration, and is the accuracy that is required of a stationary state.
const STEADY: f64 = 1e-8;

/// The laws at every material point of the growth zone.
pub(crate) struct SteadyState {
    pub gradients: Vec<Vector3<f64>>,
    /// One column for every point.
    pub stimuli: DMatrix<f64>,
    pub variables: DMatrix<f64>,
    pub places: Vec<Growing>,
}

impl SteadyState {
    /// Evaluates the laws of `shoot` on `rod`, in which there is a force.
    pub fn of(shoot: &Shoot<impl Model>, rod: &Rod, force: &InternalForce) -> Self {
        let law = shoot.model.tropism();
        let laws = Declaration::of(law);
        let size = laws.size();
        let time = force.environment().time;
        let points = rod.zone().len();
        let mut out = Self {
            gradients: vec![Vector3::zeros(); points],
            stimuli: DMatrix::zeros(size.stimuli, points),
            variables: DMatrix::zeros(size.variables, points),
            places: vec![Growing::new(time, 0.0, 0.0); points],
        };
        visit_sites(rod, shoot.model.constitutive(), force, laws.reads_position(), |i, site| {
            let (mut stimuli, mut variables) = (out.stimuli.column_mut(i), out.variables.column_mut(i));
            law.sense(site, stimuli.as_mut_slice());
            law.steady(stimuli.as_slice(), variables.as_mut_slice());
            out.places[i] = Growing::new(time, site.section, site.apex_distance);
            out.gradients[i] = law.gradient(&out.places[i], variables.as_slice(), size.present(stimuli.as_slice()));
        });
        out
    }

    /// The largest gradient, 1/m; not a number if one of them is not.
    pub fn largest_gradient(&self) -> f64 {
        self.gradients.iter().map(Vector3::norm).fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
    }

    /// The radius of the shoot at the base of the growth zone, m; one if nothing grows.
    pub fn radius(&self) -> f64 {
        self.places.first().map_or(1.0, |place| place.section.radius())
    }
}

/// The derivatives of the stimuli at every material point of the growth zone, by central differences: by the strain at the
/// point itself, and by the turn of its frame about the directors, 1/rad.
pub(super) fn stimulus_derivatives(
    shoot: &Shoot<impl Model>,
    rod: &Rod,
    force: &InternalForce,
) -> (Vec<DMatrix<f64>>, Vec<DMatrix<f64>>) {
    let law = shoot.model.tropism();
    let laws = Declaration::of(law);
    let m = laws.size().stimuli;
    let mut strain = vec![DMatrix::zeros(m, 3); rod.zone().len()];
    let mut turn = strain.clone();
    let sensed = |site: &Site| {
        let mut x = DVector::zeros(m);
        law.sense(site, x.as_mut_slice());
        x
    };
    visit_sites(rod, shoot.model.constitutive(), force, laws.reads_position(), |i, site| {
        for c in 0..3 {
            let axis = Vector3::ith(c, 1.0);
            // Stimuli are mostly linear in the strain; a step of a thousandth of 1/radius does for the rest.
            let h = 1e-3 / site.section.radius();
            let bent = |sign: f64| sensed(&Site { strain: site.strain + axis * (sign * h), ..*site });
            strain[i].set_column(c, &((bent(1.0) - bent(-1.0)) / (2.0 * h)));
            let turned = |sign: f64| {
                let frame = site.frame * UnitQuaternion::from_scaled_axis(axis * (sign * TURN));
                sensed(&Site { frame, ..*site })
            };
            turn[i].set_column(c, &((turned(1.0) - turned(-1.0)) / (2.0 * TURN)));
        }
    });
    (strain, turn)
}

/// Returns an error unless the rates of all variables vanish in their steady state, up to a share of the terms
/// Σ |∂ẏ/∂y| |y| + Σ |∂ẏ/∂x| |x| that cancel in them.
pub(crate) fn check_steady(law: &impl TropismLaw, state: &SteadyState) -> Result<(), StabilityError> {
    let mut rates = DVector::zeros(state.variables.nrows());
    for (i, place) in state.places.iter().enumerate() {
        let (y, x) = (state.variables.column(i), state.stimuli.column(i));
        law.rates(y.as_slice(), x.as_slice(), rates.as_mut_slice());
        if rates.iter().all(|rate| *rate == 0.0) {
            continue;
        }
        if !rates.iter().all(|rate| rate.is_finite()) {
            return Err(StabilityError::NotFinite { what: "rate of the laws' variables" });
        }
        let [by_variables, by_stimuli, ..] = law_matrices(law, place, y.as_slice(), x.as_slice());
        let terms = by_variables.abs() * y.abs() + by_stimuli.abs() * x.abs();
        for (variable, (rate, terms)) in rates.iter().zip(&terms).enumerate() {
            if !(rate.abs() <= STEADY * terms) {
                let (law, share) = (law.name_of(variable), rate.abs() / terms);
                return Err(StabilityError::NotSteady { law, variable, rate: *rate, share });
            }
        }
    }
    Ok(())
}

/// Refuses what depends on time: laws, loads, growth, gravity, the base.
pub(crate) fn check_unforced(
    shoot: &Shoot<impl Model>,
    rod: &Rod,
    load: &impl Load,
    steady: &SteadyState,
) -> Result<(), StabilityError> {
    let scene = shoot.model.scene();
    // At a discontinuity all is as it is after it.
    let time = shoot.environment().time;
    let at_present = InternalForce::of(rod, load, &scene.environment(time));
    let (mut change, mut causes) = (0.0_f64, 0.0_f64);
    // Incommensurate times, from seconds to days: no period divides them all.
    for later in [1.0, 7.3, 101.1, 977.7, 6151.3, 40_009.9].map(|after| time + after) {
        // A base that has turned shows in nothing that is sensed on the rod as it is.
        change = change.max(scene.base(time).angle_to(&scene.base(later)) / rod.length());
        let force = InternalForce::of(rod, load, &scene.environment(later));
        let then = SteadyState::of(shoot, rod, &force);
        for (then, now) in then.gradients.iter().zip(&steady.gradients) {
            change = change.max((then - now).norm());
        }
        // A force shows in no stimulus of a shape that stays, and REGR in no gradient.
        causes = causes.max(change_of_causes(shoot, rod, &at_present, &force));
    }
    // Rounding of a gradient of the size of 1/radius. Causes that do not depend on time are the same to the last bit; some rounding is
    // allowed to what computes with it in vain.
    if change > 1e-12 / steady.radius() || causes > 1e-12 {
        return Err(StabilityError::Forced { change: change.max(causes / rod.length()) });
    }
    Ok(())
}

/// The largest change of force and REGR on a rod, relative, between the times of two forces in it.
pub(crate) fn change_of_causes(shoot: &Shoot<impl Model>, rod: &Rod, now: &InternalForce, then: &InternalForce) -> f64 {
    let pairs = now.at_points().iter().zip(then.at_points());
    let force =
        pairs.map(|(one, other)| relative((one - other).norm(), now.largest(), then.largest())).fold(0.0, f64::max);
    let regr = rod.points()[rod.zone()].iter().map(|point| {
        let [a, b] = [now, then].map(|force| shoot.model.growth().regr(point.apex_distance, force.environment().time));
        relative((a - b).abs(), a.abs(), b.abs())
    });
    regr.fold(force, f64::max)
}

/// A difference of two numbers of these sizes, relative to the larger.
pub(crate) fn relative(difference: f64, a: f64, b: f64) -> f64 {
    difference / a.max(b).max(f64::MIN_POSITIVE)
}
