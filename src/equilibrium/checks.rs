//! Checks of elastic laws and of other input, and the reasons of a search that does not converge.

use nalgebra::Vector3;

use super::error::Outcome;
use super::unloaded::check_turns;
use super::{EquilibriumError, RodEnergy};
use crate::check::{self, LawError};
use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::load::InternalForce;
use crate::rod::{Rod, Tissue, centre_line_tangent};

/// Largest angle (rad) or strain that an elastic law may request without load, due to rounding.
const UNSTRAINED: f64 = 1e-9;

/// Returns an error for an elastic law without positive stiffness, or without a finite response to
/// a force, at some place of a rod at a time (s).
pub(crate) fn check_stiffness(
    rod: &Rod,
    material: &impl Constitutive,
    time: f64,
) -> Result<(), ParameterError> {
    let (length, zero) = (rod.length(), Vector3::zeros());
    let responds = |tissue: &Tissue| usize::from(material.line_response(tissue, &zero).is_some());
    let at_base = rod
        .points()
        .first()
        .map_or(0, |point| responds(&Tissue::of(point, time)));
    for point in rod.points() {
        let tissue = Tissue::of(point, time);
        let at = |error: ParameterError| error.at(rod.initial_length - point.initial_apex_distance);
        let response = material.respond(&tissue, &zero);
        let stiffness = response.tangent.diagonal();
        for (i, name) in ["stiffness K1", "stiffness K2", "stiffness K3"]
            .into_iter()
            .enumerate()
        {
            // A subnormal number has lost digits.
            let sound = stiffness[i] > 0.0 && stiffness[i].is_normal();
            let requirement =
                "positive and finite: check the elastic law, its modulus and the radius (N m²)";
            ParameterError::unless(sound, name, stiffness[i], requirement).map_err(at)?;
        }
        let (couple, requirement) = (
            response.couple.norm(),
            "zero: describe a prestrain by the intrinsic strain (N m)",
        );
        // The couple times the length over the stiffness is the angle by which the rod bends.
        let vanishes = couple * length < UNSTRAINED * stiffness.min();
        ParameterError::unless(
            vanishes,
            "couple without elastic strain",
            couple,
            requirement,
        )
        .map_err(at)?;
        ParameterError::finite(
            "elastic energy without elastic strain",
            response.energy,
            "J/m",
        )
        .map_err(at)?;
        let (name, counts) = (
            "number of responses of the centre line to a force",
            [responds(&tissue), at_base],
        );
        let requirement = "as at the base: `line_response` returns `None` at all places or at none";
        ParameterError::count(name, counts, requirement).map_err(at)?;
        let Some(line) = material.line_response(&tissue, &zero) else {
            continue;
        };
        let compliance = line.compliance.diagonal();
        let names = [
            "compliance to shear along d1",
            "compliance to shear along d2",
            "compliance to stretch",
        ];
        for (name, value) in names.into_iter().zip(&compliance) {
            let sound = *value >= 0.0 && value.is_finite();
            ParameterError::unless(sound, name, *value, "zero or positive, and finite (1/N)")
                .map_err(at)?;
        }
        let strained = (line.strain - centre_line_tangent()).norm();
        let name = "shear or stretch without force";
        ParameterError::unless(strained < UNSTRAINED, name, strained, "zero").map_err(at)?;
    }
    Ok(())
}

/// Returns an error for an elastic law whose methods contradict each other at the base or at the
/// apex of a rod.
pub(crate) fn check_law(
    rod: &Rod,
    material: &impl Constitutive,
    force: &InternalForce,
) -> Result<(), Box<LawError>> {
    let (length, p, last) = (rod.length(), rod.order().points(), rod.points().len() - 1);
    [0, last].into_iter().try_for_each(|i| {
        let tissue = Tissue::of(&rod.points()[i], force.environment().time);
        let along = rod
            .frame_at_point(i / p, i % p)
            .inverse_transform_vector(&force.at_points()[i]);
        let points = check::STRAINS.map(|strain| (Vector3::from(strain) / length, along));
        check::elastic_law(material, &tissue, &points).map_err(Box::new)
    })
}

/// Returns an error for an intrinsic strain, a gravity or a force of the load that is not finite.
pub(super) fn check_finite(rod: &Rod, force: &InternalForce) -> Outcome {
    let strained = rod
        .points()
        .iter()
        .all(|point| point.intrinsic.sum().is_finite());
    EquilibriumError::finite(strained, "intrinsic strain")?;
    EquilibriumError::finite(force.environment().gravity.sum().is_finite(), "gravity")?;
    EquilibriumError::finite(force.largest().is_finite(), "force of the load on the rod")
}

/// Returns the most likely reason of a search without convergence: a law without stiffness or with
/// a wrong tangent, or long elements. Other errors are returned as they are.
pub(super) fn explained(
    error: EquilibriumError,
    rod: &Rod,
    body: &RodEnergy<impl Constitutive>,
) -> EquilibriumError {
    if !matches!(
        error,
        EquilibriumError::NoConvergence { .. } | EquilibriumError::Folded { .. }
    ) {
        return error;
    }
    let reason = || {
        check_stiffness(rod, body.material, body.force.environment().time)?;
        check_law(rod, body.material, body.force)?;
        check_turns(rod)
    };
    reason().err().unwrap_or(error)
}
