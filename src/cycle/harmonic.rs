//! Harmonic balance: the laws at a material point under periodic stimuli.
//!
//! Stimuli and variables are trigonometric polynomials in the phase, given by their values on a [`PhaseGrid`].
//! Newton's method solves ẏ = rates(y, x) for the periodic variables y. Floquet's ansatz y(θ) exp(λt) gives the
//! linear response to disturbances of the stimuli.

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use super::error::CycleError;
use super::map::{PASSES, PRECISE, ROUNDING};
use super::phase_grid::PhaseGrid;
use crate::tropism::{Declaration, Growing, Size, TropismLaw, law_matrices};

/// A law under stimuli with a known angular frequency, on a grid of phases.
pub(super) struct HarmonicBalance<'a, T> {
    law: &'a T,
    phases: &'a PhaseGrid,
    /// Angular frequency, rad/s; negative if the phase decreases.
    rate: f64,
    laws: Declaration,
    /// Delay operator of each variable; none for variables that the gradient does not depend on.
    earlier: Vec<Option<DMatrix<f64>>>,
}

/// The periodic variables of a point, and the derivatives of its laws at all phases.
pub(super) struct HarmonicVariables {
    /// Values: a row for each variable, a column for each phase.
    pub variables: DMatrix<f64>,
    rates_y: Vec<DMatrix<f64>>,
    rates_x: Vec<DMatrix<f64>>,
    /// Derivatives of the gradient at the first phase, by the delayed variables and by the present stimuli.
    read: [DMatrix<f64>; 2],
}

impl HarmonicVariables {
    /// Whether the laws have the same derivatives as at another point.
    pub fn is_like(&self, other: &Self) -> bool {
        let near = |(a, b): (&DMatrix<f64>, &DMatrix<f64>)| (a - b).amax() <= ROUNDING * a.amax().max(b.amax());
        let all = |a: &[DMatrix<f64>], b: &[DMatrix<f64>]| a.iter().zip(b).all(near);
        all(&self.rates_y, &other.rates_y) && all(&self.rates_x, &other.rates_x) && all(&self.read, &other.read)
    }
}

impl<'a, T: TropismLaw> HarmonicBalance<'a, T> {
    pub fn new(law: &'a T, phases: &'a PhaseGrid, rate: f64) -> Self {
        let laws = Declaration::of(law);
        let delays = laws.variables().iter().map(|variable| variable.delay);
        let earlier = delays.map(|delay| delay.map(|delay| phases.earlier(rate * delay))).collect();
        Self { law, phases, rate, laws, earlier }
    }

    /// Solves for the periodic variables under given stimuli, a column for each phase.
    pub fn solve(&self, at: &Growing, stimuli: &DMatrix<f64>) -> Result<HarmonicVariables, CycleError> {
        let (v, n) = (self.laws.size().variables, self.phases.len());
        let mut variables = DMatrix::zeros(v, n);
        for j in 0..n {
            self.law.steady(stimuli.column(j).as_slice(), variables.column_mut(j).as_mut_slice());
        }
        let mut periodic =
            HarmonicVariables { variables, rates_y: Vec::new(), rates_x: Vec::new(), read: Default::default() };
        if v == 0 {
            return Ok(self.read(at, stimuli, periodic));
        }
        let mut last = f64::INFINITY;
        for _ in 0..PASSES {
            self.differentiate(at, stimuli, &mut periodic);
            let mut residual = &periodic.variables * self.phases.derivative.transpose() * self.rate;
            let mut rates = DVector::zeros(v);
            for j in 0..n {
                self.law.rates(
                    periodic.variables.column(j).as_slice(),
                    stimuli.column(j).as_slice(),
                    rates.as_mut_slice(),
                );
                let mut column = residual.column_mut(j);
                column -= &rates;
            }
            let change =
                self.matrix(&periodic, 0.0_f64, |x| x).lu().solve(&DVector::from_column_slice(residual.as_slice()));
            let change = change.filter(|change| change.iter().all(|x| x.is_finite()));
            let change = change.ok_or(CycleError::variables(PASSES, f64::INFINITY))?;
            periodic.variables -= DMatrix::from_column_slice(v, n, change.as_slice());
            let (size, moved) = (periodic.variables.amax(), change.amax());
            if moved <= PRECISE * size || (moved < 1e-9 * size && moved >= last) {
                return Ok(self.read(at, stimuli, periodic));
            }
            last = moved;
        }
        Err(CycleError::variables(PASSES, last))
    }

    /// Solves for the periodic variables of several points.
    pub fn solve_all(
        &self,
        places: &[Growing],
        stimuli: &[DMatrix<f64>],
    ) -> Result<Vec<HarmonicVariables>, CycleError> {
        places.iter().zip(stimuli).map(|(at, stimuli)| self.solve(at, stimuli)).collect()
    }

