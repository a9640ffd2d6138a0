//! The return map of a shoot of constant length: it maps a state to the state one period later.
//!
//! The equations u̇* = REGR · gradient(y(t − τ), x) and ẏ = rates(y, x) are discretised by
//! collocation: in each interval of a period the rates of strain and variables are polynomials that
//! satisfy the equations at the Radau points. Delayed values are those of the polynomials of the
//! past. The grid is fixed in t/T, so that the map is a smooth function of the period T. See K.
//! Engelborghs, T. Luzyanina, K. J. in 't Hout & D. Roose, *SIAM J. Sci. Comput.* 22 (2001), 1593.

use nalgebra::{DMatrix, DVector};

use super::grid::{TimeGrid, kept};
use super::growth_zone::{check_gradients, driven_points};
use super::phase_state::PhaseState;
use super::polynomials::{DelayedReading, Polynomials, Readings, carried, weighted};
use super::rotation::StateRotation;
use crate::cycle::error::{CycleError, Outcome};
use crate::equilibrium::NewtonSolver;
use crate::error::{ParameterError, ensure};
use crate::linearisation::{equilibrate, visit_stimuli};
use crate::load::InternalForce;
use crate::model::{GrowthLaw, Model, Scene, check_unsupported};
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::support::{Reaction, Support};
use crate::tropism::{Declaration, Growing, TropismLaw, law_matrices};

/// Tolerance of the rotations of an equilibrium, rad. It is next to rounding, since differences of
/// equilibria are taken.
pub(crate) const PRECISE: f64 = 1e-13;
/// Largest number of fixed-point iterations over an interval that depends on values inside it, and
/// of Newton iterations for variables.
pub(crate) const PASSES: usize = 60;
/// Largest relative change of a converged iteration: about 45 times the rounding unit.
pub(crate) const CONVERGED: f64 = 1e-14;

/// The shoot at a stage of an interval.
pub(crate) struct Stage {
    /// Rod in equilibrium.
    pub rod: Rod,
    /// Force in it.
    pub force: InternalForce,
    /// Components 1 and 2 of the intrinsic strain, point by point, 1/m.
    pub strain: DVector<f64>,
    /// Stimuli, point by point.
    pub stimuli: DVector<f64>,
    /// Variables, point by point.
    pub variables: DVector<f64>,
    /// Delayed variables, point by point.
    pub past: DVector<f64>,
}

/// The trajectory over a period.
pub(crate) struct Trajectory {
    /// State at the beginning.
    pub start: PhaseState,
    /// State at the end, rotated back if there is a rotation.
    pub end: PhaseState,
    /// Period, s.
    pub period: f64,
    /// Stages, interval by interval.
    pub stages: Vec<Vec<Stage>>,
    /// Strain at the beginning of each interval, and at the end.
    pub strains: Vec<DVector<f64>>,
    /// Rates of the strain at the stages, times the length of an interval.
    pub strain_slopes: Vec<Vec<DVector<f64>>>,
}

/// The return map of a shoot.
pub(crate) struct ReturnMap<'a, M: Model> {
    pub shoot: &'a Shoot<M>,
    pub grid: TimeGrid,
    /// Material points of the growth zone.
    pub places: Vec<Growing>,
    /// Number of intervals of the past in a state.
    pub kept: usize,
    /// Stimuli and variables of a material point.
    pub laws: Declaration,
    /// Rotation that is undone at the end of a period, for relative periodic orbits.
    pub turn: Option<StateRotation>,
    /// Rods at the stages of the last run: initial guesses of the next one.
    pub guesses: Vec<Rod>,
    /// Number of solved equilibria.
    pub equilibria: usize,
    rod: Rod,
    /// Reactions of the support in the last equilibrium.
    reactions: Vec<Reaction>,
    solver: NewtonSolver,
}

