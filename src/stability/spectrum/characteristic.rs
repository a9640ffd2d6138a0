//! The characteristic matrix of small disturbances about a steady state.

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use super::transfer::TransferFunction;
use crate::error::ensure;
use crate::linearisation::{
    AnalyticMatrix, Outcome, StabilityError, SteadyLaws, eigenvalues, rigid_conditions,
    stimulus_derivatives, visit_bends, visit_stimuli,
};
use crate::load::{InternalForce, Load};
use crate::model::{Model, Support};
use crate::numerics::scalar::sort_by_value;
use crate::rod::{Rod, centre_line_tangent};
use crate::shoot::Shoot;
use crate::tropism::{Growing, TropismLaw};

/// Largest number of operations for the variables of the laws in one evaluation of the
/// characteristic function: 300³, that of 300 variables that depend on each other. A count then
/// takes seconds.
const MOST_WORK: f64 = 2.7e7;

/// Largest singular value of M(0), relative to the largest of all, and largest root, relative to
/// the slowest rate of the laws, that are zero but for the error of the discretisation. With two
/// elements for a bend of one radian they are 4e-6.
const NEUTRAL: f64 = 1e-5;

/// λ, and T(λ) of each kind of point.
pub(super) type Transfers = (Complex<f64>, Vec<AnalyticMatrix>);

/// The characteristic matrix M(λ) = λ − T(λ) X of M(λ) δu* = 0.
#[derive(Debug)]
pub(in crate::stability) struct CharacteristicMatrix {
    /// Distinct transfer functions, and the index of the one of each material point of the growth
    /// zone.
    pub transfers: Vec<TransferFunction>,
    pub kind: Vec<usize>,
    /// Unknowns: the material point, and the component of its intrinsic strain.
    pub unknowns: Vec<(usize, usize)>,
    /// X: rows (point, stimulus), columns unknowns.
    pub response: DMatrix<f64>,
    /// X of a rigid shoot: only the strain at a point changes, and the frames beyond it.
    pub rigid_response: DMatrix<f64>,
    /// Displacement of the ends of the elements (3 rows each) due to each unknown, m per 1/m.
    pub displacement: DMatrix<f64>,
    /// The tangent of the apex, in the fixed frame.
    pub apex_tangent: Vector3<f64>,
    /// ∂stimuli/∂rotation of the frame at each point, about the directors, 1/rad.
    pub turn: Vec<DMatrix<f64>>,
    /// Lengths of the elements of the growth zone, m.
    pub lengths: Vec<f64>,
    /// Number of stimuli at a point.
    pub stimuli: usize,
    /// Number of rigid conditions of the support.
    conditions: usize,
    /// Size of every stimulus: the largest norm of its rows in both responses and in the
    /// derivatives at a point.
    sizes: DVector<f64>,
}

