//! Parameters of the shoot of Agostinelli, DeSimone and Noselli (2021) as one value.

use std::f64::consts::PI;

use super::{Shoot, ShootBuilder};
use crate::constitutive::{Lignifying, LinearElastic};
use crate::growth::{Ongoing, UniformGrowth};
use crate::load::Weight;
use crate::model::Laws;
use crate::tropism::{
    Gravitropism, Memory, Oscillator, Perception, Proprioception, Remembered, Response,
    SettledStatoliths, Statoliths,
};

/// Gravitropism and proprioception with their memories, equations (7) and (8).
pub type Steering<P = SettledStatoliths> =
    (Remembered<Gravitropism<P>>, Remembered<Proprioception>);

/// Laws of the full model: [`ShootParameters::shoot`].
pub type FullModel = Laws<
    Lignifying,
    UniformGrowth,
    (
        Oscillator,
        Remembered<Gravitropism<Statoliths>>,
        Remembered<Proprioception>,
    ),
    Weight,
>;

/// Laws of the reduced model: [`ShootParameters::reduced`].
pub type ReducedModel = Laws<LinearElastic, Ongoing<UniformGrowth>, Steering, Weight>;

/// Parameters of the shoot of Agostinelli, DeSimone and Noselli (2021), in SI units.
///
/// The default values are those of the paper for *Arabidopsis thaliana*, with the initial length,
/// the growth time and the oscillator of its second video. Gravity, 9.81 m/s² by default, and the
/// base belong to the [scene](ShootBuilder::scene).
///
/// [`shoot`](Self::shoot) and [`reduced`](Self::reduced) return builders, whose laws can be
/// replaced. The other methods return single laws, for other combinations. The values are checked
/// by [`build`](ShootBuilder::build).
///
/// ```
/// use morphorod::ShootParameters;
///
/// let paper = ShootParameters::default();
/// // The second video: a shoot that grows, with all laws.
/// let growing = paper.shoot().build()?;
/// assert_eq!(growing.rod().length(), 0.068);
/// // The fifth video: constant length, statoliths with avalanches, and an oscillator of 20 min.
/// let trochoids = ShootParameters {
///     length: 0.06565,
///     growth_time: 20.0 * 3600.0,
///     oscillator_sensitivity: 0.3,
///     oscillator_period: 20.0 * 60.0,
///     ..paper
/// };
/// let shoot = trochoids.reduced().tropism(trochoids.tropism()).build()?;
/// assert_eq!(shoot.rod().length(), 0.06565);
/// # Ok::<(), morphorod::ParameterError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ShootParameters {
    /// Length at t = 0, ℓ0, or constant length of the reduced model, ℓ: 6.8 cm.
    pub length: f64,
    /// Radius r: 0.5 mm.
    pub radius: f64,
    /// Density ρ: 1000 kg/m³.
    pub density: f64,
    /// Young's modulus of young tissue, E0 = E: 10 MPa.
    pub youngs_modulus: f64,
    /// Young's modulus of mature tissue, E1: 2 GPa.
    pub mature_modulus: f64,
    /// Poisson's ratio ν, without unit: 0.5.
    pub poissons_ratio: f64,
    /// Lignification time τℓ: 6 d.
    pub lignification_time: f64,
    /// Length of the growth zone, ℓg: 7 cm.
    pub zone_length: f64,
    /// Growth time τg: 40 h.
    pub growth_time: f64,
    /// Gravitropic sensitivity β, without unit: 0.8.
    pub gravitropic_sensitivity: f64,
    /// Memory time τm and reaction time τr of gravitropism: 12 min each.
    pub gravitropic_memory: Memory,
    /// Avalanche time of the statoliths, τa: 2 min.
    pub avalanche_time: f64,
    /// Proprioceptive sensitivity η, without unit: 20.
    pub proprioceptive_sensitivity: f64,
    /// Memory time τ̄m and reaction time τ̄r of proprioception: 12 min each.
    pub proprioceptive_memory: Memory,
    /// Sensitivity of the endogenous oscillator, α, without unit: 0.2.
    pub oscillator_sensitivity: f64,
    /// Period of the endogenous oscillator, τe: 24 min.
    pub oscillator_period: f64,
}

