//! The return map: it maps a state of a shoot of constant length to the state one period later.
//!
//! A period has equal intervals, with Radau points in each. The rates of strain and variables are polynomials in an interval, which
//! obey the laws at its Radau points; delayed values are those of the polynomials of the past. The grid is one of t/T: it
//! moves with the period, and the map is smooth.

use nalgebra::{DMatrix, DVector};

use super::grid::Grid;
use super::phase_state::{PhaseState, carried};
use super::rotation::{StateRotation, rotated_back};
use crate::cycle::autonomous::{check_gradients, driven_points};
use crate::cycle::error::CycleError;
use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
use crate::error::ParameterError;
use crate::linear::visit_stimuli;
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::scene::Scene;
use crate::shoot::Shoot;
use crate::tropism::{Declaration, Growing, TropismLaw, law_matrices};

/// Tolerance of the frames of an equilibrium, rad, of which differences are taken.
pub(crate) const PRECISE: f64 = 1e-13;
/// Largest delay in periods: a state contains the past over the longest delay.
const PERIODS: f64 = 16.0;
/// Largest number of fixed-point iterations over an interval whose laws read values inside it, and of Newton iterations for variables.
pub(super) const PASSES: usize = 60;
/// Largest relative change of a converged iteration.
pub(super) const CONVERGED: f64 = 1e-14;

/// The shoot at a stage of an interval.
#[derive(Debug, Clone)]
pub(crate) struct Stage {
    pub rod: Rod,
    pub strain: DVector<f64>,
    /// Stimuli, point by point.
    pub stimuli: DVector<f64>,
    pub variables: DVector<f64>,
    /// Every variable at its delay.
    pub past: DVector<f64>,
}

/// The trajectory over a period.
pub(crate) struct Trajectory {
    pub end: PhaseState,
    /// Stages, interval by interval.
    pub stages: Vec<Vec<Stage>>,
    /// The strain at the beginning of every interval, and at the end.
    pub strains: Vec<DVector<f64>>,
    /// The rates of the strain at the stages, times an interval's length.
    pub strain_slopes: Vec<Vec<DVector<f64>>>,
}

impl Trajectory {
    /// Largest change of the strain from the start, 1/m.
    pub fn largest_move(&self) -> f64 {
        let all = self.stages.iter().flatten().map(|stage| (&stage.strain - &self.strains[0]).amax());
        all.fold(0.0, f64::max)
    }
}

/// The return map of a shoot.
pub(crate) struct ReturnMap<'a, M: Model> {
    pub shoot: &'a Shoot<M>,
    pub grid: Grid,
    pub places: Vec<Growing>,
    pub regr: Vec<f64>,
    /// Number of intervals of the past in a state.
    pub kept: usize,
    pub variables: usize,
    pub stimuli: usize,
    pub reads_present: bool,
    pub delays: Vec<Option<f64>>,
    /// Rotation that is undone at the end of a period, for relative periodic orbits.
    pub turn: Option<StateRotation>,
    rod: Rod,
    /// Rods at the stages of the last run: initial guesses of the next one.
    pub guesses: Vec<Rod>,
    /// Equilibria that runs have solved.
    pub equilibria: usize,
    solver: NewtonSolver,
}

/// A delayed value: the interval in which it lies, relative to the present one, and the weights of its slopes.
pub(crate) type Reading = (isize, Vec<f64>);

impl<'a, M: Model> ReturnMap<'a, M> {
    /// The map on a grid. An `angle` (rad) is given for relative periodic orbits.
    pub fn new(shoot: &'a Shoot<M>, grid: Grid, period: f64, angle: Option<f64>) -> Result<Self, CycleError> {
        let (places, regr) = driven_points(shoot)?;
        ParameterError::positive("period", period)?;
        ParameterError::unless(period.recip().is_finite(), "period", period, "not next to zero (s)")?;
        let rod = shoot.state.rod.clone();
        let declaration = Declaration::of(shoot.model.tropism());
        declaration.check()?;
        let delays: Vec<Option<f64>> = declaration.variables().iter().map(|variable| variable.delay).collect();
        let kept = kept(longest_delay(&declaration), grid.intervals, period)?;
        let size = declaration.size();
        Ok(Self {
            shoot,
            grid,
            places,
            regr,
            kept,
            variables: size.variables,
            stimuli: size.stimuli,
            reads_present: size.reads_present,
            delays,
            turn: angle.map(|angle| StateRotation::new(&declaration, angle)).transpose()?,
            rod,
            guesses: Vec::new(),
            equilibria: 0,
            solver: NewtonSolver::with_tolerance(PRECISE),
        })
    }

