//! Memories with a kernel of any shape: sums of decaying exponentials and oscillations.

use nalgebra::Complex;

use super::{Memory, Variable};
use crate::error::ParameterError;

/// One term of a [`MemoryKernel`]: a exp(−t/τ) cos(ωt + φ) at the time t (s).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct KernelTerm {
    /// Amplitude a, 1/s.
    pub amplitude: f64,
    /// Decay time τ, s; positive.
    pub time: f64,
    /// Angular frequency ω, rad/s; zero for a decay without oscillation.
    pub frequency: f64,
    /// Phase φ, rad.
    pub phase: f64,
}

impl KernelTerm {
    /// Exponential decay a exp(−t/τ) with an amplitude (1/s) and a time (s).
    #[must_use]
    pub fn decay(amplitude: f64, time: f64) -> Self {
        Self {
            amplitude,
            time,
            frequency: 0.0,
            phase: 0.0,
        }
    }

    /// Weights in the response of the two variables (p, q) of the term for one component of the
    /// signal; see [`Variable::turns`]. The second one is zero without oscillation.
    pub(super) fn weights(&self) -> [f64; 2] {
        // p and q respond to a unit impulse by exp(−t/τ) cos(ωt)/τ and exp(−t/τ) sin(ωt)/τ.
        let (sin, cos) = self.phase.sin_cos();
        [
            self.amplitude * self.time * cos,
            if self.frequency == 0.0 {
                0.0
            } else {
                -self.amplitude * self.time * sin
            },
        ]
    }

    /// Number of variables for each component of the signal.
    pub(super) fn variables(&self) -> usize {
        if self.frequency == 0.0 { 1 } else { 2 }
    }

    /// The values of (p, q) for a constant signal x.
    pub(super) fn steady(&self, x: f64) -> [f64; 2] {
        let z = Complex::from(x) / Complex::new(1.0, -self.frequency * self.time);
        [z.re, z.im]
    }

    /// Rates of (p, q) for a signal x.
    pub(super) fn rates(&self, [p, q]: [f64; 2], x: f64) -> [f64; 2] {
        let rate = |y, turns| Variable::linear_rate(y, x, self.time, turns);
        match self.variables() {
            1 => [rate(p, None), 0.0],
            _ => [
                rate(p, Some((self.frequency, q))),
                rate(q, Some((-self.frequency, p))),
            ],
        }
    }
}

/// Memory with a kernel K that is a sum of decaying exponentials and oscillations, and a delay τr:
///
/// ```text
/// K[x](t) = ∫ K(t − τr − t') x(t') dt', integrated up to t' = t − τr;   K(t) = Σ a exp(−t/τ) cos(ωt + φ).
/// ```
///
/// With one term, a = 1/τ and ω = φ = 0 it is the exponential [`Memory`]. [`fit`](Self::fit) finds
/// the terms for a kernel that is given by its values. A kernel with a negative lobe responds to
/// the difference of earlier and later stimuli (M. Rivière and Y. Meroz 2023, PNAS
/// 120:e2306655120). [`filtered`](super::Response::filtered) makes a law of a response.
///
/// ```
/// use morphorod::tropism::{Gravitropism, KernelTerm, MemoryKernel, Response, SettledStatoliths};
///
/// // A stimulus acts for 10 min, and in the opposite sense for the next half hour. The integral of the kernel is zero.
/// let terms = vec![KernelTerm::decay(1.0 / 600.0, 600.0), KernelTerm::decay(-1.0 / 1800.0, 1800.0)];
/// let kernel = MemoryKernel { terms, delay: 300.0 };
/// assert!(kernel.at(0.0) > 0.0 && kernel.at(3600.0) < 0.0 && kernel.integral().abs() < 1e-15);
/// let law = Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.filtered(kernel);
/// # let _ = law;
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MemoryKernel {
    /// The terms of K.
    pub terms: Vec<KernelTerm>,
    /// Reaction time τr, s, not negative.
    pub delay: f64,
}

impl From<Memory> for MemoryKernel {
    fn from(memory: Memory) -> Self {
        Self {
            terms: vec![KernelTerm::decay(1.0 / memory.time, memory.time)],
            delay: memory.delay,
        }
    }
}

impl MemoryKernel {
    /// K at a time (s) after a stimulus and the delay, 1/s.
    #[must_use]
    pub fn at(&self, t: f64) -> f64 {
        let each = self.terms.iter();
        each.map(|term| {
            term.amplitude * (-t / term.time).exp() * (term.frequency * t + term.phase).cos()
        })
        .sum()
    }

    /// ∫ K dt, the response to a constant signal of one.
    #[must_use]
    pub fn integral(&self) -> f64 {
        let response = |term: &KernelTerm| {
            let ([p, q], [by_p, by_q]) = (term.steady(1.0), term.weights());
            by_p * p + by_q * q
        };
        self.terms.iter().map(response).sum()
    }

    /// Checks the terms and the delay.
    ///
    /// # Errors
    /// The first number that is out of range.
    pub fn check(&self) -> Result<(), ParameterError> {
        for term in &self.terms {
            ParameterError::finite("amplitude of a memory kernel", term.amplitude, "1/s")?;
            ParameterError::positive("decay time of a memory kernel", term.time, "s")?;
            ParameterError::not_negative(
                "angular frequency of a memory kernel",
                term.frequency,
                "rad/s",
            )?;
            ParameterError::finite("phase of a memory kernel", term.phase, "rad")?;
        }
        ParameterError::not_negative("reaction time", self.delay, "s")
    }
}
