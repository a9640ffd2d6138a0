//! Rotations: the exponential map of SO(3), its inverse, and the derivatives that an energy of
//! rotations needs.
//!
//! A rotation vector θ stands for the rotation exp(θ̂) about θ by |θ| radians. Every function of θ
//! that occurs here is *one* expression with two coefficients that depend on x = |θ|² alone,
//!
//! ```text
//! F(θ) y = y + c1(x) θ × y + c2(x) θ × (θ × y),
//! ```
//!
//! | map | c1 | c2 |
//! |---|---|---|
//! | exp(θ̂) | S1 | S2 |
//! | Jr(θ), which maps θ' to the Darboux vector in the moving frame | −S2 | S3 |
//! | Jr(θ)⁻¹ | ½ | (1 − S1/(2 S2))/x |
//!
//! with Sn(x) = Σk (−x)^k / (2k + n)!, entire functions of x: S0 = cos |θ|, S1 = sin |θ| / |θ|, and
//! so on. They need no trigonometry near zero and no special case at zero, and their derivatives
//! are dSn/dx = −½ (Sn+1 − n Sn+2). [`Form`] differentiates the expression once and twice for any
//! coefficients.

use nalgebra::{Matrix3, Quaternion, SimdRealField, UnitQuaternion, Vector3};

/// 1/n! for n = 0 … 33.
const INVERSE_FACTORIAL: [f64; 34] = {
    let mut table = [1.0; 34];
    let mut n = 1;
    while n < 34 {
        table[n] = table[n - 1] / n as f64;
        n += 1;
    }
    table
};

/// A number, or several that are computed together.
pub(crate) trait Real: SimdRealField<Element = f64> + Copy {}

impl<T: SimdRealField<Element = f64> + Copy> Real for T {}

/// Sn(x) = Σk (−x)^k / (2k + n)! for n = 0 … 7, at x = |θ|² ≥ 0.
///
/// Accurate to a few units of rounding for |θ| up to π, inside which the rotation vectors of an
/// element lie.
#[inline]
pub(crate) fn s_functions<T: Real>(x: T) -> [T; 8] {
    // Two series at the top, then Sn = 1/n! − x Sn+2 downwards. For large n the series converges in
    // a few terms and the recurrence multiplies rounding by x/((n + 1)(n + 2)), which stays small
    // up to |θ| = π. The first term left out is below 2e-17 of the first at the upper end of each
    // range.
    let terms = match x.simd_horizontal_max() {
        x if x < 0.02 => 4,
        x if x < 1.0 => 7,
        _ => 13,
    };
    let inverse_factorial = |n: usize| T::splat(INVERSE_FACTORIAL[n]);
    let mut s = [T::zero(); 8];
    for k in (0..=terms).rev() {
        s[7] = inverse_factorial(7 + 2 * k) - x * s[7];
        s[6] = inverse_factorial(6 + 2 * k) - x * s[6];
    }
    for n in (0..6).rev() {
        s[n] = inverse_factorial(n) - x * s[n + 2];
    }
    s
}

/// The coefficients c1, c2 of a map F(θ) (see the module's head) with their first two derivatives
/// in x = |θ|².
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Form<T = f64> {
    c1: [T; 3],
    c2: [T; 3],
}

impl<T: Real> Form<T> {
    /// exp(θ̂), from the values of [`s_functions`].
    #[inline]
    pub(crate) fn exp(s: &[T; 8]) -> Self {
        Self {
            c1: derivatives(s, 1),
            c2: derivatives(s, 2),
        }
    }

    /// The right Jacobian Jr(θ): for R = R₀ exp(θ̂) the Darboux vector in the moving frame is u =
    /// Jr(θ) θ'.
    #[inline]
    pub(crate) fn right_jacobian(s: &[T; 8]) -> Self {
        Self {
            c1: derivatives(s, 2),
            c2: derivatives(s, 3),
        }
        .transpose()
    }

    /// Jr(θ)⁻¹; its transpose is the inverse of the left Jacobian. The second derivative is not
    /// provided (zero).
    #[inline]
    pub(crate) fn inverse_right_jacobian(s: &[T; 8]) -> Self {
        // c2 = (1 − S1/(2 S2))/x = (2 S2 − S1)/(2 x S2), and 2 S2 − S1 = x (S3 − 2 S4).
        let [half, four] = [0.5, 4.0].map(T::splat);
        let numerator = s[3] - twice(s[4]);
        let [_, s2d, _] = derivatives(s, 2);
        let [_, s3d, _] = derivatives(s, 3);
        let s4d = -half * (s[5] - four * s[6]);
        let c2 = half * numerator / s[2];
        let c2d = half * (s3d - twice(s4d)) / s[2] - c2 * s2d / s[2];
        Self {
            c1: [half, T::zero(), T::zero()],
            c2: [c2, c2d, T::zero()],
        }
    }

    /// F(θ)ᵀ = F(−θ), as a map of θ. Its [`jacobian`](Self::jacobian) gives ∂²(g · F(θ) y)/∂y∂θ =
    /// ∂(F(θ)ᵀ g)/∂θ.
    #[inline]
    pub(crate) fn transpose(&self) -> Self {
        Self {
            c1: self.c1.map(|c| -c),
            c2: self.c2,
        }
    }

