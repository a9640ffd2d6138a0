//! The monodromy operator: the derivative of the return map, by the variational equation along a
//! trajectory.
//!
//! The variational equation is discretised like the trajectory, so that the operator is the exact
//! derivative of the map on the grid, up to differences in the derivatives of laws and equilibria.
//! See K. Engelborghs et al., *SIAM J. Sci. Comput.* 22 (2001), 1593.

use nalgebra::{DMatrix, DVector, Dyn, LU};

use super::grid::TimeGrid;
use super::phase_state::PhaseState;
use super::polynomials::{Polynomials, Readings, carried};
use super::return_map::{self, CONVERGED, PASSES, ReturnMap, Trajectory};
use super::rotation::StateRotation;
use crate::cycle::error::{CycleError, Outcome};
use crate::cycle::sensitivity::stimuli_by_strain;
use crate::error::ensure;
use crate::model::{GrowthLaw, Model};

/// The monodromy operator of a trajectory. For a periodic orbit its eigenvalues are the Floquet
/// multipliers.
pub struct Monodromy {
    /// State at the beginning of the trajectory, for its sizes.
    start: PhaseState,
    intervals: Vec<Interval>,
    readings: Readings,
    grid: TimeGrid,
    /// Length of an interval, s.
    length: f64,
    reads_present: bool,
    /// Numbers of variables and of stimuli of a material point, and of points.
    sizes: (usize, usize, usize),
    turn: Option<StateRotation>,
}

struct Interval {
    stages: Vec<LinearStage>,
    /// Factorised collocation matrices, one for each material point.
    factors: Vec<LU<f64, Dyn, Dyn>>,
}

/// Derivatives at a stage.
struct LinearStage {
    /// Derivative of the stimuli by the strain.
    response: DMatrix<f64>,
    /// ∂rates/∂y and ∂rates/∂x of each material point, and REGR times ∂gradient/∂y and ∂gradient/∂x
    /// at the delayed variables.
    laws: Vec<[DMatrix<f64>; 4]>,
}

impl Monodromy {
    /// The operator of a trajectory of a return map.
    pub(crate) fn of(return_map: &ReturnMap<impl Model>, path: &Trajectory) -> Outcome<Self> {
        Self::with_responses(return_map, path, |_, stage| {
            stimuli_by_strain(return_map.shoot, &stage.rod, &stage.force, &[0.0])
        })
    }

    /// The operator with given derivatives of the stimuli by the strain, at a time since the
    /// beginning of the period (s) and a stage.
    pub(crate) fn with_responses(
        return_map: &ReturnMap<impl Model>,
        path: &Trajectory,
        mut response: impl FnMut(f64, &return_map::Stage) -> Outcome<DMatrix<f64>>,
    ) -> Outcome<Self> {
        let (grid, points) = (&return_map.grid, return_map.places.len());
        let length = path.period / grid.intervals as f64;
        let readings = return_map.readings(path.period);
        let laws = |stage: &return_map::Stage, point: usize| {
            let [rates_y, rates_x, ..] = return_map.derivatives(point, stage, &stage.variables);
            let [.., gradient_y, gradient_x] = return_map.derivatives(point, stage, &stage.past);
            let at = return_map.place(point, stage);
            let regr = return_map
                .shoot
                .model
                .growth()
                .regr(at.apex_distance, at.time);
            [rates_y, rates_x, gradient_y * regr, gradient_x * regr]
        };
        let mut intervals = Vec::with_capacity(grid.intervals);
        for (n, stages) in path.stages.iter().enumerate() {
            let mut made = Vec::with_capacity(stages.len());
            for (stage, c) in stages.iter().zip(&grid.stages) {
                let response = response((n as f64 + c) * length, stage)?;
                made.push(LinearStage {
                    response,
                    laws: (0..points).map(|point| laws(stage, point)).collect(),
                });
            }
            let factors = (0..points)
                .map(|point| return_map.matrix(point, length, stages).lu())
                .collect();
            intervals.push(Interval {
                stages: made,
                factors,
            });
        }
        let (start, grid, turn) = (path.start.clone(), grid.clone(), return_map.turn.clone());
        let (sizes, reads_present) = (return_map.sizes(), return_map.laws.size().reads_present);
        Ok(Self {
            start,
            intervals,
            readings,
            grid,
            length,
            reads_present,
            sizes,
            turn,
        })
    }

