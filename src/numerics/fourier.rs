//! Fourier sums at equally spaced frequencies over samples at any angles.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use super::sines::sines;

/// Number of points of the grid on either side of a sample to which it is distributed.
const REACH: usize = 18;

/// Computes Σ zⱼ e^(ikθⱼ) for all k up to a largest one.
///
/// Samples are distributed to a uniform grid with Gaussian weights, and the transform of the grid is divided by that
/// of a Gaussian: Greengard and Lee (2004), *Accelerating the Nonuniform Fast Fourier Transform*, SIAM Review 46. The
/// grid has at least 3/2 as many points as there are frequencies −k … k. The error is then below 4 exp(−mπ/2) = 2e-12
/// times Σ |zⱼ| with m = [`REACH`]: Steidl (1998), *A note on fast Fourier transforms for nonequispaced grids*, Adv.
/// Comput. Math. 9.
pub(crate) struct FourierSums {
    /// First point of the grid to which a sample is distributed, for each sample.
    first: Vec<usize>,
    /// Weights of this point and of those that follow, 2 [`REACH`] for each sample.
    weights: Vec<f64>,
    /// Number of points of the grid, from the first one, to which samples are distributed.
    occupied: usize,
    /// Factors of the transform, for k = 0, 1, …. They contain the angle of the first point of the grid.
    factors: Vec<Complex<f64>>,
    transform: FourierTransform,
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
        let (mut first, mut weights) = (Vec::with_capacity(angles.len()), Vec::with_capacity(2 * REACH * angles.len()));
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
        let parts: Vec<f64> = (0..count).map(|k| k as f64 / count as f64).collect();
        let (mut sine, mut cosine) = (vec![0.0; count], vec![0.0; count]);
        sines(count as f64 * origin, &parts, &mut sine, &mut cosine);
        let factor = |(k, (cosine, sine)): (usize, (&f64, &f64))| {
            Complex::new(*cosine, *sine) * ((k as f64 * width).powi(2).exp() * (decay / PI).sqrt())
        };
        let factors = cosine.iter().zip(&sine).enumerate().map(factor).collect();
        Self { first, weights, occupied, factors, transform: FourierTransform::new(size) }
    }

    /// The sums for two series of real numbers, for each k. Their real parts are sums with cosines, and their imaginary
    /// parts are sums with sines.
    pub fn of(&self, values: impl Iterator<Item = [f64; 2]>) -> Vec<[Complex<f64>; 2]> {
        let size = self.transform.size();
        let mut grid = vec![[0.0; 2]; self.occupied];
        for ((values, first), weights) in values.zip(&self.first).zip(self.weights.chunks_exact(2 * REACH)) {
            // The grid is periodic.
            let (inside, outside) = weights.split_at(weights.len().min(size - first));
            let add = |(sums, weight): (&mut [f64; 2], &f64)| {
                sums[0] += values[0] * weight;
                sums[1] += values[1] * weight;
            };
            grid[*first..].iter_mut().zip(inside).for_each(add);
            grid.iter_mut().zip(outside).for_each(add);
        }
        let sums = self.transform.of(grid);
        let at = |k: usize| Complex::new(sums[k % size][0], sums[k % size][1]);
        // The transform of a real series at −k is the conjugate of that at k.
        let separate = |(k, factor): (usize, &Complex<f64>)| {
            let (plus, minus) = (at(k), at(size - k).conj());
            let odd = plus - minus;
            [0.5 * factor * (plus + minus), 0.5 * factor * Complex::new(odd.im, -odd.re)]
        };
        self.factors.iter().enumerate().map(separate).collect()
    }
}

/// Discrete Fourier transform Σ zⱼ e^(2πijk/n), n a power of two (Cooley and Tukey 1965).
struct FourierTransform {
    /// Cosines and sines of 2πj/n for j up to n/2.
    roots: Vec<[f64; 2]>,
}

