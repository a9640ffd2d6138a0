//! One step in time, shared by the integrators.

use nalgebra::Vector3;

use super::feedback::Quadrature;
use super::guess::extrapolate;
use super::local::{Levels, LocalSolver};
use super::{IntegrationError, Statistics, mesh};
use crate::equilibrium::EquilibriumSolver;
use crate::error::ParameterError;
use crate::growth::GrowthLaw;
use crate::load::InternalForce;
use crate::model::Model;
use crate::scene::{Environment, Scene};
use crate::sensing::visit_sites;
use crate::shoot::Shoot;
use crate::state::Level;
use crate::state::State;
use crate::tropism::TropismLaw;

/// Stimuli are interpolated in time through so many levels: fourth order.
const LEVELS: usize = 4;
/// After a jump the first step is this fraction of a full one, and the following ones double what has passed. Its stimuli
/// are interpolated through two levels only: an error of third order, in a step 64 times shorter.
const FIRST_STEP: f64 = 1.0 / 64.0;

/// How often and how closely a step is repeated with what it led to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Correction {
    /// Largest change of an angle that ends the repetition, rad.
    pub tolerance: f64,
    /// Bound on the repetitions.
    pub most: usize,
}

/// An interval of time, and how many growing elements leave the zone in it.
#[derive(Debug, Clone, Copy)]
struct Step {
    from: f64,
    to: f64,
    leaving: usize,
}

/// Memory for stepping; no state.
#[derive(Debug, Default)]
pub(super) struct Stepper {
    quadrature: Quadrature,
    exit_quadrature: Quadrature,
    local: LocalSolver,
    pub force: InternalForce,
    delays: Vec<f64>,
    /// Intrinsic strain and distance from the apex of the zone's points at the start of the step.
    starts: Vec<(Vector3<f64>, f64)>,
    variables: Vec<f64>,
    /// Rows of levels that are not in use.
    spare: Vec<Vec<f64>>,
    backup: Option<State>,
    statistics: Statistics,
}

