//! What tracking pipelines report, under their names, so that simulated and measured tips stand in one table.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Vector2};

use super::OrbitError;
use super::direction::nearest_turn;
use super::drift::in_drift;
use super::ellipse::Ellipse;
use super::harmonics::SIGNIFICANT;
use super::path::PlanePath;
use super::robust::{median_gap, quantile};
use super::scalogram::{Analysis, Place, RidgePoint, Scalogram, decorrelation};
use super::search::Search;
use super::spectrum::Spectrum;
use super::wavelet::{OMEGA, Sampling};
use crate::error::ParameterError;
use crate::tropism::Handedness;

/// A path must be so many times the longest period: outside the cone of influence lies what is 2.74 times it.
const TURNS: f64 = 3.0;
/// Drift is what is slower than so many times the longest period: the band keeps 99 % of its amplitudes.
const DRIFT: f64 = 2.0;
/// Positions at least: enough for a drift and a wave.
const LEAST: usize = 8;
/// Instants in the shortest period: a tip that goes round an ellipse of axes as 1 to 8 turns by less than π between two of them.
const INSTANTS: f64 = 24.0;
/// Nominal probability with which noise is taken for nutation. The degrees of freedom and the spectrum of the noise are estimates: of 200
/// paths each of white noise, of white noise along a line and of red noise with a correlation of 0.8, at most one is taken for nutation.
const CHANCE: f64 = 2e-4;
/// What is left of a path that only drifts, over its largest coordinate: rounding in least squares.
const ROUNDING: f64 = 4096.0 * f64::EPSILON;
/// Two waves have a common maximum of wavelet power if their phases under the Gaussian differ by less than this (rad) per scale: the sum of
/// two Gaussians of standard deviation 1 has a single maximum if their centres are closer than 2.
const SEPARATE: f64 = 2.0;
/// A sense is told if the velocity turns by more than this part of a turn in a period. Round an ellipse it is one; to and fro, none.
const TURNED: f64 = 0.5;

/// Periods among which nutation is sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// The shortest period, s: at least two sampling intervals.
    pub shortest: f64,
    /// The longest period, s: at most a third of the path.
    pub longest: f64,
}

/// Median and quartiles.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Quartiles {
    /// A quarter of the values are below it.
    pub lower: f64,
    /// Half of the values are below it.
    pub median: f64,
    /// A quarter of the values are above it.
    pub upper: f64,
}

impl Quartiles {
    /// The interquartile range.
    #[must_use]
    pub fn range(&self) -> f64 {
        self.upper - self.lower
    }
}

/// The numbers of tracking pipelines.
///
/// The span of the bounding box, which some tools call amplitude, is none of them: of a tip that drifts it is many times the amplitude.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Tracking {
    /// Whether the tip nutates at all: there is a ridge, and noise would have as much power at one of its scales, averaged over time, in
    /// one path of 5,000 at most (Torrence and Compo 1998, section 5). The noise is white, or white and red with the variance
    /// and the autocorrelation of the path without its drift and without the oscillations that least squares find in the band.
    pub nutates: bool,
    /// The period along the ridge, s: median and quartiles. None if it does not nutate.
    pub period: Option<Quartiles>,
    /// The largest envelope of the lateral motion, drift removed, m: the largest semi-major axis, along the ridge, of the ellipse that the
    /// tip goes round in the period there. Noise and other periods add nothing to it. None if it does not nutate.
    pub amplitude: Option<f64>,
    /// The power in the band over that at all periods, drift removed: 0 to 1. A gap spreads power over periods, as does an amplitude that
    /// changes fast.
    pub band_power: f64,
    /// The noise floor, m: the standard deviation of a coordinate's noise, by the median of the spectrum beyond the band, as if it were white.
    /// None if the band leaves too few frequencies.
    pub noise_floor: Option<f64>,
    /// The sense in which the direction of the velocity turns. `None` if the tip does not nutate, or if the mean semi-minor axis along the
    /// ridge, with a sign for the sense, does not exceed three standard errors, as for a swing in a plane. The standard error is that of
    /// the noise floor and of the changes along the ridge.
    pub sense: Option<Handedness>,
    /// Number of turns of the direction of the velocity where it is known, counterclockwise positive. `None` if the sense is.
    pub turns: Option<f64>,
    /// The median sampling interval over the longest that Nyquist allows, half of the median period: at most 1, since shorter periods
    /// are not sought. Near 1 the period rests on few positions. None if it does not nutate.
    pub sampling: Option<f64>,
    /// The ridge, outside the cone of influence.
    pub ridge: Vec<RidgePoint>,
    /// The direction angle of the velocity, ψ_g of Bastien and Meroz (2016), unwrapped, rad: at the times of the ridge, of the motion in its
    /// period. Behind a gap it goes on by less than half a turn, whatever has happened in it. Where the sense is `None`, the steps by half
    /// a turn at both ends of a swing have the sign of the noise.
    pub direction: Vec<f64>,
    /// The scalogram that the ridge is of; without any time for a path that does not move.
    pub scalogram: Scalogram,
    /// Pairs of periods, s, that least squares separate in the path and the wavelet does not: both have a common ridge, whose period lies
    /// between them and whose amplitude beats. One period whose amplitude or length changes may also be described by such a pair.
    pub unresolved: Vec<[f64; 2]>,
    /// Indices of the positions that were left out as outliers, the same as in [`Oscillations::outliers`](super::Oscillations::outliers).
    pub outliers: Vec<usize>,
    /// Gaps: from when to when nothing is known about the shortest period, s.
    pub gaps: Vec<[f64; 2]>,
}

