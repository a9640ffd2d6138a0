//! Periodic orbits: fixed points of the time-stepping map, found by Newton's and Krylov's methods.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use super::autonomous::{check_autonomous, check_period};
use super::error::CycleError;
use super::fourier::Circle;
use super::gmres::{Krylov, gmres};
use super::grid::Grid;
use super::march::{March, Path};
use super::point::{Round, Steady};
use super::sensitivity::look;
use super::state::{Start, carried};
use super::variation::Variation;
use crate::error::ParameterError;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::stability::Root;

/// Waves of a first guess.
const WAVES: usize = 3;
/// Krylov's subspaces grow up to this: a return map contracts all but a handful of directions.
const KRYLOV: usize = 80;
/// What a step of Newton's method leaves of its linear problem.
const LINEAR: f64 = 1e-4;
/// A strain that turns the tip by less than this, rad, is that of no orbit that anybody looks for.
const STANDS: f64 = 1e-6;
/// Points in an interval at most: beyond, intervals serve better, and the work grows with their cube.
const STAGES: usize = 16;
/// Step of the central differences by the period, relative: they err by 1e-10.
const STRETCH: f64 = 1e-5;

/// A periodic orbit of a shoot.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct PeriodicOrbit {
    /// The period, s.
    pub period: f64,
    /// Newton iterations.
    pub iterations: usize,
    /// Equilibria that were solved.
    pub equilibria: usize,
    /// By how much a state differs from that one period later, relative.
    pub residual: f64,
    pub(super) start: Start,
    pub(super) settings: PeriodicSolver,
    /// When a cycle that something drives was begun, s; none if its period is its own.
    pub(super) driven_from: Option<f64>,
}

/// A multiplier of Floquet: what a disturbance has become after a period.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Multiplier {
    /// μ.
    pub value: Complex<f64>,
    /// |A v − μ v| of its vector of norm one.
    pub residual: f64,
}

impl Multiplier {
    /// The root λ = ln μ/T that goes with it, 1/s, with the smallest |Im λ|.
    #[must_use]
    pub fn root(&self, period: f64) -> Complex<f64> {
        self.value.ln() / period
    }
}

/// Finds periodic orbits of shoots whose length does not change.
///
/// A period is divided into intervals with Radau points; the grid is one of t/T, and moves with the period. Unknown are a state, with
/// its variables over the longest delay, and the period. The return map contracts all but a handful of directions, so that Krylov's
/// method solves the linear problems of Newton's in a few dozen applications of the linearised map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodicSolver {
    /// Intervals in a period.
    pub intervals: usize,
    /// Radau points in each, at most 16: the order of accuracy inside an interval.
    pub stages: usize,
    /// Largest relative difference between a state and that one period later.
    pub tolerance: f64,
    /// Bound on the iterations.
    pub max_iterations: usize,
}