impl CharacteristicMatrix {
    /// Linearises `shoot` about `rod`, which is in equilibrium under a load and with a support, and
    /// whose laws are in a steady state. Their gradients need not vanish. `regr` returns the REGR
    /// at a point, 1/s.
    ///
    /// # Errors
    /// Laws without differential growth, too many variables, or derivatives that are not finite.
    pub fn about(
        shoot: &Shoot<impl Model>,
        rod: &Rod,
        statics: (&impl Load, &impl Support),
        regr: impl Fn(&Growing) -> f64,
        (steady, force): (&SteadyLaws, &InternalForce),
    ) -> Result<Self, StabilityError> {
        let (strain, turn) = stimulus_derivatives(shoot, rod, force);
        let law = shoot.model.tropism();
        let stimuli = law.size().stimuli;
        let mut transfers: Vec<TransferFunction> = Vec::new();
        let mut kind = Vec::with_capacity(strain.len());
        let mut work = 0.0;
        for (i, (place, local)) in steady.places.iter().zip(&strain).enumerate() {
            let mut transfer = TransferFunction::of(law, regr(place), steady, i, local)?;
            let known = transfers.iter().position(|other| other.is_like(&transfer));
            kind.push(known.unwrap_or(transfers.len()));
            if known.is_none() {
                work += transfer.work();
                let what = "operations for variables of the laws that depend on each other";
                ensure(
                    work <= MOST_WORK,
                    StabilityError::TooMuchWork {
                        what,
                        amount: work,
                        most: MOST_WORK,
                    },
                )?;
                transfer.find_own_rates()?;
                transfers.push(transfer);
            }
        }
        let of_point =
            |(i, &kind): (usize, &usize)| transfers[kind].driven().into_iter().map(move |c| (i, c));
        let unknowns: Vec<_> = kind.iter().enumerate().flat_map(of_point).collect();
        ensure(!unknowns.is_empty(), StabilityError::NothingDriven)?;
        let (response, displacement) = respond(shoot, rod, statics, &unknowns, force)?;
        let rigid_response = respond_rigidly(rod, &unknowns, [&strain, &turn]);
        let size = |of: &DMatrix<f64>, k: usize| {
            (k..of.nrows())
                .step_by(stimuli)
                .map(|row| of.row(row).norm_squared())
                .sum::<f64>()
                .sqrt()
        };
        let responses = || {
            [&response, &rigid_response]
                .into_iter()
                .chain(transfers.iter().map(|t| &t.local))
        };
        let sizes = DVector::from_fn(stimuli, |k, _| {
            responses().map(|of| size(of, k)).fold(0.0, f64::max)
        });
        let lengths = (rod.first_growing..rod.elements())
            .map(|e| rod.length_of(e))
            .collect();
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
            conditions: rigid_conditions(statics.1, force.environment().time),
            sizes,
        })
    }

    /// Number of elements in the growth zone.
    pub fn elements(&self) -> usize {
        self.lengths.len()
    }

    /// Number of material points in an element.
    pub fn points_per_element(&self) -> usize {
        self.kind.len() / self.elements()
    }

    /// T(λ) of every kind of point.
    pub fn transfers_at(&self, z: Complex<f64>) -> Transfers {
        (
            z,
            self.transfers
                .iter()
                .map(|transfer| transfer.at(z))
                .collect(),
        )
    }

    /// M(λ) for all unknowns.
    pub fn whole(&self, z: Complex<f64>) -> DMatrix<Complex<f64>> {
        let all: Vec<usize> = (0..self.unknowns.len()).collect();
        self.matrix(&self.transfers_at(z), &self.response, &all)
            .value
    }

    /// λ − T X for some unknowns, with either response X.
    pub fn matrix(
        &self,
        (z, transfers): &Transfers,
        response: &DMatrix<f64>,
        unknowns: &[usize],
    ) -> AnalyticMatrix {
        let mut out = AnalyticMatrix::lambda(*z, unknowns.len());
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

    /// The roots of some unknowns next to zero, 1/s, at most as many as the rigid holds have
    /// conditions: the eigenvalues of M(0) + λ M'(0). Zero is exact, and these are its
    /// approximations on the mesh.
    ///
    /// # Errors
    /// Eigenvalues that do not converge.
    pub fn neutral_roots(&self, unknowns: &[usize]) -> Result<Vec<Complex<f64>>, StabilityError> {
        if self.conditions == 0 {
            return Ok(Vec::new());
        }
        let at_zero = self.matrix(&self.transfers_at(Complex::ZERO), &self.response, unknowns);
        let AnalyticMatrix { value, derivative } = at_zero;
        let quotient = derivative.map(|z| z.re).lu().solve(&value.map(|z| -z.re));
        let quotient = quotient.filter(|quotient| quotient.iter().all(|x| x.is_finite()));
        let quotient = quotient.ok_or(StabilityError::NotFinite {
            what: "characteristic matrix at zero",
        })?;
        let mut roots = eigenvalues(&quotient, "roots next to zero")?;
        sort_by_value(&mut roots, |root| root.norm());
        roots.truncate(self.conditions);
        roots.retain(|root| root.norm() < NEUTRAL * self.slowest_rate());
        Ok(roots)
    }

    /// The change of the unknowns after which the gradients of the laws vanish, to first order:
    /// T(0) X times the change is −REGR times the gradients. With rigid holds it is the smallest
    /// such change, since others differ from it in the reactions only.
    pub fn steady_step(&self, steady: &SteadyLaws) -> Option<DVector<f64>> {
        let residual = DVector::from_fn(self.unknowns.len(), |k, _| {
            let (i, c) = self.unknowns[k];
            steady.gradients[i][c] * self.transfers[self.kind[i]].rate
        });
        // M(0) = −T(0) X.
        let matrix = self.whole(Complex::ZERO).map(|z| z.re);
        if self.conditions == 0 {
            return matrix.lu().solve(&residual);
        }
        let svd = matrix.svd(true, true);
        svd.solve(&residual, NEUTRAL * svd.singular_values.max())
            .ok()
    }

    /// Moduli of the laws' own rates, and the inverse delays, 1/s.
    fn rates(&self) -> impl Iterator<Item = f64> {
        let delays = self
            .transfers
            .iter()
            .flat_map(|t| &t.delays)
            .map(|d| 1.0 / d);
        let rates = self
            .transfers
            .iter()
            .flat_map(|t| &t.own_rates)
            .map(|rate| rate.norm());
        delays
            .chain(rates)
            .filter(|rate| *rate > 0.0 && rate.is_finite())
    }

    /// The line left of which no roots are sought, 1/s. T has poles at the laws' own rates, and
    /// next to these its function is steep: a tenth of the distance from the axis is left out.
    /// Without such rates the line is that of roots that decay in a thousandth of the longest time.
    pub fn leftmost(&self) -> f64 {
        let rates = self
            .transfers
            .iter()
            .flat_map(|t| &t.own_rates)
            .map(|rate| rate.re);
        0.9 * rates
            .filter(|r| *r < 0.0)
            .fold(f64::NEG_INFINITY, f64::max)
            .max(-1e3 * self.slowest_rate())
    }

    /// The number c, with −c left of every line on which roots are counted, 1/s.
    fn shift(&self) -> f64 {
        self.slowest_rate() - 2.0 * self.leftmost()
    }

    /// λ + c.
    pub fn shifted(&self, z: Complex<f64>) -> Complex<f64> {
        z + Complex::from(self.shift())
    }

    /// Values of λ at which different functions have different values: between the slowest and the
    /// fastest rate of the laws, off the axes.
    pub fn probes(&self) -> Vec<Complex<f64>> {
        let slow = self.slowest_rate();
        let fast = self.rates().fold(slow, f64::max);
        // Two values, and one more for every factor of ten between these rates.
        let decades = (fast / slow).log10().ceil().clamp(0.0, 12.0) as usize;
        let at = |k: usize| {
            let size = slow * (fast / slow).powf(k as f64 / (decades + 1) as f64);
            // The arguments have no pattern, so that no difference vanishes at all values.
            Complex::from_polar(size, 0.4 + 0.13 * k as f64)
        };
        (0..=decades + 1).map(at).collect()
    }

    /// A radius outside which there is no root with Re λ ≥ `abscissa`, 1/s: there |λ| exceeds the
    /// norm of T(λ) X. The bound holds for the whole shoot, for an element and for a point. Stimuli
    /// and variables are scaled by their sizes, because their units depend on the laws.
    pub fn bound(&self, abscissa: f64) -> f64 {
        let radii = self
            .transfers
            .iter()
            .map(|transfer| transfer.radius(&self.sizes, abscissa));
        // At eight times this radius, where a count ends, the argument of the factors (λ − rate)/(λ
        // + c) of a local matrix is less than a radian.
        let turn = |rates: &Vec<Complex<f64>>| {
            rates
                .iter()
                .map(|rate| (rate + self.shift()).norm())
                .sum::<f64>()
                / 8.0
        };
        let turns = self
            .transfers
            .iter()
            .map(|transfer| turn(&transfer.local_rates));
        // The same for the factors (λ + c)/(λ − root) of roots next to zero.
        let turns = turns.chain([self.conditions as f64 * self.shift() / 8.0]);
        1.001
            * radii
                .chain(turns)
                .fold(0.0, f64::max)
                .max(self.smallest_modulus())
    }

    /// The inverse of the longest time in the rates and delays of the laws, 1/s.
    pub fn slowest_rate(&self) -> f64 {
        let slowest = self.rates().fold(f64::INFINITY, f64::min);
        if slowest.is_finite() {
            slowest
        } else {
            self.transfers.iter().map(|t| t.rate).fold(1e-300, f64::max)
        }
    }

    /// Size of λ below which its error is not relative to |λ|: a thousandth of the slowest rate,
    /// 1/s.
    pub fn smallest_modulus(&self) -> f64 {
        1e-3 * self.slowest_rate()
    }
}

