//! Decision between an internal oscillator and delayed gravitropism, from the oscillations in a
//! sliding window.
//!
//! Both mechanisms of Agostinelli, DeSimone and Noselli (2021) have a nearly constant period: that
//! of the oscillator is a property of the tissue, and that of delayed gravitropism at the onset
//! depends on the delays alone. The amplitudes differ. An oscillator forces an amplitude that is a
//! smooth function of the length. Delayed gravitropism has a threshold length, beyond which the
//! upright shoot is unstable and the amplitude grows exponentially, until it is a considerable part
//! of the length. The module is pure: it reads no files and prints nothing.

use super::criteria;

/// Origin of an oscillation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// An internal oscillator.
    Oscillator,
    /// Delayed gravitropism.
    Delayed,
}

/// An oscillation in a window or in a whole track.
#[derive(Clone, Copy, Debug)]
pub struct Wave {
    /// Period and its standard error, s.
    pub period: [f64; 2],
    /// Semi-major axis and its standard error, m.
    pub amplitude: [f64; 2],
    /// Whether it is a harmonic of a larger oscillation.
    pub harmonic: bool,
}

/// Oscillations of the tip in a window.
#[derive(Clone, Debug)]
pub struct Observation {
    /// Centre of the window, s.
    pub time: f64,
    /// Mean length of the shoot, m, if known.
    pub length: Option<f64>,
    /// Smallest amplitude that the window can show, m.
    pub limit: f64,
    /// Oscillations in the order of decreasing amplitude.
    pub waves: Vec<Wave>,
}

/// Another track of the same plant, or of one of the same kind, at a known level of gravity.
#[derive(Clone, Debug)]
pub struct Level {
    /// Gravity, in multiples of 9.81 m/s².
    pub gravity: f64,
    /// Oscillations of the whole track. Its time and length are not used.
    pub observation: Observation,
}

/// Knowledge beside the track.
#[derive(Clone, Debug, Default)]
pub struct Context {
    /// Length of a window, s.
    pub window: f64,
    /// Delay and memory time of the gravitropic response, s.
    pub delays: Option<[f64; 2]>,
    /// Level of gravity of the track, in multiples of 9.81 m/s².
    pub gravity: Option<f64>,
    /// Tracks at other levels.
    pub levels: Vec<Level>,
}

/// One number that was compared, and the mechanism for which it speaks.
#[derive(Clone, Debug)]
pub struct Criterion {
    /// Quantity, number and uncertainty.
    pub text: String,
    /// Mechanism; `None` if the number agrees with both.
    pub source: Option<Source>,
}

/// An oscillation that several windows show.
#[derive(Clone, Debug)]
pub struct Component {
    /// Index of a window, and the oscillation in it.
    pub waves: Vec<(usize, Wave)>,
    /// Mean period and half of the range of periods, s.
    pub period: [f64; 2],
    /// Comparisons.
    pub criteria: Vec<Criterion>,
    /// Relation to larger oscillations, if it is a harmonic or a combination of them. Such a
    /// component has no criteria.
    pub derived: Option<String>,
    /// Whether the amplitude decays.
    pub decays: bool,
    /// Origin, if the criteria agree.
    pub source: Option<Source>,
}

/// Answer to the question which mechanism moves the tip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// An internal oscillator.
    Oscillator,
    /// Delayed gravitropism.
    Delayed,
    /// An oscillator and delayed gravitropism.
    Both,
    /// The track does not decide.
    Undecided,
}

/// Verdict with its criteria.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// Oscillations in the order of decreasing mean square.
    pub components: Vec<Component>,
    /// Comparisons of two oscillations.
    pub criteria: Vec<String>,
    /// Answer.
    pub verdict: Verdict,
    /// Reasons why the track does not decide more.
    pub reasons: Vec<String>,
}

/// Largest ratio of neighbouring periods that belong to one component. In a window of four periods
/// a growing amplitude changes the fitted period by up to 10 %.
const NEIGHBOUR: f64 = 1.2;
/// Smallest fraction of the windows that show a component. Fewer windows may show an accidental
/// wave.
const SHOWN: f64 = 0.2;
/// Smallest ratio of the largest length to the smallest for which a dependence on length is
/// evaluated.
pub const LONGER: f64 = 1.1;

