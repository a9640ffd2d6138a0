//! Ranges of the coordinates of an axis.

/// Interval of values. An empty interval has infinite, reversed ends.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
}

impl Range {
    /// Returns the range of the finite values.
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let nothing = Self {
            lo: f64::INFINITY,
            hi: f64::NEG_INFINITY,
        };
        values
            // The lengths of larger ranges would overflow.
            .filter(|v| v.abs() < 1e300)
            .fold(nothing, |range, v| Self {
                lo: range.lo.min(v),
                hi: range.hi.max(v),
            })
    }

    /// Length of the interval, or zero if it is empty.
    pub fn length(self) -> f64 {
        (self.hi - self.lo).max(0.0)
    }

    /// Midpoint of the interval, or zero if it is empty.
    pub fn centre(self) -> f64 {
        if self.lo <= self.hi {
            // The sum of two large values would overflow.
            0.5 * self.lo + 0.5 * self.hi
        } else {
            0.0
        }
    }

    /// Largest magnitude in the interval, or zero if it is empty.
    pub fn magnitude(self) -> f64 {
        if self.lo <= self.hi {
            self.lo.abs().max(self.hi.abs())
        } else {
            0.0
        }
    }

    /// Returns the interval extended about its centre to at least the given length.
    pub fn at_least(self, length: f64) -> Self {
        if self.lo <= self.hi && self.length() >= length {
            return self;
        }
        let centre = self.centre();
        Self {
            lo: centre - 0.5 * length,
            hi: centre + 0.5 * length,
        }
    }

    /// Returns the interval extended to a positive length. Differences due to rounding are not
    /// magnified.
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

    /// Returns the interval extended at each end by a fraction of its length.
    pub fn padded(self, share: f64) -> Self {
        self.at_least(self.length() * (1.0 + 2.0 * share))
    }
}
