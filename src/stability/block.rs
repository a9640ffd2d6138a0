//! A block of unknowns: its isolated roots, and whether the mesh resolves them.

use std::sync::Arc;

use nalgebra::Complex;

use super::analytic::{Analytic, AnalyticMatrix, RESOLVED, Sample, Scales};
use super::linear::{LinearProblem, Transfers};
use super::short_waves::Element;

/// Steeper than this the function is only next to a root, which the error moves.
const STEEP: f64 = 10.0;

/// The isolated roots of unknowns that couple with no others: those of a plane of an upright shoot, say.
#[derive(Debug, Clone)]
pub(super) struct Block {
    pub problem: Arc<LinearProblem>,
    pub unknowns: Vec<usize>,
    /// How many blocks have the same characteristic function, this one among them; zero if an earlier one stands for it.
    pub multiplicity: usize,
    /// Its elements that differ, and how many there are of each.
    elements: Vec<(Element, usize)>,
    /// The elastic share of its response to a turn: its norm relative to that of a rigid shoot. One at most: next to
    /// buckling it has no bound, but what grows there is the longest wave.
    elasticity: f64,
}

impl Block {
    pub fn new(problem: &Arc<LinearProblem>, mut unknowns: Vec<usize>) -> Self {
        unknowns.sort_unstable();
        let p = problem.points_per_element();
        let element = |unknown: &usize| problem.unknowns[*unknown].0 / p;
        let mut elements: Vec<(Element, usize)> = Vec::new();
        for own in unknowns.chunk_by(|a, b| element(a) == element(b)) {
            let new = Element::new(problem, own);
            match elements.iter_mut().find(|(other, _)| other.equals(&new)) {
                Some((_, number)) => *number += 1,
                None => elements.push((new, 1)),
            }
        }
        let elasticity = elasticity(problem, &unknowns);
        Self { problem: Arc::clone(problem), unknowns, multiplicity: 1, elements, elasticity }
    }

    /// M(λ).
    pub fn matrix(&self, z: Complex<f64>, transfers: &Transfers) -> AnalyticMatrix {
        self.problem.matrix(z, transfers, &self.problem.response, &self.unknowns)
    }

    /// det M/Π det Mₑ. M is the Mₑ and something compact, so this quotient has a limit as the mesh is refined, with the
    /// isolated roots only: those of the short waves and of the mesh drop out.
    fn quotient(&self, z: Complex<f64>, transfers: &Transfers) -> Sample {
        let (pivots, mut log_derivative) = self.matrix(z, transfers).pivots();
        let mut nearness = 0.0_f64;
        let mut divisors = Vec::with_capacity(pivots.len());
        for (element, number) in &self.elements {
            let (own, own_derivative) = element.matrix(z, transfers).determinant();
            let size = element.unknowns.len();
            divisors.extend(std::iter::repeat_n(own.powf(1.0 / size as f64), size * number));
            log_derivative -= own_derivative * *number as f64;
            nearness = nearness.max(element.nearness(z, transfers));
        }
        // Pivot by pivot, or the determinants of many points over- or underflow.
        let value = pivots.iter().zip(&divisors).map(|(pivot, divisor)| pivot / divisor).product();
        Sample { value, log_derivative, nearness }
    }

    /// By what share of itself the characteristic function may change at λ for the error of the short waves.
    ///
    /// They go as exp(Gs), G the gain from turn to strain, and Gauss collocation makes of exp(Gh) its diagonal Padé
    /// approximant. Waves that are not resolved matter as far as they show in the function: by elasticity, which couples
    /// the far end of the shoot, where they have grown, to its base.
    fn unresolved_share(&self, z: Complex<f64>, transfers: &Transfers, at: &Sample) -> f64 {
        let p = self.problem.points_per_element() as u32;
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        let factor = factorial(p).powi(2) / (factorial(2 * p) * factorial(2 * p + 1));
        let (mut error, mut waves, mut growth, mut local) = (0.0, 0.0, 0.0, 0.0_f64);
        for (element, number) in &self.elements {
            let (gain, own) = element.gain(z, transfers);
            if !gain.iter().all(|x| x.is_finite()) {
                return f64::INFINITY;
            }
            let (wave, number) = (gain.norm() * element.length, *number as f64);
            error += number * factor * wave.powi(2 * p as i32 + 1);
            waves += number * wave;
            let symmetric = (&gain + gain.adjoint()) * Complex::from(0.5 * element.length);
            growth += number * symmetric.symmetric_eigenvalues().max();
            local = local.max((own * z).norm());
        }
        if !(error > 0.1 * RESOLVED / STEEP) {
            return 0.0;
        }
        // The share that waves which have grown along the shoot can have of the function ...
        let expected = self.elasticity * local * growth.exp() / (waves * waves).max(1.0);
        // ... and the share that they have on this mesh: a part A exp(−κℓ) varies by |A κ'| ℓ, where κ' is of the
        // size of κ over the distance to zero or to the essential spectrum, whichever is nearer.
        let found = at.log_derivative.norm() / (at.nearness.max(1.0 / z.norm()) * waves.max(1.0));
        expected.max(found).min(STEEP) * f64::min(error, 1.0)
    }
}

impl Analytic for Block {
    fn at(&self, z: Complex<f64>) -> Sample {
        self.quotient(z, &self.problem.transfers_at(z))
    }

    fn with_unresolved_share(&self, z: Complex<f64>) -> (Sample, f64) {
        let transfers = self.problem.transfers_at(z);
        let sample = self.quotient(z, &transfers);
        (sample, self.unresolved_share(z, &transfers, &sample))
    }

    fn scales(&self) -> &dyn Scales {
        &*self.problem
    }

    fn divisors(&self) -> Vec<&dyn Analytic> {
        self.elements.iter().map(|(element, _)| element as &dyn Analytic).collect()
    }
}

/// The norm of what elasticity adds to the response of a rigid shoot, relative to that by way of the turn; at most one.
fn elasticity(problem: &LinearProblem, unknowns: &[usize]) -> f64 {
    let m = problem.stimuli;
    let share = |k: usize| {
        let (mut elastic, mut turned) = (0.0, 0.0);
        for &unknown in unknowns {
            let (j, c) = problem.unknowns[unknown];
            for i in 0..problem.kind.len() {
                let at = (i * m + k, unknown);
                let (x, rigid) = (problem.response[at], problem.rigid_response[at]);
                let own = if i == j { problem.transfers[problem.kind[i]].local[(k, c)] } else { 0.0 };
                elastic += (x - rigid).powi(2);
                turned += (rigid - own).powi(2);
            }
        }
        if turned > 0.0 { (elastic / turned).sqrt() } else { 0.0 }
    };
    (0..m).map(share).fold(0.0, f64::max).min(1.0)
}
