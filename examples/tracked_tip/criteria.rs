//! Criteria that distinguish an internal oscillator from delayed gravitropism.

use std::f64::consts::FRAC_PI_2;

use super::mechanism::{
    Component, Context, Criterion, LONGER, Level, Observation, Source, Wave, length_ratio,
};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
const MM: f64 = 1e-3;
const CM: f64 = 1e-2;
const SIGNIFICANT: f64 = 3.0;
/// A forced amplitude grows at most with this power of the length: with the second, if the whole
/// shoot grows, and faster where the weight nearly buckles the shoot.
const POWER: i32 = 4;
/// Smallest growth of the amplitude beyond that of a forced oscillation that speaks for an
/// instability.
const EXCESS: f64 = 3.0;
/// Largest amplitude of a small oscillation over the length. The amplitude of delayed gravitropism
/// is 0.22 of the length at 0.4 % above the critical length and varies as the square root of the
/// distance, so that it is small within 0.1 % only.
const SMALL: f64 = 0.1;
/// Fraction of the windows that must show a sustained oscillation.
const SUSTAINED: f64 = 0.8;
/// Ratio of the last amplitude to the largest, below which an oscillation decays.
const DECAYED: f64 = 1.0 / 3.0;
/// Smallest exponent of the length in a period that follows the length. Simulated shoots with
/// delayed gravitropism have 0.03.
const FOLLOWS: f64 = 0.1;
/// Range of the measured period over that at the onset in which both agree. Statoliths lengthen the
/// period by 6 %, and large amplitudes by 2 %; delays are measured within a tenth.
const AGREES: [f64; 2] = [0.8, 1.25];
/// Outside of this range they disagree.
const DISAGREES: [f64; 2] = [0.6, 1.67];
/// Gravity at which a shoot is practically weightless, in multiples of 9.81 m/s².
const WEIGHTLESS: f64 = 0.01;
/// Difference from a whole number that a ratio of periods may have beside its errors.
const NEAR: f64 = 0.02;
/// Relative difference from a combination of frequencies that a frequency may have beside its
/// error.
const COMBINED: f64 = 5e-3;
/// The same for odd harmonics. An upright shoot is symmetric and has no others, and a growing
/// amplitude changes the ratio of both fitted periods by up to 3 %.
const ODD: f64 = 0.04;
/// Largest ratio of periods of one oscillation at two levels of gravity.
const SAME: f64 = 1.15;

/// Number with its standard error: two digits of the error, and at most four decimals.
pub fn uncertain(value: f64, error: f64) -> String {
    let digits = if error > 0.0 && error.is_finite() {
        (1.0 - error.log10().floor()).clamp(0.0, 4.0) as usize
    } else {
        4
    };
    let smallest = 0.1_f64.powi(digits as i32);
    let number = decimal(value, digits);
    if error < 0.5 * smallest {
        format!("{number} (error < {smallest:.digits$})")
    } else {
        format!("{number} ± {error:.digits$}")
    }
}

