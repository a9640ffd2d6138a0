//! The linear problem of small disturbances about a stationary shoot.

use nalgebra::{Complex, DMatrix, DVector};

use super::StabilityError;
use super::characteristic::Pair;
use super::settled::{Settled, check_unforced};
use super::short_waves::Element;
use super::transfer::Transfer;
use crate::equilibrium::{Branch, EquilibriumSolver, NewtonSolver};
use crate::error::ParameterError;
use crate::growth::GrowthLaw;
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::scene::Scene;
use crate::sensing::visit_sites;
use crate::shoot::Shoot;
use crate::tropism::{Declaration, Size, TropismLaw};

/// A disturbance of a point's intrinsic strain bends the shoot by this angle, rad. Central differences then err by 1e-10
/// of a third derivative, and rounding by 1e-14 over it.
const ANGLE: f64 = 3e-5;

/// T(λ) and T'(λ) of every kind of point.
pub(super) type Transfers = Vec<Pair>;

/// The linear problem M(λ) δu* = 0 about a stationary shoot.
#[derive(Debug, Clone)]
pub struct Linearisation {
    /// Distinct transfer functions, and which of them each material point has.
    pub(super) transfers: Vec<Transfer>,
    pub(super) kind: Vec<usize>,
    /// The unknowns: material point and component of its intrinsic strain.
    pub(super) unknowns: Vec<(usize, usize)>,
    /// Sets of unknowns that do not couple: planes of an upright shoot, say.
    pub(super) blocks: Vec<Vec<usize>>,
    /// For every block the first one with the same characteristic function: the planes of an upright shoot are twins.
    pub(super) twins: Vec<usize>,
    /// The same for the local problem of every kind of point that senses its strain: kind and components.
    pub(super) local_blocks: Vec<(usize, Vec<usize>)>,
    /// For every block the elements' own problems.
    pub(super) elements: Vec<Vec<Element>>,
    /// For every block the elastic share of its response to a turn.
    pub(super) elasticity: Vec<f64>,
    /// X: rows (point, stimulus), columns unknowns.
    pub(super) response: DMatrix<f64>,
    /// Displacement of the ends of the elements (3 rows each) by each unknown, m per 1/m.
    pub(super) displacement: DMatrix<f64>,
    pub(super) stimuli: usize,
}

impl Linearisation {
    /// Linearises a shoot about its present state, which must be stationary. Growth is frozen: length, stiffness and
    /// zone stay as they are. The shoot is not changed.
    ///
    /// # Errors
    /// A state that is not stationary or mechanically unstable, laws that depend on time or steer nothing.
    pub fn about(shoot: &Shoot<impl Model>) -> Result<Self, StabilityError> {
        let mut solver = NewtonSolver::with_tolerance(1e-13);
        solver.branch = Branch::Nearest;
        let environment = shoot.model.scene().environment(shoot.state.time);
        let mut rod = shoot.state.rod.clone();
        let force = InternalForce::of(&rod, shoot.model.load(), &environment);
        let found = solver.equilibrate(&mut rod, shoot.model.constitutive(), &force)?;
        if found.inertia.negative > 0 {
            return Err(StabilityError::MechanicallyUnstable { negative: found.inertia.negative });
        }
        let mut settled = Settled::of(shoot, &rod, &force);
        check_unforced(shoot, &rod, shoot.model.load(), &settled)?;
        // What the equilibrium's own error lets the laws ask for, times a margin.
        let radius = settled.places.first().map_or(1.0, |place| place.radius);
        let gradient = settled.largest();
        if !(gradient * radius < 1e-8) {
            return Err(StabilityError::NotStationary { gradient });
        }
        Self::at(shoot, &rod, &mut settled, &force, &mut solver)
    }

