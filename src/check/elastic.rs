//! Check of elastic laws.

use nalgebra::{Matrix3, SVector, Vector3};

use super::error::{At, LawError, Quantity, Where};
use super::{ROUNDING, STEP, WRONG, slope};
use crate::constitutive::{Constitutive, ElasticResponse, LineResponse, Tissue};
use crate::rod::centre_line_tangent;

/// Strain of the surface of a section that is large for tissue. It sets the least step of the differences.
const SURFACE_STRAIN: f64 = 1e-2;
/// Relative error of a second difference of the energy, which only decides which of two quantities is wrong.
const CURVATURE_ERROR: f64 = 1e-3;

const SLOPE_OF_ENERGY: &str = "the derivative of the energy";
const SLOPE_OF_COUPLE: &str = "the derivative of the couple";

/// Checks an elastic law at pairs of an elastic strain u − u* (1/m) and a force in the rod (N), both along the
/// directors, in a tissue.
///
/// Energy and couple must be zero at zero strain. The couple must be the derivative of the energy, and the tangent that
/// of the couple and symmetric. Under the force, n = ∂Φ/∂v must hold for the strain v and the energy Φ of the centre
/// line, v must be (0, 0, 1) without force, and the compliance must be ∂v/∂n, symmetric and not negative. The forces
/// have no effect on a law without shear and stretch.
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
    let rest = Bent::new(law, tissue, &zero)?;
    let size = rest.here.tangent.norm() * rest.step.powi(2);
    rest.at.equal(Quantity::Energy, [rest.here.energy, 0.0], WRONG * size, "zero without elastic strain")?;
    for i in 0..3 {
        let values = [rest.here.couple[i], 0.0];
        let requirement = "zero without elastic strain: describe a prestrain by the intrinsic strain";
        rest.at.equal(Quantity::Couple(i), values, WRONG * size / rest.step, requirement)?;
    }
    let bent = points.iter().map(|(strain, _)| Bent::new(law, tissue, strain)).collect::<Result<Vec<_>, _>>()?;
    // A couple that is zero by chance hides its own sign, and a wrong couple looks like a wrong tangent there.
    bent.iter().try_for_each(Bent::check_couple)?;
    bent.iter().try_for_each(Bent::check_tangent)?;
    let rest = Strained::new(law, tissue, &zero)?;
    let mut strained = Vec::new();
    for (_, force) in points {
        let line = Strained::new(law, tissue, force)?;
        if line.is_some() != rest.is_some() {
            let (at, requirement) = (
                At::of::<C>(Where::Force(*force)),
                "given under all forces or under none, where `line_response` returns `None`",
            );
            return Err(at.error(Quantity::LineStrain(0), [f64::NAN; 2], requirement));
        }
        strained.extend(line);
    }
    rest.map_or(Ok(()), |rest| rest.check_rest())?;
    strained.iter().try_for_each(Strained::check_energy)?;
    strained.iter().try_for_each(Strained::check_compliance)
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
) -> Result<(), LawError> {
    entries().filter(|(i, j)| i < j).try_for_each(|(i, j)| {
        at.equal(entry(i, j), [matrix[(i, j)], matrix[(j, i)]], ROUNDING * matrix.norm(), requirement)
    })
}

/// Derivatives by the components of a vector, of a scalar and of a vector, with their tolerances.
struct Slopes {
    scalar: [f64; 3],
    scalar_error: [f64; 3],
    vector: Matrix3<f64>,
    vector_error: Matrix3<f64>,
}

impl Slopes {
    /// Differences with the step `h` of a function that returns the scalar and the vector, which have the given sizes.
    fn of(f: impl Fn(&Vector3<f64>) -> SVector<f64, 4>, h: f64, sizes: [f64; 2]) -> Self {
        let zero = Matrix3::zeros();
        let mut out = Self { scalar: [0.0; 3], scalar_error: [0.0; 3], vector: zero, vector_error: zero };
        for j in 0..3 {
            let (value, error) = slope(|x| f(&Vector3::ith(j, x)), h);
            (out.scalar[j], out.scalar_error[j]) = (value[0], error[0] + ROUNDING * sizes[0] / h);
            out.vector.set_column(j, &value.fixed_rows::<3>(1));
            out.vector_error.set_column(j, &error.fixed_rows::<3>(1).add_scalar(ROUNDING * sizes[1] / h));
        }
        out
    }