    /// F(θ) as a matrix.
    #[inline]
    pub(crate) fn matrix(&self, theta: &Vector3<T>) -> Matrix3<T> {
        let x = theta.dot(theta);
        let mut m = theta * theta.transpose() * self.c2[0] + theta.cross_matrix() * self.c1[0];
        let d = T::one() - self.c2[0] * x;
        for i in 0..3 {
            m[(i, i)] += d;
        }
        m
    }

    /// F(θ) y.
    #[inline]
    pub(crate) fn apply(&self, theta: &Vector3<T>, y: &Vector3<T>) -> Vector3<T> {
        let c = theta.cross(y);
        y + c * self.c1[0] + theta.cross(&c) * self.c2[0]
    }

    /// ∂(F(θ) y)/∂θ, row i the component, column j the direction.
    #[inline]
    pub(crate) fn jacobian(&self, theta: &Vector3<T>, y: &Vector3<T>) -> Matrix3<T> {
        let x = theta.dot(theta);
        let ty = theta.dot(y);
        let radial =
            theta.cross(y) * self.c1[1] + (theta * ty - y * x) * self.c2[1] - y * self.c2[0];
        let along = radial.map(twice);
        let mut m = along * theta.transpose() + theta * (y * self.c2[0]).transpose()
            - y.cross_matrix() * self.c1[0];
        for i in 0..3 {
            m[(i, i)] += self.c2[0] * ty;
        }
        m
    }

    /// ∂(g · F(θ) y)/∂θ.
    #[inline]
    pub(crate) fn gradient(
        &self,
        theta: &Vector3<T>,
        g: &Vector3<T>,
        y: &Vector3<T>,
    ) -> Vector3<T> {
        let x = theta.dot(theta);
        let (gt, ty, gy) = (g.dot(theta), theta.dot(y), g.dot(y));
        let r = y.cross(g);
        let radial =
            twice(self.c1[1] * theta.dot(&r) + self.c2[1] * (gt * ty - x * gy) - self.c2[0] * gy);
        r * self.c1[0] + g * (self.c2[0] * ty) + y * (self.c2[0] * gt) + theta * radial
    }

    /// ∂²(g · F(θ) y)/∂θ², symmetric.
    #[inline]
    pub(crate) fn hessian(&self, theta: &Vector3<T>, g: &Vector3<T>, y: &Vector3<T>) -> Matrix3<T> {
        let x = theta.dot(theta);
        let (gt, ty, gy) = (g.dot(theta), theta.dot(y), g.dot(y));
        let r = y.cross(g);
        let t = theta.dot(&r);
        let q = gt * ty - x * gy;
        let z = g * ty + y * gt - theta * twice(gy);
        // Half of each symmetric pair θ aᵀ + a θᵀ, with the isotropic and the radial part.
        let a = (r * self.c1[1] + z * self.c2[1] + theta * (self.c1[2] * t + self.c2[2] * q))
            .map(twice);
        let b = y * self.c2[0];
        let isotropic = twice(self.c1[1] * t + self.c2[1] * q - self.c2[0] * gy);
        let mut m = Matrix3::zeros();
        for i in 0..3 {
            for j in 0..=i {
                let v = theta[i] * a[j] + a[i] * theta[j] + g[i] * b[j] + b[i] * g[j];
                m[(i, j)] = v;
                m[(j, i)] = v;
            }
            m[(i, i)] += isotropic;
        }
        m
    }
}

#[inline]
fn twice<T: Real>(x: T) -> T {
    x + x
}

/// Sn and its first two derivatives in x.
#[inline]
fn derivatives<T: Real>(s: &[T; 8], n: usize) -> [T; 3] {
    let (half, nf) = (T::splat(0.5), T::splat(n as f64));
    let first = |k: usize| half * (T::splat(k as f64) * s[k + 2] - s[k + 1]);
    [s[n], first(n), half * (nf * first(n + 2) - first(n + 1))]
}

/// The unit quaternion of exp(θ̂).
#[inline]
pub(crate) fn exp(theta: &Vector3<f64>) -> UnitQuaternion<f64> {
    let half = theta * 0.5;
    let (sin, cos) = half.norm().sin_cos();
    let n = half.norm();
    let sinc = if n > 1e-4 { sin / n } else { 1.0 - n * n / 6.0 };
    UnitQuaternion::new_normalize(Quaternion::from_parts(cos, half * sinc))
}

/// The rotation vector of `q`, of length at most π.
#[inline]
pub(crate) fn log(q: &UnitQuaternion<f64>) -> Vector3<f64> {
    let (w, v) = (q.w, q.vector());
    let n = v.norm();
    // q and −q are the same rotation: take the one of the shorter arc.
    let angle = 2.0 * f64::atan2(n, w.abs());
    let scale = if n > 1e-8 { angle / n } else { 2.0 };
    v * if w < 0.0 { -scale } else { scale }
}

#[cfg(test)]
mod tests;