impl PlanePath {
    /// Reads a path as tracking pipelines do.
    ///
    /// Outliers are left out, and what is slower than twice the longest period is removed ([`without_drift`](Self::without_drift)). The
    /// transform is a sum over the positions as they were taken, each for half of the intervals beside it, at most an eighth of a period:
    /// nothing is interpolated. An interval that is longer than a quarter of a period is a gap at that period, with a cone of influence on
    /// either side. A path that does not move has no period: that is an answer, not an error.
    ///
    /// ```
    /// use morphorod::orbit::{Band, PlanePath};
    /// use morphorod::nalgebra::Vector2;
    ///
    /// // 2 mm round in 90 min, clockwise, while the plant drifts by 40 mm in a day.
    /// let times: Vec<f64> = (0..720).map(|k| 120.0 * f64::from(k)).collect();
    /// let at = |t: &f64| {
    ///     let (sine, cosine) = (std::f64::consts::TAU * t / 5400.0).sin_cos();
    ///     Vector2::new(2e-3 * cosine + 0.04 * t / 86400.0, -2e-3 * sine)
    /// };
    /// let path = PlanePath::new(times.clone(), times.iter().map(at).collect())?;
    /// let found = path.tracked(&Band { shortest: 1800.0, longest: 14400.0 })?;
    /// assert!(found.nutates && (found.period.unwrap().median / 5400.0 - 1.0).abs() < 1e-3);
    /// assert!((found.amplitude.unwrap() / 2e-3 - 1.0).abs() < 0.01);
    /// assert_eq!(found.sense, Some(morphorod::tropism::Handedness::Clockwise));
    /// # Ok::<(), morphorod::orbit::OrbitError>(())
    /// ```
    ///
    /// # Errors
    /// A band that makes no sense, whose shortest period is less than two sampling intervals, or whose longest is more than a third of the
    /// path; too few positions.
    pub fn tracked(&self, band: &Band) -> Result<Tracking, OrbitError> {
        let Band { shortest, longest } = *band;
        ParameterError::positive("shortest period of the band", shortest)?;
        let longer = longest > shortest && longest.is_finite();
        ParameterError::unless(longer, "longest period of the band", longest, "longer than the shortest (s)")?;
        let positions = self.times.len();
        if positions < LEAST {
            return Err(OrbitError::TooFew { positions, needed: LEAST });
        }
        let (samples, half) = self.scaled();
        let (waves, good) = self.fitted(&samples, &Search::default());
        let path = self.filtered(&good);
        let positions = path.times.len();
        if positions < LEAST {
            return Err(OrbitError::TooFew { positions, needed: LEAST });
        }
        let (duration, interval) = (path.duration(), median_gap(&path.times));
        ParameterError::finite("duration of the path", duration)?;
        if duration < TURNS * longest {
            return Err(OrbitError::TooShort { duration, needed: TURNS * longest });
        }
        if 2.0 * interval > shortest {
            return Err(OrbitError::TooCoarse { interval, period: shortest });
        }
        let (sampling, size) =
            (Sampling::new(&path.times, interval, interval.max(shortest / INSTANTS), shortest), path.size());
        let edges: Vec<f64> = sampling.parts(shortest).concat();
        let outliers = (0..good.len()).filter(|i| !good[*i]).collect();
        let gaps = edges[1..].chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
        let moving = path.without_drift(DRIFT * longest)?;
        let left = moving.size();
        if !(left > ROUNDING * size) {
            return Ok(Tracking::still(outliers, gaps));
        }
        // Squares of positions must neither overflow nor vanish.
        let scaled = |path: Self| -> Vec<Vector2<f64>> { path.positions.iter().map(|p| p / left).collect() };
        let periods = waves.waves.iter().map(|wave| TAU * half / wave.omega);
        let unresolved = unresolved(periods.filter(|period| (shortest..=longest).contains(period)).collect());
        let fast = scaled(path.without_drift(shortest)?);
        // Noise is what remains beside the oscillations in the band.
        let band = TAU * half / longest..=TAU * half / shortest;
        let in_band = |t: f64| {
            waves.waves.iter().filter(|wave| band.contains(&wave.omega)).map(|wave| wave.at(t)).sum::<Vector2<f64>>()
        };
        let rest =
            samples.times.iter().zip(&self.positions).map(|(t, p)| -> Vector2<f64> { p - in_band(*t) }).collect();
        let rest =
            Self { times: self.times.clone(), positions: rest }.filtered(&good).without_drift(DRIFT * longest)?;
        let rest = scaled(rest);
        Ok(Tracking {
            unresolved,
            outliers,
            gaps,
            ..Tracking::of(&sampling, &scaled(moving), &fast, &rest, [shortest, longest], left)
        })
    }

