//! The linearisation of a shoot about a steady state: the number of unstable roots, and the roots themselves.

use std::sync::Arc;

use nalgebra::Complex;

use super::analytic::Scales;
use super::characteristic::CharacteristicMatrix;
use super::count::count_right_of;
use super::modes::{Root, mode};
use super::parts::{Found, Part, Spectrum};
use super::roots::{rightmost, roots_right_of, threshold, with_conjugate, zero_near};
use super::steady_state::SteadyStateSolver;
use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
use crate::error::ParameterError;
use crate::linear::{SteadyLaws, check_autonomous, check_steady, precise_solver};
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::error::StabilityError;

/// The number of unstable roots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unstable {
    /// Number of roots with positive real part, counted with multiplicity.
    Finite(usize),
    /// Infinitely many roots, because the essential spectrum extends right of the axis. On a mesh their number is that of its
    /// points.
    Infinite {
        /// Largest real part of the essential spectrum, 1/s.
        abscissa: f64,
    },
}

/// The linearisation of a shoot about a steady state, with its characteristic matrix M(λ).
#[derive(Debug, Clone)]
pub struct Linearisation {
    pub(super) characteristic: Arc<CharacteristicMatrix>,
    pub(super) spectrum: Spectrum,
}

impl Linearisation {
    /// Linearises a shoot about its present state, which must be a steady state. A shoot that was just built is in a steady
    /// state if it is upright and its laws keep it so. [`SteadyStateSolver`] brings others into one. Length, stiffness and zone
    /// are kept constant. The shoot is not changed.
    ///
    /// # Errors
    /// A state that is not steady or mechanically unstable, laws that are not autonomous or steer nothing, or whose
    /// derivatives are not finite.
    pub fn about(shoot: &Shoot<impl Model>) -> Result<Self, StabilityError> {
        Self::on(shoot, shoot.state.rod.clone())
    }

    /// The same on a finer mesh: every element is divided into `parts`, and the steady state solved for again. The shoot is
    /// not changed. A section that tapers is interpolated by the polynomials of the present elements, whereas a shoot that is
    /// built with more elements evaluates its section at their points.
    ///
    /// # Errors
    /// Those of [`about`](Self::about), zero parts, or no steady state on the finer mesh.
    pub fn refined(shoot: &Shoot<impl Model>, parts: usize) -> Result<Self, StabilityError> {
        let mut rod = shoot.state.rod.clone();
        let elements = (rod.elements() as f64) * parts as f64;
        // Matrices are dense: with two components at four points of each element one of 1e4 elements would take 100 GB.
        let requirement = "at least 1, and such that there are fewer than 1e4 elements";
        let ok = parts > 0 && elements < 1e4;
        ParameterError::unless(ok, "number of parts of an element", parts as f64, requirement)?;
        if parts == 1 {
            return Self::on(shoot, rod);
        }
        // From a state that is not steady the solver could converge to another one.
        let _ = check(shoot, &mut rod, &mut precise_solver())?;
        rod.cut(parts);
        let _ = SteadyStateSolver::default().solve_rod(shoot, &mut rod)?;
        Self::on(shoot, rod)
    }

    /// Linearises a shoot about a rod.
    fn on(shoot: &Shoot<impl Model>, mut rod: Rod) -> Result<Self, StabilityError> {
        let mut solver = precise_solver();
        let (force, steady) = check(shoot, &mut rod, &mut solver)?;
        let characteristic = Arc::new(CharacteristicMatrix::about(shoot, &rod, &steady, &force, &mut solver)?);
        let spectrum = Spectrum::of(&characteristic);
        Ok(Self { characteristic, spectrum })
    }

    /// The number of elements in the growth zone.
    #[must_use]
    pub fn elements(&self) -> usize {
        self.characteristic.lengths.len()
    }

    /// The number of roots with a positive real part by the argument principle, which misses none, or that it is infinite.
    ///
    /// Roots whose real part is less than a millionth of the slowest rate count as stable.
    ///
    /// # Errors
    /// A root on the line, or a mesh that does not resolve the waves that matter.
    pub fn unstable(&self) -> Result<Unstable, StabilityError> {
        for point in &self.spectrum.points {
            if count_right_of(point, threshold(point))? > 0 {
                return Ok(Unstable::Infinite { abscissa: abscissa(&self.essential()?).unwrap_or(0.0) });
            }
        }
        let mut sum = 0;
        for (_, block) in self.spectrum.blocks() {
            sum += block.multiplicity * count_right_of(block, threshold(block))?;
        }
        Ok(Unstable::Finite(sum))
    }

