//! The linearisation of a shoot about a steady state: the number of unstable roots, and the roots
//! themselves.

use std::sync::Arc;

use nalgebra::{Complex, DVector, Vector3};

use super::block::{Block, LocalBlock};
use super::characteristic::CharacteristicMatrix;
use super::count::count_along;
use super::motion::{ForcedResponse, Root};
use super::parts::{PartRoot, SpectrumPart, divide};
use super::roots::{insert, rightmost, roots_right_of, threshold, with_conjugate, zero_near};
use super::steady_state::solve_rod;
use crate::error::{ParameterError, ensure};
use crate::linearisation::{
    Outcome, StabilityError, SteadyLaws, check_autonomous, check_steady, equilibrate,
    precise_solver,
};
use crate::load::InternalForce;
use crate::model::{GrowthLaw, Model};
use crate::numerics::scalar::sort_by_value;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::tropism::Growing;

/// The linearisation of a shoot about a steady state, with its characteristic matrix M(λ).
#[derive(Debug, Clone)]
pub struct Linearisation {
    pub(in crate::stability) characteristic: Arc<CharacteristicMatrix>,
    /// Local matrices of the points of each kind: the essential spectrum.
    points: Vec<LocalBlock>,
    /// Blocks of unknowns: the isolated roots. The multiplicity is zero for a block that equals an
    /// earlier one.
    blocks: Vec<Block>,
    /// The linearisation on a coarser mesh, and the error of a root relative to its change from
    /// that mesh.
    pub(in crate::stability) coarser: Option<(Box<Linearisation>, f64)>,
}

impl Linearisation {
    /// Linearises a shoot about its present state, which must be a steady state, on its own mesh;
    /// [`resolved`](Self::resolved) refines the mesh. A shoot that was just built is in a steady
    /// state if it is upright and its laws keep it so.
    /// [`solve_steady_state`](crate::stability::solve_steady_state()) brings others into one.
    /// Length, stiffness and zone are kept constant. Obstacles that the shoot does not touch have
    /// no effect. The shoot is not changed.
    ///
    /// # Errors
    /// A state that is not steady or mechanically unstable, contact with an obstacle, laws or
    /// supports that are not autonomous, laws that cause no differential growth or whose
    /// derivatives are not finite, or a rod whose reactions are not determined to first order.
    pub fn about(shoot: &Shoot<impl Model>) -> Result<Self, StabilityError> {
        Self::on(shoot, shoot.state.rod.clone())
    }

    /// Linearises a shoot on a finer mesh: every element is divided into `parts`, and the steady
    /// state solved for again. The shoot is not changed. A section that tapers is interpolated by
    /// the polynomials of the present elements, whereas a shoot that is built with more elements
    /// evaluates its section at their points.
    ///
    /// # Errors
    /// Errors of [`about`](Self::about), zero parts, 1e4 elements or more in total, or no steady
    /// state on the finer mesh.
    pub fn refined(shoot: &Shoot<impl Model>, parts: usize) -> Result<Self, StabilityError> {
        let mut rod = shoot.state.rod.clone();
        let elements = (rod.elements() as f64) * parts as f64;
        // Matrices are dense: with two components at four points of each element, a matrix for 1e4
        // elements takes 100 GB.
        let requirement = "at least 1, and such that there are fewer than 1e4 elements";
        let ok = parts > 0 && elements < 1e4;
        ParameterError::unless(
            ok,
            "number of parts of an element",
            parts as f64,
            requirement,
        )?;
        if parts == 1 {
            return Self::on(shoot, rod);
        }
        // From a state that is not steady the solver could converge to another one.
        let _ = check(shoot, &mut rod)?;
        rod.cut(parts);
        solve_rod(shoot, &mut rod)?;
        Self::on(shoot, rod)
    }

    /// Linearises a shoot about a rod.
    fn on(shoot: &Shoot<impl Model>, mut rod: Rod) -> Outcome<Self> {
        let (force, steady) = check(shoot, &mut rod)?;
        let regr = |at: &Growing| shoot.model.growth().regr(at.apex_distance, at.time);
        let statics = (shoot.model.load(), shoot.model.support());
        let characteristic =
            CharacteristicMatrix::about(shoot, &rod, statics, regr, (&steady, &force))?;
        let characteristic = Arc::new(characteristic);
        let (points, blocks) = divide(&characteristic)?;
        Ok(Self {
            characteristic,
            points,
            blocks,
            coarser: None,
        })
    }