/// Computes X and the displacements. Frames follow from the factorised tangent; stimuli and
/// positions are differentiated by central differences.
fn respond(
    shoot: &Shoot<impl Model>,
    rod: &Rod,
    statics: (&impl Load, &impl Support),
    unknowns: &[(usize, usize)],
    force: &InternalForce,
) -> Outcome<(DMatrix<f64>, DMatrix<f64>)> {
    let m = shoot.model.tropism().size().stimuli;
    let mut response: DMatrix<f64> = DMatrix::zeros(rod.zone().len() * m, unknowns.len());
    let mut displacement: DMatrix<f64> = DMatrix::zeros(3 * (rod.elements() + 1), unknowns.len());
    visit_bends(
        shoot,
        rod,
        statics,
        force,
        unknowns.iter().copied(),
        |j, weight, moved, force| {
            visit_stimuli(shoot, moved, force, |i, _, stimuli| {
                for (sum, x) in response.column_mut(j).as_mut_slice()[i * m..]
                    .iter_mut()
                    .zip(stimuli)
                {
                    *sum += weight * x;
                }
            });
            for (k, (_, position)) in moved.centre_line().iter().enumerate() {
                let mut rows = displacement.fixed_view_mut::<3, 1>(3 * k, j);
                rows += position * weight;
            }
        },
    )?;
    let finite = response.iter().all(|x| x.is_finite());
    ensure(
        finite,
        StabilityError::NotFinite {
            what: "response of the stimuli",
        },
    )?;
    Ok((response, displacement))
}