    /// The converged variables with the derivatives of the laws.
    fn read(&self, at: &Growing, stimuli: &DMatrix<f64>, mut periodic: HarmonicVariables) -> HarmonicVariables {
        self.differentiate(at, stimuli, &mut periodic);
        let past = self.past(&periodic, 0);
        let [_, _, by_variables, by_stimuli] = law_matrices(self.law, at, &past, stimuli.column(0).as_slice());
        periodic.read = [by_variables, by_stimuli];
        periodic
    }

    /// The growth gradients of several points at a phase.
    pub fn gradients(
        &self,
        places: &[Growing],
        periodic: &[HarmonicVariables],
        stimuli: &[DMatrix<f64>],
        phase: usize,
    ) -> Vec<Vector3<f64>> {
        let all = places.iter().zip(periodic).zip(stimuli.iter().map(|stimuli| stimuli.column(phase)));
        let size = self.laws.size();
        all.map(|((at, y), x)| self.law.gradient(at, &self.past(y, phase), size.present(x.as_slice()))).collect()
    }

    /// The delayed variables at a phase.
    fn past(&self, periodic: &HarmonicVariables, phase: usize) -> Vec<f64> {
        let read = |a: usize, earlier: &DMatrix<f64>| (earlier.row(phase) * periodic.variables.row(a).transpose())[0];
        self.earlier.iter().enumerate().map(|(a, earlier)| earlier.as_ref().map_or(0.0, |e| read(a, e))).collect()
    }

    /// The response of the gradient at the first phase to stimuli δx exp(λt), and its derivative by λ: three rows,
    /// a column for each stimulus, phase by phase. None if the laws are singular.
    pub fn response(&self, periodic: &HarmonicVariables, z: Complex<f64>) -> Option<[DMatrix<Complex<f64>>; 2]> {
        let (Size { variables: v, stimuli: m, reads_present }, n) = (self.laws.size(), self.phases.len());
        let [gradient_y, gradient_x] = &periodic.read;
        let mut read = DMatrix::zeros(v * n, 3);
        let mut later = read.clone();
        for (a, earlier) in self.earlier.iter().enumerate() {
            let Some(earlier) = earlier else { continue };
            let delay = self.laws.variables()[a].delay.unwrap_or(0.0);
            let lag = (-z * delay).exp();
            for l in 0..n {
                for c in 0..3 {
                    let value = lag * (gradient_y[(c, a)] * earlier[(0, l)]);
                    read[(l * v + a, c)] = value;
                    later[(l * v + a, c)] = -value * delay;
                }
            }
        }
        let [mut value, mut derivative] = [DMatrix::zeros(3, m * n), DMatrix::zeros(3, m * n)];
        if v > 0 {
            let transposed = self.matrix(periodic, z, Complex::from).transpose().lu();
            let first = transposed.solve(&read)?;
            let second = transposed.solve(&(later - &first))?;
            for l in 0..n {
                let by_stimuli = periodic.rates_x[l].map(Complex::from);
                let part = |of: &DMatrix<Complex<f64>>| of.rows(l * v, v).transpose() * &by_stimuli;
                value.columns_mut(l * m, m).copy_from(&part(&first));
                derivative.columns_mut(l * m, m).copy_from(&part(&second));
            }
        }
        if reads_present {
            let mut first = value.columns_mut(0, m);
            first += gradient_x.map(Complex::from);
        }
        Some([value, derivative])
    }

    /// The matrix λ + d/dt − ∂rates/∂y on all phases.
    fn matrix<N: nalgebra::ComplexField>(
        &self,
        periodic: &HarmonicVariables,
        z: N,
        of: impl Fn(f64) -> N,
    ) -> DMatrix<N> {
        let (v, n) = (self.laws.size().variables, self.phases.len());
        let mut out = DMatrix::from_diagonal_element(v * n, v * n, z);
        for j in 0..n {
            for l in 0..n {
                let slope = self.rate * self.phases.derivative[(j, l)];
                for a in 0..v {
                    out[(j * v + a, l * v + a)] += of(slope);
                }
            }
            for a in 0..v {
                for b in 0..v {
                    out[(j * v + a, j * v + b)] -= of(periodic.rates_y[j][(a, b)]);
                }
            }
        }
        out
    }

    /// Sets the derivatives of the rates at all phases.
    fn differentiate(&self, at: &Growing, stimuli: &DMatrix<f64>, periodic: &mut HarmonicVariables) {
        let all = periodic.variables.column_iter().zip(stimuli.column_iter());
        let each = all.map(|(y, x)| law_matrices(self.law, at, y.as_slice(), x.as_slice()));
        (periodic.rates_y, periodic.rates_x) = each.map(|[rates_y, rates_x, ..]| (rates_y, rates_x)).unzip();
    }
}
