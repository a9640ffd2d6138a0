//! Parts of a shoot that have a characteristic function: a point, an element, and a block of
//! unknowns that couple with no others.
//!
//! Waves that are short compared with the shoot do not change the couple. What remains of M(λ) is
//! the strain at a point and the rotation of the frames above it, a Volterra operator, which has no
//! roots. Its discretisation has roots where |a| h is not small, with a the gain from rotation to
//! strain and h the length of an element. The characteristic function of a block is divided by
//! these.

use std::sync::Arc;

use nalgebra::{Complex, DMatrix};

use super::analytic::{Analytic, AnalyticSample, NOT_A_NUMBER, RESOLVED};
use super::characteristic::{CharacteristicMatrix, Transfers};
use super::transfer::ROUNDING;
use crate::linearisation::{AnalyticMatrix, StabilityError};

/// Largest logarithmic derivative of the function, in units of the inverse distance of its
/// singularities, that counts for the error of waves that are not resolved. It is larger only next
/// to a root, which the error moves.
const STEEP: f64 = 10.0;

/// The local matrix D(λ) = λ − T ∂x/∂u of the points of one kind, for components that couple:
/// infinitely short waves. These waves have no elastic strain and do not rotate the shoot, so that
/// a point senses its own intrinsic strain alone. The zeros of det D are in the essential spectrum.
#[derive(Debug, Clone)]
pub(super) struct LocalBlock {
    pub characteristic: Arc<CharacteristicMatrix>,
    pub kind: usize,
    pub components: Vec<usize>,
}

impl LocalBlock {
    /// D(λ), from T(λ) of its kind.
    pub fn matrix(&self, z: Complex<f64>, transfer: &AnalyticMatrix) -> AnalyticMatrix {
        let local = self.characteristic.transfers[self.kind]
            .local
            .select_columns(&self.components)
            .map(Complex::from);
        let mut out = AnalyticMatrix::lambda(z, self.components.len());
        out.value -= transfer.value.select_rows(&self.components) * &local;
        out.derivative -= transfer.derivative.select_rows(&self.components) * &local;
        out
    }
}

/// det A/bⁿ, with b = λ + c from [`shifted`](CharacteristicMatrix::shifted).
fn determinant_over_power(b: Complex<f64>, matrix: AnalyticMatrix) -> AnalyticSample {
    let n = matrix.value.nrows() as u32;
    let (value, log_derivative) = matrix.determinant();
    AnalyticSample {
        value: value / b.powu(n),
        log_derivative: log_derivative - b.inv() * f64::from(n),
        nearness: 0.0,
    }
}

impl Analytic for LocalBlock {
    /// det D/(λ + c)ⁿ, times the phases of Π (λ − rate)/(λ + c) over the own rates of the variables
    /// that enter D or grow. This cancels the poles of T, next to which zeros are hard to find.
    /// Poles lie right of the axis if variables grow without a stimulus. The moduli of the factors
    /// are omitted, since the product of many underflows.
    fn at(&self, z: Complex<f64>) -> AnalyticSample {
        let transfer = &self.characteristic.transfers[self.kind];
        let b = self.characteristic.shifted(z);
        let mut out = determinant_over_power(b, self.matrix(z, &transfer.at(z)));
        for rate in &transfer.local_rates {
            let factor = (z - rate) / b;
            out.value *= factor / factor.norm();
            out.log_derivative += (z - rate).inv() - b.inv();
        }
        out
    }

    fn characteristic(&self) -> &CharacteristicMatrix {
        &self.characteristic
    }
}

/// The matrix Mₑ of one element in a block, for a fixed frame at its start and a fixed elastic
/// strain. Its roots belong to the mesh.
#[derive(Debug, Clone)]
struct Element {
    /// The first point of the element.
    point: LocalBlock,
    unknowns: Vec<usize>,
    /// Length of the element, m.
    length: f64,
    /// Largest ∂stimuli/∂rotation of the frame at its points, 1/rad.
    turn: DMatrix<f64>,
}

