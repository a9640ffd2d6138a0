//! Check of elastic laws.

use nalgebra::{Matrix3, Vector3};

use super::error::{At, Checked, LawError, Quantity, Where};
use super::{ROUNDING, STEP, WRONG, slope};
use crate::constitutive::{Constitutive, ElasticResponse, Tissue};
use crate::rod::centre_line_tangent;

/// Strain of the surface of a section that is large for tissue. It sets the least step of the
/// differences.
const SURFACE_STRAIN: f64 = 1e-2;
/// Relative error of a second difference of the energy, which only decides which of two quantities
/// is wrong.
const CURVATURE_ERROR: f64 = 1e-3;

/// Checks an elastic law at pairs of an elastic strain u − u* (1/m) and a force in the rod (N),
/// both along the directors, in a tissue.
///
/// Energy and couple must be zero at zero strain. The couple must be the derivative of the energy,
/// and the tangent that of the couple and symmetric. Under the force, n = ∂Φ/∂v must hold for the
/// strain v and the energy Φ of the centre line, v must be (0, 0, 1) without force, and the
/// compliance must be ∂v/∂n, symmetric and not negative. The forces have no effect on a law without
/// shear and stretch.
///
/// If the couple disagrees with the energy but agrees with the tangent, the [derivative of the
/// energy](Quantity::EnergySlope) is reported.
///
/// # Errors
/// The first quantity that is not finite or contradicts the others, and a check without points.
pub fn elastic_law<C: Constitutive>(
    law: &C,
    tissue: &Tissue,
    points: &[(Vector3<f64>, Vector3<f64>)],
) -> Result<(), LawError> {
    At::of_points::<C>(points.len())?;
    let zero = Vector3::zeros();
    let rest = Answered::bent(law, tissue, &zero)?;
    let size = rest.matrix.norm() * rest.step.powi(2);
    rest.at.equal(
        Quantity::Energy,
        [rest.energy, 0.0],
        WRONG * size,
        "zero without elastic strain",
    )?;
    for i in 0..3 {
        let values = [rest.vector[i], 0.0];
        let requirement =
            "zero without elastic strain: describe a prestrain by the intrinsic strain";
        rest.at.equal(
            Quantity::Couple(i),
            values,
            WRONG * size / rest.step,
            requirement,
        )?;
    }
    let bent = points
        .iter()
        .map(|(strain, _)| Answered::bent(law, tissue, strain))
        .collect::<Result<Vec<_>, _>>()?;
    // A couple that is zero by chance hides its own sign, and a wrong couple looks like a wrong
    // tangent there.
    bent.iter().try_for_each(Answered::check_couple)?;
    bent.iter().try_for_each(Answered::check_tangent)?;
    let rest = Answered::strained(law, tissue, &zero)?;
    let mut strained = Vec::new();
    for (_, force) in points {
        let line = Answered::strained(law, tissue, force)?;
        if line.is_some() != rest.is_some() {
            let requirement =
                "given under all forces or under none, where `line_response` returns `None`";
            return Err(At::of::<C>(Where::Force(*force)).error(
                Quantity::LineStrain(0),
                [f64::NAN; 2],
                requirement,
            ));
        }
        strained.extend(line);
    }
    rest.map_or(Ok(()), |rest| rest.check_rest())?;
    strained.iter().try_for_each(Answered::check_energy)?;
    strained.iter().try_for_each(Answered::check_compliance)
}

/// Indices of rows and columns.
fn entries() -> impl Iterator<Item = (usize, usize)> {
    (0..3).flat_map(|i| (0..3).map(move |j| (i, j)))
}

/// Returns an error unless a matrix of a law is symmetric.
fn check_symmetry(
    at: At,
    entry: fn(usize, usize) -> Quantity,
    matrix: &Matrix3<f64>,
    requirement: &'static str,
) -> Checked {
    entries().filter(|(i, j)| i < j).try_for_each(|(i, j)| {
        at.equal(
            entry(i, j),
            [matrix[(i, j)], matrix[(j, i)]],
            ROUNDING * matrix.norm(),
            requirement,
        )
    })
}

/// What a law returns for a vector: an energy, a vector, and the derivative of this vector.
type Answer = (f64, Vector3<f64>, Matrix3<f64>);

/// Names of the energy, of the components of the vector, and of the entries of its derivative.
type Names = (
    Quantity,
    fn(usize) -> Quantity,
    fn(usize, usize) -> Quantity,
);

