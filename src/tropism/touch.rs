//! Perception of contact with obstacles, and thigmotropism.

use nalgebra::Vector3;

use super::localised::rise;
use super::{Declaration, DirectionalTropism, Perception, Site, Source};
use crate::error::ParameterError;
use crate::rod::Rod;

/// Perception of the forces of [obstacles](crate::support::Contact) on the shoot.
///
/// The stimulus is the force per length f (N/m) on the shoot in the present equilibrium. Tissue
/// senses the forces within a distance w along the shoot. A force F at the arc length a contributes
/// F K(s − a) at the arc length s, with
///
/// ```text
/// K(x) = 315/(256 w) (1 − x²/w²)⁴ for |x| < w, and 0 beyond.
/// ```
///
/// The part of the kernel beyond an end of the shoot is reflected, so that the integral of f along
/// the shoot is the sum of the forces. The width w is a property of the tissue, and not of the
/// method. It depends on the deformation under a force at a point, and on signals between cells.
/// Elements must resolve it, and the shorter length over which the signal rises where f is much
/// larger than the saturation below. The forces of a contact over a length are quadrature weights
/// times its pressure, and f approximates the convolution of pressure and kernel.
///
/// The signal is (t1, t2), the components along d1 and d2 of a vector without unit towards the
/// obstacle, opposite to the part f⊥ of f across the shoot. The part along the shoot, mainly
/// friction, has no effect. With the threshold fT and the saturation fS the length of the vector is
///
/// ```text
/// S = x³ (10 − 15 x + 6 x²),    x = (|f⊥| − fT)/(fS − fT) between 0 and 1,
/// ```
///
/// zero up to fT and one from fS on. It has two continuous derivatives. Holds and springs are not
/// sensed. Only forces in the present shape are sensed. The friction force of an obstacle across
/// the shoot is part of f⊥; it is at most the coefficient of friction times the normal force.
///
/// A [`Memory`](super::Memory) with the memory time τm (s) and the delay τr (s) responds gradually.
/// After the time T + τr in contact with a constant signal it is 1 − exp(−T/τm) of the signal.
/// After the end of the contact it decays with the same time constant. It thus measures the time
/// since the contact began. [`AtApex`](super::AtApex) senses only the forces within w of the apex.
///
/// ```
/// use morphorod::growth::UniformGrowth;
/// use morphorod::integrator::{Integrator, MethodOfSteps};
/// use morphorod::nalgebra::Vector3;
/// use morphorod::support::{Contact, Cylinder};
/// use morphorod::tropism::{Memory, Response, Thigmotropism, Touch};
/// use morphorod::{Shoot, Still, constitutive::LinearElastic, load::Weight};
///
/// let touch = Touch { width: 4e-3, threshold: 1e-3, saturation: 2e-2 };
/// let memory = Memory { time: 600.0, delay: 300.0 };
/// let winds = Thigmotropism { sensitivity: 0.5, perception: touch }.remembered(memory);
/// // The shoot sags until it leans on a horizontal pole, and then bends round it.
/// let radius = 0.5e-3;
/// let pole = Cylinder { through: Vector3::new(0.025, 0.0, 0.032), along: Vector3::y(), radius: 2e-3 };
/// let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
///     .length(0.04)
///     .radius(radius)
///     .growth(UniformGrowth { zone_length: 0.04, time: 72e3 })
///     .tropism(winds)
///     .load(Weight { density: 1000.0 })
///     .scene(Still::tilted(0.5))
///     .support(Contact { obstacle: pole, radius, friction: 0.0 })
///     .build()?;
/// MethodOfSteps::new(300.0).advance(&mut shoot, 36e3)?;
/// // The force per length at the contact is that of a force at a point, 315/(256 w) times the force.
/// let contact = shoot.reactions()[0];
/// let force = touch.force_per_length(shoot.rod(), contact.arc_length);
/// assert!(force.norm() >= 1.23 * contact.normal / touch.width);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[doc(alias("contact", "pressure", "mechanoreception"))]
pub struct Touch {
    /// Sensing width w, m; positive. On a shorter shoot the width is the length of the shoot.
    pub width: f64,
    /// Threshold fT of the force per length, N/m; zero for none.
    pub threshold: f64,
    /// Force per length fS from which the signal is constant, N/m; more than the threshold.
    pub saturation: f64,
}