    /// Angle of the rotation that is undone, rad.
    pub fn angle(&self) -> f64 {
        self.turn.as_ref().map_or(0.0, |turn| turn.angle)
    }

    /// Sets this angle if there is a rotation.
    pub fn set_angle(&mut self, angle: f64) {
        self.turn.iter_mut().for_each(|turn| turn.angle = angle);
    }

    /// The delayed value of every variable at every stage, and whether any lies in the present interval.
    pub fn readings(&self, period: f64) -> (Vec<Vec<Option<Reading>>>, bool) {
        let length = period / self.grid.intervals as f64;
        let read = |stage: f64, delay: f64| {
            let at = stage - delay / length;
            // The last point of an interval belongs to it.
            let interval = at.ceil() - 1.0;
            (interval as isize, self.grid.integrals(at - interval))
        };
        let stages = self.grid.stages.iter();
        let all: Vec<Vec<Option<Reading>>> =
            stages.map(|stage| self.delays.iter().map(|delay| delay.map(|d| read(*stage, d))).collect()).collect();
        let inside = |reading: &Option<Reading>| reading.as_ref().is_some_and(|(interval, _)| *interval >= 0);
        let implicit = self.reads_present || all.iter().flatten().any(inside);
        (all, implicit)
    }

    /// The shoot in equilibrium with a strain, at a time after the start (s).
    pub fn equilibrate_at(&mut self, strain: &DVector<f64>, after: f64) -> Result<(Rod, InternalForce), CycleError> {
        let (scene, time) = (self.shoot.model.scene(), self.shoot.environment().time + after);
        let environment = scene.environment(time);
        let first = self.rod.zone().start;
        for k in 0..strain.len() {
            self.rod.points_mut()[first + k / 2].intrinsic[k % 2] = strain[k];
        }
        self.rod.set_base(scene.base(time))?;
        let force = InternalForce::of(&self.rod, self.shoot.model.load(), &environment);
        let _ = self.solver.equilibrate(&mut self.rod, self.shoot.model.constitutive(), &force)?;
        Ok((self.rod.clone(), force))
    }

    /// Integrates over a period.
    pub fn run(&mut self, start: &PhaseState, period: f64) -> Result<Trajectory, CycleError> {
        let (k, stages) = (self.grid.intervals, self.grid.order());
        let longest = self.delays.iter().flatten().copied().fold(0.0, f64::max);
        let (what, needed) = ("longest delay, in intervals", longest * k as f64 / period);
        ParameterError::unless(needed <= self.kept as f64, what, needed, "within the past that the state holds")?;
        let (readings, implicit) = self.readings(period);
        let mut slopes = start.slopes.clone();
        let mut begins = start.begins(&self.grid.whole);
        let mut out = Trajectory {
            end: start.clone(),
            stages: Vec::new(),
            strains: vec![start.strain.clone()],
            strain_slopes: Vec::new(),
        };
        let length = period / k as f64;
        for n in 0..k {
            // Initial guess of the slopes in this interval.
            slopes.push(slopes.last().cloned().unwrap_or_default());
            let mut made: Vec<Stage> = Vec::new();
            let mut last = f64::INFINITY;
            for pass in 0..PASSES {
                let now = self.interval(n, length, &readings, &begins, &mut slopes, &made, &out)?;
                self.equilibria += stages;
                let change = change(&made, &now.0);
                made = now.0;
                // Changes stagnate at the rounding of equilibria.
                let converged = change <= CONVERGED || (change < 10.0 * PRECISE && change >= last);
                last = change;
                if pass == 0 && implicit || pass > 0 && !converged {
                    if pass + 1 == PASSES {
                        return Err(CycleError::Variables { change });
                    }
                    continue;
                }
                out.strain_slopes.push(now.1);
                break;
            }
            out.strains.push(carried(&out.strains[n], &out.strain_slopes[n], &self.grid.whole));
            begins.push(carried(&begins[self.kept + n], &slopes[self.kept + n], &self.grid.whole));
            out.stages.push(made);
        }
        self.guesses.clear();
        self.guesses.extend(out.stages.iter().flatten().map(|stage| stage.rod.clone()));
        out.end = PhaseState {
            strain: out.strains[k].clone(),
            variables: begins[self.kept + k].clone(),
            slopes: slopes[k..].to_vec(),
        };
        out.end = rotated_back(self.turn.as_ref(), out.end);
        Ok(out)
    }

