//! The characteristic matrix of small disturbances about a steady state.

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use super::analytic::Scales;
use super::transfer::TransferFunction;
use crate::equilibrium::NewtonSolver;
use crate::growth::GrowthLaw;
use crate::linear::{AnalyticMatrix, SteadyLaws, stimulus_derivatives, visit_bends, visit_stimuli};
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::{Rod, centre_line_tangent};
use crate::shoot::Shoot;
use crate::stability::error::StabilityError;
use crate::tropism::TropismLaw;

/// Largest number of operations for the laws' variables in one evaluation of the characteristic function: 300³, for 300
/// variables that depend on each other. A count then takes seconds.
const MOST_WORK: f64 = 2.7e7;

/// T(λ) of each kind of point.
pub(super) type Transfers = Vec<AnalyticMatrix>;

/// The characteristic matrix M(λ) = λ − T(λ) X of M(λ) δu* = 0. It is never changed.
#[derive(Debug)]
pub(super) struct CharacteristicMatrix {
    /// Distinct transfer functions, and the index of the one of each material point of the growth zone.
    pub transfers: Vec<TransferFunction>,
    pub kind: Vec<usize>,
    /// The unknowns: material point and component of its intrinsic strain.
    pub unknowns: Vec<(usize, usize)>,
    /// X: rows (point, stimulus), columns unknowns.
    pub response: DMatrix<f64>,
    /// X of a rigid shoot, of which only the strain at a point changes, and with it the frames beyond.
    pub rigid_response: DMatrix<f64>,
    /// Displacement of the ends of the elements (3 rows each) due to each unknown, m per 1/m.
    pub displacement: DMatrix<f64>,
    /// The tangent of the apex, in the fixed frame.
    pub apex_tangent: Vector3<f64>,
    /// ∂stimuli/∂rotation of the frame at each point, about the directors, 1/rad.
    pub turn: Vec<DMatrix<f64>>,
    /// Lengths of the elements of the growth zone, m.
    pub lengths: Vec<f64>,
    pub stimuli: usize,
    /// The size of every stimulus: the largest norm of its rows in both responses and in the derivatives at a point.
    sizes: DVector<f64>,
}

impl CharacteristicMatrix {
    /// Linearises `shoot` about `rod`, which is in equilibrium and whose laws are in a steady state. Their gradients need not
    /// vanish. The solver computes the response of the equilibrium.
    ///
    /// # Errors
    /// Laws that steer nothing, too many variables, or derivatives that are not finite.
    pub fn about(
        shoot: &Shoot<impl Model>,
        rod: &Rod,
        steady: &SteadyLaws,
        force: &InternalForce,
        solver: &mut NewtonSolver,
    ) -> Result<Self, StabilityError> {
        let (strain, turn) = stimulus_derivatives(shoot, rod, force);
        let law = shoot.model.tropism();
        let stimuli = law.size().stimuli;
        let mut transfers: Vec<TransferFunction> = Vec::new();
        let mut kind = Vec::with_capacity(strain.len());
        let mut work = 0.0;
        for (i, (place, local)) in steady.places.iter().zip(&strain).enumerate() {
            let rate = shoot.model.growth().regr(place.apex_distance, place.time);
            let mut transfer = TransferFunction::of(law, rate, steady, i, local)?;
            let known = transfers.iter().position(|other| other.is_like(&transfer));
            kind.push(known.unwrap_or(transfers.len()));
            if known.is_none() {
                let (variables, operations) = transfer.work();
                work += operations;
                if work > MOST_WORK {
                    return Err(StabilityError::TooManyVariables { variables, operations: work, most: MOST_WORK });
                }
                transfer.find_own_rates()?;
                transfers.push(transfer);
            }
        }
        let driven: Vec<Vec<usize>> = transfers.iter().map(TransferFunction::driven).collect();
        let unknowns: Vec<(usize, usize)> =
            kind.iter().enumerate().flat_map(|(i, &kind)| driven[kind].iter().map(move |&c| (i, c))).collect();
        if unknowns.is_empty() {
            return Err(StabilityError::NothingDriven);
        }
        let (response, displacement) = respond(shoot, rod, &unknowns, force, solver)?;
        let rigid_response = respond_rigidly(rod, &unknowns, &strain, &turn);
        let responses: Vec<&DMatrix<f64>> =
            [&response, &rigid_response].into_iter().chain(transfers.iter().map(|t| &t.local)).collect();
        let sizes = sizes(stimuli, &responses);
        let lengths = (rod.first_growing()..rod.elements()).map(|e| rod.element_length(e)).collect();
        let apex_tangent = rod.apex_frame() * centre_line_tangent();
        Ok(Self {
            transfers,
            kind,
            unknowns,
            response,
            rigid_response,
            displacement,
            apex_tangent,
            turn,
            lengths,
            stimuli,
            sizes,
        })
    }

