//! Ranges of coordinates shown along an axis.

/// An interval of values; infinite and reversed while it holds no value.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
}

impl Range {
    /// The range of the finite ones of the values.
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let nothing = Self { lo: f64::INFINITY, hi: f64::NEG_INFINITY };
        values
            // Lengths of even larger values would overflow.
            .filter(|v| v.abs() < 1e300)
            .fold(nothing, |range, v| Self { lo: range.lo.min(v), hi: range.hi.max(v) })
    }

    /// Length of the interval, zero if it holds no value.
    pub fn length(self) -> f64 {
        (self.hi - self.lo).max(0.0)
    }

    /// Middle of the interval, zero if it holds no value.
    pub fn centre(self) -> f64 {
        if self.lo <= self.hi {
            // Halves first: the sum of two huge values would overflow.
            0.5 * self.lo + 0.5 * self.hi
        } else {
            0.0
        }
    }

    /// Magnitude of the larger end, zero if it holds no value.
    pub fn magnitude(self) -> f64 {
        if self.lo <= self.hi { self.lo.abs().max(self.hi.abs()) } else { 0.0 }
    }

    /// The interval widened about its centre to at least the given length.
    pub fn at_least(self, length: f64) -> Self {
        if self.lo <= self.hi && self.length() >= length {
            return self;
        }
        let centre = self.centre();
        Self { lo: centre - 0.5 * length, hi: centre + 0.5 * length }
    }

    /// The interval widened so that it can serve as an axis: values that
    /// differ by rounding only are shown as equal, not blown up to full size.
    pub fn not_empty(self) -> Self {
        let magnitude = self.magnitude();
        if magnitude < 1e-300 {
            return self.at_least(1.0);
        }
        if self.length() < 1e-9 * magnitude {
            return self.at_least(0.2 * magnitude);
        }
        self
    }

    /// The interval widened by a share of its length at each end.
    pub fn padded(self, share: f64) -> Self {
        self.at_least(self.length() * (1.0 + 2.0 * share))
    }
}