    /// Whether an entry of a matrix is the derivative of the vector.
    fn agree(&self, matrix: &Matrix3<f64>, at: (usize, usize)) -> bool {
        (self.vector[at] - matrix[at]).abs() <= WRONG * matrix.norm() + self.vector_error[at]
    }
}

/// The response to an elastic strain, with its derivatives by differences.
struct Bent {
    at: At,
    step: f64,
    here: ElasticResponse,
    slopes: Slopes,
    /// Second differences of the energy along each component, N m².
    curvatures: Vector3<f64>,
}

impl Bent {
    fn new<C: Constitutive>(law: &C, tissue: &Tissue, strain: &Vector3<f64>) -> Result<Self, LawError> {
        let at = At::of::<C>(Where::Strain(*strain));
        let here = law.respond(tissue, strain);
        at.finite(Quantity::Energy, here.energy)?;
        (0..3).try_for_each(|i| at.finite(Quantity::Couple(i), here.couple[i]))?;
        entries().try_for_each(|(i, j)| at.finite(Quantity::Tangent(i, j), here.tangent[(i, j)]))?;
        let step = STEP * strain.norm().max(SURFACE_STRAIN / tissue.section.radius());
        let respond = |by: &Vector3<f64>| {
            let ElasticResponse { energy, couple, .. } = law.respond(tissue, &(strain + by));
            SVector::<f64, 4>::new(energy, couple.x, couple.y, couple.z)
        };
        let slopes = Slopes::of(respond, step, [here.energy.abs(), here.couple.norm()]);
        let curvatures = Vector3::from_fn(|i, _| {
            let [more, less] = [step, -step].map(|x| respond(&Vector3::ith(i, x))[0]);
            (more - 2.0 * here.energy + less) / step.powi(2)
        });
        Ok(Self { at, step, here, slopes, curvatures })
    }

    fn check_couple(&self) -> Result<(), LawError> {
        let Self { at, step, here, slopes, .. } = self;
        let size = here.couple.norm() + here.tangent.norm() * step;
        for i in 0..3 {
            let (found, couple) = (slopes.scalar[i], here.couple[i]);
            if (found - couple).abs() <= WRONG * size + slopes.scalar_error[i] {
                continue;
            }
            let energy = (0..3).all(|j| slopes.agree(&here.tangent, (i, j)));
            return Err(if energy {
                at.error(Quantity::EnergySlope(i), [found, couple], "the couple")
            } else {
                at.error(Quantity::Couple(i), [couple, found], SLOPE_OF_ENERGY)
            });
        }
        Ok(())
    }

    fn check_tangent(&self) -> Result<(), LawError> {
        let Self { at, here, slopes, curvatures, .. } = self;
        if let Some((i, j)) = entries().find(|entry| !slopes.agree(&here.tangent, *entry)) {
            let (found, tangent) = (slopes.vector[(i, j)], here.tangent[(i, j)]);
            // The second difference of the energy tells whether the couple or the tangent is wrong.
            let tolerance = CURVATURE_ERROR * here.tangent.norm();
            let couple = i == j && (curvatures[i] - tangent).abs() < tolerance;
            return Err(if couple {
                at.error(Quantity::CoupleSlope(i), [found, tangent], "the tangent")
            } else {
                at.error(Quantity::Tangent(i, j), [tangent, found], SLOPE_OF_COUPLE)
            });
        }
        check_symmetry(*at, Quantity::Tangent, &here.tangent, "since the tangent is symmetric")
    }
}

/// The response of the centre line to a force, with its derivatives by differences.
struct Strained {
    at: At,
    force: Vector3<f64>,
    step: f64,
    here: LineResponse,
    slopes: Slopes,
}

