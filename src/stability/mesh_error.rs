//! The error that the mesh makes: how far an answer moves on a finer one.

use nalgebra::Vector1;

use super::error::StabilityError;
use super::follow::find_alike;
use super::linearisation::Linearisation;
use super::modes::Root;
use super::onset::Onset;
use super::spectrum::Part;
use crate::error::ParameterError;

/// What the differences that make the matrix leave of a parameter, a frequency or a root on a mesh that resolves the waves,
/// relative to it: the smallest error that is reported.
pub(super) const ROUNDING: f64 = 1e-10;

/// Refuses a mesh that is to tell the error of one of so many elements, and is no finer.
pub(super) fn check_finer(elements: usize, finer: &Linearisation) -> Result<(), ParameterError> {
    let (what, number) = ("number of elements of the finer mesh", finer.elements());
    ParameterError::unless(number > elements, what, number as f64, "more than that of the mesh whose error is sought")
}

/// How fast an answer converges from mesh to mesh, as far as that has been seen.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Convergence {
    /// How far the answer moved last, and how many times as many elements that took.
    last: Option<(f64, f64)>,
    /// Whether a coarser mesh had no answer, so that the waves are just resolved on the first one that has.
    just_resolved: bool,
}

impl Convergence {
    /// The convergence of an answer after a mesh that had none.
    pub fn just_resolved() -> Self {
        Self { just_resolved: true, ..Self::default() }
    }

    /// Of what a finer mesh has changed, the share that is its own error, after a move of a certain size from a mesh of so
    /// many elements. The order that is seen is believed between half of the order of the elements and one less than this order, which
    /// leaves room for terms of higher order. Waves that are just resolved converge more slowly: of the first move of such waves a quarter
    /// of the order is believed.
    pub fn share_that_is_left(&mut self, moved: f64, coarse: usize, fine: &Linearisation) -> f64 {
        let ratio = fine.elements() as f64 / coarse as f64;
        let half = fine.points_per_element() as f64;
        let order = match self.last {
            Some((before, ratio)) => {
                let seen = (before / moved).ln() / ratio.ln();
                if seen > half { seen.min(2.0 * half - 1.0) } else { half }
            }
            None if self.just_resolved => 0.5 * half,
            None => half,
        };
        self.last = Some((moved, ratio));
        let left = ratio.powf(-order);
        left / (1.0 - left)
    }
}

/// What the error of a parameter is relative to: itself, or the larger end of a range that holds zero.
pub(super) fn size(parameter: f64, from: f64, to: f64) -> f64 {
    if from * to > 0.0 { parameter.abs() } else { from.abs().max(to.abs()) }
}

impl Root {
    /// The same with the error of the mesh, estimated: the distance to the root of `finer`, the linear problem of the same
    /// shoot on a finer mesh.
    ///
    /// # Errors
    /// A mesh that is no finer, or on which no root is near this one.
    pub fn with_error(self, finer: &Linearisation) -> Result<Self, StabilityError> {
        check_finer(self.strain.len() / finer.points_per_element(), finer)?;
        // Any block: roots are sought in all.
        let (_, there) = find_alike(finer, Part::Isolated(0), self.value)?;
        let error = (there - self.value).norm().max(ROUNDING * self.value.norm());
        Ok(Self { error: Some(error), ..self })
    }
}

impl Onset {
    /// The same with the error of the mesh, estimated: the way to where `finer`, the same family on a finer mesh, has the
    /// crossing. It is asked once, at this crossing's parameter. On half the elements' length the estimate is as good as
    /// the finer mesh is better, by a factor of two hundred with elements of order eight that resolve the waves.
    ///
    /// ```
    /// # use morphorod::Shoot;
    /// # use morphorod::constitutive::LinearElastic;
    /// # use morphorod::growth::{Ongoing, UniformGrowth};
    /// # use morphorod::stability::{Linearisation, StabilityError, onset};
    /// # use morphorod::load::Weight;
    /// # use morphorod::tropism::{Gravitropism, Memory, Response, SettledStatoliths};
    /// # let memory = Memory { time: 720.0, delay: 720.0 };
    /// let family = |length: f64, elements: usize| -> Result<Linearisation, StabilityError> {
    ///     let shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
    ///         .length(length).radius(5e-4).elements(elements)
    ///         .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: 72e3 }))
    ///         .tropism(Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(memory))
    ///         .load(Weight { density: 1000.0 })
    ///         .build()?;
    ///     // An upright shoot is stationary as it is built.
    ///     Linearisation::about(&shoot)
    /// };
    /// let found = onset(|length| family(length, 2), 0.06, 0.075)?.with_error(|length| family(length, 4))?;
    /// let error = found.parameter_error.expect("asked for");
    /// assert!(error > 1e-9 * found.parameter && error < 1e-5 * found.parameter);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// What `finer` reports, a mesh that is no finer, or one on which the root is not next to where it was.
    pub fn with_error(
        self,
        finer: impl FnOnce(f64) -> Result<Linearisation, StabilityError>,
    ) -> Result<Self, StabilityError> {
        let linear = finer(self.parameter)?;
        check_finer(self.elements, &linear)?;
        let mut there = self.crossing;
        there.change_mesh(there.root, &linear)?;
        let step = there.step_to_axis(&Vector1::new(1.0));
        let frequency = there.predict(&(there.at + step)).im.abs();
        Ok(Self {
            parameter_error: Some(step[0].abs().max(ROUNDING * self.parameter.abs())),
            frequency_error: Some((frequency - self.crossing.root.im.abs()).abs().max(ROUNDING * self.frequency)),
            ..self
        })
    }
}