/// Decides which mechanism the observations support.
pub fn judge(observations: &[Observation], context: &Context) -> Judgement {
    let mut components = components(observations);
    let copies = components.clone();
    let primary: Vec<usize> = (0..copies.len())
        .filter(|k| copies[*k].derived.is_none())
        .collect();
    for k in &primary {
        let component = &mut components[*k];
        let others: Vec<&Component> = primary
            .iter()
            .filter(|i| *i != k)
            .map(|i| &copies[*i])
            .collect();
        component.criteria.extend(criteria::growth(
            component,
            &others,
            observations,
            context.window,
        ));
        component.decays = common_source(&component.criteria).is_none()
            && criteria::decays(component, observations);
        component
            .criteria
            .extend(criteria::small_and_sustained(component, observations));
        component.criteria.extend(criteria::trend_of_period(
            component,
            observations,
            context.window,
        ));
        component
            .criteria
            .extend(criteria::period_of_delays(component, context));
        component
            .criteria
            .extend(criteria::gravity(component, context));
        component.source = common_source(&component.criteria).filter(|_| !component.decays);
    }
    let (mut criteria, mut two_sources) = (Vec::new(), false);
    for (n, k) in primary.iter().enumerate() {
        for i in &primary[n + 1..] {
            let Some((text, incommensurate)) = criteria::ratio_of_periods(&copies[*k], &copies[*i])
            else {
                continue;
            };
            criteria.push(text);
            if !incommensurate || components[*k].decays || components[*i].decays {
                continue;
            }
            two_sources = true;
            // Delayed gravitropism has one period and its harmonics. A second period has another
            // source.
            for (one, other) in [(*k, *i), (*i, *k)] {
                let open = components[other]
                    .criteria
                    .iter()
                    .all(|criterion| criterion.source.is_none());
                if open && components[one].source == Some(Source::Delayed) {
                    components[other].source = Some(Source::Oscillator);
                }
            }
        }
    }
    let has = |source| {
        components
            .iter()
            .any(|component| component.source == Some(source))
    };
    let verdict = match (has(Source::Oscillator), has(Source::Delayed)) {
        (true, true) => Verdict::Both,
        (false, true) => Verdict::Delayed,
        (false, false) if two_sources => Verdict::Both,
        (true, false) => Verdict::Oscillator,
        (false, false) => Verdict::Undecided,
    };
    let reasons = reasons(observations, context, &components, verdict);
    Judgement {
        components,
        criteria,
        verdict,
        reasons,
    }
}

/// The source for which all decisive criteria speak.
fn common_source(criteria: &[Criterion]) -> Option<Source> {
    let mut sources = criteria.iter().filter_map(|criterion| criterion.source);
    let first = sources.next()?;
    sources.all(|source| source == first).then_some(first)
}

/// Oscillations of similar periods in several windows.
fn components(observations: &[Observation]) -> Vec<Component> {
    let every = |(k, observation): (usize, &Observation)| -> Vec<(usize, Wave)> {
        observation.waves.iter().map(|wave| (k, *wave)).collect()
    };
    let mut waves: Vec<(usize, Wave)> = observations.iter().enumerate().flat_map(every).collect();
    waves.sort_by(|a, b| a.1.period[0].total_cmp(&b.1.period[0]));
    let near = |a: &(usize, Wave), b: &(usize, Wave)| b.1.period[0] < NEIGHBOUR * a.1.period[0];
    let least = SHOWN * observations.len() as f64;
    let mut found: Vec<Component> = waves
        .chunk_by(near)
        .map(largest_of_each_window)
        .filter(|waves| waves.len() as f64 >= least)
        .map(|waves| {
            let periods = || waves.iter().map(|(_, wave)| wave.period[0]);
            let (low, high) = (
                periods().fold(f64::INFINITY, f64::min),
                periods().fold(0.0, f64::max),
            );
            let period = [
                periods().sum::<f64>() / waves.len() as f64,
                0.5 * (high - low),
            ];
            Component {
                waves,
                period,
                criteria: vec![],
                derived: None,
                decays: false,
                source: None,
            }
        })
        .collect();
    found.sort_by(|a, b| b.power().total_cmp(&a.power()));
    for k in 1..found.len() {
        let larger: Vec<&Component> = found[..k]
            .iter()
            .filter(|other| other.derived.is_none())
            .collect();
        found[k].derived = criteria::relation(&found[k], &larger);
    }
    found
}