    /// One iteration over an interval. Returns its stages and the slopes of the strain, and writes the slopes of the variables.
    #[allow(clippy::too_many_arguments)]
    fn interval(
        &mut self,
        n: usize,
        length: f64,
        readings: &[Vec<Option<Reading>>],
        begins: &[DVector<f64>],
        slopes: &mut [Vec<DVector<f64>>],
        before: &[Stage],
        path: &Trajectory,
    ) -> Result<(Vec<Stage>, Vec<DVector<f64>>), CycleError> {
        let (v, m, p, stages) = (self.variables, self.stimuli, self.places.len(), self.grid.order());
        let law = self.shoot.model.tropism();
        let present = self.kept + n;
        let mut past: Vec<DVector<f64>> = vec![DVector::zeros(v * p); stages];
        let mut strain_slopes: Vec<DVector<f64>> = vec![DVector::zeros(2 * p); stages];
        let mut gradients = Vec::with_capacity(stages * p);
        for i in 0..stages {
            for (a, reading) in readings[i].iter().enumerate() {
                let Some((interval, weights)) = reading else { continue };
                let at = (present as isize + interval) as usize;
                for point in 0..p {
                    let k = point * v + a;
                    let sum: f64 = weights.iter().zip(&slopes[at]).map(|(w, slope)| w * slope[k]).sum();
                    past[i][k] = begins[at][k] + sum;
                }
            }
            for (point, place) in self.places.iter().enumerate() {
                let time = place.time + (n as f64 + self.grid.stages[i]) * length;
                let at = Growing::new(time, place.section, place.apex_distance);
                let now = before.get(i).filter(|_| self.reads_present);
                let now = now.map_or(&[][..], |stage| &stage.stimuli.as_slice()[point * m..(point + 1) * m]);
                if self.reads_present && now.is_empty() {
                    // There are no stimuli before the first iteration.
                    continue;
                }
                let gradient = law.gradient(&at, &past[i].as_slice()[point * v..(point + 1) * v], now);
                gradients.push(gradient);
                for c in 0..2 {
                    strain_slopes[i][2 * point + c] = length * self.regr[point] * gradient[c];
                }
            }
        }
        check_gradients(gradients.iter())?;
        let mut made = Vec::with_capacity(stages);
        for (i, past) in past.into_iter().enumerate() {
            let strain = carried(&path.strains[n], &strain_slopes, &self.grid.upto[i]);
            if let Some(guess) = self.guesses.get(n * stages + i) {
                // Only the shape is copied: the guess may belong to a neighbouring shoot of another length.
                self.rod.guess_shape(guess);
            }
            let (rod, force) = self.equilibrate_at(&strain, (n as f64 + self.grid.stages[i]) * length)?;
            let mut stimuli = DVector::zeros(m * p);
            visit_stimuli(self.shoot, &rod, &force, |point, _, x| {
                stimuli.as_mut_slice()[point * m..(point + 1) * m].copy_from_slice(x);
            });
            made.push(Stage { rod, strain, stimuli, variables: DVector::zeros(v * p), past });
        }
        for point in 0..p {
            self.integrate_variables(point, length, &begins[present], &mut slopes[present], &mut made)?;
        }
        Ok((made, strain_slopes))
    }