impl Element {
    /// The element of some unknowns, all of which lie in it.
    fn new(characteristic: &Arc<CharacteristicMatrix>, unknowns: &[usize]) -> Self {
        let p = characteristic.points_per_element();
        let (point, _) = characteristic.unknowns[unknowns[0]];
        let here = unknowns
            .iter()
            .map(|&unknown| characteristic.unknowns[unknown])
            .take_while(|(i, _)| *i == point);
        let components = here.map(|(_, c)| c).collect();
        let turns = characteristic.turn[point / p * p..][..p].iter();
        let kind = characteristic.kind[point];
        Self {
            point: LocalBlock {
                characteristic: Arc::clone(characteristic),
                kind,
                components,
            },
            unknowns: unknowns.to_vec(),
            length: characteristic.lengths[point / p],
            turn: turns
                .max_by(|a, b| a.norm().total_cmp(&b.norm()))
                .cloned()
                .unwrap_or_default(),
        }
    }

    fn matrix(&self, transfers: &Transfers) -> AnalyticMatrix {
        let characteristic = &self.point.characteristic;
        characteristic.matrix(transfers, &characteristic.rigid_response, &self.unknowns)
    }

    /// Whether another element has the same matrix.
    fn equals(&self, other: &Self) -> bool {
        let ((places, response), (others, of_other)) = (self.shape(), other.shape());
        places == others && (&response - of_other).amax() <= ROUNDING * response.amax()
    }

    /// The place of each unknown in the element (point, component, and kind of the point), and the
    /// rigid response.
    fn shape(&self) -> (Vec<(usize, usize, usize)>, DMatrix<f64>) {
        let characteristic = &self.point.characteristic;
        let (p, m) = (characteristic.points_per_element(), characteristic.stimuli);
        let unknowns = self
            .unknowns
            .iter()
            .map(|&unknown| characteristic.unknowns[unknown]);
        let first = characteristic.unknowns[self.unknowns[0]].0 / p * p * m;
        let places = unknowns
            .map(|(i, c)| (i % p, c, characteristic.kind[i]))
            .collect();
        (
            places,
            characteristic
                .rigid_response
                .rows(first, p * m)
                .select_columns(&self.unknowns),
        )
    }

    /// The gain from rotation to strain, (λ − T ∂x/∂u)⁻¹ T ∂x/∂φ in 1/m, and the inverse matrix in
    /// it.
    fn gain(&self, (z, transfers): &Transfers) -> (DMatrix<Complex<f64>>, DMatrix<Complex<f64>>) {
        let driven = &self.point.components;
        let n = driven.len();
        let transfer = &transfers[self.point.kind];
        let own = self.point.matrix(*z, transfer).value.try_inverse();
        let own = own.unwrap_or_else(|| DMatrix::from_element(n, n, Complex::from(f64::INFINITY)));
        let turn = self.turn.select_columns(driven).map(Complex::from);
        (&own * (transfer.value.select_rows(driven) * turn), own)
    }

    /// The inverse distance of the essential spectrum, s.
    fn nearness(&self, (z, transfers): &Transfers) -> f64 {
        let AnalyticMatrix { value, derivative } =
            self.point.matrix(*z, &transfers[self.point.kind]);
        value
            .lu()
            .solve(&derivative)
            .map_or(f64::INFINITY, |quotient| quotient.norm())
    }
}

impl Analytic for Element {
    fn at(&self, z: Complex<f64>) -> AnalyticSample {
        let characteristic = &self.point.characteristic;
        let kind_of = |unknown: usize| characteristic.kind[characteristic.unknowns[unknown].0];
        let own = |kind: usize| {
            self.unknowns
                .iter()
                .any(|&unknown| kind_of(unknown) == kind)
        };
        let none = || AnalyticMatrix::lambda(z, 0);
        let kinds = characteristic.transfers.iter().enumerate();
        let transfers = kinds
            .map(|(kind, transfer)| if own(kind) { transfer.at(z) } else { none() })
            .collect();
        determinant_over_power(characteristic.shifted(z), self.matrix(&(z, transfers)))
    }

    fn characteristic(&self) -> &CharacteristicMatrix {
        &self.point.characteristic
    }
}

