//! Initial guesses of searches.

use nalgebra::DVector;

use super::problem::Problem;

/// Prime bases of the Halton sequence (J. H. Halton, Numer. Math. 2, 84, 1960) for successive free parameters. Further
/// parameters use them again.
const PRIMES: [u32; 24] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89];

/// Free coordinates of the given initial values, and of `count` − 1 others that cover the space between the bounds
/// evenly.
pub(super) fn initial_guesses(problem: &Problem, count: usize) -> Vec<DVector<f64>> {
    let others = (1..count).map(|index| {
        DVector::from_fn(problem.free.len(), |i, _| {
            let [low, high] = problem.limits(i);
            low + (high - low) * radical_inverse(index as u32, PRIMES[i % PRIMES.len()])
        })
    });
    std::iter::once(problem.coordinates()).chain(others).collect()
}

/// Radical inverse of `index`: its digits in a base, mirrored at the radix point.
fn radical_inverse(mut index: u32, base: u32) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0 / f64::from(base));
    while index > 0 {
        value += digit * f64::from(index % base);
        index /= base;
        digit /= f64::from(base);
    }
    value
}