    /// The largest coordinate, m.
    fn size(&self) -> f64 {
        self.positions.iter().map(Vector2::amax).fold(0.0, f64::max)
    }
}

impl Tracking {
    /// Nothing moves.
    fn still(outliers: Vec<usize>, gaps: Vec<[f64; 2]>) -> Self {
        let scalogram = Scalogram { times: vec![], periods: vec![], power: vec![], outside_cone: vec![] };
        Self {
            nutates: false,
            period: None,
            amplitude: None,
            band_power: 0.0,
            noise_floor: Some(0.0),
            sense: None,
            turns: None,
            sampling: None,
            ridge: vec![],
            direction: vec![],
            scalogram,
            unresolved: vec![],
            outliers,
            gaps,
        }
    }

    /// What moves, in units of `unit` (m), without drift; and what of it is faster than the band; and the `rest`
    /// without the oscillations in the band.
    fn of(
        sampling: &Sampling,
        moving: &[Vector2<f64>],
        fast: &[Vector2<f64>],
        rest: &[Vector2<f64>],
        band: [f64; 2],
        unit: f64,
    ) -> Self {
        let weights = sampling.weights(band[0]);
        let spectrum = |positions| Spectrum::of(sampling.times, positions, &weights, sampling.interval);
        let noise_floor = spectrum(fast).floor(band[0], |period| 1.0 - in_drift(period, band[0]));
        let covariance = moving.iter().map(|p| p * p.transpose()).sum::<Matrix2<f64>>() / moving.len() as f64;
        let analysis = Analysis::new(sampling, moving, rest, 0.5 * covariance.trace(), band);
        let places = analysis.ridge(noise_floor.map(|floor| floor * floor));
        // Two coordinates count as one if they move as one.
        let coordinates = covariance.trace().powi(2) / covariance.norm_squared();
        let nutates = analysis.chance(&places, coordinates) < CHANCE;
        let times = &analysis.scalogram.times;
        // Re[z exp(iφ)] goes round as φ grows.
        let ellipse = |place: &Place| Ellipse::of(&place.wave.map(|z| z.re), &place.wave.map(|z| -z.im));
        let round = goes_round(places.iter().map(|place| (ellipse(place), place)), sampling.every);
        let ellipse = |place: &Place| {
            let mut ellipse = ellipse(place);
            ellipse.sense = ellipse.sense.filter(|_| ellipse.minor > SIGNIFICANT * place.error);
            ellipse.scaled(unit)
        };
        let point =
            |place: &Place| RidgePoint { time: times[place.time], period: place.period, ellipse: ellipse(place) };
        let ridge: Vec<RidgePoint> = places.iter().map(point).collect();
        let (direction, turns) = directions(&places, times, sampling.every);
        let expected: f64 = ridge.iter().map(|place| sampling.every / place.period).sum();
        let mut periods: Vec<f64> = ridge.iter().map(|place| place.period).collect();
        periods.sort_unstable_by(f64::total_cmp);
        let period = nutates.then(|| Quartiles {
            lower: quantile(&periods, 0.25),
            median: quantile(&periods, 0.5),
            upper: quantile(&periods, 0.75),
        });
        let sense = if turns > 0.0 { Handedness::Counterclockwise } else { Handedness::Clockwise };
        let sense = Some(sense).filter(|_| nutates && round && turns.abs() > TURNED * expected);
        Self {
            nutates,
            period,
            amplitude: nutates.then(|| ridge.iter().map(|place| place.ellipse.major).fold(0.0, f64::max)),
            band_power: spectrum(moving).share(band[0], band[1]),
            noise_floor: noise_floor.map(|floor| unit * floor),
            sense,
            turns: sense.map(|_| turns),
            sampling: period.map(|period| 2.0 * sampling.interval / period.median),
            ridge,
            direction,
            scalogram: analysis.scalogram,
            unresolved: vec![],
            outliers: vec![],
            gaps: vec![],
        }
    }
}