impl Default for PeriodicSolver {
    /// 16 intervals of 6 points, 1e-10, at most 30 iterations.
    fn default() -> Self {
        Self { intervals: 16, stages: 6, tolerance: 1e-10, max_iterations: 30 }
    }
}

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
        let rate = root.value.im;
        ParameterError::positive("frequency of the mode", rate)?;
        ParameterError::positive("amplitude of the start", amplitude)?;
        let period = TAU / rate;
        let mut march = self.march(shoot, period)?;
        let (what, points) = ("number of strains of the mode", root.strain.len());
        ParameterError::unless(points == march.places.len(), what, points as f64, "that of the points of the zone")?;
        for strain in &root.strain {
            ParameterError::finite("strain of the mode", strain.map(|x| x.re + x.im).sum())?;
        }
        let modes: Vec<Vector3<Complex<f64>>> =
            root.strain.iter().map(|strain| strain * Complex::from(amplitude)).collect();
        let start = start_of_mode(&mut march, &modes, period)?;
        self.find(march, start, period, true)
    }

    /// The orbit of a shoot near that of another with as many material points and the same number of variables: the shoot a little
    /// longer or stiffer. Of the same shoot, with twice the intervals, it tells by its difference how accurate the first was, and its
    /// multipliers.
    ///
    /// # Errors
    /// Those of [`from_mode`](Self::from_mode), or a shoot with another number of points or variables.
    pub fn from_orbit(&self, shoot: &Shoot<impl Model>, orbit: &PeriodicOrbit) -> Result<PeriodicOrbit, CycleError> {
        let march = self.march(shoot, orbit.period)?;
        orbit.start.check(march.places.len(), march.variables)?;
        let mut start = orbit.start.clone();
        let old = Grid::new(orbit.settings.intervals, orbit.settings.stages);
        if old != march.grid {
            start = start.on_grid(&old, &march.grid, march.kept);
        }
        // The past that is kept depends on the period.
        start.keep(march.kept);
        self.find(march, start, orbit.period, true)
    }

    pub(super) fn march<'a, M: Model>(&self, shoot: &'a Shoot<M>, period: f64) -> Result<March<'a, M>, CycleError> {
        let (what, number) = ("intervals in a period", self.intervals);
        ParameterError::unless((1..=1000).contains(&number), what, number as f64, "from 1 to 1000")?;
        let (what, number) = ("points in an interval", self.stages);
        ParameterError::unless((1..=STAGES).contains(&number), what, number as f64, "from 1 to 16")?;
        ParameterError::positive("tolerance of a periodic orbit", self.tolerance)?;
        March::new(shoot, Grid::new(self.intervals, self.stages), period)
    }

    /// Newton's method for the state, and for the period if that is `free`.
    pub(super) fn find<M: Model>(
        &self,
        mut march: March<M>,
        mut start: Start,
        mut period: f64,
        free: bool,
    ) -> Result<PeriodicOrbit, CycleError> {
        let (mut iterations, mut equilibria) = (0, 0);
        let (mut kept, mut last): (Option<(Linear, f64)>, _) = (None, f64::INFINITY);
        loop {
            let path = match march.keep_enough(&mut start, period).and_then(|()| march.run(&start, period)) {
                // What a start cannot be is an error of its own; later it is an iteration that has gone astray.
                Err(CycleError::Equilibrium(_) | CycleError::Parameter(_)) if iterations > 0 => {
                    return Err(CycleError::NotConverged { iterations, residual: last });
                }
                answer => answer?,
            };
            if iterations == 0 && free {
                check_autonomous(march.shoot, &path.stages[0][0].rod)?;
            }
            equilibria += path.equilibria;
            let flat = start.flat();
            let left = path.end.flat() - &flat;
            // A driven shoot may start from nothing.
            let residual = left.norm() / flat.norm().max(path.end.flat().norm()).max(f64::MIN_POSITIVE);
            // A state that stays comes back after any time.
            let strain = path.largest_move();
            if free && strain * march.shoot.rod().length() < STANDS {
                return Err(CycleError::Stationary { strain });
            }
            if residual <= self.tolerance {
                let (settings, driven_from) = (*self, (!free).then(|| march.shoot.time()));
                return Ok(PeriodicOrbit { period, iterations, equilibria, residual, start, settings, driven_from });
            }
            if iterations == self.max_iterations || !residual.is_finite() {
                return Err(CycleError::NotConverged { iterations, residual });
            }
            // A linearisation serves as long as it reduces what is left by much.
            let fresh = kept.as_ref().is_none_or(|(_, last)| residual > 0.2 * last);
            let linear = match kept.take() {
                Some((linear, _)) if !fresh => linear,
                _ => {
                    equilibria += if free { 2 * path.equilibria } else { 0 };
                    Linear::of(&mut march, &start, period, &path, free)?
                }
            };
            let (change, stretch) = linear.step(&start, &left, iterations)?;
            let share = if free {
                // As for circular orbits: Newton's method for the residual over the size of the strain.
                let next = start.with_values(&change).strain;
                let towards_zero = -next.dot(&start.strain) / start.strain.norm_squared();
                let most = (start.strain.norm() / next.norm()).min(0.2 / stretch.abs());
                (1.0 - towards_zero).recip().clamp(-most, most)
            } else {
                1.0
            };
            start = start.with_values(&(flat + change * share));
            period *= 1.0 + stretch * share;
            iterations += 1;
            last = residual;
            kept = Some((linear, residual));
            if free && start.strain.amax() * march.shoot.rod().length() < STANDS {
                return Err(CycleError::Stationary { strain: start.strain.amax() });
            }
        }
    }
}

/// The return map and its linearisation by state and period.
struct Linear {
    variation: Variation,
    /// Where the period is free, by its logarithm, and how the strain goes on at the start: what would only shift the time is no
    /// change.
    period: Option<(DVector<f64>, DVector<f64>)>,
}

