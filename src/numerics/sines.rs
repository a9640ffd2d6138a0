//! Sines and cosines of many angles.

use std::f64::consts::TAU;

/// Upper part of 2π. It has 26 bits, so that its product with up to 2²⁰ whole turns is exact.
const UPPER: f64 = f64::from_bits(TAU.to_bits() & !((1 << 27) - 1));
/// 2π minus [`UPPER`]. The last term is 2π minus its nearest number.
const LOWER: f64 = (TAU - UPPER) + 2.449_293_598_294_706_4e-16;
/// A number added to this one and subtracted again is rounded to an integer: 3/2 of 2⁵².
const ROUNDING: f64 = 6_755_399_441_055_744.0;
/// Largest angle from which whole turns are subtracted with an error below 1e-16.
const LARGEST: f64 = TAU * (1 << 20) as f64;

/// Number of terms of the Taylor series. The next ones are below 1e-16 at π/2.
const TERMS: usize = 11;
/// Coefficients of the Taylor series of cos x and (sin x)/x in powers of x², the highest first.
const SERIES: [[f64; 2]; TERMS] = {
    let mut series = [[1.0; 2]; TERMS];
    let mut k = 1;
    while k < TERMS {
        let n = 2.0 * k as f64;
        let [cosine, sine] = series[TERMS - k];
        series[TERMS - 1 - k] = [-cosine / (n * (n - 1.0)), -sine / (n * (n + 1.0))];
        k += 1;
    }
    series
};

/// Writes sines and cosines of the angles `omega` · `times` with errors below 1e-15. Times are at
/// most one in magnitude.
///
/// Whole turns are subtracted from an angle, and the Taylor series of both functions are evaluated
/// at half of the rest. The loop has no branches, so that the compiler vectorises it.
pub(crate) fn sines(omega: f64, times: &[f64], sines: &mut [f64], cosines: &mut [f64]) {
    let all = times.iter().zip(sines).zip(cosines);
    if omega.abs() < LARGEST {
        all.for_each(|((time, sine), cosine)| (*sine, *cosine) = sin_cos(omega * time));
    } else {
        all.for_each(|((time, sine), cosine)| (*sine, *cosine) = (omega * time).sin_cos());
    }
}

/// Sine and cosine of an angle below [`LARGEST`].
#[inline]
fn sin_cos(angle: f64) -> (f64, f64) {
    let turns = (angle * TAU.recip() + ROUNDING) - ROUNDING;
    let half = 0.5 * ((angle - turns * UPPER) - turns * LOWER);
    let square = half * half;
    // Horner's scheme.
    let [mut cosine, mut sine] = SERIES[0];
    for [even, odd] in SERIES.into_iter().skip(1) {
        cosine = cosine * square + even;
        sine = sine * square + odd;
    }
    sine *= half;
    (2.0 * sine * cosine, 1.0 - 2.0 * sine * sine)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn sines_and_cosines_are_those_of_the_standard_library() {
        let times: Vec<f64> = (-500..=500).map(|k| f64::from(k) / 500.0).collect();
        let (mut s, mut c) = (vec![0.0; times.len()], vec![0.0; times.len()]);
        // Small and large angles, and those beyond the exact reduction.
        for omega in [0.0, 1e-8, 0.7, -3.0, 250.0, 1e5, 6.5e6, 1e12] {
            sines(omega, &times, &mut s, &mut c);
            for (i, t) in times.iter().enumerate() {
                let (sine, cosine) = (omega * t).sin_cos();
                // The stated error.
                assert_abs_diff_eq!(s[i], sine, epsilon = 1e-15);
                assert_abs_diff_eq!(c[i], cosine, epsilon = 1e-15);
            }
        }
    }
}
