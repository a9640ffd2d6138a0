//! Fourier sums at equally spaced frequencies over samples at any angles.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use super::sines::sines;

/// Number of points of the grid on either side of a sample to which it is distributed.
const REACH: usize = 18;

/// Computes Σ zⱼ e^(ikθⱼ) for all k up to a largest one.
///
/// Samples are distributed to a uniform grid with Gaussian weights, and the transform of the grid
/// is divided by that of a Gaussian: Greengard and Lee (2004), *Accelerating the Nonuniform Fast
/// Fourier Transform*, SIAM Review 46. The grid has at least 3/2 as many points as there are
/// frequencies −k … k. The error is then below 4 exp(−mπ/2) = 2e-12 times Σ |zⱼ| with m =
/// [`REACH`]: Steidl (1998), *A note on fast Fourier transforms for nonequispaced grids*, Adv.
/// Comput. Math. 9.
pub(crate) struct FourierSums {
    /// First point of the grid to which a sample is distributed, for each sample.
    first: Vec<usize>,
    /// Weights of this point and of those that follow, 2 [`REACH`] for each sample.
    weights: Vec<f64>,
    /// Number of points of the grid, from the first one, to which samples are distributed.
    occupied: usize,
    /// Factors of the transform, for k = 0, 1, …. They contain the angle of the first point of the
    /// grid.
    factors: Vec<Complex<f64>>,
    /// exp(2πij/n) for j up to n/2, with the number n of points of the grid.
    roots: Vec<Complex<f64>>,
}

impl FourierSums {
    /// Sums over samples at increasing `angles`, for k from 0 to `count` − 1.
    pub fn new(angles: &[f64], count: usize) -> Self {
        let modes = (2 * count + 1) as f64;
        let size = ((1.5 * modes) as usize).max(4 * REACH).next_power_of_two();
        let interval = TAU / size as f64;
        // The weight at a distance of x grid points is exp(−decay x²).
        let decay = PI * (1.0 - 0.5 * modes / size as f64) / REACH as f64;
        let shrink = (-2.0 * decay).exp();
        let least = angles.first().copied().unwrap_or(0.0);
        let (mut first, mut weights) = (
            Vec::with_capacity(angles.len()),
            Vec::with_capacity(2 * REACH * angles.len()),
        );
        let mut occupied = 0;
        for angle in angles {
            let place = (angle - least) / interval;
            let begin = place.floor() as usize;
            occupied = (begin + 2 * REACH).min(size).max(occupied);
            first.push(begin % size);
            let distance = place.fract() + (REACH - 1) as f64;
            // Successive weights have quotients that decrease by a constant factor.
            let mut weight = (-decay * distance * distance).exp();
            let mut quotient = (decay * (2.0 * distance - 1.0)).exp();
            for _ in 0..2 * REACH {
                weights.push(weight);
                weight *= quotient;
                quotient *= shrink;
            }
        }
        let width = 0.5 * interval / decay.sqrt();
        let origin = least - (REACH - 1) as f64 * interval;
        let mut factors = waves(count as f64 * origin, count, count);
        for (k, factor) in factors.iter_mut().enumerate() {
            *factor *= (k as f64 * width).powi(2).exp() * (decay / PI).sqrt();
        }
        Self {
            first,
            weights,
            occupied,
            factors,
            roots: waves(TAU, size / 2, size),
        }
    }

    /// The sums for two series of real numbers, for each k. The series are the real and the
    /// imaginary parts of `values`. The real part of a sum is that with cosines, and the imaginary
    /// part is that with sines.
    pub fn of(&self, values: impl Iterator<Item = Complex<f64>>) -> Vec<[Complex<f64>; 2]> {
        let size = 2 * self.roots.len();
        // The transform extends the grid to its whole size in the same memory.
        let mut grid = Vec::with_capacity(size);
        grid.resize(self.occupied, Complex::ZERO);
        for ((value, first), weights) in values
            .zip(&self.first)
            .zip(self.weights.chunks_exact(2 * REACH))
        {
            // The grid is periodic.
            let (inside, outside) = weights.split_at(weights.len().min(size - first));
            let add = |(sum, weight): (&mut Complex<f64>, &f64)| *sum += value * weight;
            grid[*first..].iter_mut().zip(inside).for_each(add);
            grid.iter_mut().zip(outside).for_each(add);
        }
        let sums = transform(&self.roots, grid);
        // The transform of a real series at −k is the conjugate of that at k.
        let separate = |(k, factor): (usize, &Complex<f64>)| {
            let (plus, minus) = (sums[k % size], sums[(size - k) % size].conj());
            let odd = plus - minus;
            [
                0.5 * factor * (plus + minus),
                0.5 * factor * Complex::new(odd.im, -odd.re),
            ]
        };
        self.factors.iter().enumerate().map(separate).collect()
    }
}

