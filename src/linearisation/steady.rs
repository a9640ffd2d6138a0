//! Laws in their steady state under constant stimuli.

use nalgebra::{DMatrix, Vector3};

use super::error::StabilityError;
use super::stimuli::visit_stimuli;
use crate::load::InternalForce;
use crate::model::Model;
use crate::numerics::scalar::largest;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::tropism::{Declaration, Growing, TropismLaw, rates_in_steady_state};

/// Largest rate of a variable in the steady state of a law, relative to the terms that cancel in
/// it. The value allows for laws that compute their steady state by iteration, and is the accuracy
/// required of a steady state of the shoot.
const STEADY: f64 = 1e-8;

/// Stimuli, steady variables and growth gradients at every material point of the growth zone, for a
/// shape that has been constant for all time.
pub(crate) struct SteadyLaws {
    pub gradients: Vec<Vector3<f64>>,
    /// Stimuli, one column for every point.
    pub stimuli: DMatrix<f64>,
    pub variables: DMatrix<f64>,
    pub places: Vec<Growing>,
}

impl SteadyLaws {
    /// Evaluates the laws of `shoot` on a rod in equilibrium under a force.
    pub fn of(shoot: &Shoot<impl Model>, rod: &Rod, force: &InternalForce) -> Self {
        let law = shoot.model.tropism();
        let size = Declaration::of(law).size();
        let time = force.environment().time;
        let points = rod.zone().len();
        let mut out = Self {
            gradients: vec![Vector3::zeros(); points],
            stimuli: DMatrix::zeros(size.stimuli, points),
            variables: DMatrix::zeros(size.variables, points),
            places: vec![Growing::new(time, 0.0, 0.0); points],
        };
        visit_stimuli(shoot, rod, force, |i, site, stimuli| {
            out.stimuli.column_mut(i).copy_from_slice(stimuli);
            let mut variables = out.variables.column_mut(i);
            law.steady(stimuli, variables.as_mut_slice());
            out.places[i] = Growing::at(site);
            out.gradients[i] =
                law.gradient(&out.places[i], variables.as_slice(), size.present(stimuli));
        });
        out
    }

    /// The largest gradient, 1/m.
    ///
    /// # Errors
    /// A gradient that is not finite.
    pub fn largest_gradient(&self) -> Result<f64, StabilityError> {
        let largest = largest(self.gradients.iter().map(Vector3::norm));
        if largest.is_finite() {
            Ok(largest)
        } else {
            Err(StabilityError::NotFinite {
                what: "growth gradient",
            })
        }
    }

    /// The radius of the shoot at the base of the growth zone, m; one if nothing grows.
    pub fn radius(&self) -> f64 {
        self.places
            .first()
            .map_or(1.0, |place| place.section.radius())
    }
}

/// Returns an error unless the rates of all variables vanish in their steady state, up to a share
/// of the terms Σ |∂ẏ/∂y| |y| + Σ |∂ẏ/∂x| |x| that cancel in them.
pub(crate) fn check_steady(
    law: &impl TropismLaw,
    state: &SteadyLaws,
) -> Result<(), StabilityError> {
    for (i, place) in state.places.iter().enumerate() {
        let (y, x) = (state.variables.column(i), state.stimuli.column(i));
        let rates = rates_in_steady_state(law, place, y.as_slice(), x.as_slice());
        if !rates.iter().all(|(rate, _)| rate.is_finite()) {
            return Err(StabilityError::NotFinite {
                what: "rate of the laws' variables",
            });
        }
        for (variable, (rate, terms)) in rates.into_iter().enumerate() {
            if !(rate.abs() <= STEADY * terms) {
                let (law, share) = (law.name_of(variable), rate.abs() / terms);
                return Err(StabilityError::NotSteady {
                    law,
                    variable,
                    rate,
                    share,
                });
            }
        }
    }
    Ok(())
}