impl<'a, M: Model> ReturnMap<'a, M> {
    /// The map on a grid, for periods near the given one (s). Relative periodic orbits have an
    /// `angle` (rad).
    pub fn new(
        shoot: &'a Shoot<M>,
        grid: TimeGrid,
        period: f64,
        angle: Option<f64>,
    ) -> Result<Self, CycleError> {
        if angle.is_some() {
            check_unsupported(&shoot.model)?;
        }
        let (places, _) = driven_points(shoot)?;
        ParameterError::positive("period", period, "s")?;
        ParameterError::unless(
            period.recip().is_finite(),
            "period",
            period,
            "not next to zero (s)",
        )?;
        let declaration = Declaration::of(shoot.model.tropism());
        declaration.check()?;
        Ok(Self {
            shoot,
            places,
            kept: kept(declaration.longest_delay(), grid.intervals, period)?,
            grid,
            turn: angle
                .map(|angle| StateRotation::new(&declaration, angle))
                .transpose()?,
            laws: declaration,
            guesses: Vec::new(),
            equilibria: 0,
            rod: shoot.state.rod.clone(),
            reactions: shoot.reactions().to_vec(),
            solver: NewtonSolver::with_tolerance(PRECISE),
        })
    }

    /// Numbers of variables and of stimuli of a material point, and of points.
    pub fn sizes(&self) -> (usize, usize, usize) {
        let size = self.laws.size();
        (size.variables, size.stimuli, self.places.len())
    }

    /// The delayed values that the equations of an interval read.
    pub fn readings(&self, period: f64) -> Readings {
        let length = period / self.grid.intervals as f64;
        let read = |stage: f64, delay: f64| {
            let at = stage - delay / length;
            // The last point of an interval belongs to it.
            let interval = at.ceil() - 1.0;
            DelayedReading {
                interval: interval as isize,
                weights: self.grid.integrals(at - interval),
            }
        };
        let each = |stage: &f64| {
            self.laws
                .variables()
                .iter()
                .map(|variable| variable.delay.map(|d| read(*stage, d)))
                .collect()
        };
        let stages: Vec<Vec<_>> = self.grid.stages.iter().map(each).collect();
        let inside = stages
            .iter()
            .flatten()
            .flatten()
            .any(|reading| reading.interval >= 0);
        Readings {
            stages,
            implicit: self.laws.size().reads_present || inside,
        }
    }

    /// Solves the equilibrium with a given strain, at a time since the beginning of the period (s).
    pub fn equilibrate_at(
        &mut self,
        strain: &DVector<f64>,
        after: f64,
    ) -> Result<(Rod, InternalForce), CycleError> {
        let (scene, time) = (
            self.shoot.model.scene(),
            self.shoot.environment().time + after,
        );
        let environment = scene.environment(time);
        let first = self.rod.zone().start;
        for k in 0..strain.len() {
            self.rod.points[first + k / 2].intrinsic[k % 2] = strain[k];
        }
        let (load, support) = (self.shoot.model.load(), self.shoot.model.support());
        self.rod
            .place_base((scene.base(time), scene.position(time)), support.base())?;
        let (material, guess) = (self.shoot.model.constitutive(), &self.reactions);
        let (force, _) = equilibrate(
            &mut self.rod,
            material,
            (load, support),
            &environment,
            guess,
            &mut self.solver,
        )?;
        self.reactions = force.reactions().to_vec();
        Ok((self.rod.clone(), force))
    }

    /// Integrates the equations over a period.
    pub fn run(&mut self, start: &PhaseState, period: f64) -> Result<Trajectory, CycleError> {
        let k = self.grid.intervals;
        let (what, needed) = (
            "longest delay, in intervals",
            self.laws.longest_delay() * k as f64 / period,
        );
        ParameterError::unless(
            needed <= self.kept as f64,
            what,
            needed,
            "within the past that the state contains",
        )?;
        let readings = self.readings(period);
        let mut path = Polynomials::of(start, &self.grid);
        let (start, end, strains) = (start.clone(), start.clone(), vec![start.strain.clone()]);
        let mut out = Trajectory {
            start,
            end,
            period,
            stages: Vec::new(),
            strains,
            strain_slopes: Vec::new(),
        };
        for n in 0..k {
            // Initial guess of the slopes in this interval.
            path.slopes
                .push(path.slopes.last().cloned().unwrap_or_default());
            out.stages.push(Vec::new());
            out.strain_slopes.push(Vec::new());
            let mut last = f64::INFINITY;
            for pass in 1.. {
                let change = self.pass(&readings, &mut path, &mut out)?;
                // Changes stagnate at the rounding of equilibria.
                if !readings.implicit
                    || change <= CONVERGED
                    || (change < 10.0 * PRECISE && change >= last)
                {
                    break;
                }
                ensure(pass < PASSES, CycleError::variables(PASSES, change))?;
                last = change;
            }
            out.strains.push(carried(
                &out.strains[n],
                &out.strain_slopes[n],
                &self.grid.whole,
            ));
            path.complete(&self.grid);
        }
        self.guesses = out
            .stages
            .iter()
            .flatten()
            .map(|stage| stage.rod.clone())
            .collect();
        let end = path.into_state(out.strains[k].clone(), k);
        out.end = if let Some(turn) = &self.turn {
            turn.back(&end)
        } else {
            end
        };
        Ok(out)
    }

