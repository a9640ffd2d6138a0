//! What a small steady forcing makes of a stationary shoot.

use nalgebra::{Complex, DVector, Vector3};

use super::error::StabilityError;
use super::linearisation::Linearisation;
use crate::error::ParameterError;

/// The motion Re[(…) exp(iωt)] of a shoot that is forced at one frequency, once all else has decayed.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Response {
    /// The change of the intrinsic strain at the points of the growth zone, components along the directors, 1/m.
    pub strain: Vec<Vector3<Complex<f64>>>,
    /// The displacement of the ends of the elements, base first, in the fixed frame, m: at the places of
    /// [`Rod::centre_line`](crate::rod::Rod::centre_line).
    pub displacement: Vec<Vector3<Complex<f64>>>,
}

impl Linearisation {
    /// How the shoot moves when a growth gradient Re[`gradient` exp(iωt)] is added at every point of its zone: M(iω) δu* = REGR
    /// gradient. An [`Oscillator`](crate::tropism::Oscillator) that turns counterclockwise at phase zero is (α/r, −iα/r, 0), in 1/m;
    /// linearise the shoot without it.
    ///
    /// It is to first order in the gradient, and what a shoot settles to if no root is unstable.
    ///
    /// # Errors
    /// A frequency (1/s) that is not positive, a gradient along a director about which no law steers, or a frequency at which the shoot has
    /// a root.
    pub fn response(&self, omega: f64, gradient: &Vector3<Complex<f64>>) -> Result<Response, StabilityError> {
        ParameterError::positive("frequency of the forcing", omega)?;
        let (problem, z) = (&self.problem, Complex::new(0.0, omega));
        let mut strain = vec![Vector3::zeros(); problem.kind.len()];
        let steered = |c: usize| problem.unknowns.iter().filter(|unknown| unknown.1 == c).count() == strain.len();
        for (c, part) in gradient.iter().enumerate() {
            let (name, requirement) =
                ("growth gradient of the forcing", "along directors about which the laws steer everywhere");
            ParameterError::unless(
                part.norm().is_finite() && (part.norm() == 0.0 || steered(c)),
                name,
                part.norm(),
                requirement,
            )?;
        }
        let all: Vec<usize> = (0..problem.unknowns.len()).collect();
        let matrix = problem.matrix(z, &problem.transfers_at(z), &problem.response, &all).value;
        let forcing = problem.unknowns.iter().map(|&(i, c)| gradient[c] * problem.transfers[problem.kind[i]].rate);
        let forcing = DVector::from_iterator(all.len(), forcing);
        let found = matrix.lu().solve(&forcing).filter(|found| found.norm().is_finite());
        let found = found.ok_or(StabilityError::NotFinite { what: "response to the forcing" })?;
        for (&(i, c), value) in problem.unknowns.iter().zip(found.iter()) {
            strain[i][c] = *value;
        }
        let moved = problem.displacement.map(Complex::from) * found;
        let displacement = (0..moved.nrows() / 3).map(|k| Vector3::from_fn(|i, _| moved[3 * k + i])).collect();
        Ok(Response { strain, displacement })
    }
}
