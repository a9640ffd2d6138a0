//! Harmonic balance: the laws at a material point under periodic stimuli.
//!
//! Stimuli and variables are trigonometric polynomials in the phase, given by their values on a
//! [`PhaseGrid`]. Newton's method solves ẏ = rates(y, x) for the periodic variables y. Floquet's
//! ansatz y(θ) exp(λt) gives the linear response to disturbances of the stimuli.

use nalgebra::{Complex, ComplexField, DMatrix, DVector, Vector3};

use super::error::CycleError;
use super::map::{PASSES, PRECISE, ROUNDING};
use super::phase_grid::PhaseGrid;
use crate::tropism::{Declaration, Growing, Size, TropismLaw, law_matrices};

/// A law under stimuli with a known angular frequency, on a grid of phases.
pub(super) struct HarmonicBalance<'a> {
    law: &'a dyn TropismLaw,
    phases: &'a PhaseGrid,
    /// Angular frequency, rad/s; negative if the phase decreases.
    rate: f64,
    laws: Declaration,
    /// Delay operator of each variable; none for variables that the gradient does not depend on.
    earlier: Vec<Option<DMatrix<f64>>>,
}

/// A point under periodic stimuli: its periodic variables, and the derivatives of its laws at all
/// phases.
pub(super) struct HarmonicPoint {
    /// Place of the point.
    pub at: Growing,
    /// Stimuli: a row for each stimulus, a column for each phase.
    pub stimuli: DMatrix<f64>,
    /// Variables: a row for each variable, a column for each phase.
    pub variables: DMatrix<f64>,
    rates_y: Vec<DMatrix<f64>>,
    rates_x: Vec<DMatrix<f64>>,
    /// Derivatives of the gradient at the first phase, by the delayed variables and by the present
    /// stimuli.
    read: [DMatrix<f64>; 2],
}

impl HarmonicPoint {
    /// Whether the laws have the same derivatives as at another point.
    pub fn is_like(&self, other: &Self) -> bool {
        let near = |(a, b): (&DMatrix<f64>, &DMatrix<f64>)| {
            (a - b).amax() <= ROUNDING * a.amax().max(b.amax())
        };
        let all = |a: &[DMatrix<f64>], b: &[DMatrix<f64>]| a.iter().zip(b).all(near);
        all(&self.rates_y, &other.rates_y)
            && all(&self.rates_x, &other.rates_x)
            && all(&self.read, &other.read)
    }
}

impl<'a> HarmonicBalance<'a> {
    pub fn new(law: &'a dyn TropismLaw, phases: &'a PhaseGrid, rate: f64) -> Self {
        let laws = Declaration::of(law);
        let delays = laws.variables().iter().map(|variable| variable.delay);
        let earlier = delays
            .map(|delay| delay.map(|delay| phases.earlier(rate * delay)))
            .collect();
        Self {
            law,
            phases,
            rate,
            laws,
            earlier,
        }
    }

    /// Solves for the periodic variables of a point under given stimuli, a column for each phase.
    pub fn solve(&self, at: Growing, stimuli: DMatrix<f64>) -> Result<HarmonicPoint, CycleError> {
        let (v, n) = (self.laws.size().variables, self.phases.len());
        let mut variables = DMatrix::zeros(v, n);
        for j in 0..n {
            self.law.steady(
                stimuli.column(j).as_slice(),
                variables.column_mut(j).as_mut_slice(),
            );
        }
        let (rates_y, rates_x, read) = Default::default();
        let mut point = HarmonicPoint {
            at,
            stimuli,
            variables,
            rates_y,
            rates_x,
            read,
        };
        if v == 0 {
            return Ok(self.read(point));
        }
        let mut last = f64::INFINITY;
        for _ in 0..PASSES {
            self.differentiate(&mut point);
            let mut residual = &point.variables * self.phases.derivative.transpose() * self.rate;
            let mut rates = DVector::zeros(v);
            for j in 0..n {
                let (y, x) = (point.variables.column(j), point.stimuli.column(j));
                self.law
                    .rates(y.as_slice(), x.as_slice(), rates.as_mut_slice());
                let mut column = residual.column_mut(j);
                column -= &rates;
            }
            let change = self
                .matrix(&point, 0.0_f64)
                .lu()
                .solve(&DVector::from_column_slice(residual.as_slice()));
            let change = change.filter(|change| change.iter().all(|x| x.is_finite()));
            let change = change.ok_or(CycleError::variables(PASSES, f64::INFINITY))?;
            point.variables -= DMatrix::from_column_slice(v, n, change.as_slice());
            let (size, moved) = (point.variables.amax(), change.amax());
            if moved <= PRECISE * size || (moved < 1e-9 * size && moved >= last) {
                return Ok(self.read(point));
            }
            last = moved;
        }
        Err(CycleError::variables(PASSES, last))
    }