/// The answer of a law to a vector, with derivatives by differences.
struct Answered {
    at: At,
    /// The vector to which the law answers.
    x: Vector3<f64>,
    /// Step of the differences.
    step: f64,
    /// Energy that the law returns.
    energy: f64,
    /// Vector that the law returns: the couple, or the strain of the centre line.
    vector: Vector3<f64>,
    /// Derivative of this vector that the law returns: the tangent, or the compliance.
    matrix: Matrix3<f64>,
    /// Derivative of the energy by differences, and its tolerance.
    energy_slope: [Vector3<f64>; 2],
    /// Derivative of the vector by differences, and its tolerance.
    vector_slope: [Matrix3<f64>; 2],
    /// Second differences of the energy along each component.
    curvature: Vector3<f64>,
}

impl Answered {
    /// Evaluates a law at a vector, and its derivatives there by differences. Their step is
    /// relative to the norm of the vector, or to `large` if that is larger.
    fn new(
        at: At,
        x: &Vector3<f64>,
        large: f64,
        names: Names,
        law: impl Fn(&Vector3<f64>) -> Answer,
    ) -> Result<Self, LawError> {
        let (energy, vector, matrix) = law(x);
        at.finite(names.0, energy)?;
        (0..3).try_for_each(|i| at.finite(names.1(i), vector[i]))?;
        entries().try_for_each(|(i, j)| at.finite(names.2(i, j), matrix[(i, j)]))?;
        let step = STEP * x.norm().max(large);
        let moved = |j: usize, by: f64| {
            let (energy, vector, _) = law(&(x + Vector3::ith(j, by)));
            vector.push(energy)
        };
        let (mut energy_slope, mut vector_slope) = ([Vector3::zeros(); 2], [Matrix3::zeros(); 2]);
        for j in 0..3 {
            let (value, error) = slope(|by| moved(j, by), step);
            (energy_slope[0][j], energy_slope[1][j]) =
                (value[3], error[3] + ROUNDING * energy.abs() / step);
            vector_slope[0].set_column(j, &value.xyz());
            vector_slope[1].set_column(j, &error.xyz().add_scalar(ROUNDING * vector.norm() / step));
        }
        let second =
            |j: usize| (moved(j, step)[3] - 2.0 * energy + moved(j, -step)[3]) / step.powi(2);
        let curvature = Vector3::from_fn(|j, _| second(j));
        Ok(Self {
            at,
            x: *x,
            step,
            energy,
            vector,
            matrix,
            energy_slope,
            vector_slope,
            curvature,
        })
    }

    /// The response to an elastic strain.
    fn bent<C: Constitutive>(
        law: &C,
        tissue: &Tissue,
        strain: &Vector3<f64>,
    ) -> Result<Self, LawError> {
        let names: Names = (Quantity::Energy, Quantity::Couple, Quantity::Tangent);
        let large = SURFACE_STRAIN / tissue.section.radius();
        Self::new(
            At::of::<C>(Where::Strain(*strain)),
            strain,
            large,
            names,
            |strain| {
                let ElasticResponse {
                    energy,
                    couple,
                    tangent,
                } = law.respond(tissue, strain);
                (energy, couple, tangent)
            },
        )
    }

    /// The response of the centre line to a force.
    fn strained<C: Constitutive>(
        law: &C,
        tissue: &Tissue,
        force: &Vector3<f64>,
    ) -> Result<Option<Self>, LawError> {
        let Some(here) = law.line_response(tissue, force) else {
            return Ok(None);
        };
        let names: Names = (
            Quantity::LineEnergy,
            Quantity::LineStrain,
            Quantity::Compliance,
        );
        let size = here.compliance.norm();
        // A rod without compliance has the same strain under all forces.
        let large = if size > 0.0 {
            SURFACE_STRAIN / size
        } else {
            1.0
        };
        let answered = Self::new(
            At::of::<C>(Where::Force(*force)),
            force,
            large,
            names,
            |force| {
                let response = law.line_response(tissue, force);
                let nothing = (f64::NAN, Vector3::repeat(f64::NAN), Matrix3::zeros());
                response.map_or(nothing, |line| (line.energy, line.strain, line.compliance))
            },
        );
        answered.map(Some)
    }

    /// Whether an entry of the matrix is the derivative of the vector.
    fn agrees(&self, at: (usize, usize)) -> bool {
        let [slope, error] = self.vector_slope.map(|matrix| matrix[at]);
        (slope - self.matrix[at]).abs() <= WRONG * self.matrix.norm() + error
    }

