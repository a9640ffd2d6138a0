//! Nutation of a tip by wavelets, with the quantities that tracking pipelines report.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Vector2, Vector5};

use super::ellipse::Ellipse;
use super::scalogram::{Analysis, RidgePlace, RidgePoint, Scalogram, decorrelation};
use super::search::Search;
use super::spectrum::Spectrum;
use super::statistics::{FALSE_ALARM, LEAST, SIGNIFICANT, median_gap, quantile};
use super::track::{in_drift, nearest_turn};
use super::wavelet::{CONE, OMEGA, Sampling, period_over_scale};
use super::{Track, TrackingError};
use crate::error::ParameterError;
use crate::tropism::Handedness;

/// Residual of a track that only drifts, over its largest coordinate: rounding of least squares.
const ROUNDING: f64 = 4096.0 * f64::EPSILON;

/// Nutation of a tip, with the quantities that tracking pipelines report.
///
/// The span of the bounding box, which some tools call amplitude, is not among them: for a tip that
/// drifts it is many times the amplitude.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Nutation {
    /// Whether the tip nutates: there is a ridge, and noise would have as much power at one of its
    /// scales, averaged over time, with a nominal probability of 1e-4 (Torrence and Compo 1998,
    /// section 5). The noise is white, or white and red, with the variance and the autocorrelation
    /// of the track without its drift and without the oscillations that least squares find in the
    /// band.
    pub nutates: bool,
    /// Median period along the ridge, s; `None` without nutation.
    pub period: Option<f64>,
    /// First and third quartile of the period along the ridge, s; `None` without nutation.
    pub period_quartiles: Option<[f64; 2]>,
    /// Largest semi-major axis along the ridge, m: the envelope of the lateral motion with the
    /// period of the ridge. Noise and other periods do not contribute. `None` without nutation.
    pub amplitude: Option<f64>,
    /// Power in the band over the power at all periods, without drift: 0 to 1. A gap spreads power
    /// over periods, as does an amplitude that changes fast.
    pub band_power: f64,
    /// Noise floor, m: the standard deviation of the noise of a coordinate, from the median of the
    /// spectrum at shorter periods than the band, for white noise. `None` if the band leaves too
    /// few frequencies.
    pub noise_floor: Option<f64>,
    /// Sense in which the direction of the velocity rotates. `None` without nutation, or if the
    /// mean of the signed semi-minor axis along the ridge does not exceed three standard errors, as
    /// for a swing in a plane. The standard error is that of the noise floor and of the changes
    /// along the ridge.
    pub sense: Option<Handedness>,
    /// Number of turns of the direction of the velocity where it is known, counterclockwise
    /// positive. `None` if the sense is `None`.
    pub turns: Option<f64>,
    /// Median sampling interval over half of the median period, the Nyquist limit: at most 1, since
    /// shorter periods are not sought. Near 1 few positions determine the period. `None` without
    /// nutation.
    pub sampling: Option<f64>,
    /// The ridge, outside the cones of influence.
    pub ridge: Vec<RidgePoint>,
    /// Direction angle of the velocity, ψ_g of Bastien and Meroz (2016), unwrapped, rad: at the
    /// times of the ridge, for the motion with its period. Across a gap it changes by less than
    /// half a turn. Where the sense is `None`, noise determines the sign of the steps by half a
    /// turn at both ends of a swing.
    pub direction: Vec<f64>,
    /// Scalogram of the track without its drift; empty for a tip without motion.
    pub scalogram: Scalogram,
    /// Pairs of periods, s, that least squares separate and the wavelet does not. Both have a
    /// common ridge, whose period lies between them and whose amplitude beats. One period whose
    /// amplitude or length changes may also be described by such a pair.
    pub unresolved: Vec<[f64; 2]>,
    /// Indices of the positions that were excluded as outliers, the same as in
    /// [`Oscillations::outliers`](super::Oscillations::outliers).
    pub outliers: Vec<usize>,
    /// Start and end of every gap at the shortest period, s.
    pub gaps: Vec<[f64; 2]>,
}