impl Linear {
    fn of(
        march: &mut March<impl Model>,
        start: &Start,
        period: f64,
        path: &Path,
        free: bool,
    ) -> Result<Self, CycleError> {
        let variation = Variation::of(march, path, period)?;
        if !free {
            return Ok(Self { variation, period: None });
        }
        let ahead = march.run(start, period * (1.0 + STRETCH))?.end.flat();
        let behind = march.run(start, period * (1.0 - STRETCH))?.end.flat();
        let phase = path.strain_slopes[0][0].normalize();
        Ok(Self { variation, period: Some(((ahead - behind) / (2.0 * STRETCH), phase)) })
    }

    /// The change of the state and the relative one of the period, after so many iterations.
    fn step(&self, start: &Start, left: &DVector<f64>, iterations: usize) -> Result<(DVector<f64>, f64), CycleError> {
        let size = left.len();
        // Krylov's method must reduce what is left.
        let reduced = |residual: f64| {
            if residual < 0.5 { Ok(()) } else { Err(CycleError::NotConverged { iterations, residual }) }
        };
        let Some((by_period, phase)) = &self.period else {
            let (found, linear) = gmres(left, LINEAR, KRYLOV, |x| {
                Ok::<_, CycleError>(x - self.variation.apply(&start.with_values(x))?.flat())
            })?;
            return reduced(linear).map(|()| (found, 0.0));
        };
        let mut right = DVector::zeros(size + 1);
        right.rows_mut(0, size).copy_from(left);
        // The last unknown is measured so that it weighs as much as the others.
        let scale = by_period.norm().max(f64::MIN_POSITIVE);
        let (found, linear) = gmres(&right, LINEAR, KRYLOV, |x| {
            let change = x.rows(0, size).clone_owned();
            let moved = self.variation.apply(&start.with_values(&change))?.flat();
            let mut out = DVector::zeros(size + 1);
            out.rows_mut(0, size).copy_from(&(&change - moved - by_period * (x[size] / scale)));
            out[size] = phase.dot(&change.rows(0, phase.len()));
            Ok::<_, CycleError>(out)
        })?;
        reduced(linear)?;
        Ok((found.rows(0, size).clone_owned(), found[size] / scale))
    }
}

/// The state of a mode at t = 0: strain and variables go to and fro, the variables as their stimuli make them.
fn start_of_mode<M: Model>(
    march: &mut March<M>,
    modes: &[Vector3<Complex<f64>>],
    period: f64,
) -> Result<Start, CycleError> {
    let (m, p) = (march.stimuli, march.places.len());
    let circle = Circle::new(WAVES);
    // The state about which it is a mode; straight if upright.
    let rod = march.shoot.rod();
    let mean: Vec<Vector3<f64>> = rod.points()[rod.zone()].iter().map(|point| point.intrinsic).collect();
    let at = |phase: f64| {
        let turn = Complex::from_polar(1.0, phase);
        DVector::from_fn(2 * p, |k, _| mean[k / 2][k % 2] + (modes[k / 2][k % 2] * turn).re)
    };
    let mut stimuli = vec![DMatrix::zeros(m, circle.len()); p];
    for (j, phase) in circle.phases.iter().enumerate() {
        let (rod, force) = march.settle(&at(*phase), 0.0)?;
        look(march.shoot, &rod, &force, |i, x| stimuli[i].column_mut(j).copy_from_slice(x));
    }
    let round = Round::new(march.shoot.model.tropism(), &circle, TAU / period);
    let steady = round.settle_all(&march.places, &stimuli)?;
    Ok(start_of_waves(march, &circle, &steady, at(0.0), TAU))
}

