//! Curves of the map: roots on the imaginary axis on refined meshes, and the number of unstable
//! roots beside them.

use morphorod::ensemble;
use morphorod::stability::{
    BoundarySettings, Crossing, Linearisation, Refinement, StabilityError, crossings,
};
use morphorod::{ShootParameters, Still};

/// One hour, s.
pub const HOUR: f64 = 3600.0;
/// Corners of the map: growth time, h, and length divided by the self-buckling length.
pub const WINDOW: [[f64; 2]; 2] = [[1.0, 0.2], [60.0, 0.9995]];
/// Step along a curve, relative to the sides of the map. A curve has more than 200 points.
const STEP: f64 = 0.0045;

/// Initial point of a curve: growth time (h), length relative to Greenhill's, and frequency (1/s).
pub type Start = ([f64; 2], f64);

/// Parameters of the shoots of one panel, which differ in growth time and length.
#[derive(Clone, Copy)]
pub struct Kind {
    pub parameters: ShootParameters,
    pub weightless: bool,
    pub refinement: Refinement,
}

impl Kind {
    /// Linearisation about an upright shoot. `hours` is the growth time, `ratio` the length divided
    /// by the self-buckling length.
    pub fn at(
        self,
        hours: f64,
        ratio: f64,
        elements: usize,
    ) -> Result<Linearisation, StabilityError> {
        let parameters = ShootParameters {
            length: ratio * greenhill(),
            growth_time: HOUR * hours,
            ..self.parameters
        };
        let shoot = parameters.reduced().elements(elements);
        // The upright shoot is a steady state. Other shoots would need solve_steady_state.
        if self.weightless {
            Linearisation::about(&shoot.scene(Still::weightless()).build()?)
        } else {
            Linearisation::about(&shoot.build()?)
        }
    }

    /// Number of unstable roots on the first of two meshes that resolves their wavelengths, or
    /// `None` if neither does.
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

    /// Points at which roots cross the imaginary axis, on the first mesh that resolves their
    /// wavelengths.
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

    /// Follows the curve through a point in both directions, and counts the unstable roots just to
    /// the right of each point.
    pub fn curve(self, (start, frequency): Start) -> Result<Curve, StabilityError> {
        let [low, high] = WINDOW;
        let up = BoundarySettings {
            start,
            frequency,
            direction: [0.0, 1.0],
            low,
            high,
            step: STEP,
            points: 4000,
        };
        let follow = |settings| -> Result<(Vec<Crossing<2>>, usize), StabilityError> {
            let mut linearisations = 0;
            let family = |hours, ratio, n| {
                linearisations += 1;
                self.at(hours, ratio, n)
            };
            Ok((self.refinement.boundary(family, settings)?, linearisations))
        };
        let down = BoundarySettings {
            direction: [0.0, -1.0],
            ..up
        };
        // Both directions are computed concurrently, so that the last curve occupies two cores.
        let found = ensemble::collect(2, 2, |k| follow([&down, &up][k]))
            .into_iter()
            .collect::<Result<Vec<_>, _>>()?;
        let linearisations = found.iter().map(|(_, count)| count).sum();
        let points: Vec<_> = found[0]
            .0
            .iter()
            .rev()
            .chain(found[1].0.iter().skip(1))
            .copied()
            .collect();
        let errors = (0..points.len())
            .map(|k| self.mesh_error(&points, k))
            .collect();
        let unstable = self.unstable_along(&points)?;
        Ok(Curve {
            points,
            errors,
            unstable,
            linearisations,
        })
    }

    /// Estimated relative error of the length of a point at its growth time. In microgravity, where
    /// the length has no effect, it is that of the growth time.
    fn mesh_error(self, points: &[Crossing<2>], k: usize) -> f64 {
        let point = points[k];
        let [hours, ratio] = point.parameter_errors.unwrap_or([f64::NAN; 2]);
        if self.weightless {
            return hours / point.parameters[0];
        }
        let [before, after] =
            [k.saturating_sub(1), (k + 1).min(points.len() - 1)].map(|k| points[k].parameters);
        let slope = (after[1] - before[1]) / (after[0] - before[0]);
        (ratio + hours * slope.abs()) / point.parameters[1]
    }

    /// Number of unstable roots just to the right of each point of a curve.
    fn unstable_along(self, points: &[Crossing<2>]) -> Result<Vec<Option<f64>>, StabilityError> {
        // The number changes only where curves cross. It is computed at every 32nd point, and by
        // bisection between two points that differ.
        let mut numbers: Vec<Option<Option<f64>>> = vec![None; points.len()];
        let at = |k: usize,
                  numbers: &mut [Option<Option<f64>>]|
         -> Result<Option<f64>, StabilityError> {
            if let Some(known) = numbers[k] {
                return Ok(known);
            }
            let [hours, ratio] = points[k].parameters;
            let number = self.unstable(1.002 * hours, ratio)?;
            numbers[k] = Some(number);
            Ok(number)
        };
        let mut spans: Vec<(usize, usize)> = (0..points.len())
            .step_by(32)
            .map(|k| (k, (k + 32).min(points.len() - 1)))
            .collect();
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

/// Points of a curve.
pub struct Curve {
    pub points: Vec<Crossing<2>>,
    /// Estimated relative error of the length or of the growth time, for each point.
    pub errors: Vec<f64>,
    /// Number of unstable roots just to the right of each point, if the mesh resolves it.
    pub unstable: Vec<Option<f64>>,
    pub linearisations: usize,
}

/// Whether a curve passes to the right of a point at the same length.
pub fn is_right_of(curve: &Curve, [hours, ratio]: [f64; 2]) -> bool {
    curve.points.windows(2).any(|pair| {
        let ([x0, y0], [x1, y1]) = (pair[0].parameters, pair[1].parameters);
        let between = (y0 - ratio) * (y1 - ratio) <= 0.0 && y0 != y1;
        between && x0 + (x1 - x0) * (ratio - y0) / (y1 - y0) > 1.002 * hours
    })
}

/// Self-buckling length of Greenhill (1881), m.
pub fn greenhill() -> f64 {
    ShootParameters::default().self_buckling_length(9.81)
}

/// Totals of all curves.
#[derive(Default)]
pub struct Cost {
    pub points: usize,
    pub linearisations: usize,
    /// Largest estimated relative error.
    pub error: f64,
}

impl Cost {
    pub fn add(&mut self, curve: &Curve) {
        self.points += curve.points.len();
        self.linearisations += curve.linearisations;
        self.error = curve.errors.iter().copied().fold(self.error, f64::max);
    }
}

/// Follows the curves through several points, with one thread for each core.
pub fn curves_of(kind: Kind, starts: &[Start]) -> Result<Vec<Curve>, StabilityError> {
    ensemble::collect(starts.len(), ensemble::cores(), |k| kind.curve(starts[k]))
        .into_iter()
        .collect()
}