impl FourierTransform {
    /// Transform of a given size, a power of two.
    fn new(size: usize) -> Self {
        let parts: Vec<f64> = (0..size / 2).map(|j| j as f64 / size as f64).collect();
        let (mut sine, mut cosine) = (parts.clone(), parts.clone());
        sines(TAU, &parts, &mut sine, &mut cosine);
        Self { roots: cosine.into_iter().zip(sine).map(|(c, s)| [c, s]).collect() }
    }

    fn size(&self) -> usize {
        2 * self.roots.len()
    }

    /// Transforms complex numbers. Those that lack to the size are zero.
    fn of(&self, mut values: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
        let half = self.roots.len();
        // Stockham's order: each pass reads one array and writes the other, so that nothing is reordered.
        let mut next = Vec::with_capacity(2 * half);
        let mut run = 1;
        // The second factors of all butterflies are zero while the values fill half of the size.
        while run <= half && values.len() <= half {
            next.clear();
            for (low, [re, im]) in values.chunks_exact(run).zip(self.roots.iter().step_by(run)) {
                next.extend_from_slice(low);
                next.extend(low.iter().map(|a| [a[0] * re - a[1] * im, a[1] * re + a[0] * im]));
            }
            std::mem::swap(&mut values, &mut next);
            run *= 2;
        }
        values.resize(2 * half, [0.0; 2]);
        next.resize(2 * half, [0.0; 2]);
        while run <= half {
            let (low, high) = values.split_at(half);
            let pairs = low.chunks_exact(run).zip(high.chunks_exact(run)).zip(next.chunks_exact_mut(2 * run));
            for (((low, high), next), root) in pairs.zip(self.roots.iter().step_by(run)) {
                butterflies(*root, low, high, next.split_at_mut(run));
            }
            std::mem::swap(&mut values, &mut next);
            run *= 2;
        }
        values
    }
}

/// Writes the sums of two series of complex numbers, and their differences times a root of unity. It is not inlined,
/// because the compiler then knows that the slices do not overlap.
#[inline(never)]
fn butterflies(
    [re, im]: [f64; 2],
    low: &[[f64; 2]],
    high: &[[f64; 2]],
    (sum, turned): (&mut [[f64; 2]], &mut [[f64; 2]]),
) {
    for (((a, b), sum), turned) in low.iter().zip(high).zip(sum).zip(turned) {
        let d = [a[0] - b[0], a[1] - b[1]];
        *sum = [a[0] + b[0], a[1] + b[1]];
        *turned = [d[0] * re - d[1] * im, d[1] * re + d[0] * im];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn fourier_sums_of_unevenly_spaced_samples_are_direct_sums() {
        for (samples, count) in [(1, 1), (7, 5), (50, 170), (90, 600)] {
            // Angles in clusters, beyond a turn on either side, and values of both signs.
            let mut angles: Vec<f64> = (0..samples).map(|j| 9.0 * (f64::from(j * j) * 0.37).sin()).collect();
            angles.sort_by(f64::total_cmp);
            let values = |j: usize| [(0.3 * j as f64).cos(), (1.7 * j as f64 + 0.2).sin()];
            let sums = FourierSums::new(&angles, count).of((0..angles.len()).map(values));
            for (k, sums) in sums.into_iter().enumerate() {
                let mut exact = [Complex::ZERO; 2];
                for (j, angle) in angles.iter().enumerate() {
                    let wave = Complex::cis(k as f64 * angle);
                    exact.iter_mut().zip(values(j)).for_each(|(sum, value)| *sum += wave * value);
                }
                // The stated error and rounding; values are at most one.
                for c in 0..2 {
                    assert_abs_diff_eq!(sums[c].re, exact[c].re, epsilon = 1e-11 * f64::from(samples));
                    assert_abs_diff_eq!(sums[c].im, exact[c].im, epsilon = 1e-11 * f64::from(samples));
                }
            }
        }
    }
}
