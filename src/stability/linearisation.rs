//! The linear problem as users see it: how many roots are unstable, and which they are.

use std::sync::Arc;

use nalgebra::Complex;

use super::analytic::Scales;
use super::count::count_right_of;
use super::error::StabilityError;
use super::linear::{LinearProblem, precise_solver};
use super::modes::{Root, mode};
use super::roots::{rightmost, roots_right_of, threshold};
use super::spectrum::{Found, Part, Spectrum};
use super::stationary::StationarySolver;
use super::steady::{SteadyState, check_steady, check_unforced};
use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
use crate::error::ParameterError;
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;

/// Elements that a refined mesh must stay below: its matrices are dense.
const MOST_ELEMENTS: f64 = 1e4;

/// The number of unstable roots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unstable {
    /// So many roots have a positive real part, each counted as often as it occurs.
    Finite(usize),
    /// The essential spectrum lies right of the axis, up to this real part (1/s): infinitely many roots, on any mesh as
    /// many as the mesh has points.
    Infinite {
        /// Largest real part of the essential spectrum, 1/s.
        abscissa: f64,
    },
}

/// The linear problem M(λ) δu* = 0 about a stationary shoot.
#[derive(Debug, Clone)]
pub struct Linearisation {
    pub(super) problem: Arc<LinearProblem>,
    pub(super) spectrum: Spectrum,
}

impl Linearisation {
    /// Linearises a shoot about its present state, which must be stationary. A shoot that was just built is, if it stands upright
    /// and its laws keep it so; all others go through [`StationarySolver`](super::StationarySolver) first. Growth is frozen: length,
    /// stiffness and zone stay as they are. The shoot is not changed.
    ///
    /// # Errors
    /// A state that is not stationary or mechanically unstable, laws that depend on time or steer nothing, or whose
    /// derivatives are not finite.
    pub fn about(shoot: &Shoot<impl Model>) -> Result<Self, StabilityError> {
        Self::on(shoot, shoot.state.rod.clone())
    }

    /// The same on a finer mesh: every element is cut into so many `parts`, and the shape settled again. The shoot is not
    /// changed. What it is made of stays as its elements hold it: of a section that tapers, the polynomials through their
    /// points. A shoot that is built anew with more elements has its section anew.
    ///
    /// # Errors
    /// Those of [`about`](Self::about), no parts, or a shape that does not settle on the finer mesh.
    pub fn refined(shoot: &Shoot<impl Model>, parts: usize) -> Result<Self, StabilityError> {
        let mut rod = shoot.state.rod.clone();
        let elements = (rod.elements() as f64) * parts as f64;
        let ok = parts > 0 && elements < MOST_ELEMENTS;
        ParameterError::unless(
            ok,
            "number of parts of an element",
            parts as f64,
            "at least 1, and such that there are fewer than 1e4 elements",
        )?;
        if parts == 1 {
            return Self::on(shoot, rod);
        }
        // What is not stationary as it is would settle elsewhere.
        let _ = rest(shoot, &mut rod, &mut precise_solver())?;
        rod.cut(parts);
        let _ = StationarySolver::default().settle(shoot, &mut rod)?;
        Self::on(shoot, rod)
    }

    /// Linearises a shoot about a rod.
    fn on(shoot: &Shoot<impl Model>, mut rod: Rod) -> Result<Self, StabilityError> {
        let mut solver = precise_solver();
        let (force, steady) = rest(shoot, &mut rod, &mut solver)?;
        let problem = Arc::new(LinearProblem::about(shoot, &rod, &steady, &force, &mut solver)?);
        let spectrum = Spectrum::of(&problem);
        Ok(Self { problem, spectrum })
    }

    /// The number of elements in the growth zone.
    #[must_use]
    pub fn elements(&self) -> usize {
        self.problem.lengths.len()
    }

