//! The response of a shoot in a steady state to a small periodic forcing.

use nalgebra::{Complex, DVector, Vector3};

use super::linearisation::Linearisation;
use crate::error::ParameterError;
use crate::stability::error::StabilityError;

/// The motion Re[(…) exp(iωt)] of a shoot under periodic forcing, after transients have decayed.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ForcedResponse {
    /// The change of the intrinsic strain at the points of the growth zone, components along the directors, 1/m.
    pub strain: Vec<Vector3<Complex<f64>>>,
    /// The displacement of the ends of the elements, base first, in the fixed frame, m: at the places of
    /// [`Rod::centre_line`](crate::rod::Rod::centre_line).
    pub displacement: Vec<Vector3<Complex<f64>>>,
}

impl Linearisation {
    /// The response to a growth gradient Re[`gradient` exp(iωt)] that is added at every point of the growth zone: the solution of
    /// M(iω) δu* = REGR gradient. An [`Oscillator`](crate::tropism::Oscillator) that turns counterclockwise at phase zero is
    /// (α/r, −iα/r, 0), in 1/m; linearise the shoot without it.
    ///
    /// The response is of first order in the gradient. The shoot approaches it if no root is unstable.
    ///
    /// # Errors
    /// A frequency (1/s) that is not positive, a gradient along a director about which no law steers, or a frequency at which
    /// the shoot has a root.
    pub fn response(&self, omega: f64, gradient: &Vector3<Complex<f64>>) -> Result<ForcedResponse, StabilityError> {
        ParameterError::positive("frequency of the forcing", omega)?;
        let (characteristic, z) = (&self.characteristic, Complex::new(0.0, omega));
        let unknowns = &characteristic.unknowns;
        let mut strain = vec![Vector3::zeros(); characteristic.kind.len()];
        let steered = |c: usize| unknowns.iter().filter(|unknown| unknown.1 == c).count() == strain.len();
        for (c, part) in gradient.iter().map(|part| part.norm()).enumerate() {
            let requirement = "along directors about which the laws steer everywhere";
            let possible = part.is_finite() && (part == 0.0 || steered(c));
            ParameterError::unless(possible, "growth gradient of the forcing", part, requirement)?;
        }
        let all: Vec<usize> = (0..unknowns.len()).collect();
        let matrix = characteristic.matrix(z, &characteristic.transfers_at(z), &characteristic.response, &all).value;
        let regr = |i: usize| characteristic.transfers[characteristic.kind[i]].rate;
        let forcing = DVector::from_iterator(all.len(), unknowns.iter().map(|&(i, c)| gradient[c] * regr(i)));
        let found = matrix.lu().solve(&forcing).filter(|found| found.norm().is_finite());
        let found = found.ok_or(StabilityError::NotFinite { what: "response to the forcing" })?;
        for (&(i, c), value) in unknowns.iter().zip(found.iter()) {
            strain[i][c] = *value;
        }
        let moved = characteristic.displacement.map(Complex::from) * found;
        let displacement = (0..moved.nrows() / 3).map(|k| Vector3::from_fn(|i, _| moved[3 * k + i])).collect();
        Ok(ForcedResponse { strain, displacement })
    }
}