    /// The number of elements in the growth zone.
    #[must_use]
    pub fn elements(&self) -> usize {
        self.characteristic.elements()
    }

    /// The number of roots with a positive real part, counted with multiplicity, by the argument
    /// principle, which misses none. It increases from 0 to 4 at the onset of oscillations of a
    /// straight vertical shoot, since each of two planes has a conjugate pair.
    ///
    /// Roots whose real part is less than a millionth of the slowest rate count as stable.
    ///
    /// # Errors
    /// [`InfinitelyMany`](StabilityError::InfinitelyMany) if the essential spectrum extends right
    /// of the axis; a root at the threshold, or a mesh that does not resolve the waves that affect
    /// the count.
    pub fn unstable(&self) -> Result<usize, StabilityError> {
        for point in &self.points {
            if count_along(point, threshold(point))?.number > 0 {
                return Err(StabilityError::InfinitelyMany {
                    abscissa: accumulation(&self.essential()?),
                });
            }
        }
        let count = |block| count_along(block, threshold(block)).map(|line| line.number);
        self.blocks()
            .map(|(_, block)| Ok(block.multiplicity * count(block)?))
            .sum()
    }

    /// The number of unstable roots; the largest number if there are infinitely many.
    pub(in crate::stability) fn count_unstable(&self) -> Outcome<usize> {
        match self.unstable() {
            Err(StabilityError::InfinitelyMany { .. }) => Ok(usize::MAX),
            number => number,
        }
    }

    /// The essential spectrum, 1/s: for every kind of material point the rightmost root of its
    /// local matrix, rightmost first. Infinitely many roots accumulate there, whose waves become
    /// ever shorter. Roots are sought right of nine tenths of the slowest of the laws' own rates,
    /// −0.9/τm. The list is empty if no root lies there, or if no law senses the strain at its own
    /// place.
    ///
    /// # Errors
    /// A root that is not found.
    pub fn essential_spectrum(&self) -> Result<Vec<Complex<f64>>, StabilityError> {
        let mut out: Vec<Complex<f64>> = Vec::new();
        self.essential()?
            .iter()
            .for_each(|root| insert(&mut out, root.value, 1e-9));
        sort_by_value(&mut out, |root| -root.re);
        Ok(out)
    }

    /// The isolated roots with Re λ > `line` (1/s), rightmost first, with their modes. The line
    /// must lie right of the essential spectrum and of the laws' own rates, −0.9/τm. If no law
    /// senses the strain at its own place, it must lie right of zero, where all roots then
    /// accumulate.
    ///
    /// # Errors
    /// A line that lies left of these, or a root that is not found.
    pub fn roots(&self, line: f64) -> Result<Vec<Root>, StabilityError> {
        const LINE: &str = "line right of which roots are sought";
        ParameterError::finite(LINE, line, "1/s")?;
        let ok = line >= self.characteristic.leftmost() && line > accumulation(&self.essential()?);
        let requirement =
            "right of −0.9/τm and of the essential spectrum, or of zero where that is empty (1/s)";
        ParameterError::unless(ok, LINE, line, requirement)?;
        let mut found: Vec<Root> = Vec::new();
        for (part, block) in self.blocks() {
            found.extend(
                roots_right_of(block, line)?
                    .into_iter()
                    .map(|value| self.root(part, block, value)),
            );
        }
        sort_by_value(&mut found, |root| -root.value.re);
        Ok(found)
    }

    /// The rightmost isolated root, with its mode.
    ///
    /// # Errors
    /// No root right of the essential spectrum and of the laws' own rates, or a mesh that does not
    /// resolve the waves that affect the root.
    pub fn rightmost(&self) -> Result<Root, StabilityError> {
        let roots = self.isolated(&self.essential()?)?.into_iter();
        let rightmost = roots.reduce(|a, b| if b.value.re > a.value.re { b } else { a });
        self.with_mode(rightmost.ok_or(StabilityError::NoIsolatedRoot)?)
    }