/// X of a rigid shoot: a bend rotates all frames beyond it.
fn respond_rigidly(
    rod: &Rod,
    unknowns: &[(usize, usize)],
    [strain, turn]: [&[DMatrix<f64>]; 2],
) -> DMatrix<f64> {
    let (p, first, reference) = (rod.order().points(), rod.first_growing, rod.reference());
    let m = turn.first().map_or(0, DMatrix::nrows);
    let frames: Vec<_> = (0..turn.len())
        .map(|i| rod.frame_at_point(first + i / p, i % p))
        .collect();
    let mut out = DMatrix::zeros(turn.len() * m, unknowns.len());
    for (column, &(j, c)) in unknowns.iter().enumerate() {
        let axis = frames[j] * Vector3::ith(c, rod.points()[first * p + j].jacobian);
        // The first point that is affected is the first of the element.
        for i in j / p * p..turn.len() {
            let weight = if i / p == j / p {
                reference.upto[i % p][j % p]
            } else {
                reference.weights[j % p]
            };
            let about_directors = frames[i].inverse() * axis * weight;
            out.view_mut((i * m, column), (m, 1))
                .gemm(1.0, &turn[i], &about_directors, 0.0);
        }
        let mut own = out.view_mut((j * m, column), (m, 1));
        own += strain[j].column(c);
    }
    out
}