    /// Linearises about `rod`, stationary or not.
    pub(super) fn at(
        shoot: &Shoot<impl Model>,
        rod: &Rod,
        settled: &mut Settled,
        force: &InternalForce,
        solver: &mut NewtonSolver,
    ) -> Result<Self, StabilityError> {
        settled.differentiate(shoot, rod, force);
        let settled = &*settled;
        let law = shoot.model.tropism();
        let m = Size::of(law).stimuli;
        let mut transfers: Vec<Transfer> = Vec::new();
        let mut kind = Vec::with_capacity(settled.places.len());
        for (i, place) in settled.places.iter().enumerate() {
            let rate = shoot.model.growth().regr(place.apex_distance, place.time);
            let transfer = Transfer::of(law, rate, settled, i)?;
            let known = transfers.iter().position(|other| other.is_like(&transfer));
            kind.push(known.unwrap_or(transfers.len()));
            if known.is_none() {
                transfers.push(transfer);
            }
        }
        let unknowns: Vec<(usize, usize)> = (0..settled.places.len())
            .flat_map(|i| (0..3).map(move |c| (i, c)))
            .filter(|&(i, c)| transfers[kind[i]].drives(c))
            .collect();
        if unknowns.is_empty() {
            return Err(StabilityError::NothingDriven);
        }
        let mut out = Self {
            transfers,
            kind,
            response: DMatrix::zeros(settled.places.len() * m, unknowns.len()),
            displacement: DMatrix::zeros(3 * (rod.elements() + 1), unknowns.len()),
            unknowns,
            blocks: Vec::new(),
            local_blocks: Vec::new(),
            elements: Vec::new(),
            elasticity: Vec::new(),
            twins: Vec::new(),
            stimuli: m,
        };
        out.respond(shoot, rod, force, solver)?;
        out.find_blocks();
        out.find_elements(rod, settled);
        out.find_elasticity(rod, settled);
        out.find_twins();
        Ok(out)
    }

