//! The function of λ whose zeros are the characteristic roots.

use faer::linalg::solvers::Solve;
use faer::{MatMut, MatRef};
use nalgebra::{Complex, DMatrix};

use super::Linearisation;
use super::linear::Transfers;

/// Part of the spectrum: the zeros of the determinant of a matrix that is analytic in λ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// The isolated roots of a block of unknowns.
    Block(usize),
    /// The essential spectrum of a block of the local problem at the points of a kind.
    Essential(usize),
    /// The own roots of an element of a block: none in truth, those of the mesh.
    Element(usize, usize),
}

/// A characteristic function at one λ.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub value: Complex<f64>,
    /// The logarithmic derivative, s.
    pub log_slope: Complex<f64>,
    /// The inverse distance of the essential spectrum, s: a singularity that the function does not show from afar.
    pub nearness: f64,
}

impl Linearisation {
    /// A function whose zeros are the roots of a part and that tends to one far right.
    ///
    /// For a block it is det M/Π det Mₑ, Mₑ the elements' own problems. M is those and something compact, so this quotient
    /// has a limit as the mesh is refined, with the isolated roots only: those of the short waves and of the mesh drop
    /// out. For the others it is det D/(λ + c)ⁿ, c > 0, D the part's matrix.
    pub(super) fn characteristic(&self, z: Complex<f64>, part: Part) -> Sample {
        self.characteristic_from(z, &self.transfers_at(z), part)
    }

    /// The same, with the transfer functions evaluated for it.
    pub(super) fn characteristic_from(&self, z: Complex<f64>, transfers: &Transfers, part: Part) -> Sample {
        let sample = match part {
            Part::Block(block) if block < self.blocks.len() => Some(self.quotient(z, transfers, block)),
            Part::Block(_) => None,
            Part::Essential(block) => self.local_blocks.get(block).map(|(kind, components)| {
                let local = self.scaled(z, self.local_matrix(z, transfers, *kind, components));
                self.with_memory(z, local, &self.transfers[*kind].memory)
            }),
            Part::Element(block, element) => {
                let element = self.elements.get(block).and_then(|elements| elements.get(element));
                element.map(|element| self.scaled(z, self.element_matrix(z, transfers, element)))
            }
        };
        // A part that is followed along a parameter may be missing for some of its values.
        let nan = Complex::from(f64::NAN);
        sample.unwrap_or(Sample { value: nan, log_slope: nan, nearness: 0.0 })
    }

    /// det D/(λ + c)ⁿ.
    fn scaled(&self, z: Complex<f64>, (matrix, slope): Pair) -> Sample {
        let n = matrix.nrows() as f64;
        let c = z + Complex::from(self.far_left());
        let (value, log_slope) = determinant(matrix / c, slope / c);
        Sample { value, log_slope: log_slope - Complex::from(n) / c, nearness: 0.0 }
    }

    /// Times det(λ − ∂rates/∂variables)/(λ + c)ᵛ, which cancels the poles of T: where variables grow by themselves these
    /// lie on the right.
    fn with_memory(&self, z: Complex<f64>, mut at: Sample, memory: &[Complex<f64>]) -> Sample {
        let c = z + Complex::from(self.far_left());
        for rate in memory {
            at.value *= (z - rate) / c;
            at.log_slope += (z - rate).inv() - c.inv();
        }
        at
    }

    /// c > 0 with −c left of every line that is counted on.
    fn far_left(&self) -> f64 {
        self.slowest_rate() - 2.0 * self.leftmost()
    }

    /// det M/Π det Mₑ.
    fn quotient(&self, z: Complex<f64>, transfers: &Transfers, block: usize) -> Sample {
        let (matrix, slope) = self.block_matrix(z, transfers, &self.blocks[block]);
        let (mut value, mut log_slope) = (Complex::<f64>::ONE, Complex::<f64>::ZERO);
        let mut nearness = 0.0_f64;
        let mut divisors = Vec::with_capacity(matrix.nrows());
        for element in &self.elements[block] {
            let (own, own_slope) = self.element_matrix(z, transfers, element);
            let size = own.nrows();
            let (d, d_slope) = determinant(own, own_slope);
            divisors.extend(std::iter::repeat_n(d.powf(1.0 / size as f64), size * element.number));
            log_slope -= d_slope * element.number as f64;
            nearness = nearness.max(self.nearness(z, transfers, element));
        }
        let (pivots, odd, trace) = factorise(&matrix, slope);
        // Pivot by pivot, or the determinants of many points over- or underflow.
        for (pivot, divisor) in pivots.iter().zip(&divisors) {
            value *= pivot / divisor;
        }
        if odd {
            value = -value;
        }
        Sample { value, log_slope: log_slope + trace, nearness }
    }
}

/// A matrix and its derivative by λ.
pub(super) type Pair = (DMatrix<Complex<f64>>, DMatrix<Complex<f64>>);

/// det A and tr(A⁻¹ A').
fn determinant(matrix: DMatrix<Complex<f64>>, slope: DMatrix<Complex<f64>>) -> (Complex<f64>, Complex<f64>) {
    let (pivots, odd, trace) = factorise(&matrix, slope);
    let product = pivots.iter().product::<Complex<f64>>();
    (if odd { -product } else { product }, trace)
}

/// The pivots of A, whether its rows were exchanged an odd number of times, and tr(A⁻¹ A').
fn factorise(
    matrix: &DMatrix<Complex<f64>>,
    mut slope: DMatrix<Complex<f64>>,
) -> (Vec<Complex<f64>>, bool, Complex<f64>) {
    let n = matrix.nrows();
    let lu = MatRef::from_column_major_slice(matrix.as_slice(), n, n).partial_piv_lu();
    lu.solve_in_place(MatMut::from_column_major_slice_mut(slope.as_mut_slice(), n, n));
    let pivots: Vec<Complex<f64>> = (0..n).map(|i| lu.U()[(i, i)]).collect();
    // Each cycle of even length is an odd permutation.
    let (rows, _) = lu.P().arrays();
    let mut seen = vec![false; n];
    let mut odd = false;
    for start in 0..n {
        let (mut row, mut length) = (start, 0);
        while !std::mem::replace(&mut seen[row], true) {
            row = rows[row];
            length += 1;
        }
        odd ^= length > 0 && length % 2 == 0;
    }
    let singular = pivots.contains(&Complex::ZERO);
    (pivots, odd, if singular { Complex::from(f64::INFINITY) } else { slope.trace() })
}
