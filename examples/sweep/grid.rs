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
    /// Describes the settings, one in each line. A file of results belongs to this sweep if it
    /// contains the same lines.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn span_ends_exactly_at_its_last_value() {
        // 0.1 and 0.7 have no exact binary representation, so that a sum of steps would differ from
        // the last value.
        let span = Span {
            from: 0.1,
            to: 0.7,
            count: 7,
        };
        assert_eq!((span.at(0), span.at(6), span.values().len()), (0.1, 0.7, 7));
    }
}
