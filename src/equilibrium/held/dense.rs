//! The matrix of the reactions.

use nalgebra::{DMatrix, DVector, Dyn, LU, SymmetricEigen};

/// Largest eigenvalue of the bordered matrix that is attributed to rounding, relative to its scale.
pub(super) const NEUTRAL: f64 = 1e-8;

/// The matrix of the reactions, D − Bᵀ K⁻¹ B, scaled to a diagonal of the order of one, with its eigenvalues.
pub(super) struct Dense {
    pub scale: DVector<f64>,
    pub eigenvalues: DVector<f64>,
    factors: Factors,
}

/// Factors with which the reactions are solved for.
enum Factors {
    /// Eigenvectors of the symmetric matrix.
    Symmetric(DMatrix<f64>),
    /// Factors of the matrix with friction, which is not symmetric.
    Coupled(LU<f64, Dyn, Dyn>),
}

impl Dense {
    pub fn of(dense: &DMatrix<f64>, scale: DVector<f64>, coupled: Option<DMatrix<f64>>) -> Self {
        let n = scale.len();
        let scaled = |m: &DMatrix<f64>| DMatrix::from_fn(n, n, |i, j| m[(i, j)] * scale[i] * scale[j]);
        let symmetric = scaled(dense);
        let (eigenvalues, factors) = match coupled {
            _ if n == 0 => (DVector::zeros(0), Factors::Symmetric(symmetric)),
            Some(coupled) => (symmetric.symmetric_eigenvalues(), Factors::Coupled(scaled(&coupled).lu())),
            None => {
                let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(symmetric);
                (eigenvalues, Factors::Symmetric(eigenvectors))
            }
        };
        Self { scale, eigenvalues, factors }
    }

    /// Solves for the reactions. Neutral directions keep their reactions.
    pub fn solve(&self, rhs: &DVector<f64>) -> DVector<f64> {
        let scaled = rhs.component_mul(&self.scale);
        match &self.factors {
            Factors::Coupled(coupled) => {
                let unknown = || DVector::from_element(rhs.len(), f64::NAN);
                coupled.solve(&scaled).unwrap_or_else(unknown).component_mul(&self.scale)
            }
            Factors::Symmetric(vectors) => {
                let mut y = vectors.tr_mul(&scaled);
                for (y, value) in y.iter_mut().zip(self.eigenvalues.iter()) {
                    *y = if value.abs() <= NEUTRAL { 0.0 } else { *y / value };
                }
                (vectors * y).component_mul(&self.scale)
            }
        }
    }
}