    /// Number of material points in an element.
    pub fn points_per_element(&self) -> usize {
        self.kind.len() / self.lengths.len()
    }

    /// T(λ) of every kind of point.
    pub fn transfers_at(&self, z: Complex<f64>) -> Transfers {
        self.transfers.iter().map(|transfer| transfer.at(z)).collect()
    }

    /// λ − T X for some unknowns, with either response X.
    pub fn matrix(
        &self,
        z: Complex<f64>,
        transfers: &Transfers,
        response: &DMatrix<f64>,
        unknowns: &[usize],
    ) -> AnalyticMatrix {
        let mut out = AnalyticMatrix::lambda(z, unknowns.len());
        for (row, &unknown) in unknowns.iter().enumerate() {
            let (i, c) = self.unknowns[unknown];
            let transfer = &transfers[self.kind[i]];
            for k in 0..self.stimuli {
                let (t, dt) = (transfer.value[(c, k)], transfer.derivative[(c, k)]);
                if t == Complex::ZERO && dt == Complex::ZERO {
                    continue;
                }
                for (column, &other) in unknowns.iter().enumerate() {
                    let x = response[(i * self.stimuli + k, other)];
                    out.value[(row, column)] -= t * x;
                    out.derivative[(row, column)] -= dt * x;
                }
            }
        }
        out
    }

    /// The change of the unknowns after which the gradients of the laws vanish, to first order: T(0) X times the change is
    /// −REGR times the gradients.
    pub fn steady_step(&self, steady: &SteadyLaws) -> Option<DVector<f64>> {
        let all: Vec<usize> = (0..self.unknowns.len()).collect();
        let matrix = self.matrix(Complex::ZERO, &self.transfers_at(Complex::ZERO), &self.response, &all);
        let residual = DVector::from_fn(all.len(), |k, _| {
            let (i, c) = self.unknowns[k];
            steady.gradients[i][c] * self.transfers[self.kind[i]].rate
        });
        // M(0) = −T(0) X.
        matrix.value.map(|z| z.re).lu().solve(&residual)
    }

    /// Moduli of the laws' own rates, and the inverse delays, 1/s.
    fn rates(&self) -> impl Iterator<Item = f64> {
        let delays = self.transfers.iter().flat_map(|t| &t.delays).map(|d| 1.0 / d);
        let rates = self.transfers.iter().flat_map(|t| &t.own_rates).map(|rate| rate.norm());
        delays.chain(rates).filter(|rate| *rate > 0.0 && rate.is_finite())
    }

    /// The line left of which no roots are sought, 1/s: nine tenths of the way to the laws' own rates, where T has poles.
    pub fn leftmost(&self) -> f64 {
        let rates = self.transfers.iter().flat_map(|t| &t.own_rates).map(|rate| rate.re);
        0.9 * rates.filter(|r| *r < 0.0).fold(f64::NEG_INFINITY, f64::max).max(-1e3 * self.slowest_rate())
    }

    /// The distance from the axis of a point left of every line on which roots are counted, 1/s.
    pub fn shift(&self) -> f64 {
        self.slowest_rate() - 2.0 * self.leftmost()
    }

    /// Some λ at which functions that differ have different values: between the slowest and the fastest rate of the laws,
    /// off the axes.
    pub fn probes(&self) -> Vec<Complex<f64>> {
        let slow = self.slowest_rate();
        let fast = self.rates().fold(slow, f64::max);
        // There are two, and one more for every factor of ten between these rates.
        let decades = (fast / slow).log10().ceil().clamp(0.0, 12.0) as usize;
        let at = |k: usize| {
            let size = slow * (fast / slow).powf(k as f64 / (decades + 1) as f64);
            // Arguments without a pattern.
            Complex::from_polar(size, 0.4 + 0.13 * k as f64)
        };
        (0..=decades + 1).map(at).collect()
    }
}

