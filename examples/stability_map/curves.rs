//! The curves of the map: where a root crosses the axis, on meshes that are fine enough, and what else is unstable there.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};

use morphorod::constitutive::LinearElastic;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::load::Weight;
use morphorod::stability::{BoundarySettings, Crossing, Linearisation, Refinement, StabilityError, crossings};
use morphorod::tropism::{Gravitropism, Memory, Proprioception, Response, SettledStatoliths};
use morphorod::{Scene, Shoot, Still};

/// s.
pub const HOUR: f64 = 3600.0;
/// The window of the map: growth time, h, and length over Greenhill's, up to where the shoot would buckle.
pub const WINDOW: [[f64; 2]; 2] = [[1.0, 0.2], [60.0, 0.9995]];
/// Step along a curve, in fractions of the window's sides: more than 200 points a curve.
const STEP: f64 = 0.0045;

/// A point of a curve: the parameters and the frequency, 1/s.
pub type Start = ([f64; 2], f64);

/// The shoots of one panel: everything but growth time and length.
#[derive(Clone, Copy)]
pub struct Kind {
    pub gravitropism: f64,
    pub proprioception: f64,
    pub weightless: bool,
    pub memory: Memory,
    pub refinement: Refinement,
}

impl Kind {
    /// The linearisation of a shoot: growth time in hours, length over Greenhill's, and elements.
    pub fn at(self, hours: f64, ratio: f64, elements: usize) -> Result<Linearisation, StabilityError> {
        let length = ratio * greenhill();
        let gravitropism =
            Gravitropism { sensitivity: self.gravitropism, perception: SettledStatoliths }.remembered(self.memory);
        let proprioception = Proprioception { sensitivity: self.proprioception }.remembered(self.memory);
        let shoot = Shoot::builder(TISSUE)
            .length(length)
            .radius(RADIUS)
            .elements(elements)
            // The whole shoot is growth zone.
            .growth(Ongoing(UniformGrowth { zone_length: 2.0 * length, time: HOUR * hours }))
            .tropism((gravitropism, proprioception))
            .load(WEIGHT);
        // The upright shoot is in a steady state when it is built; solve_steady_state finds those of other shoots.
        if self.weightless {
            Linearisation::about(&shoot.scene(Still::weightless()).build()?)
        } else {
            Linearisation::about(&shoot.build()?)
        }
    }

