//! A root that is followed along parameters, and corrected to a crossing of the imaginary axis.

use nalgebra::{Complex, SVector};

use crate::linearisation::{Outcome, StabilityError};
use crate::stability::spectrum::{Linearisation, PartRoot, SpectrumPart};

/// Largest distance of a root from its expected value, relative to its modulus or to the slowest
/// rate. A root further off is taken for another one. Roots that respond k periods late have
/// relative distances of 1/k, and a tenth is at most half of that for k ≤ 5.
const JUMP: f64 = 0.1;

/// A family of linearisations along N parameters.
pub(super) type LinearFamily<'a, const N: usize> =
    dyn FnMut(&SVector<f64, N>) -> Result<Linearisation, StabilityError> + 'a;

/// A root of a part of the spectrum at N parameters, with approximate derivatives with respect to
/// them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Follower<const N: usize> {
    pub part: SpectrumPart,
    pub at: SVector<f64, N>,
    pub root: Complex<f64>,
    /// Approximate derivatives of the root with respect to the parameters.
    pub slope: SVector<Complex<f64>, N>,
    /// Slowest rate of the laws at these parameters, 1/s.
    pub rate: f64,
    /// Number of elements of the growth zone.
    pub elements: usize,
}

impl<const N: usize> Follower<N> {
    /// A known root. Its derivatives are set to zero.
    pub fn new(
        linear: &Linearisation,
        at: SVector<f64, N>,
        PartRoot { part, value: root }: PartRoot,
    ) -> Self {
        let slope = SVector::zeros();
        Self {
            part,
            at,
            root,
            slope,
            rate: linear.characteristic.slowest_rate(),
            elements: linear.elements(),
        }
    }

    /// The root next to an angular frequency (1/s) on the axis.
    pub fn on_axis(
        linear: &Linearisation,
        at: SVector<f64, N>,
        frequency: f64,
    ) -> Result<Self, StabilityError> {
        let start = Complex::new(0.0, frequency);
        let what = "the root at the start of the boundary, next to the given frequency,";
        let none = StabilityError::NoConvergence {
            what,
            residual: f64::INFINITY,
        };
        nearest(linear, start, |_| true)
            .map(|root| Self::new(linear, at, root))
            .ok_or(none)
    }

    /// Whether |Re λ| is below a share of the root's size, or of the slowest rate.
    pub fn is_on_axis(&self, share: f64) -> bool {
        self.root.re.abs() <= share * self.root.norm().max(self.rate)
    }

    /// The angular frequency, 1/s; zero up to rounding is zero.
    pub fn frequency(&self) -> f64 {
        if self.root.im.abs() < 1e-9 * self.rate {
            0.0
        } else {
            self.root.im.abs()
        }
    }

    /// The root that the derivatives predict.
    pub fn predict(&self, to: &SVector<f64, N>) -> Complex<f64> {
        self.root + self.slope.dot(&(to - self.at).map(Complex::from))
    }

    /// Moves to other parameters, at which a value of the root is expected, and corrects the
    /// derivatives by the change of the root (Broyden's update).
    ///
    /// # Errors
    /// A root that is not where it is expected.
    pub fn advance(
        &mut self,
        to: SVector<f64, N>,
        expected: Complex<f64>,
        linear: &Linearisation,
    ) -> Result<(), StabilityError> {
        let root = find(linear, self.part, expected)?;
        let step = (to - self.at).map(Complex::from);
        self.slope +=
            step * ((root - self.predict(&to)) / Complex::from((to - self.at).norm_squared()));
        (self.at, self.root, self.rate) = (to, root, linear.characteristic.slowest_rate());
        self.elements = linear.elements();
        Ok(())
    }

    /// Replaces the root by the corresponding one of a linearisation on another mesh, at the same
    /// parameters. The derivatives do not change.
    ///
    /// # Errors
    /// A root that is not where it is expected.
    pub fn change_mesh(
        &mut self,
        expected: Complex<f64>,
        linear: &Linearisation,
    ) -> Result<(), StabilityError> {
        PartRoot {
            part: self.part,
            value: self.root,
        } = find_alike(linear, self.part, expected)?;
        (self.rate, self.elements) = (linear.characteristic.slowest_rate(), linear.elements());
        Ok(())
    }

    /// The shortest step of the free parameters (one where free, zero where fixed) that brings the
    /// root to the axis.
    pub fn step_to_axis(&self, free: &SVector<f64, N>) -> SVector<f64, N> {
        let across = self.slope.map(|z| z.re).component_mul(free);
        across * (-self.root.re / across.norm_squared())
    }

    /// Makes the last step of a correction, to the predicted root.
    pub fn end_on_axis(&mut self, step: &SVector<f64, N>) {
        let to = self.at + step;
        self.root = Complex::new(0.0, self.predict(&to).im);
        self.at = to;
    }

    /// Computes the derivatives by differences, and moves by these.
    ///
    /// # Errors
    /// Errors of `family`, or a root that is not where it is expected.
    pub fn differentiate(&mut self, family: &mut LinearFamily<N>) -> Result<(), StabilityError> {
        for k in 0..N {
            let mut to = self.at;
            // Parameters are measured in units of their ranges. The relative rounding error of the
            // root is 1e-12, and two digits of the derivatives suffice.
            to[k] += 1e-6;
            self.advance(to, self.predict(&to), &family(&to)?)?;
        }
        Ok(())
    }