impl Stepper {
    /// Runs `work` on the shoot; if it fails, puts the shoot back as it was.
    pub fn guarded<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        work: impl FnOnce(&mut Self, &mut Shoot<M>) -> Result<(), IntegrationError>,
    ) -> Result<Statistics, IntegrationError> {
        self.statistics = Statistics::default();
        self.local.halvings = 0;
        match &mut self.backup {
            Some(backup) => backup.clone_from(&shoot.state),
            None => self.backup = Some(shoot.state.clone()),
        }
        if let Err(error) = work(self, shoot) {
            if let Some(backup) = &self.backup {
                shoot.state.clone_from(backup);
            }
            return Err(error);
        }
        self.statistics.halvings = self.local.halvings;
        Ok(self.statistics)
    }

    /// How far back the laws look at least, s; zero if they read what is present.
    pub fn shortest_delay(&mut self, tropism: &impl TropismLaw) -> f64 {
        self.delays.resize(tropism.variables(), 0.0);
        tropism.delays(&mut self.delays);
        let shortest = self.delays.iter().copied().fold(f64::INFINITY, f64::min);
        if tropism.senses_now() { 0.0 } else { shortest }
    }

    /// Carries the shoot to `until` in steps of at most `size`.
    pub fn run(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        until: f64,
        size: f64,
        correction: Option<Correction>,
    ) -> Result<(), IntegrationError> {
        self.check_history(shoot)?;
        self.make_room(&mut shoot.state, size, until);
        while shoot.state.time < until {
            let t = shoot.state.time;
            let jump = shoot.model.next_discontinuity(t);
            let target = until.min(jump);
            let since = t - shoot.state.smooth_since;
            // Rounding must not turn a full step into two.
            let mut step = if since < size * (1.0 - 1e-9) { since.max(FIRST_STEP * size) } else { size };
            // Tissue that leaves the zone in one step becomes one element, which must not be longer than others are.
            let zone = shoot.model.growth().zone_length();
            if shoot.model.growth().elongates() && zone.is_finite() {
                while zone - shoot.model.growth().flow(zone, t + step, t).0 > shoot.mesh.growing {
                    step *= 0.5;
                }
            }
            let rest = target - t;
            let end = if rest <= step * (1.0 + 1e-9) {
                target
            } else if rest < 2.0 * step {
                // Two equal steps rather than one and a remnant, beside which interpolation would lose digits.
                t + 0.5 * rest
            } else {
                t + step
            };
            let told = end > t;
            ParameterError::unless(told, "time step", step, "long enough to be told from the time by rounding (s)")?;
            self.step(shoot, solver, end, correction)?;
            if end == jump {
                self.pass_jump(shoot, solver)?;
            }
        }
        Ok(())
    }

    /// One step to time `to`.
    fn step(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        to: f64,
        correction: Option<Correction>,
    ) -> Result<(), IntegrationError> {
        let from = shoot.state.time;
        let leaving =
            mesh::prepare(&mut shoot.state, shoot.model.growth(), &shoot.mesh, from, to, &mut self.statistics);
        let step = Step { from, to, leaving };
        let rod = &shoot.state.rod;
        let first = rod.first_growing() * rod.order().points();
        self.starts.clear();
        self.starts.extend(rod.points()[first..].iter().map(|point| (point.intrinsic, point.apex_distance)));
        self.push_level(&mut shoot.state, to);
        self.drive(shoot, step)?;
        self.grow(shoot, step);
        extrapolate(&mut shoot.state, to);
        shoot.state.time = to;
        let environment = place(shoot, to)?;
        self.settle(shoot, solver, &environment)?;
        self.sense(shoot, &environment)?;
        self.carry(shoot, step)?;
        if let Some(Correction { tolerance, most }) = correction {
            for done in 0.. {
                let change = self.drive(shoot, step)?;
                if change <= tolerance {
                    break;
                }
                if done == most {
                    return Err(IntegrationError::NotSettled { time: to, corrections: most, change });
                }
                self.settle(shoot, solver, &environment)?;
                self.sense(shoot, &environment)?;
                self.carry(shoot, step)?;
            }
        }
        shoot.state.mature(leaving);
        self.forget(&mut shoot.state);
        self.statistics.steps += 1;
        Ok(())
    }

    /// Reads the laws' delays, and refuses a state whose history belongs to other laws.
    fn check_history(&mut self, shoot: &Shoot<impl Model>) -> Result<(), ParameterError> {
        let (law, history) = (shoot.model.tropism(), &shoot.state.history);
        self.delays.resize(law.variables(), 0.0);
        law.delays(&mut self.delays);
        for delay in &self.delays {
            ParameterError::unless(*delay >= 0.0, "delay of a tropism law", *delay, "zero or positive (s)")?;
        }
        let known = (history.variables, history.stimuli) == (law.variables(), law.stimuli());
        let stands = history.variables as f64;
        ParameterError::unless(known, "number of variables in the state", stands, "that of the shoot's laws")?;
        let longest = longest(&self.delays);
        let oldest = history.levels.front().map_or(f64::INFINITY, |level| level.time);
        let reach = shoot.state.time - oldest;
        ParameterError::unless(
            reach >= longest * (1.0 - 1e-9),
            "time that the state looks back",
            reach,
            "at least the longest delay of the shoot's laws (s)",
        )
    }

    /// Sets memory aside for all levels that the history will hold, so that no later step asks for any.
    fn make_room(&mut self, state: &mut State, size: f64, until: f64) {
        // Full steps over the longest delay, or to the end if that comes first, those of a start, and the ones around the
        // ends.
        let (longest, known) = (longest(&self.delays), state.history.levels.len());
        let full = (longest / size).min(known as f64 + (until - state.time) / size);
        let wanted = full.min(1e6) as usize + (1.0 / FIRST_STEP).log2() as usize + 2 * LEVELS;
        let history = &mut state.history;
        let numbers = history.levels.back().map_or(0, |level| level.rows.len());
        history.levels.reserve(wanted.saturating_sub(history.levels.len()));
        self.spare.reserve(wanted.saturating_sub(self.spare.len()));
        while self.spare.len() + history.levels.len() < wanted {
            self.spare.push(Vec::with_capacity(numbers));
        }
    }

    /// Appends a level at `time` whose variables go on at their present rates; the stimuli stay. A first guess: what
    /// reads only the past does not see it.
    fn push_level(&mut self, state: &mut State, time: f64) {
        let history = &mut state.history;
        let (v, width) = (history.variables, history.width());
        let Some(last) = history.levels.back() else { return };
        let mut rows = self.spare.pop().unwrap_or_default();
        rows.clone_from(&last.rows);
        let step = time - last.time;
        for row in rows.chunks_exact_mut(width.max(1)) {
            for i in 0..v {
                row[i] += step * row[v + i];
            }
        }
        history.levels.push_back(Level { time, rows });
    }

    /// Differential growth over the step: sets the intrinsic strain of every point of the zone, up to its exit. Returns
    /// by how much that changes an angle, rad.
    fn drive(&mut self, shoot: &mut Shoot<impl Model>, step: Step) -> Result<f64, IntegrationError> {
        let (growth, tropism) = (shoot.model.growth(), shoot.model.tropism());
        let Step { from, to, leaving } = step;
        let smooth = tropism.senses_now().then(|| smooth_levels(&shoot.state));
        let length = shoot.state.rod.length();
        let rod = &mut shoot.state.rod;
        let p = rod.order().points();
        let first = rod.first_growing() * p;
        let (levels, width) = (&shoot.state.history.levels, shoot.state.history.width());
        self.quadrature.prepare(levels, &self.delays, smooth.clone(), from, to);
        let mut largest = 0.0_f64;
        for (i, (point, (intrinsic, place))) in rod.points[first..].iter_mut().zip(&self.starts).enumerate() {
            let row = i * width..(i + 1) * width;
            let motion = (*place, from);
            let exit = if i < leaving * p { growth.exit_time(*place, from, to) } else { None };
            let change = match exit {
                Some(exit) => {
                    self.exit_quadrature.prepare(levels, &self.delays, smooth.clone(), from, exit);
                    self.exit_quadrature.integrate(growth, tropism, levels, row, point.radius, motion)
                }
                None => self.quadrature.integrate(growth, tropism, levels, row, point.radius, motion),
            };
            if !change.sum().is_finite() {
                return Err(IntegrationError::NotFinite { what: "growth gradient", time: to });
            }
            let new = intrinsic + change;
            largest = largest.max((new - point.intrinsic).norm());
            point.intrinsic = new;
        }
        Ok(largest * length)
    }

    /// Moves the points and nodes of the zone; those of the first elements leave it.
    fn grow(&mut self, shoot: &mut Shoot<impl Model>, step: Step) {
        let growth = shoot.model.growth();
        if !growth.elongates() {
            return;
        }
        let Step { from, to, leaving } = step;
        let rod = &mut shoot.state.rod;
        let p = rod.order().points();
        let first = rod.first_growing();
        for (i, point) in rod.points[first * p..].iter_mut().enumerate() {
            let mut end = to;
            if i < leaving * p {
                // Points in front of the node on the boundary leave before it does, which is at the end of the step.
                end = growth.exit_time(point.apex_distance, from, to).unwrap_or(to);
                point.exit_time = end;
            }
            let (distance, stretch) = growth.flow(point.apex_distance, from, end);
            point.apex_distance = distance;
            point.jacobian *= stretch;
        }
        for node in &mut rod.node_distance[first..] {
            *node = growth.flow(*node, from, to).0;
        }
    }

    /// Finds the equilibrium.
    pub fn settle(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        environment: &Environment,
    ) -> Result<(), IntegrationError> {
        self.force.update(&shoot.state.rod, shoot.model.load(), environment);
        let found = solver
            .equilibrate(&mut shoot.state.rod, shoot.model.constitutive(), &self.force)
            .map_err(|source| IntegrationError::Equilibrium { time: environment.time, source })?;
        self.statistics.equilibria += 1;
        self.statistics.iterations += found.iterations;
        self.statistics.factorisations += found.factorisations;
        self.statistics.evaluations += found.evaluations;
        self.statistics.equilibrium_error = self.statistics.equilibrium_error.max(found.error);
        Ok(())
    }

    /// Writes the stimuli of the present equilibrium to the last level.
    pub fn sense(&mut self, shoot: &mut Shoot<impl Model>, environment: &Environment) -> Result<(), IntegrationError> {
        if shoot.model.tropism().stimuli() == 0 {
            return Ok(());
        }
        let history = &mut shoot.state.history;
        let (v, width) = (history.variables, history.width());
        let Some(level) = history.levels.back_mut() else { return Ok(()) };
        let rows = &mut level.rows;
        let position = shoot.model.tropism().needs_position();
        let mut finite = true;
        visit_sites(&shoot.state.rod, shoot.model.constitutive(), &self.force, position, |i, site| {
            let stimuli = &mut rows[i * width + 2 * v..(i + 1) * width];
            shoot.model.tropism().sense(site, stimuli);
            finite &= stimuli.iter().all(|x| x.is_finite());
        });
        if finite { Ok(()) } else { Err(IntegrationError::NotFinite { what: "stimulus", time: environment.time }) }
    }

    /// Carries the variables from the last level but one to the last.
    fn carry(&mut self, shoot: &mut Shoot<impl Model>, step: Step) -> Result<(), IntegrationError> {
        let tropism = shoot.model.tropism();
        let (v, width) = (shoot.state.history.variables, shoot.state.history.width());
        if v == 0 {
            return Ok(());
        }
        let smooth = smooth_levels(&shoot.state);
        let size = step.to - step.from;
        self.variables.resize(v, 0.0);
        let levels = &mut shoot.state.history.levels;
        let Some(mut new) = levels.pop_back() else { return Ok(()) };
        let mut times = [0.0; LEVELS];
        for (time, level) in times.iter_mut().zip(levels.range(smooth.start..)) {
            *time = (level.time - step.from) / size;
        }
        let count = smooth.len();
        times[count - 1] = 1.0;
        self.local.prepare(tropism, size, Levels { count, times });
        let mut failed = None;
        for i in 0..new.rows.len() / width {
            let row = i * width..(i + 1) * width;
            let (past, target) = (&levels[levels.len() - 1].rows[row.clone()], &mut new.rows[row.clone()]);
            self.variables.copy_from_slice(&past[..v]);
            let (values, stimuli) = target.split_at_mut(2 * v);
            let mut seen: [&[f64]; LEVELS] = [&[]; LEVELS];
            for (to, level) in seen.iter_mut().zip(levels.range(smooth.start..)) {
                *to = &level.rows[row.clone()][2 * v..];
            }
            seen[count - 1] = stimuli;
            if !self.local.carry(tropism, &seen, &mut self.variables) {
                failed = Some(i);
                break;
            }
            let (now, rates) = values.split_at_mut(v);
            now.copy_from_slice(&self.variables);
            tropism.rates(now, stimuli, rates);
        }
        levels.push_back(new);
        match failed {
            None => Ok(()),
            Some(i) => {
                let first = shoot.state.rod.first_growing() * shoot.state.rod.order().points();
                Err(IntegrationError::Variables { time: step.to, point: first + i })
            }
        }
    }

    /// Drops the levels that nothing will read again.
    fn forget(&mut self, state: &mut State) {
        let horizon = state.time - longest(&self.delays);
        let levels = &mut state.history.levels;
        while levels.len() > LEVELS && levels[1].time <= horizon {
            if let Some(level) = levels.pop_front() {
                self.spare.push(level.rows);
            }
        }
    }

    /// A load or the scene jumps just after the present time: finds the shape after the jump and begins afresh from it.
    fn pass_jump(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
    ) -> Result<(), IntegrationError> {
        let after = shoot.state.time.next_up();
        let environment = place(shoot, after)?;
        self.settle(shoot, solver, &environment)?;
        let time = shoot.state.time;
        self.push_level(&mut shoot.state, time);
        self.sense(shoot, &environment)?;
        let (v, width) = (shoot.state.history.variables, shoot.state.history.width());
        if let Some(level) = shoot.state.history.levels.back_mut() {
            for row in level.rows.chunks_exact_mut(width.max(1)) {
                let (values, stimuli) = row.split_at_mut(2 * v);
                let (now, rates) = values.split_at_mut(v);
                shoot.model.tropism().rates(now, stimuli, rates);
            }
        }
        shoot.state.smooth_since = time;
        shoot.state.known = 0;
        Ok(())
    }
}

/// Moves the base to where it is at `time`, and says what gravity is then.
pub(super) fn place(shoot: &mut Shoot<impl Model>, time: f64) -> Result<Environment, IntegrationError> {
    let base = shoot.model.scene().base(time);
    let environment = shoot.model.scene().environment(time);
    // A quaternion that is no rotation would be normalised into one that nobody meant.
    if !((base.norm() - 1.0).abs() < 1e-9) {
        return Err(IntegrationError::NotFinite { what: "base frame (a unit quaternion)", time });
    }
    if !environment.gravity.norm().is_finite() {
        return Err(IntegrationError::NotFinite { what: "gravity", time });
    }
    shoot.state.rod.set_base(base);
    Ok(environment)
}

/// The longest delay with which a variable is read, s.
pub(super) fn longest(delays: &[f64]) -> f64 {
    delays.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max)
}

/// The levels through which stimuli are interpolated: the last few, none from before a jump.
fn smooth_levels(state: &State) -> std::ops::Range<usize> {
    let levels = &state.history.levels;
    let first = levels.partition_point(|level| level.time <= state.smooth_since).saturating_sub(1);
    first.max(levels.len().saturating_sub(LEVELS))..levels.len()
}
