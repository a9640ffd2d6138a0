//! Perception of light from sources at any place, and phototropism.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::{Declaration, DirectionalTropism, Perception, Site, Source};
use crate::error::ParameterError;
use crate::scene::earlier;

/// Source of light.
///
/// A function of the time (s) and the position (m, fixed frame) is also a source, such as a lamp
/// that moves. It must be smooth in time; [`During`] switches a source on and off.
///
/// ```
/// use morphorod::nalgebra::Vector3;
/// use morphorod::tropism::{LightSource, PointLight};
///
/// // A lamp of 1 W that moves once a day on a circle with a radius of 50 cm.
/// let lamp = |t: f64, position: &Vector3<f64>| {
///     let (sin, cos) = (std::f64::consts::TAU * t / 86_400.0).sin_cos();
///     PointLight { position: Vector3::new(0.5 * cos, 0.5 * sin, 0.3), power: 1.0 }.light(t, position)
/// };
/// assert!(lamp.light(0.0, &Vector3::zeros()).x > 0.0);
/// ```
pub trait LightSource {
    /// Vector towards the light at a time (s) and a position (m, fixed frame). Its length is the
    /// irradiance of a surface that faces the light, W/m².
    fn light(&self, t: f64, position: &Vector3<f64>) -> Vector3<f64>;

    /// Whether the light depends on the position; `true` by default. If it does not, the position
    /// is NaN.
    fn reads_position(&self) -> bool {
        true
    }

    /// First time after `t` (s) at which the light is discontinuous; infinite by default.
    fn next_discontinuity(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter that is out of range.
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }
}

impl<F: Fn(f64, &Vector3<f64>) -> Vector3<f64>> LightSource for F {
    fn light(&self, t: f64, position: &Vector3<f64>) -> Vector3<f64> {
        self(t, position)
    }
}

/// Parallel light from a source at infinity.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ParallelLight(
    /// Vector towards the light, whose length is the irradiance, W/m².
    pub Vector3<f64>,
);

impl LightSource for ParallelLight {
    fn light(&self, _t: f64, _position: &Vector3<f64>) -> Vector3<f64> {
        self.0
    }

    fn reads_position(&self) -> bool {
        false
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("irradiance of parallel light", self.0.norm(), "W/m²")
    }
}

/// Point that emits the power P (W) uniformly in all directions. At a distance d (m) the irradiance
/// is P/(4π d²).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PointLight {
    /// Position in the fixed frame, m.
    pub position: Vector3<f64>,
    /// Emitted power P, W.
    pub power: f64,
}

impl LightSource for PointLight {
    fn light(&self, _t: f64, position: &Vector3<f64>) -> Vector3<f64> {
        let distance = self.position - position;
        distance * (self.power / (4.0 * PI * distance.norm().powi(3)))
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("position of a point light", self.position.norm(), "m")?;
        ParameterError::not_negative("power of a point light", self.power, "W")
    }
}

/// Straight line between two points, each part of which emits as a [`PointLight`]. The vectors of
/// its parts add. At a distance d (m) from the middle of a long line with the power P' per length
/// (W/m) the irradiance is P'/(2π d).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LineLight {
    /// Ends of the line in the fixed frame, m.
    pub ends: [Vector3<f64>; 2],
    /// Emitted power of the whole line, W.
    pub power: f64,
}

impl LightSource for LineLight {
    fn light(&self, _t: f64, position: &Vector3<f64>) -> Vector3<f64> {
        let [a, b] = self.ends.map(|end| end - position);
        // ∫ x/|x|³ over the points x = a + (b − a) t, 0 ≤ t ≤ 1.
        let (ra, rb) = (a.norm(), b.norm());
        let sum = (a / ra + b / rb) / (ra * rb + a.dot(&b));
        sum * (self.power / (4.0 * PI))
    }

    fn check(&self) -> Result<(), ParameterError> {
        let [a, b] = self.ends;
        ParameterError::positive("length of a line light", (b - a).norm(), "m")?;
        ParameterError::not_negative("power of a line light", self.power, "W")
    }
}