    /// Number of unstable roots at a growth time and length, infinity included, on the first of some meshes that resolves the
    /// waves that matter; none if not even the finest does.
    pub fn unstable(self, hours: f64, ratio: f64) -> Result<Option<f64>, StabilityError> {
        let few = self.refinement.first;
        for elements in [few, 2 * few] {
            match self.at(hours, ratio, elements)?.unstable() {
                Ok(number) => return Ok(Some(number as f64)),
                Err(StabilityError::InfinitelyMany { .. }) => return Ok(Some(f64::INFINITY)),
                Err(StabilityError::UnderResolved { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(None)
    }

    /// Where roots cross the axis, on the first of some meshes that resolves the waves that matter.
    pub fn crossings(
        self,
        family: impl Fn(f64, usize) -> Result<Linearisation, StabilityError>,
        from: f64,
        to: f64,
    ) -> Result<Vec<Crossing<1>>, StabilityError> {
        let mut elements = self.refinement.first;
        loop {
            match crossings(|parameter| family(parameter, elements), from, to) {
                Err(StabilityError::UnderResolved { .. }) if elements < 20 => elements += 4,
                other => return other,
            }
        }
    }

    /// The curve through a crossing of the axis, both ways, and how many roots are unstable just right of each point.
    pub fn curve(self, (start, frequency): Start) -> Result<Curve, StabilityError> {
        let [low, high] = WINDOW;
        let up = BoundarySettings { start, frequency, direction: [0.0, 1.0], low, high, step: STEP, points: 4000 };
        let follow = |settings| -> Result<(Vec<Crossing<2>>, usize), StabilityError> {
            let mut linearisations = 0;
            let family = |hours, ratio, n| {
                linearisations += 1;
                self.at(hours, ratio, n)
            };
            Ok((self.refinement.boundary(family, settings)?, linearisations))
        };
        let down = BoundarySettings { direction: [0.0, -1.0], ..up };
        // Both ways at once: the last curve then keeps two cores busy.
        let (down, up) = std::thread::scope(|scope| {
            let down = scope.spawn(|| follow(&down));
            let up = follow(&up);
            (down.join().unwrap_or_else(|panic| resume_unwind(panic)), up)
        });
        let ((mut points, before), (up, after)) = (down?, up?);
        let linearisations = before + after;
        points.reverse();
        points.extend(up.into_iter().skip(1));
        let errors = (0..points.len()).map(|k| self.mesh_error(&points, k)).collect();
        let unstable = self.unstable_along(&points)?;
        Ok(Curve { points, errors, unstable, linearisations })
    }

    /// What the mesh puts the length of a point off at its growth time, relative to it; in weightlessness, where length does
    /// not matter, the growth time.
    fn mesh_error(self, points: &[Crossing<2>], k: usize) -> f64 {
        let point = points[k];
        let [hours, ratio] = point.parameter_errors.unwrap_or([f64::NAN; 2]);
        if self.weightless {
            return hours / point.parameters[0];
        }
        let [before, after] = [k.saturating_sub(1), (k + 1).min(points.len() - 1)].map(|k| points[k].parameters);
        let slope = (after[1] - before[1]) / (after[0] - before[0]);
        (ratio + hours * slope.abs()) / point.parameters[1]
    }

    /// How many roots are unstable just right of each point of a curve.
    fn unstable_along(self, points: &[Crossing<2>]) -> Result<Vec<Option<f64>>, StabilityError> {
        // The number changes only where curves cross: look at every 32nd point, and between two that differ.
        let mut numbers: Vec<Option<Option<f64>>> = vec![None; points.len()];
        let at = |k: usize, numbers: &mut [Option<Option<f64>>]| -> Result<Option<f64>, StabilityError> {
            if let Some(known) = numbers[k] {
                return Ok(known);
            }
            let [hours, ratio] = points[k].parameters;
            let number = self.unstable(1.002 * hours, ratio)?;
            numbers[k] = Some(number);
            Ok(number)
        };
        let mut spans: Vec<(usize, usize)> =
            (0..points.len()).step_by(32).map(|k| (k, (k + 32).min(points.len() - 1))).collect();
        while let Some((a, b)) = spans.pop() {
            let (first, last) = (at(a, &mut numbers)?, at(b, &mut numbers)?);
            if first == last {
                numbers[a..b].fill(Some(first));
            } else if b - a > 1 {
                spans.extend([(a, (a + b) / 2), ((a + b) / 2, b)]);
            }
        }
        Ok(numbers.into_iter().map(Option::flatten).collect())
    }
}

/// A curve, point by point.
pub struct Curve {
    pub points: Vec<Crossing<2>>,
    /// What the mesh puts the length or the growth time off, relative to it.
    pub errors: Vec<f64>,
    pub unstable: Vec<Option<f64>>,
    pub linearisations: usize,
}

const RADIUS: f64 = 0.5e-3;
const TISSUE: LinearElastic = LinearElastic { youngs_modulus: 10e6, poissons_ratio: 0.5 };
const WEIGHT: Weight = Weight { density: 1000.0 };

/// Whether a curve passes right of a point, at the same length.
pub fn is_right_of(curve: &Curve, [hours, ratio]: [f64; 2]) -> bool {
    curve.points.windows(2).any(|pair| {
        let ([x0, y0], [x1, y1]) = (pair[0].parameters, pair[1].parameters);
        let between = (y0 - ratio) * (y1 - ratio) <= 0.0 && y0 != y1;
        between && x0 + (x1 - x0) * (ratio - y0) / (y1 - y0) > 1.002 * hours
    })
}

/// Greenhill's self-buckling length, m.
pub fn greenhill() -> f64 {
    let gravity = Still::upright().environment(0.0).gravity.norm();
    let per_length = WEIGHT.density * gravity * std::f64::consts::PI * RADIUS * RADIUS;
    (Weight::GREENHILL * TISSUE.stiffness(RADIUS).x / per_length).cbrt()
}

#[derive(Default)]
pub struct Cost {
    pub points: usize,
    pub linearisations: usize,
    pub error: f64,
}

impl Cost {
    pub fn add(&mut self, curve: &Curve) {
        self.points += curve.points.len();
        self.linearisations += curve.linearisations;
        self.error = curve.errors.iter().copied().fold(self.error, f64::max);
    }
}

/// The curves through some crossings, each by itself: as many at a time as there are cores.
pub fn curves_of(kind: Kind, starts: &[Start]) -> Result<Vec<Curve>, StabilityError> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            let Some(start) = starts.get(k) else { return done };
            done.push((k, kind.curve(*start)));
        }
    };
    let mut curves = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        let done = threads.into_iter().map(|thread| thread.join().unwrap_or_else(|panic| resume_unwind(panic)));
        done.flatten().collect::<Vec<_>>()
    });
    curves.sort_by_key(|(k, _)| *k);
    curves.into_iter().map(|(_, curve)| curve).collect()
}