impl Touch {
    /// Force per length f (N/m) of the obstacles on a rod in its last equilibrium, at an arc length
    /// (m), in the fixed frame. A normal force points away from its obstacle. Zero without contact,
    /// and for a width that is not positive.
    #[must_use]
    pub fn force_per_length(&self, rod: &Rod, arc_length: f64) -> Vector3<f64> {
        let pushes = || {
            rod.reactions()
                .iter()
                .filter(|reaction| reaction.obstacle.is_some())
        };
        if pushes().next().is_none() || self.width.is_nan() || self.width <= 0.0 {
            return Vector3::zeros();
        }
        let length = rod.length();
        let width = self.width.min(length);
        let kernel = |distance: f64| {
            let rest = (1.0 - (distance / width).powi(2)).max(0.0);
            if rest > 0.0 {
                315.0 / (256.0 * width) * rest.powi(4)
            } else {
                0.0
            }
        };
        pushes().fold(Vector3::zeros(), |sum, at| {
            let (s, a) = (arc_length, at.arc_length);
            sum + at.force * (kernel(s - a) + kernel(s + a) + kernel(2.0 * length - s - a))
        })
    }

    /// Strength S of the signal, from zero to one, for a force per length across the shoot, N/m.
    #[must_use]
    pub fn strength(&self, force: f64) -> f64 {
        rise((force - self.threshold) / (self.saturation - self.threshold))
    }
}

impl Perception for Touch {
    type Signal = [f64; 2];

    #[inline(always)]
    fn declare(&self, to: &mut Declaration) -> Source {
        to.stimulus_pair()
    }

    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let force = site.along_directors(&self.force_per_length(site.rod, site.arc_length));
        let across = force.x.hypot(force.y);
        let share = if across > self.threshold {
            self.strength(across) / across
        } else {
            0.0
        };
        stimuli.copy_from_slice(&[-share * force.x, -share * force.y]);
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::positive("sensing width of touch", self.width, "m")?;
        ParameterError::not_negative("threshold of touch", self.threshold, "N/m")?;
        let ok = self.saturation.is_finite() && self.saturation > self.threshold;
        let requirement = "finite, and more than the threshold (N/m)";
        ParameterError::unless(ok, "saturation of touch", self.saturation, requirement)
    }
}

/// Thigmotropism: growth bends the tissue towards the obstacle that it [touches](Touch), or away
/// from it if the sensitivity is negative, by equation (7) with the sensitivity χ (without unit) in
/// place of β:
///
/// ```text
/// r u̇1* = −χ REGR M[t2],   r u̇2* = +χ REGR M[t1].
/// ```
///
/// Here u1* and u2* (1/m) are the intrinsic curvatures, r (m) is the radius, REGR (1/s) the
/// relative elemental growth rate, and M the memory. A saturated signal changes the curvature in
/// one growth time by χ/r. Tendrils bend towards the touched side (C. Darwin 1875, *The Movements
/// and Habits of Climbing Plants*; M. J. Jaffe and A. W. Galston 1968, *The physiology of
/// tendrils*, Annu. Rev. Plant Physiol. 19:417–434).
///
/// The signal of a shoot without contact is zero in all neighbouring shapes.
/// [`stability`](crate::stability) and [`cycle`](crate::cycle) refuse shoots that touch an
/// obstacle, and therefore treat the law exactly.
#[doc(alias("thigmotropism", "touch", "contact coiling"))]
pub type Thigmotropism<T = Touch> = DirectionalTropism<T>;
