//! Short waves: a point by itself, an element by itself.
//!
//! Waves that are short against everything leave the couple as it is. What is left of the linear problem is the strain at
//! a point and the turn of the frames above it, a Volterra operator, which has no roots of its own. Its discretisation
//! has some, where |a| h is not small, a the gain from turn to strain and h the length of an element. They are divided out.

use std::sync::Arc;

use nalgebra::{Complex, DMatrix};

use super::analytic::{Analytic, AnalyticMatrix, Sample, Scales};
use super::linear::{LinearProblem, Transfers};

/// Elements whose own problems differ by less than this share of their response are equal: rounding of the differences.
const EQUAL: f64 = 1e-8;

/// The local problem D(λ) = λ − T ∂x/∂u of the points of one kind, for components that couple: infinitely short waves.
/// Their elastic strain and their turn of the shoot vanish, so a point senses its own intrinsic strain alone. The zeros of
/// det D are in the essential spectrum.
#[derive(Debug, Clone)]
pub(super) struct LocalProblem {
    pub problem: Arc<LinearProblem>,
    pub kind: usize,
    pub components: Vec<usize>,
}

impl LocalProblem {
    /// D(λ), from T(λ) of its kind.
    pub fn matrix(&self, z: Complex<f64>, transfer: &AnalyticMatrix) -> AnalyticMatrix {
        let local = self.problem.transfers[self.kind].local.select_columns(&self.components).map(Complex::from);
        let mut out = AnalyticMatrix::lambda(z, self.components.len());
        out.value -= transfer.value.select_rows(&self.components) * &local;
        out.derivative -= transfer.derivative.select_rows(&self.components) * &local;
        out
    }
}

/// det A/(λ + c)ⁿ, −c left of every line that is counted on.
fn determinant_over_power(problem: &LinearProblem, z: Complex<f64>, matrix: AnalyticMatrix) -> Sample {
    let n = matrix.value.nrows() as u32;
    let c = shifted(problem, z);
    let (value, log_derivative) = matrix.determinant();
    Sample { value: value / c.powu(n), log_derivative: log_derivative - c.inv() * f64::from(n), nearness: 0.0 }
}

/// λ + c.
fn shifted(problem: &LinearProblem, z: Complex<f64>) -> Complex<f64> {
    z + Complex::from(problem.shift())
}

impl Analytic for LocalProblem {
    /// det D/(λ + c)ⁿ, times Π (λ − rate)/(λ + c) over the own rates of the variables that enter D or grow. This cancels the poles of
    /// T, next to which zeros are hard to find, and which lie on the right if variables grow without being driven. Only the phases of
    /// these factors are kept, since the product of many underflows.
    fn at(&self, z: Complex<f64>) -> Sample {
        let problem = &self.problem;
        let mut out = determinant_over_power(problem, z, self.matrix(z, &problem.transfers[self.kind].at(z)));
        let c = shifted(problem, z);
        for rate in &problem.transfers[self.kind].local_rates {
            let factor = (z - rate) / c;
            out.value *= factor / factor.norm();
            out.log_derivative += (z - rate).inv() - c.inv();
        }
        out
    }

    fn scales(&self) -> &dyn Scales {
        &*self.problem
    }
}

/// The own problem Mₑ of an element in a block: the frame at its start and its elastic strain are kept. Its roots belong to
/// the mesh.
#[derive(Debug, Clone)]
pub(super) struct Element {
    /// The local problem at its first point.
    local: LocalProblem,
    pub unknowns: Vec<usize>,
    /// Its length, m.
    pub length: f64,
    /// ∂stimuli/∂turn of the frame where that is largest, 1/rad.
    turn: DMatrix<f64>,
}

impl Element {
    /// That of some unknowns, all in one element.
    pub fn new(problem: &Arc<LinearProblem>, unknowns: &[usize]) -> Self {
        let p = problem.points_per_element();
        let (point, _) = problem.unknowns[unknowns[0]];
        let here = unknowns.iter().map(|&unknown| problem.unknowns[unknown]).take_while(|(i, _)| *i == point);
        let components = here.map(|(_, c)| c).collect();
        let turns = problem.turn[point / p * p..][..p].iter();
        Self {
            local: LocalProblem { problem: Arc::clone(problem), kind: problem.kind[point], components },
            unknowns: unknowns.to_vec(),
            length: problem.lengths[point / p],
            turn: turns.max_by(|a, b| a.norm().total_cmp(&b.norm())).cloned().unwrap_or_default(),
        }
    }

    pub fn matrix(&self, z: Complex<f64>, transfers: &Transfers) -> AnalyticMatrix {
        let problem = &self.local.problem;
        problem.matrix(z, transfers, &problem.rigid_response, &self.unknowns)
    }

    /// Whether an element has the same problem.
    pub fn equals(&self, other: &Self) -> bool {
        let ((places, response), (others, of_other)) = (self.shape(), other.shape());
        places == others && (&response - of_other).amax() <= EQUAL * response.amax()
    }

    /// Where its unknowns are in the element, their kinds, and their response.
    fn shape(&self) -> (Vec<(usize, usize, usize)>, DMatrix<f64>) {
        let problem = &self.local.problem;
        let p = problem.points_per_element();
        let unknowns = self.unknowns.iter().map(|&unknown| problem.unknowns[unknown]);
        let first = problem.unknowns[self.unknowns[0]].0 / p * p * problem.stimuli;
        let places = unknowns.map(|(i, c)| (i % p, c, problem.kind[i])).collect();
        let rows = problem.rigid_response.rows(first, p * problem.stimuli);
        (places, rows.select_columns(&self.unknowns))
    }

    /// The gain from turn to strain, (λ − T ∂x/∂u)⁻¹ T ∂x/∂φ in 1/m, and its first factor.
    pub fn gain(&self, z: Complex<f64>, transfers: &Transfers) -> (DMatrix<Complex<f64>>, DMatrix<Complex<f64>>) {
        let driven = &self.local.components;
        let n = driven.len();
        let own = self.local.matrix(z, &transfers[self.local.kind]).value.try_inverse();
        let own = own.unwrap_or_else(|| DMatrix::from_element(n, n, Complex::from(f64::INFINITY)));
        let turn = self.turn.select_columns(driven).map(Complex::from);
        (&own * (transfers[self.local.kind].value.select_rows(driven) * turn), own)
    }

    /// The inverse distance of the essential spectrum, s.
    pub fn nearness(&self, z: Complex<f64>, transfers: &Transfers) -> f64 {
        let AnalyticMatrix { value, derivative } = self.local.matrix(z, &transfers[self.local.kind]);
        value.lu().solve(&derivative).map_or(f64::INFINITY, |quotient| quotient.norm())
    }
}

impl Analytic for Element {
    fn at(&self, z: Complex<f64>) -> Sample {
        let problem = &self.local.problem;
        let own = |kind: usize| self.unknowns.iter().any(|&unknown| problem.kind[problem.unknowns[unknown].0] == kind);
        let none = || AnalyticMatrix::lambda(z, 0);
        let kinds = problem.transfers.iter().enumerate();
        let transfers = kinds.map(|(kind, transfer)| if own(kind) { transfer.at(z) } else { none() }).collect();
        determinant_over_power(problem, z, self.matrix(z, &transfers))
    }

    fn scales(&self) -> &dyn Scales {
        &*self.local.problem
    }
}