impl Strained {
    fn new<C: Constitutive>(law: &C, tissue: &Tissue, force: &Vector3<f64>) -> Result<Option<Self>, LawError> {
        let at = At::of::<C>(Where::Force(*force));
        let Some(here) = law.line_response(tissue, force) else { return Ok(None) };
        at.finite(Quantity::LineEnergy, here.energy)?;
        (0..3).try_for_each(|i| at.finite(Quantity::LineStrain(i), here.strain[i]))?;
        entries().try_for_each(|(i, j)| at.finite(Quantity::Compliance(i, j), here.compliance[(i, j)]))?;
        let compliance = here.compliance.norm();
        // A rod without compliance has the same strain under all forces.
        let large = if compliance > 0.0 { SURFACE_STRAIN / compliance } else { 1.0 };
        let step = STEP * force.norm().max(large);
        let respond = |by: &Vector3<f64>| {
            let moved = law.line_response(tissue, &(force + by));
            moved.map_or(SVector::repeat(f64::NAN), |LineResponse { strain, energy, .. }| {
                SVector::<f64, 4>::new(energy, strain.x, strain.y, strain.z)
            })
        };
        let slopes = Slopes::of(respond, step, [here.energy.abs(), here.strain.norm()]);
        Ok(Some(Self { at, force: *force, step, here, slopes }))
    }

    fn check_rest(&self) -> Result<(), LawError> {
        let (rest, size) = (centre_line_tangent(), self.here.compliance.norm() * self.step);
        let tolerance = ROUNDING + WRONG * size;
        let strain = |i: usize| {
            let values = [self.here.strain[i], rest[i]];
            self.at.equal(Quantity::LineStrain(i), values, tolerance, "that of a centre line without shear and stretch")
        };
        (0..3).try_for_each(strain)?;
        let values = [self.here.energy, 0.0];
        self.at.equal(Quantity::LineEnergy, values, WRONG * size * self.step, "zero without force")
    }

    fn check_energy(&self) -> Result<(), LawError> {
        let Self { at, force, step, here, slopes } = self;
        let size = (force.norm() + step) * here.compliance.norm();
        let agrees = |j: usize, expected: f64| {
            let error = slopes.scalar_error[j] + force.abs().dot(&slopes.vector_error.column(j));
            (slopes.scalar[j] - expected).abs() <= WRONG * size + error
        };
        // ∂Φ/∂n = n · ∂v/∂n.
        let [by_strain, by_compliance] = [&slopes.vector, &here.compliance].map(|matrix| matrix.tr_mul(force));
        let Some(j) = (0..3).find(|j| !agrees(*j, by_strain[*j])) else { return Ok(()) };
        let wrong = entries().find(|entry| !slopes.agree(&here.compliance, *entry));
        Err(match wrong {
            Some((i, k)) if (0..3).all(|j| agrees(j, by_compliance[j])) => {
                let values = [slopes.vector[(i, k)], here.compliance[(i, k)]];
                at.error(Quantity::LineStrainSlope(i, k), values, "the compliance")
            }
            _ => at.error(Quantity::LineEnergySlope(j), [slopes.scalar[j], by_strain[j]], "n · ∂v/∂n"),
        })
    }

    fn check_compliance(&self) -> Result<(), LawError> {
        let Self { at, here, slopes, .. } = self;
        let compliance = &here.compliance;
        if let Some((i, j)) = entries().find(|entry| !slopes.agree(compliance, *entry)) {
            let values = [compliance[(i, j)], slopes.vector[(i, j)]];
            return Err(at.error(Quantity::Compliance(i, j), values, "the derivative of the strain"));
        }
        check_symmetry(*at, Quantity::Compliance, compliance, "since the compliance is symmetric")?;
        let negative = (0..3).find(|i| compliance[(*i, *i)] < 0.0);
        negative.map_or(Ok(()), |i| {
            Err(at.error(Quantity::Compliance(i, i), [compliance[(i, i)], f64::NAN], "zero or positive"))
        })
    }
}