    /// Fills in X and the displacements: frames by the factorised tangent, everything that follows from them by central
    /// differences.
    fn respond(
        &mut self,
        shoot: &Shoot<impl Model>,
        rod: &Rod,
        force: &InternalForce,
        solver: &mut NewtonSolver,
    ) -> Result<(), StabilityError> {
        let law = shoot.model.tropism();
        let m = self.stimuli;
        let (p, first) = (rod.order().points(), rod.first_growing() * rod.order().points());
        let mut tangent = solver.linearise(rod, shoot.model.constitutive(), force)?;
        let position = Declaration::of(law).needs_position();
        let mut moved = rod.clone();
        let mut sensed = [DVector::zeros(self.response.nrows()), DVector::zeros(self.response.nrows())];
        let mut places = [DVector::zeros(self.displacement.nrows()), DVector::zeros(self.displacement.nrows())];
        for (j, &(i, c)) in self.unknowns.clone().iter().enumerate() {
            let at = first + i;
            let weight = rod.basis().weights[at % p] * rod.points()[at].jacobian;
            let step = ANGLE / weight;
            for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                moved.clone_from(rod);
                moved.points_mut()[at].intrinsic[c] += sign * step;
                tangent.follow(&mut moved);
                visit_sites(&moved, shoot.model.constitutive(), force, position, |i, site| {
                    law.sense(site, &mut sensed[side].as_mut_slice()[i * m..(i + 1) * m]);
                });
                for (k, (_, position)) in moved.centre_line().iter().enumerate() {
                    places[side].rows_mut(3 * k, 3).copy_from(position);
                }
            }
            self.response.set_column(j, &((&sensed[0] - &sensed[1]) / (2.0 * step)));
            self.displacement.set_column(j, &((&places[0] - &places[1]) / (2.0 * step)));
        }
        if self.response.iter().all(|x| x.is_finite()) {
            Ok(())
        } else {
            Err(ParameterError { name: "response of the stimuli", value: f64::NAN, requirement: "finite" }.into())
        }
    }

    /// The number of unknowns.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.unknowns.len()
    }

    /// T(λ) of every kind of point.
    pub(super) fn transfers_at(&self, z: Complex<f64>) -> Transfers {
        self.transfers.iter().map(|transfer| transfer.at(z)).collect()
    }

    /// M(λ) and M'(λ) of a block of unknowns.
    pub(super) fn block_matrix(&self, z: Complex<f64>, transfers: &Transfers, block: &[usize]) -> Pair {
        let unknowns: Vec<(usize, usize)> = block.iter().map(|&unknown| self.unknowns[unknown]).collect();
        self.assemble(z, transfers, &unknowns, &self.response, block, 0)
    }

    /// The same, with the transfer functions evaluated for it.
    pub(super) fn matrix(&self, z: Complex<f64>, block: &[usize]) -> Pair {
        self.block_matrix(z, &self.transfers_at(z), block)
    }

    /// λ − T X and its derivative for some unknowns, from columns of a response whose rows begin with the stimuli at
    /// the point `first`.
    pub(super) fn assemble(
        &self,
        z: Complex<f64>,
        transfers: &Transfers,
        unknowns: &[(usize, usize)],
        response: &DMatrix<f64>,
        columns: &[usize],
        first: usize,
    ) -> Pair {
        let n = unknowns.len();
        let mut value = DMatrix::from_diagonal_element(n, n, z);
        let mut slope = DMatrix::identity(n, n);
        for (row, &(i, c)) in unknowns.iter().enumerate() {
            let (t, dt) = &transfers[self.kind[i]];
            for k in 0..self.stimuli {
                let (t, dt) = (t[(c, k)], dt[(c, k)]);
                if t == Complex::ZERO && dt == Complex::ZERO {
                    continue;
                }
                for (col, &column) in columns.iter().enumerate() {
                    let x = response[((i - first) * self.stimuli + k, column)];
                    value[(row, col)] -= t * x;
                    slope[(row, col)] -= dt * x;
                }
            }
        }
        (value, slope)
    }

    /// A radius outside which there is no root with Re λ ≥ `abscissa`: there |λ| exceeds the norm of T(λ) X.
    pub(super) fn bound(&self, abscissa: f64) -> f64 {
        // The size of every stimulus, on the whole shoot, in an element by itself, at a point by itself: the norm of its
        // rows. Stimuli and variables are measured by their sizes, since laws have units of their own.
        let m = self.stimuli;
        let mut stimuli = DVector::zeros(m);
        let own = self.elements.iter().flatten().map(|element| &element.response);
        for response in own.chain([&self.response]).chain(self.transfers.iter().map(|t| &t.local)) {
            for k in 0..m {
                let rows = (k..response.nrows()).step_by(m).map(|row| response.row(row).norm_squared());
                stimuli[k] = f64::max(stimuli[k], rows.sum::<f64>().sqrt());
            }
        }
        let radius = self.transfers.iter().map(|transfer| transfer.radius(&stimuli, abscissa)).fold(0.0, f64::max);
        1.001 * radius.max(self.slowest_rate() * 1e-3)
    }

    /// A rate, 1/s: the inverse of the longest time in the laws' rates and delays.
    pub(super) fn slowest_rate(&self) -> f64 {
        let delays = self.transfers.iter().flat_map(|t| &t.delays).copied().filter(|d| d.is_finite() && *d > 0.0);
        let rates = self.transfers.iter().flat_map(|t| &t.memory).map(|rate| rate.norm()).filter(|r| *r > 0.0);
        let slowest = delays.map(|d| 1.0 / d).chain(rates).fold(f64::INFINITY, f64::min);
        if slowest.is_finite() { slowest } else { self.transfers.iter().map(|t| t.rate).fold(1e-300, f64::max) }
    }

    /// Some λ to tell functions apart at: from the slowest to the fastest rate of the laws, off the axes.
    pub(super) fn probes(&self) -> Vec<Complex<f64>> {
        let slow = self.slowest_rate();
        let delays = self.transfers.iter().flat_map(|t| &t.delays).filter(|d| **d > 0.0).map(|d| 1.0 / d);
        let rates = self.transfers.iter().flat_map(|t| &t.memory).map(|rate| rate.norm());
        let fast = delays.chain(rates).fold(slow, f64::max);
        // Two, and one more for every factor of ten between them.
        let decades = (fast / slow).log10().ceil().clamp(0.0, 12.0) as usize;
        let at = |k: usize| {
            let size = slow * (fast / slow).powf(k as f64 / (decades + 1) as f64);
            // Directions without a pattern.
            Complex::from_polar(size, 0.4 + 0.13 * k as f64)
        };
        (0..=decades + 1).map(at).collect()
    }
}