/// Number with given decimals, without the sign of a zero.
pub fn decimal(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    if zero {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

/// Two windows that do not overlap, and the growth of the amplitude from one to the other beyond
/// that of a forced one.
struct Growth {
    windows: [usize; 2],
    excess: f64,
    error: f64,
}

/// The most significant growth of the amplitude beyond that of a forced oscillation. Without
/// lengths another oscillation of the same shoot replaces the growth with length.
pub fn growth(
    component: &Component,
    others: &[&Component],
    observations: &[Observation],
    window: f64,
) -> Option<Criterion> {
    let mut best: Option<Growth> = None;
    let compared = observations
        .iter()
        .any(|observation| observation.length.is_some())
        || !others.is_empty();
    for (j, later) in &component.waves {
        for i in
            (0..*j).take_while(|i| observations[*j].time - observations[*i].time >= 0.999 * window)
        {
            let forced = if compared {
                forced_growth(others, observations, i, *j)
            } else {
                Some(1.0)
            };
            let Some(forced) = forced else { continue };
            let earlier = component.amplitude(i, observations);
            let excess = later.amplitude[0] / (earlier[0] * forced);
            let error = (later.amplitude[1] / later.amplitude[0]).hypot(earlier[1] / earlier[0]);
            let found = Growth {
                windows: [i, *j],
                excess,
                error,
            };
            if excess.is_finite()
                && best
                    .as_ref()
                    .is_none_or(|best| found.surely() > best.surely())
            {
                best = Some(found);
            }
        }
    }
    let found = best?;
    let [before, after] = found
        .windows
        .map(|k| amplitude_in_words(component, k, observations));
    let factor = uncertain(found.excess, found.excess * found.error);
    let passed = compared && found.excess > EXCESS && found.surely() > 0.0;
    let meaning = if passed {
        "more than forced, as beyond a threshold"
    } else {
        "no threshold"
    };
    let number = match observations[found.windows[0]].length {
        Some(_) => {
            format!("its growth over that of length to the power {POWER} is {factor}: {meaning}")
        }
        None if compared => {
            format!(
                "its growth over the square of that of the other oscillation is {factor}: {meaning}"
            )
        }
        None => {
            let longer = found.excess.max(1.0).powf(1.0 / f64::from(POWER));
            format!(
                "it grows by a factor of {factor}, for which a forced oscillation needs {longer:.2} times the length"
            )
        }
    };
    let text = format!("amplitude {before}, {after}: {number}");
    Some(Criterion {
        text,
        source: passed.then_some(Source::Delayed),
    })
}

impl Growth {
    /// Lower bound of the logarithm of the excess.
    fn surely(&self) -> f64 {
        self.excess.ln() - SIGNIFICANT * self.error
    }
}

fn amplitude_in_words(
    component: &Component,
    window: usize,
    observations: &[Observation],
) -> String {
    let [amplitude, error] = component
        .amplitude(window, observations)
        .map(|value| value / MM);
    let amount = match component.wave(window) {
        Some(_) => format!("{} mm", uncertain(amplitude, error)),
        None => format!("below {amplitude:.3} mm"),
    };
    let length = observations[window]
        .length
        .map_or(String::new(), |length| format!(" ({:.2} cm)", length / CM));
    format!(
        "{amount} at {:.1} h{length}",
        observations[window].time / HOUR
    )
}

/// Largest factor by which a forced amplitude grows between two windows; `None` if nothing is known
/// of it.
fn forced_growth(
    others: &[&Component],
    observations: &[Observation],
    i: usize,
    j: usize,
) -> Option<f64> {
    match (observations[i].length, observations[j].length) {
        (Some(before), Some(after)) => Some((after / before).max(1.0).powi(POWER)),
        _ => others.iter().find_map(|other| {
            let growth = other.wave(j)?.amplitude[0] / other.wave(i)?.amplitude[0];
            Some(growth.max(1.0).powi(2))
        }),
    }
}

/// Whether an oscillation vanishes or becomes small before the end of the track.
pub fn decays(component: &Component, observations: &[Observation]) -> bool {
    let last = component.amplitude(observations.len() - 1, observations)[0];
    last < DECAYED * component.largest()
}

/// A small amplitude in nearly all windows, while the length changes.
pub fn small_and_sustained(
    component: &Component,
    observations: &[Observation],
) -> Option<Criterion> {
    let ratio = length_ratio(observations).filter(|ratio| *ratio >= LONGER)?;
    let relative = |(k, wave): &(usize, Wave)| {
        observations[*k]
            .length
            .map(|length| (wave.amplitude[0] / length, wave.amplitude[1] / length))
    };
    let (largest, error) = component
        .waves
        .iter()
        .filter_map(relative)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or_default();
    let sensitive = |(k, observation): &(usize, &Observation)| {
        component.wave(*k).is_some() || observation.limit < DECAYED * component.largest()
    };
    let able = observations.iter().enumerate().filter(sensitive).count();
    let shown = component.waves.len() as f64 / able as f64;
    let sustained = largest < SMALL && shown >= SUSTAINED && !component.decays;
    let text = format!(
        "amplitude at most {} % of the length, in {} of {able} windows, while the length grows by {:.0} %: {}",
        uncertain(100.0 * largest, 100.0 * error),
        component.waves.len(),
        100.0 * (ratio - 1.0),
        if sustained {
            "small and sustained"
        } else {
            "not both small and sustained"
        },
    );
    Some(Criterion {
        text,
        source: sustained.then_some(Source::Oscillator),
    })
}

/// Exponent of the length in the period, or the rate of the period if lengths are unknown or do not
/// change.
pub fn trend_of_period(
    component: &Component,
    observations: &[Observation],
    window: f64,
) -> Option<Criterion> {
    let length = |k: &usize| observations[*k].length;
    let by_length = length_ratio(observations).is_some_and(|ratio| ratio >= LONGER);
    let points: Vec<[f64; 2]> = component
        .waves
        .iter()
        .filter_map(|(k, wave)| {
            let x = if by_length {
                length(k)?.ln()
            } else {
                observations[*k].time / HOUR
            };
            Some([x, wave.period[0].ln()])
        })
        .collect();
    let [(first, _), .., (last, _)] = component.waves[..] else {
        return None;
    };
    let independent = 1.0 + (observations[last].time - observations[first].time) / window;
    let [slope, error] = slope(&points, independent)?;
    let number = uncertain(slope, error);
    let (text, follows) = if by_length {
        let follows = slope.abs() - SIGNIFICANT * error > FOLLOWS;
        let meaning = if follows {
            "it follows the length"
        } else if slope.abs() + 2.0 * error < FOLLOWS {
            "nearly independent of the length, which agrees with both mechanisms"
        } else {
            "too uncertain"
        };
        (
            format!("period proportional to length to the power {number}: {meaning}"),
            follows,
        )
    } else {
        (
            format!(
                "period changes by {} % per hour",
                uncertain(100.0 * slope, 100.0 * error)
            ),
            false,
        )
    };
    Some(Criterion {
        text,
        source: follows.then_some(Source::Delayed),
    })
}

/// Slope of a line by least squares and its standard error. As windows overlap, the points count as
/// the given number of independent ones.
fn slope(points: &[[f64; 2]], independent: f64) -> Option<[f64; 2]> {
    let count = points.len() as f64;
    let mean = |c: usize| points.iter().map(|point| point[c]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let squares: f64 = points.iter().map(|point| (point[0] - x).powi(2)).sum();
    let slope = points
        .iter()
        .map(|point| (point[0] - x) * (point[1] - y))
        .sum::<f64>()
        / squares;
    let rest: f64 = points
        .iter()
        .map(|point| (point[1] - y - slope * (point[0] - x)).powi(2))
        .sum();
    let error = (rest / (independent - 2.0) / squares).sqrt();
    (independent >= 3.0 && squares > 0.0).then_some([slope, error])
}

/// Period at the onset of delayed gravitropism: ω delay + arctan(ω memory) = π/2, at which growth,
/// memory and delay together reverse the correction. It holds for the upright shoot of the reduced
/// model at any length.
pub fn period_at_onset([delay, memory]: [f64; 2]) -> f64 {
    let lag = |omega: f64| omega * delay + (omega * memory).atan() - FRAC_PI_2;
    let (mut low, mut high) = (0.0, FRAC_PI_2 / delay);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if lag(middle) < 0.0 {
            low = middle
        } else {
            high = middle
        }
    }
    std::f64::consts::TAU / (0.5 * (low + high))
}

/// The period over that at the onset of delayed gravitropism.
pub fn period_of_delays(component: &Component, context: &Context) -> Option<Criterion> {
    let onset = period_at_onset(context.delays?);
    let [period, spread] = component.period;
    let ratio = period / onset;
    let (meaning, source) = if (AGREES[0]..=AGREES[1]).contains(&ratio) {
        ("they agree", Some(Source::Delayed))
    } else if (DISAGREES[0]..=DISAGREES[1]).contains(&ratio) {
        ("they neither agree nor exclude each other", None)
    } else {
        ("they disagree", Some(Source::Oscillator))
    };
    let number = uncertain(ratio, spread / onset);
    let text = format!(
        "period over the {:.1} min at the onset for these delays: {number}: {meaning}",
        onset / MINUTE
    );
    Some(Criterion { text, source })
}

/// Amplitudes and periods at other levels of gravity.
pub fn gravity(component: &Component, context: &Context) -> Vec<Criterion> {
    let Some(own) = context.gravity else {
        return vec![];
    };
    let compared = |level: &Level| {
        let same = |wave: &&Wave| {
            let ratio = wave.period[0] / component.period[0];
            (1.0 / SAME..=SAME).contains(&ratio) && !wave.harmonic
        };
        match level.observation.waves.iter().find(same) {
            Some(wave) => {
                let [period, error] = wave.period.map(|value| value / MINUTE);
                let free = level.gravity < WEIGHTLESS && own > 0.5;
                let text = format!(
                    "at {} g: period {} min{}",
                    level.gravity,
                    uncertain(period, error),
                    if free { ": it needs no gravity" } else { "" }
                );
                Criterion {
                    text,
                    source: free.then_some(Source::Oscillator),
                }
            }
            None => {
                let limit = level.observation.limit;
                let absent = limit < DECAYED * component.largest() && level.gravity < 0.5 * own;
                let text = format!(
                    "at {} g: below {:.3} mm{}",
                    level.gravity,
                    limit / MM,
                    if absent { ": it needs gravity" } else { "" }
                );
                Criterion {
                    text,
                    source: absent.then_some(Source::Delayed),
                }
            }
        }
    };
    context.levels.iter().map(compared).collect()
}

/// The ratio of two periods in the windows that show both, and whether it differs from all whole
/// numbers.
pub fn ratio_of_periods(first: &Component, second: &Component) -> Option<(String, bool)> {
    let ratio = |(k, one): &(usize, Wave)| {
        let other = second.wave(*k)?;
        let (slow, fast) = if one.period[0] > other.period[0] {
            (one, other)
        } else {
            (other, one)
        };
        let relative = |wave: &Wave| wave.period[1] / wave.period[0];
        let ratio = slow.period[0] / fast.period[0];
        Some([ratio, ratio * relative(slow).hypot(relative(fast))])
    };
    let mut ratios: Vec<[f64; 2]> = first.waves.iter().filter_map(ratio).collect();
    ratios.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let [middle, error] = *ratios.get(ratios.len() / 2)?;
    let order = middle.round();
    let differs = |[ratio, error]: &&[f64; 2]| (ratio - order).abs() > SIGNIFICANT * error + NEAR;
    let incommensurate = 2 * ratios.iter().filter(differs).count() > ratios.len();
    let meaning = if incommensurate {
        "incommensurate, which needs two sources"
    } else {
        "a whole number within the error"
    };
    let [low, high] = [ratios[0][0], ratios[ratios.len() - 1][0]];
    let text = format!(
        "ratio of periods {}, from {low:.2} to {high:.2} in {} windows: {meaning}",
        uncertain(middle, error),
        ratios.len()
    );
    Some((text, incommensurate))
}

/// Relation of a component to larger ones, if its frequency is a multiple of one of them, or a sum
/// or a difference of small multiples of two.
pub fn relation(component: &Component, larger: &[&Component]) -> Option<String> {
    let minutes = |component: &Component| component.period[0] / MINUTE;
    let tolerance = |order: i32| if order % 2 == 1 { ODD } else { COMBINED };
    for one in larger {
        if let Some(order) =
            (2..=7).find(|order| agrees(component, [(*order, one), (0, one)], tolerance(*order)))
        {
            return Some(format!("harmonic {order} of {:.1} min", minutes(one)));
        }
    }
    for (k, one) in larger.iter().enumerate() {
        for other in &larger[k + 1..] {
            for (m, n) in [(1, -1), (1, 1), (2, -1), (1, -2), (2, 1), (1, 2)] {
                if agrees(component, [(m, one), (n, other)], COMBINED) {
                    let (m, n) = if m * n < 0 {
                        (m.abs(), -n.abs())
                    } else {
                        (m, n)
                    };
                    let sign = if n < 0 { '−' } else { '+' };
                    let [one, other] = [minutes(one), minutes(other)];
                    return Some(format!(
                        "combination of frequencies, |{m}/({one:.1} min) {sign} {}/({other:.1} min)|",
                        n.abs()
                    ));
                }
            }
        }
    }
    None
}

/// Whether the frequency of a component is that of a combination in most windows that show it.
fn agrees(component: &Component, terms: [(i32, &Component); 2], tolerance: f64) -> bool {
    let mut agreeing = 0;
    for (k, wave) in &component.waves {
        let relative = |wave: &Wave| wave.period[1] / wave.period[0].powi(2);
        let (mut sum, mut error) = (0.0, relative(wave));
        let known = terms.iter().all(|(order, other)| {
            other.wave(*k).is_some_and(|other| {
                sum += f64::from(*order) / other.period[0];
                error = error.hypot(f64::from(*order) * relative(other));
                true
            })
        });
        // A component without its parents has another source.
        let off = (1.0 / wave.period[0] - sum.abs()).abs();
        agreeing += usize::from(known && off < SIGNIFICANT * error + tolerance / wave.period[0]);
    }
    2 * agreeing > component.waves.len()
}