/// The largest of the waves in each window, in the order of time.
fn largest_of_each_window(waves: &[(usize, Wave)]) -> Vec<(usize, Wave)> {
    let mut waves = waves.to_vec();
    waves.sort_by(|a, b| {
        a.0.cmp(&b.0)
            .then(b.1.amplitude[0].total_cmp(&a.1.amplitude[0]))
    });
    waves.dedup_by_key(|wave| wave.0);
    waves
}

impl Component {
    /// Largest amplitude, m.
    pub fn largest(&self) -> f64 {
        self.waves
            .iter()
            .map(|(_, wave)| wave.amplitude[0])
            .fold(0.0, f64::max)
    }

    /// Sum of the squared amplitudes in all windows, m².
    fn power(&self) -> f64 {
        self.waves
            .iter()
            .map(|(_, wave)| wave.amplitude[0].powi(2))
            .sum()
    }

    /// Wave in a window.
    pub fn wave(&self, window: usize) -> Option<&Wave> {
        self.waves
            .iter()
            .find(|(k, _)| *k == window)
            .map(|(_, wave)| wave)
    }

    /// Amplitude in a window and its standard error, m. Without a wave it is the smallest amplitude
    /// that the window can show.
    pub fn amplitude(&self, window: usize, observations: &[Observation]) -> [f64; 2] {
        self.wave(window)
            .map_or([observations[window].limit, 0.0], |wave| wave.amplitude)
    }
}

/// Ratio of the largest length to the smallest, if lengths are known.
pub fn length_ratio(observations: &[Observation]) -> Option<f64> {
    let lengths = || {
        observations
            .iter()
            .filter_map(|observation| observation.length)
    };
    let (low, high) = (
        lengths().fold(f64::INFINITY, f64::min),
        lengths().fold(0.0, f64::max),
    );
    (high > 0.0).then(|| high / low)
}

/// Reasons why the track does not decide, and what would help.
fn reasons(
    observations: &[Observation],
    context: &Context,
    components: &[Component],
    verdict: Verdict,
) -> Vec<String> {
    let [Some(first), Some(last)] = [observations.first(), observations.last()] else {
        return vec!["no window could be analysed".into()];
    };
    if components.is_empty() {
        let shown = observations
            .iter()
            .filter(|observation| !observation.waves.is_empty())
            .count();
        let all = observations.len();
        return vec![format!(
            "no oscillation is common to enough windows; {shown} of {all} windows show any"
        )];
    }
    let mut reasons = Vec::new();
    for component in components {
        let minutes = component.period[0] / 60.0;
        if component.decays {
            reasons.push(format!(
                "the oscillation of {minutes:.1} min decays, so that no mechanism sustains it"
            ));
        } else if component.source.is_none()
            && component
                .criteria
                .iter()
                .any(|criterion| criterion.source.is_some())
        {
            reasons.push(format!(
                "the criteria for the oscillation of {minutes:.1} min contradict each other"
            ));
        }
    }
    if verdict == Verdict::Both
        && components
            .iter()
            .all(|component| component.source.is_none())
    {
        reasons.push("the track does not decide which of the oscillations has which source".into());
    }
    if verdict != Verdict::Undecided {
        return reasons;
    }
    let duration = last.time - first.time + context.window;
    let periods = duration / components[0].period[0];
    if duration < 2.0 * context.window {
        reasons.push(format!(
            "the track is too short: {periods:.1} periods, and no two windows without overlap"
        ));
    }
    if components
        .iter()
        .filter(|component| component.derived.is_none())
        .count()
        == 1
    {
        reasons.push("there is one fundamental period only; two that are incommensurate would need two sources".into());
    }
    match length_ratio(observations) {
        None => {
            reasons.push("the length is unknown, so that no threshold length can be found".into())
        }
        Some(ratio) if ratio < LONGER => {
            let percent = 100.0 * (ratio - 1.0);
            reasons
                .push(format!("the length changes by {percent:.1} % only, so that no threshold length can be found"));
        }
        Some(_) => reasons.push("the amplitude passes no threshold at these lengths".into()),
    }
    if context.delays.is_none() {
        reasons.push("the delay of the gravitropic response, which gives the period at the onset, is unknown".into());
    }
    if context.levels.is_empty() {
        reasons.push("there is no track at another level of gravity".into());
    }
    reasons
}
