//! Fit of a memory kernel by exponentials.

use std::f64::consts::PI;

use nalgebra::{Complex, DMatrix, DVector};

use super::{KernelTerm, MemoryKernel};
use crate::error::ParameterError;
use crate::numerics::dense::{real_schur, singular_values};

/// Largest singular value of the basis that is ignored, relative to the largest one: rounding of
/// its entries.
const ROUNDING: f64 = 1e-14;
/// Largest decay in an interval that is attributed to rounding: that of the entries, times a
/// hundred rows.
const STEADY: f64 = 1e-12;

impl MemoryKernel {
    /// Fits a kernel to its `values` (1/s) at the times 0, h, 2h, … with the `spacing` h (s), by at
    /// most `most` exponentials; a term that oscillates is two of them. Returns the kernel, without
    /// a delay, and the largest error at these times, relative to the largest value.
    ///
    /// Every other value determines the fit, so that the error is also that between the values
    /// which were fitted. The values should cover the kernel until it has decayed. A kernel that
    /// begins with a pause is given from the end of the pause on, which is the
    /// [`delay`](Self::delay).
    ///
    /// The rates are those of the method ESPRIT: with n exponentials, the matrix of K((i + j) h)
    /// has rank n, and its first n singular vectors, shifted by one row, are multiplied by a matrix
    /// with the eigenvalues exp(−λh) (Roy and Kailath, IEEE Trans. Acoust. Speech Signal Process.
    /// 37:984–995, 1989). The amplitudes are those of least squares. Of all numbers of exponentials
    /// the one with the smallest error is returned.
    ///
    /// ```
    /// use morphorod::tropism::MemoryKernel;
    ///
    /// // A gamma distribution of delays, of shape 3 and with a mean of 30 min.
    /// let gamma = |t: f64| 0.5 * (t / 600.0).powi(2) * (-t / 600.0).exp() / 600.0;
    /// let values: Vec<f64> = (0..200).map(|i| gamma(60.0 * f64::from(i))).collect();
    /// let (kernel, error) = MemoryKernel::fit(&values, 60.0, 4)?;
    /// assert!(error < 1e-3 && (kernel.integral() - 1.0).abs() < 1e-3);
    /// # Ok::<(), morphorod::ParameterError>(())
    /// ```
    ///
    /// # Errors
    /// Fewer than 4 `most` + 4 values, values that are not finite or all zero, and a spacing that
    /// is not positive. A kernel that does not decay has no fit.
    pub fn fit(values: &[f64], spacing: f64, most: usize) -> Result<(Self, f64), ParameterError> {
        ParameterError::positive("spacing of the values of a kernel", spacing, "s")?;
        ParameterError::unless(
            most > 0,
            "largest number of exponentials",
            most as f64,
            "positive",
        )?;
        let enough = values.len() / 4 > most;
        let (name, needed) = (
            "number of values of a kernel",
            "at least four times that of exponentials plus four",
        );
        ParameterError::unless(enough, name, values.len() as f64, needed)?;
        let largest = values
            .iter()
            .fold(0.0, |largest: f64, value| largest.max(value.abs()));
        let sum: f64 = values.iter().map(|value| value.abs()).sum();
        let (name, requirement) = (
            "sum of the values of a kernel",
            "not zero, and finite (1/s)",
        );
        ParameterError::unless(largest > 0.0 && sum.is_finite(), name, sum, requirement)?;
        // Squares of scaled values do not overflow.
        let fitted: Vec<f64> = values
            .iter()
            .step_by(2)
            .map(|value| value / largest)
            .collect();
        let rows = fitted.len() / 2;
        let hankel = DMatrix::from_fn(rows, fitted.len() + 1 - rows, |i, j| fitted[i + j]);
        let vectors = singular_values(hankel)
            .and_then(|svd| svd.u)
            .unwrap_or_default();
        let fits = (1..=most.min(vectors.ncols())).filter_map(|n| {
            let rates = rates(&vectors.columns(0, n).into_owned())?;
            let mut terms = terms(&fitted, 2.0 * spacing, &rates)?;
            terms.iter_mut().for_each(|term| term.amplitude *= largest);
            let kernel = Self { terms, delay: 0.0 };
            let error = |(i, value): (usize, &f64)| (kernel.at(i as f64 * spacing) - value).abs();
            // The largest error is NaN if any is.
            let error = values
                .iter()
                .enumerate()
                .map(error)
                .max_by(f64::total_cmp)?
                / largest;
            let finite =
                kernel.check().is_ok() && kernel.integral().is_finite() && error.is_finite();
            finite.then_some((kernel, error))
        });
        let (name, last) = ("last value of a kernel", values[values.len() - 1]);
        let best = fits.min_by(|(_, a), (_, b)| a.total_cmp(b));
        best.ok_or(ParameterError::refused(
            name,
            last,
            "small: the kernel decays",
        ))
    }
}

/// Decays and turns λh in one interval of the exponentials for the first singular vectors.
/// Exponentials that do not decay, or that change their sign in every interval, are left out.
/// `None` if the search fails.
fn rates(vectors: &DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    let rows = vectors.nrows();
    let (upper, lower) = (vectors.rows(0, rows - 1), vectors.rows(1, rows - 1));
    let shift = singular_values(upper.into_owned())?
        .solve(&lower, ROUNDING)
        .ok()?;
    let eigenvalues = real_schur(&shift)?.complex_eigenvalues();
    let rates = eigenvalues.iter().map(|value| -value.ln());
    Some(
        rates
            .filter(|rate| rate.re > STEADY && rate.re.is_finite() && rate.im.abs() < PI)
            .collect(),
    )
}

/// The terms for the rates λh, with the amplitudes of least squares.
fn terms(values: &[f64], spacing: f64, rates: &[Complex<f64>]) -> Option<Vec<KernelTerm>> {
    // One of two conjugate rates is kept.
    let rates: Vec<_> = rates.iter().filter(|rate| rate.im >= 0.0).collect();
    let columns = rates.iter().flat_map(|rate| {
        let wave = DVector::from_fn(values.len(), |i, _| (-**rate * i as f64).exp());
        let (cosine, sine) = (wave.map(|z| z.re), wave.map(|z| z.im));
        if rate.im == 0.0 {
            vec![cosine]
        } else {
            vec![cosine, sine]
        }
    });
    let columns: Vec<_> = columns.collect();
    if columns.is_empty() {
        return None;
    }
    let basis = singular_values(DMatrix::from_columns(&columns))?;
    let cut = ROUNDING * basis.singular_values.max();
    let amplitudes = basis.solve(&DVector::from_column_slice(values), cut).ok()?;
    let mut amplitudes = amplitudes.iter();
    let term = |rate: &&Complex<f64>| {
        let cosine = *amplitudes.next()?;
        // The second column is that of exp(−λh i) for the imaginary part, −sin(ωt) exp(−t/τ).
        let sine = if rate.im == 0.0 {
            0.0
        } else {
            *amplitudes.next()?
        };
        let (time, frequency) = (spacing / rate.re, rate.im / spacing);
        Some(match frequency {
            0.0 => KernelTerm::decay(cosine, time),
            _ => KernelTerm {
                amplitude: cosine.hypot(sine),
                time,
                frequency,
                phase: sine.atan2(cosine),
            },
        })
    };
    rates.iter().map(term).collect()
}