    /// The essential spectrum, 1/s: for every kind of material point the rightmost root of its local matrix, rightmost first.
    /// Infinitely many roots accumulate there, whose waves become ever shorter. Roots left of −0.9/τm, with the slowest rate of
    /// the laws, are not sought. The list is empty if there are no others, or no law senses the strain where it acts.
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
    /// A line that lies left of these, or a root that is not found.
    pub fn roots(&self, line: f64) -> Result<Vec<Root>, StabilityError> {
        const LINE: &str = "line right of which roots are sought";
        ParameterError::finite(LINE, line)?;
        ParameterError::unless(line >= self.characteristic.leftmost(), LINE, line, "right of −0.9/τm (1/s)")?;
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
    pub(in crate::stability) fn leading(&self) -> Result<Found, StabilityError> {
        let essential = self.essential()?;
        let all = essential.iter().copied().chain(self.isolated(&essential)?);
        // On ties, keep the first.
        let leading = all.reduce(|a, b| if b.1.re > a.1.re + 1e-9 * b.1.norm() { b } else { a });
        leading.ok_or(StabilityError::NoIsolatedRoot)
    }

    /// Material points in an element: half the order of the mesh.
    pub(in crate::stability) fn points_per_element(&self) -> usize {
        self.characteristic.points_per_element()
    }

    /// The inverse of the longest time in the laws, 1/s.
    pub(in crate::stability) fn slowest_rate(&self) -> f64 {
        self.characteristic.slowest_rate()
    }

    /// The parts of the spectrum that differ.
    pub(in crate::stability) fn parts(&self) -> impl Iterator<Item = Part> {
        self.spectrum.names()
    }

    /// The root of a part that Newton's method finds from a guess; none if the part does not exist here.
    ///
    /// # Errors
    /// A root that is not found.
    pub(in crate::stability) fn root_near(
        &self,
        part: Part,
        guess: Complex<f64>,
    ) -> Result<Option<Complex<f64>>, StabilityError> {
        self.spectrum.part(part).map(|part| zero_near(part, guess)).transpose()
    }

    /// The unstable isolated root with the smallest real part, and the number of roots that it represents.
    ///
    /// # Errors
    /// A root that is not found.
    pub(in crate::stability) fn next_to_axis(&self) -> Result<Option<(Found, usize)>, StabilityError> {
        let mut best: Option<(Found, usize)> = None;
        for (name, block) in self.spectrum.blocks() {
            if let Some(z) = roots_right_of(block, threshold(block))?.last()
                && best.is_none_or(|((_, other), _)| z.re < other.re)
            {
                best = Some(((name, *z), with_conjugate(z) * block.multiplicity));
            }
        }
        Ok(best)
    }

    /// Size of λ below which its error is not relative to |λ|, 1/s.
    pub(in crate::stability) fn smallest_modulus(&self) -> f64 {
        self.characteristic.smallest_modulus()
    }

    /// The rightmost root of every kind of point that has one.
    fn essential(&self) -> Result<Vec<Found>, StabilityError> {
        let mut out = Vec::new();
        let mut guess = None;
        for (i, point) in self.spectrum.points.iter().enumerate() {
            if let Some(z) = rightmost(point, self.characteristic.leftmost(), guess)? {
                out.push((Part::Essential(i), z));
                // The root of the next kind of point is near.
                guess = Some(z);
            }
        }
        Ok(out)
    }

    /// The rightmost root of every block that has one right of the essential spectrum. Left of this spectrum the
    /// characteristic function has poles; without proprioception all roots accumulate at zero.
    fn isolated(&self, essential: &[Found]) -> Result<Vec<Found>, StabilityError> {
        let left = accumulation(essential) + 1e-4 * self.slowest_rate();
        let mut out = Vec::new();
        for (name, block) in self.spectrum.blocks() {
            out.extend(rightmost(block, left.max(self.characteristic.leftmost()), None)?.map(|z| (name, z)));
        }
        Ok(out)
    }
}

/// Brings a rod into mechanical equilibrium, and returns an error unless it is in a steady state then. Returns the force in
/// the rod and its laws.
fn check(
    shoot: &Shoot<impl Model>,
    rod: &mut Rod,
    solver: &mut NewtonSolver,
) -> Result<(InternalForce, SteadyLaws), StabilityError> {
    let force = InternalForce::of(rod, shoot.model.load(), &shoot.environment());
    let found = solver.equilibrate(rod, shoot.model.constitutive(), &force)?;
    if found.inertia.negative > 0 {
        return Err(StabilityError::MechanicallyUnstable { negative: found.inertia.negative });
    }
    let steady = SteadyLaws::of(shoot, rod, &force);
    check_steady(shoot.model.tropism(), &steady)?;
    check_autonomous(shoot, rod, shoot.model.load(), &steady)?;
    // The threshold is the gradient that the error of the equilibrium causes, times a margin.
    let gradient = steady.largest_gradient();
    if !(gradient * steady.radius() < 1e-8) {
        return Err(StabilityError::NotSteadyState { gradient });
    }
    Ok((force, steady))
}

/// The real part of the points at which isolated roots accumulate: the essential spectrum, or zero.
fn accumulation(essential: &[Found]) -> f64 {
    abscissa(essential).unwrap_or(0.0)
}

/// The largest real part of some roots.
fn abscissa(roots: &[Found]) -> Option<f64> {
    roots.iter().map(|(_, z)| z.re).reduce(f64::max)
}