    /// Maps a disturbance, given by its components, over a period.
    pub(crate) fn apply_flat(&self, x: &DVector<f64>) -> Outcome<DVector<f64>> {
        Ok(self.apply(&self.start.with_values(x))?.flat())
    }

    /// Maps a disturbance over a period.
    pub(crate) fn apply(&self, start: &PhaseState) -> Outcome<PhaseState> {
        let mut path = Polynomials::of(start, &self.grid);
        let mut strain = start.strain.clone();
        for interval in &self.intervals {
            path.slopes.push(vec![
                DVector::zeros(start.variables.len());
                self.grid.order()
            ]);
            let mut stimuli: Vec<DVector<f64>> = Vec::new();
            let mut strain_slopes = Vec::new();
            for pass in 0..PASSES {
                strain_slopes = self.strain_slopes(interval, &path, &stimuli);
                let stages = interval.stages.iter().zip(&self.grid.upto);
                let now: Vec<DVector<f64>> = stages
                    .map(|(stage, upto)| &stage.response * carried(&strain, &strain_slopes, upto))
                    .collect();
                let change = now
                    .iter()
                    .zip(&stimuli)
                    .map(|(a, b)| (a - b).norm())
                    .sum::<f64>();
                let size = now.iter().map(DVector::norm).sum::<f64>();
                let done = pass > 0 && change <= CONVERGED * size;
                stimuli = now;
                self.integrate_variables(interval, &mut path, &stimuli);
                if done || !self.readings.implicit {
                    break;
                }
                ensure(
                    pass + 1 < PASSES,
                    CycleError::variables(PASSES, change / size),
                )?;
            }
            strain = carried(&strain, &strain_slopes, &self.grid.whole);
            path.complete(&self.grid);
        }
        let end = path.into_state(strain, self.intervals.len());
        Ok(if let Some(turn) = &self.turn {
            turn.back(&end)
        } else {
            end
        })
    }

    /// Slopes of the strain at the stages of an interval. There are no stimuli before the first
    /// iteration.
    fn strain_slopes(
        &self,
        interval: &Interval,
        path: &Polynomials,
        stimuli: &[DVector<f64>],
    ) -> Vec<DVector<f64>> {
        let (v, m, p) = self.sizes;
        let mut out = vec![DVector::zeros(2 * p); self.grid.order()];
        let mut past = vec![0.0; v];
        for (i, stage) in interval.stages.iter().enumerate() {
            let stimuli = stimuli.get(i).filter(|_| self.reads_present);
            for (point, [.., strain_y, strain_x]) in stage.laws.iter().enumerate() {
                for (a, reading) in self.readings.stages[i].iter().enumerate() {
                    past[a] = reading
                        .as_ref()
                        .map_or(0.0, |reading| path.read(reading, point * v + a));
                }
                for c in 0..2 {
                    let by_past = (0..v).map(|a| strain_y[(c, a)] * past[a]).sum::<f64>();
                    let by_present = stimuli.map_or(0.0, |x| {
                        (0..m)
                            .map(|b| strain_x[(c, b)] * x[point * m + b])
                            .sum::<f64>()
                    });
                    out[i][2 * point + c] = self.length * (by_past + by_present);
                }
            }
        }
        out
    }