impl Scales for CharacteristicMatrix {
    /// A radius outside which there is no root with Re λ ≥ `abscissa`: there |λ| exceeds the norm of T(λ) X. The bound holds
    /// for the whole shoot, for an element and for a point. Stimuli and variables are measured in units of their sizes, since
    /// laws have units of their own.
    fn bound(&self, abscissa: f64) -> f64 {
        let radii = self.transfers.iter().map(|transfer| transfer.radius(&self.sizes, abscissa));
        // At eight times this radius, where a count ends, the argument of the factors (λ − rate)/(λ + c) of a local matrix is less
        // than a radian.
        let turn = |rates: &Vec<Complex<f64>>| rates.iter().map(|rate| (rate + self.shift()).norm()).sum::<f64>() / 8.0;
        let turns = self.transfers.iter().map(|transfer| turn(&transfer.local_rates));
        1.001 * radii.chain(turns).fold(0.0, f64::max).max(self.smallest_modulus())
    }

    /// The inverse of the longest time in the laws' rates and delays, 1/s.
    fn slowest_rate(&self) -> f64 {
        let slowest = self.rates().fold(f64::INFINITY, f64::min);
        if slowest.is_finite() { slowest } else { self.transfers.iter().map(|t| t.rate).fold(1e-300, f64::max) }
    }
}

/// The largest norm of the rows of each stimulus.
fn sizes(stimuli: usize, responses: &[&DMatrix<f64>]) -> DVector<f64> {
    let size = |of: &DMatrix<f64>, k: usize| {
        (k..of.nrows()).step_by(stimuli).map(|row| of.row(row).norm_squared()).sum::<f64>().sqrt()
    };
    DVector::from_fn(stimuli, |k, _| responses.iter().map(|of| size(of, k)).fold(0.0, f64::max))
}

/// X and the displacements. Frames follow from the factorised tangent, stimuli and positions by central differences.
fn respond(
    shoot: &Shoot<impl Model>,
    rod: &Rod,
    unknowns: &[(usize, usize)],
    force: &InternalForce,
    solver: &mut NewtonSolver,
) -> Result<(DMatrix<f64>, DMatrix<f64>), StabilityError> {
    let m = shoot.model.tropism().size().stimuli;
    let mut response: DMatrix<f64> = DMatrix::zeros(rod.zone().len() * m, unknowns.len());
    let mut displacement: DMatrix<f64> = DMatrix::zeros(3 * (rod.elements() + 1), unknowns.len());
    visit_bends(shoot, rod, force, solver, unknowns.iter().copied(), |j, weight, moved| {
        visit_stimuli(shoot, moved, force, |i, _, stimuli| {
            for (sum, x) in response.column_mut(j).as_mut_slice()[i * m..].iter_mut().zip(stimuli) {
                *sum += weight * x;
            }
        });
        for (k, (_, position)) in moved.centre_line().iter().enumerate() {
            let mut rows = displacement.fixed_view_mut::<3, 1>(3 * k, j);
            rows += position * weight;
        }
    })?;
    if response.iter().all(|x| x.is_finite()) {
        Ok((response, displacement))
    } else {
        Err(StabilityError::NotFinite { what: "response of the stimuli" })
    }
}

/// X of a rigid shoot: a bend rotates all frames beyond it.
fn respond_rigidly(
    rod: &Rod,
    unknowns: &[(usize, usize)],
    strain: &[DMatrix<f64>],
    turn: &[DMatrix<f64>],
) -> DMatrix<f64> {
    let (p, first, reference) = (rod.order().points(), rod.first_growing(), rod.reference());
    let m = turn.first().map_or(0, DMatrix::nrows);
    let frames: Vec<_> = (0..turn.len()).map(|i| rod.frame_at_point(first + i / p, i % p)).collect();
    let mut out = DMatrix::zeros(turn.len() * m, unknowns.len());
    for (column, &(j, c)) in unknowns.iter().enumerate() {
        let axis = frames[j] * Vector3::ith(c, rod.points()[first * p + j].jacobian);
        // Rows begin at the first point of its element.
        for i in j / p * p..turn.len() {
            let weight = if i / p == j / p { reference.upto[i % p][j % p] } else { reference.weights[j % p] };
            let about_directors = frames[i].inverse() * axis * weight;
            out.view_mut((i * m, column), (m, 1)).gemm(1.0, &turn[i], &about_directors, 0.0);
        }
        let mut own = out.view_mut((j * m, column), (m, 1));
        own += strain[j].column(c);
    }
    out
}
