//! Ticks of axes: round values and exact labels.

use super::canvas::text_width;
use super::range::Range;

/// Ticks along one axis.
pub struct Ticks {
    /// Positions in ascending order, in the units of the data.
    pub values: Vec<f64>,
    /// One label for each position.
    pub labels: Vec<String>,
    /// Common factor of all labels, a power of ten such as `10⁻⁶`.
    factor: Option<String>,
}

impl Ticks {
    /// Returns the positions with their labels.
    pub fn labelled(&self) -> impl Iterator<Item = (f64, &str)> {
        let labels = self.labels.iter().map(String::as_str);
        self.values.iter().copied().zip(labels)
    }

    /// Returns the label of the axis with the common factor of the ticks in its unit: `x (mm)`
    /// becomes `x (10⁻³ mm)`.
    pub fn axis_label(&self, label: &str) -> String {
        let Some(factor) = &self.factor else {
            return label.into();
        };
        match label.strip_suffix(')').and_then(|l| l.rsplit_once('(')) {
            Some((quantity, "1")) => format!("{quantity}({factor})"),
            Some((quantity, unit)) => format!("{quantity}({factor} {unit})"),
            None => format!("{label} ({factor})"),
        }
    }

    /// Returns the width of the widest label.
    pub fn width(&self, size: f64) -> f64 {
        let widths = self.labels.iter().map(|l| text_width(l, size));
        widths.fold(0.0, f64::max)
    }
}

/// Returns multiples of 1, 2 or 5 times a power of ten: at most about `count`, and at least two,
/// which define the scale.
pub fn linear_ticks(range: Range, count: usize) -> Ticks {
    let mut count = count.clamp(1, 20);
    let (step, first, last) = loop {
        let step = round_step(range.length() / count as f64);
        // The tolerance keeps ticks at the ends of the range despite rounding.
        let first = (range.lo / step - 1e-6).ceil();
        let last = (range.hi / step + 1e-6).floor();
        if last > first || count >= 20 {
            break (step, first, last);
        }
        count += 1;
    };
    let values: Vec<f64> = (0..=(last - first).clamp(0.0, 50.0) as usize)
        .map(|i| (first + i as f64) * step)
        .filter(|v| *v <= range.hi + 1e-6 * step)
        .collect();
    let largest = range.magnitude();
    let exponent = if (1e-2..1e5).contains(&largest) {
        0
    } else {
        3 * (largest.log10() / 3.0).floor() as i32
    };
    let unit = 10f64.powi(exponent);
    let decimals = (-((step / unit).log10() + 1e-9).floor()).clamp(0.0, 12.0) as usize;
    Ticks {
        labels: values.iter().map(|v| fixed(v / unit, decimals)).collect(),
        values,
        factor: (exponent != 0).then(|| power_of_ten(exponent)),
    }
}

/// Returns linear ticks of a horizontal axis, as many as the widths of the labels permit.
pub fn linear_ticks_across(range: Range, pixels: f64, size: f64) -> Ticks {
    let mut count = ((pixels / 65.0) as usize).max(2);
    loop {
        let ticks = linear_ticks(range, count);
        let room = pixels / ticks.values.len().max(1) as f64;
        if count <= 1 || ticks.width(size) + 14.0 < room {
            return ticks;
        }
        count -= 1;
    }
}

/// Returns the ticks of a logarithmic axis. The range and the positions are logarithms to base ten.
pub fn log_ticks(range: Range, count: usize) -> Ticks {
    let (first, last) = (range.lo.ceil() as i32, range.hi.floor() as i32);
    let decades = (last - first + 1).max(0) as usize;
    if decades < 3 {
        let ticks = ticks_within_decade(range, count);
        // Labels of one or two digits are narrower than the room on which the count rests.
        if decades < 2 || ticks.values.len() <= 2 * count {
            return ticks;
        }
    }
    let every = decades.div_ceil(count.max(2)).max(1) as i32;
    let shown: Vec<i32> = (first..=last).filter(|e| e % every == 0).collect();
    let plain = shown.iter().all(|e| (-3..=4).contains(e));
    let text = |e: &i32| {
        if plain {
            fixed(10f64.powi(*e), (-e).max(0) as usize)
        } else {
            power_of_ten(*e)
        }
    };
    Ticks {
        values: shown.iter().map(|e| f64::from(*e)).collect(),
        labels: shown.iter().map(text).collect(),
        factor: None,
    }
}

/// Returns the positions of the unlabelled ticks at 2, 3, …, 9 times each power of ten.
pub fn log_subticks(range: Range) -> Vec<f64> {
    let (first, last) = (range.lo.floor() as i32, range.hi.ceil() as i32);
    if last - first > 8 {
        return Vec::new();
    }
    (first..last)
        .flat_map(|e| (2..10).map(move |m| f64::from(e) + f64::from(m).log10()))
        .filter(|v| (range.lo..=range.hi).contains(v))
        .collect()
}

/// Returns ticks of a range with few powers of ten: multiples of powers of ten, or equal
/// steps.
fn ticks_within_decade(range: Range, count: usize) -> Ticks {
    let (lo, hi) = (10f64.powf(range.lo), 10f64.powf(range.hi));
    let multiples = |of: &[u8]| -> Vec<(i32, u8)> {
        (range.lo.floor() as i32..=range.hi.floor() as i32)
            .flat_map(|e| of.iter().map(move |m| (e, *m)))
            .filter(|(e, m)| {
                let v = f64::from(*e) + f64::from(*m).log10();
                (range.lo..=range.hi).contains(&v)
            })
            .collect()
    };
    let mut round = multiples(&[1, 2, 5]);
    if round.len() < 3 {
        round = multiples(&[1, 2, 3, 4, 5, 6, 7, 8, 9]);
    }
    if round.len() < 2 {
        let mut ticks = linear_ticks(Range { lo, hi }, count.min(5));
        ticks.values.iter_mut().for_each(|v| *v = v.log10());
        return ticks;
    }
    let text = |(e, m): &(i32, u8)| match e {
        -3..=4 => fixed(f64::from(*m) * 10f64.powi(*e), (-e).max(0) as usize),
        _ => format!("{m}·{}", power_of_ten(*e)),
    };
    Ticks {
        labels: round.iter().map(text).collect(),
        values: round
            .iter()
            .map(|(e, m)| f64::from(*e) + f64::from(*m).log10())
            .collect(),
        factor: None,
    }
}

fn round_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    let factors = [1.0, 2.0, 5.0, 10.0];
    let fitting = factors.into_iter().find(|f| f * power >= 0.999 * least);
    fitting.unwrap_or(10.0) * power
}

fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| c == '0' || c == '.') => digits.into(),
        Some(digits) => format!("−{digits}"),
        None => text,
    }
}

fn power_of_ten(exponent: i32) -> String {
    let digits = exponent.to_string();
    let raised = digits.chars().map(|c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32('⁰' as u32 + digit as u32 - '0' as u32).unwrap_or(digit),
    });
    format!("10{}", raised.collect::<String>())
}