    /// Solves for the slopes of the variables of all points.
    fn integrate_variables(
        &self,
        interval: &Interval,
        path: &mut Polynomials,
        stimuli: &[DVector<f64>],
    ) {
        let ((v, m, _), s, (begin, slopes)) = (self.sizes, self.grid.order(), path.last());
        if v == 0 {
            return;
        }
        for (point, matrix) in interval.factors.iter().enumerate() {
            let (y, mut right) = (begin.rows(point * v, v), DVector::zeros(v * s));
            for (i, stage) in interval.stages.iter().enumerate() {
                let ([rates_y, rates_x, ..], x) =
                    (&stage.laws[point], stimuli[i].rows(point * m, m));
                right
                    .rows_mut(i * v, v)
                    .copy_from(&((rates_y * y + rates_x * x) * self.length));
            }
            // The matrix is nonsingular: the trajectory was computed with it.
            let _ = matrix.solve_mut(&mut right);
            for (i, slope) in slopes.iter_mut().enumerate() {
                slope
                    .rows_mut(point * v, v)
                    .copy_from(&right.rows(i * v, v));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::{assert_abs_diff_eq, assert_relative_eq};
    use nalgebra::Vector3;

    use super::*;
    use crate::constitutive::LinearElastic;
    use crate::cycle::map::grid::TimeGrid;
    use crate::growth::{Ongoing, UniformGrowth};
    use crate::load::Weight;
    use crate::shoot::Shoot;
    use crate::tropism::{
        Declaration, Gravitropism, Growing, Memory, Proprioception, Response, Site, Statoliths,
        TropismLaw,
    };

    /// A nonlinear law that straightens the shoot without memory and delay: it depends on the
    /// present stimuli.
    #[derive(Clone, Copy)]
    struct Straightening(f64);

    impl TropismLaw for Straightening {
        fn declare(&self, to: &mut Declaration) {
            to.stimulus_pair();
            to.with_present();
        }

        fn sense(&self, site: &Site, stimuli: &mut [f64]) {
            stimuli.copy_from_slice(&[site.strain.x, site.strain.y]);
        }

        fn gradient(&self, _at: &Growing, _past: &[f64], now: &[f64]) -> Vector3<f64> {
            let all = now[now.len() - 2..].iter().map(|u| u * u).sum::<f64>();
            Vector3::new(now[0], now[1], 0.0) * (-self.0 * (1.0 + 0.01 * all))
        }
    }

    /// A heavy shoot with statoliths and both memories.
    fn shoot<T: TropismLaw>(law: T) -> Shoot<impl Model> {
        let memory = Memory {
            time: 720.0,
            delay: 720.0,
        };
        let gravitropism = Gravitropism {
            sensitivity: 0.8,
            perception: Statoliths {
                avalanche_time: 120.0,
            },
        };
        Shoot::builder(LinearElastic {
            youngs_modulus: 1e7,
            poissons_ratio: 0.5,
        })
        .length(0.06)
        .radius(5e-4)
        .elements(2)
        .growth(Ongoing(UniformGrowth {
            zone_length: 0.07,
            time: 72e3,
        }))
        .tropism((
            gravitropism.remembered(memory),
            Proprioception { sensitivity: 20.0 }.remembered(memory),
            law,
        ))
        .load(Weight { density: 1000.0 })
        .build()
        .unwrap()
    }

    /// A state or a disturbance without symmetry: strains of 10 1/m, statolith normals near the
    /// vertical for a state (`upright`), and slopes of a tenth of the variables.
    fn state(return_map: &ReturnMap<impl Model>, seed: f64, upright: bool) -> PhaseState {
        let mut count = seed;
        let mut next = move || {
            count += 1.0;
            (count * 2.399_963).sin()
        };
        let mut variables = |strain: f64, size: f64, upright: bool| {
            // h1, h2 and h3, their memories, and those of the strain.
            let sizes = [0.3, 0.3, 0.3, 0.3, 0.3, strain, strain];
            let mut out = DVector::from_fn(
                return_map.laws.size().variables * return_map.places.len(),
                |k, _| size * sizes[k % 7] * next(),
            );
            if upright {
                out.iter_mut()
                    .skip(2)
                    .step_by(7)
                    .for_each(|h3| *h3 = 1.0 + 0.1 * *h3);
            }
            out
        };
        assert_eq!(return_map.laws.size().variables, 7);
        let strain = DVector::from_fn(2 * return_map.places.len(), |k, _| {
            10.0 * (seed + 1.7 * k as f64).sin()
        });
        let now = variables(10.0, 1.0, upright);
        let slopes = (0..return_map.kept)
            .map(|_| {
                (0..return_map.grid.order())
                    .map(|_| variables(10.0, 0.1, false))
                    .collect()
            })
            .collect();
        PhaseState {
            strain,
            variables: now,
            slopes,
        }
    }

    /// The relative distance of the derivative along `direction` from central differences of the
    /// map with a step.
    fn mismatch(
        return_map: &mut ReturnMap<impl Model>,
        start: &PhaseState,
        direction: &PhaseState,
        period: f64,
        step: f64,
    ) -> f64 {
        let path = return_map.run(start, period).unwrap();
        let derivative = Monodromy::of(return_map, &path)
            .unwrap()
            .apply(direction)
            .unwrap()
            .flat();
        let mut moved = |step: f64| {
            let beside = start.with_values(&(start.flat() + direction.flat() * step));
            return_map.run(&beside, period).unwrap().end.flat()
        };
        let difference = (moved(step) - moved(-step)) / (2.0 * step);
        (difference - &derivative).norm() / derivative.norm()
    }

    /// Checks each branch of the map: delays longer and shorter than an interval, a law that reads
    /// the present stimuli, and a rotation at the end of the period.
    fn with_each_setting(mut check: impl FnMut(&str, &mut dyn FnMut(f64) -> f64)) {
        let [plain, present] = [shoot(Straightening(0.0)), shoot(Straightening(5.0))];
        let settings = [
            ("long delays", &plain, 2000.0, None),
            ("short delays", &plain, 5600.0, None),
            ("present stimuli", &present, 2000.0, None),
            ("rotated back", &plain, 2000.0, Some(1.1)),
        ];
        for (name, shoot, period, angle) in settings {
            let mut return_map = ReturnMap::new(shoot, TimeGrid::new(3, 2), period, angle).unwrap();
            let (start, direction) = (
                state(&return_map, 0.0, true),
                state(&return_map, 0.5, false),
            );
            check(name, &mut |step| {
                mismatch(&mut return_map, &start, &direction, period, step)
            });
        }
    }

    #[test]
    fn the_derivative_of_the_return_map_agrees_with_central_differences() {
        with_each_setting(|name, mismatch| {
            // The step is a thousandth of the state: the truncation error is its square, that of
            // equilibria of 1e-13 is 1e-10.
            let mismatch = mismatch(1e-3);
            assert!(mismatch < 1e-6, "{name}: {mismatch}");
        });
    }

    #[test]
    fn central_differences_of_the_return_map_approach_its_derivative_with_second_order() {
        with_each_setting(|_, mismatch| {
            // Steps at which the error, of 1e-3 to 1e-5, is far above that of the derivative, 1e-8.
            // The terms of fourth order change the observed order by the square of the step, times
            // a number below one.
            assert_abs_diff_eq!((mismatch(0.2) / mismatch(0.1)).log2(), 2.0, epsilon = 0.02);
        });
    }

    #[test]
    fn the_derivative_is_linear_in_the_disturbance() {
        let shoot = shoot(Straightening(5.0));
        let mut return_map = ReturnMap::new(&shoot, TimeGrid::new(3, 2), 2000.0, None).unwrap();
        let start = state(&return_map, 0.0, true);
        let path = return_map.run(&start, 2000.0).unwrap();
        let monodromy = Monodromy::of(&return_map, &path).unwrap();
        let apply = |x: &DVector<f64>| monodromy.apply(&start.with_values(x)).unwrap().flat();
        let (x, y) = (
            state(&return_map, 0.5, false).flat(),
            state(&return_map, 0.25, false).flat(),
        );
        let together = apply(&(&x * 3.0 - &y * 0.5));
        let apart = apply(&x) * 3.0 - apply(&y) * 0.5;
        // The passes over an interval end at a change of 1e-14, and sums of some hundred numbers
        // round.
        assert_abs_diff_eq!(together, apart, epsilon = 1e-12 * apart.amax());
        assert_eq!(apply(&DVector::zeros(x.len())).amax(), 0.0);
        assert_relative_eq!(
            apply(&(&x * 2.0)),
            apply(&x) * 2.0,
            epsilon = 1e-12 * apart.amax(),
            max_relative = 1e-12
        );
    }
}
