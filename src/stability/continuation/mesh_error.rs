//! Estimates of the error of a mesh, from the change of a result on a finer mesh.

use nalgebra::SVector;

use super::follow::{Follower, LinearFamily};
use crate::error::ParameterError;
use crate::linearisation::StabilityError;
use crate::stability::spectrum::Linearisation;

/// Smallest relative error that is reported: the rounding of the differences from which the
/// characteristic matrix is assembled, in a parameter, a frequency or a root on a mesh that
/// resolves the waves.
pub(super) const ROUNDING: f64 = 1e-10;

/// Smallest tolerance of a mesh refinement, and distance of a corrected point from a boundary in
/// fractions of the sides: ten times the rounding, which waves that are amplified along the shoot
/// increase.
pub(super) const ACCURACY: f64 = 10.0 * ROUNDING;

/// Returns an error unless a linearisation has more elements than the mesh whose error it is to
/// estimate.
pub(super) fn check_finer(elements: usize, finer: &Linearisation) -> Result<(), ParameterError> {
    let (what, number) = ("number of elements of the finer mesh", finer.elements());
    let requirement = "more than that of the mesh whose error is sought: the family must use the number of elements that it receives";
    ParameterError::unless(number > elements, what, number as f64, requirement)
}

/// The observed convergence of a result from mesh to mesh.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Convergence {
    /// The last change of the result, and the ratio of the numbers of elements.
    pub last: Option<(f64, f64)>,
    /// Whether a coarser mesh gave no result. The first mesh with a result then barely resolves the
    /// waves.
    pub just_resolved: bool,
}

impl Convergence {
    /// Error of the result on the finer mesh, relative to its change from a mesh of `coarse`
    /// elements. The observed order of convergence is limited to the range from half the order of
    /// the elements to one less than this order, which allows for terms of higher order. Waves that
    /// are barely resolved converge more slowly: a quarter of the order is assumed for their first
    /// change.
    pub fn error_share(&mut self, change: f64, coarse: usize, fine: &Linearisation) -> f64 {
        let ratio = fine.elements() as f64 / coarse as f64;
        let half = fine.characteristic.points_per_element() as f64;
        let order = match self.last {
            Some((before, ratio)) => {
                let observed = (before / change).ln() / ratio.ln();
                if observed > half {
                    observed.min(2.0 * half - 1.0)
                } else {
                    half
                }
            }
            None if self.just_resolved => 0.5 * half,
            None => half,
        };
        self.last = Some((change, ratio));
        let share = ratio.powf(-order);
        share / (1.0 - share)
    }
}

/// The size to which the error of a parameter is relative: the parameter, or the larger end of a
/// range that contains zero.
pub(super) fn size(parameter: f64, from: f64, to: f64) -> f64 {
    if from * to > 0.0 {
        parameter.abs()
    } else {
        from.abs().max(to.abs())
    }
}

/// Estimated error of a crossing due to its mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct MeshError<const N: usize> {
    pub parameters: SVector<f64, N>,
    /// 1/s.
    pub frequency: f64,
    /// Largest of the errors, each relative to its size.
    pub relative: f64,
}

impl<const N: usize> MeshError<N> {
    /// The larger error of two, component by component.
    pub fn larger(&self, other: &Self) -> Self {
        let (frequency, relative) = (
            self.frequency.max(other.frequency),
            self.relative.max(other.relative),
        );
        Self {
            parameters: self.parameters.sup(&other.parameters),
            frequency,
            relative,
        }
    }
}

/// A crossing on one mesh, with its error.
#[derive(Clone, Copy)]
pub(super) struct Estimated<const N: usize> {
    pub place: Follower<N>,
    pub error: MeshError<N>,
    pub convergence: Convergence,
}

impl<const N: usize> Estimated<N> {
    /// A crossing on the first mesh, whose error is unknown.
    pub fn new(place: Follower<N>) -> Self {
        let unknown = f64::INFINITY;
        let error = MeshError {
            parameters: SVector::repeat(unknown),
            frequency: unknown,
            relative: unknown,
        };
        Self {
            place,
            error,
            convergence: Convergence::default(),
        }
    }

    /// Moves the crossing to a finer mesh, and corrects its free parameters there up to the
    /// distance `close`. `sizes` are those to which errors of the parameters are relative. Returns
    /// the error on the mesh before.
    pub fn refine(
        &mut self,
        free: &SVector<f64, N>,
        sizes: &SVector<f64, N>,
        close: f64,
        family: &mut LinearFamily<N>,
    ) -> Result<MeshError<N>, StabilityError> {
        let (before, place) = (self.place, &mut self.place);
        let linear = family(&before.at)?;
        check_finer(before.elements, &linear)?;
        place.change_mesh(before.root, &linear)?;
        place.correct(free, close, family)?;
        let frequency_size = if place.root.im == 0.0 {
            place.rate
        } else {
            place.root.im.abs()
        };
        let error = |share: f64| {
            let error = |change: f64, size: f64| (change.abs() * share).max(ROUNDING * size);
            let parameters = (place.at - before.at).zip_map(sizes, error);
            let frequency = error(place.root.im.abs() - before.root.im.abs(), frequency_size);
            let relative = parameters
                .component_div(sizes)
                .max()
                .max(frequency / frequency_size);
            MeshError {
                parameters,
                frequency,
                relative,
            }
        };
        let coarse = error(1.0);
        self.error = error(
            self.convergence
                .error_share(coarse.relative, before.elements, &linear),
        );
        Ok(coarse)
    }
}
