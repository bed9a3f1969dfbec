//! How far a reduced machine can be from the full one.

use super::rounding::{U, quadratic};

/// Bounds of `|f - g|` for a full RBF machine `f = <w, phi(x)> - rho` and a reduced one `g = <w_m, phi(x)> -
/// rho` whose vectors are `c_1 .. c_m`.
///
/// Let `delta = w - w_m`, `r >= |delta|` and `e >= max_j |<delta, phi(c_j)>| = max_j |f(c_j) - g(c_j)|`. For
/// any query x and any `c_j` with `K = K(x, c_j)`, split `phi(x) = K phi(c_j) + p`. As `|phi(c_j)| = 1` and
/// `<phi(x), phi(c_j)> = K`, p is orthogonal to `phi(c_j)`, and `|p|^2 = |phi(x)|^2 - K^2 = 1 - K^2`. So
///
/// ```text
/// |f(x) - g(x)| = |<delta, phi(x)>| = |K <delta, phi(c_j)> + <delta, p>| <= K e + r sqrt(1 - K^2)      (1)
///                                                                      <= sqrt(r^2 + e^2)            (2)
/// ```
///
/// by Cauchy and Schwarz, twice in (2). Nothing is assumed about how `w_m` was found: it need not be the
/// projection, only e is small when it nearly is. (Without e, for the exact projection: Wendland 2005, theorem
/// 11.4, with one point of the power function's minimum.) `1 - K^2 = -expm1(-2 gamma d^2)` loses no digits near
/// a vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBound {
    gamma: f64,
    features: usize,
    norm: f64,
    at_vectors: f64,
}

impl ErrorBound {
    /// From parts of `|delta|^2 = |w|^2 - 2 <w, w_m> + |w_m|^2` computed with compensated sums, the largest
    /// difference at the vectors, and the sum of the absolute coefficients of both machines. Rounding is
    /// allowed for.
    pub(crate) fn new(gamma: f64, features: usize, delta2: f64, at_vectors: f64, mass: f64) -> Self {
        let norm = (delta2.max(0.0) + quadratic(gamma, features, mass)).sqrt() * (1.0 + 4.0 * U);
        // The same kinds of operations with one sum less; |phi| = 1.
        let at_vectors = at_vectors + quadratic(gamma, features, mass.max(1.0)) / mass.max(1.0);
        Self { gamma, features, norm, at_vectors }
    }

    /// r: the norm of the difference in the kernel's Hilbert space is at most this.
    #[must_use]
    pub fn norm(&self) -> f64 {
        self.norm
    }

    /// e: at the reduced machine's vectors the difference is at most this.
    #[must_use]
    pub fn at_vectors(&self) -> f64 {
        self.at_vectors
    }

    /// Bound (2), for any query.
    #[must_use]
    pub fn anywhere(&self) -> f64 {
        self.norm.hypot(self.at_vectors) * (1.0 + 8.0 * U)
    }

    /// Bound (1), at the squared distance `distance2` (computed in f64) from one of the vectors.
    #[must_use]
    pub fn near(&self, distance2: f64) -> f64 {
        let t = self.gamma * distance2;
        let k = (-t).exp();
        let sine = (-(-2.0 * t).exp_m1()).max(0.0).sqrt();
        // sqrt(1 - K^2) has at most the relative error of t, as 1 - exp(-2t) is concave in t and 0 at 0; K's
        // error is absolute. Squares that underflow count as 1e-300.
        let relative = (self.features as f64 + 16.0) * U;
        let tiny = (self.gamma * self.features as f64 * 1e-300).sqrt();
        (k * self.at_vectors + (sine + tiny) * self.norm) * (1.0 + relative) + relative * self.at_vectors
    }
}