impl Track {
    /// Analyses nutation with periods in a band, from the shortest to the longest period (s).
    ///
    /// Outliers are excluded, and motion slower than twice the longest period is removed
    /// ([`without_drift`](Self::without_drift)). The wavelet transform is a sum over the positions
    /// without interpolation, each weighted by half of the neighbouring intervals, at most an
    /// eighth of a period. An interval longer than a quarter of a period is a gap at that period,
    /// with a cone of influence on either side. A tip without motion has no period.
    ///
    /// ```
    /// use morphorod::tracking::Track;
    /// use morphorod::nalgebra::Vector2;
    ///
    /// // A clockwise circle of 2 mm in 90 min, while the plant drifts by 40 mm in a day.
    /// let times: Vec<f64> = (0..720).map(|k| 120.0 * f64::from(k)).collect();
    /// let at = |t: &f64| {
    ///     let (sine, cosine) = (std::f64::consts::TAU * t / 5400.0).sin_cos();
    ///     Vector2::new(2e-3 * cosine + 0.04 * t / 86400.0, -2e-3 * sine)
    /// };
    /// let track = Track::new(times.clone(), times.iter().map(at).collect())?;
    /// let found = track.nutation([1800.0, 14400.0])?;
    /// assert!(found.nutates && (found.period.unwrap() / 5400.0 - 1.0).abs() < 1e-3);
    /// assert!((found.amplitude.unwrap() / 2e-3 - 1.0).abs() < 0.01);
    /// assert_eq!(found.sense, Some(morphorod::tropism::Handedness::Clockwise));
    /// # Ok::<(), morphorod::tracking::TrackingError>(())
    /// ```
    ///
    /// # Errors
    /// A band out of range, whose shortest period is less than two sampling intervals, or whose
    /// longest is more than a third of the track; too few positions.
    #[doc(alias = "circumnutation")]
    pub fn nutation(&self, band: [f64; 2]) -> Result<Nutation, TrackingError> {
        let [shortest, longest] = band;
        ParameterError::positive("shortest period of the band", shortest, "s")?;
        let longer = longest > shortest && longest.is_finite();
        ParameterError::unless(
            longer,
            "longest period of the band",
            longest,
            "longer than the shortest (s)",
        )?;
        TrackingError::unless_positions(LEAST, self.times.len())?;
        let unit = self.unit();
        let (samples, half) = self.in_unit(unit).samples();
        let (waves, good) = samples.fitted(&Search::default());
        let track = self.in_unit(unit).filtered(&good);
        TrackingError::unless_positions(LEAST, track.times.len())?;
        let (duration, interval) = (track.duration(), median_gap(&track.times));
        ParameterError::finite("duration of the track", duration, "s")?;
        // The cones of influence of both ends cover 2.74 periods.
        let needed = (2.0 * CONE / period_over_scale()).ceil() * longest;
        let what = "duration of the track (s), three times the longest period of the band,";
        TrackingError::unless_at_least(needed, what, duration)?;
        let what = "shortest period of the band (s), two sampling intervals,";
        TrackingError::unless_at_least(2.0 * interval, what, shortest)?;
        // With 24 instants in the shortest period the velocity on an ellipse with a roundness of
        // 1/8 rotates by less than π between two of them.
        let sampling = Sampling::new(
            &track.times,
            interval,
            interval.max(shortest / 24.0),
            shortest,
        );
        let outliers = (0..good.len()).filter(|i| !good[*i]).collect();
        let gaps = sampling
            .parts(shortest)
            .windows(2)
            .map(|pair| [pair[0][1], pair[1][0]])
            .collect();
        // The drift for twice the longest period leaves 99 % of amplitudes in the band.
        let slowest = 2.0 * longest;
        let moving = track.without_drift(slowest)?;
        if !(moving.size() > ROUNDING * track.size()) {
            return Ok(Nutation {
                noise_floor: Some(0.0),
                outliers,
                gaps,
                ..Nutation::default()
            });
        }
        // The residual without the oscillations in the band contains the noise.
        let scaled_band = TAU * half / longest..=TAU * half / shortest;
        let in_band: Vec<_> = waves
            .waves
            .iter()
            .filter(|wave| scaled_band.contains(&wave.omega))
            .collect();
        let rest = |(t, p): (&f64, &Vector2<f64>)| {
            p - in_band.iter().map(|wave| wave.at(*t)).sum::<Vector2<f64>>()
        };
        let rest = samples
            .times
            .iter()
            .zip(&samples.positions)
            .map(rest)
            .collect();
        let rest = Self {
            times: self.times.clone(),
            positions: rest,
        }
        .filtered(&good)
        .without_drift(slowest)?;
        let fast = track.without_drift(shortest)?;
        let unresolved = unresolved(in_band.iter().map(|wave| TAU * half / wave.omega).collect());
        let found = Nutation::of(
            &sampling,
            [&moving, &fast, &rest].map(|track| &track.positions[..]),
            band,
            unit,
        );
        Ok(Nutation {
            unresolved,
            outliers,
            gaps,
            ..found
        })
    }
}