/// exp(i `angle` k/`size`) for k from 0 to `count` − 1.
fn waves(angle: f64, count: usize, size: usize) -> Vec<Complex<f64>> {
    let parts: Vec<f64> = (0..count).map(|k| k as f64 / size as f64).collect();
    let (mut sine, mut cosine) = (parts.clone(), parts.clone());
    sines(angle, &parts, &mut sine, &mut cosine);
    cosine
        .into_iter()
        .zip(sine)
        .map(|(cosine, sine)| Complex::new(cosine, sine))
        .collect()
}

/// Discrete Fourier transform Σ zⱼ e^(2πijk/n), n a power of two (Cooley and Tukey 1965). `roots`
/// are the first n/2 of the n-th roots of unity. If there are fewer than n `values`, the others are
/// zero.
fn transform(roots: &[Complex<f64>], mut values: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
    let half = roots.len();
    // Stockham's order: each pass reads one array and writes the other, so that nothing is
    // reordered.
    let mut next = Vec::with_capacity(2 * half);
    let mut run = 1;
    // The values beyond the given ones are zero, and the first passes do not read them.
    while run <= half && values.len() < 2 * half {
        next.clear();
        let (low, high) = values.split_at(values.len().min(half));
        let mut high = high.chunks_exact(run);
        for (low, root) in low.chunks_exact(run).zip(roots.iter().step_by(run)) {
            if let Some(high) = high.next() {
                next.extend(low.iter().zip(high).map(|(a, b)| a + b));
                next.extend(low.iter().zip(high).map(|(a, b)| (a - b) * root));
            } else {
                next.extend_from_slice(low);
                next.extend(low.iter().map(|a| a * root));
            }
        }
        std::mem::swap(&mut values, &mut next);
        run *= 2;
    }
    // Only an empty array is not full yet.
    values.resize(2 * half, Complex::ZERO);
    next.resize(2 * half, Complex::ZERO);
    while run <= half {
        let (low, high) = values.split_at(half);
        let pairs = low
            .chunks_exact(run)
            .zip(high.chunks_exact(run))
            .zip(next.chunks_exact_mut(2 * run));
        for (((low, high), next), root) in pairs.zip(roots.iter().step_by(run)) {
            butterflies(*root, low, high, next.split_at_mut(run).into());
        }
        std::mem::swap(&mut values, &mut next);
        run *= 2;
    }
    values
}

/// Writes the sums of two series of complex numbers, and their differences times a root of unity.
/// It is not inlined, because the compiler then knows that the slices do not overlap.
#[inline(never)]
fn butterflies(
    root: Complex<f64>,
    low: &[Complex<f64>],
    high: &[Complex<f64>],
    to: [&mut [Complex<f64>]; 2],
) {
    let [sum, turned] = to;
    for (((a, b), sum), turned) in low.iter().zip(high).zip(sum).zip(turned) {
        *sum = a + b;
        *turned = (a - b) * root;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn fourier_sums_of_unevenly_spaced_samples_are_direct_sums() {
        for (samples, count) in [(0, 3), (1, 1), (7, 5), (50, 170), (90, 600)] {
            // Angles in clusters, beyond a turn on either side, and values of both signs.
            let mut angles: Vec<f64> = (0..samples)
                .map(|j| 9.0 * (f64::from(j * j) * 0.37).sin())
                .collect();
            angles.sort_by(f64::total_cmp);
            let values = |j: usize| [(0.3 * j as f64).cos(), (1.7 * j as f64 + 0.2).sin()];
            let sums = FourierSums::new(&angles, count).of((0..angles.len())
                .map(values)
                .map(|[a, b]| Complex::new(a, b)));
            for (k, sums) in sums.into_iter().enumerate() {
                let mut exact = [Complex::ZERO; 2];
                for (j, angle) in angles.iter().enumerate() {
                    let wave = Complex::cis(k as f64 * angle);
                    exact
                        .iter_mut()
                        .zip(values(j))
                        .for_each(|(sum, value)| *sum += wave * value);
                }
                // The stated error and rounding; values are at most one.
                for c in 0..2 {
                    assert_abs_diff_eq!(
                        sums[c].re,
                        exact[c].re,
                        epsilon = 1e-11 * f64::from(samples)
                    );
                    assert_abs_diff_eq!(
                        sums[c].im,
                        exact[c].im,
                        epsilon = 1e-11 * f64::from(samples)
                    );
                }
            }
        }
    }
}
