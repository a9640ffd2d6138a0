//! A crossing of the imaginary axis.

use nalgebra::{Complex, SVector};

use super::follow::{Follower, find_alike};
use super::mesh_error::{MeshError, ROUNDING, check_finer};
use crate::linearisation::{Outcome, StabilityError};
use crate::stability::spectrum::{Linearisation, Root, SpectrumPart};

/// A crossing of the imaginary axis: a root iω at a value of one parameter, or a point of a
/// boundary in two.
#[derive(Debug, Clone, Copy, PartialEq)]
#[must_use]
#[non_exhaustive]
pub struct Crossing<const N: usize> {
    /// Values of the parameters.
    pub parameters: [f64; N],
    /// Angular frequency ω, 1/s; zero if the root is λ = 0, where nothing oscillates.
    pub frequency: f64,
    /// Whether the root belongs to the essential spectrum, so that waves of every length become
    /// unstable at once.
    pub essential: bool,
    /// Number of elements of the growth zone.
    pub elements: usize,
    /// Estimated errors of the parameters due to the mesh, from [`with_error`](Self::with_error) or
    /// [`Refinement`](super::Refinement). In two parameters: the components of the shortest vector
    /// to the curve, with lengths in fractions of the sides of the rectangle. `None` if they were
    /// not estimated.
    pub parameter_errors: Option<[f64; N]>,
    /// Estimated error of the frequency due to the mesh, 1/s; `None` if it was not estimated.
    pub frequency_error: Option<f64>,
    /// The root. Its parameters are measured in units of the sides.
    pub(super) place: Follower<N>,
    sides: SVector<f64, N>,
}

impl<const N: usize> Crossing<N> {
    /// The crossing at a root, whose parameters are measured from `low` in units of `sides`.
    pub(super) fn new(place: Follower<N>, low: SVector<f64, N>, sides: SVector<f64, N>) -> Self {
        Self {
            parameters: (low + sides.component_mul(&place.at)).into(),
            frequency: place.frequency(),
            essential: matches!(place.part, SpectrumPart::Essential(_)),
            elements: place.elements,
            parameter_errors: None,
            frequency_error: None,
            place,
            sides,
        }
    }

    /// The same crossing with an estimate of its error.
    pub(super) fn estimated(self, error: &MeshError<N>) -> Self {
        let parameter_errors = Some(error.parameters.component_mul(&self.sides).into());
        Self {
            parameter_errors,
            frequency_error: Some(error.frequency),
            ..self
        }
    }

    /// The period, s; infinite if the root is λ = 0.
    #[must_use]
    pub fn period(&self) -> f64 {
        std::f64::consts::TAU / self.frequency
    }

    /// The crossing with an estimate of the error due to its mesh: the distance from the crossing
    /// of `finer`, the same family on a finer mesh, which is evaluated once, at the parameters of
    /// this crossing. The relative error of the estimate is the ratio of the errors of the two
    /// meshes: 1/200 for elements of order eight and half the length that resolve the waves. In two
    /// parameters it is a tenth, the error of the derivatives of the root along the curve.
    ///
    /// ```
    /// # use morphorod::ShootParameters;
    /// # use morphorod::stability::{Linearisation, StabilityError, onset};
    /// let family = |length: f64, elements: usize| -> Result<Linearisation, StabilityError> {
    ///     let parameters = ShootParameters {
    ///         length,
    ///         growth_time: 72e3,
    ///         proprioceptive_sensitivity: 0.0,
    ///         ..Default::default()
    ///     };
    ///     let shoot = parameters.reduced().elements(elements).build()?;
    ///     // An upright shoot is in a steady state when it is built.
    ///     Linearisation::about(&shoot)
    /// };
    /// let found = onset(|length| family(length, 2), 0.06, 0.075)?.with_error(|[length]| family(length, 4))?;
    /// let [length] = found.parameters;
    /// let [error] = found.parameter_errors.expect("estimated by `with_error`");
    /// assert!(error > 1e-9 * length && error < 1e-5 * length);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Errors of `finer`, a mesh that is not finer, or one without a root near this one.
    pub fn with_error(
        self,
        finer: impl FnOnce([f64; N]) -> Result<Linearisation, StabilityError>,
    ) -> Result<Self, StabilityError> {
        let linear = finer(self.parameters)?;
        check_finer(self.elements, &linear)?;
        let mut there = self.place;
        there.change_mesh(there.root, &linear)?;
        let step = there.step_to_axis(&SVector::repeat(1.0));
        let change = there.predict(&(there.at + step)).im.abs() - self.place.root.im.abs();
        let rounding = SVector::from(self.parameters).abs() * ROUNDING;
        Ok(Self {
            parameter_errors: Some(step.component_mul(&self.sides).abs().sup(&rounding).into()),
            frequency_error: Some(change.abs().max(ROUNDING * self.frequency)),
            ..self
        })
    }
}

impl Crossing<1> {
    /// The root of a linearisation at this crossing, with its mode. The mesh may differ from that
    /// of the crossing.
    ///
    /// # Errors
    /// An essential root, or a linearisation without a root near this one.
    pub(crate) fn mode(&self, linear: &Linearisation) -> Outcome<Root> {
        linear.with_mode(find_alike(
            linear,
            self.place.part,
            Complex::new(0.0, self.frequency),
        )?)
    }

    /// The crossing at a root, whose parameter is measured in its own unit.
    pub(super) fn at(place: Follower<1>) -> Self {
        Self::new(place, SVector::zeros(), SVector::repeat(1.0))
    }
}