impl Nutation {
    /// Analyses positions in units of `unit` (m): `moving` without drift, `fast` without all motion
    /// slower than the band, and `rest` without drift and the oscillations in the band.
    fn of(
        sampling: &Sampling,
        [moving, fast, rest]: [&[Vector2<f64>]; 3],
        band: [f64; 2],
        unit: f64,
    ) -> Self {
        let weights = sampling.weights(band[0]);
        let spectrum =
            |positions| Spectrum::of(sampling.times, positions, &weights, sampling.interval);
        let noise_floor = spectrum(fast).floor(band[0], |period| 1.0 - in_drift(period, band[0]));
        let covariance = moving
            .iter()
            .map(|p| p * p.transpose())
            .sum::<Matrix2<f64>>()
            / moving.len() as f64;
        let analysis = Analysis::new(sampling, [moving, rest], 0.5 * covariance.trace(), band);
        let places = analysis.ridge(noise_floor.map(|floor| floor * floor));
        // The number of independent coordinates: one for motion along a line.
        let coordinates = covariance.trace().powi(2) / covariance.norm_squared();
        // The degrees of freedom and the spectrum of the noise are estimates. Of 200 tracks each of
        // white noise, of white noise along a line and of red noise with a correlation of 0.8, at
        // most one is taken for nutation.
        let nutates = analysis.chance(&places, coordinates) < FALSE_ALARM;
        let times = &analysis.scalogram.times;
        // The motion is Re[z exp(iφ)] with increasing φ.
        let ellipse =
            |place: &RidgePlace| Ellipse::of(&place.wave.map(|z| z.re), &place.wave.map(|z| -z.im));
        let round = is_round(
            places.iter().map(|place| (ellipse(place), place)),
            sampling.every,
        );
        let point = |place: &RidgePlace| {
            let mut ellipse = ellipse(place).scaled(unit);
            ellipse.sense = ellipse
                .sense
                .filter(|_| ellipse.minor > SIGNIFICANT * unit * place.error);
            RidgePoint {
                time: times[place.time],
                period: place.period,
                ellipse,
            }
        };
        let ridge: Vec<RidgePoint> = places.iter().map(point).collect();
        let (direction, turns) = directions(&places, times, sampling.every);
        let expected: f64 = ridge
            .iter()
            .map(|place| sampling.every / place.period)
            .sum();
        let mut periods: Vec<f64> = ridge.iter().map(|place| place.period).collect();
        periods.sort_unstable_by(f64::total_cmp);
        let period = nutates.then(|| quantile(&periods, 0.5));
        // The velocity rotates once in a period on an ellipse, and not at all in a swing: half a
        // turn is the threshold.
        let sense =
            Handedness::of(turns).filter(|_| nutates && round && turns.abs() > 0.5 * expected);
        Self {
            nutates,
            period,
            period_quartiles: nutates
                .then(|| [0.25, 0.75].map(|probability| quantile(&periods, probability))),
            amplitude: nutates.then(|| {
                ridge
                    .iter()
                    .map(|place| place.ellipse.major)
                    .fold(0.0, f64::max)
            }),
            band_power: spectrum(moving).share(band[0], band[1]),
            noise_floor: noise_floor.map(|floor| unit * floor),
            sense,
            turns: sense.map(|_| turns),
            sampling: period.map(|period| 2.0 * sampling.interval / period),
            ridge,
            direction,
            scalogram: analysis.scalogram,
            ..Self::default()
        }
    }
}

/// Pairs of neighbouring periods with a common ridge.
fn unresolved(mut periods: Vec<f64>) -> Vec<[f64; 2]> {
    periods.sort_unstable_by(f64::total_cmp);
    // The sum of two Gaussians of standard deviation 1 has a single maximum if their centres are
    // closer than 2. The response to a wave is a Gaussian of ω0 times the logarithm of its period.
    let close = |pair: &&[f64]| OMEGA * (pair[1] / pair[0]).ln() < 2.0;
    periods
        .windows(2)
        .filter(close)
        .map(|pair| [pair[0], pair[1]])
        .collect()
}

/// Whether the mean of the signed semi-minor axis along a ridge exceeds three standard errors.
/// Times along the ridge are `every` seconds apart.
fn is_round<'a>(ridge: impl Iterator<Item = (Ellipse, &'a RidgePlace)>, every: f64) -> bool {
    let terms = ridge.map(|(Ellipse { minor, sense, .. }, place)| {
        let sign = if sense == Some(Handedness::Counterclockwise) {
            1.0
        } else {
            -1.0
        };
        Vector5::new(
            sign * minor,
            minor * minor,
            place.error * place.error,
            every / decorrelation(place.period),
            1.0,
        )
    });
    let [sum, squares, noise, independent, count] = terms.sum::<Vector5<f64>>().into();
    let mean = sum / count;
    let variance = (squares + noise) / count - mean * mean;
    mean * mean > SIGNIFICANT * SIGNIFICANT * variance / f64::max(independent, 1.0)
}

/// The direction angles of the velocity along a ridge, and their number of turns without those
/// between stretches.
fn directions(ridge: &[RidgePlace], times: &[f64], every: f64) -> (Vec<f64>, f64) {
    let (mut all, mut turns): (Vec<f64>, f64) = (Vec::new(), 0.0);
    let together = |a: &RidgePlace, b: &RidgePlace| {
        b.time == a.time + 1 && times[b.time] - times[a.time] < 1.5 * every
    };
    for run in ridge.chunk_by(together) {
        let positions = run.iter().map(|place| place.wave.map(|z| z.re)).collect();
        let track = Track {
            times: run.iter().map(|place| times[place.time]).collect(),
            positions,
        };
        // A single instant keeps the last direction.
        let Ok(angles) = track.direction() else {
            all.push(all.last().copied().unwrap_or(0.0));
            continue;
        };
        turns += (angles[angles.len() - 1] - angles[0]) / TAU;
        let shift = all
            .last()
            .map_or(0.0, |last| nearest_turn(angles[0], *last) - angles[0]);
        all.extend(angles.into_iter().map(|angle| angle + shift));
    }
    (all, turns)
}