    fn check_couple(&self) -> Checked {
        let Self {
            at,
            step,
            vector: couple,
            matrix: tangent,
            energy_slope: [slope, error],
            ..
        } = self;
        let size = couple.norm() + tangent.norm() * step;
        let agrees = |i: usize| (slope[i] - couple[i]).abs() <= WRONG * size + error[i];
        let Some(i) = (0..3).find(|i| !agrees(*i)) else {
            return Ok(());
        };
        Err(if (0..3).all(|j| self.agrees((i, j))) {
            at.error(
                Quantity::EnergySlope(i),
                [slope[i], couple[i]],
                "the couple",
            )
        } else {
            at.error(
                Quantity::Couple(i),
                [couple[i], slope[i]],
                "the derivative of the energy",
            )
        })
    }

    fn check_tangent(&self) -> Checked {
        let Self {
            at,
            matrix: tangent,
            vector_slope: [found, _],
            curvature,
            ..
        } = self;
        if let Some((i, j)) = entries().find(|entry| !self.agrees(*entry)) {
            let (found, tangent, size) = (found[(i, j)], tangent[(i, j)], tangent.norm());
            // The second difference of the energy tells whether the couple or the tangent is wrong.
            let couple = i == j && (curvature[i] - tangent).abs() < CURVATURE_ERROR * size;
            return Err(if couple {
                at.error(Quantity::CoupleSlope(i), [found, tangent], "the tangent")
            } else {
                at.error(
                    Quantity::Tangent(i, j),
                    [tangent, found],
                    "the derivative of the couple",
                )
            });
        }
        check_symmetry(
            *at,
            Quantity::Tangent,
            tangent,
            "since the tangent is symmetric",
        )
    }

    fn check_rest(&self) -> Checked {
        let (rest, size) = (centre_line_tangent(), self.matrix.norm() * self.step);
        let tolerance = ROUNDING + WRONG * size;
        (0..3).try_for_each(|i| {
            let values = [self.vector[i], rest[i]];
            self.at.equal(
                Quantity::LineStrain(i),
                values,
                tolerance,
                "that of a centre line without shear and stretch",
            )
        })?;
        self.at.equal(
            Quantity::LineEnergy,
            [self.energy, 0.0],
            WRONG * size * self.step,
            "zero without force",
        )
    }

    fn check_energy(&self) -> Checked {
        let Self {
            at,
            x: force,
            energy_slope: [slope, error],
            vector_slope: [strain_slope, strain_error],
            ..
        } = self;
        let size = (force.norm() + self.step) * self.matrix.norm();
        let agrees = |j: usize, expected: f64| {
            let error = error[j] + force.abs().dot(&strain_error.column(j));
            (slope[j] - expected).abs() <= WRONG * size + error
        };
        // ∂Φ/∂n = n · ∂v/∂n.
        let [by_strain, by_compliance] =
            [strain_slope, &self.matrix].map(|matrix| matrix.tr_mul(force));
        let Some(j) = (0..3).find(|j| !agrees(*j, by_strain[*j])) else {
            return Ok(());
        };
        Err(match entries().find(|entry| !self.agrees(*entry)) {
            Some((i, k)) if (0..3).all(|j| agrees(j, by_compliance[j])) => {
                let values = [strain_slope[(i, k)], self.matrix[(i, k)]];
                at.error(Quantity::LineStrainSlope(i, k), values, "the compliance")
            }
            _ => at.error(
                Quantity::LineEnergySlope(j),
                [slope[j], by_strain[j]],
                "n · ∂v/∂n",
            ),
        })
    }

    fn check_compliance(&self) -> Checked {
        let Self {
            at,
            matrix: compliance,
            vector_slope: [slope, _],
            ..
        } = self;
        if let Some((i, j)) = entries().find(|entry| !self.agrees(*entry)) {
            let values = [compliance[(i, j)], slope[(i, j)]];
            return Err(at.error(
                Quantity::Compliance(i, j),
                values,
                "the derivative of the strain",
            ));
        }
        check_symmetry(
            *at,
            Quantity::Compliance,
            compliance,
            "since the compliance is symmetric",
        )?;
        let negative = (0..3).find(|i| compliance[(*i, *i)] < 0.0);
        negative.map_or(Ok(()), |i| {
            Err(at.error(
                Quantity::Compliance(i, i),
                [compliance[(i, i)], f64::NAN],
                "zero or positive",
            ))
        })
    }
}
