//! Published results of other programs.

use crate::report::{Program, Row};

/// Experiment, dimensionless tension (zero without one), program, number of elements, error, and
/// run time (s): results 0.2 of `cosseratbench`. MuJoCo cannot run the experiment `twist`.
const RESULTS: [(&str, f64, Program, usize, f64, f64); 17] = [
    ("cantilever", 0.0, Program::PyElastica, 10, 1.443e-1, 0.221),
    ("cantilever", 0.0, Program::PyElastica, 20, 7.313e-2, 0.252),
    ("cantilever", 0.0, Program::PyElastica, 40, 3.665e-2, 0.830),
    ("cantilever", 0.0, Program::MuJoCo, 10, 1.453e-1, 0.0303),
    ("cantilever", 0.0, Program::MuJoCo, 20, 7.406e-2, 0.276),
    ("cantilever", 0.0, Program::MuJoCo, 40, 3.758e-2, 4.98),
    ("catenary", 0.0, Program::PyElastica, 25, 4.140e-4, 0.491),
    ("catenary", 0.0, Program::PyElastica, 50, 4.518e-4, 0.612),
    ("catenary", 0.0, Program::PyElastica, 100, 4.605e-4, 0.892),
    ("catenary", 0.0, Program::MuJoCo, 25, 3.302e-3, 0.442),
    ("catenary", 0.0, Program::MuJoCo, 50, 3.293e-3, 4.88),
    ("catenary", 0.0, Program::MuJoCo, 100, 3.288e-3, 131.0),
    ("twist", 1.0, Program::PyElastica, 50, 1.150e-2, 39.0),
    ("twist", 10.0, Program::PyElastica, 25, 2.244e-2, 34.7),
    ("twist", 10.0, Program::PyElastica, 50, 1.098e-2, 39.3),
    ("twist", 10.0, Program::PyElastica, 100, 9.117e-3, 165.0),
    ("twist", 30.0, Program::PyElastica, 50, 5.111e-2, 39.0),
];

/// The published results of an experiment.
pub fn rows(experiment: &'static str) -> impl Iterator<Item = Row> {
    RESULTS
        .into_iter()
        .filter(move |row| row.0 == experiment)
        .map(|(experiment, tension, program, elements, error, seconds)| {
            let tension = (tension > 0.0).then_some(tension);
            Row {
                experiment,
                tension,
                program,
                elements,
                error,
                discretisation: None,
                seconds,
            }
        })
}