    /// The rightmost root, isolated or essential, and the part that it belongs to.
    pub(in crate::stability) fn leading(&self) -> Outcome<PartRoot> {
        let essential = self.essential()?;
        let all = essential.iter().copied().chain(self.isolated(&essential)?);
        // On ties, keep the first.
        let leading = all.reduce(|a, b| {
            if b.value.re > a.value.re + 1e-9 * b.value.norm() {
                b
            } else {
                a
            }
        });
        leading.ok_or(StabilityError::NoIsolatedRoot)
    }

    /// The distinct blocks, with their identifiers.
    fn blocks(&self) -> impl Iterator<Item = (SpectrumPart, &Block)> {
        let named = self
            .blocks
            .iter()
            .enumerate()
            .map(|(i, block)| (SpectrumPart::Isolated(i), block));
        named.filter(|(_, block)| block.multiplicity > 0)
    }

    /// Identifiers of all distinct parts of the spectrum, the essential ones first.
    pub(in crate::stability) fn parts(&self) -> impl Iterator<Item = SpectrumPart> {
        (0..self.points.len())
            .map(SpectrumPart::Essential)
            .chain(self.blocks().map(|(name, _)| name))
    }

    /// The root of a part that Newton's method finds from a guess; none if the part does not exist
    /// here.
    ///
    /// # Errors
    /// A root that is not found.
    pub(in crate::stability) fn root_near(
        &self,
        part: SpectrumPart,
        guess: Complex<f64>,
    ) -> Outcome<Option<Complex<f64>>> {
        let zero = match part {
            SpectrumPart::Isolated(i) => self.blocks.get(i).map(|block| zero_near(block, guess)),
            SpectrumPart::Essential(i) => self.points.get(i).map(|point| zero_near(point, guess)),
        };
        zero.transpose()
    }

    /// A root of a part, with its mode.
    ///
    /// # Errors
    /// A part of the essential spectrum.
    pub(in crate::stability) fn with_mode(
        &self,
        PartRoot { part, value }: PartRoot,
    ) -> Outcome<Root> {
        let block = self.blocks().find(|(name, _)| *name == part);
        block
            .map(|(_, block)| self.root(part, block, value))
            .ok_or(StabilityError::NoIsolatedRoot)
    }

    /// A root of a block, with its mode and the error of its mesh if that is known.
    fn root(&self, part: SpectrumPart, block: &Block, value: Complex<f64>) -> Root {
        Root {
            error: self.error_of(part, value),
            ..Root::new(block, value)
        }
    }

    /// The unstable isolated root with the smallest real part, and the number of roots that it
    /// represents.
    ///
    /// # Errors
    /// A root that is not found.
    pub(in crate::stability) fn next_to_axis(&self) -> Outcome<Option<(PartRoot, usize)>> {
        let mut best: Option<(PartRoot, usize)> = None;
        for (name, block) in self.blocks() {
            if let Some(z) = roots_right_of(block, threshold(block))?.last()
                && best.is_none_or(|(other, _)| z.re < other.value.re)
            {
                best = Some((
                    PartRoot {
                        part: name,
                        value: *z,
                    },
                    with_conjugate(z) * block.multiplicity,
                ));
            }
        }
        Ok(best)
    }

    /// The rightmost root of every kind of point that has one.
    fn essential(&self) -> Outcome<Vec<PartRoot>> {
        let mut out: Vec<PartRoot> = Vec::new();
        for (i, point) in self.points.iter().enumerate() {
            // The roots of successive kinds of points are close to each other.
            let guess = out.last().map(|root| root.value);
            let (part, found) = (
                SpectrumPart::Essential(i),
                rightmost(point, self.characteristic.leftmost(), guess)?,
            );
            out.extend(found.map(|value| PartRoot { part, value }));
        }
        Ok(out)
    }

