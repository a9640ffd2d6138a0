//! Periodic orbits: fixed points of the time-stepping map, found by Newton's and Krylov's methods.

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use super::PeriodicSolver;
use super::newton::{Linear, angle_unknown, period_unknown};
use super::orbit::PeriodicOrbit;
use crate::cycle::autonomous::check_autonomous;
use crate::cycle::error::CycleError;
use crate::cycle::fourier::Circle;
use crate::cycle::map::grid::Grid;
use crate::cycle::map::march::{March, Path};
use crate::cycle::map::state::Start;
use crate::cycle::point::{Round, Steady};
use crate::error::ParameterError;
use crate::linear::visit_stimuli;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::stability::Root;
use crate::state::Reading;

/// Waves of a first guess.
const WAVES: usize = 3;
/// A strain that turns the tip by less than this, rad, is that of no orbit that anybody looks for.
const STANDS: f64 = 1e-6;

impl PeriodicSolver {
    /// The orbit that Newton's method reaches from a mode of the upright shoot, to and fro in its plane, with the tip moving by about
    /// `amplitude` (m). The shoot is not changed.
    ///
    /// # Errors
    /// A shoot that elongates or of which some tissue does not steer, a root that does not oscillate, no orbit near the start.
    pub fn from_mode(
        &self,
        shoot: &Shoot<impl Model>,
        root: &Root,
        amplitude: f64,
    ) -> Result<PeriodicOrbit, CycleError> {
        ParameterError::positive("frequency of the mode", root.value.im)?;
        ParameterError::positive("amplitude of the start", amplitude)?;
        let period = self.return_of(root);
        let mut march = self.march(shoot, period)?;
        let (what, points) = ("number of strains of the mode", root.strain.len());
        ParameterError::unless(points == march.places.len(), what, points as f64, "that of the points of the zone")?;
        for strain in &root.strain {
            ParameterError::finite("strain of the mode", strain.map(|x| x.re + x.im).sum())?;
        }
        let start = start_of_mode(&mut march, root, amplitude, period)?;
        self.find(march, start, period, true)
    }

    /// The orbit near which a run in time is: from the shoot's present state and its history, with a first guess of the period (s), good
    /// to a tenth. The shoot is not changed.
    ///
    /// A guess that is far off may lead to a multiple of the period. A run that is on its way from a swing to a circle may lead to
    /// either: excursion and multipliers tell.
    ///
    /// # Errors
    /// Those of [`from_mode`](Self::from_mode), or a shoot that no integrator has moved.
    pub fn from_run(&self, shoot: &Shoot<impl Model>, period: f64) -> Result<PeriodicOrbit, CycleError> {
        let march = self.march(shoot, period)?;
        let start = start_of_run(&march, period)?;
        self.find(march, start, period, true)
    }

    /// Whether half a swing is sought.
    fn half(&self) -> bool {
        self.angle.is_some_and(|angle| angle.cos() < 0.0)
    }

    /// The time after which a mode comes back, to about the angle of these settings, s.
    pub(crate) fn return_of(&self, root: &Root) -> f64 {
        if self.half() { 0.5 * root.period() } else { root.period() }
    }

    /// The time after which an orbit comes back in the way that these settings ask for, s.
    pub(crate) fn return_after(&self, orbit: &PeriodicOrbit) -> f64 {
        match orbit.settings.angle {
            None if self.half() => 0.5 * orbit.period,
            Some(_) if self.angle.is_none() && orbit.angle.cos() < 0.0 => 2.0 * orbit.period,
            _ => orbit.period,
        }
    }

    /// The angle by which an orbit comes back, or the guess of these settings where it came back as it was, rad.
    pub(crate) fn angle_of(&self, orbit: &PeriodicOrbit) -> f64 {
        if orbit.settings.angle.is_some() { orbit.angle } else { self.angle.unwrap_or(0.0) }
    }

    /// The orbit of a shoot near that of another with as many material points and the same number of variables: the shoot a little
    /// longer or stiffer. For the same shoot, on twice the intervals, the difference of the two orbits and of their multipliers says
    /// how accurate the first was.
    ///
    /// From a whole swing it leads to half a swing with an [`angle`](Self::angle) of π, and back without one. A rosette needs
    /// an angle; without one the nearest orbit may be a circle.
    ///
    /// # Errors
    /// Those of [`from_mode`](Self::from_mode), or a shoot with another number of points or variables.
    pub fn from_orbit(&self, shoot: &Shoot<impl Model>, orbit: &PeriodicOrbit) -> Result<PeriodicOrbit, CycleError> {
        let period = self.return_after(orbit);
        let mut march = self.march(shoot, period)?;
        let start = start_of_orbit(&march, orbit, period)?;
        march.set_angle(self.angle_of(orbit));
        self.find(march, start, period, true)
    }

