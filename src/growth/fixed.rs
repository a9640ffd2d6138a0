//! Shoots of constant length.

use super::GrowthLaw;
use crate::error::ParameterError;
use crate::pointers::forward_methods;

/// Rounding of the length of a rod, which is the sum of thousands of elements, relative to the
/// length.
const ROUNDING: f64 = 1e-12;

/// No growth: the shoot keeps its length and its intrinsic strain.
impl GrowthLaw for () {
    fn regr(&self, _sigma: f64, _t: f64) -> f64 {
        0.0
    }

    fn zone_length(&self) -> f64 {
        f64::INFINITY
    }

    fn elongates(&self) -> bool {
        false
    }
}

/// Growth of the reduced model: constant length with ongoing differential growth.
///
/// Differential growth has the REGR of the inner law. Points keep their places and never leave the
/// growth zone, and the shoot must not be longer than the zone.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ongoing<G>(
    /// Growth law with the rate of the differential growth.
    pub G,
);

impl<G: GrowthLaw> GrowthLaw for Ongoing<G> {
    forward_methods!(self, GrowthLaw of self.0 =>
        fn regr(sigma: f64, t: f64) -> f64;
        fn zone_length() -> f64;
        fn next_discontinuity(t: f64) -> f64;
    );

    fn elongates(&self) -> bool {
        false
    }

    fn check(&self, length: f64) -> Result<(), ParameterError> {
        self.0.check(length)?;
        let (name, requirement) = (
            "length of a shoot of constant length",
            "at most the length of its growth zone (m)",
        );
        ParameterError::unless(
            length <= self.0.zone_length() * (1.0 + ROUNDING),
            name,
            length,
            requirement,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Shoot;
    use crate::constitutive::LinearElastic;
    use crate::growth::UniformGrowth;

    #[test]
    fn shoot_as_long_as_its_zone_keeps_its_laws() {
        let young = LinearElastic {
            youngs_modulus: 1e7,
            poissons_ratio: 0.5,
        };
        // For some numbers of elements the sum of their lengths exceeds 0.05 by rounding.
        for elements in 1..40 {
            let growth = Ongoing(UniformGrowth {
                zone_length: 0.05,
                time: 72e3,
            });
            let builder = Shoot::builder(young)
                .length(0.05)
                .radius(5e-4)
                .elements(elements)
                .growth(growth);
            let shoot = builder.build().unwrap();
            assert!(shoot.with_model(*shoot.model()).is_ok(), "{elements}");
        }
    }
}
