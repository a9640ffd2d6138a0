//! Grid of parameters of a sweep.

/// Equally spaced values of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// First value.
    pub from: f64,
    /// Last value.
    pub to: f64,
    /// Number of values, at least two.
    pub count: usize,
}

impl Span {
    /// Value with index `k`.
    #[must_use]
    pub fn at(&self, k: usize) -> f64 {
        let fraction = k as f64 / (self.count - 1) as f64;
        // This formula is exact at both ends.
        self.from * (1.0 - fraction) + self.to * fraction
    }

    /// All values.
    #[must_use]
    pub fn values(&self) -> Vec<f64> {
        (0..self.count).map(|k| self.at(k)).collect()
    }
}

/// Grid and settings, which determine all results of a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Lengths of the shoots in a row, m.
    pub lengths: Span,
    /// Proprioceptive sensitivities, one for each row.
    pub etas: Span,
    /// Gravitropic sensitivity.
    pub beta: f64,
    /// Growth time, s.
    pub growth_time: f64,
    /// Simulated time, s.
    pub time: f64,
    /// Time step, s.
    pub step: f64,
    /// Number of elements of a shoot.
    pub elements: usize,
}

impl Grid {
    /// Describes the settings, one in each line. A file of results belongs to this sweep if it contains
    /// the same lines.
    #[must_use]
    pub fn settings(&self) -> Vec<String> {
        let span = |name: &str, unit: &str, Span { from, to, count }: Span| {
            format!("{name}: {count} from {from:e} to {to:e}{unit}")
        };
        vec![
            span("lengths", " m", self.lengths),
            span("proprioceptive sensitivities", "", self.etas),
            format!("gravitropic sensitivity: {:e}", self.beta),
            format!("growth time: {:e} s", self.growth_time),
            format!("simulated time: {:e} s", self.time),
            format!("time step: {:e} s", self.step),
            format!("elements: {}", self.elements),
        ]
    }
}

/// Part of the rows for one of several processes: row `number` and every `of`-th row after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Number of the part, counted from one.
    pub number: usize,
    /// Number of parts.
    pub of: usize,
}

impl Part {
    /// Part that contains all rows.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Parses `number/of`. Returns `None` unless 1 ≤ `number` ≤ `of`.
    #[must_use]
    pub fn read(text: &str) -> Option<Self> {
        let (number, of) = text.split_once('/')?;
        let part = Self { number: number.parse().ok()?, of: of.parse().ok()? };
        (1..=part.of).contains(&part.number).then_some(part)
    }

    /// Whether the part contains a row, counted from zero.
    #[must_use]
    pub fn has(&self, row: usize) -> bool {
        row % self.of == self.number - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn span_ends_exactly_at_its_last_value() {
        // 0.1 and 0.7 have no exact binary representation, so that a sum of steps would differ from the
        // last value.
        let span = Span { from: 0.1, to: 0.7, count: 7 };
        assert_eq!((span.at(0), span.at(6), span.values().len()), (0.1, 0.7, 7));
    }

    #[test]
    fn every_row_belongs_to_exactly_one_part() {
        for of in 1..6 {
            let parts: Vec<Part> = (1..=of).map(|number| Part { number, of }).collect();
            for row in 0..20 {
                assert_eq!(parts.iter().filter(|part| part.has(row)).count(), 1, "row {row} of {of} parts");
            }
        }
    }

    #[test]
    fn invalid_parts_are_refused() {
        for text in ["0/4", "5/4", "a/b", "1/0", "0/0", "3", "1/2/3", "-1/4", "", "/", "1.5/4"] {
            assert_eq!(Part::read(text), None, "{text}");
        }
        assert_eq!(Part::read("4/4"), Some(Part { number: 4, of: 4 }));
    }
}