/// Unknowns that couple with no others, those of a plane of an upright shoot for example.
#[derive(Debug, Clone)]
pub(super) struct Block {
    pub characteristic: Arc<CharacteristicMatrix>,
    pub unknowns: Vec<usize>,
    /// Roots next to zero of rigid holds, which are removed.
    neutral: Vec<Complex<f64>>,
    /// Number of blocks with the same characteristic function, including this one; zero if an
    /// earlier one represents it.
    pub multiplicity: usize,
    /// Distinct elements of the block, and the number of each.
    elements: Vec<(Element, usize)>,
    /// Norm of the elastic part of its response to a rotation, relative to that of a rigid shoot;
    /// at most one. Next to buckling this ratio has no bound, but only the longest wave grows
    /// there.
    elasticity: f64,
}

impl Block {
    /// # Errors
    /// Roots next to zero that are not found.
    pub fn new(
        characteristic: &Arc<CharacteristicMatrix>,
        mut unknowns: Vec<usize>,
    ) -> Result<Self, StabilityError> {
        unknowns.sort_unstable();
        let p = characteristic.points_per_element();
        let element = |unknown: &usize| characteristic.unknowns[*unknown].0 / p;
        let mut elements: Vec<(Element, usize)> = Vec::new();
        for own in unknowns.chunk_by(|a, b| element(a) == element(b)) {
            let new = Element::new(characteristic, own);
            match elements.iter_mut().find(|(other, _)| other.equals(&new)) {
                Some((_, number)) => *number += 1,
                None => elements.push((new, 1)),
            }
        }
        let elasticity = elasticity(characteristic, &unknowns);
        let neutral = characteristic.neutral_roots(&unknowns)?;
        let characteristic = Arc::clone(characteristic);
        Ok(Self {
            characteristic,
            unknowns,
            neutral,
            multiplicity: 1,
            elements,
            elasticity,
        })
    }

    /// M(λ).
    pub fn matrix(&self, transfers: &Transfers) -> AnalyticMatrix {
        self.characteristic
            .matrix(transfers, &self.characteristic.response, &self.unknowns)
    }

    /// det M/Π det Mₑ. M consists of the Mₑ and a compact part, so that this quotient has a limit
    /// as the mesh is refined. The limit has only the isolated roots; those of short waves and of
    /// the mesh cancel. Roots next to zero are moved to −c, left of every line on which zeros are
    /// counted.
    fn quotient(&self, transfers: &Transfers) -> AnalyticSample {
        let &(z, _) = transfers;
        let (mut pivots, mut log_derivative) = self.matrix(transfers).pivots();
        for (root, pivot) in self.neutral.iter().zip(&mut pivots) {
            let b = self.characteristic.shifted(z);
            *pivot *= b / (z - root);
            log_derivative += b.inv() - (z - root).inv();
        }
        let mut nearness = 0.0_f64;
        let mut divisors = Vec::with_capacity(pivots.len());
        for (element, number) in &self.elements {
            let (own, own_derivative) = element.matrix(transfers).determinant();
            let size = element.unknowns.len();
            divisors.extend(std::iter::repeat_n(
                own.powf(1.0 / size as f64),
                size * number,
            ));
            log_derivative -= own_derivative * *number as f64;
            nearness = nearness.max(element.nearness(transfers));
        }
        // Determinants for many points overflow or underflow, but quotients of pivots do not.
        let value = pivots
            .iter()
            .zip(&divisors)
            .map(|(pivot, divisor)| pivot / divisor)
            .product();
        AnalyticSample {
            value,
            log_derivative,
            nearness,
        }
    }