    /// The converged variables with the derivatives of the laws.
    fn read(&self, mut point: HarmonicPoint) -> HarmonicPoint {
        self.differentiate(&mut point);
        let x = point.stimuli.column(0);
        let [.., by_variables, by_stimuli] =
            law_matrices(&self.law, &point.at, &self.past(&point, 0), x.as_slice());
        point.read = [by_variables, by_stimuli];
        point
    }

    /// The growth gradient of a point at a phase.
    pub fn gradient(&self, point: &HarmonicPoint, phase: usize) -> Vector3<f64> {
        let x = point.stimuli.column(phase);
        self.law.gradient(
            &point.at,
            &self.past(point, phase),
            self.laws.size().present(x.as_slice()),
        )
    }

    /// The delayed variables at a phase.
    fn past(&self, point: &HarmonicPoint, phase: usize) -> Vec<f64> {
        let read = |a: usize, earlier: &DMatrix<f64>| {
            (earlier.row(phase) * point.variables.row(a).transpose())[0]
        };
        self.earlier
            .iter()
            .enumerate()
            .map(|(a, earlier)| earlier.as_ref().map_or(0.0, |e| read(a, e)))
            .collect()
    }

    /// The response of the gradient at the first phase to stimuli δx exp(λt), and its derivative by
    /// λ: three rows, a column for each stimulus, phase by phase. None if the laws are singular.
    pub fn response(
        &self,
        point: &HarmonicPoint,
        z: Complex<f64>,
    ) -> Option<[DMatrix<Complex<f64>>; 2]> {
        let (
            Size {
                variables: v,
                stimuli: m,
                reads_present,
            },
            n,
        ) = (self.laws.size(), self.phases.len());
        let [gradient_y, gradient_x] = &point.read;
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
            let transposed = self.matrix(point, z).transpose().lu();
            let first = transposed.solve(&read)?;
            let second = transposed.solve(&(later - &first))?;
            for l in 0..n {
                let by_stimuli = point.rates_x[l].map(Complex::from);
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
    fn matrix<N: ComplexField<RealField = f64>>(&self, point: &HarmonicPoint, z: N) -> DMatrix<N> {
        let (v, n) = (self.laws.size().variables, self.phases.len());
        let mut out = DMatrix::from_diagonal_element(v * n, v * n, z);
        for j in 0..n {
            for l in 0..n {
                let slope = self.rate * self.phases.derivative[(j, l)];
                for a in 0..v {
                    out[(j * v + a, l * v + a)] += N::from_real(slope);
                }
            }
            for a in 0..v {
                for b in 0..v {
                    out[(j * v + a, j * v + b)] -= N::from_real(point.rates_y[j][(a, b)]);
                }
            }
        }
        out
    }

    /// Sets the derivatives of the rates at all phases.
    fn differentiate(&self, point: &mut HarmonicPoint) {
        let all = point
            .variables
            .column_iter()
            .zip(point.stimuli.column_iter());
        let each = all.map(|(y, x)| law_matrices(&self.law, &point.at, y.as_slice(), x.as_slice()));
        (point.rates_y, point.rates_x) = each
            .map(|[rates_y, rates_x, ..]| (rates_y, rates_x))
            .unzip();
    }
}
