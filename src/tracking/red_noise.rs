//! Noise that is the sum of white noise and of a first-order autoregressive process.

/// Correlation of values k intervals apart: 1 for k = 0, otherwise `share` · `decay`ᵏ. White noise
/// has the share zero. The red noise of Torrence and Compo (1998, section 4) has the share one. The
/// sum of both has a share between zero and one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RedNoise {
    /// Part of the variance that belongs to the autoregressive process.
    pub share: f64,
    /// Correlation of successive values of the autoregressive process, 0 to 1.
    pub decay: f64,
}

impl RedNoise {
    /// White noise.
    pub const WHITE: Self = Self {
        share: 0.0,
        decay: 0.0,
    };

    /// Noise with the given correlations of values one and two intervals apart, the first of which
    /// is positive. The decay is their quotient, at least the first one, and at most `largest`.
    pub fn of([one, two]: [f64; 2], largest: f64) -> Self {
        let decay = (two / one).clamp(one.min(largest), largest);
        Self {
            share: (one / decay).min(1.0),
            decay,
        }
    }

    /// Spectrum over that of white noise with the same variance, at the angular frequency whose
    /// product with the interval has a given cosine: equation (16) of Torrence and Compo (1998).
    pub fn spectrum(self, cosine: f64) -> f64 {
        let Self { share, decay } = self;
        let distance = (1.0 - decay).powi(2) + 2.0 * decay * (1.0 - cosine);
        let red = if distance > 0.0 {
            (1.0 - decay * decay) / distance
        } else {
            1.0
        };
        (1.0 - share) + share * red
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn correlations_of_two_lags_give_share_and_decay() {
        for (share, decay) in [(1.0, 0.8), (0.5, 0.95), (0.3, 0.9)] {
            let found = RedNoise::of([share * decay, share * decay * decay], 0.99);
            // The error is rounding.
            assert_relative_eq!(found.share, share, epsilon = 0.0, max_relative = 1e-14);
            assert_relative_eq!(found.decay, decay, epsilon = 0.0, max_relative = 1e-14);
        }
        assert_eq!(
            RedNoise::of([0.2, 0.0], 0.99),
            RedNoise {
                share: 1.0,
                decay: 0.2
            }
        );
    }

    /// The spectrum at frequency zero is the sum of the correlations at all lags, 1 + 2 · 0.6 ·
    /// (0.5 + 0.25 + …).
    #[test]
    fn spectrum_at_zero_is_the_sum_of_correlations() {
        // The error is rounding.
        assert_relative_eq!(
            RedNoise {
                share: 0.6,
                decay: 0.5
            }
            .spectrum(1.0),
            2.2,
            epsilon = 0.0,
            max_relative = 1e-14
        );
    }
}
