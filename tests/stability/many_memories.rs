//! Laws with hundreds of variables. Independent memories are analysed quickly, and long chains of
//! variables are refused.

use approx::assert_relative_eq;
use morphorod::Still;
use morphorod::stability::{Linearisation, StabilityError};
use morphorod::tropism::{Declaration, Growing, SettledStatoliths, Site, TropismLaw, Variable};
use nalgebra::Vector3;

use super::edges::{BENDING, analyse};
use crate::fixtures::shoots::{MEMORY, WEIGHT, gravitropism};

/// Gravitropism with pairs of memories of the vertical.
struct Pairs {
    number: usize,
    /// Whether each pair is a memory of the preceding pair. Otherwise each pair is a memory of the
    /// vertical. The gradient is the response to the mean of all pairs.
    chain: bool,
}

impl TropismLaw for Pairs {
    fn declare(&self, to: &mut Declaration) {
        let up = to.stimulus_pair();
        for _ in 0..self.number {
            if self.chain {
                (0..2).for_each(|_| {
                    _ = to.variable(Variable::read_after(MEMORY.delay).relaxing_in(MEMORY.time))
                });
            } else {
                to.memories(2, up, MEMORY.time, Some(MEMORY.delay));
            }
        }
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        stimuli.copy_from_slice(site.along_directors(&site.environment.up()).xy().as_slice());
    }
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        for (k, rate) in rates.iter_mut().enumerate() {
            let remembered = if self.chain && k > 1 {
                variables[k - 2]
            } else {
                stimuli[k % 2]
            };
            *rate = MEMORY.rate(variables[k], remembered);
        }
    }
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        variables
            .iter_mut()
            .enumerate()
            .for_each(|(k, y)| *y = stimuli[k % 2]);
    }
    fn gradient(&self, at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        let [mut first, mut second] = [0.0; 2];
        past.chunks_exact(2)
            .for_each(|pair| (first, second) = (first + pair[0], second + pair[1]));
        Vector3::new(-second, first, 0.0) * (0.8 / at.section.radius() / self.number as f64)
    }
}

fn linear(law: impl TropismLaw + Send + Sync + 'static) -> Result<Linearisation, StabilityError> {
    analyse((law, BENDING), WEIGHT, Still::upright(), 20.0, 0.067, 2)
}

/// An earlier version used one matrix for all variables, and took more than 90 s for its
/// eigenvalues and its factorisation at every λ.
#[test]
fn thousand_equal_memories_have_the_roots_of_one_memory() {
    let one = linear(gravitropism(SettledStatoliths)).unwrap();
    let many = linear(Pairs {
        number: 500,
        chain: false,
    })
    .unwrap();
    assert_eq!(many.unstable(), one.unstable());
    let [one, many] = [one, many].map(|linear| linear.rightmost().unwrap().value);
    // The relative error of the finite differences of the laws is 1e-9. The relative error of a sum
    // of 500 terms is 1e-13.
    assert_relative_eq!(many.re, one.re, epsilon = 1e-8 * one.norm());
    assert_relative_eq!(many.im, one.im, epsilon = 0.0, max_relative = 1e-8);
}

#[test]
fn long_chain_of_variables_is_refused_with_its_work() {
    assert!(
        linear(Pairs {
            number: 30,
            chain: true
        })
        .unwrap()
        .unstable()
        .is_ok()
    );
    let error = linear(Pairs {
        number: 500,
        chain: true,
    })
    .unwrap_err();
    // Each of the two components has a chain of 500 variables, which requires 500³ operations.
    let StabilityError::TooMuchWork {
        amount: operations,
        most,
        ..
    } = error
    else {
        panic!("{error}")
    };
    assert_relative_eq!(operations, 2.5e8, epsilon = 0.0, max_relative = 1e-6);
    assert!(most < operations, "{error}");
}