    /// One fixed-point iteration over the last interval of a trajectory. Writes its stages and the
    /// slopes of strain and variables. Returns the relative change of the strain at the stages,
    /// infinite in the first iteration.
    fn pass(
        &mut self,
        readings: &Readings,
        path: &mut Polynomials,
        out: &mut Trajectory,
    ) -> Outcome<f64> {
        let ((v, m, p), stages, n) = (self.sizes(), self.grid.order(), out.stages.len() - 1);
        let (law, reads_present) = (self.shoot.model.tropism(), self.laws.size().reads_present);
        let length = out.period / self.grid.intervals as f64;
        let mut past: Vec<DVector<f64>> = vec![DVector::zeros(v * p); stages];
        let mut strain_slopes: Vec<DVector<f64>> = vec![DVector::zeros(2 * p); stages];
        let mut gradients = Vec::with_capacity(stages * p);
        for i in 0..stages {
            for (a, reading) in readings.stages[i].iter().enumerate() {
                let Some(reading) = reading else { continue };
                (0..p).for_each(|point| past[i][point * v + a] = path.read(reading, point * v + a));
            }
            for (point, place) in self.places.iter().enumerate() {
                let time = place.time + (n as f64 + self.grid.stages[i]) * length;
                let at = Growing { time, ..*place };
                let now = out.stages[n].get(i).filter(|_| reads_present);
                let now = now.map_or(&[][..], |stage| &stage.stimuli.as_slice()[point * m..][..m]);
                if reads_present && now.is_empty() {
                    // There are no stimuli before the first iteration.
                    continue;
                }
                let gradient = law.gradient(&at, &past[i].as_slice()[point * v..][..v], now);
                gradients.push(gradient);
                let regr = self.shoot.model.growth().regr(at.apex_distance, time);
                for c in 0..2 {
                    strain_slopes[i][2 * point + c] = length * regr * gradient[c];
                }
            }
        }
        check_gradients(&gradients)?;
        let mut made = Vec::with_capacity(stages);
        for (i, past) in past.into_iter().enumerate() {
            let strain = carried(&out.strains[n], &strain_slopes, &self.grid.upto[i]);
            if let Some(guess) = self.guesses.get(n * stages + i) {
                // Only the shape is copied: the guess may belong to a shoot of another length.
                self.rod.guess_shape(guess);
            }
            let (rod, force) =
                self.equilibrate_at(&strain, (n as f64 + self.grid.stages[i]) * length)?;
            let mut stimuli = DVector::zeros(m * p);
            let all = stimuli.as_mut_slice();
            visit_stimuli(self.shoot, &rod, &force, |point, _, x| {
                all[point * m..][..m].copy_from_slice(x)
            });
            made.push(Stage {
                rod,
                force,
                strain,
                stimuli,
                variables: DVector::zeros(v * p),
                past,
            });
        }
        if v > 0 {
            for point in 0..p {
                self.integrate_variables(point, length, path.last(), &mut made)?;
            }
        }
        self.equilibria += stages;
        let change = change(&out.stages[n], &made);
        (out.stages[n], out.strain_slopes[n]) = (made, strain_slopes);
        Ok(change)
    }