    /// Moves the free parameters until their distance from a crossing of the axis is below `close`.
    ///
    /// # Errors
    /// Errors of `family`, or a root that is not where it is expected.
    pub fn correct(
        &mut self,
        free: &SVector<f64, N>,
        close: f64,
        family: &mut LinearFamily<N>,
    ) -> Result<(), StabilityError> {
        let mut last = f64::INFINITY;
        for _ in 0..8 {
            let step = self.step_to_axis(free);
            let size = step.norm();
            // The distance after a step decreases in the same ratio as the steps.
            let distance = if last.is_finite() {
                size * (size / last)
            } else {
                size
            };
            if distance < close {
                self.end_on_axis(&step);
                return Ok(());
            }
            // Newton's method converges if each step is less than half of the one before.
            if !(size < 0.5 * last) {
                break;
            }
            let to = self.at + step;
            self.advance(to, self.predict(&to), &family(&to)?)?;
            last = size;
        }
        Err(StabilityError::NoConvergence {
            what: "boundary of stability",
            residual: last,
        })
    }
}

/// The root nearest to its expected value among all parts that are isolated or essential as a part
/// of another mesh is. The parts of two meshes need not correspond where tissue varies from point
/// to point.
pub(super) fn find_alike(
    linear: &Linearisation,
    part: SpectrumPart,
    expected: Complex<f64>,
) -> Outcome<PartRoot> {
    let alike = |name: SpectrumPart| {
        matches!(name, SpectrumPart::Essential(_)) == matches!(part, SpectrumPart::Essential(_))
    };
    nearest(linear, expected, alike).ok_or_else(|| lost(expected.norm()))
}

/// The root nearest to its expected value among some parts.
fn nearest(
    linear: &Linearisation,
    expected: Complex<f64>,
    of: impl Fn(SpectrumPart) -> bool,
) -> Option<PartRoot> {
    let root = |part| {
        find(linear, part, expected)
            .ok()
            .map(|value| PartRoot { part, value })
    };
    let distance = |root: &PartRoot| (root.value - expected).norm();
    linear
        .parts()
        .filter(|part| of(*part))
        .filter_map(root)
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

fn lost(residual: f64) -> StabilityError {
    StabilityError::NoConvergence {
        what: "root that is followed",
        residual,
    }
}

/// The root of a part next to its expected value.
fn find(
    linear: &Linearisation,
    part: SpectrumPart,
    expected: Complex<f64>,
) -> Outcome<Complex<f64>> {
    // A part may not exist for some parameters.
    let root = linear
        .root_near(part, expected)?
        .ok_or_else(|| lost(f64::NAN))?;
    let jump = (root - expected).norm();
    if jump < JUMP * expected.norm().max(linear.characteristic.slowest_rate()) {
        Ok(root)
    } else {
        Err(lost(jump))
    }
}

/// Families of linearisations with known roots.
#[cfg(test)]
pub(super) mod samples {
    use nalgebra::Vector3;

    use super::*;
    use crate::constitutive::LinearElastic;
    use crate::growth::{Ongoing, UniformGrowth};
    use crate::reference_element::Order;
    use crate::scene::Still;
    use crate::shoot::Shoot;
    use crate::tropism::{Declaration, Growing, Site, TropismLaw};

    /// A law whose growth gradient is a matrix times the strain at the same place, without delay.
    /// With REGR of 1/s the roots of a weightless shoot are the eigenvalues of the matrix.
    struct Matrix([[f64; 2]; 2]);

    impl TropismLaw for Matrix {
        fn declare(&self, to: &mut Declaration) {
            to.stimuli(2);
            to.with_present();
        }

        fn sense(&self, site: &Site, stimuli: &mut [f64]) {
            stimuli.copy_from_slice(&[site.strain.x, site.strain.y]);
        }

        fn gradient(&self, _at: &Growing, _past: &[f64], now: &[f64]) -> Vector3<f64> {
            let [first, second] = self.0.map(|row| row[0] * now[0] + row[1] * now[1]);
            Vector3::new(first, second, 0.0)
        }
    }

    pub(in crate::stability) fn linear(matrix: [[f64; 2]; 2], elements: usize) -> Linearisation {
        let shoot = Shoot::builder(LinearElastic {
            youngs_modulus: 1e7,
            poissons_ratio: 0.5,
        })
        .length(0.1)
        .radius(1e-3)
        .elements(elements)
        .order(Order::Four)
        .growth(Ongoing(UniformGrowth {
            zone_length: 0.2,
            time: 1.0,
        }))
        .tropism(Matrix(matrix))
        .scene(Still::weightless())
        .build()
        .unwrap();
        Linearisation::about(&shoot).unwrap()
    }

    /// A linearisation with the roots `root` and its conjugate.
    pub(in crate::stability) fn with_root(root: Complex<f64>) -> Linearisation {
        linear([[root.re, -root.im], [root.im, root.re]], 1)
    }

    /// The root of a family with two parameters, on the axis along the circle |p| = 1, and there at
    /// the frequency 2 + p1/2.
    pub(in crate::stability) fn circle(p: [f64; 2]) -> Complex<f64> {
        Complex::new(p[0] * p[0] + p[1] * p[1] - 1.0, 2.0 + 0.5 * p[0])
    }

    pub(in crate::stability) fn is_lost<T>(answer: &Outcome<T>) -> bool {
        matches!(
            answer,
            Err(StabilityError::NoConvergence {
                what: "root that is followed",
                ..
            })
        )
    }
}

#[cfg(test)]
mod tests;
