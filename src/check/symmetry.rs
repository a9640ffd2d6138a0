//! Rotation of stimuli, rates and gradients of a tropism law with the directors d1 and d2 about d3.

use nalgebra::{UnitQuaternion, Vector3};

use super::error::{At, Checked, LawError, Quantity};
use super::sensed::{SAME, Sensed};
use crate::section::Section;
use crate::tropism::{Declaration, Rotation, Site, Source, TropismLaw};

/// Angle of the rotation, rad: a generic one.
const ANGLE: f64 = 1.0;
/// Angle by which vectors among stimuli and variables are rotated alone, rad.
const OTHER_ANGLE: f64 = 2.0;

/// Checks that declared rotations of stimuli are those of the law, and that its rates and its
/// gradient rotate if all rotations are declared.
pub(super) fn check_rotation<T: TropismLaw>(
    law: &T,
    declaration: &Declaration,
    at: At,
    site: &Site,
) -> Checked {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), ANGLE);
    let back = turn.inverse();
    // Only a circle is the same in all directions.
    let round = Site {
        section: Section::circle(site.section.radius()),
        ..*site
    };
    let rod = site.rod.with_turned_directors(&turn);
    let turned = Site {
        frame: site.frame * turn,
        strain: back * site.strain,
        couple: back * site.couple,
        rod: &rod,
        ..round
    };
    let incline = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, 0.8, 0.0) * ANGLE);
    let inclined = Site {
        frame: site.frame * incline,
        ..round
    };
    // The last site sets the size of the rounding of values.
    let sites = [&round, &turned, &inclined].into_iter();
    let sensed: Vec<_> = sites
        .map(|site| Sensed::new(law, declaration, at, site))
        .collect::<Result<_, _>>()?;
    let size = declaration.size();
    let [x, y] = [size.stimuli, size.variables];
    let stimuli: Vec<_> = (0..x)
        .map(|k| declaration.rotation(Source::Stimulus(k)))
        .collect();
    let variables: Vec<_> = (0..y)
        .map(|k| declaration.rotation(Source::Variable(k)))
        .collect();
    check_pairs(&stimuli, at, Quantity::StimulusRotation)?;
    check_pairs(&variables, at, Quantity::VariableRotation)?;
    let values: Vec<_> = sensed.iter().map(|sensed| sensed.stimuli.clone()).collect();
    let requirement = "that of the site with other d1 and d2, transformed as declared";
    compare(&values, &stimuli, at, Quantity::Stimulus, requirement)?;
    if stimuli
        .iter()
        .chain(&variables)
        .any(|rotation| *rotation == Rotation::Undeclared)
    {
        return Ok(());
    }
    for state in 0..sensed[0].states.len() {
        // The state of the rotated site is that of the site, rotated.
        let mut states: Vec<_> = sensed
            .iter()
            .map(|sensed| sensed.states[state].clone())
            .collect();
        states[1] = rotated(&states[0], &variables, -ANGLE);
        let each = || sensed.iter().zip(&states);
        let rates = each()
            .map(|(sensed, state)| sensed.rates(state))
            .collect::<Result<Vec<_>, _>>()?;
        let requirement = "that of the site with other d1 and d2, transformed as declared";
        compare(&rates, &variables, at, Quantity::Rate, requirement)?;
        let gradients = each().map(|(sensed, state)| {
            let other_state = rotated(state, &variables, OTHER_ANGLE);
            let other = sensed.gradient(
                &other_state,
                &rotated(&sensed.stimuli, &stimuli, OTHER_ANGLE),
            )?;
            // Terms without variables and stimuli cancel in the difference.
            Ok((sensed.gradient(state, &sensed.stimuli)? - other)
                .as_slice()
                .to_vec())
        });
        let gradients = gradients.collect::<Result<Vec<_>, LawError>>()?;
        let vector = [Rotation::First, Rotation::Second, Rotation::Invariant];
        let requirement = "rotated with d1 and d2, as its stimuli and variables are";
        compare(&gradients, &vector, at, Quantity::Gradient, requirement)?;
    }
    Ok(())
}

/// Returns an error for a component along d1 or d2 without the other one.
fn check_pairs(rotations: &[Rotation], at: At, quantity: impl Fn(usize) -> Quantity) -> Checked {
    let missing = (0..rotations.len())
        .find_map(|k| Rotation::missing_partner(rotations, k).map(|partner| (k, partner)));
    missing.map_or(Ok(()), |(k, partner)| {
        let requirement = "a component that is declared along the other director";
        Err(at.error(quantity(k), [partner as f64, f64::NAN], requirement))
    })
}

/// Numbers after a rotation of the frame in which pairs are vectors, by an angle (rad).
fn rotated(values: &[f64], rotations: &[Rotation], angle: f64) -> Vec<f64> {
    let (mut out, (sin, cos)) = (values.to_vec(), angle.sin_cos());
    for k in (0..values.len()).filter(|k| rotations[*k] == Rotation::First) {
        (out[k], out[k + 1]) = (
            cos * values[k] - sin * values[k + 1],
            sin * values[k] + cos * values[k + 1],
        );
    }
    out
}

/// Returns an error unless the numbers at the rotated site, which is the second one, are those that
/// are expected there, up to the rounding of their size. Numbers without a declared rotation are
/// not compared.
fn compare(
    values: &[Vec<f64>],
    rotations: &[Rotation],
    at: At,
    quantity: fn(usize) -> Quantity,
    requirement: &'static str,
) -> Checked {
    let (found, expected) = (&values[1], rotated(&values[0], rotations, -ANGLE));
    let largest = |k: usize| {
        values
            .iter()
            .map(|values| values[k].abs())
            .fold(0.0, f64::max)
    };
    for (k, rotation) in rotations.iter().enumerate() {
        let size = match rotation {
            Rotation::Undeclared => continue,
            Rotation::Invariant => largest(k),
            Rotation::First => largest(k) + largest(k + 1),
            Rotation::Second => largest(k - 1) + largest(k),
        };
        at.equal(
            quantity(k),
            [found[k], expected[k]],
            SAME * size,
            requirement,
        )?;
    }
    Ok(())
}