    /// The short waves at λ, and the errors that they cause; `None` if the gain is not finite.
    ///
    /// They vary as exp(Gs), G the gain from rotation to strain, and Gauss collocation replaces
    /// exp(Gh) by its diagonal Padé approximant. Waves that are not resolved change the function by
    /// way of elasticity, which couples the far end of the shoot, where they have grown, to its
    /// base.
    fn short_waves(&self, transfers: &Transfers) -> Option<ShortWaves> {
        let p = self.characteristic.points_per_element() as u32;
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        let factor = factorial(p).powi(2) / (factorial(2 * p) * factorial(2 * p + 1));
        let (mut error, mut waves, mut growth, mut local) = (0.0, 0.0, 0.0, 0.0_f64);
        for (element, number) in &self.elements {
            let (gain, own) = element.gain(transfers);
            if !gain.iter().all(|x| x.is_finite()) {
                return None;
            }
            let (wave, number) = (gain.norm() * element.length, *number as f64);
            error += number * factor * wave.powi(2 * p as i32 + 1);
            waves += number * wave;
            let symmetric = (&gain + gain.adjoint()) * Complex::from(0.5 * element.length);
            growth += number * symmetric.symmetric_eigenvalues().max();
            local = local.max((own * transfers.0).norm());
        }
        // The amplification may overflow. The bound prevents 0 · ∞ for a shoot without elasticity.
        let share = self.elasticity * local * growth.exp().min(f64::MAX) / (waves * waves).max(1.0);
        Some(ShortWaves {
            error,
            exponent: waves,
            share,
        })
    }
}

/// The short waves of a block at λ.
struct ShortWaves {
    /// Sum of the relative errors of exp(Gh) over the elements.
    error: f64,
    /// Sum of |G| h over the elements.
    exponent: f64,
    /// Share of the characteristic function due to waves that have grown along the shoot, as
    /// estimated from their amplification.
    share: f64,
}

impl ShortWaves {
    /// The relative error of the characteristic function for a share due to waves that have grown
    /// along the shoot.
    fn error_for(&self, share: f64) -> f64 {
        let matters = self.error > 0.1 * RESOLVED / STEEP;
        if matters {
            share.min(STEEP) * self.error.min(1.0)
        } else {
            0.0
        }
    }

    /// The share as found on this mesh from a sample of the function. A term A exp(−κℓ) varies by
    /// |A κ'| ℓ, where κ' is of the size of κ over the distance to zero or to the essential
    /// spectrum, whichever is nearer.
    fn found(&self, z: Complex<f64>, at: &AnalyticSample) -> f64 {
        at.log_derivative.norm() / (at.nearness.max(1.0 / z.norm()) * self.exponent.max(1.0))
    }
}

impl Analytic for Block {
    fn at(&self, z: Complex<f64>) -> AnalyticSample {
        self.quotient(&self.characteristic.transfers_at(z))
    }

    fn with_mesh_error(&self, z: Complex<f64>) -> (AnalyticSample, f64) {
        let transfers = self.characteristic.transfers_at(z);
        let Some(waves) = self.short_waves(&transfers) else {
            return (NOT_A_NUMBER, f64::INFINITY);
        };
        // The function is not evaluated where the estimate alone exceeds the limit.
        let expected = waves.error_for(waves.share);
        if !(expected < RESOLVED) {
            return (NOT_A_NUMBER, expected);
        }
        let sample = self.quotient(&transfers);
        (
            sample,
            waves.error_for(waves.share.max(waves.found(z, &sample))),
        )
    }

    fn characteristic(&self) -> &CharacteristicMatrix {
        &self.characteristic
    }

    fn divisors(&self) -> Vec<&dyn Analytic> {
        self.elements
            .iter()
            .map(|(element, _)| element as &dyn Analytic)
            .collect()
    }
}

/// The norm of the elastic part of the response relative to the response of a rigid shoot to
/// rotations; at most one.
fn elasticity(characteristic: &CharacteristicMatrix, unknowns: &[usize]) -> f64 {
    let m = characteristic.stimuli;
    let share = |k: usize| {
        let (mut elastic, mut turned) = (0.0, 0.0);
        for &unknown in unknowns {
            let (j, c) = characteristic.unknowns[unknown];
            for i in 0..characteristic.kind.len() {
                let at = (i * m + k, unknown);
                let (x, rigid) = (
                    characteristic.response[at],
                    characteristic.rigid_response[at],
                );
                let own = if i == j {
                    characteristic.transfers[characteristic.kind[i]].local[(k, c)]
                } else {
                    0.0
                };
                elastic += (x - rigid).powi(2);
                turned += (rigid - own).powi(2);
            }
        }
        if turned > 0.0 {
            (elastic / turned).sqrt()
        } else {
            0.0
        }
    };
    (0..m).map(share).fold(0.0, f64::max).min(1.0)
}