impl Default for ShootParameters {
    fn default() -> Self {
        Self {
            length: 0.068,
            radius: 5e-4,
            density: 1000.0,
            youngs_modulus: 1e7,
            mature_modulus: 2e9,
            poissons_ratio: 0.5,
            lignification_time: 6.0 * 24.0 * 3600.0,
            zone_length: 0.07,
            growth_time: 40.0 * 3600.0,
            gravitropic_sensitivity: 0.8,
            gravitropic_memory: Memory::default(),
            avalanche_time: 120.0,
            proprioceptive_sensitivity: 20.0,
            proprioceptive_memory: Memory::default(),
            oscillator_sensitivity: 0.2,
            oscillator_period: 24.0 * 60.0,
        }
    }
}

impl ShootParameters {
    /// Builder of the full model, equations (1) to (13): a shoot that elongates and lignifies, with
    /// its oscillator, statoliths, proprioception and weight.
    pub fn shoot(&self) -> ShootBuilder<FullModel> {
        Shoot::builder(self.lignifying())
            .length(self.length)
            .radius(self.radius)
            .growth(self.growth())
            .tropism(self.tropism())
            .load(self.weight())
    }

    /// Builder of the reduced model: constant length and Young's modulus E0, differential growth
    /// everywhere, settled statoliths (h = −ĝ) and no oscillator.
    ///
    /// With `.tropism(parameters.tropism())` it has the oscillator, and statoliths with avalanches.
    pub fn reduced(&self) -> ShootBuilder<ReducedModel> {
        let mut growth = self.growth();
        // Differential growth acts everywhere, whatever the length. NaN is kept and refused later.
        if self.length > growth.zone_length {
            growth.zone_length = self.length;
        }
        Shoot::builder(self.young())
            .length(self.length)
            .radius(self.radius)
            .growth(Ongoing(growth))
            .tropism(self.steering(SettledStatoliths))
            .load(self.weight())
    }

    /// Elasticity of young tissue, equation (10).
    #[must_use]
    pub fn young(&self) -> LinearElastic {
        LinearElastic {
            youngs_modulus: self.youngs_modulus,
            poissons_ratio: self.poissons_ratio,
        }
    }

    /// Elasticity with lignification, equations (10) and (13).
    #[must_use]
    pub fn lignifying(&self) -> Lignifying {
        Lignifying {
            young: self.young(),
            mature_modulus: self.mature_modulus,
            time: self.lignification_time,
        }
    }

    /// Growth behind the apex, equation (3).
    #[must_use]
    pub fn growth(&self) -> UniformGrowth {
        UniformGrowth {
            zone_length: self.zone_length,
            time: self.growth_time,
        }
    }

    /// Oscillator, gravitropism with statoliths, and proprioception, equations (5) to (8).
    #[must_use]
    pub fn tropism(
        &self,
    ) -> (
        Oscillator,
        Remembered<Gravitropism<Statoliths>>,
        Remembered<Proprioception>,
    ) {
        let (gravitropism, proprioception) = self.steering(self.statoliths());
        (self.oscillator(), gravitropism, proprioception)
    }

    /// Gravitropism with a given perception of gravity, and proprioception, equations (7) and (8).
    #[must_use]
    pub fn steering<P: Perception<Signal = [f64; 2]>>(&self, perception: P) -> Steering<P> {
        let gravitropism = Gravitropism {
            sensitivity: self.gravitropic_sensitivity,
            perception,
        };
        let proprioception = Proprioception {
            sensitivity: self.proprioceptive_sensitivity,
        };
        (
            gravitropism.remembered(self.gravitropic_memory),
            proprioception.remembered(self.proprioceptive_memory),
        )
    }

    /// Counterclockwise endogenous oscillator, equation (5).
    #[must_use]
    pub fn oscillator(&self) -> Oscillator {
        Oscillator::new(self.oscillator_sensitivity, self.oscillator_period)
    }

    /// Perception of gravity by statoliths with avalanches, equation (6).
    #[must_use]
    pub fn statoliths(&self) -> Statoliths {
        Statoliths {
            avalanche_time: self.avalanche_time,
        }
    }

    /// Weight, equation (12).
    #[must_use]
    pub fn weight(&self) -> Weight {
        Weight {
            density: self.density,
        }
    }

    /// Greatest length at which an upright shoot of young tissue without tropism does not buckle
    /// under its weight, m: ℓc = (α0 E I/(ρ g π r²))^(1/3), where α0 is
    /// [`Weight::GREENHILL`] and `gravity` the acceleration g, m/s² (A. G. Greenhill 1881).
    ///
    /// It is infinite without weight.
    #[must_use]
    pub fn self_buckling_length(&self, gravity: f64) -> f64 {
        let per_length = self.density * gravity * PI * self.radius.powi(2);
        (Weight::GREENHILL * self.young().stiffness(self.radius).x / per_length).cbrt()
    }
}
