//! The matrix of the reactions.

use nalgebra::{DMatrix, DVector, Dyn, LU, SymmetricEigen};

/// Largest eigenvalue of the bordered matrix that is attributed to rounding, relative to its scale.
pub(super) const NEUTRAL: f64 = 1e-8;

/// The matrix of the reactions, D − Bᵀ K⁻¹ B, scaled to a diagonal of the order of one and diagonalised.
pub(super) struct Dense {
    pub scale: DVector<f64>,
    pub eigen: SymmetricEigen<f64, Dyn>,
    /// Factors of the matrix with friction that slides, which is not symmetric.
    pub coupled: Option<LU<f64, Dyn, Dyn>>,
}

impl Dense {
    pub fn of(dense: &DMatrix<f64>, scale: DVector<f64>, coupled: Option<DMatrix<f64>>) -> Self {
        let n = scale.len();
        let scaled = |m: DMatrix<f64>| DMatrix::from_fn(n, n, |i, j| m[(i, j)] * scale[i] * scale[j]);
        let coupled = coupled.map(|coupled| scaled(coupled).lu());
        let scaled = DMatrix::from_fn(n, n, |i, j| dense[(i, j)] * scale[i] * scale[j]);
        let eigen = if n > 0 {
            SymmetricEigen::new(scaled)
        } else {
            SymmetricEigen { eigenvectors: scaled, eigenvalues: DVector::zeros(0) }
        };
        Self { scale, eigen, coupled }
    }

    /// Solves for the reactions. Neutral directions keep their reactions.
    pub fn solve(&self, rhs: &DVector<f64>) -> DVector<f64> {
        if let Some(coupled) = &self.coupled {
            let scaled = rhs.component_mul(&self.scale);
            let unknown = || DVector::from_element(rhs.len(), f64::NAN);
            return coupled.solve(&scaled).unwrap_or_else(unknown).component_mul(&self.scale);
        }
        let mut y = self.eigen.eigenvectors.tr_mul(&rhs.component_mul(&self.scale));
        for (y, value) in y.iter_mut().zip(self.eigen.eigenvalues.iter()) {
            *y = if value.abs() <= NEUTRAL { 0.0 } else { *y / value };
        }
        (&self.eigen.eigenvectors * y).component_mul(&self.scale)
    }
}