    /// The variables of a point over an interval: Newton's method for the slopes at all stages.
    fn integrate_variables(
        &self,
        point: usize,
        length: f64,
        begin: &DVector<f64>,
        slopes: &mut [DVector<f64>],
        stages: &mut [Stage],
    ) -> Result<(), CycleError> {
        let (v, m, s) = (self.variables, self.stimuli, self.grid.order());
        if v == 0 {
            return Ok(());
        }
        let law = self.shoot.model.tropism();
        let own = point * v..(point + 1) * v;
        let mut rates = vec![0.0; v];
        let mut last = f64::INFINITY;
        let mut factors = None;
        for _ in 0..PASSES {
            for i in 0..s {
                for (a, k) in own.clone().enumerate() {
                    let sum: f64 = slopes.iter().zip(&self.grid.upto[i]).map(|(slope, w)| w * slope[k]).sum();
                    stages[i].variables[point * v + a] = begin[k] + sum;
                }
            }
            let mut left = DVector::zeros(v * s);
            for (i, stage) in stages.iter().enumerate() {
                let (y, x) = (&stage.variables.as_slice()[own.clone()], &stage.stimuli.as_slice()[point * m..][..m]);
                law.rates(y, x, &mut rates);
                for a in 0..v {
                    left[i * v + a] = length * rates[a] - slopes[i][point * v + a];
                }
            }
            let size = slopes.iter().map(|slope| slope.rows(point * v, v).amax()).fold(0.0, f64::max);
            let size = size.max(begin.rows(point * v, v).amax()).max(f64::MIN_POSITIVE);
            // The matrix is kept while the iteration converges fast; that of linear laws is constant.
            let lu = factors.take().unwrap_or_else(|| self.matrix(point, length, stages).lu());
            let change = lu.solve(&left);
            let change = change.filter(|x| x.iter().all(|x| x.is_finite()));
            let change = change.ok_or(CycleError::Variables { change: f64::INFINITY })?;
            for i in 0..s {
                for a in 0..v {
                    slopes[i][point * v + a] += change[i * v + a];
                }
            }
            let moved = change.amax();
            if moved <= CONVERGED * size || (moved < 1e-10 * size && moved >= last) {
                for i in 0..s {
                    for (a, k) in own.clone().enumerate() {
                        let sum: f64 = slopes.iter().zip(&self.grid.upto[i]).map(|(slope, w)| w * slope[k]).sum();
                        stages[i].variables[point * v + a] = begin[k] + sum;
                    }
                }
                return Ok(());
            }
            factors = (moved < 0.01 * last).then_some(lu);
            last = moved;
        }
        Err(CycleError::Variables { change: last })
    }

    /// Matrix of the collocation equations of a point: identity − length ∂rates/∂y · integrals of the slopes.
    pub fn matrix(&self, point: usize, length: f64, stages: &[Stage]) -> DMatrix<f64> {
        let (v, s) = (self.variables, self.grid.order());
        let mut out = DMatrix::identity(v * s, v * s);
        for (i, stage) in stages.iter().enumerate() {
            let [rates_y, ..] = self.derivatives(point, stage, false);
            for j in 0..s {
                let mut block = out.view_mut((i * v, j * v), (v, v));
                block -= &rates_y * (length * self.grid.upto[i][j]);
            }
        }
        out
    }

    /// ∂rates/∂y, ∂rates/∂x, ∂gradient/∂y, ∂gradient/∂x of a point at a stage, at the present variables or the delayed ones.
    pub fn derivatives(&self, point: usize, stage: &Stage, past: bool) -> [DMatrix<f64>; 4] {
        let (v, m) = (self.variables, self.stimuli);
        let y = if past { &stage.past } else { &stage.variables };
        let (y, x) = (&y.as_slice()[point * v..][..v], &stage.stimuli.as_slice()[point * m..][..m]);
        law_matrices(self.shoot.model.tropism(), &self.places[point], y, x)
    }
}

/// The longest delay of some laws, s.
fn longest_delay(laws: &Declaration) -> f64 {
    laws.variables().iter().filter_map(|variable| variable.delay).fold(0.0, f64::max)
}

/// Extends the past of a state if the delays of the laws have become longer than it, against the period (s). Returns whether it did.
pub(crate) fn extend_past(
    law: &impl TropismLaw,
    start: &mut PhaseState,
    intervals: usize,
    period: f64,
) -> Result<bool, CycleError> {
    let (longest, own) = (longest_delay(&Declaration::of(law)), start.slopes.len());
    // The differences by the period change it by far less than a tenth of an interval.
    let short = longest * intervals as f64 / period + 0.1 > own as f64;
    if short {
        start.keep(own.max(kept(longest, intervals, period)?));
    }
    Ok(short)
}

/// Intervals of the past that hold the longest delay: half an interval more than now, since the period moves while it is sought.
fn kept(longest: f64, intervals: usize, period: f64) -> Result<usize, CycleError> {
    let (what, periods) = ("longest delay, in periods", longest / period);
    ParameterError::unless(periods <= PERIODS, what, periods, "at most 16: a state holds all that is read")?;
    Ok(((longest * intervals as f64 / period + 0.5).ceil() as usize).max(1))
}

/// The largest change of the strain between two passes, relative to it.
fn change(before: &[Stage], now: &[Stage]) -> f64 {
    if before.len() != now.len() {
        return f64::INFINITY;
    }
    let pairs = before.iter().zip(now);
    pairs.map(|(a, b)| (&a.strain - &b.strain).amax() / b.strain.amax().max(f64::MIN_POSITIVE)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests;