/// Light that is switched on for some time, such as a pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct During<S> {
    /// The source while it is on.
    pub source: S,
    /// Time at which it is switched on, s.
    pub from: f64,
    /// Time at which it is switched off, s; infinite for a light that stays on.
    pub until: f64,
}

impl<S: LightSource> LightSource for During<S> {
    fn light(&self, t: f64, position: &Vector3<f64>) -> Vector3<f64> {
        if self.from <= t && t < self.until {
            self.source.light(t, position)
        } else {
            Vector3::zeros()
        }
    }

    fn reads_position(&self) -> bool {
        self.source.reads_position()
    }

    fn next_discontinuity(&self, t: f64) -> f64 {
        let switches = [self.from, self.until].into_iter().filter(|time| *time > t);
        switches.fold(self.source.next_discontinuity(t), earlier)
    }

    fn check(&self) -> Result<(), ParameterError> {
        let (name, requirement) = (
            "time at which a light is switched on",
            "at most that of its end (s)",
        );
        ParameterError::unless(self.from <= self.until, name, self.from, requirement)?;
        self.source.check()
    }
}

/// Perception of the light at the place of the tissue, or at the apex with
/// [`AtApex`](super::AtApex).
///
/// The signal is (l1, l2), the components along d1 and d2 of a vector towards the light. Its length
/// is f(I), a function without unit of the irradiance I (W/m²), with a reference I0 (W/m²):
///
/// - f(I) = I/I0 is linear: the response to a pulse depends on its *dose*, irradiance times
///   duration (reciprocity);
/// - f(I) = ln(1 + I/I0) is the law of Weber and Fechner for strong light;
/// - f(I) = I/(I + I0) saturates; f(I) = 1 depends on the direction alone.
///
/// ```
/// use morphorod::nalgebra::Vector3;
/// use morphorod::tropism::{Light, Memory, ParallelLight, Phototropism, Response};
///
/// // Light from the side of e1 that saturates the response at about 1 W/m².
/// let source = ParallelLight(Vector3::x() * 0.5);
/// let light = Light { source, strength: |irradiance| irradiance / (irradiance + 1.0) };
/// let law = Phototropism { sensitivity: 0.8, perception: light }.remembered(Memory { time: 600.0, delay: 300.0 });
/// # let _ = law;
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light<S, F> {
    /// The source of light.
    pub source: S,
    /// Strength f of the stimulus as a function of the irradiance (W/m²). The light is not
    /// perceived where its irradiance is zero.
    pub strength: F,
}

impl<S: LightSource, F: Fn(f64) -> f64> Perception for Light<S, F> {
    type Signal = [f64; 2];

    #[inline(always)]
    fn declare(&self, to: &mut Declaration) -> Source {
        if self.source.reads_position() {
            to.with_position();
        }
        to.stimulus_pair()
    }

    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let light = self.source.light(site.environment.time, &site.position);
        let irradiance = light.norm();
        let share = if irradiance == 0.0 {
            0.0
        } else {
            (self.strength)(irradiance) / irradiance
        };
        let seen = site.along_directors(&light) * share;
        stimuli.copy_from_slice(&[seen.x, seen.y]);
    }

    fn next_discontinuity(&self, t: f64) -> f64 {
        self.source.next_discontinuity(t)
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.source.check()
    }
}

/// Phototropism: growth bends the tissue towards the [light](Light), or away from it if the
/// sensitivity is negative, by equation (7) with the sensitivity φ (without unit) in place of β.
/// The sum with [`Gravitropism`](super::Gravitropism) bends the shoot towards β ê3 + φ f(I) l, with
/// the upward vertical ê3 and the unit vector l towards the light. With an angle A_P of the light
/// from the vertical and the ratio m = φ f(I)/β, the apex reaches the angle A with
///
/// ```text
/// tan A = m sin A_P/(1 + m cos A_P)
/// ```
///
/// (Bastien, Douady and Moulia, PLoS Comput. Biol. 11:e1004037, 2015).
pub type Phototropism<L> = DirectionalTropism<L>;