/// Pairs of neighbouring periods that have a common ridge.
fn unresolved(mut periods: Vec<f64>) -> Vec<[f64; 2]> {
    periods.sort_unstable_by(f64::total_cmp);
    let close = |pair: &&[f64]| OMEGA * (pair[1] / pair[0]).ln() < SEPARATE;
    periods.windows(2).filter(close).map(|pair| [pair[0], pair[1]]).collect()
}

/// Whether the mean semi-minor axis along a ridge, with a sign for the sense, exceeds three standard errors. Times along the ridge are
/// `every` seconds apart.
fn goes_round<'a>(ridge: impl Iterator<Item = (Ellipse, &'a Place)>, every: f64) -> bool {
    let (mut sum, mut squares, mut noise, mut independent, mut count) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (ellipse, place) in ridge {
        let sign = if ellipse.sense == Some(Handedness::Counterclockwise) { 1.0 } else { -1.0 };
        sum += sign * ellipse.minor;
        squares += ellipse.minor * ellipse.minor;
        noise += place.error * place.error;
        independent += every / decorrelation(place.period);
        count += 1.0;
    }
    let mean = sum / count;
    let variance = (squares + noise) / count - mean * mean;
    mean * mean > SIGNIFICANT * SIGNIFICANT * variance / f64::max(independent, 1.0)
}

/// The directions of the velocity along a ridge, and the turns that they make, those between stretches left out.
fn directions(ridge: &[Place], times: &[f64], every: f64) -> (Vec<f64>, f64) {
    let (mut all, mut turns): (Vec<f64>, f64) = (Vec::new(), 0.0);
    let together = |a: &Place, b: &Place| b.time == a.time + 1 && times[b.time] - times[a.time] < 1.5 * every;
    for run in ridge.chunk_by(together) {
        let positions = run.iter().map(|place| place.wave.map(|z| z.re)).collect();
        let path = PlanePath { times: run.iter().map(|place| times[place.time]).collect(), positions };
        // One instant alone has no direction but the last one.
        let Ok(angles) = path.direction() else {
            all.push(all.last().copied().unwrap_or(0.0));
            continue;
        };
        turns += (angles[angles.len() - 1] - angles[0]) / TAU;
        let shift = all.last().map_or(0.0, |last| nearest_turn(angles[0], *last) - angles[0]);
        all.extend(angles.into_iter().map(|angle| angle + shift));
    }
    (all, turns)
}