/// The state at t = 0 of variables that are known round a circle, which is gone round by `turn` (rad) in a period.
pub(super) fn start_of_waves(
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

impl PeriodicOrbit {
    /// Goes round once.
    fn go_round<'a, M: Model>(&self, shoot: &'a Shoot<M>) -> Result<(March<'a, M>, Path), CycleError> {
        let mut march = self.settings.march(shoot, self.period)?;
        self.start.check(march.places.len(), march.variables)?;
        march.kept = self.start.slopes.len();
        let path = march.run(&self.start, self.period)?;
        if self.driven_from.is_none() {
            check_autonomous(shoot, &path.stages[0][0].rod)?;
        } else {
            check_period(shoot, &path.stages[0][0].rod, self.period)?;
        }
        let residual = (path.end.flat() - self.start.flat()).norm() / self.start.flat().norm();
        // What is found with other first guesses differs by rounding.
        if !(residual <= 100.0 * self.settings.tolerance) {
            return Err(CycleError::NotConverged { iterations: 0, residual });
        }
        Ok((march, path))
    }

    /// The shape at the start and after every interval of the period, as it is at rest: with the times since the start, s.
    ///
    /// # Errors
    /// An equilibrium that is not found.
    pub fn shapes(&self, shoot: &Shoot<impl Model>) -> Result<Vec<(f64, Rod)>, CycleError> {
        let (mut march, path) = self.go_round(shoot)?;
        let length = self.period / self.settings.intervals as f64;
        let all = path.strains.iter().enumerate();
        all.map(|(n, strain)| Ok((n as f64 * length, march.settle(strain, n as f64 * length)?.0))).collect()
    }

    /// The largest distance of the tip from the tangent of the base (m), and the rod at that time: a maximum in time, interpolated
    /// between the points.
    ///
    /// # Errors
    /// An equilibrium that is not found.
    pub fn largest_excursion(&self, shoot: &Shoot<impl Model>) -> Result<(f64, Rod), CycleError> {
        let (mut march, path) = self.go_round(shoot)?;
        let excursion = |rod: &Rod| {
            let (tip, axis) = (rod.tip(), rod.frames()[0] * Vector3::z());
            (tip - axis * axis.dot(&tip)).norm()
        };
        let all = path
            .stages
            .iter()
            .enumerate()
            .flat_map(|(n, stages)| stages.iter().enumerate().map(move |(i, stage)| (n, i, stage)));
        let best = all.max_by(|a, b| excursion(&a.2.rod).total_cmp(&excursion(&b.2.rod)));
        let Some((n, i, stage)) = best else { return Err(CycleError::NotConverged { iterations: 0, residual: 1.0 }) };
        let length = self.period / self.settings.intervals as f64;
        let stages = march.grid.stages.clone();
        let mut at = |time: f64| {
            // Inside the interval or beyond its ends, where the neighbour's polynomial is as good.
            let whole = time.floor().clamp(0.0, (self.settings.intervals - 1) as f64);
            let n = whole as usize;
            let weights = march.grid.integrals(time - whole);
            let strain = carried(&path.strains[n], &path.strain_slopes[n], &weights);
            march.settle(&strain, time * length).map(|(rod, _)| rod)
        };
        // Parabolas through three times, ever closer: their vertex errs by the cube of their width.
        let first = n as f64 + stages[i];
        let (mut time, mut width) = (first, 0.2);
        let mut found = stage.rod.clone();
        for _ in 0..40 {
            let [before, now, after] = [at(time - width)?, at(time)?, at(time + width)?];
            let [a, b, c] = [&before, &now, &after].map(excursion);
            let curvature = a - 2.0 * b + c;
            // The tip goes round at the same distance: every time is as good.
            if curvature.abs() <= 1e-12 * b {
                found = now;
                break;
            }
            let shift = if curvature < 0.0 { (0.5 * (a - c) / curvature).clamp(-2.0, 2.0) } else { (c - a).signum() };
            // No further than a stage or two.
            time = (time + shift * width).clamp(first - 0.5, first + 0.5);
            found = now;
            if shift.abs() < 0.1 {
                width *= 0.2;
            }
            // A difference of excursions of 1e-13 is rounding; the excursion errs by the square of the time's error.
            if width < 1e-3 && shift.abs() < 0.1 {
                break;
            }
        }
        Ok((excursion(&found), found))
    }

    /// The leading multipliers of Floquet, by Arnoldi's method on the linearised return map: those of disturbances that begin as a
    /// strain about director d1 alone, and about d2 alone. An orbit in a plane along a director keeps both apart.
    ///
    /// # Errors
    /// A map that is not linearised.
    pub fn multipliers(&self, shoot: &Shoot<impl Model>, most: usize) -> Result<[Vec<Multiplier>; 2], CycleError> {
        Krylov::check(most)?;
        let (march, path) = self.go_round(shoot)?;
        let variation = Variation::of(&march, &path, self.period)?;
        let mut found = [Vec::new(), Vec::new()];
        for (c, list) in found.iter_mut().enumerate() {
            let mut start = self.start.with_values(&DVector::zeros(self.start.flat().len()));
            for k in (c..start.strain.len()).step_by(2) {
                start.strain[k] = 1.0 + 0.3 * (k as f64).sin();
            }
            let begin = variation.apply(&start)?.flat();
            let krylov = Krylov::of(
                &begin,
                most,
                1e-14,
                |x| Ok::<_, CycleError>(variation.apply(&self.start.with_values(x))?.flat()),
                |_| false,
            )?;
            *list = krylov.eigenvalues()?.into_iter().map(|(value, residual)| Multiplier { value, residual }).collect();
        }
        Ok(found)
    }
}