    /// Solves the collocation equations of the variables of a point over an interval, by Newton's
    /// method for the slopes at all stages.
    fn integrate_variables(
        &self,
        point: usize,
        length: f64,
        (begin, slopes): (&DVector<f64>, &mut [DVector<f64>]),
        stages: &mut [Stage],
    ) -> Outcome {
        let ((v, m, _), law) = (self.sizes(), self.shoot.model.tropism());
        let first = point * v;
        let set_variables = |slopes: &[DVector<f64>], stages: &mut [Stage]| {
            for (stage, upto) in stages.iter_mut().zip(&self.grid.upto) {
                (first..first + v)
                    .for_each(|k| stage.variables[k] = begin[k] + weighted(slopes, upto, k));
            }
        };
        let mut rates = vec![0.0; v];
        let mut last = f64::INFINITY;
        let mut factors = None;
        for _ in 0..PASSES {
            set_variables(slopes, stages);
            let mut residual = DVector::zeros(v * stages.len());
            for (i, stage) in stages.iter().enumerate() {
                let (y, x) = (
                    &stage.variables.as_slice()[first..][..v],
                    &stage.stimuli.as_slice()[point * m..][..m],
                );
                law.rates(y, x, &mut rates);
                (0..v).for_each(|a| residual[i * v + a] = length * rates[a] - slopes[i][first + a]);
            }
            let size = slopes
                .iter()
                .map(|slope| slope.rows(first, v).amax())
                .fold(0.0, f64::max);
            let size = size.max(begin.rows(first, v).amax()).max(f64::MIN_POSITIVE);
            // The matrix is kept while the iteration converges fast. That of linear laws is
            // constant.
            let lu = factors
                .take()
                .unwrap_or_else(|| self.matrix(point, length, stages).lu());
            let update = lu
                .solve(&residual)
                .filter(|x| x.iter().all(|x| x.is_finite()));
            let update = update.ok_or(CycleError::variables(PASSES, f64::INFINITY))?;
            for (i, slope) in slopes.iter_mut().enumerate() {
                let mut own = slope.rows_mut(first, v);
                own += update.rows(i * v, v);
            }
            let moved = update.amax();
            if moved <= CONVERGED * size || (moved < 1e-10 * size && moved >= last) {
                set_variables(slopes, stages);
                return Ok(());
            }
            factors = (moved < 0.01 * last).then_some(lu);
            last = moved;
        }
        Err(CycleError::variables(PASSES, last))
    }

    /// Matrix of the collocation equations of a point: I − h ∂rates/∂y ⊗ A, with the length h of an
    /// interval and the integrals A.
    pub fn matrix(&self, point: usize, length: f64, stages: &[Stage]) -> DMatrix<f64> {
        let ((v, ..), s) = (self.sizes(), self.grid.order());
        let mut out = DMatrix::identity(v * s, v * s);
        for (i, stage) in stages.iter().enumerate() {
            let [rates_y, ..] = self.derivatives(point, stage, &stage.variables);
            for j in 0..s {
                let mut block = out.view_mut((i * v, j * v), (v, v));
                block -= &rates_y * (length * self.grid.upto[i][j]);
            }
        }
        out
    }

    /// A point of the growth zone at the time of a stage.
    pub fn place(&self, point: usize, stage: &Stage) -> Growing {
        Growing {
            time: stage.force.environment().time,
            ..self.places[point]
        }
    }

    /// ∂rates/∂y, ∂rates/∂x, ∂gradient/∂y, ∂gradient/∂x of a point at a stage, for given variables
    /// of all points.
    pub fn derivatives(
        &self,
        point: usize,
        stage: &Stage,
        variables: &DVector<f64>,
    ) -> [DMatrix<f64>; 4] {
        let (v, m, _) = self.sizes();
        let (y, x) = (
            &variables.as_slice()[point * v..][..v],
            &stage.stimuli.as_slice()[point * m..][..m],
        );
        law_matrices(self.shoot.model.tropism(), &self.place(point, stage), y, x)
    }
}

/// The largest change of the strain between two iterations, relative to the strain.
fn change(before: &[Stage], now: &[Stage]) -> f64 {
    if before.len() != now.len() {
        return f64::INFINITY;
    }
    let pairs = before.iter().zip(now);
    pairs
        .map(|(a, b)| (&a.strain - &b.strain).amax() / b.strain.amax().max(f64::MIN_POSITIVE))
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests;