    /// The rightmost root of every block that has one right of the essential spectrum. Left of this
    /// spectrum the characteristic function has poles; without proprioception all roots accumulate
    /// at zero.
    fn isolated(&self, essential: &[PartRoot]) -> Outcome<Vec<PartRoot>> {
        let left = accumulation(essential) + 1e-4 * self.characteristic.slowest_rate();
        let left = left.max(self.characteristic.leftmost());
        let root = |(part, block): (_, &Block)| {
            Ok(rightmost(block, left, None)?.map(|value| PartRoot { part, value }))
        };
        self.blocks()
            .filter_map(|block| root(block).transpose())
            .collect()
    }

    /// The response to a growth gradient Re[`gradient` exp(iωt)] that is added at every point of
    /// the growth zone, with ω = `omega` in 1/s and the gradient in 1/m: the solution of M(iω) δu*
    /// = REGR gradient. An [`Oscillator`](crate::tropism::Oscillator) that rotates counterclockwise
    /// at phase zero is (α/r, −iα/r, 0); linearise the shoot without it.
    ///
    /// The response is of first order in the gradient. The shoot approaches it if no root is
    /// unstable.
    ///
    /// # Errors
    /// A frequency that is not positive, a gradient along a director about which no law bends or
    /// twists the shoot everywhere, or a frequency at which the shoot has a root.
    pub fn response(
        &self,
        omega: f64,
        gradient: &Vector3<Complex<f64>>,
    ) -> Result<ForcedResponse, StabilityError> {
        ParameterError::positive("frequency of the forcing", omega, "rad/s")?;
        let (characteristic, unknowns) = (&*self.characteristic, &self.characteristic.unknowns);
        let steered = |c: usize| {
            unknowns.iter().filter(|(_, other)| *other == c).count() == characteristic.kind.len()
        };
        for (c, part) in gradient.iter().map(|part| part.norm()).enumerate() {
            let name = "growth gradient of the forcing";
            ParameterError::finite(name, part, "1/m")?;
            let requirement =
                "zero along directors about which the laws do not steer everywhere (1/m)";
            ParameterError::unless(part == 0.0 || steered(c), name, part, requirement)?;
        }
        let matrix = characteristic.whole(Complex::new(0.0, omega));
        let regr = |i: usize| characteristic.transfers[characteristic.kind[i]].rate;
        let forcing = DVector::from_iterator(
            unknowns.len(),
            unknowns.iter().map(|&(i, c)| gradient[c] * regr(i)),
        );
        let found = matrix
            .lu()
            .solve(&forcing)
            .filter(|found| found.norm().is_finite());
        let found = found.ok_or(StabilityError::NotFinite {
            what: "response to the forcing",
        })?;
        let all: Vec<usize> = (0..unknowns.len()).collect();
        Ok(characteristic.motion(&all, &found))
    }
}

/// Brings a rod into mechanical equilibrium, and returns an error unless it is then in a steady
/// state. Returns the force in the rod and the state of the laws.
fn check(shoot: &Shoot<impl Model>, rod: &mut Rod) -> Outcome<(InternalForce, SteadyLaws)> {
    let (material, statics) = (
        shoot.model.constitutive(),
        (shoot.model.load(), shoot.model.support()),
    );
    let (force, found) = equilibrate(
        rod,
        material,
        statics,
        &shoot.environment(),
        shoot.reactions(),
        &mut precise_solver(),
    )?;
    let negative = found.inertia.negative;
    ensure(
        negative == 0,
        StabilityError::MechanicallyUnstable { negative },
    )?;
    let steady = SteadyLaws::of(shoot, rod, &force);
    check_steady(shoot.model.tropism(), &steady)?;
    check_autonomous(shoot, rod, shoot.model.load(), force.reactions(), &steady)?;
    // The threshold is the gradient that the error of the equilibrium causes, times a margin.
    let gradient = steady.largest_gradient()?;
    let is_steady = gradient * steady.radius() < 1e-8;
    ensure(
        is_steady,
        StabilityError::NotSteadyState {
            iterations: 0,
            gradient,
        },
    )?;
    Ok((force, steady))
}

/// The real part at which isolated roots accumulate: the largest of the essential spectrum, or zero
/// if that is empty.
fn accumulation(essential: &[PartRoot]) -> f64 {
    essential
        .iter()
        .map(|root| root.value.re)
        .reduce(f64::max)
        .unwrap_or(0.0)
}