    /// Newton's method for the state, and for the period if that is `free`, on as many intervals as the accuracy requires.
    pub(crate) fn find<M: Model>(
        &self,
        mut march: March<M>,
        mut start: Start,
        mut period: f64,
        free: bool,
    ) -> Result<PeriodicOrbit, CycleError> {
        let (mut solver, mut equilibria) = (*self, 0);
        loop {
            let mut orbit = solver.find_on_intervals(&mut march, start, period, free)?;
            equilibria += orbit.equilibria;
            if orbit.error <= self.accuracy {
                orbit.equilibria = equilibria;
                return Ok(orbit);
            }
            let (error, intervals) = (orbit.error, solver.intervals);
            solver = solver.refined().ok_or(CycleError::Unresolved { error, intervals })?;
            period = orbit.period;
            march = solver.march(march.shoot, period)?;
            march.set_angle(orbit.angle);
            start = start_of_orbit(&march, &orbit, period)?;
        }
    }

    /// The same on the intervals of these settings, with an estimate of the error.
    fn find_on_intervals<M: Model>(
        &self,
        march: &mut March<M>,
        mut start: Start,
        mut period: f64,
        free: bool,
    ) -> Result<PeriodicOrbit, CycleError> {
        let (mut iterations, mut equilibria, mut angle) = (0, 0, march.angle());
        let (mut kept, mut last): (Option<(Linear, f64)>, _) = (None, f64::INFINITY);
        loop {
            let astray = |error: CycleError| error.after(iterations, last);
            if march.keep_enough(&mut start, period).map_err(astray)? {
                // Of states of another size.
                kept = None;
            }
            let path = march.run(&start, period).map_err(astray)?;
            if iterations == 0 && free {
                check_autonomous(march.shoot, &path.stages[0][0].rod)?;
            }
            equilibria += path.equilibria;
            let flat = start.flat();
            let left = path.end.flat() - &flat;
            let residual = start.residual(&path.end, self.least(march.shoot, !free));
            // A state that stays comes back after any time.
            let strain = path.largest_move();
            if free && strain * march.shoot.rod().length() < STANDS {
                return Err(CycleError::Stationary { strain });
            }
            if residual <= self.tolerance {
                let linear = match kept {
                    Some((linear, _)) => linear,
                    None => linearised(march, &start, period, &path, free)?,
                };
                let error = self.checked_error(march, &start, period, &path, &linear, !free)?;
                let (settings, driven_from) = (*self, (!free).then(|| march.shoot.time()));
                return Ok(PeriodicOrbit {
                    period,
                    angle,
                    iterations,
                    equilibria,
                    residual,
                    error,
                    start,
                    settings,
                    driven_from,
                });
            }
            if iterations == self.max_iterations || !residual.is_finite() {
                return Err(CycleError::NotConverged { iterations, residual });
            }
            let linear = match Linear::that_serves(kept.take(), residual) {
                Some(linear) => linear,
                None => {
                    equilibria += if free { 2 * path.equilibria } else { 0 };
                    linearised(march, &start, period, &path, free)?
                }
            };
            let (change, others) = linear.step(&start, &left, &[0.0, 0.0], iterations)?;
            let stretch = others.first().copied().unwrap_or(0.0);
            let share = if free { share_of_step(&start, &change, stretch) } else { 1.0 };
            start = start.with_values(&(flat + change * share));
            period *= 1.0 + stretch * share;
            angle += others.get(1).copied().unwrap_or(0.0) * share;
            march.set_angle(angle);
            iterations += 1;
            last = residual;
            kept = Some((linear, residual));
            if free && start.strain.amax() * march.shoot.rod().length() < STANDS {
                return Err(CycleError::Stationary { strain: start.strain.amax() });
            }
        }
    }
}

/// The map about a path, with the period and the angle as unknowns if it is `free`.
fn linearised(
    march: &mut March<impl Model>,
    start: &Start,
    period: f64,
    path: &Path,
    free: bool,
) -> Result<Linear, CycleError> {
    let mut further = Vec::new();
    if free {
        let weights = start.weights();
        let time = period_unknown(march, start, period, path, &weights)?;
        let angle = angle_unknown(march, start, path, &weights)?;
        further.push(time);
        further.extend(angle);
    }
    Linear::of(march, period, path, further)
}

/// How much of a step is taken that changes the logarithm of the period by `stretch`. As for circular orbits: Newton's method for the
/// residual over the size of the strain.
fn share_of_step(start: &Start, change: &DVector<f64>, stretch: f64) -> f64 {
    let (size, next) = (start.strain.norm(), start.with_values(change).strain);
    if !(size > 0.0) {
        return 1.0;
    }
    let towards_zero = -next.dot(&start.strain) / start.strain.norm_squared();
    let most = (size / next.norm()).min(0.2 / stretch.abs());
    (1.0 - towards_zero).recip().clamp(-most, most)
}