    /// The number of unknowns.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.problem.unknowns.len()
    }

    /// The number of roots with a positive real part, none missed, or that it is infinite.
    ///
    /// Roots within a millionth of the slowest rate of the axis are taken to lie on it.
    ///
    /// # Errors
    /// A root on the line, or a mesh that does not resolve the waves that matter.
    pub fn unstable(&self) -> Result<Unstable, StabilityError> {
        for local in &self.spectrum.local {
            if count_right_of(local, threshold(local))? > 0 {
                return Ok(Unstable::Infinite { abscissa: abscissa(&self.essential()?).unwrap_or(0.0) });
            }
        }
        let mut sum = 0;
        for (_, block) in self.spectrum.blocks() {
            sum += block.multiplicity * count_right_of(block, threshold(block))?;
        }
        Ok(Unstable::Finite(sum))
    }

    /// The essential spectrum, 1/s: for every kind of material point the root of its local problem that lies furthest to
    /// the right, rightmost first. Infinitely many roots of ever shorter waves accumulate there. Roots left of −0.9/τm, with
    /// the slowest rate of the laws, are not sought. Empty if there are no others, or no law senses the strain where it acts.
    ///
    /// # Errors
    /// A root that is not found.
    pub fn essential_spectrum(&self) -> Result<Vec<Complex<f64>>, StabilityError> {
        let mut out: Vec<Complex<f64>> = Vec::new();
        for (_, root) in self.essential()? {
            if !out.iter().any(|other| (other - root).norm() < 1e-9 * root.norm()) {
                out.push(root);
            }
        }
        out.sort_by(|a, b| b.re.total_cmp(&a.re));
        Ok(out)
    }

    /// The isolated roots with Re λ > `line` (1/s), rightmost first, with their modes. The line must lie right of the
    /// essential spectrum and of the laws' own rates, −1/τm; right of zero if no law senses the strain where it acts, since then
    /// all roots accumulate there.
    ///
    /// # Errors
    /// A line that does not, or a root that is not found.
    pub fn roots(&self, line: f64) -> Result<Vec<Root>, StabilityError> {
        const LINE: &str = "line right of which roots are sought";
        ParameterError::finite(LINE, line)?;
        ParameterError::unless(line >= self.problem.leftmost(), LINE, line, "right of −0.9/τm (1/s)")?;
        let requirement = "right of the essential spectrum, and of zero where that is empty (1/s)";
        ParameterError::unless(line > accumulation(&self.essential()?), LINE, line, requirement)?;
        let mut found: Vec<Root> = Vec::new();
        for (_, block) in self.spectrum.blocks() {
            found.extend(roots_right_of(block, line)?.into_iter().map(|value| mode(block, value)));
        }
        found.sort_by(|a, b| b.value.re.total_cmp(&a.value.re));
        Ok(found)
    }

    /// The rightmost isolated root, with its mode.
    ///
    /// # Errors
    /// None found right of the essential spectrum and of the laws' own rates, or a mesh that does not resolve the waves
    /// that matter.
    pub fn rightmost(&self) -> Result<Root, StabilityError> {
        let roots = self.isolated(&self.essential()?)?.into_iter();
        let best = roots.reduce(|a, b| if b.1.re > a.1.re { b } else { a });
        let named = |(name, value): Found| Some((self.spectrum.blocks().find(|(other, _)| *other == name)?.1, value));
        best.and_then(named).map(|(block, value)| mode(block, value)).ok_or(StabilityError::NoIsolatedRoot)
    }

    /// The rightmost root, isolated or essential, and the part that it belongs to.
    pub(super) fn leading(&self) -> Result<Found, StabilityError> {
        let essential = self.essential()?;
        let all = essential.iter().copied().chain(self.isolated(&essential)?);
        // Of equal ones the first.
        let leading = all.reduce(|a, b| if b.1.re > a.1.re + 1e-9 * b.1.norm() { b } else { a });
        leading.ok_or(StabilityError::NoIsolatedRoot)
    }

    /// Material points in an element: half the order of the mesh.
    pub(super) fn points_per_element(&self) -> usize {
        self.problem.points_per_element()
    }

    /// The inverse of the longest time in the laws, 1/s.
    pub(super) fn slowest_rate(&self) -> f64 {
        self.problem.slowest_rate()
    }

    /// The rightmost root of every local problem that has one.
    fn essential(&self) -> Result<Vec<Found>, StabilityError> {
        let mut out = Vec::new();
        let mut guess = None;
        for (i, local) in self.spectrum.local.iter().enumerate() {
            if let Some(z) = rightmost(local, self.problem.leftmost(), guess)? {
                out.push((Part::Essential(i), z));
                // The next point's is not far.
                guess = Some(z);
            }
        }
        Ok(out)
    }

    /// The rightmost root of every block that has one right of the essential spectrum. Left of that the characteristic
    /// function has poles; without proprioception all roots accumulate at zero.
    fn isolated(&self, essential: &[Found]) -> Result<Vec<Found>, StabilityError> {
        let left = accumulation(essential) + 1e-4 * self.slowest_rate();
        let mut out = Vec::new();
        for (name, block) in self.spectrum.blocks() {
            out.extend(rightmost(block, left.max(self.problem.leftmost()), None)?.map(|z| (name, z)));
        }
        Ok(out)
    }
}

/// Brings a rod into mechanical equilibrium, and refuses one that is not stationary then. The force in it, and what its
/// laws do.
fn rest(
    shoot: &Shoot<impl Model>,
    rod: &mut Rod,
    solver: &mut NewtonSolver,
) -> Result<(InternalForce, SteadyState), StabilityError> {
    let force = InternalForce::of(rod, shoot.model.load(), &shoot.environment());
    let found = solver.equilibrate(rod, shoot.model.constitutive(), &force)?;
    if found.inertia.negative > 0 {
        return Err(StabilityError::MechanicallyUnstable { negative: found.inertia.negative });
    }
    let steady = SteadyState::of(shoot, rod, &force);
    check_steady(shoot.model.tropism(), &steady)?;
    check_unforced(shoot, rod, shoot.model.load(), &steady)?;
    // What the equilibrium's own error lets the laws ask for, times a margin.
    let gradient = steady.largest_gradient();
    if !(gradient * steady.radius() < 1e-8) {
        return Err(StabilityError::NotStationary { gradient });
    }
    Ok((force, steady))
}

/// The real part of what isolated roots accumulate at: of the essential spectrum, or zero.
fn accumulation(essential: &[Found]) -> f64 {
    abscissa(essential).unwrap_or(0.0)
}

/// The largest real part of some roots.
fn abscissa(roots: &[Found]) -> Option<f64> {
    roots.iter().map(|(_, z)| z.re).reduce(f64::max)
}
