//! Losses of residuals.

/// Loss of a residual. The residual is divided by the standard deviation of its noise, and has no
/// unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loss {
    /// Half the square: maximum likelihood for normal noise.
    Squares,
    /// Half the square up to a threshold (in standard deviations of the noise), and linear beyond
    /// (P. J. Huber, Ann. Math. Stat. 35, 73, 1964). Outliers have a bounded influence. The
    /// threshold is at least 0.01.
    Huber(f64),
}

impl Loss {
    /// Huber's loss with the threshold 1.345. For normal noise it has 95 % of the efficiency of
    /// squares.
    pub const ROBUST: Self = Self::Huber(1.345);

    /// Loss of a residual.
    pub(super) fn value(self, r: f64) -> f64 {
        match self {
            Self::Huber(c) if r.abs() > c => c * r.abs() - 0.5 * c * c,
            _ => 0.5 * r * r,
        }
    }

    /// Derivative of the loss.
    pub(super) fn slope(self, r: f64) -> f64 {
        match self {
            Self::Huber(c) => r.clamp(-c, c),
            Self::Squares => r,
        }
    }

    /// Whether a residual is in the quadratic part.
    pub(super) fn is_inside(self, r: f64) -> bool {
        self.slope(r) == r
    }

    /// Mean square of the derivative of the loss, and share of residuals in the quadratic part, for
    /// normal noise.
    pub(super) fn for_normal_noise(self) -> (f64, f64) {
        // Integrals over the normal distribution by the midpoint rule. The density is below 1e-14
        // beyond 8.
        const STEP: f64 = 1e-3;
        let midpoints = (0..8000).map(|k| STEP * (f64::from(k) + 0.5));
        midpoints.fold((0.0, 0.0), |(square, share), r| {
            let weight = STEP * (2.0 / std::f64::consts::PI).sqrt() * (-0.5 * r * r).exp();
            let inside = if self.is_inside(r) { weight } else { 0.0 };
            (square + weight * self.slope(r).powi(2), share + inside)
        })
    }
}