/// The state of an orbit, on the grid of a march over a period (s).
pub(crate) fn start_of_orbit(
    march: &March<impl Model>,
    orbit: &PeriodicOrbit,
    period: f64,
) -> Result<Start, CycleError> {
    orbit.start.check(march.places.len(), march.variables)?;
    let mut start = orbit.start.clone();
    let old = Grid::new(orbit.settings.intervals, orbit.settings.stages);
    let ratio = (old.intervals as f64 / orbit.period) / (march.grid.intervals as f64 / period);
    if ratio != 1.0 || old.stages != march.grid.stages {
        start = start.on_grid(&old, &march.grid, march.kept, ratio);
    }
    // The past that is kept depends on the period.
    start.keep(march.kept);
    Ok(start)
}

/// The state in which a run in time is, with its past.
fn start_of_run(march: &March<impl Model>, period: f64) -> Result<Start, CycleError> {
    let (history, now, points) = (&march.shoot.state.history, march.shoot.time(), march.places.len());
    let (what, levels) = ("levels of the history of the run", history.levels());
    ParameterError::unless(levels >= 2, what, levels as f64, "those of a shoot that an integrator has moved")?;
    let length = period / march.grid.intervals as f64;
    let read = |reading: Reading| {
        let all = (0..points).flat_map(|point| history.read(&reading, point));
        DVector::from_iterator(march.variables * points, all)
    };
    let oldest = history.oldest().unwrap_or(now);
    let slope = |n: usize, stage: &f64| {
        // What is older than the run knows goes on as it was.
        let time = (now + (n as f64 - march.kept as f64 + stage) * length).max(oldest);
        read(history.slope(time)) * length
    };
    let interval = |n: usize| march.grid.stages.iter().map(|stage| slope(n, stage)).collect();
    let rod = march.shoot.rod();
    let bends = rod.points()[rod.zone()].iter().flat_map(|point| [point.intrinsic.x, point.intrinsic.y]);
    Ok(Start {
        strain: DVector::from_iterator(2 * points, bends),
        variables: read(history.reading(now, now)),
        slopes: (0..march.kept).map(interval).collect(),
    })
}

/// The state at t = 0 of a mode whose tip goes so far (m): strain and variables go to and fro, the variables as their stimuli make them.
pub(crate) fn start_of_mode<M: Model>(
    march: &mut March<M>,
    root: &Root,
    amplitude: f64,
    period: f64,
) -> Result<Start, CycleError> {
    let (m, p) = (march.stimuli, march.places.len());
    let circle = Circle::new(WAVES);
    // The state about which it is a mode; straight if upright.
    let rod = march.shoot.rod();
    let mean: Vec<Vector3<f64>> = rod.points()[rod.zone()].iter().map(|point| point.intrinsic).collect();
    // From where it is bent, not from where it passes through the mean.
    let parts = root.strain.iter().map(|s| (s.map(|x| x.re).norm_squared(), s.map(|x| x.im).norm_squared()));
    let (bent, passing) = parts.fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
    let first = if bent < passing { Complex::new(0.0, -amplitude) } else { Complex::from(amplitude) };
    let at = |phase: f64| {
        let turn = first * Complex::from_polar(1.0, phase);
        DVector::from_fn(2 * p, |k, _| mean[k / 2][k % 2] + (root.strain[k / 2][k % 2] * turn).re)
    };
    let mut stimuli = vec![DMatrix::zeros(m, circle.len()); p];
    for (j, phase) in circle.phases.iter().enumerate() {
        let (rod, force) = march.settle(&at(*phase), 0.0)?;
        visit_stimuli(march.shoot, &rod, &force, |i, _, x| stimuli[i].column_mut(j).copy_from_slice(x));
    }
    let round = Round::new(march.shoot.model.tropism(), &circle, root.value.im);
    let steady = round.settle_all(&march.places, &stimuli)?;
    Ok(start_of_waves(march, &circle, &steady, at(0.0), root.value.im * period))
}

/// The state at t = 0 of variables that are known round a circle, which is gone round by `turn` (rad) in a period.
pub(crate) fn start_of_waves(
    march: &March<impl Model>,
    circle: &Circle,
    steady: &[Steady],
    strain: DVector<f64>,
    turn: f64,
) -> Start {
    let (p, v) = (march.places.len(), march.variables);
    let in_interval = turn / march.grid.intervals as f64;
    // Values, or rates by time in intervals, at a time in intervals.
    let read = |time: f64, slope: bool| {
        let values = circle.earlier(-in_interval * time);
        let weights = if slope { &values * &circle.derivative * in_interval } else { values };
        let each = |k: usize| (weights.row(0) * steady[k / v].variables.row(k % v).transpose())[0];
        DVector::from_fn(v * p, |k, _| each(k))
    };
    let slopes = (0..march.kept).map(|n| {
        let begin = n as f64 - march.kept as f64;
        march.grid.stages.iter().map(|stage| read(begin + stage, true)).collect()
    });
    Start { strain, variables: read(0.0, false), slopes: slopes.collect() }
}
