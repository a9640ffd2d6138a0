//! Initial guesses of periodic orbits: modes, runs in time, and other orbits.

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use super::PeriodicSolver;
use super::orbit::PeriodicOrbit;
use crate::cycle::error::CycleError;
use crate::cycle::fourier::Circle;
use crate::cycle::map::grid::Grid;
use crate::cycle::map::march::March;
use crate::cycle::map::state::Start;
use crate::cycle::point::{Round, Steady};
use crate::cycle::sensitivity::look;
use crate::error::ParameterError;
use crate::model::Model;
use crate::stability::Root;
use crate::state::Reading;

/// Waves of a first guess.
const WAVES: usize = 3;

impl PeriodicSolver {
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
pub(crate) fn start_of_run(march: &March<impl Model>, period: f64) -> Result<Start, CycleError> {
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
    let (what, points) = ("number of strains of the mode", root.strain.len());
    ParameterError::unless(points == p, what, points as f64, "that of the points of the zone")?;
    for strain in &root.strain {
        ParameterError::finite("strain of the mode", strain.map(|x| x.re + x.im).sum())?;
    }
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
        look(march.shoot, &rod, &force, |i, x| stimuli[i].column_mut(j).copy_from_slice(x));
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
